"""pendulum_field: equations of motion, written by symgen 0.1.0. Do not edit.

25 independent pendulums side by side, each with its own length
"""

from math import cos, sin

from numba import njit

MODEL = {
    "abi": 1,
    "generator": "symgen 0.1.0",
    "source": "sha256:37d3afecddf7bb26a538a7a23bc53f1d5e62176f07b1e7f749167907fbcb9fa9",
    "name": "pendulum_field",
    "description": "25 independent pendulums side by side, each with its own length",
    "nq": 25,
    "nv": 25,
    "nh": 0,
    "nn": 0,
    "nw": 0,
    "coordinates": [
        {"name": "theta1", "unit": "rad", "value": 0.3, "enforced": True},
        {"name": "theta2", "unit": "rad", "value": 0.3, "enforced": True},
        {"name": "theta3", "unit": "rad", "value": 0.3, "enforced": True},
        {"name": "theta4", "unit": "rad", "value": 0.3, "enforced": True},
        {"name": "theta5", "unit": "rad", "value": 0.3, "enforced": True},
        {"name": "theta6", "unit": "rad", "value": 0.3, "enforced": True},
        {"name": "theta7", "unit": "rad", "value": 0.3, "enforced": True},
        {"name": "theta8", "unit": "rad", "value": 0.3, "enforced": True},
        {"name": "theta9", "unit": "rad", "value": 0.3, "enforced": True},
        {"name": "theta10", "unit": "rad", "value": 0.3, "enforced": True},
        {"name": "theta11", "unit": "rad", "value": 0.3, "enforced": True},
        {"name": "theta12", "unit": "rad", "value": 0.3, "enforced": True},
        {"name": "theta13", "unit": "rad", "value": 0.3, "enforced": True},
        {"name": "theta14", "unit": "rad", "value": 0.3, "enforced": True},
        {"name": "theta15", "unit": "rad", "value": 0.3, "enforced": True},
        {"name": "theta16", "unit": "rad", "value": 0.3, "enforced": True},
        {"name": "theta17", "unit": "rad", "value": 0.3, "enforced": True},
        {"name": "theta18", "unit": "rad", "value": 0.3, "enforced": True},
        {"name": "theta19", "unit": "rad", "value": 0.3, "enforced": True},
        {"name": "theta20", "unit": "rad", "value": 0.3, "enforced": True},
        {"name": "theta21", "unit": "rad", "value": 0.3, "enforced": True},
        {"name": "theta22", "unit": "rad", "value": 0.3, "enforced": True},
        {"name": "theta23", "unit": "rad", "value": 0.3, "enforced": True},
        {"name": "theta24", "unit": "rad", "value": 0.3, "enforced": True},
        {"name": "theta25", "unit": "rad", "value": 0.3, "enforced": True},
    ],
    "quaternions": [],
    "rates": [
        {"name": "theta1", "unit": "rad/s", "value": 0.0, "enforced": True},
        {"name": "theta2", "unit": "rad/s", "value": 0.0, "enforced": True},
        {"name": "theta3", "unit": "rad/s", "value": 0.0, "enforced": True},
        {"name": "theta4", "unit": "rad/s", "value": 0.0, "enforced": True},
        {"name": "theta5", "unit": "rad/s", "value": 0.0, "enforced": True},
        {"name": "theta6", "unit": "rad/s", "value": 0.0, "enforced": True},
        {"name": "theta7", "unit": "rad/s", "value": 0.0, "enforced": True},
        {"name": "theta8", "unit": "rad/s", "value": 0.0, "enforced": True},
        {"name": "theta9", "unit": "rad/s", "value": 0.0, "enforced": True},
        {"name": "theta10", "unit": "rad/s", "value": 0.0, "enforced": True},
        {"name": "theta11", "unit": "rad/s", "value": 0.0, "enforced": True},
        {"name": "theta12", "unit": "rad/s", "value": 0.0, "enforced": True},
        {"name": "theta13", "unit": "rad/s", "value": 0.0, "enforced": True},
        {"name": "theta14", "unit": "rad/s", "value": 0.0, "enforced": True},
        {"name": "theta15", "unit": "rad/s", "value": 0.0, "enforced": True},
        {"name": "theta16", "unit": "rad/s", "value": 0.0, "enforced": True},
        {"name": "theta17", "unit": "rad/s", "value": 0.0, "enforced": True},
        {"name": "theta18", "unit": "rad/s", "value": 0.0, "enforced": True},
        {"name": "theta19", "unit": "rad/s", "value": 0.0, "enforced": True},
        {"name": "theta20", "unit": "rad/s", "value": 0.0, "enforced": True},
        {"name": "theta21", "unit": "rad/s", "value": 0.0, "enforced": True},
        {"name": "theta22", "unit": "rad/s", "value": 0.0, "enforced": True},
        {"name": "theta23", "unit": "rad/s", "value": 0.0, "enforced": True},
        {"name": "theta24", "unit": "rad/s", "value": 0.0, "enforced": True},
        {"name": "theta25", "unit": "rad/s", "value": 0.0, "enforced": True},
    ],
    "parameters": [
        {"name": "m", "unit": "kg", "value": 0.1, "doc": ""},
        {"name": "g", "unit": "m/s^2", "value": 9.81, "doc": ""},
        {"name": "l1", "unit": "m", "value": 0.5, "doc": "length"},
        {"name": "x1", "unit": "m", "value": 0.0, "doc": "place of the pivot"},
        {"name": "z1", "unit": "m", "value": 0.0, "doc": ""},
        {"name": "l2", "unit": "m", "value": 0.4535147392290249, "doc": "length"},
        {"name": "x2", "unit": "m", "value": 0.3, "doc": "place of the pivot"},
        {"name": "z2", "unit": "m", "value": 0.0, "doc": ""},
        {"name": "l3", "unit": "m", "value": 0.4132231404958677, "doc": "length"},
        {"name": "x3", "unit": "m", "value": 0.6, "doc": "place of the pivot"},
        {"name": "z3", "unit": "m", "value": 0.0, "doc": ""},
        {"name": "l4", "unit": "m", "value": 0.37807183364839325, "doc": "length"},
        {"name": "x4", "unit": "m", "value": 0.8999999999999999, "doc": "place of the pivot"},
        {"name": "z4", "unit": "m", "value": 0.0, "doc": ""},
        {"name": "l5", "unit": "m", "value": 0.3472222222222222, "doc": "length"},
        {"name": "x5", "unit": "m", "value": 1.2, "doc": "place of the pivot"},
        {"name": "z5", "unit": "m", "value": 0.0, "doc": ""},
        {"name": "l6", "unit": "m", "value": 0.32, "doc": "length"},
        {"name": "x6", "unit": "m", "value": 0.0, "doc": "place of the pivot"},
        {"name": "z6", "unit": "m", "value": -0.3, "doc": ""},
        {"name": "l7", "unit": "m", "value": 0.29585798816568043, "doc": "length"},
        {"name": "x7", "unit": "m", "value": 0.3, "doc": "place of the pivot"},
        {"name": "z7", "unit": "m", "value": -0.3, "doc": ""},
        {"name": "l8", "unit": "m", "value": 0.2743484224965706, "doc": "length"},
        {"name": "x8", "unit": "m", "value": 0.6, "doc": "place of the pivot"},
        {"name": "z8", "unit": "m", "value": -0.3, "doc": ""},
        {"name": "l9", "unit": "m", "value": 0.2551020408163266, "doc": "length"},
        {"name": "x9", "unit": "m", "value": 0.8999999999999999, "doc": "place of the pivot"},
        {"name": "z9", "unit": "m", "value": -0.3, "doc": ""},
        {"name": "l10", "unit": "m", "value": 0.23781212841854935, "doc": "length"},
        {"name": "x10", "unit": "m", "value": 1.2, "doc": "place of the pivot"},
        {"name": "z10", "unit": "m", "value": -0.3, "doc": ""},
        {"name": "l11", "unit": "m", "value": 0.2222222222222222, "doc": "length"},
        {"name": "x11", "unit": "m", "value": 0.0, "doc": "place of the pivot"},
        {"name": "z11", "unit": "m", "value": -0.6, "doc": ""},
        {"name": "l12", "unit": "m", "value": 0.20811654526534856, "doc": "length"},
        {"name": "x12", "unit": "m", "value": 0.3, "doc": "place of the pivot"},
        {"name": "z12", "unit": "m", "value": -0.6, "doc": ""},
        {"name": "l13", "unit": "m", "value": 0.19531249999999997, "doc": "length"},
        {"name": "x13", "unit": "m", "value": 0.6, "doc": "place of the pivot"},
        {"name": "z13", "unit": "m", "value": -0.6, "doc": ""},
        {"name": "l14", "unit": "m", "value": 0.18365472910927458, "doc": "length"},
        {"name": "x14", "unit": "m", "value": 0.8999999999999999, "doc": "place of the pivot"},
        {"name": "z14", "unit": "m", "value": -0.6, "doc": ""},
        {"name": "l15", "unit": "m", "value": 0.17301038062283738, "doc": "length"},
        {"name": "x15", "unit": "m", "value": 1.2, "doc": "place of the pivot"},
        {"name": "z15", "unit": "m", "value": -0.6, "doc": ""},
        {"name": "l16", "unit": "m", "value": 0.16326530612244897, "doc": "length"},
        {"name": "x16", "unit": "m", "value": 0.0, "doc": "place of the pivot"},
        {"name": "z16", "unit": "m", "value": -0.8999999999999999, "doc": ""},
        {"name": "l17", "unit": "m", "value": 0.15432098765432098, "doc": "length"},
        {"name": "x17", "unit": "m", "value": 0.3, "doc": "place of the pivot"},
        {"name": "z17", "unit": "m", "value": -0.8999999999999999, "doc": ""},
        {"name": "l18", "unit": "m", "value": 0.14609203798392986, "doc": "length"},
        {"name": "x18", "unit": "m", "value": 0.6, "doc": "place of the pivot"},
        {"name": "z18", "unit": "m", "value": -0.8999999999999999, "doc": ""},
        {"name": "l19", "unit": "m", "value": 0.13850415512465375, "doc": "length"},
        {"name": "x19", "unit": "m", "value": 0.8999999999999999, "doc": "place of the pivot"},
        {"name": "z19", "unit": "m", "value": -0.8999999999999999, "doc": ""},
        {"name": "l20", "unit": "m", "value": 0.13149243918474687, "doc": "length"},
        {"name": "x20", "unit": "m", "value": 1.2, "doc": "place of the pivot"},
        {"name": "z20", "unit": "m", "value": -0.8999999999999999, "doc": ""},
        {"name": "l21", "unit": "m", "value": 0.125, "doc": "length"},
        {"name": "x21", "unit": "m", "value": 0.0, "doc": "place of the pivot"},
        {"name": "z21", "unit": "m", "value": -1.2, "doc": ""},
        {"name": "l22", "unit": "m", "value": 0.1189767995240928, "doc": "length"},
        {"name": "x22", "unit": "m", "value": 0.3, "doc": "place of the pivot"},
        {"name": "z22", "unit": "m", "value": -1.2, "doc": ""},
        {"name": "l23", "unit": "m", "value": 0.11337868480725623, "doc": "length"},
        {"name": "x23", "unit": "m", "value": 0.6, "doc": "place of the pivot"},
        {"name": "z23", "unit": "m", "value": -1.2, "doc": ""},
        {"name": "l24", "unit": "m", "value": 0.1081665765278529, "doc": "length"},
        {"name": "x24", "unit": "m", "value": 0.8999999999999999, "doc": "place of the pivot"},
        {"name": "z24", "unit": "m", "value": -1.2, "doc": ""},
        {"name": "l25", "unit": "m", "value": 0.10330578512396693, "doc": "length"},
        {"name": "x25", "unit": "m", "value": 1.2, "doc": "place of the pivot"},
        {"name": "z25", "unit": "m", "value": -1.2, "doc": ""},
    ],
    "inputs": [],
    "constants": [],
    "constraints": [],
    "outputs": [],
    "events": [],
    "bodies": [
        {"name": "bob1", "planar": False, "shape": "sphere", "sizes": 1, "mesh": ""},
        {"name": "bob2", "planar": False, "shape": "sphere", "sizes": 1, "mesh": ""},
        {"name": "bob3", "planar": False, "shape": "sphere", "sizes": 1, "mesh": ""},
        {"name": "bob4", "planar": False, "shape": "sphere", "sizes": 1, "mesh": ""},
        {"name": "bob5", "planar": False, "shape": "sphere", "sizes": 1, "mesh": ""},
        {"name": "bob6", "planar": False, "shape": "sphere", "sizes": 1, "mesh": ""},
        {"name": "bob7", "planar": False, "shape": "sphere", "sizes": 1, "mesh": ""},
        {"name": "bob8", "planar": False, "shape": "sphere", "sizes": 1, "mesh": ""},
        {"name": "bob9", "planar": False, "shape": "sphere", "sizes": 1, "mesh": ""},
        {"name": "bob10", "planar": False, "shape": "sphere", "sizes": 1, "mesh": ""},
        {"name": "bob11", "planar": False, "shape": "sphere", "sizes": 1, "mesh": ""},
        {"name": "bob12", "planar": False, "shape": "sphere", "sizes": 1, "mesh": ""},
        {"name": "bob13", "planar": False, "shape": "sphere", "sizes": 1, "mesh": ""},
        {"name": "bob14", "planar": False, "shape": "sphere", "sizes": 1, "mesh": ""},
        {"name": "bob15", "planar": False, "shape": "sphere", "sizes": 1, "mesh": ""},
        {"name": "bob16", "planar": False, "shape": "sphere", "sizes": 1, "mesh": ""},
        {"name": "bob17", "planar": False, "shape": "sphere", "sizes": 1, "mesh": ""},
        {"name": "bob18", "planar": False, "shape": "sphere", "sizes": 1, "mesh": ""},
        {"name": "bob19", "planar": False, "shape": "sphere", "sizes": 1, "mesh": ""},
        {"name": "bob20", "planar": False, "shape": "sphere", "sizes": 1, "mesh": ""},
        {"name": "bob21", "planar": False, "shape": "sphere", "sizes": 1, "mesh": ""},
        {"name": "bob22", "planar": False, "shape": "sphere", "sizes": 1, "mesh": ""},
        {"name": "bob23", "planar": False, "shape": "sphere", "sizes": 1, "mesh": ""},
        {"name": "bob24", "planar": False, "shape": "sphere", "sizes": 1, "mesh": ""},
        {"name": "bob25", "planar": False, "shape": "sphere", "sizes": 1, "mesh": ""},
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
        "rhs": 201,
        "mass_matrix": 50,
        "forces": 101,
        "energy": 401,
        "residual": 226,
        "residual_jacobian": 150,
        "poses": 150,
        "shapes": 0,
        "limits": 0,
    },
    "hoisted": {
        "rhs": 26,
        "mass_matrix": 25,
        "forces": 26,
        "energy": 26,
        "residual": 51,
        "residual_jacobian": 50,
    },
    "run": {
        "t_end": 28.4,
        "fps": 60.0,
    },
    "limits": [
        {"name": "bodies.bob1.mass", "bound": "zero or more"},
    ],
    "subsystems": [
        {"coordinates": [[0], [1], [2], [3], [4], [5], [6], [7], [8], [9], [10], [11], [12], [13], [14], [15], [16], [17], [18], [19], [20], [21], [22], [23], [24]], "rates": [[0], [1], [2], [3], [4], [5], [6], [7], [8], [9], [10], [11], [12], [13], [14], [15], [16], [17], [18], [19], [20], [21], [22], [23], [24]], "constraints": [[], [], [], [], [], [], [], [], [], [], [], [], [], [], [], [], [], [], [], [], [], [], [], [], []]},
    ],
}

