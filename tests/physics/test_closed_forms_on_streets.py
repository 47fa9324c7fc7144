"""Closed forms of interference, against this simulator on their own assumptions."""

import math
from dataclasses import replace

import numpy as np
import pytest

from polychirp.channel.direct.line_of_sight import line_of_sight
from polychirp.channel.point_vehicles.tracer import PointVehicles
from polychirp.frames import Pose
from polychirp.model.antenna import ISOTROPIC, AntennaArray, ElementPattern
from polychirp.model.if_filter import IfFilter
from polychirp.model.radar import Converter, Radar
from polychirp.model.ramp import RampSchedule
from polychirp.model.scene import Actor, PointScatterer, Scene
from polychirp.rng import Streams
from polychirp.scoring.closed_forms.link_budget import (
    interference_to_noise,
    interferer_power,
    signal_to_interference,
    slope_factor,
)
from polychirp.scoring.closed_forms.roads import interference_below, mean_of_lane_in_lobes
from polychirp.synthesis.links.links import links_between
from polychirp.synthesis.received_frame import synthesize
from polychirp.synthesis.stretch.engine import Stretch
from polychirp.units import from_db, to_db
from polychirp.waveform import Sawtooth

WAVELENGTH = 299_792_458.0 / 79e9
GAIN = from_db(15.0)
FRONT = Radar(
    transmit_gain=1.0,
    receive_gain=1.0,
    name="front",
    array=AntennaArray(num_channels=1, pattern=replace(ISOTROPIC, peak_gain=GAIN)),
    if_filter=IfFilter(passband=4e6, stopband=6e6),
    converter=Converter(sample_rate=12e6, start=2e-6, margin=2e-6),
)
OTHER = replace(FRONT, name="other", mount=Pose(yaw=math.pi))


def two_radars(*, apart, target=None):
    """A radar, another one that faces it, and a point of 2 m² between them; all at rest."""
    actors = [
        Actor(name="ego", kind="vehicle"),
        Actor(name="car", kind="vehicle", pose=Pose(x=apart)),
    ]
    if target is not None:
        body = PointScatterer(position=(target, 0.0, 0.0), rcs=2.0)
        actors.append(Actor(name="post", kind="object", points=(body,)))
    return Scene(time=0.0, actors=tuple(actors), radars=(FRONT, OTHER), carriers=(0, 1))


def parts_of(scene, schedules):
    tracer = PointVehicles(reflecting_planes=False, dynamic_range=1e12)
    _, parts = synthesize(
        Stretch(), scene, schedules, [tracer.trace(scene)], victim=0, interferers=None,
        streams=Streams(1),
    )  # fmt: skip
    return parts


def ramps(**fields):
    waveform = Sawtooth(start_frequency=79e9 - 150e6, bandwidth=300e6, **fields)
    return waveform.schedule(num_sweeps=32, streams=Streams(1))


def test_an_echo_beside_a_synchronous_radar_has_the_ratio_of_the_link_budget(compare):
    scene = two_radars(apart=60.0, target=20.0)
    parts = parts_of(scene, [ramps(ramp_duration=100e-6)] * 2)
    echo, other = (np.mean(np.abs(parts[name]) ** 2) for name in ("echo", "direct"))
    compare(
        page="closed-forms",
        case="2 m² at 20 m beside a radar at 60 m",
        quantity="echo over a synchronous radar, point vehicles, dB",
        expected=to_db(
            signal_to_interference(cross_section=2.0, distance=20.0, interferer_distance=60.0)
        ),
        measured=float(to_db(echo / other)),
        tolerance=0.05,
        source="Alland et al. 2019",
    )


