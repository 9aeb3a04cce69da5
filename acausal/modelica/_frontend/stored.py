"""Flat models kept in the cache of the library, because flattening takes seconds for a large model."""

import functools as ft
import hashlib
import pickle
import zlib
from collections.abc import Sequence
from pathlib import Path

from ... import _program_files as files
from ..._jax_settings import programs
from .._files_read import noted, stamp
from .._syntax.flat import FlatModelica
from .flatten import flat_model
from .library import given, library_files


def stored_model(source: str | Path, model: str, roots: Sequence[str | Path] = ()) -> FlatModelica:
    """The result of `flat_model`, from the cache if the texts, libraries, data and this library are unchanged."""
    if programs.folder is None:
        return flat_model(source, model, roots)
    file = programs.folder / f"modelica-{_key(source, model, roots)}-program"
    content = files.read(file)
    if content is not None:
        data, found = pickle.loads(zlib.decompress(content))
        if all(stamp(path) == before for path, before in data.items()):
            return found
    with noted() as data:
        found = flat_model(source, model, roots)
    files.write(file, zlib.compress(pickle.dumps((data, found), pickle.HIGHEST_PROTOCOL), 1))
    return found


def _key(source: str | Path, model: str, roots: Sequence[str | Path]) -> str:
    """A digest of everything that determines the flat model: the text, and names, sizes and times of files."""
    digest = hashlib.sha256(_own())
    texts, folders = given(source, roots)
    parts = [model, *(part for text in texts for part in (text.file, text.text))]
    parts += map(stamp, library_files(folders))
    for part in parts:
        digest.update(b"%d " % len(part.encode()) + part.encode())
    return digest.hexdigest()[:32]


@ft.cache
def _own() -> bytes:
    """A digest of the modules that make flat models."""
    modules = sorted(Path(__file__).parents[1].rglob("*.py"))
    return hashlib.sha256(b"".join(module.read_bytes() for module in modules)).digest()
