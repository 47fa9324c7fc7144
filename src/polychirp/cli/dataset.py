"""``polychirp dataset`` — many interfered frames with their clean twins, to train and test on."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any, Final

from polychirp.cli.progress import progress_bar
from polychirp.cli.terminal import add_option, say, usable_folder
from polychirp.cli.trials import add_workers, num_workers
from polychirp.errors import InputError, did_you_mean

KEPT_FILES: Final = (
    "finished frames are kept, and the same command continues with the missing frames"
)
"""Part of the message that `cli.app` prints after an interrupt."""


def add_parser(subparsers: Any) -> None:
    """Add the parser of the verb ``dataset``."""
    parser = subparsers.add_parser(
        "dataset",
        help="write many interfered frames with their clean twins",
        description="Write interfered, clean, noise-free and interference-only samples of many "
        "drawn frames, with masks, schedules, paths and targets, as Zarr, and a data card. After "
        "an interruption, the same command continues; more frames are added to those that are "
        "there. The bytes do not depend on the number of workers.",
    )
    parser.add_argument(
        "study",
        metavar="STUDY",
        help="study file, whose street and radars are drawn for every frame, or a preset: "
        "a family of the benchmark's set v2, such as tu-delft, arim, toth, direct or "
        "street-direct, or arim-grid, ARIM's 960 cells in turn",
    )
    add_option(parser, "--frames", "N", 100, "number of frames")
    parser.add_argument("--seed", type=int, metavar="N", help="seed (default: the study's, or 1)")
    parser.add_argument(
        "--to",
        choices=("hdf5", "mat"),
        action="append",
        default=[],
        help="write the frames in this format too; may be given twice",
    )
    parser.add_argument("--out", metavar="DIR", help="folder (default: out/dataset-STUDY)")
    add_workers(parser)


def run(arguments: argparse.Namespace) -> int:
    """Check everything, write the missing frames and the data card, and export them."""
    from polychirp.config.load import load_study
    from polychirp.exchange.dataset_files import export_dataset, refuse_export
    from polychirp.study.check import check
    from polychirp.study.mitigation.dataset import (
        PRESETS,
        DatasetPlan,
        num_stored,
        write_dataset,
    )

    name = Path(arguments.study)
    if arguments.study in PRESETS:
        plan = DatasetPlan(
            source=arguments.study,
            seed=1 if arguments.seed is None else arguments.seed,
            num_frames=arguments.frames,
        )
    elif name.suffix == ".toml" or name.exists():
        study = load_study(name)
        check(study)
        plan = DatasetPlan(
            source=study,
            seed=study.seed if arguments.seed is None else arguments.seed,
            num_frames=arguments.frames,
        )
    else:
        raise InputError(
            f"'{arguments.study}' is neither a study file nor a preset; "
            f"{did_you_mean(arguments.study, PRESETS)}"
        )
    for form in arguments.to:
        refuse_export(form)
    workers = num_workers(arguments)
    folder = usable_folder(arguments.out or Path("out") / f"dataset-{name.stem}")
    with progress_bar("dataset") as show:
        added = write_dataset(plan, folder, workers=workers, progress=show)
    for form in dict.fromkeys(arguments.to):
        export_dataset(folder, to=form)
    say(f"{added} frames written, {num_stored(folder)} in all")
    say(f"stored in {folder}, described in README.md there")
    return 0
