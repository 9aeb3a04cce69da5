"""Pipes with pressure waves: segments with compressible liquid, inertia and friction."""

from typing import Any, ClassVar

import jax.numpy as jnp

from acausal import (
    Component,
    Energy,
    Equations,
    Param,
    ParameterError,
    Scalar,
    Var,
    Vector,
    eq,
    magnitude,
    nonnegative,
    positive,
    prefer,
    shape,
)

from .._checks import numbers
from . import _content as content
from ._interfaces import FluidPort
from ._liquids import AnyLiquid
from ._pipe_friction import ChurchillFriction, PipeFriction


class Segments(Component, partial=True):
    """Balances of n segments of length l = length/n between n + 1 nodes; the end nodes have half the volume.

    Acoustic, without convection; inertia and friction use the density rho at atmospheric pressure:

    - (rho l/A) dq_i/dt = p_i - p_(i+1) - f_i, with the volume flow q_i;
    - C(p_i) dp_i/dt = r q_(i-1) - r q_i, with C of liquid and walls, V = A l (1 + wall p), and with the relative
      density r (see `Chamber`) at the upstream node, so that the void of a separated column grows from node to node;
    - steady friction f_i = 32 nu rho l/(A d^2) q_i ratio(Re), Re = |q_i| d/(A nu).

    The upstream node changes within a Reynolds number of about 1. The segments resolve waves longer than about ten
    segments; steeper fronts cause ringing (Viersma, `Analysis, Synthesis and Design of Hydraulic Servosystems and
    Pipelines`, 1980).
    """

    if_singular: ClassVar[str] = content.EMPTY

    n: int  # number of segments, at least 2
    inner: int  # number of inner nodes, n - 1
    length: Param[Scalar, "m", positive]
    diameter: Param[Scalar, "m", positive]  # d, inside diameter
    liquid: AnyLiquid
    friction: PipeFriction
    wall: Param[Scalar, "1/Pa", nonnegative]  # relative increase of the volume with pressure
    q: Var[Vector, "m3/s", prefer, shape("n")]  # volume flow from node to node
    p_inner: Var[Vector, "Pa", prefer, shape("inner")]  # pressure at the inner nodes
    p_a: Var[Scalar, "Pa", prefer]  # pressure at the node of a
    p_b: Var[Scalar, "Pa", prefer]  # pressure at the node of b
    a: FluidPort
    b: FluidPort

    def _build(
        self,
        n: int,
        length: Scalar,
        diameter: Scalar,
        liquid: AnyLiquid,
        friction: PipeFriction | None,
        wall: Scalar,
        p: Any,
        q: Any,
    ) -> None:
        name = type(self).__name__
        if not isinstance(n, int) or n < 2:
            raise ParameterError(f"{name}.n must be a whole number of segments, at least 2, got {n!r}.")
        self.n, self.inner = n, n - 1
        self.length, self.diameter, self.liquid, self.wall = length, diameter, liquid, wall
        self.friction = ChurchillFriction() if friction is None else friction
        self.q = self._start("q", "m3/s", n, q)
        start = self._start("p", "Pa", n + 1, p)
        ends: Any = (None, None, None) if start is None else (start[0], start[1:-1], start[-1])
        self.p_a, self.p_inner, self.p_b = ends
        self.a, self.b = FluidPort(), FluidPort()

    def _start(self, name: str, unit: str, size: int, value: Any) -> Any:
        if value is None:
            return None
        where = f"{type(self).__name__}.{name}"
        start = numbers(self, name, magnitude(value, unit, where))
        if start.shape not in ((), (size,)):
            raise ParameterError(f"{where} must be one number or {size} of them, got an array of shape {start.shape}.")
        return jnp.broadcast_to(start, (size,))

    @property
    def p(self) -> Vector:
        """Pressures in Pa at all nodes, from a to b."""
        first, last = (jnp.asarray(end)[..., None] for end in (self.p_a, self.p_b))
        return jnp.concatenate([first, jnp.asarray(self.p_inner), last], axis=-1)

    @property
    def area(self) -> Scalar:
        """A = pi/4 d^2 in m2."""
        return 0.25 * jnp.pi * self.diameter**2

    @property
    def inertance(self) -> Scalar:
        """Inertance rho l/A of a segment in kg/m4."""
        return self.liquid.reference_density * self.length / (self.n * self.area)

    def equations(self, d: Any) -> Equations:
        (first, inner, last), (net_a, net, net_b) = self._capacities(), self._inflows()
        nodes = self.p
        return dict(
            pressure_a=eq(self.a.p, self.p_a),
            pressure_b=eq(self.b.p, self.p_b),
            momentum=eq(self._inertia() * d.q, nodes[:-1] - nodes[1:] - self._resistance()),
            content_a=eq(first * d.p_a, net_a),
            content=eq(d.p_inner, net / inner),
            content_b=eq(last * d.p_b, net_b),
        )

    def energy(self) -> Energy:
        liquid, inflows = self.liquid, jnp.concatenate([jnp.atleast_1d(flow) for flow in self._inflows()])
        nodes = self.p
        account = content.account(liquid, self._volumes(), nodes, self.wall, inflows)
        return account._replace(
            stored=account.stored + jnp.sum(0.5 * self._inertia() * self.q**2),
            supplied=account.supplied + jnp.sum((nodes[:-1] - nodes[1:]) * (self.q - self._carried())),
            dissipated=jnp.sum(self._resistance() * self.q),
        )

    def _inertia(self) -> Scalar:
        """Effective inertance of a segment in kg/m4."""
        return self.inertance

    def _resistance(self) -> Vector:
        """Frictional pressure drops of the segments."""
        return jnp.asarray(self._laminar() * self.q * self.friction.ratio(self._reynolds(), self.diameter))

    def _viscosity(self) -> Vector:
        nodes = self.p
        return jnp.asarray(self.liquid.kinematic_viscosity(0.5 * (nodes[:-1] + nodes[1:])))

    def _reynolds(self) -> Vector:
        return jnp.abs(self.q) * self.diameter / (self.area * self._viscosity())

    def _laminar(self) -> Vector:
        """Pressure drops per flow for laminar flow."""
        return 32.0 * self._viscosity() * self.inertance / self.diameter**2

    def _inflows(self) -> tuple[Any, Any, Any]:
        carried = self._carried()
        return self.a.q - carried[0], carried[:-1] - carried[1:], carried[-1] + self.b.q

    def _carried(self) -> Vector:
        """Flows as at ports: referred to atmospheric density, with the density of the upstream node."""
        density = jnp.asarray(self.liquid.relative_density(self.p))
        direction = jnp.tanh(self.q * self.diameter / (self.area * self._viscosity()))
        return 0.5 * (density[:-1] + density[1:] + direction * (density[:-1] - density[1:])) * self.q

    def _volumes(self) -> Vector:
        whole = self.area * self.length / self.n
        return whole * jnp.ones(self.n + 1).at[jnp.array([0, -1])].set(0.5)

    def _capacities(self) -> tuple[Any, Any, Any]:
        whole = self.area * self.length / self.n
        shares = ((0.5 * whole, self.p_a), (whole, self.p_inner), (0.5 * whole, self.p_b))
        first, inner, last = (content.capacity(self.liquid, volume, p, self.wall) for volume, p in shares)
        return first, inner, last


