"""Texts that break a rule of the language are refused with the place and the rule (Modelica 3.6, chapters 3 to 16)."""

import re

import pytest
from flat_text import equations, flat, variables

from acausal.modelica import ModelicaError

KINDS = [
    ("package P Real x; end P; model M P p; end M;", "P is a package, and can have constants only"),
    ("record R Real x; equation x = 1; end R; model M R r; end M;", "R is a record, and cannot have equations"),
    ("record R protected Real x; end R; model M R r; end M;", "cannot have protected elements such as x"),
    ("record R flow Real x; end R; model M R r; end M;", "x cannot have the prefix `flow`"),
    ("connector C Real x; equation x = 1; end C; model M C c; end M;", "C is a connector, and cannot have equations"),
    ("expandable connector C flow Real f; end C; model M C c; end M;", "cannot have the flow variable f"),
    ("function f input Real x; output Real y; equation y = x; end f; model M Real y = f(1); end M;", "have equations"),
    ("function f input Real x; output Real y; Real z; algorithm y := x; end f; model M Real y = f(1); end M;",
     "z of a function must be an input, an output or protected"),
    ("function f inner input Real x; output Real y; algorithm y := x; end f; model M Real y = f(1); end M;",
     "x cannot have the prefix `inner`"),
    ('model M external "C" f(); end M;', "only a function can be external"),
    ('function f input Real x; output Real y; external "fish" y = g(x); end f; model M Real y = f(1); end M;',
     "the language fish of the external function is unknown"),
    ("class E extends ExternalObject; function constructor output E e; external; end constructor; end E; "
     "model M E e = E(); end M;", "the external object E has no destructor"),
    ("operator record C Real r; operator function 'constructor' input Real r; output C c(r = r); end 'constructor'; "
     "end C; model M C c = C(1); end M;", "must be encapsulated"),
    ("model M type E = enumeration(start, stop); E e; end M;", "start is an attribute of enumerations"),
    ("model M type E = enumeration(:); E e; end M;", "an enumeration without literals"),
    ("model Clock Real x; end Clock; model M Clock c; end M;", "Clock is the name of a predefined class"),
    ("model M Real Real; end M;", "Real is the name of a predefined type"),
    ("function f input Real x; end f; model M extends f; end M;", "M is a model, and cannot extend f"),
    ("record R input Real x = 1; end R; model M R r; end M;", "x cannot have the prefix `input`"),
    ("connector C inner Real x = 1; end C; model M C c; end M;", "x cannot have the prefix `inner`"),
    ("connector C Real e = 1; flow Real f; end C; block B C c; end B; model M B b; end M;",
     "b.c.e in a connector of the block B is no input or output"),
    ("operator record R Real x; end R; operator record S extends R; end S; model M S s; end M;",
     "R is an operator record, which only a short class definition can extend"),
    ("model A Real x = 1; end A; model A3 = A[3]; model B extends A3; Real y; end B; model M B b; end M;",
     "B extends A3, which has a size or a prefix"),
    ("type I = input Real; type J extends I; extends Real; end J; model M J j; end M;", "J extends I, which has"),
    ("record R Real x = time; end R; model M R r; end M;",
     "`time` is allowed in models and blocks, not in the record R"),
]  # fmt: skip

PREFIXES = [
    ("type I = input Real; model M output I x; end M;", "x has the prefix `output`, but its type has `input`"),
    ("type I = input Real; type O = output I; model M O x; end M;", "x has the prefix `output`, but its type"),
    ("connector A input Real x; end A; model M input A a; end M;",
     "x has the prefix `input`, and a around it has `input`"),
    ("connector C Real e; flow parameter Real f; end C; model M C c; end M;", "f is a flow variable, and cannot be a"),
    ("model M constant Real x(fixed = false) = 1; end M;", "a constant, which cannot have fixed = false"),
    ("model A Real x = 1; end A; model M parameter A a; end M;",
     "of the model A, and cannot have the prefix `parameter`"),
    ("model A Real x = 1; end A; model M output A a; end M;", "of the model A, and cannot have the prefix `output`"),
    ("connector C input Real x = 1; end C; model M constant C c; end M;", "cannot have the prefix `constant`"),
    ("connector C flow Integer f; Real e; end C; model M C c; end M;", "f is a flow variable, and must be a Real"),
    ("model M stream Real x = 1; end M;", "x is a stream variable, which is allowed in connectors only"),
    ("operator record R Real x; end R; connector C R e; flow R f; end C; model M C c; end M;",
     "R does not have the operator '0'"),
]  # fmt: skip

