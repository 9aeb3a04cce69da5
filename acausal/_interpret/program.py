"""Programs that are interpreted at first, and compiled in parts when that pays.

An equation that runs once costs NumPy a microsecond and XLA half a millisecond, so what a run does once, such as its
start, is not worth compiling. A loop goes on as a compiled program, from where it is, after some time.
"""

import contextlib
import threading
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import jax
import numpy as np

from .._jax_private import ClosedJaxpr, Jaxpr, JaxprEqn, jaxpr_as_fun
from .._reduce.jaxpr import inner_jaxprs
from .interpreter import JaxprInterpreter, as_numpy
from .rules import Value

# Evaluations of each equation of a part, on average, before the part is compiled. They take a fourth of the time that
# its compilation takes.
PAYS = 100
# Steps of a compiled part after which it is compiled again, with optimisations. The slower steps have then cost as much
# time as that. Both times are proportional to the size of the model. Programs that end earlier are never optimised. All
# others take at most twice the least possible time (the ski rental problem: Karlin, Manasse, Rudolph and Sleator,
# Algorithmica 3, 1988).
REPAYS = 50_000
# Level 1 of LLVM takes two thirds of the time of the usual level 3 for loops of 12,000 and 18,000 equations, which are
# then as fast. Level 0 takes half the time of level 1, and a step is four times slower. A third of that time is the
# search for equations that are constant in a loop, and the fast preset saves a quarter of the rest.
QUICK, OPTIMISED = "quick", "optimised"
# The older emitters compile in a third of the time. The flags that choose them for all programs (`_jax_settings`) come
# too late if jax has compiled something before the import of the library.
_EMITTERS = {"xla_cpu_use_fusion_emitters": False}
OPTIONS: dict[str, dict[str, Any]] = {
    QUICK: {
        **_EMITTERS,
        "xla_backend_optimization_level": 0,
        "xla_disable_hlo_passes": "while-loop-invariant-code-motion",
        "xla_cpu_opt_preset": "CPU_OPT_PRESET_FAST_COMPILE",
    },
    OPTIMISED: {**_EMITTERS, "xla_backend_optimization_level": 1},
}


class Compiler:
    """Compiles the parts of a program."""

    def __init__(self, name: str) -> None:
        self.name = name

    def stored(self, part: str, level: str, n_inputs: int) -> Callable[..., list[Any]] | None:
        """The program of a part, if it has been kept."""
        return None

    def compiled(self, part: str, level: str, run: Callable[..., Any], shapes: Sequence[Any]) -> Callable[..., Any]:
        """Compile a part, a function of numbers with these shapes."""
        return lowered(self.name, run, shapes).compile(OPTIONS[level])


def lowered(name: str, run: Callable[..., Any], shapes: Sequence[Any]) -> Any:
    """A function for XLA, with a name, by which jax knows it too."""

    def named(*values: Any) -> Any:
        return run(*values)

    named.__name__ = name
    return jax.jit(named).lower(*shapes)


class NumbersProgram:
    """A function of known numbers, given as a simplified jaxpr. A call takes `steps` steps, as far as known.

    `at_once`: it is compiled as a whole, with optimisations, at the first call.
    """

    def __init__(self, closed: ClosedJaxpr, compiler: Compiler, steps: int, *, at_once: bool = False) -> None:
        self._closed, self._interpreter = closed, JaxprInterpreter()
        self._whole = CompilablePart(
            "whole", jaxpr_as_fun(closed), closed.in_avals, size_of(closed.jaxpr), compiler, steps
        )
        self._loops = {id(eqn): _loop(i, eqn, compiler, steps) for i, eqn in enumerate(_loops(closed.jaxpr))}
        self._interpreter.loops.update(self._loops)
        if at_once:
            self._whole.optimise()

    def __call__(self, leaves: Sequence[Any]) -> list[Value]:
        """The results for the given numbers."""
        call = self._whole.compiled()
        if call is not None:
            return list(map(as_numpy, call(*leaves)))
        before = self._spent()
        with np.errstate(all="ignore"):
            found = self._interpreter.closed(self._closed)(*map(as_numpy, leaves))
        self._whole.spend(self._spent() - before)
        return found

    def _spent(self) -> int:
        """The equations interpreted outside of loops so far."""
        return self._interpreter.spent - sum(loop.spent for loop in self._loops.values())


class CompilablePart:
    """A function that is compiled when its interpretation has cost enough, and again when its steps have."""

    def __init__(
        self, name: str, run: Callable[..., Any], avals: Sequence[Any], size: int, compiler: Compiler, steps: int
    ) -> None:
        self._name, self._run, self._compiler, self._steps = name, run, compiler, steps
        self._shapes = [jax.ShapeDtypeStruct(aval.shape, aval.dtype) for aval in avals]
        self.spent, self._pays = 0, PAYS * max(size, 1)  # equations interpreted, and when to compile
        self._until_optimised = REPAYS
        self._call: Callable[..., list[Value]] | None = None
        self._is_known, self._is_optimised, self._lock = False, False, threading.Lock()

    def spend(self, n: int) -> None:
        """Adds to the number of equations that were interpreted."""
        self.spent += n

    def optimise(self) -> None:
        """Compile with optimisations."""
        self._call = self._made(OPTIMISED)
        self._is_optimised = self._is_known = True

    def compiled(self) -> Callable[..., list[Value]] | None:
        """The compiled function for the next call; None if it is to be interpreted."""
        if not self._is_known:
            self._look()
        if self._call is None and self.spent < self._pays:
            return None
        if not self._is_optimised:
            with self._lock:
                if self._call is None:
                    self._call = self._made(QUICK)
                elif not self._is_optimised and self._until_optimised <= self._steps:
                    with contextlib.suppress(Exception):  # optimisation is optional: the quick program runs anyway
                        self._call = self._made(OPTIMISED)
                    self._is_optimised = True  # after an interrupt, the next call optimises again
                self._until_optimised -= self._steps
        return self._call

    def _look(self) -> None:
        """Looks for a stored program."""
        for level in (OPTIMISED, QUICK):
            found = self._compiler.stored(self._name, level, len(self._shapes))
            if found is not None:
                self._call, self._is_optimised = found, level == OPTIMISED
                break
        self._is_known = True

    def _made(self, level: str) -> Callable[..., list[Value]]:
        stored = self._compiler.stored(self._name, level, len(self._shapes))
        return stored or self._compiler.compiled(self._name, level, self._run, self._shapes)


def _loop(i: int, eqn: JaxprEqn, compiler: Compiler, steps: int) -> CompilablePart:
    size = sum(size_of(eqn.params[part].jaxpr) for part in ("cond_jaxpr", "body_jaxpr"))

    def run(*values: Any) -> list[Any]:
        return eqn.primitive.bind(*values, **eqn.params)

    return CompilablePart(f"loop{i}", run, [atom.aval for atom in eqn.invars], size, compiler, steps)


def size_of(jaxpr: Jaxpr) -> int:
    """The number of equations, with those of inner jaxprs."""
    return sum(1 + sum(size_of(inner.jaxpr) for inner in inner_jaxprs(eqn)) for eqn in jaxpr.eqns)


def _loops(jaxpr: Jaxpr) -> Iterator[JaxprEqn]:
    """The outermost `while` equations."""
    for eqn in jaxpr.eqns:
        if eqn.primitive.name == "while":
            yield eqn
        else:
            for inner in inner_jaxprs(eqn):
                yield from _loops(inner.jaxpr)
