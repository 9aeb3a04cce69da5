"""Regenerate the outputs and pictures of the pages and of the notebooks: `python -m docs [NAME ...]`.

The commands of studies take minutes; they run only for pages named on the command line.
"""

import argparse

from ._execute import DOCS, PAGES, PICTURES, named, refreshed
from ._notebook import executed, write
from ._studies import studied


def main() -> None:
    """Regenerate the files named on the command line, or all."""
    notebooks = sorted(DOCS.glob("*.ipynb"))
    parser = argparse.ArgumentParser(prog="python -m docs", description=__doc__)
    parser.add_argument("names", nargs="*", help=", ".join(map(named, [*PAGES, *notebooks])))
    names = parser.parse_args().names
    if unknown := set(names) - {named(path) for path in [*PAGES, *notebooks]}:
        parser.error(f"no page or notebook is named {', '.join(sorted(unknown))}")
    for page in PAGES:
        if not names or named(page) in names:
            page.write_text(refreshed(page, PICTURES))
            if names:
                page.write_text(studied(page, PICTURES))
            print(f"wrote {page}")
    for notebook in notebooks:
        if not names or named(notebook) in names:
            write(notebook, executed(notebook))
            print(f"wrote {notebook}")


if __name__ == "__main__":
    main()
