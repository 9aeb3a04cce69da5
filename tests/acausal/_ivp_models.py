"""Problems of the Test Set for IVP Solvers (Mazzia, Magherini, 2008) as models, with their published end values."""

from typing import Self

import jax.numpy as jnp

from acausal import Component, Connections, Equations, Nominal, Param, Scalar, Time, Var, Vector, connect, eq, positive
from acausal import shape as sized
from components.blocks import Sine
from components.electrical import Capacitor, ConstantVoltage, Ground, Pin, Resistor, SignalVoltage


class CarAxis(Component):
    """An axis of constant length on two springs, driven over a bump: index 3. Without units, as published."""

    M: Param[Scalar, "", positive] = 10.0
    eps: Param[Scalar, "", positive] = 0.01
    L: Param[Scalar, "", positive] = 1.0
    L0: Param[Scalar, "", positive] = 0.5
    bump: Param[Scalar, ""] = 0.1
    omega: Param[Scalar, ""] = 10.0
    g: Param[Scalar, ""] = 1.0
    t: Time[Scalar, ""] = 0.0
    xl: Var[Scalar, ""] = 0.0
    yl: Var[Scalar, ""] = 0.0
    xr: Var[Scalar, ""] = 0.0
    yr: Var[Scalar, ""] = 0.0
    ul: Var[Scalar, ""] = 0.0
    vl: Var[Scalar, ""] = 0.0
    ur: Var[Scalar, ""] = 0.0
    vr: Var[Scalar, ""] = 0.0
    lam1: Var[Scalar, ""] = 0.0
    lam2: Var[Scalar, ""] = 0.0

    def equations(self, d: Self) -> Equations:
        xl, yl, xr, yr = self.xl, self.yl, self.xr, self.yr
        yb = self.bump * jnp.sin(self.omega * self.t)
        xb = jnp.sqrt(self.L**2 - yb**2)
        k = 0.5 * self.M * self.eps**2
        left = self.L0 / jnp.hypot(xl, yl) - 1.0
        right = self.L0 / jnp.hypot(xr - xb, yr - yb) - 1.0
        rod_x, rod_y = 2.0 * self.lam2 * (xl - xr), 2.0 * self.lam2 * (yl - yr)
        return dict(
            speed_xl=eq(self.ul, d.xl),
            speed_yl=eq(self.vl, d.yl),
            speed_xr=eq(self.ur, d.xr),
            speed_yr=eq(self.vr, d.yr),
            newton_xl=eq(k * d.ul, left * xl + self.lam1 * xb + rod_x),
            newton_yl=eq(k * d.vl, left * yl + self.lam1 * yb + rod_y - k * self.g),
            newton_xr=eq(k * d.ur, right * (xr - xb) - rod_x),
            newton_yr=eq(k * d.vr, right * (yr - yb) - rod_y - k * self.g),
            upright=eq(xb * xl + yb * yl),
            axis=eq((xl - xr) ** 2 + (yl - yr) ** 2, self.L**2),
        )


CAR_AXIS = {
    "xl": 0.04934557842754028,
    "yl": 0.49698946023017115,
    "xr": 1.0417425248854215,
    "yr": 0.37391102726536124,
    "ul": -0.07705836840409723,
    "vl": 0.007446866587237785,
    "ur": 0.017556815753723223,
    "vr": 0.7703410437792519,
    "lam1": -0.004736886590848933,
    "lam2": -0.0011046803312573436,
}


class Transistor(Component):
    """Base, collector, emitter: i_e = -g, i_c = alpha g, with g = beta (exp((v_b - v_e) / U_F) - 1)."""

    alpha: Param[Scalar, "1"] = 0.99
    beta: Param[Scalar, "A", positive] = 1e-6
    U_F: Param[Scalar, "V", positive] = 0.026
    b: Pin = Pin()
    c: Pin = Pin()
    e: Pin = Pin()

    def equations(self, d: Self) -> Equations:
        g = self.beta * (jnp.exp((self.b.v - self.e.v) / self.U_F) - 1.0)
        return dict(
            base=eq(self.b.i, (1.0 - self.alpha) * g), collector=eq(self.c.i, self.alpha * g), emitter=eq(self.e.i, -g)
        )


