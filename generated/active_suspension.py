"""active_suspension: equations of motion, written by symgen 0.1.0. Do not edit.

Quarter of a car whose body hangs on the sky: an actuator that lags behind, and a damper given by a curve
"""

from math import cos, fabs, sin

from numba import njit
from numpy import floor

MODEL = {
    "abi": 1,
    "generator": "symgen 0.1.0",
    "source": "sha256:c882ada7af29e5ed9fc15d7af3d376aa3a24e5af4da66ef02dd1a88313d47ee8",
    "name": "active_suspension",
    "description": "Quarter of a car whose body hangs on the sky: an actuator that lags behind, and a damper given by a curve",
    "nq": 4,
    "nv": 4,
    "nh": 0,
    "nn": 0,
    "nw": 1,
    "coordinates": [
        {"name": "z_body", "unit": "m", "value": 0.0, "enforced": True},
        {"name": "z_wheel", "unit": "m", "value": 0.0, "enforced": True},
        {"name": "force_integral", "unit": "(N)*s", "value": 0.0, "enforced": False},
        {"name": "speed_integral", "unit": "(m/s)*s", "value": 0.0, "enforced": False},
    ],
    "quaternions": [],
    "rates": [
        {"name": "z_body", "unit": "m/s", "value": 0.0, "enforced": True},
        {"name": "z_wheel", "unit": "m/s", "value": 0.0, "enforced": True},
        {"name": "force", "unit": "N", "value": 0.0, "enforced": True},
        {"name": "speed", "unit": "m/s", "value": 0.0, "enforced": True},
    ],
    "parameters": [
        {"name": "m_body", "unit": "kg", "value": 300.0, "doc": ""},
        {"name": "m_wheel", "unit": "kg", "value": 40.0, "doc": ""},
        {"name": "k_spring", "unit": "N/m", "value": 16000.0, "doc": ""},
        {"name": "k_tyre", "unit": "N/m", "value": 200000.0, "doc": ""},
        {"name": "c_sky", "unit": "N*s/m", "value": 2500.0, "doc": "the damper between body and sky that the actuator stands for"},
        {"name": "tau", "unit": "s", "value": 0.015, "doc": "how far the actuator lags behind"},
        {"name": "leak", "unit": "1/s", "value": 0.5, "doc": "how fast the controller forgets where the road was"},
        {"name": "F_most", "unit": "N", "value": 1800.0, "doc": "what the actuator can do"},
        {"name": "bump", "unit": "m", "value": 0.06, "doc": "height of the bump"},
        {"name": "t_bump", "unit": "s", "value": 0.5, "doc": "when it begins"},
        {"name": "t_width", "unit": "s", "value": 0.12, "doc": "how long it takes"},
    ],
    "inputs": [],
    "constants": [
        {"name": "body_height", "unit": "m", "value": 1.0},
        {"name": "wheel_height", "unit": "m", "value": 0.3},
        {"name": "road_thickness", "unit": "m", "value": 0.04},
    ],
    "constraints": [],
    "outputs": [
        {"name": "road_height", "unit": "m"},
        {"name": "body_acceleration", "unit": "m/s^2"},
        {"name": "damper_force", "unit": "N"},
    ],
    "events": [
        {"name": "jump_0", "direction": "both", "action": "jump", "says": "damper(dot(z_wheel - z_body)) in the force on z_body"},
        {"name": "jump_1", "direction": "both", "action": "jump", "says": "damper(dot(z_wheel - z_body)) in the force on z_body"},
        {"name": "jump_2", "direction": "both", "action": "jump", "says": "damper(dot(z_wheel - z_body)) in the force on z_body"},
        {"name": "jump_3", "direction": "both", "action": "jump", "says": "min(F_most, -c_sky*speed) in the derivative of force"},
        {"name": "jump_4", "direction": "both", "action": "jump", "says": "max(-F_most, min(F_most, -c_sky*speed)) in the derivative of force"},
    ],
    "bodies": [
        {"name": "body", "planar": True, "shape": "box", "sizes": 3, "mesh": ""},
        {"name": "wheel", "planar": True, "shape": "sphere", "sizes": 1, "mesh": ""},
        {"name": "pavement", "planar": True, "shape": "box", "sizes": 3, "mesh": ""},
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
        "rhs": 164,
        "mass_matrix": 0,
        "forces": 149,
        "energy": 27,
        "residual": 155,
        "residual_jacobian": 148,
        "poses": 14,
        "shapes": 0,
        "outputs": 127,
        "events": 62,
        "marks": 2,
        "limits": 0,
        "time_terms": 11,
    },
    "hoisted": {
        "rhs": 9,
        "forces": 6,
        "energy": 7,
        "residual": 6,
        "residual_jacobian": 8,
        "poses": 3,
        "outputs": 4,
        "time_terms": 3,
    },
    "run": {
        "t_end": 3.0,
        "fps": 100.0,
    },
    "limits": [
        {"name": "bodies.body.mass", "bound": "zero or more"},
        {"name": "bodies.wheel.mass", "bound": "zero or more"},
    ],
    "states": [
        2,
        3,
    ],
    "subsystems": [],
    "marks": [
        {"kind": "spring", "name": "spring", "body": "", "numbers": 6, "moves": True},
        {"kind": "damper", "name": "damper", "body": "", "numbers": 6, "moves": True},
        {"kind": "force", "name": "actuator", "body": "", "numbers": 6, "moves": True},
    ],
    "time_terms": 1,
}

