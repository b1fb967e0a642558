"""heavy_top_absolute: equations of motion, written by symgen 0.1.0. Do not edit.

The fast heavy top in absolute coordinates: a free body whose tip is held at the origin by three constraints
"""

from math import sqrt

from numba import njit

MODEL = {
    "abi": 1,
    "generator": "symgen 0.1.0",
    "source": "sha256:40351dda23f61d091c55dccf34bdba69cd10cbcf573314b46153d43e208673b6",
    "name": "heavy_top_absolute",
    "description": "The fast heavy top in absolute coordinates: a free body whose tip is held at the origin by three constraints",
    "nq": 7,
    "nv": 6,
    "nh": 3,
    "nn": 0,
    "nw": 0,
    "coordinates": [
        {"name": "move_x", "unit": "m", "value": 0.0, "enforced": True},
        {"name": "move_y", "unit": "m", "value": 1.0, "enforced": True},
        {"name": "move_z", "unit": "m", "value": 0.0, "enforced": True},
        {"name": "move_qw", "unit": "", "value": 1.0, "enforced": True},
        {"name": "move_qx", "unit": "", "value": 0.0, "enforced": True},
        {"name": "move_qy", "unit": "", "value": 0.0, "enforced": True},
        {"name": "move_qz", "unit": "", "value": 0.0, "enforced": True},
    ],
    "quaternions": [
        3,
    ],
    "rates": [
        {"name": "move_vx", "unit": "m/s", "value": 4.61538, "enforced": True},
        {"name": "move_vy", "unit": "m/s", "value": 0.0, "enforced": True},
        {"name": "move_vz", "unit": "m/s", "value": 0.0, "enforced": True},
        {"name": "move_wx", "unit": "rad/s", "value": 0.0, "enforced": True},
        {"name": "move_wy", "unit": "rad/s", "value": 150.0, "enforced": True},
        {"name": "move_wz", "unit": "rad/s", "value": -4.61538, "enforced": True},
    ],
    "parameters": [
        {"name": "m", "unit": "kg", "value": 15.0, "doc": ""},
        {"name": "l", "unit": "m", "value": 1.0, "doc": "from the fixed point to the centre of mass"},
        {"name": "Ja", "unit": "kg*m^2", "value": 0.46875, "doc": "inertia about the axis of symmetry"},
        {"name": "Jt", "unit": "kg*m^2", "value": 0.234375, "doc": "inertia across it, about the centre of mass"},
        {"name": "g", "unit": "m/s^2", "value": 9.81, "doc": ""},
    ],
    "inputs": [],
    "constants": [],
    "constraints": [
        {"name": "tip_stays_x", "kind": "holonomic", "multiplier": "N"},
        {"name": "tip_stays_y", "kind": "holonomic", "multiplier": "N"},
        {"name": "tip_stays_z", "kind": "holonomic", "multiplier": "N"},
    ],
    "outputs": [],
    "events": [],
    "bodies": [
        {"name": "top", "planar": False, "shape": "box", "sizes": 3, "mesh": ""},
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
        "rhs": 271,
        "mass_matrix": 0,
        "forces": 8,
        "energy": 20,
        "residual": 117,
        "residual_jacobian": 509,
        "constraint_residual": 64,
        "constraint_jacobian": 63,
        "gamma": 57,
        "project": 323,
        "kinematics": 13,
        "poses": 24,
        "shapes": 0,
        "marks": 1,
        "limits": 0,
    },
    "hoisted": {
        "rhs": 6,
        "forces": 2,
        "energy": 1,
        "residual": 1,
        "residual_jacobian": 4,
        "project": 2,
        "marks": 1,
    },
    "run": {
        "t_end": 2.0,
        "fps": 200.0,
    },
    "limits": [
        {"name": "bodies.top.mass", "bound": "zero or more"},
        {"name": "bodies.top.inertia[0]", "bound": "zero or more"},
        {"name": "bodies.top.inertia[1]", "bound": "zero or more"},
        {"name": "bodies.top.inertia", "bound": "a tensor without negative moments", "numbers": 3},
    ],
    "subsystems": [],
    "marks": [
        {"kind": "ground", "name": "tip_stays_2", "body": "", "numbers": 3},
        {"kind": "ball", "name": "tip_stays", "body": "top", "numbers": 3},
        {"kind": "reaction", "name": "tip_stays", "body": "top", "numbers": 3, "constraints": [0, 1, 2], "signs": [1, 1, 1]},
    ],
}

