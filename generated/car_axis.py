"""car_axis: equations of motion, written by symgen 0.1.0. Do not edit.

Car axis on an uneven road (IVP Test Set, index 3, dimensionless)
"""

from math import atan2, cos, sin, sqrt

from numba import njit

MODEL = {
    "abi": 1,
    "generator": "symgen 0.1.0",
    "source": "sha256:783c088ec116e14c96fa1250f1f140afbec711169a627998c02643dfa4241d02",
    "name": "car_axis",
    "description": "Car axis on an uneven road (IVP Test Set, index 3, dimensionless)",
    "nq": 4,
    "nv": 4,
    "nh": 2,
    "nn": 0,
    "nw": 1,
    "coordinates": [
        {"name": "xl", "unit": "", "value": 0.0, "enforced": True},
        {"name": "yl", "unit": "", "value": 0.5, "enforced": True},
        {"name": "xr", "unit": "", "value": 1.0, "enforced": True},
        {"name": "yr", "unit": "", "value": 0.5, "enforced": True},
    ],
    "rates": [
        {"name": "xl", "unit": "", "value": -0.5, "enforced": True},
        {"name": "yl", "unit": "", "value": 0.0, "enforced": True},
        {"name": "xr", "unit": "", "value": -0.5, "enforced": True},
        {"name": "yr", "unit": "", "value": 0.0, "enforced": True},
    ],
    "parameters": [
        {"name": "eps", "unit": "", "value": 0.01, "doc": "small mass: the masses are M*eps^2/2"},
        {"name": "M", "unit": "", "value": 10.0, "doc": ""},
        {"name": "L", "unit": "", "value": 1.0, "doc": "length of the axis"},
        {"name": "L0", "unit": "", "value": 0.5, "doc": "length of the slack springs"},
        {"name": "r", "unit": "", "value": 0.1, "doc": "height of the road's waves"},
        {"name": "w", "unit": "", "value": 10.0, "doc": "how fast they pass"},
        {"name": "g", "unit": "", "value": 1.0, "doc": ""},
    ],
    "inputs": [],
    "constants": [],
    "constraints": [
        {"name": "left_spring_is_upright", "kind": "holonomic"},
        {"name": "axis_is_rigid", "kind": "holonomic"},
    ],
    "outputs": [],
    "events": [],
    "bodies": [
        {"name": "left", "planar": True, "shape": "sphere", "sizes": 1, "mesh": ""},
        {"name": "right", "planar": True, "shape": "sphere", "sizes": 1, "mesh": ""},
        {"name": "axis", "planar": True, "shape": "capsule", "sizes": 2, "mesh": ""},
        {"name": "left_spring", "planar": True, "shape": "cylinder", "sizes": 2, "mesh": ""},
        {"name": "right_spring", "planar": True, "shape": "cylinder", "sizes": 2, "mesh": ""},
        {"name": "right_wheel", "planar": True, "shape": "sphere", "sizes": 1, "mesh": ""},
    ],
    "structure": {
        "conservative": False,
        "time_dependent": True,
        "constant_mass": True,
        "diagonal_mass": True,
        "velocity_dependent": False,
        "separable": False,
    },
    "operations": {
        "rhs": 148,
        "mass_matrix": 3,
        "forces": 41,
        "energy": 43,
        "residual": 104,
        "residual_jacobian": 117,
        "constraint_residual": 37,
        "constraint_jacobian": 13,
        "gamma": 44,
        "project": 97,
        "poses": 33,
        "shapes": 17,
    },
    "run": {
        "t_end": 3.0,
        "fps": 100.0,
    },
}

