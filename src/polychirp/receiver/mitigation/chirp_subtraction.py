"""Chirp subtraction: long bursts are chirps, which are fitted beside the echoes and subtracted."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Final, Literal, NamedTuple

import numpy as np

from polychirp.axes import BoolArray, ComplexArray, FloatArray
from polychirp.errors import InputError
from polychirp.model.if_frame import IfFrame
from polychirp.receiver.mitigation.base import Mitigated
from polychirp.spec import Spec
from polychirp.units import Between

CELLS_PER_STEP: Final = 4.0
"""Step of the rates that are tried, cells over a ramp. Chosen: a chirp halfway between two of them
loses 1.4 dB, and the search for the exact rate begins within its main lobe."""

REFINEMENTS: Final = 14
"""Halvings and steps of that search; chosen: the rate is then right to a thousandth of a cell."""

DEGREE: Final = 2
"""Degree of the polynomial that a chirp's amplitude follows over the ramp; chosen: the IF filter
changes it slowly, and more degrees take more of the echoes."""

LEAST_SINGULAR: Final = 1e-6
"""Share of the greatest singular value below which a combination of atoms is not fitted; chosen."""

FIRST_EXCESS: Final = 100.0
"""Ratio by which the first chirp of a ramp must exceed the threshold. Chosen: with 261 samples it
is then 10 dB above the noise of a sample. What is left of the strong echoes of bodies of many
facets, after their tones are subtracted, resembles weaker chirps, most of them of a sweep that is
no longer than a body."""

LEAST_PROGRESS: Final = 0.1
"""Least share of a chosen atom's energy by which the residue must fall; chosen. A pursuit that
chooses one atom again and again ends."""

SMOOTHED: Final = 16
"""Length of a ramp over that of the mean by which a chirp's envelope is found; chosen."""

