"""Functions of Modelica texts: known and traced values agree, in both modes of differentiation."""

import math
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from numpy.testing import assert_allclose

from acausal import ModelError
from acausal.modelica import load
from acausal.modelica._frontend.flatten import flat_model
from acausal.modelica._translate.external import BY_NAME, EXTERNAL
from acausal.modelica._translate.functions import Library

TEXT = """
model M
  function root
    input Real x;
    output Real y;
  algorithm
    if x > 0 then
      y := sqrt(x);
    else
      y := 0;
    end if;
  end root;
  function logarithm
    input Real x;
    output Real y;
  algorithm
    y := if x > 1 then x*log(x - 1) else x;
  end logarithm;
  function length
    input Real x;
    output Real y;
  protected
    Real v[2] = {3*x, 4*x};
  algorithm
    y := sqrt(v*v + sum(v.^2) + (2*x)^2);
  end length;
  function checked
    input Real x;
    output Real y;
  algorithm
    y := x;
    if x < 0 then
      assert(false, "x is negative");
    else
      y := 3*x;
    end if;
  end checked;
  function newton "the root of x by Newton's iteration"
    input Real x;
    output Real y;
  protected
    Integer i;
    Boolean found;
  algorithm
    i := 0;
    found := false;
    y := x;
    while i < 50 and not found loop
      found := abs(y*y - x) < 1e-14*x;
      y := (y + x/y)/2;
      i := i + 1;
    end while;
  end newton;
  function position "the first number of v above x"
    input Real v[:];
    input Real x;
    output Integer i;
  algorithm
    i := 1;
    while i < size(v, 1) and v[i] <= x loop
      i := i + 1;
    end while;
  end position;
  function two
    input Real x;
    output Real y;
    output Real z;
  algorithm
    y := x;
    z := x^2;
  end two;
  function horner "a polynomial"
    input Real c[:];
    input Real x;
    output Real y;
  algorithm
    y := 0;
    for k in 1:size(c, 1) loop
      y := y*x + c[k];
    end for;
    y := y + two(x) - x;
  end horner;
  Real a = root(time) + length(time) + logarithm(time) + checked(time) + newton(time + 1) + horner({1, 2, 3}, time);
  Real b = position({1, 2, 3}, time);
  Real c;
  Real d;
equation
  (c, d) = two(time);
end M;
"""

EARLY = """
package P
  function nested "returns from an if-statement in another one"
    input Real x;
    input Real b;
    output Real y;
  algorithm
    y := 0;
    if x > 0 then
      if b > 0 then
        y := 1;
        return;
      end if;
    end if;
    y := 2;
  end nested;
  function first "returns from a loop"
    input Real x[3];
    output Real y;
  algorithm
    for i in 1:3 loop
      if x[i] > 1.5 then
        y := i;
        return;
      end if;
    end for;
    y := 10;
  end first;
  model M
    Real y = nested(time, time) + first({time, time, time});
  end M;
end P;
"""


@pytest.fixture(scope="module")
def library() -> Library:
    flat = flat_model(TEXT, "M")
    return Library(flat.functions, flat.enumerations)


def value(library: Library, name: str, *args: object) -> Any:
    (whole,) = (known for known in library.functions if known.rpartition(".")[2] == name)
    return library.call(whole, args)[0]


@pytest.mark.parametrize(
    ("name", "x", "y", "slope"),
    [
        ("root", 4.0, 2.0, 0.25),
        ("root", -4.0, 0.0, 0.0),
        ("root", 0.0, 0.0, 0.0),
        ("logarithm", 1.0, 1.0, 1.0),
        ("logarithm", 3.0, 3.0 * math.log(2.0), math.log(2.0) + 1.5),
        ("length", 2.0, 2.0 * math.sqrt(54.0), math.sqrt(54.0)),
        ("length", -2.0, 2.0 * math.sqrt(54.0), -math.sqrt(54.0)),
        ("length", 0.0, 0.0, 0.0),
        ("checked", 2.0, 6.0, 3.0),
        ("newton", 9.0, 3.0, 1.0 / 6.0),
    ],
)
def test_a_side_that_is_not_chosen_does_no_harm(library: Library, name: str, x: float, y: float, slope: float) -> None:
    def f(x: jax.Array) -> jax.Array:
        return jnp.asarray(value(library, name, x), float)

    assert_allclose(value(library, name, x), y)
    assert_allclose(jax.jit(f)(x), y)
    assert_allclose(jax.jit(jax.grad(f))(x), slope, atol=1e-12)
    assert_allclose(jax.jit(jax.jacfwd(f))(x), slope, atol=1e-12)


