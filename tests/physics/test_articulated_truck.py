"""The articulated truck's flat side and rear flash as plates; its trailer turns the flash."""

import numpy as np
import pytest
from scipy.special import fresnel

from polychirp.channel.rcs import cross_sections, far_distance
from polychirp.channel.tracers.composite import Composite
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.testing.shapes import around, transfer_at
from polychirp.traffic.street import Vehicle
from polychirp.traffic.vehicle import vehicle_mesh
from polychirp.units import from_db, to_db

WAVELENGTH = SPEED_OF_LIGHT / 79e9
TRACER = Composite(dynamic_range=1e30, max_length=np.inf, max_bounces=1)
LOW, HIGH = 1.2, 4.0  # of the trailer's box, m


def gain(eye, articulation=0.0):
    """Power of the echo of a truck at the origin over the transmitted power, dB."""
    truck = Vehicle(name="t", body="articulated-truck", x=0.0, y=0.0, articulation=articulation)
    bodies = [body for body in (truck.actor(), truck.trailer()) if body is not None]
    echo = transfer_at(TRACER.trace(around(bodies, [eye])), 79e9)[0, 0]
    return float(to_db(np.abs(echo) ** 2))


def plate_gain(distance, ends, levels):
    """Power of the echo of a rectangle over the transmitted power, dB, by Fresnel's integrals.

    A mirror returns λ / (8πd). The path there and back grows with (y² + z²) / d, so that a side
    from a to b has the factor |∫ e^(−jπt²/2) dt| / √2 from a √(4/λd) to b √(4/λd).
    """

    def share(first, last):
        scale = np.sqrt(4 / (WAVELENGTH * distance))
        (s1, c1), (s2, c2) = fresnel(first * scale), fresnel(last * scale)
        return np.hypot(c2 - c1, s2 - s1) / np.sqrt(2)

    return float(to_db((WAVELENGTH / (8 * np.pi * distance) * share(*ends) * share(*levels)) ** 2))


@pytest.mark.parametrize(("distance", "along", "height"), [(30, -2, 2.5), (12, 0, 1.6)])
def test_abeam_the_trailer_echoes_as_a_plate_of_its_size(compare, distance, along, height):
    """Beside the box; the tractor and the wheels do not face the radar."""
    compare(
        page="road-users",
        quantity="gain from a radar to itself, dB",
        case=f"articulated truck at {distance} m, abeam, {height:g} m high",
        source="plate 13.6 m by 2.8 m by Fresnel's integrals",
        expected=plate_gain(
            distance - 1.275, (-8.25 - along, 5.35 - along), (LOW - height, HIGH - height)
        ),
        measured=gain((float(along), float(distance), float(height))),
        tolerance=0.5,
    )


def test_behind_the_trailer_its_rear_echoes_as_a_plate(compare):
    compare(
        page="road-users",
        quantity="gain from a radar to itself, dB",
        case="articulated truck at 20 m, from behind, 2 m high",
        source="plate 2.55 m by 2.8 m by Fresnel's integrals",
        expected=plate_gain(20 - 8.25, (-1.275, 1.275), (LOW - 2.0, HIGH - 2.0)),
        measured=gain((-20.0, 0.0, 2.0)),
        tolerance=0.5,
    )


def test_far_away_the_side_has_the_cross_section_of_its_area(compare):
    """4πA²/λ² of 13.6 m by 2.8 m straight on, and its first side lobe at 1.43 λ/2L."""
    mesh = vehicle_mesh("articulated-truck")
    lobe = 1.4303 * WAVELENGTH / (2 * 13.6)
    found = cross_sections(
        mesh,
        np.pi / 2 + np.array([0.0, lobe]),
        tracer=TRACER,
        distance=far_distance(mesh, 79e9),
    )
    peak = to_db(4 * np.pi * (13.6 * 2.8 / WAVELENGTH) ** 2)
    for number, (case, expected) in enumerate([("side", peak), ("side, first lobe", peak - 13.26)]):
        compare(
            page="road-users",
            quantity="RCS of an articulated truck, far field, dBsm",
            case=case,
            source="4πA²/λ² sinc²",
            expected=float(expected),
            measured=float(to_db(found.rcs[number, 0, 0])),
            tolerance=0.5,
        )


def test_the_flash_turns_with_the_trailer():
    """Seen along the normal of the side of a trailer that is turned by 20° about its king pin.

    From there, only edges and curved parts of the straight truck echo, at least 20 dB less. Wheels
    and other parts beat with the side by half a decibel from centimetre to centimetre, so the mean
    power over five places counts.
    """
    turn = np.radians(20.0)
    pin = np.array([3.75, 0.0])
    along, normal = np.array([np.cos(turn), np.sin(turn)]), np.array([-np.sin(turn), np.cos(turn)])
    shifts = np.arange(-2, 3) * 0.01
    eyes = [(*map(float, pin - (5.0 + by) * along + 30.0 * normal), 2.5) for by in shifts]
    bent = to_db(np.mean([from_db(gain(eye, articulation=turn)) for eye in eyes]))
    straight = max(gain(eye) for eye in eyes)
    expected = plate_gain(30 - 1.275, (-7.0, 6.6), (LOW - 2.5, HIGH - 2.5))
    assert bent == pytest.approx(expected, abs=0.4)
    assert straight < bent - 20.0
