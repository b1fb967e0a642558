"""andrews_squeezer: equations of motion, written by symgen 0.1.0. Do not edit.

Andrews' squeezing mechanism: seven bodies in three loops, driven by a motor (IVP Test Set, index 3)
"""

from math import atan2, cos, sin, sqrt

from numba import njit

MODEL = {
    "abi": 1,
    "generator": "symgen 0.1.0",
    "source": "sha256:4632389fe59eebecdcb6612f0a0eccaf3dc76dd504f673b38b334d3bb77e4d32",
    "name": "andrews_squeezer",
    "description": "Andrews' squeezing mechanism: seven bodies in three loops, driven by a motor (IVP Test Set, index 3)",
    "nq": 7,
    "nv": 7,
    "nh": 6,
    "nn": 0,
    "nw": 1,
    "coordinates": [
        {"name": "beta", "unit": "rad", "value": -0.06171389001427645, "enforced": True},
        {"name": "Theta", "unit": "rad", "value": 0.0, "enforced": False},
        {"name": "gamma", "unit": "rad", "value": 0.45527981916307037, "enforced": False},
        {"name": "Phi", "unit": "rad", "value": 0.22266839016588588, "enforced": False},
        {"name": "delta", "unit": "rad", "value": 0.48736497954384256, "enforced": False},
        {"name": "Omega", "unit": "rad", "value": -0.22266839016588588, "enforced": False},
        {"name": "eps", "unit": "rad", "value": 1.2305474445498212, "enforced": False},
    ],
    "quaternions": [],
    "rates": [
        {"name": "beta", "unit": "rad/s", "value": 0.0, "enforced": True},
        {"name": "Theta", "unit": "rad/s", "value": 0.0, "enforced": False},
        {"name": "gamma", "unit": "rad/s", "value": 0.0, "enforced": False},
        {"name": "Phi", "unit": "rad/s", "value": 0.0, "enforced": False},
        {"name": "delta", "unit": "rad/s", "value": 0.0, "enforced": False},
        {"name": "Omega", "unit": "rad/s", "value": 0.0, "enforced": False},
        {"name": "eps", "unit": "rad/s", "value": 0.0, "enforced": False},
    ],
    "parameters": [
        {"name": "m1", "unit": "kg", "value": 0.04325, "doc": ""},
        {"name": "m2", "unit": "kg", "value": 0.00365, "doc": ""},
        {"name": "m3", "unit": "kg", "value": 0.02373, "doc": ""},
        {"name": "m4", "unit": "kg", "value": 0.00706, "doc": ""},
        {"name": "m5", "unit": "kg", "value": 0.0705, "doc": ""},
        {"name": "m6", "unit": "kg", "value": 0.00706, "doc": ""},
        {"name": "m7", "unit": "kg", "value": 0.05498, "doc": ""},
        {"name": "I1", "unit": "kg*m^2", "value": 2.194e-06, "doc": ""},
        {"name": "I2", "unit": "kg*m^2", "value": 4.41e-07, "doc": ""},
        {"name": "I3", "unit": "kg*m^2", "value": 5.255e-06, "doc": ""},
        {"name": "I4", "unit": "kg*m^2", "value": 5.667e-07, "doc": ""},
        {"name": "I5", "unit": "kg*m^2", "value": 1.169e-05, "doc": ""},
        {"name": "I6", "unit": "kg*m^2", "value": 5.667e-07, "doc": ""},
        {"name": "I7", "unit": "kg*m^2", "value": 1.912e-05, "doc": ""},
        {"name": "xa", "unit": "m", "value": -0.06934, "doc": ""},
        {"name": "ya", "unit": "m", "value": -0.00227, "doc": ""},
        {"name": "xb", "unit": "m", "value": -0.03635, "doc": ""},
        {"name": "yb", "unit": "m", "value": 0.03273, "doc": ""},
        {"name": "xc", "unit": "m", "value": 0.014, "doc": ""},
        {"name": "yc", "unit": "m", "value": 0.072, "doc": ""},
        {"name": "d", "unit": "m", "value": 0.028, "doc": ""},
        {"name": "da", "unit": "m", "value": 0.0115, "doc": ""},
        {"name": "e", "unit": "m", "value": 0.02, "doc": ""},
        {"name": "ea", "unit": "m", "value": 0.01421, "doc": ""},
        {"name": "rr", "unit": "m", "value": 0.007, "doc": ""},
        {"name": "ra", "unit": "m", "value": 0.00092, "doc": ""},
        {"name": "ss", "unit": "m", "value": 0.035, "doc": ""},
        {"name": "sa", "unit": "m", "value": 0.01874, "doc": ""},
        {"name": "sb", "unit": "m", "value": 0.01043, "doc": ""},
        {"name": "sc", "unit": "m", "value": 0.018, "doc": ""},
        {"name": "sd", "unit": "m", "value": 0.02, "doc": ""},
        {"name": "ta", "unit": "m", "value": 0.02308, "doc": ""},
        {"name": "tb", "unit": "m", "value": 0.00916, "doc": ""},
        {"name": "u", "unit": "m", "value": 0.04, "doc": ""},
        {"name": "ua", "unit": "m", "value": 0.01228, "doc": ""},
        {"name": "ub", "unit": "m", "value": 0.00449, "doc": ""},
        {"name": "zf", "unit": "m", "value": 0.02, "doc": ""},
        {"name": "zt", "unit": "m", "value": 0.04, "doc": ""},
        {"name": "fa", "unit": "m", "value": 0.01421, "doc": ""},
        {"name": "c0", "unit": "N/m", "value": 4530.0, "doc": "stiffness of the spring"},
        {"name": "l0", "unit": "m", "value": 0.07785, "doc": "its slack length"},
        {"name": "mom", "unit": "N*m", "value": 0.033, "doc": "torque of the motor on the crank"},
    ],
    "inputs": [],
    "constants": [
        {"name": "bar", "unit": "m", "value": 0.0007},
    ],
    "constraints": [
        {"name": "loop1_x", "kind": "holonomic", "multiplier": "N"},
        {"name": "loop1_y", "kind": "holonomic", "multiplier": "N"},
        {"name": "loop2_x", "kind": "holonomic", "multiplier": "N"},
        {"name": "loop2_y", "kind": "holonomic", "multiplier": "N"},
        {"name": "loop3_x", "kind": "holonomic", "multiplier": "N"},
        {"name": "loop3_y", "kind": "holonomic", "multiplier": "N"},
    ],
    "outputs": [
        {"name": "crank_speed", "unit": "1/s"},
    ],
    "events": [],
    "bodies": [
        {"name": "K1", "planar": True, "shape": "box", "sizes": 3, "mesh": ""},
        {"name": "K2", "planar": True, "shape": "sphere", "sizes": 1, "mesh": ""},
        {"name": "K3", "planar": True, "shape": "box", "sizes": 3, "mesh": ""},
        {"name": "K4", "planar": True, "shape": "sphere", "sizes": 1, "mesh": ""},
        {"name": "K5", "planar": True, "shape": "box", "sizes": 3, "mesh": ""},
        {"name": "K6", "planar": True, "shape": "sphere", "sizes": 1, "mesh": ""},
        {"name": "K7", "planar": True, "shape": "box", "sizes": 3, "mesh": ""},
        {"name": "K1_bar", "planar": True, "shape": "capsule", "sizes": 2, "mesh": ""},
        {"name": "K2_bar", "planar": True, "shape": "capsule", "sizes": 2, "mesh": ""},
        {"name": "K3_bar", "planar": True, "shape": "capsule", "sizes": 2, "mesh": ""},
        {"name": "K3_arm", "planar": True, "shape": "capsule", "sizes": 2, "mesh": ""},
        {"name": "K4_bar", "planar": True, "shape": "capsule", "sizes": 2, "mesh": ""},
        {"name": "K5_bar", "planar": True, "shape": "capsule", "sizes": 2, "mesh": ""},
        {"name": "K6_bar", "planar": True, "shape": "capsule", "sizes": 2, "mesh": ""},
        {"name": "K7_bar", "planar": True, "shape": "capsule", "sizes": 2, "mesh": ""},
    ],
    "structure": {
        "conservative": False,
        "time_dependent": False,
        "constant_mass": False,
        "diagonal_mass": False,
        "velocity_dependent": True,
        "separable": False,
    },
    "operations": {
        "rhs": 670,
        "mass_matrix": 108,
        "forces": 202,
        "energy": 161,
        "residual": 309,
        "residual_jacobian": 590,
        "constraint_residual": 92,
        "constraint_jacobian": 40,
        "gamma": 77,
        "project": 594,
        "poses": 138,
        "shapes": 4,
        "outputs": 0,
        "marks": 22,
        "limits": 4,
    },
    "hoisted": {
        "rhs": 34,
        "mass_matrix": 15,
        "forces": 17,
        "energy": 17,
        "residual": 17,
        "residual_jacobian": 31,
        "project": 19,
        "poses": 6,
        "shapes": 1,
        "marks": 9,
    },
    "run": {
        "t_end": 0.03,
        "fps": 10000.0,
    },
    "limits": [
        {"name": "bodies.K1.mass", "bound": "zero or more"},
        {"name": "bodies.K1.inertia", "bound": "zero or more"},
        {"name": "bodies.K2.mass", "bound": "zero or more"},
        {"name": "bodies.K2.inertia", "bound": "zero or more"},
        {"name": "bodies.K3.mass", "bound": "zero or more"},
        {"name": "bodies.K3.inertia", "bound": "zero or more"},
        {"name": "bodies.K4.mass", "bound": "zero or more"},
        {"name": "bodies.K4.inertia", "bound": "zero or more"},
        {"name": "bodies.K5.mass", "bound": "zero or more"},
        {"name": "bodies.K5.inertia", "bound": "zero or more"},
        {"name": "bodies.K6.mass", "bound": "zero or more"},
        {"name": "bodies.K6.inertia", "bound": "zero or more"},
        {"name": "bodies.K7.mass", "bound": "zero or more"},
        {"name": "bodies.K7.inertia", "bound": "zero or more"},
        {"name": "bodies.K1_bar.shape.capsule[1]", "bound": "zero or more"},
        {"name": "bodies.K2_bar.shape.capsule[1]", "bound": "zero or more"},
        {"name": "bodies.K3_bar.shape.capsule[1]", "bound": "zero or more"},
        {"name": "bodies.K3_arm.shape.capsule[1]", "bound": "zero or more"},
        {"name": "bodies.K4_bar.shape.capsule[1]", "bound": "zero or more"},
        {"name": "bodies.K5_bar.shape.capsule[1]", "bound": "zero or more"},
        {"name": "bodies.K6_bar.shape.capsule[1]", "bound": "zero or more"},
        {"name": "bodies.K7_bar.shape.capsule[1]", "bound": "zero or more"},
    ],
    "subsystems": [],
    "marks": [
        {"kind": "pin", "name": "K1_bar_1", "body": "K1_bar", "numbers": 6},
        {"kind": "ground", "name": "K1_bar_1", "body": "", "numbers": 3},
        {"kind": "pin", "name": "K1_bar_2", "body": "K1_bar", "numbers": 6},
        {"kind": "pin", "name": "K2_bar_1", "body": "K2_bar", "numbers": 6},
        {"kind": "reaction", "name": "K2_bar_1", "body": "K2_bar", "numbers": 3, "constraints": [0, 1], "signs": [-1, -1]},
        {"kind": "pin", "name": "K3_bar_1", "body": "K3_bar", "numbers": 6},
        {"kind": "ground", "name": "K3_bar_1", "body": "", "numbers": 3},
        {"kind": "pin", "name": "K4_bar_1", "body": "K4_bar", "numbers": 6},
        {"kind": "pin", "name": "K4_bar_2", "body": "K4_bar", "numbers": 6},
        {"kind": "reaction", "name": "K4_bar_2", "body": "K4_bar", "numbers": 3, "constraints": [2, 3], "signs": [1, 1]},
        {"kind": "pin", "name": "K5_bar_1", "body": "K5_bar", "numbers": 6},
        {"kind": "ground", "name": "K5_bar_1", "body": "", "numbers": 3},
        {"kind": "pin", "name": "K6_bar_1", "body": "K6_bar", "numbers": 6},
        {"kind": "pin", "name": "K6_bar_2", "body": "K6_bar", "numbers": 6},
        {"kind": "reaction", "name": "K6_bar_2", "body": "K6_bar", "numbers": 3, "constraints": [4, 5], "signs": [1, 1]},
        {"kind": "spring", "name": "spring", "body": "", "numbers": 6, "moves": True},
        {"kind": "ground", "name": "hook", "body": "", "numbers": 3},
    ],
}

