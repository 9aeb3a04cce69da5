"""Planetary stages in series in one housing."""

import math
from collections.abc import Sequence

from acausal import ArgumentError, Component, Connections, Scalar, connect

from .._data_sheet import DataSheet
from ._basic import Fixed
from ._gears import PlanetaryGearbox
from ._interfaces import Flange
from ._stops import ElastoBacklash


class PlanetaryTrain(Component):
    """Planetary stages in series, driven at the suns, with the rings held by one housing: a multi-stage reducer.

    `PlanetaryTrain(stages=[...])` joins the carrier of each stage to the sun of the next; ratios and efficiencies
    multiply. `teeth`, one `ElastoBacklash` for each stage, adds backlash and stiffness behind its carrier; without
    them, the train is rigid. The housing is the ground. With `support=Flange()` it is a flange, which takes the
    reaction. For other fixings, use `PlanetaryGearbox` with its three open flanges.
    """

    stages: tuple[PlanetaryGearbox, ...]  # from a to b
    teeth: tuple[ElastoBacklash, ...]  # behind the carrier of each stage, or empty
    housing: Fixed | None
    data_sheet: DataSheet | None = None  # source of the parameters; see `catalogues`
    a: Flange = Flange()
    b: Flange = Flange()
    support: Flange | None = None

    def __init__(
        self,
        *,
        stages: Sequence[PlanetaryGearbox],
        teeth: Sequence[ElastoBacklash] = (),
        support: Flange | None = None,
        data_sheet: DataSheet | None = None,
    ) -> None:
        if not stages:
            raise ArgumentError("PlanetaryTrain needs at least one stage.")
        if len(teeth) not in (0, len(stages)):
            raise ArgumentError(f"PlanetaryTrain takes {len(stages)} teeth, one for each stage, got {len(teeth)}.")
        self.stages, self.teeth, self.support = tuple(stages), tuple(teeth), support
        self.data_sheet = data_sheet
        self.housing = Fixed() if support is None else None
        self.a, self.b = Flange(), Flange()

    @property
    def ratio(self) -> Scalar:
        """Turns of a for one turn of b."""
        return math.prod(stage.ratio for stage in self.stages)

    def connections(self) -> Connections:
        held = self.support if self.housing is None else self.housing.flange
        assert held is not None
        outs = [stage.carrier for stage in self.stages]
        if self.teeth:
            soft = tuple(connect(stage.carrier, tooth.a) for stage, tooth in zip(self.stages, self.teeth, strict=True))
            outs = [tooth.b for tooth in self.teeth]
        else:
            soft = ()
        return (
            connect(self.a, self.stages[0].sun),
            *soft,
            *(connect(out, stage.sun) for out, stage in zip(outs, self.stages[1:], strict=False)),
            connect(outs[-1], self.b),
            connect(held, *(stage.ring for stage in self.stages)),
        )
