"""Results of a model with their derivatives, from one program."""

import dataclasses
import time
from collections.abc import Callable, Iterable, Mapping
from typing import Any, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.flatten_util import ravel_pytree
from jaxtyping import PyTree

from ..._declare.by_name import replace
from ..._declare.component import Component
from ..._declare.node import leaves_of
from ..._errors import ModelError
from ..._evaluate.intake import are_met, in_range
from ..._integrate.results.failure import trials
from ..._integrate.results.solution import Solution
from ..._integrate.setup.result import Result, is_success, sentence
from ..._interpret.in_parts import in_parts, jacobian_in_parts
from ..._interpret.known_derivatives import FEW
from ..._numbers import Numbers
from ..._progress import compiling
from .._problem.free import Free
from .._problem.types import Function
from .cores import interruptible

T = TypeVar("T")
CHANGED = 1e-4  # relative change of a result above the errors of runs
EXPLAINED = 0.5  # share of a change that the derivatives must explain


@dataclasses.dataclass(frozen=True)
class Evaluation:
    """Results and derivatives at values `x` of the free parameters; `why` is the reason of a failure."""

    x: np.ndarray  # in the declared units
    values: np.ndarray
    jacobian: np.ndarray  # d(values)/dx
    why: str = ""

    @property
    def is_good(self) -> bool:
        return not self.why


class Evaluator:
    """Evaluates functions of the runs of a model with their derivatives with respect to its free parameters.

    `run` is a function of the model that returns the argument of the functions: a solution or any container of
    solutions; by default the model. `scenarios` are changes of the model by path: each has its run, and the functions
    take a dictionary of runs. A function can return several numbers in any container; each has a name.
    """

    def __init__(
        self,
        model: Component,
        free: Free,
        functions: Mapping[str, Function],
        run: Function | None = None,
        scenarios: Mapping[str, Mapping[str, object]] | None = None,
    ) -> None:
        self.model, self.free, self.functions = model, free, dict(functions)
        self._run, self._is_run = _runs(run, scenarios), run is not None
        self.names: tuple[str, ...] = ()  # of the values, known after the first evaluation
        self.owners: tuple[str, ...] = ()  # name of the function of each value
        self.evaluations, self.failures, self.seconds = 0, 0, 0.0
        self.progress: bool | None = None  # messages about compilations; False: none
        self.watch: Callable[[Evaluation], None] = lambda found: None  # is called after each evaluation
        self._evaluated: dict[bytes, Evaluation] = {}
        self._by_forward_mode = jacobian_in_parts(self._results_at)
        self._by_reverse_mode = in_parts(self._with_gradients)

    def __call__(self, x: np.ndarray) -> Evaluation:
        """The evaluation at some values; cached."""
        x = np.array(x, float)
        key = x.tobytes()
        if key not in self._evaluated:
            self._evaluated[key] = self._evaluate(x)
        return self._evaluated[key]

    def _evaluate(self, x: np.ndarray) -> Evaluation:
        began = time.perf_counter()
        values, jacobian, results = interruptible(lambda: self._run_at(x))
        found = Evaluation(x, np.asarray(values), np.asarray(jacobian), _failure(self.names, values, jacobian, results))
        self.seconds += time.perf_counter() - began
        self.evaluations += 1
        self.failures += not found.is_good
        self.watch(found)
        return found

    def _run_at(self, x: np.ndarray) -> Any:
        # With few parameters a run computes its forward sensitivities in either mode.
        is_forward = len(x) <= max(FEW, len(self.functions))
        evaluate = self._by_forward_mode if is_forward else self._by_reverse_mode
        with trials(), compiling("the results and their derivatives", self.model, self._results_at, self.reports):
            (values, results), derivatives = evaluate(x)
        return values, derivatives[0].T, results

    @property
    def reports(self) -> bool:
        """Whether long compilations are reported, also in a log."""
        return self.progress is not False

    def idle(self, rows: Iterable[int]) -> np.ndarray:
        """Marks variables with zero derivatives of some results in all evaluations."""
        slopes = [found.jacobian[list(rows)] for found in list(self._evaluated.values()) if found.is_good]
        return ~np.any(np.concatenate(slopes), axis=0)

    def _results_at(self, x: Any) -> tuple[Array, list[PyTree]]:
        return self.results(self.free.with_values(self.model, x))

    def _with_gradients(self, x: Any) -> tuple[tuple[Array, list[PyTree]], list[Array]]:
        def values_with_results(x: Numbers) -> tuple[Array, tuple[Array, list[PyTree]]]:
            values, results = self._results_at(x)
            return values, (values, results)

        jacobian, found = jax.jacrev(values_with_results, has_aux=True)(x)
        return found, [jacobian.T]

    def results(self, model: Component) -> tuple[Array, list[PyTree]]:
        """All numbers that the functions return, and the outcomes of the runs."""
        runs = self._run(model)
        solutions = _instances(Solution, runs)
        named = [(name, *pair) for name, function in self.functions.items() for pair in _returned(name, function, runs)]
        self.owners = tuple(owner for owner, _, _ in named)
        self.names = tuple(name for _, name, _ in named)
        if twice := [name for name in self.names if self.names.count(name) > 1]:
            raise ModelError(f"{twice[0]} is the name of two results. Rename one of the functions.")
        # A run checks the requirements of its own model, which can differ from this one.
        is_valid, checked = (in_range, model) if self._is_run else (are_met, runs)
        ranges = [
            Result.where(is_valid(one), Result.reached_end, Result.bad_parameter)
            for one in _instances(Component, checked)
        ]
        return jnp.stack([value for _, _, value in named]), ranges + [_outcome(solution) for solution in solutions]

    def sensitivity(self, x: np.ndarray, weights: np.ndarray) -> Component:
        """Gradient of the weighted sum of the results with respect to all parameters, a tree like the model."""
        numbers, others = eqx.partition(self.model, eqx.is_inexact_array)
        flat, tree = ravel_pytree(numbers)

        def combined(flat: Array) -> Array:
            model = eqx.combine(tree(flat), others)
            return self.results(self.free.with_values(model, x))[0] @ jnp.asarray(weights)

        def gradient() -> Component:
            with trials(), compiling("the sensitivities", self.model, combined, self.reports):
                if len(flat) > FEW:
                    return tree(in_parts(jax.grad(combined))(flat))
                return tree(jacobian_in_parts(combined)(flat)[1][0])

        return interruptible(gradient)


