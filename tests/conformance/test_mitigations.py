"""Rules that every mitigation obeys."""

from dataclasses import replace

import numpy as np
import pytest

from polychirp.axes import axes_of
from polychirp.errors import CapabilityError, InputError
from polychirp.model.antenna import AntennaArray
from polychirp.model.if_frame import IfFrame, SampleTimes, sample_times
from polychirp.model.radar import Converter
from polychirp.receiver.mitigation import (
    Autoregression,
    Blanking,
    Burg,
    ChirpSubtraction,
    ComplexNetwork,
    DualSparsity,
    Imat,
    Interpolation,
    LowRankHankel,
    MatrixPencil,
    NoiseCanceller,
    Nulling,
    RampMinimum,
    StftExcision,
    StftStatistics,
    Wavelet,
)
from polychirp.receiver.mitigation.base import mitigated, refuse_unfit
from polychirp.receiver.range_doppler.chain import RangeDoppler
from polychirp.receiver.signal_model.point_signal import (
    beat_phase,
    hann_weights,
    matched_amplitudes,
)
from polychirp.rng import Streams
from polychirp.waveform import DiverseTriangular, Sawtooth
from tests.support.points import HandPoint, frame_of

RAMPS = DiverseTriangular().schedule(num_sweeps=3, streams=Streams(2))
POINTS = [
    HandPoint(range=9.0, range_rate=-5.0, azimuth=0.3, power=1e4),
    HandPoint(range=17.0, range_rate=3.0, azimuth=-0.5, power=1e3),
]
REPAIRS = {
    "blanking": Blanking(),
    "tapered blanking": Blanking(taper=8e-6),
    "interpolation": Interpolation(),
    "burg": Burg(),
    "autoregression": Autoregression(),
    "matrix pencil": MatrixPencil(),
    "imat": Imat(),
    "zeroing excision": StftExcision(),
    "levelling excision": StftExcision(cells="levelled"),
    "filling excision": StftExcision(cells="filled"),
    "low-rank Hankel": LowRankHankel(rank=4, iterations=10),
}
"""Methods that remove bursts of any kind on any ramps."""

ON_ANY_RAMPS = REPAIRS | {
    "nulling": Nulling(),
    "STFT statistics": StftStatistics(),
    "wavelet": Wavelet(),
    "dual sparsity": DualSparsity(),
    "noise canceller": NoiseCanceller(least_gain=1.0),
}
"""Methods that work ramp by ramp; the last ones remove only the bursts they are made for."""

TRAINED = {"complex network": ComplexNetwork()}
"""Methods that work ramp by ramp and are trained: nothing bounds what they do to clean frames."""

ON_EQUAL_RAMPS = {"ramp minimum": RampMinimum(), "burg along ramps": Burg(along="ramps", order=4)}
"""Methods that compare ramps, which must be equal."""

FOR_LONG_BURSTS = {"chirp subtraction": ChirpSubtraction()}
"""Methods that leave short bursts as they are; tests/unit/receiver/test_chirp_subtraction.py."""

CHIRPS = Sawtooth(start_frequency=77e9, bandwidth=4e8, ramp_duration=40e-6).schedule(
    num_sweeps=32, streams=Streams(1)
)
FAST = Converter(sample_rate=10e6, start=3e-6, margin=1e-6)
SLOW = ("filling excision", "low-rank Hankel")


def params(methods):
    slow = pytest.mark.slow
    return [
        pytest.param(method, marks=[slow] if name in SLOW else [], id=name)
        for name, method in methods.items()
    ]


@pytest.fixture(params=params(REPAIRS))
def method(request):
    return request.param


@pytest.fixture(params=params(ON_ANY_RAMPS | TRAINED))
def ramp_method(request):
    return request.param


@pytest.fixture(params=params(ON_ANY_RAMPS | TRAINED | ON_EQUAL_RAMPS | FOR_LONG_BURSTS))
def chirp_method(request):
    return request.param


def times_on(schedule):
    """Times of the samples of `FAST` on the ramps."""
    return sample_times(schedule, FAST)


def chirps(*, points=POINTS, seed=0):
    """A frame of equal chirps."""
    return frame_of(CHIRPS, points, seed=seed, converter=FAST)


