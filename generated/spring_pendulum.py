"""spring_pendulum: equations of motion, written by symgen 0.1.0. Do not edit.

Pendulum on a soft spring, tuned so that it trades swinging for bouncing (2:1 resonance)
"""

from math import cos, sin

from numba import njit

MODEL = {
    "abi": 1,
    "generator": "symgen 0.1.0",
    "source": "sha256:dd2afeb4e95badcbe61d8c5aa3921343e43f2ffc4b6eb6ec012850b3b9ec9b56",
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
    "quaternions": [],
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
        {"name": "spring_force", "unit": "N"},
    ],
    "events": [],
    "bodies": [
        {"name": "bob", "planar": True, "shape": "sphere", "sizes": 1, "mesh": ""},
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
        "rhs": 53,
        "mass_matrix": 10,
        "forces": 35,
        "energy": 23,
        "residual": 41,
        "residual_jacobian": 80,
        "poses": 5,
        "shapes": 0,
        "outputs": 2,
        "marks": 5,
        "limits": 0,
    },
    "hoisted": {
        "rhs": 2,
        "forces": 1,
        "energy": 3,
        "residual": 1,
        "residual_jacobian": 1,
    },
    "run": {
        "t_end": 20.0,
        "fps": 60.0,
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
    """State derivative: rates, accelerations. 53 operations."""
    p_m = p[0]
    p_k = p[1]
    p_l0 = p[2]
    p_g = p[3]
    c0 = 1.0/p_m
    c1 = p_m*p_g
    q_r = y[0]
    q_theta = y[1]
    v_r = y[2]
    v_theta = y[3]
    x0 = sin(q_theta)
    x1 = cos(q_theta)
    x2 = v_theta*x1
    x3 = v_r*x2
    x4 = v_theta*x0
    x5 = p_m*(x3 + (x3 - q_r*(v_theta*x4)))
    x6 = v_r*x4
    x7 = p_m*(x6 + (x6 + q_r*(v_theta*x2)))
    x8 = x0*x5 - x1*x7 + (p_k*(q_r - p_l0) - x1*c1)
    x9 = q_r*p_m
    x10 = x1*(x0*x9) - x0*(x1*x9)
    x11 = x10*c0
    x12 = 1.0/(p_m*(q_r*q_r) - x10*x11)*(x11*x8 - (x0*(q_r*x7) + x1*(q_r*x5) + q_r*x0*c1))
    out[0] = v_r
    out[1] = v_theta
    out[2] = -(c0*x8 + x11*x12)
    out[3] = x12


@njit(error_model="numpy")
def mass_matrix(t, y, p, out):
    """Mass matrix M, row by row. 10 operations."""
    p_m = p[0]
    q_r = y[0]
    q_theta = y[1]
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
    """Forces f of M a = f + G^T lambda. 35 operations."""
    p_m = p[0]
    p_k = p[1]
    p_l0 = p[2]
    p_g = p[3]
    c0 = p_m*p_g
    q_r = y[0]
    q_theta = y[1]
    v_r = y[2]
    v_theta = y[3]
    x0 = sin(q_theta)
    x1 = cos(q_theta)
    x2 = v_theta*x1
    x3 = v_r*x2
    x4 = v_theta*x0
    x5 = p_m*(x3 + (x3 - q_r*(v_theta*x4)))
    x6 = v_r*x4
    x7 = p_m*(x6 + (x6 + q_r*(v_theta*x2)))
    out[0] = -(x0*x5 - x1*x7 + (p_k*(q_r - p_l0) - x1*c0))
    out[1] = -(x0*(q_r*x7) + x1*(q_r*x5) + q_r*x0*c0)


@njit(error_model="numpy")
def energy(t, y, p, out):
    """Kinetic and potential energy. 23 operations."""
    p_m = p[0]
    p_k = p[1]
    p_l0 = p[2]
    p_g = p[3]
    c0 = 0.5*p_m
    c1 = 0.5*p_k
    c2 = p_m*p_g
    q_r = y[0]
    q_theta = y[1]
    v_r = y[2]
    v_theta = y[3]
    x0 = sin(q_theta)
    x1 = cos(q_theta)
    x2 = v_r*x0 + q_r*(v_theta*x1)
    x3 = v_r*x1 - q_r*(v_theta*x0)
    x4 = q_r - p_l0
    out[0] = c0*(x2*x2 + x3*x3)
    out[1] = x4*x4*c1 - q_r*x1*c2


@njit(error_model="numpy")
def residual(t, y, p, out):
    """M a - f - G^T lambda, then G a - gamma. 41 operations."""
    p_m = p[0]
    p_k = p[1]
    p_l0 = p[2]
    p_g = p[3]
    c0 = p_m*p_g
    q_r = y[0]
    q_theta = y[1]
    v_r = y[2]
    v_theta = y[3]
    a_r = y[4]
    a_theta = y[5]
    x0 = cos(q_theta)
    x1 = sin(q_theta)
    x2 = v_theta*x1
    x3 = v_r*x2
    x4 = v_theta*x0
    x5 = p_m*(a_r*x0 - x3 - (x3 + q_r*(v_theta*x4 + a_theta*x1)))
    x6 = v_r*x4
    x7 = p_m*(x6 + a_r*x1 + (x6 + q_r*(a_theta*x0 - v_theta*x2)))
    out[0] = p_k*(q_r - p_l0) - x0*c0 + (x0*x5 + x1*x7)
    out[1] = q_r*x1*c0 + (x0*(q_r*x7) - x1*(q_r*x5))


@njit(error_model="numpy")
def residual_jacobian(t, y, p, out):
    """Residual derivatives by q, v, a, lambda. 80 operations."""
    p_m = p[0]
    p_k = p[1]
    p_g = p[3]
    c0 = p_m*p_g
    q_r = y[0]
    q_theta = y[1]
    v_r = y[2]
    v_theta = y[3]
    a_r = y[4]
    a_theta = y[5]
    x0 = sin(q_theta)
    x1 = cos(q_theta)
    x2 = v_theta*x0
    x3 = a_theta*x1 - v_theta*x2
    x4 = p_m*x3
    x5 = v_theta*x1
    x6 = v_theta*x5 + a_theta*x0
    x7 = p_m*x6
    x8 = x0*c0
    x9 = x5 + x5
    x10 = p_m*x9
    x11 = x2 + x2
    x12 = p_m*x11
    x13 = v_r*x1
    x14 = p_m*(x13 + (x13 - q_r*x11))
    x15 = v_r*x0
    x16 = p_m*(x15 + (x15 + q_r*x9))
    x17 = q_r*p_m
    x18 = x1*(x0*x17) - x0*(x1*x17)
    x19 = v_r*x5
    x20 = v_r*x2
    x21 = x1*(p_m*(x19 + a_r*x0 + (x19 + q_r*x3)) + q_r*x4) - x0*(p_m*(a_r*x1 - x20 - (x20 + q_r*x6)) - q_r*x7)
    out[0] = p_k + (x0*x4 - x1*x7)
    out[1] = x8
    out[2] = x0*x10 - x1*x12
    out[3] = x0*x14 - x1*x16
    out[4] = p_m
    out[5] = x18
    out[6] = x8 + x21
    out[7] = q_r*x1*c0
    out[8] = x0*(q_r*x12) + x1*(q_r*x10)
    out[9] = x0*(q_r*x16) + x1*(q_r*x14)
    out[10] = x18
    out[11] = p_m*(q_r*q_r)


@njit(error_model="numpy")
def poses(t, y, p, out):
    """Per body: position, rotation matrix (body to world). 5 operations."""
    q_r = y[0]
    q_theta = y[1]
    out[0] = q_r*sin(q_theta)
    out[1] = -(q_r*cos(q_theta))
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
    """Outputs. 2 operations."""
    p_k = p[1]
    p_l0 = p[2]
    q_r = y[0]
    out[0] = p_k*(q_r - p_l0)


@njit(error_model="numpy")
def marks(t, y, p, out):
    """What a picture shows besides bodies, as `marks` lists it. 5 operations."""
    q_r = y[0]
    q_theta = y[1]
    out[3] = q_r*sin(q_theta)
    out[4] = -(q_r*cos(q_theta))


@njit(error_model="numpy")
def limits(t, y, p, out):
    """Numbers of parameters that have a bound. 0 operations."""
    p_m = p[0]
    out[0] = p_m
