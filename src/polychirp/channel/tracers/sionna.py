r"""`SionnaRt` — NVIDIA's Sionna RT as a tracer: an independent check of reflections and Doppler.

Sionna writes a path's field as :math:`a\,e^{-j2\pi f\tau}` (with e^{+jωt}), so a does not contain
the phase of the delay. Sionna's polarisations are :math:`\hat\theta` and :math:`\hat\varphi` of the
directions out of both antennas. Our ``transfer`` A and ``delay_rate`` are, with Sionna's Doppler
shift :math:`f_\Delta`,

.. math:: A = S\,a\,S,\quad S = \begin{bmatrix}-1 & 0\\ 0 & 1\end{bmatrix},
    \qquad \dot\tau = -f_\Delta/f

because our polarisations are :math:`V = -\hat\theta` and :math:`H = \hat\varphi`.

Sionna's τ counts the whole way in air, and its transmission coefficient T of a sheet of thickness t
has the phase of the sheet from face to face. The air that the sheet displaces would count twice, so
A has a factor :math:`e^{+jkt\cos\theta}` for every sheet that the path crosses at the angle θ.

Sionna is imported only when a scene is traced, and only after a check of the version of the LLVM
library that compiles its kernels: with versions 15 and 16 the process aborts.
"""

import ctypes
import os
import re
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.metadata import Distribution, PackageNotFoundError, distribution
from pathlib import Path
from typing import Annotated, Any, Final, Literal, NamedTuple

import numpy as np

from polychirp.axes import BoolArray, ComplexArray, FloatArray, IntArray
from polychirp.channel.base import AtFrequency, Capability, no_paths, without_weak
from polychirp.channel.materials.library import NamedMaterial, check_materials, material_table
from polychirp.constants import SPEED_OF_LIGHT, VACUUM_PERMITTIVITY
from polychirp.errors import CapabilityError, InputError, ModelWarning
from polychirp.model.material import Material
from polychirp.model.paths import Bounce, PropagationPaths
from polychirp.model.scene import Scene
from polychirp.spec import Spec
from polychirp.units import Between, Hertz, Ratio, from_db

OLDEST_LLVM: Final = 17
"""Oldest major version of LLVM that works. Dr.Jit, which compiles for Sionna, refuses 14; with
15 and 16 the process aborts ("cannot select fmaximum")."""

OLDEST_SIONNA: Final = 2
"""Oldest major version of Sionna RT that works."""

CONDUCTOR_CONDUCTIVITY: Final = 1e12
"""Conductivity that represents a perfect conductor, S/m. Chosen: |1 + Γs|, which is 0 for a perfect
conductor, is then 4e-6 at 79 GHz."""

CONDUCTOR_THICKNESS: Final = 1e-3
"""Thickness of a slab of that conductor, m. Chosen: with thicker slabs, Sionna's single precision
gives Γ = NaN."""

HALF_SPACE_THICKNESS: Final = 10.0
"""Thickness of a slab that represents a half-space, m, because Sionna has only slabs. Chosen: at
`MIN_LOSS_TANGENT`, no wave returns from the far side."""

MIN_LOSS_TANGENT: Final = 2e-3
"""Least ε″/ε′ of a slab that represents a half-space, so that no wave returns from its far side.

Chosen: it changes the phase of Γ by less than 2e-3 rad, whereas with a smaller value single
precision loses the imaginary part of √ε, and with it the slab's loss."""

_INSTALL = 'pip install "polychirp[sionna]"'
_ADVICE = f"install one with {_INSTALL}, or name another in DRJIT_LIBLLVM_PATH"


def llvm_version(library: str) -> int | None:
    """Major version of an LLVM library, by its file name or else by a call; None if unknown.

    The call is LLVMGetVersion, which exists since LLVM 16; older libraries without a number in
    their names are unknown.

    >>> [llvm_version(name) for name in ("libLLVM-15.so.1", "lib/libLLVM.so.23.1")]
    [15, 23]
    """
    for name in (Path(library).name, Path(library).resolve().name):
        match = re.match(r"(?:lib)?LLVM(?:-C)?(?:-|\.so\.)(\d+)", name)
        if match:
            return int(match[1])
    numbers = (ctypes.c_uint(), ctypes.c_uint(), ctypes.c_uint())
    try:
        ctypes.CDLL(library).LLVMGetVersion(*(ctypes.byref(number) for number in numbers))
    except (OSError, AttributeError):
        return None
    return numbers[0].value


