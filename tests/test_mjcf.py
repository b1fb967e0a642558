"""Robots from MJCF: what MuJoCo's compiler makes of a file is what moves; what the file names stays in its folder."""

from __future__ import annotations

import os
from importlib.util import find_spec

import numpy as np
import pytest
from click.testing import CliRunner

import symgen
from symgen import Model, link
from symgen.cli import main
from symgen.errors import ModelError
from symgen.model.library import bundled_folder
from symgen.robots import mjcf, mjcf_files, xml_tree
from symgen.robots.mjcf import import_mjcf
from symgen.robots.mjcf_agreement import compare_with_mujoco
from symgen.robots.mjcf_files import check_files

# Several joints in a body with anchors off its origin, `ref`, springs, rotors, a ball, inertia from turned geoms, all
# kinds of actuators that are taken, tendons of joints and of sites.
WALKER = """<mujoco model="odd walker">
  <compiler angle="degree" autolimits="true"/>
  <option gravity="0.1 0 -9.81"/>
  <worldbody>
    <geom name="floor" type="plane" size="5 5 .1"/>
    <body name="torso" pos="0 0 1" euler="10 20 30">
      <freejoint name="root"/>
      <geom type="capsule" size=".1 .2" pos=".1 0 0" euler="0 40 0"/>
      <site name="hook" pos="0 .1 .2"/>
      <body name="thigh" pos=".1 .2 -.3" euler="0 0 15">
        <joint name="hip x" type="hinge" axis="1 0 0" pos="0 0 .1" ref="20" range="-40 60"/>
        <joint name="hip_y" type="hinge" axis="0 1 .5" pos=".05 0 .1" stiffness="3" springref="12" damping=".2"/>
        <joint name="slide" type="slide" axis="0 0 1" pos=".1 .1 0" ref=".1" armature=".3" frictionloss=".4"/>
        <geom type="box" size=".05 .06 .2" pos="0 0 -.1" euler="5 6 7"/>
        <site name="knee" pos="0 0 -.3" euler="30 0 0"/>
        <body name="foot" pos="0 0 -.4">
          <joint name="ankle" type="ball" pos="0 .02 .05" damping=".1"/>
          <geom type="ellipsoid" size=".1 .05 .04" pos=".05 0 0"/>
        </body>
      </body>
      <body name="arm" pos="-.2 0 .1">
        <joint name="shoulder" axis="0 1 0"/>
        <inertial pos="0 .1 0" mass="2" diaginertia=".1 .2 .15" quat=".9 .1 .3 .2"/>
        <body name="eye" pos="0 .2 0"><site name="lens"/></body>
      </body>
    </body>
  </worldbody>
  <tendon>
    <fixed name="coupled" stiffness="5" damping=".3">
      <joint joint="hip x" coef="2"/><joint joint="shoulder" coef="-1"/>
    </fixed>
    <spatial name="rope" stiffness="7" springlength=".2 .3" damping=".1" armature=".05">
      <site site="hook"/><site site="knee"/><pulley divisor="2"/><site site="knee"/><site site="lens"/>
    </spatial>
  </tendon>
  <actuator>
    <motor name="push" joint="hip x" gear="3" ctrlrange="-.4 .4"/>
    <position name="servo" joint="shoulder" kp="4" kv=".5"/>
    <velocity name="brake" joint="hip_y" kv="2"/>
    <general name="affine" joint="slide" gaintype="affine" gainprm="1 2 3" biastype="affine"
             biasprm=".5 -1 -.2" gear="2"/>
    <motor name="pull" tendon="rope" gear="1.5"/>
    <motor name="twist" tendon="coupled"/>
    <motor name="jet" site="knee" gear="1 2 3 .1 .2 .3"/>
    <general name="slow" joint="shoulder" dyntype="filter" dynprm=".2" gainprm="3"/>
    <muscle name="muscle" joint="hip_y" lengthrange="-1 1"/>
  </actuator>
  <sensor>
    <jointpos name="hip" joint="hip x"/><tendonpos name="length" tendon="rope"/>
    <framepos name="place" objtype="site" objname="lens"/><gyro name="gyro" site="hook"/>
  </sensor>
  <keyframe><key name="bent" qpos="0 0 2 1 0 0 0 .5 .1 .2 1 0 0 0 .3" qvel="1 0 0 0 0 0 0 0 0 0 0 0 2"/></keyframe>
</mujoco>
"""
LEG = """<mujoco model="leg">
  <worldbody>
    <body name="crank" pos="0 0 0"><joint name="a" axis="0 1 0"/><geom type="capsule" fromto="0 0 0 .2 0 0" size=".02"/>
      <body name="coupler" pos=".2 0 0"><joint name="b" axis="0 1 0"/>
        <geom type="capsule" fromto="0 0 0 .5 0 .1" size=".02"/>
      </body>
    </body>
    <body name="rocker" pos=".5 0 -.1"><joint name="c" axis="0 1 0"/>
      <geom type="capsule" fromto="0 0 0 .2 0 .2" size=".02"/>
      <body name="toe" pos=".2 0 .2"><joint name="d" axis="0 1 0"/><geom type="sphere" size=".05" pos=".1 0 0"/></body>
    </body>
    <body name="pad" pos=".8 .1 .2"><freejoint/><geom type="sphere" size=".03"/></body>
  </worldbody>
  <equality>
    <connect name="pin" body1="coupler" body2="rocker" anchor=".5 0 .1"/>
    <joint name="gear" joint1="d" joint2="a" polycoef=".1 .5 .2 0 0"/>
    <weld name="glue" body1="pad" body2="toe"/>
  </equality>
</mujoco>
"""
HEAD, TAIL = '<mujoco><worldbody><body><joint/><geom size=".1"/></body></worldbody>', "</mujoco>"

