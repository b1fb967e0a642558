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
        "rhs": 192,
        "mass_matrix": 33,
        "forces": 70,
        "energy": 75,
        "residual": 162,
        "residual_jacobian": 245,
        "constraint_residual": 33,
        "constraint_jacobian": 15,
        "gamma": 30,
        "project": 144,
        "poses": 22,
        "shapes": 0,
        "outputs": 0,
    },
    "run": {
        "t_end": 10.0,
        "fps": 100.0,
    },
}

@njit(error_model="numpy")
def rhs(t, y, p, out):
    """State derivative: rates, accelerations, multipliers, pivot ratio. 192 operations."""
    q_crank = y[0]
    q_coupler = y[1]
    q_rocker = y[2]
    v_crank = y[3]
    v_coupler = y[4]
    v_rocker = y[5]
    p_a = p[0]
    p_b = p[1]
    p_c = p[2]
    p_ma = p[4]
    p_mb = p[5]
    p_mc = p[6]
    p_g = p[7]
    x0 = sin(q_crank)
    x1 = p_a*x0
    x2 = p_a*p_a
    x3 = 1.0/(x2*(0.08333333333333333*p_ma) + x2*(p_mb + 0.25*p_ma))
    x4 = x1*x3
    x5 = cos(q_rocker)
    x6 = p_c*x5
    x7 = sin(q_rocker)
    x8 = p_c*x7
    x9 = 0.5*p_c
    x10 = 1.0/(p_c*p_c*(0.08333333333333333*p_mc) + p_mc*(x9*x9))
    x11 = x8*x10
    x12 = cos(q_crank)
    x13 = p_a*x12
    x14 = cos(q_coupler)
    x15 = 0.5*p_b
    x16 = p_mb*x15
    x17 = p_a*(x14*x16)
    x18 = sin(q_coupler)
    x19 = p_a*(x18*x16)
    x20 = x12*x17 + x0*x19
    x21 = x20*x3
    x22 = p_b*x14 - x13*x21
    x23 = x1*x21 - p_b*x18
    x24 = p_b*p_b*(0.08333333333333333*p_mb) + p_mb*(x15*x15) - x20*x21
    x25 = 1.0/x24
    x26 = x23*x25
    x27 = x6*x11 + x13*x4 - x22*x26
    x28 = 1.0/(x8*x11 + x1*x4 + x23*x26)
    x29 = x27*x28
    x30 = x6*x10
    x31 = x13*x3
    x32 = x22*x25
    x33 = x6*x30 + x13*x31 + x22*x32
    x34 = x27*x29 - x33
    x35 = p_mb*p_g
    x36 = 0.5*v_coupler
    x37 = 0.5*v_crank
    x38 = v_crank*x36 + v_coupler*x37
    x39 = v_crank*x12
    x40 = v_coupler*x14
    x41 = v_crank*x0
    x42 = v_coupler*x18
    x43 = x39*x19 + x0*(p_a*(x40*x16)) - (x41*x17 + x12*(p_a*(x42*x16)))
    x44 = x12*(p_a*(x35 + 0.5*(p_ma*p_g)) - x19*x38) + x0*(x17*x38) + (0.5*(v_coupler*x43) + x36*x43)
    x45 = p_c*(v_rocker*(v_rocker*x7)) - (p_a*(v_crank*x41) + p_b*(v_coupler*x42))
    x46 = x5*(x9*(p_mc*p_g))
    x47 = x14*(x15*x35 - x16*(p_a*(x0*x38))) + x18*(x16*(p_a*(x12*x38)))
    x48 = x44*x21 - (x47 + (0.5*(v_crank*x43) + x37*x43))
    x49 = p_c*(v_rocker*(v_rocker*x5)) - (p_a*(v_crank*x39) + p_b*(v_coupler*x40))
    x50 = x46*x11 - x49 - x44*x4 - x26*x48
    x51 = 1.0/x34*(x44*x31 - (x45 + x46*x30) - x32*x48 + x29*x50)
    x52 = x29*x51 - x28*x50
    x53 = x25*x48 - x26*x52 - x32*x51
    x54 = -(x34/x33)
    out[0] = v_crank
    out[1] = v_coupler
    out[2] = v_rocker
    out[3] = x4*x52 - (x44*x3 + x21*x53) - x31*x51
    out[4] = x53
    out[5] = x30*x51 - (x46*x10 + x11*x52)
    out[6] = -x52
    out[7] = -x51
    out[8] = (x54 if x54 < 1.0 else 1.0)


