"""Acausal, differentiable component models in JAX."""

from ._precision import enable_double_precision

enable_double_precision()

from ._annotations import Flow as Flow  # noqa: E402
from ._annotations import Nominal as Nominal  # noqa: E402
from ._annotations import Param as Param  # noqa: E402
from ._annotations import Scalar as Scalar  # noqa: E402
from ._annotations import Time as Time  # noqa: E402
from ._annotations import Var as Var  # noqa: E402
from ._annotations import Vector as Vector  # noqa: E402
from ._annotations import avoid as avoid  # noqa: E402
from ._annotations import nonnegative as nonnegative  # noqa: E402
from ._annotations import positive as positive  # noqa: E402
from ._annotations import prefer as prefer  # noqa: E402
from ._annotations import shape as shape  # noqa: E402
from ._array import Array as Array  # noqa: E402
from ._array import repeat as repeat  # noqa: E402
from ._array import stack as stack  # noqa: E402
from ._compile import compile as compile  # noqa: E402
from ._component import Component as Component  # noqa: E402
from ._component import Connections as Connections  # noqa: E402
from ._component import Energy as Energy  # noqa: E402
from ._component import Equations as Equations  # noqa: E402
from ._component import connect as connect  # noqa: E402
from ._component import eq as eq  # noqa: E402
from ._errors import ModelError as ModelError  # noqa: E402
from ._errors import ParameterError as ParameterError  # noqa: E402
from ._errors import SimulationError as SimulationError  # noqa: E402
from ._errors import StructureError as StructureError  # noqa: E402
from ._node import Port as Port  # noqa: E402
from ._node import Record as Record  # noqa: E402
from ._result import Result as Result  # noqa: E402
from ._simulate import simulate as simulate  # noqa: E402
from ._solution import Solution as Solution  # noqa: E402
from ._structure import Structure as Structure  # noqa: E402
from ._structure import structure as structure  # noqa: E402
from ._system import System as System  # noqa: E402
