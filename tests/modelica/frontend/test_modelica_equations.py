"""Expressions, equations, statements and functions (Modelica 3.6, chapters 3, 8, 10, 11, 12 and 14)."""

import pytest
from flat_text import equations, flat, text, variables

from acausal.modelica import ModelicaError


def test_arrays_stay_together_and_arrays_of_components_are_written_out() -> None:
    source = """
        model A Real x; Real y[2]; end A;
        model M parameter Integer n = 2; A a[n]; Real v[n], w[2, n];
        equation v = a.x; for i in 1:n loop a[i].x = i*time; a[i].y = {i, 2}; end for; w = a.y; end M;"""
    assert equations(source) == [
        "v = {a[1].x, a[2].x}",
        "a[1].x = (1 * time)",
        "a[1].y = {1, 2}",
        "a[2].x = (2 * time)",
        "a[2].y = {2, 2}",
        "w = {a[1].y, a[2].y}",
    ]


def test_sizes_conditions_and_ranges_follow_parameters_and_functions() -> None:
    source = """
        function count input Integer n; output Integer m = 0;
        algorithm for i in 1:n loop m := m + i; end for; end count;
        model M
          parameter Integer n = count(2); parameter Boolean b = n > 2;
          Real x[n], y[size(x, 1) - 1] = x[2:end] if b, z if not b;
        equation x = {i^2 for i in 1:n}; end M;"""
    assert list(variables(source)) == ["n", "b", "x[3]", "y[2]"]
    assert equations(source) == ["x = {(1 ^ 2), (2 ^ 2), (3 ^ 2)}"]
    assert variables(source)["y[2]"] == "x[{2, 3}]"
    assert {text(one) for one in flat(source).selecting} >= {"n", "b"}


def test_sizes_from_values_and_from_other_sizes() -> None:
    source = "model M parameter Real x[:, :] = [1, 2; 3, 4; 5, 6]; Real y[size(x, 2), 3]; Real z[size(z, 2), 2]; end M;"
    assert list(variables(source)) == ["x[3, 2]", "y[2, 3]", "z[2, 2]"]


def test_a_size_of_an_input_that_another_size_gives() -> None:
    source = """
        function f input Real a[:, size(a, 1)]; output Real y = a[1, 1]; end f;
        model M Real y = f([1, 2; 3, 4]); end M;"""
    assert variables(source) == {"y": "f({{1, 2}, {3, 4}})"}
    assert text(flat(source).functions["f"].inputs[0].dims) == ":; Size(a, 1)"


def test_enumerations_as_sizes_indices_and_ranges() -> None:
    source = """
        type E = enumeration(a, b, c);
        model M Real x[E]; E e = E.b; Real y; Boolean t[Boolean];
        equation for i in E loop x[i] = Integer(i); end for; y = x[E.c]; t = {false, true}; end M;"""
    assert equations(source) == ["x[1] = E.a", "x[2] = E.b", "x[3] = E.c", "y = x[3]", "t = {false, true}"]
    found = flat(source)
    assert found.variables["x"].dims == (3,)
    assert found.variables["t"].dims == (2,)
    assert found.enumerations["E.b"] == 2


def test_if_equations_of_parameters_are_chosen_and_others_are_kept() -> None:
    source = """
        model M parameter Boolean b = false; parameter Real p = 1; Real x, y, z;
        equation
          if b then x = 1; else x = 2; end if;
          if p > 0 then y = 1; else y = 2; end if;
          if time > 1 then z = 1; elseif time > 0.5 then z = 2; else z = 3; end if;
        end M;"""
    assert equations(source) == [
        "x = 2",
        "y = 1",
        "if (time > 1) then (z - 1) elseif (time > 0.5) then (z - 2) else (z - 3) = 0",
    ]


