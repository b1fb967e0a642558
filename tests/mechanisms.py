"""Test support: small mechanical systems that together use every part of a description."""

from __future__ import annotations

from derived import describe, expr

from symgen.model.description import Body, Constant, Description, Load

GRAVITY = ("0", "-g", "0")


def body(name: str, com, mass=None, inertia=(), angle=None, rotation=()) -> Body:
    return Body(
        name,
        expr(com),
        mass=None if mass is None else expr(mass),
        inertia=expr(inertia),
        angle=None if angle is None else expr(angle),
        rotation=tuple((axis, expr(a)) for axis, a in rotation),
    )


def load(name: str, **parts) -> Load:
    return Load(name, **{k: v if k == "body" else expr(v) for k, v in parts.items()})


def pendulum() -> Description:
    return describe(
        "pendulum",
        "theta",
        {"m": 1.2, "l": 0.7, "g": 9.81},
        bodies=(body("bob", ("l*sin(theta)", "-l*cos(theta)"), "m"),),
        gravity=GRAVITY,
    )


def cart_pole() -> Description:
    return describe(
        "cart_pole",
        "x theta",
        {"M": 1.3, "m": 0.2, "l": 0.6, "g": 9.81, "c": 0.1},
        inputs={"F": 0.8},
        bodies=(body("cart", ("x", "0"), "M"), body("bob", ("x + l*sin(theta)", "l*cos(theta)"), "m")),
        gravity=GRAVITY,
        forces={"x": "F - c*dot(x)", "theta": "c*x*sin(t)"},
    )


def double_pendulum() -> Description:
    return describe(
        "double_pendulum",
        "a b",
        {"m": 1.2, "J": 0.05, "l": 0.7, "g": 9.81},
        constants=(Constant("half", 0.5),),
        definitions={"x1": "l*sin(a)", "y1": "-l*cos(a)"},
        bodies=(
            body("upper", ("half*x1", "half*y1"), "m", ("J",), "a"),
            body(
                "lower", ("x1 + half*l*sin(a + b)", "y1 - half*l*cos(a + b)"), "2*m", ("J + 0.01",), "a + b"
            ),
        ),
        gravity=GRAVITY,
    )


def spring_pendulum() -> Description:
    return describe(
        "spring_pendulum",
        "r theta",
        {"m": 0.5, "k": 30.0, "l": 0.4, "g": 9.81, "c": 0.3},
        kinetic="m/2*(dot(r)**2 + (l + r)**2*dot(theta)**2)",
        potential="k*r**2/2 - m*g*(l + r)*cos(theta)",
        dissipation="c/2*dot(r)**2 + c/4*dot(r*theta)**2*(1 + r**2)",
    )


def free_text() -> Description:
    """Kinetic energies of every form: products, cross terms, functions of q and t, linear in the rates."""
    return describe(
        "free_text",
        "x y w",
        {"m": 1.1, "J": 0.4, "b": 0.7},
        definitions={"s": "x*cos(y) + w", "u": "(dot(x) + dot(y))/2", "u2": "(dot(y) + dot(x))/2"},
        kinetic="m/2*dot(x)**2*(2 + x**2) + J*dot(x)*dot(y)*cos(y) + m*dot(s)**2 + (u + u2)**2*J"
        " + m*(dot(w) + 2*dot(x))*(dot(w) - dot(y)/3) + 3*J*dot(y)**2"
        " + b*x*dot(w) + b*t*y*dot(x) + m*dot(w*t)**2/9",
        potential="exp(x)*w**2 + atan2(x, 2 + y)*b + sqrt(2 + x)*sin(t)",
    )


def relativistic() -> Description:
    return describe(
        "relativistic",
        "x y",
        {"m": 1.0, "c": 3.0},
        kinetic="-m*c**2*sqrt(1 - (dot(x)**2 + dot(y)**2)/c**2) + 0.1*dot(x)**4",
        potential="x**2 + x*y + y**4",
    )


def top() -> Description:
    """Heavy top on its tip: z-x-z angles, a full inertia tensor, the centre of mass off the axis."""
    return describe(
        "top",
        "psi theta phi",
        {"m": 0.9, "l": 0.3, "A": 0.02, "B": 0.025, "C": 0.012, "d": 0.003, "g": 9.81},
        bodies=(
            body(
                "top",
                ("l*sin(theta)*sin(psi)", "-l*sin(theta)*cos(psi)", "l*cos(theta)"),
                "m",
                ("A", "B", "C", "d", "-d/2", "2*d"),
                rotation=(("z", "psi"), ("x", "theta"), ("z", "phi")),
            ),
        ),
        gravity=("0", "0", "-g"),
    )


def driven_gyroscope() -> Description:
    """Three dimensions with explicit time in rotation and position, a torque and a force in world axes."""
    return describe(
        "driven_gyroscope",
        "alpha beta x",
        {"m": 0.9, "A": 0.02, "B": 0.03, "C": 0.05, "d": 0.004, "Omega": 2.0, "k": 3.0},
        inputs={"u": 0.3},
        bodies=(
            body(
                "rotor",
                ("x*cos(Omega*t)", "x*sin(Omega*t) + 0.2*cos(beta)", "0.1*alpha*t"),
                "m",
                ("A", "B", "C", "d", "d/3", "-d/5"),
                rotation=(("z", "Omega*t + x"), ("y", "alpha"), ("x", "2*beta + t**2")),
            ),
        ),
        gravity=("0.3", "0", "-9.81"),
        potential="k*x**2/2",
        loads=(
            load("motor", body="rotor", torque=("u", "0.2*sin(t)", "-0.1*dot(alpha)")),
            load(
                "wind",
                point=("x*cos(Omega*t)", "x*sin(Omega*t)", "0.3*sin(alpha)"),
                force=("0.4", "-u*x", "t"),
            ),
        ),
    )