@njit(error_model="numpy")
def rhs(t, y, p, out):
    """State derivative: rates, accelerations, power. 164 operations."""
    p_m_body = p[0]
    p_m_wheel = p[1]
    p_k_spring = p[2]
    p_k_tyre = p[3]
    p_c_sky = p[4]
    p_tau = p[5]
    p_leak = p[6]
    p_F_most = p[7]
    p_bump = p[8]
    p_t_bump = p[9]
    p_t_width = p[10]
    c0 = 1.0/p_m_body
    c1 = 1.0/p_m_wheel
    c2 = 1.0/p_t_width
    c3 = 0.5*p_bump
    c4 = 6.283185307179586*c2
    c5 = 1.0/p_tau
    c6 = -p_F_most
    c7 = 0.5*p_k_tyre
    c8 = c3*c4
    q_z_body = y[0]
    q_z_wheel = y[1]
    v_z_body = y[4]
    v_z_wheel = y[5]
    v_force = y[6]
    v_speed = y[7]
    b_0 = p[11]
    b_1 = p[12]
    b_2 = p[13]
    b_3 = p[14]
    b_4 = p[15]
    x0 = p_k_spring*(q_z_wheel - q_z_body)
    x1 = b_0*b_1
    x2 = b_2*x1
    x3 = v_z_wheel - v_z_body
    x4 = ((-1.0 if x3 < -0.3 else (-0.3 if x3 < -0.1 else -0.1)) if x3 < 0.0 else ((0.0 if x3 < 0.1 else 0.1) if x3 < 0.3 else 0.3))
    x5 = (1.4285714285714286 if x3 < -0.3 else (5.0 if x3 < -0.1 else 10.0))
    x6 = ((10.0 if x3 < 0.1 else 5.0) if x3 < 0.3 else 1.4285714285714286)
    x7 = ((0.0 if x3 < -0.3 else (1.0 if x3 < -0.1 else 2.0)) if x3 < 0.0 else ((3.0 if x3 < 0.1 else 4.0) if x3 < 0.3 else 5.0))
    x8 = (x3 - x4)*(x5 if x3 < 0.0 else x6) + x7
    x9 = (x8 if x8 < 6.5 else 6.5)
    x10 = (x9 if -0.5 < x9 else -0.5)
    x11 = 8.0*floor(0.0625*x2 + (0.125*x1 + (0.25*b_0 + 0.125*x10))) + (3.5 - 2.0*b_0)
    x12 = x11 - x1 - 0.5*x2
    x13 = (x12 if x2 < 0.0 else (x12 if -x2 < 0.0 else -8.0 + floor(8.0 + x10)))
    x14 = ((-1.0 if x13 < 0.5 else (-0.3 if x13 < 1.5 else -0.1)) if x13 < 2.5 else ((0.0 if x13 < 3.5 else 0.1) if x13 < 4.5 else 0.3))
    x15 = x3 - x14
    x16 = (1.4285714285714286 if x13 < 0.5 else (5.0 if x13 < 1.5 else 10.0))
    x17 = ((10.0 if x13 < 3.5 else 5.0) if x13 < 4.5 else 1.4285714285714286)
    x18 = x15*(x16 if x13 < 2.5 else x17)
    x19 = 1.0 - x18
    x20 = (0.7 if x13 < 0.5 else (0.19999999999999998 if x13 < 1.5 else 0.1))
    x21 = ((0.1 if x13 < 3.5 else 0.19999999999999998) if x13 < 4.5 else 0.7)
    x22 = (-(x19*(x15*x18)) if x13 < 5.5 else x15 - (x20 if x13 < 2.5 else x21))
    x23 = (826.5306122448981 if x13 < 0.5 else (2571.428571428572 if x13 < 1.5 else 4000.0))
    x24 = ((1285.714285714286 if x13 < 3.5 else 405.23837551500884) if x13 < 4.5 else 0.0)
    x25 = x18 + x18
    x26 = (0.0 if x13 < -0.5 else (x18*x18*(3.0 - x25) if x13 < 5.5 else 1.0))
    x27 = ((-900.0 if x13 < 0.5 else (-600.0 if x13 < 1.5 else 0.0)) if x13 < 2.5 else ((300.0 if x13 < 3.5 else 450.0) if x13 < 4.5 else 620.0))
    x28 = (1.0 if x13 < -0.5 else ((1.0 + x25)*(x19*x19) if x13 < 5.5 else 0.0))
    x29 = (-1250.0 if x13 < 0.5 else (-900.0 if x13 < 1.5 else -600.0))
    x30 = (x29 if x13 < 2.5 else ((0.0 if x13 < 3.5 else 300.0) if x13 < 4.5 else 450.0))
    x31 = (x15 if x13 < -0.5 else (x19*(x15*x19) if x13 < 5.5 else 0.0))
    x32 = (0.0 if x13 < 0.5 else (826.5306122448981 if x13 < 1.5 else 2571.428571428572))
    x33 = ((4000.0 if x13 < 3.5 else 1285.714285714286) if x13 < 4.5 else 405.23837551500884)
    x34 = (0.0 if x13 < -0.5 else x22)*(x23 if x13 < 2.5 else x24) + (x26*x27 + (x28*x30 + x31*(x32 if x13 < 2.5 else x33)))
    x35 = v_force + x34
    x36 = c0*(x0 + x35)
    x37 = t - p_t_bump
    x38 = c2*x37
    x39 = x37*c4
    x40 = (0.0 if x38 < 0.0 else (0.0 if 1.0 < x38 else c3*(1.0 - cos(x39))))
    x41 = q_z_wheel - x40
    x42 = v_speed*p_c_sky
    x43 = (p_F_most if x42 + (p_F_most + 1e+300*b_3) < 0.0 else -x42)
    x44 = (x43 if -(1e+300*b_4 + (p_F_most + x43)) < 0.0 else c6) - v_force
    x45 = (0.0 if x38 < 0.0 else (0.0 if 1.0 < x38 else sin(x39)*c8))*(2.0*x41)
    out[0] = v_z_body
    out[1] = v_z_wheel
    out[2] = v_force
    out[3] = v_speed
    out[4] = x36
    out[5] = -(c1*(x35 + (x0 + p_k_tyre*x41)))
    out[6] = c5*x44
    out[7] = x36 - v_speed*p_leak
    out[8] = v_z_body*x35 - v_z_wheel*x35 - c7*x45


