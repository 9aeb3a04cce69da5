"""Design with models: parameters that are free within bounds, identified from measurements."""

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
from ._profile import Profile as Profile
from ._residuals import ResidualTest as ResidualTest