@njit(error_model="numpy")
def rhs(t, y, p, out):
    """State derivative: rates, accelerations, power, multipliers, pivot ratio. 148 operations."""
    q_xl = y[0]
    q_yl = y[1]
    q_xr = y[2]
    q_yr = y[3]
    v_xl = y[4]
    v_yl = y[5]
    v_xr = y[6]
    v_yr = y[7]
    p_eps = p[0]
    p_M = p[1]
    p_L = p[2]
    p_L0 = p[3]
    p_r = p[4]
    p_w = p[5]
    p_g = p[6]
    x0 = 2.0*(q_xr - q_xl)
    x1 = p_eps*p_eps*(0.5*p_M)
    x2 = 1.0/x1
    x3 = x0*x2
    x4 = t*p_w
    x5 = sin(x4)
    x6 = p_r*x5
    x7 = sqrt(p_L*p_L - x6*x6)
    x8 = x7*x2
    x9 = 2.0*(q_yr - q_yl)
    x10 = x6*x2
    x11 = x0*x8 + x9*x10
    x12 = 1.0/(x7*x8 + x6*x10)
    x13 = x11*x12
    x14 = x9*x2
    x15 = x9*x14
    x16 = x0*x3
    x17 = x15 + (x16 + (x16 + x15))
    x18 = x11*x13 - x17
    x19 = q_xr - x7
    x20 = q_yr - x6
    x21 = sqrt(x19*x19 + x20*x20)
    x22 = x21 - p_L0
    x23 = 0.5/x21
    x24 = x22*x23
    x25 = 2.0*x19
    x26 = x24*x25
    x27 = v_xr - v_xl
    x28 = v_yr - v_yl
    x29 = p_g*x1
    x30 = 2.0*x20
    x31 = x29 + x24*x30
    x32 = sqrt(q_xl*q_xl + q_yl*q_yl)
    x33 = (x32 - p_L0)*(0.5/x32)
    x34 = x33*(2.0*q_xl)
    x35 = x29 + x33*(2.0*q_yl)
    x36 = x26*x3 - (x27*(2.0*x27) + x28*(2.0*x28)) + x31*x14 - x34*x3 - x35*x14
    x37 = p_r*(p_w*cos(x4))
    x38 = v_yl*x37
    x39 = p_r*(p_w*(p_w*x5))
    x40 = 2.0*x6
    x41 = x37*x40
    x42 = 0.5/x7
    x43 = x41*x42
    x44 = v_xl*x43
    x45 = x44 + q_xl*(x42*(x37*(2.0*x37) - x40*x39) + x41*(x42*x43/x7))
    x46 = x34*x8 - (x38 + (x38 - q_yl*x39) - (x44 + x45)) + x35*x10
    x47 = 1.0/x18*(x36 + x13*x46)
    x48 = x3*x47
    x49 = x13*x47 - x12*x46
    x50 = x14*x47
    x51 = 0.5*(2.0*x22*(x23*(x43*x25 - x37*x30))) + x49*(q_yl*x37 - q_xl*x43)
    x52 = -(x18/x17)
    out[0] = v_xl
    out[1] = v_yl
    out[2] = v_xr
    out[3] = v_yr
    out[4] = x48 - (x34*x2 + x8*x49)
    out[5] = x50 - (x35*x2 + x10*x49)
    out[6] = -(x48 + x26*x2)
    out[7] = -(x50 + x31*x2)
    out[8] = x51
    out[9] = -x49
    out[10] = -x47
    out[11] = (x52 if x52 < 1.0 else 1.0)


@njit(error_model="numpy")
def mass_matrix(t, y, p, out):
    """Mass matrix M, row by row. 3 operations."""
    p_eps = p[0]
    p_M = p[1]
    x0 = p_eps*p_eps*(0.5*p_M)
    out[0] = x0
    out[5] = x0
    out[10] = x0
    out[15] = x0


@njit(error_model="numpy")
def forces(t, y, p, out):
    """Forces f of M a = f + G^T lambda. 41 operations."""
    q_xl = y[0]
    q_yl = y[1]
    q_xr = y[2]
    q_yr = y[3]
    p_eps = p[0]
    p_M = p[1]
    p_L = p[2]
    p_L0 = p[3]
    p_r = p[4]
    p_w = p[5]
    p_g = p[6]
    x0 = sqrt(q_xl*q_xl + q_yl*q_yl)
    x1 = (x0 - p_L0)*(0.5/x0)
    x2 = p_g*(p_eps*p_eps*(0.5*p_M))
    x3 = p_r*sin(t*p_w)
    x4 = q_xr - sqrt(p_L*p_L - x3*x3)
    x5 = q_yr - x3
    x6 = sqrt(x4*x4 + x5*x5)
    x7 = (x6 - p_L0)*(0.5/x6)
    out[0] = -(x1*(2.0*q_xl))
    out[1] = -(x2 + x1*(2.0*q_yl))
    out[2] = -(x7*(2.0*x4))
    out[3] = -(x2 + x7*(2.0*x5))


