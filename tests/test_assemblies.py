"""Assemblies: against the same models written out by hand, and hostile ones."""

from __future__ import annotations

import dataclasses
import os

import numpy as np
import pytest
import sympy
from assembled_models import pair

import symgen
from symgen import Model
from symgen.errors import ModelError
from symgen.link import derive, derive_text
from symgen.model import assemblies, description
from symgen.runtime.batches import evaluate
from symgen.runtime.recording.reader import read_recording


def by_name(system, function: str, values: dict[str, float]) -> dict[str, float]:
    """What a function writes for states and parameters by names, dots and underscores being one."""
    names = [x["name"].replace(".", "_") for x in (*system.coordinates, *system.rates)]
    marked = names[: len(system.coordinates)] + [f"dot {x}" for x in names[len(system.coordinates) :]]
    y = np.array([[values[x] for x in marked]])
    p = system.parameter_values({})
    written = evaluate(system, function, p, np.array([0.3]), y)[0]
    if function == "rhs":
        return dict(zip(marked, written, strict=False))
    return dict(zip((x["name"].replace(".", "_") for x in system.outputs), written, strict=True))


def random_state(system, rng) -> dict[str, float]:
    """Values by names."""
    names = [x["name"].replace(".", "_") for x in system.coordinates]
    rates = [f"dot {x['name'].replace('.', '_')}" for x in system.rates]
    return {x: float(rng.normal()) for x in (*names, *rates)}


@pytest.mark.parametrize(
    "seed", [pytest.param(seed, marks=[pytest.mark.slow] if seed > 4 else []) for seed in range(12)]
)
def test_assemblies_are_the_models_written_out(seed):
    assembled, flat = pair(seed)
    made, again, plain = assembled.derive(), Model.from_toml(assembled.to_toml()).derive(), flat.derive()
    assert Model.from_toml(assembled.to_toml()).to_toml() == assembled.to_toml()
    rng = np.random.default_rng(seed)
    for _ in range(5):
        state = random_state(made, rng)
        for function in ("rhs", "outputs"):
            found, expected = by_name(made, function, state), by_name(plain, function, state)
            assert found == pytest.approx(expected, rel=1e-12, abs=1e-12)
            assert by_name(again, function, state) == pytest.approx(expected, rel=1e-12, abs=1e-12)
    ends = [x.run(t_end=0.5, rtol=1e-11, atol=1e-12) for x in (made, plain)]
    names = [x["name"] for x in plain.coordinates]
    for run in ends:
        assert run.status == "success"
    for x in made.coordinates:
        other = x["name"].replace(".", "_")
        assert other in names
        if not other.endswith("_integral"):
            assert ends[0][x["name"]][-1] == pytest.approx(ends[1][other][-1], rel=1e-8, abs=1e-8)
    assert [e.name.replace(".", "_") for e in ends[0].events] == [e.name for e in ends[1].events]


PENDULUM = """
[assemblies.pendulum.parameters]
l = "0.5 m"
m = 2
[assemblies.pendulum.coordinates]
th = { start = 0.3 }
[assemblies.pendulum.bodies.bob]
mass = "m"
com = ["l*sin(th)", "-l*cos(th)"]
[gravity]
y = "-9.81 m/s^2"
"""


def read(text: str) -> Model:
    return Model.from_toml(text)


def test_equal_assemblies_are_derived_once_and_stand_in_one_loop():
    uses = "".join(f'c{k} = {{ assembly = "pendulum", l = {0.4 + 0.1 * k} }}\n' for k in range(5))
    found = derive_text(read(f"{PENDULUM}[use]\n{uses}"))
    assert found.structure["subsystems"] == [5]
    assert found.text.count("for k in range(5):") > 3
    one = derive_text(read(f'{PENDULUM}[use]\nc0 = {{ assembly = "pendulum" }}\n'))
    assert found.code["rhs"] <= one.code["rhs"] + 2
    run = read(f"{PENDULUM}[use]\n{uses}").derive().run(t_end=1.0)
    for k in range(5):
        alone = (
            read(f'{PENDULUM}[use]\nc = {{ assembly = "pendulum", l = {0.4 + 0.1 * k} }}\n')
            .derive()
            .run(t_end=1.0)
        )
        assert run[f"c{k}.th"][-1] == pytest.approx(alone["c.th"][-1], abs=1e-7)


