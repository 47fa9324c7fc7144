"""`Spec`, a value that a study file can hold, and `ByKind`, a choice among several specs."""

from typing import Annotated, Any, ClassVar, get_args, get_origin, get_type_hints

from polychirp.errors import InputError
from polychirp.plugins import plugged


class Spec:
    """A value that a study file can hold: frozen and comparable; it refuses unknown keys."""

    __slots__ = ()
    __pydantic_config__: ClassVar[dict[str, str]] = {"extra": "forbid"}


class ByKind:
    """Mark of a union of specs of which a study file chooses one by its ``kind``.

    It is written ``Annotated[Sawtooth | Triangular, ByKind()]``; each member has a field
    ``kind: Literal["…"]``. Without the mark, a reader of files tries every member and reports
    the errors of all of them.

    Parameters
    ----------
    default : kind of a table that names none; by default there is no such kind
    group : group of entry points by which other packages add members; None: they cannot
    method : method that such a member must have, and a class of your own in its place in Python
    base : class from which such a member must inherit
    """

    __slots__ = ("base", "default", "group", "method")

    def __init__(
        self,
        *,
        default: str | None = None,
        group: str | None = None,
        method: str = "schedule",
        base: type = object,
    ) -> None:
        self.default, self.group, self.method, self.base = default, group, method, base

    def members(self, union: Any) -> tuple[type, ...]:
        """The members of a union, and those that plug-ins add.

        Raises
        ------
        InputError
            A plug-in cannot be used (`plugins.plugged`), or has the kind of another member.
        """
        own = get_args(union) or (union,)
        if self.group is None:
            return own
        known = {kind for member in own for kind in kinds_of(member)}
        added = plugged(self.group, self.method, self.base)
        for member in added:
            for kind in kinds_of(member):
                if kind in known:
                    raise InputError(
                        f"the plug-in {member.__module__}.{member.__name__} has the kind '{kind}', "
                        "which exists already; give it another one"
                    )
        return (*own, *added)

    def _kind(self, value: Any) -> Any:
        """The ``kind`` of a table or of a spec."""
        if isinstance(value, dict):
            return value.get("kind", self.default)
        return getattr(value, "kind", None)

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> dict[str, Any]:
        """Schema by which ``kind`` chooses the member; pydantic calls this method."""
        own = get_args(source) or (source,)
        return {
            "type": "tagged-union",
            "discriminator": "kind" if self.default is None else self._kind,
            "choices": {
                kind: handler.generate_schema(member)
                if member in own
                else _plugged_schema(member, handler)
                for member in self.members(source)
                for kind in kinds_of(member)
            },
        }


def _plugged_schema(member: type, handler: Any) -> Any:
    """Schema of a class of another package, or an `InputError` if study files cannot hold it."""
    try:
        return handler.generate_schema(member)
    except RuntimeError as error:  # pydantic's error for types that it does not know
        reason = str(error).splitlines()[0].split(". ", 1)[0]
        raise InputError(
            f"the plug-in {member.__module__}.{member.__name__} cannot be used: study files have "
            f"no values of the type of one of its fields ({reason}); give the field another type"
        ) from error


def kinds_of(member: type) -> tuple[str, ...]:
    """Values of ``kind`` by which a file chooses a spec."""
    return get_args(get_type_hints(member)["kind"])


def chosen_by_kind(hint: Any) -> tuple[type, ...]:
    """Members of a type that `ByKind` marks, with those of plug-ins; empty for any other type."""
    if get_origin(hint) is not Annotated:
        return ()
    union, *marks = get_args(hint)
    for mark in marks:
        if isinstance(mark, ByKind):
            return mark.members(union)
    return ()
