"""Ready-made constraints: what they hold, checked on bodies put into random places, and the round trip."""

import numpy as np
import pytest
import sympy
from scipy.spatial.transform import Rotation

from symgen import Model, cos, t
from symgen.errors import ModelError
from symgen.model.from_sympy import to_sympy
from symgen.model.toml_reader import read_text

BODIES = """
[parameters]
l = 0.7
n = 2

[bodies.a]
mass = 1
inertia = [1, 1, 1]
[bodies.b]
mass = 1
inertia = [1, 1, 1]
[joints.ja]
type = "free"
child = "a"
[joints.jb]
type = "free"
child = "b"

[points.pa]
body = "a"
at = [0.1, 0.2, 0.3]
[points.pb]
body = "b"
at = [-0.3, 0.2, 0.5]
[points.fixed]
at = [0.5, 0, 1]
"""

PLANAR = """
[parameters]
l = 0.7
[bodies.a]
mass = 1
inertia = 1
[bodies.b]
mass = 1
inertia = 1
[joints.ja]
type = "planar"
child = "a"
[joints.jb]
type = "planar"
child = "b"
[points.pa]
body = "a"
at = [0.1, 0.2]
[points.pb]
body = "b"
at = [-0.3, 0.2]
[points.fixed]
at = [0.5, 0]
"""

ALL = {
    "coincident": 'coincident = ["pa", "pb"]',
    "distance": 'distance = { points = ["pa", "pb"], length = "l" }',
    "on_line": 'point_on_line = { point = "pa", line = "pb", direction = [1, 2, -1] }',
    "on_fixed_line": 'point_on_line = { point = "pa", line = "pb", direction = [1, 2, -1], body = "world" }',
    "in_plane": 'point_in_plane = { point = "pa", plane = "pb", normal = [1, 2, -1] }',
    "parallel": 'parallel = { bodies = ["a", "b"], axes = [[1, 2, 3], [0, 1, 1]] }',
    "upright": 'parallel = { bodies = ["a", "world"], axes = [[0, 0, 1], [0, 0, 1]] }',
}


class Poses:
    """Bodies a and b in random places; values of the names that points and axes make."""

    def __init__(self, d, seed, planar=False):
        rng = np.random.default_rng(seed)
        angle = rng.uniform(-3, 3, 2)
        turn = (
            [Rotation.from_euler("z", x) for x in angle] if planar else Rotation.random(2, random_state=rng)
        )
        self.rotation = {"a": turn[0].as_matrix(), "b": turn[1].as_matrix(), "world": np.eye(3)}
        self.origin = {"a": rng.uniform(-1, 1, 3), "b": rng.uniform(-1, 1, 3), "world": np.zeros(3)}
        if planar:
            self.origin["a"][2] = self.origin["b"][2] = 0
        self.description = d
        self.at = {p.name: (p.body, np.array(p.at, float)) for p in d.points}

    def place(self, point):
        body, at = self.at[point]
        return self.origin[body] + self.rotation[body] @ at

    def residuals(self):
        values = {"l": 0.7, "n": 2.0}
        for point in self.at:
            values |= {f"{point}_{c}": x for c, x in zip("xyz", self.place(point), strict=True)}
        for axis in self.description.axes:
            world = self.rotation[axis.body] @ np.array(axis.direction, float)
            values |= {f"{axis.name}_{c}": x for c, x in zip("xyz", world, strict=True)}
        return np.array([float(to_sympy(c.expression).subs(values)) for c in self.description.constraints])

    def shift(self, point, offset):
        """Move the body of a point so that the point moves by `offset`."""
        self.origin[self.at[point][0]] = self.origin[self.at[point][0]] + offset

    def align(self, axis_a, axis_b):
        """Turn body a so that its axis is along one of body b."""
        target, axis = self.rotation["b"] @ axis_b, np.array(axis_a, float)
        turn, _ = Rotation.align_vectors([target], [axis])
        self.rotation["a"] = turn.as_matrix()


def _description(kind, bodies=BODIES):
    return read_text(f"{bodies}\n[constraints.c]\n{ALL.get(kind, kind)}\n").describe()


SEEDS = range(4)
DIRECTION = np.array([1.0, 2.0, -1.0]) / 6**0.5


