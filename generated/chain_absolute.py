"""chain_absolute: equations of motion, written by symgen 0.1.0. Do not edit.

Chain of 6 pinned rods in absolute coordinates, released from horizontal
"""

from math import cos, sin

from numba import njit

MODEL = {
    "abi": 1,
    "generator": "symgen 0.1.0",
    "source": "sha256:435e7b6fdc48f2c0338feb076bedc35ff7be9af6047b4ad7e21a4a08d7553b75",
    "name": "chain_absolute",
    "description": "Chain of 6 pinned rods in absolute coordinates, released from horizontal",
    "nq": 18,
    "nv": 18,
    "nh": 12,
    "nn": 0,
    "nw": 0,
    "coordinates": [
        {"name": "x1", "unit": "m", "value": 0.1, "enforced": False},
        {"name": "y1", "unit": "m", "value": 0.0, "enforced": False},
        {"name": "theta1", "unit": "rad", "value": 1.5707963267948966, "enforced": True},
        {"name": "x2", "unit": "m", "value": 0.30000000000000004, "enforced": False},
        {"name": "y2", "unit": "m", "value": 0.0, "enforced": False},
        {"name": "theta2", "unit": "rad", "value": 1.5707963267948966, "enforced": True},
        {"name": "x3", "unit": "m", "value": 0.5, "enforced": False},
        {"name": "y3", "unit": "m", "value": 0.0, "enforced": False},
        {"name": "theta3", "unit": "rad", "value": 1.5707963267948966, "enforced": True},
        {"name": "x4", "unit": "m", "value": 0.7000000000000001, "enforced": False},
        {"name": "y4", "unit": "m", "value": 0.0, "enforced": False},
        {"name": "theta4", "unit": "rad", "value": 1.5707963267948966, "enforced": True},
        {"name": "x5", "unit": "m", "value": 0.9, "enforced": False},
        {"name": "y5", "unit": "m", "value": 0.0, "enforced": False},
        {"name": "theta5", "unit": "rad", "value": 1.5707963267948966, "enforced": True},
        {"name": "x6", "unit": "m", "value": 1.1, "enforced": False},
        {"name": "y6", "unit": "m", "value": 0.0, "enforced": False},
        {"name": "theta6", "unit": "rad", "value": 1.5707963267948966, "enforced": True},
    ],
    "quaternions": [],
    "rates": [
        {"name": "x1", "unit": "m/s", "value": 0.0, "enforced": True},
        {"name": "y1", "unit": "m/s", "value": 0.0, "enforced": True},
        {"name": "theta1", "unit": "rad/s", "value": 0.0, "enforced": True},
        {"name": "x2", "unit": "m/s", "value": 0.0, "enforced": True},
        {"name": "y2", "unit": "m/s", "value": 0.0, "enforced": True},
        {"name": "theta2", "unit": "rad/s", "value": 0.0, "enforced": True},
        {"name": "x3", "unit": "m/s", "value": 0.0, "enforced": True},
        {"name": "y3", "unit": "m/s", "value": 0.0, "enforced": True},
        {"name": "theta3", "unit": "rad/s", "value": 0.0, "enforced": True},
        {"name": "x4", "unit": "m/s", "value": 0.0, "enforced": True},
        {"name": "y4", "unit": "m/s", "value": 0.0, "enforced": True},
        {"name": "theta4", "unit": "rad/s", "value": 0.0, "enforced": True},
        {"name": "x5", "unit": "m/s", "value": 0.0, "enforced": True},
        {"name": "y5", "unit": "m/s", "value": 0.0, "enforced": True},
        {"name": "theta5", "unit": "rad/s", "value": 0.0, "enforced": True},
        {"name": "x6", "unit": "m/s", "value": 0.0, "enforced": True},
        {"name": "y6", "unit": "m/s", "value": 0.0, "enforced": True},
        {"name": "theta6", "unit": "rad/s", "value": 0.0, "enforced": True},
    ],
    "parameters": [
        {"name": "m", "unit": "kg", "value": 1.0, "doc": ""},
        {"name": "L", "unit": "m", "value": 0.2, "doc": ""},
        {"name": "g", "unit": "m/s^2", "value": 9.81, "doc": ""},
    ],
    "inputs": [],
    "constants": [],
    "constraints": [
        {"name": "pin1_x", "kind": "holonomic", "multiplier": "N"},
        {"name": "pin1_y", "kind": "holonomic", "multiplier": "N"},
        {"name": "pin2_x", "kind": "holonomic", "multiplier": "N"},
        {"name": "pin2_y", "kind": "holonomic", "multiplier": "N"},
        {"name": "pin3_x", "kind": "holonomic", "multiplier": "N"},
        {"name": "pin3_y", "kind": "holonomic", "multiplier": "N"},
        {"name": "pin4_x", "kind": "holonomic", "multiplier": "N"},
        {"name": "pin4_y", "kind": "holonomic", "multiplier": "N"},
        {"name": "pin5_x", "kind": "holonomic", "multiplier": "N"},
        {"name": "pin5_y", "kind": "holonomic", "multiplier": "N"},
        {"name": "pin6_x", "kind": "holonomic", "multiplier": "N"},
        {"name": "pin6_y", "kind": "holonomic", "multiplier": "N"},
    ],
    "outputs": [],
    "events": [],
    "bodies": [
        {"name": "rod1", "planar": True, "shape": "capsule", "sizes": 2, "mesh": ""},
        {"name": "rod2", "planar": True, "shape": "capsule", "sizes": 2, "mesh": ""},
        {"name": "rod3", "planar": True, "shape": "capsule", "sizes": 2, "mesh": ""},
        {"name": "rod4", "planar": True, "shape": "capsule", "sizes": 2, "mesh": ""},
        {"name": "rod5", "planar": True, "shape": "capsule", "sizes": 2, "mesh": ""},
        {"name": "rod6", "planar": True, "shape": "capsule", "sizes": 2, "mesh": ""},
    ],
    "structure": {
        "conservative": True,
        "time_dependent": False,
        "constant_mass": True,
        "diagonal_mass": True,
        "velocity_dependent": False,
        "separable": False,
    },
    "operations": {
        "rhs": 524,
        "mass_matrix": 3,
        "forces": 2,
        "energy": 64,
        "residual": 201,
        "residual_jacobian": 164,
        "constraint_residual": 113,
        "constraint_jacobian": 37,
        "gamma": 65,
        "project": 717,
        "poses": 24,
        "shapes": 0,
        "marks": 9,
        "limits": 3,
    },
    "hoisted": {
        "rhs": 5,
        "mass_matrix": 1,
        "forces": 1,
        "energy": 3,
        "residual": 3,
        "residual_jacobian": 2,
        "constraint_residual": 1,
        "constraint_jacobian": 1,
        "gamma": 1,
        "project": 4,
        "marks": 2,
    },
    "run": {
        "t_end": 2.0,
        "fps": 60.0,
    },
    "limits": [
        {"name": "bodies.rod1.shape.capsule[1]", "bound": "zero or more"},
        {"name": "bodies.rod1.mass", "bound": "zero or more"},
        {"name": "bodies.rod1.inertia", "bound": "zero or more"},
    ],
    "subsystems": [],
    "marks": [
        {"kind": "pin", "name": "rod1_1", "body": "rod1", "numbers": 6},
        {"kind": "ground", "name": "rod1_1", "body": "", "numbers": 3},
        {"kind": "reaction", "name": "rod1_1", "body": "rod1", "numbers": 3, "constraints": [0, 1], "signs": [1, 1]},
        {"kind": "pin", "name": "rod1_2", "body": "rod1", "numbers": 6},
        {"kind": "reaction", "name": "rod1_2", "body": "rod1", "numbers": 3, "constraints": [2, 3], "signs": [-1, -1]},
        {"kind": "pin", "name": "rod2_2", "body": "rod2", "numbers": 6},
        {"kind": "reaction", "name": "rod2_2", "body": "rod2", "numbers": 3, "constraints": [4, 5], "signs": [-1, -1]},
        {"kind": "pin", "name": "rod3_2", "body": "rod3", "numbers": 6},
        {"kind": "reaction", "name": "rod3_2", "body": "rod3", "numbers": 3, "constraints": [6, 7], "signs": [-1, -1]},
        {"kind": "pin", "name": "rod4_2", "body": "rod4", "numbers": 6},
        {"kind": "reaction", "name": "rod4_2", "body": "rod4", "numbers": 3, "constraints": [8, 9], "signs": [-1, -1]},
        {"kind": "pin", "name": "rod5_2", "body": "rod5", "numbers": 6},
        {"kind": "reaction", "name": "rod5_2", "body": "rod5", "numbers": 3, "constraints": [10, 11], "signs": [-1, -1]},
    ],
}

