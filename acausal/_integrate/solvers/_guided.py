"""Any solver, kept on invariants, and with the unknowns of the last step at hand for the iterations of the next."""

import functools as ft
from collections.abc import Callable
from typing import Any, TypeAlias

import diffrax
import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

Vector: TypeAlias = Float[Array, " n"]


class Guided(diffrax.AbstractAdaptiveSolver, diffrax.AbstractWrappedSolver):
    r"""Steps of `solver`, each followed by `project(t, y, args)` and `refresh(t, y, memory, args)`.

    The vector that is stepped holds `memory` at the places `start` to `stop`; `solver` sees the rest, as $y$, and hands
    `(args, memory)` to the vector field. The error estimate is that before the projection, which is as small.
    """

    solver: Any
    start: int = eqx.field(static=True)
    stop: int = eqx.field(static=True)
    project: Callable[[Any, Any, Any], Any] = eqx.field(static=True)
    refresh: Callable[[Any, Any, Any, Any], Any] = eqx.field(static=True)

    @property
    def term_structure(self) -> Any:  # pyright: ignore[reportIncompatibleVariableOverride]
        return self.solver.term_structure

    @property
    def term_compatible_contr_kwargs(self) -> Any:  # pyright: ignore[reportIncompatibleVariableOverride]
        return self.solver.term_compatible_contr_kwargs

    @property
    def root_finder(self) -> Any:
        return self.solver.root_finder

    @property
    def scan_kind(self) -> Any:
        return self.solver.scan_kind

    @property
    def interpolation_cls(self) -> Any:  # pyright: ignore[reportIncompatibleVariableOverride, reportIncompatibleMethodOverride]
        return _interpolation(self.solver.interpolation_cls, self.start)

    def order(self, terms: Any) -> Any:
        return self.solver.order(terms)

    def error_order(self, terms: Any) -> Any:
        return self.solver.error_order(terms)

    def init(self, terms: Any, t0: Any, t1: Any, y0: Vector, args: Any) -> Any:
        core, memory = self._split(y0)
        return self.solver.init(terms, t0, t1, core, (args, memory))

    def func(self, terms: Any, t0: Any, y0: Vector, args: Any) -> Vector:
        core, memory = self._split(y0)
        return self._joined(self.solver.func(terms, t0, core, (args, memory)), jnp.zeros_like(memory))

    def step(
        self, terms: Any, t0: Any, t1: Any, y0: Vector, args: Any, solver_state: Any, made_jump: Any
    ) -> tuple[Vector, Vector, dict[str, Any], Any, diffrax.RESULTS]:
        core, memory = self._split(y0)
        y1, error, info, solver_state, result = self.solver.step(
            terms, t0, t1, core, (args, memory), solver_state, made_jump
        )
        y1 = self.project(t1, y1, args)
        if "y1" in info:
            info = {**info, "y1": y1}
        remembered = self.refresh(t1, y1, memory, args)
        info = {"inner": info, "memory0": memory, "memory1": remembered}
        return self._joined(y1, remembered), self._joined(error, jnp.zeros_like(memory)), info, solver_state, result

    def _split(self, y: Vector) -> tuple[Vector, Vector]:
        return jnp.concatenate([y[: self.start], y[self.stop :]]), y[self.start : self.stop]

    def _joined(self, core: Vector, memory: Vector) -> Vector:
        return jnp.concatenate([core[: self.start], memory, core[self.start :]])


class GuidedInterpolation(diffrax.AbstractLocalInterpolation):
    """Dense output of the inner solver, with the memory interpolated linearly."""

    t0: Any  # pyright: ignore[reportIncompatibleVariableOverride]
    t1: Any  # pyright: ignore[reportIncompatibleVariableOverride]
    inner: diffrax.AbstractLocalInterpolation
    memory0: Vector
    memory1: Vector
    start: int = eqx.field(static=True)

    def evaluate(self, t0: Any, t1: Any | None = None, left: bool = True) -> Vector:
        """State at `t0`; with `t1`, the increment from `t0` to `t1`."""
        if t1 is not None:
            return self.evaluate(t1, left=left) - self.evaluate(t0, left=left)
        core = self.inner.evaluate(t0, left=left)
        width = self.t1 - self.t0
        theta = (t0 - self.t0) / jnp.where(width == 0, 1, width)
        memory = (1 - theta) * self.memory0 + theta * self.memory1
        return jnp.concatenate([core[: self.start], memory, core[self.start :]])


@ft.cache
def _interpolation(inner: Any, start: int) -> Any:
    """One function for each kind of inner interpolation, since jax compiles anew for another one."""

    def make(*, t0: Any, t1: Any, memory0: Vector, memory1: Vector, **info: Any) -> GuidedInterpolation:
        return GuidedInterpolation(t0, t1, inner(t0=t0, t1=t1, **info["inner"]), memory0, memory1, start)

    return make
