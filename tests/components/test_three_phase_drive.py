"""A whole drive: mains, rectifier, link with brake chopper, inverter, machine, field-oriented and speed control."""

import pytest

from acausal import Component, Connections, connect, simulate
from components.blocks import LimPI, Trapezoid
from components.electrical import (
    PMSM,
    AveragedBrakeChopper,
    AveragedHalfBridge,
    Capacitor,
    CurrentSetpoints,
    DiodeBridge,
    DqCurrentSensor,
    DqMachine,
    DqTerminals,
    FieldOrientedController,
    Ground,
    PhaseImpedance,
    PhaseInverter,
    RotorToPhases,
    ThreePhaseSource,
    VoltageSensor,
)
from components.rotational import AngleSensor, Inertia, SpeedSensor


class Drive(Component):
    mains: ThreePhaseSource
    line: PhaseImpedance
    rectifier: DiodeBridge
    link: Capacitor
    chopper: AveragedBrakeChopper
    inverter: PhaseInverter
    terminals: DqTerminals
    motor: PMSM
    load: Inertia
    wanted: Trapezoid
    speed_control: LimPI
    setpoints: CurrentSetpoints
    current_control: FieldOrientedController
    modulation: RotorToPhases
    currents: DqCurrentSensor = DqCurrentSensor()
    speed: SpeedSensor = SpeedSensor()
    angle: AngleSensor = AngleSensor()
    voltage: VoltageSensor = VoltageSensor()
    ground: Ground = Ground()

    def connections(self) -> Connections:
        control, setpoints, phases = self.current_control, self.setpoints, self.modulation
        return (
            connect(self.mains.phases, self.line.p),
            connect(self.line.n, self.rectifier.phases),
            connect(self.rectifier.p, self.link.p, self.chopper.p, self.inverter.p, self.voltage.p),
            connect(self.rectifier.n, self.link.n, self.chopper.n, self.inverter.n, self.voltage.n, self.ground.p),
            connect(self.inverter.phases, self.terminals.phases),
            connect(self.terminals.machine, self.currents.p),
            connect(self.currents.n, self.motor.terminals),
            connect(self.motor.shaft, self.terminals.shaft, self.speed.flange, self.angle.flange, self.load.a),
            connect(self.wanted.y, self.speed_control.u_s),
            connect(self.speed.y, self.speed_control.u_m, setpoints.w, control.w),
            connect(self.speed_control.y, setpoints.torque),
            connect(self.voltage.y, setpoints.v_dc, control.v_dc),
            connect(setpoints.i_d, control.i_d_set),
            connect(setpoints.i_q, control.i_q_set),
            connect(self.currents.y_d, control.i_d),
            connect(self.currents.y_q, control.i_q),
            connect(control.u_d, phases.u_d),
            connect(control.u_q, phases.u_q),
            connect(self.angle.y, phases.phi),
            connect(phases.y_a, self.inverter.u_a),
            connect(phases.y_b, self.inverter.u_b),
            connect(phases.y_c, self.inverter.u_c),
        )


@pytest.mark.slow
def test_a_drive_accelerates_and_brakes_its_load_into_the_chopper() -> None:
    machine = DqMachine(p=4.0, psi=0.12, Ld=4e-3, Lq=4e-3, Rs=0.6)
    motor, load, bandwidth = PMSM(machine=machine, J=1e-3), Inertia(J=2e-3), 2000.0
    leg = AveragedHalfBridge(frequency=8e3, dead_time=2e-6, V_0=1.0, R_on=0.02, i_0=0.5)
    drive = Drive(
        mains=ThreePhaseSource(V=325.0, f=50.0),
        line=PhaseImpedance(R=0.2, L=1e-3),
        rectifier=DiodeBridge(),
        link=Capacitor(C=5e-4, v=540.0),
        chopper=AveragedBrakeChopper(R=40.0, v_on=720.0, v_off=700.0),
        inverter=PhaseInverter(leg=leg),
        terminals=DqTerminals(p=machine.p),
        motor=motor,
        load=load,
        wanted=Trapezoid(amplitude=300.0, period=1.0, rising=0.05, width=0.05, falling=0.05, start_time=0.01),
        speed_control=LimPI.symmetric_optimum(K=1.0 / (motor.J + load.J), T=1.0 / bandwidth, y_max=25.0, a=4.0),
        setpoints=CurrentSetpoints(machine=machine, i_max=35.0),
        current_control=FieldOrientedController(machine=machine, bandwidth=bandwidth),
        modulation=RotorToPhases(p=machine.p),
    )
    solution = simulate(drive, 0.2, energy=True)
    torque, speed, v = solution["motor.torque"], solution["motor.w"], solution["link.v"]
    assert float(speed.max()) == pytest.approx(300.0, abs=0.2)
    assert float(torque.max()) == pytest.approx(3e-3 * 300.0 / 0.05, rel=0.02)
    assert 700.0 < float(v.max()) < 720.0
    link = 0.5 * 5e-4 * (float(v[-1]) ** 2 - 540.0**2)
    kinetic = 0.5 * 3e-3 * 300.0**2
    assert 0.3 * kinetic < float(solution.integral(lambda s: s.chopper.v * s.chopper.i)) < kinetic - 0.5 * link
    assert abs(float(solution.energy.imbalance)) < 1e-3
