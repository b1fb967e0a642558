"""four_bar: equations of motion, written by symgen 0.1.0. Do not edit.

Four-bar linkage: crank, coupler and rocker between two fixed pivots, spinning freely under gravity
"""

from math import cos, sin

from numba import njit

MODEL = {
    "abi": 1,
    "generator": "symgen 0.1.0",
    "source": "sha256:513fe17a5a909f071825bee83762c8e165fb48da67197bcb2fe396f6fe11d63e",
    "name": "four_bar",
    "description": "Four-bar linkage: crank, coupler and rocker between two fixed pivots, spinning freely under gravity",
    "nq": 3,
    "nv": 3,
    "nh": 2,
    "nn": 0,
    "nw": 0,
    "coordinates": [
        {"name": "crank", "unit": "rad", "value": 0.5, "enforced": True},
        {"name": "coupler", "unit": "rad", "value": 0.7, "enforced": False},
        {"name": "rocker", "unit": "rad", "value": 1.6, "enforced": False},
    ],
    "quaternions": [],
    "rates": [
        {"name": "crank", "unit": "rad/s", "value": 15.0, "enforced": True},
        {"name": "coupler", "unit": "rad/s", "value": 0.0, "enforced": False},
        {"name": "rocker", "unit": "rad/s", "value": 0.0, "enforced": False},
    ],
    "parameters": [
        {"name": "a", "unit": "m", "value": 0.1, "doc": "length of the crank"},
        {"name": "b", "unit": "m", "value": 0.3, "doc": "length of the coupler"},
        {"name": "c", "unit": "m", "value": 0.25, "doc": "length of the rocker"},
        {"name": "d", "unit": "m", "value": 0.3, "doc": "distance between the fixed pivots; a + d < b + c lets the crank turn"},
        {"name": "ma", "unit": "kg", "value": 0.5, "doc": ""},
        {"name": "mb", "unit": "kg", "value": 1.5, "doc": ""},
        {"name": "mc", "unit": "kg", "value": 1.25, "doc": ""},
        {"name": "g", "unit": "m/s^2", "value": 9.81, "doc": ""},
    ],
    "inputs": [],
    "constants": [],
    "constraints": [
        {"name": "loop_x", "kind": "holonomic", "multiplier": "N"},
        {"name": "loop_y", "kind": "holonomic", "multiplier": "N"},
    ],
    "outputs": [
        {"name": "rocker_speed", "unit": "1/s"},
    ],
    "events": [],
    "bodies": [
        {"name": "crank_bar", "planar": True, "shape": "capsule", "sizes": 2, "mesh": ""},
        {"name": "coupler_bar", "planar": True, "shape": "capsule", "sizes": 2, "mesh": ""},
        {"name": "rocker_bar", "planar": True, "shape": "capsule", "sizes": 2, "mesh": ""},
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
        "rhs": 189,
        "mass_matrix": 32,
        "forces": 62,
        "energy": 76,
        "residual": 156,
        "residual_jacobian": 235,
        "constraint_residual": 33,
        "constraint_jacobian": 15,
        "gamma": 30,
        "project": 145,
        "poses": 23,
        "shapes": 0,
        "outputs": 0,
        "marks": 5,
        "limits": 9,
    },
    "hoisted": {
        "rhs": 14,
        "mass_matrix": 7,
        "forces": 6,
        "energy": 12,
        "residual": 13,
        "residual_jacobian": 11,
        "project": 8,
        "poses": 3,
        "marks": 4,
    },
    "run": {
        "t_end": 10.0,
        "fps": 100.0,
    },
    "limits": [
        {"name": "bodies.crank_bar.shape.capsule[1]", "bound": "zero or more"},
        {"name": "bodies.crank_bar.mass", "bound": "zero or more"},
        {"name": "bodies.crank_bar.inertia", "bound": "zero or more"},
        {"name": "bodies.coupler_bar.shape.capsule[1]", "bound": "zero or more"},
        {"name": "bodies.coupler_bar.mass", "bound": "zero or more"},
        {"name": "bodies.coupler_bar.inertia", "bound": "zero or more"},
        {"name": "bodies.rocker_bar.shape.capsule[1]", "bound": "zero or more"},
        {"name": "bodies.rocker_bar.mass", "bound": "zero or more"},
        {"name": "bodies.rocker_bar.inertia", "bound": "zero or more"},
    ],
    "subsystems": [],
    "marks": [
        {"kind": "pin", "name": "crank_bar_1", "body": "crank_bar", "numbers": 6},
        {"kind": "ground", "name": "crank_bar_1", "body": "", "numbers": 3},
        {"kind": "pin", "name": "crank_bar_2", "body": "crank_bar", "numbers": 6},
        {"kind": "pin", "name": "coupler_bar_2", "body": "coupler_bar", "numbers": 6},
        {"kind": "reaction", "name": "coupler_bar_2", "body": "coupler_bar", "numbers": 3, "constraints": [0, 1], "signs": [1, 1]},
        {"kind": "pin", "name": "rocker_bar_1", "body": "rocker_bar", "numbers": 6},
        {"kind": "ground", "name": "rocker_bar_1", "body": "", "numbers": 3},
    ],
}

