"""slider_crank: equations of motion, written by symgen 0.1.0. Do not edit.

Slider-crank without friction: crank, connecting rod and piston, the loop closed by two constraints
"""

from math import cos, sin

from numba import njit

MODEL = {
    "abi": 1,
    "generator": "symgen 0.1.0",
    "source": "sha256:e8ab3470a9cbbe4ba89816755737d3a0abd98ac05ce2dbcc3a5853ed854ddf86",
    "name": "slider_crank",
    "description": "Slider-crank without friction: crank, connecting rod and piston, the loop closed by two constraints",
    "nq": 3,
    "nv": 3,
    "nh": 2,
    "nn": 0,
    "nw": 0,
    "coordinates": [
        {"name": "theta", "unit": "rad", "value": 0.5, "enforced": True},
        {"name": "phi", "unit": "rad", "value": -0.2, "enforced": False},
        {"name": "x", "unit": "m", "value": 0.4, "enforced": False},
    ],
    "quaternions": [],
    "rates": [
        {"name": "theta", "unit": "rad/s", "value": 20.0, "enforced": True},
        {"name": "phi", "unit": "rad/s", "value": 0.0, "enforced": False},
        {"name": "x", "unit": "m/s", "value": 0.0, "enforced": False},
    ],
    "parameters": [
        {"name": "r", "unit": "m", "value": 0.1, "doc": "length of the crank"},
        {"name": "l", "unit": "m", "value": 0.3, "doc": "length of the rod"},
        {"name": "mc", "unit": "kg", "value": 0.5, "doc": "mass of the crank"},
        {"name": "Jc", "unit": "kg*m^2", "value": 0.002, "doc": "inertia of the crank about its centre of mass"},
        {"name": "m", "unit": "kg", "value": 1.0, "doc": "mass of the rod"},
        {"name": "J", "unit": "kg*m^2", "value": 0.0075, "doc": "inertia of the rod about its centre of mass"},
        {"name": "mp", "unit": "kg", "value": 0.8, "doc": "mass of the piston"},
        {"name": "g", "unit": "m/s^2", "value": 9.81, "doc": ""},
    ],
    "inputs": [],
    "constants": [],
    "constraints": [
        {"name": "pin_x_closes", "kind": "holonomic", "multiplier": "N"},
        {"name": "pin_y_closes", "kind": "holonomic", "multiplier": "N"},
    ],
    "outputs": [
        {"name": "piston_speed", "unit": "m/s"},
    ],
    "events": [],
    "bodies": [
        {"name": "crank", "planar": True, "shape": "capsule", "sizes": 2, "mesh": ""},
        {"name": "rod", "planar": True, "shape": "capsule", "sizes": 2, "mesh": ""},
        {"name": "piston", "planar": True, "shape": "box", "sizes": 3, "mesh": ""},
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
        "rhs": 135,
        "mass_matrix": 22,
        "forces": 50,
        "energy": 50,
        "residual": 80,
        "residual_jacobian": 137,
        "constraint_residual": 23,
        "constraint_jacobian": 10,
        "gamma": 18,
        "project": 111,
        "poses": 16,
        "shapes": 0,
        "outputs": 0,
        "marks": 7,
        "limits": 0,
    },
    "hoisted": {
        "rhs": 13,
        "mass_matrix": 5,
        "forces": 8,
        "energy": 9,
        "residual": 8,
        "residual_jacobian": 12,
        "project": 7,
        "poses": 2,
        "marks": 5,
    },
    "run": {
        "t_end": 10.0,
        "fps": 100.0,
    },
    "limits": [
        {"name": "bodies.crank.shape.capsule[1]", "bound": "zero or more"},
        {"name": "bodies.crank.mass", "bound": "zero or more"},
        {"name": "bodies.crank.inertia", "bound": "zero or more"},
        {"name": "bodies.rod.shape.capsule[1]", "bound": "zero or more"},
        {"name": "bodies.rod.mass", "bound": "zero or more"},
        {"name": "bodies.rod.inertia", "bound": "zero or more"},
        {"name": "bodies.piston.mass", "bound": "zero or more"},
    ],
    "subsystems": [],
    "marks": [
        {"kind": "pin", "name": "crank_1", "body": "crank", "numbers": 6},
        {"kind": "ground", "name": "crank_1", "body": "", "numbers": 3},
        {"kind": "pin", "name": "crank_2", "body": "crank", "numbers": 6},
        {"kind": "pin", "name": "rod_2", "body": "rod", "numbers": 6},
        {"kind": "reaction", "name": "rod_2", "body": "rod", "numbers": 3, "constraints": [0, 1], "signs": [1, 1]},
        {"kind": "rail", "name": "guide", "body": "", "numbers": 6},
    ],
}