@njit(error_model="numpy")
def rhs(t, y, p, out):
    """State derivative: rates, accelerations, multipliers, pivot ratio. 524 operations."""
    p_m = p[0]
    p_L = p[1]
    p_g = p[2]
    c0 = 1.0/p_m
    c1 = 0.5*p_L
    c2 = c1*(1.0/(p_L*p_L*(0.08333333333333333*p_m)))
    c3 = c0 + c0
    c4 = p_m*p_g*c0
    q_theta1 = y[2]
    q_theta2 = y[5]
    q_theta3 = y[8]
    q_theta4 = y[11]
    q_theta5 = y[14]
    q_theta6 = y[17]
    v_x1 = y[18]
    v_y1 = y[19]
    v_theta1 = y[20]
    v_x2 = y[21]
    v_y2 = y[22]
    v_theta2 = y[23]
    v_x3 = y[24]
    v_y3 = y[25]
    v_theta3 = y[26]
    v_x4 = y[27]
    v_y4 = y[28]
    v_theta4 = y[29]
    v_x5 = y[30]
    v_y5 = y[31]
    v_theta5 = y[32]
    v_x6 = y[33]
    v_y6 = y[34]
    v_theta6 = y[35]
    x0 = cos(q_theta1)
    x1 = c1*x0
    x2 = x0*c2
    x3 = x1*x2
    x4 = c0 - x3
    x5 = 1.0/(c0 + x3)
    x6 = x4*x5
    x7 = c3 + x3
    x8 = sin(q_theta1)
    x9 = x8*c2
    x10 = x8*c1
    x11 = x10*x2
    x12 = x11*x5
    x13 = x1*x9 + x4*x12
    x14 = x11*x12
    x15 = x10*x9
    x16 = c0 + x15
    x17 = x14 - x16
    x18 = 1.0/x17
    x19 = x13*x18
    x20 = cos(q_theta2)
    x21 = c1*x20
    x22 = x20*c2
    x23 = x21*x22
    x24 = x4*x6 - x7 - x13*x19 - x23
    x25 = 1.0/x24
    x26 = c1*(v_theta1*(v_theta1*x0))
    x27 = c1*(v_theta1*(v_theta1*x8))
    x28 = x27*x12
    x29 = x26 + c4 + x28
    x30 = sin(q_theta2)
    x31 = c1*(v_theta2*(v_theta2*x30))
    x32 = x19*x29 - (x27 + x31 + x27*x6)
    x33 = c0 - x23
    x34 = x33*x25
    x35 = cos(q_theta3)
    x36 = c1*x35
    x37 = x35*c2
    x38 = x36*x37
    x39 = c0 - x38
    x40 = c3 + x23
    x41 = x30*c2
    x42 = c0 - x15 + x14
    x43 = c1*x30
    x44 = x43*x22
    x45 = x42*x19 - (x11 + x11*x6) - x44
    x46 = x45*x25
    x47 = x21*x41 + x33*x46
    x48 = c3 + x15
    x49 = x42*x18
    x50 = x43*x41
    x51 = x14 - x48 - x42*x49 - x50 - x45*x46
    x52 = 1.0/x51
    x53 = x47*x52
    x54 = x40 + x33*x34 + x47*x53 + x38
    x55 = 1.0/x54
    x56 = x39*x55
    x57 = c3 + x38
    x58 = c0 - x50 + x44*x46
    x59 = sin(q_theta3)
    x60 = c1*x59
    x61 = x60*x37
    x62 = x44*x34 - x44 + x58*x53 - x61
    x63 = x62*x55
    x64 = x59*c2
    x65 = x39*x63 - x36*x64
    x66 = c3 + x50
    x67 = x44*x25
    x68 = x58*x52
    x69 = x60*x64
    x70 = x62*x63 - (x66 + x44*x67 + x58*x68 + x69)
    x71 = 1.0/x70
    x72 = x65*x71
    x73 = cos(q_theta4)
    x74 = c1*x73
    x75 = x73*c2
    x76 = x74*x75
    x77 = x39*x56 - x57 - x65*x72 - x76
    x78 = 1.0/x77
    x79 = c1*(v_theta2*(v_theta2*x20))
    x80 = c4 + (x26 + x79 - c4) + x28 - x49*x29 - x46*x32
    x81 = c1*(v_theta3*(v_theta3*x59))
    x82 = x53*x80 - (x31 + x81 + x34*x32)
    x83 = sin(q_theta4)
    x84 = c1*(v_theta4*(v_theta4*x83))
    x85 = c1*(v_theta3*(v_theta3*x35))
    x86 = c4 + (x79 + x85 - c4) + x67*x32 - x68*x80 + x63*x82
    x87 = x56*x82 - (x81 + x84) - x72*x86
    x88 = c0 - x76
    x89 = x88*x78
    x90 = c3 + x76
    x91 = c0 - x69 - x61*x63
    x92 = c1*x83
    x93 = x92*x75
    x94 = x61 + x61*x56 + x91*x72 + x93
    x95 = x94*x78
    x96 = x83*c2
    x97 = x88*x95 - x74*x96
    x98 = x61*x55
    x99 = c3 + x69
    x100 = x91*x71
    x101 = x92*x96
    x102 = x61*x98 - x99 - x91*x100 - x101 - x94*x95
    x103 = 1.0/x102
    x104 = x97*x103
    x105 = cos(q_theta5)
    x106 = c1*x105
    x107 = x105*c2
    x108 = x106*x107
    x109 = x90 + x88*x89 + x97*x104 + x108
    x110 = 1.0/x109
    x111 = sin(q_theta5)
    x112 = c1*(v_theta5*(v_theta5*x111))
    x113 = c1*(v_theta4*(v_theta4*x73))
    x114 = c4 + (x85 + x113 - c4) - x98*x82 - x100*x86 + x95*x87
    x115 = x84 + x112 + x89*x87 + x104*x114
    x116 = c0 - x108
    x117 = x116*x110
    x118 = sin(q_theta6)
    x119 = c1*x118
    x120 = cos(q_theta6)
    x121 = x120*c2
    x122 = c1*x111
    x123 = x122*x107
    x124 = x111*c2
    x125 = x122*x124
    x126 = c0 - x101 - x93*x95
    x127 = x93*x89 - x93 - x126*x104 - x123
    x128 = x127*x110
    x129 = c0 - x125 - x123*x128
    x130 = x116*x128 - x106*x124
    x131 = c3 + x101
    x132 = x93*x78
    x133 = x126*x103
    x134 = x127*x128 - (x131 + x93*x132 + x126*x133 + x125)
    x135 = 1.0/x134
    x136 = x130*x135
    x137 = x119*x121 + x123 + x123*x117 + x129*x136
    x138 = c3 + c1*x120*x121 + x108
    x139 = x116*x117 - x138 - x130*x136
    x140 = 1.0/x139
    x141 = x137*x140
    x142 = x123*x110
    x143 = x118*c2
    x144 = c3 + x119*x143 + x125
    x145 = x129*x135
    x146 = x123*x142 - x144 - x129*x145 - x137*x141
    x147 = c1*(v_theta5*(v_theta5*x105))
    x148 = c4 + (x113 + x147 - c4) + x132*x87 - x133*x114 - x128*x115
    x149 = x147 + c1*(v_theta6*(v_theta6*x120)) + c4 - c4 + x142*x115 - x145*x148
    x150 = x112 + c1*(v_theta6*(v_theta6*x118)) + x117*x115 + x136*x148
    x151 = 1.0/x146*(x149 - x141*x150)
    x152 = x141*x151 - x140*x150
    x153 = x135*x148 - x145*x151 - x136*x152
    x154 = x110*x115 + x117*x152 + x128*x153 - x142*x151
    x155 = x103*x114 - x133*x153 - x104*x154
    x156 = x78*x87 - x89*x154 + x95*x155 + x132*x153
    x157 = x71*x86 - x100*x155 - x72*x156
    x158 = x56*x156 - x55*x82 + x63*x157 - x98*x155
    x159 = x52*x80 - x68*x157 + x53*x158
    x160 = x25*x32 - x34*x158 - x46*x159 + x67*x157
    x161 = c0*x160
    x162 = x18*x29 - x49*x159 + x19*x160
    x163 = x27*x5 + x6*x160 - x12*x162 - x12*x159
    x164 = c0*x159
    x165 = c0*x158
    x166 = c0*x157
    x167 = c0*x156
    x168 = c0*x155
    x169 = c0*x154
    x170 = c0*x153
    x171 = c0*x152
    x172 = c0*x151
    x173 = -(x146/x144)
    x174 = -(x139/x138)
    x175 = -(x134/(x131 + x125))
    x176 = x109/(x90 + x108)
    x177 = -(x102/(x99 + x101))
    x178 = -(x77/(x57 + x76))
    x179 = -(x70/(x66 + x69))
    x180 = x54/(x40 + x38)
    x181 = -(x51/(x48 + x50))
    x182 = -(x24/(x7 + x23))
    x183 = -(x17/x16)
    x184 = (x183 if x183 < 1.0 else 1.0)
    x185 = (x182 if x182 < x184 else x184)
    x186 = (x181 if x181 < x185 else x185)
    x187 = (x180 if x180 < x186 else x186)
    x188 = (x179 if x179 < x187 else x187)
    x189 = (x178 if x178 < x188 else x188)
    x190 = (x177 if x177 < x189 else x189)
    x191 = (x176 if x176 < x190 else x190)
    x192 = (x175 if x175 < x191 else x191)
    x193 = (x174 if x174 < x192 else x192)
    out[0] = v_x1
    out[1] = v_y1
    out[2] = v_theta1
    out[3] = v_x2
    out[4] = v_y2
    out[5] = v_theta2
    out[6] = v_x3
    out[7] = v_y3
    out[8] = v_theta3
    out[9] = v_x4
    out[10] = v_y4
    out[11] = v_theta4
    out[12] = v_x5
    out[13] = v_y5
    out[14] = v_theta5
    out[15] = v_x6
    out[16] = v_y6
    out[17] = v_theta6
    out[18] = x161 - c0*x163
    out[19] = x164 - (c4 + c0*x162)
    out[20] = x2*x163 + x9*x162 + x2*x160 + x9*x159
    out[21] = x165 - x161
    out[22] = x166 - (c4 + x164)
    out[23] = x22*x160 + x41*x159 + x22*x158 + x41*x157
    out[24] = x167 - x165
    out[25] = x168 - (c4 + x166)
    out[26] = x37*x158 + x64*x157 + x37*x156 + x64*x155
    out[27] = x169 - x167
    out[28] = x170 - (c4 + x168)
    out[29] = x75*x156 + x96*x155 + x75*x154 + x96*x153
    out[30] = x171 - x169
    out[31] = x172 - (c4 + x170)
    out[32] = x107*x154 + x124*x153 + x107*x152 + x124*x151
    out[33] = -x171
    out[34] = -(c4 + x172)
    out[35] = x121*x152 + x143*x151
    out[36] = -x163
    out[37] = -x162
    out[38] = -x160
    out[39] = -x159
    out[40] = -x158
    out[41] = -x157
    out[42] = -x156
    out[43] = -x155
    out[44] = -x154
    out[45] = -x153
    out[46] = -x152
    out[47] = -x151
    out[48] = (x173 if x173 < x193 else x193)


