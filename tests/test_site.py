"""The site of docs/ builds without a warning and without network, and the notebook runs: the extra `docs`."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"


def test_every_page_is_in_the_menu_and_every_link_leads_somewhere():
    """What `mkdocs build --strict` finds, without it."""
    menu = set(
        re.findall(r": ([\w-]+\.md)$", (ROOT / "mkdocs.yml").read_text(encoding="utf-8"), re.MULTILINE)
    )
    assert menu == {path.name for path in DOCS.glob("*.md")}
    for path in DOCS.glob("*.md"):
        for target in re.findall(r"\]\(([^)#\s]+)(?:#[^)]*)?\)", path.read_text(encoding="utf-8")):
            assert target.startswith("https://") or (DOCS / target).is_file(), f"{path.name}: {target}"


@pytest.mark.slow
def test_the_site_builds_without_a_warning(tmp_path):
    """With a proxy that refuses everything in place of a network."""
    pytest.importorskip("mkdocs")
    pytest.importorskip("material")
    refused = dict.fromkeys(("http_proxy", "https_proxy", "HTTP_PROXY", "HTTPS_PROXY"), "http://127.0.0.1:9")
    done = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(tmp_path)], cwd=ROOT,
        env=os.environ | refused | {"NO_MKDOCS_2_WARNING": "1"}, capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "WARNING" not in done.stderr
    for name in ("index", "course", "gallery"):
        page = (tmp_path / f"{name}.html").read_text(encoding="utf-8")
        outside = re.findall(r'<(?:script|link|img)[^>]*(?:src|href)="(https?://[^"]*)"', page)
        assert outside == [], name  # nothing is fetched when it is read, either


@pytest.mark.slow
def test_the_notebook_runs():
    nbformat, nbclient = pytest.importorskip("nbformat"), pytest.importorskip("nbclient")
    pytest.importorskip("ipykernel")
    notebook = nbformat.read(DOCS / "notebook.ipynb", as_version=4)
    assert all(not cell.get("outputs") for cell in notebook.cells), "kept without outputs"
    nbclient.NotebookClient(notebook, timeout=600, kernel_name="python3").execute(cwd=str(DOCS))
    found = [output.get("data", {}) for cell in notebook.cells for output in cell.get("outputs", [])]
    assert sum("<svg" in data.get("text/html", "") for data in found) == 2  # drawings of both runs
    assert any("load" in data.get("text/latex", "") for data in found)  # M
