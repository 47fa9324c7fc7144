r"""Radar cross section of a mesh, from its echo by the radar equation.

.. math:: \sigma = |a|^2\,\frac{(4\pi)^3 R^4}{\lambda^2}

The echo has the amplitude a between isotropic antennas; R, azimuth and elevation are those of the
radar from the middle of the mesh's bounding box. At a finite R, σ is the *apparent* cross section,
which a radar would measure there: closer than :math:`2D^2/\lambda` for a body of size D (11 km for
a car at 79 GHz), it depends on R.

The body is in free space, without road or walls.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Annotated, Final

import numpy as np

from polychirp.axes import Axes, ComplexArray, FloatArray, Sealed
from polychirp.channel.base import gather
from polychirp.channel.tracers.composite import Composite
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.errors import InputError
from polychirp.frames import Pose
from polychirp.model.antenna import ISOTROPIC, AntennaArray
from polychirp.model.mesh import Mesh
from polychirp.model.radar import Radar
from polychirp.model.scene import Actor, Scene

MOST_ASPECTS: Final = 1_000_000
"""Greatest number of aspects of one call. Chosen: around a body they are 0.0004 degrees apart."""

ASPECTS_PER_SCENE: Final = 16
"""Aspects traced together. Chosen: each illuminated facet takes about 200 bytes per aspect."""

UNLIMITED_DYNAMIC_RANGE: Final = 1e30
"""Dynamic range, as a power ratio, that leaves out no path. Chosen: no path is that weak."""

FAR_FIELD_PHASE: Final = 0.01
"""Greatest difference of phase, rad, there and back, between spherical and plane waves over a body
at `far_distance`. Chosen: its effect on a cross section is negligible."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CrossSections(Sealed):
    """Cross sections of a mesh over azimuth, at one distance and elevation.

    `cross_sections` returns it.

    Parameters
    ----------
    azimuth : rad, ``(aspect,)``: 0 from the front (+x), positive towards the body's left
    rcs : m², ``(aspect, receiving, transmitting)``, polarisations V and H
    distance : m, from ``centre`` to the radar
    elevation : rad, of the radar as seen from ``centre``
    centre : m, ``(x, y, z)`` in the mesh's frame: the middle of its bounding box
    """

    azimuth: Annotated[FloatArray, Axes("aspect")]
    rcs: Annotated[FloatArray, Axes("aspect", "2", "2")]
    distance: float
    elevation: float
    centre: tuple[float, float, float]


def cross_sections(
    mesh: Mesh,
    azimuth: FloatArray,
    *,
    tracer: Composite,
    distance: float,
    elevation: float = 0.0,
    progress: Callable[[int, int], None] = lambda _done, _total: None,
) -> CrossSections:
    """Monostatic cross sections of a mesh, all polarisations, with every mechanism of ``tracer``.

    The echo is the coherent sum of the paths at the tracer's frequency; no path is left out as weak
    or far.

    Parameters
    ----------
    azimuth : of the radar, rad ``(aspect,)``, as in `CrossSections`
    distance : m, from the middle of the mesh's box to the radar; for plane waves see `far_distance`
    elevation : of the radar, rad, as in `CrossSections`
    progress : called with the number of finished aspects, and that of all

    Raises
    ------
    InputError
        The mesh has no faces, there are too many aspects, or the radar would be inside the
        sphere around it.

    Examples
    --------
    A sphere with a radius of 10 cm has πr² from all directions: −15.0 dBsm.

    >>> from polychirp.channel.tracers.composite import Composite
    >>> from polychirp.testing.shapes import mesh_of, sphere
    >>> from polychirp.units import to_db
    >>> ball = mesh_of(sphere(0.1, 4e-3))
    >>> found = cross_sections(ball, np.array([0.1, 0.2]), tracer=Composite(), distance=100.0)
    >>> to_db(found.rcs[:, 0, 0]).round(0)
    array([-15., -15.])
    """
    if azimuth.size > MOST_ASPECTS:
        raise InputError(
            f"{azimuth.size} aspects are more than {MOST_ASPECTS}; use a larger step of azimuth"
        )
    centre, radius = sphere_around(mesh)
    if distance <= radius:
        raise InputError(
            f"a radar at {distance:.3g} m is inside the sphere around the body; "
            f"its range must exceed {radius:.3g} m"
        )
    toward = np.stack(
        [
            np.cos(elevation) * np.cos(azimuth),
            np.cos(elevation) * np.sin(azimuth),
            np.full(azimuth.shape, np.sin(elevation)),
        ],
        axis=-1,
    )
    complete = replace(tracer, dynamic_range=UNLIMITED_DYNAMIC_RANGE, max_length=np.inf)
    echo = np.empty((azimuth.size, 2, 2), dtype=np.complex128)
    for start in range(0, azimuth.size, ASPECTS_PER_SCENE):
        progress(start, azimuth.size)
        some = slice(start, start + ASPECTS_PER_SCENE)
        echo[some] = _echoes(complete, mesh, centre + distance * toward[some])
    progress(azimuth.size, azimuth.size)
    wavelength = SPEED_OF_LIGHT / tracer.carrier
    return CrossSections(
        azimuth=azimuth,
        rcs=np.abs(echo) ** 2 * (4 * np.pi) ** 3 * distance**4 / wavelength**2,
        distance=distance,
        elevation=elevation,
        centre=(float(centre[0]), float(centre[1]), float(centre[2])),
    )


