import numpy as np

from polychirp.model.detection import Detections
from polychirp.model.spectra import RangeRateMap
from polychirp.report.figures.range_rate import COLOUR_SPAN_DB, range_rate_picture


def picture(num_detections: int = 2):
    """Noise of 1e-9 with a moving and a still point."""
    power = np.random.default_rng(1).exponential(1e-9, size=(16, 20))
    power[12, 5] = power[8, 9] = 1e-2
    map_ = RangeRateMap(power=power, range_rate=np.arange(-8.0, 8.0), range=0.5 * np.arange(20))
    found = Detections(
        time=0.0,
        range=np.array([2.5, 4.5])[:num_detections],
        range_rate=np.array([4.0, 0.0])[:num_detections],
        azimuth=np.array([0.1, -0.1])[:num_detections],
        power=np.array([1e-2, 1e-2])[:num_detections],
        snr=np.array([1e7, 1e7])[:num_detections],
    )
    return map_, range_rate_picture(map_, found, title="walk", note="no ground truth")


def test_the_data_are_the_whole_map():
    map_, drawing = picture()
    assert list(drawing.data) == ["range_m", "range_rate_m_per_s", "power_dbfs"]
    level = np.asarray(drawing.data["power_dbfs"]).reshape(map_.power.shape)
    np.testing.assert_allclose(level, 10 * np.log10(map_.power))


def test_colours_begin_at_the_noise_and_axes_have_units():
    map_, drawing = picture()
    left, right, *_ = drawing.figure.axes
    low, high = left.collections[0].get_clim()
    assert low == np.median(10 * np.log10(map_.power))
    assert high - low == COLOUR_SPAN_DB
    assert left.get_xlabel() == "Range rate (m/s), positive = away"
    assert left.get_ylabel() == "Range (m)"
    assert right.get_ylabel() == "Ahead (m)"


def test_a_detection_on_the_left_is_drawn_on_the_left():
    """Azimuth is positive to the left; the picture looks ahead, so left is negative across."""
    _, drawing = picture()
    moving = {line.get_label(): line for line in drawing.figure.axes[1].lines}["detected, moving"]
    assert moving.get_xdata() < 0
    assert moving.get_ydata() > 0


def test_a_map_without_detections_is_drawn():
    _, drawing = picture(num_detections=0)
    assert drawing.png().startswith(b"\x89PNG")
