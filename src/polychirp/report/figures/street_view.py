"""Figure 8 in three dimensions: the street as the ray caster sees it, in daylight.

The picture uses the same triangles and the same closest-hit search as the channel, so it shows
what the rays meet: one ray from the camera through every quarter of a pixel, one more towards the
sun. Light is only there to make shapes readable; colours are those of the materials.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray

from polychirp.axes import BoolArray, FloatArray, IntArray
from polychirp.model.scene import Scene
from polychirp.report.figures.drawing import INK, Column, Drawing, new_figure, styled
from polychirp.report.figures.surfaces import Surfaces, extent, surfaces

SUN: Final = np.array([-0.45, -0.40, 0.80]) / np.linalg.norm([-0.45, -0.40, 0.80])
"""Towards the sun: behind the camera's right shoulder, so that shadows fall away from it."""

SUNLIGHT: Final = np.array([1.00, 0.95, 0.86]) * 0.95
ZENITH: Final = np.array([0.28, 0.47, 0.75])
HORIZON: Final = np.array([0.80, 0.86, 0.91])
GROUND: Final = np.array([0.42, 0.41, 0.38])
SHINE: Final = {"metal": 0.22, "glass": 0.45, "plastic": 0.06}
"""Share of the sky's light that a material mirrors."""
PAINT: Final = np.array([0.86, 0.86, 0.84])
LIFT: Final = 1e-3
"""m, by which a ray to the sun starts above its surface."""
SKY_HEIGHT: Final = 1e3
"""m along the way to the sun on which a body can throw a shadow."""
BLOCK: Final = 200_000
"""Rays cast at once: tens of megabytes."""


