"""
2. Your own radar
=================

From the numbers of a data sheet to a radar of polychirp, and to what it resolves.

The chirp profile of a 77 GHz radar chip is usually given by a start frequency, a slope, times and a
sample rate. This tutorial writes such a profile down, lets `check` derive what it means, and runs
it.
"""

import math

import polychirp as pc

# %%
# The profile
# -----------
#
# These numbers are typical of a medium-range radar. The samples are taken in a window of the ramp;
# the bandwidth that counts for the resolution is that of the window.

slope = 15e6 / 1e-6  # Hz/s: 15 MHz/µs
ramp_time = 40e-6  # s
idle_time = 8e-6  # s
first_sample = 6e-6  # s, after the start of the ramp
sample_rate = 12.5e6  # samples a second
num_samples = 400
num_chirps = 126  # 42 for each transmitting element

window = num_samples / sample_rate
assert first_sample + window < ramp_time
print(f"window of {window * 1e6:.0f} µs, {slope * window / 1e6:.0f} MHz")

# %%
# The radar
# ---------
#
# ``transmit_gain`` and ``receive_gain`` are those of the front end; the antenna's gain is in its
# pattern. Three transmitting and four receiving elements make a virtual array of twelve.

radar = pc.StudyRadar(
    name="front",
    vehicle="ego",
    mount=pc.Pose(x=2.4, z=0.5),
    waveform=pc.Sawtooth(
        start_frequency=76.2e9, bandwidth=slope * ramp_time, ramp_duration=ramp_time, idle=idle_time
    ),
    coding=pc.TimeDivision(),
    transmit_power=pc.from_db(12.0 - 30.0),  # 12 dBm
    transmit_gain=1.0,
    receive_gain=pc.from_db(40.0),
    noise_figure=pc.from_db(14.0),
    array=pc.AntennaArray(
        num_channels=4,
        num_transmitters=3,
        pattern=pc.ElementPattern(
            peak_gain=pc.from_db(11.0),
            azimuth_beamwidth=math.radians(100.0),
            elevation_beamwidth=math.radians(15.0),
        ),
    ),
    if_filter=pc.IfFilter(passband=5e6, stopband=7.4e6),
    converter=pc.Converter(
        sample_rate=sample_rate,
        start=first_sample,
        margin=ramp_time - first_sample - window,
    ),
)

# %%
# What it resolves
# ----------------

study = pc.Study(
    name="mine",
    street=pc.Street(
        vehicles=(pc.Vehicle(name="ego", x=0.0, y=0.0, speed=5.0, max_edge=0.5, coarseness=8.0),),
        points=(
            pc.Point(name="car", x=32.0, y=1.5, z=0.5, rcs=10.0, velocity=(1.0, 0.0, 0.0)),
            pc.Point(name="pedestrian", x=18.0, y=-3.0, z=0.5, rcs=0.2),
        ),
    ),
    radars=(radar,),
    targets=("car", "pedestrian"),
    num_sweeps=num_chirps,
    tracer=pc.FreeSpace(),
    receiver=pc.RangeDoppler(greatest_range=45.0),
)
derived = pc.check(study).radars[0]
print(f"range resolution    {derived.range_resolution[0]:.2f} m")
print(f"speed resolution    {derived.speed_resolution:.2f} m/s")
print(f"unambiguous speed   ±{derived.unambiguous_speed:.1f} m/s by Doppler alone")
print(f"speed by MIMO beams ±{derived.unfolded_speed:.1f} m/s")
print(f"greatest range      {derived.greatest_range:.0f} m, by the IF filter")
print(f"unambiguous azimuth ±{math.degrees(derived.azimuth_window):.0f}°")

# %%
# Run it
# ------

seen = pc.run_trial(study).victim("front")
for name, is_found, ratio in zip(
    seen.truth.name, seen.score.is_detected, seen.score.snr, strict=True
):
    print(f"{name:10} {'found' if is_found else 'missed'}, SNR {float(pc.to_db(ratio)):.1f} dB")

plan = pc.draw("detections", seen, study.receiver, title="my radar")

# %%
# Further
# -------
#
# ``polychirp init --radar`` lists well-known radars, and ``polychirp init --profile`` reads the
# files of TI's tools. Phase noise, leakage, a bumper and a digitiser are parts of `StudyRadar` too.
