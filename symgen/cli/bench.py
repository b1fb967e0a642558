"""`symgen bench`: run time against error of every method on scenes with known end states."""

from __future__ import annotations

import importlib.util
import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from symgen.cli.failures import FAILED, interrupted_status
from symgen.cli.files import CarefulCommand, OutputFile, claim, write_text
from symgen.cli.settings import load_system
from symgen.cli.terminal import complain, say
from symgen.errors import SymgenError
from symgen.model.library import bundled_folder, find
from symgen.runtime.errors import RuntimeModelError, nearest
from symgen.runtime.integrate.methods import METHODS
from symgen.runtime.result_json import to_json

if TYPE_CHECKING:
    from work_precision.case import Effort
    from work_precision.scene_run import SceneRun


@click.command("bench", cls=CarefulCommand)
@click.argument("scenes", nargs=-1, metavar="[SCENE]...")
@click.option("--methods", help="Names of methods, separated by commas (default: all).")
@click.option("--quick", is_flag=True, help="Fewer settings, shorter runs.")
@click.option("--peers", is_flag=True, help="Also measure other integrators that are installed.")
@click.option("--peer-seconds", type=click.FloatRange(0, min_open=True), help="Longest run of a peer [s].")
@click.option(
    "--json", "json_file", type=OutputFile(".json"), help="Everything measured (default: bench.json)."
)
@click.option(
    "--png", "png_file", type=OutputFile(".png"), help="The work-precision diagram (default: bench.png)."
)
@click.option("--list", "only_list", is_flag=True, help="List the scenes and stop.")
@click.pass_context
def command(
    context: click.Context,
    scenes: tuple[str, ...],
    methods: str | None,
    quick: bool,
    peers: bool,
    peer_seconds: float | None,
    json_file: Path | None,
    png_file: Path | None,
    only_list: bool,
) -> None:
    """Measure run time against error: every method on each SCENE (all by default), and what `auto` chooses.

    The error is that of the end state against a reference of high precision. Run times are those of the compiled
    loop; `solve` is the whole call with assembly, frames and checks.
    """
    _benchmarks()
    from work_precision.case import FULL, QUICK
    from work_precision.scenes import SCENES, find_scene

    if only_list:
        for scene in SCENES.values():
            say(f"{scene.name:24}{scene.says}, {scene.t_end:g} s of {scene.model}")
        return
    _check_figure(png_file)
    json_file = json_file or claim("the figures", Path("bench.json"))
    png_file = png_file or claim("the diagram", Path("bench.png"))
    chosen = [find_scene(name) for name in dict.fromkeys(scenes)] or list(SCENES.values())
    names = _method_names(methods)
    bench = _Bench(QUICK if quick else FULL, names, peers, peer_seconds)
    interrupted = False
    try:
        for scene in chosen:
            bench.measure(scene)
    except KeyboardInterrupt:
        interrupted = True
    bench.write(json_file, png_file)
    if interrupted:
        complain("interrupted; what was measured is kept")
    context.exit(interrupted_status() if interrupted else FAILED if bench.failed else 0)


def _method_names(text: str | None) -> list[str] | None:
    if text is None:
        return None
    names = list(dict.fromkeys(name.strip() for name in text.split(",") if name.strip()))
    for name in names:
        if name not in METHODS:
            raise click.UsageError(f"--methods: there is no method {name!r}: {nearest(name, METHODS)}")
    return names or None


def _check_figure(png_file: Path | None) -> None:
    if png_file is not None and importlib.util.find_spec("matplotlib") is None:
        raise click.UsageError("--png needs matplotlib: pip install 'symgen[figures]'")


class _Bench:
    """Measures scene after scene, shows each table when it is there, and keeps the results."""

    def __init__(self, effort: Effort, methods: list[str] | None, peers: bool, peer_seconds: float | None):
        self.effort, self.methods, self.peers = effort, methods, peers
        self.peer_effort = replace(effort, longest_run=peer_seconds or effort.longest_run)
        self.results: list[dict[str, Any]] = []
        self.failed = False

    def measure(self, scene: Any) -> None:
        """Measure a scene and print its table; also when Ctrl-C ends it early."""
        run = self._prepared(scene)
        if run is None:
            return
        try:
            run.measure(self.methods, lambda name: _progress(f"{scene.name}: {name}"))
            if self.peers:
                self._measure_peers(run)
        finally:
            _progress("")
            from work_precision.report import scene_table

            self.results.append(run.to_dict())
            for line in [*scene_table(self.results[-1]), ""]:
                say(line)

    def _prepared(self, scene: Any) -> SceneRun | None:
        from work_precision.scene_run import SceneRun

        try:
            system, module = load_system(Path(find(scene.model)), dict(scene.options))
            return SceneRun(scene, system, module.text, bundled_folder() / "references", self.effort)
        except (RuntimeModelError, SymgenError) as error:
            complain(f"{scene.name}: left out: {error}")
            self.failed = True
            return None

    def _measure_peers(self, run: SceneRun) -> None:
        from work_precision.peers import find_peers, run_peer

        for name, script in find_peers(_benchmarks() / "peers").items():
            _progress(f"{run.case.scene.name}: {name}")
            run.peers.update(run_peer(script, run.case, self.peer_effort))

    def write(self, json_file: Path, png_file: Path) -> None:
        """Write what was measured."""
        if not self.results:
            return
        from work_precision.machine import machine

        data = {"machine": machine(), "scenes": self.results}
        write_text(json_file, to_json(data) + "\n")
        say(f"figures: {json_file}")
        if importlib.util.find_spec("matplotlib") is not None:
            from work_precision.figure import write_figure

            write_figure(self.results, png_file)
            say(f"diagram: {png_file}")


def _benchmarks() -> Path:
    """Return the folder of the benchmarks, and let its package `work_precision` be imported; wheels have neither."""
    folder = Path(__file__).resolve().parents[2] / "benchmarks"
    if not (folder / "work_precision").is_dir():
        raise click.ClickException(
            "the benchmarks are not installed with symgen: they are in the folder benchmarks/ of its repository; "
            "`symgen bench` runs from a clone of it, installed with `pip install -e .`"
        )
    if str(folder) not in sys.path:
        sys.path.append(str(folder))
    return folder


def _progress(text: str) -> None:
    """Show what is being measured, where somebody watches."""
    stream = click.get_text_stream("stderr")
    if stream.isatty():
        click.echo(f"\r{text}\x1b[K", err=True, nl=False)
