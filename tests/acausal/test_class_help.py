"""Documentation that classes generate: for `help`, for notebooks, and for the page of the library."""

import inspect
import pydoc
import re
import subprocess
import sys
from typing import Any, Self

import pytest
from IPython.core.formatters import HTMLFormatter
from IPython.core.interactiveshell import InteractiveShell

from acausal import Component, Energy, Equations, Param, Port, Record, Scalar, Var, eq, positive
from components import blocks, electrical, hydraulic, planar, rotational, thermal, translational
from components.electrical import DCMotor, Pin, Resistor
from components.hydraulic import Pipe
from components.rotational import Flange, IdealGear, Inertia, MeshLoss, SpringDamper

DOMAINS = (blocks, electrical, hydraulic, planar, rotational, thermal, translational)
CLASSES = [cls for domain in DOMAINS for _, cls in inspect.getmembers(domain, inspect.isclass)]
MODELS = [cls for cls in CLASSES if issubclass(cls, Component | Port | Record)]


def text_of(item: Any) -> str:
    return pydoc.plain(pydoc.render_doc(item))


def test_help_of_a_component() -> None:
    text = text_of(IdealGear)
    assert "IdealGear(*, ratio, a=Flange(), b=Flange(), support=None, nominal={})" in text
    assert "phi_a = ratio phi_b" in text
    assert "ratio  1  nonzero  turns of a for one turn of b" in text
    assert "support  Flange  phi in rad, tau in N.m  optional" in text
    assert "none is stored, dissipated or supplied" in text
    assert len(text.splitlines()) < 70
    assert "Any" not in text.split("Method resolution order")[0]
    assert text_of(IdealGear(ratio=2.0)).splitlines()[1:] == text.splitlines()[1:]


def test_parameters_variables_and_energy() -> None:
    text = SpringDamper.__doc__ or ""
    assert "\n    c         N.m/rad    nonnegative       stiffness\n" in text
    assert "\n    phi_rel0  rad                     = 0  relative angle of the unloaded spring\n" in text
    assert "\n    w_rel    rad/s  relative speed\n" in text
    assert "\n    stored      J  0.5 * c * (phi_rel - phi_rel0) ** 2\n" in text
    assert text.endswith("\n    dissipated  W  d * w_rel ** 2")


def test_arguments_of_a_constructor_of_its_own() -> None:
    text = Pipe.__doc__ or ""
    assert "Options:\n    n  number of segments, at least 2\n" in text
    assert "\n    friction  PipeFriction  optional" in text
    assert "\n    p_inner  Pa    shape (inner)  pressure at the inner nodes\n" in text
    assert "Energy:\n    that of its parts" in (DCMotor.__doc__ or "")


def test_ports_and_records() -> None:
    assert "\n    tau  N.m  torque, positive into the component" in (Flange.__doc__ or "")
    assert "\n    transition_power  W  positive  = 0.1  P_t" in (MeshLoss.__doc__ or "")
    assert "factor(self, delivered" in text_of(MeshLoss)


@pytest.mark.parametrize("cls", MODELS, ids=lambda cls: f"{cls.__module__}.{cls.__name__}")
def test_every_class_has_a_text_and_a_signature(cls: Any) -> None:
    text = cls.__doc__
    assert text.startswith(inspect.cleandoc(vars(cls)["__doc__"]))
    assert not {"Any", "NoneType"} & set(text.split("Parameters:")[-1].split())
    assert all(item.annotation is item.empty for item in inspect.signature(cls).parameters.values())


class _Spread(Component):
    """Declarations of several lines."""

    near: Param[
        Scalar,
        "kg.m2",
        positive,
    ]  # comment on the last line
    far: Param[  # comment on the first line
        Scalar,
        "m",  # comment in between
        positive,
    ] = 2.0
    x: Var[
        Scalar,
        "m",
    ] = 3.0  # position: measured from the wall
    said: Param[Scalar, "m"] = 1.0

    def __init__(
        self,
        *,
        near: float = 1.0,
        modes: int = 2,  # number of modes
        far: float = 1.0,
        other: dict[
            str,
            float,
        ],  # another one
    ) -> None:
        self.near, self.far, self.x, self.said = near, far, modes, other["said"]


