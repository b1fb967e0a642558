"""stiff_bushing_pendulum: equations of motion, written by symgen 0.1.0. Do not edit.

Rod that swings on a very stiff, damped rubber bushing
"""

from math import cos, sin

from numba import njit

MODEL = {
    "abi": 1,
    "generator": "symgen 0.1.0",
    "source": "sha256:26c0c8c077643a4deb18cf03e06e18b88eb3dafd519e1a5f38b6606c37b3956b",
    "name": "stiff_bushing_pendulum",
    "description": "Rod that swings on a very stiff, damped rubber bushing",
    "nq": 3,
    "nv": 3,
    "nh": 0,
    "nn": 0,
    "nw": 1,
    "coordinates": [
        {"name": "x", "unit": "m", "value": 0.5, "enforced": True},
        {"name": "y", "unit": "m", "value": 0.0, "enforced": True},
        {"name": "th", "unit": "rad", "value": 0.0, "enforced": True},
    ],
    "quaternions": [],
    "rates": [
        {"name": "x", "unit": "m/s", "value": 0.0, "enforced": True},
        {"name": "y", "unit": "m/s", "value": 0.0, "enforced": True},
        {"name": "th", "unit": "rad/s", "value": 0.0, "enforced": True},
    ],
    "parameters": [
        {"name": "m", "unit": "kg", "value": 1.0, "doc": ""},
        {"name": "L", "unit": "m", "value": 1.0, "doc": ""},
        {"name": "k", "unit": "N/m", "value": 100000000.0, "doc": "stiffness of the bushing"},
        {"name": "c", "unit": "N*s/m", "value": 1000.0, "doc": "damping of the bushing"},
        {"name": "g", "unit": "m/s^2", "value": 9.81, "doc": ""},
    ],
    "inputs": [],
    "constants": [],
    "constraints": [],
    "outputs": [
        {"name": "bushing_force_x", "unit": "N"},
        {"name": "bushing_force_y", "unit": "N"},
    ],
    "events": [],
    "bodies": [
        {"name": "rod", "planar": True, "shape": "capsule", "sizes": 2, "mesh": ""},
    ],
    "structure": {
        "conservative": False,
        "time_dependent": False,
        "constant_mass": True,
        "diagonal_mass": True,
        "velocity_dependent": True,
        "separable": False,
    },
    "operations": {
        "rhs": 51,
        "mass_matrix": 3,
        "forces": 37,
        "energy": 27,
        "residual": 43,
        "residual_jacobian": 48,
        "poses": 3,
        "shapes": 0,
        "outputs": 21,
        "limits": 3,
    },
    "hoisted": {
        "rhs": 6,
        "mass_matrix": 1,
        "forces": 4,
        "energy": 5,
        "residual": 5,
        "residual_jacobian": 4,
        "outputs": 1,
    },
    "run": {
        "t_end": 1.0,
        "fps": 100.0,
    },
    "limits": [
        {"name": "bodies.rod.shape.capsule[1]", "bound": "zero or more"},
        {"name": "bodies.rod.mass", "bound": "zero or more"},
        {"name": "bodies.rod.inertia", "bound": "zero or more"},
    ],
    "subsystems": [],
}

@njit(error_model="numpy")
def rhs(t, y, p, out):
    """State derivative: rates, accelerations, power. 51 operations."""
    p_m = p[0]
    p_L = p[1]
    p_k = p[2]
    p_c = p[3]
    p_g = p[4]
    c0 = 1.0/p_m
    c1 = 0.5*p_L
    c2 = p_m*p_g
    c3 = 1.0/(p_L*p_L*(0.08333333333333333*p_m))
    c4 = p_c*c1
    c5 = p_k*c1
    q_x = y[0]
    q_y = y[1]
    q_th = y[2]
    v_x = y[3]
    v_y = y[4]
    v_th = y[5]
    x0 = sin(q_th)
    x1 = v_x + c1*(v_th*x0)
    x2 = p_c*x1
    x3 = cos(q_th)
    x4 = q_x - x3*c1
    x5 = v_y - c1*(v_th*x3)
    x6 = p_c*x5
    x7 = q_y - c1*x0
    x8 = c4*(x0*x1) - c4*(x3*x5)
    out[0] = v_x
    out[1] = v_y
    out[2] = v_th
    out[3] = -(c0*(x2 + p_k*x4))
    out[4] = -(c0*(x6 + (c2 + p_k*x7)))
    out[5] = -(c3*(x8 + (c5*(x4*x0) - c5*(x3*x7))))
    out[6] = -(v_x*x2 + v_y*x6 + v_th*x8)


@njit(error_model="numpy")
def mass_matrix(t, y, p, out):
    """Mass matrix M, row by row. 3 operations."""
    p_m = p[0]
    p_L = p[1]
    c0 = p_L*p_L*(0.08333333333333333*p_m)
    out[0] = p_m
    out[4] = p_m
    out[8] = c0


@njit(error_model="numpy")
def forces(t, y, p, out):
    """Forces f of M a = f + G^T lambda. 37 operations."""
    p_m = p[0]
    p_L = p[1]
    p_k = p[2]
    p_c = p[3]
    p_g = p[4]
    c0 = 0.5*p_L
    c1 = p_m*p_g
    c2 = p_c*c0
    c3 = p_k*c0
    q_x = y[0]
    q_y = y[1]
    q_th = y[2]
    v_x = y[3]
    v_y = y[4]
    v_th = y[5]
    x0 = sin(q_th)
    x1 = v_x + c0*(v_th*x0)
    x2 = cos(q_th)
    x3 = q_x - x2*c0
    x4 = v_y - c0*(v_th*x2)
    x5 = q_y - c0*x0
    out[0] = -(p_c*x1 + p_k*x3)
    out[1] = -(p_c*x4 + (c1 + p_k*x5))
    out[2] = -(c2*(x0*x1) - c2*(x2*x4) + (c3*(x3*x0) - c3*(x2*x5)))