@njit(error_model="numpy")
def rhs(t, y, p, out):
    """State derivative: rates, accelerations, multipliers, pivot ratio. 271 operations."""
    p_m = p[0]
    p_l = p[1]
    p_Ja = p[2]
    p_Jt = p[3]
    p_g = p[4]
    c0 = 1.0/p_m
    c1 = 1.0/p_Jt
    c2 = p_l*c1
    c3 = p_m*p_g*c0
    c4 = p_Jt - p_Ja
    c5 = c4*c1
    q_move_qw = y[3]
    q_move_qx = y[4]
    q_move_qy = y[5]
    q_move_qz = y[6]
    v_move_vx = y[7]
    v_move_vy = y[8]
    v_move_vz = y[9]
    v_move_wx = y[10]
    v_move_wy = y[11]
    v_move_wz = y[12]
    x0 = 0.5*v_move_wx
    x1 = 0.5*v_move_wy
    x2 = 0.5*v_move_wz
    x3 = q_move_qy + q_move_qy
    x4 = q_move_qy*x3
    x5 = q_move_qz + q_move_qz
    x6 = q_move_qz*x5
    x7 = 1.0 - (x4 + x6)
    x8 = q_move_qx + q_move_qx
    x9 = q_move_qy*x8
    x10 = q_move_qw*x5
    x11 = x9 - x10
    x12 = q_move_qz*x8
    x13 = q_move_qw*x3
    x14 = x12 + x13
    x15 = x7*x7 + x11*x11 + x14*x14
    x16 = x15*c0
    x17 = x12 - x13
    x18 = q_move_qz*x3
    x19 = q_move_qw*x8
    x20 = x18 + x19
    x21 = q_move_qx*x8
    x22 = 1.0 - (x21 + x4)
    x23 = x7*x17 + x11*x20 + x14*x22
    x24 = x23*c0
    x25 = x23*x24
    x26 = x9 + x10
    x27 = 1.0 - (x21 + x6)
    x28 = x18 - x19
    x29 = x7*x26 + x11*x27 + x14*x28
    x30 = x29*c0
    x31 = x29*x30
    x32 = x14*c2
    x33 = x7*c2
    x34 = 1.0/(x25 + (x15*x16 + x31) + p_l*x14*x32 + p_l*x7*x33)
    x35 = v_move_wx*v_move_wy
    x36 = p_g*x17 - p_l*x35
    x37 = p_g*x20 + p_l*(v_move_wx*v_move_wx + v_move_wz*v_move_wz)
    x38 = v_move_wy*v_move_wz
    x39 = p_g*x22 - p_l*x38
    x40 = x38*c4
    x41 = x35*c4
    x42 = x23*c3 - (x7*x36 + x11*x37 + x14*x39) - x40*x32 - x41*x33
    x43 = x26*x26 + x27*x27 + x28*x28
    x44 = x26*x17 + x27*x20 + x28*x22
    x45 = p_l*x28
    x46 = p_l*x26
    x47 = x29*x16 + x43*x30 + x44*x24 + x45*x32 + x46*x33
    x48 = x47*x34
    x49 = x43*c0
    x50 = x44*c0
    x51 = x44*x50
    x52 = x28*c2
    x53 = x26*c2
    x54 = x31 + x43*x49 + x51 + x45*x52 + x46*x53
    x55 = x47*x48 - x54
    x56 = 1.0/x55
    x57 = x44*c3 - (x26*x36 + x27*x37 + x28*x39) - x40*x52 - x41*x53 - x48*x42
    x58 = x17*x17 + x20*x20 + x22*x22
    x59 = p_l*x22
    x60 = p_l*x17
    x61 = x23*x16 + x44*x30 + x58*x24 + x59*x32 + x60*x33
    x62 = x61*x48 - (x23*x30 + x44*x49 + x58*x50 + x59*x52 + x60*x53)
    x63 = x62*x56
    x64 = x61*x34
    x65 = x58*c0
    x66 = x22*c2
    x67 = x17*c2
    x68 = x25 + x51 + x58*x65 + x59*x66 + x60*x67
    x69 = x61*x64 - x68 - x62*x63
    x70 = x58*c3 - (x17*x36 + x20*x37 + x22*x39 - p_g) - x40*x66 - x41*x67
    x71 = 1.0/x69*(x70 - x64*x42 - x63*x57)
    x72 = x56*x57 - x63*x71
    x73 = x34*x42 + x48*x72 + x64*x71
    x74 = -(x69/x68)
    x75 = -(x55/x54)
    x76 = (x75 if x75 < 1.0 else 1.0)
    out[0] = v_move_vx
    out[1] = v_move_vy
    out[2] = v_move_vz
    out[3] = -(q_move_qx*x0 + q_move_qy*x1 + q_move_qz*x2)
    out[4] = q_move_qw*x0 - q_move_qz*x1 + q_move_qy*x2
    out[5] = q_move_qz*x0 + q_move_qw*x1 - q_move_qx*x2
    out[6] = q_move_qx*x1 - q_move_qy*x0 + q_move_qw*x2
    out[7] = x16*x73 - x30*x72 - x24*x71
    out[8] = x30*x73 - x49*x72 - x50*x71
    out[9] = x24*x73 - c3 - x50*x72 - x65*x71
    out[10] = x52*x72 - (x38*c5 + x32*x73) + x66*x71
    out[11] = 0.0
    out[12] = x35*c5 + x33*x73 - x53*x72 - x67*x71
    out[13] = x73
    out[14] = -x72
    out[15] = -x71
    out[16] = (x74 if x74 < x76 else x76)


@njit(error_model="numpy")
def mass_matrix(t, y, p, out):
    """Mass matrix M, row by row. 0 operations."""
    p_m = p[0]
    p_Ja = p[2]
    p_Jt = p[3]
    out[0] = p_m
    out[7] = p_m
    out[14] = p_m
    out[21] = p_Jt
    out[28] = p_Ja
    out[35] = p_Jt


