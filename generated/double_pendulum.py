"""double_pendulum: equations of motion, written by symgen 0.1.0. Do not edit.

Double pendulum released from horizontal: two point masses on massless rods, absolute angles
"""

from math import cos, sin

from numba import njit

MODEL = {
    "abi": 1,
    "generator": "symgen 0.1.0",
    "source": "sha256:5c6f03c41c7e9181e585402ad8e6934f4910a1dd969368c140c008bb76d99b3c",
    "name": "double_pendulum",
    "description": "Double pendulum released from horizontal: two point masses on massless rods, absolute angles",
    "nq": 2,
    "nv": 2,
    "nh": 0,
    "nn": 0,
    "nw": 0,
    "coordinates": [
        {"name": "theta1", "unit": "rad", "value": 1.5707963267948966, "enforced": True},
        {"name": "theta2", "unit": "rad", "value": 1.5707963267948966, "enforced": True},
    ],
    "rates": [
        {"name": "theta1", "unit": "rad/s", "value": 0.0, "enforced": True},
        {"name": "theta2", "unit": "rad/s", "value": 0.0, "enforced": True},
    ],
    "parameters": [
        {"name": "m1", "unit": "kg", "value": 1.0, "doc": ""},
        {"name": "m2", "unit": "kg", "value": 1.0, "doc": ""},
        {"name": "L1", "unit": "m", "value": 1.0, "doc": ""},
        {"name": "L2", "unit": "m", "value": 1.0, "doc": ""},
        {"name": "g", "unit": "m/s^2", "value": 9.81, "doc": ""},
    ],
    "inputs": [],
    "constants": [],
    "constraints": [],
    "outputs": [],
    "events": [],
    "bodies": [
        {"name": "bob1", "planar": True, "shape": "sphere", "sizes": 1, "mesh": ""},
        {"name": "bob2", "planar": True, "shape": "sphere", "sizes": 1, "mesh": ""},
        {"name": "rod1", "planar": True, "shape": "capsule", "sizes": 2, "mesh": ""},
        {"name": "rod2", "planar": True, "shape": "capsule", "sizes": 2, "mesh": ""},
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
        "rhs": 68,
        "mass_matrix": 17,
        "forces": 45,
        "energy": 34,
        "residual": 51,
        "residual_jacobian": 128,
        "poses": 28,
        "shapes": 0,
    },
    "run": {
        "t_end": 10.0,
        "fps": 60.0,
    },
}

@njit(error_model="numpy")
def rhs(t, y, p, out):
    """State derivative: rates, accelerations. 68 operations."""
    q_theta1 = y[0]
    q_theta2 = y[1]
    v_theta1 = y[2]
    v_theta2 = y[3]
    p_m1 = p[0]
    p_m2 = p[1]
    p_L1 = p[2]
    p_L2 = p[3]
    p_g = p[4]
    x0 = sin(q_theta1)
    x1 = cos(q_theta1)
    x2 = p_L1*(v_theta1*(v_theta1*x1))
    x3 = cos(q_theta2)
    x4 = p_m2*(x2 + p_L2*(v_theta2*(v_theta2*x3)))
    x5 = p_L1*(v_theta1*(v_theta1*x0))
    x6 = sin(q_theta2)
    x7 = p_m2*(x5 + p_L2*(v_theta2*(v_theta2*x6)))
    x8 = p_m2*p_g
    x9 = x0*(p_L1*(p_m1*x2 + x4)) - x1*(p_L1*(p_m1*x5 + x7)) + x0*(p_L1*(x8 + p_m1*p_g))
    x10 = 1.0/((p_m1 + p_m2)*(p_L1*p_L1))
    x11 = p_m2*p_L2
    x12 = x0*(p_L1*(x6*x11)) + x1*(p_L1*(x3*x11))
    x13 = x12*x10
    x14 = 1.0/(p_m2*(p_L2*p_L2) - x12*x13)*(x9*x13 - (x6*(p_L2*x4) - x3*(p_L2*x7) + x6*(p_L2*x8)))
    out[0] = v_theta1
    out[1] = v_theta2
    out[2] = -(x9*x10 + x13*x14)
    out[3] = x14


@njit(error_model="numpy")
def mass_matrix(t, y, p, out):
    """Mass matrix M, row by row. 17 operations."""
    q_theta1 = y[0]
    q_theta2 = y[1]
    p_m1 = p[0]
    p_m2 = p[1]
    p_L1 = p[2]
    p_L2 = p[3]
    x0 = p_m2*p_L2
    x1 = sin(q_theta1)*(p_L1*(sin(q_theta2)*x0)) + cos(q_theta1)*(p_L1*(cos(q_theta2)*x0))
    out[0] = (p_m1 + p_m2)*(p_L1*p_L1)
    out[1] = x1
    out[2] = x1
    out[3] = p_m2*(p_L2*p_L2)