class TransistorAmplifier(Component):
    """Two stages with one transistor each, with capacitors C1 to C5 between them."""

    signal: Sine
    input: SignalVoltage
    supply: ConstantVoltage
    R: tuple[Resistor, ...]  # R0 to R9
    C: tuple[Capacitor, ...]  # C1 to C5
    transistors: tuple[Transistor, Transistor]
    ground: Ground = Ground()

    def connections(self) -> Connections:
        R, (first, second) = self.R, self.transistors
        C1, C2, C3, C4, C5 = self.C
        low = (R[i].n for i in (1, 3, 5, 7, 9))
        high = (R[i].p for i in (2, 4, 6, 8))
        return (
            connect(self.signal.y, self.input.u),
            connect(self.ground.p, self.input.n, self.supply.n, C2.n, C4.n, *low),
            connect(self.supply.p, *high),
            connect(self.input.p, R[0].p),
            connect(R[0].n, C1.p),  # node 1
            connect(C1.n, R[1].p, R[2].n, first.b),
            connect(first.e, R[3].p, C2.p),
            connect(first.c, R[4].n, C3.p),
            connect(C3.n, R[5].p, R[6].n, second.b),
            connect(second.e, R[7].p, C4.p),
            connect(second.c, R[8].n, C5.p),
            connect(C5.n, R[9].p),  # node 8
        )


def transistor_amplifier() -> TransistorAmplifier:
    starts = (-3.0, 3.0, 3.0, 3.0, 6.0)
    return TransistorAmplifier(
        signal=Sine(amplitude=0.1, frequency=100.0),
        input=SignalVoltage(),
        supply=ConstantVoltage(V=6.0),
        R=tuple(Resistor(R=R) for R in (1e3, *(9e3,) * 9)),
        C=tuple(Capacitor(C=1e-6 * (i + 1), v=v) for i, v in enumerate(starts)),
        transistors=(Transistor(), Transistor()),
    )


AMPLIFIER = [
    -0.005562145012262709,
    3.006522471903042,
    2.849958788608128,
    2.926422536206241,
    2.704617865010554,
    2.761837778393145,
    4.770927631616772,
    1.236995868091548,
]


class Akzo(Component):
    """The chemical Akzo Nobel problem: five concentrations and a fast equilibrium, index 1. Without units."""

    k: Param[Vector, ""] = (18.7, 0.58, 0.09, 0.42)  # pyright: ignore[reportAssignmentType]
    K: Param[Scalar, ""] = 34.4
    klA: Param[Scalar, ""] = 3.3
    Ks: Param[Scalar, ""] = 115.83
    saturated: Param[Scalar, ""] = 0.9 / 737.0  # pCO2 / H
    y: Var[Vector, "", sized(6), Nominal(1e-3)] = 0.0  # pyright: ignore[reportAssignmentType]

    def equations(self, d: Self) -> Equations:
        y1, y2, y3, y4, y5, y6 = self.y
        root = jnp.sqrt(y2)
        r1, r2, r3 = self.k[0] * y1**4 * root, self.k[1] * y3 * y4, self.k[1] / self.K * y1 * y5
        r4, r5 = self.k[2] * y1 * y4**2, self.k[3] * y6**2 * root
        return dict(
            y1=eq(d.y[0], -2.0 * r1 + r2 - r3 - r4),
            y2=eq(d.y[1], -0.5 * r1 - r4 - 0.5 * r5 + self.klA * (self.saturated - y2)),
            y3=eq(d.y[2], r1 - r2 + r3),
            y4=eq(d.y[3], -r2 + r3 - 2.0 * r4),
            y5=eq(d.y[4], r2 - r3 + r5),
            equilibrium=eq(self.Ks * y1 * y4, y6),
        )


AKZO = [
    0.1150794920661702,
    0.001203831471567715,
    0.1611562887407974,
    0.0003656156421249283,
    0.01708010885264404,
    0.004873531310307455,
]


