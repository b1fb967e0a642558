"""Bodies made of shapes: mass, centre and inertia against volume integrals by quadrature; what is drawn of them."""

from __future__ import annotations

import numpy as np
import pytest
from click.testing import CliRunner
from scipy.spatial.transform import Rotation

from symgen import Model
from symgen.cli import main
from symgen.errors import ModelError
from symgen.link import derive
from symgen.model.from_sympy import to_sympy
from symgen.model.solids import FORMS
from symgen.model.toml_reader import read_text
from symgen.runtime.batches import evaluate
from symgen.runtime.recording.geometry import primitives
from symgen.runtime.recording.solids import surface

SIZES = {
    "box": (0.3, 0.2, 0.5), "ellipsoid": (0.3, 0.2, 0.5), "sphere": (0.3,), "cylinder": (0.2, 0.7),
    "tube": (0.3, 0.1, 0.5), "cone": (0.3, 0.8), "capsule": (0.2, 0.6),
}  # fmt: skip
NODES, WEIGHTS = np.polynomial.legendre.leggauss(40)


def quadrature(kind: str, sizes: tuple[float, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Points inside a solid about its middle, and the volumes that they stand for: by its outline, not by formulas."""
    if kind == "box":
        grid = np.stack(np.meshgrid(NODES, NODES, NODES), axis=-1).reshape(-1, 3) * np.array(sizes) / 2
        weights = np.einsum("i,j,k->ijk", WEIGHTS, WEIGHTS, WEIGHTS).ravel() * np.prod(sizes) / 8
        return grid, weights
    if kind == "ellipsoid":
        points, weights = quadrature("sphere", (1.0,))
        return points * sizes, weights * np.prod(sizes)
    pieces = [(-sizes[-1] / 2, sizes[-1] / 2)]
    if kind == "sphere":
        pieces = [(-sizes[0], sizes[0])]
    elif kind == "capsule":
        r, half = sizes[0], sizes[1] / 2
        pieces = [(-half - r, -half), (-half, half), (half, half + r)]

    def radii(z):
        """The inner and outer radius at a height."""
        if kind == "sphere":
            return 0.0, np.sqrt(sizes[0] ** 2 - z**2)
        if kind == "capsule":
            return 0.0, np.sqrt(sizes[0] ** 2 - max(abs(z) - sizes[1] / 2, 0.0) ** 2)
        if kind == "cone":
            return 0.0, sizes[0] * (0.5 - z / sizes[1])
        return (sizes[1] if kind == "tube" else 0.0), sizes[0]

    angle = 2 * np.pi * np.arange(16) / 16
    points, weights = [], []
    for low, high in pieces:
        for node, weight in zip(NODES, WEIGHTS):
            z, dz = (low + high) / 2 + node * (high - low) / 2, weight * (high - low) / 2
            inner, outer = radii(z)
            r = (inner + outer) / 2 + NODES * (outer - inner) / 2
            ring = np.repeat(WEIGHTS * (outer - inner) / 2 * r * dz, 16) * 2 * np.pi / 16
            around = np.stack(
                [np.outer(r, np.cos(angle)).ravel(), np.outer(r, np.sin(angle)).ravel()], axis=1
            )
            points.append(np.column_stack([around, np.full(len(around), z)]))
            weights.append(ring)
    return np.concatenate(points), np.concatenate(weights)


def moments(points: np.ndarray, masses: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
    """Mass, centre and tensor about it of point masses."""
    mass = masses.sum()
    centre = masses @ points / mass
    d = points - centre
    tensor = np.einsum(
        "n,nij->ij", masses, np.einsum("nk,nk,ij->nij", d, d, np.eye(3)) - d[:, :, None] * d[:, None]
    )
    return mass, centre, tensor


def body_of(model: Model) -> tuple[float, np.ndarray, np.ndarray]:
    """Mass, centre and tensor of the first body at the parameters' values."""
    d = model.describe()
    values = {p.name: p.value for p in d.parameters}
    number = [
        float(to_sympy(x).subs(values)) for x in (d.bodies[0].mass, *d.bodies[0].com, *d.bodies[0].inertia)
    ]
    mass, centre, inertia = number[0], np.array(number[1:4]), [*number[4:], 0.0, 0.0, 0.0]
    xx, yy, zz, xy, xz, yz = inertia[:6]
    return mass, centre, np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def at_state(system, function: str, y, **parameters: float) -> np.ndarray:
    """What a function writes in a state."""
    p = system.parameter_values(parameters)
    return evaluate(system, function, p, np.zeros(1), np.array([y], dtype=float))[0]


def hung(shape, **more) -> Model:
    """A model with a body of these shapes on a free joint."""
    m = Model("hung")
    m.parameters(a=0.3, rho="7850 kg/m^3")
    m.body("b", shape=shape, density="rho", **more)
    m.joint("j", "free", child="b", rate=[0, 0, 0, 1, 2, 3])
    return m


@pytest.mark.parametrize("kind", FORMS)
def test_a_solid_has_the_integrals_of_its_volume(kind):
    points, volumes = quadrature(kind, SIZES[kind])
    mass, centre, tensor = moments(points, 7850.0 * volumes)
    found = body_of(hung({kind: list(SIZES[kind])}))
    assert found[0] == pytest.approx(mass, rel=1e-6)
    assert found[1] == pytest.approx(centre, abs=1e-6)
    assert found[2] == pytest.approx(tensor, abs=1e-6 * tensor.max())


@pytest.mark.parametrize("kind", FORMS)
def test_a_surface_holds_the_volume(kind):
    drawn = surface(kind, np.array(SIZES[kind]))
    a, b, c = drawn.vertices[drawn.triangles].transpose(1, 0, 2)
    volume = np.einsum("ni,ni->", a, np.cross(b, c)) / 6
    assert volume == pytest.approx(quadrature(kind, SIZES[kind])[1].sum(), rel=0.03)
    assert volume <= quadrature(kind, SIZES[kind])[1].sum() * (1 + 1e-12)  # corners lie on the surface


def test_several_shapes_add_and_holes_are_taken_away():
    rpy, axis = (0.4, -0.3, 1.1), np.array([1.0, 2.0, -0.5])
    shapes = [
        {"box": ["a", 0.2, 0.5], "offset": [0.1, -0.2, 0.3], "rpy": list(rpy)},
        {"cone": [0.2, 0.5], "offset": [0.5, 0.0, 0.1], "axis": list(axis), "density": "2700 kg/m^3"},
        {"cylinder": [0.05, 0.1], "offset": [0.1, -0.2, 0.3], "cut": True},
        {"sphere": [3.0], "density": 0},
    ]
    parts = []
    for kind, sizes, turn, offset, density in (
        ("box", (0.3, 0.2, 0.5), Rotation.from_euler("xyz", rpy), (0.1, -0.2, 0.3), 7850.0),
        ("cone", (0.2, 0.5), Rotation.align_vectors([axis], [[0, 0, 1]])[0], (0.5, 0.0, 0.1), 2700.0),
        ("cylinder", (0.05, 0.1), Rotation.identity(), (0.1, -0.2, 0.3), -7850.0),
    ):
        points, volumes = quadrature(kind, sizes)
        parts.append((turn.apply(points) + offset, density * volumes))
    mass, centre, tensor = moments(*(np.concatenate(column) for column in zip(*parts)))
    found = body_of(hung(shapes))
    assert found[0] == pytest.approx(mass, rel=1e-6)
    assert found[1] == pytest.approx(centre, abs=1e-6)
    assert found[2] == pytest.approx(tensor, abs=1e-6 * tensor.max())


def test_equations_are_those_of_the_same_body_stated_by_hand():
    system = hung(
        [{"box": ["a", 0.2, 0.5], "offset": [0.1, 0, 0]}, {"sphere": [0.2], "offset": [0, 0.4, 0]}]
    ).derive()
    for a in (0.3, 0.5):  # mass and inertia follow the parameter without deriving again
        one, other = quadrature("box", (a, 0.2, 0.5)), quadrature("sphere", (0.2,))
        points = np.concatenate([one[0] + [0.1, 0, 0], other[0] + [0, 0.4, 0]])
        mass, centre, tensor = moments(points, 7850.0 * np.concatenate([one[1], other[1]]))
        stated = Model("stated")
        (xx, xy, xz), (_, yy, yz), (_, _, zz) = tensor
        stated.body("b", mass=mass, com=list(centre), inertia=[xx, yy, zz, xy, xz, yz])
        stated.joint("j", "free", child="b", rate=[0, 0, 0, 1, 2, 3])
        y = [0.1, 0.2, 0.3, 0.5, 0.5, -0.5, 0.5, 1.0, 2.0, 3.0, -1.0, 0.5, 0.7]
        expected = at_state(stated.derive(), "rhs", y)
        assert at_state(system, "rhs", y, a=a) == pytest.approx(expected, rel=1e-5, abs=1e-5)


def test_planar_bodies_turn_about_z():
    m = Model("pendulum", gravity=(0, -9.81))
    phi = m.coordinate("phi", start=1.0)
    m.body(
        "rod", shape={"cylinder": [0.01, 1.0]}, density=1000, com=["0.5*cos(phi)", "0.5*sin(phi)"], angle=phi
    )
    m.body("bar", shape=[{"box": [1.0, 0.02, 0.02], "offset": [0.5, 0]}], density=1000)
    m.joint("pin", "revolute", child="bar")
    rod, bar = m.describe().bodies
    assert float(rod.inertia[0]) == pytest.approx(float(rod.mass) * (0.01**2 / 4 + 1 / 12))
    assert bar.planar and bar.com[0] == 0.5 and len(bar.inertia) == 1
    assert float(bar.inertia[0]) == pytest.approx(1000 * 4e-4 * (1 + 4e-4) / 12)
    assert (rod.shape.kind, bar.shape.kind) == ("cylinder", "solids")


def test_solids_are_drawn_where_they_are():
    system = hung([
        {"box": [0.2, 0.4, 0.6], "offset": [0.1, 0, 0]},
        {"tube": [0.2, 0.1, 1.0], "offset": [0, 0.5, 0], "axis": [1, 0, 0]},
        {"sphere": [0.02], "cut": True},
    ]).derive()  # fmt: skip
    bodies = system.bodies
    assert bodies[0]["parts"] == ["box", "tube"]
    y = [0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0]
    sizes, pose = at_state(system, "shapes", y), at_state(system, "poses", y)[:3]
    drawn = primitives(bodies, sizes, np.eye(3)[None, None], 1.0, None)[0]
    box, tube = (s.vertices + pose for s in drawn.surfaces)
    assert np.allclose([box.min(axis=0), box.max(axis=0)], [[0, -0.2, -0.3], [0.2, 0.2, 0.3]])
    assert np.allclose([tube.min(axis=0), tube.max(axis=0)], [[-0.5, 0.3, -0.2], [0.5, 0.7, 0.2]])


ROD = """
[parameters]
l = "0.3 m"
rho = "7850 kg/m^3"

[bodies.rod]
shape = [{ box = ["l", 0.02, 0.02], offset = ["l/2", 0, 0] }, { cone = [0.008, 0.1], axis = [1, 0, 0], cut = true }]
density = "rho"

[joints.pin]
type = "revolute"
child = "rod"
"""


def test_files_round_trip():
    text = read_text(ROD).to_toml()
    assert read_text(text).to_toml() == text
    assert read_text(text).describe().bodies == read_text(ROD).describe().bodies


@pytest.mark.parametrize(
    "old, new, place, words",
    [
        ("cone =", "cane =", "shape[1].cane", "did you mean 'cone'"),
        ("[0.008, 0.1]", "[0.008]", "shape[1].cone", r"\[radius, height\]"),
        ('"l", 0.02, 0.02', '"l", 0.02, 0', "shape[0].box, element 3", "not positive"),
        ("axis = [1, 0, 0]", "axis = [1, 0, 0], rpy = [0, 0, 0]", "shape[1].rpy", "both turn it"),
        ('offset = ["l/2", 0, 0]', "axis = [1, 0, 0]", "shape[0].axis", "'rpy'"),
        ("cut = true", "cut = 1", "shape[1].cut", "true or false"),
        ("cone = [0.008, 0.1]", "cone = [0.2, 0.1]", "shape", "holes .* larger"),
        ("cone = [0.008, 0.1], axis = [1, 0, 0]", 'box = ["l", 0.02, 0.02]', "shape", "holes .* larger"),
        ("cone = [0.008, 0.1]", "tube = [0.1, 0.2, 1]", "shape[1].tube, element 2", "not below the outer"),
        ('offset = ["l/2", 0, 0]', "offset = 0.1", "shape[0].offset", "write it in brackets"),
        ("cone = [0.008, 0.1]", "cone = [1e308, 0.1]", "mass", "no finite value"),
        ('density = "rho"', 'density = "rho"\nmass = 2', "mass", "follows from the shapes"),
        ('density = "rho"', 'density = "l"', "density", "units do not match"),
        ('density = "rho"', 'mass = 1\ndensity = "pin"', "mass", "follows"),
        ('density = "rho"', 'density = "rho*(1 + pin)"', "density", "cannot depend on a coordinate"),
        ('density = "rho"', 'density = "rho"\ncom = [0, 0, 0]', "com", "leave out 'com'"),
        ('"rod"\n', '"red"\n', "child", "no body 'red'"),
        (
            '[joints.pin]\ntype = "revolute"\nchild = "rod"',
            "[coordinates]\nq = {}",
            "com",
            "'com' is missing",
        ),
    ],
)
def test_wrong_shapes(old, new, place, words):
    assert old in ROD
    with pytest.raises(ModelError, match=words) as caught:
        read_text(ROD.replace(old, new), file="rod.toml").describe()
    assert caught.value.key == place


def test_numbers_that_make_a_body_too_large_are_refused():
    m = Model("star")
    with pytest.raises(ModelError, match=r"shape: the mass or inertia .* beyond what numbers hold"):
        m.body("star", density=1, com=(0, 0, 0), shape={"sphere": [1e200]})


def test_a_shape_that_is_only_drawn_has_no_mass():
    system = derive(
        read_text("""
[coordinates]
x = {}
[bodies.nose]
mass = 2
com = ["x", 0, 0]
shape = [{ cone = [0.1, 0.2], axis = [1, 0, 0], offset = [0.3, 0, 0] }, { ellipsoid = [0.3, 0.1, 0.1] }]
""")
    )
    assert at_state(system, "mass_matrix", [0, 0]) == 2.0
    assert system.bodies[0]["parts"] == ["cone", "ellipsoid"]


def stl(kind: str, sizes, shift, *, binary: bool) -> bytes:
    """The surface of a solid as an STL file."""
    drawn = surface(kind, np.array(sizes))
    corners = (drawn.vertices + shift)[drawn.triangles]
    if not binary:
        facets = ("".join(f" vertex {x!r} {y!r} {z!r}\n" for x, y, z in t.tolist()) for t in corners)
        return ("solid s\n" + "".join(f"facet\n{facet}endfacet\n" for facet in facets)).encode()
    rows = b"".join(bytes(12) + t.astype("<f4").tobytes() + bytes(2) for t in corners)
    return bytes(80) + len(corners).to_bytes(4, "little") + rows


def with_mesh(folder, **more) -> Model:
    m = Model("meshed", folder=folder)
    m.parameter("rho", "7850 kg/m^3")
    m.body("b", shape={"mesh": "part.stl"}, density="rho", **more)
    m.joint("j", "free", child="b")
    return m


@pytest.mark.parametrize("binary", [False, True])
def test_a_closed_mesh_has_the_integrals_of_its_volume(tmp_path, binary):
    (tmp_path / "part.stl").write_bytes(stl("box", SIZES["box"], [0.1, -0.2, 0.4], binary=binary))
    points, volumes = quadrature("box", SIZES["box"])
    mass, centre, tensor = moments(points + np.array([0.1, -0.2, 0.4]), 7850.0 * volumes)
    found = body_of(with_mesh(tmp_path))
    assert found[0] == pytest.approx(mass, rel=1e-6)
    assert found[1] == pytest.approx(centre, abs=1e-7)
    assert found[2] == pytest.approx(tensor, abs=1e-6 * tensor.max())


def test_a_mesh_of_many_sides_is_near_the_solid(tmp_path):
    (tmp_path / "part.stl").write_bytes(stl("cone", SIZES["cone"], [0, 0, 0], binary=True))
    points, volumes = quadrature("cone", SIZES["cone"])
    mass, centre, tensor = moments(points, 7850.0 * volumes)
    found = body_of(with_mesh(tmp_path))
    assert found[0] == pytest.approx(mass, rel=0.01)
    assert found[1] == pytest.approx(centre, abs=1e-4)
    assert found[2] == pytest.approx(tensor, abs=0.02 * tensor.max())


def test_a_heavy_mesh_is_drawn_where_it_is(tmp_path):
    (tmp_path / "part.stl").write_bytes(stl("box", SIZES["box"], [0.1, -0.2, 0.4], binary=False))
    m = with_mesh(tmp_path)
    assert Model.from_toml(m.to_toml(), folder=tmp_path).to_toml() == m.to_toml()
    system = m.derive()
    sizes = at_state(system, "shapes", [0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0])
    assert sizes == pytest.approx([-0.1, 0.2, -0.4])  # of its own origin from the centre of mass
    (drawn,) = primitives(system.bodies, sizes, np.eye(3)[None, None], 1.0, tmp_path)
    assert (drawn.kind, drawn.half_thickness()) == ("mesh", 0.0)
    (tmp_path / "meshed.toml").write_text(m.to_toml(), encoding="utf-8")
    arguments = ["run", str(tmp_path / "meshed.toml"), "--t-end", "0.1", "--log", str(tmp_path / "run.rrd")]
    assert CliRunner().invoke(main, arguments).exit_code == 0
    assert (tmp_path / "run.rrd").stat().st_size > 10_000


@pytest.mark.parametrize(
    "make, words",
    [
        (lambda whole: whole[:-1], "no STL file"),
        (lambda whole: b"solid nothing", "no STL file"),
        (lambda whole: bytes(80) + (11).to_bytes(4, "little") + whole[84:-50], "not closed: 3 edges"),
    ],
)
def test_meshes_that_hold_nothing(tmp_path, make, words):
    (tmp_path / "part.stl").write_bytes(make(stl("box", SIZES["box"], [0, 0, 0], binary=True)))
    with pytest.raises(ModelError, match=words):
        with_mesh(tmp_path)


def test_a_mesh_turned_inside_out_is_refused(tmp_path):
    whole = stl("box", SIZES["box"], [0, 0, 0], binary=True)
    rows = [bytearray(whole[84 + 50 * k : 134 + 50 * k]) for k in range(12)]
    for row in rows:
        row[12:24], row[24:36] = row[24:36], row[12:24]
    (tmp_path / "part.stl").write_bytes(whole[:84] + b"".join(rows))
    with pytest.raises(ModelError, match=r"holds no volume"):
        with_mesh(tmp_path)


def test_numbers_alone_make_numbers():
    """Sizes without parameters: no expression is left but the density."""
    body = (
        hung([{"cylinder": [0.2, 0.5]}, {"box": [0.1, 0.2, 0.3], "offset": [0.3, 0, 0]}]).describe().bodies[0]
    )
    assert all(x.is_Number for x in body.com)
    assert all(
        {symbol.name for symbol in x.free_symbols} == {"rho"} and x.args[0].is_Number
        for x in (body.mass, *body.inertia[:3])
    )


def test_shapes_of_density_zero_are_drawn_only():
    m = Model("drawn")
    m.body("b", shape=[{"sphere": [0.1]}, {"box": [1, 1, 1], "offset": [1, 0, 0]}], density=0)
    m.joint("j", "free", "b")
    with pytest.raises(ModelError, match="moves nothing that has mass"):
        m.describe()
