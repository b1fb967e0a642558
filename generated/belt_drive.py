"""belt_drive: equations of motion, written by symgen 0.1.0. Do not edit.

Belt drive: a motor starts a fan by an elastic belt, and the fan's shaft a pump by a crossed one
"""

from math import cos, sin, sqrt, tanh

from numba import njit

MODEL = {
    "abi": 1,
    "generator": "symgen 0.1.0",
    "source": "sha256:6a9af04816119ecd0292b9daab5e2509f4aeb5f95c1667f9457ae721eaaef1f1",
    "name": "belt_drive",
    "description": "Belt drive: a motor starts a fan by an elastic belt, and the fan's shaft a pump by a crossed one",
    "nq": 4,
    "nv": 4,
    "nh": 1,
    "nn": 0,
    "nw": 1,
    "coordinates": [
        {"name": "motor", "unit": "rad", "value": 0.0, "enforced": False},
        {"name": "fan", "unit": "rad", "value": 0.0, "enforced": False},
        {"name": "pump", "unit": "rad", "value": 0.0, "enforced": False},
        {"name": "current_integral", "unit": "(A)*s", "value": 0.0, "enforced": False},
    ],
    "quaternions": [],
    "rates": [
        {"name": "motor", "unit": "rad/s", "value": 0.0, "enforced": False},
        {"name": "fan", "unit": "rad/s", "value": 0.0, "enforced": False},
        {"name": "pump", "unit": "rad/s", "value": 0.0, "enforced": False},
        {"name": "current", "unit": "A", "value": 0.0, "enforced": True},
    ],
    "parameters": [
        {"name": "U", "unit": "V", "value": 48.0, "doc": ""},
        {"name": "R", "unit": "ohm", "value": 0.5, "doc": ""},
        {"name": "L", "unit": "H", "value": 0.004, "doc": ""},
        {"name": "k", "unit": "N*m/A", "value": 0.15, "doc": "of the motor: torque per current, voltage per speed"},
        {"name": "J_motor", "unit": "kg*m^2", "value": 0.002, "doc": ""},
        {"name": "J_fan", "unit": "kg*m^2", "value": 0.12, "doc": ""},
        {"name": "J_pump", "unit": "kg*m^2", "value": 0.01, "doc": ""},
        {"name": "r_motor", "unit": "m", "value": 0.04, "doc": ""},
        {"name": "r_fan", "unit": "m", "value": 0.12, "doc": ""},
        {"name": "r_shaft", "unit": "m", "value": 0.06, "doc": "second pulley on the fan's shaft"},
        {"name": "r_pump", "unit": "m", "value": 0.05, "doc": ""},
        {"name": "stretch", "unit": "N/m", "value": 25000.0, "doc": "stiffness of both runs of the first belt together"},
        {"name": "damping", "unit": "N*s/m", "value": 20.0, "doc": ""},
        {"name": "drag", "unit": "N*m*s^2", "value": 0.0022, "doc": "of the fan, per squared speed"},
        {"name": "load", "unit": "N*m", "value": 0.6, "doc": "of the pump"},
        {"name": "slow", "unit": "rad/s", "value": 2.0, "doc": "below which the pump has no head"},
        {"name": "preload", "unit": "N", "value": 250.0, "doc": "in each run of the first belt, at rest"},
    ],
    "inputs": [],
    "constants": [
        {"name": "apart", "unit": "m", "value": 0.5},
        {"name": "above", "unit": "m", "value": 0.35},
    ],
    "constraints": [
        {"name": "crossed", "kind": "holonomic", "multiplier": "N"},
    ],
    "outputs": [
        {"name": "tight", "unit": "N"},
        {"name": "slack", "unit": "N"},
        {"name": "second_belt", "unit": ""},
        {"name": "power", "unit": "W"},
    ],
    "events": [
        {"name": "slips", "direction": "falling", "action": "record"},
        {"name": "jump_0", "direction": "both", "action": "jump", "says": "abs(dot(fan)) in the force on fan"},
    ],
    "bodies": [
        {"name": "motor", "planar": False, "shape": "solids", "sizes": 23, "mesh": "", "parts": ["cylinder", "box"]},
        {"name": "fan", "planar": False, "shape": "solids", "sizes": 34, "mesh": "", "parts": ["cylinder", "cylinder", "box"]},
        {"name": "pump", "planar": False, "shape": "solids", "sizes": 23, "mesh": "", "parts": ["cylinder", "box"]},
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
        "rhs": 67,
        "mass_matrix": 0,
        "forces": 38,
        "energy": 15,
        "residual": 49,
        "residual_jacobian": 45,
        "constraint_residual": 6,
        "constraint_jacobian": 0,
        "gamma": 0,
        "project": 24,
        "poses": 9,
        "shapes": 3,
        "outputs": 13,
        "events": 11,
        "marks": 26,
        "limits": 3,
    },
    "hoisted": {
        "rhs": 16,
        "forces": 6,
        "energy": 1,
        "residual": 6,
        "residual_jacobian": 24,
        "project": 5,
        "shapes": 3,
        "marks": 18,
    },
    "run": {
        "t_end": 3.0,
        "fps": 60.0,
    },
    "sensed": True,
    "limits": [
        {"name": "bodies.motor.shape[0].cylinder[0]", "bound": "positive"},
        {"name": "bodies.motor.shape[1].box[0]", "bound": "positive"},
        {"name": "bodies.motor.inertia[0]", "bound": "zero or more"},
        {"name": "bodies.motor.inertia", "bound": "a tensor without negative moments", "numbers": 3},
        {"name": "bodies.fan.shape[0].cylinder[0]", "bound": "positive"},
        {"name": "bodies.fan.shape[1].cylinder[0]", "bound": "positive"},
        {"name": "bodies.fan.shape[2].box[0]", "bound": "positive"},
        {"name": "bodies.fan.inertia[0]", "bound": "zero or more"},
        {"name": "bodies.fan.inertia", "bound": "a tensor without negative moments", "numbers": 3},
        {"name": "bodies.pump.shape[0].cylinder[0]", "bound": "positive"},
        {"name": "bodies.pump.shape[1].box[0]", "bound": "positive"},
        {"name": "bodies.pump.inertia[0]", "bound": "zero or more"},
        {"name": "bodies.pump.inertia", "bound": "a tensor without negative moments", "numbers": 3},
    ],
    "states": [
        3,
    ],
    "subsystems": [],
    "marks": [
        {"kind": "ground", "name": "motor", "body": "", "numbers": 3},
        {"kind": "pin", "name": "motor", "body": "", "numbers": 6},
        {"kind": "ground", "name": "fan", "body": "", "numbers": 3},
        {"kind": "pin", "name": "fan", "body": "", "numbers": 6},
        {"kind": "ground", "name": "pump", "body": "", "numbers": 3},
        {"kind": "pin", "name": "pump", "body": "", "numbers": 6},
        {"kind": "link", "name": "upper", "body": "", "numbers": 6},
        {"kind": "link", "name": "lower", "body": "", "numbers": 6},
        {"kind": "link", "name": "left", "body": "", "numbers": 6},
        {"kind": "link", "name": "right", "body": "", "numbers": 6},
    ],
}