@njit(error_model="numpy")
def mass_matrix(t, y, p, out):
    """Mass matrix M, row by row. 0 operations."""
    p_m_body = p[0]
    p_m_wheel = p[1]
    out[0] = p_m_body
    out[5] = p_m_wheel
    out[10] = 1.0
    out[15] = 1.0


@njit(error_model="numpy")
def forces(t, y, p, out):
    """Forces f of M a = f + G^T lambda. 149 operations."""
    p_m_body = p[0]
    p_k_spring = p[2]
    p_k_tyre = p[3]
    p_c_sky = p[4]
    p_tau = p[5]
    p_leak = p[6]
    p_F_most = p[7]
    p_bump = p[8]
    p_t_bump = p[9]
    p_t_width = p[10]
    c0 = 1.0/p_t_width
    c1 = 0.5*p_bump
    c2 = 6.283185307179586*c0
    c3 = 1.0/p_tau
    c4 = -p_F_most
    c5 = 1.0/p_m_body
    q_z_body = y[0]
    q_z_wheel = y[1]
    v_z_body = y[4]
    v_z_wheel = y[5]
    v_force = y[6]
    v_speed = y[7]
    b_0 = p[11]
    b_1 = p[12]
    b_2 = p[13]
    b_3 = p[14]
    b_4 = p[15]
    x0 = p_k_spring*(q_z_wheel - q_z_body)
    x1 = b_0*b_1
    x2 = b_2*x1
    x3 = v_z_wheel - v_z_body
    x4 = ((-1.0 if x3 < -0.3 else (-0.3 if x3 < -0.1 else -0.1)) if x3 < 0.0 else ((0.0 if x3 < 0.1 else 0.1) if x3 < 0.3 else 0.3))
    x5 = (1.4285714285714286 if x3 < -0.3 else (5.0 if x3 < -0.1 else 10.0))
    x6 = ((10.0 if x3 < 0.1 else 5.0) if x3 < 0.3 else 1.4285714285714286)
    x7 = ((0.0 if x3 < -0.3 else (1.0 if x3 < -0.1 else 2.0)) if x3 < 0.0 else ((3.0 if x3 < 0.1 else 4.0) if x3 < 0.3 else 5.0))
    x8 = (x3 - x4)*(x5 if x3 < 0.0 else x6) + x7
    x9 = (x8 if x8 < 6.5 else 6.5)
    x10 = (x9 if -0.5 < x9 else -0.5)
    x11 = 8.0*floor(0.0625*x2 + (0.125*x1 + (0.25*b_0 + 0.125*x10))) + (3.5 - 2.0*b_0)
    x12 = x11 - x1 - 0.5*x2
    x13 = (x12 if x2 < 0.0 else (x12 if -x2 < 0.0 else -8.0 + floor(8.0 + x10)))
    x14 = ((-1.0 if x13 < 0.5 else (-0.3 if x13 < 1.5 else -0.1)) if x13 < 2.5 else ((0.0 if x13 < 3.5 else 0.1) if x13 < 4.5 else 0.3))
    x15 = x3 - x14
    x16 = (1.4285714285714286 if x13 < 0.5 else (5.0 if x13 < 1.5 else 10.0))
    x17 = ((10.0 if x13 < 3.5 else 5.0) if x13 < 4.5 else 1.4285714285714286)
    x18 = x15*(x16 if x13 < 2.5 else x17)
    x19 = 1.0 - x18
    x20 = (0.7 if x13 < 0.5 else (0.19999999999999998 if x13 < 1.5 else 0.1))
    x21 = ((0.1 if x13 < 3.5 else 0.19999999999999998) if x13 < 4.5 else 0.7)
    x22 = (-(x19*(x15*x18)) if x13 < 5.5 else x15 - (x20 if x13 < 2.5 else x21))
    x23 = (826.5306122448981 if x13 < 0.5 else (2571.428571428572 if x13 < 1.5 else 4000.0))
    x24 = ((1285.714285714286 if x13 < 3.5 else 405.23837551500884) if x13 < 4.5 else 0.0)
    x25 = x18 + x18
    x26 = (0.0 if x13 < -0.5 else (x18*x18*(3.0 - x25) if x13 < 5.5 else 1.0))
    x27 = ((-900.0 if x13 < 0.5 else (-600.0 if x13 < 1.5 else 0.0)) if x13 < 2.5 else ((300.0 if x13 < 3.5 else 450.0) if x13 < 4.5 else 620.0))
    x28 = (1.0 if x13 < -0.5 else ((1.0 + x25)*(x19*x19) if x13 < 5.5 else 0.0))
    x29 = (-1250.0 if x13 < 0.5 else (-900.0 if x13 < 1.5 else -600.0))
    x30 = (x29 if x13 < 2.5 else ((0.0 if x13 < 3.5 else 300.0) if x13 < 4.5 else 450.0))
    x31 = (x15 if x13 < -0.5 else (x19*(x15*x19) if x13 < 5.5 else 0.0))
    x32 = (0.0 if x13 < 0.5 else (826.5306122448981 if x13 < 1.5 else 2571.428571428572))
    x33 = ((4000.0 if x13 < 3.5 else 1285.714285714286) if x13 < 4.5 else 405.23837551500884)
    x34 = (0.0 if x13 < -0.5 else x22)*(x23 if x13 < 2.5 else x24) + (x26*x27 + (x28*x30 + x31*(x32 if x13 < 2.5 else x33)))
    x35 = v_force + x34
    x36 = x0 + x35
    x37 = t - p_t_bump
    x38 = c0*x37
    x39 = (0.0 if x38 < 0.0 else (0.0 if 1.0 < x38 else c1*(1.0 - cos(x37*c2))))
    x40 = v_speed*p_c_sky
    x41 = (p_F_most if x40 + (p_F_most + 1e+300*b_3) < 0.0 else -x40)
    x42 = (x41 if -(1e+300*b_4 + (p_F_most + x41)) < 0.0 else c4) - v_force
    out[0] = x36
    out[1] = -(x35 + (x0 + p_k_tyre*(q_z_wheel - x39)))
    out[2] = c3*x42
    out[3] = c5*x36 - v_speed*p_leak