LOOKUP = [
    ("package P constant Real a = 1; end P; model M import P.a; import P.{a}; Real x = a; end M;", "M imports a twice"),
    ("partial package P model A Real x; end A; end P; model M P.A a; end M;", "P is partial"),
    ("model A replaceable model B Real x; end B; end A; model M extends A.B; end M;", "A.B is replaceable"),
    ("model A Real x; model A end A; end A; model M extends A; end M;", "M inherits A, which is not the one"),
    ("package P model A end A; model B end B; end P; model M import X = P.A; import X = P.B; X x; end M;",
     "M imports X twice"),
    ("package P package Q model A end A; end Q; package R model A Real x; end A; end R; end P; "
     "model M import P.Q.*; import P.R.*; A a; end M;", "A is in several packages"),
    ("model A protected function f output Real y = 1; end f; end A; model M A a; Real y = a.f(); end M;",
     "f is protected in A"),
    ("package P protected constant Real c = 1; end P; model M Real y = P.c; end M;", "c is protected in P"),
    ("model A package P constant Real c = 1; end P; end A; model M A a; Real y = a.P.c; end M;",
     "P is a class in the component a"),
    ("package P constant Real c = 1; end P; model M Real y = P; end M;", "P is a package, and no value"),
    ("type E = enumeration(a, b); model M E e = E.a[1]; end M;", "the literal a has no elements"),
    ("model A outer Real x; end A; model M inner Real x = 1; A a(x = 2); end M;", "changes x, which is outer"),
    ("model A outer parameter Real x; Real y = x; end A; model M inner Real x = time; A a; end M;",
     "x is a parameter, but x varies"),
    ("model B Real x; end B; model A outer model X = B(x = 1); X x; end A; model M inner model X = B; A a; end M;",
     "X is outer, and cannot have modifiers"),
    ("model A outer Real x; end A; model M inner model x = A; A a; end M;", "but the inner element is a class"),
    ("model A outer Real x; end A; model M Real x; A a; end M;", "has no inner component x around it"),
    ("model A function f output Real y = 1; end f; end A; model M A a[2]; Real y = a[1].f(); end M;",
     "a is an array, through which the function f cannot be called"),
    ("model A model B Real x; end B; end A; model M import A.B; B b; end M;", "A is no pack"),
    ("model A model B Real x; end B; end A; model M import A.*; B b; end M;", "A is no pack"),
    ("model M Real x if true; equation x = 1; end M;", "x has a condition, and can be modified and connected only"),
    ("model A function f output Real y = 1; end f; end A; model M A a if true; Real y = a.f(); end M;",
     "a has a condition"),
    ("package Q partial package P constant Real c = 1; end P; model A Real y = P.c; end A; end Q; "
     "model M extends Q.A; end M;", "P is partial, and names in it cannot be used from outside"),
]  # fmt: skip

MODIFICATION = [
    ("model A Real x; end A; model B String x; end B; model C replaceable A a; end C; "
     "model M C c(redeclare B a); end M;",
     "B.x is no Real, as in A, which it replaces"),
    ("model A Real x; end A; model B Real y; end B; model C replaceable A a; end C; model M C c(redeclare B a); end M;",
     "B has no x, as A has, which it replaces"),
    ("model M Real x[2](start = 1); end M;", "its attribute start has a scalar: it needs `each`"),
    ("model M Real x[2, 2](start = {1, 2}); end M;", r"x has size [2, 2], but its attribute start has size [2]"),
    ("model M Real x(redeclare Real start = 1); end M;", "start is an attribute, and cannot be redeclared"),
    ("model A Real x = 1; end A; model B protected extends A; end B; model M B b(x = 2); end M;", "x, which is prot"),
    ("model A Real x[2]; end A; model B Real x[2]; end B; model M extends A(x = {1, 2}); extends B; end M;",
     "M has two elements x that differ"),
    ("model A replaceable constant Real x = 1; end A; model M A a(redeclare constant Real x = 2); end M;",
     "x is a constant, and cannot be redeclared"),
    ("model A replaceable parameter Real x = 1; end A; model M A a(redeclare discrete Real x = 2); end M;",
     "x is declared parameter, and cannot become discrete"),
    ("model A replaceable Real x; end A; model M extends A; redeclare Real x if true; end M;", "cannot have a cond"),
    ("model A model B Real x; end B; end A; model M extends A; model extends B Real y; end B; B b; end M;",
     "B cannot be redeclared, because it is not replaceable"),
    ("model A Real x; end A; model D Real x, y; end D; model B replaceable A a; end B; "
     "model C extends B(redeclare A a); end C; model M extends C(redeclare D a); end M;",
     "a cannot be redeclared, because it is not replaceable"),
    ("model A Real x; end A; model B Real x, y; end B; model M replaceable A a constrainedby B; end M;",
     "A has no y, as B has, its constraint"),
    ("model A Real x; end A; model B Real x, y; end B; model M replaceable model C = A constrainedby B; C c; end M;",
     "A has no y, as B has, its constraint"),
    ("model A Real x; end A; model B Real x, y; end B; model C replaceable B b; end C; "
     "model M extends C(redeclare replaceable B b constrainedby A); end M;", "A has no y, as B has, which it replaces"),
    ("model A protected replaceable Real x = 1; end A; model M extends A; redeclare Real x = 2; end M;",
     "x is protected either here or in the base class"),
    ("model A replaceable model B Real x; end B; end A; "
     "model M extends A; protected redeclare model B Real x; end B; B b; end M;", "B is protected either here or"),
    ("model A Real x if true; end A; model B Real x; end B; model M extends A; extends B; end M;",
     "M has two elements x that differ"),
    ("model A Real x[2]; end A; model B Real x; end B; model M extends A; extends B; end M;",
     "M has two elements x that differ"),
]  # fmt: skip

