"""rolling_disc: equations of motion, written by symgen 0.1.0. Do not edit.

Thin disc that rolls on a plane without slipping
"""

from math import cos, sin

from numba import njit

MODEL = {
    "abi": 1,
    "generator": "symgen 0.1.0",
    "source": "sha256:01100b22d1b8a5b459c765e0e035c704b4dbb0b9655fabe0a1b1d880cbfc4816",
    "name": "rolling_disc",
    "description": "Thin disc that rolls on a plane without slipping",
    "nq": 6,
    "nv": 6,
    "nh": 0,
    "nn": 3,
    "nw": 0,
    "coordinates": [
        {"name": "x", "unit": "m", "value": 0.0, "enforced": True},
        {"name": "y", "unit": "m", "value": 0.0, "enforced": True},
        {"name": "z", "unit": "m", "value": 0.955336489125606, "enforced": True},
        {"name": "yaw", "unit": "rad", "value": 0.0, "enforced": True},
        {"name": "lean", "unit": "rad", "value": 0.3, "enforced": True},
        {"name": "spin", "unit": "rad", "value": 0.0, "enforced": True},
    ],
    "quaternions": [],
    "rates": [
        {"name": "x", "unit": "m/s", "value": 0.0, "enforced": False},
        {"name": "y", "unit": "m/s", "value": 0.0, "enforced": False},
        {"name": "z", "unit": "m/s", "value": 0.0, "enforced": False},
        {"name": "yaw", "unit": "rad/s", "value": 0.5, "enforced": True},
        {"name": "lean", "unit": "rad/s", "value": 0.0, "enforced": True},
        {"name": "spin", "unit": "rad/s", "value": 5.0, "enforced": True},
    ],
    "parameters": [
        {"name": "m", "unit": "kg", "value": 1.0, "doc": ""},
        {"name": "r", "unit": "m", "value": 1.0, "doc": ""},
        {"name": "g", "unit": "m/s^2", "value": 9.81, "doc": ""},
    ],
    "inputs": [],
    "constants": [],
    "constraints": [
        {"name": "contact_x", "kind": "velocity"},
        {"name": "contact_y", "kind": "velocity"},
        {"name": "contact_z", "kind": "velocity"},
    ],
    "outputs": [
        {"name": "contact_point_x", "unit": ""},
        {"name": "contact_point_y", "unit": ""},
    ],
    "events": [],
    "bodies": [
        {"name": "disc", "planar": False, "shape": "capsule", "sizes": 2, "mesh": ""},
        {"name": "face", "planar": False, "shape": "cylinder", "sizes": 2, "mesh": ""},
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
        "rhs": 223,
        "mass_matrix": 13,
        "forces": 66,
        "energy": 36,
        "residual": 125,
        "residual_jacobian": 330,
        "constraint_residual": 19,
        "constraint_jacobian": 17,
        "gamma": 32,
        "project": 130,
        "poses": 35,
        "shapes": 1,
        "outputs": 9,
    },
    "hoisted": {
        "rhs": 9,
        "mass_matrix": 3,
        "forces": 4,
        "energy": 5,
        "residual": 4,
        "residual_jacobian": 3,
        "project": 8,
        "shapes": 1,
    },
    "run": {
        "t_end": 10.0,
        "fps": 60.0,
    },
    "subsystems": [],
}

