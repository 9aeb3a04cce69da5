"""Lumped heat transfer (as in MSL `Modelica.Thermal.HeatTransfer`)."""

from typing import TYPE_CHECKING

from .._lazy import when_asked

if TYPE_CHECKING:
    from ._basic import FixedTemperature as FixedTemperature
    from ._basic import HeatCapacitor as HeatCapacitor
    from ._basic import ThermalConductor as ThermalConductor
    from ._interfaces import HeatPort as HeatPort
    from ._sensors import HeatFlowSensor as HeatFlowSensor
    from ._sensors import RelativeTemperatureSensor as RelativeTemperatureSensor
    from ._sensors import TemperatureSensor as TemperatureSensor
    from ._sources import ConstantHeatFlow as ConstantHeatFlow
    from ._sources import SignalHeatFlow as SignalHeatFlow
    from ._sources import SignalTemperature as SignalTemperature
    from ._transfer import BodyRadiation as BodyRadiation
    from ._transfer import Convection as Convection
else:
    __getattr__, __dir__, __all__ = when_asked(__name__)