@njit(error_model="numpy")
def rhs(t, y, p, out):
    """State derivative: rates, accelerations, multipliers, pivot ratio. 135 operations."""
    p_r = p[0]
    p_l = p[1]
    p_mc = p[2]
    p_Jc = p[3]
    p_m = p[4]
    p_J = p[5]
    p_mp = p[6]
    p_g = p[7]
    c0 = 0.5*p_r
    c1 = 1.0/(p_Jc + (p_m*(p_r*p_r) + p_mc*(c0*c0)))
    c2 = p_r*c1
    c3 = 0.5*p_l
    c4 = p_m*c3
    c5 = p_r*c4
    c6 = p_J + p_m*(c3*c3)
    c7 = 1.0/p_mp
    c8 = p_m*p_g
    c9 = c0*(p_mc*p_g) + p_r*c8
    c10 = p_r*p_m
    c11 = c0*(p_mc*c0)
    c12 = c3*c8
    q_theta = y[0]
    q_phi = y[1]
    v_theta = y[3]
    v_phi = y[4]
    v_x = y[5]
    x0 = sin(q_theta)
    x1 = x0*c2
    x2 = cos(q_theta)
    x3 = p_r*x2
    x4 = cos(q_phi)
    x5 = sin(q_phi)
    x6 = c5*(x4*x2) + c5*(x5*x0)
    x7 = x6*c1
    x8 = p_l*x4 - x3*x7
    x9 = p_r*x0
    x10 = x9*x7 - p_l*x5
    x11 = 1.0/(c6 - x6*x7)
    x12 = x10*x11
    x13 = x3*x1 - x8*x12
    x14 = 1.0/(x10*x12 + (c7 + x9*x1))
    x15 = x13*x14
    x16 = x8*x11
    x17 = x2*c2
    x18 = x8*x16 + x3*x17
    x19 = x13*x15 - x18
    x20 = v_theta*(v_theta*x0)
    x21 = p_r*x20
    x22 = v_phi*(v_phi*x5)
    x23 = v_theta*(v_theta*x2)
    x24 = p_r*x23
    x25 = v_phi*(v_phi*x4)
    x26 = x24 + c3*x25
    x27 = x21 + c3*x22
    x28 = x2*c9 + (x0*(x26*c10 + x23*c11) - x2*(x27*c10 + x20*c11))
    x29 = x7*x28 - (x4*c12 + (c4*(x5*x26) - c4*(x4*x27)))
    x30 = x24 + p_l*x25 - x28*x1 - x12*x29
    x31 = 1.0/x19*(x21 + p_l*x22 + x28*x17 - x16*x29 + x15*x30)
    x32 = x15*x31 - x14*x30
    x33 = x11*x29 - x12*x32 - x16*x31
    x34 = -(x19/x18)
    out[0] = v_theta
    out[1] = v_phi
    out[2] = v_x
    out[3] = x1*x32 - (c1*x28 + x7*x33) - x17*x31
    out[4] = x33
    out[5] = c7*x32
    out[6] = -x32
    out[7] = -x31
    out[8] = (x34 if x34 < 1.0 else 1.0)


