"""Scenes of independent subsystems: found, equal ones derived once, and the same numbers as when derived as one."""

from __future__ import annotations

import ast

import numpy as np
import pytest
from derived import execute
from lowered import assert_same_bits

from symgen import Model, cos, dot, runtime, sin
from symgen.derive import pipeline
from symgen.derive.scenes import subsystems
from symgen.derive.scenes.components import split
from symgen.emit.module import emit
from symgen.runtime.abi import array_sizes
from symgen.runtime.checks.time_scales import motion_jacobian, time_scales
from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.errors import ModuleError


def pendulum(m: Model, k: int, g, length=0.5, extra=0.0):
    """A damped pendulum of its own length and mass."""
    l, mass = m.parameters(**{f"l{k}": length, f"m{k}": 0.1 + 0.01 * k})
    theta = m.coordinate(f"theta{k}", start=0.2 * k, rate=0.1)
    m.body(f"bob{k}", mass=mass, com=(l * sin(theta), -l * cos(theta)), shape={"sphere": [0.1 * l]})
    m.dissipation(0.01 * dot(theta) ** 2 * (1 + extra))
    return theta


def bead(m: Model, k: int, c):
    """A point mass on a circle in Cartesian coordinates, pushed by a shared input."""
    r = m.parameter(f"r{k}", 1.0 + 0.1 * k)
    x = m.coordinate(f"x{k}", guess=0.6)
    y = m.coordinate(f"y{k}", guess=-0.8)
    m.definition(f"radius{k}", (x**2 + y**2) ** 0.5)
    m.body(f"bead{k}", mass=0.3, com=(x, y))
    m.constraint(f"circle{k}", f"radius{k} - r{k}")
    m.force(x, c * r)
    return x, y


def mixed() -> Model:
    """Two kinds in no regular order, a third of its own; outputs, events and resets across them."""
    m = Model("mixed")
    g, push = m.parameter("g", 9.81), m.input("push", default=0.4)
    m.gravity(y=-g)
    a = pendulum(m, 1, g)
    x, _ = bead(m, 1, push)
    b = pendulum(m, 2, g, 0.7)
    pendulum(m, 3, g, 0.9)
    bead(m, 2, push)
    s = m.coordinate("s", start=1.0)
    m.kinetic(dot(s) ** 2 / 2)
    m.potential(2 * s**2)
    m.force(s, 3 * m.parameter("ramp", 0.1) * push)
    m.output("gap", x - 2 * a)
    m.output("speed", dot(x * b))
    m.event("meets", a - b, then="record")
    m.event("hits", s, direction="falling", then={"reset": {"dot(s)": -0.5 * dot(s)}})
    return m


def regular(n: int = 4) -> Model:
    m = Model("regular")
    g = m.parameter("g", 9.81)
    m.gravity(y=-g)
    for k in range(1, n + 1):
        pendulum(m, k, g, 0.3 + 0.1 * k)
    m.event("stop", "theta1", then={"reset": {"dot(theta1)": "-dot(theta1)"}})
    return m


def tops() -> Model:
    """Spinning bodies on unit quaternions, a slider, and a point that is looked at."""
    m = Model("tops", gravity=(0, 0, -9.81))
    for k in range(3):
        m.body(f"top{k}", mass=1.0, com=(0, 0, m.parameter(f"h{k}", 0.3)), inertia=(0.1, 0.2, 0.15))
        m.joint(
            f"tip{k}", "spherical", child=f"top{k}", origin={"xyz": [m.parameter(f"at{k}", 1.0 * k), 0, 0]}
        )
    m.body("block", mass=2.0)
    m.joint("rail", "prismatic", child="block", axis=(1, 0, 0), stiffness=5.0)
    m.point("head", "top1", (0.0, 0.1, 0.6))
    m.output("height", "head_z - rail")
    return m


MODELS = {f.__name__: f for f in (mixed, regular, tops)}


@pytest.fixture(scope="module", params=MODELS)
def scene(request):
    return MODELS[request.param]().describe()


def values(space: dict, name: str, t: float, y: np.ndarray) -> np.ndarray:
    head = space["MODEL"]
    p = [record["value"] for record in (*head["parameters"], *head["inputs"])]
    out = [0.0] * array_sizes(head, name)[1]
    space[name](t, list(y), p, out)
    return np.array(out)


def along_the_motion(jacobian: np.ndarray, N: np.ndarray) -> np.ndarray:
    """Derivatives by coordinates turned to those along the rates: across the unit sphere they may be anything."""
    nq, nv = N.shape
    rows = jacobian.reshape(nv, nq + 2 * nv)
    return np.hstack([rows[:, :nq] @ N, rows[:, nq:]])


def states(head: dict, name: str, rng: np.random.Generator) -> np.ndarray:
    y = rng.uniform(0.1, 0.9, array_sizes(head, name)[0])
    for k in head["quaternions"]:
        y[k : k + 4] /= np.linalg.norm(y[k : k + 4])
    return y


