"""Assignments of whole records in the algorithms of a model, whose fields are variables of their own."""

import dataclasses
import itertools
from collections.abc import Iterator

from .._syntax import expressions as e
from .._syntax.flat import Algorithm, FlatModelica
from .._syntax.visits import with_bodies


def without_record_targets(flat: FlatModelica) -> FlatModelica:
    """Assigns the value of each record to a local name, which is no identifier, and its fields to the variables."""
    change = _RecordTargets(flat)
    algorithms, initial = (tuple(map(change.algorithm, own)) for own in (flat.algorithms, flat.initial_algorithms))
    return dataclasses.replace(flat, algorithms=algorithms, initial_algorithms=initial)


class _RecordTargets:
    def __init__(self, flat: FlatModelica) -> None:
        self._numbers = itertools.count(1)
        self._fields: dict[str, list[str]] = {}  # the variables of each record
        for path in flat.variables:
            for dot in (i for i, character in enumerate(path) if character == "."):
                self._fields.setdefault(path[:dot], []).append(path)

    def algorithm(self, algorithm: Algorithm) -> Algorithm:
        outputs = [name for output in algorithm.outputs for name in self._fields.get(output, [output])]
        return dataclasses.replace(algorithm, body=self._body(algorithm.body), outputs=tuple(dict.fromkeys(outputs)))

    def _body(self, body: e.Body) -> e.Body:
        return tuple(one for statement in body for one in self._statements(statement))

    def _statements(self, statement: e.Statement) -> Iterator[e.Statement]:
        match statement:
            case e.Assign(targets, value):
                names = {
                    t: f"record {next(self._numbers)}" for t in targets if t is not None and t.name in self._fields
                }
                yield e.Assign(tuple(e.Target(names[t]) if t in names else t for t in targets), value)
                for target, name in names.items():
                    for path in self._fields[target.name]:
                        yield e.Assign((e.Target(path),), _field(e.Ref(name), path[len(target.name) + 1 :]))
            case _:
                yield with_bodies(statement, self._body)


def _field(x: e.Expression, path: str) -> e.Expression:
    """A field of a field, such as `inner[2].x`."""
    for part in path.split("."):
        name, _, index = part.rstrip("]").partition("[")
        x = e.FieldOf(x, name)
        if index:
            x = e.Subscript(x, tuple(e.Const(int(i)) for i in index.split(",")))
    return x
