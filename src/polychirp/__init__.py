"""Simulator of mutual interference between FMCW automotive radars in ray-traced traffic.

Each public name is imported when it is first used, so that ``import polychirp`` is fast.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from polychirp.config.load import load_study as load_study
    from polychirp.receiver.coherent.chain import CoherentReceiver as CoherentReceiver
    from polychirp.receiver.mitigation.blanking import Blanking as Blanking
    from polychirp.study.paper.scenarios import paper_study as paper_study
    from polychirp.study.paper.scenarios import run_paper as run_paper
    from polychirp.study.spec import Study as Study
    from polychirp.study.spec import StudyRadar as StudyRadar
    from polychirp.study.store.load import load_run as load_run
    from polychirp.study.trial import run_trial as run_trial

_HOMES = {
    "Blanking": "polychirp.receiver.mitigation.blanking",
    "CoherentReceiver": "polychirp.receiver.coherent.chain",
    "Study": "polychirp.study.spec",
    "StudyRadar": "polychirp.study.spec",
    "load_run": "polychirp.study.store.load",
    "load_study": "polychirp.config.load",
    "paper_study": "polychirp.study.paper.scenarios",
    "run_paper": "polychirp.study.paper.scenarios",
    "run_trial": "polychirp.study.trial",
}
"""Module of every public name."""

__all__ = ["Blanking", "CoherentReceiver", "Study", "StudyRadar", "load_run", "load_study"]
__all__ += ["paper_study", "run_paper", "run_trial"]


def __getattr__(name: str) -> Any:
    """Import a public name from its module."""
    if name not in _HOMES:
        raise AttributeError(f"module 'polychirp' has no attribute '{name}'")
    return getattr(import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    return sorted(_HOMES)