class Pipe(Segments):
    """A pipe or hose of n segments with compressible liquid, inertia and friction, for pressure waves.

    `Pipe(n=20, length=10.0, diameter=0.01, liquid=iso_vg_46())`. `friction` is `ChurchillFriction()` by default. `wall`
    is dV/(V dp): diameter/(E thickness) for a thin-walled pipe of modulus E; for a hose, see its data sheet. `p` and
    `q` are the initial pressure and flow: one number, or one for each node (from a to b) and segment. The compile time
    of a run and of its derivatives along parameters does not depend on n. With more than a hundred numbers, as when the
    start values of many nodes are differentiated too, reverse mode is used, which compiles about three times as long.

    If a pipe cavitates, each opening or closing of a void in a segment is a kink in its pressure and takes about thirty
    steps of Rodas5P or twenty of Tsit5. A surge far above the pressure in the pipe needs a larger `max_steps`. See
    `Segments` for the law, `UnsteadyFrictionPipe` for frequency-dependent friction, and `Line` for a pipe that is short
    compared with the waves.
    """

    def __init__(
        self,
        *,
        n: int,
        length: Scalar,
        diameter: Scalar,
        liquid: AnyLiquid,
        friction: PipeFriction | None = None,
        wall: Scalar = 0.0,
        p: Param[Any, "Pa"] | None = None,  # initial pressure at the nodes
        q: Any = None,
    ) -> None:
        self._build(n, length, diameter, liquid, friction, wall, p, q)
