"""Results of many members of a model from one compiled program.

Members run one by one, since vectorised members would wait for the slowest one at every event and rejected step.
"""

import collections
import functools as ft
import threading
import uuid
from collections.abc import Mapping
from typing import NamedTuple, Self

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Bool, Float, Int, PyTree

from ..._declare.component import Component
from ..._equinox_private import members_of
from ..._integrate.results.failure import trials
from ..._integrate.setup.result import Result, is_success, sentence
from ..._progress import compiling
from ..._reduce.jaxpr import arrays_in
from .._compute.cores import CHUNK
from .._compute.evaluator import Evaluator
from .._problem.free import Free
from .._problem.types import Function

COMPUTED, NOT_FINITE = 0, len(Result)  # codes; those between are the failures of `Result`
INTERRUPTED = NOT_FINITE + 1
PROGRAMS = 16  # compiled batches that a process keeps
_making = threading.Lock()

Piece = tuple[np.ndarray, np.ndarray]  # results and codes


class Outcomes(NamedTuple):
    """Results of members, row by row, with a code for success or the reason of failure."""

    values: Float[np.ndarray, "n m"]
    codes: Int[np.ndarray, " n"]

    @property
    def are_good(self) -> Bool[np.ndarray, " n"]:
        """Marks the members that were computed."""
        return self.codes == COMPUTED

    @property
    def are_finished(self) -> Bool[np.ndarray, " n"]:
        """Marks members that were computed or failed before an interrupt."""
        return self.codes != INTERRUPTED

    @classmethod
    def interrupted(cls, n: int, width: int) -> Self:
        """Outcomes of a study that did not start because of an interrupt."""
        return cls(np.full((n, width), np.nan), np.full(n, INTERRUPTED))

    @property
    def failed(self) -> dict[str, int]:
        """Number of failed members by reason."""
        counts = collections.Counter(self.codes[~self.are_good & self.are_finished].tolist())
        return {code_names()[code]: number for code, number in sorted(counts.items())}


def code_names() -> tuple[str, ...]:
    """Names of the codes, in order."""
    return ("computed", *list(members_of(Result))[1:], "no_finite_result", "interrupted")


def message_of(code: int) -> str:
    """Message of a code."""
    if code == COMPUTED:
        return "The results were computed."
    if code == NOT_FINITE:
        return "A result is not a finite number."
    if code == INTERRUPTED:
        return "The study was interrupted."
    return sentence(list(members_of(Result).values())[code])


class Batch:
    """A function from rows of parameters to rows of results and codes. It can be sent to another process.

    A copy is equal to the original, so a process compiles its program once.
    """

    def __init__(
        self, model: Component, free: Free, functions: Mapping[str, Function], run: Function | None = None
    ) -> None:
        self.model, self.free, self.functions, self.run = model, free, dict(functions), run
        self.progress: bool | None = None  # messages about compilations; False: none
        self._key = uuid.uuid4().hex

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Batch) and other._key == self._key

    def __hash__(self) -> int:
        return hash(self._key)

    def __call__(self, x: Float[np.ndarray, "n k"]) -> Piece:
        """Results and codes of some members."""
        found = [self._piece(x[start : start + CHUNK]) for start in range(0, len(x), CHUNK)]
        values, codes = (np.concatenate([pair[i] for pair in found]) for i in range(2))
        return values, codes

    @ft.cached_property
    def columns(self) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """Names of the results, and the name of the function of each."""
        evaluator, row = Evaluator(self.model, self.free, self.functions, self.run), self.free.values(self.model)
        with trials():
            jax.eval_shape(lambda x: evaluator.results(self.free.with_values(self.model, x)), row)
        return evaluator.names, evaluator.owners

    def lowered(self) -> tuple[str, list[np.ndarray]]:
        """StableHLO program for one member and the arrays in it. The parameters of the model are its arguments."""
        evaluator, row = Evaluator(self.model, self.free, self.functions, self.run), self.free.values(self.model)
        arrays, rest = eqx.partition(self.model, eqx.is_array)

        @jax.jit
        def member(arrays: PyTree, row: Array) -> tuple[Array, Array]:
            return _one(evaluator, eqx.combine(arrays, rest), row)

        with trials():
            traced = member.trace(arrays, row)
            return traced.lower().as_text(), [np.asarray(array) for array in arrays_in(traced.jaxpr)]

    def _piece(self, x: np.ndarray) -> Piece:
        """Results and codes of at most `CHUNK` members."""
        with _making:
            function = _compiled(self)
        with trials(), compiling("a batch of runs", self.model, function, self.progress is not False):
            values, codes = function(x)
        return np.asarray(values)[: len(x)], np.asarray(codes)[: len(x)]


class _CompiledBatch:
    """The compiled program of a batch, for at most `CHUNK` members."""

    def __init__(self, batch: Batch) -> None:
        evaluator = Evaluator(batch.model, batch.free, batch.functions, batch.run)
        arrays, rest = eqx.partition(batch.model, eqx.is_array)
        width = len(batch.columns[0])

        @jax.jit
        def members(arrays: PyTree, x: Array, number: int) -> PyTree:
            model = eqx.combine(arrays, rest)

            def step(i: Array, found: PyTree) -> PyTree:
                member = _one(evaluator, model, x[i])
                return tuple(whole.at[i].set(part) for whole, part in zip(found, member, strict=True))

            empty = jnp.zeros((CHUNK, width)), jnp.zeros(CHUNK, "int32")
            # The number of members is an argument, so that one program serves pieces of any length.
            return jax.lax.fori_loop(0, number, step, empty)

        self._function = ft.partial(members, arrays)
        self._first, self._is_compiled = threading.Lock(), False

    def __call__(self, x: np.ndarray) -> PyTree:
        filled = np.concatenate([x, np.zeros((CHUNK - len(x), *x.shape[1:]))])
        # Only the first piece compiles the program; the others wait for it.
        with self._first:
            if not self._is_compiled:
                found = jax.block_until_ready(self._function(filled, len(x)))
                self._is_compiled = True
                return found
        return self._function(filled, len(x))


_compiled = ft.lru_cache(maxsize=PROGRAMS)(_CompiledBatch)


def _one(evaluator: Evaluator, model: Component, row: Array) -> tuple[Array, Array]:
    values, results = evaluator.results(evaluator.free.with_values(model, row))
    code = jnp.where(jnp.all(jnp.isfinite(values)), COMPUTED, NOT_FINITE)
    for result in results:
        number = jax.tree_util.tree_leaves(result)[0]
        code = jnp.where(is_success(result), code, number)
    return values, code.astype("int32")
