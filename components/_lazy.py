"""Packages that import their modules when a name of theirs is first asked for."""

import ast
import importlib
import inspect
import sys
from collections.abc import Callable
from typing import Any


def when_asked(package: str) -> tuple[Callable[[str], Any], Callable[[], list[str]], list[str]]:
    """`__getattr__`, `__dir__` and `__all__` of a package, from the imports that its source states for type checkers.

    To create the class of a component takes a millisecond or two, and a model uses few of some hundred.
    """
    module = sys.modules[package]
    stated = [item for item in ast.walk(ast.parse(inspect.getsource(module))) if isinstance(item, ast.ImportFrom)]
    modules = {alias.name: "." * item.level + str(item.module) for item in stated if item.level for alias in item.names}
    del modules["when_asked"]

    def attribute(name: str) -> Any:
        if name not in modules:
            raise AttributeError(f"module {package!r} has no attribute {name!r}", name=name, obj=module)
        value = getattr(importlib.import_module(modules[name], package), name)
        setattr(module, name, value)
        return value

    return attribute, lambda: list(modules), list(modules)
