"""
What does mitigation give back?
===============================

The chirps of an oncoming radar are steeper than ours and follow each other at other intervals. It
crosses the IF band in some of our chirps, as a burst of 2.6 microseconds, and raises the floor of
the range-rate map. Blanking sets the bursts to zero; the pedestrian stands out again, and the gaps
cost little power.
"""

import polychirp as pc

own = pc.Sawtooth(start_frequency=76.5e9, bandwidth=300e6, ramp_duration=20e-6, idle=5e-6)
other = pc.Sawtooth(start_frequency=76.5e9, bandwidth=400e6, ramp_duration=20e-6, idle=6.3e-6)
hardware = {
    "mount": pc.Pose(z=0.5),
    "array": pc.AntennaArray(num_channels=4, pattern=pc.ElementPattern(peak_gain=pc.from_db(12))),
    "if_filter": pc.IfFilter(passband=6.5e6, stopband=9e6),
    "converter": pc.Converter(sample_rate=16e6, start=2e-6, margin=0.5e-6),
}
street = pc.Street(
    vehicles=(
        pc.Vehicle(name="ego", x=0.0, y=0.0, speed=10.0, max_edge=0.5, coarseness=8.0),
        pc.Vehicle(
            name="other", x=60.0, y=3.5, heading=3.14159, speed=10.0, max_edge=0.5, coarseness=8.0
        ),
    ),
    points=(pc.Point(name="pedestrian", x=40.0, y=-3.0, z=0.5, rcs=0.2),),
)
study = pc.Study(
    name="mitigation",
    street=street,
    radars=(
        pc.StudyRadar(name="front", vehicle="ego", waveform=own, **hardware),
        pc.StudyRadar(
            name="oncoming", vehicle="other", waveform=other, start_time=2.5e-6, **hardware
        ),
    ),
    victims=("front",),
    targets=("pedestrian",),
    num_sweeps=64,
    tracer=pc.FreeSpace(),
    receiver=pc.RangeDoppler(greatest_range=50.0, mitigation=pc.Blanking()),
)
seen = pc.run_trial(study).victim("front")

# %%
# Power ratios in the pedestrian's cell: own echo over noise, interference over noise, and own echo
# over all else before and after blanking.

score = seen.score
for name, ratio in (
    ("SNR", score.snr),
    ("INR", score.inr),
    ("SINR", score.snr / (1.0 + score.inr)),
    ("SINR after blanking", score.mitigated_sinr),
):
    print(f"{name:20} {pc.to_db(ratio)[0]:5.1f} dB")

# %%
# One map for each part of the samples, for their sum, and for what the receiver reads.

maps = pc.draw("range-rate", seen, study.receiver, title="a steeper radar, with blanking")
