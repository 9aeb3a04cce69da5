"""Calls of an FMU in all states of FMI's state machine, and with wrong arguments.

Source: the tables of functions by state in FMI 2.0.4 (3.2.3 and 4.2.4) and in FMI 3.0.2 (2.3, 3.2 and 4.2).
"""

import ctypes
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from _fmu_models import Bouncer, Forced

from acausal.fmi import export_fmu

fmpy = pytest.importorskip("fmpy")
EXCHANGE, CO_SIMULATION = "ModelExchange", "CoSimulation"
KINDS = (EXCHANGE, CO_SIMULATION)
BEFORE = {"instantiated": (), "initialising": ("enter_initialisation",)}
RUNNING = {
    EXCHANGE: {"event": ("exit_initialisation",), "continuous": ("update", "enter_continuous")},
    CO_SIMULATION: {"steps": ("exit_initialisation",)},
}
COMPUTED = {"initialising", "event", "continuous", "steps", "terminated"}
LEGAL: dict[str, set[str]] = {
    "setup": {"instantiated"},  # of FMI 2.0
    "enter_initialisation": {"instantiated"},
    "exit_initialisation": {"initialising"},
    "terminate": {"event", "continuous", "steps"},
    "reset": {"instantiated", *COMPUTED},
    "get": COMPUTED,  # in FMI 3.0 also after instantiation
    "set_input": {"instantiated", "initialising", "event", "continuous", "steps"},
    "set_parameter": {"instantiated", "initialising", "event", "steps"},
    "set_state": {"instantiated", "initialising"},
    "set_output": set(),
    "copy": {"instantiated", *COMPUTED},
    "directional": COMPUTED,
    "enter_event": {"event", "continuous"},
    "update": {"event"},
    "enter_continuous": {"event"},
    "end_step": {"continuous"},
    "set_time": {"event", "continuous"},
    "set_states": {"continuous"},
    "get_states": COMPUTED,
    "rates": COMPUTED,
    "step": {"steps"},
    "enter_steps": set(),  # of FMI 3.0, for an event mode in co-simulation, which these FMUs do not have
}