@pytest.mark.parametrize("offsets", ['["d{}", 0]', "[{}, 0]", '["{} m", 0, "{} m"]'])
def test_places_leave_assemblies_equal(offsets):
    """Parameters of the model, and numbers, which become parameters where the places alone are different."""
    parameters = "".join(f"d{k} = {k}\n" for k in range(1, 5))
    uses = "".join(
        f'c{k} = {{ assembly = "pendulum", offset = {offsets.format(k, k)} }}\n' for k in range(1, 5)
    )
    text = PENDULUM.replace('"-l*cos(th)"]', '"-l*cos(th)", 0]') if "m" in offsets else PENDULUM
    model = read(f'[parameters]\n{parameters}{text}[use]\n{uses}[outputs]\nplace = "c3.bob.x"\n')
    assert derive_text(model).structure["subsystems"] == [4]
    system = model.derive()
    run = system.run(t_end=0.5)
    assert run["place"] == pytest.approx(3 + 0.5 * np.sin(run["c3.th"]), rel=1e-14)
    place = "d3" if "d" in offsets else "c3.offset_x"
    moved = system.run(t_end=0.5, parameters={place: 7.0})
    assert moved["place"] == pytest.approx(run["place"] + 4, rel=1e-14)
    assert moved["c3.th"] == pytest.approx(run["c3.th"], abs=1e-9)
    assert not any("offset_y" in name for name in run.parameters)  # no places differ in it


def test_numbers_of_places_that_make_nothing_equal_stay_numbers():
    """Uses that act on each other, uses that are turned, and names that are taken."""
    pair = f"""{PENDULUM}[use]
    a = {{ assembly = "pendulum", offset = [1, 0] }}
    b = {{ assembly = "pendulum", offset = [2, 0] }}
    """
    together = read(pair + '[energy]\npotential = "(a.th - b.th)^2"\n').derive()
    assert not any("offset" in name for name in together.run(t_end=0.1).parameters)
    turned = derive_text(read(pair.replace("offset = [2, 0]", "offset = [2, 0], angle = 0.1")))
    assert turned.structure["subsystems"] == [1, 1] and "offset" not in turned.text
    taken = read(pair + "[parameters]\nb_offset_x = 1\n")
    assert derive_text(taken).structure["subsystems"] == [1, 1]


def test_a_parameter_of_a_loop_that_another_subsystem_reads_has_two_names():
    m = Model("shared", gravity=(0, -9.81))
    x = m.coordinate("x", start=0.1)
    for k in (1, 2):
        length, angle = m.parameter(f"l{k}", 0.3 * k), m.coordinate(f"th{k}", start=0.2)
        m.body(f"bob{k}", mass=1, com=(length * symgen.sin(angle), -length * symgen.cos(angle)))
    m.body("cart", mass=1, com=("x", 0))
    m.force(x, "-l1*x - l2*x^3")
    system = m.derive()
    assert derive_text(m).structure["subsystems"] == [1, 2]
    y = np.array([[0.1, 0.2, -0.4, 0.0, 0.0, 0.0]])
    for l1 in (0.3, 0.7):
        p = system.parameter_values({"l1": l1})
        v = evaluate(system, "rhs", p, np.zeros(1), y)[0][3:6]
        expected = [-l1 * 0.1 - 0.6 * 0.001, -9.81 / l1 * np.sin(0.2), -9.81 / 0.6 * np.sin(-0.4)]
        assert v == pytest.approx(expected, rel=1e-12)


SPACE = """
[parameters]
tilt = 0.3
[assemblies.arm.ports]
base = "body"
drive = { kind = "value", unit = "N*m" }
[assemblies.arm.bodies.link]
mass = 1.5
inertia = [0.01, 0.02, 0.03]
[assemblies.arm.bodies.weight]
mass = 0.7
inertia = [0.001, 0.002, 0.002]
com = ["0.2*cos(phi)", "0.2*sin(phi)", 0.1]
rotation = [["z", "phi"]]
[assemblies.arm.coordinates]
phi = { start = 0.2, rate = 1 }
[assemblies.arm.joints.hip]
type = "spherical"
child = "link"
origin = { xyz = [0.1, 0.2, 0.3], rpy = [ROLL, 0, YAW] }
rate = [0.3, 1, -0.5]
[assemblies.arm.points.tip]
body = "link"
at = [0.3, 0, 0.1]
[assemblies.arm.points.hook]
at = [0, 0.4, 0]
[assemblies.arm.axes.up]
direction = [0, 0.6, 0.8]
[assemblies.arm.springs.bow]
points = ["tip", "hook"]
stiffness = 30
length = 0.1
damping = 0.2
[assemblies.arm.springs.tie]
points = [[0, 0, 0.5], "tip"]
stiffness = 10
length = 0
[assemblies.arm.bushings.soft]
frames = ["world", "weight"]
stiffness = [5, 6, 7, 0.1, 0.2, 0.3]
[assemblies.arm.loads.push]
point = "tip"
force = ["3*drive", "-1", "2*tip_x + 3*up_y"]
[assemblies.arm.loads.twist]
body = "link"
torque = [0.1, "2*tip_z", 0.3]
[assemblies.arm.forces]
phi = "drive*cos(phi)"
[assemblies.arm.outputs]
seen = "tip_x + 2*tip_y + 3*tip_z"
turning = "link.wx + 2*angular_velocity(link, y)"
speed = "velocity(tip, z)"
[coordinates]
s = { start = 0.4 }
[bodies.block]
mass = 2
com = [0, 0, "s"]
[gravity]
z = "-9.81 m/s^2"
[use.a]
assembly = "arm"
base = "block"
drive = "0.2*s"
"""


