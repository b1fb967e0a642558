"""`symgen sweep`: a model many times, with values that vary; `--show`: what a file of members holds."""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import Any

import click
import numpy as np

from symgen.cli.arguments import (
    Duration,
    NameValue,
    Positive,
    as_dict,
    find_model,
    model_argument,
    value_options,
)
from symgen.cli.failures import FAILED, NOT_TRUSTED, interrupted_status
from symgen.cli.files import CarefulCommand, OutputFile
from symgen.cli.quantities import parameter_values, start_values
from symgen.cli.settings import load_system
from symgen.cli.terminal import say
from symgen.runtime.ensemble.options import EnsembleOptions
from symgen.runtime.ensemble.plan import Plan, make_plan
from symgen.runtime.ensemble.result import Ensemble
from symgen.runtime.ensemble.run import Collector
from symgen.runtime.ensemble.sampling import read_variation
from symgen.runtime.ensemble.store import Stored, read_ensemble, write_ensemble
from symgen.runtime.errors import RuntimeModelError, nearest
from symgen.runtime.names import inside_dot
from symgen.runtime.system import System

_EVERY, _PLAIN_EVERY, _STORE_EVERY = 0.2, 5.0, 30.0  # seconds
_MOST_NAMES = 12


@click.command("sweep", cls=CarefulCommand)
@model_argument
@click.option(
    "--vary",
    multiple=True,
    type=NameValue(),
    help="What varies: NAME=low:high:number, 'NAME=grid(a, b)', 'NAME=normal(mean, deviation)', uniform, lognormal, "
    "triangular, choice; NAME is a parameter, a coordinate or a rate 'dot(x)'. May be repeated: grids multiply.",
)
@click.option("-n", "n", type=click.IntRange(min=1), help="Members to draw for each point of the grids.")
@click.option("--seed", type=click.IntRange(min=0), default=0, help="Of what is drawn (default 0).")
@click.option("--t-end", type=Duration(), help="Time at which the runs end [s].")
@click.option("--method", help="Integration method, or auto (default).")
@click.option("--rtol", type=Positive(), help="Relative tolerance (default 1e-8).")
@click.option("--atol", type=Positive(or_zero=True), help="Absolute tolerance (default 1e-10).")
@click.option("--step", type=Duration(), help="Step of a fixed-step method [s].")
@value_options
@click.option(
    "--keep",
    default="end",
    help="What to keep of each member: end (all coordinates and rates at the end, default), or names with commas.",
)
@click.option(
    "--frames", type=click.IntRange(min=2), help="Keep series at so many times instead of the end alone."
)
@click.option(
    "--out", "out_file", type=OutputFile(".npz"), help="Write the members to a file of NumPy (.npz)."
)
@click.option("--resume", is_flag=True, help="Go on with what --out holds already.")
@click.option(
    "--device",
    type=click.Choice(["cpu", "cuda"]),
    help="Where members run: this machine's processors (default), or a graphics processor of NVIDIA.",
)
@click.option("--threads", type=click.IntRange(min=1), help="Threads to work in (default: all processors).")
@click.option("--max-steps", type=click.IntRange(min=1), help="A member fails after so many steps.")
@click.option("--show", is_flag=True, help="Say what the file of members holds that MODEL names.")
@click.option("--quiet", is_flag=True, help="Print nothing but errors.")
@click.pass_context
def command(
    context: click.Context,
    model: str,
    options: tuple[tuple[str, str], ...],
    vary: tuple[tuple[str, str], ...],
    keep: str,
    out_file: Path | None,
    resume: bool,
    show: bool,
    quiet: bool,
    **given: Any,
) -> None:
    """Run MODEL many times, with values that vary, and keep what is asked for of each member.

    The exit status is 1 when all members fail, 3 when some fail or a check says that their result is not to be
    trusted. Ctrl-C keeps what is done in the file of --out, and --resume goes on from there.
    """
    if show:
        for line in _shown(read_ensemble(model)):
            say(line)
        return
    if resume and out_file is None:
        raise click.UsageError("--resume goes on with the file of --out: name it")
    if not vary:
        raise click.UsageError("--vary says what differs between members: give it at least once")
    system, _ = load_system(find_model(model), as_dict(options, "--option"), quiet, on_demand=True)
    plan = make_plan(system, _options(system, vary, keep, given))
    collected = Collector(plan)
    if resume and out_file.exists():
        collected.go_on_from(read_ensemble(out_file))
    e, interrupted = _collect(plan, collected, out_file, None if quiet else _Progress(sys.stderr.isatty()))
    if out_file is not None:
        write_ensemble(e, out_file)
    if not quiet:
        for line in _report(e, out_file):
            say(line)
    if interrupted:
        context.exit(interrupted_status())
    if e.n_failed == e.n_done:
        context.exit(FAILED)
    context.exit(0 if e.health.ok else NOT_TRUSTED)