@njit(error_model="numpy")
def rhs(t, y, p, out):
    """State derivative: rates, accelerations, multipliers, pivot ratio. 189 operations."""
    p_a = p[0]
    p_b = p[1]
    p_c = p[2]
    p_ma = p[4]
    p_mb = p[5]
    p_mc = p[6]
    p_g = p[7]
    c0 = p_a*p_a
    c1 = 1.0/(c0*(0.08333333333333333*p_ma) + c0*(p_mb + 0.25*p_ma))
    c2 = p_a*c1
    c3 = 0.5*p_c
    c4 = 1.0/(p_c*p_c*(0.08333333333333333*p_mc) + p_mc*(c3*c3))
    c5 = p_c*c4
    c6 = 0.5*p_b
    c7 = p_a*(p_mb*c6)
    c8 = p_b*p_b*(0.08333333333333333*p_mb) + p_mb*(c6*c6)
    c9 = p_mb*p_g
    c10 = p_a*(c9 + 0.5*(p_ma*p_g))
    c11 = c3*(p_mc*p_g)
    c12 = c6*c9
    c13 = c11*c4
    q_crank = y[0]
    q_coupler = y[1]
    q_rocker = y[2]
    v_crank = y[3]
    v_coupler = y[4]
    v_rocker = y[5]
    x0 = sin(q_crank)
    x1 = x0*c2
    x2 = cos(q_rocker)
    x3 = p_c*x2
    x4 = sin(q_rocker)
    x5 = x4*c5
    x6 = cos(q_crank)
    x7 = p_a*x6
    x8 = cos(q_coupler)
    x9 = sin(q_coupler)
    x10 = c7*(x6*x8) + c7*(x0*x9)
    x11 = x10*c1
    x12 = p_b*x8 - x7*x11
    x13 = p_a*x0
    x14 = x13*x11 - p_b*x9
    x15 = 1.0/(c8 - x10*x11)
    x16 = x14*x15
    x17 = x3*x5 + x7*x1 - x12*x16
    x18 = 1.0/(x14*x16 + (p_c*x4*x5 + x13*x1))
    x19 = x17*x18
    x20 = x12*x15
    x21 = x2*c5
    x22 = x6*c2
    x23 = x12*x20 + (x3*x21 + x7*x22)
    x24 = x17*x19 - x23
    x25 = 0.5*v_coupler
    x26 = 0.5*v_crank
    x27 = c7*(v_crank*x25 + v_coupler*x26)
    x28 = v_crank*x6
    x29 = v_coupler*x8
    x30 = v_crank*x0
    x31 = v_coupler*x9
    x32 = c7*(x28*x9 + x0*x29) - c7*(x30*x8 + x6*x31)
    x33 = x6*(c10 - x9*x27) + x0*(x8*x27) + (0.5*(v_coupler*x32) + x25*x32)
    x34 = p_c*(v_rocker*(v_rocker*x4)) - (p_a*(v_crank*x30) + p_b*(v_coupler*x31))
    x35 = x2*c11
    x36 = x8*(c12 - x0*x27) + x9*(x6*x27) + (0.5*(v_crank*x32) + x26*x32)
    x37 = x33*x11 - x36
    x38 = p_c*(v_rocker*(v_rocker*x2)) - (p_a*(v_crank*x28) + p_b*(v_coupler*x29))
    x39 = x35*x5 - x38 - x33*x1 - x16*x37
    x40 = 1.0/x24*(x33*x22 - (x34 + x35*x21) - x20*x37 + x19*x39)
    x41 = x19*x40 - x18*x39
    x42 = x15*x37 - x16*x41 - x20*x40
    x43 = -(x24/x23)
    out[0] = v_crank
    out[1] = v_coupler
    out[2] = v_rocker
    out[3] = x1*x41 - (x33*c1 + x11*x42) - x22*x40
    out[4] = x42
    out[5] = x21*x40 - (x2*c13 + x5*x41)
    out[6] = -x41
    out[7] = -x40
    out[8] = (x43 if x43 < 1.0 else 1.0)


