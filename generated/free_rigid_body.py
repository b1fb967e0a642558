"""free_rigid_body: equations of motion, written by symgen 0.1.0. Do not edit.

Free rigid body that flips over and over about its middle axis (Dzhanibekov): a unit quaternion, no forces
"""

from math import sqrt

from numba import njit

MODEL = {
    "abi": 1,
    "generator": "symgen 0.1.0",
    "source": "sha256:e49eab38fc4e1c6a5f181c64fe99ad682adf3c7e873d5a11126256eb02245560",
    "name": "free_rigid_body",
    "description": "Free rigid body that flips over and over about its middle axis (Dzhanibekov): a unit quaternion, no forces",
    "nq": 4,
    "nv": 3,
    "nh": 0,
    "nn": 0,
    "nw": 0,
    "coordinates": [
        {"name": "turn_qw", "unit": "", "value": 1.0, "enforced": False},
        {"name": "turn_qx", "unit": "", "value": 0.0, "enforced": False},
        {"name": "turn_qy", "unit": "", "value": 0.0, "enforced": False},
        {"name": "turn_qz", "unit": "", "value": 0.0, "enforced": False},
    ],
    "quaternions": [
        0,
    ],
    "rates": [
        {"name": "turn_wx", "unit": "rad/s", "value": 0.001, "enforced": True},
        {"name": "turn_wy", "unit": "rad/s", "value": 1.0, "enforced": True},
        {"name": "turn_wz", "unit": "rad/s", "value": 0.001, "enforced": True},
    ],
    "parameters": [
        {"name": "I1", "unit": "kg*m^2", "value": 1.0, "doc": ""},
        {"name": "I2", "unit": "kg*m^2", "value": 2.0, "doc": ""},
        {"name": "I3", "unit": "kg*m^2", "value": 3.0, "doc": ""},
    ],
    "inputs": [],
    "constants": [],
    "constraints": [],
    "outputs": [],
    "events": [],
    "bodies": [
        {"name": "body", "planar": False, "shape": "box", "sizes": 3, "mesh": ""},
    ],
    "structure": {
        "conservative": True,
        "time_dependent": False,
        "constant_mass": True,
        "diagonal_mass": True,
        "velocity_dependent": True,
        "separable": False,
    },
    "operations": {
        "rhs": 42,
        "mass_matrix": 0,
        "forces": 12,
        "energy": 9,
        "residual": 15,
        "residual_jacobian": 9,
        "project": 13,
        "kinematics": 13,
        "poses": 24,
        "shapes": 0,
        "limits": 0,
    },
    "hoisted": {
        "rhs": 3,
        "forces": 3,
        "residual": 3,
        "residual_jacobian": 3,
    },
    "run": {
        "t_end": 100.0,
        "fps": 30.0,
    },
    "limits": [
        {"name": "bodies.body.inertia[0]", "bound": "zero or more"},
        {"name": "bodies.body.inertia[1]", "bound": "zero or more"},
        {"name": "bodies.body.inertia[2]", "bound": "zero or more"},
        {"name": "bodies.body.inertia", "bound": "a tensor without negative moments", "numbers": 3},
    ],
    "subsystems": [],
}

@njit(error_model="numpy")
def rhs(t, y, p, out):
    """State derivative: rates, accelerations. 42 operations."""
    p_I1 = p[0]
    p_I2 = p[1]
    p_I3 = p[2]
    c0 = (p_I3 - p_I2)*(1.0/p_I1)
    c1 = (p_I1 - p_I3)*(1.0/p_I2)
    c2 = (p_I2 - p_I1)*(1.0/p_I3)
    q_turn_qw = y[0]
    q_turn_qx = y[1]
    q_turn_qy = y[2]
    q_turn_qz = y[3]
    v_turn_wx = y[4]
    v_turn_wy = y[5]
    v_turn_wz = y[6]
    x0 = 0.5*v_turn_wx
    x1 = 0.5*v_turn_wy
    x2 = 0.5*v_turn_wz
    out[0] = -(q_turn_qx*x0 + q_turn_qy*x1 + q_turn_qz*x2)
    out[1] = q_turn_qw*x0 - q_turn_qz*x1 + q_turn_qy*x2
    out[2] = q_turn_qz*x0 + q_turn_qw*x1 - q_turn_qx*x2
    out[3] = q_turn_qx*x1 - q_turn_qy*x0 + q_turn_qw*x2
    out[4] = -(v_turn_wy*v_turn_wz*c0)
    out[5] = -(v_turn_wx*v_turn_wz*c1)
    out[6] = -(v_turn_wx*v_turn_wy*c2)