@njit(error_model="numpy")
def energy(t, y, p, out):
    """Kinetic and potential energy. 27 operations."""
    p_m_body = p[0]
    p_m_wheel = p[1]
    p_k_spring = p[2]
    p_k_tyre = p[3]
    p_bump = p[8]
    p_t_bump = p[9]
    p_t_width = p[10]
    c0 = 0.5*p_m_body
    c1 = 0.5*p_m_wheel
    c2 = 0.5*p_k_spring
    c3 = 0.5*p_k_tyre
    c4 = 1.0/p_t_width
    c5 = 0.5*p_bump
    c6 = 6.283185307179586*c4
    q_z_body = y[0]
    q_z_wheel = y[1]
    v_z_body = y[4]
    v_z_wheel = y[5]
    x0 = q_z_wheel - q_z_body
    x1 = t - p_t_bump
    x2 = c4*x1
    x3 = (0.0 if x2 < 0.0 else (0.0 if 1.0 < x2 else c5*(1.0 - cos(x1*c6))))
    x4 = q_z_wheel - x3
    out[0] = c0*(v_z_body*v_z_body) + c1*(v_z_wheel*v_z_wheel)
    out[1] = x0*x0*c2 + c3*(x4*x4)


@njit(error_model="numpy")
def residual(t, y, p, out):
    """M a - f - G^T lambda, then G a - gamma. 155 operations."""
    p_m_body = p[0]
    p_m_wheel = p[1]
    p_k_spring = p[2]
    p_k_tyre = p[3]
    p_c_sky = p[4]
    p_tau = p[5]
    p_leak = p[6]
    p_F_most = p[7]
    p_bump = p[8]
    p_t_bump = p[9]
    p_t_width = p[10]
    c0 = 1.0/p_t_width
    c1 = 0.5*p_bump
    c2 = 6.283185307179586*c0
    c3 = 1.0/p_tau
    c4 = -p_F_most
    c5 = 1.0/p_m_body
    q_z_body = y[0]
    q_z_wheel = y[1]
    v_z_body = y[4]
    v_z_wheel = y[5]
    v_force = y[6]
    v_speed = y[7]
    a_z_body = y[8]
    a_z_wheel = y[9]
    a_force = y[10]
    a_speed = y[11]
    b_0 = p[11]
    b_1 = p[12]
    b_2 = p[13]
    b_3 = p[14]
    b_4 = p[15]
    x0 = p_k_spring*(q_z_wheel - q_z_body)
    x1 = b_0*b_1
    x2 = b_2*x1
    x3 = v_z_wheel - v_z_body
    x4 = ((-1.0 if x3 < -0.3 else (-0.3 if x3 < -0.1 else -0.1)) if x3 < 0.0 else ((0.0 if x3 < 0.1 else 0.1) if x3 < 0.3 else 0.3))
    x5 = (1.4285714285714286 if x3 < -0.3 else (5.0 if x3 < -0.1 else 10.0))
    x6 = ((10.0 if x3 < 0.1 else 5.0) if x3 < 0.3 else 1.4285714285714286)
    x7 = ((0.0 if x3 < -0.3 else (1.0 if x3 < -0.1 else 2.0)) if x3 < 0.0 else ((3.0 if x3 < 0.1 else 4.0) if x3 < 0.3 else 5.0))
    x8 = (x3 - x4)*(x5 if x3 < 0.0 else x6) + x7
    x9 = (x8 if x8 < 6.5 else 6.5)
    x10 = (x9 if -0.5 < x9 else -0.5)
    x11 = 8.0*floor(0.0625*x2 + (0.125*x1 + (0.25*b_0 + 0.125*x10))) + (3.5 - 2.0*b_0)
    x12 = x11 - x1 - 0.5*x2
    x13 = (x12 if x2 < 0.0 else (x12 if -x2 < 0.0 else -8.0 + floor(8.0 + x10)))
    x14 = ((-1.0 if x13 < 0.5 else (-0.3 if x13 < 1.5 else -0.1)) if x13 < 2.5 else ((0.0 if x13 < 3.5 else 0.1) if x13 < 4.5 else 0.3))
    x15 = x3 - x14
    x16 = (1.4285714285714286 if x13 < 0.5 else (5.0 if x13 < 1.5 else 10.0))
    x17 = ((10.0 if x13 < 3.5 else 5.0) if x13 < 4.5 else 1.4285714285714286)
    x18 = x15*(x16 if x13 < 2.5 else x17)
    x19 = 1.0 - x18
    x20 = (0.7 if x13 < 0.5 else (0.19999999999999998 if x13 < 1.5 else 0.1))
    x21 = ((0.1 if x13 < 3.5 else 0.19999999999999998) if x13 < 4.5 else 0.7)
    x22 = (-(x19*(x15*x18)) if x13 < 5.5 else x15 - (x20 if x13 < 2.5 else x21))
    x23 = (826.5306122448981 if x13 < 0.5 else (2571.428571428572 if x13 < 1.5 else 4000.0))
    x24 = ((1285.714285714286 if x13 < 3.5 else 405.23837551500884) if x13 < 4.5 else 0.0)
    x25 = x18 + x18
    x26 = (0.0 if x13 < -0.5 else (x18*x18*(3.0 - x25) if x13 < 5.5 else 1.0))
    x27 = ((-900.0 if x13 < 0.5 else (-600.0 if x13 < 1.5 else 0.0)) if x13 < 2.5 else ((300.0 if x13 < 3.5 else 450.0) if x13 < 4.5 else 620.0))
    x28 = (1.0 if x13 < -0.5 else ((1.0 + x25)*(x19*x19) if x13 < 5.5 else 0.0))
    x29 = (-1250.0 if x13 < 0.5 else (-900.0 if x13 < 1.5 else -600.0))
    x30 = (x29 if x13 < 2.5 else ((0.0 if x13 < 3.5 else 300.0) if x13 < 4.5 else 450.0))
    x31 = (x15 if x13 < -0.5 else (x19*(x15*x19) if x13 < 5.5 else 0.0))
    x32 = (0.0 if x13 < 0.5 else (826.5306122448981 if x13 < 1.5 else 2571.428571428572))
    x33 = ((4000.0 if x13 < 3.5 else 1285.714285714286) if x13 < 4.5 else 405.23837551500884)
    x34 = (0.0 if x13 < -0.5 else x22)*(x23 if x13 < 2.5 else x24) + (x26*x27 + (x28*x30 + x31*(x32 if x13 < 2.5 else x33)))
    x35 = v_force + x34
    x36 = t - p_t_bump
    x37 = c0*x36
    x38 = (0.0 if x37 < 0.0 else (0.0 if 1.0 < x37 else c1*(1.0 - cos(x36*c2))))
    x39 = x35 + (x0 + p_k_tyre*(q_z_wheel - x38) + a_z_wheel*p_m_wheel)
    x40 = v_speed*p_c_sky
    x41 = (p_F_most if x40 + (p_F_most + 1e+300*b_3) < 0.0 else -x40)
    x42 = (x41 if -(1e+300*b_4 + (p_F_most + x41)) < 0.0 else c4) - v_force
    out[0] = a_z_body*p_m_body - x0 - x35
    out[1] = x39
    out[2] = a_force - c3*x42
    out[3] = a_speed - (c5*(x0 + x35) - v_speed*p_leak)


