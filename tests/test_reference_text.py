"""docs/api.md and docs/cli.md say what there is: every public name, option and exit status."""

from __future__ import annotations

import inspect
import re

import click
import pytest
import reference_text
from click.testing import CliRunner

import symgen
from symgen import runtime
from symgen.cli import main
from symgen.runtime import inputs, linear

PAGES = {"api.md": reference_text.api_page, "cli.md": reference_text.cli_page}


@pytest.mark.parametrize("name", PAGES)
def test_pages_are_made_of_what_there_is(name, request):
    path, made = reference_text.DOCS / name, PAGES[name]()
    if request.config.getoption("--update-golden"):
        path.write_text(made, encoding="utf-8")
    text = path.read_text(encoding="utf-8")
    assert made == text, f"docs/{name}: run pytest tests/test_reference_text.py --update-golden"


def test_every_public_name_is_there():
    page = (reference_text.DOCS / "api.md").read_text(encoding="utf-8")
    for module in (symgen, runtime, inputs, linear):
        for name in module.__all__:
            assert re.search(rf"`(symgen\.[\w.]*)?{name}`", page), f"{module.__name__}.{name}"
    for kind in (symgen.Model, runtime.System, runtime.Solution, runtime.Kernel, inputs.Controller):
        members = [name for name, _ in inspect.getmembers(kind) if not name.startswith("_")]
        described = set(reference_text.public_members(kind))
        data = set(getattr(kind, "__dataclass_fields__", ())) | {"asked", "keys", "folder"}
        assert set(members) - described - data == set(), kind


def test_every_option_of_every_command_has_a_row():
    page = (reference_text.DOCS / "cli.md").read_text(encoding="utf-8")
    context = click.Context(main)
    for name in main.list_commands(context):
        section = page.split(f"## symgen {name}\n")[1].split("\n## ")[0]
        for option in main.get_command(context, name).params:
            if isinstance(option, click.Option):
                assert all(f"{word}" in section for word in option.opts), (name, option.opts)
                assert option.help, f"symgen {name} {option.opts[0]} has no help"


def test_exit_statuses_are_those_that_commands_end_with(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    coarse = ["run", "pendulum", "--no-log", "--t-end", "1"]
    commands = {
        0: coarse,
        1: ["run", "nothing_of_this_name"],
        2: ["run"],
        3: [*coarse, "--method", "euler", "--step", "0.05"],
    }
    for status, arguments in commands.items():
        assert CliRunner().invoke(main, arguments).exit_code == status
        assert status in reference_text.EXIT_STATUSES
    assert {130, 143} <= set(reference_text.EXIT_STATUSES)  # tests/test_interrupts.py
