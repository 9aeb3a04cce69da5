"""Settings of jax at the import of `acausal`: double precision, compiler options, the cache of compiled programs, and
no messages about slow compilation.
"""

import atexit
import contextlib
import itertools
import os
import sys
import tempfile
import warnings
from pathlib import Path
from typing import Any

import jax

from ._errors import AcausalError
from ._jax_private import backends_are_initialized, trace_context
from ._program_files import is_own

OFF = ("0", "false", "off", "no")
ON = ("1", "true", "on", "yes")


def enable_double_precision() -> None:
    """Switch jax to 64-bit floats unless the environment variable `JAX_ENABLE_X64` forbids it.

    32 bits are too few for pressures of 1e6 Pa, volumes of 1e-9 m3 and tolerances of 1e-9 in one model.
    """
    if os.environ.get("JAX_ENABLE_X64", "1").lower() in OFF:
        warnings.warn(
            "JAX_ENABLE_X64=0: acausal runs in single precision, which cannot meet tolerances below about 1e-4. "
            "Unset the variable to get 64-bit floats.",
            stacklevel=3,
        )
    else:
        jax.config.update("jax_enable_x64", True)
    programs.double = jax.config.jax_enable_x64  # pyright: ignore[reportAttributeAccessIssue]


def check_precision() -> None:
    """Raise `AcausalError` if jax has another float type than at the import, as within `jax.enable_x64(False)`.

    Equations are traced once for the process, and those traced with one type do not fit numbers of the other.
    """
    now: bool = jax.config.jax_enable_x64  # pyright: ignore[reportAttributeAccessIssue]
    if now == programs.double:
        return
    here, at_import = (64, 32) if now else (32, 64)
    remedy = "unset JAX_ENABLE_X64" if now else "set JAX_ENABLE_X64=0"
    raise AcausalError(
        f"jax has {here}-bit floats here and had {at_import}-bit floats when acausal was imported. Models are traced "
        f"once for the process, with the floats of the import. Remedy: leave jax.enable_x64({now}), or undo "
        f'jax.config.update("jax_enable_x64", {now}). For {here} bits in the whole process, {remedy} before the import.'
    )


# Size of the buffers of a loop in bytes. A single simulation has less, a wide batch, which runs better unfused, more.
SMALL_LOOP = 1_000_000
# XLA ignores unknown options of this kind.
_OPTIONS = f"xla_cpu_small_while_loop_byte_threshold={SMALL_LOOP},xla_cpu_disable_new_fusion_emitters=true"


def choose_compiler_options() -> None:
    """Let XLA on the CPU compile a loop over small arrays as one function, and use its older emitters outside of loops.

    The first halves the run time of a simulation. The second shortens compilation by a quarter at equal speed. XLA
    reads its flags once, when jax first compiles, so later changes would have no effect. A choice in the environment
    variable `XLA_FLAGS` has priority.
    """
    flags = os.environ.get("XLA_FLAGS", "")
    if "xla_backend_extra_options" not in flags and not backends_are_initialized():
        os.environ["XLA_FLAGS"] = f"{flags} --xla_backend_extra_options={_OPTIONS}".strip()


def choose_optimisation() -> None:
    """Follow the environment variable `ACAUSAL_OPTIMISE`. Without it, the programs of runs are interpreted at first,
    compiled in parts, and optimised once they have taken many steps. If it is on, they are optimised at once. If it is
    off, most optimisations of XLA are switched off for the whole process, because jax has no such setting for single
    programs that are traced into one of the user's.
    """
    chosen = os.environ.get("ACAUSAL_OPTIMISE", "").lower()
    if chosen not in ("", *ON, *OFF):
        warnings.warn(f"ACAUSAL_OPTIMISE={chosen} is not known: use on or off, or unset it.", stacklevel=3)
    programs.in_parts = chosen not in ON
    if chosen in OFF:
        jax.config.update("jax_disable_most_optimizations", True)


def silence_slow_compilation() -> None:
    """Silence XLA's reports of slow compilation, which ask the user to file a bug.

    This restricts XLA's own log to fatal errors; other errors still reach the user as exceptions. A level chosen in the
    environment variable `TF_CPP_MIN_LOG_LEVEL` or by `jax_logging_level` has priority.
    """
    level = jax.config.jax_logging_level  # pyright: ignore[reportAttributeAccessIssue]
    if level == "NOTSET" and os.environ.get("TF_CPP_MIN_LOG_LEVEL", "1") == "1":  # the value that jax sets
        jax.config.update("jax_logging_level", "CRITICAL")
        jax.config.update("jax_logging_level", level)  # restores Python's loggers; XLA ignores "NOTSET"


class Programs:
    """The program cache. `folder` is None if the user chose another folder for jax, or none.

    `flags` and `context` are the flags of XLA and the settings of jax at import, with which programs are compiled.
    `in_parts`: programs are interpreted at first, and compiled in parts. `double`: floats have had 64 bits
    since the import.
    """

    folder: Path | None = None
    in_parts: bool = True
    double: bool = True
    flags: str | None = None
    context: Any = None


programs = Programs()
LARGEST = 1_000_000_000  # size of the cache in bytes


def keep_compiled_programs() -> None:
    """Cache compiled programs in a folder of the user, so that later processes do not compile them again.

    A folder already chosen for jax (`jax_compilation_cache_dir`, `JAX_COMPILATION_CACHE_DIR`) has priority. The
    environment variable `ACAUSAL_CACHE` names another folder; "off" disables the cache. Cached programs are executed
    without further checks, so a folder that others can write to is not used, with a warning.
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
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:  # no writable folder, as on a locked-down machine: no cache
        if chosen:
            warnings.warn(
                f"Compiled programs are not cached, because {folder} cannot be written: {error.strerror}. Remedy: name "
                "another folder by ACAUSAL_CACHE, or set ACAUSAL_CACHE=off.",
                stacklevel=3,
            )
        return
    if not is_safe:
        warnings.warn(
            f"Compiled programs are not cached in {folder}: others can write to it, and cached programs are executed. "
            f"Remedy: restrict the folder (chmod go-w {folder}), name another one by ACAUSAL_CACHE, or set "
            "ACAUSAL_CACHE=off.",
            stacklevel=3,
        )
        return
    programs.folder = folder
    jax.config.update("jax_compilation_cache_dir", str(folder))
    jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)
    atexit.register(forget_oldest, folder, LARGEST)


def _user_cache() -> Path:
    """The cache folder of the operating system."""
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA", Path.home() / "AppData" / "Local"))
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches"
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")


def forget_oldest(folder: Path, largest: int) -> None:
    """Delete the least recently read programs until the total size is at most `largest`.

    Other files stay: the folder may hold files of the user. Other processes may delete files at the same time.
    """
    files = []
    for entry in itertools.chain(folder.glob("*-cache"), folder.glob("*-program")):  # programs of jax, and ours
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
