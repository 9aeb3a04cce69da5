"""The functions that the page on the engine leads its reader to are where it says."""

import re
from pathlib import Path

import acausal

ENGINE = Path(acausal.__file__).parent
PAGE = (Path(__file__).parents[2] / "docs" / "engine.md").read_text()


def test_each_stop_of_a_number_is_a_function_of_the_file_named() -> None:
    stops = re.findall(r"^\| (\d) \| `[\w.]+`, `[\w/.]+` \|", PAGE, re.MULTILINE)
    assert [1 + len(way) for way in "".join(stops).split("1")[1:]] == [8, 5, 7]  # a ratio, rtol, until
    for function, file in re.findall(r"`([\w.]+)`,\s+`(_[\w/]+\.py)`", PAGE):
        owner, _, name = function.rpartition(".")
        code = (ENGINE / file).read_text()
        assert re.search(rf"^\s*def {name}\(", code, re.MULTILINE), (function, file)
        assert not owner or re.search(rf"^class {owner}\b", code, re.MULTILINE), (function, file)


def test_each_file_named_exists() -> None:
    files = set(re.findall(r"`(_\w+(?:/\w+)+\.py)`", PAGE))
    assert files
    assert [file for file in files if not (ENGINE / file).exists()] == []
