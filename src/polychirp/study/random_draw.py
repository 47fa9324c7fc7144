"""Random traffic and fluctuating points of a study, drawn from its seed."""

from dataclasses import replace

from polychirp.errors import InputError
from polychirp.rng import Streams
from polychirp.study.spec import Study, StudyRadar
from polychirp.study.traffic import StudyTraffic
from polychirp.traffic.mounting import bumper_mount
from polychirp.traffic.street import Vehicle


def sample_street(study: Study) -> Study:
    """The study with its random traffic on the street, and its interferers among the radars.

    Fluctuating points have drawn cross sections. Unless the study names victims and targets, the
    victims are the radars that it lists, and the targets are those of the traffic. A study without
    anything random is returned as it is. `InputError` is raised if there is no radar to copy, too
    little space, or no viewing vehicle that heads along +x.

    >>> from polychirp.study.spec import StudyRadar
    >>> from polychirp.traffic.street import Street, Vehicle
    >>> from polychirp.waveform import Triangular
    >>> study = Study(
    ...     name="traffic",
    ...     street=Street(vehicles=(Vehicle(name="ego", x=0.0, y=-1.75),)),
    ...     radars=(StudyRadar(name="front", vehicle="ego", waveform=Triangular()),),
    ...     traffic=StudyTraffic(seen_from="ego", num_targets=2, num_carriers=1,
    ...                          num_interferers=1))
    >>> one = sample_street(study)
    >>> one.victims, one.targets, [radar.name for radar in one.radars]
    (('front',), ('target-1', 'target-2'), ['front', 'carrier-1'])
    """
    streams = Streams(study.seed)
    study = _with_drawn_points(study, streams)
    traffic = study.traffic
    if traffic is None:
        return study
    if not study.radars:
        raise InputError("radars: there is none; write at least one [[radars]] table")
    street = traffic.on(study.street, streams)
    carriers = {vehicle.name: vehicle for vehicle in street.vehicles}
    interferers = tuple(
        _interferer(study.radars[0], carriers[name], traffic, streams)
        for name in traffic.carrier_names[: traffic.num_interferers]
    )
    return replace(
        study,
        traffic=None,
        street=street,
        radars=(*study.radars, *interferers),
        victims=study.victims or tuple(radar.name for radar in study.radars),
        targets=study.targets or traffic.target_names,
    )


def _with_drawn_points(study: Study, streams: Streams) -> Study:
    """The study with drawn cross sections of its fluctuating points."""
    points = study.street.points
    if all(point.fluctuation == "steady" for point in points):
        return study
    drawn = tuple(point.drawn(streams["fluctuation", point.name]) for point in points)
    return replace(study, street=replace(study.street, points=drawn))


def _interferer(
    template: StudyRadar, carrier: Vehicle, traffic: StudyTraffic, streams: Streams
) -> StudyRadar:
    draw = streams["timing", carrier.name]
    # both are always drawn, so that a spread of zero does not change the other draw
    start, error = draw.uniform(0.0, 1.0), draw.uniform(-1.0, 1.0)
    return replace(
        template,
        name=carrier.name,
        vehicle=carrier.name,
        mount=bumper_mount(carrier.body, "front"),
        waveform=traffic.waveform or template.waveform,
        start_time=template.start_time + traffic.start_spread * float(start),
        clock_offset=traffic.clock_spread * float(error),
        transmit_power=0.0 if traffic.are_silent else template.transmit_power,
    )
