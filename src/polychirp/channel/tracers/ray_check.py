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


def checked(paths: PropagationPaths, scene: Scene) -> PropagationPaths:
    """The same paths, of the radars and bodies of ``scene``.

    Directions that are means of many contributions, whose coherence time is finite, are not
    checked: their length is not exactly 1.

    Raises
    ------
    InputError
        A path has a negative delay, a delay rate of 1 or more, a direction that is no unit vector,
        or a radar or a body that the scene does not have.

    Examples
    --------
    >>> from polychirp.model.scene import Scene
    >>> from polychirp.testing.paths import HandPath, paths_of
    >>> checked(paths_of(HandPath(delay=-1e-9)), Scene(time=0.0, actors=(), radars=(), carriers=()))
    Traceback (most recent call last):
        ...
    polychirp.errors.InputError: the tracer's path 0 has a delay of -1e-09 s; delays are positive
    """
    _refuse(paths.delay < 0, paths.delay, "a delay of {:g} s; delays are positive")
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
        raise InputError(
            f"a path of the tracer has a bounce at the body {paths.bounce_actor[bounce]}, and the "
            f"scene has {len(scene.actors)} bodies, counted from 0"
        )
    return paths


def _is_unknown(number: IntArray, count: int) -> BoolArray:
    return (number < 0) | (number >= count)


def _refuse(is_wrong: BoolArray, value: FloatArray | IntArray, sentence: str) -> None:
    if is_wrong.any():
        path = int(np.argmax(is_wrong))
        raise InputError(f"the tracer's path {path} has {sentence.format(value[path])}")
