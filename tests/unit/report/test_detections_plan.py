"""The plan of detections: what its marks and labels say, and that they can be read."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from matplotlib.text import Text

from polychirp.model.detection import Detections
from polychirp.model.score import Score
from polychirp.model.truth import Truth
from polychirp.report.figures.detections_plan import MARKS, detections_plan
from polychirp.scoring.causes import Nature


def truth_of(*targets):
    """Targets of a name and range, and of -3 m/s straight ahead; all are visible."""
    names, ranges = zip(*targets, strict=True)
    zeros = np.zeros(len(names))
    return Truth(
        time=0.0,
        name=names,
        range=ranges,
        range_rate=zeros - 3.0,
        azimuth=zeros,
        elevation=zeros,
        point=np.zeros((len(names), 3)),
        is_visible=np.full(len(names), True),
    )


def score_of(truth, *, found, in_sight=None, causes=(), radar=()):
    """Score of the targets that are found, and of detections of pairs of nature and body."""
    nothing = np.zeros(len(truth.name))
    is_detected = np.array([name in found for name in truth.name])
    names = truth.name if in_sight is None else in_sight
    levels = ("detection_sinr", "echo_snr", "snr", "inr", "mitigated_sinr", "num_points")
    errors = ("range_error", "range_rate_error", "azimuth_error", "elevation_error")
    extents = ("length", "width", "range_rate_span")
    return Score(
        is_detected=is_detected,
        is_in_sight=np.array([name in names for name in truth.name]),
        **dict.fromkeys((*levels, *errors, *extents), nothing),
        nature=tuple(nature for nature, _ in causes),
        body=tuple(body for _, body in causes),
        radar=radar,
        power=np.zeros(len(causes)),
        target_detection=(),
        num_missed=0,
        floor_rise=1.0,
    )


def detections_at(*places):
    """Detections at pairs of range and range rate, straight ahead."""
    range_, rate = np.reshape(places, (-1, 2)).T
    return Detections(
        time=0.0,
        range=range_,
        range_rate=rate,
        azimuth=np.zeros(range_.size),
        power=np.ones(range_.size),
        snr=np.ones(range_.size),
    )


def legend_of(drawing):
    return [text.get_text() for text in drawing.figure.legends[0].get_texts()]


def test_a_target_out_of_sight_is_not_called_missed():
    """Only a target in sight counts as missed (`scoring.sight`)."""
    truth = truth_of(("near", 10.0), ("weak", 30.0), ("far", 60.0))
    score = score_of(truth, found=["near"], in_sight=["near", "weak"])
    drawing = detections_plan(detections_at(), truth, score, title="plan")
    texts = {text.get_text() for text in drawing.figure.axes[0].texts}
    assert texts == {"near", "weak, missed", "far, out of sight"}


def test_an_echo_of_a_target_beside_its_metal_is_not_another_body():
    truth = truth_of(("van", 20.0))
    causes = [("target", "van"), ("body", "van"), ("body", "bus")]
    found = detections_at((20.0, -3.0), (23.0, -3.0), (40.0, -3.0))
    drawing = detections_plan(found, truth, score_of(truth, found=["van"], causes=causes), title="")
    places = {line.get_label(): line.get_ydata() for line in drawing.figure.axes[1].lines}
    assert places["target, beside its visible metal"] == [23.0]
    assert places["another body"] == [40.0]
    assert list(drawing.data["nature"]) == ["target", "body", "body"]


def test_what_is_above_the_radar_is_seen_from_above():
    """A sign 6 m above the radar, at a slant range of 10 m, is 8 m ahead of it."""
    height = np.full(1, np.arcsin(0.6))
    truth = replace(truth_of(("sign", 10.0)), elevation=height)
    found = replace(detections_at((10.0, -3.0)), elevation=height)
    score = score_of(truth, found=["sign"], causes=[("target", "sign")])
    left = detections_plan(found, truth, score, title="").figure.axes[0]
    places = {line.get_label(): line.get_ydata() for line in left.lines}
    assert places["target found"] == pytest.approx([8.0])
    assert left.texts[0].xy == pytest.approx((0.0, 8.0))


def test_without_another_body_the_legend_has_none():
    truth = truth_of(("van", 20.0))
    score = score_of(truth, found=["van"], causes=[("body", "van")])
    drawing = detections_plan(detections_at((23.0, -3.0)), truth, score, title="")
    assert legend_of(drawing) == ["visible metal", "target, beside its visible metal"]


def test_every_nature_has_a_mark_of_its_own():
    assert {nature.value for nature in Nature} <= set(MARKS)
    assert len({(marker, colour) for marker, colour, _ in MARKS.values()}) == len(MARKS)


def test_a_folded_echo_is_not_a_ghost():
    truth = truth_of(("van", 20.0))
    score = score_of(truth, found=[], causes=[("folded", "van")])
    drawing = detections_plan(detections_at((20.0, 18.0)), truth, score, title="")
    assert legend_of(drawing) == ["visible metal", "echo at a folded range rate"]


def test_a_good_detection_of_one_target_looks_good():
    """An error of 5 mm and 5 mm/s is less than a hundredth of the axes."""
    truth = truth_of(("post", 12.0))
    score = score_of(truth, found=["post"], causes=[("target", "post")])
    drawing = detections_plan(detections_at((12.005, -2.995)), truth, score, title="")
    right = drawing.figure.axes[1]
    for low, high in (right.get_xlim(), right.get_ylim()):
        assert high - low >= 2.0
    assert np.mean(right.get_ylim()) == pytest.approx(12.0, abs=0.01)


def test_labels_cover_neither_each_other_nor_marks():
    """Six cars in a row, half a metre apart, and ghosts of three radars at one place."""
    cars = [(f"vehicle {n}", 20.0 + 0.5 * n) for n in range(6)]
    truth = truth_of(*cars)
    found = detections_at(*((place, -3.0) for _, place in cars), *3 * ((90.0, -30.0),))
    causes = [("target", name) for name, _ in cars] + 3 * [("direct", None)]
    radar = (*6 * (None,), "one", "two", "three")
    score = score_of(truth, found=[name for name, _ in cars], causes=causes, radar=radar)
    figure = detections_plan(found, truth, score, title="a row").figure
    figure.draw_without_rendering()
    for axes, number in zip(figure.axes, (6, 3), strict=True):
        # without the line to the point, which may pass over marks
        texts = [Text.get_window_extent(text) for text in axes.texts]
        assert len(texts) == number
        assert not any(one.overlaps(other) for one, other in combinations(texts, 2))
        marks = np.concatenate([axes.transData.transform(one.get_xydata()) for one in axes.lines])
        assert not any(box.contains(*mark) for box in texts for mark in marks)