def test_an_assembly_turned_in_space_does_what_it_does_in_a_world_that_is_turned():
    """All but gravity has no direction of its own: turned into the assembly's axes it says the same."""
    plain = SPACE.replace("ROLL", "0.2").replace("YAW", "0").replace('[gravity]\nz = "-9.81 m/s^2"', "")
    turned = plain + "xyz = [0.5, -1, 2]\nrpy = [0.3, -0.4, 1.2]\n"
    made, other = read(turned).derive(), read(plain).derive()
    rng = np.random.default_rng(3)
    for _ in range(4):
        state = random_state(other, rng)
        q = np.array([state[f"a_hip_q{c}"] for c in "wxyz"])
        state |= dict(zip((f"a_hip_q{c}" for c in "wxyz"), q / np.linalg.norm(q), strict=True))
        for function in ("rhs", "outputs"):
            found, expected = by_name(made, function, state), by_name(other, function, state)
            assert found == pytest.approx(expected, rel=1e-10, abs=1e-10)
    assert read(read(turned).to_toml()).to_toml() == read(turned).to_toml()


def test_an_assembly_turned_by_a_parameter():
    """About z, where angles add; with gravity along z."""
    text = SPACE.replace("ROLL", "0.2").replace("YAW", "0.1")
    made, plain = read(text + 'rpy = [0, 0, "2*tilt"]\n').derive(), read(text).derive()
    state = random_state(plain, np.random.default_rng(5))
    q = np.array([state[f"a_hip_q{c}"] for c in "wxyz"])
    state |= dict(zip((f"a_hip_q{c}" for c in "wxyz"), q / np.linalg.norm(q), strict=True))
    for function in ("rhs", "outputs"):
        found, expected = by_name(made, function, state), by_name(plain, function, state)
        assert found == pytest.approx(expected, rel=1e-10, abs=1e-10)
    with pytest.raises(ModelError, match="turn the use by numbers"):
        read(text + 'rpy = ["tilt", "tilt", 0]\n').derive()


def test_every_part_of_a_model_can_be_in_an_assembly():
    """What a model holds is known to the lists of what a use takes over, and its names are."""
    held = {
        x for x, value in vars(Model("m")).items() if isinstance(value, (list, dict)) and x.startswith("_")
    }
    known = {*assemblies.LISTS, *assemblies.MAPPINGS, "_constants", "_parameters", "_made_rates", "_jointed"}
    known |= {
        "_kinds",
        "_aliases",
        "_energies",
        "_forces",
        "_used_energies",
        "_used_forces",
        "_inner_uses",
        "_used_starts",
        "_tyres",
        "_uses",
    }
    known |= {"_ports", "_spelled", "_placed", "_run", "_attractors"}
    assert held == known
    parts = {x for x in vars(description).values() if dataclasses.is_dataclass(x)} - {
        description.Attractor, description.Description, description.Formula, description.Given, description.Limit,
        description.Loop, description.Port, description.Sensor, description.Shape, description.Solid,
        description.StartConditions, description.StartEquation, description.Use, description.Winding,
    }  # fmt: skip
    assert parts == assemblies.NAMES.keys()
    for part, names in assemblies.NAMES.items():
        fields = {x.name for x in dataclasses.fields(part)}
        assert {x for group in names for x in group} <= fields
        texts = {x.name for x in dataclasses.fields(part) if "str" in str(x.type)}
        words = {
            "unit",
            "doc",
            "kind",
            "outside",
            "units",
            "type",
            "acts",
            "color",
            "holds",
            "direction",
            "action",
            "said",
            "sequence",
        }
        assert texts - words - {"says", "rotation"} <= {x for group in names for x in group}, part


