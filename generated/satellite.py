"""satellite: equations of motion, written by symgen 0.1.0. Do not edit.

Satellite with a boom on an elliptic orbit: the gradient of gravity holds it upright while it swings
"""

from math import atan2, sqrt

from numba import njit

MODEL = {
    "abi": 1,
    "generator": "symgen 0.1.0",
    "source": "sha256:4af0d38b49cf9aaea91ef7ecac9ac08cdd43bc87df04374902e6499267160b47",
    "name": "satellite",
    "description": "Satellite with a boom on an elliptic orbit: the gradient of gravity holds it upright while it swings",
    "nq": 7,
    "nv": 6,
    "nh": 0,
    "nn": 0,
    "nw": 0,
    "coordinates": [
        {"name": "orbit_x", "unit": "m", "value": 6878000.0, "enforced": True},
        {"name": "orbit_y", "unit": "m", "value": 0.0, "enforced": True},
        {"name": "orbit_z", "unit": "m", "value": 0.0, "enforced": True},
        {"name": "orbit_qw", "unit": "", "value": 0.7071067811865476, "enforced": True},
        {"name": "orbit_qx", "unit": "", "value": 0.0, "enforced": True},
        {"name": "orbit_qy", "unit": "", "value": 0.7071067811865476, "enforced": True},
        {"name": "orbit_qz", "unit": "", "value": 0.0, "enforced": True},
    ],
    "quaternions": [
        3,
    ],
    "rates": [
        {"name": "orbit_vx", "unit": "m/s", "value": 0.0, "enforced": True},
        {"name": "orbit_vy", "unit": "m/s", "value": 7688.433551001098, "enforced": True},
        {"name": "orbit_vz", "unit": "m/s", "value": 0.0, "enforced": True},
        {"name": "orbit_wx", "unit": "rad/s", "value": -0.0008178298271301395, "enforced": True},
        {"name": "orbit_wy", "unit": "rad/s", "value": 0.0003, "enforced": True},
        {"name": "orbit_wz", "unit": "rad/s", "value": 0.0, "enforced": True},
    ],
    "parameters": [
        {"name": "mu", "unit": "m^3/s^2", "value": 398600400000000.0, "doc": ""},
        {"name": "h", "unit": "m", "value": 500000.0, "doc": "lowest height"},
        {"name": "e", "unit": "", "value": 0.02, "doc": "eccentricity"},
        {"name": "boom", "unit": "m", "value": 8.0, "doc": ""},
        {"name": "swing", "unit": "rad/s", "value": 0.0003, "doc": "at the start, in the plane of the orbit and across it"},
    ],
    "inputs": [],
    "constants": [
        {"name": "R", "unit": "m", "value": 6378000.0},
    ],
    "constraints": [],
    "outputs": [
        {"name": "height", "unit": "m"},
        {"name": "lean", "unit": "1"},
    ],
    "events": [],
    "bodies": [
        {"name": "satellite", "planar": False, "shape": "solids", "sizes": 34, "mesh": "", "parts": ["box", "tube", "sphere"]},
        {"name": "earth", "planar": False, "shape": "sphere", "sizes": 1, "mesh": ""},
        {"name": "pointer", "planar": False, "shape": "capsule", "sizes": 2, "mesh": ""},
    ],
    "structure": {
        "conservative": True,
        "time_dependent": False,
        "constant_mass": False,
        "diagonal_mass": False,
        "velocity_dependent": True,
        "separable": False,
    },
    "operations": {
        "rhs": 383,
        "mass_matrix": 75,
        "forces": 289,
        "energy": 159,
        "residual": 311,
        "residual_jacobian": 1647,
        "project": 13,
        "kinematics": 13,
        "poses": 45,
        "shapes": 12,
        "outputs": 40,
        "marks": 0,
        "starts": 7,
        "limits": 42,
    },
    "hoisted": {
        "rhs": 33,
        "mass_matrix": 20,
        "forces": 30,
        "energy": 25,
        "residual": 30,
        "residual_jacobian": 32,
        "poses": 2,
        "shapes": 7,
        "starts": 3,
    },
    "run": {
        "t_end": 11400.0,
        "fps": 0.1,
        "rtol": 1e-10,
    },
    "starts": True,
    "limits": [
        {"name": "bodies.satellite.shape[1].tube[2]", "bound": "positive"},
        {"name": "bodies.satellite.mass", "bound": "zero or more"},
        {"name": "bodies.satellite.inertia[0]", "bound": "zero or more"},
        {"name": "bodies.satellite.inertia[1]", "bound": "zero or more"},
        {"name": "bodies.satellite.inertia[2]", "bound": "zero or more"},
        {"name": "bodies.satellite.inertia", "bound": "a tensor without negative moments", "numbers": 3},
    ],
    "subsystems": [],
    "marks": [
        {"kind": "point", "name": "satellite_point1", "body": "satellite", "numbers": 3},
        {"kind": "pin", "name": "earth", "body": "", "numbers": 6},
    ],
}

@njit(error_model="numpy")
def rhs(t, y, p, out):
    """State derivative: rates, accelerations. 383 operations."""
    p_mu = p[0]
    p_boom = p[3]
    c0 = 0.3308097064230052*p_boom
    c1 = c0 + 76.83558559107746
    c2 = 1.0/c1
    c3 = p_boom + 0.25
    c4 = 0.5*p_boom
    c5 = 0.25 + c4
    c6 = 16.835585591077464*c3 + c0*c5
    c7 = c6/c1
    c8 = c1*c7
    c9 = c5 - c7
    c10 = c7 + -0.25
    c11 = c9*c9
    c12 = c3 - c7
    c13 = 0.00256 + c12*c12
    c14 = c0*(c9*(c10 - c4) + (c11 + 0.0003805)) + (3.05 + 16.835585591077464*(c13 + c12*(c10 - p_boom)))
    c15 = 1.5*p_mu
    c16 = c0*(0.08333333333333333*(p_boom*p_boom) + (0.00019025 + c11))
    c17 = 16.835585591077464*c13
    c18 = 60.0*(c6*c6)/(c1*c1)
    c19 = c16 + (c17 + (c18 + 3.05))
    c20 = 2.0*(c19*c15)
    c21 = 2.5 + (c16 + (c18 + c17))
    c22 = 2.0*(c21*c15)
    c23 = p_mu*c1
    c24 = (c19 + (c21 + c14))*(0.5*p_mu)
    c25 = c2*c8
    c26 = c7*c8
    c27 = c21 + c26
    c28 = c19 + c26
    c29 = c14 - c28
    c30 = c27 - c14
    c31 = 1.0/c14
    c32 = c28 - c27
    q_orbit_x = y[0]
    q_orbit_y = y[1]
    q_orbit_z = y[2]
    q_orbit_qw = y[3]
    q_orbit_qx = y[4]
    q_orbit_qy = y[5]
    q_orbit_qz = y[6]
    v_orbit_vx = y[7]
    v_orbit_vy = y[8]
    v_orbit_vz = y[9]
    v_orbit_wx = y[10]
    v_orbit_wy = y[11]
    v_orbit_wz = y[12]
    x0 = 0.5*v_orbit_wx
    x1 = 0.5*v_orbit_wy
    x2 = 0.5*v_orbit_wz
    x3 = q_orbit_qy + q_orbit_qy
    x4 = q_orbit_qy*x3
    x5 = q_orbit_qz + q_orbit_qz
    x6 = q_orbit_qz*x5
    x7 = 1.0 - (x4 + x6)
    x8 = v_orbit_wx*v_orbit_wz
    x9 = c8*x8
    x10 = q_orbit_qx + q_orbit_qx
    x11 = q_orbit_qy*x10
    x12 = q_orbit_qw*x5
    x13 = x11 - x12
    x14 = v_orbit_wy*v_orbit_wz
    x15 = c8*x14
    x16 = q_orbit_qz*x10
    x17 = q_orbit_qw*x3
    x18 = x16 + x17
    x19 = c8*(v_orbit_wx*v_orbit_wx + v_orbit_wy*v_orbit_wy)
    x20 = q_orbit_qx*x10
    x21 = 1.0 - (x20 + x4)
    x22 = q_orbit_z + x21*c7
    x23 = q_orbit_x + x18*c7
    x24 = q_orbit_qz*x3
    x25 = q_orbit_qw*x10
    x26 = x24 - x25
    x27 = q_orbit_y + x26*c7
    x28 = x21*x22 + (x18*x23 + x26*x27)
    x29 = c14*x28
    x30 = x22*x22 + (x23*x23 + x27*x27)
    x31 = sqrt(x30)
    x32 = x31*x31
    x33 = x31*(x32*x32)
    x34 = 1.0/x33
    x35 = x34*c15
    x36 = x29*x35 + c14*(x28*x35)
    x37 = x24 + x25
    x38 = 1.0 - (x20 + x6)
    x39 = x37*x22 + (x13*x23 + x38*x27)
    x40 = c20*(x34*x39)
    x41 = x16 - x17
    x42 = x11 + x12
    x43 = x41*x22 + (x7*x23 + x42*x27)
    x44 = c22*(x34*x43)
    x45 = x31*x32
    x46 = x30*x31*(x34*((c19*(x39*x39) + (x28*x29 + c21*(x43*x43)))*c15/x33))
    x47 = 0.5/x31*(1.0/x31*(c23/x31)) + (1.5*(x31*(1.0/x45*(c24/x45))) - 2.5*x46)
    x48 = x21*x36 + (x37*x40 + x41*x44) + 2.0*(x22*x47)
    x49 = x26*x36 + (x38*x40 + x42*x44) + 2.0*(x27*x47)
    x50 = x18*x36 + (x13*x40 + x7*x44) + 2.0*(x23*x47)
    x51 = x21*x48 + x26*x49 + x18*x50
    x52 = x37*x48 + x38*x49 + x13*x50
    x53 = x41*x48 + x42*x49 + x7*x50
    x54 = x7*x9 + x13*x15 - x18*x19 + x18*x51 + x13*x52 + x7*x53
    x55 = x13*c25
    x56 = x38*c25
    x57 = x37*c25
    x58 = 1.0/(c27 - x13*c8*x55 - x38*c8*x56 - x37*c8*x57)
    x59 = x22*x40
    x60 = x27*x40
    x61 = x23*x40
    x62 = x22*x36
    x63 = x27*x36
    x64 = x23*x36
    x65 = x14*c29 + x21*x59 + x26*x60 + x18*x61 - x37*x62 - x38*x63 - x13*x64
    x66 = x42*x9 + x38*x15 - x26*x19 + x26*x51 + x38*x52 + x42*x53
    x67 = x41*x9 + x37*x15 - x21*x19 + x21*x51 + x37*x52 + x41*x53
    x68 = x65 - c7*x52 + x54*x55 + x66*x56 + x67*x57
    x69 = x7*c8
    x70 = x42*c8
    x71 = x41*c8
    x72 = x69*x55 + x70*x56 + x71*x57
    x73 = x72*x58
    x74 = x7*c25
    x75 = x42*c25
    x76 = x41*c25
    x77 = x22*x44
    x78 = x27*x44
    x79 = x23*x44
    x80 = x7*x64 + (x42*x63 + (x41*x62 + (x8*c30 - x21*x77 - x26*x78 - x18*x79)))
    x81 = 1.0/(c28 - x69*x74 - x70*x75 - x71*x76 - x72*x73)*(x54*x74 - (x80 + c7*x53) + x66*x75 + x67*x76 + x73*x68)
    x82 = x58*x68 + x73*x81
    x83 = v_orbit_wx*v_orbit_wy*c32 - x41*x59 - x42*x60 - x7*x61 + x37*x77
    out[0] = v_orbit_vx
    out[1] = v_orbit_vy
    out[2] = v_orbit_vz
    out[3] = -(q_orbit_qx*x0 + q_orbit_qy*x1 + q_orbit_qz*x2)
    out[4] = q_orbit_qw*x0 - q_orbit_qz*x1 + q_orbit_qy*x2
    out[5] = q_orbit_qz*x0 + q_orbit_qw*x1 - q_orbit_qx*x2
    out[6] = q_orbit_qx*x1 - q_orbit_qy*x0 + q_orbit_qw*x2
    out[7] = -(c2*x54 + x55*x82 + x74*x81)
    out[8] = -(c2*x66 + x56*x82 + x75*x81)
    out[9] = -(c2*x67 + x57*x82 + x76*x81)
    out[10] = -x82
    out[11] = x81
    out[12] = -(c31*(x83 + x38*x78 + x13*x79))