@njit(error_model="numpy")
def mass_matrix(t, y, p, out):
    """Mass matrix M, row by row. 32 operations."""
    p_a = p[0]
    p_b = p[1]
    p_c = p[2]
    p_ma = p[4]
    p_mb = p[5]
    p_mc = p[6]
    c0 = p_a*p_a
    c1 = c0*(0.08333333333333333*p_ma) + c0*(p_mb + 0.25*p_ma)
    c2 = 0.5*p_b
    c3 = p_a*(p_mb*c2)
    c4 = p_b*p_b*(0.08333333333333333*p_mb) + p_mb*(c2*c2)
    c5 = 0.5*p_c
    c6 = p_c*p_c*(0.08333333333333333*p_mc) + p_mc*(c5*c5)
    q_crank = y[0]
    q_coupler = y[1]
    x0 = c3*(cos(q_crank)*cos(q_coupler)) + c3*(sin(q_crank)*sin(q_coupler))
    out[0] = c1
    out[1] = x0
    out[3] = x0
    out[4] = c4
    out[8] = c6


@njit(error_model="numpy")
def forces(t, y, p, out):
    """Forces f of M a = f + G^T lambda. 62 operations."""
    p_a = p[0]
    p_b = p[1]
    p_c = p[2]
    p_ma = p[4]
    p_mb = p[5]
    p_mc = p[6]
    p_g = p[7]
    c0 = p_mb*p_g
    c1 = p_a*(c0 + 0.5*(p_ma*p_g))
    c2 = 0.5*p_b
    c3 = p_a*(p_mb*c2)
    c4 = c2*c0
    c5 = 0.5*p_c*(p_mc*p_g)
    q_crank = y[0]
    q_coupler = y[1]
    q_rocker = y[2]
    v_crank = y[3]
    v_coupler = y[4]
    x0 = cos(q_crank)
    x1 = sin(q_coupler)
    x2 = 0.5*v_coupler
    x3 = 0.5*v_crank
    x4 = c3*(v_crank*x2 + v_coupler*x3)
    x5 = sin(q_crank)
    x6 = cos(q_coupler)
    x7 = c3*(v_crank*x0*x1 + x5*(v_coupler*x6)) - c3*(v_crank*x5*x6 + x0*(v_coupler*x1))
    x8 = -(x0*(c1 - x1*x4) + x5*(x6*x4) + (0.5*(v_coupler*x7) + x2*x7))
    out[0] = x8
    out[1] = -(x6*(c4 - x5*x4) + x1*(x0*x4) + (0.5*(v_crank*x7) + x3*x7))
    out[2] = -(cos(q_rocker)*c5)


