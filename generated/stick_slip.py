"""stick_slip: equations of motion, written by symgen 0.1.0. Do not edit.

Block on a moving belt, held by a spring: it sticks, slips, and sticks again
"""

from math import fabs

from numba import njit

MODEL = {
    "abi": 1,
    "generator": "symgen 0.1.0",
    "source": "sha256:1725c557356b7eed437cc7ab2de651079608098d48e8db7b884b1bcd1f22aef4",
    "name": "stick_slip",
    "description": "Block on a moving belt, held by a spring: it sticks, slips, and sticks again",
    "nq": 1,
    "nv": 1,
    "nh": 0,
    "nn": 0,
    "nw": 1,
    "coordinates": [
        {"name": "x", "unit": "m", "value": 0.0, "enforced": True},
    ],
    "quaternions": [],
    "rates": [
        {"name": "x", "unit": "m/s", "value": 0.3, "enforced": True},
    ],
    "parameters": [
        {"name": "m", "unit": "kg", "value": 1.0, "doc": ""},
        {"name": "k", "unit": "N/m", "value": 50.0, "doc": ""},
        {"name": "mu", "unit": "", "value": 0.4, "doc": "coefficient of sliding friction"},
        {"name": "mu_s", "unit": "", "value": 0.6, "doc": "coefficient of static friction"},
        {"name": "v0", "unit": "m/s", "value": 0.3, "doc": "speed of the belt"},
        {"name": "g", "unit": "m/s^2", "value": 9.81, "doc": ""},
    ],
    "inputs": [],
    "constants": [],
    "constraints": [],
    "outputs": [],
    "events": [
        {"name": "belt", "direction": "falling", "action": "friction"},
    ],
    "bodies": [
        {"name": "block", "planar": True, "shape": "box", "sizes": 3, "mesh": ""},
        {"name": "belt", "planar": True, "shape": "box", "sizes": 3, "mesh": ""},
    ],
    "structure": {
        "conservative": False,
        "time_dependent": False,
        "constant_mass": True,
        "diagonal_mass": True,
        "velocity_dependent": False,
        "separable": False,
    },
    "operations": {
        "rhs": 10,
        "mass_matrix": 0,
        "forces": 6,
        "energy": 6,
        "residual": 7,
        "residual_jacobian": 0,
        "poses": 0,
        "shapes": 0,
        "events": 2,
        "marks": 1,
        "limits": 3,
        "switches": 4,
        "closed_rhs": 20,
        "closed_residual": 13,
        "closed_residual_jacobian": 2,
        "closed_constraint_residual": 2,
        "closed_constraint_jacobian": 0,
        "closed_gamma": 0,
        "closed_project": 11,
        "closed_events": 22,
    },
    "hoisted": {
        "rhs": 2,
        "forces": 1,
        "energy": 2,
        "residual": 1,
        "switches": 3,
        "closed_rhs": 2,
        "closed_residual": 1,
        "closed_project": 1,
        "closed_events": 3,
    },
    "run": {
        "t_end": 8.0,
        "fps": 60.0,
    },
    "limits": [
        {"name": "bodies.block.mass", "bound": "zero or more"},
        {"name": "friction.belt.force", "bound": "zero or more"},
        {"name": "friction.belt.static", "bound": "zero or more"},
        {"name": "friction.belt.static", "bound": "at least", "numbers": 2},
    ],
    "switches": [
        {"name": "belt", "kind": "friction"},
    ],
    "subsystems": [],
    "marks": [
        {"kind": "spring", "name": "spring", "body": "", "numbers": 6, "moves": True},
        {"kind": "rail", "name": "wall", "body": "", "numbers": 6},
    ],
}

@njit(error_model="numpy")
def rhs(t, y, p, out):
    """State derivative: rates, accelerations, power. 10 operations."""
    p_m = p[0]
    p_k = p[1]
    p_mu = p[2]
    p_g = p[5]
    c0 = 1.0/p_m
    c1 = p_mu*(p_m*p_g)
    q_x = y[0]
    v_x = y[1]
    s_belt_sense = p[7]
    x0 = s_belt_sense*c1
    out[0] = v_x
    out[1] = -(c0*(x0 + q_x*p_k))
    out[2] = -(v_x*x0)


