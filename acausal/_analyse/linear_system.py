"""`LinearSystem`: A, B, C, D with names, and what follows from them."""

from collections.abc import Sequence
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Complex, Float

from .._errors import ModelError, suggestion
from .._extras import Axes, Panels
from . import realisation, responses
from .margins import Margins, margins
from .modes import Modes, Shares, modes_of, poles_of
from .point import Point
from .storage import energy_shares
from .zeros import TransferFunction, dc_gain, transfer_function, transmission_zeros


class LinearSystem(eqx.Module):
    """Small deviations from an operating point: dx/dt = A x + B u, y = C x + D u; made by `linearise`.

    - `A`, `B`, `C`, `D`: in the units of states, inputs and outputs; `rates` are the derivatives of the states at the
      operating point itself, which vanish at an equilibrium.
    - `states`, `inputs`, `outputs`: names; `unit(name)` is the unit, "" where it is not known.
    - `sizes`: the nominal sizes of the states, in which eigenvalues and ranks are computed.

    It is a pytree: under `jax.vmap` a batch comes out, whose `poles` have one more axis; take one system of it with
    `jax.tree_util.tree_map(lambda x: x[i], batch)` for the rest. `poles`, `modes`, `participation`, `energy`,
    `frequency_response`, `step_response` and `impulse_response` can be traced and differentiated. The others decide
    on ranks and need numbers.
    """

    A: Float[Array, "n n"]
    B: Float[Array, "n m"]
    C: Float[Array, "p n"]
    D: Float[Array, "p m"]
    rates: Float[Array, " n"]
    _point: Point | None
    _basis: Float[Array, "all n"] | None  # dy = basis dx, where some of the system's states y are redundant
    states: tuple[str, ...] = eqx.field(static=True)
    inputs: tuple[str, ...] = eqx.field(static=True)
    outputs: tuple[str, ...] = eqx.field(static=True)
    units: tuple[tuple[str, ...], tuple[str, ...], tuple[str, ...]] = eqx.field(static=True)
    sizes: tuple[float, ...] = eqx.field(static=True)
    _independent: tuple[int, ...] = eqx.field(static=True)

    @property
    def _scaled(self) -> tuple[Array, Array, Array, Array]:
        """A, B, C, D for states measured in their nominal sizes."""
        sizes = np.array(self.sizes)
        return self.A / sizes[:, None] * sizes, self.B / sizes[:, None], self.C * sizes, self.D

    @property
    def poles(self) -> Complex[Array, " n"]:
        """Eigenvalues of A in 1/s, in rising order of size; differentiable where they are simple."""
        return poles_of(self._scaled[0])

    @property
    def modes(self) -> Modes:
        """Poles with frequencies, damping, shapes and participation; `print` them for a table."""
        return modes_of(self._scaled[0], np.array(self.sizes), self.states)

    @property
    def participation(self) -> Shares:
        """The share of each state in each mode; see `Modes`."""
        return self.modes.participation

    @property
    def energy(self) -> Shares:
        """The share of each component that stores energy in each mode; `print` it for a table.

        For a mode shape v and the Hessian H of a component's stored energy with respect to the states, v^H H v / 4 is
        the energy it stores in the mode, averaged over a period of an undamped oscillation; the shares are those of
        the sum of absolute values. It is the energy of the deviation, so the shares mean what they say about an
        equilibrium. The share of a component that helps to drive the mode, such as a weight on top of an inverted
        pendulum, is negative. A mode that stores nothing, such as an angle that a free shaft keeps, has no shares.
        """
        if self._point is None:
            raise ModelError("A realisation in other states has no components: ask the system that linearise returned.")
        modes = self.modes
        shapes = modes.shapes if self._basis is None else self._basis @ modes.shapes
        return energy_shares(self._point, modes.poles, shapes, self._independent)

    def frequency_response(self, w: ArrayLike) -> Complex[Array, "... p m"]:
        """C (i w - A)^-1 B + D at angular frequencies in rad/s, of any shape."""
        return responses.frequency(self._scaled, jnp.asarray(w, float))

    def step_response(self, ts: ArrayLike) -> Float[Array, "t p m"]:
        """Outputs at the times `ts` in s after each input has risen by 1 at time 0, by matrix exponentials."""
        return responses.step(self._scaled, jnp.asarray(ts, float))

    def impulse_response(self, ts: ArrayLike) -> Float[Array, "t p m"]:
        """C exp(A t) B at the times `ts` in s: outputs after a unit impulse on each input, without D delta(t)."""
        return responses.impulse(self._scaled, jnp.asarray(ts, float))

    @property
    def dc_gain(self) -> Float[np.ndarray, "p m"]:
        """The lasting change of each output for a lasting change of each input; infinite where it passes an integrator.

        `frequency_response(0.0)` is the same, traceable, for systems without poles at 0. For an unstable system it is
        the gain between equilibria, which are not reached.
        """
        return dc_gain(self._scaled)

    @property
    def zeros(self) -> Complex[np.ndarray, " zeros"]:
        """Transmission zeros in 1/s: where the rank of [A - s, B; C, D] of the minimal system is less than usual."""
        A, B, C, D = self._scaled
        return transmission_zeros((*realisation.minimal(A, B, C), D))

    def transfer_function(self, output: str | None = None, input: str | None = None) -> TransferFunction:
        """Numerator and denominator of a channel, common factors cancelled; names may be left out if there is one."""
        return transfer_function(self.channel(output, input)._scaled)

    def channel(self, output: str | None = None, input: str | None = None) -> "LinearSystem":
        """The system from one input to one output; names may be left out where there is one."""
        i, j = self._index(self.outputs, output, "output"), self._index(self.inputs, input, "input")
        units = (self.units[0], (self.units[1][j],), (self.units[2][i],))
        changes = dict(B=self.B[..., j : j + 1], C=self.C[..., i : i + 1, :], D=self.D[..., i : i + 1, j : j + 1])
        return self._replaced(**changes, inputs=(self.inputs[j],), outputs=(self.outputs[i],), units=units)

    def margins(self, output: str | None = None, input: str | None = None) -> Margins:
        """Margins of gain, phase and delay of a loop that was broken, see `linearise(..., open=...)`: of L(s) = -G(s),
        with G from the input to the output; names may be left out where there is one.
        """
        A, B, C, D = self.channel(output, input if input is not None else output)._scaled
        return margins((A, B, -C, -D))

    def _index(self, names: Sequence[str], name: str | None, role: str) -> int:
        if name is None and len(names) == 1:
            return 0
        if name is None:
            raise ModelError(f"Name the {role}, of {', '.join(names) or 'none'}.")
        if name not in names:
            raise ModelError(f"The linear system has no {role} {name!r}.{suggestion(name, names)}")
        return names.index(name)

    @property
    def controllable(self) -> bool:
        """Whether the inputs reach all states; decided in balanced units at a relative size of 1e-12."""
        return realisation.reachable(self._scaled[0], self._scaled[1]).shape[1] == len(self.states)

    @property
    def observable(self) -> bool:
        """Whether the outputs tell all states apart; decided in balanced units at a relative size of 1e-12."""
        return realisation.reachable(self._scaled[0].T, self._scaled[2].T).shape[1] == len(self.states)

    def minimal(self) -> "LinearSystem":
        """The system without what its inputs do not reach and its outputs do not see, in states z[0], z[1], ..."""
        return self._in_other_states(realisation.minimal(*self._scaled[:3]))

    def reduce(self, order: int) -> "LinearSystem":
        """The system with fewer states that its step responses need most, by balanced truncation (Moore 1981).

        The error of the frequency response is at most twice the sum of the `hankel_singular_values` left out. Raises
        `ModelError` where a pole that inputs and outputs see is not stable, or the minimal system has fewer states.
        """
        return self._in_other_states(realisation.truncated(*self._scaled[:3], order))

    @property
    def hankel_singular_values(self) -> Float[np.ndarray, " states"]:
        """How much each balanced state of the minimal system takes part between inputs and outputs, largest first."""
        return realisation.balanced(*realisation.minimal(*self._scaled[:3]))[0]

    def _in_other_states(self, matrices: tuple[np.ndarray, np.ndarray, np.ndarray]) -> "LinearSystem":
        A, B, C = (jnp.asarray(matrix) for matrix in matrices)
        names = tuple(f"z[{i}]" for i in range(len(A)))
        return LinearSystem(
            A=A, B=B, C=C, D=self.D, rates=jnp.zeros(len(A)), _point=None, _basis=None, states=names,
            inputs=self.inputs, outputs=self.outputs, units=(("",) * len(A), *self.units[1:]), sizes=(1.0,) * len(A),
            _independent=(),
        )  # fmt: skip

    def _replaced(self, **changes: Any) -> "LinearSystem":
        fields = type(self).__dataclass_fields__
        return LinearSystem(**({name: getattr(self, name) for name in fields} | changes))

    def unit(self, name: str) -> str:
        """The unit of a state, input or output."""
        known = dict(zip((*self.states, *self.inputs, *self.outputs), sum(self.units, ()), strict=True))
        if name not in known:
            raise ModelError(f"The linear system has no signal {name!r}.{suggestion(name, known)}")
        return known[name]

    def to_control(self) -> Any:
        """A `control.StateSpace` of python-control, with underscores for the dots in names, which it does not allow."""
        from .export import to_control

        return to_control(self)

    def plot_bode(self, w: ArrayLike | None = None, axes: Panels | None = None) -> np.ndarray:
        """Plot gains and phases over the frequency, a column for each input; returns the matplotlib axes.

        `w` are angular frequencies in rad/s, by default from below the slowest to above the fastest pole or zero.
        """
        from .plots import plot_bode

        return plot_bode(self, w, axes)

    def plot_step(self, ts: ArrayLike | None = None, axes: Panels | None = None) -> np.ndarray:
        """Plot the step responses, a row for each unit of the outputs and a column for each input; returns the axes."""
        from .plots import plot_step

        return plot_step(self, ts, axes)

    def plot_poles(self, ax: Axes | None = None) -> Axes:
        """Plot poles (crosses) and transmission zeros (circles) in the complex plane; returns the matplotlib axes."""
        from .plots import plot_poles

        return plot_poles(self, ax)

    def __repr__(self) -> str:
        size = f"{len(self.states)} states, {len(self.inputs)} inputs, {len(self.outputs)} outputs"
        return f"<LinearSystem: {size}>"
