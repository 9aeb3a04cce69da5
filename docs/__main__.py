"""Regenerate the outputs and pictures of the pages and of the notebook: `python -m docs [NAME ...]`."""

import argparse

from ._execute import DOCS, PAGES, PICTURES, refreshed
from ._notebook import executed, write


def main() -> None:
    """Regenerate the files named on the command line, or all."""
    notebooks = sorted(DOCS.glob("*.ipynb"))
    parser = argparse.ArgumentParser(prog="python -m docs", description=__doc__)
    parser.add_argument("names", nargs="*", help=", ".join(path.name for path in [*PAGES, *notebooks]))
    names = parser.parse_args().names
    for page in PAGES:
        if not names or page.name in names:
            page.write_text(refreshed(page, PICTURES))
            print(f"wrote {page}")
    for notebook in notebooks:
        if not names or notebook.name in names:
            write(notebook, executed(notebook))
            print(f"wrote {notebook}")


if __name__ == "__main__":
    main()
