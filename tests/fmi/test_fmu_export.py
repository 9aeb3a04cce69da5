"""Models as FMUs: what FMPy finds in them and computes with them."""

import ctypes
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from _fmu_models import Bouncer, Clocked, Forced, Inverters, Measured, Turned

from acausal import ModelError
from acausal.fmi import export_fmu
from acausal.fmi._export import fmu
from components.blocks import Gain
from components.rotational import Inertia

fmpy = pytest.importorskip("fmpy")
validation = pytest.importorskip("fmpy.validation")

VERSIONS = ("2.0", "3.0")
FIRST_IMPACT = math.sqrt(2.0 / 9.81)


@pytest.fixture(scope="module", params=VERSIONS)
def bouncer(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("fmu") / "bouncer.fmu"
    return export_fmu(Bouncer(e=0.8), file, outputs=["h", "impacts"], version=request.param)


@pytest.fixture(scope="module")
def forced(tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("fmu") / "forced.fmu"
    return export_fmu(Forced(), file, inputs=["u"], outputs=["power.value"])


def height(t: np.ndarray) -> np.ndarray:
    """The height of the ball until its third impact."""
    speed, start, found = 0.8 * 9.81 * FIRST_IMPACT, FIRST_IMPACT, 1.0 - 9.81 * t**2 / 2.0
    for _ in range(2):
        since = t - start
        found = np.where(since > 0.0, speed * since - 9.81 * since**2 / 2.0, found)
        start, speed = start + 2.0 * speed / 9.81, 0.8 * speed
    return found


def instance_of(file: Path, kind: str = "ModelExchange") -> tuple[Any, dict[str, Any]]:
    description = fmpy.read_model_description(str(file))
    folder = fmpy.extract(str(file))
    return fmpy.instantiate_fmu(folder, description, kind), {v.name: v for v in description.modelVariables}


def doubles(*values: float) -> Any:
    return (ctypes.c_double * len(values))(*values)


def at_start(file: Path) -> tuple[Any, dict[str, int]]:
    """An instance of FMI 3.0 in continuous time at the start."""
    fmu, variables = instance_of(file)
    fmu.enterInitializationMode()
    fmu.exitInitializationMode()
    fmu.updateDiscreteStates()
    fmu.enterContinuousTimeMode()
    return fmu, {name: variable.valueReference for name, variable in variables.items()}


def test_an_fmu_is_valid(bouncer: Path) -> None:
    assert validation.validate_fmu(str(bouncer)) == []
    assert bouncer.stat().st_size < 1_000_000


def test_variables_have_units_and_descriptions(tmp_path: Path) -> None:
    """Those of the declarations; an input and an output have the unit that the equations at their signal determine."""
    file = export_fmu(
        Measured(inertia=Inertia(J=2.0)), tmp_path / "measured.fmu", inputs=["torque.u"], outputs=["speed.y.value"]
    )
    found = {v.name: (v.unit, v.description) for v in fmpy.read_model_description(str(file)).modelVariables}
    assert found["torque.u"][0] == "N.m"
    assert found["speed.y.value"][0] == "rad/s"
    assert found["inertia.J"] == ("kg.m2", "moment of inertia")
    assert found["scale"] == ("1", "of the torque")
    assert found["marks[1]"] == ("m", "a mark and another")


def test_an_fmu_with_inputs_is_valid(forced: Path) -> None:
    assert validation.validate_fmu(str(forced)) == []


@pytest.mark.parametrize(("kind", "tolerance"), [("ModelExchange", 1e-6), ("CoSimulation", 1e-9)])
def test_fmpy_simulates_events(bouncer: Path, kind: str, tolerance: float) -> None:
    found = fmpy.simulate_fmu(
        str(bouncer), stop_time=1.5, output_interval=0.0611, relative_tolerance=1e-10, fmi_type=kind
    )
    np.testing.assert_allclose(found["h"], height(found["time"]), atol=tolerance)
    assert found["impacts"][-1] == 2.0


def test_parameters_and_states_can_be_set(bouncer: Path) -> None:
    values = {"e": 0.5, "h": 4.0, "g": 2.0}
    found = fmpy.simulate_fmu(
        str(bouncer), start_values=values, stop_time=3.0, relative_tolerance=1e-10, fmi_type="CoSimulation",
        output_interval=3.0,
    )  # fmt: skip
    np.testing.assert_allclose(found["h"][-1], 2.0 * 1.0 - 1.0, rtol=1e-9)  # 1 s after the impact at 2 s, from 2 m/s


@pytest.mark.parametrize("name", ["State", "2 inverters"])
def test_inputs_of_a_model_without_states_stay(name: str, tmp_path: Path) -> None:
    """The names are also those of C code that all FMUs share, and no name in C."""
    model = Inverters(first=Gain(k=-1.0), second=Gain(k=-3.0))
    file = export_fmu(model, tmp_path / f"{name}.fmu", inputs=["first.u"], outputs=["second.y.value"])
    found = fmpy.simulate_fmu(
        str(file), start_values={"first.u": 2.0}, stop_time=1.0, output_interval=0.5, fmi_type="CoSimulation"
    )
    np.testing.assert_array_equal(found["second.y.value"], [6.0, 6.0, 6.0])


def test_variables_have_names_units_and_roles(forced: Path) -> None:
    _, variables = instance_of(forced)
    assert (variables["mu"].causality, variables["mu"].start, variables["mu"].min) == ("parameter", "1.0", "0.0")
    assert (variables["u"].causality, variables["power.value"].causality) == ("input", "output")
    assert variables["der(x)"].derivative is variables["x"]
    assert (variables["v"].unit, variables["der(v)"].unit) == ("1/s", "1/s2")


def test_all_variables_of_the_model_are_outputs_by_default(tmp_path: Path) -> None:
    file = export_fmu(Forced(), tmp_path / "forced.fmu", inputs=["u"], platforms=[])
    variables = fmpy.read_model_description(str(file)).modelVariables
    assert [v.name for v in variables if v.causality == "output"] == ["x", "v"]


def test_rates_and_outputs_depend_on_what_they_read(forced: Path) -> None:
    description = fmpy.read_model_description(str(forced))
    found = {
        unknown.variable.name: {known.name for known in unknown.dependencies}
        for unknown in (*description.derivatives, *description.outputs)
    }
    assert found == {"der(x)": {"v"}, "der(v)": {"x", "v", "u"}, "power.value": {"v", "u"}}


def test_directional_derivatives_are_exact(forced: Path) -> None:
    """With f = mu (1 - x²) v - x + u and y = u v at x = 1.5, v = 0.3, u = 0.7."""
    fmu, places = at_start(forced)
    fmu.setContinuousStates(doubles(1.5, 0.3), 2)
    fmu.setFloat64([places["u"]], [0.7])
    knowns = [places["x"], places["v"], places["u"]]
    unknowns = [places["der(x)"], places["der(v)"], places["power.value"]]
    exact = np.array([[0.0, 1.0, 0.0], [-2.0 * 1.5 * 0.3 - 1.0, 1.0 - 1.5**2, 1.0], [0.0, 0.7, 0.3]])
    columns = [fmu.getDirectionalDerivative(unknowns, knowns, seed) for seed in np.eye(3).tolist()]
    np.testing.assert_allclose(np.transpose(columns), exact, rtol=1e-14)
    rows = [fmu.getAdjointDerivative(unknowns, knowns, seed) for seed in np.eye(3).tolist()]
    np.testing.assert_allclose(rows, exact, rtol=1e-14)


def test_event_indicators_have_derivatives(tmp_path: Path) -> None:
    fmu, places = at_start(export_fmu(Bouncer(e=0.8), tmp_path / "bouncer.fmu", outputs=["h"]))
    indicator = [places["event_indicator[0]"]]
    found = fmu.getDirectionalDerivative(indicator, [places["h"], places["v"]], [1.0, 5.0])
    assert abs(found[0]) == 1.0


def test_a_state_can_be_copied_and_serialised(forced: Path) -> None:
    fmu, places = at_start(forced)
    copy = fmu.getFMUState()
    fmu.setContinuousStates(doubles(7.0, 0.0), 2)
    moved = fmu.deserializeFMUState(fmu.serializeFMUState(fmu.getFMUState()))
    fmu.setFMUState(copy)
    assert fmu.getFloat64([places["x"]]) == [2.0]
    fmu.setFMUState(moved)
    assert fmu.getFloat64([places["x"]]) == [7.0]
    fmu.freeFMUState(copy)


def test_instances_are_independent(forced: Path) -> None:
    (one, places), (other, _) = at_start(forced), at_start(forced)
    one.setContinuousStates(doubles(5.0, 0.0), 2)
    one.enterEventMode()
    one.setFloat64([places["mu"]], [3.0])
    assert other.getFloat64([places["x"], places["mu"]]) == [2.0, 1.0]


def test_another_fmu_s_token_is_refused(forced: Path) -> None:
    description = fmpy.read_model_description(str(forced))
    description.instantiationToken = "{other}"
    with pytest.raises(Exception, match="instantiate"):
        fmpy.instantiate_fmu(fmpy.extract(str(forced)), description, "ModelExchange")


def test_a_violated_requirement_is_said(bouncer: Path, capfd: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(Exception, match="ExitInitializationMode"):
        fmpy.simulate_fmu(str(bouncer), start_values={"e": -1.0}, stop_time=1.0, validate=False)
    assert "e must be positive" in capfd.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"inputs": ["u.value"]}, "'u.value' is not an open signal input"),
        ({"inputs": ["u", "u"]}, "inputs names u more than once"),
        ({"inputs": "u", "outputs": "speed"}, "no variable 'speed'"),
        ({"inputs": ["u"], "version": "1.0"}, "must be '2.0' or '3.0'"),
        ({"inputs": ["u"], "platforms": ["amiga"]}, "platform 'amiga' is unknown"),
        ({"inputs": ["u"], "platforms": "amiga"}, "platform 'amiga' is unknown"),
    ],
)
def test_bad_arguments_are_refused(arguments: dict, message: str, tmp_path: Path) -> None:
    with pytest.raises(ModelError, match=message):
        export_fmu(Forced(), tmp_path / "forced.fmu", **arguments)


