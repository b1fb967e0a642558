"""Finding, listing and loading model files."""

from pathlib import Path

import pytest

from symgen import link
from symgen.errors import ModelError
from symgen.model import library
from symgen.runtime.errors import RuntimeModelError

BUILD = '''"""A chain.

More."""
import math
from symgen import Model, cos, sin

def build(N=2, scale=1.0, drawn=False, word="a"):
    m = Model("chain", description=f"{N} {scale!r} {drawn!r} {word!r}")
    q = m.coordinate("q")
    m.body("b", mass=scale, com=(sin(q), cos(q)))
    return m
'''


@pytest.fixture
def chain(tmp_path):
    path = tmp_path / "chain.py"
    path.write_text(BUILD)
    return path


def test_bundled_models_are_found():
    assert library.find("pendulum").name == "pendulum.toml"
    listed = {name: (description, path) for name, description, path in library.list_models()}
    assert listed["pendulum"][0].startswith("Plane pendulum")
    assert listed["n_pendulum"][1].suffix == ".py"
    assert all(description and "cannot" not in description for description, _ in listed.values())


def test_installed_folder_comes_first(tmp_path, monkeypatch):
    package = tmp_path / "symgen"
    (package / "model").mkdir(parents=True)
    monkeypatch.setattr(library, "__file__", str(package / "model" / "library.py"))
    assert library.bundled_folder() == tmp_path / "models"
    (package / "bundled").mkdir()
    assert library.bundled_folder() == package / "bundled"


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("pendulm", "did you mean 'pendulum'"),
        ("zzz", "bundled models: "),
        ("nowhere.toml", "does not exist"),
        ("models/nowhere", "does not exist"),
        ("pendulm.toml", "did you mean 'pendulum"),
        ("/dev/null", "is no plain file, but a device or a pipe; "),
        ("models/", "is a folder|no bundled model"),
    ],
)
def test_unknown_models(name, words):
    with pytest.raises(ModelError, match=words):
        library.find(name)


def test_other_files_are_no_models(tmp_path):
    path = tmp_path / "a.txt"
    path.write_text("")
    with pytest.raises(ModelError, match=r"a \.toml or a \.py file"):
        library.find(path)
    with pytest.raises(ModelError, match=r"a \.toml or a \.py file"):
        library.load(path)


def test_a_recording_in_place_of_a_model_is_said_to_be_one(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("run.rrd").touch()
    with pytest.raises(ModelError, match=r"'run\.rrd' is not a model file; .* take recordings"):
        library.find("run.rrd")


def test_a_folder_is_not_what_was_meant(tmp_path):
    (tmp_path / "m.toml").mkdir()
    with pytest.raises(ModelError, match=r"is a folder; name a \.toml or a \.py file"):
        library.find(tmp_path / "m.toml")


def test_options_are_converted(chain):
    model = library.load(chain, {"N": "5", "scale": "2.5", "drawn": "true", "word": "b"})
    assert model.describe().description == "5 2.5 True 'b'"
    assert model.folder == chain.parent
    assert [p.name for p in chain.parent.iterdir()] == ["chain.py"]


def test_wrong_options(chain):
    with pytest.raises(
        ModelError, match=r"no option 'n'; did you mean 'N'\? \(options: N, scale, drawn, word\)"
    ):
        library.load(chain, {"n": "5"})
    with pytest.raises(ModelError, match="no build options"):
        library.load(library.find("pendulum"), {"N": "5"})


def _load(tmp_path: Path, text: str, **options):
    path = tmp_path / "author.py"
    path.write_text(text)
    return library.load(path, options)


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ("def build(:\n", 1, "Python syntax"),
        ("x = 1\n", None, "no function 'build'"),
        ("\n\n1/0\n", 3, "ZeroDivisionError: division by zero"),
        ("import nowhere_at_all\n", 1, "No module named 'nowhere_at_all'"),
        ("def build():\n    return 5\n", None, "returned int"),
        ("def build():\n    x = {}\n    return x['a']\n", 3, "KeyError"),
        ("def build(N):\n    pass\n", None, "needs the option 'N'"),
        ("import sys\nsys.exit(3)\n", 2, "SystemExit"),
        (
            "from symgen import Model\ndef build():\n    m = Model('a')\n    m.coordinate('2x')\n",
            4,
            "not a name",
        ),
    ],
)
def test_errors_in_the_authors_file(tmp_path, text, line, words):
    with pytest.raises(ModelError, match=words) as caught:
        _load(tmp_path, text)
    assert caught.value.file == str(tmp_path / "author.py")
    assert caught.value.line == line


def test_open_ended_options(tmp_path):
    text = (
        "from symgen import Model\ndef build(**options):\n    return Model('a', description=str(options))\n"
    )
    assert _load(tmp_path, text, N="3").description == "{'N': 3}"


def test_toml_is_read_by_path():
    assert library.load(library.find("bouncing_ball")).describe().name == "bouncing_ball"


def test_errors_of_bundled_models_name_the_model_and_not_where_it_lies():
    with pytest.raises(RuntimeModelError) as error:
        link.load("pendulum").run(t_end=0.1, parameters={"m": -1})
    assert str(error.value).startswith("pendulum.toml, [bodies.bob] mass: the mass is negative")


@pytest.mark.parametrize("name", ["slider.TOML", "slider.Toml"])
def test_suffixes_may_be_written_large(tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    Path(name).write_text('[coordinates]\nx = {}\n[energy]\nkinetic = "dot(x)^2/2"\n', encoding="utf-8")
    assert library.find(name) == Path(name)
    assert [c.name for c in library.load(name).describe().coordinates] == ["x"]
    with pytest.raises(ModelError, match=r"did you mean 'slider\.T"):
        library.find("slidr.TOML")
