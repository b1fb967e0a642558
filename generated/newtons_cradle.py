"""newtons_cradle: equations of motion, written by symgen 0.1.0. Do not edit.

Newton's cradle: as many balls fly off as come, one blow after another
"""

from math import cos, sin, sqrt

from numba import njit

MODEL = {
    "abi": 1,
    "generator": "symgen 0.1.0",
    "source": "sha256:1f9c3792410d42500116920019e49ba4b53396ee295b67dc41e27f698f81bf3b",
    "name": "newtons_cradle",
    "description": "Newton's cradle: as many balls fly off as come, one blow after another",
    "nq": 5,
    "nv": 5,
    "nh": 0,
    "nn": 0,
    "nw": 0,
    "coordinates": [
        {"name": "a1", "unit": "", "value": -0.6, "enforced": True},
        {"name": "a2", "unit": "", "value": -0.6, "enforced": True},
        {"name": "a3", "unit": "", "value": 0.0, "enforced": True},
        {"name": "a4", "unit": "", "value": 0.0, "enforced": True},
        {"name": "a5", "unit": "", "value": 0.0, "enforced": True},
    ],
    "quaternions": [],
    "rates": [
        {"name": "a1", "unit": "", "value": 0.0, "enforced": False},
        {"name": "a2", "unit": "", "value": 0.0, "enforced": False},
        {"name": "a3", "unit": "", "value": 0.0, "enforced": False},
        {"name": "a4", "unit": "", "value": 0.0, "enforced": False},
        {"name": "a5", "unit": "", "value": 0.0, "enforced": False},
    ],
    "parameters": [
        {"name": "l", "unit": "m", "value": 0.15, "doc": "length of the strings"},
        {"name": "r", "unit": "m", "value": 0.01, "doc": "radius of the balls"},
        {"name": "m", "unit": "kg", "value": 0.032, "doc": ""},
        {"name": "e", "unit": "", "value": 1.0, "doc": "restitution"},
        {"name": "g", "unit": "m/s^2", "value": 9.81, "doc": ""},
    ],
    "inputs": [],
    "constants": [],
    "constraints": [],
    "outputs": [],
    "events": [
        {"name": "hit12", "direction": "falling", "action": "stop"},
        {"name": "hit23", "direction": "falling", "action": "stop"},
        {"name": "hit34", "direction": "falling", "action": "stop"},
        {"name": "hit45", "direction": "falling", "action": "stop"},
    ],
    "bodies": [
        {"name": "ball1", "planar": True, "shape": "sphere", "sizes": 1, "mesh": ""},
        {"name": "ball2", "planar": True, "shape": "sphere", "sizes": 1, "mesh": ""},
        {"name": "ball3", "planar": True, "shape": "sphere", "sizes": 1, "mesh": ""},
        {"name": "ball4", "planar": True, "shape": "sphere", "sizes": 1, "mesh": ""},
        {"name": "ball5", "planar": True, "shape": "sphere", "sizes": 1, "mesh": ""},
    ],
    "structure": {
        "conservative": True,
        "time_dependent": False,
        "constant_mass": True,
        "diagonal_mass": True,
        "velocity_dependent": False,
        "separable": True,
    },
    "operations": {
        "rhs": 21,
        "mass_matrix": 2,
        "forces": 17,
        "energy": 67,
        "residual": 30,
        "residual_jacobian": 14,
        "poses": 31,
        "shapes": 0,
        "events": 55,
        "marks": 33,
        "limits": 0,
        "switches": 55,
        "closed_rhs": 357,
        "closed_residual": 303,
        "closed_residual_jacobian": 824,
        "closed_constraint_residual": 119,
        "closed_constraint_jacobian": 106,
        "closed_gamma": 198,
        "closed_project": 330,
        "closed_events": 337,
    },
    "hoisted": {
        "rhs": 1,
        "mass_matrix": 1,
        "forces": 1,
        "energy": 2,
        "residual": 2,
        "residual_jacobian": 2,
        "poses": 2,
        "events": 3,
        "marks": 4,
        "switches": 3,
        "closed_rhs": 5,
        "closed_residual": 4,
        "closed_residual_jacobian": 4,
        "closed_constraint_residual": 3,
        "closed_constraint_jacobian": 2,
        "closed_gamma": 2,
        "closed_project": 4,
        "closed_events": 5,
    },
    "run": {
        "t_end": 3.0,
        "fps": 60.0,
    },
    "limits": [
        {"name": "bodies.ball1.shape.sphere[0]", "bound": "zero or more"},
        {"name": "bodies.ball1.mass", "bound": "zero or more"},
        {"name": "contacts.hit12.restitution", "bound": "from 0 to 1"},
    ],
    "switches": [
        {"name": "hit12", "kind": "stop"},
        {"name": "hit23", "kind": "stop"},
        {"name": "hit34", "kind": "stop"},
        {"name": "hit45", "kind": "stop"},
    ],
    "impacts": "sequential",
    "subsystems": [],
    "marks": [
        {"kind": "point", "name": "ball1_point1", "body": "ball1", "numbers": 3},
        {"kind": "point", "name": "ball2_point2", "body": "ball2", "numbers": 3},
        {"kind": "point", "name": "ball3_point3", "body": "ball3", "numbers": 3},
        {"kind": "point", "name": "ball4_point4", "body": "ball4", "numbers": 3},
        {"kind": "point", "name": "ball5_point5", "body": "ball5", "numbers": 3},
        {"kind": "link", "name": "string1", "body": "", "numbers": 6, "moves": True},
        {"kind": "link", "name": "string2", "body": "", "numbers": 6, "moves": True},
        {"kind": "link", "name": "string3", "body": "", "numbers": 6, "moves": True},
        {"kind": "link", "name": "string4", "body": "", "numbers": 6, "moves": True},
        {"kind": "link", "name": "string5", "body": "", "numbers": 6, "moves": True},
    ],
}

@njit(error_model="numpy")
def rhs(t, y, p, out):
    """State derivative: rates, accelerations. 21 operations."""
    p_l = p[0]
    p_m = p[2]
    p_g = p[4]
    c0 = p_l*(p_m*p_g)*(1.0/(p_m*(p_l*p_l)))
    q_a1 = y[0]
    q_a2 = y[1]
    q_a3 = y[2]
    q_a4 = y[3]
    q_a5 = y[4]
    v_a1 = y[5]
    v_a2 = y[6]
    v_a3 = y[7]
    v_a4 = y[8]
    v_a5 = y[9]
    out[0] = v_a1
    out[1] = v_a2
    out[2] = v_a3
    out[3] = v_a4
    out[4] = v_a5
    out[5] = -(sin(q_a1)*c0)
    out[6] = -(sin(q_a2)*c0)
    out[7] = -(sin(q_a3)*c0)
    out[8] = -(sin(q_a4)*c0)
    out[9] = -(sin(q_a5)*c0)


@njit(error_model="numpy")
def mass_matrix(t, y, p, out):
    """Mass matrix M, row by row. 2 operations."""
    p_l = p[0]
    p_m = p[2]
    c0 = p_m*(p_l*p_l)
    out[0] = c0
    out[6] = c0
    out[12] = c0
    out[18] = c0
    out[24] = c0


@njit(error_model="numpy")
def forces(t, y, p, out):
    """Forces f of M a = f + G^T lambda. 17 operations."""
    p_l = p[0]
    p_m = p[2]
    p_g = p[4]
    c0 = p_l*(p_m*p_g)
    q_a1 = y[0]
    q_a2 = y[1]
    q_a3 = y[2]
    q_a4 = y[3]
    q_a5 = y[4]
    out[0] = -(sin(q_a1)*c0)
    out[1] = -(sin(q_a2)*c0)
    out[2] = -(sin(q_a3)*c0)
    out[3] = -(sin(q_a4)*c0)
    out[4] = -(sin(q_a5)*c0)


@njit(error_model="numpy")
def energy(t, y, p, out):
    """Kinetic and potential energy. 67 operations."""
    p_l = p[0]
    p_m = p[2]
    p_g = p[4]
    c0 = 0.5*p_m
    c1 = p_m*(p_l*p_g)
    q_a1 = y[0]
    q_a2 = y[1]
    q_a3 = y[2]
    q_a4 = y[3]
    q_a5 = y[4]
    v_a1 = y[5]
    v_a2 = y[6]
    v_a3 = y[7]
    v_a4 = y[8]
    v_a5 = y[9]
    x0 = cos(q_a1)
    x1 = p_l*(v_a1*x0)
    x2 = p_l*(v_a1*sin(q_a1))
    x3 = cos(q_a2)
    x4 = p_l*(v_a2*x3)
    x5 = p_l*(v_a2*sin(q_a2))
    x6 = cos(q_a3)
    x7 = p_l*(v_a3*x6)
    x8 = p_l*(v_a3*sin(q_a3))
    x9 = cos(q_a4)
    x10 = p_l*(v_a4*x9)
    x11 = p_l*(v_a4*sin(q_a4))
    x12 = c0*(x1*x1 + x2*x2) + c0*(x4*x4 + x5*x5) + c0*(x7*x7 + x8*x8) + c0*(x10*x10 + x11*x11)
    x13 = cos(q_a5)
    x14 = p_l*(v_a5*x13)
    x15 = p_l*(v_a5*sin(q_a5))
    out[0] = x12 + c0*(x14*x14 + x15*x15)
    out[1] = -(x0*c1 + x3*c1 + x6*c1 + x9*c1 + x13*c1)


