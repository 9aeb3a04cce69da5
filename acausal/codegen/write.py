"""The text of a header and a source file of C from the functions and calls of a model."""

import re
from collections.abc import Iterable, Sequence
from importlib.resources import files

import numpy as np

from .calls import Call, Solve
from .expressions import HELPERS, TYPES, Names, number
from .layout import Quantity
from .values import Tables
from .writer import wrapped


def enumeration(prefix: str, entries: Iterable[tuple[str, int, str]]) -> str:
    """Positions in an array by name: the name, the position and a comment."""
    names = Names()
    lines = [f"    {prefix}{names.new(name)} = {place}, /* {comment} */" for name, place, comment in entries]
    return "\n".join(["enum {", *lines, "};", ""]) if lines else ""


def places_of(prefix: str, quantities: Sequence[Quantity]) -> str:
    """The positions of parameters, states or discrete variables."""
    entries = []
    for quantity in quantities:
        size = f", {quantity.size} elements" if quantity.size != 1 else ""
        entries.append((quantity.name, quantity.place, f"{quantity.name} [{quantity.unit}]{size}"))
    return enumeration(prefix, entries)


def array(name: str, values: np.ndarray, kind: str = "f", of: str = "static const ") -> str:
    """The definition of an array of numbers; one zero if it is empty."""
    flat = np.ravel(values) if np.size(values) else np.zeros(1)
    text = ", ".join(number(value, kind).text for value in flat)
    return "\n".join([f"{of}{TYPES[kind]} {name}[{len(flat)}] = {{", *wrapped("    " + text, "    "), "};"])


def helpers(text: str) -> list[str]:
    """The definitions of the helpers that a text calls, and of those that they call."""
    used = [name for name in HELPERS if re.search(rf"\b{name}\(", text)]
    return [HELPERS[name] for name in used]


def constants(tables: Tables) -> list[str]:
    return [array(name, values, kind) for name, (values, kind) in tables.arrays.items()]


def part(name: str) -> str:
    """A file of C that all models share."""
    return (files("acausal.codegen") / "parts" / f"{name}.c").read_text().rstrip()


def shared(evaluations: Sequence[Call | Solve], *, has_roots: bool, has_matrix: bool, has_equations: bool) -> list[str]:
    """The functions for simultaneous blocks that the calls and the steps need."""
    solves = [item for item in evaluations if isinstance(item, Solve)]
    parts = ["eliminate"] if solves or has_matrix or has_equations else []
    parts += ["equations"] if solves or has_equations else []
    if solves:
        parts += ["newton"] if any(not item.block.is_linear for item in solves) else []
        parts += ["linear"] if any(item.block.is_linear for item in solves) else []
        parts += ["root"] if has_roots else []
    most = max((len(item.block.sizes) for item in solves), default=1)
    found = [part(name) for name in parts]
    return [f"#define MAX_UNKNOWNS {most} /* of a simultaneous block */"] * bool(solves) + found


def function(head: str, lines: Sequence[str], unread: Sequence[str] = (), *, is_constant: bool = False) -> str:
    """A function of the struct m, with local names for the arrays that it reads. `unread` are arguments that it may
    not need.
    """
    text = "\n".join(lines)
    pointer = "const double *" if is_constant else "double *"
    own = {
        "t": "const double t = m->t;",
        "p": "const double *p = m->p;",
        "d": "const double *d = m->d;",
        "v": f"{pointer}v = m->v;",
        "dv": f"{pointer}dv = m->dv;",
    }
    local = [f"    {line}" for name, line in own.items() if _mentions(text, name)]
    whole = "\n".join([*local, *lines])
    silent = [f"    (void){name};" for name in unread if not _mentions(whole, name)]
    return "\n".join([head, "{", *local, *silent, *lines, "}"])


def _mentions(text: str, name: str) -> bool:
    """Whether a text contains a name that is not a field of a struct."""
    return bool(re.search(rf"(?<![\w>.]){name}\b", re.sub(r"/\*.*?\*/", "", text)))
