"""``polychirp study`` with real worker processes, real kills and a real cluster.

Trials last a tenth of a second; a worker needs a second or two to begin.
"""

import json
import os
import signal
import subprocess
import sys
import time
from collections import Counter
from contextlib import suppress
from pathlib import Path

import pytest

from polychirp.cli.app import main
from polychirp.config.monte_carlo import load_plan
from polychirp.errors import InputError
from polychirp.model.baseband import no_progress
from polychirp.study.monte_carlo import executor as local
from polychirp.study.monte_carlo.dask_executor import DaskWorkers
from polychirp.study.monte_carlo.executor import LocalWorkers
from polychirp.study.monte_carlo.records import read_records, victim_records
from polychirp.study.monte_carlo.run import LOG, STORE, run_plan
from polychirp.study.monte_carlo.tasks import MOST_DEATHS, Task
from polychirp.study.trial import run_trial
from tests.support.small_study import SMALL_GRID, SMALL_STUDY

pytestmark = pytest.mark.slow

NUM_TRIALS = 4 * 12

PATIENT = 300.0
"""s: the first trial of a fresh installation compiles."""


@pytest.fixture(scope="module")
def file(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("study") / "small.toml"
    path.write_text(SMALL_STUDY + SMALL_GRID, encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def plan(file):
    return load_plan(file)


@pytest.fixture(scope="module")
def alone(plan, tmp_path_factory) -> Path:
    """Results of one worker that nobody disturbed."""
    folder = tmp_path_factory.mktemp("alone")
    run_plan(plan, folder=folder, executor=LocalWorkers(count=1), progress=no_progress)
    return folder


def files(folder: Path) -> dict[str, bytes]:
    return {
        str(file.relative_to(folder)): file.read_bytes()
        for file in sorted(folder.rglob("*"))
        if file.is_file() and file.name != LOG
    }


def lines(log: Path) -> list[bytes]:
    return log.read_bytes().splitlines() if log.exists() else []


def keys(log: Path) -> Counter:
    """How often each trial stands in a log, told from its text alone."""
    contents = [json.loads(line.partition(b" ")[2]) for line in lines(log)[1:]]
    return Counter((content["study_hash"], content["trial"]) for content in contents)


def test_a_worker_finds_what_the_trial_itself_finds(plan, alone):
    found = {record.key: record for record in read_records(alone / LOG)}
    for point in (plan.points[0], plan.points[3]):
        expected = victim_records(run_trial(point.trial(5)))
        # as text, because the errors of a target that is not found are NaN
        assert repr(found[point.study_hash, 5].victims) == repr(expected)


@pytest.mark.parametrize("count", [2, 3])
def test_any_number_of_workers_gives_the_same_bytes(plan, alone, tmp_path, count):
    run_plan(plan, folder=tmp_path, executor=LocalWorkers(count=count), progress=no_progress)
    assert files(tmp_path) == files(alone)


def test_variants_share_their_noise_to_the_bit(plan):
    weak, strong = (run_trial(plan.points[n].trial(3)).victims[0] for n in (0, 2))
    assert weak.frame.samples.tobytes() != strong.frame.samples.tobytes()
    assert weak.parts["noise"].tobytes() == strong.parts["noise"].tobytes()


def start(file: Path, folder: Path) -> subprocess.Popen:
    command = [sys.executable, "-m", "polychirp", "study", str(file), "--out", str(folder)]
    return subprocess.Popen([*command, "--workers", "2"], start_new_session=True)


def wait_for(condition, *, process=None) -> None:
    end = time.monotonic() + PATIENT
    while not condition():
        assert time.monotonic() < end, "it takes too long"
        assert process is None or process.poll() is None, "it ended before it was killed"
        time.sleep(0.005)


@pytest.mark.skipif(not hasattr(os, "killpg"), reason="this system has no groups of processes")
@pytest.mark.parametrize("whom", ["everybody", "the leader"])
def test_a_run_killed_midway_goes_on_and_ends_with_the_same_bytes(file, alone, tmp_path, whom):
    log = tmp_path / LOG
    process = start(file, tmp_path)
    wait_for(lambda: len(lines(log)) > 15, process=process)
    os.kill(process.pid, signal.SIGKILL) if whom == "the leader" else os.killpg(
        process.pid, signal.SIGKILL
    )
    process.wait()
    before = log.read_bytes()
    kept = set(keys(log))
    assert 15 <= len(kept) < NUM_TRIALS
    assert not (tmp_path / STORE).exists()
    if whom == "the leader":
        # its workers notice, and do not go on for nobody
        wait_for(lambda: not is_group_alive(process.pid))
    arguments = ["study", str(file), "--out", str(tmp_path), "--workers", "2"]
    assert main(arguments) == 0
    assert log.read_bytes().startswith(before)
    assert set(keys(log).values()) == {1}
    assert len(keys(log)) == NUM_TRIALS
    assert files(tmp_path) == files(alone)


def is_group_alive(group: int) -> bool:
    try:
        os.killpg(group, 0)
    except ProcessLookupError:
        return False
    return True


def test_a_killed_worker_is_replaced_and_its_trial_runs_again(plan, alone, tmp_path, monkeypatch):
    started = []

    class Watched(subprocess.Popen):
        def __init__(self, *arguments, **options):
            super().__init__(*arguments, **options)
            started.append(self)

    monkeypatch.setattr(local.subprocess, "Popen", Watched)

    def kill_one(what, done, total):
        if done in (8, 24):
            started[-1].kill()

    run_plan(plan, folder=tmp_path, executor=LocalWorkers(count=2), progress=kill_one)
    assert len(started) == 4
    assert all(process.poll() is not None for process in started)
    assert set(keys(tmp_path / LOG).values()) == {1}
    assert files(tmp_path) == files(alone)


KILLER = '''
import os, signal
from dataclasses import dataclass

@dataclass(frozen=True)
class Killer:
    """Ends its process when it gets the seed 13, and is no study with any other."""
    seed: int = 0

    def __post_init__(self):
        if self.seed == 13:
            os.kill(os.getpid(), signal.SIGKILL)
'''


def test_a_trial_that_kills_its_workers_is_given_up_and_the_others_are_not(tmp_path, monkeypatch):
    (tmp_path / "killer_of_workers.py").write_text(KILLER, encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path), prepend=os.pathsep)
    from killer_of_workers import Killer

    tasks = [Task(point=0, trial=n, seed=n) for n in range(20)]
    outcomes = list(LocalWorkers(count=2).run([Killer()], iter(tasks)))
    assert sorted(outcome.task.trial for outcome in outcomes) == list(range(20))
    by_trial = {outcome.task.trial: outcome.failure for outcome in outcomes}
    assert by_trial.pop(13) == f"{MOST_DEATHS} workers died during this trial"
    assert all("Error" in failure for failure in by_trial.values())


def test_workers_are_stopped_when_nobody_wants_their_outcomes(plan, monkeypatch):
    tasks = (Task(point=0, trial=n, seed=n) for n in range(1000))
    outcomes = LocalWorkers(count=2).run([plan.points[0].study], tasks)
    next(outcomes)
    before = time.monotonic()
    outcomes.close()
    assert time.monotonic() - before < 5.0


def test_the_command_prints_tables_for_people_and_json_for_machines(file, alone, capsys):
    arguments = ["study", str(file), "--out", str(alone)]
    assert main(arguments) == 0
    shown = capsys.readouterr()
    for word in ("waveform", "conventional", "Pd", "P(ghost)", "range, m"):
        assert word in shown.out
    for word in ("0 new trials", STORE):
        assert word in shown.err
    assert main([*arguments, "--json"]) == 0
    summary = json.loads(capsys.readouterr().out)
    assert summary["axes"]["waveform"] == ["conventional", "diverse"]
    assert [point["num_trials"] for point in summary["points"]] == [12] * 4
    assert summary["new_trials"] == 0
    assert {row["axis"] for row in summary["differences"]} == {"rcs", "waveform"}


def test_force_begins_anew(file, tmp_path, capsys):
    arguments = ["study", str(file), "--out", str(tmp_path), "--json"]
    arguments += ["--set", "monte_carlo.trials=1"]
    for options, number in (([], 4), ([], 0), (["--force"], 4)):
        assert main([*arguments, *options]) == 0
        assert json.loads(capsys.readouterr().out)["new_trials"] == number


@pytest.mark.filterwarnings("default")  # Dask's own
def test_a_local_cluster_gives_the_same_bytes(plan, alone, tmp_path):
    """And leaves nothing in the environment, in which numba would then refuse to compile."""
    pytest.importorskip("distributed", reason="Dask is not installed (extra 'cluster')")
    environment = dict(os.environ)
    run_plan(
        plan,
        folder=tmp_path,
        executor=DaskWorkers(cluster="local", count=2),
        progress=no_progress,
    )
    assert files(tmp_path) == files(alone)
    assert dict(os.environ) == environment


SBATCH = """#!/bin/sh
# a queue that is always empty: the job starts at once, and tells its number
[ "$1" = --test-only ] && exit 0
cp "$1" "$0.job"
setsid sh "$0.job" >/dev/null 2>&1 &
echo "Submitted batch job $!"
"""


@pytest.mark.filterwarnings("default")
def test_jobs_of_a_queue_give_the_same_bytes(plan, alone, tmp_path, monkeypatch):
    """Everything of SLURM but SLURM itself: the job's script is run by a stand-in."""
    pytest.importorskip("dask_jobqueue", reason="dask-jobqueue is not installed (extra 'cluster')")
    for name, text in (("sbatch", SBATCH), ("scancel", '#!/bin/sh\nkill -- -"$1"\n')):
        (tmp_path / name).write_text(text, encoding="utf-8")
        (tmp_path / name).chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path), prepend=os.pathsep)
    executor = DaskWorkers(cluster="slurm", count=1)
    run_plan(plan, folder=tmp_path / "out", executor=executor, progress=no_progress)
    assert (tmp_path / "sbatch.job").exists()
    assert files(tmp_path / "out") == files(alone)


