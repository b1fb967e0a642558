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
        "rhs": 207,
        "mass_matrix": 13,
        "forces": 49,
        "energy": 36,
        "residual": 147,
        "residual_jacobian": 239,
        "constraint_residual": 19,
        "constraint_jacobian": 17,
        "gamma": 32,
        "project": 128,
        "poses": 35,
        "shapes": 1,
        "outputs": 9,
    },
    "run": {
        "t_end": 10.0,
        "fps": 60.0,
    },
}

@njit(error_model="numpy")
def rhs(t, y, p, out):
    """State derivative: rates, accelerations, multipliers, pivot ratio. 207 operations."""
    q_yaw = y[3]
    q_lean = y[4]
    v_x = y[6]
    v_y = y[7]
    v_z = y[8]
    v_yaw = y[9]
    v_lean = y[10]
    v_spin = y[11]
    p_m = p[0]
    p_r = p[1]
    p_g = p[2]
    x0 = 1.0/p_m
    x1 = cos(q_yaw)
    x2 = cos(q_lean)
    x3 = p_r*x2
    x4 = x1*x3
    x5 = sin(q_yaw)
    x6 = x5*x3
    x7 = p_r*p_r
    x8 = x7*(0.25*p_m)
    x9 = 1.0/x8
    x10 = x6*x9
    x11 = sin(q_lean)
    x12 = p_r*x11
    x13 = x5*x12
    x14 = x1*x12
    x15 = x7*(0.5*p_m)
    x16 = 1.0/(x8*(x2*x2) + x15*(x11*x11))
    x17 = x14*x16
    x18 = x11*x15
    x19 = x18*x16
    x20 = x13*x19 - p_r*x5
    x21 = x14*x19 - p_r*x1
    x22 = 1.0/(x15 - x18*x19)
    x23 = x21*x22
    x24 = x4*x10 - (x13*x17 + x20*x23)
    x25 = 1.0/(x0 + x14*x17 + x21*x23 + x6*x10)
    x26 = x24*x25
    x27 = x13*x16
    x28 = x20*x22
    x29 = x4*x9
    x30 = x0 + x13*x27 + x20*x28 + x4*x29
    x31 = x24*x26 - x30
    x32 = 1.0/x31
    x33 = v_lean*x2
    x34 = p_r*(v_yaw*x33)
    x35 = p_r*(v_spin + v_yaw*x11)
    x36 = v_yaw*x1
    x37 = v_lean*p_r
    x38 = x37*x2
    x39 = v_yaw*x5
    x40 = v_lean*x11
    x41 = x37*x40
    x42 = 0.5*v_yaw
    x43 = 2.0*x11
    x44 = 2.0*x2
    x45 = x15*(x33*x43) - x8*(x40*x44)
    x46 = x15*x33
    x47 = 0.5*v_spin
    x48 = x42*x45 + (0.5*(v_yaw*x45 + v_spin*x46) + x47*x46)
    x49 = x48*x19 - (0.5*(v_yaw*x46) + x42*x46)
    x50 = v_yaw*x42
    x51 = x11*(x8*x50*x44) - x2*(x15*x50*x43 + x15*(v_yaw*x47 + v_spin*x42))
    x52 = x5*x34 + x35*x36 + (x38*x39 + x1*x41) - x48*x27 - x28*x49 + x51*x29
    x53 = x1*x34 - x35*x39 + (x38*x36 - x5*x41) - x48*x17 - x23*x49 - x51*x10
    x54 = x52 + x26*x53
    x55 = x12*x10
    x56 = x55*x26 - x12*x29
    x57 = x56*x32
    x58 = x55*x25
    x59 = x12*x9
    x60 = x0 + x12*x59
    x61 = x55*x58 - x60 - x56*x57
    x62 = p_m*p_g*x0
    x63 = 1.0/x61*(x62 - x37*x33 + x51*x59 + x58*x53 - x57*x54)
    x64 = x32*x54 - x57*x63
    x65 = x26*x64 - x25*x53 + x58*x63
    x66 = x22*x49 - x23*x65 - x28*x64
    x67 = -(x61/x60)
    x68 = -(x31/x30)
    x69 = (x68 if x68 < 1.0 else 1.0)
    out[0] = v_x
    out[1] = v_y
    out[2] = v_z
    out[3] = v_yaw
    out[4] = v_lean
    out[5] = v_spin
    out[6] = -(x0*x65)
    out[7] = -(x0*x64)
    out[8] = -(x62 + x0*x63)
    out[9] = x17*x65 - (x48*x16 + x19*x66) + x27*x64
    out[10] = x10*x65 - x51*x9 - x29*x64 - x59*x63
    out[11] = x66
    out[12] = -x65
    out[13] = -x64
    out[14] = -x63
    out[15] = (x67 if x67 < x69 else x69)


