"""A wheel runs down: its unknown friction is learned, written as a formula, and identified.

`python -m docs.run_down` prints the results and draws them.
"""

import itertools
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import nnls

from acausal import Component, Connections, Scalar, connect, simulate
from acausal.design import Experiment, Training, identify, train
from components.blocks import Network
from components.rotational import Inertia, SmoothLearnedFriction, SmoothStribeckFriction, ViscousFriction

J, W0, REST, SIGMA = 0.01, 100.0, 1.0, 0.2  # kg.m2; start, width of the transition through rest and noise in rad/s
WEIGHTS = ["friction.network.weights"]
TERMS = {"Coulomb": lambda w: 1.0 + 0.0 * w, "viscous": lambda w: w, "quadratic": lambda w: w**2} | {
    f"Stribeck {ws} rad/s": lambda w, ws=ws: np.exp(-((w / ws) ** 2)) for ws in (4, 8, 12, 16, 24)
}


class RunDown(Component):
    """A wheel with learned friction."""

    wheel: Inertia
    friction: SmoothLearnedFriction

    def connections(self) -> Connections:
        return (connect(self.wheel.b, self.friction.flange),)


class Formula(Component):
    """The same wheel with Coulomb, Stribeck and viscous friction."""

    wheel: Inertia
    friction: SmoothStribeckFriction
    bearing: ViscousFriction

    def connections(self) -> Connections:
        return (connect(self.wheel.b, self.friction.flange, self.bearing.flange),)


def untrained(seed: int = 0) -> RunDown:
    """The wheel with a network of one hidden layer and random weights."""
    network = Network.of(8, jax.random.key(seed))
    return RunDown(wheel=Inertia(J=J, w=W0), friction=SmoothLearnedFriction(network=network, T=0.2, ws=10.0, w0=REST))


def true_torque(w: Any) -> Any:
    """The friction of the real wheel, which nothing below knows."""
    return (0.1 + 0.1 * np.exp(-((w / 12.0) ** 2))) * np.tanh(w / REST) + 1.5e-3 * w


TIMES = np.linspace(0.05, 6.0, 120)
EXACT = solve_ivp(lambda t, w: -true_torque(w) / J, (0.0, 6.0), [W0], t_eval=TIMES, rtol=1e-9, atol=1e-9).y[0]
MEASURED = EXACT + SIGMA * np.random.default_rng(0).standard_normal(len(TIMES))  # rad/s


def loss(model: RunDown) -> Scalar:
    """The mean square of the deviation from the measured speeds, over the variance of the noise."""
    speeds = simulate(model, float(TIMES[-1]), save=TIMES)["wheel.w"]
    return jnp.mean(((speeds - MEASURED) / SIGMA) ** 2)


def formulas(model: RunDown) -> list[tuple[float, dict[str, float]]]:
    """For each number of terms, the sum of candidates with positive factors that is nearest to the learned friction:
    the largest deviation in N.m, and the factor of each term.
    """
    w = np.linspace(3.0 * REST, W0, 200)
    torque, best = np.asarray(jax.vmap(model.friction.torque)(jnp.asarray(w))), []
    for number in (1, 2, 3, 4):
        found = []
        for names in itertools.combinations(TERMS, number):
            columns = np.stack([TERMS[name](w) for name in names], axis=1)
            factors = nnls(columns, torque)[0]
            found.append((float(np.max(np.abs(columns @ factors - torque))), dict(zip(names, factors, strict=True))))
        best.append(min(found, key=lambda one: one[0]))
    return best


def draw(found: Training[RunDown], path: Path) -> None:
    """Draws the measured and the learned run-down, and the true and the learned friction."""
    import matplotlib.pyplot as plt

    figure, (left, right) = plt.subplots(1, 2, figsize=(9.0, 3.4), layout="constrained")
    left.plot(TIMES, MEASURED, ".", color="0.5", markersize=3, label="measured")
    for model, style, label in ((untrained(), "C1--", "untrained"), (found.model, "C0", "learned")):
        left.plot(TIMES, simulate(model, float(TIMES[-1]), save=TIMES)["wheel.w"], style, label=label)
        w = np.linspace(0.0, W0, 400)
        right.plot(w, jax.vmap(model.friction.torque)(jnp.asarray(w)), style, label=label)
    right.plot(w, true_torque(w), "k:", label="true")
    for ax, x, y in ((left, "time [s]", "speed [rad/s]"), (right, "speed [rad/s]", "friction torque [N.m]")):
        ax.set_xlabel(x)
        ax.set_ylabel(y)
        ax.legend(frameon=False)
        ax.grid(alpha=0.3)
    figure.savefig(path, dpi=100)


def main() -> None:
    """Trains, finds a formula, and identifies its parameters from all samples and from the fast ones alone."""
    found = train(untrained(), WEIGHTS, loss, steps=150, progress=False)
    print(found)
    draw(found, Path("learn.png"))
    print("\nlargest deviation of a formula from the learned friction, and its terms")
    for deviation, factors in formulas(found.model):
        print(f"{deviation:.4f} N.m  " + ", ".join(f"{factor:.4g} {name}" for name, factor in factors.items()))
    friction = SmoothStribeckFriction(Tc=0.1, Ts=0.15, ws=10.0, w0=REST)
    model = Formula(wheel=Inertia(J=J, w=W0), friction=friction, bearing=ViscousFriction(C=1e-3))
    free = {
        "friction.Tc": (0.0, 1.0),
        "friction.Ts": (0.0, 1.0),
        "friction.ws": ("1 rad/s", "100 rad/s"),
        "bearing.C": (0.0, 0.01),
    }
    for name, count in (("the whole run-down", len(TIMES)), ("the first three seconds", len(TIMES) // 2)):
        data = Experiment.of_run(
            TIMES[:count], {"wheel.w": MEASURED[:count]}, sigma={"wheel.w": SIGMA}, name="run-down"
        )
        fit = identify(model, free, data)
        print(f"\nIdentified from {name}, down to {MEASURED[count - 1]:.0f} rad/s\n{fit}")


if __name__ == "__main__":
    main()
