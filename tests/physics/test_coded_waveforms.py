"""Codes on carriers and within ramps: side lobes, suppression and floors against closed forms."""

from dataclasses import replace

import numpy as np
import pytest

from polychirp.constants import SPEED_OF_LIGHT
from polychirp.model.antenna import ISOTROPIC, AntennaArray
from polychirp.model.if_filter import IfFilter
from polychirp.model.if_frame import IfFrame, sample_times
from polychirp.model.radar import Converter, Radar
from polychirp.model.scene import Actor, Scene
from polychirp.receiver.attribution import attribute
from polychirp.receiver.decoding.alignment import decoded_chirps
from polychirp.receiver.decoding.chain import Decoding
from polychirp.receiver.decoding.correlation import correlated
from polychirp.rng import Streams
from polychirp.synthesis.stretch.engine import Stretch
from polychirp.testing.paths import HandPath, paths_of
from polychirp.units import from_db, to_db
from polychirp.waveform import Noise, PhaseCodedRamp, Pmcw, Sawtooth
from polychirp.waveform.code_sequences import (
    PREFERRED,
    PRIMITIVE,
    almost_perfect_sequence,
    gold_sequence,
    m_sequence,
)

ARRAY = AntennaArray(num_channels=1, pattern=ISOTROPIC)
WIDE = Radar(
    name="carrier",
    array=ARRAY,
    if_filter=IfFilter(passband=90e6, stopband=150e6, attenuation=from_db(60.0)),
    converter=Converter(sample_rate=200e6, start=0.4e-6, margin=0.0),
)
NARROW = Radar(
    name="chirps",
    array=ARRAY,
    if_filter=IfFilter(passband=10e6, stopband=14e6, attenuation=from_db(60.0)),
    converter=Converter(sample_rate=25e6, start=2e-6, margin=1e-6),
)


def scene_of(*radars):
    car = Actor(name="car", kind="vehicle")
    named = tuple(replace(radar, name=f"radar {n}") for n, radar in enumerate(radars))
    return Scene(time=0.0, actors=(car,), radars=named, carriers=(0,) * len(radars))


def received(radars, schedules, *paths, transmitter):
    """Frame of the first radar, of one transmitter's signal on hand-made paths alone."""
    samples = Stretch().contribution(
        scene_of(*radars), schedules, [paths_of(*paths)], victim=0, transmitter=transmitter
    )
    return IfFrame(
        samples=samples.sum(axis=0),
        times=sample_times(schedules[0], radars[0].converter),
        schedule=schedules[0],
        array=ARRAY,
        if_filter=radars[0].if_filter,
    )


def schedule_of(waveform, *, num_sweeps=1, radar="front"):
    return waveform.schedule(num_sweeps=num_sweeps, streams=Streams(3).of(radar))


PAGE = "coded-waveforms"


def periodic(one, other):
    return np.fft.ifft(np.fft.fft(one).conj() * np.fft.fft(other)).real.round(6)


@pytest.mark.parametrize("order", PRIMITIVE)
def test_m_sequences_have_side_lobes_of_minus_one(order, compare):
    """Golomb 1967: the autocorrelation is L at 0 and −1 elsewhere, 1/L of the peak."""
    code = m_sequence(order)
    correlation = periodic(code, code)
    assert correlation[0] == 2**order - 1
    assert np.all(correlation[1:] == correlation[1])
    compare(
        page=PAGE,
        case=f"m-sequence of {code.size} chips",
        quantity="periodic correlation away from the peak, chips",
        expected=-1.0,
        measured=correlation[1],
        tolerance=0.0,
        source="Golomb 1967",
    )


