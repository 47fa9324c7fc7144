"""Derived physics of a study, by hand."""

import re
import warnings
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from polychirp.channel.point_vehicles.tracer import PointVehicles
from polychirp.channel.scene.ground_truth import truth
from polychirp.channel.tracers.free_space import FreeSpace
from polychirp.channel.tracers.sionna import SionnaRt
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.errors import CapabilityError, InputError, ModelWarning, PhysicsError
from polychirp.frames import Pose
from polychirp.model.antenna import ISOTROPIC, AntennaArray, ElementPattern
from polychirp.model.front_end import Digitiser, FrontEnd, HighPass
from polychirp.model.if_filter import IfFilter
from polychirp.model.if_frame import sample_times
from polychirp.model.leakage import Bumper
from polychirp.model.radar import Converter
from polychirp.receiver.coherent.chain import CoherentReceiver
from polychirp.receiver.mitigation import (
    Blanking,
    Burg,
    ComplexNetwork,
    RampMinimum,
    StftExcision,
)
from polychirp.receiver.mitigation.burst_detectors import StftCfar
from polychirp.receiver.range_doppler.chain import RangeDoppler
from polychirp.receiver.selection import AutoReceiver
from polychirp.rng import Streams
from polychirp.study.check import check
from polychirp.study.limits.beams import directivity
from polychirp.study.limits.radios import excessive_powers
from polychirp.study.limits.targets import greatest_speed, targets_out_of_reach
from polychirp.study.paper.scenarios import paper_study
from polychirp.study.spec import (
    Study,
    StudyRadar,
    refresh_times,
    scene_of,
    schedule_of,
    schedules_of,
    target_names,
    tracer_of,
    victim_indices,
)
from polychirp.study.trial import Trial, run_trial
from polychirp.traffic.street import Building, Point, Street, Vehicle
from polychirp.units import from_db
from polychirp.waveform import (
    DiverseSawtooth,
    DiverseTriangular,
    DopplerDivision,
    Hopping,
    PermutedChirps,
    PhaseCoded,
    Pmcw,
    Sawtooth,
    Subframes,
    TimeDivision,
    Triangular,
)
from polychirp.waveform.access import Compass, Slots
from polychirp.waveform.frame_rules import HopAfterHit

PLAIN = Triangular(bandwidth=1e9, ramp_duration=1e-3)
BUMPER = Pose(x=2.4, z=0.5)
FRONT = StudyRadar(name="front", vehicle="ego", waveform=PLAIN, mount=BUMPER)
OTHER = StudyRadar(
    name="other", vehicle="car", waveform=DiverseTriangular(), mount=BUMPER, start_time=5e-3
)
STUDY = Study(
    name="two",
    street=Street(
        vehicles=(
            Vehicle(name="ego", x=0.0, y=0.0, coarseness=4.0),
            Vehicle(name="car", x=10.0, y=0.0, coarseness=4.0),
            Vehicle(name="van", x=20.0, y=0.0, coarseness=4.0),
        )
    ),
    radars=(FRONT, OTHER),
)


def test_what_a_radar_resolves_is_what_its_ramps_say():
    """16 triangles of 2 · 1 ms from 79 to 80 GHz: 32 ms about 79.5 GHz, slope 1e12 Hz/s.

    Of every ramp 981 samples at 1 MS/s are taken: 981 µs of it, or 981 MHz.
    """
    radar = check(STUDY).radars[0]
    wavelength = SPEED_OF_LIGHT / 79.5e9
    assert radar.range_resolution == pytest.approx((SPEED_OF_LIGHT / (2 * 981e6),) * 2)
    assert radar.speed_resolution == pytest.approx(wavelength / (2 * 32e-3))
    assert radar.unambiguous_speed == pytest.approx(wavelength / (4 * 2e-3))
    assert radar.greatest_range == pytest.approx(SPEED_OF_LIGHT * 0.3e6 / 2e12)
    assert radar.beat_band == pytest.approx((0.0, 2e12 * 30.0 / SPEED_OF_LIGHT))
    assert radar.ramp_duration == pytest.approx((1e-3, 1e-3))
    assert radar.frame_duration == pytest.approx(32e-3)
    assert (radar.num_ramps, radar.samples_per_ramp) == (32, (981, 981))
    assert radar.samples_per_frame == 32 * 981
    assert radar.memory == 4 * 32 * 981 * 6 * 16


def test_a_front_end_that_adds_parts_takes_their_memory():
    digitiser = Digitiser(full_scale=1e-3)
    noisy = replace(FRONT, bumper=Bumper(distance=0.05), front_end=FrontEnd(digitiser=digitiser))
    derived = check(replace(STUDY, radars=(noisy,)))
    assert derived.radars[0].memory == 4 * 32 * 981 * 8 * 16


def test_a_high_pass_that_samples_cannot_follow_is_refused_before_the_run():
    steep = FrontEnd(high_pass=HighPass(corners=(350e3, 350e3)))
    radar = replace(FRONT, front_end=steep, converter=Converter(margin=0.0))
    with pytest.raises(InputError, match=r"raise the converter's margin to 15\.15 µs"):
        check(replace(STUDY, radars=(radar,)))


@pytest.mark.filterwarnings("ignore::polychirp.errors.ModelWarning")
def test_a_sweep_of_one_ramp_doubles_the_unambiguous_speed():
    sawtooth = replace(FRONT, waveform=Sawtooth(bandwidth=1e9, ramp_duration=1e-3))
    one, two = check(replace(STUDY, radars=(sawtooth,))), check(STUDY)
    assert one.radars[0].unambiguous_speed == pytest.approx(2 * two.radars[0].unambiguous_speed)


