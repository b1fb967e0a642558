"""spring_chain: equations of motion, written by symgen 0.1.0. Do not edit.

Heavy chain of 10 masses on stiff springs, falling from horizontal
"""

from math import sqrt

from numba import njit

MODEL = {
    "abi": 1,
    "generator": "symgen 0.1.0",
    "source": "sha256:fce6451c5e56c962a27eb2bbb7a8602a76f95a66fefc55f35f301dd9d044409c",
    "name": "spring_chain",
    "description": "Heavy chain of 10 masses on stiff springs, falling from horizontal",
    "nq": 20,
    "nv": 20,
    "nh": 0,
    "nn": 0,
    "nw": 1,
    "coordinates": [
        {"name": "x1", "unit": "m", "value": 0.2, "enforced": True},
        {"name": "y1", "unit": "m", "value": 0.0, "enforced": True},
        {"name": "x2", "unit": "m", "value": 0.4, "enforced": True},
        {"name": "y2", "unit": "m", "value": 0.0, "enforced": True},
        {"name": "x3", "unit": "m", "value": 0.6000000000000001, "enforced": True},
        {"name": "y3", "unit": "m", "value": 0.0, "enforced": True},
        {"name": "x4", "unit": "m", "value": 0.8, "enforced": True},
        {"name": "y4", "unit": "m", "value": 0.0, "enforced": True},
        {"name": "x5", "unit": "m", "value": 1.0, "enforced": True},
        {"name": "y5", "unit": "m", "value": 0.0, "enforced": True},
        {"name": "x6", "unit": "m", "value": 1.2000000000000002, "enforced": True},
        {"name": "y6", "unit": "m", "value": 0.0, "enforced": True},
        {"name": "x7", "unit": "m", "value": 1.4000000000000001, "enforced": True},
        {"name": "y7", "unit": "m", "value": 0.0, "enforced": True},
        {"name": "x8", "unit": "m", "value": 1.6, "enforced": True},
        {"name": "y8", "unit": "m", "value": 0.0, "enforced": True},
        {"name": "x9", "unit": "m", "value": 1.8, "enforced": True},
        {"name": "y9", "unit": "m", "value": 0.0, "enforced": True},
        {"name": "x10", "unit": "m", "value": 2.0, "enforced": True},
        {"name": "y10", "unit": "m", "value": 0.0, "enforced": True},
    ],
    "quaternions": [],
    "rates": [
        {"name": "x1", "unit": "m/s", "value": 0.0, "enforced": True},
        {"name": "y1", "unit": "m/s", "value": 0.0, "enforced": True},
        {"name": "x2", "unit": "m/s", "value": 0.0, "enforced": True},
        {"name": "y2", "unit": "m/s", "value": 0.0, "enforced": True},
        {"name": "x3", "unit": "m/s", "value": 0.0, "enforced": True},
        {"name": "y3", "unit": "m/s", "value": 0.0, "enforced": True},
        {"name": "x4", "unit": "m/s", "value": 0.0, "enforced": True},
        {"name": "y4", "unit": "m/s", "value": 0.0, "enforced": True},
        {"name": "x5", "unit": "m/s", "value": 0.0, "enforced": True},
        {"name": "y5", "unit": "m/s", "value": 0.0, "enforced": True},
        {"name": "x6", "unit": "m/s", "value": 0.0, "enforced": True},
        {"name": "y6", "unit": "m/s", "value": 0.0, "enforced": True},
        {"name": "x7", "unit": "m/s", "value": 0.0, "enforced": True},
        {"name": "y7", "unit": "m/s", "value": 0.0, "enforced": True},
        {"name": "x8", "unit": "m/s", "value": 0.0, "enforced": True},
        {"name": "y8", "unit": "m/s", "value": 0.0, "enforced": True},
        {"name": "x9", "unit": "m/s", "value": 0.0, "enforced": True},
        {"name": "y9", "unit": "m/s", "value": 0.0, "enforced": True},
        {"name": "x10", "unit": "m/s", "value": 0.0, "enforced": True},
        {"name": "y10", "unit": "m/s", "value": 0.0, "enforced": True},
    ],
    "parameters": [
        {"name": "m", "unit": "kg", "value": 0.5, "doc": "each mass"},
        {"name": "l", "unit": "m", "value": 0.2, "doc": "slack length of each spring"},
        {"name": "k", "unit": "N/m", "value": 100000.0, "doc": "stiffness of each spring"},
        {"name": "c", "unit": "N*s/m", "value": 20.0, "doc": "damping of each spring"},
        {"name": "g", "unit": "m/s^2", "value": 9.81, "doc": ""},
    ],
    "inputs": [],
    "constants": [],
    "constraints": [],
    "outputs": [],
    "events": [],
    "bodies": [
        {"name": "mass1", "planar": True, "shape": "sphere", "sizes": 1, "mesh": ""},
        {"name": "mass2", "planar": True, "shape": "sphere", "sizes": 1, "mesh": ""},
        {"name": "mass3", "planar": True, "shape": "sphere", "sizes": 1, "mesh": ""},
        {"name": "mass4", "planar": True, "shape": "sphere", "sizes": 1, "mesh": ""},
        {"name": "mass5", "planar": True, "shape": "sphere", "sizes": 1, "mesh": ""},
        {"name": "mass6", "planar": True, "shape": "sphere", "sizes": 1, "mesh": ""},
        {"name": "mass7", "planar": True, "shape": "sphere", "sizes": 1, "mesh": ""},
        {"name": "mass8", "planar": True, "shape": "sphere", "sizes": 1, "mesh": ""},
        {"name": "mass9", "planar": True, "shape": "sphere", "sizes": 1, "mesh": ""},
        {"name": "mass10", "planar": True, "shape": "sphere", "sizes": 1, "mesh": ""},
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
        "rhs": 384,
        "mass_matrix": 0,
        "forces": 323,
        "energy": 169,
        "residual": 343,
        "residual_jacobian": 760,
        "poses": 0,
        "shapes": 0,
        "marks": 0,
        "limits": 0,
    },
    "hoisted": {
        "rhs": 2,
        "forces": 1,
        "energy": 3,
        "residual": 1,
    },
    "run": {
        "t_end": 3.0,
        "fps": 60.0,
    },
    "limits": [
        {"name": "bodies.mass1.mass", "bound": "zero or more"},
    ],
    "subsystems": [],
    "marks": [
        {"kind": "spring", "name": "spring1", "body": "", "numbers": 6, "moves": True},
        {"kind": "spring", "name": "spring2", "body": "", "numbers": 6, "moves": True},
        {"kind": "spring", "name": "spring3", "body": "", "numbers": 6, "moves": True},
        {"kind": "spring", "name": "spring4", "body": "", "numbers": 6, "moves": True},
        {"kind": "spring", "name": "spring5", "body": "", "numbers": 6, "moves": True},
        {"kind": "spring", "name": "spring6", "body": "", "numbers": 6, "moves": True},
        {"kind": "spring", "name": "spring7", "body": "", "numbers": 6, "moves": True},
        {"kind": "spring", "name": "spring8", "body": "", "numbers": 6, "moves": True},
        {"kind": "spring", "name": "spring9", "body": "", "numbers": 6, "moves": True},
        {"kind": "spring", "name": "spring10", "body": "", "numbers": 6, "moves": True},
        {"kind": "ground", "name": "hook", "body": "", "numbers": 3},
    ],
}

