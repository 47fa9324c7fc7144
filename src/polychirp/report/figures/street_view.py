"""Figure 8 in three dimensions: a ray-traced picture of the street in daylight.

The picture uses the same triangles and the same closest-hit search as the channel, so it shows the
surfaces that the channel's rays meet. One ray leaves the camera through every quarter of a pixel,
and a second one goes from its hit towards the sun. Colours are those of `surfaces`.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from polychirp.axes import BoolArray, FloatArray, IntArray
from polychirp.channel.geometry.caster_names import RayCaster
from polychirp.model.scene import Scene
from polychirp.report.figures.drawing import INK, Column, Drawing, new_figure, styled
from polychirp.report.figures.surfaces import Surfaces, extent, surfaces

SUN_DIRECTION: Final = np.array([-0.45, -0.40, 0.80]) / np.linalg.norm([-0.45, -0.40, 0.80])
"""Unit vector towards the sun, which is behind the camera on its right."""

SUN_COLOUR: Final = np.array([1.00, 0.95, 0.86]) * 0.95
ZENITH_COLOUR: Final = np.array([0.28, 0.47, 0.75])
HORIZON_COLOUR: Final = np.array([0.80, 0.86, 0.91])
GROUND_COLOUR: Final = np.array([0.42, 0.41, 0.38])
"""Light (red, green, blue) of sun, sky at zenith and horizon, and ground; chosen by eye."""
MIRRORED_SHARE: Final = {"metal": 0.22, "glass": 0.45, "plastic": 0.06}
"""Share of the sky's light that a material mirrors at grazing incidence; chosen by eye."""
LINE_COLOUR: Final = np.array([0.86, 0.86, 0.84])
"""Screen values of the lines on the road; chosen by eye."""
SHADOW_RAY_OFFSET: Final = 1e-3
"""Height at which a ray to the sun starts above a surface, m; chosen: it must not meet it."""
SHADOW_RAY_LENGTH: Final = 1e3
"""Length of the rays to the sun, m; chosen: bodies further off throw no shadow."""
RAYS_PER_BLOCK: Final = 200_000
"""Number of rays that are traced together; chosen: they need some tens of megabytes."""
LABEL_HEIGHT: Final = 32.0
"""Height of a vehicle's name and its margin in the picture, pixels; chosen."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Camera:
    """A pinhole camera at ``position``, towards ``target`` (m); horizontal view ``width`` (rad)."""

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
        """Unit vectors ``(…, xyz)`` through points ``(…, 2)``, in pixels to the right and down."""
        width, height = size
        half = np.tan(0.5 * self.width)
        offset = (2.0 * pixel - (width, height)) / width * half
        right, up, forward = self.frame
        ray = forward + offset[..., :1] * right - offset[..., 1:] * up
        return np.asarray(ray / np.linalg.norm(ray, axis=-1, keepdims=True))

    def project(self, points: FloatArray, size: tuple[int, int]) -> FloatArray:
        """Pixels ``(…, 2)`` of world points ``(…, xyz)``; NaN for points behind the camera."""
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
    """The street in three dimensions; its data are the vehicles and their pixels.

    Parameters
    ----------
    camera : `overview` of the scene if absent
    size : pixels across and down
    caster : traces rays among the triangles of `surfaces`; the channel's caster if absent
    """
    camera = camera or overview(scene)
    picture = render(scene, camera=camera, size=size, caster=caster)
    width, height = size
    figure = new_figure(width / 160.0, height / 160.0)
    figure.set_layout_engine("none")  # the picture fills the figure
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.imshow(picture, extent=(0.0, width, height, 0.0), interpolation="nearest")
    axes.set(xlim=(0.0, width), ylim=(height, 0.0))
    axes.set_axis_off()
    vehicles = [actor for actor in scene.actors if actor.kind == "vehicle"]
    boxes = [extent(actor) for actor in vehicles]
    roofs = np.array([[*(0.5 * (low + high))[:2], high[2]] for low, high in boxes]).reshape(-1, 3)
    pixels = camera.project(roofs, size)
    _draw_names(axes, [actor.name for actor in vehicles], pixels, size)
    data: dict[str, Column] = {
        "name": [actor.name for actor in vehicles],
        **{f"{axis}_m": roofs[:, number] for number, axis in enumerate("xyz")},
        "pixel_right": pixels[:, 0],
        "pixel_down": pixels[:, 1],
    }
    return Drawing(figure=figure, data=data)


def _draw_names(
    axes: Axes, names: Sequence[str], pixels: FloatArray, size: tuple[int, int]
) -> None:
    """Draw names above the vehicles in the picture; none covers another."""
    width, height = size
    placed: list[tuple[float, float, float]] = []
    for name, (x, y) in zip(names, pixels, strict=True):
        if not (0.0 <= x < width and 0.0 <= y < height):
            continue
        half = 6.0 * len(name) + 12.0  # half the label's width, which stays in the picture
        middle, base = float(np.clip(x, half, width - half)), max(y - 54.0, 36.0)
        while any(
            abs(middle - m) < half + h and abs(base - b) < LABEL_HEIGHT for m, h, b in placed
        ):
            base -= LABEL_HEIGHT
        placed.append((middle, half, base))
        axes.annotate(
            name,
            xy=(x, y),
            xytext=(middle, base),
            ha="center",
            size=8,
            bbox={"boxstyle": "round,pad=0.25", "facecolor": "white", "alpha": 0.85, "lw": 0},
            arrowprops={"arrowstyle": "-", "color": INK, "linewidth": 0.8},
        )


def render(
    scene: Scene, *, camera: Camera, size: tuple[int, int], caster: RayCaster | None = None
) -> NDArray[np.uint8]:
    """Picture ``(down, right, rgb)`` of a scene, each pixel the mean of four rays."""
    street = surfaces(scene)
    if caster is None:
        from polychirp.channel.geometry.bvh import Caster

        caster = Caster(street.corners)
    looks, eye = _FaceLooks.of(street), np.array(camera.position)
    width, height = size
    right = (np.arange(2 * width) + 0.5) / 2.0
    lines = max(1, RAYS_PER_BLOCK // (4 * width))
    picture = np.empty((height, width, 3))
    for top in range(0, height, lines):
        rows = np.arange(2 * top, 2 * min(top + lines, height))
        pixel = np.stack(np.meshgrid(right, (rows + 0.5) / 2.0), axis=-1)
        light = _light(looks, caster, eye, camera.directions(pixel, size).reshape(-1, 3))
        fine = light.reshape(-1, 2, width, 2, 3)
        picture[top : top + lines] = fine.mean(axis=(1, 3))
    return np.asarray(np.rint(255.0 * _on_screen(picture)), dtype=np.uint8)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _FaceLooks:
    """Optical properties of all faces, ``(face, …)``; colours are linear in light."""

    normal: FloatArray
    colour: FloatArray
    mirrored_share: FloatArray
    is_road: BoolArray

    @classmethod
    def of(cls, street: Surfaces) -> "_FaceLooks":
        return cls(
            normal=street.normal,
            colour=street.colour**2.2,
            mirrored_share=np.array(
                [MIRRORED_SHARE.get(material, 0.0) for material in street.material]
            ),
            is_road=np.array([material == "asphalt" for material in street.material], dtype=bool),
        )


def _light(
    looks: _FaceLooks, caster: RayCaster, eye: FloatArray, directions: FloatArray
) -> FloatArray:
    """Linear light ``(ray, rgb)`` that reaches the camera at ``eye`` from ``directions``."""
    distance, face = caster.closest(np.broadcast_to(eye, directions.shape), directions)
    light = _sky(directions)
    hit = np.isfinite(distance)
    if np.any(hit):
        incoming, face, distance = directions[hit], face[hit], distance[hit]
        point = eye + distance[:, None] * incoming
        normal = looks.normal[face]
        normal = normal * -np.sign(np.sum(normal * incoming, axis=1, keepdims=True))
        shaded = _shade(looks, caster, face, point, normal, incoming)
        haze = 1.0 - np.exp(-((distance / 250.0) ** 2))[:, None]
        light[hit] = shaded * (1.0 - haze) + HORIZON_COLOUR * haze
    return light


def _shade(
    looks: _FaceLooks,
    caster: RayCaster,
    face: IntArray,
    point: FloatArray,
    normal: FloatArray,
    incoming: FloatArray,
) -> FloatArray:
    """Light of points: from sun and sky by Lambert's law, and the sky's mirror image."""
    on_line = looks.is_road[face] & _is_painted(point)
    colour = np.where(on_line[:, None], LINE_COLOUR**2.2, looks.colour[face])
    start = point + SHADOW_RAY_OFFSET * normal
    sun = np.maximum(normal @ SUN_DIRECTION, 0.0) * ~caster.occluded(
        start, start + SHADOW_RAY_LENGTH * SUN_DIRECTION
    )
    up = 0.5 * (1.0 + normal[:, 2:])
    ambient = 0.55 * (
        up * (0.5 * ZENITH_COLOUR + 0.5 * HORIZON_COLOUR) + (1.0 - up) * GROUND_COLOUR
    )
    diffuse = colour * (SUN_COLOUR * sun[:, None] + ambient)
    cosine = np.sum(incoming * normal, axis=1)
    share = (looks.mirrored_share[face] * (0.35 + 0.65 * (1.0 - np.abs(cosine)) ** 3))[:, None]
    mirrored = incoming - 2.0 * cosine[:, None] * normal
    return np.asarray(diffuse * (1.0 - share) + _sky(mirrored) * share)


def _is_painted(point: FloatArray) -> BoolArray:
    """Mask of points on the dashed line between the lanes or on the lines beside them."""
    x, y = point[:, 0], np.abs(point[:, 1])
    return np.asarray(((y < 0.07) & (x % 6.0 < 3.0)) | (np.abs(y - 3.4) < 0.06))


def _sky(directions: FloatArray) -> FloatArray:
    height = directions[:, 2:]
    sky = HORIZON_COLOUR + (ZENITH_COLOUR - HORIZON_COLOUR) * np.sqrt(np.clip(height, 0.0, 1.0))
    ground = GROUND_COLOUR**2.2 + (HORIZON_COLOUR - GROUND_COLOUR**2.2) * np.exp(
        np.minimum(height, 0.0) * 14.0
    )
    return np.asarray(np.where(height >= 0.0, sky, ground))


def _on_screen(light: FloatArray) -> FloatArray:
    """Screen values 0 to 1 of linear light, with bright parts compressed."""
    return np.asarray((1.0 - np.exp(-1.5 * np.maximum(light, 0.0))) ** (1.0 / 2.2))
