"""door_stop: equations of motion, written by symgen 0.1.0. Do not edit.

Door with a closer and dry friction in its hinge, thrown against a stop
"""

from math import cos, fabs, sin

from numba import njit

MODEL = {
    "abi": 1,
    "generator": "symgen 0.1.0",
    "source": "sha256:89c94854ce3402ea2dab2e7ea4fe1bd2e4b0c8359c0f353a2f08e69930cd5d25",
    "name": "door_stop",
    "description": "Door with a closer and dry friction in its hinge, thrown against a stop",
    "nq": 1,
    "nv": 1,
    "nh": 0,
    "nn": 0,
    "nw": 1,
    "coordinates": [
        {"name": "angle", "unit": "rad", "value": 0.2, "enforced": True},
    ],
    "quaternions": [],
    "rates": [
        {"name": "angle", "unit": "rad/s", "value": 2.5, "enforced": True},
    ],
    "parameters": [
        {"name": "m", "unit": "kg", "value": 20.0, "doc": ""},
        {"name": "w", "unit": "m", "value": 0.9, "doc": "width of the door"},
        {"name": "k", "unit": "N*m", "value": 4.0, "doc": "stiffness of the closer, per radian"},
        {"name": "c", "unit": "N*m*s", "value": 0.5, "doc": ""},
        {"name": "M", "unit": "N*m", "value": 0.6, "doc": "friction torque of the hinge"},
        {"name": "e", "unit": "", "value": 0.5, "doc": "restitution of the stop"},
        {"name": "open", "unit": "", "value": 1.6, "doc": "angle of the stop [rad]"},
    ],
    "inputs": [],
    "constants": [],
    "constraints": [],
    "outputs": [],
    "events": [
        {"name": "wall", "direction": "falling", "action": "stop"},
        {"name": "frame", "direction": "falling", "action": "stop"},
        {"name": "hinge", "direction": "falling", "action": "friction"},
    ],
    "bodies": [
        {"name": "door", "planar": True, "shape": "box", "sizes": 3, "mesh": ""},
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
        "rhs": 17,
        "mass_matrix": 7,
        "forces": 6,
        "energy": 22,
        "residual": 16,
        "residual_jacobian": 7,
        "poses": 6,
        "shapes": 0,
        "events": 2,
        "limits": 3,
        "switches": 1,
        "closed_rhs": 78,
        "closed_residual": 34,
        "closed_residual_jacobian": 13,
        "closed_constraint_residual": 7,
        "closed_constraint_jacobian": 1,
        "closed_gamma": 0,
        "closed_project": 85,
        "closed_events": 73,
    },
    "hoisted": {
        "rhs": 2,
        "mass_matrix": 2,
        "energy": 4,
        "residual": 2,
        "residual_jacobian": 2,
        "poses": 1,
        "closed_rhs": 2,
        "closed_residual": 2,
        "closed_residual_jacobian": 2,
        "closed_project": 2,
        "closed_events": 2,
    },
    "run": {
        "t_end": 12.0,
        "fps": 60.0,
    },
    "limits": [
        {"name": "bodies.door.shape.box[0]", "bound": "zero or more"},
        {"name": "bodies.door.mass", "bound": "zero or more"},
        {"name": "bodies.door.inertia", "bound": "zero or more"},
        {"name": "stops.wall.restitution", "bound": "from 0 to 1"},
        {"name": "friction.hinge.force", "bound": "zero or more"},
    ],
    "switches": [
        {"name": "wall", "kind": "stop"},
        {"name": "frame", "kind": "stop"},
        {"name": "hinge", "kind": "friction"},
    ],
    "subsystems": [],
}

@njit(error_model="numpy")
def rhs(t, y, p, out):
    """State derivative: rates, accelerations, power. 17 operations."""
    p_m = p[0]
    p_w = p[1]
    p_k = p[2]
    p_c = p[3]
    p_M = p[4]
    c0 = 0.5*p_w
    c1 = 1.0/(p_w*p_w*(0.08333333333333333*p_m) + p_m*(c0*c0))
    q_angle = y[0]
    v_angle = y[1]
    s_hinge_sense = p[10]
    x0 = p_M*s_hinge_sense + v_angle*p_c
    out[0] = v_angle
    out[1] = -(c1*(x0 + q_angle*p_k))
    out[2] = -(v_angle*x0)


@njit(error_model="numpy")
def mass_matrix(t, y, p, out):
    """Mass matrix M, row by row. 7 operations."""
    p_m = p[0]
    p_w = p[1]
    c0 = 0.5*p_w
    c1 = p_w*p_w*(0.08333333333333333*p_m) + p_m*(c0*c0)
    out[0] = c1


