"""Worker that compiles kernels: it calls the functions of each part once, on small data.

A part is a piece of a real trial, so that numba compiles the kernels for the types of real trials.
No kernel is listed here: one that is added to a stage is compiled with the part of that stage.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache
from typing import TYPE_CHECKING, Final

import numpy as np

from polychirp.kernel_cache import serve

if TYPE_CHECKING:
    from polychirp.channel.base import Part as Mechanism
    from polychirp.channel.scene.world import World
    from polychirp.model.if_frame import IfFrame, IfParts
    from polychirp.model.ramp import RampSchedule
    from polychirp.model.scene import Scene
    from polychirp.study.spec import Study

NUM_SWEEPS: Final = 4
"""Number of triangles in a frame; chosen: the receiver needs some ramps to find points."""

VEHICLES: Final = ("vehicle-2", "vehicle-4", "target-2")
"""Vehicles on the street: two with radars, and one whose facets and panes return echoes."""

NUM_POINTS: Final = 400
"""Number of point scatterers; chosen: so many paths are synthesised in batches."""


@cache
def _study() -> Study:
    """Study of two approaching cars with radars, and a van; coarse meshes make the work short.

    The mounts are given as numbers, since a search for the paper's mounts needs fine meshes.
    """
    from polychirp.frames import Pose
    from polychirp.study.spec import Study, StudyRadar
    from polychirp.traffic.paper import paper_street
    from polychirp.waveform import DiverseTriangular

    street = paper_street()
    vehicles = [replace(one, max_edge=0.2, coarseness=3.0) for one in street.vehicles]
    return Study(
        name="warm-up",
        seed=1,
        street=replace(street, vehicles=tuple(one for one in vehicles if one.name in VEHICLES)),
        radars=tuple(
            StudyRadar(
                name=name, vehicle=name, mount=Pose(x=x, z=0.5), waveform=DiverseTriangular()
            )
            for name, x in (("vehicle-2", 2.08), ("vehicle-4", 2.32))
        ),
        targets=("target-2", "vehicle-4"),
        num_sweeps=NUM_SWEEPS,
    )


@cache
def _street() -> Scene:
    from polychirp.study.spec import scene_of

    return scene_of(_study())


def profiles() -> None:
    """Compile kernels of the range response and of the paper's receiver."""
    from polychirp.receiver.alternatives.paper_receiver import PaperReceiver
    from polychirp.receiver.overview.range_response import range_response
    from polychirp.receiver.selection import AutoReceiver

    range_response(AutoReceiver(), _frame(), _parts())
    PaperReceiver().detect(_frame())


def range_doppler() -> None:
    """Compile kernels of the range-Doppler receiver."""
    from polychirp.receiver.range_doppler.chain import RangeDoppler
    from polychirp.rng import Streams
    from polychirp.waveform import Sawtooth

    waveform = Sawtooth(bandwidth=1e9, ramp_duration=1e-3)
    frame = _frame_of_points(waveform.schedule(num_sweeps=16, streams=Streams(seed=1)))
    RangeDoppler().detect(frame)


def coherent() -> None:
    """Compile kernels of the coherent receiver."""
    from polychirp.receiver.coherent.chain import CoherentReceiver

    CoherentReceiver(greatest_range=20.0, greatest_speed=10.0).detect(_frame())


def _parts() -> IfParts:
    """Parts of the frame of points: all samples are the echo, and the other parts are zero."""
    from polychirp.model.if_frame import IfParts

    echo = _frame().samples
    return IfParts(
        samples=np.stack([echo, *[np.zeros_like(echo)] * 4]),
        names=("echo", "multipath", "direct", "indirect", "noise"),
    )


@cache
def _frame() -> IfFrame:
    from polychirp.study.spec import schedules_of

    return _frame_of_points(schedules_of(_study())[0])


