"""n_four_bar: equations of motion, written by symgen 0.1.0. Do not edit.

4 four-bar windows in a row, parallel rockers that turn together
"""

from math import cos, sin

from numba import njit

MODEL = {
    "abi": 1,
    "generator": "symgen 0.1.0",
    "source": "sha256:bdd968e3acf64a5197a5b2936f081fe553ffd51f663c410d0fb9b5b2621daa37",
    "name": "n_four_bar",
    "description": "4 four-bar windows in a row, parallel rockers that turn together",
    "nq": 9,
    "nv": 9,
    "nh": 8,
    "nn": 0,
    "nw": 0,
    "coordinates": [
        {"name": "rocker0", "unit": "rad", "value": 1.5707963267948966, "enforced": True},
        {"name": "rocker1", "unit": "rad", "value": 1.5707963267948966, "enforced": False},
        {"name": "coupler1", "unit": "rad", "value": 0.0, "enforced": False},
        {"name": "rocker2", "unit": "rad", "value": 1.5707963267948966, "enforced": False},
        {"name": "coupler2", "unit": "rad", "value": 0.0, "enforced": False},
        {"name": "rocker3", "unit": "rad", "value": 1.5707963267948966, "enforced": False},
        {"name": "coupler3", "unit": "rad", "value": 0.0, "enforced": False},
        {"name": "rocker4", "unit": "rad", "value": 1.5707963267948966, "enforced": False},
        {"name": "coupler4", "unit": "rad", "value": 0.0, "enforced": False},
    ],
    "quaternions": [],
    "rates": [
        {"name": "rocker0", "unit": "rad/s", "value": -1.0, "enforced": True},
        {"name": "rocker1", "unit": "rad/s", "value": -1.0, "enforced": False},
        {"name": "coupler1", "unit": "rad/s", "value": 0.0, "enforced": False},
        {"name": "rocker2", "unit": "rad/s", "value": -1.0, "enforced": False},
        {"name": "coupler2", "unit": "rad/s", "value": 0.0, "enforced": False},
        {"name": "rocker3", "unit": "rad/s", "value": -1.0, "enforced": False},
        {"name": "coupler3", "unit": "rad/s", "value": 0.0, "enforced": False},
        {"name": "rocker4", "unit": "rad/s", "value": -1.0, "enforced": False},
        {"name": "coupler4", "unit": "rad/s", "value": 0.0, "enforced": False},
    ],
    "parameters": [
        {"name": "m", "unit": "kg", "value": 1.0, "doc": ""},
        {"name": "L", "unit": "m", "value": 1.0, "doc": ""},
        {"name": "g", "unit": "m/s^2", "value": 9.81, "doc": ""},
    ],
    "inputs": [],
    "constants": [],
    "constraints": [
        {"name": "loop1_x", "kind": "holonomic", "multiplier": "N"},
        {"name": "loop1_y", "kind": "holonomic", "multiplier": "N"},
        {"name": "loop2_x", "kind": "holonomic", "multiplier": "N"},
        {"name": "loop2_y", "kind": "holonomic", "multiplier": "N"},
        {"name": "loop3_x", "kind": "holonomic", "multiplier": "N"},
        {"name": "loop3_y", "kind": "holonomic", "multiplier": "N"},
        {"name": "loop4_x", "kind": "holonomic", "multiplier": "N"},
        {"name": "loop4_y", "kind": "holonomic", "multiplier": "N"},
    ],
    "outputs": [],
    "events": [],
    "bodies": [
        {"name": "rocker_bar0", "planar": True, "shape": "capsule", "sizes": 2, "mesh": ""},
        {"name": "rocker_bar1", "planar": True, "shape": "capsule", "sizes": 2, "mesh": ""},
        {"name": "coupler_bar1", "planar": True, "shape": "capsule", "sizes": 2, "mesh": ""},
        {"name": "rocker_bar2", "planar": True, "shape": "capsule", "sizes": 2, "mesh": ""},
        {"name": "coupler_bar2", "planar": True, "shape": "capsule", "sizes": 2, "mesh": ""},
        {"name": "rocker_bar3", "planar": True, "shape": "capsule", "sizes": 2, "mesh": ""},
        {"name": "coupler_bar3", "planar": True, "shape": "capsule", "sizes": 2, "mesh": ""},
        {"name": "rocker_bar4", "planar": True, "shape": "capsule", "sizes": 2, "mesh": ""},
        {"name": "coupler_bar4", "planar": True, "shape": "capsule", "sizes": 2, "mesh": ""},
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
        "rhs": 676,
        "mass_matrix": 48,
        "forces": 174,
        "energy": 179,
        "residual": 304,
        "residual_jacobian": 525,
        "constraint_residual": 108,
        "constraint_jacobian": 48,
        "gamma": 96,
        "project": 626,
        "poses": 72,
        "shapes": 0,
        "marks": 5,
        "limits": 3,
    },
    "hoisted": {
        "rhs": 17,
        "mass_matrix": 7,
        "forces": 7,
        "energy": 5,
        "residual": 8,
        "residual_jacobian": 11,
        "project": 11,
        "poses": 4,
        "marks": 5,
    },
    "run": {
        "t_end": 10.0,
        "fps": 60.0,
    },
    "limits": [
        {"name": "bodies.rocker_bar0.shape.capsule[1]", "bound": "zero or more"},
        {"name": "bodies.rocker_bar0.mass", "bound": "zero or more"},
        {"name": "bodies.rocker_bar0.inertia", "bound": "zero or more"},
    ],
    "subsystems": [],
    "marks": [
        {"kind": "pin", "name": "rocker_bar0_1", "body": "rocker_bar0", "numbers": 6},
        {"kind": "ground", "name": "rocker_bar0_1", "body": "", "numbers": 3},
        {"kind": "pin", "name": "rocker_bar0_2", "body": "rocker_bar0", "numbers": 6},
        {"kind": "pin", "name": "rocker_bar1_1", "body": "rocker_bar1", "numbers": 6},
        {"kind": "ground", "name": "rocker_bar1_1", "body": "", "numbers": 3},
        {"kind": "pin", "name": "rocker_bar1_2", "body": "rocker_bar1", "numbers": 6},
        {"kind": "pin", "name": "coupler_bar1_2", "body": "coupler_bar1", "numbers": 6},
        {"kind": "reaction", "name": "coupler_bar1_2", "body": "coupler_bar1", "numbers": 3, "constraints": [0, 1], "signs": [1, 1]},
        {"kind": "pin", "name": "rocker_bar2_1", "body": "rocker_bar2", "numbers": 6},
        {"kind": "ground", "name": "rocker_bar2_1", "body": "", "numbers": 3},
        {"kind": "pin", "name": "rocker_bar2_2", "body": "rocker_bar2", "numbers": 6},
        {"kind": "pin", "name": "coupler_bar2_2", "body": "coupler_bar2", "numbers": 6},
        {"kind": "reaction", "name": "coupler_bar2_2", "body": "coupler_bar2", "numbers": 3, "constraints": [2, 3], "signs": [1, 1]},
        {"kind": "pin", "name": "rocker_bar3_1", "body": "rocker_bar3", "numbers": 6},
        {"kind": "ground", "name": "rocker_bar3_1", "body": "", "numbers": 3},
        {"kind": "pin", "name": "rocker_bar3_2", "body": "rocker_bar3", "numbers": 6},
        {"kind": "pin", "name": "coupler_bar3_2", "body": "coupler_bar3", "numbers": 6},
        {"kind": "reaction", "name": "coupler_bar3_2", "body": "coupler_bar3", "numbers": 3, "constraints": [4, 5], "signs": [1, 1]},
        {"kind": "pin", "name": "rocker_bar4_1", "body": "rocker_bar4", "numbers": 6},
        {"kind": "ground", "name": "rocker_bar4_1", "body": "", "numbers": 3},
        {"kind": "pin", "name": "rocker_bar4_2", "body": "rocker_bar4", "numbers": 6},
        {"kind": "reaction", "name": "rocker_bar4_2", "body": "rocker_bar4", "numbers": 3, "constraints": [6, 7], "signs": [-1, -1]},
    ],
}

