"""Inputs over time in model files, tables in text files, and `symgen run --input`."""

from __future__ import annotations

import json

import numpy as np
import pytest
from click.testing import CliRunner

from symgen import Model
from symgen.cli import main
from symgen.errors import ModelError
from symgen.model.table_file import read_table_file
from symgen.runtime.inputs.given import InputFault, Table

MODEL = """
[parameters]
mass = "2 kg"
[coordinates]
x = {{ unit = "m" }}
[energy]
kinetic = "1/2*mass*dot(x)^2"
[inputs]
u = {{ unit = "N", default = 1.0{more} }}
[forces]
x = "u"
[run]
t_end = 2.0
"""


def model_text(more=""):
    return MODEL.format(more=", " + more if more else "")


def moved(text, folder=None, **options):
    return Model.from_toml(text, folder=folder).derive().run(method="dop853", **options).q[-1, 0]


def test_tables_and_polynomials_in_a_model():
    assert moved(model_text()) == pytest.approx(1.0, rel=1e-9)
    assert moved(model_text("table = [[0, 1], [0.0, 4.0]]")) == pytest.approx(1 / 3 + 1.0 + 1.0, rel=1e-9)
    held = model_text('table = [[0, 1], [2.0, 4.0]], kind = "hold"')
    assert moved(held) == pytest.approx(0.5 + 1.0 + 1.0, rel=1e-9)
    rising = model_text("polynomial = [0, 3]")
    assert moved(rising) == pytest.approx(2.0, rel=1e-9)
    assert moved(rising, inputs={"u": 1.0}) == pytest.approx(1.0, rel=1e-9)
    assert moved(rising, parameters={"u": 1.0}) == pytest.approx(1.0, rel=1e-9)
    assert moved(rising, inputs={"u": ([0.0], [2.0])}) == pytest.approx(2.0, rel=1e-9)


@pytest.mark.parametrize("more", ["table = [[0, 1], [2.5, 4]], kind = 'cubic'", "polynomial = [0.1, 3]", ""])
def test_round_trip(more):
    model = Model.from_toml(model_text(more))
    again = Model.from_toml(model.to_toml())
    assert again.describe().inputs == model.describe().inputs
    assert again.to_toml() == model.to_toml()


def test_values_are_in_the_unit_of_the_input(tmp_path):
    (tmp_path / "push.csv").write_text("t; u\n0; 1\n1; 2\n")
    text = model_text('table = "push.csv"').replace('"N"', '"kN"')
    (u,) = Model.from_toml(text, folder=tmp_path).describe().inputs
    assert (u.times, u.values, u.unit) == ((0.0, 1.0), (1000.0, 2000.0), "N")
    assert Model.from_toml(Model.from_toml(text, folder=tmp_path).to_toml()).describe().inputs == (u,)


@pytest.mark.parametrize(
    ("more", "cause"),
    [
        ("table = [[0, 1], [2.0]]", "2 times and 1 values"),
        ("table = [[0, 0], [2.0, 3.0]]", "times must ascend, but 0 s follows 0 s"),
        ("table = [[0, 1], [2.0, nan]]", "finite numbers are expected here, not nan"),
        ("table = [[0, 1], [2.0, '3']]", "finite numbers are expected here"),
        ("table = [0, 1]", "a list of numbers is expected here"),
        ("table = 3", "a list of times and a list of values"),
        ("kind = 'hold'", "a kind belongs to a table"),
        ("table = [[0], [1]], kind = 'lineal'", "unknown kind of table 'lineal'.*linear"),
        ("table = [[0], [1]], polynomial = [1]", "a table and a polynomial"),
        ("polynomial = []", "at least one coefficient"),
        ("table = '../push.csv'", "not below the model's own folder"),
        ("table = '/etc/passwd'", "not below the model's own folder"),
        ("table = 'link.csv'", "leads out of the model's own folder"),
        ("table = 'none.csv'", "'none.csv' is not there"),
        ("table = 'wide.csv'", "2 columns of values, none is 'u'"),
    ],
)
def test_what_is_no_course_is_refused(tmp_path, more, cause):
    (tmp_path / "model").mkdir()
    (tmp_path / "push.csv").write_text("0 1\n1 2\n")
    (tmp_path / "model" / "link.csv").symlink_to(tmp_path / "push.csv")
    (tmp_path / "model" / "wide.csv").write_text("t,a,b\n0,1,2\n")
    with pytest.raises(ModelError, match=f"(?s){cause}") as error:
        Model.from_toml(model_text(more), folder=tmp_path / "model")
    assert error.value.table == "inputs"


