"""`symgen play`: show a recording in the Rerun viewer, or make a picture or a film of it."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import click

from symgen.cli.arguments import Positive, Times
from symgen.cli.failures import FAILED
from symgen.cli.files import FilmFile, OutputFile
from symgen.cli.terminal import complain
from symgen.runtime.lazy import Late
from symgen.runtime.recording.play import play

pictures = Late("symgen.runtime.recording.pictures")

_LARGEST = 8192  # pixels


class WindowSize(click.ParamType):
    """`WIDTHxHEIGHT` in pixels, converted to a pair of integers."""

    name = "WIDTHxHEIGHT"

    def convert(self, value: Any, param: Any, context: click.Context | None) -> tuple[int, int]:
        if isinstance(value, tuple):
            return value
        found = re.fullmatch(r"(\d{3,4})x(\d{3,4})", value)
        if not found or max(size := (int(found[1]), int(found[2]))) > _LARGEST or min(size) < 200:
            self.fail(f"{value!r} is no size such as 1600x900, from 200 to {_LARGEST} pixels", param, context)
        return size


@click.command("play")
@click.argument("recording", metavar="RUN.rrd", type=click.Path(path_type=Path))
@click.option("--web", is_flag=True, help="Show it in the browser.")
@click.option(
    "--image", "image_file", type=OutputFile(".png"), help="Make a picture (.png); needs no screen."
)
@click.option(
    "--at", type=Times(), metavar="T", help="Time of the picture [s] (default the middle of the run)."
)
@click.option(
    "--video",
    "film_file",
    type=FilmFile(),
    help="Make a film (.mp4, .webm by ffmpeg; .gif); needs no screen.",
)
@click.option("--fps", type=Positive(), help="Frames of the film a second (default 25).")
@click.option("--size", type=WindowSize(), help="Of picture and film in pixels (default 1600x900).")
@click.option("--scene", is_flag=True, help="Picture and film show the scene without the plots.")
@click.pass_context
def command(
    context: click.Context,
    recording: Path,
    web: bool,
    image_file: Path | None,
    at: tuple[float, ...] | None,
    film_file: Path | None,
    **look: Any,
) -> None:
    """Show RUN.rrd in the Rerun viewer until it is closed, or make a picture or a film of it."""
    _refuse_contradictions(web, image_file, at, film_file, look)
    if image_file is None and film_file is None:
        status = play(recording, web=web)
        if status:
            complain(f"Error: the Rerun viewer ended with status {status}")
            context.exit(FAILED)
        return
    frame = pictures.Frame(*(look["size"] or (1600, 900)), scene_only=look["scene"])
    if image_file is not None:
        pictures.image(recording, image_file, at[0] if at else None, frame)
    if film_file is not None:
        with click.progressbar(label=str(film_file), file=click.get_text_stream("stderr"), length=1) as bar:

            def progress(done: int, of: int) -> None:
                bar.length = of
                bar.update(1)

            pictures.film(recording, film_file, look["fps"] or 25.0, frame, progress)


def _refuse_contradictions(
    web: bool,
    image_file: Path | None,
    at: tuple[float, ...] | None,
    film_file: Path | None,
    look: dict[str, Any],
) -> None:
    making = image_file is not None or film_file is not None
    if web and making:
        raise click.UsageError(
            "--web shows the recording, --image and --video need no screen: name one of them"
        )
    if at is not None and (image_file is None or len(at) != 1):
        raise click.UsageError("--at is the one time of the picture that --image makes")
    if look["fps"] is not None and film_file is None:
        raise click.UsageError("--fps is of the film that --video makes")
    if not making and (look["size"] is not None or look["scene"]):
        raise click.UsageError("--size and --scene are of the picture or film that --image or --video makes")