@njit(error_model="numpy")
def mass_matrix(t, y, p, out):
    """Mass matrix M, row by row. 22 operations."""
    p_r = p[0]
    p_l = p[1]
    p_mc = p[2]
    p_Jc = p[3]
    p_m = p[4]
    p_J = p[5]
    p_mp = p[6]
    c0 = 0.5*p_r
    c1 = p_Jc + (p_m*(p_r*p_r) + p_mc*(c0*c0))
    c2 = 0.5*p_l
    c3 = p_r*(p_m*c2)
    c4 = p_J + p_m*(c2*c2)
    q_theta = y[0]
    q_phi = y[1]
    x0 = c3*(cos(q_phi)*cos(q_theta)) + c3*(sin(q_phi)*sin(q_theta))
    out[0] = c1
    out[1] = x0
    out[3] = x0
    out[4] = c4
    out[8] = p_mp


@njit(error_model="numpy")
def forces(t, y, p, out):
    """Forces f of M a = f + G^T lambda. 50 operations."""
    p_r = p[0]
    p_l = p[1]
    p_mc = p[2]
    p_m = p[4]
    p_g = p[7]
    c0 = 0.5*p_r
    c1 = p_m*p_g
    c2 = c0*(p_mc*p_g) + p_r*c1
    c3 = 0.5*p_l
    c4 = p_r*p_m
    c5 = c0*(p_mc*c0)
    c6 = c3*c1
    c7 = p_m*c3
    q_theta = y[0]
    q_phi = y[1]
    v_theta = y[3]
    v_phi = y[4]
    x0 = cos(q_theta)
    x1 = sin(q_theta)
    x2 = v_theta*(v_theta*x0)
    x3 = cos(q_phi)
    x4 = p_r*x2 + c3*(v_phi*(v_phi*x3))
    x5 = v_theta*(v_theta*x1)
    x6 = sin(q_phi)
    x7 = p_r*x5 + c3*(v_phi*(v_phi*x6))
    out[0] = -(x0*c2 + (x1*(x4*c4 + x2*c5) - x0*(x7*c4 + x5*c5)))
    out[1] = -(x3*c6 + (c7*(x6*x4) - c7*(x3*x7)))
    out[2] = 0.0


@njit(error_model="numpy")
def energy(t, y, p, out):
    """Kinetic and potential energy. 50 operations."""
    p_r = p[0]
    p_l = p[1]
    p_mc = p[2]
    p_Jc = p[3]
    p_m = p[4]
    p_J = p[5]
    p_mp = p[6]
    p_g = p[7]
    c0 = 0.5*p_mp
    c1 = 0.5*p_m
    c2 = 0.5*p_l
    c3 = 0.5*p_mc
    c4 = 0.5*p_r
    c5 = 0.5*p_Jc
    c6 = 0.5*p_J
    c7 = p_mc*(p_g*c4)
    c8 = p_m*p_g
    q_theta = y[0]
    q_phi = y[1]
    v_theta = y[3]
    v_phi = y[4]
    v_x = y[5]
    x0 = sin(q_theta)
    x1 = v_theta*x0
    x2 = sin(q_phi)
    x3 = p_r*x1 + c2*(v_phi*x2)
    x4 = v_theta*cos(q_theta)
    x5 = p_r*x4 + c2*(v_phi*cos(q_phi))
    x6 = c4*x1
    x7 = c4*x4
    x8 = c1*(x3*x3 + x5*x5) + (c3*(x6*x6 + x7*x7) + c5*(v_theta*v_theta))
    out[0] = c0*(v_x*v_x) + (x8 + c6*(v_phi*v_phi))
    out[1] = x0*c7 + (p_r*x0 + x2*c2)*c8