def num_aspects(step: float) -> int:
    """Number of aspects around a body that are about ``step`` (rad) apart.

    `InputError` is raised if there would be more than `MOST_ASPECTS`.

    >>> num_aspects(np.radians(0.5))
    720
    """
    count = 2.0 * np.pi / step
    if count > MOST_ASPECTS:
        raise InputError(
            f"a step of {np.degrees(step):.3g} deg gives {count:.3g} aspects, more than "
            f"{MOST_ASPECTS}; use a larger step of azimuth"
        )
    return max(1, round(count))


def _echoes(tracer: Composite, mesh: Mesh, places: FloatArray) -> ComplexArray:
    """Sums of own echoes at places, m ``(radar, xyz)``: ``(radar, receiving, transmitting)``."""
    radars = tuple(
        Radar(
            name=str(number),
            mount=Pose(x=float(x), y=float(y), z=float(z)),
            array=AntennaArray(pattern=ISOTROPIC),
        )
        for number, (x, y, z) in enumerate(places)
    )
    actors = (Actor(name="body", kind="object", mesh=mesh), Actor(name="radars", kind="object"))
    scene = Scene(time=0.0, actors=actors, radars=radars, carriers=(1,) * len(radars))
    world, own = tracer.prepare(scene), np.repeat(np.arange(len(radars))[:, None], 2, axis=1)
    nothing_known = np.zeros((len(radars), len(radars)))
    paths = gather([part.trace(world, own, nothing_known) for part in tracer.parts(world)])
    turn = np.exp(-2j * np.pi * tracer.carrier * paths.delay)
    echo = np.zeros((len(radars), 2, 2), dtype=np.complex128)
    np.add.at(echo, paths.transmitter, paths.transfer * turn[:, None, None])
    return echo


def sphere_around(mesh: Mesh) -> tuple[FloatArray, float]:
    """Middle of a mesh's bounding box, m ``(xyz,)``, and the greatest distance of a corner, m.

    `InputError` is raised if the mesh has no faces.
    """
    if not mesh.num_faces:
        raise InputError("a mesh without faces has no echo; give it triangles")
    corners = mesh.corners.reshape(-1, 3)
    centre = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
    return centre, float(np.sqrt(np.max(np.sum((corners - centre) ** 2, axis=-1))))


def far_distance(mesh: Mesh, frequency: float) -> float:
    r"""Distance, m, beyond which the waves over a mesh are plane at ``frequency``, Hz.

    .. math:: R = k\rho^2 / \varphi

    Over a body within ρ of its middle, the phase there and back differs by φ = `FAR_FIELD_PHASE`
    from that of a plane wave. For a car, R is 1000 km. There a phase of 2kR = 3·10⁹ rad is accurate
    to 5·10⁻⁷ rad in double precision, so the sum needs no other formula than for short distances.
    """
    wavenumber = 2 * np.pi * frequency / SPEED_OF_LIGHT
    return wavenumber * sphere_around(mesh)[1] ** 2 / FAR_FIELD_PHASE


def running_median(values: FloatArray, azimuth: FloatArray, window: float) -> FloatArray:
    """Median of the values within ± ``window`` (rad) of every azimuth (rad), modulo 2π.

    >>> turns = np.radians([-180.0, -90.0, 0.0, 90.0])
    >>> running_median(np.array([1.0, 5.0, 2.0, 3.0]), turns, np.radians(91.0))
    array([3., 2., 3., 2.])
    """
    return np.array([np.median(values[is_within_window(azimuth, at, window)]) for at in azimuth])


def is_within_window(azimuth: FloatArray, middle: float, window: float) -> FloatArray:
    """Mask of the azimuths (rad) within ± ``window`` (rad) of ``middle`` (rad), modulo 2π."""
    off = np.angle(np.exp(1j * (azimuth - middle)))
    return np.asarray(np.abs(off) <= window + 1e-9)