@njit(error_model="numpy")
def rhs(t, y, p, out):
    """State derivative: rates, accelerations, multipliers, pivot ratio. 676 operations."""
    p_m = p[0]
    p_L = p[1]
    p_g = p[2]
    c0 = p_L*p_L
    c1 = c0*(0.08333333333333333*p_m)
    c2 = 0.5*p_L
    c3 = p_m*(c2*c2)
    c4 = c1 + (c3 + p_m*c0)
    c5 = 1.0/c4
    c6 = p_L*c5
    c7 = p_m*c2
    c8 = p_L*c7
    c9 = c1 + c3
    c10 = 1.0/c9
    c11 = p_m*p_g
    c12 = c2*c11
    c13 = c12 + p_L*c11
    c14 = p_m*p_L
    c15 = c2*c7
    c16 = p_L*c10
    q_rocker0 = y[0]
    q_rocker1 = y[1]
    q_coupler1 = y[2]
    q_rocker2 = y[3]
    q_coupler2 = y[4]
    q_rocker3 = y[5]
    q_coupler3 = y[6]
    q_rocker4 = y[7]
    q_coupler4 = y[8]
    v_rocker0 = y[9]
    v_rocker1 = y[10]
    v_coupler1 = y[11]
    v_rocker2 = y[12]
    v_coupler2 = y[13]
    v_rocker3 = y[14]
    v_coupler3 = y[15]
    v_rocker4 = y[16]
    v_coupler4 = y[17]
    x0 = sin(q_rocker0)
    x1 = x0*c6
    x2 = sin(q_rocker1)
    x3 = p_L*x2
    x4 = cos(q_rocker1)
    x5 = cos(q_coupler2)
    x6 = sin(q_coupler2)
    x7 = c8*(x4*x5) + c8*(x2*x6)
    x8 = x7*c10
    x9 = 1.0/(c4 - x7*x8)
    x10 = x3*x9
    x11 = p_L*x0
    x12 = cos(q_rocker0)
    x13 = cos(q_coupler1)
    x14 = sin(q_coupler1)
    x15 = c8*(x12*x13) + c8*(x0*x14)
    x16 = x15*c5
    x17 = x11*x16 - p_L*x14
    x18 = 1.0/(c9 - x15*x16)
    x19 = x17*x18
    x20 = 1.0/(x3*x10 + (x17*x19 + x11*x1))
    x21 = v_rocker1*(v_rocker1*x4)
    x22 = p_L*x21
    x23 = v_rocker0*(v_rocker0*x12)
    x24 = p_L*x23
    x25 = v_coupler1*(v_coupler1*x13)
    x26 = x24 + c2*x25
    x27 = v_rocker0*(v_rocker0*x0)
    x28 = p_L*x27
    x29 = v_coupler1*(v_coupler1*x14)
    x30 = x28 + c2*x29
    x31 = x12*c13 + (x0*(x26*c14 + x23*c15) - x12*(x30*c14 + x27*c15))
    x32 = x16*x31 - (x13*c12 + (c7*(x14*x26) - c7*(x13*x30)))
    x33 = v_coupler2*(v_coupler2*x5)
    x34 = x22 + c2*x33
    x35 = v_rocker1*(v_rocker1*x2)
    x36 = p_L*x35
    x37 = v_coupler2*(v_coupler2*x6)
    x38 = x36 + c2*x37
    x39 = x5*c12 + (c7*(x6*x34) - c7*(x5*x38))
    x40 = x8*x39 - (x4*c13 + (x2*(x34*c14 + x21*c15) - x4*(x38*c14 + x35*c15)))
    x41 = x22 - (x24 + p_L*x25) + x31*x1 + x19*x32 + x10*x40
    x42 = p_L*x4
    x43 = p_L*x12
    x44 = p_L*x13 - x43*x16
    x45 = x42*x10 + (x43*x1 - x44*x19)
    x46 = x45*x20
    x47 = x42*x9
    x48 = x44*x18
    x49 = x12*c6
    x50 = x42*x47 + (x44*x48 + x43*x49)
    x51 = x45*x46 - x50
    x52 = 1.0/x51
    x53 = x31*x49 - (x36 - (x28 + p_L*x29)) - x48*x32 + x47*x40 - x46*x41
    x54 = p_L*x6
    x55 = x54*x8 - x3
    x56 = x55*x10
    x57 = x55*x47 - x56*x46
    x58 = x57*x52
    x59 = x56*x20
    x60 = x55*x9
    x61 = x6*c16
    x62 = x55*x60 + x54*x61
    x63 = sin(q_rocker2)
    x64 = p_L*x63
    x65 = cos(q_rocker2)
    x66 = cos(q_coupler3)
    x67 = sin(q_coupler3)
    x68 = c8*(x65*x66) + c8*(x63*x67)
    x69 = x68*c10
    x70 = 1.0/(c4 - x68*x69)
    x71 = x64*x70
    x72 = x64*x71
    x73 = x56*x59 - x62 - x57*x58 - x72
    x74 = 1.0/x73
    x75 = v_rocker2*(v_rocker2*x65)
    x76 = p_L*x75
    x77 = x59*x41 - (x76 - (x22 + p_L*x33) + x39*x61 + x60*x40) - x58*x53
    x78 = v_coupler3*(v_coupler3*x66)
    x79 = x76 + c2*x78
    x80 = v_rocker2*(v_rocker2*x63)
    x81 = p_L*x80
    x82 = v_coupler3*(v_coupler3*x67)
    x83 = x81 + c2*x82
    x84 = x66*c12 + (c7*(x67*x79) - c7*(x66*x83))
    x85 = x65*c13 + (x63*(x79*c14 + x75*c15) - x65*(x83*c14 + x80*c15))
    x86 = x69*x84 - x85
    x87 = x77 - x71*x86
    x88 = p_L*x65
    x89 = p_L*x5
    x90 = x42 - x89*x8
    x91 = x90*x10
    x92 = x90*x47 - x91*x46
    x93 = x88*x71 + (x89*x61 - x90*x60 + x91*x59 - x92*x58)
    x94 = x93*x74
    x95 = x91*x20
    x96 = x90*x9
    x97 = x5*c16
    x98 = x90*x96 + x89*x97
    x99 = x92*x52
    x100 = x88*x70
    x101 = x88*x100
    x102 = x91*x95 - x98 - x92*x99 - x101 - x93*x94
    x103 = 1.0/x102
    x104 = x39*x97 - (x81 - (x36 + p_L*x37)) - x96*x40 + x95*x41 - x99*x53
    x105 = x104 + x100*x86 - x94*x87
    x106 = p_L*x67
    x107 = x106*x69 - x64
    x108 = x107*x71
    x109 = x107*x100 + x108*x94
    x110 = x109*x103
    x111 = cos(q_rocker3)
    x112 = p_L*x111
    x113 = sin(q_rocker3)
    x114 = p_L*x113
    x115 = cos(q_coupler4)
    x116 = sin(q_coupler4)
    x117 = c8*(x111*x115) + c8*(x113*x116)
    x118 = x117*c10
    x119 = 1.0/(c4 - x117*x118)
    x120 = x114*x119
    x121 = p_L*x66
    x122 = x67*c16
    x123 = x88 - x121*x69
    x124 = x107*x70
    x125 = x123*x71
    x126 = x108*x74
    x127 = x123*x100 + x125*x94
    x128 = x112*x120 + (x121*x122 - x123*x124 - x125*x126 - x127*x110)
    x129 = x114*x120
    x130 = x107*x124 + x106*x122
    x131 = x129 + (x130 + x108*x126 + x109*x110)
    x132 = 1.0/x131
    x133 = x128*x132
    x134 = x112*x119
    x135 = x112*x134
    x136 = x123*x70
    x137 = x66*c16
    x138 = x123*x136 + x121*x137
    x139 = x125*x74
    x140 = x127*x103
    x141 = x128*x133 - (x135 + (x138 + x125*x139 + x127*x140))
    x142 = 1.0/x141
    x143 = v_rocker3*(v_rocker3*x113)
    x144 = p_L*x143
    x145 = x84*x137 - (x144 - (x81 + p_L*x82)) - x136*x86 + x139*x87 - x140*x105
    x146 = v_rocker3*(v_rocker3*x111)
    x147 = p_L*x146
    x148 = v_coupler4*(v_coupler4*x115)
    x149 = x147 + c2*x148
    x150 = v_coupler4*(v_coupler4*x116)
    x151 = x144 + c2*x150
    x152 = x115*c12 + (c7*(x116*x149) - c7*(x115*x151))
    x153 = x111*c13 + (x113*(x149*c14 + x146*c15) - x111*(x151*c14 + x143*c15))
    x154 = x118*x152 - x153
    x155 = x126*x87 - (x147 - (x76 + p_L*x78) + x84*x122 + x124*x86) - x110*x105
    x156 = x155 - x120*x154
    x157 = x145 + x134*x154 + x133*x156
    x158 = p_L*x116
    x159 = x158*x118 - x114
    x160 = x159*x120
    x161 = x159*x134 - x160*x133
    x162 = x161*x142
    x163 = x160*x132
    x164 = x159*x119
    x165 = sin(q_rocker4)
    x166 = x165*c16
    x167 = x116*c16
    x168 = x159*x164 + (p_L*x165*x166 + x158*x167)
    x169 = x160*x163 - x168 - x161*x162
    x170 = 1.0/x169
    x171 = cos(q_rocker4)
    x172 = v_rocker4*(v_rocker4*x171)
    x173 = v_rocker4*(v_rocker4*x165)
    x174 = x171*c12 + (c15*(x165*x172) - c15*(x171*x173))
    x175 = x174*x166 - (p_L*x172 - (x147 + p_L*x148)) - x152*x167 - x164*x154
    x176 = x175 - x163*x156 - x162*x157
    x177 = p_L*x171
    x178 = p_L*x115
    x179 = x112 - x178*x118
    x180 = x179*x120
    x181 = x179*x134 - x180*x133
    x182 = x177*x166 + x178*x167 - x179*x164 + x180*x163 - x181*x162
    x183 = x182*x170
    x184 = x180*x132
    x185 = x179*x119
    x186 = x171*c16
    x187 = x115*c16
    x188 = x179*x185 + (x177*x186 + x178*x187)
    x189 = x181*x142
    x190 = x180*x184 - x188 - x181*x189 - x182*x183
    x191 = x152*x187 - (p_L*x173 - (x144 + p_L*x150) + x174*x186) - x185*x154
    x192 = 1.0/x190*(x191 - x184*x156 - x189*x157 - x183*x176)
    x193 = x170*x176 - x183*x192
    x194 = x142*x157 - x162*x193 - x189*x192
    x195 = x133*x194 - x132*x156 - x163*x193 - x184*x192
    x196 = x103*x105 - x110*x195 - x140*x194
    x197 = x74*x87 - x94*x196 + x126*x195 + x139*x194
    x198 = x52*x53 - x58*x197 - x99*x196
    x199 = x20*x41 + x46*x198 - x59*x197 - x95*x196
    x200 = x18*x32 - x19*x199 - x48*x198
    x201 = x9*x40 - x10*x199 + x47*x198 - x60*x197 - x96*x196
    x202 = x70*x86 - x71*x197 + x100*x196 - x124*x195 - x136*x194
    x203 = x119*x154 - x120*x195 + x134*x194 - x164*x193 - x185*x192
    x204 = -(x190/x188)
    x205 = -(x169/x168)
    x206 = -(x141/(x135 + x138))
    x207 = x131/(x129 + x130)
    x208 = -(x102/(x101 + x98))
    x209 = -(x73/(x72 + x62))
    x210 = -(x51/x50)
    x211 = (x210 if x210 < 1.0 else 1.0)
    x212 = (x209 if x209 < x211 else x211)
    x213 = (x208 if x208 < x212 else x212)
    x214 = (x207 if x207 < x213 else x213)
    x215 = (x206 if x206 < x214 else x214)
    x216 = (x205 if x205 < x215 else x215)
    out[0] = v_rocker0
    out[1] = v_rocker1
    out[2] = v_coupler1
    out[3] = v_rocker2
    out[4] = v_coupler2
    out[5] = v_rocker3
    out[6] = v_coupler3
    out[7] = v_rocker4
    out[8] = v_coupler4
    out[9] = x1*x199 - (c5*x31 + x16*x200) - x49*x198
    out[10] = x201
    out[11] = x200
    out[12] = x202
    out[13] = x61*x197 - (c10*x39 + x8*x201) - x97*x196
    out[14] = x203
    out[15] = x122*x195 - (c10*x84 + x69*x202) - x137*x194
    out[16] = x186*x192 - (c10*x174 + x166*x193)
    out[17] = x167*x193 - (c10*x152 + x118*x203) - x187*x192
    out[18] = -x199
    out[19] = -x198
    out[20] = -x197
    out[21] = -x196
    out[22] = -x195
    out[23] = -x194
    out[24] = -x193
    out[25] = -x192
    out[26] = (x204 if x204 < x216 else x216)