@njit(error_model="numpy")
def energy(t, y, p, out):
    """Kinetic and potential energy. 76 operations."""
    p_a = p[0]
    p_b = p[1]
    p_c = p[2]
    p_ma = p[4]
    p_mb = p[5]
    p_mc = p[6]
    p_g = p[7]
    c0 = 0.5*p_mc
    c1 = 0.5*p_c
    c2 = 0.5*p_mb
    c3 = 0.5*p_b
    c4 = 0.5*p_ma
    c5 = 0.5*p_a
    c6 = 0.5*(p_a*p_a*(0.08333333333333333*p_ma))
    c7 = 0.5*(p_b*p_b*(0.08333333333333333*p_mb))
    c8 = 0.5*(p_c*p_c*(0.08333333333333333*p_mc))
    c9 = p_ma*(p_g*c5)
    c10 = p_mb*p_g
    c11 = p_mc*(p_g*c1)
    q_crank = y[0]
    q_coupler = y[1]
    q_rocker = y[2]
    v_crank = y[3]
    v_coupler = y[4]
    v_rocker = y[5]
    x0 = sin(q_rocker)
    x1 = c1*(v_rocker*x0)
    x2 = c1*(v_rocker*cos(q_rocker))
    x3 = sin(q_crank)
    x4 = v_crank*x3
    x5 = sin(q_coupler)
    x6 = p_a*x4 + c3*(v_coupler*x5)
    x7 = v_crank*cos(q_crank)
    x8 = p_a*x7 + c3*(v_coupler*cos(q_coupler))
    x9 = x4*c5
    x10 = x7*c5
    x11 = c2*(x6*x6 + x8*x8) + (c4*(x9*x9 + x10*x10) + c6*(v_crank*v_crank))
    x12 = c0*(x1*x1 + x2*x2) + (x11 + c7*(v_coupler*v_coupler)) + c8*(v_rocker*v_rocker)
    out[0] = x12
    out[1] = x3*c9 + (p_a*x3 + c3*x5)*c10 + x0*c11


@njit(error_model="numpy")
def residual(t, y, p, out):
    """M a - f - G^T lambda, then G a - gamma. 156 operations."""
    p_a = p[0]
    p_b = p[1]
    p_c = p[2]
    p_ma = p[4]
    p_mb = p[5]
    p_mc = p[6]
    p_g = p[7]
    c0 = p_mb*p_g
    c1 = p_a*(c0 + 0.5*(p_ma*p_g))
    c2 = 0.5*p_b
    c3 = p_a*(p_mb*c2)
    c4 = p_a*p_a
    c5 = c4*(0.08333333333333333*p_ma) + c4*(p_mb + 0.25*p_ma)
    c6 = 0.5*c5
    c7 = c2*c0
    c8 = p_b*p_b*(0.08333333333333333*p_mb) + p_mb*(c2*c2)
    c9 = 0.5*c8
    c10 = 0.5*p_c
    c11 = c10*(p_mc*p_g)
    c12 = 0.5*(p_c*p_c*(0.08333333333333333*p_mc) + p_mc*(c10*c10))
    q_crank = y[0]
    q_coupler = y[1]
    q_rocker = y[2]
    v_crank = y[3]
    v_coupler = y[4]
    v_rocker = y[5]
    a_crank = y[6]
    a_coupler = y[7]
    a_rocker = y[8]
    lam_loop_x = y[9]
    lam_loop_y = y[10]
    x0 = cos(q_crank)
    x1 = sin(q_coupler)
    x2 = 0.5*v_coupler
    x3 = 0.5*v_crank
    x4 = c3*(v_crank*x2 + v_coupler*x3)
    x5 = sin(q_crank)
    x6 = cos(q_coupler)
    x7 = v_crank*x0
    x8 = v_coupler*x6
    x9 = v_crank*x5
    x10 = v_coupler*x1
    x11 = c3*(x7*x1 + x5*x8) - c3*(x9*x6 + x0*x10)
    x12 = c3*(x0*x6) + c3*(x5*x1)
    x13 = 0.5*(a_crank*c5 + (v_coupler*x11 + a_coupler*x12)) + (x2*x11 + x12*(0.5*a_coupler))
    x14 = x0*(c1 - x1*x4) + x5*(x6*x4) + (x13 + a_crank*c6) - (p_a*(lam_loop_y*x0) - p_a*(lam_loop_x*x5))
    x15 = 0.5*(v_crank*x11 + a_crank*x12 + a_coupler*c8) + a_coupler*c9
    x16 = x6*(c7 - x5*x4) + x1*(x0*x4) + (x3*x11 + x12*(0.5*a_crank) + x15)
    x17 = cos(q_rocker)
    x18 = a_rocker*c12
    x19 = sin(q_rocker)
    x20 = x17*c11 + (x18 + x18) - (p_c*(lam_loop_x*x19) - p_c*(lam_loop_y*x17))
    x21 = p_a*(v_crank*x7 + a_crank*x5) + p_b*(v_coupler*x8 + a_coupler*x1)
    x22 = p_a*(a_crank*x0 - v_crank*x9) + p_b*(a_coupler*x6 - v_coupler*x10)
    out[0] = x14
    out[1] = x16 - (p_b*(lam_loop_y*x6) - p_b*(lam_loop_x*x1))
    out[2] = x20
    out[3] = p_c*(v_rocker*(v_rocker*x17) + a_rocker*x19) - x21
    out[4] = x22 - p_c*(a_rocker*x17 - v_rocker*(v_rocker*x19))