@pytest.mark.parametrize(
    ("num_sweeps", "greatest_speed", "sentence"),
    [
        (1, 10.0, r"'front' has a single ramp, .* wrong by up to 0\.4 m"),
        (4, 32.0, r"the 4 equal ramps of 'front' do not tell range rates 13\.5 km/h apart"),
    ],
)
def test_equal_ramps_that_leave_the_range_rate_open_are_told(num_sweeps, greatest_speed, sentence):
    """R and v of one beat: f v/b = 80 GHz · 10 m/s / (2e12 Hz/s). λ/2T = 3.747 mm/1 ms."""
    chirps = Sawtooth(start_frequency=79.5e9, bandwidth=1e9, ramp_duration=5e-4)
    study = replace(
        STUDY,
        radars=(replace(FRONT, waveform=chirps),),
        num_sweeps=num_sweeps,
        receiver=CoherentReceiver(greatest_speed=greatest_speed),
    )
    with pytest.warns(ModelWarning, match=sentence):
        check(study)


def equal_chirps(coding, *, num_channels: int) -> Study:
    """A study of one radar with chirps 55 µs apart about 77.2 GHz, and a point at rest."""
    chirps = Sawtooth(start_frequency=77e9, bandwidth=4e8, ramp_duration=40e-6, idle=15e-6)
    radar = replace(
        FRONT,
        waveform=chirps,
        coding=coding,
        array=replace(
            FRONT.array,
            num_channels=num_channels,
            num_transmitters=1 if coding is None else 3,
        ),
        converter=Converter(sample_rate=20e6, start=3e-6, margin=1e-6),
        if_filter=IfFilter(passband=9e6, stopband=10e6),
    )
    post = Point(name="post", x=9.0, y=0.0, z=1.0, rcs=1.0)
    street = Street(vehicles=STUDY.street.vehicles[:1], points=(post,))
    return replace(STUDY, radars=(radar,), street=street, tracer=FreeSpace(), num_sweeps=24)


SPAN = SPEED_OF_LIGHT / 77.2e9 / (4 * 55e-6)
"""λ/4T of `equal_chirps`, m/s; T includes the idle time."""


@pytest.mark.parametrize(
    ("coding", "sweeps_of_the_code"),
    [(None, 1), (TimeDivision(), 3), (DopplerDivision(num_bands=4), 4)],
    ids=["no code", "turns", "Doppler bands"],
)
@pytest.mark.parametrize("num_channels", [1, 2, 4])
def test_the_unambiguous_speed_is_that_of_one_transmitters_interval(
    coding, sweeps_of_the_code, num_channels
):
    """λ/4NT. The range-Doppler receiver tells the N folds apart, and reports speeds to λ/4T.

    With one receiving channel, every fold fits some azimuth, and empty bands alone tell them.
    """
    found = check(equal_chirps(coding, num_channels=num_channels)).radars[0]
    assert found.receiver == "range-doppler"
    assert found.unambiguous_speed == pytest.approx(SPAN / sweeps_of_the_code)
    is_left_open = num_channels == 1 and isinstance(coding, TimeDivision)
    assert found.unfolded_speed == pytest.approx(SPAN / (3 if is_left_open else 1))


@pytest.mark.filterwarnings("ignore::polychirp.errors.ModelWarning")
def test_receiving_elements_across_the_transmitting_ones_leave_the_speed_open():
    """A wrong fold turns the row to another azimuth, which a column cannot refuse."""
    study = equal_chirps(TimeDivision(), num_channels=4)
    own = study.radars[0]
    column = replace(own.array, channel_positions=tuple((0, n) for n in range(4)))
    radars = (replace(own, array=column),)
    found = check(replace(study, radars=radars, receiver=RangeDoppler(angle="bartlett"))).radars[0]
    assert found.unfolded_speed == found.unambiguous_speed == pytest.approx(SPAN / 3)


def test_the_speed_resolution_of_subframes_is_that_of_the_longest():
    """λ/2T with T of 16 chirps 70 µs apart, not of the whole frame."""
    study = equal_chirps(None, num_channels=4)
    waveform = Subframes(
        start_frequency=77e9,
        bandwidth=4e8,
        ramp_duration=40e-6,
        intervals=(55e-6, 62e-6, 70e-6),
        ramps_per_subframe=16,
    )
    radar = replace(study.radars[0], waveform=waveform)
    found = check(replace(study, radars=(radar,), num_sweeps=48)).radars[0]
    assert found.has_subframes
    longest = 15 * 70e-6 + 40e-6
    assert found.speed_resolution == pytest.approx(
        SPEED_OF_LIGHT / 77.2e9 / (2 * longest), rel=1e-3
    )


@pytest.mark.parametrize("num_channels", [1, 4])
def test_a_target_beyond_the_span_of_turns_is_too_fast_for_one_channel(num_channels):
    """The point approaches at half of λ/4T, which is more than a third of it."""
    study = equal_chirps(TimeDivision(), num_channels=num_channels)
    own = study.street.vehicles[0]
    fast = replace(study.street.points[0], velocity=(own.speed - 0.5 * SPAN, 0.0, 0.0))
    fast = replace(fast, x=40.0)
    study = replace(study, street=replace(study.street, points=(fast,)), targets=("post",))
    study = replace(study, receiver=replace(study.receiver, greatest_range=60.0))
    sentences = list(targets_out_of_reach(study, schedules_of(study)))
    assert len(sentences) == (num_channels == 1)
    assert all("it may appear with another speed" in sentence for sentence in sentences)


