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
    "quaternions": [],
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
        "mass_matrix": 16,
        "forces": 47,
        "energy": 35,
        "residual": 53,
        "residual_jacobian": 102,
        "poses": 29,
        "shapes": 0,
        "marks": 2,
        "limits": 0,
    },
    "hoisted": {
        "rhs": 8,
        "mass_matrix": 3,
        "forces": 5,
        "energy": 4,
        "residual": 5,
        "residual_jacobian": 9,
        "poses": 1,
        "marks": 1,
    },
    "run": {
        "t_end": 10.0,
        "fps": 60.0,
    },
    "limits": [
        {"name": "bodies.bob1.mass", "bound": "zero or more"},
        {"name": "bodies.bob2.mass", "bound": "zero or more"},
        {"name": "bodies.rod1.shape.capsule[1]", "bound": "zero or more"},
        {"name": "bodies.rod2.shape.capsule[1]", "bound": "zero or more"},
    ],
    "subsystems": [],
    "marks": [
        {"kind": "pin", "name": "rod1_1", "body": "rod1", "numbers": 6},
        {"kind": "ground", "name": "rod1_1", "body": "", "numbers": 3},
    ],
}

@njit(error_model="numpy")
def rhs(t, y, p, out):
    """State derivative: rates, accelerations. 68 operations."""
    p_m1 = p[0]
    p_m2 = p[1]
    p_L1 = p[2]
    p_L2 = p[3]
    p_g = p[4]
    c0 = 1.0/((p_m1 + p_m2)*(p_L1*p_L1))
    c1 = p_m2*p_g
    c2 = p_L1*(c1 + p_m1*p_g)
    c3 = p_m1*p_L1
    c4 = p_m2*p_L2
    c5 = p_L1*c4
    c6 = p_m2*(p_L2*p_L2)
    c7 = p_L2*c1
    q_theta1 = y[0]
    q_theta2 = y[1]
    v_theta1 = y[2]
    v_theta2 = y[3]
    x0 = sin(q_theta1)
    x1 = cos(q_theta1)
    x2 = v_theta1*(v_theta1*x1)
    x3 = cos(q_theta2)
    x4 = p_L1*x2 + p_L2*(v_theta2*(v_theta2*x3))
    x5 = v_theta1*(v_theta1*x0)
    x6 = sin(q_theta2)
    x7 = p_L1*x5 + p_L2*(v_theta2*(v_theta2*x6))
    x8 = x0*c2 + (p_L1*(x0*(p_m2*x4 + x2*c3)) - p_L1*(x1*(p_m2*x7 + x5*c3)))
    x9 = c5*(x0*x6) + c5*(x1*x3)
    x10 = x9*c0
    x11 = 1.0/(c6 - x9*x10)*(x10*x8 - (x6*c7 + (c4*(x6*x4) - c4*(x3*x7))))
    out[0] = v_theta1
    out[1] = v_theta2
    out[2] = -(c0*x8 + x10*x11)
    out[3] = x11


@njit(error_model="numpy")
def mass_matrix(t, y, p, out):
    """Mass matrix M, row by row. 16 operations."""
    p_m1 = p[0]
    p_m2 = p[1]
    p_L1 = p[2]
    p_L2 = p[3]
    c0 = (p_m1 + p_m2)*(p_L1*p_L1)
    c1 = p_L1*(p_m2*p_L2)
    c2 = p_m2*(p_L2*p_L2)
    q_theta1 = y[0]
    q_theta2 = y[1]
    x0 = c1*(sin(q_theta1)*sin(q_theta2)) + c1*(cos(q_theta1)*cos(q_theta2))
    out[0] = c0
    out[1] = x0
    out[2] = x0
    out[3] = c2


