"""Design with models: the free parameters that are best, with proof of it, or those that measurements ask for."""

from .._units.display import Scale
from ._alternatives import Alternatives, Part
from ._alternatives import Structure as Structure
from ._batches import Outcomes
from ._causes import Cause
from ._choice import Choice
from ._choose import choose
from ._control import control
from ._course import Course
from ._curvature import Curvature
from ._design import Active, Design, Sensitivity, Tried
from ._design import Result as Result
from ._distributions import Normal, Samples, Triangular, Uniform
from ._experiment import Experiment, Run
from ._fit import Channel, Combination, End, Fit
from ._free import Free, Place, Variable
from ._free_parameters import free_parameters
from ._hessian import Hessian
from ._hessian import hessian as hessian
from ._identify import identify
from ._indices import Indices
from ._limits import Limit, Objective
from ._optimise import optimise
from ._pareto import Front, pareto
from ._percentile import percentile_of
from ._profile import Profile
from ._residuals import ResidualTest
from ._sensitivities import SensitivityRow, SensitivityTable, sensitivities
from ._spread import Spread, Spreads, Yield
from ._sweep import Sample, sweep
from ._tolerance import Members, Tolerance
from ._worst import Worst

# Left out are names that a star import would take from jax or from `acausal`.
__all__ = [
    "Active",
    "Alternatives",
    "Cause",
    "Channel",
    "Choice",
    "Combination",
    "Course",
    "Curvature",
    "Design",
    "End",
    "Experiment",
    "Fit",
    "Free",
    "Front",
    "Hessian",
    "Indices",
    "Limit",
    "Members",
    "Normal",
    "Objective",
    "Outcomes",
    "Part",
    "Place",
    "Profile",
    "ResidualTest",
    "Run",
    "Sample",
    "Samples",
    "Scale",
    "Sensitivity",
    "SensitivityRow",
    "SensitivityTable",
    "Spread",
    "Spreads",
    "Tolerance",
    "Triangular",
    "Tried",
    "Uniform",
    "Variable",
    "Worst",
    "Yield",
    "choose",
    "control",
    "free_parameters",
    "identify",
    "optimise",
    "pareto",
    "percentile_of",
    "sensitivities",
    "sweep",
]
