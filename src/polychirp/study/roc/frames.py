r"""Frames of drawn points in the noise, leakage and interference of the tested radar.

A point moves straight towards the radar or away from it, and its cross section does not change
(Swerling's case 0). Its cross section is chosen such that it has the wanted coherent SNR

.. math:: S = \frac{M}{N_0 f_s} \sum_k \frac{n_k}{1 + A_k} \sum_l |w_{kl} a_l|^2

with M channels, :math:`n_k` samples on ramp k, the amplitude :math:`a_l` of the echo of the
transmitting element l, its weight :math:`w_{kl}` on the ramp, and the noise density :math:`N_0`
before the IF filter, at the sample rate :math:`f_s`. A code multiplies it by the mean power of its
chips. This is the SNR of a matched filter of the
whole frame that adds all channels in phase. The IF filter H acts on echo and noise at the beat
:math:`f_k` alike, but sampling adds the noise that the filter passes at other frequencies:

.. math:: A_k = \sum_{m \ne 0} |H(f_k + m f_s)|^2 / |H(f_k)|^2 .

It is 0 where the stop edge is below :math:`f_s - |f_k|`. Real samples have the noise of the beats f
and −f at f, so that their :math:`N_0` is twice that of complex ones.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Final

import numpy as np

from polychirp.axes import FloatArray
from polychirp.channel.tracers.free_space import FreeSpace
from polychirp.frames import Pose
from polychirp.model.if_filter import IfFilter
from polychirp.model.if_frame import IfFrame, sample_times
from polychirp.model.paths import PropagationPaths
from polychirp.model.ramp import RampSchedule
from polychirp.model.scene import Actor, PointScatterer, Scene
from polychirp.receiver.signal_model.point_signal import beat_frequency
from polychirp.rng import Streams
from polychirp.study.roc.plan import Strong, Window
from polychirp.study.spec import Study, as_built, schedules_of
from polychirp.study.trial import trace_frame
from polychirp.synthesis.impairments.front_end import sample_scale
from polychirp.synthesis.impairments.oscillator_errors import Oscillating
from polychirp.synthesis.links.links import links_of_all, nearest_snapshots
from polychirp.synthesis.links.thermal_noise import noise_density
from polychirp.synthesis.received_frame import synthesize
from polychirp.synthesis.stretch.engine import Stretch
from polychirp.traffic.street import Street

GREATEST_SINE: Final = math.sin(math.radians(60.0))
"""Greatest magnitude of the sine of a point's azimuth; its sine is uniform. Chosen: the field of
view of most radars. The azimuth does not change a point's SNR, which is given."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DrawnPoint:
    """A point in the middle of the frame, and the ratio of its power to that of the noise.

    Parameters
    ----------
    range, range_rate, azimuth : m, m/s, rad
    snr : coherent SNR, ratio
    """

    range: float
    range_rate: float
    azimuth: float
    snr: float

    def at(self, elapsed: float) -> tuple[float, float]:
        """Range, m, and range rate, m/s, this time after the middle of the frame, s."""
        return self.range + self.range_rate * elapsed, self.range_rate


def drawn_points(
    window: Window, strong: Strong | None, *, snr: float, random: np.random.Generator
) -> tuple[DrawnPoint, ...]:
    """The tested point, uniformly drawn, and the strong one beside it, if there is one."""
    rate = random.uniform(-window.greatest_speed, window.greatest_speed)
    moved = abs(rate) * window.half_frame
    distance = random.uniform(window.least_range + moved, window.greatest_range - moved)
    azimuths = np.arcsin(random.uniform(-GREATEST_SINE, GREATEST_SINE, 2))
    signs = random.choice((-1.0, 1.0), 2)
    tested = DrawnPoint(range=distance, range_rate=rate, azimuth=float(azimuths[0]), snr=snr)
    if strong is None:
        return (tested,)
    beside = distance + signs[0] * strong.apart.range
    if not window.least_range <= beside <= window.greatest_range:
        beside = distance - signs[0] * strong.apart.range
    second = DrawnPoint(
        range=float(beside),
        range_rate=float(rate + signs[1] * strong.apart.range_rate),
        azimuth=float(azimuths[1]),
        snr=snr * strong.ratio,
    )
    return tested, second


def frame_with(study: Study, points: Sequence[DrawnPoint], *, streams: Streams) -> IfFrame:
    """A frame of the study's first radar, with these points, its own noise and the other radars.

    Parameters
    ----------
    study : of one trial, as of `RocPlan`; its seed draws ramps and errors of the array
    streams : of noise and phase noise
    """
    schedules = schedules_of(study)
    scene = _scene(study)
    bodies = [_body(study, scene, schedules[0], point, n) for n, point in enumerate(points)]
    full = replace(scene, actors=(*scene.actors, *bodies))
    frame, _ = synthesize(
        Oscillating(inner=Stretch(), streams=streams),
        full,
        schedules,
        _snapshots(study, full, schedules[0]),
        victim=0,
        interferers=None,
        streams=streams,
    )
    return frame


