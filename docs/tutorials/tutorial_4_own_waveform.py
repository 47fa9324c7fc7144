"""
4. A waveform of your own
=========================

Whatever a radar transmits becomes a list of ramps, so that a new waveform is one short class.

A waveform needs one method, ``schedule``, that returns a `RampSchedule`. No base class is needed,
and nothing has to be registered to use the class in Python.
"""

from dataclasses import dataclass, replace
from typing import Literal

import matplotlib.pyplot as plt
import numpy as np

import polychirp as pc

# %%
# The idea
# --------
#
# All chirps of a frame have one slope, so that range-Doppler processing works, but the silence
# before each chirp is drawn at random. An interferer's chirps then hit ours at other times in every
# chirp.


@dataclass(frozen=True, kw_only=True)
class Jittered:
    """Equal chirps with random intervals.

    Parameters
    ----------
    start_frequency, bandwidth : Hz
    ramp_duration : s
    idle : s, least silence between chirps
    jitter : s, greatest addition to the silence
    """

    start_frequency: float = 76.5e9
    bandwidth: float = 300e6
    ramp_duration: float = 20e-6
    idle: float = 5e-6
    jitter: float = 2e-6
    kind: Literal["jittered"] = "jittered"

    def schedule(self, *, num_sweeps: int, streams: pc.Streams) -> pc.RampSchedule:
        """Ramps of ``num_sweeps`` chirps; random numbers come from the streams alone."""
        extra = streams["waveform", "jitter"].uniform(0.0, self.jitter, num_sweeps)
        interval = self.ramp_duration + self.idle + extra
        duration = np.full(num_sweeps, self.ramp_duration)
        start = np.full(num_sweeps, self.start_frequency)
        slope = np.full(num_sweeps, self.bandwidth / self.ramp_duration)
        return pc.RampSchedule(
            start_time=np.concatenate([[0.0], np.cumsum(interval)[:-1]]),
            duration=duration,
            start_frequency=start,
            slope=slope,
            start_phase=pc.continuous_phase(duration=duration, start_frequency=start, slope=slope),
            sweep=np.arange(num_sweeps),
        )


assert isinstance(Jittered(), pc.Waveform)
ramps = Jittered().schedule(num_sweeps=64, streams=pc.Streams(seed=1))
print(f"{ramps.num_ramps} ramps in {ramps.end_time[-1] * 1e3:.2f} ms")

# %%
# Two laws that every waveform must keep
# --------------------------------------
#
# Equal streams give equal ramps, and a longer schedule begins with the ramps of a shorter one.
# The tests of polychirp demand both from each of its waveforms.

again = Jittered().schedule(num_sweeps=16, streams=pc.Streams(seed=1))
assert np.array_equal(again.start_time, ramps.start_time[:16])

# %%
# In a study
# ----------
#
# The coherent receiver adds all samples in phase, on ramps of any slopes and intervals. A point of
# 0 dBsm stands at 30 m.

front = pc.StudyRadar(
    name="front",
    vehicle="ego",
    waveform=Jittered(),  # type: ignore[arg-type]
    array=pc.AntennaArray(num_channels=2, pattern=pc.ElementPattern(peak_gain=pc.from_db(12.0))),
    if_filter=pc.IfFilter(passband=6.5e6, stopband=9e6),
    converter=pc.Converter(sample_rate=16e6, start=2e-6, margin=0.5e-6),
)
study = pc.Study(
    name="jittered",
    street=pc.Street(
        vehicles=(pc.Vehicle(name="ego", x=0.0, y=0.0, speed=5.0, max_edge=0.5, coarseness=8.0),),
        points=(pc.Point(name="post", x=30.0, y=1.0, z=0.0, rcs=1.0),),
    ),
    radars=(front,),
    targets=("post",),
    num_sweeps=32,
    tracer=pc.FreeSpace(),
    receiver=pc.CoherentReceiver(greatest_range=40.0, greatest_speed=10.0),
)
seen = pc.run_trial(study).victim("front")
print(f"found at {seen.detections.range[0]:.2f} m, {seen.detections.range_rate[0]:.2f} m/s")

# %%
# What the jitter does to the ambiguity
# -------------------------------------
#
# With equal intervals, a second speed fits the phases of all chirps: it is ambiguous. Jitter lowers
# that second peak, as the sum over the chirps of one point's phases shows: by less than 1 dB with
# 2 µs, since the chirps are still almost equally spaced, and by 8 dB with 10 µs.

wavelength = 299_792_458.0 / 76.65e9
rate = np.linspace(-100.0, 100.0, 4001)  # m/s


def response(schedule: pc.RampSchedule) -> np.ndarray:
    """Coherent sum over the ramps for a point at rest, over assumed range rates; 1 at the peak."""
    phase = 2.0 * rate[:, None] * schedule.start_time / wavelength
    return np.abs(np.exp(2j * np.pi * phase).mean(axis=1)) ** 2


figure, axes = plt.subplots(figsize=(7, 4), layout="constrained")
for label, waveform in (
    ("equal intervals", replace(Jittered(), jitter=0.0)),
    ("jitter of 2 µs", Jittered()),
    ("jitter of 10 µs", replace(Jittered(), jitter=10e-6)),
):
    schedule = waveform.schedule(num_sweeps=64, streams=pc.Streams(seed=1))
    axes.plot(rate, pc.to_db(np.maximum(response(schedule), 1e-6)), linewidth=0.8, label=label)
axes.set(xlabel="Range rate (m/s)", ylabel="Response (dB)", ylim=(-40, 2))
axes.legend()

# %%
# In study files
# --------------
#
# A study file chooses a waveform by its ``kind``. To add yours, make it a `Spec` with a ``kind`` in
# a package of your own, as the how-to *A waveform of your own, in your own package* shows.
