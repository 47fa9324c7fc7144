"""``polychirp export`` — write a stored run in the format of another tool."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from typing import Any, NoReturn

from polychirp.cli.stored import RUN, stored_results
from polychirp.cli.terminal import say, usable_folder
from polychirp.errors import PolychirpError


def add_parser(subparsers: Any) -> None:
    """Add the parser of the verb ``export``."""
    parser = subparsers.add_parser(
        "export",
        help="write a stored run for MATLAB, ROS, NetCDF …",
        description="Write a stored run in the format of another tool: samples, paths, detections "
        "and truth, as far as the format holds them.",
        epilog="formats: mat, netcdf, hdf5 (all arrays); sigmf (samples, ramps); csv (tables of "
        "detections, targets, paths, ramps, poses); osi (detections, targets, poses); rosbag "
        "(detections, poses of radars)",
    )
    parser.add_argument("run", metavar="RUN", help="the run: run.zarr, or its folder")
    parser.add_argument(
        "--to", metavar="FORMAT", required=True, action="append", help="a format; may be repeated"
    )
    parser.add_argument("--out", metavar="DIR", help="folder of the files (default: that of RUN)")


def run(arguments: argparse.Namespace) -> int:
    """Read the run, write every format that can be written, and print what was written."""
    from polychirp.exchange.formats import refuse_unknown, writer_of
    from polychirp.study.store.load import load_run

    formats = tuple(dict.fromkeys(arguments.to))
    for name in formats:
        refuse_unknown(name)
    path = stored_results(arguments.run, folders=(RUN,))
    folder = usable_folder(arguments.out or path.parent)
    found = load_run(path)
    folder.mkdir(parents=True, exist_ok=True)
    refusals: dict[str, PolychirpError] = {}
    for name in formats:
        try:
            for written in writer_of(name)(found, folder):
                print(written)
        except PolychirpError as error:
            refusals[name] = error
    for number, victim in enumerate(found.victims):
        say(f"victim-{number} is the radar '{victim.name}'")
    if refusals:
        _raise(refusals, num_formats=len(formats))
    return 0


def _raise(refusals: Mapping[str, PolychirpError], *, num_formats: int) -> NoReturn:
    """Raise the refusal of the only format that was asked for, or one that tells all refusals."""
    first = next(iter(refusals.values()))
    if num_formats == 1:
        raise first
    raise type(first)(
        "\n  ".join(
            [
                f"formats that were not written: {len(refusals)} of {num_formats}",
                *(f"{name}: {error}" for name, error in refusals.items()),
            ]
        )
    )
