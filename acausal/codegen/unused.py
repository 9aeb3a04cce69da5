"""Removal of variables that a C function sets but never reads."""

import re
from collections import Counter
from collections.abc import Sequence

_DECLARATION = re.compile(r"\s*(?:const )?(?:double|int|unsigned) (\w+)(?:\[\d+\])?(?: = .*)?;$")
_ASSIGNMENT = re.compile(r"\s*(\w+)(?:\[[^=]*\])? = (.*);$")
_WORD = re.compile(r"\b[A-Za-z_]\w*\b")


def without_unused(lines: Sequence[str]) -> list[str]:
    """The statements without those that only compute values that nothing reads."""
    kept = list(lines)
    while True:
        declared = {found[1] for line in kept if (found := _DECLARATION.match(line))}
        reads: Counter[str] = Counter()
        for line in kept:
            reads.update(_read(line))
        unused = {name for name in declared if not reads[name]}
        remaining = [line for line in kept if _sets(line) not in unused]
        remaining = _without_empty_blocks(remaining)
        if len(remaining) == len(kept):
            return kept
        kept = remaining


def _sets(line: str) -> str | None:
    """The variable that a statement declares or assigns."""
    found = _DECLARATION.match(line) or _ASSIGNMENT.match(line)
    return found[1] if found else None


def _read(line: str) -> list[str]:
    """The names in a statement, except the variable that it sets; a value set from itself is no use of it."""
    target = _sets(line)
    return [word for word in _WORD.findall(line) if word != target]


def _without_empty_blocks(lines: Sequence[str]) -> list[str]:
    found: list[str] = []
    for line in lines:
        if line.strip() == "}" and found and found[-1].lstrip().startswith("for ") and found[-1].endswith("{"):
            found.pop()
        else:
            found.append(line)
    return found
