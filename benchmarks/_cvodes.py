"""CVODES through CasADi at its best: sparse Newton with exact Jacobian, states of size one, no overhead of a call."""

from collections.abc import Mapping

import casadi
import numpy as np

from . import _handwritten as handwritten


class Run:
    """The actuator from rest to a fixed time; calling it integrates.

    CasADi's own virtual machine evaluates the equations: its C code would need a compiler on the user's machine, as
    neither it nor this library otherwise does. The arguments lie in buffers, so that a call does nothing but integrate.
    """

    def __init__(self, p: Mapping[str, float], rtol: float, atol: float, t1: float = handwritten.OPENING_TIME) -> None:
        scaled = casadi.SX.sym("y", 5)  # pyright: ignore[reportAttributeAccessIssue]
        names = list(p)
        symbols = casadi.SX.sym("p", len(names))  # pyright: ignore[reportAttributeAccessIssue]
        nominals = handwritten.NOMINALS
        y = [scaled[i] * nominals[i] for i in range(5)]
        rates = handwritten.rates(y, {name: symbols[i] for i, name in enumerate(names)}, casadi)
        problem = {"x": scaled, "p": symbols, "ode": casadi.vertcat(*rates) / nominals}
        options = {"reltol": rtol, "abstol": atol, "max_num_steps": 100_000}
        function = casadi.integrator("run", "cvodes", problem, 0.0, t1, options)
        self._buffer, self._integrate = function.buffer()
        self._y0, self._y1 = np.zeros(5), np.zeros(5)
        self._p = np.array([float(value) for value in p.values()])
        self._buffer.set_arg(function.index_in("x0"), self._y0.data)  # pyright: ignore[reportCallIssue]
        self._buffer.set_arg(function.index_in("p"), self._p.data)  # pyright: ignore[reportCallIssue]
        self._buffer.set_res(function.index_out("xf"), self._y1.data)  # pyright: ignore[reportCallIssue]

    def __call__(self) -> None:
        self._integrate()

    @property
    def state(self) -> np.ndarray:
        """The state at the end of the last call."""
        return self._y1 * handwritten.NOMINALS
