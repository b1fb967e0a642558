"""Joints, points and axes: names, orders, defaults, energies, and the round trip through TOML."""

import math
import re
from pathlib import Path

import numpy as np
import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from symgen import Model, dot
from symgen.errors import ModelError
from symgen.link import derive
from symgen.model import algebra
from symgen.model.evaluate import exact_angle, normalised, perpendiculars
from symgen.model.from_sympy import to_sympy
from symgen.model.joint_types import TYPES
from symgen.model.toml_reader import read_text

OPTIONS = {"pitch": 0.1, "sequence": "zxz"}

ARM = """
name = "arm"

[parameters]
l = "0.4 m"
k = "2 N*m"
h = { value = 0.5, unit = "rad" }

[constants]
lean = "30 deg"

[coordinates]
q1 = { unit = "rad", start = "20 deg" }

[bodies.fore]
mass = "1 kg"
com = [0, 0, "l/2"]
inertia = [0.02, 0.02, 0.002]

[bodies.upper]
mass = "2 kg"
com = [0, 0, "l/2"]
inertia = [0.02, 0.02, 0.002]

[bodies.ball]
mass = "0.5 kg"
inertia = [1e-3, 1e-3, 1e-3]

[joints.elbow]
type = "revolute"
parent = "upper"
child = "fore"
origin = { xyz = [0, 0, "l"], rpy = ["h", 1.5707963, "-90 deg"] }
axis = ["sin(lean)", 0, "cos(lean)"]
stiffness = "k"
damping = "0.1 N*m*s"
rest = "10 deg"
armature = "0.01 kg*m^2"
limits = ["-90 deg", "h"]
start = "5 deg"
rate = "60 rpm"

[joints.shoulder]
type = "revolute"
child = "upper"
axis = [0, 2, 0]
coordinate = "q1"

[joints.float]
type = "free"
child = "ball"
start = [0, 0, "10 cm", 0.7072, 0.7072, 0, 0]
rate = [0, 0, 1, 0, 0, "2 rpm"]
damping = [1, 1, 1, 0.1, 0.1, 0.1]

[points.tip]
body = "fore"
at = [0, 0, "l"]

[axes.finger]
body = "fore"
direction = [0, 0, 1]

[gravity]
z = "-9.81 m/s^2"

[forces]
float_wx = "-0.1*float_wx"
float_x = "3 N"

[outputs]
speed = "dot(tip_x)"
leans = "finger_z"
turns = "dot(float_qw)"

[events.floor]
when = "tip_z"
then = { reset = { "dot(float_x)" = "-dot(float_x)", float_wx = 0 } }
"""


def _arm_in_python():
    m = Model("arm", gravity=(0, 0, "-9.81 m/s^2"))
    l, k, h = m.parameters(l="0.4 m", k="2 N*m", h={"value": 0.5, "unit": "rad"})
    lean = m.constant("lean", "30 deg")
    q1 = m.coordinate("q1", unit="rad", start="20 deg")
    elbow = m.joint(
        "elbow", "revolute", "fore", "upper",
        origin={"xyz": (0, 0, l), "rpy": (h, math.pi / 2, "-90 deg")},
        axis=(sympy.sin(lean), 0, sympy.cos(lean)),
        stiffness=k, damping="0.1 N*m*s", rest="10 deg", armature="0.01 kg*m^2", limits=("-90 deg", h),
        start="5 deg", rate="60 rpm",
    )  # fmt: skip
    m.joint("shoulder", "revolute", "upper", axis=(0, 1, 0), coordinate=q1)
    m.joint(
        "float",
        type="free",
        child="ball",
        start=(0, 0, "0.1 m", 0.5**0.5, 0.5**0.5, 0, 0),
        rate=[0, 0, 1, 0, 0, math.pi / 15],
        damping=[1, 1, 1, 0.1, 0.1, 0.1],
    )
    m.body("fore", mass="1 kg", com=(0, 0, l / 2), inertia=(0.02, 0.02, 0.002))
    m.body("upper", mass="2 kg", com=(0, 0, l / 2), inertia=(0.02, 0.02, 0.002))
    m.body("ball", mass="0.5 kg", inertia=(1e-3, 1e-3, 1e-3))
    assert elbow == sympy.Symbol("elbow")
    tip = m.point("tip", "fore", at=(0, 0, l))
    finger = m.axis("finger", "fore", (0, 0, 1))
    m.force("float_wx", -0.1 * sympy.Symbol("float_wx"))
    m.force("float_x", "3 N")
    m.output("speed", dot(tip[0]))
    m.output("leans", finger[2])
    m.output("turns", "dot(float_qw)")
    m.event("floor", tip[2], then={"reset": {"dot(float_x)": "-dot(float_x)", "float_wx": 0}})
    return m