@njit(error_model="numpy")
def rhs(t, y, p, out):
    """State derivative: rates, accelerations, power. 384 operations."""
    p_m = p[0]
    p_l = p[1]
    p_k = p[2]
    p_c = p[3]
    p_g = p[4]
    c0 = 1.0/p_m
    c1 = p_m*p_g
    q_x1 = y[0]
    q_y1 = y[1]
    q_x2 = y[2]
    q_y2 = y[3]
    q_x3 = y[4]
    q_y3 = y[5]
    q_x4 = y[6]
    q_y4 = y[7]
    q_x5 = y[8]
    q_y5 = y[9]
    q_x6 = y[10]
    q_y6 = y[11]
    q_x7 = y[12]
    q_y7 = y[13]
    q_x8 = y[14]
    q_y8 = y[15]
    q_x9 = y[16]
    q_y9 = y[17]
    q_x10 = y[18]
    q_y10 = y[19]
    v_x1 = y[20]
    v_y1 = y[21]
    v_x2 = y[22]
    v_y2 = y[23]
    v_x3 = y[24]
    v_y3 = y[25]
    v_x4 = y[26]
    v_y4 = y[27]
    v_x5 = y[28]
    v_y5 = y[29]
    v_x6 = y[30]
    v_y6 = y[31]
    v_x7 = y[32]
    v_y7 = y[33]
    v_x8 = y[34]
    v_y8 = y[35]
    v_x9 = y[36]
    v_y9 = y[37]
    v_x10 = y[38]
    v_y10 = y[39]
    x0 = 2.0*q_x1
    x1 = sqrt(q_x1*q_x1 + q_y1*q_y1)
    x2 = 0.5/x1
    x3 = 2.0*q_y1
    x4 = p_c*(x2*((v_x1*x0 + v_y1*x3)*x2))
    x5 = q_x2 - q_x1
    x6 = 2.0*x5
    x7 = q_y2 - q_y1
    x8 = sqrt(x5*x5 + x7*x7)
    x9 = 0.5/x8
    x10 = 2.0*x7
    x11 = p_c*(x9*(((v_x2 - v_x1)*x6 + (v_y2 - v_y1)*x10)*x9))
    x12 = x6*x11
    x13 = x0*x4 - x12
    x14 = p_k*((x1 - p_l)*x2)
    x15 = p_k*((x8 - p_l)*x9)
    x16 = x6*x15
    x17 = x10*x11
    x18 = x3*x4 - x17
    x19 = x10*x15
    x20 = q_x3 - q_x2
    x21 = 2.0*x20
    x22 = q_y3 - q_y2
    x23 = sqrt(x20*x20 + x22*x22)
    x24 = 0.5/x23
    x25 = 2.0*x22
    x26 = p_c*(x24*(((v_x3 - v_x2)*x21 + (v_y3 - v_y2)*x25)*x24))
    x27 = x21*x26
    x28 = x12 - x27
    x29 = p_k*((x23 - p_l)*x24)
    x30 = x21*x29
    x31 = x25*x26
    x32 = x17 - x31
    x33 = x25*x29
    x34 = q_x4 - q_x3
    x35 = 2.0*x34
    x36 = q_y4 - q_y3
    x37 = sqrt(x34*x34 + x36*x36)
    x38 = 0.5/x37
    x39 = 2.0*x36
    x40 = p_c*(x38*(((v_x4 - v_x3)*x35 + (v_y4 - v_y3)*x39)*x38))
    x41 = x35*x40
    x42 = x27 - x41
    x43 = p_k*((x37 - p_l)*x38)
    x44 = x35*x43
    x45 = x39*x40
    x46 = x31 - x45
    x47 = x39*x43
    x48 = q_x5 - q_x4
    x49 = 2.0*x48
    x50 = q_y5 - q_y4
    x51 = sqrt(x48*x48 + x50*x50)
    x52 = 0.5/x51
    x53 = 2.0*x50
    x54 = p_c*(x52*(((v_x5 - v_x4)*x49 + (v_y5 - v_y4)*x53)*x52))
    x55 = x49*x54
    x56 = x41 - x55
    x57 = p_k*((x51 - p_l)*x52)
    x58 = x49*x57
    x59 = x53*x54
    x60 = x45 - x59
    x61 = x53*x57
    x62 = q_x6 - q_x5
    x63 = 2.0*x62
    x64 = q_y6 - q_y5
    x65 = sqrt(x62*x62 + x64*x64)
    x66 = 0.5/x65
    x67 = 2.0*x64
    x68 = p_c*(x66*(((v_x6 - v_x5)*x63 + (v_y6 - v_y5)*x67)*x66))
    x69 = x63*x68
    x70 = x55 - x69
    x71 = p_k*((x65 - p_l)*x66)
    x72 = x63*x71
    x73 = x67*x68
    x74 = x59 - x73
    x75 = x67*x71
    x76 = q_x7 - q_x6
    x77 = 2.0*x76
    x78 = q_y7 - q_y6
    x79 = sqrt(x76*x76 + x78*x78)
    x80 = 0.5/x79
    x81 = 2.0*x78
    x82 = p_c*(x80*(((v_x7 - v_x6)*x77 + (v_y7 - v_y6)*x81)*x80))
    x83 = x77*x82
    x84 = x69 - x83
    x85 = p_k*((x79 - p_l)*x80)
    x86 = x77*x85
    x87 = x81*x82
    x88 = x73 - x87
    x89 = x81*x85
    x90 = q_x8 - q_x7
    x91 = 2.0*x90
    x92 = q_y8 - q_y7
    x93 = sqrt(x90*x90 + x92*x92)
    x94 = 0.5/x93
    x95 = 2.0*x92
    x96 = p_c*(x94*(((v_x8 - v_x7)*x91 + (v_y8 - v_y7)*x95)*x94))
    x97 = x91*x96
    x98 = x83 - x97
    x99 = p_k*((x93 - p_l)*x94)
    x100 = x91*x99
    x101 = x95*x96
    x102 = x87 - x101
    x103 = x95*x99
    x104 = q_x9 - q_x8
    x105 = 2.0*x104
    x106 = q_y9 - q_y8
    x107 = sqrt(x104*x104 + x106*x106)
    x108 = 0.5/x107
    x109 = 2.0*x106
    x110 = p_c*(x108*(((v_x9 - v_x8)*x105 + (v_y9 - v_y8)*x109)*x108))
    x111 = x105*x110
    x112 = x97 - x111
    x113 = p_k*((x107 - p_l)*x108)
    x114 = x105*x113
    x115 = x109*x110
    x116 = x101 - x115
    x117 = x109*x113
    x118 = q_x10 - q_x9
    x119 = 2.0*x118
    x120 = q_y10 - q_y9
    x121 = sqrt(x118*x118 + x120*x120)
    x122 = 0.5/x121
    x123 = 2.0*x120
    x124 = p_c*(x122*(((v_x10 - v_x9)*x119 + (v_y10 - v_y9)*x123)*x122))
    x125 = x119*x124
    x126 = x111 - x125
    x127 = p_k*((x121 - p_l)*x122)
    x128 = x119*x127
    x129 = x123*x124
    x130 = x115 - x129
    x131 = x123*x127
    x132 = v_x1*x13 + v_y1*x18 + v_x2*x28 + v_y2*x32 + v_x3*x42 + v_y3*x46
    x133 = x132 + v_x4*x56 + v_y4*x60 + v_x5*x70 + v_y5*x74 + v_x6*x84 + v_y6*x88
    x134 = x133 + v_x7*x98 + v_y7*x102 + v_x8*x112 + v_y8*x116 + v_x9*x126
    out[0] = v_x1
    out[1] = v_y1
    out[2] = v_x2
    out[3] = v_y2
    out[4] = v_x3
    out[5] = v_y3
    out[6] = v_x4
    out[7] = v_y4
    out[8] = v_x5
    out[9] = v_y5
    out[10] = v_x6
    out[11] = v_y6
    out[12] = v_x7
    out[13] = v_y7
    out[14] = v_x8
    out[15] = v_y8
    out[16] = v_x9
    out[17] = v_y9
    out[18] = v_x10
    out[19] = v_y10
    out[20] = -(c0*(x13 + (x0*x14 - x16)))
    out[21] = -(c0*(x18 + (c1 - x19 + x3*x14)))
    out[22] = -(c0*(x28 + (x16 - x30)))
    out[23] = -(c0*(x32 + (c1 - x33 + x19)))
    out[24] = -(c0*(x42 + (x30 - x44)))
    out[25] = -(c0*(x46 + (c1 - x47 + x33)))
    out[26] = -(c0*(x56 + (x44 - x58)))
    out[27] = -(c0*(x60 + (c1 - x61 + x47)))
    out[28] = -(c0*(x70 + (x58 - x72)))
    out[29] = -(c0*(x74 + (c1 - x75 + x61)))
    out[30] = -(c0*(x84 + (x72 - x86)))
    out[31] = -(c0*(x88 + (c1 - x89 + x75)))
    out[32] = -(c0*(x98 + (x86 - x100)))
    out[33] = -(c0*(x102 + (c1 - x103 + x89)))
    out[34] = -(c0*(x112 + (x100 - x114)))
    out[35] = -(c0*(x116 + (c1 - x117 + x103)))
    out[36] = -(c0*(x126 + (x114 - x128)))
    out[37] = -(c0*(x130 + (c1 - x131 + x117)))
    out[38] = -(c0*(x125 + x128))
    out[39] = -(c0*(x129 + (c1 + x131)))
    out[40] = -(x134 + v_y9*x130 + v_x10*x125 + v_y10*x129)