@njit(error_model="numpy")
def residual(t, y, p, out):
    """M a - f - G^T lambda, then G a - gamma. 30 operations."""
    p_l = p[0]
    p_m = p[2]
    p_g = p[4]
    c0 = p_l*(p_m*p_g)
    c1 = 0.5*(p_m*(p_l*p_l))
    q_a1 = y[0]
    q_a2 = y[1]
    q_a3 = y[2]
    q_a4 = y[3]
    q_a5 = y[4]
    a_a1 = y[10]
    a_a2 = y[11]
    a_a3 = y[12]
    a_a4 = y[13]
    a_a5 = y[14]
    x0 = a_a1*c1
    x1 = a_a2*c1
    x2 = a_a3*c1
    x3 = a_a4*c1
    x4 = a_a5*c1
    out[0] = sin(q_a1)*c0 + (x0 + x0)
    out[1] = sin(q_a2)*c0 + (x1 + x1)
    out[2] = sin(q_a3)*c0 + (x2 + x2)
    out[3] = sin(q_a4)*c0 + (x3 + x3)
    out[4] = sin(q_a5)*c0 + (x4 + x4)


@njit(error_model="numpy")
def residual_jacobian(t, y, p, out):
    """Residual derivatives by q, v, a, lambda. 14 operations."""
    p_l = p[0]
    p_m = p[2]
    p_g = p[4]
    c0 = p_l*(p_m*p_g)
    c1 = p_m*(p_l*p_l)
    q_a1 = y[0]
    q_a2 = y[1]
    q_a3 = y[2]
    q_a4 = y[3]
    q_a5 = y[4]
    out[0] = cos(q_a1)*c0
    out[10] = c1
    out[16] = cos(q_a2)*c0
    out[26] = c1
    out[32] = cos(q_a3)*c0
    out[42] = c1
    out[48] = cos(q_a4)*c0
    out[58] = c1
    out[64] = cos(q_a5)*c0
    out[74] = c1


@njit(error_model="numpy")
def poses(t, y, p, out):
    """Per body: position, rotation matrix (body to world). 31 operations."""
    p_l = p[0]
    p_r = p[1]
    c0 = 4.0*p_r
    c1 = 2.0*p_r
    q_a1 = y[0]
    q_a2 = y[1]
    q_a3 = y[2]
    q_a4 = y[3]
    q_a5 = y[4]
    out[0] = p_l*sin(q_a1) - c0
    out[1] = -(p_l*cos(q_a1))
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
    out[12] = p_l*sin(q_a2) - c1
    out[13] = -(p_l*cos(q_a2))
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
    out[24] = p_l*sin(q_a3)
    out[25] = -(p_l*cos(q_a3))
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
    out[36] = c1 + p_l*sin(q_a4)
    out[37] = -(p_l*cos(q_a4))
    out[38] = 0.0
    out[39] = 1.0
    out[40] = 0.0
    out[41] = 0.0
    out[42] = 0.0
    out[43] = 1.0
    out[44] = 0.0
    out[45] = 0.0
    out[46] = 0.0
    out[47] = 1.0
    out[48] = c0 + p_l*sin(q_a5)
    out[49] = -(p_l*cos(q_a5))
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


@njit(error_model="numpy")
def shapes(t, y, p, out):
    """Sizes of the bodies' shapes. 0 operations."""
    p_r = p[1]
    out[0] = p_r
    out[1] = p_r
    out[2] = p_r
    out[3] = p_r
    out[4] = p_r


@njit(error_model="numpy")
def events(t, y, p, out):
    """Event functions. 55 operations."""
    p_l = p[0]
    p_r = p[1]
    c0 = 4.0*p_r
    c1 = 2.0*p_r
    c2 = p_r + p_r
    q_a1 = y[0]
    q_a2 = y[1]
    q_a3 = y[2]
    q_a4 = y[3]
    q_a5 = y[4]
    x0 = p_l*sin(q_a2) - c1
    x1 = p_l*sin(q_a1) - c0 - x0
    x2 = p_l*cos(q_a2)
    x3 = x2 - p_l*cos(q_a1)
    x4 = p_l*sin(q_a3)
    x5 = x0 - x4
    x6 = p_l*cos(q_a3)
    x7 = x6 - x2
    x8 = c1 + p_l*sin(q_a4)
    x9 = x4 - x8
    x10 = p_l*cos(q_a4)
    x11 = x10 - x6
    x12 = x8 - (c0 + p_l*sin(q_a5))
    x13 = p_l*cos(q_a5) - x10
    out[0] = sqrt(x1*x1 + x3*x3) - c2
    out[1] = sqrt(x5*x5 + x7*x7) - c2
    out[2] = sqrt(x9*x9 + x11*x11) - c2
    out[3] = sqrt(x12*x12 + x13*x13) - c2


@njit(error_model="numpy")
def marks(t, y, p, out):
    """What a picture shows besides bodies, as `marks` lists it. 33 operations."""
    p_l = p[0]
    p_r = p[1]
    c0 = 4.0*p_r
    c1 = -c0
    c2 = 2.0*p_r
    c3 = -c2
    q_a1 = y[0]
    q_a2 = y[1]
    q_a3 = y[2]
    q_a4 = y[3]
    q_a5 = y[4]
    out[15] = c1
    out[18] = p_l*sin(q_a1) - c0
    out[19] = -(p_l*cos(q_a1))
    out[21] = c3
    out[24] = p_l*sin(q_a2) - c2
    out[25] = -(p_l*cos(q_a2))
    out[30] = p_l*sin(q_a3)
    out[31] = -(p_l*cos(q_a3))
    out[33] = c2
    out[36] = c2 + p_l*sin(q_a4)
    out[37] = -(p_l*cos(q_a4))
    out[39] = c0
    out[42] = c0 + p_l*sin(q_a5)
    out[43] = -(p_l*cos(q_a5))


@njit(error_model="numpy")
def limits(t, y, p, out):
    """Numbers of parameters that have a bound. 0 operations."""
    p_r = p[1]
    p_m = p[2]
    p_e = p[3]
    out[0] = p_r
    out[1] = p_m
    out[2] = p_e


@njit(error_model="numpy")
def switches(t, y, p, out):
    """Gaps and restitutions of stops; speeds, levels and largest levels of frictions. 55 operations."""
    p_l = p[0]
    p_r = p[1]
    p_e = p[3]
    c0 = 4.0*p_r
    c1 = 2.0*p_r
    c2 = p_r + p_r
    q_a1 = y[0]
    q_a2 = y[1]
    q_a3 = y[2]
    q_a4 = y[3]
    q_a5 = y[4]
    x0 = p_l*sin(q_a2) - c1
    x1 = p_l*sin(q_a1) - c0 - x0
    x2 = p_l*cos(q_a2)
    x3 = x2 - p_l*cos(q_a1)
    x4 = p_l*sin(q_a3)
    x5 = x0 - x4
    x6 = p_l*cos(q_a3)
    x7 = x6 - x2
    x8 = c1 + p_l*sin(q_a4)
    x9 = x4 - x8
    x10 = p_l*cos(q_a4)
    x11 = x10 - x6
    x12 = x8 - (c0 + p_l*sin(q_a5))
    x13 = p_l*cos(q_a5) - x10
    out[0] = sqrt(x1*x1 + x3*x3) - c2
    out[1] = p_e
    out[2] = sqrt(x5*x5 + x7*x7) - c2
    out[3] = p_e
    out[4] = sqrt(x9*x9 + x11*x11) - c2
    out[5] = p_e
    out[6] = sqrt(x12*x12 + x13*x13) - c2
    out[7] = p_e


