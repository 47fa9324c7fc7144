"""What a measurement of detection is made of, and what is refused before it begins."""

from dataclasses import replace

import numpy as np
import pytest

from polychirp.errors import CapabilityError, InputError, ModelWarning
from polychirp.model.if_filter import IfFilter
from polychirp.model.if_frame import sample_times
from polychirp.model.radar import Converter
from polychirp.receiver.alternatives.paper_receiver import PaperReceiver
from polychirp.receiver.coherent.chain import CoherentReceiver
from polychirp.receiver.range_doppler.chain import RangeDoppler
from polychirp.receiver.selection import AutoReceiver
from polychirp.study.roc.plan import case_name, roc_plan
from polychirp.study.roc.yardsticks import Extent, error_limits, resolution
from polychirp.study.spec import schedules_of
from polychirp.traffic.street import Building, Point
from polychirp.waveform import (
    DiverseSawtooth,
    Hopping,
    ListenBeforeTalk,
    PermutedChirps,
    Slots,
    Subframes,
)
from tests.support.roc_study import TRIANGLES, roc_study

ASK = {"snrs_db": [14.0], "trials": 3, "noise_trials": 4}

JOINT_BANDS = {
    "permuted-chirps": PermutedChirps(num_pieces=4, bandwidth=600e6, ramp_duration=40e-6),
    "hopping": Hopping(band=(76e9, 77e9), bandwidth=250e6, ramp_duration=40e-6, idle=10e-6),
    "diverse-sawtooth": DiverseSawtooth(start_frequency_spread=900e6, ramp_duration=40e-6),
}


def times_of(study):
    """Times of the samples of the first radar in the first trial."""
    return sample_times(schedules_of(study)[0], study.radars[0].converter)


def test_the_street_is_left_out_and_the_radar_stays():
    study = roc_study()
    street = replace(
        study.street,
        points=(Point(name="post", x=12.0, y=1.0, z=0.5, rcs=10.0),),
        buildings=(Building(name="house", x=20.0, y=12.0, length=5.0, width=5.0, height=4.0),),
    )
    plan = roc_plan(replace(study, street=street, targets=("post",)), **ASK)
    assert [vehicle.name for vehicle in plan.study.street.vehicles] == ["ego"]
    assert (plan.study.street.points, plan.study.street.buildings) == ((), ())
    assert plan.study.radars == (study.radars[0],)
    assert plan.cases == (None, 14.0)
    assert [plan.num_trials(n) for n in (0, 1)] == [4, 3]


def test_another_radar_and_interferers_are_chosen_by_name():
    plan = roc_plan(roc_study(), radar="other", interferers=["front"], **ASK)
    assert [radar.name for radar in plan.study.radars] == ["other", "front"]
    assert plan.radar == "other"
    first = roc_plan(replace(roc_study(), victims=("other",)), **ASK)
    assert first.radar == "other"


@pytest.mark.parametrize("seed", range(4))
def test_a_rule_of_access_gives_radars_what_it_gives_them_in_the_study(seed):
    """Two slots among three radars: the first and the third share one."""
    two = roc_study()
    third = replace(two.radars[1], name="third")
    study = replace(
        two, radars=(*two.radars, third), access=Slots(slot=2e-6, num_slots=2), seed=seed
    )
    bare = roc_plan(study, radar="front", interferers=["third"], **ASK).study
    assert bare.radars == (study.radars[0], third)
    wanted = schedules_of(study)
    for found, number in zip(schedules_of(bare), (0, 2), strict=True):
        assert np.array_equal(found.start_time, wanted[number].start_time)


def test_a_strong_point_has_room_on_one_side_of_every_tested_point():
    window = roc_plan(roc_study(), strong=1e3, **ASK).window
    most = 0.5 * (window.greatest_range - window.least_range)
    roc_plan(roc_study(), strong=1e3, apart=(0.99 * most, None), **ASK)
    with pytest.raises(InputError, match=rf"use {most:.3g} m or less"):
        roc_plan(roc_study(), strong=1e3, apart=(1.01 * most, None), **ASK)


def test_a_rule_from_frame_to_frame_is_refused_beside_interferers():
    study = replace(roc_study(), access=ListenBeforeTalk())
    with pytest.raises(CapabilityError, match="acts from frame to frame"):
        roc_plan(study, interferers=["other"], **ASK)
    roc_plan(study, **ASK)


