"""What a solver that wraps another one has of it."""

from typing import Any

import diffrax


class Wrapper(diffrax.AbstractAdaptiveSolver, diffrax.AbstractWrappedSolver):
    """A solver that takes the steps of `solver`, and does more."""

    solver: Any

    @property
    def term_structure(self) -> Any:  # pyright: ignore[reportIncompatibleVariableOverride]
        return self.solver.term_structure

    @property
    def term_compatible_contr_kwargs(self) -> Any:  # pyright: ignore[reportIncompatibleVariableOverride]
        return self.solver.term_compatible_contr_kwargs

    @property
    def root_finder(self) -> Any:
        return self.solver.root_finder

    @property
    def scan_kind(self) -> Any:
        return self.solver.scan_kind

    def order(self, terms: Any) -> Any:
        return self.solver.order(terms)

    def error_order(self, terms: Any) -> int:
        return self.solver.error_order(terms)
