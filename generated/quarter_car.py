"""quarter_car: equations of motion, written by symgen 0.1.0. Do not edit.

Quarter of a car over a bump: body, strut on a stiff rubber mount, wheel on a stiff tyre
"""

from math import cos, exp, sin

from numba import njit

MODEL = {
    "abi": 1,
    "generator": "symgen 0.1.0",
    "source": "sha256:9df6222da687f1b412616644e5b80244cc1d41efb8adefe9121fc743e68bc098",
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
    "quaternions": [],
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
        {"name": "road_height", "unit": "m"},
        {"name": "tyre_load_change", "unit": "N"},
    ],
    "events": [],
    "bodies": [
        {"name": "body", "planar": True, "shape": "box", "sizes": 3, "mesh": ""},
        {"name": "mount", "planar": True, "shape": "box", "sizes": 3, "mesh": ""},
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
        "rhs": 59,
        "mass_matrix": 0,
        "forces": 42,
        "energy": 36,
        "residual": 45,
        "residual_jacobian": 8,
        "poses": 15,
        "shapes": 0,
        "outputs": 26,
        "marks": 3,
        "limits": 0,
        "time_terms": 10,
    },
    "hoisted": {
        "rhs": 7,
        "forces": 3,
        "energy": 7,
        "residual": 3,
        "residual_jacobian": 8,
        "poses": 1,
        "outputs": 3,
        "time_terms": 1,
    },
    "run": {
        "t_end": 5.0,
        "fps": 60.0,
    },
    "limits": [
        {"name": "bodies.body.mass", "bound": "zero or more"},
        {"name": "bodies.mount.mass", "bound": "zero or more"},
        {"name": "bodies.wheel.mass", "bound": "zero or more"},
    ],
    "subsystems": [],
    "marks": [
        {"kind": "spring", "name": "spring", "body": "", "numbers": 6, "moves": True},
        {"kind": "damper", "name": "damper", "body": "", "numbers": 6, "moves": True},
    ],
    "time_terms": 4,
}

@njit(error_model="numpy")
def rhs(t, y, p, out):
    """State derivative: rates, accelerations, power. 59 operations."""
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
    c0 = 1.0/p_m_body
    c1 = 1.0/p_m_mount
    c2 = 1.0/p_m_wheel
    c3 = p_wave*p_wave_rate
    c4 = 1.0/p_t_width
    c5 = p_bump*(c4*(2.0*c4))
    c6 = 0.5*p_k_tyre
    q_z_body = y[0]
    q_z_mount = y[1]
    q_z_wheel = y[2]
    v_z_body = y[3]
    v_z_mount = y[4]
    v_z_wheel = y[5]
    x0 = p_c_bushing*(v_z_body - v_z_mount)
    x1 = p_k_spring*(q_z_body - q_z_wheel)
    x2 = p_k_bushing*(q_z_body - q_z_mount)
    x3 = p_c_damper*(v_z_mount - v_z_wheel)
    x4 = x3 - x0
    x5 = t*p_wave_rate
    x6 = t - p_t_bump
    x7 = c4*x6
    x8 = exp(-(x7*x7))
    x9 = cos(x5)*c3 - x6*x8*c5
    x10 = p_c_tyre*(v_z_wheel - x9) - x3
    x11 = q_z_wheel - (p_wave*sin(x5) + p_bump*x8)
    x12 = v_z_body*x0 + v_z_mount*x4 + v_z_wheel*x10 + c6*(x9*(2.0*x11))
    out[0] = v_z_body
    out[1] = v_z_mount
    out[2] = v_z_wheel
    out[3] = -(c0*(x0 + (x1 + x2)))
    out[4] = -(c1*(x4 - x2))
    out[5] = -(c2*(x10 + (p_k_tyre*x11 - x1)))
    out[6] = -x12


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
    """Forces f of M a = f + G^T lambda. 42 operations."""
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
    c0 = p_wave*p_wave_rate
    c1 = 1.0/p_t_width
    c2 = p_bump*(c1*(2.0*c1))
    q_z_body = y[0]
    q_z_mount = y[1]
    q_z_wheel = y[2]
    v_z_body = y[3]
    v_z_mount = y[4]
    v_z_wheel = y[5]
    x0 = p_c_bushing*(v_z_body - v_z_mount)
    x1 = p_k_spring*(q_z_body - q_z_wheel)
    x2 = p_k_bushing*(q_z_body - q_z_mount)
    x3 = p_c_damper*(v_z_mount - v_z_wheel)
    x4 = t*p_wave_rate
    x5 = t - p_t_bump
    x6 = c1*x5
    x7 = exp(-(x6*x6))
    x8 = p_c_tyre*(v_z_wheel - (cos(x4)*c0 - x5*x7*c2)) - x3 + (p_k_tyre*(q_z_wheel - (p_wave*sin(x4) + p_bump*x7)) - x1)
    out[0] = -(x0 + (x1 + x2))
    out[1] = -(x3 - x0 - x2)
    out[2] = -x8