@pytest.mark.parametrize(
    ("name", "args", "y"),
    [
        ("nested", (1.0, -1.0), 2.0),
        ("nested", (1.0, 1.0), 1.0),
        ("nested", (-1.0, 1.0), 2.0),
        ("first", (np.array([1.0, 2.0, 3.0]),), 2.0),
        ("first", (np.array([1.0, 1.0, 1.0]),), 10.0),
    ],
)
def test_a_function_returns_early(name: str, args: tuple[Any, ...], y: float) -> None:
    flat = flat_model(EARLY, "P.M")
    library = Library(flat.functions, flat.enumerations)
    assert_allclose(value(library, name, *args), y)
    assert_allclose(jax.jit(lambda *traced: jnp.asarray(value(library, name, *traced)))(*args), y)


def test_values_of_results_may_read_local_variables() -> None:
    text = """model M function f input Real x; output Real y = 2 * p; protected Real q = p + 1; Real p = 3 * x;
        algorithm y := y + q; end f; Real y = f(time); end M;"""
    functions = Library(flat_model(text, "M").functions)
    assert functions.call("f", (2.0,)) == (19.0,)


def test_a_violated_assertion_is_an_error_or_not_a_number(library: Library) -> None:
    with pytest.raises(ModelError, match="assertion failed: x is negative"):
        value(library, "checked", -1.0)
    assert jnp.isnan(jax.jit(lambda x: value(library, "checked", x))(-1.0))


def test_loops_count_to_an_unknown_place(library: Library) -> None:
    v = np.array([1.0, 2.0, 5.0])
    assert [value(library, "position", v, x) for x in (0.5, 1.0, 9.0)] == [1, 2, 3]
    traced = jax.jit(lambda x: value(library, "position", v, x))
    assert [int(traced(x)) for x in (0.5, 1.0, 9.0)] == [1, 2, 3]


def test_a_polynomial_is_differentiable_by_its_coefficients(library: Library) -> None:
    c = jnp.array([1.0, 2.0, 3.0])
    assert value(library, "horner", np.asarray(c), 2.0) == 11.0
    assert_allclose(jax.jit(jax.grad(lambda c: value(library, "horner", c, 2.0)))(c), [4.0, 2.0, 1.0])


def test_a_large_function_is_traced_once(library: Library) -> None:
    library.programs.clear()
    program = jax.make_jaxpr(lambda x, y: value(library, "newton", x) + value(library, "newton", y))(1.0, 2.0)
    assert [key[0].rpartition(".")[2] for key in library.programs] == ["newton"]
    assert [equation.primitive.name for equation in program.eqns].count("jit") == 2


def test_random_numbers_are_those_of_the_published_generators() -> None:
    """One step of xorshift64* and xorshift128+ from a small state, in whole numbers of Python."""
    mask = 2**64 - 1
    x = 5 + (7 << 32)
    x ^= x >> 12
    x ^= (x << 25) & mask
    x ^= x >> 27
    x = x * 2685821657736338717 & mask
    y, state = EXTERNAL["ModelicaRandom_xorshift64star"](np.array([5, 7]))
    signed = x - 2**64 if x >= 2**63 else x
    assert_allclose(y, signed / 2**64 + 0.5, rtol=1e-15)
    assert [int(half) & 0xFFFFFFFF for half in state] == [x & 0xFFFFFFFF, x >> 32]
    for name, length in (("64star", 2), ("128plus", 4), ("1024star", 33)):
        generator = EXTERNAL[f"ModelicaRandom_xorshift{name}"]
        start = np.arange(3, 3 + length)
        y, state = generator(start)
        traced_y, traced_state = jax.jit(generator)(start.astype(float))
        assert traced_y == y
        assert np.array_equal(traced_state, state)
    with pytest.raises(ModelError, match="impureRandom is not supported"):
        EXTERNAL["ModelicaRandom_impureRandom_xorshift1024star"](1)


def test_strings_are_compared_and_scanned() -> None:
    compare = EXTERNAL["ModelicaStrings_compare"]
    assert [compare("a", "b"), compare("a", "A", False), compare("b", "a")] == [1, 2, 3]
    assert EXTERNAL["ModelicaStrings_substring"]("table", 2, 3) == "ab"
    assert EXTERNAL["ModelicaStrings_skipWhiteSpace"]("  x") == 3
    assert EXTERNAL["ModelicaStrings_scanReal"](" -1.5e2 x") == (8, -150.0)
    assert EXTERNAL["ModelicaStrings_scanInteger"]("12.5") == (1, 0)
    assert EXTERNAL["ModelicaStrings_scanIdentifier"](" a_1+") == (5, "a_1")


