"""The posterior distribution of parameters of a drive, sampled by NUTS, beside the intervals of the fit.

`python -m docs.posterior` prints and draws it.
"""

from pathlib import Path
from typing import Any

import blackjax
import jax
import jax.numpy as jnp
import numpy as np

from acausal import quantity, simulate
from acausal.design import Experiment, Fit, identify
from docs.drive import Drive, drive

TIMES = np.linspace(0.03, 0.36, 12)
CHAINS, WARM, DRAWS = 2, 300, 1000


def fitted() -> Fit[Drive]:
    """The fit to twelve noisy samples of current and angle."""
    true = simulate(drive, float(TIMES[-1]), save=TIMES)
    noise = np.random.default_rng(3).standard_normal((2, len(TIMES)))
    current, angle = true["motor.inductor.i"] + 2.0 * noise[0], true["load.b.phi"] + 0.15 * noise[1]
    run = Experiment.of_run(
        TIMES,
        {"motor.inductor.i": quantity(current, "A"), "load.b.phi": quantity(angle, "rad")},
        sigma={"motor.inductor.i": 2.0, "load.b.phi": 0.15},
    )
    free = {"motor.resistor.R": (0.1, 1.0), "spring.c": (2.0, 50.0), "spring.d": (0.0, 1.0)}
    return identify(drive, free, run)


def sampled(fit: Fit[Any], seed: int) -> np.ndarray:
    """Draws from the posterior distribution by the No-U-Turn sampler, one row for each."""
    warm, run = jax.random.split(jax.random.key(seed))
    start = jnp.asarray(fit.estimates)
    adaptation: Any = blackjax.window_adaptation(blackjax.nuts, fit.log_density)
    (state, settings), _ = adaptation.run(warm, start, num_steps=WARM)
    kernel = blackjax.nuts(fit.log_density, **settings)

    def step(state: Any, key: Any) -> tuple[Any, Any]:
        state, _ = kernel.step(key, state)
        return state, state.position

    return np.asarray(jax.lax.scan(step, state, jax.random.split(run, DRAWS))[1])


def table(fit: Fit[Any], draws: np.ndarray) -> str:
    """Intervals of the fit and of the posterior in display units, and the convergence of the chains."""
    rhat = np.asarray(blackjax.diagnostics.potential_scale_reduction(draws))
    size = np.asarray(blackjax.diagnostics.effective_sample_size(draws))
    lines = [f"{'parameter':18}{'unit':>12}  {'95 % by the fit':>19}  {'95 % by the posterior':>21}   R-hat  draws"]
    ends = np.percentile(draws.reshape(-1, draws.shape[-1]), [2.5, 97.5], axis=0)
    for i, variable in enumerate(fit._free.variables):
        shown = variable.scale.value(np.array([fit.low[i], fit.high[i], *ends[:, i]]))
        fits, posterior = (f"{low:.4g} to {high:.4g}" for low, high in (shown[:2], shown[2:]))
        unit = variable.scale.unit
        lines.append(f"{variable.name:18}{unit:>12}  {fits:>19}  {posterior:>21}  {rhat[i]:6.3f}  {size[i]:5.0f}")
    return "\n".join(lines)


def draw(fit: Fit[Any], draws: np.ndarray, path: Path) -> None:
    """Draws the posterior of each parameter with the normal distribution of the fit, and of a pair."""
    import matplotlib.pyplot as plt

    all_draws = draws.reshape(-1, draws.shape[-1])
    figure, axes = plt.subplots(1, len(fit.names) + 1, figsize=(12.0, 3.0), layout="constrained")
    for i, (ax, variable) in enumerate(zip(axes, fit._free.variables, strict=False)):
        value, std = variable.scale.value, variable.scale.difference(fit.std[i])
        ax.hist(value(all_draws[:, i]), bins=40, density=True, alpha=0.5, label="posterior")
        x = np.linspace(-4.0, 4.0, 200)
        density = np.exp(-0.5 * x**2) / (std * np.sqrt(2.0 * np.pi))
        ax.plot(value(fit.estimates[i]) + std * x, density, "C1", label="fit")
        ax.set_xlabel(variable.scale.headed(variable.name))
        ax.set_yticks([])
    axes[0].legend(frameon=False, fontsize="small")
    pair = [fit._free.variables[i] for i in (1, 2)]
    axes[-1].plot(*(v.scale.value(all_draws[:, i]) for v, i in zip(pair, (1, 2), strict=True)), ".", ms=2, alpha=0.3)
    axes[-1].set_xlabel(pair[0].scale.headed(pair[0].name))
    axes[-1].set_ylabel(pair[1].scale.headed(pair[1].name))
    figure.savefig(path, dpi=100)


def main() -> None:
    """Fits, samples two chains, and prints and draws both."""
    fit = fitted()
    draws = np.stack([sampled(fit, seed) for seed in range(CHAINS)])
    print(table(fit, draws))
    draw(fit, draws, Path("posterior.png"))


if __name__ == "__main__":
    main()
