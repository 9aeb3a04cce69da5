"""The public components and records of a package."""

import inspect
import types

from acausal import Component, Record


def exported(package: types.ModuleType) -> list[type]:
    """The components and records of a package that are not partial, by name."""
    members = [item for _, item in inspect.getmembers(package, inspect.isclass)]
    final = [item for item in members if issubclass(item, Component | Record) and not item._partial]
    return sorted(final, key=lambda item: item.__name__.lower())
