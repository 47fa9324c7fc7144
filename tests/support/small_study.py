"""A study whose trials last a tenth of a second: two radars and two points in free space."""

from __future__ import annotations

from typing import Final

SMALL_STUDY: Final = """
name = "small"
num_sweeps = 2
refresh_interval = "5 ms"
victims = ["front"]
targets = ["near", "far"]

[tracer]
kind = "free-space"

[defaults.radar]
transmit_power = "10 dBm"

[defaults.radar.array]
num_channels = 2

[defaults.radar.waveform]
kind = "triangular"
bandwidth = "200 MHz"
ramp_duration = "200 us"

[defaults.radar.if_filter]
passband = "300 kHz"
stopband = "450 kHz"

[defaults.radar.converter]
sample_rate = "1 MS/s"
start = "10 us"
margin = "10 us"

[[street.vehicles]]
name = "ego"
x = "0 m"
y = "0 m"
coarseness = 4.0

[[street.vehicles]]
name = "other"
x = "14 m"
y = "3.5 m"
heading = "180 deg"
coarseness = 4.0

[[street.points]]
name = "near"
x = "9 m"
y = "0 m"
z = "0.5 m"
rcs = "-10 dBsm"

[[street.points]]
name = "far"
x = "18 m"
y = "-1 m"
z = "0.5 m"
rcs = "-10 dBsm"

[[radars]]
name = "front"
vehicle = "ego"
mount = { x = "2.33 m", z = "0.5 m" }

[[radars]]
name = "other"
vehicle = "other"
mount = { x = "2.33 m", z = "0.5 m" }

[receiver]
greatest_range = "30 m"
greatest_speed = "20 km/h"
false_alarm_probability = 1e-4
"""

SMALL_GRID: Final = """
[monte_carlo]
trials = 12

[monte_carlo.grid]
"street.points.1.rcs" = ["-10 dBsm", "10 dBsm"]

[[monte_carlo.axes]]
name = "waveform"

[[monte_carlo.axes.values]]
label = "conventional"
set = { "radars.*.waveform.kind" = "triangular" }

[[monte_carlo.axes.values]]
label = "diverse"

[monte_carlo.axes.values.set."radars.*.waveform"]
kind = "diverse-triangular"
bandwidth = ["150 MHz", "250 MHz"]
ramp_duration = ["150 us", "250 us"]
"""
"""Four points: the far target weak or strong, the waveform conventional or diverse."""
