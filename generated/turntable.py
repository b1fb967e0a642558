"""turntable: equations of motion, written by symgen 0.1.0. Do not edit.

Ball that rolls on a turntable: it runs in circles at 2/7 of the table's rate, and does not fly off
"""

from math import cos, sin, sqrt

from numba import njit

MODEL = {
    "abi": 1,
    "generator": "symgen 0.1.0",
    "source": "sha256:cb9a365e486ac83b7db989ffc73bf8139fb7402946cffcf04db60a1a099c0f24",
    "name": "turntable",
    "description": "Ball that rolls on a turntable: it runs in circles at 2/7 of the table's rate, and does not fly off",
    "nq": 8,
    "nv": 7,
    "nh": 2,
    "nn": 2,
    "nw": 1,
    "coordinates": [
        {"name": "pivot", "unit": "rad", "value": 0.0, "enforced": False},
        {"name": "float_x", "unit": "m", "value": 0.3, "enforced": True},
        {"name": "float_y", "unit": "m", "value": 0.0, "enforced": True},
        {"name": "float_z", "unit": "m", "value": 0.05, "enforced": True},
        {"name": "float_qw", "unit": "", "value": 1.0, "enforced": True},
        {"name": "float_qx", "unit": "", "value": 0.0, "enforced": True},
        {"name": "float_qy", "unit": "", "value": 0.0, "enforced": True},
        {"name": "float_qz", "unit": "", "value": 0.0, "enforced": True},
    ],
    "quaternions": [
        4,
    ],
    "rates": [
        {"name": "pivot", "unit": "rad/s", "value": 2.0943951023931953, "enforced": True},
        {"name": "float_vx", "unit": "m/s", "value": 0.0, "enforced": False},
        {"name": "float_vy", "unit": "m/s", "value": 0.0, "enforced": False},
        {"name": "float_vz", "unit": "m/s", "value": 0.0, "enforced": False},
        {"name": "float_wx", "unit": "rad/s", "value": 0.0, "enforced": False},
        {"name": "float_wy", "unit": "rad/s", "value": 0.0, "enforced": False},
        {"name": "float_wz", "unit": "rad/s", "value": 0.0, "enforced": False},
    ],
    "parameters": [
        {"name": "radius", "unit": "m", "value": 0.05, "doc": ""},
        {"name": "turning", "unit": "rad/s", "value": 2.0943951023931953, "doc": "of the table"},
    ],
    "inputs": [],
    "constants": [],
    "constraints": [
        {"name": "ball_gap", "kind": "holonomic", "multiplier": "N"},
        {"name": "drive", "kind": "holonomic", "multiplier": "N*m"},
        {"name": "ball_along", "kind": "velocity"},
        {"name": "ball_across", "kind": "velocity"},
    ],
    "outputs": [],
    "events": [],
    "bodies": [
        {"name": "table", "planar": False, "shape": "solids", "sizes": 11, "mesh": "", "parts": ["cylinder"]},
        {"name": "ball", "planar": False, "shape": "sphere", "sizes": 1, "mesh": ""},
    ],
    "structure": {
        "conservative": False,
        "time_dependent": True,
        "constant_mass": True,
        "diagonal_mass": True,
        "velocity_dependent": False,
        "separable": False,
    },
    "operations": {
        "rhs": 346,
        "mass_matrix": 6,
        "forces": 4,
        "energy": 30,
        "residual": 271,
        "residual_jacobian": 1053,
        "constraint_residual": 85,
        "constraint_jacobian": 88,
        "gamma": 196,
        "project": 311,
        "kinematics": 13,
        "poses": 27,
        "shapes": 0,
        "marks": 0,
        "starts": 0,
        "limits": 6,
    },
    "hoisted": {
        "rhs": 5,
        "mass_matrix": 3,
        "forces": 1,
        "energy": 3,
        "residual": 3,
        "residual_jacobian": 5,
        "project": 3,
    },
    "run": {
        "t_end": 12.0,
        "fps": 60.0,
    },
    "starts": True,
    "limits": [
        {"name": "bodies.ball.shape.sphere[0]", "bound": "positive"},
        {"name": "bodies.ball.mass", "bound": "zero or more"},
        {"name": "bodies.ball.inertia[0]", "bound": "zero or more"},
        {"name": "bodies.ball.inertia", "bound": "a tensor without negative moments", "numbers": 3},
    ],
    "subsystems": [],
    "marks": [
        {"kind": "ground", "name": "pivot", "body": "", "numbers": 3},
        {"kind": "pin", "name": "pivot", "body": "", "numbers": 6},
        {"kind": "point", "name": "table_point1", "body": "table", "numbers": 3},
        {"kind": "point", "name": "ball_point2", "body": "ball", "numbers": 3},
    ],
}

