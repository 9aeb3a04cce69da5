"""Values that are known when a model is translated: constants, and parameters that decide its structure."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from ..._errors import ModelError
from .._errors import ModelicaError
from .._syntax import expressions as e
from .._syntax.flat import FlatModelica, FlatVariable
from .._syntax.visits import mapped, nodes
from .evaluate import SharedCalls
from .functions import Library
from .paths import PathTree, nested, split, tree_of
from .scope import NotKnown, Scope
from .values import ZEROS, Value, plain, stacked


class KnownValues(Mapping[str, Value]):
    """The known values of a flat model by name, evaluated when they are asked for.

    Constants are known, and all parameters except real ones. A real parameter is known if it is declared to be
    evaluated, if the front end selected equations, components or sizes by it, or if something that is known reads it,
    such as the table of an external object.
    """

    def __init__(self, flat: FlatModelica) -> None:
        self.flat = flat
        self.tree = tree_of(flat.variables.values(), lambda variable: variable.name)
        self.library = Library(flat.functions, self)
        self.structural: set[str] = set()  # real parameters that are known
        self._found: dict[str, Value] = {}
        self._calls = SharedCalls()
        self._pending: set[str] = set()
        self._open: frozenset[str] = frozenset()  # those that follow a parameter with fixed=false
        for variable in flat.variables.values():
            if variable.variability == "parameter" and is_external(variable, flat) and variable.binding is not None:
                self._settle(variable.binding)
        for variable in flat.variables.values():
            if variable.variability == "parameter" and variable.type != "Real" and self.has(variable):
                self._settle_what_decides(e.Ref(variable.name))
        for x in flat.selecting:
            self._settle_what_decides(x)
        discrete = [v for v in flat.variables.values() if v.variability == "parameter" and v.type != "Real"]
        self._open = frozenset(variable.name for variable in discrete if not self._has_value(variable))

    def _settle_what_decides(self, x: Any) -> None:
        """Make the real parameters known on which an expression depends that must be known."""
        try:
            self.value(x)
        except NotKnown:
            self._settle(x)
        except ModelError:  # an error occurs again where the value is needed
            return

    def _settle(self, x: Any) -> None:
        """Make all real parameters that an expression reads known."""
        for name in names_in(x):
            branch = self.tree.find(split(name))
            for variable in variables_in(branch):
                if variable.variability == "parameter" and variable.name not in self.structural:
                    self.structural.add(variable.name)
                    for inner in (variable.binding, variable.start):
                        if inner is not None:
                            self._settle(inner)

    def _has_value(self, variable: FlatVariable) -> bool:
        try:
            self.value_of(variable)
        except NotKnown:
            return False
        except ModelError:  # an error occurs again where the value is needed
            return True
        return True

    def has(self, variable: FlatVariable) -> bool:
        """Whether the value of a variable is known."""
        if variable.variability == "constant":
            return True
        if variable.variability != "parameter" or variable.fixed == (False,):
            return False
        if variable.type != "Real":
            return variable.name not in self._open
        if variable.name in self.structural:
            return True
        return variable.evaluate and self._reads_known(variable)

    def _reads_known(self, variable: FlatVariable) -> bool:
        """Whether the binding of a parameter reads known values only."""
        stated = variable.start if variable.binding is None else variable.binding
        read = [v for name in names_in(stated) for v in variables_in(self.tree.find(split(name)))] if stated else []
        return all(self.has(other) for other in read)

    def parameters(self) -> list[str]:
        """The names of the parameters whose values are known."""
        return [v.name for v in self.flat.variables.values() if v.variability == "parameter" and self.has(v)]

    def value(self, x: Any, **names: Value) -> Value:
        """The value of an expression. Raises `NotKnown`."""
        return self._calls.value(self._sized(x), Scope(self.library, locals=self).knowing(**names))

    def _sized(self, x: Any) -> Any:
        """An expression with the sizes of variables, which are known even where their values are not."""
        if isinstance(x, e.Builtin) and x.name == "Size" and isinstance(x.args[0], e.Ref) and not x.args[0].subs:
            variable = self.flat.variables.get(x.args[0].name)
            if variable is not None and len(x.args) == 2:
                return e.Const(variable.dims[int(self.value(x.args[1])) - 1])
        return mapped(x, self._sized)

    def value_of(self, variable: FlatVariable) -> Value:
        """The value of a constant or parameter from its binding or start value; zero if it has none."""
        name = variable.name
        if name in self._found:
            return self._found[name]
        if name in self._pending:
            raise ModelicaError(f"{variable.source}: {name} is determined by itself.")
        self._pending.add(name)
        try:
            stated = variable.start if variable.binding is None else variable.binding
            if (
                variable.type == "String"
                and variable.binding is None
                and variable.variability not in ("parameter", "constant")
            ):
                raise NotKnown(name)
            value = self._zero(variable) if stated is None else self.value(stated)
        finally:
            self._pending.discard(name)
        self._found[name] = shaped(value, variable)
        return self._found[name]

    def _zero(self, variable: FlatVariable) -> Value:
        zero = ZEROS.get(variable.type, 1)
        return np.full(variable.dims, zero) if variable.dims else zero

    def __contains__(self, name: object) -> bool:
        try:
            self[str(name)]
        except KeyError:
            return False
        return True

    def __getitem__(self, name: str) -> Value:
        if name in self.flat.enumerations:
            return self.flat.enumerations[name]
        variable = self.flat.variables.get(name)
        if variable is not None:
            if not self.has(variable):
                raise KeyError(name)
            try:
                return self.value_of(variable)
            except NotKnown as missing:
                raise KeyError(name) from missing
        if name not in self._found:
            branch = self.tree.find(split(name))
            if not all(self.has(variable) for variable in variables_in(branch)):
                raise KeyError(name)
            self._found[name] = self._whole(branch, name)
        return self._found[name]

    def _whole(self, branch: PathTree[FlatVariable] | None, name: str) -> Value:
        """A record, or an array of records, all of whose fields are known."""
        if branch is None:
            raise KeyError(name)
        if branch.item is not None:
            return self[branch.item.name]
        if branch.parts:
            return {part: self._whole(inner, name) for part, inner in branch.parts.items()}
        return nested({index: self._whole(inner, name) for index, inner in branch.members.items()}, stacked)

    def __iter__(self) -> Iterator[str]:
        return (name for name, variable in self.flat.variables.items() if self.has(variable))

    def __len__(self) -> int:
        return sum(1 for _ in self)


def shaped(value: Value, variable: FlatVariable) -> Value:
    """A value with the declared shape: an attribute of an array may be given by one number."""
    if isinstance(value, dict) or not variable.dims:
        return plain(value)
    if isinstance(value, bool | int | float):
        return np.full(variable.dims, value)
    return value


def is_external(variable: FlatVariable, flat: FlatModelica) -> bool:
    """Whether a variable is an external object, such as a table: its binding calls the constructor of its class."""
    call = variable.binding
    if variable.type in ZEROS or not isinstance(call, e.FunctionCall):
        return False
    function = flat.functions.get(call.name)
    has_name = call.name.rpartition(".")[2] == variable.type.rpartition(".")[2]
    return has_name or (function is not None and function.external is not None and not function.outputs)


def names_in(x: Any) -> Iterator[str]:
    """The names in an expression."""
    return (one.name for one in nodes(x) if isinstance(one, e.Ref))


def variables_in(branch: PathTree[FlatVariable] | None) -> Iterator[FlatVariable]:
    """The variables in a branch of the tree of variables."""
    if branch is not None:
        if branch.item is not None:
            yield branch.item
        for inner in (*branch.parts.values(), *branch.members.values()):
            yield from variables_in(inner)
