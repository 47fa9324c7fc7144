"""Beams by which the folds of a code are told apart, with elements in two rows."""

import numpy as np
import pytest
from scipy.linalg import hadamard

from polychirp.constants import SPEED_OF_LIGHT
from polychirp.model.antenna import AntennaArray
from polychirp.receiver.angle.beams import strongest_beam
from polychirp.receiver.angle.elements import Elements
from polychirp.receiver.range_doppler.fold_ambiguity import share_told_apart
from polychirp.receiver.signal_model.transmit_codes import CodeBlocks, virtual_channels

ROWS = {"line": [(0, 0), (4, 0), (8, 0)], "raised": [(0, 0), (2, 1), (4, 0)]}
"""Places of three transmitting elements, half wavelengths."""


STAGGERED = [(0, 0), (4, 1), (8, 0), (12, 1)]
"""Places of four transmitting elements, which are in the other row at every turn."""


def bands(count):
    """Weights ``(sweep, element)`` of Doppler division in ``count`` bands."""
    return np.exp(2j * np.pi * np.outer(np.arange(count), np.arange(3)) / count)


LINE, COLUMN = [(n, 0) for n in range(4)], [(0, n) for n in range(4)]
"""Places of four receiving elements."""


def margins(places, code, receivers=LINE):
    """dB by which the right fold's beam exceeds any other's, in 500 drawn directions.

    A fold m gives sweep k of the code's block a phase of 2π·mk/K, with which it is decoded.
    """
    rng, length = np.random.default_rng(1), len(code)
    sender, receiver = np.array(places), np.array(receivers)
    elements = Elements(place=0.5 * (sender[:, None] + receiver).reshape(-1, 2))
    azimuth, elevation = np.radians(rng.uniform([-50, -10], [50, 10], (500, 2))).T
    elevation *= np.ptp(elements.place[:, 1]) > 0
    cosines = np.stack([np.cos(elevation) * np.sin(azimuth), np.sin(elevation)], axis=-1)
    waves = elements.steering(cosines).reshape(-1, len(places), 4)
    received = np.einsum("kl,nlc->nkc", code.conj(), waves)
    power = []
    for fold in range(length):
        turn = np.exp(2j * np.pi * fold * np.arange(length) / length)
        apart = np.einsum("kl,k,nkc->nlc", code, turn, received).reshape(500, -1)
        power.append(strongest_beam(apart, elements))
    return 10 * np.log10(power[0] / np.max(power[1:], axis=0))


@pytest.mark.parametrize(
    ("name", "code", "least"),
    [
        ("line", np.eye(3), 1.3),
        ("raised", np.eye(3), 0.95),
        ("line", bands(4), 3.4),
        ("raised", bands(4), 3.3),
        ("raised", bands(5), 3.3),
    ],
)
def test_the_right_fold_has_the_strongest_beam(name, code, least):
    assert np.min(margins(ROWS[name], code)) > least


@pytest.mark.parametrize(("name", "share"), [("line", 0.37), ("raised", 0.61)])
def test_without_an_empty_band_another_fold_is_often_as_strong(name, share):
    """A limit that docs/explanation/limits.md states."""
    assert np.mean(margins(ROWS[name], bands(3)) < 0.5) == pytest.approx(share, abs=0.05)


def test_a_beam_that_no_wave_has_does_not_win():
    """Half of the folds turns one row, as an elevation cosine that is greater by 1 would.

    Within 10° of the horizon and beyond some 27° of azimuth no wave has it.
    """
    assert np.mean(margins(STAGGERED, np.eye(4)) > 0.1) > 0.45


@pytest.mark.parametrize(
    ("places", "receivers", "code"),
    [
        (ROWS["line"], LINE, np.eye(3)),
        (ROWS["line"], LINE, bands(3)),
        (ROWS["raised"], LINE, bands(3)),
        (STAGGERED, LINE, np.eye(4)),
        ([(0, 0), (1, 0), (2, 0)], COLUMN, np.eye(3)),
    ],
    ids=["line", "bands", "raised", "staggered", "across"],
)
def test_the_share_of_directions_that_are_told_apart_is_that_of_drawn_ones(places, receivers, code):
    """In codes without empty bands, beams alone decide. 48 directions give a share to 0.07."""
    step = 0.5 * SPEED_OF_LIGHT / 77e9
    array = AntennaArray(
        num_channels=4,
        num_transmitters=len(places),
        spacing=step,
        transmitter_positions=tuple(places),
        channel_positions=tuple(receivers),
    )
    blocks = CodeBlocks(ramps=np.zeros((1, len(code), 1), dtype=np.int64), weight=code)
    place, _ = virtual_channels(array, len(places))
    found = share_told_apart(blocks, array, Elements.of(place, frequency=77e9), by_beams=True)
    assert found == pytest.approx(np.mean(margins(places, code, receivers) > 0.2), abs=0.1)


def test_empty_bands_tell_folds_apart_without_beams():
    """Bands do if one is empty, but not the phase codes of six elements, of which a fold by half
    of the span exchanges columns of Hadamard's matrix among each other."""
    array = AntennaArray(num_channels=4, num_transmitters=6)
    place, _ = virtual_channels(array, 6)
    elements = Elements.of(place, frequency=77e9)
    bands_of_six = np.exp(2j * np.pi * np.outer(np.arange(8), np.arange(6)) / 8)
    for code, expected in ((bands_of_six, 1.0), (hadamard(8)[:, :6], 0.0)):
        blocks = CodeBlocks(
            ramps=np.zeros((1, 8, 1), dtype=np.int64), weight=code.astype(np.complex128)
        )
        assert share_told_apart(blocks, array, elements, by_beams=False) == expected