@njit(error_model="numpy")
def rhs(t, y, p, out):
    """State derivative: rates, accelerations, power, multipliers, pivot ratio. 346 operations."""
    p_radius = p[0]
    p_turning = p[1]
    c0 = p_radius*p_radius
    c1 = p_radius*c0
    c2 = 1.0/(5026.548245743669*c1)
    c3 = 1.0/(2010.6192982974676*(p_radius*(c0*c0)))
    c4 = 49310.4382907454*c1
    q_pivot = y[0]
    q_float_x = y[1]
    q_float_y = y[2]
    q_float_qw = y[4]
    q_float_qx = y[5]
    q_float_qy = y[6]
    q_float_qz = y[7]
    v_pivot = y[8]
    v_float_vx = y[9]
    v_float_vy = y[10]
    v_float_vz = y[11]
    v_float_wx = y[12]
    v_float_wy = y[13]
    v_float_wz = y[14]
    x0 = 0.5*v_float_wx
    x1 = 0.5*v_float_wy
    x2 = 0.5*v_float_wz
    x3 = sin(q_pivot)
    x4 = x3*c2
    x5 = cos(q_pivot)
    x6 = x5*c2
    x7 = q_float_qy + q_float_qy
    x8 = q_float_qz*x7
    x9 = q_float_qx + q_float_qx
    x10 = q_float_qw*x9
    x11 = x8 - x10
    x12 = x8 + x10
    x13 = p_radius*x12
    x14 = q_float_qx*x9
    x15 = q_float_qz + q_float_qz
    x16 = q_float_qz*x15
    x17 = 1.0 - (x14 + x16)
    x18 = q_float_qy*x7
    x19 = 1.0 - (x14 + x18)
    x20 = p_radius*x19
    x21 = x11*x13 - x17*x20
    x22 = q_float_qy*x9
    x23 = q_float_qw*x15
    x24 = x22 - x23
    x25 = q_float_qz*x9
    x26 = q_float_qw*x7
    x27 = x25 + x26
    x28 = x24*x20 - x27*x13
    x29 = x5*x21 + x3*x28
    x30 = x5*x28 - x3*x21
    x31 = x30*c3
    x32 = x22 + x23
    x33 = x25 - x26
    x34 = p_radius*x33
    x35 = x32*x20 - x11*x34
    x36 = 1.0 - (x18 + x16)
    x37 = x27*x34 - x36*x20
    x38 = x5*x35 + x3*x37
    x39 = x5*x37 - x3*x35
    x40 = x39*c3
    x41 = x17*x34 - x32*x13
    x42 = x36*x13 - x24*x34
    x43 = x5*x41 + x3*x42
    x44 = x5*x42 - x3*x41
    x45 = x44*c3
    x46 = x3*x6 - x5*x4 + x29*x31 + x38*x40 + x43*x45
    x47 = x5*x6 + x3*x4
    x48 = 1.0/(x47 + x30*x31 + x39*x40 + x44*x45)
    x49 = x46*x48
    x50 = x29*c3
    x51 = x38*c3
    x52 = x43*c3
    x53 = x47 + x29*x50 + x38*x51 + x43*x52
    x54 = x46*x49 - x53
    x55 = v_pivot*x3
    x56 = v_float_wy*x32 - v_float_wx*x17
    x57 = v_float_wx*x11 - v_float_wz*x32
    x58 = v_pivot*x5
    x59 = q_float_x*x5 + q_float_y*x3
    x60 = q_float_y*x5 - q_float_x*x3
    x61 = v_float_wz*x17 - v_float_wy*x11
    x62 = v_float_vy - (x56*x20 + (x57*x13 + (x58*x59 - x55*x60 + x61*x34)))
    x63 = v_float_wx*v_float_wz
    x64 = v_float_wy*v_float_wz
    x65 = v_float_wx*v_float_wx
    x66 = v_float_wy*v_float_wy
    x67 = x65 + x66
    x68 = p_radius*(v_float_wy*x33 - v_float_wx*x12)
    x69 = v_float_wx*v_float_wy
    x70 = v_float_wz*v_float_wz
    x71 = x65 + x70
    x72 = p_radius*(v_float_wx*x19 - v_float_wz*x33)
    x73 = v_float_vx*x5 - q_float_x*x55 + (v_float_vy*x3 + q_float_y*x58)
    x74 = x3*(v_pivot*v_pivot)
    x75 = v_pivot*x58
    x76 = v_float_vy*x5 - q_float_y*x55 - (v_float_vx*x3 + q_float_x*x58)
    x77 = x66 + x70
    x78 = p_radius*(v_float_wz*x12 - v_float_wy*x19)
    x79 = x58*x73 - x74*x59 - (x60*x75 + x55*x76) + ((x17*x69 - x32*x77 + x11*x63)*x34 + x61*x78)
    x80 = (x32*x63 + x17*x64 - x11*x67)*x20 + x56*x68 + ((x32*x69 - x17*x71 + x11*x64)*x13 + x57*x72 + x79)
    x81 = v_float_wz*x24 - v_float_wy*x27
    x82 = v_float_wx*x27 - v_float_wz*x36
    x83 = v_float_wy*x36 - v_float_wx*x24
    x84 = v_float_vx + (x55*x59 + x58*x60 - x81*x34 - x82*x13 - x83*x20)
    x85 = x59*x75 + x55*x73 + (x58*x76 - x74*x60) - ((x24*x69 - x36*x77 + x27*x63)*x34 + x81*x78)
    x86 = x85 - ((x36*x69 - x24*x71 + x27*x64)*x13 + x82*x72) - ((x36*x63 + x24*x64 - x27*x67)*x20 + x83*x68)
    x87 = x5*x86 - x55*x84 + (x58*x62 - x3*x80)
    x88 = 1.0/x54*(x55*x62 + x5*x80 + (x58*x84 + x3*x86) - x87*x49)
    x89 = x87*x48 + x49*x88
    x90 = x5*x59 - x3*x60
    x91 = x3*x59 + x5*x60
    x92 = (x5*x90 + x3*x91)*x88 - (x5*x91 - x3*x90)*x89
    x93 = -(x54/x53)
    out[0] = v_pivot
    out[1] = v_float_vx
    out[2] = v_float_vy
    out[3] = v_float_vz
    out[4] = -(q_float_qx*x0 + q_float_qy*x1 + q_float_qz*x2)
    out[5] = q_float_qw*x0 - q_float_qz*x1 + q_float_qy*x2
    out[6] = q_float_qz*x0 + q_float_qw*x1 - q_float_qx*x2
    out[7] = q_float_qx*x1 - q_float_qy*x0 + q_float_qw*x2
    out[8] = 0.0
    out[9] = x4*x88 - x6*x89
    out[10] = -(x4*x89 + x6*x88)
    out[11] = 0.0
    out[12] = x50*x88 - x31*x89
    out[13] = x51*x88 - x40*x89
    out[14] = x52*x88 - x45*x89
    out[15] = -(p_turning*x92)
    out[16] = c4
    out[17] = -x92
    out[18] = -x89
    out[19] = -x88
    out[20] = (x93 if x93 < 1.0 else 1.0)


@njit(error_model="numpy")
def mass_matrix(t, y, p, out):
    """Mass matrix M, row by row. 6 operations."""
    p_radius = p[0]
    c0 = p_radius*p_radius
    c1 = 5026.548245743669*(p_radius*c0)
    c2 = 2010.6192982974676*(p_radius*(c0*c0))
    out[0] = 13.511361684558983
    out[8] = c1
    out[16] = c1
    out[24] = c1
    out[32] = c2
    out[40] = c2
    out[48] = c2


@njit(error_model="numpy")
def forces(t, y, p, out):
    """Forces f of M a = f + G^T lambda. 4 operations."""
    p_radius = p[0]
    c0 = -(49310.4382907454*(p_radius*(p_radius*p_radius)))
    out[0] = 0.0
    out[1] = 0.0
    out[2] = 0.0
    out[3] = c0
    out[4] = 0.0
    out[5] = 0.0
    out[6] = 0.0


@njit(error_model="numpy")
def energy(t, y, p, out):
    """Kinetic and potential energy. 30 operations."""
    p_radius = p[0]
    c0 = p_radius*p_radius
    c1 = 5026.548245743669*(p_radius*c0)
    c2 = 2010.6192982974676*(p_radius*(c0*c0))
    q_float_z = y[3]
    v_pivot = y[8]
    v_float_vx = y[9]
    v_float_vy = y[10]
    v_float_vz = y[11]
    v_float_wx = y[12]
    v_float_wy = y[13]
    v_float_wz = y[14]
    x0 = c1*(v_float_vx*v_float_vx) + c1*(v_float_vy*v_float_vy) + c1*(v_float_vz*v_float_vz)
    x1 = c2*(v_float_wx*v_float_wx) + c2*(v_float_wy*v_float_wy) + c2*(v_float_wz*v_float_wz)
    out[0] = 0.5*(13.511361684558983*(v_pivot*v_pivot) + x0 + x1)
    out[1] = 9.81*(-0.6333450789637023 + q_float_z*c1)