@njit(error_model="numpy")
def mass_matrix(t, y, p, out):
    """Mass matrix M, row by row. 33 operations."""
    q_crank = y[0]
    q_coupler = y[1]
    p_a = p[0]
    p_b = p[1]
    p_c = p[2]
    p_ma = p[4]
    p_mb = p[5]
    p_mc = p[6]
    x0 = p_a*p_a
    x1 = 0.5*p_b
    x2 = p_mb*x1
    x3 = cos(q_crank)*(p_a*(cos(q_coupler)*x2)) + sin(q_crank)*(p_a*(sin(q_coupler)*x2))
    x4 = 0.5*p_c
    out[0] = x0*(0.08333333333333333*p_ma) + x0*(p_mb + 0.25*p_ma)
    out[1] = x3
    out[3] = x3
    out[4] = p_b*p_b*(0.08333333333333333*p_mb) + p_mb*(x1*x1)
    out[8] = p_c*p_c*(0.08333333333333333*p_mc) + p_mc*(x4*x4)


@njit(error_model="numpy")
def forces(t, y, p, out):
    """Forces f of M a = f + G^T lambda. 70 operations."""
    q_crank = y[0]
    q_coupler = y[1]
    q_rocker = y[2]
    v_crank = y[3]
    v_coupler = y[4]
    p_a = p[0]
    p_b = p[1]
    p_c = p[2]
    p_ma = p[4]
    p_mb = p[5]
    p_mc = p[6]
    p_g = p[7]
    x0 = cos(q_crank)
    x1 = p_mb*p_g
    x2 = sin(q_coupler)
    x3 = 0.5*p_b
    x4 = p_mb*x3
    x5 = p_a*(x2*x4)
    x6 = 0.5*v_coupler
    x7 = 0.5*v_crank
    x8 = v_crank*x6 + v_coupler*x7
    x9 = sin(q_crank)
    x10 = cos(q_coupler)
    x11 = p_a*(x10*x4)
    x12 = v_crank*x0*x5 + x9*(p_a*(v_coupler*x10*x4)) - (v_crank*x9*x11 + x0*(p_a*(v_coupler*x2*x4)))
    x13 = x0*(p_a*(x1 + 0.5*(p_ma*p_g)) - x5*x8) + x9*(x11*x8) + (0.5*(v_coupler*x12) + x6*x12)
    x14 = x10*(x3*x1 - x4*(p_a*(x9*x8))) + x2*(x4*(p_a*(x0*x8))) + (0.5*(v_crank*x12) + x7*x12)
    out[0] = -x13
    out[1] = -x14
    out[2] = -(cos(q_rocker)*(0.5*p_c*(p_mc*p_g)))


