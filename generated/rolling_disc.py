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
        {"name": "contact_x", "kind": "velocity", "multiplier": "N"},
        {"name": "contact_y", "kind": "velocity", "multiplier": "N"},
        {"name": "contact_z", "kind": "velocity", "multiplier": "N"},
    ],
    "outputs": [
        {"name": "contact_point_x", "unit": "m"},
        {"name": "contact_point_y", "unit": "m"},
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
        "rhs": 208,
        "mass_matrix": 13,
        "forces": 49,
        "energy": 36,
        "residual": 137,
        "residual_jacobian": 237,
        "constraint_residual": 19,
        "constraint_jacobian": 17,
        "gamma": 32,
        "project": 129,
        "poses": 35,
        "shapes": 1,
        "outputs": 9,
        "limits": 6,
    },
    "hoisted": {
        "rhs": 7,
        "mass_matrix": 3,
        "forces": 4,
        "energy": 5,
        "residual": 7,
        "residual_jacobian": 6,
        "project": 6,
        "shapes": 1,
    },
    "run": {
        "t_end": 10.0,
        "fps": 60.0,
    },
    "limits": [
        {"name": "bodies.disc.shape.capsule[1]", "bound": "zero or more"},
        {"name": "bodies.disc.mass", "bound": "zero or more"},
        {"name": "bodies.disc.inertia[0]", "bound": "zero or more"},
        {"name": "bodies.disc.inertia[1]", "bound": "zero or more"},
        {"name": "bodies.disc.inertia", "bound": "a tensor without negative moments", "numbers": 3},
        {"name": "bodies.face.shape.cylinder[0]", "bound": "zero or more"},
    ],
    "subsystems": [],
}

@njit(error_model="numpy")
def rhs(t, y, p, out):
    """State derivative: rates, accelerations, multipliers, pivot ratio. 208 operations."""
    p_m = p[0]
    p_r = p[1]
    p_g = p[2]
    c0 = 1.0/p_m
    c1 = p_r*p_r
    c2 = c1*(0.25*p_m)
    c3 = 1.0/c2
    c4 = c1*(0.5*p_m)
    c5 = p_r*c3
    c6 = p_m*p_g*c0
    q_yaw = y[3]
    q_lean = y[4]
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
    x7 = sin(q_lean)
    x8 = p_r*x7
    x9 = x4*x8
    x10 = x0*x8
    x11 = 1.0/(c2*(x1*x1) + c4*(x7*x7))
    x12 = x10*x11
    x13 = x7*c4
    x14 = x13*x11
    x15 = x9*x14 - p_r*x4
    x16 = x10*x14 - p_r*x0
    x17 = 1.0/(c4 - x13*x14)
    x18 = x16*x17
    x19 = x3*x6 - (x9*x12 + x15*x18)
    x20 = 1.0/(c0 + x10*x12 + x16*x18 + x5*x6)
    x21 = x19*x20
    x22 = x9*x11
    x23 = x15*x17
    x24 = x3*c3
    x25 = c0 + x9*x22 + x15*x23 + x3*x24
    x26 = x19*x21 - x25
    x27 = 1.0/x26
    x28 = v_lean*x1
    x29 = p_r*(v_yaw*x28)
    x30 = p_r*(v_spin + v_yaw*x7)
    x31 = v_yaw*x0
    x32 = v_lean*p_r
    x33 = x32*x1
    x34 = v_yaw*x4
    x35 = v_lean*x7
    x36 = x32*x35
    x37 = 0.5*v_yaw
    x38 = 2.0*x7
    x39 = 2.0*x1
    x40 = c4*(x28*x38) - c2*(x35*x39)
    x41 = c4*x28
    x42 = 0.5*v_spin
    x43 = x37*x40 + (0.5*(v_yaw*x40 + v_spin*x41) + x42*x41)
    x44 = x43*x14 - (0.5*(v_yaw*x41) + x37*x41)
    x45 = v_yaw*x37
    x46 = c2*(x7*(x45*x39)) - x1*(c4*(v_yaw*x42 + v_spin*x37) + c4*(x45*x38))
    x47 = x4*x29 + x30*x31 + (x33*x34 + x0*x36) - x43*x22 - x23*x44 + x24*x46
    x48 = x0*x29 - x30*x34 + (x33*x31 - x4*x36) - x43*x12 - x18*x44 - x6*x46
    x49 = x47 + x21*x48
    x50 = x8*x6
    x51 = x50*x21 - x8*x24
    x52 = x51*x27
    x53 = x50*x20
    x54 = x7*c5
    x55 = c0 + x8*x54
    x56 = x50*x53 - x55 - x51*x52
    x57 = 1.0/x56*(c6 - x32*x28 + x46*x54 + x53*x48 - x52*x49)
    x58 = x27*x49 - x52*x57
    x59 = x21*x58 - x20*x48 + x53*x57
    x60 = x17*x44 - x18*x59 - x23*x58
    x61 = -(x56/x55)
    x62 = -(x26/x25)
    x63 = (x62 if x62 < 1.0 else 1.0)
    out[0] = v_x
    out[1] = v_y
    out[2] = v_z
    out[3] = v_yaw
    out[4] = v_lean
    out[5] = v_spin
    out[6] = -(c0*x59)
    out[7] = -(c0*x58)
    out[8] = -(c6 + c0*x57)
    out[9] = x12*x59 - (x43*x11 + x14*x60) + x22*x58
    out[10] = x6*x59 - c3*x46 - x24*x58 - x54*x57
    out[11] = x60
    out[12] = -x59
    out[13] = -x58
    out[14] = -x57
    out[15] = (x61 if x61 < x63 else x63)


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
    out[23] = x2
    out[28] = c1
    out[33] = x2
    out[35] = c2