@njit(error_model="numpy")
def mass_matrix(t, y, p, out):
    """Mass matrix M, row by row. 0 operations."""
    p_m = p[0]
    out[0] = p_m
    out[21] = p_m
    out[42] = p_m
    out[63] = p_m
    out[84] = p_m
    out[105] = p_m
    out[126] = p_m
    out[147] = p_m
    out[168] = p_m
    out[189] = p_m
    out[210] = p_m
    out[231] = p_m
    out[252] = p_m
    out[273] = p_m
    out[294] = p_m
    out[315] = p_m
    out[336] = p_m
    out[357] = p_m
    out[378] = p_m
    out[399] = p_m


@njit(error_model="numpy")
def forces(t, y, p, out):
    """Forces f of M a = f + G^T lambda. 323 operations."""
    p_m = p[0]
    p_l = p[1]
    p_k = p[2]
    p_c = p[3]
    p_g = p[4]
    c0 = p_m*p_g
    q_x1 = y[0]
    q_y1 = y[1]
    q_x2 = y[2]
    q_y2 = y[3]
    q_x3 = y[4]
    q_y3 = y[5]
    q_x4 = y[6]
    q_y4 = y[7]
    q_x5 = y[8]
    q_y5 = y[9]
    q_x6 = y[10]
    q_y6 = y[11]
    q_x7 = y[12]
    q_y7 = y[13]
    q_x8 = y[14]
    q_y8 = y[15]
    q_x9 = y[16]
    q_y9 = y[17]
    q_x10 = y[18]
    q_y10 = y[19]
    v_x1 = y[20]
    v_y1 = y[21]
    v_x2 = y[22]
    v_y2 = y[23]
    v_x3 = y[24]
    v_y3 = y[25]
    v_x4 = y[26]
    v_y4 = y[27]
    v_x5 = y[28]
    v_y5 = y[29]
    v_x6 = y[30]
    v_y6 = y[31]
    v_x7 = y[32]
    v_y7 = y[33]
    v_x8 = y[34]
    v_y8 = y[35]
    v_x9 = y[36]
    v_y9 = y[37]
    v_x10 = y[38]
    v_y10 = y[39]
    x0 = 2.0*q_x1
    x1 = sqrt(q_x1*q_x1 + q_y1*q_y1)
    x2 = 0.5/x1
    x3 = 2.0*q_y1
    x4 = p_c*(x2*((v_x1*x0 + v_y1*x3)*x2))
    x5 = q_x2 - q_x1
    x6 = 2.0*x5
    x7 = q_y2 - q_y1
    x8 = sqrt(x5*x5 + x7*x7)
    x9 = 0.5/x8
    x10 = 2.0*x7
    x11 = p_c*(x9*(((v_x2 - v_x1)*x6 + (v_y2 - v_y1)*x10)*x9))
    x12 = x6*x11
    x13 = p_k*((x1 - p_l)*x2)
    x14 = p_k*((x8 - p_l)*x9)
    x15 = x6*x14
    x16 = x10*x11
    x17 = x10*x14
    x18 = q_x3 - q_x2
    x19 = 2.0*x18
    x20 = q_y3 - q_y2
    x21 = sqrt(x18*x18 + x20*x20)
    x22 = 0.5/x21
    x23 = 2.0*x20
    x24 = p_c*(x22*(((v_x3 - v_x2)*x19 + (v_y3 - v_y2)*x23)*x22))
    x25 = x19*x24
    x26 = p_k*((x21 - p_l)*x22)
    x27 = x19*x26
    x28 = x23*x24
    x29 = x23*x26
    x30 = q_x4 - q_x3
    x31 = 2.0*x30
    x32 = q_y4 - q_y3
    x33 = sqrt(x30*x30 + x32*x32)
    x34 = 0.5/x33
    x35 = 2.0*x32
    x36 = p_c*(x34*(((v_x4 - v_x3)*x31 + (v_y4 - v_y3)*x35)*x34))
    x37 = x31*x36
    x38 = p_k*((x33 - p_l)*x34)
    x39 = x31*x38
    x40 = x35*x36
    x41 = x35*x38
    x42 = q_x5 - q_x4
    x43 = 2.0*x42
    x44 = q_y5 - q_y4
    x45 = sqrt(x42*x42 + x44*x44)
    x46 = 0.5/x45
    x47 = 2.0*x44
    x48 = p_c*(x46*(((v_x5 - v_x4)*x43 + (v_y5 - v_y4)*x47)*x46))
    x49 = x43*x48
    x50 = p_k*((x45 - p_l)*x46)
    x51 = x43*x50
    x52 = x47*x48
    x53 = x47*x50
    x54 = q_x6 - q_x5
    x55 = 2.0*x54
    x56 = q_y6 - q_y5
    x57 = sqrt(x54*x54 + x56*x56)
    x58 = 0.5/x57
    x59 = 2.0*x56
    x60 = p_c*(x58*(((v_x6 - v_x5)*x55 + (v_y6 - v_y5)*x59)*x58))
    x61 = x55*x60
    x62 = p_k*((x57 - p_l)*x58)
    x63 = x55*x62
    x64 = x59*x60
    x65 = x59*x62
    x66 = q_x7 - q_x6
    x67 = 2.0*x66
    x68 = q_y7 - q_y6
    x69 = sqrt(x66*x66 + x68*x68)
    x70 = 0.5/x69
    x71 = 2.0*x68
    x72 = p_c*(x70*(((v_x7 - v_x6)*x67 + (v_y7 - v_y6)*x71)*x70))
    x73 = x67*x72
    x74 = p_k*((x69 - p_l)*x70)
    x75 = x67*x74
    x76 = x71*x72
    x77 = x71*x74
    x78 = q_x8 - q_x7
    x79 = 2.0*x78
    x80 = q_y8 - q_y7
    x81 = sqrt(x78*x78 + x80*x80)
    x82 = 0.5/x81
    x83 = 2.0*x80
    x84 = p_c*(x82*(((v_x8 - v_x7)*x79 + (v_y8 - v_y7)*x83)*x82))
    x85 = x79*x84
    x86 = p_k*((x81 - p_l)*x82)
    x87 = x79*x86
    x88 = x83*x84
    x89 = x83*x86
    x90 = q_x9 - q_x8
    x91 = 2.0*x90
    x92 = q_y9 - q_y8
    x93 = sqrt(x90*x90 + x92*x92)
    x94 = 0.5/x93
    x95 = 2.0*x92
    x96 = p_c*(x94*(((v_x9 - v_x8)*x91 + (v_y9 - v_y8)*x95)*x94))
    x97 = x91*x96
    x98 = p_k*((x93 - p_l)*x94)
    x99 = x91*x98
    x100 = x95*x96
    x101 = x95*x98
    x102 = q_x10 - q_x9
    x103 = 2.0*x102
    x104 = q_y10 - q_y9
    x105 = sqrt(x102*x102 + x104*x104)
    x106 = 0.5/x105
    x107 = 2.0*x104
    x108 = p_c*(x106*(((v_x10 - v_x9)*x103 + (v_y10 - v_y9)*x107)*x106))
    x109 = x103*x108
    x110 = p_k*((x105 - p_l)*x106)
    x111 = x103*x110
    x112 = x107*x108
    x113 = x107*x110
    out[0] = -(x0*x4 - x12 + (x0*x13 - x15))
    out[1] = -(x3*x4 - x16 + (c0 - x17 + x3*x13))
    out[2] = -(x12 - x25 + (x15 - x27))
    out[3] = -(x16 - x28 + (c0 - x29 + x17))
    out[4] = -(x25 - x37 + (x27 - x39))
    out[5] = -(x28 - x40 + (c0 - x41 + x29))
    out[6] = -(x37 - x49 + (x39 - x51))
    out[7] = -(x40 - x52 + (c0 - x53 + x41))
    out[8] = -(x49 - x61 + (x51 - x63))
    out[9] = -(x52 - x64 + (c0 - x65 + x53))
    out[10] = -(x61 - x73 + (x63 - x75))
    out[11] = -(x64 - x76 + (c0 - x77 + x65))
    out[12] = -(x73 - x85 + (x75 - x87))
    out[13] = -(x76 - x88 + (c0 - x89 + x77))
    out[14] = -(x85 - x97 + (x87 - x99))
    out[15] = -(x88 - x100 + (c0 - x101 + x89))
    out[16] = -(x97 - x109 + (x99 - x111))
    out[17] = -(x100 - x112 + (c0 - x113 + x101))
    out[18] = -(x109 + x111)
    out[19] = -(x112 + (c0 + x113))