@njit(error_model="numpy")
def rhs(t, y, p, out):
    """State derivative: rates, accelerations, power, multipliers, pivot ratio. 670 operations."""
    p_m1 = p[0]
    p_m2 = p[1]
    p_m3 = p[2]
    p_m4 = p[3]
    p_m5 = p[4]
    p_m6 = p[5]
    p_m7 = p[6]
    p_I1 = p[7]
    p_I2 = p[8]
    p_I3 = p[9]
    p_I4 = p[10]
    p_I5 = p[11]
    p_I6 = p[12]
    p_I7 = p[13]
    p_xb = p[16]
    p_yb = p[17]
    p_xc = p[18]
    p_yc = p[19]
    p_d = p[20]
    p_da = p[21]
    p_e = p[22]
    p_ea = p[23]
    p_rr = p[24]
    p_ra = p[25]
    p_ss = p[26]
    p_sa = p[27]
    p_sb = p[28]
    p_sc = p[29]
    p_sd = p[30]
    p_ta = p[31]
    p_tb = p[32]
    p_u = p[33]
    p_ua = p[34]
    p_ub = p[35]
    p_zf = p[36]
    p_zt = p[37]
    p_fa = p[38]
    p_c0 = p[39]
    p_l0 = p[40]
    p_mom = p[41]
    c0 = p_m2*(p_rr*p_rr) + p_m1*(p_ra*p_ra)
    c1 = p_I2 + p_m2*(p_da*p_da)
    c2 = p_I1 + c1
    c3 = p_m2*p_da
    c4 = p_rr*c3
    c5 = 2.0*c4
    c6 = p_I3 + (p_m3*(p_sa*p_sa) + p_m3*(p_sb*p_sb))
    c7 = p_m3*p_sa
    c8 = p_m3*p_sb
    c9 = 2.0*(p_sb*c7 - p_sa*c8)
    c10 = 2.0*p_sd
    c11 = 2.0*p_sc
    c12 = p_m2*p_rr
    c13 = p_ra*(p_m1*p_ra)
    c14 = p_e - p_ea
    c15 = p_I4 + p_m4*(c14*c14)
    c16 = p_m4*c14
    c17 = p_zt*c16
    c18 = 1.0/c15
    c19 = c15 + (p_I5 + (p_m5*(p_tb*p_tb) + p_m5*(p_ta*p_ta) + p_m4*(p_zt*p_zt)))
    c20 = p_e*c18
    c21 = p_m5*p_tb
    c22 = p_m5*p_ta
    c23 = p_m4*p_zt
    c24 = p_zf - p_fa
    c25 = p_I6 + p_m6*(c24*c24)
    c26 = p_m6*c24
    c27 = p_u*c26
    c28 = 1.0/c25
    c29 = c25 + (p_I7 + (p_m7*(p_ub*p_ub) + p_m7*(p_ua*p_ua) + p_m6*(p_u*p_u)))
    c30 = p_zf*c28
    c31 = p_m7*p_ua
    c32 = p_m7*p_ub
    c33 = p_m6*p_u
    q_beta = y[0]
    q_Theta = y[1]
    q_gamma = y[2]
    q_Phi = y[3]
    q_delta = y[4]
    q_Omega = y[5]
    q_eps = y[6]
    v_beta = y[7]
    v_Theta = y[8]
    v_gamma = y[9]
    v_Phi = y[10]
    v_delta = y[11]
    v_Omega = y[12]
    v_eps = y[13]
    x0 = cos(q_beta)
    x1 = q_beta + q_Theta
    x2 = cos(x1)
    x3 = p_d*x2
    x4 = p_rr*x0 - x3
    x5 = sin(q_beta)
    x6 = x0*x2
    x7 = sin(x1)
    x8 = x5*x7
    x9 = 1.0/(c0*(x5*x5) + (c2 + c0*(x0*x0) - x6*c5) - c5*x8)
    x10 = x4*x9
    x11 = p_d*x7
    x12 = p_rr*x5 - x11
    x13 = x12*x9
    x14 = x4*x13
    x15 = sin(q_gamma)
    x16 = p_ss*x15
    x17 = cos(q_gamma)
    x18 = p_ss*x17
    x19 = 1.0/(c6 + x15*x17*c9)
    x20 = x18*x19
    x21 = c1 - c4*x6 - c4*x8
    x22 = x21*x9
    x23 = x3 + x4*x22
    x24 = x11 + x12*x22
    x25 = 1.0/(c1 - x21*x22)
    x26 = x24*x25
    x27 = x23*x26
    x28 = x14 - x16*x20 + x27
    x29 = x12*x13
    x30 = x24*x26
    x31 = 1.0/(x18*x20 + x29 + x30)
    x32 = x28*x31
    x33 = x16*x19
    x34 = x4*x10
    x35 = x23*x25
    x36 = x23*x35
    x37 = x16*x33 + x34 + x36
    x38 = x28*x32 - x37
    x39 = 1.0/x38
    x40 = v_gamma*(v_gamma*x17)
    x41 = v_gamma*(v_gamma*x15)
    x42 = p_sa*x40 - p_sb*x41
    x43 = p_sa*x41 + p_sb*x40
    x44 = p_yb + p_sd*x15 - p_sc*x17 - p_yc
    x45 = p_sd*x17 + (p_xb + p_sc*x15) - p_xc
    x46 = sqrt(x45*x45 + x44*x44)
    x47 = p_c0*((x46 - p_l0)*(0.5/x46))
    x48 = x44*x47
    x49 = x45*x47
    x50 = x15*(c7*x42 + c8*x43) + x17*(c8*x42 - c7*x43) + (x17*(x48*c10 + x49*c11) - x15*(x49*c10 - x48*c11))
    x51 = v_beta + v_Theta
    x52 = x51*(x7*x51)
    x53 = v_beta*(v_beta*x5)
    x54 = p_rr*x53
    x55 = p_d*x52 - x54
    x56 = x51*(x2*x51)
    x57 = v_beta*(v_beta*x0)
    x58 = p_rr*x57
    x59 = p_da*x56 - x58
    x60 = p_da*x52 - x54
    x61 = c3*(x7*x59) - c3*(x2*x60)
    x62 = x61 + x0*(x60*c12 - x53*c13) + x5*(x57*c13 - x59*c12) - p_mom
    x63 = x10*x62
    x64 = x22*x62 - x61
    x65 = x35*x64
    x66 = p_d*x56 - x58
    x67 = x13*x62
    x68 = x26*x64
    x69 = x66 + p_ss*x41 + x20*x50 + x67 + x68
    x70 = x33*x50 - (p_ss*x40 - x55) - x63 - x65 + x32*x69
    x71 = x12*x10 + x24*x35
    x72 = x29 + x30
    x73 = x71 - x72*x32
    x74 = x73*x39
    x75 = x72*x31
    x76 = x72*x75
    x77 = q_Phi + q_delta
    x78 = cos(x77)
    x79 = p_e*x78
    x80 = sin(q_delta)
    x81 = cos(q_delta)
    x82 = sin(x77)
    x83 = c17*(x81*x82) - c17*(x80*x78)
    x84 = c15 + x83
    x85 = x84*c18
    x86 = x79 - p_zt*x80 - x79*x85
    x87 = 1.0/(c19 + 2.0*x83 - x84*x85)
    x88 = x86*x87
    x89 = x78*c20
    x90 = x30 + (x29 + (x86*x88 + x79*x89))
    x91 = x73*x74
    x92 = x76 - x90 - x91
    x93 = 1.0/x92
    x94 = v_Phi + v_delta
    x95 = x94*(x82*x94)
    x96 = v_delta*(v_delta*x81)
    x97 = p_zt*x96
    x98 = x94*(x78*x94)
    x99 = v_delta*(v_delta*x80)
    x100 = p_zt*x99
    x101 = c14*x98 - x100
    x102 = x97 + c14*x95
    x103 = c16*(x82*x101) - c16*(x78*x102)
    x104 = p_ta*x96 - p_tb*x99
    x105 = p_ta*x99 + p_tb*x96
    x106 = x81*(c21*x104 - x105*c22 + x101*c23) + x80*(c21*x105 + x104*c22 + x102*c23)
    x107 = x85*x103 - (x103 + x106)
    x108 = x75*x69
    x109 = p_e*x95 + (x97 + x66) + x103*x89 - x88*x107 + x67 + x68 - x108
    x110 = x74*x70
    x111 = x109 - x110
    x112 = p_e*x82
    x113 = p_zt*x81 + x112 - x112*x85
    x114 = x14 + x27
    x115 = x114*x75
    x116 = x34 + x36
    x117 = x114*x32 - x116
    x118 = x117*x74
    x119 = x27 + (x14 - (x113*x88 + x112*x89)) - x115 - x118
    x120 = x119*x93
    x121 = x114*x31
    x122 = x114*x121
    x123 = x113*x87
    x124 = x82*c20
    x125 = x36 + (x34 + (x113*x123 + x112*x124))
    x126 = x117*x39
    x127 = x117*x126
    x128 = x122 - x125 - x127 - x119*x120
    x129 = 1.0/x128
    x130 = x121*x69
    x131 = x103*x124 - (p_e*x98 - (x100 + x55)) - x123*x107 - x63 - x65 + x130
    x132 = x126*x70
    x133 = x131 - x132 - x120*x111
    x134 = x76 - x72 - x91
    x135 = x71 - x72*x121 - x73*x126 - x134*x120
    x136 = x135*x129
    x137 = cos(q_eps)
    x138 = q_Omega + q_eps
    x139 = sin(x138)
    x140 = p_zf*x139
    x141 = sin(q_eps)
    x142 = cos(x138)
    x143 = c27*(x141*x142) - c27*(x137*x139)
    x144 = c25 + x143
    x145 = x144*c28
    x146 = p_u*x137 - x140 + x140*x145
    x147 = 1.0/(c29 + 2.0*x143 - x144*x145)
    x148 = x146*x147
    x149 = x139*c30
    x150 = x30 + (x29 + (x146*x148 + x140*x149))
    x151 = x134*x93
    x152 = x76 - x150 - x91 - x134*x151 - x135*x136
    x153 = 1.0/x152
    x154 = v_Omega + v_eps
    x155 = x154*(x142*x154)
    x156 = v_eps*(v_eps*x141)
    x157 = p_u*x156
    x158 = v_eps*(v_eps*x137)
    x159 = p_u*x158
    x160 = x154*(x139*x154)
    x161 = x159 - c24*x160
    x162 = x157 + c24*x155
    x163 = c26*(x142*x161) + c26*(x139*x162)
    x164 = p_ua*x158 + p_ub*x156
    x165 = p_ub*x158 - p_ua*x156
    x166 = x141*(x164*c31 + c32*x165 + x161*c33) + x137*(x165*c31 - c32*x164 - x162*c33)
    x167 = x145*x163 - (x163 + x166)
    x168 = p_zf*x155 + (x157 + x66) - x163*x149 - x148*x167 + x67 + x68 - x108
    x169 = x168 - x110 - x151*x111 - x136*x133
    x170 = p_zf*x142
    x171 = p_u*x141 + x170 - x170*x145
    x172 = x114 - x115 - x118
    x173 = x27 + (x14 + (x170*x149 - x171*x148)) - x115 - x118 - x172*x151
    x174 = x122 - x116 - x127 - x172*x120
    x175 = x173 - x174*x136
    x176 = x175*x153
    x177 = x171*x147
    x178 = x142*c30
    x179 = x36 + (x34 + (x171*x177 + x170*x178))
    x180 = x172*x93
    x181 = x174*x129
    x182 = x122 - x179 - x127 - x172*x180 - x174*x181 - x175*x176
    x183 = x163*x178 - (x159 - x55 - p_zf*x160) - x177*x167 - x63 - x65 + x130
    x184 = 1.0/x182*(x183 - x132 - x180*x111 - x181*x133 - x176*x169)
    x185 = x153*x169 - x176*x184
    x186 = x129*x133 - x136*x185 - x181*x184
    x187 = x93*x111 - x120*x186 - x151*x185 - x180*x184
    x188 = x39*x70 - x74*x187 - x126*x186 - x74*x185 - x126*x184
    x189 = x32*x188 - x31*x69 - x75*x187 + x121*x186 - x75*x185 + x121*x184
    x190 = x25*x64 + x26*x189 - x35*x188 + x26*x187 - x35*x186 + x26*x185
    x191 = x190 - x35*x184
    x192 = x10*x188 - (x9*x62 + x22*x191 + x13*x189) - x13*x187 + x10*x186
    x193 = x87*x107 - x88*x187 - x123*x186
    x194 = x147*x167 - x148*x185 - x177*x184
    x195 = -(x182/x179)
    x196 = -(x152/x150)
    x197 = -(x128/x125)
    x198 = -(x92/x90)
    x199 = -(x38/x37)
    x200 = (x199 if x199 < 1.0 else 1.0)
    x201 = (x198 if x198 < x200 else x200)
    x202 = (x197 if x197 < x201 else x201)
    x203 = (x196 if x196 < x202 else x202)
    out[0] = v_beta
    out[1] = v_Theta
    out[2] = v_gamma
    out[3] = v_Phi
    out[4] = v_delta
    out[5] = v_Omega
    out[6] = v_eps
    out[7] = x192 - x13*x185 + x10*x184
    out[8] = x191
    out[9] = -(x19*x50 + x20*x189 + x33*x188)
    out[10] = -(c18*x103 + x85*x193 + x89*x187 + x124*x186)
    out[11] = x193
    out[12] = x149*x185 - (c28*x163 + x145*x194) - x178*x184
    out[13] = x194
    out[14] = v_beta*p_mom
    out[15] = -x189
    out[16] = -x188
    out[17] = -x187
    out[18] = -x186
    out[19] = -x185
    out[20] = -x184
    out[21] = (x195 if x195 < x203 else x203)