def usable_llvm(
    *,
    chosen: str | None,
    packaged: Sequence[str],
    installed: Sequence[str],
    version_of: Callable[[str], int | None] = llvm_version,
) -> str:
    """The LLVM library that Sionna shall compile with.

    If the user has chosen one, it is taken, or refused if too old. Otherwise it is the newest one
    of the Python packages, or, if they have none that is new enough, of the system.

    Parameters
    ----------
    chosen : value of the environment variable DRJIT_LIBLLVM_PATH, None if it is not set
    packaged, installed : paths of libraries in Python packages, and in the system's folders
    version_of : function that gives the major version of a library, None if unknown

    Raises
    ------
    CapabilityError
        There is no library, or none that is new enough.

    Examples
    --------
    >>> usable_llvm(chosen=None, packaged=[], installed=["libLLVM-15.so.1", "libLLVM.so.19.1"])
    'libLLVM.so.19.1'
    """
    if chosen:
        version = version_of(chosen)
        if version is None or version < OLDEST_LLVM:
            raise CapabilityError(
                f"DRJIT_LIBLLVM_PATH names '{chosen}', which is {_called(version)}, but Sionna RT "
                f"needs LLVM {OLDEST_LLVM} or newer (15 and 16 would abort the process); unset it "
                f"and {_INSTALL}, or name a newer one"
            )
        return chosen
    for libraries in (packaged, installed):
        known = [(version_of(library) or 0, library) for library in libraries]
        new = [(version, library) for version, library in known if version >= OLDEST_LLVM]
        if new:
            return max(new)[1]
    if installed or packaged:
        newest = max((version_of(library) or 0) for library in (*packaged, *installed))
        raise CapabilityError(
            f"Sionna RT needs LLVM {OLDEST_LLVM} or newer, but the newest here is "
            f"{_called(newest or None)} (15 and 16 would abort the process); {_ADVICE}"
        )
    raise CapabilityError(f"Sionna RT needs LLVM, and there is none here; {_ADVICE}")


def _called(version: int | None) -> str:
    return "no LLVM that tells its version" if version is None else f"LLVM {version}"


def llvm_for_sionna() -> str:
    """Path of the LLVM library that Sionna RT will use here; Sionna RT is not imported.

    `CapabilityError` is raised if Sionna RT is not installed, is too old, or has no LLVM that it
    can use.
    """
    _need_sionna()
    return usable_llvm(
        chosen=os.environ.get("DRJIT_LIBLLVM_PATH"),
        packaged=_packaged_libraries(),
        installed=_installed_libraries(),
    )


def _need_sionna() -> None:
    try:
        version = distribution("sionna-rt").version
    except PackageNotFoundError:
        raise CapabilityError(
            f"the tracer 'sionna' needs Sionna RT, which is not installed; {_INSTALL}"
        ) from None
    if int(version.split(".")[0]) < OLDEST_SIONNA:
        raise CapabilityError(
            f"the tracer 'sionna' needs Sionna RT {OLDEST_SIONNA} or newer, but {version} is "
            f"installed; {_INSTALL}"
        )


def _packaged_libraries() -> list[str]:
    """LLVM libraries of the package karellen-llvm-core."""
    try:
        package: Distribution = distribution("karellen-llvm-core")
    except PackageNotFoundError:
        return []
    found = [file for file in package.files or () if file.name.startswith("libLLVM")]
    paths = [Path(str(package.locate_file(file))).resolve() for file in found]
    return [str(path) for path in paths if path.exists()]


def _installed_libraries() -> list[str]:
    """LLVM libraries in the folders that Dr.Jit searches."""
    places = ("/usr/lib/x86_64-linux-gnu", "/usr/lib/aarch64-linux-gnu", "/usr/lib/wsl/lib")
    return [str(path) for place in places for path in sorted(Path(place).glob("libLLVM*.so.*"))]