@njit(error_model="numpy")
def closed_rhs(t, y, p, out):
    """State derivative: rates, accelerations, multipliers, pivot ratio. 357 operations."""
    p_l = p[0]
    p_r = p[1]
    p_m = p[2]
    p_g = p[4]
    c0 = p_l*(p_m*p_g)
    c1 = 1.0/(p_m*(p_l*p_l))
    c2 = c0*c1
    c3 = 4.0*p_r
    c4 = 2.0*p_r
    q_a1 = y[0]
    q_a2 = y[1]
    q_a3 = y[2]
    q_a4 = y[3]
    q_a5 = y[4]
    v_a1 = y[5]
    v_a2 = y[6]
    v_a3 = y[7]
    v_a4 = y[8]
    v_a5 = y[9]
    s_hit12_closed = p[5]
    s_hit23_closed = p[6]
    s_hit34_closed = p[7]
    s_hit45_closed = p[8]
    x0 = sin(q_a1)
    x1 = p_l*x0
    x2 = sin(q_a2)
    x3 = p_l*x2
    x4 = x3 - c4
    x5 = x1 - c3 - x4
    x6 = cos(q_a2)
    x7 = p_l*x6
    x8 = cos(q_a1)
    x9 = p_l*x8
    x10 = x7 - x9
    x11 = sqrt(x5*x5 + x10*x10)
    x12 = 0.5/x11
    x13 = 2.0*x5
    x14 = 2.0*x10
    x15 = s_hit12_closed*(x12*(x9*x13 + x1*x14))
    x16 = x15*c1
    x17 = sin(q_a3)
    x18 = p_l*x17
    x19 = x4 - x18
    x20 = cos(q_a3)
    x21 = p_l*x20
    x22 = x21 - x7
    x23 = sqrt(x19*x19 + x22*x22)
    x24 = 0.5/x23
    x25 = 2.0*x19
    x26 = 2.0*x22
    x27 = s_hit23_closed*(x24*(x7*x25 + x3*x26))
    x28 = s_hit12_closed*(x12*(x7*x13 + x3*x14))
    x29 = x28*c1
    x30 = x27*x29
    x31 = 1.0/(1.0 - s_hit12_closed + x15*x16 + x28*x29)
    x32 = x30*x31
    x33 = x27*c1
    x34 = 1.0 - s_hit23_closed + x27*x33
    x35 = s_hit23_closed*(x24*(x21*x25 + x18*x26))
    x36 = x35*c1
    x37 = x35*x36
    x38 = x30*x32 - x34 - x37
    x39 = 1.0/x38
    x40 = x2*c0
    x41 = v_a3*x17
    x42 = p_l*(v_a3*x41)
    x43 = v_a2*x2
    x44 = p_l*(v_a2*x43)
    x45 = v_a2*x6
    x46 = p_l*x45
    x47 = v_a3*x20
    x48 = p_l*x47
    x49 = x46 - x48
    x50 = p_l*(v_a2*x45)
    x51 = p_l*(v_a3*x47)
    x52 = p_l*x43
    x53 = p_l*x41
    x54 = x52 - x53
    x55 = x25*(x42 - x44) + 2.0*(x49*x49) + (x26*(x50 - x51) + 2.0*(x54*x54))
    x56 = x49*x25 + x54*x26
    x57 = v_a1*x0
    x58 = v_a1*x8
    x59 = p_l*x58 - x46
    x60 = p_l*x57 - x52
    x61 = x13*(x44 - p_l*(v_a1*x57)) + 2.0*(x59*x59) + (x14*(p_l*(v_a1*x58) - x50) + 2.0*(x60*x60))
    x62 = x59*x13 + x60*x14
    x63 = x0*c0*x16 - s_hit12_closed*(x12*x61 - x62*(x12*(x62*x12)/x11))
    x64 = x63 - x40*x29
    x65 = x40*x33 - s_hit23_closed*(x24*x55 - x56*(x24*(x56*x24)/x23)) + x32*x64
    x66 = x17*c0
    x67 = x65 - x66*x36
    x68 = sin(q_a4)
    x69 = p_l*x68
    x70 = c4 + x69
    x71 = x18 - x70
    x72 = cos(q_a4)
    x73 = p_l*x72
    x74 = x73 - x21
    x75 = sqrt(x71*x71 + x74*x74)
    x76 = 0.5/x75
    x77 = 2.0*x71
    x78 = 2.0*x74
    x79 = s_hit34_closed*(x76*(x21*x77 + x18*x78))
    x80 = x79*x36
    x81 = x80*x39
    x82 = sin(q_a5)
    x83 = p_l*x82
    x84 = x70 - (c3 + x83)
    x85 = cos(q_a5)
    x86 = p_l*x85
    x87 = x86 - x73
    x88 = sqrt(x84*x84 + x87*x87)
    x89 = 0.5/x88
    x90 = 2.0*x84
    x91 = 2.0*x87
    x92 = s_hit45_closed*(x89*(x73*x90 + x69*x91))
    x93 = s_hit34_closed*(x76*(x73*x77 + x69*x78))
    x94 = x93*c1
    x95 = x92*x94
    x96 = x79*c1
    x97 = 1.0 - s_hit34_closed + x79*x96
    x98 = x93*x94
    x99 = x97 + x80*x81 + x98
    x100 = 1.0/x99
    x101 = x95*x100
    x102 = s_hit45_closed*(x89*(x86*x90 + x83*x91))
    x103 = x102*c1
    x104 = x92*c1
    x105 = 1.0 - s_hit45_closed + x102*x103 + x92*x104
    x106 = x95*x101 - x105
    x107 = x68*c0
    x108 = v_a5*x82
    x109 = v_a4*x68
    x110 = p_l*(v_a4*x109)
    x111 = v_a4*x72
    x112 = p_l*x111
    x113 = v_a5*x85
    x114 = x112 - p_l*x113
    x115 = p_l*(v_a4*x111)
    x116 = p_l*x109
    x117 = x116 - p_l*x108
    x118 = x90*(p_l*(v_a5*x108) - x110) + 2.0*(x114*x114) + (x91*(x115 - p_l*(v_a5*x113)) + 2.0*(x117*x117))
    x119 = x114*x90 + x117*x91
    x120 = x82*c0*x103 + s_hit45_closed*(x89*x118 - x119*(x89*(x119*x89)/x88))
    x121 = x48 - x112
    x122 = x53 - x116
    x123 = x77*(x110 - x42) + 2.0*(x121*x121) + (x78*(x51 - x115) + 2.0*(x122*x122))
    x124 = x121*x77 + x122*x78
    x125 = x66*x96 - s_hit34_closed*(x76*x123 - x124*(x76*(x124*x76)/x75))
    x126 = x125 - x81*x67 - x107*x94
    x127 = 1.0/x106*(x107*x104 - x120 + x101*x126)
    x128 = x101*x127 - x100*x126
    x129 = x39*x67 - x81*x128
    x130 = x32*x129 - x31*x64
    x131 = -(x106/x105)
    x132 = x99/(x97 + x98)
    x133 = -(x38/(x34 + x37))
    x134 = (x133 if x133 < 1.0 else 1.0)
    x135 = (x132 if x132 < x134 else x134)
    out[0] = v_a1
    out[1] = v_a2
    out[2] = v_a3
    out[3] = v_a4
    out[4] = v_a5
    out[5] = -(x0*c2 + x16*x130)
    out[6] = x29*x130 - x2*c2 - x33*x129
    out[7] = x36*x129 - x17*c2 - x96*x128
    out[8] = x94*x128 - x68*c2 - x104*x127
    out[9] = x103*x127 - x82*c2
    out[10] = -x130
    out[11] = -x129
    out[12] = -x128
    out[13] = -x127
    out[14] = (x131 if x131 < x135 else x135)


