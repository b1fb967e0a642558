"""Tables of the state: values and derivatives against SciPy, motion over their knots, energy, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline, PchipInterpolator, RectBivariateSpline, RegularGridInterpolator

from symgen import Model, load
from symgen.errors import ModelError
from symgen.link import derive_text, module_for
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.integrate.methods import METHODS

KNOTS = [-1.0, -0.5, -0.1, 0.15, 0.4, 1.0]
VALUES = [-30.0, -8.0, -0.5, 1.0, 9.0, 40.0]


def straight(x, f):
    """Piecewise linear, with its slopes."""
    return lambda z, order=0: (
        np.interp(z, x, f)
        if not order
        else np.diff(f)[np.searchsorted(x, z, "right").clip(1, len(x) - 1) - 1]
        / np.diff(x)[np.searchsorted(x, z, "right").clip(1, len(x) - 1) - 1]
    )


SCIPY = {"linear": straight, "pchip": PchipInterpolator, "cubic": CubicSpline}


def of_one(kind, outside, x, f):
    """A mass on the curve as a force, which an output has, with the integral and the integral's derivative by time."""
    m = Model("one")
    q = m.coordinate("q")
    m.body("b", mass=1, com=(q, 0))
    curve = m.table("curve", [x, f], kind=kind, outside=outside)
    m.force(q, curve(q))
    m.output("value", curve(q))
    m.output("integral", curve.integral(q))
    area = m.definition("area", "curve_integral(q)")
    m.output("again", f"dot({area})")
    return m.derive()


@pytest.mark.parametrize("kind", SCIPY)
@pytest.mark.parametrize("outside", ["hold", "extend"])
@pytest.mark.parametrize("n", [2, 3, 4, 5, 17])
def test_curves_are_those_of_scipy(kind, outside, n):
    random = np.random.default_rng(n)
    x, f = np.cumsum(random.uniform(0.3, 1.0, n)) - 2.0, random.normal(size=n)
    system, p = of_one(kind, outside, x, f), None
    p = system.parameter_values()
    expected = (straight if n == 2 else SCIPY[kind])(x, f)
    places = np.concatenate([np.linspace(x[0], x[-1], 301), x])
    found = np.array([system.kernel("outputs")(0.0, np.array([z, 1.0]), p) for z in places])
    np.testing.assert_allclose(found[:, 0], expected(places), rtol=0, atol=3e-14 * np.abs(f).max())
    np.testing.assert_allclose(found[:, 2], found[:, 0], rtol=0, atol=1e-13)
    if kind != "linear" and n > 2:
        areas = [expected.integrate(x[0], z) for z in places]
        np.testing.assert_allclose(found[:, 1], areas, rtol=0, atol=1e-13)
    slopes = [
        -system.kernel("residual_jacobian")(0.0, np.array([z, 1.0, 0.0]), p)[0] for z in places[: -n - 1]
    ]
    np.testing.assert_allclose(slopes, expected(places[: -n - 1], 1), rtol=0, atol=1e-11)
    beyond = np.array([x[0] - 0.7, x[-1] + 0.7])
    ends = [system.kernel("outputs")(0.0, np.array([z, 1.0]), p)[:2] for z in beyond]
    steep = expected(x[[0, -1]] + [1e-13, -1e-13], 1) if outside == "extend" else np.zeros(2)
    by_hand = f[[0, -1]] + steep * [-0.7, 0.7]
    np.testing.assert_allclose(np.array(ends)[:, 0], by_hand, rtol=0, atol=1e-10)
    whole = float(found[300, 1])
    areas = np.array([0.0, whole]) + [-0.7, 0.7] * (f[[0, -1]] + by_hand) / 2.0
    np.testing.assert_allclose(np.array(ends)[:, 1], areas, rtol=0, atol=1e-10)


