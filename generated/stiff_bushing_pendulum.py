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
        {"name": "bushing_force_x", "unit": ""},
        {"name": "bushing_force_y", "unit": ""},
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
        "rhs": 55,
        "mass_matrix": 3,
        "forces": 41,
        "energy": 27,
        "residual": 47,
        "residual_jacobian": 70,
        "poses": 3,
        "shapes": 0,
        "outputs": 21,
    },
    "run": {
        "t_end": 1.0,
        "fps": 100.0,
    },
}

@njit(error_model="numpy")
def rhs(t, y, p, out):
    """State derivative: rates, accelerations, power. 55 operations."""
    q_x = y[0]
    q_y = y[1]
    q_th = y[2]
    v_x = y[3]
    v_y = y[4]
    v_th = y[5]
    p_m = p[0]
    p_L = p[1]
    p_k = p[2]
    p_c = p[3]
    p_g = p[4]
    x0 = 0.5*p_c
    x1 = 0.5*p_L
    x2 = sin(q_th)
    x3 = x0*(2.0*(v_x + x1*(v_th*x2)))
    x4 = 0.5*p_k
    x5 = cos(q_th)
    x6 = x4*(2.0*(q_x - x5*x1))
    x7 = 1.0/p_m
    x8 = x0*(2.0*(v_y - x1*(v_th*x5)))
    x9 = x4*(2.0*(q_y - x1*x2))
    x10 = x2*(x1*x3) - x5*(x1*x8)
    x11 = (x10 + (x2*(x1*x6) - x5*(x1*x9)))*(1.0/(p_L*p_L*(0.08333333333333333*p_m)))
    out[0] = v_x
    out[1] = v_y
    out[2] = v_th
    out[3] = -((x3 + x6)*x7)
    out[4] = -((x8 + (x9 + p_m*p_g))*x7)
    out[5] = -x11
    out[6] = -(v_x*x3 + v_y*x8 + v_th*x10)


@njit(error_model="numpy")
def mass_matrix(t, y, p, out):
    """Mass matrix M, row by row. 3 operations."""
    p_m = p[0]
    p_L = p[1]
    out[0] = p_m
    out[4] = p_m
    out[8] = p_L*p_L*(0.08333333333333333*p_m)


@njit(error_model="numpy")
def forces(t, y, p, out):
    """Forces f of M a = f + G^T lambda. 41 operations."""
    q_x = y[0]
    q_y = y[1]
    q_th = y[2]
    v_x = y[3]
    v_y = y[4]
    v_th = y[5]
    p_m = p[0]
    p_L = p[1]
    p_k = p[2]
    p_c = p[3]
    p_g = p[4]
    x0 = 0.5*p_c
    x1 = 0.5*p_L
    x2 = sin(q_th)
    x3 = x0*(2.0*(v_x + x1*(v_th*x2)))
    x4 = 0.5*p_k
    x5 = cos(q_th)
    x6 = x4*(2.0*(q_x - x5*x1))
    x7 = x0*(2.0*(v_y - x1*(v_th*x5)))
    x8 = x4*(2.0*(q_y - x1*x2))
    out[0] = -(x3 + x6)
    out[1] = -(x7 + (x8 + p_m*p_g))
    out[2] = -(x2*(x1*x3) - x5*(x1*x7) + (x2*(x1*x6) - x5*(x1*x8)))


@njit(error_model="numpy")
def energy(t, y, p, out):
    """Kinetic and potential energy. 27 operations."""
    q_x = y[0]
    q_y = y[1]
    q_th = y[2]
    v_x = y[3]
    v_y = y[4]
    v_th = y[5]
    p_m = p[0]
    p_L = p[1]
    p_k = p[2]
    p_g = p[4]
    x0 = 0.5*p_m*(v_x*v_x + v_y*v_y) + 0.5*(v_th*(v_th*(p_L*p_L*(0.08333333333333333*p_m))))
    x1 = 0.5*p_L
    x2 = q_x - cos(q_th)*x1
    x3 = q_y - x1*sin(q_th)
    out[0] = x0
    out[1] = p_m*(q_y*p_g) + (x2*x2 + x3*x3)*(0.5*p_k)