@njit(error_model="numpy")
def closed_residual(t, y, p, out):
    """M a - f - G^T lambda, then G a - gamma. 303 operations."""
    p_l = p[0]
    p_r = p[1]
    p_m = p[2]
    p_g = p[4]
    c0 = p_l*(p_m*p_g)
    c1 = 0.5*(p_m*(p_l*p_l))
    c2 = 4.0*p_r
    c3 = 2.0*p_r
    q_a1 = y[0]
    q_a2 = y[1]
    q_a3 = y[2]
    q_a4 = y[3]
    q_a5 = y[4]
    v_a1 = y[5]
    v_a2 = y[6]
    v_a3 = y[7]
    v_a4 = y[8]
    v_a5 = y[9]
    a_a1 = y[10]
    a_a2 = y[11]
    a_a3 = y[12]
    a_a4 = y[13]
    a_a5 = y[14]
    lam_hit12 = y[15]
    lam_hit23 = y[16]
    lam_hit34 = y[17]
    lam_hit45 = y[18]
    s_hit12_closed = p[5]
    s_hit23_closed = p[6]
    s_hit34_closed = p[7]
    s_hit45_closed = p[8]
    x0 = sin(q_a1)
    x1 = a_a1*c1
    x2 = cos(q_a2)
    x3 = p_l*x2
    x4 = cos(q_a1)
    x5 = x3 - p_l*x4
    x6 = 2.0*x5
    x7 = sin(q_a2)
    x8 = p_l*x7 - c3
    x9 = p_l*x0 - c2 - x8
    x10 = sqrt(x9*x9 + x5*x5)
    x11 = 0.5/x10
    x12 = x11*(lam_hit12*s_hit12_closed)
    x13 = x6*x12
    x14 = 2.0*x9
    x15 = x14*x12
    x16 = a_a2*c1
    x17 = sin(q_a3)
    x18 = p_l*x17
    x19 = x8 - x18
    x20 = 2.0*x19
    x21 = cos(q_a3)
    x22 = p_l*x21
    x23 = x22 - x3
    x24 = sqrt(x19*x19 + x23*x23)
    x25 = 0.5/x24
    x26 = x25*(lam_hit23*s_hit23_closed)
    x27 = x20*x26
    x28 = 2.0*x23
    x29 = x28*x26
    x30 = x7*c0 + (x16 + x16) - (p_l*(x2*(x27 - x15)) - p_l*(x7*(x13 - x29)))
    x31 = a_a3*c1
    x32 = sin(q_a4)
    x33 = c3 + p_l*x32
    x34 = x18 - x33
    x35 = 2.0*x34
    x36 = cos(q_a4)
    x37 = p_l*x36
    x38 = x37 - x22
    x39 = sqrt(x34*x34 + x38*x38)
    x40 = 0.5/x39
    x41 = x40*(lam_hit34*s_hit34_closed)
    x42 = x35*x41
    x43 = 2.0*x38
    x44 = x43*x41
    x45 = x17*c0 + (x31 + x31) - (p_l*(x21*(x42 - x27)) - p_l*(x17*(x29 - x44)))
    x46 = a_a4*c1
    x47 = sin(q_a5)
    x48 = x33 - (c2 + p_l*x47)
    x49 = 2.0*x48
    x50 = cos(q_a5)
    x51 = p_l*x50 - x37
    x52 = sqrt(x48*x48 + x51*x51)
    x53 = 0.5/x52
    x54 = x53*(lam_hit45*s_hit45_closed)
    x55 = x49*x54
    x56 = 2.0*x51
    x57 = x56*x54
    x58 = x32*c0 + (x46 + x46) - (p_l*(x36*(x55 - x42)) - p_l*(x32*(x44 - x57)))
    x59 = a_a5*c1
    x60 = v_a1*x4
    x61 = v_a2*x2
    x62 = p_l*x61
    x63 = p_l*x60 - x62
    x64 = v_a1*x0
    x65 = v_a2*x7
    x66 = p_l*(a_a2*x2 - v_a2*x65)
    x67 = p_l*x65
    x68 = p_l*x64 - x67
    x69 = p_l*(v_a2*x61 + a_a2*x7)
    x70 = 2.0*(x63*x63) + x14*(p_l*(a_a1*x4 - v_a1*x64) - x66) + (2.0*(x68*x68) + x6*(p_l*(v_a1*x60 + a_a1*x0) - x69))
    x71 = x63*x14 + x68*x6
    x72 = lam_hit12*(1.0 - s_hit12_closed) + s_hit12_closed*(x11*x70 - x71*(x11*(x71*x11)/x10))
    x73 = v_a3*x21
    x74 = p_l*x73
    x75 = x62 - x74
    x76 = v_a3*x17
    x77 = p_l*(a_a3*x21 - v_a3*x76)
    x78 = p_l*x76
    x79 = x67 - x78
    x80 = p_l*(v_a3*x73 + a_a3*x17)
    x81 = 2.0*(x75*x75) + x20*(x66 - x77) + (2.0*(x79*x79) + x28*(x69 - x80))
    x82 = x75*x20 + x79*x28
    x83 = lam_hit23*(1.0 - s_hit23_closed) + s_hit23_closed*(x25*x81 - x82*(x25*(x82*x25)/x24))
    x84 = v_a4*x36
    x85 = p_l*x84
    x86 = x74 - x85
    x87 = v_a4*x32
    x88 = p_l*(a_a4*x36 - v_a4*x87)
    x89 = p_l*x87
    x90 = x78 - x89
    x91 = p_l*(v_a4*x84 + a_a4*x32)
    x92 = 2.0*(x86*x86) + x35*(x77 - x88) + (2.0*(x90*x90) + x43*(x80 - x91))
    x93 = x86*x35 + x90*x43
    x94 = lam_hit34*(1.0 - s_hit34_closed) + s_hit34_closed*(x40*x92 - x93*(x40*(x93*x40)/x39))
    x95 = v_a5*x50
    x96 = x85 - p_l*x95
    x97 = v_a5*x47
    x98 = x89 - p_l*x97
    x99 = 2.0*(x96*x96) + x49*(x88 - p_l*(a_a5*x50 - v_a5*x97)) + (2.0*(x98*x98) + x56*(x91 - p_l*(v_a5*x95 + a_a5*x47)))
    x100 = x96*x49 + x98*x56
    x101 = lam_hit45*(1.0 - s_hit45_closed) + s_hit45_closed*(x53*x99 - x100*(x53*(x100*x53)/x52))
    out[0] = x0*c0 + (x1 + x1) - (p_l*(x0*x13) + p_l*(x4*x15))
    out[1] = x30
    out[2] = x45
    out[3] = x58
    out[4] = x47*c0 + (x59 + x59) + (p_l*(x47*x57) + p_l*(x50*x55))
    out[5] = x72
    out[6] = x83
    out[7] = x94
    out[8] = x101


