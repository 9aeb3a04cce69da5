"""Runs by stored programs."""

import dataclasses
from typing import Any

import diffrax

from .._fingerprint import NoFingerprintError
from . import run as traced
from .field import Given
from .made_from import digest_of
from .settings import Settings
from .solution import Solution
from .stored_program import result_of


def run(settings: Settings, given: Given) -> Solution:
    """As `run.run`, where possible by a stored program."""
    return result_of(_Run(settings), given)


@dataclasses.dataclass(frozen=True)
class _Run:
    """`run.run` as a function of numbers alone."""

    settings: Settings

    @property
    def name(self) -> str:
        return "run"

    def __call__(self, given: Given) -> Solution:
        return traced.run(self.settings, given)

    def contents(self, given: Given) -> list[object]:
        settings = self.settings
        if settings.adjoint is not None or not isinstance(settings.progress, diffrax.NoProgressMeter):
            raise NoFingerprintError("a way of differentiating, or a meter of progress")
        functions = (settings.stop, settings.integrand, settings.peaks, settings.stored)
        seen = ("system", "stop", "integrand", "peaks", "stored", "adjoint", "progress")
        return [
            given.inputs.given,  # the leaves whose start values are given
            digest_of(settings.system),
            *(None if f is None else (f.closed, f.leaves) for f in functions),
            *(getattr(settings, field.name) for field in dataclasses.fields(settings) if field.name not in seen),
        ]

    def held(self) -> dict[str, Any]:
        settings = self.settings
        return {
            "system": settings.system,
            "peaks": None if settings.peaks is None else settings.peaks.tree,
            "integrals": None if settings.integrand is None else settings.integrand.tree,
        }
