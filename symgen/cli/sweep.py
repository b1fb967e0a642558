"""`symgen sweep`: a model many times, with values that vary; `--show`: what a file of members holds."""

from __future__ import annotations

import contextlib
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
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
from symgen.cli.control import with_control
from symgen.cli.failures import FAILED, NOT_TRUSTED, interrupted_status
from symgen.cli.files import CarefulCommand, MembersFile, OutputFile, write_text
from symgen.cli.progress import Progress
from symgen.cli.quantities import parameter_values, start_values
from symgen.cli.settings import input_tables, load_system
from symgen.cli.terminal import say
from symgen.runtime.ensemble.noises import is_noise
from symgen.runtime.ensemble.options import DESIGNS, EnsembleOptions
from symgen.runtime.ensemble.reduction import Reduction
from symgen.runtime.ensemble.result import Ensemble
from symgen.runtime.ensemble.run import Collector, plan_for
from symgen.runtime.ensemble.sampling import read_variation
from symgen.runtime.ensemble.store import Stored, open_members, read_ensemble, write_ensemble
from symgen.runtime.ensemble.zarr_store import ZarrStore
from symgen.runtime.errors import RuntimeModelError, nearest
from symgen.runtime.lazy import Late
from symgen.runtime.names import inside_dot
from symgen.runtime.options import RunOptions
from symgen.runtime.system import System
from symgen.runtime.tables import need

ensemble_page = Late("symgen.runtime.report.ensemble_page")

_STORE_EVERY, _PATIENCE = 30.0, 10.0  # seconds
_MOST_NAMES = 12


@click.command("sweep", cls=CarefulCommand)
@model_argument
@click.option(
    "--vary",
    multiple=True,
    type=NameValue(),
    help="What varies: NAME=low:high:number, 'NAME=grid(a, b)', 'NAME=normal(mean, deviation)', uniform, lognormal, "
    "triangular, choice; NAME is a parameter, a coordinate or a rate 'dot(x)'. 'INPUT=noise(deviation, period)' is "
    "another noise for each member. May be repeated: grids multiply.",
)
@click.option("-n", "n", type=click.IntRange(min=1), help="Members to draw for each point of the grids.")
@click.option("--seed", type=click.IntRange(min=0), default=0, help="Of what is drawn (default 0).")
@click.option(
    "--design",
    type=click.Choice(DESIGNS),
    default="random",
    help="How draws fill their space: each by itself (default), evenly (sobol), or such that indices of sensitivity "
    "follow (saltelli).",
)
@click.option("--t-end", type=Duration(), help="Time at which the runs end [s].")
@click.option("--method", help="Integration method, or auto (default).")
@click.option("--rtol", type=Positive(), help="Relative tolerance (default 1e-8).")
@click.option("--atol", type=Positive(or_zero=True), help="Absolute tolerance (default 1e-10).")
@click.option("--step", type=Duration(), help="Step of a fixed-step method [s].")
@click.option(
    "--input",
    "input_values",
    multiple=True,
    metavar="[NAME=]FILE",
    help="An input over time that all members have [SI]: a file with columns of times and values.",
)
@value_options
@click.option(
    "--keep",
    default="end",
    help="What to keep of each member: end (all coordinates and rates at the end, default), names with commas, or "
    "none.",
)
@click.option(
    "--frames", type=click.IntRange(min=2), help="Keep series at so many times instead of the end alone."
)
@click.option(
    "--out",
    "out_file",
    type=MembersFile(),
    help="Write the members to a file of NumPy (.npz), or to a Zarr store (.zarr) that grows as they come in.",
)
@click.option("--resume", is_flag=True, help="Go on with what --out holds already.")
@click.option(
    "--device",
    type=click.Choice(["cpu", "cuda"]),
    help="Where members run: this machine's processors (default), or a graphics processor of NVIDIA.",
)
@click.option("--threads", type=click.IntRange(min=1), help="Threads to work in (default: all processors).")
@click.option("--dask", "dask_address", help="Work on a Dask cluster: the address of its scheduler, tcp://…")
@click.option("--max-steps", type=click.IntRange(min=1), help="A member fails after so many steps.")
@click.option(
    "--html", "html_file", type=OutputFile(".html"), help="Write a page: distributions, failures, members."
)
@click.option(
    "--record",
    "record_file",
    type=OutputFile(".rrd"),
    help="Record some members over each other, for `symgen play`.",
)
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
    dask_address: str | None,
    html_file: Path | None,
    record_file: Path | None,
    show: bool,
    quiet: bool,
    **given: Any,
) -> None:
    """Run MODEL many times, with values that vary, and keep what is asked for of each member.

    The exit status is 1 when all members fail, 3 when some fail or a check says that their result is not to be
    trusted. Ctrl-C keeps what is done in the file of --out, and --resume goes on from there.
    """
    if show:
        stored = open_members(model)
        for line in shown(stored):
            say(line)
        if html_file is not None:
            write_text(html_file, ensemble_page.ensemble_page(stored))
        return
    if resume and out_file is None:
        raise click.UsageError("--resume goes on with the file of --out: name it")
    if html_file is not None and out_file is None:
        raise click.UsageError("--html makes a page of what --out holds: name it")
    if not vary:
        raise click.UsageError("--vary says what differs between members: give it at least once")
    path = find_model(model)
    system, _ = load_system(path, as_dict(options, "--option"), quiet, on_demand=True)
    to_store = out_file is not None and out_file.suffix.lower() == ".zarr"
    places = {"out": out_file, "resume": resume} if to_store else {}
    asked = _options(path, system, vary, keep, {**given, **places})
    with _cluster(dask_address) as executor:
        goes_on = resume and not to_store and out_file.exists()
        stored = read_ensemble(out_file) if goes_on else None
        collected = Collector(plan_for(system, replace(asked, executor=executor), stored))
        if stored is not None:
            collected.go_on_from(stored)
        npz = None if to_store else out_file
        progress = None if quiet else Progress(sys.stderr.isatty())
        e, interrupted = _collect(collected, npz, progress)
    if npz is not None:
        write_ensemble(e, npz)
    if not quiet:
        for line in _report(e, out_file):
            say(line)
    if html_file is not None:
        write_text(html_file, ensemble_page.ensemble_page(open_members(out_file)))
    if interrupted:
        context.exit(interrupted_status())
    if e.n_failed == e.n_done:
        context.exit(FAILED)
    if record_file is not None:
        e.record(record_file)
    context.exit(0 if e.health.ok else NOT_TRUSTED)