@njit(error_model="numpy")
def closed_residual_jacobian(t, y, p, out):
    """Residual derivatives by q, v, a, lambda. 824 operations."""
    p_l = p[0]
    p_r = p[1]
    p_m = p[2]
    p_g = p[4]
    c0 = 4.0*p_r
    c1 = 2.0*p_r
    c2 = p_m*p_g
    c3 = p_m*(p_l*p_l)
    q_a1 = y[0]
    q_a2 = y[1]
    q_a3 = y[2]
    q_a4 = y[3]
    q_a5 = y[4]
    v_a1 = y[5]
    v_a2 = y[6]
    v_a3 = y[7]
    v_a4 = y[8]
    v_a5 = y[9]
    a_a1 = y[10]
    a_a2 = y[11]
    a_a3 = y[12]
    a_a4 = y[13]
    a_a5 = y[14]
    lam_hit12 = y[15]
    lam_hit23 = y[16]
    lam_hit34 = y[17]
    lam_hit45 = y[18]
    s_hit12_closed = p[5]
    s_hit23_closed = p[6]
    s_hit34_closed = p[7]
    s_hit45_closed = p[8]
    x0 = sin(q_a1)
    x1 = p_l*x0
    x2 = sin(q_a2)
    x3 = p_l*x2
    x4 = x3 - c1
    x5 = x1 - c0 - x4
    x6 = 2.0*x5
    x7 = cos(q_a2)
    x8 = p_l*x7
    x9 = cos(q_a1)
    x10 = p_l*x9
    x11 = x8 - x10
    x12 = sqrt(x5*x5 + x11*x11)
    x13 = 0.5/x12
    x14 = s_hit12_closed*x13
    x15 = lam_hit12*x14
    x16 = x6*x15
    x17 = 2.0*x11
    x18 = x17*x15
    x19 = x17*x13
    x20 = 1.0/x12
    x21 = x13*x20
    x22 = lam_hit12*(s_hit12_closed*x21)
    x23 = x6*x22
    x24 = x10*x23
    x25 = x17*x22
    x26 = 2.0*x15
    x27 = x19*x25 - x26
    x28 = x19*x24 + x1*x27
    x29 = x6*x13
    x30 = x29*x25
    x31 = x29*x24 - 2.0*(x10*x15) + x1*x30
    x32 = s_hit12_closed*(x13*(x10*x6 + x1*x17))
    x33 = x8*(x26 - x29*x23) - x3*x30
    x34 = x8*(x19*x23) + x3*x27
    x35 = cos(q_a3)
    x36 = p_l*x35
    x37 = x36 - x8
    x38 = 2.0*x37
    x39 = sin(q_a3)
    x40 = p_l*x39
    x41 = x4 - x40
    x42 = sqrt(x41*x41 + x37*x37)
    x43 = 0.5/x42
    x44 = s_hit23_closed*x43
    x45 = lam_hit23*x44
    x46 = x38*x45
    x47 = 2.0*x41
    x48 = x47*x45
    x49 = x38*x43
    x50 = 1.0/x42
    x51 = x43*x50
    x52 = lam_hit23*(s_hit23_closed*x51)
    x53 = x47*x52
    x54 = x49*x53
    x55 = x38*x52
    x56 = 2.0*x45
    x57 = x49*x55 - x56
    x58 = x8*x54 + x3*x57
    x59 = x47*x43
    x60 = x59*x53 - x56
    x61 = x59*x55
    x62 = x8*x60 + x3*x61
    x63 = x8*(c2 + (x18 - x46)) - x3*(x16 - x48) + x3*x58 + x8*x62 + x3*x34
    x64 = s_hit12_closed*(x13*(x8*x6 + x3*x17))
    x65 = s_hit23_closed*(x43*(x8*x47 + x3*x38))
    x66 = x36*x54 + x40*x57
    x67 = x36*x60 + x40*x61
    x68 = cos(q_a4)
    x69 = p_l*x68
    x70 = x69 - x36
    x71 = 2.0*x70
    x72 = sin(q_a4)
    x73 = p_l*x72
    x74 = c1 + x73
    x75 = x40 - x74
    x76 = sqrt(x75*x75 + x70*x70)
    x77 = 0.5/x76
    x78 = s_hit34_closed*x77
    x79 = lam_hit34*x78
    x80 = x71*x79
    x81 = 2.0*x75
    x82 = x81*x79
    x83 = x71*x77
    x84 = 1.0/x76
    x85 = x77*x84
    x86 = lam_hit34*(s_hit34_closed*x85)
    x87 = x81*x86
    x88 = x83*x87
    x89 = x71*x86
    x90 = 2.0*x79
    x91 = x83*x89 - x90
    x92 = x36*x88 + x40*x91
    x93 = x81*x77
    x94 = x93*x87 - x90
    x95 = x93*x89
    x96 = x36*x94 + x40*x95
    x97 = x36*(c2 + (x46 - x80)) - x40*(x48 - x82) + x40*x92 + x36*x96 + x40*x66
    x98 = s_hit23_closed*(x43*(x36*x47 + x40*x38))
    x99 = s_hit34_closed*(x77*(x36*x81 + x40*x71))
    x100 = x69*x88 + x73*x91
    x101 = x69*x94 + x73*x95
    x102 = cos(q_a5)
    x103 = p_l*x102
    x104 = x103 - x69
    x105 = 2.0*x104
    x106 = sin(q_a5)
    x107 = p_l*x106
    x108 = x74 - (c0 + x107)
    x109 = sqrt(x108*x108 + x104*x104)
    x110 = 0.5/x109
    x111 = s_hit45_closed*x110
    x112 = lam_hit45*x111
    x113 = x105*x112
    x114 = 2.0*x108
    x115 = x114*x112
    x116 = x105*x110
    x117 = 1.0/x109
    x118 = x110*x117
    x119 = lam_hit45*(s_hit45_closed*x118)
    x120 = x114*x119
    x121 = x105*x119
    x122 = 2.0*x112
    x123 = x116*x121 - x122
    x124 = x69*(x116*x120) + x73*x123
    x125 = x114*x110
    x126 = x125*x121
    x127 = x69*(x125*x120 - x122) + x73*x126
    x128 = x69*(c2 + (x80 - x113)) - x73*(x82 - x115) + x73*x124 + x69*x127
    x129 = s_hit34_closed*(x77*(x69*x81 + x73*x71))
    x130 = s_hit45_closed*(x110*(x69*x114 + x73*x105))
    x131 = x103*x120
    x132 = 2.0*(x103*x112) - x125*x131 - x107*x126
    x133 = x116*x131 + x107*x123
    x134 = s_hit45_closed*(x110*(x103*x114 + x107*x105))
    x135 = v_a1*x9
    x136 = v_a1*x0
    x137 = p_l*x136
    x138 = v_a2*x2
    x139 = p_l*x138
    x140 = x137 - x139
    x141 = 2.0*x140
    x142 = p_l*x135
    x143 = v_a2*x7
    x144 = p_l*x143
    x145 = x142 - x144
    x146 = x145*x6 + x140*x17
    x147 = x146*x13
    x148 = x13*x147/x12
    x149 = s_hit12_closed*(x148 + x146*(x13*x13*x20))
    x150 = p_l*(x14*(x141 + x141) - x17*x149)
    x151 = x6*x14
    x152 = v_a1*p_l
    x153 = x150 - x151*x152
    x154 = a_a1*x9
    x155 = a_a2*x7
    x156 = p_l*(x155 - v_a2*x138)
    x157 = p_l*(x154 - v_a1*x136) - x156
    x158 = 2.0*x145
    x159 = a_a1*x0
    x160 = a_a2*x2
    x161 = p_l*(v_a2*x143 + x160)
    x162 = p_l*(v_a1*x135 + x159) - x161
    x163 = x146*(x148*x20 + x20*(x147*x21 + x13*(x146*x21))) - (x145*x158 + x6*x157 + (x140*x141 + x17*x162))*x21
    x164 = s_hit12_closed*x163
    x165 = 2.0*(x14*x157 - x145*x149) + x29*x164
    x166 = 2.0*(x14*x162 - x140*x149) + x19*x164
    x167 = x17*x14
    x168 = x135*x153 + (x10*x165 + (x1*x166 + (p_l*(x167*x154) - p_l*(x151*x159))))
    x169 = p_l*(x14*(x158 + x158) - x6*x149)
    x170 = x167*x152 + x169
    x171 = p_l*x160
    x172 = p_l*x155
    x173 = v_a2*p_l
    x174 = x151*x173 - x150
    x175 = x169 + x167*x173
    x176 = x151*x171 - x167*x172 - x3*x166 - x8*x165 + x143*x174 + x138*x175
    x177 = x38*x44
    x178 = x47*x44
    x179 = v_a3*x35
    x180 = a_a3*x39
    x181 = p_l*(v_a3*x179 + x180)
    x182 = x161 - x181
    x183 = v_a3*x39
    x184 = p_l*x183
    x185 = x139 - x184
    x186 = p_l*x179
    x187 = x144 - x186
    x188 = x187*x47 + x185*x38
    x189 = x188*x43
    x190 = x43*x189/x42
    x191 = s_hit23_closed*(x190 + x188*(x43*x43*x50))
    x192 = 2.0*x187
    x193 = a_a3*x35
    x194 = p_l*(x193 - v_a3*x183)
    x195 = x156 - x194
    x196 = 2.0*x185
    x197 = x188*(x190*x50 + x50*(x189*x51 + x43*(x188*x51))) - (x187*x192 + x47*x195 + (x185*x196 + x38*x182))*x51
    x198 = s_hit23_closed*x197
    x199 = 2.0*(x44*x182 - x185*x191) + x49*x198
    x200 = 2.0*(x44*x195 - x187*x191) + x59*x198
    x201 = p_l*(x44*(x196 + x196) - x38*x191)
    x202 = x201 - x178*x173
    x203 = p_l*(x44*(x192 + x192) - x47*x191)
    x204 = x177*x173 + x203
    x205 = x177*x172 - x178*x171 + x3*x199 + x8*x200 + x143*x202 - x138*x204
    x206 = p_l*x180
    x207 = p_l*x193
    x208 = v_a3*p_l
    x209 = x178*x208 - x201
    x210 = x177*x208 + x203
    x211 = x178*x206 - x177*x207 - x40*x199 - x36*x200 + x179*x209 + x183*x210
    x212 = x71*x78
    x213 = x81*x78
    x214 = v_a4*x68
    x215 = a_a4*x72
    x216 = p_l*(v_a4*x214 + x215)
    x217 = x181 - x216
    x218 = v_a4*x72
    x219 = p_l*x218
    x220 = x184 - x219
    x221 = p_l*x214
    x222 = x186 - x221
    x223 = x222*x81 + x220*x71
    x224 = x223*x77
    x225 = x77*x224/x76
    x226 = s_hit34_closed*(x225 + x223*(x77*x77*x84))
    x227 = 2.0*x222
    x228 = a_a4*x68
    x229 = p_l*(x228 - v_a4*x218)
    x230 = x194 - x229
    x231 = 2.0*x220
    x232 = x223*(x225*x84 + x84*(x224*x85 + x77*(x223*x85))) - (x222*x227 + x81*x230 + (x220*x231 + x71*x217))*x85
    x233 = s_hit34_closed*x232
    x234 = 2.0*(x78*x217 - x220*x226) + x83*x233
    x235 = 2.0*(x78*x230 - x222*x226) + x93*x233
    x236 = p_l*(x78*(x231 + x231) - x71*x226)
    x237 = x236 - x213*x208
    x238 = p_l*(x78*(x227 + x227) - x81*x226)
    x239 = x212*x208 + x238
    x240 = x212*x207 - x213*x206 + x40*x234 + x36*x235 + x179*x237 - x183*x239
    x241 = p_l*x215
    x242 = p_l*x228
    x243 = v_a4*p_l
    x244 = x213*x243 - x236
    x245 = x212*x243 + x238
    x246 = x213*x241 - x212*x242 - x73*x234 - x69*x235 + x214*x244 + x218*x245
    x247 = x105*x111
    x248 = x114*x111
    x249 = v_a5*x102
    x250 = a_a5*x106
    x251 = x216 - p_l*(v_a5*x249 + x250)
    x252 = v_a5*x106
    x253 = p_l*x252
    x254 = x219 - x253
    x255 = p_l*x249
    x256 = x221 - x255
    x257 = x256*x114 + x254*x105
    x258 = x257*x110
    x259 = x110*x258/x109
    x260 = s_hit45_closed*(x259 + x257*(x110*x110*x117))
    x261 = 2.0*x256
    x262 = a_a5*x102
    x263 = x229 - p_l*(x262 - v_a5*x252)
    x264 = 2.0*x254
    x265 = x257*(x259*x117 + x117*(x258*x118 + x110*(x257*x118))) - (x256*x261 + x114*x263 + (x254*x264 + x105*x251))*x118
    x266 = s_hit45_closed*x265
    x267 = 2.0*(x111*x251 - x254*x260) + x116*x266
    x268 = 2.0*(x111*x263 - x256*x260) + x125*x266
    x269 = p_l*(x111*(x264 + x264) - x105*x260)
    x270 = x269 - x248*x243
    x271 = p_l*(x111*(x261 + x261) - x114*x260)
    x272 = x271 + x247*x243
    x273 = x247*x242 - x248*x241 + x73*x267 + x69*x268 + x214*x270 - x218*x272
    x274 = v_a5*p_l
    x275 = x247*x274 + x271
    x276 = x248*x274 - x269
    x277 = x249*x276 + (p_l*(x248*x250) - p_l*(x247*x262) - x107*x267 - x103*x268)
    out[0] = x1*x16 + x10*(c2 - x18) + x1*x28 + x10*x31
    out[1] = -(x3*x28 + x8*x31)
    out[10] = c3
    out[15] = -x32
    out[19] = x10*x33 - x1*x34
    out[20] = x63 - x8*x33
    out[21] = -(x40*x58 + x36*x62)
    out[30] = c3
    out[34] = x64
    out[35] = -x65
    out[39] = -(x3*x66 + x8*x67)
    out[40] = x97 + x36*x67
    out[41] = -(x73*x92 + x69*x96)
    out[50] = c3
    out[54] = x98
    out[55] = -x99
    out[59] = -(x40*x100 + x36*x101)
    out[60] = x128 + x73*x100 + x69*x101
    out[61] = -(x107*x124 + x103*x127)
    out[70] = c3
    out[74] = x129
    out[75] = -x130
    out[79] = x69*x132 - x73*x133
    out[80] = x103*(c2 + x113) - x107*x115 + x107*x133 - x103*x132
    out[90] = c3
    out[94] = x134
    out[95] = x168 - x136*x170
    out[96] = x176
    out[100] = x142*x167 - x137*x151 + x0*x153 + x9*x170
    out[101] = x139*x151 - x144*x167 + x2*x174 - x7*x175
    out[105] = x32
    out[106] = -x64
    out[110] = 1.0 - s_hit12_closed
    out[115] = x205
    out[116] = x211
    out[120] = x144*x177 - x139*x178 + x2*x202 + x7*x204
    out[121] = x184*x178 - x186*x177 + x39*x209 - x35*x210
    out[125] = x65
    out[126] = -x98
    out[130] = 1.0 - s_hit23_closed
    out[135] = x240
    out[136] = x246
    out[140] = x186*x212 - x184*x213 + x39*x237 + x35*x239
    out[141] = x219*x213 - x221*x212 + x72*x244 - x68*x245
    out[145] = x99
    out[146] = -x129
    out[150] = 1.0 - s_hit34_closed
    out[155] = x273
    out[156] = x252*x275 + x277
    out[160] = x221*x247 - x219*x248 + x72*x270 + x68*x272
    out[161] = x253*x248 - x255*x247 + x106*x276 - x102*x275
    out[165] = x130
    out[166] = -x134
    out[170] = 1.0 - s_hit45_closed