@njit(error_model="numpy")
def mass_matrix(t, y, p, out):
    """Mass matrix M, row by row. 3 operations."""
    p_m = p[0]
    p_L = p[1]
    c0 = p_L*p_L*(0.08333333333333333*p_m)
    out[0] = p_m
    out[19] = p_m
    out[38] = c0
    out[57] = p_m
    out[76] = p_m
    out[95] = c0
    out[114] = p_m
    out[133] = p_m
    out[152] = c0
    out[171] = p_m
    out[190] = p_m
    out[209] = c0
    out[228] = p_m
    out[247] = p_m
    out[266] = c0
    out[285] = p_m
    out[304] = p_m
    out[323] = c0


@njit(error_model="numpy")
def forces(t, y, p, out):
    """Forces f of M a = f + G^T lambda. 2 operations."""
    p_m = p[0]
    p_g = p[2]
    c0 = -(p_m*p_g)
    out[0] = 0.0
    out[1] = c0
    out[2] = 0.0
    out[3] = 0.0
    out[4] = c0
    out[5] = 0.0
    out[6] = 0.0
    out[7] = c0
    out[8] = 0.0
    out[9] = 0.0
    out[10] = c0
    out[11] = 0.0
    out[12] = 0.0
    out[13] = c0
    out[14] = 0.0
    out[15] = 0.0
    out[16] = c0
    out[17] = 0.0


@njit(error_model="numpy")
def energy(t, y, p, out):
    """Kinetic and potential energy. 64 operations."""
    p_m = p[0]
    p_L = p[1]
    p_g = p[2]
    c0 = 0.5*p_m
    c1 = 0.5*(p_L*p_L*(0.08333333333333333*p_m))
    c2 = p_m*p_g
    q_y1 = y[1]
    q_y2 = y[4]
    q_y3 = y[7]
    q_y4 = y[10]
    q_y5 = y[13]
    q_y6 = y[16]
    v_x1 = y[18]
    v_y1 = y[19]
    v_theta1 = y[20]
    v_x2 = y[21]
    v_y2 = y[22]
    v_theta2 = y[23]
    v_x3 = y[24]
    v_y3 = y[25]
    v_theta3 = y[26]
    v_x4 = y[27]
    v_y4 = y[28]
    v_theta4 = y[29]
    v_x5 = y[30]
    v_y5 = y[31]
    v_theta5 = y[32]
    v_x6 = y[33]
    v_y6 = y[34]
    v_theta6 = y[35]
    x0 = c0*(v_x2*v_x2 + v_y2*v_y2) + (c0*(v_x1*v_x1 + v_y1*v_y1) + c1*(v_theta1*v_theta1))
    x1 = c0*(v_x3*v_x3 + v_y3*v_y3) + (x0 + c1*(v_theta2*v_theta2)) + c1*(v_theta3*v_theta3)
    x2 = c0*(v_x5*v_x5 + v_y5*v_y5) + (c0*(v_x4*v_x4 + v_y4*v_y4) + x1 + c1*(v_theta4*v_theta4))
    x3 = c0*(v_x6*v_x6 + v_y6*v_y6) + (x2 + c1*(v_theta5*v_theta5)) + c1*(v_theta6*v_theta6)
    out[0] = x3
    out[1] = q_y1*c2 + q_y2*c2 + q_y3*c2 + q_y4*c2 + q_y5*c2 + q_y6*c2


