"""Some tens of paths replace ten thousands of facets over frequency, aperture and time.

Three vehicles and four radars, sixteen pairs. The measure is the sum over all facets, which the
tracer gives at its own frequency whatever the paths do: the cells' weights add to one, and
`test_plate_echo.py` holds that sum to the plain formula. So the tracer is run anew for every
frequency, receiver and instant.
"""

import numpy as np
import pytest

from polychirp.channel.base import without_weak
from polychirp.channel.tracers.composite import Composite
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.frames import Pose
from polychirp.model.paths import Bounce
from polychirp.model.scene import Actor
from polychirp.testing.shapes import around, transfer_at
from polychirp.traffic.vehicle import vehicle_mesh

pytestmark = pytest.mark.slow

FREQUENCY = 79e9
WAVELENGTH = SPEED_OF_LIGHT / FREQUENCY
PLACES = [(0.0, -1.75, 0.5), (2.0, 1.75, 0.6), (30.0, 1.9, 0.5), (18.0, -5.5, 0.7)]
SPEEDS = [(14.0, 0.0, 0.0), (12.0, 0.0, 0.0), (-14.0, 0.0, 0.0), (0.0, 9.0, 0.0)]
PAIRS = [(t, x) for t in range(4) for x in range(4)]


def car(body, x, y, yaw, velocity):
    mesh = vehicle_mesh(body)
    pose = Pose(x=x, y=y, yaw=yaw)
    return Actor(name=body, kind="vehicle", pose=pose, velocity=velocity, mesh=mesh)


def street(places=(), speeds=()):
    """The scene, with further radars."""
    cars = [
        car("sedan", 14.0, 1.75, np.pi + 0.02, (-14.0, 0.0, 0.0)),
        car("hatchback", 11.0, -1.9, 0.03, (12.0, 0.0, 0.0)),
        car("van", 24.0, -1.75, -0.02, (9.0, 0.5, 0.0)),
    ]
    return around(cars, [*PLACES, *places], velocities=[*SPEEDS, *speeds])


def echoes(scene, *, frequency=FREQUENCY, dynamic_range=1e20):
    """Paths over facets only, because lines of sight are much stronger; no second bounces."""
    paths = Composite(frequency=frequency, dynamic_range=1e20, max_bounces=1).trace(scene)
    owner = np.repeat(np.arange(paths.num_paths), paths.num_bounces)
    scattered = np.unique(owner[paths.bounce_kind == Bounce.SCATTERING])
    return without_weak(paths.select(scattered), scene, dynamic_range)


@pytest.fixture(scope="module")
def kept():
    """Paths within 60 dB of their pair's strongest."""
    return echoes(street(), dynamic_range=1e6)


def relative(difference, exact):
    """rms of differences over rms of the exact values, per pair: ``(pair,)`` of two tables."""
    return np.linalg.norm(difference, axis=1) / np.linalg.norm(exact, axis=1)


def compare_errors(compare, case, errors, *, median, worst):
    for which, value, limit in (
        ("median", np.median(errors), median),
        ("worst", np.max(errors), worst),
    ):
        compare(
            page="paths",
            case=f"{case}, {which} of 16 pairs",
            quantity="error of the gathered paths, ratio of amplitudes",
            expected=0.0,
            measured=float(value),
            tolerance=limit,
            source="sum over all facets",
        )


def test_a_pair_has_some_tens_of_paths(kept):
    """For the 210 000 facets of three vehicles, of which a pair sees some ten thousands."""
    counts = {
        level: [
            np.sum((paths.transmitter == t) & (paths.receiver == x))
            for paths in (without_weak(kept, street(), level),)
            for t, x in PAIRS
        ]
        for level in (1e4, 1e6)
    }
    assert np.median(counts[1e4]) < 40
    assert np.median(counts[1e6]) < 100
    assert max(counts[1e6]) < 500


def test_paths_keep_the_response_over_a_gigahertz(compare, kept):
    """−30 dB in the median; −20 dB for the worst pair."""
    frequencies = np.linspace(78.5e9, 79.5e9, 5)
    exact, found = (np.empty((16, 5), dtype=np.complex128) for _ in range(2))
    for column, frequency in enumerate(frequencies):
        anew = echoes(street(), frequency=frequency)
        for row, (t, x) in enumerate(PAIRS):
            exact[row, column] = transfer_at(anew, frequency, t, x)[0, 0]
            found[row, column] = transfer_at(kept, frequency, t, x)[0, 0]
    errors = relative(found - exact, exact)
    compare_errors(compare, "transfer over 1 GHz", errors, median=0.0316, worst=0.1)


def test_paths_keep_the_phases_of_an_array(compare, kept):
    """Four elements half a wavelength apart, each against a receiver in its place."""
    exact, found = (np.empty((16, 4), dtype=np.complex128) for _ in range(2))
    centre = kept.transfer[:, 0, 0] * np.exp(-2j * np.pi * FREQUENCY * kept.delay)
    for column, place in enumerate((-0.75, -0.25, 0.25, 0.75)):
        aside = np.array([0.0, place * WAVELENGTH, 0.0])
        turned = centre * np.exp(2j * np.pi / WAVELENGTH * kept.arrival @ aside)
        scene = street([np.array(p) + aside for p in PLACES], SPEEDS)
        anew = echoes(scene)
        for row, (t, x) in enumerate(PAIRS):
            exact[row, column] = transfer_at(anew, FREQUENCY, t, 4 + x)[0, 0]
            found[row, column] = np.sum(turned[(kept.transmitter == t) & (kept.receiver == x)])
    errors = relative(found - exact, exact)
    compare_errors(compare, "array of four elements", errors, median=0.0316, worst=0.1)


def foretold(kept, later):
    """Relative errors ``(pair,)`` of delays extrapolated by a time, s, against a new trace."""
    anew = echoes(street().at(later))
    turn = np.exp(-2j * np.pi * FREQUENCY * (kept.delay + kept.delay_rate * later))
    terms = kept.transfer[:, 0, 0] * turn
    exact = np.array([[transfer_at(anew, FREQUENCY, t, x)[0, 0]] for t, x in PAIRS])
    found = [[np.sum(terms[(kept.transmitter == t) & (kept.receiver == x)])] for t, x in PAIRS]
    return relative(np.array(found) - exact, exact)


def test_paths_foretell_a_millisecond(compare, kept):
    """The curvature of a way that is left out is worth kv²t²/R: 0.04 rad at 20 m/s and 15 m.

    Where a pair's echoes cancel, the error is as it was and the sum is small: hence the worst.
    """
    compare_errors(compare, "delays run on 0.1 ms", foretold(kept, 1e-4), median=0.01, worst=0.1)
    compare_errors(compare, "delays run on 1 ms", foretold(kept, 1e-3), median=0.1, worst=1.0)


def test_paths_do_not_foretell_ten_milliseconds(compare, kept):
    """A hundred times the curvature of 1 ms: pairs in fast motion have lost their phase."""
    errors = foretold(kept, 1e-2)
    compare_errors(compare, "delays run on 10 ms", errors, median=1.0, worst=2.0)
    assert np.max(errors) > 0.5
