"""Marks in recordings: which entities there are, where they lie, and which way they are shown at first."""

from __future__ import annotations

import re

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from symgen import Model
from symgen.link import derive_text
from symgen.model import library
from symgen.runtime import load
from symgen.runtime.recording import geometry, layout, schema, symbols
from symgen.runtime.recording.reader import read_recording
from symgen.runtime.recording.recorder import RunRecorder
from symgen.runtime.recording.rrd.read import chunks, read_rrd
from symgen.runtime.recording.verify import verify
from symgen.runtime.report.drawing import drawing

TIMES = np.linspace(0.0, 1.0, 11)


def recorded(path, model, states, finished=True):
    """Record states of a model that nobody integrated; returns what can be read of some entities."""
    text = derive_text(model).text
    system = load(text)
    recording = RunRecorder(
        path, system, system.parameter_values(), method="dop853", rtol=1e-9, atol=1e-11,
        constraints="projection", module_text=text, model_text="",
    )  # fmt: skip
    y = states(TIMES, system)
    recording.start(TIMES[0], y[0])
    recording.frames(TIMES[1:], y[1:])
    if finished:
        recording.finish("success", [], {})
    else:
        recording.abort()
    return system, y


def bundled(name):
    return library.load(library.bundled()[name])


def column(path, entity, name, width):
    """A column of numbers of an entity; of static ones the last that was written."""
    _, batches, _ = read_rrd(path, [entity])
    found = [batch for batch in batches.get(entity, ()) if name in batch.schema.names]
    if not found:
        raise KeyError(f"{entity} {name}: there is {[b.schema.names for b in batches.get(entity, ())]}")
    timed = [batch for batch in found if schema.SIM_TIME in batch.schema.names]
    rows = [flat(batch.column(name)) for batch in timed or found[-1:]]
    return np.concatenate(rows).reshape(-1, width)


def flat(array):
    while hasattr(array, "flatten") and array.type.num_fields:
        array = array.flatten()
    return array.to_numpy(zero_copy_only=False)


def entities(path, *names):
    return {name for name in read_rrd(path, list(names))[1] if not name.startswith("property:")}


def frame_of(path, entity):
    _, batches, _ = read_rrd(path, [entity])
    name = "CoordinateFrame:frame"
    return [b.column(name)[0].as_py()[0] for b in batches[entity] if name in b.schema.names]


# Springs and joints


def swinging(t, system):
    r, theta = 1.0 + 0.2 * np.sin(3 * t), 0.4 * np.cos(2 * t)
    return np.stack([r, theta, 0.6 * np.cos(3 * t), -0.8 * np.sin(2 * t)], axis=1)


def test_a_spring_reaches_from_the_ceiling_to_the_bob(tmp_path):
    path = tmp_path / "run.rrd"
    _, y = recorded(path, bundled("spring_pendulum"), swinging)
    spring = f"{schema.SPRINGS}/spring"
    np.testing.assert_array_equal(column(path, spring, "Transform3D:translation", 3), 0.0)
    scale = column(path, spring, "Transform3D:scale", 3)
    np.testing.assert_allclose(scale[:, 2], y[:, 0], rtol=1e-6)
    np.testing.assert_array_equal(scale[:, :2], 1.0)
    turned = Rotation.from_quat(column(path, spring, "Transform3D:quaternion", 4))
    ends = turned.apply([0.0, 0.0, 1.0]) * scale[:, 2:]
    bob = np.stack([y[:, 0] * np.sin(y[:, 1]), -y[:, 0] * np.cos(y[:, 1]), 0 * TIMES], axis=1)
    np.testing.assert_allclose(ends, bob, atol=1e-6)
    coil = column(path, spring, "LineStrips3D:strips", 3)
    assert coil[:, 2].min() == 0.0 and coil[:, 2].max() == 1.0
    assert 0.01 < np.hypot(coil[:, 0], coil[:, 1]).max() < 0.2


def test_what_hangs_has_its_support_above(tmp_path):
    path = tmp_path / "run.rrd"
    recorded(path, bundled("spring_pendulum"), swinging)
    lines = column(path, f"{schema.GROUND}/ceiling", "LineStrips3D:strips", 3)
    assert (lines == 0.0).all(axis=1).any() and lines[:, 1].min() == 0.0 and lines[:, 1].max() > 0.05
    assert not entities(path, schema.ORIGIN)


