"""Acausal, differentiable component models in JAX.

Components state their equations, `connect` joins their ports, and `simulate` runs the model.
See also `acausal.design` (optimisation, identification, tolerances) and `acausal.testing` (checks of components).
The names marked with * are not part of `from acausal import *`: import them by name.

Declare components:
    Component        A part of a model: parameters, variables and ports, with its equations.
    Port, Record     Shared variables of a connection; a set of parameters with methods.
    Param            Annotation of a parameter: `R: Param[Scalar, "ohm", positive]`.
    Var, Flow        Annotations of a variable, and of a through variable of a port.
    Time, Discrete   Annotations of the time, and of a variable that only events change.
    Scalar, Vector   Types of values: a number, an array.
    shape*, Nominal  Options of an annotation: the shape of an array, the nominal size of a variable.
    positive, nonnegative, nonzero, unbounded
                     Options of an annotation: the admissible range.
    prefer, avoid, never
                     Options of an annotation: the preference of a variable as a state.
    Array*, repeat*, stack*
                     Arrays of components of one class.

State what they do:
    Equations, Connections, Energy, Events, Requirements
                     Results of the methods `equations`, `connections`, `energy`, `events`, `requirements`.
    eq, connect      An equation; a connection of ports.
    when, at*        An event at a condition; an event at known times.
    impact*, yields*
                     The impulse of an impact; the values of modes during an impulse.
    remember*, recall*, ROW*
                     The history of a signal; its value at a time in the past; the width of a history.
    refuse, require  A condition that ends a run; a condition on parameters.
    ifelse, segment  A choice between two values; the segment of a table that contains a value.

Work with models:
    check*           Every error of a model.
    parameters*, replace*, Parameters
                     The parameters by path; a copy of a model with other values.
    sized            A model with nominal sizes of its variables.
    initialise       A model with start values that satisfy conditions.
    choose_states, System
                     The reduced and sorted equations.
    structure*, diagram*, bond_graph, Structure, Diagram, BondGraph, Check
                     Reports and pictures of a model.
    Symbol*          The symbol of a component class in diagrams.

Simulate and linearise:
    simulate         Integrate a model over time, or until a condition is met.
    Solution, Result, EventLog, EnergyAccount, Peak
                     A run, its outcome, its events, its energy account, its largest values.
    Rodas5P, Rodas3P Solvers.
    compare*         Plot several runs over each other.
    linearise, LinearSystem, TransferFunction, Modes, Shares, Margins
                     Small deviations from an operating point.

Units, files and reports:
    quantity, magnitude
                     A value in another unit; the number of a quantity in a unit.
    display_unit, displayed
                     The unit in which values are shown.
    save*, load*, about*
                     Write a result to a file, read it, describe it.
    report*, Table*, Picture*
                     An HTML file of texts, tables, pictures and results.

Errors and warnings:
    AcausalError     Base class of all errors.
    ArgumentError, ModelError, ParameterError, SimulationError, StructureError, UnitError, UnknownNameError,
    UnknownPartError
                     Errors.
    JumpWarning, SampledWarning, UnresolvedWarning, VersionWarning
                     Warnings.
"""

from . import _jax_settings, _progress
from ._analyse.eigenmodes import Modes, Shares
from ._analyse.linear_system import LinearSystem
from ._analyse.linearise import SampledWarning, linearise
from ._analyse.realisation import Margins, TransferFunction
from ._declare.annotations import (
    Discrete,
    Flow,
    Nominal,
    Param,
    Scalar,
    Time,
    Var,
    Vector,
    avoid,
    never,
    nonnegative,
    nonzero,
    positive,
    prefer,
    unbounded,
)
from ._declare.annotations import shape as shape
from ._declare.array import Array as Array
from ._declare.array import repeat as repeat
from ._declare.array import stack as stack
from ._declare.by_name import Parameters
from ._declare.by_name import parameters as parameters
from ._declare.by_name import replace as replace
from ._declare.component import Component, Connections, Energy, Equations, Events, connect, eq, refuse, when
from ._declare.component import at as at
from ._declare.component import impact as impact
from ._declare.component import yields as yields
from ._declare.history import ROW as ROW
from ._declare.history import recall as recall
from ._declare.history import remember as remember
from ._declare.ifelse import ifelse, segment
from ._declare.node import Port, Record
from ._declare.node_requirements import Requirements, require
from ._declare.sizes import sized
from ._errors import (
    AcausalError,
    ArgumentError,
    ModelError,
    ParameterError,
    SimulationError,
    StructureError,
    UnitError,
    UnknownNameError,
    UnknownPartError,
)
from ._evaluate.building import choose_states
from ._evaluate.system import System
from ._integrate.events.extrema import Peak
from ._integrate.results.energy import EnergyAccount
from ._integrate.results.event_log import EventLog
from ._integrate.results.solution import Solution
from ._integrate.results.solution_plot import compare as compare
from ._integrate.results.unresolved import UnresolvedWarning
from ._integrate.setup.result import Result
from ._integrate.simulate import simulate
from ._integrate.solvers import Rodas3P, Rodas5P
from ._integrate.start.initialise import initialise
from ._reduce.jumps import JumpWarning
from ._report import Picture as Picture
from ._report import Table as Table
from ._report import report as report
from ._save_load import VersionWarning
from ._save_load import about as about
from ._save_load import load as load
from ._save_load import save as save
from ._show.bond_graph import BondGraph, bond_graph
from ._show.check import Check
from ._show.check import check as check
from ._show.diagram import Diagram
from ._show.diagram import diagram as diagram
from ._show.schematic.symbols import Symbol as Symbol
from ._show.structure import Structure
from ._show.structure import structure as structure
from ._units.display import display_unit, displayed
from ._units.quantity import magnitude, quantity

# Everyday names are left out: a star import must not shadow names of a script, of numpy or of jax.
__all__ = [
    "AcausalError",
    "ArgumentError",
    "BondGraph",
    "Check",
    "Component",
    "Connections",
    "Diagram",
    "Discrete",
    "Energy",
    "EnergyAccount",
    "Equations",
    "EventLog",
    "Events",
    "Flow",
    "JumpWarning",
    "LinearSystem",
    "Margins",
    "ModelError",
    "Modes",
    "Nominal",
    "Param",
    "ParameterError",
    "Parameters",
    "Peak",
    "Port",
    "Record",
    "Requirements",
    "Result",
    "Rodas3P",
    "Rodas5P",
    "SampledWarning",
    "Scalar",
    "Shares",
    "SimulationError",
    "Solution",
    "Structure",
    "StructureError",
    "System",
    "Time",
    "TransferFunction",
    "UnitError",
    "UnknownNameError",
    "UnknownPartError",
    "UnresolvedWarning",
    "Var",
    "Vector",
    "VersionWarning",
    "avoid",
    "bond_graph",
    "choose_states",
    "connect",
    "display_unit",
    "displayed",
    "eq",
    "ifelse",
    "initialise",
    "linearise",
    "magnitude",
    "never",
    "nonnegative",
    "nonzero",
    "positive",
    "prefer",
    "quantity",
    "refuse",
    "require",
    "segment",
    "simulate",
    "sized",
    "unbounded",
    "when",
]

_jax_settings.enable_double_precision()
_jax_settings.choose_compiler_options()
_jax_settings.choose_optimisation()
_jax_settings.keep_compiled_programs()
_jax_settings.silence_slow_compilation()
_progress.announce_compilation()
