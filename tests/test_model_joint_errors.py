"""Wrong joints, points, axes and ready-made constraints: each is refused with the place, the cause and the remedy."""

import pytest

from symgen import Model
from symgen.errors import ModelError
from symgen.model.toml_reader import JOINT_KEYS, read_text

GOOD = """
[parameters]
l = 1

[coordinates]
q = {}

[bodies.a]
mass = 1
inertia = [1, 1, 1]

[bodies.b]
mass = 1
inertia = [1, 1, 1]

[joints.ja]
type = "spherical"
child = "a"

[joints.jb]
type = "revolute"
child = "b"
parent = "a"
coordinate = "q"

[points.p]
body = "b"

[points.w]
"""
BALL, HINGE, POINT, END = 'child = "a"', 'coordinate = "q"', "[points.p]", "[points.w]"
THIRD = "[bodies.c]\nmass = 1\ninertia = [1, 1, 1]"
ALIGNED = 'parallel = { bodies = ["a", "b"], axes = [[1, 0, 0], [1, 0, 0]] }'
LAST = "[bodies.b]\nmass = 1\ninertia = [1, 1, 1]"


def added(place, text):
    """The line of GOOD at `place` with a line behind it."""
    return place, f"{place}\n{text}"


# name: ((what is replaced, by what), table, key, words of the message or hint)
WRONG = {
    "misspelt type": (('"spherical"', '"sperical"'), "joints.ja", "type", "did you mean 'spherical'"),
    "no type": (('type = "spherical"', ""), "joints.ja", "type", "type of the joint is missing"),
    "misspelt key": (added(BALL, "strat = 1"), "joints.ja", "strat", "did you mean 'start'"),
    "no child": ((BALL, ""), "joints.ja", "child", "the name of a body"),
    "unknown child": ((BALL, 'child = "aa"'), "joints.ja", "child", "did you mean 'a'"),
    "unknown parent": (('parent = "a"', 'parent = "wrld"'), "joints.jb", "parent", "did you mean 'world'"),
    "world as child": ((BALL, 'child = "world"'), "joints.ja", "child", "swap parent and child"),
    "two joints of a child": ((BALL, 'child = "b"'), "joints.jb", "child", "by [constraints]"),
    "cycle": (added(BALL, 'parent = "b"'), "joints.ja", "parent", "cycle of the bodies a -> b -> a"),
    "own parent": (added(BALL, 'parent = "a"'), "joints.ja", "parent", "cycle of the bodies a -> a"),
    "needless axis": (added(BALL, "axis = [0, 0, 1]"), "joints.ja", "axis", "a spherical joint has no 'axis'"),
    "needless second axis": (added(HINGE, "axis2 = [0, 0, 1]"), "joints.jb", "axis2", "has no 'axis2'"),
    "spring of a ball": (added(BALL, "stiffness = 1"), "joints.ja", "stiffness", "has no 'stiffness'"),
    "limits of a ball": (added(BALL, "limits = [0, 1]"), "joints.ja", "limits", "has no 'limits'"),
    "continuous limits": (
        ('type = "revolute"', 'type = "continuous"\nlimits = [0, 1]'), "joints.jb", "limits", "a revolute joint",
    ),
    "start of a fixed joint": (
        ('type = "spherical"', 'type = "fixed"\nstart = 1'), "joints.ja", "start", "a fixed joint has no 'start'",
    ),
    "short quaternion": (added(BALL, "start = [1, 0, 0]"), "joints.ja", "start", "4 components"),
    "long quaternion": (added(BALL, "start = [2, 0, 0, 0]"), "joints.ja", "start", "length 2, not 1"),
    "zero quaternion": (added(BALL, "start = [0, 0, 0, 0]"), "joints.ja", "start", "length 0, not 1"),
    "rate of a quaternion": (added(BALL, "rate = [0, 0, 0, 1]"), "joints.ja", "rate", "3 components"),
    "start and guess": (
        added(BALL, "start = [1, 0, 0, 0]\nguess = [1, 0, 0, 0]"), "joints.ja", "guess", "both given",
    ),
    "too few names": (added(BALL, 'coordinate = ["x", "y"]'), "joints.ja", "coordinate", "has 4 coordinates"),
    "declared quaternion": (
        added(BALL, 'coordinate = ["q", "x", "y", "z"]'), "joints.ja", "coordinate", "is made by the joint",
    ),
    "bad name": ((HINGE, 'coordinate = "sin"'), "joints.jb", "coordinate", "is a function"),
    "start given twice": (added(HINGE, "start = 1"), "joints.jb", "start", "is given where it is declared"),
    "shared coordinate": (
        added(HINGE, f'{THIRD}\n[joints.jc]\ntype = "prismatic"\nchild = "c"\n{HINGE}'),
        "joints.jc", "coordinate", "belongs to the joint 'jb' already",
    ),
    "coordinate of another unit": (("q = {}", 'q = { unit = "m" }'), "joints.jb", "coordinate", "declared in m"),
    "zero axis": (added(HINGE, "axis = [0, 0, 0]"), "joints.jb", "axis", "zero length"),
    "text axis": (added(HINGE, 'axis = "z"'), "joints.jb", "axis", "a list of 2 or 3"),
    "axis of a parameter": (added(HINGE, 'axis = [0, 0, "l"]'), "joints.jb", "axis, element 3", "constants"),
    "parallel axes": (
        ('type = "spherical"', 'type = "universal"\naxis = [1, 1, 0]\naxis2 = [-2, -2, 0]'),
        "joints.ja", "axis2", "are parallel",
    ),
    "rest without spring": (added(HINGE, "rest = 1"), "joints.jb", "rest", "no effect without 'stiffness'"),
    "limits swapped": (added(HINGE, "limits = [1, 0]"), "joints.jb", "limits", "not below"),
    "negative armature": (added(HINGE, "armature = -1"), "joints.jb", "armature", "negative"),
    "origin as list": (added(HINGE, "origin = [0, 0, 1]"), "joints.jb", "origin", "a table of 'xyz' and 'rpy'"),
    "origin key": (added(HINGE, "origin = { xzy = [1, 0, 0] }"), "joints.jb", "origin.xzy", "'xyz'"),
    "origin that moves": (
        added(HINGE, 'origin = { xyz = ["q", 0, 0] }'), "joints.jb", "origin.xyz, element 1", "parameters and",
    ),
    "stiffness of another unit": (added(HINGE, 'stiffness = "2 N/m"'), "joints.jb", "stiffness", "J ("),
    "damping of another unit": (added(HINGE, 'damping = "2 N*m"'), "joints.jb", "damping", "is expected"),
    "xyz of another unit": (
        added(HINGE, 'origin = { xyz = ["1 m", 0, "2 s"] }'), "joints.jb", "origin.xyz, element 3", "is in s",
    ),
    "unit of another kind": (
        (HINGE, 'unit = "m"'), "joints.jb", "unit", "does not fit a coordinate in rad",
    ),
    "rate's name taken": (("q = {}", "q = {}\nja_wx = {}"), "joints.ja", None, "'ja_wx', which is taken"),
    "point's name taken": (("q = {}", "q = {}\np_z = {}"), "points.p", None, "'p_z', which is taken"),
    "rotation of a child": (
        (LAST, LAST + '\nrotation = [["z", "q"]]'), "bodies.b", "rotation", "the joint 'jb' places this body",
    ),
    "angle of a child": ((LAST, LAST + '\nangle = "q"'), "bodies.b", "angle", "the joint 'jb' places this body"),
    "com that moves": ((LAST, LAST + '\ncom = ["q", 0, 0]'), "bodies.b", "com, element 1", "own frame"),
    "plane on space": (
        (LAST, "[bodies.b]\nmass = 1\ninertia = 1"), "joints.jb", "parent", "its parent 'a' is 3-D",
    ),
    "moves nothing": ((LAST, "[bodies.b]\nmass = 1"), "joints.jb", "child", "moves nothing that has mass"),
    "moves no mass": ((LAST, "[bodies.b]\nmass = 0"), "joints.jb", "child", "moves nothing that has mass"),
    "mass at a point's place": (
        (LAST, '[bodies.b]\nmass = "p_x"\ninertia = [1, 1, 1]'), "bodies.b", "mass", "the place of a point or axis",
    ),
    "body at a point": (
        added(POINT, '[definitions]\nd = "p_x"\n[bodies.h]\nmass = 1\ncom = ["d", 0, 0]\n[points.r]'),
        "bodies.h", "com, element 1", "through 'd'",
    ),
    "body named world": (("[bodies.b]", "[bodies.world]"), "bodies.world", None, "the fixed frame"),
    "potential with the speed of a point": (
        added(END, '[energy]\npotential = "dot(p_x)"'), "energy", "potential", "cannot depend on a rate",
    ),
    "acceleration": (added(END, '[outputs]\no = "dot(ja_wx)"'), "outputs", "o", "'ja_wx' is a rate"),
    "rate in a constraint": (added(END, '[constraints]\nc = "ja_wx"'), "constraints", "c", "velocity_constraints"),
    "component of a point": (added(END, '[outputs]\no = "p_w"'), "outputs", "o", "did you mean 'p_"),
    "force on a quaternion": (added(END, "[forces]\nja_qw = 1"), "forces", "ja_qw", "such as 'ja_wx'"),
    "force on nothing": (added(END, "[forces]\nja_wq = 1"), "forces", "ja_wq", "did you mean 'ja_w"),
    "reset of a quaternion": (
        added(END, '[events.e]\nwhen = "p_x"\nthen = { reset = { ja_qw = 1 } }'),
        "events.e", "then.reset.ja_qw", "such as 'ja_wx'",
    ),
    "derivative of a rate reset": (
        added(END, '[events.e]\nwhen = "p_x"\nthen = { reset = { "dot(ja_wx)" = 1 } }'),
        "events.e", "then.reset.dot(ja_wx)", "no coordinate 'ja_wx'",
    ),
    "limits' event taken": (
        (HINGE, HINGE + '\nlimits = [0, 1]\n[events.jb_upper]\nwhen = "q"'), "joints.jb", "limits", "'jb_upper'",
    ),
    "point on nothing": (('body = "b"', 'body = "c"'), "points.p", "body", "there is no body 'c'"),
    "point that moves": (added('body = "b"', 'at = ["q", 0, 0]'), "points.p", "at, element 1", "parameters"),
    "axis of another length": (
        added(END, '[axes.u]\nbody = "a"\ndirection = [1]'), "axes.u", "direction", "2 or 3 components",
    ),
    "no direction": (added(END, '[axes.u]\nbody = "a"'), "axes.u", "direction", "0 are given"),
    "misspelt constraint": (
        added(END, '[constraints.c]\ncoincidnt = ["p", "w"]'), "constraints.c", "coincidnt", "'coincident'",
    ),
    "two kinds": (
        added(END, '[constraints.c]\ncoincident = ["p", "w"]\ncouple = { expression = "q" }'),
        "constraints.c", None, "2 are given",
    ),
    "unknown point": (
        added(END, '[constraints.c]\ncoincident = ["p", "v"]'), "constraints.c", "coincident, element 2", "point 'v'",
    ),
    "one point": (added(END, '[constraints.c]\ncoincident = ["p"]'), "constraints.c", "coincident", "2 components"),
    "same body": (
        added(END, '[constraints.c]\ncoincident = ["p", "p"]'), "constraints.c", "coincident", "holds nothing",
    ),
    "no length": (
        added(END, '[constraints.c]\ndistance = { points = ["p", "w"] }'),
        "constraints.c", "distance.length", "missing",
    ),
    "negative length": (
        added(END, '[constraints.c]\ndistance = { points = ["p", "w"], length = "-l" }'),
        "constraints.c", "distance.length", "not positive",
    ),
    "driven quaternion": (
        added(END, '[constraints.c]\nmotion = { coordinate = "ja_qw", follows = 1 }'),
        "constraints.c", "motion.coordinate", "quaternion of the joint 'ja'",
    ),
    "constraint on a quaternion's length": (
        added(END, '[constraints]\nc = "ja_qw^2 + ja_qx^2 + ja_qy^2 + ja_qz^2 - l"'),
        "constraints", "c", "kept at unit length",
    ),
    "motion that follows a coordinate": (
        added(END, '[constraints.c]\nmotion = { coordinate = "q", follows = "2*q" }'),
        "constraints.c", "motion.follows", "hold expressions of coordinates at zero by 'couple'",
    ),
    "motion with a rate": (
        added(END, '[constraints.c]\nmotion = { coordinate = "q", follows = "dot(p_x)" }'),
        "constraints.c", "motion.follows", "rate",
    ),
    "axes of nothing": (
        added(END, '[constraints.c]\nparallel = { bodies = ["a", "v"], axes = [[1, 0, 0], [1, 0, 0]] }'),
        "constraints.c", "parallel.bodies, element 2", "no body 'v'",
    ),
    "constraint's name taken": (
        added(END, '[constraints.c]\ncoincident = ["p", "w"]\n[velocity_constraints]\nc_x = "dot(q)"'),
        "constraints.c", None, "constraint 'c_x', which is taken",
    ),
    "axis' name taken": (
        added(END, f"[definitions]\nc_axis_x = 1\n[constraints.c]\n{ALIGNED}"),
        "constraints.c", None, "'c_axis_x', which is taken",
    ),
}  # fmt: skip


