"""Power spectra of the ramps of a frame."""

import numpy as np

from polychirp.axes import ComplexArray, FloatArray
from polychirp.model.if_frame import SampleTimes


def spectrum_size(times: SampleTimes) -> int:
    """Length of the zero-padded transforms: at least two bins per resolution cell of every ramp."""
    return int(2 ** np.ceil(np.log2(2 * times.most_samples)))


def power_spectra(samples: ComplexArray, weight: FloatArray, size: int) -> FloatArray:
    """Windowed power spectrum of every ramp, ``(beam, ramp, frequency)``.

    ``samples`` are ``(beam, ramp, fast)``; ``weight`` is the window, ``(ramp, fast)``. White noise
    of power σ² per sample has the mean power σ² in every bin, for any window.
    """
    energy = np.sum(weight**2, axis=-1)
    scale = 1.0 / np.sqrt(np.maximum(energy, 1e-30))
    spectrum = np.fft.fft(samples * (weight * scale[:, None]), size, axis=-1)
    return np.asarray(spectrum.real**2 + spectrum.imag**2)
