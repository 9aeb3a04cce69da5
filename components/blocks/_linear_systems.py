"""Linear systems of any order (as MSL `TransferFunction` and `StateSpace`)."""

from typing import Any, Self

import jax.numpy as jnp

from acausal import (
    Component,
    Equations,
    Param,
    ParameterError,
    Requirements,
    Var,
    Vector,
    eq,
    require,
    shape,
)

from .._checks import check_shape, numbers
from ._interfaces import SISO, Input, Output


def _start(x: Vector | None) -> Any:
    # A float is a start value that `eqx.filter_grad` leaves alone.
    return 0.0 if x is None else jnp.asarray(x, dtype=float)


class TransferFunction(SISO):
    """y = (b[0] s^m + ... + b[m]) / (a[0] s^n + ... + a[n]) u with m <= n, in controllable canonical form.

    With leading zeros added to b, and the feedthrough D = b[0] / a[0]:

    - a[0] dx[0]/dt = a_end u - a[1] x[0] - ... - a[n] x[n-1] and dx[i]/dt = x[i-1];
    - a_end y = (b - D a)[1:] x + a_end D u.

    The scale a_end = a[n] makes x[n-1] equal to u in steady state; for an integrating transfer function, a[n] = 0,
    a_end is 1. All states start at zero by default.
    """

    order: int  # n, from the length of a
    a: Param[Vector, ""]  # coefficients of the denominator, highest power first
    b: Param[Vector, ""]  # coefficients of the numerator, highest power first
    x: Var[Vector, "", shape("order")]  # state

    def __init__(self, *, b: Vector | list[float], a: Vector | list[float], x: Vector | None = None) -> None:
        self.a, self.b = numbers(self, "a", a), numbers(self, "b", b)
        self.order = len(self.a) - 1
        self.x = _start(x)
        self.u, self.y = Input(), Output()
        if not 1 <= len(self.b) <= len(self.a) or self.order < 1:
            raise ParameterError(
                f"TransferFunction needs a denominator of order 1 or more and a numerator of at most this order, got "
                f"{len(self.b)} coefficients in b and {len(self.a)} in a. For a constant factor use Gain."
            )
        if x is not None:
            check_shape(self, "x", (self.order,))

    def requirements(self) -> Requirements:
        n = self.order + 1
        return (
            require(jnp.shape(self.a) == (n,), f"a must have shape {(n,)}"),
            require(jnp.ndim(self.b) == 1 and 1 <= len(self.b) <= n, f"b must have 1 to {n} coefficients"),
            require(self.a[0] != 0.0, "a must start with a nonzero coefficient"),
        )

    def equations(self, d: Self) -> Equations:
        a, u = self.a, self.u.value
        b = jnp.concatenate([jnp.zeros(len(a) - len(self.b)), self.b])
        direct = b[0] / a[0]
        scale = jnp.where(a[-1] == 0.0, 1.0, a[-1])
        lead = (scale * u - jnp.sum(a[1:] * self.x)) / a[0]
        return dict(
            state=eq(d.x, jnp.concatenate([jnp.reshape(lead, (1,)), self.x[:-1]])),
            output=eq(self.y.value, jnp.sum((b[1:] - direct * a[1:]) / scale * self.x) + direct * u),
        )


class StateSpace(Component):
    """dx/dt = A x + B u and y = C x + D u; the matrices determine the number of inputs u[j] and outputs y[i].

    D is zero by default. The states start at x, zero by default.
    """

    order: int  # length of x, from A
    A: Param[Vector, ""]  # order x order
    B: Param[Vector, ""]  # order x inputs
    C: Param[Vector, ""]  # outputs x order
    D: Param[Vector, ""]  # outputs x inputs
    x: Var[Vector, "", shape("order")]  # state
    u: tuple[Input, ...]
    y: tuple[Output, ...]

    def __init__(self, *, A: Vector, B: Vector, C: Vector, D: Vector | None = None, x: Vector | None = None) -> None:
        self.A, self.B, self.C = numbers(self, "A", A), numbers(self, "B", B), numbers(self, "C", C)
        if not all(matrix.ndim == 2 for matrix in (self.A, self.B, self.C)):
            raise ParameterError("StateSpace needs arrays with two axes: reshape B to (order, inputs).")
        self.order, inputs, outputs = len(self.A), self.B.shape[1], len(self.C)
        self.D = jnp.zeros((outputs, inputs)) if D is None else numbers(self, "D", D)
        self.x = _start(x)
        self.u, self.y = tuple(Input() for _ in range(inputs)), tuple(Output() for _ in range(outputs))
        n = self.order
        shapes = {"A": (n, n), "B": (n, inputs), "C": (outputs, n), "D": (outputs, inputs)}
        for name, wanted in shapes.items() if x is None else {**shapes, "x": (n,)}.items():
            check_shape(self, name, wanted)

    def requirements(self) -> Requirements:
        n, inputs, outputs = self.order, len(self.u), len(self.y)
        shapes = {"A": (n, n), "B": (n, inputs), "C": (outputs, n), "D": (outputs, inputs)}
        return tuple(require(jnp.shape(getattr(self, k)) == v, f"{k} must have shape {v}") for k, v in shapes.items())

    def equations(self, d: Self) -> Equations:
        inputs = [(j, u.value) for j, u in enumerate(self.u)]
        driven = sum(self.B[:, j] * u for j, u in inputs)
        outputs = {
            f"output_{i}": eq(y.value, jnp.sum(self.C[i] * self.x) + sum(self.D[i, j] * u for j, u in inputs))
            for i, y in enumerate(self.y)
        }
        return dict(state=eq(d.x, self.A @ self.x + driven)) | outputs
