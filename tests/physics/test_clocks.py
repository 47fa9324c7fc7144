"""Clocks that drift and sweeps that start late, against what they do to beats."""

from dataclasses import replace

import numpy as np
import pytest

from polychirp.errors import InputError
from polychirp.model.antenna import ISOTROPIC, AntennaArray
from polychirp.model.radar import Radar
from polychirp.model.ramp import RampSchedule
from polychirp.model.scene import Actor, Scene
from polychirp.study.spec import GREATEST_DRIFT, Study, StudyRadar, schedule_of
from polychirp.synthesis.stretch.engine import Stretch
from polychirp.testing.paths import HandPath, paths_of
from polychirp.traffic.street import Street, Vehicle
from polychirp.waveform import Sawtooth, Triangular

SLOPE = 1e12
START = 79e9
DURATION = 200e-6


def sawtooth(num_ramps=1, *, period=DURATION, slope=SLOPE):
    return RampSchedule(
        start_time=period * np.arange(num_ramps),
        duration=np.full(num_ramps, DURATION),
        start_frequency=np.full(num_ramps, START),
        slope=np.full(num_ramps, slope),
        start_phase=np.zeros(num_ramps),
        sweep=np.arange(num_ramps),
    )


def sent_phase(schedule, time):
    """Cycles, while the plan's only ramp lasts."""
    into = time - schedule.start_time[0]
    return (
        schedule.start_phase[0]
        + schedule.start_frequency[0] * into
        + 0.5 * schedule.slope[0] * into**2
    )


def beats(own, sent, delay):
    """Hz, of an interferer at every ramp, from the least-squares slope of the phase."""
    radars = [
        Radar(name=name, array=AntennaArray(num_channels=1, pattern=ISOTROPIC))
        for name in ("victim", "other")
    ]
    car = Actor(name="car", kind="vehicle")
    scene = Scene(time=0.0, actors=(car,), radars=tuple(radars), carriers=(0, 0))
    paths = paths_of(HandPath(delay=delay, transmitter=1))
    y = Stretch().contribution(scene, [own, sent], [paths], victim=0, transmitter=1)
    phase = np.unwrap(np.angle(y[0, 0])) / (2 * np.pi)
    t = np.arange(phase.shape[-1]) / radars[0].converter.sample_rate
    return np.polyfit(t, phase.T, 1)[0]


# ── drift ───────────────────────────────────────────────────────────────────────────────────────


@pytest.mark.parametrize("drift", [GREATEST_DRIFT, -GREATEST_DRIFT])
@pytest.mark.parametrize("late", [0.0, 3.0])
def test_a_drifting_clock_sends_the_plan_at_the_time_it_shows(drift, late):
    """φ(t) = φ_plan(u(t)), u = (1+δ)t + ρt²/2, up to the cubic ½ρbT³."""
    plan = replace(sawtooth(), start_time=[late])
    offset = 2e-5
    clocked = plan.as_clocked(clock_offset=offset, clock_drift=drift)
    t = clocked.start_time[0] + np.linspace(0.0, clocked.duration[0], 101)
    u = (1 + offset) * t + 0.5 * drift * t**2
    assert u[0] == pytest.approx(late, abs=1e-15)
    assert u[-1] == pytest.approx(late + DURATION, abs=1e-15)
    cubic = 0.5 * abs(drift) * SLOPE * DURATION**3
    # 79 GHz times the rounding of 3 s is 4e-5 cycles
    missed = np.abs(sent_phase(clocked, t) - sent_phase(plan, u)).max()
    assert missed == pytest.approx(cubic, abs=2e-4 if late else 1e-6)


def test_without_drift_a_clock_is_scaled_as_ever():
    plan, rate = sawtooth(5), 1.0 + 7e-5
    clocked = plan.as_clocked(start_time=1e-3, clock_offset=7e-5)
    assert clocked.start_time.tolist() == (plan.start_time / rate + 1e-3).tolist()
    assert clocked.duration.tolist() == (plan.duration / rate).tolist()
    assert clocked.slope.tolist() == (plan.slope * rate**2).tolist()