@njit(error_model="numpy")
def energy(t, y, p, out):
    """Kinetic and potential energy. 169 operations."""
    p_m = p[0]
    p_l = p[1]
    p_k = p[2]
    p_g = p[4]
    c0 = 0.5*p_m
    c1 = 0.5*p_k
    c2 = p_m*p_g
    q_x1 = y[0]
    q_y1 = y[1]
    q_x2 = y[2]
    q_y2 = y[3]
    q_x3 = y[4]
    q_y3 = y[5]
    q_x4 = y[6]
    q_y4 = y[7]
    q_x5 = y[8]
    q_y5 = y[9]
    q_x6 = y[10]
    q_y6 = y[11]
    q_x7 = y[12]
    q_y7 = y[13]
    q_x8 = y[14]
    q_y8 = y[15]
    q_x9 = y[16]
    q_y9 = y[17]
    q_x10 = y[18]
    q_y10 = y[19]
    v_x1 = y[20]
    v_y1 = y[21]
    v_x2 = y[22]
    v_y2 = y[23]
    v_x3 = y[24]
    v_y3 = y[25]
    v_x4 = y[26]
    v_y4 = y[27]
    v_x5 = y[28]
    v_y5 = y[29]
    v_x6 = y[30]
    v_y6 = y[31]
    v_x7 = y[32]
    v_y7 = y[33]
    v_x8 = y[34]
    v_y8 = y[35]
    v_x9 = y[36]
    v_y9 = y[37]
    v_x10 = y[38]
    v_y10 = y[39]
    x0 = c0*(v_x1*v_x1 + v_y1*v_y1) + c0*(v_x2*v_x2 + v_y2*v_y2) + c0*(v_x3*v_x3 + v_y3*v_y3)
    x1 = x0 + c0*(v_x4*v_x4 + v_y4*v_y4) + c0*(v_x5*v_x5 + v_y5*v_y5) + c0*(v_x6*v_x6 + v_y6*v_y6)
    x2 = x1 + c0*(v_x7*v_x7 + v_y7*v_y7) + c0*(v_x8*v_x8 + v_y8*v_y8) + c0*(v_x9*v_x9 + v_y9*v_y9)
    x3 = q_x9 - q_x8
    x4 = q_y9 - q_y8
    x5 = sqrt(x3*x3 + x4*x4) - p_l
    x6 = q_x8 - q_x7
    x7 = q_y8 - q_y7
    x8 = sqrt(x6*x6 + x7*x7) - p_l
    x9 = q_x7 - q_x6
    x10 = q_y7 - q_y6
    x11 = sqrt(x9*x9 + x10*x10) - p_l
    x12 = q_x6 - q_x5
    x13 = q_y6 - q_y5
    x14 = sqrt(x12*x12 + x13*x13) - p_l
    x15 = q_x5 - q_x4
    x16 = q_y5 - q_y4
    x17 = sqrt(x15*x15 + x16*x16) - p_l
    x18 = q_x4 - q_x3
    x19 = q_y4 - q_y3
    x20 = sqrt(x18*x18 + x19*x19) - p_l
    x21 = q_x3 - q_x2
    x22 = q_y3 - q_y2
    x23 = sqrt(x21*x21 + x22*x22) - p_l
    x24 = q_x2 - q_x1
    x25 = q_y2 - q_y1
    x26 = sqrt(x24*x24 + x25*x25) - p_l
    x27 = sqrt(q_x1*q_x1 + q_y1*q_y1) - p_l
    x28 = q_x10 - q_x9
    x29 = q_y10 - q_y9
    x30 = sqrt(x28*x28 + x29*x29) - p_l
    x31 = c1*(x20*x20) + (c1*(x23*x23) + (c1*(x26*x26) + (x27*x27*c1 + c1*(x30*x30))))
    x32 = c1*(x8*x8) + (c1*(x11*x11) + (c1*(x14*x14) + (c1*(x17*x17) + x31)))
    x33 = q_y1*c2 + q_y2*c2 + q_y3*c2 + q_y4*c2 + q_y5*c2 + q_y6*c2 + q_y7*c2
    out[0] = x2 + c0*(v_x10*v_x10 + v_y10*v_y10)
    out[1] = c1*(x5*x5) + x32 + (x33 + q_y8*c2 + q_y9*c2 + q_y10*c2)


