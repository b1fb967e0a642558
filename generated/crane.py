"""crane: equations of motion, written by symgen 0.1.0. Do not edit.

Crane that drops its load into two slings: ropes that grow tight and slack, under a trolley on rubber stops
"""

from math import cos, sin, sqrt

from numba import njit

MODEL = {
    "abi": 1,
    "generator": "symgen 0.1.0",
    "source": "sha256:6d9c1c8ed1011f3d89e3314c8192b2fdea70bf134f48609e762af05d3fafd295",
    "name": "crane",
    "description": "Crane that drops its load into two slings: ropes that grow tight and slack, under a trolley on rubber stops",
    "nq": 4,
    "nv": 4,
    "nh": 0,
    "nn": 0,
    "nw": 1,
    "coordinates": [
        {"name": "travel", "unit": "m", "value": 0.0, "enforced": False},
        {"name": "load_x", "unit": "m", "value": 0.2, "enforced": True},
        {"name": "load_y", "unit": "m", "value": -4.3, "enforced": True},
        {"name": "load_angle", "unit": "rad", "value": 0.08726646259971647, "enforced": True},
    ],
    "quaternions": [],
    "rates": [
        {"name": "travel", "unit": "m/s", "value": 0.0, "enforced": False},
        {"name": "load_x", "unit": "m/s", "value": 0.0, "enforced": True},
        {"name": "load_y", "unit": "m/s", "value": 0.0, "enforced": True},
        {"name": "load_angle", "unit": "rad/s", "value": 0.0, "enforced": True},
    ],
    "parameters": [
        {"name": "k", "unit": "N/m", "value": 400000.0, "doc": ""},
        {"name": "c", "unit": "N*s/m", "value": 2000.0, "doc": ""},
        {"name": "l", "unit": "m", "value": 5.0, "doc": ""},
        {"name": "g", "unit": "m/s^2", "value": 9.81, "doc": ""},
    ],
    "inputs": [
        {"name": "drive", "unit": "N", "value": 0.0, "table": {"kind": "linear", "t": [0.0, 1.0, 1.01, 3.0, 3.01, 6.0], "values": [4000.0, 4000.0, -4000.0, -4000.0, 0.0, 0.0]}},
    ],
    "constants": [],
    "constraints": [],
    "outputs": [
        {"name": "tension_left", "unit": "N"},
        {"name": "tension_right", "unit": "N"},
    ],
    "events": [
        {"name": "jump_0", "direction": "both", "action": "jump", "says": "min(buffer_y^2 + buffer_z^2 + (-31/10 + buffer_x)^2, (1/2)^2) in the potential"},
        {"name": "jump_1", "direction": "both", "action": "jump", "says": "max((hook_x - left_x)^2 + (hook_y - left_y)^2 + (hook_z - left_z)^2, l^2) in the potential"},
        {"name": "jump_2", "direction": "both", "action": "jump", "says": "max((hook_x - right_x)^2 + (hook_y - right_y)^2 + (hook_z - right_z)^2, l^2) in the potential"},
        {"name": "jump_3", "direction": "both", "action": "jump", "says": "5000*dot(stop_length) < -200000*(-1/2 + stop_length) in the dissipation"},
        {"name": "jump_4", "direction": "both", "action": "jump", "says": "-k*(sling_left_length - l) < c*dot(sling_left_length) in the dissipation"},
        {"name": "jump_5", "direction": "both", "action": "jump", "says": "-k*(sling_right_length - l) < c*dot(sling_right_length) in the dissipation"},
    ],
    "bodies": [
        {"name": "trolley", "planar": True, "shape": "box", "sizes": 3, "mesh": ""},
        {"name": "load", "planar": True, "shape": "box", "sizes": 3, "mesh": ""},
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
        "rhs": 272,
        "mass_matrix": 0,
        "forces": 185,
        "energy": 70,
        "residual": 189,
        "residual_jacobian": 695,
        "poses": 3,
        "shapes": 0,
        "outputs": 88,
        "events": 99,
        "marks": 26,
        "limits": 0,
    },
    "hoisted": {
        "rhs": 3,
        "forces": 3,
        "energy": 3,
        "residual": 2,
        "residual_jacobian": 4,
        "outputs": 1,
        "events": 1,
    },
    "run": {
        "t_end": 6.0,
        "fps": 60.0,
    },
    "limits": [
        {"name": "springs.sling_left.length", "bound": "zero or more"},
        {"name": "springs.sling_left.stiffness", "bound": "zero or more"},
        {"name": "springs.sling_left.damping", "bound": "zero or more"},
    ],
    "subsystems": [],
    "marks": [
        {"kind": "ground", "name": "travel", "body": "", "numbers": 3},
        {"kind": "slide", "name": "travel", "body": "", "numbers": 6},
        {"kind": "point", "name": "left", "body": "load", "numbers": 3},
        {"kind": "point", "name": "right", "body": "load", "numbers": 3},
        {"kind": "point", "name": "hook", "body": "trolley", "numbers": 3},
        {"kind": "point", "name": "buffer", "body": "trolley", "numbers": 3},
        {"kind": "rail", "name": "track", "body": "", "numbers": 6},
        {"kind": "link", "name": "sling_left", "body": "", "numbers": 6, "moves": True},
        {"kind": "link", "name": "sling_right", "body": "", "numbers": 6, "moves": True},
        {"kind": "spring", "name": "stop", "body": "", "numbers": 6, "moves": True},
    ],
}

