"""Share of each mechanism of the channel in the received power, for all pairs of radars."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from polychirp.axes import ComplexArray, FloatArray
from polychirp.channel.tracers.composite import Composite
from polychirp.model.paths import PropagationPaths
from polychirp.model.scene import Scene
from polychirp.synthesis.links.links import links_between

BAND: Final = (78.5e9, 79.5e9)
"""Band over which powers are averaged, Hz: the sweep of the paper."""

NUM_FREQUENCIES: Final = 512
"""Number of frequencies in the band, enough for paths of 75 m."""

Variant = Callable[[Composite, Scene], tuple[Composite, Scene]]


def _treeless(tracer: Composite, scene: Scene) -> tuple[Composite, Scene]:
    crowns = [actor.kind == "tree" for actor in scene.actors]
    kept = [number for number, is_tree in enumerate(crowns) if not is_tree]
    return tracer, replace(
        scene,
        actors=tuple(scene.actors[number] for number in kept),
        carriers=tuple(kept.index(carrier) for carrier in scene.carriers),
    )


VARIANTS: Final[Mapping[str, Variant]] = {
    "mirrors": lambda tracer, scene: (replace(tracer, reflecting_planes=False), scene),
    "bounces": lambda tracer, scene: (replace(tracer, max_bounces=1), scene),
    "diffraction": lambda tracer, scene: (replace(tracer, diffraction=False), scene),
    "transmission": lambda tracer, scene: (replace(tracer, transmission=False), scene),
    "diffuse": lambda tracer, scene: (replace(tracer, diffuse=False), scene),
    "trees": _treeless,
}
"""Tracer and scene without each mechanism, by its name; without transmission, panes and bumpers
block."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Mechanisms:
    """Powers at the front ends, averaged over `BAND`, ``(transmitter, receiver)``.

    Parameters
    ----------
    radars : names
    power : W, with all mechanisms, at the first element
    share : mean power of the field that a mechanism adds (with it minus without it), relative to
        ``power``; it may be above 1, if fields cancel. NaN if no power is received
    num_paths : number of paths with all mechanisms, ``(transmitter, receiver)``
    """

    radars: tuple[str, ...]
    power: FloatArray
    share: Mapping[str, FloatArray]
    num_paths: FloatArray


def compare_mechanisms(scene: Scene, tracer: Composite) -> Mechanisms:
    """Trace a scene with all mechanisms, and once without each.

    Examples
    --------
    >>> from polychirp.frames import Pose
    >>> from polychirp.model.radar import Radar
    >>> from polychirp.model.scene import Actor
    >>> cars = (Actor(name="a", kind="vehicle"), Actor(name="b", kind="vehicle", pose=Pose(x=9.0)))
    >>> scene = Scene(time=0.0, actors=cars, carriers=(0, 1),
    ...     radars=(Radar(name="front"), Radar(name="rear", mount=Pose(yaw=3.14))))
    >>> float(compare_mechanisms(scene, Composite()).share["bounces"][0, 1])
    0.0
    """
    paths = tracer.trace(scene)
    whole = _responses(scene, paths)
    power = np.mean(np.abs(whole) ** 2, axis=-1)
    shares = {}
    for name, variant in VARIANTS.items():
        other, world = variant(tracer, scene)
        added = whole - _responses(world, other.trace(world))
        with np.errstate(invalid="ignore"):
            shares[name] = np.mean(np.abs(added) ** 2, axis=-1) / np.where(power > 0, power, np.nan)
    num_paths = np.zeros_like(power)
    np.add.at(num_paths, (paths.transmitter, paths.receiver), 1.0)
    return Mechanisms(
        radars=tuple(radar.name for radar in scene.radars),
        power=power,
        share=shares,
        num_paths=num_paths,
    )


def _responses(scene: Scene, paths: PropagationPaths) -> ComplexArray:
    """Response of every pair with antennas, √W, ``(transmitter, receiver, frequency)``."""
    frequency = np.linspace(*BAND, NUM_FREQUENCIES)
    size = len(scene.radars)
    out = np.zeros((size, size, NUM_FREQUENCIES), dtype=np.complex128)
    for transmitter in range(size):
        for victim in range(size):
            links = links_between(scene, paths, victim=victim, transmitter=transmitter)
            delay = links.delay_at(links.reference_time)[:, 0]
            out[transmitter, victim] = links.amplitude @ np.exp(
                -2j * np.pi * delay[:, None] * frequency
            )
    return out
