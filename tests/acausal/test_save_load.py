"""Results in one file: what is read again, and what is said where it cannot be."""

import contextlib
import io
import json
import pickle
import sys
import types
import zipfile
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _models import rc

import acausal
from acausal import ArgumentError, ModelError, about, load, parameters, save, simulate
from acausal._save_load import ABOUT, DATA


def test_the_file_comes_first(tmp_path: Path) -> None:
    with pytest.raises(ArgumentError, match="takes the path of a file first"):
        save(rc(), tmp_path / "model")  # pyright: ignore[reportArgumentType]


@pytest.mark.thorough
def test_solution(tmp_path: Path) -> None:
    file = tmp_path / "charge.acausal"
    sol = simulate(rc(R=100.0), 0.1, save="dense", energy=True, until=lambda s: s.c.v - 1e9, rtol=1e-7, throw=False)
    save(file, sol)
    again = load(file)
    assert again.result == sol.result
    assert str(again.energy) == str(sol.energy)
    np.testing.assert_array_equal(again["c.v"], sol["c.v"])
    np.testing.assert_array_equal(again.at(0.05).c.v, sol.at(0.05).c.v)
    read = about(file)
    assert (read["kind"], read["model"]) == ("Solution", "RC")
    assert read["parameters"]["r.R"] == {"value": 100.0, "unit": "ohm"}
    assert read["options"]["rtol"] == again.options["rtol"] == 1e-7
    assert (read["options"]["save"], read["options"]["solver"]) == ("dense", "acausal.Rodas5P")
    assert read["t1"] == "inf"  # JSON has no infinity
    assert read["versions"].keys() >= {"python", "acausal", "jax", "equinox", "diffrax"}


@pytest.mark.thorough
def test_options_of_runs_in_a_batch() -> None:
    runs = jax.vmap(lambda t: simulate(rc(), t, save="end", max_steps=99))(jnp.array([0.1, 0.2]))
    np.testing.assert_array_equal(runs.options["t1"], [0.1, 0.2])
    assert runs.options["max_steps"] == 99
    assert runs.options["direction"] is None


def test_model_and_other_results(tmp_path: Path) -> None:
    file = tmp_path / "model.acausal"
    save(file, rc(R=50.0))
    assert load(file).r.R == 50.0
    assert about(file)["parameters"]["r.R"]["value"] == 50.0
    save(file, {"rows": [1.0, 2.0]})
    assert load(file) == {"rows": [1.0, 2.0]}


def rewritten(file: Path, **versions: str) -> None:
    """Let the file say that it was written with other versions."""
    with zipfile.ZipFile(file) as archive:
        held = {name: archive.read(name) for name in archive.namelist()}
    read = json.loads(held[ABOUT])
    read["versions"] |= versions
    with zipfile.ZipFile(file, "w") as archive:
        for name, content in held.items():
            archive.writestr(name, json.dumps(read) if name == ABOUT else content)


def test_other_versions_are_said(tmp_path: Path) -> None:
    file = tmp_path / "model.acausal"
    save(file, rc(R=50.0))
    rewritten(file, jax="0.1.0")
    with pytest.warns(acausal.VersionWarning, match=r"was written with jax 0\.1\.0, not "):
        assert load(file).r.R == 50.0


class Gone:
    """A class that is not there any more when it is loaded."""


def test_missing_classes_are_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "gone.acausal"
    save(file, Gone())
    monkeypatch.delattr(f"{__name__}.Gone")
    with pytest.raises(ModelError, match=r"cannot be loaded: .*Gone.* Its classes must be where they were"):
        load(file)


BALL = """
from acausal import Component, Param, Scalar, Var, eq


class Ball(Component):
    c: Param[Scalar, "1/s"] = 0.5
    g: Param[Scalar, "m/s2"] = 9.81
    h: Var[Scalar, "m"] = 1.0
    v: Var[Scalar, "m/s"] = 0.0

    def equations(self, d):
        return dict(speed=eq(d.h, self.v), fall=eq(d.v, -self.g - self.c * self.v))
"""
C, G = 'c: Param[Scalar, "1/s"] = 0.5', 'g: Param[Scalar, "m/s2"] = 9.81'
H, V = 'h: Var[Scalar, "m"] = 1.0', 'v: Var[Scalar, "m/s"] = 0.0'

