"""The thermal port."""

from acausal import Flow, Port, Scalar, Var, nonnegative


class HeatPort(Port):
    """A surface that passes heat; Q_flow itself is the power into the component."""

    T: Var[Scalar, "K", nonnegative] = 293.15  # temperature
    Q_flow: Flow[Scalar, "W"] = 0.0  # heat flow rate, positive into the component
