"""Rodas3P."""

from typing import ClassVar

import numpy as np

from ._rosenbrock import AbstractRosenbrock, RosenbrockTableau

_tableau = RosenbrockTableau(
    order=3,
    gamma=1 / 3,
    a=np.array(
        [
            [0, 0, 0, 0, 0],
            [4 / 3, 0, 0, 0, 0],
            [0, 0, 0, 0, 0],
            [2.90625, 3.375, 0.40625, 0, 0],
            [2.90625, 3.375, 0.40625, 0, 0],
        ]
    ),
    c=np.array(
        [
            [0, 0, 0, 0, 0],
            [-4.0, 0, 0, 0, 0],
            [8.25, 6.75, 0, 0, 0],
            [1.21875, -5.0625, -1.96875, 0, 0],
            [4.03125, -15.1875, -4.03125, 6.0, 0],
        ]
    ),
    alpha_sums=np.array([0, 4 / 9, 0, 1, 1]),
    gamma_sums=np.array([1 / 3, -1 / 9, 1, 0, 0]),
    error=np.array([0, 0, 0, -1, 1]),
    dense=np.array(
        [
            [1.78125, 6.75, 0.15625, -6.0, -1.0],
            [4.21875, -15.1875, -3.09375, 9.0, 0],
        ]
    ),
)


class Rodas3P(AbstractRosenbrock):
    """Rodas3P: 5 stages, order 3 with an embedded order 2, stiffly accurate and L-stable, dense output of order 3. It
    suits accuracies of three digits or less. A step takes only slightly less time than a step of `Rodas5P`.

    Source: G. Steinebach, Rosenbrock methods within OrdinaryDiffEq.jl - Overview, recent developments and applications,
    Proceedings of the JuliaCon Conferences (2024).
    """

    tableau: ClassVar[RosenbrockTableau] = _tableau