@dataclass(frozen=True, slots=True, kw_only=True)
class SionnaRt(AtFrequency, Spec):
    """Sionna RT 2 on the CPU: line of sight, reflection, and transmission through sheets.

    This is an independent check of line of sight, roads, walls, Fresnel coefficients and Doppler,
    not a tracer for studies: it reflects waves from each triangle of a body as from a flat mirror,
    and the bodies' echoes are wrong by 5 to 30 dB. Further limits:

    - All surfaces are sheets that reflect and transmit on both sides; half-spaces are slabs of
      `HALF_SPACE_THICKNESS`. A plate reflects as an infinite mirror if the mirror point is on the
      plate, and else not at all.
    - Positions are those at the instant of reception, without motion during the flight, and
      rounded to single precision around the middle of the radars. Bounce points are right to about
      0.5 mm along the surface, which hardly changes lengths, and Doppler shifts to 5 mHz.
    - A radar's own cover blocks or weakens waves that pass it; legs below 1 cm are dropped.
    - Scenes with point scatterers or turning bodies are refused. Clouds such as foliage are left
      out. So is diffuse reflection, because Sionna gives it a phase that is not random, so that it
      adds up coherently.
    - Sionna has no roughness; this tracer applies it to reflections: `fresnel.roughness_factor`.

    `trace` sets the environment variable DRJIT_LIBLLVM_PATH to the LLVM library that is used.

    Parameters
    ----------
    frequency : Hz, at which amplitudes and materials are evaluated; None: at that of
        the study's radars (`study.spec.tracer_of`), and at 79 GHz without a study
    dynamic_range : power ratio by which a path may be weaker than the strongest path of the same
        transmitter and receiver; the gains of their antennas' elements are included
    max_depth : greatest number of bounces of a path, transmissions included
    num_samples : rays that every radar sends to find bounces; a surface that fills a share p of
        the directions around the radar is missed with probability (1 − p)^num_samples
    diffraction : true if edges and wedges diffract, at most once in a path
    seed : number that starts Sionna's random numbers, which choose what rays do at surfaces
    materials : materials added to the known ones; one of the same name replaces the known one

    Examples
    --------
    >>> sorted(SionnaRt(diffraction=True).capabilities)
    ['diffraction', 'line-of-sight', 'occlusion', 'planes', 'transmission']
    """

    frequency: Hertz | None = None
    dynamic_range: Ratio = from_db(60.0)
    max_depth: int = 3
    num_samples: Annotated[int, Between(greatest=1_000_000_000)] = 1_000_000
    diffraction: bool = False
    seed: int = 1
    materials: tuple[NamedMaterial, ...] = ()
    kind: Literal["sionna"] = "sionna"

    def __post_init__(self) -> None:
        if not self.carrier > 0:
            raise InputError(f"frequency is {self.carrier:g} Hz; choose more than 0 Hz")
        if not self.dynamic_range >= 1:
            raise InputError(
                f"dynamic_range is a ratio of {self.dynamic_range:g}; choose 1 (0 dB) or more"
            )
        if self.max_depth < 0 or self.seed < 0:
            raise InputError(
                f"max_depth is {self.max_depth} and seed is {self.seed}; choose 0 or more"
            )
        if self.num_samples < 1:
            raise InputError(f"num_samples is {self.num_samples}; choose 1 or more")

    @property
    def capabilities(self) -> frozenset[Capability]:
        """Mechanisms that the tracer models; echoes of bodies are no such, as they are wrong."""
        found: set[Capability] = {"line-of-sight", "occlusion", "planes", "transmission"}
        if self.diffraction:
            found.add("diffraction")
        return frozenset(found)

    def trace(self, scene: Scene) -> PropagationPaths:
        """Every path between the radars of ``scene``, at the scene's time.

        Raises
        ------
        CapabilityError
            Sionna RT is not installed or cannot run here, or the scene has point scatterers or
            turning bodies.
        InputError
            A surface is of an unknown material.

        Warns
        -----
        ModelWarning
            The scene has bodies, or clouds.
        """
        table = material_table({row.name: row for row in self.materials})
        every = _parts(scene, table, self.carrier)
        parts = [part for part in every if not table[part.material].is_cloud]
        refuse_untraceable(scene)
        _warn(scene, parts, [part for part in every if table[part.material].is_cloud])
        rt = _sionna()
        if not scene.radars:
            return no_paths(scene, self.carrier)
        origin = scene.radar_position.mean(axis=0)
        there, shapes = _sionna_scene(
            rt,
            scene,
            parts,
            table,
            frequency=self.carrier,
            origin=origin,
            diffraction=self.diffraction,
        )
        solved = rt.PathSolver(deterministic=True)(
            there,
            max_depth=self.max_depth,
            samples_per_src=self.num_samples,
            diffraction=self.diffraction,
            edge_diffraction=self.diffraction,
            seed=self.seed,
        )
        found = _found_paths(solved, shapes, origin)
        paths = _table(scene, self.carrier, found, parts, table)
        return without_weak(paths, scene, self.dynamic_range)


