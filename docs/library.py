"""The components of the library, listed from their docstrings."""

import inspect
import types

from acausal import Component, Record

NAME_WIDTH = 30


def listing(package: types.ModuleType) -> str:
    """A line for each component and record that a package exports: its name and the first sentence of its docstring."""
    members = inspect.getmembers(package, inspect.isclass)
    final = [(name, item) for name, item in members if issubclass(item, Component | Record) and not item._partial]
    return "\n".join(f"{name:{NAME_WIDTH}}{_summary(item)}" for name, item in sorted(final, key=_without_case))


def _without_case(member: tuple[str, type]) -> str:
    return member[0].lower()


def _summary(item: type) -> str:
    return (inspect.getdoc(item) or "").split("\n")[0]