def test_toml_and_python_say_the_same():
    d, e = read_text(ARM).describe(), _arm_in_python().describe()
    for name in (
        "parameters",
        "constants",
        "points",
        "axes",
        "loops",
        "outputs",
        "events",
        "gravity",
        "potential",
    ):
        assert str(getattr(d, name)) == str(getattr(e, name)), name
    for a, b in zip((*d.coordinates, *d.rates), (*e.coordinates, *e.rates), strict=True):
        assert (a.name, a.unit) == (b.name, b.unit)
        assert (a.start is None) == (b.start is None)
        assert (a.start or 0.0) == pytest.approx(b.start or 0.0, abs=1e-15)
    for a, b in zip(d.joints, e.joints, strict=True):
        assert a.axis == pytest.approx(b.axis, abs=1e-15)
        assert (a.xyz, a.rpy, a.coordinates, a.rates) == (b.xyz, b.rpy, b.coordinates, b.rates)


def test_order_of_q_and_v():
    d = read_text(ARM).describe()
    assert [c.name for c in d.coordinates] == [
        "q1", "elbow", "float_x", "float_y", "float_z", "float_qw", "float_qx", "float_qy", "float_qz",
    ]  # fmt: skip
    assert [(r.name, r.coordinate, r.unit) for r in d.rates] == [
        ("q1", "q1", "rad/s"),
        ("elbow", "elbow", "rad/s"),
        ("float_vx", "float_x", "m/s"),
        ("float_vy", "float_y", "m/s"),
        ("float_vz", "float_z", "m/s"),
        ("float_wx", None, "rad/s"),
        ("float_wy", None, "rad/s"),
        ("float_wz", None, "rad/s"),
    ]
    assert [c.quaternion for c in d.coordinates] == [None] * 5 + ["float"] * 4
    assert [c.rate for c in d.coordinates][5:] == [None] * 4
    assert [j.name for j in d.joints] == ["shoulder", "elbow", "float"]


def test_values_in_si_and_normalised():
    d = read_text(ARM).describe()
    values = {c.name: c.start for c in d.coordinates} | {f"dot {r.name}": r.start for r in d.rates}
    assert values["elbow"] == pytest.approx(math.radians(5), rel=1e-15)
    assert values["dot elbow"] == pytest.approx(2 * math.pi, rel=1e-15)
    assert values["float_z"] == 0.1
    assert values["float_qw"] == values["float_qx"] == pytest.approx(0.5**0.5, rel=1e-15)
    assert values["dot float_wz"] == pytest.approx(2 * 2 * math.pi / 60, rel=1e-15)
    shoulder, elbow, _ = d.joints
    assert shoulder.axis == (0.0, 1.0, 0.0)
    assert elbow.axis == pytest.approx((0.5, 0.0, 0.75**0.5), abs=1e-15)
    assert elbow.rpy == (sympy.Symbol("h"), sympy.pi / 2, -sympy.pi / 2)


def test_energies_of_springs_and_dampers():
    d = read_text(ARM).describe()
    k, q = sympy.symbols("k elbow")
    rest = math.radians(10)
    assert float(to_sympy(d.potential).subs({k: 3.0, q: 0.7})) == pytest.approx(
        1.5 * (0.7 - rest) ** 2, rel=1e-14
    )
    rates = {dot(q): 2.0} | {sympy.Symbol(f"float_{n}"): 3.0 for n in ("vx", "vy", "vz", "wx", "wy", "wz")}
    assert float(to_sympy(d.kinetic).subs(rates)) == pytest.approx(0.02, rel=1e-14)
    assert float(to_sympy(d.dissipation).subs(rates)) == pytest.approx(0.2 + 3 * 4.5 + 3 * 0.45, rel=1e-14)