@njit(error_model="numpy")
def mass_matrix(t, y, p, out):
    """Mass matrix M, row by row. 13 operations."""
    q_lean = y[4]
    p_m = p[0]
    p_r = p[1]
    x0 = p_r*p_r
    x1 = x0*(0.25*p_m)
    x2 = cos(q_lean)
    x3 = x0*(0.5*p_m)
    x4 = sin(q_lean)
    x5 = x4*x3
    out[0] = p_m
    out[7] = p_m
    out[14] = p_m
    out[21] = x1*(x2*x2) + x3*(x4*x4)
    out[23] = x5
    out[28] = x1
    out[33] = x5
    out[35] = x3


@njit(error_model="numpy")
def forces(t, y, p, out):
    """Forces f of M a = f + G^T lambda. 49 operations."""
    q_lean = y[4]
    v_yaw = y[9]
    v_lean = y[10]
    v_spin = y[11]
    p_m = p[0]
    p_r = p[1]
    p_g = p[2]
    x0 = 0.5*v_yaw
    x1 = p_r*p_r
    x2 = x1*(0.5*p_m)
    x3 = cos(q_lean)
    x4 = v_lean*x3
    x5 = sin(q_lean)
    x6 = 2.0*x5
    x7 = x1*(0.25*p_m)
    x8 = 2.0*x3
    x9 = x2*(x4*x6) - x7*(v_lean*x5*x8)
    x10 = x2*x4
    x11 = 0.5*v_spin
    x12 = v_yaw*x0
    x13 = -(x5*(x7*x12*x8) - x3*(x2*x12*x6 + x2*(v_yaw*x11 + v_spin*x0)))
    out[0] = 0.0
    out[1] = 0.0
    out[2] = -(p_m*p_g)
    out[3] = -(x0*x9 + (0.5*(v_yaw*x9 + v_spin*x10) + x11*x10))
    out[4] = x13
    out[5] = -(0.5*(v_yaw*x10) + x0*x10)


@njit(error_model="numpy")
def energy(t, y, p, out):
    """Kinetic and potential energy. 36 operations."""
    q_z = y[2]
    q_lean = y[4]
    q_spin = y[5]
    v_x = y[6]
    v_y = y[7]
    v_z = y[8]
    v_yaw = y[9]
    v_lean = y[10]
    v_spin = y[11]
    p_m = p[0]
    p_r = p[1]
    p_g = p[2]
    x0 = 0.5*p_m
    x1 = cos(q_spin)
    x2 = v_yaw*cos(q_lean)
    x3 = sin(q_spin)
    x4 = v_lean*x1 - x2*x3
    x5 = p_r*p_r
    x6 = x5*(0.25*p_m)
    x7 = v_spin + v_yaw*sin(q_lean)
    x8 = x2*x1 + v_lean*x3
    x9 = x0*(v_x*v_x + v_y*v_y + v_z*v_z) + 0.5*(x4*(x4*x6) + x7*(x7*(x5*x0)) + x8*(x8*x6))
    out[0] = x9
    out[1] = p_m*(q_z*p_g)


