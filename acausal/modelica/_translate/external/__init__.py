"""External functions of the Modelica Standard Library."""

from collections.abc import Callable
from typing import Any

from . import fourier, matrices, random, streams, strings, tables

# By the name of the C function, or the last part of the Modelica name where several share a C function; with the
# arguments of the Modelica function.
EXTERNAL: dict[str, Callable[..., Any]] = {
    **tables.FUNCTIONS,
    **strings.FUNCTIONS,
    **random.FUNCTIONS,
    **matrices.FUNCTIONS,
    **fourier.FUNCTIONS,
    **streams.FUNCTIONS,
}
# Functions that are implemented here in place of their Modelica text, by their Modelica name.
BY_NAME: dict[str, Callable[..., Any]] = {**matrices.BY_NAME}
