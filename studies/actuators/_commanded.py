"""Actuators whose voltage follows a signal."""

import dataclasses
from typing import Any

from acausal import Connections, connect
from components.blocks import TimeSeries
from components.electrical import SignalVoltage

from ._models import CamActuator, ElectrohydraulicActuator, ElectromechanicalActuator, PumpActuator


class CommandedElectromechanical(CamActuator):
    """The electromechanical actuator with a voltage signal."""

    supply: SignalVoltage  # pyright: ignore[reportIncompatibleVariableOverride]
    command: TimeSeries

    def connections(self) -> Connections:
        return *super().connections(), connect(self.command.y, self.supply.u)


class CommandedElectrohydraulic(PumpActuator):
    """The electrohydraulic actuator with a voltage signal."""

    supply: SignalVoltage  # pyright: ignore[reportIncompatibleVariableOverride]
    command: TimeSeries

    def connections(self) -> Connections:
        return (
            *super().connections(),
            connect(self.pump.b, self.line.a),
            connect(self.command.y, self.supply.u),
        )


def commanded(
    actuator: ElectromechanicalActuator | ElectrohydraulicActuator, command: TimeSeries
) -> CommandedElectromechanical | CommandedElectrohydraulic:
    """The actuator with a signal in place of its constant voltage."""
    fields = [field.name for field in dataclasses.fields(actuator) if field.init]
    parts: dict[str, Any] = {name: getattr(actuator, name) for name in fields}
    parts |= {"supply": SignalVoltage(), "command": command}
    if isinstance(actuator, ElectromechanicalActuator):
        return CommandedElectromechanical(**parts)
    return CommandedElectrohydraulic(**parts)