@njit(error_model="numpy")
def rhs(t, y, p, out):
    """State derivative: rates, accelerations, multipliers, pivot ratio. 223 operations."""
    p_m = p[0]
    p_r = p[1]
    p_g = p[2]
    c0 = 1.0/p_m
    c1 = p_r*p_r
    c2 = c1*(0.25*p_m)
    c3 = 1.0/c2
    c4 = c1*(0.5*p_m)
    c5 = 1.0/c4
    c6 = p_r*c5
    c7 = c4*c5
    c8 = p_m*p_g*c0
    q_yaw = y[3]
    q_lean = y[4]
    q_spin = y[5]
    v_x = y[6]
    v_y = y[7]
    v_z = y[8]
    v_yaw = y[9]
    v_lean = y[10]
    v_spin = y[11]
    x0 = cos(q_yaw)
    x1 = cos(q_lean)
    x2 = p_r*x1
    x3 = x0*x2
    x4 = sin(q_yaw)
    x5 = x4*x2
    x6 = x5*c3
    x7 = p_r*x4
    x8 = x0*c6
    x9 = sin(q_lean)
    x10 = x9*c7
    x11 = p_r*x9
    x12 = x7*x10 - x4*x11
    x13 = p_r*x0
    x14 = x13*x10 - x0*x11
    x15 = 1.0/(c2*(x1*x1) + c4*(x9*x9) - x9*c4*x10)
    x16 = x14*x15
    x17 = x3*x6 - (x7*x8 + x12*x16)
    x18 = 1.0/(c0 + x13*x8 + x14*x16 + x5*x6)
    x19 = x17*x18
    x20 = x4*c6
    x21 = x12*x15
    x22 = x3*c3
    x23 = c0 + x7*x20 + x12*x21 + x3*x22
    x24 = x17*x19 - x23
    x25 = 1.0/x24
    x26 = v_lean*x1
    x27 = v_yaw*x26
    x28 = p_r*x27
    x29 = v_spin + v_yaw*x9
    x30 = p_r*x29
    x31 = v_yaw*x0
    x32 = v_lean*p_r
    x33 = x32*x1
    x34 = v_yaw*x4
    x35 = v_lean*x9
    x36 = x32*x35
    x37 = v_yaw*x1
    x38 = cos(q_spin)
    x39 = sin(q_spin)
    x40 = x37*x38 + v_lean*x39
    x41 = v_lean*x38 - x37*x39
    x42 = x41*c2
    x43 = x40*c2
    x44 = x40*x42 - x41*x43 + c4*x27
    x45 = x29*c4
    x46 = v_spin*x38
    x47 = v_yaw*x35
    x48 = v_spin*x39
    x49 = x41*x45 - x29*x42 + c2*(v_lean*x46 - (x38*x47 + x37*x48))
    x50 = x29*x43 - x40*x45 - c2*(v_lean*x48 + (x37*x46 - x39*x47))
    x51 = x44*x10 - (x1*(x38*x49 - x39*x50) + x9*x44)
    x52 = x38*x50 + x39*x49
    x53 = x4*x28 + x30*x31 + (x33*x34 + x0*x36) - x44*x20 - x21*x51 + x52*x22
    x54 = x0*x28 - x30*x34 + (x33*x31 - x4*x36) - x44*x8 - x16*x51 - x52*x6
    x55 = x53 + x19*x54
    x56 = x11*x6
    x57 = x56*x19 - x11*x22
    x58 = x57*x25
    x59 = x56*x18
    x60 = x11*c3
    x61 = c0 + x11*x60
    x62 = x56*x59 - x61 - x57*x58
    x63 = 1.0/x62*(c8 - x32*x26 + x52*x60 + x59*x54 - x58*x55)
    x64 = x25*x55 - x58*x63
    x65 = x19*x64 - x18*x54 + x59*x63
    x66 = x15*x51 - x16*x65 - x21*x64
    x67 = -(x62/x61)
    x68 = -(x24/x23)
    x69 = (x68 if x68 < 1.0 else 1.0)
    out[0] = v_x
    out[1] = v_y
    out[2] = v_z
    out[3] = v_yaw
    out[4] = v_lean
    out[5] = v_spin
    out[6] = -(c0*x65)
    out[7] = -(c0*x64)
    out[8] = -(c8 + c0*x63)
    out[9] = x66
    out[10] = x6*x65 - x52*c3 - x22*x64 - x60*x63
    out[11] = x8*x65 - (x44*c5 + x10*x66) + x20*x64
    out[12] = -x65
    out[13] = -x64
    out[14] = -x63
    out[15] = (x67 if x67 < x69 else x69)