@njit(error_model="numpy")
def energy(t, y, p, out):
    """Kinetic and potential energy. 36 operations."""
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
    c0 = 0.5*p_m_body
    c1 = 0.5*p_m_mount
    c2 = 0.5*p_m_wheel
    c3 = 0.5*p_k_bushing
    c4 = 0.5*p_k_spring
    c5 = 0.5*p_k_tyre
    c6 = 1.0/p_t_width
    q_z_body = y[0]
    q_z_mount = y[1]
    q_z_wheel = y[2]
    v_z_body = y[3]
    v_z_mount = y[4]
    v_z_wheel = y[5]
    x0 = c0*(v_z_body*v_z_body) + c1*(v_z_mount*v_z_mount) + c2*(v_z_wheel*v_z_wheel)
    x1 = q_z_body - q_z_mount
    x2 = q_z_body - q_z_wheel
    x3 = c6*(t - p_t_bump)
    x4 = q_z_wheel - (p_wave*sin(t*p_wave_rate) + p_bump*exp(-(x3*x3)))
    out[0] = x0
    out[1] = x1*x1*c3 + x2*x2*c4 + c5*(x4*x4)


@njit(error_model="numpy")
def residual(t, y, p, out):
    """M a - f - G^T lambda, then G a - gamma. 45 operations."""
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
    c0 = 1.0/p_t_width
    c1 = p_wave*p_wave_rate
    c2 = p_bump*(c0*(2.0*c0))
    q_z_body = y[0]
    q_z_mount = y[1]
    q_z_wheel = y[2]
    v_z_body = y[3]
    v_z_mount = y[4]
    v_z_wheel = y[5]
    a_z_body = y[6]
    a_z_mount = y[7]
    a_z_wheel = y[8]
    x0 = p_k_spring*(q_z_body - q_z_wheel)
    x1 = p_k_bushing*(q_z_body - q_z_mount)
    x2 = p_c_bushing*(v_z_body - v_z_mount)
    x3 = p_c_damper*(v_z_mount - v_z_wheel)
    x4 = t*p_wave_rate
    x5 = t - p_t_bump
    x6 = c0*x5
    x7 = exp(-(x6*x6))
    x8 = p_c_tyre*(v_z_wheel - (cos(x4)*c1 - x5*x7*c2)) + a_z_wheel*p_m_wheel
    x9 = p_k_tyre*(q_z_wheel - (p_wave*sin(x4) + p_bump*x7)) - x0 + (x8 - x3)
    out[0] = x0 + x1 + (x2 + a_z_body*p_m_body)
    out[1] = x3 + a_z_mount*p_m_mount - x2 - x1
    out[2] = x9


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
    c0 = p_k_spring + p_k_bushing
    c1 = -p_k_bushing
    c2 = -p_k_spring
    c3 = -p_c_bushing
    c4 = p_c_bushing + p_c_damper
    c5 = -p_c_damper
    c6 = p_k_spring + p_k_tyre
    c7 = p_c_damper + p_c_tyre
    out[0] = c0
    out[1] = c1
    out[2] = c2
    out[3] = p_c_bushing
    out[4] = c3
    out[6] = p_m_body
    out[9] = c1
    out[10] = p_k_bushing
    out[12] = c3
    out[13] = c4
    out[14] = c5
    out[16] = p_m_mount
    out[18] = c2
    out[20] = c6
    out[22] = c5
    out[23] = c7
    out[26] = p_m_wheel


