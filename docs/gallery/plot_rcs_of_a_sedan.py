"""
How much does the RCS of a car depend on its aspect?
====================================================

The sedan is a mesh of metal, glass and plastic, whose echo is computed facet by facet and with
reflections between its parts. At 79 GHz neighbouring aspects differ by many decibels, because the
echoes of parts add up in phase or against each other. Therefore, models of traffic use the median
or the mean over some degrees.
"""

import matplotlib.pyplot as plt
import numpy as np

import polychirp as pc

mesh = pc.vehicle_mesh("sedan", max_edge=0.1, coarseness=2.0)
azimuth = np.radians(np.arange(0.0, 360.0, 2.0))
found = pc.cross_sections(mesh, azimuth, tracer=pc.Composite(), distance=30.0)

# %%
# Nose at 0°, left side at 90°.

rcs = found.rcs[:, 0, 0]
neighbours = np.stack([np.roll(rcs, shift) for shift in range(-2, 3)])
figure, axes = plt.subplots(subplot_kw={"projection": "polar"}, layout="constrained")
axes.plot(azimuth, pc.to_db(rcs), linewidth=0.6, label="every 2°")
axes.plot(azimuth, pc.to_db(np.median(neighbours, axis=0)), label="median over 10°")
axes.set_title("RCS of a sedan, VV (dBsm)")
axes.legend(loc="upper left", bbox_to_anchor=(-0.3, 1.1), fontsize="small")
print(f"mean over all aspects: {pc.to_db(rcs.mean()):.1f} dBsm")