@njit(error_model="numpy")
def energy(t, y, p, out):
    """Kinetic and potential energy. 27 operations."""
    p_m = p[0]
    p_L = p[1]
    p_k = p[2]
    p_g = p[4]
    c0 = 0.5*p_m
    c1 = 0.5*(p_L*p_L*(0.08333333333333333*p_m))
    c2 = 0.5*p_L
    c3 = 0.5*p_k
    c4 = p_m*p_g
    q_x = y[0]
    q_y = y[1]
    q_th = y[2]
    v_x = y[3]
    v_y = y[4]
    v_th = y[5]
    x0 = q_x - cos(q_th)*c2
    x1 = q_y - c2*sin(q_th)
    out[0] = c0*(v_x*v_x + v_y*v_y) + c1*(v_th*v_th)
    out[1] = (x0*x0 + x1*x1)*c3 + q_y*c4


@njit(error_model="numpy")
def residual(t, y, p, out):
    """M a - f - G^T lambda, then G a - gamma. 43 operations."""
    p_m = p[0]
    p_L = p[1]
    p_k = p[2]
    p_c = p[3]
    p_g = p[4]
    c0 = 0.5*p_L
    c1 = p_m*p_g
    c2 = p_k*c0
    c3 = p_c*c0
    c4 = p_L*p_L*(0.08333333333333333*p_m)
    q_x = y[0]
    q_y = y[1]
    q_th = y[2]
    v_x = y[3]
    v_y = y[4]
    v_th = y[5]
    a_x = y[6]
    a_y = y[7]
    a_th = y[8]
    x0 = cos(q_th)
    x1 = q_x - x0*c0
    x2 = sin(q_th)
    x3 = v_x + c0*(v_th*x2)
    x4 = q_y - c0*x2
    x5 = v_y - c0*(v_th*x0)
    x6 = c2*(x1*x2) - c2*(x0*x4) + (c3*(x2*x3) + (a_th*c4 - c3*(x0*x5)))
    out[0] = p_k*x1 + (p_c*x3 + a_x*p_m)
    out[1] = c1 + p_k*x4 + (p_c*x5 + a_y*p_m)
    out[2] = x6


@njit(error_model="numpy")
def residual_jacobian(t, y, p, out):
    """Residual derivatives by q, v, a, lambda. 48 operations."""
    p_m = p[0]
    p_L = p[1]
    p_k = p[2]
    p_c = p[3]
    c0 = 0.5*p_L
    c1 = p_k*c0
    c2 = p_c*c0
    c3 = p_L*p_L*(0.08333333333333333*p_m)
    q_x = y[0]
    q_y = y[1]
    q_th = y[2]
    v_x = y[3]
    v_y = y[4]
    v_th = y[5]
    x0 = sin(q_th)
    x1 = x0*c1
    x2 = cos(q_th)
    x3 = v_th*x2
    x4 = x0*c2
    x5 = v_th*x0
    x6 = x2*c1
    x7 = x2*c2
    x8 = -x7
    x9 = c0*x0
    x10 = c0*x3
    x11 = x2*c0
    x12 = c0*x5
    x13 = x9*(p_c*(v_y - x10) + p_k*(q_y - x9)) + x11*(p_c*(v_x + x12) + p_k*(q_x - x11))
    out[0] = p_k
    out[2] = x1 + x3*c2
    out[3] = p_c
    out[5] = x4
    out[6] = p_m
    out[10] = p_k
    out[11] = x5*c2 - x6
    out[13] = p_c
    out[14] = x8
    out[16] = p_m
    out[18] = x1
    out[19] = -x6
    out[20] = x13 - x12*x7 + x10*x4 + x11*x6 + x9*x1
    out[21] = x4
    out[22] = x8
    out[23] = x11*x7 + x9*x4
    out[26] = c3


@njit(error_model="numpy")
def poses(t, y, p, out):
    """Per body: position, rotation matrix (body to world). 3 operations."""
    q_x = y[0]
    q_y = y[1]
    q_th = y[2]
    x0 = cos(q_th)
    x1 = sin(q_th)
    out[0] = q_x
    out[1] = q_y
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


@njit(error_model="numpy")
def shapes(t, y, p, out):
    """Sizes of the bodies' shapes. 0 operations."""
    p_L = p[1]
    out[0] = 0.03
    out[1] = p_L


@njit(error_model="numpy")
def outputs(t, y, p, out):
    """Outputs. 21 operations."""
    p_L = p[1]
    p_k = p[2]
    p_c = p[3]
    c0 = 0.5*p_L
    q_x = y[0]
    q_y = y[1]
    q_th = y[2]
    v_x = y[3]
    v_y = y[4]
    v_th = y[5]
    x0 = sin(q_th)
    x1 = cos(q_th)
    out[0] = -(p_c*(v_x + c0*(v_th*x0)) + p_k*(q_x - x1*c0))
    out[1] = -(p_c*(v_y - c0*(v_th*x1)) + p_k*(q_y - c0*x0))


@njit(error_model="numpy")
def limits(t, y, p, out):
    """Numbers of parameters that have a bound. 3 operations."""
    p_m = p[0]
    p_L = p[1]
    c0 = p_L*p_L*(0.08333333333333333*p_m)
    out[0] = p_L
    out[1] = p_m
    out[2] = c0