@njit(error_model="numpy")
def residual(t, y, p, out):
    """M a - f - G^T lambda, then G a - gamma. 343 operations."""
    p_m = p[0]
    p_l = p[1]
    p_k = p[2]
    p_c = p[3]
    p_g = p[4]
    c0 = p_m*p_g
    q_x1 = y[0]
    q_y1 = y[1]
    q_x2 = y[2]
    q_y2 = y[3]
    q_x3 = y[4]
    q_y3 = y[5]
    q_x4 = y[6]
    q_y4 = y[7]
    q_x5 = y[8]
    q_y5 = y[9]
    q_x6 = y[10]
    q_y6 = y[11]
    q_x7 = y[12]
    q_y7 = y[13]
    q_x8 = y[14]
    q_y8 = y[15]
    q_x9 = y[16]
    q_y9 = y[17]
    q_x10 = y[18]
    q_y10 = y[19]
    v_x1 = y[20]
    v_y1 = y[21]
    v_x2 = y[22]
    v_y2 = y[23]
    v_x3 = y[24]
    v_y3 = y[25]
    v_x4 = y[26]
    v_y4 = y[27]
    v_x5 = y[28]
    v_y5 = y[29]
    v_x6 = y[30]
    v_y6 = y[31]
    v_x7 = y[32]
    v_y7 = y[33]
    v_x8 = y[34]
    v_y8 = y[35]
    v_x9 = y[36]
    v_y9 = y[37]
    v_x10 = y[38]
    v_y10 = y[39]
    a_x1 = y[40]
    a_y1 = y[41]
    a_x2 = y[42]
    a_y2 = y[43]
    a_x3 = y[44]
    a_y3 = y[45]
    a_x4 = y[46]
    a_y4 = y[47]
    a_x5 = y[48]
    a_y5 = y[49]
    a_x6 = y[50]
    a_y6 = y[51]
    a_x7 = y[52]
    a_y7 = y[53]
    a_x8 = y[54]
    a_y8 = y[55]
    a_x9 = y[56]
    a_y9 = y[57]
    a_x10 = y[58]
    a_y10 = y[59]
    x0 = 2.0*q_x1
    x1 = sqrt(q_x1*q_x1 + q_y1*q_y1)
    x2 = 0.5/x1
    x3 = p_k*((x1 - p_l)*x2)
    x4 = q_x2 - q_x1
    x5 = 2.0*x4
    x6 = q_y2 - q_y1
    x7 = sqrt(x4*x4 + x6*x6)
    x8 = 0.5/x7
    x9 = p_k*((x7 - p_l)*x8)
    x10 = x5*x9
    x11 = 2.0*q_y1
    x12 = p_c*(x2*((v_x1*x0 + v_y1*x11)*x2))
    x13 = 2.0*x6
    x14 = p_c*(x8*(((v_x2 - v_x1)*x5 + (v_y2 - v_y1)*x13)*x8))
    x15 = x5*x14
    x16 = x13*x9
    x17 = x13*x14
    x18 = q_x3 - q_x2
    x19 = 2.0*x18
    x20 = q_y3 - q_y2
    x21 = sqrt(x18*x18 + x20*x20)
    x22 = 0.5/x21
    x23 = p_k*((x21 - p_l)*x22)
    x24 = x19*x23
    x25 = 2.0*x20
    x26 = p_c*(x22*(((v_x3 - v_x2)*x19 + (v_y3 - v_y2)*x25)*x22))
    x27 = x19*x26
    x28 = x25*x23
    x29 = x25*x26
    x30 = q_x4 - q_x3
    x31 = 2.0*x30
    x32 = q_y4 - q_y3
    x33 = sqrt(x30*x30 + x32*x32)
    x34 = 0.5/x33
    x35 = p_k*((x33 - p_l)*x34)
    x36 = x31*x35
    x37 = 2.0*x32
    x38 = p_c*(x34*(((v_x4 - v_x3)*x31 + (v_y4 - v_y3)*x37)*x34))
    x39 = x31*x38
    x40 = x37*x35
    x41 = x37*x38
    x42 = q_x5 - q_x4
    x43 = 2.0*x42
    x44 = q_y5 - q_y4
    x45 = sqrt(x42*x42 + x44*x44)
    x46 = 0.5/x45
    x47 = p_k*((x45 - p_l)*x46)
    x48 = x43*x47
    x49 = 2.0*x44
    x50 = p_c*(x46*(((v_x5 - v_x4)*x43 + (v_y5 - v_y4)*x49)*x46))
    x51 = x43*x50
    x52 = x49*x47
    x53 = x49*x50
    x54 = q_x6 - q_x5
    x55 = 2.0*x54
    x56 = q_y6 - q_y5
    x57 = sqrt(x54*x54 + x56*x56)
    x58 = 0.5/x57
    x59 = p_k*((x57 - p_l)*x58)
    x60 = x55*x59
    x61 = 2.0*x56
    x62 = p_c*(x58*(((v_x6 - v_x5)*x55 + (v_y6 - v_y5)*x61)*x58))
    x63 = x55*x62
    x64 = x61*x59
    x65 = x61*x62
    x66 = q_x7 - q_x6
    x67 = 2.0*x66
    x68 = q_y7 - q_y6
    x69 = sqrt(x66*x66 + x68*x68)
    x70 = 0.5/x69
    x71 = p_k*((x69 - p_l)*x70)
    x72 = x67*x71
    x73 = 2.0*x68
    x74 = p_c*(x70*(((v_x7 - v_x6)*x67 + (v_y7 - v_y6)*x73)*x70))
    x75 = x67*x74
    x76 = x73*x71
    x77 = x73*x74
    x78 = q_x8 - q_x7
    x79 = 2.0*x78
    x80 = q_y8 - q_y7
    x81 = sqrt(x78*x78 + x80*x80)
    x82 = 0.5/x81
    x83 = p_k*((x81 - p_l)*x82)
    x84 = x79*x83
    x85 = 2.0*x80
    x86 = p_c*(x82*(((v_x8 - v_x7)*x79 + (v_y8 - v_y7)*x85)*x82))
    x87 = x79*x86
    x88 = x85*x83
    x89 = x85*x86
    x90 = q_x9 - q_x8
    x91 = 2.0*x90
    x92 = q_y9 - q_y8
    x93 = sqrt(x90*x90 + x92*x92)
    x94 = 0.5/x93
    x95 = p_k*((x93 - p_l)*x94)
    x96 = x91*x95
    x97 = 2.0*x92
    x98 = p_c*(x94*(((v_x9 - v_x8)*x91 + (v_y9 - v_y8)*x97)*x94))
    x99 = x91*x98
    x100 = x97*x95
    x101 = x97*x98
    x102 = q_x10 - q_x9
    x103 = 2.0*x102
    x104 = q_y10 - q_y9
    x105 = sqrt(x102*x102 + x104*x104)
    x106 = 0.5/x105
    x107 = p_k*((x105 - p_l)*x106)
    x108 = x103*x107
    x109 = 2.0*x104
    x110 = p_c*(x106*(((v_x10 - v_x9)*x103 + (v_y10 - v_y9)*x109)*x106))
    x111 = x103*x110
    x112 = x109*x107
    x113 = x109*x110
    out[0] = x0*x3 - x10 + (x0*x12 + (a_x1*p_m - x15))
    out[1] = c0 - x16 + x11*x3 + (x11*x12 + (a_y1*p_m - x17))
    out[2] = x10 - x24 + (x15 + (a_x2*p_m - x27))
    out[3] = c0 - x28 + x16 + (x17 + (a_y2*p_m - x29))
    out[4] = x24 - x36 + (x27 + (a_x3*p_m - x39))
    out[5] = c0 - x40 + x28 + (x29 + (a_y3*p_m - x41))
    out[6] = x36 - x48 + (x39 + (a_x4*p_m - x51))
    out[7] = c0 - x52 + x40 + (x41 + (a_y4*p_m - x53))
    out[8] = x48 - x60 + (x51 + (a_x5*p_m - x63))
    out[9] = c0 - x64 + x52 + (x53 + (a_y5*p_m - x65))
    out[10] = x60 - x72 + (x63 + (a_x6*p_m - x75))
    out[11] = c0 - x76 + x64 + (x65 + (a_y6*p_m - x77))
    out[12] = x72 - x84 + (x75 + (a_x7*p_m - x87))
    out[13] = c0 - x88 + x76 + (x77 + (a_y7*p_m - x89))
    out[14] = x84 - x96 + (x87 + (a_x8*p_m - x99))
    out[15] = c0 - x100 + x88 + (x89 + (a_y8*p_m - x101))
    out[16] = x96 - x108 + (x99 + a_x9*p_m - x111)
    out[17] = c0 - x112 + x100 + (x101 + a_y9*p_m - x113)
    out[18] = x108 + (x111 + a_x10*p_m)
    out[19] = c0 + x112 + (x113 + a_y10*p_m)


