"""`symgen advise`: the fastest time scale, stability limits, the step and method that fit, and why."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from symgen import runtime
from symgen.cli.arguments import NameValue, as_dict, find_model
from symgen.cli.control import with_control
from symgen.cli.failures import NOT_TRUSTED
from symgen.cli.files import CarefulCommand, OutputFile, write_text
from symgen.cli.recorded_state import place_in_run, recorded_state
from symgen.cli.settings import load_system, options_of, run_options
from symgen.cli.terminal import say
from symgen.runtime.checks.advice import advise
from symgen.runtime.recording.reader import read_recording
from symgen.runtime.result_json import to_json

if TYPE_CHECKING:
    from symgen.runtime.options import RunOptions
    from symgen.runtime.system import System


class PlaceInRun(click.ParamType):
    """`RUN.rrd@TIME`, converted to a path and a time [s]."""

    name = "RUN.rrd@TIME"

    def convert(self, value: Any, param: Any, context: click.Context | None) -> tuple[Path, float]:
        if isinstance(value, tuple):
            return value
        place = place_in_run(value)
        if place is None:
            self.fail(f"{value!r} is not of the form RUN.rrd@TIME, such as run.rrd@2.5", param, context)
        return place


@click.command("advise", cls=CarefulCommand)
@click.argument("model", required=False)
@click.option(
    "--option",
    "options",
    multiple=True,
    type=NameValue(),
    help="A build option of a .py model; may be repeated.",
)
@run_options
@click.option(
    "--at",
    "place",
    type=PlaceInRun(),
    help="Begin at a time of a recording; its own model if no MODEL is given.",
)
@click.option(
    "--steps-per-period",
    type=click.IntRange(min=2),
    help="N of the rule that a step is a period / N (default 50).",
)
@click.option("--json", "json_file", type=OutputFile(".json"), help="Write the advice to a file.")
@click.pass_context
def command(
    context: click.Context,
    model: str | None,
    options: tuple[tuple[str, str], ...],
    place: tuple[Path, float] | None,
    steps_per_period: int | None,
    json_file: Path | None,
    **given: Any,
) -> None:
    """Say which step and method suit MODEL, from its time scales at the start and along a short run.

    With --method, and --step where the method has one, that choice is checked: the exit status is 3 if not suited.
    """
    if model is None and place is None:
        raise click.UsageError("Missing argument 'MODEL', or --at RUN.rrd@TIME")
    system = (
        load_system(find_model(model), as_dict(options, "--option"))[0]
        if model
        else _recorded_model(place[0])
    )
    if place is not None and given["t_end"] is None and "t_end" not in system.run_defaults:
        given["t_end"] = _length(place[0])
    asked = options_of(system, given)
    if place is not None:
        asked = _begun_at(system, asked, *place)
    if model is not None:
        asked = with_control(find_model(model), system, asked)
    chosen = (given["method"], asked.step) if given["method"] not in (None, "auto") else None
    if chosen is None and given["step"] is not None:
        chosen = (asked.method, given["step"])
    advice = advise(system, asked, steps_per_period=steps_per_period, chosen=chosen)
    if json_file is not None:
        write_text(json_file, to_json(advice.to_dict()) + "\n")
    times = f"from t = {advice.t_first:.4g} s " if advice.t_first else ""
    say(f"{system.name}: time scales at {advice.n_states} states {times}up to t = {advice.t_seen:.4g} s")
    for line in advice.lines():
        say(f"  {line}")
    context.exit(0 if advice.ok else NOT_TRUSTED)


def _recorded_model(path: Path) -> System:
    return runtime.load(read_recording(path).module_text)


def _length(path: Path) -> float:
    t = read_recording(path).t
    return float(t[-1] - t[0])


def _begun_at(system: System, asked: RunOptions, path: Path, t: float) -> RunOptions:
    """Return options that make a run begin at the frame of a recording that is nearest to `t`."""
    state = recorded_state(system, path, t)
    start = dict(zip((c["name"] for c in system.coordinates), map(float, state.q)))
    rate = dict(zip((r["name"] for r in system.rates), map(float, state.v)))
    return replace(
        asked,
        start={**start, **asked.start},
        rate={**rate, **asked.rate},
        parameters={**state.parameters, **asked.parameters},
        t_start=state.t,
        t_end=state.t + asked.t_end,
    )
