"""Named and versioned sets of frames, on which methods of mitigation are compared.

A family is a kind of frame; its n-th frame is drawn from a stream of the set's name, the family's
name and n alone, so that a smaller selection has the same frames. A set is never changed: frames
that should differ get a new version.
"""

from collections.abc import Callable, Mapping
from functools import partial
from typing import Final

from polychirp.model.if_frame import IfFrame, IfParts
from polychirp.rng import Streams
from polychirp.study.mitigation.engine_frames import ROADS, road_frame
from polychirp.study.mitigation.published import (
    ARIM_CELLS,
    TOTH_FILTER,
    PublishedFrame,
    arim,
    toth,
    tu_delft,
)
from polychirp.study.mitigation.street_frames import STREETS, street_frame
from polychirp.units import from_db

Maker = Callable[[Streams], tuple[IfFrame, IfParts]]
"""Function that draws a frame and its parts."""


def arim_cell(streams: Streams) -> PublishedFrame:
    """A frame of a cell of ARIM's grid, which is drawn."""
    cell = int(streams["cell"].integers(len(ARIM_CELLS)))
    snr, sir, ratio = ARIM_CELLS[cell]
    return arim(streams, snr=from_db(snr), sir=from_db(sir), ratio=ratio)


PUBLISHED: Final[Mapping[str, Callable[[Streams], PublishedFrame]]] = {
    "tu-delft": tu_delft,
    "arim": arim_cell,
    "toth": partial(toth, num_ramps=64),
    "toth-filtered": partial(toth, num_ramps=64, filtering=TOTH_FILTER),
}
"""Families of the literature by name, whose targets are points."""

WHOLE_BAND: Final = frozenset({"arim"})
"""Families whose echoes have beats up to the sample rate; others up to half of it."""


def published_frame(streams: Streams, family: str) -> tuple[IfFrame, IfParts]:
    """A frame of one of the `PUBLISHED` families, and its parts."""
    return PUBLISHED[family](streams)[:2]


_V1: Final[Mapping[str, Maker]] = {
    **{name: partial(published_frame, family=name) for name in ("tu-delft", "arim", "toth")},
    **{name: partial(road_frame, kind=kind) for name, kind in ROADS.items()},
}

FRAME_SETS: Final[Mapping[str, Mapping[str, Maker]]] = {
    "v1": _V1,
    "v2": {
        **_V1,
        "toth-filtered": partial(published_frame, family="toth-filtered"),
        **{name: partial(street_frame, kind=kind) for name, kind in STREETS.items()},
    },
}
"""Families of every set, by name. "v2" adds Toth's filtered case and traced streets, and draws the
others anew."""

NEWEST: Final = "v2"
"""Set that is used if none is named."""


def set_frame(name: str, family: str, number: int) -> tuple[IfFrame, IfParts]:
    """Frame ``number`` of a family of a set, and its parts.

    >>> frame, parts = set_frame("v1", "tu-delft", 0)
    >>> frame.samples.shape, parts.names
    ((1, 1, 4160), ('echo', 'direct', 'noise'))
    """
    return FRAME_SETS[name][family](Streams(0).of("mitigation", name, family, number))