@pytest.fixture(scope="module", params=["2.0", "3.0"])
def forced(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("fmu") / "forced.fmu"
    return export_fmu(Forced(), file, inputs=["u"], outputs=["power.value"], version=request.param)


def states(*values: float) -> Any:
    return (ctypes.c_double * len(values))(*values)


class Called:
    """An instance with calls that have the same names in FMI 2.0 and 3.0."""

    def __init__(self, file: Path, kind: str) -> None:
        description = fmpy.read_model_description(str(file))
        self.is_3 = description.fmiVersion.startswith("3")
        self.fmu: Any = fmpy.instantiate_fmu(fmpy.extract(str(file)), description, kind)
        self.places = {v.name: v.valueReference for v in description.modelVariables}

    def _set(self, name: str, value: float = 0.5) -> None:
        getattr(self.fmu, "setFloat64" if self.is_3 else "setReal")([self.places[name]], [value])

    def get(self, name: str = "x") -> float:
        return getattr(self.fmu, "getFloat64" if self.is_3 else "getReal")([self.places[name]])[0]

    def _copy(self) -> None:
        copy = self.fmu.getFMUState()
        self.fmu.setFMUState(copy)
        self.fmu.freeFMUState(copy)

    def _directional(self) -> None:
        arguments = [self.places["der(v)"]], [self.places["v"]], [1.0]
        self.fmu.getDirectionalDerivative(*arguments)

    def step(self, time: float = 0.0, length: float = 0.1) -> Any:
        return self.fmu.doStep(time, length)

    def start(self) -> None:
        self("enter_initialisation")
        self("exit_initialisation")

    def __call__(self, name: str) -> None:
        fmu = self.fmu
        calls: dict[str, Callable[[], object]] = {
            "setup": lambda: fmu.setupExperiment(startTime=0.0),
            "enter_initialisation": fmu.enterInitializationMode,
            "exit_initialisation": fmu.exitInitializationMode,
            "terminate": fmu.terminate,
            "reset": fmu.reset,
            "get": self.get,
            "set_input": lambda: self._set("u"),
            "set_parameter": lambda: self._set("mu"),
            "set_state": lambda: self._set("x"),
            "set_output": lambda: self._set("power.value"),
            "copy": self._copy,
            "directional": self._directional,
            "enter_event": lambda: fmu.enterEventMode(),
            "update": lambda: fmu.updateDiscreteStates() if self.is_3 else fmu.newDiscreteStates(),
            "enter_continuous": lambda: fmu.enterContinuousTimeMode(),
            "end_step": lambda: fmu.completedIntegratorStep(),
            "set_time": lambda: fmu.setTime(0.2),
            "set_states": lambda: fmu.setContinuousStates(states(1.0, 2.0), 2),
            "get_states": lambda: fmu.getContinuousStates(states(0.0, 0.0), 2),
            "rates": lambda: (fmu.getContinuousStateDerivatives if self.is_3 else fmu.getDerivatives)(
                states(0.0, 0.0), 2
            ),
            "step": self.step,
            "enter_steps": lambda: fmu.enterStepMode(),
        }
        calls[name]()

    def accepts(self, name: str) -> bool | None:
        """Whether the FMU accepts a call; None if FMPy has no such call for its kind."""
        try:
            self(name)
        except fmpy.fmi1.FMICallException:
            return False
        except AttributeError:
            return None
        return True


def in_state(file: Path, kind: str, state: str) -> Called:
    called = Called(file, kind)
    for name, way in (BEFORE | RUNNING[kind] | {"terminated": ("terminate",)}).items():
        for call in way:
            called(call)
        if name == state:
            break
    return called


@pytest.mark.parametrize("kind", KINDS)
def test_each_call_is_refused_in_the_wrong_states(forced: Path, kind: str) -> None:
    found, expected = {}, {}
    for state in (*BEFORE, *RUNNING[kind], "terminated"):
        for name, modes in LEGAL.items():
            called = in_state(forced, kind, state)
            is_accepted = called.accepts(name)
            if is_accepted is not None:
                found[state, name] = is_accepted
                expected[state, name] = state in modes or (called.is_3 and (state, name) == ("instantiated", "get"))
    assert len(found) > 45
    assert found == expected


def test_the_state_of_a_machine_is_part_of_its_copy(forced: Path) -> None:
    """A step can be repeated from a copy, also after termination."""
    called = in_state(forced, CO_SIMULATION, "steps")
    copy = called.fmu.getFMUState()
    called.step()
    reached = called.get()
    called("terminate")
    assert not called.accepts("step")
    called.fmu.setFMUState(copy)
    called.step()
    assert called.get() == reached


@pytest.mark.parametrize(
    ("time", "length"),
    [(0.0, -0.1), (0.0, 0.0), (0.0, math.nan), (0.0, math.inf), (0.5, 0.1), (-0.1, 0.1), (math.nan, 0.1)],
)
def test_a_wrong_step_is_refused_and_changes_nothing(
    forced: Path, time: float, length: float, capfd: pytest.CaptureFixture[str]
) -> None:
    called = in_state(forced, CO_SIMULATION, "steps")
    before = called.get()
    with pytest.raises(fmpy.fmi1.FMICallException):
        called.step(time, length)
    assert "step must" in capfd.readouterr().out
    assert called.get() == before
    called.step()
    assert called.get() != before


@pytest.mark.parametrize("unit", [1e-12, 1e-9, 1.0, 100.0])
def test_steps_follow_each_other_in_any_unit_of_time(forced: Path, unit: float) -> None:
    called = in_state(forced, CO_SIMULATION, "steps")
    called.step(0.0, 0.1 * unit)
    for k in (0, 2):
        with pytest.raises(fmpy.fmi1.FMICallException):
            called.step(0.1 * k * unit, 0.1 * unit)
    time = 0.1 * unit
    for k in range(1, 20):
        called.step(time if k % 2 else 0.1 * k * unit, 0.1 * unit)
        time += 0.1 * unit
    assert called.get("time") == pytest.approx(2.0 * unit, rel=1e-12)


def test_steps_end_at_the_stop_time(forced: Path) -> None:
    called = Called(forced, CO_SIMULATION)
    times: Any = dict(startTime=0.0, stopTime=0.3)
    if called.is_3:
        called.fmu.enterInitializationMode(**times)
    else:
        called.fmu.setupExperiment(**times)
        called.fmu.enterInitializationMode()
    called.fmu.exitInitializationMode()
    for k in range(3):
        called.step(0.1 * k)
    with pytest.raises(fmpy.fmi1.FMICallException):
        called.step(0.1 * 3)


@pytest.mark.parametrize("times", [dict(startTime=math.nan), dict(startTime=1.0, stopTime=0.5), dict(tolerance=-1.0)])
def test_a_wrong_experiment_is_refused(forced: Path, times: dict[str, float]) -> None:
    called = Called(forced, CO_SIMULATION)
    begin = called.fmu.enterInitializationMode if called.is_3 else called.fmu.setupExperiment
    with pytest.raises(fmpy.fmi1.FMICallException):
        begin(**times)


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_a_value_that_is_not_finite_is_refused(forced: Path, value: float) -> None:
    called = in_state(forced, CO_SIMULATION, "steps")
    with pytest.raises(fmpy.fmi1.FMICallException):
        called._set("u", value)


def test_missing_arrays_and_wrong_sizes_are_refused(forced: Path) -> None:
    called = in_state(forced, EXCHANGE, "continuous")
    for count, array in ((3, states(1.0, 2.0, 3.0)), (2, None)):
        for name in ("setContinuousStates", "getContinuousStates"):
            with pytest.raises(fmpy.fmi1.FMICallException):
                getattr(called.fmu, name)(array, count)


@pytest.mark.parametrize("kind", KINDS)
def test_a_parameter_that_the_model_refuses_stops_a_run_that_has_begun(
    forced: Path, kind: str, capfd: pytest.CaptureFixture[str]
) -> None:
    called = in_state(forced, kind, "steps" if kind == CO_SIMULATION else "event")
    goes_on = "step" if kind == CO_SIMULATION else "enter_continuous"
    before = called.get()
    called._set("mu", -1.0)
    assert not called.accepts(goes_on)
    assert "mu" in capfd.readouterr().out
    assert called.get() == before
    called._set("mu", 1.0)
    assert called.accepts(goes_on)


@pytest.mark.parametrize("version", ["2.0", "3.0"])
def test_a_run_that_has_ended_takes_no_further_step(version: Any, tmp_path: Path) -> None:
    file = export_fmu(Bouncer(e=0.8), tmp_path / "bouncer.fmu", outputs=["h"], version=version)
    called = Called(file, CO_SIMULATION)
    called("enter_initialisation")
    called._set("e", -1.0)
    assert not called.accepts("exit_initialisation")
    assert not called.accepts("step")
    assert called.accepts("reset")
    called.start()
    called.step()
