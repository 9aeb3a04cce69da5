"""External functions of the Modelica Standard Library."""

from collections.abc import Callable
from typing import Any

# By the name of the C function, with the arguments of the Modelica function.
EXTERNAL: dict[str, Callable[..., Any]] = {}
# Functions that are implemented here in place of their Modelica text, by their Modelica name.
BY_NAME: dict[str, Callable[..., Any]] = {}
