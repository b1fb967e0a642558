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
        {"name": "loop_x", "kind": "holonomic"},
        {"name": "loop_y", "kind": "holonomic"},
    ],
    "outputs": [
        {"name": "rocker_speed", "unit": ""},
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
        "rhs": 190,
        "mass_matrix": 32,
        "forces": 65,
        "energy": 76,
        "residual": 157,
        "residual_jacobian": 234,
        "constraint_residual": 33,
        "constraint_jacobian": 15,
        "gamma": 30,
        "project": 145,
        "poses": 23,
        "shapes": 0,
        "outputs": 0,
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
    },
    "run": {
        "t_end": 10.0,
        "fps": 100.0,
    },
    "subsystems": [],
}

@njit(error_model="numpy")
def rhs(t, y, p, out):
    """State derivative: rates, accelerations, multipliers, pivot ratio. 190 operations."""
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
    x9 = x8*c7
    x10 = sin(q_coupler)
    x11 = x10*c7
    x12 = x6*x9 + x0*x11
    x13 = x12*c1
    x14 = p_b*x8 - x7*x13
    x15 = p_a*x0
    x16 = x15*x13 - p_b*x10
    x17 = 1.0/(c8 - x12*x13)
    x18 = x16*x17
    x19 = x3*x5 + x7*x1 - x14*x18
    x20 = 1.0/(x16*x18 + (p_c*x4*x5 + x15*x1))
    x21 = x19*x20
    x22 = x14*x17
    x23 = x2*c5
    x24 = x6*c2
    x25 = x14*x22 + (x3*x23 + x7*x24)
    x26 = x19*x21 - x25
    x27 = 0.5*v_coupler
    x28 = 0.5*v_crank
    x29 = v_crank*x27 + v_coupler*x28
    x30 = v_crank*x6
    x31 = v_coupler*x8
    x32 = v_crank*x0
    x33 = v_coupler*x10
    x34 = x30*x11 + c7*(x0*x31) - (x32*x9 + c7*(x6*x33))
    x35 = x6*(c10 - x11*x29) + x0*(x9*x29) + (0.5*(v_coupler*x34) + x27*x34)
    x36 = p_c*(v_rocker*(v_rocker*x4)) - (p_a*(v_crank*x32) + p_b*(v_coupler*x33))
    x37 = x2*c11
    x38 = x8*(c12 - c7*(x0*x29)) + c7*(x10*(x6*x29)) + (0.5*(v_crank*x34) + x28*x34)
    x39 = x13*x35 - x38
    x40 = p_c*(v_rocker*(v_rocker*x2)) - (p_a*(v_crank*x30) + p_b*(v_coupler*x31))
    x41 = x37*x5 - x40 - x35*x1 - x18*x39
    x42 = 1.0/x26*(x35*x24 - (x36 + x37*x23) - x22*x39 + x21*x41)
    x43 = x21*x42 - x20*x41
    x44 = x17*x39 - x18*x43 - x22*x42
    x45 = -(x26/x25)
    out[0] = v_crank
    out[1] = v_coupler
    out[2] = v_rocker
    out[3] = x1*x43 - (c1*x35 + x13*x44) - x24*x42
    out[4] = x44
    out[5] = x23*x42 - (x2*c13 + x5*x43)
    out[6] = -x43
    out[7] = -x42
    out[8] = (x45 if x45 < 1.0 else 1.0)


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
    """Forces f of M a = f + G^T lambda. 65 operations."""
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
    x2 = x1*c3
    x3 = 0.5*v_coupler
    x4 = 0.5*v_crank
    x5 = v_crank*x3 + v_coupler*x4
    x6 = sin(q_crank)
    x7 = cos(q_coupler)
    x8 = x7*c3
    x9 = v_crank*x0*x2 + c3*(x6*(v_coupler*x7)) - (v_crank*x6*x8 + c3*(x0*(v_coupler*x1)))
    x10 = -(x0*(c1 - x2*x5) + x6*(x8*x5) + (0.5*(v_coupler*x9) + x3*x9))
    x11 = x7*(c4 - c3*(x6*x5)) + c3*(x1*(x0*x5)) + (0.5*(v_crank*x9) + x4*x9)
    out[0] = x10
    out[1] = -x11
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
    """M a - f - G^T lambda, then G a - gamma. 157 operations."""
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
    x2 = x1*c3
    x3 = 0.5*v_coupler
    x4 = 0.5*v_crank
    x5 = v_crank*x3 + v_coupler*x4
    x6 = sin(q_crank)
    x7 = cos(q_coupler)
    x8 = x7*c3
    x9 = v_crank*x0
    x10 = v_coupler*x7
    x11 = v_crank*x6
    x12 = v_coupler*x1
    x13 = x9*x2 + c3*(x6*x10) - (x11*x8 + c3*(x0*x12))
    x14 = x0*x8 + x6*x2
    x15 = 0.5*(a_crank*c5 + (v_coupler*x13 + a_coupler*x14)) + (x3*x13 + x14*(0.5*a_coupler))
    x16 = x0*(c1 - x2*x5) + x6*(x8*x5) + (x15 + a_crank*c6) - (p_a*(lam_loop_y*x0) - p_a*(lam_loop_x*x6))
    x17 = 0.5*(a_coupler*c8 + (v_crank*x13 + a_crank*x14)) + a_coupler*c9
    x18 = x7*(c7 - c3*(x6*x5)) + c3*(x1*(x0*x5)) + (x4*x13 + x14*(0.5*a_crank) + x17)
    x19 = cos(q_rocker)
    x20 = a_rocker*c12
    x21 = sin(q_rocker)
    x22 = x19*c11 + (x20 + x20) - (p_c*(lam_loop_x*x21) - p_c*(lam_loop_y*x19))
    x23 = p_a*(v_crank*x9 + a_crank*x6) + p_b*(v_coupler*x10 + a_coupler*x1)
    x24 = p_a*(a_crank*x0 - v_crank*x11) + p_b*(a_coupler*x7 - v_coupler*x12)
    out[0] = x16
    out[1] = x18 - (p_b*(lam_loop_y*x7) - p_b*(lam_loop_x*x1))
    out[2] = x22
    out[3] = p_c*(v_rocker*(v_rocker*x19) + a_rocker*x21) - x23
    out[4] = x24 - p_c*(a_rocker*x19 - v_rocker*(v_rocker*x21))