@njit(error_model="numpy")
def residual(t, y, p, out):
    """M a - f - G^T lambda, then G a - gamma. 147 operations."""
    q_yaw = y[3]
    q_lean = y[4]
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
    p_m = p[0]
    p_r = p[1]
    p_g = p[2]
    x0 = 0.5*v_yaw
    x1 = p_r*p_r
    x2 = x1*(0.5*p_m)
    x3 = cos(q_lean)
    x4 = v_lean*x3
    x5 = sin(q_lean)
    x6 = 2.0*x5
    x7 = x1*(0.25*p_m)
    x8 = v_lean*x5
    x9 = 2.0*x3
    x10 = x2*(x4*x6) - x7*(x8*x9)
    x11 = x7*(x3*x3) + x2*(x5*x5)
    x12 = 0.5*a_yaw
    x13 = x2*x4
    x14 = x5*x2
    x15 = 0.5*v_spin
    x16 = 0.5*a_spin
    x17 = 0.5*(v_yaw*x10 + a_yaw*x11 + (v_spin*x13 + a_spin*x14)) + (x15*x13 + x14*x16)
    x18 = sin(q_yaw)
    x19 = cos(q_yaw)
    x20 = p_r*(lam_contact_y*x18 + lam_contact_x*x19)
    x21 = v_yaw*x0
    x22 = x5*(x7*x21*x9) - x3*(x2*x21*x6 + x2*(v_yaw*x15 + v_spin*x0)) + (0.5*(a_lean*x7) + x7*(0.5*a_lean))
    x23 = lam_contact_z*x5 + x3*(lam_contact_y*x19 - lam_contact_x*x18)
    x24 = x0*x13 + x14*x12 + (0.5*(v_yaw*x13 + a_yaw*x14 + a_spin*x2) + x2*x16)
    x25 = p_r*(a_spin + (v_yaw*x4 + a_yaw*x5))
    x26 = p_r*(v_spin + v_yaw*x5)
    x27 = v_yaw*x18
    x28 = v_lean*p_r
    x29 = x28*x3
    x30 = v_yaw*x19
    x31 = a_lean*p_r
    x32 = x3*x31 - x28*x8
    out[0] = 0.5*(a_x*p_m) + p_m*(0.5*a_x) - lam_contact_x
    out[1] = 0.5*(a_y*p_m) + p_m*(0.5*a_y) - lam_contact_y
    out[2] = p_m*p_g + (0.5*(a_z*p_m) + p_m*(0.5*a_z)) - lam_contact_z
    out[3] = x0*x10 + x11*x12 + x17 + x5*x20
    out[4] = x22 - p_r*x23
    out[5] = x24 + x20
    out[6] = a_x - (x19*x25 - x26*x27 + (x29*x30 + x18*x32))
    out[7] = a_y + (x19*x32 - x29*x27 - (x26*x30 + x18*x25))
    out[8] = a_z + (x28*x4 + x5*x31)