@njit(error_model="numpy")
def mass_matrix(t, y, p, out):
    """Mass matrix M, row by row. 0 operations."""
    p_m = p[0]
    out[0] = p_m


@njit(error_model="numpy")
def forces(t, y, p, out):
    """Forces f of M a = f + G^T lambda. 6 operations."""
    p_m = p[0]
    p_k = p[1]
    p_mu = p[2]
    p_g = p[5]
    c0 = p_mu*(p_m*p_g)
    q_x = y[0]
    s_belt_sense = p[7]
    out[0] = -(s_belt_sense*c0 + q_x*p_k)


@njit(error_model="numpy")
def energy(t, y, p, out):
    """Kinetic and potential energy. 6 operations."""
    p_m = p[0]
    p_k = p[1]
    c0 = 0.5*p_m
    c1 = 0.5*p_k
    q_x = y[0]
    v_x = y[1]
    out[0] = c0*(v_x*v_x)
    out[1] = q_x*q_x*c1


@njit(error_model="numpy")
def residual(t, y, p, out):
    """M a - f - G^T lambda, then G a - gamma. 7 operations."""
    p_m = p[0]
    p_k = p[1]
    p_mu = p[2]
    p_g = p[5]
    c0 = p_mu*(p_m*p_g)
    q_x = y[0]
    a_x = y[2]
    s_belt_sense = p[7]
    out[0] = q_x*p_k + (s_belt_sense*c0 + a_x*p_m)


@njit(error_model="numpy")
def residual_jacobian(t, y, p, out):
    """Residual derivatives by q, v, a, lambda. 0 operations."""
    p_m = p[0]
    p_k = p[1]
    out[0] = p_k
    out[2] = p_m


@njit(error_model="numpy")
def poses(t, y, p, out):
    """Per body: position, rotation matrix (body to world). 0 operations."""
    q_x = y[0]
    out[0] = q_x
    out[1] = 0.1
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
    out[12] = 0.0
    out[13] = -0.02
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
    out[0] = 0.2
    out[1] = 0.2
    out[2] = 0.2
    out[3] = 2.0
    out[4] = 0.04
    out[5] = 0.3


@njit(error_model="numpy")
def events(t, y, p, out):
    """Event functions. 2 operations."""
    p_v0 = p[4]
    v_x = y[1]
    s_belt_sense = p[7]
    out[0] = s_belt_sense*(v_x - p_v0)


@njit(error_model="numpy")
def marks(t, y, p, out):
    """What a picture shows besides bodies, as `marks` lists it. 1 operation."""
    q_x = y[0]
    out[0] = -0.7
    out[1] = 0.1
    out[3] = q_x + -0.1
    out[4] = 0.1
    out[6] = -0.7
    out[7] = 0.25
    out[9] = -0.7


@njit(error_model="numpy")
def limits(t, y, p, out):
    """Numbers of parameters that have a bound. 3 operations."""
    p_m = p[0]
    p_mu = p[2]
    p_mu_s = p[3]
    p_g = p[5]
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
    """Gaps and restitutions of stops; speeds, levels and largest levels of frictions. 4 operations."""
    p_m = p[0]
    p_mu = p[2]
    p_mu_s = p[3]
    p_v0 = p[4]
    p_g = p[5]
    c0 = p_m*p_g
    c1 = p_mu*c0
    c2 = p_mu_s*c0
    v_x = y[1]
    out[0] = v_x - p_v0
    out[1] = c1
    out[2] = c2