@njit(error_model="numpy")
def mass_matrix(t, y, p, out):
    """Mass matrix M, row by row. 13 operations."""
    p_m = p[0]
    p_r = p[1]
    c0 = p_r*p_r
    c1 = c0*(0.25*p_m)
    c2 = c0*(0.5*p_m)
    q_lean = y[4]
    x0 = cos(q_lean)
    x1 = sin(q_lean)
    x2 = x1*c2
    out[0] = p_m
    out[7] = p_m
    out[14] = p_m
    out[21] = c1*(x0*x0) + c2*(x1*x1)
    out[22] = 0.0
    out[23] = x2
    out[27] = 0.0
    out[28] = c1
    out[33] = x2
    out[35] = c2


@njit(error_model="numpy")
def forces(t, y, p, out):
    """Forces f of M a = f + G^T lambda. 66 operations."""
    p_m = p[0]
    p_r = p[1]
    p_g = p[2]
    c0 = -(p_m*p_g)
    c1 = p_r*p_r
    c2 = c1*(0.5*p_m)
    c3 = c1*(0.25*p_m)
    q_lean = y[4]
    q_spin = y[5]
    v_yaw = y[9]
    v_lean = y[10]
    v_spin = y[11]
    x0 = cos(q_lean)
    x1 = cos(q_spin)
    x2 = v_yaw*x0
    x3 = sin(q_spin)
    x4 = v_lean*x1 - x2*x3
    x5 = sin(q_lean)
    x6 = v_spin + v_yaw*x5
    x7 = x6*c2
    x8 = x4*c3
    x9 = v_spin*x1
    x10 = v_yaw*(v_lean*x5)
    x11 = v_spin*x3
    x12 = x4*x7 - x6*x8 + c3*(v_lean*x9 - (x1*x10 + x2*x11))
    x13 = x2*x1 + v_lean*x3
    x14 = x13*c3
    x15 = x6*x14 - x13*x7 - c3*(v_lean*x11 + (x2*x9 - x3*x10))
    x16 = x13*x8 - x4*x14 + c2*(v_yaw*(v_lean*x0))
    out[0] = 0.0
    out[1] = 0.0
    out[2] = c0
    out[3] = -(x0*(x1*x12 - x3*x15) + x5*x16)
    out[4] = -(x1*x15 + x3*x12)
    out[5] = -x16


@njit(error_model="numpy")
def energy(t, y, p, out):
    """Kinetic and potential energy. 36 operations."""
    p_m = p[0]
    p_r = p[1]
    p_g = p[2]
    c0 = 0.5*p_m
    c1 = p_r*p_r
    c2 = c1*(0.25*p_m)
    c3 = c1*c0
    c4 = p_m*p_g
    q_z = y[2]
    q_lean = y[4]
    q_spin = y[5]
    v_x = y[6]
    v_y = y[7]
    v_z = y[8]
    v_yaw = y[9]
    v_lean = y[10]
    v_spin = y[11]
    x0 = cos(q_spin)
    x1 = v_yaw*cos(q_lean)
    x2 = sin(q_spin)
    x3 = v_lean*x0 - x1*x2
    x4 = v_spin + v_yaw*sin(q_lean)
    x5 = x1*x0 + v_lean*x2
    x6 = c0*(v_x*v_x + v_y*v_y + v_z*v_z) + 0.5*(c2*(x3*x3) + c3*(x4*x4) + c2*(x5*x5))
    out[0] = x6
    out[1] = q_z*c4