@njit(error_model="numpy")
def residual(t, y, p, out):
    """M a - f - G^T lambda, then G a - gamma. 271 operations."""
    p_radius = p[0]
    c0 = p_radius*p_radius
    c1 = 5026.548245743669*(p_radius*c0)
    c2 = 2010.6192982974676*(p_radius*(c0*c0))
    q_pivot = y[0]
    q_float_x = y[1]
    q_float_y = y[2]
    q_float_qw = y[4]
    q_float_qx = y[5]
    q_float_qy = y[6]
    q_float_qz = y[7]
    v_pivot = y[8]
    v_float_vx = y[9]
    v_float_vy = y[10]
    v_float_wx = y[12]
    v_float_wy = y[13]
    v_float_wz = y[14]
    a_pivot = y[15]
    a_float_vx = y[16]
    a_float_vy = y[17]
    a_float_vz = y[18]
    a_float_wx = y[19]
    a_float_wy = y[20]
    a_float_wz = y[21]
    lam_ball_gap = y[22]
    lam_drive = y[23]
    lam_ball_along = y[24]
    lam_ball_across = y[25]
    x0 = cos(q_pivot)
    x1 = sin(q_pivot)
    x2 = q_float_y*x0 - q_float_x*x1
    x3 = lam_ball_along*x0 - lam_ball_across*x1
    x4 = q_float_x*x0 + q_float_y*x1
    x5 = lam_ball_across*x0 + lam_ball_along*x1
    x6 = 13.511361684558983*a_pivot - (lam_drive + x0*(x2*x3 - x4*x5) + x1*(x2*x5 + x4*x3))
    x7 = q_float_qx + q_float_qx
    x8 = q_float_qx*x7
    x9 = q_float_qz + q_float_qz
    x10 = q_float_qz*x9
    x11 = 1.0 - (x8 + x10)
    x12 = q_float_qy + q_float_qy
    x13 = q_float_qy*x12
    x14 = 1.0 - (x8 + x13)
    x15 = p_radius*x14
    x16 = x15*x5
    x17 = q_float_qy*x7
    x18 = q_float_qw*x9
    x19 = x17 - x18
    x20 = x15*x3
    x21 = q_float_qz*x12
    x22 = q_float_qw*x7
    x23 = x21 - x22
    x24 = x21 + x22
    x25 = p_radius*x24
    x26 = x25*x5
    x27 = q_float_qz*x7
    x28 = q_float_qw*x12
    x29 = x27 + x28
    x30 = x25*x3
    x31 = x27 - x28
    x32 = p_radius*x31
    x33 = x32*x5
    x34 = x17 + x18
    x35 = 1.0 - (x13 + x10)
    x36 = x32*x3
    x37 = v_pivot*x1
    x38 = v_pivot*x0
    x39 = v_float_vx*x0 - q_float_x*x37 + (v_float_vy*x1 + q_float_y*x38)
    x40 = v_pivot*x38 + a_pivot*x1
    x41 = v_float_vy*x0 - q_float_y*x37 - (v_float_vx*x1 + q_float_x*x38)
    x42 = a_pivot*x0 - x1*(v_pivot*v_pivot)
    x43 = v_float_wz*x19 - v_float_wy*x29
    x44 = p_radius*(v_float_wz*x24 - v_float_wy*x14)
    x45 = v_float_wx*v_float_wy
    x46 = a_float_wz + x45
    x47 = v_float_wy*v_float_wy
    x48 = v_float_wz*v_float_wz
    x49 = x47 + x48
    x50 = v_float_wx*v_float_wz
    x51 = x50 - a_float_wy
    x52 = x37*x39 + x4*x40 + (x38*x41 + x2*x42) - (x43*x44 + x32*(x19*x46 - x35*x49 + x29*x51))
    x53 = v_float_wx*x29 - v_float_wz*x35
    x54 = p_radius*(v_float_wx*x14 - v_float_wz*x31)
    x55 = x45 - a_float_wz
    x56 = v_float_wx*v_float_wx
    x57 = x56 + x48
    x58 = v_float_wy*v_float_wz
    x59 = a_float_wx + x58
    x60 = v_float_wy*x35 - v_float_wx*x19
    x61 = p_radius*(v_float_wy*x31 - v_float_wx*x24)
    x62 = a_float_wy + x50
    x63 = x58 - a_float_wx
    x64 = x56 + x47
    x65 = x52 - (x53*x54 + x25*(x35*x55 - x19*x57 + x29*x59)) - (x60*x61 + x15*(x35*x62 + x19*x63 - x29*x64))
    x66 = a_float_vx + x65
    x67 = v_float_vx + (x37*x4 + x38*x2 - x43*x32 - x53*x25 - x60*x15)
    x68 = v_float_wy*x34 - v_float_wx*x11
    x69 = v_float_wx*x23 - v_float_wz*x34
    x70 = v_float_wz*x11 - v_float_wy*x23
    x71 = v_float_vy - (x68*x15 + (x69*x25 + (x38*x4 - x37*x2 + x70*x32)))
    x72 = x38*x39 + x4*x42 - (x37*x41 + x2*x40) + (x70*x44 + x32*(x11*x46 - x34*x49 + x23*x51))
    x73 = x68*x61 + x15*(x34*x62 + x11*x63 - x23*x64) + (x69*x54 + x25*(x34*x55 - x11*x57 + x23*x59) + x72)
    x74 = a_float_vy - x73
    out[0] = x6
    out[1] = a_float_vx*c1 - x3
    out[2] = a_float_vy*c1 - x5
    out[3] = c1*(a_float_vz + 9.81) - lam_ball_gap
    out[4] = a_float_wx*c2 - (x11*x16 + x19*x20 - x23*x26 - x29*x30)
    out[5] = a_float_wy*c2 - (x23*x33 - (x34*x16 + x35*x20) + x29*x36)
    out[6] = a_float_wz*c2 - (x34*x26 + x35*x30 - x11*x33 - x19*x36)
    out[7] = a_float_vz
    out[8] = a_pivot
    out[9] = x0*x66 - x37*x67 + (x38*x71 + x1*x74)
    out[10] = x0*x74 - x37*x71 - (x38*x67 + x1*x66)


