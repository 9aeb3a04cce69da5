"""The functions that the pages on the engine lead their reader to are where they say."""

import re
from pathlib import Path

import pytest

import acausal

ENGINE = Path(acausal.__file__).parent
STOPS = {  # of a ratio, rtol and until; of a ratio in C, and from Modelica
    "engine.md": [8, 5, 7],
    "engine_c.md": [7],
    "engine_modelica.md": [8],
}
PAGES = {name: (Path(__file__).parents[2] / "docs" / name).read_text() for name in STOPS}
FILE = r"((?:_\w+|codegen|fmi|modelica)/[\w/]+\.py)"


@pytest.mark.parametrize("name", PAGES)
def test_each_stop_of_a_number_is_a_function_of_the_file_named(name: str) -> None:
    stops = re.findall(r"^\| (\d) \| `[\w.]+`, `[\w/.]+` \|", PAGES[name], re.MULTILINE)
    assert [1 + len(way) for way in "".join(stops).split("1")[1:]] == STOPS[name]
    for function, file in re.findall(rf"`([\w.]+)`,\s+`{FILE}`", PAGES[name]):
        owner, _, name = function.rpartition(".")
        code = (ENGINE / file).read_text()
        assert re.search(rf"^(\s*def|class) {name}\b", code, re.MULTILINE), (function, file)
        assert not owner or re.search(rf"^class {owner}\b", code, re.MULTILINE), (function, file)


@pytest.mark.parametrize("name", PAGES)
def test_each_file_named_exists(name: str) -> None:
    files = set(re.findall(rf"`{FILE}`", PAGES[name]))
    assert files
    assert [file for file in files if not (ENGINE / file).exists()] == []
