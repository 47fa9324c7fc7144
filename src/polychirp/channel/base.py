"""`RayTracer`, the protocol of all tracers, and functions to build and join path tables."""

from collections.abc import Callable, Sequence, Set
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final, Literal, NamedTuple, Protocol, runtime_checkable

import numpy as np

from polychirp.axes import BoolArray, ComplexArray, FloatArray, IntArray, axes_of
from polychirp.errors import InputError
from polychirp.model.paths import Bounce, PropagationPaths
from polychirp.model.scene import Scene

if TYPE_CHECKING:
    from polychirp.channel.scene.world import World

Capability = Literal[
    "line-of-sight", "occlusion", "points", "vehicle-points", "facets", "planes", "tubes",
    "diffraction", "transmission", "diffuse",
]  # fmt: skip
"""Mechanisms that a tracer may have; a study that needs one its tracer lacks is refused."""

USUAL_FREQUENCY: Final = 79e9
"""Frequency, Hz, at which tracers without a frequency evaluate amplitudes: the paper's."""


class AtFrequency:
    """A tracer that evaluates amplitudes at one ``frequency``, Hz, which may be left to a study."""

    __slots__ = ()
    frequency: float | None

    @property
    def carrier(self) -> float:
        """The frequency, Hz; `USUAL_FREQUENCY` if it is None."""
        return USUAL_FREQUENCY if self.frequency is None else self.frequency


@runtime_checkable
class RayTracer(Protocol):
    """A model of the channel, which turns a scene into its propagation paths.

    A tracer is a `Spec`: frozen, comparable, and without state that could change its results.

    `Composite`, `FreeSpace` and `PointVehicles` are examples.
    """

    @property
    def capabilities(self) -> frozenset[Capability]:
        """Mechanisms of the tracer."""

    def trace(self, scene: Scene) -> PropagationPaths:
        """Every path between the radars of ``scene``, at its time."""


def refuse_no_tracer(tracer: Any) -> None:
    """Refuse what is not a `RayTracer`.

    >>> refuse_no_tracer("free-space")
    Traceback (most recent call last):
        ...
    polychirp.errors.InputError: 'free-space' is no ray tracer; it needs the method trace and the \
property capabilities, as FreeSpace() has them
    """
    # a class has the same names as its instances
    is_tracer = isinstance(tracer, RayTracer) and not isinstance(tracer, type)
    if not is_tracer or not callable(tracer.trace):
        raise InputError(
            f"{tracer!r} is no ray tracer; it needs the method trace and the property "
            "capabilities, as FreeSpace() has them"
        )
    if not isinstance(tracer.capabilities, Set):
        raise InputError(
            f"the capabilities of {tracer!r} are no set; make them a property that gives one, such "
            "as frozenset({'points'})"
        )


class Part(NamedTuple):
    """Paths of one mechanism, or over one body, which are traced and refreshed together.

    ``trace`` takes the world, (transmitter, receiver) pairs ``(pair, 2)``, and the `strength` of
    the strongest path known of every pair ``(transmitter, receiver)``: it may leave out much weaker
    paths. `path_interpolation` compares the error of a part between traces with the power of all
    parts of the same ``whole``; if ``whole`` is empty, with the power of the part itself. If traces
    are more than ``longest`` s apart, a part is taken to be wrong by its own power between them.
    """

    name: str
    trace: Callable[["World", IntArray, FloatArray], PropagationPaths]
    whole: str = ""
    longest: float = np.inf


def all_pairs(
    scene: Scene, receivers: Sequence[int] | None = None, *, max_length: float = np.inf
) -> IntArray:
    """Pairs (transmitter, receiver), own echoes included, of some or all receivers: ``(pair, 2)``.

    Radars that are farther apart than ``max_length`` (m) form no pair.

    >>> from polychirp.model.radar import Radar
    >>> from polychirp.model.scene import Actor
    >>> scene = Scene(time=0.0, actors=(Actor(name="car", kind="vehicle"),), carriers=(0, 0),
    ...     radars=(Radar(name="front"), Radar(name="rear")))
    >>> all_pairs(scene, receivers=[1]).tolist()
    [[0, 1], [1, 1]]
    """
    radars = np.arange(len(scene.radars))
    receiving = radars if receivers is None else np.asarray(receivers, dtype=np.int64)
    pairs = np.stack(np.meshgrid(radars, receiving, indexing="ij"), axis=-1).reshape(-1, 2)
    place = scene.radar_position[pairs]
    return np.asarray(pairs[np.linalg.norm(place[:, 1] - place[:, 0], axis=-1) <= max_length])


