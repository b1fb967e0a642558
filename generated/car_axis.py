"""car_axis: equations of motion, written by symgen 0.1.0. Do not edit.

Car axis on an uneven road (IVP Test Set, index 3, dimensionless)
"""

from math import atan2, cos, sin, sqrt

from numba import njit

MODEL = {
    "abi": 1,
    "generator": "symgen 0.1.0",
    "source": "sha256:33dd9f10703146fabec0ca865b6e3b11884ab0f14b42a823c24e3c634fefd057",
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
    "quaternions": [],
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
        "rhs": 150,
        "mass_matrix": 3,
        "forces": 41,
        "energy": 42,
        "residual": 106,
        "residual_jacobian": 113,
        "constraint_residual": 38,
        "constraint_jacobian": 13,
        "gamma": 46,
        "project": 100,
        "poses": 17,
        "shapes": 0,
        "marks": 7,
        "limits": 3,
        "time_terms": 29,
    },
    "hoisted": {
        "rhs": 10,
        "mass_matrix": 1,
        "forces": 2,
        "energy": 4,
        "residual": 7,
        "residual_jacobian": 6,
        "constraint_residual": 3,
        "constraint_jacobian": 1,
        "gamma": 5,
        "project": 6,
        "poses": 1,
        "marks": 1,
        "time_terms": 5,
    },
    "run": {
        "t_end": 3.0,
        "fps": 100.0,
    },
    "limits": [
        {"name": "bodies.left.mass", "bound": "zero or more"},
        {"name": "bodies.axis.shape.capsule[1]", "bound": "zero or more"},
    ],
    "subsystems": [],
    "marks": [
        {"kind": "spring", "name": "left_spring", "body": "", "numbers": 6, "moves": True},
        {"kind": "spring", "name": "right_spring", "body": "", "numbers": 6, "moves": True},
        {"kind": "ground", "name": "road", "body": "", "numbers": 3},
    ],
    "time_terms": 7,
}

@njit(error_model="numpy")
def rhs(t, y, p, out):
    """State derivative: rates, accelerations, power, multipliers, pivot ratio. 150 operations."""
    p_eps = p[0]
    p_M = p[1]
    p_L = p[2]
    p_L0 = p[3]
    p_r = p[4]
    p_w = p[5]
    p_g = p[6]
    c0 = p_eps*p_eps*(0.5*p_M)
    c1 = 1.0/c0
    c2 = 2.0*c1
    c3 = p_L*p_L
    c4 = p_r*c1
    c5 = p_g*c0
    c6 = p_r*p_w
    c7 = p_r*(p_w*p_w)
    c8 = 2.0*p_r
    c9 = 2.0*c6
    q_xl = y[0]
    q_yl = y[1]
    q_xr = y[2]
    q_yr = y[3]
    v_xl = y[4]
    v_yl = y[5]
    v_xr = y[6]
    v_yr = y[7]
    x0 = q_xr - q_xl
    x1 = x0*c2
    x2 = 2.0*x0
    x3 = t*p_w
    x4 = sin(x3)
    x5 = p_r*x4
    x6 = sqrt(c3 - x5*x5)
    x7 = x6*c1
    x8 = q_yr - q_yl
    x9 = 2.0*x8
    x10 = x4*c4
    x11 = x2*x7 + x9*x10
    x12 = 1.0/(x6*x7 + x5*x10)
    x13 = x11*x12
    x14 = x8*c2
    x15 = x9*x14
    x16 = x2*x1
    x17 = x15 + (x16 + (x16 + x15))
    x18 = x11*x13 - x17
    x19 = q_xr - x6
    x20 = q_yr - x5
    x21 = sqrt(x19*x19 + x20*x20)
    x22 = x21 - p_L0
    x23 = 0.5/x21
    x24 = x22*x23
    x25 = 2.0*x19
    x26 = x24*x25
    x27 = v_xr - v_xl
    x28 = v_yr - v_yl
    x29 = 2.0*x20
    x30 = c5 + x24*x29
    x31 = sqrt(q_xl*q_xl + q_yl*q_yl)
    x32 = (x31 - p_L0)*(0.5/x31)
    x33 = q_xl*x32
    x34 = 2.0*x33
    x35 = c5 + 2.0*(q_yl*x32)
    x36 = x26*x1 - (2.0*(x27*x27) + 2.0*(x28*x28)) + x30*x14 - x34*x1 - x35*x14
    x37 = cos(x3)
    x38 = x37*c6
    x39 = v_yl*x38
    x40 = x4*c7
    x41 = 0.5/x6
    x42 = x4*c8
    x43 = x38*x42
    x44 = x41*x43
    x45 = v_xl*x44
    x46 = x45 + (x45 + q_xl*(x41*(c9*(x37*x38) - x42*x40) + x43*(x41*x44/x6)))
    x47 = x7*x34 - (x39 + (x39 - q_yl*x40) - x46) + x35*x10
    x48 = 1.0/x18*(x36 + x13*x47)
    x49 = x1*x48
    x50 = x13*x48 - x12*x47
    x51 = x14*x48
    x52 = -(x18/x17)
    out[0] = v_xl
    out[1] = v_yl
    out[2] = v_xr
    out[3] = v_yr
    out[4] = x49 - (x33*c2 + x7*x50)
    out[5] = x51 - (c1*x35 + x10*x50)
    out[6] = -(x26*c1 + x49)
    out[7] = -(x30*c1 + x51)
    out[8] = x22*(x23*(x25*x44 - x29*x38)) + x50*(q_yl*x38 - q_xl*x44)
    out[9] = -x50
    out[10] = -x48
    out[11] = (x52 if x52 < 1.0 else 1.0)