@njit(error_model="numpy")
def residual(t, y, p, out):
    """M a - f - G^T lambda, then G a - gamma. 201 operations."""
    p_m = p[0]
    p_L = p[1]
    p_g = p[2]
    c0 = p_m*p_g
    c1 = p_L*p_L*(0.08333333333333333*p_m)
    c2 = 0.5*p_L
    q_theta1 = y[2]
    q_theta2 = y[5]
    q_theta3 = y[8]
    q_theta4 = y[11]
    q_theta5 = y[14]
    q_theta6 = y[17]
    v_theta1 = y[20]
    v_theta2 = y[23]
    v_theta3 = y[26]
    v_theta4 = y[29]
    v_theta5 = y[32]
    v_theta6 = y[35]
    a_x1 = y[36]
    a_y1 = y[37]
    a_theta1 = y[38]
    a_x2 = y[39]
    a_y2 = y[40]
    a_theta2 = y[41]
    a_x3 = y[42]
    a_y3 = y[43]
    a_theta3 = y[44]
    a_x4 = y[45]
    a_y4 = y[46]
    a_theta4 = y[47]
    a_x5 = y[48]
    a_y5 = y[49]
    a_theta5 = y[50]
    a_x6 = y[51]
    a_y6 = y[52]
    a_theta6 = y[53]
    lam_pin1_x = y[54]
    lam_pin1_y = y[55]
    lam_pin2_x = y[56]
    lam_pin2_y = y[57]
    lam_pin3_x = y[58]
    lam_pin3_y = y[59]
    lam_pin4_x = y[60]
    lam_pin4_y = y[61]
    lam_pin5_x = y[62]
    lam_pin5_y = y[63]
    lam_pin6_x = y[64]
    lam_pin6_y = y[65]
    x0 = sin(q_theta1)
    x1 = cos(q_theta1)
    x2 = c2*(x0*(lam_pin1_y + lam_pin2_y)) + c2*(x1*(lam_pin1_x + lam_pin2_x))
    x3 = sin(q_theta2)
    x4 = cos(q_theta2)
    x5 = c2*(x3*(lam_pin2_y + lam_pin3_y)) + c2*(x4*(lam_pin2_x + lam_pin3_x))
    x6 = sin(q_theta3)
    x7 = cos(q_theta3)
    x8 = c2*(x6*(lam_pin3_y + lam_pin4_y)) + c2*(x7*(lam_pin3_x + lam_pin4_x))
    x9 = sin(q_theta4)
    x10 = cos(q_theta4)
    x11 = c2*(x9*(lam_pin4_y + lam_pin5_y)) + c2*(x10*(lam_pin4_x + lam_pin5_x))
    x12 = sin(q_theta5)
    x13 = cos(q_theta5)
    x14 = c2*(x12*(lam_pin5_y + lam_pin6_y)) + c2*(x13*(lam_pin5_x + lam_pin6_x))
    x15 = sin(q_theta6)
    x16 = cos(q_theta6)
    x17 = c2*(a_theta1*x1 - v_theta1*(v_theta1*x0))
    x18 = c2*(v_theta1*(v_theta1*x1) + a_theta1*x0)
    x19 = c2*(a_theta2*x4 - v_theta2*(v_theta2*x3))
    x20 = c2*(v_theta2*(v_theta2*x4) + a_theta2*x3)
    x21 = c2*(a_theta3*x7 - v_theta3*(v_theta3*x6))
    x22 = c2*(v_theta3*(v_theta3*x7) + a_theta3*x6)
    x23 = c2*(a_theta4*x10 - v_theta4*(v_theta4*x9))
    x24 = c2*(v_theta4*(v_theta4*x10) + a_theta4*x9)
    x25 = c2*(a_theta5*x13 - v_theta5*(v_theta5*x12))
    x26 = c2*(v_theta5*(v_theta5*x13) + a_theta5*x12)
    x27 = a_x6 - x25 - a_x5 - c2*(a_theta6*x16 - v_theta6*(v_theta6*x15))
    x28 = a_y6 - x26 - a_y5 - c2*(v_theta6*(v_theta6*x16) + a_theta6*x15)
    out[0] = a_x1*p_m - (lam_pin1_x - lam_pin2_x)
    out[1] = c0 + a_y1*p_m - (lam_pin1_y - lam_pin2_y)
    out[2] = a_theta1*c1 + x2
    out[3] = a_x2*p_m - (lam_pin2_x - lam_pin3_x)
    out[4] = c0 + a_y2*p_m - (lam_pin2_y - lam_pin3_y)
    out[5] = a_theta2*c1 + x5
    out[6] = a_x3*p_m - (lam_pin3_x - lam_pin4_x)
    out[7] = c0 + a_y3*p_m - (lam_pin3_y - lam_pin4_y)
    out[8] = a_theta3*c1 + x8
    out[9] = a_x4*p_m - (lam_pin4_x - lam_pin5_x)
    out[10] = c0 + a_y4*p_m - (lam_pin4_y - lam_pin5_y)
    out[11] = a_theta4*c1 + x11
    out[12] = a_x5*p_m - (lam_pin5_x - lam_pin6_x)
    out[13] = c0 + a_y5*p_m - (lam_pin5_y - lam_pin6_y)
    out[14] = a_theta5*c1 + x14
    out[15] = a_x6*p_m - lam_pin6_x
    out[16] = c0 + a_y6*p_m - lam_pin6_y
    out[17] = a_theta6*c1 + (c2*(lam_pin6_y*x15) + c2*(lam_pin6_x*x16))
    out[18] = a_x1 - x17
    out[19] = a_y1 - x18
    out[20] = a_x2 - x17 - x19 - a_x1
    out[21] = a_y2 - x18 - x20 - a_y1
    out[22] = a_x3 - x19 - x21 - a_x2
    out[23] = a_y3 - x20 - x22 - a_y2
    out[24] = a_x4 - x21 - x23 - a_x3
    out[25] = a_y4 - x22 - x24 - a_y3
    out[26] = a_x5 - x23 - x25 - a_x4
    out[27] = a_y5 - x24 - x26 - a_y4
    out[28] = x27
    out[29] = x28


