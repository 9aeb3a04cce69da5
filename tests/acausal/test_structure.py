"""The report of what the engine made of a model."""

import matplotlib as mpl
import pytest
from _mechanisms import Pendulum
from _models import gear_train, rc, rectifier

from acausal import Structure, choose_states, structure

mpl.use("Agg")


@pytest.fixture(scope="module")
def circuit() -> Structure:
    return structure(rc())


def test_counts(circuit: Structure) -> None:
    """Three two-poles of six variables each, and a ground of two."""
    assert (circuit.variables, circuit.parameters) == (20, 3)
    assert circuit.zeros == 3  # the potentials at the ground
    # Left are the voltages of source and resistor, the potentials at both ends of the resistor, the current, that of
    # the ground, and the slope of the capacitor's voltage.
    assert circuit.equations == 7
    assert circuit.aliases == 20 - 3 - 7
    assert circuit.states == {"c.v": "free, declared prefer"}
    assert circuit.differentiated == {}
    assert circuit.dummies == ()


def test_blocks_solve_each_equation_once(circuit: Structure) -> None:
    equations = [equation for block in circuit.blocks for equation in block.equations]
    unknowns = [unknown for block in circuit.blocks for unknown in block.unknowns]
    assert len(equations) == len(set(equations)) == circuit.equations
    assert len(unknowns) == len(set(unknowns)) == circuit.equations
    assert dict(zip(equations, unknowns, strict=True))["c.charge"] == "der(c.v)"
    # The resistance may be zero, so that Ohm's law cannot be solved for the current beforehand.
    assert [block.equations for block in circuit.blocks if block.kind != "explicit"] == [("r.ohm",)]


def test_blocks_come_in_the_order_of_computation(circuit: Structure) -> None:
    order = [block.unknowns[0] for block in circuit.blocks]
    chain = [order.index(name) for name in ("source.v", "source.p.v", "r.v", "source.i", "der(c.v)")]
    assert chain == sorted(chain)


def test_text(circuit: Structure) -> None:
    text = str(circuit)
    assert text.splitlines()[0] == "20 variables, 3 parameters"
    assert "States (1):\n  c.v: free, declared prefer\n" in text
    assert "7 blocks in 7 groups, 1 of them simultaneous" in text
    assert "one linear equation: r.ohm  ->  source.i" in text
    assert "Differentiated" not in text


def test_differentiated_equations() -> None:
    text = str(structure(gear_train(2.0)))
    assert "Differentiated equations (3):" in text
    assert "  gear.kinematics, 2 times" in text
    assert "linear, " in text


def test_simultaneous_equations() -> None:
    report = structure(rectifier(5.0))
    (block,) = (block for block in report.blocks if block.tearing)
    assert block.kind == "nonlinear"
    assert block.tearing == ("diode.v",)
    assert "diode.shockley" in block.equations
    assert "r.ohm" in block.equations
    assert f"nonlinear, {len(block.equations)} equations torn by diode.v" in str(report)


def test_what_compile_chose() -> None:
    report = structure(choose_states(Pendulum(x=1.0)))
    assert report.differentiated["rod"] == 2
    assert "d2/dt2 rod" in {equation for block in report.blocks for equation in block.equations}


def test_plot(circuit: Structure) -> None:
    from matplotlib import pyplot as plt

    ax = circuit.plot()
    labels = [label.get_text() for label in ax.get_yticklabels()]
    equations = [equation for block in circuit.blocks for equation in block.equations]
    assert len(labels) == len(equations)
    assert labels[1:] == equations[1:]
    assert labels[0].startswith("flows at")  # its full name is long
    assert len(ax.patches) == len(circuit.blocks)
    _, mine = plt.subplots()
    assert structure(rectifier(5.0)).plot(mine) is mine
    plt.close("all")
