"""n_pendulum: equations of motion, written by symgen 0.1.0. Do not edit.

Chain of 5 point masses on massless rods, released from horizontal
"""

from math import cos, sin

from numba import njit

MODEL = {
    "abi": 1,
    "generator": "symgen 0.1.0",
    "source": "sha256:dc224ebdd66732d3fe49e11f91bbe8c3d869c4b1084bdd044a7b521977bd2ea4",
    "name": "n_pendulum",
    "description": "Chain of 5 point masses on massless rods, released from horizontal",
    "nq": 5,
    "nv": 5,
    "nh": 0,
    "nn": 0,
    "nw": 0,
    "coordinates": [
        {"name": "theta1", "unit": "rad", "value": 1.5707963267948966, "enforced": True},
        {"name": "theta2", "unit": "rad", "value": 1.5707963267948966, "enforced": True},
        {"name": "theta3", "unit": "rad", "value": 1.5707963267948966, "enforced": True},
        {"name": "theta4", "unit": "rad", "value": 1.5707963267948966, "enforced": True},
        {"name": "theta5", "unit": "rad", "value": 1.5707963267948966, "enforced": True},
    ],
    "quaternions": [],
    "rates": [
        {"name": "theta1", "unit": "rad/s", "value": 0.0, "enforced": True},
        {"name": "theta2", "unit": "rad/s", "value": 0.0, "enforced": True},
        {"name": "theta3", "unit": "rad/s", "value": 0.0, "enforced": True},
        {"name": "theta4", "unit": "rad/s", "value": 0.0, "enforced": True},
        {"name": "theta5", "unit": "rad/s", "value": 0.0, "enforced": True},
    ],
    "parameters": [
        {"name": "m", "unit": "kg", "value": 1.0, "doc": ""},
        {"name": "L", "unit": "m", "value": 1.0, "doc": ""},
        {"name": "g", "unit": "m/s^2", "value": 9.81, "doc": ""},
    ],
    "inputs": [],
    "constants": [],
    "constraints": [],
    "outputs": [],
    "events": [],
    "bodies": [
        {"name": "bob1", "planar": True, "shape": "sphere", "sizes": 1, "mesh": ""},
        {"name": "rod1", "planar": True, "shape": "capsule", "sizes": 2, "mesh": ""},
        {"name": "bob2", "planar": True, "shape": "sphere", "sizes": 1, "mesh": ""},
        {"name": "rod2", "planar": True, "shape": "capsule", "sizes": 2, "mesh": ""},
        {"name": "bob3", "planar": True, "shape": "sphere", "sizes": 1, "mesh": ""},
        {"name": "rod3", "planar": True, "shape": "capsule", "sizes": 2, "mesh": ""},
        {"name": "bob4", "planar": True, "shape": "sphere", "sizes": 1, "mesh": ""},
        {"name": "rod4", "planar": True, "shape": "capsule", "sizes": 2, "mesh": ""},
        {"name": "bob5", "planar": True, "shape": "sphere", "sizes": 1, "mesh": ""},
        {"name": "rod5", "planar": True, "shape": "capsule", "sizes": 2, "mesh": ""},
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
        "rhs": 268,
        "mass_matrix": 66,
        "forces": 117,
        "energy": 85,
        "residual": 132,
        "residual_jacobian": 375,
        "poses": 77,
        "shapes": 0,
        "marks": 16,
        "limits": 0,
    },
    "hoisted": {
        "rhs": 23,
        "mass_matrix": 13,
        "forces": 10,
        "energy": 3,
        "residual": 10,
        "residual_jacobian": 20,
        "poses": 1,
        "marks": 2,
    },
    "run": {
        "t_end": 5.0,
        "fps": 60.0,
    },
    "limits": [
        {"name": "bodies.bob1.mass", "bound": "zero or more"},
        {"name": "bodies.rod1.shape.capsule[1]", "bound": "zero or more"},
    ],
    "subsystems": [],
    "marks": [
        {"kind": "pin", "name": "rod1_1", "body": "rod1", "numbers": 6},
        {"kind": "ground", "name": "rod1_1", "body": "", "numbers": 3},
    ],
}