@njit(error_model="numpy")
def mass_matrix(t, y, p, out):
    """Mass matrix M, row by row. 108 operations."""
    p_m1 = p[0]
    p_m2 = p[1]
    p_m3 = p[2]
    p_m4 = p[3]
    p_m5 = p[4]
    p_m6 = p[5]
    p_m7 = p[6]
    p_I1 = p[7]
    p_I2 = p[8]
    p_I3 = p[9]
    p_I4 = p[10]
    p_I5 = p[11]
    p_I6 = p[12]
    p_I7 = p[13]
    p_da = p[21]
    p_e = p[22]
    p_ea = p[23]
    p_rr = p[24]
    p_ra = p[25]
    p_sa = p[27]
    p_sb = p[28]
    p_ta = p[31]
    p_tb = p[32]
    p_u = p[33]
    p_ua = p[34]
    p_ub = p[35]
    p_zf = p[36]
    p_zt = p[37]
    p_fa = p[38]
    c0 = p_m2*(p_rr*p_rr) + p_m1*(p_ra*p_ra)
    c1 = p_I2 + p_m2*(p_da*p_da)
    c2 = p_I1 + c1
    c3 = p_rr*(p_m2*p_da)
    c4 = 2.0*c3
    c5 = p_I3 + (p_m3*(p_sa*p_sa) + p_m3*(p_sb*p_sb))
    c6 = 2.0*(p_sb*(p_m3*p_sa) - p_sa*(p_m3*p_sb))
    c7 = p_e - p_ea
    c8 = p_I4 + p_m4*(c7*c7)
    c9 = p_zt*(p_m4*c7)
    c10 = c8 + (p_I5 + (p_m5*(p_tb*p_tb) + p_m5*(p_ta*p_ta) + p_m4*(p_zt*p_zt)))
    c11 = p_zf - p_fa
    c12 = p_I6 + p_m6*(c11*c11)
    c13 = p_u*(p_m6*c11)
    c14 = c12 + (p_I7 + (p_m7*(p_ub*p_ub) + p_m7*(p_ua*p_ua) + p_m6*(p_u*p_u)))
    q_beta = y[0]
    q_Theta = y[1]
    q_gamma = y[2]
    q_Phi = y[3]
    q_delta = y[4]
    q_Omega = y[5]
    q_eps = y[6]
    x0 = sin(q_beta)
    x1 = cos(q_beta)
    x2 = q_beta + q_Theta
    x3 = x1*cos(x2)
    x4 = x0*sin(x2)
    x5 = c1 - c3*x3 - c3*x4
    x6 = q_Phi + q_delta
    x7 = c9*(cos(q_delta)*sin(x6)) - c9*(sin(q_delta)*cos(x6))
    x8 = c8 + x7
    x9 = q_Omega + q_eps
    x10 = c13*(sin(q_eps)*cos(x9)) - c13*(cos(q_eps)*sin(x9))
    x11 = c12 + x10
    out[0] = c0*(x0*x0) + (c2 + c0*(x1*x1) - x3*c4) - c4*x4
    out[1] = x5
    out[7] = x5
    out[8] = c1
    out[16] = c5 + sin(q_gamma)*cos(q_gamma)*c6
    out[24] = c8
    out[25] = x8
    out[31] = x8
    out[32] = c10 + 2.0*x7
    out[40] = c12
    out[41] = x11
    out[47] = x11
    out[48] = c14 + 2.0*x10


@njit(error_model="numpy")
def forces(t, y, p, out):
    """Forces f of M a = f + G^T lambda. 202 operations."""
    p_m1 = p[0]
    p_m2 = p[1]
    p_m3 = p[2]
    p_m4 = p[3]
    p_m5 = p[4]
    p_m6 = p[5]
    p_m7 = p[6]
    p_xb = p[16]
    p_yb = p[17]
    p_xc = p[18]
    p_yc = p[19]
    p_da = p[21]
    p_e = p[22]
    p_ea = p[23]
    p_rr = p[24]
    p_ra = p[25]
    p_sa = p[27]
    p_sb = p[28]
    p_sc = p[29]
    p_sd = p[30]
    p_ta = p[31]
    p_tb = p[32]
    p_u = p[33]
    p_ua = p[34]
    p_ub = p[35]
    p_zf = p[36]
    p_zt = p[37]
    p_fa = p[38]
    p_c0 = p[39]
    p_l0 = p[40]
    p_mom = p[41]
    c0 = p_m2*p_da
    c1 = p_m2*p_rr
    c2 = p_ra*(p_m1*p_ra)
    c3 = p_m3*p_sa
    c4 = p_m3*p_sb
    c5 = 2.0*p_sd
    c6 = 2.0*p_sc
    c7 = p_e - p_ea
    c8 = p_m4*c7
    c9 = p_m5*p_tb
    c10 = p_m5*p_ta
    c11 = p_m4*p_zt
    c12 = p_zf - p_fa
    c13 = p_m6*c12
    c14 = p_m7*p_ua
    c15 = p_m7*p_ub
    c16 = p_m6*p_u
    q_beta = y[0]
    q_Theta = y[1]
    q_gamma = y[2]
    q_Phi = y[3]
    q_delta = y[4]
    q_Omega = y[5]
    q_eps = y[6]
    v_beta = y[7]
    v_Theta = y[8]
    v_gamma = y[9]
    v_Phi = y[10]
    v_delta = y[11]
    v_Omega = y[12]
    v_eps = y[13]
    x0 = q_beta + q_Theta
    x1 = sin(x0)
    x2 = v_beta + v_Theta
    x3 = cos(x0)
    x4 = cos(q_beta)
    x5 = v_beta*(v_beta*x4)
    x6 = p_da*(x2*(x3*x2)) - p_rr*x5
    x7 = sin(q_beta)
    x8 = v_beta*(v_beta*x7)
    x9 = p_da*(x2*(x1*x2)) - p_rr*x8
    x10 = c0*(x1*x6) - c0*(x3*x9)
    x11 = sin(q_gamma)
    x12 = cos(q_gamma)
    x13 = v_gamma*(v_gamma*x12)
    x14 = v_gamma*(v_gamma*x11)
    x15 = p_sa*x13 - p_sb*x14
    x16 = p_sa*x14 + p_sb*x13
    x17 = p_yb + p_sd*x11 - p_sc*x12 - p_yc
    x18 = p_sd*x12 + (p_xb + p_sc*x11) - p_xc
    x19 = sqrt(x18*x18 + x17*x17)
    x20 = p_c0*((x19 - p_l0)*(0.5/x19))
    x21 = x17*x20
    x22 = x18*x20
    x23 = x11*(c3*x15 + c4*x16) + x12*(c4*x15 - c3*x16) + (x12*(x21*c5 + x22*c6) - x11*(x22*c5 - x21*c6))
    x24 = q_Phi + q_delta
    x25 = sin(x24)
    x26 = v_Phi + v_delta
    x27 = cos(x24)
    x28 = sin(q_delta)
    x29 = v_delta*(v_delta*x28)
    x30 = c7*(x26*(x27*x26)) - p_zt*x29
    x31 = cos(q_delta)
    x32 = v_delta*(v_delta*x31)
    x33 = p_zt*x32 + c7*(x26*(x25*x26))
    x34 = c8*(x25*x30) - c8*(x27*x33)
    x35 = p_ta*x32 - p_tb*x29
    x36 = p_ta*x29 + p_tb*x32
    x37 = x31*(c9*x35 - x36*c10 + x30*c11) + x28*(c9*x36 + x35*c10 + x33*c11)
    x38 = q_Omega + q_eps
    x39 = cos(x38)
    x40 = cos(q_eps)
    x41 = v_eps*(v_eps*x40)
    x42 = v_Omega + v_eps
    x43 = sin(x38)
    x44 = p_u*x41 - c12*(x42*(x43*x42))
    x45 = sin(q_eps)
    x46 = v_eps*(v_eps*x45)
    x47 = p_u*x46 + c12*(x42*(x39*x42))
    x48 = c13*(x39*x44) + c13*(x43*x47)
    x49 = p_ua*x41 + p_ub*x46
    x50 = p_ub*x41 - p_ua*x46
    x51 = x45*(x49*c14 + c15*x50 + x44*c16) + x40*(x50*c14 - c15*x49 - x47*c16)
    out[0] = -(x10 + x4*(x9*c1 - x8*c2) + x7*(x5*c2 - x6*c1) - p_mom)
    out[1] = -x10
    out[2] = -x23
    out[3] = -x34
    out[4] = -(x34 + x37)
    out[5] = -x48
    out[6] = -(x48 + x51)