def test_branches_with_vectors_and_scalars_are_matched_by_elements() -> None:
    source = """
        model M Real v[2]; equation if time > 1 then v = {1, 2}; else v[1] = 3; v[2] = 4; end if; end M;"""
    assert equations(source) == [
        "if (time > 1) then (v[1] - 1) else (v[1] - 3) = 0",
        "if (time > 1) then (v[2] - 2) else (v[2] - 4) = 0",
    ]


def test_when_clauses_and_assertions() -> None:
    source = """
        model M Real x; discrete Real d; Integer n;
        equation
          der(x) = 1; assert(x < 5, "too large");
          if x > 2 then assert(x < 3, "no"); end if;
          when {x > 1, time > 2} then d = pre(d) + 1; reinit(x, 0); elsewhen x > 2 then d = 0; end when;
          when time > 1 then for i in 1:2 loop if i == 2 then n = i; end if; end for; end when;
        end M;"""
    found = flat(source)
    assert [text(one) for one in found.whens] == [
        "when {(x > 1), (time > 2)} then d := (Pre(d) + 1); reinit(x, 0) elsewhen (x > 2) then d := 0 end when",
        "when (time > 1) then n := 2 end when",
    ]
    assert [text(one) for one in found.asserts] == [
        "assert((x < 5), 'too large')",
        "assert((not (x > 2) or (x < 3)), 'no')",
    ]


def test_algorithms() -> None:
    source = """
        model A Real x; end A;
        model M A a[2]; Real y, z[2];
        algorithm y := 0; for i in 1:2 loop a[i].x := i; y := y + a[i].x; end for; z[2] := y;
          while y > 1 loop y := y/2; end while; if y > 0 then z[1] := 1; else z[1] := 2; end if;
        end M;"""
    (algorithm,) = flat(source).algorithms
    assert algorithm.outputs == ("y", "a[1].x", "a[2].x", "z")
    assert text(algorithm.body) == (
        "y := 0; a[1].x := 1; y := (y + a[1].x); a[2].x := 2; y := (y + a[2].x); z[2] := y; While; "
        "if (y > 0) then z[1] := 1 else z[1] := 2 end if"
    )


def test_functions_with_records_defaults_and_several_results() -> None:
    source = """
        record R Real x = 1; Real y[2]; end R;
        function f input R r; input Real k = 2; output Real s; output Real t = 5; protected Real q[size(r.y, 1)];
        algorithm q := r.y; s := k*r.x + q[1]; end f;
        model M R r(y = {1, 2}); Real a, b; equation (a, b) = f(r); f(R(y = {3, 4}), k = 1) = b + 1; end M;"""
    assert equations(source) == ["(a, b) = f(r)", "f(R(1, {3, 4}), 1) = (b + 1)"]
    function = flat(source).functions["f"]
    assert [(one.name, one.type) for one in function.inputs] == [("r", "R"), ("k", "Real")]
    assert text(function.body) == "q := r.y; s := ((k * r.x) + q[1])"


def test_functions_of_arrays_of_records_and_enumerations_have_values() -> None:
    source = """
        type E = enumeration(a, b, c);
        record R Integer n; Integer v[2]; end R;
        function f input Integer n; output R r[n];
        algorithm for i in 1:n loop r[i].n := i; r[i].v[1] := 10*i; end for; end f;
        function g input R r[:]; output Integer s; protected E e[2];
        algorithm e[1] := E.b; e[2] := E.c; s := r[2].n + r[3].v[1] + Integer(e[2]); end g;
        model M Real x[g(f(3))]; end M;"""
    assert list(variables(source)) == ["x[35]"]


def test_functions_as_arguments_get_a_copy_of_the_function() -> None:
    source = """
        partial function F input Real x; output Real y; end F;
        function g input Real x; input Real k; output Real y; algorithm y := k*x; end g;
        function twice input F f; input Real x; input Real last = 1; output Real y; algorithm y := f(f(x)); end twice;
        model M parameter Real p = 3; Real y = twice(function g(k = p), time); end M;"""
    assert variables(source)["y"] == "twice(f=g|k)(p, time)"
    assert text(flat(source).functions["twice(f=g|k)"].body) == "y := g(g(x, f__k), f__k)"


