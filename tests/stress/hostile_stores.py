"""Stores of ensembles that somebody has changed: cut, swapped, forged, signed anew; shown, reported, gone on with.

Each scenario copies a store of twenty members, leaves some of its chunks out, changes something by its seed, and does
what a user would do with it. Right is a store that says the members' true numbers, and an ensemble that was gone on
with to the very numbers of one that was never touched. What was changed by somebody who signs it as this program does
may say other numbers when it is shown, but nothing that contradicts itself, and does not survive `--resume`.
"""

from __future__ import annotations

import atexit
import contextlib
import functools
import json
import os
import random
import shutil
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from .hostile import COUNTS, NUMBERS, TEXTS, VALUES, bounded, invoke, worst
from .scenario import FLAGGED, REFUSED, RIGHT, WRONG, Outcome, Scenario

_SHORT, _LONG = 3, 400
_LIMIT = 120.0
_N = 20
# Options of a sweep: ends, series with statistics, members that fail. One after another, so that chunks are small.
SWEEPS: dict[str, tuple[str, ...]] = {
    "ends": ("--vary", "L=normal(1, 0.1)", "-n", str(_N)),
    "series": ("--vary", "L=uniform(0.5, 1)", "-n", str(_N), "--frames", "5", "--keep", "theta,energy"),
    "failures": ("--vary", "m=grid(1, -1)", "--vary", "L=uniform(0.5, 1)", "-n", str(_N // 2)),
}
_COMMON = ("--method", "bdf", "--t-end", "1", "--rtol", "1e-5", "--threads", "1", "--quiet")


def scenarios() -> Iterator[Scenario]:
    """All of them; the first few belong to the test suite."""
    for seed in range(_LONG):
        yield Scenario(
            "hostile stores", f"hostile stores {seed}", functools.partial(bounded, store, "hostile stores", seed),
            short=seed < _SHORT, limit=_LIMIT,
        )  # fmt: skip
    for seed in range(_LONG):
        yield Scenario(
            "hostile members", f"hostile members {seed}",
            functools.partial(bounded, file_of_numpy, "hostile members", seed), short=seed < _SHORT, limit=_LIMIT,
        )  # fmt: skip


def sweep(sort: str, out: Path, *more: str, seed: int = 1) -> Outcome:
    return invoke("sweep", "pendulum", *SWEEPS[sort], *_COMMON, "--seed", seed, "--out", out, *more)


@functools.cache
def originals() -> Path:
    """A folder with a store of each sort, of two seeds."""
    folder = Path(tempfile.mkdtemp())
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    for sort in SWEEPS:
        for seed in (1, 2):
            sweep(sort, folder / f"{sort}-{seed}.zarr", seed=seed)
        sweep(sort, folder / f"{sort}-1.npz")
    return folder


def numbers(path: Path) -> dict[str, bytes]:
    """All that a store keeps, by name."""
    from symgen.runtime.ensemble.zarr_store import ZarrStore

    opened = ZarrStore.open(path)
    return {name: opened.read(name).tobytes() for name in opened.names}


@functools.cache
def true_numbers(sort: str) -> dict[str, bytes]:
    return numbers(originals() / f"{sort}-1.zarr")


def store(r: random.Random) -> Outcome:
    """Change a copy of a store and use it."""
    sort = r.choice([*SWEEPS])
    original, path = originals() / f"{sort}-1.zarr", Path("runs.zarr")
    shutil.copytree(original, path)
    change = r.choice(CHANGES)
    if r.random() < 0.5:  # as if it had been interrupted
        _leave_out(r, path)
    with contextlib.suppress(OSError, KeyError, IndexError):
        for _ in range(r.choice((1, 1, 2))):
            change(r, path, sort)
    signed = r.random() < 0.5 and _sign(path)
    used = r.sample((_show, _report, _read), 2)
    outcomes = [each(path, sort, signed) for each in used] + [_go_on(path, sort)]
    return Outcome(worst(outcomes).verdict, f"{change.__name__}: {worst(outcomes).says}")


# What is done with it


def _named(done: Outcome) -> Outcome:
    if done.verdict == REFUSED and "runs.zarr" not in done.says:
        return Outcome(WRONG, f"the store is not named: {done.says}")
    return done


def _show(path: Path, sort: str, signed: bool) -> Outcome:
    done = _named(invoke("sweep", "--show", path))
    if done.verdict != RIGHT or signed:
        return done
    shown, expected = done.says.split("  "), _expected_lines(path, sort)
    missing = [line for line in expected if line.strip() not in " ".join(done.says.split())]
    return Outcome(WRONG, f"{missing} is not in {shown}") if missing else done


def _expected_lines(path: Path, sort: str) -> list[str]:
    """What `--show` has to say of the chunks that it takes for done, by the true numbers."""
    from symgen.runtime.ensemble.zarr_store import ZarrStore

    mine, true = ZarrStore.open(path), ZarrStore.open(originals() / f"{sort}-1.zarr")
    rows = np.concatenate([np.arange(*true.rows(k)) for k in mine.done()] or [np.zeros(0, dtype=int)])
    status, ok = true.read("status")[rows], true.read("ok")[rows]
    lines = [
        f"pendulum: {len(rows)} of {_N} members by bdf, to t = 1 s at rtol 1e-05",
        f"health {ok.sum()} ok, {(status != 1).sum()} failed, {((status == 1) & ~ok).sum()} doubtful",
    ]
    for name in (*true.about["varied"], *true.about["series"]):
        values = true.read(name)[rows]
        values = values if values.ndim == 1 else values[:, -1]
        values = values[np.isfinite(values)]
        if len(values):
            lines.append(f"from {values.min():.6g} to {values.max():.6g}")
    return lines


def _report(path: Path, sort: str, signed: bool) -> Outcome:
    done = _named(invoke("report", path, "--html", "page.html"))
    if (
        done.verdict == RIGHT
        and "nan" in Path("page.html").read_text(encoding="utf-8").lower().split("members across")[0]
    ):
        return Outcome(WRONG, "the page says nan")
    return done


def _read(path: Path, sort: str, signed: bool) -> Outcome:
    """Read all of it by Python."""
    from symgen.runtime.ensemble.zarr_store import ZarrStore
    from symgen.runtime.errors import RuntimeModelError

    try:
        opened = ZarrStore.open(path)
        opened.t, opened.messages()
        found = {name: opened.read(name) for name in opened.names}
        done = np.concatenate([np.arange(*opened.rows(k)) for k in opened.done()] or [np.zeros(0, dtype=int)])
    except (RuntimeModelError, MemoryError) as error:
        return Outcome(
            REFUSED if "runs.zarr" in str(error) or isinstance(error, MemoryError) else WRONG, str(error)
        )
    if signed:
        return Outcome(RIGHT, "as somebody has signed it")
    for name, true in true_numbers(sort).items():
        mine = found.get(name)
        other = np.frombuffer(true, dtype=None if mine is None else mine.dtype)
        if mine is None or mine[done].tobytes() != other.reshape(_N, -1)[done].tobytes():
            return Outcome(WRONG, f"{name} has other numbers")
    return Outcome(RIGHT, "the true numbers")


def _go_on(path: Path, sort: str) -> Outcome:
    before = _listing(Path.cwd().parent)
    done = _named(sweep(sort, path, "--resume"))
    if _listing(Path.cwd().parent) != before:
        return Outcome(WRONG, "something was written outside the folder")
    if done.verdict == REFUSED:
        return done
    found = numbers(path)
    wrong = [name for name, true in true_numbers(sort).items() if found.get(name) != true]
    return Outcome(WRONG, f"gone on with, {wrong} are not what they are: {done.says}") if wrong else done


def _listing(folder: Path) -> set[str]:
    return {x.name for x in folder.iterdir() if not x.name.startswith(("tmp", "."))}


def _sign(path: Path) -> bool:
    """Sign a store anew, as a stranger can who has read the sources; False where there is nothing to be signed."""
    import zarr

    from symgen.runtime.ensemble import digests
    from symgen.runtime.ensemble.zarr_store import ZarrStore

    if any(
        x.is_symlink() or not (x.is_file() or x.is_dir()) for x in path.rglob("*")
    ):  # Zarr would wait for a pipe
        return False
    try:
        whole = json.loads((path / "zarr.json").read_text(encoding="utf-8"))
        about = whole["attributes"]["symgen"]
        about["digest"] = digests.of_about(about)
        (path / "zarr.json").write_text(json.dumps(whole), encoding="utf-8")
        opened, group = ZarrStore.open(path), zarr.open_group(path, mode="r+")
        sums = group["more/digests"].with_config({"write_empty_chunks": True})
        for k in range(min(opened.n_chunks, 8)):
            first, last = opened.rows(k)
            rows = [
                digests.of_chunk(about["digest"], name, k, group[name][first:last]) for name in opened.names
            ]
            known = group[f"more/{k}"][:].tobytes() if (path / "more" / str(k)).is_dir() else b""
            sums[k] = np.array([*rows, digests.of_chunk(about["digest"], "more", k, known)])
    except Exception:  # what cannot be opened is not signed
        return False
    return True


# Changes


def _leave_out(r: random.Random, path: Path) -> None:
    for k in r.sample(range(4), r.randint(1, 3)):
        for file in (path / "status" / "c").glob(str(k)):
            file.unlink()


def _metadata(path: Path, edit: Callable[[dict], Any]) -> None:
    whole = json.loads(path.read_text(encoding="utf-8"))
    edit(whole)
    path.write_text(json.dumps(whole), encoding="utf-8")


def _array(r: random.Random, path: Path) -> Path:
    return r.choice(sorted(x for x in path.iterdir() if (x / "c").is_dir()))


def _chunk(r: random.Random, path: Path) -> Path:
    return r.choice(sorted(x for x in path.rglob("*") if x.is_file() and x.name != "zarr.json"))


def _rewrite(path: Path, name: str, edit: Callable[[np.ndarray], None]) -> None:
    """Change numbers of an array; its checksums agree."""
    import zarr

    array = zarr.open_group(path, mode="r+")[name].with_config({"write_empty_chunks": True})
    values = array[:]
    edit(values)
    array[:] = values


def about_edited(r: random.Random, path: Path, sort: str) -> None:
    def edit(whole: dict) -> None:
        about = whole["attributes"]["symgen"]
        name = r.choice([*about])
        about[name] = r.choice((*VALUES, *(x for x in NUMBERS if x == x), *COUNTS, about[r.choice([*about])]))

    _metadata(path / "zarr.json", edit)


def identity_edited(r: random.Random, path: Path, sort: str) -> None:
    def edit(whole: dict) -> None:
        identity = whole["attributes"]["symgen"]["identity"]
        identity[r.choice([*identity])] = r.choice((*VALUES, "'9.9 (other)'"))

    _metadata(path / "zarr.json", edit)


def settings_edited(r: random.Random, path: Path, sort: str) -> None:
    values = {
        "t_end": 2.0,
        "rtol": 1e-9,
        "method": "radau5",
        "model": "cart_pole",
        "n_times": 7,
        "chunk": 10,
        "n": 10,
    }
    name = r.choice([*values])
    _metadata(path / "zarr.json", lambda whole: whole["attributes"]["symgen"].update({name: values[name]}))


def choice_edited(r: random.Random, path: Path, sort: str) -> None:
    choice = {
        "method": r.choice(("bdf", "taylor", *TEXTS)),
        "order": r.choice(COUNTS),
        "most_steps": r.choice(COUNTS),
        "notes": [r.choice(TEXTS)],
    }
    _metadata(path / "zarr.json", lambda whole: whole["attributes"]["symgen"].update(choice=choice))


def json_edited(r: random.Random, path: Path, sort: str) -> None:
    """Set something to another type, anywhere in the description of an array or of the store."""

    def edit(whole: Any) -> None:
        here = whole
        while True:
            key = r.choice([*here] if isinstance(here, dict) else range(len(here)))
            if isinstance(here[key], (dict, list)) and here[key] and r.random() < 0.7:
                here = here[key]
                continue
            here[key] = r.choice((*VALUES, *COUNTS))
            return

    _metadata(r.choice(sorted(path.rglob("zarr.json"))), edit)


def nested(r: random.Random, path: Path, sort: str) -> None:
    file = r.choice(sorted(path.rglob("zarr.json")))
    file.write_text(
        r.choice(("[" * 100_000, '{"a":' * 50_000, "{", "", "\x00", "9" * 10_000, "null", "[]")),
        encoding="utf-8",
    )


def removed(r: random.Random, path: Path, sort: str) -> None:
    target = r.choice(sorted(path.rglob("*")))
    shutil.rmtree(target) if target.is_dir() else target.unlink()


def cut(r: random.Random, path: Path, sort: str) -> None:
    file = _chunk(r, path)
    content = file.read_bytes()
    file.write_bytes(content[: r.randrange(len(content))] if r.random() < 0.5 else content * 2)


def flipped(r: random.Random, path: Path, sort: str) -> None:
    file = _chunk(r, path)
    content = bytearray(file.read_bytes())
    content[r.randrange(len(content))] ^= 1 << r.randrange(8)
    file.write_bytes(content)


def swapped(r: random.Random, path: Path, sort: str) -> None:
    """Two chunks of one array, or of two whose numbers are of one type; checksums agree."""
    one = _chunk(r, path)
    alike = sorted(
        x
        for x in path.rglob("*")
        if x.is_file() and x != one and x.stat().st_size == one.stat().st_size and x.name != "zarr.json"
    )
    other = r.choice(alike)
    a, b = one.read_bytes(), other.read_bytes()
    one.write_bytes(b)
    if r.random() < 0.7:
        other.write_bytes(a)


def rows_moved(r: random.Random, path: Path, sort: str) -> None:
    """All that is known of a chunk stands where that of another was."""
    a, b = r.sample(range(4), 2)
    for array in path.iterdir():
        files = [
            file
            for k in (a, b)
            for file in (array / "c" / str(k), array / "c" / str(k) / "0")
            if file.is_file()
        ]
        if len(files) == 2:
            first, second = (file.read_bytes() for file in files)
            files[0].write_bytes(second)
            files[1].write_bytes(first)


def of_another(r: random.Random, path: Path, sort: str) -> None:
    """A chunk, an array or what a store says of itself are those of another seed."""
    other = originals() / f"{sort}-2.zarr"
    if r.random() < 0.3:
        shutil.copy(other / "zarr.json", path / "zarr.json")
    elif r.random() < 0.5:
        array = _array(r, path)
        shutil.rmtree(array)
        shutil.copytree(other / array.name, array)
    else:
        file = _chunk(r, path)
        shutil.copy(other / file.relative_to(path), file)


def no_numbers(r: random.Random, path: Path, sort: str) -> None:
    name = r.choice(
        [
            x.name
            for x in path.iterdir()
            if (x / "c").is_dir() and x.name not in ("status", "ok", "singly", "steps")
        ]
    )
    _rewrite(path, name, lambda values: values.__setitem__(slice(r.randrange(_N), None), r.choice(NUMBERS)))


def forged_verdicts(r: random.Random, path: Path, sort: str) -> None:
    name, value = r.choice(
        (
            ("status", 1),
            ("status", 57),
            ("status", -128),
            ("status", 0),
            ("ok", True),
            ("steps", -5),
            ("ok", False),
        )
    )
    _rewrite(path, name, lambda values: values.__setitem__(slice(r.randrange(_N), None), value))


def claimed(r: random.Random, path: Path, sort: str) -> None:
    """Claim that chunks are done whose data are not there."""
    k = r.randrange(4)
    for file in sorted(path.glob(f"*/c/{k}")) + sorted(path.glob(f"*/c/{k}/0")):
        if file.parts[-3] != "status" and file.is_file() and r.random() < 0.7:
            file.unlink()
    if r.random() < 0.5:
        shutil.copy(next((path / "status" / "c").iterdir()), path / "status" / "c" / str(k))


def more_members(r: random.Random, path: Path, sort: str) -> None:
    """Claim more members than there are: a few, with chunks that are copies, or very many."""
    n = r.choice((21, 25, 40, 10**9, 2**47))

    def edit(whole: dict) -> None:
        whole["shape"][0] = n

    _metadata(path / "zarr.json", lambda whole: whole["attributes"]["symgen"].update(n=n))
    for array in path.iterdir():
        if (array / "c").is_dir() and array.name != "t":
            _metadata(array / "zarr.json", edit)
            for k in range(4, min(-(-n // 5), 8)):
                source = array / "c" / str(k - 4)
                if source.is_file():
                    shutil.copy(source, array / "c" / str(k))
                elif source.is_dir():
                    shutil.copytree(source, array / "c" / str(k))


def names_edited(r: random.Random, path: Path, sort: str) -> None:
    name = r.choice(
        (
            "../../x",
            "..",
            "theta/../../x",
            "/etc/passwd",
            "c",
            "zarr.json",
            "more",
            "t",
            "status",
            "a\x1b[31m",
            "x" * 300,
            "é",
            "",
        )
    )
    key = r.choice(("series", "varied"))
    _metadata(path / "zarr.json", lambda whole: whole["attributes"]["symgen"][key].__setitem__(0, name))


def linked(r: random.Random, path: Path, sort: str) -> None:
    """Links, pipes and devices in place of files and folders."""
    target = r.choice(sorted(path.rglob("*")))
    shutil.rmtree(target) if target.is_dir() else target.unlink()
    way = r.randrange(5)
    if way == 0:
        os.mkfifo(target)
    elif way == 1:
        target.symlink_to(r.choice(("/dev/zero", "/dev/null", "/etc/passwd", "/", target.name, "missing")))
    elif way == 2:
        target.symlink_to(originals() / f"{sort}-2.zarr" / target.relative_to(path))
    elif way == 3:
        target.symlink_to(r.choice(sorted(path.rglob("*"))).absolute())
    else:
        target.mkdir()


def encoded(r: random.Random, path: Path, sort: str) -> None:
    """How numbers are written, and where: sizes and checksums of files agree."""
    changes = (
        {"codecs": [{"name": "bytes", "configuration": {"endian": "big"}}, {"name": "crc32c"}]},
        {"codecs": [{"name": "crc32c"}, {"name": "bytes"}]},
        {"codecs": [{"name": "bytes", "configuration": {"endian": "little"}}, {"name": "gzip"}]},
        {"chunk_key_encoding": {"name": "default", "configuration": {"separator": "."}}},
        {"chunk_key_encoding": {"name": "v2", "configuration": {"separator": "/"}}},
        {"fill_value": 1}, {"data_type": "int64"}, {"data_type": "float32"}, {"data_type": "uint64"},
        {"data_type": "complex64"}, {"dimension_names": ["t"]}, {"dimension_names": None}, {"zarr_format": 2},
        {"storage_transformers": [{"name": "x"}]}, {"attributes": {"scale_factor": 2.0, "add_offset": 1.0}},
        {"node_type": "group"}, {"chunk_grid": {"name": "regular", "configuration": {"chunk_shape": [20]}}},
        {"shape": [2**60]}, {"shape": [-1]}, {"shape": [20, 1]}, {"shape": []},
    )  # fmt: skip
    _metadata(_array(r, path) / "zarr.json", lambda whole: whole.update(r.choice(changes)))


def known_edited(r: random.Random, path: Path, sort: str) -> None:
    """Messages and statistics of a chunk."""
    import zarr
    from zarr.codecs import Crc32cCodec

    held = zarr.open_group(path / "more", mode="r+")
    head = {
        "messages": {r.choice(("3", "-1", "x", "99999999999999999999")): r.choice(VALUES)},
        "shapes": r.choice(([], [[]], [[[[2**62]]]], None, [[[[-1]]]], [[[[0] * 40]]])),
    }
    content = r.choice(
        (
            json.dumps(head).encode(),
            b"[" * 50_000,
            b"",
            b"\xff" * 99,
            b'{"messages": {}, "shapes": []}\n' + b"1" * 99,
        )
    )
    blob = np.frombuffer(content or b" ", dtype=np.uint8)
    held.create_array(
        str(r.randrange(5)), data=blob, chunks=blob.shape, compressors=[Crc32cCodec()], overwrite=True
    )


def consolidated(r: random.Random, path: Path, sort: str) -> None:
    """Descriptions of arrays within that of the store, which Zarr takes in place of their own."""
    own = {
        x.name: json.loads((x / "zarr.json").read_text(encoding="utf-8"))
        for x in path.iterdir()
        if x.is_dir()
    }
    entry = own[r.choice([*own])]
    entry.update(
        r.choice(
            (
                {"shape": [2**50]},
                {"codecs": [{"name": "bytes", "configuration": {"endian": "big"}}, {"name": "crc32c"}]},
            )
        )
    )
    _metadata(
        path / "zarr.json",
        lambda whole: whole.update(
            consolidated_metadata={"kind": "inline", "must_understand": False, "metadata": own}
        ),
    )


CHANGES = (
    about_edited, identity_edited, settings_edited, choice_edited, json_edited, nested, removed, cut, flipped,
    swapped, rows_moved, of_another, no_numbers, forged_verdicts, claimed, more_members, names_edited, linked,
    encoded, known_edited, consolidated,
)  # fmt: skip


# Files of NumPy


def file_of_numpy(r: random.Random) -> Outcome:
    """Change what a file of members says of itself, its arrays, or its bytes; show it, report on it, go on with it."""
    sort = r.choice([*SWEEPS])
    original, path = originals() / f"{sort}-1.npz", Path("runs.npz")
    with np.load(original) as file:
        arrays = dict(file)
    about = json.loads(str(arrays.pop("about")))
    if r.random() < 0.5:  # as if it had been interrupted
        _undo(about, arrays, r.randrange(_N))
    changed = r.random() < 0.9
    for _ in range(r.choice((1, 1, 2)) if changed else 0):
        r.choice((_about_changed, _about_changed, _array_changed))(r, about, arrays)
    with path.open("wb") as stream:
        np.savez(stream, **arrays, about=np.array(json.dumps(about)))
    if not changed:
        content = bytearray(path.read_bytes())
        for _ in range(r.choice((1, 1, 20))):
            content[r.randrange(len(content))] ^= 1 << r.randrange(8)
        path.write_bytes(content if r.random() < 0.7 else content[: r.randrange(len(content))])
    outcomes = [
        _of_file(invoke(*command))
        for command in (("sweep", "--show", path), ("report", path, "--html", "page.html"))
    ]
    done = _of_file(sweep(sort, path, "--resume"))
    if done.verdict == RIGHT or done.verdict == FLAGGED:
        with np.load(path) as found, np.load(original) as true:
            wrong = [x for x in true.files if x != "about" and found[x].tobytes() != true[x].tobytes()]
        if wrong:
            return Outcome(WRONG, f"gone on with, {wrong} are not what they are: {done.says}")
    return worst([*outcomes, done])


def _of_file(done: Outcome) -> Outcome:
    named = done.verdict != REFUSED or "runs.npz" in done.says or "the file" in done.says
    return done if named else Outcome(WRONG, f"the file is not named: {done.says}")


def _undo(about: dict, arrays: dict[str, np.ndarray], n_done: int) -> None:
    about["n_done"] = n_done
    for name, values in arrays.items():
        if name in about["series"]:
            values[n_done:] = np.nan
        elif name != "t" and name not in about["varied"]:
            values[n_done:] = 0


def _about_changed(r: random.Random, about: dict, arrays: dict[str, np.ndarray]) -> None:
    name = r.choice([*about])
    about[name] = r.choice(
        (*VALUES, *COUNTS, _N, _N - 1, _N + 1, about[r.choice([*about])], {"3": VALUES[0]})
    )
    if r.random() < 0.1:
        del about[name]


def _array_changed(r: random.Random, about: dict, arrays: dict[str, np.ndarray]) -> None:
    name = r.choice([*arrays])
    array = arrays[name]
    way = r.randrange(6)
    if way == 0:
        arrays[name] = array.astype(r.choice(("f4", "i8", "u1", "c16", "U9", "?", "M8[s]", ">f8")))
    elif way == 1:
        arrays[name] = r.choice(
            (
                array[:-1],
                array[None],
                array[..., None],
                np.zeros(0),
                np.array(3.0),
                np.tile(array, (2,) * array.ndim),
            )
        )
    elif way == 2:
        array[r.randrange(len(array)) :] = r.choice((0, 1, -5, 57))
    elif way == 3 and array.dtype.kind == "f":
        array.flat[r.randrange(array.size)] = r.choice(NUMBERS)
    elif way == 4:
        arrays[name] = array[::-1].copy()
    else:
        del arrays[name]
