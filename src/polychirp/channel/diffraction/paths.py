r"""Diffraction of direct paths at the silhouettes of obstacles in or near the line of sight.

A radar illuminates another at distance d past obstacles. Kirchhoff's integral U over the free
aperture between them is the sum of the geometric wave, if the line of sight is clear, and a wave
from every point of the silhouette's edge (Maggi 1888, Rubinowicz 1917; Born & Wolf §8.9). With the
unobstructed field U₀,

.. math::
    \frac{U}{U_0} = [\text{clear}] + \frac{1}{2\pi}\oint d\varphi \sum_{\text{edges}} \pm
    \frac{1+\cos\theta}{2}\,e^{-jk(r_1+r_2-d)}

where [clear] is 1 or 0, k is the wavenumber, :math:`r_1, r_2` are the edge's distances from both
radars, θ is the angle by which the path bends there, and φ the azimuth about the line of sight. The
sign is + (−) for an edge beyond which, away from the line of sight, the aperture is free (blocked).
With the edge's element dl and its distance ρ from the line of sight, the boundary wave
:math:`\frac{1}{4\pi}\oint \frac{e^{-jk(r_1+r_2)}}{r_1 r_2}\frac{(\hat r_1\times\hat r_2)\cdot
dl}{1-\cos\theta}` takes this form because :math:`(\vec r_1\times\vec r_2)\cdot dl = \rho^2 d\,
d\varphi` and :math:`r_1^2 r_2^2\sin^2\theta = \rho^2d^2`. Nothing is singular at grazing
incidence, where half of all azimuths are blocked and U = ½U₀. For a straight edge at the height h
over the line of sight, :math:`d_1` and :math:`d_2` along it from the radars, U/U₀ is Fresnel's
:math:`\frac{1+j}{2}[(\frac12-C(\nu)) - j(\frac12-S(\nu))]`,
:math:`\nu = h\sqrt{\frac2\lambda(\frac1{d_1}+\frac1{d_2})}`.

**The silhouette.** Every triangle that may be in the way is cut by half-planes about the line of
sight. In a half-plane it covers an interval of the excess :math:`r_1+r_2-d`, which is least where
a mirror would reflect and greatest at an end of the cut. The intervals of all surfaces are united,
and the ends of the united intervals are the edges, each with its own depth. Between two half-planes
an edge is straight.

**Obstacles** are the surfaces that block, except those that both radars are in front of: these
reflect, which other mechanisms compute. A plate is an obstacle only if its plane lies between the
radars. Nothing within `RADAR_CLEARANCE` of either radar, along the line of sight, is an obstacle.

**Limits.** Each end of a united interval is one edge: of several obstacles behind one another, and
of both ends of a flat top, only the edge that reaches farthest into the aperture counts. That is
right if the path over it clears the others by a Fresnel zone. Two equal edges at grazing incidence
give ½ instead of ⅓ (3.5 dB too much); for a long body's roof in deep shadow, the error is greater.
Obstacles absorb: edges have no influence on polarisation, and there are no creeping waves and no
fringe currents. θ should not exceed some 20°. Edges are sought up to `MAX_ZONES_CLEAR` Fresnel
zones from a clear line of sight, and up to `MAX_ZONES_BLOCKED` from a blocked one; from half of
that on, their weight falls. A straight edge n zones away makes :math:`1/2\pi\sqrt n` of the
unobstructed field, so the waves that are weakened or left out are below −33 dB and −38 dB of it.

**Other modules.** `sight_lines` finds what may obstruct a line of sight, `edge_paths` makes paths
from edge waves, and `mirrored_paths` does for mirror images what this module does for direct paths.
"""

from dataclasses import replace
from typing import Final

import numpy as np

from polychirp.axes import FloatArray, IntArray
from polychirp.channel.base import gather, no_paths, path_table
from polychirp.channel.diffraction.edge_paths import EdgePaths, edge_paths
from polychirp.channel.diffraction.sight_lines import Line, line_between, obstructing
from polychirp.channel.direct.line_of_sight import line_of_sight, straight_path_polarisation
from polychirp.channel.direct.occluded import points_before, visible_line_of_sight
from polychirp.channel.scene.transmission import transmission_matrices
from polychirp.channel.scene.world import RADAR_CLEARANCE, World
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.model.paths import Bounce, PropagationPaths

LONGEST_INTERVAL: Final = 4e-3
"""Greatest time between two traces of edges whose waves matter, s.

Waves over a silhouette change as it goes from triangle to triangle, of which coherence times know
nothing. The line of sight is traced as often: it ends where the waves over an edge begin. Chosen:
decision 7 compares 2 to 24 ms."""


