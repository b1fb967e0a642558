"""What the wheel holds: the two packages, the bundled models and the peers of the benchmark, nothing else."""

import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
wheel = pytest.importorskip("hatchling.builders.wheel")


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("wheel")
    (path,) = wheel.WheelBuilder(str(ROOT)).build(directory=str(folder), versions=["standard"])
    with zipfile.ZipFile(path) as archive:
        return set(archive.namelist())


def test_only_the_two_packages_are_installed(files):
    tops = {name.split("/")[0] for name in files}
    assert {top for top in tops if not top.endswith(".dist-info")} == {"symgen", "runtime"}


def test_all_sources_and_models_are_inside_and_nothing_else(files):
    sources = {
        path.relative_to(ROOT).as_posix()
        for top in ("symgen", "runtime")
        for path in (ROOT / top).rglob("*.py")
    }
    data = {f"symgen/bundled/{name}" for name in inside("models")}
    assert len(data) > 20
    data |= {f"symgen/peers/{name}" for name in inside("benchmarks/peers")}
    assert {name for name in files if ".dist-info/" not in name} == sources | data


def inside(folder: str) -> set[str]:
    """The model, reference and script files of a folder, by their paths in it."""
    found = (path for path in (ROOT / folder).rglob("*") if path.suffix in (".toml", ".py", ".json"))
    return {path.relative_to(ROOT / folder).as_posix() for path in found}
