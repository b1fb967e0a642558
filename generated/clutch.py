"""clutch: equations of motion, written by symgen 0.1.0. Do not edit.

Friction clutch between a motor and a machine: pressed, it slips, locks, slips under load, and is let go
"""

from math import cos, exp, fabs, sin

from numba import njit

MODEL = {
    "abi": 1,
    "generator": "symgen 0.1.0",
    "source": "sha256:75ed9aaf80d705229651e30a371a71f54254c0455899a2c6ff7ac60b198510bc",
    "name": "clutch",
    "description": "Friction clutch between a motor and a machine: pressed, it slips, locks, slips under load, and is let go",
    "nq": 2,
    "nv": 2,
    "nh": 0,
    "nn": 0,
    "nw": 1,
    "coordinates": [
        {"name": "motor", "unit": "rad", "value": 0.0, "enforced": True},
        {"name": "machine", "unit": "rad", "value": 0.0, "enforced": True},
    ],
    "quaternions": [],
    "rates": [
        {"name": "motor", "unit": "rad/s", "value": 100.0, "enforced": True},
        {"name": "machine", "unit": "rad/s", "value": 0.0, "enforced": True},
    ],
    "parameters": [
        {"name": "J1", "unit": "kg*m^2", "value": 0.2, "doc": "inertia of the motor's side"},
        {"name": "J2", "unit": "kg*m^2", "value": 0.6, "doc": "inertia of the machine"},
        {"name": "mu", "unit": "", "value": 0.3, "doc": "coefficient of the lining while it slips"},
        {"name": "mu_s", "unit": "", "value": 0.36, "doc": "coefficient while it sticks"},
        {"name": "faces", "unit": "", "value": 4.0, "doc": "friction faces"},
        {"name": "R", "unit": "m", "value": 0.1, "doc": "mean radius of the lining"},
        {"name": "M", "unit": "N*m", "value": 20.0, "doc": "torque of the motor"},
        {"name": "c", "unit": "N*m*s", "value": 0.15, "doc": "drag of the motor, per rad/s"},
        {"name": "drag", "unit": "N*m*s", "value": 0.15, "doc": "drag of the machine, per rad/s"},
        {"name": "jolt", "unit": "N*m", "value": 320.0, "doc": "load of the machine for a moment, about t = 4 s"},
    ],
    "inputs": [
        {"name": "press", "unit": "N", "value": 0.0, "table": {"kind": "linear", "t": [0.0, 0.5, 1.5, 5.5, 5.8, 8.0], "values": [0.0, 0.0, 500.0, 500.0, 0.0, 0.0]}},
    ],
    "constants": [],
    "constraints": [],
    "outputs": [
        {"name": "slip", "unit": "1/s"},
    ],
    "events": [
        {"name": "lining", "direction": "falling", "action": "friction"},
    ],
    "bodies": [
        {"name": "flywheel", "planar": True, "shape": "box", "sizes": 3, "mesh": ""},
        {"name": "drum", "planar": True, "shape": "box", "sizes": 3, "mesh": ""},
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
        "rhs": 26,
        "mass_matrix": 0,
        "forces": 18,
        "energy": 7,
        "residual": 20,
        "residual_jacobian": 0,
        "poses": 6,
        "shapes": 0,
        "outputs": 1,
        "events": 2,
        "limits": 0,
        "switches": 6,
        "time_terms": 5,
        "closed_rhs": 41,
        "closed_residual": 28,
        "closed_residual_jacobian": 2,
        "closed_constraint_residual": 2,
        "closed_constraint_jacobian": 1,
        "closed_gamma": 0,
        "closed_project": 17,
        "closed_events": 40,
    },
    "hoisted": {
        "rhs": 3,
        "forces": 1,
        "energy": 2,
        "residual": 1,
        "switches": 2,
        "closed_rhs": 3,
        "closed_residual": 1,
        "closed_project": 2,
        "closed_events": 4,
    },
    "run": {
        "t_end": 8.0,
        "fps": 60.0,
    },
    "limits": [
        {"name": "bodies.flywheel.inertia", "bound": "zero or more"},
        {"name": "bodies.drum.inertia", "bound": "zero or more"},
    ],
    "switches": [
        {"name": "lining", "kind": "friction"},
    ],
    "subsystems": [],
    "time_terms": 1,
}

