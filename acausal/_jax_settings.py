"""Settings of jax that are made when `acausal` is imported: double precision, options of the compiler, compiled
programs kept for later processes, and no complaints about slow compilation.
"""

import atexit
import contextlib
import itertools
import os
import sys
import warnings
from pathlib import Path
from typing import Any

import jax

from ._jax_private import backends_are_initialized, trace_context
from ._program_files import is_own

OFF = ("0", "false", "off", "no")
ON = ("1", "true", "on", "yes")


def enable_double_precision() -> None:
    """Switch jax to 64-bit floats unless the environment variable `JAX_ENABLE_X64` says no.

    Pressures of 1e6 Pa beside volumes of 1e-9 m3 and tolerances of 1e-9 do not fit in 32 bits.
    """
    if os.environ.get("JAX_ENABLE_X64", "1").lower() in OFF:
        warnings.warn(
            "JAX_ENABLE_X64=0: acausal runs in single precision, where tolerances below about 1e-4 cannot be met. "
            "Unset the variable to get 64-bit floats.",
            stacklevel=3,
        )
        return
    jax.config.update("jax_enable_x64", True)


# In bytes, of the buffers of a loop. A single simulation is below, a wide batch, which runs better in pieces, above.
SMALL_LOOP = 1_000_000
# XLA leaves options of this kind that it does not know alone.
_OPTIONS = f"xla_cpu_small_while_loop_byte_threshold={SMALL_LOOP},xla_cpu_disable_new_fusion_emitters=true"


def choose_compiler_options() -> None:
    """Let XLA on the CPU compile a loop over small arrays as one function, instead of calling each of its operations,
    and operations outside of loops by its older emitters.

    The first halves the time of a simulation, the second takes a quarter off the time of compilation and nothing off
    the speed. XLA reads its flags once, when jax first compiles; later than that they are left as they are. A choice
    already made in the environment variable `XLA_FLAGS` wins.
    """
    flags = os.environ.get("XLA_FLAGS", "")
    if "xla_backend_extra_options" not in flags and not backends_are_initialized():
        os.environ["XLA_FLAGS"] = f"{flags} --xla_backend_extra_options={_OPTIONS}".strip()


def choose_optimisation() -> None:
    """Let XLA leave out most of its optimisations, in all programs of the process, if the environment variable
    `ACAUSAL_OPTIMISE` says no: they are compiled sooner, and run for longer.

    jax has no such setting for some programs only: not for those that are traced into one of the user's.
    """
    if os.environ.get("ACAUSAL_OPTIMISE", "").lower() in OFF:
        jax.config.update("jax_disable_most_optimizations", True)


def silence_slow_compilation() -> None:
    """Keep XLA from writing that a compilation is slow, and how to file a bug about it; nothing is wrong.

    It is the logging of XLA's own that is restricted to fatal errors; others reach the user as exceptions. A level
    chosen in the environment variable `TF_CPP_MIN_LOG_LEVEL` or by `jax_logging_level` wins.
    """
    level = jax.config.jax_logging_level  # pyright: ignore[reportAttributeAccessIssue]
    if level == "NOTSET" and os.environ.get("TF_CPP_MIN_LOG_LEVEL", "1") == "1":  # which is what jax sets
        jax.config.update("jax_logging_level", "CRITICAL")
        jax.config.update("jax_logging_level", level)  # back for python's loggers; XLA's follows no "NOTSET"


class Programs:
    """Where the library keeps programs: `folder`, None where jax was told another one, or none are kept.

    `flags` and `context` are the flags of XLA and the settings of jax that they are made with, those of the import.
    """

    folder: Path | None = None
    flags: str | None = None
    context: Any = None


programs = Programs()
LARGEST = 1_000_000_000  # bytes of compiled programs that are kept


def keep_compiled_programs() -> None:
    """Let jax keep compiled programs in a folder of the user's, so that a later process need not compile them again.

    A folder chosen for jax before (`jax_compilation_cache_dir`, `JAX_COMPILATION_CACHE_DIR`) wins and is left as it is.
    The environment variable `ACAUSAL_CACHE` names another folder, or none by "off". Programs are run as they are read:
    a folder to which others can write is warned of and not used.
    """
    programs.flags, programs.context = os.environ.get("XLA_FLAGS"), trace_context()
    chosen = os.environ.get("ACAUSAL_CACHE", "")
    if chosen.lower() in OFF or jax.config.jax_compilation_cache_dir is not None:  # pyright: ignore[reportAttributeAccessIssue]
        return
    folder = (Path(chosen).expanduser() if chosen else _user_cache() / "acausal").absolute()
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        if not is_own(folder.stat()) and not chosen:
            folder.chmod(0o700)
        is_safe = is_own(folder.stat())
    except OSError:  # no folder to write to, as on a locked-down machine: everything is compiled anew
        return
    if not is_safe:
        warnings.warn(
            f"Compiled programs are not kept in {folder}, since others can write to it, and what is in it is run. "
            f"Remedy: a folder of your own (chmod go-w {folder}), another one named by ACAUSAL_CACHE, or "
            "ACAUSAL_CACHE=off.",
            stacklevel=3,
        )
        return
    programs.folder = folder
    jax.config.update("jax_compilation_cache_dir", str(folder))
    jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)
    atexit.register(forget_oldest, folder, LARGEST)


def _user_cache() -> Path:
    """Where the operating system wants what programs may lose."""
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA", Path.home() / "AppData" / "Local"))
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches"
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")


def forget_oldest(folder: Path, largest: int) -> None:
    """Remove the programs not read for longest, until the rest are no larger than this together.

    What neither jax nor the library has written stays, since the folder may be one that the user keeps other files in.
    Other processes may do the same at the same time: what is gone is gone.
    """
    files = []
    for entry in itertools.chain(folder.glob("*-cache"), folder.glob("*-program")):  # as jax names its own, and as ours
        try:
            status = entry.stat()
        except OSError:
            continue
        files.append((max(status.st_atime, status.st_mtime), status.st_size, entry))
    total = 0
    for _, size, path in sorted(files, reverse=True):
        total += size
        if total > largest:
            with contextlib.suppress(OSError):
                path.unlink()