@njit(error_model="numpy")
def residual_jacobian(t, y, p, out):
    """Residual derivatives by q, v, a, lambda. 148 operations."""
    p_m_body = p[0]
    p_m_wheel = p[1]
    p_k_spring = p[2]
    p_k_tyre = p[3]
    p_c_sky = p[4]
    p_tau = p[5]
    p_leak = p[6]
    p_F_most = p[7]
    c0 = -p_k_spring
    c1 = p_k_spring + p_k_tyre
    c2 = 1.0/p_tau
    c3 = p_c_sky*c2
    c4 = 1.0/p_m_body
    c5 = p_k_spring*c4
    c6 = -c5
    c7 = -c4
    v_z_body = y[4]
    v_z_wheel = y[5]
    v_speed = y[7]
    b_0 = p[11]
    b_1 = p[12]
    b_2 = p[13]
    b_3 = p[14]
    b_4 = p[15]
    x0 = b_0*b_1
    x1 = b_2*x0
    x2 = v_z_wheel - v_z_body
    x3 = ((-1.0 if x2 < -0.3 else (-0.3 if x2 < -0.1 else -0.1)) if x2 < 0.0 else ((0.0 if x2 < 0.1 else 0.1) if x2 < 0.3 else 0.3))
    x4 = (1.4285714285714286 if x2 < -0.3 else (5.0 if x2 < -0.1 else 10.0))
    x5 = ((10.0 if x2 < 0.1 else 5.0) if x2 < 0.3 else 1.4285714285714286)
    x6 = ((0.0 if x2 < -0.3 else (1.0 if x2 < -0.1 else 2.0)) if x2 < 0.0 else ((3.0 if x2 < 0.1 else 4.0) if x2 < 0.3 else 5.0))
    x7 = (x2 - x3)*(x4 if x2 < 0.0 else x5) + x6
    x8 = (x7 if x7 < 6.5 else 6.5)
    x9 = (x8 if -0.5 < x8 else -0.5)
    x10 = 8.0*floor(0.0625*x1 + (0.125*x0 + (0.25*b_0 + 0.125*x9))) + (3.5 - 2.0*b_0)
    x11 = x10 - x0 - 0.5*x1
    x12 = (x11 if x1 < 0.0 else (x11 if -x1 < 0.0 else -8.0 + floor(8.0 + x9)))
    x13 = (826.5306122448981 if x12 < 0.5 else (2571.428571428572 if x12 < 1.5 else 4000.0))
    x14 = ((1285.714285714286 if x12 < 3.5 else 405.23837551500884) if x12 < 4.5 else 0.0)
    x15 = (0.0 if x12 < -0.5 else 1.0)
    x16 = (1.0 if x12 < 5.5 else 0.0)
    x17 = ((-1.0 if x12 < 0.5 else (-0.3 if x12 < 1.5 else -0.1)) if x12 < 2.5 else ((0.0 if x12 < 3.5 else 0.1) if x12 < 4.5 else 0.3))
    x18 = x2 - x17
    x19 = (1.4285714285714286 if x12 < 0.5 else (5.0 if x12 < 1.5 else 10.0))
    x20 = ((10.0 if x12 < 3.5 else 5.0) if x12 < 4.5 else 1.4285714285714286)
    x21 = (x19 if x12 < 2.5 else x20)
    x22 = x18*x21
    x23 = 1.0 - x22
    x24 = x22 + x22
    x25 = x15*((0.0 if x12 < 5.5 else 1.0) - x16*(x23*x24 - x21*(x18*x22)))
    x26 = ((-900.0 if x12 < 0.5 else (-600.0 if x12 < 1.5 else 0.0)) if x12 < 2.5 else ((300.0 if x12 < 3.5 else 450.0) if x12 < 4.5 else 620.0))
    x27 = x21 + x21
    x28 = (0.0 if x12 < 0.5 else (826.5306122448981 if x12 < 1.5 else 2571.428571428572))
    x29 = ((4000.0 if x12 < 3.5 else 1285.714285714286) if x12 < 4.5 else 405.23837551500884)
    x30 = (1.0 if x12 < -0.5 else 0.0) + x15*(x16*(x23*(x23 - x22) - x21*(x18*x23)))
    x31 = (-1250.0 if x12 < 0.5 else (-900.0 if x12 < 1.5 else -600.0))
    x32 = (x31 if x12 < 2.5 else ((0.0 if x12 < 3.5 else 300.0) if x12 < 4.5 else 450.0))
    x33 = (x28 if x12 < 2.5 else x29)*x30 + x32*(x15*(x16*(x23*x23*x27 - 2.0*((1.0 + x24)*(x21*x23)))))
    x34 = x26*(x15*(x16*(2.0*((3.0 - x24)*(x21*x22)) - x22*x22*x27))) + x33
    x35 = (x13 if x12 < 2.5 else x14)*x25 + x34
    x36 = -x35
    x37 = v_speed*p_c_sky
    x38 = x37 + (p_F_most + 1e+300*b_3)
    x39 = -(1e+300*b_4 + (p_F_most + (p_F_most if x38 < 0.0 else -x37)))
    x40 = c4*x35
    out[0] = p_k_spring
    out[1] = c0
    out[4] = x35
    out[5] = x36
    out[6] = -1.0
    out[8] = p_m_body
    out[12] = c0
    out[13] = c1
    out[16] = x36
    out[17] = x35
    out[18] = 1.0
    out[21] = p_m_wheel
    out[30] = c2
    out[31] = (0.0 if x38 < 0.0 else 1.0)*(1.0 if x39 < 0.0 else 0.0)*c3
    out[34] = 1.0
    out[36] = c5
    out[37] = c6
    out[40] = x40
    out[41] = -x40
    out[42] = c7
    out[43] = p_leak
    out[47] = 1.0