@njit(error_model="numpy")
def rhs(t, y, p, out):
    """State derivative: rates, accelerations, power, multipliers, pivot ratio. 67 operations."""
    p_U = p[0]
    p_R = p[1]
    p_L = p[2]
    p_k = p[3]
    p_J_motor = p[4]
    p_J_fan = p[5]
    p_J_pump = p[6]
    p_r_motor = p[7]
    p_r_fan = p[8]
    p_r_shaft = p[9]
    p_r_pump = p[10]
    p_stretch = p[11]
    p_damping = p[12]
    p_drag = p[13]
    p_load = p[14]
    p_slow = p[15]
    c0 = 1.0/p_J_motor
    c1 = p_r_motor*p_damping
    c2 = p_r_motor*p_stretch
    c3 = 1.0/p_J_fan
    c4 = p_r_shaft*c3
    c5 = p_r_fan*p_damping
    c6 = p_r_fan*p_stretch
    c7 = 1.0/p_slow
    c8 = 1.0/p_J_pump
    c9 = p_r_pump*c8
    c10 = p_load*c9
    c11 = 1.0/(p_r_shaft*c4 + p_r_pump*c9)
    c12 = c4*c11
    c13 = c9*c11
    c14 = p_load*c8
    c15 = 1.0/p_L
    q_motor = y[0]
    q_fan = y[1]
    v_motor = y[4]
    v_fan = y[5]
    v_pump = y[6]
    v_current = y[7]
    b_0 = p[17]
    x0 = v_motor*p_r_motor - v_fan*p_r_fan
    x1 = x0*c1
    x2 = q_motor*p_r_motor - q_fan*p_r_fan
    x3 = v_current*p_k
    x4 = p_drag*(v_fan*(-v_fan if v_fan + 1e+300*b_0 < 0.0 else v_fan))
    x5 = x0*c5
    x6 = x4 - (x5 + x2*c6)
    x7 = tanh(v_pump*c7)
    x8 = c4*x6 + x7*c10
    out[0] = v_motor
    out[1] = v_fan
    out[2] = v_pump
    out[3] = v_current
    out[4] = -(c0*(x1 + x2*c2 - x3))
    out[5] = x8*c12 - c3*x6
    out[6] = x8*c13 - x7*c14
    out[7] = c15*(p_U - v_current*p_R - v_motor*p_k)
    out[8] = v_motor*(x3 - x1) + v_fan*(x5 - x4) - v_pump*(p_load*x7)
    out[9] = c11*x8
    out[10] = 1.0


