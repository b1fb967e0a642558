"""Coefficients of the Rosenbrock method Rodas5P, checked against each other when they are made."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from symgen.runtime.integrate.nested_basis import fit_rows

# Steinebach, BIT 63 (2023) 27, in the variables in which no product with the Jacobian is left (Hairer, Wanner, Solving
# ODEs II (1996), IV.7, (7.25)), to the digits of its implementation in OrdinaryDiffEq.jl. Rows 7 and 8 of `a` follow
# from row 6: stages 7 and 8, and the new state, add one k each.
GAMMA = 0.21193756319429014
_A = (
    (),
    (3.0,),
    (2.849394379747939, 0.45842242204463923),
    (-6.954028509809101, 2.489845061869568, -10.358996098473584),
    (2.8029986275628964, 0.5072464736228206, -0.3988312541770524, -0.04721187230404641),
    (
        -7.502846399306121, 2.561846144803919, -11.627539656261098, -0.18268767659942256, 0.030198172008377946,
    ),
)  # fmt: skip
_C = (
    (),
    (-14.155112264123755,),
    (-17.97296035885952, -2.859693295451294),
    (147.12150275711716, -1.41221402718213, 71.68940251302358),
    (165.43517024871676, -0.4592823456491126, 42.90938336958603, -5.961986721573306),
    (24.854864614690072, -3.0009227002832186, 47.4931110020768, 5.5814197821558125, -0.6610691825249471),
    (
        30.91273214028599, -3.1208243349937974, 77.79954646070892, 34.28646028294783, -19.097331116725623,
        -28.087943162872662,
    ),
    (
        37.80277123390563, -3.2571969029072276, 112.26918849496327, 66.9347231244047, -40.06618937091002,
        -54.66780262877968, -9.48861652309627,
    ),
)  # fmt: skip
_NODES = (0.0, 0.6358126895828704, 0.4095798393397535, 0.9769306725060716, 0.4288403609558664, 1.0, 1.0, 1.0)
_SLOPES = (
    0.21193756319429014,
    -0.42387512638858027,
    -0.3384627126235924,
    1.8046452872882734,
    2.325825639765069,
)
# y(θ) = (1-θ) y0 + θ (y1 + (1-θ)(H1 k + θ (H2 k + θ H3 k))).
_H = (
    (
        25.948786856663858, -2.5579724845846235, 10.433815404888879, -2.3679251022685204, 0.524948541321073,
        1.1241088310450404, 0.4272876194431874, -0.17202221070155493,
    ),
    (
        -9.91568850695171, -0.9689944594115154, 3.0438037242978453, -24.495224566215796, 20.176138334709044,
        15.98066361424651, -6.789040303419874, -6.710236069923372,
    ),
    (
        11.419903575922262, 2.8879645146136994, 72.92137995996029, 80.12511834622643, -52.072871366152654,
        -59.78993625266729, -0.15582684282751913, 4.883087185713722,
    ),
)  # fmt: skip

N_STAGES = 8
# Work is integrated by Lobatto's rule with these two nodes between the ends.
LOBATTO = ((5.0 - 5.0**0.5) / 10.0, (5.0 + 5.0**0.5) / 10.0)
# Where the dense output of quaternions meets what that of their rotation vectors says.
PLACES = (0.25, 0.5, 0.75)


class Rosenbrock(NamedTuple):
    """A Rosenbrock method whose last increment is its error estimate.

    Increments solve (1/(h γ) - J) k_i = f(t + c_i h, y + Σ a_ij k_j) + Σ c_ij k_j / h + h d_i ∂f/∂t.

    Attributes
    ----------
    gamma : float
    a, couplings : ndarray, shape (8, 8)
        Strictly lower triangular.
    end : ndarray, shape (8,)
        What makes the new state of the increments: the argument of the last stage plus its increment.
    nodes, slopes : ndarray, shape (8,)
        c_i and d_i.
    dense : ndarray, shape (3, 8)
        From the increments to rows 2 to 4 of the dense output.
    work : ndarray, shape (3, 3)
        From h P - Δw at the start and at the nodes of `LOBATTO` to rows 2 to 4 of the work.
    turns : ndarray, shape (3, 3)
        From what quaternions are off a straight line at `PLACES` to their rows 2 to 4.
    time_dependent : int
        Whether f depends on t explicitly.
    """

    gamma: float
    a: np.ndarray
    couplings: np.ndarray
    end: np.ndarray
    nodes: np.ndarray
    slopes: np.ndarray
    dense: np.ndarray
    work: np.ndarray
    turns: np.ndarray
    time_dependent: int


def rodas5p(time_dependent: bool = True) -> Rosenbrock:
    """Return Rodas5P, of order 5(4), L-stable, with dense output of order 4.

    Raises
    ------
    ValueError
        Where the coefficients contradict each other.
    """
    a, couplings = np.zeros((N_STAGES, N_STAGES)), np.zeros((N_STAGES, N_STAGES))
    for i, row in enumerate(_A):
        a[i, : len(row)] = row
    a[6:, :5] = a[5, :5]
    a[6, 5] = a[7, 5] = a[7, 6] = 1.0
    for i, row in enumerate(_C):
        couplings[i, : len(row)] = row
    h1, h2, h3 = np.array(_H)
    slopes = np.array([*_SLOPES, 0.0, 0.0, 0.0])
    work = fit_rows([(1, 0.0), (1, LOBATTO[0]), (1, LOBATTO[1])])
    end = a[7].copy()
    end[7] = 1.0
    turns = fit_rows([(0, place) for place in PLACES])
    method = Rosenbrock(
        GAMMA, a, couplings, end, np.array(_NODES), slopes, np.array([h1, h2 + h3, -h3]), work, turns,
        int(time_dependent),
    )  # fmt: skip
    validate(method)
    return method


def validate(method: Rosenbrock) -> None:
    """Raise ValueError where nodes, slopes and coefficients contradict each other."""
    alpha, gamma = original_coefficients(method)
    if np.abs(alpha.sum(axis=1) - method.nodes).max() > 1e-12:
        raise ValueError(f"the rows of the coefficients sum to {alpha.sum(axis=1)}, not to the nodes")
    if np.abs(gamma.sum(axis=1) - method.slopes).max() > 1e-12:
        raise ValueError(f"the rows of Γ sum to {gamma.sum(axis=1)}, not to the weights of the slope")


def original_coefficients(method: Rosenbrock) -> tuple[np.ndarray, np.ndarray]:
    """Return α_ij and γ_ij of k_i = h f(y + Σ α_ij k_j) + h J Σ γ_ij k_j (Hairer, Wanner 1996, (7.4) and (7.25))."""
    gamma = np.linalg.inv(np.eye(N_STAGES) / method.gamma - method.couplings)
    return method.a @ gamma, gamma
