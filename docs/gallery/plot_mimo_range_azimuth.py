"""
What does a MIMO radar gain in azimuth?
=======================================

Two posts stand at the same range, 20 degrees apart. Four receiving elements have a beam of 25
degrees and do not separate them. Three transmitting elements that take turns make a virtual line of
twelve elements, whose beam is three times as narrow. The range-Doppler receiver reports one
detection for both, as it reports one for each cell of range and range rate.
"""

import math
from dataclasses import replace

import polychirp as pc

RANGE = 20.0
ANGLES = (math.radians(-10.0), math.radians(10.0))

chirps = pc.Sawtooth(start_frequency=76.5e9, bandwidth=300e6, ramp_duration=20e-6, idle=5e-6)
radar = pc.StudyRadar(
    name="front",
    vehicle="ego",
    waveform=chirps,
    coding=pc.TimeDivision(),
    array=pc.AntennaArray(
        num_channels=4, num_transmitters=3, pattern=pc.ElementPattern(peak_gain=pc.from_db(12))
    ),
    if_filter=pc.IfFilter(passband=6.5e6, stopband=9e6),
    converter=pc.Converter(sample_rate=16e6, start=2e-6, margin=0.5e-6),
)
street = pc.Street(
    vehicles=(pc.Vehicle(name="ego", x=0.0, y=0.0, max_edge=0.5, coarseness=8.0),),
    points=tuple(
        pc.Point(name=f"post-{n}", x=RANGE * math.cos(a), y=RANGE * math.sin(a), z=0.0, rcs=1.0)
        for n, a in enumerate(ANGLES)
    ),
)
mimo = pc.Study(
    name="mimo",
    street=street,
    radars=(radar,),
    num_sweeps=96,
    tracer=pc.FreeSpace(),
    receiver=pc.RangeDoppler(greatest_range=40.0),
)
single = replace(
    mimo,
    radars=(replace(radar, coding=None, array=replace(radar.array, num_transmitters=1)),),
)

# %%
# Power seen from above, for both arrays; the circles are the posts.

alone = pc.run_trial(single).victim("front")
plan_of_four = pc.draw("range-azimuth", alone, single.receiver, title="4 elements")

# %%

together = pc.run_trial(mimo).victim("front")
plan_of_twelve = pc.draw("range-azimuth", together, mimo.receiver, title="12 virtual elements")
