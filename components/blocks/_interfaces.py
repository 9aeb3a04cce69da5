"""Signal ports: one value, no power."""

from typing import ClassVar

from acausal import Component, Port, Scalar, Time, Var


class Signal(Port, partial=True):
    """A value passed between blocks. It has no flow, so reading it has no effect on the source.

    The docstring of the component that owns the port states the unit.
    """

    value: Var[Scalar, ""] = 0.0


class Input(Signal):
    """A signal that a component reads. Leaving it unconnected is an error."""

    needs_connection: ClassVar[bool] = True


class Output(Signal):
    """A signal that a component determines."""


class SignalSource(Component, partial=True):
    """A block that determines its output from time alone."""

    t: Time[Scalar, "s"] = 0.0
    y: Output = Output()


class SISO(Component, partial=True):
    """A block with one input and one output."""

    u: Input = Input()
    y: Output = Output()


class SI2SO(Component, partial=True):
    """A block with two inputs and one output."""

    u1: Input = Input()
    u2: Input = Input()
    y: Output = Output()
