"""Double precision, switched on when `acausal` is imported."""

import os
import warnings

import jax


def enable_double_precision() -> None:
    """Switch jax to 64-bit floats unless the environment variable `JAX_ENABLE_X64` says no.

    Pressures of 1e6 Pa beside volumes of 1e-9 m3 and tolerances of 1e-9 do not fit in 32 bits.
    """
    if os.environ.get("JAX_ENABLE_X64", "1").lower() in ("0", "false", "off", "no"):
        warnings.warn(
            "JAX_ENABLE_X64=0: acausal runs in single precision, where tolerances below about 1e-4 cannot be met. "
            "Unset the variable to get 64-bit floats.",
            stacklevel=3,
        )
        return
    jax.config.update("jax_enable_x64", True)