VARIABILITY = [
    ("model M Real x = time; Boolean b = noEvent(x > 1); end M;", "b is a discrete variable, but its value varies"),
    ("model M Boolean b; equation b = noEvent(time > 1); end M;", "this variable is discrete"),
    ("model M discrete Real x; algorithm x := time; end M;", "this variable is discrete"),
    ("function f input Real x; output Integer y; algorithm y := integer(x); end f; model M Integer i = f(time); end M;",
     "i is a discrete variable, but its value varies"),
    ("function f input Real x; output Boolean y; algorithm y := x > 1; end f; "
     "model M equation when f(time) then end when; end M;", "`when` must be discrete"),
    ("model M Integer i = 1; Real y = der(i); end M;", "`der` needs a continuous value"),
    ("model M Real x, y = der(x); equation when time > 1 then x = 1; end when; end M;", "`der` needs a continuous"),
    ("model M Real x = time; equation when pre(x) > 1 then end when; end M;", "`pre` of a continuous variable"),
    ("model M Real x; equation when noEvent(time > 0) then x = 1; end when; end M;", "`when` must be discrete"),
    ("model M constant Real x = log(2 - 3); end M;", "the value of the constant x is not a number"),
    ("model M Integer n = 3; Real x[3] = fill(0, n); end M;", "a size of `fill` must be a constant or parameter"),
    ("model M Real x[1] = {1/0}; end M;", "a division by zero"),
    ("function f input Real x; output Real y; algorithm y := f(x + 1); end f; model M constant Real x = f(1); end M;",
     "functions contain themselves here"),
    ("function f input Real x; output Real y; protected Real a = b; Real b = a; algorithm y := x; end f; "
     "model M Real y = f(time); end M;", "the value of a depends on itself"),
]  # fmt: skip

CLAUSES = [
    ("function f input Real x; output Real y; algorithm y := x; break; end f; model M Real y = f(1); end M;",
     "`break` is allowed in `for` and `while` only"),
    ("model M Real x; algorithm when time > 0 then reinit(x, 2); end when; end M;", "equations of when-clauses only"),
    ("model M Real x, y; equation when time > 0 then x = 0; elsewhen time > 1 then y = 0; end when; end M;",
     "only one branch of `when` gives x a value"),
    ("model M Real x, y; equation when time > 0 then if x > 0 then x = 0; else y = 0; end if; end when; end M;",
     "only one branch of `if` gives x a value"),
    ("model M Real x; equation when Clock(0.1) then x = 0; elsewhen Clock(0.2) then x = 1; end when; end M;",
     "must be Boolean, not of type Clock"),
    ("model M Real x; algorithm when Clock(1) then x := 0; end when; end M;", "must be Boolean, not of type Clock"),
    ("connector C Real e; flow Real f; end C; model M C c; Integer n = cardinality(c); end M;",
     "`cardinality` is allowed in conditions"),
]  # fmt: skip