@njit(error_model="numpy")
def residual_jacobian(t, y, p, out):
    """Residual derivatives by q, v, a, lambda. 235 operations."""
    p_a = p[0]
    p_b = p[1]
    p_c = p[2]
    p_ma = p[4]
    p_mb = p[5]
    p_mc = p[6]
    p_g = p[7]
    c0 = 0.5*p_b
    c1 = p_a*(p_mb*c0)
    c2 = p_mb*p_g
    c3 = p_a*(c2 + 0.5*(p_ma*p_g))
    c4 = p_a*p_a
    c5 = c4*(0.08333333333333333*p_ma) + c4*(p_mb + 0.25*p_ma)
    c6 = c0*c2
    c7 = p_b*p_b*(0.08333333333333333*p_mb) + p_mb*(c0*c0)
    c8 = 0.5*p_c
    c9 = c8*(p_mc*p_g)
    c10 = p_c*p_c*(0.08333333333333333*p_mc) + p_mc*(c8*c8)
    q_crank = y[0]
    q_coupler = y[1]
    q_rocker = y[2]
    v_crank = y[3]
    v_coupler = y[4]
    v_rocker = y[5]
    a_crank = y[6]
    a_coupler = y[7]
    a_rocker = y[8]
    lam_loop_x = y[9]
    lam_loop_y = y[10]
    x0 = cos(q_crank)
    x1 = cos(q_coupler)
    x2 = 0.5*v_coupler
    x3 = 0.5*v_crank
    x4 = c1*(v_crank*x2 + v_coupler*x3)
    x5 = x0*(x1*x4)
    x6 = sin(q_crank)
    x7 = sin(q_coupler)
    x8 = x7*x4
    x9 = v_coupler*x1
    x10 = v_crank*x6
    x11 = v_crank*x0
    x12 = v_coupler*x7
    x13 = c1*(x0*x9 - x10*x7) - c1*(x11*x1 - x6*x12)
    x14 = c1*(x0*x7) - c1*(x6*x1)
    x15 = a_coupler*x14
    x16 = 0.5*(v_coupler*x13 + x15) + (x2*x13 + 0.5*x15)
    x17 = x5 - x6*(c3 - x8) + x16 + (p_a*(lam_loop_y*x6) + p_a*(lam_loop_x*x0))
    x18 = c1*(x2 + x2)
    x19 = x2*x14
    x20 = v_coupler*x14
    x21 = c1*(x3 + x3)
    x22 = c1*(x11*x7 + x6*x9) - c1*(x10*x1 + x0*x12)
    x23 = 0.5*x22
    x24 = c1*(x0*x1) + c1*(x6*x7)
    x25 = p_a*x6
    x26 = p_a*x0
    x27 = a_crank*x14
    x28 = 0.5*(v_crank*x13 + x27) + (x3*x13 + 0.5*x27)
    x29 = x1*(x0*x4)
    x30 = x6*x4
    x31 = x29 - x7*(c6 - x30) - x28 + (p_b*(lam_loop_y*x7) + p_b*(lam_loop_x*x1))
    x32 = x3*x14
    x33 = v_crank*x14
    x34 = p_b*x7
    x35 = p_b*x1
    x36 = sin(q_rocker)
    x37 = cos(q_rocker)
    x38 = p_c*x36
    x39 = p_c*x37
    x40 = v_rocker*x36
    x41 = v_rocker*x37
    out[0] = x17
    out[1] = -(x5 + x6*x8 + x16)
    out[3] = x6*(x1*x18) - x0*(x7*x18) + (x19 + 0.5*x20)
    out[4] = x6*(x1*x21) - x0*(x7*x21) + (x23 - x19 + 0.5*(x22 - x20))
    out[6] = c5
    out[7] = x24
    out[9] = x25
    out[10] = -x26
    out[11] = x28 - (x29 + x7*x30)
    out[12] = x31
    out[14] = x7*(x0*x18) - x1*(x6*x18) + (x23 + x32 + 0.5*(x22 + x33))
    out[15] = x7*(x0*x21) - x1*(x6*x21) - (x32 + 0.5*x33)
    out[17] = x24
    out[18] = c7
    out[20] = x34
    out[21] = -x35
    out[24] = -(x36*c9 + (p_c*(lam_loop_y*x36) + p_c*(lam_loop_x*x37)))
    out[30] = c10
    out[31] = -x38
    out[32] = x39
    out[33] = -(p_a*(a_crank*x0 - v_crank*x10))
    out[34] = -(p_b*(a_coupler*x1 - v_coupler*x12))
    out[35] = p_c*(a_rocker*x37 - v_rocker*x40)
    out[36] = -(p_a*(x11 + x11))
    out[37] = -(p_b*(x9 + x9))
    out[38] = p_c*(x41 + x41)
    out[39] = -x25
    out[40] = -x34
    out[41] = x38
    out[44] = -(p_a*(v_crank*x11 + a_crank*x6))
    out[45] = -(p_b*(v_coupler*x9 + a_coupler*x7))
    out[46] = p_c*(v_rocker*x41 + a_rocker*x36)
    out[47] = -(p_a*(x10 + x10))
    out[48] = -(p_b*(x12 + x12))
    out[49] = p_c*(x40 + x40)
    out[50] = x26
    out[51] = x35
    out[52] = -x39


