"""Recordings in the real viewer: in a browser's server that leaves nothing behind, and without a screen."""

from __future__ import annotations

import io
import itertools
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from scipy import ndimage

from symgen.runtime import load, solve
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.recording import pictures, schema
from symgen.runtime.recording.play import viewer_command
from symgen.runtime.recording.recorder import RunRecorder

ROOT = Path(__file__).resolve().parents[1]
DRIVERS = Path("/usr/share/vulkan/icd.d")
needs_proc = pytest.mark.skipif(not Path("/proc/net/tcp").exists(), reason="looks at processes in /proc")
needs_vulkan = pytest.mark.skipif(not list(DRIVERS.glob("*.json")), reason="no Vulkan driver")


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    """A four-bar linkage: three bars, an output, two constraints."""
    path = tmp_path_factory.mktemp("viewer") / "four_bar.rrd"
    text = (ROOT / "generated" / "four_bar.py").read_text(encoding="utf-8")
    made = []

    def recorder(**settings):
        made.append(RunRecorder(path, module_text=text, model_text="", **settings))
        return made[0]

    solution = solve(load(text), 2.0, method="dop853", recorder=recorder)
    made[0].finish(solution.status, [check.to_dict() for check in solution.health], solution.stats)
    return path


# In the browser


def descendants(pid):
    """Processes below one, from /proc."""
    parents = {}
    for status in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = status.read_text().rpartition(")")[2].split()
        except OSError:
            continue
        if fields[0] != "Z":
            parents[int(status.parent.name)] = int(fields[1])
    found = [pid]
    for parent in found:
        found += [child for child, own in parents.items() if own == parent]
    return found[1:]


def alive(pid):
    """Whether a process is there and not merely waiting to be buried."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def listening_addresses(pids):
    """Addresses, as /proc/net has them, on which these processes accept connections."""
    sockets = set()
    for pid in pids:
        for link in Path(f"/proc/{pid}/fd").glob("*"):
            try:
                sockets.add(os.readlink(link))
            except OSError:
                continue
    addresses = []
    for table in ("/proc/net/tcp", "/proc/net/tcp6"):
        for line in Path(table).read_text().splitlines()[1:]:
            fields = line.split()
            if fields[3] == "0A" and f"socket:[{fields[9]}]" in sockets:
                addresses.append(fields[1].partition(":")[0])
    return addresses


@needs_proc
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=["Ctrl-C", "terminated"])
def test_the_browsers_server_listens_here_only_and_leaves_nothing(recording, number):
    code = "import sys; from symgen.cli import main; main(sys.argv[1:])"
    environment = {**os.environ, "BROWSER": "true"}  # a command that does nothing
    process = subprocess.Popen(
        [sys.executable, "-c", code, "play", "--web", str(recording)],
        env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True,
    )  # fmt: skip
    try:
        end, addresses = time.monotonic() + 60, []
        while time.monotonic() < end and process.poll() is None and len(addresses) < 2:
            children = descendants(process.pid)
            addresses = listening_addresses(children)
            time.sleep(0.1)
        assert len(addresses) >= 2, "the data's server and the page's"
        assert set(addresses) == {"0100007F"}  # 127.0.0.1
        children = descendants(process.pid)
        os.kill(process.pid, number)
        assert process.wait(20) == 0
        time.sleep(0.3)
        assert not [pid for pid in children if alive(pid)]
        assert not listening_addresses(children)
    finally:
        for pid in (*descendants(process.pid), process.pid):
            if alive(pid):
                os.kill(pid, signal.SIGKILL)


# Without a screen


@pytest.fixture(scope="module")
def viewer(recording):
    """A headless viewer that shows the recording."""
    from symgen.runtime.recording.rrd.headless import headless_viewer

    with headless_viewer(viewer_command(), 1280, 800) as viewer:
        viewer.open(recording)
        viewer.settle(0.3)
        yield viewer


def pixels(content):
    """A picture's pixels, shape (height, width, 3)."""
    from PIL import Image

    with Image.open(io.BytesIO(content)) as image:
        return np.asarray(image.convert("RGB")).astype(int)


