"""Random networks against their raw equations, which are written and solved without the engine."""

from collections.abc import Callable
from random import Random
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _descriptor import Descriptor, SingularError
from _laws import INNER
from _netlist import ACROSS, GROUND, Netlist, element, model_of, resistor
from _random_networks import random_netlist
from _tableau import Tableau
from hypothesis import Phase, assume, given, settings
from hypothesis import strategies as st

from acausal import Solution, replace, simulate
from acausal._declare.node import leaves_of

pytestmark = pytest.mark.slow

TIMES = np.linspace(0.0, 2.0, 9)
RTOL = 1e-6  # of the range of each signal
COUPLED = ("electrical", "rotational", "translational")
DOMAINS = [COUPLED[:1], COUPLED[1:2], COUPLED[2:], COUPLED[:2], COUPLED[1:], COUPLED]


def starts_of(netlist: Netlist) -> list[str]:
    """Variables whose start values make up a state, some of them tied to each other."""
    names = [f"parts[{i}].{name}" for i, part in enumerate(netlist) for name in INNER.get(part.name, ())]
    for i, part in enumerate(netlist):
        across = ACROSS[part.kind.partition(".")[0]]
        if part.name in ("Inertia", "Mass"):
            names.append(f"parts[{i}].a.{across}")
        elif part.name in ("Damper", "SpringDamper"):
            names.append(f"parts[{i}].{across}_rel")
        elif part.name in ("ConstantSpeed", "SignalSpeed"):
            names.append(f"parts[{i}].flange.{across}")
    return names


def consistent_starts(netlist: Netlist, seed: int) -> dict[str, float]:
    """Random start values that satisfy all constraints."""
    tableau = Tableau(netlist)
    z = Descriptor(tableau).nearest(np.random.default_rng(seed).normal(size=tableau.n))
    return {name: float(tableau.signals[name] @ z) for name in starts_of(netlist)}


def expected(netlist: Netlist, starts: dict[str, float]) -> dict[str, Any]:
    """Trajectories from start values that make up a state, by name."""
    tableau = Tableau(netlist)
    descriptor = Descriptor(tableau)
    rows = np.array([tableau.signals[name] for name in starts]).reshape(-1, tableau.n)
    z = descriptor.solve(descriptor.start(rows, list(starts.values())), TIMES)
    return {name: z @ row for name, row in tableau.signals.items()}


def trajectories(solution: Solution) -> dict[str, Any]:
    return {leaf.path: np.asarray(leaf.value) for leaf in leaves_of(solution.values)}


def assert_agree(netlist: Netlist, starts: dict[str, float]) -> None:
    """All variables at all times, compared with their range, or for what is constant with the greatest value."""
    reference = expected(netlist, starts)
    got = trajectories(simulate(model_of(netlist, starts), TIMES[-1], save=TIMES, rtol=1e-9))
    greatest = max(np.max(np.abs(values)) for values in reference.values())
    for name, values in reference.items():
        size = np.ptp(values) if np.ptp(values) > 1e-6 * greatest else max(greatest, 1e-12)
        np.testing.assert_allclose(got[name], values, rtol=0.0, atol=RTOL * size, err_msg=name)


@settings(derandomize=True, max_examples=6, deadline=None, database=None, phases=[Phase.generate])
@given(seed=st.integers(0, 10_000), size=st.sampled_from([5, 8, 12, 20, 40]), domains=st.sampled_from(DOMAINS))
def test_random_network(seed: int, size: int, domains: tuple[str, ...]) -> None:
    netlist = random_netlist(Random(seed), size, domains)
    try:
        starts = consistent_starts(netlist, seed)
    except SingularError:
        assume(False)
    assert_agree(netlist, starts)


SPINDLE = (
    element("rotational.Inertia", "r0", "r1", J=1.0),
    element("rotational.IdealGearR2T", "r1", "t0", ratio=0.5),
    element("translational.Mass", "t0", "t1", m=1.0),
)
APART = (
    element("translational.Mass", "t0", "t1", m=1.0),
    element("translational.Spring", "t1", "t2", c=1.0),
    element("translational.Mass", "t2", "t3", m=1.0),
)


@pytest.mark.parametrize(
    ("netlist", "name"),
    [
        (SPINDLE, "parts[0].w"),
        (APART, "parts[1].s_rel"),
        (SPINDLE, "parts[2].v"),
        (APART, "parts[1].b.s"),
    ],
)
def test_given_start_value_is_kept(netlist: Netlist, name: str) -> None:
    sol = simulate(model_of(netlist, {name: 0.35}), 1.0, save=TIMES[:1])
    np.testing.assert_allclose(trajectories(sol)[name][0], 0.35, rtol=1e-9)


MACHINE = (
    GROUND,
    element("electrical.SignalVoltage", "e1", "e0", amplitude=5.0, frequency=0.4, phase=1.0),
    resistor("e1", "e2", 0.7),
    element("electrical.Inductor", "e2", "e3", L=0.3),
    element("electrical.EMF", "e3", "e0", "r0", k=0.8),
    element("rotational.Inertia", "r0", "r1", J=0.4),
    element("rotational.IdealGear", "r1", "r2", ratio=3.0),
    element("rotational.Inertia", "r2", "r3", J=1.5),
    element("rotational.SpringDamper", "r3", "r4", c=2.0, d=0.4),
    element("rotational.IdealGearR2T", "r4", "t0", ratio=5.0),
    element("translational.Mass", "t0", "t1", m=2.0),
    element("translational.Spring", "t1", "t2", c=3.0),
    element("translational.Fixed", "t2"),
)
PARAMETERS = ("parts[2].R", "parts[6].ratio", "parts[10].m")


def end_of_spring(numbers: Any) -> Any:
    """The force of the spring at the end, from rest."""
    model = replace(model_of(MACHINE), dict(zip(PARAMETERS, numbers, strict=True)))
    return simulate(model, TIMES[-1], save="end", rtol=1e-10)["parts[11].f"][-1]


def expected_end_of_spring(numbers: Any) -> float:
    netlist = list(MACHINE)
    for name, number in zip(PARAMETERS, numbers, strict=True):
        i = int(name[6 : name.index("]")])
        netlist[i] = netlist[i]._replace(values={name.rpartition(".")[2]: number})
    rest = dict.fromkeys(starts_of(tuple(netlist)), 0.0)
    return expected(tuple(netlist), rest)["parts[11].f"][-1]


def slope(f: Callable[[Any], float], at: Any, step: Any) -> Any:
    """By differences of order 4, whose wide steps keep what the errors of `f` do small."""
    narrow, wide = (f(at + h) - f(at - h) for h in (step, 2.0 * step))
    return (8.0 * narrow - wide) / (12.0 * np.sum(step))


def test_gradient() -> None:
    """With respect to a resistance, a gear ratio and a mass: both modes, and differences of the raw equations."""
    at = jnp.array([0.7, 3.0, 2.0])
    forward = jax.jit(jax.jacfwd(end_of_spring))(at)
    reverse = jax.jit(jax.grad(end_of_spring))(at)
    numeric = [slope(expected_end_of_spring, at, step) for step in 1e-2 * np.diag(at)]
    np.testing.assert_allclose(reverse, forward, rtol=1e-9)
    np.testing.assert_allclose(forward, numeric, rtol=1e-5)
