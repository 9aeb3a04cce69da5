"""Files with compiled programs, read only if they are complete and no other user can have written them."""

import contextlib
import hashlib
import os
import tempfile
from pathlib import Path

DIGEST = hashlib.sha256().digest_size


def is_own(status: os.stat_result) -> bool:
    """Whether a file or folder belongs to the user and others cannot write to it; True on systems without users."""
    return os.name != "posix" or (status.st_uid == os.geteuid() and not status.st_mode & 0o022)


def write(file: Path, content: bytes) -> None:
    """Write a file atomically, so that no other process or thread reads a part of it. Raises `OSError`."""
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
    """The content of a file; None if it is missing, corrupt, or not the user's own."""
    try:
        with file.open("rb") as stream:
            whole = stream.read() if is_own(os.fstat(stream.fileno())) else b""
    except OSError:
        return None
    content = whole[DIGEST:]
    return content if whole == _checked(file, content) else None


def _checked(file: Path, content: bytes) -> bytes:
    return hashlib.sha256(file.name.encode() + content).digest() + content