@njit(error_model="numpy")
def mass_matrix(t, y, p, out):
    """Mass matrix M, row by row. 48 operations."""
    p_m = p[0]
    p_L = p[1]
    c0 = p_L*p_L
    c1 = c0*(0.08333333333333333*p_m)
    c2 = 0.5*p_L
    c3 = p_m*(c2*c2)
    c4 = c1 + (c3 + p_m*c0)
    c5 = p_L*(p_m*c2)
    c6 = c1 + c3
    q_rocker0 = y[0]
    q_rocker1 = y[1]
    q_coupler1 = y[2]
    q_rocker2 = y[3]
    q_coupler2 = y[4]
    q_rocker3 = y[5]
    q_coupler3 = y[6]
    q_coupler4 = y[8]
    x0 = c5*(cos(q_rocker0)*cos(q_coupler1)) + c5*(sin(q_rocker0)*sin(q_coupler1))
    x1 = c5*(cos(q_rocker1)*cos(q_coupler2)) + c5*(sin(q_rocker1)*sin(q_coupler2))
    x2 = c5*(cos(q_rocker2)*cos(q_coupler3)) + c5*(sin(q_rocker2)*sin(q_coupler3))
    x3 = c5*(cos(q_rocker3)*cos(q_coupler4)) + c5*(sin(q_rocker3)*sin(q_coupler4))
    out[0] = c4
    out[2] = x0
    out[10] = c4
    out[13] = x1
    out[18] = x0
    out[20] = c6
    out[30] = c4
    out[33] = x2
    out[37] = x1
    out[40] = c6
    out[50] = c4
    out[53] = x3
    out[57] = x2
    out[60] = c6
    out[70] = c6
    out[77] = x3
    out[80] = c6


@njit(error_model="numpy")
def forces(t, y, p, out):
    """Forces f of M a = f + G^T lambda. 174 operations."""
    p_m = p[0]
    p_L = p[1]
    p_g = p[2]
    c0 = 0.5*p_L
    c1 = p_m*p_g
    c2 = c0*c1
    c3 = c2 + p_L*c1
    c4 = p_m*p_L
    c5 = p_m*c0
    c6 = c0*c5
    q_rocker0 = y[0]
    q_rocker1 = y[1]
    q_coupler1 = y[2]
    q_rocker2 = y[3]
    q_coupler2 = y[4]
    q_rocker3 = y[5]
    q_coupler3 = y[6]
    q_rocker4 = y[7]
    q_coupler4 = y[8]
    v_rocker0 = y[9]
    v_rocker1 = y[10]
    v_coupler1 = y[11]
    v_rocker2 = y[12]
    v_coupler2 = y[13]
    v_rocker3 = y[14]
    v_coupler3 = y[15]
    v_rocker4 = y[16]
    v_coupler4 = y[17]
    x0 = cos(q_rocker0)
    x1 = sin(q_rocker0)
    x2 = v_rocker0*(v_rocker0*x0)
    x3 = cos(q_coupler1)
    x4 = p_L*x2 + c0*(v_coupler1*(v_coupler1*x3))
    x5 = v_rocker0*(v_rocker0*x1)
    x6 = sin(q_coupler1)
    x7 = p_L*x5 + c0*(v_coupler1*(v_coupler1*x6))
    x8 = cos(q_rocker1)
    x9 = sin(q_rocker1)
    x10 = v_rocker1*(v_rocker1*x8)
    x11 = cos(q_coupler2)
    x12 = p_L*x10 + c0*(v_coupler2*(v_coupler2*x11))
    x13 = v_rocker1*(v_rocker1*x9)
    x14 = sin(q_coupler2)
    x15 = p_L*x13 + c0*(v_coupler2*(v_coupler2*x14))
    x16 = cos(q_rocker2)
    x17 = sin(q_rocker2)
    x18 = v_rocker2*(v_rocker2*x16)
    x19 = cos(q_coupler3)
    x20 = p_L*x18 + c0*(v_coupler3*(v_coupler3*x19))
    x21 = v_rocker2*(v_rocker2*x17)
    x22 = sin(q_coupler3)
    x23 = p_L*x21 + c0*(v_coupler3*(v_coupler3*x22))
    x24 = cos(q_rocker3)
    x25 = sin(q_rocker3)
    x26 = v_rocker3*(v_rocker3*x24)
    x27 = cos(q_coupler4)
    x28 = p_L*x26 + c0*(v_coupler4*(v_coupler4*x27))
    x29 = v_rocker3*(v_rocker3*x25)
    x30 = sin(q_coupler4)
    x31 = p_L*x29 + c0*(v_coupler4*(v_coupler4*x30))
    x32 = cos(q_rocker4)
    x33 = sin(q_rocker4)
    x34 = c6*(x33*(v_rocker4*(v_rocker4*x32))) - c6*(x32*(v_rocker4*(v_rocker4*x33)))
    out[0] = -(x0*c3 + (x1*(x4*c4 + x2*c6) - x0*(x7*c4 + x5*c6)))
    out[1] = -(x8*c3 + (x9*(x12*c4 + x10*c6) - x8*(x15*c4 + x13*c6)))
    out[2] = -(x3*c2 + (c5*(x6*x4) - c5*(x3*x7)))
    out[3] = -(x16*c3 + (x17*(x20*c4 + x18*c6) - x16*(x23*c4 + x21*c6)))
    out[4] = -(x11*c2 + (c5*(x14*x12) - c5*(x11*x15)))
    out[5] = -(x24*c3 + (x25*(x28*c4 + x26*c6) - x24*(x31*c4 + x29*c6)))
    out[6] = -(x19*c2 + (c5*(x22*x20) - c5*(x19*x23)))
    out[7] = -(x32*c2 + x34)
    out[8] = -(x27*c2 + (c5*(x30*x28) - c5*(x27*x31)))


@njit(error_model="numpy")
def energy(t, y, p, out):
    """Kinetic and potential energy. 179 operations."""
    p_m = p[0]
    p_L = p[1]
    p_g = p[2]
    c0 = 0.5*p_m
    c1 = 0.5*p_L
    c2 = 0.5*(p_L*p_L*(0.08333333333333333*p_m))
    c3 = p_m*(p_g*c1)
    c4 = p_m*p_g
    q_rocker0 = y[0]
    q_rocker1 = y[1]
    q_coupler1 = y[2]
    q_rocker2 = y[3]
    q_coupler2 = y[4]
    q_rocker3 = y[5]
    q_coupler3 = y[6]
    q_rocker4 = y[7]
    q_coupler4 = y[8]
    v_rocker0 = y[9]
    v_rocker1 = y[10]
    v_coupler1 = y[11]
    v_rocker2 = y[12]
    v_coupler2 = y[13]
    v_rocker3 = y[14]
    v_coupler3 = y[15]
    v_rocker4 = y[16]
    v_coupler4 = y[17]
    x0 = sin(q_rocker3)
    x1 = v_rocker3*x0
    x2 = sin(q_coupler4)
    x3 = p_L*x1 + c1*(v_coupler4*x2)
    x4 = v_rocker3*cos(q_rocker3)
    x5 = p_L*x4 + c1*(v_coupler4*cos(q_coupler4))
    x6 = sin(q_rocker4)
    x7 = c1*(v_rocker4*x6)
    x8 = c1*(v_rocker4*cos(q_rocker4))
    x9 = sin(q_rocker2)
    x10 = v_rocker2*x9
    x11 = sin(q_coupler3)
    x12 = p_L*x10 + c1*(v_coupler3*x11)
    x13 = v_rocker2*cos(q_rocker2)
    x14 = p_L*x13 + c1*(v_coupler3*cos(q_coupler3))
    x15 = c1*x1
    x16 = c1*x4
    x17 = sin(q_rocker1)
    x18 = v_rocker1*x17
    x19 = sin(q_coupler2)
    x20 = p_L*x18 + c1*(v_coupler2*x19)
    x21 = v_rocker1*cos(q_rocker1)
    x22 = p_L*x21 + c1*(v_coupler2*cos(q_coupler2))
    x23 = c1*x10
    x24 = c1*x13
    x25 = sin(q_rocker0)
    x26 = v_rocker0*x25
    x27 = sin(q_coupler1)
    x28 = p_L*x26 + c1*(v_coupler1*x27)
    x29 = v_rocker0*cos(q_rocker0)
    x30 = p_L*x29 + c1*(v_coupler1*cos(q_coupler1))
    x31 = c1*x18
    x32 = c1*x21
    x33 = c1*x26
    x34 = c1*x29
    x35 = c0*(x31*x31 + x32*x32) + (c0*(x33*x33 + x34*x34) + c2*(v_rocker0*v_rocker0))
    x36 = c0*(x28*x28 + x30*x30) + (x35 + c2*(v_rocker1*v_rocker1)) + c2*(v_coupler1*v_coupler1)
    x37 = c0*(x20*x20 + x22*x22) + (c0*(x23*x23 + x24*x24) + x36 + c2*(v_rocker2*v_rocker2))
    x38 = c0*(x15*x15 + x16*x16) + (x37 + c2*(v_coupler2*v_coupler2)) + c2*(v_rocker3*v_rocker3)
    x39 = c0*(x7*x7 + x8*x8) + (c0*(x12*x12 + x14*x14) + x38 + c2*(v_coupler3*v_coupler3))
    x40 = c0*(x3*x3 + x5*x5) + (x39 + c2*(v_rocker4*v_rocker4)) + c2*(v_coupler4*v_coupler4)
    x41 = x25*c3 + x17*c3 + (p_L*x25 + c1*x27)*c4 + x9*c3 + (p_L*x17 + c1*x19)*c4
    x42 = x41 + x0*c3 + (p_L*x9 + c1*x11)*c4 + x6*c3 + (p_L*x0 + c1*x2)*c4
    out[0] = x40
    out[1] = x42


