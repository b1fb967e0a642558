"""spinning_top: equations of motion, written by symgen 0.1.0. Do not edit.

Heavy symmetric top, fast: precession and nutation about a fixed point
"""

from math import cos, sin

from numba import njit

MODEL = {
    "abi": 1,
    "generator": "symgen 0.1.0",
    "source": "sha256:d3b6ea96a4c02948d66b3ab94b022684fc56fdee5c51278048b0de0fbb096987",
    "name": "spinning_top",
    "description": "Heavy symmetric top, fast: precession and nutation about a fixed point",
    "nq": 3,
    "nv": 3,
    "nh": 0,
    "nn": 0,
    "nw": 0,
    "coordinates": [
        {"name": "swing", "unit": "rad", "value": 0.0, "enforced": True},
        {"name": "sway", "unit": "rad", "value": 0.0, "enforced": True},
        {"name": "spin", "unit": "rad", "value": 0.4363323129985824, "enforced": True},
    ],
    "rates": [
        {"name": "swing", "unit": "rad/s", "value": -1.9505438728727893, "enforced": True},
        {"name": "sway", "unit": "rad/s", "value": -4.182954834133214, "enforced": True},
        {"name": "spin", "unit": "rad/s", "value": 150.0, "enforced": True},
    ],
    "parameters": [
        {"name": "m", "unit": "kg", "value": 15.0, "doc": ""},
        {"name": "l", "unit": "m", "value": 1.0, "doc": "from the fixed point to the centre of mass"},
        {"name": "Ja", "unit": "kg*m^2", "value": 0.46875, "doc": "inertia about the axis of symmetry"},
        {"name": "Jt", "unit": "kg*m^2", "value": 0.234375, "doc": "inertia across it, about the centre of mass"},
        {"name": "g", "unit": "m/s^2", "value": 9.81, "doc": ""},
    ],
    "inputs": [],
    "constants": [
        {"name": "tilt", "unit": "rad", "value": -0.4363323129985824},
    ],
    "constraints": [],
    "outputs": [
        {"name": "height", "unit": ""},
    ],
    "events": [],
    "bodies": [
        {"name": "top", "planar": False, "shape": "box", "sizes": 3, "mesh": ""},
        {"name": "stem", "planar": False, "shape": "capsule", "sizes": 2, "mesh": ""},
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
        "rhs": 217,
        "mass_matrix": 69,
        "forces": 136,
        "energy": 61,
        "residual": 150,
        "residual_jacobian": 556,
        "poses": 70,
        "shapes": 0,
        "outputs": 8,
    },
    "run": {
        "t_end": 2.0,
        "fps": 200.0,
    },
}