@njit(error_model="numpy")
def rhs(t, y, p, out):
    """State derivative: rates, accelerations, power. 272 operations."""
    p_k = p[0]
    p_c = p[1]
    p_l = p[2]
    p_g = p[3]
    c0 = p_l*p_l
    c1 = 0.5*p_c
    c2 = 2304.0*p_g
    q_travel = y[0]
    q_load_x = y[1]
    q_load_y = y[2]
    q_load_angle = y[3]
    v_travel = y[4]
    v_load_x = y[5]
    v_load_y = y[6]
    v_load_angle = y[7]
    u_drive = p[4]
    b_0 = p[5]
    b_1 = p[6]
    b_2 = p[7]
    x0 = 300.0*v_travel
    x1 = 1.0 + q_travel + -3.1
    x2 = 2.0*x1
    x3 = x1*x1
    x4 = 1e+300*b_0 + (-0.25 + x3)
    x5 = sqrt((x3 if x4 < 0.0 else 0.25))
    x6 = 0.5/x5
    x7 = (v_travel*x2 if x4 < 0.0 else 0.0)*x6
    x8 = 5000.0*x7
    x9 = 200000.0*(x5 + -0.5)
    x10 = x8 - x9
    x11 = x10*x10
    x12 = 2.0*x10
    x13 = -x9
    x14 = (1.0 if -1.0 < x11 else 0.0)
    x15 = 2.0*x7
    x16 = x9 - x9*(0.0 if x8 < x13 else x14) + 2500.0*((x14 if x8 < x13 else 0.0)*x15)
    x17 = (x6*(5000.0*((0.0 if -1.0 < x11 else 1.0)*x12) + x16) if x4 < 0.0 else 0.0)
    x18 = cos(q_load_angle)
    x19 = 1.5*x18
    x20 = sin(q_load_angle)
    x21 = 0.2*x20
    x22 = q_travel - (q_load_x + (x19 - x21))
    x23 = 2.0*x22
    x24 = 1.5*x20
    x25 = 0.2*x18
    x26 = -0.25 - (q_load_y + (x24 + x25))
    x27 = x22*x22 + x26*x26
    x28 = 1e+300*b_2 + (x27 - c0)
    x29 = sqrt((c0 if x28 < 0.0 else x27))
    x30 = 0.5/x29
    x31 = v_load_y*x20 + v_load_x*x18 - 0.2*v_load_angle
    x32 = x18*x31
    x33 = 1.5*v_load_angle
    x34 = v_load_y*x18 - v_load_x*x20
    x35 = x33 + x34
    x36 = x20*x31
    x37 = 2.0*x26
    x38 = (0.0 if x28 < 0.0 else (v_travel - (x32 - x20*x35))*x23 - (x36 + x18*x35)*x37)
    x39 = x38*x30
    x40 = p_c*x39
    x41 = p_k*(x29 - p_l)
    x42 = x40 - x41
    x43 = x42*x42
    x44 = 2.0*x42
    x45 = -x41
    x46 = (1.0 if -1.0 < x43 else 0.0)
    x47 = 2.0*x39
    x48 = x41 - x41*(0.0 if x45 < x40 else x46) + c1*((x46 if x45 < x40 else 0.0)*x47)
    x49 = (0.0 if x28 < 0.0 else x30*(p_c*((0.0 if -1.0 < x43 else 1.0)*x44) + x48))
    x50 = x23*x49
    x51 = q_travel - (q_load_x - (x19 + x21))
    x52 = 2.0*x51
    x53 = -0.25 - (q_load_y + (x25 - x24))
    x54 = x51*x51 + x53*x53
    x55 = 1e+300*b_1 + (x54 - c0)
    x56 = sqrt((c0 if x55 < 0.0 else x54))
    x57 = 0.5/x56
    x58 = x34 - x33
    x59 = 2.0*x53
    x60 = (0.0 if x55 < 0.0 else (v_travel - (x32 - x20*x58))*x52 - (x36 + x18*x58)*x59)
    x61 = x60*x57
    x62 = p_c*x61
    x63 = p_k*(x56 - p_l)
    x64 = x62 - x63
    x65 = x64*x64
    x66 = 2.0*x64
    x67 = -x63
    x68 = (1.0 if -1.0 < x65 else 0.0)
    x69 = 2.0*x61
    x70 = x63 - x63*(0.0 if x67 < x62 else x68) + c1*((x68 if x67 < x62 else 0.0)*x69)
    x71 = (0.0 if x55 < 0.0 else x57*(p_c*((0.0 if -1.0 < x65 else 1.0)*x66) + x70))
    x72 = x52*x71
    x73 = x37*x49
    x74 = x59*x71
    x75 = x20*(x73 + x74) + x18*(x50 + x72)
    x76 = x20*x50 - x18*x73
    x77 = x20*x72 - x18*x74
    x78 = x76 + x77
    x79 = (-1.0 if -1.0 < x11 else 0.0)
    x80 = 2500.0*(x15*(x79 if x8 < x13 else 0.0)) - x9*(0.0 if x8 < x13 else x79)
    x81 = (x6*(5000.0*(x12*(0.0 if -1.0 < x11 else -1.0)) + x80) if x4 < 0.0 else 0.0)
    x82 = (-1.0 if -1.0 < x43 else 0.0)
    x83 = c1*(x47*(x82 if x45 < x40 else 0.0)) - x41*(0.0 if x45 < x40 else x82)
    x84 = (0.0 if x28 < 0.0 else x30*(p_c*(x44*(0.0 if -1.0 < x43 else -1.0)) + x83))
    x85 = x23*x84
    x86 = (-1.0 if -1.0 < x65 else 0.0)
    x87 = c1*(x69*(x86 if x67 < x62 else 0.0)) - x63*(0.0 if x67 < x62 else x86)
    x88 = (0.0 if x55 < 0.0 else x57*(p_c*(x66*(0.0 if -1.0 < x65 else -1.0)) + x87))
    x89 = x52*x88
    x90 = x37*x84
    x91 = x59*x88
    x92 = x20*(x90 + x91) + x18*(x85 + x89)
    x93 = x20*x85 - x18*x90
    x94 = x20*x89 - x18*x91
    x95 = x93 + x94
    x96 = v_travel*(u_drive + (x2*x81 - x0 + x85 + x89)) - v_load_x*(x18*x92 + x20*x95)
    x97 = x96 + v_load_y*(x18*x95 - x20*x92) + v_load_angle*(1.5*(x93 - x94) + 0.2*x92)
    out[0] = v_travel
    out[1] = v_load_x
    out[2] = v_load_y
    out[3] = v_load_angle
    out[4] = -(0.001*(x0 + x2*x17 + x50 + x72 - u_drive))
    out[5] = 0.00043402777777777775*(x18*x75 + x20*x78)
    out[6] = -(0.00043402777777777775*(c2 + x18*x78 - x20*x75))
    out[7] = -(0.0005685953420669577*(1.5*(x76 - x77) + 0.2*x75))
    out[8] = x97