@pytest.mark.parametrize("seed", SEEDS)
def test_coincident(seed):
    d = _description("coincident")
    assert [c.name for c in d.constraints] == ["c_x", "c_y", "c_z"]
    poses = Poses(d, seed)
    assert poses.residuals() == pytest.approx(poses.place("pa") - poses.place("pb"), abs=1e-14)


@pytest.mark.parametrize("seed", SEEDS)
def test_distance_is_in_units_of_length(seed):
    d = _description("distance")
    poses = Poses(d, seed)
    apart = poses.place("pa") - poses.place("pb")
    poses.shift("pa", apart * (0.7 / np.linalg.norm(apart) - 1))
    assert poses.residuals() == pytest.approx([0], abs=1e-14)
    poses.shift("pa", apart / np.linalg.norm(apart) * 1e-6)
    assert poses.residuals() == pytest.approx([1e-6], rel=1e-5)


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("kind", ["on_line", "on_fixed_line"])
def test_point_on_line(kind, seed):
    d = _description(kind)
    assert [c.name for c in d.constraints] == ["c_1", "c_2"]
    poses = Poses(d, seed)
    along = (poses.rotation["b"] if kind == "on_line" else np.eye(3)) @ DIRECTION
    apart = poses.place("pa") - poses.place("pb")
    across = apart - along * (along @ apart)
    assert np.linalg.norm(poses.residuals()) == pytest.approx(np.linalg.norm(across), rel=1e-12)
    poses.shift("pa", -across)
    assert poses.residuals() == pytest.approx([0, 0], abs=1e-14)


@pytest.mark.parametrize("seed", SEEDS)
def test_point_in_plane(seed):
    d = _description("in_plane")
    poses = Poses(d, seed)
    normal = poses.rotation["b"] @ DIRECTION
    height = normal @ (poses.place("pa") - poses.place("pb"))
    assert poses.residuals() == pytest.approx([height], abs=1e-14)


@pytest.mark.parametrize("seed", SEEDS)
def test_parallel(seed):
    d = _description("parallel")
    a, b = np.array([1, 2, 3]) / 14**0.5, np.array([0, 1, 1]) / 2**0.5
    poses = Poses(d, seed)
    sine = np.linalg.norm(np.cross(poses.rotation["a"] @ a, poses.rotation["b"] @ b))
    assert np.linalg.norm(poses.residuals()) == pytest.approx(sine, rel=1e-12)
    poses.align(a, b)
    assert poses.residuals() == pytest.approx([0, 0], abs=1e-14)


def test_parallel_to_the_world_needs_one_axis():
    d = _description("upright")
    assert [(x.name, x.body) for x in d.axes] == [("c_axis", "a")]
    poses = Poses(d, 0)
    up = poses.rotation["a"][:, 2]
    assert np.linalg.norm(poses.residuals()) == pytest.approx(np.hypot(up[0], up[1]), rel=1e-12)


def test_constraints_hold_coordinates_through_points_and_axes():
    """Without masses, a joint's coordinates are there because a constraint mentions them."""
    text = BODIES.replace("mass = 1\ninertia = [1, 1, 1]\n[joints.ja]", "mass = 0\n[joints.ja]")
    text += '[energy]\nkinetic = "dot(ja_x)^2"\n'
    with pytest.raises(ModelError, match="the coordinate 'jb_x' of this joint moves nothing that has mass"):
        read_text(text).describe()
    for kind in ("coincident", "distance", "on_line"):
        read_text(f"{text}[constraints.c]\n{ALL[kind]}").describe()


def test_parallel_needs_no_points():
    text = BODIES[: BODIES.index("[points.pa]")] + f"[constraints.c]\n{ALL['parallel']}"
    assert [x.body for x in read_text(text).describe().axes] == ["a", "b", "b"]