@njit(error_model="numpy")
def mass_matrix(t, y, p, out):
    """Mass matrix M, row by row. 3 operations."""
    p_eps = p[0]
    p_M = p[1]
    c0 = p_eps*p_eps*(0.5*p_M)
    out[0] = c0
    out[5] = c0
    out[10] = c0
    out[15] = c0


@njit(error_model="numpy")
def forces(t, y, p, out):
    """Forces f of M a = f + G^T lambda. 41 operations."""
    p_eps = p[0]
    p_M = p[1]
    p_L = p[2]
    p_L0 = p[3]
    p_r = p[4]
    p_w = p[5]
    p_g = p[6]
    c0 = p_g*(p_eps*p_eps*(0.5*p_M))
    c1 = p_L*p_L
    q_xl = y[0]
    q_yl = y[1]
    q_xr = y[2]
    q_yr = y[3]
    x0 = sqrt(q_xl*q_xl + q_yl*q_yl)
    x1 = (x0 - p_L0)*(0.5/x0)
    x2 = p_r*sin(t*p_w)
    x3 = q_xr - sqrt(c1 - x2*x2)
    x4 = q_yr - x2
    x5 = sqrt(x3*x3 + x4*x4)
    x6 = (x5 - p_L0)*(0.5/x5)
    out[0] = -(2.0*(q_xl*x1))
    out[1] = -(c0 + 2.0*(q_yl*x1))
    out[2] = -(2.0*(x3*x6))
    out[3] = -(c0 + 2.0*(x4*x6))


@njit(error_model="numpy")
def energy(t, y, p, out):
    """Kinetic and potential energy. 42 operations."""
    p_eps = p[0]
    p_M = p[1]
    p_L = p[2]
    p_L0 = p[3]
    p_r = p[4]
    p_w = p[5]
    p_g = p[6]
    c0 = p_eps*p_eps*(0.5*p_M)
    c1 = 0.5*c0
    c2 = p_L*p_L
    c3 = p_g*c0
    q_xl = y[0]
    q_yl = y[1]
    q_xr = y[2]
    q_yr = y[3]
    v_xl = y[4]
    v_yl = y[5]
    v_xr = y[6]
    v_yr = y[7]
    x0 = sqrt(q_xl*q_xl + q_yl*q_yl) - p_L0
    x1 = p_r*sin(t*p_w)
    x2 = q_xr - sqrt(c2 - x1*x1)
    x3 = q_yr - x1
    x4 = sqrt(x2*x2 + x3*x3) - p_L0
    out[0] = c1*(v_xl*v_xl + v_yl*v_yl) + c1*(v_xr*v_xr + v_yr*v_yr)
    out[1] = 0.5*(x0*x0) + 0.5*(x4*x4) + (q_yl*c3 + q_yr*c3)