@njit(error_model="numpy")
def mass_matrix(t, y, p, out):
    """Mass matrix M, row by row. 0 operations."""
    out[0] = 1000.0
    out[5] = 2304.0
    out[10] = 2304.0
    out[15] = 1758.72


@njit(error_model="numpy")
def forces(t, y, p, out):
    """Forces f of M a = f + G^T lambda. 185 operations."""
    p_k = p[0]
    p_c = p[1]
    p_l = p[2]
    p_g = p[3]
    c0 = p_l*p_l
    c1 = 2.0*p_c
    c2 = 2304.0*p_g
    q_travel = y[0]
    q_load_x = y[1]
    q_load_y = y[2]
    q_load_angle = y[3]
    v_travel = y[4]
    v_load_x = y[5]
    v_load_y = y[6]
    v_load_angle = y[7]
    u_drive = p[4]
    b_0 = p[5]
    b_1 = p[6]
    b_2 = p[7]
    x0 = 1.0 + q_travel + -3.1
    x1 = 2.0*x0
    x2 = x0*x0
    x3 = 1e+300*b_0 + (-0.25 + x2)
    x4 = sqrt((x2 if x3 < 0.0 else 0.25))
    x5 = 0.5/x4
    x6 = 200000.0*(x4 + -0.5)
    x7 = (v_travel*x1 if x3 < 0.0 else 0.0)*x5
    x8 = 5000.0*x7
    x9 = -x6
    x10 = x8 - x6
    x11 = x10*x10
    x12 = (1.0 if -1.0 < x11 else 0.0)
    x13 = x6 - x6*(0.0 if x8 < x9 else x12) + 5000.0*(x7*(x12 if x8 < x9 else 0.0))
    x14 = (x5*(x13 + 10000.0*(x10*(0.0 if -1.0 < x11 else 1.0))) if x3 < 0.0 else 0.0)
    x15 = cos(q_load_angle)
    x16 = 1.5*x15
    x17 = sin(q_load_angle)
    x18 = 0.2*x17
    x19 = q_travel - (q_load_x + (x16 - x18))
    x20 = 2.0*x19
    x21 = 1.5*x17
    x22 = 0.2*x15
    x23 = -0.25 - (q_load_y + (x21 + x22))
    x24 = x19*x19 + x23*x23
    x25 = 1e+300*b_2 + (x24 - c0)
    x26 = sqrt((c0 if x25 < 0.0 else x24))
    x27 = 0.5/x26
    x28 = p_k*(x26 - p_l)
    x29 = -x28
    x30 = v_load_y*x17 + v_load_x*x15 - 0.2*v_load_angle
    x31 = x15*x30
    x32 = 1.5*v_load_angle
    x33 = v_load_y*x15 - v_load_x*x17
    x34 = x32 + x33
    x35 = x17*x30
    x36 = 2.0*x23
    x37 = (0.0 if x25 < 0.0 else (v_travel - (x31 - x17*x34))*x20 - (x35 + x15*x34)*x36)
    x38 = x37*x27
    x39 = p_c*x38
    x40 = x39 - x28
    x41 = x40*x40
    x42 = (1.0 if -1.0 < x41 else 0.0)
    x43 = x28 - x28*(0.0 if x29 < x39 else x42) + p_c*(x38*(x42 if x29 < x39 else 0.0))
    x44 = (0.0 if x25 < 0.0 else x27*(x43 + x40*(0.0 if -1.0 < x41 else 1.0)*c1))
    x45 = x20*x44
    x46 = q_travel - (q_load_x - (x16 + x18))
    x47 = 2.0*x46
    x48 = -0.25 - (q_load_y + (x22 - x21))
    x49 = x46*x46 + x48*x48
    x50 = 1e+300*b_1 + (x49 - c0)
    x51 = sqrt((c0 if x50 < 0.0 else x49))
    x52 = 0.5/x51
    x53 = p_k*(x51 - p_l)
    x54 = -x53
    x55 = x33 - x32
    x56 = 2.0*x48
    x57 = (0.0 if x50 < 0.0 else (v_travel - (x31 - x17*x55))*x47 - (x35 + x15*x55)*x56)
    x58 = x57*x52
    x59 = p_c*x58
    x60 = x59 - x53
    x61 = x60*x60
    x62 = (1.0 if -1.0 < x61 else 0.0)
    x63 = x53 - x53*(0.0 if x54 < x59 else x62) + p_c*(x58*(x62 if x54 < x59 else 0.0))
    x64 = (0.0 if x50 < 0.0 else x52*(x63 + x60*(0.0 if -1.0 < x61 else 1.0)*c1))
    x65 = x47*x64
    x66 = x36*x44
    x67 = x56*x64
    x68 = x17*(x66 + x67) + x15*(x45 + x65)
    x69 = x17*x45 - x15*x66
    x70 = x17*x65 - x15*x67
    x71 = x69 + x70
    out[0] = -(300.0*v_travel + x1*x14 + x45 + x65 - u_drive)
    out[1] = x15*x68 + x17*x71
    out[2] = -(c2 + x15*x71 - x17*x68)
    out[3] = -(1.5*(x69 - x70) + 0.2*x68)