def test_the_model_that_is_made_wrong_is_right():
    assert len(read_text(GOOD).describe().joints) == 2


@pytest.mark.parametrize("case", WRONG, ids=list(WRONG))
def test_wrong_model(case):
    (old, new), table, key, words = WRONG[case]
    assert old in GOOD
    with pytest.raises(ModelError) as caught:
        read_text(GOOD.replace(old, new, 1), file="ball.toml").describe()
    error = caught.value
    assert (error.file, error.table, error.key) == ("ball.toml", table, key)
    assert words in str(error)


PLANAR = """
[bodies.a]
mass = 1
inertia = 1
[joints.j]
type = "revolute"
child = "a"
"""


@pytest.mark.parametrize(
    ("text", "key", "words"),
    [
        ("axis = [1, 0, 0]", "axis", "the axis is not z"),
        ("origin = { xyz = [0, 0, 1] }", "origin.xyz, element 3", "not zero"),
        ("origin = { rpy = [0, 1, 0] }", "origin.rpy, element 2", "not zero"),
    ],
)
def test_planar_bodies_stay_in_the_plane(text, key, words):
    with pytest.raises(ModelError, match=words) as caught:
        read_text(PLANAR + text).describe()
    assert (caught.value.table, caught.value.key) == ("joints.j", key)


