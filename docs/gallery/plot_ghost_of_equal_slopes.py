"""
Where does a radar with equal slopes appear?
============================================

An oncoming car carries a radar with the same chirps, 40 m away. Both radars start together.
The direct wave travels 40 m one way; the receiver takes its delay for that of an echo, which
travels both ways, so that a ghost appears at 20 m, at half the range rate, far above the echo of
the car itself.
"""

import polychirp as pc

chirps = pc.Sawtooth(start_frequency=76.5e9, bandwidth=300e6, ramp_duration=20e-6, idle=5e-6)
hardware = {
    "waveform": chirps,
    "mount": pc.Pose(z=0.5),
    "array": pc.AntennaArray(num_channels=4, pattern=pc.ElementPattern(peak_gain=pc.from_db(12))),
    "if_filter": pc.IfFilter(passband=6.5e6, stopband=9e6),
    "converter": pc.Converter(sample_rate=16e6, start=2e-6, margin=0.5e-6),
}
street = pc.Street(
    vehicles=(
        pc.Vehicle(name="ego", x=0.0, y=0.0, speed=10.0, max_edge=0.5, coarseness=8.0),
        pc.Vehicle(
            name="other", x=40.0, y=0.0, heading=3.14159, speed=10.0, max_edge=0.5, coarseness=8.0
        ),
    ),
    points=(pc.Point(name="car", x=41.5, y=0.0, z=0.5, rcs=10.0, velocity=(-10.0, 0.0, 0.0)),),
)
study = pc.Study(
    name="ghost",
    street=street,
    radars=(
        pc.StudyRadar(name="front", vehicle="ego", **hardware),
        pc.StudyRadar(name="oncoming", vehicle="other", **hardware),
    ),
    victims=("front",),
    targets=("car",),
    num_sweeps=64,
    tracer=pc.FreeSpace(),
    receiver=pc.RangeDoppler(greatest_range=50.0),
)
seen = pc.run_trial(study).victim("front")

# %%
# Every detection has a cause. The strongest is the direct wave: 20 m, and 10 m/s where the car has
# 20 m/s. The weaker ones beside it are side lobes of the taper.

for distance, rate, nature in zip(
    seen.detections.range, seen.detections.range_rate, seen.score.nature, strict=True
):
    print(f"{distance:5.1f} m {rate:6.1f} m/s  {nature}")

# %%
# The parts of the samples are kept apart, so that the echo can be drawn without the interference.

profile = pc.draw("range-profile", seen, study.receiver, title="equal slopes, common start")