@njit(error_model="numpy")
def mass_matrix(t, y, p, out):
    """Mass matrix M, row by row. 75 operations."""
    p_boom = p[3]
    c0 = 0.3308097064230052*p_boom
    c1 = c0 + 76.83558559107746
    c2 = p_boom + 0.25
    c3 = 0.5*p_boom
    c4 = 0.25 + c3
    c5 = 16.835585591077464*c2 + c0*c4
    c6 = c5/c1
    c7 = c1*c6
    c8 = c4 - c6
    c9 = c8*c8
    c10 = c0*(0.08333333333333333*(p_boom*p_boom) + (0.00019025 + c9))
    c11 = 60.0*(c5*c5)/(c1*c1)
    c12 = c2 - c6
    c13 = 0.00256 + c12*c12
    c14 = 16.835585591077464*c13
    c15 = c6*c7
    c16 = 2.5 + (c10 + (c11 + c14)) + c15
    c17 = c10 + (c14 + (c11 + 3.05)) + c15
    c18 = c6 + -0.25
    c19 = c0*(c8*(c18 - c3) + (c9 + 0.0003805)) + (3.05 + 16.835585591077464*(c13 + c12*(c18 - p_boom)))
    q_orbit_qw = y[3]
    q_orbit_qx = y[4]
    q_orbit_qy = y[5]
    q_orbit_qz = y[6]
    x0 = q_orbit_qx + q_orbit_qx
    x1 = q_orbit_qy*x0
    x2 = q_orbit_qz + q_orbit_qz
    x3 = q_orbit_qw*x2
    x4 = -((x1 - x3)*c7)
    x5 = q_orbit_qy + q_orbit_qy
    x6 = q_orbit_qz*x2
    x7 = (1.0 - (q_orbit_qy*x5 + x6))*c7
    x8 = -((1.0 - (q_orbit_qx*x0 + x6))*c7)
    x9 = (x1 + x3)*c7
    x10 = -((q_orbit_qz*x5 + q_orbit_qw*x0)*c7)
    x11 = (q_orbit_qz*x0 - q_orbit_qw*x5)*c7
    out[0] = c1
    out[3] = x4
    out[4] = x7
    out[7] = c1
    out[9] = x8
    out[10] = x9
    out[14] = c1
    out[15] = x10
    out[16] = x11
    out[18] = x4
    out[19] = x8
    out[20] = x10
    out[21] = c16
    out[24] = x7
    out[25] = x9
    out[26] = x11
    out[28] = c17
    out[35] = c19