@pytest.mark.parametrize("type", ["spherical", "free", "universal", "cylindrical"])
def test_types_that_leave_the_plane(type):
    with pytest.raises(ModelError, match=f"would leave the x-y plane: the joint is {type}"):
        read_text(PLANAR.replace("revolute", type)).describe()


def test_directions_between_planar_bodies():
    text = PLANAR + '[points.p]\nbody = "a"\n[points.w]\n[constraints.c]\n'
    line = 'point_on_line = { point = "p", line = "w", direction = [0, 1, 1] }'
    with pytest.raises(ModelError, match="between planar bodies a direction has no z component"):
        read_text(text + line).describe()


def test_points_between_planar_bodies():
    points = '[points.p]\nbody = "a"\nat = [1, 0, {}]\n[points.w]\nat = [0, 0, {}]\n'
    line = '[constraints.c]\ncoincident = ["p", "w"]'
    assert len(read_text(PLANAR + points.format(0, 0) + line).describe().constraints) == 2
    with pytest.raises(ModelError, match="point of the planar body 'a' has no z component"):
        read_text(PLANAR + points.format(1, 0) + line).describe()
    with pytest.raises(ModelError, match="the point 'w' is not in the x-y plane"):
        read_text(PLANAR + points.format(0, 1) + line).describe()


