"""The events of a model in C: event indicators, conditions, changes and times."""

import dataclasses
import functools as ft
import json
from collections.abc import Sequence

import numpy as np

from .._errors import ModelError
from .._evaluate.event_set import EventEntry, EventSet, Function
from .._evaluate.observe import constrained_places
from .._reduce.logic import Expression as Condition
from .functions import Writer, inlined
from .leaves import leaf_value
from .model import CModel
from .values import Index, stored
from .write import array, function, part


@dataclasses.dataclass(frozen=True)
class Write:
    """The new values of one target of an event, and where they go: states "x" or discrete variables "d"."""

    first: int  # number of the first event
    count: int
    space: str
    places: np.ndarray  # [events, elements]
    signs: np.ndarray
    sources: np.ndarray  # the positions among all new values
    label: str


@dataclasses.dataclass(frozen=True, eq=False)
class CEvents:
    """The events of a model; `bands` is the hysteresis of each relation."""

    model: CModel
    events: EventSet
    bands: np.ndarray

    @property
    def n_relations(self) -> int:
        return self.events.n_relations

    @property
    def n_times(self) -> int:
        """The number of times of all time events."""
        return sum(int(np.prod(aval.shape)) for aval in self.events.times.closed.out_avals[::2])

    @ft.cached_property
    def writes(self) -> list[Write]:
        """The changes, in the order in which they are made."""
        found, start = [], 0
        sizes = [int(np.prod(aval.shape)) for aval in self.events.actions.closed.out_avals]
        targets = [(first, entry, leaf) for first, entry in self.events.numbered for leaf in entry.targets]
        for (first, entry, leaf), size in zip(targets, sizes, strict=True):
            found.append(self._write(first, entry, leaf, start, size // entry.count))
            start += size
        return found

    def _write(self, first: int, entry: EventEntry, leaf: int, start: int, width: int) -> Write:
        layout = self.model.layout
        if leaf in layout.discrete:
            places = layout.discrete[leaf] + np.arange(layout.size(leaf))
            space, signs = "d", np.ones(len(places), int)
        else:
            space, (places, signs) = "x", self._state_places(entry, leaf)
        each = len(places) // entry.count
        sources = start + np.arange(entry.count)[:, None] * width + np.arange(each) % width
        label = f"{entry.label(0)} sets {self.model.system.flat.leaves[leaf].name(0)}"
        return Write(
            first, entry.count, space, places.reshape(entry.count, each), signs.reshape(entry.count, each), sources, label
        )

    def _state_places(self, entry: EventEntry, leaf: int) -> tuple[np.ndarray, np.ndarray]:
        constraints = self.model.system.constraints
        where, signs = constrained_places(self.model.system, leaf)
        if not constraints.is_state[where].all():
            name = self.model.system.flat.leaves[leaf].path
            raise ModelError(
                f"The event {entry.label(0)} sets {name}, which constraints tie to the states: C code cannot solve "
                "them at an event. Remedy: declare this variable `prefer`, so that it is a state."
            )
        position = dict(zip(constraints.states.tolist(), constraints.in_state_vector.tolist(), strict=True))
        return np.array([position[i] for i in where.tolist()]), np.asarray(signs)

    # Text

    def functions(self) -> list[str]:
        """The tables and functions of the events, in the order in which C needs them."""
        name = self.model.name
        has_times = self.n_times > 0
        found = [*self._tables(), self._indicators(), self._conditions(), *self._act()]
        if has_times:
            found += self._times()
        shared = [part("schedule" if has_times else "no_schedule"), part("iteration")]
        return [*found, *(text.replace("MODEL", name) for text in shared)]

    def _tables(self) -> list[str]:
        members = self.events.members
        flags = {
            "is_either": [entry.kind == "hold" for entry in members],
            "is_refused": [entry.kind == "refuse" for entry in members],
        }
        if self.n_times:
            flags["is_clock"] = [entry.repeats for entry in members]
        reasons = [self.events.refusal(i) if entry.kind == "refuse" else None for i, entry in enumerate(members)]
        texts = ", ".join("0" if reason is None else json.dumps(reason) for reason in reasons)
        defines = [f"#define N_EVENTS {len(members)}", f"#define N_RELATIONS {max(self.n_relations, 1)}"]
        rounding = "#define ROUNDING 1.8e-15 /* relative rounding error of times */"
        return [
            "\n".join([*defines, rounding]),
            f"static const char *const refusals[N_EVENTS] = {{{texts}}};",
            *(array(key, np.array(values, int), "i") for key, values in flags.items()),
            array("band", self.bands),
        ]

    def _outputs(self, writer: Writer, of: Function, targets: Sequence[tuple[str, int]]) -> None:
        """Write the outputs of a function of the leaves to vectors, each from a start."""
        values = [leaf_value(writer, self.model.layout, leaf) for leaf in of.leaves]
        for result, (name, start) in zip(writer.run(inlined(of.closed), values), targets, strict=True):
            vector = stored(name, (start + result.size + 1,), "f", is_array=True)
            writer.assign(vector, result, start + np.arange(result.size))

    def _writer(self, what: str) -> Writer:
        writer = Writer(self.model.tables, f"{what} of {self.model.name}")
        for name in ("m", "t", "v", "p", "d", "indicator", "new", "first", "every"):
            writer.names.new(name)
        return writer

    def _indicators(self) -> str:
        writer = self._writer("An event")
        starts = _starts(self.events.indicators)
        self._outputs(writer, self.events.indicators, [("indicator", start) for start in starts])
        if not self.n_relations:
            writer.line("indicator[0] = -1.0;")
        head = f"void {self.model.name}_indicators(const {self.model.name} *m, double *indicator)"
        return function(head, writer.lines, unread=("m",), is_constant=True)

    def _conditions(self) -> str:
        lines = []
        for i, (label, condition) in enumerate(zip(self.events.labels, self.events.logic, strict=True)):
            own = "0" if condition is None or len(condition) == 1 else condition_text(condition)
            lines.append(f"    holds[{i}] = {own}; /* {label} */")
        return function("static void conditions(const int *truth, int *holds)", lines, unread=("truth",))

    def _act(self) -> list[str]:
        model, starts = self.model, _starts(self.events.actions)
        head = f"static void act({model.name} *m, const int *fired)"
        if not starts:
            return [function(head, [], unread=("m", "fired"))]
        writer = self._writer("An event")
        self._outputs(writer, self.events.actions, [("new", start) for start in starts])
        new = function(
            f"static void new_values(const {model.name} *m, double *new)", writer.lines, unread=("m",), is_constant=True
        )
        writer = self._writer("An event")
        total = 1 + max(int(write.sources.max()) for write in self.writes)
        writer.line(f"double new[{total}];")
        writer.line("new_values(m, new);")
        for write in self.writes:
            writer.comment(write.label + (f" and {write.count - 1} more" if write.count > 1 else ""))
            with writer.loops(write.count, write.places.shape[1]) as index:
                at = [Index(x, index.variables, writer.tables).text for x in (write.places, write.sources)]
                number = Index(np.broadcast_to(write.first + np.arange(write.count)[:, None], write.places.shape),
                               index.variables, writer.tables).text  # fmt: skip
                writer.line(f"if (fired[{number}])")
                sign = self._sign(writer, write, index)
                writer.line(f"    m->{write.space}[{at[0]}] = {sign}new[{at[1]}];")
        return [new, function(head, writer.lines)]

    def _sign(self, writer: Writer, write: Write, index: Index) -> str:
        first = int(write.signs.flat[0])
        if np.all(write.signs == first):
            return "" if first > 0 else "-"
        return f"{writer.tables.of(write.signs, 'i')}[{Index(np.arange(write.signs.size).reshape(write.signs.shape), index.variables, writer.tables).text}] * "

    def _times(self) -> list[str]:
        model, of = self.model, self.events.times
        scheduled = [(n, entry) for n, entry in self.events.numbered if entry.kind == "at"]
        shapes = [int(np.prod(aval.shape)) for aval in of.closed.out_avals]
        numbers, widths = [], []
        for (first, entry), size in zip(scheduled, shapes[::2], strict=True):
            width = size // entry.count
            widths.append(width)
            numbers += [first + i for i in range(entry.count) for _ in range(width)]
        writer, start = self._writer("A time event"), 0
        values = [leaf_value(writer, model.layout, leaf) for leaf in of.leaves]
        results = writer.run(inlined(of.closed), values)
        for (_, entry), width, time, every in zip(scheduled, widths, results[::2], results[1::2], strict=True):
            size = entry.count * width
            where = start + np.arange(size)
            period = np.repeat(np.arange(entry.count), width) if every.size > 1 else np.zeros(size, int)
            for name, value in (("first", time), ("every", every.moved(period))):
                writer.assign(stored(name, (start + size + 1,), "f", is_array=True), value, where)
            start += size
        head = f"static void times(const {model.name} *m, double *first, double *every)"
        return [
            f"#define N_TIMES {start}",
            array("event_of_time", np.array(numbers), "i"),
            function(head, writer.lines, unread=("m",), is_constant=True),
        ]


def _starts(of: Function) -> list[int]:
    """The positions of the outputs of a function in one vector."""
    sizes = [int(np.prod(aval.shape)) for aval in of.closed.out_avals]
    return np.cumsum([0, *sizes]).tolist()[: len(sizes)]


def condition_text(condition: Condition) -> str:
    """A condition in terms of the truths of relations."""
    name, *parts = condition
    if name in ("holds", "fails"):
        return f"{'!' if name == 'fails' else ''}truth[{parts[0]}]"
    operands = [condition_text(part) for part in parts]
    return f"({operands[0]} {'&&' if name == 'and' else '||'} {operands[1]})"
