"""A small complex network, trained on drawn frames, that masks cells of ramps in time-frequency."""

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Final, Literal

import numpy as np

from polychirp.axes import BoolArray, ComplexArray
from polychirp.errors import CapabilityError, InputError
from polychirp.model.if_frame import IfFrame
from polychirp.receiver.mitigation.base import Mitigated
from polychirp.receiver.mitigation.network_layers import Network, logits
from polychirp.receiver.mitigation.stft_excision import hann_transform, nearest_slices, whole_slices
from polychirp.spec import Spec

WINDOW: Final = 32
"""Length of the Hann window, samples. Chosen as the default of `StftExcision`; the network is
trained for it."""

HOPS: Final = 4
"""Length of the window over the hop from slice to slice; chosen: half the cells of 8."""

WEIGHTS: Final = "complex_network.npz"
"""File of the weights, beside this module; tools/experiments/train_network.py writes it."""


SURE: Final = 0.2
"""Share m below which a cell surely has a burst. Chosen on frames that are neither trained on nor
in the benchmark, as are `LEAST_CELLS` and the defaults of the settings."""

LEAST_CELLS: Final = 8
"""Number of such cells from which a ramp is masked at all; chosen. A burst of one sample is in all
32 cells of four slices."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ComplexNetwork(Spec):
    r"""Mask the time-frequency cells of each ramp that a trained complex network takes for bursts.

    The network (`network_layers`) has three complex layers of 3×3 cells, as those of Rock, Toth,
    Messner, Meissner and Pernkopf 2019, with complex weights as those of Fuchs, Rock, Toth,
    Meissner and Pernkopf 2021. Theirs make a new range-Doppler map of several equal ramps. This one
    reads the short-time spectra S of one ramp and estimates of each cell the share

    .. math:: m \approx |C|^2 / (|C|^2 + |I|^2)

    with the parts C and I of S without interference and of interference. It takes any ramps, also
    single and unequal ones. Cells with m below ``kept_above`` are set to zero, in ramps in which
    `LEAST_CELLS` or more are below `SURE`; other ramps are not changed. Rows that would lose more
    than ``longest_mask`` of their slices are kept, and slices that reach beyond the ramp are
    treated like the nearest whole one. The method is linear in the samples once the cells are
    chosen. The network sees moduli as :math:`\log(1 + |S| / \tilde S)` with the ramp's median
    :math:`\tilde S`, so that units do not matter. Channels share the mean of their logits, and thus
    the mask. The masks of real samples are the same at f and −f.

    It was trained on frames of the families of the benchmark's set v2, but not on the frames of
    that set (`trained`). It cannot tell whether a ramp is unlike those. Echoes lose what they have
    in masked cells, as nothing is filled; docs/validation/mitigation.md shows this harm. It takes
    some 5000 real multiplications per cell, and a channel has 4 cells per sample. `StftExcision`
    chooses cells by a threshold instead, and is the better choice.

    Parameters
    ----------
    kept_above : share m above which a cell is kept unchanged; at 0.9 the floor is lower, and
        echoes lose more
    longest_mask : share of a row's slices, 0 … 1, above which their masked cells are taken for an
        echo and are kept. 1 removes long bursts too, and on clean ramps also strong echoes that
        beat with each other
    """

    kind: Literal["complex-network"] = "complex-network"
    kept_above: float = 0.7
    longest_mask: float = 0.5

    def __post_init__(self) -> None:
        if not 0.0 < self.kept_above < 1.0:
            raise InputError("a network keeps cells above a share between 0 and 1")
        if not 0.0 <= self.longest_mask <= 1.0:
            raise InputError("the longest mask of a network is a share of a row, 0 … 1")

    def mitigate(self, frame: IfFrame) -> Mitigated:
        """The frame's samples with less in the cells that the network masks."""
        shortest = int(frame.times.num_samples.min())
        if shortest < WINDOW:
            raise CapabilityError(
                f"the mitigation 'complex-network' is trained for windows of {WINDOW} samples, and "
                f"a ramp has {shortest}; 'blanking' works on any ramps"
            )
        present = frame.times.is_sample
        transform = hann_transform(WINDOW, HOPS)
        masks: list[tuple[int, int, BoolArray]] = []
        for k, count in enumerate(frame.times.num_samples):
            length = int(count)
            lost = self.lost(frame.samples[:, k, :length])
            if lost.any():
                masks.append((k, length, lost))

        def repair(samples: ComplexArray) -> ComplexArray:
            out = samples * present
            for k, length, lost in masks:
                cells = transform.stft(samples[..., k, :length])
                out[..., k, :length] -= transform.istft(lost * cells, k1=length)
            return np.asarray(out)

        weight = present.astype(np.float64)
        return Mitigated(samples=repair(frame.samples), weight=weight, repair=repair)

    def hit(self, frame: IfFrame) -> BoolArray:
        """Mask of the samples nearest to a slice with a masked cell, ``(ramp, fast)``."""
        mask = np.zeros(frame.times.is_sample.shape, dtype=np.bool_)
        for k, length in enumerate(map(int, frame.times.num_samples)):
            slices = np.asarray(self.lost(frame.samples[:, k, :length]).any(axis=0))
            mask[k, :length] = slices[nearest_slices(WINDOW, length, HOPS)]
        return mask

    def lost(self, samples: ComplexArray) -> BoolArray:
        """Mask of the cells ``(frequency, slice)`` of a ramp that are set to zero.

        Parameters
        ----------
        samples : of one ramp, ``(channel, fast)``
        """
        logit = logits(trained()[0], compressed_planes(samples)).mean(axis=0)
        if not np.any(samples.imag):  # the mask of real samples is the same at f and −f
            logit = 0.5 * (logit + np.roll(logit[::-1], 1, axis=0))
        first, last = whole_slices(hann_transform(WINDOW, HOPS), samples.shape[-1])
        inner = logit[:, first:last]
        if np.count_nonzero(inner < _logit(SURE)) < LEAST_CELLS:
            return np.zeros(logit.shape, dtype=np.bool_)
        lost = inner < _logit(self.kept_above)
        lost[np.mean(lost, axis=1) > self.longest_mask] = False
        ends = ((0, 0), (first, logit.shape[1] - last))
        return np.pad(lost, ends, mode="edge")


