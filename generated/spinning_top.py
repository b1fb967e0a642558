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
    "quaternions": [],
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
        {"name": "height", "unit": "m"},
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
        "rhs": 191,
        "mass_matrix": 49,
        "forces": 131,
        "energy": 60,
        "residual": 145,
        "residual_jacobian": 500,
        "poses": 70,
        "shapes": 0,
        "outputs": 8,
        "marks": 2,
        "limits": 0,
    },
    "hoisted": {
        "rhs": 11,
        "mass_matrix": 5,
        "forces": 6,
        "energy": 2,
        "residual": 6,
        "residual_jacobian": 14,
        "poses": 1,
        "marks": 1,
    },
    "run": {
        "t_end": 2.0,
        "fps": 200.0,
    },
    "limits": [
        {"name": "bodies.top.mass", "bound": "zero or more"},
        {"name": "bodies.top.inertia[0]", "bound": "zero or more"},
        {"name": "bodies.top.inertia[1]", "bound": "zero or more"},
        {"name": "bodies.top.inertia", "bound": "a tensor without negative moments", "numbers": 3},
        {"name": "bodies.stem.shape.capsule[1]", "bound": "zero or more"},
    ],
    "subsystems": [],
    "marks": [
        {"kind": "ball", "name": "stem_1", "body": "stem", "numbers": 3},
        {"kind": "ground", "name": "stem_1", "body": "", "numbers": 3},
    ],
}

@njit(error_model="numpy")
def rhs(t, y, p, out):
    """State derivative: rates, accelerations. 191 operations."""
    p_m = p[0]
    p_l = p[1]
    p_Ja = p[2]
    p_Jt = p[3]
    p_g = p[4]
    c0 = p_m*(p_l*p_l)
    c1 = 0.17860619515673035*c0
    c2 = 0.9063077870366499*c0
    c3 = 0.8213938048432696*c0
    c4 = c1 + c3
    c5 = p_l*(p_m*p_l)
    c6 = 0.42261826174069944*c5
    c7 = 0.9063077870366499*c5
    c8 = p_l*(p_m*p_g)
    c9 = 0.42261826174069944*c8
    c10 = 0.9063077870366499*c8
    q_swing = y[0]
    q_sway = y[1]
    q_spin = y[2]
    v_swing = y[3]
    v_sway = y[4]
    v_spin = y[5]
    x0 = cos(q_sway)
    x1 = x0*x0
    x2 = sin(q_sway)
    x3 = x2*x2
    x4 = cos(q_swing)
    x5 = x4*x4
    x6 = 0.9063077870366499*x0
    x7 = sin(q_swing)
    x8 = x7*x7
    x9 = x0*x4
    x10 = x2*(c0*(x7*x9) - x4*(x0*x7*c1 + x7*x6*c2))
    x11 = 1.0/(p_Jt + (x1*c4 + x3*(c1*x8 + (c0*x5 + x8*c3))))
    x12 = x11*x10
    x13 = p_Jt*x1 + (p_Ja*x3 + (x5*(c0*(x6*x6) + c1*x1) + c0*(x8*x1))) - x10*x12
    x14 = 1.0/x13
    x15 = cos(q_spin)
    x16 = v_swing*x0
    x17 = sin(q_spin)
    x18 = x16*x15 - v_sway*x17
    x19 = v_spin - v_swing*x2
    x20 = p_Ja*x19
    x21 = p_Jt*x18
    x22 = v_spin*x15
    x23 = v_sway*x2
    x24 = v_swing*x23
    x25 = v_spin*x17
    x26 = x18*x20 - x19*x21 + p_Jt*(x16*x22 - x17*x24 - v_sway*x25)
    x27 = v_sway*x0
    x28 = v_sway*x27
    x29 = v_swing*x7
    x30 = x23*x29
    x31 = v_swing*x4
    x32 = (x4*x28 - x30 + (x0*(v_swing*x31) - x30))*c5
    x33 = v_sway*x23
    x34 = v_swing*x29
    x35 = x23*x31
    x36 = 0.9063077870366499*x35
    x37 = x7*x28
    x38 = 0.42261826174069944*x33 - (x6*x34 + x36 + (x36 + 0.9063077870366499*x37))
    x39 = x38*c5
    x40 = 0.9063077870366499*x33 + 0.42261826174069944*(x35 + x37 + (x35 + x0*x34))
    x41 = x40*c6
    x42 = x2*(x4*x32 - 0.9063077870366499*(x7*x39) + x7*x41) - x0*(x38*c6 + x40*c7)
    x43 = v_sway*x15 + x16*x17
    x44 = p_Jt*x43
    x45 = x19*x44 - x43*x20 - p_Jt*(x15*x24 + x16*x25 + v_sway*x22)
    x46 = x15*x26 + (x42 - x17*x45) - (x0*c9 + c10*(x2*x7))
    x47 = x43*x21 - x18*x44 - p_Ja*(v_swing*x27)
    x48 = x0*(x15*x45 + x17*x26) + (x7*(x0*x32) + x4*(x6*x39 - x0*x41) - x2*x47)
    x49 = x46*x12 - (x48 + x9*c10)
    x50 = p_Ja*x2
    x51 = x50*x14
    x52 = 1.0/(p_Ja - x50*x51)*(x51*x49 - x47)
    x53 = x14*x49 + x51*x52
    out[0] = v_swing
    out[1] = v_sway
    out[2] = v_spin
    out[3] = x53
    out[4] = -(x11*x46 + x12*x53)
    out[5] = x52