@njit(error_model="numpy")
def closed_constraint_residual(t, y, p, out):
    """Position residuals, velocity residuals. 119 operations."""
    p_l = p[0]
    p_r = p[1]
    c0 = 4.0*p_r
    c1 = 2.0*p_r
    c2 = p_r + p_r
    q_a1 = y[0]
    q_a2 = y[1]
    q_a3 = y[2]
    q_a4 = y[3]
    q_a5 = y[4]
    v_a1 = y[5]
    v_a2 = y[6]
    v_a3 = y[7]
    v_a4 = y[8]
    v_a5 = y[9]
    s_hit12_closed = p[5]
    s_hit23_closed = p[6]
    s_hit34_closed = p[7]
    s_hit45_closed = p[8]
    x0 = sin(q_a1)
    x1 = sin(q_a2)
    x2 = p_l*x1 - c1
    x3 = p_l*x0 - c0 - x2
    x4 = cos(q_a2)
    x5 = p_l*x4
    x6 = cos(q_a1)
    x7 = x5 - p_l*x6
    x8 = sqrt(x3*x3 + x7*x7)
    x9 = sin(q_a3)
    x10 = p_l*x9
    x11 = x2 - x10
    x12 = cos(q_a3)
    x13 = p_l*x12
    x14 = x13 - x5
    x15 = sqrt(x11*x11 + x14*x14)
    x16 = sin(q_a4)
    x17 = c1 + p_l*x16
    x18 = x10 - x17
    x19 = cos(q_a4)
    x20 = p_l*x19
    x21 = x20 - x13
    x22 = sqrt(x18*x18 + x21*x21)
    x23 = sin(q_a5)
    x24 = x17 - (c0 + p_l*x23)
    x25 = cos(q_a5)
    x26 = p_l*x25 - x20
    x27 = sqrt(x24*x24 + x26*x26)
    x28 = p_l*(v_a2*x4)
    x29 = p_l*(v_a2*x1)
    x30 = 2.0*(x3*(p_l*(v_a1*x6) - x28)) + 2.0*(x7*(p_l*(v_a1*x0) - x29))
    x31 = p_l*(v_a3*x12)
    x32 = p_l*(v_a3*x9)
    x33 = s_hit23_closed*(0.5/x15*(2.0*(x11*(x28 - x31)) + 2.0*(x14*(x29 - x32))))
    x34 = p_l*(v_a4*x19)
    x35 = p_l*(v_a4*x16)
    x36 = s_hit34_closed*(0.5/x22*(2.0*(x18*(x31 - x34)) + 2.0*(x21*(x32 - x35))))
    x37 = 2.0*(x24*(x34 - p_l*(v_a5*x25))) + 2.0*(x26*(x35 - p_l*(v_a5*x23)))
    out[0] = s_hit12_closed*(x8 - c2)
    out[1] = s_hit23_closed*(x15 - c2)
    out[2] = s_hit34_closed*(x22 - c2)
    out[3] = s_hit45_closed*(x27 - c2)
    out[4] = s_hit12_closed*(0.5/x8*x30)
    out[5] = x33
    out[6] = x36
    out[7] = s_hit45_closed*(0.5/x27*x37)


@njit(error_model="numpy")
def closed_constraint_jacobian(t, y, p, out):
    """Constraint Jacobian G, row by row. 106 operations."""
    p_l = p[0]
    p_r = p[1]
    c0 = 4.0*p_r
    c1 = 2.0*p_r
    q_a1 = y[0]
    q_a2 = y[1]
    q_a3 = y[2]
    q_a4 = y[3]
    q_a5 = y[4]
    s_hit12_closed = p[5]
    s_hit23_closed = p[6]
    s_hit34_closed = p[7]
    s_hit45_closed = p[8]
    x0 = p_l*sin(q_a1)
    x1 = p_l*sin(q_a2)
    x2 = x1 - c1
    x3 = x0 - c0 - x2
    x4 = p_l*cos(q_a2)
    x5 = p_l*cos(q_a1)
    x6 = x4 - x5
    x7 = 0.5/sqrt(x3*x3 + x6*x6)
    x8 = 2.0*x3
    x9 = 2.0*x6
    x10 = p_l*sin(q_a3)
    x11 = x2 - x10
    x12 = p_l*cos(q_a3)
    x13 = x12 - x4
    x14 = 0.5/sqrt(x11*x11 + x13*x13)
    x15 = 2.0*x11
    x16 = 2.0*x13
    x17 = p_l*sin(q_a4)
    x18 = c1 + x17
    x19 = x10 - x18
    x20 = p_l*cos(q_a4)
    x21 = x20 - x12
    x22 = 0.5/sqrt(x19*x19 + x21*x21)
    x23 = 2.0*x19
    x24 = 2.0*x21
    x25 = p_l*sin(q_a5)
    x26 = x18 - (c0 + x25)
    x27 = p_l*cos(q_a5)
    x28 = x27 - x20
    x29 = 0.5/sqrt(x26*x26 + x28*x28)
    x30 = 2.0*x26
    x31 = 2.0*x28
    out[0] = s_hit12_closed*(x7*(x5*x8 + x0*x9))
    out[1] = -(s_hit12_closed*(x7*(x4*x8 + x1*x9)))
    out[6] = s_hit23_closed*(x14*(x4*x15 + x1*x16))
    out[7] = -(s_hit23_closed*(x14*(x12*x15 + x10*x16)))
    out[12] = s_hit34_closed*(x22*(x12*x23 + x10*x24))
    out[13] = -(s_hit34_closed*(x22*(x20*x23 + x17*x24)))
    out[18] = s_hit45_closed*(x29*(x20*x30 + x17*x31))
    out[19] = -(s_hit45_closed*(x29*(x27*x30 + x25*x31)))