@needs_vulkan
def test_the_viewer_shows_bodies_that_move_and_plots(viewer):
    early, late = (pixels(viewer.painted(t, scene_only=False)) for t in (0.3, 1.1))
    height, width, _ = early.shape
    scene = np.s_[height // 10 : 9 * height // 10, : width // 2]
    for index in range(3):  # a bar of each colour, shaded by the light
        colour = np.array(schema.colour(index))
        hue = early[scene] / np.maximum(early[scene].max(axis=2, keepdims=True), 60)
        likeness = np.abs(hue - colour / colour.max()).max(axis=2)
        assert (likeness < 0.12).sum() > 300, f"no body of colour {index}"
    assert (np.abs(early[scene] - late[scene]).max(axis=2) > 40).sum() > 2000, "nothing moved"
    plots = early[height // 10 : 9 * height // 10, 2 * width // 3 :]
    curve = np.abs(plots - np.array(schema.colour(0))).max(axis=2) < 30
    assert curve.sum() > 200, "no curves"


@needs_vulkan
def test_the_viewer_has_nothing_to_complain_about(viewer):
    assert not viewer.complaints()


@needs_vulkan
def test_parallel_lines_of_a_plane_model_are_parallel_and_to_scale(viewer):
    """Rays are parallel: the pins of the frame, 0.3 m apart, and a crank of 0.1 m, are so in the picture."""
    scene = pixels(viewer.painted(0.3, scene_only=True))
    light = (np.abs(scene - np.array(schema.MARK_COLOURS["pin"])).max(axis=2) < 40) & (
        np.ptp(scene, axis=2) < 25
    )
    shape = ndimage.binary_opening(light, iterations=3)  # pins are discs, the lines of supports are thin
    labels, n = ndimage.label(shape)
    assert n >= 4
    centres = np.array(ndimage.center_of_mass(shape, labels, range(1, n + 1)))[:, ::-1]
    solution = solve(
        load((ROOT / "generated" / "four_bar.py").read_text(encoding="utf-8")), 0.3, method="dop853"
    )
    crank, rocker = solution["crank"][-1], solution["rocker"][-1]
    wanted = np.array([[0.0, 0.0], [0.3, 0.0], [0.1 * np.cos(crank), 0.1 * np.sin(crank)],
                       [0.3 + 0.25 * np.cos(rocker), 0.25 * np.sin(rocker)]])  # fmt: skip
    # The one scale and shift that bring the places of the pins onto the picture's.
    best = min(
        (np.abs(fit(wanted, np.array(chosen))).max() for chosen in itertools.permutations(centres, 4)),
        default=np.inf,
    )
    assert best < 2.5  # pixels


def fit(places, seen):
    """What is left of places [m] in a picture [pixels], y down, after the best scale and shift."""
    a = (places - places.mean(axis=0)) * [1.0, -1.0]
    b = seen - seen.mean(axis=0)
    return b - a * (a * b).sum() / (a * a).sum()


# Pictures and films


@needs_vulkan
def test_a_picture_and_a_film_are_made_without_a_screen(recording, tmp_path):
    from PIL import Image

    picture, film = tmp_path / "run.png", tmp_path / "run.gif"
    pictures.image(recording, picture, at=0.5, frame=pictures.Frame(800, 500))
    with Image.open(picture) as image:
        assert image.size == (800, 500)
    pictures.film(recording, film, fps=2.0, frame=pictures.Frame(400, 300, scene_only=True))
    with Image.open(film) as image:
        assert image.n_frames == 5 and image.info["duration"] == 500
        image.seek(0)
        first = np.asarray(image.convert("RGB")).astype(int)
        image.seek(2)
        assert (np.abs(np.asarray(image.convert("RGB")).astype(int) - first).max(axis=2) > 40).sum() > 200


def test_times_outside_the_run_and_films_without_ffmpeg_are_refused(recording, tmp_path, monkeypatch):
    with pytest.raises(RuntimeModelError, match="9 s is outside the run, which is from 0 s to 2 s"):
        pictures.image(recording, tmp_path / "a.png", at=9.0)
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(RuntimeModelError, match=r"ffmpeg is not installed.*or name a \.gif"):
        pictures.film(recording, tmp_path / "a.mp4")
    with pytest.raises(RuntimeModelError, match=r"would have .* frames"):
        pictures.film(recording, tmp_path / "a.gif", fps=1e4)
    assert not list(tmp_path.iterdir())


def test_without_a_driver_the_remedy_is_named(recording, tmp_path, monkeypatch):
    monkeypatch.setattr(pictures, "viewer_command", lambda: [sys.executable, "-c", "raise SystemExit(1)"])
    with pytest.raises(RuntimeModelError, match=r"Vulkan driver.*apt-get install"):
        pictures.image(recording, tmp_path / "a.png")
    assert not list(tmp_path.iterdir())
