"""block_on_plate: equations of motion, written by symgen 0.1.0. Do not edit.

Block on a plate that shakes in two directions: it slips, turns, and sticks again
"""

from math import cos, fabs, sin, sqrt

from numba import njit

MODEL = {
    "abi": 1,
    "generator": "symgen 0.1.0",
    "source": "sha256:f0a8bb3a92f39f6d5a14138c22369042d6ea41c5ed28dfe2de7a5efba26c3d05",
    "name": "block_on_plate",
    "description": "Block on a plate that shakes in two directions: it slips, turns, and sticks again",
    "nq": 2,
    "nv": 2,
    "nh": 0,
    "nn": 0,
    "nw": 1,
    "coordinates": [
        {"name": "x", "unit": "m", "value": 0.0, "enforced": True},
        {"name": "y", "unit": "m", "value": 0.0, "enforced": True},
    ],
    "quaternions": [],
    "rates": [
        {"name": "x", "unit": "m/s", "value": 0.0, "enforced": False},
        {"name": "y", "unit": "m/s", "value": 0.0, "enforced": False},
    ],
    "parameters": [
        {"name": "m", "unit": "kg", "value": 2.0, "doc": ""},
        {"name": "mu", "unit": "", "value": 0.3, "doc": "coefficient of sliding friction"},
        {"name": "mu_s", "unit": "", "value": 0.4, "doc": "coefficient of static friction"},
        {"name": "ax", "unit": "m", "value": 0.14, "doc": "amplitude of the plate along x"},
        {"name": "ay", "unit": "m", "value": 0.05, "doc": "amplitude of the plate along y"},
        {"name": "wx", "unit": "rad/s", "value": 5.0, "doc": "angular frequency along x"},
        {"name": "wy", "unit": "rad/s", "value": 7.0, "doc": "angular frequency along y"},
        {"name": "g", "unit": "m/s^2", "value": 9.81, "doc": ""},
    ],
    "inputs": [],
    "constants": [],
    "constraints": [],
    "outputs": [
        {"name": "speed", "unit": "m/s"},
    ],
    "events": [
        {"name": "sole_1", "direction": "falling", "action": "friction"},
        {"name": "sole_2", "direction": "falling", "action": "friction"},
    ],
    "bodies": [
        {"name": "block", "planar": False, "shape": "box", "sizes": 3, "mesh": "", "color": "#c23b3b"},
        {"name": "plate", "planar": False, "shape": "box", "sizes": 3, "mesh": "", "color": "#7a8f6a"},
    ],
    "structure": {
        "conservative": False,
        "time_dependent": True,
        "constant_mass": True,
        "diagonal_mass": True,
        "velocity_dependent": True,
        "separable": False,
    },
    "operations": {
        "rhs": 92,
        "mass_matrix": 0,
        "forces": 49,
        "energy": 15,
        "residual": 49,
        "residual_jacobian": 75,
        "poses": 10,
        "shapes": 0,
        "outputs": 4,
        "events": 24,
        "limits": 3,
        "switches": 3,
        "time_terms": 4,
        "closed_rhs": 135,
        "closed_residual": 74,
        "closed_residual_jacobian": 86,
        "closed_constraint_residual": 9,
        "closed_constraint_jacobian": 7,
        "closed_gamma": 0,
        "closed_project": 44,
        "closed_events": 129,
    },
    "hoisted": {
        "rhs": 9,
        "forces": 3,
        "energy": 3,
        "residual": 3,
        "residual_jacobian": 1,
        "switches": 3,
        "closed_rhs": 9,
        "closed_residual": 3,
        "closed_residual_jacobian": 1,
        "closed_project": 1,
        "closed_events": 6,
    },
    "run": {
        "t_end": 3.9,
        "fps": 60.0,
    },
    "limits": [
        {"name": "bodies.block.mass", "bound": "zero or more"},
        {"name": "friction.sole.force", "bound": "zero or more"},
        {"name": "friction.sole.static", "bound": "zero or more"},
        {"name": "friction.sole.static", "bound": "at least", "numbers": 2},
    ],
    "switches": [
        {"name": "sole_1", "kind": "friction", "circle": "sole", "axis": 1},
        {"name": "sole_2", "kind": "friction", "circle": "sole", "axis": 2},
    ],
    "subsystems": [],
    "time_terms": 2,
}