CALLS = [
    ("type E = enumeration(a, b); model M E x[2] = E.a:E.a:E.b; end M;", "only numbers have steps"),
    ("model M Real x = sum(0); end M;", "`sum` needs an array, not a scalar"),
    ("model M Real x[2, 3] = symmetric({{1, 2, 3}, {4, 5, 6}}); end M;", "`symmetric` needs a square matrix"),
    ("model M Real x = pure(1.0); end M;", "`pure` needs the call of a function"),
    ("model M String s = String(1, 3, false); end M;", "need their names"),
    ("model M String s = String(1, minimumLength = true); end M;", "minimumLength of `String` must be of type Integer"),
    ("model M Real x = product({1, 2} for i in 1:3); end M;", "`product` needs scalars"),
    ("model M Real x[2, 2]; equation x = {{1, 2}, {3, 4}}^(-1); end M;", "`^` cannot have"),
    ("model M type E = enumeration(a, b); Real x[E]; Real y = x[1]; end M;", "of type enumeration E, not Integer"),
    ("model M type E = enumeration(a, b); Real x[2]; Real y = x[E.a]; end M;", "of type Integer, not enumeration E"),
    ("function f input Real x; output Real y; algorithm y := x; annotation(inverse(y = g(x))); end f; "
     "model M Real y = f(1); end M;", "f has no input y, which its inverse names"),
    ("function f input Real x; output Real y; algorithm y := x; annotation(derivative(order = y) = g); end f; "
     "model M Real y = f(1); end M;", "the order of a derivative of f must be an Integer"),
    ('partial function g input Real x; output Real y; external "C"; end g; function f extends g; external "C"; end f; '
     "model M Real y = f(1); end M;", "f has 2 algorithms or external functions"),
    ("model M Real x = acos(-2); end M;", "`acos` is not defined for -2"),
    ("model M Real x = log(0); end M;", "`log` is not defined for 0"),
    ("model M Real x = delay(time, 2, 1); end M;", "the delay 2 is greater than its limit 1"),
    ("function f input Real x; output Real y = x; output Real z = x; algorithm end f; "
     "model M Real x[2] = f({1, 2}); end M;", "f has 2 results, and cannot be called with arrays"),
]  # fmt: skip

CONNECTIONS = [
    ("connector C Real e; flow Real f; end C; model A C c; end A; model B A a; end B; "
     "model M B b; C c; equation connect(b.a.c, c); end M;", "inside of a part of b"),
    ("connector C = input Real; connector D = Real; model M C c; D d; equation connect(c, d); end M;",
     "c is an input, but d is neither"),
    ("connector O = output Real; model A O y = 1; end A; model M A a, b; equation connect(a.y, b.y); end M;",
     "both a.y and b.y give a value"),
    ("connector C = input Real; model M C c; equation Connections.root(c); end M;", "with the function equalityCon"),
    ("connector C constant Real p = 1; Real e; flow Real f; end C; "
     "connector D parameter Real p = 1; Real e; flow Real f; end D; "
     "model M C c; D d; equation connect(c, d); end M;", "only one is a constant"),
]  # fmt: skip

COMPLEX = """operator record C Real r;
      encapsulated operator '+' import C; import D;
        function a input C x; input D y; output C z; algorithm z.r := x.r; end a; end '+'; end C;
    operator record D Real r;
      encapsulated operator '+' import C; import D;
        function b input C x; input D y; output C z; algorithm z.r := y.r; end b; end '+'; end D; """
OPERATORS = [
    (COMPLEX + "model M C c = C(1), e; D d = D(1); equation e = c + d; end M;", "several functions of the operator"),
    ("operator record C Real r, s; encapsulated operator function 'constructor' import C; input Real r; "
     "output C c(r = r, s = 1); end 'constructor'; end C; model M C c = C(1, 2); end M;", "'constructor' has 1 inputs"),
    ("operator record C Real r; encapsulated operator function 'constructor' input Real r; output Real x = r; "
     "end 'constructor'; end C; model M C c = C(1); end M;", "must have one output, of type C"),
]  # fmt: skip


@pytest.mark.parametrize(
    ("text", "message"),
    [*KINDS, *PREFIXES, *LOOKUP, *MODIFICATION, *VARIABILITY, *CLAUSES, *CALLS, *CONNECTIONS, *OPERATORS],
)
def test_what_breaks_a_rule_is_refused(text: str, message: str) -> None:
    with pytest.raises(ModelicaError, match=re.escape(message)) as found:
        flat(text)
    assert re.match(r"<model>\.mo:\d+:\d+: ", str(found.value))


