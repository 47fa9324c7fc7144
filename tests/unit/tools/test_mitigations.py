"""All mitigations on one frame, between nothing and the oracle."""

import numpy as np
import pytest

from polychirp.channel.point_vehicles.tracer import PointVehicles
from polychirp.frames import Pose
from polychirp.model.if_frame import IfParts
from polychirp.receiver.mitigation import Autoregression, Blanking
from polychirp.study.spec import Study, StudyRadar
from polychirp.traffic.street import Point, Street, Vehicle
from polychirp.waveform import DiverseTriangular
from tools.experiments.mitigations import (
    ORACLE,
    compare_mitigations,
    without_interference,
)


@pytest.fixture(scope="module")
def rows():
    """Two cars face to face at 25 m with a post between them, played with diverse ramps."""
    street = Street(
        vehicles=(
            Vehicle(name="ego", x=0.0, y=0.0),
            Vehicle(name="oncoming", x=25.0, y=3.5, heading=np.pi),
        ),
        points=(Point(name="post", x=12.0, y=-2.0, z=0.5, rcs=1.0),),
    )
    radars = tuple(
        StudyRadar(name=name, vehicle=name, mount=Pose(x=2.2, z=0.5), waveform=DiverseTriangular())
        for name in ("ego", "oncoming")
    )
    study = Study(
        name="face to face",
        num_sweeps=6,
        street=street,
        radars=radars,
        victims=("ego",),
        targets=("post",),
        tracer=PointVehicles(),
        refresh_interval=1.0,
    )
    methods = {"nothing": None, "blanking": Blanking(), "autoregression": Autoregression()}
    found = compare_mitigations(study, scenario="face", methods=methods)
    return {row.method: row for row in found}


@pytest.mark.slow
def test_the_oracle_bounds_what_mitigation_gives_back(rows):
    assert list(rows) == ["nothing", "blanking", "autoregression", ORACLE]
    assert rows[ORACLE].evm == 0.0
    assert rows[ORACLE].floor_rise_db == pytest.approx(0.0, abs=1e-9)
    assert rows["nothing"].floor_rise_db > 30.0
    for name in ("blanking", "autoregression"):
        assert rows["nothing"].sinr_db + 20.0 < rows[name].sinr_db < rows[ORACLE].sinr_db + 0.5
        assert rows[name].floor_rise_db < 1.0
        assert rows[name].missed == 0


@pytest.mark.slow
def test_filling_errs_less_than_leaving_out(rows):
    assert rows["autoregression"].evm < 0.3 * rows["blanking"].evm
    assert rows["autoregression"].lost <= rows["blanking"].lost


@pytest.mark.slow
def test_where_there_is_no_interference_nothing_is_touched(rows):
    for row in rows.values():
        assert row.touched_clean == 0.0
        assert row.loss_clean_db == pytest.approx(0.0, abs=1e-9)


def test_the_oracle_leaves_all_that_other_radars_did_not_make():
    samples = np.arange(5.0)[:, None, None, None] * np.ones((5, 1, 1, 1))
    parts = IfParts(samples=samples, names=("echo", "multipath", "direct", "indirect", "noise"))
    alone = without_interference(parts)
    assert alone.names == ("echo", "multipath", "noise")
    assert alone.total()[0, 0, 0] == 0 + 1 + 4
    assert alone.interference.sum() == 0.0