def test_diverse_ramps_give_limits_instead_of_values():
    radar = check(STUDY).radars[1]
    assert 0.15 < radar.range_resolution[0] < radar.range_resolution[1] < 0.192
    assert 1e-3 < radar.ramp_duration[0] < radar.ramp_duration[1] < 2e-3
    assert radar.samples_per_ramp[0] < radar.samples_per_ramp[1]


@pytest.mark.parametrize(
    ("waveform", "ratio"),
    [
        (PermutedChirps(num_pieces=4, bandwidth=600e6, ramp_duration=40e-6), 4.0),
        (Hopping(band=(76e9, 77e9), bandwidth=250e6, ramp_duration=10e-6, idle=2e-6), 4.0),
        (DiverseSawtooth(start_frequency_spread=900e6, ramp_duration=10e-6), 3.0),
    ],
)
def test_ramps_that_the_coherent_receiver_adds_in_phase_resolve_what_their_band_does(
    waveform, ratio
):
    """Half of a point's power is where the sum of all samples' phasors says, not that of a ramp."""
    converter = Converter(sample_rate=40e6, start=1e-6, margin=1e-6)
    radar = StudyRadar(
        name="front",
        vehicle="ego",
        waveform=waveform,
        mount=BUMPER,
        num_sweeps=256,
        converter=converter,
        if_filter=IfFilter(passband=15e6, stopband=18e6),
    )
    street = replace(STUDY.street, vehicles=STUDY.street.vehicles[:1])
    study = replace(STUDY, street=street, radars=(radar,))
    (derived,) = check(study).radars
    (schedule,) = schedules_of(study)
    times = sample_times(schedule, converter)
    elapsed = times.first[0] + np.arange(times.num_samples[0]) / times.rate
    frequency = schedule.start_frequency[:, None] + schedule.slope[:, None] * elapsed
    apart = np.linspace(0.0, 1.0, 1001)
    power = [
        np.abs(np.mean(np.exp(4j * np.pi / SPEED_OF_LIGHT * one * frequency))) ** 2 for one in apart
    ]
    half = apart[np.argmax(np.array(power) < 0.5)]
    assert derived.receiver == "coherent"
    least, greatest = derived.range_resolution
    assert least == greatest == pytest.approx(half / 0.443, rel=0.04)
    of_a_ramp = SPEED_OF_LIGHT / (2.0 * np.ptp(frequency, axis=1).mean())
    assert of_a_ramp / least > ratio


def test_radars_draw_from_streams_of_their_own_name():
    """Taking a radar away, or adding one, moves no draw of another."""
    alone = replace(STUDY, radars=(OTHER,))
    np.testing.assert_array_equal(schedules_of(alone)[0].slope, schedules_of(STUDY)[1].slope)
    renamed = replace(STUDY, radars=(replace(OTHER, name="third"),))
    assert not np.array_equal(schedules_of(renamed)[0].slope, schedules_of(STUDY)[1].slope)


def test_a_radar_runs_on_its_own_clock():
    late = schedule_of(STUDY, replace(FRONT, start_time=1e-3, clock_offset=1e-4))
    right = schedule_of(STUDY, FRONT)
    np.testing.assert_allclose(late.start_time, 1e-3 + right.start_time / 1.0001)
    np.testing.assert_allclose(late.start_frequency, right.start_frequency * 1.0001)


def test_nobody_named_means_everybody_and_nobody_is_its_own_target():
    assert victim_indices(STUDY) == (0, 1)
    assert victim_indices(replace(STUDY, victims=("other",))) == (1,)
    assert target_names(STUDY, FRONT) == ("car", "van")
    assert target_names(replace(STUDY, targets=("ego", "van")), FRONT) == ("van",)


def test_memory_and_cost_count_victims_only():
    derived = check(replace(STUDY, victims=("other",)))
    assert derived.victims == ("other",)
    assert derived.memory == derived.radars[1].memory
    assert derived.cost < check(STUDY).cost


def test_snapshots_cover_the_victims_frames():
    """A frame of 32 ms holds 32 intervals of 1 ms, and a part of one of 1 s."""
    plans = schedules_of(replace(STUDY, victims=("front",)))[:1]
    assert refresh_times(plans, 1e-3).size == 32
    assert refresh_times(plans, 1.0).tolist() == pytest.approx([16e-3])
    for interval in (0.0, -1e-3, float("nan")):
        with pytest.raises(InputError, match=r"refresh_interval: is .* use more than 0 s"):
            refresh_times(plans, interval)


def test_every_problem_is_told_with_its_place():
    bad = replace(
        STUDY, name="a/b", radars=(replace(FRONT, vehicle="bus"), FRONT), targets=("tram",)
    )
    with pytest.raises(InputError) as caught:
        check(bad)
    assert [line.split(":")[0].strip() for line in str(caught.value).splitlines()] == [
        "this study cannot run",
        "name",
        "radars.1.name",
        "radars.0.vehicle",
        "targets.0",
    ]


@pytest.mark.parametrize(
    "change",
    [
        {"converter": Converter(sample_rate=0.3e6)},
        {"if_filter": IfFilter(passband=0.1e6, stopband=0.15e6)},
    ],
    ids=["converter", "filter"],
)
def test_beats_that_a_radar_cannot_sample_are_refused(change):
    """Echoes from 30 m on 1e12 Hz/s beat at 200 kHz."""
    with pytest.raises(PhysicsError, match=r"radars\.0: .*200\.1 kHz.*samples no more than 150"):
        check(replace(STUDY, radars=(replace(FRONT, **change),)))


