"""rack_and_pinion: equations of motion, written by symgen 0.1.0. Do not edit.

Steering: a wheel turns a pinion by a torsion bar, its rack moves tie rods, and these the knuckles of two wheels
"""

from math import cos, fabs, sin

from numba import njit

MODEL = {
    "abi": 1,
    "generator": "symgen 0.1.0",
    "source": "sha256:bd3811a80c6d9691b304cb00ab89f7a63a9ffd61b027384395fc238d4c74d43e",
    "name": "rack_and_pinion",
    "description": "Steering: a wheel turns a pinion by a torsion bar, its rack moves tie rods, and these the knuckles of two wheels",
    "nq": 5,
    "nv": 5,
    "nh": 3,
    "nn": 0,
    "nw": 1,
    "coordinates": [
        {"name": "rack", "unit": "m", "value": 0.0, "enforced": False},
        {"name": "left", "unit": "", "value": 0.0, "enforced": False},
        {"name": "right", "unit": "", "value": 0.0, "enforced": False},
        {"name": "wheel", "unit": "rad", "value": 0.0, "enforced": False},
        {"name": "pinion", "unit": "rad", "value": 0.0, "enforced": False},
    ],
    "quaternions": [],
    "rates": [
        {"name": "rack", "unit": "m/s", "value": 0.0, "enforced": False},
        {"name": "left", "unit": "", "value": 0.0, "enforced": False},
        {"name": "right", "unit": "", "value": 0.0, "enforced": False},
        {"name": "wheel", "unit": "rad/s", "value": 0.0, "enforced": False},
        {"name": "pinion", "unit": "rad/s", "value": 0.0, "enforced": False},
    ],
    "parameters": [
        {"name": "J_wheel", "unit": "kg*m^2", "value": 0.04, "doc": ""},
        {"name": "J_pinion", "unit": "kg*m^2", "value": 0.0002, "doc": ""},
        {"name": "k_bar", "unit": "N*m", "value": 90.0, "doc": "stiffness of the torsion bar, per radian"},
        {"name": "c_bar", "unit": "N*m*s", "value": 0.4, "doc": ""},
        {"name": "r", "unit": "m", "value": 0.008, "doc": "of the pinion"},
        {"name": "m_rack", "unit": "kg", "value": 2.5, "doc": ""},
        {"name": "c_rack", "unit": "N*s/m", "value": 150.0, "doc": ""},
        {"name": "J_knuckle", "unit": "kg*m^2", "value": 0.9, "doc": ""},
        {"name": "k_align", "unit": "N*m", "value": 250.0, "doc": "what turns a rolling wheel straight, per radian"},
        {"name": "c_align", "unit": "N*m*s", "value": 12.0, "doc": ""},
        {"name": "half", "unit": "m", "value": 0.68, "doc": "from the middle of the car to a kingpin"},
        {"name": "arm", "unit": "m", "value": 0.16, "doc": ""},
        {"name": "toe", "unit": "rad", "value": 0.3141592653589793, "doc": "by which the arms point inwards: Ackermann's geometry"},
        {"name": "behind", "unit": "m", "value": 0.13, "doc": "the rack, behind the kingpins"},
        {"name": "end", "unit": "m", "value": 0.35, "doc": "from the rack's middle to its ball joints"},
        {"name": "rod", "unit": "m", "value": 0.25, "doc": "length of a tie rod, found so that the wheels run straight"},
    ],
    "inputs": [
        {"name": "hands", "unit": "N*m", "value": 0.0, "table": {"kind": "linear", "t": [0.0, 0.5, 1.5, 2.0, 3.0, 3.5], "values": [0.0, 4.0, 4.0, -4.0, -4.0, 0.0]}},
    ],
    "constants": [],
    "constraints": [
        {"name": "left_rod", "kind": "holonomic", "multiplier": "N/m"},
        {"name": "right_rod", "kind": "holonomic", "multiplier": "N/m"},
        {"name": "mesh", "kind": "holonomic", "multiplier": "N"},
    ],
    "outputs": [
        {"name": "felt", "unit": "N*m"},
        {"name": "rack_force", "unit": ""},
        {"name": "turned_more", "unit": ""},
    ],
    "events": [],
    "bodies": [
        {"name": "rack", "planar": True, "shape": "box", "sizes": 3, "mesh": ""},
        {"name": "left", "planar": True, "shape": "box", "sizes": 3, "mesh": ""},
        {"name": "right", "planar": True, "shape": "box", "sizes": 3, "mesh": ""},
    ],
    "structure": {
        "conservative": False,
        "time_dependent": False,
        "constant_mass": True,
        "diagonal_mass": True,
        "velocity_dependent": True,
        "separable": False,
    },
    "operations": {
        "rhs": 177,
        "mass_matrix": 0,
        "forces": 17,
        "energy": 28,
        "residual": 120,
        "residual_jacobian": 160,
        "constraint_residual": 50,
        "constraint_jacobian": 31,
        "gamma": 57,
        "project": 164,
        "poses": 10,
        "shapes": 1,
        "outputs": 8,
        "marks": 19,
        "limits": 1,
        "start_conditions": 51,
        "start_jacobian": 65,
    },
    "hoisted": {
        "rhs": 10,
        "energy": 6,
        "residual": 3,
        "residual_jacobian": 4,
        "constraint_residual": 2,
        "constraint_jacobian": 1,
        "gamma": 1,
        "project": 7,
        "poses": 2,
        "shapes": 1,
        "marks": 2,
        "start_conditions": 1,
        "start_jacobian": 2,
    },
    "run": {
        "t_end": 5.0,
        "fps": 60.0,
    },
    "sensed": True,
    "limits": [
        {"name": "bodies.rack.shape.box[0]", "bound": "zero or more"},
        {"name": "bodies.rack.mass", "bound": "zero or more"},
        {"name": "bodies.left.inertia", "bound": "zero or more"},
        {"name": "springs.bar.stiffness", "bound": "zero or more"},
        {"name": "springs.bar.damping", "bound": "zero or more"},
        {"name": "rotors.wheel.inertia", "bound": "zero or more"},
        {"name": "rotors.pinion.inertia", "bound": "zero or more"},
    ],
    "subsystems": [],
    "marks": [
        {"kind": "link", "name": "left_rod", "body": "", "numbers": 6, "moves": True},
        {"kind": "link", "name": "right_rod", "body": "", "numbers": 6, "moves": True},
        {"kind": "link", "name": "left_arm", "body": "", "numbers": 6, "moves": True},
        {"kind": "link", "name": "right_arm", "body": "", "numbers": 6, "moves": True},
    ],
    "start": {
        "equations": ["left", "rack"],
        "find": [15],
        "steady": [],
        "closed": [],
        "balance": False,
        "levels": [0, 0],
    },
}

