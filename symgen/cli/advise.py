"""`symgen advise`: the fastest time scale, stability limits, the step and method that fit, and why.

`--frequency`: the same of an oscillation that is known, without a model.
"""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import click

from symgen import link, runtime
from symgen.cli.arguments import NameValue, as_dict, find_model
from symgen.cli.control import with_control
from symgen.cli.failures import NOT_TRUSTED
from symgen.cli.files import CarefulCommand, OutputFile, write_text
from symgen.cli.recorded_state import place_in_run, recorded_state
from symgen.cli.settings import load_system, options_of, run_options
from symgen.cli.terminal import say
from symgen.runtime.checks.advice import Advice, Cost, advise, length_to_see
from symgen.runtime.lazy import Late
from symgen.runtime.quantities import QuantityError, in_si
from symgen.runtime.recording.reader import read_recording
from symgen.runtime.result_json import to_json

if TYPE_CHECKING:
    from symgen.runtime.options import RunOptions
    from symgen.runtime.system import System

toml_reader = Late("symgen.model.toml_reader")


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


class Frequency(click.ParamType):
    """An angular frequency [rad/s]: a number, "100 rad/s", or turns by time, such as "16 Hz"."""

    name = "RATE"

    def convert(self, value: Any, param: Any, context: click.Context | None) -> float:
        if not isinstance(value, str):
            return value
        try:
            rate = in_si(value, "rad/s", f"--frequency {value}")
        except QuantityError as error:
            self.fail(str(error), param, context)
        if rate <= 0.0:
            self.fail(f"{value!r} is not above zero", param, context)
        return rate * (2.0 * math.pi if value.rstrip().endswith("Hz") else 1.0)


_OSCILLATION = """
name = "oscillation"
[parameters]
omega = 1.0
[coordinates]
x = { start = 1.0 }
[energy]
kinetic = "dot(x)^2/2"
potential = "omega^2*x^2/2"
"""


def _of_oscillation(given: dict[str, Any], frequency: float, steps_per_period: int | None) -> Advice:
    """Return the advice for x'' = -omega^2 x, without what a user's model would take."""
    theirs = [
        key.removesuffix("_values") for key in ("set_values", "start_values", "rate_values", "input_values")
    ]
    foreign = [name for name in theirs if given[f"{name}_values"]]
    if foreign:
        raise click.UsageError(f"--{foreign[0]} is for a MODEL, and --frequency does without one")
    system = link.derive(toml_reader.read_text(_OSCILLATION))
    asked = replace(options_of(system, given), parameters={"omega": frequency})
    found = advise(system, asked, steps_per_period=steps_per_period, chosen=_chosen(given, asked))
    fixed_steps = tuple(replace(entry, cost=Cost(entry.cost.steps, 0.0)) for entry in found.fixed_steps)
    cost = Cost(found.cost.steps, 0.0)
    return replace(found, origin=None, evaluation=0.0, fixed_steps=fixed_steps, cost=cost)


def _chosen(given: dict[str, Any], asked: RunOptions) -> tuple[str, float | None] | None:
    if given["method"] not in (None, "auto"):
        return given["method"], asked.step
    return (asked.method, given["step"]) if given["step"] is not None else None


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
@click.option(
    "--frequency",
    type=Frequency(),
    help="Without MODEL: of an oscillation of so many rad/s, or of turns a second, such as '16 Hz'.",
)
@click.option("--json", "json_file", type=OutputFile(".json"), help="Write the advice to a file.")
@click.pass_context
def command(
    context: click.Context,
    model: str | None,
    options: tuple[tuple[str, str], ...],
    place: tuple[Path, float] | None,
    steps_per_period: int | None,
    frequency: float | None,
    json_file: Path | None,
    **given: Any,
) -> None:
    """Say which step and method suit MODEL, from its time scales at the start and along a short run.

    With --method, and --step where the method has one, that choice is checked: the exit status is 3 if not suited.
    """
    if frequency is not None:
        if model is not None or place is not None or options:
            raise click.UsageError("--frequency does without a MODEL: leave that, --at and --option out")
        advice = _of_oscillation(given, frequency, steps_per_period)
        _answer(context, advice, f"an oscillation of {frequency:.6g} rad/s", json_file)
    if model is None and place is None:
        raise click.UsageError("Missing argument 'MODEL', or --at RUN.rrd@TIME, or --frequency RATE")
    system = (
        load_system(find_model(model), as_dict(options, "--option"))[0]
        if model
        else _recorded_model(place[0])
    )
    if place is not None and given["t_end"] is None and "t_end" not in system.run_defaults:
        given["t_end"] = _length(place[0])
    endless = given["t_end"] is None and "t_end" not in system.run_defaults
    asked = options_of(system, {**given, "t_end": 1.0} if endless else given)
    if place is not None:
        asked = _begun_at(system, asked, *place)
    if model is not None:
        asked = with_control(find_model(model), system, asked)
    if endless:
        asked = replace(asked, t_end=length_to_see(system, asked))
    advice = advise(system, asked, steps_per_period=steps_per_period, chosen=_chosen(given, asked))
    times = f"from t = {advice.t_first:.4g} s " if advice.t_first else ""
    head = f"{system.name}: time scales at {advice.n_states} states {times}up to t = {advice.t_seen:.4g} s"
    if endless:
        head += f"; no end is given: ten periods of the slowest motion are {asked.t_end:.4g} s"
    _answer(context, advice, head, json_file)


def _answer(context: click.Context, advice: Advice, head: str, json_file: Path | None) -> NoReturn:
    if json_file is not None:
        write_text(json_file, to_json(advice.to_dict()) + "\n")
    say(head)
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
