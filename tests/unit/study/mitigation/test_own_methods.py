"""Methods by name."""

import pytest

from polychirp.errors import InputError
from polychirp.receiver.mitigation import Blanking, Imat
from polychirp.study.mitigation.benchmark import BenchmarkPlan
from polychirp.study.mitigation.own_methods import METHODS, SLOW_METHODS, methods_named

PLACE = "polychirp.receiver.mitigation:Imat"


def test_without_names_all_but_the_slow_methods_are_compared():
    assert set(methods_named((), ())) == set(METHODS) - SLOW_METHODS
    assert list(methods_named(("low-rank-hankel",), ())) == ["low-rank-hankel"]


def test_a_method_of_a_users_own_is_found_by_its_place():
    assert methods_named(("blanking",), (f"mine={PLACE}",)) == {
        "blanking": Blanking(),
        "mine": Imat(),
    }


@pytest.mark.parametrize(
    ("names", "own", "sentence"),
    [
        (("imta",), (), "did you mean 'imat'"),
        ((), ("mine",), "NAME=MODULE:OBJECT"),
        ((), (f"imat={PLACE}",), "'imat' already"),
        ((), ("mine=no_such_module:Mine",), "cannot be made"),
        ((), ("mine=polychirp.receiver.mitigation:Missing",), "cannot be made"),
        ((), ("mine=polychirp.units:to_db",), "no function 'mitigate"),
    ],
)
def test_what_is_no_method_is_refused(names, own, sentence):
    with pytest.raises(InputError, match=sentence):
        methods_named(names, own)


@pytest.mark.parametrize("name", ["nothing", "clean oracle", "mine, bursts known"])
def test_a_method_with_the_name_of_another_row_is_refused(name):
    with pytest.raises(InputError, match="another row"):
        BenchmarkPlan(methods={name: Blanking()})