@njit(error_model="numpy")
def energy(t, y, p, out):
    """Kinetic and potential energy. 161 operations."""
    p_m1 = p[0]
    p_m2 = p[1]
    p_m3 = p[2]
    p_m4 = p[3]
    p_m5 = p[4]
    p_m6 = p[5]
    p_m7 = p[6]
    p_I1 = p[7]
    p_I2 = p[8]
    p_I3 = p[9]
    p_I4 = p[10]
    p_I5 = p[11]
    p_I6 = p[12]
    p_I7 = p[13]
    p_xb = p[16]
    p_yb = p[17]
    p_xc = p[18]
    p_yc = p[19]
    p_da = p[21]
    p_e = p[22]
    p_ea = p[23]
    p_rr = p[24]
    p_ra = p[25]
    p_sa = p[27]
    p_sb = p[28]
    p_sc = p[29]
    p_sd = p[30]
    p_ta = p[31]
    p_tb = p[32]
    p_u = p[33]
    p_ua = p[34]
    p_ub = p[35]
    p_zf = p[36]
    p_zt = p[37]
    p_fa = p[38]
    p_c0 = p[39]
    p_l0 = p[40]
    c0 = 0.5*p_m7
    c1 = 0.5*p_m6
    c2 = p_zf - p_fa
    c3 = 0.5*p_m5
    c4 = 0.5*p_m4
    c5 = p_e - p_ea
    c6 = 0.5*p_m3
    c7 = 0.5*p_m2
    c8 = 0.5*p_m1
    c9 = 0.5*p_I1
    c10 = 0.5*p_I2
    c11 = 0.5*p_I3
    c12 = 0.5*p_I4
    c13 = 0.5*p_I5
    c14 = 0.5*p_I6
    c15 = 0.5*p_I7
    c16 = 0.5*p_c0
    q_beta = y[0]
    q_Theta = y[1]
    q_gamma = y[2]
    q_Phi = y[3]
    q_delta = y[4]
    q_Omega = y[5]
    q_eps = y[6]
    v_beta = y[7]
    v_Theta = y[8]
    v_gamma = y[9]
    v_Phi = y[10]
    v_delta = y[11]
    v_Omega = y[12]
    v_eps = y[13]
    x0 = v_eps*cos(q_eps)
    x1 = v_eps*sin(q_eps)
    x2 = p_ua*x0 + p_ub*x1
    x3 = p_ua*x1 - p_ub*x0
    x4 = q_Omega + q_eps
    x5 = v_Omega + v_eps
    x6 = p_u*x0 - c2*(sin(x4)*x5)
    x7 = p_u*x1 + c2*(cos(x4)*x5)
    x8 = v_delta*sin(q_delta)
    x9 = v_delta*cos(q_delta)
    x10 = p_ta*x8 + p_tb*x9
    x11 = p_ta*x9 - p_tb*x8
    x12 = q_Phi + q_delta
    x13 = v_Phi + v_delta
    x14 = c5*(cos(x12)*x13) - p_zt*x8
    x15 = p_zt*x9 + c5*(sin(x12)*x13)
    x16 = cos(q_gamma)
    x17 = v_gamma*x16
    x18 = sin(q_gamma)
    x19 = v_gamma*x18
    x20 = p_sa*x17 - p_sb*x19
    x21 = p_sb*x17 + p_sa*x19
    x22 = q_beta + q_Theta
    x23 = v_beta + v_Theta
    x24 = v_beta*sin(q_beta)
    x25 = p_da*(sin(x22)*x23) - p_rr*x24
    x26 = v_beta*cos(q_beta)
    x27 = p_rr*x26 - p_da*(cos(x22)*x23)
    x28 = p_ra*x24
    x29 = p_ra*x26
    x30 = c7*(x25*x25 + x27*x27) + (c8*(x28*x28 + x29*x29) + c9*(v_beta*v_beta))
    x31 = c6*(x20*x20 + x21*x21) + (x30 + c10*(x23*x23)) + c11*(v_gamma*v_gamma)
    x32 = c3*(x10*x10 + x11*x11) + (c4*(x14*x14 + x15*x15) + x31 + c12*(x13*x13))
    x33 = c1*(x6*x6 + x7*x7) + (x32 + c13*(v_delta*v_delta)) + c14*(x5*x5)
    x34 = p_sd*x16 + (p_xb + p_sc*x18) - p_xc
    x35 = p_yb + p_sd*x18 - p_sc*x16 - p_yc
    x36 = sqrt(x34*x34 + x35*x35) - p_l0
    out[0] = c0*(x2*x2 + x3*x3) + x33 + c15*(v_eps*v_eps)
    out[1] = x36*x36*c16


@njit(error_model="numpy")
def residual(t, y, p, out):
    """M a - f - G^T lambda, then G a - gamma. 309 operations."""
    p_m1 = p[0]
    p_m2 = p[1]
    p_m3 = p[2]
    p_m4 = p[3]
    p_m5 = p[4]
    p_m6 = p[5]
    p_m7 = p[6]
    p_I1 = p[7]
    p_I2 = p[8]
    p_I3 = p[9]
    p_I4 = p[10]
    p_I5 = p[11]
    p_I6 = p[12]
    p_I7 = p[13]
    p_xb = p[16]
    p_yb = p[17]
    p_xc = p[18]
    p_yc = p[19]
    p_d = p[20]
    p_da = p[21]
    p_e = p[22]
    p_ea = p[23]
    p_rr = p[24]
    p_ra = p[25]
    p_ss = p[26]
    p_sa = p[27]
    p_sb = p[28]
    p_sc = p[29]
    p_sd = p[30]
    p_ta = p[31]
    p_tb = p[32]
    p_u = p[33]
    p_ua = p[34]
    p_ub = p[35]
    p_zf = p[36]
    p_zt = p[37]
    p_fa = p[38]
    p_c0 = p[39]
    p_l0 = p[40]
    p_mom = p[41]
    c0 = p_m2*p_da
    c1 = p_m2*p_rr
    c2 = p_ra*(p_m1*p_ra)
    c3 = 2.0*p_sd
    c4 = 2.0*p_sc
    c5 = p_m3*p_sa
    c6 = p_m3*p_sb
    c7 = p_e - p_ea
    c8 = p_m4*c7
    c9 = p_m5*p_ta
    c10 = p_m5*p_tb
    c11 = p_m4*p_zt
    c12 = p_zf - p_fa
    c13 = p_m6*c12
    c14 = p_m7*p_ua
    c15 = p_m7*p_ub
    c16 = p_m6*p_u
    q_beta = y[0]
    q_Theta = y[1]
    q_gamma = y[2]
    q_Phi = y[3]
    q_delta = y[4]
    q_Omega = y[5]
    q_eps = y[6]
    v_beta = y[7]
    v_Theta = y[8]
    v_gamma = y[9]
    v_Phi = y[10]
    v_delta = y[11]
    v_Omega = y[12]
    v_eps = y[13]
    a_beta = y[14]
    a_Theta = y[15]
    a_gamma = y[16]
    a_Phi = y[17]
    a_delta = y[18]
    a_Omega = y[19]
    a_eps = y[20]
    lam_loop1_x = y[21]
    lam_loop1_y = y[22]
    lam_loop2_x = y[23]
    lam_loop2_y = y[24]
    lam_loop3_x = y[25]
    lam_loop3_y = y[26]
    x0 = a_beta + a_Theta
    x1 = q_beta + q_Theta
    x2 = cos(x1)
    x3 = cos(q_beta)
    x4 = sin(q_beta)
    x5 = a_beta*x3 - v_beta*(v_beta*x4)
    x6 = p_rr*x5
    x7 = v_beta + v_Theta
    x8 = sin(x1)
    x9 = x2*x0 - x7*(x8*x7)
    x10 = x6 - p_da*x9
    x11 = x7*(x2*x7) + x8*x0
    x12 = v_beta*(v_beta*x3) + a_beta*x4
    x13 = p_rr*x12
    x14 = p_da*x11 - x13
    x15 = p_I2*x0 - c0*(x2*x10) + c0*(x8*x14)
    x16 = a_beta*p_I1 + x15 + x3*(c1*x10 + c2*x5) + x4*(c2*x12 - c1*x14)
    x17 = lam_loop1_y + (lam_loop2_y + lam_loop3_y)
    x18 = lam_loop1_x + (lam_loop2_x + lam_loop3_x)
    x19 = p_d*(x2*x17) - p_d*(x8*x18)
    x20 = cos(q_gamma)
    x21 = sin(q_gamma)
    x22 = p_yb + p_sd*x21 - p_sc*x20 - p_yc
    x23 = p_sd*x20 + (p_xb + p_sc*x21) - p_xc
    x24 = sqrt(x23*x23 + x22*x22)
    x25 = p_c0*((x24 - p_l0)*(0.5/x24))
    x26 = x22*x25
    x27 = x23*x25
    x28 = a_gamma*x20 - v_gamma*(v_gamma*x21)
    x29 = v_gamma*(v_gamma*x20) + a_gamma*x21
    x30 = p_sb*x28 + p_sa*x29
    x31 = p_sa*x28 - p_sb*x29
    x32 = x20*(x26*c3 + x27*c4) - x21*(x27*c3 - x26*c4) + (a_gamma*p_I3 + x21*(c5*x30 - c6*x31) + x20*(c6*x30 + c5*x31))
    x33 = a_Phi + a_delta
    x34 = q_Phi + q_delta
    x35 = sin(x34)
    x36 = cos(q_delta)
    x37 = sin(q_delta)
    x38 = a_delta*x36 - v_delta*(v_delta*x37)
    x39 = p_zt*x38
    x40 = v_Phi + v_delta
    x41 = cos(x34)
    x42 = x40*(x41*x40) + x35*x33
    x43 = x39 + c7*x42
    x44 = x41*x33 - x40*(x35*x40)
    x45 = v_delta*(v_delta*x36) + a_delta*x37
    x46 = p_zt*x45
    x47 = c7*x44 - x46
    x48 = p_I4*x33 + c8*(x35*x43) + c8*(x41*x47)
    x49 = p_e*(lam_loop2_y*x35) + p_e*(lam_loop2_x*x41)
    x50 = p_ta*x38 - p_tb*x45
    x51 = p_ta*x45 + p_tb*x38
    x52 = a_delta*p_I5 + x36*(c9*x50 + c10*x51 + c11*x43) + x37*(c9*x51 - c10*x50 - c11*x47)
    x53 = x48 + x52 - (x49 + p_zt*(lam_loop2_y*x36) - p_zt*(lam_loop2_x*x37))
    x54 = a_Omega + a_eps
    x55 = q_Omega + q_eps
    x56 = cos(x55)
    x57 = cos(q_eps)
    x58 = sin(q_eps)
    x59 = v_eps*(v_eps*x57) + a_eps*x58
    x60 = p_u*x59
    x61 = v_Omega + v_eps
    x62 = sin(x55)
    x63 = x56*x54 - x61*(x62*x61)
    x64 = x60 + c12*x63
    x65 = a_eps*x57 - v_eps*(v_eps*x58)
    x66 = p_u*x65
    x67 = x61*(x56*x61) + x62*x54
    x68 = x66 - c12*x67
    x69 = p_I6*x54 + c13*(x56*x64) - c13*(x62*x68)
    x70 = p_zf*(lam_loop3_y*x56) - p_zf*(lam_loop3_x*x62)
    x71 = p_ua*x59 - p_ub*x65
    x72 = p_ua*x65 + p_ub*x59
    x73 = a_eps*p_I7 + x58*(c14*x71 + c15*x72 + c16*x64) + x57*(c14*x72 - c15*x71 + c16*x68)
    x74 = x69 + x73 - (x70 + p_u*(lam_loop3_y*x58) + p_u*(lam_loop3_x*x57))
    x75 = p_d*x11 - x13
    x76 = x6 - p_d*x9
    out[0] = x16 - p_mom - (x19 - p_rr*(x3*x17) + p_rr*(x4*x18))
    out[1] = x15 - x19
    out[2] = x32 - (p_ss*(lam_loop1_y*x21) + p_ss*(lam_loop1_x*x20))
    out[3] = x48 - x49
    out[4] = x53
    out[5] = x69 - x70
    out[6] = x74
    out[7] = p_ss*x28 - x75
    out[8] = p_ss*x29 - x76
    out[9] = p_e*x44 - (x46 + x75)
    out[10] = p_e*x42 + (x39 - x76)
    out[11] = x66 - x75 - p_zf*x67
    out[12] = p_zf*x63 + (x60 - x76)