@njit(error_model="numpy")
def mass_matrix(t, y, p, out):
    """Mass matrix M, row by row. 0 operations."""
    p_J_motor = p[4]
    p_J_fan = p[5]
    p_J_pump = p[6]
    out[0] = p_J_motor
    out[5] = p_J_fan
    out[10] = p_J_pump
    out[15] = 1.0


@njit(error_model="numpy")
def forces(t, y, p, out):
    """Forces f of M a = f + G^T lambda. 38 operations."""
    p_U = p[0]
    p_R = p[1]
    p_L = p[2]
    p_k = p[3]
    p_r_motor = p[7]
    p_r_fan = p[8]
    p_stretch = p[11]
    p_damping = p[12]
    p_drag = p[13]
    p_load = p[14]
    p_slow = p[15]
    c0 = p_r_motor*p_damping
    c1 = p_r_motor*p_stretch
    c2 = p_r_fan*p_damping
    c3 = p_r_fan*p_stretch
    c4 = 1.0/p_slow
    c5 = 1.0/p_L
    q_motor = y[0]
    q_fan = y[1]
    v_motor = y[4]
    v_fan = y[5]
    v_pump = y[6]
    v_current = y[7]
    b_0 = p[17]
    x0 = v_motor*p_r_motor - v_fan*p_r_fan
    x1 = q_motor*p_r_motor - q_fan*p_r_fan
    x2 = p_drag*(v_fan*(-v_fan if v_fan + 1e+300*b_0 < 0.0 else v_fan))
    out[0] = -(x0*c0 + x1*c1 - v_current*p_k)
    out[1] = -(x2 - (x0*c2 + x1*c3))
    out[2] = -(p_load*tanh(v_pump*c4))
    out[3] = c5*(p_U - v_current*p_R - v_motor*p_k)


@njit(error_model="numpy")
def energy(t, y, p, out):
    """Kinetic and potential energy. 15 operations."""
    p_J_motor = p[4]
    p_J_fan = p[5]
    p_J_pump = p[6]
    p_r_motor = p[7]
    p_r_fan = p[8]
    p_stretch = p[11]
    c0 = 0.5*p_stretch
    q_motor = y[0]
    q_fan = y[1]
    v_motor = y[4]
    v_fan = y[5]
    v_pump = y[6]
    x0 = p_J_motor*(v_motor*v_motor) + p_J_fan*(v_fan*v_fan) + p_J_pump*(v_pump*v_pump)
    x1 = q_motor*p_r_motor - q_fan*p_r_fan
    out[0] = 0.5*x0
    out[1] = x1*x1*c0