@njit(error_model="numpy")
def energy(t, y, p, out):
    """Kinetic and potential energy. 75 operations."""
    q_crank = y[0]
    q_coupler = y[1]
    q_rocker = y[2]
    v_crank = y[3]
    v_coupler = y[4]
    v_rocker = y[5]
    p_a = p[0]
    p_b = p[1]
    p_c = p[2]
    p_ma = p[4]
    p_mb = p[5]
    p_mc = p[6]
    p_g = p[7]
    x0 = sin(q_crank)
    x1 = p_a*(v_crank*x0)
    x2 = 0.5*x1
    x3 = p_a*(v_crank*cos(q_crank))
    x4 = 0.5*x3
    x5 = 0.5*p_ma*(x2*x2 + x4*x4) + 0.5*(v_crank*(v_crank*(p_a*p_a*(0.08333333333333333*p_ma))))
    x6 = 0.5*p_b
    x7 = sin(q_coupler)
    x8 = x1 + x6*(v_coupler*x7)
    x9 = x3 + x6*(v_coupler*cos(q_coupler))
    x10 = 0.5*(v_coupler*(v_coupler*(p_b*p_b*(0.08333333333333333*p_mb))))
    x11 = 0.5*p_c
    x12 = sin(q_rocker)
    x13 = x11*(v_rocker*x12)
    x14 = x11*(v_rocker*cos(q_rocker))
    x15 = x5 + 0.5*p_mb*(x8*x8 + x9*x9) + x10 + 0.5*p_mc*(x13*x13 + x14*x14)
    x16 = 0.5*(v_rocker*(v_rocker*(p_c*p_c*(0.08333333333333333*p_mc))))
    x17 = p_a*x0
    x18 = p_ma*(p_g*(0.5*x17)) + p_mb*(p_g*(x17 + x6*x7)) + p_mc*(p_g*(x11*x12))
    out[0] = x15 + x16
    out[1] = x18


@njit(error_model="numpy")
def residual(t, y, p, out):
    """M a - f - G^T lambda, then G a - gamma. 162 operations."""
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
    p_a = p[0]
    p_b = p[1]
    p_c = p[2]
    p_ma = p[4]
    p_mb = p[5]
    p_mc = p[6]
    p_g = p[7]
    x0 = cos(q_crank)
    x1 = p_mb*p_g
    x2 = sin(q_coupler)
    x3 = 0.5*p_b
    x4 = p_mb*x3
    x5 = p_a*(x2*x4)
    x6 = 0.5*v_coupler
    x7 = 0.5*v_crank
    x8 = v_crank*x6 + v_coupler*x7
    x9 = sin(q_crank)
    x10 = cos(q_coupler)
    x11 = p_a*(x10*x4)
    x12 = p_a*p_a
    x13 = x12*(0.08333333333333333*p_ma) + x12*(p_mb + 0.25*p_ma)
    x14 = v_crank*x0
    x15 = v_coupler*x10
    x16 = v_crank*x9
    x17 = v_coupler*x2
    x18 = x14*x5 + x9*(p_a*(x15*x4)) - (x16*x11 + x0*(p_a*(x17*x4)))
    x19 = x0*x11 + x9*x5
    x20 = 0.5*a_coupler
    x21 = 0.5*(a_crank*x13 + (v_coupler*x18 + a_coupler*x19)) + (x6*x18 + x19*x20)
    x22 = 0.5*a_crank
    x23 = x0*(p_a*(x1 + 0.5*(p_ma*p_g)) - x5*x8) + x9*(x11*x8) + (x21 + x13*x22)
    x24 = p_b*p_b*(0.08333333333333333*p_mb) + p_mb*(x3*x3)
    x25 = x7*x18 + x19*x22 + (0.5*(v_crank*x18 + a_crank*x19 + a_coupler*x24) + x24*x20)
    x26 = x10*(x3*x1 - x4*(p_a*(x9*x8))) + x2*(x4*(p_a*(x0*x8))) + x25 - (x10*(lam_loop_y*p_b) - x2*(lam_loop_x*p_b))
    x27 = cos(q_rocker)
    x28 = 0.5*p_c
    x29 = p_c*p_c*(0.08333333333333333*p_mc) + p_mc*(x28*x28)
    x30 = x27*(x28*(p_mc*p_g)) + (0.5*(a_rocker*x29) + x29*(0.5*a_rocker))
    x31 = sin(q_rocker)
    x32 = p_a*(v_crank*x14 + a_crank*x9) + p_b*(v_coupler*x15 + a_coupler*x2)
    x33 = p_a*(a_crank*x0 - v_crank*x16) + p_b*(a_coupler*x10 - v_coupler*x17)
    out[0] = x23 - (x0*(lam_loop_y*p_a) - x9*(lam_loop_x*p_a))
    out[1] = x26
    out[2] = x30 - (x31*(lam_loop_x*p_c) - x27*(lam_loop_y*p_c))
    out[3] = p_c*(v_rocker*(v_rocker*x27) + a_rocker*x31) - x32
    out[4] = x33 - p_c*(a_rocker*x27 - v_rocker*(v_rocker*x31))