@njit(error_model="numpy")
def forces(t, y, p, out):
    """Forces f of M a = f + G^T lambda. 8 operations."""
    p_m = p[0]
    p_Ja = p[2]
    p_Jt = p[3]
    p_g = p[4]
    c0 = -(p_m*p_g)
    c1 = p_Jt - p_Ja
    v_move_wx = y[10]
    v_move_wy = y[11]
    v_move_wz = y[12]
    out[0] = 0.0
    out[1] = 0.0
    out[2] = c0
    out[3] = -(v_move_wy*v_move_wz*c1)
    out[4] = 0.0
    out[5] = v_move_wx*v_move_wy*c1


@njit(error_model="numpy")
def energy(t, y, p, out):
    """Kinetic and potential energy. 20 operations."""
    p_m = p[0]
    p_Ja = p[2]
    p_Jt = p[3]
    p_g = p[4]
    c0 = p_m*p_g
    q_move_z = y[2]
    v_move_vx = y[7]
    v_move_vy = y[8]
    v_move_vz = y[9]
    v_move_wx = y[10]
    v_move_wy = y[11]
    v_move_wz = y[12]
    x0 = p_m*(v_move_vx*v_move_vx) + p_m*(v_move_vy*v_move_vy) + p_m*(v_move_vz*v_move_vz)
    x1 = p_Jt*(v_move_wx*v_move_wx) + p_Ja*(v_move_wy*v_move_wy) + p_Jt*(v_move_wz*v_move_wz)
    out[0] = 0.5*(x0 + x1)
    out[1] = q_move_z*c0


@njit(error_model="numpy")
def residual(t, y, p, out):
    """M a - f - G^T lambda, then G a - gamma. 117 operations."""
    p_m = p[0]
    p_l = p[1]
    p_Ja = p[2]
    p_Jt = p[3]
    p_g = p[4]
    c0 = p_Jt - p_Ja
    q_move_qw = y[3]
    q_move_qx = y[4]
    q_move_qy = y[5]
    q_move_qz = y[6]
    v_move_wx = y[10]
    v_move_wy = y[11]
    v_move_wz = y[12]
    a_move_vx = y[13]
    a_move_vy = y[14]
    a_move_vz = y[15]
    a_move_wx = y[16]
    a_move_wy = y[17]
    a_move_wz = y[18]
    lam_tip_stays_x = y[19]
    lam_tip_stays_y = y[20]
    lam_tip_stays_z = y[21]
    x0 = q_move_qx + q_move_qx
    x1 = q_move_qz*x0
    x2 = q_move_qy + q_move_qy
    x3 = q_move_qw*x2
    x4 = x1 + x3
    x5 = q_move_qx*x0
    x6 = q_move_qy*x2
    x7 = 1.0 - (x5 + x6)
    x8 = q_move_qz*x2
    x9 = q_move_qw*x0
    x10 = x8 - x9
    x11 = lam_tip_stays_z*x7 + lam_tip_stays_y*x10 + lam_tip_stays_x*x4
    x12 = q_move_qy*x0
    x13 = q_move_qz + q_move_qz
    x14 = q_move_qw*x13
    x15 = x12 - x14
    x16 = x8 + x9
    x17 = q_move_qz*x13
    x18 = 1.0 - (x5 + x17)
    x19 = lam_tip_stays_z*x16 + lam_tip_stays_y*x18 + lam_tip_stays_x*x15
    x20 = 1.0 - (x6 + x17)
    x21 = x1 - x3
    x22 = x12 + x14
    x23 = lam_tip_stays_z*x21 + lam_tip_stays_y*x22 + lam_tip_stays_x*x20
    x24 = a_move_vz + p_g
    x25 = v_move_wy*v_move_wz
    x26 = v_move_wx*v_move_wy
    x27 = a_move_vx*x20 + a_move_vy*x22 + x21*x24 - p_l*(x26 - a_move_wz)
    x28 = p_l*(v_move_wx*v_move_wx + v_move_wz*v_move_wz) + (a_move_vx*x15 + a_move_vy*x18 + x16*x24)
    x29 = a_move_vx*x4 + a_move_vy*x10 + x7*x24 - p_l*(a_move_wx + x25)
    out[0] = a_move_vx*p_m - (x4*x11 + x15*x19 + x20*x23)
    out[1] = a_move_vy*p_m - (x10*x11 + x18*x19 + x22*x23)
    out[2] = p_m*x24 - (x7*x11 + x16*x19 + x21*x23)
    out[3] = x25*c0 + a_move_wx*p_Jt + p_l*x11
    out[4] = a_move_wy*p_Ja
    out[5] = a_move_wz*p_Jt - x26*c0 - p_l*x23
    out[6] = x20*x27 + x15*x28 + x4*x29
    out[7] = x22*x27 + x18*x28 + x10*x29
    out[8] = x21*x27 + x16*x28 + x7*x29 - p_g