@njit(error_model="numpy")
def residual_jacobian(t, y, p, out):
    """Residual derivatives by q, v, a, lambda. 164 operations."""
    p_m = p[0]
    p_L = p[1]
    c0 = 0.5*p_L
    c1 = p_L*p_L*(0.08333333333333333*p_m)
    q_theta1 = y[2]
    q_theta2 = y[5]
    q_theta3 = y[8]
    q_theta4 = y[11]
    q_theta5 = y[14]
    q_theta6 = y[17]
    v_theta1 = y[20]
    v_theta2 = y[23]
    v_theta3 = y[26]
    v_theta4 = y[29]
    v_theta5 = y[32]
    v_theta6 = y[35]
    a_theta1 = y[38]
    a_theta2 = y[41]
    a_theta3 = y[44]
    a_theta4 = y[47]
    a_theta5 = y[50]
    a_theta6 = y[53]
    lam_pin1_x = y[54]
    lam_pin1_y = y[55]
    lam_pin2_x = y[56]
    lam_pin2_y = y[57]
    lam_pin3_x = y[58]
    lam_pin3_y = y[59]
    lam_pin4_x = y[60]
    lam_pin4_y = y[61]
    lam_pin5_x = y[62]
    lam_pin5_y = y[63]
    lam_pin6_x = y[64]
    lam_pin6_y = y[65]
    x0 = cos(q_theta1)
    x1 = c0*x0
    x2 = sin(q_theta1)
    x3 = x2*c0
    x4 = cos(q_theta2)
    x5 = c0*x4
    x6 = sin(q_theta2)
    x7 = c0*x6
    x8 = cos(q_theta3)
    x9 = c0*x8
    x10 = sin(q_theta3)
    x11 = c0*x10
    x12 = cos(q_theta4)
    x13 = c0*x12
    x14 = sin(q_theta4)
    x15 = c0*x14
    x16 = x13*(lam_pin4_y + lam_pin5_y) - x15*(lam_pin4_x + lam_pin5_x)
    x17 = cos(q_theta5)
    x18 = c0*x17
    x19 = sin(q_theta5)
    x20 = c0*x19
    x21 = x18*(lam_pin5_y + lam_pin6_y) - x20*(lam_pin5_x + lam_pin6_x)
    x22 = cos(q_theta6)
    x23 = c0*x22
    x24 = sin(q_theta6)
    x25 = c0*x24
    x26 = v_theta1*x0
    x27 = c0*(v_theta1*x26 + a_theta1*x2)
    x28 = v_theta1*x2
    x29 = c0*(x28 + x28)
    x30 = -x1
    x31 = -(c0*(a_theta1*x0 - v_theta1*x28))
    x32 = -(c0*(x26 + x26))
    x33 = -x3
    x34 = v_theta2*x4
    x35 = c0*(v_theta2*x34 + a_theta2*x6)
    x36 = v_theta2*x6
    x37 = c0*(x36 + x36)
    x38 = -x5
    x39 = -(c0*(a_theta2*x4 - v_theta2*x36))
    x40 = -(c0*(x34 + x34))
    x41 = -x7
    x42 = v_theta3*x8
    x43 = c0*(v_theta3*x42 + a_theta3*x10)
    x44 = v_theta3*x10
    x45 = c0*(x44 + x44)
    x46 = -x9
    x47 = -(c0*(a_theta3*x8 - v_theta3*x44))
    x48 = -(c0*(x42 + x42))
    x49 = -x11
    x50 = v_theta4*x12
    x51 = c0*(v_theta4*x50 + a_theta4*x14)
    x52 = v_theta4*x14
    x53 = c0*(x52 + x52)
    x54 = -x13
    x55 = -(c0*(a_theta4*x12 - v_theta4*x52))
    x56 = -(c0*(x50 + x50))
    x57 = -x15
    x58 = v_theta5*x17
    x59 = c0*(v_theta5*x58 + a_theta5*x19)
    x60 = v_theta5*x19
    x61 = c0*(x60 + x60)
    x62 = -x18
    x63 = -(c0*(a_theta5*x17 - v_theta5*x60))
    x64 = -(c0*(x58 + x58))
    x65 = -x20
    x66 = v_theta6*x22
    x67 = v_theta6*x24
    out[36] = p_m
    out[54] = -1.0
    out[56] = 1.0
    out[103] = p_m
    out[121] = -1.0
    out[123] = 1.0
    out[134] = x1*(lam_pin1_y + lam_pin2_y) - x3*(lam_pin1_x + lam_pin2_x)
    out[170] = c1
    out[186] = x1
    out[187] = x3
    out[188] = x1
    out[189] = x3
    out[237] = p_m
    out[254] = -1.0
    out[256] = 1.0
    out[304] = p_m
    out[321] = -1.0
    out[323] = 1.0
    out[335] = x5*(lam_pin2_y + lam_pin3_y) - x7*(lam_pin2_x + lam_pin3_x)
    out[371] = c1
    out[386] = x5
    out[387] = x7
    out[388] = x5
    out[389] = x7
    out[438] = p_m
    out[454] = -1.0
    out[456] = 1.0
    out[505] = p_m
    out[521] = -1.0
    out[523] = 1.0
    out[536] = x9*(lam_pin3_y + lam_pin4_y) - x11*(lam_pin3_x + lam_pin4_x)
    out[572] = c1
    out[586] = x9
    out[587] = x11
    out[588] = x9
    out[589] = x11
    out[639] = p_m
    out[654] = -1.0
    out[656] = 1.0
    out[706] = p_m
    out[721] = -1.0
    out[723] = 1.0
    out[737] = x16
    out[773] = c1
    out[786] = x13
    out[787] = x15
    out[788] = x13
    out[789] = x15
    out[840] = p_m
    out[854] = -1.0
    out[856] = 1.0
    out[907] = p_m
    out[921] = -1.0
    out[923] = 1.0
    out[938] = x21
    out[974] = c1
    out[986] = x18
    out[987] = x20
    out[988] = x18
    out[989] = x20
    out[1041] = p_m
    out[1054] = -1.0
    out[1108] = p_m
    out[1121] = -1.0
    out[1139] = lam_pin6_y*x23 - lam_pin6_x*x25
    out[1175] = c1
    out[1186] = x23
    out[1187] = x25
    out[1190] = x27
    out[1208] = x29
    out[1224] = 1.0
    out[1226] = x30
    out[1256] = x31
    out[1274] = x32
    out[1291] = 1.0
    out[1292] = x33
    out[1322] = x27
    out[1325] = x35
    out[1340] = x29
    out[1343] = x37
    out[1356] = -1.0
    out[1358] = x30
    out[1359] = 1.0
    out[1361] = x38
    out[1388] = x31
    out[1391] = x39
    out[1406] = x32
    out[1409] = x40
    out[1423] = -1.0
    out[1424] = x33
    out[1426] = 1.0
    out[1427] = x41
    out[1457] = x35
    out[1460] = x43
    out[1475] = x37
    out[1478] = x45
    out[1491] = -1.0
    out[1493] = x38
    out[1494] = 1.0
    out[1496] = x46
    out[1523] = x39
    out[1526] = x47
    out[1541] = x40
    out[1544] = x48
    out[1558] = -1.0
    out[1559] = x41
    out[1561] = 1.0
    out[1562] = x49
    out[1592] = x43
    out[1595] = x51
    out[1610] = x45
    out[1613] = x53
    out[1626] = -1.0
    out[1628] = x46
    out[1629] = 1.0
    out[1631] = x54
    out[1658] = x47
    out[1661] = x55
    out[1676] = x48
    out[1679] = x56
    out[1693] = -1.0
    out[1694] = x49
    out[1696] = 1.0
    out[1697] = x57
    out[1727] = x51
    out[1730] = x59
    out[1745] = x53
    out[1748] = x61
    out[1761] = -1.0
    out[1763] = x54
    out[1764] = 1.0
    out[1766] = x62
    out[1793] = x55
    out[1796] = x63
    out[1811] = x56
    out[1814] = x64
    out[1828] = -1.0
    out[1829] = x57
    out[1831] = 1.0
    out[1832] = x65
    out[1862] = x59
    out[1865] = c0*(v_theta6*x66 + a_theta6*x24)
    out[1880] = x61
    out[1883] = c0*(x67 + x67)
    out[1896] = -1.0
    out[1898] = x62
    out[1899] = 1.0
    out[1901] = -x23
    out[1928] = x63
    out[1931] = -(c0*(a_theta6*x22 - v_theta6*x67))
    out[1946] = x64
    out[1949] = -(c0*(x66 + x66))
    out[1963] = -1.0
    out[1964] = x65
    out[1966] = 1.0
    out[1967] = -x25


@njit(error_model="numpy")
def constraint_residual(t, y, p, out):
    """Position residuals, velocity residuals. 113 operations."""
    p_L = p[1]
    c0 = 0.5*p_L
    q_x1 = y[0]
    q_y1 = y[1]
    q_theta1 = y[2]
    q_x2 = y[3]
    q_y2 = y[4]
    q_theta2 = y[5]
    q_x3 = y[6]
    q_y3 = y[7]
    q_theta3 = y[8]
    q_x4 = y[9]
    q_y4 = y[10]
    q_theta4 = y[11]
    q_x5 = y[12]
    q_y5 = y[13]
    q_theta5 = y[14]
    q_x6 = y[15]
    q_y6 = y[16]
    q_theta6 = y[17]
    v_x1 = y[18]
    v_y1 = y[19]
    v_theta1 = y[20]
    v_x2 = y[21]
    v_y2 = y[22]
    v_theta2 = y[23]
    v_x3 = y[24]
    v_y3 = y[25]
    v_theta3 = y[26]
    v_x4 = y[27]
    v_y4 = y[28]
    v_theta4 = y[29]
    v_x5 = y[30]
    v_y5 = y[31]
    v_theta5 = y[32]
    v_x6 = y[33]
    v_y6 = y[34]
    v_theta6 = y[35]
    x0 = sin(q_theta1)
    x1 = x0*c0
    x2 = cos(q_theta1)
    x3 = c0*x2
    x4 = sin(q_theta2)
    x5 = c0*x4
    x6 = cos(q_theta2)
    x7 = c0*x6
    x8 = sin(q_theta3)
    x9 = c0*x8
    x10 = cos(q_theta3)
    x11 = c0*x10
    x12 = sin(q_theta4)
    x13 = c0*x12
    x14 = cos(q_theta4)
    x15 = c0*x14
    x16 = sin(q_theta5)
    x17 = c0*x16
    x18 = cos(q_theta5)
    x19 = c0*x18
    x20 = sin(q_theta6)
    x21 = cos(q_theta6)
    x22 = c0*(v_theta1*x2)
    x23 = c0*(v_theta1*x0)
    x24 = c0*(v_theta2*x6)
    x25 = c0*(v_theta2*x4)
    x26 = c0*(v_theta3*x10)
    x27 = c0*(v_theta3*x8)
    x28 = c0*(v_theta4*x14)
    x29 = c0*(v_theta4*x12)
    x30 = c0*(v_theta5*x18)
    x31 = c0*(v_theta5*x16)
    out[0] = q_x1 - x1
    out[1] = q_y1 + x3
    out[2] = q_x2 - x1 - x5 - q_x1
    out[3] = x7 + (q_y2 + x3) - q_y1
    out[4] = q_x3 - x5 - x9 - q_x2
    out[5] = x11 + (q_y3 + x7) - q_y2
    out[6] = q_x4 - x9 - x13 - q_x3
    out[7] = x15 + (q_y4 + x11) - q_y3
    out[8] = q_x5 - x13 - x17 - q_x4
    out[9] = x19 + (q_y5 + x15) - q_y4
    out[10] = q_x6 - x17 - q_x5 - c0*x20
    out[11] = c0*x21 + (q_y6 + x19 - q_y5)
    out[12] = v_x1 - x22
    out[13] = v_y1 - x23
    out[14] = v_x2 - x22 - x24 - v_x1
    out[15] = v_y2 - x23 - x25 - v_y1
    out[16] = v_x3 - x24 - x26 - v_x2
    out[17] = v_y3 - x25 - x27 - v_y2
    out[18] = v_x4 - x26 - x28 - v_x3
    out[19] = v_y4 - x27 - x29 - v_y3
    out[20] = v_x5 - x28 - x30 - v_x4
    out[21] = v_y5 - x29 - x31 - v_y4
    out[22] = v_x6 - x30 - v_x5 - c0*(v_theta6*x21)
    out[23] = v_y6 - x31 - v_y5 - c0*(v_theta6*x20)


