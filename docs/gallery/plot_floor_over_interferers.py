"""
How much does each further radar raise the floor?
=================================================

Radars with other slopes and intervals cross the IF band as bursts, in some chirps and not in
others. The energies of the bursts add up, so that the floor grows by 3 dB when the number of
equally strong radars doubles.
"""

import matplotlib.pyplot as plt

import polychirp as pc

hardware = {
    "mount": pc.Pose(z=0.5),
    "array": pc.AntennaArray(
        num_channels=2, pattern=pc.ElementPattern(peak_gain=pc.from_db(10), azimuth_beamwidth=2.0)
    ),
    "if_filter": pc.IfFilter(passband=6.5e6, stopband=9e6),
    "converter": pc.Converter(sample_rate=16e6, start=2e-6, margin=0.5e-6),
}


def study(num_interferers: int) -> pc.Study:
    """Our radar, and others 80 m ahead whose chirps are 20 % steeper."""
    radars = [
        pc.StudyRadar(
            name="front",
            vehicle="ego",
            waveform=pc.Sawtooth(
                start_frequency=76.5e9, bandwidth=300e6, ramp_duration=20e-6, idle=5e-6
            ),
            **hardware,
        )
    ]
    radars += [
        pc.StudyRadar(
            name=f"other-{n}",
            vehicle=f"car-{n}",
            waveform=pc.Sawtooth(
                start_frequency=76.5e9,
                bandwidth=360e6,
                ramp_duration=20e-6,
                idle=(5.3 + 0.7 * n) * 1e-6,
            ),
            num_sweeps=80,
            **hardware,
        )
        for n in range(num_interferers)
    ]
    coarse = {"max_edge": 0.5, "coarseness": 8.0}
    others = [
        pc.Vehicle(name=f"car-{n}", x=80.0, y=4.0 * n - 14.0, heading=3.14159, **coarse)
        for n in range(num_interferers)
    ]
    return pc.Study(
        name="floor",
        street=pc.Street(vehicles=(pc.Vehicle(name="ego", x=0.0, y=0.0, **coarse), *others)),
        radars=tuple(radars),
        victims=("front",),
        num_sweeps=64,
        tracer=pc.FreeSpace(),
        receiver=pc.RangeDoppler(greatest_range=50.0),
    )


# %%
# The rise of the floor over that of noise alone.

numbers = [1, 2, 4, 8]
rises = [float(pc.to_db(pc.run_trial(study(n)).victim("front").score.floor_rise)) for n in numbers]
for number, rise in zip(numbers, rises, strict=True):
    print(f"{number} radars: {rise:.1f} dB")

figure, axes = plt.subplots(figsize=(6, 4), layout="constrained")
axes.plot(numbers, rises, "o-")
axes.set(xscale="log", xlabel="Other radars", ylabel="Rise of the floor (dB)")
axes.set_xticks(numbers, [str(n) for n in numbers])
axes.minorticks_off()
