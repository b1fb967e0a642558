"""Robots from URDF: what the file says is what moves, and what is wrong is refused with its line."""

from __future__ import annotations

import math

import numpy as np
import pytest
from click.testing import CliRunner

from symgen import Model, link
from symgen.cli import main
from symgen.errors import ModelError
from symgen.robots import xml_tree
from symgen.robots.agreement import compare_with_pinocchio
from symgen.robots.build import import_urdf

# Names that models cannot have, inertias in turned frames, a massless frame, dry friction, a follower.
ARM = """<?xml version="1.0"?>
<robot name="3-link arm">
  <link name="world"/>
  <joint name="mount" type="fixed"><parent link="world"/><child link="base/link"/></joint>
  <link name="base/link"/>
  <joint name="1st" type="continuous">
    <origin xyz="0 0 0.3" rpy="0 0.2 0"/><parent link="base/link"/><child link="upper arm"/>
    <axis xyz="0 0 2"/><dynamics damping="0.1"/>
  </joint>
  <link name="upper arm">
    <inertial><origin xyz="0.2 0 0.01" rpy="0.3 -0.2 0.5"/><mass value="2"/>
      <inertia ixx="0.02" ixy="0.001" ixz="0.002" iyy="0.03" iyz="-0.001" izz="0.025"/></inertial>
  </link>
  <joint name="sin" type="revolute">
    <origin xyz="0.4 0 0" rpy="1.5708 0 0"/><parent link="upper arm"/><child link="fore-arm"/>
    <axis xyz="0 1 0.5"/><limit lower="0.1" upper="2" effort="10" velocity="3"/><dynamics friction="0.02"/>
  </joint>
  <link name="fore-arm">
    <inertial><origin xyz="0.1 0.02 0"/><mass value="1"/>
      <inertia ixx="0.004" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial>
  </link>
  <joint name="finger" type="prismatic">
    <origin xyz="0.3 0 0"/><parent link="fore-arm"/><child link="fore_arm"/><axis xyz="0 1 0"/>
    <limit lower="0" upper="0" effort="1" velocity="1"/>
  </joint>
  <link name="fore_arm"><inertial><mass value="0.1"/>
      <inertia ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"/></inertial></link>
  <joint name="thumb" type="prismatic">
    <origin xyz="0.3 0 0"/><parent link="fore-arm"/><child link="tip"/><axis xyz="0 -1 0"/>
    <mimic joint="finger" multiplier="0.5" offset="0.01"/>
    <limit effort="1" velocity="1"/>
  </joint>
  <link name="tip"><inertial><mass value="0.1"/>
      <inertia ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"/></inertial></link>
  <joint name="camera" type="revolute"><parent link="tip"/><child link="eye"/></joint>
  <link name="eye"/>
</robot>
"""


@pytest.fixture
def arm(tmp_path):
    path = tmp_path / "arm.urdf"
    path.write_text(ARM)
    return path


def test_names_numbers_and_what_is_left_out(arm):
    imported = import_urdf(arm)
    description = imported.model.describe()
    assert imported.bodies["world"] == "world"
    assert imported.joints["1st"] == "n1st" and imported.joints["sin"] == "sin_"
    assert imported.bodies["fore-arm"] != imported.bodies["fore_arm"]
    assert [c.name for c in description.coordinates] == ["n1st", "sin_", "finger", "thumb"]
    assert [n for n in imported.notes if "moves nothing that has mass" in n and "'camera'" in n]
    values = {p.name: p.value for p in description.parameters}
    assert values["upper_arm_mass"] == 2 and values["n1st_damping"] == 0.1
    assert [i.name for i in description.inputs] == ["n1st_torque", "sin__torque", "finger_force"]
    sin = next(joint for joint in description.joints if joint.name == "sin_")
    assert [float(x) for x in sin.limits] == [0.1, 2.0]
    assert (
        next(c for c in description.coordinates if c.name == "sin_").start == 0.1
    )  # zero is outside its limits