@njit(error_model="numpy")
def mass_matrix(t, y, p, out):
    """Mass matrix M, row by row. 0 operations."""
    p_I1 = p[0]
    p_I2 = p[1]
    p_I3 = p[2]
    out[0] = p_I1
    out[4] = p_I2
    out[8] = p_I3


@njit(error_model="numpy")
def forces(t, y, p, out):
    """Forces f of M a = f + G^T lambda. 12 operations."""
    p_I1 = p[0]
    p_I2 = p[1]
    p_I3 = p[2]
    c0 = p_I3 - p_I2
    c1 = p_I1 - p_I3
    c2 = p_I2 - p_I1
    v_turn_wx = y[4]
    v_turn_wy = y[5]
    v_turn_wz = y[6]
    out[0] = -(v_turn_wy*v_turn_wz*c0)
    out[1] = -(v_turn_wx*v_turn_wz*c1)
    out[2] = -(v_turn_wx*v_turn_wy*c2)


@njit(error_model="numpy")
def energy(t, y, p, out):
    """Kinetic and potential energy. 9 operations."""
    p_I1 = p[0]
    p_I2 = p[1]
    p_I3 = p[2]
    v_turn_wx = y[4]
    v_turn_wy = y[5]
    v_turn_wz = y[6]
    x0 = p_I1*(v_turn_wx*v_turn_wx) + p_I2*(v_turn_wy*v_turn_wy) + p_I3*(v_turn_wz*v_turn_wz)
    out[0] = 0.5*x0
    out[1] = 0.0


@njit(error_model="numpy")
def residual(t, y, p, out):
    """M a - f - G^T lambda, then G a - gamma. 15 operations."""
    p_I1 = p[0]
    p_I2 = p[1]
    p_I3 = p[2]
    c0 = p_I3 - p_I2
    c1 = p_I1 - p_I3
    c2 = p_I2 - p_I1
    v_turn_wx = y[4]
    v_turn_wy = y[5]
    v_turn_wz = y[6]
    a_turn_wx = y[7]
    a_turn_wy = y[8]
    a_turn_wz = y[9]
    out[0] = v_turn_wy*v_turn_wz*c0 + a_turn_wx*p_I1
    out[1] = v_turn_wx*v_turn_wz*c1 + a_turn_wy*p_I2
    out[2] = v_turn_wx*v_turn_wy*c2 + a_turn_wz*p_I3


@njit(error_model="numpy")
def residual_jacobian(t, y, p, out):
    """Residual derivatives by q, v, a, lambda. 9 operations."""
    p_I1 = p[0]
    p_I2 = p[1]
    p_I3 = p[2]
    c0 = p_I3 - p_I2
    c1 = p_I1 - p_I3
    c2 = p_I2 - p_I1
    v_turn_wx = y[4]
    v_turn_wy = y[5]
    v_turn_wz = y[6]
    out[5] = v_turn_wz*c0
    out[6] = v_turn_wy*c0
    out[7] = p_I1
    out[14] = v_turn_wz*c1
    out[16] = v_turn_wx*c1
    out[18] = p_I2
    out[24] = v_turn_wy*c2
    out[25] = v_turn_wx*c2
    out[29] = p_I3


