"""The events of a model in C: event indicators, conditions, changes and times."""

import dataclasses
import functools as ft
import json
from collections.abc import Iterator, Sequence

import numpy as np

from .._evaluate.event_set import EventEntry, EventSet, Function
from .._jax_private import ClosedJaxpr
from .._reduce.event_indicators import Expression as Condition
from .expressions import SIGN, Expression
from .layout import Numbering
from .model import CModel
from .resets import Resets
from .values import CValue, Index, stored
from .write import array, function, part
from .writer import Writer, inlined


def leaf_value(writer: Writer, layout: Numbering, leaf: int, *, is_tangent: bool = False) -> CValue:
    """A leaf or its tangent as an array: in place if its elements lie in one array with one sign, otherwise copied."""
    own = layout.system.flat.leaves[leaf]
    shape = own.stack + own.sizes
    members = layout.leaf(leaf)
    if is_tangent:
        members = [(places._replace(space=_tangent(places.space)), size) for places, size in members]
    kinds = {(places.space, places.sign) for places, _ in members}
    if len(kinds) == 1:
        ((space, sign),) = kinds
        every = np.concatenate([places.firsts[0] + np.arange(size) for places, size in members])
        return _in_place(space, sign, every, shape)
    target = writer.declare(shape, "f", own.path)
    done = 0
    for places, size in members:
        part = _in_place(places.space, places.sign, places.firsts[0] + np.arange(size), (size,))
        writer.assign(target, part, done + np.arange(size))
        done += size
    return target


def _in_place(space: str, sign: int, every: np.ndarray, shape: tuple[int, ...]) -> CValue:
    def at(index: Index) -> Expression:
        text = space or "0.0" if space in ("", "t", "dt") else f"{space}[{index.through(every).text}]"
        return Expression(text) if sign > 0 else Expression(f"-{text}", SIGN)

    return CValue(shape, "f", at)


def _tangent(space: str) -> str:
    """The space of the derivatives along a direction; "" for constants."""
    return f"d{space}" if space in ("v", "t") else ""


