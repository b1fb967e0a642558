"""quarter_car: equations of motion, written by symgen 0.1.0. Do not edit.

Quarter of a car over a bump: body, strut on a stiff rubber mount, wheel on a stiff tyre
"""

from math import cos, exp, sin

from numba import njit

MODEL = {
    "abi": 1,
    "generator": "symgen 0.1.0",
    "source": "sha256:9bcee1429e106f27a04560e51e747f0315772ab322023e48d9638d43bfe0522a",
    "name": "quarter_car",
    "description": "Quarter of a car over a bump: body, strut on a stiff rubber mount, wheel on a stiff tyre",
    "nq": 3,
    "nv": 3,
    "nh": 0,
    "nn": 0,
    "nw": 1,
    "coordinates": [
        {"name": "z_body", "unit": "m", "value": 0.0, "enforced": True},
        {"name": "z_mount", "unit": "m", "value": 0.0, "enforced": True},
        {"name": "z_wheel", "unit": "m", "value": 0.0, "enforced": True},
    ],
    "rates": [
        {"name": "z_body", "unit": "m/s", "value": 0.0, "enforced": True},
        {"name": "z_mount", "unit": "m/s", "value": 0.0, "enforced": True},
        {"name": "z_wheel", "unit": "m/s", "value": 0.0, "enforced": True},
    ],
    "parameters": [
        {"name": "m_body", "unit": "kg", "value": 300.0, "doc": ""},
        {"name": "m_mount", "unit": "kg", "value": 1.0, "doc": "top of the strut, between the damper and its rubber bushing"},
        {"name": "m_wheel", "unit": "kg", "value": 40.0, "doc": ""},
        {"name": "k_spring", "unit": "N/m", "value": 20000.0, "doc": ""},
        {"name": "k_bushing", "unit": "N/m", "value": 20000000.0, "doc": "rubber bushing between strut and body"},
        {"name": "c_bushing", "unit": "N*s/m", "value": 2000.0, "doc": ""},
        {"name": "c_damper", "unit": "N*s/m", "value": 1500.0, "doc": ""},
        {"name": "k_tyre", "unit": "N/m", "value": 200000.0, "doc": "radial stiffness of the tyre"},
        {"name": "c_tyre", "unit": "N*s/m", "value": 100.0, "doc": ""},
        {"name": "bump", "unit": "m", "value": 0.08, "doc": "height of the bump"},
        {"name": "t_bump", "unit": "s", "value": 1.0, "doc": "when the wheel is on top of it"},
        {"name": "t_width", "unit": "s", "value": 0.05, "doc": "how long it takes, to 1/e of its height"},
        {"name": "wave", "unit": "m", "value": 0.01, "doc": "amplitude of the wavy road"},
        {"name": "wave_rate", "unit": "rad/s", "value": 9.0, "doc": "how fast the waves pass"},
    ],
    "inputs": [],
    "constants": [
        {"name": "body_height", "unit": "m", "value": 1.05},
        {"name": "mount_height", "unit": "m", "value": 0.82},
        {"name": "wheel_height", "unit": "m", "value": 0.3},
        {"name": "road_thickness", "unit": "m", "value": 0.04},
    ],
    "constraints": [],
    "outputs": [
        {"name": "road_height", "unit": ""},
        {"name": "tyre_load_change", "unit": ""},
    ],
    "events": [],
    "bodies": [
        {"name": "body", "planar": True, "shape": "box", "sizes": 3, "mesh": ""},
        {"name": "mount", "planar": True, "shape": "box", "sizes": 3, "mesh": ""},
        {"name": "wheel", "planar": True, "shape": "sphere", "sizes": 1, "mesh": ""},
        {"name": "strut", "planar": True, "shape": "cylinder", "sizes": 2, "mesh": ""},
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
        "rhs": 68,
        "mass_matrix": 0,
        "forces": 53,
        "energy": 35,
        "residual": 56,
        "residual_jacobian": 8,
        "poses": 18,
        "shapes": 3,
        "outputs": 25,
    },
    "run": {
        "t_end": 5.0,
        "fps": 60.0,
    },
}

