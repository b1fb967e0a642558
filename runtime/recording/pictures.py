"""Pictures and films of a recording, made by the viewer without a screen."""

from __future__ import annotations

import io
import os
import shutil
import subprocess
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.lazy import Late
from symgen.runtime.recording.layout import choose_speed
from symgen.runtime.recording.play import viewer_command
from symgen.runtime.recording.reader import read_times

states_alone = Late("symgen.runtime.recording.states_alone")
headless = Late("symgen.runtime.recording.rrd.headless")
images = Late("PIL.Image")  # comes with the viewer

FILMS = (".mp4", ".webm", ".gif")
_TOP_BAR = 36  # pixels: it shows buttons, and warnings about the machine
_SCENE_SHARE, _SCENE_FRAME = 0.6, 70  # of the window's width that the scene takes; pixels above and below it
_LONGEST_FILM = 3600  # frames


@dataclass(frozen=True)
class Frame:
    """How large a picture is, and what of the window it shows.

    Attributes
    ----------
    width, height : int [pixels]
        To a few pixels where it shows the scene only.
    scene_only : bool
        The scene without the plots beside it.
    """

    width: int = 1600
    height: int = 900
    scene_only: bool = False


def image(recording: Path, file: Path, at: float | None = None, frame: Frame | None = None) -> None:
    """Paint what a recording shows at a time as a PNG file.

    Parameters
    ----------
    recording, file : Path
    at : float, optional [s]
        Simulated time; the middle of the run without it.
    frame : Frame, optional

    Raises
    ------
    RuntimeModelError
        If the recording cannot be read, the time is outside the run, or the viewer does not start.
    """
    frame = frame or Frame()
    t = read_times(recording)
    moment = float(t[len(t) // 2]) if at is None else at
    if not t[0] <= moment <= t[-1]:
        raise RuntimeModelError(
            f"{recording}: {moment:g} s is outside the run, which is from {t[0]:g} s to {t[-1]:g} s"
        )
    with states_alone.whole(recording) as shown:
        (content,) = _painted(shown, [moment], frame)
    _write_whole(file, lambda place: place.write_bytes(content))


def film(
    recording: Path,
    file: Path,
    fps: float = 25.0,
    frame: Frame | None = None,
    progress: Callable[[int, int], None] = lambda done, of: None,
) -> None:
    """Film a recording, at the speed at which it is played back.

    Parameters
    ----------
    recording : Path
    file : Path
        `.mp4` and `.webm` are made by ffmpeg, `.gif` needs nothing else.
    fps : float [1/s]
        Frames per second of the film.
    frame : Frame, optional
    progress : callable
        (frames that are painted, all of them), called after each.

    Raises
    ------
    RuntimeModelError
        If ffmpeg is needed and not there, the recording cannot be read, or the viewer does not start.
    """
    frame = frame or Frame()
    maker = None if file.suffix == ".gif" else _ffmpeg(file)
    t = read_times(recording)
    seconds = float(t[-1] - t[0])
    n = max(2, round(seconds / choose_speed(seconds) * fps) + 1)
    if n > _LONGEST_FILM:
        raise RuntimeModelError(
            f"{file}: would have {n} frames, and the most are {_LONGEST_FILM}; ask for fewer frames per second"
        )

    def counted() -> Iterator[bytes]:
        with states_alone.whole(recording) as shown:
            paintings = _painted(shown, np.linspace(t[0], t[-1], n).tolist(), frame)
            for done, content in enumerate(paintings, 1):
                progress(done, n)
                yield content

    if maker is None:
        _write_whole(file, lambda place: _as_gif(counted(), place, fps))
    else:
        _write_whole(file, lambda place: _by_ffmpeg(maker, counted(), place, fps))


def _painted(recording: Path, times: list[float], frame: Frame) -> Iterator[bytes]:
    """Yield a PNG for each time."""
    width, window = frame.width, frame.height + _TOP_BAR
    if frame.scene_only:
        width, window = round(width / _SCENE_SHARE), window + _SCENE_FRAME
    with headless.headless_viewer(viewer_command(), width, window) as viewer:
        viewer.open(recording)
        viewer.settle(times[0])
        for t in times:
            content = viewer.painted(t, scene_only=frame.scene_only)
            yield content if frame.scene_only else _without_top_bar(content, window)


def _without_top_bar(content: bytes, window: int) -> bytes:
    with images.open(io.BytesIO(content)) as opened:
        picture = opened.convert("RGB")
    bar = round(_TOP_BAR * picture.height / window)  # on some screens a point is several pixels
    out = io.BytesIO()
    picture.crop((0, bar, picture.width, picture.height)).save(out, "PNG", optimize=True)
    return out.getvalue()


def _ffmpeg(file: Path) -> str:
    found = shutil.which("ffmpeg")
    if found is None:
        raise RuntimeModelError(
            f"{file}: ffmpeg is not installed, which makes such films; install it, or name a .gif, which needs nothing"
        )
    return found


def _by_ffmpeg(ffmpeg: str, pictures: Iterator[bytes], place: Path, fps: float) -> None:
    command = [
        ffmpeg, "-y", "-loglevel", "error", "-f", "image2pipe", "-framerate", f"{fps:g}", "-c:v", "png", "-i", "-",
        "-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-pix_fmt", "yuv420p", str(place),
    ]  # fmt: skip
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.PIPE)
    try:
        for content in pictures:
            process.stdin.write(content)
        _, said = process.communicate()
    except BrokenPipeError:
        _, said = process.communicate()
    except BaseException:
        process.kill()
        process.communicate()
        raise
    if process.returncode:
        lines = said.decode(errors="replace").strip().splitlines() or [f"status {process.returncode}"]
        raise RuntimeModelError(f"ffmpeg could not make the film: {lines[-1]}; a .gif needs no ffmpeg")


def _as_gif(pictures: Iterator[bytes], place: Path, fps: float) -> None:
    frames = []
    for content in pictures:
        with images.open(io.BytesIO(content)) as opened:
            frames.append(opened.convert("RGB").quantize(128))
    frames[0].save(place, save_all=True, append_images=frames[1:], duration=round(1000.0 / fps), loop=0)


def _write_whole(file: Path, write: Callable[[Path], object]) -> None:
    """Write a file whole or not at all; `write` takes a place beside it."""
    partial = file.with_name(f".{file.stem[:80]}.{os.getpid()}.part{file.suffix}")
    try:
        write(partial)
        os.replace(partial, file)
    finally:
        partial.unlink(missing_ok=True)
