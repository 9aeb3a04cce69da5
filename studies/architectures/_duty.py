"""The duty of all architectures: open in minimum time, hold for 10 s, close along a profile.

During the opening, the demanded position is so far beyond the stroke that every controller saturates. When the stroke
is reached, the demand becomes the stroke. After the hold, it follows the closing profile.
"""

from typing import Any

import jax.numpy as jnp
from jax import Array

from acausal import Component, Connections, Scalar, Solution, connect, replace, simulate
from components.blocks import Output, Step, Sum, TimeSeries
from components.rotational import Polynomial345

from ..actuators import LONGEST, STROKE

HOLD = 10.0  # s
CLOSING = 1.0  # s, with the 3-4-5 polynomial, which starts and ends at rest
SETTLING = 0.2  # s, after the end of the profile
METERED = 0.3  # s, opening along the profile, with partly open valves
BEYOND = 10e-3  # m, above the stroke while it opens
NEVER = 1e3  # s and m, beyond any run
MAX_STEPS = 100_000  # a closed circuit rings at 1.3 kHz after the opening, which takes some 20,000 steps at -30 C


class Demand(Component):
    """The demanded position y: beyond the stroke until `beyond.start_time`, then that of the profile.

    The signal `closes` is 1 from the start of the closing profile.
    """

    beyond: Step
    profile: TimeSeries
    sum: Sum
    closing: Step
    y: Output = Output()
    closes: Output = Output()

    def connections(self) -> Connections:
        return (
            connect(self.beyond.y, self.sum.u1),
            connect(self.profile.y, self.sum.u2),
            connect(self.sum.y, self.y),
            connect(self.closing.y, self.closes),
        )


def demand() -> Demand:
    """The demand during the opening; `whole_duty` sets the times of hold and closing."""
    share = jnp.linspace(0.0, 1.0, 11)
    values = STROKE * (1.0 - Polynomial345().share(share))
    return Demand(
        beyond=Step(offset=BEYOND, height=-BEYOND, start_time=NEVER),
        profile=TimeSeries(times=_closing(NEVER), values=values),
        sum=Sum(),
        closing=Step(height=1.0, start_time=NEVER),
    )


def _closing(opened: Scalar) -> Array:
    return opened + HOLD + CLOSING * jnp.linspace(0.0, 1.0, 11)


def _open_by_profile() -> dict[str, Scalar]:
    share = jnp.linspace(0.0, 1.0, 11)
    return {
        "demand.beyond.start_time": 0.0,
        "demand.profile.times": METERED * share,
        "demand.profile.values": STROKE * Polynomial345().share(share),
    }


def run(
    model: Any, t1: Scalar, level: Scalar, *, rtol: Scalar, save: object = "steps", account: bool = True
) -> Solution:
    """Simulates until the slave has travelled `level` in m, or until t1 in s; one program for opening and whole duty.

    With an energy account, the integral "energy" is the battery energy in J.
    """
    return simulate(
        model, t1, until=lambda s: s.piston.a.s - level, save=save, energy=account, rtol=rtol, throw=False,
        integrals=_battery if account else None, max_events=512, max_steps=MAX_STEPS,
    )  # fmt: skip


def _battery(s: Any) -> dict[str, Scalar]:
    sources = (s.supply, s.battery) if hasattr(s, "battery") else (s.supply,)
    return {"energy": -sum(one.v * one.i for one in sources)}


def open_clutch(model: Component, *, rtol: Scalar, save: object = "steps", account: bool = True) -> Solution:
    """Simulates from rest until the clutch is open."""
    return run(model, LONGEST, STROKE, rtol=rtol, save=save, account=account)


def whole_duty(model: Component, opened: Scalar, *, rtol: Scalar) -> Solution:
    """Simulates opening, which takes the time `opened` in s, hold and closing."""
    times = {
        "demand.beyond.start_time": opened,
        "demand.profile.times": _closing(opened),
        "demand.closing.start_time": opened + HOLD,
    }
    return run(replace(model, times), opened + HOLD + CLOSING + SETTLING, NEVER, rtol=rtol)


def half_open_by_profile(model: Component, *, rtol: Scalar) -> Solution:
    """Simulates to half the stroke, during an opening along the profile in `METERED`."""
    return run(replace(model, _open_by_profile()), LONGEST, 0.5 * STROKE, rtol=rtol)