def circling(t, system):
    """A four-bar linkage by triangles, at rest in every frame."""
    crank = 0.5 + 2.0 * t
    diagonal = 0.3 - 0.1 * np.exp(1j * crank)
    inner = np.arccos((0.3**2 + abs(diagonal) ** 2 - 0.25**2) / (0.6 * abs(diagonal)))
    top = 0.1 * np.exp(1j * crank) + 0.3 * np.exp(1j * (np.angle(diagonal) + inner))
    coupler, rocker = np.angle(top - 0.1 * np.exp(1j * crank)), np.angle(top - 0.3)
    return np.stack([crank, coupler, rocker, *np.zeros((3, len(t)))], axis=1)


def test_pins_are_fixed_to_their_rods_and_reactions_follow_them(tmp_path):
    path = tmp_path / "run.rrd"
    _, y = recorded(path, bundled("four_bar"), circling)
    pin = f"{schema.JOINTS}/coupler_bar_2"
    assert frame_of(path, pin) == [f"tf#/{schema.BODIES}/coupler_bar"]
    np.testing.assert_allclose(column(path, pin, "Cylinders3D:centers", 3), [[0.15, 0.0, 0.0]], atol=1e-7)
    reaction = f"{schema.REACTIONS}/coupler_bar_2"
    places = column(path, reaction, "Transform3D:translation", 3)
    top = np.array([0.3, 0.0]) + 0.25 * np.stack([np.cos(y[:, 2]), np.sin(y[:, 2])], axis=1)
    np.testing.assert_allclose(places[:, :2], top, atol=1e-6)
    arrows = column(path, f"{reaction}/arrow", "Arrows3D:vectors", 3)
    np.testing.assert_allclose(arrows[:, :2], read_recording(path).multipliers, rtol=1e-6)
    assert not arrows[:, 2].any()
    scale = column(path, f"{reaction}/arrow", "Transform3D:scale", 3)
    longest = scale[0, 0] * np.linalg.norm(arrows, axis=1).max()
    assert 0.05 < longest < 0.3  # of a linkage of half a metre


def test_a_recording_with_marks_is_read_again_finished_or_not(tmp_path):
    path = tmp_path / "run.rrd"
    recorded(path, bundled("four_bar"), circling)
    report = {check.name: check.ok for check in verify(path).checks}
    for check in (
        "bytes",
        "checksum",
        "frames",
        "model",
    ):  # nobody integrated the states: the motion is wrong
        assert report[check]
    recorded(path, bundled("four_bar"), circling, finished=False)
    assert len(column(path, f"{schema.REACTIONS}/coupler_bar_2/arrow", "Arrows3D:vectors", 3)) == len(TIMES)


def hidden(path):
    """Entities that the layout hides at first."""
    found = set()
    for store, reader in chunks(path, []):
        entity = (reader.schema.metadata or {}).get(b"rerun:entity_path", b"").decode()
        for batch in reader if not store.is_recording else ():
            name = "EntityBehavior:visible"
            if name in batch.schema.names and batch.column(name).to_pylist()[-1] == [False]:
                found.add(entity.rpartition("/overrides/")[2].removesuffix("/visualizers"))
    return found


def test_forces_of_constraints_are_hidden_at_first(tmp_path):
    path = tmp_path / "run.rrd"
    recorded(path, bundled("four_bar"), circling)
    assert schema.REACTIONS in hidden(path)
    assert not hidden(path) & {schema.JOINTS, schema.GROUND, schema.FORCES}


# Forces, bars and bodies that stretch


ARM = """
[parameters]
w = 1
[bodies.upper]
mass = 2
com = [0, 0, -0.3]
inertia = [0.1, 0.1, 0.01]
[bodies.lower]
mass = 1
com = [0, 0, -0.2]
inertia = [0.1, 0.1, 0.01]
[bodies.rubber]
mass = 0
com = [1, 0, 0]
shape = { cylinder = [0.1, "1 + w*t"] }
[joints.shoulder]
type = "revolute"
child = "upper"
axis = [0, 1, 0]
coordinate = "q1"
[joints.elbow]
type = "revolute"
parent = "upper"
child = "lower"
origin = { xyz = [0, 0, -0.7] }
axis = [0, 1, 0]
coordinate = "q2"
[loads.small]
point = [0, 0, 1]
force = [0, 0, "w*t"]
[loads.large]
point = ["w*t", 0, 1]
force = [0, "4*w*t", 0]
"""


