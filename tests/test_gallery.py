"""docs/gallery.md: every bundled model, a small picture of each, and commands that do what they say."""

from __future__ import annotations

import shlex
import xml.etree.ElementTree as ET

import gallery
import pytest
from click.testing import CliRunner

from symgen.cli import main
from symgen.model.library import bundled

QUICK = ("pendulum_linear", "bricard", "bouncing_ball", "stiff_bushing_pendulum")


def test_every_bundled_model_is_there(request):
    assert set(gallery.entries()) == set(bundled())
    if request.config.getoption("--update-golden"):
        gallery.write(all_pictures=False)
    text = gallery.PAGE.read_text(encoding="utf-8")
    assert text == gallery.page(), "pytest tests/test_gallery.py --update-golden, or python -m tests.gallery"


def test_pictures_are_small_and_whole():
    files = {path.stem: path for path in gallery.PICTURES.glob("*")}
    assert set(files) == set(gallery.entries())
    for path in files.values():
        text = path.read_text(encoding="utf-8")
        assert len(text) <= gallery.LARGEST, path.name
        root = ET.fromstring(text)
        assert len(root) > 1 and "nan" not in text, path.name


def test_pictures_are_those_of_the_script():
    for name in ("pendulum", "slider_crank"):
        assert gallery.picture(name, 0.0) == (gallery.PICTURES / f"{name}.svg").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    "name",
    [pytest.param(n, marks=() if n in QUICK else pytest.mark.slow) for n in gallery.entries()],
)
def test_commands_run(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    command = gallery.entries()[name].command
    done = CliRunner().invoke(main, shlex.split(command))
    assert done.exit_code == (3 if "exit status 3" in gallery.entries()[name].notice else 0), done.output
    assert name in command and done.output