@njit(error_model="numpy")
def constraint_residual(t, y, p, out):
    """Position residuals, velocity residuals. 33 operations."""
    p_a = p[0]
    p_b = p[1]
    p_c = p[2]
    p_d = p[3]
    q_crank = y[0]
    q_coupler = y[1]
    q_rocker = y[2]
    v_crank = y[3]
    v_coupler = y[4]
    v_rocker = y[5]
    x0 = cos(q_coupler)
    x1 = cos(q_crank)
    x2 = cos(q_rocker)
    x3 = sin(q_crank)
    x4 = sin(q_coupler)
    x5 = sin(q_rocker)
    out[0] = p_b*x0 + (p_a*x1 - p_d) - p_c*x2
    out[1] = p_a*x3 + p_b*x4 - p_c*x5
    out[2] = p_c*(v_rocker*x5) - (p_a*(v_crank*x3) + p_b*(v_coupler*x4))
    out[3] = p_a*(v_crank*x1) + p_b*(v_coupler*x0) - p_c*(v_rocker*x2)


@njit(error_model="numpy")
def constraint_jacobian(t, y, p, out):
    """Constraint Jacobian G, row by row. 15 operations."""
    p_a = p[0]
    p_b = p[1]
    p_c = p[2]
    q_crank = y[0]
    q_coupler = y[1]
    q_rocker = y[2]
    out[0] = -(p_a*sin(q_crank))
    out[1] = -(p_b*sin(q_coupler))
    out[2] = p_c*sin(q_rocker)
    out[3] = p_a*cos(q_crank)
    out[4] = p_b*cos(q_coupler)
    out[5] = -(p_c*cos(q_rocker))