@njit(error_model="numpy")
def closed_gamma(t, y, p, out):
    """Right-hand side of G a = gamma. 198 operations."""
    p_l = p[0]
    p_r = p[1]
    c0 = 4.0*p_r
    c1 = 2.0*p_r
    q_a1 = y[0]
    q_a2 = y[1]
    q_a3 = y[2]
    q_a4 = y[3]
    q_a5 = y[4]
    v_a1 = y[5]
    v_a2 = y[6]
    v_a3 = y[7]
    v_a4 = y[8]
    v_a5 = y[9]
    s_hit12_closed = p[5]
    s_hit23_closed = p[6]
    s_hit34_closed = p[7]
    s_hit45_closed = p[8]
    x0 = sin(q_a1)
    x1 = sin(q_a2)
    x2 = p_l*x1 - c1
    x3 = p_l*x0 - c0 - x2
    x4 = cos(q_a2)
    x5 = p_l*x4
    x6 = cos(q_a1)
    x7 = x5 - p_l*x6
    x8 = sqrt(x3*x3 + x7*x7)
    x9 = 0.5/x8
    x10 = 2.0*x3
    x11 = v_a2*x1
    x12 = p_l*(v_a2*x11)
    x13 = v_a1*x0
    x14 = v_a1*x6
    x15 = v_a2*x4
    x16 = p_l*x15
    x17 = p_l*x14 - x16
    x18 = 2.0*x7
    x19 = p_l*(v_a2*x15)
    x20 = p_l*x11
    x21 = p_l*x13 - x20
    x22 = x10*(x12 - p_l*(v_a1*x13)) + 2.0*(x17*x17) + (x18*(p_l*(v_a1*x14) - x19) + 2.0*(x21*x21))
    x23 = x17*x10 + x21*x18
    x24 = sin(q_a3)
    x25 = p_l*x24
    x26 = x2 - x25
    x27 = cos(q_a3)
    x28 = p_l*x27
    x29 = x28 - x5
    x30 = sqrt(x26*x26 + x29*x29)
    x31 = 0.5/x30
    x32 = 2.0*x26
    x33 = v_a3*x24
    x34 = p_l*(v_a3*x33)
    x35 = v_a3*x27
    x36 = p_l*x35
    x37 = x16 - x36
    x38 = 2.0*x29
    x39 = p_l*(v_a3*x35)
    x40 = p_l*x33
    x41 = x20 - x40
    x42 = x32*(x34 - x12) + 2.0*(x37*x37) + (x38*(x19 - x39) + 2.0*(x41*x41))
    x43 = x37*x32 + x41*x38
    x44 = sin(q_a4)
    x45 = c1 + p_l*x44
    x46 = x25 - x45
    x47 = cos(q_a4)
    x48 = p_l*x47
    x49 = x48 - x28
    x50 = sqrt(x46*x46 + x49*x49)
    x51 = 0.5/x50
    x52 = 2.0*x46
    x53 = v_a4*x44
    x54 = p_l*(v_a4*x53)
    x55 = v_a4*x47
    x56 = p_l*x55
    x57 = x36 - x56
    x58 = 2.0*x49
    x59 = p_l*(v_a4*x55)
    x60 = p_l*x53
    x61 = x40 - x60
    x62 = x52*(x54 - x34) + 2.0*(x57*x57) + (x58*(x39 - x59) + 2.0*(x61*x61))
    x63 = x57*x52 + x61*x58
    x64 = sin(q_a5)
    x65 = x45 - (c0 + p_l*x64)
    x66 = cos(q_a5)
    x67 = p_l*x66 - x48
    x68 = sqrt(x65*x65 + x67*x67)
    x69 = 0.5/x68
    x70 = 2.0*x65
    x71 = v_a5*x64
    x72 = v_a5*x66
    x73 = x56 - p_l*x72
    x74 = 2.0*x67
    x75 = x60 - p_l*x71
    x76 = x70*(p_l*(v_a5*x71) - x54) + 2.0*(x73*x73) + (x74*(x59 - p_l*(v_a5*x72)) + 2.0*(x75*x75))
    x77 = x73*x70 + x75*x74
    out[0] = -(s_hit12_closed*(x9*x22 - x23*(x9*(x23*x9)/x8)))
    out[1] = -(s_hit23_closed*(x31*x42 - x43*(x31*(x43*x31)/x30)))
    out[2] = -(s_hit34_closed*(x51*x62 - x63*(x51*(x63*x51)/x50)))
    out[3] = -(s_hit45_closed*(x69*x76 - x77*(x69*(x77*x69)/x68)))


@njit(error_model="numpy")
def closed_project(t, y, p, out):
    """State moved onto the constraints, and the residuals it had. 330 operations."""
    p_l = p[0]
    p_r = p[1]
    p_m = p[2]
    c0 = 4.0*p_r
    c1 = 2.0*p_r
    c2 = 1.0/(p_m*(p_l*p_l))
    c3 = p_r + p_r
    q_a1 = y[0]
    q_a2 = y[1]
    q_a3 = y[2]
    q_a4 = y[3]
    q_a5 = y[4]
    v_a1 = y[5]
    v_a2 = y[6]
    v_a3 = y[7]
    v_a4 = y[8]
    v_a5 = y[9]
    s_hit12_closed = p[5]
    s_hit23_closed = p[6]
    s_hit34_closed = p[7]
    s_hit45_closed = p[8]
    x0 = p_l*sin(q_a1)
    x1 = p_l*sin(q_a2)
    x2 = x1 - c1
    x3 = x0 - c0 - x2
    x4 = p_l*cos(q_a2)
    x5 = p_l*cos(q_a1)
    x6 = x4 - x5
    x7 = sqrt(x3*x3 + x6*x6)
    x8 = 0.5/x7
    x9 = 2.0*x3
    x10 = 2.0*x6
    x11 = s_hit12_closed*(x8*(x5*x9 + x0*x10))
    x12 = x11*c2
    x13 = s_hit12_closed*(x7 - c3)
    x14 = s_hit12_closed*(x8*(x4*x9 + x1*x10))
    x15 = x14*c2
    x16 = 1.0/(1.0 - s_hit12_closed + x11*x12 + x14*x15)
    x17 = p_l*sin(q_a3)
    x18 = x2 - x17
    x19 = p_l*cos(q_a3)
    x20 = x19 - x4
    x21 = sqrt(x18*x18 + x20*x20)
    x22 = 0.5/x21
    x23 = 2.0*x18
    x24 = 2.0*x20
    x25 = s_hit23_closed*(x22*(x4*x23 + x1*x24))
    x26 = x25*x15
    x27 = x26*x16
    x28 = x25*c2
    x29 = s_hit23_closed*(x22*(x19*x23 + x17*x24))
    x30 = x29*c2
    x31 = 1.0/(x26*x27 - (1.0 - s_hit23_closed + x25*x28) - x29*x30)
    x32 = s_hit23_closed*(x21 - c3)
    x33 = x32 + x13*x27
    x34 = p_l*sin(q_a4)
    x35 = c1 + x34
    x36 = x17 - x35
    x37 = p_l*cos(q_a4)
    x38 = x37 - x19
    x39 = sqrt(x36*x36 + x38*x38)
    x40 = 0.5/x39
    x41 = 2.0*x36
    x42 = 2.0*x38
    x43 = s_hit34_closed*(x40*(x19*x41 + x17*x42))
    x44 = x43*x30
    x45 = x44*x31
    x46 = p_l*sin(q_a5)
    x47 = x35 - (c0 + x46)
    x48 = p_l*cos(q_a5)
    x49 = x48 - x37
    x50 = sqrt(x47*x47 + x49*x49)
    x51 = 0.5/x50
    x52 = 2.0*x47
    x53 = 2.0*x49
    x54 = s_hit45_closed*(x51*(x37*x52 + x34*x53))
    x55 = s_hit34_closed*(x40*(x37*x41 + x34*x42))
    x56 = x55*c2
    x57 = x54*x56
    x58 = x43*c2
    x59 = 1.0/(1.0 - s_hit34_closed + x43*x58 + x44*x45 + x55*x56)
    x60 = x57*x59
    x61 = s_hit45_closed*(x51*(x48*x52 + x46*x53))
    x62 = x61*c2
    x63 = x54*c2
    x64 = 1.0/(x57*x60 - (1.0 - s_hit45_closed + x61*x62 + x54*x63))
    x65 = s_hit34_closed*(x39 - c3)
    x66 = x45*x33 - x65
    x67 = s_hit45_closed*(x50 - c3)
    x68 = x64*(x60*x66 - x67)
    x69 = x60*x68 - x59*x66
    x70 = x31*x33 + x45*x69
    x71 = x13*x16 - x27*x70
    x72 = q_a1 - x12*x71
    x73 = q_a2 + (x15*x71 + x28*x70)
    x74 = q_a3 - (x30*x70 + x58*x69)
    x75 = q_a4 + (x56*x69 - x63*x68)
    x76 = q_a5 + x62*x68
    x77 = sin(x72)
    x78 = sin(x73)
    x79 = p_l*x78 - c1
    x80 = p_l*x77 - c0 - x79
    x81 = cos(x73)
    x82 = p_l*x81
    x83 = cos(x72)
    x84 = x82 - p_l*x83
    x85 = p_l*(v_a2*x81)
    x86 = p_l*(v_a2*x78)
    x87 = 2.0*(x80*(p_l*(v_a1*x83) - x85)) + 2.0*(x84*(p_l*(v_a1*x77) - x86))
    x88 = s_hit12_closed*(0.5/sqrt(x80*x80 + x84*x84)*x87)
    x89 = sin(x74)
    x90 = p_l*x89
    x91 = x79 - x90
    x92 = cos(x74)
    x93 = p_l*x92
    x94 = x93 - x82
    x95 = p_l*(v_a3*x92)
    x96 = p_l*(v_a3*x89)
    x97 = 0.5/sqrt(x91*x91 + x94*x94)*(2.0*(x91*(x85 - x95)) + 2.0*(x94*(x86 - x96)))
    x98 = s_hit23_closed*x97
    x99 = x98 + x27*x88
    x100 = sin(x75)
    x101 = c1 + p_l*x100
    x102 = x90 - x101
    x103 = cos(x75)
    x104 = p_l*x103
    x105 = x104 - x93
    x106 = p_l*(v_a4*x103)
    x107 = p_l*(v_a4*x100)
    x108 = 0.5/sqrt(x102*x102 + x105*x105)*(2.0*(x102*(x95 - x106)) + 2.0*(x105*(x96 - x107)))
    x109 = s_hit34_closed*x108
    x110 = x45*x99 - x109
    x111 = sin(x76)
    x112 = x101 - (c0 + p_l*x111)
    x113 = cos(x76)
    x114 = p_l*x113 - x104
    x115 = 2.0*(x112*(x106 - p_l*(v_a5*x113))) + 2.0*(x114*(x107 - p_l*(v_a5*x111)))
    x116 = s_hit45_closed*(0.5/sqrt(x112*x112 + x114*x114)*x115)
    x117 = x64*(x60*x110 - x116)
    x118 = x60*x117 - x59*x110
    x119 = x31*x99 + x45*x118
    x120 = x16*x88 - x27*x119
    out[0] = x72
    out[1] = x73
    out[2] = x74
    out[3] = x75
    out[4] = x76
    out[5] = v_a1 - x12*x120
    out[6] = v_a2 + (x15*x120 + x28*x119)
    out[7] = v_a3 - (x30*x119 + x58*x118)
    out[8] = v_a4 + (x56*x118 - x63*x117)
    out[9] = v_a5 + x62*x117
    out[10] = x13
    out[11] = x32
    out[12] = x65
    out[13] = x67
    out[14] = x88
    out[15] = x98
    out[16] = x109
    out[17] = x116