@njit(error_model="numpy")
def rhs(t, y, p, out):
    """State derivative: rates, accelerations, power. 26 operations."""
    p_J1 = p[0]
    p_J2 = p[1]
    p_mu = p[2]
    p_faces = p[4]
    p_R = p[5]
    p_M = p[6]
    p_c = p[7]
    p_drag = p[8]
    p_jolt = p[9]
    c0 = 1.0/p_J1
    c1 = p_mu*(p_faces*p_R)
    c2 = 1.0/p_J2
    v_motor = y[2]
    v_machine = y[3]
    u_press = p[10]
    s_lining_sense = p[12]
    x0 = c1*(u_press*s_lining_sense)
    x1 = x0 - (p_M - v_motor*p_c)
    x2 = 16.666666666666668*(t + -4.0)
    x3 = p_jolt*exp(-(x2*x2)) + v_machine*p_drag - x0
    out[0] = v_motor
    out[1] = v_machine
    out[2] = -(c0*x1)
    out[3] = -(c2*x3)
    out[4] = -(v_motor*x1 + v_machine*x3)


@njit(error_model="numpy")
def mass_matrix(t, y, p, out):
    """Mass matrix M, row by row. 0 operations."""
    p_J1 = p[0]
    p_J2 = p[1]
    out[0] = p_J1
    out[3] = p_J2


@njit(error_model="numpy")
def forces(t, y, p, out):
    """Forces f of M a = f + G^T lambda. 18 operations."""
    p_mu = p[2]
    p_faces = p[4]
    p_R = p[5]
    p_M = p[6]
    p_c = p[7]
    p_drag = p[8]
    p_jolt = p[9]
    c0 = p_mu*(p_faces*p_R)
    v_motor = y[2]
    v_machine = y[3]
    u_press = p[10]
    s_lining_sense = p[12]
    x0 = c0*(u_press*s_lining_sense)
    x1 = 16.666666666666668*(t + -4.0)
    out[0] = -(x0 - (p_M - v_motor*p_c))
    out[1] = -(p_jolt*exp(-(x1*x1)) + v_machine*p_drag - x0)


@njit(error_model="numpy")
def energy(t, y, p, out):
    """Kinetic and potential energy. 7 operations."""
    p_J1 = p[0]
    p_J2 = p[1]
    c0 = 0.5*p_J1
    c1 = 0.5*p_J2
    v_motor = y[2]
    v_machine = y[3]
    out[0] = c0*(v_motor*v_motor) + c1*(v_machine*v_machine)
    out[1] = 0.0


@njit(error_model="numpy")
def residual(t, y, p, out):
    """M a - f - G^T lambda, then G a - gamma. 20 operations."""
    p_J1 = p[0]
    p_J2 = p[1]
    p_mu = p[2]
    p_faces = p[4]
    p_R = p[5]
    p_M = p[6]
    p_c = p[7]
    p_drag = p[8]
    p_jolt = p[9]
    c0 = p_mu*(p_faces*p_R)
    v_motor = y[2]
    v_machine = y[3]
    a_motor = y[4]
    a_machine = y[5]
    u_press = p[10]
    s_lining_sense = p[12]
    x0 = c0*(u_press*s_lining_sense)
    x1 = 16.666666666666668*(t + -4.0)
    x2 = p_jolt*exp(-(x1*x1)) + v_machine*p_drag + (a_machine*p_J2 - x0)
    out[0] = x0 + a_motor*p_J1 - (p_M - v_motor*p_c)
    out[1] = x2


@njit(error_model="numpy")
def residual_jacobian(t, y, p, out):
    """Residual derivatives by q, v, a, lambda. 0 operations."""
    p_J1 = p[0]
    p_J2 = p[1]
    p_c = p[7]
    p_drag = p[8]
    out[2] = p_c
    out[4] = p_J1
    out[9] = p_drag
    out[11] = p_J2


@njit(error_model="numpy")
def poses(t, y, p, out):
    """Per body: position, rotation matrix (body to world). 6 operations."""
    q_motor = y[0]
    q_machine = y[1]
    x0 = cos(q_motor)
    x1 = sin(q_motor)
    x2 = cos(q_machine)
    x3 = sin(q_machine)
    out[0] = 0.0
    out[1] = 0.0
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
    out[12] = 0.45
    out[13] = 0.0
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