@njit(error_model="numpy")
def energy(t, y, p, out):
    """Kinetic and potential energy. 43 operations."""
    q_xl = y[0]
    q_yl = y[1]
    q_xr = y[2]
    q_yr = y[3]
    v_xl = y[4]
    v_yl = y[5]
    v_xr = y[6]
    v_yr = y[7]
    p_eps = p[0]
    p_M = p[1]
    p_L = p[2]
    p_L0 = p[3]
    p_r = p[4]
    p_w = p[5]
    p_g = p[6]
    x0 = p_eps*p_eps*(0.5*p_M)
    x1 = 0.5*x0
    x2 = sqrt(q_xl*q_xl + q_yl*q_yl) - p_L0
    x3 = p_r*sin(t*p_w)
    x4 = q_xr - sqrt(p_L*p_L - x3*x3)
    x5 = q_yr - x3
    x6 = sqrt(x4*x4 + x5*x5) - p_L0
    out[0] = x1*(v_xl*v_xl + v_yl*v_yl) + x1*(v_xr*v_xr + v_yr*v_yr)
    out[1] = x0*(q_yl*p_g) + x0*(q_yr*p_g) + (0.5*(x2*x2) + 0.5*(x6*x6))


@njit(error_model="numpy")
def residual(t, y, p, out):
    """M a - f - G^T lambda, then G a - gamma. 104 operations."""
    q_xl = y[0]
    q_yl = y[1]
    q_xr = y[2]
    q_yr = y[3]
    v_xl = y[4]
    v_yl = y[5]
    v_xr = y[6]
    v_yr = y[7]
    a_xl = y[8]
    a_yl = y[9]
    a_xr = y[10]
    a_yr = y[11]
    lam_left_spring_is_upright = y[12]
    lam_axis_is_rigid = y[13]
    p_eps = p[0]
    p_M = p[1]
    p_L = p[2]
    p_L0 = p[3]
    p_r = p[4]
    p_w = p[5]
    p_g = p[6]
    x0 = sqrt(q_xl*q_xl + q_yl*q_yl)
    x1 = (x0 - p_L0)*(0.5/x0)
    x2 = p_eps*p_eps*(0.5*p_M)
    x3 = t*p_w
    x4 = sin(x3)
    x5 = p_r*x4
    x6 = sqrt(p_L*p_L - x5*x5)
    x7 = 2.0*(q_xr - q_xl)
    x8 = lam_axis_is_rigid*x7
    x9 = x1*(2.0*q_xl) + a_xl*x2 - (lam_left_spring_is_upright*x6 - x8)
    x10 = p_g*x2
    x11 = 2.0*(q_yr - q_yl)
    x12 = lam_axis_is_rigid*x11
    x13 = x10 + x1*(2.0*q_yl) + a_yl*x2 - (lam_left_spring_is_upright*x5 - x12)
    x14 = q_xr - x6
    x15 = q_yr - x5
    x16 = sqrt(x14*x14 + x15*x15)
    x17 = (x16 - p_L0)*(0.5/x16)
    x18 = p_r*(p_w*cos(x3))
    x19 = 2.0*x5
    x20 = x18*x19
    x21 = 0.5/x6
    x22 = x20*x21
    x23 = v_xl*x22
    x24 = p_r*(p_w*(p_w*x4))
    x25 = x23 + q_xl*(x21*(x18*(2.0*x18) - x19*x24) + x20*(x21*x22/x6))
    x26 = v_yl*x18
    x27 = v_xr - v_xl
    x28 = v_yr - v_yl
    x29 = x27*(2.0*x27) + x7*(a_xr - a_xl) + (x28*(2.0*x28) + x11*(a_yr - a_yl))
    out[0] = x9
    out[1] = x13
    out[2] = x17*(2.0*x14) + a_xr*x2 - x8
    out[3] = x10 + x17*(2.0*x15) + a_yr*x2 - x12
    out[4] = a_xl*x6 - x23 - x25 + (x26 - q_yl*x24 + (x26 + a_yl*x5))
    out[5] = x29


