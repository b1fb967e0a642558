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
        "rhs": 272,
        "mass_matrix": 70,
        "forces": 116,
        "energy": 87,
        "residual": 131,
        "residual_jacobian": 484,
        "poses": 76,
        "shapes": 0,
    },
    "run": {
        "t_end": 5.0,
        "fps": 60.0,
    },
}

@njit(error_model="numpy")
def rhs(t, y, p, out):
    """State derivative: rates, accelerations. 272 operations."""
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
    p_m = p[0]
    p_L = p[1]
    p_g = p[2]
    x0 = sin(q_theta1)
    x1 = cos(q_theta1)
    x2 = p_L*(v_theta1*(v_theta1*x1))
    x3 = cos(q_theta2)
    x4 = x2 + p_L*(v_theta2*(v_theta2*x3))
    x5 = cos(q_theta3)
    x6 = x4 + p_L*(v_theta3*(v_theta3*x5))
    x7 = cos(q_theta4)
    x8 = x6 + p_L*(v_theta4*(v_theta4*x7))
    x9 = cos(q_theta5)
    x10 = p_m*(x8 + p_L*(v_theta5*(v_theta5*x9)))
    x11 = p_m*x8 + x10
    x12 = p_m*x6 + x11
    x13 = p_m*x4 + x12
    x14 = p_L*(v_theta1*(v_theta1*x0))
    x15 = sin(q_theta2)
    x16 = x14 + p_L*(v_theta2*(v_theta2*x15))
    x17 = sin(q_theta3)
    x18 = x16 + p_L*(v_theta3*(v_theta3*x17))
    x19 = sin(q_theta4)
    x20 = x18 + p_L*(v_theta4*(v_theta4*x19))
    x21 = sin(q_theta5)
    x22 = p_m*(x20 + p_L*(v_theta5*(v_theta5*x21)))
    x23 = p_m*x20 + x22
    x24 = p_m*x18 + x23
    x25 = p_m*x16 + x24
    x26 = p_m*p_g
    x27 = x26 + x26
    x28 = x26 + x27
    x29 = x26 + x28
    x30 = x0*(p_L*(p_m*x2 + x13)) - x1*(p_L*(p_m*x14 + x25)) + x0*(p_L*(x26 + x29))
    x31 = p_L*p_L
    x32 = p_m + p_m
    x33 = p_m + x32
    x34 = p_m + x33
    x35 = 1.0/(x31*(p_m + x34))
    x36 = p_L*x34
    x37 = x0*(p_L*(x15*x36)) + x1*(p_L*(x3*x36))
    x38 = x37*x35
    x39 = 1.0/(x31*x34 - x37*x38)
    x40 = x30*x38 - (x15*(p_L*x13) - x3*(p_L*x25) + x15*(p_L*x29))
    x41 = p_L*x33
    x42 = p_L*(x17*x41)
    x43 = p_L*(x5*x41)
    x44 = x0*x42 + x1*x43
    x45 = x15*x42 + x3*x43 - x44*x38
    x46 = x45*x39
    x47 = x44*x35
    x48 = 1.0/(x31*x33 - x44*x47 - x45*x46)
    x49 = x30*x47 - (x17*(p_L*x12) - x5*(p_L*x24) + x17*(p_L*x28)) - x46*x40
    x50 = p_L*x32
    x51 = p_L*(x19*x50)
    x52 = p_L*(x7*x50)
    x53 = x0*x51 + x1*x52
    x54 = x15*x51 + x3*x52 - x53*x38
    x55 = x17*x51 + x5*x52 - x53*x47 - x54*x46
    x56 = x55*x48
    x57 = x53*x35
    x58 = x54*x39
    x59 = 1.0/(x32*x31 - x53*x57 - x54*x58 - x55*x56)
    x60 = x30*x57 - (x19*(p_L*x11) - x7*(p_L*x23) + x19*(p_L*x27)) - x58*x40
    x61 = x60 - x56*x49
    x62 = p_m*p_L
    x63 = p_L*(x21*x62)
    x64 = p_L*(x9*x62)
    x65 = x0*x63 + x1*x64
    x66 = x15*x63 + x3*x64 - x65*x38
    x67 = x17*x63 + x5*x64 - x65*x47 - x66*x46
    x68 = x19*x63 + x7*x64 - x65*x57 - x66*x58 - x67*x56
    x69 = x68*x59
    x70 = x65*x35
    x71 = x66*x39
    x72 = x67*x48
    x73 = x30*x70 - (x21*(p_L*x10) - x9*(p_L*x22) + x21*(p_L*x26)) - x71*x40
    x74 = 1.0/(p_m*x31 - x65*x70 - x66*x71 - x67*x72 - x68*x69)*(x73 - x72*x49 - x69*x61)
    x75 = x59*x61 - x69*x74
    x76 = x48*x49 - x56*x75 - x72*x74
    x77 = x39*x40 - x46*x76 - x58*x75 - x71*x74
    out[0] = v_theta1
    out[1] = v_theta2
    out[2] = v_theta3
    out[3] = v_theta4
    out[4] = v_theta5
    out[5] = -(x30*x35 + x38*x77 + x47*x76 + x57*x75 + x70*x74)
    out[6] = x77
    out[7] = x76
    out[8] = x75
    out[9] = x74