@pytest.mark.parametrize("ratio", [5 / 6, 2.0, -1.0])
def test_crossing_chirps_have_the_density_of_the_closed_form(ratio, compare):
    """Chirps with equal centres, so that the difference passes the whole band of the filter.

    The interferer starts so that its chirp has the same middle as each of the victim's. The spread
    is that of the noise: 32 ramps of some 1100 samples.
    """
    own = ramps(ramp_duration=100e-6, idle=60e-6)
    duration = 100e-6 / abs(ratio)
    late = 0.5 * (own.duration - duration) - 30.0 / 299_792_458.0
    half = 0.5 * duration * own.slope * ratio
    other = RampSchedule(
        start_time=own.start_time + late,
        duration=np.full(32, duration),
        start_frequency=own.centre_frequency - half,
        slope=own.slope * ratio,
        start_phase=np.arange(32) * 0.37,
        sweep=np.arange(32),
    )
    parts = parts_of(two_radars(apart=30.0), [own, other])
    power, noise = (np.mean(np.abs(parts[name]) ** 2) for name in ("direct", "noise"))
    slope = float(own.slope[0])
    expected = interference_to_noise(
        power=interferer_power(
            power=OTHER.transmit_power, gain=GAIN, wavelength=WAVELENGTH, distance=30.0
        ),
        bandwidth=300e6,
        factor=slope_factor(own_slope=slope, other_slope=slope * ratio),
        noise_figure=FRONT.noise_figure,
        # the density is a mean over the interferer's chirp, the samples are those of the window
        share=duration / (parts.samples.shape[-1] / FRONT.converter.sample_rate),
    )
    compare(
        page="closed-forms",
        case=f"slopes as {ratio:.3g} to 1",
        quantity="crossing chirps over thermal noise, point vehicles, dB",
        expected=float(to_db(expected)),
        measured=float(to_db(power / noise)),
        tolerance=0.15,
        source="Alland et al. 2019",
    )


def total_powers(*, density, offset, length, count, pattern, seed):
    """Sum of the powers of all radars of a lane at the victim, W, for ``count`` drawn roads.

    Only the places of the radars are drawn; there are no bodies.
    """
    draw = np.random.default_rng(seed)
    array = AntennaArray(num_channels=1, pattern=pattern)
    victim = replace(FRONT, array=array)
    powers = np.zeros(count)
    for road in range(count):
        x = draw.uniform(0.0, length, draw.poisson(density * length))
        ahead = [
            Actor(name=f"car {n}", kind="vehicle", pose=Pose(x=float(a), y=offset))
            for n, a in enumerate(x)
        ]
        scene = Scene(
            time=0.0,
            actors=(Actor(name="ego", kind="vehicle"), *ahead),
            radars=(
                victim,
                *(replace(victim, name=one.name, mount=Pose(yaw=math.pi)) for one in ahead),
            ),
            carriers=tuple(range(len(ahead) + 1)),
        )
        pairs = np.array([[n, 0] for n in range(1, len(scene.radars))]).reshape(-1, 2)
        paths = line_of_sight(scene, frequency=79e9, pairs=pairs)
        for n in range(1, len(scene.radars)):
            link = links_between(scene, paths, victim=0, transmitter=n)
            powers[road] += float(np.sum(np.abs(link.amplitude) ** 2))
    return powers


def test_the_mean_of_a_lane_is_that_of_gaussian_lobes(compare):
    """Element patterns are Gaussian with exponents of 12 dB instead of 40 log₁₀ 2, 0.4 % less."""
    beamwidth = math.radians(40.0)
    pattern = ElementPattern(
        peak_gain=GAIN, azimuth_beamwidth=beamwidth, elevation_beamwidth=math.inf, floor=1e-9
    )
    drawn = total_powers(
        density=1 / 30, offset=7.0, length=600.0, count=400, pattern=pattern, seed=1
    )
    expected = mean_of_lane_in_lobes(
        interferer_power(
            power=FRONT.transmit_power, gain=GAIN, wavelength=WAVELENGTH, distance=1.0
        ),
        density=1 / 30,
        offset=7.0,
        opening=math.pi,
        beamwidth=beamwidth,
    )
    spread = float(np.std(drawn) / np.sqrt(drawn.size) / expected)
    compare(
        page="closed-forms",
        case="one radar in 30 m, lane at 7 m, 40°",
        quantity="mean interference of a lane, free space, over closed form",
        expected=1.0,
        measured=float(np.mean(drawn)) / expected,
        tolerance=4 * spread,
        source="Wang et al. 2023",
    )


def test_the_interference_of_a_line_has_levys_distribution(compare):
    drawn = total_powers(
        density=0.02, offset=0.0, length=2000.0, count=400,
        pattern=replace(ISOTROPIC, peak_gain=GAIN), seed=2,
    )  # fmt: skip
    power = interferer_power(
        power=FRONT.transmit_power, gain=GAIN, wavelength=WAVELENGTH, distance=1.0
    )
    for level in (3e-4, 1e-3, 3e-3):
        form = float(interference_below(power * level, power=power, density=0.02))
        share = float(np.mean(drawn <= power * level))
        compare(
            page="closed-forms",
            case=f"density 0.02, level {level:g}",
            quantity="share of 400 lines in free space below a level",
            expected=form,
            measured=share,
            tolerance=3 * math.sqrt(form * (1 - form) / 400),
            source="Al-Hourani et al. 2018",
        )