@njit(error_model="numpy")
def residual(t, y, p, out):
    """M a - f - G^T lambda, then G a - gamma. 304 operations."""
    p_m = p[0]
    p_L = p[1]
    p_g = p[2]
    c0 = 0.5*p_L
    c1 = p_m*p_g
    c2 = c0*c1
    c3 = c2 + p_L*c1
    c4 = p_L*p_L*(0.08333333333333333*p_m)
    c5 = p_m*p_L
    c6 = p_m*c0
    c7 = c0*c6
    q_rocker0 = y[0]
    q_rocker1 = y[1]
    q_coupler1 = y[2]
    q_rocker2 = y[3]
    q_coupler2 = y[4]
    q_rocker3 = y[5]
    q_coupler3 = y[6]
    q_rocker4 = y[7]
    q_coupler4 = y[8]
    v_rocker0 = y[9]
    v_rocker1 = y[10]
    v_coupler1 = y[11]
    v_rocker2 = y[12]
    v_coupler2 = y[13]
    v_rocker3 = y[14]
    v_coupler3 = y[15]
    v_rocker4 = y[16]
    v_coupler4 = y[17]
    a_rocker0 = y[18]
    a_rocker1 = y[19]
    a_coupler1 = y[20]
    a_rocker2 = y[21]
    a_coupler2 = y[22]
    a_rocker3 = y[23]
    a_coupler3 = y[24]
    a_rocker4 = y[25]
    a_coupler4 = y[26]
    lam_loop1_x = y[27]
    lam_loop1_y = y[28]
    lam_loop2_x = y[29]
    lam_loop2_y = y[30]
    lam_loop3_x = y[31]
    lam_loop3_y = y[32]
    lam_loop4_x = y[33]
    lam_loop4_y = y[34]
    x0 = cos(q_rocker0)
    x1 = sin(q_rocker0)
    x2 = a_rocker0*x0 - v_rocker0*(v_rocker0*x1)
    x3 = p_L*x2
    x4 = cos(q_coupler1)
    x5 = sin(q_coupler1)
    x6 = a_coupler1*x4 - v_coupler1*(v_coupler1*x5)
    x7 = x3 + c0*x6
    x8 = v_rocker0*(v_rocker0*x0) + a_rocker0*x1
    x9 = p_L*x8
    x10 = v_coupler1*(v_coupler1*x4) + a_coupler1*x5
    x11 = x9 + c0*x10
    x12 = x0*c3 + (a_rocker0*c4 + x0*(c5*x7 + c7*x2) + x1*(c5*x11 + c7*x8))
    x13 = lam_loop1_y*p_L
    x14 = lam_loop1_x*p_L
    x15 = cos(q_rocker1)
    x16 = sin(q_rocker1)
    x17 = a_rocker1*x15 - v_rocker1*(v_rocker1*x16)
    x18 = p_L*x17
    x19 = cos(q_coupler2)
    x20 = sin(q_coupler2)
    x21 = a_coupler2*x19 - v_coupler2*(v_coupler2*x20)
    x22 = x18 + c0*x21
    x23 = v_rocker1*(v_rocker1*x15) + a_rocker1*x16
    x24 = p_L*x23
    x25 = v_coupler2*(v_coupler2*x19) + a_coupler2*x20
    x26 = x24 + c0*x25
    x27 = x15*c3 + (a_rocker1*c4 + x15*(c5*x22 + c7*x17) + x16*(c5*x26 + c7*x23))
    x28 = p_L*(x15*(lam_loop2_y - lam_loop1_y)) - p_L*(x16*(lam_loop2_x - lam_loop1_x))
    x29 = x4*c2 + (a_coupler1*c4 + c6*(x4*x7) + c6*(x5*x11)) - (x4*x13 - x5*x14)
    x30 = cos(q_rocker2)
    x31 = sin(q_rocker2)
    x32 = a_rocker2*x30 - v_rocker2*(v_rocker2*x31)
    x33 = p_L*x32
    x34 = cos(q_coupler3)
    x35 = sin(q_coupler3)
    x36 = a_coupler3*x34 - v_coupler3*(v_coupler3*x35)
    x37 = x33 + c0*x36
    x38 = v_rocker2*(v_rocker2*x30) + a_rocker2*x31
    x39 = p_L*x38
    x40 = v_coupler3*(v_coupler3*x34) + a_coupler3*x35
    x41 = x39 + c0*x40
    x42 = x30*c3 + (a_rocker2*c4 + x30*(c5*x37 + c7*x32) + x31*(c5*x41 + c7*x38))
    x43 = p_L*(x30*(lam_loop3_y - lam_loop2_y)) - p_L*(x31*(lam_loop3_x - lam_loop2_x))
    x44 = x19*c2 + (a_coupler2*c4 + c6*(x19*x22) + c6*(x20*x26)) - (p_L*(lam_loop2_y*x19) - p_L*(lam_loop2_x*x20))
    x45 = cos(q_rocker3)
    x46 = sin(q_rocker3)
    x47 = a_rocker3*x45 - v_rocker3*(v_rocker3*x46)
    x48 = p_L*x47
    x49 = cos(q_coupler4)
    x50 = sin(q_coupler4)
    x51 = a_coupler4*x49 - v_coupler4*(v_coupler4*x50)
    x52 = x48 + c0*x51
    x53 = v_rocker3*(v_rocker3*x45) + a_rocker3*x46
    x54 = p_L*x53
    x55 = v_coupler4*(v_coupler4*x49) + a_coupler4*x50
    x56 = x54 + c0*x55
    x57 = x45*c3 + (a_rocker3*c4 + x45*(c5*x52 + c7*x47) + x46*(c5*x56 + c7*x53))
    x58 = p_L*(x45*(lam_loop4_y - lam_loop3_y)) - p_L*(x46*(lam_loop4_x - lam_loop3_x))
    x59 = x34*c2 + (a_coupler3*c4 + c6*(x34*x37) + c6*(x35*x41)) - (p_L*(lam_loop3_y*x34) - p_L*(lam_loop3_x*x35))
    x60 = cos(q_rocker4)
    x61 = sin(q_rocker4)
    x62 = a_rocker4*x60 - v_rocker4*(v_rocker4*x61)
    x63 = v_rocker4*(v_rocker4*x60) + a_rocker4*x61
    x64 = lam_loop4_x*p_L
    x65 = lam_loop4_y*p_L
    x66 = x60*c2 + (a_rocker4*c4 + c7*(x60*x62) + c7*(x61*x63)) - (x61*x64 - x60*x65)
    x67 = x49*c2 + (a_coupler4*c4 + c6*(x49*x52) + c6*(x50*x56)) - (x49*x65 - x50*x64)
    out[0] = x12 - (x0*x13 - x1*x14)
    out[1] = x27 - x28
    out[2] = x29
    out[3] = x42 - x43
    out[4] = x44
    out[5] = x57 - x58
    out[6] = x59
    out[7] = x66
    out[8] = x67
    out[9] = x24 - (x9 + p_L*x10)
    out[10] = x3 + p_L*x6 - x18
    out[11] = x39 - (x24 + p_L*x25)
    out[12] = x18 + p_L*x21 - x33
    out[13] = x54 - (x39 + p_L*x40)
    out[14] = x33 + p_L*x36 - x48
    out[15] = p_L*x63 - (x54 + p_L*x55)
    out[16] = x48 + p_L*x51 - p_L*x62