def test_declarations_of_several_lines() -> None:
    text = _Spread.__doc__ or ""
    assert re.search(r"\n    near .* comment on the last line\n", text)
    assert re.search(r"\n    far .* comment on the first line\n", text)
    assert re.search(r"\n    x .* position: measured from the wall\n", text)
    assert re.search(r"\n    modes .* number of modes\n", text)
    assert re.search(r"\n    other .* another one\n", text)
    assert not re.search(r"in between", text)


class _Leaky(Component):
    v: Var[Scalar, "V"] = 0.5
    g: Param[Scalar, "S", positive] = 1.0
    p: Pin = Pin()

    def equations(self, d: Self) -> Equations:
        return dict(voltage=eq(self.v, self.p.v), leak=eq(self.p.i, self.g * self.v))

    def energy(self) -> Energy:
        loss = self.g * self.v**2
        return Energy(dissipated=loss)


class _Choice(Component):
    d: Param[Scalar, "N.s/m"] = 1.0
    is_hot: bool = False
    v: Var[Scalar, "m/s"] = 0.0

    def energy(self) -> Energy:
        if self.is_hot:
            return Energy(dissipated=2.0 * self.d * self.v**2)
        return Energy(dissipated=self.d * self.v**2)


def test_a_choice_of_accounts_is_left_to_the_method() -> None:
    assert "Energy:\n    see the method `energy`" in (_Choice.__doc__ or "")


def namesakes() -> tuple[type[Component], ...]:
    """Two classes of one name."""

    def first() -> type[Component]:
        class Leak(Component):
            g: Param[Scalar, "S"]  # conductance

            def equations(self, d: Self) -> Equations:
                return {}

        return Leak

    def second() -> type[Component]:
        class Leak(Component):
            g: Param[Scalar, "S"]  # slope of the current

            def equations(self, d: Self) -> Equations:
                return {}

        return Leak

    return first(), second()


def test_namesakes_have_their_own_texts() -> None:
    first, second = namesakes()
    assert "conductance" in (first.__doc__ or "")
    assert "slope of the current" in (second.__doc__ or "")


CELL = """
from acausal import Component, Param, Scalar, eq
class Leak(Component):
    g: Param[Scalar, "S"]  # {meaning}
    def equations(self, d):
        return dict()
"""


def test_a_class_in_a_notebook() -> None:
    shell: Any = InteractiveShell()
    for meaning in ("conductance", "slope"):
        shell.run_cell(CELL.format(meaning=meaning))
        assert shell.user_ns["Leak"].__doc__.splitlines()[1] == f"    g  S  {meaning}"


def test_a_class_without_a_text() -> None:
    """Has its tables, and not the signature that dataclasses writes; a local variable says nothing about a loss."""
    assert _Leaky.__doc__ == (
        "Parameters:\n    g  S  positive  = 1\n\nPorts:\n    p  Pin  v in V, i in A\n\n"
        "Variables:\n    v  V  = 0.5\n\nEnergy:\n    dissipated  W"
    )


@pytest.mark.parametrize(("item", "has_values"), [(Resistor, False), (Resistor(R=2.0), True)])
def test_cards_in_notebooks(item: Any, has_values: bool) -> None:
    shown = HTMLFormatter()(item) or ""
    assert "Ohm&#x27;s law" in shown
    assert '<td style="text-align:left">ohm</td>' in shown
    assert ("2 ohm" in shown) == has_values


SILENT = """
import sys
from components.rotational import IdealGear
assert "acausal._declare.class_card" not in sys.modules
assert "Parameters:" in IdealGear.__doc__
"""


@pytest.mark.thorough
def test_texts_are_made_when_they_are_asked_for() -> None:
    subprocess.run([sys.executable, "-c", SILENT], check=True)


def test_a_model_of_unknown_annotations_has_a_text() -> None:
    """As for those that are imported for type checkers only."""

    class Shaft(Component):
        """A shaft."""

        rotor: "Unknown"  # noqa: F821  # pyright: ignore[reportUndefinedVariable]

    assert (Shaft.__doc__ or "").startswith("A shaft.")
    assert Inertia.__doc__ != Shaft.__doc__