@njit(error_model="numpy")
def rhs(t, y, p, out):
    """State derivative: rates, accelerations, power. 92 operations."""
    p_m = p[0]
    p_mu = p[1]
    p_ax = p[3]
    p_ay = p[4]
    p_wx = p[5]
    p_wy = p[6]
    p_g = p[7]
    c0 = 1.0/p_m
    c1 = p_mu*(p_m*p_g)
    c2 = p_ax*(p_wx*p_wx)
    c3 = p_m*c2
    c4 = p_ay*(p_wy*p_wy)
    c5 = p_m*c4
    c6 = p_ax*p_wx
    c7 = p_ay*p_wy
    c8 = 0.5*p_m
    v_x = y[2]
    v_y = y[3]
    s_sole_1_sense = p[9]
    s_sole_1_turns = p[10]
    s_sole_2_sense = p[12]
    x0 = 1.0 - s_sole_1_turns
    x1 = s_sole_1_sense*x0
    x2 = s_sole_2_sense*x0
    x3 = x2 + v_y*s_sole_1_turns
    x4 = x1 + v_x*s_sole_1_turns
    x5 = sqrt(x3*x3 + (1e-280 + x4*x4))
    x6 = s_sole_2_sense*x3 + (0.57*x5 + s_sole_1_sense*x4)
    x7 = x5*sqrt(1e-300 + x6*x6)
    x8 = (x1 + x6*(s_sole_1_turns*x4)/x7)*c1
    x9 = t*p_wx
    x10 = sin(x9)
    x11 = c0*(x8 + x10*c3)
    x12 = c1*(x2 + x6*(s_sole_1_turns*x3)/x7)
    x13 = t*p_wy
    x14 = cos(x13)
    x15 = c0*(x12 + x14*c5)
    x16 = v_x - cos(x9)*c6
    x17 = 2.0*x16
    x18 = x10*c2
    x19 = x18 - x11
    x20 = v_y + sin(x13)*c7
    x21 = 2.0*x20
    x22 = x14*c4
    x23 = x22 - x15
    x24 = p_m*(x17*x19 + x21*x23) - (p_m*(v_x*x19) - p_m*(x16*x11)) - (p_m*(v_y*x23) - p_m*(x20*x15))
    out[0] = v_x
    out[1] = v_y
    out[2] = -x11
    out[3] = -x15
    out[4] = x24 - (v_x*x8 + v_y*x12 + c8*(x17*x18 + x21*x22))


@njit(error_model="numpy")
def mass_matrix(t, y, p, out):
    """Mass matrix M, row by row. 0 operations."""
    p_m = p[0]
    out[0] = p_m
    out[3] = p_m


@njit(error_model="numpy")
def forces(t, y, p, out):
    """Forces f of M a = f + G^T lambda. 49 operations."""
    p_m = p[0]
    p_mu = p[1]
    p_ax = p[3]
    p_ay = p[4]
    p_wx = p[5]
    p_wy = p[6]
    p_g = p[7]
    c0 = p_mu*(p_m*p_g)
    c1 = p_m*(p_ax*(p_wx*p_wx))
    c2 = p_m*(p_ay*(p_wy*p_wy))
    v_x = y[2]
    v_y = y[3]
    s_sole_1_sense = p[9]
    s_sole_1_turns = p[10]
    s_sole_2_sense = p[12]
    x0 = 1.0 - s_sole_1_turns
    x1 = s_sole_1_sense*x0
    x2 = s_sole_2_sense*x0
    x3 = x2 + v_y*s_sole_1_turns
    x4 = x1 + v_x*s_sole_1_turns
    x5 = sqrt(x3*x3 + (1e-280 + x4*x4))
    x6 = s_sole_2_sense*x3 + (0.57*x5 + s_sole_1_sense*x4)
    x7 = x5*sqrt(1e-300 + x6*x6)
    out[0] = -((x1 + x6*(s_sole_1_turns*x4)/x7)*c0 + sin(t*p_wx)*c1)
    out[1] = -(c0*(x2 + x6*(s_sole_1_turns*x3)/x7) + cos(t*p_wy)*c2)