def test_the_motion_is_that_of_the_file(arm):
    """Against the same robot put together by hand, its inertias turned by NumPy."""
    model = Model("by_hand", gravity=(0, 0, -9.81))
    roll, pitch, yaw = 0.3, -0.2, 0.5
    x = np.array([[1, 0, 0], [0, math.cos(roll), -math.sin(roll)], [0, math.sin(roll), math.cos(roll)]])
    y = np.array([[math.cos(pitch), 0, math.sin(pitch)], [0, 1, 0], [-math.sin(pitch), 0, math.cos(pitch)]])
    z = np.array([[math.cos(yaw), -math.sin(yaw), 0], [math.sin(yaw), math.cos(yaw), 0], [0, 0, 1]])
    turn = z @ y @ x
    own = np.array([[0.02, 0.001, 0.002], [0.001, 0.03, -0.001], [0.002, -0.001, 0.025]])
    I = turn @ own @ turn.T
    model.body("upper", 2, (0.2, 0, 0.01), [I[0, 0], I[1, 1], I[2, 2], I[0, 1], I[0, 2], I[1, 2]])
    model.body("fore", 1, (0.1, 0.02, 0), [0.004, 0.01, 0.01])
    model.body("left", 0.1, (0, 0, 0))
    model.body("right", 0.1, (0, 0, 0))
    first = {"xyz": (0, 0, 0.3), "rpy": (0, 0.2, 0)}
    model.joint("a", "continuous", "upper", "world", first, axis=(0, 0, 1), damping=0.1)
    model.joint(
        "b", "revolute", "fore", "upper", {"xyz": (0.4, 0, 0), "rpy": (1.5708, 0, 0)}, axis=(0, 1, 0.5)
    )
    model.joint("c", "prismatic", "left", "fore", {"xyz": (0.3, 0, 0)}, axis=(0, 1, 0))
    model.joint("d", "prismatic", "right", "fore", {"xyz": (0.3, 0, 0)}, axis=(0, -1, 0))
    model.gear("g", "d", "c", 0.5, 0.01)
    expected, system = link.derive(model), link.derive(Model.from_urdf(arm))
    random = np.random.default_rng(3)
    p = system.parameter_values({"sin_friction": 0.0})
    for _ in range(3):
        state = random.uniform(-1, 1, 8)
        for name in ("mass_matrix", "forces", "constraint_residual", "gamma"):
            theirs = expected.kernel(name)(0.0, state, expected.parameter_values())
            ours = system.kernel(name)(0.0, state, p)
            np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-12 * max(1, np.abs(theirs).max()))


def test_exposed_numbers_are_parameters_and_the_others_are_not(arm):
    description = Model.from_urdf(arm, expose=["fore*.mass", "*.armature"]).describe()
    assert {p.name: p.value for p in description.parameters} == {
        "fore_arm_mass": 1, "fore_arm_mass_2": 0.1,
        "n1st_armature": 0, "sin_armature": 0, "finger_armature": 0, "thumb_armature": 0,
    }  # fmt: skip
    with pytest.raises(ModelError, match=r"arm\.urdf.*'wrist\*' fits no number"):
        Model.from_urdf(arm, expose=["wrist*"])


def test_a_free_robot_falls_freely(tmp_path):
    path = tmp_path / "box.urdf"
    path.write_text(
        "<robot name='box'><link name='body'><inertial><mass value='2'/>"
        "<inertia ixx='0.1' iyy='0.2' izz='0.25'/></inertial></link></robot>"
    )
    with pytest.raises(ModelError, match=r"line 1.*nothing moves"):
        Model.from_urdf(path)
    solution = link.derive(Model.from_urdf(path, base="free")).run(t_end=1.0)
    assert solution["root_z"][-1] == pytest.approx(-9.81 / 2, rel=1e-9)


def test_the_model_file_that_is_written_is_the_same_model(arm):
    model = Model.from_urdf(arm)
    again = Model.from_toml(model.to_toml())
    assert again.to_toml() == model.to_toml()


def robot(*parts: str) -> str:
    return f"<robot name='r'>\n{''.join(part + chr(10) for part in parts)}</robot>"