@njit(error_model="numpy")
def forces(t, y, p, out):
    """Forces f of M a = f + G^T lambda. 45 operations."""
    q_theta1 = y[0]
    q_theta2 = y[1]
    v_theta1 = y[2]
    v_theta2 = y[3]
    p_m1 = p[0]
    p_m2 = p[1]
    p_L1 = p[2]
    p_L2 = p[3]
    p_g = p[4]
    x0 = sin(q_theta1)
    x1 = cos(q_theta1)
    x2 = p_L1*(v_theta1*(v_theta1*x1))
    x3 = cos(q_theta2)
    x4 = p_m2*(x2 + p_L2*(v_theta2*(v_theta2*x3)))
    x5 = p_L1*(v_theta1*(v_theta1*x0))
    x6 = sin(q_theta2)
    x7 = p_m2*(x5 + p_L2*(v_theta2*(v_theta2*x6)))
    x8 = p_m2*p_g
    x9 = x0*(p_L1*(p_m1*x2 + x4)) - x1*(p_L1*(p_m1*x5 + x7)) + x0*(p_L1*(x8 + p_m1*p_g))
    out[0] = -x9
    out[1] = -(x6*(p_L2*x4) - x3*(p_L2*x7) + x6*(p_L2*x8))


@njit(error_model="numpy")
def energy(t, y, p, out):
    """Kinetic and potential energy. 34 operations."""
    q_theta1 = y[0]
    q_theta2 = y[1]
    v_theta1 = y[2]
    v_theta2 = y[3]
    p_m1 = p[0]
    p_m2 = p[1]
    p_L1 = p[2]
    p_L2 = p[3]
    p_g = p[4]
    x0 = cos(q_theta1)
    x1 = p_L1*(v_theta1*x0)
    x2 = p_L1*(v_theta1*sin(q_theta1))
    x3 = cos(q_theta2)
    x4 = x1 + p_L2*(v_theta2*x3)
    x5 = x2 + p_L2*(v_theta2*sin(q_theta2))
    x6 = p_L1*x0
    out[0] = 0.5*p_m1*(x1*x1 + x2*x2) + 0.5*p_m2*(x4*x4 + x5*x5)
    out[1] = -(p_m1*(p_g*x6) + p_m2*(p_g*(x6 + p_L2*x3)))


@njit(error_model="numpy")
def residual(t, y, p, out):
    """M a - f - G^T lambda, then G a - gamma. 51 operations."""
    q_theta1 = y[0]
    q_theta2 = y[1]
    v_theta1 = y[2]
    v_theta2 = y[3]
    a_theta1 = y[4]
    a_theta2 = y[5]
    p_m1 = p[0]
    p_m2 = p[1]
    p_L1 = p[2]
    p_L2 = p[3]
    p_g = p[4]
    x0 = sin(q_theta1)
    x1 = p_m2*p_g
    x2 = cos(q_theta1)
    x3 = p_L1*(v_theta1*(v_theta1*x2) + a_theta1*x0)
    x4 = cos(q_theta2)
    x5 = sin(q_theta2)
    x6 = p_m2*(x3 + p_L2*(v_theta2*(v_theta2*x4) + a_theta2*x5))
    x7 = p_L1*(a_theta1*x2 - v_theta1*(v_theta1*x0))
    x8 = p_m2*(x7 + p_L2*(a_theta2*x4 - v_theta2*(v_theta2*x5)))
    x9 = x0*(p_L1*(x1 + p_m1*p_g)) + (x0*(p_L1*(p_m1*x3 + x6)) + x2*(p_L1*(p_m1*x7 + x8)))
    out[0] = x9
    out[1] = x5*(p_L2*x1) + (x5*(p_L2*x6) + x4*(p_L2*x8))


