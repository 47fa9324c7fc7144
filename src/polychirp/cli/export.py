"""``polychirp export`` — write a stored run in the format of another tool."""

from __future__ import annotations

import argparse
from typing import Any

from polychirp.cli.stored import RUN, stored_results
from polychirp.cli.terminal import say, usable_folder


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
    """Read the run, write every format, and print what was written."""
    from polychirp.exchange.formats import writer_of
    from polychirp.study.store.load import load_run

    writers = [writer_of(name) for name in dict.fromkeys(arguments.to)]
    path = stored_results(arguments.run, folders=(RUN,))
    folder = usable_folder(arguments.out or path.parent)
    found = load_run(path)
    folder.mkdir(parents=True, exist_ok=True)
    for writer in writers:
        for written in writer(found, folder):
            print(written)
    for number, victim in enumerate(found.victims):
        say(f"victim-{number} is the radar '{victim.name}'")
    return 0
