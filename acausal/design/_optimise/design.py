"""An optimal design with its certificate."""

import dataclasses
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Generic, Literal, TypeVar

import numpy as np

from ..._declare.component import Component
from ..._errors import ModelError, ParameterError
from ..._extras import Figure
from ..._report import Table, drawn, model_parts, report
from ..._save_load import load, save
from ..._units.display import Scale
from .._certificate.second_order import Curvature
from .._problem.free import Free
from .._sensitivity.sensitivities import SensitivityTable
from .certificate_text import as_text, effort, sections, verdict
from .entries import Active, LimitedResult, Tried

M = TypeVar("M", bound=Component, covariant=True)
Status = Literal["optimal", "stationary", "infeasible", "unbounded", "interrupted", "not converged"]


@dataclasses.dataclass(frozen=True)
class Design(Generic[M]):
    """The result of an optimisation; `print` it for its certificate.

    Parameters are in their declared units, results in SI units or in the units that their functions return.

    - `model`: the model with the optimal values; `values`: these by name. If a component refuses them, there is no
      model, and `unbuilt` is the reason. Runs that set other values themselves do not notice this.
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
    - `unexplained`: changes of results near the design that their derivatives do not explain, because the results
      count, round or jump. The conditions of an optimum then prove nothing, and the status is "not converged".
    - `idle`: variables without effect, during the search and at other values. They keep their values.
    - `curvature`: scaled eigenvalues of the Hessian of the Lagrangian in the free directions.
    - `sensitivities`: table of the derivatives of the optimum with respect to the fixed parameters, the free ones
      reoptimised.
    - `history` and `failed`: iterates, and designs that could not be computed, in `evaluations` and `seconds`.
    - `others`: results of the searches from other starts. All searches took `total_evaluations` and `total_seconds`,
      including compilation.
    """

    _model: M | None
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
    sensitivities: SensitivityTable
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
    unexplained: tuple[str, ...] = ()
    unbuilt: str = ""

    @property
    def model(self) -> M:
        """The model with the optimal values. Raises `ParameterError` if it cannot be built."""
        if self._model is None:
            raise ParameterError(f"No model can be built with {self.free.text(self.x)}: {self.unbuilt}")
        return self._model

    @property
    def values(self) -> dict[str, float]:
        """The optimal values of the free parameters by name, in the declared units."""
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
        from .design_plots import plot_design

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
        return f"<Design of {self._name}: {self.status}, {self._objective}>"

    def __str__(self) -> str:
        return "\n\n".join([f"{self._objective}: {verdict(self)}", *map(as_text, sections(self)), effort(self)])

    def html(self, path: str | os.PathLike[str] | None = None) -> str:
        """A report as one HTML file that loads nothing from elsewhere; returns its text, and writes it to a path.

        It has the certificate with all its tables, the picture of `plot`, all parameters, and the versions and the
        fingerprint that identify the design. `report` combines several results.
        """
        return report(f"Design of {self._name}", self._report(), path)

    def _report(self) -> dict[str, object]:
        found: dict[str, object] = {"Certificate": f"{self._objective}: {verdict(self)}\n{effort(self)}"}
        for section in sections(self):
            found[section.heading] = [Table(section.rows[0], section.rows[1:]), "\n".join(section.notes)]
        if self.history:
            found["Search"] = drawn(self.plot)
        return found | ({} if self._model is None else model_parts(self._model))

    @property
    def _name(self) -> str:
        return "no model" if self._model is None else type(self._model).__name__

    @property
    def _objective(self) -> str:
        return f"{self.objective_name} {self.objective_scale.value(self.objective):.6g}{self.objective_scale.text}"