@njit(error_model="numpy")
def residual_jacobian(t, y, p, out):
    """Residual derivatives by q, v, a, lambda. 1053 operations."""
    p_radius = p[0]
    c0 = p_radius*p_radius
    c1 = 5026.548245743669*(p_radius*c0)
    c2 = p_radius*(c0*c0)
    c3 = 2010.6192982974676*c2
    c4 = c3 + (c3 + c3) - 4021.238596594935*c2
    q_pivot = y[0]
    q_float_x = y[1]
    q_float_y = y[2]
    q_float_qw = y[4]
    q_float_qx = y[5]
    q_float_qy = y[6]
    q_float_qz = y[7]
    v_pivot = y[8]
    v_float_vx = y[9]
    v_float_vy = y[10]
    v_float_wx = y[12]
    v_float_wy = y[13]
    v_float_wz = y[14]
    a_pivot = y[15]
    a_float_vx = y[16]
    a_float_vy = y[17]
    a_float_wx = y[19]
    a_float_wy = y[20]
    a_float_wz = y[21]
    lam_ball_along = y[24]
    lam_ball_across = y[25]
    x0 = cos(q_pivot)
    x1 = sin(q_pivot)
    x2 = q_float_y*x0 - q_float_x*x1
    x3 = lam_ball_across*x0 + lam_ball_along*x1
    x4 = q_float_x*x0 + q_float_y*x1
    x5 = lam_ball_along*x0 - lam_ball_across*x1
    x6 = x0*(x2*x3 + x4*x5)
    x7 = x1*(x2*x5 - x4*x3)
    x8 = x0*x5 + x1*x3
    x9 = x0*x3 - x1*x5
    x10 = x1*x4
    x11 = x0*x2
    x12 = x10 + x11
    x13 = x0*x4
    x14 = x1*x2
    x15 = x13 - x14
    x16 = x0*x12 - x1*x15
    x17 = x0*x15 + x1*x12
    x18 = -x0
    x19 = -x1
    x20 = q_float_qx + q_float_qx
    x21 = q_float_qy*x20
    x22 = q_float_qz + q_float_qz
    x23 = q_float_qw*x22
    x24 = x21 - x23
    x25 = q_float_qx*x20
    x26 = q_float_qy + q_float_qy
    x27 = q_float_qy*x26
    x28 = 1.0 - (x25 + x27)
    x29 = p_radius*x28
    x30 = x29*x3
    x31 = q_float_qz*x22
    x32 = 1.0 - (x25 + x31)
    x33 = x29*x5
    x34 = q_float_qz*x20
    x35 = q_float_qw*x26
    x36 = x34 + x35
    x37 = q_float_qz*x26
    x38 = q_float_qw*x20
    x39 = x37 + x38
    x40 = p_radius*x39
    x41 = x40*x3
    x42 = x37 - x38
    x43 = x40*x5
    x44 = x22*x33
    x45 = x26*x43
    x46 = p_radius*(x36*x5 + x42*x3)
    x47 = x46 - x41
    x48 = p_radius*(x32*x3 + x24*x5)
    x49 = x30 + x48
    x50 = q_float_qw*x47 + q_float_qz*x43 - q_float_qy*x33 + q_float_qx*x49
    x51 = x26*x48
    x52 = x41 + x46
    x53 = x51 - x20*x33 + 2.0*(q_float_qw*x43 + q_float_qz*x52 + q_float_qy*x48)
    x54 = x22*x30
    x55 = x54 + (x26*x52 + x20*x43) + 2.0*(q_float_qw*x33 + q_float_qz*x30)
    x56 = v_float_wz*c3 - v_float_wz*c4
    x57 = v_float_wy*c4 - v_float_wy*c3
    x58 = x24*x29 - x36*x40
    x59 = x42*x40 - x32*x29
    x60 = x0*x58 - x1*x59
    x61 = x0*x59 + x1*x58
    x62 = x21 + x23
    x63 = 1.0 - (x27 + x31)
    x64 = x34 - x35
    x65 = p_radius*x64
    x66 = x65*x5
    x67 = x65*x3
    x68 = x46 - x66
    x69 = x20*x67
    x70 = x66 + x46
    x71 = p_radius*(x62*x3 + x63*x5)
    x72 = q_float_qw*x67 - q_float_qz*x70 + q_float_qy*x30 - q_float_qx*x71
    x73 = x20*x71
    x74 = x33 + x71
    x75 = x20*x30 - x26*x74 + 2.0*(q_float_qw*x68 - q_float_qz*x67 - q_float_qy*x74)
    x76 = 2.0*(q_float_qw*x30 - q_float_qz*x33) - (x44 + (x26*x67 + x20*x70))
    x77 = v_float_wx*c3 - v_float_wx*c4
    x78 = x36*x65 - x63*x29
    x79 = x62*x29 - x42*x65
    x80 = x0*x78 - x1*x79
    x81 = x0*x79 + x1*x78
    x82 = x41 + x66
    x83 = x66 - x41
    x84 = q_float_qz*x48 - q_float_qw*x71 + q_float_qy*x83 - q_float_qx*x67
    x85 = x45 + x20*x83 + 2.0*(q_float_qy*x43 - (q_float_qw*x48 + q_float_qz*x71))
    x86 = x43 - x67
    x87 = x20*x48 - x26*x71 + x22*x86 + 2.0*(q_float_qz*x86 - q_float_qw*x82)
    x88 = x63*x40 - x24*x65
    x89 = x32*x65 - x62*x40
    x90 = x0*x88 - x1*x89
    x91 = x0*x89 + x1*x88
    x92 = v_float_wy*x62 - v_float_wx*x32
    x93 = p_radius*(v_float_wy*x64 - v_float_wx*x39)
    x94 = v_float_wx*v_float_wz
    x95 = a_float_wy + x94
    x96 = v_float_wy*v_float_wz
    x97 = x96 - a_float_wx
    x98 = v_float_wx*v_float_wx
    x99 = v_float_wy*v_float_wy
    x100 = x98 + x99
    x101 = x62*x95 + x32*x97 - x42*x100
    x102 = v_float_wx*x42 - v_float_wz*x62
    x103 = p_radius*(v_float_wx*x28 - v_float_wz*x64)
    x104 = v_float_wx*v_float_wy
    x105 = x104 - a_float_wz
    x106 = v_float_wz*v_float_wz
    x107 = x98 + x106
    x108 = a_float_wx + x96
    x109 = x62*x105 - x32*x107 + x42*x108
    x110 = v_pivot*x0
    x111 = v_float_vx*x0
    x112 = v_pivot*x1
    x113 = v_float_vy*x1
    x114 = x111 - q_float_x*x112 + (x113 + q_float_y*x110)
    x115 = a_pivot*x0
    x116 = v_pivot*v_pivot
    x117 = x115 - x1*x116
    x118 = v_float_vy*x0
    x119 = v_float_vx*x1
    x120 = x118 - q_float_y*x112 - (x119 + q_float_x*x110)
    x121 = a_pivot*x1
    x122 = v_pivot*x110 + x121
    x123 = v_float_wz*x32 - v_float_wy*x42
    x124 = p_radius*(v_float_wz*x39 - v_float_wy*x28)
    x125 = a_float_wz + x104
    x126 = x99 + x106
    x127 = x94 - a_float_wy
    x128 = x32*x125 - x62*x126 + x42*x127
    x129 = x110*x114 + x4*x117 - (x112*x120 + x2*x122) + (x123*x124 + x65*x128)
    x130 = a_float_vy - (x92*x93 + x29*x101 + (x102*x103 + x40*x109 + x129))
    x131 = v_float_wz*x24 - v_float_wy*x36
    x132 = x24*x125 - x63*x126 + x36*x127
    x133 = x112*x114 + x4*x122 + (x110*x120 + x2*x117) - (x131*x124 + x65*x132)
    x134 = v_float_wx*x36 - v_float_wz*x63
    x135 = x63*x105 - x24*x107 + x36*x108
    x136 = v_float_wy*x63 - v_float_wx*x24
    x137 = x63*x95 + x24*x97 - x36*x100
    x138 = a_float_vx + (x133 - (x134*x103 + x40*x135) - (x136*x93 + x29*x137))
    x139 = x13 + x14
    x140 = x1*x112 + x0*x110
    x141 = x0*x112 - x1*x110
    x142 = x0*x130 - x1*x138 + x139*x115 - x113*x140 - x111*x140 + x118*x141
    x143 = x11 - x10
    x144 = x0*x116 + x121
    x145 = x1*x122 + x0*x117
    x146 = x112*x110
    x147 = x145 + x146 - x146
    x148 = x0*x122 - x1*x117
    x149 = x110*x110
    x150 = x112*x112
    x151 = x148 - x149 - x150
    x152 = q_float_y*x141
    x153 = x0*x120
    x154 = x110*x4
    x155 = x112*x2
    x156 = v_float_vy - (x92*x29 + (x102*x40 + (x154 - x155 + x123*x65)))
    x157 = x1*x114
    x158 = q_float_x*x140
    x159 = x152 + (v_pivot*x139 + (x153 + (x156 - x157)) - x158) - x154 - x155
    x160 = x110*x2
    x161 = x1*x120
    x162 = x112*x4
    x163 = v_float_vx + (x162 + x160 - x131*x65 - x134*x40 - x136*x29)
    x164 = x0*x114
    x165 = q_float_y*x140
    x166 = q_float_x*x141
    x167 = x160 + (x161 - x163 + x164 - x165 - x166) - x162
    x168 = x142 - x119*x141 - x143*x144 - x4*x147 + x2*x151 - x112*x159 + x110*x167
    x169 = x112*x141 + x110*x140
    x170 = x110*x141 - x112*x140
    x171 = x1*x65
    x172 = x1*x29
    x173 = x1*x40
    x174 = x110*x29 + x1*x93
    x175 = x1*x103 + x110*x40
    x176 = x126*x171 - (x172*x95 + x173*x105) - v_float_wy*x174 + v_float_wz*x175
    x177 = x0*x40
    x178 = x0*x29
    x179 = x0*x65
    x180 = x112*x29 - x0*x93
    x181 = x112*x65 - x0*x124
    x182 = x107*x177 - x178*x97 - x179*x125 - v_float_wx*x180 + v_float_wz*x181
    x183 = x176 - x182
    x184 = x22*x183
    x185 = x100*x178 - x177*x108 - x179*x127
    x186 = x112*x40 - x0*x103
    x187 = v_float_wx*x186
    x188 = v_float_wy*x181
    x189 = x185 + x187 - x188
    x190 = p_radius*(x1*x102 + x0*x134)
    x191 = v_float_wz*x190 + p_radius*(x112*x131 - (x1*x128 + x0*x132 + x110*x123))
    x192 = p_radius*(x1*x92 + x0*x136)
    x193 = x191 - v_float_wy*x192
    x194 = x189 - x193
    x195 = p_radius*(x1*x123 + x0*x131)
    x196 = p_radius*(x112*x134 - (x1*x109 + x0*x135 + x110*x102)) - v_float_wz*x195
    x197 = x196 + v_float_wx*x192
    x198 = x100*x172 - x173*x108 - x171*x127
    x199 = x1*x124 + x110*x65
    x200 = v_float_wy*x199
    x201 = v_float_wx*x175
    x202 = x198 + x200 - x201
    x203 = x197 - x202
    x204 = x193 + x189
    x205 = x176 + x182
    x206 = p_radius*(x112*x136 - (x110*x92 + x1*x101 + x0*x137)) - v_float_wx*x190
    x207 = x206 + v_float_wy*x195
    x208 = x107*x173 - x172*x97 - x171*x125 + v_float_wx*x174 - v_float_wz*x199
    x209 = x207 + x208
    x210 = q_float_qw*x203 + q_float_qz*x204 + q_float_qy*x205 - q_float_qx*x209
    x211 = x126*x179 - (x178*x95 + x177*x105) + v_float_wy*x180 - v_float_wz*x186
    x212 = x211 + x207
    x213 = x197 + x202
    x214 = x20*x205 - x26*x212 + 2.0*(q_float_qw*x194 + q_float_qz*x213 - q_float_qy*x212)
    x215 = x211 + x208
    x216 = x22*x215
    x217 = x26*x213 + x20*x204 - x216 + 2.0*(q_float_qw*x183 - q_float_qz*x215)
    x218 = 2.0*x112
    x219 = x0*x141
    x220 = x1*x140
    x221 = x0*x140
    x222 = x1*x141
    x223 = x32*x174 - x24*x180 - x28*x190 + x36*x186 + x39*x192 - x42*x175
    x224 = 2.0*v_float_wx
    x225 = x42*x172 + x36*x178
    x226 = x32*x173 + x24*x177
    x227 = x62*x172 + x63*x178 + (x42*x171 + x36*x179)
    x228 = x62*x173 + x63*x177 + (x32*x171 + x24*x179)
    x229 = x223 + x224*x225 + x224*x226 - v_float_wz*x227 - v_float_wy*x228
    x230 = x63*x180 - x62*x174 + x28*x195 + x42*x199 - x64*x192 - x36*x181
    x231 = 2.0*v_float_wy
    x232 = x62*x171 + x63*x179
    x233 = x32*x172 + x24*x178 + (x42*x173 + x36*x177)
    x234 = x230 + x231*x225 + x231*x232 - v_float_wz*x233 - v_float_wx*x228
    x235 = x64*x190 - x63*x186 - x39*x195 - x32*x199 + x62*x175 + x24*x181
    x236 = 2.0*v_float_wz
    x237 = x235 + x236*x226 + x236*x232 - v_float_wy*x233 - v_float_wx*x227
    x238 = x143*x115 - (x0*x138 + x1*x130) - x113*x141 - x111*x141 - x118*x140
    x239 = x148 - x150 - x149
    x240 = x146 - x145 - x146
    x241 = x162 + (v_pivot*x143 - (x161 + (x163 + x164)) - x166 - x165) - x160
    x242 = x153 - x156 - x157 - x152 + x158 - x155 - x154
    x243 = x238 + x119*x140 + x139*x144 - x4*x239 + x2*x240 - x112*x241 + x110*x242
    x244 = x201 - x198 - x200
    x245 = p_radius*(x1*x134 - x0*x102)
    x246 = p_radius*(x1*x132 - x0*x128 + x112*x123 + x110*x131) - v_float_wz*x245
    x247 = p_radius*(x1*x136 - x0*x92)
    x248 = x246 + v_float_wy*x247
    x249 = x244 - x248
    x250 = p_radius*(x1*x131 - x0*x123)
    x251 = v_float_wz*x250 + p_radius*(x1*x135 - x0*x109 + x112*x102 + x110*x134)
    x252 = x251 - v_float_wx*x247
    x253 = x187 + (x185 - x188)
    x254 = x252 - x253
    x255 = x248 + x244
    x256 = x211 - x208
    x257 = p_radius*(x112*x92 - x0*x101 + x1*x137 + x110*x136) + v_float_wx*x245
    x258 = x257 - v_float_wy*x250
    x259 = x258 + x182
    x260 = q_float_qw*x254 + q_float_qz*x255 + q_float_qy*x256 - q_float_qx*x259
    x261 = x176 - x258
    x262 = x252 + x253
    x263 = x20*x256 + x26*x261 + 2.0*(q_float_qw*x249 + q_float_qz*x262 + q_float_qy*x261)
    x264 = x184 + (x26*x262 + x20*x255) + 2.0*(q_float_qw*x215 + q_float_qz*x183)
    x265 = x28*x245 - (x32*x180 + x24*x174) + x36*x175 - x39*x247 + x42*x186
    x266 = x42*x178 - x36*x172
    x267 = x32*x177 - x24*x173
    x268 = x63*x172 - x62*x178 + (x36*x171 - x42*x179)
    x269 = x24*x171 - x32*x179 - (x62*x177 - x63*x173)
    x270 = x265 + x224*x266 + x224*x267 + v_float_wz*x268 + v_float_wy*x269
    x271 = x62*x180 + x63*x174 - x28*x250 - x42*x181 + x64*x247 - x36*x199
    x272 = x62*x179 - x63*x171
    x273 = x36*x173 - x42*x177 - (x32*x178 - x24*x172)
    x274 = x271 + x231*x266 + x231*x272 + v_float_wz*x273 + v_float_wx*x269
    x275 = x39*x250 - (x64*x245 + x63*x175) + x32*x181 - x62*x186 + x24*x199
    x276 = x275 + x236*x267 + x236*x272 + v_float_wy*x273 + v_float_wx*x268
    out[0] = x6 + x7 - x7 - x6 + x4*x8 + x2*x9
    out[1] = x1*x8 + x0*x9
    out[2] = x1*x9 - x0*x8
    out[15] = 13.511361684558983
    out[23] = -1.0
    out[24] = -x16
    out[25] = x17
    out[26] = x3
    out[42] = c1
    out[50] = x18
    out[51] = x1
    out[52] = -x5
    out[69] = c1
    out[76] = x19
    out[77] = x18
    out[96] = c1
    out[100] = -1.0
    out[104] = x24*x30 - x32*x33 - x36*x41 + x42*x43
    out[108] = x44 + x45 + x20*x47
    out[109] = x20*x49 + 2.0*x50
    out[110] = x53
    out[111] = x55
    out[117] = -x56
    out[118] = -x57
    out[123] = c3
    out[128] = -x60
    out[129] = x61
    out[130] = x62*x33 - x63*x30 - x42*x66 + x36*x67
    out[134] = x54 + x26*x68 + x69
    out[135] = 2.0*x72 - x73
    out[136] = x75
    out[137] = x76
    out[142] = x56
    out[144] = -x77
    out[150] = c3
    out[154] = -x80
    out[155] = x81
    out[156] = x63*x41 + x32*x66 - x62*x43 - x24*x67
    out[160] = -(x22*x82 + x51 + x73)
    out[161] = 2.0*x84 - x69
    out[162] = x85
    out[163] = x87
    out[168] = x57
    out[169] = x77
    out[177] = c3
    out[180] = -x90
    out[181] = x91
    out[200] = 1.0
    out[223] = 1.0
    out[234] = x168
    out[235] = x0*x151 - (x169 + x1*x147)
    out[236] = x170 + x0*x147 + x1*x151
    out[238] = x184 + x26*x194 + x20*x203
    out[239] = 2.0*x210 - x20*x209
    out[240] = x214
    out[241] = x217
    out[242] = x1*x167 + (x0*x159 + (x110*x139 - x143*x218))
    out[243] = x219 - (x112 + x220)
    out[244] = x110 + x221 + x222
    out[246] = x229
    out[247] = x234
    out[248] = x237
    out[249] = x16
    out[250] = x0
    out[251] = x1
    out[253] = x60
    out[254] = x80
    out[255] = x90
    out[260] = x243
    out[261] = x0*x240 - (x170 + x1*x239)
    out[262] = x0*x239 - x169 + x1*x240
    out[264] = x216 + x26*x249 + x20*x254
    out[265] = 2.0*x260 - x20*x259
    out[266] = x263
    out[267] = x264
    out[268] = x1*x242 + (x0*x241 + (x110*x143 + x139*x218))
    out[269] = -(x221 + (x110 + x222))
    out[270] = x219 - x112 - x220
    out[272] = x270
    out[273] = x274
    out[274] = x276
    out[275] = -x17
    out[276] = x19
    out[277] = x0
    out[279] = -x61
    out[280] = -x81
    out[281] = -x91


