"""`PointVehicles` — a fast tracer for hundreds of vehicles, which are boxes with a few points."""

from dataclasses import dataclass
from typing import Literal

from polychirp.channel.base import AtFrequency, Capability, gather, without_weak
from polychirp.channel.materials.library import NamedMaterial, material_table
from polychirp.channel.point_vehicles.scattering_points import VehicleModel
from polychirp.errors import InputError
from polychirp.model.paths import PropagationPaths
from polychirp.model.scene import Scene
from polychirp.spec import Spec
from polychirp.units import Hertz, Metres, Ratio, from_db


@dataclass(frozen=True, slots=True, kw_only=True)
class PointVehicles(AtFrequency, Spec):
    """Line of sight, mirrors in road and walls, and vehicles as boxes with a few points.

    Points of a street and moving parts of people and bicycles echo as well.

    Only the bounding box of a vehicle's mesh is used. The box hides everything behind it, and
    points on it echo, each with its exact delay and Doppler shift. There are three models:

    - ``"tables"``: twelve points with the echoes that physical optics gives for the built-in body
      whose box is most similar (`scattering_points.TablePoints`); their phases are random.
    - ``"3gpp-one"``, ``"3gpp-five"``: the vehicle of 3GPP TR 38.901, clause 7.9.2.1, as one point
      or five (`scattering_points.LobePoints`); phases, spread and cross polarisation are random.

    Random values are drawn once for every vehicle and point from ``seed`` and the vehicle's name;
    they stay the same from snapshot to snapshot. The mean power over some degrees of aspect and
    some vehicles is right, but that of a single glint is not. Besides the effects that `Composite`
    neglects, this tracer neglects reflections in road and walls on the way to and from a vehicle's
    points, paths through windows and below vehicles, meshes of actors that are no vehicles, and a
    vehicle's echo to a radar on it.

    The time of a trace grows with the number of paths no longer than ``max_length``: at a constant
    density of traffic, in proportion to the number of vehicles and to that of radars.

    Parameters
    ----------
    frequency : Hz, at which amplitudes and materials are evaluated; None: at that of
        the study's radars (`study.spec.tracer_of`), and at 79 GHz without a study
    dynamic_range : power ratio by which a path may be weaker than the strongest path of its
        transmitter and receiver, weighted with the gains of their antennas' elements
    max_length : m, of the longest path that is traced, from transmitter to receiver
    model : model of a vehicle's points
    reflecting_planes : true if road and walls mirror waves; they block waves in any case
    seed : of all random values
    materials : materials added to the known ones; one with a known name replaces that material

    Examples
    --------
    >>> from polychirp.frames import Pose
    >>> from polychirp.model.radar import Radar
    >>> from polychirp.model.scene import Actor, Scene
    >>> from polychirp.testing.shapes import box, mesh_of
    >>> mesh = mesh_of(box((4.6, 1.8, 1.4), 2.0))
    >>> cars = tuple(
    ...     Actor(name=f"{x} m", kind="vehicle", mesh=mesh, pose=Pose(x=x)) for x in (0.0, 20.0))
    >>> radar = Radar(name="front", mount=Pose(x=2.3))
    >>> scene = Scene(time=0.0, actors=cars, radars=(radar,), carriers=(0,))
    >>> PointVehicles(model="3gpp-one").trace(scene).num_paths
    1
    """

    frequency: Hertz | None = None
    dynamic_range: Ratio = from_db(60.0)
    max_length: Metres = 300.0
    model: VehicleModel = "tables"
    reflecting_planes: bool = True
    seed: int = 1
    materials: tuple[NamedMaterial, ...] = ()
    kind: Literal["point-vehicles"] = "point-vehicles"

    def __post_init__(self) -> None:
        if not self.carrier > 0:
            raise InputError(f"frequency is {self.carrier:g} Hz; choose more than 0 Hz")
        if not self.dynamic_range >= 1:
            raise InputError(
                f"dynamic_range is a ratio of {self.dynamic_range:g}; choose 1 (0 dB) or more"
            )
        if not self.max_length > 0:
            raise InputError(f"max_length is {self.max_length:g} m; choose more than 0 m")
        if self.seed < 0:
            raise InputError(f"seed is {self.seed}; choose 0 or more")

    @property
    def capabilities(self) -> frozenset[Capability]:
        """Mechanisms that the tracer has."""
        found: set[Capability] = {"line-of-sight", "occlusion", "points", "vehicle-points"}
        if self.reflecting_planes:
            found.add("planes")
        return frozenset(found)

    def trace(self, scene: Scene) -> PropagationPaths:
        """Every path between the radars of ``scene``, at its time.

        `InputError` is raised if a plate is of an unknown material.
        """
        from polychirp.channel.point_vehicles.paths import (
            direct,
            echoes,
            mirrored,
            moving,
            prepared,
        )

        street = prepared(
            scene,
            frequency=self.carrier,
            dynamic_range=self.dynamic_range,
            max_length=self.max_length,
            table=material_table({row.name: row for row in self.materials}),
        )
        known = [direct(street), *moving(street)]
        if self.reflecting_planes:
            known.append(mirrored(street))
        found = echoes(street, model=self.model, seed=self.seed, known=gather(known))
        return without_weak(gather([*known, found]), scene, self.dynamic_range)