@njit(error_model="numpy")
def forces(t, y, p, out):
    """Forces f of M a = f + G^T lambda. 289 operations."""
    p_mu = p[0]
    p_boom = p[3]
    c0 = 0.3308097064230052*p_boom
    c1 = c0 + 76.83558559107746
    c2 = p_boom + 0.25
    c3 = 0.5*p_boom
    c4 = 0.25 + c3
    c5 = 16.835585591077464*c2 + c0*c4
    c6 = c5/c1
    c7 = c1*c6
    c8 = c4 - c6
    c9 = c6 + -0.25
    c10 = c8*c8
    c11 = c2 - c6
    c12 = 0.00256 + c11*c11
    c13 = c0*(c8*(c9 - c3) + (c10 + 0.0003805)) + (3.05 + 16.835585591077464*(c12 + c11*(c9 - p_boom)))
    c14 = 1.5*p_mu
    c15 = c0*(0.08333333333333333*(p_boom*p_boom) + (0.00019025 + c10))
    c16 = 16.835585591077464*c12
    c17 = 60.0*(c5*c5)/(c1*c1)
    c18 = c15 + (c16 + (c17 + 3.05))
    c19 = 2.0*(c18*c14)
    c20 = 2.5 + (c15 + (c17 + c16))
    c21 = 2.0*(c20*c14)
    c22 = p_mu*c1
    c23 = (c18 + (c20 + c13))*(0.5*p_mu)
    c24 = c6*c7
    c25 = c18 + c24
    c26 = c13 - c25
    c27 = c20 + c24
    c28 = c27 - c13
    c29 = c25 - c27
    q_orbit_x = y[0]
    q_orbit_y = y[1]
    q_orbit_z = y[2]
    q_orbit_qw = y[3]
    q_orbit_qx = y[4]
    q_orbit_qy = y[5]
    q_orbit_qz = y[6]
    v_orbit_wx = y[10]
    v_orbit_wy = y[11]
    v_orbit_wz = y[12]
    x0 = q_orbit_qy + q_orbit_qy
    x1 = q_orbit_qy*x0
    x2 = q_orbit_qz + q_orbit_qz
    x3 = q_orbit_qz*x2
    x4 = 1.0 - (x1 + x3)
    x5 = v_orbit_wx*v_orbit_wz
    x6 = c7*x5
    x7 = q_orbit_qx + q_orbit_qx
    x8 = q_orbit_qy*x7
    x9 = q_orbit_qw*x2
    x10 = x8 - x9
    x11 = v_orbit_wy*v_orbit_wz
    x12 = c7*x11
    x13 = q_orbit_qz*x7
    x14 = q_orbit_qw*x0
    x15 = x13 + x14
    x16 = c7*(v_orbit_wx*v_orbit_wx + v_orbit_wy*v_orbit_wy)
    x17 = q_orbit_qx*x7
    x18 = 1.0 - (x17 + x1)
    x19 = q_orbit_z + x18*c6
    x20 = q_orbit_x + x15*c6
    x21 = q_orbit_qz*x0
    x22 = q_orbit_qw*x7
    x23 = x21 - x22
    x24 = q_orbit_y + x23*c6
    x25 = x18*x19 + (x15*x20 + x23*x24)
    x26 = c13*x25
    x27 = x19*x19 + (x20*x20 + x24*x24)
    x28 = sqrt(x27)
    x29 = x28*x28
    x30 = x28*(x29*x29)
    x31 = 1.0/x30
    x32 = x31*c14
    x33 = x26*x32 + c13*(x25*x32)
    x34 = x21 + x22
    x35 = 1.0 - (x17 + x3)
    x36 = x34*x19 + (x10*x20 + x35*x24)
    x37 = c19*(x31*x36)
    x38 = x13 - x14
    x39 = x8 + x9
    x40 = x38*x19 + (x4*x20 + x39*x24)
    x41 = c21*(x31*x40)
    x42 = x28*x29
    x43 = x27*x28*(x31*((c18*(x36*x36) + (x25*x26 + c20*(x40*x40)))*c14/x30))
    x44 = 0.5/x28*(1.0/x28*(c22/x28)) + (1.5*(x28*(1.0/x42*(c23/x42))) - 2.5*x43)
    x45 = x18*x33 + (x34*x37 + x38*x41) + 2.0*(x19*x44)
    x46 = x23*x33 + (x35*x37 + x39*x41) + 2.0*(x24*x44)
    x47 = x15*x33 + (x10*x37 + x4*x41) + 2.0*(x20*x44)
    x48 = x18*x45 + x23*x46 + x15*x47
    x49 = x34*x45 + x35*x46 + x10*x47
    x50 = x38*x45 + x39*x46 + x4*x47
    x51 = x19*x37
    x52 = x24*x37
    x53 = x20*x37
    x54 = x19*x33
    x55 = x24*x33
    x56 = x20*x33
    x57 = x11*c26 + x18*x51 + x23*x52 + x15*x53 - x34*x54 - x35*x55 - x10*x56
    x58 = x19*x41
    x59 = x24*x41
    x60 = x20*x41
    x61 = x4*x56 + (x39*x55 + (x38*x54 + (x5*c28 - x18*x58 - x23*x59 - x15*x60)))
    x62 = v_orbit_wx*v_orbit_wy*c29 - x38*x51 - x39*x52 - x4*x53 + x34*x58
    out[0] = -(x4*x6 + x10*x12 - x15*x16 + x15*x48 + x10*x49 + x4*x50)
    out[1] = -(x39*x6 + x35*x12 - x23*x16 + x23*x48 + x35*x49 + x39*x50)
    out[2] = -(x38*x6 + x34*x12 - x18*x16 + x18*x48 + x34*x49 + x38*x50)
    out[3] = -(x57 - c6*x49)
    out[4] = -(x61 + c6*x50)
    out[5] = -(x62 + x35*x59 + x10*x60)


@njit(error_model="numpy")
def energy(t, y, p, out):
    """Kinetic and potential energy. 159 operations."""
    p_mu = p[0]
    p_boom = p[3]
    c0 = 0.3308097064230052*p_boom
    c1 = c0 + 76.83558559107746
    c2 = p_boom + 0.25
    c3 = 0.5*p_boom
    c4 = 0.25 + c3
    c5 = 16.835585591077464*c2 + c0*c4
    c6 = c5/c1
    c7 = c1*c6
    c8 = c4 - c6
    c9 = c8*c8
    c10 = c0*(0.08333333333333333*(p_boom*p_boom) + (0.00019025 + c9))
    c11 = 60.0*(c5*c5)/(c1*c1)
    c12 = c2 - c6
    c13 = 0.00256 + c12*c12
    c14 = 16.835585591077464*c13
    c15 = 2.5 + (c10 + (c11 + c14))
    c16 = c6*c7
    c17 = c15 + c16
    c18 = c10 + (c14 + (c11 + 3.05))
    c19 = c18 + c16
    c20 = c6 + -0.25
    c21 = c0*(c8*(c20 - c3) + (c9 + 0.0003805)) + (3.05 + 16.835585591077464*(c13 + c12*(c20 - p_boom)))
    c22 = 1.5*p_mu
    c23 = p_mu*c1
    c24 = (c18 + (c15 + c21))*(0.5*p_mu)
    q_orbit_x = y[0]
    q_orbit_y = y[1]
    q_orbit_z = y[2]
    q_orbit_qw = y[3]
    q_orbit_qx = y[4]
    q_orbit_qy = y[5]
    q_orbit_qz = y[6]
    v_orbit_vx = y[7]
    v_orbit_vy = y[8]
    v_orbit_vz = y[9]
    v_orbit_wx = y[10]
    v_orbit_wy = y[11]
    v_orbit_wz = y[12]
    x0 = c1*(v_orbit_vx*v_orbit_vx) + c1*(v_orbit_vy*v_orbit_vy) + c1*(v_orbit_vz*v_orbit_vz)
    x1 = q_orbit_qy + q_orbit_qy
    x2 = q_orbit_qy*x1
    x3 = q_orbit_qz + q_orbit_qz
    x4 = q_orbit_qz*x3
    x5 = 1.0 - (x2 + x4)
    x6 = q_orbit_qx + q_orbit_qx
    x7 = q_orbit_qy*x6
    x8 = q_orbit_qw*x3
    x9 = x7 + x8
    x10 = q_orbit_qz*x6
    x11 = q_orbit_qw*x1
    x12 = x10 - x11
    x13 = v_orbit_vx*x5 + v_orbit_vy*x9 + v_orbit_vz*x12
    x14 = x7 - x8
    x15 = q_orbit_qx*x6
    x16 = 1.0 - (x15 + x4)
    x17 = q_orbit_qz*x1
    x18 = q_orbit_qw*x6
    x19 = x17 + x18
    x20 = v_orbit_vx*x14 + v_orbit_vy*x16 + v_orbit_vz*x19
    x21 = v_orbit_wx*(v_orbit_wx*c17 - c7*x20) + v_orbit_wy*(v_orbit_wy*c19 + c7*x13)
    x22 = c7*(v_orbit_wy*x13) - c7*(v_orbit_wx*x20) + (x21 + c21*(v_orbit_wz*v_orbit_wz))
    x23 = 1.0 - (x15 + x2)
    x24 = q_orbit_z + x23*c6
    x25 = x10 + x11
    x26 = q_orbit_x + x25*c6
    x27 = x17 - x18
    x28 = q_orbit_y + x27*c6
    x29 = x19*x24 + (x14*x26 + x16*x28)
    x30 = x12*x24 + (x5*x26 + x9*x28)
    x31 = x23*x24 + (x25*x26 + x27*x28)
    x32 = sqrt(x24*x24 + (x26*x26 + x28*x28))
    x33 = x32*x32
    x34 = c22*(c18*(x29*x29) + (c15*(x30*x30) + c21*(x31*x31)))/(x32*(x33*x33))
    out[0] = 0.5*(x0 + x22)
    out[1] = x34 - (c23/x32 + c24/(x32*x33))


