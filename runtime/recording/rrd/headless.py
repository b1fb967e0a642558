"""The viewer without a window, which paints what a recording shows at a time."""

from __future__ import annotations

import contextlib
import os
import socket
import subprocess
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

from rerun.experimental import ViewerClient

from symgen.runtime.recording import schema
from symgen.runtime.recording.play import end_group
from symgen.runtime.recording.schema import RecordingError

_SOFTWARE_DRIVER = Path("/usr/share/vulkan/icd.d/lvp_icd.x86_64.json")
_START_SECONDS, _LOAD_SECONDS = 30.0, 60.0
_SETTLE_SECONDS, _ALIKE = 15.0, 2  # at most so long, or until so many pictures are as the one before
_LOOK = 0.1  # seconds between two looks at what the viewer has done


class HeadlessViewer:
    """A viewer that shows one recording, see `headless_viewer`.

    Parameters
    ----------
    client : rerun.experimental.ViewerClient
    """

    def __init__(self, client):
        self._client = client

    def open(self, recording: Path) -> None:
        """Load a recording; return when all of it is there.

        Raises
        ------
        RecordingError
            If that takes longer than a minute.
        """
        self._client.open(str(recording.resolve()))
        end = time.monotonic() + _LOAD_SECONDS
        while time.monotonic() < end:
            state = self._client.get_state()
            if state.views and not state.loading:
                return
            time.sleep(_LOOK)
        raise RecordingError(f"{recording}: the viewer has not loaded it within {_LOAD_SECONDS:g} s")

    def settle(self, at: float) -> None:
        """Return when the picture at a time has come to rest: at first the eye flies to its place."""
        end, before, same = time.monotonic() + _SETTLE_SECONDS, b"", 0
        while time.monotonic() < end and same < _ALIKE:
            now = self.painted(at, scene_only=False)
            before, same = now, same + 1 if now == before else 0
            time.sleep(_LOOK)

    def painted(self, at: float, *, scene_only: bool) -> bytes:
        """Return what is seen at the simulated time `at` [s], as a PNG: of the whole window, or of its scene.

        Raises
        ------
        RecordingError
            If a scene is asked for and the recording has no bodies.
        """
        self._client.set_time(schema.SIM_TIME, duration=at, play_state="paused")
        return self._client.take_screenshot(self._scene() if scene_only else None)

    def complaints(self) -> list[str]:
        """Return what the viewer has warned of, but for this machine's graphics."""
        logs = [entry for entry in self._client.get_logs() if str(entry.level).upper() in ("WARN", "ERROR")]
        return [entry.message for entry in logs if "oftware rasterizer" not in entry.message]

    def _scene(self) -> str:
        scenes = [view.view_id for view in self._client.get_state().views if view.view_class == "3D"]
        if not scenes:
            raise RecordingError(
                "the recording has no bodies, and so no scene to paint; paint all of the window"
            )
        return scenes[0]


@contextlib.contextmanager
def headless_viewer(command: Sequence[str], width: int, height: int) -> Iterator[HeadlessViewer]:
    """Run a viewer without a window that listens on this machine only; it is gone afterwards.

    Parameters
    ----------
    command : sequence of str
        That starts the viewer.
    width, height : int [pixels]
        Of its window.

    Raises
    ------
    RecordingError
        If it does not start: it needs a Vulkan driver, if only one in software.
    """
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    environment = {**os.environ, "RUST_LOG": "error"}
    if _SOFTWARE_DRIVER.exists():
        environment.setdefault("VK_ICD_FILENAMES", str(_SOFTWARE_DRIVER))
    place = ("--bind", "127.0.0.1", "--port", str(port))
    size = ("--window-size", f"{width}x{height}")
    # The command wraps the viewer in a second process, so both get a group of their own to be ended by.
    process = subprocess.Popen(
        [*command, "--headless", *place, *size, "--hide-welcome-screen"],
        env=environment,
        start_new_session=True,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        yield HeadlessViewer(_connected(process, port))
    finally:
        end_group(process)


def _connected(process: subprocess.Popen, port: int):
    end = time.monotonic() + _START_SECONDS
    while time.monotonic() < end and process.poll() is None:
        try:
            client = ViewerClient.connect(f"rerun+http://127.0.0.1:{port}/proxy")
            client.get_state()
            return client
        except Exception:
            time.sleep(3 * _LOOK)
    raise RecordingError(
        "the viewer does not start without a screen: it needs a Vulkan driver, if only one in software "
        "(on Debian and Ubuntu: apt-get install mesa-vulkan-drivers libvulkan1)"
    )