def test_radars_that_are_no_victims_need_not_sample_their_echoes():
    slow = replace(FRONT, name="slow", vehicle="car", converter=Converter(sample_rate=0.3e6))
    assert check(replace(STUDY, radars=(FRONT, slow), victims=("front",))).victims == ("front",)
    with pytest.raises(PhysicsError, match=r"radars\.1: .*'slow' samples no more than 150"):
        check(replace(STUDY, radars=(FRONT, slow), victims=("front", "slow")))


def test_beats_above_a_megahertz_are_told_in_megahertz():
    """2 · 500 m · 1e13 Hz/s / c = 33.36 MHz."""
    study = post_at(
        20.0,
        waveform=Sawtooth(bandwidth=300e6, ramp_duration=30e-6),
        converter=Converter(sample_rate=25e6, start=3e-6, margin=1e-6),
        if_filter=IfFilter(passband=11e6, stopband=12.5e6),
    )
    study = replace(study, receiver=replace(study.receiver, greatest_range=500.0))
    with pytest.raises(PhysicsError, match=r"beat at 33\.36 MHz .* no more than 12\.5 MHz; "):
        check(study)


def test_a_problem_of_one_radars_place_names_that_radar():
    inside = replace(OTHER, mount=Pose(z=0.6))
    with pytest.raises(InputError, match=r"radars\.1\.mount: radar 'other' is inside 'car'"):
        check(replace(STUDY, radars=(FRONT, inside)))


def test_an_unknown_material_is_found_before_anything_is_traced():
    house = Building(
        name="house", x=0.0, y=20.0, length=10.0, width=10.0, height=5.0, material="brik"
    )
    with pytest.raises(InputError, match=r"street: 'house' cannot be traced: .*'brik'"):
        check(replace(STUDY, street=replace(STUDY.street, buildings=(house,))))


def test_vehicles_that_free_space_cannot_show_are_noted():
    with pytest.warns(
        ModelWarning, match="computes no reliable echo of vehicles, so 'car' may not be found"
    ):
        check(replace(STUDY, tracer=FreeSpace()))


def test_an_echo_in_the_middle_of_a_vehicle_is_noted():
    with pytest.warns(ModelWarning, match="'3gpp-one' puts the echo of a vehicle in its middle"):
        check(replace(STUDY, tracer=PointVehicles(model="3gpp-one")))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check(replace(STUDY, tracer=PointVehicles(model="3gpp-five")))


def test_points_are_targets_that_free_space_can_show():
    point = Point(name="post", x=9.0, y=2.0, z=0.5, rcs=1.0)
    study = replace(STUDY, street=replace(STUDY.street, points=(point,)), victims=("front",))
    assert check(study).targets == (("car", "van", "post"),)
    assert check(replace(study, tracer=FreeSpace(), targets=("post",))).targets == (("post",),)


def test_a_victim_that_is_no_radar_is_named_with_those_there_are():
    study = replace(STUDY, victims=("frnt",))
    sentence = r"no radar 'frnt'; there are 'front', 'other'; did you mean 'front'\?"
    for use in (victim_indices, run_trial):
        with pytest.raises(InputError, match=sentence):
            use(study)


def test_a_result_is_asked_for_by_a_name_there_is():
    trial = Trial(scene=None, snapshots=(), victims=(SimpleNamespace(name="front"),))
    assert trial.victim("front").name == "front"
    with pytest.raises(InputError, match=r"no victim 'frnt'; there is 'front'"):
        trial.victim("frnt")


def post_at(x: float, y: float = 0.0, z: float = 0.5, **changes) -> Study:
    """`STUDY` in free space with the radar "front" alone, 2.4 m before 0, and a point."""
    point = Point(name="post", x=x, y=y, z=z, rcs=1.0)
    street = Street(vehicles=STUDY.street.vehicles[:1], points=(point,))
    radar = replace(FRONT, **changes)
    return replace(
        STUDY,
        street=street,
        radars=(radar,),
        targets=("post",),
        tracer=FreeSpace(),
        num_sweeps=2,
    )


@pytest.mark.parametrize("sampling", ["complex", "real"])
@pytest.mark.parametrize("num_transmitters", [1, 2])
def test_the_snr_of_a_point_is_that_of_its_traced_echo(sampling, num_transmitters):
    """The radar equation against paths, links and filter; a frame moves by less than 0.1 dB."""
    study = post_at(
        15.0,
        2.0,
        1.5,
        waveform=Sawtooth(bandwidth=1e9, ramp_duration=1e-3),
        coding=None if num_transmitters == 1 else TimeDivision(),
        array=AntennaArray(num_transmitters=num_transmitters),
        converter=Converter(sampling=sampling, sample_rate=2e6),
    )
    study = replace(study, num_sweeps=16, receiver=RangeDoppler())
    (echo,) = check(study).echoes
    (traced,) = run_trial(study).victim("front").score.echo_snr
    assert 10 * np.log10(echo.snr / traced) == pytest.approx(0.0, abs=0.1)
    assert (echo.radar, echo.target) == ("front", "post")
    assert echo.range == pytest.approx(np.sqrt(12.6**2 + 2.0**2 + 1.0))