@njit(error_model="numpy")
def rhs(t, y, p, out):
    """State derivative: rates, accelerations, power, multipliers, pivot ratio. 177 operations."""
    p_J_wheel = p[0]
    p_J_pinion = p[1]
    p_k_bar = p[2]
    p_c_bar = p[3]
    p_r = p[4]
    p_m_rack = p[5]
    p_c_rack = p[6]
    p_J_knuckle = p[7]
    p_k_align = p[8]
    p_c_align = p[9]
    p_half = p[10]
    p_arm = p[11]
    p_toe = p[12]
    p_behind = p[13]
    p_end = p[14]
    c0 = 1.0/p_m_rack
    c1 = 2.0*c0
    c2 = 1.0/p_J_knuckle
    c3 = 1.0/p_J_pinion
    c4 = p_r*c3
    c5 = p_r*c4 + c0
    c6 = p_c_rack*c0
    c7 = 2.0*p_arm
    c8 = 1.0/p_J_wheel
    c9 = 1.0/c5
    q_rack = y[0]
    q_left = y[1]
    q_right = y[2]
    q_wheel = y[3]
    q_pinion = y[4]
    v_rack = y[5]
    v_left = y[6]
    v_right = y[7]
    v_wheel = y[8]
    v_pinion = y[9]
    u_hands = p[16]
    x0 = q_left + p_toe
    x1 = sin(x0)
    x2 = p_arm*x1
    x3 = x2 - p_half + (p_end - q_rack)
    x4 = x3*c1
    x5 = cos(x0)
    x6 = p_arm*x5
    x7 = 2.0*(p_behind - x6)
    x8 = 2.0*x3
    x9 = x2*x7 + x6*x8
    x10 = x9*c2
    x11 = 1.0/(x9*x10 + x8*x4)
    x12 = x4*x11
    x13 = q_right - p_toe
    x14 = sin(x13)
    x15 = p_arm*x14
    x16 = p_half + x15 - q_rack - p_end
    x17 = x16*c1
    x18 = 2.0*x16
    x19 = x18*x4
    x20 = x19*x11
    x21 = x17 - x4*x20
    x22 = cos(x13)
    x23 = p_arm*x22
    x24 = 2.0*(p_behind - x23)
    x25 = x15*x24 + x23*x18
    x26 = x25*c2
    x27 = x25*x26 + x18*x17
    x28 = x19*x20 - x27
    x29 = 1.0/x28
    x30 = x21*x29
    x31 = x4*x12 - c5 - x21*x30
    x32 = p_c_bar*(v_wheel - v_pinion)
    x33 = p_k_bar*(q_wheel - q_pinion) + x32
    x34 = v_rack*c6
    x35 = v_left*p_c_align
    x36 = x35 + q_left*p_k_align
    x37 = v_left*x5
    x38 = v_left*x1
    x39 = p_arm*x37 - v_rack
    x40 = p_arm*(x7*(v_left*x37)) + c7*(x38*(p_arm*x38)) + (2.0*(x39*x39) - p_arm*(x8*(v_left*x38)))
    x41 = v_rack*p_c_rack
    x42 = x10*x36 - x40 - x41*x4
    x43 = v_right*p_c_align
    x44 = x43 + q_right*p_k_align
    x45 = v_right*x22
    x46 = v_right*x14
    x47 = p_arm*x45 - v_rack
    x48 = p_arm*(x24*(v_right*x45)) + c7*(x46*(p_arm*x46)) + (2.0*(x47*x47) - p_arm*(x18*(v_right*x46)))
    x49 = x26*x44 - x48 - x41*x17 - x20*x42
    x50 = 1.0/x31*(x33*c4 + x34 + x12*x42 - x30*x49)
    x51 = x29*x49 - x30*x50
    x52 = x12*x50 - (x11*x42 + x20*x51)
    x53 = v_wheel*(u_hands - x32) - (v_rack*x41 + v_left*x35 + v_right*x43)
    x54 = -(x31*c9)
    x55 = -(x28/x27)
    x56 = (x55 if x55 < 1.0 else 1.0)
    out[0] = v_rack
    out[1] = v_left
    out[2] = v_right
    out[3] = v_wheel
    out[4] = v_pinion
    out[5] = x4*x52 - x34 + x17*x51 - c0*x50
    out[6] = -(c2*x36 + x10*x52)
    out[7] = -(c2*x44 + x26*x51)
    out[8] = -(c8*(x33 - u_hands))
    out[9] = x33*c3 + c4*x50
    out[10] = x53 + v_pinion*x32
    out[11] = -x52
    out[12] = -x51
    out[13] = -x50
    out[14] = (x54 if x54 < x56 else x56)


