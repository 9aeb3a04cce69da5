"""Liquids: bulk modulus with entrained air, cavitation, viscosity, and one liquid for a whole circuit."""

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from acausal import (
    ArgumentError,
    Array,
    Component,
    Connections,
    ParameterError,
    Result,
    connect,
    initialise,
    parameters,
    repeat,
    replace,
    simulate,
)
from components.hydraulic import (
    Chamber,
    ConstantFlow,
    LinearLiquid,
    Liquid,
    Tank,
    dot_4,
    fill,
    iso_vg_32,
    iso_vg_46,
    iso_vg_68,
    transformer_oil,
    water,
)

KNOWN = (iso_vg_32, iso_vg_46, iso_vg_68, transformer_oil, dot_4, water)
ATMOSPHERE = 101325.0
GAUGE = np.array([0.0, 1e5, 1e6])


def mixture(air: float, stiffening: float) -> Liquid:
    return Liquid(
        density=870.0, bulk_modulus=1.5e9, nu_1=46e-6, nu_2=6.7e-6, air=air, stiffening=stiffening,
        transition_pressure=1e-2,
    )  # fmt: skip


# The laws of Cho and Yu (constant modulus) and of IFAS (it grows by 11.4 p) at 0, 1 and 10 bar, by complex steps.
@pytest.mark.parametrize(
    ("air", "stiffening", "modulus"),
    [
        (0.005, 0.0, (27846936.52731, 86582785.99149, 794418020.3025)),
        (0.005, 11.4, (27846936.52731, 86586571.95437, 797602228.2405)),
        (0.05, 0.0, (2832011.357033, 8974077.269011, 146733533.8014)),
        (0.05, 11.4, (2832011.357033, 8974116.987778, 146841182.0194)),
    ],
)
def test_bulk_modulus_with_air(air: float, stiffening: float, modulus: tuple[float, ...]) -> None:
    found = mixture(air, stiffening).bulk_modulus_at(jnp.asarray(GAUGE))
    np.testing.assert_allclose(found, modulus, rtol=1e-9)


def test_volume_with_air() -> None:
    found = 1.0 / mixture(0.01, 11.4).relative_density(jnp.asarray(GAUGE))
    np.testing.assert_allclose(found, (1.0, 0.9960577215811, 0.9911618193742), rtol=1e-9)


@pytest.mark.parametrize("liquid", KNOWN, ids=lambda liquid: liquid.__name__)
def test_density_never_turns_back(liquid: Callable[[], Liquid]) -> None:
    """The density increases from tension to 1000 bar, and its derivatives are right."""
    here = liquid()
    p = jnp.concatenate([-ATMOSPHERE * jnp.linspace(2.0, 0.0, 50), jnp.geomspace(1.0, 1e8, 50)])
    assert np.all(np.diff(here.relative_density(p)) > 0.0)
    slope = jax.vmap(jax.grad(lambda x: jnp.asarray(here.relative_density(x))))(p)
    np.testing.assert_allclose(here.compressibility(p), slope, rtol=1e-9)
    potential = jax.vmap(jax.grad(lambda x: jnp.asarray(here.potential(x))))(p)
    np.testing.assert_allclose(potential * here.relative_density(p), 1.0, rtol=1e-9)
    assert here.source


@pytest.mark.parametrize("liquid", KNOWN, ids=lambda liquid: liquid.__name__)
def test_data_sheets(liquid: Callable[..., Liquid]) -> None:
    """The viscosity passes through its two points; heat thins, pressure compresses, cold is denser."""
    here = liquid()
    for temperature, nu in ((here.T_1, here.nu_1), (here.T_2, here.nu_2)):
        assert float(jnp.asarray(liquid(temperature).kinematic_viscosity(0.0))) == pytest.approx(float(nu), rel=1e-12)
    warm, cold = liquid(333.15), liquid(283.15)
    assert warm.kinematic_viscosity(0.0) < cold.kinematic_viscosity(0.0)
    assert warm.reference_density < cold.reference_density
    assert 1.0 < float(jnp.asarray(here.relative_density(3e7))) < 1.03