@njit(error_model="numpy")
def forces(t, y, p, out):
    """Forces f of M a = f + G^T lambda. 49 operations."""
    p_m = p[0]
    p_r = p[1]
    p_g = p[2]
    c0 = -(p_m*p_g)
    c1 = p_r*p_r
    c2 = c1*(0.5*p_m)
    c3 = c1*(0.25*p_m)
    q_lean = y[4]
    v_yaw = y[9]
    v_lean = y[10]
    v_spin = y[11]
    x0 = 0.5*v_yaw
    x1 = cos(q_lean)
    x2 = v_lean*x1
    x3 = sin(q_lean)
    x4 = 2.0*x3
    x5 = 2.0*x1
    x6 = c2*(x2*x4) - c3*(v_lean*x3*x5)
    x7 = c2*x2
    x8 = 0.5*v_spin
    x9 = v_yaw*x0
    x10 = c3*(x3*(x9*x5)) - x1*(c2*(v_yaw*x8 + v_spin*x0) + c2*(x9*x4))
    out[0] = 0.0
    out[1] = 0.0
    out[2] = c0
    out[3] = -(x0*x6 + (0.5*(v_yaw*x6 + v_spin*x7) + x8*x7))
    out[4] = -x10
    out[5] = -(0.5*(v_yaw*x7) + x0*x7)


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
    """M a - f - G^T lambda, then G a - gamma. 137 operations."""
    p_m = p[0]
    p_r = p[1]
    p_g = p[2]
    c0 = 0.5*p_m
    c1 = p_m*p_g
    c2 = p_r*p_r
    c3 = c2*c0
    c4 = c2*(0.25*p_m)
    c5 = 0.5*c4
    c6 = 0.5*c3
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
    x0 = a_x*c0
    x1 = a_y*c0
    x2 = a_z*c0
    x3 = 0.5*v_yaw
    x4 = cos(q_lean)
    x5 = v_lean*x4
    x6 = sin(q_lean)
    x7 = 2.0*x6
    x8 = v_lean*x6
    x9 = 2.0*x4
    x10 = c3*(x5*x7) - c4*(x8*x9)
    x11 = c4*(x4*x4) + c3*(x6*x6)
    x12 = 0.5*a_yaw
    x13 = c3*x5
    x14 = x6*c3
    x15 = 0.5*v_spin
    x16 = 0.5*(v_yaw*x10 + a_yaw*x11 + (v_spin*x13 + a_spin*x14)) + (x15*x13 + x14*(0.5*a_spin))
    x17 = sin(q_yaw)
    x18 = cos(q_yaw)
    x19 = p_r*(lam_contact_y*x17 + lam_contact_x*x18)
    x20 = v_yaw*x3
    x21 = c4*(x6*(x20*x9)) - x4*(c3*(v_yaw*x15 + v_spin*x3) + c3*(x20*x7))
    x22 = a_lean*c5
    x23 = lam_contact_z*x6 + x4*(lam_contact_y*x18 - lam_contact_x*x17)
    x24 = x3*x13 + x14*x12 + (0.5*(v_yaw*x13 + a_yaw*x14 + a_spin*c3) + a_spin*c6)
    x25 = p_r*(a_spin + (v_yaw*x5 + a_yaw*x6))
    x26 = p_r*(v_spin + v_yaw*x6)
    x27 = v_yaw*x17
    x28 = v_lean*p_r
    x29 = x28*x4
    x30 = v_yaw*x18
    x31 = a_lean*p_r
    x32 = x4*x31 - x28*x8
    out[0] = x0 + x0 - lam_contact_x
    out[1] = x1 + x1 - lam_contact_y
    out[2] = c1 + (x2 + x2) - lam_contact_z
    out[3] = x3*x10 + x11*x12 + x16 + x6*x19
    out[4] = x21 + (x22 + x22) - p_r*x23
    out[5] = x19 + x24
    out[6] = a_x - (x18*x25 - x26*x27 + (x29*x30 + x17*x32))
    out[7] = a_y + (x18*x32 - x29*x27 - (x26*x30 + x17*x25))
    out[8] = a_z + (x28*x5 + x6*x31)