@njit(error_model="numpy")
def forces(t, y, p, out):
    """Forces f of M a = f + G^T lambda. 6 operations."""
    p_k = p[2]
    p_c = p[3]
    p_M = p[4]
    q_angle = y[0]
    v_angle = y[1]
    s_hinge_sense = p[10]
    out[0] = -(p_M*s_hinge_sense + v_angle*p_c + q_angle*p_k)


@njit(error_model="numpy")
def energy(t, y, p, out):
    """Kinetic and potential energy. 22 operations."""
    p_m = p[0]
    p_w = p[1]
    p_k = p[2]
    c0 = 0.5*p_m
    c1 = 0.5*p_w
    c2 = 0.5*(p_w*p_w*(0.08333333333333333*p_m))
    c3 = 0.5*p_k
    q_angle = y[0]
    v_angle = y[1]
    x0 = c1*(v_angle*sin(q_angle))
    x1 = c1*(v_angle*cos(q_angle))
    out[0] = c0*(x0*x0 + x1*x1) + v_angle*v_angle*c2
    out[1] = q_angle*q_angle*c3


@njit(error_model="numpy")
def residual(t, y, p, out):
    """M a - f - G^T lambda, then G a - gamma. 16 operations."""
    p_m = p[0]
    p_w = p[1]
    p_k = p[2]
    p_c = p[3]
    p_M = p[4]
    c0 = 0.5*p_w
    c1 = 0.5*(p_w*p_w*(0.08333333333333333*p_m) + p_m*(c0*c0))
    q_angle = y[0]
    v_angle = y[1]
    a_angle = y[2]
    s_hinge_sense = p[10]
    x0 = a_angle*c1
    out[0] = p_M*s_hinge_sense + v_angle*p_c + q_angle*p_k + (x0 + x0)


@njit(error_model="numpy")
def residual_jacobian(t, y, p, out):
    """Residual derivatives by q, v, a, lambda. 7 operations."""
    p_m = p[0]
    p_w = p[1]
    p_k = p[2]
    p_c = p[3]
    c0 = 0.5*p_w
    c1 = p_w*p_w*(0.08333333333333333*p_m) + p_m*(c0*c0)
    out[0] = p_k
    out[1] = p_c
    out[2] = c1


@njit(error_model="numpy")
def poses(t, y, p, out):
    """Per body: position, rotation matrix (body to world). 6 operations."""
    p_w = p[1]
    c0 = 0.5*p_w
    q_angle = y[0]
    x0 = cos(q_angle)
    x1 = sin(q_angle)
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


@njit(error_model="numpy")
def shapes(t, y, p, out):
    """Sizes of the bodies' shapes. 0 operations."""
    p_w = p[1]
    out[0] = p_w
    out[1] = 0.04
    out[2] = 2.0


@njit(error_model="numpy")
def events(t, y, p, out):
    """Event functions. 2 operations."""
    p_open = p[6]
    q_angle = y[0]
    v_angle = y[1]
    s_hinge_sense = p[10]
    out[0] = p_open - q_angle
    out[1] = q_angle
    out[2] = v_angle*s_hinge_sense


@njit(error_model="numpy")
def limits(t, y, p, out):
    """Numbers of parameters that have a bound. 3 operations."""
    p_m = p[0]
    p_w = p[1]
    p_M = p[4]
    p_e = p[5]
    c0 = p_w*p_w*(0.08333333333333333*p_m)
    out[0] = p_w
    out[1] = p_m
    out[2] = c0
    out[3] = p_e
    out[4] = p_M


@njit(error_model="numpy")
def switches(t, y, p, out):
    """Gaps and restitutions of stops; speeds, levels and largest levels of frictions. 1 operation."""
    p_M = p[4]
    p_e = p[5]
    p_open = p[6]
    q_angle = y[0]
    v_angle = y[1]
    out[0] = p_open - q_angle
    out[1] = p_e
    out[2] = q_angle
    out[3] = p_e
    out[4] = v_angle
    out[5] = p_M
    out[6] = p_M


