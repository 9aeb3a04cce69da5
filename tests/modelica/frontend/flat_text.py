"""Flat models as texts, by which tests compare them."""

from typing import Any

from acausal.modelica._frontend.flatten import flat_model
from acausal.modelica._syntax import expressions as e
from acausal.modelica._syntax.flat import FlatModelica

_OPERATORS = {
    "Add": "+", "Sub": "-", "Mul": "*", "Div": "/", "Exp": "^", "And": "and", "Or": "or",
    "Lt": "<", "Le": "<=", "Gt": ">", "Ge": ">=", "Eq": "==", "Neq": "<>",
}  # fmt: skip


def text(x: Any) -> str:
    """An expression, a statement or a body."""
    match x:
        case tuple():
            return "; ".join(map(text, x))
        case e.Const(bool() as value):
            return str(value).lower()
        case e.Const(value):
            return repr(value)
        case e.Colon():
            return ":"
        case e.Ref(name, subs) | e.Target(name, subs):
            return name + (f"[{', '.join(map(text, subs))}]" if subs else "")
        case e.Unary(op, arg):
            return f"{'-' if op == 'Minus' else 'not '}{text(arg)}"
        case e.Binary(op, left, right):
            return f"({text(left)} {_OPERATORS.get(op, '.' + op)} {text(right)})"
        case e.Builtin(name, args) | e.FunctionCall(name, args):
            return f"{name}({', '.join(map(text, args))})"
        case e.If(branches, otherwise):
            return " else".join(f"if {text(c)} then {text(v)}" for c, v in branches) + f" else {text(otherwise)}"
        case e.ArrayOf(elements):
            return "{" + ", ".join(map(text, elements)) + "}"
        case e.Comprehension(body, indices):
            return f"{{{text(body)} for {', '.join(f'{name} in {text(over)}' for name, over in indices)}}}"
        case e.RangeOf(start, step, stop):
            return ":".join(text(part) for part in (start, step, stop) if part is not None)
        case e.TupleOf(elements):
            return f"({', '.join('' if one is None else text(one) for one in elements)})"
        case e.FieldOf(base, name):
            return f"({text(base)}).{name}"
        case e.Subscript(base, subs):
            return f"({text(base)})[{', '.join(map(text, subs))}]"
        case e.Text(arg):
            return f"String({text(arg)})"
        case e.Assign(targets, value):
            left = ", ".join("" if one is None else text(one) for one in targets)
            return f"{left if len(targets) == 1 else f'({left})'} := {text(value)}"
        case e.IfStatement(blocks, otherwise):
            inner = " else".join(f"if {text(c)} then {text(body)}" for c, body in blocks)
            return f"{inner}{f' else {text(otherwise)}' if otherwise else ''} end if"
        case e.For(indices, body):
            return f"for {', '.join(f'{name} in {text(over)}' for name, over in indices)} loop {text(body)} end for"
        case e.WhenClause(blocks):
            return " else".join(f"when {text(c)} then {text(body)}" for c, body in blocks) + " end when"
        case e.Reinit(state, value, index):
            return f"reinit({state}{list(index) if index else ''}, {text(value)})"
        case e.Assert(condition, message):
            return f"assert({text(condition)}, {text(message)})"
    return type(x).__name__


def flat(source: str, model: str = "M") -> FlatModelica:
    return flat_model(source, model)


def equations(source: str, model: str = "M") -> list[str]:
    """The equations of a flat model, in the order of the text."""
    return [_equation(one.residual) for one in flat(source, model).equations]


def _equation(residual: e.Expression) -> str:
    if isinstance(residual, e.Binary) and residual.op == "Sub":
        return f"{text(residual.left)} = {text(residual.right)}"
    return f"{text(residual)} = 0"


def variables(source: str, model: str = "M") -> dict[str, str | None]:
    """The values of the variables by name, with their sizes."""
    found = flat(source, model).variables.values()
    return {
        v.name + (f"[{', '.join(map(str, v.dims))}]" if v.dims else ""): None if v.binding is None else text(v.binding)
        for v in found
    }
