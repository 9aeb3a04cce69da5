"""An optimal design with its certificate."""

import dataclasses
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Generic, Literal, TypeVar

import numpy as np

from ..._analyse.table import aligned
from ..._declare.component import Component
from ..._errors import ModelError
from ..._extras import Figure
from ..._save_load import load, save
from ..._units.display import Scale
from .._certificate.curvature import Curvature
from .._problem.free import Free
from .entries import Active, LimitedResult, Sensitivity, Tried

M = TypeVar("M", bound=Component, covariant=True)
Status = Literal["optimal", "stationary", "infeasible", "unbounded", "interrupted", "not converged"]
SHOWN = 12  # sensitivities in a table


@dataclasses.dataclass(frozen=True)
class Design(Generic[M]):
    """The result of an optimisation; `print` it for its certificate.

    Parameters are in their declared units, results in SI units or in the units that their functions return.

    - `model`: the model with the optimal values; `values`: these by name.
    - `status`: "optimal" (first- and second-order conditions hold), "stationary" (first-order conditions hold),
      "infeasible" (no design nearby satisfies all limits; this one has the smallest violation, and `conflict` holds the
      shares of the limits in conflict), "unbounded" (the objective decreases without limit), "interrupted" or
      "not converged".
    - `kkt_residual`: residual of the first-order conditions, with objective, limits and ranges scaled to 1.
    - `active`: active limits and bounds with their multipliers.
    - `not_unique`: those with multipliers that are not unique because their gradients are linearly dependent, such as
      two equal limits or limits that touch.
    - `unmoved`: active limits with a zero gradient. They have no multiplier.
    - `unqualified`: active limits that violate the constraint qualification of Mangasarian and Fromovitz, if no
      moderate multipliers satisfy the first-order conditions. An optimum at such limits need not have multipliers.
    - `idle`: variables without effect, during the search and at other values. They keep their values.
    - `curvature`: scaled eigenvalues of the Hessian of the Lagrangian in the free directions.
    - `sensitivities`: derivatives of the optimum with respect to the fixed parameters.
    - `history` and `failed`: iterates, and designs that could not be computed, in `evaluations` and `seconds`.
    - `others`: results of the searches from other starts. All searches took `total_evaluations` and `total_seconds`,
      including compilation.
    """

    model: M
    free: Free
    x: np.ndarray
    start: np.ndarray
    status: Status
    objective_name: str
    objective_scale: Scale
    objective: float
    results: tuple[LimitedResult, ...]
    kkt_residual: float
    active: tuple[Active, ...]
    curvature: Curvature
    conflict: Mapping[str, float]
    sensitivities: tuple[Sensitivity, ...]
    history: tuple[Tried, ...]
    failed: tuple[Tried, ...]
    evaluations: int
    seconds: float
    others: tuple["Design[M]", ...] = ()
    total_evaluations: int = 0
    total_seconds: float = 0.0
    seconds_evaluating: float = 0.0
    not_unique: tuple[str, ...] = ()
    idle: tuple[str, ...] = ()
    unmoved: tuple[str, ...] = ()
    unqualified: tuple[str, ...] = ()

    @property
    def values(self) -> dict[str, float]:
        return dict(zip(self.free.names, self.x.tolist(), strict=True))

    @property
    def multipliers(self) -> dict[str, float]:
        """Multipliers of active limits and bounds by name; those of bounds by the name of the variable."""
        return {active.name: active.multiplier for active in self.active}

    def price(self, active: Active) -> float:
        """The multiplier of an active limit or bound in display units: ms per bar instead of s per Pa."""
        return active.multiplier * active.scale.factor / self.objective_scale.factor

    def optima(self, tolerance: float = 1e-4) -> list["Design[M]"]:
        """The different optima of all starts, the best one first; `tolerance` applies to scaled values."""
        found: list[Design[M]] = []
        for design in (self, *self.others):
            z = np.asarray(self.free.scaled(design.x))
            if all(np.max(np.abs(z - np.asarray(self.free.scaled(other.x)))) > tolerance for other in found):
                found.append(design)
        return found

    def plot(self) -> Figure:
        """Draws variables, objective and margins over the steps of the search; returns the matplotlib figure."""
        from .plots import plot_design

        return plot_design(self)

    def save(self, path: str | Path) -> None:
        """Writes the design with its model, certificate and history to a file, as `acausal.save` does."""
        save(path, self)

    @staticmethod
    def load(path: str | Path) -> "Design[Any]":
        """Reads a design from a file. A file can contain code: open only files that you trust.

        Raises `ModelError` for a file of anything else, and the errors of `acausal.load`.
        """
        try:
            found = load(path)
        except ModelError as error:
            raise ModelError(f"{path} holds no readable design. {error}") from error
        if not isinstance(found, Design):
            raise ModelError(f"{path} holds a {type(found).__name__} instead of a design.")
        return found

    def _described(self) -> dict[str, Any]:
        """Description for the header of a file."""
        units = dict(zip(self.free.names, self.free.units, strict=True))
        values = {name: {"value": value, "unit": units[name]} for name, value in self.values.items()}
        return {"status": self.status, "objective": self._objective, "values": values}

    def __repr__(self) -> str:
        return f"<Design of {type(self.model).__name__}: {self.status}, {self._objective}>"

    def __str__(self) -> str:
        return "\n".join(self._lines())

    @property
    def _objective(self) -> str:
        return f"{self.objective_name} {self.objective_scale.value(self.objective):.6g}{self.objective_scale.text}"

    def _lines(self) -> Iterator[str]:
        yield f"{self._objective}: {self._verdict}"
        yield ""
        yield aligned([("variable", "value", "from", "to", ""), *map(self._variable_row, range(len(self.x)))])
        if self.idle:
            yield f"without effect: {', '.join(self.idle)}"
        if self.results:
            yield ""
            yield aligned([("limit", "result", "", "margin", ""), *(result.row() for result in self.results)])
        if self.active:
            yield ""
            head = ("active", f"one unit more buys [{self.objective_scale.unit}]", "")
            yield aligned([head, *map(self._active_row, self.active)])
        if self.not_unique:
            yield f"multipliers not unique, because the gradients depend on each other: {', '.join(self.not_unique)}"
        if self.unmoved:
            yield f"active with a zero gradient: {', '.join(self.unmoved)}"
        if self.sensitivities:
            yield ""
            yield self._sensitivity_table()
        if len(self.optima()) > 1:
            yield ""
            yield self._table_of_optima()
        yield ""
        yield self._effort

    @property
    def _verdict(self) -> str:
        if self.conflict:
            names = ", ".join(f"{name} ({share:.0%})" for name, share in self.conflict.items())
            return f"infeasible. No design nearby satisfies all limits; in conflict: {names}."
        if self.status == "unbounded":
            return "unbounded: it decreases without limit. Bound the free parameters, or limit a result."
        broken = [f"{one.limit.name} ({-one.margin:.1%})" for one in self.results if one.is_broken]
        if broken and self.status == "not converged":
            text = "the search found no feasible design. This one has the smallest violation"
            return f"{self.status}, {text}: {', '.join(broken)}."
        if self.unqualified:
            return (
                f"{self.status}: no constraint qualification holds. The gradients of {', '.join(self.unqualified)} "
                "leave no direction inside these limits, so an optimum here need not have multipliers. Restate the "
                "limits, for example x == 0 instead of x^2 <= 0."
            )
        return f"{self.status}, KKT residual {self.kkt_residual:.1e}, {self.curvature.verdict}"

    def _variable_row(self, i: int) -> tuple[str, ...]:
        variable = self.free.variables[i]
        numbers = (f"{variable.scale.value(x):.6g}" for x in (self.x[i], variable.low, variable.high))
        return variable.name, *numbers, variable.scale.shown

    def _active_row(self, active: Active) -> tuple[str, ...]:
        return f"{active.name} ({active.side})", f"{self.price(active):.6g}", f"per {active.scale.unit}"

    def _sensitivity_table(self) -> str:
        ranked = sorted(self.sensitivities, key=lambda row: -abs(row.per_percent))
        rows = [
            (
                row.path, f"{scale.value(row.value):.5g}", scale.unit,
                f"{self.objective_scale.difference(row.per_percent):+.3g}",
            )
            for row in ranked[:SHOWN]
            for scale in [Scale.of(row.unit)]
        ]  # fmt: skip
        more = f"\nand {len(ranked) - SHOWN} that matter less" if len(ranked) > SHOWN else ""
        head = ("fixed parameter", "value", "", f"1 % more changes the optimum by [{self.objective_scale.unit}]")
        return aligned([head, *rows]) + more

    def _table_of_optima(self) -> str:
        scales = [variable.scale for variable in self.free.variables]
        rows = [
            (
                f"{design.objective_scale.value(design.objective):.6g}{design.objective_scale.text}",
                *(f"{scale.value(x):.5g}{scale.text}" for scale, x in zip(scales, design.x, strict=True)),
                design.status,
            )
            for design in self.optima()[1:]
        ]
        return aligned([("other optima", *self.free.names, ""), *rows])

    @property
    def _effort(self) -> str:
        failed = f", {len(self.failed)} of which could not be computed" if self.failed else ""
        starts = f"{len(self.others) + 1} starts, " if self.others else ""
        text = f"{starts}{self.total_evaluations} designs{failed}, {self.total_seconds:.1f} s"
        if self.failed:
            reasons = dict.fromkeys(tried.why for tried in self.failed)
            text += "".join(f"\nstepped back from: {why}" for why in reasons)
        return text