# Celsius, density, kinematic viscosity in mm2/s, vapour pressure: VDI-Waermeatlas; bulk modulus in GPa: Kell 1975.
WATER = (
    (0.0, 999.84, 1.7918, 611.2, 1.965),
    (10.0, 999.70, 1.3063, 1228.0, 2.092),
    (20.0, 998.21, 1.0034, 2339.0, 2.179),
    (30.0, 995.65, 0.8007, 4246.0, 2.234),
    (40.0, 992.22, 0.6578, 7384.0, 2.260),
    (50.0, 988.04, 0.5531, 12352.0, 2.264),
    (60.0, 983.20, 0.4740, 19946.0, 2.247),
    (70.0, 977.78, 0.4127, 31201.0, 2.214),
    (80.0, 971.80, 0.3643, 47415.0, 2.167),
    (90.0, 965.31, 0.3255, 70182.0, 2.108),
    (95.0, 961.89, 0.3090, 84609.0, 2.075),
)


@pytest.mark.parametrize(("celsius", "density", "nu", "vapour", "modulus"), WATER)
def test_water_against_tables(celsius: float, density: float, nu: float, vapour: float, modulus: float) -> None:
    """Over the range of the docstring, as near to the tables as it says."""
    here = water(celsius + 273.15, air=1e-9)
    assert float(here.reference_density) == pytest.approx(density, rel=1e-3)
    assert 1e6 * float(jnp.asarray(here.kinematic_viscosity(0.0))) == pytest.approx(nu, rel=0.015)
    within = 0.045 if 10.0 <= celsius <= 90.0 else 0.12
    assert 1e-9 * float(jnp.asarray(here.bulk_modulus_at(0.0))) == pytest.approx(modulus, rel=within)
    # Around the vapour pressure, the volume changes from full of liquid to full of vapour.
    bubbly = water(celsius + 273.15)
    assert float(jnp.asarray(bubbly.relative_density(1.045 * vapour - ATMOSPHERE))) > 0.1
    assert float(jnp.asarray(bubbly.relative_density(0.955 * vapour - ATMOSPHERE))) < 0.05


# Celsius and kinematic viscosity in mm2/s: data sheets of Shell Tellus S2 M 32, 46 and 68.
TELLUS = ((iso_vg_32, 0.0, 338.0), (iso_vg_46, 0.0, 580.0), (iso_vg_68, 0.0, 1040.0))


@pytest.mark.parametrize("temperature", [273.15, 288.15, 343.15])
def test_oil_softens_with_heat_and_stiffens_under_pressure(temperature: float) -> None:
    """K = K_ref exp(-softening (T - T_ref)) + m p, without air."""
    oil = iso_vg_46(temperature=temperature, air=1e-9)
    modulus = 1.8e9 * np.exp(-4e-3 * (temperature - 288.15)) + 10.0 * 2e7
    assert oil.bulk_modulus_at(2e7) == pytest.approx(modulus, rel=1e-6)


def test_viscosity_grows_with_pressure() -> None:
    """Barus; the viscosity of mineral oil doubles within about 350 bar (Murrenhoff, `Grundlagen der Fluidtechnik`)."""
    for liquid in (iso_vg_32(), iso_vg_46(), transformer_oil()):
        ratio = liquid.kinematic_viscosity(350e5) / liquid.kinematic_viscosity(0.0)
        assert ratio == pytest.approx(np.exp(liquid.thickening * 350e5), rel=1e-12)
        assert ratio == pytest.approx(2.0, rel=0.05)


@pytest.mark.parametrize(("liquid", "celsius", "nu"), TELLUS)
def test_oils_in_the_cold(liquid: Callable[..., Liquid], celsius: float, nu: float) -> None:
    """At the lower end of the range, away from the two points of the law."""
    assert 1e6 * float(jnp.asarray(liquid(celsius + 273.15).kinematic_viscosity(0.0))) == pytest.approx(nu, rel=0.03)


@pytest.mark.parametrize("liquid", [iso_vg_32, iso_vg_46, iso_vg_68, transformer_oil])
def test_oils_expand_as_petroleum_tables_say(liquid: Callable[..., Liquid]) -> None:
    """ASTM D1250 for lubricating oils: rho = rho_15 exp(-a D (1 + 0.8 a D)), a = 0.6278/rho_15, D from 15 C."""
    rho = float(liquid(288.15).reference_density)
    for celsius in (0.0, 40.0, 70.0, 100.0):
        z = 0.6278 / rho * (celsius - 15.0)
        wanted = rho * np.exp(-z * (1.0 + 0.8 * z))
        assert float(liquid(celsius + 273.15).reference_density) == pytest.approx(wanted, rel=7e-3)