@pytest.mark.parametrize("order", PREFERRED)
def test_gold_sequences_keep_their_bound_and_exceed_that_of_welch(order, compare):
    """Gold 1967: |C| ≤ 2^((n+1)/2) + 1 for odd n, 2^((n+2)/2) + 1 for even n, which is reached.

    Welch 1974: M sequences have a correlation of at least L √((M − 1)/(ML − 1)) somewhere.
    """
    length = 2**order - 1
    members = range(0, length + 2, max(1, length // 12))
    codes = [gold_sequence(order, member) for member in members]
    worst = 0.0
    for i, one in enumerate(codes):
        for j, other in enumerate(codes):
            correlation = np.abs(periodic(one, other))
            worst = max(worst, correlation[1:].max(), correlation[0] if i != j else 0.0)
    half = (order + 1) // 2 if order % 2 else (order + 2) // 2
    compare(
        page=PAGE,
        case=f"Gold sequences of {length} chips",
        quantity="largest correlation of two codes or of one away from its peak, chips",
        expected=2**half + 1,
        measured=worst,
        tolerance=0.0,
        source="Gold 1967",
    )
    count = len(codes)
    assert worst >= length * np.sqrt((count - 1) / (count * length - 1))


@pytest.mark.parametrize("prime", [3, 7, 127, 251])
def test_almost_perfect_sequences_have_one_side_lobe(prime, compare):
    """Wolfmann 1992: C is L at 0, 4 − L at L/2, and 0 elsewhere."""
    code = almost_perfect_sequence(prime)
    correlation = periodic(code, code)
    assert correlation[0] == code.size
    assert np.count_nonzero(correlation) == 2
    compare(
        page=PAGE,
        case=f"almost perfect sequence of {code.size} chips, half a period away",
        quantity="periodic correlation away from the peak, chips",
        expected=4 - code.size,
        measured=correlation[code.size // 2],
        tolerance=0.0,
        source="Wolfmann 1992",
    )


def code_of(name):
    return Pmcw(code=name, order=7, chip_duration=5e-9, periods=3, idle=0.0)


@pytest.mark.parametrize(("name", "least"), [("m-sequence", 41.0), ("almost-perfect", 60.0)])
def test_side_lobes_behind_the_filter_are_those_of_the_code(name, least, compare):
    """A point exactly between samples; correlation over chips, so that no taper lowers side lobes.

    With one sample per chip, away from the two samples of the peak, they are 20 log L below it:
    42.1 dB for L = 127, of which the filter's ripple and the point's place leave 41 dB.
    """
    plan = schedule_of(code_of(name))
    # a whole number of samples, so that the chips' middles are sampled
    late = 10 * 5e-9
    frame = received((WIDE,), [plan], HandPath(transmitter=0, delay=late - 2.5e-9), transmitter=0)
    code = plan.code.value[0].real
    size = code.size
    into = round(float(frame.times.first[0] - plan.start_time[0]) * 200e6)
    samples = frame.samples[0, 0, :size]
    correlation = np.abs(np.fft.ifft(np.fft.fft(samples) * np.fft.fft(np.roll(code, -into)).conj()))
    peak = int(np.argmax(correlation))
    away = np.roll(correlation, -peak)[8 : size // 2 - 8]
    side_lobe = -to_db((away / correlation[peak]) ** 2).max()
    assert side_lobe > least
    if name == "m-sequence":
        compare(
            page=PAGE,
            case="m-sequence of 127 chips behind the IF filter, between two samples",
            quantity="peak over side lobes, dB",
            expected=20.0 * np.log10(size),
            measured=side_lobe,
            tolerance=1.1,
            source="20 log₁₀ L",
        )


def test_a_point_is_at_its_range_and_has_the_power_of_its_echo():
    """Range c τ/2 and power |a|², between cells; the cell is 0.75 m, the peak is interpolated."""
    plan = schedule_of(code_of("m-sequence"), num_sweeps=32)
    distance = 21.37
    path = HandPath(transmitter=0, delay=2.0 * distance / SPEED_OF_LIGHT)
    frame = received((WIDE,), [plan], path, transmitter=0)
    noise = np.random.default_rng(1).normal(size=(2, *frame.samples.shape))
    power = float(np.mean(np.abs(frame.samples) ** 2))
    noisy = frame.with_samples(frame.samples + 0.3 * np.sqrt(power) * (noise[0] + 1j * noise[1]))
    found = Decoding(greatest_range=50.0).detect(noisy)
    assert found.range[0] == pytest.approx(distance, abs=0.03)
    # the samples' power lacks what the filter takes of the chips' band
    assert abs(to_db(found.power[0] / power)) < 1.5


def range_spectrum(samples):
    """Power over beats of the only channel, without a taper, mean over ramps."""
    size = samples.shape[-1]
    return np.mean(np.abs(np.fft.fft(samples[0], n=4 * size, axis=-1) / size) ** 2, axis=0)


@pytest.mark.parametrize("num_chips", [32, 64])
def test_a_ghost_without_the_code_is_spread_over_its_chips(num_chips, compare):
    """Uysal 2020: a synchronous radar without the code makes a ghost 10 log L_c dB weaker.

    The ghost's power is spread over L_c cells: the mean over the code's band 1/T_c of its power
    density is that share of the peak. Samples of 27 of the 30 µs hold 0.9 L_c chips. The inverse of
    the dispersed code, which echoes pass with a gain of 1, has a gain for all other signals: that
    for white noise is added.
    """
    coded = PhaseCodedRamp(num_chips=num_chips, idle=10e-6)
    plain = Sawtooth(start_frequency=76.5e9, bandwidth=600e6, ramp_duration=30e-6, idle=10e-6)
    plan, other = (schedule_of(one, num_sweeps=64) for one in (coded, plain))
    path = HandPath(transmitter=1, delay=0.2e-6)
    frame = received((NARROW, NARROW), [plan, other], path, transmitter=1)
    decoded = decoded_chirps(frame.samples, plan, frame.times)
    before = range_spectrum(frame.samples)
    after = range_spectrum(decoded)
    peak = int(np.argmax(before))
    suppression = to_db(before[peak] / after[peak])
    noise = np.random.default_rng(2).normal(size=(*frame.samples.shape, 2)) @ [1.0, 1.0j]
    gain = to_db(np.mean(np.abs(decoded_chirps(noise, plan, frame.times)) ** 2) / 2.0)
    assert 0.0 < gain < 2.0
    compare(
        page=PAGE,
        case=f"PC-FMCW, {num_chips} chips in a chirp, decoder's gain for noise {gain:.1f} dB added",
        quantity="synchronous ghost over the density of its decoded signal, dB",
        expected=10.0 * np.log10(0.9 * num_chips),
        measured=suppression + gain,
        tolerance=0.5,
        source="10 log₁₀ of the sampled chips (Uysal 2020)",
    )


def test_an_echo_keeps_its_amplitude_and_phase_behind_its_own_code(compare):
    """Decoded samples are those of an uncoded chirp, with the same phase.

    The mean over the ramps makes up for what the inverse takes where chips meet. The filter smears
    these borders, and eight drawn codes differ: 3 %.
    """
    plan = schedule_of(PhaseCodedRamp(), num_sweeps=8)
    plain = schedule_of(
        Sawtooth(start_frequency=76.5e9, bandwidth=600e6, ramp_duration=30e-6, idle=5e-6),
        num_sweeps=8,
    )
    path = HandPath(transmitter=0, delay=0.17e-6)
    coded = received((NARROW,), [plan], path, transmitter=0)
    expected = received((NARROW,), [plain], path, transmitter=0)
    decoded = decoded_chirps(coded.samples, plan, coded.times)
    one, other = (x[0] * np.hanning(x.shape[-1]) for x in (decoded, expected.samples))
    ratio = np.vdot(other, one) / np.vdot(other, other)
    compare(
        page=PAGE,
        case="PC-FMCW, 64 chips, eight chirps",
        quantity="amplitude of a decoded echo over that without a code",
        expected=1.0,
        measured=abs(ratio),
        tolerance=0.03,
        source="no loss",
    )
    assert np.angle(ratio) == pytest.approx(0.0, abs=0.03)


def test_an_echo_has_no_lines_at_the_chip_rate(compare):
    """What the limit of the code's inverse takes where chips meet is made up for in the mean.

    Of 128 drawn codes, the rest is spread over all cells. Without it, lines of -21 dB stand beside
    every echo, at the range whose beat is the chip rate.
    """
    plan = PhaseCodedRamp(num_chips=64).schedule(num_sweeps=128, streams=Streams(seed=4))
    chip_range = 0.5 * SPEED_OF_LIGHT / float(plan.code.chip_duration[0] * plan.slope[0])
    echo = HandPath(delay=2.0 * 0.3 * chip_range / SPEED_OF_LIGHT, gain=1.0 + 0j)
    frame = received([NARROW], [plan], echo, transmitter=0)
    read = Decoding(greatest_range=2.0 * chip_range).reading(frame)
    power = read.receiver.spectra(read.frame).mean_power
    profile = to_db(power.power.max(axis=0) / power.power.max())
    near = np.abs(power.range - 1.3 * chip_range) < 0.1 * chip_range
    compare(
        page=PAGE,
        case="64 chips, 128 chirps",
        quantity="line of a decoded echo at the chip rate, dB",
        expected=-45.0,
        measured=profile[near].max(),
        tolerance=10.0,
        source="below −35 dB; −21 dB if what the inverse takes were not made up for",
    )


@pytest.mark.parametrize("bandwidth", [50e6, 150e6])
def test_the_floor_of_noise_radar_is_its_time_bandwidth_product_below_the_peak(bandwidth, compare):
    """The mean side lobe of a correlation of noise of the band B over T is 1/BT of the peak.

    Chips of 5 ns, 1024 of them, of which one period is correlated.
    """
    waveform = Noise(
        bandwidth=bandwidth, chip_duration=5e-9, num_chips=1024, periods=2, idle=0.0,
        peak_to_average=from_db(12.0),
    )  # fmt: skip
    plan = schedule_of(waveform, num_sweeps=64)
    frame = received((WIDE,), [plan], HandPath(transmitter=0, delay=0.1e-6), transmitter=0)
    product = correlated(frame.samples, plan, frame.times)[0]
    profile = np.abs(np.fft.fft(product, axis=-1)) ** 2
    peak = profile.max(axis=1)
    cells = product.shape[-1]
    away = np.abs((np.arange(cells) - np.argmax(profile[0]) + cells // 2) % cells - cells // 2)
    floor = np.mean(profile[:, away > 60] / peak[:, None])
    compare(
        page=PAGE,
        case=f"noise of {bandwidth / 1e6:.0f} MHz over 5.12 µs",
        quantity="mean side lobe of the correlation, dB",
        expected=-10.0 * np.log10(bandwidth * 1024 * 5e-9),
        measured=to_db(floor),
        tolerance=0.6,
        source="−10 log₁₀ BT",
    )


def test_the_floor_that_a_chirp_leaves_in_a_correlation(compare):
    """Rao and Mani: a chirp in the band of a PMCW victim for T_int leaves P T_int/(T_f² B).

    The victim reads T_f = 1.27 µs of B = 200 MS/s. A chirp of 20 MHz/µs stays within its band all
    the time: T_int = T_f. A cell of the correlation then has P/(T_f B), 1/254 of the power. Chips
    have 0.6 dB more density in the middle of the band, where the chirp is, than with the taper.
    """
    plan = schedule_of(code_of("m-sequence"), num_sweeps=32)
    chirp = Sawtooth(start_frequency=78.98e9, bandwidth=40e6, ramp_duration=2e-6, idle=0.0)
    other = schedule_of(chirp, num_sweeps=40)
    path = HandPath(transmitter=1, delay=0.1e-6)
    frame = received((WIDE, NARROW), [plan, other], path, transmitter=1)
    size, periods = 127, frame.samples.shape[-1] // 127
    power = float(np.mean(np.abs(frame.samples[..., : size * periods]) ** 2))
    product = correlated(frame.samples, plan, frame.times)[0]
    cells = np.abs(np.fft.fft(product, axis=-1) / product.shape[-1]) ** 2
    compare(
        page=PAGE,
        case="chirp of 20 MHz/µs in an m-sequence of 127 chips",
        quantity="power in a cell of the correlation, dB over that received",
        expected=-10.0 * np.log10(size * periods),
        measured=to_db(np.mean(cells) / power),
        tolerance=1.5,
        source="T_int / T_f² B (Rao and Mani)",
    )


def noisy(waveform, *, num_sweeps, path, snr_db, radar=WIDE):
    """A frame of a point and white noise, with this SNR of one sample in dB."""
    plan = schedule_of(waveform, num_sweeps=num_sweeps)
    frame = received((radar,), [plan], path, transmitter=0)
    power = np.mean(np.abs(frame.samples) ** 2) / from_db(snr_db)
    noise = np.random.default_rng(5).normal(
        scale=np.sqrt(0.5 * power), size=(2, *frame.samples.shape)
    )
    return frame.with_samples(frame.samples + noise[0] + 1j * noise[1])


@pytest.mark.parametrize("name", ["m-sequence", "gold", "noise"])
def test_side_lobes_of_a_code_are_no_detections(name):
    """A point 20 dB above the noise of a sample, in the frame 56 dB. Without their levels, a Gold
    sequence of 127 chips has tens of detections."""
    waveform = (
        Noise(bandwidth=150e6, chip_duration=5e-9, num_chips=254, periods=3, idle=0.0)
        if name == "noise"
        else code_of(name)
    )
    frame = noisy(waveform, num_sweeps=32, path=HandPath(transmitter=0, delay=83.4e-9), snr_db=20.0)
    found = Decoding(greatest_range=50.0).detect(frame)
    assert found.range == pytest.approx([0.5 * SPEED_OF_LIGHT * 83.4e-9], abs=0.1)
    attributed, _ = attribute(Decoding(greatest_range=50.0), frame)
    assert attributed.range.tolist() == found.range.tolist()


@pytest.mark.parametrize("passband", [92e6, 120e6, 180e6])
def test_side_lobes_of_the_if_filter_are_no_detections(passband):
    """Two samples of 2.5 ns per chip: the filter cuts the band of the chips, and so it rings.

    A receiver that does not know a filter of 92 to 120 MHz detects its side lobes.
    """
    edges = IfFilter(passband=passband, stopband=1.3 * passband, attenuation=from_db(60.0))
    converter = Converter(sample_rate=400e6, start=0.4e-6, margin=0.0)
    radar = replace(WIDE, if_filter=edges, converter=converter)
    receiver = Decoding(greatest_range=50.0)
    for delay in np.random.default_rng(4).uniform(40e-9, 250e-9, 6):
        path = HandPath(transmitter=0, delay=delay)
        frame = noisy(code_of("m-sequence"), num_sweeps=32, path=path, snr_db=20.0, radar=radar)
        found = receiver.detect(frame)
        assert found.range == pytest.approx([0.5 * SPEED_OF_LIGHT * delay], abs=0.05)
        if passband == 92e6:
            assert receiver.detect(replace(frame, if_filter=None)).num_detections > 1


@pytest.mark.parametrize("name", ["m-sequence", "noise", "chips in chirps"])
def test_detections_are_the_same_with_and_without_their_causes(name):
    """A run attributes detections to parts of the signal; powers make up for motion there, too."""
    of_name = {
        "noise": Noise(bandwidth=150e6, chip_duration=5e-9, num_chips=254, periods=3, idle=0.0),
        "m-sequence": replace(code_of("m-sequence"), periods=41, idle=1e-6),
        "chips in chirps": PhaseCodedRamp(num_chips=32),
    }
    path = HandPath(transmitter=0, delay=1e-7, delay_rate=40.0 / SPEED_OF_LIGHT)
    radar = NARROW if name == "chips in chirps" else WIDE
    frame = noisy(of_name[name], num_sweeps=64, path=path, snr_db=20.0, radar=radar)
    receiver = Decoding(greatest_range=50.0)
    alone, (attributed, powers_of) = receiver.detect(frame), attribute(receiver, frame)
    assert attributed.range.tolist() == alone.range.tolist()
    assert attributed.power.tolist() == alone.power.tolist()
    assert powers_of(frame.samples[None]).shape == (alone.num_detections, 1)


def test_the_power_of_a_moving_point_is_that_of_a_sample():
    """40 periods of 0.635 µs at 20 m/s turn by 0.27 cycles, of which the mean has sinc² = 0.78."""
    waveform = replace(code_of("m-sequence"), periods=41, idle=1e-6)
    powers = {}
    for speed in (0.0, 20.0):
        path = HandPath(transmitter=0, delay=1e-7, delay_rate=2 * speed / SPEED_OF_LIGHT)
        frame = noisy(waveform, num_sweeps=64, path=path, snr_db=20.0)
        found = Decoding(greatest_range=50.0).detect(frame)
        assert found.range_rate[0] == pytest.approx(speed, abs=0.2)
        powers[speed] = found.power[0]
    assert powers[20.0] == pytest.approx(powers[0.0], rel=0.03)


@pytest.mark.parametrize("ratio_db", [1.0, 2.0, 3.0, 8.0])
def test_noise_has_the_ratio_of_peak_to_average_that_is_asked_for(ratio_db):
    chips = schedule_of(Noise(peak_to_average=from_db(ratio_db)), num_sweeps=32).code.value
    power = np.abs(chips) ** 2
    assert power.max() == pytest.approx(1.0)
    assert to_db(power.max() / power.mean()) == pytest.approx(ratio_db, abs=0.05)


def test_noise_that_no_limit_reaches_uses_the_whole_amplitude():
    """The greatest of 32 times 512 chips, some 300 of which are independent: ln 9600, 9.6 dB."""
    chips = schedule_of(Noise(peak_to_average=from_db(12.0)), num_sweeps=32).code.value
    power = np.abs(chips) ** 2
    assert power.max() == pytest.approx(1.0)
    assert to_db(power.max() / power.mean()) == pytest.approx(9.6, abs=0.8)