@njit(error_model="numpy")
def mass_matrix(t, y, p, out):
    """Mass matrix M, row by row. 0 operations."""
    p_J_wheel = p[0]
    p_J_pinion = p[1]
    p_m_rack = p[5]
    p_J_knuckle = p[7]
    out[0] = p_m_rack
    out[6] = p_J_knuckle
    out[12] = p_J_knuckle
    out[18] = p_J_wheel
    out[24] = p_J_pinion


@njit(error_model="numpy")
def forces(t, y, p, out):
    """Forces f of M a = f + G^T lambda. 17 operations."""
    p_k_bar = p[2]
    p_c_bar = p[3]
    p_c_rack = p[6]
    p_k_align = p[8]
    p_c_align = p[9]
    q_left = y[1]
    q_right = y[2]
    q_wheel = y[3]
    q_pinion = y[4]
    v_rack = y[5]
    v_left = y[6]
    v_right = y[7]
    v_wheel = y[8]
    v_pinion = y[9]
    u_hands = p[16]
    x0 = p_k_bar*(q_wheel - q_pinion) + p_c_bar*(v_wheel - v_pinion)
    out[0] = -(v_rack*p_c_rack)
    out[1] = -(v_left*p_c_align + q_left*p_k_align)
    out[2] = -(v_right*p_c_align + q_right*p_k_align)
    out[3] = -(x0 - u_hands)
    out[4] = x0


@njit(error_model="numpy")
def energy(t, y, p, out):
    """Kinetic and potential energy. 28 operations."""
    p_J_wheel = p[0]
    p_J_pinion = p[1]
    p_k_bar = p[2]
    p_m_rack = p[5]
    p_J_knuckle = p[7]
    p_k_align = p[8]
    c0 = 0.5*p_J_pinion
    c1 = 0.5*p_J_wheel
    c2 = 0.5*p_m_rack
    c3 = 0.5*p_J_knuckle
    c4 = 0.5*p_k_align
    c5 = 0.5*p_k_bar
    q_left = y[1]
    q_right = y[2]
    q_wheel = y[3]
    q_pinion = y[4]
    v_rack = y[5]
    v_left = y[6]
    v_right = y[7]
    v_wheel = y[8]
    v_pinion = y[9]
    x0 = v_pinion*v_pinion*c0 + v_wheel*v_wheel*c1 + (c2*(v_rack*v_rack) + v_left*v_left*c3 + v_right*v_right*c3)
    x1 = q_wheel - q_pinion
    out[0] = x0
    out[1] = (q_left*q_left + q_right*q_right)*c4 + x1*x1*c5


