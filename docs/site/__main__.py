"""Collect the pages of the site in build/pages, build it in site/ and check its links: `python -m docs.site`."""

import subprocess
import sys

from .._execute import ROOT
from ._collect import collected
from ._links import dead_links


def main() -> None:
    """Build the site. Exits with a list of dead links if there are any."""
    pages = collected()
    pages.write(ROOT / "build" / "pages")
    subprocess.run([sys.executable, "-m", "zensical", "build", "--strict"], cwd=ROOT, check=True)
    if dead := list(dead_links(ROOT / "site")):
        sys.exit("\n".join(dead))
    print(f"wrote {ROOT / 'site' / 'index.html'} and {len(pages.texts) - 1} other pages")


if __name__ == "__main__":
    main()
