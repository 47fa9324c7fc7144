"""Receive-side mitigation: the methods a study file may name by their ``kind``."""

from typing import Annotated

from polychirp.receiver.mitigation.autoregression import Autoregression as Autoregression
from polychirp.receiver.mitigation.blanking import Blanking as Blanking
from polychirp.receiver.mitigation.imat import Imat as Imat
from polychirp.receiver.mitigation.stft_excision import StftExcision as StftExcision
from polychirp.spec import ByKind

AnyMitigation = Annotated[Blanking | Autoregression | Imat | StftExcision, ByKind()]