@njit(error_model="numpy")
def residual(t, y, p, out):
    """M a - f - G^T lambda, then G a - gamma. 311 operations."""
    p_mu = p[0]
    p_boom = p[3]
    c0 = 0.3308097064230052*p_boom
    c1 = 0.5*p_boom
    c2 = 0.25 + c1
    c3 = p_boom + 0.25
    c4 = 16.835585591077464*c3 + c0*c2
    c5 = c0 + 76.83558559107746
    c6 = c4/c5
    c7 = c2 - c6
    c8 = c6 + -0.25
    c9 = c7*c7
    c10 = c3 - c6
    c11 = 0.00256 + c10*c10
    c12 = c0*(c7*(c8 - c1) + (c9 + 0.0003805)) + (3.05 + 16.835585591077464*(c11 + c10*(c8 - p_boom)))
    c13 = 1.5*p_mu
    c14 = c0*(0.08333333333333333*(p_boom*p_boom) + (0.00019025 + c9))
    c15 = 16.835585591077464*c11
    c16 = 60.0*(c4*c4)/(c5*c5)
    c17 = c14 + (c15 + (c16 + 3.05))
    c18 = 2.0*(c17*c13)
    c19 = 2.5 + (c14 + (c16 + c15))
    c20 = 2.0*(c19*c13)
    c21 = p_mu*c5
    c22 = (c17 + (c19 + c12))*(0.5*p_mu)
    c23 = c5*c6
    c24 = c6*c23
    c25 = c17 + c24
    c26 = c12 - c25
    c27 = c19 + c24
    c28 = c27 - c12
    c29 = c25 - c27
    q_orbit_x = y[0]
    q_orbit_y = y[1]
    q_orbit_z = y[2]
    q_orbit_qw = y[3]
    q_orbit_qx = y[4]
    q_orbit_qy = y[5]
    q_orbit_qz = y[6]
    v_orbit_wx = y[10]
    v_orbit_wy = y[11]
    v_orbit_wz = y[12]
    a_orbit_vx = y[13]
    a_orbit_vy = y[14]
    a_orbit_vz = y[15]
    a_orbit_wx = y[16]
    a_orbit_wy = y[17]
    a_orbit_wz = y[18]
    x0 = q_orbit_qy + q_orbit_qy
    x1 = q_orbit_qy*x0
    x2 = q_orbit_qz + q_orbit_qz
    x3 = q_orbit_qz*x2
    x4 = 1.0 - (x1 + x3)
    x5 = q_orbit_qx + q_orbit_qx
    x6 = q_orbit_qz*x5
    x7 = q_orbit_qw*x0
    x8 = x6 - x7
    x9 = q_orbit_qx*x5
    x10 = 1.0 - (x9 + x1)
    x11 = q_orbit_z + x10*c6
    x12 = x6 + x7
    x13 = q_orbit_x + x12*c6
    x14 = q_orbit_qz*x0
    x15 = q_orbit_qw*x5
    x16 = x14 - x15
    x17 = q_orbit_y + x16*c6
    x18 = x10*x11 + (x12*x13 + x16*x17)
    x19 = c12*x18
    x20 = x11*x11 + (x13*x13 + x17*x17)
    x21 = sqrt(x20)
    x22 = x21*x21
    x23 = x21*(x22*x22)
    x24 = 1.0/x23
    x25 = x24*c13
    x26 = x19*x25 + c12*(x18*x25)
    x27 = x14 + x15
    x28 = q_orbit_qy*x5
    x29 = q_orbit_qw*x2
    x30 = x28 - x29
    x31 = 1.0 - (x9 + x3)
    x32 = x27*x11 + (x30*x13 + x31*x17)
    x33 = c18*(x24*x32)
    x34 = x28 + x29
    x35 = x8*x11 + (x4*x13 + x34*x17)
    x36 = c20*(x24*x35)
    x37 = x21*x22
    x38 = x20*x21*(x24*((c17*(x32*x32) + (x18*x19 + c19*(x35*x35)))*c13/x23))
    x39 = 0.5/x21*(1.0/x21*(c21/x21)) + (1.5*(x21*(1.0/x37*(c22/x37))) - 2.5*x38)
    x40 = x10*x26 + (x27*x33 + x8*x36) + 2.0*(x11*x39)
    x41 = x16*x26 + (x31*x33 + x34*x36) + 2.0*(x17*x39)
    x42 = x12*x26 + (x30*x33 + x4*x36) + 2.0*(x13*x39)
    x43 = x8*x40 + x34*x41 + x4*x42
    x44 = x27*x40 + x31*x41 + x30*x42
    x45 = x10*x40 + x16*x41 + x12*x42
    x46 = v_orbit_wx*v_orbit_wz
    x47 = c23*(a_orbit_wy + x46)
    x48 = v_orbit_wy*v_orbit_wz
    x49 = c23*(x48 - a_orbit_wx)
    x50 = c23*(v_orbit_wx*v_orbit_wx + v_orbit_wy*v_orbit_wy)
    x51 = x30*x44 + (x12*x45 + (a_orbit_vx*c5 + (x4*x47 + x30*x49 - x12*x50)))
    x52 = x31*x44 + (x16*x45 + (a_orbit_vy*c5 + (x34*x47 + x31*x49 - x16*x50)))
    x53 = x27*x44 + (x10*x45 + (a_orbit_vz*c5 + (x8*x47 + x27*x49 - x10*x50)))
    x54 = x13*x33
    x55 = x17*x33
    x56 = x11*x33
    x57 = x48*c26 + a_orbit_wx*c27 - c23*(a_orbit_vx*x30 + a_orbit_vy*x31 + a_orbit_vz*x27)
    x58 = x11*x26
    x59 = x17*x26
    x60 = x13*x26
    x61 = x12*x54 + (x16*x55 + (x10*x56 + x57)) - x27*x58 - x31*x59 - x30*x60
    x62 = x46*c28 + a_orbit_wy*c25 + c23*(a_orbit_vx*x4 + a_orbit_vy*x34 + a_orbit_vz*x8)
    x63 = x11*x36
    x64 = x17*x36
    x65 = x13*x36
    x66 = x4*x60 + (x34*x59 + (x8*x58 + (x62 - x10*x63 - x16*x64 - x12*x65)))
    x67 = v_orbit_wx*v_orbit_wy*c29 + a_orbit_wz*c12 - x8*x56 - x34*x55
    out[0] = x4*x43 + x51
    out[1] = x34*x43 + x52
    out[2] = x8*x43 + x53
    out[3] = x61 - c6*x44
    out[4] = c6*x43 + x66
    out[5] = x30*x65 + (x31*x64 + (x27*x63 + (x67 - x4*x54)))


