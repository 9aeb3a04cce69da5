"""Assignments of whole records in the algorithms of a model, whose fields are variables of their own."""

import dataclasses
import itertools
from collections.abc import Iterator

from .._syntax import expressions as e
from .._syntax.flat import Algorithm, FlatModelica


def without_record_targets(flat: FlatModelica) -> FlatModelica:
    """Assigns the value of each record to a local name, which is no identifier, and its fields to the variables."""
    change = _RecordTargets(flat)
    algorithms, initial = (tuple(map(change.algorithm, own)) for own in (flat.algorithms, flat.initial_algorithms))
    return dataclasses.replace(flat, algorithms=algorithms, initial_algorithms=initial)


class _RecordTargets:
    def __init__(self, flat: FlatModelica) -> None:
        self._flat = flat
        self._numbers = itertools.count(1)

    def algorithm(self, algorithm: Algorithm) -> Algorithm:
        outputs = [name for output in algorithm.outputs for name in self._fields(output) or [output]]
        return dataclasses.replace(algorithm, body=self._body(algorithm.body), outputs=tuple(dict.fromkeys(outputs)))

    def _body(self, body: e.Body) -> e.Body:
        return tuple(one for statement in body for one in self._statements(statement))

    def _statements(self, statement: e.Statement) -> Iterator[e.Statement]:
        match statement:
            case e.Assign(targets, value):
                names = {t: f"record {next(self._numbers)}" for t in targets if t is not None and self._fields(t.name)}
                yield e.Assign(tuple(e.Target(names[t]) if t in names else t for t in targets), value)
                for target, name in names.items():
                    for path in self._fields(target.name):
                        yield e.Assign((e.Target(path),), _field(e.Ref(name), path[len(target.name) + 1 :]))
            case e.IfStatement(blocks, otherwise):
                yield e.IfStatement(self._blocks(blocks), self._body(otherwise))
            case e.WhenClause(blocks):
                yield e.WhenClause(self._blocks(blocks))
            case e.For() | e.While():
                yield dataclasses.replace(statement, body=self._body(statement.body))
            case _:
                yield statement

    def _blocks(self, blocks: tuple[tuple[e.Expression, e.Body], ...]) -> tuple[tuple[e.Expression, e.Body], ...]:
        return tuple((condition, self._body(body)) for condition, body in blocks)

    def _fields(self, name: str) -> list[str]:
        """The variables of a record, or none for the name of a variable."""
        variables = self._flat.variables
        return [] if name in variables else [path for path in variables if path.startswith(f"{name}.")]


def _field(x: e.Expression, path: str) -> e.Expression:
    """A field of a field, such as `inner[2].x`."""
    for part in path.split("."):
        name, _, index = part.rstrip("]").partition("[")
        x = e.FieldOf(x, name)
        if index:
            x = e.Subscript(x, tuple(e.Const(int(i)) for i in index.split(",")))
    return x