def test_every_receiver_has_every_probability_that_it_knows():
    with pytest.warns(ModelWarning, match="'paper' serves for comparison"):
        plan = roc_plan(
            roc_study(TRIANGLES, num_sweeps=6),
            kinds=["paper", "coherent"],
            probabilities=[1e-3, 1e-5],
            **ASK,
        )
    assert [curve.label for curve in plan.curves] == [
        "paper",
        "coherent, 1e-3",
        "coherent, 1e-5",
    ]


def test_auto_becomes_the_receiver_that_it_chooses():
    study = roc_study(receiver=AutoReceiver(greatest_range=25.0))
    (curve,) = roc_plan(study, **ASK).curves
    assert curve.receiver == RangeDoppler(greatest_range=25.0)


def test_points_and_their_errors_stay_within_all_receivers_limits():
    """Two limits of error at each end; λ/4T is 19.6 m/s for chirps 50 µs apart at 76.6 GHz."""
    study = roc_study()
    schedule = schedules_of(study)[0]
    window = roc_plan(study, **ASK).window
    limits = error_limits(RangeDoppler(), schedule, times_of(study))
    wavelength = 299792458.0 / float(schedule.centre_frequency[0])
    assert window.least_range == pytest.approx(0.5 + 2 * limits.range)
    assert window.greatest_range == pytest.approx(30.0 - 2 * limits.range)
    fastest = wavelength / (4 * 50e-6) - 2 * limits.range_rate
    assert window.greatest_speed == pytest.approx(fastest, rel=1e-9)
    assert window.half_frame == pytest.approx(0.5 * (31 * 50e-6 + 40e-6))


def test_no_receiver_takes_a_first_side_lobe_for_the_point():
    """The coherent receiver has no windows: its first side lobe is 1.43 cells away."""
    study = roc_study(TRIANGLES, num_sweeps=6)
    schedule, times = schedules_of(study)[0], times_of(study)
    cell = resolution(CoherentReceiver(), schedule, times)
    coherent = error_limits(CoherentReceiver(), schedule, times)
    assert coherent.range < 1.43 * cell.range
    assert coherent.range_rate < 1.43 * cell.range_rate
    for receiver in (RangeDoppler(), PaperReceiver()):
        found = error_limits(receiver, schedule, times)
        assert cell.range <= found.range <= 2 * cell.range
        assert found.range_rate >= cell.range_rate


@pytest.mark.parametrize("waveform", JOINT_BANDS.values(), ids=JOINT_BANDS)
def test_no_side_lobe_of_bands_that_are_added_in_phase_counts_as_the_point(waveform):
    """At the limit is the end of the main lobe, and side lobes beyond it have less than 10 %.

    The cell of a receiver that adds the samples of one ramp only is 3 to 6 times as wide.
    """
    converter = Converter(sample_rate=4e6, start=2e-6, margin=1e-6)
    study = roc_study(waveform, num_sweeps=256, converter=converter)
    schedule, times = schedules_of(study)[0], times_of(study)
    limit = error_limits(CoherentReceiver(), schedule, times).range
    since = times.time - schedule.start_time[:, None]
    frequency = schedule.start_frequency[:, None] + schedule.slope[:, None] * since
    frequency = frequency[times.is_sample]
    apart = limit * np.linspace(0.0, 2.0, 201)
    turns = 2.0 / 299792458.0 * np.outer(apart, frequency)
    power = np.abs(np.mean(np.exp(2j * np.pi * turns), axis=1)) ** 2
    assert power[100] < 0.02
    assert power[100:].max() < 0.1
    assert np.all(np.diff(power[:91]) < 0.0)
    of_a_ramp = error_limits(PaperReceiver(), schedule, times).range
    assert of_a_ramp == pytest.approx(299792458.0 / (2.0 * np.max(schedule.bandwidth)))
    assert of_a_ramp > 3.0 * limit


def test_a_measurement_with_other_limits_is_another_one(monkeypatch):
    study = roc_study()
    one = roc_plan(study, **ASK)
    other = roc_plan(study, **ASK)
    wider = Extent(1.1 * one.limits[0].range, one.limits[0].range_rate)
    monkeypatch.setattr("polychirp.study.roc.plan.error_limits", lambda *_: wider)
    assert other.window == one.window
    assert other.limits == (wider,)
    assert other.key != one.key


def test_a_strong_point_is_four_cells_away_unless_told():
    study = roc_study()
    cell = resolution(RangeDoppler(), schedules_of(study)[0], times_of(study))
    plan = roc_plan(roc_study(), strong=100.0, **ASK)
    assert plan.strong.apart == (pytest.approx(4 * cell.range), 0.0)
    told = roc_plan(roc_study(), strong=100.0, apart=(1.5, 2.0), **ASK)
    assert told.strong.apart == (1.5, 2.0)


