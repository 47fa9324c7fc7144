"""Channel model of GNU Radio, in a separate process, as an independent check of ours."""

from __future__ import annotations

import subprocess
from pathlib import Path
from shutil import which
from tempfile import TemporaryDirectory
from typing import Final

from polychirp.capture.sigmf import DATA, META, open_sigmf, write_sigmf
from polychirp.errors import CapabilityError, RunError
from polychirp.model.baseband import Baseband

PYTHONS: Final = ("/usr/bin/python3", "python3")
"""Interpreters that may have GNU Radio, which is installed with the operating system."""

TIMEOUT: Final = 120.0
"""Time after which GNU Radio is stopped, s; chosen."""


def gnuradio_python() -> str | None:
    """Path of an interpreter that can import GNU Radio's channels; None if there is none."""
    for name in PYTHONS:
        path = which(name)
        if path is None:
            continue
        test = "import gnuradio.gr, gnuradio.blocks, gnuradio.channels"
        try:
            found = subprocess.run(
                [path, "-c", test], capture_output=True, check=False, timeout=TIMEOUT, env={}
            )
        except (OSError, subprocess.TimeoutExpired):
            continue
        if found.returncode == 0:
            return path
    return None


def through_gnuradio(
    signal: Baseband,
    *,
    noise: float = 0.0,
    frequency_offset: float = 0.0,
    clock: float = 1.0,
    seed: int = 1,
) -> Baseband:
    """Signal after the channel model of GNU Radio.

    Parameters
    ----------
    noise : V, rms of the complex noise that is added
    frequency_offset : Hz
    clock : ratio of the sample clocks, transmitter to receiver
    seed : seed of the noise

    Raises
    ------
    CapabilityError
        GNU Radio is not installed.
    RunError
        GNU Radio failed; the message is its last line.
    """
    python = gnuradio_python()
    if python is None:
        raise CapabilityError(
            "GNU Radio is not installed; install it with the operating system (Debian: gnuradio)"
        )
    # passed as text, since Python would import modules from the folder of a program file
    program = Path(__file__).with_name("gnuradio_flow.py").read_text(encoding="utf-8")
    with TemporaryDirectory() as folder:
        before, behind = Path(folder) / "in", Path(folder) / "out"
        write_sigmf(before, signal, datatype="cf32_le")
        numbers = [noise, frequency_offset / signal.sample_rate, clock, seed]
        # without our environment, since its Python has other libraries
        ended = subprocess.run(
            [python, "-c", program, str(before), str(behind), *map(repr, numbers)],
            capture_output=True,
            text=True,
            check=False,
            timeout=TIMEOUT,
            env={"HOME": folder},
            cwd=folder,
        )
        if ended.returncode != 0:
            last = (ended.stderr.strip().splitlines() or ["no message"])[-1]
            raise RunError(f"GNU Radio failed: {last}")
        _label(before, behind)
        return open_sigmf(behind.with_suffix(META)).signal()


def _label(before: Path, behind: Path) -> None:
    """Write the metadata of the output: those of the input, without hash and number of samples."""
    import json

    metadata = json.loads(before.with_suffix(META).read_text(encoding="utf-8"))
    for name in ("core:sha512", "polychirp:num_samples"):
        metadata["global"].pop(name)
    if not behind.with_suffix(DATA).exists():
        raise RunError("GNU Radio wrote no samples")
    behind.with_suffix(META).write_text(json.dumps(metadata), encoding="utf-8")
