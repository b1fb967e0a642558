"""Coefficients of the Radau IIA methods of order 5, 9 and 13, checked against each other when they are made."""

from __future__ import annotations

import functools
from collections import namedtuple
from typing import NamedTuple

import numpy as np
from numpy.polynomial import Polynomial

from symgen.runtime.integrate.nested_basis import rows_of

# By the number of stages: the nodes c; the real eigenvalue μ of a⁻¹; its eigenvalues below the real axis, ν; T and its
# inverse, row by row, where T⁻¹ a⁻¹ T has μ and the blocks [[Re ν, -Im ν], [Im ν, Re ν]] on its diagonal. Scaled as in
# radau.f of Hairer and Wanner: the last row of T is 1, 1, 0, 1, 0, …
# fmt: off
NODES = {
    3: (
        0.1550510257216822, 0.6449489742783178, 1.0,
    ),
    5: (
        0.05710419611451768, 0.2768430136381238, 0.5835904323689168, 0.8602401356562195, 1.0,
    ),
    7: (
        0.029316427159784893, 0.1480785996684843, 0.3369846902811543, 0.5586715187715501,
        0.7692338620300545, 0.9269456713197411, 1.0,
    ),
}
MU = {
    3: 3.637834252744496,
    5: 6.2867047517292765,
    7: 8.936832788405216,
}
NU = {
    3: (
        (2.6810828736277523-3.0504301992474105j),
    ),
    5: (
        (5.70095329867179-3.2102656003085497j), (3.655694325463572-6.543736899360077j),
    ),
    7: (
        (8.511834825102946-3.281013624325059j), (7.14105521918764-6.623045922639276j),
        (4.378693561506806-10.169693283795011j),
    ),
}
TO_STAGES = {
    3: (
        0.09443876248897524, -0.1412552950209542, 0.030029194105147424, 0.2502131229653333,
        0.20412935229379994, -0.3829421127572619, 1.0, 1.0, 0.0,
    ),
    5: (
        0.013576867344947943, -0.011478515255229515, 0.01401985889287541, -0.010242047817908826,
        -0.04767387729029572, 0.0016179004017190875, -0.007668830749180163, -0.024708578426518527,
        0.05017286451737106, 0.09433181918161143, 0.07915785334744721, 0.01939846399882895,
        -0.08180035370375117, -0.23053953404341795, -0.1027030453801259, 0.41225608268046143,
        0.40760117128019907, -0.19968242788680252, 0.37789390224886127, -0.46674413033249434, 1.0, 1.0,
        0.0, 1.0, 0.0,
    ),
    7: (
        0.0024435843048706113, -0.0012386461879528741, 0.0027606174805438525, -0.004055161452331024,
        -0.004427232753268285, 0.021567551351320772, -0.008783567925144144, -0.001815339648319317,
        -6.666635339396339e-05, -0.00318547482516621, 0.00841556827655959, 0.00403194957022455,
        -0.03813164813441155, 0.021525560594006874, 0.004605339331161875, -0.0023521809829433384,
        -0.00041690777252975626, -0.008560431061603433, 0.006923212665023909, 0.05739650893938172,
        -0.05885052920842679, 0.017870023342853068, 0.0031150711523461752, -0.025116604913438822,
        -0.03737124230238446, -0.00823900729850772, -0.03821469359696835, 0.16573681127294385,
        0.12818100807728391, 0.10171773248171515, -0.09504502035604623, 0.0053667613791817705,
        -0.19321111610126201, -0.2491742124652637, -0.27356330579866234, 0.5200651497488247,
        0.5217519452747653, -0.1280719446355439, 0.5265742264584493, -0.27553439498962584,
        0.5315846490836285, -0.4863228366175729, 1.0, 1.0, 0.0, 1.0, 0.0, 1.0, 0.0,
    ),
}
FROM_STAGES = {
    3: (
        4.178718591551905, 0.32768282076106237, 0.5233764454994495, -4.178718591551905,
        -0.32768282076106237, 0.47662355450055044, 0.5028726349457868, -2.571926949855605,
        0.5960392048282249,
    ),
    5: (
        27.697693775684087, 12.783337911304406, 3.20848938671343, -0.9514904122489162, 0.7415504960259897,
        -33.041880213519, -17.376953479063566, -0.17212906325400557, -0.09916977798254265,
        0.5312281158383066, 8.611443979875292, -9.699991409528808, -1.9147286396968743, -2.41869200608494,
        1.0474634879353375, 5.344186437834912, 4.593615567759161, -3.0363603234594243, 1.050660190231459,
        -0.27277861186429625, -3.748059807439805, 3.984965736343885, 1.0444156416080188,
        -1.1840985681379486, 0.44991777015678036,
    ),
    7: (
        227.51530596268069, 166.64802246760974, 43.26514588452621, 3.623090061341016, 3.572674832938798,
        -2.7435563656033675, 1.4514535402547504, -299.1862480282521, -243.04074536874478,
        -48.77710407803787, -2.0386719057419342, 1.673560239861085, -1.0873740320571061,
        0.9019382492960993, 93.0765028974353, -23.881631056281144, -39.278880730813846, -14.38891568549108,
        3.5104383993993613, -4.8632848855661805, 2.2464827295912397, 74.6783322350227, 87.40858897990081,
        4.024158737379998, -3.714806315158364, -3.4300939859823174, 2.6966048097653124,
        -0.9386927436075462, -58.356528851906575, 10.06877395780018, 30.36638884256667, 1.020020865184866,
        0.11241750037842496, -1.8906408310003777, 0.9716486393831483, -3.007390169451292,
        -11.015866078765772, 1.4877994561316563, 2.1303881595592826, -1.8161410868175656,
        1.134325587895161, -0.41469904594330353, 8.441963188321084, 0.650525274057515, -6.9406707303698765,
        3.2050475255978985, -1.0712809435464785, 0.3548507491216222, -0.09198549132786554,
    ),
}
# fmt: on