@njit(error_model="numpy")
def mass_matrix(t, y, p, out):
    """Mass matrix M, row by row. 49 operations."""
    p_m = p[0]
    p_l = p[1]
    p_Ja = p[2]
    p_Jt = p[3]
    c0 = p_m*(p_l*p_l)
    c1 = 0.17860619515673035*c0
    c2 = 0.9063077870366499*c0
    c3 = 0.8213938048432696*c0
    c4 = c1 + c3
    q_swing = y[0]
    q_sway = y[1]
    x0 = cos(q_sway)
    x1 = x0*x0
    x2 = sin(q_sway)
    x3 = x2*x2
    x4 = cos(q_swing)
    x5 = x4*x4
    x6 = 0.9063077870366499*x0
    x7 = sin(q_swing)
    x8 = x7*x7
    x9 = x2*(c0*(x7*(x0*x4)) - x4*(x0*x7*c1 + x7*x6*c2))
    x10 = -(p_Ja*x2)
    out[0] = p_Jt*x1 + (p_Ja*x3 + (x5*(c0*(x6*x6) + c1*x1) + c0*(x8*x1)))
    out[1] = x9
    out[2] = x10
    out[3] = x9
    out[4] = p_Jt + (x1*c4 + x3*(c1*x8 + (c0*x5 + x8*c3)))
    out[6] = x10
    out[8] = p_Ja


