"""pendulum_dae: equations of motion, written by symgen 0.1.0. Do not edit.

Pendulum in Cartesian coordinates: a point mass held on a circle by a constraint (dimensionless)
"""

from math import atan2, cos, sin

from numba import njit

MODEL = {
    "abi": 1,
    "generator": "symgen 0.1.0",
    "source": "sha256:f84bae4cca53dc264e9250d5e7390929dafd8ef58acae18457415dba9402642c",
    "name": "pendulum_dae",
    "description": "Pendulum in Cartesian coordinates: a point mass held on a circle by a constraint (dimensionless)",
    "nq": 2,
    "nv": 2,
    "nh": 1,
    "nn": 0,
    "nw": 0,
    "coordinates": [
        {"name": "x", "unit": "", "value": 1.0, "enforced": True},
        {"name": "y", "unit": "", "value": 0.0, "enforced": True},
    ],
    "quaternions": [],
    "rates": [
        {"name": "x", "unit": "", "value": 0.0, "enforced": True},
        {"name": "y", "unit": "", "value": 0.0, "enforced": True},
    ],
    "parameters": [
        {"name": "m", "unit": "", "value": 1.0, "doc": ""},
        {"name": "L", "unit": "", "value": 1.0, "doc": ""},
        {"name": "g", "unit": "", "value": 1.0, "doc": ""},
    ],
    "inputs": [],
    "constants": [],
    "constraints": [
        {"name": "rod", "kind": "holonomic"},
    ],
    "outputs": [],
    "events": [],
    "bodies": [
        {"name": "bob", "planar": True, "shape": "sphere", "sizes": 1, "mesh": ""},
        {"name": "rod", "planar": True, "shape": "capsule", "sizes": 2, "mesh": ""},
    ],
    "structure": {
        "conservative": True,
        "time_dependent": False,
        "constant_mass": True,
        "diagonal_mass": True,
        "velocity_dependent": False,
        "separable": False,
    },
    "operations": {
        "rhs": 23,
        "mass_matrix": 0,
        "forces": 2,
        "energy": 7,
        "residual": 22,
        "residual_jacobian": 8,
        "constraint_residual": 13,
        "constraint_jacobian": 2,
        "gamma": 6,
        "project": 30,
        "poses": 6,
        "shapes": 0,
        "marks": 0,
        "limits": 0,
    },
    "hoisted": {
        "rhs": 2,
        "forces": 1,
        "energy": 2,
        "residual": 1,
        "constraint_residual": 1,
        "project": 2,
    },
    "run": {
        "t_end": 10.0,
        "fps": 60.0,
    },
    "limits": [
        {"name": "bodies.bob.mass", "bound": "zero or more"},
        {"name": "bodies.rod.shape.capsule[1]", "bound": "zero or more"},
    ],
    "subsystems": [],
    "marks": [
        {"kind": "ground", "name": "pivot", "body": "", "numbers": 3},
    ],
}

@njit(error_model="numpy")
def rhs(t, y, p, out):
    """State derivative: rates, accelerations, multipliers, pivot ratio. 23 operations."""
    p_m = p[0]
    p_g = p[2]
    c0 = 1.0/p_m
    c1 = p_m*p_g*c0
    q_x = y[0]
    q_y = y[1]
    v_x = y[2]
    v_y = y[3]
    x0 = q_x*c0
    x1 = q_y*c0
    x2 = 1.0/(q_x*x0 + q_y*x1)*(0.5*(2.0*(v_x*v_x) + 2.0*(v_y*v_y)) - q_y*c1)
    out[0] = v_x
    out[1] = v_y
    out[2] = -(x0*x2)
    out[3] = -(c1 + x1*x2)
    out[4] = x2
    out[5] = 1.0


@njit(error_model="numpy")
def mass_matrix(t, y, p, out):
    """Mass matrix M, row by row. 0 operations."""
    p_m = p[0]
    out[0] = p_m
    out[3] = p_m


@njit(error_model="numpy")
def forces(t, y, p, out):
    """Forces f of M a = f + G^T lambda. 2 operations."""
    p_m = p[0]
    p_g = p[2]
    c0 = -(p_m*p_g)
    out[0] = 0.0
    out[1] = c0


@njit(error_model="numpy")
def energy(t, y, p, out):
    """Kinetic and potential energy. 7 operations."""
    p_m = p[0]
    p_g = p[2]
    c0 = 0.5*p_m
    c1 = p_m*p_g
    q_y = y[1]
    v_x = y[2]
    v_y = y[3]
    out[0] = c0*(v_x*v_x + v_y*v_y)
    out[1] = q_y*c1