def test_transformer_oil_keeps_the_limits_of_its_standard() -> None:
    """IEC 60296."""
    cold, warm, room = (transformer_oil(celsius + 273.15) for celsius in (-30.0, 40.0, 20.0))
    assert float(jnp.asarray(cold.kinematic_viscosity(0.0))) < 1800e-6
    assert float(jnp.asarray(warm.kinematic_viscosity(0.0))) < 12e-6
    assert float(room.reference_density) < 895.0


class Filling(Component):
    """A constant flow into a chamber."""

    flow: ConstantFlow
    chamber: Chamber

    def connections(self) -> Connections:
        return (connect(self.flow.port, self.chamber.port),)


@pytest.mark.thorough
@pytest.mark.parametrize("flow", [1e-5, -4e-5], ids=["charged", "drained"])
def test_chamber_conserves_mass(flow: float) -> None:
    """V r(p) = V + Q t: to 150 bar when charged; when drained by 40 %, bubbles are left near the vapour's pressure."""
    oil, volume = iso_vg_46(), 1e-4
    rig = Filling(flow=ConstantFlow(flow=flow), chamber=Chamber(volume=volume, liquid=oil))
    sol = simulate(rig, 0.1 if flow > 0.0 else 1.0, save="steps", rtol=1e-8, energy=True)
    p = np.asarray(sol["chamber.p"])
    np.testing.assert_allclose(oil.relative_density(jnp.asarray(p)), 1.0 + flow * sol.ts / volume, rtol=1e-4)
    assert np.all(p > float(oil.vapour_pressure) - ATMOSPHERE)
    assert abs(float(sol.energy.imbalance)) < 1e-6 * abs(float(sol.energy.stored["chamber"]))


@pytest.mark.thorough
def test_linear_liquid_is_the_textbooks() -> None:
    liquid = LinearLiquid(density=860.0, bulk_modulus=1.4e9, viscosity=32e-6)
    rig = Filling(flow=ConstantFlow(flow=1e-5), chamber=Chamber(volume=1e-4, liquid=liquid, wall=0.0))
    assert float(simulate(rig, 0.1, save="end").final.chamber.p) == pytest.approx(1.4e9 * 1e-2, rel=1e-9)


def test_liquid_without_air() -> None:
    """r = (1 + m p/K)^(1/m), under tension also, and the derivative by `air` is one-sided."""
    m, modulus = 11.4, 1.5e9
    liquid, p = mixture(0.0, m), jnp.asarray([-3e5, -ATMOSPHERE, 0.0, 1e5, 1e8])
    stretch = 1.0 + m * np.asarray(p) / modulus
    np.testing.assert_allclose(liquid.relative_density(p), stretch ** (1.0 / m), rtol=1e-14)
    np.testing.assert_allclose(liquid.bulk_modulus_at(p), modulus + m * p, rtol=1e-14)
    potential = modulus / (m - 1.0) * (stretch ** (1.0 - 1.0 / m) - 1.0)
    np.testing.assert_allclose(liquid.potential(p), potential, rtol=1e-12)
    rig = Filling(flow=ConstantFlow(flow=1e-7), chamber=Chamber(volume=1e-4, liquid=liquid, wall=0.0))

    def pressure(air: Any) -> Any:
        # Steps that only resolve the pure liquid would be too long for the derivative, which changes over 1 bar.
        filled = replace(rig, {"chamber.liquid.air": air})
        return simulate(filled, 0.1, save="end", rtol=1e-10, dtmax=1e-3).final.chamber.p

    end, slope = (float(x) for x in jax.jvp(pressure, (0.0,), (1.0,)))
    assert end == pytest.approx(modulus / m * (1.0001**m - 1.0), rel=1e-8)
    # The density is given, so dp/d(air) = -(dr/d air)/(dr/dp), where d(1/r)/d(air) is the volume of bubbles less 1/r.
    bubbles = (ATMOSPHERE / (ATMOSPHERE + end)) ** (1.0 / 1.4)
    assert slope == pytest.approx((1.0001 * bubbles - 1.0) * (modulus + m * end), rel=1e-6)


