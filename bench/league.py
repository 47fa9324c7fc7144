"""CPU time of one trial of every scheme of the league, and what a whole league would take.

    OPENBLAS_NUM_THREADS=1 NUMBA_NUM_THREADS=1 python -m bench.league [SCENARIO …] [--json]

runs one trial of each scheme and start on one thread, after one that compiles and caches, and
prints the mean of the starts. The last line is the time of 12 schemes in 4 scenarios with 100
trials, half of each start, on two cores, at the mean of the schemes and scenarios that were run.
"""

import json
import sys
import time
import warnings

from polychirp.config.monte_carlo import load_plan
from polychirp.study.trial import run_trial
from tools.sources import ROOT

LEAGUE = ROOT / "studies" / "league"


def seconds(name):
    """CPU time of a trial of every scheme, s, by its name; the mean of the starts."""
    plan = load_plan(LEAGUE / f"{name}.toml", common=LEAGUE / "common.toml")
    taken = {}
    run_trial(plan.points[0].trial(0), names_radars=False)
    for point in plan.points:
        begin = time.process_time()
        run_trial(point.trial(1), names_radars=False)
        taken.setdefault(point.labels[-1], []).append(time.process_time() - begin)
    return {scheme: round(sum(times) / len(times), 2) for scheme, times in taken.items()}


def main():
    """Print a row for each scheme, or everything as JSON."""
    warnings.simplefilter("ignore")
    names = [name for name in sys.argv[1:] if name != "--json"] or ["oncoming"]
    result = {name: seconds(name) for name in names}
    every = [one for of_name in result.values() for one in of_name.values()]
    whole = 12 * 4 * 100 * sum(every) / len(every) / 2 / 60
    if "--json" in sys.argv:
        print(json.dumps({"seconds": result, "minutes_of_a_league": round(whole)}))
        return
    for name, of_name in result.items():
        for scheme, one in of_name.items():
            print(f"{name:12} {scheme:22} {one:6.2f} s")
    print(f"12 schemes × 4 scenarios × 100 trials on two cores: {whole:.0f} minutes")


if __name__ == "__main__":
    main()
