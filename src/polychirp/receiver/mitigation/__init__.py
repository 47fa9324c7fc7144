"""Receive-side mitigation: the methods a study file may name by their ``kind``.

The modules in reading order; others use the methods themselves, and `base.mitigated`:

- `base`: the interface `Mitigation`, its result `Mitigated`, and refusals.
- `burst_detectors`: which samples are hit; `burst_repair`: the settings of that step.
- Methods that repair the samples that are hit: `blanking`, `interpolation`, `burg`,
  `autoregression`, `matrix_pencil`, `imat`, `nulling`. `patches` are missing samples as linear
  maps of known ones; `prediction` is linear prediction.
- Methods on ramps with bursts, by spectra and planes: `stft_statistics`, `wavelet`,
  `dual_sparsity`, `noise_canceller`.
- Methods that need no detector: `stft_excision` and `steady_lines`, `chirp_subtraction`,
  `ramp_minimum`, `low_rank_hankel`, and the trained `complex_network` with its `network_layers`.
"""

from typing import Annotated

from polychirp.receiver.mitigation.autoregression import Autoregression as Autoregression
from polychirp.receiver.mitigation.blanking import Blanking as Blanking
from polychirp.receiver.mitigation.burg import Burg as Burg
from polychirp.receiver.mitigation.chirp_subtraction import ChirpSubtraction as ChirpSubtraction
from polychirp.receiver.mitigation.complex_network import ComplexNetwork as ComplexNetwork
from polychirp.receiver.mitigation.dual_sparsity import DualSparsity as DualSparsity
from polychirp.receiver.mitigation.imat import Imat as Imat
from polychirp.receiver.mitigation.interpolation import Interpolation as Interpolation
from polychirp.receiver.mitigation.low_rank_hankel import LowRankHankel as LowRankHankel
from polychirp.receiver.mitigation.matrix_pencil import MatrixPencil as MatrixPencil
from polychirp.receiver.mitigation.noise_canceller import NoiseCanceller as NoiseCanceller
from polychirp.receiver.mitigation.nulling import Nulling as Nulling
from polychirp.receiver.mitigation.ramp_minimum import RampMinimum as RampMinimum
from polychirp.receiver.mitigation.stft_excision import StftExcision as StftExcision
from polychirp.receiver.mitigation.stft_statistics import StftStatistics as StftStatistics
from polychirp.receiver.mitigation.wavelet import Wavelet as Wavelet
from polychirp.spec import ByKind

AnyMitigation = Annotated[
    Blanking
    | Interpolation
    | Burg
    | Autoregression
    | MatrixPencil
    | Imat
    | Nulling
    | StftExcision
    | StftStatistics
    | Wavelet
    | DualSparsity
    | ChirpSubtraction
    | NoiseCanceller
    | RampMinimum
    | LowRankHankel
    | ComplexNetwork,
    ByKind(group="polychirp.mitigations", method="mitigate"),
]
