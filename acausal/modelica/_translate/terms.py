"""Terms of translated equations: expressions whose names are resolved to slots."""

import dataclasses

from .._syntax.expressions import Expression


@dataclasses.dataclass(frozen=True, slots=True)
class SlotValue:
    """The value of a leaf. `kind`: "real", "integer" or "boolean"; `is_discrete` if only events change it."""

    number: int
    kind: str = "real"
    is_discrete: bool = False


@dataclasses.dataclass(frozen=True, slots=True)
class RecordOf:
    """A record, by field."""

    fields: tuple[tuple[str, Expression], ...]


@dataclasses.dataclass(frozen=True, slots=True)
class Opaque:
    """A value that is no literal, such as an array of strings or a table; `key` identifies it."""

    key: str
    value: object = dataclasses.field(compare=False)
