"""The command ``polychirp benchmark``."""

import json
import time

import numpy as np
import pytest

from polychirp.cli.app import main
from polychirp.receiver.mitigation.base import mitigated
from polychirp.report.figures.mitigation_benchmark import benchmark_picture
from polychirp.rng import Streams
from polychirp.study.mitigation.benchmark import (
    KNOWN,
    NO_MITIGATION,
    ORACLE,
    BenchmarkPlan,
    MethodResult,
    run_benchmark,
)
from polychirp.study.mitigation.engine_frames import ROADS, road_frame
from polychirp.study.mitigation.frame_sets import FRAME_SETS, set_frame
from polychirp.study.mitigation.measures import measured_frame, measures
from polychirp.study.mitigation.own_methods import METHODS
from polychirp.study.mitigation.street_frames import STREETS, street_frame


@pytest.fixture(scope="module")
def results():
    few = {name: METHODS[name] for name in ("blanking", "ramp-minimum")}
    return run_benchmark(BenchmarkPlan(methods=few, families=("arim", "tu-delft"), num_frames=3))


def test_it_stores_a_record_a_table_and_a_figure(tmp_path, capsys):
    command = ["benchmark", "--family", "tu-delft", "--frames", "2", "--method", "imat"]
    command += ["--workers", "1"]
    own = ["--own", "mine=polychirp.receiver.mitigation:Interpolation"]
    assert main([*command, *own, "--out", str(tmp_path / "out")]) == 0
    record = json.loads((tmp_path / "out" / "benchmark.json").read_text(encoding="utf-8"))
    assert record["set"] == "v2"
    assert record["methods"]["imat"]["kind"] == "imat"
    names = [row["method"] for row in record["results"]]
    assert names == [NO_MITIGATION, "imat", "mine", ORACLE]
    assert all(len(row["frames"]) == 2 for row in record["results"])
    assert (tmp_path / "out" / "benchmark.png").exists()
    times = json.loads((tmp_path / "out" / "times.json").read_text(encoding="utf-8"))
    assert times["imat"]["tu-delft"] > 0.0
    text = capsys.readouterr().out
    assert "clean oracle" in text
    assert "precision" in text


def test_the_record_has_the_same_bytes_for_any_number_of_workers(tmp_path):
    """Also with a method of a module that only this process's path names."""
    (tmp_path / "own_repair.py").write_text(
        "from polychirp.receiver.mitigation.base import with_weights\n"
        "class Mine:\n"
        "    def mitigate(self, frame):\n"
        "        return with_weights(frame, frame.times.is_sample)\n",
        encoding="utf-8",
    )
    command = ["benchmark", "--family", "arim", "--frames", "3", "--method", "blanking"]
    command += ["--own", "mine=own_repair:Mine", "--known-bursts"]
    records = []
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(tmp_path)
        for workers in ("1", "2"):
            out = tmp_path / workers
            assert main([*command, "--workers", workers, "--out", str(out)]) == 0
            records.append((out / "benchmark.json").read_bytes())
    assert records[0] == records[1]
    names = [row["method"] for row in json.loads(records[0])["results"]]
    assert names == [NO_MITIGATION, "blanking", "blanking" + KNOWN, "mine", ORACLE]


def test_slow_methods_have_fewer_frames_and_say_so(tmp_path, capsys):
    out = tmp_path / "out"
    command = ["benchmark", "--family", "arim", "--frames", "2", "--method", "blanking"]
    assert main([*command, "--slow-frames", "1", "--workers", "1", "--out", str(out)]) == 0
    record = json.loads((out / "benchmark.json").read_text(encoding="utf-8"))
    frames = {row["method"]: row["num_frames"] for row in record["results"]}
    assert frames["blanking"] == 2
    assert frames["low-rank-hankel"] == frames["dual-sparsity"] == frames["stft-filled"] == 1
    assert "low-rank-hankel (1)" in capsys.readouterr().out


def test_a_detector_is_counted_and_known_bursts_are_all_found():
    plan = BenchmarkPlan(
        methods={"blanking": METHODS["blanking"], "ramp": METHODS["ramp-minimum"]},
        families=("toth",),
        num_frames=1,
        knows_bursts=True,
    )
    rows = {one.method: one.frames[0] for one in run_benchmark(plan)}
    assert rows["blanking" + KNOWN]["precision"] == rows["blanking" + KNOWN]["recall"] == 1.0
    own = rows["blanking"]
    assert 0.3 < own["recall"] <= 1.0
    mean = 2.0 / (1.0 / own["precision"] + 1.0 / own["recall"])
    assert own["f_score"] == pytest.approx(mean)
    assert np.isnan(rows["ramp"]["recall"])
    assert rows["blanking"]["false_mitigation"] < 4e-3
    assert rows["blanking" + KNOWN]["false_mitigation"] == 0.0


class SlowOnce:
    """A method whose first call takes 0.2 s of CPU time, as if it loaded a kernel."""

    def __init__(self):
        self.calls = 0

    def mitigate(self, frame):
        self.calls += 1
        end = time.process_time() + (0.2 if self.calls == 1 else 0.0)
        while time.process_time() < end:
            pass
        return mitigated(None, frame)


def test_what_a_method_loads_once_is_not_timed():
    plan = BenchmarkPlan(methods={"slow once": SlowOnce()}, families=("arim",), num_frames=1)
    rows = {one.method: one.seconds for one in run_benchmark(plan)}
    assert rows["slow once"][0] < 0.1


