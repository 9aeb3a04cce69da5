"""FMUs as components: their runs, events and derivatives, and what is refused."""

import pickle
import re
import warnings
import zipfile
from pathlib import Path
from typing import Any

import jax
import numpy as np
import pytest
from _fmu_models import Bouncer, Driven, Forced, Latch, Reciprocal

from acausal import ArgumentError, ModelError, SimulationError, replace, simulate
from acausal.fmi import FMU, FMUWarning, export_fmu
from components.blocks import Sine

fmpy = pytest.importorskip("fmpy")


@pytest.fixture(scope="module")
def forced(tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("fmu") / "forced.fmu"
    return export_fmu(Forced(), file, inputs=["u"], outputs=["power.value"])


@pytest.fixture(scope="module")
def bouncer(tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("fmu") / "bouncer.fmu"
    return export_fmu(Bouncer(e=0.8), file, outputs=["h", "v", "impacts"])


def without(file: Path, attribute: str) -> Path:
    """The same FMU, which says that it does not have an ability."""
    other = file.with_name(f"{file.stem}_{attribute}.fmu")
    with zipfile.ZipFile(file) as source, zipfile.ZipFile(other, "w") as target:
        for name in source.namelist():
            content = source.read(name)
            if name == "modelDescription.xml":
                content = content.replace(f'{attribute}="true"'.encode(), f'{attribute}="false"'.encode())
            target.writestr(name, content)
    return other


def sine(oscillator: Any) -> Any:
    return Driven(source=Sine(amplitude=2.0, frequency=0.3), oscillator=oscillator)


@pytest.mark.thorough
def test_a_run_in_a_circuit_and_its_derivative_agree_with_the_model(forced: Path) -> None:
    def last(model: Any, amplitude: Any) -> Any:
        return simulate(replace(model, {"source.amplitude": amplitude}), 2.0, rtol=1e-10).final.oscillator.x

    one, other = sine(Forced()), sine(FMU(forced))
    (value, slope), (same, own) = (jax.jvp(lambda a, m=m: last(m, a), (2.0,), (1.0,)) for m in (one, other))
    np.testing.assert_allclose([same, own], [value, slope], rtol=1e-9)


@pytest.mark.thorough
def test_reverse_mode_agrees_with_forward_mode(forced: Path) -> None:
    model = sine(FMU(forced))

    def last(amplitude: float) -> Any:
        return simulate(replace(model, {"source.amplitude": amplitude}), 0.5).final.oscillator.v

    np.testing.assert_allclose(jax.grad(last)(2.0), jax.jvp(last, (2.0,), (1.0,))[1], rtol=1e-10)


@pytest.mark.thorough
@pytest.mark.parametrize("is_copied", [True, False])
def test_events_happen_as_in_the_model(bouncer: Path, is_copied: bool) -> None:
    file = bouncer if is_copied else without(bouncer, "canGetAndSetFMUState")
    found, own = simulate(FMU(file, h=2.0), 2.0, rtol=1e-9), simulate(Bouncer(e=0.8, h=2.0), 2.0, rtol=1e-9)
    # The relation h < 0 of the FMU changes twice at each impact.
    np.testing.assert_allclose(found.events.times[::2], own.events.times, atol=1e-9)
    np.testing.assert_allclose(found.final.h.value, own.final.h, atol=1e-8)
    assert found.final.impacts.value == own.final.impacts > 0


@pytest.fixture(scope="module")
def latch(tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("fmu") / "latch.fmu"
    return export_fmu(Latch(), file, inputs=["u"], outputs=["low_state", "low_input", "total.value"])


def counts(calls: Any, number: float, x: float, u: float) -> list[float]:
    """The two counts and their sum in a discrete state of the FMU."""
    return calls.values.host(int(number), np.array([3.0, x, u]), np.zeros(0))[1:4].tolist()


def test_the_first_event_sees_the_states_and_inputs_of_the_model(latch: Path) -> None:
    calls = FMU(latch)._calls
    high, low = (calls.event.host(0, np.array([3.0, x, u]), np.zeros(0)) for x, u in [(1.0, 5.0), (1.0, 0.0)])
    assert counts(calls, high[0], 1.0, 5.0) == [0.0, 0.0, 0.0]
    assert counts(calls, low[0], 1.0, 0.0) == [0.0, 1.0, 1.0]


def test_an_event_that_happens_again_has_its_own_values(latch: Path) -> None:
    calls = FMU(latch)._calls
    first = calls.event.host(0, np.array([3.0, 1.0, 5.0]), np.zeros(0))[0]
    for _ in range(2):
        assert counts(calls, first, -1.0, 5.0) == [0.0, 0.0, 0.0]
        after = calls.event.host(int(first), np.array([3.0, -1.0, 5.0]), np.zeros(0))[0]
        assert counts(calls, after, -1.0, 5.0) == [1.0, 0.0, 1.0]


def test_an_output_exists_where_a_rate_does_not(tmp_path: Path) -> None:
    calls = FMU(export_fmu(Reciprocal(), tmp_path / "reciprocal.fmu", inputs=["u"], outputs=["twice.value"]))._calls
    np.testing.assert_array_equal(calls.values.host(0, np.array([0.0, 1.5, 0.0]), np.zeros(0)), [np.nan, 3.0])


def test_the_first_sample_sees_the_inputs(latch: Path) -> None:
    sample = FMU(latch, step=0.1)._calls.sample.host(-1, np.array([0.0, 0.1, 5.0]), np.zeros(0))
    assert sample[2:].tolist() == [1.0, 0.0, 1.0]


def test_a_discrete_state_of_another_process_is_refused(latch: Path) -> None:
    with pytest.raises(SimulationError, match=r"latch\.fmu has not reached the discrete state .* Remedy: start from"):
        FMU(latch)._calls.values.host(7, np.array([0.0, 1.0, 5.0]), np.zeros(0))


def test_samples_of_co_simulation(bouncer: Path) -> None:
    run = simulate(FMU(bouncer, step=0.1), 0.95, rtol=1e-9)
    exact = simulate(Bouncer(e=0.8), 0.9, rtol=1e-9)
    np.testing.assert_allclose(run.final.h.value, exact.final.h, atol=1e-6)


def test_samples_are_those_of_fmpy(bouncer: Path) -> None:
    """Between two samples, the outputs are those of the first one; at a sample, those before it."""
    step, n = 0.25, 8
    taken = fmpy.simulate_fmu(
        str(bouncer), fmi_type="CoSimulation", stop_time=n * step, output_interval=step, output=["h"], validate=False
    )["h"]
    model = FMU(bouncer, step=step)
    between, at = (simulate(model, (n + 0.9) * step, save=step * times) for times in (np.arange(n) + 0.5, np.arange(n)))
    np.testing.assert_allclose(between["h.value"], taken[:n], rtol=1e-12)
    np.testing.assert_allclose(at["h.value"][1:], taken[: n - 1], rtol=1e-12)


def test_a_step_takes_the_inputs_of_the_sample_before(forced: Path) -> None:
    """The power u v at a sample is that of the present input only once the next step begins."""
    model = sine(FMU(forced, step=0.25))
    run = simulate(model, 0.6)
    held = np.asarray(run.final.oscillator.held)
    np.testing.assert_allclose(held, 2.0 * np.sin(2.0 * np.pi * 0.3 * 0.5), rtol=1e-9)


@pytest.mark.thorough
def test_parameters_have_derivatives_by_differences_only(forced: Path) -> None:
    def last(model: Any, mu: Any) -> Any:
        return simulate(replace(sine(model), {"oscillator.mu": mu}), 1.0, rtol=1e-9).final.oscillator.x

    with pytest.raises(ModelError, match=r"forced.fmu gives no derivatives with respect to its parameters. Remedy"):
        jax.jvp(lambda mu: last(FMU(forced), mu), (1.0,), (1.0,))
    slope = jax.jvp(lambda mu: last(FMU(forced, differences=True), mu), (1.0,), (1.0,))[1]
    exact = jax.jvp(lambda mu: last(Forced(), mu), (1.0,), (1.0,))[1]
    np.testing.assert_allclose(slope, exact, rtol=1e-6)


@pytest.mark.thorough
def test_an_fmu_without_derivatives_needs_differences(forced: Path) -> None:
    file = without(forced, "providesDirectionalDerivatives")
    with pytest.raises(ModelError, match="gives no derivatives with respect to its states and inputs"):
        simulate(sine(FMU(file)), 0.5)
    found = simulate(sine(FMU(file, differences=True)), 0.5).final.oscillator.x
    np.testing.assert_allclose(found, simulate(sine(Forced()), 0.5).final.oscillator.x, rtol=1e-6)


@pytest.mark.thorough
def test_a_gradient_through_a_reset_is_refused(bouncer: Path) -> None:
    model = FMU(bouncer)
    with pytest.raises(jax.errors.JaxRuntimeError, match="sets states at an event"):
        jax.jvp(lambda h: simulate(replace(model, {"h.value": h}), 0.6).final.h.value, (1.0,), (1.0,))


def test_co_simulation_has_no_derivatives(forced: Path) -> None:
    model = sine(FMU(forced, step=0.1))
    with pytest.raises(ModelError, match=r"is sampled, and co-simulation has no derivatives. Remedy"):
        jax.jvp(lambda a: simulate(replace(model, {"source.amplitude": a}), 0.3).final.oscillator.held, (1.0,), (1.0,))


@pytest.mark.thorough
def test_further_variables_can_be_shown(forced: Path) -> None:
    model = FMU(forced, outputs=("der(v)",))
    assert float(simulate(sine(model), 1e-9).final.oscillator.der_v.value) == pytest.approx(-2.0)


def test_a_component_can_be_pickled_and_replaced(bouncer: Path) -> None:
    model = pickle.loads(pickle.dumps(replace(FMU(bouncer), {"e": 0.5})))
    assert model.e == 0.5
    assert type(model) is type(FMU(bouncer))


def test_names_are_attributes_and_collide_with_nothing(bouncer: Path, tmp_path: Path) -> None:
    renamed = tmp_path / "renamed.fmu"
    with zipfile.ZipFile(bouncer) as source, zipfile.ZipFile(renamed, "w") as target:
        for name in source.namelist():
            content = source.read(name)
            if name == "modelDescription.xml":
                content = re.sub(rb'name="g"', b'name="frame[1].equations"', content)
                content = re.sub(rb'name="e"', b'name="events"', content)
            target.writestr(name, content)
    model = FMU(renamed)
    assert (model.frame_1_equations, model.events_) == (9.81, 0.8)


@pytest.mark.parametrize(
    ("content", "message"),
    [(None, "There is no file"), (b"text", "has no readable model description")],
)
def test_bad_files_are_refused(content: bytes | None, message: str, tmp_path: Path) -> None:
    file = tmp_path / "bad.fmu"
    if content is not None:
        file.write_bytes(content)
    with pytest.raises(ModelError, match=message):
        FMU(file)


def test_an_fmu_that_needs_the_end_of_steps_is_named(bouncer: Path) -> None:
    old = export_fmu(Bouncer(e=0.8), bouncer.with_name("old.fmu"), version="2.0")
    with pytest.warns(FMUWarning, match=r"old\w*.fmu may change its discrete states at the end of steps"):
        FMU(without(old, "completedIntegratorStepNotNeeded"))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        FMU(old)


def test_unknown_names_are_refused(bouncer: Path) -> None:
    with pytest.raises(ArgumentError, match="takes no argument 'mass'"):
        FMU(bouncer, mass=2.0)
    with pytest.raises(ModelError, match="has no numeric variable mass"):
        FMU(bouncer, outputs=("mass",))


def test_a_library_for_another_machine_is_refused(tmp_path: Path) -> None:
    file = export_fmu(Bouncer(e=0.8), tmp_path / "bouncer.fmu", platforms=[])
    with pytest.raises(ModelError, match=r"cannot be loaded: .*binary must be for this operating system"):
        FMU(file)