def test_limits_are_events():
    d = read_text(ARM).describe()
    found = {e.name: (e.direction, e.action, e.when) for e in d.events}
    q, h = sympy.symbols("elbow h")
    assert list(found) == ["floor", "elbow_lower", "elbow_upper"]
    assert found["elbow_upper"] == ("rising", "record", q - h)
    direction, action, when = found["elbow_lower"]
    assert (direction, action) == ("falling", "record")
    assert float(to_sympy(when).subs(q, -math.pi / 2)) == pytest.approx(0, abs=1e-15)


def test_forces_and_resets_go_by_rates():
    d = read_text(ARM).describe()
    assert [name for name, _ in d.forces] == ["float_wx", "float_vx"]
    assert [(r.target, r.is_rate) for r in d.events[0].resets] == [("float_vx", True), ("float_wx", True)]


def test_child_without_com_has_it_in_its_origin():
    d = read_text(ARM).describe()
    assert {b.name: b.com for b in d.bodies}["ball"] == (0, 0, 0)
    m = Model("flat")
    m.body("rod", inertia=1)
    m.joint("pin", "revolute", "rod")
    d = m.describe()
    assert (d.bodies[0].com, d.bodies[0].planar, d.joints[0].axis) == ((0, 0), True, (0.0, 0.0, 1.0))


def test_round_trip():
    model = read_text(ARM)
    text = model.to_toml()
    again = read_text(text)
    assert again.describe() == model.describe()
    assert again.to_toml() == text
    assert 'stiffness = "k"' in text
    assert "potential" not in text and "elbow_lower" not in text
    python = _arm_in_python()
    assert read_text(python.to_toml()).to_toml() == python.to_toml()


@pytest.mark.parametrize("type", TYPES)
def test_names_that_joints_make(type):
    m = Model("m")
    m.body("b", mass=1, com=(0.1, 0.2, 0.3), inertia=(1, 2, 3))
    made = m.joint("j", type, "b", **{key: OPTIONS[key] for key in TYPES[type].options})
    if type == "fixed":
        assert made == ()
        return
    d = m.describe()
    names = {
        "revolute": ("j", "j"), "continuous": ("j", "j"), "prismatic": ("j", "j"),
        "screw": ("j", "j"),
        "universal": ("j_1 j_2", "j_1 j_2"),
        "cylindrical": ("j_angle j_slide", "j_angle j_slide"),
        "planar": ("j_x j_y j_angle", "j_x j_y j_angle"),
        "spherical": ("j_qw j_qx j_qy j_qz", "j_wx j_wy j_wz"),
        "gimbal": ("j_1 j_2 j_3",) * 2,
        "floating": ("j_x j_y j_z j_1 j_2 j_3",) * 2,
        "free": ("j_x j_y j_z j_qw j_qx j_qy j_qz", "j_vx j_vy j_vz j_wx j_wy j_wz"),
    }[type]  # fmt: skip
    assert " ".join(c.name for c in d.coordinates) == " ".join(d.joints[0].coordinates) == names[0]
    assert " ".join(r.name for r in d.rates) == " ".join(d.joints[0].rates) == names[1]
    assert (len(d.coordinates), len(d.rates)) == (TYPES[type].nq, TYPES[type].nv)
    if TYPES[type].quaternion:
        assert [c.guess for c in d.coordinates if c.quaternion] == [1.0, 0.0, 0.0, 0.0]


def test_given_names_and_mixed_declarations():
    m = Model("m")
    x = m.coordinate("x", start=2)
    m.body("b", mass=1, com=(0, 0), inertia=1)
    assert m.joint("j", "planar", "b", coordinate=(x, "y", "phi")) == sympy.symbols("x y phi")
    d = m.describe()
    assert [(c.name, c.start, c.joint) for c in d.coordinates] == [
        ("x", 2.0, None),
        ("y", None, "j"),
        ("phi", None, "j"),
    ]
    assert d.joints[0].axis == (0.0, 0.0, 1.0)


