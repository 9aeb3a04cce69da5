"""The error of a failed check."""

from .._declare.component import Component
from .._errors import AcausalError


class CheckFailed(AcausalError, AssertionError):
    """A component has failed a check. The message lists all problems."""


def fail(component: Component, problems: list[str]) -> None:
    """Raise `CheckFailed` if there are problems."""
    if problems:
        count = "1 problem" if len(problems) == 1 else f"{len(problems)} problems"
        raise CheckFailed("\n".join([f"{type(component).__name__}: {count} found.", *problems]))