ROWS_AT_ONCE: Final = 256
"""Number of rates whose spectra are in memory at once; chosen."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ChirpSubtraction(Spec):
    r"""Subtract chirps that last for much of a ramp, as those of nearly parallel interferers do.

    The beat with another radar's ramp is a chirp :math:`e^{j \pi r n^2 + 2 j \pi f n}` with the
    difference r of both slopes, and an echo is a tone, r = 0. Chirps and tones are chosen one after
    the other, the strongest first, and all amplitudes are fitted anew after each choice (matching
    pursuit, Pati, Rezaiifar and Krishnaprasad 1993); then the chirps are subtracted. Bechter and
    Waldschmidt 2015 reconstruct bursts as well, without tones beside them. A chirp is present where
    its frequency is within the band of the samples, and its amplitude is a polynomial of degree
    `DEGREE`. Real samples have each atom's conjugate too. Channels share the atoms. The pursuit
    ends when no chirp exceeds noise by the threshold of ``false_mitigation``, the first one by a
    hundred times that, or when the strongest chirp is part of a shorter burst: the effective length
    :math:`(\sum |e|^2)^2 / \sum |e|^4` of its envelope e is then below half of ``shortest``. A ramp
    on which it does not end is left as it is. The method is linear once the atoms are chosen.

    Chirps that sweep over fewer than ``least_sweep`` cells of a ramp's spectrum are not told from
    echoes of extended bodies, and stay: 32 cells are 12 m with 400 MHz, the length of a lorry. So
    do bursts shorter than ``shortest`` of the ramp, which `Burg` and `MatrixPencil` repair. Of an
    echo, what is alike to the chirps is subtracted with them: some 3 (DEGREE + 1) of N samples'
    worth at most. With N samples, each choice takes some 4 N² log₂ N real multiplications for the
    search, and 8 K² N for the fit of K atoms.

    Parameters
    ----------
    shortest : share of the ramp, 0 … 1, that the shortest burst to be subtracted lasts
    least_sweep : least sweep of a burst over a whole ramp, cells of the ramp's spectrum
    most : greatest number of choices on a ramp
    false_mitigation : share of the ramps of noise alone that are changed
    """

    kind: Literal["chirp-subtraction"] = "chirp-subtraction"
    shortest: float = 0.4
    least_sweep: Annotated[float, Between(greatest=65_536)] = 32.0
    most: Annotated[int, Between(greatest=256)] = 40
    false_mitigation: float = 1e-3

    def __post_init__(self) -> None:
        if not 0.0 < self.shortest <= 1.0:
            raise InputError("the shortest burst of a chirp subtraction is a share of a ramp")
        if not self.least_sweep > 1.0:
            raise InputError("the least sweep of a chirp subtraction must be above 1 cell")
        if self.most < 1:
            raise InputError("a chirp subtraction needs 1 choice or more")
        if not 0.0 < self.false_mitigation < 0.5:
            raise InputError("a mitigation's false_mitigation is a share between 0 and 0.5")

    def mitigate(self, frame: IfFrame) -> Mitigated:
        """The frame's samples without the chirps of long bursts."""
        present = frame.times.is_sample
        is_real = not np.any(frame.samples.imag)
        searches = {n: _Search.of(self, n) for n in set(map(int, frame.times.num_samples))}
        maps: list[tuple[int, int, ComplexArray, ComplexArray]] = []
        for k, length in enumerate(map(int, frame.times.num_samples)):
            line = frame.samples[:, k, :length]
            atoms, is_chirp = self._pursued(line, searches[length], is_real=is_real)
            if is_chirp.any():
                fit = np.asarray(np.linalg.pinv(atoms, rcond=LEAST_SINGULAR)[is_chirp])
                maps.append((k, length, atoms[:, is_chirp], fit))

        def repair(samples: ComplexArray) -> ComplexArray:
            out = samples * present
            for k, length, atoms, fit in maps:
                out[..., k, :length] -= samples[..., k, :length] @ fit.T @ atoms.T
            return np.asarray(out)

        weight = present.astype(np.float64)
        return Mitigated(samples=repair(frame.samples), weight=weight, repair=repair)

    def _pursued(
        self, line: ComplexArray, search: _Search, *, is_real: bool
    ) -> tuple[ComplexArray, BoolArray]:
        """Atoms ``(fast, atom)`` of a ramp ``(channel, fast)``, and which of them are of chirps.

        There is no chirp if the pursuit does not end, or makes no progress.
        """
        nothing = np.zeros((line.shape[1], 0), dtype=np.complex128), np.zeros(0, dtype=np.bool_)
        atoms, is_chirp = nothing
        residue = line
        for _ in range(self.most if search.rates.size else 0):
            strongest = _combined(residue)
            chirp, tone, level = search.peaks(strongest)
            excess = 1.0 if is_chirp.any() else FIRST_EXCESS
            if chirp.power <= excess * search.threshold * level:
                return atoms, is_chirp
            found = _refined(strongest, max(chirp, tone))
            if found.rate and _effective_length(strongest, found) < 0.5 * self.shortest:
                return atoms, is_chirp
            new = _atoms(found, line.shape[1], is_real=is_real)
            atoms = np.concatenate([atoms, new], axis=1)
            is_chirp = np.append(is_chirp, np.full(new.shape[1], found.rate != 0.0))
            before = _energy(residue)
            residue = line - line @ np.linalg.pinv(atoms, rcond=LEAST_SINGULAR).T @ atoms.T
            if before - _energy(residue) < LEAST_PROGRESS * found.power / line.shape[1]:
                break
        return nothing