def test_the_powers_of_a_radar_are_those_of_a_link_budget_by_hand():
    """12 dBm, 9 dB and 16 dB radiate 37 dBm; −174 dBm/Hz, 11 dB and 2·0.5 MHz leave −103 dBm."""
    pattern = replace(FRONT.array.pattern, peak_gain=from_db(16.0))
    radar = replace(
        FRONT,
        transmit_power=from_db(12.0 - 30.0),
        noise_figure=from_db(11.0),
        array=replace(FRONT.array, pattern=pattern),
        if_filter=IfFilter(passband=0.45e6, stopband=0.55e6),
    )
    found = check(replace(STUDY, radars=(radar,))).radars[0]
    assert 10 * np.log10(found.eirp) + 30 == pytest.approx(37.0, abs=1e-9)
    assert 10 * np.log10(found.sample_noise) + 30 == pytest.approx(-103.0, abs=0.2)
    assert (found.antenna_gain, found.noise_figure) == (pattern.peak_gain, radar.noise_figure)


def test_the_resolution_in_azimuth_is_the_beam_of_all_virtual_elements():
    """0.886 λ/(N d), with N = 24 at half a wavelength; a row measures no elevation."""
    study = equal_chirps(TimeDivision(), num_channels=8)
    found = check(study).radars[0]
    wavelength, spacing = SPEED_OF_LIGHT / 77.2e9, study.radars[0].array.spacing
    assert found.azimuth_beamwidth == pytest.approx(0.886 * wavelength / (24 * spacing), rel=5e-3)
    assert found.elevation_beamwidth is None


def test_a_gain_that_no_antenna_of_the_beam_has_is_noted_once():
    """The paper has 27 dB and a beam of 160° by 20°, which has 10.6 dB."""
    (note,) = check(STUDY).notes
    assert "peak_gain of 'front' and 1 more is 27 dB" in note
    assert "10.6 dB at most" in note
    pattern = replace(FRONT.array.pattern, peak_gain=from_db(10.6))
    modest = replace(FRONT, array=replace(FRONT.array, pattern=pattern))
    assert check(replace(STUDY, radars=(modest,))).notes == ()


@pytest.mark.parametrize("widths", [(160.0, 20.0), (60.0, 12.0), (3.0, 4.0), (300.0, 250.0)])
def test_the_directivity_is_that_of_the_pattern_over_the_sphere(widths):
    """4π/∫g dΩ by random directions of equal density; a narrow Gaussian has 16 ln 2/(φθ)."""
    azimuth, elevation = np.radians(widths)
    pattern = ElementPattern(
        peak_gain=7.0, azimuth_beamwidth=azimuth, elevation_beamwidth=elevation, floor=1e-9
    )
    draw = np.random.default_rng(1)
    towards = draw.normal(size=(2_000_000, 3))
    towards /= np.linalg.norm(towards, axis=1, keepdims=True)
    mean = float(np.mean(pattern.gain(towards))) / 7.0
    assert directivity(pattern) == pytest.approx(1.0 / mean, rel=0.05)
    if max(widths) < 10:
        narrow = 16.0 * np.log(2.0) / (azimuth * elevation)
        assert directivity(pattern) == pytest.approx(narrow, rel=5e-3)


@pytest.mark.parametrize(
    ("place", "yaw", "said"),
    [
        ((-20.0, 0.0, 0.5), 0.0, r"'post' is behind 'front', .* 30 dB weaker; check mount\.yaw"),
        ((20.0, 0.0, 0.5), np.pi, r"'post' is behind 'front'"),
        ((8.0, 0.0, 6.0), 0.0, r"'post' is beside the beam of 'front', at 0° .* and 44° of elev"),
        ((20.0, 0.0, 0.5), 0.0, None),
        ((-20.0, 0.0, 0.5), np.pi, None),
    ],
)
def test_a_target_that_the_beam_does_not_reach_is_named(place, yaw, said):
    """The gain behind a beam of 160° is 12 · (180/160)² = 15 dB below its maximum, each way."""
    mount = replace(BUMPER, yaw=yaw)
    study = post_at(*place, mount=mount)
    notes = list(targets_out_of_reach(study, schedules_of(study)))
    assert len(notes) == (said is not None)
    assert said is None or re.search(said, notes[0])


def test_a_vehicle_beside_a_radar_is_not_behind_it():
    """Its middle is 2 m behind the radar, and its front before it."""
    beside = replace(STUDY.street.vehicles[1], x=0.4, y=3.5)
    street = Street(vehicles=(STUDY.street.vehicles[0], beside))
    study = replace(STUDY, street=street, radars=(FRONT,), targets=("car",))
    assert not list(targets_out_of_reach(study, schedules_of(study)))
    followed = replace(street, vehicles=(street.vehicles[0], replace(beside, x=-0.4)))
    (note,) = targets_out_of_reach(replace(study, street=followed), schedules_of(study))
    assert note.startswith("'car' is behind 'front'")


def test_a_body_behind_a_radar_is_no_surprise_if_no_targets_are_named():
    assert not list(targets_out_of_reach(STUDY, schedules_of(STUDY)))


def test_targets_that_no_victim_can_report_are_named():
    """Two cars that meet at 60 km/h each are faster than the receiver searches by default."""
    fast = replace(STUDY.street.vehicles[1], x=25.0, heading=np.pi, speed=60 / 3.6)
    own = replace(STUDY.street.vehicles[0], speed=60 / 3.6)
    street = replace(STUDY.street, vehicles=(own, fast, replace(STUDY.street.vehicles[2], x=60.0)))
    study = replace(STUDY, street=street, victims=("front",))
    with pytest.warns(ModelWarning) as notes:
        check(study)
    said = [str(note.message) for note in notes]
    assert any(
        "'car' moves at 120 km/h" in s and "raise receiver.greatest_speed" in s for s in said
    )
    assert any("'van' is 55.3 m from 'front', beyond" in s for s in said)