@njit(error_model="numpy")
def residual(t, y, p, out):
    """M a - f - G^T lambda, then G a - gamma. 80 operations."""
    p_r = p[0]
    p_l = p[1]
    p_mc = p[2]
    p_Jc = p[3]
    p_m = p[4]
    p_J = p[5]
    p_mp = p[6]
    p_g = p[7]
    c0 = 0.5*p_r
    c1 = p_m*p_g
    c2 = c0*(p_mc*p_g) + p_r*c1
    c3 = p_r*p_m
    c4 = 0.5*p_l
    c5 = c0*(p_mc*c0)
    c6 = c4*c1
    c7 = p_m*c4
    q_theta = y[0]
    q_phi = y[1]
    v_theta = y[3]
    v_phi = y[4]
    a_theta = y[6]
    a_phi = y[7]
    a_x = y[8]
    lam_pin_x_closes = y[9]
    lam_pin_y_closes = y[10]
    x0 = cos(q_theta)
    x1 = sin(q_theta)
    x2 = a_theta*x0 - v_theta*(v_theta*x1)
    x3 = p_r*x2
    x4 = cos(q_phi)
    x5 = sin(q_phi)
    x6 = a_phi*x4 - v_phi*(v_phi*x5)
    x7 = x3 + c4*x6
    x8 = v_theta*(v_theta*x0) + a_theta*x1
    x9 = p_r*x8
    x10 = v_phi*(v_phi*x4) + a_phi*x5
    x11 = x9 + c4*x10
    x12 = x0*c2 + (a_theta*p_Jc + x0*(c3*x7 + c5*x2) + x1*(c3*x11 + c5*x8))
    x13 = x12 - (p_r*(lam_pin_y_closes*x0) - p_r*(lam_pin_x_closes*x1))
    x14 = x4*c6 + (a_phi*p_J + c7*(x4*x7) + c7*(x5*x11)) - (p_l*(lam_pin_y_closes*x4) - p_l*(lam_pin_x_closes*x5))
    out[0] = x13
    out[1] = x14
    out[2] = lam_pin_x_closes + a_x*p_mp
    out[3] = -(a_x + (x9 + p_l*x10))
    out[4] = x3 + p_l*x6


@njit(error_model="numpy")
def residual_jacobian(t, y, p, out):
    """Residual derivatives by q, v, a, lambda. 137 operations."""
    p_r = p[0]
    p_l = p[1]
    p_mc = p[2]
    p_Jc = p[3]
    p_m = p[4]
    p_J = p[5]
    p_mp = p[6]
    p_g = p[7]
    c0 = 0.5*p_r
    c1 = p_mc*c0
    c2 = c0*c1
    c3 = c2 + p_r*(p_r*p_m)
    c4 = 0.5*p_l
    c5 = p_m*p_g
    c6 = p_mc*p_g
    c7 = p_m*c4
    c8 = p_r*c7
    c9 = p_Jc + (p_m*(p_r*p_r) + p_mc*(c0*c0))
    c10 = c4*c7
    c11 = p_J + p_m*(c4*c4)
    q_theta = y[0]
    q_phi = y[1]
    v_theta = y[3]
    v_phi = y[4]
    a_theta = y[6]
    a_phi = y[7]
    lam_pin_x_closes = y[9]
    lam_pin_y_closes = y[10]
    x0 = cos(q_theta)
    x1 = sin(q_theta)
    x2 = v_theta*x1
    x3 = a_theta*x0 - v_theta*x2
    x4 = x1*c3
    x5 = v_theta*x0
    x6 = v_theta*x5 + a_theta*x1
    x7 = p_r*x6
    x8 = cos(q_phi)
    x9 = v_phi*x8
    x10 = sin(q_phi)
    x11 = v_phi*x9 + a_phi*x10
    x12 = x7 + c4*x11
    x13 = p_r*x3
    x14 = v_phi*x10
    x15 = a_phi*x8 - v_phi*x14
    x16 = c5 + p_m*(x13 + c4*x15)
    x17 = x0*(c2*x6 + p_r*(lam_pin_x_closes + p_m*x12)) - x1*(p_r*(x16 - lam_pin_y_closes) + c0*(c6 + c1*x3))
    x18 = x0*c3
    x19 = x1*c8
    x20 = x0*c8
    x21 = x5 + x5
    x22 = x2 + x2
    x23 = x9 + x9
    x24 = x14 + x14
    x25 = c8*(x8*x0) + c8*(x10*x1)
    x26 = p_r*x1
    x27 = p_r*x0
    x28 = x10*c8
    x29 = x8*c8
    x30 = x10*c10
    x31 = x8*(lam_pin_x_closes*p_l + c7*x12) - x10*(c4*x16 - lam_pin_y_closes*p_l)
    x32 = x8*c10
    x33 = p_l*x10
    x34 = p_l*x8
    out[0] = x3*x4 + (x17 - x6*x18)
    out[1] = x15*x19 - x11*x20
    out[3] = x21*x4 - x22*x18
    out[4] = x23*x19 - x24*x20
    out[6] = c9
    out[7] = x25
    out[9] = x26
    out[10] = -x27
    out[11] = x28*x3 - x29*x6
    out[12] = x15*x30 + (x31 - x11*x32)
    out[14] = x28*x21 - x29*x22
    out[15] = x23*x30 - x24*x32
    out[17] = x25
    out[18] = c11
    out[20] = x33
    out[21] = -x34
    out[30] = p_mp
    out[31] = 1.0
    out[33] = -x13
    out[34] = -(p_l*x15)
    out[36] = -(p_r*x21)
    out[37] = -(p_l*x23)
    out[39] = -x26
    out[40] = -x33
    out[41] = -1.0
    out[44] = -x7
    out[45] = -(p_l*x11)
    out[47] = -(p_r*x22)
    out[48] = -(p_l*x24)
    out[50] = x27
    out[51] = x34


