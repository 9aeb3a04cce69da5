"""Types of numbers. `jax.Array` is the type of values that jax computes or traces."""

from typing import TypeAlias

import numpy as np
from jax import Array

Scalar: TypeAlias = Array | float  # one number
Numbers: TypeAlias = Array | np.ndarray | float  # one or many, of jax or NumPy
Truth: TypeAlias = Array | np.ndarray | np.bool_ | bool  # one truth value or many
