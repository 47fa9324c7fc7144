"""The list of planted faults fits the code."""

import pytest

from tools.planted_faults import Fault, importers_of, read_faults


@pytest.mark.parametrize("fault", read_faults(), ids=lambda fault: fault.name)
def test_every_fault_has_its_place(fault):
    assert fault.problem() == ""
    assert fault.old != fault.new


def test_there_are_enough_faults_in_every_stage():
    faults = read_faults()
    assert len(faults) >= 40
    assert {fault.file.partition("/")[0] for fault in faults} >= {
        "model", "waveform", "channel", "synthesis", "receiver", "scoring", "study", "capture",
    }  # fmt: skip


def test_a_fault_without_its_place_is_reported():
    lost = Fault(name="lost", file="units.py", old="no such code", new="", tests=())
    assert "0 times" in lost.problem()


def test_kernels_that_a_fault_can_reach_are_compiled_anew(tmp_path):
    package = tmp_path / "src" / "polychirp"
    (package / "__pycache__").mkdir(parents=True)
    (package / "units.py").write_text("A = 1\n")
    (package / "user.py").write_text("from polychirp.units import A\n")
    (package / "other.py").write_text("B = 1\n")
    for name in ("units", "user", "other"):
        (package / "__pycache__" / f"{name}.kernel-1.py311.nbi").touch()
    fault = Fault(name="a", file="units.py", old="A = 1", new="A = 2", tests=())
    fault.plant(tmp_path)
    assert (package / "units.py").read_text() == "A = 2\n"
    assert [p.name for p in (package / "__pycache__").iterdir()] == ["other.kernel-1.py311.nbi"]
    assert len(importers_of(fault.path, tmp_path)) == 2
