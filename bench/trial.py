"""CPU time of one trial: one victim, ten targets, two interferers, ray-traced vehicles.

    export NUMBA_NUM_THREADS=1 OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1
    python -m bench.trial [SEED ...]

prints the seconds of the whole trial and of its tracing for every seed (1, 2 and 3 by default), all
radars with diverse waveforms. A trial with another seed comes first, which loads the kernels.
"""

import sys
import time
from dataclasses import replace

from polychirp.study.paper.statistics import statistics_study, with_situation
from polychirp.study.recent_traces import RecentTraces
from polychirp.study.trial import run_trial

TARGETS = 10


class TimedTraces(RecentTraces):
    """Traces that note the CPU-seconds that they took."""

    seconds = 0.0

    def of(self, makers, trace):
        began = time.process_time()
        found = super().of(makers, trace)
        self.seconds = time.process_time() - began
        return found


def times_of(seed):
    """CPU-seconds of a trial and of its tracing."""
    study = statistics_study("vehicles", seed=seed)
    study = replace(study, traffic=replace(study.traffic, num_targets=TARGETS))
    traces = TimedTraces(most=1)
    began = time.process_time()
    run_trial(with_situation(study, "diverse", "interfered"), traces=traces)
    return time.process_time() - began, traces.seconds


def main():
    times_of(999)
    for seed in [int(given) for given in sys.argv[1:]] or [1, 2, 3]:
        whole, tracing = times_of(seed)
        print(f"seed {seed}: {whole:.2f} s, of which tracing {tracing:.2f} s", flush=True)


if __name__ == "__main__":
    main()