@njit(error_model="numpy")
def energy(t, y, p, out):
    """Kinetic and potential energy. 70 operations."""
    p_k = p[0]
    p_l = p[2]
    p_g = p[3]
    c0 = 0.5*p_k
    c1 = p_l*p_l
    c2 = 2304.0*p_g
    q_travel = y[0]
    q_load_x = y[1]
    q_load_y = y[2]
    q_load_angle = y[3]
    v_travel = y[4]
    v_load_x = y[5]
    v_load_y = y[6]
    v_load_angle = y[7]
    b_0 = p[5]
    b_1 = p[6]
    b_2 = p[7]
    x0 = 1000.0*(v_travel*v_travel) + (2304.0*(v_load_x*v_load_x) + 2304.0*(v_load_y*v_load_y))
    x1 = cos(q_load_angle)
    x2 = 1.5*x1
    x3 = sin(q_load_angle)
    x4 = 0.2*x3
    x5 = q_travel - (q_load_x + (x2 - x4))
    x6 = 1.5*x3
    x7 = 0.2*x1
    x8 = -0.25 - (q_load_y + (x6 + x7))
    x9 = x5*x5 + x8*x8
    x10 = sqrt((c1 if 1e+300*b_2 + (x9 - c1) < 0.0 else x9)) - p_l
    x11 = 1.0 + q_travel + -3.1
    x12 = x11*x11
    x13 = sqrt((x12 if 1e+300*b_0 + (-0.25 + x12) < 0.0 else 0.25)) + -0.5
    x14 = q_travel - (q_load_x - (x2 + x4))
    x15 = -0.25 - (q_load_y + (x7 - x6))
    x16 = x14*x14 + x15*x15
    x17 = sqrt((c1 if 1e+300*b_1 + (x16 - c1) < 0.0 else x16)) - p_l
    x18 = c0*(x10*x10) + (100000.0*(x13*x13) + x17*x17*c0) + q_load_y*c2
    out[0] = 0.5*(x0 + 1758.72*(v_load_angle*v_load_angle))
    out[1] = x18


@njit(error_model="numpy")
def residual(t, y, p, out):
    """M a - f - G^T lambda, then G a - gamma. 189 operations."""
    p_k = p[0]
    p_c = p[1]
    p_l = p[2]
    p_g = p[3]
    c0 = p_l*p_l
    c1 = 2.0*p_c
    q_travel = y[0]
    q_load_x = y[1]
    q_load_y = y[2]
    q_load_angle = y[3]
    v_travel = y[4]
    v_load_x = y[5]
    v_load_y = y[6]
    v_load_angle = y[7]
    a_travel = y[8]
    a_load_x = y[9]
    a_load_y = y[10]
    a_load_angle = y[11]
    u_drive = p[4]
    b_0 = p[5]
    b_1 = p[6]
    b_2 = p[7]
    x0 = cos(q_load_angle)
    x1 = 1.5*x0
    x2 = sin(q_load_angle)
    x3 = 0.2*x2
    x4 = q_travel - (q_load_x - (x1 + x3))
    x5 = 2.0*x4
    x6 = 0.2*x0
    x7 = 1.5*x2
    x8 = -0.25 - (q_load_y + (x6 - x7))
    x9 = x4*x4 + x8*x8
    x10 = 1e+300*b_1 + (x9 - c0)
    x11 = sqrt((c0 if x10 < 0.0 else x9))
    x12 = 0.5/x11
    x13 = p_k*(x11 - p_l)
    x14 = -x13
    x15 = v_load_y*x2 + v_load_x*x0 - 0.2*v_load_angle
    x16 = x0*x15
    x17 = v_load_y*x0 - v_load_x*x2
    x18 = 1.5*v_load_angle
    x19 = x17 - x18
    x20 = x2*x15
    x21 = 2.0*x8
    x22 = (0.0 if x10 < 0.0 else (v_travel - (x16 - x2*x19))*x5 - (x20 + x0*x19)*x21)
    x23 = x22*x12
    x24 = p_c*x23
    x25 = x24 - x13
    x26 = x25*x25
    x27 = (1.0 if -1.0 < x26 else 0.0)
    x28 = x13 - x13*(0.0 if x14 < x24 else x27) + p_c*(x23*(x27 if x14 < x24 else 0.0))
    x29 = (0.0 if x10 < 0.0 else x12*(x28 + x25*(0.0 if -1.0 < x26 else 1.0)*c1))
    x30 = x5*x29
    x31 = q_travel - (q_load_x + (x1 - x3))
    x32 = 2.0*x31
    x33 = -0.25 - (q_load_y + (x7 + x6))
    x34 = x31*x31 + x33*x33
    x35 = 1e+300*b_2 + (x34 - c0)
    x36 = sqrt((c0 if x35 < 0.0 else x34))
    x37 = 0.5/x36
    x38 = p_k*(x36 - p_l)
    x39 = -x38
    x40 = x18 + x17
    x41 = 2.0*x33
    x42 = (0.0 if x35 < 0.0 else (v_travel - (x16 - x2*x40))*x32 - (x20 + x0*x40)*x41)
    x43 = x42*x37
    x44 = p_c*x43
    x45 = x44 - x38
    x46 = x45*x45
    x47 = (1.0 if -1.0 < x46 else 0.0)
    x48 = x38 - x38*(0.0 if x39 < x44 else x47) + p_c*(x43*(x47 if x39 < x44 else 0.0))
    x49 = (0.0 if x35 < 0.0 else x37*(x48 + x45*(0.0 if -1.0 < x46 else 1.0)*c1))
    x50 = x32*x49
    x51 = 1.0 + q_travel + -3.1
    x52 = 2.0*x51
    x53 = x51*x51
    x54 = 1e+300*b_0 + (-0.25 + x53)
    x55 = sqrt((x53 if x54 < 0.0 else 0.25))
    x56 = 0.5/x55
    x57 = 200000.0*(x55 + -0.5)
    x58 = (v_travel*x52 if x54 < 0.0 else 0.0)*x56
    x59 = 5000.0*x58
    x60 = -x57
    x61 = x59 - x57
    x62 = x61*x61
    x63 = (1.0 if -1.0 < x62 else 0.0)
    x64 = x57 - x57*(0.0 if x59 < x60 else x63) + 5000.0*(x58*(x63 if x59 < x60 else 0.0))
    x65 = (x56*(x64 + 10000.0*(x61*(0.0 if -1.0 < x62 else 1.0))) if x54 < 0.0 else 0.0)
    x66 = x30 + (x50 + (x52*x65 + (300.0*v_travel + 1000.0*a_travel))) - u_drive
    x67 = x41*x49
    x68 = x21*x29
    x69 = x2*(x67 + x68) + x0*(x50 + x30)
    x70 = x2*x50 - x0*x67
    x71 = x2*x30 - x0*x68
    x72 = x70 + x71
    out[0] = x66
    out[1] = 2304.0*a_load_x - x0*x69 - x2*x72
    out[2] = x0*x72 + 2304.0*(a_load_y + p_g) - x2*x69
    out[3] = 0.2*x69 + (1.5*(x70 - x71) + 1758.72*a_load_angle)


