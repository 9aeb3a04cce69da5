"""Acausal, differentiable component models in JAX."""

from ._analyse.linear_system import LinearSystem as LinearSystem
from ._analyse.linearise import linearise as linearise
from ._analyse.margins import Margins as Margins
from ._analyse.modes import Modes as Modes
from ._analyse.modes import Shares as Shares
from ._analyse.sampled import SampledWarning as SampledWarning
from ._analyse.zeros import TransferFunction as TransferFunction
from ._declare.annotations import Discrete as Discrete
from ._declare.annotations import Flow as Flow
from ._declare.annotations import Nominal as Nominal
from ._declare.annotations import Param as Param
from ._declare.annotations import Scalar as Scalar
from ._declare.annotations import Time as Time
from ._declare.annotations import Var as Var
from ._declare.annotations import Vector as Vector
from ._declare.annotations import avoid as avoid
from ._declare.annotations import never as never
from ._declare.annotations import nonnegative as nonnegative
from ._declare.annotations import nonzero as nonzero
from ._declare.annotations import positive as positive
from ._declare.annotations import prefer as prefer
from ._declare.annotations import shape as shape
from ._declare.annotations import unbounded as unbounded
from ._declare.array import Array as Array
from ._declare.array import repeat as repeat
from ._declare.array import stack as stack
from ._declare.by_name import Parameters as Parameters
from ._declare.by_name import parameters as parameters
from ._declare.by_name import replace as replace
from ._declare.component import Component as Component
from ._declare.component import Connections as Connections
from ._declare.component import Energy as Energy
from ._declare.component import Equations as Equations
from ._declare.component import Events as Events
from ._declare.component import at as at
from ._declare.component import connect as connect
from ._declare.component import eq as eq
from ._declare.component import refuse as refuse
from ._declare.component import when as when
from ._declare.ifelse import ifelse as ifelse
from ._declare.ifelse import segment as segment
from ._declare.node import Port as Port
from ._declare.node import Record as Record
from ._declare.requirements import Requirements as Requirements
from ._declare.requirements import require as require
from ._declare.sizes import sized as sized
from ._errors import AcausalError as AcausalError
from ._errors import ArgumentError as ArgumentError
from ._errors import ModelError as ModelError
from ._errors import ParameterError as ParameterError
from ._errors import SimulationError as SimulationError
from ._errors import StructureError as StructureError
from ._errors import UnitError as UnitError
from ._errors import UnknownNameError as UnknownNameError
from ._errors import UnknownPartError as UnknownPartError
from ._evaluate.choose_states import choose_states as choose_states
from ._evaluate.system import System as System
from ._integrate.energy import EnergyAccount as EnergyAccount
from ._integrate.event_log import EventLog as EventLog
from ._integrate.initialise import initialise as initialise
from ._integrate.peaks import Peak as Peak
from ._integrate.result import Result as Result
from ._integrate.simulate import simulate as simulate
from ._integrate.solution import Solution as Solution
from ._integrate.solution_plot import compare as compare
from ._integrate.solvers import Rodas3P as Rodas3P
from ._integrate.solvers import Rodas5P as Rodas5P
from ._integrate.unresolved import UnresolvedWarning as UnresolvedWarning
from ._jax_settings import (
    choose_compiler_options,
    choose_optimisation,
    enable_double_precision,
    keep_compiled_programs,
    silence_slow_compilation,
)
from ._progress import announce_compilation
from ._reduce.jumps import JumpWarning as JumpWarning
from ._save_load import VersionWarning as VersionWarning
from ._save_load import about as about
from ._save_load import load as load
from ._save_load import save as save
from ._show.bond_graph import BondGraph as BondGraph
from ._show.bond_graph import bond_graph as bond_graph
from ._show.check import Check as Check
from ._show.check import check as check
from ._show.diagram import Diagram as Diagram
from ._show.diagram import diagram as diagram
from ._show.structure import Structure as Structure
from ._show.structure import structure as structure
from ._units.display import display_unit as display_unit
from ._units.display import displayed as displayed
from ._units.quantity import magnitude as magnitude
from ._units.quantity import quantity as quantity

enable_double_precision()
choose_compiler_options()
choose_optimisation()
keep_compiled_programs()
silence_slow_compilation()
announce_compilation()