def _runs(run: Function | None, scenarios: Mapping[str, Mapping[str, object]] | None) -> Function:
    function = run if run is not None else lambda model: model
    if not callable(function):
        raise ModelError(f"run must be a function of the model, such as lambda m: simulate(m, 1.0); got {run!r}.")
    if scenarios is None:
        return function
    if not isinstance(scenarios, Mapping) or not scenarios:
        raise ModelError(f"scenarios must be a dictionary of at least one change by name; got {scenarios!r}.")
    changes = dict(scenarios)

    def each(model: Component) -> dict[str, PyTree]:
        # All scenarios share one compiled run. Parameters that a scenario does not change keep their values.
        known = {leaf.path: leaf.value for leaf in leaves_of(model)}
        changed = [_values_at(replace(model, change), change) for change in changes.values()]
        paths = list(dict.fromkeys(path for values in changed for path in values))
        stacked = {path: jnp.stack([values.get(path, known[path]) for values in changed]) for path in paths}
        runs = jax.lax.map(lambda values: function(replace(model, values)), stacked)
        return {name: jax.tree_util.tree_map(lambda x, i=i: x[i], runs) for i, name in enumerate(changes)}

    return each


def _values_at(model: Component, paths: Iterable[str]) -> dict[str, Any]:
    """Values of a model at some paths."""
    return {leaf.path: leaf.value for leaf in leaves_of(model) if leaf.path in set(paths)}


def _outcome(solution: Solution) -> PyTree:
    """Outcome of a run, or of the first failed run of a batch."""
    result = solution.result
    if not solution.is_batched:
        return result
    return jax.tree_util.tree_map(lambda x: x[jnp.argmin(is_success(result))], result)


def _instances(kind: type[T], tree: PyTree) -> list[T]:
    """All instances of a class in a tree."""
    leaves = jax.tree_util.tree_leaves(tree, is_leaf=lambda value: isinstance(value, kind))
    return [leaf for leaf in leaves if isinstance(leaf, kind)]


def _returned(name: str, function: Function, runs: PyTree) -> list[tuple[str, Array]]:
    """Names and values of the numbers that a function returns."""
    try:
        leaves, _ = jax.tree_util.tree_flatten_with_path(function(runs))
    except (jax.errors.TracerArrayConversionError, jax.errors.ConcretizationTypeError) as error:
        raise ModelError(
            f"{name} cannot be differentiated: it needs concrete values, as float(x), numpy or `if` do. "
            "Use jax.numpy, and jnp.where for a choice."
        ) from error
    found = []
    for path, leaf in leaves:
        if not isinstance(leaf, jax.Array | np.ndarray | np.generic | float | int) or isinstance(leaf, bool):
            raise ModelError(f"{name} must return real numbers, but returned {leaf!r}.")
        leaf = jnp.asarray(leaf)
        if not jnp.issubdtype(leaf.dtype, jnp.floating) and not jnp.issubdtype(leaf.dtype, jnp.integer):
            raise ModelError(f"{name} must return real numbers, but returned some of type {leaf.dtype}.")
        base = f"{name}{jax.tree_util.keystr(path).replace(chr(39), '')}"
        for index in np.ndindex(leaf.shape):
            found.append((base + (f"[{','.join(map(str, index))}]" if index else ""), leaf[index].astype(float)))
    if not found:
        raise ModelError(f"{name} returned no number.")
    return found


def _failure(names: tuple[str, ...], values: Array, jacobian: Array, results: list[PyTree]) -> str:
    """Reason why an evaluation failed; empty for a success."""
    for result in results:
        if not bool(is_success(result)):
            return sentence(result).split(". ")[0].rstrip(".")
    for name, value, row in zip(names, np.asarray(values), np.asarray(jacobian), strict=True):
        if not np.isfinite(value):
            return f"{name} is {value:g}"
        if not np.all(np.isfinite(row)):
            return f"the derivative of {name} is not finite"
    return ""
