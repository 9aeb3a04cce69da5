"""Declared ranges of variables."""

import functools as ft
from typing import NamedTuple

import jax.numpy as jnp
from jax import Array

from .._declare.annotations import Sign
from .._numbers import Numbers
from .incidence import Incidence, Pair


class Range(NamedTuple):
    """The range of an alias, which equals the variable times `factor`."""

    sign: Sign
    factor: int


Ranges = tuple[Range, ...]


@ft.lru_cache(maxsize=64)
def ranges_of(table: Incidence) -> dict[int, dict[Range, int]]:
    """For each variable with declared ranges, the ranges with a node that declares each."""
    flat, merged, found = table.flat, table.merged, {}
    for leaf in flat.variable_leaves:
        sign = flat.leaves[leaf].declaration.sign
        if sign is None:
            continue
        for node in flat.leaves[leaf].nodes:
            representative = int(merged.representative[node])
            variable = table.number_of_node[representative] if representative >= 0 else -1
            if variable >= 0:
                found.setdefault(variable, {}).setdefault(Range(sign, int(merged.sign[node])), int(node))
    return found


def ranges_of_pair(table: Incidence, pair: Pair) -> Ranges:
    """The ranges of a variable; a derivative has none."""
    variable, order = pair
    return () if order else tuple(ranges_of(table).get(variable, ()))


def is_within(value: Numbers, ranges: Ranges) -> Array:
    """Whether each element of a variable lies in its ranges."""
    inside = jnp.ones(jnp.shape(value), bool)
    for sign, factor in ranges:
        inside &= sign.admits(factor * value)
    return inside


def within(value: Numbers, ranges: Ranges) -> Array:
    """The variable inside its ranges, NaN outside."""
    return jnp.where(is_within(value, ranges), value, jnp.nan)


def requirements(table: Incidence, pairs: list[Pair]) -> list[str]:
    """Declared ranges of variables as sentences for a message."""
    nodes = {node: sign for v, k in pairs if k == 0 for (sign, _), node in ranges_of(table).get(v, {}).items()}
    units = {node: table.flat.leaves[table.flat.leaf_of_node[node]].declaration.unit for node in nodes}
    return [f"{table.flat.node_name(node)} must be {sign.name} (unit {units[node]})" for node, sign in nodes.items()]