def bursts(frame, level=300.0):
    """One burst of 12 samples in every ramp, the same in all channels."""
    out = np.zeros_like(frame.samples)
    draw = np.random.default_rng(1)
    for k, length in enumerate(frame.times.num_samples):
        start = draw.integers(100, length - 100)
        out[:, k, start : start + 12] = level * np.exp(2j * np.pi * draw.random(12))
    return out


def amplitudes(cleaned, frame, point):
    motion = np.array([[point.range, point.range_rate, 0.0]])
    phases = beat_phase(RAMPS, frame.times, motion=motion, time=float(RAMPS.start_time[0]))
    return matched_amplitudes(
        cleaned.samples, hann_weights(cleaned.weight), phases, frame.times.rate
    )[0]


def test_parts_go_through_it_one_by_one_and_still_sum_to_the_whole(ramp_method):
    method = ramp_method
    echo, noise = frame_of(RAMPS, POINTS, noise=0.0), frame_of(RAMPS, [], seed=5)
    other = bursts(echo)
    cleaned = mitigated(method, echo.with_samples(echo.samples + noise.samples + other))
    parts = cleaned.repair(np.stack([echo.samples, noise.samples, other]))
    assert np.abs(parts.sum(axis=0) - cleaned.samples).max() < 1e-11 * np.abs(cleaned.samples).max()
    assert not np.allclose(cleaned.samples, echo.samples + noise.samples + other)


def test_bursts_go_and_echoes_stay(method):
    """What is left of 300 times the noise is less than noise; a weak echo keeps its amplitude."""
    clean = frame_of(RAMPS, POINTS)
    other = bursts(clean)
    cleaned = mitigated(method, clean.with_samples(clean.samples + other))
    left = cleaned.repair(other) * cleaned.weight
    assert np.mean(np.abs(left) ** 2) < 0.05
    for point in POINTS:
        expected = amplitudes(mitigated(None, clean), clean, point)
        found = amplitudes(cleaned, clean, point)
        error = np.sqrt(np.mean(np.abs(found - expected) ** 2) / np.mean(np.abs(expected) ** 2))
        assert error < 0.05


@pytest.mark.parametrize("method", params(ON_ANY_RAMPS | FOR_LONG_BURSTS))
def test_a_frame_without_interference_is_not_touched(method):
    frame = frame_of(RAMPS, POINTS)
    cleaned = mitigated(method, frame)
    assert np.array_equal(cleaned.weight, frame.times.is_sample)
    assert cleaned.samples == pytest.approx(frame.samples, abs=1e-9)


def test_the_network_does_not_touch_a_clean_frame_of_strong_echoes():
    frame = frame_of(RAMPS, POINTS)
    cleaned = ComplexNetwork().mitigate(frame)
    assert cleaned.samples == pytest.approx(frame.samples, abs=1e-9)


def test_nothing_is_present_in_the_padding_or_without_weight(ramp_method):
    method = ramp_method
    frame = frame_of(RAMPS, POINTS)
    cleaned = mitigated(method, frame.with_samples(frame.samples + bursts(frame)))
    assert not cleaned.samples[:, cleaned.weight == 0.0].any()
    assert not cleaned.weight[~frame.times.is_sample].any()
    assert cleaned.weight.min() >= 0.0
    assert cleaned.weight.max() <= 1.0


def test_azimuths_are_kept(method):
    """From channel to channel the amplitude of a single echo turns as it did before."""
    frame = frame_of(RAMPS, POINTS[:1], noise=1e-6)
    cleaned = mitigated(method, frame.with_samples(frame.samples + bursts(frame, 1e4)))
    before = amplitudes(mitigated(None, frame), frame, POINTS[0])
    after = amplitudes(cleaned, frame, POINTS[0])
    turn = np.angle(after[1:] * after[:-1].conj() / (before[1:] * before[:-1].conj()))
    # the tones of a decomposition are steady, and over a ramp the echo grows by 1.7e-3
    assert np.abs(turn).max() < (5e-3 if isinstance(method, LowRankHankel) else 1e-3)


