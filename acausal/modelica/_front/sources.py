"""The files and lines of spans."""

import bisect
from dataclasses import dataclass, field


def number(name: str) -> int:
    """The number that rumoca gives a text: the FNV-1a hash of its file name."""
    value = 0xCBF29CE484222325
    for byte in name.replace("\\", "/").encode():
        value = ((value ^ byte) * 0x100000001B3) & (2**64 - 1)
    return value or 1


@dataclass(frozen=True)
class Sources:
    """The texts of a flat model, with the names of their files, by the numbers in its spans."""

    texts: dict[int, tuple[str, str]]
    _lines: dict[int, list[int]] = field(default_factory=dict, init=False, repr=False, compare=False)

    def place(self, source: int, offset: int) -> tuple[str, int] | None:
        """File and line of an offset in bytes; None if the text is unknown. Lines of a patched file may differ."""
        if source not in self.texts:
            return None
        if source not in self._lines:
            text = self.texts[source][1].encode()
            self._lines[source] = [i for i, byte in enumerate(text) if byte == 10]
        return self.texts[source][0], bisect.bisect_left(self._lines[source], offset) + 1

    def where(self, source: int, offset: int) -> str:
        """File and line as the beginning of a message; empty if the text is unknown."""
        place = self.place(source, offset)
        return f"{place[0]}, line {place[1]}: " if place else ""


def used(content: object) -> set[int]:
    """The numbers of all texts that spans of a flat model name."""
    found: set[int] = set()
    todo = [content]
    while todo:
        node = todo.pop()
        if isinstance(node, dict):
            if "source" in node and "start" in node:
                found.add(node["source"])
            todo.extend(node.values())
        elif isinstance(node, list):
            todo.extend(node)
    return found
