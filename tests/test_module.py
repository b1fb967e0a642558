"""Generated modules are read as data: what is accepted, what is refused, and that nothing in them runs."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

from symgen.runtime.errors import ModuleError
from symgen.runtime.module import read_module

FIXTURES = Path(__file__).parent / "fixtures"
NAMES = ["pendulum", "double_pendulum", "cartesian_pendulum", "oscillator", "redundant_pendulum"]


def text_of(name: str) -> str:
    return (FIXTURES / f"{name}.py").read_text()


@pytest.mark.parametrize("name", NAMES)
def test_reads_what_python_would_import(name):
    text = text_of(name)
    source = read_module(FIXTURES / f"{name}.py")
    tree = ast.parse(text)
    definitions = [node for node in tree.body if isinstance(node, ast.FunctionDef)]
    assert list(source.functions) == [node.name for node in definitions]
    for node in definitions:
        assert ast.dump(ast.parse(source.functions[node.name]).body[0].body[-1]) == ast.dump(node.body[-1])
        assert source.lines[node.name] == node.lineno
    header = next(node.value for node in tree.body if isinstance(node, ast.Assign))
    assert source.header == ast.literal_eval(header)


def test_text_and_file_read_the_same():
    from_file, from_text = read_module(FIXTURES / "pendulum.py"), read_module(text_of("pendulum"))
    assert from_file.functions == from_text.functions
    assert from_file.text_hash == from_text.text_hash


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ('"abi": 1', '"abi": 2', "ABI 2"),
        ('"abi": 1', '"abi": True', "expected a int"),
        ('    "nq": 1,\n', "", "'nq' is missing"),
        ('"nq": 1', '"nq": 2', "coordinates has 1 entries, but nq is 2"),
        ('"nw": 0', '"nw": 1', "conservative"),
        ('"nq": 1', '"nq": -1', "expected a count"),
        ('"value": 1.5', '"value": "1.5"', "coordinates[0]['value']"),
        ('"value": 1.5', '"value": 1e999', "finite"),
        ('"value": 1.5', '"value": __import__("os").getpid()', "not a literal"),
        ('"parameters": [', '"parameters": [{"name": "g", "unit": "", "value": 1.0},', "'g' twice"),
        ('"events": []', '"events": [{"name": "a", "direction": "up", "action": "record"}]', "'up'"),
        ('"run": {', '"run": 3, "ran": {', "'run' is 3"),
        ("def energy(", "def energie(", "'energy' is missing"),
        ('@njit(error_model="numpy")\ndef rhs', "def rhs", "expected @njit"),
        ('@njit(error_model="numpy")\ndef rhs', "@njit(fastmath=True)\ndef rhs", "fastmath"),
        ("def rhs(t, y, p, out):", "def rhs(t, y, p):", "expected @njit"),
        ("def rhs(t, y, p, out):", "def mass_matrix(t, y, p, out):", "defined twice"),
        ("from numba import njit", "import os", "'import os'"),
        ("from numba import njit", "from numba import njit; print(1)", "unexpected before MODEL"),
        ("MODEL = {", "MODEL = dict(", "not a generated module"),
    ],
)
def test_refuses_with_place_and_cause(old, new, says):
    text = text_of("pendulum")
    assert old in text
    with pytest.raises(ModuleError) as caught:
        read_module(text.replace(old, new, 1))
    assert says in str(caught.value)
    assert caught.value.file == "<text>"


def test_names_the_line_of_foreign_code():
    text = text_of("pendulum") + "\nimport os\nos.abort()\n"
    with pytest.raises(ModuleError) as caught:
        read_module(text)
    assert caught.value.place == f"line {text.splitlines().index('import os') + 1}"


def test_deep_nesting_in_the_header_is_refused_not_a_crash():
    deep = "[" * 5000 + "]" * 5000
    with pytest.raises(ModuleError, match="not a literal"):
        read_module(text_of("pendulum").replace('"run": {', f'"more": {deep},\n    "run": {{', 1))


def test_missing_file_and_binary_file_are_named(tmp_path):
    with pytest.raises(ModuleError, match=r"absent\.py.*cannot be read"):
        read_module(tmp_path / "absent.py")
    binary = tmp_path / "binary.py"
    binary.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ModuleError, match="UTF-8"):
        read_module(binary)


def test_unknown_keys_are_left_alone():
    text = text_of("pendulum").replace('"abi": 1,', '"abi": 1,\n    "colour": "blue",', 1)
    assert read_module(text).header["colour"] == "blue"