@njit(error_model="numpy")
def residual_jacobian(t, y, p, out):
    """Residual derivatives by q, v, a, lambda. 695 operations."""
    p_k = p[0]
    p_c = p[1]
    p_l = p[2]
    c0 = p_l*p_l
    c1 = 2.0*p_c
    c2 = 0.5*p_c
    c3 = p_c*c1
    q_travel = y[0]
    q_load_x = y[1]
    q_load_y = y[2]
    q_load_angle = y[3]
    v_travel = y[4]
    v_load_x = y[5]
    v_load_y = y[6]
    v_load_angle = y[7]
    b_0 = p[5]
    b_1 = p[6]
    b_2 = p[7]
    x0 = 1.0 + q_travel + -3.1
    x1 = x0*x0
    x2 = 1e+300*b_0 + (-0.25 + x1)
    x3 = sqrt((x1 if x2 < 0.0 else 0.25))
    x4 = 0.5/x3
    x5 = 2.0*x0
    x6 = (v_travel*x5 if x2 < 0.0 else 0.0)
    x7 = x6*x4
    x8 = 5000.0*x7
    x9 = 200000.0*(x3 + -0.5)
    x10 = x8 - x9
    x11 = x10*x10
    x12 = (0.0 if -1.0 < x11 else 1.0)
    x13 = -x9
    x14 = (1.0 if -1.0 < x11 else 0.0)
    x15 = (0.0 if x8 < x13 else x14)
    x16 = 2500.0*(x14 if x8 < x13 else 0.0)
    x17 = 10000.0*(x10*x12) + (x9 - x9*x15 + 2.0*(x7*x16))
    x18 = (1.0 if x2 < 0.0 else 0.0)
    x19 = x4*(x5*x18)
    x20 = 200000.0*x19
    x21 = x19*(x4*(1.0/x3))
    x22 = 2.0*(x4*(v_travel*x18)) - x6*x21
    x23 = x20 - x15*x20 + 2.0*(x16*x22) + 10000.0*(x12*(5000.0*x22 - x20))
    x24 = 2.0*(x4*x17 if x2 < 0.0 else 0.0) + x5*(x4*x23 - x21*x17 if x2 < 0.0 else 0.0)
    x25 = cos(q_load_angle)
    x26 = 1.5*x25
    x27 = sin(q_load_angle)
    x28 = 0.2*x27
    x29 = x26 - x28
    x30 = q_travel - (q_load_x + x29)
    x31 = 1.5*x27
    x32 = 0.2*x25
    x33 = x31 + x32
    x34 = -0.25 - (q_load_y + x33)
    x35 = x30*x30 + x34*x34
    x36 = 1e+300*b_2 + (x35 - c0)
    x37 = sqrt((c0 if x36 < 0.0 else x35))
    x38 = 0.5/x37
    x39 = v_load_y*x27 + v_load_x*x25
    x40 = x39 - 0.2*v_load_angle
    x41 = x25*x40
    x42 = 1.5*v_load_angle
    x43 = v_load_y*x25 - v_load_x*x27
    x44 = x42 + x43
    x45 = x27*x44
    x46 = v_travel - (x41 - x45)
    x47 = 2.0*x30
    x48 = x27*x40
    x49 = x25*x44
    x50 = x48 + x49
    x51 = 2.0*x34
    x52 = (0.0 if x36 < 0.0 else x46*x47 - x50*x51)
    x53 = x52*x38
    x54 = p_c*x53
    x55 = p_k*(x37 - p_l)
    x56 = x54 - x55
    x57 = x56*x56
    x58 = (0.0 if -1.0 < x57 else 1.0)
    x59 = -x55
    x60 = (1.0 if -1.0 < x57 else 0.0)
    x61 = (0.0 if x59 < x54 else x60)
    x62 = c2*(x60 if x59 < x54 else 0.0)
    x63 = x56*x58*c1 + (x55 - x55*x61 + 2.0*(x53*x62))
    x64 = (0.0 if x36 < 0.0 else x38*x63)
    x65 = 2.0*x64
    x66 = (0.0 if x36 < 0.0 else 1.0)
    x67 = x38*(x47*x66)
    x68 = p_k*x67
    x69 = x38*(1.0/x37)
    x70 = x69*x67
    x71 = 2.0*(x38*(x46*x66)) - x52*x70
    x72 = x38*(x68 - x61*x68 + 2.0*(x62*x71) + c1*(x58*(p_c*x71 - x68)))
    x73 = x72 - x70*x63
    x74 = (0.0 if x36 < 0.0 else x73)
    x75 = x65 + x47*x74
    x76 = x26 + x28
    x77 = q_travel - (q_load_x - x76)
    x78 = x32 - x31
    x79 = -0.25 - (q_load_y + x78)
    x80 = x77*x77 + x79*x79
    x81 = 1e+300*b_1 + (x80 - c0)
    x82 = sqrt((c0 if x81 < 0.0 else x80))
    x83 = 0.5/x82
    x84 = x43 - x42
    x85 = x27*x84
    x86 = v_travel - (x41 - x85)
    x87 = 2.0*x77
    x88 = x25*x84
    x89 = x48 + x88
    x90 = 2.0*x79
    x91 = (0.0 if x81 < 0.0 else x86*x87 - x89*x90)
    x92 = x91*x83
    x93 = p_c*x92
    x94 = p_k*(x82 - p_l)
    x95 = x93 - x94
    x96 = x95*x95
    x97 = (0.0 if -1.0 < x96 else 1.0)
    x98 = -x94
    x99 = (1.0 if -1.0 < x96 else 0.0)
    x100 = (0.0 if x98 < x93 else x99)
    x101 = c2*(x99 if x98 < x93 else 0.0)
    x102 = x95*x97*c1 + (x94 - x94*x100 + 2.0*(x92*x101))
    x103 = (0.0 if x81 < 0.0 else x83*x102)
    x104 = 2.0*x103
    x105 = (0.0 if x81 < 0.0 else 1.0)
    x106 = x83*(x87*x105)
    x107 = p_k*x106
    x108 = x83*(1.0/x82)
    x109 = x108*x106
    x110 = 2.0*(x83*(x86*x105)) - x91*x109
    x111 = x107 - x100*x107 + 2.0*(x101*x110) + c1*(x97*(p_c*x110 - x107))
    x112 = x83*x111 - x109*x102
    x113 = (0.0 if x81 < 0.0 else x112)
    x114 = x104 + x87*x113
    x115 = (0.0 if x36 < 0.0 else -x73)
    x116 = x47*x115 - x65
    x117 = (0.0 if x81 < 0.0 else -x112)
    x118 = x87*x117 - x104
    x119 = x116 + x118
    x120 = x38*(x51*x66)
    x121 = x69*x120
    x122 = p_k*x120
    x123 = x52*x121 + 2.0*(x38*(x50*x66))
    x124 = x61*x122 - x122 + 2.0*(x62*x123) + c1*(x58*(x122 + p_c*x123))
    x125 = (0.0 if x36 < 0.0 else x121*x63 + x38*x124)
    x126 = x47*x125
    x127 = x83*(x90*x105)
    x128 = x108*x127
    x129 = p_k*x127
    x130 = x91*x128 + 2.0*(x83*(x89*x105))
    x131 = x100*x129 - x129 + 2.0*(x101*x130) + c1*(x97*(x129 + p_c*x130))
    x132 = (0.0 if x81 < 0.0 else x128*x102 + x83*x131)
    x133 = x87*x132
    x134 = x126 + x133
    x135 = 2.0*x33
    x136 = x38*(x66*(x33*x47 - x29*x51))
    x137 = p_k*x136
    x138 = x25*x43 - x48
    x139 = x27*x39
    x140 = x41 + x27*x43
    x141 = x25*x39
    x142 = 2.0*x29
    x143 = x46*x135 - x47*(x138 - (x49 - x139)) - (x51*(x140 - (x45 + x141)) - x50*x142)
    x144 = x69*x136
    x145 = x38*(x66*x143) - x52*x144
    x146 = x137 - x61*x137 + 2.0*(x62*x145) + c1*(x58*(p_c*x145 - x137))
    x147 = (0.0 if x36 < 0.0 else x38*x146 - x144*x63)
    x148 = x135*x64 + x47*x147
    x149 = 2.0*x78
    x150 = x83*(x105*(x78*x87 + x76*x90))
    x151 = p_k*x150
    x152 = 2.0*x76
    x153 = x86*x149 - x87*(x138 - (x88 - x139)) - (x90*(x140 - (x85 + x141)) + x89*x152)
    x154 = x108*x150
    x155 = x83*(x105*x153) - x91*x154
    x156 = x151 - x100*x151 + 2.0*(x101*x155) + c1*(x97*(p_c*x155 - x151))
    x157 = (0.0 if x81 < 0.0 else x83*x156 - x154*x102)
    x158 = x149*x103 + x87*x157
    x159 = x148 + x158
    x160 = (x4*(2.0*(x16*x19) + 50000000.0*(x12*x19)) if x2 < 0.0 else 0.0)
    x161 = x38*(x62*(2.0*x67) + x58*x67*c3)
    x162 = (0.0 if x36 < 0.0 else x161)
    x163 = x47*x162
    x164 = x83*(x101*(2.0*x106) + x97*x106*c3)
    x165 = (0.0 if x81 < 0.0 else x164)
    x166 = x87*x165
    x167 = (0.0 if x36 < 0.0 else -x161)
    x168 = x47*x167
    x169 = (0.0 if x81 < 0.0 else -x164)
    x170 = x87*x169
    x171 = x168 + x170
    x172 = (0.0 if x36 < 0.0 else -(x38*(x62*(2.0*x120) + x58*x120*c3)))
    x173 = x47*x172
    x174 = (0.0 if x81 < 0.0 else -(x83*(x101*(2.0*x127) + x97*x127*c3)))
    x175 = x87*x174
    x176 = x173 + x175
    x177 = (0.0 if x36 < 0.0 else x38*(x62*(2.0*x136) + x58*x136*c3))
    x178 = x47*x177
    x179 = (0.0 if x81 < 0.0 else x83*(x101*(2.0*x150) + x97*x150*c3))
    x180 = x87*x179
    x181 = x178 + x180
    x182 = x51*x74
    x183 = x90*x113
    x184 = x27*(x182 + x183) + x25*(x75 + x114)
    x185 = x27*x75 - x25*x182
    x186 = x27*x114 - x25*x183
    x187 = x185 + x186
    x188 = x51*x115
    x189 = x90*x117
    x190 = x27*(x188 + x189) + x25*x119
    x191 = x27*x116 - x25*x188
    x192 = x27*x118 - x25*x189
    x193 = x191 + x192
    x194 = x51*x125 - x65
    x195 = x90*x132 - x104
    x196 = x27*(x194 + x195) + x25*x134
    x197 = x27*x126 - x25*x194
    x198 = x27*x133 - x25*x195
    x199 = x197 + x198
    x200 = x51*x64
    x201 = x90*x103
    x202 = x200 + x201
    x203 = x51*x147 - x142*x64
    x204 = x152*x103 + x90*x157
    x205 = x47*x64
    x206 = x87*x103
    x207 = x205 + x206
    x208 = x25*x202 + x27*(x203 + x204) + (x25*x159 - x27*x207)
    x209 = x27*x202 + x25*x207
    x210 = x27*x205 - x25*x200 + (x27*x206 - x25*x201)
    x211 = x25*x205 + x27*x148 - (x25*x203 - x27*x200)
    x212 = x25*x206 + x27*x158 - (x25*x204 - x27*x201)
    x213 = x211 + x212
    x214 = x51*x162
    x215 = x90*x165
    x216 = x27*(x214 + x215) + x25*(x163 + x166)
    x217 = x27*x163 - x25*x214
    x218 = x27*x166 - x25*x215
    x219 = x217 + x218
    x220 = x51*x167
    x221 = x90*x169
    x222 = x27*(x220 + x221) + x25*x171
    x223 = x27*x168 - x25*x220
    x224 = x27*x170 - x25*x221
    x225 = x223 + x224
    x226 = x51*x172
    x227 = x90*x174
    x228 = x27*(x226 + x227) + x25*x176
    x229 = x27*x173 - x25*x226
    x230 = x27*x175 - x25*x227
    x231 = x229 + x230
    x232 = x51*x177
    x233 = x90*x179
    x234 = x27*(x232 + x233) + x25*x181
    x235 = x27*x178 - x25*x232
    x236 = x27*x180 - x25*x233
    x237 = x235 + x236
    out[0] = x24 + x75 + x114
    out[1] = x119
    out[2] = x134
    out[3] = x159
    out[4] = 300.0 + x5*x160 + x163 + x166
    out[5] = x171
    out[6] = x176
    out[7] = x181
    out[8] = 1000.0
    out[12] = -(x25*x184 + x27*x187)
    out[13] = -(x25*x190 + x27*x193)
    out[14] = -(x25*x196 + x27*x199)
    out[15] = -(x25*x208 - x27*x209 + (x25*x210 + x27*x213))
    out[16] = -(x25*x216 + x27*x219)
    out[17] = -(x25*x222 + x27*x225)
    out[18] = -(x25*x228 + x27*x231)
    out[19] = -(x25*x234 + x27*x237)
    out[21] = 2304.0
    out[24] = x25*x187 - x27*x184
    out[25] = x25*x193 - x27*x190
    out[26] = x25*x199 - x27*x196
    out[27] = x25*x213 - x27*x210 - (x25*x209 + x27*x208)
    out[28] = x25*x219 - x27*x216
    out[29] = x25*x225 - x27*x222
    out[30] = x25*x231 - x27*x228
    out[31] = x25*x237 - x27*x234
    out[34] = 2304.0
    out[36] = 1.5*(x185 - x186) + 0.2*x184
    out[37] = 1.5*(x191 - x192) + 0.2*x190
    out[38] = 1.5*(x197 - x198) + 0.2*x196
    out[39] = 1.5*(x211 - x212) + 0.2*x208
    out[40] = 1.5*(x217 - x218) + 0.2*x216
    out[41] = 1.5*(x223 - x224) + 0.2*x222
    out[42] = 1.5*(x229 - x230) + 0.2*x228
    out[43] = 1.5*(x235 - x236) + 0.2*x234
    out[47] = 1758.72