@njit(error_model="numpy")
def residual_jacobian(t, y, p, out):
    """Residual derivatives by q, v, a, lambda. 509 operations."""
    p_m = p[0]
    p_l = p[1]
    p_Ja = p[2]
    p_Jt = p[3]
    p_g = p[4]
    c0 = p_Jt + (p_Ja + p_Jt)
    c1 = c0 - 2.0*p_Ja
    c2 = c0 - 2.0*p_Jt
    c3 = 2.0*p_l
    q_move_qw = y[3]
    q_move_qx = y[4]
    q_move_qy = y[5]
    q_move_qz = y[6]
    v_move_wx = y[10]
    v_move_wy = y[11]
    v_move_wz = y[12]
    a_move_vx = y[13]
    a_move_vy = y[14]
    a_move_vz = y[15]
    a_move_wx = y[16]
    a_move_wz = y[18]
    lam_tip_stays_x = y[19]
    lam_tip_stays_y = y[20]
    lam_tip_stays_z = y[21]
    x0 = q_move_qy + q_move_qy
    x1 = q_move_qx + q_move_qx
    x2 = q_move_qx*x1
    x3 = q_move_qy*x0
    x4 = 1.0 - (x2 + x3)
    x5 = q_move_qz*x0
    x6 = q_move_qw*x1
    x7 = x5 - x6
    x8 = q_move_qz*x1
    x9 = q_move_qw*x0
    x10 = x8 + x9
    x11 = lam_tip_stays_z*x4 + lam_tip_stays_y*x7 + lam_tip_stays_x*x10
    x12 = x0*x11
    x13 = lam_tip_stays_y*x1
    x14 = lam_tip_stays_x*x0 - x13
    x15 = q_move_qy*x1
    x16 = q_move_qz + q_move_qz
    x17 = q_move_qw*x16
    x18 = x15 - x17
    x19 = lam_tip_stays_z*x1
    x20 = x19 - lam_tip_stays_x*x16
    x21 = x5 + x6
    x22 = q_move_qz*x16
    x23 = 1.0 - (x2 + x22)
    x24 = lam_tip_stays_z*x21 + lam_tip_stays_y*x23 + lam_tip_stays_x*x18
    x25 = 1.0 - (x3 + x22)
    x26 = lam_tip_stays_z*x0
    x27 = lam_tip_stays_y*x16 - x26
    x28 = 2.0*q_move_qz
    x29 = x11*x28
    x30 = x1 + 2.0*q_move_qx
    x31 = 2.0*q_move_qw
    x32 = lam_tip_stays_y*x31
    x33 = lam_tip_stays_x*x28 - (lam_tip_stays_z*x30 + x32)
    x34 = 2.0*q_move_qy
    x35 = lam_tip_stays_z*x31
    x36 = x35 - lam_tip_stays_y*x30 + lam_tip_stays_x*x34
    x37 = lam_tip_stays_z*x28
    x38 = x37 + lam_tip_stays_y*x34
    x39 = x11*x31
    x40 = x0 + x34
    x41 = lam_tip_stays_x*x31
    x42 = lam_tip_stays_y*x28 - lam_tip_stays_z*x40 + x41
    x43 = x1*x24
    x44 = lam_tip_stays_x*x1
    x45 = x37 + x44
    x46 = x13 - x35 - lam_tip_stays_x*x40
    x47 = x8 - x9
    x48 = x15 + x17
    x49 = lam_tip_stays_z*x47 + lam_tip_stays_y*x48 + lam_tip_stays_x*x25
    x50 = x1*x11
    x51 = lam_tip_stays_y*x0 + x44
    x52 = x16 + x28
    x53 = x26 - lam_tip_stays_y*x52 - x41
    x54 = x24*x31
    x55 = x19 + x32 - lam_tip_stays_x*x52
    x56 = x25*x25 + x18*x18 + x10*x10
    x57 = x25*x48 + x18*x23 + x10*x7
    x58 = -x57
    x59 = x25*x47 + x18*x21 + x10*x4
    x60 = -x59
    x61 = x1*x49
    x62 = x49*x31
    x63 = x48*x48 + x23*x23 + x7*x7
    x64 = x48*x47 + x23*x21 + x7*x4
    x65 = -x64
    x66 = x47*x47 + x21*x21 + x4*x4
    x67 = v_move_wy*c2 - v_move_wy*p_Jt
    x68 = p_l*x10
    x69 = p_l*x7
    x70 = p_l*x4
    x71 = p_l*x25
    x72 = p_l*x48
    x73 = p_l*x47
    x74 = a_move_vz + p_g
    x75 = x0*x74
    x76 = a_move_vy*x16 - x75
    x77 = x1*x74
    x78 = x77 - a_move_vx*x16
    x79 = p_l*(v_move_wx*v_move_wx + v_move_wz*v_move_wz) + (a_move_vx*x18 + a_move_vy*x23 + x21*x74)
    x80 = a_move_vx*x10 + a_move_vy*x7 + x4*x74 - p_l*(a_move_wx + v_move_wy*v_move_wz)
    x81 = x0*x80
    x82 = a_move_vy*x1
    x83 = a_move_vx*x0 - x82
    x84 = x74*x28
    x85 = a_move_vy*x34 + x84
    x86 = x74*x31
    x87 = x86 + (a_move_vx*x34 - a_move_vy*x30)
    x88 = x80*x28
    x89 = a_move_vy*x31
    x90 = a_move_vx*x28 - x89 - x74*x30
    x91 = x82 - a_move_vx*x40 - x86
    x92 = a_move_vx*x25 + a_move_vy*x48 + x47*x74 - p_l*(v_move_wx*v_move_wy - a_move_wz)
    x93 = x1*x79
    x94 = a_move_vx*x1
    x95 = x84 + x94
    x96 = x80*x31
    x97 = a_move_vx*x31
    x98 = x97 + a_move_vy*x28 - x74*x40
    x99 = x89 - a_move_vx*x52 + x77
    x100 = x75 - (x97 + a_move_vy*x52)
    x101 = x79*x31
    x102 = x1*x80
    x103 = x94 + a_move_vy*x0
    x104 = v_move_wx*c3
    x105 = v_move_wy*p_l
    x106 = v_move_wz*p_l
    x107 = v_move_wx*p_l
    x108 = v_move_wz*c3
    x109 = x1*x92
    x110 = x92*x31
    out[3] = -(x12 + x10*x14 + (x18*x20 - x16*x24) + x25*x27)
    out[4] = -(x29 + x10*x33 + (x24*x34 + x18*x36) + x25*x38)
    out[5] = -(x39 + x10*x42 + (x43 + x18*x45) + (x25*x46 - x49*x40))
    out[6] = -(x50 + x10*x51 + (x18*x53 - x54) + (x25*x55 - x49*x52))
    out[13] = p_m
    out[19] = -x56
    out[20] = x58
    out[21] = x60
    out[25] = -(x7*x14 - x50 + x23*x20 + (x16*x49 + x48*x27))
    out[26] = -(x7*x33 - x39 + (x23*x36 - x24*x30) + (x49*x34 + x48*x38))
    out[27] = -(x29 + x7*x42 + x23*x45 + (x61 + x48*x46))
    out[28] = -(x12 + x7*x51 + (x23*x53 - x24*x52) + (x62 + x48*x55))
    out[36] = p_m
    out[41] = x58
    out[42] = -x63
    out[43] = x65
    out[47] = -(x4*x14 + (x43 + x21*x20) + (x47*x27 - x0*x49))
    out[48] = -(x4*x33 - x11*x30 + (x54 + x21*x36) + (x49*x28 + x47*x38))
    out[49] = -(x4*x42 - x11*x40 + (x24*x28 + x21*x45) + (x47*x46 - x62))
    out[50] = -(x4*x51 + (x0*x24 + x21*x53) + (x61 + x47*x55))
    out[59] = p_m
    out[63] = x60
    out[64] = x65
    out[65] = -x66
    out[69] = p_l*x14
    out[70] = p_l*x33
    out[71] = p_l*x42
    out[72] = p_l*x51
    out[77] = v_move_wz*c1 - v_move_wz*p_Jt
    out[78] = -x67
    out[82] = p_Jt
    out[85] = x68
    out[86] = x69
    out[87] = x70
    out[98] = v_move_wz*p_Ja - v_move_wz*c2
    out[100] = v_move_wx*c2 - v_move_wx*p_Ja
    out[105] = p_Ja
    out[113] = -(p_l*x27)
    out[114] = -(p_l*x38)
    out[115] = -(p_l*x46)
    out[116] = -(p_l*x55)
    out[120] = x67
    out[121] = v_move_wx*p_Jt - v_move_wx*c1
    out[128] = p_Jt
    out[129] = -x71
    out[130] = -x72
    out[131] = -x73
    out[135] = x25*x76 + (x18*x78 - x16*x79) + (x81 + x10*x83)
    out[136] = x25*x85 + (x79*x34 + x18*x87) + (x88 + x10*x90)
    out[137] = x25*x91 - x92*x40 + (x93 + x18*x95) + (x96 + x10*x98)
    out[138] = x25*x99 - x92*x52 + (x18*x100 - x101) + (x102 + x10*x103)
    out[142] = x18*x104 - x25*x105
    out[143] = -(x10*x106 + x25*x107)
    out[144] = x18*x108 - x10*x105
    out[145] = x56
    out[146] = x57
    out[147] = x59
    out[148] = -x68
    out[150] = x71
    out[157] = x16*x92 + x48*x76 + x23*x78 + (x7*x83 - x102)
    out[158] = x92*x34 + x48*x85 + (x23*x87 - x79*x30) + (x7*x90 - x96)
    out[159] = x109 + x48*x91 + x23*x95 + (x88 + x7*x98)
    out[160] = x110 + x48*x99 + (x23*x100 - x79*x52) + (x81 + x7*x103)
    out[164] = x23*x104 - x48*x105
    out[165] = -(x7*x106 + x48*x107)
    out[166] = x23*x108 - x7*x105
    out[167] = x57
    out[168] = x63
    out[169] = x64
    out[170] = -x69
    out[172] = x72
    out[179] = x47*x76 - x0*x92 + (x93 + x21*x78) + x4*x83
    out[180] = x92*x28 + x47*x85 + (x101 + x21*x87) + (x4*x90 - x80*x30)
    out[181] = x47*x91 - x110 + (x79*x28 + x21*x95) + (x4*x98 - x80*x40)
    out[182] = x109 + x47*x99 + (x0*x79 + x21*x100) + x4*x103
    out[186] = x21*x104 - x47*x105
    out[187] = -(x4*x106 + x47*x107)
    out[188] = x21*x108 - x4*x105
    out[189] = x59
    out[190] = x64
    out[191] = x66
    out[192] = -x70
    out[194] = x73