@njit(error_model="numpy")
def rhs(t, y, p, out):
    """State derivative: rates, accelerations. 268 operations."""
    p_m = p[0]
    p_L = p[1]
    p_g = p[2]
    c0 = p_m + p_m
    c1 = p_m + c0
    c2 = p_m + c1
    c3 = p_L*p_L
    c4 = 1.0/((p_m + c2)*c3)
    c5 = p_m*p_g
    c6 = c5 + c5
    c7 = c5 + c6
    c8 = c5 + c7
    c9 = p_L*(c5 + c8)
    c10 = p_m*p_L
    c11 = p_L*(p_L*c2)
    c12 = c2*c3
    c13 = p_L*c8
    c14 = p_L*(p_L*c1)
    c15 = c1*c3
    c16 = p_L*c7
    c17 = p_L*(p_L*c0)
    c18 = c0*c3
    c19 = p_L*c6
    c20 = p_L*c10
    c21 = p_m*c3
    c22 = p_L*c5
    q_theta1 = y[0]
    q_theta2 = y[1]
    q_theta3 = y[2]
    q_theta4 = y[3]
    q_theta5 = y[4]
    v_theta1 = y[5]
    v_theta2 = y[6]
    v_theta3 = y[7]
    v_theta4 = y[8]
    v_theta5 = y[9]
    x0 = sin(q_theta1)
    x1 = cos(q_theta1)
    x2 = v_theta1*(v_theta1*x1)
    x3 = cos(q_theta2)
    x4 = p_L*x2 + p_L*(v_theta2*(v_theta2*x3))
    x5 = cos(q_theta3)
    x6 = x4 + p_L*(v_theta3*(v_theta3*x5))
    x7 = cos(q_theta4)
    x8 = x6 + p_L*(v_theta4*(v_theta4*x7))
    x9 = cos(q_theta5)
    x10 = x8 + p_L*(v_theta5*(v_theta5*x9))
    x11 = p_m*x8 + p_m*x10
    x12 = p_m*x6 + x11
    x13 = p_m*x4 + x12
    x14 = v_theta1*(v_theta1*x0)
    x15 = sin(q_theta2)
    x16 = p_L*x14 + p_L*(v_theta2*(v_theta2*x15))
    x17 = sin(q_theta3)
    x18 = x16 + p_L*(v_theta3*(v_theta3*x17))
    x19 = sin(q_theta4)
    x20 = x18 + p_L*(v_theta4*(v_theta4*x19))
    x21 = sin(q_theta5)
    x22 = x20 + p_L*(v_theta5*(v_theta5*x21))
    x23 = p_m*x20 + p_m*x22
    x24 = p_m*x18 + x23
    x25 = p_m*x16 + x24
    x26 = x0*c9 + (p_L*(x0*(x13 + c10*x2)) - p_L*(x1*(x25 + c10*x14)))
    x27 = c11*(x0*x15) + c11*(x1*x3)
    x28 = x27*c4
    x29 = 1.0/(c12 - x27*x28)
    x30 = x28*x26 - (x15*c13 + (p_L*(x15*x13) - p_L*(x3*x25)))
    x31 = x17*c14
    x32 = x5*c14
    x33 = x0*x31 + x1*x32
    x34 = x15*x31 + x3*x32 - x33*x28
    x35 = x34*x29
    x36 = x33*c4
    x37 = 1.0/(c15 - x33*x36 - x34*x35)
    x38 = x36*x26 - (x17*c16 + (p_L*(x17*x12) - p_L*(x5*x24))) - x35*x30
    x39 = x19*c17
    x40 = x7*c17
    x41 = x0*x39 + x1*x40
    x42 = x15*x39 + x3*x40 - x41*x28
    x43 = x17*x39 + x5*x40 - x41*x36 - x42*x35
    x44 = x43*x37
    x45 = x41*c4
    x46 = x42*x29
    x47 = 1.0/(c18 - x41*x45 - x42*x46 - x43*x44)
    x48 = x45*x26 - (x19*c19 + (p_L*(x19*x11) - p_L*(x7*x23))) - x46*x30
    x49 = x48 - x44*x38
    x50 = x21*c20
    x51 = x9*c20
    x52 = x0*x50 + x1*x51
    x53 = x15*x50 + x3*x51 - x52*x28
    x54 = x17*x50 + x5*x51 - x52*x36 - x53*x35
    x55 = x19*x50 + x7*x51 - x52*x45 - x53*x46 - x54*x44
    x56 = x55*x47
    x57 = x52*c4
    x58 = x53*x29
    x59 = x54*x37
    x60 = x57*x26 - (x21*c22 + (c10*(x21*x10) - c10*(x9*x22))) - x58*x30
    x61 = 1.0/(c21 - x52*x57 - x53*x58 - x54*x59 - x55*x56)*(x60 - x59*x38 - x56*x49)
    x62 = x47*x49 - x56*x61
    x63 = x37*x38 - x44*x62 - x59*x61
    x64 = x29*x30 - x35*x63 - x46*x62 - x58*x61
    out[0] = v_theta1
    out[1] = v_theta2
    out[2] = v_theta3
    out[3] = v_theta4
    out[4] = v_theta5
    out[5] = -(c4*x26 + x28*x64 + x36*x63 + x45*x62 + x57*x61)
    out[6] = x64
    out[7] = x63
    out[8] = x62
    out[9] = x61