@njit(error_model="numpy")
def residual(t, y, p, out):
    """M a - f - G^T lambda, then G a - gamma. 22 operations."""
    p_m = p[0]
    p_g = p[2]
    c0 = p_m*p_g
    q_x = y[0]
    q_y = y[1]
    v_x = y[2]
    v_y = y[3]
    a_x = y[4]
    a_y = y[5]
    lam_rod = y[6]
    x0 = 2.0*q_x
    x1 = 0.5*lam_rod
    x2 = 2.0*q_y
    out[0] = a_x*p_m + x0*x1
    out[1] = c0 + a_y*p_m + x2*x1
    out[2] = -(0.5*(2.0*(v_x*v_x) + a_x*x0 + (2.0*(v_y*v_y) + a_y*x2)))


@njit(error_model="numpy")
def residual_jacobian(t, y, p, out):
    """Residual derivatives by q, v, a, lambda. 8 operations."""
    p_m = p[0]
    q_x = y[0]
    q_y = y[1]
    v_x = y[2]
    v_y = y[3]
    a_x = y[4]
    a_y = y[5]
    lam_rod = y[6]
    out[0] = lam_rod
    out[4] = p_m
    out[6] = q_x
    out[8] = lam_rod
    out[12] = p_m
    out[13] = q_y
    out[14] = -a_x
    out[15] = -a_y
    out[16] = -(v_x + v_x)
    out[17] = -(v_y + v_y)
    out[18] = -q_x
    out[19] = -q_y


@njit(error_model="numpy")
def constraint_residual(t, y, p, out):
    """Position residuals, velocity residuals. 13 operations."""
    p_L = p[1]
    c0 = p_L*p_L
    q_x = y[0]
    q_y = y[1]
    v_x = y[2]
    v_y = y[3]
    out[0] = 0.5*(c0 - q_x*q_x - q_y*q_y)
    out[1] = -(0.5*(2.0*(q_x*v_x) + 2.0*(q_y*v_y)))


@njit(error_model="numpy")
def constraint_jacobian(t, y, p, out):
    """Constraint Jacobian G, row by row. 2 operations."""
    q_x = y[0]
    q_y = y[1]
    out[0] = -q_x
    out[1] = -q_y


@njit(error_model="numpy")
def gamma(t, y, p, out):
    """Right-hand side of G a = gamma. 6 operations."""
    v_x = y[2]
    v_y = y[3]
    out[0] = 0.5*(2.0*(v_x*v_x) + 2.0*(v_y*v_y))


@njit(error_model="numpy")
def project(t, y, p, out):
    """State moved onto the constraints, and the residuals it had. 30 operations."""
    p_m = p[0]
    p_L = p[1]
    c0 = 1.0/p_m
    c1 = p_L*p_L
    q_x = y[0]
    q_y = y[1]
    v_x = y[2]
    v_y = y[3]
    x0 = q_x*c0
    x1 = 0.5*(c1 - q_x*q_x - q_y*q_y)
    x2 = q_y*c0
    x3 = 1.0/(q_x*x0 + q_y*x2)
    x4 = x1*x3
    x5 = q_x + x0*x4
    x6 = q_y + x2*x4
    x7 = 0.5*(2.0*(v_x*x5) + 2.0*(v_y*x6))
    x8 = x3*x7
    out[0] = x5
    out[1] = x6
    out[2] = v_x - x0*x8
    out[3] = v_y - x2*x8
    out[4] = x1
    out[5] = -x7


@njit(error_model="numpy")
def poses(t, y, p, out):
    """Per body: position, rotation matrix (body to world). 6 operations."""
    q_x = y[0]
    q_y = y[1]
    x0 = atan2(q_y, q_x)
    x1 = cos(x0)
    x2 = sin(x0)
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
    out[12] = 0.5*q_x
    out[13] = 0.5*q_y
    out[14] = 0.0
    out[15] = x1
    out[16] = -x2
    out[17] = 0.0
    out[18] = x2
    out[19] = x1
    out[20] = 0.0
    out[21] = 0.0
    out[22] = 0.0
    out[23] = 1.0


@njit(error_model="numpy")
def shapes(t, y, p, out):
    """Sizes of the bodies' shapes. 0 operations."""
    p_L = p[1]
    out[0] = 0.08
    out[1] = 0.02
    out[2] = p_L


@njit(error_model="numpy")
def marks(t, y, p, out):
    """What a picture shows besides bodies, as `marks` lists it. 0 operations."""
    out[0] = 0.0


@njit(error_model="numpy")
def limits(t, y, p, out):
    """Numbers of parameters that have a bound. 0 operations."""
    p_m = p[0]
    p_L = p[1]
    out[0] = p_m
    out[1] = p_L