@njit(error_model="numpy")
def residual_jacobian(t, y, p, out):
    """Residual derivatives by q, v, a, lambda. 525 operations."""
    p_m = p[0]
    p_L = p[1]
    p_g = p[2]
    c0 = 0.5*p_L
    c1 = p_m*c0
    c2 = c0*c1
    c3 = c2 + p_L*(p_m*p_L)
    c4 = p_m*p_g
    c5 = p_L*c1
    c6 = p_L*p_L
    c7 = c6*(0.08333333333333333*p_m)
    c8 = p_m*(c0*c0)
    c9 = c7 + (c8 + p_m*c6)
    c10 = c7 + c8
    q_rocker0 = y[0]
    q_rocker1 = y[1]
    q_coupler1 = y[2]
    q_rocker2 = y[3]
    q_coupler2 = y[4]
    q_rocker3 = y[5]
    q_coupler3 = y[6]
    q_rocker4 = y[7]
    q_coupler4 = y[8]
    v_rocker0 = y[9]
    v_rocker1 = y[10]
    v_coupler1 = y[11]
    v_rocker2 = y[12]
    v_coupler2 = y[13]
    v_rocker3 = y[14]
    v_coupler3 = y[15]
    v_rocker4 = y[16]
    v_coupler4 = y[17]
    a_rocker0 = y[18]
    a_rocker1 = y[19]
    a_coupler1 = y[20]
    a_rocker2 = y[21]
    a_coupler2 = y[22]
    a_rocker3 = y[23]
    a_coupler3 = y[24]
    a_rocker4 = y[25]
    a_coupler4 = y[26]
    lam_loop1_x = y[27]
    lam_loop1_y = y[28]
    lam_loop2_x = y[29]
    lam_loop2_y = y[30]
    lam_loop3_x = y[31]
    lam_loop3_y = y[32]
    lam_loop4_x = y[33]
    lam_loop4_y = y[34]
    x0 = cos(q_rocker0)
    x1 = sin(q_rocker0)
    x2 = v_rocker0*x1
    x3 = a_rocker0*x0 - v_rocker0*x2
    x4 = x1*c3
    x5 = v_rocker0*x0
    x6 = v_rocker0*x5 + a_rocker0*x1
    x7 = p_L*x6
    x8 = cos(q_coupler1)
    x9 = v_coupler1*x8
    x10 = sin(q_coupler1)
    x11 = v_coupler1*x9 + a_coupler1*x10
    x12 = x7 + c0*x11
    x13 = p_L*x3
    x14 = v_coupler1*x10
    x15 = a_coupler1*x8 - v_coupler1*x14
    x16 = c4 + p_m*(x13 + c0*x15)
    x17 = x0*(c2*x6 + p_L*(lam_loop1_x + p_m*x12)) - x1*(p_L*(x16 - lam_loop1_y) + c0*(c4 + c1*x3))
    x18 = x0*c3
    x19 = x1*c5
    x20 = x0*c5
    x21 = x5 + x5
    x22 = x2 + x2
    x23 = x9 + x9
    x24 = x14 + x14
    x25 = c5*(x0*x8) + c5*(x1*x10)
    x26 = p_L*x1
    x27 = p_L*x0
    x28 = cos(q_rocker1)
    x29 = sin(q_rocker1)
    x30 = v_rocker1*x29
    x31 = a_rocker1*x28 - v_rocker1*x30
    x32 = x29*c3
    x33 = v_rocker1*x28
    x34 = v_rocker1*x33 + a_rocker1*x29
    x35 = p_L*x34
    x36 = cos(q_coupler2)
    x37 = v_coupler2*x36
    x38 = sin(q_coupler2)
    x39 = v_coupler2*x37 + a_coupler2*x38
    x40 = x35 + c0*x39
    x41 = p_L*x31
    x42 = v_coupler2*x38
    x43 = a_coupler2*x36 - v_coupler2*x42
    x44 = c4 + p_m*(x41 + c0*x43)
    x45 = x29*(p_L*(x44 - (lam_loop2_y - lam_loop1_y)) + c0*(c4 + c1*x31))
    x46 = x28*(c2*x34 + p_L*(p_m*x40 + (lam_loop2_x - lam_loop1_x))) - x45
    x47 = x28*c3
    x48 = x29*c5
    x49 = x28*c5
    x50 = x33 + x33
    x51 = x30 + x30
    x52 = x37 + x37
    x53 = x42 + x42
    x54 = c5*(x28*x36) + c5*(x29*x38)
    x55 = p_L*x29
    x56 = -x55
    x57 = p_L*x28
    x58 = -x57
    x59 = x10*c5
    x60 = x8*c5
    x61 = x10*c2
    x62 = x8*(lam_loop1_x*p_L + c1*x12) - x10*(c0*x16 - lam_loop1_y*p_L)
    x63 = x8*c2
    x64 = p_L*x10
    x65 = p_L*x8
    x66 = cos(q_rocker2)
    x67 = sin(q_rocker2)
    x68 = v_rocker2*x67
    x69 = a_rocker2*x66 - v_rocker2*x68
    x70 = x67*c3
    x71 = v_rocker2*x66
    x72 = v_rocker2*x71 + a_rocker2*x67
    x73 = p_L*x72
    x74 = cos(q_coupler3)
    x75 = v_coupler3*x74
    x76 = sin(q_coupler3)
    x77 = v_coupler3*x75 + a_coupler3*x76
    x78 = x73 + c0*x77
    x79 = p_L*x69
    x80 = v_coupler3*x76
    x81 = a_coupler3*x74 - v_coupler3*x80
    x82 = c4 + p_m*(x79 + c0*x81)
    x83 = x67*(p_L*(x82 - (lam_loop3_y - lam_loop2_y)) + c0*(c4 + c1*x69))
    x84 = x66*(c2*x72 + p_L*(p_m*x78 + (lam_loop3_x - lam_loop2_x))) - x83
    x85 = x66*c3
    x86 = x67*c5
    x87 = x66*c5
    x88 = x71 + x71
    x89 = x68 + x68
    x90 = x75 + x75
    x91 = x80 + x80
    x92 = c5*(x66*x74) + c5*(x67*x76)
    x93 = p_L*x67
    x94 = -x93
    x95 = p_L*x66
    x96 = -x95
    x97 = x38*c5
    x98 = x36*c5
    x99 = x38*c2
    x100 = x36*(lam_loop2_x*p_L + c1*x40) - x38*(c0*x44 - lam_loop2_y*p_L)
    x101 = x36*c2
    x102 = p_L*x38
    x103 = p_L*x36
    x104 = cos(q_rocker3)
    x105 = sin(q_rocker3)
    x106 = v_rocker3*x105
    x107 = a_rocker3*x104 - v_rocker3*x106
    x108 = x105*c3
    x109 = v_rocker3*x104
    x110 = v_rocker3*x109 + a_rocker3*x105
    x111 = p_L*x110
    x112 = cos(q_coupler4)
    x113 = v_coupler4*x112
    x114 = sin(q_coupler4)
    x115 = v_coupler4*x113 + a_coupler4*x114
    x116 = x111 + c0*x115
    x117 = x104*(c2*x110 + p_L*(p_m*x116 + (lam_loop4_x - lam_loop3_x)))
    x118 = p_L*x107
    x119 = v_coupler4*x114
    x120 = a_coupler4*x112 - v_coupler4*x119
    x121 = c4 + p_m*(x118 + c0*x120)
    x122 = x105*(p_L*(x121 - (lam_loop4_y - lam_loop3_y)) + c0*(c4 + c1*x107))
    x123 = x104*c3
    x124 = x105*c5
    x125 = x104*c5
    x126 = x109 + x109
    x127 = x106 + x106
    x128 = x113 + x113
    x129 = x119 + x119
    x130 = c5*(x104*x112) + c5*(x105*x114)
    x131 = p_L*x105
    x132 = -x131
    x133 = p_L*x104
    x134 = -x133
    x135 = x76*c5
    x136 = x74*c5
    x137 = x76*c2
    x138 = x74*(lam_loop3_x*p_L + c1*x78) - x76*(c0*x82 - lam_loop3_y*p_L)
    x139 = x74*c2
    x140 = p_L*x76
    x141 = p_L*x74
    x142 = cos(q_rocker4)
    x143 = sin(q_rocker4)
    x144 = v_rocker4*x143
    x145 = a_rocker4*x142 - v_rocker4*x144
    x146 = x143*c2
    x147 = v_rocker4*x142
    x148 = v_rocker4*x147 + a_rocker4*x143
    x149 = lam_loop4_x*p_L
    x150 = lam_loop4_y*p_L
    x151 = x142*c2
    x152 = x142*(c2*x148 - x149) - x143*(x150 + c0*(c4 + c1*x145)) - x148*x151
    x153 = x147 + x147
    x154 = x144 + x144
    x155 = p_L*x143
    x156 = p_L*x142
    x157 = x114*c5
    x158 = x112*c5
    x159 = x114*c2
    x160 = x112*c2
    x161 = x120*x159 + (x112*(x149 + c1*x116) - x114*(c0*x121 - x150) - x115*x160)
    x162 = p_L*x114
    x163 = p_L*x112
    x164 = p_L*x50
    x165 = p_L*x51
    x166 = p_L*x88
    x167 = p_L*x89
    x168 = p_L*x126
    x169 = p_L*x127
    out[0] = x3*x4 + (x17 - x6*x18)
    out[2] = x15*x19 - x11*x20
    out[9] = x21*x4 - x22*x18
    out[11] = x23*x19 - x24*x20
    out[18] = c9
    out[20] = x25
    out[27] = x26
    out[28] = -x27
    out[36] = x31*x32 + (x46 - x34*x47)
    out[39] = x43*x48 - x39*x49
    out[45] = x50*x32 - x51*x47
    out[48] = x52*x48 - x53*x49
    out[54] = c9
    out[57] = x54
    out[62] = x56
    out[63] = x57
    out[64] = x55
    out[65] = x58
    out[70] = x59*x3 - x60*x6
    out[72] = x15*x61 + (x62 - x11*x63)
    out[79] = x59*x21 - x60*x22
    out[81] = x23*x61 - x24*x63
    out[88] = x25
    out[90] = c10
    out[97] = x64
    out[98] = -x65
    out[108] = x69*x70 + (x84 - x72*x85)
    out[111] = x81*x86 - x77*x87
    out[117] = x88*x70 - x89*x85
    out[120] = x90*x86 - x91*x87
    out[126] = c9
    out[129] = x92
    out[134] = x94
    out[135] = x95
    out[136] = x93
    out[137] = x96
    out[141] = x97*x31 - x98*x34
    out[144] = x43*x99 + (x100 - x39*x101)
    out[150] = x97*x50 - x98*x51
    out[153] = x52*x99 - x53*x101
    out[159] = x54
    out[162] = c10
    out[169] = x102
    out[170] = -x103
    out[180] = x107*x108 + (x117 - x122 - x110*x123)
    out[183] = x120*x124 - x115*x125
    out[189] = x126*x108 - x127*x123
    out[192] = x128*x124 - x129*x125
    out[198] = c9
    out[201] = x130
    out[206] = x132
    out[207] = x133
    out[208] = x131
    out[209] = x134
    out[213] = x135*x69 - x136*x72
    out[216] = x81*x137 + (x138 - x77*x139)
    out[222] = x135*x88 - x136*x89
    out[225] = x90*x137 - x91*x139
    out[231] = x92
    out[234] = c10
    out[241] = x140
    out[242] = -x141
    out[252] = x145*x146 + x152
    out[261] = x153*x146 - x154*x151
    out[270] = c10
    out[278] = -x155
    out[279] = x156
    out[285] = x157*x107 - x158*x110
    out[288] = x161
    out[294] = x157*x126 - x158*x127
    out[297] = x128*x159 - x129*x160
    out[303] = x130
    out[306] = c10
    out[313] = x162
    out[314] = -x163
    out[315] = -x13
    out[316] = x41
    out[317] = -(p_L*x15)
    out[324] = -(p_L*x21)
    out[325] = x164
    out[326] = -(p_L*x23)
    out[333] = -x26
    out[334] = x55
    out[335] = -x64
    out[350] = -x7
    out[351] = x35
    out[352] = -(p_L*x11)
    out[359] = -(p_L*x22)
    out[360] = x165
    out[361] = -(p_L*x24)
    out[368] = x27
    out[369] = x58
    out[370] = x65
    out[386] = -x41
    out[388] = x79
    out[389] = -(p_L*x43)
    out[395] = -x164
    out[397] = x166
    out[398] = -(p_L*x52)
    out[404] = x56
    out[406] = x93
    out[407] = -x102
    out[421] = -x35
    out[423] = x73
    out[424] = -(p_L*x39)
    out[430] = -x165
    out[432] = x167
    out[433] = -(p_L*x53)
    out[439] = x57
    out[441] = x96
    out[442] = x103
    out[458] = -x79
    out[460] = x118
    out[461] = -(p_L*x81)
    out[467] = -x166
    out[469] = x168
    out[470] = -(p_L*x90)
    out[476] = x94
    out[478] = x131
    out[479] = -x140
    out[493] = -x73
    out[495] = x111
    out[496] = -(p_L*x77)
    out[502] = -x167
    out[504] = x169
    out[505] = -(p_L*x91)
    out[511] = x95
    out[513] = x134
    out[514] = x141
    out[530] = -x118
    out[532] = p_L*x145
    out[533] = -(p_L*x120)
    out[539] = -x168
    out[541] = p_L*x153
    out[542] = -(p_L*x128)
    out[548] = x132
    out[550] = x155
    out[551] = -x162
    out[565] = -x111
    out[567] = p_L*x148
    out[568] = -(p_L*x115)
    out[574] = -x169
    out[576] = p_L*x154
    out[577] = -(p_L*x129)
    out[583] = x133
    out[585] = -x156
    out[586] = x163


