"""An instance of an FMU behind one interface for FMI 2.0 and 3.0."""

import abc
import atexit
import ctypes
import functools as ft
import hashlib
import tempfile
import threading
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Generic, Literal, NamedTuple, TypeVar
from xml.etree import ElementTree

import numpy as np

from ..._errors import ModelError, SimulationError
from ..._extras import needed
from .description import REAL, Description, ImportedVariable, placed, size_of

EVENT_ROUNDS = 100  # largest number of iterations of an event


class AfterEvent(NamedTuple):
    """Answer of an FMU at the end of an event."""

    terminates: bool
    next_time: float  # infinite if it has no time event
    states: np.ndarray


class Instance:
    """An instance for model exchange or for co-simulation. Each method is one step of FMI's state machine."""

    def __init__(self, folder: str, description: Description, kind: str) -> None:
        fmpy = needed("fmpy.simulation", "fmi", "An FMU")
        self.is_3 = description.version == 3
        self.description = description
        try:
            self.fmu = fmpy.instantiate_fmu(folder, description.raw, kind)
        except Exception as error:
            raise ModelError(
                f"The FMU {description.raw.modelName} cannot be loaded: {error} "
                "Its binary must be for this operating system and processor."
            ) from error

    def initialise(self, time: float, values: Sequence[tuple[ImportedVariable, np.ndarray]]) -> None:
        """From anywhere to the end of initialisation, with these values of variables."""
        fmu = self.fmu
        fmu.reset()
        if self.is_3:
            fmu.enterInitializationMode(startTime=time)
        else:
            fmu.setupExperiment(startTime=time)
            fmu.enterInitializationMode()
        for variable, value in values:
            self.set([variable], np.ravel(value))
        fmu.exitInitializationMode()

    def end_event(self) -> AfterEvent:
        """Iterate an event to its end and enter continuous time."""
        for _ in range(EVENT_ROUNDS):
            again, ends, _, _, has_next, next_time = (
                self.fmu.updateDiscreteStates() if self.is_3 else self.fmu.newDiscreteStates()
            )
            if not again or ends:
                self.fmu.enterContinuousTimeMode()
                return AfterEvent(bool(ends), float(next_time) if has_next else np.inf, self.states())
        raise SimulationError(f"An event of {self.description.raw.modelName} has no end ({EVENT_ROUNDS} iterations).")

    def step(self, time: float, length: float) -> bool:
        """A communication step; whether the FMU ends the run."""
        answer = self.fmu.doStep(time, length)
        return bool(answer[1]) if self.is_3 else False

    def set(self, variables: Sequence[ImportedVariable], values: np.ndarray) -> None:
        """Set variables, whose values follow each other in one array."""
        place = 0
        for kind, group in _by_kind(variables):
            references = [variable.reference for variable in group]
            count = sum(variable.count for variable in group)
            cast: Callable[[float], Any] = float if kind in REAL else bool if kind == "Boolean" else int
            getattr(self.fmu, f"set{self._named(kind)}")(references, [cast(v) for v in values[place : place + count]])
            place += count

    def get(self, variables: Sequence[ImportedVariable]) -> np.ndarray:
        """The values of variables, one after the other."""
        found: list[float] = []
        for kind, group in _by_kind(variables):
            references = [variable.reference for variable in group]
            read = getattr(self.fmu, f"get{self._named(kind)}")
            count = sum(variable.count for variable in group)
            found += read(references, count) if self.is_3 else read(references)
        return np.asarray(found, float)

    def set_states(self, states: np.ndarray) -> None:
        self.fmu.setContinuousStates(_doubles(states), len(states))

    def states(self) -> np.ndarray:
        return self._filled(self.fmu.getContinuousStates, self.description.n_states)

    def rates(self) -> np.ndarray:
        fmu = self.fmu
        return self._filled(
            fmu.getContinuousStateDerivatives if self.is_3 else fmu.getDerivatives, self.description.n_states
        )

    def indicators(self) -> np.ndarray:
        return self._filled(self.fmu.getEventIndicators, self.description.n_indicators)

    def directional(self, unknowns: Sequence[int], knowns: Sequence[int], seed: np.ndarray, count: int) -> np.ndarray:
        """The derivatives of the unknowns, `count` numbers, in one direction of the knowns."""
        arguments = (list(unknowns), list(knowns), seed.tolist(), *((count,) if self.is_3 else ()))
        return np.asarray(self.fmu.getDirectionalDerivative(*arguments))

    def _filled(self, read: Callable[[Any, int], object], count: int) -> np.ndarray:
        values = np.zeros(count)
        if count:
            read(_doubles(values), count)
        return values

    def _named(self, kind: str) -> str:
        """The type of the functions that set and get variables of a kind."""
        if kind != "Enumeration":
            return kind
        return "Int64" if self.is_3 else "Integer"


def _doubles(values: np.ndarray) -> Any:
    return values.ctypes.data_as(ctypes.POINTER(ctypes.c_double))


def _by_kind(variables: Sequence[ImportedVariable]) -> list[tuple[str, list[ImportedVariable]]]:
    """Runs of variables of one type."""
    runs: list[tuple[str, list[ImportedVariable]]] = []
    for variable in variables:
        if not runs or runs[-1][0] != variable.kind:
            runs.append((variable.kind, []))
        runs[-1][1].append(variable)
    return runs


@ft.cache
def unpacked(path: Path, digest: str) -> str:
    """The folder with the contents of an FMU, for as long as this process runs."""
    folder = tempfile.TemporaryDirectory(prefix="fmu-")
    atexit.register(folder.cleanup)
    return needed("fmpy", "fmi", "An FMU").extract(str(path), folder.name)


def provides_directional(folder: str) -> bool:
    """Whether an unpacked FMU for model exchange gives directional derivatives (FMPy reads this for FMI 2.0 only)."""
    element = ElementTree.parse(Path(folder) / "modelDescription.xml").find("ModelExchange")
    names = ("providesDirectionalDerivative", "providesDirectionalDerivatives")
    return element is not None and any(element.get(name) in ("true", "1") for name in names)


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