@njit(error_model="numpy")
def residual(t, y, p, out):
    """M a - f - G^T lambda, then G a - gamma. 106 operations."""
    p_eps = p[0]
    p_M = p[1]
    p_L = p[2]
    p_L0 = p[3]
    p_r = p[4]
    p_w = p[5]
    p_g = p[6]
    c0 = p_eps*p_eps*(0.5*p_M)
    c1 = p_L*p_L
    c2 = p_g*c0
    c3 = p_r*p_w
    c4 = 2.0*p_r
    c5 = 2.0*c3
    c6 = p_r*(p_w*p_w)
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
    x0 = sqrt(q_xl*q_xl + q_yl*q_yl)
    x1 = (x0 - p_L0)*(0.5/x0)
    x2 = t*p_w
    x3 = sin(x2)
    x4 = p_r*x3
    x5 = sqrt(c1 - x4*x4)
    x6 = 2.0*(q_xr - q_xl)
    x7 = lam_axis_is_rigid*x6
    x8 = 2.0*(q_xl*x1) + a_xl*c0 - (lam_left_spring_is_upright*x5 - x7)
    x9 = 2.0*(q_yr - q_yl)
    x10 = lam_axis_is_rigid*x9
    x11 = c2 + 2.0*(q_yl*x1) + a_yl*c0 - (lam_left_spring_is_upright*x4 - x10)
    x12 = q_xr - x5
    x13 = q_yr - x4
    x14 = sqrt(x12*x12 + x13*x13)
    x15 = (x14 - p_L0)*(0.5/x14)
    x16 = 0.5/x5
    x17 = cos(x2)
    x18 = x17*c3
    x19 = x3*c4
    x20 = x18*x19
    x21 = x16*x20
    x22 = v_xl*x21
    x23 = x3*c6
    x24 = a_xl*x5 - x22 - (x22 + q_xl*(x16*(c5*(x17*x18) - x19*x23) + x20*(x16*x21/x5)))
    x25 = v_yl*x18
    x26 = v_xr - v_xl
    x27 = v_yr - v_yl
    x28 = 2.0*(x26*x26) + x6*(a_xr - a_xl) + (2.0*(x27*x27) + x9*(a_yr - a_yl))
    out[0] = x8
    out[1] = x11
    out[2] = 2.0*(x12*x15) + a_xr*c0 - x7
    out[3] = c2 + 2.0*(x13*x15) + a_yr*c0 - x10
    out[4] = x24 + (x25 - q_yl*x23 + (x25 + a_yl*x4))
    out[5] = x28


@njit(error_model="numpy")
def residual_jacobian(t, y, p, out):
    """Residual derivatives by q, v, a, lambda. 113 operations."""
    p_eps = p[0]
    p_M = p[1]
    p_L = p[2]
    p_L0 = p[3]
    p_r = p[4]
    p_w = p[5]
    c0 = p_eps*p_eps*(0.5*p_M)
    c1 = p_L*p_L
    c2 = p_r*p_w
    c3 = 2.0*p_r
    c4 = 2.0*c2
    c5 = p_r*(p_w*p_w)
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
    x0 = sqrt(q_xl*q_xl + q_yl*q_yl)
    x1 = 2.0*(x0 - p_L0)
    x2 = 0.5/x0
    x3 = 2.0*lam_axis_is_rigid
    x4 = x1*x2 - x3
    x5 = 2.0*q_xl
    x6 = x2*x5
    x7 = x2 - 0.5*(x1*(x2*(1.0/x0)))
    x8 = x5*x7
    x9 = 2.0*q_yl
    x10 = x2*x9
    x11 = t*p_w
    x12 = sin(x11)
    x13 = p_r*x12
    x14 = sqrt(c1 - x13*x13)
    x15 = 2.0*(q_xr - q_xl)
    x16 = x9*x7
    x17 = 2.0*(q_yr - q_yl)
    x18 = q_xr - x14
    x19 = q_yr - x13
    x20 = sqrt(x18*x18 + x19*x19)
    x21 = 2.0*(x20 - p_L0)
    x22 = 0.5/x20
    x23 = x21*x22
    x24 = 2.0*x18
    x25 = x22*x24
    x26 = x22 - 0.5*(x21*(x22*(1.0/x20)))
    x27 = x24*x26
    x28 = 2.0*x19
    x29 = x22*x28
    x30 = -x15
    x31 = x28*x26
    x32 = -x17
    x33 = cos(x11)
    x34 = x33*c2
    x35 = x12*c3
    x36 = x34*x35
    x37 = 0.5/x14
    x38 = x37*x36
    x39 = x33*c4
    x40 = x12*c5
    x41 = 2.0*(a_xr - a_xl)
    x42 = 2.0*(a_yr - a_yl)
    x43 = 2.0*(v_xr - v_xl)
    x44 = x43 + x43
    x45 = 2.0*(v_yr - v_yl)
    x46 = x45 + x45
    out[0] = x4 + x6*x8
    out[1] = x10*x8
    out[2] = x3
    out[8] = c0
    out[12] = -x14
    out[13] = x15
    out[14] = x6*x16
    out[15] = x4 + x10*x16
    out[17] = x3
    out[23] = c0
    out[26] = -x13
    out[27] = x17
    out[28] = x3
    out[30] = x23 + x25*x27 - x3
    out[31] = x29*x27
    out[38] = c0
    out[41] = x30
    out[43] = x3
    out[44] = x25*x31
    out[45] = x23 + x29*x31 - x3
    out[53] = c0
    out[55] = x32
    out[56] = -(x36*(x37*x38/x14) + x37*(x34*x39 - x35*x40))
    out[57] = -x40
    out[60] = -(2.0*x38)
    out[61] = x39
    out[64] = x14
    out[65] = x13
    out[70] = -x41
    out[71] = -x42
    out[72] = x41
    out[73] = x42
    out[74] = -x44
    out[75] = -x46
    out[76] = x44
    out[77] = x46
    out[78] = x30
    out[79] = x32
    out[80] = x15
    out[81] = x17