@njit(error_model="numpy")
def constraint_residual(t, y, p, out):
    """Position residuals, velocity residuals. 85 operations."""
    p_radius = p[0]
    p_turning = p[1]
    q_pivot = y[0]
    q_float_x = y[1]
    q_float_y = y[2]
    q_float_z = y[3]
    q_float_qw = y[4]
    q_float_qx = y[5]
    q_float_qy = y[6]
    q_float_qz = y[7]
    v_pivot = y[8]
    v_float_vx = y[9]
    v_float_vy = y[10]
    v_float_vz = y[11]
    v_float_wx = y[12]
    v_float_wy = y[13]
    v_float_wz = y[14]
    x0 = cos(q_pivot)
    x1 = sin(q_pivot)
    x2 = v_pivot*x1
    x3 = q_float_x*x0 + q_float_y*x1
    x4 = v_pivot*x0
    x5 = q_float_y*x0 - q_float_x*x1
    x6 = q_float_qx + q_float_qx
    x7 = q_float_qy*x6
    x8 = q_float_qz + q_float_qz
    x9 = q_float_qw*x8
    x10 = x7 - x9
    x11 = q_float_qz*x6
    x12 = q_float_qy + q_float_qy
    x13 = q_float_qw*x12
    x14 = x11 + x13
    x15 = p_radius*(x11 - x13)
    x16 = q_float_qy*x12
    x17 = q_float_qz*x8
    x18 = 1.0 - (x16 + x17)
    x19 = q_float_qz*x12
    x20 = q_float_qw*x6
    x21 = p_radius*(x19 + x20)
    x22 = x2*x3 + x4*x5 - (v_float_wz*x10 - v_float_wy*x14)*x15 - (v_float_wx*x14 - v_float_wz*x18)*x21
    x23 = q_float_qx*x6
    x24 = p_radius*(1.0 - (x23 + x16))
    x25 = v_float_vx + (x22 - (v_float_wy*x18 - v_float_wx*x10)*x24)
    x26 = x7 + x9
    x27 = 1.0 - (x23 + x17)
    x28 = x19 - x20
    x29 = (v_float_wx*x28 - v_float_wz*x26)*x21 + (x4*x3 - x2*x5 + (v_float_wz*x27 - v_float_wy*x28)*x15)
    x30 = v_float_vy - ((v_float_wy*x26 - v_float_wx*x27)*x24 + x29)
    out[0] = q_float_z - p_radius
    out[1] = q_pivot - t*p_turning
    out[2] = v_float_vz
    out[3] = v_pivot - p_turning
    out[4] = x0*x25 + x1*x30
    out[5] = x0*x30 - x1*x25