def test_the_same_numbers_as_derived_as_one(scene):
    apart, whole = emit(subsystems.derive(scene)), emit(pipeline.derive(scene))
    apart_space, whole_space = execute(apart), execute(whole)
    a, b = apart_space["MODEL"], whole_space["MODEL"]
    assert len(a["subsystems"]) >= 1 and "for k in range(" in apart
    for key in b:
        if key not in ("operations", "hoisted", "subsystems"):
            assert a[key] == b[key], key
    assert set(a["operations"]) == set(b["operations"])
    rng = np.random.default_rng(3)
    for name in a["operations"]:
        for _ in range(2):
            y = states(a, name, rng)
            found, expected = (values(space, name, 0.3, y) for space in (apart_space, whole_space))
            if name == "residual_jacobian" and a["quaternions"]:
                N = values(whole_space, "kinematics", 0.3, y)[: a["nq"] * a["nv"]].reshape(a["nq"], a["nv"])
                found, expected = (along_the_motion(x, N) for x in (found, expected))
            np.testing.assert_allclose(found, expected, rtol=1e-11, atol=1e-12, err_msg=name)


def test_machine_code_is_the_text(scene):
    system = runtime.load(emit(subsystems.derive(scene)))
    head, p = system.source.header, system.parameter_values()
    rng = np.random.default_rng(4)
    precomputed = system.precomputed(p)
    for name in system.source.functions:
        y, kernel = states(head, name, rng), system.kernel(name)
        expected = np.zeros(kernel.out_size)
        system.python_function(name)(0.3, y.tolist(), p.tolist(), expected)
        assert_same_bits(kernel(0.3, y, p), expected)
        out = np.zeros(kernel.out_size)
        call_kernel(kernel.precomputed_address, 0.3, y, precomputed, out)
        assert_same_bits(out, expected)


def test_numba_agrees():
    system = runtime.load(emit(subsystems.derive(mixed().describe())))
    assert system.source.tables
    p, y = system.parameter_values(), np.linspace(0.2, 0.8, system.nq + system.nv)
    for name in ("rhs", "constraint_jacobian"):
        out = np.zeros(system.kernel(name).out_size)
        system.njit_function(name)(0.1, y, p, out)
        assert_same_bits(out, system.kernel(name)(0.1, y, p))


def names(kinds) -> list[list[list[str]]]:
    return [[[c.name for c in one.description.coordinates] for one in kind] for kind in kinds]


def test_subsystems_are_found():
    assert names(split(mixed().describe())) == [
        [["theta1"], ["theta2"], ["theta3"]],
        [["x1", "y1"], ["x2", "y2"]],
        [["s"]],
    ]


@pytest.mark.parametrize(
    ("couple", "together"),
    [
        (lambda m: m.constraint("rod", "theta1 - theta2"), 2),
        (lambda m: m.velocity_constraint("gear", "dot(theta1) - 2*dot(theta2)"), 2),
        (lambda m: m.potential("theta1*theta3"), 2),
        (lambda m: m.dissipation("(dot(theta1) - dot(theta2))^2"), 2),
        (lambda m: m.force("theta1", "theta2"), 2),
        (lambda m: m.load("pull", point=("theta1", "0"), force=("theta2", "theta3")), 3),
        (lambda m: m.load("twist", point=("l1*theta1", "0"), force=("1", "0")), 1),
        (lambda m: m.body("both", mass=1, com=("theta1", "theta2")), 2),
        (lambda m: m.event("e", "theta1", then={"reset": {"dot(theta2)": 0}}), 2),
        (lambda m: m.event("e", "theta1 - theta2"), 1),
        (lambda m: m.output("o", "theta1*theta2*theta3"), 1),
        (lambda m: (m.definition("d", "theta1 + theta2"), m.potential("d*theta3")), 3),
        (lambda m: m.definition("d", "theta1 + theta2"), 1),
    ],
)
def test_what_couples_and_what_only_looks(couple, together):
    m = Model("three")
    m.gravity(y="-9.81")
    for k in (1, 2, 3):
        pendulum(m, k, None)
    couple(m)
    sizes = sorted(len(one) for kind in names(split(m.describe())) for one in kind)
    assert sizes == {1: [1, 1, 1], 2: [1, 2], 3: [3]}[together]


@pytest.mark.parametrize(
    ("change", "kinds"),
    [
        ({"length": 2.0}, 1),  # a parameter's value
        ({"extra": 1.0}, 2),  # a number in an expression
    ],
)
def test_what_makes_a_kind(change, kinds):
    m = Model("two")
    m.gravity(y="-9.81")
    pendulum(m, 1, None)
    pendulum(m, 2, None, **change)
    assert len(split(m.describe())) == kinds


