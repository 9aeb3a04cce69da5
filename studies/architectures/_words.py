"""Limits of the opening time of an architecture, with descriptive names of sizes and losses."""

from collections.abc import Mapping
from types import MappingProxyType

from acausal import Component, parameters

from ._rows import Row

# Names of the main sizes, by path.
SIZES: Mapping[str, str] = MappingProxyType(
    {
        "accumulator.volume": "volume of the accumulator",
        "cam.profile.eccentricity": "eccentricity of the cam",
        "cam.profile.rate": "lift of the cam per angle",
        "compensator.margin": "pressure margin over the load",
        "crank.crank": "radius of the crank",
        "gearbox.ratio": "ratio of the gearbox",
        "inlet.area": "opening of the on/off valve",
        "master.bore": "bore of the master cylinder",
        "motor.resistor.R": "resistance of the winding",
        "pump.displacement": "displacement of the pump",
        "pump.margin": "pressure margin over the load",
        "pump.pump.displacement": "displacement of the pump",
        "pump.swash.rate": "speed of the swash plate",
        "screw.converter.ratio": "turns of the screw per travel",
        "slave.bore": "bore of the slave cylinder",
        "valve.area": "opening of the holding valve",
        "valve.rated_flow": "rated flow of the valve",
    }
)
# Names of the losses, by path of the component.
LOSSES: Mapping[str, str] = MappingProxyType(
    {
        "accumulator": "inlet of the accumulator",
        "bleed": "flow through the bleed-off valve",
        "check": "check valve",
        "check_a": "check valves",
        "check_b": "check valves",
        "coil": "coil of the holding valve",
        "compensator": "surplus flow through the compensator",
        "inlet": "on/off valves",
        "leak": "leakage of the seals",
        "line": "line",
        "motor.bearing": "friction of the turning drive",
        "motor.resistor": "heat of the motor's winding",
        "outlet": "on/off valves",
        "pump": "slip of the pump",
        "pump.pump": "slip of the pump",
        "purge": "flow through the purge valve",
        "relay": "relay of the coil",
        "relief": "surplus flow through the relief valve",
        "relief_a": "relief valves",
        "relief_b": "relief valves",
        "screw.gear": "friction of the screw",
        "seal": "seal of the slave cylinder",
        "valve": "pressure drop of the valve",
        "worm": "friction of the worm",
    }
)
WINDING = "motor.resistor.R"
HALF = 0.5  # threshold of the pressure share lost in valves, and of the elasticity, to limit the opening
HEADS = (
    "architecture", "opening is limited by", "size of largest effect", "time for 1 % more of it",
    "largest loss",
)  # fmt: skip


def limits(row: Row, model: Component) -> tuple[str, ...]:
    """A line of the table with `HEADS`.

    All controllers saturate during the opening. If the valves take most of the pressure at half the stroke, they limit
    the opening. Otherwise the motor limits it: its current if the time depends strongly on the winding resistance, and
    its no-load speed if not.
    """
    shares = elasticities(row, model)
    size = max(shares.keys() - {WINDING}, key=lambda path: abs(shares[path]), default=None)
    lost = max(row.losses, key=lambda path: row.losses[path])
    share = 100.0 * row.losses[lost] / sum(row.losses.values())
    told = ("-", "-") if size is None else (SIZES[size], f"{shares[size]:+.2f} %")
    return row.architecture, _bound(row, shares), *told, f"{LOSSES[lost]}, {share:.0f} %"


def _bound(row: Row, shares: Mapping[str, float]) -> str:
    flows = row.flows["opening"]
    dropped = 1.0 - flows["clutch_p"] / flows["source_p"]
    if dropped > HALF:
        return f"valves: {100.0 * dropped:.0f} % of the pressure drops there"
    if shares.get(WINDING, 0.0) > HALF:
        return f"motor current: 1 % more resistance, {shares[WINDING]:.2f} % more time"
    return "motor speed at full voltage"


def elasticities(row: Row, model: Component) -> dict[str, float]:
    """Elasticities of the opening time with respect to the main sizes, by path."""
    values = parameters(model)
    return {path: slope * float(values[path]) / row.opening_time for path, slope in row.gradients.items()}