@njit(error_model="numpy")
def residual_jacobian(t, y, p, out):
    """Residual derivatives by q, v, a, lambda. 117 operations."""
    q_xl = y[0]
    q_yl = y[1]
    q_xr = y[2]
    q_yr = y[3]
    v_xl = y[4]
    v_yl = y[5]
    v_xr = y[6]
    v_yr = y[7]
    a_xl = y[8]
    a_yl = y[9]
    a_xr = y[10]
    a_yr = y[11]
    lam_axis_is_rigid = y[13]
    p_eps = p[0]
    p_M = p[1]
    p_L = p[2]
    p_L0 = p[3]
    p_r = p[4]
    p_w = p[5]
    x0 = sqrt(q_xl*q_xl + q_yl*q_yl)
    x1 = x0 - p_L0
    x2 = 0.5/x0
    x3 = 2.0*lam_axis_is_rigid
    x4 = 2.0*(x1*x2) - x3
    x5 = 2.0*q_xl
    x6 = x2*(x2*x5 - x2*(x1*x5/x0))
    x7 = 2.0*q_yl
    x8 = p_eps*p_eps*(0.5*p_M)
    x9 = t*p_w
    x10 = sin(x9)
    x11 = p_r*x10
    x12 = sqrt(p_L*p_L - x11*x11)
    x13 = 2.0*(q_xr - q_xl)
    x14 = x2*(x2*x7 - x2*(x1*x7/x0))
    x15 = 2.0*(q_yr - q_yl)
    x16 = q_xr - x12
    x17 = q_yr - x11
    x18 = sqrt(x16*x16 + x17*x17)
    x19 = x18 - p_L0
    x20 = 0.5/x18
    x21 = 2.0*(x19*x20)
    x22 = 2.0*x16
    x23 = x20*(x20*x22 - x20*(x19*x22/x18))
    x24 = 2.0*x17
    x25 = -x13
    x26 = x20*(x20*x24 - x20*(x19*x24/x18))
    x27 = -x15
    x28 = 0.5/x12
    x29 = p_r*(p_w*cos(x9))
    x30 = 2.0*x29
    x31 = 2.0*x11
    x32 = p_r*(p_w*(p_w*x10))
    x33 = x29*x31
    x34 = x33*x28
    x35 = 2.0*(a_xr - a_xl)
    x36 = 2.0*(a_yr - a_yl)
    x37 = 2.0*(v_xr - v_xl)
    x38 = x37 + x37
    x39 = 2.0*(v_yr - v_yl)
    x40 = x39 + x39
    out[0] = x4 + x5*x6
    out[1] = x7*x6
    out[2] = x3
    out[8] = x8
    out[12] = -x12
    out[13] = x13
    out[14] = x5*x14
    out[15] = x4 + x7*x14
    out[17] = x3
    out[23] = x8
    out[26] = -x11
    out[27] = x15
    out[28] = x3
    out[30] = x21 + x22*x23 - x3
    out[31] = x24*x23
    out[38] = x8
    out[41] = x25
    out[43] = x3
    out[44] = x22*x26
    out[45] = x21 + x24*x26 - x3
    out[53] = x8
    out[55] = x27
    out[56] = -(x28*(x29*x30 - x31*x32) + x33*(x28*x34/x12))
    out[57] = -x32
    out[60] = -(2.0*x34)
    out[61] = x30
    out[64] = x12
    out[65] = x11
    out[70] = -x35
    out[71] = -x36
    out[72] = x35
    out[73] = x36
    out[74] = -x38
    out[75] = -x40
    out[76] = x38
    out[77] = x40
    out[78] = x25
    out[79] = x27
    out[80] = x13
    out[81] = x15


