"""rough_road: equations of motion, written by symgen 0.1.0. Do not edit.

Quarter of a car on a rough road: body on spring and damper, wheel on its tyre, road a sum of sines
"""

from math import cos, sin

from numba import njit

MODEL = {
    "abi": 1,
    "generator": "symgen 0.1.0",
    "source": "sha256:eecb0e199f519f05d5a53d09fc338a5ba62e75f9206bc49ae3f7720d5b78ed46",
    "name": "rough_road",
    "description": "Quarter of a car on a rough road: body on spring and damper, wheel on its tyre, road a sum of sines",
    "nq": 2,
    "nv": 2,
    "nh": 0,
    "nn": 0,
    "nw": 1,
    "coordinates": [
        {"name": "z_body", "unit": "m", "value": 0.0, "enforced": True},
        {"name": "z_wheel", "unit": "m", "value": 0.0, "enforced": True},
    ],
    "quaternions": [],
    "rates": [
        {"name": "z_body", "unit": "m/s", "value": 0.0, "enforced": True},
        {"name": "z_wheel", "unit": "m/s", "value": 0.0, "enforced": True},
    ],
    "parameters": [
        {"name": "m_body", "unit": "kg", "value": 300.0, "doc": ""},
        {"name": "m_wheel", "unit": "kg", "value": 40.0, "doc": ""},
        {"name": "k_spring", "unit": "N/m", "value": 20000.0, "doc": "stiffness of the suspension"},
        {"name": "c_damper", "unit": "N*s/m", "value": 1500.0, "doc": "its damping"},
        {"name": "k_tyre", "unit": "N/m", "value": 200000.0, "doc": "radial stiffness of the tyre"},
        {"name": "c_tyre", "unit": "N*s/m", "value": 100.0, "doc": "its damping"},
        {"name": "speed", "unit": "m/s", "value": 20.0, "doc": "of the car"},
        {"name": "wave", "unit": "rad/m", "value": 0.314, "doc": "wave number of the longest wave, 20 m"},
        {"name": "rough", "unit": "m", "value": 0.01, "doc": "its amplitude; the others are in proportion to their length"},
    ],
    "inputs": [],
    "constants": [
        {"name": "body_height", "unit": "m", "value": 0.9},
        {"name": "wheel_height", "unit": "m", "value": 0.3},
        {"name": "road_thickness", "unit": "m", "value": 0.04},
    ],
    "constraints": [],
    "outputs": [
        {"name": "road_height", "unit": "m"},
        {"name": "tyre_load_change", "unit": "N"},
    ],
    "events": [],
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
        "rhs": 103,
        "mass_matrix": 0,
        "forces": 90,
        "energy": 62,
        "residual": 92,
        "residual_jacobian": 4,
        "poses": 49,
        "shapes": 0,
        "outputs": 82,
        "marks": 2,
        "limits": 0,
        "time_terms": 39,
    },
    "hoisted": {
        "rhs": 17,
        "forces": 14,
        "energy": 12,
        "residual": 14,
        "residual_jacobian": 4,
        "poses": 8,
        "outputs": 14,
        "time_terms": 8,
    },
    "run": {
        "t_end": 10.0,
        "fps": 60.0,
    },
    "limits": [
        {"name": "bodies.body.mass", "bound": "zero or more"},
        {"name": "bodies.wheel.mass", "bound": "zero or more"},
    ],
    "subsystems": [],
    "marks": [
        {"kind": "spring", "name": "spring", "body": "", "numbers": 6, "moves": True},
        {"kind": "damper", "name": "damper", "body": "", "numbers": 6, "moves": True},
    ],
    "time_terms": 16,
}