@pytest.mark.parametrize(
    ("default", "explicit"),
    [
        (Blanking(), Blanking(guard=8e-6)),
        (Autoregression(), Autoregression(guard=8e-6)),
        (Imat(), Imat(guard=8e-6)),
    ],
    ids=["blanking", "autoregression", "imat"],
)
def test_on_the_papers_ramps_the_default_guard_is_8_us(default, explicit):
    frame = frame_of(RAMPS, POINTS)
    frame = frame.with_samples(frame.samples + bursts(frame))
    assert np.array_equal(mitigated(default, frame).samples, mitigated(explicit, frame).samples)
    assert np.array_equal(mitigated(default, frame).weight, mitigated(explicit, frame).weight)


def test_the_default_guard_shrinks_as_the_sample_rate_grows():
    """A chirp of 40 µs at 20 MS/s: 8 samples on either side of a burst of 4, not 160."""
    ramps = Sawtooth(start_frequency=77e9, bandwidth=4e8, ramp_duration=40e-6).schedule(
        num_sweeps=2, streams=Streams(1)
    )
    converter = Converter(sample_rate=20e6, start=3e-6, margin=1e-6)
    frame = frame_of(ramps, POINTS[:1], converter=converter)
    samples = frame.samples.copy()
    samples[:, 1, 300:304] += 1e4
    cleaned = mitigated(Blanking(), frame.with_samples(samples))
    assert np.flatnonzero(cleaned.weight[1] == 0.0).tolist() == list(range(292, 312))


def test_without_mitigation_all_samples_are_present():
    frame = frame_of(RAMPS, POINTS)
    cleaned = mitigated(None, frame)
    assert np.array_equal(cleaned.samples, frame.samples)
    assert np.array_equal(cleaned.weight, frame.times.is_sample)


def test_the_mitigation_of_a_frame_is_cached(method):
    frame = frame_of(RAMPS, POINTS)
    cleaned = mitigated(method, frame)
    assert mitigated(method, frame) is cleaned
    assert mitigated(method, frame.with_samples(2.0 * frame.samples)) is not cleaned


def test_one_ramp_alone_is_repaired_as_among_others(ramp_method):
    """Methods that work ramp by ramp know no other ramp: ramps are ragged here."""
    frame = frame_of(RAMPS, POINTS)
    frame = frame.with_samples(frame.samples + bursts(frame))
    whole = mitigated(ramp_method, frame).samples
    length = int(frame.times.num_samples[1])
    times = SampleTimes(
        first=frame.times.first[1:2], num_samples=frame.times.num_samples[1:2], rate=1e6
    )
    one = {name: getattr(RAMPS, name)[1:2] for name in axes_of(type(RAMPS))}
    alone = IfFrame(
        samples=frame.samples[:, 1:2, :length],
        times=times,
        schedule=replace(RAMPS, **one),
        array=frame.array,
    )
    found = mitigated(ramp_method, alone).samples[:, 0]
    assert np.abs(found - whole[:, 1, :length]).max() < 1e-9 * np.abs(whole).max()


def test_equal_chirps_with_bursts_on_some_of_them_are_repaired(chirp_method):
    """Parts sum to the whole, and no method makes more of the bursts than there was."""
    echo, noise = chirps(points=POINTS), chirps(points=[], seed=3)
    other = bursts(echo)
    other[:, ::3] = 0.0
    cleaned = mitigated(chirp_method, echo.with_samples(echo.samples + noise.samples + other))
    parts = cleaned.repair(np.stack([echo.samples, noise.samples, other]))
    assert parts.shape[1:] == echo.samples.shape
    assert np.abs(parts.sum(axis=0) - cleaned.samples).max() < 1e-9 * np.abs(other).max()
    assert np.sum(np.abs(parts[2]) ** 2) < 1.3 * np.sum(np.abs(other) ** 2)


def test_noise_alone_is_not_raised(chirp_method):
    """On clean frames, power grows by no more than the share of samples that a method changes."""
    frame = chirps(points=[], seed=5)
    cleaned = mitigated(chirp_method, frame)
    change = np.any(np.abs(cleaned.samples - frame.samples) > 1e-9, axis=0)
    before, after = (np.mean(np.abs(x) ** 2) for x in (frame.samples, cleaned.samples))
    assert after <= before * (1.0 + np.mean(change) + 1e-9)
    if not isinstance(chirp_method, RampMinimum):
        assert np.mean(change) < 2e-3