@njit(error_model="numpy")
def constraint_residual(t, y, p, out):
    """Position residuals, velocity residuals. 37 operations."""
    q_xl = y[0]
    q_yl = y[1]
    q_xr = y[2]
    q_yr = y[3]
    v_xl = y[4]
    v_yl = y[5]
    v_xr = y[6]
    v_yr = y[7]
    p_L = p[2]
    p_r = p[4]
    p_w = p[5]
    x0 = p_L*p_L
    x1 = t*p_w
    x2 = p_r*sin(x1)
    x3 = sqrt(x0 - x2*x2)
    x4 = q_xr - q_xl
    x5 = q_yr - q_yl
    x6 = p_r*(p_w*cos(x1))
    out[0] = q_xl*x3 + q_yl*x2
    out[1] = x4*x4 + x5*x5 - x0
    out[2] = v_xl*x3 - q_xl*(x6*(2.0*x2)*(0.5/x3)) + (v_yl*x2 + q_yl*x6)
    out[3] = (v_xr - v_xl)*(2.0*x4) + (v_yr - v_yl)*(2.0*x5)


@njit(error_model="numpy")
def constraint_jacobian(t, y, p, out):
    """Constraint Jacobian G, row by row. 13 operations."""
    q_xl = y[0]
    q_yl = y[1]
    q_xr = y[2]
    q_yr = y[3]
    p_L = p[2]
    p_r = p[4]
    p_w = p[5]
    x0 = p_r*sin(t*p_w)
    x1 = 2.0*(q_xr - q_xl)
    x2 = 2.0*(q_yr - q_yl)
    out[0] = sqrt(p_L*p_L - x0*x0)
    out[1] = x0
    out[4] = -x1
    out[5] = -x2
    out[6] = x1
    out[7] = x2


@njit(error_model="numpy")
def gamma(t, y, p, out):
    """Right-hand side of G a = gamma. 44 operations."""
    q_xl = y[0]
    q_yl = y[1]
    v_xl = y[4]
    v_yl = y[5]
    v_xr = y[6]
    v_yr = y[7]
    p_L = p[2]
    p_r = p[4]
    p_w = p[5]
    x0 = t*p_w
    x1 = p_r*(p_w*cos(x0))
    x2 = v_yl*x1
    x3 = sin(x0)
    x4 = p_r*(p_w*(p_w*x3))
    x5 = p_r*x3
    x6 = 2.0*x5
    x7 = x1*x6
    x8 = sqrt(p_L*p_L - x5*x5)
    x9 = 0.5/x8
    x10 = x7*x9
    x11 = v_xl*x10
    x12 = x11 + (x11 + q_xl*(x9*(x1*(2.0*x1) - x6*x4) + x7*(x9*x10/x8)))
    x13 = v_xr - v_xl
    x14 = v_yr - v_yl
    out[0] = -(x2 + (x2 - q_yl*x4) - x12)
    out[1] = -(x13*(2.0*x13) + x14*(2.0*x14))


@njit(error_model="numpy")
def project(t, y, p, out):
    """State moved onto the constraints, and the residuals it had. 97 operations."""
    q_xl = y[0]
    q_yl = y[1]
    q_xr = y[2]
    q_yr = y[3]
    v_xl = y[4]
    v_yl = y[5]
    v_xr = y[6]
    v_yr = y[7]
    p_eps = p[0]
    p_M = p[1]
    p_L = p[2]
    p_r = p[4]
    p_w = p[5]
    x0 = p_L*p_L
    x1 = t*p_w
    x2 = p_r*sin(x1)
    x3 = sqrt(x0 - x2*x2)
    x4 = 1.0/(p_eps*p_eps*(0.5*p_M))
    x5 = x3*x4
    x6 = q_xl*x3 + q_yl*x2
    x7 = x2*x4
    x8 = 1.0/(x3*x5 + x2*x7)
    x9 = q_xr - q_xl
    x10 = 2.0*x9
    x11 = q_yr - q_yl
    x12 = 2.0*x11
    x13 = x10*x5 + x12*x7
    x14 = x13*x8
    x15 = x12*x4
    x16 = x12*x15
    x17 = x10*x4
    x18 = x10*x17
    x19 = 1.0/(x13*x14 - (x16 + (x18 + (x18 + x16))))
    x20 = x9*x9 + x11*x11 - x0
    x21 = x19*(x20 + x6*x14)
    x22 = x6*x8 - x14*x21
    x23 = x17*x21
    x24 = q_xl - (x5*x22 + x23)
    x25 = x15*x21
    x26 = q_yl - (x7*x22 + x25)
    x27 = q_xr + x23
    x28 = q_yr + x25
    x29 = p_r*(p_w*cos(x1))
    x30 = v_xl*x3 - x29*(2.0*x2)*(0.5/x3)*x24 + (v_yl*x2 + x29*x26)
    x31 = (v_xr - v_xl)*(2.0*(x27 - x24)) + (v_yr - v_yl)*(2.0*(x28 - x26))
    x32 = x19*(x31 + x14*x30)
    x33 = x8*x30 - x14*x32
    x34 = x17*x32
    x35 = x15*x32
    out[0] = x24
    out[1] = x26
    out[2] = x27
    out[3] = x28
    out[4] = v_xl - (x5*x33 + x34)
    out[5] = v_yl - (x7*x33 + x35)
    out[6] = v_xr + x34
    out[7] = v_yr + x35
    out[8] = x6
    out[9] = x20
    out[10] = x30
    out[11] = x31