@njit(error_model="numpy")
def constraint_residual(t, y, p, out):
    """Position residuals, velocity residuals. 64 operations."""
    p_l = p[1]
    q_move_x = y[0]
    q_move_y = y[1]
    q_move_z = y[2]
    q_move_qw = y[3]
    q_move_qx = y[4]
    q_move_qy = y[5]
    q_move_qz = y[6]
    v_move_vx = y[7]
    v_move_vy = y[8]
    v_move_vz = y[9]
    v_move_wx = y[10]
    v_move_wz = y[12]
    x0 = q_move_qx + q_move_qx
    x1 = q_move_qy*x0
    x2 = q_move_qz + q_move_qz
    x3 = q_move_qw*x2
    x4 = x1 - x3
    x5 = q_move_qx*x0
    x6 = q_move_qz*x2
    x7 = 1.0 - (x5 + x6)
    x8 = q_move_qy + q_move_qy
    x9 = q_move_qz*x8
    x10 = q_move_qw*x0
    x11 = x9 + x10
    x12 = q_move_qy*x8
    x13 = 1.0 - (x12 + x6)
    x14 = x1 + x3
    x15 = q_move_qz*x0
    x16 = q_move_qw*x8
    x17 = x15 - x16
    x18 = v_move_wz*p_l + (v_move_vx*x13 + v_move_vy*x14 + v_move_vz*x17)
    x19 = v_move_vx*x4 + v_move_vy*x7 + v_move_vz*x11
    x20 = x15 + x16
    x21 = x9 - x10
    x22 = 1.0 - (x5 + x12)
    x23 = v_move_vx*x20 + v_move_vy*x21 + v_move_vz*x22 - v_move_wx*p_l
    out[0] = q_move_x - p_l*x4
    out[1] = q_move_y - p_l*x7
    out[2] = q_move_z - p_l*x11
    out[3] = x13*x18 + x4*x19 + x20*x23
    out[4] = x14*x18 + x7*x19 + x21*x23
    out[5] = x17*x18 + x11*x19 + x22*x23