@njit(error_model="numpy")
def mass_matrix(t, y, p, out):
    """Mass matrix M, row by row. 66 operations."""
    p_m = p[0]
    p_L = p[1]
    c0 = p_m + p_m
    c1 = p_m + c0
    c2 = p_m + c1
    c3 = p_L*p_L
    c4 = (p_m + c2)*c3
    c5 = p_L*(p_L*c2)
    c6 = p_L*(p_L*c1)
    c7 = p_L*(p_L*c0)
    c8 = p_L*(p_m*p_L)
    c9 = c2*c3
    c10 = c1*c3
    c11 = c0*c3
    c12 = p_m*c3
    q_theta1 = y[0]
    q_theta2 = y[1]
    q_theta3 = y[2]
    q_theta4 = y[3]
    q_theta5 = y[4]
    x0 = sin(q_theta1)
    x1 = sin(q_theta2)
    x2 = cos(q_theta1)
    x3 = cos(q_theta2)
    x4 = c5*(x0*x1) + c5*(x2*x3)
    x5 = sin(q_theta3)
    x6 = x5*c6
    x7 = cos(q_theta3)
    x8 = x7*c6
    x9 = x0*x6 + x2*x8
    x10 = sin(q_theta4)
    x11 = x10*c7
    x12 = cos(q_theta4)
    x13 = x12*c7
    x14 = x0*x11 + x2*x13
    x15 = sin(q_theta5)*c8
    x16 = cos(q_theta5)*c8
    x17 = x0*x15 + x2*x16
    x18 = x1*x6 + x3*x8
    x19 = x1*x11 + x3*x13
    x20 = x1*x15 + x3*x16
    x21 = x5*x11 + x7*x13
    x22 = x5*x15 + x7*x16
    x23 = x10*x15 + x12*x16
    out[0] = c4
    out[1] = x4
    out[2] = x9
    out[3] = x14
    out[4] = x17
    out[5] = x4
    out[6] = c9
    out[7] = x18
    out[8] = x19
    out[9] = x20
    out[10] = x9
    out[11] = x18
    out[12] = c10
    out[13] = x21
    out[14] = x22
    out[15] = x14
    out[16] = x19
    out[17] = x21
    out[18] = c11
    out[19] = x23
    out[20] = x17
    out[21] = x20
    out[22] = x22
    out[23] = x23
    out[24] = c12