@njit(error_model="numpy")
def closed_rhs(t, y, p, out):
    """State derivative: rates, accelerations, power, multipliers, pivot ratio. 78 operations."""
    p_m = p[0]
    p_w = p[1]
    p_k = p[2]
    p_c = p[3]
    p_M = p[4]
    c0 = 0.5*p_w
    c1 = 1.0/(p_w*p_w*(0.08333333333333333*p_m) + p_m*(c0*c0))
    q_angle = y[0]
    v_angle = y[1]
    s_wall_closed = p[7]
    s_frame_closed = p[8]
    s_hinge_stuck = p[9]
    s_hinge_sense = p[10]
    x0 = s_wall_closed*c1
    x1 = 1.0/(1.0 - s_wall_closed + s_wall_closed*x0)
    x2 = p_M*s_hinge_sense + v_angle*p_c
    x3 = x2 + q_angle*p_k
    x4 = x0*x3
    x5 = s_frame_closed*x0
    x6 = x5*x1
    x7 = s_frame_closed*c1
    x8 = 1.0 - s_frame_closed + s_frame_closed*x7
    x9 = x5*x6 - x8
    x10 = 1.0/x9
    x11 = x7*x3 - x6*x4
    x12 = s_hinge_stuck*x0
    x13 = x12*x6 - s_hinge_stuck*x7
    x14 = x13*x10
    x15 = x12*x1
    x16 = s_hinge_stuck*c1
    x17 = 1.0 - s_hinge_stuck + s_hinge_stuck*x16
    x18 = x12*x15 - x17 - x13*x14
    x19 = 1.0/x18*(x16*x3 - x15*x4 - x14*x11)
    x20 = x10*x11 - x14*x19
    x21 = x1*x4 + x6*x20 + x15*x19
    x22 = -(x18/x17)
    x23 = -(x9/x8)
    x24 = (x23 if x23 < 1.0 else 1.0)
    out[0] = v_angle
    out[1] = x0*x21 - c1*x3 - x7*x20 - x16*x19
    out[2] = -(v_angle*x2)
    out[3] = -x21
    out[4] = -x20
    out[5] = -x19
    out[6] = (x22 if x22 < x24 else x24)


@njit(error_model="numpy")
def closed_residual(t, y, p, out):
    """M a - f - G^T lambda, then G a - gamma. 34 operations."""
    p_m = p[0]
    p_w = p[1]
    p_k = p[2]
    p_c = p[3]
    p_M = p[4]
    c0 = 0.5*p_w
    c1 = 0.5*(p_w*p_w*(0.08333333333333333*p_m) + p_m*(c0*c0))
    q_angle = y[0]
    v_angle = y[1]
    a_angle = y[2]
    lam_wall = y[3]
    lam_frame = y[4]
    lam_hinge = y[5]
    s_wall_closed = p[7]
    s_frame_closed = p[8]
    s_hinge_stuck = p[9]
    s_hinge_sense = p[10]
    x0 = a_angle*c1
    x1 = lam_frame*s_frame_closed - lam_wall*s_wall_closed + lam_hinge*s_hinge_stuck
    x2 = p_M*s_hinge_sense + v_angle*p_c + q_angle*p_k + (x0 + x0) - x1
    out[0] = x2
    out[1] = lam_wall*(1.0 - s_wall_closed) - a_angle*s_wall_closed
    out[2] = a_angle*s_frame_closed + lam_frame*(1.0 - s_frame_closed)
    out[3] = a_angle*s_hinge_stuck + lam_hinge*(1.0 - s_hinge_stuck)


@njit(error_model="numpy")
def closed_residual_jacobian(t, y, p, out):
    """Residual derivatives by q, v, a, lambda. 13 operations."""
    p_m = p[0]
    p_w = p[1]
    p_k = p[2]
    p_c = p[3]
    c0 = 0.5*p_w
    c1 = p_w*p_w*(0.08333333333333333*p_m) + p_m*(c0*c0)
    s_wall_closed = p[7]
    s_frame_closed = p[8]
    s_hinge_stuck = p[9]
    out[0] = p_k
    out[1] = p_c
    out[2] = c1
    out[3] = s_wall_closed
    out[4] = -s_frame_closed
    out[5] = -s_hinge_stuck
    out[8] = -s_wall_closed
    out[9] = 1.0 - s_wall_closed
    out[14] = s_frame_closed
    out[16] = 1.0 - s_frame_closed
    out[20] = s_hinge_stuck
    out[23] = 1.0 - s_hinge_stuck


@njit(error_model="numpy")
def closed_constraint_residual(t, y, p, out):
    """Position residuals, velocity residuals. 7 operations."""
    p_open = p[6]
    q_angle = y[0]
    v_angle = y[1]
    s_wall_closed = p[7]
    s_frame_closed = p[8]
    s_hinge_stuck = p[9]
    out[0] = s_wall_closed*(p_open - q_angle)
    out[1] = q_angle*s_frame_closed
    out[2] = -(v_angle*s_wall_closed)
    out[3] = v_angle*s_frame_closed
    out[4] = v_angle*s_hinge_stuck