@pytest.mark.parametrize("kind", ["linear", "cubic"])
@pytest.mark.parametrize("shape", [(4, 5), (7, 4), (3, 6), (3, 3)])
def test_maps_are_those_of_scipy(kind, shape):
    random = np.random.default_rng(sum(shape))
    x, y = (np.cumsum(random.uniform(0.3, 1.0, n)) for n in shape)
    f = random.normal(size=shape)
    columns = np.array([*(part.ravel() for part in np.meshgrid(x, y, indexing="ij")), f.ravel()])
    m = Model("two")
    q, r = m.coordinate("q"), m.coordinate("r")
    m.body("b", mass=1, com=(q, r))
    surface = m.table("surface", columns[:, random.permutation(f.size)], kind=kind, outside="extend")
    m.force(q, surface(q, r))
    m.output("value", "surface(q, r)")
    system = m.derive()
    p = system.parameter_values()
    inside = np.array([random.uniform(axis[0], axis[-1], 200) for axis in (x, y)]).T
    found = [system.kernel("outputs")(0.0, np.array([*z, 0.0, 0.0]), p)[0] for z in inside]
    slopes = [-system.kernel("residual_jacobian")(0.0, np.array([*z, *[0.0] * 4]), p)[:2] for z in inside]
    if kind == "linear":
        expected, by_place = RegularGridInterpolator((x, y), f), None
        np.testing.assert_allclose(found, expected(inside), rtol=0, atol=1e-14 * np.abs(f).max())
    else:
        order = [min(3, n - 1) for n in shape]
        expected = RectBivariateSpline(x, y, f, kx=order[0], ky=order[1])
        np.testing.assert_allclose(found, expected.ev(*inside.T), rtol=0, atol=1e-13)
        by_place = np.array([expected.ev(*inside.T, dx=1), expected.ev(*inside.T, dy=1)]).T
        np.testing.assert_allclose(slopes, by_place, rtol=0, atol=1e-11)
    # Straight on beyond an end: by the slope there.
    place, beyond = np.array([x[-1], inside[0, 1]]), np.array([x[-1] + 0.4, inside[0, 1]])
    at = [system.kernel("outputs")(0.0, np.array([*z, 0.0, 0.0]), p)[0] for z in (place, beyond)]
    slope = -system.kernel("residual_jacobian")(0.0, np.array([x[-1] - 1e-9, place[1], *[0.0] * 4]), p)[0]
    assert at[1] == pytest.approx(at[0] + 0.4 * slope, abs=1e-7)


def spring(kind):
    m = Model("spring")
    q = m.coordinate("q", unit="m", start=0.5, rate=1.0)
    m.table("pull", [KNOTS, VALUES], kind=kind, outside="hold", units=["m", "N"])
    m.body("b", mass="1 kg", com=(q, 0))
    m.potential("pull_integral(q)")
    m.force(q, "-0.2*dot(q)")
    return m.derive()


ADAPTIVE = [name for name, record in METHODS.items() if record.adaptive]


@pytest.mark.parametrize("kind", SCIPY)
def test_a_spring_of_a_curve_by_all_adaptive_methods(kind):
    """Its energy is that of the integral; steps end at the knots. SciPy goes over them in small steps."""
    curve, system = SCIPY[kind](KNOTS, VALUES), spring(kind)
    exact = solve_ivp(
        lambda t, y: [y[1], -curve(y[0]) - 0.2 * y[1]], (0.0, 3.0), [0.5, 1.0],
        rtol=1e-12, atol=1e-13, method="DOP853", max_step=1e-3,
    ).y  # fmt: skip
    assert KNOTS[0] < exact[0].min() and exact[0].max() < KNOTS[-1]
    for method in ADAPTIVE:
        solution = system.run(t_end=3.0, method=method, rtol=1e-9, atol=1e-11)
        assert solution.method == method
        np.testing.assert_allclose(solution.states[-1], exact[:, -1], rtol=0, atol=1e-6, err_msg=method)
        assert solution.energy.max_error < 1e-5
        assert not [entry.says for entry in solution.health if not entry.ok]


@pytest.mark.parametrize("method", ["rk4", "gauss8", "implicit_midpoint", "verlet"])
def test_fixed_steps_go_over_knots(method):
    solution = spring("cubic").run(t_end=3.0, method=method, step=1e-3)
    exact = spring("cubic").run(t_end=3.0, method="dop853", rtol=1e-11, atol=1e-13)
    np.testing.assert_allclose(solution.states[-1], exact.states[-1], rtol=0, atol=1e-4)


def test_a_kink_is_passed_exactly():
    """A force of two slopes: harmonic on either side, so that the motion is put together by hand."""
    m = Model("halves")
    q = m.coordinate("q", start=1.0)
    pull = m.table("pull", [[-2, 0, 2], [-2 * 9.0, 0.0, 2 * 4.0]], outside="extend")
    m.body("b", mass=1, com=(q, 0))
    m.force(q, -pull(q))
    solution = m.derive().run(t_end=4.0, method="dop853", rtol=1e-12, atol=1e-14)
    right, left = np.pi / 2.0, np.pi / 3.0  # half periods; it starts in the middle of one
    t = solution.t
    phase = (t - right / 2.0) % (right + left)
    exact = np.where(
        t < right / 2.0,
        np.cos(2.0 * t),
        np.where(phase < left, -(2.0 / 3.0) * np.sin(3.0 * phase), np.sin(2.0 * (phase - left))),
    )
    np.testing.assert_allclose(solution["q"], exact, rtol=0, atol=1e-10)


