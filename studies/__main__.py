"""The command line: `python -m studies --help`."""

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from acausal import AcausalError

from . import (
    architectures,
    beyond,
    catalogue,
    concepts,
    control,
    design,
    explore,
    hold,
    identify,
    optimise,
    prototypes,
    tolerance,
    validate,
)
from ._own import task

# Command, module and help text of each study.
STUDIES = (
    ("validate", validate, "compare the figures of the thesis with those of the model, mismatches included"),
    ("optimise", optimise, "find the ratios and the displacement of minimum opening time with gradients"),
    ("design", design, "optimise actuators for the shortest opening time within limits, and certify the optima"),
    (
        "concepts",
        concepts,
        "redesign the two concepts of the thesis for its targets, with all manually chosen sizes free",
    ),
    ("beyond", beyond, "extend the thesis: real clutch, line, temperature, passages, landing, series production"),
    ("catalogue", catalogue, "choose motor, gearhead, pump and bores among 10,000 combinations of products"),
    ("architectures", architectures, "compare kinds of actuators on one duty: times, currents, energies, losses"),
    ("identify", identify, "identify parameters of an actuator from measurements, with confidence intervals"),
    ("prototypes", prototypes, "identify parameters of the three prototypes, and report what the data leave open"),
    ("tolerance", tolerance, "compute the scatter of the opening time and its causes"),
    ("control", control, "find the voltage that opens the clutch softly within a current limit, soonest or coolest"),
    ("hold", hold, "hold the clutch open for a minute by motor or by valve, and compare the battery energy"),
)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the study of the command line."""
    parser = _parser()
    given = parser.parse_args(arguments)
    if given.run is explore.main:
        _explore(parser, given)
        return
    own = _own(given)
    if own is None:
        given.run(json=given.json, out=given.out, rtol=given.rtol)
        return
    try:
        optimise.own(task(**own), json=given.json, out=given.out, rtol=given.rtol)
    except AcausalError as error:
        parser.error(str(error))


def _explore(parser: argparse.ArgumentParser, given: argparse.Namespace) -> None:
    """Serves the app."""
    try:
        explore.main(given.name, given.port, given.browser)
    except AcausalError as error:
        parser.error(str(error))


def _own(given: argparse.Namespace) -> dict[str, Any] | None:
    """The arguments that describe a user's actuator; None if there are none."""
    said = {
        "file": getattr(given, "actuator", None), "motor": getattr(given, "motor", None),
        "changes": getattr(given, "set", None), "temperatures": getattr(given, "temperature", None),
    }  # fmt: skip
    said = {name: value for name, value in said.items() if value}
    return said or None


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m studies",
        description="Studies of hydraulic clutch actuators, based on Meloni's thesis (Torino, 2012).",
        epilog="Example: python -m studies optimise --json optimise.json --out pictures",
    )
    commands = parser.add_subparsers(required=True, metavar="STUDY")
    for name, study, text in STUDIES:
        command = commands.add_parser(name, help=text, description=study.__doc__)
        command.add_argument("--json", type=Path, metavar="FILE", help="write the rows of the table, in SI units")
        command.add_argument(
            "--out", type=Path, metavar="DIR", help="write pictures and a report (HTML) in this folder"
        )
        command.add_argument("--rtol", type=float, default=1e-9, help="relative tolerance of the runs (%(default)g)")
        command.set_defaults(run=study.main)
        if study is optimise:
            _add_own(command)
    _add_explore(commands.add_parser("explore", help="move sliders in a browser", description=explore.__doc__))
    return parser


def _add_explore(command: argparse.ArgumentParser) -> None:
    """Adds the options of the app."""
    command.add_argument(
        "name", nargs="?", metavar="MODEL", help=f"{', '.join(explore.ACTUATORS)}, FILE.toml as of optimise, or FILE.py"
    )
    command.add_argument("--port", type=int, default=0, help="port of the server on this machine (default: a free one)")
    command.add_argument("--no-browser", dest="browser", action="store_false", help="print the address only")
    command.set_defaults(run=explore.main)


def _add_own(command: argparse.ArgumentParser) -> None:
    """Adds the options for a user's actuator."""
    own = command.add_argument_group("your own actuator", "instead of those of the thesis")
    own.add_argument("--actuator", type=Path, metavar="FILE.toml", help="its parts and the optimisation problem")
    own.add_argument(
        "--motor", metavar="MOTOR", help="FILE.csv, FILE.csv:ORDER, or an order name of the catalogue; gearhead 4.3:1"
    )
    own.add_argument(
        "--set", action="append", metavar="PATH=VALUE", help="set a parameter, as in supply.V=12 or 'master.bore=19 mm'"
    )
    own.add_argument(
        "--temperature", action="append", type=float, metavar="C", help="in degrees Celsius; can be given several times"
    )


if __name__ == "__main__":
    main()