def path_table(  # noqa: PLR0913 -- a field of the table each
    *,
    scene: Scene,
    frequency: float,
    pair: IntArray,
    delay: FloatArray,
    delay_rate: FloatArray,
    transfer: ComplexArray,
    departure: FloatArray,
    arrival: FloatArray,
    bounces: Sequence[tuple[Bounce, IntArray, FloatArray]] = (),
    coherence_time: FloatArray | None = None,
    delay_acceleration: FloatArray | None = None,
    transfer_drift: FloatArray | ComplexArray | None = None,
    departure_rate: FloatArray | None = None,
    arrival_rate: FloatArray | None = None,
) -> PropagationPaths:
    """Table of paths that all have the same kinds of bounces in the same order.

    Parameters
    ----------
    pair : (transmitter, receiver), ``(path, 2)``
    bounces : for every bounce its kind, its actors ``(path,)`` and its points, m ``(path, xyz)``
    coherence_time, delay_acceleration, transfer_drift, departure_rate, arrival_rate : as in
        `PropagationPaths`, with its defaults
    """
    ends = np.asarray(pair)
    if ends.ndim != 2 or ends.shape[1] != 2:
        raise InputError(
            f"pair has the shape {ends.shape}; it needs (path, 2), a transmitter and a receiver "
            "for each path"
        )
    actor, kind, point = _bounce_columns(bounces, len(ends))
    changes: dict[str, Any] = {
        "coherence_time": coherence_time,
        "delay_acceleration": delay_acceleration,
        "transfer_drift": transfer_drift,
        "departure_rate": departure_rate,
        "arrival_rate": arrival_rate,
    }
    return PropagationPaths(
        reference_time=scene.time,
        frequency=frequency,
        transmitter=ends[:, 0],
        receiver=ends[:, 1],
        delay=delay,
        delay_rate=delay_rate,
        transfer=transfer,
        departure=departure,
        arrival=arrival,
        bounce_start=np.arange(len(ends) + 1) * len(bounces),
        bounce_actor=actor,
        bounce_kind=kind,
        bounce_point=point,
        **{name: values for name, values in changes.items() if values is not None},
    )


def _bounce_columns(
    bounces: Sequence[tuple[Bounce, IntArray, FloatArray]], num_paths: int
) -> tuple[Any, Any, FloatArray]:
    """Actors ``(bounce,)``, kinds ``(bounce,)`` and points ``(bounce, xyz)``, path by path.

    They keep their types until `PropagationPaths` refuses those that it would truncate.
    """
    actor: list[Any] = []
    kind: list[Any] = []
    point = np.zeros((num_paths, len(bounces), 3))
    for number, (what, whose, where) in enumerate(bounces):
        if np.shape(whose) != (num_paths,) or np.shape(where) != (num_paths, 3):
            raise InputError(
                f"bounce {number} has actors of the shape {np.shape(whose)} and points of the "
                f"shape {np.shape(where)}; {num_paths} paths need ({num_paths},) and "
                f"({num_paths}, 3)"
            )
        kind.append(np.full(num_paths, what))
        actor.append(np.asarray(whose))
        point[:, number] = where
    return _in_order(actor), _in_order(kind), point.reshape(-1, 3)


def _in_order(columns: Sequence[Any]) -> Any:
    """Values ``(bounce,)`` path by path, from one column ``(path,)`` for each bounce of a path."""
    return np.stack(columns, axis=1).reshape(-1) if columns else np.zeros(0, dtype=np.int64)


def no_paths(scene: Scene, frequency: float) -> PropagationPaths:
    """Table without paths."""
    none, vectors = np.zeros(0), np.zeros((0, 3))
    return path_table(
        scene=scene,
        frequency=frequency,
        pair=np.zeros((0, 2), dtype=np.int64),
        delay=none,
        delay_rate=none,
        transfer=np.zeros((0, 2, 2), dtype=np.complex128),
        departure=vectors,
        arrival=vectors,
    )


def gather(tables: Sequence[PropagationPaths]) -> PropagationPaths:
    """All paths of several tables of one scene, in their order.

    >>> from polychirp.model.scene import Scene
    >>> nothing = no_paths(Scene(time=0.0, actors=()), 79e9)
    >>> gather([nothing, nothing]).num_paths
    0
    """
    columns: dict[str, Any] = {
        name: np.concatenate([getattr(table, name) for table in tables])
        for name in axes_of(PropagationPaths)
        if name != "bounce_start"
    }
    counts = np.concatenate([table.num_bounces for table in tables])
    columns["bounce_start"] = np.concatenate([[0], np.cumsum(counts)])
    return replace(tables[0], **columns)


def strength(paths: PropagationPaths, scene: Scene) -> FloatArray:
    """Greatest power ratio of every path, ``(path,)``, with the gains of the two radars' elements.

    It is the greatest squared magnitude in the transfer matrix, times both elements' gains towards
    the path. Without these gains, a reflection from below a radar could exclude the paths ahead.
    """
    power = np.max(np.abs(paths.transfer) ** 2, axis=(-2, -1))
    turn = scene.radar_rotation
    for ends, direction in (
        (paths.transmitter, paths.departure),
        (paths.receiver, paths.arrival),
    ):
        for number, radar in enumerate(scene.radars):
            mine = np.flatnonzero(ends == number)
            if mine.size:
                power[mine] *= radar.array.pattern.gain(direction[mine] @ turn[number])
    return np.asarray(power)


def strongest_of_pair(paths: PropagationPaths, power: FloatArray, num_radars: int) -> FloatArray:
    """Greatest of the paths' ``power`` ``(path,)`` for every ``(transmitter, receiver)``."""
    strongest = np.zeros((num_radars, num_radars))
    np.maximum.at(strongest, (paths.transmitter, paths.receiver), power)
    return strongest


def without_weak(paths: PropagationPaths, scene: Scene, dynamic_range: float) -> PropagationPaths:
    """Paths that are `within_range`."""
    return paths.select(within_range(paths, scene, dynamic_range))


def within_range(paths: PropagationPaths, scene: Scene, dynamic_range: float) -> BoolArray:
    """Mask of the paths whose `strength` is within ``dynamic_range`` of their pair's strongest.

    The mask is ``(path,)``, the range a power ratio. Paths without any strength are not within it.
    """
    power = strength(paths, scene)
    strongest = strongest_of_pair(paths, power, len(scene.radars))
    limit = strongest[paths.transmitter, paths.receiver] / dynamic_range
    return np.asarray((power >= limit) & (power > 0))
