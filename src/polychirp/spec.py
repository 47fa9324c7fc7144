"""`Spec`, a value that a study file can hold, and `ByKind`, a choice among several specs."""

from typing import Any, ClassVar, get_args, get_type_hints


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
    """

    __slots__ = ("default",)

    def __init__(self, *, default: str | None = None) -> None:
        self.default = default

    def _kind(self, value: Any) -> Any:
        """The ``kind`` of a table or of a spec."""
        if isinstance(value, dict):
            return value.get("kind", self.default)
        return getattr(value, "kind", None)

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> dict[str, Any]:
        """Schema by which ``kind`` chooses the member; pydantic calls this method."""
        return {
            "type": "tagged-union",
            "discriminator": "kind" if self.default is None else self._kind,
            "choices": {
                kind: handler.generate_schema(member)
                for member in get_args(source)
                for kind in get_args(get_type_hints(member)["kind"])
            },
        }