@njit(error_model="numpy")
def residual(t, y, p, out):
    """M a - f - G^T lambda, then G a - gamma. 47 operations."""
    q_x = y[0]
    q_y = y[1]
    q_th = y[2]
    v_x = y[3]
    v_y = y[4]
    v_th = y[5]
    a_x = y[6]
    a_y = y[7]
    a_th = y[8]
    p_m = p[0]
    p_L = p[1]
    p_k = p[2]
    p_c = p[3]
    p_g = p[4]
    x0 = 0.5*p_k
    x1 = cos(q_th)
    x2 = 0.5*p_L
    x3 = x0*(2.0*(q_x - x1*x2))
    x4 = 0.5*p_c
    x5 = sin(q_th)
    x6 = x4*(2.0*(v_x + x2*(v_th*x5)))
    x7 = x0*(2.0*(q_y - x2*x5))
    x8 = x4*(2.0*(v_y - x2*(v_th*x1)))
    x9 = x5*(x2*x6) + (a_th*(p_L*p_L*(0.08333333333333333*p_m)) - x1*(x2*x8))
    out[0] = x3 + (x6 + a_x*p_m)
    out[1] = x7 + p_m*p_g + (x8 + a_y*p_m)
    out[2] = x5*(x2*x3) - x1*(x2*x7) + x9


@njit(error_model="numpy")
def residual_jacobian(t, y, p, out):
    """Residual derivatives by q, v, a, lambda. 70 operations."""
    q_x = y[0]
    q_y = y[1]
    q_th = y[2]
    v_x = y[3]
    v_y = y[4]
    v_th = y[5]
    p_m = p[0]
    p_L = p[1]
    p_k = p[2]
    p_c = p[3]
    x0 = sin(q_th)
    x1 = 0.5*p_L
    x2 = p_k*x1
    x3 = cos(q_th)
    x4 = p_c*x1
    x5 = v_th*x4
    x6 = x1*x0
    x7 = 0.5*p_k
    x8 = 2.0*(x6*x7)
    x9 = x3*x1
    x10 = 2.0*(x9*x7)
    x11 = 0.5*p_c
    x12 = x1*(x11*(2.0*(v_x + x1*(v_th*x0)))) + x1*(x7*(2.0*(q_x - x9)))
    x13 = 2.0*(x6*x11)
    x14 = x1*x13
    x15 = 2.0*(x9*x11)
    x16 = x1*x15
    x17 = x1*(x11*(2.0*(v_y - x1*(v_th*x3)))) + x1*(x7*(2.0*(q_y - x6)))
    out[0] = p_k
    out[2] = x0*x2 + x3*x5
    out[3] = p_c
    out[5] = x0*x4
    out[6] = p_m
    out[10] = p_k
    out[11] = x0*x5 - x3*x2
    out[13] = p_c
    out[14] = -(x3*x4)
    out[16] = p_m
    out[18] = x8
    out[19] = -x10
    out[20] = x3*(x12 + v_th*x14 + x1*x10) - x0*(v_th*x16 - x17 - x1*x8)
    out[21] = x13
    out[22] = -x15
    out[23] = x3*x16 + x0*x14
    out[26] = p_L*p_L*(0.08333333333333333*p_m)


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
    q_x = y[0]
    q_y = y[1]
    q_th = y[2]
    v_x = y[3]
    v_y = y[4]
    v_th = y[5]
    p_L = p[1]
    p_k = p[2]
    p_c = p[3]
    x0 = 0.5*p_L
    x1 = sin(q_th)
    x2 = cos(q_th)
    out[0] = -(p_c*(v_x + x0*(v_th*x1)) + p_k*(q_x - x2*x0))
    out[1] = -(p_c*(v_y - x0*(v_th*x2)) + p_k*(q_y - x0*x1))