@njit(error_model="numpy")
def energy(t, y, p, out):
    """Kinetic and potential energy. 15 operations."""
    p_m = p[0]
    p_ax = p[3]
    p_ay = p[4]
    p_wx = p[5]
    p_wy = p[6]
    c0 = 0.5*p_m
    c1 = p_ax*p_wx
    c2 = p_ay*p_wy
    v_x = y[2]
    v_y = y[3]
    x0 = v_x - cos(t*p_wx)*c1
    x1 = v_y + sin(t*p_wy)*c2
    out[0] = c0*(x0*x0 + x1*x1)
    out[1] = 0.0


@njit(error_model="numpy")
def residual(t, y, p, out):
    """M a - f - G^T lambda, then G a - gamma. 49 operations."""
    p_m = p[0]
    p_mu = p[1]
    p_ax = p[3]
    p_ay = p[4]
    p_wx = p[5]
    p_wy = p[6]
    p_g = p[7]
    c0 = p_mu*(p_m*p_g)
    c1 = p_ax*(p_wx*p_wx)
    c2 = p_ay*(p_wy*p_wy)
    v_x = y[2]
    v_y = y[3]
    a_x = y[4]
    a_y = y[5]
    s_sole_1_sense = p[9]
    s_sole_1_turns = p[10]
    s_sole_2_sense = p[12]
    x0 = 1.0 - s_sole_1_turns
    x1 = s_sole_1_sense*x0
    x2 = s_sole_2_sense*x0
    x3 = x2 + v_y*s_sole_1_turns
    x4 = x1 + v_x*s_sole_1_turns
    x5 = sqrt(x3*x3 + (1e-280 + x4*x4))
    x6 = s_sole_2_sense*x3 + (0.57*x5 + s_sole_1_sense*x4)
    x7 = x5*sqrt(1e-300 + x6*x6)
    x8 = (x1 + x6*(s_sole_1_turns*x4)/x7)*c0 + p_m*(a_x + sin(t*p_wx)*c1)
    x9 = c0*(x2 + x6*(s_sole_1_turns*x3)/x7) + p_m*(a_y + cos(t*p_wy)*c2)
    out[0] = x8
    out[1] = x9


@njit(error_model="numpy")
def residual_jacobian(t, y, p, out):
    """Residual derivatives by q, v, a, lambda. 75 operations."""
    p_m = p[0]
    p_mu = p[1]
    p_g = p[7]
    c0 = p_mu*(p_m*p_g)
    v_x = y[2]
    v_y = y[3]
    s_sole_1_sense = p[9]
    s_sole_1_turns = p[10]
    s_sole_2_sense = p[12]
    x0 = 1.0 - s_sole_1_turns
    x1 = s_sole_2_sense*x0 + v_y*s_sole_1_turns
    x2 = s_sole_1_sense*x0 + v_x*s_sole_1_turns
    x3 = sqrt(x1*x1 + (1e-280 + x2*x2))
    x4 = s_sole_2_sense*x1 + (0.57*x3 + s_sole_1_sense*x2)
    x5 = sqrt(1e-300 + x4*x4)
    x6 = x3*x5
    x7 = c0/x6
    x8 = s_sole_1_turns*(x4*x7)
    x9 = s_sole_1_turns*x2
    x10 = 2.0*x4
    x11 = 0.5/x5
    x12 = x4*x9/x6*x7
    x13 = x9*x7 - x10*(x11*(x3*x12))
    x14 = 2.0*x2
    x15 = 0.5/x3
    x16 = x15*(0.57*x13 - x5*x12)
    x17 = 2.0*x1
    x18 = s_sole_1_turns*x1
    x19 = x4*x18/x6*x7
    x20 = x18*x7 - x10*(x11*(x3*x19))
    x21 = x15*(0.57*x20 - x5*x19)
    out[2] = s_sole_1_turns*(x8 + s_sole_1_sense*x13 + x14*x16)
    out[3] = s_sole_1_turns*(s_sole_2_sense*x13 + x17*x16)
    out[4] = p_m
    out[8] = s_sole_1_turns*(s_sole_1_sense*x20 + x14*x21)
    out[9] = s_sole_1_turns*(x8 + s_sole_2_sense*x20 + x17*x21)
    out[11] = p_m


