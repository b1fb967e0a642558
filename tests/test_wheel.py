"""What the wheel holds: the two packages and the bundled models, nothing else."""

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
    models = {f"symgen/bundled/{p.name}" for p in (ROOT / "models").iterdir() if p.is_file()}
    assert len(models) > 10
    assert {name for name in files if ".dist-info/" not in name} == sources | models
