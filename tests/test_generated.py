"""Bundled models' modules in generated/ are what the generator writes today, to the byte; of larger ones a digest."""

from __future__ import annotations

import difflib
import hashlib
import json
from pathlib import Path

import pytest

from symgen.link import derive_file
from symgen.model.library import list_models

ROOT = Path(__file__).resolve().parents[1]
LARGEST_COMMITTED = 103_000  # bytes; a larger module is not read by people
DIGESTS = ROOT / "tests" / "reference" / "large_modules.json"  # SHA-256 of those
SMALLER = {
    "n_four_bar": {"N": "4"},
    "chain_absolute": {"N": "6"},
}  # build options of models that are larger as they are
MODELS = {name: Path(path) for name, _, path in list_models()}


@pytest.mark.parametrize("name", sorted(MODELS))
def test_committed_module_is_current(name: str, request: pytest.FixtureRequest):
    text = derive_file(MODELS[name], SMALLER.get(name)).text
    update = request.config.getoption("--update-golden")
    if len(text) > LARGEST_COMMITTED:
        hold_digest(name, text, update=update)
        return
    golden = ROOT / "generated" / f"{name}.py"
    if update:
        golden.write_text(text, encoding="utf-8", newline="\n")
    assert golden.exists(), f"{golden.name} is missing: run pytest tests/test_generated.py --update-golden"
    committed = golden.read_text(encoding="utf-8")
    if committed != text:
        changes = difflib.unified_diff(
            committed.splitlines(), text.splitlines(), "committed", "derived", lineterm="", n=1
        )
        shown = "\n".join(list(changes)[:60])
        pytest.fail(f"generated/{name}.py differs; accept with --update-golden if that is meant:\n{shown}")


def hold_digest(name: str, text: str, *, update: bool) -> None:
    digests = json.loads(DIGESTS.read_text(encoding="utf-8")) if DIGESTS.exists() else {}
    digest = hashlib.sha256(text.encode()).hexdigest()
    if update:
        digests[name] = digest
        written = json.dumps(digests, indent=0, sort_keys=True) + "\n"
        DIGESTS.write_text(written, encoding="utf-8", newline="\n")
    assert digests.get(name) == digest, (
        f"the module of {name}, too large to be committed, is another one; accept with --update-golden"
    )


def test_every_committed_module_has_a_model():
    committed = {path.stem for path in (ROOT / "generated").glob("*.py")}
    large = set(json.loads(DIGESTS.read_text(encoding="utf-8")))
    assert committed | large == set(MODELS)
    assert not committed & large