@njit(error_model="numpy")
def poses(t, y, p, out):
    """Per body: position, rotation matrix (body to world). 33 operations."""
    q_xl = y[0]
    q_yl = y[1]
    q_xr = y[2]
    q_yr = y[3]
    p_L = p[2]
    p_r = p[4]
    p_w = p[5]
    x0 = atan2(q_yr - q_yl, q_xr - q_xl)
    x1 = cos(x0)
    x2 = sin(x0)
    x3 = atan2(q_yl, q_xl)
    x4 = cos(x3)
    x5 = sin(x3)
    x6 = p_r*sin(t*p_w)
    x7 = sqrt(p_L*p_L - x6*x6)
    x8 = atan2(q_yr - x6, q_xr - x7)
    x9 = cos(x8)
    x10 = sin(x8)
    out[0] = q_xl
    out[1] = q_yl
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
    out[12] = q_xr
    out[13] = q_yr
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
    out[24] = 0.5*(q_xl + q_xr)
    out[25] = 0.5*(q_yl + q_yr)
    out[26] = 0.0
    out[27] = x1
    out[28] = -x2
    out[29] = 0.0
    out[30] = x2
    out[31] = x1
    out[32] = 0.0
    out[33] = 0.0
    out[34] = 0.0
    out[35] = 1.0
    out[36] = 0.5*q_xl
    out[37] = 0.5*q_yl
    out[38] = 0.0
    out[39] = x4
    out[40] = -x5
    out[41] = 0.0
    out[42] = x5
    out[43] = x4
    out[44] = 0.0
    out[45] = 0.0
    out[46] = 0.0
    out[47] = 1.0
    out[48] = 0.5*(q_xr + x7)
    out[49] = 0.5*(q_yr + x6)
    out[50] = 0.0
    out[51] = x9
    out[52] = -x10
    out[53] = 0.0
    out[54] = x10
    out[55] = x9
    out[56] = 0.0
    out[57] = 0.0
    out[58] = 0.0
    out[59] = 1.0
    out[60] = x7
    out[61] = x6
    out[62] = 0.0
    out[63] = 1.0
    out[64] = 0.0
    out[65] = 0.0
    out[66] = 0.0
    out[67] = 1.0
    out[68] = 0.0
    out[69] = 0.0
    out[70] = 0.0
    out[71] = 1.0


@njit(error_model="numpy")
def shapes(t, y, p, out):
    """Sizes of the bodies' shapes. 17 operations."""
    q_xl = y[0]
    q_yl = y[1]
    q_xr = y[2]
    q_yr = y[3]
    p_L = p[2]
    p_r = p[4]
    p_w = p[5]
    x0 = p_r*sin(t*p_w)
    x1 = q_xr - sqrt(p_L*p_L - x0*x0)
    x2 = q_yr - x0
    out[0] = 0.05
    out[1] = 0.05
    out[2] = 0.025
    out[3] = p_L
    out[4] = 0.015
    out[5] = sqrt(q_xl*q_xl + q_yl*q_yl)
    out[6] = 0.015
    out[7] = sqrt(x1*x1 + x2*x2)
    out[8] = 0.04
