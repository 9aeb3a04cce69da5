"""The undocumented parts of equinox that the library uses; a new version of equinox needs changes only here.

- `while_loop`: a loop of bounded length that can be differentiated in reverse mode, at any depth of nesting.
- `written`: a buffer of such a loop with another row.
- `members_of`: the members of an enumeration, which cannot be iterated over.
- `unvmap_any`: whether a condition is true in any member of a batch, so that branches that no member takes are skipped.
"""

from typing import Any

from equinox.internal import buffer_at_set
from equinox.internal import unvmap_any as unvmap_any
from equinox.internal import while_loop as while_loop


def members_of(enumeration: Any) -> dict[str, Any]:
    """The members of an enumeration by name, in their order."""
    return dict(enumeration._name_to_item)


def written(buffer: Any, value: Any, index: Any, pred: Any) -> Any:
    """A buffer with another row, if `pred` is true."""
    return buffer_at_set(buffer, index, value, pred=pred)