FAULTS = {
    'x = { assembly = "pendulm" }': ("[use.x] assembly", "did you mean 'pendulum'"),
    "x = {}": ("[use.x] assembly", "the key 'assembly' is missing"),
    "x = 3": ("[use] x", "a use is a table"),
    'x = { assembly = "pendulum", mass = 3 }': ("[use.x] mass", "has no port and no parameter 'mass'"),
    'x = { assembly = "pendulum", l = "3 kg" }': ("[use.x] l", "does not fit the unit 'm'"),
    'x = { assembly = "pendulum", l = "g0" }': ("[use.x] l", "this is in m/s^2, and m is expected"),
    'x = { assembly = "pendulum", l = "x.th" }': ("[use.x] l", "cannot depend on a coordinate"),
    'x = { assembly = "pendulum", m = "q" }': ("[use.x] m", "the name 'q' is not declared"),
    'x = { assembly = "pendulum", offset = [1] }': ("[use.x] offset", "2 or 3 components"),
    'x = { assembly = "pendulum", angle = 1, rpy = [0, 0, 1] }': ("[use.x] rpy", "leave one of them out"),
    'x = { assembly = "pendulum", rpy = [1, 0, 0] }': ("[assemblies.pendulum.bodies.bob]", "used as 'x'"),
    '"x.y" = { assembly = "pendulum" }': ("[use] x.y", "is not a name"),
    '"a\\u0000b" = { assembly = "pendulum" }': ("[use]", "is not a name"),
    'x_a = { assembly = "pendulum" }\nx = { assembly = "under" }': ("[use.x]", "are one name, 'x_a_th'"),
    'g0 = { assembly = "pendulum" }': ("[use] g0", "the name 'g0' is taken"),
    'x = { assembly = "needy" }': ("[use.x] hinge", "there is no body 'hinge' for the port"),
    'x = { assembly = "needy", hinge = "cart" }': ("[use.x] hinge", "there is no body 'cart'"),
    'x = { assembly = "free" }': ("[assemblies.free.bodies.bob] mass, column 3, used as 'x'", "not declared"),
    'x = { assembly = "blind" }': ("[assemblies.blind.bodies.bob] mass, used as 'x'", "there is no coordinate, rate"),
    'x = { assembly = "wrong" }': ("[assemblies.wrong.energy] potential, used as 'x'", "units do not match"),
}  # fmt: skip
MORE = """
[parameters]
g0 = "9.81 m/s^2"
[assemblies.under.definitions]
a_th = 1
[assemblies.needy.ports]
hinge = "body"
[assemblies.needy.joints.pin]
type = "revolute"
parent = "hinge"
child = "arm"
[assemblies.needy.bodies.arm]
mass = 1
inertia = 1
[assemblies.free.coordinates]
x = {}
[assemblies.free.bodies.bob]
mass = "2*nowhere"
com = ["x", 0]
[assemblies.blind.coordinates]
x = {}
[assemblies.blind.bodies.bob]
mass = "acceleration(nowhere)"
com = ["x", 0]
[assemblies.wrong.parameters]
k = "3 N/m"
[assemblies.wrong.coordinates]
x = { unit = "m" }
[assemblies.wrong.bodies.bob]
mass = 1
com = ["x", 0]
[assemblies.wrong.energy]
potential = "k*x"
"""


@pytest.mark.parametrize("uses", FAULTS)
def test_what_is_wrong_with_a_use_is_told_with_its_place(uses):
    place, message = FAULTS[uses]
    with pytest.raises(ModelError) as caught:
        read(f"{PENDULUM}{MORE}[use]\n{uses}\n").describe()
    assert place in str(caught.value) and message in str(caught.value), str(caught.value)


def files(folder, **texts: str):
    for name, text in texts.items():
        (folder / f"{name}.toml").write_text(text, encoding="utf-8")
    return folder / "main.toml"


BOB = '[coordinates]\nth = { start = 0.3 }\n[bodies.bob]\nmass = 1\ncom = ["sin(th)", "-cos(th)"]\n'


