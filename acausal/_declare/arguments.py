"""The arguments of constructors."""

import dataclasses
import functools as ft
import inspect
import weakref
from collections.abc import Mapping, Sequence

from .._errors import ArgumentError, suggestion


def check_arguments(cls: type, args: Sequence[object], kwargs: Mapping[str, object]) -> None:
    """Raise `ArgumentError` for unknown and missing arguments of a constructor."""
    takes = _parameters(cls)
    if takes is None:
        return
    if args:
        raise ArgumentError(f"{cls.__name__} takes its arguments by name only: {_listed(takes)}.")
    for name in kwargs:
        if name not in takes:
            answer = known_here(cls, name) or suggestion(name, takes)
            raise ArgumentError(f"{cls.__name__} takes no argument {name!r}.{answer} It takes {_listed(takes)}.")
    missing = [name for name, is_needed in takes.items() if is_needed and name not in kwargs]
    if missing:
        raise ArgumentError(f"{cls.__name__} lacks {', '.join(missing)}. It takes {_listed(takes)}.")


def known_here(cls: type, name: str) -> str:
    """A sentence that gives the name here for a name in another library; empty if the class states none."""
    here = getattr(cls, "elsewhere", {}).get(name)
    return f" Here it is {here}." if here else ""


def _listed(takes: Mapping[str, bool]) -> str:
    """Required arguments first, then optional ones, then `nominal`."""
    ordered = sorted(takes, key=lambda name: (not takes[name], name == "nominal"))
    return ", ".join(name if takes[name] else f"[{name}]" for name in ordered) or "none"


@ft.cache
def _parameters(cls: type) -> dict[str, bool] | None:
    """The names of the arguments and whether each is required; None if they can be positional."""
    found = list(inspect.signature(cls.__init__).parameters.values())[1:]
    if any(parameter.kind is not inspect.Parameter.KEYWORD_ONLY for parameter in found):
        return None
    return {parameter.name: parameter.default is inspect.Parameter.empty for parameter in found}


def argument_names(cls: type) -> frozenset[str]:
    """The names of the arguments of a constructor."""
    return frozenset(_parameters(cls) or ())


@ft.cache
def computes_fields(cls: type) -> bool:
    """Whether a constructor takes other arguments than the fields, and computes these."""
    return argument_names(cls) != {field.name for field in dataclasses.fields(cls) if field.init}


# The arguments of nodes by their identity: equinox counts the attributes of an object, so they cannot be one.
_GIVEN: dict[int, tuple[weakref.ref[object], Mapping[str, object]]] = {}


def remember_arguments(node: object, arguments: Mapping[str, object]) -> None:
    """Keep the constructor arguments of a node as long as it lives. Transformations of jax and files do not."""
    key = id(node)
    _GIVEN[key] = weakref.ref(node, lambda _: _GIVEN.pop(key, None)), dict(arguments)


def given_arguments(node: object) -> Mapping[str, object] | None:
    """The arguments with which a node was built; None if they are lost."""
    found = _GIVEN.get(id(node))
    return found[1] if found is not None and found[0]() is node else None