def turning(t, system):
    y = np.zeros((len(t), system.ny))
    y[:, :4] = np.stack([0.5 * t, -t, 0.5 + 0 * t, -1.0 + 0 * t], axis=1)
    return y


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    path = tmp_path_factory.mktemp("arm") / "run.rrd"
    recorded(path, Model.from_toml(ARM), turning)
    return path


def test_bodies_without_shape_are_bars_between_their_joints(arm):
    upper = f"{schema.BODIES}/upper/geometry"
    starts = column(arm, upper, "Capsules3D:translations", 3)
    turned = Rotation.from_quat(column(arm, upper, "Capsules3D:quaternions", 4))
    ends = starts + turned.apply([0, 0, 1]) * column(arm, upper, "Capsules3D:lengths", 1)
    np.testing.assert_allclose([starts[0], ends[0]], [[0, 0, 0.3], [0, 0, -0.4]], atol=1e-6)
    assert entities(arm, f"{schema.BODIES}/lower/geometry")


def test_axes_lie_in_their_bodies(arm):
    axis = f"{schema.JOINT_AXES}/elbow"
    assert frame_of(arm, axis) == [f"tf#/{schema.BODIES}/upper"]
    line = column(arm, axis, "LineStrips3D:strips", 3)
    np.testing.assert_allclose(line[:, [0, 2]], np.broadcast_to([0.0, -0.4], (len(line), 2)), atol=1e-6)
    assert line[:, 1].min() < -0.05 and line[:, 1].max() > 0.05


def test_arrows_are_in_proportion(arm):
    small, large = (f"{schema.FORCES}/{name}" for name in ("small", "large"))
    np.testing.assert_allclose(
        column(arm, large, "Transform3D:translation", 3),
        np.stack([TIMES, 0 * TIMES, 1 + 0 * TIMES], axis=1),
        atol=1e-6,
    )
    np.testing.assert_allclose(
        column(arm, f"{large}/arrow", "Arrows3D:vectors", 3)[:, 1], 4 * TIMES, rtol=1e-6
    )
    np.testing.assert_allclose(column(arm, f"{small}/arrow", "Arrows3D:vectors", 3)[:, 2], TIMES, rtol=1e-6)
    scales = [column(arm, f"{path}/arrow", "Transform3D:scale", 3)[0] for path in (small, large)]
    np.testing.assert_array_equal(*scales)
    assert 0.2 < 4.0 * scales[0][0] < 1.0  # the largest force, in a scene of two metres


def test_a_body_that_stretches_is_stretched(arm):
    scale = column(arm, f"{schema.BODIES}/rubber/geometry", "Transform3D:scale", 3)
    np.testing.assert_allclose(scale, np.stack([0 * TIMES + 1, 0 * TIMES + 1, 1 + TIMES], axis=1), rtol=1e-6)


# Without marks


def test_a_module_without_marks_is_recorded_as_ever(tmp_path):
    def spinning(t, system):
        q = np.stack([np.cos(t / 2), np.sin(t / 2), 0 * t, 0 * t], axis=1)
        return np.column_stack([q, np.ones(len(t)), np.zeros((len(t), 2))])

    path = tmp_path / "run.rrd"
    recorded(path, bundled("free_rigid_body"), spinning)
    assert entities(path, schema.ORIGIN, f"{schema.BODIES}/body") == {schema.ORIGIN, f"{schema.BODIES}/body"}
    folders = (schema.JOINTS, schema.GROUND, schema.JOINT_AXES)
    assert not entities(path, *(f"{folder}/turn" for folder in folders))


# On the page of a report