def test_an_assembly_in_a_file_of_its_own(tmp_path):
    """What its file names, too, is looked for beside it; the cache knows all of these files."""
    (tmp_path / "parts").mkdir()
    main = files(
        tmp_path,
        main='[assemblies.p]\nfile = "parts/p.toml"\n[use.a]\nassembly = "p"\n[use.b]\nassembly = "p"\n',
    )
    files(tmp_path / "parts", p=f'[assemblies.q]\nfile = "q.toml"\n[use.q]\nassembly = "q"\n{BOB}')
    q = '[tables.f]\nfile = "f.csv"\n[parameters]\nk = 2\n[coordinates]\nx = {}\n[bodies.block]\nmass = 1\n'
    files(tmp_path / "parts", q=q + 'com = ["x", 0]\n[forces]\nx = "-k*f(x)"\n[outputs]\nforce = "k*f(x)"\n')
    table = tmp_path / "parts" / "f.csv"
    table.write_text("-1, -3\n1, 3\n")
    system = symgen.load(main)
    assert [x["name"] for x in system.coordinates] == ["a.th", "a.q.x", "b.th", "b.q.x"]
    state = {"a_th": 0.1, "a_q_x": 0.5, "b_th": 0.0, "b_q_x": -0.5}
    state |= {f"dot {x}": 0.0 for x in state}
    assert by_name(system, "outputs", state) == pytest.approx({"a_q_force": 3.0, "b_q_force": -3.0})
    table.write_text("-1, -4\n1, 4\n")
    assert by_name(symgen.load(main), "outputs", state)["a_q_force"] == pytest.approx(4.0)
    files(tmp_path / "parts", q=q.replace("k = 2", "k = 5") + 'com = ["x", 0]\n[outputs]\nforce = "k*f(x)"\n')
    assert by_name(symgen.load(main), "outputs", state)["a_q_force"] == pytest.approx(10.0)
    files(tmp_path / "parts", q=q.replace("mass = 1", 'mass = "2*k +"'))
    with pytest.raises(ModelError, match=r"q\.toml, \[bodies\.block\] mass, column 6"):
        symgen.load(main)
    again = Model.from_toml(Model.from_toml(files(tmp_path, main=BOB)).to_toml())
    assert [x.name for x in again.describe().coordinates] == ["th"]


def test_files_of_assemblies_stay_below_the_model(tmp_path):
    inside = tmp_path / "model"
    inside.mkdir()
    (tmp_path / "secret.toml").write_text(BOB)
    (inside / "link.toml").symlink_to(tmp_path / "secret.toml")
    os.mkfifo(inside / "pipe.toml")
    (inside / "folder.toml").mkdir()
    (inside / "bytes.toml").write_bytes(b"\xff\xfe")
    for name, message in {
        "../secret.toml": "is not below the model's own folder",
        str(tmp_path / "secret.toml"): "is not below the model's own folder",
        "link.toml": "leads out of the model's own folder",
        "pipe.toml": "is not there",
        "folder.toml": "is not there",
        "missing.toml": "is not there",
        "/dev/zero": "is not below",
        "": "is not below",
        "a\\u0000b.toml": "is not below",
        "bytes.toml": "is not UTF-8",
    }.items():
        main = files(inside, main=f'[assemblies.p]\nfile = "{name}"\n[use.a]\nassembly = "p"\n')
        with pytest.raises(ModelError) as caught:
            symgen.load(main)
        assert message in str(caught.value), str(caught.value)
    with pytest.raises(ModelError, match="no folder"):
        read('[assemblies.p]\nfile = "p.toml"\n')


CIRCLES = {
    "of itself": '[assemblies.a.use.x]\nassembly = "a"\n[use.y]\nassembly = "a"\n',
    "of two": '[assemblies.a.use.x]\nassembly = "b"\n[assemblies.b.use.x]\nassembly = "a"\n',
    "from inside": '[assemblies.a.assemblies.b.use.x]\nassembly = "a"\n',
    "of a file": '[assemblies.a]\nfile = "main.toml"\n',
    "of two files": '[assemblies.a]\nfile = "other.toml"\n',
}


@pytest.mark.parametrize("circle", CIRCLES)
def test_circles_are_refused_by_name(circle, tmp_path):
    main = files(tmp_path, main=CIRCLES[circle], other='[assemblies.b]\nfile = "main.toml"\n')
    with pytest.raises(ModelError, match="uses itself"):
        symgen.load(main)


def test_chains_of_files_end(tmp_path):
    for k in range(60):
        files(tmp_path, **{f"f{k}": f'[assemblies.a]\nfile = "f{k + 1}.toml"\n'})
    with pytest.raises(ModelError, match="more than 30 deep"):
        symgen.load(files(tmp_path, main='[assemblies.a]\nfile = "f0.toml"\n'))


def test_assemblies_that_multiply_are_refused():
    """Twenty levels of ten each would be more than there are atoms in a person."""
    text = "[assemblies.a0.definitions]\nd = 1\n"
    for k in range(1, 20):
        text += "".join(f'[assemblies.a{k}.use.u{n}]\nassembly = "a{k - 1}"\n' for n in range(10))
    with pytest.raises(ModelError, match="bring more than 200000 names"):
        read(text)


def test_ten_thousand_uses():
    uses = "".join(f'c{k} = {{ assembly = "pendulum" }}\n' for k in range(10_000))
    d = read(f"{PENDULUM}[use]\n{uses}").describe()
    assert len(d.coordinates) == len(d.bodies) == 10_000


