"""A small complex network, trained on drawn frames, finds cells with bursts, which are filled."""

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Final, Literal

import numpy as np

from polychirp.axes import BoolArray, ComplexArray
from polychirp.errors import CapabilityError, InputError
from polychirp.model.if_frame import IfFrame, SampleTimes
from polychirp.model.ramp import RampSchedule
from polychirp.receiver.mitigation.base import Mitigated, refuse_frame
from polychirp.receiver.mitigation.network_layers import Network, logits
from polychirp.receiver.mitigation.sparse_filling import (
    Missing,
    batches_of_one_length,
    filled_from_lines,
)
from polychirp.receiver.mitigation.stft_excision import hann_transform, nearest_slices, whole_slices
from polychirp.spec import Spec
from polychirp.units import from_db

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

ITERATIONS: Final = 20
"""Number of thresholds in the filling of masked cells; chosen, as is `DEPTH`. With 10 echoes come
out weaker, and 60 change little."""

DEPTH: Final = from_db(40.0)
"""Power ratio of the first of these thresholds to the last."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ComplexNetwork(Spec):
    r"""Fill the time-frequency cells of each ramp in which a trained complex network sees bursts.

    The network (`network_layers`) has three complex layers of 3×3 cells, as those of Rock, Toth,
    Messner, Meissner and Pernkopf 2019, with complex weights as those of Fuchs, Rock, Toth,
    Meissner and Pernkopf 2021. Theirs make a new range-Doppler map of several equal ramps. This one
    reads the short-time spectra of one ramp and estimates of each cell the share

    .. math:: m = \frac{\sigma^2 + \epsilon|E|^2}{\sigma^2 + \epsilon|E|^2 + |I|^2}

    with the parts E of echoes and I of interference, the noise's power σ² and ε = −30 dB: m is 1
    where interference does no harm, and 0 where it is above the noise and within 30 dB of the
    echoes, which hide it. Cells with m below ``kept_above`` are masked, in ramps in which
    `LEAST_CELLS` or more are below `SURE`; other ramps are not changed. Slices that reach beyond
    the ramp are treated like the nearest whole one. What the masked cells held is filled from the
    few lines of the ramp's spectrum, by iterations with falling thresholds (`sparse_lines`). The
    method is linear in the samples once cells and lines are chosen. The network sees moduli as
    :math:`\log(1 + |S| / \tilde S)` with the ramp's median :math:`\tilde S`, so that units do
    not matter. Channels share the mean of their logits, and thus the mask, and the lines. The masks
    of real samples are the same at f and −f.

    It was trained on frames of the families of the benchmark's set v2, but not on the frames of
    that set (`trained`). It cannot tell whether a ramp is unlike those. Where half of a ramp's
    cells are masked, such as by a nearly parallel interferer, echoes come out too weak;
    docs/validation/mitigation.md shows this harm. It takes some 11 000 real multiplications per
    cell, and a channel has 4 cells per sample. `StftExcision` chooses cells by a threshold instead.

    Parameters
    ----------
    kept_above : share m above which a cell is kept unchanged; nearer to 1, the floor is lower, and
        more of the echoes must be filled
    """

    kind: Literal["complex-network"] = "complex-network"
    kept_above: float = 0.9

    def __post_init__(self) -> None:
        if not 0.0 < self.kept_above < 1.0:
            raise InputError("a network keeps cells above a share between 0 and 1")

    def refuse(
        self, schedule: RampSchedule, *, times: SampleTimes, is_real: bool, num_channels: int
    ) -> None:
        """Refuse ramps that it cannot repair.

        Raises
        ------
        CapabilityError
            A ramp is shorter than the window.
        """
        del schedule, is_real, num_channels
        shortest = int(times.num_samples.min())
        if shortest < WINDOW:
            raise CapabilityError(
                f"the mitigation 'complex-network' is trained for windows of {WINDOW} samples, and "
                f"a ramp has {shortest}; 'blanking' works on any ramps"
            )

    def mitigate(self, frame: IfFrame) -> Mitigated:
        """The frame's samples with what the masked cells held filled."""
        refuse_frame(self, frame)
        lost = [
            self.lost(frame.samples[:, k, : int(length)])
            for k, length in enumerate(frame.times.num_samples)
        ]
        is_masked = np.array([cells.any() for cells in lost])
        missing = (
            (ramps, _cells_of(np.stack([lost[k] for k in ramps])))
            for ramps in batches_of_one_length(frame, is_masked)
        )
        return filled_from_lines(frame, missing, iterations=ITERATIONS, depth=DEPTH)

    def hit(self, frame: IfFrame) -> BoolArray:
        """Mask of the samples nearest to a slice with a masked cell, ``(ramp, fast)``."""
        mask = np.zeros(frame.times.is_sample.shape, dtype=np.bool_)
        for k, length in enumerate(map(int, frame.times.num_samples)):
            slices = np.asarray(self.lost(frame.samples[:, k, :length]).any(axis=0))
            mask[k, :length] = slices[nearest_slices(WINDOW, length, HOPS)]
        return mask

    def lost(self, samples: ComplexArray) -> BoolArray:
        """Mask of the cells ``(frequency, slice)`` of a ramp that are filled.

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
        ends = ((0, 0), (first, logit.shape[1] - last))
        return np.pad(lost, ends, mode="edge")


def _cells_of(lost: BoolArray) -> Missing:
    """Map of samples ``(…, ramp, fast)`` to what cells ``(ramp, frequency, slice)`` hold."""
    transform = hann_transform(WINDOW, HOPS)

    def part(samples: ComplexArray) -> ComplexArray:
        return np.asarray(transform.istft(lost * transform.stft(samples), k1=samples.shape[-1]))

    return part


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
