"""The report: a whole page that needs nothing else, escapes strangers' texts, and shows the run's own numbers."""

from __future__ import annotations

import math
import re
import xml.etree.ElementTree as ET
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import symgen
from symgen import runtime
from symgen.cli import main
from symgen.link import module_for
from symgen.runtime import solve
from symgen.runtime.report.first_numbers import FORMULAS, start_values, steps_by_formula
from symgen.runtime.report.html import number
from symgen.runtime.report.svg import MARGIN, Curve, plot, ticks

HOSTILE = "</title><script>alert('x')</script> & <img src=x onerror=alert(1)> \"rod\""
LENGTH, RADIUS, GRAVITY, X0 = 0.5, 0.04, 9.81, 0.3
ROD = f"""
description = '''{HOSTILE}'''
[parameters]
l = {{ value = {LENGTH}, unit = "m", doc = "<b onclick='x'>length</b>" }}
[constants]
g = "{GRAVITY} m/s^2"
[coordinates]
x = {{ unit = "m", start = {X0} }}
y = {{ unit = "m", guess = -0.3 }}
[bodies.bob]
mass = "2 kg"
com = ["x", "y"]
shape = {{ sphere = ["{RADIUS} m"] }}
[bodies.bar]
mass = 0
com = ["x/2", "y/2"]
angle = "atan2(y, x)"
shape = {{ capsule = ["0.01 m", "l"] }}
[gravity]
y = "-g"
[constraints]
rod = "x^2 + y^2 - l^2"
[run]
t_end = 1.0
fps = 50
"""
VOID = {"meta", "br", "hr", "img", "link", "input"}


class Page(HTMLParser):
    """Checks that elements are nested, and collects them, their attributes, texts, and tables by section."""

    def __init__(self, text: str):
        super().__init__()
        self.open: list[str] = []
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.text = ""
        self.sections: dict[str, list[list[str]]] = {}
        self._rows: list[list[str]] = []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attributes):
        self.elements.append((tag, dict(attributes)))
        if tag not in VOID:
            self.open.append(tag)
        if tag == "tr":
            self._rows.append([])
        if tag in ("td", "th"):
            self._rows[-1].append("")

    def handle_startendtag(self, tag, attributes):
        self.elements.append((tag, dict(attributes)))

    def handle_endtag(self, tag):
        assert self.open.pop() == tag, f"</{tag}> closes another element"

    def handle_data(self, data):
        self.text += data
        if self.open[-1:] == ["h2"]:
            self._rows = self.sections.setdefault(data, [])
        elif {"td", "th"} & set(self.open):
            self._rows[-1][-1] += data


@pytest.fixture(scope="module")
def rod(tmp_path_factory) -> Path:
    file = tmp_path_factory.mktemp("report") / "rod.toml"
    file.write_text(ROD, encoding="utf-8")
    return file


@pytest.fixture(scope="module")
def text(rod) -> str:
    target = rod.with_name("out.html")
    result = CliRunner().invoke(main, ["report", str(rod), "--html", str(target)])
    assert result.exit_code == 0, result.output
    return target.read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def page(text) -> Page:
    return Page(text)


@pytest.fixture(scope="module")
def system(rod):
    return runtime.load(module_for(rod).text)


def test_page_is_balanced_and_has_its_sections(page):
    assert page.open == []
    titles = (
        "Quantities", "Equations of motion", "State-space form", "Method and step", "First numbers", "Convergence",
        "Motion", "Phase portraits", "Energy", "Constraint residuals", "Step size", "Health",
        "State at the end", "Timings",
    )  # fmt: skip
    assert tuple(page.sections) == titles
    assert (
        sum(tag == "svg" for tag, _ in page.elements) == 9
    )  # drawing, convergence, motion, 2 portraits, 2 energies, residuals, steps


def test_the_contents_lead_to_every_section(text):
    listed = re.findall(r'<li><a href="#([^"]+)">', text)
    assert listed == re.findall(r'<section id="([^"]+)">', text) and len(listed) > 8