@njit(error_model="numpy")
def constraint_jacobian(t, y, p, out):
    """Constraint Jacobian G, row by row. 63 operations."""
    p_l = p[1]
    q_move_qw = y[3]
    q_move_qx = y[4]
    q_move_qy = y[5]
    q_move_qz = y[6]
    x0 = q_move_qy + q_move_qy
    x1 = q_move_qy*x0
    x2 = q_move_qz + q_move_qz
    x3 = q_move_qz*x2
    x4 = 1.0 - (x1 + x3)
    x5 = q_move_qx + q_move_qx
    x6 = q_move_qy*x5
    x7 = q_move_qw*x2
    x8 = x6 - x7
    x9 = q_move_qz*x5
    x10 = q_move_qw*x0
    x11 = x9 + x10
    x12 = x6 + x7
    x13 = q_move_qx*x5
    x14 = 1.0 - (x13 + x3)
    x15 = q_move_qz*x0
    x16 = q_move_qw*x5
    x17 = x15 - x16
    x18 = x4*x12 + x8*x14 + x11*x17
    x19 = x9 - x10
    x20 = x15 + x16
    x21 = 1.0 - (x13 + x1)
    x22 = x4*x19 + x8*x20 + x11*x21
    x23 = x12*x19 + x14*x20 + x17*x21
    out[0] = x4*x4 + x8*x8 + x11*x11
    out[1] = x18
    out[2] = x22
    out[3] = -(p_l*x11)
    out[5] = p_l*x4
    out[6] = x18
    out[7] = x12*x12 + x14*x14 + x17*x17
    out[8] = x23
    out[9] = -(p_l*x17)
    out[11] = p_l*x12
    out[12] = x22
    out[13] = x23
    out[14] = x19*x19 + x20*x20 + x21*x21
    out[15] = -(p_l*x21)
    out[17] = p_l*x19


@njit(error_model="numpy")
def gamma(t, y, p, out):
    """Right-hand side of G a = gamma. 57 operations."""
    p_l = p[1]
    p_g = p[4]
    q_move_qw = y[3]
    q_move_qx = y[4]
    q_move_qy = y[5]
    q_move_qz = y[6]
    v_move_wx = y[10]
    v_move_wy = y[11]
    v_move_wz = y[12]
    x0 = q_move_qy + q_move_qy
    x1 = q_move_qy*x0
    x2 = q_move_qz + q_move_qz
    x3 = q_move_qz*x2
    x4 = q_move_qx + q_move_qx
    x5 = q_move_qz*x4
    x6 = q_move_qw*x0
    x7 = x5 - x6
    x8 = p_g*x7 - p_l*(v_move_wx*v_move_wy)
    x9 = q_move_qy*x4
    x10 = q_move_qw*x2
    x11 = q_move_qz*x0
    x12 = q_move_qw*x4
    x13 = x11 + x12
    x14 = p_g*x13 + p_l*(v_move_wx*v_move_wx + v_move_wz*v_move_wz)
    x15 = q_move_qx*x4
    x16 = 1.0 - (x15 + x1)
    x17 = p_g*x16 - p_l*(v_move_wy*v_move_wz)
    out[0] = -((1.0 - (x1 + x3))*x8 + (x9 - x10)*x14 + (x5 + x6)*x17)
    out[1] = -((x9 + x10)*x8 + (1.0 - (x15 + x3))*x14 + (x11 - x12)*x17)
    out[2] = -(x7*x8 + x13*x14 + x16*x17 - p_g)