@njit(error_model="numpy")
def rhs(t, y, p, out):
    """State derivative: rates, accelerations. 201 operations."""
    p_m = p[0]
    p_g = p[1]
    c0 = p_m*p_g
    # 25 equal subsystems: theta1; …; theta25
    for k in range(25):
        p_l1 = p[2 + 3*k]
        c1 = p_l1*c0*(1.0/(p_m*(p_l1*p_l1)))
        q_theta1 = y[k]
        v_theta1 = y[25 + k]
        out[k] = v_theta1
        out[25 + k] = -(sin(q_theta1)*c1)


@njit(error_model="numpy")
def mass_matrix(t, y, p, out):
    """Mass matrix M, row by row. 50 operations."""
    p_m = p[0]
    # 25 equal subsystems: theta1; …; theta25
    for k in range(25):
        p_l1 = p[2 + 3*k]
        c0 = p_m*(p_l1*p_l1)
        out[26*k] = c0


@njit(error_model="numpy")
def forces(t, y, p, out):
    """Forces f of M a = f + G^T lambda. 101 operations."""
    p_m = p[0]
    p_g = p[1]
    c0 = p_m*p_g
    # 25 equal subsystems: theta1; …; theta25
    for k in range(25):
        p_l1 = p[2 + 3*k]
        c1 = p_l1*c0
        q_theta1 = y[k]
        out[k] = -(sin(q_theta1)*c1)