def test_texts_of_the_model_stay_texts(page):
    assert not {"script", "img", "b"} & {tag for tag, _ in page.elements}
    assert HOSTILE in page.text
    assert page.sections["Quantities"][1] == ["l", number(LENGTH), "m", "<b onclick='x'>length</b>"]
    assert not any(key.startswith("on") for _, attributes in page.elements for key in attributes)


def test_page_names_nothing_outside_itself(text, page):
    assert not {"link", "iframe", "object", "embed", "use"} & {tag for tag, _ in page.elements}
    assert all(dict(attributes)["href"].startswith("#") for tag, attributes in page.elements if tag == "a")
    outside = {"src", "href", "xlink:href", "srcset", "data", "action"}
    assert not any(outside & set(attributes) for tag, attributes in page.elements if tag != "a")
    assert not re.search(r"url\(|@import|https?:", text)


def test_numbers_are_those_of_the_run(page, system):
    solution = solve(system, t_end=1.0, fps=50)
    values = np.concatenate([solution.q[-1], solution.v[-1]])
    rows = page.sections["State at the end"]
    assert rows[0][0] == "at t = 1 s"
    assert [row[:2] for row in rows[1:]] == [
        [name, number(x)] for name, x in zip(("x", "y", "dot(x)", "dot(y)"), values)
    ]
    counts = dict(page.sections["Method and step"][1:])
    assert counts == {name: str(n) for name, n in solution.stats.items()}
    health = page.sections["Health"][1:]
    assert [row[0] for row in health] == [entry.check for entry in solution.health]


def test_first_numbers_of_a_rod_at_rest(page):
    """From rest: a = g - (g.r) r / l², and M a - f = Gᵀ λ with G = 2 r."""
    y0 = -math.sqrt(LENGTH**2 - X0**2)
    along = -GRAVITY * y0 / LENGTH**2
    a = (-along * X0, -GRAVITY - along * y0)
    rows = page.sections["First numbers"]
    assert rows[:3] == [["M", "x", "y"], ["x", "2", "0"], ["y", "0", "2"]]
    assert [float(x) for row in rows[4:6] for x in row[1:]] == pytest.approx(
        [0, a[0], -2 * GRAVITY, a[1]], rel=1e-10
    )
    assert rows[7][0] == "rod"
    assert [float(x) for x in rows[7][1:]] == pytest.approx([2 * X0, 2 * y0, 0, -along], rel=1e-10, abs=1e-12)


def test_convergence_table_tightens_tolerances(page):
    head, *levels = page.sections["Convergence"][:5]
    assert head[0] == "rtol"
    settings = [float(row[0]) for row in levels]
    assert settings == pytest.approx([1e-6, 1e-7, 1e-8, 1e-9])
    assert levels[-1][2] == "finest"
    assert float(levels[2][2]) < 1e-6


def test_drawing_is_to_scale(text):
    svg = re.search(r'<svg class="drawing".*?</svg>', text, re.S).group()
    (radius,) = (float(r) for r in re.findall(r'<circle class="body[^>]* r="([\d.]+)"', svg))
    x0, y0, x1, y1 = map(
        float, re.search(r'class="bar[^>]* d="M([\d.]+) ([\d.]+)L([\d.]+) ([\d.]+)"', svg).groups()
    )
    assert math.hypot(x1 - x0, y1 - y0) / radius == pytest.approx(LENGTH / RADIUS, rel=0.02)
    # The bob hangs to the right of the pivot and below it: y points down in pictures.
    assert abs(x1 - x0) / abs(y1 - y0) == pytest.approx(0.75, rel=0.01)
    assert (x1 - x0) * (y1 - y0) > 0.0


