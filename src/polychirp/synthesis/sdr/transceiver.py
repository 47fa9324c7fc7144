r"""Signal chain from the samples that one radio plays to those that another records.

Between the converters the signal is sampled on a grid that is several times finer, so that its band
contains both carriers; in the receiver it is centred on the receiver's carrier. Delays inside the
radios are removed: a link without delay gives no lag.
"""

import math
from dataclasses import replace
from typing import Final

import numpy as np

from polychirp.axes import ComplexArray, FloatArray
from polychirp.constants import BOLTZMANN, REFERENCE_TEMPERATURE
from polychirp.errors import InputError
from polychirp.model.baseband import Baseband
from polychirp.model.front_end import Digitiser
from polychirp.model.oscillator import PhaseNoise
from polychirp.model.transceiver import Link, Transceiver
from polychirp.rng import Streams
from polychirp.synthesis.impairments.adc import digitised
from polychirp.synthesis.impairments.phase_error import noise_waves

MARGIN_SAMPLES: Final = 128
"""Number of zeros before and after the signal, in which the filters' responses decay; chosen."""

MOST_GRID_POINTS: Final = 1 << 26
"""Greatest number of points of the grid between the converters; chosen: each copy takes 1 GiB."""


def transceived(
    signal: Baseband,
    *,
    transmitter: Transceiver,
    receiver: Transceiver,
    link: Link,
    receive_frequency: float,
    streams: Streams,
) -> Baseband:
    """Record of ``receiver``, tuned to ``receive_frequency`` Hz, while ``signal`` is played.

    Both radios start together; the record is as long as the arriving signal and its margins. Its
    samples are V across 1 Ω at the receiver's input, so that their power there is in W.

    Parameters
    ----------
    signal : samples of magnitude 1 at most, at the transmitter's sample rate, about its carrier
    streams : noise and phase noises come from ``streams["receiver", "noise"]``,
        ``streams.of("transmitter")`` and ``streams.of("receiver")``

    Raises
    ------
    InputError
        The signal has another sample rate, a sample above magnitude 1, or too many samples.
    PhysicsError
        A radio cannot tune to its carrier.
    """
    _check(signal, transmitter, receiver, receive_frequency)
    factor = _factor(signal, receiver, receive_frequency)
    rate = factor * transmitter.sample_rate
    field, begin = _sent(signal, transmitter, factor, streams)
    time = begin + np.arange(field.size) / rate
    field *= math.sqrt(1.0 / link.attenuation)
    # ``time`` is that at the transmitter; the wave arrives later by the delay
    shift = signal.centre_frequency * (1.0 + transmitter.clock_offset)
    shift -= receive_frequency * (1.0 + receiver.clock_offset)
    field *= np.exp(2j * np.pi * ((shift * time) % 1.0))
    turns = -receive_frequency * (1.0 + receiver.clock_offset) * link.delay
    field *= np.exp(2j * np.pi * (turns % 1.0))
    field = _received(field, rate, receiver, streams)
    return _recorded(
        Baseband(samples=field, sample_rate=rate, start_time=begin + link.delay),
        receiver,
        receive_frequency,
    )


def arriving_power(signal: Baseband, *, transmitter: Transceiver, receiver: Transceiver) -> float:
    """Mean power at the receiver's converter, W, over the signal's duration, without attenuation.

    The receiver has no noise and is tuned to the signal; losses by hold and filters are included.
    """
    noiseless = replace(receiver, noise_figure=None, converter=None, phase_noise=None)
    arriving = transceived(
        signal,
        transmitter=replace(transmitter, phase_noise=None),
        receiver=noiseless,
        link=Link(attenuation=1.0),
        receive_frequency=signal.centre_frequency,
        streams=Streams(0),
    )
    return arriving.energy / signal.duration


def link_for(
    snr: float,
    signal: Baseband,
    *,
    transmitter: Transceiver,
    receiver: Transceiver,
    delay: float = 0.0,
) -> Link:
    """The link over which ``signal`` has the power ratio ``snr`` to the noise at the converter.

    `InputError` is raised if the receiver has no noise.
    """
    if receiver.noise_power == 0.0:
        raise InputError("a receiver without noise has no SNR; give it a noise figure")
    power = arriving_power(signal, transmitter=transmitter, receiver=receiver)
    return Link(attenuation=power / (snr * receiver.noise_power), delay=delay)


def _check(
    signal: Baseband, transmitter: Transceiver, receiver: Transceiver, receive_frequency: float
) -> None:
    transmitter.check_carrier(signal.centre_frequency)
    receiver.check_carrier(receive_frequency)
    if not math.isclose(signal.sample_rate, transmitter.sample_rate, rel_tol=1e-9):
        raise InputError(
            f"the signal is sampled at {signal.sample_rate / 1e6:g} MS/s, but the transmitter "
            f"plays {transmitter.sample_rate / 1e6:g} MS/s; resample the signal"
        )
    # a resampled chirp may overshoot at its ends
    if float(np.abs(signal.samples).max()) > 1.0 + 1e-9:
        raise InputError("a sample to be played is above magnitude 1; scale the signal down")


def _factor(signal: Baseband, receiver: Transceiver, receive_frequency: float) -> int:
    """Grid points per sample, enough for both bands and the first images of held samples."""
    rate = signal.sample_rate
    reach = abs(signal.centre_frequency - receive_frequency) + 1.5 * max(rate, receiver.sample_rate)
    factor = 1 << max(2, math.ceil(math.log2(2.0 * reach / rate)))
    points = factor * (signal.num_samples + 2 * MARGIN_SAMPLES)
    if points > MOST_GRID_POINTS:
        raise InputError(
            f"{signal.num_samples} samples need a grid of {points:.2g} points between the "
            f"converters, more than {MOST_GRID_POINTS:.2g}; play a shorter signal or bring the "
            "carriers together"
        )
    return factor