@njit(error_model="numpy")
def residual_jacobian(t, y, p, out):
    """Residual derivatives by q, v, a, lambda. 1647 operations."""
    p_mu = p[0]
    p_boom = p[3]
    c0 = p_boom + 0.25
    c1 = 0.3308097064230052*p_boom
    c2 = 0.5*p_boom
    c3 = 0.25 + c2
    c4 = 16.835585591077464*c0 + c1*c3
    c5 = c1 + 76.83558559107746
    c6 = c4/c5
    c7 = 1.5*p_mu
    c8 = c3 - c6
    c9 = c6 + -0.25
    c10 = c8*c8
    c11 = c0 - c6
    c12 = 0.00256 + c11*c11
    c13 = c1*(c8*(c9 - c2) + (c10 + 0.0003805)) + (3.05 + 16.835585591077464*(c12 + c11*(c9 - p_boom)))
    c14 = c1*(0.08333333333333333*(p_boom*p_boom) + (0.00019025 + c10))
    c15 = 16.835585591077464*c12
    c16 = 60.0*(c4*c4)/(c5*c5)
    c17 = c14 + (c15 + (c16 + 3.05))
    c18 = 2.5 + (c14 + (c16 + c15))
    c19 = (c17 + (c18 + c13))*(0.5*p_mu)
    c20 = p_mu*c5
    c21 = c17*c7
    c22 = c18*c7
    c23 = c5*c6
    c24 = 2.0*c23
    c25 = c6*c23
    c26 = c18 + c25
    c27 = c17 + c25
    c28 = c13 + (c26 + c27)
    c29 = c28 - 2.0*c27
    c30 = c28 - 2.0*c13
    c31 = c28 - 2.0*c26
    q_orbit_x = y[0]
    q_orbit_y = y[1]
    q_orbit_z = y[2]
    q_orbit_qw = y[3]
    q_orbit_qx = y[4]
    q_orbit_qy = y[5]
    q_orbit_qz = y[6]
    v_orbit_wx = y[10]
    v_orbit_wy = y[11]
    v_orbit_wz = y[12]
    a_orbit_vx = y[13]
    a_orbit_vy = y[14]
    a_orbit_vz = y[15]
    a_orbit_wx = y[16]
    a_orbit_wy = y[17]
    x0 = q_orbit_qx + q_orbit_qx
    x1 = q_orbit_qz*x0
    x2 = q_orbit_qy + q_orbit_qy
    x3 = q_orbit_qw*x2
    x4 = x1 + x3
    x5 = q_orbit_qx*x0
    x6 = q_orbit_qy*x2
    x7 = 1.0 - (x5 + x6)
    x8 = q_orbit_z + x7*c6
    x9 = q_orbit_x + x4*c6
    x10 = q_orbit_qz*x2
    x11 = q_orbit_qw*x0
    x12 = x10 - x11
    x13 = q_orbit_y + x12*c6
    x14 = x8*x8 + (x9*x9 + x13*x13)
    x15 = sqrt(x14)
    x16 = x15*x15
    x17 = x15*(x16*x16)
    x18 = 1.0/x17
    x19 = x18*c7
    x20 = q_orbit_qz + q_orbit_qz
    x21 = q_orbit_qz*x20
    x22 = 1.0 - (x6 + x21)
    x23 = q_orbit_qy*x0
    x24 = q_orbit_qw*x20
    x25 = x23 - x24
    x26 = x22*x22 + x25*x25 + x4*x4
    x27 = x23 + x24
    x28 = 1.0 - (x5 + x21)
    x29 = x22*x27 + x25*x28 + x4*x12
    x30 = x1 - x3
    x31 = x10 + x11
    x32 = x22*x30 + x25*x31 + x4*x7
    x33 = x4*x26 + x12*x29 + x7*x32
    x34 = c13*x33
    x35 = x7*x8
    x36 = x4*x9
    x37 = x12*x13
    x38 = x35 + (x36 + x37)
    x39 = c13*x38
    x40 = 2.5*(x14*x15)
    x41 = 2.0*x9
    x42 = 2.0*x13
    x43 = 2.0*x8
    x44 = x41*x26 + x42*x29 + x43*x32
    x45 = x40*x44
    x46 = x18*x45/x17
    x47 = c7*x46
    x48 = x19*x34 - x39*x47 + c13*(x19*x33 - x38*x47)
    x49 = 1.5*x15
    x50 = x15*x16
    x51 = 1.0/x50
    x52 = c19/x50
    x53 = x51*x52
    x54 = x31*x8
    x55 = x25*x9
    x56 = x28*x13
    x57 = x54 + (x55 + x56)
    x58 = x30*x8
    x59 = x22*x9
    x60 = x27*x13
    x61 = x58 + (x59 + x60)
    x62 = (c17*(x57*x57) + (x38*x39 + c18*(x61*x61)))*c7/x17
    x63 = x18*x62
    x64 = 0.5/x15
    x65 = 1.0/x15
    x66 = c20/x15
    x67 = x65*x66
    x68 = x49*x53 - x40*x63 + x64*x67
    x69 = x18*c21
    x70 = x25*x26 + x28*x29 + x31*x32
    x71 = 2.0*x57
    x72 = 2.0*(x69*x70) - c21*(x71*x46)
    x73 = x18*c22
    x74 = x22*x26 + x27*x29 + x30*x32
    x75 = 2.0*x61
    x76 = 2.0*(x73*x74) - c22*(x75*x46)
    x77 = x64*x44
    x78 = 1.5*(x53*x44) - x64*(x67*x44/x15) - x66*(x65*x77/x15) - x65*(x66*x77/x15)
    x79 = c7*(x39*x33 + x38*x34 + c18*(x75*x74) + c17*(x71*x70)) - x62*x45
    x80 = x49*x44
    x81 = x40*(x62*x46 - x18*(x79/x17)) - 2.5*(x49*(x63*x44)) - x49*(x52*(x51*x80/x50) + x51*(x52*x80/x50))
    x82 = x64*x78 + x81
    x83 = x4*x48 + (2.0*(x68*x26) + x25*x72 + x22*x76) + x41*x82
    x84 = 2.0*(x68*x29)
    x85 = x12*x48 + (x84 + x28*x72 + x27*x76) + x42*x82
    x86 = 2.0*(x68*x32)
    x87 = x7*x48 + (x86 + x31*x72 + x30*x76) + x43*x82
    x88 = c23*(v_orbit_wx*v_orbit_wx + v_orbit_wy*v_orbit_wy)
    x89 = c23*(a_orbit_wy + v_orbit_wx*v_orbit_wz)
    x90 = 2.0*(x22*x88 + x4*x89)
    x91 = c23*(v_orbit_wy*v_orbit_wz - a_orbit_wx)
    x92 = 2.0*(x25*x88 + x4*x91)
    x93 = 2.0*(x25*x89 - x22*x91)
    x94 = x39*x19 + c13*(x38*x19)
    x95 = x71*x69
    x96 = x75*x73
    x97 = x42*x68 + (x12*x94 + (x28*x95 + x27*x96))
    x98 = x29*x96
    x99 = x22*x97 + x98 + x13*x76
    x100 = x41*x68 + (x4*x94 + (x25*x95 + x22*x96))
    x101 = x25*x100
    x102 = x43*x68 + (x7*x94 + (x31*x95 + x30*x96))
    x103 = x31*x102
    x104 = x28*x97
    x105 = x103 + x104 + x101
    x106 = x101 + x105 + x26*x95 + x9*x72
    x107 = x99 - x106
    x108 = x4*x100
    x109 = x7*x102
    x110 = x12*x97
    x111 = x109 + x110 + x108
    x112 = x9*x48 + (x94*x26 + (x108 + x111)) + c6*x83
    x113 = x32*x96
    x114 = x22*x102 + x113 + x8*x76
    x115 = x112 - x114
    x116 = x32*x95
    x117 = x25*x102 + x116 + x8*x72
    x118 = x94*x29
    x119 = x13*x48 + (x118 + x4*x97) + c6*x85
    x120 = x117 - x119
    x121 = q_orbit_qy*x90 - q_orbit_qx*x92 - q_orbit_qz*x93 + (x20*x107 + x2*x115 + x0*x120)
    x122 = x114 + x112
    x123 = x106 + x99
    x124 = x29*x95
    x125 = x25*x97 + x124 + x13*x72
    x126 = x94*x32
    x127 = x8*x48 + (x126 + x4*x102) + c6*x87
    x128 = x125 + x127
    x129 = q_orbit_qw*x120 + q_orbit_qz*x122 + q_orbit_qy*x123 - q_orbit_qx*x128
    x130 = q_orbit_qw*x92 + q_orbit_qz*x90 + q_orbit_qy*x93 + (x129 + (x129 - x0*x128))
    x131 = x117 + x119
    x132 = x22*x100
    x133 = x30*x102
    x134 = x27*x97
    x135 = x133 + x134 + x132
    x136 = x132 + x135 + x26*x96 + x9*x76
    x137 = x136 + x127
    x138 = q_orbit_qw*x115 + q_orbit_qz*x131 - q_orbit_qy*x137
    x139 = q_orbit_qz*x92 - q_orbit_qw*x90 - q_orbit_qx*x93 + (x138 + (x0*x123 - x2*x137 + x138))
    x140 = x125 + x136
    x141 = q_orbit_qw*x107 - q_orbit_qz*x140
    x142 = q_orbit_qw*x93 - (q_orbit_qy*x92 + q_orbit_qx*x90) + (x141 + (x2*x131 + x0*x122 - x20*x140 + x141))
    x143 = v_orbit_wz*c23
    x144 = v_orbit_wx*c24
    x145 = v_orbit_wy*c24
    x146 = x144 - v_orbit_wx*c23
    x147 = x145 - v_orbit_wy*c23
    x148 = -(x25*c23)
    x149 = x22*c23
    x150 = x27*x27 + x28*x28 + x12*x12
    x151 = x27*x30 + x28*x31 + x12*x7
    x152 = x4*x29 + x12*x150 + x7*x151
    x153 = c13*x152
    x154 = x41*x29 + x42*x150 + x43*x151
    x155 = x40*x154
    x156 = x18*x155/x17
    x157 = c7*x156
    x158 = x19*x153 - x39*x157 + c13*(x19*x152 - x38*x157)
    x159 = x25*x29 + x28*x150 + x31*x151
    x160 = 2.0*(x69*x159) - c21*(x71*x156)
    x161 = x22*x29 + x27*x150 + x30*x151
    x162 = 2.0*(x73*x161) - c22*(x75*x156)
    x163 = x64*x154
    x164 = 1.5*(x53*x154) - x64*(x67*x154/x15) - x66*(x65*x163/x15) - x65*(x66*x163/x15)
    x165 = c7*(x39*x152 + x38*x153 + c18*(x75*x161) + c17*(x71*x159)) - x62*x155
    x166 = x49*x154
    x167 = x40*(x62*x156 - x18*(x165/x17)) - 2.5*(x49*(x63*x154)) - x49*(x52*(x51*x166/x50) + x51*(x52*x166/x50))
    x168 = x64*x164 + x167
    x169 = x4*x158 + (x84 + x25*x160 + x22*x162) + x41*x168
    x170 = x12*x158 + (2.0*(x68*x150) + x28*x160 + x27*x162) + x42*x168
    x171 = 2.0*(x68*x151)
    x172 = x7*x158 + (x171 + x31*x160 + x30*x162) + x43*x168
    x173 = 2.0*(x27*x88 + x12*x89)
    x174 = 2.0*(x28*x88 + x12*x91)
    x175 = 2.0*(x28*x89 - x27*x91)
    x176 = x134 + x135 + x150*x96 + x13*x162
    x177 = x124 + x28*x100 + x9*x160
    x178 = x176 - x177
    x179 = x9*x158 + (x118 + x12*x100) + c6*x169
    x180 = x151*x96
    x181 = x27*x102 + x180 + x8*x162
    x182 = x179 - x181
    x183 = x151*x95
    x184 = x28*x102 + x183 + x8*x160
    x185 = x13*x158 + (x94*x150 + (x110 + x111)) + c6*x170
    x186 = x184 - x185
    x187 = q_orbit_qy*x173 - q_orbit_qx*x174 - q_orbit_qz*x175 + (x20*x178 + x2*x182 + x0*x186)
    x188 = x181 + x179
    x189 = x177 + x176
    x190 = x104 + x105 + x150*x95 + x13*x160
    x191 = x94*x151
    x192 = x8*x158 + (x191 + x12*x102) + c6*x172
    x193 = x190 + x192
    x194 = q_orbit_qw*x186 + q_orbit_qz*x188 + q_orbit_qy*x189 - q_orbit_qx*x193
    x195 = q_orbit_qw*x174 + q_orbit_qz*x173 + q_orbit_qy*x175 + (x194 + (x194 - x0*x193))
    x196 = x184 + x185
    x197 = x98 + x27*x100 + x9*x162
    x198 = x197 + x192
    x199 = q_orbit_qw*x182 + q_orbit_qz*x196 - q_orbit_qy*x198
    x200 = q_orbit_qz*x174 - q_orbit_qw*x173 - q_orbit_qx*x175 + (x199 + (x0*x189 - x2*x198 + x199))
    x201 = x190 + x197
    x202 = q_orbit_qw*x178 - q_orbit_qz*x201
    x203 = q_orbit_qw*x175 - (q_orbit_qy*x174 + q_orbit_qx*x173) + (x202 + (x2*x196 + x0*x188 - x20*x201 + x202))
    x204 = -(x28*c23)
    x205 = x27*c23
    x206 = x30*x30 + x31*x31 + x7*x7
    x207 = x4*x32 + x12*x151 + x7*x206
    x208 = c13*x207
    x209 = x41*x32 + x42*x151 + x43*x206
    x210 = x40*x209
    x211 = x18*x210/x17
    x212 = c7*x211
    x213 = x19*x208 - x39*x212 + c13*(x19*x207 - x38*x212)
    x214 = x25*x32 + x28*x151 + x31*x206
    x215 = 2.0*(x69*x214) - c21*(x71*x211)
    x216 = x22*x32 + x27*x151 + x30*x206
    x217 = 2.0*(x73*x216) - c22*(x75*x211)
    x218 = x64*x209
    x219 = 1.5*(x53*x209) - x64*(x67*x209/x15) - x66*(x65*x218/x15) - x65*(x66*x218/x15)
    x220 = c7*(x39*x207 + x38*x208 + c18*(x75*x216) + c17*(x71*x214)) - x62*x210
    x221 = x49*x209
    x222 = x40*(x62*x211 - x18*(x220/x17)) - 2.5*(x49*(x63*x209)) - x49*(x52*(x51*x221/x50) + x51*(x52*x221/x50))
    x223 = x64*x219 + x222
    x224 = x4*x213 + (x86 + x25*x215 + x22*x217) + x41*x223
    x225 = x12*x213 + (x171 + x28*x215 + x27*x217) + x42*x223
    x226 = x7*x213 + (2.0*(x68*x206) + x31*x215 + x30*x217) + x43*x223
    x227 = 2.0*(x30*x88 + x7*x89)
    x228 = 2.0*(x31*x88 + x7*x91)
    x229 = 2.0*(x31*x89 - x30*x91)
    x230 = x180 + x30*x97 + x13*x217
    x231 = x116 + x31*x100 + x9*x215
    x232 = x230 - x231
    x233 = x9*x213 + (x126 + x7*x100) + c6*x224
    x234 = x133 + x135 + x206*x96 + x8*x217
    x235 = x233 - x234
    x236 = x103 + x105 + x206*x95 + x8*x215
    x237 = x13*x213 + (x191 + x7*x97) + c6*x225
    x238 = x236 - x237
    x239 = q_orbit_qy*x227 - q_orbit_qx*x228 - q_orbit_qz*x229 + (x20*x232 + x2*x235 + x0*x238)
    x240 = x234 + x233
    x241 = x231 + x230
    x242 = x183 + x31*x97 + x13*x215
    x243 = x8*x213 + (x94*x206 + (x109 + x111)) + c6*x226
    x244 = x242 + x243
    x245 = q_orbit_qw*x238 + q_orbit_qz*x240 + q_orbit_qy*x241 - q_orbit_qx*x244
    x246 = q_orbit_qw*x228 + q_orbit_qz*x227 + q_orbit_qy*x229 + (x245 + (x245 - x0*x244))
    x247 = x236 + x237
    x248 = x113 + x30*x100 + x9*x217
    x249 = x248 + x243
    x250 = q_orbit_qw*x235 + q_orbit_qz*x247 - q_orbit_qy*x249
    x251 = q_orbit_qz*x228 - q_orbit_qw*x227 - q_orbit_qx*x229 + (x250 + (x0*x241 - x2*x249 + x250))
    x252 = x242 + x248
    x253 = q_orbit_qw*x232 - q_orbit_qz*x252
    x254 = q_orbit_qw*x229 - (q_orbit_qy*x228 + q_orbit_qx*x227) + (x253 + (x2*x247 + x0*x240 - x20*x252 + x253))
    x255 = -(x31*c23)
    x256 = x30*c23
    x257 = x25*c6
    x258 = x28*c6
    x259 = x31*c6
    x260 = x41*x257 + x42*x258 + x43*x259
    x261 = x40*x260
    x262 = x18*x261/x17
    x263 = c7*x262
    x264 = x54 + (x56 + (x55 + x4*x257) + x12*x258) + x7*x259
    x265 = c13*x264
    x266 = x39*x263 - x19*x265 + c13*(x38*x263 - x19*x264)
    x267 = x35 + (x37 + (x36 - x25*x257) - x28*x258) - x31*x259
    x268 = 2.0*(x69*x267) + c21*(x71*x262)
    x269 = x22*x257 + x27*x258 + x30*x259
    x270 = c22*(x75*x262) - 2.0*(x73*x269)
    x271 = x4*x266 + (x4*x95 - x25*x94 - 2.0*(x68*x257) + x25*x268 + x22*x270)
    x272 = x64*x260
    x273 = x64*(x67*x260/x15) - 1.5*(x53*x260) + x66*(x65*x272/x15) + x65*(x66*x272/x15)
    x274 = x49*x260
    x275 = c7*(c17*(x71*x267) - (x39*x264 + x38*x265 + c18*(x75*x269))) + x62*x261
    x276 = x49*(x52*(x51*x274/x50) + x51*(x52*x274/x50)) + (2.5*(x49*(x63*x260)) - x40*(x62*x262 + x18*(x275/x17)))
    x277 = x64*x273 + x276
    x278 = x271 + x41*x277
    x279 = x12*x266 + (x12*x95 - x28*x94 - 2.0*(x68*x258) + x28*x268 + x27*x270)
    x280 = x279 + x42*x277
    x281 = x7*x266 + (x7*x95 - x31*x94 - 2.0*(x68*x259) + x31*x268 + x30*x270)
    x282 = x281 + x43*x277
    x283 = x13*x270 - x258*x96
    x284 = x9*x94 + c6*x100
    x285 = x9*x268 - (x284 + x257*x95)
    x286 = x283 - x285
    x287 = x9*x95
    x288 = x9*x266 + (x287 - x94*x257) + c6*x278
    x289 = x8*x270 - x259*x96
    x290 = x288 - x289
    x291 = x8*x94 + c6*x102
    x292 = x8*x268 - (x291 + x259*x95)
    x293 = x13*x95
    x294 = x13*x266 + (x293 - x94*x258) + c6*x280
    x295 = x292 - x294
    x296 = (a_orbit_vx*x4 + a_orbit_vy*x12 + a_orbit_vz*x7)*c24
    x297 = q_orbit_qx*x296
    x298 = (a_orbit_vx*x22 + a_orbit_vy*x27 + a_orbit_vz*x30)*c24
    x299 = x289 + x288
    x300 = x285 + x283
    x301 = x13*x94 + c6*x97
    x302 = x13*x268 - (x301 + x258*x95)
    x303 = x8*x95
    x304 = x8*x266 + (x303 - x94*x259) + c6*x282
    x305 = x302 + x304
    x306 = q_orbit_qw*x295 + q_orbit_qz*x299 + q_orbit_qy*x300 - q_orbit_qx*x305
    x307 = q_orbit_qw*x296
    x308 = x292 + x294
    x309 = x9*x270 - x257*x96
    x310 = x309 + x304
    x311 = q_orbit_qw*x290 + q_orbit_qz*x308 - q_orbit_qy*x310
    x312 = q_orbit_qz*x296
    x313 = x302 + x309
    x314 = q_orbit_qw*x286 - q_orbit_qz*x313
    x315 = q_orbit_qy*x296
    x316 = x314 + (x2*x308 + x0*x299 - x20*x313 + x314) + (x315 + q_orbit_qw*x298)
    x317 = x22*c6
    x318 = x27*c6
    x319 = x30*c6
    x320 = x58 + (x60 + (x59 + x4*x317) + x12*x318) + x7*x319
    x321 = c13*x320
    x322 = x41*x317 + x42*x318 + x43*x319
    x323 = x40*x322
    x324 = x18*x323/x17
    x325 = c7*x324
    x326 = x19*x321 - x39*x325 + c13*(x19*x320 - x38*x325)
    x327 = x25*x317 + x28*x318 + x31*x319
    x328 = 2.0*(x69*x327) - c21*(x71*x324)
    x329 = x22*x317 - x36 - x37 + x27*x318 - x35 + x30*x319
    x330 = 2.0*(x73*x329) - c22*(x75*x324)
    x331 = x4*x326 + (2.0*(x68*x317) + (x22*x94 - x4*x96) + x25*x328 + x22*x330)
    x332 = x64*x322
    x333 = 1.5*(x53*x322) - x64*(x67*x322/x15) - x66*(x65*x332/x15) - x65*(x66*x332/x15)
    x334 = c7*(x39*x320 + x38*x321 + c18*(x75*x329) + c17*(x71*x327)) - x62*x323
    x335 = x49*x322
    x336 = x40*(x62*x324 - x18*(x334/x17)) - 2.5*(x49*(x63*x322)) - x49*(x52*(x51*x335/x50) + x51*(x52*x335/x50))
    x337 = x64*x333 + x336
    x338 = x331 + x41*x337
    x339 = x12*x326 + (2.0*(x68*x318) + (x27*x94 - x12*x96) + x28*x328 + x27*x330)
    x340 = x339 + x42*x337
    x341 = x7*x326 + (2.0*(x68*x319) + (x30*x94 - x7*x96) + x31*x328 + x30*x330)
    x342 = x341 + x43*x337
    x343 = x301 + x318*x96 + x13*x330
    x344 = x317*x95 + x9*x328
    x345 = x343 - x344
    x346 = x9*x96
    x347 = x9*x326 + (x94*x317 - x346) + c6*x338
    x348 = x291 + x319*x96 + x8*x330
    x349 = x347 - x348
    x350 = x319*x95 + x8*x328
    x351 = x13*x96
    x352 = x13*x326 + (x94*x318 - x351) + c6*x340
    x353 = x350 - x352
    x354 = (a_orbit_vx*x25 + a_orbit_vy*x28 + a_orbit_vz*x31)*c24
    x355 = x348 + x347
    x356 = x344 + x343
    x357 = x318*x95 + x13*x328
    x358 = x8*x96
    x359 = x8*x326 + (x94*x319 - x358) + c6*x342
    x360 = x357 + x359
    x361 = q_orbit_qw*x353 + q_orbit_qz*x355 + q_orbit_qy*x356 - q_orbit_qx*x360
    x362 = x350 + x352
    x363 = x284 + x317*x96 + x9*x330
    x364 = x363 + x359
    x365 = q_orbit_qw*x349 + q_orbit_qz*x362 - q_orbit_qy*x364
    x366 = x357 + x363
    x367 = q_orbit_qw*x345 - q_orbit_qz*x366
    x368 = x367 + (x2*x362 + x0*x355 - x20*x366 + x367) + (q_orbit_qw*x354 - x297)
    x369 = 2.0*(x61*x69)
    x370 = 2.0*(x57*x73)
    x371 = x40*(x18*(c7*(c18*(x57*x75) - c17*(x61*x71))/x17))
    x372 = x25*x96 - x22*x95 - x25*x369 + x22*x370 - x41*x371
    x373 = x28*x96 - x27*x95 - x28*x369 + x27*x370 - x42*x371
    x374 = x31*x96 - x30*x95 - x31*x369 + x30*x370 - x43*x371
    x375 = x13*x370 - x293
    x376 = x346 - x9*x369
    x377 = x375 - x376
    x378 = c6*x372
    x379 = x8*x370 - x303
    x380 = x378 - x379
    x381 = x358 - x8*x369
    x382 = c6*x373
    x383 = x381 - x382
    x384 = x379 + x378
    x385 = x376 + x375
    x386 = x351 - x13*x369
    x387 = c6*x374
    x388 = x386 + x387
    x389 = q_orbit_qw*x383 + q_orbit_qz*x384 + q_orbit_qy*x385 - q_orbit_qx*x388
    x390 = x381 + x382
    x391 = x9*x370 - x287
    x392 = x391 + x387
    x393 = q_orbit_qw*x380 + q_orbit_qz*x390 - q_orbit_qy*x392
    x394 = x386 + x391
    x395 = q_orbit_qw*x377 - q_orbit_qz*x394
    out[0] = x83
    out[1] = x85
    out[2] = x87
    out[3] = x121
    out[4] = x130
    out[5] = x139
    out[6] = x142
    out[10] = x22*x143 - x4*x144
    out[11] = x25*x143 - x4*x145
    out[12] = x22*x146 + x25*x147
    out[13] = c5
    out[16] = x148
    out[17] = x149
    out[19] = x169
    out[20] = x170
    out[21] = x172
    out[22] = x187
    out[23] = x195
    out[24] = x200
    out[25] = x203
    out[29] = x27*x143 - x12*x144
    out[30] = x28*x143 - x12*x145
    out[31] = x27*x146 + x28*x147
    out[33] = c5
    out[35] = x204
    out[36] = x205
    out[38] = x224
    out[39] = x225
    out[40] = x226
    out[41] = x239
    out[42] = x246
    out[43] = x251
    out[44] = x254
    out[48] = x30*x143 - x7*x144
    out[49] = x31*x143 - x7*x145
    out[50] = x30*x146 + x31*x147
    out[53] = c5
    out[54] = x255
    out[55] = x256
    out[57] = x278
    out[58] = x280
    out[59] = x282
    out[60] = x20*x286 + x2*x290 + x0*x295 + (x297 - q_orbit_qz*x298)
    out[61] = x306 + (x306 - x0*x305) + (q_orbit_qy*x298 - x307)
    out[62] = x311 + (x0*x300 - x2*x310 + x311) - (x312 + q_orbit_qx*x298)
    out[63] = x316
    out[68] = v_orbit_wz*c29 - v_orbit_wz*c26
    out[69] = v_orbit_wy*c26 - v_orbit_wy*c30
    out[70] = x148
    out[71] = x204
    out[72] = x255
    out[73] = c26
    out[76] = x338
    out[77] = x340
    out[78] = x342
    out[79] = x20*x345 + x2*x349 + x0*x353 + (x315 - q_orbit_qz*x354)
    out[80] = x361 + (x361 - x0*x360) + (x312 + q_orbit_qy*x354)
    out[81] = x365 + (x0*x356 - x2*x364 + x365) - (x307 + q_orbit_qx*x354)
    out[82] = x368
    out[86] = v_orbit_wz*c27 - v_orbit_wz*c31
    out[88] = v_orbit_wx*c30 - v_orbit_wx*c27
    out[89] = x149
    out[90] = x205
    out[91] = x256
    out[93] = c27
    out[95] = x372
    out[96] = x373
    out[97] = x374
    out[98] = x20*x377 + x2*x380 + x0*x383
    out[99] = x389 + (x389 - x0*x388)
    out[100] = x393 + (x0*x385 - x2*x392 + x393)
    out[101] = x395 + (x2*x390 + x0*x384 - x20*x394 + x395)
    out[105] = v_orbit_wy*c31 - v_orbit_wy*c13
    out[106] = v_orbit_wx*c13 - v_orbit_wx*c29
    out[113] = c13


