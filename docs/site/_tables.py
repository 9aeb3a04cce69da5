"""Tables of Markdown."""

from collections.abc import Sequence


def table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table without its empty columns."""
    used = [any(column) for column in zip(*rows, strict=True)]
    lines = [heads, ["---"] * len(heads), *rows]
    kept = [[cell for cell, is_used in zip(line, used, strict=True) if is_used] for line in lines]
    return "".join(f"| {' | '.join(map(_cell, line))} |\n" for line in kept)


def _cell(text: str) -> str:
    return text.replace("|", "\\|").replace("\n", " ")
