"""Sweep time and bandwidth: equations (7) and (8) of the paper."""

import pytest

from polychirp.constants import SPEED_OF_LIGHT
from polychirp.errors import InputError
from polychirp.waveform.design import bandwidth_for, sweep_time


def test_a_sweep_lasts_its_slope_factor_in_round_trips():
    """Light needs 2·30 m / c = 0.2001 µs there and back."""
    assert sweep_time(slope_factor=1.0, greatest_range=30.0) == pytest.approx(60 / SPEED_OF_LIGHT)
    assert sweep_time(slope_factor=6.0, greatest_range=30.0) == pytest.approx(1.2008e-6, rel=1e-4)


def test_table_2_needs_a_slope_factor_in_thousands():
    """The paper's 5 to 6 give microseconds; its table's 1 to 2 ms are 5 000 to 10 000."""
    factor = 1e-3 / sweep_time(slope_factor=1.0, greatest_range=30.0)
    assert 4_900 < factor < 5_100


def test_bandwidth_and_resolution_undo_each_other():
    resolution = SPEED_OF_LIGHT / (2 * 900e6)
    assert bandwidth_for(resolution) == pytest.approx(900e6, rel=1e-15)


def test_what_is_not_positive_is_refused():
    with pytest.raises(InputError, match="slope_factor"):
        sweep_time(slope_factor=0.0, greatest_range=30.0)
    with pytest.raises(InputError, match="greatest_range"):
        sweep_time(slope_factor=5.0, greatest_range=-1.0)
    with pytest.raises(InputError, match="range_resolution"):
        bandwidth_for(0.0)