def test_what_looks_at_the_world_alone_has_its_points():
    """A point and an axis of the world that no subsystem has need of."""
    m = regular(2)
    m.point("peg", at=(0.3, m.parameter("height", 0.4)))
    m.axis("slope", direction=(3, 4))
    m.output("seen", "theta1 + peg_x + 10*peg_y + 100*slope_y + theta2")
    assert len(split(m.describe())[0]) == 2
    run = m.derive().run(t_end=0.2, parameters={"height": 0.5})
    assert run["seen"] == pytest.approx(run["theta1"] + run["theta2"] + 405.3, rel=1e-14)


def test_elements_without_coordinates_go_with_the_first():
    m = regular(3)
    m.body("floor", mass=5.0, com=(0.0, -2.0), shape={"box": [1, 1, 1]})
    d = m.describe()
    assert [len(kind) for kind in split(d)] == [1, 2]
    apart, whole = execute(emit(subsystems.derive(d))), execute(emit(pipeline.derive(d)))
    y = np.linspace(0.1, 0.6, 6)
    for name in ("energy", "poses", "rhs"):
        np.testing.assert_allclose(values(apart, name, 0.0, y), values(whole, name, 0.0, y), rtol=1e-13)


def test_the_header_says_which_coordinates_belong_together():
    head = execute(emit(subsystems.derive(mixed().describe())))["MODEL"]
    assert [kind["coordinates"] for kind in head["subsystems"]] == [[[0], [3], [4]], [[1, 2], [5, 6]], [[7]]]
    assert [kind["constraints"] for kind in head["subsystems"]] == [[[], [], []], [[0], [1]], [[]]]
    assert execute(emit(subsystems.derive(regular(1).describe())))["MODEL"]["subsystems"] == []


def test_code_does_not_grow_with_the_number():
    few, many = (subsystems.derive(regular(n).describe()) for n in (3, 30))
    functions = [
        [
            text for text in emit(program).split("@njit")[1:] if "def limits(" not in text
        ]  # in loops once it is long
        for program in (few, many)
    ]
    *_, reset = functions[1]
    assert "def reset_stop" in reset and reset.count("\n") < 16
    for a, b in zip(*(texts[:-1] for texts in functions), strict=True):
        assert a.count("\n") == b.count("\n")
    assert many.operations()["rhs"] > 9 * few.operations()["rhs"]


def test_operations_are_those_that_run():
    """Counted on the text: each line as often as its loop runs."""
    program = subsystems.derive(mixed().describe())
    for function in ast.parse(emit(program)).body:
        if isinstance(function, ast.FunctionDef):
            assert executed(function.body) == program.operations()[function.name], function.name


def executed(statements: list[ast.stmt]) -> int:
    total = 0
    for statement in statements:
        if isinstance(statement, ast.For):
            total += statement.iter.args[0].value * executed(statement.body)
        elif isinstance(statement, ast.Assign):
            nodes = [statement.value] if not isinstance(statement.value, ast.Subscript) else []
            while nodes:
                node = nodes.pop()
                negative_number = isinstance(node, ast.UnaryOp) and isinstance(node.operand, ast.Constant)
                total += (
                    isinstance(node, (ast.BinOp, ast.UnaryOp, ast.Call, ast.IfExp)) and not negative_number
                )
                nodes += [x for x in ast.iter_child_nodes(node) if isinstance(x, (ast.expr, ast.Compare))]
    return total


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('"rates": [[0], [3], [4]]', '"rates": [[0], [3], [3]]'),
        ('"rates": [[0], [3], [4]]', '"rates": [[0], [3, 4]]'),
        ('"coordinates": [[0], [3], [4]]', '"coordinates": [0, 3, 4]'),
        ('"constraints": [[0], [1]]', '"constraints": [[0], [2]]'),
        ('"constraints": [[0], [1]]', '"constraints": [["0"], [1]]'),
    ],
)
def test_subsystems_that_cannot_be_are_refused(old, new):
    text = emit(subsystems.derive(mixed().describe()))
    assert old in text
    with pytest.raises(ModuleError, match="subsystems"):
        runtime.load(text.replace(old, new))


def test_time_scales_are_those_of_the_whole():
    system = runtime.load(emit(subsystems.derive(regular(6).describe())))
    p, (q, v, *_) = system.parameter_values(), system.initial_state()
    whole = np.linalg.eigvals(motion_jacobian(system, p, 0.0, q, v))
    assert time_scales(system, p, 0.0, q, v).fastest == pytest.approx(np.abs(whole).max(), rel=1e-12)


def test_a_scene_runs_as_its_members_do():
    many = regular(3).derive().run(t_end=0.7, rtol=1e-11, atol=1e-13)
    for k in (1, 2, 3):
        m = Model("one", gravity=(0, -9.81))
        pendulum(m, k, None, 0.3 + 0.1 * k)
        if k == 1:
            m.event("stop", "theta1", then={"reset": {"dot(theta1)": "-dot(theta1)"}})
        alone = m.derive().run(t_end=0.7, rtol=1e-11, atol=1e-13)
        assert many[f"theta{k}"][-1] == pytest.approx(alone[f"theta{k}"][-1], abs=1e-9)