def test_records_are_equal_by_their_fields() -> None:
    source = """
        record R Real a; Real b; end R;
        function f output R r; algorithm r.a := 1; r.b := 2; end f;
        model M R r, s, t; parameter R p = R(1, 2); parameter R q = p;
        equation r = s; t = f(); s = R(b = 3, a = 4); end M;"""
    assert equations(source) == ["r.a = s.a", "r.b = s.b", "t = f()", "s.a = 4", "s.b = 3"]
    found = variables(source)
    assert (found["p.a"], found["p.b"], found["q.a"], found["q.b"]) == ("1", "2", "p.a", "p.b")


def test_the_value_of_a_record_replaces_those_of_its_fields() -> None:
    source = """
        record R parameter Real x = 1; parameter Real y = 2; end R;
        model A parameter R r = R(5, 6); end A;
        model M A a; A b(r(x = 7)); A c(r = R(8, 9)); parameter R v[2] = {R(1, 2), R(3, 4)}; end M;"""
    assert variables(source) == {
        "a.r.x": "5", "a.r.y": "6", "b.r.x": "7", "b.r.y": "6", "c.r.x": "8", "c.r.y": "9",
        "v[1].x": "1", "v[1].y": "2", "v[2].x": "3", "v[2].y": "4",
    }  # fmt: skip


def test_operators_of_records() -> None:
    source = """
        operator record V Real a;
          encapsulated operator '+' function add import V; input V x; input V y; output V z;
            algorithm z := V(x.a + y.a); end add; end '+';
          encapsulated operator 'constructor' function of import V; input Real r; output V z(a = r); algorithm end of;
          end 'constructor';
        end V;
        model M V x, y, z; equation x = y + z; y = x + 1; end M;"""
    assert equations(source) == ["x = V.'+'.add(y, z)", "y = V.'+'.add(x, V.'constructor'.of(1))"]


@pytest.mark.parametrize(
    ("text_of_model", "message"),
    [
        ("Real x[2] = {1, 2, 3};", r"x has size \[2\], but its value has size \[3\]"),
        ("Real x = true;", "x is of type Real, but its value is of type Boolean"),
        ("Integer n = 1.5;", "n is of type Integer, but its value is of type Real"),
        ("parameter Real p = time;", "p is a parameter, but its value varies"),
        ("Real x[2]; equation x = 1;", r"different sizes: \[2\] and a scalar"),
        ('Real x; equation x = "a";', "different types: Real and String"),
        ("Real x = {1, 2} + {1, 2, 3};", "`\\+` cannot have"),
        ("Real x = {1, true};", "the elements have different types"),
        ("Real x[2]; Real y = x[3];", "the subscript 3 is out of bounds: the size is 2"),
        ("Real x; Real y = x[1];", "x has 0 dimensions, but 1 subscripts"),
        ("Real x = sin(1, 2);", "`sin` has 2 arguments"),
        ("Real x = if 1 then 2 else 3;", "must be a Boolean scalar"),
        ("Real x[10] = 1:1e-300:10;", "the step 1e-300 of the range from 1 to 10 is too small"),
        ("Real x[-1];", "the size of x is -1"),
        ("Real n; Real x[n];", "a size must be a scalar Integer"),
        ("Integer n; Real x[n];", "is not a constant or parameter"),
        ("parameter Integer n; Real x[n];", "needs a value that is not known"),
        ("Real x[:];", "needs a value that gives it"),
        ("Real x[size(x, 1)];", "depends on itself"),
        ("parameter Integer a = b; parameter Integer b = a; Real x[a];", "depends on itself"),
        ("Real x; equation if time > 1 then x = 1; end if;", "different numbers of equations"),
        ("parameter Real p = 1; algorithm p := 2;", "is a parameter, and cannot be assigned"),
        ("Real x; algorithm x := {1, 2};", "x has size a scalar, and cannot get"),
        ("Real x; equation reinit(x, 1);", "allowed in when-clauses only"),
        (
            "Real x; algorithm when time > 1 then when time > 2 then x := 1; end when; end when;",
            "not allowed in `when`",
        ),
        ("Real x; equation when x then x = 1; end when;", "the condition of `when` must be Boolean"),
        (
            "Real x = f(1); function f input Real a; input Real b; output Real c; end f;",
            "the input b of f gets no argument",
        ),
        ("Real x = f(1, b = 2); function f input Real a; output Real c; end f;", "f has no input b"),
        ("Real x = f(true); function f input Real a; output Real c; end f;", "is of type Real, not Boolean"),
        ("Real x = spatialDistribution(1, 2, 3, true);", "`spatialDistribution` is not supported"),
        ("Real x = f(1); impure function f input Real a; output Real c = a; end f;", "f is impure"),
        ("constant Real x = f(1); impure function f input Real a; output Real c = a; end f;", "f is impure"),
        (
            "parameter Real p = f(time); impure function f input Real a; output Real c = a; end f;",
            "p is a parameter, but its value varies",
        ),
    ],
)
def test_wrong_texts_are_refused_with_their_place(text_of_model: str, message: str) -> None:
    with pytest.raises(ModelicaError, match=message) as found:
        flat(f"model M {text_of_model} end M;")
    assert str(found.value).startswith("<model>.mo:1:")