def test_table_files(tmp_path):
    file = tmp_path / "table.csv"
    for text in (
        "t,a,b\n0,1,2\n\n1e0,3,-4\n",
        "# made by hand\nt\ta\tb\n0\t1\t2  # first\n1\t3\t-4",
        '"t" a b\n0 1 2\n1 3 -4',
    ):
        file.write_text(text)
        content = read_table_file(file)
        assert content.names == ("t", "a", "b")
        assert content.times == (0.0, 1.0)
        assert content.columns == ((1.0, 3.0), (2.0, -4.0))
    file.write_text("0;1\n2;3\n")
    assert read_table_file(file).names == ()


@pytest.mark.parametrize(
    ("text", "cause"),
    [
        ("t,u\n0,1\n1,x\n", "line 3.*column 2 holds 'x'"),
        ("0,1\n1,inf\n", "line 2.*no finite number"),
        ("0,1\n1,1_0\n", "line 2.*'1_0', which is no finite number"),
        ("0,1\n1,2,3\n", "line 2.*3 columns, where 2 are expected"),
        ("0\n1\n", "line 1.*1 column, where 2 are expected"),
        ("0,1\n0,2\n", "line 2.*0 s follows 0 s"),
        ("t,u\n", "no rows"),
        ("", "no rows"),
        ("t,u\na,b\n", "line 2.*column 1 holds 'a'"),
        ("t,u,u\n0,1,2\n", "line 1.*two columns are named 'u'"),
        ("t,u [furlong]\n0,1\n", "line 1.*unit of 'u \\[furlong\\]' cannot be read"),
        ("t [m],u\n0,1\n", "first column, 't', is in m, which is no unit of time"),
        ("0;0\n1;1,5\n", "line 2.*'1;1'.*decimal points"),
    ],
)
def test_faults_of_table_files_name_the_line(tmp_path, text, cause):
    file = tmp_path / "table.csv"
    file.write_text(text)
    with pytest.raises(ModelError, match=f"(?s){cause}") as error:
        read_table_file(file)
    assert error.value.file == str(file)


def test_units_in_the_first_line_hold(tmp_path):
    for head in ("t [ms],u [kN]", "t (ms);u (kN)", "t/ms,u/kN"):
        rows = "\n0,0\n1000,0.004\n".replace(",", ";" if ";" in head else ",")
        (tmp_path / "u.csv").write_text(head + rows)
        assert moved(model_text('table = "u.csv"'), tmp_path) == pytest.approx(1 / 3 + 1.0 + 1.0, rel=1e-9)
    (tmp_path / "u.csv").write_text("t,u (left)\n0,0\n1,4\n")
    assert moved(model_text('table = "u.csv"'), tmp_path) == pytest.approx(1 / 3 + 1.0 + 1.0, rel=1e-9)
    (tmp_path / "u.csv").write_text("t,u [mm]\n0,0\n1,4\n")
    with pytest.raises(ModelError, match=r"'u' is in mm .m., where N "):
        moved(model_text('table = "u.csv"'), tmp_path)


@pytest.mark.parametrize(
    ("more", "cause"),
    [
        (
            "unit = 'kN', table = [[0, 1], [0.0, 1e308]]",
            r"u.table: the number 1e\+308 kN is outside the range",
        ),
        ("unit = 'kN', polynomial = [1e308]", r"u.polynomial: the number 1e\+308 kN"),
        ("unit = 'kN', default = 1e308", r"u.default: the number 1e\+308 kN"),
    ],
)
def test_values_that_no_number_holds_are_refused(more, cause):
    with pytest.raises(ModelError, match=cause):
        Model.from_toml(MODEL.replace('unit = "N", default = 1.0{more}', more).format())


def test_arrays_that_are_numbers_only_to_numpy_are_refused():
    for times, cause in (
        (np.array([0, 1], dtype="M8[s]"), "times are dates"),
        (np.array([0, 1000], dtype="m8[ms]"), "times are time spans"),
        (np.ma.masked_array([0.0, 1.0], mask=[False, True]), "masked"),
        (np.array([0.0, 1.0j]), "times are complex"),
    ):
        with pytest.raises(InputFault, match=cause):
            Table(times, [0.0, 1.0])


