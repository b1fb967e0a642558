"""spring_pendulum: equations of motion, written by symgen 0.1.0. Do not edit.

Pendulum on a soft spring, tuned so that it trades swinging for bouncing (2:1 resonance)
"""

from math import cos, sin

from numba import njit

MODEL = {
    "abi": 1,
    "generator": "symgen 0.1.0",
    "source": "sha256:03f857b0d6667471c5a30e35f274d32ec16c02d0ccefb1457180abd8a9f28fdc",
    "name": "spring_pendulum",
    "description": "Pendulum on a soft spring, tuned so that it trades swinging for bouncing (2:1 resonance)",
    "nq": 2,
    "nv": 2,
    "nh": 0,
    "nn": 0,
    "nw": 0,
    "coordinates": [
        {"name": "r", "unit": "m", "value": 1.2, "enforced": True},
        {"name": "theta", "unit": "rad", "value": 0.05, "enforced": True},
    ],
    "rates": [
        {"name": "r", "unit": "m/s", "value": 0.0, "enforced": True},
        {"name": "theta", "unit": "rad/s", "value": 0.0, "enforced": True},
    ],
    "parameters": [
        {"name": "m", "unit": "kg", "value": 1.0, "doc": ""},
        {"name": "k", "unit": "N/m", "value": 39.24, "doc": "4*m*g/l with l = 1 m, the length at rest: bounces twice per swing"},
        {"name": "l0", "unit": "m", "value": 0.75, "doc": "length of the slack spring"},
        {"name": "g", "unit": "m/s^2", "value": 9.81, "doc": ""},
    ],
    "inputs": [],
    "constants": [],
    "constraints": [],
    "outputs": [
        {"name": "spring_force", "unit": ""},
    ],
    "events": [],
    "bodies": [
        {"name": "bob", "planar": True, "shape": "sphere", "sizes": 1, "mesh": ""},
        {"name": "spring", "planar": True, "shape": "cylinder", "sizes": 2, "mesh": ""},
    ],
    "structure": {
        "conservative": True,
        "time_dependent": False,
        "constant_mass": False,
        "diagonal_mass": False,
        "velocity_dependent": True,
        "separable": False,
    },
    "operations": {
        "rhs": 55,
        "mass_matrix": 10,
        "forces": 37,
        "energy": 23,
        "residual": 43,
        "residual_jacobian": 80,
        "poses": 13,
        "shapes": 0,
        "outputs": 2,
    },
    "run": {
        "t_end": 20.0,
        "fps": 60.0,
    },
}

@njit(error_model="numpy")
def rhs(t, y, p, out):
    """State derivative: rates, accelerations. 55 operations."""
    q_r = y[0]
    q_theta = y[1]
    v_r = y[2]
    v_theta = y[3]
    p_m = p[0]
    p_k = p[1]
    p_l0 = p[2]
    p_g = p[3]
    x0 = sin(q_theta)
    x1 = cos(q_theta)
    x2 = v_theta*x1
    x3 = v_r*x2
    x4 = v_theta*x0
    x5 = p_m*(x3 + (x3 - q_r*(v_theta*x4)))
    x6 = v_r*x4
    x7 = p_m*(x6 + (x6 + q_r*(v_theta*x2)))
    x8 = p_m*p_g
    x9 = x0*x5 - x1*x7 + (0.5*p_k*(2.0*(q_r - p_l0)) - x1*x8)
    x10 = 1.0/p_m
    x11 = q_r*p_m
    x12 = x1*(x0*x11) - x0*(x1*x11)
    x13 = x12*x10
    x14 = 1.0/(p_m*(q_r*q_r) - x12*x13)*(x9*x13 - (x0*(q_r*x7) + x1*(q_r*x5) + x0*(q_r*x8)))
    out[0] = v_r
    out[1] = v_theta
    out[2] = -(x9*x10 + x13*x14)
    out[3] = x14


@njit(error_model="numpy")
def mass_matrix(t, y, p, out):
    """Mass matrix M, row by row. 10 operations."""
    q_r = y[0]
    q_theta = y[1]
    p_m = p[0]
    x0 = cos(q_theta)
    x1 = sin(q_theta)
    x2 = q_r*p_m
    x3 = x0*(x1*x2) - x1*(x0*x2)
    out[0] = p_m
    out[1] = x3
    out[2] = x3
    out[3] = p_m*(q_r*q_r)


@njit(error_model="numpy")
def forces(t, y, p, out):
    """Forces f of M a = f + G^T lambda. 37 operations."""
    q_r = y[0]
    q_theta = y[1]
    v_r = y[2]
    v_theta = y[3]
    p_m = p[0]
    p_k = p[1]
    p_l0 = p[2]
    p_g = p[3]
    x0 = sin(q_theta)
    x1 = cos(q_theta)
    x2 = v_theta*x1
    x3 = v_r*x2
    x4 = v_theta*x0
    x5 = p_m*(x3 + (x3 - q_r*(v_theta*x4)))
    x6 = v_r*x4
    x7 = p_m*(x6 + (x6 + q_r*(v_theta*x2)))
    x8 = p_m*p_g
    out[0] = -(x0*x5 - x1*x7 + (0.5*p_k*(2.0*(q_r - p_l0)) - x1*x8))
    out[1] = -(x0*(q_r*x7) + x1*(q_r*x5) + x0*(q_r*x8))


