"""Propagation paths written by hand."""

from dataclasses import dataclass

import numpy as np

from polychirp.constants import SPEED_OF_LIGHT
from polychirp.model.paths import Bounce, PropagationPaths


@dataclass(frozen=True, slots=True, kw_only=True)
class HandPath:
    """One path of `PropagationPaths`; its transfer matrix is ``gain`` times the unit matrix.

    ``drift`` is the `transfer_drift`; rates are per second. ``actors`` are those of the bounces; if
    empty, actor 0 has them all.
    """

    delay: float
    delay_rate: float = 0.0
    delay_acceleration: float = 0.0
    gain: complex = 1.0
    drift: complex = 0.0
    transmitter: int = 0
    receiver: int = 0
    departure: tuple[float, float, float] = (1.0, 0.0, 0.0)
    arrival: tuple[float, float, float] = (1.0, 0.0, 0.0)
    departure_rate: tuple[float, float, float] = (0.0, 0.0, 0.0)
    arrival_rate: tuple[float, float, float] = (0.0, 0.0, 0.0)
    bounces: tuple[Bounce, ...] = ()
    actors: tuple[int, ...] = ()


def paths_of(
    *paths: HandPath, reference_time: float = 0.0, frequency: float = 79e9
) -> PropagationPaths:
    """A snapshot of the given paths.

    >>> paths_of(HandPath(delay=1e-7, bounces=(Bounce.SCATTERING,))).num_bounces
    array([1])
    """
    kinds = [kind for path in paths for kind in path.bounces]
    actors = [actor for path in paths for actor in path.actors or (0,) * len(path.bounces)]
    return PropagationPaths(
        reference_time=reference_time,
        frequency=frequency,
        transmitter=np.array([path.transmitter for path in paths], dtype=np.int64),
        receiver=np.array([path.receiver for path in paths], dtype=np.int64),
        delay=np.array([path.delay for path in paths]),
        delay_rate=np.array([path.delay_rate for path in paths]),
        transfer=np.array([path.gain * np.eye(2) for path in paths]).reshape(-1, 2, 2),
        departure=np.array([path.departure for path in paths]).reshape(-1, 3),
        arrival=np.array([path.arrival for path in paths]).reshape(-1, 3),
        bounce_start=np.cumsum([0, *(len(path.bounces) for path in paths)]),
        bounce_actor=np.array(actors, dtype=np.int64),
        bounce_kind=np.array(kinds, dtype=np.int64),
        bounce_point=np.zeros((len(kinds), 3)),
        delay_acceleration=np.array([path.delay_acceleration for path in paths]),
        transfer_drift=np.array([path.drift for path in paths], dtype=np.complex128),
        departure_rate=np.array([path.departure_rate for path in paths]).reshape(-1, 3),
        arrival_rate=np.array([path.arrival_rate for path in paths]).reshape(-1, 3),
    )


def free_space_gain(distance: float, *, frequency: float = 79e9) -> float:
    """Amplitude λ/4πd between isotropic antennas at the ``distance`` d, m (Friis).

    >>> round(float(20 * np.log10(free_space_gain(10.0))), 2)
    -90.4
    """
    return SPEED_OF_LIGHT / (frequency * 4.0 * np.pi * distance)