@njit(error_model="numpy")
def poses(t, y, p, out):
    """Per body: position, rotation matrix (body to world). 10 operations."""
    p_ax = p[3]
    p_ay = p[4]
    p_wx = p[5]
    p_wy = p[6]
    q_x = y[0]
    q_y = y[1]
    x0 = p_ax*sin(t*p_wx)
    x1 = p_ay*cos(t*p_wy)
    out[0] = q_x - x0
    out[1] = q_y - x1
    out[2] = 0.06
    out[3] = 1.0
    out[4] = 0.0
    out[5] = 0.0
    out[6] = 0.0
    out[7] = 1.0
    out[8] = 0.0
    out[9] = 0.0
    out[10] = 0.0
    out[11] = 1.0
    out[12] = -x0
    out[13] = -x1
    out[14] = 0.01
    out[15] = 1.0
    out[16] = 0.0
    out[17] = 0.0
    out[18] = 0.0
    out[19] = 1.0
    out[20] = 0.0
    out[21] = 0.0
    out[22] = 0.0
    out[23] = 1.0


@njit(error_model="numpy")
def shapes(t, y, p, out):
    """Sizes of the bodies' shapes. 0 operations."""
    out[0] = 0.12
    out[1] = 0.08
    out[2] = 0.08
    out[3] = 0.8
    out[4] = 0.6
    out[5] = 0.02


@njit(error_model="numpy")
def outputs(t, y, p, out):
    """Outputs. 4 operations."""
    v_x = y[2]
    v_y = y[3]
    out[0] = sqrt(v_x*v_x + v_y*v_y)


@njit(error_model="numpy")
def events(t, y, p, out):
    """Event functions. 24 operations."""
    v_x = y[2]
    v_y = y[3]
    s_sole_1_sense = p[9]
    s_sole_1_turns = p[10]
    s_sole_2_sense = p[12]
    s_sole_2_aimed = p[13]
    s_sole_2_bound = p[15]
    x0 = v_x*s_sole_1_sense
    x1 = v_y*s_sole_2_sense
    x2 = x0 + x1 - s_sole_1_turns*fabs(v_y*s_sole_1_sense - v_x*s_sole_2_sense)
    x3 = s_sole_1_turns*(sqrt(v_y*v_y + (1e-280 + v_x*v_x)) - s_sole_2_bound)
    x4 = s_sole_2_aimed*(s_sole_2_bound - x0 - x1) + (1.0 - s_sole_2_aimed)
    out[0] = x2
    out[1] = x3 + (1.0 - s_sole_1_turns)*x4


@njit(error_model="numpy")
def limits(t, y, p, out):
    """Numbers of parameters that have a bound. 3 operations."""
    p_m = p[0]
    p_mu = p[1]
    p_mu_s = p[2]
    p_g = p[7]
    c0 = p_m*p_g
    c1 = p_mu*c0
    c2 = p_mu_s*c0
    out[0] = p_m
    out[1] = c1
    out[2] = c2
    out[3] = c2
    out[4] = c1


@njit(error_model="numpy")
def switches(t, y, p, out):
    """Gaps and restitutions of stops; speeds, levels and largest levels of frictions. 3 operations."""
    p_m = p[0]
    p_mu = p[1]
    p_mu_s = p[2]
    p_g = p[7]
    c0 = p_m*p_g
    c1 = p_mu*c0
    c2 = p_mu_s*c0
    v_x = y[2]
    v_y = y[3]
    out[0] = v_x
    out[1] = c1
    out[2] = c2
    out[3] = v_y
    out[4] = c1
    out[5] = c2