@njit(error_model="numpy")
def rhs(t, y, p, out):
    """State derivative: rates, accelerations. 217 operations."""
    q_swing = y[0]
    q_sway = y[1]
    q_spin = y[2]
    v_swing = y[3]
    v_sway = y[4]
    v_spin = y[5]
    p_m = p[0]
    p_l = p[1]
    p_Ja = p[2]
    p_Jt = p[3]
    p_g = p[4]
    x0 = sin(q_sway)
    x1 = x0*x0
    x2 = cos(q_sway)
    x3 = x2*x2
    x4 = sin(q_swing)
    x5 = x4*x4
    x6 = p_m*(p_l*p_l)
    x7 = cos(q_swing)
    x8 = x7*x7
    x9 = 0.9063077870366499*x2
    x10 = 0.17860619515673035*x6
    x11 = x4*x6
    x12 = x4*(x7*(x2*x6)) - x7*(0.9063077870366499*(x9*x11) + x4*(x2*x10))
    x13 = 0.42261826174069944*x6
    x14 = 0.9063077870366499*(x7*(x2*x13)) - x7*(0.42261826174069944*(x9*x6))
    x15 = x0*x12 + x2*x14
    x16 = p_Jt + x1*(0.8213938048432696*(x6*x5) + x6*x8 + x5*x10) + x3*(x10 + 0.8213938048432696*x6)
    x17 = x0*(0.383022221559489*x11) - 0.9063077870366499*(x0*(x4*x13))
    x18 = 1.0/(x16 + 2.0*(x2*x17))
    x19 = x15*x18
    x20 = p_Ja*x1 + p_Jt*x3 + x5*(x3*x6) + x8*(x6*(x9*x9) + x3*x10) - x15*x19
    x21 = 1.0/x20
    x22 = cos(q_spin)
    x23 = v_swing*x2
    x24 = sin(q_spin)
    x25 = x23*x22 - v_sway*x24
    x26 = v_spin - v_swing*x0
    x27 = p_Ja*x26
    x28 = p_Jt*x25
    x29 = v_spin*x22
    x30 = v_sway*x0
    x31 = v_swing*x30
    x32 = v_spin*x24
    x33 = x25*x27 - x26*x28 + p_Jt*(x23*x29 - x24*x31 - v_sway*x32)
    x34 = v_sway*x22 + x23*x24
    x35 = p_Jt*x34
    x36 = x26*x35 - x34*x27 - p_Jt*(x22*x31 + x23*x32 + v_sway*x29)
    x37 = v_sway*x2
    x38 = v_sway*x37
    x39 = v_swing*x4
    x40 = x30*x39
    x41 = v_swing*x7
    x42 = p_l*(p_m*(p_l*(x7*x38 - x40 + (x2*(v_swing*x41) - x40))))
    x43 = v_sway*x30
    x44 = x41*(0.9063077870366499*x30)
    x45 = v_swing*x39
    x46 = 0.42261826174069944*x43 - (x44 + x9*x45 + (x44 + x4*(0.9063077870366499*x38)))
    x47 = p_l*(p_m*(p_l*x46))
    x48 = x30*x41
    x49 = 0.9063077870366499*x43 + 0.42261826174069944*(x48 + x4*x38 + (x48 + x2*x45))
    x50 = p_l*(p_m*(p_l*x49))
    x51 = 0.42261826174069944*x50
    x52 = x22*x33 - x24*x36 + x0*(x7*x42 - 0.9063077870366499*(x4*x47) + x4*x51)
    x53 = p_l*(p_m*p_g)
    x54 = x0*(0.9063077870366499*(x4*x53)) + x2*(0.42261826174069944*x53)
    x55 = x52 - x2*(0.42261826174069944*x47 + 0.9063077870366499*x50) - x54
    x56 = x34*x28 - x25*x35 - p_Ja*(v_swing*x37)
    x57 = x2*(x22*x36 + x24*x33) - x0*x56 + x4*(x2*x42) + x7*(x9*x47 - x2*x51)
    x58 = x55*x19 - (x57 + x7*(x9*x53))
    x59 = p_Ja*x0
    x60 = x59*x21
    x61 = 1.0/(p_Ja - x59*x60)*(x60*x58 - x56)
    x62 = x21*x58 + x60*x61
    out[0] = v_swing
    out[1] = v_sway
    out[2] = v_spin
    out[3] = x62
    out[4] = -(x55*x18 + x19*x62)
    out[5] = x61


@njit(error_model="numpy")
def mass_matrix(t, y, p, out):
    """Mass matrix M, row by row. 69 operations."""
    q_swing = y[0]
    q_sway = y[1]
    p_m = p[0]
    p_l = p[1]
    p_Ja = p[2]
    p_Jt = p[3]
    x0 = sin(q_sway)
    x1 = x0*x0
    x2 = cos(q_sway)
    x3 = x2*x2
    x4 = sin(q_swing)
    x5 = x4*x4
    x6 = p_m*(p_l*p_l)
    x7 = cos(q_swing)
    x8 = x7*x7
    x9 = 0.9063077870366499*x2
    x10 = 0.17860619515673035*x6
    x11 = x4*x6
    x12 = x4*(x7*(x2*x6)) - x7*(0.9063077870366499*(x9*x11) + x4*(x2*x10))
    x13 = 0.42261826174069944*x6
    x14 = 0.9063077870366499*(x7*(x2*x13)) - x7*(0.42261826174069944*(x9*x6))
    x15 = x0*x12 + x2*x14
    x16 = -(p_Ja*x0)
    x17 = p_Jt + x1*(0.8213938048432696*(x6*x5) + x6*x8 + x5*x10) + x3*(x10 + 0.8213938048432696*x6)
    x18 = x0*(0.383022221559489*x11) - 0.9063077870366499*(x0*(x4*x13))
    out[0] = p_Ja*x1 + p_Jt*x3 + x5*(x3*x6) + x8*(x6*(x9*x9) + x3*x10)
    out[1] = x15
    out[2] = x16
    out[3] = x15
    out[4] = x17 + 2.0*(x2*x18)
    out[6] = x16
    out[8] = p_Ja


