"""From a slider to a picture on the live page, without the browser."""

import pytest

from polychirp.live import plots
from polychirp.live.look import detections_in, look_at
from polychirp.live.presets import PRESETS
from polychirp.live.settings import study_of


@pytest.mark.parametrize("name", PRESETS)
def test_live_picture(benchmark, name):
    """Look and figures: to be below 150 ms."""
    study = study_of(PRESETS[name])

    def picture() -> None:
        look = look_at(study)
        plots.range_profile(look, None, is_dark=False)
        plots.range_rate(look, None, is_dark=False)
        plots.beats_over_time(look, is_dark=False)

    benchmark.pedantic(picture, rounds=5, warmup_rounds=1)


@pytest.mark.parametrize("name", PRESETS)
def test_live_detections(benchmark, name):
    """Detections, which follow the picture."""
    look = look_at(study_of(PRESETS[name]))
    benchmark.pedantic(detections_in, args=(look,), rounds=3, warmup_rounds=1)