@njit(error_model="numpy")
def gamma(t, y, p, out):
    """Right-hand side of G a = gamma. 30 operations."""
    p_a = p[0]
    p_b = p[1]
    p_c = p[2]
    q_crank = y[0]
    q_coupler = y[1]
    q_rocker = y[2]
    v_crank = y[3]
    v_coupler = y[4]
    v_rocker = y[5]
    x0 = p_a*(v_crank*(v_crank*cos(q_crank))) + p_b*(v_coupler*(v_coupler*cos(q_coupler)))
    x1 = p_a*(v_crank*(v_crank*sin(q_crank))) + p_b*(v_coupler*(v_coupler*sin(q_coupler)))
    out[0] = -(p_c*(v_rocker*(v_rocker*cos(q_rocker))) - x0)
    out[1] = -(p_c*(v_rocker*(v_rocker*sin(q_rocker))) - x1)


@njit(error_model="numpy")
def project(t, y, p, out):
    """State moved onto the constraints, and the residuals it had. 145 operations."""
    p_a = p[0]
    p_b = p[1]
    p_c = p[2]
    p_d = p[3]
    p_ma = p[4]
    p_mb = p[5]
    p_mc = p[6]
    c0 = p_a*p_a
    c1 = 1.0/(c0*(0.08333333333333333*p_ma) + c0*(p_mb + 0.25*p_ma))
    c2 = p_a*c1
    c3 = 0.5*p_b
    c4 = p_a*(p_mb*c3)
    c5 = p_b*p_b*(0.08333333333333333*p_mb) + p_mb*(c3*c3)
    c6 = 0.5*p_c
    c7 = p_c*(1.0/(p_c*p_c*(0.08333333333333333*p_mc) + p_mc*(c6*c6)))
    q_crank = y[0]
    q_coupler = y[1]
    q_rocker = y[2]
    v_crank = y[3]
    v_coupler = y[4]
    v_rocker = y[5]
    x0 = sin(q_crank)
    x1 = x0*c2
    x2 = cos(q_coupler)
    x3 = p_b*x2
    x4 = cos(q_crank)
    x5 = p_a*x4
    x6 = cos(q_rocker)
    x7 = p_c*x6
    x8 = x3 + (x5 - p_d) - x7
    x9 = p_a*x0
    x10 = sin(q_coupler)
    x11 = c4*(x4*x2) + c4*(x0*x10)
    x12 = x11*c1
    x13 = p_b*x10
    x14 = x9*x12 - x13
    x15 = 1.0/(c5 - x11*x12)
    x16 = x14*x15
    x17 = sin(q_rocker)
    x18 = p_c*x17
    x19 = x17*c7
    x20 = 1.0/(x14*x16 + (x18*x19 + x9*x1))
    x21 = x3 - x5*x12
    x22 = x7*x19 + x5*x1 - x21*x16
    x23 = x22*x20
    x24 = x21*x15
    x25 = x6*c7
    x26 = x4*c2
    x27 = 1.0/(x22*x23 - (x21*x24 + (x7*x25 + x5*x26)))
    x28 = x9 + x13 - x18
    x29 = x27*(x28 + x8*x23)
    x30 = x8*x20 - x23*x29
    x31 = x24*x29 - x16*x30
    x32 = q_crank + (x1*x30 - x12*x31 + x26*x29)
    x33 = q_coupler + x31
    x34 = q_rocker - (x19*x30 + x25*x29)
    x35 = p_c*(v_rocker*sin(x34)) - (p_a*(v_crank*sin(x32)) + p_b*(v_coupler*sin(x33)))
    x36 = p_a*(v_crank*cos(x32)) + p_b*(v_coupler*cos(x33)) - p_c*(v_rocker*cos(x34))
    x37 = x27*(x36 + x23*x35)
    x38 = x20*x35 - x23*x37
    x39 = x24*x37 - x16*x38
    out[0] = x32
    out[1] = x33
    out[2] = x34
    out[3] = v_crank + (x1*x38 - x12*x39 + x26*x37)
    out[4] = v_coupler + x39
    out[5] = v_rocker - (x19*x38 + x25*x37)
    out[6] = x8
    out[7] = x28
    out[8] = x35
    out[9] = x36


