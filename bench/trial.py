"""CPU time of one trial: one victim, ten targets, two interferers, ray-traced vehicles.

    export NUMBA_NUM_THREADS=1 OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1
    python -m bench.trial [SEED ...]

prints the seconds of the whole trial and of its tracing for every seed (1, 2 and 3 by default), all
radars with diverse waveforms, and those of all six curves of figures 12 and 13, which share one
tracing. A trial with another seed comes first, which loads the kernels.
"""

import sys
import time
from dataclasses import replace

from polychirp.study.paper.statistics import CURVES, statistics_study, with_situation
from polychirp.study.recent_results import RecentResults
from polychirp.study.trial import run_trial

TARGETS = 10


class TimedTraces(RecentResults):
    """Traces that note the CPU-seconds that they took."""

    seconds = 0.0

    def of(self, makers, trace):
        began = time.process_time()
        found = super().of(makers, trace)
        self.seconds = time.process_time() - began
        return found


def study_of(seed):
    """Study of one street."""
    study = statistics_study("vehicles", seed=seed)
    return replace(study, traffic=replace(study.traffic, num_targets=TARGETS))


def times_of(seed):
    """CPU-seconds of a trial and of its tracing."""
    traces = TimedTraces(most=1)
    began = time.process_time()
    run_trial(with_situation(study_of(seed), "diverse", "interfered"), traces=traces)
    return time.process_time() - began, traces.seconds


def time_of_curves(seed):
    """CPU-seconds of one trial of every curve."""
    traces = RecentResults(most=1)
    began = time.process_time()
    for curve in CURVES:
        run_trial(with_situation(study_of(seed), *curve), traces=traces)
    return time.process_time() - began


def main():
    times_of(999)
    for seed in [int(given) for given in sys.argv[1:]] or [1, 2, 3]:
        whole, tracing = times_of(seed)
        print(f"seed {seed}: {whole:.2f} s, of which tracing {tracing:.2f} s", flush=True)
        print(f"seed {seed}: {time_of_curves(seed):.2f} s for all curves", flush=True)


if __name__ == "__main__":
    main()