@njit(error_model="numpy")
def constraint_jacobian(t, y, p, out):
    """Constraint Jacobian G, row by row. 88 operations."""
    p_radius = p[0]
    q_pivot = y[0]
    q_float_x = y[1]
    q_float_y = y[2]
    q_float_qw = y[4]
    q_float_qx = y[5]
    q_float_qy = y[6]
    q_float_qz = y[7]
    x0 = cos(q_pivot)
    x1 = sin(q_pivot)
    x2 = q_float_x*x0 + q_float_y*x1
    x3 = q_float_y*x0 - q_float_x*x1
    x4 = x1*x2 + x0*x3
    x5 = x0*x2 - x1*x3
    x6 = q_float_qx + q_float_qx
    x7 = q_float_qy*x6
    x8 = q_float_qz + q_float_qz
    x9 = q_float_qw*x8
    x10 = x7 - x9
    x11 = q_float_qx*x6
    x12 = q_float_qy + q_float_qy
    x13 = q_float_qy*x12
    x14 = p_radius*(1.0 - (x11 + x13))
    x15 = q_float_qz*x6
    x16 = q_float_qw*x12
    x17 = x15 + x16
    x18 = q_float_qz*x12
    x19 = q_float_qw*x6
    x20 = p_radius*(x18 + x19)
    x21 = x10*x14 - x17*x20
    x22 = x18 - x19
    x23 = q_float_qz*x8
    x24 = 1.0 - (x11 + x23)
    x25 = x22*x20 - x24*x14
    x26 = p_radius*(x15 - x16)
    x27 = 1.0 - (x13 + x23)
    x28 = x17*x26 - x27*x14
    x29 = x7 + x9
    x30 = x29*x14 - x22*x26
    x31 = x27*x20 - x10*x26
    x32 = x24*x26 - x29*x20
    out[3] = 1.0
    out[7] = 1.0
    out[14] = x0*x4 - x1*x5
    out[15] = x0
    out[16] = x1
    out[18] = x0*x21 - x1*x25
    out[19] = x0*x28 - x1*x30
    out[20] = x0*x31 - x1*x32
    out[21] = -(x0*x5 + x1*x4)
    out[22] = -x1
    out[23] = x0
    out[25] = -(x0*x25 + x1*x21)
    out[26] = -(x0*x30 + x1*x28)
    out[27] = -(x0*x32 + x1*x31)


