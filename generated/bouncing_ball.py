"""bouncing_ball: equations of motion, written by symgen 0.1.0. Do not edit.

Ball that bounces off the floor and loses speed each time
"""

from numba import njit

MODEL = {
    "abi": 1,
    "generator": "symgen 0.1.0",
    "source": "sha256:17dc58b05f1bebf2d8198887607dd5d1f75fbdf4ee8642f1963911ccdbe9871d",
    "name": "bouncing_ball",
    "description": "Ball that bounces off the floor and loses speed each time",
    "nq": 2,
    "nv": 2,
    "nh": 0,
    "nn": 0,
    "nw": 0,
    "coordinates": [
        {"name": "x", "unit": "m", "value": 0.0, "enforced": True},
        {"name": "y", "unit": "m", "value": 1.1, "enforced": True},
    ],
    "quaternions": [],
    "rates": [
        {"name": "x", "unit": "m/s", "value": 0.5, "enforced": True},
        {"name": "y", "unit": "m/s", "value": 0.0, "enforced": True},
    ],
    "parameters": [
        {"name": "r", "unit": "m", "value": 0.1, "doc": "radius"},
        {"name": "m", "unit": "kg", "value": 0.5, "doc": ""},
        {"name": "e", "unit": "", "value": 0.9, "doc": "coefficient of restitution"},
        {"name": "g", "unit": "m/s^2", "value": 9.81, "doc": ""},
    ],
    "inputs": [],
    "constants": [],
    "constraints": [],
    "outputs": [],
    "events": [
        {"name": "bounce", "direction": "falling", "action": "reset"},
    ],
    "bodies": [
        {"name": "ball", "planar": True, "shape": "sphere", "sizes": 1, "mesh": ""},
        {"name": "floor", "planar": True, "shape": "box", "sizes": 3, "mesh": ""},
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
        "rhs": 4,
        "mass_matrix": 0,
        "forces": 2,
        "energy": 7,
        "residual": 4,
        "residual_jacobian": 0,
        "poses": 0,
        "shapes": 0,
        "events": 1,
        "reset_bounce": 2,
        "limits": 0,
    },
    "hoisted": {
        "rhs": 1,
        "forces": 1,
        "energy": 2,
        "residual": 1,
    },
    "run": {
        "t_end": 5.0,
        "fps": 60.0,
    },
    "limits": [
        {"name": "bodies.ball.shape.sphere[0]", "bound": "zero or more"},
        {"name": "bodies.ball.mass", "bound": "zero or more"},
    ],
    "subsystems": [],
}

@njit(error_model="numpy")
def rhs(t, y, p, out):
    """State derivative: rates, accelerations. 4 operations."""
    p_m = p[1]
    p_g = p[3]
    c0 = -(p_m*p_g*(1.0/p_m))
    v_x = y[2]
    v_y = y[3]
    out[0] = v_x
    out[1] = v_y
    out[2] = 0.0
    out[3] = c0


@njit(error_model="numpy")
def mass_matrix(t, y, p, out):
    """Mass matrix M, row by row. 0 operations."""
    p_m = p[1]
    out[0] = p_m
    out[3] = p_m


@njit(error_model="numpy")
def forces(t, y, p, out):
    """Forces f of M a = f + G^T lambda. 2 operations."""
    p_m = p[1]
    p_g = p[3]
    c0 = -(p_m*p_g)
    out[0] = 0.0
    out[1] = c0


@njit(error_model="numpy")
def energy(t, y, p, out):
    """Kinetic and potential energy. 7 operations."""
    p_m = p[1]
    p_g = p[3]
    c0 = 0.5*p_m
    c1 = p_m*p_g
    q_y = y[1]
    v_x = y[2]
    v_y = y[3]
    out[0] = c0*(v_x*v_x + v_y*v_y)
    out[1] = q_y*c1


@njit(error_model="numpy")
def residual(t, y, p, out):
    """M a - f - G^T lambda, then G a - gamma. 4 operations."""
    p_m = p[1]
    p_g = p[3]
    c0 = p_m*p_g
    a_x = y[4]
    a_y = y[5]
    out[0] = a_x*p_m
    out[1] = c0 + a_y*p_m


@njit(error_model="numpy")
def residual_jacobian(t, y, p, out):
    """Residual derivatives by q, v, a, lambda. 0 operations."""
    p_m = p[1]
    out[4] = p_m
    out[11] = p_m


@njit(error_model="numpy")
def poses(t, y, p, out):
    """Per body: position, rotation matrix (body to world). 0 operations."""
    q_x = y[0]
    q_y = y[1]
    out[0] = q_x
    out[1] = q_y
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
    out[12] = 1.25
    out[13] = -0.01
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


@njit(error_model="numpy")
def shapes(t, y, p, out):
    """Sizes of the bodies' shapes. 0 operations."""
    p_r = p[0]
    out[0] = p_r
    out[1] = 4.0
    out[2] = 0.02
    out[3] = 1.0


@njit(error_model="numpy")
def events(t, y, p, out):
    """Event functions. 1 operation."""
    p_r = p[0]
    q_y = y[1]
    out[0] = q_y - p_r


@njit(error_model="numpy")
def reset_bounce(t, y, p, out):
    """State after event 'bounce'. 2 operations."""
    p_e = p[2]
    q_x = y[0]
    q_y = y[1]
    v_x = y[2]
    v_y = y[3]
    out[0] = q_x
    out[1] = q_y
    out[2] = v_x
    out[3] = -(v_y*p_e)


@njit(error_model="numpy")
def limits(t, y, p, out):
    """Numbers of parameters that have a bound. 0 operations."""
    p_r = p[0]
    p_m = p[1]
    out[0] = p_r
    out[1] = p_m
