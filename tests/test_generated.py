"""The bundled models' modules in generated/ are what the generator writes today, byte for byte."""

from __future__ import annotations

import difflib
from pathlib import Path

import pytest

from symgen.link import derive_file
from symgen.model.library import list_models

ROOT = Path(__file__).resolve().parents[1]
LARGEST_COMMITTED = 100_000  # bytes; a larger module is not read by people
SMALLER = {
    "n_four_bar": {"N": "4"},
    "chain_absolute": {"N": "6"},
}  # build options of models that are larger as they are
MODELS = {name: Path(path) for name, _, path in list_models()}


@pytest.mark.parametrize("name", sorted(MODELS))
def test_committed_module_is_current(name: str, request: pytest.FixtureRequest):
    text = derive_file(MODELS[name], SMALLER.get(name)).text
    golden = ROOT / "generated" / f"{name}.py"
    if request.config.getoption("--update-golden") and len(text) <= LARGEST_COMMITTED:
        golden.write_text(text, encoding="utf-8", newline="\n")
    if len(text) > LARGEST_COMMITTED:
        pytest.skip(f"{len(text)} bytes: too large to be committed")
    assert golden.exists(), f"{golden.name} is missing: run pytest tests/test_generated.py --update-golden"
    committed = golden.read_text(encoding="utf-8")
    if committed != text:
        changes = difflib.unified_diff(
            committed.splitlines(), text.splitlines(), "committed", "derived", lineterm="", n=1
        )
        shown = "\n".join(list(changes)[:60])
        pytest.fail(f"generated/{name}.py differs; accept with --update-golden if that is meant:\n{shown}")


def test_every_committed_module_has_a_model():
    assert {path.stem for path in (ROOT / "generated").glob("*.py")} <= set(MODELS)