@njit(error_model="numpy")
def shapes(t, y, p, out):
    """Sizes of the bodies' shapes. 0 operations."""
    out[0] = 0.28
    out[1] = 0.05
    out[2] = 0.05
    out[3] = 0.36
    out[4] = 0.06
    out[5] = 0.06


@njit(error_model="numpy")
def outputs(t, y, p, out):
    """Outputs. 1 operation."""
    v_motor = y[2]
    v_machine = y[3]
    out[0] = v_motor - v_machine


@njit(error_model="numpy")
def events(t, y, p, out):
    """Event functions. 2 operations."""
    v_motor = y[2]
    v_machine = y[3]
    s_lining_sense = p[12]
    out[0] = s_lining_sense*(v_motor - v_machine)


@njit(error_model="numpy")
def limits(t, y, p, out):
    """Numbers of parameters that have a bound. 0 operations."""
    p_J1 = p[0]
    p_J2 = p[1]
    out[0] = p_J1
    out[1] = p_J2


@njit(error_model="numpy")
def switches(t, y, p, out):
    """Gaps and restitutions of stops; speeds, levels and largest levels of frictions. 6 operations."""
    p_mu = p[2]
    p_mu_s = p[3]
    p_faces = p[4]
    p_R = p[5]
    c0 = p_faces*p_R
    c1 = p_mu*c0
    v_motor = y[2]
    v_machine = y[3]
    u_press = p[10]
    out[0] = v_motor - v_machine
    out[1] = u_press*c1
    out[2] = p_mu_s*(u_press*c0)


@njit(error_model="numpy")
def time_terms(t, y, p, out):
    """What the equations have of time alone, beyond polynomials. 5 operations."""
    x0 = 16.666666666666668*(t + -4.0)
    out[0] = exp(-(x0*x0))


@njit(error_model="numpy")
def closed_rhs(t, y, p, out):
    """State derivative: rates, accelerations, power, multipliers, pivot ratio. 41 operations."""
    p_J1 = p[0]
    p_J2 = p[1]
    p_mu = p[2]
    p_faces = p[4]
    p_R = p[5]
    p_M = p[6]
    p_c = p[7]
    p_drag = p[8]
    p_jolt = p[9]
    c0 = 1.0/p_J1
    c1 = 1.0/p_J2
    c2 = p_R*(p_mu*p_faces)
    v_motor = y[2]
    v_machine = y[3]
    u_press = p[10]
    s_lining_stuck = p[11]
    s_lining_sense = p[12]
    x0 = s_lining_stuck*c0
    x1 = s_lining_stuck*c1
    x2 = 1.0/(1.0 - s_lining_stuck + s_lining_stuck*x0 + s_lining_stuck*x1)
    x3 = u_press*s_lining_sense*c2
    x4 = x3 - (p_M - v_motor*p_c)
    x5 = 16.666666666666668*(t + -4.0)
    x6 = p_jolt*exp(-(x5*x5)) + v_machine*p_drag - x3
    x7 = x2*(x0*x4 - x1*x6)
    out[0] = v_motor
    out[1] = v_machine
    out[2] = x0*x7 - c0*x4
    out[3] = -(c1*x6 + x1*x7)
    out[4] = -(v_motor*x4 + v_machine*x6)
    out[5] = x7
    out[6] = 1.0


@njit(error_model="numpy")
def closed_residual(t, y, p, out):
    """M a - f - G^T lambda, then G a - gamma. 28 operations."""
    p_J1 = p[0]
    p_J2 = p[1]
    p_mu = p[2]
    p_faces = p[4]
    p_R = p[5]
    p_M = p[6]
    p_c = p[7]
    p_drag = p[8]
    p_jolt = p[9]
    c0 = p_R*(p_mu*p_faces)
    v_motor = y[2]
    v_machine = y[3]
    a_motor = y[4]
    a_machine = y[5]
    lam_lining = y[6]
    u_press = p[10]
    s_lining_stuck = p[11]
    s_lining_sense = p[12]
    x0 = u_press*s_lining_sense*c0
    x1 = lam_lining*s_lining_stuck
    x2 = 16.666666666666668*(t + -4.0)
    x3 = p_jolt*exp(-(x2*x2)) + v_machine*p_drag + (a_machine*p_J2 - x0)
    x4 = s_lining_stuck*(a_motor - a_machine) + lam_lining*(1.0 - s_lining_stuck)
    out[0] = x0 + a_motor*p_J1 - (p_M - v_motor*p_c) - x1
    out[1] = x1 + x3
    out[2] = x4