def _frame_of_points(schedule: RampSchedule) -> IfFrame:
    """Frame of five echoes in noise: two share a cell, one accelerates and one is weak."""
    from polychirp.model.antenna import AntennaArray
    from polychirp.model.if_frame import IfFrame, sample_times
    from polychirp.model.radar import Converter
    from polychirp.receiver.signal_model.point_signal import replica

    points = (
        # range, m; range rate, m/s; its derivative, m/s²; amplitude over the noise's rms
        (6.0, 0.0, 0.0, 30.0),
        (9.0, -4.0, 0.0, 10.0),
        (9.04, -4.3, 0.0, 9.0),
        (13.0, 6.0, 12.0, 20.0),
        (20.0, 2.0, 0.0, 0.5),
    )
    array, times = AntennaArray(), sample_times(schedule, Converter())
    draw = np.random.default_rng(1)
    shape = (array.num_channels, schedule.num_ramps, times.most_samples)
    samples = np.sqrt(0.5) * (draw.normal(size=shape) + 1j * draw.normal(size=shape))
    start = float(schedule.start_time[0])
    for *motion, amplitude in points:
        signal = replica(schedule, times, motion=np.array(motion), time=start)
        phases = np.exp(-2j * np.pi * draw.random(array.num_channels))
        samples += amplitude * phases[:, None, None] * signal
    return IfFrame(samples=samples * times.is_sample, times=times, schedule=schedule, array=array)


def synthesis() -> None:
    """Compile kernels of the stretch engine that sum path by path."""
    _synthesize(_street())


def codes() -> None:
    """Compile kernels of the stretch engine for ramps and carriers with a code."""
    from polychirp.channel.tracers.free_space import FreeSpace
    from polychirp.rng import Streams
    from polychirp.synthesis.stretch.engine import Stretch
    from polychirp.waveform import PhaseCodedRamp, Pmcw

    scene = _street()
    paths = FreeSpace().trace(scene)
    ramps, carrier = (
        waveform.schedule(num_sweeps=1, streams=Streams(seed=1))
        for waveform in (
            PhaseCodedRamp(ramp_duration=1e-3, num_chips=16),
            Pmcw(order=5, chip_duration=1e-5),
        )
    )
    for transmitter in (0, 1):
        schedules = [ramps, carrier]
        Stretch().contribution(scene, schedules, [paths], victim=0, transmitter=transmitter)


def tables() -> None:
    """Compile kernels of the IF filter's response to chirps, and of phase noise."""
    from polychirp.model.if_filter import IfFilter
    from polychirp.model.oscillator import PhaseNoise
    from polychirp.rng import Streams
    from polychirp.synthesis.impairments.phase_error import noise_record
    from polychirp.synthesis.stretch.chirp_response import response_table

    response_table(IfFilter(), rate=1e12, highest=1e6, num_orders=2)
    phase = noise_record(
        PhaseNoise(), begin=0.0, end=1e-4, highest_offset=1e6, streams=Streams(seed=1)
    )
    phase(np.zeros((1, 2)))


def bundles() -> None:
    """Compile kernels of the stretch engine that sum many paths in a batch."""
    _synthesize(_cloud_of_points())


def _synthesize(scene: Scene) -> None:
    """Synthesise one radar's own echoes and the other's signal, with the paper's two waveforms."""
    from polychirp.channel.tracers.free_space import FreeSpace
    from polychirp.study.paper.scenarios import WAVEFORMS
    from polychirp.study.spec import schedules_of
    from polychirp.synthesis.stretch.engine import Stretch

    paths = FreeSpace().trace(scene)
    for waveform in (WAVEFORMS["conventional"], WAVEFORMS["diverse"]):
        radars = tuple(replace(radar, waveform=waveform) for radar in _study().radars)
        schedules = schedules_of(replace(_study(), num_sweeps=1, radars=radars))
        for transmitter in (0, 1):
            Stretch().contribution(scene, schedules, [paths], victim=0, transmitter=transmitter)


def _cloud_of_points() -> Scene:
    from polychirp.model.scene import Actor, PointScatterer

    scene = _street()
    place = np.random.default_rng(1).uniform([30.0, -3.0, 0.5], [34.0, 3.0, 3.0], (NUM_POINTS, 3))
    points = tuple(PointScatterer(position=tuple(row), rcs=1.0) for row in place.tolist())
    cloud = Actor(name="cloud", kind="object", velocity=(-8.0, 0.0, 0.0), points=points)
    return replace(scene, actors=(*scene.actors, cloud))