@njit(error_model="numpy")
def poses(t, y, p, out):
    """Per body: position, rotation matrix (body to world). 3 operations."""
    q_travel = y[0]
    q_load_x = y[1]
    q_load_y = y[2]
    q_load_angle = y[3]
    x0 = cos(q_load_angle)
    x1 = sin(q_load_angle)
    out[0] = q_travel
    out[1] = 0.0
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
    out[12] = q_load_x
    out[13] = q_load_y
    out[14] = 0.0
    out[15] = x0
    out[16] = -x1
    out[17] = 0.0
    out[18] = x1
    out[19] = x0
    out[20] = 0.0
    out[21] = 0.0
    out[22] = 0.0
    out[23] = 1.0


@njit(error_model="numpy")
def shapes(t, y, p, out):
    """Sizes of the bodies' shapes. 0 operations."""
    out[0] = 2.0
    out[1] = 0.5
    out[2] = 1.0
    out[3] = 3.0
    out[4] = 0.4
    out[5] = 0.8


@njit(error_model="numpy")
def outputs(t, y, p, out):
    """Outputs. 88 operations."""
    p_k = p[0]
    p_c = p[1]
    p_l = p[2]
    c0 = p_l*p_l
    q_travel = y[0]
    q_load_x = y[1]
    q_load_y = y[2]
    q_load_angle = y[3]
    v_travel = y[4]
    v_load_x = y[5]
    v_load_y = y[6]
    v_load_angle = y[7]
    b_1 = p[6]
    b_2 = p[7]
    x0 = cos(q_load_angle)
    x1 = 1.5*x0
    x2 = sin(q_load_angle)
    x3 = 0.2*x2
    x4 = q_travel - (q_load_x - (x1 + x3))
    x5 = 0.2*x0
    x6 = 1.5*x2
    x7 = -0.25 - (q_load_y + (x5 - x6))
    x8 = x4*x4 + x7*x7
    x9 = 1e+300*b_1 + (x8 - c0)
    x10 = sqrt((c0 if x9 < 0.0 else x8))
    x11 = v_load_y*x2 + v_load_x*x0 - 0.2*v_load_angle
    x12 = x0*x11
    x13 = v_load_y*x0 - v_load_x*x2
    x14 = 1.5*v_load_angle
    x15 = x13 - x14
    x16 = x2*x11
    x17 = 2.0*(x4*(v_travel - (x12 - x2*x15))) - 2.0*((x16 + x0*x15)*x7)
    x18 = p_k*(x10 - p_l) + p_c*(0.5/x10*(0.0 if x9 < 0.0 else x17))
    x19 = x18*x18
    x20 = q_travel - (q_load_x + (x1 - x3))
    x21 = -0.25 - (q_load_y + (x6 + x5))
    x22 = x20*x20 + x21*x21
    x23 = 1e+300*b_2 + (x22 - c0)
    x24 = sqrt((c0 if x23 < 0.0 else x22))
    x25 = x14 + x13
    x26 = 2.0*(x20*(v_travel - (x12 - x2*x25))) - 2.0*((x16 + x0*x25)*x21)
    x27 = p_k*(x24 - p_l) + p_c*(0.5/x24*(0.0 if x23 < 0.0 else x26))
    x28 = x27*x27
    out[0] = ((0.0 if x18 < 0.0 else x18) if -1.0 < x19 else x19)
    out[1] = ((0.0 if x27 < 0.0 else x27) if -1.0 < x28 else x28)