def test_a_target_that_another_victim_sees_is_no_reason_for_a_note(recwarn):
    street = replace(
        STUDY.street,
        vehicles=(*STUDY.street.vehicles[:2], replace(STUDY.street.vehicles[2], x=35.0)),
    )
    check(replace(STUDY, street=street))
    assert not [note for note in recwarn if "greatest range" in str(note.message)]


def test_a_target_faster_than_chirps_tell_apart_is_named():
    chirps = replace(FRONT, waveform=Sawtooth(bandwidth=500e6, ramp_duration=1e-3))
    street = replace(
        STUDY.street,
        points=(Point(name="bird", x=15.0, y=0.0, z=0.5, rcs=1.0, velocity=(9.0, 0.0, 0.0)),),
    )
    study = replace(STUDY, street=street, radars=(chirps,), targets=("bird",))
    with pytest.warns(ModelWarning, match="'bird' moves at 32 km/h .*another speed"):
        check(study)


def test_the_note_on_a_fast_target_names_what_a_carrier_has():
    """A carrier with a code has periods, and no ramp_duration."""
    sent = Pmcw().schedule(num_sweeps=8, streams=Streams(1))
    speed, why = greatest_speed(AutoReceiver(), sent, AntennaArray())
    assert speed == pytest.approx(SPEED_OF_LIGHT / 79e9 / (4.0 * sent.start_time[1]))
    assert "sweeps tell speeds apart to 170 km/h" in why
    assert "use fewer periods or a shorter idle" in why


def test_a_mitigation_that_needs_equal_ramps_is_refused_for_triangles():
    study = paper_study("diverse", radars=("vehicle-2", "vehicle-4"))
    study = replace(study, receiver=replace(study.receiver, mitigation=RampMinimum()))
    with pytest.raises(CapabilityError, match="'ramp-minimum' compares range cells"):
        check(study)


@pytest.mark.parametrize(
    ("mitigation", "sentence"),
    [
        (StftExcision(), "a ramp has 20 samples, and the window .* use a window of 16 or less"),
        (Blanking(detector=StftCfar()), "use a window of 16 or less"),
        (Burg(detector=StftCfar()), "use a window of 16 or less"),
        (ComplexNetwork(), "windows of 32 samples, and a ramp has 20; 'blanking' works"),
    ],
    ids=["stft-excision", "blanking by stft-cfar", "burg by stft-cfar", "complex-network"],
)
def test_a_window_longer_than_the_ramps_is_refused_before_the_tracing(mitigation, sentence):
    """A ramp of 39 µs, less 10 µs at both ends, has 20 samples at 1 MS/s."""
    waveform = Triangular(bandwidth=2e7, ramp_duration=39e-6)
    study = paper_study("diverse", radars=("vehicle-2", "vehicle-4"))
    study = replace(
        study,
        radars=tuple(replace(radar, waveform=waveform) for radar in study.radars),
        receiver=replace(study.receiver, mitigation=mitigation),
    )
    with pytest.raises(CapabilityError, match=f"^receiver.mitigation, of radars.0: .*{sentence}"):
        check(study)

    def refuse(stage, done, total):
        raise AssertionError(stage)

    with pytest.raises(CapabilityError, match=sentence):
        run_trial(study, progress=refuse)


@pytest.mark.parametrize("start", [0.86e9, 2.4e9, 5.75e9, 10.45e9, 24e9, 49e9, 76.1e9, 79e9])
def test_powers_are_those_at_the_radars_own_carrier(start):
    """The radar equation: λ² falls by 10 dB from 24 to 76 GHz, and rounding keeps to 0.1 dB."""
    wave = replace(PLAIN, start_frequency=start, bandwidth=20e6)
    point = Point(name="point", x=20.0, y=0.0, z=0.5, rcs=2.0)
    study = replace(
        STUDY,
        street=Street(vehicles=STUDY.street.vehicles[:1], points=(point,)),
        radars=(replace(FRONT, waveform=wave),),
        tracer=FreeSpace(),
    )
    paths = tracer_of(study, schedules_of(study)).trace(scene_of(study))
    wavelength, distance = SPEED_OF_LIGHT / (start + 10e6), 20.0 - BUMPER.x
    expected = np.sqrt(wavelength**2 * 2.0 / ((4 * np.pi) ** 3 * distance**4))
    ratio = abs(paths.transfer[0, 0, 0]) / expected
    assert 20 * np.log10(ratio) == pytest.approx(0.0, abs=0.1)


def test_a_frequency_of_the_tracer_is_kept():
    study = replace(STUDY, tracer=FreeSpace(frequency=60e9))
    assert tracer_of(study, schedules_of(study)).frequency == 60e9


def test_vehicles_of_points_are_drawn_anew_in_every_trial():
    """The spread of 3GPP's cross section had been the same in all trials."""

    def echo(seed):
        study = replace(STUDY, tracer=PointVehicles(model="3gpp-one"), seed=seed)
        paths = tracer_of(study, schedules_of(study)).trace(scene_of(study))
        return 20.0 * np.log10(np.abs(paths.transfer[0, 0, 0]))

    drawn = np.array([echo(seed) for seed in range(40)])
    assert 1.0 < np.std(drawn) < 6.0
    assert echo(3) == drawn[3]


def test_drawn_ramps_of_one_band_have_one_frequency():
    """So that studies that differ in waveform share their paths."""
    for seed in range(5):
        study = replace(STUDY, seed=seed)
        assert tracer_of(study, schedules_of(study)).frequency == 79e9


def test_megahertz_in_the_place_of_gigahertz_are_noted():
    slow = replace(PLAIN, start_frequency=77e6, bandwidth=200e6)
    study = replace(STUDY, radars=(replace(FRONT, waveform=slow),))
    with pytest.warns(ModelWarning) as notes:
        check(study)
    said = " ".join(str(note.message) for note in notes)
    assert "'front' transmits at 0.177 GHz" in said