@njit(error_model="numpy")
def mass_matrix(t, y, p, out):
    """Mass matrix M, row by row. 70 operations."""
    q_theta1 = y[0]
    q_theta2 = y[1]
    q_theta3 = y[2]
    q_theta4 = y[3]
    q_theta5 = y[4]
    p_m = p[0]
    p_L = p[1]
    x0 = p_L*p_L
    x1 = p_m + p_m
    x2 = p_m + x1
    x3 = p_m + x2
    x4 = sin(q_theta1)
    x5 = sin(q_theta2)
    x6 = p_L*x3
    x7 = cos(q_theta1)
    x8 = cos(q_theta2)
    x9 = x4*(p_L*(x5*x6)) + x7*(p_L*(x8*x6))
    x10 = sin(q_theta3)
    x11 = p_L*x2
    x12 = p_L*(x10*x11)
    x13 = cos(q_theta3)
    x14 = p_L*(x13*x11)
    x15 = x4*x12 + x7*x14
    x16 = sin(q_theta4)
    x17 = p_L*x1
    x18 = p_L*(x16*x17)
    x19 = cos(q_theta4)
    x20 = p_L*(x19*x17)
    x21 = x4*x18 + x7*x20
    x22 = p_m*p_L
    x23 = p_L*(sin(q_theta5)*x22)
    x24 = p_L*(cos(q_theta5)*x22)
    x25 = x4*x23 + x7*x24
    x26 = x5*x12 + x8*x14
    x27 = x5*x18 + x8*x20
    x28 = x5*x23 + x8*x24
    x29 = x10*x18 + x13*x20
    x30 = x10*x23 + x13*x24
    x31 = x16*x23 + x19*x24
    out[0] = x0*(p_m + x3)
    out[1] = x9
    out[2] = x15
    out[3] = x21
    out[4] = x25
    out[5] = x9
    out[6] = x0*x3
    out[7] = x26
    out[8] = x27
    out[9] = x28
    out[10] = x15
    out[11] = x26
    out[12] = x0*x2
    out[13] = x29
    out[14] = x30
    out[15] = x21
    out[16] = x27
    out[17] = x29
    out[18] = x1*x0
    out[19] = x31
    out[20] = x25
    out[21] = x28
    out[22] = x30
    out[23] = x31
    out[24] = p_m*x0


