"""Operator records (Modelica 3.6, chapter 14): complex numbers, against those of Python."""

import numpy as np
import pytest

from acausal import simulate
from acausal.modelica import load

TEXT = """
package P
  operator record C
    Real re;
    Real im;
    encapsulated operator 'constructor'
      import P.C;
      function real input Real re; input Real im = 0; output C y(re = re, im = im); algorithm end real;
    end 'constructor';
    encapsulated operator '0'
      import P.C;
      function zero output C y; algorithm y := C(0, 0); end zero;
    end '0';
    encapsulated operator function '+'
      import P.C; input C a; input C b; output C y; algorithm y := C(a.re + b.re, a.im + b.im);
    end '+';
    encapsulated operator '-'
      import P.C;
      function minus input C a; output C y; algorithm y := C(-a.re, -a.im); end minus;
      function less input C a; input C b; output C y; algorithm y := C(a.re - b.re, a.im - b.im); end less;
    end '-';
    encapsulated operator function '*'
      import P.C; input C a; input C b; output C y;
    algorithm
      y := C(a.re * b.re - a.im * b.im, a.re * b.im + a.im * b.re);
    end '*';
    encapsulated operator function '/'
      import P.C; input C a; input C b; output C y;
    protected
      Real n = b.re ^ 2 + b.im ^ 2;
    algorithm
      y := C((a.re * b.re + a.im * b.im) / n, (a.im * b.re - a.re * b.im) / n);
    end '/';
  end C;
  model M
    parameter C k = C(2, 3);
    C v[2] = {C(time, 1), C(1, -time)}, z, w(re(start = 1), im(start = 1)), scaled[2];
    C known = k * C(0, 1) - 1, dot[2], whole;
  equation
    z = -(k * v[1] + 2) / v[2];
    w * k = z + 1;
    scaled = 2 * v;
    dot = {{v[1], k}, {k, v[2]}} * v;
    whole = dot[1] + scaled[1] * k;
  end M;
end P;
"""


def test_operators_of_complex_numbers() -> None:
    final = simulate(load(TEXT, "P.M"), 2.0, save="end")
    found = lambda name: complex(final[f"{name}.re"][-1], final[f"{name}.im"][-1])  # noqa: E731
    k, v = 2 + 3j, np.array([2 + 1j, 1 - 2j])
    z = -(k * v[0] + 2) / v[1]
    expected = {"z": z, "w": (z + 1) / k, "known": k * 1j - 1, "dot[2]": k * v[0] + v[1] ** 2}
    expected["whole"] = v[0] ** 2 + k * v[1] + 2 * v[0] * k
    assert {name: found(name) for name in expected} == pytest.approx(expected)
    assert [found("scaled[1]"), found("scaled[2]")] == pytest.approx(list(2 * v))
