"""Pipes with pressure waves: segments with compressible liquid, inertia and friction."""

from typing import Any, ClassVar, Self

import jax.numpy as jnp

from acausal import (
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
from ._heat_carrier import HeatCarrier, with_carrier
from ._interfaces import FluidPart, FluidPort
from ._liquids import AnyLiquid
from ._pipe_friction import ChurchillFriction, PipeFriction
from ._pipe_heat import WallPort


class Segments(FluidPart, partial=True):
    """Balances of n segments of length l = length/n between n + 1 nodes; the end nodes have half the volume.

    Acoustic, without convection; inertia and friction use the density rho at atmospheric pressure:

    - (rho l/A) dq_i/dt = p_i - p_(i+1) - f_i, with the volume flow q_i;
    - C(p_i) dp_i/dt = r q_(i-1) - r q_i, with C of liquid and walls, V = A l (1 + wall p), and with the relative
      density r (see `Chamber`) at the upstream node, so that the void of a separated column grows from node to node;
    - steady friction f_i = 32 nu rho l/(A d^2) q_i ratio(Re), Re = |q_i| d/(A nu).

    The upstream node changes within a Reynolds number of about 1. The segments resolve waves longer than about ten
    segments; steeper fronts cause ringing (Viersma, `Analysis, Synthesis and Design of Hydraulic Servosystems and
    Pipelines`, 1980).

    With `heat=True`, a `PipeWall` can be connected to the port `heat`, and the friction leaves there as heat. If the
    liquid carries heat, each node has a temperature, at which the viscosity is taken; the flow carries it from node to
    node, and the heat of friction is spread evenly over the liquid.
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
    heat: WallPort | None = None  # inside of the wall

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
        heat: bool,
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
        self.carrier, self.heat = None, WallPort(nodes=n + 1) if heat else None

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

    def carrying(self, carrier: HeatCarrier) -> Self:
        start: Any = jnp.full(self.n + 1, carrier.temperature)
        return with_carrier(self, carrier, heat=WallPort(nodes=self.n + 1, T=start))

    def shared_equations(self, d: Any) -> Equations:
        heat, carrier = self.heat, self.carrier
        if heat is None:
            return super().shared_equations(d)
        warmed = heat.Q_flow + self.dissipated() * self._volumes() / (self.area * self.length)
        if carrier is None:
            return super().shared_equations(d) | dict(heating=eq(warmed))
        (_, a), (_, b) = self.thermal_ports()
        ends = dict(
            heat_a=eq(a.H_flow, carrier.flow(a.q, a.T, heat.T[0])),
            heat_b=eq(b.H_flow, carrier.flow(b.q, b.T, heat.T[-1])),
        )
        between = carrier.flow(self._carried(), heat.T[:-1], heat.T[1:])
        through = jnp.concatenate([jnp.atleast_1d(a.H_flow), between, -jnp.atleast_1d(b.H_flow)])
        gained = warmed + through[:-1] - through[1:]
        return ends | dict(heating=carrier.balance(d.heat, heat, gained, self._held(), self._joined_inflows()))

    def shared_energy(self, own: Energy) -> Energy:
        if self.heat is None:
            return own
        warmth = 0.0 if self.carrier is None else jnp.sum(self.carrier.stored(self._held(), self.heat))
        return own._replace(stored=own.stored + warmth, dissipated=0.0)

    def energy(self) -> Energy:
        liquid, inflows = self.liquid, self._joined_inflows()
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
        middle = None if self.heat is None or self.carrier is None else 0.5 * (self.heat.T[:-1] + self.heat.T[1:])
        return jnp.asarray(self.liquid.kinematic_viscosity(0.5 * (nodes[:-1] + nodes[1:]), middle))

    def _reynolds(self) -> Vector:
        return jnp.abs(self.q) * self.diameter / (self.area * self._viscosity())

    def _laminar(self) -> Vector:
        """Pressure drops per flow for laminar flow."""
        return 32.0 * self._viscosity() * self.inertance / self.diameter**2

    def _inflows(self) -> tuple[Any, Any, Any]:
        carried = self._carried()
        return self.a.q - carried[0], carried[:-1] - carried[1:], carried[-1] + self.b.q

    def _joined_inflows(self) -> Vector:
        return jnp.concatenate([jnp.atleast_1d(flow) for flow in self._inflows()])

    def _held(self) -> Vector:
        """Liquid at each node in m3, referred to atmospheric density."""
        nodes = self.p
        return jnp.asarray(self._volumes() * (1.0 + self.wall * nodes) * self.liquid.relative_density(nodes))

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
        heat: bool = False,
    ) -> None:
        self._build(n, length, diameter, liquid, friction, wall, p, q, heat)
