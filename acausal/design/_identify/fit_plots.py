"""Pictures of a fit and of a profile likelihood."""

from typing import Any

import numpy as np
from scipy.special import ndtri

from ..._extras import Axes, Panels, given_or_new, panels
from .entries import Channel
from .fit import Fit
from .profile import Profile


def plot_fit(fit: Fit[Any], axes: Panels | None) -> np.ndarray:
    """Measured values as dots and the fitted model as a line; as two sets of marks without times."""
    axes = _panels(axes, len(fit.channels), 1)
    for ax, channel in zip(axes[:, 0], fit.channels, strict=True):
        predicted, scale = fit.predicted[channel.label], channel.scale
        x = np.arange(1, len(predicted) + 1) if channel.times is None else channel.times
        ax.plot(x, scale.value(channel.measured), ".", color="0.45", markersize=4, label="measured")
        ax.plot(x, scale.value(predicted), "_" if channel.times is None else "-", color="tab:blue", label="fitted")
        ax.set_ylabel(scale.headed(channel.name), fontsize="small")
        ax.set_xlabel("number" if channel.times is None else "time [s]")
        ax.set_title(channel.experiment, fontsize="small")
        ax.legend(loc="best", fontsize="small", frameon=False)
        ax.grid(alpha=0.3)
    return axes


def plot_residuals(fit: Fit[Any], axes: Panels | None) -> np.ndarray:
    """A row for each channel: residuals in order, and their quantiles over those of the normal distribution."""
    axes = _panels(axes, len(fit.channels), 2)
    for (left, right), channel in zip(axes, fit.channels, strict=True):
        residuals = fit.residuals[channel.label]
        _draw_order(left, channel, residuals)
        residuals = residuals[np.isfinite(residuals)]
        quantiles = ndtri((np.arange(len(residuals)) + 0.5) / len(residuals))
        right.plot(quantiles, np.sort(residuals), ".", color="tab:blue", markersize=4)
        right.axline((0.0, 0.0), slope=1.0, color="0.5", linewidth=0.8)
        right.set_xlabel("quantile of the normal distribution")
        right.set_ylabel("residual / σ")
        right.grid(alpha=0.3)
    return axes


def _draw_order(ax: Axes, channel: Channel, residuals: np.ndarray) -> None:
    x = np.arange(1, len(residuals) + 1) if channel.times is None else channel.times
    ax.axhspan(-2.0, 2.0, color="tab:blue", alpha=0.08, linewidth=0)
    ax.axhline(0.0, color="0.5", linewidth=0.8)
    ax.plot(x, residuals, ".", color="tab:blue", markersize=4)
    ax.set_xlabel("number" if channel.times is None else "time [s]")
    ax.set_ylabel("residual / σ")
    ax.set_title(channel.label, fontsize="small")
    ax.grid(alpha=0.3)


def plot_correlation(fit: Fit[Any], ax: Axes | None) -> Axes:
    """A square for each pair, blue for negative and red for positive correlation."""
    n = len(fit.names)
    ax = given_or_new(ax, 2.6 + 0.6 * n, 1.8 + 0.6 * n)
    correlation = fit.correlation
    ax.imshow(correlation, cmap="RdBu_r", vmin=-1.0, vmax=1.0)
    for i, j in np.ndindex(n, n):
        value = correlation[i, j]
        if np.isfinite(value):
            colour = "white" if abs(value) > 0.6 else "black"
            ax.text(j, i, f"{value:.2f}", ha="center", va="center", fontsize="small", color=colour)
    ax.set_xticks(range(n), fit.names, rotation=35, ha="right", fontsize="small")
    ax.set_yticks(range(n), fit.names, fontsize="small")
    ax.set_title("correlation of the estimates", fontsize="medium")
    return ax


def plot_profile(profile: Profile, ax: Axes | None) -> Axes:
    """chi2 over the parameter, with the threshold and the interval."""
    ax = given_or_new(ax, 5.5, 3.5)
    value = profile.scale.value
    ax.plot(value(profile.values), profile.chi2, ".-", color="tab:blue")
    ax.axhline(profile.threshold, color="0.4", linewidth=0.8, linestyle="--")
    low, high = max(profile.low, profile.values[0]), min(profile.high, profile.values[-1])
    ax.axvspan(value(low), value(high), color="tab:blue", alpha=0.1, linewidth=0, label=f"{100 * profile.level:g} %")
    ax.set_xlabel(profile.scale.headed(profile.name))
    ax.set_ylabel("χ², the others fitted")
    ax.legend(loc="best", fontsize="small", frameon=False)
    ax.grid(alpha=0.3)
    return ax


def _panels(axes: Panels | None, rows: int, columns: int) -> np.ndarray:
    return panels(axes, rows, columns, (4.4 * columns + 1.6, 2.2 * rows + 0.4))