def test_a_point_nearer_than_the_least_range_is_named():
    point = Point(name="near", x=2.6, y=0.0, z=0.5, rcs=1.0)
    study = replace(STUDY, street=replace(STUDY.street, points=(point,)), radars=(FRONT,))
    (note,) = [one for one in targets_out_of_reach(study, schedules_of(study)) if "'near'" in one]
    assert "nearer than the receiver's least range of 0.5 m" in note


@pytest.mark.parametrize("seed", range(6))
def test_ranges_and_range_rates_of_points_count_heights(seed):
    """Of drawn points about drawn mounts: beside the truth of the scene."""
    draw = np.random.default_rng(seed)
    places, velocities = draw.uniform((3, -5, 2), (20, 5, 25), (4, 3)), draw.uniform(-9, 9, (4, 3))
    points = tuple(
        Point(name=f"point-{n}", x=x, y=y, z=z, rcs=1.0, velocity=tuple(map(float, velocity)))
        for n, ((x, y, z), velocity) in enumerate(zip(places, velocities, strict=True))
    )
    pitch, yaw = draw.uniform(-0.3, 0.3, 2)
    mount, array = replace(BUMPER, pitch=pitch, yaw=yaw), AntennaArray(pattern=ISOTROPIC)
    radar = replace(FRONT, mount=mount, array=array)
    names = tuple(point.name for point in points)
    study = replace(
        STUDY, street=replace(STUDY.street, points=points), radars=(radar,), targets=names
    )
    exact = truth(scene_of(study), 0, names)
    for n, point in enumerate(points):
        for greatest, is_noted in ((1.001, False), (0.999, True)):
            receiver = CoherentReceiver(
                greatest_range=exact.range[n] * greatest,
                greatest_speed=abs(exact.range_rate[n]) * greatest,
            )
            limited = replace(study, receiver=receiver, targets=(point.name,))
            notes = list(targets_out_of_reach(limited, schedules_of(limited)))
            assert any("beyond the receiver's greatest range" in note for note in notes) is is_noted
            receiver = replace(receiver, greatest_range=100.0)
            limited = replace(limited, receiver=receiver)
            notes = list(targets_out_of_reach(limited, schedules_of(limited)))
            assert any("along the line of sight" in note for note in notes) is is_noted


def test_a_waveform_that_the_paper_does_not_have_is_refused():
    with pytest.raises(InputError, match="there is no waveform 'foo'; choose among"):
        paper_study("foo")


def test_what_sionna_cannot_trace_is_told_by_the_check():
    """Also where Sionna is not installed."""
    point = Point(name="post", x=15.0, y=2.0, z=0.5, rcs=1.0)
    street = replace(STUDY.street, points=(point,))
    with pytest.raises(InputError, match=r"tracer: .*neither moving parts nor point scatterers"):
        check(replace(STUDY, street=street, tracer=SionnaRt()))


def test_a_radar_far_from_its_vehicle_is_noted():
    """20 m in the place of 2.0 m."""
    study = replace(STUDY, radars=(replace(FRONT, mount=Pose(x=24.0, y=3.0, z=0.5)),))
    with pytest.warns(ModelWarning, match=r"'front' is .* m away from 'ego', on which it rides"):
        check(study)


def test_radars_of_two_bands_are_noted():
    """One frequency serves both: 24 and 79 GHz have a mean of 52 GHz, 6.6 dB above the lower."""
    low = replace(FRONT, waveform=replace(PLAIN, start_frequency=24e9, bandwidth=200e6))
    with pytest.warns(ModelWarning) as notes:
        check(replace(STUDY, radars=(low, OTHER)))
    said = [str(note.message) for note in notes if "powers are those at" in str(note.message)]
    assert any("'front' transmits at 24.1 GHz" in one and "-6.7 dB" in one for one in said)
    assert len(said) == 2


@pytest.mark.parametrize(
    ("coding", "said", "greatest"),
    [
        (TimeDivision(), "4 ms apart, .* than 0.17 km/h", 0.0471),
        (PhaseCoded(), "6 ms apart, .* than 0.023 km/h", 0.0062),
    ],
    ids=["turns", "codes"],
)
def test_elements_separated_as_if_targets_were_at_rest_are_noted(coding, said, greatest):
    """λ/20 or λ/100 from the first of three or four triangles to the last one, λ = c/79.5 GHz."""
    triangles = Triangular(start_frequency=79e9, bandwidth=1e9, ramp_duration=1e-3)
    array = AntennaArray(num_transmitters=3)
    radar = replace(FRONT, waveform=triangles, array=array, coding=coding)
    study = replace(STUDY, radars=(radar,), num_sweeps=12)
    with pytest.warns(ModelWarning, match=f"'front' share blocks .* {said}"):
        check(replace(study, receiver=CoherentReceiver()))
    slow = replace(study, receiver=CoherentReceiver(greatest_speed=greatest))
    with pytest.warns(ModelWarning, match="is taken for noise") as notes:
        check(slow)
    assert not any("share blocks" in str(note.message) for note in notes)


def test_elements_that_never_send_are_noted():
    array = AntennaArray(num_transmitters=3)
    with pytest.warns(ModelWarning, match=r"'front' has 3 transmitting elements, of which 1 sends"):
        check(replace(STUDY, radars=(replace(FRONT, array=array), OTHER)))


