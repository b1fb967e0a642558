"""slider_crank: equations of motion, written by symgen 0.1.0. Do not edit.

Slider-crank without friction: crank, connecting rod and piston, the loop closed by two constraints
"""

from math import cos, sin

from numba import njit

MODEL = {
    "abi": 1,
    "generator": "symgen 0.1.0",
    "source": "sha256:3c8dd3461a3d74caf242285db1043a4b29028d4d7f3ad701c65277329dff1a91",
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
        {"name": "pin_x_closes", "kind": "holonomic"},
        {"name": "pin_y_closes", "kind": "holonomic"},
    ],
    "outputs": [
        {"name": "piston_speed", "unit": ""},
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
        "rhs": 137,
        "mass_matrix": 22,
        "forces": 52,
        "energy": 50,
        "residual": 82,
        "residual_jacobian": 174,
        "constraint_residual": 23,
        "constraint_jacobian": 10,
        "gamma": 18,
        "project": 110,
        "poses": 16,
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
    """State derivative: rates, accelerations, multipliers, pivot ratio. 137 operations."""
    q_theta = y[0]
    q_phi = y[1]
    v_theta = y[3]
    v_phi = y[4]
    v_x = y[5]
    p_r = p[0]
    p_l = p[1]
    p_mc = p[2]
    p_Jc = p[3]
    p_m = p[4]
    p_J = p[5]
    p_mp = p[6]
    p_g = p[7]
    x0 = sin(q_theta)
    x1 = p_r*x0
    x2 = 0.5*p_r
    x3 = 1.0/(p_Jc + (p_m*(p_r*p_r) + p_mc*(x2*x2)))
    x4 = x1*x3
    x5 = cos(q_theta)
    x6 = p_r*x5
    x7 = cos(q_phi)
    x8 = 0.5*p_l
    x9 = p_r*(p_m*x8)
    x10 = sin(q_phi)
    x11 = x5*(x7*x9) + x0*(x10*x9)
    x12 = x11*x3
    x13 = p_l*x7 - x6*x12
    x14 = x1*x12 - p_l*x10
    x15 = 1.0/(p_J + p_m*(x8*x8) - x11*x12)
    x16 = x14*x15
    x17 = x6*x4 - x13*x16
    x18 = 1.0/p_mp
    x19 = 1.0/(x18 + x1*x4 + x14*x16)
    x20 = x17*x19
    x21 = x6*x3
    x22 = x13*x15
    x23 = x6*x21 + x13*x22
    x24 = x17*x20 - x23
    x25 = v_theta*(v_theta*x0)
    x26 = p_r*x25
    x27 = v_phi*(v_phi*x10)
    x28 = v_theta*(v_theta*x5)
    x29 = p_r*x28
    x30 = v_phi*(v_phi*x7)
    x31 = p_m*(x29 + x8*x30)
    x32 = p_m*(x26 + x8*x27)
    x33 = x0*(p_r*x31 + x2*(p_mc*(x2*x28))) - x5*(p_r*x32 + x2*(p_mc*(x2*x25)))
    x34 = p_m*p_g
    x35 = x33 + x5*(x2*(p_mc*p_g) + p_r*x34)
    x36 = x35*x12 - (x10*(x8*x31) - x7*(x8*x32) + x7*(x8*x34))
    x37 = x29 + p_l*x30 - x35*x4 - x16*x36
    x38 = 1.0/x24*(x26 + p_l*x27 + x35*x21 - x22*x36 + x20*x37)
    x39 = x20*x38 - x19*x37
    x40 = x15*x36 - x16*x39 - x22*x38
    x41 = -(x24/x23)
    out[0] = v_theta
    out[1] = v_phi
    out[2] = v_x
    out[3] = x4*x39 - (x35*x3 + x12*x40) - x21*x38
    out[4] = x40
    out[5] = x18*x39
    out[6] = -x39
    out[7] = -x38
    out[8] = (x41 if x41 < 1.0 else 1.0)


@njit(error_model="numpy")
def mass_matrix(t, y, p, out):
    """Mass matrix M, row by row. 22 operations."""
    q_theta = y[0]
    q_phi = y[1]
    p_r = p[0]
    p_l = p[1]
    p_mc = p[2]
    p_Jc = p[3]
    p_m = p[4]
    p_J = p[5]
    p_mp = p[6]
    x0 = 0.5*p_r
    x1 = 0.5*p_l
    x2 = p_r*(p_m*x1)
    x3 = cos(q_theta)*(cos(q_phi)*x2) + sin(q_theta)*(sin(q_phi)*x2)
    out[0] = p_Jc + (p_m*(p_r*p_r) + p_mc*(x0*x0))
    out[1] = x3
    out[3] = x3
    out[4] = p_J + p_m*(x1*x1)
    out[8] = p_mp


@njit(error_model="numpy")
def forces(t, y, p, out):
    """Forces f of M a = f + G^T lambda. 52 operations."""
    q_theta = y[0]
    q_phi = y[1]
    v_theta = y[3]
    v_phi = y[4]
    p_r = p[0]
    p_l = p[1]
    p_mc = p[2]
    p_m = p[4]
    p_g = p[7]
    x0 = sin(q_theta)
    x1 = cos(q_theta)
    x2 = v_theta*(v_theta*x1)
    x3 = 0.5*p_l
    x4 = cos(q_phi)
    x5 = p_m*(p_r*x2 + x3*(v_phi*(v_phi*x4)))
    x6 = 0.5*p_r
    x7 = v_theta*(v_theta*x0)
    x8 = sin(q_phi)
    x9 = p_m*(p_r*x7 + x3*(v_phi*(v_phi*x8)))
    x10 = x0*(p_r*x5 + x6*(p_mc*(x6*x2))) - x1*(p_r*x9 + x6*(p_mc*(x6*x7)))
    x11 = p_m*p_g
    out[0] = -(x10 + x1*(x6*(p_mc*p_g) + p_r*x11))
    out[1] = -(x8*(x3*x5) - x4*(x3*x9) + x4*(x3*x11))
    out[2] = 0.0


@njit(error_model="numpy")
def energy(t, y, p, out):
    """Kinetic and potential energy. 50 operations."""
    q_theta = y[0]
    q_phi = y[1]
    v_theta = y[3]
    v_phi = y[4]
    v_x = y[5]
    p_r = p[0]
    p_l = p[1]
    p_mc = p[2]
    p_Jc = p[3]
    p_m = p[4]
    p_J = p[5]
    p_mp = p[6]
    p_g = p[7]
    x0 = 0.5*p_r
    x1 = sin(q_theta)
    x2 = v_theta*x1
    x3 = x0*x2
    x4 = v_theta*cos(q_theta)
    x5 = x0*x4
    x6 = 0.5*p_l
    x7 = sin(q_phi)
    x8 = p_r*x2 + x6*(v_phi*x7)
    x9 = p_r*x4 + x6*(v_phi*cos(q_phi))
    x10 = 0.5*p_mc*(x3*x3 + x5*x5) + 0.5*(v_theta*(v_theta*p_Jc)) + 0.5*p_m*(x8*x8 + x9*x9)
    out[0] = x10 + 0.5*(v_phi*(v_phi*p_J)) + 0.5*p_mp*(v_x*v_x)
    out[1] = p_mc*(p_g*(x1*x0)) + p_m*(p_g*(p_r*x1 + x7*x6))


@njit(error_model="numpy")
def residual(t, y, p, out):
    """M a - f - G^T lambda, then G a - gamma. 82 operations."""
    q_theta = y[0]
    q_phi = y[1]
    v_theta = y[3]
    v_phi = y[4]
    a_theta = y[6]
    a_phi = y[7]
    a_x = y[8]
    lam_pin_x_closes = y[9]
    lam_pin_y_closes = y[10]
    p_r = p[0]
    p_l = p[1]
    p_mc = p[2]
    p_Jc = p[3]
    p_m = p[4]
    p_J = p[5]
    p_mp = p[6]
    p_g = p[7]
    x0 = cos(q_theta)
    x1 = 0.5*p_r
    x2 = p_m*p_g
    x3 = sin(q_theta)
    x4 = a_theta*x0 - v_theta*(v_theta*x3)
    x5 = p_r*x4
    x6 = 0.5*p_l
    x7 = cos(q_phi)
    x8 = sin(q_phi)
    x9 = a_phi*x7 - v_phi*(v_phi*x8)
    x10 = p_m*(x5 + x6*x9)
    x11 = v_theta*(v_theta*x0) + a_theta*x3
    x12 = p_r*x11
    x13 = v_phi*(v_phi*x7) + a_phi*x8
    x14 = p_m*(x12 + x6*x13)
    x15 = a_theta*p_Jc + x0*(p_r*x10 + x1*(p_mc*(x1*x4))) + x3*(p_r*x14 + x1*(p_mc*(x1*x11)))
    x16 = x0*(x1*(p_mc*p_g) + p_r*x2) + x15 - (x0*(lam_pin_y_closes*p_r) - x3*(lam_pin_x_closes*p_r))
    x17 = x7*(x6*x2) + (a_phi*p_J + x7*(x6*x10) + x8*(x6*x14)) - (x7*(lam_pin_y_closes*p_l) - x8*(lam_pin_x_closes*p_l))
    out[0] = x16
    out[1] = x17
    out[2] = lam_pin_x_closes + a_x*p_mp
    out[3] = -(a_x + (x12 + p_l*x13))
    out[4] = x5 + p_l*x9


@njit(error_model="numpy")
def residual_jacobian(t, y, p, out):
    """Residual derivatives by q, v, a, lambda. 174 operations."""
    q_theta = y[0]
    q_phi = y[1]
    v_theta = y[3]
    v_phi = y[4]
    a_theta = y[6]
    a_phi = y[7]
    lam_pin_x_closes = y[9]
    lam_pin_y_closes = y[10]
    p_r = p[0]
    p_l = p[1]
    p_mc = p[2]
    p_Jc = p[3]
    p_m = p[4]
    p_J = p[5]
    p_mp = p[6]
    p_g = p[7]
    x0 = cos(q_theta)
    x1 = v_theta*x0
    x2 = sin(q_theta)
    x3 = v_theta*x1 + a_theta*x2
    x4 = p_r*x3
    x5 = 0.5*p_l
    x6 = cos(q_phi)
    x7 = v_phi*x6
    x8 = sin(q_phi)
    x9 = v_phi*x7 + a_phi*x8
    x10 = x5*x9
    x11 = p_m*(x4 + x10)
    x12 = 0.5*p_r
    x13 = x12*(p_mc*(x12*x3))
    x14 = v_theta*x2
    x15 = a_theta*x0 - v_theta*x14
    x16 = x12*(p_mc*(x12*x15))
    x17 = p_r*x15
    x18 = p_m*x17
    x19 = v_phi*x8
    x20 = a_phi*x6 - v_phi*x19
    x21 = x5*x20
    x22 = p_m*(x17 + x21)
    x23 = p_m*x4
    x24 = x0*(p_r*x11 + x13) + x2*(x16 + p_r*x18) - (x2*(p_r*x22 + x16) + x0*(x13 + p_r*x23))
    x25 = p_m*p_g
    x26 = x24 - x2*(x12*(p_mc*p_g) + p_r*x25) + (x2*(lam_pin_y_closes*p_r) + x0*(lam_pin_x_closes*p_r))
    x27 = p_m*x21
    x28 = p_m*x10
    x29 = x1 + x1
    x30 = p_r*x29
    x31 = p_m*x30
    x32 = x14 + x14
    x33 = p_r*x32
    x34 = p_m*x33
    x35 = x2*(p_r*x31 + x12*(p_mc*(x12*x29))) - x0*(p_r*x34 + x12*(p_mc*(x12*x32)))
    x36 = x7 + x7
    x37 = p_m*(x5*x36)
    x38 = x19 + x19
    x39 = p_m*(x5*x38)
    x40 = p_r*(p_m*x5)
    x41 = x0*(x6*x40) + x2*(x8*x40)
    x42 = p_r*x2
    x43 = p_r*x0
    x44 = x6*(x5*x11) + x8*(x5*x27) - (x8*(x5*x22) + x6*(x5*x28)) - x8*(x5*x25)
    x45 = x44 + (x8*(lam_pin_y_closes*p_l) + x6*(lam_pin_x_closes*p_l))
    x46 = p_l*x8
    x47 = p_l*x6
    out[0] = x26
    out[1] = x2*(p_r*x27) - x0*(p_r*x28)
    out[3] = x35
    out[4] = x2*(p_r*x37) - x0*(p_r*x39)
    out[6] = p_Jc + (p_m*(p_r*p_r) + p_mc*(x12*x12))
    out[7] = x41
    out[9] = x42
    out[10] = -x43
    out[11] = x8*(x5*x18) - x6*(x5*x23)
    out[12] = x45
    out[14] = x8*(x5*x31) - x6*(x5*x34)
    out[15] = x8*(x5*x37) - x6*(x5*x39)
    out[17] = x41
    out[18] = p_J + p_m*(x5*x5)
    out[20] = x46
    out[21] = -x47
    out[30] = p_mp
    out[31] = 1.0
    out[33] = -x17
    out[34] = -(p_l*x20)
    out[36] = -x30
    out[37] = -(p_l*x36)
    out[39] = -x42
    out[40] = -x46
    out[41] = -1.0
    out[44] = -x4
    out[45] = -(p_l*x9)
    out[47] = -x33
    out[48] = -(p_l*x38)
    out[50] = x43
    out[51] = x47


@njit(error_model="numpy")
def constraint_residual(t, y, p, out):
    """Position residuals, velocity residuals. 23 operations."""
    q_theta = y[0]
    q_phi = y[1]
    q_x = y[2]
    v_theta = y[3]
    v_phi = y[4]
    v_x = y[5]
    p_r = p[0]
    p_l = p[1]
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
    q_theta = y[0]
    q_phi = y[1]
    p_r = p[0]
    p_l = p[1]
    out[0] = -(p_r*sin(q_theta))
    out[1] = -(p_l*sin(q_phi))
    out[2] = -1.0
    out[3] = p_r*cos(q_theta)
    out[4] = p_l*cos(q_phi)


@njit(error_model="numpy")
def gamma(t, y, p, out):
    """Right-hand side of G a = gamma. 18 operations."""
    q_theta = y[0]
    q_phi = y[1]
    v_theta = y[3]
    v_phi = y[4]
    p_r = p[0]
    p_l = p[1]
    x0 = p_r*(v_theta*(v_theta*cos(q_theta))) + p_l*(v_phi*(v_phi*cos(q_phi)))
    x1 = p_r*(v_theta*(v_theta*sin(q_theta))) + p_l*(v_phi*(v_phi*sin(q_phi)))
    out[0] = x0
    out[1] = x1


@njit(error_model="numpy")
def project(t, y, p, out):
    """State moved onto the constraints, and the residuals it had. 110 operations."""
    q_theta = y[0]
    q_phi = y[1]
    q_x = y[2]
    v_theta = y[3]
    v_phi = y[4]
    v_x = y[5]
    p_r = p[0]
    p_l = p[1]
    p_mc = p[2]
    p_Jc = p[3]
    p_m = p[4]
    p_J = p[5]
    p_mp = p[6]
    x0 = sin(q_theta)
    x1 = p_r*x0
    x2 = 0.5*p_r
    x3 = 1.0/(p_Jc + (p_m*(p_r*p_r) + p_mc*(x2*x2)))
    x4 = x1*x3
    x5 = cos(q_phi)
    x6 = p_l*x5
    x7 = cos(q_theta)
    x8 = p_r*x7
    x9 = x6 + x8 - q_x
    x10 = 1.0/p_mp
    x11 = 0.5*p_l
    x12 = p_r*(p_m*x11)
    x13 = sin(q_phi)
    x14 = x7*(x5*x12) + x0*(x13*x12)
    x15 = x14*x3
    x16 = p_l*x13
    x17 = x1*x15 - x16
    x18 = 1.0/(p_J + p_m*(x11*x11) - x14*x15)
    x19 = x17*x18
    x20 = 1.0/(x10 + x1*x4 + x17*x19)
    x21 = x6 - x8*x15
    x22 = x8*x4 - x21*x19
    x23 = x22*x20
    x24 = x8*x3
    x25 = x21*x18
    x26 = 1.0/(x22*x23 - (x8*x24 + x21*x25))
    x27 = x16 + x1
    x28 = x26*(x27 + x9*x23)
    x29 = x9*x20 - x23*x28
    x30 = x25*x28 - x19*x29
    x31 = q_theta + (x4*x29 - x15*x30 + x24*x28)
    x32 = q_phi + x30
    x33 = v_x + (p_r*(v_theta*sin(x31)) + p_l*(v_phi*sin(x32)))
    x34 = p_r*(v_theta*cos(x31)) + p_l*(v_phi*cos(x32))
    x35 = x26*(x23*x33 - x34)
    x36 = x23*x35 - x20*x33
    x37 = x19*x36 + x25*x35
    out[0] = x31
    out[1] = x32
    out[2] = q_x + x10*x29
    out[3] = v_theta + (x15*x37 + x4*x36 - x24*x35)
    out[4] = v_phi - x37
    out[5] = v_x + x10*x36
    out[6] = x9
    out[7] = x27
    out[8] = -x33
    out[9] = x34


@njit(error_model="numpy")
def poses(t, y, p, out):
    """Per body: position, rotation matrix (body to world). 16 operations."""
    q_theta = y[0]
    q_phi = y[1]
    q_x = y[2]
    p_r = p[0]
    p_l = p[1]
    x0 = cos(q_theta)
    x1 = 0.5*p_r
    x2 = sin(q_theta)
    x3 = cos(q_phi)
    x4 = 0.5*p_l
    x5 = sin(q_phi)
    out[0] = x0*x1
    out[1] = x2*x1
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
    out[12] = p_r*x0 + x3*x4
    out[13] = p_r*x2 + x5*x4
    out[14] = 0.0
    out[15] = x3
    out[16] = -x5
    out[17] = 0.0
    out[18] = x5
    out[19] = x3
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
