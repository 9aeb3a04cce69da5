"""Signals: ports without power, sources of time, operations, dynamics, controllers, tables and learned curves."""

from typing import TYPE_CHECKING

from .._lazy import when_asked

if TYPE_CHECKING:
    from ._continuous import Derivative as Derivative
    from ._continuous import FirstOrder as FirstOrder
    from ._continuous import Integrator as Integrator
    from ._continuous import LeadLag as LeadLag
    from ._continuous import Notch as Notch
    from ._continuous import SecondOrder as SecondOrder
    from ._controllers import PI as PI
    from ._controllers import PID as PID
    from ._controllers import LimitedController as LimitedController
    from ._controllers import LimPI as LimPI
    from ._controllers import LimPID as LimPID
    from ._delays import FixedDelay as FixedDelay
    from ._delays import PadeDelay as PadeDelay
    from ._delays import TransportDelay as TransportDelay
    from ._interfaces import SI2SO as SI2SO
    from ._interfaces import SISO as SISO
    from ._interfaces import Input as Input
    from ._interfaces import Output as Output
    from ._interfaces import Signal as Signal
    from ._interfaces import SignalSource as SignalSource
    from ._learned import Curve as Curve
    from ._learned import MonotoneCurve as MonotoneCurve
    from ._learned import Network as Network
    from ._linear_systems import StateSpace as StateSpace
    from ._linear_systems import TransferFunction as TransferFunction
    from ._logic import And as And
    from ._logic import Comparator as Comparator
    from ._logic import Counter as Counter
    from ._logic import Hysteresis as Hysteresis
    from ._logic import Latch as Latch
    from ._logic import Monostable as Monostable
    from ._logic import Not as Not
    from ._logic import OnDelay as OnDelay
    from ._logic import Or as Or
    from ._logic import StateMachine as StateMachine
    from ._logic import Timer as Timer
    from ._logic import TwoPointController as TwoPointController
    from ._logic import Xor as Xor
    from ._math import Division as Division
    from ._math import Function as Function
    from ._math import Gain as Gain
    from ._math import Maximum as Maximum
    from ._math import Minimum as Minimum
    from ._math import Product as Product
    from ._math import Sum as Sum
    from ._math import WeightedSum as WeightedSum
    from ._noise import BandLimitedNoise as BandLimitedNoise
    from ._noise import NormalNoise as NormalNoise
    from ._noise import UniformNoise as UniformNoise
    from ._nonlinear import DeadZone as DeadZone
    from ._nonlinear import Limiter as Limiter
    from ._nonlinear import Play as Play
    from ._nonlinear import SlewRateLimiter as SlewRateLimiter
    from ._nonlinear import SmoothSwitch as SmoothSwitch
    from ._nonlinear import Switch as Switch
    from ._pwm import PWMAverage as PWMAverage
    from ._sampled import PWM as PWM
    from ._sampled import MovingAverage as MovingAverage
    from ._sampled import SampledDelay as SampledDelay
    from ._sampled import SampleHold as SampleHold
    from ._sampled_controllers import SampledP as SampledP
    from ._sampled_controllers import SampledPI as SampledPI
    from ._sampled_controllers import SampledPID as SampledPID
    from ._sources import ChirpSine as ChirpSine
    from ._sources import Clock as Clock
    from ._sources import Constant as Constant
    from ._sources import Exponentials as Exponentials
    from ._sources import ExpSine as ExpSine
    from ._sources import Pulse as Pulse
    from ._sources import Ramp as Ramp
    from ._sources import SawTooth as SawTooth
    from ._sources import Sine as Sine
    from ._sources import Step as Step
    from ._sources import TimeFunction as TimeFunction
    from ._sources import Trapezoid as Trapezoid
    from ._tables import Extrapolation as Extrapolation
    from ._tables import Staircase as Staircase
    from ._tables import Table1D as Table1D
    from ._tables import Table2D as Table2D
    from ._tables import TimeSeries as TimeSeries
else:
    __getattr__, __dir__, __all__ = when_asked(__name__)