def test_an_input_whose_derivative_is_needed_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ModelError, match=r"source\.u cannot be an input of an FMU: the equations need its derivative"):
        export_fmu(Turned(rotor=Inertia(J=1.0)), tmp_path / "turned.fmu", inputs=["source.u"])


def test_a_missing_compiler_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.delenv("CC", raising=False)
    with pytest.raises(ModelError, match="No C compiler was found"):
        export_fmu(Bouncer(e=0.8), tmp_path / "bouncer.fmu")


def test_sources_alone_need_no_compiler(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    file = export_fmu(Bouncer(e=0.8), tmp_path / "bouncer.fmu", platforms=[])
    assert not (Path(fmpy.extract(str(file))) / "binaries").exists()


@pytest.mark.slow
def test_libraries_for_other_platforms(tmp_path: Path) -> None:
    pytest.importorskip("ziglang")
    platforms = ["x86_64-linux", "x86_64-windows", "aarch64-darwin"]
    file = export_fmu(Bouncer(e=0.8), tmp_path / "bouncer.fmu", platforms=platforms)
    folder = Path(fmpy.extract(str(file))) / "binaries"
    starts = {path.suffix: path.read_bytes()[:4] for path in folder.rglob("bouncer.*")}
    assert starts[".so"] == b"\x7fELF"
    assert starts[".dll"][:2] == b"MZ"
    assert starts[".dylib"] == b"\xcf\xfa\xed\xfe"


@pytest.mark.parametrize("version", VERSIONS)
def test_the_code_has_no_warnings(version: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fmu, "FLAGS", [*fmu.FLAGS, "-Wall", "-Wextra", "-Werror"])
    export_fmu(Forced(), tmp_path / "forced.fmu", inputs=["u"], version=version)
    export_fmu(Clocked(), tmp_path / "clocked.fmu", version=version)