@njit(error_model="numpy")
def residual_jacobian(t, y, p, out):
    """Residual derivatives by q, v, a, lambda. 590 operations."""
    p_m1 = p[0]
    p_m2 = p[1]
    p_m3 = p[2]
    p_m4 = p[3]
    p_m5 = p[4]
    p_m6 = p[5]
    p_m7 = p[6]
    p_I1 = p[7]
    p_I2 = p[8]
    p_I3 = p[9]
    p_I4 = p[10]
    p_I5 = p[11]
    p_I6 = p[12]
    p_I7 = p[13]
    p_xb = p[16]
    p_yb = p[17]
    p_xc = p[18]
    p_yc = p[19]
    p_d = p[20]
    p_da = p[21]
    p_e = p[22]
    p_ea = p[23]
    p_rr = p[24]
    p_ra = p[25]
    p_ss = p[26]
    p_sa = p[27]
    p_sb = p[28]
    p_sc = p[29]
    p_sd = p[30]
    p_ta = p[31]
    p_tb = p[32]
    p_u = p[33]
    p_ua = p[34]
    p_ub = p[35]
    p_zf = p[36]
    p_zt = p[37]
    p_fa = p[38]
    p_c0 = p[39]
    p_l0 = p[40]
    c0 = p_m2*p_da
    c1 = p_da*c0
    c2 = p_rr*c0
    c3 = p_m2*p_rr
    c4 = p_ra*(p_m1*p_ra)
    c5 = p_m2*(p_rr*p_rr) + p_m1*(p_ra*p_ra)
    c6 = p_I2 + p_m2*(p_da*p_da)
    c7 = p_I1 + c6
    c8 = 2.0*c2
    c9 = p_m3*p_sa
    c10 = p_m3*p_sb
    c11 = p_I3 + (p_m3*(p_sa*p_sa) + p_m3*(p_sb*p_sb))
    c12 = 2.0*(p_sb*c9 - p_sa*c10)
    c13 = p_e - p_ea
    c14 = p_m4*c13
    c15 = c13*c14
    c16 = p_I4 + p_m4*(c13*c13)
    c17 = p_zt*c14
    c18 = p_m5*p_tb
    c19 = p_m5*p_ta
    c20 = p_m4*p_zt
    c21 = c16 + (p_I5 + (p_m5*(p_tb*p_tb) + p_m5*(p_ta*p_ta) + p_m4*(p_zt*p_zt)))
    c22 = p_zf - p_fa
    c23 = p_m6*c22
    c24 = c22*c23
    c25 = p_I6 + p_m6*(c22*c22)
    c26 = p_u*c23
    c27 = p_m7*p_ua
    c28 = p_m7*p_ub
    c29 = p_m6*p_u
    c30 = c25 + (p_I7 + (p_m7*(p_ub*p_ub) + p_m7*(p_ua*p_ua) + p_m6*(p_u*p_u)))
    q_beta = y[0]
    q_Theta = y[1]
    q_gamma = y[2]
    q_Phi = y[3]
    q_delta = y[4]
    q_Omega = y[5]
    q_eps = y[6]
    v_beta = y[7]
    v_Theta = y[8]
    v_gamma = y[9]
    v_Phi = y[10]
    v_delta = y[11]
    v_Omega = y[12]
    v_eps = y[13]
    a_beta = y[14]
    a_Theta = y[15]
    a_gamma = y[16]
    a_Phi = y[17]
    a_delta = y[18]
    a_Omega = y[19]
    a_eps = y[20]
    lam_loop1_x = y[21]
    lam_loop1_y = y[22]
    lam_loop2_x = y[23]
    lam_loop2_y = y[24]
    lam_loop3_x = y[25]
    lam_loop3_y = y[26]
    x0 = sin(q_beta)
    x1 = lam_loop1_y + (lam_loop2_y + lam_loop3_y)
    x2 = q_beta + q_Theta
    x3 = sin(x2)
    x4 = cos(x2)
    x5 = lam_loop1_x + (lam_loop2_x + lam_loop3_x)
    x6 = p_d*(x3*x1) + p_d*(x4*x5)
    x7 = cos(q_beta)
    x8 = v_beta + v_Theta
    x9 = x4*x8
    x10 = a_beta + a_Theta
    x11 = x8*x9 + x3*x10
    x12 = v_beta*x7
    x13 = p_rr*(v_beta*x12 + a_beta*x0)
    x14 = x3*x8
    x15 = x4*x10 - x8*x14
    x16 = v_beta*x0
    x17 = p_rr*(a_beta*x7 - v_beta*x16)
    x18 = c0*(x4*(p_da*x11 - x13)) + c1*(x3*x15) - (c1*(x4*x11) - c0*(x3*(x17 - p_da*x15)))
    x19 = x9 + x9
    x20 = x12 + x12
    x21 = p_rr*x20
    x22 = p_da*x19 - x21
    x23 = x14 + x14
    x24 = x16 + x16
    x25 = p_rr*x24
    x26 = p_da*x23 - x25
    x27 = c0*(x3*x22) - c0*(x4*x26)
    x28 = c1*(x3*x19) - c1*(x4*x23)
    x29 = x7*x4
    x30 = x0*x3
    x31 = c6 - c2*x29 - c2*x30
    x32 = p_d*x3
    x33 = p_rr*x0 - x32
    x34 = -x33
    x35 = p_d*x4
    x36 = p_rr*x7 - x35
    x37 = -x35
    x38 = cos(q_gamma)
    x39 = sin(q_gamma)
    x40 = p_sd*x39
    x41 = p_sc*x38
    x42 = p_yb + x40 - x41 - p_yc
    x43 = 2.0*x42
    x44 = p_sd*x38
    x45 = p_sc*x39
    x46 = x44 + (p_xb + x45) - p_xc
    x47 = sqrt(x46*x46 + x42*x42)
    x48 = 0.5/x47
    x49 = 2.0*x46
    x50 = x41 - x40
    x51 = x45 + x44
    x52 = x48*(x49*x50 + x43*x51)
    x53 = p_c0*(x47 - p_l0)
    x54 = p_c0*(x48*x52) - x53*(x52*(x48*(1.0/x47)))
    x55 = x48*x53
    x56 = x43*x54 + 2.0*(x51*x55)
    x57 = x49*x54 + 2.0*(x50*x55)
    x58 = x43*x55
    x59 = x49*x55
    x60 = x38*(p_sd*x56 + p_sc*x57) - x39*(p_sd*x58 + p_sc*x59) - (x38*(p_sd*x59 - p_sc*x58) + x39*(p_sd*x57 - p_sc*x56))
    x61 = v_gamma*x38
    x62 = x61 + x61
    x63 = v_gamma*x39
    x64 = x63 + x63
    x65 = p_sa*x62 - p_sb*x64
    x66 = p_sa*x64 + p_sb*x62
    x67 = p_ss*x38
    x68 = p_ss*x39
    x69 = q_Phi + q_delta
    x70 = cos(x69)
    x71 = cos(q_delta)
    x72 = sin(q_delta)
    x73 = v_delta*x72
    x74 = p_zt*(a_delta*x71 - v_delta*x73)
    x75 = v_Phi + v_delta
    x76 = x70*x75
    x77 = sin(x69)
    x78 = a_Phi + a_delta
    x79 = x75*x76 + x77*x78
    x80 = x77*x75
    x81 = x70*x78 - x75*x80
    x82 = v_delta*x71
    x83 = p_zt*(v_delta*x82 + a_delta*x72)
    x84 = c14*(x70*(x74 + c13*x79)) + c15*(x77*x81) - (c14*(x77*(c13*x81 - x83)) + c15*(x70*x79))
    x85 = p_e*(lam_loop2_y*x70) - p_e*(lam_loop2_x*x77)
    x86 = x76 + x76
    x87 = x80 + x80
    x88 = c15*(x77*x86) - c15*(x70*x87)
    x89 = x73 + x73
    x90 = p_zt*x89
    x91 = c13*x86 - x90
    x92 = x82 + x82
    x93 = p_zt*x92
    x94 = x93 + c13*x87
    x95 = c14*(x77*x91) - c14*(x70*x94)
    x96 = c17*(x71*x77) - c17*(x72*x70)
    x97 = c16 + x96
    x98 = p_e*x70
    x99 = p_e*x77
    x100 = p_ta*x92 - p_tb*x89
    x101 = p_ta*x89 + p_tb*x92
    x102 = x71*(c18*x100 - c19*x101 + c20*x91) + x72*(c18*x101 + c19*x100 + c20*x94)
    x103 = x98 - p_zt*x72
    x104 = p_zt*x71 + x99
    x105 = q_Omega + q_eps
    x106 = sin(x105)
    x107 = cos(x105)
    x108 = p_zf*(lam_loop3_y*x106) + p_zf*(lam_loop3_x*x107)
    x109 = cos(q_eps)
    x110 = v_eps*x109
    x111 = sin(q_eps)
    x112 = p_u*(v_eps*x110 + a_eps*x111)
    x113 = a_Omega + a_eps
    x114 = v_Omega + v_eps
    x115 = x106*x114
    x116 = x107*x113 - x114*x115
    x117 = x107*x114
    x118 = x114*x117 + x106*x113
    x119 = v_eps*x111
    x120 = p_u*(a_eps*x109 - v_eps*x119)
    x121 = c23*(x106*(x112 + c22*x116)) + c24*(x107*x118) + (c23*(x107*(x120 - c22*x118)) - c24*(x106*x116))
    x122 = x117 + x117
    x123 = x115 + x115
    x124 = c24*(x106*x122) - c24*(x107*x123)
    x125 = x110 + x110
    x126 = p_u*x125
    x127 = x126 - c22*x123
    x128 = x119 + x119
    x129 = p_u*x128
    x130 = x129 + c22*x122
    x131 = c23*(x107*x127) + c23*(x106*x130)
    x132 = c26*(x111*x107) - c26*(x109*x106)
    x133 = c25 + x132
    x134 = p_zf*x106
    x135 = p_zf*x107
    x136 = p_ua*x125 + p_ub*x128
    x137 = p_ub*x125 - p_ua*x128
    x138 = x111*(c27*x136 + c28*x137 + c29*x127) + x109*(c27*x137 - c28*x136 - c29*x130)
    x139 = p_u*x109 - x134
    x140 = p_u*x111 + x135
    x141 = p_d*x15
    x142 = x17 - x141
    x143 = -x141
    x144 = p_d*x19
    x145 = x21 - x144
    x146 = -x144
    x147 = -x32
    x148 = p_d*x11
    x149 = -(x148 - x13)
    x150 = -x148
    x151 = p_d*x23
    x152 = x25 - x151
    x153 = -x151
    x154 = -x36
    x155 = p_e*x79
    x156 = p_e*x87
    x157 = p_e*x81
    x158 = p_e*x86
    x159 = p_zf*x116
    x160 = p_zf*x122
    x161 = p_zf*x118
    x162 = p_zf*x123
    out[0] = -(p_rr*(x0*x1) - x6 + p_rr*(x7*x5))
    out[1] = x18 + c2*(x7*x11) - c2*(x0*x15) + x6
    out[7] = x27 + x7*(c3*x26 - c4*x24) + x0*(c4*x20 - c3*x22)
    out[8] = x28 + c2*(x7*x23) - c2*(x0*x19)
    out[14] = c5*(x0*x0) + (c7 + c5*(x7*x7) - x29*c8) - c8*x30
    out[15] = x31
    out[21] = x34
    out[22] = x36
    out[23] = x34
    out[24] = x36
    out[25] = x34
    out[26] = x36
    out[27] = x6
    out[28] = x18 + x6
    out[34] = x27
    out[35] = x28
    out[41] = x31
    out[42] = c6
    out[48] = x32
    out[49] = x37
    out[50] = x32
    out[51] = x37
    out[52] = x32
    out[53] = x37
    out[56] = x60 - (p_ss*(lam_loop1_y*x38) - p_ss*(lam_loop1_x*x39))
    out[63] = x39*(c9*x65 + c10*x66) + x38*(c10*x65 - c9*x66)
    out[70] = c11 + x39*x38*c12
    out[75] = -x67
    out[76] = -x68
    out[84] = x84 - x85
    out[85] = -x85
    out[91] = x88
    out[92] = x95
    out[98] = c16
    out[99] = x97
    out[104] = -x98
    out[105] = -x99
    out[111] = x84 + (c17*(x71*x81) + c17*(x72*x79)) - x85
    out[112] = -(x85 - p_zt*(lam_loop2_y*x72) - p_zt*(lam_loop2_x*x71))
    out[118] = x88 + (c17*(x71*x86) + c17*(x72*x87))
    out[119] = x95 + x102
    out[125] = x97
    out[126] = c21 + 2.0*x96
    out[131] = -x103
    out[132] = -x104
    out[140] = x108 - x121
    out[141] = x108
    out[147] = x124
    out[148] = x131
    out[154] = c25
    out[155] = x133
    out[160] = x134
    out[161] = -x135
    out[167] = x108 - (x121 + (c26*(x111*x118) + c26*(x109*x116)))
    out[168] = -(p_u*(lam_loop3_y*x109) - x108 - p_u*(lam_loop3_x*x111))
    out[174] = x124 - (c26*(x111*x123) + c26*(x109*x122))
    out[175] = x131 + x138
    out[181] = x133
    out[182] = c30 + 2.0*x132
    out[187] = -x139
    out[188] = -x140
    out[189] = x142
    out[190] = x143
    out[191] = -(p_ss*(v_gamma*x61 + a_gamma*x39))
    out[196] = x145
    out[197] = x146
    out[198] = -(p_ss*x64)
    out[203] = x33
    out[204] = x147
    out[205] = x67
    out[216] = x149
    out[217] = x150
    out[218] = p_ss*(a_gamma*x38 - v_gamma*x63)
    out[223] = x152
    out[224] = x153
    out[225] = p_ss*x62
    out[230] = x154
    out[231] = x35
    out[232] = x68
    out[243] = x142
    out[244] = x143
    out[246] = -x155
    out[247] = -(x74 + x155)
    out[250] = x145
    out[251] = x146
    out[253] = -x156
    out[254] = -(x156 + x93)
    out[257] = x33
    out[258] = x147
    out[260] = x98
    out[261] = x103
    out[270] = x149
    out[271] = x150
    out[273] = x157
    out[274] = x157 - x83
    out[277] = x152
    out[278] = x153
    out[280] = x158
    out[281] = x158 - x90
    out[284] = x154
    out[285] = x35
    out[287] = x99
    out[288] = x104
    out[297] = x142
    out[298] = x143
    out[302] = -x159
    out[303] = -(x112 + x159)
    out[304] = x145
    out[305] = x146
    out[309] = -x160
    out[310] = -(x160 + x129)
    out[311] = x33
    out[312] = x147
    out[316] = -x134
    out[317] = x139
    out[324] = x149
    out[325] = x150
    out[329] = -x161
    out[330] = x120 - x161
    out[331] = x152
    out[332] = x153
    out[336] = -x162
    out[337] = x126 - x162
    out[338] = x154
    out[339] = x35
    out[343] = x135
    out[344] = x140