@njit(error_model="numpy")
def forces(t, y, p, out):
    """Forces f of M a = f + G^T lambda. 47 operations."""
    p_m1 = p[0]
    p_m2 = p[1]
    p_L1 = p[2]
    p_L2 = p[3]
    p_g = p[4]
    c0 = p_m2*p_g
    c1 = p_L1*(c0 + p_m1*p_g)
    c2 = p_m1*p_L1
    c3 = p_L2*c0
    c4 = p_m2*p_L2
    q_theta1 = y[0]
    q_theta2 = y[1]
    v_theta1 = y[2]
    v_theta2 = y[3]
    x0 = sin(q_theta1)
    x1 = cos(q_theta1)
    x2 = v_theta1*(v_theta1*x1)
    x3 = cos(q_theta2)
    x4 = p_L1*x2 + p_L2*(v_theta2*(v_theta2*x3))
    x5 = v_theta1*(v_theta1*x0)
    x6 = sin(q_theta2)
    x7 = p_L1*x5 + p_L2*(v_theta2*(v_theta2*x6))
    x8 = x0*c1 + (p_L1*(x0*(p_m2*x4 + x2*c2)) - p_L1*(x1*(p_m2*x7 + x5*c2)))
    out[0] = -x8
    out[1] = -(x6*c3 + (c4*(x6*x4) - c4*(x3*x7)))


@njit(error_model="numpy")
def energy(t, y, p, out):
    """Kinetic and potential energy. 35 operations."""
    p_m1 = p[0]
    p_m2 = p[1]
    p_L1 = p[2]
    p_L2 = p[3]
    p_g = p[4]
    c0 = 0.5*p_m1
    c1 = 0.5*p_m2
    c2 = p_m1*(p_L1*p_g)
    c3 = p_m2*p_g
    q_theta1 = y[0]
    q_theta2 = y[1]
    v_theta1 = y[2]
    v_theta2 = y[3]
    x0 = cos(q_theta1)
    x1 = p_L1*(v_theta1*x0)
    x2 = p_L1*(v_theta1*sin(q_theta1))
    x3 = cos(q_theta2)
    x4 = x1 + p_L2*(v_theta2*x3)
    x5 = x2 + p_L2*(v_theta2*sin(q_theta2))
    out[0] = c0*(x1*x1 + x2*x2) + c1*(x4*x4 + x5*x5)
    out[1] = -(x0*c2 + (p_L1*x0 + p_L2*x3)*c3)


@njit(error_model="numpy")
def residual(t, y, p, out):
    """M a - f - G^T lambda, then G a - gamma. 53 operations."""
    p_m1 = p[0]
    p_m2 = p[1]
    p_L1 = p[2]
    p_L2 = p[3]
    p_g = p[4]
    c0 = p_m2*p_g
    c1 = p_L1*(c0 + p_m1*p_g)
    c2 = p_m1*p_L1
    c3 = p_L2*c0
    c4 = p_m2*p_L2
    q_theta1 = y[0]
    q_theta2 = y[1]
    v_theta1 = y[2]
    v_theta2 = y[3]
    a_theta1 = y[4]
    a_theta2 = y[5]
    x0 = sin(q_theta1)
    x1 = cos(q_theta1)
    x2 = v_theta1*(v_theta1*x1) + a_theta1*x0
    x3 = cos(q_theta2)
    x4 = sin(q_theta2)
    x5 = p_L1*x2 + p_L2*(v_theta2*(v_theta2*x3) + a_theta2*x4)
    x6 = a_theta1*x1 - v_theta1*(v_theta1*x0)
    x7 = p_L1*x6 + p_L2*(a_theta2*x3 - v_theta2*(v_theta2*x4))
    x8 = x0*c1 + (p_L1*(x0*(p_m2*x5 + c2*x2)) + p_L1*(x1*(p_m2*x7 + c2*x6)))
    out[0] = x8
    out[1] = x4*c3 + (c4*(x4*x5) + c4*(x3*x7))