def test_start_and_steps_are_the_formula():
    """A simple pendulum: theta'' = -(g/l) sin(theta), by hand."""
    model = Path(__file__).resolve().parents[1] / "models" / "pendulum.toml"
    system = runtime.load(module_for(model).text)
    p = system.parameter_values()
    named = dict(zip((record["name"] for record in system.parameters), p))
    h, q, v = 0.01, 0.7, -0.2
    start = start_values(system, p, 0.0, np.array([q]), np.array([v]))
    assert start.imbalance < 1e-12
    steps = steps_by_formula(system, p, 0.0, start.q, start.v, h, "semi_implicit_euler")
    ratio = start.a[0] / math.sin(q)
    assert ratio == pytest.approx(-named["g"] / named["L"], rel=1e-12)
    for k, step in enumerate(steps):
        assert (step.t, step.q[0], step.v[0]) == pytest.approx((k * h, q, v), rel=1e-14)
        v += h * ratio * math.sin(q)
        q += h * v
        assert (step.q_next[0], step.v_next[0]) == pytest.approx((q, v), rel=1e-14)
    assert len(steps) == 2


@pytest.mark.parametrize("method", FORMULAS)
@pytest.mark.parametrize("model", ["pendulum", "quarter_car", "four_bar", "rolling_disc"])
def test_steps_by_formulas_are_those_of_the_run(model, method):
    """Of free and driven models, of mechanisms, and of one with velocity constraints."""
    system, h = symgen.load(model), 1e-3
    run = system.run(t_end=4 * h, step=h, method=method, t_eval=[0.0, h, 2 * h], energy_scaling=False)
    steps = steps_by_formula(system, run.p, 0.0, run.q[0], run.v[0], h, method)
    for k, step in enumerate(steps):
        scale = max(np.abs(run.q).max(), np.abs(run.v).max())
        assert step.q_next == pytest.approx(run.q[k + 1], abs=1e-12 * scale)
        assert step.v_next == pytest.approx(run.v[k + 1], abs=1e-11 * scale)
        drift = max(np.abs(step.q_next - step.q_formula).max(), np.abs(step.v_next - step.v_formula).max())
        assert (drift > 0.0) == (system.m > 0)


@pytest.mark.parametrize("method", [*FORMULAS, "dop853"])
def test_the_table_is_of_the_method_that_was_chosen(rod, method):
    target = rod.with_name(f"{method}.html")
    step = ["--step", "0.01"] if method in FORMULAS else []
    asked = [
        "report",
        str(rod),
        "--html",
        str(target),
        "--quick",
        "--method",
        method,
        *step,
        "--t-end",
        "0.1",
    ]
    assert CliRunner().invoke(main, asked).exit_code in (0, 3)
    page = Page(target.read_text(encoding="utf-8"))
    rows = page.sections["First numbers"]
    (first, *_) = (k for k, row in enumerate(rows) if row[0] == "t [s]")
    head, states = rows[first], rows[first + 1 : first + 5]
    shown = method if method in FORMULAS else "semi_implicit_euler"
    assert f"Two steps of {shown}" in page.text and FORMULAS[shown].says in page.text
    assert ("dop853 is not done by hand" in page.text) == (method == "dop853")
    assert head[2:-4] == ["q", "v", *FORMULAS[shown].stages] and head[-2:] == ["v' held", "q' held"]
    assert states[2][2:4] == states[0][-1:] + states[0][-2:-1]  # the second step begins where the first ends


def test_explicit_euler_of_the_course(tmp_path):
    """theta'' = -g/L theta from 0.2 rad: -0.03924 rad/s and (0.2, -0.03924) after 0.01 s, then -0.07848."""
    target = tmp_path / "out.html"
    asked = [
        "report",
        "pendulum_linear",
        "--method",
        "euler",
        "--step",
        "0.01",
        "--quick",
        "--html",
        str(target),
    ]
    assert CliRunner().invoke(main, asked).exit_code == 3
    rows = Page(target.read_text(encoding="utf-8")).sections["First numbers"]
    first, second = rows[-2:]
    assert [float(x) for x in first[2:]] == pytest.approx([0.2, 0.0, -3.924, -0.03924, 0.2], rel=1e-12)
    assert [float(x) for x in second[2:]] == pytest.approx(
        [0.2, -0.03924, -3.924, -0.07848, 0.1996076], rel=1e-12
    )