@pytest.mark.parametrize(
    ("rule", "message"),
    [
        # 0.7 MHz over 1 MHz/µs
        (Slots(slot=0.6e-6, num_slots=3), r"access.slot is 0.6 us.* up to 0.7 us apart"),
        (Compass(num_bands=2, spacing=0.9e9), r"access.spacing is 900 MHz.* covers 1000 MHz"),
    ],
)
def test_rules_of_access_that_keep_nobody_apart_are_noted(rule, message):
    study = replace(STUDY, radars=(FRONT, replace(OTHER, waveform=PLAIN)))
    with pytest.warns(ModelWarning, match=message):
        check(replace(study, access=rule))


@pytest.mark.parametrize(
    "rule",
    [
        Slots(slot=0.8e-6, num_slots=3),
        Slots(slot=0.1e-6, num_slots=1),
        Compass(num_bands=2, spacing=1.1e9),
    ],
)
def test_rules_of_access_that_keep_radars_apart_are_not(rule):
    study = replace(STUDY, radars=(FRONT, replace(OTHER, waveform=PLAIN)))
    check(replace(study, access=rule))


def test_slots_do_not_keep_different_slopes_apart():
    message = r"slots' keeps radars of equal slopes apart, and theirs reach from 0.* to 1 MHz/us"
    with pytest.warns(ModelWarning, match=message):
        check(replace(STUDY, access=Slots(slot=50e-6, num_slots=3)))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"start_time": 10.0}, "it begins to transmit at 10 s, and the frame has ended at 32 ms"),
        ({"start_time": -1.0}, "it has transmitted at -9.* ms, and the frame begins at 0 ms"),
        (
            {"waveform": replace(PLAIN, start_frequency=81e9)},
            "it transmits at 81 to 82 GHz, and the frame is at 79 to 80 GHz",
        ),
    ],
)
def test_a_radar_that_cannot_disturb_the_victim_is_noted(change, message):
    study = replace(STUDY, radars=(FRONT, replace(OTHER, **change)), victims=("front",))
    with pytest.warns(ModelWarning, match=f"'other' does not disturb 'front': {message}"):
        check(study)


@pytest.mark.parametrize(
    "change",
    [
        {"start_time": 31e-3},
        {"waveform": replace(PLAIN, start_frequency=80.0005e9, bandwidth=0.5e9)},
    ],
)
def test_a_radar_that_meets_the_victim_for_a_moment_is_not(change):
    """The last ramp ends at 32 ms, and the IF filter stops 0.7 MHz."""
    check(replace(STUDY, radars=(FRONT, replace(OTHER, **change)), victims=("front",)))


def test_two_radars_at_one_place_are_refused_by_the_check():
    study = replace(STUDY, radars=(FRONT, replace(OTHER, vehicle="ego")))
    with pytest.raises(InputError, match=r"radars.1.mount: radars 'front' and 'other' are at the"):
        check(study)


def test_a_noise_figure_that_no_radar_has_is_noted():
    """140 dB in the place of 14.0 dB."""
    noisy = replace(FRONT, noise_figure=from_db(140.0))
    with pytest.warns(ModelWarning, match="'front' has a noise figure of 140 dB"):
        check(replace(STUDY, radars=(noisy, OTHER)))


def test_a_frame_whose_map_a_point_fills_is_noted():
    """In 100 µs, range rates are 19 m/s apart; 20 m/s are one cell."""
    short = replace(FRONT, waveform=Sawtooth(bandwidth=150e6, ramp_duration=100e-6))
    receiver = CoherentReceiver(greatest_speed=20.0)
    study = replace(STUDY, radars=(short,), num_sweeps=1, receiver=receiver)
    with pytest.warns(ModelWarning) as notes:
        check(study)
    assert any("lasts 0.1 ms" in str(note.message) for note in notes)
    with pytest.warns(ModelWarning) as notes:
        check(replace(study, receiver=replace(receiver, greatest_speed=30.0)))
    assert not any("lasts 0.1 ms" in str(note.message) for note in notes)


def test_a_radar_alone_needs_no_slot():
    check(replace(STUDY, radars=(FRONT,), access=Slots(slot=0.1e-6, num_slots=3)))


def test_a_band_is_that_of_the_whole_frame():
    """Chirps of 250 MHz that hop over 1 GHz."""
    hopping = Hopping(bandwidth=250e6, ramp_duration=1e-3)
    radars = tuple(replace(radar, waveform=hopping) for radar in (FRONT, OTHER))
    with pytest.warns(ModelWarning) as notes:
        check(replace(STUDY, radars=radars, access=Compass(num_bands=2, spacing=300e6)))
    assert any("a frame covers 1000 MHz" in str(note.message) for note in notes)


def test_a_frame_may_be_as_long_as_its_interval():
    check(replace(STUDY, radars=(FRONT,), access=HopAfterHit(frame_interval=32e-3)))


def test_frames_longer_than_their_interval_are_refused():
    with pytest.raises(InputError, match=r"a frame of radar 'front' lasts 32 ms, and the next one"):
        check(replace(STUDY, access=HopAfterHit(frame_interval=30e-3)))


@pytest.mark.parametrize(("level", "is_noted"), [(54.9, False), (55.1, True)])
def test_an_eirp_above_the_limit_of_the_road_is_noted(level, is_noted):
    """The antenna's beam has a gain of its own."""
    power = 10 ** ((level - 30.0) / 10) / FRONT.transmit_gain / FRONT.array.pattern.peak_gain
    study = replace(STUDY, radars=(replace(FRONT, transmit_power=power),))
    notes = list(excessive_powers(study))
    assert len(notes) == is_noted
    assert all(f"'front' radiates an EIRP of {level} dBm" in note for note in notes)