@njit(error_model="numpy")
def residual(t, y, p, out):
    """M a - f - G^T lambda, then G a - gamma. 49 operations."""
    p_U = p[0]
    p_R = p[1]
    p_L = p[2]
    p_k = p[3]
    p_J_motor = p[4]
    p_J_fan = p[5]
    p_J_pump = p[6]
    p_r_motor = p[7]
    p_r_fan = p[8]
    p_r_shaft = p[9]
    p_r_pump = p[10]
    p_stretch = p[11]
    p_damping = p[12]
    p_drag = p[13]
    p_load = p[14]
    p_slow = p[15]
    c0 = p_r_motor*p_stretch
    c1 = p_r_motor*p_damping
    c2 = p_r_fan*p_damping
    c3 = p_r_fan*p_stretch
    c4 = 1.0/p_slow
    c5 = 1.0/p_L
    q_motor = y[0]
    q_fan = y[1]
    v_motor = y[4]
    v_fan = y[5]
    v_pump = y[6]
    v_current = y[7]
    a_motor = y[8]
    a_fan = y[9]
    a_pump = y[10]
    a_current = y[11]
    lam_crossed = y[12]
    b_0 = p[17]
    x0 = q_motor*p_r_motor - q_fan*p_r_fan
    x1 = v_motor*p_r_motor - v_fan*p_r_fan
    x2 = p_drag*(v_fan*(-v_fan if v_fan + 1e+300*b_0 < 0.0 else v_fan))
    x3 = p_load*tanh(v_pump*c4) + a_pump*p_J_pump - lam_crossed*p_r_pump
    out[0] = x0*c0 + (x1*c1 + a_motor*p_J_motor) - v_current*p_k
    out[1] = x2 + (a_fan*p_J_fan - x1*c2 - x0*c3) - lam_crossed*p_r_shaft
    out[2] = x3
    out[3] = a_current - c5*(p_U - v_current*p_R - v_motor*p_k)
    out[4] = a_fan*p_r_shaft + a_pump*p_r_pump


@njit(error_model="numpy")
def residual_jacobian(t, y, p, out):
    """Residual derivatives by q, v, a, lambda. 45 operations."""
    p_R = p[1]
    p_L = p[2]
    p_k = p[3]
    p_J_motor = p[4]
    p_J_fan = p[5]
    p_J_pump = p[6]
    p_r_motor = p[7]
    p_r_fan = p[8]
    p_r_shaft = p[9]
    p_r_pump = p[10]
    p_stretch = p[11]
    p_damping = p[12]
    p_drag = p[13]
    p_load = p[14]
    p_slow = p[15]
    c0 = 0.5*p_stretch
    c1 = 2.0*p_r_motor
    c2 = c0*c1
    c3 = p_r_motor*c2
    c4 = 2.0*p_r_fan
    c5 = c0*c4
    c6 = -(p_r_motor*c5)
    c7 = 0.5*p_damping
    c8 = c7*c1
    c9 = p_r_motor*c8
    c10 = c7*c4
    c11 = -(p_r_motor*c10)
    c12 = -p_k
    c13 = -(p_r_fan*c2)
    c14 = p_r_fan*c5
    c15 = -(p_r_fan*c8)
    c16 = p_r_fan*c10
    c17 = -p_r_shaft
    c18 = 1.0/p_slow
    c19 = p_load*c18
    c20 = -p_r_pump
    c21 = 1.0/p_L
    c22 = p_k*c21
    c23 = p_R*c21
    v_fan = y[5]
    v_pump = y[6]
    b_0 = p[17]
    x0 = v_fan + 1e+300*b_0
    x1 = v_fan*((0.0 if x0 < 0.0 else 1.0) - (1.0 if x0 < 0.0 else 0.0))
    x2 = tanh(v_pump*c18)
    out[0] = c3
    out[1] = c6
    out[4] = c9
    out[5] = c11
    out[7] = c12
    out[8] = p_J_motor
    out[13] = c13
    out[14] = c14
    out[17] = c15
    out[18] = c16 + (p_drag*(-v_fan if x0 < 0.0 else v_fan) + p_drag*x1)
    out[22] = p_J_fan
    out[25] = c17
    out[32] = (1.0 - x2*x2)*c19
    out[36] = p_J_pump
    out[38] = c20
    out[43] = c22
    out[46] = c23
    out[50] = 1.0
    out[61] = p_r_shaft
    out[62] = p_r_pump


@njit(error_model="numpy")
def constraint_residual(t, y, p, out):
    """Position residuals, velocity residuals. 6 operations."""
    p_r_shaft = p[9]
    p_r_pump = p[10]
    q_fan = y[1]
    q_pump = y[2]
    v_fan = y[5]
    v_pump = y[6]
    out[0] = q_fan*p_r_shaft + q_pump*p_r_pump
    out[1] = v_fan*p_r_shaft + v_pump*p_r_pump


@njit(error_model="numpy")
def constraint_jacobian(t, y, p, out):
    """Constraint Jacobian G, row by row. 0 operations."""
    p_r_shaft = p[9]
    p_r_pump = p[10]
    out[1] = p_r_shaft
    out[2] = p_r_pump


@njit(error_model="numpy")
def gamma(t, y, p, out):
    """Right-hand side of G a = gamma. 0 operations."""
    out[0] = 0.0