@njit(error_model="numpy")
def residual_jacobian(t, y, p, out):
    """Residual derivatives by q, v, a, lambda. 245 operations."""
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
    p_a = p[0]
    p_b = p[1]
    p_c = p[2]
    p_ma = p[4]
    p_mb = p[5]
    p_mc = p[6]
    p_g = p[7]
    x0 = cos(q_crank)
    x1 = cos(q_coupler)
    x2 = 0.5*p_b
    x3 = p_mb*x2
    x4 = p_a*(x1*x3)
    x5 = 0.5*v_coupler
    x6 = 0.5*v_crank
    x7 = v_crank*x5 + v_coupler*x6
    x8 = x0*(x4*x7)
    x9 = sin(q_crank)
    x10 = p_mb*p_g
    x11 = sin(q_coupler)
    x12 = p_a*(x11*x3)
    x13 = x12*x7
    x14 = v_coupler*x1
    x15 = p_a*(x14*x3)
    x16 = v_crank*x9
    x17 = v_crank*x0
    x18 = v_coupler*x11
    x19 = p_a*(x18*x3)
    x20 = x0*x15 - x16*x12 - (x17*x4 - x9*x19)
    x21 = x0*x12 - x9*x4
    x22 = 0.5*(v_coupler*x20 + a_coupler*x21) + (x5*x20 + 0.5*a_coupler*x21)
    x23 = x8 - x9*(p_a*(x10 + 0.5*(p_ma*p_g)) - x13) + x22 + (x9*(lam_loop_y*p_a) + x0*(lam_loop_x*p_a))
    x24 = x5 + x5
    x25 = x5*x21
    x26 = v_coupler*x21
    x27 = x6 + x6
    x28 = x17*x12 + x9*x15 - (x16*x4 + x0*x19)
    x29 = 0.5*x28
    x30 = p_a*p_a
    x31 = x0*x4 + x9*x12
    x32 = p_a*x9
    x33 = p_a*x0
    x34 = 0.5*(v_crank*x20 + a_crank*x21) + (x6*x20 + 0.5*a_crank*x21)
    x35 = x1*(x3*(p_a*(x0*x7)))
    x36 = x3*(p_a*(x9*x7))
    x37 = x35 - x11*(x2*x10 - x36) - x34 + (x11*(lam_loop_y*p_b) + x1*(lam_loop_x*p_b))
    x38 = x6*x21
    x39 = v_crank*x21
    x40 = x11*(x3*(p_a*(x0*x24))) - x1*(x3*(p_a*(x9*x24))) + (x29 + x38 + 0.5*(x28 + x39))
    x41 = x11*(x3*(p_a*(x0*x27))) - x1*(x3*(p_a*(x9*x27))) - (x38 + 0.5*x39)
    x42 = p_b*x11
    x43 = p_b*x1
    x44 = sin(q_rocker)
    x45 = 0.5*p_c
    x46 = cos(q_rocker)
    x47 = x44*(x45*(p_mc*p_g)) + (x44*(lam_loop_y*p_c) + x46*(lam_loop_x*p_c))
    x48 = p_c*x44
    x49 = p_c*x46
    x50 = v_rocker*x44
    x51 = v_rocker*x46
    out[0] = x23
    out[1] = -(x8 + x9*x13 + x22)
    out[3] = x9*(x4*x24) - x0*(x12*x24) + (x25 + 0.5*x26)
    out[4] = x9*(x4*x27) - x0*(x12*x27) + (x29 - x25 + 0.5*(x28 - x26))
    out[6] = x30*(0.08333333333333333*p_ma) + x30*(p_mb + 0.25*p_ma)
    out[7] = x31
    out[9] = x32
    out[10] = -x33
    out[11] = x34 - (x35 + x11*x36)
    out[12] = x37
    out[14] = x40
    out[15] = x41
    out[17] = x31
    out[18] = p_b*p_b*(0.08333333333333333*p_mb) + p_mb*(x2*x2)
    out[20] = x42
    out[21] = -x43
    out[24] = -x47
    out[30] = p_c*p_c*(0.08333333333333333*p_mc) + p_mc*(x45*x45)
    out[31] = -x48
    out[32] = x49
    out[33] = -(p_a*(a_crank*x0 - v_crank*x16))
    out[34] = -(p_b*(a_coupler*x1 - v_coupler*x18))
    out[35] = p_c*(a_rocker*x46 - v_rocker*x50)
    out[36] = -(p_a*(x17 + x17))
    out[37] = -(p_b*(x14 + x14))
    out[38] = p_c*(x51 + x51)
    out[39] = -x32
    out[40] = -x42
    out[41] = x48
    out[44] = -(p_a*(v_crank*x17 + a_crank*x9))
    out[45] = -(p_b*(v_coupler*x14 + a_coupler*x11))
    out[46] = p_c*(v_rocker*x51 + a_rocker*x44)
    out[47] = -(p_a*(x16 + x16))
    out[48] = -(p_b*(x18 + x18))
    out[49] = p_c*(x50 + x50)
    out[50] = x33
    out[51] = x43
    out[52] = -x49