def test_force_on_both_names_of_a_degree_of_freedom():
    text = '[bodies.a]\nmass = 1\ninertia = [1, 1, 1]\n[joints.j]\ntype = "free"\nchild = "a"\n[forces]\n'
    with pytest.raises(ModelError, match="'j_vx' and 'j_x' are one degree of freedom"):
        read_text(text + "j_x = 1\nj_vx = 2").describe()


def test_declared_coordinate_of_the_joint_s_name():
    (j,) = read_text(PLANAR + "[coordinates]\nj = { start = 0.5 }").describe().coordinates
    assert (j.start, j.joint) == (0.5, None)


JUNK = [
    "1",
    "nan",
    '""',
    '"x y"',
    "true",
    "[]",
    "[1, [2]]",
    '["a", 1, {}]',
    "{}",
    "{ a = 1 }",
    "1979-05-27",
    '"1 m"',
]


@pytest.mark.parametrize("key", JOINT_KEYS)
@pytest.mark.parametrize("junk", JUNK)
def test_junk_is_refused_or_read(key, junk):
    """Nothing that TOML can say makes the reader fail in another way than by a `ModelError` or not at all."""
    lines = {"type": '"universal"', "parent": '"world"', "child": '"b"'} | {key: junk}
    joint = "\n".join(f"{k} = {v}" for k, v in lines.items())
    for text in (joint, joint.replace("universal", "free"), joint.replace("universal", "prismatic")):
        try:
            read_text(f"[bodies.b]\nmass = 1\ninertia = [1, 1, 1]\n[joints.j]\n{text}").describe()
        except ModelError as error:
            assert error.table and error.table.startswith(("joints", "bodies"))


