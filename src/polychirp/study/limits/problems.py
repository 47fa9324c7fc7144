"""Problems of a study that prevent it from running, each with its place in the study file."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from polychirp.channel.base import AtFrequency
from polychirp.channel.materials.library import check_materials, material_table
from polychirp.channel.point_vehicles.tracer import PointVehicles
from polychirp.channel.scene.ground_truth import refuse_radar_inside_body
from polychirp.channel.tracers.composite import Composite
from polychirp.channel.tracers.sionna import SionnaRt, refuse_untraceable
from polychirp.errors import CapabilityError, InputError, did_you_mean
from polychirp.model.if_frame import sample_times
from polychirp.model.scene import Scene
from polychirp.study.spec import (
    Study,
    StudyRadar,
    body_names,
    scene_of,
    schedule_of,
    schedules_of,
    tracer_of,
)


def problems(study: Study) -> Iterator[tuple[str, str]]:
    """Place and description of every problem that prevents a study from running."""
    yield from _plain_problems(study)
    names_agree = True
    for problem in _name_problems(study):
        names_agree = False
        yield problem
    if study.num_sweeps >= 1 and study.seed >= 0:
        for number, radar in enumerate(study.radars):
            yield from _ramp_problems(study, radar, number=number)
    if names_agree:
        yield from _street_problems(study)


def _plain_problems(study: Study) -> Iterator[tuple[str, str]]:
    if not study.name.strip() or set(study.name) & set("/\\\0"):
        yield "name", "must have a character, and no slash: results are stored under it"
    if study.seed < 0:
        yield "seed", f"is {study.seed}; use 0 or more"
    if study.num_sweeps < 1:
        yield "num_sweeps", f"is {study.num_sweeps}, so the frame is empty; use 1 or more"
    if not study.refresh_interval > 0:
        yield "refresh_interval", f"is {study.refresh_interval:g} s; use more than 0 s"
    if not study.least_traced_time >= 0:
        yield "least_traced_time", f"is {study.least_traced_time:g} s; use 0 s or more"
    if isinstance(study.tracer, AtFrequency) and not study.tracer.carrier > 0:
        yield "tracer.frequency", f"is {study.tracer.carrier:g} Hz; use more than 0 Hz"


def _name_problems(study: Study) -> Iterator[tuple[str, str]]:
    vehicles = [vehicle.name for vehicle in study.street.vehicles]
    bodies = list(body_names(study.street))
    radars = [radar.name for radar in study.radars]
    if not radars:
        yield "radars", "there is none; write at least one [[radars]] table"
        return
    yield from _twice(radars, "radars.{}.name", "another radar has")
    for number, radar in enumerate(study.radars):
        yield from _unknown([radar.vehicle], vehicles, f"radars.{number}.vehicle", "vehicle")
    for number, name in enumerate(study.victims):
        yield from _unknown([name], radars, f"victims.{number}", "radar")
    for number, name in enumerate(study.targets):
        yield from _unknown([name], bodies, f"targets.{number}", "vehicle or point")
    yield from _twice(study.victims, "victims.{}", "the list already has")
    yield from _twice(study.targets, "targets.{}", "the list already has")


def _twice(names: list[str] | tuple[str, ...], place: str, who: str) -> Iterator[tuple[str, str]]:
    for number, name in enumerate(names):
        if name in names[:number]:
            yield place.format(number), f"{who} the name '{name}'; give each its own"


def _unknown(
    names: list[str], known: list[str], place: str, what: str
) -> Iterator[tuple[str, str]]:
    for name in names:
        if name not in known:
            hint = did_you_mean(name, known) if known else "the street has none"
            yield place, f"there is no {what} '{name}'; {hint}"


def _ramp_problems(study: Study, radar: StudyRadar, *, number: int) -> Iterator[tuple[str, str]]:
    try:
        sample_times(schedule_of(study, radar), radar.converter)
    except InputError as error:
        yield f"radars.{number}.waveform", str(error)


def _street_problems(study: Study) -> Iterator[tuple[str, str]]:
    """Problems of bodies and positions, for a study whose names agree."""
    is_built = True
    for number, vehicle in enumerate(study.street.vehicles):
        try:
            vehicle.surface()
        except InputError as error:
            is_built = False
            field = "" if vehicle.mesh is None else ".mesh"
            yield f"street.vehicles.{number}{field}", str(error)
    if not is_built:
        return
    try:
        scene = scene_of(study)
    except InputError as error:
        yield "street", str(error)
        return
    yield from _same_places(scene)
    for number, (radar, carrier) in enumerate(zip(scene.radars, scene.carriers, strict=True)):
        try:
            refuse_radar_inside_body(replace(scene, radars=(radar,), carriers=(carrier,)))
        except InputError as error:
            yield f"radars.{number}.mount", str(error)
    try:
        tracer = tracer_of(study, schedules_of(study))
    except InputError:  # ramps that cannot be are told by their radars' problems
        return
    if isinstance(tracer, Composite | PointVehicles | SionnaRt):
        yield from _material_problems(scene, tracer)
    if isinstance(tracer, SionnaRt):
        try:
            refuse_untraceable(scene)
        except CapabilityError as error:
            yield "tracer", str(error)


def _same_places(scene: Scene) -> Iterator[tuple[str, str]]:
    """Radars at the place of one before them: the wave between them has no length."""
    place = scene.radar_position
    for number, radar in enumerate(scene.radars):
        same = np.flatnonzero(np.all(place[:number] == place[number], axis=-1))
        if same.size:
            other = scene.radars[same[0]].name
            yield (
                f"radars.{number}.mount",
                f"radars '{other}' and '{radar.name}' are at the same position; move one of them",
            )


def _material_problems(
    scene: Scene, tracer: Composite | PointVehicles | SionnaRt
) -> Iterator[tuple[str, str]]:
    table = material_table({row.name: row for row in tracer.materials})
    for actor in scene.actors:
        names = {*actor.mesh.materials, *(plate.material for plate in actor.plates)}
        try:
            check_materials(names, table, tracer.carrier)
        except InputError as error:
            yield "street", f"'{actor.name}' cannot be traced: {error}"