@pytest.mark.parametrize(
    ("text_of_model", "message"),
    [
        ('Real x(start = "a");', "the attribute start of x is of type Real, not String"),
        ("Real x(fixed = 1);", "the attribute fixed of x is of type Boolean, not Integer"),
        ("Real x[2, 3](start = {3, 1});", r"its attribute start has size \[2\]"),
        ("Real x(start(y = 1));", "the attribute start has no elements"),
        ("constant Real c;", "the constant c has no value"),
        ("Real x = a.y; A a; model A protected Real y; end A;", "y is protected in A"),
        ("A a, b = a; model A Real y; end A;", "b is a model, which has no value"),
        ("model A Real y; end A; A a, b; algorithm a := b;", "cannot be assigned"),
        ("Real x; algorithm if x > 1 then when time > 1 then x := 1; end when; end if;", "nor in `if`"),
        ("Real x; initial equation when time > 1 then x = 1; end when;", "not allowed in an initial equation section"),
        (
            "function f output Real y = time; end f; Real x = f();",
            "`time` is allowed in models and blocks, not in the function f",
        ),
        ("function f output Real y; algorithm y := 1; algorithm y := 2; end f; Real x = f();", "has 2 algorithms"),
        (
            "model A model T Real y; end T; end A; model B end B; A a(T = B);",
            "T is a class, which `redeclare` replaces",
        ),
        (
            "Real x[3], y[4]; equation for i loop x[i] = y[i]; end for;",
            "x\\[...\\] and y\\[...\\] have different sizes",
        ),
        ('String s = max({"a", "b"});', "needs an array of numbers"),
        ("Boolean b = sample(0, q); Real q = time;", "arguments of `sample` must be parameters"),
        ("T x; type T extends Real; Real y; end T;", "which cannot have the element y"),
        (
            "function f output Real a, b; end f; Real x, y; equation (x + 1, y) = f();",
            "must have variables",
        ),
        ("inner Real x; A a; model A outer Real x = 1; end A;", "its declaration cannot have a modification"),
        ("inner B b; A a; model B end B; model C Real y; end C; model A outer C b; end A;", "B has no y, as C has"),
    ],
)
def test_wrong_declarations_are_refused(text_of_model: str, message: str) -> None:
    with pytest.raises(ModelicaError, match=message) as found:
        flat(f"model M {text_of_model} end M;")
    assert str(found.value).startswith("<model>.mo:1:")


