"""Samples of a run as SigMF recordings, one for each victim."""

import json
from hashlib import sha512
from pathlib import Path
from typing import Any

import numpy as np

from polychirp.capture.sigmf import DATA, META, RAMP_FIELDS, SIGMF_EXTENSION, SIGMF_VERSION
from polychirp.errors import CapabilityError
from polychirp.model.if_frame import IfFrame
from polychirp.study.store.load import StoredRun, StoredVictim


def write_sigmf_samples(run: StoredRun, folder: Path) -> list[Path]:
    """Write ``victim-0.sigmf-meta`` and ``.sigmf-data`` and so on, and return their paths.

    The samples are those of the IF, V, as 32-bit floats, the channels in turns. A capture begins at
    each ramp, since the converter rests between ramps, and an annotation spans it; the namespace
    ``polychirp:`` holds the ramps, as `capture.sigmf` reads them, and the time of each ramp's first
    sample. Padding after short ramps is left out.
    """
    for victim in run.victims:
        if victim.frame.schedule.code is not None:
            raise CapabilityError(
                f"the ramps of '{victim.name}' carry a code, which SigMF files here do not hold; "
                "export the run in another format"
            )
    written = []
    for number, victim in enumerate(run.victims):
        path = folder / f"victim-{number}{DATA}"
        is_sample = victim.frame.times.is_sample
        samples = victim.frame.samples[:, is_sample].T.astype("<c8")  # (sample, channel)
        data = np.ascontiguousarray(samples).tobytes()
        path.write_bytes(data)
        meta = path.with_suffix(META)
        text = json.dumps(_metadata(victim, data), indent=1, ensure_ascii=False)
        meta.write_text(text + "\n", encoding="utf-8")
        written += [meta, path]
    return written


def _metadata(victim: StoredVictim, data: bytes) -> dict[str, Any]:
    times, schedule = victim.frame.times, victim.frame.schedule
    first = np.concatenate([[0], np.cumsum(times.num_samples)]).tolist()
    centre = schedule.centre_frequency.tolist()
    ramps = range(schedule.num_ramps)
    return {
        "global": {
            "core:datatype": "cf32_le",
            "core:sample_rate": times.rate,
            "core:version": SIGMF_VERSION,
            "core:num_channels": victim.frame.samples.shape[0],
            "core:sha512": sha512(data).hexdigest(),
            "core:recorder": "polychirp",
            "core:description": f"dechirped samples of the radar '{victim.name}', V",
            "core:extensions": [SIGMF_EXTENSION],
            "polychirp:num_samples": first[-1],
            "polychirp:schedule": {
                field: getattr(schedule, field).tolist() for field in RAMP_FIELDS
            },
            **_elements(victim.frame),
            **_high_pass(victim.frame),
        },
        "captures": [
            {"core:sample_start": first[k], "polychirp:start_time": float(times.first[k])}
            for k in ramps
        ],
        "annotations": [
            {
                "core:sample_start": first[k],
                "core:sample_count": int(times.num_samples[k]),
                "core:label": f"ramp {k}",
                "core:comment": f"centre {centre[k] / 1e9:.6f} GHz, "
                f"slope {schedule.slope[k] / 1e12:.6f} MHz/us",
            }
            for k in ramps
        ],
    }


def _high_pass(frame: IfFrame) -> dict[str, Any]:
    """Corners of the high-pass filter, Hz, whose phase is in the samples; nothing without one."""
    if frame.high_pass is None:
        return {}
    return {"polychirp:high_pass": list(frame.high_pass.corners)}


def _elements(frame: IfFrame) -> dict[str, Any]:
    """Places of the elements, m, and weights of those that transmit, real and imaginary parts."""
    weight = frame.schedule.transmit_weight
    return {
        "polychirp:channel_position": frame.array.position.tolist(),
        "polychirp:transmit_position": frame.array.transmit_position.tolist(),
        "polychirp:transmit_weight": {"real": weight.real.tolist(), "imag": weight.imag.tolist()},
    }