@njit(error_model="numpy")
def residual(t, y, p, out):
    """M a - f - G^T lambda, then G a - gamma. 125 operations."""
    p_m = p[0]
    p_r = p[1]
    p_g = p[2]
    c0 = p_m*p_g
    c1 = p_r*p_r
    c2 = c1*(0.5*p_m)
    c3 = c1*(0.25*p_m)
    q_yaw = y[3]
    q_lean = y[4]
    q_spin = y[5]
    v_yaw = y[9]
    v_lean = y[10]
    v_spin = y[11]
    a_x = y[12]
    a_y = y[13]
    a_z = y[14]
    a_yaw = y[15]
    a_lean = y[16]
    a_spin = y[17]
    lam_contact_x = y[18]
    lam_contact_y = y[19]
    lam_contact_z = y[20]
    x0 = cos(q_lean)
    x1 = cos(q_spin)
    x2 = v_yaw*x0
    x3 = sin(q_spin)
    x4 = v_lean*x1 - x2*x3
    x5 = sin(q_lean)
    x6 = v_spin + v_yaw*x5
    x7 = x6*c2
    x8 = x4*c3
    x9 = v_lean*x5
    x10 = a_yaw*x0 - v_yaw*x9
    x11 = v_spin*x3
    x12 = v_spin*x1
    x13 = x4*x7 - x6*x8 + c3*(x1*x10 - x2*x11 + (v_lean*x12 + a_lean*x3))
    x14 = x2*x1 + v_lean*x3
    x15 = x14*c3
    x16 = x6*x15 - x14*x7 + c3*(a_lean*x1 - v_lean*x11 - (x2*x12 + x3*x10))
    x17 = v_lean*x0
    x18 = a_spin + (v_yaw*x17 + a_yaw*x5)
    x19 = x14*x8 - x4*x15 + c2*x18
    x20 = sin(q_yaw)
    x21 = cos(q_yaw)
    x22 = p_r*(lam_contact_y*x20 + lam_contact_x*x21)
    x23 = lam_contact_z*x5 + x0*(lam_contact_y*x21 - lam_contact_x*x20)
    x24 = p_r*x18
    x25 = p_r*x6
    x26 = v_yaw*x20
    x27 = v_lean*p_r
    x28 = x27*x0
    x29 = v_yaw*x21
    x30 = a_lean*p_r
    x31 = x0*x30 - x27*x9
    out[0] = a_x*p_m - lam_contact_x
    out[1] = a_y*p_m - lam_contact_y
    out[2] = c0 + a_z*p_m - lam_contact_z
    out[3] = x0*(x1*x13 - x3*x16) + x5*x19 + x5*x22
    out[4] = x1*x16 + x3*x13 - p_r*x23
    out[5] = x19 + x22
    out[6] = a_x - (x21*x24 - x25*x26 + (x28*x29 + x20*x31))
    out[7] = a_y + (x21*x31 - x28*x26 - (x25*x29 + x20*x24))
    out[8] = a_z + (x27*x17 + x5*x30)


