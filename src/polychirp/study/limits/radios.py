"""Carriers, powers, mounts, elements and sample rates of radars that hardly are meant.

Every function yields a sentence for each radar that it concerns.
"""

import math
from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np

from polychirp.channel.base import AtFrequency
from polychirp.model.ramp import RampSchedule
from polychirp.study.limits.derived_radar import DerivedRadar
from polychirp.study.limits.power import eirp
from polychirp.study.spec import Study, StudyRadar, tracer_of, victim_indices
from polychirp.units import from_db, to_db

FARTHEST_MOUNT: Final = 1.0
"""Greatest distance of a radar from its vehicle, m, without a warning; chosen."""

FARTHEST_CARRIER: Final = 0.04
"""Greatest difference of a carrier from the tracer's frequency, relative, without a warning.
Chosen: powers of points are then right to 0.35 dB."""

CARRIERS: Final = (10e9, 300e9)
"""Least and greatest carrier, Hz, without a warning; chosen."""

GREATEST_EIRP: Final = from_db(55.0 - 30.0)
"""Greatest equivalent isotropically radiated power of an element, W, without a warning. It is the
peak that ETSI EN 301 091-1 allows radars on the road from 76 to 77 GHz, and EN 302 264 from 77 to
81 GHz."""


GREATEST_NOISE_FIGURE: Final = from_db(30.0)
"""Greatest noise figure, a ratio, without a warning; chosen."""


def implausible_carriers(study: Study, schedules: Sequence[RampSchedule]) -> Iterator[str]:
    """Carriers far from those of automotive radars, or from the tracer's frequency."""
    (least, most), tracer = CARRIERS, tracer_of(study, schedules)
    # a tracer of the caller's own may have no frequency
    traced = tracer.carrier if isinstance(tracer, AtFrequency) else math.nan
    for radar, schedule in zip(study.radars, schedules, strict=True):
        carrier = float(np.mean(schedule.centre_frequency))
        if not least <= carrier <= most:
            yield (
                f"'{radar.name}' transmits at {1e-9 * carrier:.3g} GHz, and radars on the road at "
                "24 to 81 GHz; check the unit of its start_frequency"
            )
        elif abs(carrier / traced - 1.0) > FARTHEST_CARRIER:
            level = 20.0 * math.log10(carrier / traced)
            yield (
                f"'{radar.name}' transmits at {1e-9 * carrier:.3g} GHz, and powers are those at "
                f"{1e-9 * traced:.3g} GHz: echoes of points are wrong by {level:+.1f} dB; set "
                "tracer.frequency to the carrier of the radars that matter"
            )


def excessive_powers(study: Study) -> Iterator[str]:
    """Radars that radiate more than radars on the road may."""
    for radar in study.radars:
        radiated = eirp(radar)
        if radiated > GREATEST_EIRP * (1 + 1e-9):
            yield (
                f"'{radar.name}' radiates an EIRP of {float(to_db(radiated)) + 30.0:.1f} dBm, and "
                "radars on the road may radiate 55 dBm; check the unit of its transmit_power, and "
                "its gains"
            )


def implausible_mounts(study: Study) -> Iterator[str]:
    """Radars far from their vehicles, such as one at 20 m instead of 2.0 m."""
    vehicles = {vehicle.name: vehicle for vehicle in study.street.vehicles}
    for radar in study.radars:
        vertex, place = vehicles[radar.vehicle].surface().vertex, radar.mount.position
        gap = float(np.linalg.norm(np.clip(place, vertex.min(axis=0), vertex.max(axis=0)) - place))
        if gap > FARTHEST_MOUNT:
            yield (
                f"'{radar.name}' is {gap:.3g} m away from '{radar.vehicle}', on which it rides; "
                "check its mount"
            )


def implausible_noise(study: Study) -> Iterator[str]:
    """Victims whose noise figure is no radar's, such as 140 dB instead of 14.0 dB."""
    for number in victim_indices(study):
        radar = study.radars[number]
        if radar.noise_figure > GREATEST_NOISE_FIGURE:
            yield (
                f"'{radar.name}' has a noise figure of "
                f"{float(to_db(radar.noise_figure)):.3g} dB, and radars on the road "
                "have 8 to 20 dB; check its noise_figure"
            )


def idle_elements(study: Study, schedules: Sequence[RampSchedule]) -> Iterator[str]:
    """Radars of whose transmitting elements the waveform drives only some."""
    for radar, schedule in zip(study.radars, schedules, strict=True):
        number, driven = radar.array.num_transmitters, schedule.num_elements
        if driven < number:
            yield (
                f"'{radar.name}' has {number} transmitting elements, of which {driven} "
                f"{'sends' if driven == 1 else 'send'}; give it a coding, such as coding.kind = "
                "'time-division', or fewer elements"
            )


def folded_beats(radar: StudyRadar, derived: DerivedRadar) -> Iterator[str]:
    """Real samples in which echoes from beyond the receiver's ranges appear within them."""
    rate, stopband = radar.converter.sample_rate, radar.if_filter.stopband
    needed = stopband + derived.beat_band[1]
    if radar.converter.is_real and rate < needed:
        yield (
            f"'{radar.name}' takes {rate / 1e6:.4g} million real samples per second, so that beats "
            f"above {rate / 2e6:.4g} MHz, which its IF filter passes up to {stopband / 1e6:.4g} "
            "MHz, fold on those of nearer echoes; set its converter.sample_rate to "
            f"'{math.ceil(needed / 1e5) / 10:g} MS/s' or more, or lower if_filter.stopband"
        )
