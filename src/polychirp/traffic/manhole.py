"""`ManholeCover`: a round cover of metal and its frame, which stand a little over the road."""

from dataclasses import dataclass
from functools import cache
from typing import Annotated, Final, Literal

import numpy as np

from polychirp.frames import Pose
from polychirp.model.mesh import Mesh
from polychirp.model.scene import Actor
from polychirp.spec import Spec
from polychirp.traffic.roadside import FURNITURE_EDGE, turned
from polychirp.traffic.surface import Fineness, SurfaceBuilder
from polychirp.units import Metres, Unit

FINEST_WALL: Final = "1 mm"
"""Least height of a cover over the road: a quarter of a wavelength at 79 GHz, below which physical
optics says nothing about its wall."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ManholeCover(Spec):
    r"""A round manhole cover in its frame, with its middle at (x, y).

    Cover and frame are flat and stand ``height`` over the road; between them is a gap down to the
    road. From the low height of a radar, only the frame's round outer wall faces it. Physical
    optics gives that wall, of the radius r, the cross section

    .. math:: \sigma = k r\,\left|\int_0^{h} (e^{jkz\sin\alpha} + \Gamma e^{-jkz\sin\alpha})^2\,
              dz\right|^2

    at the grazing angle α on a road with the reflection coefficient Γ. Without road, Γ is 0 and
    σ is k r h² at α = 0, as of an upright cylinder.

    The defaults have the clear opening of 600 mm and the raised pattern of 3 to 8 mm that EN 124
    asks of covers on roads.

    Parameters
    ----------
    radius : of the cover, m
    height : of cover and frame over the road, m
    gap : between cover and frame, m
    frame : width of the frame's ring, m
    material : of cover and frame

    Examples
    --------
    >>> mesh = ManholeCover(name="m", x=12.0, y=0.0).actor().mesh
    >>> mesh.parts, float(mesh.vertex[:, 2].max())
    (('cover', 'frame'), 0.006)
    """

    kind: Literal["manhole-cover"] = "manhole-cover"
    name: str
    x: Metres
    y: Metres
    radius: Annotated[float, Unit("m", least="0.1 m", greatest="1 m")] = 0.32
    height: Annotated[float, Unit("m", least=FINEST_WALL, greatest="0.1 m")] = 0.006
    gap: Annotated[float, Unit("m", least="1 mm", greatest="0.05 m")] = 0.004
    frame: Annotated[float, Unit("m", least="0.01 m", greatest="0.3 m")] = 0.05
    material: str = "metal"

    def actor(self) -> Actor:
        """The cover with its frame, open below, where the road is."""
        return Actor(
            name=self.name,
            kind="furniture",
            pose=Pose(x=self.x, y=self.y),
            mesh=_mesh(self.radius, self.height, self.gap, self.frame, self.material),
        )


@cache
def _mesh(radius: float, height: float, gap: float, frame: float, material: str) -> Mesh:
    """Flat top of the cover; flat top and outer wall of the frame.

    The gap's walls are left out. Light of the grazing angle α reaches down to gap · tan α, less
    than a quarter of a wavelength up to 13° for 4 mm. With these walls, channels would take hidden
    facets for lit, since all facets of similar direction within 8 cm share a shadow ray.
    """
    builder, fine = SurfaceBuilder(), Fineness(max_edge=FURNITURE_EDGE)
    inner, outer = radius + gap, radius + gap + frame
    disc = [(float(r), height) for r in np.linspace(radius, 0.0, fine.steps(radius) + 1)]
    turned(builder, fine, disc, curvature=radius, part="cover", material=material)
    ring = [(outer, float(z)) for z in np.linspace(0.0, height, fine.steps(height) + 1)]
    ring += [(float(r), height) for r in np.linspace(outer, inner, fine.steps(frame) + 1)[1:]]
    turned(builder, fine, ring, curvature=outer, part="frame", material=material)
    return builder.mesh()
