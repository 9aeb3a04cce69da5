"""Results in one file: what is read again, and what is said where it cannot be."""

import json
import pickle
import zipfile
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _models import rc

import acausal
from acausal import ModelError, about, load, save, simulate
from acausal._save_load import ABOUT


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
