"""Settings of jax made by importing the library; the user's own settings take precedence."""

import os
import subprocess
import sys
from pathlib import Path

import jax
import pytest

from acausal import _jax_settings
from acausal._jax_settings import choose_compiler_options, forget_oldest

HERE = Path(__file__).parent

# The gradient of a time with events on the way: what compiles longest. The last line counts.
PROGRAM = """
import jax
from jax import monitoring

counts, traced = {}, []
monitoring.register_event_listener(lambda name, **_: counts.update({name: counts.get(name, 0) + 1}))

from _models import rc
from test_events import Ball

from acausal import simulate
from acausal._integrate import run

whole = run.advance_run
run.advance_run = lambda *args: (traced.append(1), whole(*args))[1]

print(jax.jit(jax.grad(lambda e: simulate(Ball(h=1.0, e=e), 2.0, save="end").final.h))(0.7))
print(simulate(rc(), 1.0, until=lambda s: s.c.v - 2.0, save="end").t1)
print(*(simulate(Ball(h=1.0, e=0.7), 2.0).events.times.tolist()))
print(counts.get("/jax/compilation_cache/cache_misses", 0), len(traced))
"""


@pytest.mark.thorough
def test_a_second_process_compiles_nothing(tmp_path: Path) -> None:
    first, second = (_run({"ACAUSAL_CACHE": str(tmp_path / "programs")}) for _ in range(2))
    assert first[:-1] == second[:-1]
    compiled, traced = map(int, first[-1].split())
    assert compiled > 0
    # A run that is called with known numbers is not traced, either; its gradient is.
    assert list(map(int, second[-1].split())) == [0, traced - 2]


@pytest.mark.thorough
def test_a_short_run_compiles_hardly_anything() -> None:
    program = """
from jax import monitoring

compiled = []
monitoring.register_event_duration_secs_listener(
    lambda name, *_, **__: compiled.append(name) if name.endswith("backend_compile_duration") else None
)

from _models import rc
from acausal import simulate

sol = simulate(rc(), 1.0)
sol.final.c.v, sol.c.v
print(len(compiled))
"""
    # An operation of jax on known numbers costs a program of its own, which takes longer than the run.
    assert int(_run({"ACAUSAL_CACHE": "off"}, program)[-1]) <= 5


@pytest.mark.thorough
def test_programs_without_optimisation_are_kept_apart_from_those_with_it(tmp_path: Path) -> None:
    program = """
import jax
from jax import monitoring

missed = []
monitoring.register_event_listener(lambda name, **_: missed.append(name) if name.endswith("cache_misses") else None)

from _models import rc
from acausal import simulate

simulate(rc(), 1.0, save="end")
print(jax.config.values["jax_disable_most_optimizations"], len(missed) > 0)
"""
    kept = {"ACAUSAL_CACHE": str(tmp_path / "programs")}
    found = [_run(kept | {"ACAUSAL_OPTIMISE": chosen}, program) for chosen in ("off", "", "off", "", "on", "on")]
    compiled = [["True True"], ["False True"], ["True False"], ["False False"], ["False True"], ["False False"]]
    assert found == compiled


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("setting", "folder"),
    [
        ({"ACAUSAL_CACHE": "off"}, "None"),
        ({"JAX_COMPILATION_CACHE_DIR": "chosen", "ACAUSAL_CACHE": "other"}, "chosen"),
        ({"ACAUSAL_CACHE": "/dev/null/none"}, "None"),
        ({"ACAUSAL_CACHE": "/sys/kernel"}, "None"),  # exists, and nobody can write to it
        ({"XDG_CACHE_HOME": "caches"}, os.path.join("caches", "acausal")),
    ],
)
def test_where_programs_are_kept(tmp_path: Path, setting: dict[str, str], folder: str) -> None:
    program = "import os, acausal, jax; f = jax.config.jax_compilation_cache_dir; print(f and os.path.relpath(f))"
    assert _run(setting, program, tmp_path) == [folder]


@pytest.mark.thorough
def test_a_folder_that_others_or_nobody_can_write_to_is_not_used(tmp_path: Path) -> None:
    """The programs in the folder are executed. A chosen folder that is not used is a warning. A new folder is the
    user's own, and so is the usual one afterwards.
    """
    program = "import warnings; warnings.simplefilter('error'); import acausal"
    tmp_path.chmod(0o770)
    with pytest.raises(AssertionError, match="chmod go-w"):
        _run({"ACAUSAL_CACHE": str(tmp_path)}, program)
    with pytest.raises(AssertionError, match="cannot be written"):
        _run({"ACAUSAL_CACHE": "/dev/null/none"}, program)
    usual = tmp_path / "acausal"
    usual.mkdir()
    usual.chmod(0o775)
    _run({"XDG_CACHE_HOME": str(tmp_path)}, program)
    assert usual.stat().st_mode & 0o777 == 0o700


def _run(setting: dict[str, str], program: str = PROGRAM, where: Path = HERE) -> list[str]:
    """The lines that a program prints in a process of its own, which has no setting but these."""
    inherited = {k: v for k, v in os.environ.items() if "CACHE" not in k}
    python_path = os.pathsep.join([str(HERE), str(HERE.parents[1])])
    done = subprocess.run(
        [sys.executable, "-c", program],
        env={**inherited, **setting, "PYTHONPATH": python_path}, cwd=where, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


def test_what_was_not_read_for_longest_is_forgotten_first(tmp_path: Path) -> None:
    for age, name in enumerate(("a-cache", "b-program", "c-cache", "d-cache", "notes of the user")):
        (tmp_path / name).write_bytes(bytes(100))
        os.utime(tmp_path / name, (1e9 - age, 1e9 - age))
    forget_oldest(tmp_path, 250)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a-cache", "b-program", "notes of the user"]
    forget_oldest(tmp_path / "not there", 0)


# XLA computes the sums while it compiles, and complains after a second.
SLOW = """
import acausal
import jax, numpy as np

sums = jax.jit(lambda: jax.lax.reduce_window(np.ones((60, 300)), 0.0, jax.lax.add, (1, 200), (1, 1), "SAME"))()
jax.block_until_ready(sums)
"""


@pytest.mark.thorough
@pytest.mark.parametrize("level", ["1", "0"])
def test_xla_does_not_complain_of_slow_compilation_unless_asked_to(level: str) -> None:
    environment = os.environ | {"ACAUSAL_CACHE": "off", "TF_CPP_MIN_LOG_LEVEL": level}
    environment.pop("JAX_COMPILATION_CACHE_DIR", None)

    def complains(program: str) -> bool:
        done = subprocess.run([sys.executable, "-c", program], env=environment, capture_output=True, check=True)
        return b"slow_operation_alarm" in done.stderr

    # Not all versions of jax complain.
    assert complains(SLOW) is (level == "0" and complains(SLOW.replace("import acausal\n", "")))


@pytest.mark.parametrize(("flags", "is_set"), [("", True), ("--xla_backend_extra_options=a=1", False)])
def test_flags_of_the_user_win(monkeypatch: pytest.MonkeyPatch, flags: str, is_set: bool) -> None:
    monkeypatch.setenv("XLA_FLAGS", flags)
    monkeypatch.setattr(_jax_settings, "backends_are_initialized", lambda: False)
    choose_compiler_options()
    assert ("xla_cpu_small_while_loop_byte_threshold" in os.environ["XLA_FLAGS"]) is is_set


def test_flags_that_would_come_too_late_are_left_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    jax.devices()
    monkeypatch.setenv("XLA_FLAGS", "")
    choose_compiler_options()
    assert not os.environ["XLA_FLAGS"]