@njit(error_model="numpy")
def forces(t, y, p, out):
    """Forces f of M a = f + G^T lambda. 136 operations."""
    q_swing = y[0]
    q_sway = y[1]
    q_spin = y[2]
    v_swing = y[3]
    v_sway = y[4]
    v_spin = y[5]
    p_m = p[0]
    p_l = p[1]
    p_Ja = p[2]
    p_Jt = p[3]
    p_g = p[4]
    x0 = cos(q_sway)
    x1 = cos(q_spin)
    x2 = sin(q_sway)
    x3 = v_spin - v_swing*x2
    x4 = v_swing*x0
    x5 = sin(q_spin)
    x6 = v_sway*x1 + x4*x5
    x7 = p_Jt*x6
    x8 = p_Ja*x3
    x9 = v_sway*x2
    x10 = v_swing*x9
    x11 = v_spin*x5
    x12 = v_spin*x1
    x13 = x3*x7 - x6*x8 - p_Jt*(x1*x10 + x4*x11 + v_sway*x12)
    x14 = x4*x1 - v_sway*x5
    x15 = p_Jt*x14
    x16 = x14*x8 - x3*x15 + p_Jt*(x4*x12 - x5*x10 - v_sway*x11)
    x17 = v_sway*x0
    x18 = x6*x15 - x14*x7 - p_Ja*(v_swing*x17)
    x19 = sin(q_swing)
    x20 = cos(q_swing)
    x21 = v_sway*x17
    x22 = v_swing*x19
    x23 = x9*x22
    x24 = v_swing*x20
    x25 = p_l*(p_m*(p_l*(x20*x21 - x23 + (x0*(v_swing*x24) - x23))))
    x26 = 0.9063077870366499*x0
    x27 = v_sway*x9
    x28 = x24*(0.9063077870366499*x9)
    x29 = v_swing*x22
    x30 = 0.42261826174069944*x27 - (x28 + x26*x29 + (x28 + x19*(0.9063077870366499*x21)))
    x31 = p_l*(p_m*(p_l*x30))
    x32 = x9*x24
    x33 = 0.9063077870366499*x27 + 0.42261826174069944*(x32 + x19*x21 + (x32 + x0*x29))
    x34 = p_l*(p_m*(p_l*x33))
    x35 = 0.42261826174069944*x34
    x36 = x0*(x1*x13 + x5*x16) - x2*x18 + x19*(x0*x25) + x20*(x26*x31 - x0*x35)
    x37 = p_l*(p_m*p_g)
    x38 = x1*x16 - x5*x13 + x2*(x20*x25 - 0.9063077870366499*(x19*x31) + x19*x35)
    x39 = x2*(0.9063077870366499*(x19*x37)) + x0*(0.42261826174069944*x37)
    x40 = x38 - x0*(0.42261826174069944*x31 + 0.9063077870366499*x34) - x39
    out[0] = -(x36 + x20*(x26*x37))
    out[1] = -x40
    out[2] = -x18


@njit(error_model="numpy")
def energy(t, y, p, out):
    """Kinetic and potential energy. 61 operations."""
    q_swing = y[0]
    q_sway = y[1]
    q_spin = y[2]
    v_swing = y[3]
    v_sway = y[4]
    v_spin = y[5]
    p_m = p[0]
    p_l = p[1]
    p_Ja = p[2]
    p_Jt = p[3]
    p_g = p[4]
    x0 = cos(q_sway)
    x1 = v_sway*x0
    x2 = cos(q_swing)
    x3 = v_swing*x2
    x4 = sin(q_swing)
    x5 = sin(q_sway)
    x6 = v_sway*x5
    x7 = p_l*(0.9063077870366499*x1 + 0.42261826174069944*(x0*x3 - x4*x6))
    x8 = p_l*(x2*x6 + x0*(v_swing*x4))
    x9 = 0.9063077870366499*x0
    x10 = p_l*(x9*x3 - x4*(0.9063077870366499*x6) - 0.42261826174069944*x1)
    x11 = v_swing*x0
    x12 = cos(q_spin)
    x13 = sin(q_spin)
    x14 = x11*x12 - v_sway*x13
    x15 = v_spin - v_swing*x5
    x16 = v_sway*x12 + x11*x13
    x17 = 0.5*p_m*(x7*x7 + x8*x8 + x10*x10) + 0.5*(x14*(p_Jt*x14) + x15*(p_Ja*x15) + x16*(p_Jt*x16))
    out[0] = x17
    out[1] = p_m*(p_g*(p_l*(x4*x9 - 0.42261826174069944*x5)))


