"""How XLA on the CPU compiles the loop over the steps of a run."""

from typing import Any, Self

import jax

from acausal import (
    Array,
    Component,
    Connections,
    Discrete,
    Equations,
    Events,
    Param,
    Scalar,
    Var,
    connect,
    eq,
    repeat,
    replace,
    simulate,
    when,
)
from components.rotational import Inertia, Spring


class Chain(Component):
    """Arrays of inertias and springs; a memory of the speed and the torque of single ones."""

    k: Param[Scalar, ""] = 1.0
    rate: Param[Scalar, "1/s"] = 1.0
    late: Var[Scalar, "rad/s"] = 0.0
    fast: Discrete[Scalar, ""] = 0.0
    masses: Array[Inertia]
    springs: Array[Spring]

    def connections(self) -> Connections:
        return connect(self.masses[:-1].b, self.springs[:].a), connect(self.masses[1:].a, self.springs[:].b)

    def equations(self, d: Self) -> Equations:
        return dict(lag=eq(d.late, (self.masses[0].w - self.late) * self.rate))

    def events(self) -> Events:
        return dict(
            runs=when(self.masses[-1].w > self.k, fast=1.0), strained=when(self.springs[0].tau > self.k, fast=2.0)
        )


def test_the_steps_of_a_model_of_arrays_with_events_are_one_function() -> None:
    chain = Chain(masses=repeat(Inertia(J=1.0), 3), springs=repeat(Spring(c=1.0), 2))

    def end(k: Any) -> Any:
        return simulate(replace(chain, {"k": k}), 2.0, save="end").final.late

    program = jax.jit(end).lower(1.0).compile().as_text()
    assert program is not None
    main = program[program.index("\nENTRY ") :]
    # A loop that is called as one function is no operation of the main program.
    assert "outer-loop" in program
    assert not [line for line in main.splitlines() if " while(" in line and "outer-loop" in line]