A, B = "<link name='a'/>", "<link name='b'><inertial><mass value='1'/></inertial></link>"
AB = "<joint name='j' type='revolute'><parent link='a'/><child link='b'/>{}</joint>"
BOMB = "<!DOCTYPE r [<!ENTITY a 'ha'><!ENTITY b '&a;&a;&a;'>]><robot name='&b;'/>"
OUTSIDE = "<!DOCTYPE r [<!ENTITY a SYSTEM 'file:///etc/passwd'>]>\n<robot name='&a;'/>"
HOSTILE = {
    "empty": ("", "XML syntax"),
    "no XML": ("[robot]", "line 1, column 1.*XML syntax"),
    "cut off": (robot(A)[:20], "XML syntax"),
    "entities": (BOMB, "document type"),
    "another file": (OUTSIDE, "document type"),
    "deep": ("<a>" * 100 + "</a>" * 100, "nested more than 64 deep"),
    "no UTF-8": ("<?xml version='1.0' encoding='latin-99'?><robot/>", "XML syntax"),
    "MJCF": ("<mujoco/>", "begins with <robot>.*MJCF"),
    "xacro": (
        "<robot xmlns:xacro='x' name='r'><xacro:include filename='../../secret'/></robot>",
        "expand it with xacro",
    ),
    "nothing": (robot(), "has no <link>"),
    "no name": (robot("<link/>"), "line 2: <link>.*'name' is missing"),
    "two of a name": (robot(A, A), "line 3.*taken by another one in line 2"),
    "two joints of a name": (robot(A, B, AB, AB), "line 5.*taken by another one in line 4"),
    "two roots": (robot(A, B), "line 3.*2 roots"),
    "two parents": (
        robot(A, B, AB, "<joint name='k' type='fixed'><parent link='a'/><child link='b'/></joint>"),
        "line 5.*is the child of the joint 'j' already",
    ),
    "circle": (
        robot(A, B, AB, "<joint name='k' type='fixed'><parent link='b'/><child link='a'/></joint>"),
        "circle",
    ),
    "loose circle": (
        robot(
            A, B, "<link name='c'/>",
            "<joint name='j' type='fixed'><parent link='b'/><child link='c'/></joint>",
            "<joint name='k' type='fixed'><parent link='c'/><child link='b'/></joint>",
        ),
        "line 5.*form a circle",
    ),
    "itself": (robot(A, "<joint name='j' type='fixed'><parent link='a'/><child link='a'/></joint>"), "circle"),
    "unknown link": (robot(A, AB), "line 3.*its child, the link 'b', is not in the file"),
    "no child": (robot(A, "<joint name='j' type='fixed'><parent link='a'/></joint>"), "line 3.*<child> is missing"),
    "unknown type": (robot(A, B, AB.replace("revolute", "helical")), "line 4.*'helical' is not a type"),
    "no axis": (robot(A, B, AB.format("<axis xyz='0 0 0'/>")), "line 4: <axis>.*no direction"),
    "short axis": (robot(A, B, AB.format("<axis xyz='0 1'/>")), "line 4: <axis>.*is not 3 numbers"),
    "NaN": (robot(A, B, AB.format("<axis xyz='0 nan 1'/>")), "'nan', which is not a finite number"),
    "overflow": (robot(A, B, AB.format("<dynamics damping='1e999'/>")), "'1e999', which is not a finite"),
    "expression": (robot(A, B, AB.format("<dynamics damping='${d}'/>")), "xacro"),
    "underscore": (robot(A, B, AB.format("<dynamics damping='1_0'/>")), "'1_0', which is not"),
    "negative damping": (robot(A, B, AB.format("<dynamics damping='-1'/>")), "line 4: <dynamics>.*negative"),
    "two axes": (robot(A, B, AB.format("<axis xyz='0 0 1'/><axis xyz='0 1 0'/>")), "there are 2 of it"),
    "limits": (robot(A, B, AB.format("<limit lower='1' upper='-1'/>")), "line 4: <limit>.*above the upper"),
    "mimics nobody": (robot(A, B, AB.format("<mimic joint='x'/>")), "mimics 'x', which is no joint"),
    "mimics itself": (robot(A, B, AB.format("<mimic joint='j'/>")), "mimics itself"),
    "negative mass": (robot(A, B.replace("'1'", "'-1'"), AB), "line 3: <mass>.*negative mass"),
    "no mass": (robot(A, "<link name='b'><inertial/></link>", AB), "line 3: <inertial>.*<mass> is missing"),
    "massless": (robot(A, "<link name='b'/>", AB), "nothing moves"),
    "many": (f"<robot>{'<link/>' * 200_001}</robot>", "more than 200000 elements"),
    "NUL": ("<robot name='\0'/>", "XML syntax"),
}  # fmt: skip


@pytest.mark.parametrize("kind", HOSTILE)
def test_what_is_wrong_is_refused_with_its_place(tmp_path, kind):
    text, words = HOSTILE[kind]
    path = tmp_path / "bad.urdf"
    path.write_text(text.replace("{}", ""))
    with pytest.raises(ModelError, match=rf"(?s)bad\.urdf.*{words}"):
        Model.from_urdf(path)