@njit(error_model="numpy")
def residual_jacobian(t, y, p, out):
    """Residual derivatives by q, v, a, lambda. 237 operations."""
    p_m = p[0]
    p_r = p[1]
    c0 = p_r*p_r
    c1 = c0*(0.5*p_m)
    c2 = c0*(0.25*p_m)
    c3 = 2.0*c2
    c4 = 2.0*c1
    c5 = 0.5*c1
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
    x0 = sin(q_lean)
    x1 = cos(q_yaw)
    x2 = sin(q_yaw)
    x3 = lam_contact_y*x1 - lam_contact_x*x2
    x4 = p_r*x3
    x5 = cos(q_lean)
    x6 = 2.0*x0
    x7 = 2.0*x5
    x8 = c2*(x0*x7)
    x9 = a_yaw*(c1*(x5*x6) - x8)
    x10 = x5*c1
    x11 = a_spin*x10
    x12 = v_lean*x0
    x13 = v_lean*x5
    x14 = 0.5*v_yaw
    x15 = x14 + x14
    x16 = 0.5*x9 + 0.5*x11 + 0.5*(x9 + x11) + (c2*(x12*x6) + c1*(x13*x7))*x15
    x17 = p_r*(x5*(lam_contact_y*x2 + lam_contact_x*x1))
    x18 = c3*(x5*x15)
    x19 = 0.5*v_spin
    x20 = c1*(x19 + x19)
    x21 = x0*c4
    x22 = x20 + x15*x21
    x23 = 0.5*(c1*(x13*x6) - c2*(x12*x7))
    x24 = c5*x13
    x25 = x24 + x24
    x26 = x0*c1
    x27 = p_r*x0
    x28 = x1*x27
    x29 = x2*x27
    x30 = p_r*(x0*x3 - lam_contact_z*x5) + c2*(x14*(v_yaw*(x5*x7 - x0*x6)))
    x31 = v_yaw*x5
    x32 = v_yaw*x21
    x33 = x30 - c4*(x5*(x31*x14)) + x0*(c1*(v_spin*x14 + 0.5*(v_yaw*v_spin)) + x14*x32)
    x34 = c1*x15
    x35 = x5*x34
    x36 = p_r*x5
    x37 = x2*x36
    x38 = x1*x36
    x39 = 0.5*(a_yaw*x10)
    x40 = p_r*x1
    x41 = p_r*x2
    x42 = p_r*(v_spin + v_yaw*x0)
    x43 = v_yaw*x1
    x44 = v_lean*p_r
    x45 = x44*x5
    x46 = v_yaw*x2
    x47 = p_r*(a_spin + (v_yaw*x13 + a_yaw*x0))
    x48 = a_lean*p_r
    x49 = x5*x48 - x44*x12
    x50 = x0*x48
    x51 = p_r*(a_yaw*x5)
    x52 = x0*x44
    x53 = x44*x2
    x54 = v_yaw*p_r
    x55 = x1*x54
    x56 = p_r*x46
    x57 = p_r*x13
    x58 = x44*x1
    x59 = x2*x54
    x60 = p_r*x43
    out[12] = p_m
    out[18] = -1.0
    out[34] = p_m
    out[40] = -1.0
    out[56] = p_m
    out[62] = -1.0
    out[66] = x0*x4
    out[67] = x16 + x17 - x13*x18 - x12*x22
    out[72] = x23 + x23
    out[73] = x5*x22 - x0*x18
    out[74] = x25
    out[78] = c2*(x5*x5) + c1*(x0*x0)
    out[80] = x26
    out[81] = x28
    out[82] = x29
    out[87] = x17
    out[88] = x33
    out[93] = 0.5*(v_yaw*x8) + x14*x8 - x5*(x20 + (0.5*x32 + x14*x21))
    out[95] = -x35
    out[100] = c2
    out[102] = x37
    out[103] = -x38
    out[104] = -x27
    out[108] = x4
    out[109] = x39 + x39 - x12*x34
    out[114] = x25
    out[115] = x35
    out[120] = x26
    out[122] = c1
    out[123] = x40
    out[124] = x41
    out[129] = x42*x43 + (x45*x46 + (x2*x47 - x1*x49))
    out[130] = x2*x50 - x1*x51 + x52*x43 + x13*x53 + x12*x55 + x31*x56
    out[135] = x42*x2 - (x1*x45 + x1*x57) + x0*x56
    out[136] = x0*x53 - x5*x55 + p_r*(x2*x12 - x5*x43)
    out[137] = x56
    out[138] = 1.0
    out[141] = -x28
    out[142] = -x37
    out[143] = -x40
    out[150] = x42*x46 - (x1*x47 + x2*x49) - x45*x43
    out[151] = x52*x46 - (x1*x50 + x2*x51) - x13*x58 + x12*x59 - x31*x60
    out[156] = -(x2*x45 + (x42*x1 + x2*x57) + x0*x60)
    out[157] = -(x0*x58 + x5*x59 + p_r*(x1*x12 + x5*x46))
    out[158] = -x60
    out[160] = 1.0
    out[162] = -x29
    out[163] = x38
    out[164] = -x41
    out[172] = x49
    out[178] = x45 + x57
    out[182] = 1.0
    out[184] = x27


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
    """State moved onto the constraints, and the residuals it had. 129 operations."""
    p_m = p[0]
    p_r = p[1]
    c0 = 1.0/p_m
    c1 = p_r*p_r
    c2 = c1*(0.25*p_m)
    c3 = c1*(0.5*p_m)
    c4 = 1.0/c2
    c5 = p_r*c4
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
    x8 = p_r*x0
    x9 = x2*x8
    x10 = 1.0/(c2*(x5*x5) + c3*(x0*x0))
    x11 = x9*x10
    x12 = x0*c3
    x13 = x12*x10
    x14 = x9*x13 - p_r*x2
    x15 = 1.0/(c3 - x12*x13)
    x16 = x14*x15
    x17 = p_r*x5
    x18 = x3*x17
    x19 = x18*c4
    x20 = 1.0/(c0 + x9*x11 + x14*x16 + x18*x19)
    x21 = x2*x17
    x22 = x3*x8
    x23 = x22*x13 - p_r*x3
    x24 = x21*x19 - (x22*x11 + x23*x16)
    x25 = x24*x20
    x26 = x22*x10
    x27 = x23*x15
    x28 = x21*c4
    x29 = 1.0/(x24*x25 - (c0 + x22*x26 + x23*x27 + x21*x28))
    x30 = v_y + (x2*x6 - x1*x3)
    x31 = x30 + x7*x25
    x32 = x8*x19
    x33 = x32*x25 - x8*x28
    x34 = x33*x29
    x35 = x32*x20
    x36 = x0*c5
    x37 = v_z + x0*x4
    x38 = 1.0/(x32*x35 - (c0 + x8*x36) - x33*x34)*(x34*x31 - (x37 + x7*x35))
    x39 = x29*x31 + x34*x38
    x40 = x7*x20 - x25*x39 + x35*x38
    x41 = x27*x39 - x16*x40
    out[0] = q_x
    out[1] = q_y
    out[2] = q_z
    out[3] = q_yaw
    out[4] = q_lean
    out[5] = q_spin
    out[6] = v_x - c0*x40
    out[7] = v_y + c0*x39
    out[8] = v_z - c0*x38
    out[9] = v_yaw + (x11*x40 - x13*x41 - x26*x39)
    out[10] = v_lean + (x19*x40 + x28*x39 - x36*x38)
    out[11] = v_spin + x41
    out[12] = x7
    out[13] = x30
    out[14] = x37


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


@njit(error_model="numpy")
def limits(t, y, p, out):
    """Numbers of parameters that have a bound. 6 operations."""
    p_m = p[0]
    p_r = p[1]
    c0 = 1.8*p_r
    c1 = p_r*p_r
    c2 = c1*(0.25*p_m)
    c3 = c1*(0.5*p_m)
    out[0] = c0
    out[1] = p_m
    out[2] = c2
    out[3] = c3
    out[4] = c2
    out[5] = c3
    out[6] = c2
    out[7] = p_r