@njit(error_model="numpy")
def forces(t, y, p, out):
    """Forces f of M a = f + G^T lambda. 131 operations."""
    p_m = p[0]
    p_l = p[1]
    p_Ja = p[2]
    p_Jt = p[3]
    p_g = p[4]
    c0 = p_l*(p_m*p_l)
    c1 = 0.42261826174069944*c0
    c2 = p_l*(p_m*p_g)
    c3 = 0.9063077870366499*c2
    c4 = 0.9063077870366499*c0
    c5 = 0.42261826174069944*c2
    q_swing = y[0]
    q_sway = y[1]
    q_spin = y[2]
    v_swing = y[3]
    v_sway = y[4]
    v_spin = y[5]
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
    x17 = sin(q_swing)
    x18 = cos(q_swing)
    x19 = v_sway*x0
    x20 = v_sway*x19
    x21 = v_swing*x17
    x22 = x9*x21
    x23 = v_swing*x18
    x24 = (x18*x20 - x22 + (x0*(v_swing*x23) - x22))*c0
    x25 = 0.9063077870366499*x0
    x26 = v_sway*x9
    x27 = v_swing*x21
    x28 = x9*x23
    x29 = 0.9063077870366499*x28
    x30 = x17*x20
    x31 = 0.42261826174069944*x26 - (x25*x27 + x29 + (x29 + 0.9063077870366499*x30))
    x32 = x31*c0
    x33 = 0.9063077870366499*x26 + 0.42261826174069944*(x28 + x30 + (x28 + x0*x27))
    x34 = x33*c1
    x35 = x6*x15 - x14*x7 - p_Ja*(v_swing*x19)
    x36 = x0*(x1*x13 + x5*x16) + (x17*(x0*x24) + x18*(x25*x32 - x0*x34) - x2*x35)
    x37 = x2*(x18*x24 - 0.9063077870366499*(x17*x32) + x17*x34) - x0*(x31*c1 + x33*c4)
    out[0] = -(x36 + x0*x18*c3)
    out[1] = -(x1*x16 + (x37 - x5*x13) - (x0*c5 + c3*(x2*x17)))
    out[2] = -x35


@njit(error_model="numpy")
def energy(t, y, p, out):
    """Kinetic and potential energy. 60 operations."""
    p_m = p[0]
    p_l = p[1]
    p_Ja = p[2]
    p_Jt = p[3]
    p_g = p[4]
    c0 = 0.5*p_m
    c1 = p_m*(p_l*p_g)
    q_swing = y[0]
    q_sway = y[1]
    q_spin = y[2]
    v_swing = y[3]
    v_sway = y[4]
    v_spin = y[5]
    x0 = cos(q_sway)
    x1 = v_sway*x0
    x2 = cos(q_swing)
    x3 = v_swing*x2
    x4 = sin(q_swing)
    x5 = sin(q_sway)
    x6 = v_sway*x5
    x7 = x4*x6
    x8 = p_l*(0.9063077870366499*x1 + 0.42261826174069944*(x0*x3 - x7))
    x9 = p_l*(x2*x6 + x0*(v_swing*x4))
    x10 = 0.9063077870366499*x0
    x11 = p_l*(x10*x3 - 0.9063077870366499*x7 - 0.42261826174069944*x1)
    x12 = v_swing*x0
    x13 = cos(q_spin)
    x14 = sin(q_spin)
    x15 = x12*x13 - v_sway*x14
    x16 = v_spin - v_swing*x5
    x17 = v_sway*x13 + x12*x14
    x18 = c0*(x8*x8 + x9*x9 + x11*x11) + 0.5*(p_Jt*(x15*x15) + p_Ja*(x16*x16) + p_Jt*(x17*x17))
    out[0] = x18
    out[1] = (x4*x10 - 0.42261826174069944*x5)*c1