@njit(error_model="numpy")
def residual(t, y, p, out):
    """M a - f - G^T lambda, then G a - gamma. 150 operations."""
    q_swing = y[0]
    q_sway = y[1]
    q_spin = y[2]
    v_swing = y[3]
    v_sway = y[4]
    v_spin = y[5]
    a_swing = y[6]
    a_sway = y[7]
    a_spin = y[8]
    p_m = p[0]
    p_l = p[1]
    p_Ja = p[2]
    p_Jt = p[3]
    p_g = p[4]
    x0 = cos(q_swing)
    x1 = cos(q_sway)
    x2 = 0.9063077870366499*x1
    x3 = p_l*(p_m*p_g)
    x4 = cos(q_spin)
    x5 = sin(q_sway)
    x6 = v_spin - v_swing*x5
    x7 = v_swing*x1
    x8 = sin(q_spin)
    x9 = v_sway*x4 + x7*x8
    x10 = p_Jt*x9
    x11 = p_Ja*x6
    x12 = v_sway*x5
    x13 = a_swing*x1 - v_swing*x12
    x14 = v_spin*x8
    x15 = v_spin*x4
    x16 = x6*x10 - x9*x11 + p_Jt*(x4*x13 - x7*x14 - (v_sway*x15 + a_sway*x8))
    x17 = x7*x4 - v_sway*x8
    x18 = p_Jt*x17
    x19 = x17*x11 - x6*x18 + p_Jt*(a_sway*x4 - v_sway*x14 + (x7*x15 + x8*x13))
    x20 = v_sway*x1
    x21 = x9*x18 - x17*x10 + p_Ja*(a_spin - (v_swing*x20 + a_swing*x5))
    x22 = sin(q_swing)
    x23 = v_sway*x20 + a_sway*x5
    x24 = v_swing*x22
    x25 = x12*x24
    x26 = v_swing*x0
    x27 = p_m*(p_l*(x0*x23 - x25 + (x1*(v_swing*x26 + a_swing*x22) - x25)))
    x28 = p_l*x27
    x29 = a_swing*x0 - v_swing*x24
    x30 = x26*(0.9063077870366499*x12)
    x31 = a_sway*x1 - v_sway*x12
    x32 = x2*x29 - x30 - (x30 + x22*(0.9063077870366499*x23)) - 0.42261826174069944*x31
    x33 = p_l*(p_m*(p_l*x32))
    x34 = x12*x26
    x35 = 0.9063077870366499*x31 + 0.42261826174069944*(x1*x29 - x34 - (x34 + x22*x23))
    x36 = p_l*(p_m*(p_l*x35))
    x37 = 0.42261826174069944*x36
    x38 = x1*(x4*x16 + x8*x19) - x5*x21 + x22*(x1*x28) + x0*(x2*x33 + x1*x37)
    x39 = x4*x19 - x8*x16 + x5*(x0*x28 - 0.9063077870366499*(x22*x33) - x22*x37)
    x40 = x5*(0.9063077870366499*(x22*x3)) + x1*(0.42261826174069944*x3)
    x41 = x39 + x1*(0.9063077870366499*x36 - 0.42261826174069944*x33) - x40
    out[0] = x0*(x2*x3) + x38
    out[1] = x41
    out[2] = x21