@njit(error_model="numpy")
def residual_jacobian(t, y, p, out):
    """Residual derivatives by q, v, a, lambda. 239 operations."""
    q_yaw = y[3]
    q_lean = y[4]
    v_yaw = y[9]
    v_lean = y[10]
    v_spin = y[11]
    a_yaw = y[15]
    a_lean = y[16]
    a_spin = y[17]
    lam_contact_x = y[18]
    lam_contact_y = y[19]
    lam_contact_z = y[20]
    p_m = p[0]
    p_r = p[1]
    x0 = sin(q_lean)
    x1 = cos(q_yaw)
    x2 = sin(q_yaw)
    x3 = lam_contact_y*x1 - lam_contact_x*x2
    x4 = p_r*x3
    x5 = 0.5*v_yaw
    x6 = p_r*p_r
    x7 = x6*(0.5*p_m)
    x8 = cos(q_lean)
    x9 = v_lean*x8
    x10 = 2.0*x8
    x11 = v_lean*x0
    x12 = 2.0*x0
    x13 = x9*x10 - x11*x12
    x14 = x6*(0.25*p_m)
    x15 = x7*x13 - x14*x13
    x16 = 0.5*a_yaw
    x17 = x7*(x8*x12) - x14*(x0*x10)
    x18 = x8*x7
    x19 = x7*x11
    x20 = 0.5*v_spin
    x21 = 0.5*(v_yaw*x15 + a_yaw*x17 + (a_spin*x18 - v_spin*x19)) + (0.5*a_spin*x18 - x20*x19)
    x22 = lam_contact_y*x2 + lam_contact_x*x1
    x23 = 0.5*(x7*(x9*x12) - x14*(x11*x10))
    x24 = 0.5*(x7*x9)
    x25 = x24 + x24
    x26 = x0*x7
    x27 = p_r*x0
    x28 = x1*x27
    x29 = x2*x27
    x30 = v_yaw*x5
    x31 = x14*x30
    x32 = x7*x30
    x33 = x8*(x31*x10) - x0*(x12*x31) - (x8*(x32*x10) - x0*(x32*x12 + x7*(v_yaw*x20 + v_spin*x5)))
    x34 = x5 + x5
    x35 = x7*x34
    x36 = p_r*x8
    x37 = x2*x36
    x38 = x1*x36
    x39 = p_r*x1
    x40 = p_r*x2
    x41 = a_lean*p_r
    x42 = v_lean*p_r
    x43 = x8*x41 - x42*x11
    x44 = x42*x8
    x45 = v_yaw*x2
    x46 = p_r*(v_spin + v_yaw*x0)
    x47 = v_yaw*x1
    x48 = p_r*(a_spin + (v_yaw*x9 + a_yaw*x0))
    x49 = p_r*(a_yaw*x8 - v_yaw*x11)
    x50 = p_r*(v_yaw*x8)
    x51 = x0*x42
    x52 = x42*x9 + x0*x41
    x53 = p_r*x9
    x54 = x51 + p_r*x11
    out[12] = p_m
    out[18] = -1.0
    out[34] = p_m
    out[40] = -1.0
    out[56] = p_m
    out[62] = -1.0
    out[66] = x0*x4
    out[67] = x5*x15 + x16*x17 + x21 + x8*(p_r*x22)
    out[72] = x23 + x23
    out[73] = x5*x17 + (x20*x18 + 0.5*(v_yaw*x17 + v_spin*x18))
    out[74] = x25
    out[78] = x14*(x8*x8) + x7*(x0*x0)
    out[80] = x26
    out[81] = x28
    out[82] = x29
    out[87] = p_r*(x8*x22)
    out[88] = x33 - p_r*(lam_contact_z*x8 - x0*x3)
    out[93] = x0*(x10*(x14*x34)) - x8*(x12*x35 + x7*(x20 + x20))
    out[95] = -(x8*x35)
    out[100] = x14
    out[102] = x37
    out[103] = -x38
    out[104] = -x27
    out[108] = x4
    out[109] = 0.5*(a_yaw*x18 - v_yaw*x19) + (x16*x18 - x5*x19)
    out[114] = x25
    out[115] = x5*x18 + 0.5*(v_yaw*x18)
    out[120] = x26
    out[122] = x7
    out[123] = x39
    out[124] = x40
    out[129] = -(x1*x43 - x44*x45 - (x46*x47 + x2*x48))
    out[130] = -(x1*x49 - x45*x50 - (x51*x47 + x2*x52))
    out[135] = -(x1*x44 + (x1*x53 - (x46*x2 + x27*x45)))
    out[136] = -(x1*x50 + (x36*x47 - x2*x54))
    out[137] = p_r*x45
    out[138] = 1.0
    out[141] = -x28
    out[142] = -x37
    out[143] = -x39
    out[150] = -(x1*x48 - x46*x45 + (x44*x47 + x2*x43))
    out[151] = x51*x45 - x1*x52 - (x47*x50 + x2*x49)
    out[156] = -(x2*x44 + (x46*x1 + x27*x47 + x2*x53))
    out[157] = -(x2*x50 + (x36*x45 + x1*x54))
    out[158] = -(p_r*x47)
    out[160] = 1.0
    out[162] = -x29
    out[163] = x38
    out[164] = -x40
    out[172] = x43
    out[178] = x44 + x53
    out[182] = 1.0
    out[184] = x27


