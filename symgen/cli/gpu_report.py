"""`symgen gpu-report`: what a model's programs need of a graphics processor, without one."""

from __future__ import annotations

import click

from symgen.cli.arguments import as_dict, find_model, model_argument
from symgen.cli.failures import FAILED
from symgen.cli.files import CarefulCommand
from symgen.cli.settings import load_system
from symgen.cli.terminal import say
from symgen.runtime.ensemble.gpu.assembler import assembler_version
from symgen.runtime.ensemble.gpu.report import METHODS, ProgramReport, report_program, same_bits
from symgen.runtime.system import System


@click.command("gpu-report", cls=CarefulCommand)
@model_argument
@click.option(
    "--arch",
    "archs",
    multiple=True,
    help="Architecture of NVIDIA, such as sm_80 or sm_90 (default); may be repeated.",
)
@click.option(
    "--method",
    "methods",
    multiple=True,
    type=click.Choice(METHODS),
    help="Method of the ensemble; may be repeated (default: all that lanes have).",
)
@click.option(
    "--check",
    is_flag=True,
    help="Run each program for 100 steps here, too, and compare its bits with a lane's.",
)
@click.option("--quiet", is_flag=True, help="Print the table alone.")
@click.pass_context
def command(
    context: click.Context, model: str, options: tuple[tuple[str, str], ...], archs: tuple[str, ...],
    methods: tuple[str, ...], check: bool, quiet: bool,
) -> None:  # fmt: skip
    """Compile what a thread of `system.ensemble(device="cuda")` does for MODEL, and say what it needs.

    Registers and memory are for each thread, by the assembler of the extra gpu; no graphics processor is needed. The
    exit status is 1 when no program is left to run, or bits differ.
    """
    system, _ = load_system(find_model(model), as_dict(options, "--option"), quiet)
    version = assembler_version()
    found = [
        report_program(system, method, arch) for arch in archs or ("sm_90",) for method in methods or METHODS
    ]
    if not quiet:
        say(f"{system.name}: a thread a member, by NVIDIA's assembler {version}")
    for line in _table(found):
        say(line)
    for report in found:
        if report.refusal:
            say(f"  {report.method} on {report.arch} is not run: {report.refusal}")
    different = _compared(system, found) if check else False
    context.exit(FAILED if different or all(report.refusal for report in found) else 0)


def _table(found: list[ProgramReport]) -> list[str]:
    rows = [
        (
            "method",
            "arch",
            "arrays in",
            "operations",
            "registers",
            "spilled",
            "memory",
            "code",
            "LLVM",
            "assembler",
        )
    ]
    for report in found:
        program = report.program
        if program is None:
            continue
        made = program.assembled
        rows.append(
            (
                report.method, report.arch, "registers" if program.flat else "memory", str(program.operations),
                str(made.registers), f"{made.spill_stores} B", f"{made.stack} B", f"{made.size / 1000:.0f} kB",
                f"{program.seconds:.2f} s", f"{made.seconds:.2f} s",
            )
        )  # fmt: skip
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return [
        "  " + "  ".join(f"{text:<{width}}" for text, width in zip(row, widths, strict=True)).rstrip()
        for row in rows
    ]


def _compared(system: System, found: list[ProgramReport]) -> bool:
    """Say whether programs give the bits of lanes; returns whether one does not."""
    different = False
    for method, flat in dict.fromkeys((x.method, x.program.flat) for x in found if x.program is not None):
        same = same_bits(system, method, flat)
        different |= not same
        say(
            f"  {method}: {'the same bits as in a lane' if same else 'NOT the bits of a lane'}, run here for 100 steps"
        )
    return different