class RingModulator(Component):
    """Four diodes with stray capacitances of 2 pF mix 1 kHz with 10 kHz: stiff and oscillating. Without units."""

    C: Param[Scalar, "", positive] = 1.6e-8
    Cs: Param[Scalar, "", positive] = 2e-12
    Cp: Param[Scalar, "", positive] = 1e-8
    R: Param[Scalar, ""] = 25e3
    Rp: Param[Scalar, ""] = 50.0
    Lh: Param[Scalar, "", positive] = 4.45
    Ls: Param[Vector, ""] = (2e-3, 5e-4, 5e-4)  # pyright: ignore[reportAssignmentType]
    Rg: Param[Vector, ""] = (36.3, 17.3, 17.3)  # pyright: ignore[reportAssignmentType]
    Ri: Param[Scalar, ""] = 50.0
    Rc: Param[Scalar, ""] = 600.0
    gamma: Param[Scalar, ""] = 40.67286402e-9
    delta: Param[Scalar, ""] = 17.7493332
    t: Time[Scalar, ""] = 0.0
    # y1 to y7, y8 and y9, y10 to y15:
    v: Var[Vector, "", sized(7), Nominal(1e-2)] = 0.0  # pyright: ignore[reportAssignmentType]
    h: Var[Vector, "", sized(2), Nominal(1e-6)] = 0.0  # pyright: ignore[reportAssignmentType]
    i: Var[Vector, "", sized(6), Nominal(1e-4)] = 0.0  # pyright: ignore[reportAssignmentType]

    def equations(self, d: Self) -> Equations:
        y1, y2, y3, y4, y5, y6, y7 = self.v
        y8, y9 = self.h
        y10, y11, y12, y13, y14, y15 = self.i
        u1, u2 = 0.5 * jnp.sin(2e3 * jnp.pi * self.t), 2.0 * jnp.sin(2e4 * jnp.pi * self.t)
        across = jnp.stack([y3 - y5 - y7 - u2, -y4 + y6 - y7 - u2, y4 + y5 + y7 + u2, -y3 - y6 + y7 + u2])
        q1, q2, q3, q4 = self.gamma * (jnp.exp(self.delta * across) - 1.0)
        (Ls1, Ls2, Ls3), (Rg1, Rg2, Rg3) = self.Ls, self.Rg
        stray = [y10 - q1 + q4, -y11 + q2 - q3, y12 + q1 - q3, -y13 - q2 + q4]
        windings = [
            0.5 * y1 - y3 - Rg2 * y10,
            -0.5 * y1 + y4 - Rg3 * y11,
            0.5 * y2 - y5 - Rg2 * y12,
            -0.5 * y2 + y6 - Rg3 * y13,
            -y1 + u1 - (self.Ri + Rg1) * y14,
            -y2 - (self.Rc + Rg1) * y15,
        ]
        return dict(
            first=eq(self.C * d.v[0], y8 - 0.5 * y10 + 0.5 * y11 + y14 - y1 / self.R),
            second=eq(self.C * d.v[1], y9 - 0.5 * y12 + 0.5 * y13 + y15 - y2 / self.R),
            stray=eq(self.Cs * d.v[2:6], jnp.stack(stray)),
            load=eq(self.Cp * d.v[6], -y7 / self.Rp + q1 + q2 - q3 - q4),
            main=eq(self.Lh * d.h, -self.v[:2]),
            windings=eq(jnp.stack([Ls2, Ls3, Ls2, Ls3, Ls1, Ls1]) * d.i, jnp.stack(windings)),
        )


RING_MODULATOR = [
    -0.02339057358486745,
    -0.007367485485540825,
    0.2582956709291169,
    -0.406446572128345,
    -0.4039455665149794,
    0.2607966765422943,
    0.1106761861269975,
    2.939904342435596e-07,
    -2.840029933642329e-08,
    0.0007267198267264553,
    0.000792948719696084,
    -0.0007255283495698965,
    -0.0007941401968526521,
    7.088495416976114e-05,
    2.39005907523657e-05,
]
