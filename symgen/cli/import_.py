"""`symgen import`: a robot's file as a model file."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

import click

from symgen.cli.arguments import NameValue, as_dict
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
naming = Late("symgen.robots.naming")
pictures = Late("symgen.robots.pictures")
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
@click.option(
    "--meshes",
    type=click.Choice(["keep", "drop"]),
    help="Pictures of links with meshes: all of them, or an error; or none. By default those that can be had, "
    "and the others are named. They go into the folder MODEL_meshes beside the model file.",
)
@click.option(
    "--package-path",
    multiple=True,
    type=click.Path(exists=True, file_okay=False, path_type=Path),
    metavar="DIR",
    help="URDF: a package of meshes, or a folder of packages (may be repeated).",
)
@click.option("--motors/--no-motors", default=True, help="An input for the force of each joint's motor.")
@click.option(
    "--start",
    "starts",
    multiple=True,
    type=NameValue(),
    help="URDF: where a coordinate starts: a number (SI) or a quantity, such as elbow='40 deg' (may be repeated).",
)
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
    meshes: str | None,
    package_path: tuple[Path, ...],
    motors: bool,
    starts: tuple[tuple[str, str], ...],
    keyframe: str | None,
    within: Path | None,
    check: bool,
) -> None:
    """Write the robot of FILE (URDF or MJCF) as a model file, and say what was left out."""
    is_mjcf = xml_tree.read_xml(file).tag == "mujoco"
    if is_mjcf and (base != "fixed" or not motors or package_path or starts):
        raise click.UsageError(
            "--base, --no-motors, --start and --package-path are for URDF: an MJCF file says all of it itself"
        )
    if not is_mjcf and (keyframe or within):
        raise click.UsageError("--keyframe and --within are for MJCF")
    beside = output.parent if output else Path()
    with tempfile.TemporaryDirectory(prefix=".import-", dir=beside) as temporary:
        made = Path(temporary, f"{naming.identifier((output or file).stem)}_meshes")
        drawn = pictures.Pictures(None if meshes == "drop" else made, package_path, strict=meshes == "keep")
        if is_mjcf:
            imported = mjcf.import_mjcf(file, expose or None, keyframe, within, pictures=drawn)
        else:
            imported = build.import_urdf(
                file, base, expose or None, motors, pictures=drawn, start=as_dict(starts, "--start")
            )
        text = imported.model.to_toml()
        path = output or claim("the model", Path(f"{imported.model.name}.toml"))
        folder = beside / made.name
        for place in (path, folder) if made.exists() else (path,):
            if place.exists():
                raise click.UsageError(f"{place} is there already: name another file with -o")
        compared = _agreement(imported) if check else []
        if made.exists():
            made.rename(folder)
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
    say(f"wrote {path}" + (f", and meshes into {folder}" if folder.exists() else ""))


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