@njit(error_model="numpy")
def poses(t, y, p, out):
    """Per body: position, rotation matrix (body to world). 14 operations."""
    p_bump = p[8]
    p_t_bump = p[9]
    p_t_width = p[10]
    c0 = 1.0/p_t_width
    c1 = 0.5*p_bump
    c2 = 6.283185307179586*c0
    q_z_body = y[0]
    q_z_wheel = y[1]
    x0 = t - p_t_bump
    x1 = c0*x0
    x2 = (0.0 if x1 < 0.0 else (0.0 if 1.0 < x1 else c1*(1.0 - cos(x0*c2))))
    out[0] = 0.0
    out[1] = 1.0 + q_z_body
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
    out[13] = q_z_wheel + 0.3
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
    out[24] = 0.0
    out[25] = -0.02 + x2
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
    out[0] = 0.9
    out[1] = 0.35
    out[2] = 0.6
    out[3] = 0.28
    out[4] = 0.5
    out[5] = 0.04
    out[6] = 0.6


@njit(error_model="numpy")
def outputs(t, y, p, out):
    """Outputs. 127 operations."""
    p_m_body = p[0]
    p_k_spring = p[2]
    p_bump = p[8]
    p_t_bump = p[9]
    p_t_width = p[10]
    c0 = 1.0/p_t_width
    c1 = 0.5*p_bump
    c2 = 6.283185307179586*c0
    c3 = 1.0/p_m_body
    q_z_body = y[0]
    q_z_wheel = y[1]
    v_z_body = y[4]
    v_z_wheel = y[5]
    v_force = y[6]
    b_0 = p[11]
    b_1 = p[12]
    b_2 = p[13]
    x0 = t - p_t_bump
    x1 = c0*x0
    x2 = (0.0 if x1 < 0.0 else (0.0 if 1.0 < x1 else c1*(1.0 - cos(x0*c2))))
    x3 = b_0*b_1
    x4 = b_2*x3
    x5 = v_z_wheel - v_z_body
    x6 = ((-1.0 if x5 < -0.3 else (-0.3 if x5 < -0.1 else -0.1)) if x5 < 0.0 else ((0.0 if x5 < 0.1 else 0.1) if x5 < 0.3 else 0.3))
    x7 = (1.4285714285714286 if x5 < -0.3 else (5.0 if x5 < -0.1 else 10.0))
    x8 = ((10.0 if x5 < 0.1 else 5.0) if x5 < 0.3 else 1.4285714285714286)
    x9 = ((0.0 if x5 < -0.3 else (1.0 if x5 < -0.1 else 2.0)) if x5 < 0.0 else ((3.0 if x5 < 0.1 else 4.0) if x5 < 0.3 else 5.0))
    x10 = (x5 - x6)*(x7 if x5 < 0.0 else x8) + x9
    x11 = (x10 if x10 < 6.5 else 6.5)
    x12 = (x11 if -0.5 < x11 else -0.5)
    x13 = 8.0*floor(0.0625*x4 + (0.125*x3 + (0.25*b_0 + 0.125*x12))) + (3.5 - 2.0*b_0)
    x14 = x13 - x3 - 0.5*x4
    x15 = (x14 if x4 < 0.0 else (x14 if -x4 < 0.0 else -8.0 + floor(8.0 + x12)))
    x16 = ((-1.0 if x15 < 0.5 else (-0.3 if x15 < 1.5 else -0.1)) if x15 < 2.5 else ((0.0 if x15 < 3.5 else 0.1) if x15 < 4.5 else 0.3))
    x17 = x5 - x16
    x18 = (1.4285714285714286 if x15 < 0.5 else (5.0 if x15 < 1.5 else 10.0))
    x19 = ((10.0 if x15 < 3.5 else 5.0) if x15 < 4.5 else 1.4285714285714286)
    x20 = x17*(x18 if x15 < 2.5 else x19)
    x21 = 1.0 - x20
    x22 = (0.7 if x15 < 0.5 else (0.19999999999999998 if x15 < 1.5 else 0.1))
    x23 = ((0.1 if x15 < 3.5 else 0.19999999999999998) if x15 < 4.5 else 0.7)
    x24 = (-(x21*(x17*x20)) if x15 < 5.5 else x17 - (x22 if x15 < 2.5 else x23))
    x25 = (826.5306122448981 if x15 < 0.5 else (2571.428571428572 if x15 < 1.5 else 4000.0))
    x26 = ((1285.714285714286 if x15 < 3.5 else 405.23837551500884) if x15 < 4.5 else 0.0)
    x27 = x20 + x20
    x28 = (0.0 if x15 < -0.5 else (x20*x20*(3.0 - x27) if x15 < 5.5 else 1.0))
    x29 = ((-900.0 if x15 < 0.5 else (-600.0 if x15 < 1.5 else 0.0)) if x15 < 2.5 else ((300.0 if x15 < 3.5 else 450.0) if x15 < 4.5 else 620.0))
    x30 = (1.0 if x15 < -0.5 else ((1.0 + x27)*(x21*x21) if x15 < 5.5 else 0.0))
    x31 = (-1250.0 if x15 < 0.5 else (-900.0 if x15 < 1.5 else -600.0))
    x32 = (x31 if x15 < 2.5 else ((0.0 if x15 < 3.5 else 300.0) if x15 < 4.5 else 450.0))
    x33 = (x17 if x15 < -0.5 else (x21*(x17*x21) if x15 < 5.5 else 0.0))
    x34 = (0.0 if x15 < 0.5 else (826.5306122448981 if x15 < 1.5 else 2571.428571428572))
    x35 = ((4000.0 if x15 < 3.5 else 1285.714285714286) if x15 < 4.5 else 405.23837551500884)
    x36 = (0.0 if x15 < -0.5 else x24)*(x25 if x15 < 2.5 else x26) + (x28*x29 + (x30*x32 + x33*(x34 if x15 < 2.5 else x35)))
    out[0] = x2
    out[1] = c3*(p_k_spring*(q_z_wheel - q_z_body) + (v_force + x36))
    out[2] = x36