@njit(error_model="numpy")
def constraint_jacobian(t, y, p, out):
    """Constraint Jacobian G, row by row. 37 operations."""
    p_L = p[1]
    c0 = 0.5*p_L
    q_theta1 = y[2]
    q_theta2 = y[5]
    q_theta3 = y[8]
    q_theta4 = y[11]
    q_theta5 = y[14]
    q_theta6 = y[17]
    x0 = -(c0*cos(q_theta1))
    x1 = -(sin(q_theta1)*c0)
    x2 = -(c0*cos(q_theta2))
    x3 = -(c0*sin(q_theta2))
    x4 = -(c0*cos(q_theta3))
    x5 = -(c0*sin(q_theta3))
    x6 = -(c0*cos(q_theta4))
    x7 = -(c0*sin(q_theta4))
    x8 = -(c0*cos(q_theta5))
    x9 = -(c0*sin(q_theta5))
    out[0] = 1.0
    out[2] = x0
    out[19] = 1.0
    out[20] = x1
    out[36] = -1.0
    out[38] = x0
    out[39] = 1.0
    out[41] = x2
    out[55] = -1.0
    out[56] = x1
    out[58] = 1.0
    out[59] = x3
    out[75] = -1.0
    out[77] = x2
    out[78] = 1.0
    out[80] = x4
    out[94] = -1.0
    out[95] = x3
    out[97] = 1.0
    out[98] = x5
    out[114] = -1.0
    out[116] = x4
    out[117] = 1.0
    out[119] = x6
    out[133] = -1.0
    out[134] = x5
    out[136] = 1.0
    out[137] = x7
    out[153] = -1.0
    out[155] = x6
    out[156] = 1.0
    out[158] = x8
    out[172] = -1.0
    out[173] = x7
    out[175] = 1.0
    out[176] = x9
    out[192] = -1.0
    out[194] = x8
    out[195] = 1.0
    out[197] = -(c0*cos(q_theta6))
    out[211] = -1.0
    out[212] = x9
    out[214] = 1.0
    out[215] = -(c0*sin(q_theta6))


@njit(error_model="numpy")
def gamma(t, y, p, out):
    """Right-hand side of G a = gamma. 65 operations."""
    p_L = p[1]
    c0 = 0.5*p_L
    q_theta1 = y[2]
    q_theta2 = y[5]
    q_theta3 = y[8]
    q_theta4 = y[11]
    q_theta5 = y[14]
    q_theta6 = y[17]
    v_theta1 = y[20]
    v_theta2 = y[23]
    v_theta3 = y[26]
    v_theta4 = y[29]
    v_theta5 = y[32]
    v_theta6 = y[35]
    x0 = c0*(v_theta1*(v_theta1*sin(q_theta1)))
    x1 = c0*(v_theta1*(v_theta1*cos(q_theta1)))
    x2 = c0*(v_theta2*(v_theta2*sin(q_theta2)))
    x3 = c0*(v_theta2*(v_theta2*cos(q_theta2)))
    x4 = c0*(v_theta3*(v_theta3*sin(q_theta3)))
    x5 = c0*(v_theta3*(v_theta3*cos(q_theta3)))
    x6 = c0*(v_theta4*(v_theta4*sin(q_theta4)))
    x7 = c0*(v_theta4*(v_theta4*cos(q_theta4)))
    x8 = c0*(v_theta5*(v_theta5*sin(q_theta5)))
    x9 = c0*(v_theta5*(v_theta5*cos(q_theta5)))
    out[0] = -x0
    out[1] = x1
    out[2] = -(x0 + x2)
    out[3] = x1 + x3
    out[4] = -(x2 + x4)
    out[5] = x3 + x5
    out[6] = -(x4 + x6)
    out[7] = x5 + x7
    out[8] = -(x6 + x8)
    out[9] = x7 + x9
    out[10] = -(x8 + c0*(v_theta6*(v_theta6*sin(q_theta6))))
    out[11] = x9 + c0*(v_theta6*(v_theta6*cos(q_theta6)))


