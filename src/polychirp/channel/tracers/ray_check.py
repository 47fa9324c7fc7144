"""A check of paths that a tracer without parts has traced: what cannot be is refused."""

from typing import Final

import numpy as np

from polychirp.axes import BoolArray, FloatArray, IntArray
from polychirp.errors import InputError
from polychirp.model.paths import PropagationPaths
from polychirp.model.scene import Scene

LENGTH_TOLERANCE: Final = 1e-3
"""Greatest error of the length of a direction. Chosen: numbers of single precision, and of four
digits in a file, stay below it."""

LONGEST_DELAY: Final = 10e-3
"""Greatest delay, s, of a path: a way of 3000 km. Chosen: no echo of the farthest point that a
study may have, at 1000 km, exceeds it, and delays given in ns or µs instead of s do."""

GREATEST_AMPLITUDE: Final = 10.0
"""Greatest amplitude ratio of a path between isotropic antennas. Chosen: a channel does not amplify
(formulas of points give more than 1 within some centimetres, where they do not hold), and gains
given in dB instead of ratios exceed it."""


def checked(paths: PropagationPaths, scene: Scene) -> PropagationPaths:
    """The same paths, of the radars and bodies of ``scene``.

    Directions that are means of many contributions, whose coherence time is finite, are not
    checked: their length is not exactly 1.

    Raises
    ------
    InputError
        A path has a negative delay or one above `LONGEST_DELAY`, a delay rate of 1 or more, an
        amplitude above `GREATEST_AMPLITUDE`, a direction that is no unit vector, or a radar or a
        body that the scene does not have; or ``paths`` is no table of paths.

    Examples
    --------
    >>> from polychirp.model.scene import Scene
    >>> from polychirp.testing.paths import HandPath, paths_of
    >>> checked(paths_of(HandPath(delay=-1e-9)), Scene(time=0.0, actors=(), radars=(), carriers=()))
    Traceback (most recent call last):
        ...
    polychirp.errors.InputError: the tracer's path 0 has a delay of -1e-09 s; delays are positive
    """
    if not isinstance(paths, PropagationPaths):
        raise InputError(
            f"the tracer's method trace gives a {type(paths).__name__}; let it give "
            "PropagationPaths, which path_table makes"
        )
    _refuse(paths.delay < 0, paths.delay, "a delay of {:g} s; delays are positive")
    _refuse(
        paths.delay > LONGEST_DELAY,
        paths.delay,
        f"a delay of {{:g}} s; delays are in seconds, and at most {LONGEST_DELAY:g} s",
    )
    amplitude = np.max(np.abs(paths.transfer), axis=(1, 2), initial=0.0)
    _refuse(
        amplitude > GREATEST_AMPLITUDE,
        amplitude,
        "an amplitude of {:g} times that transmitted; transfer is a ratio of amplitudes, not in dB",
    )
    _refuse(
        np.abs(paths.delay_rate) >= 1,
        paths.delay_rate,
        "a delay rate of {:g}; it is the rate of the way over the speed of light",
    )
    for name in ("departure", "arrival"):
        length = np.linalg.norm(getattr(paths, name), axis=-1)
        is_wrong = (np.abs(length - 1) > LENGTH_TOLERANCE) & np.isinf(paths.coherence_time)
        _refuse(is_wrong, length, f"a direction of {name} of the length {{:g}}; use unit vectors")
    for name in ("transmitter", "receiver"):
        number = getattr(paths, name)
        known = f"{len(scene.radars)} radars, counted from 0"
        _refuse(
            _is_unknown(number, len(scene.radars)),
            number,
            f"the {name} {{:g}}, and the scene has {known}",
        )
    unknown = _is_unknown(paths.bounce_actor, len(scene.actors))
    if unknown.any():
        bounce = int(np.argmax(unknown))
        path = int(np.searchsorted(paths.bounce_start, bounce, side="right")) - 1
        raise InputError(
            f"the tracer's path {path} has a bounce at the body {paths.bounce_actor[bounce]}, and "
            f"the scene has {len(scene.actors)} bodies, counted from 0"
        )
    return paths


def _is_unknown(number: IntArray, count: int) -> BoolArray:
    return (number < 0) | (number >= count)


def _refuse(is_wrong: BoolArray, value: FloatArray | IntArray, sentence: str) -> None:
    if is_wrong.any():
        path = int(np.argmax(is_wrong))
        raise InputError(f"the tracer's path {path} has {sentence.format(value[path])}")