@njit(error_model="numpy")
def closed_residual_jacobian(t, y, p, out):
    """Residual derivatives by q, v, a, lambda. 2 operations."""
    p_J1 = p[0]
    p_J2 = p[1]
    p_c = p[7]
    p_drag = p[8]
    s_lining_stuck = p[11]
    x0 = -s_lining_stuck
    out[2] = p_c
    out[4] = p_J1
    out[6] = x0
    out[10] = p_drag
    out[12] = p_J2
    out[13] = s_lining_stuck
    out[18] = s_lining_stuck
    out[19] = x0
    out[20] = 1.0 - s_lining_stuck


@njit(error_model="numpy")
def closed_constraint_residual(t, y, p, out):
    """Position residuals, velocity residuals. 2 operations."""
    v_motor = y[2]
    v_machine = y[3]
    s_lining_stuck = p[11]
    out[0] = s_lining_stuck*(v_motor - v_machine)


@njit(error_model="numpy")
def closed_constraint_jacobian(t, y, p, out):
    """Constraint Jacobian G, row by row. 1 operation."""
    s_lining_stuck = p[11]
    out[0] = s_lining_stuck
    out[1] = -s_lining_stuck


@njit(error_model="numpy")
def closed_gamma(t, y, p, out):
    """Right-hand side of G a = gamma. 0 operations."""
    out[0] = 0.0


@njit(error_model="numpy")
def closed_project(t, y, p, out):
    """State moved onto the constraints, and the residuals it had. 17 operations."""
    p_J1 = p[0]
    p_J2 = p[1]
    c0 = 1.0/p_J1
    c1 = 1.0/p_J2
    q_motor = y[0]
    q_machine = y[1]
    v_motor = y[2]
    v_machine = y[3]
    s_lining_stuck = p[11]
    x0 = s_lining_stuck*c0
    x1 = s_lining_stuck*(v_motor - v_machine)
    x2 = s_lining_stuck*c1
    x3 = 1.0/(1.0 - s_lining_stuck + s_lining_stuck*x0 + s_lining_stuck*x2)
    x4 = x1*x3
    out[0] = q_motor
    out[1] = q_machine
    out[2] = v_motor - x0*x4
    out[3] = v_machine + x2*x4
    out[4] = x1


@njit(error_model="numpy")
def closed_events(t, y, p, out):
    """Event functions. 40 operations."""
    p_J1 = p[0]
    p_J2 = p[1]
    p_mu = p[2]
    p_mu_s = p[3]
    p_faces = p[4]
    p_R = p[5]
    p_M = p[6]
    p_c = p[7]
    p_drag = p[8]
    p_jolt = p[9]
    c0 = p_mu_s*(p_faces*p_R)
    c1 = 1.0/p_J1
    c2 = 1.0/p_J2
    c3 = p_R*(p_mu*p_faces)
    v_motor = y[2]
    v_machine = y[3]
    u_press = p[10]
    s_lining_stuck = p[11]
    s_lining_sense = p[12]
    x0 = 1.0 - s_lining_stuck
    x1 = s_lining_stuck*c1
    x2 = s_lining_stuck*c2
    x3 = u_press*s_lining_sense*c3
    x4 = 16.666666666666668*(t + -4.0)
    x5 = x1*(x3 - (p_M - v_motor*p_c)) - x2*(p_jolt*exp(-(x4*x4)) + v_machine*p_drag - x3)
    x6 = u_press*c0 - fabs(1.0/(x0 + s_lining_stuck*x1 + s_lining_stuck*x2)*x5)
    x7 = x0*(s_lining_sense*(v_motor - v_machine)) + s_lining_stuck*x6
    out[0] = x7
