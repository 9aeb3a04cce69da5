"""Design with models: certified optima, identification, optimal control, sweeps, choices, tolerances, training.

Each room imports only from those before it: `_problem`, `_certificate`, `_compute`, `_sensitivity`, `_optimise`,
`_identify`, `_control`, `_sweep`, `_choose`, `_tolerance`, `_train`, `_explore`.
"""

from .._errors import DesignWarning
from .._units.display import Scale
from ._certificate.second_order import Curvature
from ._choose.alternatives import Alternatives, CatalogueVariables, DesignSpace
from ._choose.choose import Choice, choose
from ._control.control import control
from ._control.course import Course
from ._explore.explored import Explored, ExploredResult
from ._explore.explorer import Explorer, explore
from ._explore.served import App, serve
from ._identify.entries import Channel, Combination, End
from ._identify.estimate import ResidualTest
from ._identify.experiment import Experiment, Run
from ._identify.fit import Fit, Profile
from ._identify.identify import identify
from ._optimise.design import Design
from ._optimise.entries import Active, LimitedResult, Tried
from ._optimise.optimise import optimise
from ._optimise.pareto import Front, pareto
from ._problem.distributions import Normal, Samples, Triangular, Uniform
from ._problem.free import Built, Free, Place, Variable
from ._problem.free_parameters import free_parameters
from ._problem.limits import Limit, Objective
from ._sensitivity.hessian import Hessian
from ._sensitivity.hessian import hessian as hessian
from ._sensitivity.sensitivities import SensitivityRow, SensitivityTable, sensitivities
from ._sweep.batches import Outcomes
from ._sweep.sweep import Sample, sweep
from ._tolerance.joint import percentile_of
from ._tolerance.spread import Cause, Indices, Spread, Spreads, Yield
from ._tolerance.tolerance import Members, Tolerance, Worst
from ._train.train import Training, train

# `hessian` is left out: a star import would take the name from jax.
__all__ = [
    "Active",
    "Alternatives",
    "App",
    "Built",
    "CatalogueVariables",
    "Cause",
    "Channel",
    "Choice",
    "Combination",
    "Course",
    "Curvature",
    "Design",
    "DesignSpace",
    "DesignWarning",
    "End",
    "Experiment",
    "Explored",
    "ExploredResult",
    "Explorer",
    "Fit",
    "Free",
    "Front",
    "Hessian",
    "Indices",
    "Limit",
    "LimitedResult",
    "Members",
    "Normal",
    "Objective",
    "Outcomes",
    "Place",
    "Profile",
    "ResidualTest",
    "Run",
    "Sample",
    "Samples",
    "Scale",
    "SensitivityRow",
    "SensitivityTable",
    "Spread",
    "Spreads",
    "Tolerance",
    "Training",
    "Triangular",
    "Tried",
    "Uniform",
    "Variable",
    "Worst",
    "Yield",
    "choose",
    "control",
    "explore",
    "free_parameters",
    "identify",
    "optimise",
    "pareto",
    "percentile_of",
    "sensitivities",
    "serve",
    "sweep",
    "train",
]
