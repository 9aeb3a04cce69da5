"""The command line: `python -m acausal.modelica --help`."""

import argparse
import re
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from .._command_line import exit_code
from .._errors import ModelError, UnknownNameError, suggestion
from .._extras import needed, panels
from .._integrate.results.solution import Solution
from .._integrate.simulate import simulate
from .._show.structure import structure
from ._load import load
from ._scoreboard.compare import Compared, compared
from ._scoreboard.reference import models_in
from ._scoreboard.table import FAILURES, save, saved, written


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command and return its exit code."""
    return exit_code(_parser(), arguments)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m acausal.modelica", description="Modelica models.")
    commands = parser.add_subparsers(required=True)
    check = commands.add_parser("check", help="translate a model and describe its equations")
    check.set_defaults(run=_check)
    run = commands.add_parser("simulate", help="simulate a model")
    run.add_argument("--stop", type=float, required=True, help="stop time in s")
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
    print(structure(model))
    return 0


def _simulate(options: argparse.Namespace) -> int:
    model = load(options.source, options.model, options.roots)
    solution = simulate(model, options.stop, save=np.linspace(0.0, options.stop, 501), progress=True)
    states = [name for name in solution.system.state_names if not name.startswith("der(")]
    wanted = [_modelica_name(name) for name in states] if options.signals is None else options.signals
    found = [pair for name in wanted for pair in _signals(solution, name)]
    names, columns = [name for name, _ in found], [np.asarray(solution.ts), *(column for _, column in found)]
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


def _signals(solution: Solution, name: str) -> list[tuple[str, np.ndarray]]:
    """A signal by its Modelica name, whose elements count from 1. Those of a solution count from 0."""
    whole = name.rpartition("[")[0]
    if not name.endswith("]") or whole not in solution.system.flat.leaf_names:
        return _elements(name, np.asarray(solution[_own_name(name)]))
    found = _elements(whole, np.asarray(solution[whole]))
    if name not in dict(found):
        raise UnknownNameError(f"There is no signal {name!r}.{suggestion(name, dict(found))}")
    return [pair for pair in found if pair[0] == name]


def _modelica_name(name: str) -> str:
    """The Modelica name `x[1,2]` of the element `x[0][1]` of an array."""
    found = re.fullmatch(r"(.*?)((?:\[\d+\])+)", name)
    if not found:
        return name
    return f"{found[1]}[{','.join(str(int(place) + 1) for place in found[2][1:-1].split(']['))}]"


def _own_name(name: str) -> str:
    """The name `x[0][1]` of the element `x[1,2]` of an array in Modelica."""
    found = re.fullmatch(r"(.*)\[(\d+(?:,\d+)*)\]", name)
    return found[1] + "".join(f"[{int(place) - 1}]" for place in found[2].split(",")) if found else name


def _elements(name: str, values: np.ndarray) -> list[tuple[str, np.ndarray]]:
    """A signal, or the elements of an array by their Modelica names."""
    if values.ndim == 1:
        return [(name, values)]
    places = np.ndindex(values.shape[1:])
    return [(f"{name}[{','.join(str(i + 1) for i in place)}]", values[(slice(None), *place)]) for place in places]


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