@njit(error_model="numpy")
def poses(t, y, p, out):
    """Per body: position, rotation matrix (body to world). 23 operations."""
    p_a = p[0]
    p_b = p[1]
    p_c = p[2]
    p_d = p[3]
    c0 = 0.5*p_a
    c1 = 0.5*p_b
    c2 = 0.5*p_c
    q_crank = y[0]
    q_coupler = y[1]
    q_rocker = y[2]
    x0 = cos(q_crank)
    x1 = sin(q_crank)
    x2 = cos(q_coupler)
    x3 = sin(q_coupler)
    x4 = cos(q_rocker)
    x5 = sin(q_rocker)
    out[0] = x0*c0
    out[1] = x1*c0
    out[2] = 0.0
    out[3] = x0
    out[4] = -x1
    out[5] = 0.0
    out[6] = x1
    out[7] = x0
    out[8] = 0.0
    out[9] = 0.0
    out[10] = 0.0
    out[11] = 1.0
    out[12] = p_a*x0 + x2*c1
    out[13] = p_a*x1 + c1*x3
    out[14] = 0.0
    out[15] = x2
    out[16] = -x3
    out[17] = 0.0
    out[18] = x3
    out[19] = x2
    out[20] = 0.0
    out[21] = 0.0
    out[22] = 0.0
    out[23] = 1.0
    out[24] = p_d + x4*c2
    out[25] = c2*x5
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
    """Sizes of the bodies' shapes. 0 operations."""
    p_a = p[0]
    p_b = p[1]
    p_c = p[2]
    out[0] = 0.01
    out[1] = p_a
    out[2] = 0.01
    out[3] = p_b
    out[4] = 0.01
    out[5] = p_c


@njit(error_model="numpy")
def outputs(t, y, p, out):
    """Outputs. 0 operations."""
    v_rocker = y[5]
    out[0] = v_rocker


@njit(error_model="numpy")
def marks(t, y, p, out):
    """What a picture shows besides bodies, as `marks` lists it. 5 operations."""
    p_a = p[0]
    p_b = p[1]
    p_c = p[2]
    p_d = p[3]
    c0 = 0.5*p_a
    c1 = -c0
    c2 = 0.5*p_b
    c3 = -(0.5*p_c)
    out[0] = c1
    out[5] = 1.0
    out[9] = c0
    out[14] = 1.0
    out[15] = c2
    out[20] = 1.0
    out[21] = c2
    out[24] = c3
    out[29] = 1.0
    out[30] = p_d


@njit(error_model="numpy")
def limits(t, y, p, out):
    """Numbers of parameters that have a bound. 9 operations."""
    p_a = p[0]
    p_b = p[1]
    p_c = p[2]
    p_ma = p[4]
    p_mb = p[5]
    p_mc = p[6]
    c0 = p_a*p_a*(0.08333333333333333*p_ma)
    c1 = p_b*p_b*(0.08333333333333333*p_mb)
    c2 = p_c*p_c*(0.08333333333333333*p_mc)
    out[0] = p_a
    out[1] = p_ma
    out[2] = c0
    out[3] = p_b
    out[4] = p_mb
    out[5] = c1
    out[6] = p_c
    out[7] = p_mc
    out[8] = c2