def test_a_part_of_an_array_of_components_is_assigned_variable_by_variable() -> None:
    found = flat("record R Real x; end R; model M R r[2]; Real y[2] = {1, 2}; algorithm r.x := y; end M;")
    assert text(found.algorithms[0].body) == "r[1].x := y[1]; r[2].x := y[2]"
    with pytest.raises(ModelicaError, match="its value cannot read them"):
        flat("record R Real x; end R; model M R r[2]; algorithm r.x := {r[2].x, r[1].x}; end M;")


def test_options_of_string_shape_known_values() -> None:
    found = variables("""model M parameter Integer n = 12;
        parameter String a = String(n, minimumLength = 5), b = String(n, minimumLength = 5, leftJustified = false);
        parameter String c = String(3.14159, significantDigits = 3), d = String(2.5, format = "6.2f");
        parameter String e = String(n); end M;""")
    literal = variables("""type E = enumeration(a, bc); model M parameter E x = E.bc;
        parameter String s = String(x, minimumLength = 4), t = String(x, minimumLength = 4, leftJustified = false);
        end M;""")
    assert literal == {"x": "E.bc", "s": "'bc  '", "t": "'  bc'"}
    assert found == {"n": "12", "a": "'12   '", "b": "'   12'", "c": "'3.14'", "d": "'  2.50'", "e": "String(n)"}


OPERATORS = """
    operator record C Real r;
      encapsulated operator '+' import C; function f input C a; input C b; output C c; algorithm c.r := a.r + b.r;
        end f; end '+';
      encapsulated operator '*' import C; function f input C a; input C b; output C c; algorithm c.r := a.r * b.r;
        end f; end '*';
      encapsulated operator function 'String' import C; input C a; output String s; algorithm s := String(a.r);
        end 'String';
    end C; """


def test_arrays_and_texts_of_operator_records() -> None:
    assert variables(OPERATORS + "model M parameter C a[2], p = a*a; parameter String s = String(a[1]); end M;") == {
        "a[1].r": None, "a[2].r": None, "s": "C.'String'(a[1])",
        "p.r": "(C.'+'.f(C.'*'.f(a[1], a[1]), C.'*'.f(a[2], a[2]))).r",
    }  # fmt: skip


def test_arrays_of_different_sizes_are_no_array() -> None:
    with pytest.raises(ModelicaError, match="the elements of a have different sizes here"):
        flat("model A parameter Integer n; Real x[n]; end A; model M A a[2](n = {1, 2}); Real s[2, 2] = a.x; end M;")


def test_promote_adds_dimensions_and_terminate_outside_of_when_ends_at_the_start() -> None:
    source = (
        'model M Real x, y[2]; Real a[2, 1] = promote(y, 2), b[1] = promote(x, 1); equation terminate("end"); end M;'
    )
    found = variables(source)
    assert (found["a[2, 1]"], found["b[1]"]) == ("{{y[1]}, {y[2]}}", "{x}")
    assert text(flat(source).whens[0]) == "when Initial() then assert(false, 'end') end when"


@pytest.mark.parametrize(
    ("call", "expected"),
    [
        ("homotopy(actual = x, simplified = 2)", "Homotopy(x, 2)"),
        ("homotopy(simplified = 2, actual = x)", "Homotopy(x, 2)"),
        ("homotopy(x, simplified = 2)", "Homotopy(x, 2)"),
        ("smooth(expr = x, p = 1)", "Smooth(1, x)"),
        ("delay(delayTime = 1, expr = x)", "Delay(x, 1)"),
        ("mod(y = 2, x = x)", "Mod(x, 2)"),
        ("homotopy(x, actual = 2)", "no argument actual, or has it twice"),
        ("delay(x, delayMax = 2)", "needs a value of its argument delayTime"),
    ],
)
def test_arguments_of_operators_by_name(call: str, expected: str) -> None:
    source = f"model M Real x = time; Real y = {call}; end M;"
    if expected[0].isupper():
        assert variables(source)["y"] == expected
    else:
        with pytest.raises(ModelicaError, match=expected):
            variables(source)


