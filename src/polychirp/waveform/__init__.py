"""Waveforms: what a radar transmits. A study file chooses a family by its ``kind``.

`base` has the interface, `sawtooth`, `subframes` and `triangular` the families, `coding` the codes
of several transmitting elements, `design` equations for sweep time and bandwidth, `playing` a
radio's samples.
"""

from typing import Annotated

from polychirp.spec import ByKind
from polychirp.waveform.base import Waveform as Waveform
from polychirp.waveform.coding import AnyCoding as AnyCoding
from polychirp.waveform.coding import Coding as Coding
from polychirp.waveform.coding import DopplerDivision as DopplerDivision
from polychirp.waveform.coding import PhaseCoded as PhaseCoded
from polychirp.waveform.coding import TimeDivision as TimeDivision
from polychirp.waveform.coding import coded as coded
from polychirp.waveform.sawtooth import Sawtooth as Sawtooth
from polychirp.waveform.subframes import Subframes as Subframes
from polychirp.waveform.triangular import DiverseTriangular as DiverseTriangular
from polychirp.waveform.triangular import FixedTriangular as FixedTriangular
from polychirp.waveform.triangular import Triangular as Triangular

AnyWaveform = Annotated[
    Sawtooth | Subframes | Triangular | DiverseTriangular | FixedTriangular,
    ByKind(),
]
