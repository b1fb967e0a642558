"""damped_spring_pendulum: equations of motion, written by symgen 0.1.0. Do not edit.

Pendulum on a very stiff, damped spring: the bouncing dies out within a millisecond, the swinging lasts
"""

from math import sqrt

from numba import njit

MODEL = {
    "abi": 1,
    "generator": "symgen 0.1.0",
    "source": "sha256:5715889f911d8cfbd937a2b5f6f3f0b91bf9625e2dff2030587d27b619cda96f",
    "name": "damped_spring_pendulum",
    "description": "Pendulum on a very stiff, damped spring: the bouncing dies out within a millisecond, the swinging lasts",
    "nq": 2,
    "nv": 2,
    "nh": 0,
    "nn": 0,
    "nw": 1,
    "coordinates": [
        {"name": "x", "unit": "m", "value": 1.0, "enforced": True},
        {"name": "y", "unit": "m", "value": 0.0, "enforced": True},
    ],
    "quaternions": [],
    "rates": [
        {"name": "x", "unit": "m/s", "value": 0.0, "enforced": True},
        {"name": "y", "unit": "m/s", "value": 0.0, "enforced": True},
    ],
    "parameters": [
        {"name": "m", "unit": "kg", "value": 1.0, "doc": ""},
        {"name": "k", "unit": "N/m", "value": 1000000000.0, "doc": "stiffness of the spring"},
        {"name": "c", "unit": "N*s/m", "value": 20000.0, "doc": "its damping, 0.32 of critical"},
        {"name": "l0", "unit": "m", "value": 1.0, "doc": "length of the slack spring"},
        {"name": "g", "unit": "m/s^2", "value": 9.81, "doc": ""},
    ],
    "inputs": [],
    "constants": [],
    "constraints": [],
    "outputs": [
        {"name": "spring_force", "unit": "N"},
    ],
    "events": [],
    "bodies": [
        {"name": "bob", "planar": True, "shape": "sphere", "sizes": 1, "mesh": ""},
    ],
    "structure": {
        "conservative": False,
        "time_dependent": False,
        "constant_mass": True,
        "diagonal_mass": True,
        "velocity_dependent": True,
        "separable": False,
    },
    "operations": {
        "rhs": 33,
        "mass_matrix": 0,
        "forces": 26,
        "energy": 16,
        "residual": 28,
        "residual_jacobian": 58,
        "poses": 0,
        "shapes": 0,
        "outputs": 15,
        "marks": 0,
        "limits": 0,
    },
    "hoisted": {
        "rhs": 2,
        "forces": 1,
        "energy": 3,
        "residual": 1,
    },
    "run": {
        "t_end": 2.0,
        "fps": 100.0,
    },
    "limits": [
        {"name": "bodies.bob.mass", "bound": "zero or more"},
    ],
    "subsystems": [],
    "marks": [
        {"kind": "spring", "name": "spring", "body": "", "numbers": 6, "moves": True},
        {"kind": "ground", "name": "ceiling", "body": "", "numbers": 3},
    ],
}

@njit(error_model="numpy")
def rhs(t, y, p, out):
    """State derivative: rates, accelerations, power. 33 operations."""
    p_m = p[0]
    p_k = p[1]
    p_c = p[2]
    p_l0 = p[3]
    p_g = p[4]
    c0 = 1.0/p_m
    c1 = p_m*p_g
    q_x = y[0]
    q_y = y[1]
    v_x = y[2]
    v_y = y[3]
    x0 = 2.0*q_x
    x1 = sqrt(q_x*q_x + q_y*q_y)
    x2 = 0.5/x1
    x3 = 2.0*q_y
    x4 = p_c*(x2*((v_x*x0 + v_y*x3)*x2))
    x5 = x0*x4
    x6 = p_k*((x1 - p_l0)*x2)
    x7 = x3*x4
    out[0] = v_x
    out[1] = v_y
    out[2] = -(c0*(x5 + x0*x6))
    out[3] = -(c0*(x7 + (c1 + x3*x6)))
    out[4] = -(v_x*x5 + v_y*x7)


@njit(error_model="numpy")
def mass_matrix(t, y, p, out):
    """Mass matrix M, row by row. 0 operations."""
    p_m = p[0]
    out[0] = p_m
    out[3] = p_m


