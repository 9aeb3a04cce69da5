"""The electrical port and what all elements with two pins share."""

from typing import Any

from acausal import Component, Equations, Flow, Port, Scalar, Var, eq


class Pin(Port):
    """An electrical terminal; v i is the power into the component."""

    v: Var[Scalar, "V"] = 0.0  # potential
    i: Flow[Scalar, "A"] = 0.0  # current, positive into the component


class TwoPin(Component, partial=True):
    """An element with one current path, from p to n: v = v_p - v_n, i = i_p = -i_n."""

    v: Var[Scalar, "V"] = 0.0  # voltage from p to n
    i: Var[Scalar, "A"] = 0.0  # current from p to n
    p: Pin = Pin()
    n: Pin = Pin()

    def equations(self, d: Any) -> Equations:
        return dict(
            voltage=eq(self.v, self.p.v - self.n.v),
            current=eq(self.i, self.p.i),
            kirchhoff=eq(self.p.i + self.n.i),
        )
