"""Permanent-magnet synchronous machine in rotor coordinates, inverter, current sensor, and controlled drive."""

from typing import Self

from acausal import (
    Component,
    Energy,
    Equations,
    Flow,
    Param,
    Port,
    Scalar,
    Var,
    eq,
    positive,
    prefer,
)

from .._data_sheet import DataSheet
from .._limit import limited_amplitude
from ..blocks import Input, Output
from ..rotational import Flange
from ._dq_machine import DqCurrents, DqMachine
from ._interfaces import Pin, TwoPin


class DqPort(Port):
    """Three phases in rotor coordinates, as peak values; the power into the component is 3/2 (v_d i_d + v_q i_q)."""

    v_d: Var[Scalar, "V"] = 0.0  # d-axis voltage
    v_q: Var[Scalar, "V"] = 0.0  # q-axis voltage
    i_d: Flow[Scalar, "A"] = 0.0  # d-axis current
    i_q: Flow[Scalar, "A"] = 0.0  # q-axis current

    def power(self, d: Self) -> Scalar:
        del d
        return 1.5 * (self.v_d * self.i_d + self.v_q * self.i_q)


class PMSM(Component):
    """Permanent-magnet synchronous machine in rotor coordinates, with rotor inertia: J dw/dt = tau + torque.

    v_d = Rs i_d + Ld di_d/dt - w_el Lq i_q and v_q = Rs i_q + Lq di_q/dt + w_el (Ld i_d + psi), with w_el = p w, and
    torque = 3/2 p (psi i_q + (Ld - Lq) i_d i_q). For conventions and source see `DqMachine`. The stator is the ground.
    Not modelled: saturation, harmonics and cogging, iron loss (put a `rotational.IronLoss` on the shaft), heating.
    """

    machine: DqMachine
    J: Param[Scalar, "kg.m2", positive]  # moment of inertia of the rotor
    i_d: Var[Scalar, "A", prefer] = 0.0  # d-axis current
    i_q: Var[Scalar, "A", prefer] = 0.0  # q-axis current, which produces the torque
    w: Var[Scalar, "rad/s", prefer] = 0.0  # speed of the shaft
    torque: Var[Scalar, "N.m"] = 0.0  # electromagnetic torque
    terminals: DqPort = DqPort()
    shaft: Flange = Flange()
    data_sheet: DataSheet | None = None  # source of the parameters; see `catalogues`

    def equations(self, d: Self) -> Equations:
        m, i = self.machine, DqCurrents(self.i_d, self.i_q)
        steady_d, steady_q = m.voltages(i, m.p * self.w)
        return dict(
            current_d=eq(self.i_d, self.terminals.i_d),
            current_q=eq(self.i_q, self.terminals.i_q),
            voltage_d=eq(m.Ld * d.i_d, self.terminals.v_d - steady_d),
            voltage_q=eq(m.Lq * d.i_q, self.terminals.v_q - steady_q),
            torque=eq(self.torque, m.torque(i)),
            speed=eq(self.w, d.shaft.phi),
            newton=eq(self.J * d.w, self.shaft.tau + self.torque),
        )

    def energy(self) -> Energy:
        m = self.machine
        coils = 0.75 * (m.Ld * self.i_d**2 + m.Lq * self.i_q**2)
        return Energy(
            stored=coils + 0.5 * self.J * self.w**2,
            dissipated=1.5 * m.Rs * (self.i_d**2 + self.i_q**2),
        )


class DqCurrentSensor(Component):
    """y_d and y_q = currents from p to n in A, in rotor coordinates; no voltage drop."""

    p: DqPort = DqPort()
    n: DqPort = DqPort()
    y_d: Output = Output()
    y_q: Output = Output()

    def equations(self, d: Self) -> Equations:
        return dict(
            no_drop_d=eq(self.p.v_d, self.n.v_d),
            no_drop_q=eq(self.p.v_q, self.n.v_q),
            kirchhoff_d=eq(self.p.i_d + self.n.i_d),
            kirchhoff_q=eq(self.p.i_q + self.n.i_q),
            reading_d=eq(self.y_d.value, self.p.i_d),
            reading_q=eq(self.y_q.value, self.p.i_q),
        )


