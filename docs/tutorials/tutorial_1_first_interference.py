"""
1. First interference
=====================

In ten minutes: a street with two radars, its frame, its detections and their causes.

Everything in this tutorial is imported from ``polychirp``. Inside Python, all numbers are in SI
units, ratios are linear and angles are in radians.
"""

from dataclasses import replace

import polychirp as pc

# %%
# The street
# ----------
#
# Our car drives along x. An oncoming car, 40 m ahead on the other lane, carries a radar too. Points
# with a radar cross section stand for its body and for a pedestrian, so that the run takes a
# second; with ``tracer=pc.Composite()`` the bodies themselves would be traced.

coarse = {"max_edge": 0.5, "coarseness": 8.0}  # the meshes are not traced here
street = pc.Street(
    vehicles=(
        pc.Vehicle(name="ego", x=0.0, y=0.0, speed=14.0, **coarse),
        pc.Vehicle(name="other", x=40.0, y=3.5, heading=3.14159, speed=14.0, **coarse),
    ),
    points=(
        pc.Point(name="car", x=40.5, y=3.0, z=0.5, rcs=10.0, velocity=(-14.0, 0.0, 0.0)),
        pc.Point(name="pedestrian", x=25.0, y=-3.0, z=0.5, rcs=0.2, velocity=(0.0, 1.0, 0.0)),
    ),
)

# %%
# The radars
# ----------
#
# A radar transmits a waveform and has an antenna array, an IF filter and a converter. Both radars
# have the same chirps here: 300 MHz in 20 µs.

own_chirps = pc.Sawtooth(start_frequency=76.5e9, bandwidth=300e6, ramp_duration=20e-6, idle=5e-6)
front = pc.StudyRadar(
    name="front",
    vehicle="ego",
    mount=pc.Pose(x=2.4, z=0.5),
    waveform=own_chirps,
    array=pc.AntennaArray(num_channels=4, pattern=pc.ElementPattern(peak_gain=pc.from_db(12.0))),
    if_filter=pc.IfFilter(passband=6.5e6, stopband=9e6),
    converter=pc.Converter(sample_rate=16e6, start=2e-6, margin=0.5e-6),
)
oncoming = replace(front, name="oncoming", vehicle="other")

# %%
# The study
# ---------
#
# A study is one experiment. ``victims`` are the radars whose frames are computed, ``targets`` what
# they are to find. `check` refuses what cannot run, and says what the radars resolve.

study = pc.Study(
    name="first",
    street=street,
    radars=(front, oncoming),
    victims=("front",),
    targets=("car", "pedestrian"),
    num_sweeps=64,
    tracer=pc.FreeSpace(),
    receiver=pc.RangeDoppler(greatest_range=50.0),
)
derived = pc.check(study).radars[0]
print(f"range resolution {derived.range_resolution[0]:.2f} m")
print(f"greatest unambiguous speed {derived.unambiguous_speed:.0f} m/s")

# %%
# Run it
# ------
#
# The result of a victim holds its samples, the detections of its receiver, the truth, and the score
# that compares both. Every detection has a cause. The first run of all compiles the kernels that it
# needs, in up to a minute.

seen = pc.run_trial(study).victim("front")
for distance, rate, nature in list(
    zip(seen.detections.range, seen.detections.range_rate, seen.score.nature, strict=True)
)[:6]:
    print(f"{distance:5.1f} m {rate:6.1f} m/s  {nature}")

# %%
# The strongest detection is a ghost: the wave of the oncoming radar, which travels one way, is
# taken for an echo, which travels both ways. Its range is half the distance between the radars, and
# so is its range rate. The second one, 25 dB weaker, is a ghost too: the same wave by way of the
# other car's body, at half the length of that way. The shoulder of the profile at 15 m, 61 dB below
# the first ghost, is a side lobe of the receiver's window. The samples' parts are kept apart, so
# that the cause of each peak can be seen.

profile = pc.draw("range-profile", seen, study.receiver, title="equal chirps")

# %%
# Another slope
# -------------
#
# If the oncoming radar's chirps are steeper and follow each other at other intervals, there is no
# ghost. Its energy stays, as bursts, and raises the floor.

steeper = replace(own_chirps, bandwidth=400e6, idle=6.3e-6)
other_slope = replace(study, radars=(front, replace(oncoming, waveform=steeper, start_time=2.5e-6)))
noisy = pc.run_trial(other_slope).victim("front")
print(sorted(set(noisy.score.nature)), f"floor {float(pc.to_db(noisy.score.floor_rise)):.1f} dB up")

maps = pc.draw("range-rate", noisy, study.receiver, title="a steeper interferer")

# %%
# Keep it
# -------
#
# ``pc.save_run(folder, trial, provenance=pc.provenance(study))`` stores a run, ``pc.load_run``
# reads it, and ``pc.export`` writes it for MATLAB, ROS and other tools. ``print(pc.dump(study))``
# gives the study file for the command line; here are its first lines:

print("\n".join(pc.dump(study).splitlines()[:12]))