def _options(
    system: System, vary: tuple[tuple[str, str], ...], keep: str, given: dict[str, Any]
) -> EnsembleOptions:
    parameters: dict[str, Any] = dict(parameter_values(system, given.pop("set_values")))
    start: dict[str, Any] = dict(start_values(system, "--start", given.pop("start_values")))
    rate: dict[str, Any] = dict(start_values(system, "--rate", given.pop("rate_values")))
    of_parameters = [record["name"] for record in (*system.parameters, *system.inputs)]
    of_start = [record["name"] for record in system.coordinates]
    for name, text in as_dict(vary, "--vary").items():
        try:
            values = read_variation(text)
        except RuntimeModelError as error:
            raise click.UsageError(f"--vary {name}: {error}") from None
        if isinstance(values, str):
            raise click.UsageError(
                f"--vary {name}: {text!r} is one value, which --set, --start or --rate give to all members; a grid is "
                "low:high:number, a draw such as normal(1, 0.1)"
            )
        place = parameters if name in of_parameters else start if name in of_start else rate
        if place is rate and inside_dot(name) == name and name not in {r["name"] for r in system.rates}:
            known = [*of_parameters, *of_start, *(f"dot({x})" for x in of_start)]
            raise click.UsageError(
                f"--vary: model {system.name!r} has no parameter, coordinate or rate {name!r}: {nearest(name, known)}"
            )
        inner = inside_dot(name) if place is rate else name
        if inner in place:
            raise click.UsageError(f"--vary {name}: it is set as well; leave one of the two out")
        place[inner] = values
    known_settings = {key: value for key, value in given.items() if value is not None}
    defaults = {key: system.run_defaults[key] for key in ("rtol", "atol") if key in system.run_defaults}
    kept: Any = "end" if keep == "end" else [name.strip() for name in keep.split(",") if name.strip()]
    return EnsembleOptions(
        **{**defaults, **known_settings}, parameters=parameters, start=start, rate=rate, keep=kept
    )


def _collect(
    plan: Plan, collected: Collector, out_file: Path | None, progress: _Progress | None
) -> tuple[Ensemble, bool]:
    """Run what is left; returns the ensemble, and whether it was interrupted."""
    interrupted, stored = False, time.monotonic()
    if progress is not None:
        progress.begin(collected.n_done)
    try:
        for chunk in collected.run():
            collected.take(chunk)
            if progress is not None:
                progress.show(collected.n_done, plan.members.n, collected.n_failed)
            if out_file is not None and time.monotonic() - stored > _STORE_EVERY:
                write_ensemble(collected.result(), out_file)
                stored = time.monotonic()
    except KeyboardInterrupt:
        interrupted = True
    if progress is not None:
        progress.clear()
    return collected.result(), interrupted


class _Progress:
    """One line: members done, how fast, time left, failures."""

    def __init__(self, in_place: bool) -> None:
        self._in_place, self._every = in_place, _EVERY if in_place else _PLAIN_EVERY
        self._began = self._shown = time.monotonic()
        self._first, self._any = 0, False

    def begin(self, done: int) -> None:
        self._first = done

    def show(self, done: int, n: int, failed: int) -> None:
        now = time.monotonic()
        if now - self._shown < self._every:
            return
        self._shown, self._any = now, self._in_place
        speed = (done - self._first) / (now - self._began)
        left = (n - done) / speed if speed > 0.0 else float("inf")
        text = f"{done} of {n} members, {speed:.3g} a second, {left:.3g} s left, {failed} failed"
        if self._in_place:
            click.echo(f"\r{text}\x1b[K", err=True, nl=False)
            return
        click.echo(text, err=True)
        self._every *= 2.0

    def clear(self) -> None:
        if self._any:
            click.echo("\r\x1b[K", err=True, nl=False)


def _report(e: Ensemble, out_file: Path | None) -> list[str]:
    lines = [f"{e.plan.system.name}: {e.n_done} of {e.n} members by {e.method}"]
    if len(e.shape) > 1:
        lines.append("  members  " + " x ".join(f"{count} {name}" for name, count in e.shape.items()))
    lines += [f"  note     {note}" for note in e.notes]
    lines += [f"  {'health' if k == 0 else '':<8} {line}" for k, line in enumerate(e.health.lines())]
    lines += [f"           member {k}: {said}" for k, said in list(e.messages.items())[:3]]
    ends = {name: e[name] if e[name].ndim == 1 else e[name][:, -1] for name in e.names}
    lines += _statistics({name: values[: e.n_done] for name, values in ends.items()})
    return [*lines, f"  written  {out_file}"] if out_file is not None else lines


def _statistics(ends: dict[str, np.ndarray]) -> list[str]:
    """Mean, deviation and range at the end, a line for each quantity."""
    names = list(ends)[:_MOST_NAMES]
    width = max((len(name) for name in names), default=0)
    lines = []
    for name in names:
        known = ends[name][np.isfinite(ends[name])]
        if len(known):
            deviation = known.std(ddof=1) if len(known) > 1 else 0.0
            lines.append(
                f"  {name:<{width}}  mean {known.mean():.6g}, deviation {deviation:.3g}, from {known.min():.6g} to "
                f"{known.max():.6g}"
            )
    return [*lines, f"  … and {len(ends) - len(names)} more"] if len(ends) > len(names) else lines


def _shown(stored: Stored) -> list[str]:
    about, arrays = stored.about, stored.arrays
    done = about["n_done"]
    failed, ok = arrays["status"][:done] != 1, arrays["ok"][:done]
    lines = [
        f"{about['model']}: {done} of {about['n']} members by {about['method']}, to t = {about['t_end']:g} s at rtol "
        f"{about['rtol']:g}",
        f"  varied   {', '.join(about['varied'])}",
        f"  health   {int(ok.sum())} ok, {int(failed.sum())} failed, {int((~ok & ~failed).sum())} doubtful",
    ]
    ends = {name: arrays[name][:done] for name in (*about["varied"], *about["series"])}
    return lines + _statistics({k: x if x.ndim == 1 else x[:, -1] for k, x in ends.items()})