@njit(error_model="numpy")
def rhs(t, y, p, out):
    """State derivative: rates, accelerations, power. 103 operations."""
    p_m_body = p[0]
    p_m_wheel = p[1]
    p_k_spring = p[2]
    p_c_damper = p[3]
    p_k_tyre = p[4]
    p_c_tyre = p[5]
    p_speed = p[6]
    p_wave = p[7]
    p_rough = p[8]
    c0 = 1.0/p_m_body
    c1 = 1.0/p_m_wheel
    c2 = p_speed*p_wave
    c3 = 1.45*c2
    c4 = 1.0005*c2
    c5 = 2.1*c2
    c6 = 1.008*c2
    c7 = 3.04*c2
    c8 = 1.0032*c2
    c9 = 4.39*c2
    c10 = 1.0097*c2
    c11 = 9.24*c2
    c12 = 1.0164*c2
    c13 = 10.0*c2
    c14 = 6.37*c2
    c15 = 1.0192*c2
    c16 = 0.5*p_k_tyre
    q_z_body = y[0]
    q_z_wheel = y[1]
    v_z_body = y[2]
    v_z_wheel = y[3]
    x0 = p_c_damper*(v_z_body - v_z_wheel)
    x1 = p_k_spring*(q_z_body - q_z_wheel)
    x2 = t*c2
    x3 = 1.3 + t*c3
    x4 = 4.1 + t*c5
    x5 = 2.2 + t*c7
    x6 = 5.6 + t*c9
    x7 = 3.4 + t*c11
    x8 = 2.9 + t*c13
    x9 = 0.7 + t*c14
    x10 = c2*cos(x2) + (cos(x3)*c4 + (cos(x4)*c6 + cos(x5)*c8)) + (cos(x6)*c10 + (cos(x7)*c12 + (c2*cos(x8) + cos(x9)*c15)))
    x11 = p_rough*x10
    x12 = p_c_tyre*(v_z_wheel - x11) - x0
    x13 = sin(x2) + (0.69*sin(x3) + (0.48*sin(x4) + 0.33*sin(x5))) + (0.23*sin(x6) + (0.11*sin(x7) + (0.1*sin(x8) + 0.16*sin(x9))))
    x14 = q_z_wheel - p_rough*x13
    out[0] = v_z_body
    out[1] = v_z_wheel
    out[2] = -(c0*(x0 + x1))
    out[3] = -(c1*(x12 + (p_k_tyre*x14 - x1)))
    out[4] = -(v_z_body*x0 + v_z_wheel*x12 + c16*(x11*(2.0*x14)))


@njit(error_model="numpy")
def mass_matrix(t, y, p, out):
    """Mass matrix M, row by row. 0 operations."""
    p_m_body = p[0]
    p_m_wheel = p[1]
    out[0] = p_m_body
    out[3] = p_m_wheel


@njit(error_model="numpy")
def forces(t, y, p, out):
    """Forces f of M a = f + G^T lambda. 90 operations."""
    p_k_spring = p[2]
    p_c_damper = p[3]
    p_k_tyre = p[4]
    p_c_tyre = p[5]
    p_speed = p[6]
    p_wave = p[7]
    p_rough = p[8]
    c0 = p_speed*p_wave
    c1 = 1.45*c0
    c2 = 1.0005*c0
    c3 = 2.1*c0
    c4 = 1.008*c0
    c5 = 3.04*c0
    c6 = 1.0032*c0
    c7 = 4.39*c0
    c8 = 1.0097*c0
    c9 = 9.24*c0
    c10 = 1.0164*c0
    c11 = 10.0*c0
    c12 = 6.37*c0
    c13 = 1.0192*c0
    q_z_body = y[0]
    q_z_wheel = y[1]
    v_z_body = y[2]
    v_z_wheel = y[3]
    x0 = p_c_damper*(v_z_body - v_z_wheel)
    x1 = p_k_spring*(q_z_body - q_z_wheel)
    x2 = t*c0
    x3 = 1.3 + t*c1
    x4 = 4.1 + t*c3
    x5 = 2.2 + t*c5
    x6 = 5.6 + t*c7
    x7 = 3.4 + t*c9
    x8 = 2.9 + t*c11
    x9 = 0.7 + t*c12
    x10 = c0*cos(x2) + (cos(x3)*c2 + (cos(x4)*c4 + cos(x5)*c6)) + (cos(x6)*c8 + (cos(x7)*c10 + (c0*cos(x8) + cos(x9)*c13)))
    x11 = sin(x2) + (0.69*sin(x3) + (0.48*sin(x4) + 0.33*sin(x5))) + (0.23*sin(x6) + (0.11*sin(x7) + (0.1*sin(x8) + 0.16*sin(x9))))
    x12 = p_c_tyre*(v_z_wheel - p_rough*x10) - x0 + (p_k_tyre*(q_z_wheel - p_rough*x11) - x1)
    out[0] = -(x0 + x1)
    out[1] = -x12