def test_large_files_pipes_and_missing_ones_are_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(xml_tree, "LARGEST_FILE", 1 << 20)
    (tmp_path / "large.urdf").write_bytes(b"<robot>" + b" " * (1 << 20))
    for name, words in (
        ("large.urdf", "larger than 1 MiB"),
        ("none.urdf", "cannot be read"),
        (".", "cannot be read"),
    ):
        with pytest.raises(ModelError, match=words):
            Model.from_urdf(tmp_path / name)


def test_unphysical_inertias_are_said(tmp_path):
    path = tmp_path / "odd.urdf"
    links = (("b", 0.1, 0.1, 0.5), ("c", 0.1, 0.2, -0.1))
    text = A + "".join(
        f"\n<link name='{n}'><inertial><mass value='1'/><inertia ixx='{x}' iyy='{y}' izz='{z}'/></inertial></link>"
        f"<joint name='j{n}' type='continuous'><parent link='a'/><child link='{n}'/></joint>"
        for n, x, y, z in links
    )
    path.write_text(robot(text))
    kept, cut = import_urdf(path).notes
    assert "line 3: the link 'b'" in kept and "0.1 + 0.1 < 0.5" in kept
    assert "line 4: the link 'c'" in cut and "-0.1 kg m^2; it is taken as 0" in cut


@pytest.mark.parametrize(
    ("inside", "says"),
    [
        ('<origin xzy="0 0 1"/>', "'xzy' of <origin> is read over: did you mean 'xyz'"),
        ('<origin rpy="0 0 90"/>', "rpy = '0 0 90' is more than a turn"),
        ('<dynamics dampng="1"/>', "'dampng' of <dynamics> is read over"),
        ('<Axis xyz="0 1 0"/>', "<Axis> is read over: did you mean <axis>"),
    ],
)
def test_what_is_read_over_and_looks_like_a_slip_is_said(tmp_path, inside, says):
    path = tmp_path / "slip.urdf"
    path.write_text(
        robot(A, "<link name='b'><inertial><mass value='1'/></inertial></link>", AB.format(inside))
    )
    assert [note for note in import_urdf(path).notes if says in note]