@njit(error_model="numpy")
def events(t, y, p, out):
    """Event functions. 99 operations."""
    p_k = p[0]
    p_c = p[1]
    p_l = p[2]
    c0 = p_l*p_l
    q_travel = y[0]
    q_load_x = y[1]
    q_load_y = y[2]
    q_load_angle = y[3]
    v_travel = y[4]
    v_load_x = y[5]
    v_load_y = y[6]
    v_load_angle = y[7]
    b_0 = p[5]
    b_1 = p[6]
    b_2 = p[7]
    x0 = 1.0 + q_travel + -3.1
    x1 = x0*x0
    x2 = -0.25 + x1
    x3 = cos(q_load_angle)
    x4 = 1.5*x3
    x5 = sin(q_load_angle)
    x6 = 0.2*x5
    x7 = q_travel - (q_load_x - (x4 + x6))
    x8 = 0.2*x3
    x9 = 1.5*x5
    x10 = -0.25 - (q_load_y + (x8 - x9))
    x11 = x7*x7 + x10*x10
    x12 = x11 - c0
    x13 = q_travel - (q_load_x + (x4 - x6))
    x14 = -0.25 - (q_load_y + (x9 + x8))
    x15 = x13*x13 + x14*x14
    x16 = x15 - c0
    x17 = 1e+300*b_0 + x2
    x18 = sqrt((x1 if x17 < 0.0 else 0.25))
    x19 = 200000.0*(x18 + -0.5) + 5000.0*(0.5/x18*(2.0*(v_travel*x0) if x17 < 0.0 else 0.0))
    x20 = 1e+300*b_1 + x12
    x21 = sqrt((c0 if x20 < 0.0 else x11))
    x22 = v_load_y*x5 + v_load_x*x3 - 0.2*v_load_angle
    x23 = x3*x22
    x24 = v_load_y*x3 - v_load_x*x5
    x25 = 1.5*v_load_angle
    x26 = x24 - x25
    x27 = x5*x22
    x28 = 2.0*(x7*(v_travel - (x23 - x5*x26))) - 2.0*((x27 + x3*x26)*x10)
    x29 = 1e+300*b_2 + x16
    x30 = sqrt((c0 if x29 < 0.0 else x15))
    x31 = x25 + x24
    x32 = 2.0*(x13*(v_travel - (x23 - x5*x31))) - 2.0*((x27 + x3*x31)*x14)
    out[0] = x2
    out[1] = x12
    out[2] = x16
    out[3] = x19
    out[4] = p_k*(x21 - p_l) + p_c*(0.5/x21*(0.0 if x20 < 0.0 else x28))
    out[5] = p_k*(x30 - p_l) + p_c*(0.5/x30*(0.0 if x29 < 0.0 else x32))