@njit(error_model="numpy")
def residual(t, y, p, out):
    """M a - f - G^T lambda, then G a - gamma. 120 operations."""
    p_J_wheel = p[0]
    p_J_pinion = p[1]
    p_k_bar = p[2]
    p_c_bar = p[3]
    p_r = p[4]
    p_m_rack = p[5]
    p_c_rack = p[6]
    p_J_knuckle = p[7]
    p_k_align = p[8]
    p_c_align = p[9]
    p_half = p[10]
    p_arm = p[11]
    p_toe = p[12]
    p_behind = p[13]
    p_end = p[14]
    c0 = 0.5*p_J_wheel
    c1 = 0.5*p_J_pinion
    c2 = 2.0*p_arm
    q_rack = y[0]
    q_left = y[1]
    q_right = y[2]
    q_wheel = y[3]
    q_pinion = y[4]
    v_rack = y[5]
    v_left = y[6]
    v_right = y[7]
    v_wheel = y[8]
    v_pinion = y[9]
    a_rack = y[10]
    a_left = y[11]
    a_right = y[12]
    a_wheel = y[13]
    a_pinion = y[14]
    lam_left_rod = y[15]
    lam_right_rod = y[16]
    lam_mesh = y[17]
    u_hands = p[16]
    x0 = q_right - p_toe
    x1 = sin(x0)
    x2 = 2.0*(p_half + p_arm*x1 - q_rack - p_end)
    x3 = lam_right_rod*x2
    x4 = q_left + p_toe
    x5 = sin(x4)
    x6 = 2.0*(p_arm*x5 - p_half + (p_end - q_rack))
    x7 = lam_left_rod*x6
    x8 = cos(x4)
    x9 = 2.0*(p_behind - p_arm*x8)
    x10 = q_left*p_k_align + (v_left*p_c_align + a_left*p_J_knuckle) - (p_arm*(x5*(lam_left_rod*x9)) + p_arm*(x8*x7))
    x11 = q_right*p_k_align + (v_right*p_c_align + a_right*p_J_knuckle)
    x12 = cos(x0)
    x13 = 2.0*(p_behind - p_arm*x12)
    x14 = p_k_bar*(q_wheel - q_pinion)
    x15 = p_c_bar*(v_wheel - v_pinion)
    x16 = a_wheel*c0
    x17 = a_pinion*c1
    x18 = v_left*x5
    x19 = v_left*x8
    x20 = p_arm*x19 - v_rack
    x21 = c2*(x18*(p_arm*x18)) + p_arm*(x9*(v_left*x19 + a_left*x5)) + (2.0*(x20*x20) + x6*(p_arm*(a_left*x8 - v_left*x18) - a_rack))
    x22 = v_right*x1
    x23 = v_right*x12
    x24 = c2*(x22*(p_arm*x22)) + p_arm*(x13*(v_right*x23 + a_right*x1))
    x25 = p_arm*x23 - v_rack
    x26 = 2.0*(x25*x25) + x2*(p_arm*(a_right*x12 - v_right*x22) - a_rack)
    out[0] = v_rack*p_c_rack + a_rack*p_m_rack - (lam_mesh - x3 - x7)
    out[1] = x10
    out[2] = x11 - (p_arm*(x1*(lam_right_rod*x13)) + p_arm*(x12*x3))
    out[3] = x14 + (x15 + (x16 + x16)) - u_hands
    out[4] = lam_mesh*p_r + (x17 + x17 - x15 - x14)
    out[5] = x21
    out[6] = x24 + x26
    out[7] = a_rack - a_pinion*p_r


