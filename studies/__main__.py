"""The command line: `python -m studies --help`."""

import argparse
from collections.abc import Sequence
from pathlib import Path

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


def main(arguments: Sequence[str] | None = None) -> None:
    """Run what the arguments say."""
    given = _parser().parse_args(arguments)
    given.run(json=given.json, out=given.out, rtol=given.rtol)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m studies",
        description="Studies of hydraulically transmitted clutch actuators, after Meloni's thesis (Torino, 2012).",
        epilog="Example: python -m studies optimise --json optimise.json --out pictures",
    )
    commands = parser.add_subparsers(required=True, metavar="STUDY")
    for name, study, text in (
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
    ):
        command = commands.add_parser(name, help=text, description=study.__doc__)
        command.add_argument("--json", type=Path, metavar="FILE", help="write the rows of the table, in SI units")
        command.add_argument(
            "--out", type=Path, metavar="DIR", help="write pictures and a report (HTML) in this folder"
        )
        command.add_argument("--rtol", type=float, default=1e-9, help="relative tolerance of the runs (%(default)g)")
        command.set_defaults(run=study.main)
    return parser


if __name__ == "__main__":
    main()
