"""The command line: `python -m acausal.modelica --help`."""

import argparse
import dataclasses
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from .._command_line import exit_code
from .._errors import ModelError
from .._extras import needed, panels
from .._integrate.simulate import simulate
from .._show.structure import structure
from ._load import load
from ._scoreboard.compare import Compared, compared
from ._scoreboard.reference import models_in
from ._scoreboard.table import FAILURES, save, saved, written
from ._signals import ModelicaSignals

POINTS = 501  # of a table or plot
TOLERANCE = 1e-6


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command and return its exit code."""
    return exit_code(_parser(), arguments)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m acausal.modelica", description="Modelica models.")
    commands = parser.add_subparsers(required=True)
    check = commands.add_parser("check", help="translate a model and describe its equations")
    check.set_defaults(run=_check)
    run = commands.add_parser("simulate", help="simulate a model")
    run.add_argument("--stop", type=float, help="stop time in s; that of the annotation experiment by default")
    run.add_argument("--tolerance", type=float, help="relative tolerance; that of the annotation, or 1e-6, by default")
    run.add_argument("--csv", help="write the signals to a file")
    run.add_argument("--plot", help="draw the signals in a file")
    run.add_argument("--signals", nargs="*", help="signals to write and draw; the states by default")
    run.set_defaults(run=_simulate)
    for command in (check, run):
        command.add_argument("source", help="a file, or the folder of a package; '' if a library holds the model")
        command.add_argument("model", help="the full name of the model, possibly with modifiers")
        _add_roots(command)
    board = commands.add_parser("scoreboard", help="compare a library with published results")
    _add_roots(board, required=True)
    board.add_argument("--references", required=True, help="folder with reference results")
    board.add_argument(
        "--rows", default="scoreboard.jsonl", help="file of results, to which a run adds what is missing"
    )
    board.add_argument("--again", action="store_true", help="run the models that failed in the file of results again")
    board.add_argument("--table", help="write a page in Markdown")
    board.add_argument("--only", default="", help="models whose names contain this text")
    board.add_argument("--limit", type=float, default=300.0, help="seconds for a model")
    board.add_argument("--gradients", action="store_true", help="check one derivative of each model that agrees")
    board.add_argument("--one", help=argparse.SUPPRESS)
    board.set_defaults(run=_scoreboard)
    return parser


def _add_roots(command: argparse.ArgumentParser, *, required: bool = False) -> None:
    command.add_argument(
        "--roots",
        action="append",
        default=None if required else [],
        required=required,
        help="a folder with libraries; repeat it for more than one",
    )


def _check(options: argparse.Namespace) -> int:
    model = load(options.source, options.model, options.roots)
    print(model)
    print(dataclasses.replace(structure(model), unchecked=()))  # Modelica equations have no units to check
    return 0


def _simulate(options: argparse.Namespace) -> int:
    model = load(options.source, options.model, options.roots)
    start = model.experiment.start or 0.0
    stop = options.stop if options.stop is not None else model.experiment.stop
    if stop is None:
        raise ModelError(f"{options.model} has no annotation experiment(StopTime=...). Remedy: --stop.")
    signals = ModelicaSignals(model)
    wanted = signals.states() if options.signals is None else options.signals
    names = [element for name in wanted for element in signals.elements(name)]
    readers = [signals[name] for name in names]
    # A table or plot shows values between the steps. They need a program of their own.
    save = np.linspace(start, stop, POINTS) if options.csv or options.plot else "steps"
    tolerance = options.tolerance or model.experiment.tolerance or TOLERANCE
    solution = simulate(model, stop, t0=start, save=save, rtol=tolerance, progress=True)
    columns = [np.asarray(solution.ts), *(np.asarray(read(solution)) for read in readers)]
    for name, column in zip(names, columns[1:], strict=True):
        print(f"{name}: {column[0]:.6g} to {column[-1]:.6g}")
    if options.csv:
        header = ",".join(f'"{name}"' for name in ("time", *names))
        np.savetxt(options.csv, np.column_stack(columns), delimiter=",", header=header, comments="")
    if options.plot:
        axes = panels(None, len(names), 1, (7.0, 1.5 + 1.5 * len(names)), sharex=True).ravel()
        for axis, name, column in zip(axes, names, columns[1:], strict=True):
            axis.plot(columns[0], column)
            axis.set_ylabel(name)
        axes[-1].set_xlabel("time in s")
        needed("matplotlib.pyplot", "plots", "A picture").savefig(options.plot)
    return 0


def _scoreboard(options: argparse.Namespace) -> int:
    rows = _compared_models(options)
    if options.table:
        Path(options.table).write_text(written(rows, "signals within 1e-3 of their range"), encoding="utf-8")
    return 0


def _compared_models(options: argparse.Namespace) -> list[Compared]:
    references = models_in(Path(options.references))
    if not references:
        raise ModelError(f"{options.references} has no folder with comparisonSignals.txt.")
    if options.one:
        row = compared(options.one, options.roots, references[options.one], gradient=options.gradients)
        save(row, Path(options.rows))
        return [row]
    wanted = [name for name in references if options.only in name]
    if not wanted:
        raise ModelError(f"No model with a reference has a name that contains {options.only!r}.")
    for number, name in enumerate(wanted, 1):
        before = saved(Path(options.rows)).get(name)
        if before is None or (options.again and before.stage in FAILURES):
            _in_own_process(name, options, before)
        row = saved(Path(options.rows))[name]
        print(f"{number}/{len(wanted)} {name}: {row.stage} {row.reason[:80]}", flush=True)
    return [row for name, row in saved(Path(options.rows)).items() if options.only in name]


def _in_own_process(name: str, options: argparse.Namespace, before: Compared | None) -> None:
    """One model in a process of its own, whose memory and faults do not reach the others."""
    command = [sys.executable, "-m", "acausal.modelica", "scoreboard", "--one", name, "--rows", options.rows]
    command += [*(f"--roots={root}" for root in options.roots), "--references", options.references]
    command += ["--gradients"] if options.gradients else []
    start = time.monotonic()
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=options.limit, check=False)
        reason = (done.stderr.strip().splitlines() or ["the process ended"])[-1]
    except subprocess.TimeoutExpired:
        reason = f"longer than {options.limit:g} s"
    if saved(Path(options.rows)).get(name) == before:
        save(Compared(name, "run", reason, seconds=time.monotonic() - start), Path(options.rows))


if __name__ == "__main__":
    sys.exit(main())
