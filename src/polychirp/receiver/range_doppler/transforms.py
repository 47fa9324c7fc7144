r"""Fourier transforms of equal ramps over range and range rate.

With :math:`y = s_{tx}\overline{s_{rx}}` and a target at :math:`R + vt`, the phase of the samples at
a time t' on a ramp of slope b that starts at frequency f is :math:`2\pi (f + b t')\,\tau` with
:math:`\tau = 2(R + vt)/c`. With :math:`f_m` the frequency in the middle of the sampling window, the
samples have the frequencies

.. math:: f_b = \frac{2bR}{c} + \frac{2 f_m v}{c} \quad\text{along a ramp,}\qquad
          f_d = \frac{2 f_m v}{c} \quad\text{from ramp to ramp,}

so a target that recedes is at a positive frequency from ramp to ramp. The range axis of the maps is
:math:`c f_b/2b`; from the range of a detection the second term is removed.

If the transmitting elements share the sweeps by a code of K sweeps (`signal_model.transmit_codes`),
every K-th ramp is transformed on its own, since only these were sent by the same elements. The span
of range rates is then K times smaller.

Spectra are in single precision: a transform's rounding errors are some 130 dB below its strongest
cell, further than the noise of any converter.
"""

import numpy as np
from scipy.fft import fft

from polychirp.axes import FloatArray
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.errors import CapabilityError
from polychirp.model.if_frame import IfFrame, SampleTimes
from polychirp.model.ramp import RampSchedule
from polychirp.model.spectra import RangeProfiles, RangeRateSpectra
from polychirp.receiver.signal_model.equal_ramps import phases_are_coded, unequal
from polychirp.receiver.signal_model.transmit_codes import CodeBlocks, code_blocks

TAPER_SHAPE = 7.0
"""Kaiser's β of both transforms (chosen): side lobes 51 dB down, noise bandwidth 1.58 cells."""

MOST_UNEVEN = 1e-4
"""Greatest deviation of the ramps' starts from equal intervals, as a share of the interval. Chosen:
a Doppler frequency of half a cycle per interval is then wrong by 2e-4 rad per ramp at most."""

FEWEST_RATES = 2
"""Fewest range rates of a map."""

FEWEST_CODED = 3
"""Fewest range rates of a map in whose other range rates the noise is estimated, as it is where
phases or chips are coded: with two, a cell has no such neighbours on both sides."""


def taper(size: int) -> FloatArray:
    """Kaiser's window with the sum 1, so that a tone's amplitude is that of its spectral peak."""
    window = np.kaiser(size, TAPER_SHAPE)
    return np.asarray(window / window.sum())


def unfit(schedule: RampSchedule) -> str:
    """Reason why these transforms cannot read ramps, as the end of a sentence; empty if they can.

    >>> from polychirp.rng import Streams
    >>> from polychirp.waveform import Triangular
    >>> unfit(Triangular().schedule(num_sweeps=4, streams=Streams(seed=1)))
    'its ramps differ in slope'
    """
    if reason := unequal(schedule):
        return reason
    start = schedule.start_time
    interval = float(start[-1] - start[0]) / (start.size - 1)
    uneven = float(np.max(np.abs(start - start[0] - interval * np.arange(start.size))))
    if uneven > MOST_UNEVEN * interval:
        return f"its ramps are up to {1e6 * uneven:.3g} µs from equal intervals"
    turns = schedule.num_ramps // _code_length(schedule)
    is_coded = schedule.code is not None or phases_are_coded(schedule)
    fewest = FEWEST_CODED if is_coded else FEWEST_RATES
    if turns < fewest:
        counted = "ramps" if schedule.num_elements == 1 else "turns of the elements' code"
        return f"the frame has {turns} {counted}, fewer than {fewest}"
    return ""


def _code_length(schedule: RampSchedule) -> int:
    """Number of sweeps of the code; 1 if it separates no elements, which is refused elsewhere."""
    try:
        return len(code_blocks(schedule).weight)
    except CapabilityError:
        return 1


