"""A heated body, and a control loop."""

from acausal import Component, Connections, connect
from components import blocks, thermal

from .twin import Twin

COOLING = """
model Cooling
  import Modelica.Thermal.HeatTransfer;
  HeatTransfer.Components.HeatCapacitor winding(C = 50, T(start = 353.15, fixed = true));
  HeatTransfer.Components.ThermalConductor frame(G = 2);
  HeatTransfer.Components.HeatCapacitor housing(C = 200, T(start = 293.15, fixed = true));
  HeatTransfer.Components.Convection convection;
  HeatTransfer.Sources.FixedTemperature air(T = 293.15);
  Modelica.Blocks.Sources.Constant transfer(k = 1.5);
equation
  connect(winding.port, frame.port_a);
  connect(frame.port_b, housing.port);
  connect(housing.port, convection.solid);
  connect(convection.fluid, air.port);
  connect(transfer.y, convection.Gc);
end Cooling;
"""


class Cooling(Component):
    winding: thermal.HeatCapacitor
    frame: thermal.ThermalConductor
    housing: thermal.HeatCapacitor
    convection: thermal.Convection
    air: thermal.FixedTemperature
    transfer: blocks.Constant

    def connections(self) -> Connections:
        return (
            connect(self.winding.port, self.frame.a),
            connect(self.frame.b, self.housing.port, self.convection.solid),
            connect(self.convection.fluid, self.air.port),
            connect(self.transfer.y, self.convection.u),
        )


LOOP = """
model Loop
  import Modelica.Blocks;
  Blocks.Sources.Step reference(height = 1, startTime = 0.2);
  Blocks.Math.Add difference(k2 = -1);
  Blocks.Continuous.PI controller(k = 2, T = 0.3, initType = Blocks.Types.Init.InitialState);
  Blocks.Continuous.FirstOrder plant(T = 0.5, k = 1.5, initType = Blocks.Types.Init.InitialState);
equation
  connect(reference.y, difference.u1);
  connect(plant.y, difference.u2);
  connect(difference.y, controller.u);
  connect(controller.y, plant.u);
end Loop;
"""


class Loop(Component):
    reference: blocks.Step
    difference: blocks.Sum
    controller: blocks.PI
    plant: blocks.FirstOrder

    def connections(self) -> Connections:
        return (
            connect(self.reference.y, self.difference.u1),
            connect(self.plant.y, self.difference.u2),
            connect(self.difference.y, self.controller.u),
            connect(self.controller.y, self.plant.u),
        )


def twins() -> list[Twin]:
    flow = {"convection.Q_flow": "convection.Q_flow"}
    return [
        Twin(
            "Cooling",
            COOLING,
            Cooling(
                winding=thermal.HeatCapacitor(C=50.0, T=353.15),
                frame=thermal.ThermalConductor(G=2.0),
                housing=thermal.HeatCapacitor(C=200.0, T=293.15),
                convection=thermal.Convection(),
                air=thermal.FixedTemperature(temperature=293.15),
                transfer=blocks.Constant(k=1.5),
            ),
            300.0,
            {"winding.T": "winding.T", "housing.T": "housing.T", **flow},
        ),
        Twin(
            "Loop",
            LOOP,
            Loop(
                reference=blocks.Step(height=1.0, start_time=0.2),
                difference=blocks.Sum(k2=-1.0),
                controller=blocks.PI(k=2.0, T=0.3),
                plant=blocks.FirstOrder(T=0.5, k=1.5),
            ),
            3.0,
            {"plant.y": "plant.y.value", "controller.y": "controller.y.value"},
        ),
    ]
