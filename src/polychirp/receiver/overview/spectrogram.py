"""Power over time and beat: short transforms along every ramp."""

from typing import Final

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy.signal.windows import hann

from polychirp.model.if_frame import IfFrame
from polychirp.model.spectra import Spectrogram
from polychirp.receiver.mitigation.base import mitigated
from polychirp.receiver.settings import ReceiverSettings

STEPS_PER_WINDOW: Final = 4
"""Number of transforms per length of the window; chosen: a burst between two loses 0.2 dB."""

LEAST_WINDOW: Final = 8
"""Least number of samples in a window; chosen."""


def spectrogram(receiver: ReceiverSettings, frame: IfFrame, *, channel: int = 0) -> Spectrogram:
    """Power in windows along every ramp of one channel, W; a tone's maximum is its power.

    The receiver's mitigation comes first. The window is Hann's, twice as long as the square root of
    a ramp's number of samples, so that it resolves time and beat alike. All ramps have equally many
    windows, about the same shares of each ramp: those of shorter ramps overlap more, and the first
    and last of them are repeated, as a window does not reach beyond its ramp.
    """
    times = frame.times
    size = max(LEAST_WINDOW, 2 ** round(np.log2(2.0 * np.sqrt(times.most_samples))))
    size = min(size, int(times.num_samples.min()))
    count = 1 + STEPS_PER_WINDOW * (times.most_samples - size) // size
    window = hann(size, sym=False)
    samples = mitigated(receiver.mitigation, frame).samples[channel]
    start = np.arange(count) / max(1, count - 1) * (times.most_samples - size)
    share = (start + 0.5 * size) / times.most_samples
    room = times.num_samples[:, None] - size
    wanted = np.rint(share * times.num_samples[:, None] - 0.5 * size)
    first = np.clip(wanted, 0, room).astype(np.int64)
    pieces = sliding_window_view(samples, size, axis=1)[np.arange(len(samples))[:, None], first]
    spectrum = np.fft.fftshift(np.fft.fft(pieces * (window / window.sum())), axes=-1)
    return Spectrogram(
        power=np.abs(spectrum) ** 2,
        share=share,
        beat=np.fft.fftshift(np.fft.fftfreq(size, 1.0 / times.rate)),
    )