def test_parents_come_first():
    m = Model("chain")
    names = ["a", "b", "c", "d"]
    for name in names:
        m.body(name, mass=1, com=(0, 0), inertia=1)
    for name, parent in (("d", "c"), ("b", "a"), ("c", "b"), ("a", "world")):
        m.joint(f"j{name}", "revolute", name, parent)
    d = m.describe()
    assert [j.child for j in d.joints] == names
    assert [c.name for c in d.coordinates] == ["jd", "jb", "jc", "ja"]
    assert read_text(m.to_toml()).describe() == d


def test_points_of_bodies_without_joints_and_of_the_world():
    m = Model("hand", gravity=(0, -9.81))
    phi = m.coordinate("phi")
    m.body("rod", mass=1, com=(sympy.sin(phi), -sympy.cos(phi)), inertia=0.1, angle=phi)
    m.point("end", "rod", (0, -1))
    m.point("nail", at=(0, 1, 0))
    m.output("reach", "end_x - nail_x + dot(end_y)")
    d = m.describe()
    assert [(p.name, p.body, p.at) for p in d.points] == [
        ("end", "rod", (0, -1, 0)),
        ("nail", "world", (0, 1, 0)),
    ]
    assert read_text(m.to_toml()).describe() == d


@pytest.mark.parametrize(
    ("given", "turns"),
    [
        (0, 0),
        (1.5707963, 1),
        (-1.57079633, -1),
        (3.1415927, 2),
        (9.42477796, 6),
        (1e-9, 0),
        (-4.71238898, -3),
    ],
)
def test_right_angles_are_exact(given, turns):
    assert exact_angle(algebra.Float(given), {}) == algebra.Rational(turns, 2) * algebra.pi


@pytest.mark.parametrize("given", [1.5708, 1e-6, 0.3, 3.14159])
def test_other_angles_stay(given):
    assert exact_angle(sympy.Float(given), {}) == sympy.Float(given)
    assert exact_angle(sympy.Symbol("a"), {}) == sympy.Symbol("a")


@settings(deadline=None)
@given(
    st.tuples(*[st.floats(-1e6, 1e6, allow_subnormal=False)] * 3).filter(lambda v: max(map(abs, v)) > 1e-6)
)
def test_frames_of_directions(vector):
    axis = normalised(vector)
    assert normalised(axis) == axis
    first, second = perpendiculars(axis)
    frame = np.array([axis, first, second])
    assert frame @ frame.T == pytest.approx(np.eye(3), abs=1e-14)
    assert np.linalg.det(frame) == pytest.approx(1, abs=1e-14)


numbers = st.floats(-3, 3, allow_subnormal=False)
units = st.integers(0, 2**32 - 1).map(
    lambda s: Rotation.random(random_state=s).as_quat(scalar_first=True).tolist()
)


@st.composite
def trees(draw):
    """A random tree of 3-D bodies by joints of random types, parts of which are left to their defaults."""
    m = Model("tree")
    a = m.parameter("a", draw(numbers))
    count = draw(st.integers(1, 6))
    order = draw(st.permutations(range(count)))
    for k in range(count):
        m.body(f"b{k}", mass=1, com=draw(st.sampled_from([(), (0.1, 0.2, a)])), inertia=(1, 2, 3))
    for k in order:
        parent = draw(st.sampled_from(["world", *(f"b{i}" for i in range(k))]))
        type = draw(st.sampled_from([*TYPES]) if k else st.sampled_from([t for t in TYPES if t != "fixed"]))
        kind, options = TYPES[type], {key: {**OPTIONS, "pitch": a}[key] for key in TYPES[type].options}
        if draw(st.booleans()):
            options["origin"] = {
                "xyz": draw(st.tuples(numbers, numbers, st.just(a))),
                "rpy": draw(st.tuples(*[numbers] * 3)),
            }
        if kind.axes and draw(st.booleans()):
            options["axis"] = draw(st.sampled_from([(0, 0, 1), (1, 2, 3), (0.6, -0.8, 0)]))
        if kind.nq and draw(st.booleans()):
            values = draw(st.lists(numbers, min_size=len(kind.suffixes), max_size=len(kind.suffixes)))
            options[draw(st.sampled_from(["start", "guess"]))] = values + (
                draw(units) if kind.quaternion else []
            )
        if kind.nq and draw(st.booleans()):
            key = draw(st.sampled_from(["rate", "rate_guess"]))
            options[key] = draw(st.lists(numbers, min_size=kind.nv, max_size=kind.nv))
            options["damping"] = draw(st.sampled_from([a**2, [0.5] * kind.nv]))
        if kind.elastic and draw(st.booleans()):
            options |= {"stiffness": a**2, "rest": 0.25, "armature": [1.5] * kind.nq}
        m.joint(f"j{k}", type, f"b{k}", parent, **options)
        m.point(f"p{k}", f"b{k}", (a, 0, draw(numbers)))
    return m