@njit(error_model="numpy")
def energy(t, y, p, out):
    """Kinetic and potential energy. 62 operations."""
    p_m_body = p[0]
    p_m_wheel = p[1]
    p_k_spring = p[2]
    p_k_tyre = p[4]
    p_speed = p[6]
    p_wave = p[7]
    p_rough = p[8]
    c0 = 0.5*p_m_body
    c1 = 0.5*p_m_wheel
    c2 = 0.5*p_k_spring
    c3 = 0.5*p_k_tyre
    c4 = p_speed*p_wave
    c5 = 1.45*c4
    c6 = 2.1*c4
    c7 = 3.04*c4
    c8 = 4.39*c4
    c9 = 9.24*c4
    c10 = 10.0*c4
    c11 = 6.37*c4
    q_z_body = y[0]
    q_z_wheel = y[1]
    v_z_body = y[2]
    v_z_wheel = y[3]
    x0 = q_z_body - q_z_wheel
    x1 = 0.69*sin(1.3 + t*c5) + (0.48*sin(4.1 + t*c6) + 0.33*sin(2.2 + t*c7))
    x2 = 0.11*sin(3.4 + t*c9) + (0.1*sin(2.9 + t*c10) + 0.16*sin(0.7 + t*c11))
    x3 = q_z_wheel - p_rough*(sin(t*c4) + x1 + (0.23*sin(5.6 + t*c8) + x2))
    out[0] = c0*(v_z_body*v_z_body) + c1*(v_z_wheel*v_z_wheel)
    out[1] = x0*x0*c2 + c3*(x3*x3)


@njit(error_model="numpy")
def residual(t, y, p, out):
    """M a - f - G^T lambda, then G a - gamma. 92 operations."""
    p_m_body = p[0]
    p_m_wheel = p[1]
    p_k_spring = p[2]
    p_c_damper = p[3]
    p_k_tyre = p[4]
    p_c_tyre = p[5]
    p_speed = p[6]
    p_wave = p[7]
    p_rough = p[8]
    c0 = p_speed*p_wave
    c1 = 1.45*c0
    c2 = 2.1*c0
    c3 = 3.04*c0
    c4 = 4.39*c0
    c5 = 9.24*c0
    c6 = 10.0*c0
    c7 = 6.37*c0
    c8 = 1.0005*c0
    c9 = 1.008*c0
    c10 = 1.0032*c0
    c11 = 1.0097*c0
    c12 = 1.0164*c0
    c13 = 1.0192*c0
    q_z_body = y[0]
    q_z_wheel = y[1]
    v_z_body = y[2]
    v_z_wheel = y[3]
    a_z_body = y[4]
    a_z_wheel = y[5]
    x0 = p_k_spring*(q_z_body - q_z_wheel)
    x1 = p_c_damper*(v_z_body - v_z_wheel)
    x2 = t*c0
    x3 = 1.3 + t*c1
    x4 = 4.1 + t*c2
    x5 = 2.2 + t*c3
    x6 = 5.6 + t*c4
    x7 = 3.4 + t*c5
    x8 = 2.9 + t*c6
    x9 = 0.7 + t*c7
    x10 = sin(x2) + (0.69*sin(x3) + (0.48*sin(x4) + 0.33*sin(x5))) + (0.23*sin(x6) + (0.11*sin(x7) + (0.1*sin(x8) + 0.16*sin(x9))))
    x11 = c0*cos(x2) + (cos(x3)*c8 + (cos(x4)*c9 + cos(x5)*c10)) + (cos(x6)*c11 + (cos(x7)*c12 + (c0*cos(x8) + cos(x9)*c13)))
    x12 = p_c_tyre*(v_z_wheel - p_rough*x11) + a_z_wheel*p_m_wheel - x1
    out[0] = x0 + (x1 + a_z_body*p_m_body)
    out[1] = p_k_tyre*(q_z_wheel - p_rough*x10) - x0 + x12


@njit(error_model="numpy")
def residual_jacobian(t, y, p, out):
    """Residual derivatives by q, v, a, lambda. 4 operations."""
    p_m_body = p[0]
    p_m_wheel = p[1]
    p_k_spring = p[2]
    p_c_damper = p[3]
    p_k_tyre = p[4]
    p_c_tyre = p[5]
    c0 = -p_k_spring
    c1 = -p_c_damper
    c2 = p_k_spring + p_k_tyre
    c3 = p_c_damper + p_c_tyre
    out[0] = p_k_spring
    out[1] = c0
    out[2] = p_c_damper
    out[3] = c1
    out[4] = p_m_body
    out[6] = c0
    out[7] = c2
    out[8] = c1
    out[9] = c3
    out[11] = p_m_wheel