@njit(error_model="numpy")
def rhs(t, y, p, out):
    """State derivative: rates, accelerations, power. 68 operations."""
    q_z_body = y[0]
    q_z_mount = y[1]
    q_z_wheel = y[2]
    v_z_body = y[3]
    v_z_mount = y[4]
    v_z_wheel = y[5]
    p_m_body = p[0]
    p_m_mount = p[1]
    p_m_wheel = p[2]
    p_k_spring = p[3]
    p_k_bushing = p[4]
    p_c_bushing = p[5]
    p_c_damper = p[6]
    p_k_tyre = p[7]
    p_c_tyre = p[8]
    p_bump = p[9]
    p_t_bump = p[10]
    p_t_width = p[11]
    p_wave = p[12]
    p_wave_rate = p[13]
    x0 = 0.5*p_c_bushing*(2.0*(v_z_body - v_z_mount))
    x1 = 0.5*p_k_spring*(2.0*(q_z_body - q_z_wheel))
    x2 = 0.5*p_k_bushing*(2.0*(q_z_body - q_z_mount))
    x3 = 0.5*p_c_damper*(2.0*(v_z_mount - v_z_wheel))
    x4 = x3 - x0
    x5 = t*p_wave_rate
    x6 = (t - p_t_bump)/p_t_width
    x7 = exp(-(x6*x6))
    x8 = p_wave*(p_wave_rate*cos(x5)) - p_bump*(x7*(1.0/p_t_width*(2.0*x6)))
    x9 = 0.5*p_c_tyre*(2.0*(v_z_wheel - x8)) - x3
    x10 = 0.5*p_k_tyre
    x11 = 2.0*(q_z_wheel - (p_bump*x7 + p_wave*sin(x5)))
    out[0] = v_z_body
    out[1] = v_z_mount
    out[2] = v_z_wheel
    out[3] = -((x0 + (x1 + x2))*(1.0/p_m_body))
    out[4] = -((x4 - x2)*(1.0/p_m_mount))
    out[5] = -((x9 + (x10*x11 - x1))*(1.0/p_m_wheel))
    out[6] = -(v_z_body*x0 + v_z_mount*x4 + v_z_wheel*x9 + x10*(x8*x11))


@njit(error_model="numpy")
def mass_matrix(t, y, p, out):
    """Mass matrix M, row by row. 0 operations."""
    p_m_body = p[0]
    p_m_mount = p[1]
    p_m_wheel = p[2]
    out[0] = p_m_body
    out[4] = p_m_mount
    out[8] = p_m_wheel


@njit(error_model="numpy")
def forces(t, y, p, out):
    """Forces f of M a = f + G^T lambda. 53 operations."""
    q_z_body = y[0]
    q_z_mount = y[1]
    q_z_wheel = y[2]
    v_z_body = y[3]
    v_z_mount = y[4]
    v_z_wheel = y[5]
    p_k_spring = p[3]
    p_k_bushing = p[4]
    p_c_bushing = p[5]
    p_c_damper = p[6]
    p_k_tyre = p[7]
    p_c_tyre = p[8]
    p_bump = p[9]
    p_t_bump = p[10]
    p_t_width = p[11]
    p_wave = p[12]
    p_wave_rate = p[13]
    x0 = 0.5*p_c_bushing*(2.0*(v_z_body - v_z_mount))
    x1 = 0.5*p_k_spring*(2.0*(q_z_body - q_z_wheel))
    x2 = 0.5*p_k_bushing*(2.0*(q_z_body - q_z_mount))
    x3 = 0.5*p_c_damper*(2.0*(v_z_mount - v_z_wheel))
    x4 = t*p_wave_rate
    x5 = (t - p_t_bump)/p_t_width
    x6 = exp(-(x5*x5))
    x7 = p_wave*(p_wave_rate*cos(x4)) - p_bump*(x6*(1.0/p_t_width*(2.0*x5)))
    x8 = 0.5*p_k_tyre*(2.0*(q_z_wheel - (p_bump*x6 + p_wave*sin(x4))))
    out[0] = -(x0 + (x1 + x2))
    out[1] = -(x3 - x0 - x2)
    out[2] = -(0.5*p_c_tyre*(2.0*(v_z_wheel - x7)) - x3 + (x8 - x1))