@njit(error_model="numpy")
def energy(t, y, p, out):
    """Kinetic and potential energy. 401 operations."""
    p_m = p[0]
    p_g = p[1]
    c0 = 0.5*p_m
    e0 = 0.0
    e1 = 0.0
    # 25 equal subsystems: theta1; …; theta25
    for k in range(25):
        p_l1 = p[2 + 3*k]
        c1 = p_m*(p_g*p_l1)
        q_theta1 = y[k]
        v_theta1 = y[25 + k]
        x0 = cos(q_theta1)
        x1 = p_l1*(v_theta1*x0)
        x2 = p_l1*(v_theta1*sin(q_theta1))
        e0 = e0 + c0*(x1*x1 + x2*x2)
        e1 = e1 + -(x0*c1)
    out[0] = e0
    out[1] = e1


@njit(error_model="numpy")
def residual(t, y, p, out):
    """M a - f - G^T lambda, then G a - gamma. 226 operations."""
    p_m = p[0]
    p_g = p[1]
    c0 = p_m*p_g
    # 25 equal subsystems: theta1; …; theta25
    for k in range(25):
        p_l1 = p[2 + 3*k]
        c1 = p_l1*c0
        c2 = 0.5*(p_m*(p_l1*p_l1))
        q_theta1 = y[k]
        a_theta1 = y[50 + k]
        x0 = a_theta1*c2
        out[k] = sin(q_theta1)*c1 + (x0 + x0)