@njit(error_model="numpy")
def project(t, y, p, out):
    """State moved onto the constraints, and the residuals it had. 24 operations."""
    p_J_fan = p[5]
    p_J_pump = p[6]
    p_r_shaft = p[9]
    p_r_pump = p[10]
    c0 = p_r_shaft*(1.0/p_J_fan)
    c1 = p_r_pump*(1.0/p_J_pump)
    c2 = 1.0/(p_r_shaft*c0 + p_r_pump*c1)
    c3 = c0*c2
    c4 = c1*c2
    q_motor = y[0]
    q_fan = y[1]
    q_pump = y[2]
    q_current_integral = y[3]
    v_motor = y[4]
    v_fan = y[5]
    v_pump = y[6]
    v_current = y[7]
    x0 = q_fan*p_r_shaft + q_pump*p_r_pump
    x1 = v_fan*p_r_shaft + v_pump*p_r_pump
    out[0] = q_motor
    out[1] = q_fan - x0*c3
    out[2] = q_pump - x0*c4
    out[3] = q_current_integral
    out[4] = v_motor
    out[5] = v_fan - x1*c3
    out[6] = v_pump - x1*c4
    out[7] = v_current
    out[8] = x0
    out[9] = x1


@njit(error_model="numpy")
def poses(t, y, p, out):
    """Per body: position, rotation matrix (body to world). 9 operations."""
    q_motor = y[0]
    q_fan = y[1]
    q_pump = y[2]
    x0 = cos(q_motor)
    x1 = sin(q_motor)
    x2 = cos(q_fan)
    x3 = sin(q_fan)
    x4 = cos(q_pump)
    x5 = sin(q_pump)
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
    out[12] = 0.5
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
    out[24] = 0.5
    out[25] = 0.35
    out[26] = 0.04
    out[27] = x4
    out[28] = -x5
    out[29] = 0.0
    out[30] = x5
    out[31] = x4
    out[32] = 0.0
    out[33] = 0.0
    out[34] = 0.0
    out[35] = 1.0


@njit(error_model="numpy")
def shapes(t, y, p, out):
    """Sizes of the bodies' shapes. 3 operations."""
    p_r_motor = p[7]
    p_r_fan = p[8]
    p_r_shaft = p[9]
    p_r_pump = p[10]
    c0 = 2.0*p_r_motor
    c1 = 2.0*p_r_fan
    c2 = 2.0*p_r_pump
    out[0] = p_r_motor
    out[1] = 0.03
    out[2] = 0.0
    out[3] = 0.0
    out[4] = 0.0
    out[5] = 1.0
    out[6] = 0.0
    out[7] = 0.0
    out[8] = 0.0
    out[9] = 0.0
    out[10] = 1.0
    out[11] = c0
    out[12] = 0.008
    out[13] = 0.04
    out[14] = 0.0
    out[15] = 0.0
    out[16] = 0.0
    out[17] = 1.0
    out[18] = 0.0
    out[19] = 0.0
    out[20] = 0.0
    out[21] = 0.0
    out[22] = 1.0
    out[23] = p_r_fan
    out[24] = 0.03
    out[25] = 0.0
    out[26] = 0.0
    out[27] = 0.0
    out[28] = 1.0
    out[29] = 0.0
    out[30] = 0.0
    out[31] = 0.0
    out[32] = 0.0
    out[33] = 1.0
    out[34] = p_r_shaft
    out[35] = 0.03
    out[36] = 0.0
    out[37] = 0.0
    out[38] = 0.04
    out[39] = 1.0
    out[40] = 0.0
    out[41] = 0.0
    out[42] = 0.0
    out[43] = 0.0
    out[44] = 1.0
    out[45] = c1
    out[46] = 0.012
    out[47] = 0.04
    out[48] = 0.0
    out[49] = 0.0
    out[50] = 0.0
    out[51] = 1.0
    out[52] = 0.0
    out[53] = 0.0
    out[54] = 0.0
    out[55] = 0.0
    out[56] = 1.0
    out[57] = p_r_pump
    out[58] = 0.03
    out[59] = 0.0
    out[60] = 0.0
    out[61] = 0.0
    out[62] = 1.0
    out[63] = 0.0
    out[64] = 0.0
    out[65] = 0.0
    out[66] = 0.0
    out[67] = 1.0
    out[68] = c2
    out[69] = 0.008
    out[70] = 0.04
    out[71] = 0.0
    out[72] = 0.0
    out[73] = 0.0
    out[74] = 1.0
    out[75] = 0.0
    out[76] = 0.0
    out[77] = 0.0
    out[78] = 0.0
    out[79] = 1.0