@njit(error_model="numpy")
def constraint_residual(t, y, p, out):
    """Position residuals, velocity residuals. 92 operations."""
    p_xa = p[14]
    p_ya = p[15]
    p_xb = p[16]
    p_yb = p[17]
    p_d = p[20]
    p_e = p[22]
    p_rr = p[24]
    p_ss = p[26]
    p_u = p[33]
    p_zf = p[36]
    p_zt = p[37]
    q_beta = y[0]
    q_Theta = y[1]
    q_gamma = y[2]
    q_Phi = y[3]
    q_delta = y[4]
    q_Omega = y[5]
    q_eps = y[6]
    v_beta = y[7]
    v_Theta = y[8]
    v_gamma = y[9]
    v_Phi = y[10]
    v_delta = y[11]
    v_Omega = y[12]
    v_eps = y[13]
    x0 = sin(q_gamma)
    x1 = cos(q_beta)
    x2 = q_beta + q_Theta
    x3 = cos(x2)
    x4 = p_rr*x1 - p_d*x3
    x5 = sin(q_beta)
    x6 = sin(x2)
    x7 = p_rr*x5 - p_d*x6
    x8 = cos(q_gamma)
    x9 = q_Phi + q_delta
    x10 = sin(x9)
    x11 = cos(q_delta)
    x12 = sin(q_delta)
    x13 = cos(x9)
    x14 = q_Omega + q_eps
    x15 = cos(x14)
    x16 = sin(q_eps)
    x17 = sin(x14)
    x18 = cos(q_eps)
    x19 = v_beta + v_Theta
    x20 = p_d*(x6*x19) - p_rr*(v_beta*x5)
    x21 = p_rr*(v_beta*x1) - p_d*(x3*x19)
    x22 = v_Phi + v_delta
    x23 = v_Omega + v_eps
    out[0] = p_ss*x0 + (p_xb - x4)
    out[1] = p_yb - x7 - p_ss*x8
    out[2] = p_e*x10 + (p_xa + p_zt*x11 - x4)
    out[3] = p_ya + p_zt*x12 - x7 - p_e*x13
    out[4] = p_zf*x15 + (p_xa + p_u*x16 - x4)
    out[5] = p_zf*x17 + (p_ya - p_u*x18 - x7)
    out[6] = p_ss*(v_gamma*x8) - x20
    out[7] = p_ss*(v_gamma*x0) - x21
    out[8] = p_e*(x13*x22) - (p_zt*(v_delta*x12) + x20)
    out[9] = p_e*(x10*x22) + (p_zt*(v_delta*x11) - x21)
    out[10] = p_u*(v_eps*x18) - x20 - p_zf*(x17*x23)
    out[11] = p_zf*(x15*x23) + (p_u*(v_eps*x16) - x21)


@njit(error_model="numpy")
def constraint_jacobian(t, y, p, out):
    """Constraint Jacobian G, row by row. 40 operations."""
    p_d = p[20]
    p_e = p[22]
    p_rr = p[24]
    p_ss = p[26]
    p_u = p[33]
    p_zf = p[36]
    p_zt = p[37]
    q_beta = y[0]
    q_Theta = y[1]
    q_gamma = y[2]
    q_Phi = y[3]
    q_delta = y[4]
    q_Omega = y[5]
    q_eps = y[6]
    x0 = q_beta + q_Theta
    x1 = p_d*sin(x0)
    x2 = p_rr*sin(q_beta) - x1
    x3 = -x1
    x4 = p_d*cos(x0)
    x5 = -(p_rr*cos(q_beta) - x4)
    x6 = q_Phi + q_delta
    x7 = p_e*cos(x6)
    x8 = p_e*sin(x6)
    x9 = q_Omega + q_eps
    x10 = p_zf*sin(x9)
    x11 = p_zf*cos(x9)
    out[0] = x2
    out[1] = x3
    out[2] = p_ss*cos(q_gamma)
    out[7] = x5
    out[8] = x4
    out[9] = p_ss*sin(q_gamma)
    out[14] = x2
    out[15] = x3
    out[17] = x7
    out[18] = x7 - p_zt*sin(q_delta)
    out[21] = x5
    out[22] = x4
    out[24] = x8
    out[25] = p_zt*cos(q_delta) + x8
    out[28] = x2
    out[29] = x3
    out[33] = -x10
    out[34] = p_u*cos(q_eps) - x10
    out[35] = x5
    out[36] = x4
    out[40] = x11
    out[41] = p_u*sin(q_eps) + x11


@njit(error_model="numpy")
def gamma(t, y, p, out):
    """Right-hand side of G a = gamma. 77 operations."""
    p_d = p[20]
    p_e = p[22]
    p_rr = p[24]
    p_ss = p[26]
    p_u = p[33]
    p_zf = p[36]
    p_zt = p[37]
    q_beta = y[0]
    q_Theta = y[1]
    q_gamma = y[2]
    q_Phi = y[3]
    q_delta = y[4]
    q_Omega = y[5]
    q_eps = y[6]
    v_beta = y[7]
    v_Theta = y[8]
    v_gamma = y[9]
    v_Phi = y[10]
    v_delta = y[11]
    v_Omega = y[12]
    v_eps = y[13]
    x0 = v_beta + v_Theta
    x1 = q_beta + q_Theta
    x2 = p_d*(x0*(cos(x1)*x0)) - p_rr*(v_beta*(v_beta*cos(q_beta)))
    x3 = p_d*(x0*(sin(x1)*x0)) - p_rr*(v_beta*(v_beta*sin(q_beta)))
    x4 = v_Phi + v_delta
    x5 = q_Phi + q_delta
    x6 = p_e*(x4*(sin(x5)*x4)) + (p_zt*(v_delta*(v_delta*cos(q_delta))) + x2)
    x7 = p_e*(x4*(cos(x5)*x4)) - (p_zt*(v_delta*(v_delta*sin(q_delta))) + x3)
    x8 = v_Omega + v_eps
    x9 = q_Omega + q_eps
    x10 = p_zf*(x8*(cos(x9)*x8)) + (p_u*(v_eps*(v_eps*sin(q_eps))) + x2)
    x11 = -(p_u*(v_eps*(v_eps*cos(q_eps))) - x3 - p_zf*(x8*(sin(x9)*x8)))
    out[0] = x2 + p_ss*(v_gamma*(v_gamma*sin(q_gamma)))
    out[1] = -(p_ss*(v_gamma*(v_gamma*cos(q_gamma))) - x3)
    out[2] = x6
    out[3] = -x7
    out[4] = x10
    out[5] = x11