@settings(max_examples=40, deadline=None)
@given(trees())
def test_random_trees_round_trip(model):
    d = model.describe()
    text = model.to_toml()
    again = read_text(text)
    assert again.to_toml() == text
    assert again.describe() == d
    placed = {"world"}
    for j in d.joints:
        assert j.parent in placed
        placed.add(j.child)
    assert len(d.rates) == sum(TYPES[j.type].nv for j in d.joints)
    assert len(d.coordinates) == sum(TYPES[j.type].nq for j in d.joints)
    quaternions = [c for c in d.coordinates if c.quaternion and c.name.endswith("_qw")]
    for c in quaternions:
        elements = [
            e.guess if e.start is None else e.start for e in d.coordinates if e.quaternion == c.quaternion
        ]
        assert math.hypot(*elements) == pytest.approx(1, abs=1e-15)


def test_show_prints_the_mechanism():
    from symgen.cli.show import Text, mechanism

    model = read_text(ARM)
    model.point("home", "world", (0, 1, 0))
    model.coincident("held", "tip", "home")
    text = " ".join(
        " ".join(line for part in mechanism(model.describe(), Text()) for line in part.lines()).split()
    )
    for words in (
        "upper -> fore", "at (0, 0, l), rpy (h, pi/2, -pi/2), axis (0.5, 0, 0.8660254038)", "stiffness k",
        "in fore at (0, 0, l)", "in fore along (0, 0, 1)", "coincident points (tip, home)",
    ):  # fmt: skip
        assert words in text
    plain = Model.from_toml('[coordinates]\nx = {}\n[bodies.a]\nmass = 1\ncom = ["x", 0]')
    assert mechanism(plain.describe(), Text()) == []


def test_reading_back_a_wrong_line_says_so():
    with pytest.raises(ModelError, match=r"arm.toml, \[joints.elbow\] stifness: unknown key"):
        read_text(ARM.replace("stiffness", "stifness"), file="arm.toml")


def test_models_of_the_documentation():
    page = (Path(__file__).parents[1] / "docs" / "models.md").read_text(encoding="utf-8")
    models = re.findall(r"```toml\n(.*?)```", page, re.DOTALL)
    described = [read_text(text).describe() for text in models]
    assert [len(d.joints) for d in described] == [2, 1, 0, 1, 1, 1, 3, 0]
    assert [c.name for c in described[-2].constraints] == ["slide_1", "teeth"]
    for type in TYPES:
        assert f"`{type}`" in page


def test_zeros_and_ones_may_be_written_as_floats():
    """A float of SymPy is equal to no integer: 0.0 in a plane's z, a mass of 0.0, a ratio of 1.0 are what they are."""
    model = Model("floats", gravity=(0, -9.81))
    for k, at in enumerate((0.0, 0.3)):
        model.body(f"b{k}", mass=1.0, com=(0.1, 0.0), inertia=1.0)
        model.joint(f"j{k}", "revolute", f"b{k}", "world", {"xyz": (at, 0.0, 0.0), "rpy": (0.0, 0.0, 0.0)})
    model.body("sign", mass=0.0, com=(0.1, 0.0))
    model.joint("k", "fixed", "sign", "b0", {"xyz": (0.1, 0.0, 0.0)})
    model.gear("chain", "j0", "j1", 1.0)
    assert derive(model).nh == 1