def test_the_ramp_minimum_changes_clean_noise_as_it_says():
    """Of M exponential powers the least has the mean 1/M of one: 32 ramps, one channel."""
    frame = chirps(points=[], seed=7)
    one = IfFrame(
        samples=frame.samples[:1],
        times=frame.times,
        schedule=frame.schedule,
        array=AntennaArray(num_channels=1),
    )
    cleaned = RampMinimum().mitigate(one)
    ratio = np.mean(np.abs(cleaned.samples) ** 2) / np.mean(np.abs(one.samples) ** 2)
    cells = one.samples.shape[-1]
    assert ratio * 32 == pytest.approx(1.0, abs=4 / np.sqrt(cells))


@pytest.mark.parametrize(("num_points", "spoiled"), [(1, 10), (5, 30)])
def test_the_ramp_minimum_makes_detections_where_nothing_is(num_points, spoiled):
    """Its documentation has the numbers of these 40 clean frames; without it there are none.

    The tolerance is three standard deviations of a number of 40 frames, 9.5 at most.
    """

    def count_elsewhere(found, points):
        near = [
            any(abs(r - one.range) < 1.5 and abs(v - one.range_rate) < 3.0 for one in points)
            for r, v in zip(found.range, found.range_rate, strict=True)
        ]
        return near.count(False)

    counts = []
    for draw in range(40):
        random = np.random.default_rng(draw)
        points = [
            HandPoint(
                range=random.uniform(10.0, 30.0),
                range_rate=random.uniform(-12.0, 12.0),
                azimuth=random.uniform(-0.6, 0.6),
                power=10 ** random.uniform(-1.0, 2.0),
            )
            for _ in range(num_points)
        ]
        frame = chirps(points=points, seed=draw)
        receivers = (RangeDoppler(), RangeDoppler(mitigation=RampMinimum()))
        counts.append([count_elsewhere(one.detect(frame), points) for one in receivers])
    without, with_minimum = np.array(counts).T
    assert not without.any()
    assert np.count_nonzero(with_minimum) == pytest.approx(spoiled, abs=3 * np.sqrt(40 / 4))


@pytest.mark.parametrize("method", ON_EQUAL_RAMPS.values(), ids=ON_EQUAL_RAMPS)
def test_methods_that_compare_ramps_refuse_unequal_ones(method):
    with pytest.raises(CapabilityError, match="equal ramps"):
        method.mitigate(frame_of(RAMPS, POINTS))
    with pytest.raises(CapabilityError, match="equal ramps"):
        refuse_unfit(method, RAMPS, times=times_on(RAMPS), is_real=False, num_channels=4)
    refuse_unfit(method, CHIRPS, times=times_on(CHIRPS), is_real=False, num_channels=4)


def test_a_noise_canceller_refuses_real_samples_and_nulling_one_channel():
    frame = chirps()
    real = frame.with_samples(2.0 * frame.samples.real)
    with pytest.raises(CapabilityError, match="complex samples"):
        NoiseCanceller().mitigate(real)
    with pytest.raises(CapabilityError, match="two receiving channels"):
        refuse_unfit(Nulling(), CHIRPS, times=times_on(CHIRPS), is_real=False, num_channels=1)
    refuse_unfit(Blanking(), CHIRPS, times=times_on(CHIRPS), is_real=True, num_channels=1)


@pytest.mark.parametrize(
    ("make", "word"),
    [
        (lambda: Burg(order=0), "order"),
        (lambda: MatrixPencil(window=1), "windows"),
        (lambda: StftStatistics(window=10), "window"),
        (lambda: Wavelet(levels=0), "level"),
        (lambda: DualSparsity(window=12), "window"),
        (lambda: DualSparsity(iterations=1), "iterations"),
        (lambda: NoiseCanceller(step=2.0), "step"),
        (lambda: NoiseCanceller(taps=0), "tap"),
        (lambda: Nulling(least_excess=1.0), "excess"),
        (lambda: LowRankHankel(rank=0), "rank"),
        (lambda: ComplexNetwork(kept_above=0.0), "share"),
    ],
)
def test_settings_that_cannot_be_are_refused(make, word):
    with pytest.raises(InputError, match=word):
        make()