@njit(error_model="numpy")
def residual_jacobian(t, y, p, out):
    """Residual derivatives by q, v, a, lambda. 102 operations."""
    p_m1 = p[0]
    p_m2 = p[1]
    p_L1 = p[2]
    p_L2 = p[3]
    p_g = p[4]
    c0 = p_m2*p_g
    c1 = p_m1*p_g
    c2 = p_m1*p_L1
    c3 = p_m1 + p_m2
    c4 = p_L1*c3
    c5 = p_m2*p_L2
    c6 = c3*(p_L1*p_L1)
    c7 = p_L1*c5
    c8 = p_m2*(p_L2*p_L2)
    q_theta1 = y[0]
    q_theta2 = y[1]
    v_theta1 = y[2]
    v_theta2 = y[3]
    a_theta1 = y[4]
    a_theta2 = y[5]
    x0 = cos(q_theta1)
    x1 = p_L1*x0
    x2 = v_theta1*x0
    x3 = sin(q_theta1)
    x4 = v_theta1*x2 + a_theta1*x3
    x5 = p_L1*x4
    x6 = cos(q_theta2)
    x7 = v_theta2*x6
    x8 = sin(q_theta2)
    x9 = v_theta2*x7 + a_theta2*x8
    x10 = p_L2*x9
    x11 = c0 + p_m2*(x5 + x10)
    x12 = p_L1*x3
    x13 = v_theta1*x3
    x14 = a_theta1*x0 - v_theta1*x13
    x15 = p_L1*x14
    x16 = v_theta2*x8
    x17 = a_theta2*x6 - v_theta2*x16
    x18 = p_L2*x17
    x19 = p_m2*(x15 + x18)
    x20 = x3*c4
    x21 = x0*c4
    x22 = x1*(x11 + (c1 + c2*x4)) - x12*(x19 + c2*x14) + x15*x20 - x5*x21
    x23 = p_L1*(x2 + x2)
    x24 = p_L1*(x13 + x13)
    x25 = x7 + x7
    x26 = x16 + x16
    x27 = c7*(x3*x8) + c7*(x0*x6)
    x28 = x8*c5
    x29 = x6*c5
    out[0] = x22
    out[1] = c5*(x12*x17) - c5*(x1*x9)
    out[2] = x23*x20 - x24*x21
    out[3] = c5*(x12*x25) - c5*(x1*x26)
    out[4] = c6
    out[5] = x27
    out[6] = x15*x28 - x5*x29
    out[7] = p_L2*x6*x11 - p_L2*x8*x19 + x18*x28 - x10*x29
    out[8] = x23*x28 - x24*x29
    out[9] = p_L2*x25*x28 - p_L2*x26*x29
    out[10] = x27
    out[11] = c8


@njit(error_model="numpy")
def poses(t, y, p, out):
    """Per body: position, rotation matrix (body to world). 29 operations."""
    p_L1 = p[2]
    p_L2 = p[3]
    c0 = 0.5*p_L1
    q_theta1 = y[0]
    q_theta2 = y[1]
    x0 = sin(q_theta1)
    x1 = p_L1*x0
    x2 = cos(q_theta1)
    x3 = p_L1*x2
    x4 = x1 + p_L2*sin(q_theta2)
    x5 = x3 + p_L2*cos(q_theta2)
    x6 = q_theta1 + -1.5707963267948966
    x7 = cos(x6)
    x8 = sin(x6)
    x9 = q_theta2 + -1.5707963267948966
    x10 = cos(x9)
    x11 = sin(x9)
    out[0] = x1
    out[1] = -x3
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
    out[12] = x4
    out[13] = -x5
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
    out[24] = x0*c0
    out[25] = -(x2*c0)
    out[26] = 0.0
    out[27] = x7
    out[28] = -x8
    out[29] = 0.0
    out[30] = x8
    out[31] = x7
    out[32] = 0.0
    out[33] = 0.0
    out[34] = 0.0
    out[35] = 1.0
    out[36] = 0.5*(x1 + x4)
    out[37] = -(0.5*(x3 + x5))
    out[38] = 0.0
    out[39] = x10
    out[40] = -x11
    out[41] = 0.0
    out[42] = x11
    out[43] = x10
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


@njit(error_model="numpy")
def marks(t, y, p, out):
    """What a picture shows besides bodies, as `marks` lists it. 2 operations."""
    p_L1 = p[2]
    c0 = -(0.5*p_L1)
    out[0] = c0
    out[5] = 1.0


@njit(error_model="numpy")
def limits(t, y, p, out):
    """Numbers of parameters that have a bound. 0 operations."""
    p_m1 = p[0]
    p_m2 = p[1]
    p_L1 = p[2]
    p_L2 = p[3]
    out[0] = p_m1
    out[1] = p_m2
    out[2] = p_L1
    out[3] = p_L2
