"""Parallel efficiency of `polychirp study` on this machine.

    python -m bench.monte_carlo [TRIALS] [--json]

runs the same trials of the small study by one worker and by two, in turn, and prints trials per
second, their ratio over the number of workers, and what the machine itself allows: the same for
two plain loops of one thread each that share nothing. "busy" is the share of their time that the
two workers spend in trials; unlike the ratio, it means something on a machine that has other work
too. Workers are timed from their first outcomes on; the seconds that they need to begin are
printed apart.
"""

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from itertools import count
from pathlib import Path

from polychirp.config.monte_carlo import load_plan
from polychirp.study.monte_carlo.executor import LocalWorkers
from polychirp.study.monte_carlo.grid import trial_seed
from polychirp.study.monte_carlo.plan import Plan
from polychirp.study.monte_carlo.run import run_plan
from polychirp.study.monte_carlo.tasks import ONE_THREAD, Task
from tests.support.small_study import SMALL_GRID, SMALL_STUDY

LOOP = """
import sys, time
from polychirp.config.monte_carlo import load_plan
from polychirp.study.monte_carlo.tasks import Task, attempt
plan = load_plan(sys.argv[1])
studies = [point.study for point in plan.points]
attempt(studies, Task(point=0, trial=0, seed=1))
print("ready", flush=True)
input()
for n in range(int(sys.argv[2])):
    attempt(studies, Task(point=n % len(studies), trial=n, seed=n))
print("done", flush=True)
"""


def endless(plan: Plan) -> Iterator[Task]:
    for trial in count():
        for point in range(len(plan.points)):
            yield Task(point=point, trial=trial, seed=trial_seed(plan.origin.seed, trial))


def rate(plan: Plan, *, workers: int, trials: int) -> tuple[float, ...]:
    """Trials per second once all workers are at work, their busy share, the leader's CPU time for
    a trial, seconds until all are at work.
    """
    start = time.perf_counter()
    outcomes = LocalWorkers(count=workers).run([p.study for p in plan.points], endless(plan))
    for _ in range(2 * workers):
        next(outcomes)
    begun = time.perf_counter()
    own = time.process_time()
    busy = sum(next(outcomes).duration for _ in range(trials))
    seconds = time.perf_counter() - begun
    outcomes.close()
    own = time.process_time() - own
    return trials / seconds, busy / (workers * seconds), own / trials, begun - start


def loop_rate(file: Path, *, loops: int, trials: int) -> float:
    """Trials per second of so many plain loops side by side."""
    processes = [
        subprocess.Popen(
            [sys.executable, "-c", LOOP, str(file), str(trials // loops)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env=os.environ | ONE_THREAD,
        )
        for _ in range(loops)
    ]
    for process in processes:
        process.stdout.readline()
    start = time.perf_counter()
    for process in processes:
        process.stdin.write("\n")
        process.stdin.flush()
    for process in processes:
        process.stdout.readline()
    seconds = time.perf_counter() - start
    for process in processes:
        process.communicate()
    return trials / seconds


def whole_run(plan: Plan, *, workers: int, folder: Path) -> float:
    """Seconds of a run from nothing to its tables."""
    start = time.perf_counter()
    run_plan(plan, folder=folder, executor=LocalWorkers(count=workers), progress=lambda *_: None)
    return time.perf_counter() - start


def main() -> None:
    numbers = [argument for argument in sys.argv[1:] if argument != "--json"]
    trials = int(numbers[0]) if numbers else 200
    measured = []
    with tempfile.TemporaryDirectory() as name:
        file = Path(name) / "small.toml"
        file.write_text(SMALL_STUDY + SMALL_GRID, encoding="utf-8")
        plan = load_plan(file)
        for _ in range(3):
            (one, _, _, wait), (two, busy, own, wait_two) = (
                rate(plan, workers=n, trials=trials) for n in (1, 2)
            )
            alone, beside = (loop_rate(file, loops=n, trials=trials) for n in (1, 2))
            print(
                f"1 worker {one:.1f}/s, 2 workers {two:.1f}/s: efficiency {two / one / 2:.3f}, "
                f"busy {busy:.3f}, leader {own * 1e3:.2f} ms a trial; "
                f"plain loops {alone:.1f} and {beside:.1f}/s: {beside / alone / 2:.3f}; workers "
                f"begin after {wait:.1f} and {wait_two:.1f} s",
                file=sys.stderr,
                flush=True,
            )
            measured.append(
                {
                    "efficiency": round(two / one / 2, 3),
                    "plain_loops": round(beside / alone / 2, 3),
                    "busy": round(busy, 3),
                    "leader_ms_per_trial": round(own * 1e3, 2),
                }
            )
        seconds = [whole_run(plan, workers=n, folder=Path(name) / f"{n}") for n in (1, 2)]
        print(f"{4 * plan.trials} trials from nothing to tables: {seconds} s", file=sys.stderr)
    if "--json" in sys.argv[1:]:
        print(json.dumps(measured))


if __name__ == "__main__":
    main()