@pytest.mark.parametrize(
    ("reset", "expected"),
    [
        ("reinit(x, {1, 2, 3})", "reinit(x, {1, 2, 3})"),
        ("reinit(x[k], 1)", "reinit(x[2], 1)"),
        ("reinit(x[2:3], {4, 5})", "reinit(x[2], 4); reinit(x[3], 5)"),
        ("reinit(y[2, :], {4, 5})", "reinit(y[2, 1], 4); reinit(y[2, 2], 5)"),
        ("reinit(a.z, {4, 5})", "reinit(a[1].z, 4); reinit(a[2].z, 5)"),
        ("reinit(expr = 1, x = a[2].z)", "reinit(a[2].z, 1)"),
        ("reinit(x[i], 1)", "a subscript of the variable of `reinit` must be known"),
        ("reinit(-x[1], 1)", "needs a variable, not an expression"),
    ],
)
def test_new_values_of_elements_of_arrays(reset: str, expected: str) -> None:
    source = f"""
        model A Real z; end A;
        model M parameter Integer k = 2; Integer i = integer(time); Real x[3], y[2, 2]; A a[2];
        equation when time > 1 then {reset}; end when; end M;"""
    if "must be" in expected or "needs" in expected:
        with pytest.raises(ModelicaError, match=expected):
            flat(source)
    else:
        (when,) = flat(source).whens
        assert text(when.blocks[0][1]) == expected


@pytest.mark.parametrize(
    "text_of_model",
    [
        "parameter Real p = f(1);",
        "Real x = pure(f(time));",
        "Real x; equation when time > 1 then x = f(2); end when;",
        "parameter Real p(fixed = false); initial equation p = f(3);",
    ],
)
def test_impure_functions_are_called_at_the_start_and_at_events(text_of_model: str) -> None:
    flat(f"impure function f input Real a; output Real b = a; end f; model M {text_of_model} end M;")


@pytest.mark.parametrize(
    ("first", "second"),
    [("reinit(x, {1, 1})", "reinit(x[2], 2)"), ("reinit(x[1], 1)", "for i in 1:2 loop reinit(x[i], 2); end for")],
)
def test_a_state_gets_new_values_in_one_when_clause_only(first: str, second: str) -> None:
    text_of_model = f"""model A Real x[2](each start = 1); equation der(x) = {{1, 2}};
        when time > 1 then {first}; end when; when time > 2 then {second}; end when; end A; model M A a; end M;"""
    with pytest.raises(ModelicaError, match=r"a.x\[[12]\] has a `reinit` in another when-clause, too"):
        flat(text_of_model)
    flat(text_of_model.replace("end when; when", "elsewhen"))


@pytest.mark.parametrize(
    "text_of_model",
    [
        "Real x = if time > 2 then sqrt(-4) else 1 / 2;",
        "Real x = if time > 2 then 1 else 1 / 0;",
        "Real x; equation if time > 2 then x = log(-1); else x = 1; end if;",
        "Real x; algorithm x := 1; if time > 2 then x := sqrt(-4); end if;",
    ],
)
def test_what_a_branch_may_never_evaluate_is_not_refused(text_of_model: str) -> None:
    flat(f"model M {text_of_model} end M;")


def test_names_in_functions_are_not_those_of_the_model() -> None:
    record = "record R Real x; end R; "
    text_of_model = """function f input R a; input Real m[:, :]; output R b; protected Integer i = 2;
        algorithm b := R(10 * a.x + size(m, i)); end f;
        model M parameter Integer i = 1; constant R a = R(1); constant R b = f(R(7), [1, 2, 3]);
        constant Real y[integer(b.x)]; constant Real z[i]; end M;"""
    text_of_model = text_of_model.replace("constant Real y", "Real y").replace("constant Real z", "Real z")
    assert [v.dims for v in flat(record + text_of_model).variables.values() if v.dims] == [(73,), (1,)]