@njit(error_model="numpy")
def constraint_residual(t, y, p, out):
    """Position residuals, velocity residuals. 33 operations."""
    q_crank = y[0]
    q_coupler = y[1]
    q_rocker = y[2]
    v_crank = y[3]
    v_coupler = y[4]
    v_rocker = y[5]
    p_a = p[0]
    p_b = p[1]
    p_c = p[2]
    p_d = p[3]
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
    q_crank = y[0]
    q_coupler = y[1]
    q_rocker = y[2]
    p_a = p[0]
    p_b = p[1]
    p_c = p[2]
    out[0] = -(p_a*sin(q_crank))
    out[1] = -(p_b*sin(q_coupler))
    out[2] = p_c*sin(q_rocker)
    out[3] = p_a*cos(q_crank)
    out[4] = p_b*cos(q_coupler)
    out[5] = -(p_c*cos(q_rocker))


@njit(error_model="numpy")
def gamma(t, y, p, out):
    """Right-hand side of G a = gamma. 30 operations."""
    q_crank = y[0]
    q_coupler = y[1]
    q_rocker = y[2]
    v_crank = y[3]
    v_coupler = y[4]
    v_rocker = y[5]
    p_a = p[0]
    p_b = p[1]
    p_c = p[2]
    x0 = p_a*(v_crank*(v_crank*cos(q_crank))) + p_b*(v_coupler*(v_coupler*cos(q_coupler)))
    x1 = p_a*(v_crank*(v_crank*sin(q_crank))) + p_b*(v_coupler*(v_coupler*sin(q_coupler)))
    out[0] = -(p_c*(v_rocker*(v_rocker*cos(q_rocker))) - x0)
    out[1] = -(p_c*(v_rocker*(v_rocker*sin(q_rocker))) - x1)