# Tuples, and a type of their own: so compilers know how many stages there are, and unroll loops over them.
_NODES = {s: namedtuple(f"Nodes{s}", [f"c{i}" for i in range(s)]) for s in NODES}


class RadauIIA(NamedTuple):
    """A Radau IIA method with s = 2 k + 1 stages, with the transformation that uncouples its Newton systems.

    Attributes
    ----------
    a : ndarray, shape (s, s)
        Butcher coefficients; the last row is also the weights.
    inverse : ndarray, shape (s, s)
        a⁻¹.
    c : tuple of s floats
        Nodes.
    to_stages, from_stages : ndarray, shape (s, s)
        T and its inverse, where T⁻¹ a⁻¹ T is block diagonal: μ, then [[Re ν, -Im ν], [Im ν, Re ν]] for every ν.
    mu : float
        The real eigenvalue of a⁻¹.
    nu : ndarray of complex, shape (k,)
        One of every complex pair.
    inverse_squares : ndarray, shape (k + 1,)
        1 / μ², 1 / |ν|².
    error, error_a : ndarray, shape (s,)
        Weights e of the error estimate in terms of stage increments, and eᵀa.
    amplification : float
        The largest entry of T⁻¹, which enlarges round-off.
    rows : ndarray, shape (s - 1, s)
        From the stages' increments to rows 2 to s of the dense output.
    """

    a: np.ndarray
    inverse: np.ndarray
    c: tuple[float, ...]
    to_stages: np.ndarray
    from_stages: np.ndarray
    mu: float
    nu: np.ndarray
    inverse_squares: np.ndarray
    error: np.ndarray
    error_a: np.ndarray
    amplification: float
    rows: np.ndarray