@njit(error_model="numpy")
def closed_rhs(t, y, p, out):
    """State derivative: rates, accelerations, power, multipliers, pivot ratio. 20 operations."""
    p_m = p[0]
    p_k = p[1]
    p_mu = p[2]
    p_v0 = p[4]
    p_g = p[5]
    c0 = 1.0/p_m
    c1 = p_g*(p_m*p_mu)
    q_x = y[0]
    v_x = y[1]
    s_belt_stuck = p[6]
    s_belt_sense = p[7]
    x0 = s_belt_stuck*c0
    x1 = s_belt_sense*c1
    x2 = x1 + q_x*p_k
    x3 = 1.0/(1.0 - s_belt_stuck + s_belt_stuck*x0)*(x0*x2)
    out[0] = v_x
    out[1] = x0*x3 - c0*x2
    out[2] = p_v0*(s_belt_stuck*x3) - v_x*x1
    out[3] = x3
    out[4] = 1.0


@njit(error_model="numpy")
def closed_residual(t, y, p, out):
    """M a - f - G^T lambda, then G a - gamma. 13 operations."""
    p_m = p[0]
    p_k = p[1]
    p_mu = p[2]
    p_g = p[5]
    c0 = p_g*(p_m*p_mu)
    q_x = y[0]
    a_x = y[2]
    lam_belt = y[3]
    s_belt_stuck = p[6]
    s_belt_sense = p[7]
    x0 = q_x*p_k + (s_belt_sense*c0 + a_x*p_m) - lam_belt*s_belt_stuck
    out[0] = x0
    out[1] = a_x*s_belt_stuck + lam_belt*(1.0 - s_belt_stuck)


@njit(error_model="numpy")
def closed_residual_jacobian(t, y, p, out):
    """Residual derivatives by q, v, a, lambda. 2 operations."""
    p_m = p[0]
    p_k = p[1]
    s_belt_stuck = p[6]
    out[0] = p_k
    out[2] = p_m
    out[3] = -s_belt_stuck
    out[6] = s_belt_stuck
    out[7] = 1.0 - s_belt_stuck


@njit(error_model="numpy")
def closed_constraint_residual(t, y, p, out):
    """Position residuals, velocity residuals. 2 operations."""
    p_v0 = p[4]
    v_x = y[1]
    s_belt_stuck = p[6]
    out[0] = s_belt_stuck*(v_x - p_v0)


@njit(error_model="numpy")
def closed_constraint_jacobian(t, y, p, out):
    """Constraint Jacobian G, row by row. 0 operations."""
    s_belt_stuck = p[6]
    out[0] = s_belt_stuck


@njit(error_model="numpy")
def closed_gamma(t, y, p, out):
    """Right-hand side of G a = gamma. 0 operations."""
    out[0] = 0.0


@njit(error_model="numpy")
def closed_project(t, y, p, out):
    """State moved onto the constraints, and the residuals it had. 11 operations."""
    p_m = p[0]
    p_v0 = p[4]
    c0 = 1.0/p_m
    q_x = y[0]
    v_x = y[1]
    s_belt_stuck = p[6]
    x0 = s_belt_stuck*c0
    x1 = s_belt_stuck*(v_x - p_v0)
    out[0] = q_x
    out[1] = v_x - x0*(x1*(1.0/(1.0 - s_belt_stuck + s_belt_stuck*x0)))
    out[2] = x1


@njit(error_model="numpy")
def closed_events(t, y, p, out):
    """Event functions. 22 operations."""
    p_m = p[0]
    p_k = p[1]
    p_mu = p[2]
    p_mu_s = p[3]
    p_v0 = p[4]
    p_g = p[5]
    c0 = p_mu_s*(p_m*p_g)
    c1 = 1.0/p_m
    c2 = p_g*(p_m*p_mu)
    q_x = y[0]
    v_x = y[1]
    s_belt_stuck = p[6]
    s_belt_sense = p[7]
    x0 = 1.0 - s_belt_stuck
    x1 = s_belt_stuck*c1
    x2 = fabs(1.0/(x0 + s_belt_stuck*x1)*(x1*(s_belt_sense*c2 + q_x*p_k)))
    out[0] = x0*(s_belt_sense*(v_x - p_v0)) + s_belt_stuck*(c0 - x2)