def _sent(
    signal: Baseband, radio: Transceiver, factor: int, streams: Streams
) -> tuple[ComplexArray, float]:
    """Transmitted signal about its own carrier, √W, and the time of its first point, s."""
    samples = signal.samples
    if radio.transmit_bits is not None:
        samples = _digitised(Digitiser(full_scale=1.0, bits=radio.transmit_bits), samples)
    padded = np.pad(samples, MARGIN_SAMPLES)
    field = _reconstructed(padded, radio, factor)
    if radio.filter is not None:
        field = _filtered(field, radio, factor * radio.sample_rate)
    field *= math.sqrt(radio.transmit_power)
    if radio.imbalance is not None:
        field = radio.imbalance.applied(field)
    if radio.phase_noise is not None:
        rate = factor * radio.sample_rate
        field *= np.exp(1j * _phase(radio.phase_noise, field.size, rate, streams.of("transmitter")))
    fast = 1.0 + radio.clock_offset
    begin = (signal.start_time - MARGIN_SAMPLES / radio.sample_rate) / fast
    if radio.clock_offset != 0.0:
        # the signal is played in 1/(1 + δ) of its nominal duration; the grid is in true time
        wave = Baseband(
            samples=field, sample_rate=factor * radio.sample_rate * fast, start_time=begin
        )
        points = math.ceil(field.size / fast)
        field = wave.at(begin + np.arange(points) / (factor * radio.sample_rate))
    return field, begin


def _reconstructed(samples: ComplexArray, radio: Transceiver, factor: int) -> ComplexArray:
    """Signal on the fine grid, from held samples or by an ideal filter at half the sample rate."""
    from scipy.fft import fft, fftfreq, ifft

    size = samples.size
    frequency = fftfreq(factor * size, 1.0 / factor)  # in units of the sample rate
    spectrum = np.tile(fft(samples), factor)
    if radio.hold is not None:
        spectrum *= np.sinc(radio.hold * frequency)
    if radio.hold is None or radio.filter is None:
        spectrum[np.abs(frequency) >= 0.5] = 0.0
    return np.asarray(ifft(spectrum, overwrite_x=True) * factor)


def _received(
    field: ComplexArray, rate: float, radio: Transceiver, streams: Streams
) -> ComplexArray:
    """Signal at the receiver's converter, V, about the receiver's carrier."""
    if radio.noise_figure is not None:
        density = BOLTZMANN * REFERENCE_TEMPERATURE * radio.noise_figure
        draws = streams["receiver", "noise"].standard_normal((field.size, 2))
        field = field + draws.view(np.complex128)[:, 0] * math.sqrt(0.5 * density * rate)
    if radio.phase_noise is not None:
        field *= np.exp(-1j * _phase(radio.phase_noise, field.size, rate, streams.of("receiver")))
    if radio.imbalance is not None:
        field = radio.imbalance.applied(field)
    return _filtered(field, radio, rate)


def _recorded(field: Baseband, radio: Transceiver, receive_frequency: float) -> Baseband:
    """Samples of the converter at its clock's times, with nominal rate, start and carrier."""
    fast = 1.0 + radio.clock_offset
    rate = radio.sample_rate
    first = math.ceil(field.start_time * rate * fast - 1e-6)
    count = int((field.start_time + field.duration) * rate * fast) - first
    shown = (first + np.arange(count)) / rate
    samples = _at(field, shown / fast)
    if radio.converter is not None:
        samples = _digitised(radio.converter, samples)
    return Baseband(
        samples=samples,
        sample_rate=rate,
        centre_frequency=receive_frequency,
        start_time=first / rate,
    )


def _at(field: Baseband, time: FloatArray) -> ComplexArray:
    """The signal at times, s: the grid's points if all times are on the grid, else interpolated."""
    place = (time - field.start_time) * field.sample_rate
    near = np.rint(place)
    if np.all(np.abs(place - near) < 1e-6):
        return field.samples[near.astype(np.int64)]
    return field.at(time)


def _filtered(field: ComplexArray, radio: Transceiver, rate: float) -> ComplexArray:
    """The signal after the radio's filter, or after an ideal one at half the sample rate."""
    from scipy.signal import oaconvolve

    if radio.filter is None:
        return _limited(field, rate, 0.5 * radio.sample_rate)
    half = int(0.5 * radio.filter.support * rate)
    taps = radio.filter.impulse_response(np.arange(-half, half + 1) / rate) / rate
    return np.asarray(oaconvolve(field, taps, mode="same"))


def _limited(field: ComplexArray, rate: float, edge: float) -> ComplexArray:
    from scipy.fft import fft, fftfreq, ifft

    spectrum = fft(field)
    spectrum[np.abs(fftfreq(field.size, 1.0 / rate)) >= edge] = 0.0
    return np.asarray(ifft(spectrum, overwrite_x=True))


def _phase(noise: PhaseNoise, size: int, rate: float, streams: Streams) -> FloatArray:
    """Phase noise on the grid, rad; its period is at least twice the record."""
    from scipy.fft import irfft, next_fast_len

    period = next_fast_len(2 * size, real=True)
    _, height = noise_waves(
        noise, spacing=rate / period, highest_offset=0.5 * rate, streams=streams
    )
    return np.asarray(irfft(height, period)[:size] * period)


def _digitised(digitiser: Digitiser, samples: ComplexArray) -> ComplexArray:
    return np.asarray(digitised(digitiser, samples[None, None, :]).samples[0, 0])
