"""docs/reference.md against the reader's own tables: no key, function, unit or kind is missing; every example runs."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from symgen.link import derive
from symgen.model import toml_reader
from symgen.model.assemblies import PORT_KEYS, PORT_KINDS
from symgen.model.closure_types import CLOSURES
from symgen.model.closures import CLOSURE_KEYS
from symgen.model.declared import NUMBER_KEYS
from symgen.model.elements import ACTS, BUSHING_KEYS, SPRING_KEYS
from symgen.model.gravity import ATTRACTOR_KEYS
from symgen.model.items import DRAWINGS
from symgen.model.joint_types import TYPES
from symgen.model.names import FUNCTION_ARITY, SENSOR_ARITY
from symgen.model.over_time import KINDS
from symgen.model.parts import ACTIONS, DIRECTIONS, SHAPES
from symgen.model.rolling import ROLLING_KEYS
from symgen.model.rotors import ROTOR_KEYS
from symgen.model.run_defaults import FORMULATIONS, KEYS
from symgen.model.solids import SHAPE_KEYS
from symgen.model.starts import START_KEYS
from symgen.model.toml_reader import READERS, TOP_KEYS, read_text
from symgen.model.tyres import TYRE_KEYS
from symgen.model.units import ATOMS

PAGE = (Path(__file__).parents[1] / "docs" / "reference.md").read_text(encoding="utf-8")
SECTIONS = dict(re.findall(r"^## `?(.+?)`?\n(.*?)(?=^## |\Z)", PAGE, re.DOTALL | re.MULTILINE))
KEYS_OF = {
    "parameters": NUMBER_KEYS,
    "coordinates": toml_reader.COORDINATE_KEYS,
    "states": toml_reader.STATE_KEYS,
    "tables": toml_reader.TABLE_KEYS,
    "inputs": toml_reader.INPUT_KEYS,
    "bodies": toml_reader.BODY_KEYS,
    "joints": toml_reader.JOINT_KEYS,
    "points": ("body", "at"),
    "axes": ("body", "direction"),
    "frames": toml_reader.FRAME_KEYS,
    "rolling": ROLLING_KEYS,
    "rotors": ROTOR_KEYS,
    "tyres": TYRE_KEYS,
    "closures": CLOSURE_KEYS,
    "springs": SPRING_KEYS,
    "bushings": BUSHING_KEYS,
    "gravity": (*toml_reader.GRAVITY_KEYS, *ATTRACTOR_KEYS),
    "energy": toml_reader.ENERGY_KEYS,
    "loads": toml_reader.LOAD_KEYS,
    "constraints": ("coincident", *toml_reader.READY_MADE),
    "stops": toml_reader.STOP_KEYS,
    "friction": toml_reader.FRICTION_KEYS,
    "bristles": toml_reader.BRISTLE_KEYS,
    "contacts": toml_reader.CONTACT_KEYS,
    "events": toml_reader.EVENT_KEYS,
    "start": START_KEYS,
    "draw": DRAWINGS,
    "run": KEYS,
    "ports": PORT_KEYS,
    "assemblies": toml_reader.ASSEMBLY_KEYS,
    "use": toml_reader.USE_KEYS,
}
EXAMPLES = [
    (table, k, text)
    for table, section in SECTIONS.items()
    for k, text in enumerate(re.findall(r"```toml\n(.*?)```", section, re.DOTALL))
]


def rows(section: str) -> set[str]:
    """What stands in code style in the first column of a section's tables."""
    lines = [line for line in SECTIONS[section].split("\n") if line.startswith("|")]
    return {name for line in lines for name in re.findall(r"`([^`]+)`", line.split("|")[1])}


def test_every_table_has_a_section_and_a_link():
    assert set(READERS) <= set(SECTIONS)
    assert all(f"](#{table})" in PAGE for table in READERS)
    assert all(f"`{key}`" in PAGE.split("## ")[0] for key in TOP_KEYS)


def test_every_table_with_keys_is_tested():
    without = {"constants", "definitions", "outputs", "forces", "velocity_constraints"}
    assert set(READERS) == set(KEYS_OF) | without


@pytest.mark.parametrize("table", KEYS_OF)
def test_every_key_has_a_row_and_no_row_is_of_another(table):
    more = {"parameters": {"NAME"}, "bodies": {*SHAPES, *SHAPE_KEYS}}.get(table, set())
    assert rows(table) == {*KEYS_OF[table]} | more


@pytest.mark.parametrize(
    "table, words",
    [
        ("joints", TYPES),
        ("closures", CLOSURES),
        ("inputs", KINDS),
        ("springs", ACTS),
        ("ports", PORT_KINDS),
        ("run", FORMULATIONS),
        ("events", (*DIRECTIONS, *ACTIONS)),
    ],
)
def test_words_that_a_key_takes_are_named(table, words):
    assert [word for word in words if not re.search(rf'["`]{word}["`]|{word} =', SECTIONS[table])] == []


def test_every_function_and_unit_is_named():
    values = SECTIONS["What values are"]
    assert rows("What values are") == set(FUNCTION_ARITY)
    assert {name.partition("(")[0] for name in rows("Sensors")} == set(SENSOR_ARITY)
    units = re.search(r"powers of `([^`]*)`, the prefixes `([^`]*)`, and `([^`]*)`", values)
    plain, prefixes, more = (set(part.split()) for part in units.groups())
    made = plain | more | {prefix + unit for prefix in prefixes for unit in plain}
    assert set(ATOMS) <= made
    assert plain | more <= set(ATOMS)


@pytest.mark.parametrize("table, k, text", EXAMPLES, ids=[f"{table}-{k}" for table, k, _ in EXAMPLES])
def test_every_example_derives_and_uses_its_table(table, k, text):
    assert re.search(rf"^\[{table}\b", text, re.MULTILINE)
    system = derive(read_text(text, name=f"{table}_example"))
    solution = system.run(t_end=0.01, method="dop853")
    assert solution.status == "success"