@njit(error_model="numpy")
def residual_jacobian(t, y, p, out):
    """Residual derivatives by q, v, a, lambda. 150 operations."""
    p_m = p[0]
    p_g = p[1]
    # 25 equal subsystems: theta1; …; theta25
    for k in range(25):
        p_l1 = p[2 + 3*k]
        c0 = p_m*(p_g*p_l1)
        c1 = p_m*(p_l1*p_l1)
        q_theta1 = y[k]
        out[76*k] = cos(q_theta1)*c0
        out[50 + 76*k] = c1


@njit(error_model="numpy")
def poses(t, y, p, out):
    """Per body: position, rotation matrix (body to world). 150 operations."""
    # 25 equal subsystems: theta1; …; theta25
    for k in range(25):
        p_l1 = p[2 + 3*k]
        p_x1 = p[3 + 3*k]
        p_z1 = p[4 + 3*k]
        q_theta1 = y[k]
        out[12*k] = p_x1 + p_l1*sin(q_theta1)
        out[1 + 12*k] = -(p_l1*cos(q_theta1))
        out[2 + 12*k] = p_z1
        out[3 + 12*k] = 1.0
        out[4 + 12*k] = 0.0
        out[5 + 12*k] = 0.0
        out[6 + 12*k] = 0.0
        out[7 + 12*k] = 1.0
        out[8 + 12*k] = 0.0
        out[9 + 12*k] = 0.0
        out[10 + 12*k] = 0.0
        out[11 + 12*k] = 1.0


@njit(error_model="numpy")
def shapes(t, y, p, out):
    """Sizes of the bodies' shapes. 0 operations."""
    # 25 equal subsystems: theta1; …; theta25
    for k in range(25):
        out[k] = 0.04


@njit(error_model="numpy")
def limits(t, y, p, out):
    """Numbers of parameters that have a bound. 0 operations."""
    p_m = p[0]
    out[0] = p_m
