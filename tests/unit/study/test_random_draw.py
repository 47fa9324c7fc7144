"""From a study with random traffic to the street that its seed draws."""

from __future__ import annotations

import tomllib
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from polychirp.channel.tracers.free_space import FreeSpace
from polychirp.config.dump import dump
from polychirp.config.load import build
from polychirp.errors import InputError
from polychirp.study.check import check
from polychirp.study.random_draw import sample_street
from polychirp.study.spec import Study, StudyRadar, schedules_of
from polychirp.study.traffic import StudyTraffic
from polychirp.study.trial import run_trial
from polychirp.traffic.mounting import bumper_mount
from polychirp.traffic.street import Point, Street, Vehicle
from polychirp.waveform import DiverseTriangular, Triangular

STUDY = Study(
    name="traffic",
    num_sweeps=4,
    street=Street(vehicles=(Vehicle(name="ego", x=0.0, y=-1.75),)),
    radars=(
        StudyRadar(
            name="front",
            vehicle="ego",
            mount=bumper_mount("sedan", "front"),
            waveform=Triangular(),
        ),
    ),
    traffic=StudyTraffic(
        seen_from="ego",
        num_targets=3,
        num_carriers=3,
        num_interferers=2,
        shape="points",
        start_spread=1e-3,
        clock_spread=1e-6,
    ),
    tracer=FreeSpace(),
)


def with_traffic(**changes: object) -> Study:
    assert STUDY.traffic is not None
    return replace(STUDY, traffic=replace(STUDY.traffic, **changes))


def test_interferers_are_radars_like_the_first_on_the_bumpers_of_carriers() -> None:
    one = sample_street(STUDY)
    assert [radar.vehicle for radar in one.radars] == ["ego", "carrier-1", "carrier-2"]
    assert one.victims == ("front",)
    assert one.targets == ("target-1", "target-2", "target-3")
    for radar in one.radars[1:]:
        assert radar.waveform == STUDY.radars[0].waveform
        assert 0.0 <= radar.start_time <= 1e-3
        assert abs(radar.clock_offset) <= 1e-6


def test_the_street_is_the_same_however_many_carriers_transmit() -> None:
    assert sample_street(with_traffic(num_interferers=0)).street == sample_street(STUDY).street


def test_interferers_may_send_another_waveform() -> None:
    one = sample_street(with_traffic(waveform=DiverseTriangular()))
    assert len({plan.slope[0] for plan in schedules_of(one)}) == 3
    assert one.radars[1].waveform == DiverseTriangular()


def test_a_study_without_traffic_is_left_alone() -> None:
    plain = replace(STUDY, traffic=None)
    assert sample_street(plain) is plain


def test_a_trial_draws_the_traffic_and_finds_it() -> None:
    alone = with_traffic(num_interferers=0)
    victim = run_trial(alone).victims[0]
    assert victim.truth.name == ("target-1", "target-2", "target-3")
    assert victim.score.is_detected.all()
    assert np.all(np.abs(victim.score.range_error) < 0.05)


def test_traffic_that_cannot_be_is_refused_before_the_run_with_its_place() -> None:
    with pytest.raises(InputError, match="traffic: there is no room for 40 targets"):
        check(with_traffic(num_targets=40))
    with pytest.raises(InputError, match="num_interferers is 4, but only 3 carriers can have"):
        with_traffic(num_interferers=4)
    with pytest.raises(InputError, match="start spread of 0 s or more"):
        with_traffic(start_spread=-1.0)


@pytest.mark.parametrize(
    ("fluctuation", "distribution"),
    [("swerling-1", stats.expon()), ("swerling-3", stats.chi2(4, scale=0.25))],
)
def test_points_fluctuate_as_swerling_says(fluctuation, distribution):
    """Chi-squared with 2 and 4 degrees of freedom and mean 1: Kolmogorov's test of 2000 seeds."""
    post = Point(name="post", x=20.0, y=0.0, z=0.5, rcs=3.0, fluctuation=fluctuation)
    study = Study(name="alone", street=Street(points=(post,)), radars=())
    drawn = [
        sample_street(replace(study, seed=seed)).street.points[0].rcs / 3.0 for seed in range(2000)
    ]
    assert stats.kstest(drawn, distribution.cdf).pvalue > 0.01
    # the same seed of the other case is refused by the same test
    other = stats.chi2(4, scale=0.25) if fluctuation == "swerling-1" else stats.expon()
    assert stats.kstest(drawn, other.cdf).pvalue < 1e-6


def test_a_fluctuating_point_is_drawn_once_for_a_trial_whatever_else_there_is():
    post = Point(name="post", x=20.0, y=0.0, z=0.5, rcs=3.0, fluctuation="swerling-1")
    other = replace(post, name="other", x=30.0)
    alone = Study(name="alone", street=Street(points=(post,)), radars=())
    both = replace(alone, street=Street(points=(other, post)))
    once = sample_street(alone)
    assert sample_street(once) == once
    assert sample_street(both).street.points[1].rcs == once.street.points[0].rcs
    assert sample_street(both).street.points[0].rcs != once.street.points[0].rcs
    assert once.street.points[0].rcs != 3.0


def test_a_drawn_street_is_written_as_a_file_that_can_be_read():
    """The ratio of the draw to the mean is a trial's own; files know the cross section alone."""
    post = Point(name="post", x=20.0, y=0.0, z=0.5, rcs=3.0, fluctuation="swerling-3")
    (drawn,) = sample_street(
        Study(name="one", street=Street(points=(post,)), radars=())
    ).street.points
    assert drawn.actor().fluctuation == pytest.approx(drawn.rcs / 3.0)
    read = build(Street, tomllib.loads(dump(Street(points=(drawn,)))))
    assert read.points == (replace(post, rcs=drawn.rcs, fluctuation="steady"),)


def test_a_steady_point_is_left_as_it_is():
    study = Study(
        name="a", street=Street(points=(Point(name="p", x=9.0, y=0.0, z=0.5, rcs=1.0),)), radars=()
    )
    assert sample_street(study) is study


def test_a_swerling_1_point_is_detected_as_often_as_its_closed_form_says():
    """Mean detection probability of one look over the draws: Pfa^(1/(1+SNR)), within 3 sigma."""
    false_alarm, mean_snr, count = 1e-4, 20.0, 3000
    post = Point(name="post", x=20.0, y=0.0, z=0.5, rcs=mean_snr, fluctuation="swerling-1")
    snr = np.array([post.drawn(np.random.default_rng(seed)).rcs for seed in range(count)])
    of_steady = stats.ncx2.sf(-2.0 * np.log(false_alarm), 2, 2.0 * snr)
    expected = false_alarm ** (1.0 / (1.0 + mean_snr))
    assert np.mean(of_steady) == pytest.approx(expected, abs=3.0 * np.std(of_steady) / count**0.5)


def test_silent_interferers_leave_the_frame_of_a_study_without_them() -> None:
    """Their tracing is that of the study in which they transmit."""
    silent = run_trial(with_traffic(are_silent=True))
    none = run_trial(with_traffic(num_interferers=0))
    loud = run_trial(STUDY)
    frames = [one.victims[0].frame.samples for one in (silent, none, loud)]
    assert np.array_equal(frames[0], frames[1])
    assert not np.array_equal(frames[0], frames[2])
    for paths, other in zip(silent.snapshots, loud.snapshots, strict=True):
        assert np.array_equal(paths.delay, other.delay)
