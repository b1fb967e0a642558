"""cart_pole: equations of motion, written by symgen 0.1.0. Do not edit.

Pole on a cart that a force pushes; it falls when nobody balances it
"""

from math import cos, sin

from numba import njit

MODEL = {
    "abi": 1,
    "generator": "symgen 0.1.0",
    "source": "sha256:30666a085d0c4db4ec1db6d1783fcffa9808ec361beb8ce7a48b0697982b11d2",
    "name": "cart_pole",
    "description": "Pole on a cart that a force pushes; it falls when nobody balances it",
    "nq": 2,
    "nv": 2,
    "nh": 0,
    "nn": 0,
    "nw": 1,
    "coordinates": [
        {"name": "x", "unit": "m", "value": 0.0, "enforced": True},
        {"name": "theta", "unit": "rad", "value": 0.1, "enforced": True},
    ],
    "quaternions": [],
    "rates": [
        {"name": "x", "unit": "m/s", "value": 0.0, "enforced": True},
        {"name": "theta", "unit": "rad/s", "value": 0.0, "enforced": True},
    ],
    "parameters": [
        {"name": "M", "unit": "kg", "value": 1.0, "doc": "mass of the cart"},
        {"name": "mp", "unit": "kg", "value": 0.1, "doc": "mass at the tip of the pole"},
        {"name": "l", "unit": "m", "value": 0.5, "doc": "length of the pole"},
        {"name": "b", "unit": "N*s/m", "value": 0.1, "doc": "viscous friction of the cart"},
        {"name": "g", "unit": "m/s^2", "value": 9.81, "doc": ""},
    ],
    "inputs": [
        {"name": "F", "unit": "N", "value": 0.0},
    ],
    "constants": [],
    "constraints": [],
    "outputs": [
        {"name": "tip_height", "unit": "m"},
    ],
    "events": [],
    "bodies": [
        {"name": "cart", "planar": True, "shape": "box", "sizes": 3, "mesh": ""},
        {"name": "bob", "planar": True, "shape": "sphere", "sizes": 1, "mesh": ""},
        {"name": "pole", "planar": True, "shape": "capsule", "sizes": 2, "mesh": ""},
    ],
    "structure": {
        "conservative": False,
        "time_dependent": False,
        "constant_mass": False,
        "diagonal_mass": False,
        "velocity_dependent": True,
        "separable": False,
    },
    "operations": {
        "rhs": 39,
        "mass_matrix": 6,
        "forces": 22,
        "energy": 19,
        "residual": 29,
        "residual_jacobian": 40,
        "poses": 13,
        "shapes": 0,
        "outputs": 2,
        "marks": 2,
        "limits": 0,
    },
    "hoisted": {
        "rhs": 6,
        "mass_matrix": 3,
        "forces": 3,
        "energy": 3,
        "residual": 3,
        "residual_jacobian": 4,
        "poses": 1,
        "marks": 1,
    },
    "run": {
        "t_end": 10.0,
        "fps": 60.0,
    },
    "limits": [
        {"name": "bodies.cart.mass", "bound": "zero or more"},
        {"name": "bodies.bob.mass", "bound": "zero or more"},
        {"name": "bodies.pole.shape.capsule[1]", "bound": "zero or more"},
    ],
    "subsystems": [],
    "marks": [
        {"kind": "pin", "name": "pole_1", "body": "pole", "numbers": 6},
        {"kind": "rail", "name": "rail", "body": "", "numbers": 6},
        {"kind": "force", "name": "push", "body": "", "numbers": 6, "moves": True},
    ],
}

@njit(error_model="numpy")
def rhs(t, y, p, out):
    """State derivative: rates, accelerations, power. 39 operations."""
    p_M = p[0]
    p_mp = p[1]
    p_l = p[2]
    p_b = p[3]
    p_g = p[4]
    c0 = 1.0/(p_M + p_mp)
    c1 = p_mp*p_l
    c2 = c1*c0
    c3 = p_mp*(p_l*p_l)
    c4 = p_l*c1
    c5 = p_l*(p_mp*p_g)
    q_theta = y[1]
    v_x = y[2]
    v_theta = y[3]
    u_F = p[5]
    x0 = u_F - v_x*p_b
    x1 = sin(q_theta)
    x2 = v_theta*(v_theta*x1)
    x3 = x0 + c1*x2
    x4 = cos(q_theta)
    x5 = x4*c2
    x6 = 1.0/(c3 - x4*c1*x5)*(c4*(x1*(v_theta*(v_theta*x4))) - c4*(x4*x2) - x1*c5 + x3*x5)
    out[0] = v_x
    out[1] = v_theta
    out[2] = c0*x3 + x5*x6
    out[3] = -x6
    out[4] = v_x*x0


@njit(error_model="numpy")
def mass_matrix(t, y, p, out):
    """Mass matrix M, row by row. 6 operations."""
    p_M = p[0]
    p_mp = p[1]
    p_l = p[2]
    c0 = p_M + p_mp
    c1 = p_mp*p_l
    c2 = p_mp*(p_l*p_l)
    q_theta = y[1]
    x0 = cos(q_theta)*c1
    out[0] = c0
    out[1] = x0
    out[2] = x0
    out[3] = c2


