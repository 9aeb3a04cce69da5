"""Battery energy to hold the clutch open for a minute, by the motor or by a valve, and its elasticities.

(a) The motor holds alone, with a PI controller. (b) A normally open valve, closed by its coil, holds while the motor is
off. Liquid leaks past the seals until a two-point controller runs the motor again (a top-up). Actuator and valve are
those of Meloni's thesis (Torino, 2012). Leakage, chamber and closing time of the valve are assumed, see
`studies.actuators`.
"""

from ._elasticities import KEYWORDS as KEYWORDS
from ._elasticities import Elasticities as Elasticities
from ._elasticities import Leaking as Leaking
from ._elasticities import elasticities as elasticities
from ._elasticities import evaluate as evaluate
from ._elasticities import sweep as sweep
from ._failures import Failure as Failure
from ._failures import failures as failures
from ._main import Row as Row
from ._main import main as main
from ._runs import DURATION as DURATION
from ._runs import Outcome as Outcome
from ._runs import outcomes as outcomes
from ._runs import run as run
from ._runs import static_power as static_power
from ._runs import top_up_times as top_up_times
