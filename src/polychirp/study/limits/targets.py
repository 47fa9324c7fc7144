"""Targets that a receiver cannot report: without an echo, too far, too near, behind, too fast."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from polychirp.channel.point_vehicles.tracer import PointVehicles
from polychirp.frames import direction_angles
from polychirp.model.antenna import AntennaArray
from polychirp.model.ramp import RampSchedule
from polychirp.receiver.decoding.chain import Decoding
from polychirp.receiver.range_doppler.chain import RangeDoppler
from polychirp.receiver.selection import AnyReceiver, receiver_for
from polychirp.receiver.signal_model.transmit_codes import code_blocks
from polychirp.receiver.stepped.chain import MfskReceiver
from polychirp.receiver.stepped.staircase import unreadable
from polychirp.study.limits.power import place_of
from polychirp.study.spec import Study, StudyRadar, target_names, victim_indices
from polychirp.traffic.road_users import RoadUser
from polychirp.traffic.street import Point, Vehicle
from polychirp.traffic.vehicle import vehicle_size
from polychirp.units import to_db

Body = Vehicle | Point | RoadUser
"""A possible target."""


def targets_without_echo(study: Study) -> Iterator[str]:
    """A sentence if vehicles are targets, and the tracer has no reliable echo of their metal."""
    vehicles = {vehicle.name for vehicle in study.street.vehicles}
    names = sorted(
        vehicles.intersection(
            name for i in victim_indices(study) for name in target_names(study, study.radars[i])
        )
    )
    if names and not {"facets", "vehicle-points"} & study.tracer.capabilities:
        tracer = getattr(study.tracer, "kind", type(study.tracer).__name__)
        yield (
            f"the tracer '{tracer}' computes no reliable echo of vehicles, so "
            f"'{names[0]}' may not be found; use the tracer 'composite' or 'point-vehicles', or "
            "name points as targets if it has them"
        )
    if names and isinstance(study.tracer, PointVehicles) and study.tracer.model == "3gpp-one":
        yield (
            "the model '3gpp-one' puts the echo of a vehicle in its middle, but scores and SNRs "
            f"refer to its visible metal: '{names[0]}' may count as missed where it is detected; "
            "use the model '3gpp-five' or 'tables'"
        )


def targets_out_of_reach(study: Study, schedules: Sequence[RampSchedule]) -> Iterator[str]:
    """A sentence for each target out of every victim's range or beam, or too fast for one of them.

    Range, range rate and direction are those of the middle of a vehicle at 0 s, less half its
    length for the range. A vehicle is behind a radar if all of it is. Only targets that the study
    names are reported as out of the beam.
    """
    bodies = _bodies(study)
    far: dict[str, str] = {}
    near: set[str] = set()
    for number in victim_indices(study):
        radar = study.radars[number]
        speed, why = greatest_speed(study.receiver, schedules[number], radar.array)
        for name in sorted(bodies.keys() & set(target_names(study, radar))):
            distance, rate = _seen_from(radar, bodies, bodies[name])
            if distance > study.receiver.greatest_range:
                far[name] = (
                    f"'{name}' is {distance:.3g} m from '{radar.name}', beyond the receiver's "
                    f"greatest range of {study.receiver.greatest_range:g} m; raise "
                    "receiver.greatest_range"
                )
                continue
            least = study.receiver.least_range
            # a vehicle of which the nearest part is too near may be seen elsewhere
            if distance < least and not isinstance(bodies[name], Vehicle):
                far[name] = (
                    f"'{name}' is {distance:.3g} m from '{radar.name}', nearer than the receiver's "
                    f"least range of {least:g} m; lower receiver.least_range"
                )
                continue
            # where no targets are named, all bodies are, and some are behind each radar
            out_of_beam = _out_of_beam(radar, bodies, bodies[name])
            if study.targets and out_of_beam:
                far[name] = f"'{name}' is {out_of_beam}"
                continue
            near.add(name)
            if abs(rate) > speed:
                yield (
                    f"'{name}' moves at {3.6 * abs(rate):.0f} km/h along the line of sight of "
                    f"'{radar.name}', and {why}"
                )
    yield from (far[name] for name in sorted(far.keys() - near))


def _bodies(study: Study) -> dict[str, Body]:
    """Possible targets of the street by their names."""
    street = study.street
    bodies: tuple[Body, ...] = (*street.vehicles, *street.points, *street.road_users)
    return {body.name: body for body in bodies}


def greatest_speed(
    receiver: AnyReceiver, schedule: RampSchedule, array: AntennaArray
) -> tuple[float, str]:
    """Greatest range rate that the receiver reports as it is, m/s, and the end of a sentence.

    The sentence says why a target that is faster is not reported as it is, and what would help.
    """
    receiver = receiver_for(receiver, schedule)
    if isinstance(receiver, Decoding):
        receiver = receiver.reader()
    if isinstance(receiver, MfskReceiver) and not unreadable(schedule):
        speed = receiver.unambiguous_speed(schedule)
        if speed < receiver.greatest_speed:
            return speed, (
                f"its steps tell speeds within the receiver's ranges apart to {3.6 * speed:.0f} "
                "km/h: it may appear with another speed and range; use shorter or more steps"
            )
    if not isinstance(receiver, RangeDoppler):
        return receiver.greatest_speed, (
            f"its receiver searches to {3.6 * receiver.greatest_speed:.0f} km/h; raise "
            "receiver.greatest_speed"
        )
    speed = 0.5 * receiver.unambiguous_span(schedule, array)
    if len(code_blocks(schedule).weight) > 1 and not receiver.tells_folds_apart(schedule, array):
        return speed, (
            f"its code and array leave several speeds open above {3.6 * speed:.0f} km/h: it may "
            "appear with another speed; use a shorter ramp_duration or idle, fewer transmitting "
            "elements, or a Doppler division with an empty band"
        )
    if np.all(schedule.slope == 0.0):  # a carrier with a code
        return speed, (
            f"its sweeps tell speeds apart to {3.6 * speed:.0f} km/h: it will appear with another "
            "speed; use fewer periods or a shorter idle"
        )
    return speed, (
        f"its chirps tell speeds apart to {3.6 * speed:.0f} km/h: it will appear with another "
        "speed; use a shorter ramp_duration or idle"
    )


def _out_of_beam(radar: StudyRadar, bodies: Mapping[str, Body], body: Body) -> str:
    """End of a sentence on a body that is behind a radar or beside its beam; empty if it is not."""
    own = bodies[radar.vehicle]
    assert isinstance(own, Vehicle)
    place = place_of(body, radar=radar, own=own)
    pattern = radar.array.pattern
    gain = float(pattern.gain(place)) / pattern.peak_gain
    loss = f"{-2.0 * float(to_db(gain)):.0f} dB weaker"
    size = vehicle_size(body.body)[0] if isinstance(body, Vehicle) else 0.0
    if float(place[0]) + 0.5 * size < 0.0:
        return (
            f"behind '{radar.name}', whose array takes it for a target in front, {loss}; check "
            "mount.yaw, or leave it out of the targets"
        )
    # only a point is at one direction, and the beam of a pattern without loss has no end
    if isinstance(body, Point) and gain <= pattern.floor * (1.0 + 1e-9) < 1.0:
        azimuth, elevation = (float(angle) for angle in np.degrees(direction_angles(place)))
        return (
            f"beside the beam of '{radar.name}', at {azimuth:.0f}° of azimuth and {elevation:.0f}° "
            f"of elevation, and its echo is {loss}; check the radar's mount and beamwidths"
        )
    return ""


def _seen_from(radar: StudyRadar, bodies: Mapping[str, Body], body: Body) -> tuple[float, float]:
    """Range of a body's nearest part, m, and its range rate, m/s, from a radar."""
    own = bodies[radar.vehicle]
    assert isinstance(own, Vehicle)
    place = place_of(body, radar=radar, own=own)
    moving = own.pose.rotation.T @ (np.array(body.velocity) - np.array(own.velocity))
    distance = float(np.linalg.norm(place))
    rate = float(radar.mount.rotation.T @ moving @ place) / max(distance, 1e-9)
    size = vehicle_size(body.body)[0] if isinstance(body, Vehicle) else 0.0
    return distance - 0.5 * size, rate