def middle_of(schedule: RampSchedule) -> float:
    """Time in the middle of the frame, s."""
    return float(0.5 * (schedule.start_time.min() + schedule.end_time.max()))


def _scene(study: Study) -> Scene:
    """The radars on their vehicles, which have no bodies, at 0 s."""
    actors = _carriers(study.street)
    names = [actor.name for actor in actors]
    return Scene(
        time=0.0,
        actors=actors,
        radars=tuple(as_built(study, radar) for radar in study.radars),
        carriers=tuple(names.index(radar.vehicle) for radar in study.radars),
    )


@lru_cache(maxsize=2)
def _carriers(street: Street) -> tuple[Actor, ...]:
    return tuple(
        Actor(name=one.name, kind="vehicle", pose=one.pose, velocity=one.velocity)
        for one in street.vehicles
    )


def _unit_body(scene: Scene, schedule: RampSchedule, point: DrawnPoint, number: int) -> Actor:
    """The point, of 1 m², on the radar's horizontal plane; it moves along the line of sight."""
    middle = middle_of(schedule)
    eye, velocity = scene.at(middle).radar_position[0], scene.radar_velocity[0]
    ahead = np.array([math.cos(point.azimuth), math.sin(point.azimuth), 0.0])
    direction = scene.radar_rotation[0] @ ahead
    speed = velocity + point.range_rate * direction
    place = eye + point.range * direction - speed * (middle - scene.time)
    return Actor(
        name=f"point {number}",
        kind="object",
        pose=Pose(x=float(place[0]), y=float(place[1]), z=float(place[2])),
        velocity=(float(speed[0]), float(speed[1]), float(speed[2])),
        points=(PointScatterer(position=(0.0, 0.0, 0.0), rcs=1.0),),
    )


def _body(
    study: Study, scene: Scene, schedule: RampSchedule, point: DrawnPoint, number: int
) -> Actor:
    """The point with the cross section that gives it its coherent SNR."""
    radar, actor = scene.radars[0], _unit_body(scene, schedule, point, number)
    alone = replace(scene, actors=(*scene.actors, actor))
    snapshots = _snapshots(study, alone, schedule)
    links = links_of_all(
        alone, snapshots, victim=0, transmitter=0, num_elements=schedule.num_elements
    )
    power = np.array([np.abs(link.amplitude) ** 2 for link in links])  # (snapshot, element)
    of_ramp = power[nearest_snapshots(schedule, snapshots)]
    weighted = np.sum(np.abs(schedule.transmit_weight) ** 2 * of_ramp, axis=1)
    if schedule.code is not None:
        weighted *= schedule.code.mean_power
    times = sample_times(schedule, radar.converter)
    beat = beat_frequency(
        schedule,
        times,
        distance=np.asarray(point.range),
        range_rate=np.asarray(point.range_rate),
        time=middle_of(schedule),
    )
    share = 1.0 / (1.0 + aliased_noise(radar.if_filter, beat, times.rate))
    energy = radar.array.num_channels * float((times.num_samples * share) @ weighted)
    noise = sample_scale(radar) * noise_density(radar) * radar.converter.sample_rate
    return replace(actor, points=(replace(actor.points[0], rcs=point.snr * noise / energy),))


def aliased_noise(if_filter: IfFilter, beat: FloatArray, rate: float) -> FloatArray:
    """Noise that sampling adds at a beat, over the noise that the IF filter passes at the beat.

    Parameters
    ----------
    beat : Hz, ``(…,)``, where the filter passes echoes
    rate : sample rate, Hz

    Examples
    --------
    The noise 2 MHz below a beat is stopped for beats in the pass band. Half-way between both edges
    the filter passes it as well as the beat.

    >>> narrow = IfFilter(passband=0.8e6, stopband=1.2e6)
    >>> (aliased_noise(narrow, np.array([0.0, 0.8e6, 1.0e6]), 2e6) + 1e-9).round(3)
    array([0., 0., 1.])
    """
    most = math.ceil((if_filter.stopband + float(np.max(np.abs(beat)))) / rate)
    shifts = rate * np.array([m for m in range(-most, most + 1) if m != 0])
    others = if_filter.response(np.asarray(beat)[..., None] + shifts)
    return np.asarray(np.sum(others**2, axis=-1) / if_filter.response(beat) ** 2)


def _snapshots(study: Study, scene: Scene, schedule: RampSchedule) -> tuple[PropagationPaths, ...]:
    return trace_frame(FreeSpace(), scene, [schedule], refresh_interval=study.refresh_interval)
