"""Show a recording in the Rerun viewer, and leave no process behind."""

from __future__ import annotations

import contextlib
import importlib.util
import os
import signal
import subprocess
import sys
from pathlib import Path

from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.lazy import Late
from symgen.runtime.recording.reader import read_times
from symgen.runtime.recording.schema import RecordingError

states_alone = Late("symgen.runtime.recording.states_alone")

_GRACE = 3.0  # seconds between asking the viewer to end and ending it


def play(path: str | Path, web: bool = False) -> int:
    """Open a recording in the viewer and wait until it is closed, or until Ctrl-C.

    The viewer listens on this machine only (127.0.0.1), on a free port.

    Parameters
    ----------
    path : path-like
    web : bool
        In the browser instead of a window.

    Returns
    -------
    int
        The viewer's exit status; 0 after Ctrl-C.

    Raises
    ------
    RecordingError
        If the file is not a recording, or is damaged.
    RuntimeModelError
        If there is no screen, or the viewer cannot be started.
    """
    path = Path(path)
    # The viewer would open an empty window on a damaged file.
    read_times(path)
    if not web and not _has_display():
        raise RuntimeModelError(
            f"{path}: this machine has no screen to play it on (neither DISPLAY nor WAYLAND_DISPLAY is set); "
            "use --web and open the address that it prints, or copy the file to a machine with a screen"
        )
    command = [*viewer_command(), "--bind", "127.0.0.1", "--port", "auto"]
    if web:
        command += ["--web-viewer", "--web-viewer-port", "0"]
    with states_alone.whole(path) as shown:
        return _run([*command, str(shown)])


def viewer_command() -> list[str]:
    """Return the command that starts this environment's own Rerun viewer.

    Raises
    ------
    RecordingError
        If the viewer is not part of this installation.
    """
    if importlib.util.find_spec("rerun_cli") is None:
        raise RecordingError("the Rerun viewer is not installed; install it with `pip install rerun-sdk`")
    return [sys.executable, "-m", "rerun_cli"]


def _has_display() -> bool:
    if sys.platform in ("win32", "darwin"):
        return True
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def _run(command: list[str]) -> int:
    # A group of its own: the viewer is a child of a wrapper, and both have to go.
    process = subprocess.Popen(command, start_new_session=True)
    before = signal.getsignal(signal.SIGTERM)
    if before is signal.SIG_DFL:
        with contextlib.suppress(ValueError):  # only the main thread may set handlers
            signal.signal(signal.SIGTERM, _interrupt)
    try:
        return process.wait()
    except KeyboardInterrupt:
        return 0
    finally:
        end_group(process)
        with contextlib.suppress(ValueError):
            signal.signal(signal.SIGTERM, before)


def _interrupt(number, frame) -> None:
    raise KeyboardInterrupt


def end_group(process: subprocess.Popen) -> None:
    """End a process and all that it started, asked first, then made to."""
    if not hasattr(os, "killpg"):
        subprocess.run(["taskkill", "/PID", str(process.pid), "/T", "/F"], capture_output=True, check=False)
        return
    for number in (signal.SIGTERM, signal.SIGKILL):
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(process.pid, number)
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(_GRACE)
            if number == signal.SIGTERM and not _group_lives(process.pid):
                return


def _group_lives(group: int) -> bool:
    try:
        os.killpg(group, 0)
    except (ProcessLookupError, PermissionError):
        return False
    return True