@njit(error_model="numpy")
def forces(t, y, p, out):
    """Forces f of M a = f + G^T lambda. 117 operations."""
    p_m = p[0]
    p_L = p[1]
    p_g = p[2]
    c0 = p_m*p_g
    c1 = c0 + c0
    c2 = c0 + c1
    c3 = c0 + c2
    c4 = p_L*(c0 + c3)
    c5 = p_m*p_L
    c6 = p_L*c3
    c7 = p_L*c2
    c8 = p_L*c1
    c9 = p_L*c0
    q_theta1 = y[0]
    q_theta2 = y[1]
    q_theta3 = y[2]
    q_theta4 = y[3]
    q_theta5 = y[4]
    v_theta1 = y[5]
    v_theta2 = y[6]
    v_theta3 = y[7]
    v_theta4 = y[8]
    v_theta5 = y[9]
    x0 = sin(q_theta1)
    x1 = cos(q_theta1)
    x2 = v_theta1*(v_theta1*x1)
    x3 = cos(q_theta2)
    x4 = p_L*x2 + p_L*(v_theta2*(v_theta2*x3))
    x5 = cos(q_theta3)
    x6 = x4 + p_L*(v_theta3*(v_theta3*x5))
    x7 = cos(q_theta4)
    x8 = x6 + p_L*(v_theta4*(v_theta4*x7))
    x9 = cos(q_theta5)
    x10 = x8 + p_L*(v_theta5*(v_theta5*x9))
    x11 = p_m*x8 + p_m*x10
    x12 = p_m*x6 + x11
    x13 = p_m*x4 + x12
    x14 = v_theta1*(v_theta1*x0)
    x15 = sin(q_theta2)
    x16 = p_L*x14 + p_L*(v_theta2*(v_theta2*x15))
    x17 = sin(q_theta3)
    x18 = x16 + p_L*(v_theta3*(v_theta3*x17))
    x19 = sin(q_theta4)
    x20 = x18 + p_L*(v_theta4*(v_theta4*x19))
    x21 = sin(q_theta5)
    x22 = x20 + p_L*(v_theta5*(v_theta5*x21))
    x23 = p_m*x20 + p_m*x22
    x24 = p_m*x18 + x23
    x25 = p_m*x16 + x24
    x26 = -(x0*c4 + (p_L*(x0*(x13 + c5*x2)) - p_L*(x1*(x25 + c5*x14))))
    out[0] = x26
    out[1] = -(x15*c6 + (p_L*(x15*x13) - p_L*(x3*x25)))
    out[2] = -(x17*c7 + (p_L*(x17*x12) - p_L*(x5*x24)))
    out[3] = -(x19*c8 + (p_L*(x19*x11) - p_L*(x7*x23)))
    out[4] = -(x21*c9 + (c5*(x21*x10) - c5*(x9*x22)))


@njit(error_model="numpy")
def energy(t, y, p, out):
    """Kinetic and potential energy. 85 operations."""
    p_m = p[0]
    p_L = p[1]
    p_g = p[2]
    c0 = 0.5*p_m
    c1 = p_m*(p_L*p_g)
    c2 = p_m*p_g
    q_theta1 = y[0]
    q_theta2 = y[1]
    q_theta3 = y[2]
    q_theta4 = y[3]
    q_theta5 = y[4]
    v_theta1 = y[5]
    v_theta2 = y[6]
    v_theta3 = y[7]
    v_theta4 = y[8]
    v_theta5 = y[9]
    x0 = cos(q_theta1)
    x1 = p_L*(v_theta1*x0)
    x2 = p_L*(v_theta1*sin(q_theta1))
    x3 = cos(q_theta2)
    x4 = x1 + p_L*(v_theta2*x3)
    x5 = x2 + p_L*(v_theta2*sin(q_theta2))
    x6 = cos(q_theta3)
    x7 = x4 + p_L*(v_theta3*x6)
    x8 = x5 + p_L*(v_theta3*sin(q_theta3))
    x9 = cos(q_theta4)
    x10 = x7 + p_L*(v_theta4*x9)
    x11 = x8 + p_L*(v_theta4*sin(q_theta4))
    x12 = c0*(x1*x1 + x2*x2) + c0*(x4*x4 + x5*x5) + c0*(x7*x7 + x8*x8) + c0*(x10*x10 + x11*x11)
    x13 = cos(q_theta5)
    x14 = x10 + p_L*(v_theta5*x13)
    x15 = x11 + p_L*(v_theta5*sin(q_theta5))
    x16 = p_L*x0 + p_L*x3
    x17 = x16 + p_L*x6
    x18 = x17 + p_L*x9
    out[0] = x12 + c0*(x14*x14 + x15*x15)
    out[1] = -(x0*c1 + x16*c2 + x17*c2 + x18*c2 + (x18 + p_L*x13)*c2)