@cache
def _sionna() -> Any:
    """The module ``sionna.rt``, set to compute on the CPU."""
    os.environ["DRJIT_LIBLLVM_PATH"] = llvm_for_sionna()
    import mitsuba

    if "mono_polarized" not in (mitsuba.variant() or ""):
        mitsuba.set_variant("llvm_ad_mono_polarized")
    import sionna.rt

    return sionna.rt


class _Part(NamedTuple):
    """Faces of one material of an actor; ``corner`` m, in the world, ``(face, corner, xyz)``."""

    actor: int
    material: str
    corner: FloatArray


def _parts(scene: Scene, table: Mapping[str, Material], frequency: float) -> list[_Part]:
    """Faces of the scene, in one part for every actor and material."""
    faces: dict[tuple[int, str], list[FloatArray]] = {}
    for index, actor in enumerate(scene.actors):
        for number, name in enumerate(actor.mesh.materials):
            mine = actor.mesh.corners[actor.mesh.material == number]
            if len(mine):
                faces.setdefault((index, name), []).append(actor.pose.to_outer(mine))
        for plate in actor.plates:
            corners = actor.pose.to_outer(plate.triangles)
            faces.setdefault((index, plate.material), []).append(corners)
    check_materials({name for _, name in faces}, table, frequency)
    return [_Part(actor, name, np.concatenate(each)) for (actor, name), each in faces.items()]


def refuse_untraceable(scene: Scene) -> None:
    """Refuse scenes with points, moving parts or turning bodies, by a `CapabilityError`."""
    if any(actor.points or actor.movement for actor in scene.actors):
        raise CapabilityError(
            "the tracer 'sionna' has neither moving parts nor point scatterers; use the tracer "
            "'composite'"
        )
    turning = next((actor.name for actor in scene.actors if actor.yaw_rate), None)
    if turning is not None:
        raise CapabilityError(
            f"the tracer 'sionna' gives each body one velocity, but '{turning}' turns; leave its "
            "yaw_rate at 0, or use the tracer 'composite'"
        )


def _warn(scene: Scene, solid: Sequence[_Part], clouds: Sequence[_Part]) -> None:
    """Warn of scenes that Sionna traces badly or in part."""
    if any(scene.actors[part.actor].mesh.num_faces for part in solid):
        warnings.warn(
            "Sionna RT mirrors waves in the flat triangles of bodies, whose echoes are wrong by 5 "
            "to 30 dB; trust it for line of sight, roads and walls only",
            ModelWarning,
            stacklevel=3,
        )
    if clouds:
        warnings.warn(
            "Sionna RT has no clouds of scatterers: foliage neither blocks nor scatters in it",
            ModelWarning,
            stacklevel=3,
        )