@njit(error_model="numpy")
def residual_jacobian(t, y, p, out):
    """Residual derivatives by q, v, a, lambda. 160 operations."""
    p_J_wheel = p[0]
    p_J_pinion = p[1]
    p_k_bar = p[2]
    p_c_bar = p[3]
    p_r = p[4]
    p_m_rack = p[5]
    p_c_rack = p[6]
    p_J_knuckle = p[7]
    p_k_align = p[8]
    p_c_align = p[9]
    p_half = p[10]
    p_arm = p[11]
    p_toe = p[12]
    p_behind = p[13]
    p_end = p[14]
    c0 = 2.0*p_arm
    c1 = -p_k_bar
    c2 = -p_c_bar
    c3 = -p_r
    q_rack = y[0]
    q_left = y[1]
    q_right = y[2]
    v_rack = y[5]
    v_left = y[6]
    v_right = y[7]
    a_rack = y[10]
    a_left = y[11]
    a_right = y[12]
    lam_left_rod = y[15]
    lam_right_rod = y[16]
    x0 = 2.0*lam_right_rod
    x1 = 2.0*lam_left_rod
    x2 = q_left + p_toe
    x3 = cos(x2)
    x4 = p_arm*x3
    x5 = x4*x1
    x6 = q_right - p_toe
    x7 = cos(x6)
    x8 = p_arm*x7
    x9 = x8*x0
    x10 = sin(x2)
    x11 = p_arm*x10
    x12 = 2.0*(x11 - p_half + (p_end - q_rack))
    x13 = sin(x6)
    x14 = p_arm*x13
    x15 = 2.0*(p_half + x14 - q_rack - p_end)
    x16 = 2.0*(p_behind - x4)
    x17 = x10*c0
    x18 = x11*(lam_left_rod*x12) - lam_left_rod*(x4*x16 + x11*x17) - x4*x5
    x19 = x11*x16 + x4*x12
    x20 = 2.0*(p_behind - x8)
    x21 = x13*c0
    x22 = x14*(lam_right_rod*x15) - lam_right_rod*(x8*x20 + x14*x21) - x8*x9
    x23 = x14*x20 + x8*x15
    x24 = a_left*x3
    x25 = v_left*x10
    x26 = 2.0*(p_arm*(x24 - v_left*x25) - a_rack)
    x27 = v_left*x3
    x28 = a_left*x10
    x29 = p_arm*((v_left*x27 + x28)*x17) + p_arm*(x16*x24) - p_arm*(x12*x28)
    x30 = x25*c0
    x31 = v_left*p_arm
    x32 = p_arm*(x30 + x30) - x12*x31
    x33 = p_arm*x27
    x34 = 2.0*(x33 - v_rack)
    x35 = x34 + x34
    x36 = x16*x31 + p_arm*x35
    x37 = a_right*x7
    x38 = v_right*x13
    x39 = 2.0*(p_arm*(x37 - v_right*x38) - a_rack)
    x40 = v_right*x7
    x41 = a_right*x13
    x42 = p_arm*((v_right*x40 + x41)*x21) + p_arm*(x20*x37) - p_arm*(x15*x41)
    x43 = x38*c0
    x44 = v_right*p_arm
    x45 = p_arm*(x43 + x43) - x15*x44
    x46 = p_arm*x40
    x47 = 2.0*(x46 - v_rack)
    x48 = x47 + x47
    x49 = x20*x44 + p_arm*x48
    out[0] = -(x0 + x1)
    out[1] = x5
    out[2] = x9
    out[5] = p_c_rack
    out[10] = p_m_rack
    out[15] = x12
    out[16] = x15
    out[17] = -1.0
    out[18] = x5
    out[19] = p_k_align + x18
    out[24] = p_c_align
    out[29] = p_J_knuckle
    out[33] = -x19
    out[36] = x9
    out[38] = p_k_align + x22
    out[43] = p_c_align
    out[48] = p_J_knuckle
    out[52] = -x23
    out[57] = p_k_bar
    out[58] = c1
    out[62] = p_c_bar
    out[63] = c2
    out[67] = p_J_wheel
    out[75] = c1
    out[76] = p_k_bar
    out[80] = c2
    out[81] = p_c_bar
    out[86] = p_J_pinion
    out[89] = p_r
    out[90] = -x26
    out[91] = x4*x26 + (x29 + x27*x32 - x25*x36)
    out[95] = -x35
    out[96] = x3*x36 + (x33*x16 - p_arm*x25*x12 + x10*x32)
    out[100] = -x12
    out[101] = x19
    out[108] = -x39
    out[110] = x8*x39 + (x42 + x40*x45 - x38*x49)
    out[113] = -x48
    out[115] = x7*x49 + (x46*x20 - p_arm*x38*x15 + x13*x45)
    out[118] = -x15
    out[120] = x23
    out[136] = 1.0
    out[140] = c3


@njit(error_model="numpy")
def constraint_residual(t, y, p, out):
    """Position residuals, velocity residuals. 50 operations."""
    p_r = p[4]
    p_half = p[10]
    p_arm = p[11]
    p_toe = p[12]
    p_behind = p[13]
    p_end = p[14]
    p_rod = p[15]
    c0 = p_rod*p_rod
    c1 = 2.0*p_arm
    q_rack = y[0]
    q_left = y[1]
    q_right = y[2]
    q_pinion = y[4]
    v_rack = y[5]
    v_left = y[6]
    v_right = y[7]
    v_pinion = y[9]
    x0 = q_left + p_toe
    x1 = sin(x0)
    x2 = p_arm*x1 - p_half + (p_end - q_rack)
    x3 = cos(x0)
    x4 = p_behind - p_arm*x3
    x5 = q_right - p_toe
    x6 = sin(x5)
    x7 = p_half + p_arm*x6 - q_rack - p_end
    x8 = cos(x5)
    x9 = p_behind - p_arm*x8
    x10 = c1*(x9*(v_right*x6)) + 2.0*(x7*(p_arm*(v_right*x8) - v_rack))
    out[0] = x2*x2 + (x4*x4 - c0)
    out[1] = x7*x7 + (x9*x9 - c0)
    out[2] = q_rack - q_pinion*p_r
    out[3] = c1*(x4*(v_left*x1)) + 2.0*(x2*(p_arm*(v_left*x3) - v_rack))
    out[4] = x10
    out[5] = v_rack - v_pinion*p_r