def moving_pivot() -> Description:
    return describe(
        "moving_pivot",
        "theta",
        {"m": 1.2, "J": 0.03, "l": 0.7, "g": 9.81, "A": 0.2, "w": 5.0},
        bodies=(
            body(
                "rod",
                ("A*sin(w*t) + l*sin(theta)", "A*cos(w*t)/3 - l*cos(theta)"),
                "m",
                ("J",),
                "theta + 0.4*t",
            ),
        ),
        gravity=GRAVITY,
    )


def planar_loads() -> Description:
    return describe(
        "planar_loads",
        "x y phi",
        {"m": 1.2, "J": 0.03, "c": 0.2},
        inputs={"u": 0.5},
        bodies=(body("plate", ("x", "y"), "m", ("J",), "phi"),),
        loads=(
            load(
                "thruster",
                point=("x + 0.3*cos(phi)", "y + 0.3*sin(phi)"),
                force=("-u*sin(phi)", "u*cos(phi)"),
            ),
            load("belt", point=("x - 0.2*t", "y"), force=("-c*(dot(x) - 0.2)", "0")),
            load("motor", body="plate", torque=("u - c*dot(phi)",)),
        ),
        potential="x**2 + 2*y**2*cos(t)",
    )


def slider_crank() -> Description:
    """Redundant coordinates; the piston x has no inertia of its own."""
    return describe(
        "slider_crank",
        "theta phi x",
        {"r": 0.1, "l": 0.3, "m": 1.0, "J": 1e-3, "c": 0.1, "k": 20.0, "g": 9.81},
        inputs={"torque": 0.4},
        constants=(Constant("x0", 0.35),),
        definitions={"pin_x": "r*cos(theta) + l*cos(phi)"},
        bodies=(
            body("rod", ("r*cos(theta) + l/2*cos(phi)", "r*sin(theta) + l/2*sin(phi)"), "m", ("J",), "phi"),
        ),
        gravity=GRAVITY,
        kinetic="1/2*J*dot(theta)**2",
        potential="k*(x - x0)**2/2",
        dissipation="c/2*dot(theta)**2",
        forces={"theta": "torque"},
        constraints={"pin_x_closes": "pin_x - x", "pin_y_closes": "r*sin(theta) + l*sin(phi)"},
    )


def four_bar() -> Description:
    links = [("a", "0.2", "0", "0"), ("b", "0.5", "0.2*cos(a)", "0.2*sin(a)"), ("c", "0.4", "0.45", "0")]
    return describe(
        "four_bar",
        "a b c",
        {"m": 0.5, "J": 0.004, "g": 9.81},
        bodies=tuple(
            body(f"link_{q}", (f"{x} + {l}/2*cos({q})", f"{y} + {l}/2*sin({q})"), f"m*{l}", (f"J*{l}",), q)
            for q, l, x, y in links
        ),
        gravity=GRAVITY,
        constraints={
            "close_x": "0.2*cos(a) + 0.5*cos(b) - 0.45 - 0.4*cos(c)",
            "close_y": "0.2*sin(a) + 0.5*sin(b) - 0.4*sin(c)",
        },
    )


def rolling_disc() -> Description:
    """Upright disc that rolls and steers on an inclined plane: two velocity constraints."""
    return describe(
        "rolling_disc",
        "x y psi phi",
        {"m": 0.5, "R": 0.2, "I": 0.01, "K": 0.006, "g": 9.81},
        bodies=(body("disc", ("x", "y", "R"), "m", ("K", "I", "K"), rotation=(("z", "psi"), ("y", "phi"))),),
        gravity=("0.5*g", "0", "-0.8*g"),
        velocity_constraints={
            "no_slip_x": "dot(x) - R*cos(psi)*dot(phi)",
            "no_slip_y": "dot(y) - R*sin(psi)*dot(phi)",
        },
    )


def rheonomic() -> Description:
    """A bead on a rope that is drawn in, on a belt: explicit time in constraints of both kinds."""
    return describe(
        "rheonomic",
        "x y s",
        {"m": 0.5, "M": 0.8, "L": 1.0, "rate": 0.3, "g": 9.81},
        bodies=(body("bead", ("x", "y"), "m"), body("belt", ("s", "-2"), "M")),
        gravity=GRAVITY,
        constraints={"rope": "x**2 + y**2 - (L - rate*sin(2*t))**2"},
        velocity_constraints={"belt_speed": "dot(s) - x*dot(y) - rate*cos(t)"},
    )


FREE = (
    pendulum, cart_pole, double_pendulum, spring_pendulum, free_text, relativistic, top, driven_gyroscope,
    moving_pivot, planar_loads,
)  # fmt: skip
CONSTRAINED = {  # with a position near which the constraints hold
    slider_crank: (0.5, -0.16, 0.38),
    four_bar: (1.1, 0.5, 1.3),
    rolling_disc: (0.1, -0.2, 0.4, 0.8),
    rheonomic: (0.5, -0.6, 0.2),
}
CONSERVATIVE = (pendulum, double_pendulum, top, four_bar, rolling_disc)