@njit(error_model="numpy")
def constraint_residual(t, y, p, out):
    """Position residuals, velocity residuals. 38 operations."""
    p_L = p[2]
    p_r = p[4]
    p_w = p[5]
    c0 = p_L*p_L
    c1 = 2.0*p_r
    c2 = p_r*p_w
    q_xl = y[0]
    q_yl = y[1]
    q_xr = y[2]
    q_yr = y[3]
    v_xl = y[4]
    v_yl = y[5]
    v_xr = y[6]
    v_yr = y[7]
    x0 = t*p_w
    x1 = sin(x0)
    x2 = p_r*x1
    x3 = sqrt(c0 - x2*x2)
    x4 = q_xr - q_xl
    x5 = q_yr - q_yl
    x6 = cos(x0)*c2
    out[0] = q_xl*x3 + q_yl*x2
    out[1] = x4*x4 + x5*x5 - c0
    out[2] = v_xl*x3 - c1*(q_xl*(0.5/x3*(x1*x6))) + (v_yl*x2 + q_yl*x6)
    out[3] = 2.0*(x4*(v_xr - v_xl)) + 2.0*(x5*(v_yr - v_yl))


@njit(error_model="numpy")
def constraint_jacobian(t, y, p, out):
    """Constraint Jacobian G, row by row. 13 operations."""
    p_L = p[2]
    p_r = p[4]
    p_w = p[5]
    c0 = p_L*p_L
    q_xl = y[0]
    q_yl = y[1]
    q_xr = y[2]
    q_yr = y[3]
    x0 = p_r*sin(t*p_w)
    x1 = 2.0*(q_xr - q_xl)
    x2 = 2.0*(q_yr - q_yl)
    out[0] = sqrt(c0 - x0*x0)
    out[1] = x0
    out[4] = -x1
    out[5] = -x2
    out[6] = x1
    out[7] = x2


@njit(error_model="numpy")
def gamma(t, y, p, out):
    """Right-hand side of G a = gamma. 46 operations."""
    p_L = p[2]
    p_r = p[4]
    p_w = p[5]
    c0 = p_r*p_w
    c1 = p_r*(p_w*p_w)
    c2 = p_L*p_L
    c3 = 2.0*p_r
    c4 = 2.0*c0
    q_xl = y[0]
    q_yl = y[1]
    v_xl = y[4]
    v_yl = y[5]
    v_xr = y[6]
    v_yr = y[7]
    x0 = t*p_w
    x1 = cos(x0)
    x2 = x1*c0
    x3 = v_yl*x2
    x4 = sin(x0)
    x5 = x4*c1
    x6 = p_r*x4
    x7 = sqrt(c2 - x6*x6)
    x8 = 0.5/x7
    x9 = x4*c3
    x10 = x2*x9
    x11 = x8*x10
    x12 = v_xl*x11
    x13 = x12 + (x12 + q_xl*(x8*(c4*(x1*x2) - x9*x5) + x10*(x8*x11/x7)))
    x14 = v_xr - v_xl
    x15 = v_yr - v_yl
    out[0] = -(x3 + (x3 - q_yl*x5) - x13)
    out[1] = -(2.0*(x14*x14) + 2.0*(x15*x15))