@njit(error_model="numpy")
def constraint_jacobian(t, y, p, out):
    """Constraint Jacobian G, row by row. 31 operations."""
    p_r = p[4]
    p_half = p[10]
    p_arm = p[11]
    p_toe = p[12]
    p_behind = p[13]
    p_end = p[14]
    c0 = -p_r
    q_rack = y[0]
    q_left = y[1]
    q_right = y[2]
    x0 = q_left + p_toe
    x1 = p_arm*sin(x0)
    x2 = 2.0*(x1 - p_half + (p_end - q_rack))
    x3 = p_arm*cos(x0)
    x4 = q_right - p_toe
    x5 = p_arm*sin(x4)
    x6 = 2.0*(p_half + x5 - q_rack - p_end)
    x7 = p_arm*cos(x4)
    out[0] = -x2
    out[1] = x3*x2 + 2.0*(x1*(p_behind - x3))
    out[5] = -x6
    out[7] = x7*x6 + 2.0*(x5*(p_behind - x7))
    out[10] = 1.0
    out[14] = c0


@njit(error_model="numpy")
def gamma(t, y, p, out):
    """Right-hand side of G a = gamma. 57 operations."""
    p_half = p[10]
    p_arm = p[11]
    p_toe = p[12]
    p_behind = p[13]
    p_end = p[14]
    c0 = 2.0*p_arm
    q_rack = y[0]
    q_left = y[1]
    q_right = y[2]
    v_rack = y[5]
    v_left = y[6]
    v_right = y[7]
    x0 = q_left + p_toe
    x1 = sin(x0)
    x2 = v_left*x1
    x3 = cos(x0)
    x4 = v_left*x3
    x5 = p_arm*x4 - v_rack
    x6 = 2.0*(x5*x5) - c0*((p_arm*x1 - p_half + (p_end - q_rack))*(v_left*x2))
    x7 = c0*(x2*(p_arm*x2)) + c0*((p_behind - p_arm*x3)*(v_left*x4)) + x6
    x8 = q_right - p_toe
    x9 = sin(x8)
    x10 = v_right*x9
    x11 = cos(x8)
    x12 = v_right*x11
    x13 = c0*(x10*(p_arm*x10)) + c0*((p_behind - p_arm*x11)*(v_right*x12))
    x14 = p_arm*x12 - v_rack
    x15 = 2.0*(x14*x14) - c0*((p_half + p_arm*x9 - q_rack - p_end)*(v_right*x10))
    out[0] = -x7
    out[1] = -(x13 + x15)
    out[2] = 0.0


@njit(error_model="numpy")
def project(t, y, p, out):
    """State moved onto the constraints, and the residuals it had. 164 operations."""
    p_J_pinion = p[1]
    p_r = p[4]
    p_m_rack = p[5]
    p_J_knuckle = p[7]
    p_half = p[10]
    p_arm = p[11]
    p_toe = p[12]
    p_behind = p[13]
    p_end = p[14]
    p_rod = p[15]
    c0 = 1.0/p_m_rack
    c1 = 2.0*c0
    c2 = p_rod*p_rod
    c3 = 1.0/p_J_knuckle
    c4 = p_r*(1.0/p_J_pinion)
    c5 = p_r*c4 + c0
    c6 = 2.0*p_arm
    q_rack = y[0]
    q_left = y[1]
    q_right = y[2]
    q_wheel = y[3]
    q_pinion = y[4]
    v_rack = y[5]
    v_left = y[6]
    v_right = y[7]
    v_wheel = y[8]
    v_pinion = y[9]
    x0 = q_left + p_toe
    x1 = p_arm*sin(x0)
    x2 = x1 - p_half + (p_end - q_rack)
    x3 = x2*c1
    x4 = p_arm*cos(x0)
    x5 = p_behind - x4
    x6 = x2*x2 + (x5*x5 - c2)
    x7 = 2.0*x2
    x8 = x4*x7 + 2.0*(x1*x5)
    x9 = c3*x8
    x10 = 1.0/(x7*x3 + x8*x9)
    x11 = q_right - p_toe
    x12 = p_arm*sin(x11)
    x13 = p_half + x12 - q_rack - p_end
    x14 = 2.0*x13
    x15 = x14*x3
    x16 = x15*x10
    x17 = x13*c1
    x18 = p_arm*cos(x11)
    x19 = p_behind - x18
    x20 = x18*x14 + 2.0*(x12*x19)
    x21 = c3*x20
    x22 = 1.0/(x15*x16 - (x14*x17 + x20*x21))
    x23 = x13*x13 + (x19*x19 - c2)
    x24 = x6*x16 - x23
    x25 = x17 - x3*x16
    x26 = x25*x22
    x27 = x3*x10
    x28 = 1.0/(x3*x27 - c5 - x25*x26)
    x29 = q_rack - q_pinion*p_r
    x30 = x28*(x29 + x6*x27 + x26*x24)
    x31 = x22*x24 + x26*x30
    x32 = x6*x10 - x16*x31 - x27*x30
    x33 = q_rack + (x3*x32 + x17*x31 + c0*x30)
    x34 = q_left - x9*x32
    x35 = q_right - x21*x31
    x36 = p_toe + x34
    x37 = cos(x36)
    x38 = sin(x36)
    x39 = (p_arm*x38 - p_half + (p_end - x33))*(p_arm*(v_left*x37) - v_rack)
    x40 = c6*((p_behind - p_arm*x37)*(v_left*x38)) + 2.0*x39
    x41 = x35 - p_toe
    x42 = cos(x41)
    x43 = sin(x41)
    x44 = (p_half + p_arm*x43 - x33 - p_end)*(p_arm*(v_right*x42) - v_rack)
    x45 = c6*((p_behind - p_arm*x42)*(v_right*x43)) + 2.0*x44
    x46 = x16*x40 - x45
    x47 = v_rack - v_pinion*p_r
    x48 = x28*(x47 + x27*x40 + x26*x46)
    x49 = x22*x46 + x26*x48
    x50 = x10*x40 - x16*x49 - x27*x48
    out[0] = x33
    out[1] = x34
    out[2] = x35
    out[3] = q_wheel
    out[4] = q_pinion - c4*x30
    out[5] = v_rack + (x3*x50 + x17*x49 + c0*x48)
    out[6] = v_left - x9*x50
    out[7] = v_right - x21*x49
    out[8] = v_wheel
    out[9] = v_pinion - c4*x48
    out[10] = x6
    out[11] = x23
    out[12] = x29
    out[13] = x40
    out[14] = x45
    out[15] = x47