def test_further_snrs_and_trials_belong_to_the_same_measurement():
    one = roc_plan(roc_study(), **ASK)
    more = roc_plan(roc_study(), snrs_db=[3.0, 14.0], trials=9, noise_trials=1)
    assert one.key == more.key
    for change in ({"strong": 10.0}, {"probabilities": [1e-3]}, {"radar": "other"}):
        assert roc_plan(roc_study(), **ASK, **change).key != one.key
    assert roc_plan(replace(roc_study(), seed=6), **ASK).key != one.key


def test_cases_have_names():
    plan = roc_plan(
        roc_study(), snrs_db=[12, 0.1 + 0.2, 0.3, -0.0, 0.0, -3.25], trials=1, noise_trials=1
    )
    names = ["noise", "-3.25 dB", "0.0 dB", "0.3 dB", "12.0 dB"]
    assert [case_name(case) for case in plan.cases] == names


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"radar": "frnt"}, "there is no radar 'frnt'.*did you mean 'front'"),
        ({"interferers": ["nobody"]}, "there is no radar 'nobody'"),
        ({"interferers": ["front"]}, "other radars than 'front'"),
        ({"interferers": ["other", "other"]}, "each named once"),
        ({"kinds": ["coherrent"]}, "no receiver 'coherrent'.*did you mean 'coherent'"),
        ({"kinds": ["auto", "range-doppler"]}, "range-doppler, 1e-4' is asked for twice"),
        ({"probabilities": [1e-4, 1e-4]}, "asked for twice"),
        ({"probabilities": [0.5]}, "must lie between 1e-12 and 0.1"),
        ({"snrs_db": []}, "there are 0 SNRs"),
        ({"snrs_db": [1e6]}, "outside of -100 dB to 200 dB"),
        ({"trials": 0}, "must be 1 or more"),
        ({"noise_trials": 0}, "must be 1 or more"),
    ],
)
def test_a_wrong_request_is_refused_in_one_sentence(change, message):
    with pytest.raises(InputError, match=message):
        roc_plan(roc_study(), **{**ASK, **change})


def test_a_negative_seed_is_refused():
    with pytest.raises(InputError, match="seed: is -1; use 0 or more"):
        roc_plan(replace(roc_study(), seed=-1), **ASK)


def test_a_radar_on_a_vehicle_that_is_not_there_is_refused():
    study = roc_study()
    lost = (replace(study.radars[0], vehicle="ego2"), study.radars[1])
    with pytest.raises(InputError, match=r"no vehicle 'ego2'.*did you mean 'ego'"):
        roc_plan(replace(study, radars=lost), **ASK)


def test_a_probability_for_the_papers_receiver_is_refused():
    study = roc_study(TRIANGLES, num_sweeps=6, receiver=PaperReceiver())
    with (
        pytest.warns(ModelWarning, match="serves for comparison"),
        pytest.raises(InputError, match="'paper' has no false-alarm probability; leave --pfa out"),
    ):
        roc_plan(study, probabilities=[1e-3], **ASK)


def test_ramps_that_a_receiver_cannot_read_are_refused_with_their_place_in_the_file():
    with pytest.raises(CapabilityError, match=r"radars\.1\.waveform: the paper's receiver"):
        roc_plan(roc_study(), radar="other", kinds=["paper"], **ASK)


def test_limits_without_room_for_a_point_are_refused():
    near = roc_study(receiver=RangeDoppler(greatest_range=4.0))
    with pytest.raises(InputError, match=r"leave no room for points.*raise receiver"):
        roc_plan(near, **ASK)
    slow = roc_study(TRIANGLES, num_sweeps=6, receiver=CoherentReceiver(greatest_speed=0.1))
    too_few = pytest.raises(InputError, match="too few cells for a point")
    with pytest.warns(ModelWarning, match="a target fills all of them"), too_few:
        roc_plan(slow, **ASK)


def test_subframes_are_refused_before_the_first_frame():
    waveform = Subframes(
        bandwidth=200e6, ramp_duration=40e-6, intervals=(50e-6, 57e-6), ramps_per_subframe=16
    )
    edges = {
        "converter": Converter(sample_rate=4e6, start=2e-6, margin=1e-6),
        "if_filter": IfFilter(passband=1.2e6, stopband=1.92e6),
    }
    with pytest.raises(CapabilityError, match="does not know the ideal detector"):
        roc_plan(roc_study(waveform, RangeDoppler(), **edges), **ASK)