@pytest.mark.parametrize("seed", SEEDS)
def test_in_the_plane(seed):
    d = _description("coincident", PLANAR)
    poses = Poses(d, seed, planar=True)
    assert [c.name for c in d.constraints] == ["c_x", "c_y"]
    assert poses.residuals() == pytest.approx((poses.place("pa") - poses.place("pb"))[:2], abs=1e-14)

    d = _description('point_on_line = { point = "pa", line = "fixed", direction = [3, 4] }', PLANAR)
    assert [c.name for c in d.constraints] == ["c_1"] and not d.axes
    poses = Poses(d, seed, planar=True)
    x, y, _ = poses.place("pa") - poses.place("fixed")
    assert poses.residuals() == pytest.approx([(3 * y - 4 * x) / 5], abs=1e-14)

    d = _description('parallel = { bodies = ["a", "b"], axes = [[1, 0], [0, 1]] }', PLANAR)
    poses = Poses(d, seed, planar=True)
    a, b = poses.rotation["a"][:2, 0], poses.rotation["b"][:2, 1]
    assert [c.name for c in d.constraints] == ["c_1"]
    assert abs(poses.residuals()) == pytest.approx([abs(a[0] * b[1] - a[1] * b[0])], abs=1e-14)


def test_between_coordinates():
    m = Model("gears")
    p, q, r = (m.coordinate(x) for x in "pqr")
    n = m.parameter("n", 2)
    m.kinetic("dot(p)^2 + dot(q)^2 + dot(r)^2")
    m.constraint("plain", r - p)
    m.gear("teeth", p, "q", ratio=n, offset=0.5)
    m.motion("driven", r, cos(t))
    m.couple("cam", p - q**2)
    d = m.describe()
    assert [(c.name, c.kind, sympy.expand(c.expression)) for c in d.constraints] == [
        ("plain", "holonomic", r - p),
        ("teeth", "holonomic", p - n * q - 0.5),
        ("driven", "holonomic", r - cos(t)),
        ("cam", "holonomic", p - q**2),
    ]
    assert [x.kind for x in d.loops] == ["gear", "motion", "couple"]


def test_round_trip():
    lines = "\n".join(f"[constraints.{name}]\n{text}" for name, text in ALL.items())
    text = f"""{BODIES}
[constraints]
plain = "pa_x - 0.1"
teeth = {{ gear = {{ coordinates = ["ja_x", "jb_y"], ratio = "n", offset = "0.1*l" }} }}
same = {{ gear = {{ coordinates = ["ja_x", "jb_z"], ratio = 1 }} }}
driven = {{ motion = {{ coordinate = "ja_z", follows = "0.1*sin(t)" }} }}
cam = {{ couple = {{ expression = "ja_y - l*pb_x" }} }}
{lines}
"""
    model = read_text(text)
    d = model.describe()
    written = model.to_toml()
    assert read_text(written).describe() == d
    assert read_text(written).to_toml() == written
    assert 'coincident = ["pa", "pb"]' in written and "c_x" not in written
    assert len(d.loops) == len(ALL) + 4
    assert [c.name for c in d.constraints][:5] == ["plain", "teeth", "same", "driven", "cam"]


def test_python_makes_the_same():
    toml = read_text(
        BODIES + '[constraints.c]\ncoincident = ["pa", "fixed"]\n[constraints.d]\n' + ALL["on_line"]
    )
    m = Model("model")
    m.parameters(l=0.7, n=2)
    for name in "ab":
        m.body(name, mass=1, inertia=(1, 1, 1))
        m.joint(f"j{name}", "free", name)
    pa = m.point("pa", "a", (0.1, 0.2, 0.3))
    m.point("pb", "b", (-0.3, 0.2, 0.5))
    m.point("fixed", at=(0.5, 0, 1))
    m.coincident("c", pa, "fixed")
    m.point_on_line("d", "pa", "pb", (1, 2, -1))
    assert m.describe() == toml.describe()


def test_python_errors_name_the_method():
    m = Model("m")
    m.body("a", mass=1, inertia=(1, 1, 1))
    m.joint("ja", "free", "a")
    m.point("pa", "a")
    m.coincident("c", "pa", "pp")
    with pytest.raises(ModelError, match=r"model 'm', coincident\('c'\) element 2: there is no point 'pp'"):
        m.describe()
    with pytest.raises(
        ModelError, match=r"point_on_line\('d'\) direction: a direction cannot be of zero length"
    ):
        m.point_on_line("d", "pa", "pa", (0, 0, 0))