@njit(error_model="numpy")
def poses(t, y, p, out):
    """Per body: position, rotation matrix (body to world). 10 operations."""
    p_half = p[10]
    p_behind = p[13]
    c0 = -p_behind
    c1 = -p_half
    q_rack = y[0]
    q_left = y[1]
    q_right = y[2]
    x0 = q_left + 1.5707963267948966
    x1 = cos(x0)
    x2 = sin(x0)
    x3 = q_right + 1.5707963267948966
    x4 = cos(x3)
    x5 = sin(x3)
    out[0] = q_rack
    out[1] = c0
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
    out[12] = c1
    out[13] = 0.0
    out[14] = 0.0
    out[15] = x1
    out[16] = -x2
    out[17] = 0.0
    out[18] = x2
    out[19] = x1
    out[20] = 0.0
    out[21] = 0.0
    out[22] = 0.0
    out[23] = 1.0
    out[24] = p_half
    out[25] = 0.0
    out[26] = 0.0
    out[27] = x4
    out[28] = -x5
    out[29] = 0.0
    out[30] = x5
    out[31] = x4
    out[32] = 0.0
    out[33] = 0.0
    out[34] = 0.0
    out[35] = 1.0


@njit(error_model="numpy")
def shapes(t, y, p, out):
    """Sizes of the bodies' shapes. 1 operation."""
    p_end = p[14]
    c0 = 2.0*p_end
    out[0] = c0
    out[1] = 0.03
    out[2] = 0.03
    out[3] = 0.6
    out[4] = 0.18
    out[5] = 0.6
    out[6] = 0.6
    out[7] = 0.18
    out[8] = 0.6


@njit(error_model="numpy")
def outputs(t, y, p, out):
    """Outputs. 8 operations."""
    p_k_bar = p[2]
    p_c_bar = p[3]
    q_left = y[1]
    q_right = y[2]
    q_wheel = y[3]
    q_pinion = y[4]
    v_wheel = y[8]
    v_pinion = y[9]
    lam_mesh = y[17]
    out[0] = p_k_bar*(q_wheel - q_pinion) + p_c_bar*(v_wheel - v_pinion)
    out[1] = lam_mesh
    out[2] = fabs(q_left) - fabs(q_right)


@njit(error_model="numpy")
def marks(t, y, p, out):
    """What a picture shows besides bodies, as `marks` lists it. 19 operations."""
    p_half = p[10]
    p_arm = p[11]
    p_toe = p[12]
    p_behind = p[13]
    p_end = p[14]
    c0 = -p_behind
    c1 = -p_half
    q_rack = y[0]
    q_left = y[1]
    q_right = y[2]
    x0 = q_left + p_toe
    x1 = p_arm*sin(x0) - p_half
    x2 = -(p_arm*cos(x0))
    x3 = q_right - p_toe
    x4 = p_half + p_arm*sin(x3)
    x5 = -(p_arm*cos(x3))
    out[0] = -(p_end - q_rack)
    out[1] = c0
    out[3] = x1
    out[4] = x2
    out[6] = q_rack + p_end
    out[7] = c0
    out[9] = x4
    out[10] = x5
    out[12] = c1
    out[15] = x1
    out[16] = x2
    out[18] = p_half
    out[21] = x4
    out[22] = x5