@njit(error_model="numpy")
def residual_jacobian(t, y, p, out):
    """Residual derivatives by q, v, a, lambda. 556 operations."""
    q_swing = y[0]
    q_sway = y[1]
    q_spin = y[2]
    v_swing = y[3]
    v_sway = y[4]
    v_spin = y[5]
    a_swing = y[6]
    a_sway = y[7]
    a_spin = y[8]
    p_m = p[0]
    p_l = p[1]
    p_Ja = p[2]
    p_Jt = p[3]
    p_g = p[4]
    x0 = cos(q_swing)
    x1 = cos(q_sway)
    x2 = v_sway*x1
    x3 = sin(q_sway)
    x4 = v_sway*x2 + a_sway*x3
    x5 = v_sway*x3
    x6 = sin(q_swing)
    x7 = v_swing*x6
    x8 = x5*x7
    x9 = v_swing*x0
    x10 = v_swing*x9 + a_swing*x6
    x11 = x0*x4 - x8 + (x1*x10 - x8)
    x12 = p_l*(p_m*(p_l*x11))
    x13 = a_swing*x0 - v_swing*x7
    x14 = x5*x9
    x15 = x1*x13 - x14 - (x14 + x6*x4)
    x16 = p_l*(p_m*(p_l*x15))
    x17 = 0.9063077870366499*x1
    x18 = 0.9063077870366499*x5
    x19 = x7*x18
    x20 = 0.9063077870366499*x4
    x21 = p_l*(p_m*(p_l*(x19 - x17*x10 - (x0*x20 - x19))))
    x22 = p_l*(p_m*(p_l*(0.42261826174069944*x11)))
    x23 = 0.42261826174069944*x22
    x24 = x9*x18
    x25 = a_sway*x1 - v_sway*x5
    x26 = p_l*(x17*x13 - x24 - (x24 + x6*x20) - 0.42261826174069944*x25)
    x27 = p_l*(p_m*x26)
    x28 = 0.9063077870366499*x25
    x29 = p_l*(p_m*(p_l*(x28 + 0.42261826174069944*x15)))
    x30 = 0.42261826174069944*x29
    x31 = x0*(x1*x12) + x6*(x1*x16) + (x0*(x17*x21 - x1*x23) - x6*(x17*x27 + x1*x30))
    x32 = p_l*(p_m*p_g)
    x33 = cos(q_spin)
    x34 = v_swing*x3
    x35 = v_spin - x34
    x36 = p_Ja*x35
    x37 = sin(q_spin)
    x38 = x34*x37
    x39 = v_swing*x1
    x40 = v_sway*x33 + x39*x37
    x41 = p_Ja*x39
    x42 = p_Jt*x40
    x43 = p_Jt*x38
    x44 = v_spin*x37
    x45 = v_swing*x2 + a_swing*x3
    x46 = x36*x38 + x40*x41 - (x39*x42 + x35*x43) + p_Jt*(x34*x44 - x33*x45)
    x47 = x39*x33 - v_sway*x37
    x48 = p_Jt*x47
    x49 = x34*x33
    x50 = p_Jt*x49
    x51 = v_spin*x33
    x52 = x39*x48 + x35*x50 - (x36*x49 + x47*x41) - p_Jt*(x34*x51 + x37*x45)
    x53 = a_swing*x1 - v_swing*x5
    x54 = x35*x42 - x40*x36 + p_Jt*(x33*x53 - x39*x44 - (v_sway*x51 + a_sway*x37))
    x55 = x47*x36 - x35*x48 + p_Jt*(a_sway*x33 - v_sway*x44 + (x39*x51 + x37*x53))
    x56 = x42*x49 + x47*x43 - (x48*x38 + x40*x50) - p_Ja*x53
    x57 = x1*(x33*x46 + x37*x52) - x3*(x33*x54 + x37*x55) - (x1*(x40*x48 - x47*x42 + p_Ja*(a_spin - x45)) + x3*x56)
    x58 = x2*x7
    x59 = p_l*(p_m*(p_l*(x0*x25 - x58 - (x58 + x3*x10))))
    x60 = 0.9063077870366499*x2*x9
    x61 = 0.9063077870366499*x3
    x62 = p_l*(0.42261826174069944*x4 - (x60 + x61*x13 + (x60 + x6*x28)))
    x63 = p_l*(p_m*x62)
    x64 = x2*x9
    x65 = p_l*(x20 + 0.42261826174069944*(x64 + x6*x25 + (x64 + x3*x13)))
    x66 = p_l*(p_m*x65)
    x67 = 0.42261826174069944*x66
    x68 = x57 + x6*(x1*x59 - x3*x12) + x0*(x17*x63 - x61*x27 - (x3*x30 + x1*x67))
    x69 = x1*x37
    x70 = p_Jt*x69
    x71 = p_Ja*x3
    x72 = x35*x70 - x3*x42 - (x36*x69 - x40*x71) - p_Jt*(x1*x44 + x5*x33)
    x73 = x1*x33
    x74 = p_Jt*x73
    x75 = x36*x73 - x47*x71 - (x35*x74 - x3*x48) + p_Jt*(x1*x51 - x5*x37)
    x76 = x48*x69 + x40*x74 - (x42*x73 + x47*x70) - p_Ja*x2
    x77 = x6*x5
    x78 = p_l*(p_m*(p_l*(x1*(x9 + x9) - x77 - x77)))
    x79 = x0*x18
    x80 = x7 + x7
    x81 = p_l*(p_m*(p_l*(x79 + (x79 + x17*x80))))
    x82 = x0*x5
    x83 = p_l*(p_m*(p_l*(0.42261826174069944*(x82 + (x82 + x1*x80)))))
    x84 = 0.42261826174069944*x83
    x85 = x1*(x33*x72 + x37*x75) - x3*x76 + x6*(x1*x78) - x0*(x17*x81 + x1*x84)
    x86 = p_Jt*x33
    x87 = x35*x86 - x33*x36 - p_Jt*(x51 + x49)
    x88 = p_Jt*x37
    x89 = x35*x88 - x37*x36 - p_Jt*(x44 + x38)
    x90 = x33*x48 - x40*x88 - (x47*x86 - x37*x42) - x41
    x91 = x2 + x2
    x92 = x3*x7
    x93 = p_l*(p_m*(p_l*(x0*x91 - x92 - x92)))
    x94 = x5 + x5
    x95 = x61*x9
    x96 = 0.42261826174069944*x94 - (x95 + (x95 + x6*(0.9063077870366499*x91)))
    x97 = p_l*(p_m*(p_l*x96))
    x98 = x3*x9
    x99 = 0.9063077870366499*x94 + 0.42261826174069944*(x98 + (x98 + x6*x91))
    x100 = p_l*(p_m*(p_l*x99))
    x101 = 0.42261826174069944*x100
    x102 = x1*(x33*x87 + x37*x89) - x3*x90 + x6*(x1*x93) + x0*(x17*x97 - x1*x101)
    x103 = x42 - p_Ja*x40 - x42
    x104 = x48 + (p_Ja*x47 - x48)
    x105 = x3*x3
    x106 = x1*x1
    x107 = x6*x6
    x108 = p_m*(p_l*p_l)
    x109 = x0*x0
    x110 = 0.17860619515673035*x108
    x111 = p_Ja*x105 + p_Jt*x106 + x107*(x106*x108) + x109*(x108*(x17*x17) + x106*x110)
    x112 = x6*x108
    x113 = x6*(x0*(x1*x108)) - x0*(0.9063077870366499*(x17*x112) + x6*(x1*x110))
    x114 = 0.42261826174069944*x108
    x115 = 0.9063077870366499*(x0*(x1*x114)) - x0*(0.42261826174069944*(x17*x108))
    x116 = x3*x113 + x1*x115
    x117 = -x71
    x118 = x0*x16 - x6*x12 - 0.9063077870366499*(x0*x27 + x6*x21) - (x0*x30 - x6*x23)
    x119 = x3*x118 - x1*(0.42261826174069944*x21 + 0.9063077870366499*x22)
    x120 = x1*(x0*x12 - 0.9063077870366499*(x6*x27) - x6*x30) + x3*(x0*x59 - 0.9063077870366499*(x6*x63) + x6*x67)
    x121 = x3*(0.9063077870366499*x29 - 0.42261826174069944*x27) + x1*(0.42261826174069944*x63 + 0.9063077870366499*x66)
    x122 = x1*(0.9063077870366499*(x6*x32)) - x3*(0.42261826174069944*x32)
    x123 = x33*x75 - x37*x72 + x3*(0.9063077870366499*(x6*x81) + x0*x78 + x6*x84)
    x124 = x33*x89 - x37*x87 + x3*(x0*x93 - 0.9063077870366499*(x6*x97) + x6*x101)
    x125 = x124 - x1*(0.42261826174069944*x97 + 0.9063077870366499*x100)
    x126 = x105*(0.8213938048432696*(x108*x107) + x108*x109 + x107*x110)
    x127 = x3*(0.383022221559489*x112) - 0.9063077870366499*(x3*(x6*x114))
    x128 = p_Jt + x126 + x106*(x110 + 0.8213938048432696*x108) + 2.0*(x1*x127)
    out[0] = x31 - x6*(x17*x32)
    out[1] = x68 - x0*(x61*x32)
    out[3] = x85
    out[4] = x102
    out[5] = x1*(x33*x103 + x37*x104)
    out[6] = x111
    out[7] = x116
    out[8] = x117
    out[9] = x119 - x3*(0.9063077870366499*(x0*x32))
    out[10] = x33*x52 - x37*x46 + x120 - x121 - x122
    out[12] = x123 + x1*(0.42261826174069944*x81 - 0.9063077870366499*x83)
    out[13] = x125
    out[14] = x33*x104 - x37*x103
    out[15] = x116
    out[16] = x128
    out[19] = x56
    out[21] = x76
    out[22] = x90
    out[24] = x117
    out[26] = p_Ja