@njit(error_model="numpy")
def gamma(t, y, p, out):
    """Right-hand side of G a = gamma. 196 operations."""
    p_radius = p[0]
    q_pivot = y[0]
    q_float_x = y[1]
    q_float_y = y[2]
    q_float_qw = y[4]
    q_float_qx = y[5]
    q_float_qy = y[6]
    q_float_qz = y[7]
    v_pivot = y[8]
    v_float_vx = y[9]
    v_float_vy = y[10]
    v_float_wx = y[12]
    v_float_wy = y[13]
    v_float_wz = y[14]
    x0 = cos(q_pivot)
    x1 = sin(q_pivot)
    x2 = q_float_x*x0 + q_float_y*x1
    x3 = v_pivot*x0
    x4 = v_pivot*x3
    x5 = v_pivot*x1
    x6 = v_float_vx*x0 - q_float_x*x5 + (v_float_vy*x1 + q_float_y*x3)
    x7 = v_float_vy*x0 - q_float_y*x5 - (v_float_vx*x1 + q_float_x*x3)
    x8 = x1*(v_pivot*v_pivot)
    x9 = q_float_y*x0 - q_float_x*x1
    x10 = q_float_qx + q_float_qx
    x11 = q_float_qy*x10
    x12 = q_float_qz + q_float_qz
    x13 = q_float_qw*x12
    x14 = x11 - x13
    x15 = v_float_wx*v_float_wy
    x16 = q_float_qy + q_float_qy
    x17 = q_float_qy*x16
    x18 = q_float_qz*x12
    x19 = 1.0 - (x17 + x18)
    x20 = v_float_wy*v_float_wy
    x21 = v_float_wz*v_float_wz
    x22 = x20 + x21
    x23 = q_float_qz*x10
    x24 = q_float_qw*x16
    x25 = x23 + x24
    x26 = v_float_wx*v_float_wz
    x27 = x23 - x24
    x28 = p_radius*x27
    x29 = v_float_wz*x14 - v_float_wy*x25
    x30 = q_float_qz*x16
    x31 = q_float_qw*x10
    x32 = x30 + x31
    x33 = q_float_qx*x10
    x34 = 1.0 - (x33 + x17)
    x35 = p_radius*(v_float_wz*x32 - v_float_wy*x34)
    x36 = x2*x4 + x5*x6 + (x3*x7 - x8*x9) - ((x14*x15 - x19*x22 + x25*x26)*x28 + x29*x35)
    x37 = v_float_wx*v_float_wx
    x38 = x37 + x21
    x39 = v_float_wy*v_float_wz
    x40 = p_radius*x32
    x41 = v_float_wx*x25 - v_float_wz*x19
    x42 = p_radius*(v_float_wx*x34 - v_float_wz*x27)
    x43 = x37 + x20
    x44 = p_radius*x34
    x45 = v_float_wy*x19 - v_float_wx*x14
    x46 = p_radius*(v_float_wy*x27 - v_float_wx*x32)
    x47 = x36 - ((x19*x15 - x14*x38 + x25*x39)*x40 + x41*x42) - ((x19*x26 + x14*x39 - x25*x43)*x44 + x45*x46)
    x48 = v_float_vx + (x5*x2 + x3*x9 - x29*x28 - x41*x40 - x45*x44)
    x49 = x11 + x13
    x50 = 1.0 - (x33 + x18)
    x51 = v_float_wy*x49 - v_float_wx*x50
    x52 = x30 - x31
    x53 = v_float_wx*x52 - v_float_wz*x49
    x54 = v_float_wz*x50 - v_float_wy*x52
    x55 = v_float_vy - (x51*x44 + (x53*x40 + (x3*x2 - x5*x9 + x54*x28)))
    x56 = x3*x6 - x8*x2 - (x9*x4 + x5*x7) + ((x50*x15 - x49*x22 + x52*x26)*x28 + x54*x35)
    x57 = (x49*x26 + x50*x39 - x52*x43)*x44 + x51*x46 + ((x49*x15 - x50*x38 + x52*x39)*x40 + x53*x42 + x56)
    out[0] = 0.0
    out[1] = 0.0
    out[2] = -(x0*x47 - x5*x48 + (x3*x55 - x1*x57))
    out[3] = x5*x55 + x0*x57 + (x3*x48 + x1*x47)


@njit(error_model="numpy")
def project(t, y, p, out):
    """State moved onto the constraints, and the residuals it had. 311 operations."""
    p_radius = p[0]
    p_turning = p[1]
    c0 = p_radius*p_radius
    c1 = 1.0/(5026.548245743669*(p_radius*c0))
    c2 = 1.0/(2010.6192982974676*(p_radius*(c0*c0)))
    q_pivot = y[0]
    q_float_x = y[1]
    q_float_y = y[2]
    q_float_z = y[3]
    q_float_qw = y[4]
    q_float_qx = y[5]
    q_float_qy = y[6]
    q_float_qz = y[7]
    v_pivot = y[8]
    v_float_vx = y[9]
    v_float_vy = y[10]
    v_float_vz = y[11]
    v_float_wx = y[12]
    v_float_wy = y[13]
    v_float_wz = y[14]
    x0 = q_pivot - t*p_turning
    x1 = q_pivot - x0
    x2 = sin(q_pivot)
    x3 = x2*c1
    x4 = cos(q_pivot)
    x5 = x4*c1
    x6 = q_float_qy + q_float_qy
    x7 = q_float_qz*x6
    x8 = q_float_qx + q_float_qx
    x9 = q_float_qw*x8
    x10 = x7 - x9
    x11 = p_radius*(x7 + x9)
    x12 = q_float_qx*x8
    x13 = q_float_qz + q_float_qz
    x14 = q_float_qz*x13
    x15 = 1.0 - (x12 + x14)
    x16 = q_float_qy*x6
    x17 = p_radius*(1.0 - (x12 + x16))
    x18 = x10*x11 - x15*x17
    x19 = q_float_qy*x8
    x20 = q_float_qw*x13
    x21 = x19 - x20
    x22 = q_float_qz*x8
    x23 = q_float_qw*x6
    x24 = x22 + x23
    x25 = x21*x17 - x24*x11
    x26 = x4*x18 + x2*x25
    x27 = x4*x25 - x2*x18
    x28 = x27*c2
    x29 = x19 + x20
    x30 = p_radius*(x22 - x23)
    x31 = x29*x17 - x10*x30
    x32 = 1.0 - (x16 + x14)
    x33 = x24*x30 - x32*x17
    x34 = x4*x31 + x2*x33
    x35 = x4*x33 - x2*x31
    x36 = x35*c2
    x37 = x15*x30 - x29*x11
    x38 = x32*x11 - x21*x30
    x39 = x4*x37 + x2*x38
    x40 = x4*x38 - x2*x37
    x41 = x40*c2
    x42 = x2*x5 - x4*x3 + x26*x28 + x34*x36 + x39*x41
    x43 = x4*x5 + x2*x3
    x44 = 1.0/(x43 + x27*x28 + x35*x36 + x40*x41)
    x45 = x42*x44
    x46 = x26*c2
    x47 = x34*c2
    x48 = x39*c2
    x49 = 1.0/(x42*x45 - (x43 + x26*x46 + x34*x47 + x39*x48))
    x50 = q_float_x*x4 + q_float_y*x2
    x51 = q_float_y*x4 - q_float_x*x2
    x52 = x2*x50 + x4*x51
    x53 = x4*x50 - x2*x51
    x54 = x4*x52 - x2*x53
    x55 = x0*x54
    x56 = x4*x53 + x2*x52
    x57 = x49*(x45*x55 - x0*x56)
    x58 = x45*x57 - x44*x55
    x59 = q_float_x + (x3*x57 - x5*x58)
    x60 = q_float_y - (x3*x58 + x5*x57)
    x61 = q_float_z - p_radius
    x62 = 0.5*(x46*x57 - x28*x58)
    x63 = 0.5*(x47*x57 - x36*x58)
    x64 = 0.5*(x48*x57 - x41*x58)
    x65 = q_float_qw - (q_float_qx*x62 + q_float_qy*x63 + q_float_qz*x64)
    x66 = q_float_qx + (q_float_qw*x62 - q_float_qz*x63 + q_float_qy*x64)
    x67 = q_float_qy + (q_float_qz*x62 + q_float_qw*x63 - q_float_qx*x64)
    x68 = q_float_qz + (q_float_qx*x63 - q_float_qy*x62 + q_float_qw*x64)
    x69 = 1.0/sqrt(x65*x65 + x66*x66 + x67*x67 + x68*x68)
    x70 = x65*x69
    x71 = x66*x69
    x72 = x67*x69
    x73 = x68*x69
    x74 = v_pivot - p_turning
    x75 = cos(x1)
    x76 = sin(x1)
    x77 = v_pivot*x76
    x78 = x59*x75 + x60*x76
    x79 = v_pivot*x75
    x80 = x60*x75 - x59*x76
    x81 = x71 + x71
    x82 = x72*x81
    x83 = x73 + x73
    x84 = x70*x83
    x85 = x82 - x84
    x86 = x73*x81
    x87 = x72 + x72
    x88 = x70*x87
    x89 = x86 + x88
    x90 = p_radius*(x86 - x88)
    x91 = x72*x87
    x92 = x73*x83
    x93 = 1.0 - (x91 + x92)
    x94 = x73*x87
    x95 = x70*x81
    x96 = p_radius*(x94 + x95)
    x97 = x77*x78 + x79*x80 - (v_float_wz*x85 - v_float_wy*x89)*x90 - (v_float_wx*x89 - v_float_wz*x93)*x96
    x98 = x71*x81
    x99 = p_radius*(1.0 - (x98 + x91))
    x100 = v_float_vx + (x97 - (v_float_wy*x93 - v_float_wx*x85)*x99)
    x101 = x82 + x84
    x102 = 1.0 - (x98 + x92)
    x103 = x94 - x95
    x104 = (v_float_wx*x103 - v_float_wz*x101)*x96 + (x79*x78 - x77*x80 + (v_float_wz*x102 - v_float_wy*x103)*x90)
    x105 = v_float_vy - ((v_float_wy*x101 - v_float_wx*x102)*x99 + x104)
    x106 = x75*x100 + x76*x105
    x107 = x74*x54 - x106
    x108 = x75*x105 - x76*x100
    x109 = x49*(x45*x107 - (x108 + x74*x56))
    x110 = x45*x109 - x44*x107
    out[0] = x1
    out[1] = x59
    out[2] = x60
    out[3] = q_float_z - x61
    out[4] = x70
    out[5] = x71
    out[6] = x72
    out[7] = x73
    out[8] = v_pivot - x74
    out[9] = v_float_vx + (x3*x109 - x5*x110)
    out[10] = v_float_vy - (x3*x110 + x5*x109)
    out[11] = 0.0
    out[12] = v_float_wx + (x46*x109 - x28*x110)
    out[13] = v_float_wy + (x47*x109 - x36*x110)
    out[14] = v_float_wz + (x48*x109 - x41*x110)
    out[15] = x61
    out[16] = x0
    out[17] = v_float_vz
    out[18] = x74
    out[19] = x106
    out[20] = x108