@dataclasses.dataclass(frozen=True)
class Write:
    """The new values of one target of events, and where they go: discrete variables "d", states "x", or variables that
    constraints tie to states, "z".
    """

    space: str
    numbers: np.ndarray  # of the events, [events, elements]
    places: np.ndarray
    sources: np.ndarray  # the positions among all new values
    sign: int
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
    def impacts(self) -> list[tuple[int, EventEntry]]:
        """The impacts, each with the number of its first event."""
        return [(first, entry) for first, entry in self.events.numbered if entry.kind == "impact"]

    @ft.cached_property
    def _targets(self) -> list[tuple[int, EventEntry, int]]:
        """The number of the first event, the events, and the leaf that they set."""
        return [(first, entry, leaf) for first, entry in self.events.numbered for leaf in entry.targets]

    @ft.cached_property
    def resets(self) -> Resets:
        """The targets other than discrete variables."""
        leaves = dict.fromkeys(leaf for _, _, leaf in self._targets if leaf not in self.model.layout.discrete)
        return Resets(self.model, tuple(leaves))

    @ft.cached_property
    def writes(self) -> list[Write]:
        """The changes, in the order in which they are made."""
        found, start = [], 0
        sizes = [int(np.prod(aval.shape)) for aval in self.events.actions.closed.out_avals]
        for (first, entry, leaf), size in zip(self._targets, sizes, strict=True):
            found += self._writes(first, entry, leaf, start, size // entry.count)
            start += size
        return found

    def _writes(self, first: int, entry: EventEntry, leaf: int, start: int, width: int) -> Iterator[Write]:
        """The changes of one leaf, those of a negated alias apart. A single number is broadcast to all elements."""
        layout = self.model.layout
        if leaf in layout.discrete:
            space, places = "d", layout.discrete[leaf] + np.arange(layout.size(leaf))
            signs = np.ones(len(places), int)
        else:
            places, signs = self.resets.places(leaf)
            space = "z" if self.resets.is_tied else "x"
            places = places if space == "z" else self.resets.state_places(places)
        each = len(places) // entry.count
        table = places.reshape(entry.count, each)
        numbers = np.broadcast_to(first + np.arange(entry.count)[:, None], table.shape)
        sources = start + np.arange(entry.count)[:, None] * width + np.arange(each) % width
        label = f"{entry.label(0)} sets {self.model.system.flat.leaves[leaf].name(0)}"
        label += f" and {entry.count - 1} more" * (entry.count > 1)
        for sign in np.unique(signs).tolist():
            rows = np.flatnonzero(signs.reshape(entry.count, each)[:, 0] == sign)
            yield Write(space, numbers[rows], table[rows], sources[rows], sign, label)

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
        write_outputs(writer, of.closed, values, targets)

    def _writer(self, what: str) -> Writer:
        writer = Writer(self.model.tables, f"{what} of {self.model.name}")
        for name in ("m", "t", "v", "p", "d", "indicator", "new", "first", "every", "closed", "speed", "after", "rate"):
            writer.names.new(name)
        return writer

    def _indicators(self) -> str:
        writer = self._writer("An event")
        starts = starts_of(self.events.indicators.closed)
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
        model, starts = self.model, starts_of(self.events.actions.closed)
        head = f"static int {'set_new_values' if self.impacts else 'act'}({model.name} *m, const int *fired)"
        if not starts:
            return [function(head, ["    return 1;"], unread=("m", "fired")), *self._impulses()]
        writer = self._writer("An event")
        self._outputs(writer, self.events.actions, [("new", start) for start in starts])
        new = function(
            f"static void new_values(const {model.name} *m, double *new)", writer.lines, unread=("m",), is_constant=True
        )
        return [*self.resets.functions(), new, function(head, self._changes()), *self._impulses()]

    def _impulses(self) -> list[str]:
        """The impacts: tables, the contacts, and the impulses."""
        if not self.impacts:
            return []
        model, layout = self.model, self.model.layout
        counts = [entry.count for _, entry in self.impacts]
        starts = np.cumsum([0, *counts]).tolist()
        numbers = np.concatenate([first + np.arange(entry.count) for first, entry in self.impacts])
        forces = [
            layout.discrete[entry.force] + np.arange(entry.count)
            for _, entry in self.impacts
            if entry.force is not None
        ]
        contacts, rates = self._writer("A contact"), self._writer("A contact")
        targets = [(name, start) for start in starts[:-1] for name in ("closed", "speed", "after")]
        self._outputs(contacts, self.events.contacts, targets)
        self._outputs(rates, self.events.accelerations, [("rate", start) for start in starts[:-1]])
        sizes = {"N_IMPACTS": starts[-1], "N_STATES": model.n_states, "N_DISCRETE": layout.n_discrete}
        return [
            "\n".join(f"#define {name} {size}" for name, size in sizes.items()),
            array("event_of_impact", numbers, "i"),
            array("force_of_impact", np.concatenate(forces), "i"),
            array("rate_of_state", model.rate_places, "i"),
            array("is_yields", np.array([entry.kind == "yields" for entry in self.events.members], int), "i"),
            function(
                f"static void contact_speeds(const {model.name} *m, double *closed, double *speed, double *after)",
                contacts.lines, unread=("m",), is_constant=True,
            ),
            function(
                f"static void contact_rates(const {model.name} *m, double *rate)",
                rates.lines, unread=("m",), is_constant=True,
            ),
            part("impacts").replace("MODEL", model.name),
        ]  # fmt: skip

    def _changes(self) -> list[str]:
        """The statements that change the model by the events that fired."""
        writer = self._writer("An event")
        is_tied = self.resets.is_tied
        writer.line(f"double new[{1 + max(int(write.sources.max()) for write in self.writes)}];")
        if is_tied:
            for text in TIED_START:
                writer.line(text)
        writer.line("new_values(m, new);")
        for write in self.writes:
            writer.comment(write.label)
            with writer.loops(*write.places.shape) as index:
                tables = (write.numbers, write.places, write.sources)
                number, place, source = (Index(x, index.variables, writer.tables).text for x in tables)
                value = f"{'-' if write.sign < 0 else ''}new[{source}]"
                if write.space == "z":
                    with writer.block(f"if (fired[{number}])"):
                        writer.line(f"z[{place}] = {value};")
                        writer.line(f"is_set[{place}] = is_moved = 1;")
                else:
                    writer.line(f"if (fired[{number}])")
                    writer.line(f"    m->{write.space}[{place}] = {value};")
        for text in TIED_END if is_tied else ("return 1;",):
            writer.line(text)
        return writer.lines

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


TIED_START = (
    "double z[N_TIED];",
    "int is_set[N_TIED] = {0}, is_moved = 0;",
    "for (int i = 0; i < N_TIED; i++)",
    "    z[i] = v[tied[i]];",
)
TIED_END = (
    "if (!is_moved)",
    "    return 1;",
    "if (!follow(m, z, is_set))",
    "    return 0;",
    "for (int i = 0; i < (int)(sizeof tied_state / sizeof *tied_state); i++)",
    "    m->x[state_of_tied[i]] = z[tied_state[i]];",
    "return 1;",
)


def write_outputs(
    writer: Writer, closed: ClosedJaxpr, values: Sequence[CValue], targets: Sequence[tuple[str, int]]
) -> None:
    """Write the outputs of a jaxpr to vectors, each from a start."""
    for result, (name, start) in zip(writer.run(inlined(closed), values), targets, strict=True):
        vector = stored(name, (start + result.size + 1,), "f", is_array=True)
        writer.assign(vector, result, start + np.arange(result.size))


def starts_of(closed: ClosedJaxpr) -> list[int]:
    """The positions of the outputs of a jaxpr in one vector."""
    sizes = [int(np.prod(aval.shape)) for aval in closed.out_avals]
    return np.cumsum([0, *sizes]).tolist()[: len(sizes)]


def condition_text(condition: Condition) -> str:
    """A condition in terms of the truths of relations."""
    name, *parts = condition
    if name in ("holds", "fails"):
        return f"{'!' if name == 'fails' else ''}truth[{parts[0]}]"
    operands = [condition_text(part) for part in parts]
    return f"({operands[0]} {'&&' if name == 'and' else '||'} {operands[1]})"