@njit(error_model="numpy")
def energy(t, y, p, out):
    """Kinetic and potential energy. 35 operations."""
    q_z_body = y[0]
    q_z_mount = y[1]
    q_z_wheel = y[2]
    v_z_body = y[3]
    v_z_mount = y[4]
    v_z_wheel = y[5]
    p_m_body = p[0]
    p_m_mount = p[1]
    p_m_wheel = p[2]
    p_k_spring = p[3]
    p_k_bushing = p[4]
    p_k_tyre = p[7]
    p_bump = p[9]
    p_t_bump = p[10]
    p_t_width = p[11]
    p_wave = p[12]
    p_wave_rate = p[13]
    x0 = 0.5*p_m_body*(v_z_body*v_z_body) + 0.5*p_m_mount*(v_z_mount*v_z_mount)
    x1 = (t - p_t_bump)/p_t_width
    x2 = q_z_wheel - (p_bump*exp(-(x1*x1)) + p_wave*sin(t*p_wave_rate))
    x3 = q_z_body - q_z_mount
    x4 = q_z_body - q_z_wheel
    x5 = x2*x2*(0.5*p_k_tyre) + (x3*x3*(0.5*p_k_bushing) + x4*x4*(0.5*p_k_spring))
    out[0] = x0 + 0.5*p_m_wheel*(v_z_wheel*v_z_wheel)
    out[1] = x5


@njit(error_model="numpy")
def residual(t, y, p, out):
    """M a - f - G^T lambda, then G a - gamma. 56 operations."""
    q_z_body = y[0]
    q_z_mount = y[1]
    q_z_wheel = y[2]
    v_z_body = y[3]
    v_z_mount = y[4]
    v_z_wheel = y[5]
    a_z_body = y[6]
    a_z_mount = y[7]
    a_z_wheel = y[8]
    p_m_body = p[0]
    p_m_mount = p[1]
    p_m_wheel = p[2]
    p_k_spring = p[3]
    p_k_bushing = p[4]
    p_c_bushing = p[5]
    p_c_damper = p[6]
    p_k_tyre = p[7]
    p_c_tyre = p[8]
    p_bump = p[9]
    p_t_bump = p[10]
    p_t_width = p[11]
    p_wave = p[12]
    p_wave_rate = p[13]
    x0 = 0.5*p_k_spring*(2.0*(q_z_body - q_z_wheel))
    x1 = 0.5*p_k_bushing*(2.0*(q_z_body - q_z_mount))
    x2 = 0.5*p_c_bushing*(2.0*(v_z_body - v_z_mount))
    x3 = 0.5*p_c_damper*(2.0*(v_z_mount - v_z_wheel))
    x4 = (t - p_t_bump)/p_t_width
    x5 = exp(-(x4*x4))
    x6 = t*p_wave_rate
    x7 = 0.5*p_k_tyre*(2.0*(q_z_wheel - (p_bump*x5 + p_wave*sin(x6))))
    x8 = p_wave*(p_wave_rate*cos(x6)) - p_bump*(x5*(1.0/p_t_width*(2.0*x4)))
    x9 = 0.5*p_c_tyre*(2.0*(v_z_wheel - x8)) + a_z_wheel*p_m_wheel - x3
    out[0] = x0 + x1 + (x2 + a_z_body*p_m_body)
    out[1] = x3 + a_z_mount*p_m_mount - x2 - x1
    out[2] = x7 - x0 + x9


