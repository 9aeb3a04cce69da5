"""The methods Rodas5P and Rodas3P."""

from typing import ClassVar

import numpy as np

from ._rosenbrock import AbstractRosenbrock, RosenbrockTableau

_RODAS5P = RosenbrockTableau(
    order=5,
    gamma=0.21193756319429014,
    a=np.array(
        [
            [0, 0, 0, 0, 0, 0, 0, 0],
            [3.0, 0, 0, 0, 0, 0, 0, 0],
            [2.849394379747939, 0.45842242204463923, 0, 0, 0, 0, 0, 0],
            [-6.954028509809101, 2.489845061869568, -10.358996098473584, 0, 0, 0, 0, 0],
            [2.8029986275628964, 0.5072464736228206, -0.3988312541770524, -0.04721187230404641, 0, 0, 0, 0],
            [
                -7.502846399306121, 2.561846144803919, -11.627539656261098, -0.18268767659942256, 0.030198172008377946,
                0, 0, 0,
            ],
            [
                -7.502846399306121, 2.561846144803919, -11.627539656261098, -0.18268767659942256, 0.030198172008377946,
                1, 0, 0,
            ],
            [
                -7.502846399306121, 2.561846144803919, -11.627539656261098, -0.18268767659942256, 0.030198172008377946,
                1, 1, 0,
            ],
        ]
    ),
    c=np.array(
        [
            [0, 0, 0, 0, 0, 0, 0, 0],
            [-14.155112264123755, 0, 0, 0, 0, 0, 0, 0],
            [-17.97296035885952, -2.859693295451294, 0, 0, 0, 0, 0, 0],
            [147.12150275711716, -1.41221402718213, 71.68940251302358, 0, 0, 0, 0, 0],
            [165.43517024871676, -0.4592823456491126, 42.90938336958603, -5.961986721573306, 0, 0, 0, 0],
            [
                24.854864614690072, -3.0009227002832186, 47.4931110020768, 5.5814197821558125, -0.6610691825249471,
                0, 0, 0,
            ],
            [
                30.91273214028599, -3.1208243349937974, 77.79954646070892, 34.28646028294783, -19.097331116725623,
                -28.087943162872662, 0, 0,
            ],
            [
                37.80277123390563, -3.2571969029072276, 112.26918849496327, 66.9347231244047, -40.06618937091002,
                -54.66780262877968, -9.48861652309627, 0,
            ],
        ]
    ),
    alpha_sums=np.array(
        [0, 0.6358126895828704, 0.4095798393397535, 0.9769306725060716, 0.4288403609558664, 1, 1, 1]
    ),
    gamma_sums=np.array(
        [
            0.21193756319429014, -0.42387512638858027, -0.3384627126235924, 1.8046452872882734, 2.325825639765069,
            0, 0, 0,
        ]
    ),
    error=np.array([0, 0, 0, 0, 0, 0, 0, 1]),
    dense=np.array(
        [
            [
                25.948786856663858, -2.5579724845846235, 10.433815404888879, -2.3679251022685204, 0.524948541321073,
                1.1241088310450404, 0.4272876194431874, -0.17202221070155493,
            ],
            [
                -9.91568850695171, -0.9689944594115154, 3.0438037242978453, -24.495224566215796, 20.176138334709044,
                15.98066361424651, -6.789040303419874, -6.710236069923372,
            ],
            [
                11.419903575922262, 2.8879645146136994, 72.92137995996029, 80.12511834622643, -52.072871366152654,
                -59.78993625266729, -0.15582684282751913, 4.883087185713722,
            ],
        ]
    ),
)  # fmt: skip


class Rodas5P(AbstractRosenbrock):
    """Rodas5P: 8 stages, order 5 with an embedded order 4, stiffly accurate and L-stable, dense output of order 4, with
    little order reduction on stiff problems and index-1 DAEs.

    Source: G. Steinebach, Construction of Rosenbrock-Wanner method Rodas5P and numerical benchmarks within the Julia
    Differential Equations package, BIT Numerical Mathematics 63, 27 (2023).
    """

    tableau: ClassVar[RosenbrockTableau] = _RODAS5P


_RODAS3P = RosenbrockTableau(
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

    tableau: ClassVar[RosenbrockTableau] = _RODAS3P