def test_names_with_dots_belong_to_uses():
    for text in ('[parameters]\n"a.b" = 1\n', '[bodies."a.b"]\nmass = 1\n', '[assemblies."a.b"]\n'):
        with pytest.raises(ModelError, match="is not a name"):
            read(text)
    with pytest.raises(ModelError, match=r"name 'c1\.th' is not declared"):
        read(f'{PENDULUM}[use.c]\nassembly = "pendulum"\n[outputs]\nx = "c1.th"\n').describe()
    with pytest.raises(ModelError, match=r"no frame or body 'c\.bib'.*did you mean 'c\.bob'"):
        read(
            f'{PENDULUM}[use.c]\nassembly = "pendulum"\n[closures.x]\ntype = "revolute"\nframes = ["world", "c.bib"]\n'
        ).describe()
    with pytest.raises(ModelError, match="one name, 'c_th', in generated code"):
        read(f'{PENDULUM}[use.c]\nassembly = "pendulum"\n[coordinates]\nc_th = {{}}\n')
    with pytest.raises(ModelError, match="'bob'"):
        read(
            f'{PENDULUM}[use.bob]\nassembly = "pendulum"\n[bodies.bob]\nmass = 1\ncom = ["bob.th", 0]\n'
        ).describe()
    with pytest.raises(ModelError, match="longer than 100"):
        read(f'{PENDULUM}[use.{"c" * 99}]\nassembly = "pendulum"\n')


def test_what_an_assembly_cannot_have_is_refused_by_name():
    for table in (
        'gravity]\ny = "-9.81 m/s^2"',
        "run]\nt_end = 1",
        "gravity.attractors.sun]\nat = [0, 0]\nmu = 1",
    ):
        with pytest.raises(ModelError, match="that is said by the model that uses it"):
            read(f'[assemblies.a.{table}\n[use.x]\nassembly = "a"\n')
    with pytest.raises(ModelError, match="unknown key 'impacts'"):
        read('[assemblies.a]\nimpacts = "sequential"\n')
    with pytest.raises(ModelError, match="this is an assembly, which other models use"):
        read('[ports]\nx = "coordinate"\n').describe()
    for port, message in {
        '"hinge"': "a port is no 'hinge'",
        '{ kind = "body", unit = "m" }': "a body has no unit",
    }.items():
        with pytest.raises(ModelError, match=message):
            read(f"[assemblies.a.ports]\nx = {port}\n")
    with pytest.raises(ModelError, match="says where an assembly stands"):
        read('[assemblies.a.ports]\nangle = "value"\n')
    with pytest.raises(ModelError, match="is a key of uses"):
        read('[assemblies.a.parameters]\noffset = 1\n[use.x]\nassembly = "a"\n')
    with pytest.raises(ModelError, match="'k' is a constant"):
        read('[assemblies.a.constants]\nk = 1\n[use.x]\nassembly = "a"\nk = 2\n')
    with pytest.raises(ModelError, match="stands where 'c' is placed"):
        joint = '[joints.j]\ntype = "revolute"\nchild = "c.bob"\n'
        read(f'{PENDULUM}[use.c]\nassembly = "pendulum"\nangle = 1\n{joint}')


G = 9.81

HELD = """[assemblies.arm]
[assemblies.arm.parameters]
k = 10
wanted = 0.2
[assemblies.arm.coordinates]
th = { guess = 0.1 }
y = { guess = 0.1 }
[assemblies.arm.states]
seen = { derivative = "th - seen", guess = 0.0 }
[assemblies.arm.bodies.bob]
mass = 1
com = ["sin(th)", "-cos(th)"]
[assemblies.arm.bodies.block]
mass = 2
com = [3, "y"]
[assemblies.arm.stops.ground]
gap = "y - 0.05"
[assemblies.arm.energy]
potential = "k*th^2/2 - 3*th"
[assemblies.arm.start]
equations = ["th - wanted"]
find = ["k"]
steady = true
closed = ["ground"]
[assemblies.pair]
[assemblies.pair.use.first]
assembly = "arm"
[assemblies.pair.use.second]
assembly = "arm"
angle = 0.4
wanted = 0.1
[gravity]
y = "-9.81"
[use.p]
assembly = "pair"
[coordinates]
z = { guess = 0.3, rate = 0.5 }
[bodies.own]
mass = 1
com = ["z", 0]
[start]
equations = ["z - p.first.th - 1"]
"""