def test_tables_too_steep_for_numbers_are_refused():
    for values in ([1e308, -1e308], [0.0, 1e80]):
        with pytest.raises(InputFault, match="steeper than numbers can follow"):
            Table([0.0, 1.0], values)
    Table([0.0, 1e-300], [0.0, 1.0], kind="hold")
    for place, value in ((1e-300, 1.0), (0.5, 1e308)):
        table = f"[tables.c]\ncolumns = [[0.0, {place}, 1.0], [0.0, {value}, 0.0]]\n"
        with pytest.raises(ModelError, match=r"tables.c. columns: .* beyond what polynomials"):
            Model.from_toml(model_text() + table)


def test_units_in_the_first_line_of_a_curve_hold(tmp_path):
    model = (
        model_text().replace('x = "u"', 'x = "c(x)"') + '[tables.c]\nfile = "c.csv"{more}\noutside = "hold"\n'
    )
    (tmp_path / "c.csv").write_text("x [mm],f [kN]\n0,0.001\n1000,0.001\n")
    for more in ("", '\nunits = ["mm", "kN"]'):
        assert moved(model.replace("{more}", more), tmp_path) == pytest.approx(1.0, rel=1e-9)
    with pytest.raises(ModelError, match="column 1 is in 'm' here, and in 'mm' by the first line"):
        moved(model.replace("{more}", '\nunits = ["m", "kN"]'), tmp_path)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "push.toml").write_text(model_text())
    (tmp_path / "ramp.csv").write_text("t,u\n0,0\n2,6\n")
    return tmp_path


def run(*arguments):
    return CliRunner().invoke(main, ["run", "push.toml", "--no-log", *arguments], prog_name="symgen")


@pytest.mark.parametrize("given", ["ramp.csv", "u=ramp.csv"])
def test_inputs_on_the_command_line(folder, given):
    result = run("--input", given, "--json", "out.json", "--method", "dop853")
    assert result.exit_code == 0, result.output
    assert json.loads((folder / "out.json").read_text())["coordinates"]["x"] == pytest.approx(2.0, rel=1e-9)
    held = run("--input", given, "--input-kind", "hold", "--json", "out.json", "--method", "dop853")
    assert held.exit_code == 0 and json.loads((folder / "out.json").read_text())["coordinates"]["x"] == 0.0


@pytest.mark.parametrize(
    ("arguments", "status", "cause"),
    [
        (["--input", "w=ramp.csv"], 2, "has no input 'w'"),
        (["--input", "u=none.csv"], 1, "none.csv: the table cannot be read"),
        (["--input", "bare.csv"], 2, "its first line names no inputs"),
        (["--input", "u=bad.csv"], 1, "bad.csv, line 2"),
        (["--input", "ramp.csv", "--input", "u=ramp.csv"], 2, "given already"),
        (["--input", "ramp.csv", "--set", "u=3"], 2, "given already"),
        (["--input", "u=wide.csv"], 2, "none of them 'u'"),
        (["--input", "u=other.csv"], 2, "the column of other.csv is 'v', another input than 'u'"),
        (["--input", "u=turned.csv"], 2, "times come first"),
    ],
)
def test_wrong_inputs_on_the_command_line(folder, arguments, status, cause):
    (folder / "bare.csv").write_text("0,1\n")
    (folder / "bad.csv").write_text("0,1\n1,x\n")
    (folder / "wide.csv").write_text("t,a,b\n0,1,2\n")
    (folder / "other.csv").write_text("t,v\n0,1\n")
    (folder / "turned.csv").write_text("u,t\n0,1\n")
    (folder / "push.toml").write_text(model_text() + "[inputs.v]\nunit = 'N'\n")
    result = run(*arguments)
    assert result.exit_code == status
    assert cause in result.output
    assert "Traceback" not in result.output


def test_a_changed_table_is_a_changed_model(folder):
    (folder / "push.toml").write_text(model_text('table = "ramp.csv"'))
    found = []
    for text in ("t,u\n0,0\n2,6\n", "t,u\n0,0\n2,12\n"):
        (folder / "ramp.csv").write_text(text)
        result = run("--json", "out.json", "--method", "dop853")
        assert result.exit_code == 0, result.output
        found.append(json.loads((folder / "out.json").read_text())["coordinates"]["x"])
    np.testing.assert_allclose(found, [2.0, 4.0], rtol=1e-9)
