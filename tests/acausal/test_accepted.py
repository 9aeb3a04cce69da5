"""Wrong arguments and numbers are refused at once, by name and with a remedy."""

from collections.abc import Callable
from typing import Any, Self

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from acausal import (
    Component,
    Connections,
    Equations,
    ModelError,
    Param,
    ParameterError,
    Result,
    Scalar,
    SimulationError,
    Var,
    choose_states,
    connect,
    eq,
    initialise,
    linearise,
    positive,
    prefer,
    repeat,
    replace,
    simulate,
)
from components.electrical import Capacitor, Ground, Resistor
from components.thermal import FixedTemperature, HeatCapacitor


class Discharge(Component):
    resistor: Resistor
    capacitor: Capacitor
    ground: Ground = Ground()

    def connections(self) -> Connections:
        return (
            connect(self.resistor.p, self.capacitor.p),
            connect(self.resistor.n, self.capacitor.n, self.ground.p),
        )


MODEL = Discharge(resistor=Resistor(R=100.0), capacitor=Capacitor(C=1e-3, v=1.0))
BAD: Any = eqx.tree_at(lambda m: m.resistor.R, MODEL, jnp.asarray(-1.0))
NAN: Any = eqx.tree_at(lambda m: m.capacitor.v, MODEL, np.nan)


@pytest.mark.parametrize("time", [float("nan"), float("inf"), -np.inf])
@pytest.mark.parametrize(
    "entry",
    [lambda t: initialise(MODEL, t0=t), lambda t: linearise(MODEL, t=t), lambda t: simulate(MODEL, 1.0, t0=t)],
)
def test_times(entry: Callable[[float], Any], time: float) -> None:
    with pytest.raises(ModelError, match=r"^t0? must be a finite time in s, got t0?=-?(nan|inf)\.$"):
        entry(time)


ENTRIES: dict[str, Callable[[Any], Any]] = {
    "simulate": lambda model: simulate(model, 1.0),
    "initialise": initialise,
    "linearise": linearise,
    "choose_states": choose_states,
}


@pytest.mark.parametrize("entry", ENTRIES)
def test_numbers_of_a_model(entry: str) -> None:
    with pytest.raises(ParameterError, match=r"resistor\.R must be nonnegative.*, got -1\.0 ohm"):
        ENTRIES[entry](BAD)
    with pytest.raises(ParameterError, match=r"capacitor\.v must be a finite number, but starts from nan V"):
        ENTRIES[entry](NAN)


@pytest.mark.thorough
def test_start_values_that_are_no_numbers() -> None:
    """While a component is built, and as a result where the number is not known."""
    for start in (np.nan, np.inf, jnp.asarray(np.nan)):
        with pytest.raises(ParameterError, match=r"Capacitor\.v must be a finite number, got (nan|inf) V"):
            Capacitor(C=1e-3, v=start)

    def result(v: Any) -> Any:
        return simulate(replace(MODEL, {"capacitor.v": v}), 0.1, throw=False, save="end").result == Result.bad_parameter

    np.testing.assert_array_equal(jax.jit(jax.vmap(result))(jnp.array([1.0, np.nan])), [False, True])


@pytest.mark.parametrize("name", ["steady", "strict", "throw"])
def test_flags(name: str) -> None:
    how: Any = {name: "yes"}
    with pytest.raises(ModelError, match=rf"{name} must be True or False, known before the run, got 'yes'"):
        initialise(MODEL, **how)


def test_flags_of_a_run() -> None:
    for how in (dict(throw=1), dict(energy="no"), dict(progress="bar")):
        with pytest.raises(ModelError, match=r"(throw|energy|progress) must be True or False"):
            simulate(MODEL, 1.0, **how)  # pyright: ignore[reportArgumentType]
    with pytest.raises(ModelError, match=r"algebraic='integrated' is not known: use \"solve\" or \"integrate\""):
        choose_states(MODEL, algebraic="integrated")  # pyright: ignore[reportArgumentType]
    with pytest.raises(ModelError, match=r"system='c' is not valid: pass choose_states\(model\)"):
        linearise(MODEL, system="c")  # pyright: ignore[reportArgumentType]
    with pytest.raises(ModelError, match=r"The easier model has another structure"):
        initialise(MODEL, steady=True, easier=HeatCapacitor(C=1.0))  # pyright: ignore[reportArgumentType]


