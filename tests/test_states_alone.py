"""Recordings of states alone: what follows from them is what a recording of all that is shown holds."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from symgen import Model
from symgen.cli import main
from symgen.runtime import load, solve
from symgen.runtime.errors import ModuleError, RuntimeModelError
from symgen.runtime.recording import pictures, play, schema
from symgen.runtime.recording.compare import compare
from symgen.runtime.recording.reader import read_recording
from symgen.runtime.recording.recorder import RunRecorder
from symgen.runtime.recording.resume import Resumed
from symgen.runtime.recording.rrd.read import read_rrd
from symgen.runtime.recording.schema import RecordingError
from symgen.runtime.recording.states_alone import whole
from symgen.runtime.recording.verify import verify

ROOT = Path(__file__).resolve().parents[1]
# Constraints and multipliers, resets, inputs over time, stops with settings, quaternions.
MODELS = {
    "slider_crank": 0.5,
    "bouncing_ball": 1.5,
    "rough_road": 2.0,
    "door_stop": 2.0,
    "free_rigid_body": 1.0,
}


def text_of(name):
    return (ROOT / "generated" / f"{name}.py").read_text(encoding="utf-8")


def record(path, name, t_end, content, text=None, system=None, **options):
    """Record a run while it goes on."""
    made = []

    def begin(**settings):
        made.append(
            RunRecorder(
                path, module_text=text or text_of(name), model_text="the model", content=content, **settings
            )
        )
        return made[0]

    system = system or load(text_of(name))
    solution = solve(system, t_end, method="dop853", fps=100.0, recorder=begin, **options)
    made[0].finish(solution.status, [check.to_dict() for check in solution.health], solution.stats)
    return solution


@pytest.fixture(scope="module", params=MODELS)
def pair(request, tmp_path_factory):
    folder = tmp_path_factory.mktemp(request.param)
    for content in schema.CONTENTS:
        record(folder / f"{content}.rrd", request.param, MODELS[request.param], content)
    return folder / "all.rrd", folder / "states.rrd"


def test_states_are_the_same_to_the_last_bit(pair):
    first, second = map(read_recording, pair)
    assert (first.content, second.content) == schema.CONTENTS
    for name in ("t", "q", "v", "w", "multipliers", "settings"):
        assert getattr(first, name).tobytes() == getattr(second, name).tobytes()
    assert first.sha256 == second.sha256 == second.state_sha256()
    assert first.events == second.events and first.health == second.health
    assert second.energy.shape == (0, 3)
    assert pair[1].stat().st_size < pair[0].stat().st_size


class _Every(list):
    """All entities."""

    def __contains__(self, entity):
        return True


def drawn(path):
    """All numbers of bodies and curves in a file, by entity and component, in the order of their frames."""
    _, batches, _ = read_rrd(path, _Every())
    found = {}
    for entity, parts in batches.items():
        if entity.split("/")[0] not in ("world", "plots"):
            continue
        for batch in parts:
            for column in batch.schema.names:
                if ":" in column and schema.FRAME in batch.schema.names:
                    frames = batch.column(schema.FRAME).to_numpy()
                    rows = zip(frames.tolist(), batch.column(column).to_pylist())
                    found.setdefault((entity, column), []).extend(rows)
    return {key: sorted(rows, key=lambda row: row[0]) for key, rows in found.items()}


def test_what_is_shown_is_worked_out_as_it_was_written(pair):
    with whole(pair[0]) as shown:
        assert shown == pair[0]
    with whole(pair[1]) as shown:
        first, second = read_recording(pair[0]), read_recording(shown)
        np.testing.assert_array_equal(first.energy, second.energy)
        assert first.states.tobytes() == second.states.tobytes() and first.events == second.events
        assert second.complete and second.content == schema.ALL
        expected, got = drawn(pair[0]), drawn(shown)
        assert got.keys() == expected.keys() and len(got) > 3
        for key, rows in expected.items():
            assert got[key] == rows, key
    assert not shown.exists()


def test_it_is_verified_compared_and_exported(pair, tmp_path):
    assert verify(pair[1]).ok
    comparison = compare(*pair, tolerance=0.0)
    assert comparison.equal and "T + V" in {d.name for d in comparison.differences}
    tables = []
    for path in pair:
        table = tmp_path / f"{path.stem}.csv"
        assert CliRunner().invoke(main, ["export", str(path), "--csv", str(table)]).exit_code == 0
        tables.append(table.read_text())
    assert tables[0] == tables[1] and "kinetic_energy" in tables[0]


def test_a_changed_state_is_found(tmp_path):
    path = tmp_path / "run.rrd"
    record(path, "double_pendulum", 1.0, schema.STATES)
    content = bytearray(path.read_bytes())
    value = read_recording(path).q[50, 0].tobytes()
    place = content.find(value)
    if place < 0:  # packed
        pytest.skip("Rerun packed the states")
    content[place] ^= 1
    path.write_bytes(content)
    assert not verify(path).ok


def test_a_file_that_was_cut_off_holds_what_came_before(tmp_path):
    path, cut = tmp_path / "run.rrd", tmp_path / "cut.rrd"
    solution = record(path, "double_pendulum", 200.0, schema.STATES)
    content = path.read_bytes()
    cut.write_bytes(content[: int(0.6 * len(content))])
    found = read_recording(cut)
    n = len(found.t)
    assert not found.complete and 50 <= n < len(solution.t)
    np.testing.assert_array_equal(found.q, solution.q[:n])
    with whole(cut) as shown:
        assert len(read_recording(shown).energy) == n


def test_a_run_goes_on_from_states_alone(tmp_path):
    first, at_once, rest = (tmp_path / f"{name}.rrd" for name in ("first", "at_once", "rest"))
    record(first, "slider_crank", 0.2, schema.STATES)
    record(at_once, "slider_crank", 0.5, schema.STATES)
    made = []

    def begin(**settings):
        made.append(
            RunRecorder(
                rest,
                module_text=text_of("slider_crank"),
                model_text="",
                content=schema.STATES,
                **settings,
            )
        )
        return made[0]

    solution = Resumed(first).run(0.5, recorder=begin)
    made[0].finish(solution.status, [], solution.stats)
    assert read_recording(rest).states[-1].tobytes() == read_recording(at_once).states[-1].tobytes()


def test_the_command_line_records_states_and_goes_on(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    run = ["run", "double_pendulum", "--fps", "50", "--log-states", "--quiet"]
    assert CliRunner().invoke(main, [*run, "--t-end", "1", "--log", "half.rrd"]).exit_code == 0
    assert CliRunner().invoke(main, [*run, "--t-end", "2", "--log", "whole.rrd"]).exit_code == 0
    resumed = CliRunner().invoke(main, ["run", "--resume", "half.rrd", "--t-end", "2", "--quiet"])
    assert resumed.exit_code == 0, resumed.output
    half, at_once = read_recording("half.rrd"), read_recording("whole.rrd")
    assert half.content == at_once.content == schema.STATES
    assert half.states.tobytes() == at_once.states.tobytes()
    assert CliRunner().invoke(main, ["verify", "whole.rrd"]).exit_code == 0
    refused = CliRunner().invoke(main, ["run", "pendulum", "--log-states", "--no-log"])
    assert refused.exit_code == 2 and "--log-states contradict" in refused.output


def test_the_viewer_is_given_what_was_worked_out(tmp_path, monkeypatch):
    path = tmp_path / "run.rrd"
    record(path, "double_pendulum", 1.0, schema.STATES)
    seen = []

    def painted(file, times, frame):
        seen.append(read_recording(file).content)
        yield b"a picture"

    def run(command):
        seen.append((Path(command[-1]).name, read_recording(command[-1]).content))
        return 0

    monkeypatch.setattr(pictures, "_painted", painted)
    monkeypatch.setattr(play, "_run", run)
    monkeypatch.setattr(play, "_has_display", lambda: True)
    pictures.image(path, tmp_path / "picture.png")
    assert play.play(path) == 0
    assert seen == [schema.ALL, ("run.rrd", schema.ALL)]


def test_the_module_of_a_stranger_is_checked(tmp_path):
    """It is no code: what is no module of this program is refused before anything of it is used."""
    path = tmp_path / "run.rrd"
    text = text_of("double_pendulum").replace("def poses(", "import os\ndef poses(", 1)
    record(path, "double_pendulum", 0.5, schema.STATES, text=text)
    with pytest.raises(ModuleError), whole(path):
        pass
    other = tmp_path / "other.rrd"
    record(other, "double_pendulum", 0.5, schema.STATES, text=text_of("pendulum"))
    with pytest.raises(RecordingError, match="columns of coordinates"), whole(other):
        pass


def test_meshes_are_taken_from_beside_the_recording(tmp_path):
    folder = tmp_path / "model"
    folder.mkdir()
    triangle = (
        "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n"
        "endsolid s\n"
    )
    (folder / "stone.stl").write_text(triangle)
    model = Model("stone", gravity=(0, 0, -9.81), folder=folder)
    z = model.coordinate("z", start=1.0)
    model.body("stone", mass=1.0, com=(0, 0, z), shape={"mesh": "stone.stl"})
    model.run(t_end=0.1)
    path = tmp_path / "run.rrd"
    system = model.derive()
    solve(system, 0.1).save(path, content="states")
    with (
        pytest.raises(RecordingError, match=r"there is no file .*stone\.stl.*beside|put them there"),
        whole(path),
    ):
        pass
    (tmp_path / "stone.stl").write_text(triangle)
    with whole(path) as shown:
        assert read_recording(shown).complete


def test_other_contents_are_refused(tmp_path):
    system = load(text_of("pendulum"))
    with pytest.raises(ValueError, match="content is 'poses', not one of all, states"):
        solve(system, 0.1).save(tmp_path / "run.rrd", content="poses")
    with pytest.raises(RuntimeModelError):
        solve(system, 0.1).save(tmp_path / "nowhere" / "run.rrd", content="states")
