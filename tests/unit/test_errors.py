"""Hints for misspelt words name the closest known word and all others."""

import pytest

from polychirp.config.load import build
from polychirp.errors import MOST_LISTED, InputError, did_you_mean
from polychirp.study.spec import Study


def test_known_words_are_listed_beside_the_closest_one():
    """The closest one to 'fmcw' is the only wrong one."""
    study = {"name": "x", "radars": [{"name": "front", "waveform": {"kind": "fmcw"}}]}
    with pytest.raises(InputError, match=r"no 'fmcw'; did you mean 'pmcw'\? known are .*") as told:
        build(Study, study)
    (line,) = [line for line in str(told.value).splitlines() if "fmcw" in line]
    listed = line.partition("known are ")[2].split(", ")
    assert {"sawtooth", "triangular", "pmcw"} <= set(listed)


@pytest.mark.parametrize("count", [MOST_LISTED, MOST_LISTED + 1])
def test_many_words_are_listed_only_if_none_is_close(count):
    known = ["front", *(f"{n:04d}" for n in range(count - 1))]
    assert did_you_mean("frnt", known).startswith("did you mean 'front'?")
    assert ("known are" in did_you_mean("frnt", known)) == (count <= MOST_LISTED)
    assert did_you_mean("rear", known) == f"known are {', '.join(known)}"


def test_a_single_word_is_not_listed_beside_itself():
    assert did_you_mean("frnt", ["front"]) == "did you mean 'front'?"