@pytest.mark.thorough
def test_a_single_name_is_one_name() -> None:
    start = initialise(MODEL, lambda s, d: dict(v=eq(s.capacitor.v, 2.0)), free="capacitor.v")
    assert float(start.capacitor.v) == pytest.approx(2.0, rel=1e-12)  # pyright: ignore[reportArgumentType]
    moving = initialise(MODEL, steady=True, moving="capacitor.v")
    assert float(moving.capacitor.v) == 1.0  # pyright: ignore[reportArgumentType]
    found = linearise(MODEL, inputs="resistor.R", outputs="resistor.i")
    assert (found.inputs, found.outputs) == (("resistor.R",), ("resistor.i",))
    for argument, entry in (
        ("free", lambda: initialise(MODEL, free=[1])),  # pyright: ignore[reportArgumentType]
        ("moving", lambda: initialise(MODEL, steady=True, moving=3)),  # pyright: ignore[reportArgumentType]
        ("solve_for", lambda: initialise(MODEL, solve_for=None)),  # pyright: ignore[reportArgumentType]
        ("inputs", lambda: linearise(MODEL, inputs=[None])),  # pyright: ignore[reportArgumentType]
    ):
        with pytest.raises(ModelError, match=rf"{argument} must be a name or a sequence of names, got "):
            entry()


def _any(value: Any) -> Any:
    return value


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (
            lambda: repeat(Resistor(R=1.0), -1),
            r"repeat\(part, n\) takes a component and the number of copies, got .*, -1\)",
        ),
        (lambda: repeat(Resistor(R=1.0), _any(2.5)), r"repeat\(part, n\) takes a component"),
        (lambda: repeat(_any(3), 2), r"repeat\(part, n\) takes a component"),
        (lambda: replace(MODEL, _any(3)), r"replace\(model, values\) takes a dictionary by path, got 3"),
        (lambda: replace(MODEL, _any({3: 1.0})), r"The model has no parameter or start value '3'"),
        (
            lambda: simulate(MODEL, 1.0, until=lambda s: _any(1j * s.capacitor.v)),
            r"until must return real numbers.* complex",
        ),
    ],
)
def test_what_is_no_part_or_number(wrong: Callable[[], Any], message: str) -> None:
    with pytest.raises(ModelError, match=message):
        wrong()


def test_inherited_fields_name_the_class_that_is_used() -> None:
    with pytest.raises(ParameterError, match=r"^Resistor\.v must be a real number"):
        Resistor(R=1.0, v="a")  # pyright: ignore[reportArgumentType]


def test_absolute_zero_is_no_temperature() -> None:
    with pytest.raises(ParameterError, match=r"HeatCapacitor\.T must be positive and finite, got 0\.0 K"):
        HeatCapacitor(C=1.0, T=0.0)
    with pytest.raises(ParameterError, match=r"FixedTemperature\.temperature must be positive"):
        FixedTemperature(temperature=0.0)


class Shown(Component):
    """A store that is empty after 1 s. No state depends on the content `left`, which must be positive."""

    T: Param[Scalar, "s"] = 1.0
    lowest: Param[Scalar, "1"] = -10.0
    x: Var[Scalar, "1", prefer] = 1.0
    left: Var[Scalar, "1", positive] = 1.0

    def equations(self, d: Self) -> Equations:
        return dict(drain=eq(self.T * d.x, -1.0, check_units=False), left=eq(self.left, self.x - self.lowest))


@pytest.mark.thorough
def test_a_run_ends_where_an_output_leaves_its_range() -> None:
    """At 1 s, and not at its end, whether it is back in its range by then or not."""
    assert float(simulate(Shown(lowest=-2.0), 2.0, save="end").final.left) == pytest.approx(1.0, rel=1e-6)
    with pytest.raises(SimulationError, match=r"At t = (1|1\.0+|0\.99\d+) s: .*left must be positive"):
        simulate(Shown(lowest=0.0), 2.0, save="end")


class Emitting(Component):
    """A body that radiates what it is given: at rest T^4 = q, so for none of less than zero."""

    q: Param[Scalar, "1"]
    C: Param[Scalar, "s"] = 1.0
    T: Var[Scalar, "1", positive, prefer] = 2.0

    def equations(self, d: Self) -> Equations:
        return dict(balance=eq(self.C * d.T, self.q - self.T**3))


@pytest.mark.thorough
def test_a_search_that_ends_at_the_edge_of_a_range_names_it() -> None:
    assert float(initialise(Emitting(q=27.0), steady=True).T) == pytest.approx(3.0, rel=1e-10)
    with pytest.raises(SimulationError, match=r"(?s)der\(T\) = 0.*leave a range: T must be positive \(unit 1\)"):
        initialise(Emitting(q=-8.0), steady=True)