@njit(error_model="numpy")
def project(t, y, p, out):
    """State moved onto the constraints, and the residuals it had. 717 operations."""
    p_m = p[0]
    p_L = p[1]
    c0 = 1.0/p_m
    c1 = 0.5*p_L
    c2 = c1*(1.0/(p_L*p_L*(0.08333333333333333*p_m)))
    c3 = c0 + c0
    q_x1 = y[0]
    q_y1 = y[1]
    q_theta1 = y[2]
    q_x2 = y[3]
    q_y2 = y[4]
    q_theta2 = y[5]
    q_x3 = y[6]
    q_y3 = y[7]
    q_theta3 = y[8]
    q_x4 = y[9]
    q_y4 = y[10]
    q_theta4 = y[11]
    q_x5 = y[12]
    q_y5 = y[13]
    q_theta5 = y[14]
    q_x6 = y[15]
    q_y6 = y[16]
    q_theta6 = y[17]
    v_x1 = y[18]
    v_y1 = y[19]
    v_theta1 = y[20]
    v_x2 = y[21]
    v_y2 = y[22]
    v_theta2 = y[23]
    v_x3 = y[24]
    v_y3 = y[25]
    v_theta3 = y[26]
    v_x4 = y[27]
    v_y4 = y[28]
    v_theta4 = y[29]
    v_x5 = y[30]
    v_y5 = y[31]
    v_theta5 = y[32]
    v_x6 = y[33]
    v_y6 = y[34]
    v_theta6 = y[35]
    x0 = cos(q_theta1)
    x1 = c1*x0
    x2 = x0*c2
    x3 = x1*x2
    x4 = c0 - x3
    x5 = 1.0/(c0 + x3)
    x6 = x4*x5
    x7 = sin(q_theta1)
    x8 = x7*c2
    x9 = x7*c1
    x10 = x9*x2
    x11 = x10*x5
    x12 = x1*x8 + x4*x11
    x13 = x10*x11
    x14 = x9*x8
    x15 = 1.0/(x13 - (c0 + x14))
    x16 = x12*x15
    x17 = cos(q_theta2)
    x18 = c1*x17
    x19 = x17*c2
    x20 = x18*x19
    x21 = 1.0/(x4*x6 - (c3 + x3) - x12*x16 - x20)
    x22 = q_x1 - x9
    x23 = x22*x11
    x24 = q_y1 + x1
    x25 = x23 - x24
    x26 = sin(q_theta2)
    x27 = c1*x26
    x28 = q_x2 - x9 - x27 - q_x1
    x29 = x16*x25 - (x28 + x22*x6)
    x30 = c0 - x20
    x31 = x30*x21
    x32 = cos(q_theta3)
    x33 = c1*x32
    x34 = x32*c2
    x35 = x33*x34
    x36 = c0 - x35
    x37 = x26*c2
    x38 = c0 - x14 + x13
    x39 = x27*x19
    x40 = x38*x16 - (x10 + x10*x6) - x39
    x41 = x40*x21
    x42 = x18*x37 + x30*x41
    x43 = x38*x15
    x44 = x27*x37
    x45 = 1.0/(x13 - (c3 + x14) - x38*x43 - x44 - x40*x41)
    x46 = x42*x45
    x47 = 1.0/(c3 + x20 + x30*x31 + x42*x46 + x35)
    x48 = x36*x47
    x49 = c0 - x44 + x39*x41
    x50 = sin(q_theta3)
    x51 = c1*x50
    x52 = x51*x34
    x53 = x39*x31 - x39 + x49*x46 - x52
    x54 = x53*x47
    x55 = x50*c2
    x56 = x36*x54 - x33*x55
    x57 = x39*x21
    x58 = x49*x45
    x59 = x51*x55
    x60 = 1.0/(x53*x54 - (c3 + x44 + x39*x57 + x49*x58 + x59))
    x61 = x56*x60
    x62 = cos(q_theta4)
    x63 = c1*x62
    x64 = x62*c2
    x65 = x63*x64
    x66 = 1.0/(x36*x48 - (c3 + x35) - x56*x61 - x65)
    x67 = x18 + (q_y2 + x1) - q_y1
    x68 = x23 - x67 - x43*x25 - x41*x29
    x69 = q_x3 - x27 - x51 - q_x2
    x70 = x46*x68 - (x69 + x31*x29)
    x71 = sin(q_theta4)
    x72 = c1*x71
    x73 = q_x4 - x51 - x72 - q_x3
    x74 = x33 + (q_y3 + x18) - q_y2
    x75 = x57*x29 - x74 - x58*x68 + x54*x70
    x76 = x48*x70 - x73 - x61*x75
    x77 = c0 - x65
    x78 = x77*x66
    x79 = c0 - x59 - x52*x54
    x80 = x72*x64
    x81 = x52 + x52*x48 + x79*x61 + x80
    x82 = x81*x66
    x83 = x71*c2
    x84 = x77*x82 - x63*x83
    x85 = x52*x47
    x86 = x79*x60
    x87 = x72*x83
    x88 = 1.0/(x52*x85 - (c3 + x59) - x79*x86 - x87 - x81*x82)
    x89 = x84*x88
    x90 = cos(q_theta5)
    x91 = c1*x90
    x92 = x90*c2
    x93 = x91*x92
    x94 = 1.0/(c3 + x65 + x77*x78 + x84*x89 + x93)
    x95 = sin(q_theta5)
    x96 = c1*x95
    x97 = q_x5 - x72 - x96 - q_x4
    x98 = x63 + (q_y4 + x33) - q_y3
    x99 = x82*x76 - (x98 + x85*x70 + x86*x75)
    x100 = x97 + x78*x76 + x89*x99
    x101 = c0 - x93
    x102 = x101*x94
    x103 = sin(q_theta6)
    x104 = c1*x103
    x105 = cos(q_theta6)
    x106 = x105*c2
    x107 = x96*x92
    x108 = x95*c2
    x109 = x96*x108
    x110 = c0 - x87 - x80*x82
    x111 = x80*x78 - x80 - x110*x89 - x107
    x112 = x111*x94
    x113 = c0 - x109 - x107*x112
    x114 = x101*x112 - x91*x108
    x115 = x80*x66
    x116 = x110*x88
    x117 = 1.0/(x111*x112 - (c3 + x87 + x80*x115 + x110*x116 + x109))
    x118 = x114*x117
    x119 = x104*x106 + x107 + x107*x102 + x113*x118
    x120 = c1*x105
    x121 = 1.0/(x101*x102 - (c3 + x120*x106 + x93) - x114*x118)
    x122 = x119*x121
    x123 = x107*x94
    x124 = x103*c2
    x125 = x113*x117
    x126 = 1.0/(x107*x123 - (c3 + x104*x124 + x109) - x113*x125 - x119*x122)
    x127 = x120 + (q_y6 + x91 - q_y5)
    x128 = x91 + (q_y5 + x63) - q_y4
    x129 = x115*x76 - x128 - x116*x99 - x112*x100
    x130 = q_x6 - x96 - q_x5 - x104
    x131 = x130 + x102*x100 + x118*x129
    x132 = x126*(x123*x100 - x127 - x125*x129 - x122*x131)
    x133 = x122*x132 - x121*x131
    x134 = x117*x129 - x125*x132 - x118*x133
    x135 = x94*x100 + x102*x133 + x112*x134 - x123*x132
    x136 = x88*x99 - x116*x134 - x89*x135
    x137 = x66*x76 - x78*x135 + x82*x136 + x115*x134
    x138 = x60*x75 - x86*x136 - x61*x137
    x139 = x48*x137 - x47*x70 + x54*x138 - x85*x136
    x140 = x45*x68 - x58*x138 + x46*x139
    x141 = x21*x29 - x31*x139 - x41*x140 + x57*x138
    x142 = c0*x141
    x143 = x15*x25 - x43*x140 + x16*x141
    x144 = x22*x5 + x6*x141 - x11*x143 - x11*x140
    x145 = c0*x140
    x146 = q_theta1 + (x2*x144 + x8*x143 + x2*x141 + x8*x140)
    x147 = c0*x139
    x148 = c0*x138
    x149 = q_theta2 + (x19*x141 + x37*x140 + x19*x139 + x37*x138)
    x150 = c0*x137
    x151 = c0*x136
    x152 = q_theta3 + (x34*x139 + x55*x138 + x34*x137 + x55*x136)
    x153 = c0*x135
    x154 = c0*x134
    x155 = q_theta4 + (x64*x137 + x83*x136 + x64*x135 + x83*x134)
    x156 = c0*x133
    x157 = c0*x132
    x158 = q_theta5 + (x92*x135 + x108*x134 + x92*x133 + x108*x132)
    x159 = q_theta6 + (x106*x133 + x124*x132)
    x160 = c1*(v_theta1*cos(x146))
    x161 = v_x1 - x160
    x162 = x11*x161
    x163 = c1*(v_theta1*sin(x146))
    x164 = v_y1 - x163
    x165 = x162 - x164
    x166 = c1*(v_theta2*cos(x149))
    x167 = v_x2 - x160 - x166 - v_x1
    x168 = x16*x165 - (x167 + x6*x161)
    x169 = c1*(v_theta2*sin(x149))
    x170 = v_y2 - x163 - x169 - v_y1
    x171 = x162 - x170 - x43*x165 - x41*x168
    x172 = c1*(v_theta3*cos(x152))
    x173 = v_x3 - x166 - x172 - v_x2
    x174 = x46*x171 - (x173 + x31*x168)
    x175 = c1*(v_theta4*cos(x155))
    x176 = v_x4 - x172 - x175 - v_x3
    x177 = c1*(v_theta3*sin(x152))
    x178 = v_y3 - x169 - x177 - v_y2
    x179 = x57*x168 - x178 - x58*x171 + x54*x174
    x180 = x48*x174 - x176 - x61*x179
    x181 = c1*(v_theta5*cos(x158))
    x182 = v_x5 - x175 - x181 - v_x4
    x183 = c1*(v_theta4*sin(x155))
    x184 = v_y4 - x177 - x183 - v_y3
    x185 = x82*x180 - (x184 + x85*x174 + x86*x179)
    x186 = x182 + x78*x180 + x89*x185
    x187 = c1*(v_theta5*sin(x158))
    x188 = v_y6 - x187 - v_y5 - c1*(v_theta6*sin(x159))
    x189 = v_y5 - x183 - x187 - v_y4
    x190 = x115*x180 - x189 - x116*x185 - x112*x186
    x191 = v_x6 - x181 - v_x5 - c1*(v_theta6*cos(x159))
    x192 = x191 + x102*x186 + x118*x190
    x193 = x126*(x123*x186 - x188 - x125*x190 - x122*x192)
    x194 = x122*x193 - x121*x192
    x195 = x117*x190 - x125*x193 - x118*x194
    x196 = x94*x186 + x102*x194 + x112*x195 - x123*x193
    x197 = x88*x185 - x116*x195 - x89*x196
    x198 = x66*x180 - x78*x196 + x82*x197 + x115*x195
    x199 = x60*x179 - x86*x197 - x61*x198
    x200 = x48*x198 - x47*x174 + x54*x199 - x85*x197
    x201 = x45*x171 - x58*x199 + x46*x200
    x202 = x21*x168 - x31*x200 - x41*x201 + x57*x199
    x203 = c0*x202
    x204 = x15*x165 - x43*x201 + x16*x202
    x205 = x5*x161 + x6*x202 - x11*x204 - x11*x201
    x206 = c0*x201
    x207 = c0*x200
    x208 = c0*x199
    x209 = c0*x198
    x210 = c0*x197
    x211 = c0*x196
    x212 = c0*x195
    x213 = c0*x194
    x214 = c0*x193
    out[0] = q_x1 + (x142 - c0*x144)
    out[1] = q_y1 + (x145 - c0*x143)
    out[2] = x146
    out[3] = q_x2 + (x147 - x142)
    out[4] = q_y2 + (x148 - x145)
    out[5] = x149
    out[6] = q_x3 + (x150 - x147)
    out[7] = q_y3 + (x151 - x148)
    out[8] = x152
    out[9] = q_x4 + (x153 - x150)
    out[10] = q_y4 + (x154 - x151)
    out[11] = x155
    out[12] = q_x5 + (x156 - x153)
    out[13] = q_y5 + (x157 - x154)
    out[14] = x158
    out[15] = q_x6 - x156
    out[16] = q_y6 - x157
    out[17] = x159
    out[18] = v_x1 + (x203 - c0*x205)
    out[19] = v_y1 + (x206 - c0*x204)
    out[20] = v_theta1 + (x2*x205 + x8*x204 + x2*x202 + x8*x201)
    out[21] = v_x2 + (x207 - x203)
    out[22] = v_y2 + (x208 - x206)
    out[23] = v_theta2 + (x19*x202 + x37*x201 + x19*x200 + x37*x199)
    out[24] = v_x3 + (x209 - x207)
    out[25] = v_y3 + (x210 - x208)
    out[26] = v_theta3 + (x34*x200 + x55*x199 + x34*x198 + x55*x197)
    out[27] = v_x4 + (x211 - x209)
    out[28] = v_y4 + (x212 - x210)
    out[29] = v_theta4 + (x64*x198 + x83*x197 + x64*x196 + x83*x195)
    out[30] = v_x5 + (x213 - x211)
    out[31] = v_y5 + (x214 - x212)
    out[32] = v_theta5 + (x92*x196 + x108*x195 + x92*x194 + x108*x193)
    out[33] = v_x6 - x213
    out[34] = v_y6 - x214
    out[35] = v_theta6 + (x106*x194 + x124*x193)
    out[36] = x22
    out[37] = x24
    out[38] = x28
    out[39] = x67
    out[40] = x69
    out[41] = x74
    out[42] = x73
    out[43] = x98
    out[44] = x97
    out[45] = x128
    out[46] = x130
    out[47] = x127
    out[48] = x161
    out[49] = x164
    out[50] = x167
    out[51] = x170
    out[52] = x173
    out[53] = x178
    out[54] = x176
    out[55] = x184
    out[56] = x182
    out[57] = x189
    out[58] = x191
    out[59] = x188