def test_starts_in_assemblies_hold_in_each_use():
    """Stiffnesses that hold two arms where each use wants them; blocks that rest on their stops; the model's own."""
    model = read(HELD)
    run = derive(model).run(t_end=0.5)
    for arm, turned, wanted in (("p.first", 0.0, 0.2), ("p.second", 0.4, 0.1)):
        k = (3 - G * np.sin(turned + wanted)) / wanted
        assert run.parameters[f"{arm}.k"] == pytest.approx(k, rel=1e-9)
        assert run[f"{arm}.th"] == pytest.approx(np.full(len(run.t), wanted), abs=1e-9)
        assert run[f"{arm}.seen"][0] == pytest.approx(wanted, abs=1e-10)
    assert run["p.first.y"] == pytest.approx(np.full(len(run.t), 0.05), abs=1e-12)
    assert run["z"][0] == pytest.approx(1.2, abs=1e-12)
    assert run["dot(z)"][0] == 0.5  # in balance is what assemblies have, not the model
    again = read(model.to_toml())
    assert again.to_toml() == model.to_toml()
    assert derive_text(again).text == derive_text(model).text


def test_what_starts_in_assemblies_cannot_name_is_refused_there():
    for change, says in {
        (
            '"th - wanted"',
            '"th - wonted"',
        ): r"\[assemblies.arm.start\] equations, element 1.*used as 'p.first': the name 'wonted' .* 'wanted'\?",
        (
            'find = ["k"]',
            'find = ["th"]',
        ): r"\[assemblies.arm.start\] find, element 1: there is no parameter 'th'",
        ('["ground"]', '["floor"]'): r"\[assemblies.arm.start\] closed, element 1: there is no stop 'floor'",
        ("wanted = 0.1\n", 'k = "7*wanted"\n'): "seeks 'k', which is given a formula here",
    }.items():
        with pytest.raises(ModelError, match=says):
            read(HELD.replace(*change)).describe()


def test_the_python_face():
    m = Model("outer", gravity=(0, -9.81))
    x = m.coordinate("x", start=0.1)
    m.body("cart", mass=1, com=(x, 0))
    part = m.assembly("part", "a pendulum on a cart")
    hinge = part.port("hinge", "value", unit="m")
    wagon = part.port("wagon", "body")
    place = part.port("place", "point")
    driven = part.port("driven", "coordinate")
    l, th = part.parameter("l", "0.5 m"), part.coordinate("th", start=0.2)
    part.body("bob", mass=1, com=(hinge + l * symgen.sin(th), -l * symgen.cos(th)))
    part.load("twist", point="at", force=[-th, 0], reaction=wagon)
    part.point("at", "bob")
    part.force(driven, -symgen.dot(th))
    part.output("away", place[0] - hinge)
    curve = part.table("curve", columns=[[0, 1], [0, 2]], outside="extend")
    part.force(th, -curve(th))
    middle = m.point("middle", "cart")
    a = m.use("a", part, hinge=x, wagon="cart", place=middle, driven=x, l="0.7 m")
    b = m.use("b", "part", hinge=x + 1, wagon="cart", place="a.at", driven="a.th")
    m.output("sum", a.th + b["th"] + a.curve(x))
    assert a.bob == "a.bob" and b.l == sympy.Symbol("b.l")
    with pytest.raises(AttributeError, match="'a' has no 'foo'"):
        _ = a.foo
    with pytest.raises(ModelError, match="the assembly is used already, as 'a'"):
        part.coordinate("late")
    with pytest.raises(ModelError, match="a model cannot use itself"):
        m.use("c", m)
    text = m.to_toml()
    assert Model.from_toml(text).to_toml() == text
    made, again = m.derive(), Model.from_toml(text).derive()
    state = random_state(made, np.random.default_rng(1))
    for function in ("rhs", "outputs"):
        assert by_name(made, function, state) == pytest.approx(by_name(again, function, state), rel=1e-12)


def test_commands_know_names_with_dots(tmp_path):
    """Set, started, asked for, recorded, resumed, exported: with the names that the model has."""
    text = PENDULUM + '[use.c]\nassembly = "pendulum"\n[assemblies.pendulum.outputs]\nheight = "bob.y"\n'
    text += '[assemblies.pendulum.stops.wall]\ngap = "0.25 - th"\nrestitution = 0.5\n'
    text += (
        '[assemblies.pendulum.events.low]\nwhen = "th"\nthen = { reset = { "dot(th)" = "0.9*dot(th)" } }\n'
    )
    system = read(text).derive()
    run = system.run(t_end=1.0, parameters={"c.l": 0.8}, start={"c.th": 0.1}, rate={"c.th": 2.0})
    run.save(tmp_path / "run.rrd")
    assert run.status == "success"
    assert {e.name for e in run.events} == {"c.low", "c.wall"}
    assert list(run.keys())[:2] == ["c.th", "dot(c.th)"]
    recording = read_recording(tmp_path / "run.rrd")
    assert recording.parameters == {"c.l": 0.8, "c.m": 2.0}