@njit(error_model="numpy")
def forces(t, y, p, out):
    """Forces f of M a = f + G^T lambda. 116 operations."""
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
    p_m = p[0]
    p_L = p[1]
    p_g = p[2]
    x0 = sin(q_theta1)
    x1 = cos(q_theta1)
    x2 = p_L*(v_theta1*(v_theta1*x1))
    x3 = cos(q_theta2)
    x4 = x2 + p_L*(v_theta2*(v_theta2*x3))
    x5 = cos(q_theta3)
    x6 = x4 + p_L*(v_theta3*(v_theta3*x5))
    x7 = cos(q_theta4)
    x8 = x6 + p_L*(v_theta4*(v_theta4*x7))
    x9 = cos(q_theta5)
    x10 = p_m*(x8 + p_L*(v_theta5*(v_theta5*x9)))
    x11 = p_m*x8 + x10
    x12 = p_m*x6 + x11
    x13 = p_m*x4 + x12
    x14 = p_L*(v_theta1*(v_theta1*x0))
    x15 = sin(q_theta2)
    x16 = x14 + p_L*(v_theta2*(v_theta2*x15))
    x17 = sin(q_theta3)
    x18 = x16 + p_L*(v_theta3*(v_theta3*x17))
    x19 = sin(q_theta4)
    x20 = x18 + p_L*(v_theta4*(v_theta4*x19))
    x21 = sin(q_theta5)
    x22 = p_m*(x20 + p_L*(v_theta5*(v_theta5*x21)))
    x23 = p_m*x20 + x22
    x24 = p_m*x18 + x23
    x25 = p_m*x16 + x24
    x26 = p_m*p_g
    x27 = x26 + x26
    x28 = x26 + x27
    x29 = x26 + x28
    x30 = x0*(p_L*(p_m*x2 + x13)) - x1*(p_L*(p_m*x14 + x25)) + x0*(p_L*(x26 + x29))
    out[0] = -x30
    out[1] = -(x15*(p_L*x13) - x3*(p_L*x25) + x15*(p_L*x29))
    out[2] = -(x17*(p_L*x12) - x5*(p_L*x24) + x17*(p_L*x28))
    out[3] = -(x19*(p_L*x11) - x7*(p_L*x23) + x19*(p_L*x27))
    out[4] = -(x21*(p_L*x10) - x9*(p_L*x22) + x21*(p_L*x26))


@njit(error_model="numpy")
def energy(t, y, p, out):
    """Kinetic and potential energy. 87 operations."""
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
    p_m = p[0]
    p_L = p[1]
    p_g = p[2]
    x0 = 0.5*p_m
    x1 = cos(q_theta1)
    x2 = p_L*(v_theta1*x1)
    x3 = p_L*(v_theta1*sin(q_theta1))
    x4 = cos(q_theta2)
    x5 = x2 + p_L*(v_theta2*x4)
    x6 = x3 + p_L*(v_theta2*sin(q_theta2))
    x7 = cos(q_theta3)
    x8 = x5 + p_L*(v_theta3*x7)
    x9 = x6 + p_L*(v_theta3*sin(q_theta3))
    x10 = cos(q_theta4)
    x11 = x8 + p_L*(v_theta4*x10)
    x12 = x9 + p_L*(v_theta4*sin(q_theta4))
    x13 = x0*(x2*x2 + x3*x3) + x0*(x5*x5 + x6*x6) + x0*(x8*x8 + x9*x9) + x0*(x11*x11 + x12*x12)
    x14 = cos(q_theta5)
    x15 = x11 + p_L*(v_theta5*x14)
    x16 = x12 + p_L*(v_theta5*sin(q_theta5))
    x17 = p_L*x1
    x18 = x17 + p_L*x4
    x19 = x18 + p_L*x7
    x20 = x19 + p_L*x10
    x21 = p_m*(p_g*x17) + p_m*(p_g*x18) + p_m*(p_g*x19) + p_m*(p_g*x20)
    out[0] = x13 + x0*(x15*x15 + x16*x16)
    out[1] = -(x21 + p_m*(p_g*(x20 + p_L*x14)))


