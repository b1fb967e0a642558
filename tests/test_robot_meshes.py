"""Pictures of imported robots: simple solids as shapes, meshes as a file for each link, and nothing read elsewhere."""

from __future__ import annotations

import struct

import numpy as np
import pytest
from click.testing import CliRunner

from symgen import Model
from symgen.cli import main
from symgen.errors import ModelError
from symgen.robots.build import import_urdf
from symgen.robots.pictures import Pictures

CORNERS = np.array([[0, 0, 0], [1, 0, 0], [0, 2, 0], [0, 0, 3]], dtype=float)
TRIANGLES = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
ROBOT = """<robot name="one">
  <material name="paint"><color rgba="1 0.5 0 1"/></material>
  <link name="base"/>
  <joint name="turn" type="continuous"><parent link="base"/><child link="arm"/><axis xyz="0 0 1"/></joint>
  <link name="arm">
    <inertial><origin xyz="0.1 0 0"/><mass value="1"/><inertia ixx="1" iyy="1" izz="1"/></inertial>
    <visual><origin xyz="1 2 3" rpy="0 0 1.5707963"/><geometry>{geometry}</geometry><material name="paint"/></visual>
    <collision><geometry><mesh filename="/etc/passwd"/></geometry></collision>
  </link>
</robot>"""


def stl(corners=CORNERS):
    rows = [struct.pack("<12fH", 0, 0, 0, *corners[triangle].ravel(), 0) for triangle in TRIANGLES]
    return b"\0" * 80 + struct.pack("<I", len(rows)) + b"".join(rows)


def robot(folder, geometry):
    folder.mkdir(exist_ok=True)
    path = folder / "one.urdf"
    path.write_text(ROBOT.format(geometry=geometry))
    return path


def mesh(name, scale=""):
    return f'<mesh filename="{name}" {scale}/>'


def test_solids_are_shapes(tmp_path):
    path = robot(tmp_path, '<cylinder radius="0.1" length="0.5"/>')
    model = Model.from_urdf(path)
    body = next(b for b in model.describe().bodies if b.name == "arm")
    assert body.color == "#ff8000"
    assert [float(x) for x in body.solids[0].offset] == [1, 2, 3]
    assert Model.from_toml(model.to_toml()).to_toml() == model.to_toml()


@pytest.mark.parametrize("where", ["beside", "package", "folder_of_packages", "above", "ros", "ament"])
def test_a_mesh_is_found_scaled_and_placed(tmp_path, monkeypatch, where):
    trimesh = pytest.importorskip("trimesh")
    name, packages = "package://stones/meshes/stone.stl", []
    home = tmp_path / "stones"
    path = robot(home if where == "above" else tmp_path / "robots", mesh(name, 'scale="0.1 0.1 -0.2"'))
    if where == "beside":
        home, name = tmp_path / "robots", "meshes/stone.stl"
        path = robot(home, mesh(name, 'scale="0.1 0.1 -0.2"'))
    elif where == "package":
        packages = [home]
    elif where == "folder_of_packages":
        packages = [tmp_path]
    elif where == "ros":
        monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path))
    elif where == "ament":
        home = tmp_path / "share" / "stones"
        monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path))
    (home / "meshes").mkdir(parents=True)
    (home / "meshes" / "stone.stl").write_bytes(stl())
    (home / "package.xml").write_text("<package/>")
    model = Model.from_urdf(path, meshes=tmp_path / "out_meshes", package_path=packages)
    scene = trimesh.load_scene(tmp_path / "out_meshes" / "arm.glb")
    x, y, z = (CORNERS * [0.1, 0.1, -0.2]).T
    expected = np.stack([1 - y, 2 + x, 3 + z], axis=1)
    found = scene.dump()[0].vertices
    assert np.abs(found[:, None] - expected).max(axis=2).min(axis=0).max() < 1e-6
    assert 'shape = { mesh = "out_meshes/arm.glb", offset = [0, 0, 0] }' in model.to_toml()
    body = next(b for b in model.derive().bodies if b["name"] == "arm")
    assert body["shape"] == "mesh" and body["sizes"] == 3


REFUSED = {
    "missing": ("gone.stl", "is not there"),
    "unknown package": ("package://nobody_has_this/stone.stl", "is not known"),
    "above": ("../stone.stl", "leads out"),
    "above a package": ("package://stones/../stone.stl", "leads out"),
    "package is above": ("package://../stone.stl", "names no package"),
    "absolute": ("/etc/passwd", "leads out"),
    "absolute in a package": ("package:///etc/passwd", "names no package"),
    "address of a file": ("file:///etc/passwd", "is an address"),
    "address": ("https://example.org/stone.stl", "is an address"),
    "drive": ("C:stone.stl", "leads out"),
    "backslashes": ("..\\stone.stl", "leads out"),
    "link": ("link.stl", "a link that leads out"),
    "linked folder": ("linked/passwd", "a link that leads out"),
    "kind": ("one.urdf", "of a kind that is not read"),
    "no mesh": ("broken.stl", "has no triangles"),
    "not finite": ("nan.stl", "no finite number"),
    "entities": ("bomb.dae", "document type"),
    "device": ("null.stl", "a link that leads out"),
    "archive": ("stone.zae", "of a kind that is not read"),
}