@njit(error_model="numpy")
def residual(t, y, p, out):
    """M a - f - G^T lambda, then G a - gamma. 145 operations."""
    p_m = p[0]
    p_l = p[1]
    p_Ja = p[2]
    p_Jt = p[3]
    p_g = p[4]
    c0 = p_l*(p_m*p_g)
    c1 = 0.9063077870366499*c0
    c2 = p_l*(p_m*p_l)
    c3 = 0.42261826174069944*c2
    c4 = 0.9063077870366499*c2
    c5 = 0.42261826174069944*c0
    q_swing = y[0]
    q_sway = y[1]
    q_spin = y[2]
    v_swing = y[3]
    v_sway = y[4]
    v_spin = y[5]
    a_swing = y[6]
    a_sway = y[7]
    a_spin = y[8]
    x0 = cos(q_sway)
    x1 = cos(q_swing)
    x2 = cos(q_spin)
    x3 = sin(q_sway)
    x4 = v_spin - v_swing*x3
    x5 = v_swing*x0
    x6 = sin(q_spin)
    x7 = v_sway*x2 + x5*x6
    x8 = p_Jt*x7
    x9 = p_Ja*x4
    x10 = v_sway*x3
    x11 = a_swing*x0 - v_swing*x10
    x12 = v_spin*x6
    x13 = v_spin*x2
    x14 = x4*x8 - x7*x9 + p_Jt*(x2*x11 - x5*x12 - (v_sway*x13 + a_sway*x6))
    x15 = x5*x2 - v_sway*x6
    x16 = p_Jt*x15
    x17 = x15*x9 - x4*x16 + p_Jt*(a_sway*x2 - v_sway*x12 + (x5*x13 + x6*x11))
    x18 = sin(q_swing)
    x19 = v_sway*x0
    x20 = v_sway*x19 + a_sway*x3
    x21 = v_swing*x18
    x22 = x10*x21
    x23 = v_swing*x1
    x24 = c2*(x1*x20 - x22 + (x0*(v_swing*x23 + a_swing*x18) - x22))
    x25 = 0.9063077870366499*x0
    x26 = a_swing*x1 - v_swing*x21
    x27 = x10*x23
    x28 = 0.9063077870366499*x27
    x29 = x18*x20
    x30 = a_sway*x0 - v_sway*x10
    x31 = x25*x26 - x28 - (x28 + 0.9063077870366499*x29) - 0.42261826174069944*x30
    x32 = c2*x31
    x33 = 0.9063077870366499*x30 + 0.42261826174069944*(x0*x26 - x27 - (x27 + x29))
    x34 = c3*x33
    x35 = x7*x16 - x15*x8 + p_Ja*(a_spin - (v_swing*x19 + a_swing*x3))
    x36 = x0*(x2*x14 + x6*x17) + (x18*(x0*x24) + x1*(x25*x32 + x0*x34) - x3*x35)
    x37 = x3*(x1*x24 - 0.9063077870366499*(x18*x32) - x18*x34) + x0*(c4*x33 - c3*x31)
    out[0] = x0*x1*c1 + x36
    out[1] = x2*x17 + (x37 - x6*x14) - (x0*c5 + c1*(x3*x18))
    out[2] = x35


