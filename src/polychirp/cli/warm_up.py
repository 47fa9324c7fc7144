"""``polychirp warm-up`` — compile all kernels in advance, for container images and clusters."""

import argparse
import json
import sys
from typing import TYPE_CHECKING, Any

from polychirp.cli.progress import progress_bar
from polychirp.errors import RunError

if TYPE_CHECKING:
    from polychirp.kernel_cache import Compiled


def add_parser(subparsers: Any) -> None:
    """Add the parser of the verb ``warm-up``."""
    parser = subparsers.add_parser(
        "warm-up",
        help="compile all kernels ahead of their first use",
        description="Compile all kernels into numba's cache, in one process per core, at most "
        "eight; commands then only load them. The environment variable NUMBA_CACHE_DIR names the "
        "folder of the cache; by default it lies beside the sources. A second call finds nothing "
        "to do.",
    )
    parser.add_argument("--json", action="store_true", help="print what was compiled as JSON")


def run(arguments: argparse.Namespace) -> int:
    """Compile the kernels that the cache lacks, and print which."""
    from polychirp.kernel_cache import is_enabled
    from polychirp.study.kernel_parts import compile_all

    if not is_enabled():
        raise RunError(
            "the environment variable NUMBA_DISABLE_JIT forbids numba to compile; unset it"
        )
    with progress_bar("warm-up") as progress:
        done = compile_all(progress=progress)
    if arguments.json:
        print(json.dumps(_summary(done), indent=2))
    else:
        print(_sentence(done), file=sys.stderr)
    if done.failures:
        raise RunError(
            f"workers or parts that failed: {len(done.failures)}; the notes above say why"
        )
    return 0


def _summary(done: "Compiled") -> dict[str, Any]:
    return {
        "folder": str(done.folder),
        "parts": list(done.parts),
        "kernels": sorted(done.kernels),
        "duration_s": round(done.duration, 3),
        "failures": list(done.failures),
    }


def _sentence(done: "Compiled") -> str:
    if not done.parts:
        return f"nothing to do: all kernels are in {done.folder}"
    parts = ", ".join(done.parts)
    return (
        f"compiled {len(done.kernels)} kernels ({parts}) in {done.duration:.0f} s; "
        f"the cache is {done.folder}"
    )