@pytest.mark.parametrize("method", ["dop853", "radau5", "rk4"])
def test_a_run_ends_where_a_table_does(method):
    m = Model("ends")
    q = m.coordinate("q", rate=1.0)
    m.body("b", mass=1, com=(q, 0))
    m.force(q, m.table("curve", [[-1, 0, 1], [1.0, 0.0, -1.0]])(q) + 3)
    system = m.derive()
    solution = system.run(t_end=5.0, method=method, **({} if METHODS[method].adaptive else {"step": 1e-2}))
    # q'' = 3 - q from (0, 1): q = 3 - 3 cos t + sin t, which is 1 where 3 cos t - sin t = 2.
    t = np.arccos(2.0 / np.sqrt(10.0)) - np.arctan(1.0 / 3.0)
    assert solution.status == "terminated" and solution.events[-1].name == "curve_outside"
    assert solution.t[-1] == pytest.approx(t, abs=1e-6)
    with pytest.raises(RuntimeModelError, match="q leaves the table curve"):
        system.run(t_end=1.0, start={"q": 1.2})


def test_tables_of_time_alone_are_followed():
    m = Model("gust")
    q = m.coordinate("q")
    m.body("b", mass=1, com=(q, 0))
    gust = m.table("gust", [[0.0, 1.0, 1.5, 4.0], [0.0, 2.0, -1.0, 0.5]], outside="hold")
    m.force(q, "gust(t)")
    m.output("area", gust.integral("t"))
    solution = m.derive().run(t_end=3.0, method="dop853", rtol=1e-11, atol=1e-13)
    np.testing.assert_allclose(solution["dot(q)"], solution["area"], rtol=0, atol=1e-10)


def test_files_beside_a_model_and_units(tmp_path):
    rows = "\n".join(f"{x * 100}; {y / 1000}" for x, y in zip(KNOTS, VALUES))
    (tmp_path / "pull.csv").write_text(f"stretch; force\n# from the data sheet\n{rows}\n", encoding="utf-8")
    text = """
name = "spring"
[tables.pull]
file = "pull.csv"
kind = "pchip"
outside = "extend"
units = ["cm", "kN"]
[coordinates]
q = { unit = "m", start = 0.7 }
[bodies.b]
mass = "1 kg"
com = ["q", 0]
[forces]
q = "-pull(q)"
"""
    path = tmp_path / "spring.toml"
    path.write_text(text, encoding="utf-8")
    system = load(path)
    curve = PchipInterpolator(KNOTS, VALUES)
    found = system.kernel("forces")(0.0, np.array([0.3, 0.0]), system.parameter_values())[0]
    assert found == pytest.approx(-curve(0.3), rel=1e-12)
    again = Model.from_toml(path).to_toml()
    assert "[tables.pull]" in again
    (tmp_path / "again.toml").write_text(again, encoding="utf-8")
    second = load(tmp_path / "again.toml")
    p = second.parameter_values()
    assert second.kernel("forces")(0.0, np.array([0.3, 0.0]), p)[0] == pytest.approx(found, rel=1e-14)
    before = module_for(path).text
    (tmp_path / "pull.csv").write_text("0; 0\n1; 5\n", encoding="utf-8")
    assert module_for(path).text != before
    path.write_text(text.replace('"-pull(q)"', '"-pull(dot(q))"'), encoding="utf-8")
    with pytest.raises(ModelError, match=r"is in m/s, and the table 'pull' takes m"):
        Model.from_toml(path).describe()


FILES = {
    "nan": ("0, 1\n1, nan\n", "line 2.*no finite number"),
    "sorted": ("x, f\n0, 1\n2, 3\n1, 4\n", r"row 3 of .*1 follows 2"),
    "columns": ("0, 1\n1, 2, 3\n", "line 2.*3 columns, where 2"),
    "wide": ("0, 1, 2, 3\n", "4 columns, where a curve has two"),
    "grid": ("0, 0, 1\n0, 1, 2\n1, 0, 3\n", r"1 of 4 values of the map are missing, the first at \(1, 1\)"),
    "twice": ("0, 0, 1\n0, 0, 2\n1, 0, 3\n", r"row 2 of .*stands there twice"),
    "empty": ("# nothing\n", "no rows of numbers"),
    "long": ("\n".join(f"{k}, 0" for k in range(600)), "more than 512 rows"),
    "text": ("a, b\nc, d\n", "no finite number"),
}


@pytest.mark.parametrize("case", FILES)
def test_files_of_strangers_are_refused_with_the_place(case, tmp_path):
    content, says = FILES[case]
    (tmp_path / "data.csv").write_text(content, encoding="utf-8")
    with pytest.raises(ModelError, match=says) as raised:
        Model("m", folder=tmp_path).table("f", file="data.csv")
    assert "data.csv" in str(raised.value)


