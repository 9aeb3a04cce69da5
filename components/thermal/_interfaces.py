"""The thermal port."""

from acausal import Flow, Port, Scalar, Var


class HeatPort(Port):
    """A surface that passes heat; Q_flow itself is the power into the component."""

    T: Var[Scalar, "K"] = 0.0  # temperature; its start value is that of the body it belongs to
    Q_flow: Flow[Scalar, "W"] = 0.0  # heat flow rate, positive into the component