@njit(error_model="numpy")
def poses(t, y, p, out):
    """Per body: position, rotation matrix (body to world). 24 operations."""
    q_x1 = y[0]
    q_y1 = y[1]
    q_theta1 = y[2]
    q_x2 = y[3]
    q_y2 = y[4]
    q_theta2 = y[5]
    q_x3 = y[6]
    q_y3 = y[7]
    q_theta3 = y[8]
    q_x4 = y[9]
    q_y4 = y[10]
    q_theta4 = y[11]
    q_x5 = y[12]
    q_y5 = y[13]
    q_theta5 = y[14]
    q_x6 = y[15]
    q_y6 = y[16]
    q_theta6 = y[17]
    x0 = q_theta1 + -1.5707963267948966
    x1 = cos(x0)
    x2 = sin(x0)
    x3 = q_theta2 + -1.5707963267948966
    x4 = cos(x3)
    x5 = sin(x3)
    x6 = q_theta3 + -1.5707963267948966
    x7 = cos(x6)
    x8 = sin(x6)
    x9 = q_theta4 + -1.5707963267948966
    x10 = cos(x9)
    x11 = sin(x9)
    x12 = q_theta5 + -1.5707963267948966
    x13 = cos(x12)
    x14 = sin(x12)
    x15 = q_theta6 + -1.5707963267948966
    x16 = cos(x15)
    x17 = sin(x15)
    out[0] = q_x1
    out[1] = q_y1
    out[2] = 0.0
    out[3] = x1
    out[4] = -x2
    out[5] = 0.0
    out[6] = x2
    out[7] = x1
    out[8] = 0.0
    out[9] = 0.0
    out[10] = 0.0
    out[11] = 1.0
    out[12] = q_x2
    out[13] = q_y2
    out[14] = 0.0
    out[15] = x4
    out[16] = -x5
    out[17] = 0.0
    out[18] = x5
    out[19] = x4
    out[20] = 0.0
    out[21] = 0.0
    out[22] = 0.0
    out[23] = 1.0
    out[24] = q_x3
    out[25] = q_y3
    out[26] = 0.0
    out[27] = x7
    out[28] = -x8
    out[29] = 0.0
    out[30] = x8
    out[31] = x7
    out[32] = 0.0
    out[33] = 0.0
    out[34] = 0.0
    out[35] = 1.0
    out[36] = q_x4
    out[37] = q_y4
    out[38] = 0.0
    out[39] = x10
    out[40] = -x11
    out[41] = 0.0
    out[42] = x11
    out[43] = x10
    out[44] = 0.0
    out[45] = 0.0
    out[46] = 0.0
    out[47] = 1.0
    out[48] = q_x5
    out[49] = q_y5
    out[50] = 0.0
    out[51] = x13
    out[52] = -x14
    out[53] = 0.0
    out[54] = x14
    out[55] = x13
    out[56] = 0.0
    out[57] = 0.0
    out[58] = 0.0
    out[59] = 1.0
    out[60] = q_x6
    out[61] = q_y6
    out[62] = 0.0
    out[63] = x16
    out[64] = -x17
    out[65] = 0.0
    out[66] = x17
    out[67] = x16
    out[68] = 0.0
    out[69] = 0.0
    out[70] = 0.0
    out[71] = 1.0


@njit(error_model="numpy")
def shapes(t, y, p, out):
    """Sizes of the bodies' shapes. 0 operations."""
    p_L = p[1]
    out[0] = 0.02
    out[1] = p_L
    out[2] = 0.02
    out[3] = p_L
    out[4] = 0.02
    out[5] = p_L
    out[6] = 0.02
    out[7] = p_L
    out[8] = 0.02
    out[9] = p_L
    out[10] = 0.02
    out[11] = p_L


@njit(error_model="numpy")
def marks(t, y, p, out):
    """What a picture shows besides bodies, as `marks` lists it. 9 operations."""
    p_L = p[1]
    c0 = 0.5*p_L
    c1 = -c0
    q_x1 = y[0]
    q_y1 = y[1]
    q_theta1 = y[2]
    x0 = q_theta1 + -1.5707963267948966
    out[0] = c1
    out[5] = 1.0
    out[6] = q_x1 - cos(x0)*c0
    out[7] = q_y1 - sin(x0)*c0
    out[9] = c1
    out[12] = c0
    out[17] = 1.0
    out[18] = c0
    out[21] = c0
    out[26] = 1.0
    out[27] = c0
    out[30] = c0
    out[35] = 1.0
    out[36] = c0
    out[39] = c0
    out[44] = 1.0
    out[45] = c0
    out[48] = c0
    out[53] = 1.0
    out[54] = c0


@njit(error_model="numpy")
def limits(t, y, p, out):
    """Numbers of parameters that have a bound. 3 operations."""
    p_m = p[0]
    p_L = p[1]
    c0 = p_L*p_L*(0.08333333333333333*p_m)
    out[0] = p_L
    out[1] = p_m
    out[2] = c0