@pytest.mark.parametrize("file", ["../data.csv", "/etc/passwd", "a\\b.csv", "missing.csv"])
def test_files_lie_below_the_model(file, tmp_path):
    (tmp_path.parent / "data.csv").write_text("0, 1\n1, 2\n", encoding="utf-8")
    with pytest.raises(ModelError, match=r"not below the model's own folder|is not there"):
        Model("m", folder=tmp_path).table("f", file=file)


def refused(change):
    m = Model("m")
    m.coordinate("x", unit="m")
    m.coordinate("y", unit="m")
    m.body("b", mass="1 kg", com=("x", "y"))
    m.table("bent", [[0, 1], [0, 1]])
    m.table("cam", [[0, 1, 2], [0, 1, 0]], kind="cubic", units=["m", "N"])
    m.table("plane", [[0, 0, 1, 1], [0, 1, 0, 1], [1, 2, 3, 4]])
    change(m)
    m.describe()


REFUSALS = {
    "kinks": (lambda m: m.constraint("c", "y - bent(x)"), "on a table that has kinks.*velocities would jump"),
    "mass": (lambda m: m.body("c", mass="bent(1)", com=("x", 0)), "cannot depend on a table"),
    "arguments": (lambda m: m.force("x", "plane(x)"), "'plane' takes 2 arguments, not 1"),
    "unknown": (lambda m: m.force("x", "bend(x)"), "'bend' is not a function.*bent"),
    "name": (lambda m: m.force("x", "bent"), "'bent' is a function"),
    "unit": (lambda m: m.potential("cam(x)"), "units do not match"),
    "argument's unit": (lambda m: m.force("x", "cam(dot(x))"), "is in m/s, and the table 'cam' takes m"),
    "kind": (lambda m: m.table("a", [[0, 1], [0, 1]], kind="spline"), "'kind' is not 'spline'"),
    "pchip of two": (lambda m: m.table("a", [[0, 1], [0, 1], [1, 2]], kind="pchip"), "'pchip' is for one argument"),
    "outside": (lambda m: m.table("a", [[0, 1], [0, 1]], outside="loop"), "'outside' is not 'loop'"),
    "both": (lambda m: m.table("a", [[0, 1], [0, 1]], file="a.csv"), "'columns' or a 'file'"),
    "lengths": (lambda m: m.table("a", [[0, 1], [0, 1, 2]]), "the columns have 2, 3 rows"),
    "nan": (lambda m: m.table("a", [[0, float("nan")], [0, 1]]), "column 1, row 2: nan is no finite number"),
    "sorted": (lambda m: m.table("a", [[0, 2, 2], [0, 1, 1]]), "row 3: arguments must ascend"),
    "taken": (lambda m: m.parameter("bent", 1.0), "it is a table already"),
    "integral": (lambda m: m.parameter("bent_integral", 1.0), "it is a table already"),
}  # fmt: skip


@pytest.mark.parametrize("case", REFUSALS)
def test_what_tables_cannot_do_is_refused_by_name(case):
    change, says = REFUSALS[case]
    with pytest.raises(ModelError, match=says):
        refused(change)


def test_a_follower_on_a_cam_of_a_spline():
    """A constraint by a cubic table: the follower's acceleration is that of the spline."""
    angle = np.linspace(0.0, 2.0 * np.pi, 25)
    lift = 0.02 * (1.0 - np.cos(angle)) + 0.004 * np.sin(2.0 * angle)
    m = Model("cam")
    phi = m.coordinate("phi", start=0.5, rate=3.0)
    y = m.coordinate("y", guess=0.0)
    profile = m.table("profile", [angle, lift], kind="cubic")
    m.body("cam", mass=1, inertia=0.01, com=(0, 0), angle=phi)
    m.body("follower", mass=0.5, com=(0, y))
    m.constraint("rides", y - profile(phi))
    solution = m.derive().run(t_end=1.0, method="dop853", rtol=1e-10, atol=1e-12)
    spline = CubicSpline(angle, lift)

    def by_hand(t, s):
        phi, w = s
        slope, bend = spline(phi, 1), spline(phi, 2)
        return [w, -0.5 * slope * bend * w * w / (0.01 + 0.5 * slope**2)]

    exact = solve_ivp(by_hand, (0.0, 1.0), [0.5, 3.0], rtol=1e-12, atol=1e-13, method="DOP853").y[:, -1]
    np.testing.assert_allclose(solution.states[-1][[0, 2]], exact, rtol=0, atol=1e-8)
    assert solution.energy.max_error < 1e-8


def test_what_has_no_table_is_as_it_was():
    m = Model("plain")
    q = m.coordinate("q")
    m.body("b", mass=1, com=(q, 0))
    before = derive_text(m).text
    m.table("unused", [[0, 1], [0, 1]])
    after = derive_text(m).text
    assert before.split("MODEL")[1] == after.split("MODEL")[1]
