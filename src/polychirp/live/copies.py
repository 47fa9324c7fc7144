"""The settings of the page as a study file and as a Python script."""

from typing import Final

from polychirp.config.dump import dump
from polychirp.live.settings import LiveSettings, study_of

SCRIPT: Final = '''\
"""The street of the live page: {title}."""

from pathlib import Path

from polychirp import load_study, run_trial

STUDY = r"""
{study}
"""

Path("live.toml").write_text(STUDY, encoding="utf-8")
seen = run_trial(load_study("live.toml")).victim("front")
print(seen.detections.range.round(2), seen.score.nature)
'''
"""Script that runs the study."""


def study_text(settings: LiveSettings, *, is_traced: bool = False) -> str:
    """TOML text of the study, as `polychirp run` reads it."""
    return f"# {settings.title}\n{dump(study_of(settings, is_traced=is_traced))}\n"


def script_text(settings: LiveSettings, *, is_traced: bool = False) -> str:
    """Python script that runs the study and prints its detections."""
    study = study_text(settings, is_traced=is_traced).strip()
    return SCRIPT.format(title=settings.title, study=study)