@njit(error_model="numpy")
def project(t, y, p, out):
    """State with unit quaternions. 13 operations."""
    q_orbit_x = y[0]
    q_orbit_y = y[1]
    q_orbit_z = y[2]
    q_orbit_qw = y[3]
    q_orbit_qx = y[4]
    q_orbit_qy = y[5]
    q_orbit_qz = y[6]
    v_orbit_vx = y[7]
    v_orbit_vy = y[8]
    v_orbit_vz = y[9]
    v_orbit_wx = y[10]
    v_orbit_wy = y[11]
    v_orbit_wz = y[12]
    x0 = q_orbit_qw*q_orbit_qw + q_orbit_qx*q_orbit_qx + q_orbit_qy*q_orbit_qy
    x1 = 1.0/sqrt(x0 + q_orbit_qz*q_orbit_qz)
    out[0] = q_orbit_x
    out[1] = q_orbit_y
    out[2] = q_orbit_z
    out[3] = q_orbit_qw*x1
    out[4] = q_orbit_qx*x1
    out[5] = q_orbit_qy*x1
    out[6] = q_orbit_qz*x1
    out[7] = v_orbit_vx
    out[8] = v_orbit_vy
    out[9] = v_orbit_vz
    out[10] = v_orbit_wx
    out[11] = v_orbit_wy
    out[12] = v_orbit_wz