@njit(error_model="numpy")
def residual(t, y, p, out):
    """M a - f - G^T lambda, then G a - gamma. 132 operations."""
    p_m = p[0]
    p_L = p[1]
    p_g = p[2]
    c0 = p_m*p_g
    c1 = c0 + c0
    c2 = c0 + c1
    c3 = c0 + c2
    c4 = p_L*(c0 + c3)
    c5 = p_m*p_L
    c6 = p_L*c3
    c7 = p_L*c2
    c8 = p_L*c1
    c9 = p_L*c0
    q_theta1 = y[0]
    q_theta2 = y[1]
    q_theta3 = y[2]
    q_theta4 = y[3]
    q_theta5 = y[4]
    v_theta1 = y[5]
    v_theta2 = y[6]
    v_theta3 = y[7]
    v_theta4 = y[8]
    v_theta5 = y[9]
    a_theta1 = y[10]
    a_theta2 = y[11]
    a_theta3 = y[12]
    a_theta4 = y[13]
    a_theta5 = y[14]
    x0 = sin(q_theta1)
    x1 = cos(q_theta1)
    x2 = v_theta1*(v_theta1*x1) + a_theta1*x0
    x3 = cos(q_theta2)
    x4 = sin(q_theta2)
    x5 = p_L*x2 + p_L*(v_theta2*(v_theta2*x3) + a_theta2*x4)
    x6 = cos(q_theta3)
    x7 = sin(q_theta3)
    x8 = x5 + p_L*(v_theta3*(v_theta3*x6) + a_theta3*x7)
    x9 = cos(q_theta4)
    x10 = sin(q_theta4)
    x11 = x8 + p_L*(v_theta4*(v_theta4*x9) + a_theta4*x10)
    x12 = cos(q_theta5)
    x13 = sin(q_theta5)
    x14 = x11 + p_L*(v_theta5*(v_theta5*x12) + a_theta5*x13)
    x15 = p_m*x11 + p_m*x14
    x16 = p_m*x8 + x15
    x17 = p_m*x5 + x16
    x18 = a_theta1*x1 - v_theta1*(v_theta1*x0)
    x19 = p_L*x18 + p_L*(a_theta2*x3 - v_theta2*(v_theta2*x4))
    x20 = x19 + p_L*(a_theta3*x6 - v_theta3*(v_theta3*x7))
    x21 = x20 + p_L*(a_theta4*x9 - v_theta4*(v_theta4*x10))
    x22 = x21 + p_L*(a_theta5*x12 - v_theta5*(v_theta5*x13))
    x23 = p_m*x21 + p_m*x22
    x24 = p_m*x20 + x23
    x25 = p_m*x19 + x24
    out[0] = x0*c4 + (p_L*(x0*(x17 + c5*x2)) + p_L*(x1*(x25 + c5*x18)))
    out[1] = x4*c6 + (p_L*(x4*x17) + p_L*(x3*x25))
    out[2] = x7*c7 + (p_L*(x7*x16) + p_L*(x6*x24))
    out[3] = x10*c8 + (p_L*(x10*x15) + p_L*(x9*x23))
    out[4] = x13*c9 + (c5*(x13*x14) + c5*(x12*x22))


