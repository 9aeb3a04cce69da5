"""Electrical port and the base classes of elements with two or four pins."""

from typing import Any, ClassVar, Self

from acausal import Component, Equations, Flow, Port, Scalar, Var, eq


class Pin(Port):
    """An electrical terminal; v i is the power into the component."""

    reference: ClassVar[str] = "a Ground"

    v: Var[Scalar, "V"] = 0.0  # potential
    i: Flow[Scalar, "A"] = 0.0  # current, positive into the component

    def power(self, d: Self) -> Scalar:
        del d
        return self.v * self.i


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


class TwoPort(Component, partial=True):
    """An element with two current paths, from p1 to n1 and from p2 to n2, with voltages and currents from p to n."""

    v1: Var[Scalar, "V"] = 0.0  # voltage from p1 to n1
    v2: Var[Scalar, "V"] = 0.0  # voltage from p2 to n2
    i1: Var[Scalar, "A"] = 0.0  # current from p1 to n1
    i2: Var[Scalar, "A"] = 0.0  # current from p2 to n2
    p1: Pin = Pin()
    n1: Pin = Pin()
    p2: Pin = Pin()
    n2: Pin = Pin()

    def equations(self, d: Any) -> Equations:
        return dict(
            voltage_1=eq(self.v1, self.p1.v - self.n1.v),
            voltage_2=eq(self.v2, self.p2.v - self.n2.v),
            current_1=eq(self.i1, self.p1.i),
            current_2=eq(self.i2, self.p2.i),
            kirchhoff_1=eq(self.p1.i + self.n1.i),
            kirchhoff_2=eq(self.p2.i + self.n2.i),
        )