@njit(error_model="numpy")
def constraint_residual(t, y, p, out):
    """Position residuals, velocity residuals. 108 operations."""
    p_L = p[1]
    q_rocker0 = y[0]
    q_rocker1 = y[1]
    q_coupler1 = y[2]
    q_rocker2 = y[3]
    q_coupler2 = y[4]
    q_rocker3 = y[5]
    q_coupler3 = y[6]
    q_rocker4 = y[7]
    q_coupler4 = y[8]
    v_rocker0 = y[9]
    v_rocker1 = y[10]
    v_coupler1 = y[11]
    v_rocker2 = y[12]
    v_coupler2 = y[13]
    v_rocker3 = y[14]
    v_coupler3 = y[15]
    v_rocker4 = y[16]
    v_coupler4 = y[17]
    x0 = cos(q_coupler1)
    x1 = cos(q_rocker0)
    x2 = cos(q_rocker1)
    x3 = p_L*x2
    x4 = sin(q_rocker0)
    x5 = sin(q_coupler1)
    x6 = sin(q_rocker1)
    x7 = p_L*x6
    x8 = cos(q_coupler2)
    x9 = cos(q_rocker2)
    x10 = p_L*x9
    x11 = sin(q_coupler2)
    x12 = sin(q_rocker2)
    x13 = p_L*x12
    x14 = cos(q_coupler3)
    x15 = cos(q_rocker3)
    x16 = p_L*x15
    x17 = sin(q_coupler3)
    x18 = sin(q_rocker3)
    x19 = p_L*x18
    x20 = cos(q_coupler4)
    x21 = cos(q_rocker4)
    x22 = sin(q_coupler4)
    x23 = sin(q_rocker4)
    x24 = p_L*(v_rocker1*x6)
    x25 = p_L*(v_rocker1*x2)
    x26 = p_L*(v_rocker2*x12)
    x27 = p_L*(v_rocker2*x9)
    x28 = p_L*(v_rocker3*x18)
    x29 = p_L*(v_rocker3*x15)
    out[0] = p_L*x0 + (p_L*x1 - p_L) - x3
    out[1] = p_L*x4 + p_L*x5 - x7
    out[2] = p_L*x8 + (x3 - p_L) - x10
    out[3] = x7 + p_L*x11 - x13
    out[4] = p_L*x14 + (x10 - p_L) - x16
    out[5] = x13 + p_L*x17 - x19
    out[6] = p_L*x20 + (x16 - p_L) - p_L*x21
    out[7] = x19 + p_L*x22 - p_L*x23
    out[8] = x24 - (p_L*(v_rocker0*x4) + p_L*(v_coupler1*x5))
    out[9] = p_L*(v_rocker0*x1) + p_L*(v_coupler1*x0) - x25
    out[10] = x26 - (x24 + p_L*(v_coupler2*x11))
    out[11] = x25 + p_L*(v_coupler2*x8) - x27
    out[12] = x28 - (x26 + p_L*(v_coupler3*x17))
    out[13] = x27 + p_L*(v_coupler3*x14) - x29
    out[14] = p_L*(v_rocker4*x23) - (x28 + p_L*(v_coupler4*x22))
    out[15] = x29 + p_L*(v_coupler4*x20) - p_L*(v_rocker4*x21)


@njit(error_model="numpy")
def constraint_jacobian(t, y, p, out):
    """Constraint Jacobian G, row by row. 48 operations."""
    p_L = p[1]
    q_rocker0 = y[0]
    q_rocker1 = y[1]
    q_coupler1 = y[2]
    q_rocker2 = y[3]
    q_coupler2 = y[4]
    q_rocker3 = y[5]
    q_coupler3 = y[6]
    q_rocker4 = y[7]
    q_coupler4 = y[8]
    x0 = p_L*sin(q_rocker1)
    x1 = p_L*cos(q_rocker1)
    x2 = p_L*sin(q_rocker2)
    x3 = p_L*cos(q_rocker2)
    x4 = p_L*sin(q_rocker3)
    x5 = p_L*cos(q_rocker3)
    out[0] = -(p_L*sin(q_rocker0))
    out[1] = x0
    out[2] = -(p_L*sin(q_coupler1))
    out[9] = p_L*cos(q_rocker0)
    out[10] = -x1
    out[11] = p_L*cos(q_coupler1)
    out[19] = -x0
    out[21] = x2
    out[22] = -(p_L*sin(q_coupler2))
    out[28] = x1
    out[30] = -x3
    out[31] = p_L*cos(q_coupler2)
    out[39] = -x2
    out[41] = x4
    out[42] = -(p_L*sin(q_coupler3))
    out[48] = x3
    out[50] = -x5
    out[51] = p_L*cos(q_coupler3)
    out[59] = -x4
    out[61] = p_L*sin(q_rocker4)
    out[62] = -(p_L*sin(q_coupler4))
    out[68] = x5
    out[70] = -(p_L*cos(q_rocker4))
    out[71] = p_L*cos(q_coupler4)


