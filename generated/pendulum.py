"""pendulum: equations of motion, written by symgen 0.1.0. Do not edit.

Plane pendulum: a point mass on a massless rod
"""

from math import cos, sin

from numba import njit

MODEL = {
    "abi": 1,
    "generator": "symgen 0.1.0",
    "source": "sha256:0ecbbeff48848ca5ab9dc610e4408d121f2e9b1a96a6bd2814cb3275ae18792f",
    "name": "pendulum",
    "description": "Plane pendulum: a point mass on a massless rod",
    "nq": 1,
    "nv": 1,
    "nh": 0,
    "nn": 0,
    "nw": 0,
    "coordinates": [
        {"name": "theta", "unit": "rad", "value": 0.2, "enforced": True},
    ],
    "quaternions": [],
    "rates": [
        {"name": "theta", "unit": "rad/s", "value": 0.0, "enforced": True},
    ],
    "parameters": [
        {"name": "L", "unit": "m", "value": 0.5, "doc": "length of the rod"},
        {"name": "m", "unit": "kg", "value": 1.0, "doc": "mass of the bob"},
        {"name": "g", "unit": "m/s^2", "value": 9.81, "doc": ""},
    ],
    "inputs": [],
    "constants": [],
    "constraints": [],
    "outputs": [],
    "events": [],
    "bodies": [
        {"name": "bob", "planar": True, "shape": "sphere", "sizes": 1, "mesh": ""},
        {"name": "rod", "planar": True, "shape": "capsule", "sizes": 2, "mesh": ""},
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
        "rhs": 9,
        "mass_matrix": 2,
        "forces": 5,
        "energy": 15,
        "residual": 10,
        "residual_jacobian": 6,
        "poses": 13,
        "shapes": 0,
        "marks": 2,
        "limits": 0,
    },
    "hoisted": {
        "rhs": 1,
        "mass_matrix": 1,
        "forces": 1,
        "energy": 2,
        "residual": 2,
        "residual_jacobian": 2,
        "poses": 1,
        "marks": 1,
    },
    "run": {
        "t_end": 10.0,
        "fps": 60.0,
    },
    "limits": [
        {"name": "bodies.bob.mass", "bound": "zero or more"},
        {"name": "bodies.rod.shape.capsule[1]", "bound": "zero or more"},
    ],
    "subsystems": [],
    "marks": [
        {"kind": "pin", "name": "rod_1", "body": "rod", "numbers": 6},
        {"kind": "ground", "name": "rod_1", "body": "", "numbers": 3},
    ],
}

@njit(error_model="numpy")
def rhs(t, y, p, out):
    """State derivative: rates, accelerations. 9 operations."""
    p_L = p[0]
    p_m = p[1]
    p_g = p[2]
    c0 = p_L*(p_m*p_g)*(1.0/(p_m*(p_L*p_L)))
    q_theta = y[0]
    v_theta = y[1]
    out[0] = v_theta
    out[1] = -(sin(q_theta)*c0)


@njit(error_model="numpy")
def mass_matrix(t, y, p, out):
    """Mass matrix M, row by row. 2 operations."""
    p_L = p[0]
    p_m = p[1]
    c0 = p_m*(p_L*p_L)
    out[0] = c0


@njit(error_model="numpy")
def forces(t, y, p, out):
    """Forces f of M a = f + G^T lambda. 5 operations."""
    p_L = p[0]
    p_m = p[1]
    p_g = p[2]
    c0 = p_L*(p_m*p_g)
    q_theta = y[0]
    out[0] = -(sin(q_theta)*c0)


@njit(error_model="numpy")
def energy(t, y, p, out):
    """Kinetic and potential energy. 15 operations."""
    p_L = p[0]
    p_m = p[1]
    p_g = p[2]
    c0 = 0.5*p_m
    c1 = p_m*(p_L*p_g)
    q_theta = y[0]
    v_theta = y[1]
    x0 = cos(q_theta)
    x1 = p_L*(v_theta*x0)
    x2 = p_L*(v_theta*sin(q_theta))
    out[0] = c0*(x1*x1 + x2*x2)
    out[1] = -(x0*c1)


@njit(error_model="numpy")
def residual(t, y, p, out):
    """M a - f - G^T lambda, then G a - gamma. 10 operations."""
    p_L = p[0]
    p_m = p[1]
    p_g = p[2]
    c0 = p_L*(p_m*p_g)
    c1 = 0.5*(p_m*(p_L*p_L))
    q_theta = y[0]
    a_theta = y[2]
    x0 = a_theta*c1
    out[0] = sin(q_theta)*c0 + (x0 + x0)


@njit(error_model="numpy")
def residual_jacobian(t, y, p, out):
    """Residual derivatives by q, v, a, lambda. 6 operations."""
    p_L = p[0]
    p_m = p[1]
    p_g = p[2]
    c0 = p_m*(p_L*p_g)
    c1 = p_m*(p_L*p_L)
    q_theta = y[0]
    out[0] = cos(q_theta)*c0
    out[2] = c1


@njit(error_model="numpy")
def poses(t, y, p, out):
    """Per body: position, rotation matrix (body to world). 13 operations."""
    p_L = p[0]
    c0 = 0.5*p_L
    q_theta = y[0]
    x0 = sin(q_theta)
    x1 = cos(q_theta)
    x2 = q_theta + -1.5707963267948966
    x3 = cos(x2)
    x4 = sin(x2)
    out[0] = p_L*x0
    out[1] = -(p_L*x1)
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
    out[12] = x0*c0
    out[13] = -(x1*c0)
    out[14] = 0.0
    out[15] = x3
    out[16] = -x4
    out[17] = 0.0
    out[18] = x4
    out[19] = x3
    out[20] = 0.0
    out[21] = 0.0
    out[22] = 0.0
    out[23] = 1.0


@njit(error_model="numpy")
def shapes(t, y, p, out):
    """Sizes of the bodies' shapes. 0 operations."""
    p_L = p[0]
    out[0] = 0.05
    out[1] = 0.008
    out[2] = p_L


@njit(error_model="numpy")
def marks(t, y, p, out):
    """What a picture shows besides bodies, as `marks` lists it. 2 operations."""
    p_L = p[0]
    c0 = -(0.5*p_L)
    out[0] = c0
    out[5] = 1.0


@njit(error_model="numpy")
def limits(t, y, p, out):
    """Numbers of parameters that have a bound. 0 operations."""
    p_L = p[0]
    p_m = p[1]
    out[0] = p_m
    out[1] = p_L
