"""The discrete states of an FMU as numbers.

An FMU is a machine with memory, but a solver evaluates functions: it rejects steps, searches for events and
differentiates. The discrete states that the FMU has reached are therefore numbered. Each follows from an earlier one at
a point, or from initialisation there. The number is a digest of both, so that it never means another discrete state in
another process. The instance returns to any of them by the FMU's own copy of its state, or by repeating the way to it.
"""

import abc
import hashlib
import threading
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Generic, Literal, NamedTuple, TypeVar

import numpy as np

from ..._errors import ModelError, SimulationError
from .description import Description, ImportedVariable, placed, size_of
from .instance import Instance, unpacked

NONE, FIRST = -1, 0  # numbers before initialisation, and at its end with the start values of the FMU
COPIES = 1000  # largest number of copies of the state of an FMU

A = TypeVar("A")
StateKey = tuple[int, bytes]  # a discrete state for given parameters


class Reached(NamedTuple):
    """A discrete state: the one before it, and the point at which it follows."""

    before: int
    point: np.ndarray


class Machine(abc.ABC, Generic[A]):
    """An instance that goes to any discrete state. `A` is the answer of the FMU when it reaches one."""

    kind: Literal["ModelExchange", "CoSimulation"]

    def __init__(self, path: Path, digest: str, description: Description, fixed: Sequence[float]) -> None:
        interface = description.raw.modelExchange if self.kind == "ModelExchange" else description.raw.coSimulation
        if interface is None:
            other, remedy = (
                ("co-simulation", "FMU(..., step=...) samples it")
                if self.kind == "ModelExchange"
                else ("model exchange", "leave out step")
            )
            raise ModelError(f"{path.name} is for {other} only. Remedy: {remedy}.")
        self.path, self.description, self._digest = path, description, digest
        self.folder = unpacked(path, digest)
        self._copies_state = bool(interface.canGetAndSetFMUstate)
        self._fixed = list(zip(description.fixed, map(np.asarray, fixed), strict=True))
        self._reached: dict[int, Reached] = {}
        self._copies: dict[StateKey, Any] = {}
        self._answers: dict[StateKey, A] = {}
        self._current: StateKey | None = None
        self._lock = threading.RLock()  # an instance serves one thread at a time
        self._instance = Instance(self.folder, description, self.kind)

    @property
    def n_parameters(self) -> int:
        """The number of parameters."""
        return size_of(self.description.parameters)

    @abc.abstractmethod
    def _advance(self, to: Reached, parameters: list[tuple[ImportedVariable, np.ndarray]]) -> A:
        """Bring the instance from the discrete state before to this one; initialise it if there is none before."""

    def _next(self, number: int, point: np.ndarray, parameters: np.ndarray) -> tuple[int, A]:
        """The number of the discrete state that follows at a point, and the answer of the FMU."""
        text = f"{self._digest} {number} {point.tobytes().hex()}"
        new = 1 + int.from_bytes(hashlib.sha256(text.encode()).digest()[:6], "big")  # exact as a float
        self._reached.setdefault(new, Reached(number, point.copy()))
        return new, self._go(new, parameters)

    def _go(self, number: int, parameters: np.ndarray) -> A:
        """Bring the instance to a discrete state, from the last one on the way there of which there is a copy."""
        text = parameters.tobytes()
        chain = [number]
        while (chain[-1], text) not in self._copies and (chain[-1], text) != self._current:
            before = self._before(chain[-1])
            if before == NONE:
                break
            chain.append(before)
        for step in reversed(chain):
            self._reach((step, text), parameters)
        return self._answers[number, text]

    def _before(self, number: int) -> int:
        if number not in self._reached:
            raise SimulationError(
                f"{self.path.name} has not reached the discrete state of this model in this process, where the "
                "state of an FMU is kept. Remedy: start from the model before its run."
            )
        return self._reached[number].before

    def _reach(self, key: StateKey, parameters: np.ndarray) -> None:
        if key == self._current:
            return
        self._current = None
        if key in self._copies:
            self._instance.fmu.setFMUState(self._copies[key])
        else:
            self._answers[key] = self._advance(self._reached[key[0]], self._settings(parameters))
            self._keep(key)
        self._current = key

    def _settings(self, parameters: np.ndarray) -> list[tuple[ImportedVariable, np.ndarray]]:
        own = [(v, parameters[place : place + v.count]) for v, place in placed(self.description.parameters)]
        return [*self._fixed, *own]

    def _keep(self, key: StateKey) -> None:
        """Copy the state of the FMU, if it can."""
        if not self._copies_state:
            return
        if len(self._copies) >= COPIES:
            self._instance.fmu.freeFMUState(self._copies.pop(next(iter(self._copies))))
        self._copies[key] = self._instance.fmu.getFMUState()