class _Search(NamedTuple):
    """Tables for the search of ramps of one length.

    ``rates`` are tried, cycles per square sample; ``turns`` take them from samples,
    ``(rate, fast)``; noise alone exceeds ``threshold`` medians of a spectrum on few ramps.
    """

    rates: FloatArray
    turns: ComplexArray
    threshold: float

    @classmethod
    def of(cls, method: ChirpSubtraction, length: int) -> _Search:
        greatest = length / method.shortest
        cells = np.arange(method.least_sweep, greatest, CELLS_PER_STEP)
        rates = np.concatenate([-cells[::-1], cells]) / length**2
        turns = np.exp(-1j * np.pi * rates[:, None] * _places(length) ** 2).astype(np.complex64)
        # one look each, as the strongest combination of channels is searched
        number = max(rates.size, 1) * length
        return cls(rates, turns, math.log(number / method.false_mitigation) / math.log(2.0))

    def peaks(self, line: ComplexArray) -> tuple[_Atom, _Atom, float]:
        """The strongest chirp and tone of a ramp ``(fast,)``, and the least median of a spectrum.

        Echoes are narrow in the spectrum without a rate and bursts in that of their own rate: the
        least median of all is that of the noise, unless much else fills the spectra.
        """
        from scipy import fft

        size = fft.next_fast_len(line.size)
        tones = np.abs(fft.fft(line, size)) ** 2
        tone = _Atom(float(tones.max()), 0.0, float(tones.argmax() / size))
        chirp, level = _Atom(0.0, 0.0, 0.0), float(np.median(tones))
        scale = max(float(np.abs(line).max()), 1e-300)  # single precision has a narrow range
        few = (line / scale).astype(np.complex64)
        for start in range(0, self.rates.size, ROWS_AT_ONCE):
            turned = few * self.turns[start : start + ROWS_AT_ONCE]
            power = np.abs(fft.fft(turned, size, axis=1)) ** 2
            row, column = divmod(int(power.argmax()), size)
            greatest = scale**2 * float(power[row, column])
            chirp = max(chirp, _Atom(greatest, float(self.rates[start + row]), column / size))
            level = min(level, scale**2 * float(np.median(power, axis=1).min()))
        return chirp, tone, level


class _Atom(NamedTuple):
    """Power, rate in cycles per square sample and frequency in cycles per sample, of an atom."""

    power: float
    rate: float
    frequency: float


def _places(length: int) -> FloatArray:
    """Places of the samples from the middle of the ramp on."""
    return np.asarray(np.arange(length) - 0.5 * (length - 1), dtype=np.float64)


def _combined(line: ComplexArray) -> ComplexArray:
    """Combination of the channels ``(channel, fast)`` with the greatest power, ``(fast,)``."""
    _, vector = np.linalg.eigh(line @ line.conj().T)
    return np.asarray(vector[:, -1].conj() @ line)


def _effective_length(line: ComplexArray, atom: _Atom) -> float:
    """Share of the ramp ``(fast,)`` over which the atom's envelope has its power."""
    place = _places(line.size)
    turned = line * np.exp(-1j * np.pi * (atom.rate * place**2 + 2.0 * atom.frequency * place))
    few = np.ones(max(1, line.size // SMOOTHED))
    power = np.abs(np.convolve(turned, few, mode="valid")) ** 2
    return float(np.sum(power) ** 2 / max(float(np.sum(power**2)), 1e-300) / line.size)


def _energy(line: ComplexArray) -> float:
    return float(np.sum(line.real**2 + line.imag**2))


def _refined(line: ComplexArray, start: _Atom) -> _Atom:
    """The atom with the greatest power near ``start``, by steps that are halved."""
    place = _places(line.size)

    def power(rate: float, frequency: float) -> float:
        atom = np.exp(-1j * np.pi * (rate * place**2 + 2.0 * frequency * place))
        return float(abs(line @ atom) ** 2)

    best = _Atom(power(start.rate, start.frequency), start.rate, start.frequency)
    by_rate = 0.5 * CELLS_PER_STEP / line.size**2 if start.rate else 0.0
    by_frequency = 0.5 / line.size
    for _ in range(REFINEMENTS):
        steps = [(0.0, by_frequency), (0.0, -by_frequency)]
        steps += [(by_rate, 0.0), (-by_rate, 0.0)] if by_rate else []
        trials = ((best.rate + a, best.frequency + b) for a, b in steps)
        found = max(_Atom(power(*trial), *trial) for trial in trials)
        if found.power > best.power:
            best = found
        else:
            by_rate, by_frequency = 0.5 * by_rate, 0.5 * by_frequency
    return best


def _atoms(atom: _Atom, length: int, *, is_real: bool) -> ComplexArray:
    """A tone, or a chirp with amplitudes of several degrees; and conjugates, ``(fast, atom)``."""
    place = _places(length)
    own = np.exp(1j * np.pi * (atom.rate * place**2 + 2.0 * atom.frequency * place))[:, None]
    if atom.rate:
        middle = (atom.frequency + 0.5) % 1.0 - 0.5
        inside = np.abs(middle + atom.rate * place) < 0.5
        own = own * np.polynomial.legendre.legvander(2.0 * place / length, DEGREE) * inside[:, None]
    return np.concatenate([own, own.conj()], axis=1) if is_real else own