@njit(error_model="numpy")
def project(t, y, p, out):
    """State moved onto the constraints, and the residuals it had. 144 operations."""
    q_crank = y[0]
    q_coupler = y[1]
    q_rocker = y[2]
    v_crank = y[3]
    v_coupler = y[4]
    v_rocker = y[5]
    p_a = p[0]
    p_b = p[1]
    p_c = p[2]
    p_d = p[3]
    p_ma = p[4]
    p_mb = p[5]
    p_mc = p[6]
    x0 = sin(q_crank)
    x1 = p_a*x0
    x2 = p_a*p_a
    x3 = 1.0/(x2*(0.08333333333333333*p_ma) + x2*(p_mb + 0.25*p_ma))
    x4 = x1*x3
    x5 = cos(q_coupler)
    x6 = p_b*x5
    x7 = cos(q_crank)
    x8 = p_a*x7
    x9 = p_c*cos(q_rocker)
    x10 = x6 + (x8 - p_d) - x9
    x11 = p_c*sin(q_rocker)
    x12 = 0.5*p_c
    x13 = 1.0/(p_c*p_c*(0.08333333333333333*p_mc) + p_mc*(x12*x12))
    x14 = x11*x13
    x15 = 0.5*p_b
    x16 = p_mb*x15
    x17 = sin(q_coupler)
    x18 = x7*(p_a*(x5*x16)) + x0*(p_a*(x17*x16))
    x19 = x18*x3
    x20 = p_b*x17
    x21 = x1*x19 - x20
    x22 = p_b*p_b*(0.08333333333333333*p_mb) + p_mb*(x15*x15) - x18*x19
    x23 = 1.0/x22
    x24 = x21*x23
    x25 = 1.0/(x11*x14 + x1*x4 + x21*x24)
    x26 = x6 - x8*x19
    x27 = x9*x14 + x8*x4 - x26*x24
    x28 = x27*x25
    x29 = x9*x13
    x30 = x8*x3
    x31 = x26*x23
    x32 = 1.0/(x27*x28 - (x9*x29 + x8*x30 + x26*x31))
    x33 = x1 + x20 - x11
    x34 = x32*(x33 + x10*x28)
    x35 = x10*x25 - x28*x34
    x36 = x31*x34 - x24*x35
    x37 = q_crank + (x4*x35 - x19*x36 + x30*x34)
    x38 = q_coupler + x36
    x39 = q_rocker - (x14*x35 + x29*x34)
    x40 = p_c*(v_rocker*sin(x39)) - (p_a*(v_crank*sin(x37)) + p_b*(v_coupler*sin(x38)))
    x41 = p_a*(v_crank*cos(x37)) + p_b*(v_coupler*cos(x38)) - p_c*(v_rocker*cos(x39))
    x42 = x32*(x41 + x28*x40)
    x43 = x25*x40 - x28*x42
    x44 = x31*x42 - x24*x43
    out[0] = x37
    out[1] = x38
    out[2] = x39
    out[3] = v_crank + (x4*x43 - x19*x44 + x30*x42)
    out[4] = v_coupler + x44
    out[5] = v_rocker - (x14*x43 + x29*x42)
    out[6] = x10
    out[7] = x33
    out[8] = x40
    out[9] = x41


@njit(error_model="numpy")
def poses(t, y, p, out):
    """Per body: position, rotation matrix (body to world). 22 operations."""
    q_crank = y[0]
    q_coupler = y[1]
    q_rocker = y[2]
    p_a = p[0]
    p_b = p[1]
    p_c = p[2]
    p_d = p[3]
    x0 = cos(q_crank)
    x1 = p_a*x0
    x2 = sin(q_crank)
    x3 = p_a*x2
    x4 = cos(q_coupler)
    x5 = 0.5*p_b
    x6 = sin(q_coupler)
    x7 = cos(q_rocker)
    x8 = 0.5*p_c
    x9 = sin(q_rocker)
    out[0] = 0.5*x1
    out[1] = 0.5*x3
    out[2] = 0.0
    out[3] = x0
    out[4] = -x2
    out[5] = 0.0
    out[6] = x2
    out[7] = x0
    out[8] = 0.0
    out[9] = 0.0
    out[10] = 0.0
    out[11] = 1.0
    out[12] = x1 + x4*x5
    out[13] = x3 + x5*x6
    out[14] = 0.0
    out[15] = x4
    out[16] = -x6
    out[17] = 0.0
    out[18] = x6
    out[19] = x4
    out[20] = 0.0
    out[21] = 0.0
    out[22] = 0.0
    out[23] = 1.0
    out[24] = p_d + x7*x8
    out[25] = x8*x9
    out[26] = 0.0
    out[27] = x7
    out[28] = -x9
    out[29] = 0.0
    out[30] = x9
    out[31] = x7
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
