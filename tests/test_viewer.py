"""Recordings in the real viewer: in a browser's server that leaves nothing behind, and without a screen."""

from __future__ import annotations

import importlib.util
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from symgen.runtime import load, solve
from symgen.runtime.recording import schema
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
    spec = importlib.util.spec_from_file_location("screenshot", ROOT / "benchmarks" / "screenshot.py")
    screenshot = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(screenshot)
    with screenshot.headless_viewer() as viewer:
        viewer.open(str(recording))
        time.sleep(2.0)
        yield viewer


def picture(viewer, t, path):
    """What the viewer shows at a time, shape (height, width, 3)."""
    from PIL import Image

    viewer.set_time(schema.SIM_TIME, duration=t, play_state="paused")
    time.sleep(1.5)
    path.write_bytes(viewer.take_screenshot())
    with Image.open(path) as image:
        return np.asarray(image.convert("RGB")).astype(int)


@needs_vulkan
def test_the_viewer_shows_bodies_that_move_and_plots(viewer, tmp_path):
    pytest.importorskip("PIL")
    early, late = (picture(viewer, t, tmp_path / f"{t}.png") for t in (0.3, 1.1))
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
    levels = {"WARN", "ERROR"}
    logs = [entry.message for entry in viewer.get_logs() if str(entry.level).upper() in levels]
    assert not [text for text in logs if "oftware rasterizer" not in text]