@njit(error_model="numpy")
def residual(t, y, p, out):
    """M a - f - G^T lambda, then G a - gamma. 131 operations."""
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
    p_m = p[0]
    p_L = p[1]
    p_g = p[2]
    x0 = sin(q_theta1)
    x1 = p_m*p_g
    x2 = x1 + x1
    x3 = x1 + x2
    x4 = x1 + x3
    x5 = cos(q_theta1)
    x6 = p_L*(v_theta1*(v_theta1*x5) + a_theta1*x0)
    x7 = cos(q_theta2)
    x8 = sin(q_theta2)
    x9 = x6 + p_L*(v_theta2*(v_theta2*x7) + a_theta2*x8)
    x10 = cos(q_theta3)
    x11 = sin(q_theta3)
    x12 = x9 + p_L*(v_theta3*(v_theta3*x10) + a_theta3*x11)
    x13 = cos(q_theta4)
    x14 = sin(q_theta4)
    x15 = x12 + p_L*(v_theta4*(v_theta4*x13) + a_theta4*x14)
    x16 = cos(q_theta5)
    x17 = sin(q_theta5)
    x18 = p_m*(x15 + p_L*(v_theta5*(v_theta5*x16) + a_theta5*x17))
    x19 = p_m*x15 + x18
    x20 = p_m*x12 + x19
    x21 = p_m*x9 + x20
    x22 = p_L*(a_theta1*x5 - v_theta1*(v_theta1*x0))
    x23 = x22 + p_L*(a_theta2*x7 - v_theta2*(v_theta2*x8))
    x24 = x23 + p_L*(a_theta3*x10 - v_theta3*(v_theta3*x11))
    x25 = x24 + p_L*(a_theta4*x13 - v_theta4*(v_theta4*x14))
    x26 = p_m*(x25 + p_L*(a_theta5*x16 - v_theta5*(v_theta5*x17)))
    x27 = p_m*x25 + x26
    x28 = p_m*x24 + x27
    x29 = p_m*x23 + x28
    x30 = x0*(p_L*(x1 + x4)) + (x0*(p_L*(p_m*x6 + x21)) + x5*(p_L*(p_m*x22 + x29)))
    out[0] = x30
    out[1] = x8*(p_L*x4) + (x8*(p_L*x21) + x7*(p_L*x29))
    out[2] = x11*(p_L*x3) + (x11*(p_L*x20) + x10*(p_L*x28))
    out[3] = x14*(p_L*x2) + (x14*(p_L*x19) + x13*(p_L*x27))
    out[4] = x17*(p_L*x1) + (x17*(p_L*x18) + x16*(p_L*x26))


