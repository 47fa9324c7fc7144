r"""Diffuse echoes of rough plates, road and walls, by Lambert's law, with energy conserved.

Of the power that a smooth surface with Fresnel's coefficients Γ reflects, roughness of the rms
height :math:`\sigma_h` scatters the share :math:`1-\rho^2`. The scattered share of the power that
is incident at the angle θ is

.. math:: R_d(\theta) = \frac{|\Gamma_s|^2 + |\Gamma_p|^2}{2}\,(1 - \rho^2),\qquad
    \rho = e^{-2(k\sigma_h\cos\theta)^2}

with the wavenumber k. It scatters as a Lambert surface, whose cross section per area is

.. math:: \sigma^0 = 4 R_d(\theta_i)\cos\theta_i\cos\theta_s, \qquad
    \int \sigma^0\,\frac{d\Omega_s}{4\pi\cos\theta_i} = R_d(\theta_i)

over the hemisphere (σ⁰ as defined by Ruck et al. 1970; the integral of :math:`\cos\theta_s/\pi` is
1). With :math:`R_d` at the angle of incidence alone, σ⁰ is not reciprocal. So the geometric mean of
both directions replaces it:
:math:`\sigma^0 = 4\sqrt{R_d(\theta_i)R_d(\theta_s)}\cos\theta_i\cos\theta_s`.
Over all angles of incidence together, this is never more power than before (Cauchy–Schwarz).

Each cell of a grid on the plate is represented by one point. It has a random place in the cell and
random phases, fixed in the plate's frame: speckle changes as the radars move, and its mean power is
the integral of σ⁰.

Limits: Lambert's law is an assumption, for lack of bistatic measurements at 79 GHz; near grazing
incidence, a real road scatters back more than :math:`\cos^2\theta`. σ⁰ is evaluated at the point:
in cells that are less than about a cell away from the radar, the angles vary too much for that. The
share of cross-polarised power is an assumption.
"""

from dataclasses import replace
from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from polychirp.axes import ComplexArray, FloatArray, IntArray
from polychirp.channel.clutter.random_scatterers import (
    Scatterers,
    joined,
    random_matrices,
    scattered_paths,
)
from polychirp.channel.materials.fresnel import reflection, roughness_factor
from polychirp.channel.scene.world import World
from polychirp.model.material import Material
from polychirp.model.paths import PropagationPaths
from polychirp.rng import Streams

CELL_SIZE: Final = 1.0
"""Greatest edge of a cell, m; each cell is represented by one point. Chosen."""

CROSS_POLARISED_SHARE: Final = 0.1
"""χ, cross-polarised share of the scattered power. An assumption: −10 dB."""


def diffuse_paths(world: World, pairs: IntArray, *, seed: int) -> PropagationPaths:
    r"""Paths of ``pairs`` ``(pair, 2)`` over rough plates, own echoes included.

    .. math:: |A|^2 = \frac{\sigma^0 a\,\lambda^2}{(4\pi)^3 r_1^2 r_2^2}

    with the area a of a cell, and r₁, r₂ from its point to the radars. Points and phases depend on
    the seed, the actor's name and the plate's part, number and size, but not on the snapshot.

    >>> from polychirp.channel.tracers.composite import Composite
    >>> from polychirp.model.scene import Scene
    >>> empty = Composite().prepare(Scene(time=0.0, actors=()))
    >>> diffuse_paths(empty, np.zeros((0, 2), dtype=np.int64), seed=1).num_paths
    0
    """
    points = joined(
        [_on_plate(world, plate, seed) for plate in _rough(world)], len(world.scene.radars)
    )
    return scattered_paths(world, pairs, points)


def diffuse_share(material: Material, cosine: ArrayLike, frequency: float) -> FloatArray:
    """Share R_d of the incident power, at a cosine of θ, that a rough surface scatters diffusely.

    >>> rough = Material(conductivity=np.inf, roughness=1.0)
    >>> float(diffuse_share(rough, 0.5, 79e9))
    1.0
    """
    smooth = reflection(replace(material, roughness=0.0), cosine, frequency)
    kept = roughness_factor(material.roughness, cosine, frequency) ** 2
    return np.asarray(0.5 * np.sum(np.abs(smooth) ** 2, axis=0) * (1.0 - kept))


def lambert(
    material: Material, incident: ArrayLike, scattered: ArrayLike, frequency: float
) -> FloatArray:
    """Reciprocal σ⁰ from the cosines of the angles of incidence and of scattering."""
    share = diffuse_share(material, incident, frequency) * diffuse_share(
        material, scattered, frequency
    )
    return np.asarray(4 * np.sqrt(share) * np.asarray(incident) * np.asarray(scattered))


class _Cells(NamedTuple):
    """Points along a plate's axes, m ``(point,)``, their matrices S, and a cell's area, m²."""

    across: FloatArray
    along: FloatArray
    matrix: ComplexArray
    area: float


@lru_cache(maxsize=1024)
def _cells(
    half_across: float, half_along: float, seed: int, names: tuple[str | int, ...]
) -> _Cells:
    """One random point in every cell of a plate; the same arguments give the same points."""
    rng = Streams(seed)["diffuse", *names]
    shape = [max(1, int(np.ceil(2 * half / CELL_SIZE))) for half in (half_across, half_along)]
    corner = np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), axis=-1).reshape(-1, 2)
    share = (corner + rng.random(corner.shape)) / shape
    return _Cells(
        across=(2 * share[:, 0] - 1) * half_across,
        along=(2 * share[:, 1] - 1) * half_along,
        matrix=random_matrices(rng, len(share), CROSS_POLARISED_SHARE),
        area=4 * half_across * half_along / len(share),
    )


def _rough(world: World) -> list[int]:
    """Numbers of the plates that are rough and have a radar in front."""
    plates = world.plates
    rough = np.array([world.table[name].roughness > 0 for name in world.materials], dtype=np.bool_)
    height = world.scene.radar_position @ plates.normal.T
    before = np.any(height > np.sum(plates.centre * plates.normal, axis=-1), axis=0)
    return [int(plate) for plate in np.flatnonzero(before & rough[plates.medium])]


def _on_plate(world: World, plate: int, seed: int) -> Scatterers:
    """Points of one plate as scatterers for all radars."""
    plates = world.plates
    actor = world.scene.actors[plates.actor[plate]]
    # two plates of an actor may share the name of their part
    first = int(np.argmax(plates.actor == plates.actor[plate]))
    part = actor.plates[plate - first].part
    cells = _cells(
        # rounded, since a turned plate's sides differ in the last bit
        round(float(plates.half_across[plate]), 9),
        round(float(plates.half_along[plate]), 9),
        seed,
        (actor.name, part, plate - first),
    )
    normal = plates.normal[plate]
    position = (
        plates.centre[plate]
        + cells.across[:, None] * plates.across[plate]
        + cells.along[:, None] * plates.along[plate]
        + 1e-6 * normal  # in front of the plate, so that it does not hide its points
    )
    way = world.scene.radar_position[:, None] - position
    cosine = np.maximum(0.0, way @ normal / np.linalg.norm(way, axis=-1))
    material = world.table[world.materials[plates.medium[plate]]]
    return Scatterers(
        position=position,
        actor=np.full(len(position), plates.actor[plate]),
        matrix=cells.matrix,
        # between a radar and itself, σ is g², the fourth power of √g
        reach=(lambert(material, cosine, cosine, world.frequency) * cells.area) ** 0.25,
    )