@njit(error_model="numpy")
def limits(t, y, p, out):
    """Numbers of parameters that have a bound. 1 operation."""
    p_J_wheel = p[0]
    p_J_pinion = p[1]
    p_k_bar = p[2]
    p_c_bar = p[3]
    p_m_rack = p[5]
    p_J_knuckle = p[7]
    p_end = p[14]
    c0 = 2.0*p_end
    out[0] = c0
    out[1] = p_m_rack
    out[2] = p_J_knuckle
    out[3] = p_k_bar
    out[4] = p_c_bar
    out[5] = p_J_wheel
    out[6] = p_J_pinion


@njit(error_model="numpy")
def start_conditions(t, y, p, out):
    """What is zero at the start: constraints, equations, gaps; forces of closed stops, to be added to residual. 51 operations."""
    p_r = p[4]
    p_half = p[10]
    p_arm = p[11]
    p_toe = p[12]
    p_behind = p[13]
    p_end = p[14]
    p_rod = p[15]
    c0 = p_rod*p_rod
    q_rack = y[0]
    q_left = y[1]
    q_right = y[2]
    q_pinion = y[4]
    v_rack = y[5]
    v_left = y[6]
    v_right = y[7]
    v_pinion = y[9]
    x0 = q_left + p_toe
    x1 = sin(x0)
    x2 = p_arm*x1 - p_half + (p_end - q_rack)
    x3 = cos(x0)
    x4 = p_behind - p_arm*x3
    x5 = q_right - p_toe
    x6 = sin(x5)
    x7 = p_half + p_arm*x6 - q_rack - p_end
    x8 = cos(x5)
    x9 = p_behind - p_arm*x8
    x10 = p_arm*(v_left*x1)*(2.0*x4) + (p_arm*(v_left*x3) - v_rack)*(2.0*x2)
    x11 = p_arm*(v_right*x6)*(2.0*x9) + (p_arm*(v_right*x8) - v_rack)*(2.0*x7)
    out[0] = x2*x2 + (x4*x4 - c0)
    out[1] = x7*x7 + (x9*x9 - c0)
    out[2] = q_rack - q_pinion*p_r
    out[3] = x10
    out[4] = x11
    out[5] = v_rack - v_pinion*p_r
    out[6] = q_left
    out[7] = q_rack


@njit(error_model="numpy")
def start_jacobian(t, y, p, out):
    """Derivatives of start_conditions by q, v, a, lambda, forces of stops and frictions, parameters. 65 operations."""
    p_r = p[4]
    p_half = p[10]
    p_arm = p[11]
    p_toe = p[12]
    p_behind = p[13]
    p_end = p[14]
    p_rod = p[15]
    c0 = -(2.0*p_rod)
    c1 = -p_r
    q_rack = y[0]
    q_left = y[1]
    q_right = y[2]
    v_rack = y[5]
    v_left = y[6]
    v_right = y[7]
    x0 = q_left + p_toe
    x1 = sin(x0)
    x2 = p_arm*x1
    x3 = 2.0*(x2 - p_half + (p_end - q_rack))
    x4 = -x3
    x5 = cos(x0)
    x6 = p_arm*x5
    x7 = 2.0*(p_behind - x6)
    x8 = x2*x7 + x6*x3
    x9 = q_right - p_toe
    x10 = sin(x9)
    x11 = p_arm*x10
    x12 = 2.0*(p_half + x11 - q_rack - p_end)
    x13 = -x12
    x14 = cos(x9)
    x15 = p_arm*x14
    x16 = 2.0*(p_behind - x15)
    x17 = x11*x16 + x15*x12
    x18 = p_arm*(v_left*x5)
    x19 = x18 - v_rack
    x20 = p_arm*(v_left*x1)
    x21 = p_arm*(v_right*x14)
    x22 = x21 - v_rack
    x23 = p_arm*(v_right*x10)
    out[0] = x4
    out[1] = x8
    out[18] = c0
    out[19] = x13
    out[21] = x17
    out[37] = c0
    out[38] = 1.0
    out[42] = c1
    out[57] = -(2.0*x19)
    out[58] = x18*x7 + x20*(2.0*x2) + (x19*(2.0*x6) - x20*x3)
    out[62] = x4
    out[63] = x8
    out[76] = -(2.0*x22)
    out[78] = x21*x16 + x23*(2.0*x11) + (x22*(2.0*x15) - x23*x12)
    out[81] = x13
    out[83] = x17
    out[100] = 1.0
    out[104] = c1
    out[115] = 1.0
    out[133] = 1.0
