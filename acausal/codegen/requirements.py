"""The requirements on the parameters of a model in C."""

import json

import numpy as np

from .._reduce.stated import required
from .expressions import SIGN
from .model import CModel
from .values import CValue, Index, stored
from .write import function
from .writer import Writer, inlined


def requirement_functions(model: CModel) -> list[str]:
    """A function that returns the sentence of the first requirement that the parameters violate, or 0."""
    sentences = iter(model.system.intake.requirements.sentences)
    writer = Writer(model.tables, f"A requirement of {model.name}")
    for name in ("m", "p"):
        writer.names.new(name)
    for number, holder in enumerate(model.system.flat.holders):
        needed = required(holder.kind)
        if not needed.texts:
            continue
        for member in range(holder.total):
            values = [_parameter(model, (number, slot), member) for slot in needed.slots]
            for truth in writer.run(inlined(needed.jaxpr), values):
                condition = truth.at(Index(np.array(0), (), writer.tables)).inside(SIGN + 1)
                writer.line(f"if (!{condition})")
                writer.line(f"    return {json.dumps(next(sentences))};")
    writer.line("return 0;")
    head = f"const char *{model.name}_violation(const {model.name} *m)"
    return [function(head, writer.lines, unread=("m",), is_constant=True)]


def _parameter(model: CModel, key: tuple[int, int], member: int) -> CValue:
    kind, slot = key
    holder = model.system.flat.holders[kind]
    first = int(model.layout.members(key, np.array([member])).firsts[0])
    shape = holder.kind.sizes[slot]
    whole = stored("p", (model.layout.n_params + 1,), "f")
    return whole.moved((first + np.arange(int(np.prod(shape)))).reshape(shape))