def test_the_command_writes_a_model_and_nothing_over_a_file(arm, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = CliRunner().invoke(main, ["import", "arm.urdf", "-o", "robot.toml"])
    assert result.exit_code == 0, result.output
    assert "4 coordinates" in result.output and "moves nothing that has mass" in result.output
    assert Model.from_toml(tmp_path / "robot.toml").describe().name == "n3_link_arm"
    before = (tmp_path / "robot.toml").read_text()
    result = CliRunner().invoke(main, ["import", "arm.urdf", "-o", "robot.toml", "--base", "free"])
    assert result.exit_code == 2 and "is there already" in result.output
    assert (tmp_path / "robot.toml").read_text() == before


@pytest.mark.parametrize("base", ["fixed", "free"])
def test_agrees_with_pinocchio(tmp_path, base):
    pytest.importorskip("pinocchio")
    path = tmp_path / "arm.urdf"
    # Pinocchio takes followers as free, and has no mass matrix for joints that move no mass.
    uncoupled = ARM.replace('<mimic joint="finger" multiplier="0.5" offset="0.01"/>', "")
    text = uncoupled[: uncoupled.index('  <joint name="camera"')] + "</robot>"
    if (
        base == "free"
    ):  # a base that has no inertia about the axis of the first joint has no motion of its own
        block = '<mass value="3"/><inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.2"/>'
        text = text.replace(
            '<link name="base/link"/>', f'<link name="base/link"><inertial>{block}</inertial></link>'
        )
    path.write_text(text)
    imported = import_urdf(path, base)
    found = compare_with_pinocchio(link.derive(imported.model), imported)
    assert max(value for name, value in vars(found).items() if name != "states") < 1e-10


def test_a_driver_without_mass_moves_what_mimics_it(tmp_path):
    """A gripper's driver is often a joint of an empty link; its followers start where they are said to follow."""
    path = tmp_path / "gripper.urdf"
    finger = "<link name='{0}'><inertial><mass value='0.1'/></inertial></link>"
    path.write_text(
        robot(
            A, "<link name='b'/>", *(finger.format(name) for name in "cd"),
            AB.format("<limit lower='-1' upper='1'/>").replace("revolute", "prismatic"),
            *(
                f"<joint name='{name}' type='prismatic'><parent link='a'/><child link='{child}'/>"
                f"<limit lower='-1' upper='1'/><mimic joint='{driver}' multiplier='{ratio}' offset='0.25'/></joint>"
                for name, child, driver, ratio in (("k", "c", "j", 2), ("l", "d", "k", -1))
            ),
        )
    )  # fmt: skip
    imported = import_urdf(path, gravity=("2 m/s^2", 0, 0))
    assert not imported.notes
    solution = link.derive(imported.model).run(t_end=0.5)
    j, k, l = (solution[name] for name in "jkl")
    np.testing.assert_allclose(k, 2 * j + 0.25, atol=1e-12)
    np.testing.assert_allclose(l, 0.25 - k, atol=1e-12)
    np.testing.assert_allclose(j, 0.0, atol=1e-12)  # equal masses go opposite ways: gravity does no work


def test_names_that_joints_make_are_free(tmp_path):
    path = tmp_path / "names.urdf"
    base = "<link name='a'><inertial><mass value='1'/></inertial></link>"
    path.write_text(robot(base, B, AB.format("").replace("'j'", "'root_qw'")))
    description = Model.from_urdf(path, base="free").describe()
    names = [c.name for c in description.coordinates]
    assert "root_qw" in names and len(set(names)) == len(names) == 8


def test_starts_are_said_by_the_names_of_the_model(arm, tmp_path, monkeypatch):
    robot = Model.from_urdf(arm, base="free", start={"root_z": 0.5, "sin_": "40 deg", "finger": 0})
    found = {q.name: q.start for q in robot.describe().coordinates}
    assert (found["root_z"], found["root_qw"], found["sin_"]) == (0.5, 1.0, pytest.approx(math.radians(40)))
    with pytest.raises(ModelError, match="'elbow' is no coordinate of the robot"):
        Model.from_urdf(arm, start={"elbow": 1.0})
    monkeypatch.chdir(tmp_path)
    result = CliRunner().invoke(main, ["import", str(arm), "-o", "a.toml", "--start", "sin_=40 deg"])
    assert result.exit_code == 0, result.output
    assert "start = 0.698" in (tmp_path / "a.toml").read_text()


def bar(name, parent, length, at):
    inertia = length**2 / 12
    return f"""<joint name="{name}" type="continuous"><parent link="{parent}"/><child link="{name}_bar"/>
  <origin xyz="{at} 0 0"/><axis xyz="0 1 0"/></joint>
<link name="{name}_bar"><inertial><origin xyz="{length / 2} 0 0"/><mass value="1"/>
  <inertia ixx="0.001" iyy="{inertia}" izz="{inertia}" ixy="0" ixz="0" iyz="0"/></inertial></link>"""


def test_loops_are_added_to_an_imported_tree_and_redundant_rows_are_named(tmp_path):
    bars = bar("crank", "ground", 0.2, 0) + bar("coupler", "crank_bar", 0.6, 0.2)
    bars += bar("rocker", "ground", 0.5, 0.7)
    file = tmp_path / "four_bar.urdf"
    file.write_text(f'<robot name="four_bar"><link name="ground"/>{bars}</robot>')
    by_closure, by_hand = (Model.from_urdf(file, motors=False) for _ in range(2))
    for end, length in (("coupler", 0.6), ("rocker", 0.5)):
        by_closure.frame(f"{end}_end", body=f"{end}_bar", at=(length, 0, 0))
        by_hand.point(f"{end}_end", body=f"{end}_bar", at=(length, 0, 0))
    by_closure.closure("pin", type="revolute", frames=["coupler_end", "rocker_end"], axis=(0, 1, 0))
    for axis in "xz":
        by_hand.constraint(f"pin_{axis}", f"coupler_end_{axis} - rocker_end_{axis}")
    runs = [model.derive().run(t_end=1.0, rtol=1e-11) for model in (by_closure, by_hand)]
    assert all(run.ok for run in runs)
    np.testing.assert_allclose(runs[0].states, runs[1].states, atol=1e-8)
    assert [note for note in runs[0].notes if "redundant: pin_y, pin_turn_1, pin_turn_2" in note]
    assert not any("redundant" in note for note in runs[1].notes)