@njit(error_model="numpy")
def residual_jacobian(t, y, p, out):
    """Residual derivatives by q, v, a, lambda. 500 operations."""
    p_m = p[0]
    p_l = p[1]
    p_Ja = p[2]
    p_Jt = p[3]
    p_g = p[4]
    c0 = p_l*(p_m*p_l)
    c1 = p_l*(p_m*(0.42261826174069944*p_l))
    c2 = 0.42261826174069944*c1
    c3 = 0.42261826174069944*c0
    c4 = p_l*(p_m*p_g)
    c5 = 0.9063077870366499*c4
    c6 = p_m*(p_l*p_l)
    c7 = 0.17860619515673035*c6
    c8 = 0.9063077870366499*c6
    c9 = 0.9063077870366499*c1
    c10 = 0.9063077870366499*c0
    c11 = 0.42261826174069944*c4
    c12 = 0.8213938048432696*c6
    c13 = c7 + c12
    q_swing = y[0]
    q_sway = y[1]
    q_spin = y[2]
    v_swing = y[3]
    v_sway = y[4]
    v_spin = y[5]
    a_swing = y[6]
    a_sway = y[7]
    a_spin = y[8]
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
    x12 = c0*x11
    x13 = a_swing*x0 - v_swing*x7
    x14 = x5*x9
    x15 = x1*x13 - x14 - (x14 + x6*x4)
    x16 = c0*x15
    x17 = 0.9063077870366499*x1
    x18 = 0.9063077870366499*x5
    x19 = x7*x18
    x20 = 0.9063077870366499*x4
    x21 = x19 - x17*x10 - (x0*x20 - x19)
    x22 = c0*x21
    x23 = x11*c2
    x24 = a_sway*x1 - v_sway*x5
    x25 = 0.9063077870366499*x24
    x26 = x25 + 0.42261826174069944*x15
    x27 = c3*x26
    x28 = x9*x18
    x29 = x17*x13 - x28 - (x28 + x6*x20) - 0.42261826174069944*x24
    x30 = c0*x29
    x31 = x0*(x1*x12) + x6*(x1*x16) + (x0*(x17*x22 - x1*x23) - x6*(x1*x27 + x17*x30))
    x32 = x1*x6
    x33 = x32*c5
    x34 = cos(q_spin)
    x35 = v_swing*x3
    x36 = v_spin - x35
    x37 = p_Ja*x36
    x38 = sin(q_spin)
    x39 = x35*x38
    x40 = v_swing*x1
    x41 = v_sway*x34 + x40*x38
    x42 = p_Ja*x40
    x43 = p_Jt*x41
    x44 = p_Jt*x39
    x45 = v_spin*x38
    x46 = v_swing*x2 + a_swing*x3
    x47 = x37*x39 + x41*x42 - (x40*x43 + x36*x44) + p_Jt*(x35*x45 - x34*x46)
    x48 = x40*x34 - v_sway*x38
    x49 = p_Jt*x48
    x50 = x35*x34
    x51 = p_Jt*x50
    x52 = v_spin*x34
    x53 = x40*x49 + x36*x51 - (x37*x50 + x48*x42) - p_Jt*(x35*x52 + x38*x46)
    x54 = a_swing*x1 - v_swing*x5
    x55 = x36*x43 - x41*x37 + p_Jt*(x34*x54 - x40*x45 - (v_sway*x52 + a_sway*x38))
    x56 = x48*x37 - x36*x49 + p_Jt*(a_sway*x34 - v_sway*x45 + (x40*x52 + x38*x54))
    x57 = x2*x7
    x58 = c0*(x0*x24 - x57 - (x3*x10 + x57))
    x59 = 0.9063077870366499*x3
    x60 = x2*x9
    x61 = 0.9063077870366499*x60
    x62 = 0.42261826174069944*x4 - (x59*x13 + x61 + (x6*x25 + x61))
    x63 = c0*x62
    x64 = x20 + 0.42261826174069944*(x60 + x6*x24 + (x3*x13 + x60))
    x65 = c3*x64
    x66 = x6*(x1*x58 - x3*x12) + x0*(x17*x63 - x59*x30 - (x3*x27 + x1*x65))
    x67 = x43*x50 + x48*x44 - (x49*x39 + x41*x51) - p_Ja*x54
    x68 = x66 - (x1*(x41*x49 - x48*x43 + p_Ja*(a_spin - x46)) + x3*x67)
    x69 = x3*x0*c5
    x70 = x1*x38
    x71 = p_Jt*x70
    x72 = p_Ja*x3
    x73 = x36*x71 - x3*x43 - (x37*x70 - x41*x72) - p_Jt*(x1*x45 + x34*x5)
    x74 = x1*x34
    x75 = p_Jt*x74
    x76 = x37*x74 - x48*x72 - (x36*x75 - x3*x49) + p_Jt*(x1*x52 - x38*x5)
    x77 = x6*x5
    x78 = c0*(x1*(x9 + x9) - x77 - x77)
    x79 = x0*x18
    x80 = x7 + x7
    x81 = x79 + (x79 + x17*x80)
    x82 = c0*x81
    x83 = x0*x5
    x84 = x83 + (x83 + x1*x80)
    x85 = x84*c2
    x86 = x49*x70 + x41*x75 - (x43*x74 + x48*x71) - p_Ja*x2
    x87 = x1*(x34*x73 + x38*x76) + (x6*(x1*x78) - x0*(x17*x82 + x1*x85) - x3*x86)
    x88 = p_Jt*x34
    x89 = x36*x88 - x34*x37 - p_Jt*(x52 + x50)
    x90 = p_Jt*x38
    x91 = x36*x90 - x38*x37 - p_Jt*(x45 + x39)
    x92 = x2 + x2
    x93 = x3*x7
    x94 = c0*(x0*x92 - x93 - x93)
    x95 = x5 + x5
    x96 = x59*x9
    x97 = x6*x92
    x98 = 0.42261826174069944*x95 - (x96 + (x96 + 0.9063077870366499*x97))
    x99 = c0*x98
    x100 = x3*x9
    x101 = 0.9063077870366499*x95 + 0.42261826174069944*(x100 + (x100 + x97))
    x102 = c3*x101
    x103 = x34*x49 - x41*x90 - (x48*x88 - x38*x43) - x42
    x104 = x1*(x34*x89 + x38*x91) + (x6*(x1*x94) + x0*(x17*x99 - x1*x102) - x3*x103)
    x105 = x43 - p_Ja*x41 - x43
    x106 = x49 + (p_Ja*x48 - x49)
    x107 = x1*x1
    x108 = x3*x3
    x109 = x0*x0
    x110 = x6*x6
    x111 = p_Jt*x107 + (p_Ja*x108 + (x109*(c6*(x17*x17) + c7*x107) + c6*(x110*x107)))
    x112 = x3*(c6*(x6*(x1*x0)) - x0*(x32*c7 + x6*x17*c8))
    x113 = -x72
    x114 = x0*x16 - x6*x12 - 0.9063077870366499*(x0*x30 + x6*x22) - (x0*x27 - x6*x23)
    x115 = x1*(x0*x12 - 0.9063077870366499*(x6*x30) - x6*x27) + x3*(x0*x58 - 0.9063077870366499*(x6*x63) + x6*x65)
    x116 = x115 - (x3*(c10*x26 - c3*x29) + x1*(c3*x62 + c10*x64)) - x38*x47
    x117 = x3*(0.9063077870366499*(x6*x82) + x0*x78 + x6*x85) + x1*(c3*x81 - x84*c9)
    x118 = x3*(x0*x94 - 0.9063077870366499*(x6*x99) + x6*x102) - x1*(c3*x98 + c10*x101)
    out[0] = x31 - x33
    out[1] = x1*(x34*x47 + x38*x53) - x3*(x34*x55 + x38*x56) + x68 - x69
    out[3] = x87
    out[4] = x104
    out[5] = x1*(x34*x105 + x38*x106)
    out[6] = x111
    out[7] = x112
    out[8] = x113
    out[9] = x3*x114 - x1*(c3*x21 + x11*c9) - x69
    out[10] = x34*x53 + x116 - (x33 - x3*c11)
    out[12] = x34*x76 + (x117 - x38*x73)
    out[13] = x34*x91 + (x118 - x38*x89)
    out[14] = x34*x106 - x38*x105
    out[15] = x112
    out[16] = p_Jt + (x107*c13 + x108*(c7*x110 + (c6*x109 + x110*c12)))
    out[19] = x67
    out[21] = x86
    out[22] = x103
    out[24] = x113
    out[26] = p_Ja


