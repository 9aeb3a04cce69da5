"""A picture of sensitivities."""

from ..._extras import Axes, given_or_new
from ..._units.display import Scale
from .table import SensitivityTable


def plot_sensitivities(table: SensitivityTable, ax: Axes | None, most: int) -> Axes:
    """Bars of the `most` largest changes in per cent for one per cent of a parameter."""
    rows = [row for row in table.rows if row.relative][:most][::-1]
    ax = given_or_new(ax, 7.5, 1.2 + 0.3 * len(rows))
    colours = ["tab:red" if row.relative > 0.0 else "tab:blue" for row in rows]
    ax.barh([row.parameter for row in rows], [row.relative for row in rows], color=colours)
    for i, row in enumerate(rows):
        scale = Scale.of(row.unit)
        ax.annotate(f" {scale.value(row.value):.4g}{scale.text} ", (row.relative, i), va="center", fontsize="small",
                    ha="left" if row.relative > 0.0 else "right")  # fmt: skip
    ax.axvline(0.0, color="black", linewidth=0.8)
    ax.margins(x=0.25)
    ax.set_xlabel(f"change of {table.result} in % for 1 % of the parameter")
    ax.set_title(f"{table.result} = {table.scale.value(table.value):.5g}{table.scale.text}", fontsize="medium")
    ax.grid(axis="x", alpha=0.3)
    return ax