@pytest.mark.thorough
def test_one_liquid_for_a_circuit() -> None:
    """`fill` reaches all components and arrays; the gradient is the sum of theirs, in both modes and by differences."""
    rig = Filling(flow=ConstantFlow(flow=1e-5), chamber=Chamber(volume=1e-4, liquid=iso_vg_32()))
    filled = fill(rig, iso_vg_46(temperature=323.15))
    assert isinstance(filled.chamber.liquid, Liquid)
    assert float(filled.chamber.liquid.temperature) == 323.15
    many = fill(repeat(rig.chamber, 3), dot_4())
    assert isinstance(many, Array)
    assert jnp.shape(parameters(many)["item.liquid.nu_1"]) == (3,)

    def pressure(air: jax.Array) -> jax.Array:
        liquid = replace(Chamber(volume=1.0, liquid=iso_vg_46()), {"liquid.air": air}).liquid
        return jnp.asarray(simulate(fill(rig, liquid), 0.05, save="end", rtol=1e-9).final.chamber.p)

    here, step = jnp.asarray(0.005), 1e-6
    with_slope = jax.jit(lambda air: jax.jvp(pressure, (air,), (jnp.ones(()),)))
    forward, reverse = with_slope(here)[1], jax.grad(pressure)(here)
    difference = (with_slope(here + step)[0] - with_slope(here - step)[0]) / (2.0 * step)
    np.testing.assert_allclose(forward, reverse, rtol=1e-7)
    np.testing.assert_allclose(forward, difference, rtol=1e-5)


def test_nothing_to_fill() -> None:
    with pytest.raises(ArgumentError, match=r"no component in Tank with a liquid. Build its components with `liquid="):
        fill(Tank(), dot_4())


@pytest.mark.thorough
def test_each_liquid_names_its_own_source() -> None:
    """In the model and in results, whichever liquid was compiled first."""
    assert len({str(liquid().source) for liquid in (water, iso_vg_46, dot_4)}) == 3
    for liquid in KNOWN:
        chamber = Chamber(volume=1e-3, liquid=liquid(), p=1e5)
        found = simulate(chamber, 1e-3, save="end")
        for named in (found.values, found.final, initialise(chamber)):
            assert isinstance(named.liquid, Liquid)
            assert named.liquid.source == liquid().source
    assert jax.tree.structure(iso_vg_32()) == jax.tree.structure(iso_vg_68())  # these share programs


BAD = (
    ({"bulk_modulus": -1.0}, r"bulk_modulus must be positive and finite, got -1.0 Pa"),
    ({"density": 0.0}, r"density must be positive and finite, got 0.0 kg/m3"),
    ({"air": 1.0}, r"air must be below 1, got 1.0"),
    ({"air": -0.01}, r"air must be nonnegative and finite, got -0.01"),
    ({"nu_1": 0.1e-6}, r"nu_1 must be above unit - shift, got nu_1 = 1e-07 m2/s"),
    ({"vapour_pressure": 2e5}, r"vapour_pressure must be below atmosphere at the temperature"),
    ({"temperature": 40.0}, r"temperature must be in K and give a viscosity below 1000 m2/s, got 40.0 K"),
    ({"temperature": 100.0}, r"temperature must be in K and give a viscosity below"),
    ({"T_2": 313.15}, r"T_1 must differ from T_2"),
    ({"expansion": -0.1}, r"temperature must give a positive volume with expansion and curvature"),
)


@pytest.mark.parametrize(("change", "text"), BAD, ids=lambda item: next(iter(item), None))
def test_unphysical_liquids_are_refused(change: dict[str, Any], text: str) -> None:
    good: dict[str, Any] = dict(density=870.0, bulk_modulus=1.5e9, nu_1=46e-6, nu_2=6.7e-6)
    with pytest.raises(ParameterError, match=rf"^Liquid\.{text}"):
        Liquid(**(good | change))


@pytest.mark.thorough
def test_unphysical_liquids_are_refused_under_jit() -> None:
    rig = Filling(flow=ConstantFlow(flow=1e-5), chamber=Chamber(volume=1e-4, liquid=iso_vg_32()))

    @jax.jit
    def is_refused(modulus: jax.Array) -> jax.Array:
        bad = replace(rig, {"chamber.liquid.bulk_modulus": modulus})
        return jnp.asarray(simulate(bad, 1e-3, save="end", throw=False).result == Result.bad_parameter)

    assert bool(is_refused(jnp.asarray(-1.0)))
    assert not bool(is_refused(jnp.asarray(1e9)))
    with pytest.raises(ParameterError, match=r"chamber\.liquid\.bulk_modulus must be positive .*, got -1\.0 Pa"):
        simulate(replace(rig, {"chamber.liquid.bulk_modulus": -1.0}), 1e-3)
