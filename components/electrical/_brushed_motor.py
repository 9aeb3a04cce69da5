"""Brushed motor with thermal model."""

import itertools
from typing import Self

import jax.numpy as jnp

from acausal import (
    Component,
    Connections,
    Energy,
    Equations,
    Param,
    Requirements,
    Scalar,
    Var,
    connect,
    eq,
    nonnegative,
    positive,
    require,
)

from .._data_sheet import DataSheet
from ..rotational import Flange, Inertia, IronLoss
from ..thermal import HeatCapacitor, HeatPort, ThermalConductor
from ._interfaces import Pin, TwoPin
from ._passive import Inductor
from ._variable import HeatingResistor

_COPPER, _T20 = 3.93e-3, 293.15  # temperature coefficient in 1/K at that temperature in K (IEC 60028)


class BrushDrop(TwoPin):
    """Contact voltage of a pair of brushes, v = V tanh(i/i_0), nearly constant above the current i_0.

    About 2 V for graphite, 0.5 V for metal graphite, much less for precious metal (Schroeder, `Elektrische Antriebe`).
    With `heat=HeatPort()` the loss leaves as heat.
    """

    V: Param[Scalar, "V", nonnegative]  # contact voltage of both brushes together
    i_0: Param[Scalar, "A", positive] = 0.1  # width of the transition through zero
    heat: HeatPort | None = None

    def equations(self, d: Self) -> Equations:
        heat = {} if self.heat is None else dict(loss=eq(self.heat.Q_flow, -self.v * self.i))
        return super().equations(d) | heat | dict(contact=eq(self.v, self.V * jnp.tanh(self.i / self.i_0)))

    def energy(self) -> Energy:
        return Energy(dissipated=self.v * self.i if self.heat is None else 0.0)


class MagnetEMF(Component):
    """Lossless conversion with magnets that depend on temperature: v = k w, tau = -k i.

    k = k_ref (1 + alpha (T - T_ref)) with the temperature T of the heat port, which takes no heat. The stator is the
    ground. Valid below the temperature of irreversible demagnetisation; alpha is about -2e-3 1/K for ferrite,
    -1.1e-3 1/K for NdFeB and -0.4e-3 1/K for SmCo (IEC 60404-8-1).
    """

    k_ref: Param[Scalar, "N.m/A"]  # torque constant at T_ref
    alpha: Param[Scalar, "1/K"] = 0.0  # temperature coefficient of the remanence
    T_ref: Param[Scalar, "K", positive] = 293.15  # reference temperature
    k: Var[Scalar, "N.m/A"] = 0.0  # torque constant
    w: Var[Scalar, "rad/s"] = 0.0  # speed of the shaft
    p: Pin = Pin()
    n: Pin = Pin()
    shaft: Flange = Flange()
    heat: HeatPort = HeatPort()

    def equations(self, d: Self) -> Equations:
        return dict(
            kirchhoff=eq(self.p.i + self.n.i),
            speed=eq(self.w, d.shaft.phi),
            no_heat=eq(self.heat.Q_flow),
            magnets=eq(self.k, self.k_ref * (1.0 + self.alpha * (self.heat.T - self.T_ref))),
            back_emf=eq(self.p.v - self.n.v, self.k * self.w),
            torque=eq(self.shaft.tau, -self.k * self.p.i),
        )