@njit(error_model="numpy")
def events(t, y, p, out):
    """Event functions. 62 operations."""
    p_c_sky = p[4]
    p_F_most = p[7]
    v_z_body = y[4]
    v_z_wheel = y[5]
    v_speed = y[7]
    x0 = v_z_wheel - v_z_body
    x1 = ((-1.0 if x0 < -0.3 else (-0.3 if x0 < -0.1 else -0.1)) if x0 < 0.0 else ((0.0 if x0 < 0.1 else 0.1) if x0 < 0.3 else 0.3))
    x2 = (1.4285714285714286 if x0 < -0.3 else (5.0 if x0 < -0.1 else 10.0))
    x3 = ((10.0 if x0 < 0.1 else 5.0) if x0 < 0.3 else 1.4285714285714286)
    x4 = ((0.0 if x0 < -0.3 else (1.0 if x0 < -0.1 else 2.0)) if x0 < 0.0 else ((3.0 if x0 < 0.1 else 4.0) if x0 < 0.3 else 5.0))
    x5 = (x0 - x1)*(x2 if x0 < 0.0 else x3) + x4
    x6 = (x5 if x5 < 6.5 else 6.5)
    x7 = (x6 if -0.5 < x6 else -0.5)
    x8 = 0.25*x7
    x9 = 0.125*x7
    x10 = floor(x9)
    x11 = floor(0.25 + x9)
    x12 = floor(0.25 + x8)
    x13 = (-1.0 + fabs(-0.5 + 0.5*x7 - 2.0*x12))*(2.0*x7 + (-2.0 - 8.0*x12))
    x14 = v_speed*p_c_sky
    x15 = -x14
    out[0] = (-1.0 + fabs(x8 + (-1.0 - 2.0*x10)))*(x7 + -4.0 - 8.0*x10)
    out[1] = (-1.0 + fabs(x8 + (-0.5 - 2.0*x11)))*(-2.0 + x7 - 8.0*x11)
    out[2] = x13
    out[3] = p_F_most + x14
    out[4] = p_F_most + (x15 if x15 < p_F_most else p_F_most)