def test_the_ghost_of_a_twin_whose_clock_drifts_walks():
    """f_IF = bτ − ρ f₀ t_k − ½ρ b t_k²: the twin's carrier runs away, and its ramps come early."""
    own, drift, delay = sawtooth(20), 5e-6, 1e-7
    found = beats(own, own.as_clocked(clock_drift=drift), delay)
    start = own.start_time
    middle = start + 0.5 * DURATION
    # slopes differ by ρ(2bt_k + f₀): the mean beat is that half-way through the ramp
    expected = SLOPE * delay - drift * (START * middle + 0.5 * SLOPE * start**2)
    expected -= drift * SLOPE * DURATION * start
    # what is left is ρτ f₀ = 0.04 Hz, and the filter's slight colour
    assert found == pytest.approx(expected, abs=0.5)
    assert found[0] - found[-1] > 1400.0  # 2.1 m of range at 1e12 Hz/s


def test_a_clock_that_stops_is_refused():
    with pytest.raises(InputError, match="stands still"):
        sawtooth(2, period=1.0).as_clocked(clock_drift=-0.6)


# ── jitter ──────────────────────────────────────────────────────────────────────────────────────


def test_a_late_sweep_of_a_twin_moves_its_beat_by_the_slope_times_the_delay():
    own = sawtooth(3, period=DURATION + 10e-6)
    late = np.array([0.0, 50e-9, -30e-9])
    found = beats(own, own.with_late_sweeps(late), 1e-7)
    assert found == pytest.approx(SLOPE * (1e-7 + late), abs=0.1)


def test_a_radar_does_not_hear_its_own_jitter():
    """Its converter starts with its ramps, and an echo at rest has the same delay then."""
    own = sawtooth(3, period=DURATION + 10e-6)
    late = own.with_late_sweeps(np.array([3e-6, 0.0, -2e-6]))
    assert beats(late, late, 1e-7) == pytest.approx(SLOPE * 1e-7, abs=0.1)


def test_a_sweep_is_never_started_before_the_former_one_ends():
    with pytest.raises(InputError, match=r"jitter starts sweep 1 1e-09 s before sweep 0 ends"):
        sawtooth(3).with_late_sweeps(np.array([0.0, -1e-9, 0.0]))
    with pytest.raises(InputError, match="2 delays are too few for 3 sweeps"):
        sawtooth(3).with_late_sweeps(np.zeros(2))


def study(*names, num_sweeps=64, **fields):
    radars = tuple(
        StudyRadar(name=name, vehicle="car", **{"waveform": Sawtooth(idle=20e-6), **fields})
        for name in names
    )
    street = Street(vehicles=(Vehicle(name="car", x=0.0, y=0.0),))
    return Study(name="s", street=street, radars=radars, num_sweeps=num_sweeps)


def jitter_of(experiment, number=0):
    plan = schedule_of(experiment, experiment.radars[number])
    return plan.start_time - np.arange(plan.num_ramps) * (1.5e-3 + 20e-6)


def test_jitter_has_its_rms_and_a_stream_of_its_own():
    alone = jitter_of(study("a", start_jitter=1e-6, num_sweeps=4000))
    assert np.std(alone) == pytest.approx(1e-6, rel=4 / np.sqrt(2 * 4000))
    assert jitter_of(study("a", start_jitter=1e-6)).tolist() == alone[:64].tolist()
    assert jitter_of(study("b", "a", start_jitter=1e-6), 1).tolist() == alone[:64].tolist()
    assert not np.any(jitter_of(study("b", "a", start_jitter=1e-6)) == alone[:64])


def test_jitter_of_touching_sweeps_is_refused():
    touching = study("a", waveform=Triangular(), start_jitter=1e-9)
    with pytest.raises(InputError, match="more idle time"):
        schedule_of(touching, touching.radars[0])


@pytest.mark.parametrize("fields", [{"start_jitter": -1e-9}, {"clock_drift": 2 * GREATEST_DRIFT}])
def test_a_clock_beyond_reason_is_refused(fields):
    with pytest.raises(InputError, match=r"jitter|drifts"):
        study("a", **fields)
