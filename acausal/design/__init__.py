"""Design with models: the free parameters that are best, with proof of it, or those that measurements ask for."""

from ._certificate import Curvature as Curvature
from ._design import Active as Active
from ._design import Design as Design
from ._design import Result as Result
from ._design import Sensitivity as Sensitivity
from ._distributions import Normal as Normal
from ._distributions import Samples as Samples
from ._distributions import Triangular as Triangular
from ._distributions import Uniform as Uniform
from ._experiment import Experiment as Experiment
from ._fit import Channel as Channel
from ._fit import Combination as Combination
from ._fit import Fit as Fit
from ._free import Free as Free
from ._free import free_parameters as free_parameters
from ._identify import identify as identify
from ._optimise import optimise as optimise
from ._profile import Profile as Profile
from ._residuals import ResidualTest as ResidualTest