class RayCaster(Protocol):
    """Finds what rays meet first; `polychirp.channel.geometry.bvh.Caster` is one."""

    def closest(self, origins: FloatArray, directions: FloatArray) -> tuple[FloatArray, IntArray]:
        """Distance, m ``(ray,)``, infinite without a hit, and face ``(ray,)``."""
        ...

    def occluded(self, origins: FloatArray, ends: FloatArray) -> BoolArray:
        """Whether anything lies between origin and end, ``(ray,)``."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class Camera:
    """A pinhole at ``position`` (m) that looks at ``target`` and sees ``width`` (rad) across."""

    position: tuple[float, float, float]
    target: tuple[float, float, float]
    width: float = np.radians(62.0)

    @property
    def frame(self) -> FloatArray:
        """Unit vectors right, up and forward in the world, ``(axis, xyz)``."""
        forward = np.subtract(self.target, self.position)
        forward = forward / np.linalg.norm(forward)
        right = np.cross(forward, [0.0, 0.0, 1.0])
        right = right / np.linalg.norm(right)
        return np.array([right, np.cross(right, forward), forward])

    def directions(self, pixel: FloatArray, size: tuple[int, int]) -> FloatArray:
        """Unit vectors ``(…, xyz)`` through points ``(…, 2)`` of a picture, right and down."""
        width, height = size
        half = np.tan(0.5 * self.width)
        offset = (2.0 * pixel - (width, height)) / width * half
        right, up, forward = self.frame
        ray = forward + offset[..., :1] * right - offset[..., 1:] * up
        return np.asarray(ray / np.linalg.norm(ray, axis=-1, keepdims=True))

    def project(self, points: FloatArray, size: tuple[int, int]) -> FloatArray:
        """Where world points ``(…, xyz)`` lie in a picture, ``(…, 2)``; NaN for those behind."""
        width, height = size
        right, up, depth = np.moveaxis((points - np.array(self.position)) @ self.frame.T, -1, 0)
        scale = 0.5 * width / np.tan(0.5 * self.width) / np.where(depth > 0.0, depth, np.nan)
        return np.stack([0.5 * width + right * scale, 0.5 * height - up * scale], axis=-1)


def overview(scene: Scene) -> Camera:
    """A camera behind and above the vehicles that drive along +x, looking along the street."""
    boxes = [extent(actor) for actor in scene.actors if actor.kind == "vehicle"]
    boxes = boxes or [extent(actor) for actor in scene.actors] or [(np.zeros(3), np.zeros(3))]
    low = np.min([box[0] for box in boxes], axis=0)
    high = np.max([box[1] for box in boxes], axis=0)
    length = max(float(high[0] - low[0]), 10.0)
    return Camera(
        position=(float(low[0]) - 11.0, float(low[1]) - 1.0, 4.0 + 0.12 * length),
        target=(float(low[0]) + 0.30 * length, 0.0, 0.0),
    )


@styled
def street_view(
    scene: Scene,
    *,
    camera: Camera | None = None,
    size: tuple[int, int] = (1600, 900),
    caster: RayCaster | None = None,
) -> Drawing:
    """The street in three dimensions; its data are the named bodies and where the picture has them.

    Parameters
    ----------
    camera : `overview` of the scene if absent
    size : pixels across and down
    caster : for the triangles of `surfaces`; the channel's own if absent
    """
    camera = camera or overview(scene)
    picture = render(scene, camera=camera, size=size, caster=caster)
    width, height = size
    figure = new_figure(width / 160.0, height / 160.0)
    figure.set_layout_engine("none")  # the picture fills it
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.imshow(picture, extent=(0.0, width, height, 0.0), interpolation="nearest")
    axes.set(xlim=(0.0, width), ylim=(height, 0.0))
    axes.set_axis_off()
    vehicles = [actor for actor in scene.actors if actor.kind == "vehicle"]
    boxes = [extent(actor) for actor in vehicles]
    roofs = np.array([[*(0.5 * (low + high))[:2], high[2]] for low, high in boxes]).reshape(-1, 3)
    pixels = camera.project(roofs, size)
    for actor, (x, y) in zip(vehicles, pixels, strict=True):
        if 0.0 <= x < width and 0.0 <= y < height:
            axes.annotate(
                actor.name,
                xy=(x, y),
                xytext=(0, 24),
                textcoords="offset points",
                ha="center",
                size=8,
                bbox={"boxstyle": "round,pad=0.25", "facecolor": "white", "alpha": 0.85, "lw": 0},
                arrowprops={"arrowstyle": "-", "color": INK, "linewidth": 0.8},
            )
    data: dict[str, Column] = {
        "name": [actor.name for actor in vehicles],
        **{f"{axis}_m": roofs[:, number] for number, axis in enumerate("xyz")},
        "pixel_right": pixels[:, 0],
        "pixel_down": pixels[:, 1],
    }
    return Drawing(figure=figure, data=data)


def render(
    scene: Scene, *, camera: Camera, size: tuple[int, int], caster: RayCaster | None = None
) -> NDArray[np.uint8]:
    """Picture ``(down, right, rgb)`` of a scene, each pixel the mean of four rays."""
    street = surfaces(scene)
    if caster is None:
        from polychirp.channel.geometry.bvh import Caster

        caster = Caster(street.corners)
    skin, eye = _Skin.of(street), np.array(camera.position)
    width, height = size
    right = (np.arange(2 * width) + 0.5) / 2.0
    lines = max(1, BLOCK // (4 * width))
    picture = np.empty((height, width, 3))
    for top in range(0, height, lines):
        rows = np.arange(2 * top, 2 * min(top + lines, height))
        pixel = np.stack(np.meshgrid(right, (rows + 0.5) / 2.0), axis=-1)
        light = _light(skin, caster, eye, camera.directions(pixel, size).reshape(-1, 3))
        fine = light.reshape(-1, 2, width, 2, 3)
        picture[top : top + lines] = fine.mean(axis=(1, 3))
    return np.asarray(np.rint(255.0 * _on_screen(picture)), dtype=np.uint8)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Skin:
    """What light needs to know of every face: all ``(face, …)``, colours linear in light."""

    normal: FloatArray
    colour: FloatArray
    shine: FloatArray
    is_road: BoolArray

    @classmethod
    def of(cls, street: Surfaces) -> _Skin:
        return cls(
            normal=street.normal,
            colour=street.colour**2.2,
            shine=np.array([SHINE.get(material, 0.0) for material in street.material]),
            is_road=np.array([material == "asphalt" for material in street.material], dtype=bool),
        )


def _light(skin: _Skin, caster: RayCaster, eye: FloatArray, directions: FloatArray) -> FloatArray:
    """Linear light ``(ray, rgb)`` that comes to the eye from ``directions``."""
    distance, face = caster.closest(np.broadcast_to(eye, directions.shape), directions)
    light = _sky(directions)
    hit = np.isfinite(distance)
    if np.any(hit):
        incoming, face, distance = directions[hit], face[hit], distance[hit]
        point = eye + distance[:, None] * incoming
        normal = skin.normal[face]
        normal = normal * -np.sign(np.sum(normal * incoming, axis=1, keepdims=True))
        shaded = _shade(skin, caster, face, point, normal, incoming)
        haze = 1.0 - np.exp(-((distance / 250.0) ** 2))[:, None]
        light[hit] = shaded * (1.0 - haze) + HORIZON * haze
    return light


def _shade(
    skin: _Skin,
    caster: RayCaster,
    face: IntArray,
    point: FloatArray,
    normal: FloatArray,
    incoming: FloatArray,
) -> FloatArray:
    """Lambert's law under sun and sky, and the sky's mirror image where a material shines."""
    on_line = skin.is_road[face] & _is_painted(point)
    colour = np.where(on_line[:, None], PAINT**2.2, skin.colour[face])
    start = point + LIFT * normal
    sun = np.maximum(normal @ SUN, 0.0) * ~caster.occluded(start, start + SKY_HEIGHT * SUN)
    up = 0.5 * (1.0 + normal[:, 2:])
    ambient = 0.55 * (up * (0.5 * ZENITH + 0.5 * HORIZON) + (1.0 - up) * GROUND)
    diffuse = colour * (SUNLIGHT * sun[:, None] + ambient)
    cosine = np.sum(incoming * normal, axis=1)
    share = (skin.shine[face] * (0.35 + 0.65 * (1.0 - np.abs(cosine)) ** 3))[:, None]
    mirrored = incoming - 2.0 * cosine[:, None] * normal
    return np.asarray(diffuse * (1.0 - share) + _sky(mirrored) * share)


def _is_painted(point: FloatArray) -> BoolArray:
    """The line between two lanes, three metres in six, and the lines at their outer borders."""
    x, y = point[:, 0], np.abs(point[:, 1])
    return np.asarray(((y < 0.07) & (x % 6.0 < 3.0)) | (np.abs(y - 3.4) < 0.06))


def _sky(directions: FloatArray) -> FloatArray:
    height = directions[:, 2:]
    sky = HORIZON + (ZENITH - HORIZON) * np.sqrt(np.clip(height, 0.0, 1.0))
    ground = GROUND**2.2 + (HORIZON - GROUND**2.2) * np.exp(np.minimum(height, 0.0) * 14.0)
    return np.asarray(np.where(height >= 0.0, sky, ground))


def _on_screen(light: FloatArray) -> FloatArray:
    """Screen values 0 to 1 of linear light, bright parts rolled off."""
    return np.asarray((1.0 - np.exp(-1.5 * np.maximum(light, 0.0))) ** (1.0 / 2.2))