PLANE = """
[assemblies.rig.bodies.crank]
mass = 1
inertia = 0.1
com = [0.2, 0.05]
[assemblies.rig.bodies.rod]
mass = 2
inertia = 0.2
com = [0.3, 0]
[assemblies.rig.bodies.block]
mass = 1.5
inertia = 0.1
com = [0.1, 0]
[assemblies.rig.bodies.wheel]
mass = 1
inertia = 0.05
com = ["s", "0.3 + h"]
angle = "turn"
[assemblies.rig.coordinates]
s = { guess = 0.3, rate_guess = 0.5 }
h = {}
turn = {}
[assemblies.rig.joints.shaft]
type = "revolute"
child = "crank"
origin = { xyz = [0.1, 0.2, 0] }
[assemblies.rig.joints.pin]
type = "revolute"
parent = "crank"
child = "rod"
origin = { xyz = [0.4, 0, 0] }
[assemblies.rig.joints.free]
type = "planar"
child = "block"
[assemblies.rig.frames.foot]
at = [1.0, 0.1]
rpy = [0, 0, 0.2]
[assemblies.rig.points.end]
body = "rod"
at = [0.6, 0]
[assemblies.rig.points.mark]
at = [0.5, 0.5]
[assemblies.rig.points.side]
body = "block"
at = [0, 0.1]
[assemblies.rig.closures.bore]
type = "prismatic"
frames = ["world", "block"]
axis = [1, 0.5]
damping = 0.3
[assemblies.rig.constraints.way]
point_on_line = { point = "end", line = "mark", direction = [2, -1] }
[assemblies.rig.rolling.wheel]
body = "wheel"
wheel = 0.3
[assemblies.rig.friction.shoe]
speed = "dot(shaft)"
coefficient = 0.2
normal = "bore_off"
smooth = 0.01
[assemblies.rig.bushings.soft]
frames = ["foot", "rod"]
stiffness = [3, 4, 0.5]
damping = [0.1, 0.2, 0.3]
[assemblies.rig.loads.push]
point = "side"
force = [1, "2 + 0.1*end_x"]
[assemblies.rig.loads.own]
point = "end"
frame = "rod"
force = [0.3, 0.4]
[assemblies.rig.loads.pull]
point = "mark"
force = [0.2, 0.7]
reaction = "rod"
[assemblies.rig.rotors.spin]
body = "rod"
inertia = 0.01
[assemblies.rig.constraints.mesh]
gear = { coordinates = ["spin", "shaft"], ratio = 3 }
[assemblies.rig.contacts.pad]
gap = "side_y - 0.05"
stiffness = 1e3
[assemblies.rig.draw.bar]
bar = ["mark", [0, 1]]
[assemblies.rig.draw.arrow]
force = ["end", [1, 0]]
[assemblies.rig.outputs]
bearing = "reaction(shaft, fx, world)"
line = "reaction(way)"
leaning = "angle(world, rod)"
slow = "acceleration(end, y)"
near = "distance(end, mark)"
[use.a]
assembly = "rig"
"""


@pytest.mark.parametrize("rolls", [True, False])
def test_a_rig_turned_in_the_plane_moves_as_one_that_is_not(rolls):
    """Without gravity nothing knows how it stands: closures, guides, rolling, loads, sensors in its own axes.

    What rolls is not shifted: its gap would be the round-off of larger numbers, which is no start.
    """
    text, place = PLANE, "angle = 0.7\n"
    if not rolls:
        wheel = '[assemblies.rig.rolling.wheel]\nbody = "wheel"\nwheel = 0.3\n'
        assert wheel in text
        text, place = text.replace(wheel, ""), f"{place}offset = [2, -1]\n"
    systems = [read(text + more).derive() for more in ("", place)]
    runs = [x.run(t_end=0.4, rtol=1e-11, atol=1e-12) for x in systems]
    for name in (*(x["name"] for x in systems[0].coordinates), *(x["name"] for x in systems[0].outputs)):
        assert runs[1][name][-1] == pytest.approx(runs[0][name][-1], rel=1e-7, abs=1e-8), name
    assert abs(runs[0]["a.shaft"][-1] - runs[0]["a.shaft"][0]) > 1e-3
    names = [x["name"] for x in systems[0].constraints]
    assert names == [x["name"] for x in systems[1].constraints] and ("a.wheel_along" in names) == rolls
    forces = [x.run(t_end=0.4, rtol=1e-11, atol=1e-12, at=[0.4]).multipliers[-1] for x in systems]
    assert forces[1] == pytest.approx(forces[0], rel=1e-6, abs=1e-7)