class Inverter(Component):
    """A lossless three-phase bridge, averaged over its switching: v = m v_dc, with |m| limited to m_max.

    The inputs are modulations, not volts: for 20 V from a direct voltage of 48 V, set u_q to 20/48.
    The modulation m = (m_d, m_q) is limited in amplitude: m_max is 1/sqrt(3) for space vectors, 1/2 for sines without a
    third harmonic, 2/pi for six-step operation. The power is equal on both sides: i_dc = 3/2 (m_d i_d + m_q i_q). Not
    modelled: ripple, dead time, losses, rectification by the diodes at excessive speed.
    """

    m_max: Param[Scalar, "1", positive] = 3**-0.5  # maximum of the peak phase voltage over the direct voltage
    m_d: Var[Scalar, "1"] = 0.0  # limited modulation, d axis
    m_q: Var[Scalar, "1"] = 0.0  # limited modulation, q axis
    p: Pin = Pin()
    n: Pin = Pin()
    machine: DqPort = DqPort()
    u_d: Input = Input()  # modulation setpoint, a ratio: the wanted phase voltage over the direct voltage
    u_q: Input = Input()  # modulation setpoint, a ratio like u_d
    data_sheet: DataSheet | None = None  # ratings; see `catalogues`

    def equations(self, d: Self) -> Equations:
        m_d, m_q = limited_amplitude(self.u_d.value, self.u_q.value, self.m_max)
        v_dc = self.p.v - self.n.v
        return dict(
            kirchhoff=eq(self.p.i + self.n.i),
            limit_d=eq(self.m_d, m_d),
            limit_q=eq(self.m_q, m_q),
            voltage_d=eq(self.machine.v_d, self.m_d * v_dc),
            voltage_q=eq(self.machine.v_q, self.m_q * v_dc),
            power=eq(self.p.i, -1.5 * (self.m_d * self.machine.i_d + self.m_q * self.machine.i_q)),
        )


class PMSMDrive(TwoPin):
    """A PMSM with inverter and control, which delivers the torque u within the limits of the inverter.

    The torque setpoint T follows `u` in N.m with the lag tau dT/dt = u - T. The currents are always the smallest for T
    within |i| <= i_max and |v| <= m_max v_dc, with field weakening above the corner speed (`DqMachine.currents`). With
    the speed w, J dw/dt = tau_shaft + torque, and C dv_dc/dt = i - (torque w + 3/2 Rs |i_dq|^2)/v_dc at the capacitor
    of the direct-voltage link, which must be charged at the start: `v=...`. Not modelled: transients of the currents
    beyond this lag (see `PMSM`, `Inverter`), inverter losses, saturation, iron loss, rectification by the diodes of the
    inverter at excessive speed.
    """

    machine: DqMachine
    J: Param[Scalar, "kg.m2", positive]  # moment of inertia of the rotor
    i_max: Param[Scalar, "A", positive]  # current limit, phase peak value
    C: Param[Scalar, "F", positive]  # capacitance of the direct-voltage link
    tau: Param[Scalar, "s", positive] = 1e-3  # time constant of the current control
    m_max: Param[Scalar, "1", positive] = 3**-0.5  # maximum of phase peak over direct voltage; see `Inverter`
    v: Var[Scalar, "V", positive, prefer] = 1.0  # direct voltage
    wanted: Var[Scalar, "N.m", prefer] = 0.0  # torque setpoint after the lag
    torque: Var[Scalar, "N.m"] = 0.0  # electromagnetic torque
    w: Var[Scalar, "rad/s", prefer] = 0.0  # speed of the shaft
    i_d: Var[Scalar, "A"] = 0.0  # d-axis current
    i_q: Var[Scalar, "A"] = 0.0  # q-axis current
    shaft: Flange = Flange()
    u: Input = Input()
    data_sheet: DataSheet | None = None  # source of the parameters; see `catalogues`

    def equations(self, d: Self) -> Equations:
        m, i = self.machine, DqCurrents(self.i_d, self.i_q)
        best = m.currents(self.wanted, m.p * self.w, self._v_max(), self.i_max)
        return super().equations(d) | dict(
            control=eq(self.tau * d.wanted, self.u.value - self.wanted),
            current_d=eq(self.i_d, best.d),
            current_q=eq(self.i_q, best.q),
            torque=eq(self.torque, m.torque(i)),
            speed=eq(self.w, d.shaft.phi),
            newton=eq(self.J * d.w, self.shaft.tau + self.torque),
            link=eq(self.C * d.v, self.i - (self.torque * self.w + self._loss()) / self.v),
        )

    def _v_max(self) -> Scalar:
        return self.m_max * self.v

    def _loss(self) -> Scalar:
        return 1.5 * self.machine.Rs * (self.i_d**2 + self.i_q**2)

    def energy(self) -> Energy:
        return Energy(stored=0.5 * self.J * self.w**2 + 0.5 * self.C * self.v**2, dissipated=self._loss())