@njit(error_model="numpy")
def gamma(t, y, p, out):
    """Right-hand side of G a = gamma. 96 operations."""
    p_L = p[1]
    q_rocker0 = y[0]
    q_rocker1 = y[1]
    q_coupler1 = y[2]
    q_rocker2 = y[3]
    q_coupler2 = y[4]
    q_rocker3 = y[5]
    q_coupler3 = y[6]
    q_rocker4 = y[7]
    q_coupler4 = y[8]
    v_rocker0 = y[9]
    v_rocker1 = y[10]
    v_coupler1 = y[11]
    v_rocker2 = y[12]
    v_coupler2 = y[13]
    v_rocker3 = y[14]
    v_coupler3 = y[15]
    v_rocker4 = y[16]
    v_coupler4 = y[17]
    x0 = p_L*(v_rocker1*(v_rocker1*cos(q_rocker1)))
    x1 = p_L*(v_rocker0*(v_rocker0*cos(q_rocker0))) + p_L*(v_coupler1*(v_coupler1*cos(q_coupler1)))
    x2 = p_L*(v_rocker1*(v_rocker1*sin(q_rocker1)))
    x3 = p_L*(v_rocker0*(v_rocker0*sin(q_rocker0))) + p_L*(v_coupler1*(v_coupler1*sin(q_coupler1)))
    x4 = p_L*(v_rocker2*(v_rocker2*cos(q_rocker2)))
    x5 = p_L*(v_rocker2*(v_rocker2*sin(q_rocker2)))
    x6 = p_L*(v_rocker3*(v_rocker3*cos(q_rocker3)))
    x7 = p_L*(v_rocker3*(v_rocker3*sin(q_rocker3)))
    x8 = p_L*(v_rocker4*(v_rocker4*cos(q_rocker4))) - (x6 + p_L*(v_coupler4*(v_coupler4*cos(q_coupler4))))
    x9 = p_L*(v_rocker4*(v_rocker4*sin(q_rocker4))) - (x7 + p_L*(v_coupler4*(v_coupler4*sin(q_coupler4))))
    out[0] = -(x0 - x1)
    out[1] = -(x2 - x3)
    out[2] = -(x4 - (x0 + p_L*(v_coupler2*(v_coupler2*cos(q_coupler2)))))
    out[3] = -(x5 - (x2 + p_L*(v_coupler2*(v_coupler2*sin(q_coupler2)))))
    out[4] = -(x6 - (x4 + p_L*(v_coupler3*(v_coupler3*cos(q_coupler3)))))
    out[5] = -(x7 - (x5 + p_L*(v_coupler3*(v_coupler3*sin(q_coupler3)))))
    out[6] = -x8
    out[7] = -x9


@njit(error_model="numpy")
def project(t, y, p, out):
    """State moved onto the constraints, and the residuals it had. 626 operations."""
    p_m = p[0]
    p_L = p[1]
    c0 = p_L*p_L
    c1 = c0*(0.08333333333333333*p_m)
    c2 = 0.5*p_L
    c3 = p_m*(c2*c2)
    c4 = c1 + (c3 + p_m*c0)
    c5 = 1.0/c4
    c6 = p_L*c5
    c7 = p_L*(p_m*c2)
    c8 = c1 + c3
    c9 = 1.0/c8
    c10 = p_L*c9
    q_rocker0 = y[0]
    q_rocker1 = y[1]
    q_coupler1 = y[2]
    q_rocker2 = y[3]
    q_coupler2 = y[4]
    q_rocker3 = y[5]
    q_coupler3 = y[6]
    q_rocker4 = y[7]
    q_coupler4 = y[8]
    v_rocker0 = y[9]
    v_rocker1 = y[10]
    v_coupler1 = y[11]
    v_rocker2 = y[12]
    v_coupler2 = y[13]
    v_rocker3 = y[14]
    v_coupler3 = y[15]
    v_rocker4 = y[16]
    v_coupler4 = y[17]
    x0 = sin(q_rocker0)
    x1 = x0*c6
    x2 = cos(q_coupler1)
    x3 = p_L*x2
    x4 = cos(q_rocker0)
    x5 = p_L*x4
    x6 = cos(q_rocker1)
    x7 = p_L*x6
    x8 = x3 + (x5 - p_L) - x7
    x9 = sin(q_rocker1)
    x10 = p_L*x9
    x11 = cos(q_coupler2)
    x12 = sin(q_coupler2)
    x13 = c7*(x6*x11) + c7*(x9*x12)
    x14 = x13*c9
    x15 = 1.0/(c4 - x13*x14)
    x16 = x10*x15
    x17 = p_L*x0
    x18 = sin(q_coupler1)
    x19 = c7*(x4*x2) + c7*(x0*x18)
    x20 = x19*c5
    x21 = p_L*x18
    x22 = x17*x20 - x21
    x23 = 1.0/(c8 - x19*x20)
    x24 = x22*x23
    x25 = 1.0/(x10*x16 + (x22*x24 + x17*x1))
    x26 = x3 - x5*x20
    x27 = x7*x16 + (x5*x1 - x26*x24)
    x28 = x27*x25
    x29 = x7*x15
    x30 = x26*x23
    x31 = x4*c6
    x32 = 1.0/(x27*x28 - (x7*x29 + (x26*x30 + x5*x31)))
    x33 = x17 + x21 - x10
    x34 = x33 + x8*x28
    x35 = p_L*x12
    x36 = x35*x14 - x10
    x37 = x36*x16
    x38 = x36*x29 - x37*x28
    x39 = x38*x32
    x40 = x37*x25
    x41 = x36*x15
    x42 = x12*c10
    x43 = sin(q_rocker2)
    x44 = p_L*x43
    x45 = cos(q_rocker2)
    x46 = cos(q_coupler3)
    x47 = sin(q_coupler3)
    x48 = c7*(x45*x46) + c7*(x43*x47)
    x49 = x48*c9
    x50 = 1.0/(c4 - x48*x49)
    x51 = x44*x50
    x52 = 1.0/(x37*x40 - (x36*x41 + x35*x42) - x38*x39 - x44*x51)
    x53 = p_L*x11
    x54 = p_L*x45
    x55 = x53 + (x7 - p_L) - x54
    x56 = x8*x40 - x55 + x39*x34
    x57 = x7 - x53*x14
    x58 = x57*x16
    x59 = x57*x29 - x58*x28
    x60 = x54*x51 + (x53*x42 - x57*x41 + x58*x40 - x59*x39)
    x61 = x60*x52
    x62 = x58*x25
    x63 = x57*x15
    x64 = x11*c10
    x65 = x59*x32
    x66 = x54*x50
    x67 = 1.0/(x58*x62 - (x57*x63 + x53*x64) - x59*x65 - x54*x66 - x60*x61)
    x68 = x10 + x35 - x44
    x69 = x8*x62 - x68 + x65*x34 - x61*x56
    x70 = p_L*x47
    x71 = x70*x49 - x44
    x72 = x71*x51
    x73 = x71*x66 + x72*x61
    x74 = x73*x67
    x75 = cos(q_rocker3)
    x76 = p_L*x75
    x77 = sin(q_rocker3)
    x78 = p_L*x77
    x79 = cos(q_coupler4)
    x80 = sin(q_coupler4)
    x81 = c7*(x75*x79) + c7*(x77*x80)
    x82 = x81*c9
    x83 = 1.0/(c4 - x81*x82)
    x84 = x78*x83
    x85 = p_L*x46
    x86 = x47*c10
    x87 = x54 - x85*x49
    x88 = x71*x50
    x89 = x87*x51
    x90 = x72*x52
    x91 = x87*x66 + x89*x61
    x92 = x76*x84 + (x85*x86 - x87*x88 - x89*x90 - x91*x74)
    x93 = 1.0/(x78*x84 + (x71*x88 + x70*x86 + x72*x90 + x73*x74))
    x94 = x92*x93
    x95 = x76*x83
    x96 = x87*x50
    x97 = x46*c10
    x98 = x89*x52
    x99 = x91*x67
    x100 = x92*x94 - (x76*x95 + (x87*x96 + x85*x97 + x89*x98 + x91*x99))
    x101 = 1.0/x100
    x102 = x44 + x70 - x78
    x103 = x85 + (x54 - p_L) - x76
    x104 = x90*x56 - x103 - x74*x69
    x105 = x98*x56 - x102 - x99*x69 + x94*x104
    x106 = p_L*x80
    x107 = x106*x82 - x78
    x108 = x107*x84
    x109 = x107*x95 - x108*x94
    x110 = x109*x101
    x111 = x108*x93
    x112 = x107*x83
    x113 = sin(q_rocker4)
    x114 = p_L*x113
    x115 = x113*c10
    x116 = x80*c10
    x117 = x108*x111 - (x107*x112 + (x114*x115 + x106*x116)) - x109*x110
    x118 = 1.0/x117
    x119 = p_L*x79
    x120 = cos(q_rocker4)
    x121 = p_L*x120
    x122 = x119 + (x76 - p_L) - x121
    x123 = x122 + x111*x104 + x110*x105
    x124 = x76 - x119*x82
    x125 = x124*x84
    x126 = x124*x95 - x125*x94
    x127 = x121*x115 + x119*x116 - x124*x112 + x125*x111 - x126*x110
    x128 = x127*x118
    x129 = x125*x93
    x130 = x124*x83
    x131 = x120*c10
    x132 = x79*c10
    x133 = x126*x101
    x134 = x125*x129 - (x124*x130 + (x121*x131 + x119*x132)) - x126*x133
    x135 = 1.0/(x134 - x127*x128)
    x136 = x78 + x106 - x114
    x137 = x135*(x128*x123 - (x136 + x129*x104 + x133*x105))
    x138 = x118*x123 + x128*x137
    x139 = x101*x105 + x110*x138 - x133*x137
    x140 = x94*x139 - x93*x104 + x111*x138 - x129*x137
    x141 = x67*x69 - x74*x140 - x99*x139
    x142 = x52*x56 - x61*x141 + x90*x140 + x98*x139
    x143 = x32*x34 + x39*x142 + x65*x141
    x144 = x8*x25 - x28*x143 - x40*x142 - x62*x141
    x145 = x30*x143 - x24*x144
    x146 = q_rocker0 + (x1*x144 - x20*x145 + x31*x143)
    x147 = x16*x144 + x29*x143 + x41*x142 + x63*x141
    x148 = q_rocker1 - x147
    x149 = q_coupler1 + x145
    x150 = x66*x141 - x51*x142 - x88*x140 - x96*x139
    x151 = q_rocker2 + x150
    x152 = q_coupler2 + (x14*x147 + x42*x142 - x64*x141)
    x153 = x95*x139 - x84*x140 + x112*x138 - x130*x137
    x154 = q_rocker3 + x153
    x155 = q_coupler3 + (x86*x140 - x49*x150 - x97*x139)
    x156 = q_rocker4 + (x115*x138 + x131*x137)
    x157 = q_coupler4 - (x82*x153 + x116*x138 + x132*x137)
    x158 = p_L*(v_rocker1*sin(x148))
    x159 = x158 - (p_L*(v_rocker0*sin(x146)) + p_L*(v_coupler1*sin(x149)))
    x160 = p_L*(v_rocker1*cos(x148))
    x161 = p_L*(v_rocker0*cos(x146)) + p_L*(v_coupler1*cos(x149)) - x160
    x162 = x161 + x28*x159
    x163 = p_L*(v_rocker2*sin(x151))
    x164 = x163 - (x158 + p_L*(v_coupler2*sin(x152)))
    x165 = x40*x159 - x164 + x39*x162
    x166 = p_L*(v_rocker2*cos(x151))
    x167 = x160 + p_L*(v_coupler2*cos(x152)) - x166
    x168 = x62*x159 - x167 + x65*x162 - x61*x165
    x169 = p_L*(v_rocker3*cos(x154))
    x170 = x166 + p_L*(v_coupler3*cos(x155)) - x169
    x171 = p_L*(v_rocker3*sin(x154))
    x172 = x171 - (x163 + p_L*(v_coupler3*sin(x155)))
    x173 = x90*x165 - x172 - x74*x168
    x174 = x98*x165 - x170 - x99*x168 + x94*x173
    x175 = p_L*(v_rocker4*sin(x156)) - (x171 + p_L*(v_coupler4*sin(x157)))
    x176 = x175 + x111*x173 + x110*x174
    x177 = x169 + p_L*(v_coupler4*cos(x157)) - p_L*(v_rocker4*cos(x156))
    x178 = x135*(x128*x176 - (x177 + x129*x173 + x133*x174))
    x179 = x118*x176 + x128*x178
    x180 = x101*x174 + x110*x179 - x133*x178
    x181 = x94*x180 - x93*x173 + x111*x179 - x129*x178
    x182 = x67*x168 - x74*x181 - x99*x180
    x183 = x52*x165 - x61*x182 + x90*x181 + x98*x180
    x184 = x32*x162 + x39*x183 + x65*x182
    x185 = x25*x159 - x28*x184 - x40*x183 - x62*x182
    x186 = x30*x184 - x24*x185
    x187 = x16*x185 + x29*x184 + x41*x183 + x63*x182
    x188 = x66*x182 - x51*x183 - x88*x181 - x96*x180
    x189 = x95*x180 - x84*x181 + x112*x179 - x130*x178
    out[0] = x146
    out[1] = x148
    out[2] = x149
    out[3] = x151
    out[4] = x152
    out[5] = x154
    out[6] = x155
    out[7] = x156
    out[8] = x157
    out[9] = v_rocker0 + (x1*x185 - x20*x186 + x31*x184)
    out[10] = v_rocker1 - x187
    out[11] = v_coupler1 + x186
    out[12] = v_rocker2 + x188
    out[13] = v_coupler2 + (x14*x187 + x42*x183 - x64*x182)
    out[14] = v_rocker3 + x189
    out[15] = v_coupler3 + (x86*x181 - x49*x188 - x97*x180)
    out[16] = v_rocker4 + (x115*x179 + x131*x178)
    out[17] = v_coupler4 - (x82*x189 + x116*x179 + x132*x178)
    out[18] = x8
    out[19] = x33
    out[20] = x55
    out[21] = x68
    out[22] = x103
    out[23] = x102
    out[24] = x122
    out[25] = x136
    out[26] = x159
    out[27] = x161
    out[28] = x164
    out[29] = x167
    out[30] = x172
    out[31] = x170
    out[32] = x175
    out[33] = x177


