"""`symgen modes`: equilibrium, linearisation, eigenfrequencies, mode shapes, frequency response.

The figure of `symgen modes`: gain and phase over frequency.
"""

from __future__ import annotations

import importlib.util
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from symgen.cli.arguments import Positive, as_dict, find_model, model_argument, value_options
from symgen.cli.files import CarefulCommand, OutputFile, write_text
from symgen.cli.quantities import parameter_values, start_values
from symgen.cli.recorded_state import place_in_run, recorded_state
from symgen.cli.settings import load_system
from symgen.cli.terminal import say
from symgen.runtime.linear import linearise
from symgen.runtime.linear.animation import SECONDS, record_mode
from symgen.runtime.linear.frequency import around_modes, spaced
from symgen.runtime.names import motion_records
from symgen.runtime.result_json import to_json

if TYPE_CHECKING:
    from symgen.runtime.linear.frequency import FrequencyResponse
    from symgen.runtime.linear.model import LinearModel
    from symgen.runtime.linear.modes import Modes
    from symgen.runtime.system import System


class Frequencies(click.ParamType):
    """`F1,F2,…`, converted to a tuple of numbers [Hz]."""

    name = "F1,F2,…"

    def convert(self, value: Any, param: Any, context: click.Context | None) -> tuple[float, ...]:
        if isinstance(value, tuple):
            return value
        try:
            numbers = tuple(float(part) for part in value.split(",") if part.strip())
        except ValueError:
            numbers = ()
        if not numbers or not all(math.isfinite(x) and x >= 0.0 for x in numbers):
            self.fail(f"{value!r} is not a list of frequencies in Hz, such as 0.1,100", param, context)
        return numbers


@click.command("modes", cls=CarefulCommand)
@model_argument
@value_options
@click.option(
    "--at",
    "place",
    default="equilibrium",
    metavar="WHERE",
    help="equilibrium (default), which is looked for from the start; start; or RUN.rrd@TIME, a state of a recording.",
)
@click.option("--stable", is_flag=True, help="Go downhill to a stable equilibrium, not to the nearest one.")
@click.option("--from", "source", metavar="INPUT", help="Frequency response: from this input.")
@click.option("--to", "target", metavar="OUTPUT", help="To this coordinate, dot(coordinate) or output.")
@click.option(
    "--frequencies",
    type=Frequencies(),
    help="First and last frequency [Hz], or a list; around the modes otherwise.",
)
@click.option("--png", "png_file", type=OutputFile(".png"), help="Write the frequency response as a figure.")
@click.option("--log", "log_file", type=OutputFile(".rrd"), help="Write a mode as a recording that repeats.")
@click.option(
    "--mode", "number", type=click.IntRange(min=1), default=1, help="Which mode --log shows (default 1)."
)
@click.option(
    "--amplitude", type=Positive(), help="Of the largest component in the recording, in its SI unit."
)
@click.option(
    "--json", "json_file", type=OutputFile(".json"), help="Write A, B, C, D with their names, and the modes."
)
def command(
    model: str,
    options: tuple[tuple[str, str], ...],
    place: str,
    stable: bool,
    source: str | None,
    target: str | None,
    frequencies: tuple[float, ...] | None,
    png_file: Path | None,
    log_file: Path | None,
    number: int,
    amplitude: float | None,
    json_file: Path | None,
    **given: Any,
) -> None:
    """Linearise MODEL: where it rests, how it swings, whether it is stable, how it answers to an input."""
    if (source is None) != (target is None):
        raise click.UsageError("a frequency response needs --from INPUT and --to OUTPUT")
    if source is None and (png_file or frequencies):
        raise click.UsageError(
            f"{'--png' if png_file else '--frequencies'} needs --from INPUT and --to OUTPUT"
        )
    path = find_model(model)
    system, module = load_system(path, as_dict(options, "--option"))
    linear = _linear(system, given, place, stable, target)
    modes = linear.modes()
    response = _response(linear, source, target, frequencies) if source is not None else None
    for line in _report(linear, modes, response):
        say(line)
    if json_file is not None:
        record = {**linear.to_dict(), **modes.to_dict()}
        if response is not None:
            record["frequency_response"] = response.to_dict()
        write_text(json_file, to_json(record) + "\n")
    if png_file is not None:
        _plot(system.name, response, png_file)
    if log_file is not None:
        _record(linear, modes, number, amplitude, log_file, path, module.text)


