"""Take a picture of a recording as the viewer shows it, on a machine without a screen.

    python benchmarks/screenshot.py RUN.rrd OUT.png --at 3.2

Needs a Vulkan driver, if only in software; on Debian: `apt-get install mesa-vulkan-drivers libvulkan1`.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import signal
import socket
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

from rerun.experimental import ViewerClient

from symgen.runtime.recording import schema
from symgen.runtime.recording.play import viewer_command
from symgen.runtime.recording.reader import read_recording

SOFTWARE_DRIVER = Path("/usr/share/vulkan/icd.d/lvp_icd.x86_64.json")
START_SECONDS = 30.0
TOASTS_FADE = 6.0  # seconds until the viewer's own messages are gone
TOP_BAR = 28 / 1080  # of the height: it shows warnings about the machine, not the recording


def main() -> None:
    """Read the command line and take the picture."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("recording", type=Path)
    parser.add_argument("picture", type=Path)
    parser.add_argument("--at", type=float, metavar="SECONDS", help="simulated time; the middle by default")
    parser.add_argument("--width", type=int, default=1600, help="of the picture, in pixels")
    parser.add_argument("--colours", type=int, default=0, help="of a palette, for a smaller file")
    options = parser.parse_args()
    t = read_recording(options.recording).t
    moment = float(t[len(t) // 2]) if options.at is None else options.at
    raw, warnings = take_picture(options.recording, moment)
    options.picture.write_bytes(raw)
    trim(options.picture, options.width, options.colours)
    for warning in warnings:
        print(warning)


def take_picture(recording: Path, at: float) -> tuple[bytes, list[str]]:
    """Show `recording` at the simulated time `at` [s]; return the PNG and the viewer's warnings."""
    with headless_viewer() as viewer:
        viewer.open(str(recording.resolve()))
        viewer.set_time(schema.SIM_TIME, duration=at, play_state="paused")
        time.sleep(TOASTS_FADE)
        logs = [entry.message for entry in viewer.get_logs() if str(entry.level).upper() in ("WARN", "ERROR")]
        return viewer.take_screenshot(), [text for text in logs if "oftware rasterizer" not in text]


@contextlib.contextmanager
def headless_viewer() -> Iterator[ViewerClient]:
    """Run a viewer without a window that listens on this machine only; it is gone afterwards."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    environment = {**os.environ, "RUST_LOG": "error"}
    if SOFTWARE_DRIVER.exists():
        environment.setdefault("VK_ICD_FILENAMES", str(SOFTWARE_DRIVER))
    command = [
        *viewer_command(),
        "--headless",
        "--bind",
        "127.0.0.1",
        "--port",
        str(port),
        "--hide-welcome-screen",
    ]
    # The command wraps the viewer in a second process, so both get a group of their own to be ended by.
    process = subprocess.Popen(command, env=environment, start_new_session=True, stderr=subprocess.DEVNULL)
    try:
        yield _connect(process, port)
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGTERM)
        process.wait()


def _connect(process: subprocess.Popen, port: int) -> ViewerClient:
    end = time.monotonic() + START_SECONDS
    while time.monotonic() < end and process.poll() is None:
        try:
            viewer = ViewerClient.connect(f"rerun+http://127.0.0.1:{port}/proxy")
            viewer.get_state()
            return viewer
        except Exception:
            time.sleep(0.3)
    raise SystemExit(
        "the viewer did not start: is there a Vulkan driver? (apt-get install mesa-vulkan-drivers libvulkan1)"
    )


def trim(picture: Path, width: int, colours: int) -> None:
    """Cut off the viewer's top bar, and scale to `width`; with `colours`, reduce to a palette of so many."""
    from PIL import Image

    with Image.open(picture) as opened:
        image = opened.convert("RGB")
    image = image.crop((0, round(TOP_BAR * image.height * 1.25), image.width, image.height))
    if image.width > width:
        image = image.resize((width, round(image.height * width / image.width)), Image.Resampling.LANCZOS)
    if colours:
        image = image.quantize(colours, dither=Image.Dither.NONE)
    image.save(picture, optimize=True)


if __name__ == "__main__":
    main()