def test_lines_of_files_are_read(tmp_path: Path) -> None:
    file = tmp_path / "a.txt"
    file.write_text("one\ntwo\n")
    assert EXTERNAL["ModelicaInternal_countLines"](str(file)) == 2
    assert [EXTERNAL["ModelicaInternal_readLine"](str(file), n) for n in (2, 3)] == [("two", False), ("", True)]
    with pytest.raises(ModelError, match=r"b\.txt does not exist"):
        EXTERNAL["ModelicaInternal_countLines"](str(tmp_path / "b.txt"))


def test_linear_algebra_has_the_results_of_lapack() -> None:
    a, b = np.array([[2.0, 1.0], [0.0, 4.0]]), np.array([4.0, 8.0])
    assert_allclose(EXTERNAL["dgesv_vec"](a, b)[0], [1.0, 2.0])
    assert_allclose(jax.jit(lambda a: EXTERNAL["dgesv_vec"](a, b)[0])(a), [1.0, 2.0])
    real, imaginary, vectors, info = EXTERNAL["dgeev"](np.array([[0.0, 1.0], [-1.0, 0.0]]))
    assert_allclose([real, imaginary], [[0.0, 0.0], [1.0, -1.0]], atol=1e-15)
    assert_allclose(np.abs(vectors[:, 0] + 1j * vectors[:, 1]), [math.sqrt(0.5)] * 2)
    assert info == 0
    assert_allclose(EXTERNAL["dgesvd_sigma"](a)[0][0] ** 2, np.linalg.eigvalsh(a.T @ a)[-1])
    assert_allclose(BY_NAME["Modelica.Math.Matrices.det"](a), 8.0)


def test_a_transform_of_a_sine_has_one_line() -> None:
    signal = 2.0 * np.sin(2.0 * np.pi * np.arange(10) / 10)
    info, amplitudes, phases = EXTERNAL["ModelicaFFT_kiss_fftr"](signal)
    assert info == 0
    assert_allclose(amplitudes, [0.0, 10.0 / 6.0, 0.0, 0.0, 0.0, 0.0], atol=1e-14)
    assert_allclose(phases[1], -np.pi / 2)


VECTORS = """
package P
  type Vector = Real[2];
  function scaled "a function of scalars"
    input Real x;
    input Real y;
    output Real z;
  algorithm
    z := if x > 1.5 then x*y else -x*y;
  end scaled;
  function length
    input Vector v;
    output Real y;
  algorithm
    y := sqrt(v*v);
  end length;
  model M
    Real z[3] = scaled({1, 2, 3}*time, {4, 5, 6});
    Real w[2, 2] = scaled([1, 2; 3, 4], time);
    Real y = length({3, 4}*time);
    Real u[2] = length({{3, 4}, {6, 8}}*time);
  end M;
end P;
"""


def test_a_function_of_scalars_is_called_with_arrays_element_by_element() -> None:
    flat = flat_model(VECTORS, "P.M")
    library = Library(flat.functions, flat.enumerations)
    x, y = np.array([1.0, 2.0, 3.0]), np.array([4.0, 5.0, 6.0])
    for of in (lambda x, y: value(library, "scaled", x, y), jax.jit(lambda x, y: value(library, "scaled", x, y))):
        assert_allclose(of(x, y), [-4.0, 10.0, 18.0])
        assert_allclose(of(x, 2.0), [-2.0, 4.0, 6.0])
        assert_allclose(of(np.outer([1.0, 2.0], x), 1.0), [[-1, 2, 3], [2, 4, 6]])
    assert value(library, "length", np.array([3.0, 4.0])) == 5.0
    assert_allclose(value(library, "length", np.array([[3.0, 4.0], [6.0, 8.0]])), [5.0, 10.0])
    with pytest.raises(ModelError, match=r"the arguments x, y of P\.scaled have different sizes"):
        value(library, "scaled", x, y[:2])


LOOPS = """
model M
  function turns
    input Real u;
    output Real v = u;
  algorithm
    while v > 1 loop
      v := v / 2;
      if v < 0.7 then
        return;
      end if;
    end while;
  end turns;
  function once
    input Real u;
    output Real v = u;
  algorithm
    while v > 1 loop
      v := v / 2;
      return;
    end while;
  end once;
  function endless
    input Real u;
    output Real v = u;
  algorithm
    while v > 1 loop
      v := v + 1;
    end while;
  end endless;
  Real a = turns(time), b = once(time), c = endless(time);
end M;
"""
NAMED = """
model M
  record R
    String name;
    Real k;
  end R;
  function halved "has a text among its inputs"
    input Real u;
    input R r;
    output Real v = u;
  algorithm
    while v > 1 loop
      if v > 3 then
        v := v / (2*r.k);
      else
        v := v / r.k;
      end if;
    end while;
  end halved;
  Real a = halved(time, R("air", 2));
end M;
"""