def _linear(
    system: System, given: dict[str, Any], place: str, stable: bool, target: str | None
) -> LinearModel:
    values = parameter_values(system, given["set_values"])
    settings: dict[str, Any] = {
        "parameters": values,
        "start": start_values(system, "--start", given["start_values"]),
        "rate": start_values(system, "--rate", given["rate_values"]),
        "at": place,
    }
    if place not in ("equilibrium", "start"):
        settings |= _recorded(system, place, values)
    if target is not None:
        shown = (record for _, record in motion_records(system.coordinates, system.integrals))
        own = [record["name"] for record in (*shown, *system.outputs)]
        settings["outputs"] = [*own, *([] if target in own else [target])]
    return linearise(system, stable=stable, **settings)


def _recorded(system: System, place: str, values: dict[str, float]) -> dict[str, Any]:
    """Return the state, time, and parameters of the frame that `RUN.rrd@TIME` names."""
    named = place_in_run(place)
    if named is None:
        raise click.UsageError(
            f"--at: {place!r} is none of equilibrium, start and RUN.rrd@TIME, such as run.rrd@2.5"
        )
    frame = recorded_state(system, *named)
    return {"at": (frame.q, frame.v), "t": frame.t, "parameters": {**frame.parameters, **values}}


def _response(
    linear: LinearModel, source: str, target: str, frequencies: tuple[float, ...] | None
) -> FrequencyResponse:
    if frequencies is None:
        wanted = around_modes(linear)
    elif len(frequencies) == 2 and 0.0 < frequencies[0] < frequencies[1]:
        wanted = spaced(*frequencies)
    else:
        wanted = frequencies
    return linear.frequency_response(source, target, wanted)


def _report(linear: LinearModel, modes: Modes, response: FrequencyResponse | None) -> list[str]:
    system = linear.system
    lines = [f"{system.name}: {linear.kind}" + (f" at t = {linear.t:g} s" if linear.t else "")]
    shown = motion_records(system.coordinates, system.integrals)
    lines += _listed("coordinates", [c["name"] for _, c in shown], [linear.q[i] for i, _ in shown])
    if linear.v.any():
        lines += _listed("rates", [r["name"] for r in system.rates], linear.v)
    if system.m:
        lines += _listed("multipliers", [c["name"] for c in system.constraints], linear.multipliers)
    lines += [f"  note: {note}" for note in linear.notes]
    lines += ["", f"{modes.says}.", "", *modes.table(), "", *modes.shape_table()]
    if response is not None:
        lines += ["", f"frequency response from {response.input} to {response.output}", *response.table()]
        if modes.stable is False:
            lines.append("  of an unstable system: a motion shows it only while a controller holds it there")
    return lines


def _listed(what: str, names: list[str], values: Any) -> list[str]:
    parts = [f"{name} = {round(value, 14) + 0.0:.9g}" for name, value in zip(names, values)]
    return [f"  {what}: {', '.join(parts[:12])}{', …' * (len(parts) > 12)}"]


def _plot(name: str, response: FrequencyResponse | None, path: Path) -> None:
    if importlib.util.find_spec("matplotlib") is None:
        raise click.UsageError("--png needs matplotlib: pip install 'symgen[figures]'")
    write_plot(name, response, path)
    say(f"figure: {path}")


def _record(
    linear: LinearModel, modes: Modes, number: int, amplitude: float | None, log: Path, path: Path, text: str
) -> None:
    if number > len(modes):
        raise click.UsageError(f"--mode: model {linear.system.name!r} has {len(modes)} modes")
    mode = modes[number - 1]
    record_mode(
        linear,
        mode,
        log,
        module_text=text,
        model_text=path.read_text(encoding="utf-8"),
        mesh_folder=path.parent,
        amplitude=amplitude,
    )
    stretched = f", {mode.frequency * SECONDS:.4g} times as slow as it is" if mode.frequency else ""
    say(f"recorded mode {number}: one swing in {SECONDS:g} s{stretched}: {log}")


def write_plot(model: str, response: FrequencyResponse, path: Path) -> None:
    """Write gain and phase as PNG."""
    from matplotlib.figure import Figure  # slow to load

    figure = Figure(figsize=(7, 6), layout="constrained")
    gain, phase = figure.subplots(2, 1, sharex=True)
    gain.loglog(response.frequencies, response.gain)
    gain.set_ylabel(f"|{response.output} / {response.input}|  [SI]")
    phase.semilogx(response.frequencies, response.phase)
    phase.set_ylabel("phase [deg]")
    phase.set_xlabel("frequency [Hz]")
    for axes in (gain, phase):
        axes.grid(alpha=0.3, which="both")
    figure.suptitle(f"{model}: from {response.input} to {response.output}")
    figure.savefig(path, dpi=120)