def diffracted_paths(world: World, pairs: IntArray) -> PropagationPaths:
    """Paths of ``pairs`` over the edges of obstacles in or near their line of sight.

    Together with `visible_line_of_sight` they are the field that arrives directly, which is
    continuous while an obstacle moves into the way. The transfer matrices of the two directions
    between two radars are transposes of each other. The module's docstring has the equation.

    A wall whose edge is on the line of sight halves the field:

    >>> from polychirp.channel.base import all_pairs
    >>> from polychirp.channel.tracers.composite import Composite
    >>> from polychirp.frames import Pose
    >>> from polychirp.model.mesh import Plate
    >>> from polychirp.model.radar import Radar
    >>> from polychirp.model.scene import Actor, Scene
    >>> plate = Plate(centre=(5, -9, 0), half_u=(0, 9, 0), half_v=(0, 0, 9), material="brick",
    ...     part="wall")
    >>> scene = Scene(time=0.0, actors=(Actor(name="a", kind="object"),
    ...     Actor(name="b", kind="object", pose=Pose(x=10)),
    ...     Actor(name="wall", kind="building", plates=(plate,))),
    ...     radars=(Radar(name="1"), Radar(name="2")), carriers=(0, 1))
    >>> world = Composite().prepare(scene)
    >>> paths = [mechanism(world, all_pairs(scene))
    ...     for mechanism in (visible_line_of_sight, diffracted_paths)]
    >>> field = sum(np.sum(table.transfer[table.receiver == 1, 0, 0]) for table in paths)
    >>> unobstructed = SPEED_OF_LIGHT / 79e9 / (4 * np.pi * 10)
    >>> float(round(abs(field) / unobstructed, 2))
    0.5
    """
    direct = line_of_sight(world.scene, frequency=world.frequency, pairs=pairs)
    tables = [no_paths(world.scene, world.frequency)]
    if not direct.num_paths:
        return tables[0]
    seen = visible_line_of_sight(world, pairs)
    num_radars = len(world.scene.radars)
    clear = np.zeros((num_radars, num_radars), dtype=np.bool_)
    clear[seen.transmitter, seen.receiver] = True
    # edges are near the line of sight, so sheets attenuate their waves as they attenuate it
    place = world.scene.radar_position
    start, end = place[direct.transmitter], place[direct.receiver]
    losses = transmission_matrices(world, start, points_before(start, end, RADAR_CLEARANCE))
    found: dict[tuple[int, int, bool], tuple[Line, EdgePaths] | None] = {}
    for number in range(direct.num_paths):
        a, b = int(direct.transmitter[number]), int(direct.receiver[number])
        link = min(a, b), max(a, b), bool(clear[a, b])
        if link not in found:
            line = line_between(world, *link)
            some = obstructing(world, line)
            found[link] = None if some[0].is_empty else (line, edge_paths(world, line, some))
        if (known := found[link]) is not None:
            table = _path_table(world, direct, number, *known)
            tables.append(replace(table, transfer=table.transfer @ losses[number]))
    return gather(tables)


def _path_table(
    world: World, direct: PropagationPaths, number: int, line: Line, edges: EdgePaths
) -> PropagationPaths:
    """Edge paths of the pair of radars of direct path ``number``, in the direction of that path.

    The line goes from the radar of the lower number to the other.
    """
    a, b = int(direct.transmitter[number]), int(direct.receiver[number])
    out, back = (edges.out, edges.back) if a < b else (edges.back, edges.out)
    turns = (edges.out_rate, edges.back_rate) if a < b else (edges.back_rate, edges.out_rate)
    amplitude = 1.0 / (4 * np.pi * world.frequency * direct.delay[number])
    transfer = (
        straight_path_polarisation(_unit(out), _unit(back))
        * (amplitude * edges.field)[:, None, None]
    )
    return path_table(
        scene=world.scene,
        frequency=world.frequency,
        pair=np.tile([a, b], (len(edges.field), 1)),
        # the direct path's delay is exact for moving radars; the excess is added to it
        delay=direct.delay[number] + edges.excess / SPEED_OF_LIGHT,
        delay_rate=direct.delay_rate[number] + (edges.rate - line.opening) / SPEED_OF_LIGHT,
        transfer=transfer,
        departure=out,
        arrival=back,
        bounces=[(Bounce.DIFFRACTION, edges.actor, edges.point)],
        coherence_time=edges.coherence_time,
        delay_acceleration=edges.acceleration / SPEED_OF_LIGHT,
        transfer_drift=direct.transfer_drift[number] + edges.drift,
        departure_rate=turns[0],
        arrival_rate=turns[1],
    )


def _unit(vectors: FloatArray) -> FloatArray:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True))
