"""Files with compiled programs: read only where nobody else can have written them, and where they are whole."""

import contextlib
import hashlib
import os
import tempfile
from pathlib import Path

DIGEST = hashlib.sha256().digest_size


def is_own(status: os.stat_result) -> bool:
    """Whether a file or folder belongs to the user, and nobody else may write to it; where users are told apart."""
    return os.name != "posix" or (status.st_uid == os.geteuid() and not status.st_mode & 0o022)


def write(file: Path, content: bytes) -> None:
    """Write a file: elsewhere first, so that no other process or thread reads half of it. Raises `OSError`."""
    handle, part = tempfile.mkstemp(dir=file.parent, prefix="run-", suffix="-part-program")
    try:
        with os.fdopen(handle, "wb") as stream:
            stream.write(_checked(file, content))
        Path(part).replace(file)
    except BaseException:
        with contextlib.suppress(OSError):
            Path(part).unlink()
        raise


def read(file: Path) -> bytes | None:
    """What was written to a file; None where it is not there, is not the user's own, or is spoilt."""
    try:
        with file.open("rb") as stream:
            whole = stream.read() if is_own(os.fstat(stream.fileno())) else b""
    except OSError:
        return None
    content = whole[DIGEST:]
    return content if whole == _checked(file, content) else None


def _checked(file: Path, content: bytes) -> bytes:
    return hashlib.sha256(file.name.encode() + content).digest() + content
