"""Purchased parts: catalogues of data sheets, components from order numbers, and a check of ratings.

`dc_motor("148867")`, `gearhead("203115")` make components; `catalogue("motors").search(...)` finds data sheets; `load`
reads your own tables; `limits(solution)` checks a run against the ratings. The figures in the library's tables are
quoted from the sources named there. Before you base a design on them, compare them with the maker's current sheet.
"""

from typing import TYPE_CHECKING

from .._lazy import when_asked

if TYPE_CHECKING:
    from .._data_sheet import DataSheet as DataSheet
    from ._limits import Exceeded as Exceeded
    from ._limits import Limits as Limits
    from ._limits import limits as limits
    from ._parts import COLUMNS as COLUMNS
    from ._parts import brushed_motor as brushed_motor
    from ._parts import catalogue as catalogue
    from ._parts import dc_motor as dc_motor
    from ._parts import gear_train as gear_train
    from ._parts import gearhead as gearhead
    from ._parts import holding_valve as holding_valve
    from ._parts import pump as pump
    from ._servo import inverter as inverter
    from ._servo import servo_drive as servo_drive
    from ._servo import servo_motor as servo_motor
    from ._table import Catalogue as Catalogue
    from ._table import Column as Column
    from ._table import load as load
else:
    __getattr__, __dir__, __all__ = when_asked(__name__)
    __all__.remove("load")  # a star import must not shadow this everyday name
