"""Made-up results: all that the report shows, without any physics."""

from collections.abc import Callable

import numpy as np
import pytest

from polychirp.frames import Pose
from polychirp.model.mesh import Mesh, Plate
from polychirp.model.radar import Radar
from polychirp.model.ramp import RampSchedule, continuous_phase
from polychirp.model.scene import Actor, Scene
from polychirp.study.paper.results import (
    GhostRow,
    PaperResults,
    PaperRow,
    RowMap,
    TargetRow,
    paper_claims,
)

FLOOR = -95.0
TARGETS = {
    "radar 1": (("vehicle 4 rear", 6.5, -20.0), ("vehicle 3", 9.15, -28.0)),
    "radar 2": (
        ("vehicle 2", 12.6, -31.0),
        ("vehicle 4", 13.65, -33.0),
        ("far <car>", 21.0, -50.0),
    ),
}


def cuboid(length: float, width: float, height: float, material: str, *, base: float = 0.0) -> Mesh:
    corner = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
    vertex = (corner - (0.5, 0.5, 0.0)) * (length, width, height) + (0.0, 0.0, base)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    face = np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))])
    zeros = np.zeros(12, dtype=np.int64)
    return Mesh(
        vertex=vertex, face=face, material=zeros, part=zeros, materials=(material,), parts=("body",)
    )


def triangles(durations: np.ndarray, bandwidths: np.ndarray) -> RampSchedule:
    duration = np.repeat(durations, 2)
    slope = np.stack([bandwidths / durations, -bandwidths / durations], axis=1).ravel()
    start = np.stack([np.full(durations.size, 79e9), 79e9 + bandwidths], axis=1).ravel()
    return RampSchedule(
        start_time=np.concatenate([[0.0], np.cumsum(duration)[:-1]]),
        duration=duration,
        start_frequency=start,
        slope=slope,
        start_phase=continuous_phase(duration=duration, start_frequency=start, slope=slope),
        sweep=np.repeat(np.arange(durations.size), 2),
    )


def made_up_map(marks: list, target_ranges: list) -> RowMap:
    """Floor with a peak at each of the marks: range, power, range rate, cause and body."""
    range_, rate = np.linspace(0.0, 30.0, 61), np.linspace(-32.0, 32.0, 33)
    power = np.full((rate.size, range_.size), FLOOR)
    for r, p, v, _, _ in marks:
        power[np.argmin(abs(rate - v)), np.argmin(abs(range_ - r))] = p
    return RowMap(
        range=range_,
        range_rate=rate,
        power_db=power,
        detection_range=np.array([m[0] for m in marks]),
        detection_range_rate=np.array([m[2] for m in marks]),
        detection_power_db=np.array([m[1] for m in marks]),
        detection_cause=tuple(m[3] for m in marks),
        detection_origin=tuple(m[4] or "" for m in marks),
        target_range=np.array(target_ranges),
        target_range_rate=np.full(len(target_ranges), -4.0),
    )


@pytest.fixture
def make_row() -> Callable[..., PaperRow]:
    """A row of made-up numbers; ghosts are (kind, range, power over the strongest target)."""

    def make(
        scenario="A",
        radar="radar 1",
        *,
        waveform="conventional",
        synchronous=True,
        mitigation="none",
        ghosts=(),
        floor_rise=0.0,
        hidden=(),
    ) -> PaperRow:
        truth = TARGETS[radar]
        strongest = max(power for _, _, power in truth)
        peaks = [(r, p) for name, r, p in truth if name not in hidden]
        peaks += [(r, strongest + over) for _, r, over in ghosts]
        range_ = np.arange(0.0, 40.0, 0.1)
        power = np.full(range_.size, 10 ** ((FLOOR + floor_rise) / 10))
        for place, level in peaks:
            power += 10 ** (level / 10) * np.exp(-(((range_ - place) / 0.15) ** 2))
        profile = 10 * np.log10(power)
        marks = [(r, p, -4.0, "target", name) for name, r, p in truth if name not in hidden]
        marks += [(r, strongest + over, -2.0, kind, None) for kind, r, over in ghosts]
        return PaperRow(
            scenario=scenario,
            radar=radar,
            waveform=waveform,
            synchronous=synchronous,
            mitigation=mitigation,
            targets=tuple(
                TargetRow(
                    name=name,
                    range_m=r,
                    closing_speed_mps=4.0,
                    azimuth_deg=-3.0,
                    detected=name not in hidden,
                    range_error_m=None if name in hidden else 0.02,
                    speed_error_mps=None if name in hidden else 0.01,
                    azimuth_error_deg=None if name in hidden else 0.05,
                    snr_db=None if name in hidden else p - FLOOR,
                )
                for name, r, p in truth
            ),
            ghosts=tuple(
                GhostRow(
                    kind=kind,
                    range_m=r,
                    closing_speed_mps=2.0,
                    azimuth_deg=4.0,
                    power_over_strongest_target_db=over,
                )
                for kind, r, over in ghosts
            ),
            missed=len(hidden),
            floor_rise_db=floor_rise,
            other_echoes=3,
            profile_range=range_,
            profile_power_db=profile,
            noise_floor_db=FLOOR,
            mean_threshold_db=float(profile.mean()),
            detection_range=np.array([r for r, _ in peaks]),
            detection_power_db=np.array([p for _, p in peaks]),
            map=made_up_map(marks, [r for _, r, _ in truth]),
        )

    return make