@njit(error_model="numpy")
def project(t, y, p, out):
    """State moved onto the constraints, and the residuals it had. 323 operations."""
    p_m = p[0]
    p_l = p[1]
    p_Jt = p[3]
    c0 = 1.0/p_m
    c1 = p_l*(1.0/p_Jt)
    q_move_x = y[0]
    q_move_y = y[1]
    q_move_z = y[2]
    q_move_qw = y[3]
    q_move_qx = y[4]
    q_move_qy = y[5]
    q_move_qz = y[6]
    v_move_vx = y[7]
    v_move_vy = y[8]
    v_move_vz = y[9]
    v_move_wx = y[10]
    v_move_wy = y[11]
    v_move_wz = y[12]
    x0 = q_move_qy + q_move_qy
    x1 = q_move_qy*x0
    x2 = q_move_qz + q_move_qz
    x3 = q_move_qz*x2
    x4 = 1.0 - (x1 + x3)
    x5 = q_move_qx + q_move_qx
    x6 = q_move_qy*x5
    x7 = q_move_qw*x2
    x8 = x6 - x7
    x9 = q_move_qz*x5
    x10 = q_move_qw*x0
    x11 = x9 + x10
    x12 = x4*x4 + x8*x8 + x11*x11
    x13 = x12*c0
    x14 = q_move_x - p_l*x8
    x15 = x9 - x10
    x16 = q_move_qz*x0
    x17 = q_move_qw*x5
    x18 = x16 + x17
    x19 = q_move_qx*x5
    x20 = 1.0 - (x19 + x1)
    x21 = x4*x15 + x8*x18 + x11*x20
    x22 = x21*c0
    x23 = x21*x22
    x24 = x6 + x7
    x25 = 1.0 - (x19 + x3)
    x26 = x16 - x17
    x27 = x4*x24 + x8*x25 + x11*x26
    x28 = x27*c0
    x29 = x27*x28
    x30 = x11*c1
    x31 = x4*c1
    x32 = 1.0/(x23 + (x12*x13 + x29) + p_l*x11*x30 + p_l*x4*x31)
    x33 = x24*x24 + x25*x25 + x26*x26
    x34 = x24*x15 + x25*x18 + x26*x20
    x35 = p_l*x26
    x36 = p_l*x24
    x37 = x27*x13 + x33*x28 + x34*x22 + x35*x30 + x36*x31
    x38 = x37*x32
    x39 = x33*c0
    x40 = x34*c0
    x41 = x34*x40
    x42 = x26*c1
    x43 = x24*c1
    x44 = 1.0/(x37*x38 - (x29 + x33*x39 + x41 + x35*x42 + x36*x43))
    x45 = q_move_y - p_l*x25
    x46 = x14*x38 - x45
    x47 = x15*x15 + x18*x18 + x20*x20
    x48 = p_l*x20
    x49 = p_l*x15
    x50 = x21*x13 + x34*x28 + x47*x22 + x48*x30 + x49*x31
    x51 = x50*x38 - (x21*x28 + x34*x39 + x47*x40 + x48*x42 + x49*x43)
    x52 = x51*x44
    x53 = x50*x32
    x54 = x47*c0
    x55 = x20*c1
    x56 = x15*c1
    x57 = x50*x53 - (x23 + x41 + x47*x54 + x48*x55 + x49*x56) - x51*x52
    x58 = 1.0/x57
    x59 = q_move_z - p_l*x18
    x60 = x58*(x14*x53 - x59 - x52*x46)
    x61 = x44*x46 - x52*x60
    x62 = x14*x32 - x38*x61 - x53*x60
    x63 = 0.5*(x30*x62 + x42*x61 + x55*x60)
    x64 = 0.5*(x31*x62 + x43*x61 + x56*x60)
    x65 = q_move_qw - (q_move_qx*x63 - q_move_qz*x64)
    x66 = q_move_qx + (q_move_qw*x63 - q_move_qy*x64)
    x67 = q_move_qy + (q_move_qz*x63 + q_move_qx*x64)
    x68 = q_move_qz - (q_move_qy*x63 + q_move_qw*x64)
    x69 = 1.0/sqrt(x65*x65 + x66*x66 + x67*x67 + x68*x68)
    x70 = x65*x69
    x71 = x66*x69
    x72 = x67*x69
    x73 = x68*x69
    x74 = x72 + x72
    x75 = x72*x74
    x76 = x73 + x73
    x77 = x73*x76
    x78 = 1.0 - (x75 + x77)
    x79 = x71 + x71
    x80 = x72*x79
    x81 = x70*x76
    x82 = x80 + x81
    x83 = x73*x79
    x84 = x70*x74
    x85 = x83 - x84
    x86 = v_move_wz*p_l + (v_move_vx*x78 + v_move_vy*x82 + v_move_vz*x85)
    x87 = x80 - x81
    x88 = x71*x79
    x89 = 1.0 - (x88 + x77)
    x90 = x73*x74
    x91 = x70*x79
    x92 = x90 + x91
    x93 = v_move_vx*x87 + v_move_vy*x89 + v_move_vz*x92
    x94 = x83 + x84
    x95 = x90 - x91
    x96 = 1.0 - (x88 + x75)
    x97 = v_move_vx*x94 + v_move_vy*x95 + v_move_vz*x96 - v_move_wx*p_l
    x98 = x78*x86 + x87*x93 + x94*x97
    x99 = x82*x86 + x89*x93 + x95*x97
    x100 = x38*x98 - x99
    x101 = x85*x86 + x92*x93 + x96*x97
    x102 = x58*(x53*x98 - x101 - x52*x100)
    x103 = x44*x100 - x52*x102
    x104 = x32*x98 - x38*x103 - x53*x102
    out[0] = q_move_x - (x13*x62 + x28*x61 + x22*x60)
    out[1] = q_move_y - (x28*x62 + x39*x61 + x40*x60)
    out[2] = q_move_z - (x22*x62 + x40*x61 + x54*x60)
    out[3] = x70
    out[4] = x71
    out[5] = x72
    out[6] = x73
    out[7] = v_move_vx - (x13*x104 + x28*x103 + x22*x102)
    out[8] = v_move_vy - (x28*x104 + x39*x103 + x40*x102)
    out[9] = v_move_vz - (x22*x104 + x40*x103 + x54*x102)
    out[10] = v_move_wx + (x30*x104 + x42*x103 + x55*x102)
    out[11] = v_move_wy
    out[12] = v_move_wz - (x31*x104 + x43*x103 + x56*x102)
    out[13] = x14
    out[14] = x45
    out[15] = x59
    out[16] = x98
    out[17] = x99
    out[18] = x101