@njit(error_model="numpy")
def time_terms(t, y, p, out):
    """What the equations have of time alone, beyond polynomials. 4 operations."""
    p_wx = p[5]
    p_wy = p[6]
    out[0] = sin(t*p_wx)
    out[1] = cos(t*p_wy)


@njit(error_model="numpy")
def closed_rhs(t, y, p, out):
    """State derivative: rates, accelerations, power, multipliers, pivot ratio. 135 operations."""
    p_m = p[0]
    p_mu = p[1]
    p_ax = p[3]
    p_ay = p[4]
    p_wx = p[5]
    p_wy = p[6]
    p_g = p[7]
    c0 = 1.0/p_m
    c1 = p_mu*(p_m*p_g)
    c2 = p_ay*(p_wy*p_wy)
    c3 = p_m*c2
    c4 = p_ax*(p_wx*p_wx)
    c5 = p_m*c4
    c6 = p_ax*p_wx
    c7 = p_ay*p_wy
    c8 = 0.5*p_m
    v_x = y[2]
    v_y = y[3]
    s_sole_1_stuck = p[8]
    s_sole_1_sense = p[9]
    s_sole_1_turns = p[10]
    s_sole_2_stuck = p[11]
    s_sole_2_sense = p[12]
    s_sole_2_aimed = p[13]
    x0 = s_sole_2_stuck*(s_sole_2_sense*s_sole_2_aimed)
    x1 = x0*c0
    x2 = s_sole_1_stuck*c0
    x3 = x0*x2
    x4 = 1.0/(1.0 - s_sole_1_stuck + s_sole_1_stuck*x2)
    x5 = x3*x4
    x6 = s_sole_2_stuck*(1.0 - s_sole_2_aimed + s_sole_1_sense*s_sole_2_aimed)
    x7 = x6*c0
    x8 = 1.0 - s_sole_2_stuck + x6*x7 + x0*x1
    x9 = x3*x5 - x8
    x10 = 1.0 - s_sole_1_turns
    x11 = s_sole_2_sense*x10
    x12 = x11 + v_y*s_sole_1_turns
    x13 = s_sole_1_sense*x10
    x14 = x13 + v_x*s_sole_1_turns
    x15 = sqrt(x12*x12 + (1e-280 + x14*x14))
    x16 = s_sole_2_sense*x12 + (0.57*x15 + s_sole_1_sense*x14)
    x17 = x15*sqrt(1e-300 + x16*x16)
    x18 = c1*(x11 + x16*(s_sole_1_turns*x12)/x17)
    x19 = t*p_wy
    x20 = cos(x19)
    x21 = x18 + x20*c3
    x22 = (x13 + x16*(s_sole_1_turns*x14)/x17)*c1
    x23 = t*p_wx
    x24 = sin(x23)
    x25 = x22 + x24*c5
    x26 = x2*x25
    x27 = 1.0/x9*(x7*x21 - x1*x25 + x5*x26)
    x28 = x5*x27 - x4*x26
    x29 = x1*x27 - (c0*x25 + x2*x28)
    x30 = c0*x21 + x7*x27
    x31 = v_x - cos(x23)*c6
    x32 = 2.0*x31
    x33 = x24*c4
    x34 = x33 + x29
    x35 = v_y + sin(x19)*c7
    x36 = 2.0*x35
    x37 = x20*c2
    x38 = x37 - x30
    x39 = p_m*(x32*x34 + x36*x38) - (p_m*(x31*x29) + p_m*(v_x*x34)) - (p_m*(v_y*x38) - p_m*(x35*x30))
    x40 = -(x9/x8)
    out[0] = v_x
    out[1] = v_y
    out[2] = x29
    out[3] = -x30
    out[4] = x39 - (v_x*x22 + v_y*x18 + c8*(x32*x33 + x36*x37))
    out[5] = -x28
    out[6] = -x27
    out[7] = (x40 if x40 < 1.0 else 1.0)


