"""Hydraulically transmitted clutch actuators: the present one, two electromechanical ones and an electrohydraulic one.

Each function builds a model from keywords in SI units; every keyword can be traced, so that a model can be made inside
`jax.jit`, `jax.grad` or `jax.vmap`.
"""

from ._commanded import CommandedElectrohydraulic as CommandedElectrohydraulic
from ._commanded import CommandedElectromechanical as CommandedElectromechanical
from ._commanded import commanded as commanded
from ._designs import DISPLACEMENT as DISPLACEMENT
from ._designs import SPRING_RATE as SPRING_RATE
from ._designs import ehs_maxon as ehs_maxon
from ._designs import ehs_sticking as ehs_sticking
from ._designs import ema_fise as ema_fise
from ._designs import ema_maxon as ema_maxon
from ._designs import sila as sila
from ._holding import CLOSING_TIME as CLOSING_TIME
from ._holding import COIL as COIL
from ._holding import LEAKAGE as LEAKAGE
from ._holding import MotorHeldActuator as MotorHeldActuator
from ._holding import ValveHeldActuator as ValveHeldActuator
from ._holding import motor_held as motor_held
from ._holding import valve_held as valve_held
from ._models import ClutchActuator as ClutchActuator
from ._models import ElectrohydraulicActuator as ElectrohydraulicActuator
from ._models import ElectromechanicalActuator as ElectromechanicalActuator
from ._models import PumpActuator as PumpActuator
from ._models import StickingActuator as StickingActuator
from ._models import WormActuator as WormActuator
from ._models import pump_parts as pump_parts
from ._opening import LONGEST as LONGEST
from ._opening import STROKE as STROKE
from ._opening import WORN_LOAD as WORN_LOAD
from ._opening import opening as opening
from ._opening import opening_time as opening_time
from ._parameters import LARGEST_TORQUE as LARGEST_TORQUE
from ._parameters import NO_LOAD_FRICTION as NO_LOAD_FRICTION
from ._parameters import PRESENT_RATIO as PRESENT_RATIO
from ._parameters import REDUCED_SUPPLY as REDUCED_SUPPLY
from ._parameters import SUPPLY as SUPPLY
from ._parameters import Parameter as Parameter
from ._parameters import parameter_set as parameter_set
from ._statics import WORN as WORN
from ._statics import Hold as Hold
from ._statics import angle_at as angle_at
from ._statics import delivered as delivered
from ._statics import hold as hold
from ._statics import holding_current as holding_current
from ._statics import lift_share as lift_share
from ._statics import line_pressure as line_pressure
from ._statics import pressure_angle as pressure_angle
from ._warm import SHEETS as SHEETS
from ._warm import magnets as magnets
from ._warm import winding as winding