@njit(error_model="numpy")
def poses(t, y, p, out):
    """Per body: position, rotation matrix (body to world). 70 operations."""
    p_l = p[1]
    c0 = 0.5*p_l
    q_swing = y[0]
    q_sway = y[1]
    q_spin = y[2]
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
    out[12] = -(x4*c0)
    out[13] = x6*c0
    out[14] = x9*c0
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
    p_l = p[1]
    q_swing = y[0]
    q_sway = y[1]
    x0 = 0.9063077870366499*(cos(q_sway)*sin(q_swing)) - 0.42261826174069944*sin(q_sway)
    out[0] = p_l*x0


@njit(error_model="numpy")
def marks(t, y, p, out):
    """What a picture shows besides bodies, as `marks` lists it. 2 operations."""
    p_l = p[1]
    c0 = -(0.5*p_l)
    out[2] = c0


@njit(error_model="numpy")
def limits(t, y, p, out):
    """Numbers of parameters that have a bound. 0 operations."""
    p_m = p[0]
    p_l = p[1]
    p_Ja = p[2]
    p_Jt = p[3]
    out[0] = p_m
    out[1] = p_Jt
    out[2] = p_Ja
    out[3] = p_Jt
    out[4] = p_Ja
    out[5] = p_Jt
    out[6] = p_l
