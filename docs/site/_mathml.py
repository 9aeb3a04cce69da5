"""Python expressions as MathML, which browsers show without a library."""

import ast
import html

_GREEK = {
    "alpha": "α", "beta": "β", "gamma": "γ", "delta": "δ", "epsilon": "ε", "zeta": "ζ", "eta": "η", "theta": "θ",
    "kappa": "κ", "lambda": "λ", "mu": "μ", "nu": "ν", "xi": "ξ", "pi": "π", "rho": "ρ", "sigma": "σ", "tau": "τ",
    "phi": "φ", "chi": "χ", "psi": "ψ", "omega": "ω", "Delta": "Δ", "Phi": "Φ", "Psi": "Ψ",
}  # fmt: skip
_COMPARISONS = {ast.Lt: "&lt;", ast.LtE: "≤", ast.Gt: "&gt;", ast.GtE: "≥", ast.Eq: "=", ast.NotEq: "≠"}
_JOINED = {ast.Add: "+", ast.Sub: "−", ast.BitAnd: "∧", ast.BitOr: "∨", ast.And: "∧", ast.Or: "∨"}
_DOT, _SPACE = "<mo>⋅</mo>", '<mspace width="0.15em"/>'
_MODULES = ("jnp", "math", "np", "jax", "lax")
# Strength of binding, which decides on parentheses.
_LOGIC, _COMPARE, _SUM, _PRODUCT, _POWER, _ATOM = range(6)


class Unreadable(Exception):
    """Raised for code that is not an expression of variables, numbers and functions."""


def formula(node: ast.expr, rates: str) -> str:
    """The expression as MathML; attributes of `rates` are derivatives with respect to time."""
    return _Writer(rates).write(node)[0]


class _Writer:
    def __init__(self, rates: str) -> None:
        self.rates = rates

    def write(self, node: ast.expr) -> tuple[str, int]:
        """The formula, and how strongly its outermost operation binds."""
        match node:
            case ast.Constant(value=bool() | None | str()):
                raise Unreadable
            case ast.Constant(value=int() | float() as value):
                return _number(value), _ATOM
            case ast.Name(id=name):
                return _symbol(name), _ATOM
            case ast.Attribute():
                return self.variable(node), _ATOM
            case ast.Subscript(value=value, slice=index):
                return f"<msub><mrow>{self.within(value, _ATOM)}</mrow>{_text(index)}</msub>", _ATOM
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                return f"<mo>−</mo>{self.within(operand, _PRODUCT)}", _SUM
            case ast.UnaryOp(op=ast.Invert() | ast.Not(), operand=operand):
                return f"<mo>¬</mo>{self.within(operand, _POWER)}", _POWER
            case ast.BinOp(left=left, op=op, right=right):
                return self.operation(left, op, right)
            case ast.BoolOp(op=op, values=values):
                return f"<mo>{_JOINED[type(op)]}</mo>".join(self.within(one, _COMPARE) for one in values), _LOGIC
            case ast.Compare(left=left, ops=ops, comparators=others) if all(type(op) in _COMPARISONS for op in ops):
                rest = zip(ops, others, strict=True)
                shown = (f"<mo>{_COMPARISONS[type(op)]}</mo>{self.within(one, _SUM)}" for op, one in rest)
                return self.within(left, _SUM) + "".join(shown), _COMPARE
            case ast.IfExp(test=test, body=body, orelse=other):
                return self.cases(test, body, other), _LOGIC
            case ast.Tuple(elts=parts) | ast.List(elts=parts):
                return f"<mrow><mo>(</mo>{self.listed(parts)}<mo>)</mo></mrow>", _ATOM
            case ast.Starred(value=value):
                return self.write(value)
            case ast.Call(func=function, args=arguments, keywords=keywords) if all(one.arg for one in keywords):
                return self.call(function, [*arguments, *(one.value for one in keywords)])
            case _:
                raise Unreadable

    def inside(self, node: ast.expr) -> str:
        return self.write(node)[0]

    def within(self, node: ast.expr, strength: int) -> str:
        """The formula, in parentheses if it binds less than this."""
        text, own = self.write(node)
        return text if own >= strength else f"<mrow><mo>(</mo>{text}<mo>)</mo></mrow>"

    def listed(self, parts: list[ast.expr]) -> str:
        return "<mo>,</mo>".join(map(self.inside, parts))

    def operation(self, left: ast.expr, op: ast.operator, right: ast.expr) -> tuple[str, int]:
        match op:
            case ast.Div():
                return f"<mfrac><mrow>{self.inside(left)}</mrow><mrow>{self.inside(right)}</mrow></mfrac>", _POWER
            case ast.Pow():
                return f"<msup><mrow>{self.within(left, _ATOM)}</mrow><mrow>{self.inside(right)}</mrow></msup>", _POWER
            case ast.Mult() | ast.MatMult():
                a, b = self.within(left, _PRODUCT), self.within(right, _POWER)
                return f"{a}{_DOT if _is_word(left) or _is_word(right) else _SPACE}{b}", _PRODUCT
            case ast.Add() | ast.Sub():
                least = _PRODUCT if isinstance(op, ast.Sub) else _SUM
                return f"{self.inside(left)}<mo>{_JOINED[type(op)]}</mo>{self.within(right, least)}", _SUM
            case ast.BitAnd() | ast.BitOr():
                return f"{self.inside(left)}<mo>{_JOINED[type(op)]}</mo>{self.within(right, _COMPARE)}", _LOGIC
            case _:
                raise Unreadable

    def variable(self, node: ast.Attribute) -> str:
        """A variable of a part as its name with the part as index, with a dot for the derivative."""
        *path, name = _path(node)
        if path[0] in _MODULES:
            return _symbol(name)
        return _symbol(name, ".".join(path[1:]), with_dot=path[0] == self.rates)

    def call(self, function: ast.expr, arguments: list[ast.expr]) -> tuple[str, int]:
        name = _path(function)[-1] if isinstance(function, ast.Name | ast.Attribute) else ""
        match name, arguments:
            case "", _:
                raise Unreadable
            case "sqrt", [one]:
                return f"<msqrt>{self.inside(one)}</msqrt>", _ATOM
            case "abs" | "absolute", [one]:
                return f"<mrow><mo>&#124;</mo>{self.inside(one)}<mo>&#124;</mo></mrow>", _ATOM
            case "square", [one]:
                return f"<msup><mrow>{self.within(one, _ATOM)}</mrow><mn>2</mn></msup>", _POWER
            case "exp", [one]:
                return f"<msup><mi>e</mi><mrow>{self.inside(one)}</mrow></msup>", _POWER
            case (("where" | "ifelse"), [test, body, other]):
                return self.cases(test, body, other), _LOGIC
            case _:
                short = {"maximum": "max", "minimum": "min"}.get(name, name.strip("_").replace("_", " "))
                return f"<mi>{short}</mi><mrow><mo>(</mo>{self.listed(arguments)}<mo>)</mo></mrow>", _ATOM

    def cases(self, test: ast.expr, body: ast.expr, other: ast.expr) -> str:
        try:
            condition = self.inside(test)
        except Unreadable:
            condition = _text(test)
        rows = (
            (self.inside(body), f"<mtext>if&#160;</mtext>{condition}"),
            (self.inside(other), "<mtext>otherwise</mtext>"),
        )
        shown = "".join(f"<mtr><mtd>{value}</mtd><mtd>{when}</mtd></mtr>" for value, when in rows)
        return f'<mrow><mo>{{</mo><mtable class="cases">{shown}</mtable></mrow>'