@njit(error_model="numpy")
def constraint_residual(t, y, p, out):
    """Position residuals, velocity residuals. 23 operations."""
    p_r = p[0]
    p_l = p[1]
    q_theta = y[0]
    q_phi = y[1]
    q_x = y[2]
    v_theta = y[3]
    v_phi = y[4]
    v_x = y[5]
    x0 = cos(q_phi)
    x1 = cos(q_theta)
    x2 = sin(q_phi)
    x3 = sin(q_theta)
    out[0] = p_l*x0 + p_r*x1 - q_x
    out[1] = p_l*x2 + p_r*x3
    out[2] = -(v_x + (p_r*(v_theta*x3) + p_l*(v_phi*x2)))
    out[3] = p_r*(v_theta*x1) + p_l*(v_phi*x0)


@njit(error_model="numpy")
def constraint_jacobian(t, y, p, out):
    """Constraint Jacobian G, row by row. 10 operations."""
    p_r = p[0]
    p_l = p[1]
    q_theta = y[0]
    q_phi = y[1]
    out[0] = -(p_r*sin(q_theta))
    out[1] = -(p_l*sin(q_phi))
    out[2] = -1.0
    out[3] = p_r*cos(q_theta)
    out[4] = p_l*cos(q_phi)


@njit(error_model="numpy")
def gamma(t, y, p, out):
    """Right-hand side of G a = gamma. 18 operations."""
    p_r = p[0]
    p_l = p[1]
    q_theta = y[0]
    q_phi = y[1]
    v_theta = y[3]
    v_phi = y[4]
    x0 = p_r*(v_theta*(v_theta*cos(q_theta))) + p_l*(v_phi*(v_phi*cos(q_phi)))
    x1 = p_r*(v_theta*(v_theta*sin(q_theta))) + p_l*(v_phi*(v_phi*sin(q_phi)))
    out[0] = x0
    out[1] = x1


