"""Studies of small frames, on which receivers are measured in milliseconds."""

from __future__ import annotations

from polychirp.model.antenna import AntennaArray
from polychirp.model.if_filter import IfFilter
from polychirp.model.radar import Converter
from polychirp.receiver.range_doppler.chain import RangeDoppler
from polychirp.receiver.selection import AnyReceiver
from polychirp.study.spec import Study, StudyRadar
from polychirp.traffic.street import Street, Vehicle
from polychirp.waveform import AnyWaveform, Sawtooth, Triangular

CHIRPS = Sawtooth(bandwidth=200e6, ramp_duration=40e-6, idle=10e-6)
"""Chirps of 5 THz/s: a range cell of 0.8 m with the converter of `roc_study`."""

TRIANGLES = Triangular(bandwidth=200e6, ramp_duration=1e-3)


def roc_study(
    waveform: AnyWaveform = CHIRPS,
    receiver: AnyReceiver | None = None,
    *,
    num_sweeps: int = 32,
    num_channels: int = 2,
    **radar: object,
) -> Study:
    """A radar on a moving car, and another on an oncoming one.

    The sample rate leaves some 150 samples on a chirp, and 200 on a ramp of a triangle.
    """
    fast = waveform.kind == "sawtooth"
    rate = 4e6 if fast else 0.2e6
    edge = 4e-6 if fast else 1e-5
    common = {
        "waveform": waveform,
        "array": AntennaArray(num_channels=num_channels),
        "if_filter": IfFilter(passband=0.3 * rate, stopband=0.48 * rate),
        "converter": Converter(sample_rate=rate, start=0.5 * edge, margin=0.25 * edge),
    } | radar
    return Study(
        name="small",
        seed=5,
        num_sweeps=num_sweeps,
        refresh_interval=5e-3,
        street=Street(
            vehicles=(
                Vehicle(name="ego", x=0.0, y=0.0, speed=8.0, max_edge=0.5, coarseness=8.0),
                Vehicle(name="car", x=40.0, y=3.5, heading=3.14, max_edge=0.5, coarseness=8.0),
            ),
        ),
        radars=(
            StudyRadar(name="front", vehicle="ego", **common),
            StudyRadar(name="other", vehicle="car", **common),
        ),
        receiver=receiver or RangeDoppler(false_alarm_probability=1e-4),
    )