@njit(error_model="numpy")
def closed_residual(t, y, p, out):
    """M a - f - G^T lambda, then G a - gamma. 74 operations."""
    p_m = p[0]
    p_mu = p[1]
    p_ax = p[3]
    p_ay = p[4]
    p_wx = p[5]
    p_wy = p[6]
    p_g = p[7]
    c0 = p_mu*(p_m*p_g)
    c1 = p_ax*(p_wx*p_wx)
    c2 = p_ay*(p_wy*p_wy)
    v_x = y[2]
    v_y = y[3]
    a_x = y[4]
    a_y = y[5]
    lam_sole_1 = y[6]
    lam_sole_2 = y[7]
    s_sole_1_stuck = p[8]
    s_sole_1_sense = p[9]
    s_sole_1_turns = p[10]
    s_sole_2_stuck = p[11]
    s_sole_2_sense = p[12]
    s_sole_2_aimed = p[13]
    x0 = 1.0 - s_sole_1_turns
    x1 = s_sole_1_sense*x0
    x2 = s_sole_2_sense*x0
    x3 = x2 + v_y*s_sole_1_turns
    x4 = x1 + v_x*s_sole_1_turns
    x5 = sqrt(x3*x3 + (1e-280 + x4*x4))
    x6 = s_sole_2_sense*x3 + (0.57*x5 + s_sole_1_sense*x4)
    x7 = x5*sqrt(1e-300 + x6*x6)
    x8 = (x1 + x6*(s_sole_1_turns*x4)/x7)*c0 + p_m*(a_x + sin(t*p_wx)*c1)
    x9 = lam_sole_2*s_sole_2_stuck
    x10 = s_sole_2_aimed*x9
    x11 = c0*(x2 + x6*(s_sole_1_turns*x3)/x7) + p_m*(a_y + cos(t*p_wy)*c2)
    x12 = 1.0 - s_sole_2_aimed
    x13 = s_sole_2_aimed*(a_y*s_sole_1_sense - a_x*s_sole_2_sense) + a_y*x12
    out[0] = x8 - (lam_sole_1*s_sole_1_stuck - s_sole_2_sense*x10)
    out[1] = x11 - (x12*x9 + s_sole_1_sense*x10)
    out[2] = a_x*s_sole_1_stuck + lam_sole_1*(1.0 - s_sole_1_stuck)
    out[3] = s_sole_2_stuck*x13 + lam_sole_2*(1.0 - s_sole_2_stuck)


@njit(error_model="numpy")
def closed_residual_jacobian(t, y, p, out):
    """Residual derivatives by q, v, a, lambda. 86 operations."""
    p_m = p[0]
    p_mu = p[1]
    p_g = p[7]
    c0 = p_mu*(p_m*p_g)
    v_x = y[2]
    v_y = y[3]
    s_sole_1_stuck = p[8]
    s_sole_1_sense = p[9]
    s_sole_1_turns = p[10]
    s_sole_2_stuck = p[11]
    s_sole_2_sense = p[12]
    s_sole_2_aimed = p[13]
    x0 = 1.0 - s_sole_1_turns
    x1 = s_sole_2_sense*x0 + v_y*s_sole_1_turns
    x2 = s_sole_1_sense*x0 + v_x*s_sole_1_turns
    x3 = sqrt(x1*x1 + (1e-280 + x2*x2))
    x4 = s_sole_2_sense*x1 + (0.57*x3 + s_sole_1_sense*x2)
    x5 = sqrt(1e-300 + x4*x4)
    x6 = x3*x5
    x7 = c0/x6
    x8 = s_sole_1_turns*(x4*x7)
    x9 = s_sole_1_turns*x2
    x10 = 2.0*x4
    x11 = 0.5/x5
    x12 = x4*x9/x6*x7
    x13 = x9*x7 - x10*(x11*(x3*x12))
    x14 = 2.0*x2
    x15 = 0.5/x3
    x16 = x15*(0.57*x13 - x5*x12)
    x17 = 2.0*x1
    x18 = s_sole_2_stuck*(s_sole_2_sense*s_sole_2_aimed)
    x19 = s_sole_1_turns*x1
    x20 = x4*x19/x6*x7
    x21 = x19*x7 - x10*(x11*(x3*x20))
    x22 = x15*(0.57*x21 - x5*x20)
    x23 = s_sole_2_stuck*(1.0 - s_sole_2_aimed + s_sole_1_sense*s_sole_2_aimed)
    out[2] = s_sole_1_turns*(x8 + s_sole_1_sense*x13 + x14*x16)
    out[3] = s_sole_1_turns*(s_sole_2_sense*x13 + x17*x16)
    out[4] = p_m
    out[6] = -s_sole_1_stuck
    out[7] = x18
    out[10] = s_sole_1_turns*(s_sole_1_sense*x21 + x14*x22)
    out[11] = s_sole_1_turns*(x8 + s_sole_2_sense*x21 + x17*x22)
    out[13] = p_m
    out[15] = -x23
    out[20] = s_sole_1_stuck
    out[22] = 1.0 - s_sole_1_stuck
    out[28] = -x18
    out[29] = x23
    out[31] = 1.0 - s_sole_2_stuck