@njit(error_model="numpy")
def project(t, y, p, out):
    """State moved onto the constraints, and the residuals it had. 594 operations."""
    p_m1 = p[0]
    p_m2 = p[1]
    p_m3 = p[2]
    p_m4 = p[3]
    p_m5 = p[4]
    p_m6 = p[5]
    p_m7 = p[6]
    p_I1 = p[7]
    p_I2 = p[8]
    p_I3 = p[9]
    p_I4 = p[10]
    p_I5 = p[11]
    p_I6 = p[12]
    p_I7 = p[13]
    p_xa = p[14]
    p_ya = p[15]
    p_xb = p[16]
    p_yb = p[17]
    p_d = p[20]
    p_da = p[21]
    p_e = p[22]
    p_ea = p[23]
    p_rr = p[24]
    p_ra = p[25]
    p_ss = p[26]
    p_sa = p[27]
    p_sb = p[28]
    p_ta = p[31]
    p_tb = p[32]
    p_u = p[33]
    p_ua = p[34]
    p_ub = p[35]
    p_zf = p[36]
    p_zt = p[37]
    p_fa = p[38]
    c0 = p_m2*(p_rr*p_rr) + p_m1*(p_ra*p_ra)
    c1 = p_I2 + p_m2*(p_da*p_da)
    c2 = p_I1 + c1
    c3 = p_rr*(p_m2*p_da)
    c4 = 2.0*c3
    c5 = p_I3 + (p_m3*(p_sa*p_sa) + p_m3*(p_sb*p_sb))
    c6 = 2.0*(p_sb*(p_m3*p_sa) - p_sa*(p_m3*p_sb))
    c7 = p_e - p_ea
    c8 = p_I4 + p_m4*(c7*c7)
    c9 = p_zt*(p_m4*c7)
    c10 = 1.0/c8
    c11 = c8 + (p_I5 + (p_m5*(p_tb*p_tb) + p_m5*(p_ta*p_ta) + p_m4*(p_zt*p_zt)))
    c12 = p_e*c10
    c13 = p_zf - p_fa
    c14 = p_I6 + p_m6*(c13*c13)
    c15 = p_u*(p_m6*c13)
    c16 = 1.0/c14
    c17 = c14 + (p_I7 + (p_m7*(p_ub*p_ub) + p_m7*(p_ua*p_ua) + p_m6*(p_u*p_u)))
    c18 = p_zf*c16
    q_beta = y[0]
    q_Theta = y[1]
    q_gamma = y[2]
    q_Phi = y[3]
    q_delta = y[4]
    q_Omega = y[5]
    q_eps = y[6]
    v_beta = y[7]
    v_Theta = y[8]
    v_gamma = y[9]
    v_Phi = y[10]
    v_delta = y[11]
    v_Omega = y[12]
    v_eps = y[13]
    x0 = cos(q_beta)
    x1 = q_beta + q_Theta
    x2 = cos(x1)
    x3 = p_d*x2
    x4 = p_rr*x0 - x3
    x5 = sin(q_beta)
    x6 = x0*x2
    x7 = sin(x1)
    x8 = x5*x7
    x9 = 1.0/(c0*(x5*x5) + (c2 + c0*(x0*x0) - x6*c4) - c4*x8)
    x10 = x4*x9
    x11 = p_d*x7
    x12 = p_rr*x5 - x11
    x13 = x12*x9
    x14 = x4*x13
    x15 = c1 - c3*x6 - c3*x8
    x16 = x15*x9
    x17 = x3 + x4*x16
    x18 = x11 + x12*x16
    x19 = 1.0/(c1 - x15*x16)
    x20 = x18*x19
    x21 = x17*x20
    x22 = x14 + x21
    x23 = cos(q_gamma)
    x24 = p_ss*x23
    x25 = sin(q_gamma)
    x26 = 1.0/(c5 + x25*x23*c6)
    x27 = x24*x26
    x28 = x12*x13
    x29 = x18*x20
    x30 = 1.0/(x24*x27 + x28 + x29)
    x31 = x22*x30
    x32 = x22*x31
    x33 = x17*x19
    x34 = x17*x33
    x35 = x4*x10
    x36 = cos(q_delta)
    x37 = p_zt*x36
    x38 = q_Phi + q_delta
    x39 = sin(x38)
    x40 = p_e*x39
    x41 = sin(q_delta)
    x42 = cos(x38)
    x43 = c9*(x36*x39) - c9*(x41*x42)
    x44 = c8 + x43
    x45 = x44*c10
    x46 = x37 + x40 - x40*x45
    x47 = 1.0/(c11 + 2.0*x43 - x44*x45)
    x48 = x46*x47
    x49 = x39*c12
    x50 = p_ss*x25
    x51 = x14 - x50*x27 + x21
    x52 = x51*x30
    x53 = x35 + x34
    x54 = x22*x52 - x53
    x55 = x50*x26
    x56 = 1.0/(x51*x52 - (x50*x55 + x35 + x34))
    x57 = x54*x56
    x58 = x54*x57
    x59 = p_e*x42
    x60 = p_zt*x41
    x61 = x59 - x60 - x59*x45
    x62 = x61*x47
    x63 = x42*c12
    x64 = x28 + x29
    x65 = x64*x30
    x66 = x22*x65
    x67 = x12*x10 + x18*x33
    x68 = x67 - x64*x52
    x69 = x68*x56
    x70 = x54*x69
    x71 = x21 + (x14 - (x46*x62 + x40*x63)) - x66 - x70
    x72 = x64*x65
    x73 = x68*x69
    x74 = 1.0/(x72 - (x29 + (x28 + (x61*x62 + x59*x63))) - x73)
    x75 = x71*x74
    x76 = 1.0/(x32 - (x34 + (x35 + (x46*x48 + x40*x49))) - x58 - x71*x75)
    x77 = p_yb - x12 - x24
    x78 = x50 + (p_xb - x4)
    x79 = x77 + x78*x52
    x80 = x57*x79
    x81 = p_ya + x60 - x12 - x59
    x82 = x78*x31
    x83 = x78*x65
    x84 = x40 + (p_xa + x37 - x4)
    x85 = x69*x79
    x86 = x83 - x84 + x85
    x87 = x80 - (x81 + x82) - x75*x86
    x88 = x72 - x64 - x73
    x89 = x67 - x64*x31 - x68*x57 - x88*x75
    x90 = x89*x76
    x91 = cos(q_eps)
    x92 = p_u*x91
    x93 = q_Omega + q_eps
    x94 = sin(x93)
    x95 = p_zf*x94
    x96 = sin(q_eps)
    x97 = cos(x93)
    x98 = c15*(x96*x97) - c15*(x91*x94)
    x99 = c14 + x98
    x100 = x99*c16
    x101 = x92 - x95 + x95*x100
    x102 = 1.0/(c17 + 2.0*x98 - x99*x100)
    x103 = x101*x102
    x104 = x94*c18
    x105 = x88*x74
    x106 = x72 - (x29 + (x28 + (x101*x103 + x95*x104))) - x73 - x88*x105
    x107 = 1.0/(x106 - x89*x90)
    x108 = p_zf*x97
    x109 = p_u*x96
    x110 = x108 + (p_xa + x109 - x4)
    x111 = x83 - x110 + x85 - x105*x86 - x90*x87
    x112 = x109 + x108 - x108*x100
    x113 = x22 - x66 - x70
    x114 = x21 + (x14 + (x108*x104 - x112*x103)) - x66 - x70 - x113*x105
    x115 = x32 - x53 - x58 - x113*x75
    x116 = x114 - x115*x90
    x117 = x116*x107
    x118 = x112*x102
    x119 = x97*c18
    x120 = x113*x74
    x121 = x32 - (x34 + (x35 + (x112*x118 + x108*x119))) - x58 - x113*x120
    x122 = x115*x76
    x123 = 1.0/(x121 - x115*x122 - x116*x117)
    x124 = x95 + (p_ya - x92 - x12)
    x125 = x123*(x80 - (x124 + x82) - x120*x86 - x122*x87 - x117*x111)
    x126 = x107*x111 - x117*x125
    x127 = x76*x87 - x90*x126 - x122*x125
    x128 = x74*x86 - x75*x127 - x105*x126 - x120*x125
    x129 = x56*x79 + x69*x128 + x57*x127 + x69*x126 + x57*x125
    x130 = x78*x30 - x52*x129 - x65*x128 + x31*x127 - x65*x126 + x31*x125
    x131 = x20*x130 + x33*x129 + x20*x128 - x33*x127 + x20*x126 - x33*x125
    x132 = x10*x127 - (x16*x131 + x13*x130 + x10*x129 + x13*x128) - x13*x126
    x133 = q_beta + (x132 + x10*x125)
    x134 = q_Theta + x131
    x135 = q_gamma + (x55*x129 - x27*x130)
    x136 = x62*x128 + x48*x127
    x137 = q_Phi + (x45*x136 - x63*x128 - x49*x127)
    x138 = q_delta - x136
    x139 = x103*x126 + x118*x125
    x140 = q_Omega + (x100*x139 + x104*x126 - x119*x125)
    x141 = q_eps - x139
    x142 = v_beta + v_Theta
    x143 = x133 + x134
    x144 = p_rr*(v_beta*cos(x133)) - p_d*(x142*cos(x143))
    x145 = p_ss*(v_gamma*sin(x135)) - x144
    x146 = p_d*(x142*sin(x143)) - p_rr*(v_beta*sin(x133))
    x147 = p_ss*(v_gamma*cos(x135)) - x146
    x148 = x145 + x52*x147
    x149 = x57*x148
    x150 = v_Phi + v_delta
    x151 = x137 + x138
    x152 = p_e*(x150*sin(x151)) + (p_zt*(v_delta*cos(x138)) - x144)
    x153 = x31*x147
    x154 = x65*x147
    x155 = p_e*(x150*cos(x151)) - (p_zt*(v_delta*sin(x138)) + x146)
    x156 = x69*x148
    x157 = x154 - x155 + x156
    x158 = x149 - (x152 + x153) - x75*x157
    x159 = v_Omega + v_eps
    x160 = x140 + x141
    x161 = p_u*(v_eps*cos(x141)) - x146 - p_zf*(x159*sin(x160))
    x162 = x154 - x161 + x156 - x105*x157 - x90*x158
    x163 = p_zf*(x159*cos(x160)) + (p_u*(v_eps*sin(x141)) - x144)
    x164 = x123*(x149 - (x163 + x153) - x120*x157 - x122*x158 - x117*x162)
    x165 = x107*x162 - x117*x164
    x166 = x76*x158 - x90*x165 - x122*x164
    x167 = x74*x157 - x75*x166 - x105*x165 - x120*x164
    x168 = x56*x148 + x69*x167 + x57*x166 + x69*x165 + x57*x164
    x169 = x30*x147 - x52*x168 - x65*x167 + x31*x166 - x65*x165 + x31*x164
    x170 = x20*x169 + x33*x168 + x20*x167 - x33*x166 + x20*x165 - x33*x164
    x171 = x10*x166 - (x16*x170 + x13*x169 + x10*x168 + x13*x167) - x13*x165
    x172 = x62*x167 + x48*x166
    x173 = x103*x165 + x118*x164
    out[0] = x133
    out[1] = x134
    out[2] = x135
    out[3] = x137
    out[4] = x138
    out[5] = x140
    out[6] = x141
    out[7] = v_beta + (x171 + x10*x164)
    out[8] = v_Theta + x170
    out[9] = v_gamma + (x55*x168 - x27*x169)
    out[10] = v_Phi + (x45*x172 - x63*x167 - x49*x166)
    out[11] = v_delta - x172
    out[12] = v_Omega + (x100*x173 + x104*x165 - x119*x164)
    out[13] = v_eps - x173
    out[14] = x78
    out[15] = x77
    out[16] = x84
    out[17] = x81
    out[18] = x110
    out[19] = x124
    out[20] = x147
    out[21] = x145
    out[22] = x155
    out[23] = x152
    out[24] = x161
    out[25] = x163