@njit(error_model="numpy")
def residual_jacobian(t, y, p, out):
    """Residual derivatives by q, v, a, lambda. 375 operations."""
    p_m = p[0]
    p_L = p[1]
    p_g = p[2]
    c0 = p_m*p_g
    c1 = p_m*p_L
    c2 = p_m + p_m
    c3 = p_m + c2
    c4 = p_m + c3
    c5 = p_m + c4
    c6 = p_L*c5
    c7 = p_L*c4
    c8 = p_L*c3
    c9 = p_L*c2
    c10 = p_L*p_L
    c11 = c5*c10
    c12 = p_L*c7
    c13 = p_L*c8
    c14 = p_L*c9
    c15 = p_L*c1
    c16 = c4*c10
    c17 = c3*c10
    c18 = c2*c10
    c19 = p_m*c10
    q_theta1 = y[0]
    q_theta2 = y[1]
    q_theta3 = y[2]
    q_theta4 = y[3]
    q_theta5 = y[4]
    v_theta1 = y[5]
    v_theta2 = y[6]
    v_theta3 = y[7]
    v_theta4 = y[8]
    v_theta5 = y[9]
    a_theta1 = y[10]
    a_theta2 = y[11]
    a_theta3 = y[12]
    a_theta4 = y[13]
    a_theta5 = y[14]
    x0 = cos(q_theta1)
    x1 = p_L*x0
    x2 = v_theta1*x0
    x3 = sin(q_theta1)
    x4 = v_theta1*x2 + a_theta1*x3
    x5 = p_L*x4
    x6 = cos(q_theta2)
    x7 = v_theta2*x6
    x8 = sin(q_theta2)
    x9 = v_theta2*x7 + a_theta2*x8
    x10 = p_L*x9
    x11 = x5 + x10
    x12 = cos(q_theta3)
    x13 = v_theta3*x12
    x14 = sin(q_theta3)
    x15 = v_theta3*x13 + a_theta3*x14
    x16 = p_L*x15
    x17 = x11 + x16
    x18 = cos(q_theta4)
    x19 = v_theta4*x18
    x20 = sin(q_theta4)
    x21 = v_theta4*x19 + a_theta4*x20
    x22 = p_L*x21
    x23 = x17 + x22
    x24 = cos(q_theta5)
    x25 = v_theta5*x24
    x26 = sin(q_theta5)
    x27 = v_theta5*x25 + a_theta5*x26
    x28 = p_L*x27
    x29 = c0 + p_m*(x23 + x28)
    x30 = x29 + (c0 + p_m*x23)
    x31 = c0 + p_m*x17 + x30
    x32 = c0 + p_m*x11 + x31
    x33 = p_L*x3
    x34 = v_theta1*x3
    x35 = a_theta1*x0 - v_theta1*x34
    x36 = p_L*x35
    x37 = v_theta2*x8
    x38 = a_theta2*x6 - v_theta2*x37
    x39 = p_L*x38
    x40 = x36 + x39
    x41 = v_theta3*x14
    x42 = a_theta3*x12 - v_theta3*x41
    x43 = p_L*x42
    x44 = x40 + x43
    x45 = v_theta4*x20
    x46 = a_theta4*x18 - v_theta4*x45
    x47 = p_L*x46
    x48 = x44 + x47
    x49 = v_theta5*x26
    x50 = a_theta5*x24 - v_theta5*x49
    x51 = p_L*x50
    x52 = p_m*(x48 + x51)
    x53 = p_m*x48 + x52
    x54 = p_m*x44 + x53
    x55 = p_m*x40 + x54
    x56 = x3*c6
    x57 = x0*c6
    x58 = x1*(x32 + (c0 + c1*x4)) - x33*(x55 + c1*x35) + x36*x56 - x5*x57
    x59 = c8*x42
    x60 = c8*x15
    x61 = c9*x46
    x62 = c9*x21
    x63 = c1*x50
    x64 = c1*x27
    x65 = p_L*(x2 + x2)
    x66 = p_L*(x34 + x34)
    x67 = x7 + x7
    x68 = x37 + x37
    x69 = x13 + x13
    x70 = c8*x69
    x71 = x41 + x41
    x72 = c8*x71
    x73 = x19 + x19
    x74 = c9*x73
    x75 = x45 + x45
    x76 = c9*x75
    x77 = x25 + x25
    x78 = c1*x77
    x79 = x49 + x49
    x80 = c1*x79
    x81 = c12*(x3*x8) + c12*(x0*x6)
    x82 = x14*c13
    x83 = x12*c13
    x84 = x3*x82 + x0*x83
    x85 = x20*c14
    x86 = x18*c14
    x87 = x3*x85 + x0*x86
    x88 = x26*c15
    x89 = x24*c15
    x90 = x3*x88 + x0*x89
    x91 = x8*c7
    x92 = x6*c7
    x93 = p_L*x6
    x94 = p_L*x8
    x95 = p_L*x67
    x96 = p_L*x68
    x97 = x8*x82 + x6*x83
    x98 = x8*x85 + x6*x86
    x99 = x8*x88 + x6*x89
    x100 = x14*c8
    x101 = x12*c8
    x102 = p_L*x12
    x103 = p_L*x14
    x104 = p_L*x69
    x105 = p_L*x71
    x106 = x14*x85 + x12*x86
    x107 = x14*x88 + x12*x89
    x108 = x20*c9
    x109 = x18*c9
    x110 = p_L*x18
    x111 = p_L*x20
    x112 = p_L*x73
    x113 = p_L*x75
    x114 = x20*x88 + x18*x89
    x115 = x26*c1
    x116 = x24*c1
    out[0] = x58
    out[1] = c7*(x33*x38) - c7*(x1*x9)
    out[2] = x33*x59 - x1*x60
    out[3] = x33*x61 - x1*x62
    out[4] = x33*x63 - x1*x64
    out[5] = x65*x56 - x66*x57
    out[6] = c7*(x33*x67) - c7*(x1*x68)
    out[7] = x33*x70 - x1*x72
    out[8] = x33*x74 - x1*x76
    out[9] = x33*x78 - x1*x80
    out[10] = c11
    out[11] = x81
    out[12] = x84
    out[13] = x87
    out[14] = x90
    out[15] = x36*x91 - x5*x92
    out[16] = x93*x32 - x94*x55 + x39*x91 - x10*x92
    out[17] = x94*x59 - x93*x60
    out[18] = x94*x61 - x93*x62
    out[19] = x94*x63 - x93*x64
    out[20] = x65*x91 - x66*x92
    out[21] = x95*x91 - x96*x92
    out[22] = x94*x70 - x93*x72
    out[23] = x94*x74 - x93*x76
    out[24] = x94*x78 - x93*x80
    out[25] = x81
    out[26] = c16
    out[27] = x97
    out[28] = x98
    out[29] = x99
    out[30] = x36*x100 - x5*x101
    out[31] = x39*x100 - x10*x101
    out[32] = x102*x31 - x103*x54 + x43*x100 - x16*x101
    out[33] = x103*x61 - x102*x62
    out[34] = x103*x63 - x102*x64
    out[35] = x65*x100 - x66*x101
    out[36] = x95*x100 - x96*x101
    out[37] = x104*x100 - x105*x101
    out[38] = x103*x74 - x102*x76
    out[39] = x103*x78 - x102*x80
    out[40] = x84
    out[41] = x97
    out[42] = c17
    out[43] = x106
    out[44] = x107
    out[45] = x36*x108 - x5*x109
    out[46] = x39*x108 - x10*x109
    out[47] = x43*x108 - x16*x109
    out[48] = x110*x30 - x111*x53 + x47*x108 - x22*x109
    out[49] = x111*x63 - x110*x64
    out[50] = x65*x108 - x66*x109
    out[51] = x95*x108 - x96*x109
    out[52] = x104*x108 - x105*x109
    out[53] = x112*x108 - x113*x109
    out[54] = x111*x78 - x110*x80
    out[55] = x87
    out[56] = x98
    out[57] = x106
    out[58] = c18
    out[59] = x114
    out[60] = x36*x115 - x5*x116
    out[61] = x39*x115 - x10*x116
    out[62] = x43*x115 - x16*x116
    out[63] = x47*x115 - x22*x116
    out[64] = p_L*x24*x29 - p_L*x26*x52 + x51*x115 - x28*x116
    out[65] = x65*x115 - x66*x116
    out[66] = x95*x115 - x96*x116
    out[67] = x104*x115 - x105*x116
    out[68] = x112*x115 - x113*x116
    out[69] = p_L*x77*x115 - p_L*x79*x116
    out[70] = x90
    out[71] = x99
    out[72] = x107
    out[73] = x114
    out[74] = c19


