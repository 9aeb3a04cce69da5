"""Packages that import their modules when a name of theirs is first asked for."""

import dis
import importlib
import sys
from collections.abc import Callable, Iterator
from types import CodeType
from typing import Any


def when_asked(package: str) -> tuple[Callable[[str], Any], Callable[[], list[str]], list[str]]:
    """`__getattr__`, `__dir__` and `__all__` of a package, from the imports that it states for type checkers.

    To create the class of a component takes a millisecond or two, and a model uses few of some hundred. The imports are
    read from the compiled code, which is there also where the source is not, as in frozen programs.
    """
    module = sys.modules[package]
    assert module.__spec__ is not None
    loader: Any = module.__spec__.loader
    modules = {name: path for name, path in _relative_imports(loader.get_code(package)) if name != "when_asked"}

    def attribute(name: str) -> Any:
        if name not in modules:
            raise AttributeError(f"module {package!r} has no attribute {name!r}", name=name, obj=module)
        value = getattr(importlib.import_module(modules[name], package), name)
        setattr(module, name, value)
        return value

    return attribute, lambda: list(modules), list(modules)


def _relative_imports(code: CodeType) -> Iterator[tuple[str, str]]:
    """The name and the module of each `from .module import name` of a module, in branches that do not run, too."""
    level, names = 0, ()
    for step in dis.get_instructions(code):
        if step.opname == "IMPORT_NAME" and level:
            yield from ((name, "." * level + step.argval) for name in names)
        level, names = names, step.argval