@njit(error_model="numpy")
def poses(t, y, p, out):
    """Per body: position, rotation matrix (body to world). 138 operations."""
    p_xa = p[14]
    p_ya = p[15]
    p_xb = p[16]
    p_yb = p[17]
    p_d = p[20]
    p_da = p[21]
    p_e = p[22]
    p_ea = p[23]
    p_rr = p[24]
    p_ra = p[25]
    p_ss = p[26]
    p_sa = p[27]
    p_sb = p[28]
    p_sc = p[29]
    p_sd = p[30]
    p_ta = p[31]
    p_tb = p[32]
    p_u = p[33]
    p_ua = p[34]
    p_ub = p[35]
    p_zf = p[36]
    p_zt = p[37]
    p_fa = p[38]
    c0 = p_e - p_ea
    c1 = p_zf - p_fa
    c2 = 0.5*p_rr
    c3 = 0.5*p_ss
    c4 = 0.5*p_e
    c5 = 0.5*p_zf
    q_beta = y[0]
    q_Theta = y[1]
    q_gamma = y[2]
    q_Phi = y[3]
    q_delta = y[4]
    q_Omega = y[5]
    q_eps = y[6]
    x0 = cos(q_beta)
    x1 = sin(q_beta)
    x2 = -x1
    x3 = p_rr*x0
    x4 = q_beta + q_Theta
    x5 = cos(x4)
    x6 = p_rr*x1
    x7 = sin(x4)
    x8 = -x7
    x9 = cos(q_gamma)
    x10 = sin(q_gamma)
    x11 = cos(q_delta)
    x12 = p_xa + p_zt*x11
    x13 = q_Phi + q_delta
    x14 = sin(x13)
    x15 = sin(q_delta)
    x16 = p_ya + p_zt*x15
    x17 = cos(x13)
    x18 = -x15
    x19 = sin(q_eps)
    x20 = p_xa + p_u*x19
    x21 = q_Omega + q_eps
    x22 = cos(x21)
    x23 = cos(q_eps)
    x24 = p_ya - p_u*x23
    x25 = sin(x21)
    x26 = -x25
    x27 = q_gamma + -1.5707963267948966
    x28 = cos(x27)
    x29 = sin(x27)
    x30 = p_sd*x9 + (p_xb + p_sc*x10)
    x31 = p_yb + p_sd*x10 - p_sc*x9
    x32 = atan2(x31 - p_yb, x30 - p_xb)
    x33 = cos(x32)
    x34 = sin(x32)
    x35 = x13 + -1.5707963267948966
    x36 = cos(x35)
    x37 = sin(x35)
    x38 = q_eps + -1.5707963267948966
    x39 = cos(x38)
    x40 = sin(x38)
    out[0] = p_ra*x0
    out[1] = p_ra*x1
    out[2] = 0.0
    out[3] = x0
    out[4] = x2
    out[5] = 0.0
    out[6] = x1
    out[7] = x0
    out[8] = 0.0
    out[9] = 0.0
    out[10] = 0.0
    out[11] = 1.0
    out[12] = x3 - p_da*x5
    out[13] = x6 - p_da*x7
    out[14] = 0.0
    out[15] = x5
    out[16] = x8
    out[17] = 0.0
    out[18] = x7
    out[19] = x5
    out[20] = 0.0
    out[21] = 0.0
    out[22] = 0.0
    out[23] = 1.0
    out[24] = p_sb*x9 + (p_xb + p_sa*x10)
    out[25] = p_yb + p_sb*x10 - p_sa*x9
    out[26] = 0.0
    out[27] = x9
    out[28] = -x10
    out[29] = 0.0
    out[30] = x10
    out[31] = x9
    out[32] = 0.0
    out[33] = 0.0
    out[34] = 0.0
    out[35] = 1.0
    out[36] = x12 + c0*x14
    out[37] = x16 - c0*x17
    out[38] = 0.0
    out[39] = x17
    out[40] = -x14
    out[41] = 0.0
    out[42] = x14
    out[43] = x17
    out[44] = 0.0
    out[45] = 0.0
    out[46] = 0.0
    out[47] = 1.0
    out[48] = p_xa + p_ta*x11 - p_tb*x15
    out[49] = p_tb*x11 + (p_ya + p_ta*x15)
    out[50] = 0.0
    out[51] = x11
    out[52] = x18
    out[53] = 0.0
    out[54] = x15
    out[55] = x11
    out[56] = 0.0
    out[57] = 0.0
    out[58] = 0.0
    out[59] = 1.0
    out[60] = x20 + c1*x22
    out[61] = x24 + c1*x25
    out[62] = 0.0
    out[63] = x22
    out[64] = x26
    out[65] = 0.0
    out[66] = x25
    out[67] = x22
    out[68] = 0.0
    out[69] = 0.0
    out[70] = 0.0
    out[71] = 1.0
    out[72] = p_xa + p_ua*x19 - p_ub*x23
    out[73] = p_ya - p_ua*x23 - p_ub*x19
    out[74] = 0.0
    out[75] = x23
    out[76] = -x19
    out[77] = 0.0
    out[78] = x19
    out[79] = x23
    out[80] = 0.0
    out[81] = 0.0
    out[82] = 0.0
    out[83] = 1.0
    out[84] = x0*c2
    out[85] = x1*c2
    out[86] = 0.0
    out[87] = x0
    out[88] = x2
    out[89] = 0.0
    out[90] = x1
    out[91] = x0
    out[92] = 0.0
    out[93] = 0.0
    out[94] = 0.0
    out[95] = 1.0
    out[96] = 0.5*(x3 + (x3 - p_d*x5))
    out[97] = 0.5*(x6 + (x6 - p_d*x7))
    out[98] = 0.0
    out[99] = x5
    out[100] = x8
    out[101] = 0.0
    out[102] = x7
    out[103] = x5
    out[104] = 0.0
    out[105] = 0.0
    out[106] = 0.0
    out[107] = 1.0
    out[108] = p_xb + x10*c3
    out[109] = p_yb - x9*c3
    out[110] = 0.0
    out[111] = x28
    out[112] = -x29
    out[113] = 0.0
    out[114] = x29
    out[115] = x28
    out[116] = 0.0
    out[117] = 0.0
    out[118] = 0.0
    out[119] = 1.0
    out[120] = 0.5*(p_xb + x30)
    out[121] = 0.5*(p_yb + x31)
    out[122] = 0.0
    out[123] = x33
    out[124] = -x34
    out[125] = 0.0
    out[126] = x34
    out[127] = x33
    out[128] = 0.0
    out[129] = 0.0
    out[130] = 0.0
    out[131] = 1.0
    out[132] = x12 + x14*c4
    out[133] = x16 - x17*c4
    out[134] = 0.0
    out[135] = x36
    out[136] = -x37
    out[137] = 0.0
    out[138] = x37
    out[139] = x36
    out[140] = 0.0
    out[141] = 0.0
    out[142] = 0.0
    out[143] = 1.0
    out[144] = 0.5*(p_xa + x12)
    out[145] = 0.5*(p_ya + x16)
    out[146] = 0.0
    out[147] = x11
    out[148] = x18
    out[149] = 0.0
    out[150] = x15
    out[151] = x11
    out[152] = 0.0
    out[153] = 0.0
    out[154] = 0.0
    out[155] = 1.0
    out[156] = x20 + x22*c5
    out[157] = x24 + x25*c5
    out[158] = 0.0
    out[159] = x22
    out[160] = x26
    out[161] = 0.0
    out[162] = x25
    out[163] = x22
    out[164] = 0.0
    out[165] = 0.0
    out[166] = 0.0
    out[167] = 1.0
    out[168] = 0.5*(p_xa + x20)
    out[169] = 0.5*(p_ya + x24)
    out[170] = 0.0
    out[171] = x39
    out[172] = -x40
    out[173] = 0.0
    out[174] = x40
    out[175] = x39
    out[176] = 0.0
    out[177] = 0.0
    out[178] = 0.0
    out[179] = 1.0


@njit(error_model="numpy")
def shapes(t, y, p, out):
    """Sizes of the bodies' shapes. 4 operations."""
    p_d = p[20]
    p_e = p[22]
    p_rr = p[24]
    p_ss = p[26]
    p_sc = p[29]
    p_sd = p[30]
    p_u = p[33]
    p_zf = p[36]
    p_zt = p[37]
    c0 = sqrt(p_sc*p_sc + p_sd*p_sd)
    out[0] = 0.003
    out[1] = 0.003
    out[2] = 0.003
    out[3] = 0.0012
    out[4] = 0.012
    out[5] = 0.02
    out[6] = 0.001
    out[7] = 0.0012
    out[8] = 0.02
    out[9] = 0.012
    out[10] = 0.001
    out[11] = 0.0012
    out[12] = 0.008
    out[13] = 0.02
    out[14] = 0.001
    out[15] = 0.0007
    out[16] = p_rr
    out[17] = 0.0007
    out[18] = p_d
    out[19] = 0.0007
    out[20] = p_ss
    out[21] = 0.0007
    out[22] = c0
    out[23] = 0.0007
    out[24] = p_e
    out[25] = 0.0007
    out[26] = p_zt
    out[27] = 0.0007
    out[28] = p_zf
    out[29] = 0.0007
    out[30] = p_u


@njit(error_model="numpy")
def outputs(t, y, p, out):
    """Outputs. 0 operations."""
    v_beta = y[7]
    out[0] = v_beta


@njit(error_model="numpy")
def marks(t, y, p, out):
    """What a picture shows besides bodies, as `marks` lists it. 22 operations."""
    p_xa = p[14]
    p_ya = p[15]
    p_xb = p[16]
    p_yb = p[17]
    p_xc = p[18]
    p_yc = p[19]
    p_d = p[20]
    p_e = p[22]
    p_rr = p[24]
    p_ss = p[26]
    p_sc = p[29]
    p_sd = p[30]
    p_zf = p[36]
    p_zt = p[37]
    c0 = 0.5*p_rr
    c1 = -c0
    c2 = -(0.5*p_d)
    c3 = -(0.5*p_ss)
    c4 = 0.5*p_e
    c5 = -c4
    c6 = -(0.5*p_zt)
    c7 = 0.5*p_zf
    c8 = -c7
    q_gamma = y[2]
    x0 = cos(q_gamma)
    x1 = sin(q_gamma)
    out[0] = c1
    out[5] = 1.0
    out[9] = c0
    out[14] = 1.0
    out[15] = c2
    out[20] = 1.0
    out[21] = c2
    out[24] = c3
    out[29] = 1.0
    out[30] = p_xb
    out[31] = p_yb
    out[33] = c5
    out[38] = 1.0
    out[39] = c4
    out[44] = 1.0
    out[45] = c4
    out[48] = c6
    out[53] = 1.0
    out[54] = p_xa
    out[55] = p_ya
    out[57] = c8
    out[62] = 1.0
    out[63] = c7
    out[68] = 1.0
    out[69] = c7
    out[72] = p_xc
    out[73] = p_yc
    out[75] = p_sd*x0 + (p_xb + p_sc*x1)
    out[76] = p_yb + p_sd*x1 - p_sc*x0
    out[78] = p_xc
    out[79] = p_yc


@njit(error_model="numpy")
def limits(t, y, p, out):
    """Numbers of parameters that have a bound. 4 operations."""
    p_m1 = p[0]
    p_m2 = p[1]
    p_m3 = p[2]
    p_m4 = p[3]
    p_m5 = p[4]
    p_m6 = p[5]
    p_m7 = p[6]
    p_I1 = p[7]
    p_I2 = p[8]
    p_I3 = p[9]
    p_I4 = p[10]
    p_I5 = p[11]
    p_I6 = p[12]
    p_I7 = p[13]
    p_d = p[20]
    p_e = p[22]
    p_rr = p[24]
    p_ss = p[26]
    p_sc = p[29]
    p_sd = p[30]
    p_u = p[33]
    p_zf = p[36]
    p_zt = p[37]
    c0 = sqrt(p_sc*p_sc + p_sd*p_sd)
    out[0] = p_m1
    out[1] = p_I1
    out[2] = p_m2
    out[3] = p_I2
    out[4] = p_m3
    out[5] = p_I3
    out[6] = p_m4
    out[7] = p_I4
    out[8] = p_m5
    out[9] = p_I5
    out[10] = p_m6
    out[11] = p_I6
    out[12] = p_m7
    out[13] = p_I7
    out[14] = p_rr
    out[15] = p_d
    out[16] = p_ss
    out[17] = c0
    out[18] = p_e
    out[19] = p_zt
    out[20] = p_zf
    out[21] = p_u
