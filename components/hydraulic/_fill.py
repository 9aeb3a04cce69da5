"""One liquid for a whole circuit, and with it the choice whether the circuit carries heat."""

from typing import Any, TypeVar

import jax
import jax.numpy as jnp

from acausal import ArgumentError, Array, Component

from ._heat_carrier import HeatCarrier, changed
from ._interfaces import FluidPart, FluidPort, ThermalFluidPort
from ._liquids import AnyLiquid, Liquid

M = TypeVar("M")


def fill(model: M, liquid: AnyLiquid) -> M:
    """A copy of the model with `liquid` in every component that has one, so that one record defines a whole circuit.

    You can differentiate through it, for example with respect to `liquid.air` for a whole circuit. In a machine with
    two circuits, fill each separately. Raises `ArgumentError` if no component has a liquid.

    A liquid that carries heat, such as `iso_vg_46(carries_heat=True)`, gives temperatures to all parts and nodes, also
    to parts without a liquid record: see `MixedPart`. Liquid volumes start at the temperature of the liquid. Density
    and bulk modulus stay those at this temperature. Raises `ArgumentError` for a part that cannot carry heat.
    """
    found = _count(model, AnyLiquid)
    if isinstance(liquid, Liquid) and liquid.caloric is not None:
        carrier = HeatCarrier(
            capacity=liquid.reference_density * liquid.caloric.specific_heat,
            temperature=liquid.temperature,
            conductance=liquid.caloric.conductance,
        )
        found += _count(model, FluidPart)
        model = _carrying(model, carrier, ())
        liquid = changed(liquid, caloric=None)
    if not found:
        raise ArgumentError(
            f"fill found no component in {type(model).__name__} with a liquid. Build its components with `liquid=...`."
        )

    def exchanged(node: Any) -> Any:
        return _spread(liquid, jnp.shape(node.density)) if isinstance(node, AnyLiquid) else node

    return jax.tree_util.tree_map(exchanged, model, is_leaf=lambda node: isinstance(node, AnyLiquid))


def _count(model: Any, kind: type) -> int:
    leaves = jax.tree_util.tree_leaves(model, is_leaf=lambda node: isinstance(node, kind))
    return sum(isinstance(node, kind) for node in leaves)


def _spread(tree: Any, members: tuple[int, ...]) -> Any:
    """The same values for all members of an array of components."""
    return jax.tree_util.tree_map(lambda leaf: jnp.broadcast_to(leaf, members + jnp.shape(leaf)), tree)


def _carrying(model: Any, carrier: HeatCarrier, members: tuple[int, ...]) -> Any:
    """A copy of a model whose liquid carries heat."""

    def exchanged(node: Any) -> Any:
        if isinstance(node, FluidPort):
            return ThermalFluidPort(**{name: getattr(node, name) for name in ("p", "q")})
        if isinstance(node, Array):
            return Array(item=_carrying(node.item, carrier, (*members, node.n)), n=node.n, axis=node.axis)
        if not isinstance(node, FluidPart):
            return node
        if node.carrier is not None:
            raise ArgumentError(f"{type(node).__name__} carries heat already: fill the circuit once, as it was built.")
        inner = jax.tree_util.tree_map(exchanged, node, is_leaf=lambda part: isinstance(part, FluidPort))
        return inner.carrying(_spread(carrier, members))

    def is_whole(node: Any) -> bool:
        _refuse(node)
        return isinstance(node, FluidPort | FluidPart | Array)

    return jax.tree_util.tree_map(exchanged, model, is_leaf=is_whole)


def _refuse(node: Any) -> None:
    """Raise `ArgumentError` for a part with fluid ports and equations that says nothing about heat."""
    if not isinstance(node, Component) or isinstance(node, FluidPart):
        return
    cls = type(node)
    has_ports = any(isinstance(port, FluidPort) for port in vars(node).values())
    if has_ports and cls.equations is not Component.equations:
        raise ArgumentError(
            f"{cls.__name__} cannot carry heat, because it does not know how much liquid it holds. Replace it by a "
            "part with a liquid, such as a Chamber, a Pipe or a SingleActingCylinder; derive a class of your own from "
            "MixedPart."
        )