@njit(error_model="numpy")
def residual_jacobian(t, y, p, out):
    """Residual derivatives by q, v, a, lambda. 8 operations."""
    p_m_body = p[0]
    p_m_mount = p[1]
    p_m_wheel = p[2]
    p_k_spring = p[3]
    p_k_bushing = p[4]
    p_c_bushing = p[5]
    p_c_damper = p[6]
    p_k_tyre = p[7]
    p_c_tyre = p[8]
    x0 = -p_k_bushing
    x1 = -p_k_spring
    x2 = -p_c_bushing
    x3 = -p_c_damper
    out[0] = p_k_spring + p_k_bushing
    out[1] = x0
    out[2] = x1
    out[3] = p_c_bushing
    out[4] = x2
    out[6] = p_m_body
    out[9] = x0
    out[10] = p_k_bushing
    out[12] = x2
    out[13] = p_c_bushing + p_c_damper
    out[14] = x3
    out[16] = p_m_mount
    out[18] = x1
    out[20] = p_k_spring + p_k_tyre
    out[22] = x3
    out[23] = p_c_damper + p_c_tyre
    out[26] = p_m_wheel


@njit(error_model="numpy")
def poses(t, y, p, out):
    """Per body: position, rotation matrix (body to world). 18 operations."""
    q_z_body = y[0]
    q_z_mount = y[1]
    q_z_wheel = y[2]
    p_bump = p[9]
    p_t_bump = p[10]
    p_t_width = p[11]
    p_wave = p[12]
    p_wave_rate = p[13]
    x0 = (t - p_t_bump)/p_t_width
    out[0] = 0.0
    out[1] = q_z_body + 1.05
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
    out[13] = q_z_mount + 0.82
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
    out[25] = q_z_wheel + 0.3
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
    out[36] = 0.0
    out[37] = 0.5*(0.3 + (0.82 + (q_z_mount + q_z_wheel)))
    out[38] = 0.0
    out[39] = 6.123233995736766e-17
    out[40] = -1.0
    out[41] = 0.0
    out[42] = 1.0
    out[43] = 6.123233995736766e-17
    out[44] = 0.0
    out[45] = 0.0
    out[46] = 0.0
    out[47] = 1.0
    out[48] = 0.0
    out[49] = p_bump*exp(-(x0*x0)) + p_wave*sin(t*p_wave_rate) + -0.02
    out[50] = 0.0
    out[51] = 1.0
    out[52] = 0.0
    out[53] = 0.0
    out[54] = 0.0
    out[55] = 1.0
    out[56] = 0.0
    out[57] = 0.0
    out[58] = 0.0
    out[59] = 1.0


@njit(error_model="numpy")
def shapes(t, y, p, out):
    """Sizes of the bodies' shapes. 3 operations."""
    q_z_mount = y[1]
    q_z_wheel = y[2]
    out[0] = 0.9
    out[1] = 0.35
    out[2] = 0.6
    out[3] = 0.2
    out[4] = 0.04
    out[5] = 0.2
    out[6] = 0.28
    out[7] = 0.03
    out[8] = -0.3 + (q_z_mount + 0.82 - q_z_wheel)
    out[9] = 0.5
    out[10] = 0.04
    out[11] = 0.6


@njit(error_model="numpy")
def outputs(t, y, p, out):
    """Outputs. 25 operations."""
    q_z_wheel = y[2]
    v_z_wheel = y[5]
    p_k_tyre = p[7]
    p_c_tyre = p[8]
    p_bump = p[9]
    p_t_bump = p[10]
    p_t_width = p[11]
    p_wave = p[12]
    p_wave_rate = p[13]
    x0 = (t - p_t_bump)/p_t_width
    x1 = exp(-(x0*x0))
    x2 = t*p_wave_rate
    x3 = p_bump*x1 + p_wave*sin(x2)
    x4 = p_wave*(p_wave_rate*cos(x2)) - p_bump*(x1*(1.0/p_t_width*(2.0*x0)))
    out[0] = x3
    out[1] = -(p_c_tyre*(v_z_wheel - x4) + p_k_tyre*(q_z_wheel - x3))
