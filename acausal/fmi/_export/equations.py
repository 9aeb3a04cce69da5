"""The equations of a model in C, without a method of integration."""

from ...codegen.derivatives import MovedRoot, along
from ...codegen.files import _header, events_of
from ...codegen.model import CModel
from ...codegen.requirements import requirement_functions
from ...codegen.source import along_functions, output_functions, rate_functions, start_functions
from ...codegen.steps import _remember
from ...codegen.write import constants, helpers, shared
from .source import derivative_functions


def equations_source(model: CModel) -> tuple[str, str, int]:
    events = events_of(model)
    evaluations = [*model.rates, *model.rest]
    tangents = along(model)
    every = along(model, with_rest=True)
    functions = [item.text for item in [*model.functions, *every.functions]]
    body = [
        *functions,
        *start_functions(model, events is not None),
        *rate_functions(model),
        *output_functions(model),
        *along_functions(model, tangents),
        *derivative_functions(model, events, every),
        *requirement_functions(model),
        *(events.functions() if events else []),
        _remember(model),
    ]
    is_tied = events is not None and events.resets.is_tied
    has_roots = any(isinstance(call, MovedRoot) for call in every.calls)
    common = shared(evaluations, has_roots=has_roots, has_matrix=False, has_equations=is_tied)
    text = "\n\n".join([*common, *body])
    head = "\n".join([f'#include "{model.name}.h"', "#include <math.h>"])
    source = "\n\n".join([head, *constants(model.tables), *helpers(text), text]) + "\n"
    return _header(model, events, 1.0, "explicit"), source, events.n_relations if events else 0