@njit(error_model="numpy")
def marks(t, y, p, out):
    """What a picture shows besides bodies, as `marks` lists it. 26 operations."""
    q_travel = y[0]
    q_load_x = y[1]
    q_load_y = y[2]
    q_load_angle = y[3]
    b_0 = p[5]
    x0 = cos(q_load_angle)
    x1 = 1.5*x0
    x2 = sin(q_load_angle)
    x3 = 0.2*x2
    x4 = 0.2*x0
    x5 = 1.5*x2
    x6 = 1.0 + q_travel + -3.1
    x7 = x6*x6
    x8 = x6*sqrt((x7 if 1e+300*b_0 + (-0.25 + x7) < 0.0 else 0.25))/sqrt(x7)
    out[6] = 1.0
    out[9] = -1.5
    out[10] = 0.2
    out[12] = 1.5
    out[13] = 0.2
    out[16] = -0.25
    out[18] = 1.0
    out[21] = -3.0
    out[22] = -0.25
    out[24] = 3.1
    out[25] = -0.25
    out[27] = q_travel
    out[28] = -0.25
    out[30] = q_load_x - (x1 + x3)
    out[31] = q_load_y + (x4 - x5)
    out[33] = q_travel
    out[34] = -0.25
    out[36] = q_load_x + (x1 - x3)
    out[37] = q_load_y + (x5 + x4)
    out[39] = 3.1 + x8
    out[42] = 3.1


@njit(error_model="numpy")
def limits(t, y, p, out):
    """Numbers of parameters that have a bound. 0 operations."""
    p_k = p[0]
    p_c = p[1]
    p_l = p[2]
    out[0] = p_l
    out[1] = p_k
    out[2] = p_c
