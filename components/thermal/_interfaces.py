"""Thermal port."""

from typing import ClassVar, Self

from acausal import Flow, Port, Scalar, Var, positive


class HeatPort(Port):
    """A surface that transfers heat; Q_flow is the power into the component."""

    reference: ClassVar[str] = "a FixedTemperature"

    T: Var[Scalar, "K", positive] = 293.15  # temperature
    Q_flow: Flow[Scalar, "W"] = 0.0  # heat flow rate, positive into the component

    def power(self, d: Self) -> Scalar:
        del d
        return self.Q_flow