@pytest.fixture
def scene() -> Scene:
    """A straight street with a wall, a tree and two cars, the second of which carries a radar."""
    road = Plate(
        centre=(0.0, 0.0, 0.0),
        half_u=(40.0, 0.0, 0.0),
        half_v=(0.0, 6.0, 0.0),
        material="asphalt",
        part="road",
    )
    wall = Plate(
        centre=(0.0, 9.0, 3.0),
        half_u=(20.0, 0.0, 0.0),
        half_v=(0.0, 0.0, 3.0),
        material="brick",
        part="wall",
    )
    return Scene(
        time=0.0,
        actors=(
            Actor(name="road", kind="road", plates=(road,)),
            Actor(name="house", kind="building", plates=(wall,)),
            Actor(
                name="tree",
                kind="tree",
                pose=Pose(x=3.0, y=-7.0),
                mesh=cuboid(2.0, 2.0, 3.0, "leaf", base=1.5),
            ),
            Actor(
                name="vehicle <1>",
                kind="vehicle",
                pose=Pose(x=-6.0, y=-1.75),
                velocity=(10.0, 0.0, 0.0),
                mesh=cuboid(4.5, 1.8, 1.4, "metal", base=0.2),
            ),
            Actor(
                name="vehicle 2",
                kind="vehicle",
                pose=Pose(x=8.0, y=1.75, yaw=np.pi),
                velocity=(-12.0, 0.0, 0.0),
                mesh=cuboid(4.5, 1.8, 1.4, "metal", base=0.2),
            ),
        ),
        radars=(Radar(name="radar 2", mount=Pose(x=2.3, z=0.5)),),
        carriers=(4,),
    )


@pytest.fixture
def results(make_row: Callable[..., PaperRow], scene: Scene) -> PaperResults:
    """Results of a run in which all the paper's claims hold except the last one."""
    indirect = (("indirect", 16.0, -3.6), ("indirect", 18.5, -9.3))
    direct = (("direct", 6.6, 22.5),)
    rows = [make_row("A", "radar 1"), make_row("A", "radar 2")]
    for mitigation in ("none", "blanking"):
        for scenario, radar, twins in (("B", "radar 1", indirect), ("C", "radar 2", direct)):
            for waveform in ("conventional", "diverse", "fixed-per-radar"):
                for synchronous in (True, False):
                    ghosts = twins if waveform == "conventional" and synchronous else ()
                    rise = 0.0 if ghosts else 28.0 if mitigation == "none" else 3.0
                    hidden = ("far <car>",) if rise > 10 and scenario == "C" else ()
                    if scenario == "C" and waveform == "diverse":
                        ghosts = (("multipath", 24.0, -30.0), ("unexplained", 27.0, -40.0))
                        hidden = ("vehicle 4", *hidden)
                    rows.append(
                        make_row(
                            scenario,
                            radar,
                            waveform=waveform,
                            synchronous=synchronous,
                            mitigation=mitigation,
                            ghosts=ghosts,
                            floor_rise=rise,
                            hidden=hidden,
                        )
                    )
    rng = np.random.default_rng(1)
    return PaperResults(
        seed=1,
        versions={"polychirp": "0.1.0", "numpy": np.__version__},
        wall_time_s=12.3,
        rows=tuple(rows),
        claims=paper_claims(radar_1="radar 1", radar_2="radar 2"),
        conventional=triangles(np.full(16, 1.5e-3), np.full(16, 900e6)),
        diverse=triangles(rng.uniform(1e-3, 2e-3, 16), rng.uniform(0.8e9, 1e9, 16)),
        scene=scene,
        notes=("Made-up numbers & no physics.",),
    )