@njit(error_model="numpy")
def project(t, y, p, out):
    """State moved onto the constraints, and the residuals it had. 100 operations."""
    p_eps = p[0]
    p_M = p[1]
    p_L = p[2]
    p_r = p[4]
    p_w = p[5]
    c0 = p_L*p_L
    c1 = 1.0/(p_eps*p_eps*(0.5*p_M))
    c2 = p_r*c1
    c3 = 2.0*c1
    c4 = 2.0*p_r
    c5 = p_r*p_w
    q_xl = y[0]
    q_yl = y[1]
    q_xr = y[2]
    q_yr = y[3]
    v_xl = y[4]
    v_yl = y[5]
    v_xr = y[6]
    v_yr = y[7]
    x0 = t*p_w
    x1 = sin(x0)
    x2 = p_r*x1
    x3 = sqrt(c0 - x2*x2)
    x4 = x3*c1
    x5 = q_xl*x3 + q_yl*x2
    x6 = x1*c2
    x7 = 1.0/(x3*x4 + x2*x6)
    x8 = q_xr - q_xl
    x9 = 2.0*x8
    x10 = q_yr - q_yl
    x11 = 2.0*x10
    x12 = x9*x4 + x11*x6
    x13 = x12*x7
    x14 = x10*c3
    x15 = x11*x14
    x16 = x8*c3
    x17 = x9*x16
    x18 = 1.0/(x12*x13 - (x15 + (x17 + (x17 + x15))))
    x19 = x8*x8 + x10*x10 - c0
    x20 = x18*(x19 + x5*x13)
    x21 = x5*x7 - x13*x20
    x22 = x16*x20
    x23 = q_xl - (x4*x21 + x22)
    x24 = x14*x20
    x25 = q_yl - (x6*x21 + x24)
    x26 = q_xr + x22
    x27 = q_yr + x24
    x28 = cos(x0)*c5
    x29 = v_xl*x3 - c4*(0.5/x3*(x1*x28)*x23) + (v_yl*x2 + x28*x25)
    x30 = 2.0*((v_xr - v_xl)*(x26 - x23)) + 2.0*((v_yr - v_yl)*(x27 - x25))
    x31 = x18*(x30 + x13*x29)
    x32 = x7*x29 - x13*x31
    x33 = x16*x31
    x34 = x14*x31
    out[0] = x23
    out[1] = x25
    out[2] = x26
    out[3] = x27
    out[4] = v_xl - (x4*x32 + x33)
    out[5] = v_yl - (x6*x32 + x34)
    out[6] = v_xr + x33
    out[7] = v_yr + x34
    out[8] = x5
    out[9] = x19
    out[10] = x29
    out[11] = x30


@njit(error_model="numpy")
def poses(t, y, p, out):
    """Per body: position, rotation matrix (body to world). 17 operations."""
    p_L = p[2]
    p_r = p[4]
    p_w = p[5]
    c0 = p_L*p_L
    q_xl = y[0]
    q_yl = y[1]
    q_xr = y[2]
    q_yr = y[3]
    x0 = atan2(q_yr - q_yl, q_xr - q_xl)
    x1 = cos(x0)
    x2 = sin(x0)
    x3 = p_r*sin(t*p_w)
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
    out[36] = sqrt(c0 - x3*x3)
    out[37] = x3
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
    p_L = p[2]
    out[0] = 0.05
    out[1] = 0.05
    out[2] = 0.025
    out[3] = p_L
    out[4] = 0.04


@njit(error_model="numpy")
def marks(t, y, p, out):
    """What a picture shows besides bodies, as `marks` lists it. 7 operations."""
    p_L = p[2]
    p_r = p[4]
    p_w = p[5]
    c0 = p_L*p_L
    q_xl = y[0]
    q_yl = y[1]
    q_xr = y[2]
    q_yr = y[3]
    x0 = p_r*sin(t*p_w)
    out[3] = q_xl
    out[4] = q_yl
    out[6] = sqrt(c0 - x0*x0)
    out[7] = x0
    out[9] = q_xr
    out[10] = q_yr


@njit(error_model="numpy")
def limits(t, y, p, out):
    """Numbers of parameters that have a bound. 3 operations."""
    p_eps = p[0]
    p_M = p[1]
    p_L = p[2]
    c0 = p_eps*p_eps*(0.5*p_M)
    out[0] = c0
    out[1] = p_L


@njit(error_model="numpy")
def time_terms(t, y, p, out):
    """What the equations have of time alone, beyond polynomials. 29 operations."""
    p_L = p[2]
    p_r = p[4]
    p_w = p[5]
    c0 = p_L*p_L
    c1 = p_r*p_w
    c2 = 2.0*p_r
    c3 = 2.0*c1
    c4 = p_r*(p_w*p_w)
    x0 = t*p_w
    x1 = sin(x0)
    x2 = p_r*x1
    x3 = sqrt(c0 - x2*x2)
    x4 = cos(x0)
    x5 = 0.5/x3
    x6 = x4*c1
    x7 = x1*c2
    x8 = x6*x7
    x9 = x5*x8
    out[0] = x1
    out[1] = x3
    out[2] = x4
    out[3] = x9
    out[4] = x5*(c3*(x4*x6) - x7*(x1*c4))
    out[5] = x8*(x5*x9/x3)
    out[6] = x5*(x1*x6)