@contextlib.contextmanager
def _cluster(address: str | None) -> Iterator[Any]:
    """The client of a Dask cluster; None where none is asked for."""
    if address is None:
        yield None
        return
    need("distributed", "dask", "--dask")
    from distributed import Client

    try:
        client = Client(address, timeout=_PATIENCE)
    except (OSError, ValueError, TimeoutError) as error:
        raise RuntimeModelError(
            f"--dask {address}: no scheduler answers there ({str(error) or type(error).__name__}): start one with "
            "`dask scheduler`, workers with `dask worker`"
        ) from None
    with client:
        yield client


def _options(
    path: Path, system: System, vary: tuple[tuple[str, str], ...], keep: str, given: dict[str, Any]
) -> EnsembleOptions:
    parameters: dict[str, Any] = dict(parameter_values(system, given.pop("set_values")))
    start: dict[str, Any] = dict(start_values(system, "--start", given.pop("start_values")))
    rate: dict[str, Any] = dict(start_values(system, "--rate", given.pop("rate_values")))
    inputs: dict[Any, Any] = dict(input_tables(system, given.pop("input_values"), "linear", parameters))
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
        if is_noise(values):
            if name in (*inputs, *parameters):
                raise click.UsageError(f"--vary {name}: it is given as well; leave one of the two out")
            inputs[name] = values
            continue
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
    nominal = system.parameter_values()
    single = {
        name: value if isinstance(value, (int, float)) else float(nominal[system.place_of_parameter(name)])
        for name, value in parameters.items()
    }
    said = RunOptions(inputs=inputs, parameters=single)
    return EnsembleOptions(
        **{**defaults, **known_settings}, parameters=parameters, start=start, rate=rate,
        inputs=with_control(path, system, said).inputs, keep=None if keep == "none" else kept,
    )  # fmt: skip