def test_a_loop_of_unknown_length_carries_what_it_assigns() -> None:
    library = Library(flat_model(NAMED, "M").functions)
    for u, v in ((10.0, 0.625), (3.0, 0.75)):
        assert jax.jit(lambda u: value(library, "halved", u, {"name": "air", "k": 2.0}))(u) == v


def test_loops_that_are_not_supported_are_refused() -> None:
    flat = flat_model(LOOPS, "M")
    library = Library(flat.functions, flat.enumerations)
    assert [value(library, name, 3.0) for name in ("turns", "once")] == [0.75, 1.5]
    for name, message in (("turns", "`return` under a condition"), ("once", "`return` in a while loop of unknown")):
        with pytest.raises(ModelError, match=message):
            jax.jit(lambda x, name=name: jnp.asarray(value(library, name, x)))(3.0)
    with pytest.raises(ModelError, match="a while loop does not end"):
        value(library, "endless", 3.0)


RECORDS = """
package P
  record S
    Real k;
    Real l = 2*k;
  end S;
  record R
    Integer n;
    S s(k = n);
    Real x[n];
    Real last;
  end R;
  record T = S(k = 7);
  function filled
    input Integer n;
    output R r(n = n + 1, last = n);
  algorithm
    r.x[n] := 5;
  end filled;
  function given
    input Real u;
    output Real y;
  protected
    S s(k = u);
    T t;
  algorithm
    y := s.l + t.l;
  end given;
  function by_default
    input S s(k = 3);
    output Real y = s.l;
  algorithm
  end by_default;
  function several
    input Real u;
    output Real y;
  protected
    S s[2](k = {u, u});
  algorithm
    y := s[1].l;
  end several;
  model M
    parameter R r = filled(2);
    Real a = given(time);
    parameter Real b = by_default();
  end M;
  model Several
    Real a = several(time);
  end Several;
end P;
"""


def test_records_in_functions_start_with_the_values_of_their_modifiers() -> None:
    flat = flat_model(RECORDS, "P.M")
    library = Library(flat.functions, flat.enumerations)
    r = value(library, "filled", 2)
    assert (r["n"], r["s"], r["last"]) == (3, {"k": 3, "l": 6}, 2)
    assert r["x"].tolist() == [0.0, 5.0, 0.0]
    assert value(library, "given", 1.0) == 16.0
    assert value(library, "by_default") == 6.0
    with pytest.raises(ModelError, match="s is an array of records with modifiers, which is not supported"):
        _ = flat_model(RECORDS, "P.Several").functions["P.several"]


def test_flexible_arrays_begin_empty() -> None:
    text = """model M function f input Integer x[:]; output Integer y[:];
        algorithm for i in 1:size(x, 1) loop if x[i] > 0 then y := cat(1, y, x[i:i]); end if; end for; end f;
        parameter Integer a[:] = f({-2, 1, 0, 2}), b[:] = f({-1}); Integer n = size(b, 1); Real y = sum(a); end M;"""
    functions = Library(flat_model(text, "M").functions)
    assert [functions.call("f", (np.array(x),))[0].tolist() for x in ([-2, 1, 0, 2], [-1])] == [[1, 2], []]


def test_loops_pass_through_arrays_of_records() -> None:
    text = """record R Real x; Integer n; end R;
        function f input R r[:]; output Real s = 0; output Integer n = 0; algorithm
          for k in r loop s := s + k.x * k.n; n := n + 1; end for; s := s + sum(k.x for k in r); end f;
        model M Real s; Integer n; equation (s, n) = f({R(time, 1), R(2, 3), R(4, 5)}); end M;"""
    functions = Library(flat_model(text, "M").functions)
    given = {"x": np.array([1.0, 2.0, 4.0]), "n": np.array([1, 3, 5])}
    assert functions.call("f", (given,)) == (34.0, 3)
    traced = jax.jit(lambda x: functions.call("f", ({**given, "x": x},))[0])
    assert traced(given["x"]) == 34.0


def test_values_are_bound_to_functions_that_are_arguments_themselves() -> None:
    text = """
package P
  partial function Law
    input Real x;
    output Real y;
  end Law;
  partial function Scaled
    input Real x;
    input Real k;
    output Real y;
  end Scaled;
  function line
    input Real x;
    input Real k;
    input Real self = 0;
    output Real y = k * x + self;
  algorithm
  end line;
  function at2
    input Law f;
    output Real y = f(2);
  algorithm
  end at2;
  function scaled
    input Scaled f;
    input Real c;
    output Real y = at2(function f(k = c));
  algorithm
  end scaled;
  model M
    parameter Real a = scaled(line, 5), b = scaled(function line(self = 100), 7);
  end M;
end P;"""
    model = load(text, "P.M")
    assert (float(model.a), float(model.b)) == (10.0, 114.0)
