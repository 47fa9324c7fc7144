"""Kernels alone need numba, and nothing imports them before a frame is synthesized."""

import subprocess
import sys

PROGRAM = """
import importlib, pkgutil, sys, polychirp.synthesis as package
for module in pkgutil.walk_packages(package.__path__, package.__name__ + "."):
    if not module.name.endswith(("kernels", "unit_phasors", "splines")):
        importlib.import_module(module.name)
print(sorted({"numba", "scipy"} & set(sys.modules)))
"""


def test_importing_the_synthesis_loads_neither_numba_nor_scipy():
    run = subprocess.run(
        [sys.executable, "-c", PROGRAM], check=True, capture_output=True, text=True
    )
    assert run.stdout.strip() == "[]"
