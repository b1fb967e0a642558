"""stiff_spring_pendulum: equations of motion, written by symgen 0.1.0. Do not edit.

Pendulum on a stiff spring: fast bouncing on top of slow swinging (Lubich's form, dimensionless)
"""

from math import sqrt

from numba import njit

MODEL = {
    "abi": 1,
    "generator": "symgen 0.1.0",
    "source": "sha256:49d876554287600e467dc09ed75260cd3af2bb33137c79b4b73fd7628d5ad089",
    "name": "stiff_spring_pendulum",
    "description": "Pendulum on a stiff spring: fast bouncing on top of slow swinging (Lubich's form, dimensionless)",
    "nq": 2,
    "nv": 2,
    "nh": 0,
    "nn": 0,
    "nw": 0,
    "coordinates": [
        {"name": "x", "unit": "", "value": 0.999, "enforced": True},
        {"name": "y", "unit": "", "value": 0.0, "enforced": True},
    ],
    "quaternions": [],
    "rates": [
        {"name": "x", "unit": "", "value": 0.0, "enforced": True},
        {"name": "y", "unit": "", "value": 0.0, "enforced": True},
    ],
    "parameters": [
        {"name": "eps", "unit": "", "value": 0.001, "doc": "the spring's stiffness is 1/eps^2"},
    ],
    "inputs": [],
    "constants": [],
    "constraints": [],
    "outputs": [],
    "events": [],
    "bodies": [
        {"name": "bob", "planar": True, "shape": "sphere", "sizes": 1, "mesh": ""},
    ],
    "structure": {
        "conservative": True,
        "time_dependent": False,
        "constant_mass": True,
        "diagonal_mass": True,
        "velocity_dependent": False,
        "separable": True,
    },
    "operations": {
        "rhs": 17,
        "mass_matrix": 0,
        "forces": 17,
        "energy": 15,
        "residual": 17,
        "residual_jacobian": 30,
        "poses": 0,
        "shapes": 0,
        "marks": 0,
    },
    "hoisted": {
        "rhs": 1,
        "forces": 1,
        "energy": 1,
        "residual": 1,
        "residual_jacobian": 2,
    },
    "run": {
        "t_end": 10.0,
        "method": "dop853",
        "fps": 60.0,
    },
    "subsystems": [],
    "marks": [
        {"kind": "spring", "name": "spring", "body": "", "numbers": 6, "moves": True},
        {"kind": "ground", "name": "ceiling", "body": "", "numbers": 3},
    ],
}

@njit(error_model="numpy")
def rhs(t, y, p, out):
    """State derivative: rates, accelerations. 17 operations."""
    p_eps = p[0]
    c0 = 1.0/(p_eps*p_eps)
    q_x = y[0]
    q_y = y[1]
    v_x = y[2]
    v_y = y[3]
    x0 = sqrt(q_x*q_x + q_y*q_y)
    x1 = c0*((x0 + -1.0)*(0.5/x0))
    out[0] = v_x
    out[1] = v_y
    out[2] = -(2.0*(q_x*x1))
    out[3] = -(1.0 + 2.0*(q_y*x1))


@njit(error_model="numpy")
def mass_matrix(t, y, p, out):
    """Mass matrix M, row by row. 0 operations."""
    out[0] = 1.0
    out[3] = 1.0


@njit(error_model="numpy")
def forces(t, y, p, out):
    """Forces f of M a = f + G^T lambda. 17 operations."""
    p_eps = p[0]
    c0 = 1.0/(p_eps*p_eps)
    q_x = y[0]
    q_y = y[1]
    x0 = sqrt(q_x*q_x + q_y*q_y)
    x1 = c0*((x0 + -1.0)*(0.5/x0))
    out[0] = -(2.0*(q_x*x1))
    out[1] = -(1.0 + 2.0*(q_y*x1))


@njit(error_model="numpy")
def energy(t, y, p, out):
    """Kinetic and potential energy. 15 operations."""
    p_eps = p[0]
    c0 = 0.5*(1.0/(p_eps*p_eps))
    q_x = y[0]
    q_y = y[1]
    v_x = y[2]
    v_y = y[3]
    x0 = sqrt(q_x*q_x + q_y*q_y) + -1.0
    out[0] = 0.5*(v_x*v_x + v_y*v_y)
    out[1] = q_y + x0*x0*c0


@njit(error_model="numpy")
def residual(t, y, p, out):
    """M a - f - G^T lambda, then G a - gamma. 17 operations."""
    p_eps = p[0]
    c0 = 1.0/(p_eps*p_eps)
    q_x = y[0]
    q_y = y[1]
    a_x = y[4]
    a_y = y[5]
    x0 = sqrt(q_x*q_x + q_y*q_y)
    x1 = c0*((x0 + -1.0)*(0.5/x0))
    out[0] = a_x + 2.0*(q_x*x1)
    out[1] = a_y + (1.0 + 2.0*(q_y*x1))


@njit(error_model="numpy")
def residual_jacobian(t, y, p, out):
    """Residual derivatives by q, v, a, lambda. 30 operations."""
    p_eps = p[0]
    c0 = 1.0/(p_eps*p_eps)
    c1 = 0.5*c0
    q_x = y[0]
    q_y = y[1]
    x0 = sqrt(q_x*q_x + q_y*q_y)
    x1 = 2.0*(x0 + -1.0)
    x2 = 0.5/x0
    x3 = c0*(x1*x2)
    x4 = 2.0*q_x
    x5 = x2*x4
    x6 = c0*x2 - c1*(x1*(x2*(1.0/x0)))
    x7 = x4*x6
    x8 = 2.0*q_y
    x9 = x2*x8
    x10 = x8*x6
    out[0] = x3 + x5*x7
    out[1] = x9*x7
    out[4] = 1.0
    out[6] = x5*x10
    out[7] = x3 + x9*x10
    out[11] = 1.0


@njit(error_model="numpy")
def poses(t, y, p, out):
    """Per body: position, rotation matrix (body to world). 0 operations."""
    q_x = y[0]
    q_y = y[1]
    out[0] = q_x
    out[1] = q_y
    out[2] = 0.0
    out[3] = 1.0
    out[4] = 0.0
    out[5] = 0.0
    out[6] = 0.0
    out[7] = 1.0
    out[8] = 0.0
    out[9] = 0.0
    out[10] = 0.0
    out[11] = 1.0


@njit(error_model="numpy")
def shapes(t, y, p, out):
    """Sizes of the bodies' shapes. 0 operations."""
    out[0] = 0.08


@njit(error_model="numpy")
def marks(t, y, p, out):
    """What a picture shows besides bodies, as `marks` lists it. 0 operations."""
    q_x = y[0]
    q_y = y[1]
    out[3] = q_x
    out[4] = q_y