@njit(error_model="numpy")
def constraint_residual(t, y, p, out):
    """Position residuals, velocity residuals. 19 operations."""
    q_yaw = y[3]
    q_lean = y[4]
    v_x = y[6]
    v_y = y[7]
    v_z = y[8]
    v_yaw = y[9]
    v_lean = y[10]
    v_spin = y[11]
    p_r = p[1]
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
    q_yaw = y[3]
    q_lean = y[4]
    p_r = p[1]
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
    q_yaw = y[3]
    q_lean = y[4]
    v_yaw = y[9]
    v_lean = y[10]
    v_spin = y[11]
    p_r = p[1]
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
    """State moved onto the constraints, and the residuals it had. 128 operations."""
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
    p_m = p[0]
    p_r = p[1]
    x0 = 1.0/p_m
    x1 = sin(q_lean)
    x2 = p_r*(v_spin + v_yaw*x1)
    x3 = cos(q_yaw)
    x4 = sin(q_yaw)
    x5 = v_lean*p_r
    x6 = cos(q_lean)
    x7 = x5*x6
    x8 = v_x - (x2*x3 + x4*x7)
    x9 = p_r*x1
    x10 = x3*x9
    x11 = p_r*p_r
    x12 = x11*(0.25*p_m)
    x13 = x11*(0.5*p_m)
    x14 = 1.0/(x12*(x6*x6) + x13*(x1*x1))
    x15 = x10*x14
    x16 = x1*x13
    x17 = x16*x14
    x18 = x10*x17 - p_r*x3
    x19 = 1.0/(x13 - x16*x17)
    x20 = x18*x19
    x21 = p_r*x6
    x22 = x4*x21
    x23 = 1.0/x12
    x24 = x22*x23
    x25 = 1.0/(x0 + x10*x15 + x18*x20 + x22*x24)
    x26 = x3*x21
    x27 = x4*x9
    x28 = x27*x17 - p_r*x4
    x29 = x26*x24 - (x27*x15 + x28*x20)
    x30 = x29*x25
    x31 = x27*x14
    x32 = x28*x19
    x33 = x26*x23
    x34 = 1.0/(x29*x30 - (x0 + x27*x31 + x28*x32 + x26*x33))
    x35 = v_y + (x3*x7 - x2*x4)
    x36 = x35 + x8*x30
    x37 = x9*x24
    x38 = x37*x30 - x9*x33
    x39 = x38*x34
    x40 = x37*x25
    x41 = x9*x23
    x42 = v_z + x1*x5
    x43 = 1.0/(x37*x40 - (x0 + x9*x41) - x38*x39)*(x39*x36 - (x42 + x8*x40))
    x44 = x34*x36 + x39*x43
    x45 = x8*x25 - x30*x44 + x40*x43
    x46 = x32*x44 - x20*x45
    out[0] = q_x
    out[1] = q_y
    out[2] = q_z
    out[3] = q_yaw
    out[4] = q_lean
    out[5] = q_spin
    out[6] = v_x - x0*x45
    out[7] = v_y + x0*x44
    out[8] = v_z - x0*x43
    out[9] = v_yaw + (x15*x45 - x17*x46 - x31*x44)
    out[10] = v_lean + (x24*x45 + x33*x44 - x41*x43)
    out[11] = v_spin + x46
    out[12] = x8
    out[13] = x35
    out[14] = x42


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
    """Sizes of the bodies' shapes. 1 operations."""
    p_r = p[1]
    out[0] = 0.06
    out[1] = 1.8*p_r
    out[2] = p_r
    out[3] = 0.06


@njit(error_model="numpy")
def outputs(t, y, p, out):
    """Outputs. 9 operations."""
    q_x = y[0]
    q_y = y[1]
    q_yaw = y[3]
    q_lean = y[4]
    p_r = p[1]
    x0 = sin(q_lean)
    out[0] = q_x - sin(q_yaw)*(p_r*x0)
    out[1] = q_y + x0*(p_r*cos(q_yaw))