def _logit(share: float) -> float:
    return math.log(share / (1.0 - share))


def compressed_planes(samples: ComplexArray) -> ComplexArray:
    """Short-time spectra of a ramp as the network reads them, ``(channel, frequency, slice)``.

    Moduli are compressed. Phases are those of an oscillation from the ramp's start on, so that a
    tone in the middle of a row has the same phase in all slices, and all rows look alike.

    Parameters
    ----------
    samples : of one ramp, ``(channel, fast)``

    Examples
    --------
    >>> tone = np.exp(2j * np.pi * 3 / 32 * np.arange(128))
    >>> inner = compressed_planes(tone[None])[0, 3, 3:-3]
    >>> bool(np.ptp(np.angle(inner)) < 1e-6)
    True
    """
    cells = hann_transform(WINDOW, HOPS).stft(samples)
    amplitude = np.abs(cells)
    level = max(float(np.median(amplitude)), 1e-9 * float(amplitude.max()), 1e-300)
    row = np.arange(WINDOW)[:, None]
    number = hann_transform(WINDOW, HOPS).p_min + np.arange(cells.shape[-1])
    turn = np.exp(-2j * np.pi * (row * number % HOPS) / HOPS)
    gain = np.log1p(amplitude / level) / np.maximum(amplitude, 1e-300)
    return np.asarray((cells * gain * turn).astype(np.complex64))


@lru_cache(maxsize=1)
def trained() -> tuple[Network, str]:
    """The network of polychirp, and what it was trained on."""
    from importlib.resources import files

    with files(__package__).joinpath(WEIGHTS).open("rb") as file, np.load(file) as stored:
        count = 3
        network = Network(
            tuple(stored[f"kernel_{n}"] for n in range(count)),
            tuple(stored[f"bias_{n}"] for n in range(count - 1)),
            stored["readout"],
            stored["offset"],
        )
        return network, str(stored["trained_on"])
