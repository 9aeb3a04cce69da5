"""Learned curves between pure numbers, with weights that are parameters of a model."""

import abc
import dataclasses
import math
from typing import Any, Self

import equinox as eqx
import jax
import jax.numpy as jnp
from jax import Array

from acausal import ArgumentError, Param, Record, Requirements, Scalar, Vector, require


class Curve(Record, partial=True):
    """A smooth function y(x) of pure numbers. Its weights are parameters, so a model with it can be trained."""

    @abc.abstractmethod
    def __call__(self, x: Any) -> Any:
        """y(x)."""

    @property
    def is_scalar(self) -> bool:
        """Whether it maps a number to a number."""
        try:
            return jax.eval_shape(self, jnp.zeros(())).shape == ()
        except (TypeError, ValueError, AttributeError, IndexError):  # of a module for another shape
            return False


class MonotoneCurve(Curve):
    """y = exp(linear) x + sum_i exp(heights_i) [tanh(exp(slopes_i) x + offsets_i) - tanh(offsets_i)].

    It rises strictly and passes through zero for all weights, so x y > 0: as a law between an effort and a flow, it
    dissipates. Sums of enough such terms approximate any rising continuous curve through zero on an interval
    (Sill, NIPS 10, 1998, for networks with positive weights).
    """

    heights: Param[Vector, "1"]  # logarithms of the heights of the terms
    slopes: Param[Vector, "1"]  # logarithms of their slopes
    offsets: Param[Vector, "1"]  # arguments at x = 0
    linear: Param[Scalar, "1"] = 0.0  # logarithm of the slope of the linear term

    @classmethod
    def of(cls, n: int, key: Any) -> Self:
        """A curve of n terms between about -1 and 1, with random offsets."""
        offsets = 2.0 * jax.random.normal(key, (n,), float)
        return cls(heights=jnp.full(n, -jnp.log(float(n))), slopes=jnp.ones(n), offsets=offsets)

    def requirements(self) -> Requirements:
        sizes = {jnp.shape(item) for item in (self.heights, self.slopes, self.offsets)}
        is_same = len(sizes) == 1 and all(len(size) == 1 for size in sizes)
        return (require(is_same, "heights must have the shape of slopes and offsets: a number for each term"),)

    def __call__(self, x: Scalar) -> Scalar:
        terms = jnp.tanh(jnp.exp(self.slopes) * x + self.offsets) - jnp.tanh(self.offsets)
        return jnp.exp(self.linear) * x + jnp.sum(jnp.exp(self.heights) * terms)


@dataclasses.dataclass(frozen=True, repr=False)
class Form:
    """A module of equinox with the shapes and types of its arrays in their place."""

    skeleton: Any

    @classmethod
    def of(cls, module: Any) -> "Form":
        arrays, rest = eqx.partition(module, eqx.is_inexact_array)
        shapes = jax.tree_util.tree_map(lambda leaf: jax.ShapeDtypeStruct(leaf.shape, leaf.dtype), arrays)
        return cls(eqx.combine(shapes, rest))

    def module(self, weights: Array) -> Any:
        """The module with these weights."""
        start, leaves = 0, []
        for leaf in jax.tree_util.tree_leaves(self.skeleton):
            if isinstance(leaf, jax.ShapeDtypeStruct):
                end = start + math.prod(leaf.shape)
                start, leaf = end, jnp.reshape(weights[start:end], leaf.shape)
            leaves.append(leaf)
        return jax.tree_util.tree_unflatten(jax.tree_util.tree_structure(self.skeleton), leaves)

    @property
    def size(self) -> int:
        leaves = jax.tree_util.tree_leaves(self.skeleton)
        return sum(math.prod(leaf.shape) for leaf in leaves if isinstance(leaf, jax.ShapeDtypeStruct))

    def __repr__(self) -> str:
        # Without addresses of functions, which differ between processes: names of stored programs contain it.
        return f"{type(self.skeleton).__name__} with {self.size} weights"


class Network(Curve):
    """y = n(x; weights): a module of equinox between pure numbers, with all its arrays in one vector of weights.

    `Network.of(8, key)` has one hidden layer of 8 neurons. `Network(module)` takes any callable module. Its arrays of
    floats become the parameter `weights`, concatenated in the order of the pytree; the rest is static. Networks that
    differ only in weights share compiled programs.

    Use a smooth activation: the kinks of `relu` cost steps and accuracy of derivatives. Python cannot store functions
    under `jax.jit`, such as `jnp.tanh`, and the default final activation of `eqx.nn.MLP`. Scale the input and the
    output by parameters with units, since `weights` and x have none.

    Raises `ArgumentError` for a module without arrays, or which cannot be called.
    """

    weights: Param[Vector, "1"]  # all arrays of the module
    form: Form = eqx.field(static=True)

    def __init__(self, module: eqx.Module) -> None:
        self.form = Form.of(module)
        if not self.form.size or not callable(module):
            raise ArgumentError(
                f"Network takes a callable module with arrays of floats, such as eqx.nn.MLP(2, 1, 8, 1, key=key), got "
                f"{type(module).__name__}. Network.of(8, key) has one input, one output and one hidden layer."
            )
        arrays = jax.tree_util.tree_leaves(eqx.filter(module, eqx.is_inexact_array))
        self.weights = jnp.concatenate([jnp.ravel(array) for array in arrays])

    def requirements(self) -> Requirements:
        is_whole = jnp.shape(self.weights) == (self.form.size,)
        return (require(is_whole, f"weights must be a vector for an {self.form!r}"),)

    @classmethod
    def of(cls, n: int, key: Any) -> Self:
        """A network from a number to a number, with one hidden layer of n neurons with tanh, and random weights."""
        first, last = jax.random.split(key)
        inner, outer = eqx.nn.Linear("scalar", n, key=first), eqx.nn.Linear(n, "scalar", key=last)
        return cls(eqx.nn.Sequential([inner, eqx.nn.Lambda(jax.lax.tanh), outer]))

    @property
    def module(self) -> Any:
        """The module of equinox with the present weights."""
        return self.form.module(self.weights)

    def __call__(self, x: Any) -> Any:
        return self.module(x)
