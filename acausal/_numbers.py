"""Types of numbers; `jax.Array` is the one of what jax computes or traces."""

from typing import TypeAlias

import numpy as np
from jax import Array

Scalar: TypeAlias = Array | float  # one number
Numbers: TypeAlias = Array | np.ndarray | float  # one or many, also where jax has not seen them yet
Truth: TypeAlias = Array | np.ndarray | np.bool_ | bool  # one truth value or many
