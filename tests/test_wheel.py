"""What the wheel holds: one package with the run time, and the bundled models, nothing else."""

import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
pytest.importorskip("setuptools", minversion="77")
FOLDERS = {
    "symgen": "symgen",
    "runtime": "symgen/runtime",
    "models": "symgen/bundled",
}


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    tree = tmp_path_factory.mktemp("tree")  # a build leaves files beside the sources
    for folder in FOLDERS:
        shutil.copytree(ROOT / folder, tree / folder, ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("pyproject.toml", "setup.py", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, tree)
    script = "from setuptools import build_meta; build_meta.build_wheel('dist')"
    subprocess.run([sys.executable, "-c", script], cwd=tree, check=True, capture_output=True)
    (path,) = (tree / "dist").glob("*.whl")
    with zipfile.ZipFile(path) as archive:
        return set(archive.namelist())


def test_one_package_is_installed(files):
    tops = {name.split("/")[0] for name in files}
    assert {top for top in tops if not top.endswith(".dist-info")} == {"symgen"}


def test_all_sources_and_models_are_inside_and_nothing_else(files):
    inside = {
        f"{place}/{path.relative_to(ROOT / folder).as_posix()}"
        for folder, place in FOLDERS.items()
        for path in (ROOT / folder).rglob("*")
        if path.suffix in (".toml", ".py", ".json", ".typed", ".xz", ".txt", ".urdf", ".xml")
        and "__pycache__" not in path.parts
    }
    assert len(inside) > 300
    assert {name for name in files if ".dist-info/" not in name} == inside