def test_legal_neighbours_of_refused_texts() -> None:
    assert variables("model M Real x[2](each start = 1); end M;") == {"x[2]": None}
    assert variables("type V = Real(start = 1); model M V x[2]; end M;") == {"x[2]": None}
    assert variables("model A Real x = 1; end A; model M extends A(x = 2); extends A(x = 2); end M;") == {"x": "2"}
    assert variables("model M type E = enumeration(a, b); Real x[E]; Real y = x[end]; end M;")["y"] == "x[2]"
    assert equations("model M Real x[Boolean]; equation for i loop x[i] = 1; end for; end M;") == [
        "x[1] = 1", "x[2] = 1",
    ]  # fmt: skip
    whens = flat("""model M Real x[3];
        equation when time > 0 then x = {1, 2, 3}; elsewhen time > 1 then x[1:2] = {3, 2}; x[3] = 5; end when;
        end M;""").whens
    assert len(whens[0].blocks) == 2


def test_constants_of_records_may_depend_on_constants_without_a_value() -> None:
    text = """
        record R constant Boolean b; final constant Integer n = if b then 1 else 3; parameter Real x[n] = ones(n);
        end R;
        record S extends R(final b = false); end S;
        model M parameter S s; parameter R r = s; end M;"""
    assert list(variables(text)) == ["s.b", "s.n", "s.x[3]", "r.b", "r.n", "r.x[3]"]


def test_extreme_elements_of_empty_arrays_are_the_limits_of_their_type() -> None:
    assert variables("""model M type E = enumeration(a, b);
        Integer i = min(k for k in 1:0); Boolean b = max(k for k in true:false); E e = min(k for k in E.b:E.a);
        Real s = sum(j for j in 1:i, i in 1:3); end M;""") == {
        "i": "2147483647", "b": "false", "e": "E.b", "s": "Sum({Sum({1}), Sum({1, 2}), Sum({1, 2, 3})})",
    }  # fmt: skip


def test_values_of_functions_are_evaluated_in_the_order_in_which_they_depend_on_each_other() -> None:
    found = flat("""function f input Real x; output Real y;
        protected Real a = b + 1; Real b = x; algorithm y := a; end f;
        model M Real y = f(time); end M;""").functions["f"]
    assert [one.name for one in found.locals] == ["b", "a"]


def test_a_sum_of_arrays_is_an_array() -> None:
    assert variables("""model M parameter Integer n = 0; Real y[2] = sum({i, 2*i} for i in 1:3);
        Real z[2] = sum({i, i} for i in 1:n); end M;""") == {
        "n": "0", "y[2]": "Sum({{1, (2 * 1)}, {2, (2 * 2)}, {3, (2 * 3)}}, 1)", "z[2]": "Zeros(2)",
    }  # fmt: skip
    with pytest.raises(ModelicaError, match=re.escape("y has size a scalar, but its value has size [2]")):
        flat("model M Real y = sum({i, 2*i} for i in 1:3); end M;")


def test_an_array_has_a_unit_if_its_elements_have_the_same() -> None:
    found = flat('model M Real x[2](unit = {"m", "rad"}), y[2](unit = {"m", "m"}), z[2](each unit = "(kg/s)"); end M;')
    assert {v.name: v.unit for v in found.variables.values()} == {"x": None, "y": "m", "z": "kg/s"}


OVERLOADED = """
    operator record A Real x; encapsulated operator 'constructor' import A; import B;
        function from_record input B b; output A a(x = b.y); end from_record;
        function from_number input Real k; output A a(x = 10 * k); end from_number; {} end 'constructor'; end A;
    operator record B Real y; encapsulated operator 'constructor' import B;
        function from_number input Real k; output B b(y = k); end from_number; end 'constructor'; end B;
    model M constant A a = A(2); end M;"""


def test_the_constructor_whose_inputs_have_the_types_of_the_arguments_is_called() -> None:
    assert variables(OVERLOADED.replace("{}", "")) == {"a.x": "(A.'constructor'.from_number(2)).x"}


def test_two_constructors_that_fit_are_refused() -> None:
    second = "function second input Real k; output A a(x = k); end second;"
    with pytest.raises(ModelicaError, match="more than one constructor of A fits"):
        flat(OVERLOADED.replace("{}", second))


def test_the_flow_of_a_stream_is_a_scalar() -> None:
    text = """connector P Real p; flow Real m[2]; stream Real h; end P; model A P a; equation a.h = 1; end A;
        model M A x, y, z; Real t = inStream(x.a.h); equation connect(x.a, y.a); connect(x.a, z.a); end M;"""
    with pytest.raises(ModelicaError, match="must have one flow variable, a scalar"):
        flat(text)