@njit(error_model="numpy")
def residual_jacobian(t, y, p, out):
    """Residual derivatives by q, v, a, lambda. 330 operations."""
    p_m = p[0]
    p_r = p[1]
    c0 = p_r*p_r
    c1 = c0*(0.5*p_m)
    c2 = c0*(0.25*p_m)
    q_yaw = y[3]
    q_lean = y[4]
    q_spin = y[5]
    v_yaw = y[9]
    v_lean = y[10]
    v_spin = y[11]
    a_yaw = y[15]
    a_lean = y[16]
    a_spin = y[17]
    lam_contact_x = y[18]
    lam_contact_y = y[19]
    lam_contact_z = y[20]
    x0 = sin(q_lean)
    x1 = cos(q_yaw)
    x2 = sin(q_yaw)
    x3 = lam_contact_y*x1 - lam_contact_x*x2
    x4 = p_r*x3
    x5 = cos(q_lean)
    x6 = p_r*(x5*(lam_contact_y*x2 + lam_contact_x*x1))
    x7 = cos(q_spin)
    x8 = v_yaw*x0
    x9 = v_spin + x8
    x10 = x9*c1
    x11 = sin(q_spin)
    x12 = x8*x11
    x13 = v_yaw*x5
    x14 = v_lean*x7 - x13*x11
    x15 = x13*c1
    x16 = x14*c2
    x17 = c2*x12
    x18 = v_spin*x11
    x19 = v_lean*x5
    x20 = v_yaw*x19 + a_yaw*x0
    x21 = x10*x12 + x14*x15 - (x13*x16 + x9*x17) + c2*(x8*x18 - x7*x20)
    x22 = x13*x7 + v_lean*x11
    x23 = x22*c2
    x24 = x8*x7
    x25 = c2*x24
    x26 = v_spin*x7
    x27 = x13*x23 - x9*x25 - (x22*x15 - x10*x24) + c2*(x8*x26 + x11*x20)
    x28 = v_lean*x0
    x29 = a_yaw*x5 - v_yaw*x28
    x30 = x14*x10 - x9*x16 + c2*(x7*x29 - x13*x18 + (v_lean*x26 + a_lean*x11))
    x31 = x9*x23 - x22*x10 + c2*(a_lean*x7 - v_lean*x18 - (x13*x26 + x11*x29))
    x32 = a_spin + x20
    x33 = x22*x17 - x16*x24 - (x23*x12 - x14*x25) + c1*x29
    x34 = x5*(x7*x21 - x11*x27) - x0*(x7*x30 - x11*x31) + (x5*(x22*x16 - x14*x23 + c1*x32) + x0*x33)
    x35 = x0*c1
    x36 = x5*x11
    x37 = x36*c2
    x38 = x14*x35 - x36*x10 - (x0*x16 - x9*x37) - c2*(x5*x18 + x7*x28)
    x39 = x5*x7
    x40 = x39*c2
    x41 = x0*x23 + x9*x40 - (x39*x10 + x22*x35) - c2*(x5*x26 - x11*x28)
    x42 = c1*x19 + (x39*x16 - x22*x37 - (x14*x40 - x36*x23))
    x43 = x7*c2
    x44 = x7*x10 - x9*x43 + c2*(x26 - x24)
    x45 = x11*c2
    x46 = x9*x45 - x11*x10 + c2*(x12 - x18)
    x47 = x15 + (x11*x16 + x22*x43 - (x7*x23 + x14*x45))
    x48 = x16 + (x14*c1 - x16)
    x49 = x23 - x22*c1 - x23
    x50 = x5*(x11*x43 - x7*x45)
    x51 = p_r*x0
    x52 = x1*x51
    x53 = x2*x51
    x54 = p_r*x5
    x55 = x2*x54
    x56 = x1*x54
    x57 = p_r*x1
    x58 = p_r*x2
    x59 = a_lean*p_r
    x60 = v_lean*p_r
    x61 = x5*x59 - x60*x28
    x62 = x60*x5
    x63 = v_yaw*x2
    x64 = p_r*x9
    x65 = v_yaw*x1
    x66 = p_r*x32
    x67 = p_r*x29
    x68 = p_r*x13
    x69 = x0*x60
    x70 = x60*x19 + x0*x59
    x71 = p_r*x19
    x72 = x69 + p_r*x28
    out[12] = p_m
    out[18] = -1.0
    out[34] = p_m
    out[40] = -1.0
    out[56] = p_m
    out[62] = -1.0
    out[66] = x0*x4
    out[67] = x6 + x34
    out[72] = x5*(x7*x38 - x11*x41) + x0*x42
    out[73] = x5*(x7*x44 - x11*x46) + x0*x47
    out[74] = x5*(x7*x48 - x11*x49)
    out[78] = c2*(x5*x5) + c1*(x0*x0)
    out[79] = x50
    out[80] = x35
    out[81] = x52
    out[82] = x53
    out[87] = x6
    out[88] = p_r*(x0*x3 - lam_contact_z*x5) + (x7*x27 + x11*x21)
    out[93] = x7*x41 + x11*x38
    out[94] = x7*x46 + x11*x44
    out[95] = x7*x49 + x11*x48
    out[99] = x50
    out[100] = c2
    out[102] = x55
    out[103] = -x56
    out[104] = -x51
    out[108] = x4
    out[109] = x33
    out[114] = x42
    out[115] = x47
    out[120] = x35
    out[122] = c1
    out[123] = x57
    out[124] = x58
    out[129] = -(x1*x61 - x62*x63 - (x64*x65 + x2*x66))
    out[130] = -(x1*x67 - x63*x68 - (x69*x65 + x2*x70))
    out[135] = -(x1*x62 + (x1*x71 - (x64*x2 + x51*x63)))
    out[136] = -(x1*x68 + (x54*x65 - x2*x72))
    out[137] = p_r*x63
    out[138] = 1.0
    out[141] = -x52
    out[142] = -x55
    out[143] = -x57
    out[150] = -(x1*x66 - x64*x63 + (x62*x65 + x2*x61))
    out[151] = x69*x63 - x1*x70 - (x65*x68 + x2*x67)
    out[156] = -(x2*x62 + (x64*x1 + x51*x65 + x2*x71))
    out[157] = -(x2*x68 + (x54*x63 + x1*x72))
    out[158] = -(p_r*x65)
    out[160] = 1.0
    out[162] = -x53
    out[163] = x56
    out[164] = -x58
    out[172] = x61
    out[178] = x62 + x71
    out[182] = 1.0
    out[184] = x51