@njit(error_model="numpy")
def kinematics(t, y, p, out):
    """N of dq/dt = N v, row by row; derivative of N v by q. 13 operations."""
    q_orbit_qw = y[3]
    q_orbit_qx = y[4]
    q_orbit_qy = y[5]
    q_orbit_qz = y[6]
    v_orbit_wx = y[10]
    v_orbit_wy = y[11]
    v_orbit_wz = y[12]
    x0 = 0.5*q_orbit_qx
    x1 = -x0
    x2 = 0.5*q_orbit_qy
    x3 = -x2
    x4 = 0.5*q_orbit_qz
    x5 = -x4
    x6 = 0.5*q_orbit_qw
    x7 = 0.5*v_orbit_wx
    x8 = -x7
    x9 = 0.5*v_orbit_wy
    x10 = -x9
    x11 = 0.5*v_orbit_wz
    x12 = -x11
    out[0] = 1.0
    out[7] = 1.0
    out[14] = 1.0
    out[21] = x1
    out[22] = x3
    out[23] = x5
    out[27] = x6
    out[28] = x5
    out[29] = x2
    out[33] = x4
    out[34] = x6
    out[35] = x1
    out[39] = x3
    out[40] = x0
    out[41] = x6
    out[67] = x8
    out[68] = x10
    out[69] = x12
    out[73] = x7
    out[75] = x11
    out[76] = x10
    out[80] = x9
    out[81] = x12
    out[83] = x7
    out[87] = x11
    out[88] = x9
    out[89] = x8