needs_mujoco = pytest.mark.skipif(find_spec("mujoco") is None, reason="mujoco is not installed")


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "robots" / "robot.xml"
    path.parent.mkdir()

    def write(text):
        path.write_text(text, encoding="utf-8")
        return path

    return write


@needs_mujoco
def test_a_walker_agrees_with_mujoco(file):
    imported = import_mjcf(file(WALKER))
    found = vars(compare_with_mujoco(link.derive(imported.model), imported, 10))
    assert found.pop("states") == 10
    assert max(found.values()) < 1e-9, found
    notes = " ".join(imported.notes)
    for word in ("muscle", "gyro", "contacts are left out", "friction"):
        assert word in notes
    assert set(imported.actuators.values()) == {
        "push", "servo", "brake", "affine", "pull", "twist", "jet", "slow",
    }  # fmt: skip


@needs_mujoco
def test_the_comparison_sees_what_is_wrong(file):
    imported = import_mjcf(file(WALKER))
    imported.model.force("shoulder", 0.01)
    found = compare_with_mujoco(link.derive(imported.model), imported, 3)
    assert found.bias > 1e-5
    assert found.mass_matrix < 1e-12


@needs_mujoco
def test_sensors_and_keyframes(file):
    import mujoco

    path = file(WALKER)
    system = Model.from_mjcf(path, keyframe="bent").derive()
    solution = system.run(1e-3)
    m = mujoco.MjModel.from_xml_path(str(path))
    d = mujoco.MjData(m)
    mujoco.mj_resetDataKeyframe(m, d, 0)
    mujoco.mj_forward(m, d)
    theirs = dict(zip(("hip", "length", "place"), np.split(d.sensordata[:5], [1, 2]), strict=True))
    np.testing.assert_allclose(solution["hip"][0], theirs["hip"][0], atol=1e-12)
    np.testing.assert_allclose(solution["length"][0], theirs["length"][0], atol=1e-12)
    place = [solution[f"place_{c}"][0] for c in "xyz"]
    np.testing.assert_allclose(place, theirs["place"], atol=1e-12)
    assert solution["dot(shoulder)"][0] == 2.0
    with pytest.raises(ModelError, match="no keyframe 'bend'"):
        Model.from_mjcf(path, keyframe="bend")