@njit(error_model="numpy")
def constraint_residual(t, y, p, out):
    """Position residuals, velocity residuals. 19 operations."""
    p_r = p[1]
    q_yaw = y[3]
    q_lean = y[4]
    v_x = y[6]
    v_y = y[7]
    v_z = y[8]
    v_yaw = y[9]
    v_lean = y[10]
    v_spin = y[11]
    x0 = sin(q_lean)
    x1 = p_r*(v_spin + v_yaw*x0)
    x2 = cos(q_yaw)
    x3 = sin(q_yaw)
    x4 = v_lean*p_r
    x5 = x4*cos(q_lean)
    out[0] = v_x - (x1*x2 + x3*x5)
    out[1] = v_y + (x2*x5 - x1*x3)
    out[2] = v_z + x0*x4


@njit(error_model="numpy")
def constraint_jacobian(t, y, p, out):
    """Constraint Jacobian G, row by row. 17 operations."""
    p_r = p[1]
    q_yaw = y[3]
    q_lean = y[4]
    x0 = cos(q_yaw)
    x1 = p_r*sin(q_lean)
    x2 = sin(q_yaw)
    x3 = p_r*cos(q_lean)
    out[0] = 1.0
    out[3] = -(x0*x1)
    out[4] = -(x2*x3)
    out[5] = -(p_r*x0)
    out[7] = 1.0
    out[9] = -(x2*x1)
    out[10] = x0*x3
    out[11] = -(p_r*x2)
    out[14] = 1.0
    out[16] = x1


@njit(error_model="numpy")
def gamma(t, y, p, out):
    """Right-hand side of G a = gamma. 32 operations."""
    p_r = p[1]
    q_yaw = y[3]
    q_lean = y[4]
    v_yaw = y[9]
    v_lean = y[10]
    v_spin = y[11]
    x0 = cos(q_yaw)
    x1 = cos(q_lean)
    x2 = v_lean*x1
    x3 = p_r*(v_yaw*x2)
    x4 = sin(q_lean)
    x5 = p_r*(v_spin + v_yaw*x4)
    x6 = sin(q_yaw)
    x7 = v_yaw*x6
    x8 = v_lean*p_r
    x9 = x8*x1
    x10 = v_yaw*x0
    x11 = x8*(v_lean*x4)
    out[0] = x0*x3 - x5*x7 + (x9*x10 - x6*x11)
    out[1] = x6*x3 + x5*x10 + (x9*x7 + x0*x11)
    out[2] = -(x8*x2)