@functools.cache
def radau(n_stages: int) -> RadauIIA:
    """Return the Radau IIA method with 3, 5 or 7 stages.

    Hairer, Wanner, Solving ODEs II (1996), IV.5 and IV.8; J. Comput. Appl. Math. 111 (1999) 93. The error estimate
    compares f at the start with the slope there of the collocation polynomial, as theirs does.

    Raises
    ------
    ValueError
        Where the coefficients contradict each other.
    """
    s, c = n_stages, np.array(NODES[n_stages])
    to_stages = np.array(TO_STAGES[s]).reshape(s, s)
    from_stages = np.array(FROM_STAGES[s]).reshape(s, s)
    a = _integrals(c)
    through_zero = [_lagrange(j, np.concatenate([[0.0], c])) for j in range(1, s + 1)]
    error = np.array([-polynomial.deriv()(0.0) for polynomial in through_zero])
    error[-1] = -1.0 / s
    eigenvalues = np.array([MU[s], *NU[s]])
    method = RadauIIA(
        a, np.linalg.inv(a), _NODES[s](*NODES[s]), to_stages, from_stages, MU[s], eigenvalues[1:].copy(),
        1.0 / np.abs(eigenvalues) ** 2, error, error @ a, float(np.abs(from_stages).max()),
        np.ascontiguousarray(rows_of(through_zero, s + 1)[2:]),
    )  # fmt: skip
    validate(method)
    return method


def _lagrange(j: int, nodes: np.ndarray) -> Polynomial:
    """The polynomial that is 1 at node j and 0 at the others."""
    factors = [Polynomial([-node, 1.0]) / (nodes[j] - node) for node in np.delete(nodes, j)]
    return np.prod([Polynomial([1.0]), *factors])


def _integrals(c: np.ndarray) -> np.ndarray:
    """The integrals from 0 to c_i of the polynomials that are 1 at c_j, by Gauss's rule, which is exact for them."""
    places, weights = np.polynomial.legendre.leggauss(len(c))
    a = np.zeros((len(c), len(c)))
    for i, end in enumerate(c):
        x = 0.5 * end * (1.0 + places)
        for j, node in enumerate(c):
            others = np.delete(c, j)
            values = np.prod((x[:, None] - others) / (node - others), axis=1)
            a[i, j] = 0.5 * end * (weights @ values)
    return a


def validate(method: RadauIIA) -> None:
    """Raise ValueError where the coefficients contradict each other."""
    s, c = len(method.c), np.array(method.c)
    if not np.allclose(c, _radau_nodes(s), rtol=0, atol=1e-13):
        raise ValueError(f"the nodes must be those of Radau IIA, not {c}")
    for k in range(1, s + 1):
        if not np.allclose(method.a @ c ** (k - 1), c**k / k, rtol=0, atol=1e-14):
            raise ValueError(f"the stages must integrate polynomials of degree {k - 1} exactly")
    blocks = np.zeros((s, s))
    blocks[0, 0] = method.mu
    for k, nu in enumerate(method.nu):
        i = 2 * k + 1
        blocks[i : i + 2, i : i + 2] = [[nu.real, -nu.imag], [nu.imag, nu.real]]
    size = np.abs(method.from_stages).max()
    if not np.allclose(method.from_stages @ method.to_stages, np.eye(s), rtol=0, atol=1e-14 * size):
        raise ValueError("the transformation and its inverse contradict each other")
    uncoupled = method.from_stages @ method.inverse @ method.to_stages
    if not np.allclose(uncoupled, blocks, rtol=0, atol=1e-12 * size):
        raise ValueError("the transformation does not uncouple the stages")
    for k in range(1, s + 1):
        if abs(method.error @ c**k + (k == 1)) > 1e-12:
            raise ValueError("the error estimate must vanish for polynomials that the stages reproduce")


def _radau_nodes(s: int) -> np.ndarray:
    """The roots of P_s - P_{s-1} in (0, 1]."""
    coefficients = np.zeros(s + 1)
    coefficients[s - 1], coefficients[s] = -1.0, 1.0
    return np.sort(0.5 * (1.0 + np.polynomial.legendre.legroots(coefficients).real))