@njit(error_model="numpy")
def forces(t, y, p, out):
    """Forces f of M a = f + G^T lambda. 26 operations."""
    p_m = p[0]
    p_k = p[1]
    p_c = p[2]
    p_l0 = p[3]
    p_g = p[4]
    c0 = p_m*p_g
    q_x = y[0]
    q_y = y[1]
    v_x = y[2]
    v_y = y[3]
    x0 = 2.0*q_x
    x1 = sqrt(q_x*q_x + q_y*q_y)
    x2 = 0.5/x1
    x3 = 2.0*q_y
    x4 = p_c*(x2*((v_x*x0 + v_y*x3)*x2))
    x5 = p_k*((x1 - p_l0)*x2)
    out[0] = -(x0*x4 + x0*x5)
    out[1] = -(x3*x4 + (c0 + x3*x5))


@njit(error_model="numpy")
def energy(t, y, p, out):
    """Kinetic and potential energy. 16 operations."""
    p_m = p[0]
    p_k = p[1]
    p_l0 = p[3]
    p_g = p[4]
    c0 = 0.5*p_m
    c1 = 0.5*p_k
    c2 = p_m*p_g
    q_x = y[0]
    q_y = y[1]
    v_x = y[2]
    v_y = y[3]
    x0 = sqrt(q_x*q_x + q_y*q_y) - p_l0
    out[0] = c0*(v_x*v_x + v_y*v_y)
    out[1] = x0*x0*c1 + q_y*c2


@njit(error_model="numpy")
def residual(t, y, p, out):
    """M a - f - G^T lambda, then G a - gamma. 28 operations."""
    p_m = p[0]
    p_k = p[1]
    p_c = p[2]
    p_l0 = p[3]
    p_g = p[4]
    c0 = p_m*p_g
    q_x = y[0]
    q_y = y[1]
    v_x = y[2]
    v_y = y[3]
    a_x = y[4]
    a_y = y[5]
    x0 = 2.0*q_x
    x1 = sqrt(q_x*q_x + q_y*q_y)
    x2 = 0.5/x1
    x3 = p_k*((x1 - p_l0)*x2)
    x4 = 2.0*q_y
    x5 = p_c*(x2*((v_x*x0 + v_y*x4)*x2))
    out[0] = x0*x3 + (x0*x5 + a_x*p_m)
    out[1] = c0 + x4*x3 + (x4*x5 + a_y*p_m)


@njit(error_model="numpy")
def residual_jacobian(t, y, p, out):
    """Residual derivatives by q, v, a, lambda. 58 operations."""
    p_m = p[0]
    p_k = p[1]
    p_c = p[2]
    p_l0 = p[3]
    q_x = y[0]
    q_y = y[1]
    v_x = y[2]
    v_y = y[3]
    x0 = sqrt(q_x*q_x + q_y*q_y)
    x1 = 0.5/x0
    x2 = 2.0*q_x
    x3 = 2.0*q_y
    x4 = v_x*x2 + v_y*x3
    x5 = p_c*(x4*x1) + p_k*(x0 - p_l0)
    x6 = x1*x5
    x7 = p_c*(x1*x1)
    x8 = x2*x7
    x9 = x2*x1
    x10 = p_k*x1
    x11 = x1*(1.0/x0)
    x12 = p_c*(x1*(x4*x11)) + x11*x5
    x13 = x2*x10 - x2*x12
    x14 = x3*x1
    x15 = x3*x7
    x16 = x3*x10 - x3*x12
    out[0] = 2.0*(x6 + v_x*x8) + x9*x13
    out[1] = 2.0*(v_y*x8) + x14*x13
    out[2] = x2*x8
    out[3] = x3*x8
    out[4] = p_m
    out[6] = 2.0*(v_x*x15) + x9*x16
    out[7] = 2.0*(x6 + v_y*x15) + x14*x16
    out[8] = x2*x15
    out[9] = x3*x15
    out[11] = p_m


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
def outputs(t, y, p, out):
    """Outputs. 15 operations."""
    p_k = p[1]
    p_c = p[2]
    p_l0 = p[3]
    q_x = y[0]
    q_y = y[1]
    v_x = y[2]
    v_y = y[3]
    x0 = sqrt(q_x*q_x + q_y*q_y)
    x1 = p_k*(x0 - p_l0) + p_c*(0.5/x0*(2.0*(q_x*v_x) + 2.0*(q_y*v_y)))
    out[0] = x1


@njit(error_model="numpy")
def marks(t, y, p, out):
    """What a picture shows besides bodies, as `marks` lists it. 0 operations."""
    q_x = y[0]
    q_y = y[1]
    out[3] = q_x
    out[4] = q_y


@njit(error_model="numpy")
def limits(t, y, p, out):
    """Numbers of parameters that have a bound. 0 operations."""
    p_m = p[0]
    out[0] = p_m
