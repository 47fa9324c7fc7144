"""Powers of a radar, and SNRs of echoes of points by the radar equation, without any tracing."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from polychirp.axes import FloatArray
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.model.if_frame import sample_times
from polychirp.model.ramp import RampSchedule
from polychirp.scoring.closed_forms.link_budget import echo_power
from polychirp.study.spec import Study, StudyRadar, target_names
from polychirp.synthesis.impairments.front_end import sample_scale
from polychirp.synthesis.links.interference_levels import mean_power
from polychirp.synthesis.links.thermal_noise import noise_density
from polychirp.traffic.road_users import RoadUser
from polychirp.traffic.street import Point, Vehicle


@dataclass(frozen=True, slots=True, kw_only=True)
class PointEcho:
    """Echo of a point in free space to one radar, at 0 s.

    Parameters
    ----------
    radar, target : names
    range : m
    snr : energy of the echo in all samples and channels of a frame over the noise in one of them,
        as of `Score.echo_snr`. Windows of a receiver take some dB of it
    """

    radar: str
    target: str
    range: float
    snr: float


def eirp(radar: StudyRadar) -> float:
    """Equivalent isotropically radiated power of one element at its beam's maximum, W."""
    return radar.transmit_power * radar.transmit_gain * radar.array.pattern.peak_gain


def sample_noise(radar: StudyRadar) -> float:
    r"""Power of the noise in a sample, referred to the antenna's output, W: :math:`k T_0 F B`.

    B is the noise bandwidth of the IF filter at both signs of the beat; in real samples both add.
    """
    return _noise_density(radar) * radar.if_filter.noise_bandwidth


def _noise_density(radar: StudyRadar) -> float:
    """Density of the noise in the pass band, referred to the antenna's output, W/Hz."""
    return sample_scale(radar) * noise_density(radar) / radar.receive_gain


def point_echoes(study: Study, schedule: RampSchedule, *, number: int) -> Iterator[PointEcho]:
    r"""Echoes of the points that are targets of a radar.

    .. math:: \mathrm{SNR} = \frac{P_t G(\phi, \theta)^2 \lambda^2 \sigma}{(4\pi)^3 R^4}
              \frac{N M}{k T_0 F f_s}

    with N samples in M channels at the rate :math:`f_s`; elements that send together add their
    powers. N/f_s is the time that is sampled, so that the SNR does not depend on the rate.
    """
    radar = study.radars[number]
    times = sample_times(schedule, radar.converter)
    sent = float(times.num_samples @ mean_power(schedule)) / times.rate
    scale = sent * radar.array.num_channels / _noise_density(radar)
    points = {point.name: point for point in study.street.points}
    own = next(one for one in study.street.vehicles if one.name == radar.vehicle)
    for name in target_names(study, radar):
        if name not in points:
            continue
        place = place_of(points[name], radar=radar, own=own)
        distance = float(np.linalg.norm(place))
        power = echo_power(
            power=radar.transmit_power * radar.transmit_gain,
            gain=float(radar.array.pattern.gain(place)),
            wavelength=SPEED_OF_LIGHT / float(np.mean(schedule.centre_frequency)),
            cross_section=points[name].rcs,
            distance=max(distance, 1e-3),
        )
        yield PointEcho(radar=radar.name, target=name, range=distance, snr=power * scale)


def place_of(body: Vehicle | Point | RoadUser, *, radar: StudyRadar, own: Vehicle) -> FloatArray:
    """Place of a body in the frame of a radar on the vehicle ``own`` at 0 s, m ``(xyz,)``.

    Bodies other than points are taken at the height of the radar.
    """
    height = body.z if isinstance(body, Point) else radar.mount.z
    return radar.mount.to_inner(own.pose.to_inner(np.array([body.x, body.y, height])))
