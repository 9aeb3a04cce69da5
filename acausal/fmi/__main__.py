"""The command line: `python -m acausal.fmi --help`."""

import argparse
import importlib
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from .._command_line import exit_code
from .._declare.component import Component
from .._errors import ModelError
from .._extras import needed, panels
from . import export_fmu


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command and return its exit code."""
    return exit_code(_parser(), arguments)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m acausal.fmi", description="Functional mock-up units.")
    commands = parser.add_subparsers(required=True)
    export = commands.add_parser("export", help="write a model as an FMU")
    export.add_argument("model", help="module:name of a model or of a function that returns one")
    export.add_argument("file", help="the FMU, such as press.fmu")
    export.add_argument("--inputs", nargs="*", default=[], help="open signal inputs, such as motor.u")
    export.add_argument("--outputs", nargs="*", help="variables to show; all that are not in ports by default")
    export.add_argument("--version", choices=["2.0", "3.0"], default="3.0", help="version of FMI")
    export.add_argument("--platforms", nargs="*", help="platforms such as x86_64-windows; this one by default")
    export.set_defaults(run=_export)
    check = commands.add_parser("check", help="validate an FMU and list its variables")
    check.add_argument("file")
    check.set_defaults(run=_check)
    run = commands.add_parser("simulate", help="simulate an FMU with constant inputs")
    run.add_argument("file")
    run.add_argument("--stop", type=float, required=True, help="stop time in s")
    run.add_argument("--step", type=float, help="communication step in s")
    run.add_argument("--set", nargs="*", default=[], metavar="NAME=VALUE", help="parameters, inputs, start values")
    run.add_argument("--csv", help="write the outputs to a file")
    run.add_argument("--plot", help="draw the outputs in a file")
    run.set_defaults(run=_simulate)
    return parser


def _export(options: argparse.Namespace) -> int:
    file = export_fmu(
        _model(options.model),
        options.file,
        inputs=options.inputs,
        outputs=options.outputs,
        version=options.version,
        platforms=options.platforms,
    )
    print(f"{file}: {file.stat().st_size / 1000:.0f} kB")
    return 0


def _model(text: str) -> Component:
    module, _, name = text.partition(":")
    try:
        found: Any = getattr(importlib.import_module(module), name or "model")
    except (ImportError, AttributeError) as error:
        raise ModelError(f"{text!r} names no model: {error}. Write it as module:name.") from error
    return found if isinstance(found, Component) else found()


def _check(options: argparse.Namespace) -> int:
    fmpy, validation = needed("fmpy", "fmi", "An FMU"), needed("fmpy.validation", "fmi", "An FMU")
    if not Path(options.file).is_file():
        raise ModelError(f"There is no file {options.file}.")
    problems = validation.validate_fmu(options.file)
    for problem in problems:
        print(problem)
    if not problems:
        variables = fmpy.read_model_description(options.file).modelVariables
        rows = [("variable", "causality", "unit", "start")]
        rows += [(v.name, v.causality or "", v.unit or "", v.start or "") for v in variables]
        widths = [max(len(row[k]) for row in rows) for k in range(4)]
        for row in rows:
            print("  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip())
    print(f"{options.file}: {len(problems)} problems")
    return 1 if problems else 0


def _simulate(options: argparse.Namespace) -> int:
    fmpy = needed("fmpy", "fmi", "An FMU")
    settings = dict(_setting(text) for text in options.set)
    try:
        run = fmpy.simulate_fmu(
            options.file, stop_time=options.stop, output_interval=options.step, start_values=settings
        )
    except Exception as error:
        raise ModelError(f"{options.file} cannot be simulated: {error}") from error
    names = run.dtype.names
    for name in names:
        print(f"{name:20} {run[name][-1]:g}")
    if options.csv:
        fmpy.util.write_csv(options.csv, run)
    if options.plot:
        _plot(run, names[1:]).savefig(options.plot)
    return 0


def _plot(run: Any, names: Sequence[str]) -> Any:
    """A figure with an axis for each output."""
    axes = panels(None, len(names), 1, (7.0, 2.0 * len(names)), sharex=True)[:, 0]
    for axis, name in zip(axes, names, strict=True):
        axis.plot(run["time"], run[name])
        axis.set_ylabel(name)
    axes[-1].set_xlabel("time in s")
    return axes[0].figure


def _setting(text: str) -> tuple[str, float]:
    name, _, value = text.partition("=")
    try:
        return name, float(value)
    except ValueError:
        raise ModelError(f"{text!r} is not a setting: write NAME=VALUE, such as h=2.0.") from None


if __name__ == "__main__":
    sys.exit(main())