@njit(error_model="numpy")
def poses(t, y, p, out):
    """Per body: position, rotation matrix (body to world). 72 operations."""
    p_L = p[1]
    c0 = 0.5*p_L
    c1 = 2.0*p_L
    c2 = 3.0*p_L
    c3 = 4.0*p_L
    q_rocker0 = y[0]
    q_rocker1 = y[1]
    q_coupler1 = y[2]
    q_rocker2 = y[3]
    q_coupler2 = y[4]
    q_rocker3 = y[5]
    q_coupler3 = y[6]
    q_rocker4 = y[7]
    q_coupler4 = y[8]
    x0 = cos(q_rocker0)
    x1 = sin(q_rocker0)
    x2 = cos(q_rocker1)
    x3 = sin(q_rocker1)
    x4 = cos(q_coupler1)
    x5 = sin(q_coupler1)
    x6 = cos(q_rocker2)
    x7 = sin(q_rocker2)
    x8 = cos(q_coupler2)
    x9 = sin(q_coupler2)
    x10 = cos(q_rocker3)
    x11 = sin(q_rocker3)
    x12 = cos(q_coupler3)
    x13 = sin(q_coupler3)
    x14 = cos(q_rocker4)
    x15 = sin(q_rocker4)
    x16 = cos(q_coupler4)
    x17 = sin(q_coupler4)
    out[0] = x0*c0
    out[1] = c0*x1
    out[2] = 0.0
    out[3] = x0
    out[4] = -x1
    out[5] = 0.0
    out[6] = x1
    out[7] = x0
    out[8] = 0.0
    out[9] = 0.0
    out[10] = 0.0
    out[11] = 1.0
    out[12] = p_L + c0*x2
    out[13] = c0*x3
    out[14] = 0.0
    out[15] = x2
    out[16] = -x3
    out[17] = 0.0
    out[18] = x3
    out[19] = x2
    out[20] = 0.0
    out[21] = 0.0
    out[22] = 0.0
    out[23] = 1.0
    out[24] = p_L*x0 + c0*x4
    out[25] = p_L*x1 + c0*x5
    out[26] = 0.0
    out[27] = x4
    out[28] = -x5
    out[29] = 0.0
    out[30] = x5
    out[31] = x4
    out[32] = 0.0
    out[33] = 0.0
    out[34] = 0.0
    out[35] = 1.0
    out[36] = c1 + c0*x6
    out[37] = c0*x7
    out[38] = 0.0
    out[39] = x6
    out[40] = -x7
    out[41] = 0.0
    out[42] = x7
    out[43] = x6
    out[44] = 0.0
    out[45] = 0.0
    out[46] = 0.0
    out[47] = 1.0
    out[48] = c0*x8 + (p_L + p_L*x2)
    out[49] = p_L*x3 + c0*x9
    out[50] = 0.0
    out[51] = x8
    out[52] = -x9
    out[53] = 0.0
    out[54] = x9
    out[55] = x8
    out[56] = 0.0
    out[57] = 0.0
    out[58] = 0.0
    out[59] = 1.0
    out[60] = c2 + c0*x10
    out[61] = c0*x11
    out[62] = 0.0
    out[63] = x10
    out[64] = -x11
    out[65] = 0.0
    out[66] = x11
    out[67] = x10
    out[68] = 0.0
    out[69] = 0.0
    out[70] = 0.0
    out[71] = 1.0
    out[72] = c0*x12 + (c1 + p_L*x6)
    out[73] = p_L*x7 + c0*x13
    out[74] = 0.0
    out[75] = x12
    out[76] = -x13
    out[77] = 0.0
    out[78] = x13
    out[79] = x12
    out[80] = 0.0
    out[81] = 0.0
    out[82] = 0.0
    out[83] = 1.0
    out[84] = c3 + c0*x14
    out[85] = c0*x15
    out[86] = 0.0
    out[87] = x14
    out[88] = -x15
    out[89] = 0.0
    out[90] = x15
    out[91] = x14
    out[92] = 0.0
    out[93] = 0.0
    out[94] = 0.0
    out[95] = 1.0
    out[96] = c0*x16 + (c2 + p_L*x10)
    out[97] = p_L*x11 + c0*x17
    out[98] = 0.0
    out[99] = x16
    out[100] = -x17
    out[101] = 0.0
    out[102] = x17
    out[103] = x16
    out[104] = 0.0
    out[105] = 0.0
    out[106] = 0.0
    out[107] = 1.0


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
    out[12] = 0.02
    out[13] = p_L
    out[14] = 0.02
    out[15] = p_L
    out[16] = 0.02
    out[17] = p_L


@njit(error_model="numpy")
def marks(t, y, p, out):
    """What a picture shows besides bodies, as `marks` lists it. 5 operations."""
    p_L = p[1]
    c0 = 0.5*p_L
    c1 = -c0
    c2 = 2.0*p_L
    c3 = 3.0*p_L
    c4 = 4.0*p_L
    out[0] = c1
    out[5] = 1.0
    out[9] = c0
    out[14] = 1.0
    out[15] = c1
    out[20] = 1.0
    out[21] = p_L
    out[24] = c0
    out[29] = 1.0
    out[30] = c0
    out[35] = 1.0
    out[36] = c0
    out[39] = c1
    out[44] = 1.0
    out[45] = c2
    out[48] = c0
    out[53] = 1.0
    out[54] = c0
    out[59] = 1.0
    out[60] = c0
    out[63] = c1
    out[68] = 1.0
    out[69] = c3
    out[72] = c0
    out[77] = 1.0
    out[78] = c0
    out[83] = 1.0
    out[84] = c0
    out[87] = c1
    out[92] = 1.0
    out[93] = c4
    out[96] = c0
    out[101] = 1.0
    out[102] = c0


@njit(error_model="numpy")
def limits(t, y, p, out):
    """Numbers of parameters that have a bound. 3 operations."""
    p_m = p[0]
    p_L = p[1]
    c0 = p_L*p_L*(0.08333333333333333*p_m)
    out[0] = p_L
    out[1] = p_m
    out[2] = c0
