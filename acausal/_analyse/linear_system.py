"""`LinearSystem`: A, B, C, D with names, and their analysis."""

from collections.abc import Sequence
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Complex, Float

from .._errors import ModelError, suggestion
from .._extras import Axes, Panels, needed
from . import realisation, responses
from .eigenmodes import Modes, Shares, energy_shares, modes_of, poles_near, poles_of
from .operating_point import OperatingPoint
from .realisation import Margins, TransferFunction, dc_gain, margins, transfer_function, transmission_zeros


class LinearSystem(eqx.Module):
    """A linear system for small deviations from an operating point: dx/dt = A x + B u, y = C x + D u; see `linearise`.

    - `A`, `B`, `C`, `D`: in the units of states, inputs and outputs; `rates` are the derivatives of the states at the
      operating point, zero at an equilibrium.
    - `states`, `inputs`, `outputs`: names; `unit(name)` is the unit, "" if it is unknown.
    - `sizes`: the nominal sizes of the states, which scale them for eigenvalues and ranks.

    It is a pytree: `jax.vmap` returns a batch, whose `poles` have one more axis; select one system of it by
    `jax.tree_util.tree_map(lambda x: x[i], batch)` for other results. `poles`, `modes`, `participation`, `energy`,
    `frequency_response`, `step_response` and `impulse_response` can be traced and differentiated. Other methods decide
    on ranks and need numbers.
    """

    A: Float[Array, "n n"]
    B: Float[Array, "n m"]
    C: Float[Array, "p n"]
    D: Float[Array, "p m"]
    rates: Float[Array, " n"]
    _point: OperatingPoint | None
    _basis: Float[Array, "all n"] | None  # dy = basis dx, if some of the system's states y are redundant
    states: tuple[str, ...] = eqx.field(static=True)
    inputs: tuple[str, ...] = eqx.field(static=True)
    outputs: tuple[str, ...] = eqx.field(static=True)
    units: tuple[tuple[str, ...], tuple[str, ...], tuple[str, ...]] = eqx.field(static=True)
    sizes: tuple[float, ...] = eqx.field(static=True)
    _independent: tuple[int, ...] = eqx.field(static=True)

    @property
    def _scaled(self) -> tuple[Array, Array, Array, Array]:
        """A, B, C, D for states scaled by their nominal sizes."""
        sizes = np.array(self.sizes)
        return self.A / sizes[:, None] * sizes, self.B / sizes[:, None], self.C * sizes, self.D

    @property
    def poles(self) -> Complex[Array, " n"]:
        """Eigenvalues of A in 1/s, in ascending order of magnitude; differentiable if they are simple."""
        return poles_of(self._scaled[0])

    def poles_near(self, shift: complex = 0.0, count: int = 6) -> Complex[np.ndarray, " count"]:
        """The poles closest to `shift` in 1/s, from sparse factors of A - shift: fast for thousands of states.

        Raises `ArgumentError` if `shift` is a pole itself, such as 0 of a free shaft.
        """
        return poles_near(np.asarray(self._scaled[0]), complex(shift), count)

    @property
    def modes(self) -> Modes:
        """Poles with frequencies, damping, shapes and participation. `print` shows a table."""
        return modes_of(self._scaled[0], np.array(self.sizes), self.states)

    @property
    def participation(self) -> Shares:
        """The share of each state in each mode; see `Modes`."""
        return self.modes.participation

    @property
    def energy(self) -> Shares:
        """The share of each component that stores energy in each mode. `print` shows a table.

        With a mode shape v and the Hessian H of a component's stored energy with respect to the states, v^H H v / 4 is
        its energy in the mode, averaged over a period of an undamped oscillation. The shares refer to
        the sum of absolute values. It is the energy of the deviation, so the shares are meaningful at an
        equilibrium. A component that drives the mode, such as a weight on top of an inverted
        pendulum, has a negative share. A mode without stored energy, such as the angle of a free shaft, has no shares.
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
        """The steady change of each output for a constant change of each input; infinite with an integrator.

        For systems without poles at 0, `frequency_response(0.0)` is the same, and traceable. For an unstable system, it
        is the gain between equilibria, which the system does not reach.
        """
        return dc_gain(self._scaled)

    @property
    def zeros(self) -> Complex[np.ndarray, " zeros"]:
        """Transmission zeros in 1/s: values of s at which [A - s, B; C, D] of the minimal system loses rank."""
        A, B, C, D = self._scaled
        return transmission_zeros((*realisation.minimal(A, B, C), D))

    def transfer_function(self, output: str | None = None, input: str | None = None) -> TransferFunction:
        """Numerator and denominator of a channel without common factors. Names are optional if there is one channel."""
        return transfer_function(self.channel(output, input)._scaled)

    def channel(self, output: str | None = None, input: str | None = None) -> "LinearSystem":
        """The system from one input to one output. Names are optional if there is only one."""
        i, j = self._index(self.outputs, output, "output"), self._index(self.inputs, input, "input")
        units = (self.units[0], (self.units[1][j],), (self.units[2][i],))
        changes = dict(B=self.B[..., j : j + 1], C=self.C[..., i : i + 1, :], D=self.D[..., i : i + 1, j : j + 1])
        return self._replaced(**changes, inputs=(self.inputs[j],), outputs=(self.outputs[i],), units=units)

    def margins(self, output: str | None = None, input: str | None = None) -> Margins:
        """Margins of gain, phase and delay of an opened loop, see `linearise(..., open=...)`, of L(s) = -G(s), with G
        from the input to the output. Names are optional if there is only one.
        """
        A, B, C, D = self.channel(output, input if input is not None else output)._scaled
        return margins((A, B, -C, -D))

    def _index(self, names: Sequence[str], name: str | None, role: str) -> int:
        if name is None and len(names) == 1:
            return 0
        if name is None:
            raise ModelError(f"Name the {role}, one of {', '.join(names) or 'none'}.")
        if name not in names:
            raise ModelError(f"The linear system has no {role} {name!r}.{suggestion(name, names)}")
        return names.index(name)

    @property
    def controllable(self) -> bool:
        """Whether the inputs reach all states; decided in balanced units at a relative size of 1e-12."""
        return realisation.reachable(self._scaled[0], self._scaled[1]).shape[1] == len(self.states)

    @property
    def observable(self) -> bool:
        """Whether the outputs determine all states; decided in balanced units at a relative size of 1e-12."""
        return realisation.reachable(self._scaled[0].T, self._scaled[2].T).shape[1] == len(self.states)

    def minimal(self) -> "LinearSystem":
        """The minimal realisation: the reachable and observable part, in states z[0], z[1], ..."""
        return self._in_other_states(realisation.minimal(*self._scaled[:3]))

    def reduce(self, order: int) -> "LinearSystem":
        """A system of lower order by balanced truncation (Moore 1981).

        The error of the frequency response is at most twice the sum of the omitted `hankel_singular_values`. Raises
        `ModelError` if the minimal system is unstable or has fewer states than `order`.
        """
        return self._in_other_states(realisation.truncated(*self._scaled[:3], order))

    @property
    def hankel_singular_values(self) -> Float[np.ndarray, " states"]:
        """The Hankel singular values of the minimal system in descending order."""
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
        """A `control.StateSpace` of python-control; in names, underscores replace dots, which it does not allow."""
        control = needed("control", "control", "to_control()")
        matrices = [np.asarray(matrix) for matrix in (self.A, self.B, self.C, self.D)]
        names = {
            role: [name.replace(".", "_") for name in getattr(self, role)] for role in ("states", "inputs", "outputs")
        }
        return control.StateSpace(*matrices, **names)

    def plot_bode(self, w: ArrayLike | None = None, axes: Panels | None = None) -> np.ndarray:
        """Plot gains and phases over the frequency, a column for each input; returns the matplotlib axes.

        Gains are in dB of the units of output and input. `w` are angular frequencies in rad/s, by default a decade
        more on either side than those at which the responses bend, and down to -80 dB below the largest gain.
        """
        from .responses import plot_bode

        return plot_bode(self, w, axes)

    def plot_step(self, ts: ArrayLike | None = None, axes: Panels | None = None) -> np.ndarray:
        """Plot the step responses, a row for each unit of the outputs and a column for each input; returns the axes."""
        from .responses import plot_step

        return plot_step(self, ts, axes)

    def plot_poles(self, ax: Axes | None = None) -> Axes:
        """Plot poles (crosses) and transmission zeros (circles) in the complex plane; returns the matplotlib axes."""
        from .responses import plot_poles

        return plot_poles(self, ax)

    def __repr__(self) -> str:
        size = f"{len(self.states)} states, {len(self.inputs)} inputs, {len(self.outputs)} outputs"
        return f"<LinearSystem: {size}>"