@njit(error_model="numpy")
def residual_jacobian(t, y, p, out):
    """Residual derivatives by q, v, a, lambda. 760 operations."""
    p_m = p[0]
    p_l = p[1]
    p_k = p[2]
    p_c = p[3]
    q_x1 = y[0]
    q_y1 = y[1]
    q_x2 = y[2]
    q_y2 = y[3]
    q_x3 = y[4]
    q_y3 = y[5]
    q_x4 = y[6]
    q_y4 = y[7]
    q_x5 = y[8]
    q_y5 = y[9]
    q_x6 = y[10]
    q_y6 = y[11]
    q_x7 = y[12]
    q_y7 = y[13]
    q_x8 = y[14]
    q_y8 = y[15]
    q_x9 = y[16]
    q_y9 = y[17]
    q_x10 = y[18]
    q_y10 = y[19]
    v_x1 = y[20]
    v_y1 = y[21]
    v_x2 = y[22]
    v_y2 = y[23]
    v_x3 = y[24]
    v_y3 = y[25]
    v_x4 = y[26]
    v_y4 = y[27]
    v_x5 = y[28]
    v_y5 = y[29]
    v_x6 = y[30]
    v_y6 = y[31]
    v_x7 = y[32]
    v_y7 = y[33]
    v_x8 = y[34]
    v_y8 = y[35]
    v_x9 = y[36]
    v_y9 = y[37]
    v_x10 = y[38]
    v_y10 = y[39]
    x0 = q_x2 - q_x1
    x1 = q_y2 - q_y1
    x2 = sqrt(x0*x0 + x1*x1)
    x3 = 0.5/x2
    x4 = v_x2 - v_x1
    x5 = 2.0*x0
    x6 = v_y2 - v_y1
    x7 = 2.0*x1
    x8 = x4*x5 + x6*x7
    x9 = p_c*(x8*x3) + p_k*(x2 - p_l)
    x10 = x3*x9
    x11 = p_c*(x3*x3)
    x12 = x5*x11
    x13 = x5*x3
    x14 = p_k*x3
    x15 = x3*(1.0/x2)
    x16 = p_c*(x3*(x8*x15)) + x15*x9
    x17 = x5*x14 - x5*x16
    x18 = 2.0*(x10 + x4*x12) + x13*x17
    x19 = sqrt(q_x1*q_x1 + q_y1*q_y1)
    x20 = 0.5/x19
    x21 = 2.0*q_x1
    x22 = 2.0*q_y1
    x23 = v_x1*x21 + v_y1*x22
    x24 = p_c*(x23*x20) + p_k*(x19 - p_l)
    x25 = x20*x24
    x26 = p_c*(x20*x20)
    x27 = x21*x26
    x28 = x21*x20
    x29 = p_k*x20
    x30 = x20*(1.0/x19)
    x31 = p_c*(x20*(x23*x30)) + x30*x24
    x32 = x21*x29 - x21*x31
    x33 = x7*x3
    x34 = 2.0*(x6*x12) + x33*x17
    x35 = x22*x20
    x36 = -x18
    x37 = -x34
    x38 = x5*x12
    x39 = x7*x12
    x40 = -x38
    x41 = -x39
    x42 = x7*x11
    x43 = x7*x14 - x7*x16
    x44 = 2.0*(x4*x42) + x13*x43
    x45 = x22*x26
    x46 = x22*x29 - x22*x31
    x47 = 2.0*(x10 + x6*x42) + x33*x43
    x48 = -x44
    x49 = -x47
    x50 = x5*x42
    x51 = x7*x42
    x52 = -x50
    x53 = -x51
    x54 = q_x3 - q_x2
    x55 = q_y3 - q_y2
    x56 = sqrt(x54*x54 + x55*x55)
    x57 = 0.5/x56
    x58 = v_x3 - v_x2
    x59 = 2.0*x54
    x60 = v_y3 - v_y2
    x61 = 2.0*x55
    x62 = x58*x59 + x60*x61
    x63 = p_c*(x62*x57) + p_k*(x56 - p_l)
    x64 = x57*x63
    x65 = p_c*(x57*x57)
    x66 = x59*x65
    x67 = x59*x57
    x68 = p_k*x57
    x69 = x57*(1.0/x56)
    x70 = p_c*(x57*(x62*x69)) + x69*x63
    x71 = x59*x68 - x59*x70
    x72 = 2.0*(x64 + x58*x66) + x67*x71
    x73 = x61*x57
    x74 = 2.0*(x60*x66) + x73*x71
    x75 = -x72
    x76 = -x74
    x77 = x59*x66
    x78 = x61*x66
    x79 = -x77
    x80 = -x78
    x81 = x61*x65
    x82 = x61*x68 - x61*x70
    x83 = 2.0*(x58*x81) + x67*x82
    x84 = 2.0*(x64 + x60*x81) + x73*x82
    x85 = -x83
    x86 = -x84
    x87 = x59*x81
    x88 = x61*x81
    x89 = -x87
    x90 = -x88
    x91 = q_x4 - q_x3
    x92 = q_y4 - q_y3
    x93 = sqrt(x91*x91 + x92*x92)
    x94 = 0.5/x93
    x95 = v_x4 - v_x3
    x96 = 2.0*x91
    x97 = v_y4 - v_y3
    x98 = 2.0*x92
    x99 = x95*x96 + x97*x98
    x100 = p_c*(x99*x94) + p_k*(x93 - p_l)
    x101 = x94*x100
    x102 = p_c*(x94*x94)
    x103 = x96*x102
    x104 = x96*x94
    x105 = p_k*x94
    x106 = x94*(1.0/x93)
    x107 = p_c*(x94*(x99*x106)) + x106*x100
    x108 = x96*x105 - x96*x107
    x109 = 2.0*(x101 + x95*x103) + x104*x108
    x110 = x98*x94
    x111 = 2.0*(x97*x103) + x110*x108
    x112 = -x109
    x113 = -x111
    x114 = x96*x103
    x115 = x98*x103
    x116 = -x114
    x117 = -x115
    x118 = x98*x102
    x119 = x98*x105 - x98*x107
    x120 = 2.0*(x95*x118) + x104*x119
    x121 = 2.0*(x101 + x97*x118) + x110*x119
    x122 = -x120
    x123 = -x121
    x124 = x96*x118
    x125 = x98*x118
    x126 = -x124
    x127 = -x125
    x128 = q_x5 - q_x4
    x129 = q_y5 - q_y4
    x130 = sqrt(x128*x128 + x129*x129)
    x131 = 0.5/x130
    x132 = v_x5 - v_x4
    x133 = 2.0*x128
    x134 = v_y5 - v_y4
    x135 = 2.0*x129
    x136 = x132*x133 + x134*x135
    x137 = p_c*(x136*x131) + p_k*(x130 - p_l)
    x138 = x131*x137
    x139 = p_c*(x131*x131)
    x140 = x133*x139
    x141 = x133*x131
    x142 = p_k*x131
    x143 = x131*(1.0/x130)
    x144 = p_c*(x131*(x136*x143)) + x143*x137
    x145 = x133*x142 - x133*x144
    x146 = 2.0*(x138 + x132*x140) + x141*x145
    x147 = x135*x131
    x148 = 2.0*(x134*x140) + x147*x145
    x149 = -x146
    x150 = -x148
    x151 = x133*x140
    x152 = x135*x140
    x153 = -x151
    x154 = -x152
    x155 = x135*x139
    x156 = x135*x142 - x135*x144
    x157 = 2.0*(x132*x155) + x141*x156
    x158 = 2.0*(x138 + x134*x155) + x147*x156
    x159 = -x157
    x160 = -x158
    x161 = x133*x155
    x162 = x135*x155
    x163 = -x161
    x164 = -x162
    x165 = q_x6 - q_x5
    x166 = q_y6 - q_y5
    x167 = sqrt(x165*x165 + x166*x166)
    x168 = 0.5/x167
    x169 = v_x6 - v_x5
    x170 = 2.0*x165
    x171 = v_y6 - v_y5
    x172 = 2.0*x166
    x173 = x169*x170 + x171*x172
    x174 = p_c*(x173*x168) + p_k*(x167 - p_l)
    x175 = x168*x174
    x176 = p_c*(x168*x168)
    x177 = x170*x176
    x178 = x170*x168
    x179 = p_k*x168
    x180 = x168*(1.0/x167)
    x181 = p_c*(x168*(x173*x180)) + x180*x174
    x182 = x170*x179 - x170*x181
    x183 = 2.0*(x175 + x169*x177) + x178*x182
    x184 = x172*x168
    x185 = 2.0*(x171*x177) + x184*x182
    x186 = -x183
    x187 = -x185
    x188 = x170*x177
    x189 = x172*x177
    x190 = -x188
    x191 = -x189
    x192 = x172*x176
    x193 = x172*x179 - x172*x181
    x194 = 2.0*(x169*x192) + x178*x193
    x195 = 2.0*(x175 + x171*x192) + x184*x193
    x196 = -x194
    x197 = -x195
    x198 = x170*x192
    x199 = x172*x192
    x200 = -x198
    x201 = -x199
    x202 = q_x7 - q_x6
    x203 = q_y7 - q_y6
    x204 = sqrt(x202*x202 + x203*x203)
    x205 = 0.5/x204
    x206 = v_x7 - v_x6
    x207 = 2.0*x202
    x208 = v_y7 - v_y6
    x209 = 2.0*x203
    x210 = x206*x207 + x208*x209
    x211 = p_c*(x210*x205) + p_k*(x204 - p_l)
    x212 = x205*x211
    x213 = p_c*(x205*x205)
    x214 = x207*x213
    x215 = x207*x205
    x216 = p_k*x205
    x217 = x205*(1.0/x204)
    x218 = p_c*(x205*(x210*x217)) + x217*x211
    x219 = x207*x216 - x207*x218
    x220 = 2.0*(x212 + x206*x214) + x215*x219
    x221 = x209*x205
    x222 = 2.0*(x208*x214) + x221*x219
    x223 = -x220
    x224 = -x222
    x225 = x207*x214
    x226 = x209*x214
    x227 = -x225
    x228 = -x226
    x229 = x209*x213
    x230 = x209*x216 - x209*x218
    x231 = 2.0*(x206*x229) + x215*x230
    x232 = 2.0*(x212 + x208*x229) + x221*x230
    x233 = -x231
    x234 = -x232
    x235 = x207*x229
    x236 = x209*x229
    x237 = -x235
    x238 = -x236
    x239 = q_x8 - q_x7
    x240 = q_y8 - q_y7
    x241 = sqrt(x239*x239 + x240*x240)
    x242 = 0.5/x241
    x243 = v_x8 - v_x7
    x244 = 2.0*x239
    x245 = v_y8 - v_y7
    x246 = 2.0*x240
    x247 = x243*x244 + x245*x246
    x248 = p_c*(x247*x242) + p_k*(x241 - p_l)
    x249 = x242*x248
    x250 = p_c*(x242*x242)
    x251 = x244*x250
    x252 = x244*x242
    x253 = p_k*x242
    x254 = x242*(1.0/x241)
    x255 = p_c*(x242*(x247*x254)) + x254*x248
    x256 = x244*x253 - x244*x255
    x257 = 2.0*(x249 + x243*x251) + x252*x256
    x258 = x246*x242
    x259 = 2.0*(x245*x251) + x258*x256
    x260 = -x257
    x261 = -x259
    x262 = x244*x251
    x263 = x246*x251
    x264 = -x262
    x265 = -x263
    x266 = x246*x250
    x267 = x246*x253 - x246*x255
    x268 = 2.0*(x243*x266) + x252*x267
    x269 = 2.0*(x249 + x245*x266) + x258*x267
    x270 = -x268
    x271 = -x269
    x272 = x244*x266
    x273 = x246*x266
    x274 = -x272
    x275 = -x273
    x276 = q_x9 - q_x8
    x277 = q_y9 - q_y8
    x278 = sqrt(x276*x276 + x277*x277)
    x279 = 0.5/x278
    x280 = v_x9 - v_x8
    x281 = 2.0*x276
    x282 = v_y9 - v_y8
    x283 = 2.0*x277
    x284 = x280*x281 + x282*x283
    x285 = p_c*(x284*x279) + p_k*(x278 - p_l)
    x286 = x279*x285
    x287 = p_c*(x279*x279)
    x288 = x281*x287
    x289 = x281*x279
    x290 = p_k*x279
    x291 = x279*(1.0/x278)
    x292 = p_c*(x279*(x284*x291)) + x291*x285
    x293 = x281*x290 - x281*x292
    x294 = 2.0*(x286 + x280*x288) + x289*x293
    x295 = x283*x279
    x296 = 2.0*(x282*x288) + x295*x293
    x297 = -x294
    x298 = -x296
    x299 = x281*x288
    x300 = x283*x288
    x301 = -x299
    x302 = -x300
    x303 = x283*x287
    x304 = x283*x290 - x283*x292
    x305 = 2.0*(x280*x303) + x289*x304
    x306 = 2.0*(x286 + x282*x303) + x295*x304
    x307 = -x305
    x308 = -x306
    x309 = x281*x303
    x310 = x283*x303
    x311 = -x309
    x312 = -x310
    x313 = q_x10 - q_x9
    x314 = q_y10 - q_y9
    x315 = sqrt(x313*x313 + x314*x314)
    x316 = 0.5/x315
    x317 = v_x10 - v_x9
    x318 = 2.0*x313
    x319 = v_y10 - v_y9
    x320 = 2.0*x314
    x321 = x317*x318 + x319*x320
    x322 = p_c*(x321*x316) + p_k*(x315 - p_l)
    x323 = x316*x322
    x324 = p_c*(x316*x316)
    x325 = x318*x324
    x326 = x318*x316
    x327 = p_k*x316
    x328 = x316*(1.0/x315)
    x329 = p_c*(x316*(x321*x328)) + x328*x322
    x330 = x318*x327 - x318*x329
    x331 = 2.0*(x323 + x317*x325) + x326*x330
    x332 = x320*x316
    x333 = 2.0*(x319*x325) + x332*x330
    x334 = -x331
    x335 = -x333
    x336 = x318*x325
    x337 = x320*x325
    x338 = -x336
    x339 = -x337
    x340 = x320*x324
    x341 = x320*x327 - x320*x329
    x342 = 2.0*(x317*x340) + x326*x341
    x343 = 2.0*(x323 + x319*x340) + x332*x341
    x344 = -x342
    x345 = -x343
    x346 = x318*x340
    x347 = x320*x340
    x348 = -x346
    x349 = -x347
    out[0] = x18 + 2.0*(x25 + v_x1*x27) + x28*x32
    out[1] = x34 + 2.0*(v_y1*x27) + x35*x32
    out[2] = x36
    out[3] = x37
    out[20] = x38 + x21*x27
    out[21] = x39 + x22*x27
    out[22] = x40
    out[23] = x41
    out[40] = p_m
    out[60] = x44 + 2.0*(v_x1*x45) + x28*x46
    out[61] = x47 + 2.0*(x25 + v_y1*x45) + x35*x46
    out[62] = x48
    out[63] = x49
    out[80] = x50 + x21*x45
    out[81] = x51 + x22*x45
    out[82] = x52
    out[83] = x53
    out[101] = p_m
    out[120] = x36
    out[121] = x37
    out[122] = x72 + x18
    out[123] = x74 + x34
    out[124] = x75
    out[125] = x76
    out[140] = x40
    out[141] = x41
    out[142] = x77 + x38
    out[143] = x78 + x39
    out[144] = x79
    out[145] = x80
    out[162] = p_m
    out[180] = x48
    out[181] = x49
    out[182] = x83 + x44
    out[183] = x84 + x47
    out[184] = x85
    out[185] = x86
    out[200] = x52
    out[201] = x53
    out[202] = x87 + x50
    out[203] = x88 + x51
    out[204] = x89
    out[205] = x90
    out[223] = p_m
    out[242] = x75
    out[243] = x76
    out[244] = x109 + x72
    out[245] = x111 + x74
    out[246] = x112
    out[247] = x113
    out[262] = x79
    out[263] = x80
    out[264] = x114 + x77
    out[265] = x115 + x78
    out[266] = x116
    out[267] = x117
    out[284] = p_m
    out[302] = x85
    out[303] = x86
    out[304] = x120 + x83
    out[305] = x121 + x84
    out[306] = x122
    out[307] = x123
    out[322] = x89
    out[323] = x90
    out[324] = x124 + x87
    out[325] = x125 + x88
    out[326] = x126
    out[327] = x127
    out[345] = p_m
    out[364] = x112
    out[365] = x113
    out[366] = x146 + x109
    out[367] = x148 + x111
    out[368] = x149
    out[369] = x150
    out[384] = x116
    out[385] = x117
    out[386] = x151 + x114
    out[387] = x152 + x115
    out[388] = x153
    out[389] = x154
    out[406] = p_m
    out[424] = x122
    out[425] = x123
    out[426] = x157 + x120
    out[427] = x158 + x121
    out[428] = x159
    out[429] = x160
    out[444] = x126
    out[445] = x127
    out[446] = x161 + x124
    out[447] = x162 + x125
    out[448] = x163
    out[449] = x164
    out[467] = p_m
    out[486] = x149
    out[487] = x150
    out[488] = x183 + x146
    out[489] = x185 + x148
    out[490] = x186
    out[491] = x187
    out[506] = x153
    out[507] = x154
    out[508] = x188 + x151
    out[509] = x189 + x152
    out[510] = x190
    out[511] = x191
    out[528] = p_m
    out[546] = x159
    out[547] = x160
    out[548] = x194 + x157
    out[549] = x195 + x158
    out[550] = x196
    out[551] = x197
    out[566] = x163
    out[567] = x164
    out[568] = x198 + x161
    out[569] = x199 + x162
    out[570] = x200
    out[571] = x201
    out[589] = p_m
    out[608] = x186
    out[609] = x187
    out[610] = x220 + x183
    out[611] = x222 + x185
    out[612] = x223
    out[613] = x224
    out[628] = x190
    out[629] = x191
    out[630] = x225 + x188
    out[631] = x226 + x189
    out[632] = x227
    out[633] = x228
    out[650] = p_m
    out[668] = x196
    out[669] = x197
    out[670] = x231 + x194
    out[671] = x232 + x195
    out[672] = x233
    out[673] = x234
    out[688] = x200
    out[689] = x201
    out[690] = x235 + x198
    out[691] = x236 + x199
    out[692] = x237
    out[693] = x238
    out[711] = p_m
    out[730] = x223
    out[731] = x224
    out[732] = x257 + x220
    out[733] = x259 + x222
    out[734] = x260
    out[735] = x261
    out[750] = x227
    out[751] = x228
    out[752] = x262 + x225
    out[753] = x263 + x226
    out[754] = x264
    out[755] = x265
    out[772] = p_m
    out[790] = x233
    out[791] = x234
    out[792] = x268 + x231
    out[793] = x269 + x232
    out[794] = x270
    out[795] = x271
    out[810] = x237
    out[811] = x238
    out[812] = x272 + x235
    out[813] = x273 + x236
    out[814] = x274
    out[815] = x275
    out[833] = p_m
    out[852] = x260
    out[853] = x261
    out[854] = x294 + x257
    out[855] = x296 + x259
    out[856] = x297
    out[857] = x298
    out[872] = x264
    out[873] = x265
    out[874] = x299 + x262
    out[875] = x300 + x263
    out[876] = x301
    out[877] = x302
    out[894] = p_m
    out[912] = x270
    out[913] = x271
    out[914] = x305 + x268
    out[915] = x306 + x269
    out[916] = x307
    out[917] = x308
    out[932] = x274
    out[933] = x275
    out[934] = x309 + x272
    out[935] = x310 + x273
    out[936] = x311
    out[937] = x312
    out[955] = p_m
    out[974] = x297
    out[975] = x298
    out[976] = x331 + x294
    out[977] = x333 + x296
    out[978] = x334
    out[979] = x335
    out[994] = x301
    out[995] = x302
    out[996] = x299 + x336
    out[997] = x300 + x337
    out[998] = x338
    out[999] = x339
    out[1016] = p_m
    out[1034] = x307
    out[1035] = x308
    out[1036] = x342 + x305
    out[1037] = x343 + x306
    out[1038] = x344
    out[1039] = x345
    out[1054] = x311
    out[1055] = x312
    out[1056] = x309 + x346
    out[1057] = x310 + x347
    out[1058] = x348
    out[1059] = x349
    out[1077] = p_m
    out[1096] = x334
    out[1097] = x335
    out[1098] = x331
    out[1099] = x333
    out[1116] = x338
    out[1117] = x339
    out[1118] = x336
    out[1119] = x337
    out[1138] = p_m
    out[1156] = x344
    out[1157] = x345
    out[1158] = x342
    out[1159] = x343
    out[1176] = x348
    out[1177] = x349
    out[1178] = x346
    out[1179] = x347
    out[1199] = p_m