def slurm_answers():
    with suppress(FileNotFoundError, subprocess.SubprocessError):
        subprocess.run(["sinfo"], check=True, capture_output=True, timeout=20)
        return True
    return False


@pytest.mark.filterwarnings("default")
def test_slurm_gives_the_same_bytes(plan, alone, tmp_path, monkeypatch):
    pytest.importorskip("dask_jobqueue", reason="dask-jobqueue is not installed (extra 'cluster')")
    if not slurm_answers():
        pytest.skip("no SLURM answers here")
    monkeypatch.chdir(tmp_path)  # jobs write their logs where they are sent from
    executor = DaskWorkers(cluster="slurm", count=2)
    run_plan(plan, folder=tmp_path / "out", executor=executor, progress=no_progress)
    assert files(tmp_path / "out") == files(alone)


@pytest.mark.filterwarnings("default")
def test_a_queue_that_refuses_the_job_is_told_in_its_own_words(plan, tmp_path, monkeypatch):
    pytest.importorskip("dask_jobqueue", reason="dask-jobqueue is not installed (extra 'cluster')")
    refusal = "sbatch: error: Memory specification can not be satisfied"
    (tmp_path / "sbatch").write_text(f"#!/bin/sh\necho '{refusal}' >&2; exit 1\n", encoding="utf-8")
    (tmp_path / "sbatch").chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path), prepend=os.pathsep)
    executor = DaskWorkers(cluster="slurm", count=1)
    with pytest.raises(InputError, match="SLURM refuses the job: Memory specification") as caught:
        run_plan(plan, folder=tmp_path / "out", executor=executor, progress=no_progress)
    assert "jobqueue.slurm" in str(caught.value)