@pytest.mark.parametrize("kind", REFUSED)
def test_what_is_no_mesh_of_the_robot_is_refused_with_its_line(tmp_path, kind):
    pytest.importorskip("trimesh")
    name, says = REFUSED[kind]
    home = tmp_path / "robots"
    path = robot(home, mesh(name))
    (tmp_path / "stone.stl").write_bytes(stl())
    (home / "link.stl").symlink_to(tmp_path / "stone.stl")
    (home / "linked").symlink_to("/etc")
    (home / "null.stl").symlink_to("/dev/zero")
    (home / "broken.stl").write_bytes(b"solid of nothing")
    (home / "nan.stl").write_bytes(stl(np.where(CORNERS == 3, np.nan, CORNERS)))
    (home / "bomb.dae").write_text('<!DOCTYPE x [<!ENTITY a "aaaa">]><COLLADA>&a;</COLLADA>')
    (home / "stone.zae").write_bytes(b"PK\3\4")
    with pytest.raises(ModelError) as caught:
        Model.from_urdf(path, meshes=tmp_path / "meshes", package_path=home.parent)
    assert says in str(caught.value) and "line 7" in str(caught.value)
    lenient = import_urdf(path, pictures=Pictures(tmp_path / "other", (home.parent,)))
    assert any(says in note and "line 7" in note for note in lenient.notes)
    assert not (tmp_path / "meshes").exists() and not (tmp_path / "other").exists()


def test_the_command_keeps_or_drops_meshes_and_writes_over_nothing(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = robot(tmp_path / "robots", mesh("stone.stl"))
    run = CliRunner().invoke
    result = run(main, ["import", str(path), "--meshes", "keep"])
    assert result.exit_code == 1 and ("is not there" in result.output or "symgen[meshes]" in result.output)
    assert not [*tmp_path.glob("*meshes")] and not (tmp_path / "one.toml").exists()
    assert run(main, ["import", str(path), "--meshes", "drop", "-o", "a.toml"]).exit_code == 0
    pytest.importorskip("trimesh")
    (tmp_path / "robots" / "stone.stl").write_bytes(stl())
    assert run(main, ["import", str(path), "-o", "b.toml"]).exit_code == 0
    assert (tmp_path / "b_meshes" / "arm.glb").is_file()
    (tmp_path / "b.toml").unlink()
    again = run(main, ["import", str(path), "-o", "b.toml"])
    assert again.exit_code == 2 and "b_meshes is there already" in again.output
    assert {p.name for p in tmp_path.iterdir()} == {"robots", "a.toml", "b_meshes"}


def test_meshes_of_mjcf_lie_where_mujoco_has_them(tmp_path):
    mujoco, trimesh = pytest.importorskip("mujoco"), pytest.importorskip("trimesh")
    (tmp_path / "stone.stl").write_bytes(stl())
    path = tmp_path / "one.xml"
    path.write_text(
        """<mujoco><asset><mesh name="stone" file="stone.stl" scale=".1 .1 .2"/></asset><worldbody>
        <body pos="0 0 1"><joint axis="0 1 0" pos=".3 0 0"/>
          <geom type="mesh" mesh="stone" pos=".1 .2 .3" euler="20 30 40" rgba="1 0 0 1"/>
          <geom type="sphere" size=".1" group="3"/></body></worldbody></mujoco>"""
    )
    Model.from_mjcf(path, meshes=tmp_path / "one_meshes")
    vertices = trimesh.load_scene(tmp_path / "one_meshes" / "body1.glb").to_geometry().vertices
    m = mujoco.MjModel.from_xml_path(str(path))
    d = mujoco.MjData(m)
    mujoco.mj_forward(m, d)
    expected = m.mesh_vert @ d.geom_xmat[0].reshape(3, 3).T + d.geom_xpos[0] - d.xanchor[0]
    assert np.abs(vertices[:, None] - expected).max(axis=2).min(axis=0).max() < 1e-6


def test_axes_that_are_nearly_parallel_keep_all_digits(tmp_path):
    """Their common normal is far away: inertias about it would lose the square of that."""
    pin = pytest.importorskip("pinocchio")
    from symgen.link import derive
    from symgen.robots.agreement import compare_with_pinocchio

    text = "<robot name='r'><link name='l0'/>"
    for k, tilt in enumerate((0.3, 1.4e-7, 3e-4, 2e-2, 1.0)):
        text += (
            f"<joint name='j{k}' type='continuous'><parent link='l{k}'/><child link='l{k + 1}'/>"
            f"<origin xyz='0.3 0.1 0.2' rpy='{tilt} 0 0.5'/><axis xyz='0 0 1'/></joint><link name='l{k + 1}'>"
            "<inertial><origin xyz='0.1 0.2 0.3'/><mass value='1'/>"
            "<inertia ixx='.1' iyy='.1' izz='.1' ixy='0' ixz='0' iyz='0'/></inertial></link>"
        )
    path = tmp_path / "r.urdf"
    path.write_text(text + "</robot>")
    imported = import_urdf(path)
    found = compare_with_pinocchio(derive(imported.model), imported)
    assert max(found.mass_matrix, found.bias, found.accelerations, found.rotations) < 1e-12, pin.__version__