@njit(error_model="numpy")
def energy(t, y, p, out):
    """Kinetic and potential energy. 23 operations."""
    q_r = y[0]
    q_theta = y[1]
    v_r = y[2]
    v_theta = y[3]
    p_m = p[0]
    p_k = p[1]
    p_l0 = p[2]
    p_g = p[3]
    x0 = sin(q_theta)
    x1 = cos(q_theta)
    x2 = v_r*x0 + q_r*(v_theta*x1)
    x3 = v_r*x1 - q_r*(v_theta*x0)
    x4 = q_r - p_l0
    out[0] = 0.5*p_m*(x2*x2 + x3*x3)
    out[1] = x4*x4*(0.5*p_k) - p_m*(p_g*(q_r*x1))


@njit(error_model="numpy")
def residual(t, y, p, out):
    """M a - f - G^T lambda, then G a - gamma. 43 operations."""
    q_r = y[0]
    q_theta = y[1]
    v_r = y[2]
    v_theta = y[3]
    a_r = y[4]
    a_theta = y[5]
    p_m = p[0]
    p_k = p[1]
    p_l0 = p[2]
    p_g = p[3]
    x0 = cos(q_theta)
    x1 = p_m*p_g
    x2 = sin(q_theta)
    x3 = v_theta*x2
    x4 = v_r*x3
    x5 = v_theta*x0
    x6 = p_m*(a_r*x0 - x4 - (x4 + q_r*(v_theta*x5 + a_theta*x2)))
    x7 = v_r*x5
    x8 = p_m*(x7 + a_r*x2 + (x7 + q_r*(a_theta*x0 - v_theta*x3)))
    out[0] = 0.5*p_k*(2.0*(q_r - p_l0)) - x0*x1 + (x0*x6 + x2*x8)
    out[1] = x2*(q_r*x1) + (x0*(q_r*x8) - x2*(q_r*x6))


@njit(error_model="numpy")
def residual_jacobian(t, y, p, out):
    """Residual derivatives by q, v, a, lambda. 80 operations."""
    q_r = y[0]
    q_theta = y[1]
    v_r = y[2]
    v_theta = y[3]
    a_r = y[4]
    a_theta = y[5]
    p_m = p[0]
    p_k = p[1]
    p_g = p[3]
    x0 = sin(q_theta)
    x1 = cos(q_theta)
    x2 = v_theta*x0
    x3 = a_theta*x1 - v_theta*x2
    x4 = p_m*x3
    x5 = v_theta*x1
    x6 = v_theta*x5 + a_theta*x0
    x7 = p_m*x6
    x8 = p_m*p_g
    x9 = x0*x8
    x10 = x5 + x5
    x11 = p_m*x10
    x12 = x2 + x2
    x13 = p_m*x12
    x14 = v_r*x1
    x15 = p_m*(x14 + (x14 - q_r*x12))
    x16 = v_r*x0
    x17 = p_m*(x16 + (x16 + q_r*x10))
    x18 = q_r*p_m
    x19 = x1*(x0*x18) - x0*(x1*x18)
    x20 = v_r*x5
    x21 = v_r*x2
    x22 = x1*(p_m*(x20 + a_r*x0 + (x20 + q_r*x3)) + q_r*x4) - x0*(p_m*(a_r*x1 - x21 - (x21 + q_r*x6)) - q_r*x7)
    out[0] = p_k + (x0*x4 - x1*x7)
    out[1] = x9
    out[2] = x0*x11 - x1*x13
    out[3] = x0*x15 - x1*x17
    out[4] = p_m
    out[5] = x19
    out[6] = x9 + x22
    out[7] = x1*(q_r*x8)
    out[8] = x0*(q_r*x13) + x1*(q_r*x11)
    out[9] = x0*(q_r*x17) + x1*(q_r*x15)
    out[10] = x19
    out[11] = p_m*(q_r*q_r)


@njit(error_model="numpy")
def poses(t, y, p, out):
    """Per body: position, rotation matrix (body to world). 13 operations."""
    q_r = y[0]
    q_theta = y[1]
    x0 = sin(q_theta)
    x1 = q_r*cos(q_theta)
    x2 = q_theta + -1.5707963267948966
    x3 = cos(x2)
    x4 = sin(x2)
    out[0] = q_r*x0
    out[1] = -x1
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
    out[12] = x0*(0.5*q_r)
    out[13] = -(0.5*x1)
    out[14] = 0.0
    out[15] = x3
    out[16] = -x4
    out[17] = 0.0
    out[18] = x4
    out[19] = x3
    out[20] = 0.0
    out[21] = 0.0
    out[22] = 0.0
    out[23] = 1.0


@njit(error_model="numpy")
def shapes(t, y, p, out):
    """Sizes of the bodies' shapes. 0 operations."""
    q_r = y[0]
    out[0] = 0.08
    out[1] = 0.02
    out[2] = q_r


@njit(error_model="numpy")
def outputs(t, y, p, out):
    """Outputs. 2 operations."""
    q_r = y[0]
    p_k = p[1]
    p_l0 = p[2]
    out[0] = p_k*(q_r - p_l0)
