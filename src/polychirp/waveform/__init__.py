"""Waveforms: what a radar transmits. A study file chooses a family by its ``kind``.

`base` has the interface, `chirps` the schedule of single ramps. The families: `sawtooth`,
`subframes` and `triangular`; `diverse_sawtooth`, `hopping`, `phase_codes`, `permuted_chirps` and
`slope_sequence` against interference; `phase_coded_ramp` with a code within each ramp; `pmcw` and
`noise` with a code on a carrier (`carriers`, `code_sequences`); `mfsk` with steps of constant
frequency. `access` has the rules by which radars share time and band before a frame, `frame_rules`
those that act from frame to frame, `coding` the codes of several transmitting elements, `design`
equations for sweep time and bandwidth, `playing` a radio's samples.
"""

from typing import Annotated

from polychirp.spec import ByKind
from polychirp.waveform.access import Access as Access
from polychirp.waveform.access import Compass as Compass
from polychirp.waveform.access import RandomStarts as RandomStarts
from polychirp.waveform.access import Slots as Slots
from polychirp.waveform.access import SlottedAloha as SlottedAloha
from polychirp.waveform.base import Waveform as Waveform
from polychirp.waveform.coding import AnyCoding as AnyCoding
from polychirp.waveform.coding import Coding as Coding
from polychirp.waveform.coding import DopplerDivision as DopplerDivision
from polychirp.waveform.coding import PhaseCoded as PhaseCoded
from polychirp.waveform.coding import TimeDivision as TimeDivision
from polychirp.waveform.coding import coded as coded
from polychirp.waveform.diverse_sawtooth import DiverseSawtooth as DiverseSawtooth
from polychirp.waveform.frame_rules import FrameRule as FrameRule
from polychirp.waveform.frame_rules import HopAfterHit as HopAfterHit
from polychirp.waveform.frame_rules import ListenBeforeTalk as ListenBeforeTalk
from polychirp.waveform.frame_rules import Listening as Listening
from polychirp.waveform.frame_rules import MeasuredInterference as MeasuredInterference
from polychirp.waveform.frame_rules import RedrawEachFrame as RedrawEachFrame
from polychirp.waveform.frame_rules import Turn as Turn
from polychirp.waveform.hopping import Hopping as Hopping
from polychirp.waveform.mfsk import Mfsk as Mfsk
from polychirp.waveform.noise import Noise as Noise
from polychirp.waveform.permuted_chirps import PermutedChirps as PermutedChirps
from polychirp.waveform.phase_coded_ramp import PhaseCodedRamp as PhaseCodedRamp
from polychirp.waveform.phase_codes import PhaseCodedSawtooth as PhaseCodedSawtooth
from polychirp.waveform.pmcw import Pmcw as Pmcw
from polychirp.waveform.sawtooth import Sawtooth as Sawtooth
from polychirp.waveform.slope_sequence import SlopeSequence as SlopeSequence
from polychirp.waveform.subframes import Subframes as Subframes
from polychirp.waveform.triangular import DiverseTriangular as DiverseTriangular
from polychirp.waveform.triangular import FixedTriangular as FixedTriangular
from polychirp.waveform.triangular import Triangular as Triangular

AnyWaveform = Annotated[
    Sawtooth
    | Subframes
    | Triangular
    | DiverseTriangular
    | FixedTriangular
    | DiverseSawtooth
    | Hopping
    | PhaseCodedSawtooth
    | PermutedChirps
    | SlopeSequence
    | PhaseCodedRamp
    | Pmcw
    | Noise
    | Mfsk,
    ByKind(group="polychirp.waveforms"),
]

AnyAccess = Annotated[
    RandomStarts
    | SlottedAloha
    | Slots
    | Compass
    | RedrawEachFrame
    | HopAfterHit
    | ListenBeforeTalk,
    ByKind(group="polychirp.access", method="assign"),
]
"""Rules of a study, before a trial or from frame to frame (`FrameRule`)."""