@njit(error_model="numpy")
def poses(t, y, p, out):
    """Per body: position, rotation matrix (body to world). 45 operations."""
    p_boom = p[3]
    c0 = 0.3308097064230052*p_boom
    c1 = (16.835585591077464*(p_boom + 0.25) + c0*(0.25 + 0.5*p_boom))/(c0 + 76.83558559107746)
    q_orbit_x = y[0]
    q_orbit_y = y[1]
    q_orbit_z = y[2]
    q_orbit_qw = y[3]
    q_orbit_qx = y[4]
    q_orbit_qy = y[5]
    q_orbit_qz = y[6]
    x0 = q_orbit_qx + q_orbit_qx
    x1 = q_orbit_qz*x0
    x2 = q_orbit_qy + q_orbit_qy
    x3 = q_orbit_qw*x2
    x4 = x1 + x3
    x5 = q_orbit_qz*x2
    x6 = q_orbit_qw*x0
    x7 = x5 - x6
    x8 = q_orbit_qx*x0
    x9 = q_orbit_qy*x2
    x10 = 1.0 - (x8 + x9)
    x11 = q_orbit_qz + q_orbit_qz
    x12 = q_orbit_qz*x11
    x13 = 1.0 - (x9 + x12)
    x14 = q_orbit_qy*x0
    x15 = q_orbit_qw*x11
    x16 = x14 - x15
    x17 = x14 + x15
    x18 = 1.0 - (x8 + x12)
    x19 = x1 - x3
    x20 = x5 + x6
    out[0] = q_orbit_x + x4*c1
    out[1] = q_orbit_y + x7*c1
    out[2] = q_orbit_z + x10*c1
    out[3] = x13
    out[4] = x16
    out[5] = x4
    out[6] = x17
    out[7] = x18
    out[8] = x7
    out[9] = x19
    out[10] = x20
    out[11] = x10
    out[12] = 0.0
    out[13] = 0.0
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
    out[24] = q_orbit_x + 1000000.0*x4
    out[25] = q_orbit_y + 1000000.0*x7
    out[26] = q_orbit_z + 1000000.0*x10
    out[27] = x13
    out[28] = x16
    out[29] = x4
    out[30] = x17
    out[31] = x18
    out[32] = x7
    out[33] = x19
    out[34] = x20
    out[35] = x10


@njit(error_model="numpy")
def shapes(t, y, p, out):
    """Sizes of the bodies' shapes. 12 operations."""
    p_boom = p[3]
    c0 = p_boom + 0.25
    c1 = 0.3308097064230052*p_boom
    c2 = 0.25 + 0.5*p_boom
    c3 = (16.835585591077464*c0 + c1*c2)/(c1 + 76.83558559107746)
    c4 = -c3
    c5 = c2 - c3
    c6 = c0 - c3
    out[0] = 0.6
    out[1] = 0.5
    out[2] = 0.5
    out[3] = 0.0
    out[4] = 0.0
    out[5] = c4
    out[6] = 1.0
    out[7] = 0.0
    out[8] = 0.0
    out[9] = 0.0
    out[10] = 0.0
    out[11] = 1.0
    out[12] = 0.02
    out[13] = 0.019
    out[14] = p_boom
    out[15] = 0.0
    out[16] = 0.0
    out[17] = c5
    out[18] = 1.0
    out[19] = 0.0
    out[20] = 0.0
    out[21] = 0.0
    out[22] = 0.0
    out[23] = 1.0
    out[24] = 0.08
    out[25] = 0.0
    out[26] = 0.0
    out[27] = c6
    out[28] = 1.0
    out[29] = 0.0
    out[30] = 0.0
    out[31] = 0.0
    out[32] = 0.0
    out[33] = 1.0
    out[34] = 6378000.0
    out[35] = 100000.0
    out[36] = 2000000.0


@njit(error_model="numpy")
def outputs(t, y, p, out):
    """Outputs. 40 operations."""
    q_orbit_x = y[0]
    q_orbit_y = y[1]
    q_orbit_z = y[2]
    q_orbit_qw = y[3]
    q_orbit_qx = y[4]
    q_orbit_qy = y[5]
    q_orbit_qz = y[6]
    x0 = q_orbit_z*q_orbit_z + (q_orbit_x*q_orbit_x + q_orbit_y*q_orbit_y)
    x1 = q_orbit_qy + q_orbit_qy
    x2 = q_orbit_qx + q_orbit_qx
    x3 = q_orbit_qz*x1 - q_orbit_qw*x2
    x4 = 1.0 - (q_orbit_qx*x2 + q_orbit_qy*x1)
    x5 = q_orbit_z*x3 - q_orbit_y*x4
    x6 = q_orbit_qz*x2 + q_orbit_qw*x1
    x7 = q_orbit_x*x4 - q_orbit_z*x6
    x8 = q_orbit_y*x6 - q_orbit_x*x3
    x9 = atan2(sqrt(x5*x5 + (x7*x7 + x8*x8)), q_orbit_z*x4 + (q_orbit_x*x6 + q_orbit_y*x3))
    out[0] = sqrt(x0) + -6378000.0
    out[1] = x9


@njit(error_model="numpy")
def marks(t, y, p, out):
    """What a picture shows besides bodies, as `marks` lists it. 0 operations."""
    out[0] = 0.0


@njit(error_model="numpy")
def starts(t, y, p, out):
    """Start values of (q, v), before assembly. 7 operations."""
    p_mu = p[0]
    p_h = p[1]
    p_e = p[2]
    p_swing = p[4]
    c0 = p_h + 6378000.0
    c1 = sqrt(p_mu*(1.0 + p_e)/c0)
    c2 = p_swing - c1/c0
    out[0] = c0
    out[1] = 0.0
    out[2] = 0.0
    out[3] = 0.7071067811865476
    out[4] = 0.0
    out[5] = 0.7071067811865476
    out[6] = 0.0
    out[7] = 0.0
    out[8] = c1
    out[9] = 0.0
    out[10] = c2
    out[11] = p_swing
    out[12] = 0.0


@njit(error_model="numpy")
def limits(t, y, p, out):
    """Numbers of parameters that have a bound. 42 operations."""
    p_boom = p[3]
    c0 = 0.3308097064230052*p_boom
    c1 = c0 + 76.83558559107746
    c2 = 0.5*p_boom
    c3 = 0.25 + c2
    c4 = p_boom + 0.25
    c5 = 16.835585591077464*c4 + c0*c3
    c6 = c5/c1
    c7 = c3 - c6
    c8 = c7*c7
    c9 = c0*(0.08333333333333333*(p_boom*p_boom) + (0.00019025 + c8))
    c10 = 60.0*(c5*c5)/(c1*c1)
    c11 = c4 - c6
    c12 = 0.00256 + c11*c11
    c13 = 16.835585591077464*c12
    c14 = 2.5 + (c9 + (c10 + c13))
    c15 = c9 + (c13 + (c10 + 3.05))
    c16 = c6 + -0.25
    c17 = c0*(c7*(c16 - c2) + (c8 + 0.0003805)) + (3.05 + 16.835585591077464*(c12 + c11*(c16 - p_boom)))
    out[0] = p_boom
    out[1] = c1
    out[2] = c14
    out[3] = c15
    out[4] = c17
    out[5] = c14
    out[6] = c15
    out[7] = c17