@njit(error_model="numpy")
def poses(t, y, p, out):
    """Per body: position, rotation matrix (body to world). 77 operations."""
    p_L = p[1]
    c0 = 0.5*p_L
    q_theta1 = y[0]
    q_theta2 = y[1]
    q_theta3 = y[2]
    q_theta4 = y[3]
    q_theta5 = y[4]
    x0 = sin(q_theta1)
    x1 = p_L*x0
    x2 = cos(q_theta1)
    x3 = p_L*x2
    x4 = x0*c0
    x5 = x2*c0
    x6 = q_theta1 + -1.5707963267948966
    x7 = cos(x6)
    x8 = sin(x6)
    x9 = x1 + p_L*sin(q_theta2)
    x10 = x3 + p_L*cos(q_theta2)
    x11 = 0.5*x9
    x12 = 0.5*x10
    x13 = q_theta2 + -1.5707963267948966
    x14 = cos(x13)
    x15 = sin(x13)
    x16 = x9 + p_L*sin(q_theta3)
    x17 = x10 + p_L*cos(q_theta3)
    x18 = 0.5*x16
    x19 = 0.5*x17
    x20 = q_theta3 + -1.5707963267948966
    x21 = cos(x20)
    x22 = sin(x20)
    x23 = x16 + p_L*sin(q_theta4)
    x24 = x17 + p_L*cos(q_theta4)
    x25 = 0.5*x23
    x26 = 0.5*x24
    x27 = q_theta4 + -1.5707963267948966
    x28 = cos(x27)
    x29 = sin(x27)
    x30 = x23 + p_L*sin(q_theta5)
    x31 = x24 + p_L*cos(q_theta5)
    x32 = q_theta5 + -1.5707963267948966
    x33 = cos(x32)
    x34 = sin(x32)
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
    out[15] = x7
    out[16] = -x8
    out[17] = 0.0
    out[18] = x8
    out[19] = x7
    out[20] = 0.0
    out[21] = 0.0
    out[22] = 0.0
    out[23] = 1.0
    out[24] = x9
    out[25] = -x10
    out[26] = 0.0
    out[27] = 1.0
    out[28] = 0.0
    out[29] = 0.0
    out[30] = 0.0
    out[31] = 1.0
    out[32] = 0.0
    out[33] = 0.0
    out[34] = 0.0
    out[35] = 1.0
    out[36] = x11 + x4
    out[37] = -(x12 + x5)
    out[38] = 0.0
    out[39] = x14
    out[40] = -x15
    out[41] = 0.0
    out[42] = x15
    out[43] = x14
    out[44] = 0.0
    out[45] = 0.0
    out[46] = 0.0
    out[47] = 1.0
    out[48] = x16
    out[49] = -x17
    out[50] = 0.0
    out[51] = 1.0
    out[52] = 0.0
    out[53] = 0.0
    out[54] = 0.0
    out[55] = 1.0
    out[56] = 0.0
    out[57] = 0.0
    out[58] = 0.0
    out[59] = 1.0
    out[60] = x11 + x18
    out[61] = -(x12 + x19)
    out[62] = 0.0
    out[63] = x21
    out[64] = -x22
    out[65] = 0.0
    out[66] = x22
    out[67] = x21
    out[68] = 0.0
    out[69] = 0.0
    out[70] = 0.0
    out[71] = 1.0
    out[72] = x23
    out[73] = -x24
    out[74] = 0.0
    out[75] = 1.0
    out[76] = 0.0
    out[77] = 0.0
    out[78] = 0.0
    out[79] = 1.0
    out[80] = 0.0
    out[81] = 0.0
    out[82] = 0.0
    out[83] = 1.0
    out[84] = x18 + x25
    out[85] = -(x19 + x26)
    out[86] = 0.0
    out[87] = x28
    out[88] = -x29
    out[89] = 0.0
    out[90] = x29
    out[91] = x28
    out[92] = 0.0
    out[93] = 0.0
    out[94] = 0.0
    out[95] = 1.0
    out[96] = x30
    out[97] = -x31
    out[98] = 0.0
    out[99] = 1.0
    out[100] = 0.0
    out[101] = 0.0
    out[102] = 0.0
    out[103] = 1.0
    out[104] = 0.0
    out[105] = 0.0
    out[106] = 0.0
    out[107] = 1.0
    out[108] = x25 + 0.5*x30
    out[109] = -(x26 + 0.5*x31)
    out[110] = 0.0
    out[111] = x33
    out[112] = -x34
    out[113] = 0.0
    out[114] = x34
    out[115] = x33
    out[116] = 0.0
    out[117] = 0.0
    out[118] = 0.0
    out[119] = 1.0


