"""Common liquids with their data, sources and ranges. The data are typical: a batch differs by a few per cent."""

from typing import Any

from acausal import Scalar

from ._liquids import Caloric, Liquid

# Tangent modulus of mineral oil, about 1.8 GPa at 15 C, its decrease with temperature and increase with pressure
# (Murrenhoff, `Grundlagen der Fluidtechnik`; Merritt, ch. 1).
_MINERAL_OIL: dict[str, Any] = dict(
    bulk_modulus=1.8e9, stiffening=10.0, softening=4e-3, expansion=7e-4, thickening=2e-8, vapour_pressure=10.0
)
# Typical of mineral oil at 40 C; it grows by 0.2 % per kelvin.
_MINERAL_OIL_HEAT = 1950.0


def _caloric(specific_heat: float, carries_heat: bool) -> Caloric | None:
    return Caloric(specific_heat=specific_heat) if carries_heat else None


def iso_vg_32(temperature: Scalar = 313.15, air: Scalar = 0.005, carries_heat: bool = False) -> Liquid:
    """Mineral hydraulic oil HLP 32, 32 mm2/s at 40 C, at a temperature in K, from 0 to 100 C."""
    return _oil(density=875.0, nu_1=32e-6, nu_2=5.4e-6, temperature=temperature, air=air, carries_heat=carries_heat)


def iso_vg_46(temperature: Scalar = 313.15, air: Scalar = 0.005, carries_heat: bool = False) -> Liquid:
    """Mineral hydraulic oil HLP 46, 46 mm2/s at 40 C, at a temperature in K, from 0 to 100 C."""
    return _oil(density=879.0, nu_1=46e-6, nu_2=6.7e-6, temperature=temperature, air=air, carries_heat=carries_heat)


def iso_vg_68(temperature: Scalar = 313.15, air: Scalar = 0.005, carries_heat: bool = False) -> Liquid:
    """Mineral hydraulic oil HLP 68, 68 mm2/s at 40 C, at a temperature in K, from 0 to 100 C."""
    return _oil(density=886.0, nu_1=68e-6, nu_2=8.6e-6, temperature=temperature, air=air, carries_heat=carries_heat)


def transformer_oil(temperature: Scalar = 313.15, air: Scalar = 0.005, carries_heat: bool = False) -> Liquid:
    """Mineral insulating oil, 9.5 mm2/s at 40 C, at a temperature in K, from -30 to 100 C.

    It meets the limits of IEC 60296: 12 mm2/s at 40 C, 1800 mm2/s at -30 C, 895 kg/m3 at 20 C.
    """
    source = "density and viscosity within the limits of IEC 60296; bulk modulus of mineral oil"
    return Liquid(
        density=875.0,
        nu_1=9.5e-6,
        nu_2=2.4e-6,
        temperature=temperature,
        air=air,
        source=source,
        caloric=_caloric(_MINERAL_OIL_HEAT, carries_heat),
        **_MINERAL_OIL,
    )


def dot_4(temperature: Scalar = 293.15, air: Scalar = 0.001, carries_heat: bool = False) -> Liquid:
    """Brake fluid DOT 4, well bled, at a temperature in K, from -40 to 100 C: 1200 mm2/s to 2.5 mm2/s."""
    source = "density, viscosity: Shell Donax UB (typical values); bulk modulus about that of glycols"
    return Liquid(
        density=1070.0, bulk_modulus=2.0e9, T_ref=293.15, softening=5e-3, expansion=8e-4, vapour_pressure=10.0,
        nu_1=1200e-6, T_1=233.15, nu_2=2.5e-6, T_2=373.15, temperature=temperature, air=air, source=source,
        caloric=_caloric(2300.0, carries_heat),
    )  # fmt: skip


def water(temperature: Scalar = 293.15, air: Scalar = 0.001, carries_heat: bool = False) -> Liquid:
    """Water at a temperature in K, from 0 to 95 C.

    Density is within 0.1 % of the tables, viscosity within 1.5 %, vapour pressure within 4.5 %. The bulk modulus is
    that at 20 C: within 4.5 % from 10 to 90 C, 11 % too high at 0 C.
    """
    source = "VDI-Waermeatlas; viscosity through 20 and 80 C; bulk modulus: Kell 1975"
    return Liquid(
        density=998.2, bulk_modulus=2.18e9, T_ref=293.15, stiffening=6.0, expansion=2.0e-4, curvature=4.15e-6,
        vapour_pressure=2339.0, vaporisation=5220.0, shift=0.84e-6,
        nu_1=1.0034e-6, T_1=293.15, nu_2=0.3645e-6, T_2=353.15, temperature=temperature, air=air, source=source,
        caloric=_caloric(4182.0, carries_heat),
    )  # fmt: skip


def _oil(carries_heat: bool, **data: Any) -> Liquid:
    source = "density at 15 C, viscosity: typical values of HLP oils; bulk modulus: mineral oil"
    return Liquid(source=source, caloric=_caloric(_MINERAL_OIL_HEAT, carries_heat), **data, **_MINERAL_OIL)
