"""User functions of a model's variables, compared by their computation so that equal ones compile once."""

import contextlib
import dataclasses
import functools as ft
import inspect
import math
import types
from collections.abc import Callable, Hashable, Mapping, Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.tree_util import PyTreeDef
from jaxtyping import PyTree

from ..._declare.component import Component
from ..._declare.node import nodes_of
from ..._errors import ModelError
from ..._fingerprint import NoFingerprintError, fingerprint
from ..._jax_private import (
    Atom,
    ClosedJaxpr,
    Jaxpr,
    Literal,
    Var,
    jaxpr_as_fun,
)
from ..._numbers import Numbers
from ..._reduce.flat_model import FlatModel
from ..._reduce.jaxpr import assembled, is_floating, structs
from ..._reduce.traced import check_bounds


@dataclasses.dataclass(frozen=True)
class UserFunction:
    """A function of the leaves of a model. The numbers in it are passed separately as `constants`.

    Two functions are equal if they differ only in their constants, whatever Python functions they came from. If the
    computation has no fingerprint, they are equal only if they come from the same Python function.
    """

    text: str
    closed: ClosedJaxpr = dataclasses.field(compare=False, hash=False)
    leaves: tuple[int, ...]  # the leaves that it reads; those of a second view continue the numbering
    tree: PyTreeDef  # the pytree structure of its result
    owner: object = dataclasses.field(default=None, compare=False)  # kept alive: `text` names it by address

    @property
    def n_outputs(self) -> int:
        return self.tree.num_leaves

    def __call__(self, constants: Sequence[Numbers], values: Sequence[Numbers]) -> list[Array]:
        """Evaluate the function from the constants and the values of `leaves`."""
        return list(jaxpr_as_fun(self.closed)(*constants, *values))


NOTHING = jax.tree.structure(None)  # the result of no function: jax compares structures with structures only

_traced: dict[Hashable, tuple[UserFunction, list[Numbers]]] = {}
_MOST = 512  # largest number of cached traces


VARIABLES = "the variables, s"
DERIVATIVES = "their derivatives, d"


def as_function(value: object, what: str, arguments: Sequence[str] = (VARIABLES,)) -> Callable[..., PyTree]:
    """Validates a user function that is called with the `arguments`."""
    if not callable(value):
        remedy = _if_many(value, what, arguments)
        raise ModelError(f"{what} must be a function of the variables, got {value!r}.{remedy}")
    with contextlib.suppress(ValueError):  # not every callable has a signature
        signature = inspect.signature(value)
        try:
            signature.bind(*arguments)
        except TypeError as error:
            raise ModelError(
                f"{what} is called with {' and '.join(arguments)}, but takes {signature}: {error}."
            ) from None
    return value


def _if_many(value: object, what: str, arguments: Sequence[str]) -> str:
    """The remedy for a dictionary of functions in place of a function."""
    if not isinstance(value, Mapping):
        return ""
    taken = ", ".join(argument.rsplit(" ", 1)[-1] for argument in arguments)
    return f" The function must return the dictionary: {what}=lambda {taken}: {{{next(iter(value), 'name')!r}: ...}}."


def trace(
    function: Callable[..., PyTree], flat: FlatModel, what: str, n_views: int = 1
) -> tuple[UserFunction, list[Numbers]]:
    """Validates and traces a user function of `n_views` views of the model. Returns the function and its constants.

    The trace is cached if the function is known to compute the same again.
    """
    function = as_function(function, what, (VARIABLES, DERIVATIVES)[:n_views])
    key = _key_of(function, _stating(flat))
    if key is None:
        return _trace(function, flat, what, n_views)
    if (flat, key, n_views) not in _traced:
        if len(_traced) >= _MOST:
            _traced.clear()
        _traced[flat, key, n_views] = _trace(function, flat, what, n_views)
    return _traced[flat, key, n_views]


@ft.lru_cache(maxsize=64)
def _stating(flat: FlatModel) -> dict[str, tuple[type, ...]]:
    """The class attributes of a model that are not fields, such as properties and methods, by name."""
    found: dict[str, tuple[type, ...]] = {}
    for cls in {type(node) for _, node in nodes_of(flat.structure.unflatten(range(flat.structure.num_leaves)))}:
        for name in set(dir(cls)) - set(dir(Component)) - {field.name for field in dataclasses.fields(cls)}:
            found[name] = (*found.get(name, ()), cls)
    return found


def _key_of(function: Callable[..., Any], stating: Mapping[str, tuple[type, ...]]) -> Hashable | None:
    """Cache key of a plain function: its code and the numbers and modules it refers to, directly or through class
    attributes. None if it refers to anything else.
    """
    key: list[Hashable] = []
    names, parts = set[str](), [function]
    for part in parts:
        if type(part) in _NUMBERS:
            key.append(_named(part))
            continue
        code, *others = _refers_to(part)
        if not isinstance(code, types.CodeType):
            return None
        if not all(type(value) in _NUMBERS or id(value) in _LIBRARIES for value in others):
            return None
        key += [code, *map(_named, others)]
        for name in code.co_names:
            if name in stating and name not in names:
                names.add(name)
                stated = (getattr(cls, name, None) for cls in stating[name])
                parts += [value.fget if isinstance(value, property) else value for value in stated]
    return tuple(key)