def _text(node: ast.expr) -> str:
    """Code that is no formula, such as a test of an option or a slice."""
    return f"<mtext>{html.escape(ast.unparse(node).replace('self.', ''))}</mtext>"


def _path(node: ast.expr) -> list[str]:
    match node:
        case ast.Name(id=name):
            return [name]
        case ast.Attribute(value=value, attr=name):
            return [*_path(value), name]
        case _:
            raise Unreadable


def _is_word(node: ast.expr) -> bool:
    """Whether a factor is a name of several letters or a number in front of another factor."""
    name = node.attr if isinstance(node, ast.Attribute) else getattr(node, "id", "x")
    base = name.strip("_").partition("_")[0]
    return isinstance(node, ast.Call | ast.Constant) or (len(base) > 1 and base not in _GREEK)


def _symbol(name: str, part: str = "", *, with_dot: bool = False) -> str:
    base, *rest = name.strip("_").split("_")
    if len(base) > 1 and base not in _GREEK:
        base, rest = "_".join([base, *rest]), []  # words, such as rated_flow
    index = ",".join([part] * bool(part) + [_GREEK.get(one, one) for one in rest])
    shown = f"<mi>{html.escape(_GREEK.get(base, base))}</mi>"
    shown = f"<mover>{shown}<mo>˙</mo></mover>" if with_dot else shown
    return f"<msub>{shown}<mtext>{html.escape(index)}</mtext></msub>" if index else shown


def _number(value: float) -> str:
    mantissa, _, exponent = f"{value:g}".partition("e")
    if not exponent:
        return f"<mn>{mantissa}</mn>"
    power = f"<msup><mn>10</mn><mn>{int(exponent)}</mn></msup>"
    return power if mantissa == "1" else f"<mn>{mantissa}</mn><mo>⋅</mo>{power}"