def targets() -> None:
    """Compile kernels of the nearest points of targets."""
    from polychirp.channel.scene.ground_truth import truth

    truth(_street(), 0, ("target-2",), has_occlusion=False)


def visibility() -> None:
    """Compile kernels of the trees of boxes of bodies, of occlusion and of transmission."""
    from polychirp.channel.scene.ground_truth import truth

    truth(_street(), 0, ("vehicle-4", "target-2"))


@cache
def _world() -> World:
    from polychirp.channel.tracers.composite import Composite

    return Composite().prepare(_street())


def _trace(is_wanted: Callable[[Mechanism], bool]) -> None:
    """Trace the mechanisms for which ``is_wanted`` is true, between all radars of the street."""
    from polychirp.channel.base import all_pairs
    from polychirp.channel.tracers.composite import Composite

    world = _world()
    pairs = all_pairs(world.scene)
    strongest = np.zeros((len(world.scene.radars), len(world.scene.radars)))
    for mechanism in Composite(diffuse=True).parts(world):
        if is_wanted(mechanism):
            mechanism.trace(world, pairs, strongest)


def edges() -> None:
    """Compile kernels of direct paths, diffraction, mirrors, rough planes and leaves."""
    _trace(lambda part: not part.name.startswith(("facets", "mirrored", "bent", "bounces")))


def facets() -> None:
    """Compile kernels of physical optics, which computes echoes of facets, and of bent waves."""
    from polychirp.channel.bent_echoes.edge_waves import NUM_EDGES, Edges, edge_waves

    bodies = ("vehicle-4", "target-2")
    _trace(lambda part: part.name.endswith(bodies) and not part.name.startswith("bounces"))
    axes = np.zeros((NUM_EDGES, 3))
    edge_waves(Edges(axes, axes, axes, np.zeros((NUM_EDGES, 2, 2))), np.ones((1, 3)), 1.0)


def bounces() -> None:
    """Compile kernels of ray tubes, which follow bounces between bodies, and of flat parts."""
    from polychirp.channel.ray_tubes.paths import tube_paths
    from polychirp.channel.tracers.composite import Composite

    _trace(lambda part: part.name == "bounces from vehicle-4")
    world = Composite().prepare(_two_plates())
    tube_paths(world, np.array([[0, 0]]), first=len(world.surfaces) - 2)


def _two_plates() -> Scene:
    """The street with two plates: the first turns a wave of the first radar to the last one."""
    from polychirp.frames import Pose
    from polychirp.model.mesh import Mesh
    from polychirp.model.scene import Actor

    scene = _street()
    mesh = Mesh(
        vertex=np.array([[0, -0.1, -0.1], [0, 0.1, -0.1], [0, 0.1, 0.1], [0, -0.1, 0.1]]),
        face=np.array([[0, 1, 2], [0, 2, 3]]),
        material=np.zeros(2, dtype=np.int64),
        part=np.zeros(2, dtype=np.int64),
        materials=("metal",),
        parts=("body",),
    )
    x, y, z = (float(value) for value in scene.radar_position[0])
    poses = Pose(x=x + 5, y=y, z=z, yaw=2.98), Pose(x=x + 2, y=y + 1, z=z)
    plates = [
        Actor(name=name, kind="object", mesh=mesh, pose=pose)
        for name, pose in zip(("first plate", "last plate"), poses, strict=True)
    ]
    return replace(scene, actors=(*scene.actors, *plates))


def point_vehicles() -> None:
    """Compile kernels of the tracer that replaces vehicles by points."""
    from polychirp.channel.point_vehicles.tracer import PointVehicles

    PointVehicles().trace(_street())


PARTS: Final[Mapping[str, Callable[[], None]]] = {
    "visibility": visibility,
    "bounces": bounces,
    "facets": facets,
    "synthesis": synthesis,
    "codes": codes,
    "tables": tables,
    "targets": targets,
    "bundles": bundles,
    "edges": edges,
    "profiles": profiles,
    "range-Doppler": range_doppler,
    "coherent": coherent,
    "point vehicles": point_vehicles,
}
"""Function of each part, by the part's name in `kernel_parts.PARTS`."""

if __name__ == "__main__":
    serve(PARTS)