@njit(error_model="numpy")
def marks(t, y, p, out):
    """What a picture shows besides bodies, as `marks` lists it. 2 operations."""
    q_z_body = y[0]
    q_z_wheel = y[1]
    v_force = y[6]
    x0 = q_z_wheel + 0.3
    x1 = 1.0 + q_z_body
    out[0] = -0.15
    out[1] = x0
    out[3] = -0.15
    out[4] = x1
    out[6] = 0.06
    out[7] = x0
    out[9] = 0.06
    out[10] = x1
    out[12] = 0.25
    out[13] = x1
    out[16] = v_force


@njit(error_model="numpy")
def limits(t, y, p, out):
    """Numbers of parameters that have a bound. 0 operations."""
    p_m_body = p[0]
    p_m_wheel = p[1]
    out[0] = p_m_body
    out[1] = p_m_wheel


@njit(error_model="numpy")
def time_terms(t, y, p, out):
    """What the equations have of time alone, beyond polynomials. 11 operations."""
    p_bump = p[8]
    p_t_bump = p[9]
    p_t_width = p[10]
    c0 = 1.0/p_t_width
    c1 = 0.5*p_bump
    c2 = 6.283185307179586*c0
    x0 = t - p_t_bump
    x1 = c0*x0
    x2 = (0.0 if x1 < 0.0 else (0.0 if 1.0 < x1 else c1*(1.0 - cos(x0*c2))))
    out[0] = x2
