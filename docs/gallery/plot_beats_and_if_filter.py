"""
How long does an interferer stay in the IF band?
================================================

The beat of an interferer is the difference of two frequencies. If the slopes differ by
:math:`\\mu`, it sweeps through a band of :math:`\\pm f` within :math:`2f/|\\mu|`. With equal slopes
it stays where it is, as an echo does.
"""

import matplotlib.pyplot as plt
import numpy as np

import polychirp as pc

ramp = 20e-6  # s
slope = 300e6 / ramp  # Hz/s, of the victim
band = pc.IfFilter(passband=6.5e6, stopband=9e6)
time = np.linspace(0.0, ramp, 400)

# %%
# Left: beats of radars that start up to 1 µs after the victim, or 4 µs before it. Right: the
# response of the IF filter over the same beats.

figure, (beats, response) = plt.subplots(
    1, 2, sharey=True, width_ratios=(3, 1), figsize=(8, 4), layout="constrained"
)
for label, factor, lead in (
    ("equal slope, 0.2 µs later", 1.0, -0.2e-6),
    ("10 % steeper, 1 µs later", 1.1, -1e-6),
    ("falling, 4 µs earlier", -1.0, 4e-6),
):
    start = 0.0 if factor > 0 else 300e6  # Hz above the victim's lowest frequency
    other = start + factor * slope * (time + lead)
    beats.plot(time * 1e6, (slope * time - other) / 1e6, label=label)
beats.axhspan(-6.5, 6.5, alpha=0.15, label="pass band")
beats.set(xlabel="Time on the ramp (µs)", ylabel="Beat (MHz)", ylim=(-40, 40))
beats.legend(loc="lower left", fontsize="small")

frequency = np.linspace(-40e6, 40e6, 801)
level = np.maximum(2.0 * pc.to_db(np.abs(band.response(frequency))), -100.0)
response.plot(level, frequency / 1e6)
response.set(xlabel="Filter (dB)", xlim=(-105, 5))

# %%
# The durations in the band, from the law above:

for label, factor in (("10 % steeper", 1.1), ("falling", -1.0)):
    mu = slope * (1.0 - factor)
    print(f"{label}: {2 * 6.5e6 / abs(mu) * 1e6:.2f} µs")