@njit(error_model="numpy")
def closed_constraint_residual(t, y, p, out):
    """Position residuals, velocity residuals. 9 operations."""
    v_x = y[2]
    v_y = y[3]
    s_sole_1_stuck = p[8]
    s_sole_1_sense = p[9]
    s_sole_2_stuck = p[11]
    s_sole_2_sense = p[12]
    s_sole_2_aimed = p[13]
    x0 = s_sole_2_aimed*(v_y*s_sole_1_sense - v_x*s_sole_2_sense) + v_y*(1.0 - s_sole_2_aimed)
    out[0] = v_x*s_sole_1_stuck
    out[1] = s_sole_2_stuck*x0


@njit(error_model="numpy")
def closed_constraint_jacobian(t, y, p, out):
    """Constraint Jacobian G, row by row. 7 operations."""
    s_sole_1_stuck = p[8]
    s_sole_1_sense = p[9]
    s_sole_2_stuck = p[11]
    s_sole_2_sense = p[12]
    s_sole_2_aimed = p[13]
    x0 = s_sole_2_stuck*(1.0 - s_sole_2_aimed + s_sole_1_sense*s_sole_2_aimed)
    out[0] = s_sole_1_stuck
    out[2] = -(s_sole_2_stuck*(s_sole_2_sense*s_sole_2_aimed))
    out[3] = x0


@njit(error_model="numpy")
def closed_gamma(t, y, p, out):
    """Right-hand side of G a = gamma. 0 operations."""
    out[0] = 0.0
    out[1] = 0.0


@njit(error_model="numpy")
def closed_project(t, y, p, out):
    """State moved onto the constraints, and the residuals it had. 44 operations."""
    p_m = p[0]
    c0 = 1.0/p_m
    q_x = y[0]
    q_y = y[1]
    v_x = y[2]
    v_y = y[3]
    s_sole_1_stuck = p[8]
    s_sole_1_sense = p[9]
    s_sole_2_stuck = p[11]
    s_sole_2_sense = p[12]
    s_sole_2_aimed = p[13]
    x0 = s_sole_1_stuck*c0
    x1 = v_x*s_sole_1_stuck
    x2 = 1.0/(1.0 - s_sole_1_stuck + s_sole_1_stuck*x0)
    x3 = s_sole_2_stuck*(s_sole_2_sense*s_sole_2_aimed)
    x4 = x3*x0
    x5 = x4*x2
    x6 = 1.0 - s_sole_2_aimed
    x7 = s_sole_2_stuck*(x6 + s_sole_1_sense*s_sole_2_aimed)
    x8 = x7*c0
    x9 = x3*c0
    x10 = s_sole_2_aimed*(v_y*s_sole_1_sense - v_x*s_sole_2_sense) + v_y*x6
    x11 = s_sole_2_stuck*x10
    x12 = 1.0/(x4*x5 - (1.0 - s_sole_2_stuck + x7*x8 + x3*x9))*(x11 + x1*x5)
    out[0] = q_x
    out[1] = q_y
    out[2] = v_x - (x0*(x1*x2 - x5*x12) + x9*x12)
    out[3] = v_y + x8*x12
    out[4] = x1
    out[5] = x11


