"""Parts of drives, with parameters of order one, so that a point of order one exercises every term."""

from typing import Any

from acausal import Component
from components import electrical, planar, rotational, translational
from components.thermal import HeatPort

MACHINE = electrical.DqMachine(p=2.0, psi=0.7, Ld=0.4, Lq=0.6, Rs=0.3)
CELL: dict[str, Any] = dict(Q=1.3, charges=[0.0, 0.3, 1.0], voltages=[3.0, 3.3, 4.0], R0=0.3)
WARM: dict[str, Any] = dict(
    R=1.3, k=0.7, J=0.6, winding=0.8, housing=1.2, G_wh=0.4, G_ha=0.3, T_ref=0.9, T=1.1, alpha=0.2, magnets=-0.1
)

ELECTRIC: tuple[Component, ...] = (
    electrical.Battery(R=[0.5, 0.4], C=[1.2, 0.8], **CELL),
    electrical.Battery(R=[0.5], C=[0.8], heat=HeatPort(), **CELL),
    electrical.Battery(**CELL),
    electrical.CurrentControlledBridge(k=0.7, Ti=0.4, V=1.3, i_max=0.8, m_max=0.9, Ron=0.2),
    electrical.BrushDrop(V=1.3, i_0=0.4),
    electrical.BrushDrop(V=1.3, i_0=0.4, heat=HeatPort()),
    electrical.BrushedMotor(**WARM),
    electrical.BrushedMotor(L=0.5, brush=0.4, T_h=0.3, k_e=0.2, **WARM),
    electrical.Cable(length=1.3, area=0.7, resistivity=0.4, inductance=0.3),
    electrical.CurrentLimitedBridge(i_max=1.3, band=0.4, Ron=0.3),
    electrical.DataSheetSolenoid(R=1.3, L_0=3.7, rated=0.9, positions=[-0.5, 0.1, 0.8], forces=[0.2, 0.4, 1.3]),
    electrical.DqCurrentSensor(),
    electrical.Inverter(),
    electrical.MagnetEMF(k_ref=0.7, alpha=-0.1, T_ref=0.9),
    electrical.PMSM(machine=MACHINE, J=0.7),
    electrical.PMSMDrive(machine=MACHINE, J=0.7, i_max=1.3, C=0.9, tau=0.4),
    rotational.Encoder(counts=12.0, period=0.9),
    rotational.IronLoss(T_h=0.7, k_e=0.4, w_0=0.5),
    rotational.IronLoss(T_h=0.7, k_e=0.4, w_0=0.5, heat=HeatPort()),
)
LOSS = rotational.EqualMeshLoss(efficiency=0.8, transition_power=0.7)
STAGE = rotational.PlanetaryGearbox(ratio=2.3, J_sun=0.7, J_carrier=0.6, loss=LOSS)
TEETH = rotational.ElastoBacklash(c=1.3, d=0.7, play=0.4)
DISC = dict(De=2.0, Di=1.1, t=0.7, h=0.9, E=0.6)
DIAPHRAGM = translational.Diaphragm(R=1.3, r=1.0, R_1=1.2, r_1=1.05, r_f=0.4, t=0.3, H=0.4, E=0.9)
MECHANICS: tuple[Component, ...] = (
    rotational.Cam(
        profile=rotational.RiseDwellReturn(motion=rotational.Cycloidal(), height=0.3, rise=1.3, dwell=0.7, fall=1.1),
        J=0.7,
    ),
    rotational.CrankSlider(crank=0.4, rod_length=1.3, offset=0.2),
    rotational.FlexibleCoupling(J_a=0.7, J_b=0.4, c=1.3, d=0.6, c_3=0.8, phi_rel0=0.2),
    rotational.LossyGearR2T.screw(diameter=1.1, lead=0.6, mu=0.3, flank=0.2),
    rotational.PlanetaryGearbox(ratio=2.3, J_sun=0.7, J_carrier=0.6, loss=LOSS),
    rotational.PlanetaryTrain(stages=[STAGE]),
    rotational.PlanetaryTrain(stages=[STAGE, STAGE], teeth=[TEETH, TEETH], support=rotational.Flange()),
    rotational.ReleaseBearing(mu=0.3, diameter=1.3, w_0=0.6),
    translational.DiaphragmClutch(spring=DIAPHRAGM, engaged=0.3, wear=0.1),
    translational.DiscSpring(disc=translational.ConicalDisc(**DISC), series=2.0, parallel=3.0, s_rel0=0.4),
    translational.DualRateSpring(c_1=1.3, c_2=2.1, knee=0.3, s_rel0=0.4),
    translational.Lever(arm_a=0.7, arm_b=1.3),
    translational.Lever(arm_a=0.7, arm_b=-1.3, fulcrum=translational.Flange()),
)
PLANAR: tuple[Component, ...] = (
    planar.Bar(m=1.3, L=0.7, g=0.6),
    planar.Body(m=1.3, J=0.7, g=0.6),
    planar.ConstantForce(fx=1.3, fy=0.4, tau=0.6),
    planar.Damper(d=1.3),
    planar.DistanceSensor(),
    planar.Fixed(x0=0.3, y0=0.2, phi0=0.4),
    planar.FixedTranslation(rx=0.7, ry=0.4),
    planar.ForceSensor(),
    planar.LineForce(),
    planar.PositionSensor(),
    planar.Prismatic(angle=0.3),
    planar.Prismatic(angle=0.3, rod=translational.Flange()),
    planar.Revolute(),
    planar.Revolute(shaft=rotational.Flange()),
    planar.SignalForce(),
    planar.SpeedSensor(),
    planar.Spring(c=1.3, L_0=0.4),
)
DRIVES: tuple[Component, ...] = ELECTRIC + MECHANICS + PLANAR