@njit(error_model="numpy")
def project(t, y, p, out):
    """State with unit quaternions. 13 operations."""
    q_turn_qw = y[0]
    q_turn_qx = y[1]
    q_turn_qy = y[2]
    q_turn_qz = y[3]
    v_turn_wx = y[4]
    v_turn_wy = y[5]
    v_turn_wz = y[6]
    x0 = q_turn_qw*q_turn_qw + q_turn_qx*q_turn_qx + q_turn_qy*q_turn_qy
    x1 = 1.0/sqrt(x0 + q_turn_qz*q_turn_qz)
    out[0] = q_turn_qw*x1
    out[1] = q_turn_qx*x1
    out[2] = q_turn_qy*x1
    out[3] = q_turn_qz*x1
    out[4] = v_turn_wx
    out[5] = v_turn_wy
    out[6] = v_turn_wz


@njit(error_model="numpy")
def kinematics(t, y, p, out):
    """N of dq/dt = N v, row by row; derivative of N v by q. 13 operations."""
    q_turn_qw = y[0]
    q_turn_qx = y[1]
    q_turn_qy = y[2]
    q_turn_qz = y[3]
    v_turn_wx = y[4]
    v_turn_wy = y[5]
    v_turn_wz = y[6]
    x0 = 0.5*q_turn_qx
    x1 = -x0
    x2 = 0.5*q_turn_qy
    x3 = -x2
    x4 = 0.5*q_turn_qz
    x5 = -x4
    x6 = 0.5*q_turn_qw
    x7 = 0.5*v_turn_wx
    x8 = -x7
    x9 = 0.5*v_turn_wy
    x10 = -x9
    x11 = 0.5*v_turn_wz
    x12 = -x11
    out[0] = x1
    out[1] = x3
    out[2] = x5
    out[3] = x6
    out[4] = x5
    out[5] = x2
    out[6] = x4
    out[7] = x6
    out[8] = x1
    out[9] = x3
    out[10] = x0
    out[11] = x6
    out[13] = x8
    out[14] = x10
    out[15] = x12
    out[16] = x7
    out[18] = x11
    out[19] = x10
    out[20] = x9
    out[21] = x12
    out[23] = x7
    out[24] = x11
    out[25] = x9
    out[26] = x8


@njit(error_model="numpy")
def poses(t, y, p, out):
    """Per body: position, rotation matrix (body to world). 24 operations."""
    q_turn_qw = y[0]
    q_turn_qx = y[1]
    q_turn_qy = y[2]
    q_turn_qz = y[3]
    x0 = q_turn_qy + q_turn_qy
    x1 = q_turn_qy*x0
    x2 = q_turn_qz + q_turn_qz
    x3 = q_turn_qz*x2
    x4 = q_turn_qx + q_turn_qx
    x5 = q_turn_qy*x4
    x6 = q_turn_qw*x2
    x7 = q_turn_qz*x4
    x8 = q_turn_qw*x0
    x9 = q_turn_qx*x4
    x10 = q_turn_qz*x0
    x11 = q_turn_qw*x4
    out[0] = 0.0
    out[1] = 0.0
    out[2] = 0.0
    out[3] = 1.0 - (x1 + x3)
    out[4] = x5 - x6
    out[5] = x7 + x8
    out[6] = x5 + x6
    out[7] = 1.0 - (x9 + x3)
    out[8] = x10 - x11
    out[9] = x7 - x8
    out[10] = x10 + x11
    out[11] = 1.0 - (x9 + x1)


@njit(error_model="numpy")
def shapes(t, y, p, out):
    """Sizes of the bodies' shapes. 0 operations."""
    out[0] = 0.6
    out[1] = 0.4
    out[2] = 0.15


@njit(error_model="numpy")
def limits(t, y, p, out):
    """Numbers of parameters that have a bound. 0 operations."""
    p_I1 = p[0]
    p_I2 = p[1]
    p_I3 = p[2]
    out[0] = p_I1
    out[1] = p_I2
    out[2] = p_I3
    out[3] = p_I1
    out[4] = p_I2
    out[5] = p_I3