@njit(error_model="numpy")
def residual_jacobian(t, y, p, out):
    """Residual derivatives by q, v, a, lambda. 234 operations."""
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
    x2 = x1*c1
    x3 = 0.5*v_coupler
    x4 = 0.5*v_crank
    x5 = v_crank*x3 + v_coupler*x4
    x6 = x0*(x2*x5)
    x7 = sin(q_crank)
    x8 = sin(q_coupler)
    x9 = x8*c1
    x10 = x9*x5
    x11 = v_coupler*x1
    x12 = x11*c1
    x13 = v_crank*x7
    x14 = v_crank*x0
    x15 = v_coupler*x8
    x16 = x15*c1
    x17 = x0*x12 - x13*x9 - (x14*x2 - x7*x16)
    x18 = x0*x9 - x7*x2
    x19 = a_coupler*x18
    x20 = 0.5*(v_coupler*x17 + x19) + (x3*x17 + 0.5*x19)
    x21 = x6 - x7*(c3 - x10) + x20 + (p_a*(lam_loop_y*x7) + p_a*(lam_loop_x*x0))
    x22 = x3 + x3
    x23 = x3*x18
    x24 = v_coupler*x18
    x25 = x4 + x4
    x26 = x14*x9 + x7*x12 - (x13*x2 + x0*x16)
    x27 = 0.5*x26
    x28 = x0*x2 + x7*x9
    x29 = p_a*x7
    x30 = p_a*x0
    x31 = a_crank*x18
    x32 = 0.5*(v_crank*x17 + x31) + (x4*x17 + 0.5*x31)
    x33 = c1*(x7*x5)
    x34 = c1*(x1*(x0*x5))
    x35 = x34 - x8*(c6 - x33) - x32 + (p_b*(lam_loop_y*x8) + p_b*(lam_loop_x*x1))
    x36 = x4*x18
    x37 = v_crank*x18
    x38 = x27 + x36 + 0.5*(x26 + x37) + (c1*(x8*(x0*x22)) - c1*(x1*(x7*x22)))
    x39 = p_b*x8
    x40 = p_b*x1
    x41 = sin(q_rocker)
    x42 = cos(q_rocker)
    x43 = p_c*x41
    x44 = p_c*x42
    x45 = v_rocker*x41
    x46 = v_rocker*x42
    out[0] = x21
    out[1] = -(x6 + x7*x10 + x20)
    out[3] = x7*(x2*x22) - x0*(x9*x22) + (x23 + 0.5*x24)
    out[4] = x7*(x2*x25) - x0*(x9*x25) + (x27 - x23 + 0.5*(x26 - x24))
    out[6] = c5
    out[7] = x28
    out[9] = x29
    out[10] = -x30
    out[11] = x32 - (x8*x33 + x34)
    out[12] = x35
    out[14] = x38
    out[15] = c1*(x8*(x0*x25)) - c1*(x1*(x7*x25)) - (x36 + 0.5*x37)
    out[17] = x28
    out[18] = c7
    out[20] = x39
    out[21] = -x40
    out[24] = -(x41*c9 + (p_c*(lam_loop_y*x41) + p_c*(lam_loop_x*x42)))
    out[30] = c10
    out[31] = -x43
    out[32] = x44
    out[33] = -(p_a*(a_crank*x0 - v_crank*x13))
    out[34] = -(p_b*(a_coupler*x1 - v_coupler*x15))
    out[35] = p_c*(a_rocker*x42 - v_rocker*x45)
    out[36] = -(p_a*(x14 + x14))
    out[37] = -(p_b*(x11 + x11))
    out[38] = p_c*(x46 + x46)
    out[39] = -x29
    out[40] = -x39
    out[41] = x43
    out[44] = -(p_a*(v_crank*x14 + a_crank*x7))
    out[45] = -(p_b*(v_coupler*x11 + a_coupler*x8))
    out[46] = p_c*(v_rocker*x46 + a_rocker*x41)
    out[47] = -(p_a*(x13 + x13))
    out[48] = -(p_b*(x15 + x15))
    out[49] = p_c*(x45 + x45)
    out[50] = x30
    out[51] = x40
    out[52] = -x44


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
    c3 = 0.5*p_c
    c4 = p_c*(1.0/(p_c*p_c*(0.08333333333333333*p_mc) + p_mc*(c3*c3)))
    c5 = 0.5*p_b
    c6 = p_a*(p_mb*c5)
    c7 = p_b*p_b*(0.08333333333333333*p_mb) + p_mb*(c5*c5)
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
    x9 = sin(q_rocker)
    x10 = p_c*x9
    x11 = x9*c4
    x12 = p_a*x0
    x13 = sin(q_coupler)
    x14 = c6*(x4*x2) + c6*(x0*x13)
    x15 = c1*x14
    x16 = p_b*x13
    x17 = x12*x15 - x16
    x18 = 1.0/(c7 - x14*x15)
    x19 = x17*x18
    x20 = 1.0/(x10*x11 + x12*x1 + x17*x19)
    x21 = x3 - x5*x15
    x22 = x7*x11 + x5*x1 - x21*x19
    x23 = x22*x20
    x24 = x6*c4
    x25 = x4*c2
    x26 = x21*x18
    x27 = 1.0/(x22*x23 - (x7*x24 + x5*x25 + x21*x26))
    x28 = x12 + x16 - x10
    x29 = x27*(x28 + x8*x23)
    x30 = x8*x20 - x23*x29
    x31 = x26*x29 - x19*x30
    x32 = q_crank + (x1*x30 - x15*x31 + x25*x29)
    x33 = q_coupler + x31
    x34 = q_rocker - (x11*x30 + x24*x29)
    x35 = p_c*(v_rocker*sin(x34)) - (p_a*(v_crank*sin(x32)) + p_b*(v_coupler*sin(x33)))
    x36 = p_a*(v_crank*cos(x32)) + p_b*(v_coupler*cos(x33)) - p_c*(v_rocker*cos(x34))
    x37 = x27*(x36 + x23*x35)
    x38 = x20*x35 - x23*x37
    x39 = x26*x37 - x19*x38
    out[0] = x32
    out[1] = x33
    out[2] = x34
    out[3] = v_crank + (x1*x38 - x15*x39 + x25*x37)
    out[4] = v_coupler + x39
    out[5] = v_rocker - (x11*x38 + x24*x37)
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