@njit(error_model="numpy")
def poses(t, y, p, out):
    """Per body: position, rotation matrix (body to world). 0 operations."""
    q_x1 = y[0]
    q_y1 = y[1]
    q_x2 = y[2]
    q_y2 = y[3]
    q_x3 = y[4]
    q_y3 = y[5]
    q_x4 = y[6]
    q_y4 = y[7]
    q_x5 = y[8]
    q_y5 = y[9]
    q_x6 = y[10]
    q_y6 = y[11]
    q_x7 = y[12]
    q_y7 = y[13]
    q_x8 = y[14]
    q_y8 = y[15]
    q_x9 = y[16]
    q_y9 = y[17]
    q_x10 = y[18]
    q_y10 = y[19]
    out[0] = q_x1
    out[1] = q_y1
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
    out[12] = q_x2
    out[13] = q_y2
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
    out[24] = q_x3
    out[25] = q_y3
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
    out[36] = q_x4
    out[37] = q_y4
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
    out[48] = q_x5
    out[49] = q_y5
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
    out[60] = q_x6
    out[61] = q_y6
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
    out[72] = q_x7
    out[73] = q_y7
    out[74] = 0.0
    out[75] = 1.0
    out[76] = 0.0
    out[77] = 0.0
    out[78] = 0.0
    out[79] = 1.0
    out[80] = 0.0
    out[81] = 0.0
    out[82] = 0.0
    out[83] = 1.0
    out[84] = q_x8
    out[85] = q_y8
    out[86] = 0.0
    out[87] = 1.0
    out[88] = 0.0
    out[89] = 0.0
    out[90] = 0.0
    out[91] = 1.0
    out[92] = 0.0
    out[93] = 0.0
    out[94] = 0.0
    out[95] = 1.0
    out[96] = q_x9
    out[97] = q_y9
    out[98] = 0.0
    out[99] = 1.0
    out[100] = 0.0
    out[101] = 0.0
    out[102] = 0.0
    out[103] = 1.0
    out[104] = 0.0
    out[105] = 0.0
    out[106] = 0.0
    out[107] = 1.0
    out[108] = q_x10
    out[109] = q_y10
    out[110] = 0.0
    out[111] = 1.0
    out[112] = 0.0
    out[113] = 0.0
    out[114] = 0.0
    out[115] = 1.0
    out[116] = 0.0
    out[117] = 0.0
    out[118] = 0.0
    out[119] = 1.0


