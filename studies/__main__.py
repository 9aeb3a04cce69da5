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
    hold,
    identify,
    optimise,
    prototypes,
    tolerance,
    validate,
)
from ._own import task

# By command, with what `--help` says of it.
STUDIES = (
    ("validate", validate, "set the figures of the thesis beside those of the model, mismatches included"),
    ("optimise", optimise, "find the ratios and the displacement of minimum opening time by their gradient"),
    ("design", design, "design actuators for the least opening time within limits, and certify the optima"),
    (
        "concepts",
        concepts,
        "design the thesis' two concepts anew under its targets, all that it fixed by hand free",
    ),
    ("beyond", beyond, "go on where the thesis stopped: real clutch, line, temperature, passages, landing, series"),
    ("catalogue", catalogue, "choose motor, gearhead, pump and bores among 10,000 combinations of products"),
    ("architectures", architectures, "compare kinds of actuators on one duty: times, currents, energies, losses"),
    ("identify", identify, "identify parameters of an actuator from measurements, with confidence intervals"),
    ("prototypes", prototypes, "tell what the measurements on the three prototypes say, and what they leave open"),
    ("tolerance", tolerance, "find how the opening time scatters with its parameters, and what causes it"),
    ("control", control, "find the course of the voltage that opens softly within a current, soonest or coolest"),
    ("hold", hold, "hold the clutch open for a minute by motor or by valve, and compare what the battery gives"),
)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run what the arguments say."""
    parser = _parser()
    given = parser.parse_args(arguments)
    own = _own(given)
    if own is None:
        given.run(json=given.json, out=given.out, rtol=given.rtol)
        return
    try:
        optimise.own(task(**own), json=given.json, out=given.out, rtol=given.rtol)
    except AcausalError as error:
        parser.error(str(error))


def _own(given: argparse.Namespace) -> dict[str, Any] | None:
    """What is said of an actuator of one's own; None where nothing is."""
    said = {
        "file": getattr(given, "actuator", None), "motor": getattr(given, "motor", None),
        "changes": getattr(given, "set", None), "temperatures": getattr(given, "temperature", None),
    }  # fmt: skip
    said = {name: value for name, value in said.items() if value}
    return said or None


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m studies",
        description="Studies of hydraulically transmitted clutch actuators, after Meloni's thesis (Torino, 2012).",
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
    return parser


def _add_own(command: argparse.ArgumentParser) -> None:
    """The options for an actuator of one's own."""
    own = command.add_argument_group("an actuator of your own", "instead of those of the thesis")
    own.add_argument("--actuator", type=Path, metavar="FILE.toml", help="its parts, and what is asked of it")
    own.add_argument(
        "--motor", metavar="MOTOR", help="FILE.csv, FILE.csv:ORDER, or an order name of the catalogue; gearhead 4.3:1"
    )
    own.add_argument(
        "--set", action="append", metavar="PATH=VALUE", help="a parameter, as in supply.V=12 or 'master.bore=19 mm'"
    )
    own.add_argument(
        "--temperature", action="append", type=float, metavar="C", help="in degrees Celsius; may be given several times"
    )


if __name__ == "__main__":
    main()