@pytest.mark.filterwarnings("default")
def test_without_slurm_the_way_out_is_named(plan, tmp_path, monkeypatch):
    pytest.importorskip("dask_jobqueue", reason="dask-jobqueue is not installed (extra 'cluster')")
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(InputError, match="the command sbatch is not found"):
        run_plan(
            plan,
            folder=tmp_path / "out",
            executor=DaskWorkers(cluster="slurm", count=1),
            progress=no_progress,
        )


@pytest.mark.filterwarnings("default")
def test_a_cluster_that_loses_a_worker_loses_no_trial(plan, alone, tmp_path):
    distributed = pytest.importorskip(
        "distributed", reason="Dask is not installed (extra 'cluster')"
    )
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, dashboard_address=None, silence_logs="ERROR"
    ) as cluster:
        victims = []

        def kill_one(what, done, total):
            if done >= 10 and not victims:
                victims.append(next(iter(cluster.workers.values())).pid)
                os.kill(victims[0], signal.SIGKILL)

        run_plan(
            plan,
            folder=tmp_path,
            executor=DaskWorkers(cluster=cluster.scheduler_address, count=2),
            progress=kill_one,
        )
        assert victims
    assert set(keys(tmp_path / LOG).values()) == {1}
    assert files(tmp_path) == files(alone)
