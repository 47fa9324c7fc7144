"""The whole frame of the paper, from scene to detections: four victims, four channels each.

    OPENBLAS_NUM_THREADS=1 python -m bench.frame [--json]

Wall time in a process that has nothing ready, and again when it has meshes and kernels ready; and
its memory at the peak. How wrong paths are that are traced only as often as they ask for, against
tracing all of them every millisecond, and the CPU-seconds that they take, with the default
``motion_error`` and with −30 dB, and with ray tubes of 2 cm on both sides:

    OPENBLAS_NUM_THREADS=1 python -m bench.frame errors
"""

import json
import resource
import sys
import time
from dataclasses import replace

import numpy as np

from polychirp.study.paper.scenarios import paper_study
from polychirp.study.spec import refresh_times, scene_of, schedules_of
from polychirp.study.trial import run_trial, trace_frame

RUNS = 4
BAND = np.linspace(78.5e9, 79.5e9, 101)


def frames():
    """Seconds of every frame and of its two halves, and the peak of memory in MB."""
    runs = []
    for number in range(RUNS):
        steps = [("scene and paths", time.perf_counter())]

        def note(what, done, _total, steps=steps):
            if what == "radars" and done == 0:
                steps.append(("signals and receivers", time.perf_counter()))

        run_trial(paper_study("conventional"), progress=note)
        ends = [began for _, began in steps[1:]] + [time.perf_counter()]
        taken = [end - began for (_, began), end in zip(steps, ends, strict=True)]
        parts = (f"{name} {t:.1f} s" for (name, _), t in zip(steps, taken, strict=True))
        print(
            "again" if number else "first",
            f"{sum(taken):.1f} s:",
            *parts,
            file=sys.stderr,
            flush=True,
        )
        runs.append(taken)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3
    print(f"peak {peak:.0f} MB", file=sys.stderr)
    return {"runs": [[round(t, 2) for t in taken] for taken in runs], "peak_mb": round(peak)}


def errors():
    """Power of the error over all times and the band, weighted by the antennas' elements."""
    study = paper_study("conventional")
    scene, plans = scene_of(study), schedules_of(study)
    moments = [scene.at(float(time)) for time in refresh_times(plans, study.refresh_interval)]
    default = study.tracer
    wide = replace(default, narrowest_tube=0.02)
    for tracers in ((default, replace(default, motion_error=1e-3)), (wide,)):
        true = [responses(tracers[0].trace(moment), moment) for moment in moments]
        right = sum(np.sum(np.abs(one) ** 2, axis=-1) for one in true)
        for tracer in tracers:
            began = time.process_time()
            followed = trace_frame(tracer, scene, plans, refresh_interval=study.refresh_interval)
            taken = time.process_time() - began
            width = f"{tracer.narrowest_tube * 1e3:g} mm"
            print(f"motion_error {tracer.motion_error:g}, tubes of {width}: {taken:.1f} CPU-s")
            wrong = sum(
                np.sum(np.abs(responses(found, moment) - one) ** 2, axis=-1)
                for found, moment, one in zip(followed, moments, true, strict=True)
            )
            for what, of in (("echoes", np.diagonal), ("others", others)):
                print(what, np.round(10 * np.log10(of(wrong) / of(right)), 1), "dB", flush=True)


def others(power):
    """Interference of all other transmitters, ``(receiver,)``."""
    return power.sum(axis=0) - np.diagonal(power)


def responses(paths, scene):
    """V–V over `BAND`, elements' gains included, ``(transmitter, receiver, frequency)``."""
    amplitude = paths.transfer[:, 0, 0].copy()
    ends = (paths.transmitter, paths.departure), (paths.receiver, paths.arrival)
    for end, direction in ends:
        for number, radar in enumerate(scene.radars):
            mine = end == number
            local = direction[mine] @ scene.radar_rotation[number]
            amplitude[mine] *= np.sqrt(radar.array.pattern.gain(local))
    wave = amplitude[:, None] * np.exp(-2j * np.pi * paths.delay[:, None] * BAND)
    found = np.zeros((len(scene.radars), len(scene.radars), len(BAND)), dtype=complex)
    np.add.at(found, (paths.transmitter, paths.receiver), wave)
    return found


if __name__ == "__main__":
    if "errors" in sys.argv[1:]:
        errors()
    else:
        measured = frames()
        if "--json" in sys.argv[1:]:
            print(json.dumps(measured))