# What becomes of the class, and what is said of a run and of a model of it; None where it can be read.
CHANGED: dict[str, tuple[dict[str, str], str | None, str | None]] = {
    "nothing": ({}, None, None),
    "a parameter renamed": ({"c: P": "b: P", "self.c": "self.b"}, "holds c and lacks b", "holds c and lacks b"),
    "one more parameter": ({"g: P": 'a: Param[Scalar, "1"] = 2.0\n    g: P'}, "lacks a", "lacks a"),
    "one less": ({C: "", "self.c *": "0.5 *"}, "holds c", "holds c"),
    "parameters in another order": ({f"{C}\n    {G}": f"{G}\n    {C}"}, "order them otherwise", None),
    "variables in another order": ({f"{H}\n    {V}": f"{V}\n    {H}"}, "order them otherwise", None),
    "another unit": ({'"1/s"] = 0.5': '""] = 0.5'}, "other units: c", "other units, c in 1/s, not"),
}


def ball(monkeypatch: pytest.MonkeyPatch, changes: dict[str, str]) -> Any:
    """A module with the class, as it is edited between two processes."""
    source = BALL
    for old, new in changes.items():
        source = source.replace(old, new)
    module = types.ModuleType("ball_of_files")
    exec(source, vars(module))
    monkeypatch.setitem(sys.modules, module.__name__, module)
    return module.Ball


@pytest.fixture(scope="module")
def fallen(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("balls")
    with pytest.MonkeyPatch.context() as monkeypatch:
        model = ball(monkeypatch, {})(g=5.0)
        save(folder / "run", simulate(model, 0.1, save="end"))
        save(folder / "model", model)
    return {"run": folder / "run", "model": folder / "model"}


@pytest.mark.parametrize("change", CHANGED)
def test_classes_that_declare_something_else(
    change: str, fallen: dict[str, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    changes, *expected = CHANGED[change]
    ball(monkeypatch, changes)
    for file, said in zip((fallen["run"], fallen["model"]), expected, strict=True):
        if said is None:
            found = load(file)
            assert parameters(getattr(found, "final", found)) == {"c": 0.5, "g": 5.0}
        else:
            with pytest.raises(ModelError, match=rf"{file.name} cannot be loaded: .*{said}"):
                load(file)


def test_other_equations_are_said(fallen: dict[str, Path], monkeypatch: pytest.MonkeyPatch) -> None:
    ball(monkeypatch, {"-self.g - ": "-2.0 * self.g - "})
    with pytest.warns(acausal.VersionWarning, match="with other equations in the classes of Ball"):
        load(fallen["run"])


@pytest.mark.thorough
def test_damaged_files(fallen: dict[str, Path], tmp_path: Path) -> None:
    """Cut off or spoilt anywhere, without one of its entries, or with half of one."""
    whole, file = fallen["model"].read_bytes(), tmp_path / "spoilt"
    with zipfile.ZipFile(fallen["model"]) as archive:
        held = {name: archive.read(name) for name in archive.namelist()}
    spoilt = [whole[:cut] for cut in range(0, len(whole), 3)]
    spoilt += [whole[:i] + bytes([whole[i] ^ 255]) + whole[i + 1 :] for i in range(0, len(whole), 3)]
    entries = [{ABOUT: held[ABOUT]}, {DATA: held[DATA]}, held | {ABOUT: b"{}"}, held | {ABOUT: b"[1]"}]
    for content in [*entries, held | {DATA: b""}, held | {DATA: held[DATA][:99]}]:
        stream = io.BytesIO()
        with zipfile.ZipFile(stream, "w") as archive:
            for name, text in content.items():
                archive.writestr(name, text)
        spoilt.append(stream.getvalue())
    for content in spoilt:
        file.write_bytes(content)
        with contextlib.suppress(ModelError):
            assert parameters(load(file))["g"] == 5.0  # where what is spoilt is not looked at
    with pytest.raises(ModelError, match="no file"):
        load(tmp_path)


def test_other_files_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ModelError, match=r"There is no file .*nothing"):
        load(tmp_path / "nothing")
    for name, content in (("text", b"hello"), ("pickle", pickle.dumps(1))):
        (tmp_path / name).write_bytes(content)
        with pytest.raises(ModelError, match=rf"{name} was not written by save"):
            about(tmp_path / name)


def _of_a_function() -> Any:
    class Local:
        pass

    return Local()


def test_what_cannot_be_stored_is_said(tmp_path: Path) -> None:
    with pytest.raises(ModelError, match="Local cannot be stored"):
        save(tmp_path / "a", _of_a_function())
    with pytest.raises(ModelError, match="Tracer cannot be stored"):
        jax.jit(lambda x: save(tmp_path / "a", x))(1.0)
    assert not (tmp_path / "a").exists()