@njit(error_model="numpy")
def closed_events(t, y, p, out):
    """Event functions. 337 operations."""
    p_l = p[0]
    p_r = p[1]
    p_m = p[2]
    p_g = p[4]
    c0 = 4.0*p_r
    c1 = 2.0*p_r
    c2 = p_r + p_r
    c3 = 1.0/(p_m*(p_l*p_l))
    c4 = p_l*(p_m*p_g)
    q_a1 = y[0]
    q_a2 = y[1]
    q_a3 = y[2]
    q_a4 = y[3]
    q_a5 = y[4]
    v_a1 = y[5]
    v_a2 = y[6]
    v_a3 = y[7]
    v_a4 = y[8]
    v_a5 = y[9]
    s_hit12_closed = p[5]
    s_hit23_closed = p[6]
    s_hit34_closed = p[7]
    s_hit45_closed = p[8]
    x0 = sin(q_a1)
    x1 = p_l*x0
    x2 = sin(q_a2)
    x3 = p_l*x2
    x4 = x3 - c1
    x5 = x1 - c0 - x4
    x6 = cos(q_a2)
    x7 = p_l*x6
    x8 = cos(q_a1)
    x9 = p_l*x8
    x10 = x7 - x9
    x11 = sqrt(x5*x5 + x10*x10)
    x12 = 1.0 - s_hit12_closed
    x13 = sin(q_a3)
    x14 = p_l*x13
    x15 = x4 - x14
    x16 = cos(q_a3)
    x17 = p_l*x16
    x18 = x17 - x7
    x19 = sqrt(x15*x15 + x18*x18)
    x20 = 0.5/x19
    x21 = 2.0*x15
    x22 = 2.0*x18
    x23 = s_hit23_closed*(x20*(x7*x21 + x3*x22))
    x24 = 0.5/x11
    x25 = 2.0*x5
    x26 = 2.0*x10
    x27 = s_hit12_closed*(x24*(x7*x25 + x3*x26))
    x28 = x27*c3
    x29 = x23*x28
    x30 = s_hit12_closed*(x24*(x9*x25 + x1*x26))
    x31 = x30*c3
    x32 = 1.0/(x12 + x30*x31 + x27*x28)
    x33 = x29*x32
    x34 = 1.0 - s_hit23_closed
    x35 = x23*c3
    x36 = s_hit23_closed*(x20*(x17*x21 + x14*x22))
    x37 = x36*c3
    x38 = 1.0/(x29*x33 - (x34 + x23*x35) - x36*x37)
    x39 = x2*c4
    x40 = v_a3*x13
    x41 = p_l*(v_a3*x40)
    x42 = v_a2*x2
    x43 = p_l*(v_a2*x42)
    x44 = v_a2*x6
    x45 = p_l*x44
    x46 = v_a3*x16
    x47 = p_l*x46
    x48 = x45 - x47
    x49 = p_l*(v_a2*x44)
    x50 = p_l*(v_a3*x46)
    x51 = p_l*x42
    x52 = p_l*x40
    x53 = x51 - x52
    x54 = x21*(x41 - x43) + 2.0*(x48*x48) + (x22*(x49 - x50) + 2.0*(x53*x53))
    x55 = x48*x21 + x53*x22
    x56 = v_a1*x0
    x57 = v_a1*x8
    x58 = p_l*x57 - x45
    x59 = p_l*x56 - x51
    x60 = x25*(x43 - p_l*(v_a1*x56)) + 2.0*(x58*x58) + (x26*(p_l*(v_a1*x57) - x49) + 2.0*(x59*x59))
    x61 = x58*x25 + x59*x26
    x62 = c4*(x0*x31) - s_hit12_closed*(x24*x60 - x61*(x24*(x61*x24)/x11))
    x63 = x62 - x39*x28
    x64 = x39*x35 - s_hit23_closed*(x20*x54 - x55*(x20*(x55*x20)/x19)) + x33*x63
    x65 = x13*c4
    x66 = x64 - x65*x37
    x67 = sin(q_a4)
    x68 = p_l*x67
    x69 = c1 + x68
    x70 = x14 - x69
    x71 = cos(q_a4)
    x72 = p_l*x71
    x73 = x72 - x17
    x74 = sqrt(x70*x70 + x73*x73)
    x75 = 0.5/x74
    x76 = 2.0*x70
    x77 = 2.0*x73
    x78 = s_hit34_closed*(x75*(x17*x76 + x14*x77))
    x79 = x78*x37
    x80 = x79*x38
    x81 = sin(q_a5)
    x82 = p_l*x81
    x83 = x69 - (c0 + x82)
    x84 = cos(q_a5)
    x85 = p_l*x84
    x86 = x85 - x72
    x87 = sqrt(x83*x83 + x86*x86)
    x88 = 0.5/x87
    x89 = 2.0*x83
    x90 = 2.0*x86
    x91 = s_hit45_closed*(x88*(x72*x89 + x68*x90))
    x92 = s_hit34_closed*(x75*(x72*x76 + x68*x77))
    x93 = x92*c3
    x94 = x91*x93
    x95 = 1.0 - s_hit34_closed
    x96 = x78*c3
    x97 = 1.0/(x95 + x78*x96 + x79*x80 + x92*x93)
    x98 = x94*x97
    x99 = 1.0 - s_hit45_closed
    x100 = s_hit45_closed*(x88*(x85*x89 + x82*x90))
    x101 = x100*c3
    x102 = x91*c3
    x103 = x67*c4
    x104 = v_a5*x81
    x105 = v_a4*x67
    x106 = p_l*(v_a4*x105)
    x107 = v_a4*x71
    x108 = p_l*x107
    x109 = v_a5*x84
    x110 = x108 - p_l*x109
    x111 = p_l*(v_a4*x107)
    x112 = p_l*x105
    x113 = x112 - p_l*x104
    x114 = x89*(p_l*(v_a5*x104) - x106) + 2.0*(x110*x110) + (x90*(x111 - p_l*(v_a5*x109)) + 2.0*(x113*x113))
    x115 = x110*x89 + x113*x90
    x116 = s_hit45_closed*(x88*x114 - x115*(x88*(x115*x88)/x87)) + c4*(x81*x101)
    x117 = x47 - x108
    x118 = x52 - x112
    x119 = x76*(x106 - x41) + 2.0*(x117*x117) + (x77*(x50 - x111) + 2.0*(x118*x118))
    x120 = x117*x76 + x118*x77
    x121 = x65*x96 - s_hit34_closed*(x75*x119 - x120*(x75*(x120*x75)/x74))
    x122 = x121 - x80*x66 - x103*x93
    x123 = 1.0/(x94*x98 - (x99 + x100*x101 + x91*x102))*(x103*x102 - x116 + x98*x122)
    x124 = x98*x123 - x97*x122
    x125 = x38*x66 - x80*x124
    out[0] = (x11 - c2)*x12 - s_hit12_closed*(x33*x125 - x32*x63)
    out[1] = (x19 - c2)*x34 - s_hit23_closed*x125
    out[2] = (x74 - c2)*x95 - s_hit34_closed*x124
    out[3] = (x87 - c2)*x99 - s_hit45_closed*x123
