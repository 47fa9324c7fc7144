"""
How similar are chirps of different slopes?
===========================================

Two chirps of equal slope correlate fully at one delay. With different slopes, the energy is spread:
the greatest correlation falls with the product of time, bandwidth and relative difference of the
slopes. Diversity of slopes lowers the peak of the interference, and leaves its energy.
"""

import matplotlib.pyplot as plt

import polychirp as pc


def chirp(bandwidth: float) -> pc.Baseband:
    """A chirp of 20 µs, sampled at 100 MS/s about 76.54 GHz."""
    ramp = pc.Sawtooth(start_frequency=76.5e9, bandwidth=bandwidth, ramp_duration=20e-6)
    schedule = ramp.schedule(num_sweeps=1, streams=pc.Streams(seed=1))
    return pc.played(schedule, sample_rate=100e6, centre_frequency=76.54e9)


# %%
# Correlation of a chirp of 80 MHz with itself and with less steep ones.

figure, axes = plt.subplots(figsize=(7, 4), layout="constrained")
for bandwidth in (80e6, 72e6, 40e6):
    found = pc.correlate(chirp(80e6), chirp(bandwidth))
    level = pc.to_db(found.power)
    axes.plot(found.lag * 1e6, level, linewidth=0.8, label=f"with {bandwidth / 1e6:.0f} MHz")
    print(f"{bandwidth / 1e6:.0f} MHz: greatest correlation {level.max():.1f} dB")
axes.set(xlabel="Delay (µs)", ylabel="Correlation (dB)", ylim=(-60, 3), xlim=(-20, 20))
axes.legend()