@needs_mujoco
def test_equalities_are_exact(file):
    imported = import_mjcf(file(LEG))
    system = link.derive(imported.model)
    found = vars(compare_with_mujoco(system, imported, 5))
    assert all(value < 1e-9 for name, value in found.items() if name not in ("states", "accelerations"))
    solution = Model.from_mjcf(imported.file).derive().run(2.0, rate={"a": 1.0})
    assert solution.status == "success", solution.message
    states = solution.states
    p = system.parameter_values()
    worst = max(
        np.abs(system.kernel("constraint_residual")(t, y[: system.nq + system.nv], p)[: system.nh]).max()
        for t, y in zip(solution.t, states, strict=True)
    )
    assert worst < 1e-12
    a, d = solution["a"], solution["d"]
    np.testing.assert_allclose(d, 0.1 + 0.5 * a + 0.2 * a**2, atol=1e-10)
    assert sum("exact constraint" in note for note in imported.notes) == 3


def delta_robot() -> str:
    """Three arms with two rods each, on balls, which carry a platform: six loops."""
    arms, pins = "", ""
    for k in range(3):
        rods = ""
        for side, y in (("a", -0.05), ("b", 0.05)):
            rods += f"""<body name="rod{k}{side}" pos="0.25 {y} 0"><joint name="ball{k}{side}" type="ball"/>
              <geom type="capsule" fromto="0 0 0 -0.37 0 -0.6" size="0.006" density="1500"/></body>"""
            pins += (
                f'<connect name="pin{k}{side}" body1="rod{k}{side}" body2="platform" anchor="-0.37 0 -0.6"/>'
            )
        arms += f"""<body euler="0 0 {120 * k}"><body pos="0.2 0 0"><joint name="hip{k}" axis="0 1 0" stiffness="60"/>
          <geom type="capsule" fromto="0 0 0 0.25 0 0" size="0.015" density="1200"/>{rods}</body></body>"""
    return f"""<mujoco model="delta"><worldbody>{arms}<body name="platform" pos="0 0 -0.6"><freejoint/>
      <geom type="cylinder" size="0.08 0.01" mass="0.4"/></body></worldbody><equality>{pins}</equality></mujoco>"""


@needs_mujoco
def test_a_delta_robot_stays_closed_for_100_seconds(file):
    system = link.derive(import_mjcf(file(delta_robot())).model)
    assert (system.nv, system.m, system.dependent) == (27, 18, ())
    run = system.run(t_end=100.0, rtol=1e-9)
    assert run.status == "success"
    checks = {check.check: check for check in run.health}
    assert checks["constraint position"].value < 1e-12 and checks["constraint velocity"].value < 1e-12
    assert checks["energy"].ok and checks["equations"].ok  # it is chaotic, and the report says so


@needs_mujoco
def test_a_plane_loop_that_turns_in_space_has_no_row_too_many(file):
    """As on Cassie's legs: in the world's axes another row would follow from the others wherever the hip rolls."""
    imported = import_mjcf(bundled_folder() / "robots" / "achilles_leg.xml")
    assert [note for note in imported.notes if "plane" in note and "toe_rod" in note]
    system = link.derive(imported.model)
    assert (system.m, system.dependent) == (5, ())
    found = vars(compare_with_mujoco(system, imported, 5))
    assert all(value < 1e-9 for name, value in found.items() if name not in ("states", "accelerations"))
    run = system.run(t_end=2.0, rtol=1e-9)
    assert run.ok, [check.says for check in run.objections]
    residual = system.kernel("constraint_residual")
    rows = [
        residual(t, y[: system.nq + system.nv], run.p)[: system.nh]
        for t, y in zip(run.t, run.states, strict=True)
    ]
    assert np.abs(rows).max() < 1e-12


