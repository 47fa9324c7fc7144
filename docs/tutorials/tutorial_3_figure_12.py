"""
3. Detection probability over the number of targets
===================================================

Figure 12 of the paper, in small: many random streets, with the conventional and the diverse
waveform.

The paper draws random traffic, counts how many targets are found, and compares its proposal,
triangles whose slope is drawn anew for every sweep, with conventional triangles. Here each target
is a point, there are two numbers of targets and few trials, so that it runs in seconds. The whole
figure is ``polychirp study studies/paper/fig12-13.toml``: some ten minutes with points, and
hours with traced bodies.
"""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt

import polychirp as pc

# %%
# The study file
# --------------
#
# A table ``[monte_carlo]`` asks for trials at every point of a grid. Trials of the same number have
# the same street and the same noise at all points, so that waveforms are compared fairly.

STUDY = """
name = "figure-12-in-small"
num_sweeps = 4
refresh_interval = "20 ms"
victims = ["front"]

[tracer]
kind = "free-space"

[defaults.radar]
array = { num_channels = 4 }
if_filter = { passband = "300 kHz", stopband = "700 kHz" }
converter = { sample_rate = "1 MS/s" }

[defaults.radar.waveform]
kind = "triangular"
bandwidth = "1 GHz"
ramp_duration = "1 ms"

[[street.vehicles]]
name = "ego"
x = "0 m"
y = "-1.75 m"
speed = "50 km/h"
coarseness = 8.0
max_edge = "0.5 m"

[traffic]
seen_from = "ego"
num_targets = 2
num_carriers = 2
num_interferers = 2
shape = "points"
coarseness = 8.0
max_edge = "0.5 m"

[[radars]]
name = "front"
vehicle = "ego"
mount = { x = "2.4 m", z = "0.5 m" }

[monte_carlo]
trials = 10

[monte_carlo.grid]
"traffic.num_targets" = [2, 6]

[[monte_carlo.axes]]
name = "waveform"

[[monte_carlo.axes.values]]
label = "conventional"
set = { "radars.*.waveform.kind" = "triangular" }

[[monte_carlo.axes.values]]
label = "diverse"

[monte_carlo.axes.values.set."radars.*.waveform"]
kind = "diverse-triangular"
bandwidth = ["800 MHz", "1 GHz"]
ramp_duration = ["1 ms", "2 ms"]
"""

# %%
# The trials
# ----------
#
# ``polychirp study`` does the same from the command line. Finished trials are kept in the folder,
# so that a run that was stopped continues.

with tempfile.TemporaryDirectory() as name:
    folder = Path(name)
    (folder / "study.toml").write_text(STUDY, encoding="utf-8")
    plan = pc.load_plan(folder / "study.toml")
    print(len(plan.points), "points,", plan.trials, "trials each")
    results = pc.run_plan(
        plan,
        folder=folder,
        executor=pc.LocalWorkers(count=1),
    ).results

# %%
# The figure
# ----------
#
# Each row of a summary is one point of the grid, with 95 % intervals. Ten trials give wide ones.

figure, (detection, ghosts) = plt.subplots(1, 2, figsize=(9, 4), layout="constrained")
for label, style in (("conventional", "o-"), ("diverse", "s--")):
    rows = [row for row in pc.summaries(results) if row.labels[1] == label]
    numbers = [row.labels[0] for row in rows]
    for axes, estimates in (
        (detection, [row.detection for row in rows]),
        (ghosts, [row.ghosts for row in rows]),
    ):
        values = [one.value for one in estimates]
        below = [one.value - one.low for one in estimates]
        above = [one.high - one.value for one in estimates]
        axes.errorbar(numbers, values, yerr=(below, above), fmt=style, capsize=3, label=label)
    print(label, [f"{row.detection.value:.2f}, {row.ghosts.value:.1f} ghosts" for row in rows])
detection.set(xlabel="Targets", ylabel="Detection probability", ylim=(0, 1.05), xticks=numbers)
ghosts.set(xlabel="Targets", ylabel="Ghosts in a frame", ylim=(0, None), xticks=numbers)
detection.legend()

# %%
# With equal slopes and a common start, the interferers appear as ghosts. With slopes drawn anew for
# every sweep there are hardly any: the interference is spread over all ranges instead.
