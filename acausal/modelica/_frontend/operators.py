"""Types and sizes of operators (Modelica 3.6, section 10.6)."""

from collections.abc import Callable

from .._syntax import expressions as e
from .typed import BOOLEAN, INTEGER, REAL, STRING, Dims, Type, Typed, accepts, joined_dims, same_dims, written_dims

Error = Callable[[str], Exception]

OPERATIONS = {
    "+": "Add", "-": "Sub", "*": "Mul", "/": "Div", "^": "Exp",
    ".+": "AddElem", ".-": "SubElem", ".*": "MulElem", "./": "DivElem", ".^": "ExpElem",
    "<": "Lt", "<=": "Le", ">": "Gt", ">=": "Ge", "==": "Eq", "<>": "Neq", "and": "And", "or": "Or",
}  # fmt: skip
_RELATIONS = ("<", "<=", ">", ">=", "==", "<>")


def unary(op: str, arg: Typed, error: Error) -> Typed:
    if op == "not":
        if arg.type != BOOLEAN:
            raise error(f"`not` needs a Boolean, but has {written(arg)}.")
        return arg._replace(x=e.Unary("Not", arg.x))
    if not arg.type.is_numeric:
        raise error(f"`{op}` needs a number, but has {written(arg)}.")
    if op in ("+", ".+"):
        return arg
    if isinstance(arg.x, e.Const) and not isinstance(arg.x.value, str):
        return arg._replace(x=e.Const(-arg.x.value))
    return arg._replace(x=e.Unary("Minus", arg.x))


def binary(op: str, a: Typed, b: Typed, error: Error) -> Typed:
    """An operation of two values. Raises `error` if their types or sizes do not fit."""
    variability = max(a.variability, b.variability)
    x = e.Binary(OPERATIONS[op], a.x, b.x)

    def unfit() -> Exception:
        return error(f"`{op}` cannot have {written(a)} and {written(b)} as its sides.")

    if op in ("and", "or"):
        if a.type != BOOLEAN or b.type != BOOLEAN or not same_dims(a.dims, b.dims):
            raise unfit()
        return Typed(x, BOOLEAN, joined_dims(a.dims, b.dims), variability)
    if op in _RELATIONS:
        fits = accepts(a.type, b.type) or accepts(b.type, a.type)
        if not fits or a.dims or b.dims or not a.type.is_plain:
            raise unfit()
        return Typed(x, BOOLEAN, (), min(variability, 2))
    if op in ("+", ".+") and a.type == STRING and b.type == STRING:
        dims = _dims(op, a.dims, b.dims)
        if dims is None:
            raise unfit()
        return Typed(x, STRING, dims, variability)
    if not _is_number(a.type) or not _is_number(b.type):
        raise unfit()
    dims = _dims(op, a.dims, b.dims)
    is_negative = isinstance(b.x, e.Const) and float(b.x.value) < 0
    if dims is None or (op == "^" and a.dims and (b.type != INTEGER or is_negative)):
        raise unfit()
    is_whole = a.type == b.type == INTEGER and op in ("+", "-", "*", ".+", ".-", ".*")
    return Typed(x, INTEGER if is_whole else REAL, dims, variability)


def _is_number(kind: Type) -> bool:
    return kind.is_numeric or kind.name == "any"


def _dims(op: str, a: Dims, b: Dims) -> Dims | None:
    """The size of the result; None if the sides do not fit."""
    if op in ("+", "-") or (op.startswith(".") and a and b):
        return joined_dims(a, b) if same_dims(a, b) else None
    if op.startswith("."):
        return a or b
    if op == "/":
        return None if b else a
    if op == "^":
        # The power of a matrix is a product: its exponent is a number of factors.
        return a if not b and (not a or (len(a) == 2 and same_dims(a[:1], a[1:]))) else None
    if not a or not b:
        return a or b
    if len(a) > 2 or len(b) > 2 or not same_dims(a[-1:], b[:1]):
        return None
    return (*a[:-1], *b[1:])


def written(x: Typed) -> str:
    return f"a value of type {x.type}" + (f" and size {written_dims(x.dims)}" if x.dims else "")