@njit(error_model="numpy")
def residual_jacobian(t, y, p, out):
    """Residual derivatives by q, v, a, lambda. 128 operations."""
    q_theta1 = y[0]
    q_theta2 = y[1]
    v_theta1 = y[2]
    v_theta2 = y[3]
    a_theta1 = y[4]
    a_theta2 = y[5]
    p_m1 = p[0]
    p_m2 = p[1]
    p_L1 = p[2]
    p_L2 = p[3]
    p_g = p[4]
    x0 = cos(q_theta1)
    x1 = p_m2*p_g
    x2 = v_theta1*x0
    x3 = sin(q_theta1)
    x4 = p_L1*(v_theta1*x2 + a_theta1*x3)
    x5 = p_m1*x4
    x6 = cos(q_theta2)
    x7 = v_theta2*x6
    x8 = sin(q_theta2)
    x9 = p_L2*(v_theta2*x7 + a_theta2*x8)
    x10 = p_m2*(x4 + x9)
    x11 = v_theta1*x3
    x12 = p_L1*(a_theta1*x0 - v_theta1*x11)
    x13 = p_m1*x12
    x14 = p_m2*x12
    x15 = v_theta2*x8
    x16 = p_L2*(a_theta2*x6 - v_theta2*x15)
    x17 = p_m2*(x12 + x16)
    x18 = p_m2*x4
    x19 = x0*(p_L1*(x5 + x10)) + x3*(p_L1*(x13 + x14)) - (x3*(p_L1*(x13 + x17)) + x0*(p_L1*(x5 + x18)))
    x20 = p_m2*x16
    x21 = p_m2*x9
    x22 = p_L1*(x2 + x2)
    x23 = p_m2*x22
    x24 = p_L1*(x11 + x11)
    x25 = p_m2*x24
    x26 = p_m2*(p_L2*(x7 + x7))
    x27 = p_m2*(p_L2*(x15 + x15))
    x28 = p_m2*p_L2
    x29 = x3*(p_L1*(x8*x28)) + x0*(p_L1*(x6*x28))
    x30 = x6*(p_L2*x10) + x8*(p_L2*x20) - (x8*(p_L2*x17) + x6*(p_L2*x21))
    out[0] = x0*(p_L1*(x1 + p_m1*p_g)) + x19
    out[1] = x3*(p_L1*x20) - x0*(p_L1*x21)
    out[2] = x3*(p_L1*(p_m1*x22 + x23)) - x0*(p_L1*(p_m1*x24 + x25))
    out[3] = x3*(p_L1*x26) - x0*(p_L1*x27)
    out[4] = (p_m1 + p_m2)*(p_L1*p_L1)
    out[5] = x29
    out[6] = x8*(p_L2*x14) - x6*(p_L2*x18)
    out[7] = x6*(p_L2*x1) + x30
    out[8] = x8*(p_L2*x23) - x6*(p_L2*x25)
    out[9] = x8*(p_L2*x26) - x6*(p_L2*x27)
    out[10] = x29
    out[11] = p_m2*(p_L2*p_L2)


@njit(error_model="numpy")
def poses(t, y, p, out):
    """Per body: position, rotation matrix (body to world). 28 operations."""
    q_theta1 = y[0]
    q_theta2 = y[1]
    p_L1 = p[2]
    p_L2 = p[3]
    x0 = p_L1*sin(q_theta1)
    x1 = p_L1*cos(q_theta1)
    x2 = x0 + p_L2*sin(q_theta2)
    x3 = x1 + p_L2*cos(q_theta2)
    x4 = q_theta1 + -1.5707963267948966
    x5 = cos(x4)
    x6 = sin(x4)
    x7 = q_theta2 + -1.5707963267948966
    x8 = cos(x7)
    x9 = sin(x7)
    out[0] = x0
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
    out[12] = x2
    out[13] = -x3
    out[14] = 0.0
    out[15] = 1.0
    out[16] = 0.0
    out[17] = 0.0
    out[18] = 0.0
    out[19] = 1.0
    out[20] = 0.0
    out[21] = 0.0
    out[22] = 0.0
    out[23] = 1.0
    out[24] = 0.5*x0
    out[25] = -(0.5*x1)
    out[26] = 0.0
    out[27] = x5
    out[28] = -x6
    out[29] = 0.0
    out[30] = x6
    out[31] = x5
    out[32] = 0.0
    out[33] = 0.0
    out[34] = 0.0
    out[35] = 1.0
    out[36] = 0.5*(x0 + x2)
    out[37] = -(0.5*(x1 + x3))
    out[38] = 0.0
    out[39] = x8
    out[40] = -x9
    out[41] = 0.0
    out[42] = x9
    out[43] = x8
    out[44] = 0.0
    out[45] = 0.0
    out[46] = 0.0
    out[47] = 1.0


@njit(error_model="numpy")
def shapes(t, y, p, out):
    """Sizes of the bodies' shapes. 0 operations."""
    p_L1 = p[2]
    p_L2 = p[3]
    out[0] = 0.08
    out[1] = 0.08
    out[2] = 0.02
    out[3] = p_L1
    out[4] = 0.02
    out[5] = p_L2
