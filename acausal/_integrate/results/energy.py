"""The energy account of a run, assembled from the accounts of the components."""

import dataclasses
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Any, NoReturn, Self

import jax
import jax.numpy as jnp
import numpy as np

from ..._declare.array import Array
from ..._declare.component import Component, Energy
from ..._declare.node import Node
from ..._errors import unknown_part
from ..._extras import Axes
from ..._numbers import Numbers, Scalar
from ..._reduce.flatten import children
from ..setup.user_function import NOTHING
from .over_run import OverRun
from .trajectories import over_batch

if TYPE_CHECKING:
    from .solution import Solution


def accounts(view: Node, path: str = "") -> Iterator[tuple[str, Energy]]:
    """The account of every component that has one, at the values in a view of the model.

    The accounts of the members of an array of components are summed.
    """
    if isinstance(view, Component) and type(view).energy is not Component.energy:
        account = view.energy()
        if account is not None:
            yield path, Energy(*(jnp.asarray(item, float) for item in view.shared_energy(account)))
    for part_path, part in children(view, path):
        if isinstance(view, Array):
            yield from _stacked(part, part_path)
        else:
            yield from accounts(part, part_path)


def _stacked(item: Node, path: str) -> Iterator[tuple[str, Energy]]:
    def members(part: Node) -> dict[str, Energy]:
        return dict(accounts(part, path))

    for name, account in jax.vmap(members)(item).items():
        yield name, Energy(*(jnp.sum(value) for value in account))


def powers(view: Node) -> dict[str, tuple[Scalar, Scalar]]:
    """Dissipated and supplied power of each component, in W."""
    return {path: (account.dissipated, account.supplied) for path, account in accounts(view)}


def stored(view: Node) -> dict[str, Scalar]:
    """Stored energy of each component, in J."""
    return {path: account.stored for path, account in accounts(view)}


@jax.tree_util.register_pytree_node_class
class ByPath(dict[str, Any]):
    """Energies by the path of a component, or by the label of an event."""

    def __missing__(self, path: str) -> NoReturn:
        raise unknown_part(path, self, "energy account")

    def tree_flatten(self) -> tuple[list[Any], tuple[str, ...]]:
        """The values and, as static data, the paths."""
        return list(self.values()), tuple(self)

    @classmethod
    def tree_unflatten(cls, paths: tuple[str, ...], values: Iterable[Any]) -> Self:
        """The inverse of `tree_flatten`."""
        return cls(zip(paths, values, strict=True))


@dataclasses.dataclass(frozen=True)
class EnergyAccount:
    """Energy account of a run, in J: supplied = change of stored + dissipated + lost at events.

    The first three are by component, `events` by event. The account begins after the events at the start.

    `print` it for a table. `imbalance` is the difference of both sides, a measure of the integration error.
    """

    supplied: dict[str, Any]
    stored: dict[str, Any]
    dissipated: dict[str, Any]
    events: dict[str, Any] = dataclasses.field(default_factory=dict)

    def __post_init__(self) -> None:
        for field in dataclasses.fields(self):
            object.__setattr__(self, field.name, ByPath(getattr(self, field.name)))

    @property
    def totals(self) -> tuple[Any, Any, Any]:
        """Sums over the components: supplied, stored, dissipated."""
        return sum(self.supplied.values()), sum(self.stored.values()), sum(self.dissipated.values())

    @property
    def imbalance(self) -> jax.Array:
        """The supplied energy minus all others, in J."""
        supplied, stored, dissipated = self.totals
        return supplied - stored - dissipated - sum(self.events.values())

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the sources and sinks of energy as bands of proportional height; returns the matplotlib axes."""
        from .energy_plot import plot_energy

        return plot_energy(self, ax)

    def __str__(self) -> str:
        width = max([len(name) for name in (*self.supplied, *self.events)] + [10])
        lines = [f"{'energy [J]':{width}}  {'supplied':>12}  {'stored':>12}  {'dissipated':>12}"]
        for name in self.supplied:
            numbers = (self.supplied[name], self.stored[name], self.dissipated[name])
            lines.append(f"{name:{width}}  " + "  ".join(_cell(number) for number in numbers))
        lines += [f"{name:{width}}  {'':12}  {'':12}  {_cell(lost)}" for name, lost in self.events.items() if lost != 0]
        supplied, stored, dissipated = self.totals
        columns = (supplied, stored, dissipated + sum(self.events.values()))
        lines.append(f"{'total':{width}}  " + "  ".join(_cell(number) for number in columns))
        return "\n".join([*lines, f"imbalance: {float(self.imbalance):.3g} J"])


def _cell(value: Numbers) -> str:
    number = float(np.asarray(value))
    return f"{number:12.6g}" if number else f"{'':12}"


def energy_of(solution: "Solution") -> EnergyAccount:
    """See `Solution.energy`."""
    requested = {} if solution._integrals_tree == NOTHING else solution._integrals(solution._end_integrals)["energy"]
    integrals = requested or solution._integrals_over_run(powers, alike=True)
    before, after = stored(solution._view(*solution._start)), stored(solution.final)
    events = solution.system.events
    losses = {} if events is None else _by_label(events.labels, solution._losses if requested else _lost(solution))
    return EnergyAccount(
        supplied={name: supplied for name, (_, supplied) in integrals.items()},
        stored={name: after[name] - before[name] for name in integrals},
        dissipated={name: dissipated for name, (dissipated, _) in integrals.items()},
        events=losses,
    )


def _by_label(labels: list[str], losses: jax.Array) -> dict[str, Any]:
    return {label: losses[..., i] for i, label in enumerate(labels)}


def _lost(solution: "Solution") -> jax.Array:
    """The energy lost at each event, from the recorded steps."""
    events, record, history = solution.system.events, solution._record, solution._history
    lost = solution._over_run(lambda s: sum(stored(s).values(), jnp.zeros(())), "energy", OverRun.lost)[0]
    assert events is not None
    assert record is not None
    assert history is not None
    is_listed = np.array([entry.is_listed for entry in events.members], bool)

    def by_event(moments: jax.Array, lost: jax.Array, times: jax.Array, happened: jax.Array) -> jax.Array:
        # An extra row for missing moments: there may be no events, or too many for a traced history, which also lacks
        # periodic events. Most of these lose nothing.
        times, happened = jnp.append(times, jnp.inf), jnp.pad(happened, ((0, 1), (0, 0)))
        rows = jnp.minimum(jnp.searchsorted(times, moments), len(times) - 1)
        first = jnp.argmax(happened[rows] & is_listed, axis=1)
        is_missing = jnp.isfinite(moments) & (times[rows] != moments)
        taken = jnp.where(is_missing & (lost != 0.0), jnp.nan, lost)
        return jnp.zeros(len(is_listed)).at[first].add(taken)

    moments = solution._forward[..., None] * record.moments
    return over_batch(by_event, jnp.ndim(solution.t1))(moments, lost, history.times, history.happened)
