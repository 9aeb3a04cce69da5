"""Shared libraries of an FMU, and its file."""

import os
import shutil
import subprocess
import sys
import sysconfig
import tempfile
import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path

from ..._errors import ModelError
from ..._extras import needed

# Platform: its name in FMI 2.0, the ending of shared libraries, and the target of zig.
PLATFORMS = {
    "x86_64-linux": ("linux64", "so", "x86_64-linux-gnu"),
    "aarch64-linux": ("aarch64-linux", "so", "aarch64-linux-gnu"),
    "x86_64-windows": ("win64", "dll", "x86_64-windows-gnu"),
    "x86_64-darwin": ("darwin64", "dylib", "x86_64-macos"),
    "aarch64-darwin": ("aarch64-darwin", "dylib", "aarch64-macos"),
}
FLAGS = ["-std=c99", "-O2", "-shared", "-fvisibility=hidden"]


def this_platform() -> str:
    """The platform of this machine."""
    system = {"linux": "linux", "win32": "windows", "darwin": "darwin"}.get(sys.platform, sys.platform)
    machine = {"arm64": "aarch64", "amd64": "x86_64"}.get(_machine(), _machine())
    return f"{machine}-{system}"


def _machine() -> str:
    return sysconfig.get_platform().rpartition("-")[2].lower()


def libraries(
    sources: Mapping[str, str], identifier: str, platforms: Sequence[str] | None, version: int
) -> dict[str, bytes]:
    """The shared libraries by their place in the FMU. Without `platforms`, the one of this machine by its own compiler;
    with, all by zig.

    Raises `ModelError` if there is no compiler, or for an unknown platform.
    """
    if unknown := sorted(set(platforms or ()) - PLATFORMS.keys()):
        raise ModelError(f"The platform {unknown[0]!r} is unknown: there are {', '.join(PLATFORMS)}.")
    found = {}
    for platform in [this_platform()] if platforms is None else platforms:
        folder, ending, target = PLATFORMS.get(platform, (platform, "so", ""))
        command = _own_compiler() if platforms is None else [*_zig(), "-target", target]
        place = f"binaries/{folder if version == 2 else platform}/{identifier}.{ending}"
        found[place] = _compiled(sources, command, is_windows="windows" in platform)
    return found


def _own_compiler() -> list[str]:
    for name in (os.environ.get("CC"), "cc", "gcc", "clang"):
        if name and shutil.which(name):
            return [name]
    raise ModelError(
        "No C compiler was found (CC, cc, gcc or clang). Remedy: install one, or name the platforms, as in "
        'platforms=["x86_64-linux"], which zig compiles for; platforms=[] writes the sources only.'
    )


def _zig() -> list[str]:
    needed("ziglang", "fmi", "A library for a given platform")
    return [sys.executable, "-m", "ziglang", "cc"]


def _compiled(sources: Mapping[str, str], command: list[str], *, is_windows: bool) -> bytes:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for file, text in sources.items():
            (folder / file).write_text(text)
        own = [] if is_windows else ["-fPIC", "-lm"]
        run = subprocess.run(
            [*command, *FLAGS, "fmu.c", "-o", "library", *own], cwd=folder, capture_output=True, text=True
        )
        if run.returncode:
            raise ModelError(f"The C compiler failed: {' '.join(command)}\n{run.stderr[-2000:]}")
        return (folder / "library").read_bytes()


def write(file: Path, contents: Mapping[str, str | bytes]) -> None:
    """Write the FMU, a zip file."""
    file.parent.mkdir(parents=True, exist_ok=True)
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in contents.items():
            archive.writestr(name, content)
