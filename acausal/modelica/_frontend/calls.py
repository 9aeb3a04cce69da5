"""Calls of functions and of constructors (Modelica 3.6, sections 12.4 and 14.3)."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from ..._errors import suggestion
from .._syntax import expressions as e
from .._syntax.visits import nodes
from . import builtins, references
from . import tree as t
from .classes import ClassElement, ComponentElement, Instance
from .source import TextError
from .typed import (
    CONSTANT,
    CONTINUOUS,
    DISCRETE,
    NONE,
    PARAMETER,
    Dims,
    Type,
    Typed,
    accepts,
    element,
    same_dims,
    written_dims,
    written_out,
)

if TYPE_CHECKING:
    from .expressions import Expressions


def call(here: "Expressions", x: t.Call) -> Typed:
    """The call of a function of the model or a library. Raises `TextError`."""
    found = callee(here, x.function)
    if isinstance(found, Typed):
        return _call_of_argument(here, x, found)
    return call_of(here, found, x)


def callee(here: "Expressions", function: t.Reference) -> ClassElement | Typed:
    """The function that a reference names; an expression, if it is an argument of the function around."""
    if len(function.parts) == 1 and function.parts[0].name in here.names:
        return here.names[function.parts[0].name]
    found = references.find(here, function, is_call=True)
    if isinstance(found, references.Chain) and found.last.value_type.name == "function":
        found = Typed(e.Ref(found.last.name), found.last.value_type)
    if not isinstance(found, ClassElement | Typed):
        raise here.error(function.at, f"{function} is a component, not a function.")
    return found


def call_of(here: "Expressions", element: ClassElement, x: t.Call) -> Typed:
    """The call of a class: a function, the constructor of a record, or of an external object."""
    instance = element.instance
    if instance.kind == "operator record" and "'constructor'" in instance.elements:
        return _overloaded(here, instance, x)
    if instance.kind in ("record", "operator record"):
        return _record(here, instance, x)
    if instance.is_external_object:
        return _object(here, instance, x)
    if instance.kind == "operator":
        return fitting(here, functions_in(instance), f"function of the operator {instance.name}", x)
    if instance.literals is not None:
        return _enumeration(here, instance, x)
    if instance.encloser is not None and instance.encloser.is_external_object:
        raise here.error(x.at, f"{instance.name} of an external object cannot be called by itself.")
    if not instance.is_function:
        raise here.error(x.at, f"{instance.name} is a {instance.kind}, not a function.")
    if instance.tree.is_partial and not instance.tree.is_replaceable:
        raise here.error(x.at, f"the function {instance.name} is partial, and cannot be called.")
    return _function(here, instance, x)


def _function(here: "Expressions", instance: Instance, x: t.Call, *, is_exact: bool = False) -> Typed:
    """The call of a function. `is_exact`: records are not constructed from arguments of other types."""
    builtin = _builtin_name(instance)
    if builtin is not None:
        values = (*x.args, *(value for _, value in x.named))
        return builtins.call(here, builtin, t.Call(x.function, values, (), at=x.at))
    inputs = instance.inputs()
    given = _matched(here, instance.name, inputs, x, is_exact=is_exact)
    functions = {name: arg for name, arg in given.items() if arg.type.name == "function"}
    bound = [item for arg in functions.values() for item in arg.results]
    ordered = _in_order(here, instance, inputs, given)
    values = bound + [arg for arg in ordered if arg.type.name != "function"]
    lifted = _lifted(here, inputs, given, x)
    found = _called(here, instance, given, values, functions, lifted)
    if lifted and len(found.results) != 1:
        raise here.error(
            x.at, f"{instance.name} has {len(found.results)} results, and cannot be called with arrays for scalars."
        )
    return found


def _called(
    here: "Expressions",
    instance: Instance,
    given: Mapping[str, Typed],
    values: Sequence[Typed],
    functions: Mapping[str, Typed],
    lifted: Dims = (),
) -> Typed:
    """The results of a function for `given` inputs. `values` are its arguments by position, without `functions`."""
    may_be_impure = here.in_when or here.at_start or here.scope.whole.is_function
    if instance.tree.is_impure and not may_be_impure:
        raise here.error(
            here.at,
            f"{instance.name} is impure: it can be called in when-clauses, initial sections, values of parameters, "
            "functions and `pure(...)` only.",
        )
    name = here.context.functions.request(instance, functions)
    found = e.FunctionCall(name, tuple(arg.x for arg in values))
    variability = max((arg.variability for arg in values), default=CONSTANT)
    if instance.tree.is_impure:  # the value of a parameter is that of an initial equation (section 12.3)
        variability = max(variability, PARAMETER if here.at_start else DISCRETE)
    results: list[Typed] = []
    for one in instance.components():
        if one.causality == "output":
            sizes = here.context.sizes(one)
            if None in sizes:
                sizes = here.context.sizes_for(one, given)
            results.append(Typed(found, one.value_type, (*lifted, *sizes), variability))
    return results[0]._replace(results=tuple(results)) if results else Typed(found, NONE, (), variability)


def _builtin_name(instance: Instance) -> str | None:
    """The function of the language that a function with `external "builtin"` stands for."""
    for base in instance.lineage():
        body = base.tree.body
        if isinstance(body, t.Long) and body.external is not None and body.external.language == "builtin":
            name = body.external.name or instance.name
            return name if name in builtins.FUNCTIONS else None
    return None


def _enumeration(here: "Expressions", instance: Instance, x: t.Call) -> Typed:
    """`E(i)`: the literal of an enumeration with a number (section 4.9.5.3)."""
    if len(x.args) != 1 or x.named:
        raise here.error(x.at, f"the conversion to {instance.name} needs one argument.")
    value = here.single(x.args[0])
    if value.type.name != "Integer" or value.dims:
        raise here.error(x.at, f"the conversion to {instance.name} needs an Integer, not {value.type}.")
    if value.variability <= PARAMETER and (number := here.context.known(value.x)) is not None:
        if not 1 <= number <= len(instance.literals or ()):
            raise here.error(x.at, f"{instance.name} has no literal with the number {number}.")
        if value.variability == CONSTANT:
            return references.literal(here, instance, number)
    return value._replace(type=Type("enumeration", instance.origin()))


def _matched(
    here: "Expressions", name: str, inputs: Sequence[ComponentElement], x: t.Call, *, is_exact: bool = False
) -> dict[str, Typed]:
    """The arguments by the names of the inputs."""
    formals = {one.name: one for one in inputs}
    if len(x.args) > len(formals):
        raise here.error(x.at, f"{name} has {len(formals)} inputs, but {len(x.args)} arguments.")
    given: dict[str, Typed] = {}
    texts = [*zip(formals, x.args, strict=False), *x.named]
    for key, text in texts:
        if key not in formals:
            raise here.error(text.at, f"{name} has no input {key}.{suggestion(key, list(formals))}")
        if key in given:
            raise here.error(text.at, f"the input {key} of {name} gets two arguments.")
        given[key] = _argument(here, name, formals[key], text, is_exact=is_exact)
    for key, formal in formals.items():
        if key not in given and not formal.binding and not _has_fields(formal):
            raise here.error(x.at, f"the input {key} of {name} gets no argument.")
    return given


def _has_fields(formal: ComponentElement) -> bool:
    """Whether the modifier of a record gives the values of its fields."""
    return formal.value_type.name == "record" and all(
        one.binding or _has_fields(one) for one in formal.prototype.components()
    )


def _argument(
    here: "Expressions", name: str, formal: ComponentElement, text: t.Expression, *, is_exact: bool = False
) -> Typed:
    kind = formal.value_type
    if kind.name == "function":
        return _function_argument(here, text)
    value = here.single(text)
    found = as_type(here, kind, value) if not is_exact or accepts(kind, value.type) else None
    if found is None:
        raise here.error(text.at, f"the input {formal.name} of {name} is of type {kind}, not {value.type}.")
    dims = here.context.formal_sizes(formal)
    extra = len(found.dims) - len(dims)
    if extra < 0 or not same_dims(found.dims[extra:], dims):
        raise here.error(
            text.at,
            f"the input {formal.name} of {name} has size {written_dims(dims)}, not {written_dims(found.dims)}.",
        )
    return found


def _function_argument(here: "Expressions", text: t.Expression) -> Typed:
    """A function as an argument, with the values of its inputs that `function f(a = 1)` gives as results."""
    reference = text.function if isinstance(text, t.PartialCall) else text
    if not isinstance(reference, t.Reference):
        raise here.error(text.at, "this argument must be a function.")
    found = callee(here, reference)
    if not isinstance(found, Typed):
        found = Typed(e.Ref(found.instance.path), Type("function", found.instance), (), 0)
    if not isinstance(text, t.PartialCall):
        return found
    instance, bound = found.type.instance, bound_inputs(found)
    assert isinstance(instance, Instance)
    assert isinstance(found.x, e.Ref)
    formals = {one.name: one for one in instance.inputs() if one.name not in bound}
    for key, value in text.named:
        if key not in formals:
            raise here.error(value.at, f"{instance.name} has no input {key}.{suggestion(key, list(formals))}")
    values = tuple(_argument(here, instance.name, formals[key], value) for key, value in text.named)
    name = "|".join((found.x.name, *(key for key, _ in text.named)))
    return found._replace(x=e.Ref(name), results=(*found.results, *values))


def bound_inputs(function: Typed) -> list[str]:
    """The inputs of a functional argument to which `function f(a = 1)` binds the values in its results."""
    assert isinstance(function.x, e.Ref)
    return function.x.name.split("|")[1:]


def _call_of_argument(here: "Expressions", x: t.Call, function: Typed) -> Typed:
    """The call of a function that is an argument: `here.names` has the function itself, with bound values."""
    instance, bound = function.type.instance, bound_inputs(function)
    assert instance is not None
    if not function.results and bound:
        raise here.error(x.at, "the bound values of this function are not known.")
    if not isinstance(instance, Instance) or instance.tree.is_partial:
        raise here.error(x.at, f"the function {x.function} is not known.")
    values = dict(zip(bound, function.results, strict=True))
    inputs = instance.inputs()
    free = [one for one in inputs if one.name not in values]
    given = {**_matched(here, instance.name, free, x), **values}
    found = _called(here, instance, given, _in_order(here, instance, inputs, given), {})
    return found._replace(variability=CONTINUOUS)


def _in_order(
    here: "Expressions", instance: Instance, inputs: Sequence[ComponentElement], given: Mapping[str, Typed]
) -> list[Typed]:
    """The arguments by position. Inputs at the end that get their default are left out, unless this depends on the
    component that modifies the function.
    """
    needed = [i for i, one in enumerate(inputs) if one.name in given or reads_component(one)]
    last = max(needed, default=-1)
    found: list[Typed] = []
    known = dict(given)
    for one in inputs[: last + 1]:
        if one.name not in known:
            known[one.name] = _default(here, instance, one, known)
        found.append(known[one.name])
    return found


def reads_component(formal: ComponentElement) -> bool:
    """Whether the default of an input is the modifier of a component, whose variables it can read."""
    return formal.binding is not None and not formal.binding.scope.whole.is_class


def _default(here: "Expressions", instance: Instance, formal: ComponentElement, given: Mapping[str, Typed]) -> Typed:
    value = here.context.default(formal, given)
    if value is None:
        raise formal.error(f"the input {formal.name} of {instance.name} has no default.")
    if formal.binding is not None and "time" in names_of(formal.binding.expression):
        raise formal.binding.error("`time` is not allowed in functions.")
    return value


def _lifted(here: "Expressions", inputs: Sequence[ComponentElement], given: Mapping[str, Typed], x: t.Call) -> Dims:
    """The dimensions over which a call with arrays for scalars is repeated (section 12.4.6)."""
    found: Dims = ()
    for one in inputs:
        if one.name in given and given[one.name].type.name != "function":
            dims = given[one.name].dims
            extra = dims[: len(dims) - len(here.context.formal_sizes(one))]
            if extra and found and not same_dims(extra, found):
                raise here.error(x.at, "the arrays for which the function is called have different sizes.")
            found = found or extra
    return found


def _record(here: "Expressions", instance: Instance, x: t.Call) -> Typed:
    """The constructor of a record (section 12.6)."""
    components = list(instance.components())
    # A field whose value cannot change is no input.
    fields = [one for one in components if not (one.binding and (one.is_final or one.variability == "constant"))]
    known = _matched(here, instance.name, fields, x)
    for one in in_order([one for one in components if one.name not in known]):
        known[one.name] = _default(here, instance, one, known)
    values = [known[one.name] for one in components]
    variability = max((value.variability for value in values), default=CONSTANT)
    name = here.context.functions.request_record(instance)
    ranks = [len(here.context.formal_sizes(one)) for one in components]
    dims = _lifted(here, components, known, x)
    if not dims or None in dims:
        found = e.FunctionCall(name, tuple(value.x for value in values), True)
        return Typed(found, Type("record", instance), dims, variability, tuple(values))

    def of(subs: list[e.Const]) -> e.Expression:
        pairs = zip(values, ranks, strict=True)
        args = (element(one.x, subs) if len(one.dims) > rank else one.x for one, rank in pairs)
        return e.FunctionCall(name, tuple(args), True)

    return Typed(written_out(dims, of), Type("record", instance), dims, variability)


def in_order(components: list[ComponentElement]) -> list[ComponentElement]:
    """The variables of a function or record, each after those that its value reads (section 12.4.4)."""
    known = {one.name: one for one in components}
    found: dict[str, ComponentElement] = {}

    def add(one: ComponentElement, around: tuple[str, ...]) -> None:
        if one.name in around:
            raise one.error(f"the value of {one.name} depends on itself.")
        is_own = one.binding is not None and one.binding.scope.whole is one.holder.whole and one.name not in found
        for name in names_of(one.binding.expression) if one.binding is not None and is_own else ():
            if name in known:
                add(known[name], (*around, one.name))
        found.setdefault(one.name, one)

    for one in components:
        add(one, ())
    return list(found.values())


def names_of(x: t.Expression) -> list[str]:
    """The first names of the references in an expression."""
    return [one.parts[0].name for one in nodes(x) if isinstance(one, t.Reference)]


def _object(here: "Expressions", instance: Instance, x: t.Call) -> Typed:
    constructor = instance.elements.get("constructor")
    if not isinstance(constructor, ClassElement):
        raise here.error(x.at, f"the external object {instance.name} has no constructor.")
    function = constructor.instance
    inputs = function.inputs()
    given = _matched(here, instance.name, inputs, x)
    name = here.context.functions.request_object(instance, function)
    ordered = _in_order(here, function, inputs, given)
    variability = max((arg.variability for arg in ordered), default=CONSTANT)
    return Typed(e.FunctionCall(name, tuple(arg.x for arg in ordered)), Type("object", instance), (), variability)


def operators(instance: Instance, name: str) -> list[Instance]:
    """The functions of an operator of an operator record, such as `'+'`."""
    found = of_class(instance).elements.get(name)
    if not isinstance(found, ClassElement):
        return []
    inner = found.instance
    return [inner] if inner.is_function else functions_in(inner)


def of_class(instance: Instance) -> Instance:
    """The class of a component itself, so that all components share its functions."""
    return instance.origin().element.target().instance


def _overloaded(here: "Expressions", instance: Instance, x: t.Call) -> Typed:
    """The constructor of an operator record that fits the arguments; it has no other ones then (section 14.3)."""
    functions = operators(instance, "'constructor'")
    for function in functions:
        outputs = function.outputs()
        if len(outputs) != 1 or outputs[0].type.target().tree is not of_class(instance).tree:
            raise function.error(
                function.tree.at, f"the constructor {function.name} must have one output, of type {instance.name}."
            )
    return fitting(here, functions, f"constructor of {instance.name}", x)


def fitting(here: "Expressions", functions: Sequence[Instance], what: str, x: t.Call) -> Typed:
    """The call of the one function that fits the arguments."""
    found: list[Typed] = []
    errors: list[TextError] = []
    for function in functions:
        try:
            found.append(_function(here, function, x, is_exact=True))
        except TextError as error:
            errors.append(error)
    if len(found) == 1:
        return found[0]
    if found:
        raise here.error(x.at, f"more than one {what} fits these arguments.")
    if len(errors) == 1:
        raise errors[0]
    raise here.error(x.at, f"no {what} fits these arguments.")


def functions_in(instance: Instance) -> list[Instance]:
    return [
        one.instance for one in instance.elements.values() if isinstance(one, ClassElement) and one.instance.is_function
    ]


def call_values(here: "Expressions", function: Instance, args: Sequence[Typed]) -> Typed | None:
    """The call of a function of an operator with values; None if it does not fit exactly (section 14.4)."""
    inputs = function.inputs()
    needed = [one for one in inputs if not one.binding]
    if not len(needed) <= len(args) <= len(inputs):
        return None
    for one, arg in zip(inputs, args, strict=False):
        if not accepts(one.value_type, arg.type) or not same_dims(here.context.formal_sizes(one), arg.dims):
            return None
    given = {one.name: arg for one, arg in zip(inputs, args, strict=False)}
    return _called(here, function, given, args, {})


def as_type(here: "Expressions", kind: Type, value: Typed) -> Typed | None:
    """A value of a type: itself if it has the type, or what a constructor of an operator record makes of it (section
    14.4). None if there is none.
    """
    if accepts(kind, value.type):
        return value
    instance = kind.instance
    if kind.name != "record" or instance is None or instance.origin().kind != "operator record" or value.dims:
        return None
    found = (call_values(here, function, [value]) for function in operators(instance, "'constructor'"))
    return next((one for one in found if one is not None), None)