class BrushedMotor(Component):
    """Direct-current motor with heating: v = R i + L di/dt + brush tanh(i/i_0) + k w, J dw/dt = k i - drag + tau.

    For the brush voltage see `BrushDrop`, for the drag of the core see `rotational.IronLoss`.

    R is linear in the temperature T_w of the winding, k in the temperature T_h of the housing, which holds the magnets:
    C_w dT_w/dt = R i^2 - G_wh (T_w - T_h) and C_h dT_h/dt = G_wh (T_w - T_h) + losses of brushes and core - G_ha (T_h -
    T_ambient). `ambient` must be connected, for example to a `FixedTemperature`. Data sheets state thermal resistances,
    1/G, and time constants, C/G. `BrushedMotor(R=..., k=..., J=..., winding=..., housing=..., G_wh=..., G_ha=...)`. At
    a constant current above sqrt(G/(R alpha)), with 1/G = 1/G_wh + 1/G_ha, the winding runs away thermally. The default
    of alpha is that of copper: 3.93e-3 1/K at 20 C, and 3.85e-3 1/K at the 25 C of data sheets. Not modelled:
    commutation, armature reaction, saturation, cooling that depends on the speed.
    """

    resistor: HeatingResistor
    inductor: Inductor | None
    brushes: BrushDrop | None
    emf: MagnetEMF
    rotor: Inertia
    iron: IronLoss
    winding: HeatCapacitor
    housing: HeatCapacitor
    inside: ThermalConductor
    outside: ThermalConductor
    data_sheet: DataSheet | None = None  # source of the parameters; see `catalogues`
    p: Pin = Pin()
    n: Pin = Pin()
    shaft: Flange = Flange()
    ambient: HeatPort = HeatPort()

    def __init__(
        self,
        *,
        R: Param[Scalar, "ohm"],  # resistance of the winding at T_ref
        k: Param[Scalar, "N.m/A"],  # torque constant at T_ref
        J: Param[Scalar, "kg.m2"],  # moment of inertia of the rotor
        winding: Param[Scalar, "J/K"],  # heat capacity C_w of the winding
        housing: Param[Scalar, "J/K"],  # heat capacity C_h of the housing with the magnets
        G_wh: Param[Scalar, "W/K"],  # thermal conductance from winding to housing
        G_ha: Param[Scalar, "W/K"],  # thermal conductance from housing to ambient
        L: Param[Scalar, "H"] | None = None,  # inductance; none by default
        alpha: Param[Scalar, "1/K"] | None = None,  # temperature coefficient of R at T_ref; copper by default
        magnets: Param[Scalar, "1/K"] = 0.0,  # temperature coefficient of the magnets; see `MagnetEMF`
        brush: Param[Scalar, "V"] | None = None,  # contact voltage of the brushes
        T_h: Param[Scalar, "N.m"] = 0.0,  # constant part of friction and iron losses
        k_e: Param[Scalar, "N.m.s/rad"] = 0.0,  # part of friction and iron losses per speed
        T_ref: Param[Scalar, "K"] = 298.15,  # reference temperature of the data
        T: Param[Scalar, "K"] = 298.15,  # initial temperature of winding and housing
        data_sheet: DataSheet | None = None,
    ) -> None:
        self.emf = MagnetEMF(k_ref=k, alpha=magnets, T_ref=T_ref)
        copper = _COPPER / (1.0 + _COPPER * (self.emf.T_ref - _T20))
        self.resistor = HeatingResistor(R_ref=R, T_ref=T_ref, alpha=copper if alpha is None else alpha)
        self.inductor = None if L is None else Inductor(L=L)
        self.brushes = None if brush is None else BrushDrop(V=brush, heat=HeatPort())
        self.rotor, self.data_sheet = Inertia(J=J), data_sheet
        self.iron = IronLoss(T_h=T_h, k_e=k_e, heat=HeatPort())
        self.winding, self.housing = HeatCapacitor(C=winding, T=T), HeatCapacitor(C=housing, T=T)
        self.inside, self.outside = ThermalConductor(G=G_wh), ThermalConductor(G=G_ha)
        self.p, self.n, self.shaft, self.ambient = Pin(), Pin(), Flange(), HeatPort()

    def requirements(self) -> Requirements:
        return (require(self.emf.T_ref == self.resistor.T_ref, "emf.T_ref must equal resistor.T_ref"),)

    def connections(self) -> Connections:
        parts = [part for part in (self.resistor, self.inductor, self.brushes, self.emf) if part is not None]
        brushes = () if self.brushes is None or self.brushes.heat is None else (self.brushes.heat,)
        assert self.iron.heat is not None
        return (
            connect(self.p, parts[0].p),
            *(connect(one.n, other.p) for one, other in itertools.pairwise(parts)),
            connect(self.emf.n, self.n),
            connect(self.emf.shaft, self.rotor.a, self.iron.flange),
            connect(self.rotor.b, self.shaft),
            connect(self.resistor.heat, self.winding.port, self.inside.a),
            connect(self.inside.b, self.housing.port, self.outside.a, self.emf.heat, self.iron.heat, *brushes),
            connect(self.outside.b, self.ambient),
        )