def test_the_bounds_enclose_a_method_that_helps(results):
    for family in ("arim", "tu-delft"):
        sinr = {
            one.method: one.percentiles("sinr_range")[1] for one in results if one.family == family
        }
        assert sinr[NO_MITIGATION] < sinr["blanking"] < sinr[ORACLE] + 1.0
    oracle = next(one for one in results if one.method == ORACLE)
    assert oracle.percentiles("evm") == (0.0, 0.0, 0.0)


def test_a_method_that_refuses_a_family_says_why_and_has_no_numbers(results):
    refused = next(one for one in results if one.method == "ramp-minimum")
    assert "single ramp" in refused.refusal
    assert refused.frames == ()
    assert np.isnan(refused.percentiles("evm")).all()


def test_the_share_made_worse_compares_frame_by_frame():
    def result(*sinrs):
        frames = tuple({"sinr_range": sinr} for sinr in sinrs)
        return MethodResult(family="f", method="m", frames=frames)

    assert result(5.0, 9.95, 20.0, 9.0).share_worse(result(10.0, 10.0, 10.0, 10.0)) == 0.5


def test_the_figure_has_the_loss_to_the_oracle(results):
    drawing = benchmark_picture(results, title="set")
    data = drawing.data
    cells = zip(data["method"], data["family"], strict=True)
    loss = dict(zip(cells, data["sinr_loss_db"], strict=True))
    assert loss[ORACLE, "arim"] == 0.0
    assert loss[NO_MITIGATION, "arim"] > loss["blanking", "arim"]
    assert np.isnan(loss["ramp-minimum", "arim"])


def test_a_frame_of_a_set_does_not_depend_on_the_others():
    alone, _ = set_frame("v1", "arim", 2)
    set_frame("v1", "arim", 0)
    again, _ = set_frame("v1", "arim", 2)
    assert np.array_equal(alone.samples, again.samples)
    assert not np.array_equal(alone.samples, set_frame("v1", "arim", 3)[0].samples)
    assert set(ROADS) < set(FRAME_SETS["v1"])


def test_version_1_of_the_set_is_what_it_was():
    """Mean powers of frame 1 and of its interference, as they were when the set was published."""
    published = {
        "tu-delft": (1.242122373e01, 1.166907959e01),
        "arim": (1.173723296e01, 1.024000000e01),
        "toth": (1.931245976e03, 1.929546394e03),
        "direct": (2.917960676e-07, 2.810627497e-07),
        "indirect": (1.447914511e-08, 2.770979184e-09),
        "near-parallel": (4.479998590e-06, 3.338276711e-06),
        "many": (2.624199445e-07, 2.410758699e-07),
        "real-mixer": (4.282346721e-07, 3.471540065e-07),
    }
    assert list(FRAME_SETS["v1"]) == list(published)
    for family, powers in published.items():
        frame, parts = set_frame("v1", family, 1)
        found = [np.mean(np.abs(part) ** 2) for part in (frame.samples, parts.interference)]
        assert found == pytest.approx(powers, rel=1e-6)


@pytest.mark.slow
def test_traced_streets_have_the_ramps_and_the_interference_of_their_kind():
    """A traced frame: chirps with the direct part alone, and drawn ramps, which are unequal."""
    frame, parts = street_frame(Streams(5), STREETS["street-direct"])
    assert frame.samples.shape[:2] == (4, 64)
    assert "multipath" in parts.names
    assert parts["direct"].any()
    assert not parts["indirect"].any()
    ramps, of_ramps = street_frame(Streams(5), STREETS["street-ramps"])
    assert np.ptp(ramps.times.num_samples) > 0
    assert of_ramps["direct"].any()
    assert of_ramps["indirect"].any()
    on = measured_frame(ramps, of_ramps)
    clean = measures(on, mitigated(None, on.clean))
    assert clean["evm"] == clean["floor_rise"] == 0.0
    assert np.isnan(clean["sinr_velocity"])
    assert len(on.objects) >= 8


def test_roads_have_the_interference_that_their_kind_names():
    frame, parts = road_frame(Streams(5), ROADS["indirect"])
    assert not parts["direct"].any()
    assert np.allclose(parts.samples.sum(axis=0), frame.samples)
    _, near = road_frame(Streams(5), ROADS["near-parallel"])
    noise = np.mean(np.abs(near.noise) ** 2)
    hit = np.mean(np.mean(np.abs(near.interference) ** 2, axis=0) > noise, axis=1)
    assert np.median(hit) > 0.5
    real, _ = road_frame(Streams(5), ROADS["real-mixer"])
    assert not real.samples.imag.any()


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (["--set", "v0"], "no set of frames 'v0'"),
        (["--family", "arym"], "did you mean 'arim'"),
        (["--method", "imta"], "did you mean 'imat'"),
        (["--frames", "0"], "use 1 or more"),
        (["--workers", "0"], "use 1 or more"),
        (["--slow-frames", "-1"], "use 0 or more"),
        (["--own", "x"], "NAME=MODULE:OBJECT"),
    ],
)
def test_what_it_cannot_use_is_refused_before_the_computation(options, sentence, tmp_path, capsys):
    assert main(["benchmark", *options, "--out", str(tmp_path / "out")]) == 2
    assert sentence in capsys.readouterr().err