@njit(error_model="numpy")
def shapes(t, y, p, out):
    """Sizes of the bodies' shapes. 0 operations."""
    p_L = p[1]
    out[0] = 0.08
    out[1] = 0.02
    out[2] = p_L
    out[3] = 0.08
    out[4] = 0.02
    out[5] = p_L
    out[6] = 0.08
    out[7] = 0.02
    out[8] = p_L
    out[9] = 0.08
    out[10] = 0.02
    out[11] = p_L
    out[12] = 0.08
    out[13] = 0.02
    out[14] = p_L


@njit(error_model="numpy")
def marks(t, y, p, out):
    """What a picture shows besides bodies, as `marks` lists it. 16 operations."""
    p_L = p[1]
    c0 = 0.5*p_L
    c1 = -c0
    q_theta1 = y[0]
    x0 = q_theta1 + -1.5707963267948966
    out[0] = c1
    out[5] = 1.0
    out[6] = 0.5*(p_L*sin(q_theta1)) - cos(x0)*c0
    out[7] = -(0.5*(p_L*cos(q_theta1)) + sin(x0)*c0)


@njit(error_model="numpy")
def limits(t, y, p, out):
    """Numbers of parameters that have a bound. 0 operations."""
    p_m = p[0]
    p_L = p[1]
    out[0] = p_m
    out[1] = p_L
