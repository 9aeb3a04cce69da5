"""Responses of a linear system in time and frequency, traceable, and their pictures."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import ArrayLike

from .._errors import ModelError
from .._extras import Axes, Panels, given_or_new, panels
from .._interpret.in_parts import in_parts

if TYPE_CHECKING:
    from .linear_system import LinearSystem


SQUARINGS = 64  # maximum in the matrix exponential: enough for all time scales in double precision

Matrices = tuple[Array, Array, Array, Array]


def frequency(matrices: Matrices, w: Array) -> Array:
    """C (i w - A)^-1 B + D for each element of `w`."""
    A, B, C, D = matrices

    def at(w: Array) -> Array:
        return C @ jnp.linalg.solve(1j * w * jnp.eye(len(A)) - A, B + 0j) + D

    return jax.vmap(at)(w.reshape(-1)).reshape(*w.shape, *D.shape)


def step(matrices: Matrices, ts: Array) -> Array:
    """C int_0^t exp(A s) ds B + D; the integral is a block of exp([A, B; 0, 0] t)."""
    A, B, C, D = matrices
    n, m = B.shape
    augmented = jnp.zeros((n + m, n + m)).at[:n, :n].set(A).at[:n, n:].set(B)
    return _at_times(lambda t: C @ _exponential(augmented * t)[:n, n:] + D, ts)


def impulse(matrices: Matrices, ts: Array) -> Array:
    """C exp(A t) B."""
    A, B, C, _ = matrices
    return _at_times(lambda t: C @ _exponential(A * t) @ B, ts)


def _exponential(matrix: Array) -> Array:
    return jax.scipy.linalg.expm(matrix, max_squarings=SQUARINGS) if matrix.shape[0] else matrix


def _at_times(function: Callable[[Any], Any], ts: Array) -> Array:
    if ts.ndim != 1:
        raise ModelError(f"The times of a response are a vector of seconds, not an array of shape {ts.shape}.")
    return in_parts(jax.vmap(function))(ts)


PANEL = (4.6, 2.1)  # inches, width and height of a panel
POINTS = 600
BEND = 2.0  # deg, change of the phase that counts as a bend
FLOOR = 1e-4  # smallest gain in a plot, relative to the largest one


def plot_bode(system: "LinearSystem", w: ArrayLike | None, axes: Panels | None) -> np.ndarray:
    """Gain over phase, a column for each input; see `LinearSystem.plot_bode`."""
    _check_channels(system)
    if w is None:
        w = _range_of_interest(_frequencies(system), system)
    w = np.asarray(w, float)
    response = np.asarray(system.frequency_response(w))
    axes = _panels(axes, 2, len(system.inputs))
    for j, name in enumerate(system.inputs):
        for i, output in enumerate(system.outputs):
            phase = np.degrees(np.unwrap(np.angle(response[:, i, j])))
            # The branch whose low-frequency end is nearest to zero.
            phase -= 360.0 * np.round(phase[0] / 360.0)
            with np.errstate(divide="ignore"):
                gain = 20.0 * np.log10(np.abs(response[:, i, j]))
            axes[0, j].semilogx(w / (2 * np.pi), gain, label=_labelled(system, output))
            axes[1, j].semilogx(w / (2 * np.pi), phase)
        axes[0, j].set_title(f"from {_labelled(system, name)}", fontsize="medium")
        axes[0, j].set_ylabel("gain [dB]")
        axes[0, j].legend(loc="best", fontsize="small", frameon=False)
        axes[1, j].set_ylabel("phase [°]")
        axes[1, j].yaxis.set_major_locator(_locator())
        axes[1, j].set_xlabel("frequency [Hz]")
    return _with_grid(axes)


def plot_step(system: "LinearSystem", ts: ArrayLike | None, axes: Panels | None) -> np.ndarray:
    """A row for each unit, a column for each input; see `LinearSystem.plot_step`."""
    _check_channels(system)
    ts = np.linspace(0.0, _duration(system), POINTS) if ts is None else np.asarray(ts, float)
    response = np.asarray(system.step_response(ts))
    units = list(dict.fromkeys(system.unit(output) for output in system.outputs))
    axes = _panels(axes, len(units), len(system.inputs))
    for j, name in enumerate(system.inputs):
        for i, output in enumerate(system.outputs):
            axes[units.index(system.unit(output)), j].plot(ts, response[:, i, j], label=output)
        axes[0, j].set_title(f"{name} rises by 1 {system.unit(name)}".rstrip(), fontsize="medium")
        for ax, unit in zip(axes[:, j], units, strict=True):
            ax.set_ylabel(f"change [{unit}]" if unit else "change")
            ax.legend(loc="best", fontsize="small", frameon=False)
        axes[-1, j].set_xlabel("time [s]")
    return _with_grid(axes)


def plot_poles(system: "LinearSystem", ax: Axes | None) -> Axes:
    """Crosses and circles; see `LinearSystem.plot_poles`."""
    poles: Any = np.asarray(system.poles)
    zeros: Any = system.zeros if system.inputs and system.outputs else np.zeros(0, complex)
    ax = given_or_new(ax, 5.6, 4.2)
    ax.axhline(0.0, color="0.6", linewidth=0.8, zorder=0)
    ax.axvline(0.0, color="0.6", linewidth=0.8, zorder=0)
    ax.plot(poles.real, poles.imag, "x", color="tab:blue", markersize=8, markeredgewidth=1.8, label="poles")
    if len(zeros):
        ax.plot(zeros.real, zeros.imag, "o", color="tab:red", markersize=8, fillstyle="none", label="zeros")
    _spread(ax, np.concatenate([poles, zeros]))
    ax.set_xlabel("real part [1/s]")
    ax.set_ylabel("imaginary part [rad/s]")
    ax.set_title("poles and transmission zeros" if len(zeros) else "poles", fontsize="medium")
    if len(zeros):
        ax.legend(loc="best", fontsize="small", frameon=False)
    ax.grid(alpha=0.3)
    return ax


def _spread(ax: Axes, points: Any) -> None:
    """Axes that are linear near the origin and logarithmic beyond, if a linear axis would hide the slow poles."""
    sizes = _sizes(points)
    if len(sizes) and sizes[-1] > 30.0 * sizes[0]:
        threshold = 10.0 ** np.floor(np.log10(sizes[0]))
        ax.set_xscale("symlog", linthresh=threshold)
        if np.any(points.imag):
            ax.set_yscale("symlog", linthresh=threshold)


def _sizes(points: Any) -> np.ndarray:
    """The magnitudes of nonzero poles and zeros, in ascending order."""
    sizes = np.sort(np.abs(points))
    return sizes[sizes > 1e-9 * np.max(sizes, initial=0.0)]


def _frequencies(system: "LinearSystem") -> np.ndarray:
    """From a decade below the slowest to a decade above the fastest pole or zero, in rad/s; dense near the poles."""
    poles, zeros = np.asarray(system.poles), system.zeros
    sizes = _sizes(np.concatenate([poles, zeros]))
    low, high = (sizes[0] / 10.0, sizes[-1] * 10.0) if len(sizes) else (0.1, 10.0)
    turns = [np.abs(point) for point in (*poles, *zeros) if point.imag > 0.0]
    grid = np.geomspace(low, high, POINTS)
    near = [size * (1.0 + np.sign(s) * s**2) for size in turns for s in np.linspace(-0.3, 0.3, 61) if s != 0.0]
    return np.sort(np.concatenate([grid, near]))


def _range_of_interest(w: np.ndarray, system: "LinearSystem") -> np.ndarray:
    """The frequencies from a decade below to a decade above those at which a response bends, up to a gain of -80 dB
    relative to the largest one: poles that no output shows do not widen it.
    """
    response: Any = np.asarray(system.frequency_response(w)).reshape(len(w), -1)
    response = response[:, np.any(response != 0.0, axis=0)]
    if not response.shape[1]:
        return w
    phase, level = np.degrees(np.unwrap(np.angle(response), axis=0)), np.abs(response)
    first, last = (np.any(np.abs(phase - phase[end]) > BEND, axis=1) for end in (0, -1))
    low = w[np.argmax(first)] / 10.0 if first.any() else w[0]
    high = 10.0 * w[len(w) - 1 - np.argmax(last[::-1])] if last.any() else w[-1]
    here = w >= low
    is_seen = np.any(level >= FLOOR * np.max(level[here], axis=0), axis=1)
    high = min(high, w[np.flatnonzero(is_seen & here)[-1]])
    return w[here & (w <= high)]


def _duration(system: "LinearSystem") -> float:
    """Five time constants of the slowest decaying mode, or ten periods of the slowest mode if none decays."""
    poles: Any = np.asarray(system.poles)
    sizes = _sizes(poles)
    decays = -poles.real[poles.real < -1e-9 * np.max(np.abs(poles), initial=0.0)]
    if len(decays):
        return float(5.0 / np.min(decays))
    return float(20.0 * np.pi / sizes[0]) if len(sizes) else 1.0


def _check_channels(system: "LinearSystem") -> None:
    if not system.inputs or not system.outputs:
        raise ModelError("There is no channel to plot: call linearise(model, inputs=[...], outputs=[...]).")


def _panels(axes: Panels | None, rows: int, columns: int) -> np.ndarray:
    return panels(axes, rows, columns, (PANEL[0] * columns + 1.0, PANEL[1] * rows + 0.6), sharex=True)


def _labelled(system: "LinearSystem", name: str) -> str:
    return f"{name} [{system.unit(name)}]" if system.unit(name) else name


def _locator() -> Any:
    """Ticks at 45, 90 or 180 degrees."""
    from matplotlib.ticker import MaxNLocator

    return MaxNLocator(nbins=6, steps=[1, 1.5, 1.8, 3, 4.5, 9, 10])


def _with_grid(axes: np.ndarray) -> np.ndarray:
    for ax in axes.ravel():
        ax.grid(alpha=0.3)
    return axes