@njit(error_model="numpy")
def project(t, y, p, out):
    """State moved onto the constraints, and the residuals it had. 111 operations."""
    p_r = p[0]
    p_l = p[1]
    p_mc = p[2]
    p_Jc = p[3]
    p_m = p[4]
    p_J = p[5]
    p_mp = p[6]
    c0 = 0.5*p_r
    c1 = 1.0/(p_Jc + (p_m*(p_r*p_r) + p_mc*(c0*c0)))
    c2 = p_r*c1
    c3 = 0.5*p_l
    c4 = p_r*(p_m*c3)
    c5 = p_J + p_m*(c3*c3)
    c6 = 1.0/p_mp
    q_theta = y[0]
    q_phi = y[1]
    q_x = y[2]
    v_theta = y[3]
    v_phi = y[4]
    v_x = y[5]
    x0 = sin(q_theta)
    x1 = x0*c2
    x2 = cos(q_phi)
    x3 = p_l*x2
    x4 = cos(q_theta)
    x5 = p_r*x4
    x6 = x3 + x5 - q_x
    x7 = p_r*x0
    x8 = sin(q_phi)
    x9 = c4*(x2*x4) + c4*(x8*x0)
    x10 = x9*c1
    x11 = p_l*x8
    x12 = x7*x10 - x11
    x13 = 1.0/(c5 - x9*x10)
    x14 = x12*x13
    x15 = 1.0/(x12*x14 + (c6 + x7*x1))
    x16 = x3 - x5*x10
    x17 = x5*x1 - x16*x14
    x18 = x17*x15
    x19 = x16*x13
    x20 = x4*c2
    x21 = 1.0/(x17*x18 - (x16*x19 + x5*x20))
    x22 = x11 + x7
    x23 = x21*(x22 + x6*x18)
    x24 = x6*x15 - x18*x23
    x25 = x19*x23 - x14*x24
    x26 = q_theta + (x1*x24 - x10*x25 + x20*x23)
    x27 = q_phi + x25
    x28 = v_x + (p_r*(v_theta*sin(x26)) + p_l*(v_phi*sin(x27)))
    x29 = p_r*(v_theta*cos(x26)) + p_l*(v_phi*cos(x27))
    x30 = x21*(x18*x28 - x29)
    x31 = x18*x30 - x15*x28
    x32 = x14*x31 + x19*x30
    out[0] = x26
    out[1] = x27
    out[2] = q_x + c6*x24
    out[3] = v_theta + (x10*x32 + x1*x31 - x20*x30)
    out[4] = v_phi - x32
    out[5] = v_x + c6*x31
    out[6] = x6
    out[7] = x22
    out[8] = -x28
    out[9] = x29


@njit(error_model="numpy")
def poses(t, y, p, out):
    """Per body: position, rotation matrix (body to world). 16 operations."""
    p_r = p[0]
    p_l = p[1]
    c0 = 0.5*p_r
    c1 = 0.5*p_l
    q_theta = y[0]
    q_phi = y[1]
    q_x = y[2]
    x0 = cos(q_theta)
    x1 = sin(q_theta)
    x2 = cos(q_phi)
    x3 = sin(q_phi)
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
    out[12] = p_r*x0 + x2*c1
    out[13] = p_r*x1 + x3*c1
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
    out[24] = q_x
    out[25] = 0.0
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


@njit(error_model="numpy")
def shapes(t, y, p, out):
    """Sizes of the bodies' shapes. 0 operations."""
    p_r = p[0]
    p_l = p[1]
    out[0] = 0.012
    out[1] = p_r
    out[2] = 0.01
    out[3] = p_l
    out[4] = 0.07
    out[5] = 0.06
    out[6] = 0.06


@njit(error_model="numpy")
def outputs(t, y, p, out):
    """Outputs. 0 operations."""
    v_x = y[5]
    out[0] = v_x


@njit(error_model="numpy")
def marks(t, y, p, out):
    """What a picture shows besides bodies, as `marks` lists it. 7 operations."""
    p_r = p[0]
    p_l = p[1]
    c0 = 0.5*p_r
    c1 = -c0
    c2 = 0.5*p_l
    c3 = p_l + -0.05 - p_r
    c4 = 0.05 + (p_r + p_l)
    out[0] = c1
    out[5] = 1.0
    out[9] = c0
    out[14] = 1.0
    out[15] = c2
    out[20] = 1.0
    out[21] = c2
    out[24] = c3
    out[25] = -0.03
    out[27] = c4
    out[28] = -0.03


@njit(error_model="numpy")
def limits(t, y, p, out):
    """Numbers of parameters that have a bound. 0 operations."""
    p_r = p[0]
    p_l = p[1]
    p_mc = p[2]
    p_Jc = p[3]
    p_m = p[4]
    p_J = p[5]
    p_mp = p[6]
    out[0] = p_r
    out[1] = p_mc
    out[2] = p_Jc
    out[3] = p_l
    out[4] = p_m
    out[5] = p_J
    out[6] = p_mp
