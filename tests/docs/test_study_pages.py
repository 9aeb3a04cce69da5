"""Pages of studies: outputs and pictures are those of their commands."""

from pathlib import Path

import pytest

from docs.__main__ import main
from docs._execute import PageError
from docs._studies import commands, studied

PAGE = """# Study

```console
python -c 'print("wrote a.png"); print("a  1")'
```

```text
a  2
```

![A picture](../pictures/a.png)
"""


def page_with(folder: Path, text: str) -> Path:
    page = folder / "study.md"
    page.write_text(text)
    return page


def test_output_of_a_command_is_renewed_without_names_of_files(tmp_path: Path) -> None:
    page = page_with(tmp_path, PAGE)
    assert len(commands(page)) == 1
    assert studied(page) == PAGE.replace("a  2", "a  1")


def test_output_is_added_where_there_is_none(tmp_path: Path) -> None:
    page = page_with(tmp_path, PAGE.replace("\n```text\na  2\n```\n", ""))
    assert studied(page) == PAGE.replace("a  2", "a  1")


def test_pictures_that_the_page_shows_are_kept(tmp_path: Path) -> None:
    write = 'from pathlib import Path; Path("a.png").write_bytes(b"1"); Path("b.png").write_bytes(b"2")'
    page = page_with(tmp_path, f"```console\npython -c '{write}'\n```\n\n![A picture](../pictures/a.png)\n")
    kept = tmp_path / "kept"
    kept.mkdir()
    studied(page, kept)
    assert {path.name: path.read_bytes() for path in kept.iterdir()} == {"a.png": b"1"}


@pytest.mark.parametrize(("command", "said"), [
    ("python -c 'raise SystemExit(3)'", "ends with 3"), ("ls", "a command begins with python"),
])  # fmt: skip
def test_commands_that_fail_are_told(tmp_path: Path, command: str, said: str) -> None:
    page = page_with(tmp_path, f"```console\n{command}\n```\n")
    with pytest.raises(PageError, match=said):
        studied(page)


def test_a_name_without_a_page_is_refused(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr("sys.argv", ["docs", "hold.md"])
    with pytest.raises(SystemExit):
        main()
    assert "no page or notebook is named hold.md" in capsys.readouterr().err
