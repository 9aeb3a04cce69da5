"""References for the level of across variables, as remedies in messages."""

from collections.abc import Iterable

from .flat_model import FlatLeaf


def reference_of(leaves: Iterable[FlatLeaf]) -> str:
    """The components that the ports of these leaves name as their reference, such as "a Ground"."""
    named = dict.fromkeys(leaf.port.reference for leaf in leaves if leaf.port is not None and leaf.port.reference)
    return " or ".join(named) or "a component that fixes the across variable of one of its ports"