@njit(error_model="numpy")
def poses(t, y, p, out):
    """Per body: position, rotation matrix (body to world). 70 operations."""
    q_swing = y[0]
    q_sway = y[1]
    q_spin = y[2]
    p_l = p[1]
    x0 = sin(q_sway)
    x1 = 0.9063077870366499*x0
    x2 = cos(q_sway)
    x3 = sin(q_swing)
    x4 = x1 + 0.42261826174069944*(x2*x3)
    x5 = cos(q_swing)
    x6 = x2*x5
    x7 = 0.9063077870366499*x2
    x8 = 0.42261826174069944*x0
    x9 = x3*x7 - x8
    x10 = 0.42261826174069944*x3
    x11 = x7 - x0*x10
    x12 = cos(q_spin)
    x13 = 0.42261826174069944*x5
    x14 = sin(q_spin)
    x15 = x1 + x2*x10
    x16 = x0*x5
    x17 = 0.9063077870366499*x3
    x18 = 0.42261826174069944*x2 + x0*x17
    x19 = 0.9063077870366499*x5
    x20 = x2*x17 - x8
    x21 = 0.5*p_l
    out[0] = -(p_l*x4)
    out[1] = p_l*x6
    out[2] = p_l*x9
    out[3] = x11*x12 + x13*x14
    out[4] = -x15
    out[5] = x11*x14 - x13*x12
    out[6] = x16*x12 + x3*x14
    out[7] = x6
    out[8] = x16*x14 - x3*x12
    out[9] = x18*x12 - x19*x14
    out[10] = x20
    out[11] = x19*x12 + x18*x14
    out[12] = -(x4*x21)
    out[13] = x6*x21
    out[14] = x9*x21
    out[15] = x11
    out[16] = x13 - 6.123233995736766e-17*x15
    out[17] = -(x15 + 2.5877905075098294e-17*x5)
    out[18] = x16
    out[19] = x3 + 6.123233995736766e-17*x6
    out[20] = x6 - 6.123233995736766e-17*x3
    out[21] = x18
    out[22] = 6.123233995736766e-17*x20 - x19
    out[23] = x20 + 5.549534652183772e-17*x5


@njit(error_model="numpy")
def shapes(t, y, p, out):
    """Sizes of the bodies' shapes. 0 operations."""
    p_l = p[1]
    out[0] = 0.4
    out[1] = 0.05
    out[2] = 0.4
    out[3] = 0.02
    out[4] = p_l


@njit(error_model="numpy")
def outputs(t, y, p, out):
    """Outputs. 8 operations."""
    q_swing = y[0]
    q_sway = y[1]
    p_l = p[1]
    x0 = sin(q_swing)*(0.9063077870366499*cos(q_sway)) - 0.42261826174069944*sin(q_sway)
    out[0] = p_l*x0