@njit(error_model="numpy")
def kinematics(t, y, p, out):
    """N of dq/dt = N v, row by row; derivative of N v by q. 13 operations."""
    q_float_qw = y[4]
    q_float_qx = y[5]
    q_float_qy = y[6]
    q_float_qz = y[7]
    v_float_wx = y[12]
    v_float_wy = y[13]
    v_float_wz = y[14]
    x0 = 0.5*q_float_qx
    x1 = -x0
    x2 = 0.5*q_float_qy
    x3 = -x2
    x4 = 0.5*q_float_qz
    x5 = -x4
    x6 = 0.5*q_float_qw
    x7 = 0.5*v_float_wx
    x8 = -x7
    x9 = 0.5*v_float_wy
    x10 = -x9
    x11 = 0.5*v_float_wz
    x12 = -x11
    out[0] = 1.0
    out[8] = 1.0
    out[16] = 1.0
    out[24] = 1.0
    out[32] = x1
    out[33] = x3
    out[34] = x5
    out[39] = x6
    out[40] = x5
    out[41] = x2
    out[46] = x4
    out[47] = x6
    out[48] = x1
    out[53] = x3
    out[54] = x0
    out[55] = x6
    out[93] = x8
    out[94] = x10
    out[95] = x12
    out[100] = x7
    out[102] = x11
    out[103] = x10
    out[108] = x9
    out[109] = x12
    out[111] = x7
    out[116] = x11
    out[117] = x9
    out[118] = x8


@njit(error_model="numpy")
def poses(t, y, p, out):
    """Per body: position, rotation matrix (body to world). 27 operations."""
    q_pivot = y[0]
    q_float_x = y[1]
    q_float_y = y[2]
    q_float_z = y[3]
    q_float_qw = y[4]
    q_float_qx = y[5]
    q_float_qy = y[6]
    q_float_qz = y[7]
    x0 = cos(q_pivot)
    x1 = sin(q_pivot)
    x2 = q_float_qy + q_float_qy
    x3 = q_float_qy*x2
    x4 = q_float_qz + q_float_qz
    x5 = q_float_qz*x4
    x6 = q_float_qx + q_float_qx
    x7 = q_float_qy*x6
    x8 = q_float_qw*x4
    x9 = q_float_qz*x6
    x10 = q_float_qw*x2
    x11 = q_float_qx*x6
    x12 = q_float_qz*x2
    x13 = q_float_qw*x6
    out[0] = 0.0
    out[1] = 0.0
    out[2] = -0.015
    out[3] = x0
    out[4] = -x1
    out[5] = 0.0
    out[6] = x1
    out[7] = x0
    out[8] = 0.0
    out[9] = 0.0
    out[10] = 0.0
    out[11] = 1.0
    out[12] = q_float_x
    out[13] = q_float_y
    out[14] = q_float_z
    out[15] = 1.0 - (x3 + x5)
    out[16] = x7 - x8
    out[17] = x9 + x10
    out[18] = x7 + x8
    out[19] = 1.0 - (x11 + x5)
    out[20] = x12 - x13
    out[21] = x9 - x10
    out[22] = x12 + x13
    out[23] = 1.0 - (x11 + x3)


@njit(error_model="numpy")
def shapes(t, y, p, out):
    """Sizes of the bodies' shapes. 0 operations."""
    p_radius = p[0]
    out[0] = 0.8
    out[1] = 0.03
    out[2] = 0.0
    out[3] = 0.0
    out[4] = 0.0
    out[5] = 1.0
    out[6] = 0.0
    out[7] = 0.0
    out[8] = 0.0
    out[9] = 0.0
    out[10] = 1.0
    out[11] = p_radius


@njit(error_model="numpy")
def marks(t, y, p, out):
    """What a picture shows besides bodies, as `marks` lists it. 0 operations."""
    out[8] = 1.0
    out[11] = 0.015


@njit(error_model="numpy")
def starts(t, y, p, out):
    """Start values of (q, v), before assembly. 0 operations."""
    p_radius = p[0]
    p_turning = p[1]
    out[0] = 0.0
    out[1] = 0.3
    out[2] = 0.0
    out[3] = p_radius
    out[4] = 1.0
    out[5] = 0.0
    out[6] = 0.0
    out[7] = 0.0
    out[8] = p_turning
    out[9] = 0.0
    out[10] = 0.0
    out[11] = 0.0
    out[12] = 0.0
    out[13] = 0.0
    out[14] = 0.0


@njit(error_model="numpy")
def limits(t, y, p, out):
    """Numbers of parameters that have a bound. 6 operations."""
    p_radius = p[0]
    c0 = p_radius*p_radius
    c1 = 5026.548245743669*(p_radius*c0)
    c2 = 2010.6192982974676*(p_radius*(c0*c0))
    out[0] = p_radius
    out[1] = c1
    out[2] = c2
    out[3] = c2
    out[4] = c2
    out[5] = c2