def _sionna_scene(
    rt: Any,
    scene: Scene,
    parts: Sequence[_Part],
    table: Mapping[str, Material],
    *,
    frequency: float,
    origin: FloatArray,
    diffraction: bool,
) -> tuple[Any, dict[int, int]]:
    """Sionna's scene with its origin at ``origin`` (m), and the part of every object's id."""
    import mitsuba as mi

    there = rt.Scene()
    there.frequency = frequency
    names = {part.material for part in parts}
    coats = {name: _radio_material(rt, name, table[name], frequency) for name in names}
    shapes = []
    for number, part in enumerate(parts):
        vertex = np.float32(part.corner - origin).reshape(-1)
        flat = mi.Properties()
        flat["face_normals"] = True
        mesh = mi.Mesh(f"part {number}", len(vertex) // 3, len(part.corner), flat)
        buffers = mi.traverse(mesh)
        buffers["vertex_positions"] = mi.Float(vertex)
        buffers["faces"] = mi.UInt(np.arange(len(vertex) // 3, dtype=np.uint32))
        buffers.update()
        shape = rt.SceneObject(
            mi_mesh=mesh,
            name=f"part {number}",
            radio_material=coats[part.material],
            remove_duplicate_vertices=diffraction,  # wedges are where faces share an edge
        )
        shape.velocity = mi.Vector3f(*map(float, scene.actors[part.actor].velocity))
        shapes.append(shape)
    if shapes:
        there.edit(add=shapes)
    there.tx_array = there.rx_array = rt.PlanarArray(
        num_rows=1, num_cols=1, pattern="iso", polarization="VH"
    )
    for number, (place, speed) in enumerate(
        zip(scene.radar_position - origin, scene.radar_velocity, strict=True)
    ):
        for device, way in ((rt.Transmitter, "to"), (rt.Receiver, "from")):
            where, how = mi.Point3f(*map(float, place)), mi.Vector3f(*map(float, speed))
            there.add(device(f"{way} {number}", position=where, velocity=how))
    return there, {shape.object_id: number for number, shape in enumerate(shapes)}


def _radio_material(rt: Any, name: str, material: Material, frequency: float) -> Any:
    """Sionna's slab of our material."""
    permittivity, conductivity = material.relative_permittivity, material.conductivity
    thickness = material.thickness or HALF_SPACE_THICKNESS
    if material.is_conductor:
        conductivity, thickness = CONDUCTOR_CONDUCTIVITY, CONDUCTOR_THICKNESS
    elif not material.thickness:
        one = 2 * np.pi * frequency * VACUUM_PERMITTIVITY  # S/m for ε″ = 1
        conductivity = max(conductivity, MIN_LOSS_TANGENT * permittivity * one)
    return rt.RadioMaterial(
        name=name,
        thickness=thickness,
        relative_permittivity=permittivity,
        conductivity=float(conductivity),
    )


class _SionnaPaths(NamedTuple):
    """Paths as Sionna found them, as NumPy arrays and in the world.

    ``pair`` ``(path, 2)`` transmitter and receiver; ``response`` ``(path, 2, 2)``, over receiving
    and transmitting (θ, φ); ``shift`` Doppler, Hz ``(path,)``; ``kind`` ``(path, bounce)``,
    Sionna's number, 0 after the last bounce; ``part`` ``(path, bounce)``, an index of the parts;
    ``face`` ``(path, bounce)``, an index of the part's faces; ``point`` m ``(path, bounce, xyz)``
    """

    pair: IntArray
    response: ComplexArray
    shift: FloatArray
    kind: IntArray
    part: IntArray
    face: IntArray
    point: FloatArray


def _found_paths(solved: Any, shapes: Mapping[int, int], origin: FloatArray) -> _SionnaPaths:
    receiver, transmitter, path = np.nonzero(solved.valid.numpy())
    real, imaginary = (np.asarray(x.numpy(), dtype=np.float64) for x in solved.a)
    kind = np.moveaxis(solved.interactions.numpy().astype(np.int64), 0, -1)
    shape = np.moveaxis(solved.objects.numpy().astype(np.int64), 0, -1)
    face = np.moveaxis(solved.primitives.numpy().astype(np.int64), 0, -1)
    point = np.moveaxis(solved.vertices.numpy().astype(np.float64), 0, -2)
    chosen = (receiver, transmitter, path)
    part = np.zeros(kind[chosen].shape, dtype=np.int64)
    for number, index in shapes.items():
        part[shape[chosen] == number] = index
    return _SionnaPaths(
        pair=np.stack([transmitter, receiver], axis=-1),
        response=(real + 1j * imaginary)[receiver, :, transmitter, :, path],
        shift=solved.doppler.numpy().astype(np.float64)[chosen],
        kind=kind[chosen],
        part=part,
        face=face[chosen],
        point=point[chosen] + origin,
    )


_TRANSMITTED: Final = 4
_BOUNCE_KINDS: Final = {
    1: Bounce.REFLECTION,
    _TRANSMITTED: Bounce.TRANSMISSION,
    8: Bounce.DIFFRACTION,
}
"""Our kinds of bounces, by the values of sionna.rt.constants.InteractionType."""


def _table(
    scene: Scene,
    frequency: float,
    found: _SionnaPaths,
    parts: Sequence[_Part],
    table: Mapping[str, Material],
) -> PropagationPaths:
    """Table of Sionna's paths in our conventions.

    Lengths are summed in double precision over the bounce points: Sionna's own delays are in
    single precision, whose rounding is some 0.02 rad of phase at 100 m.
    """
    num_paths = len(found.pair)
    is_bounce = found.kind != 0
    counts = np.count_nonzero(is_bounce, axis=1)
    ends = [scene.radar_position[found.pair[:, end]] for end in (0, 1)]
    length, kept = np.zeros(num_paths), np.ones(num_paths)
    displaced = np.zeros(num_paths)
    departure, arrival = np.zeros((num_paths, 3)), np.zeros((num_paths, 3))
    rough = np.array([table[part.material].roughness for part in parts] or [0.0])
    for count in np.unique(counts):
        mine = counts == count
        stops = [ends[0][mine, None], found.point[mine, :count], ends[1][mine, None]]
        legs = np.diff(np.concatenate(stops, axis=1), axis=1)
        sizes = np.linalg.norm(legs, axis=-1)
        ways = legs / sizes[..., None]
        length[mine] = sizes.sum(axis=1)
        departure[mine], arrival[mine] = ways[:, 0], -ways[:, -1]
        if count:
            mirrored = found.kind[mine, :count] == 1
            heights = rough[found.part[mine, :count]] * mirrored
            kept[mine] = _roughness_factor(heights, ways, frequency)
            displaced[mine] = _displaced_air(found, mine, count, ways, parts, table)
    sign = np.array([-1.0, 1.0])  # our V is −θ, our H is φ
    turned = found.response * sign[:, None] * sign
    factor = kept * np.exp(2j * np.pi * frequency / SPEED_OF_LIGHT * displaced)
    kinds = np.zeros(max(_BOUNCE_KINDS) + 1, dtype=np.int64)
    kinds[list(_BOUNCE_KINDS)] = list(_BOUNCE_KINDS.values())
    return PropagationPaths(
        reference_time=scene.time,
        frequency=frequency,
        transmitter=found.pair[:, 0],
        receiver=found.pair[:, 1],
        delay=length / SPEED_OF_LIGHT,
        delay_rate=-found.shift / frequency,
        transfer=turned * factor[:, None, None],
        departure=departure,
        arrival=arrival,
        bounce_start=np.concatenate([[0], np.cumsum(counts)]),
        bounce_actor=np.array([part.actor for part in parts] or [0])[found.part[is_bounce]],
        bounce_kind=kinds[found.kind[is_bounce]],
        bounce_point=found.point[is_bounce],
    )


def _roughness_factor(heights: FloatArray, ways: FloatArray, frequency: float) -> FloatArray:
    """Amplitude factor ``(path,)`` of surfaces of rms ``heights``, m, ``(path, bounce)``.

    ``ways`` ``(path, leg, xyz)`` are the directions of the legs.
    """
    from polychirp.channel.materials.fresnel import roughness_factor

    # reflection changes the direction by a vector of length 2 cosθ, θ the angle of incidence
    cosine = 0.5 * np.linalg.norm(np.diff(ways, axis=1), axis=-1)
    return np.asarray(np.prod(roughness_factor(1.0, heights * cosine, frequency), axis=1))


def _displaced_air(
    found: _SionnaPaths,
    mine: BoolArray,
    count: int,
    ways: FloatArray,
    parts: Sequence[_Part],
    table: Mapping[str, Material],
) -> FloatArray:
    """Sum of t·cosθ over the sheets that paths cross, m ``(path,)``.

    ``mine`` is a mask of paths with ``count`` bounces; ``ways`` ``(path, leg, xyz)`` are the
    directions of their legs.
    """
    total = np.zeros(len(ways))
    crosses = found.kind[mine, :count] == _TRANSMITTED
    for path, bounce in zip(*np.nonzero(crosses), strict=True):
        part = parts[found.part[mine, bounce][path]]
        a, b, c = part.corner[found.face[mine, bounce][path]]
        normal = np.cross(b - a, c - a)
        cosine = abs(normal @ ways[path, bounce]) / np.linalg.norm(normal)
        total[path] += table[part.material].thickness * cosine
    return total