@njit(error_model="numpy")
def outputs(t, y, p, out):
    """Outputs. 13 operations."""
    p_U = p[0]
    p_r_motor = p[7]
    p_r_fan = p[8]
    p_stretch = p[11]
    p_damping = p[12]
    p_preload = p[16]
    q_motor = y[0]
    q_fan = y[1]
    v_motor = y[4]
    v_fan = y[5]
    v_current = y[7]
    lam_crossed = y[12]
    x0 = p_damping*(v_motor*p_r_motor - v_fan*p_r_fan) + p_stretch*(q_motor*p_r_motor - q_fan*p_r_fan)
    x1 = 0.5*x0
    out[0] = p_preload + x1
    out[1] = p_preload - x1
    out[2] = lam_crossed
    out[3] = v_current*p_U


@njit(error_model="numpy")
def events(t, y, p, out):
    """Event functions. 11 operations."""
    p_r_motor = p[7]
    p_r_fan = p[8]
    p_stretch = p[11]
    p_damping = p[12]
    p_preload = p[16]
    q_motor = y[0]
    q_fan = y[1]
    v_motor = y[4]
    v_fan = y[5]
    x0 = p_damping*(v_motor*p_r_motor - v_fan*p_r_fan) + p_stretch*(q_motor*p_r_motor - q_fan*p_r_fan)
    out[0] = p_preload - 0.5*x0
    out[1] = v_fan


@njit(error_model="numpy")
def marks(t, y, p, out):
    """What a picture shows besides bodies, as `marks` lists it. 26 operations."""
    p_r_motor = p[7]
    p_r_fan = p[8]
    p_r_shaft = p[9]
    p_r_pump = p[10]
    c0 = 2.0*(p_r_motor - p_r_fan)
    c1 = p_r_motor*c0
    c2 = sqrt(1.0 - c0*c0)
    c3 = p_r_motor*c2
    c4 = 0.5 + p_r_fan*c0
    c5 = p_r_fan*c2
    c6 = -c3
    c7 = -c5
    c8 = 2.857142857142857*(p_r_shaft + p_r_pump)
    c9 = sqrt(1.0 - c8*c8)
    c10 = p_r_shaft*c9
    c11 = 0.5 - c10
    c12 = p_r_shaft*c8
    c13 = p_r_pump*c9
    c14 = 0.5 + c13
    c15 = 0.35 - p_r_pump*c8
    c16 = 0.5 + c10
    c17 = 0.5 - c13
    out[8] = 1.0
    out[9] = 0.5
    out[12] = 0.5
    out[17] = 1.0
    out[18] = 0.5
    out[19] = 0.35
    out[20] = 0.04
    out[21] = 0.5
    out[22] = 0.35
    out[23] = 0.04
    out[26] = 1.0
    out[27] = c1
    out[28] = c3
    out[30] = c4
    out[31] = c5
    out[33] = c1
    out[34] = c6
    out[36] = c4
    out[37] = c7
    out[39] = c11
    out[40] = c12
    out[41] = 0.04
    out[42] = c14
    out[43] = c15
    out[44] = 0.04
    out[45] = c16
    out[46] = c12
    out[47] = 0.04
    out[48] = c17
    out[49] = c15
    out[50] = 0.04


@njit(error_model="numpy")
def limits(t, y, p, out):
    """Numbers of parameters that have a bound. 3 operations."""
    p_J_motor = p[4]
    p_J_fan = p[5]
    p_J_pump = p[6]
    p_r_motor = p[7]
    p_r_fan = p[8]
    p_r_shaft = p[9]
    p_r_pump = p[10]
    c0 = 2.0*p_r_motor
    c1 = 2.0*p_r_fan
    c2 = 2.0*p_r_pump
    out[0] = p_r_motor
    out[1] = c0
    out[2] = p_J_motor
    out[3] = p_J_motor
    out[4] = p_J_motor
    out[5] = p_J_motor
    out[6] = p_r_fan
    out[7] = p_r_shaft
    out[8] = c1
    out[9] = p_J_fan
    out[10] = p_J_fan
    out[11] = p_J_fan
    out[12] = p_J_fan
    out[13] = p_r_pump
    out[14] = c2
    out[15] = p_J_pump
    out[16] = p_J_pump
    out[17] = p_J_pump
    out[18] = p_J_pump