def _collect(collected: Collector, out_file: Path | None, progress: Progress | None) -> tuple[Ensemble, bool]:
    """Run what is left; returns the ensemble, and whether it was interrupted."""
    interrupted, stored = False, time.monotonic()
    if progress is not None:
        store = collected.store
        progress.begin_at(collected.n_done if store is None else store.n_done())
    try:
        for chunk in collected.run():
            collected.take(chunk)
            if progress is not None:
                progress.show(collected.n_done, collected.plan.members.n, collected.n_failed)
            if out_file is not None and time.monotonic() - stored > _STORE_EVERY:
                write_ensemble(collected.result(), out_file)
                stored = time.monotonic()
    except KeyboardInterrupt:
        interrupted = True
    if progress is not None:
        progress.clear()
    return collected.result(), interrupted


def _report(e: Ensemble, out_file: Path | None) -> list[str]:
    where = ", in lanes" if e.plan.settings is not None else ""
    lines = [f"{e.plan.system.name}: {e.n_done} of {e.n} members by {e.method}{where}"]
    if len(e.shape) > 1:
        lines.append("  members  " + " x ".join(f"{count} {name}" for name, count in e.shape.items()))
    lines += [f"  note     {note}" for note in e.notes]
    lines += [f"  {'health' if k == 0 else '':<8} {line}" for k, line in enumerate(e.health.lines())]
    lines += [f"           member {k}: {said}" for k, said in list(e.messages.items())[:3]]
    sizes = [(name, _Moments()) for name in e.names]
    for name, moments in sizes if e.store is None else ():
        moments.take(e[name][: e.n_done])
    if e.store is not None:
        for _, piece in e.store.pieces(e.names):
            for name, moments in sizes:
                moments.take(piece[name])
    lines += _statistics(sizes)
    return [*lines, f"  written  {out_file}"] if out_file is not None else lines


class _Moments(Reduction):
    """Mean, deviation and range at the end, whatever the number of members."""

    def __init__(self) -> None:
        super().__init__("", ["mean", "std", "min", "max"])

    def take(self, values: np.ndarray) -> None:
        super().take((values if values.ndim == 1 else values[:, -1]).astype(float))


def _statistics(sizes: list[tuple[str, _Moments]]) -> list[str]:
    """A line for each quantity."""
    width = max((len(name) for name, _ in sizes[:_MOST_NAMES]), default=0)
    lines = []
    for name, moments in sizes[:_MOST_NAMES]:
        known = moments.result()
        if np.isfinite(known["min"]):
            lines.append(
                f"  {name:<{width}}  mean {known['mean']:.6g}, deviation {known['std']:.3g}, from {known['min']:.6g} "
                f"to {known['max']:.6g}"
            )
    return [*lines, f"  … and {len(sizes) - _MOST_NAMES} more"] if len(sizes) > _MOST_NAMES else lines


def shown(stored: Stored | ZarrStore) -> list[str]:
    """Return what a file or store of members holds, in lines."""
    about, n_ok, n_failed, n_doubtful = stored.about, 0, 0, 0
    sizes = [(name, _Moments()) for name in dict.fromkeys((*about["varied"], *about["series"]))]
    for _, piece in stored.pieces([*(name for name, _ in sizes), "status", "ok"]):
        failed, ok = piece["status"] != 1, piece["ok"]
        n_ok, n_failed = n_ok + int(ok.sum()), n_failed + int(failed.sum())
        n_doubtful += int((~ok & ~failed).sum())
        for name, moments in sizes:
            moments.take(piece[name])
    how = f"by {about['method']}, to t = {about['t_end']:g} s at rtol {about['rtol']:g}"
    lines = [
        f"{about['model']}: {stored.n_done()} of {about['n']} members {how}",
        f"  varied   {', '.join(about['varied'])}",
        f"  health   {n_ok} ok, {n_failed} failed, {n_doubtful} doubtful",
    ]
    return lines + _statistics(sizes)
