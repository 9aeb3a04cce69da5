"""Design with models: certified optima, identification, optimal control, sweeps, choices from catalogues, tolerances.

Each room imports only from those before it: `_problem`, `_certificate`, `_compute`, `_sensitivity`, `_optimise`,
`_identify`, `_control`, `_sweep`, `_choose`, `_tolerance`.
"""

from .._units.display import Scale as Scale
from ._certificate.curvature import Curvature as Curvature
from ._choose.alternatives import Alternatives as Alternatives
from ._choose.alternatives import CatalogueVariables as CatalogueVariables
from ._choose.alternatives import DesignSpace as DesignSpace
from ._choose.choice import Choice as Choice
from ._choose.choose import choose as choose
from ._control.control import control as control
from ._control.course import Course as Course
from ._identify.estimate import Channel as Channel
from ._identify.estimate import Combination as Combination
from ._identify.estimate import End as End
from ._identify.experiment import Experiment as Experiment
from ._identify.experiment import Run as Run
from ._identify.fit import Fit as Fit
from ._identify.identify import identify as identify
from ._identify.profile import Profile as Profile
from ._identify.residual_tests import ResidualTest as ResidualTest
from ._optimise.design import Design as Design
from ._optimise.entries import Active as Active
from ._optimise.entries import LimitedResult as LimitedResult
from ._optimise.entries import Sensitivity as Sensitivity
from ._optimise.entries import Tried as Tried
from ._optimise.optimise import optimise as optimise
from ._optimise.pareto import Front as Front
from ._optimise.pareto import pareto as pareto
from ._problem.distributions import Normal as Normal
from ._problem.distributions import Samples as Samples
from ._problem.distributions import Triangular as Triangular
from ._problem.distributions import Uniform as Uniform
from ._problem.free import Free as Free
from ._problem.free import Place as Place
from ._problem.free import Variable as Variable
from ._problem.free_parameters import free_parameters as free_parameters
from ._problem.limits import Limit as Limit
from ._problem.limits import Objective as Objective
from ._sensitivity.hessian import Hessian as Hessian
from ._sensitivity.hessian import hessian as hessian
from ._sensitivity.sensitivities import SensitivityRow as SensitivityRow
from ._sensitivity.sensitivities import SensitivityTable as SensitivityTable
from ._sensitivity.sensitivities import sensitivities as sensitivities
from ._sweep.batches import Outcomes as Outcomes
from ._sweep.sweep import Sample as Sample
from ._sweep.sweep import sweep as sweep
from ._tolerance.percentile import percentile_of as percentile_of
from ._tolerance.sobol_indices import Indices as Indices
from ._tolerance.spread import Cause as Cause
from ._tolerance.spread import Spread as Spread
from ._tolerance.spread import Spreads as Spreads
from ._tolerance.spread import Yield as Yield
from ._tolerance.tolerance import Members as Members
from ._tolerance.tolerance import Tolerance as Tolerance
from ._tolerance.worst import Worst as Worst
