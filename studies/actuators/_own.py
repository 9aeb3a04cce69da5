"""Actuators from the user's parts: order names, data sheets, components or numbers."""

import math
from typing import Any

from acausal import ArgumentError, Scalar, replace
from components import catalogues
from components.catalogues import DataSheet
from components.electrical import ConstantVoltage, DCMotor
from components.hydraulic import LaminarResistance, Line, MasterCylinder, Pump, ReliefValve, SlaveCylinder, dot_4
from components.rotational import Cam, EqualMeshLoss, Fixed, PlanetaryGearbox, PlanetaryTrain
from components.translational import ClutchSpring, Mass, TabulatedSpring, ViscousFriction

from ._designs import LINE_DAMPING, LINE_STIFFNESS, MASTER_BORE, SLAVE_BORE, SPRING_RATE, ema_fise
from ._models import ElectrohydraulicActuator, ElectromechanicalActuator
from ._parameters import SUPPLY
from ._stops import RodStops, ShaftStops
from ._warm import SHEETS

LEADS = 0.1  # ohm, between battery and motor; assumed
MESH = 0.97  # efficiency of the meshes of a planetary stage (Meloni, chapter 6)
SLIP = 5e-9  # Wilson's slip coefficient C_s, a typical value; the thesis has none
HIGHEST = 4e6  # Pa, opening pressure of the relief valve: 33.4 bar for the 800 N of a worn clutch, and a reserve
STOPS = (-0.5e-3, 15e-3)  # m, end stops of the slave; assumed
CAM_STOPS = (-0.1, 0.95 * math.pi)  # rad, just before the lowest and the highest point of the cam; assumed
PIPE = (4e-3, 1.0)  # m, inner diameter and length of a typical steel pipe for brakes and clutches; assumed
_CAM = ema_fise().cam


def electromechanical(
    motor: str | DataSheet | DCMotor,
    gearhead: str | DataSheet | PlanetaryGearbox | PlanetaryTrain | Scalar,
    *,
    clutch: ClutchSpring | TabulatedSpring | None = None,
    voltage: Scalar = SUPPLY,
    leads: Scalar = LEADS,
    friction: Scalar | None = None,
    cam: Cam | None = None,
    master_bore: Scalar = MASTER_BORE,
    slave_bore: Scalar = SLAVE_BORE,
    pipe: tuple[Scalar, Scalar] | None = PIPE,
    stops: bool = True,
) -> ElectromechanicalActuator:
    """An electromechanical actuator: motor, gearhead, cam, master cylinder, line, slave cylinder and clutch.

    - `motor`: an order name of the catalogue, a data sheet, or a `DCMotor`. A `DCMotor` is used unchanged, without
      `leads` and `friction`.
    - `gearhead`: an order name, a data sheet, a planetary stage or train, or a ratio, which stands for a stage that
      loses 3 % in its meshes.
    - `clutch`: a spring, by default that of the test rig, 58 N/mm; `cam`: by default that of the thesis.
    - `friction`: viscous friction in N.m.s/rad of all parts that turn with the motor. The default is the friction of
      the no-load current of the motor. The thesis identified 4e-3 on two prototypes, about a hundred times as much.
    - `voltage` in V, `leads` in ohm, bores in m, `pipe`: inner diameter and length in m, None for no pressure drop.
    - `stops`: whether cam and slave have end stops.

    Line, piston and seal are those of the thesis.
    """
    gearbox = _gearhead(gearhead)
    return ElectromechanicalActuator(
        supply=ConstantVoltage(V=voltage),
        motor=_motor(motor, leads, friction),
        gearbox=gearbox,
        housing=Fixed() if isinstance(gearbox, PlanetaryGearbox) else None,
        cam=_CAM if cam is None else cam,
        cam_stops=ShaftStops(phi_min=CAM_STOPS[0], phi_max=CAM_STOPS[1]) if stops else None,
        master=MasterCylinder(bore=master_bore),
        **_load(clutch, slave_bore, pipe, stops),
    )


