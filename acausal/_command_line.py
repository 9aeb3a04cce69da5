"""Command lines of packages: `python -m acausal.fmi`, `python -m acausal.modelica`."""

import argparse
import sys
from collections.abc import Sequence

from ._errors import AcausalError


def exit_code(parser: argparse.ArgumentParser, arguments: Sequence[str] | None) -> int:
    """Runs the command that the parser finds, as its option `run`, and returns the exit code. An error is printed."""
    options = parser.parse_args(arguments)
    try:
        return options.run(options)
    except AcausalError as error:
        print(error, file=sys.stderr)
        return 1