@njit(error_model="numpy")
def shapes(t, y, p, out):
    """Sizes of the bodies' shapes. 0 operations."""
    out[0] = 0.04
    out[1] = 0.04
    out[2] = 0.04
    out[3] = 0.04
    out[4] = 0.04
    out[5] = 0.04
    out[6] = 0.04
    out[7] = 0.04
    out[8] = 0.04
    out[9] = 0.04


@njit(error_model="numpy")
def marks(t, y, p, out):
    """What a picture shows besides bodies, as `marks` lists it. 0 operations."""
    q_x1 = y[0]
    q_y1 = y[1]
    q_x2 = y[2]
    q_y2 = y[3]
    q_x3 = y[4]
    q_y3 = y[5]
    q_x4 = y[6]
    q_y4 = y[7]
    q_x5 = y[8]
    q_y5 = y[9]
    q_x6 = y[10]
    q_y6 = y[11]
    q_x7 = y[12]
    q_y7 = y[13]
    q_x8 = y[14]
    q_y8 = y[15]
    q_x9 = y[16]
    q_y9 = y[17]
    q_x10 = y[18]
    q_y10 = y[19]
    out[3] = q_x1
    out[4] = q_y1
    out[6] = q_x1
    out[7] = q_y1
    out[9] = q_x2
    out[10] = q_y2
    out[12] = q_x2
    out[13] = q_y2
    out[15] = q_x3
    out[16] = q_y3
    out[18] = q_x3
    out[19] = q_y3
    out[21] = q_x4
    out[22] = q_y4
    out[24] = q_x4
    out[25] = q_y4
    out[27] = q_x5
    out[28] = q_y5
    out[30] = q_x5
    out[31] = q_y5
    out[33] = q_x6
    out[34] = q_y6
    out[36] = q_x6
    out[37] = q_y6
    out[39] = q_x7
    out[40] = q_y7
    out[42] = q_x7
    out[43] = q_y7
    out[45] = q_x8
    out[46] = q_y8
    out[48] = q_x8
    out[49] = q_y8
    out[51] = q_x9
    out[52] = q_y9
    out[54] = q_x9
    out[55] = q_y9
    out[57] = q_x10
    out[58] = q_y10


@njit(error_model="numpy")
def limits(t, y, p, out):
    """Numbers of parameters that have a bound. 0 operations."""
    p_m = p[0]
    out[0] = p_m