@njit(error_model="numpy")
def project(t, y, p, out):
    """State moved onto the constraints, and the residuals it had. 130 operations."""
    p_m = p[0]
    p_r = p[1]
    c0 = 1.0/p_m
    c1 = p_r*p_r
    c2 = c1*(0.5*p_m)
    c3 = 1.0/c2
    c4 = p_r*c3
    c5 = c2*c3
    c6 = c1*(0.25*p_m)
    c7 = 1.0/c6
    q_x = y[0]
    q_y = y[1]
    q_z = y[2]
    q_yaw = y[3]
    q_lean = y[4]
    q_spin = y[5]
    v_x = y[6]
    v_y = y[7]
    v_z = y[8]
    v_yaw = y[9]
    v_lean = y[10]
    v_spin = y[11]
    x0 = sin(q_lean)
    x1 = p_r*(v_spin + v_yaw*x0)
    x2 = cos(q_yaw)
    x3 = sin(q_yaw)
    x4 = v_lean*p_r
    x5 = cos(q_lean)
    x6 = x4*x5
    x7 = v_x - (x1*x2 + x3*x6)
    x8 = p_r*x2
    x9 = x2*c4
    x10 = x0*c5
    x11 = p_r*x0
    x12 = x8*x10 - x2*x11
    x13 = 1.0/(c6*(x5*x5) + c2*(x0*x0) - x0*c2*x10)
    x14 = x12*x13
    x15 = p_r*x5
    x16 = x3*x15
    x17 = x16*c7
    x18 = 1.0/(c0 + x8*x9 + x12*x14 + x16*x17)
    x19 = x2*x15
    x20 = p_r*x3
    x21 = x20*x10 - x3*x11
    x22 = x19*x17 - (x20*x9 + x21*x14)
    x23 = x22*x18
    x24 = x3*c4
    x25 = x21*x13
    x26 = x19*c7
    x27 = 1.0/(x22*x23 - (c0 + x20*x24 + x21*x25 + x19*x26))
    x28 = v_y + (x2*x6 - x1*x3)
    x29 = x28 + x7*x23
    x30 = x11*x17
    x31 = x30*x23 - x11*x26
    x32 = x31*x27
    x33 = x30*x18
    x34 = x11*c7
    x35 = v_z + x0*x4
    x36 = 1.0/(x30*x33 - (c0 + x11*x34) - x31*x32)*(x32*x29 - (x35 + x7*x33))
    x37 = x27*x29 + x32*x36
    x38 = x7*x18 - x23*x37 + x33*x36
    x39 = x25*x37 - x14*x38
    out[0] = q_x
    out[1] = q_y
    out[2] = q_z
    out[3] = q_yaw
    out[4] = q_lean
    out[5] = q_spin
    out[6] = v_x - c0*x38
    out[7] = v_y + c0*x37
    out[8] = v_z - c0*x36
    out[9] = v_yaw + x39
    out[10] = v_lean + (x17*x38 + x26*x37 - x34*x36)
    out[11] = v_spin + (x9*x38 - x10*x39 - x24*x37)
    out[12] = x7
    out[13] = x28
    out[14] = x35


@njit(error_model="numpy")
def poses(t, y, p, out):
    """Per body: position, rotation matrix (body to world). 35 operations."""
    q_x = y[0]
    q_y = y[1]
    q_z = y[2]
    q_yaw = y[3]
    q_lean = y[4]
    q_spin = y[5]
    x0 = cos(q_yaw)
    x1 = cos(q_spin)
    x2 = sin(q_lean)
    x3 = sin(q_yaw)
    x4 = x2*x3
    x5 = sin(q_spin)
    x6 = cos(q_lean)
    x7 = x2*x0
    x8 = q_lean + -1.5707963267948966
    x9 = cos(x8)
    x10 = sin(x8)
    out[0] = q_x
    out[1] = q_y
    out[2] = q_z
    out[3] = x0*x1 - x4*x5
    out[4] = -(x3*x6)
    out[5] = x4*x1 + x0*x5
    out[6] = x3*x1 + x7*x5
    out[7] = x0*x6
    out[8] = x3*x5 - x7*x1
    out[9] = -(x6*x5)
    out[10] = x2
    out[11] = x6*x1
    out[12] = q_x
    out[13] = q_y
    out[14] = q_z
    out[15] = x0
    out[16] = -(x3*x9)
    out[17] = x3*x10
    out[18] = x3
    out[19] = x0*x9
    out[20] = -(x0*x10)
    out[21] = 0.0
    out[22] = x10
    out[23] = x9


@njit(error_model="numpy")
def shapes(t, y, p, out):
    """Sizes of the bodies' shapes. 1 operation."""
    p_r = p[1]
    c0 = 1.8*p_r
    out[0] = 0.06
    out[1] = c0
    out[2] = p_r
    out[3] = 0.06


@njit(error_model="numpy")
def outputs(t, y, p, out):
    """Outputs. 9 operations."""
    p_r = p[1]
    q_x = y[0]
    q_y = y[1]
    q_yaw = y[3]
    q_lean = y[4]
    x0 = sin(q_lean)
    out[0] = q_x - p_r*(x0*sin(q_yaw))
    out[1] = q_y + p_r*(x0*cos(q_yaw))