@njit(error_model="numpy")
def poses(t, y, p, out):
    """Per body: position, rotation matrix (body to world). 49 operations."""
    p_speed = p[6]
    p_wave = p[7]
    p_rough = p[8]
    c0 = p_speed*p_wave
    c1 = 1.45*c0
    c2 = 2.1*c0
    c3 = 3.04*c0
    c4 = 4.39*c0
    c5 = 9.24*c0
    c6 = 10.0*c0
    c7 = 6.37*c0
    q_z_body = y[0]
    q_z_wheel = y[1]
    x0 = 0.69*sin(1.3 + t*c1) + (0.48*sin(4.1 + t*c2) + 0.33*sin(2.2 + t*c3))
    x1 = 0.11*sin(3.4 + t*c5) + (0.1*sin(2.9 + t*c6) + 0.16*sin(0.7 + t*c7))
    x2 = -0.02 + p_rough*(sin(t*c0) + x0 + (0.23*sin(5.6 + t*c4) + x1))
    out[0] = 0.0
    out[1] = q_z_body + 0.9
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
    out[25] = x2
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
    """Outputs. 82 operations."""
    p_k_tyre = p[4]
    p_c_tyre = p[5]
    p_speed = p[6]
    p_wave = p[7]
    p_rough = p[8]
    c0 = p_speed*p_wave
    c1 = 1.45*c0
    c2 = 2.1*c0
    c3 = 3.04*c0
    c4 = 4.39*c0
    c5 = 9.24*c0
    c6 = 10.0*c0
    c7 = 6.37*c0
    c8 = 1.0005*c0
    c9 = 1.008*c0
    c10 = 1.0032*c0
    c11 = 1.0097*c0
    c12 = 1.0164*c0
    c13 = 1.0192*c0
    q_z_wheel = y[1]
    v_z_wheel = y[3]
    x0 = t*c0
    x1 = 1.3 + t*c1
    x2 = 4.1 + t*c2
    x3 = 2.2 + t*c3
    x4 = 5.6 + t*c4
    x5 = 3.4 + t*c5
    x6 = 2.9 + t*c6
    x7 = 0.7 + t*c7
    x8 = sin(x0) + (0.69*sin(x1) + (0.48*sin(x2) + 0.33*sin(x3))) + (0.23*sin(x4) + (0.11*sin(x5) + (0.1*sin(x6) + 0.16*sin(x7))))
    x9 = p_rough*x8
    x10 = c0*cos(x0) + (cos(x1)*c8 + (cos(x2)*c9 + cos(x3)*c10)) + (cos(x4)*c11 + (cos(x5)*c12 + (c0*cos(x6) + cos(x7)*c13)))
    x11 = p_c_tyre*(v_z_wheel - p_rough*x10) + p_k_tyre*(q_z_wheel - x9)
    out[0] = x9
    out[1] = -x11


@njit(error_model="numpy")
def marks(t, y, p, out):
    """What a picture shows besides bodies, as `marks` lists it. 2 operations."""
    q_z_body = y[0]
    q_z_wheel = y[1]
    x0 = q_z_wheel + 0.3
    x1 = q_z_body + 0.9
    out[0] = -0.08
    out[1] = x0
    out[3] = -0.08
    out[4] = x1
    out[6] = 0.08
    out[7] = x0
    out[9] = 0.08
    out[10] = x1


@njit(error_model="numpy")
def limits(t, y, p, out):
    """Numbers of parameters that have a bound. 0 operations."""
    p_m_body = p[0]
    p_m_wheel = p[1]
    out[0] = p_m_body
    out[1] = p_m_wheel


@njit(error_model="numpy")
def time_terms(t, y, p, out):
    """What the equations have of time alone, beyond polynomials. 39 operations."""
    p_speed = p[6]
    p_wave = p[7]
    c0 = p_speed*p_wave
    c1 = 2.1*c0
    c2 = 3.04*c0
    c3 = 1.45*c0
    c4 = 10.0*c0
    c5 = 6.37*c0
    c6 = 9.24*c0
    c7 = 4.39*c0
    x0 = 4.1 + t*c1
    x1 = 2.2 + t*c2
    x2 = 1.3 + t*c3
    x3 = t*c0
    x4 = 2.9 + t*c4
    x5 = 0.7 + t*c5
    x6 = 3.4 + t*c6
    x7 = 5.6 + t*c7
    out[0] = sin(x0)
    out[1] = sin(x1)
    out[2] = sin(x2)
    out[3] = sin(x3)
    out[4] = sin(x4)
    out[5] = sin(x5)
    out[6] = sin(x6)
    out[7] = sin(x7)
    out[8] = cos(x0)
    out[9] = cos(x1)
    out[10] = cos(x2)
    out[11] = cos(x3)
    out[12] = cos(x4)
    out[13] = cos(x5)
    out[14] = cos(x6)
    out[15] = cos(x7)