@njit(error_model="numpy")
def residual_jacobian(t, y, p, out):
    """Residual derivatives by q, v, a, lambda. 484 operations."""
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
    p_m = p[0]
    p_L = p[1]
    p_g = p[2]
    x0 = cos(q_theta1)
    x1 = p_m*p_g
    x2 = x1 + x1
    x3 = x1 + x2
    x4 = x1 + x3
    x5 = v_theta1*x0
    x6 = sin(q_theta1)
    x7 = p_L*(v_theta1*x5 + a_theta1*x6)
    x8 = p_m*x7
    x9 = cos(q_theta2)
    x10 = v_theta2*x9
    x11 = sin(q_theta2)
    x12 = p_L*(v_theta2*x10 + a_theta2*x11)
    x13 = x7 + x12
    x14 = cos(q_theta3)
    x15 = v_theta3*x14
    x16 = sin(q_theta3)
    x17 = p_L*(v_theta3*x15 + a_theta3*x16)
    x18 = x13 + x17
    x19 = cos(q_theta4)
    x20 = v_theta4*x19
    x21 = sin(q_theta4)
    x22 = p_L*(v_theta4*x20 + a_theta4*x21)
    x23 = x18 + x22
    x24 = cos(q_theta5)
    x25 = v_theta5*x24
    x26 = sin(q_theta5)
    x27 = p_L*(v_theta5*x25 + a_theta5*x26)
    x28 = p_m*(x23 + x27)
    x29 = p_m*x23 + x28
    x30 = p_m*x18 + x29
    x31 = p_m*x13 + x30
    x32 = v_theta1*x6
    x33 = p_L*(a_theta1*x0 - v_theta1*x32)
    x34 = p_m*x33
    x35 = x34 + x34
    x36 = x34 + x35
    x37 = x34 + x36
    x38 = v_theta2*x11
    x39 = p_L*(a_theta2*x9 - v_theta2*x38)
    x40 = x33 + x39
    x41 = v_theta3*x16
    x42 = p_L*(a_theta3*x14 - v_theta3*x41)
    x43 = x40 + x42
    x44 = v_theta4*x21
    x45 = p_L*(a_theta4*x19 - v_theta4*x44)
    x46 = x43 + x45
    x47 = v_theta5*x26
    x48 = p_L*(a_theta5*x24 - v_theta5*x47)
    x49 = p_m*(x46 + x48)
    x50 = p_m*x46 + x49
    x51 = p_m*x43 + x50
    x52 = p_m*x40 + x51
    x53 = x8 + x8
    x54 = x8 + x53
    x55 = x8 + x54
    x56 = x0*(p_L*(x8 + x31)) + x6*(p_L*(x34 + x37)) - (x6*(p_L*(x34 + x52)) + x0*(p_L*(x8 + x55)))
    x57 = p_m*x39
    x58 = x57 + x57
    x59 = x57 + x58
    x60 = p_L*(x57 + x59)
    x61 = p_m*x12
    x62 = x61 + x61
    x63 = x61 + x62
    x64 = p_L*(x61 + x63)
    x65 = p_m*x42
    x66 = x65 + x65
    x67 = p_L*(x65 + x66)
    x68 = p_m*x17
    x69 = x68 + x68
    x70 = p_L*(x68 + x69)
    x71 = p_m*x45
    x72 = p_L*(x71 + x71)
    x73 = p_m*x22
    x74 = p_L*(x73 + x73)
    x75 = p_L*(p_m*x48)
    x76 = p_L*(p_m*x27)
    x77 = p_m*(p_L*(x5 + x5))
    x78 = x77 + x77
    x79 = x77 + x78
    x80 = x77 + x79
    x81 = p_m*(p_L*(x32 + x32))
    x82 = x81 + x81
    x83 = x81 + x82
    x84 = x81 + x83
    x85 = p_m*(p_L*(x10 + x10))
    x86 = x85 + x85
    x87 = x85 + x86
    x88 = p_L*(x85 + x87)
    x89 = p_m*(p_L*(x38 + x38))
    x90 = x89 + x89
    x91 = x89 + x90
    x92 = p_L*(x89 + x91)
    x93 = p_m*(p_L*(x15 + x15))
    x94 = x93 + x93
    x95 = p_L*(x93 + x94)
    x96 = p_m*(p_L*(x41 + x41))
    x97 = x96 + x96
    x98 = p_L*(x96 + x97)
    x99 = p_m*(p_L*(x20 + x20))
    x100 = p_L*(x99 + x99)
    x101 = p_m*(p_L*(x44 + x44))
    x102 = p_L*(x101 + x101)
    x103 = p_L*(p_m*(p_L*(x25 + x25)))
    x104 = p_L*(p_m*(p_L*(x47 + x47)))
    x105 = p_L*p_L
    x106 = p_m + p_m
    x107 = p_m + x106
    x108 = p_m + x107
    x109 = p_L*x108
    x110 = x6*(p_L*(x11*x109)) + x0*(p_L*(x9*x109))
    x111 = p_L*x107
    x112 = p_L*(x16*x111)
    x113 = p_L*(x14*x111)
    x114 = x6*x112 + x0*x113
    x115 = p_L*x106
    x116 = p_L*(x21*x115)
    x117 = p_L*(x19*x115)
    x118 = x6*x116 + x0*x117
    x119 = p_m*p_L
    x120 = p_L*(x26*x119)
    x121 = p_L*(x24*x119)
    x122 = x6*x120 + x0*x121
    x123 = x9*(p_L*x4) + (x9*(p_L*x31) + x11*x60 - (x11*(p_L*x52) + x9*x64))
    x124 = x11*x112 + x9*x113
    x125 = x11*x116 + x9*x117
    x126 = x11*x120 + x9*x121
    x127 = x14*(p_L*x3) + (x14*(p_L*x30) + x16*x67 - (x16*(p_L*x51) + x14*x70))
    x128 = x16*x116 + x14*x117
    x129 = x16*x120 + x14*x121
    x130 = x19*(p_L*x2) + (x19*(p_L*x29) + x21*x72 - (x21*(p_L*x50) + x19*x74))
    x131 = x21*x120 + x19*x121
    x132 = x24*(p_L*x1) + (x24*(p_L*x28) + x26*x75 - (x26*(p_L*x49) + x24*x76))
    out[0] = x0*(p_L*(x1 + x4)) + x56
    out[1] = x6*x60 - x0*x64
    out[2] = x6*x67 - x0*x70
    out[3] = x6*x72 - x0*x74
    out[4] = x6*x75 - x0*x76
    out[5] = x6*(p_L*(x77 + x80)) - x0*(p_L*(x81 + x84))
    out[6] = x6*x88 - x0*x92
    out[7] = x6*x95 - x0*x98
    out[8] = x6*x100 - x0*x102
    out[9] = x6*x103 - x0*x104
    out[10] = x105*(p_m + x108)
    out[11] = x110
    out[12] = x114
    out[13] = x118
    out[14] = x122
    out[15] = x11*(p_L*x37) - x9*(p_L*x55)
    out[16] = x123
    out[17] = x11*x67 - x9*x70
    out[18] = x11*x72 - x9*x74
    out[19] = x11*x75 - x9*x76
    out[20] = x11*(p_L*x80) - x9*(p_L*x84)
    out[21] = x11*x88 - x9*x92
    out[22] = x11*x95 - x9*x98
    out[23] = x11*x100 - x9*x102
    out[24] = x11*x103 - x9*x104
    out[25] = x110
    out[26] = x105*x108
    out[27] = x124
    out[28] = x125
    out[29] = x126
    out[30] = x16*(p_L*x36) - x14*(p_L*x54)
    out[31] = x16*(p_L*x59) - x14*(p_L*x63)
    out[32] = x127
    out[33] = x16*x72 - x14*x74
    out[34] = x16*x75 - x14*x76
    out[35] = x16*(p_L*x79) - x14*(p_L*x83)
    out[36] = x16*(p_L*x87) - x14*(p_L*x91)
    out[37] = x16*x95 - x14*x98
    out[38] = x16*x100 - x14*x102
    out[39] = x16*x103 - x14*x104
    out[40] = x114
    out[41] = x124
    out[42] = x105*x107
    out[43] = x128
    out[44] = x129
    out[45] = x21*(p_L*x35) - x19*(p_L*x53)
    out[46] = x21*(p_L*x58) - x19*(p_L*x62)
    out[47] = x21*(p_L*x66) - x19*(p_L*x69)
    out[48] = x130
    out[49] = x21*x75 - x19*x76
    out[50] = x21*(p_L*x78) - x19*(p_L*x82)
    out[51] = x21*(p_L*x86) - x19*(p_L*x90)
    out[52] = x21*(p_L*x94) - x19*(p_L*x97)
    out[53] = x21*x100 - x19*x102
    out[54] = x21*x103 - x19*x104
    out[55] = x118
    out[56] = x125
    out[57] = x128
    out[58] = x106*x105
    out[59] = x131
    out[60] = x26*(p_L*x34) - x24*(p_L*x8)
    out[61] = x26*(p_L*x57) - x24*(p_L*x61)
    out[62] = x26*(p_L*x65) - x24*(p_L*x68)
    out[63] = x26*(p_L*x71) - x24*(p_L*x73)
    out[64] = x132
    out[65] = x26*(p_L*x77) - x24*(p_L*x81)
    out[66] = x26*(p_L*x85) - x24*(p_L*x89)
    out[67] = x26*(p_L*x93) - x24*(p_L*x96)
    out[68] = x26*(p_L*x99) - x24*(p_L*x101)
    out[69] = x26*x103 - x24*x104
    out[70] = x122
    out[71] = x126
    out[72] = x129
    out[73] = x131
    out[74] = p_m*x105