@pytest.mark.parametrize(
    ("low", "high", "expected"),
    [(0.0, 10.0, [0, 2, 4, 6, 8, 10]), (-0.31, 0.29, [-0.3, -0.2, -0.1, 0, 0.1, 0.2]), (1e6, 1.0003e6, None)],
)
def test_ticks_are_round_and_inside(low, high, expected):
    found = ticks(low, high)
    assert ((found >= low - 1e-9 * abs(low)) & (found <= high + 1e-9 * abs(high))).all()
    assert 3 <= len(found) <= 8
    if expected is not None:
        assert found == pytest.approx(expected, abs=1e-12)


def curve_paths(svg: str) -> list[str]:
    return [e.get("d") for e in ET.fromstring(svg).iter("path") if (e.get("class") or "").startswith("curve")]


def test_plot_spans_its_frame_and_lifts_the_pen_at_gaps():
    x = np.arange(5.0)
    svg = plot([Curve("a", x, np.array([0.0, 1.0, np.nan, 4.0, 2.0]))], "<t>", "y & z")
    (path,) = curve_paths(svg)
    frame = ET.fromstring(svg).find("rect")
    left, top, width, height = (float(frame.get(key)) for key in ("x", "y", "width", "height"))
    points = [tuple(map(float, pair.split())) for pair in re.split("[ML]", path)[1:]]
    assert path.count("M") == 2
    margin = MARGIN / (1.0 + 2.0 * MARGIN) * height
    assert points[0] == pytest.approx((left, top + height - margin), abs=0.06)
    assert points[2] == pytest.approx((left + 0.75 * width, top + margin), abs=0.06)
    assert points[3][0] == pytest.approx(left + width, abs=0.06)
    assert "&lt;t&gt;" in svg
    assert "y &amp; z" in svg


def test_runs_that_blew_up_have_plots():
    y = np.array([1.0, 2.0, -1e308, 1e308, np.inf])
    for log in (False, True):
        svg = plot([Curve("y", np.arange(5.0), y)], "t", "y", log=log)
        assert curve_paths(svg)[0].count("L") == 1
        assert "nan" not in svg
        assert "inf" not in svg


def test_long_curves_keep_their_peaks():
    t = np.linspace(0.0, 1.0, 20_001)
    y = np.zeros_like(t)
    y[12_345] = 1.0
    svg = plot([Curve("spike", t, y)], "t", "y")
    (path,) = curve_paths(svg)
    heights = [float(pair.split()[1]) for pair in re.split("[ML]", path)[1:]]
    assert len(heights) < 1000
    frame = ET.fromstring(svg).find("rect")
    margin = MARGIN / (1.0 + 2.0 * MARGIN) * float(frame.get("height"))
    assert min(heights) == pytest.approx(float(frame.get("y")) + margin, abs=0.06)


def test_recording_is_repeated(rod):
    recording, target = rod.with_name("rod.rrd"), rod.with_name("again.html")
    runner = CliRunner()
    assert runner.invoke(main, ["run", str(rod), "--set", "l=0.6 m", "--log", str(recording)]).exit_code == 0
    result = runner.invoke(main, ["report", str(recording), "--html", str(target), "--quick"])
    assert result.exit_code == 0, result.output
    page = Page(target.read_text(encoding="utf-8"))
    assert page.sections["Quantities"][1][:2] == ["l", "0.6"]
    assert "Convergence" not in page.sections
    said = re.search(r"recorded in rod\.rrd, repeated: .* by at most (\S+)\.", page.text)
    assert float(said.group(1)) < 1e-9
    refused = runner.invoke(main, ["report", str(recording), "--rtol", "1e-6"])
    assert refused.exit_code == 2
    assert "--rtol: a recorded run is repeated as it was" in refused.stderr


def test_formulas_keep_their_layout(text, page):
    """A browser lays `math` out as a formula only where its display is not that of a plain block."""
    (style,) = re.findall(r"<style>(.*?)</style>", text, re.S)
    rule = re.search(r"}math\{([^}]*)\}", style).group(1)
    assert "display:block math" in rule
    formulas = [ET.fromstring(found) for found in re.findall(r"<math.*?</math>", text, re.S)]
    assert formulas
    assert {"mo", "mi"} <= {element.tag for formula in formulas for element in formula.iter()}