@njit(error_model="numpy")
def closed_events(t, y, p, out):
    """Event functions. 129 operations."""
    p_m = p[0]
    p_mu = p[1]
    p_mu_s = p[2]
    p_ax = p[3]
    p_ay = p[4]
    p_wx = p[5]
    p_wy = p[6]
    p_g = p[7]
    c0 = p_m*p_g
    c1 = p_mu_s*c0
    c2 = 1.0/p_m
    c3 = p_mu*c0
    c4 = p_m*(p_ay*(p_wy*p_wy))
    c5 = p_m*(p_ax*(p_wx*p_wx))
    v_x = y[2]
    v_y = y[3]
    s_sole_1_stuck = p[8]
    s_sole_1_sense = p[9]
    s_sole_1_turns = p[10]
    s_sole_2_stuck = p[11]
    s_sole_2_sense = p[12]
    s_sole_2_aimed = p[13]
    s_sole_2_angle = p[14]
    s_sole_2_bound = p[15]
    x0 = v_x*s_sole_1_sense
    x1 = v_y*s_sole_2_sense
    x2 = x0 + x1 - s_sole_1_turns*fabs(v_y*s_sole_1_sense - v_x*s_sole_2_sense)
    x3 = 1.0 - s_sole_2_aimed
    x4 = x3 - s_sole_1_turns
    x5 = s_sole_2_stuck*(s_sole_2_sense*s_sole_2_aimed)
    x6 = s_sole_1_stuck*c2
    x7 = x5*x6
    x8 = 1.0/(1.0 - s_sole_1_stuck + s_sole_1_stuck*x6)
    x9 = x7*x8
    x10 = s_sole_2_stuck*(x3 + s_sole_1_sense*s_sole_2_aimed)
    x11 = x10*c2
    x12 = x5*c2
    x13 = 1.0 - s_sole_1_turns
    x14 = s_sole_2_sense*x13
    x15 = x14 + v_y*s_sole_1_turns
    x16 = s_sole_1_sense*x13
    x17 = x16 + v_x*s_sole_1_turns
    x18 = sqrt(x15*x15 + (1e-280 + x17*x17))
    x19 = s_sole_2_sense*x15 + (0.57*x18 + s_sole_1_sense*x17)
    x20 = x18*sqrt(1e-300 + x19*x19)
    x21 = x11*(c3*(x14 + x19*(s_sole_1_turns*x15)/x20) + cos(t*p_wy)*c4)
    x22 = (x16 + x19*(s_sole_1_turns*x17)/x20)*c3 + sin(t*p_wx)*c5
    x23 = x6*x22
    x24 = 1.0/(x7*x9 - (1.0 - s_sole_2_stuck + x10*x11 + x5*x12))*(x21 - x12*x22 + x9*x23)
    x25 = x24 + c3*(s_sole_2_sense*x4)
    x26 = x9*x24 - x8*x23 + c3*(s_sole_1_sense*x4)
    x27 = c1 - sqrt(x25*x25 + (1e-280 + x26*x26))
    x28 = s_sole_2_bound - x0 - x1
    x29 = s_sole_2_angle*c3 - fabs(x24)
    x30 = x28 + x29
    x31 = x30*x30
    x32 = s_sole_2_aimed*((x28 if x28 < x29 else x29) if -1.0 < x31 else x31)
    x33 = s_sole_1_turns*(sqrt(v_y*v_y + (1e-280 + v_x*v_x)) - s_sole_2_bound)
    out[0] = (s_sole_1_turns + s_sole_2_aimed)*x2 + x4*x27
    out[1] = x32 + x3*(x33 + x13*x27)