@njit(error_model="numpy")
def forces(t, y, p, out):
    """Forces f of M a = f + G^T lambda. 22 operations."""
    p_mp = p[1]
    p_l = p[2]
    p_b = p[3]
    p_g = p[4]
    c0 = p_mp*p_l
    c1 = p_l*c0
    c2 = p_l*(p_mp*p_g)
    q_theta = y[1]
    v_x = y[2]
    v_theta = y[3]
    u_F = p[5]
    x0 = sin(q_theta)
    x1 = v_theta*(v_theta*x0)
    x2 = cos(q_theta)
    out[0] = u_F - v_x*p_b + c0*x1
    out[1] = -(c1*(x0*(v_theta*(v_theta*x2))) - c1*(x2*x1) - x0*c2)


@njit(error_model="numpy")
def energy(t, y, p, out):
    """Kinetic and potential energy. 19 operations."""
    p_M = p[0]
    p_mp = p[1]
    p_l = p[2]
    p_g = p[4]
    c0 = 0.5*p_M
    c1 = 0.5*p_mp
    c2 = p_mp*(p_l*p_g)
    q_theta = y[1]
    v_x = y[2]
    v_theta = y[3]
    x0 = cos(q_theta)
    x1 = v_x + p_l*(v_theta*x0)
    x2 = p_l*(v_theta*sin(q_theta))
    out[0] = c0*(v_x*v_x) + c1*(x1*x1 + x2*x2)
    out[1] = x0*c2


@njit(error_model="numpy")
def residual(t, y, p, out):
    """M a - f - G^T lambda, then G a - gamma. 29 operations."""
    p_M = p[0]
    p_mp = p[1]
    p_l = p[2]
    p_b = p[3]
    p_g = p[4]
    c0 = p_mp*p_l
    c1 = p_l*c0
    c2 = p_l*(p_mp*p_g)
    q_theta = y[1]
    v_x = y[2]
    v_theta = y[3]
    a_x = y[4]
    a_theta = y[5]
    u_F = p[5]
    x0 = cos(q_theta)
    x1 = sin(q_theta)
    x2 = a_x + p_l*(a_theta*x0 - v_theta*(v_theta*x1))
    x3 = c1*(x1*(v_theta*(v_theta*x0) + a_theta*x1)) + c0*(x0*x2) - x1*c2
    out[0] = a_x*p_M + p_mp*x2 - (u_F - v_x*p_b)
    out[1] = x3


@njit(error_model="numpy")
def residual_jacobian(t, y, p, out):
    """Residual derivatives by q, v, a, lambda. 40 operations."""
    p_M = p[0]
    p_mp = p[1]
    p_l = p[2]
    p_b = p[3]
    p_g = p[4]
    c0 = p_mp*p_l
    c1 = p_M + p_mp
    c2 = p_mp*p_g
    c3 = p_mp*(p_l*p_l)
    q_theta = y[1]
    v_theta = y[3]
    a_x = y[4]
    a_theta = y[5]
    x0 = cos(q_theta)
    x1 = v_theta*x0
    x2 = sin(q_theta)
    x3 = c0*(v_theta*x1 + a_theta*x2)
    x4 = v_theta*x2
    x5 = c0*(x4 + x4)
    x6 = x0*c0
    x7 = p_l*x2
    x8 = a_theta*x0 - v_theta*x4
    x9 = p_l*x0
    out[1] = -x3
    out[2] = p_b
    out[3] = -x5
    out[4] = c1
    out[5] = x6
    out[7] = c0*(x7*x8) + x9*(x3 - c2) - x9*x3 - p_mp*(x7*(a_x + p_l*x8))
    out[9] = c0*(x7*(x1 + x1)) - x9*x5
    out[10] = x6
    out[11] = c3


@njit(error_model="numpy")
def poses(t, y, p, out):
    """Per body: position, rotation matrix (body to world). 13 operations."""
    p_l = p[2]
    c0 = 0.5*p_l
    q_x = y[0]
    q_theta = y[1]
    x0 = sin(q_theta)
    x1 = cos(q_theta)
    x2 = 1.5707963267948966 - q_theta
    x3 = cos(x2)
    x4 = sin(x2)
    out[0] = q_x
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
    out[12] = q_x + p_l*x0
    out[13] = p_l*x1
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
    out[24] = q_x + x0*c0
    out[25] = x1*c0
    out[26] = 0.0
    out[27] = x3
    out[28] = -x4
    out[29] = 0.0
    out[30] = x4
    out[31] = x3
    out[32] = 0.0
    out[33] = 0.0
    out[34] = 0.0
    out[35] = 1.0


@njit(error_model="numpy")
def shapes(t, y, p, out):
    """Sizes of the bodies' shapes. 0 operations."""
    p_l = p[2]
    out[0] = 0.4
    out[1] = 0.15
    out[2] = 0.2
    out[3] = 0.05
    out[4] = 0.012
    out[5] = p_l


@njit(error_model="numpy")
def outputs(t, y, p, out):
    """Outputs. 2 operations."""
    p_l = p[2]
    q_theta = y[1]
    out[0] = p_l*cos(q_theta)


@njit(error_model="numpy")
def marks(t, y, p, out):
    """What a picture shows besides bodies, as `marks` lists it. 2 operations."""
    p_l = p[2]
    c0 = -(0.5*p_l)
    q_x = y[0]
    u_F = p[5]
    out[0] = c0
    out[5] = 1.0
    out[6] = -0.8
    out[7] = -0.075
    out[9] = 0.8
    out[10] = -0.075
    out[12] = q_x
    out[15] = u_F


@njit(error_model="numpy")
def limits(t, y, p, out):
    """Numbers of parameters that have a bound. 0 operations."""
    p_M = p[0]
    p_mp = p[1]
    p_l = p[2]
    out[0] = p_M
    out[1] = p_mp
    out[2] = p_l
