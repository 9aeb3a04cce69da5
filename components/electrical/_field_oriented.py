"""Field-oriented control of a permanent-magnet synchronous machine."""

from typing import Self

import jax.numpy as jnp

from acausal import Component, Equations, Param, Scalar, Var, eq, positive, prefer

from .._limit import limited_amplitude
from ..blocks import Input, Output
from ._dq_machine import DqMachine
from ._three_phase import phase_angles


class CurrentSetpoints(Component):
    """Current setpoints in A for a torque setpoint in N.m: maximum torque per ampere and field weakening.

    They are the smallest currents within |i| <= i_max and |v| <= m_max v_dc at the speed w, or those of the largest
    torque possible (`DqMachine.currents`). Choose m_max a few per cent below that of the inverter, as a reserve for the
    current control.
    """

    machine: DqMachine
    i_max: Param[Scalar, "A", positive]  # current limit, phase peak value
    m_max: Param[Scalar, "1", positive] = 0.55  # maximum of the peak phase voltage over the direct voltage
    torque: Input = Input()  # setpoint in N.m
    w: Input = Input()  # speed of the shaft in rad/s
    v_dc: Input = Input()  # direct voltage in V
    i_d: Output = Output()  # in A
    i_q: Output = Output()  # in A

    def equations(self, d: Self) -> Equations:
        m, v_max = self.machine, self.m_max * self.v_dc.value
        best = m.currents(self.torque.value, m.p * self.w.value, v_max, self.i_max)
        return dict(current_d=eq(self.i_d.value, best.d), current_q=eq(self.i_q.value, best.q))


class FieldOrientedController(Component):
    """PI control of the currents of a PMSM in rotor coordinates, tuned from the data of the machine.

    With the errors e = setpoint - i and the electrical speed w_el = p w, the wanted voltages are v_d = b Ld e_d + x_d -
    w_el Lq i_q and v_q = b Lq e_q + x_q + w_el (Ld i_d + psi): decoupling and feed-forward of the induced voltage. The
    integral dx/dt = b [Rs e + limited v - v] cancels the pole of the winding, so that within the limits di/dt = b e in
    both axes (internal model control: Harnefors, Nee, IEEE Trans. Ind. Appl. 34, 1998). The voltage is limited in
    amplitude to m_max v_dc, with back-calculation as anti-windup. The outputs are the modulation v/v_dc of an
    `Inverter`, or through `RotorToPhases` of a `PhaseInverter`. Choose the bandwidth b a tenth or less of the switching
    frequency. For setpoints see `CurrentSetpoints`, for the speed `LimPI.symmetric_optimum`. Not modelled: sampling,
    errors of the data and of the angle.
    """

    machine: DqMachine
    bandwidth: Param[Scalar, "rad/s", positive]  # b, of the closed current loops
    m_max: Param[Scalar, "1", positive] = 3**-0.5  # maximum of the peak phase voltage over the direct voltage
    x_d: Var[Scalar, "V", prefer] = 0.0  # integral part, d axis
    x_q: Var[Scalar, "V", prefer] = 0.0  # integral part, q axis
    m_d: Var[Scalar, "1"] = 0.0  # wanted modulation, d axis
    m_q: Var[Scalar, "1"] = 0.0  # wanted modulation, q axis
    i_d_set: Input = Input()  # setpoint in A
    i_q_set: Input = Input()
    i_d: Input = Input()  # measured in A
    i_q: Input = Input()
    w: Input = Input()  # speed of the shaft in rad/s
    v_dc: Input = Input()  # direct voltage in V
    u_d: Output = Output()
    u_q: Output = Output()

    def equations(self, d: Self) -> Equations:
        m, b, w_el, v_dc = self.machine, self.bandwidth, self.machine.p * self.w.value, self.v_dc.value
        e_d, e_q = self.i_d_set.value - self.i_d.value, self.i_q_set.value - self.i_q.value
        u_d, u_q = limited_amplitude(self.m_d, self.m_q, self.m_max)
        excess_d, excess_q = v_dc * (self.m_d - self.u_d.value), v_dc * (self.m_q - self.u_q.value)
        return dict(
            wanted_d=eq(v_dc * self.m_d, b * m.Ld * e_d + self.x_d - w_el * m.Lq * self.i_q.value),
            wanted_q=eq(v_dc * self.m_q, b * m.Lq * e_q + self.x_q + w_el * (m.Ld * self.i_d.value + m.psi)),
            integral_d=eq(d.x_d, b * (m.Rs * e_d - excess_d)),
            integral_q=eq(d.x_q, b * (m.Rs * e_q - excess_q)),
            limit_d=eq(self.u_d.value, u_d),
            limit_q=eq(self.u_q.value, u_q),
        )


class RotorToPhases(Component):
    """Three signals from two in rotor coordinates: y_x = u_d cos(theta - x 2 pi/3) - u_q sin(theta - x 2 pi/3).

    x = 0, 1, 2 for the phases a, b, c, and theta = p phi with the angle phi of the shaft (inverse Park).
    """

    p: Param[Scalar, "1", positive]  # number of pole pairs of the machine
    u_d: Input = Input()
    u_q: Input = Input()
    phi: Input = Input()  # angle of the shaft in rad
    y_a: Output = Output()
    y_b: Output = Output()
    y_c: Output = Output()

    def equations(self, d: Self) -> Equations:
        angles, outputs = phase_angles(self.p * self.phi.value), (self.y_a, self.y_b, self.y_c)
        return {
            f"phase_{x}": eq(y.value, self.u_d.value * jnp.cos(angle) - self.u_q.value * jnp.sin(angle))
            for y, (x, angle) in zip(outputs, angles.items(), strict=True)
        }