@njit(error_model="numpy")
def poses(t, y, p, out):
    """Per body: position, rotation matrix (body to world). 76 operations."""
    q_theta1 = y[0]
    q_theta2 = y[1]
    q_theta3 = y[2]
    q_theta4 = y[3]
    q_theta5 = y[4]
    p_L = p[1]
    x0 = p_L*sin(q_theta1)
    x1 = p_L*cos(q_theta1)
    x2 = 0.5*x0
    x3 = 0.5*x1
    x4 = q_theta1 + -1.5707963267948966
    x5 = cos(x4)
    x6 = sin(x4)
    x7 = x0 + p_L*sin(q_theta2)
    x8 = x1 + p_L*cos(q_theta2)
    x9 = 0.5*x7
    x10 = 0.5*x8
    x11 = q_theta2 + -1.5707963267948966
    x12 = cos(x11)
    x13 = sin(x11)
    x14 = x7 + p_L*sin(q_theta3)
    x15 = x8 + p_L*cos(q_theta3)
    x16 = 0.5*x14
    x17 = 0.5*x15
    x18 = q_theta3 + -1.5707963267948966
    x19 = cos(x18)
    x20 = sin(x18)
    x21 = x14 + p_L*sin(q_theta4)
    x22 = x15 + p_L*cos(q_theta4)
    x23 = 0.5*x21
    x24 = 0.5*x22
    x25 = q_theta4 + -1.5707963267948966
    x26 = cos(x25)
    x27 = sin(x25)
    x28 = x21 + p_L*sin(q_theta5)
    x29 = x22 + p_L*cos(q_theta5)
    x30 = q_theta5 + -1.5707963267948966
    x31 = cos(x30)
    x32 = sin(x30)
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
    out[15] = x5
    out[16] = -x6
    out[17] = 0.0
    out[18] = x6
    out[19] = x5
    out[20] = 0.0
    out[21] = 0.0
    out[22] = 0.0
    out[23] = 1.0
    out[24] = x7
    out[25] = -x8
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
    out[36] = x2 + x9
    out[37] = -(x3 + x10)
    out[38] = 0.0
    out[39] = x12
    out[40] = -x13
    out[41] = 0.0
    out[42] = x13
    out[43] = x12
    out[44] = 0.0
    out[45] = 0.0
    out[46] = 0.0
    out[47] = 1.0
    out[48] = x14
    out[49] = -x15
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
    out[60] = x9 + x16
    out[61] = -(x10 + x17)
    out[62] = 0.0
    out[63] = x19
    out[64] = -x20
    out[65] = 0.0
    out[66] = x20
    out[67] = x19
    out[68] = 0.0
    out[69] = 0.0
    out[70] = 0.0
    out[71] = 1.0
    out[72] = x21
    out[73] = -x22
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
    out[84] = x16 + x23
    out[85] = -(x17 + x24)
    out[86] = 0.0
    out[87] = x26
    out[88] = -x27
    out[89] = 0.0
    out[90] = x27
    out[91] = x26
    out[92] = 0.0
    out[93] = 0.0
    out[94] = 0.0
    out[95] = 1.0
    out[96] = x28
    out[97] = -x29
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
    out[108] = x23 + 0.5*x28
    out[109] = -(x24 + 0.5*x29)
    out[110] = 0.0
    out[111] = x31
    out[112] = -x32
    out[113] = 0.0
    out[114] = x32
    out[115] = x31
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