@njit(error_model="numpy")
def poses(t, y, p, out):
    """Per body: position, rotation matrix (body to world). 15 operations."""
    p_bump = p[9]
    p_t_bump = p[10]
    p_t_width = p[11]
    p_wave = p[12]
    p_wave_rate = p[13]
    c0 = 1.0/p_t_width
    q_z_body = y[0]
    q_z_mount = y[1]
    q_z_wheel = y[2]
    x0 = c0*(t - p_t_bump)
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
    out[37] = -0.02 + (p_wave*sin(t*p_wave_rate) + p_bump*exp(-(x0*x0)))
    out[38] = 0.0
    out[39] = 1.0
    out[40] = 0.0
    out[41] = 0.0
    out[42] = 0.0
    out[43] = 1.0
    out[44] = 0.0
    out[45] = 0.0
    out[46] = 0.0
    out[47] = 1.0


@njit(error_model="numpy")
def shapes(t, y, p, out):
    """Sizes of the bodies' shapes. 0 operations."""
    out[0] = 0.9
    out[1] = 0.35
    out[2] = 0.6
    out[3] = 0.2
    out[4] = 0.04
    out[5] = 0.2
    out[6] = 0.28
    out[7] = 0.5
    out[8] = 0.04
    out[9] = 0.6


@njit(error_model="numpy")
def outputs(t, y, p, out):
    """Outputs. 26 operations."""
    p_k_tyre = p[7]
    p_c_tyre = p[8]
    p_bump = p[9]
    p_t_bump = p[10]
    p_t_width = p[11]
    p_wave = p[12]
    p_wave_rate = p[13]
    c0 = 1.0/p_t_width
    c1 = p_wave*p_wave_rate
    c2 = p_bump*(c0*(2.0*c0))
    q_z_wheel = y[2]
    v_z_wheel = y[5]
    x0 = t*p_wave_rate
    x1 = t - p_t_bump
    x2 = c0*x1
    x3 = exp(-(x2*x2))
    x4 = p_wave*sin(x0) + p_bump*x3
    x5 = p_c_tyre*(v_z_wheel - (cos(x0)*c1 - x1*x3*c2)) + p_k_tyre*(q_z_wheel - x4)
    out[0] = x4
    out[1] = -x5


@njit(error_model="numpy")
def marks(t, y, p, out):
    """What a picture shows besides bodies, as `marks` lists it. 3 operations."""
    q_z_body = y[0]
    q_z_mount = y[1]
    q_z_wheel = y[2]
    x0 = q_z_wheel + 0.3
    out[0] = -0.15
    out[1] = x0
    out[3] = -0.15
    out[4] = q_z_body + 1.05
    out[6] = 0.06
    out[7] = x0
    out[9] = 0.06
    out[10] = q_z_mount + 0.82


@njit(error_model="numpy")
def limits(t, y, p, out):
    """Numbers of parameters that have a bound. 0 operations."""
    p_m_body = p[0]
    p_m_mount = p[1]
    p_m_wheel = p[2]
    out[0] = p_m_body
    out[1] = p_m_mount
    out[2] = p_m_wheel


@njit(error_model="numpy")
def time_terms(t, y, p, out):
    """What the equations have of time alone, beyond polynomials. 10 operations."""
    p_t_bump = p[10]
    p_t_width = p[11]
    p_wave_rate = p[13]
    c0 = 1.0/p_t_width
    x0 = t*p_wave_rate
    x1 = t - p_t_bump
    x2 = c0*x1
    x3 = exp(-(x2*x2))
    out[0] = sin(x0)
    out[1] = cos(x0)
    out[2] = x3
    out[3] = x1*x3