def test_a_reports_drawing_shows_the_spring_between_ceiling_and_bob():
    system = load(derive_text(bundled("spring_pendulum")).text)
    svg = drawing(system, system.parameter_values(), 0.0, np.array([1.2, 0.3, 0.0, 0.0]))
    pieces = re.search(r'class="mark" style="[^"]*" d="([^"]*)"', svg)[1].split("M")[1:]
    lines = [np.array([point.split() for point in piece.split("L")], dtype=float) for piece in pieces]
    bob = np.array(re.search(r'<circle class="body c0" cx="([^"]*)" cy="([^"]*)"', svg).groups(), dtype=float)
    spring = max(lines, key=len)
    np.testing.assert_allclose(spring[-1], bob, atol=0.11)
    support = np.vstack([line for line in lines if line is not spring])
    assert np.abs(support - spring[0]).max(axis=1).min() < 0.11  # its tip, where the spring begins
    assert (support[:, 1] <= spring[0, 1] + 0.11).all()  # the ceiling is above, and y points down


# Symbols


def test_frames_along_directions_are_rotations():
    directions = np.array(
        [[0.0, 0.0, 2.0], [0.0, 0.0, -3.0], [1.0, 0.0, 0.0], [0.3, -2.0, 0.4], [0.0, 0.0, 0.0]]
    )
    frames = symbols.frames_along(directions)
    np.testing.assert_allclose(
        frames @ frames.transpose(0, 2, 1), np.broadcast_to(np.eye(3), frames.shape), atol=1e-15
    )
    np.testing.assert_allclose(np.linalg.det(frames), 1.0)
    length = np.linalg.norm(directions, axis=1)
    np.testing.assert_allclose(frames[:4, :, 2], directions[:4] / length[:4, None], atol=1e-15)
    np.testing.assert_allclose(frames[2, :, 0], [0.0, -1.0, 0.0])  # to the right of +x in the plane


def test_symbols_reach_from_end_to_end():
    for lines in (symbols.coil(0.1), symbols.dashpot(0.1), symbols.rail(0.1, 0.2)):
        points = np.vstack(lines)
        assert (points == 0.0).all(axis=1).any() and (points == [0.0, 0.0, 1.0]).all(axis=1).any()
        assert np.abs(points[:, :2]).max() <= 0.1 + 1e-12
    assert np.vstack(symbols.rail(0.1, 0.2))[:, 0].min() == 0.0


@pytest.mark.parametrize("planar", [True, False])
def test_the_camera_sees_the_whole_box_and_comes_near(planar):
    low, high = np.array([-1.0, -0.2, 0.1]), np.array([2.0, 0.6, 0.5])
    camera = layout.choose_camera(low, high, planar)
    np.testing.assert_allclose(camera.axes @ camera.axes.T, np.eye(3), atol=1e-14)
    corners = np.array(np.meshgrid(*zip(low, high))).reshape(3, -1).T - camera.axes @ camera.eye
    across, upwards = (np.abs(corners[:, k] / corners[:, 2]).max() / camera.opening for k in (0, 1))
    assert 0.75 < max(across / 1.1, upwards) < 1.0
    if planar:
        nearest, farthest = -corners[:, 2].max(), -corners[:, 2].min()
        assert farthest / nearest < 1.01  # what is behind is not drawn smaller


def test_a_body_with_no_shape_by_name_is_not_drawn(tmp_path):
    model = Model.from_toml("""
[bodies.seen]
mass = 1
shape = { sphere = [0.1] }
[bodies.hidden]
mass = 1
inertia = [1, 1, 1]
com = [0.2, 0, 0]
shape = "none"
[joints.a]
type = "revolute"
child = "seen"
axis = [0, 0, 1]
[joints.b]
type = "revolute"
parent = "seen"
child = "hidden"
origin = { xyz = [1, 0, 0] }
""")
    assert 'shape = "none"' in model.to_toml()
    system = model.derive()
    assert [body["shape"] for body in system.bodies] == ["sphere", "none"]
    run = system.run(t_end=0.2)
    run.save(tmp_path / "run.rrd")
    assert read_recording(tmp_path / "run.rrd").t[-1] == 0.2
    rows = system.kernel("poses")(0.0, run.states[0], run.p)
    _, rotations = geometry.split_poses(rows[None], 2)
    drawn = geometry.primitives(system.bodies, np.array([0.1]), rotations, 1.0, None)
    assert [x.kind for x in drawn] == ["sphere", geometry.NOTHING]
    assert drawn[1].half_thickness() == 0.0
    picture = drawing(system, run.p, 0.0, run.states[0])
    assert "seen" in picture and "hidden" not in picture
