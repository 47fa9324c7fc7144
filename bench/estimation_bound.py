"""Errors of the receiver over the Cramér–Rao bound: data and figure of the docs.

    OMP_NUM_THREADS=1 python bench/estimation_bound.py docs/images [trials]

writes estimation_bound.png, and estimation_bound.json beside it; some five minutes. Below the SNR
where all are found, outliers would be the threshold effect: a panel shows the shares of both.
"""

import json
import sys
from pathlib import Path

from polychirp.receiver.coherent.chain import CoherentReceiver
from polychirp.rng import Streams
from polychirp.units import from_db
from polychirp.waveform import DiverseTriangular, Triangular
from tests.support.estimation import estimate_points
from tools.figures.estimation_bound import estimation_bound

FAMILIES = {
    "conventional": Triangular(bandwidth=1e9, ramp_duration=1e-3),
    "diverse": DiverseTriangular(),
}

SNR_DB = (-30, -28, -26, -24, -20, -10, 0, 20, 40, 60)


def main(folder, trials):
    curves, found, shares = {}, {}, {}
    for name, family in FAMILIES.items():
        ramps = family.schedule(num_sweeps=16, streams=Streams(2))
        curves[name], found[name], shares[name] = [], [], []
        for seed, snr in enumerate(SNR_DB):
            one = estimate_points(
                CoherentReceiver(), ramps, snr=from_db(snr), trials=trials, seed=seed
            )
            shares[name].append((snr, one.found, one.outliers if one.found else 0.0))
            if one.found < 0.5:
                continue
            errors = one.efficiency * one.bound
            curves[name].append((snr, errors.tolist(), one.bound.tolist()))
            found[name].append((snr, one.found, one.efficiency.tolist()))
            print(name, snr, *found[name][-1][1:], flush=True)
    note = (
        f"One point, 16 triangles, 4 channels, {trials} trials each: range, rate and acceleration "
        "in the middle of the frame, azimuth, amplitude unknown"
    )
    picture = estimation_bound(curves, shares=shares, note=note)
    (folder / "estimation_bound.png").write_bytes(picture.png())
    text = json.dumps(
        {"curves": curves, "found": found, "shares": shares, "trials": trials}, indent=1
    )
    (folder / "estimation_bound.json").write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 100)