@njit(error_model="numpy")
def closed_constraint_jacobian(t, y, p, out):
    """Constraint Jacobian G, row by row. 1 operation."""
    s_wall_closed = p[7]
    s_frame_closed = p[8]
    s_hinge_stuck = p[9]
    out[0] = -s_wall_closed
    out[1] = s_frame_closed
    out[2] = s_hinge_stuck


@njit(error_model="numpy")
def closed_gamma(t, y, p, out):
    """Right-hand side of G a = gamma. 0 operations."""
    out[0] = 0.0
    out[1] = 0.0
    out[2] = 0.0


@njit(error_model="numpy")
def closed_project(t, y, p, out):
    """State moved onto the constraints, and the residuals it had. 85 operations."""
    p_m = p[0]
    p_w = p[1]
    p_open = p[6]
    c0 = 0.5*p_w
    c1 = 1.0/(p_w*p_w*(0.08333333333333333*p_m) + p_m*(c0*c0))
    q_angle = y[0]
    v_angle = y[1]
    s_wall_closed = p[7]
    s_frame_closed = p[8]
    s_hinge_stuck = p[9]
    x0 = s_wall_closed*c1
    x1 = s_wall_closed*(p_open - q_angle)
    x2 = 1.0/(1.0 - s_wall_closed + s_wall_closed*x0)
    x3 = s_frame_closed*x0
    x4 = x3*x2
    x5 = s_frame_closed*c1
    x6 = 1.0/(x3*x4 - (1.0 - s_frame_closed + s_frame_closed*x5))
    x7 = q_angle*s_frame_closed
    x8 = x7 + x1*x4
    x9 = s_hinge_stuck*x0
    x10 = x9*x4 - s_hinge_stuck*x5
    x11 = x10*x6
    x12 = x9*x2
    x13 = s_hinge_stuck*c1
    x14 = 1.0/(x9*x12 - (1.0 - s_hinge_stuck + s_hinge_stuck*x13) - x10*x11)
    x15 = x14*(x11*x8 - x1*x12)
    x16 = x6*x8 + x11*x15
    x17 = v_angle*s_wall_closed
    x18 = v_angle*s_frame_closed
    x19 = x17*x4 - x18
    x20 = v_angle*s_hinge_stuck
    x21 = x14*(x17*x12 - x20 - x11*x19)
    x22 = x6*x19 - x11*x21
    x23 = v_angle + (x0*(x4*x22 - x17*x2 + x12*x21) - x5*x22 - x13*x21)
    out[0] = q_angle + (x0*(x1*x2 - x4*x16 + x12*x15) + x5*x16 - x13*x15)
    out[1] = x23
    out[2] = x1
    out[3] = x7
    out[4] = -x17
    out[5] = x18
    out[6] = x20


@njit(error_model="numpy")
def closed_events(t, y, p, out):
    """Event functions. 73 operations."""
    p_m = p[0]
    p_w = p[1]
    p_k = p[2]
    p_c = p[3]
    p_M = p[4]
    p_open = p[6]
    c0 = 0.5*p_w
    c1 = 1.0/(p_w*p_w*(0.08333333333333333*p_m) + p_m*(c0*c0))
    q_angle = y[0]
    v_angle = y[1]
    s_wall_closed = p[7]
    s_frame_closed = p[8]
    s_hinge_stuck = p[9]
    s_hinge_sense = p[10]
    x0 = 1.0 - s_wall_closed
    x1 = s_wall_closed*c1
    x2 = 1.0/(x0 + s_wall_closed*x1)
    x3 = p_M*s_hinge_sense + v_angle*p_c + q_angle*p_k
    x4 = x1*x3
    x5 = s_frame_closed*x1
    x6 = x5*x2
    x7 = 1.0 - s_frame_closed
    x8 = s_frame_closed*c1
    x9 = 1.0/(x5*x6 - (x7 + s_frame_closed*x8))
    x10 = x8*x3 - x6*x4
    x11 = s_hinge_stuck*x1
    x12 = x11*x6 - s_hinge_stuck*x8
    x13 = x12*x9
    x14 = x11*x2
    x15 = 1.0 - s_hinge_stuck
    x16 = s_hinge_stuck*c1
    x17 = 1.0/(x11*x14 - (x15 + s_hinge_stuck*x16) - x12*x13)*(x16*x3 - x14*x4 - x13*x10)
    x18 = x9*x10 - x13*x17
    x19 = (p_open - q_angle)*x0 - s_wall_closed*(x2*x4 + x6*x18 + x14*x17)
    out[0] = x19
    out[1] = q_angle*x7 - s_frame_closed*x18
    out[2] = v_angle*s_hinge_sense*x15 + s_hinge_stuck*(p_M - fabs(x17))