@njit(error_model="numpy")
def kinematics(t, y, p, out):
    """N of dq/dt = N v, row by row; derivative of N v by q. 13 operations."""
    q_move_qw = y[3]
    q_move_qx = y[4]
    q_move_qy = y[5]
    q_move_qz = y[6]
    v_move_wx = y[10]
    v_move_wy = y[11]
    v_move_wz = y[12]
    x0 = 0.5*q_move_qx
    x1 = -x0
    x2 = 0.5*q_move_qy
    x3 = -x2
    x4 = 0.5*q_move_qz
    x5 = -x4
    x6 = 0.5*q_move_qw
    x7 = 0.5*v_move_wx
    x8 = -x7
    x9 = 0.5*v_move_wy
    x10 = -x9
    x11 = 0.5*v_move_wz
    x12 = -x11
    out[0] = 1.0
    out[7] = 1.0
    out[14] = 1.0
    out[21] = x1
    out[22] = x3
    out[23] = x5
    out[27] = x6
    out[28] = x5
    out[29] = x2
    out[33] = x4
    out[34] = x6
    out[35] = x1
    out[39] = x3
    out[40] = x0
    out[41] = x6
    out[67] = x8
    out[68] = x10
    out[69] = x12
    out[73] = x7
    out[75] = x11
    out[76] = x10
    out[80] = x9
    out[81] = x12
    out[83] = x7
    out[87] = x11
    out[88] = x9
    out[89] = x8


@njit(error_model="numpy")
def poses(t, y, p, out):
    """Per body: position, rotation matrix (body to world). 24 operations."""
    q_move_x = y[0]
    q_move_y = y[1]
    q_move_z = y[2]
    q_move_qw = y[3]
    q_move_qx = y[4]
    q_move_qy = y[5]
    q_move_qz = y[6]
    x0 = q_move_qy + q_move_qy
    x1 = q_move_qy*x0
    x2 = q_move_qz + q_move_qz
    x3 = q_move_qz*x2
    x4 = q_move_qx + q_move_qx
    x5 = q_move_qy*x4
    x6 = q_move_qw*x2
    x7 = q_move_qz*x4
    x8 = q_move_qw*x0
    x9 = q_move_qx*x4
    x10 = q_move_qz*x0
    x11 = q_move_qw*x4
    out[0] = q_move_x
    out[1] = q_move_y
    out[2] = q_move_z
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
    out[0] = 0.4
    out[1] = 0.05
    out[2] = 0.4


@njit(error_model="numpy")
def marks(t, y, p, out):
    """What a picture shows besides bodies, as `marks` lists it. 1 operation."""
    p_l = p[1]
    c0 = -p_l
    out[4] = c0
    out[7] = c0


@njit(error_model="numpy")
def limits(t, y, p, out):
    """Numbers of parameters that have a bound. 0 operations."""
    p_m = p[0]
    p_Ja = p[2]
    p_Jt = p[3]
    out[0] = p_m
    out[1] = p_Jt
    out[2] = p_Ja
    out[3] = p_Jt
    out[4] = p_Ja
    out[5] = p_Jt
