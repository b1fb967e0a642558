"""`symgen import`: a robot's file as a model file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from symgen.cli.files import CarefulCommand, OutputFile, claim, write_text
from symgen.cli.terminal import say
from symgen.runtime.lazy import Late

if TYPE_CHECKING:
    from symgen.robots.build import Import
    from symgen.robots.mjcf import MjcfImport

link = Late("symgen.link")
agreement = Late("symgen.robots.agreement")
build = Late("symgen.robots.build")
mjcf = Late("symgen.robots.mjcf")
mjcf_agreement = Late("symgen.robots.mjcf_agreement")
xml_tree = Late("symgen.robots.xml_tree")

_MOST_NOTES = 12


@click.command("import", cls=CarefulCommand)
@click.argument("file", type=click.Path(path_type=Path))
@click.option(
    "-o", "--output", type=OutputFile(".toml"), help="The model file; FILE.toml in this folder by default."
)
@click.option(
    "--base",
    type=click.Choice(["fixed", "free"]),
    default="fixed",
    show_default=True,
    help="Whether the first link is fixed to the world or moves freely.",
)
@click.option(
    "--expose",
    multiple=True,
    metavar="PATTERN",
    help="Numbers that become parameters, such as 'wrist_*.mass' (may be repeated); all by default. "
    "The others are folded into the code.",
)
@click.option("--motors/--no-motors", default=True, help="An input for the force of each joint's motor.")
@click.option("--keyframe", metavar="NAME", help="MJCF: the keyframe where it starts.")
@click.option(
    "--within",
    type=click.Path(exists=True, file_okay=False, path_type=Path),
    help="MJCF: the folder in which all files lie that FILE names; its own by default.",
)
@click.option(
    "--check",
    is_flag=True,
    help="Compare the model at random states with Pinocchio (URDF, package pin) or MuJoCo (MJCF).",
)
def command(
    file: Path,
    output: Path | None,
    base: str,
    expose: tuple[str, ...],
    motors: bool,
    keyframe: str | None,
    within: Path | None,
    check: bool,
) -> None:
    """Write the robot of FILE (URDF or MJCF) as a model file, and say what was left out."""
    if xml_tree.read_xml(file).tag == "mujoco":
        if base != "fixed" or not motors:
            raise click.UsageError("--base and --no-motors are for URDF: an MJCF file says both itself")
        imported = mjcf.import_mjcf(file, expose or None, keyframe, within)
    elif keyframe or within:
        raise click.UsageError("--keyframe and --within are for MJCF")
    else:
        imported = build.import_urdf(file, base, expose or None, motors)
    text = imported.model.to_toml()
    path = output or claim("the model", Path(f"{imported.model.name}.toml"))
    if path.exists():
        raise click.UsageError(f"{path} is there already: name another file with -o")
    compared = _agreement(imported) if check else []
    write_text(path, text)
    description = imported.model.describe()
    say(
        f"{description.name}: {len(description.bodies)} bodies, {len(description.joints)} joints, "
        f"{len(description.coordinates)} coordinates, {len(description.parameters)} parameters"
    )
    for note in imported.notes[:_MOST_NOTES]:
        say(f"  {note}")
    if len(imported.notes) > _MOST_NOTES:
        say(f"  … and {len(imported.notes) - _MOST_NOTES} more of this kind")
    for line in compared:
        say(f"  {line}")
    say(f"wrote {path}")


def _agreement(imported: Import | MjcfImport) -> list[str]:
    """The lines of a comparison with the other program."""
    system = link.derive(imported.model)
    if isinstance(imported, build.Import):
        other, found = "Pinocchio", agreement.compare_with_pinocchio(system, imported)
    else:
        other, found = "MuJoCo", mjcf_agreement.compare_with_mujoco(system, imported)
    worst = {name: value for name, value in vars(found).items() if name != "states" and value == value}
    largest = max(worst, key=worst.get)
    return [
        f"against {other} at {found.states} random states, relative: "
        f"worst {largest.replace('_', ' ')} {worst[largest]:.1e}",
        *(f"  {name.replace('_', ' ')} {value:.1e}" for name, value in worst.items()),
    ]