def _refers_to(function: object) -> tuple[object, ...]:
    """The code of a plain function and the objects it refers to; for any other object, the object itself."""
    if not isinstance(function, types.FunctionType) or function.__defaults__ or function.__kwdefaults__:
        return (function,)
    code = function.__code__
    if any(isinstance(constant, types.CodeType) for constant in code.co_consts):
        return (function,)
    cells = (cell.cell_contents for cell in function.__closure__ or ())
    return code, *cells, *(function.__globals__[name] for name in code.co_names if name in function.__globals__)


def _named(value: object) -> str:
    """A number by its repr, because 1, 1.0 and True are equal, and so are both zeros; anything else by address."""
    return repr(value) if type(value) in _NUMBERS else f"{id(value)}"


_NUMBERS = (bool, int, float)
_LIBRARIES = frozenset(map(id, (jax, jnp, np, math)))  # modules that do not change


def _trace(
    function: Callable[..., PyTree], flat: FlatModel, what: str, n_views: int
) -> tuple[UserFunction, list[Numbers]]:
    trees: list[PyTreeDef] = []

    def of_leaves(*values: Array) -> list[Array]:
        views = [flat.structure.unflatten(values[i : i + len(shapes)]) for i in range(0, len(values), len(shapes))]
        results, tree = jax.tree_util.tree_flatten(function(*views))
        trees.append(tree)
        _check_real(results, what)
        return [jnp.asarray(value, float) for value in results]

    shapes = [leaf.stack + leaf.sizes for leaf in flat.own_leaves]
    try:
        closed = jax.make_jaxpr(of_leaves)(*structs(shapes * n_views))
    except AttributeError as error:
        said = str(error).rstrip(".")
        raise ModelError(f"{what}: {said}. Its argument has the shape of the model, as in s.slave.rod.s.") from error
    check_bounds(closed, what)
    jaxpr, constants = _hoisted(closed)
    atoms = [atom for eqn in jaxpr.eqns for atom in eqn.invars] + list(jaxpr.outvars)
    read = {atom for atom in atoms if not isinstance(atom, Literal)}
    held = len(constants)
    leaves = tuple(i for i, var in enumerate(jaxpr.invars[held:]) if var in read)
    invars = jaxpr.invars[:held] + [jaxpr.invars[held + i] for i in leaves]
    slim = ClosedJaxpr(assembled(invars, jaxpr.outvars, jaxpr.eqns), [])
    try:
        return UserFunction(fingerprint(slim), slim, leaves, trees[0]), constants
    except NoFingerprintError:  # equal only to the same Python function
        owner = tuple(item for part in _refers_to(function) for item in _refers_to(part))
        text = " ".join([str(slim), *map(_named, owner)])
        return UserFunction(text, slim, leaves, trees[0], owner), constants


def _check_real(results: list[Array], what: str) -> None:
    if what == "until" and len(results) != 1:
        raise ModelError(f"until must return one real number, but returned {len(results)}.")
    for value in results:
        if not isinstance(value, jax.Array | np.ndarray | np.generic | float | int):
            raise ModelError(f"{what} must return real numbers, but returned {value!r}.")
        if jnp.ndim(value) != 0:
            raise ModelError(f"{what} must return real numbers, but returned an array of shape {jnp.shape(value)}.")
        if jnp.iscomplexobj(value):
            raise ModelError(f"{what} must return real numbers, but returned a complex one.")
        if jnp.issubdtype(jnp.result_type(value), jnp.bool_):
            remedy = "function that crosses zero, as in s.x - 1.0" if what == "until" else "number"
            raise ModelError(f"{what} returned a truth value: return a real {remedy}.")


def _hoisted(closed: ClosedJaxpr) -> tuple[Jaxpr, list[Numbers]]:
    """The jaxpr with its constants and literal numbers converted to leading inputs."""
    jaxpr = closed.jaxpr
    variables: list[Var] = list(jaxpr.constvars)
    constants: list[Numbers] = list(closed.consts)

    def lift(atom: Atom) -> Atom:
        if not isinstance(atom, Literal) or not is_floating(atom):
            return atom
        variables.append(Var(atom.aval))
        constants.append(np.asarray(atom.val, float))
        return variables[-1]

    eqns = [eqn.replace(invars=[lift(atom) for atom in eqn.invars]) for eqn in jaxpr.eqns]
    outvars = [lift(atom) for atom in jaxpr.outvars]
    return assembled(variables + list(jaxpr.invars), outvars, eqns), constants
