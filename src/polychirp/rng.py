"""Random streams with names: an additional draw does not change the others."""

from dataclasses import dataclass, replace
from hashlib import blake2b
from typing import Self

import numpy as np

from polychirp.errors import InputError


def _number(name: str | int) -> int:
    return int.from_bytes(blake2b(repr(name).encode(), digest_size=8).digest(), "little")


@dataclass(frozen=True, slots=True)
class Streams:
    """Random streams of one trial, by name.

    Two studies that differ only in their waveform have the same traffic and noise, because each of
    these uses a stream of its own, chosen by name.

    >>> streams = Streams(seed=1)
    >>> first = streams["noise", "vehicle-1"].random()
    >>> first == streams["noise", "vehicle-1"].random()
    True
    >>> first == streams.of("noise")["vehicle-1"].random()
    True
    """

    seed: int
    path: tuple[str | int, ...] = ()

    def of(self, *names: str | int) -> Self:
        """Streams whose names begin with ``names``."""
        return replace(self, path=(*self.path, *names))

    def __getitem__(self, names: str | int | tuple[str | int, ...]) -> np.random.Generator:
        """New generator for ``names``; equal names give equal numbers."""
        if self.seed < 0:
            raise InputError(f"seed: is {self.seed}; use 0 or more")
        tail = names if isinstance(names, tuple) else (names,)
        entropy = [self.seed, *(_number(name) for name in (*self.path, *tail))]
        return np.random.Generator(np.random.Philox(np.random.SeedSequence(entropy)))