def electrohydraulic(
    motor: str | DataSheet | DCMotor,
    pump: str | DataSheet | Pump | Scalar,
    *,
    clutch: ClutchSpring | TabulatedSpring | None = None,
    voltage: Scalar = SUPPLY,
    leads: Scalar = LEADS,
    friction: Scalar | None = None,
    slave_bore: Scalar = SLAVE_BORE,
    slip: Scalar = SLIP,
    relief: Scalar | None = HIGHEST,
    pipe: tuple[Scalar, Scalar] | None = PIPE,
    stops: bool = True,
) -> ElectrohydraulicActuator:
    """An electrohydraulic actuator: motor, pump with tank, line, slave cylinder and clutch.

    - `pump`: an order name, a data sheet, a `Pump`, which is used unchanged, or a displacement in m3/rad, as in
      `quantity(1.25, "cm3/rev")`. `slip` is Wilson's C_s: the leakage is D C_s dp/mu with the viscosity mu of DOT 4 at
      25 C.
    - `relief`: the opening pressure of the relief valve in Pa, or None for no relief valve.

    Other arguments are those of `electromechanical`. Pump data sheets state no slip, inertia or friction.
    """
    valve = None if relief is None else ReliefValve(conductance=2e-10, cracking_pressure=relief)
    return ElectrohydraulicActuator(
        supply=ConstantVoltage(V=voltage), motor=_motor(motor, leads, friction), pump=_pump(pump, slip), relief=valve,
        **_load(clutch, slave_bore, pipe, stops),
    )  # fmt: skip


def _motor(motor: str | DataSheet | DCMotor, leads: Scalar, friction: Scalar | None) -> DCMotor:
    if isinstance(motor, DCMotor):
        return motor
    made = catalogues.dc_motor(motor, **({} if friction is None else {"friction": friction}))
    return replace(made, {"resistor.R": made.resistor.R + leads})


def _gearhead(given: str | DataSheet | PlanetaryGearbox | PlanetaryTrain | Scalar) -> PlanetaryGearbox | PlanetaryTrain:
    if isinstance(given, PlanetaryGearbox | PlanetaryTrain):
        return given
    if isinstance(given, DataSheet):
        return catalogues.gearhead(given) if given["stages"] == 1.0 else catalogues.gear_train(given)
    if isinstance(given, str):
        return _gearhead(catalogues.catalogue("gearheads")[given])
    return PlanetaryGearbox(ratio=given, loss=EqualMeshLoss(efficiency=MESH))


def _pump(given: str | DataSheet | Pump | Scalar, slip: Scalar) -> Pump:
    if isinstance(given, Pump):
        return given
    pump = catalogues.pump(given) if isinstance(given, str | DataSheet) else Pump(displacement=given)
    return replace(pump, {"leakage": slip * pump.displacement / _viscosity()})


def _viscosity() -> Scalar:
    """Viscosity of DOT 4 in Pa.s at the temperature of data sheets."""
    liquid = dot_4(SHEETS)
    return liquid.reference_density * liquid.kinematic_viscosity(0.0)


def _load(
    clutch: ClutchSpring | TabulatedSpring | None,
    slave_bore: Scalar,
    pipe: tuple[Scalar, Scalar] | None,
    stops: bool,
) -> dict[str, Any]:
    """The parts downstream of the pump or master cylinder."""
    if pipe is not None and len(pipe) != 2:
        raise ArgumentError(f"pipe must be an inner diameter and a length in m, or None, got {pipe!r}.")
    drop = None
    if pipe is not None:
        drop = LaminarResistance.from_pipe(diameter=pipe[0], length=pipe[1], viscosity=_viscosity())
    return dict(
        line=Line(stiffness=LINE_STIFFNESS, damping=LINE_DAMPING), slave=SlaveCylinder(bore=slave_bore), pipe=drop,
        piston=Mass(m=0.3), seal=ViscousFriction(C=2e-3),
        clutch=ClutchSpring(rate=SPRING_RATE) if clutch is None else clutch,
        stops=RodStops(s_min=STOPS[0], s_max=STOPS[1]) if stops else None,
    )  # fmt: skip
