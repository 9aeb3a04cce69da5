"""The certificate of a design in words and tables."""

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

from ..._analyse.table import aligned
from ..._units.display import Scale
from .entries import Active

if TYPE_CHECKING:
    from .design import Design

SHOWN = 12  # sensitivities in a table


class Section(NamedTuple):
    """A table, its first row the heads, with a heading and notes below."""

    heading: str
    rows: Sequence[Sequence[str]]
    notes: Sequence[str] = ()


def as_text(section: Section) -> str:
    """The aligned table and its notes; its first head says what it contains."""
    return "\n".join([aligned(section.rows), *section.notes])


def sections(design: "Design[Any]") -> Iterator[Section]:
    """Variables, limits, multipliers, sensitivities and other optima, as far as there are any."""
    variables = [_variable_row(design, i) for i in range(len(design.x))]
    notes = [f"without effect: {', '.join(design.idle)}"] if design.idle else []
    yield Section("Variables", [("variable", "value", "from", "to", ""), *variables], notes)
    degenerate = list(_degenerate(design))
    if design.results:
        rows = [result.row() for result in design.results]
        yield Section("Limits", [("limit", "result", "", "margin", ""), *rows], [] if design.active else degenerate)
    if design.active:
        head = ("active", f"multiplier [{design.objective_scale.unit}]", "")
        yield Section("Multipliers", [head, *(_active_row(design, active) for active in design.active)], degenerate)
    if design.sensitivities.rows:
        yield _sensitivities(design)
    if len(design.optima()) > 1:
        yield Section("Other optima", _other_optima(design))


def verdict(design: "Design[Any]") -> str:
    """The status of a design and the reason for it."""
    if design.conflict:
        names = ", ".join(f"{name} ({share:.0%})" for name, share in design.conflict.items())
        return f"infeasible. No design nearby satisfies all limits; in conflict: {names}."
    if design.status == "unbounded":
        return "unbounded: it decreases without limit. Bound the free parameters, or limit a result."
    if design.unexplained:
        text = "; ".join(design.unexplained)
        return (
            f"{design.status}, because derivatives do not describe the results: {text}. Functions that count, round or "
            "jump have no optimum by gradients: compare designs by `sweep` or `choose`, or minimise a smooth result."
        )
    broken = [f"{one.limit.name} ({-one.margin:.1%})" for one in design.results if one.is_broken]
    if broken and design.status == "not converged":
        text = "the search found no feasible design. This one has the smallest violation"
        return f"{design.status}, {text}: {', '.join(broken)}."
    if design.unqualified:
        return (
            f"{design.status}: no constraint qualification holds. The gradients of {', '.join(design.unqualified)} "
            "leave no direction inside these limits, so an optimum here need not have multipliers. Restate the "
            "limits, for example x == 0 instead of x^2 <= 0."
        )
    return f"{design.status}, KKT residual {design.kkt_residual:.1e}, {design.curvature.verdict}"


def effort(design: "Design[Any]") -> str:
    """The number of designs that were computed, the time, and the reasons of failures and of a missing model."""
    failed = f", {len(design.failed)} of which could not be computed" if design.failed else ""
    starts = f"{len(design.others) + 1} starts, " if design.others else ""
    text = f"{starts}{design.total_evaluations} designs{failed}, {design.total_seconds:.1f} s"
    reasons = dict.fromkeys(tried.why for tried in design.failed)
    text += "".join(f"\nstepped back from: {why}" for why in reasons)
    return text + (f"\nno model can be built with these values: {design.unbuilt}" if design.unbuilt else "")


def _variable_row(design: "Design[Any]", i: int) -> tuple[str, ...]:
    variable = design.free.variables[i]
    numbers = (f"{variable.scale.value(x):.6g}" for x in (design.x[i], variable.low, variable.high))
    return variable.name, *numbers, variable.scale.shown


def _active_row(design: "Design[Any]", active: Active) -> tuple[str, ...]:
    return f"{active.name} ({active.side})", f"{design.price(active):.6g}", f"per {active.scale.unit}"


def _degenerate(design: "Design[Any]") -> Iterator[str]:
    """Remarks on active limits without unique multipliers."""
    if design.not_unique:
        names = ", ".join(design.not_unique)
        yield f"multipliers not unique, because the gradients depend on each other: {names}"
    if design.unmoved:
        yield f"active with a zero gradient: {', '.join(design.unmoved)}"


def _sensitivities(design: "Design[Any]") -> Section:
    rows = [
        (
            row.parameter, f"{scale.value(row.value):.5g}", scale.unit,
            f"{design.objective_scale.difference(0.01 * row.value * row.per_unit):+.3g}",
        )
        for row in design.sensitivities.rows[:SHOWN]
        for scale in [Scale.of(row.unit)]
    ]  # fmt: skip
    more = len(design.sensitivities.rows) - SHOWN
    notes = [f"and {more} that matter less"] if more > 0 else []
    head = ("fixed parameter", "value", "", f"1 % more changes the optimum by [{design.objective_scale.unit}]")
    return Section("Sensitivities", [head, *rows], notes)


def _other_optima(design: "Design[Any]") -> list[tuple[str, ...]]:
    scales = [variable.scale for variable in design.free.variables]
    rows = [
        (
            f"{other.objective_scale.value(other.objective):.6g}{other.objective_scale.text}",
            *(f"{scale.value(x):.5g}{scale.text}" for scale, x in zip(scales, other.x, strict=True)),
            other.status,
        )
        for other in design.optima()[1:]
    ]
    return [("other optima", *design.free.names, ""), *rows]
