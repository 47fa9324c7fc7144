"""
Which SNR does a detection need?
================================

A point at a random place is drawn in many frames, at several signal-to-noise ratios, and read by
the range-Doppler receiver. Beside its detection probability is that of the ideal detector, which
knows the place of the point. The taper of each of the two transforms costs 1.8 dB.
"""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import polychirp as pc

radar = pc.StudyRadar(
    name="front",
    vehicle="ego",
    waveform=pc.Sawtooth(bandwidth=200e6, ramp_duration=40e-6, idle=10e-6),
    array=pc.AntennaArray(num_channels=2),
    if_filter=pc.IfFilter(passband=1.2e6, stopband=1.92e6),
    converter=pc.Converter(sample_rate=4e6, start=2e-6, margin=1e-6),
)
study = pc.Study(
    name="roc",
    street=pc.Street(
        vehicles=(pc.Vehicle(name="ego", x=0.0, y=0.0, max_edge=0.5, coarseness=8.0),)
    ),
    radars=(radar,),
    num_sweeps=32,
    receiver=pc.RangeDoppler(false_alarm_probability=1e-4),
)
plan = pc.roc_plan(study, snrs_db=(10.0, 12.0, 14.0, 16.0, 18.0, 20.0), trials=60, noise_trials=20)

# %%
# 380 frames; those that were computed before are read again from the folder.

with tempfile.TemporaryDirectory() as folder:
    found = pc.run_roc(
        plan,
        folder=Path(folder),
        executor=pc.LocalWorkers(count=1),
    ).summary

# %%
# Detection probability with 95 % intervals.

points = found.of_curve(0)
share = np.array([point.detection.value for point in points])
low = np.array([point.detection.low for point in points])
high = np.array([point.detection.high for point in points])
snr = np.array([point.snr_db for point in points])
figure, axes = plt.subplots(figsize=(6, 4), layout="constrained")
axes.errorbar(snr, share, yerr=(share - low, high - share), fmt="o-", label="range-Doppler")
axes.plot(found.lines[0].snr_db, found.lines[0].ideal, "--", label="ideal detector")
axes.set(xlabel="Coherent SNR (dB)", ylabel="Detection probability", ylim=(0, 1.02))
axes.legend()