@needs_mujoco
def test_the_file_that_is_written_is_the_model(file, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = CliRunner().invoke(main, ["import", str(file(WALKER)), "-o", "walker.toml", "--check"])
    assert result.exit_code == 0, result.output
    assert "against MuJoCo at 20 random states" in result.output
    system = symgen.load("walker.toml")
    expected = link.derive(import_mjcf(file(WALKER)).model)
    y = np.random.default_rng(1).uniform(0.1, 1, system.nq + system.nv)
    p = system.parameter_values()
    np.testing.assert_allclose(
        system.kernel("forces")(0.0, y, p), expected.kernel("forces")(0.0, y, p), rtol=1e-12, atol=1e-12
    )


@needs_mujoco
@pytest.mark.parametrize(
    ("text", "says"),
    [
        (HEAD.replace("<joint/>", "") + TAIL, "nothing moves"),
        (HEAD + "<actuator><motor joint='no'/></actuator>" + TAIL, "MuJoCo refuses the file"),
        (HEAD.replace("<geom size", '<geom mass="-1" size') + TAIL, "MuJoCo refuses the file"),
        (HEAD.replace('size=".1"', 'size="nan"') + TAIL, "MuJoCo refuses the file"),
        (
            HEAD.replace("<geom", '<inertial pos="0 0 0" mass="1" diaginertia="1 1 5"/><geom') + TAIL,
            "MuJoCo refuses",
        ),
        (
            HEAD.replace("<body>", "<body name='b'>") + "<worldbody><body name='b'/></worldbody>" + TAIL,
            "refuses",
        ),
        (HEAD.replace("<geom", "<gome") + TAIL, "MuJoCo refuses the file"),
        (
            "<mujoco><worldbody>" + "<body><joint/><geom size='.1'/></body>" * 601 + "</worldbody></mujoco>",
            "601 rates",
        ),
    ],
)
def test_what_cannot_be_a_model(file, text, says):
    with pytest.raises(ModelError, match=says) as caught:
        import_mjcf(file(text))
    assert "robot.xml" in str(caught.value)


HOSTILE = {
    "entities": ('<!DOCTYPE m [<!ENTITY a "aa">]>' + HEAD + TAIL, "document type"),
    "outside include": (HEAD + '<include file="../secret.xml"/>' + TAIL, "lies outside"),
    "absolute include": (HEAD + '<include file="/etc/passwd"/>' + TAIL, "not named relative"),
    "drive": (HEAD + '<include file="C:\\secret.xml"/>' + TAIL, "not named relative"),
    "back slashes": (HEAD + '<include file="..\\secret.xml"/>' + TAIL, "lies outside"),
    "address": (HEAD + '<asset><mesh file="http://x/y.stl"/></asset>' + TAIL, "not named relative"),
    "file address": (HEAD + '<asset><mesh file="file:///etc/passwd"/></asset>' + TAIL, "not named relative"),
    "missing include": (HEAD + '<include file="none.xml"/>' + TAIL, "is not there"),
    "missing mesh": (HEAD + '<asset><mesh name="a" file="a.stl"/></asset>' + TAIL, "is not there"),
    "mesh outside": (HEAD + '<asset><mesh name="a" file="../secret.xml"/></asset>' + TAIL, "lies outside"),
    "folder outside": (
        HEAD + '<compiler meshdir=".."/><asset><mesh file="secret.xml"/></asset>' + TAIL, "lies outside"
    ),
    "absolute folder": (
        HEAD + '<compiler assetdir="/etc"/><asset><texture file="passwd"/></asset>' + TAIL, "lies outside"
    ),
    "height field": (HEAD + '<asset><hfield name="h" file="../../x.png"/></asset>' + TAIL, "lies outside"),
    "skin": (HEAD + '<deformable><skin file="../x.skn"/></deformable>' + TAIL, "lies outside"),
    "attached model": (HEAD + '<asset><model name="m" file="../x.xml"/></asset>' + TAIL, "lies outside"),
    "includes itself": (HEAD + '<include file="robot.xml"/>' + TAIL, "in a circle"),
    "plugin": (HEAD + '<extension><plugin plugin="x"/></extension>' + TAIL, "shared libraries"),
    "plugin alone": (HEAD.replace("<joint/>", "<plugin/><joint/>") + TAIL, "shared libraries"),
    "no robot": ("<html/>", "no <mujoco> root"),
    "not closed": (HEAD, "XML syntax"),
    "nothing": ("", "XML syntax"),
    "null in a name": (HEAD + '<include file="a&#0;b.xml"/>' + TAIL, "XML syntax"),
    "depth": ("<mujoco>" + "<body>" * 100 + "</body>" * 100 + TAIL, "nested more than"),
    "unknown encoding": ('<?xml version="1.0" encoding="x-evil"?>' + HEAD + TAIL, "XML syntax"),
}  # fmt: skip


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_files_are_refused_before_mujoco_sees_them(file, name):
    text, says = HOSTILE[name]
    path = file(text)
    (path.parents[1] / "secret.xml").write_text(HEAD + TAIL)
    with pytest.raises(ModelError, match=says) as caught:
        check_files(path)
    assert "robot.xml" in str(caught.value)


def test_links_lead_nowhere(file):
    path = file(HEAD + '<include file="inner.xml"/>' + TAIL)
    secret = path.parents[1] / "secret.xml"
    secret.write_text(HEAD + TAIL)
    (path.parent / "inner.xml").symlink_to(secret)
    with pytest.raises(ModelError, match="lies outside"):
        check_files(path)
    assert len(check_files(path, within=path.parents[1])) == 2


def test_sizes_are_bounded(file, monkeypatch):
    path = file(HEAD + '<asset><mesh file="big.stl"/></asset>' + TAIL)
    (path.parent / "big.stl").write_bytes(b"0" * 100)
    assert len(check_files(path)) == 1
    monkeypatch.setattr(mjcf_files, "LARGEST_ASSETS", 99)
    with pytest.raises(ModelError, match="the files that are named have more than"):
        check_files(path)
    monkeypatch.setattr(xml_tree, "LARGEST_FILE", 20)
    with pytest.raises(ModelError, match="larger than"):
        check_files(path)


def test_many_includes(file, monkeypatch):
    path = file(HEAD + '<include file="a.xml"/><include file="b.xml"/>' + TAIL)
    for name in "ab":
        (path.parent / f"{name}.xml").write_text("<mujoco/>")
    assert len(check_files(path)) == 3
    monkeypatch.setattr(mjcf_files, "MOST_INCLUDES", 1)
    with pytest.raises(ModelError, match="more than"):
        check_files(path)


def test_pipes_do_not_hang(tmp_path):
    os.mkfifo(tmp_path / "robot.xml")
    with pytest.raises(ModelError, match="pipe"):
        check_files(tmp_path / "robot.xml")


def test_options_that_do_not_go_together(file):
    path = file(HEAD + TAIL)
    result = CliRunner().invoke(main, ["import", str(path), "--base", "free"])
    assert result.exit_code == 2
    assert "for URDF" in result.output


@pytest.mark.parametrize("off", [0.0, 1e-15, 1e-12, 1e-9, 1e-8, 1e-5, 0.3])
def test_angles_near_a_quarter_turn(off):
    def turn(axis, angle):
        return np.array([np.cos(angle / 2), *(np.sin(angle / 2) * np.eye(3)[axis])])

    def times(a, b):
        return np.array(
            [a[0] * b[0] - a[1:] @ b[1:], *(a[0] * b[1:] + b[0] * a[1:] + np.cross(a[1:], b[1:]))]
        )

    given = times(times(turn(2, 0.7), turn(1, np.pi / 2 - off)), turn(0, -0.4))
    roll, pitch, yaw = mjcf.roll_pitch_yaw(given)
    found = times(times(turn(2, yaw), turn(1, pitch)), turn(0, roll))
    np.testing.assert_allclose(found * np.sign(found @ given), given, atol=1e-15)