@pytest.mark.parametrize("junk", JUNK)
def test_junk_among_points_and_constraints(junk):
    places = (
        f"[points.p]\nat = {junk}", f"[points.p]\nbody = {junk}", f"[points]\np = {junk}",
        f"[axes.p]\ndirection = {junk}", f"[constraints.c]\ncoincident = {junk}",
        f"[constraints.c]\ndistance = {junk}", f"[constraints.c]\nmotion = {junk}",
        f"[constraints.c]\nmotion = {{ coordinate = {junk}, follows = {junk} }}", f"[constraints.c]\nnothing = {junk}",
        f"[constraints.c]\nparallel = {{ bodies = {junk}, axes = {junk} }}",
        f"[constraints.c]\ngear = {{ coordinates = {junk}, ratio = 1 }}",
        f'[constraints.c]\npoint_on_line = {{ point = "p", line = {junk}, direction = {junk}, body = {junk} }}',
    )  # fmt: skip
    for place in places:
        with pytest.raises(ModelError):
            read_text(
                f'{place}\n[bodies.b]\nmass = -1\ninertia = [1, 1, 1]\n[joints.j]\ntype = "free"\nchild = "b"'
            ).describe()


def test_a_screw_needs_a_pitch_and_others_have_none():
    for type, options, text in (
        ("screw", {}, "needs a 'pitch'"),
        ("revolute", {"pitch": 0.1}, "a revolute joint has no 'pitch'"),
        ("screw", {"pitch": "2 s"}, "pitch"),
    ):
        m = Model("m")
        m.body("b", mass="1 kg", com=(0, 0, 0), inertia=(1, 1, 1))
        with pytest.raises(ModelError, match=text):
            m.joint("j", type, "b", **options)
            m.describe()