def refuse(reason: str) -> None:
    """Refuse ramps that the receiver cannot read, unless the reason of `unfit` is empty.

    The message names the receiver that reads them.

    Raises
    ------
    CapabilityError
        There is a reason.
    """
    if reason:
        raise CapabilityError(
            "the range-Doppler receiver needs equal ramps at equal intervals, and of this schedule "
            f"{reason}; the receiver 'coherent' reads it"
        )


def middle_frequency(schedule: RampSchedule, times: SampleTimes) -> float:
    """Frequency transmitted in the middle of every ramp's sampling window, Hz."""
    middle = times.first[0] + 0.5 * (times.most_samples - 1) / times.rate - schedule.start_time[0]
    return float(schedule.start_frequency[0] + schedule.slope[0] * middle)


def range_profiles(frame: IfFrame, *, greatest_range: float, spare: int = 0) -> RangeProfiles:
    """Tapered spectrum of every ramp, from range zero to the last cell within ``greatest_range``.

    ``spare`` cells beyond it are added. Phases refer to the middle of the sampling window. The last
    cell is at most that of the sample rate, beyond which ranges repeat.
    """
    size, rate = frame.times.most_samples, frame.times.rate
    slope = float(frame.schedule.slope[0])
    cell = float(SPEED_OF_LIGHT * rate / (2.0 * abs(slope) * size))
    num_ranges = min(size, int(greatest_range / cell * (1 + 1e-12)) + 1 + spare)
    bins = np.arange(num_ranges) * (1 if slope > 0 else -1)
    tapered = np.empty(frame.samples.shape, dtype=np.complex64)
    np.multiply(frame.samples, taper(size), out=tapered, casting="same_kind")
    # a slice of rising ramps' spectra saves the copy that numbers of bins need
    spectrum = fft(tapered, axis=2, overwrite_x=True)[:, :, : num_ranges if slope > 0 else None]
    to_middle = np.exp(1j * np.pi * bins * (size - 1) / size).astype(np.complex64)
    near = spectrum if slope > 0 else spectrum[:, :, bins]
    return RangeProfiles(amplitude=near * to_middle, range=cell * np.arange(float(num_ranges)))


def range_rate_spectra(
    profiles: RangeProfiles, frame: IfFrame, blocks: CodeBlocks
) -> RangeRateSpectra:
    """Tapered transforms over the blocks of a code, one for every channel and sweep of the block.

    The channel axis runs over the sweeps of the block for each channel. Phases refer to the middle
    of each series of ramps, so that a target's phases differ from sweep to sweep of the block.
    """
    channels, _, ranges = profiles.amplitude.shape
    count, length, _ = blocks.ramps.shape
    # blocks hold all ramps in order, so that no ramp is copied here
    every = profiles.amplitude.reshape(channels, *blocks.ramps.shape, ranges)
    turns = np.moveaxis(every[:, :, :, 0], 2, 1)  # (channel, sweep of the block, block, range)
    # with this turn, the transform gives its frequencies in growing order
    turn = np.exp(2j * np.pi * (count // 2) * np.arange(count) / count)
    tapered = turns * (taper(count) * turn).astype(np.complex64)[:, None]
    spectrum = fft(tapered, axis=2, overwrite_x=True)
    cycles = (np.arange(count) - count // 2) / count  # from block to block
    spectrum *= np.exp(1j * np.pi * cycles * (count - 1)).astype(np.complex64)[:, None]
    wavelength = SPEED_OF_LIGHT / middle_frequency(frame.schedule, frame.times)
    return RangeRateSpectra(
        amplitude=spectrum.reshape(-1, count, ranges),
        range_rate=0.5 * wavelength * cycles / (length * repetition_interval(frame.schedule)),
        range=profiles.range,
    )


def repetition_interval(schedule: RampSchedule) -> float:
    """Time from ramp to ramp, s, of ramps at equal intervals."""
    start = schedule.start_time
    return float(start[-1] - start[0]) / (start.size - 1)
