"""Settings of jax that are made when `acausal` is imported: double precision, and loops compiled as a whole."""

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


# In bytes, of the buffers of a loop. A single simulation is below, a wide batch, which runs better in pieces, above.
SMALL_LOOP = 1_000_000


def compile_loops_whole() -> None:
    """Let XLA compile a loop over small arrays as one function on the CPU, instead of calling each of its operations.

    It halves the time of a simulation. XLA reads its flags once, when jax first compiles; importing `acausal` later
    than that has no effect. A choice already made in the environment variable `XLA_FLAGS` wins.
    """
    flags = os.environ.get("XLA_FLAGS", "")
    if "xla_backend_extra_options" not in flags:
        option = f"--xla_backend_extra_options=xla_cpu_small_while_loop_byte_threshold={SMALL_LOOP}"
        os.environ["XLA_FLAGS"] = f"{flags} {option}".strip()
