"""Flow diagram of an energy account: sources on the left, sinks on the right."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ..._errors import ModelError
from ..._extras import Axes, given_or_new
from .energy import EnergyAccount

COLOURS = {
    "supplied": "#0072b2",
    "released": "#009e73",
    "stored": "#009e73",
    "dissipated": "#d55e00",
    "taken up": "#0072b2",
    "lost at events": "#aa3377",
}
LEAST = 0.005  # flows below this fraction of the total energy are merged
GAP, LINE = 0.03, 0.075  # fractions of the height: the gap between flows, and the minimum for a flow with its label
INCHES = 2.6  # height of the total energy
LEFT, MIDDLE, RIGHT, BAR = 0.0, 0.5, 1.0, 0.02  # positions of the bars and their width, as fractions of the width


class Flow(NamedTuple):
    """An amount of energy in J, with the name of its component or event and the kind of flow."""

    name: str
    kind: str
    amount: float


def flows(account: EnergyAccount) -> tuple[list[Flow], list[Flow]]:
    """The sources and the sinks of energy, largest first."""
    found = list(_flows(account))
    sides = [flow for flow in found if flow.kind in _SOURCES], [flow for flow in found if flow.kind not in _SOURCES]
    total = max(sum(flow.amount for flow in side) for side in sides)
    came, went = (_merged(side, LEAST * total) for side in sides)
    return came, went


_SOURCES = ("supplied", "released")


def _flows(account: EnergyAccount) -> Iterator[Flow]:
    for kind, negative, amounts in (
        ("supplied", "taken up", account.supplied),
        ("stored", "released", account.stored),
        ("dissipated", "supplied", account.dissipated),
        ("lost at events", "supplied", account.events),
    ):
        for name, amount in amounts.items():
            value = float(np.asarray(amount))
            if value != 0.0:
                yield Flow(name, kind if value > 0.0 else negative, abs(value))


def _merged(side: list[Flow], least: float) -> list[Flow]:
    large = sorted((flow for flow in side if flow.amount >= least), key=lambda flow: -flow.amount)
    for kind in dict.fromkeys(flow.kind for flow in side):
        small = [flow for flow in side if flow.kind == kind and flow.amount < least]
        if small:
            name = small[0].name if len(small) == 1 else f"{len(small)} others"
            large.append(Flow(name, kind, sum(flow.amount for flow in small)))
    return large


def plot_energy(account: EnergyAccount, ax: Axes | None) -> Axes:
    """See `EnergyAccount.plot`."""
    if np.ndim(account.imbalance):
        raise ModelError("The account belongs to a batch of runs: select one run.")
    came, went = flows(account)
    total = max(sum(flow.amount for flow in came), sum(flow.amount for flow in went))
    if total == 0.0:
        raise ModelError("There is nothing to draw: no energy was supplied, stored or dissipated.")
    heights = [[max(flow.amount / total, LINE) for flow in side] for side in (came, went)]
    tall = max(sum(side) + GAP * (len(side) - 1) for side in heights)
    ax = given_or_new(ax, 7.5, 0.6 + INCHES * tall)
    for side, place in ((came, LEFT), (went, RIGHT)):
        _draw_side(ax, side, place, total)
    ax.fill_between([MIDDLE - BAR, MIDDLE + BAR], -0.5, 0.5, color="0.3", linewidth=0.0)
    ax.text(MIDDLE, 0.53, f"{total:.4g} J", ha="center", va="bottom", fontsize="small")
    ax.set_xlim(-0.55, 1.55)
    ax.axis("off")
    return ax


def _draw_side(ax: Axes, side: list[Flow], place: float, total: float) -> None:
    """Draws a band for each flow, from the bar in the middle to the label of the flow."""
    sign, align = (1.0, "left") if place == RIGHT else (-1.0, "right")
    share = np.linspace(0.0, 1.0, 50)
    x, bend = MIDDLE + sign * BAR + (place - MIDDLE - sign * BAR) * share, share**2 * (3.0 - 2.0 * share)
    slots = [max(flow.amount / total, LINE) for flow in side]
    inner, top = 0.5, (sum(slots) + GAP * (len(side) - 1)) / 2.0
    for flow, slot in zip(side, slots, strict=True):
        height, centre = flow.amount / total, top - slot / 2.0
        upper = inner + (centre + height / 2.0 - inner) * bend
        ax.fill_between(x, upper - height, upper, color=COLOURS[flow.kind], alpha=0.55, linewidth=0.0)
        said = f"{flow.name}: {flow.kind} {flow.amount:.4g} J"
        ax.text(place + sign * 0.015, centre, said, ha=align, va="center", fontsize=8)
        top, inner = top - slot - GAP, inner - height
