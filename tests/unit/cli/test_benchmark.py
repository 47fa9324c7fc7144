"""The command ``polychirp benchmark``."""

import json

import numpy as np
import pytest

from polychirp.cli.app import main
from polychirp.report.figures.mitigation_benchmark import benchmark_picture
from polychirp.rng import Streams
from polychirp.study.mitigation.benchmark import NO_MITIGATION, ORACLE, MethodResult, run_benchmark
from polychirp.study.mitigation.engine_frames import ROADS, road_frame
from polychirp.study.mitigation.frame_sets import FRAME_SETS, set_frame
from polychirp.study.mitigation.own_methods import METHODS


@pytest.fixture(scope="module")
def results():
    few = {name: METHODS[name] for name in ("blanking", "ramp-minimum")}
    return run_benchmark(few, families=["arim", "tu-delft"], num_frames=3)


def test_it_stores_a_record_a_table_and_a_figure(tmp_path, capsys):
    command = ["benchmark", "--family", "tu-delft", "--frames", "2", "--method", "imat"]
    own = ["--own", "mine=polychirp.receiver.mitigation:Interpolation"]
    assert main([*command, *own, "--out", str(tmp_path / "out")]) == 0
    record = json.loads((tmp_path / "out" / "benchmark.json").read_text(encoding="utf-8"))
    assert record["set"] == "v1"
    assert record["methods"]["imat"]["kind"] == "imat"
    names = [row["method"] for row in record["results"]]
    assert names == [NO_MITIGATION, "imat", "mine", ORACLE]
    assert all(len(row["frames"]) == 2 for row in record["results"])
    assert (tmp_path / "out" / "benchmark.png").exists()
    assert "clean oracle" in capsys.readouterr().out


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
        (["--own", "x"], "NAME=MODULE:OBJECT"),
    ],
)
def test_what_it_cannot_use_is_refused_before_the_computation(options, sentence, tmp_path, capsys):
    assert main(["benchmark", *options, "--out", str(tmp_path / "out")]) == 2
    assert sentence in capsys.readouterr().err
