"""Methods of mitigation by name: those of polychirp, of other packages, and of a user's module."""

from collections.abc import Mapping
from importlib import import_module
from typing import Any, Final

from polychirp.errors import InputError, no_such
from polychirp.plugins import plugged
from polychirp.receiver.mitigation import (
    Autoregression,
    Blanking,
    Burg,
    ChirpSubtraction,
    ComplexNetwork,
    DualSparsity,
    Imat,
    Interpolation,
    LowRankHankel,
    MatrixPencil,
    NoiseCanceller,
    Nulling,
    RampMinimum,
    StftExcision,
    StftStatistics,
    Wavelet,
)
from polychirp.receiver.mitigation.base import Mitigation
from polychirp.spec import kinds_of

GROUP: Final = "polychirp.mitigations"
"""Group of entry points by which a package names its methods: specs whose fields have defaults."""

METHODS: Final[Mapping[str, Mitigation]] = {
    "blanking": Blanking(),
    "blanking-amplitude": Blanking(whitening=0),
    "interpolation": Interpolation(),
    "burg": Burg(),
    "burg-ramps": Burg(along="ramps", order=8),
    "autoregression": Autoregression(),
    "matrix-pencil": MatrixPencil(),
    "imat": Imat(),
    "nulling": Nulling(),
    "stft-zeroed": StftExcision(),
    "stft-levelled": StftExcision(cells="levelled"),
    "stft-filled": StftExcision(cells="filled"),
    "stft-statistics": StftStatistics(),
    "wavelet": Wavelet(),
    "dual-sparsity": DualSparsity(window=32),
    "chirp-subtraction": ChirpSubtraction(),
    "noise-canceller": NoiseCanceller(),
    "ramp-minimum": RampMinimum(),
    "low-rank-hankel": LowRankHankel(),
    "complex-network": ComplexNetwork(),
}
"""Methods of polychirp with the settings that are compared, by name."""

SLOW_METHODS: Final = frozenset(("stft-filled", "dual-sparsity", "low-rank-hankel"))
"""Methods that take seconds to a minute for a frame. They are compared if they are named, or if a
number of frames is given for them."""


def methods_named(names: tuple[str, ...], own: tuple[str, ...]) -> dict[str, Mitigation]:
    """Methods by name.

    Parameters
    ----------
    names : of `METHODS`, or of entry points of `GROUP`; if empty, all but the slow ones
    own : further ones, each as ``NAME=MODULE:OBJECT``

    Raises
    ------
    InputError
        There is no such method or object, or it has no ``mitigate``.

    Examples
    --------
    >>> list(methods_named(("imat",), ("mine=polychirp.receiver.mitigation:Blanking",)))
    ['imat', 'mine']
    """
    offered = {kinds_of(member)[0]: member for member in plugged(GROUP, "mitigate")}
    known = [*METHODS, *offered]
    chosen: dict[str, Mitigation] = {}
    for name in names or [name for name in known if name not in SLOW_METHODS]:
        if name not in known:
            raise InputError(f"--method: {no_such('method', name, known)}")
        chosen[name] = METHODS[name] if name in METHODS else _made(name, offered[name])
    for text in own:
        name, _, place = text.partition("=")
        if not name or ":" not in place:
            raise InputError(
                f"--own: '{text}' is no NAME=MODULE:OBJECT, such as mine=my_package.repair:Mine"
            )
        if name in chosen:
            raise InputError(f"--own: there is a method '{name}' already; choose another name")
        chosen[name] = loaded(name, place)
    return chosen


def loaded(name: str, place: str) -> Mitigation:
    """The method at ``MODULE:OBJECT``; a class is called without arguments.

    Raises
    ------
    InputError
        It cannot be imported, or has no ``mitigate``.
    """
    module, _, path = place.partition(":")
    try:
        found: Any = import_module(module)
        for part in path.split("."):
            found = getattr(found, part)
    except (ImportError, AttributeError, ValueError) as error:
        raise InputError(f"the method '{name}' cannot be made of '{place}': {error}") from None
    method = _made(name, found) if isinstance(found, type) else found
    if not callable(getattr(method, "mitigate", None)):
        raise InputError(
            f"the method '{name}', '{place}', has no function 'mitigate(frame)'; "
            "polychirp.Mitigation says what it takes and returns"
        )
    mitigation: Mitigation = method
    return mitigation


def _made(name: str, kind: type) -> Any:
    """The method of a class, whose settings have their defaults."""
    try:
        return kind()
    except (TypeError, ValueError) as error:
        raise InputError(
            f"the method '{name}' cannot be made of {kind.__name__}: {error}"
        ) from None
