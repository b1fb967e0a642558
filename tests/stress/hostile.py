"""Files and arguments of strangers: forged recordings, planted modules, odd models and tables, outputs over inputs.

Each scenario changes something at random, by its seed, and then does what a user would do with it. Right is a result
that agrees with what it must be, refused a sentence and exit status 1 or 2, flagged status 3. A traceback ("internal
error"), a process that dies, one that does not end, and a file of the user that was changed are none of these.
"""

from __future__ import annotations

import functools
import hashlib
import json
import os
import random
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from .scenario import CRASH, FLAGGED, REFUSED, RIGHT, WRONG, Outcome, Scenario

ROOT = Path(__file__).resolve().parents[2]
_SHORT, _LONG = 2, 200  # scenarios of each kind
_LIMIT = 200.0  # seconds; step loops may have to be compiled
_T_END = 5.0
_MEMORY = 6 << 30  # bytes of address space above what the process has
NUMBERS = (np.nan, np.inf, -np.inf, 0.0, -0.0, -1.0, 1e300, -1e300, 1e-300, 5e-324, 1e18, 0.5, 3.0)
COUNTS = (-1, 0, 1, 2, 7, 10**9, 2**62, -(2**63))
TEXTS = (
    "",
    "../../x",
    "/etc/x",
    "a\x1b[31mb",
    "\u202e",
    "x" * 10_000,
    "nan",
    "1e999",
    "__import__",
    "a b",
    "lambda",
)
VALUES = (None, True, [], {}, [[]], {"a": 1}, -1, 1e308, 10**40, *TEXTS)
RUNS = (
    ("pendulum", {"method": "taylor"}), ("pendulum", {"method": "bdf"}), ("pendulum", {"method": "verlet"}),
    ("double_pendulum", {"method": "radau5"}), ("pendulum_dae", {"method": "dop853"}),
    ("pendulum_dae", {"method": "dop853", "constraints": "partition"}), ("bouncing_ball", {"method": "dopri5"}),
    ("pendulum", {"method": "gauss8"}), ("double_pendulum", {"method": "radau9"}),
    ("pendulum", {"method": "generalized_alpha"}), ("stick_slip", {"method": "dop853"}),
)  # fmt: skip


def scenarios() -> Iterator[Scenario]:
    """All of them; the first few of each kind belong to the test suite."""
    kinds: dict[str, Callable[[random.Random], Outcome]] = {
        "hostile checkpoints": checkpoint,
        "hostile recordings": recording,
        "hostile bytes": damaged_bytes,
        "hostile modules": module,
        "hostile models": model,
        "hostile tables": table,
        "hostile outputs": outputs,
    }
    for kind, run in kinds.items():
        for seed in range(_LONG):
            yield Scenario(
                kind, f"{kind} {seed}", functools.partial(bounded, run, kind, seed),
                short=seed < _SHORT, limit=_LIMIT,
            )  # fmt: skip


def bounded(run: Callable[[random.Random], Outcome], kind: str, seed: int) -> Outcome:
    """Run within a folder of its own and limited memory."""
    import resource

    before, here = resource.getrlimit(resource.RLIMIT_AS), Path.cwd()
    used = int(Path("/proc/self/statm").read_text().split()[0]) * os.sysconf("SC_PAGE_SIZE")
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        resource.setrlimit(resource.RLIMIT_AS, (used + _MEMORY, before[1]))
        try:
            return run(random.Random(f"{kind} {seed}"))
        finally:
            resource.setrlimit(resource.RLIMIT_AS, before)
            os.chdir(here)


def invoke(*arguments: Any) -> Outcome:
    """What the command line makes of it."""
    from click.testing import CliRunner

    from symgen.cli import main

    done = CliRunner().invoke(main, [str(argument) for argument in arguments])
    said = done.output[-2000:].replace("\n", " ")
    if done.exception is not None and not isinstance(done.exception, SystemExit):
        return Outcome(CRASH, f"{type(done.exception).__name__}: {done.exception}")
    if "internal error" in done.output or "Traceback" in done.output:
        return Outcome(CRASH, said)
    if any((ord(x) < 0x20 and x not in "\n\t\r") or 0x7F <= ord(x) < 0xA0 for x in done.output):
        return Outcome(WRONG, f"control characters are shown: {said!r}")
    if done.exit_code in (1, 2):
        return Outcome(REFUSED if "rror" in done.output else WRONG, said)
    return Outcome({0: RIGHT, 3: FLAGGED}.get(done.exit_code, WRONG), said)


def _text(name: str) -> str:
    return (ROOT / "generated" / f"{name}.py").read_text(encoding="utf-8")


def recorded(
    path: Path, name: str, options: dict[str, Any], forge: Callable[[bytes], bytes] | None = None
) -> Any:
    from recorded import record

    from symgen.runtime import load, solve

    return record(
        path,
        _text(name),
        lambda **more: solve(load(_text(name)), _T_END, max_steps=4, **options, **more),
        forge,
    )


def worst(outcomes: list[Outcome]) -> Outcome:
    order = (RIGHT, FLAGGED, REFUSED, WRONG, CRASH)
    return max(outcomes, key=lambda outcome: order.index(outcome.verdict))


# Checkpoints


def checkpoint(r: random.Random) -> Outcome:
    """Change numbers, types, lengths or facts of a checkpoint, sign it as a stranger can, and go on from it."""
    from symgen.runtime import load, solve
    from symgen.runtime.checkpoint_bytes import Checkpoint
    from symgen.runtime.errors import RuntimeModelError
    from symgen.runtime.recording.resume import Resumed

    name, options = r.choice(RUNS)
    change = r.choice((_private, _number, _number, _length, _fact, _fact))

    def forge(content: bytes) -> bytes:
        found = Checkpoint.from_bytes(content)
        for _ in range(1 if change is _private else r.randint(1, 3)):
            change(r, found)
        return found.to_bytes()

    path = Path("run.rrd")
    recorded(path, name, options, forge)
    try:
        run = Resumed(path).run(max_steps=20_000)
    except RuntimeModelError as error:
        return Outcome(REFUSED if str(path) in str(error) else WRONG, str(error))
    if change is not _private:  # a state may be changed to another one that a run can have
        return Outcome(RIGHT if run.ok else FLAGGED, run.message)
    whole = solve(load(_text(name)), _T_END, **options)
    off = float(np.abs(run.q[-1] - whole.q[-1]).max())
    return Outcome(RIGHT if run.status == whole.status and off < 1e-4 else WRONG, f"off by {off:.1e}")


def _private(r: random.Random, found: Any) -> None:
    """What only the step loop understands: nothing of it may be used."""
    found.arrays["counters"][16:] = r.choice(COUNTS)
    for name in ("work", "dense", "f", "guard", "tail"):
        found.arrays[name][...] = r.choice(NUMBERS)


def _number(r: random.Random, found: Any) -> None:
    array = found.arrays[r.choice([*found.arrays])]
    if array.size:
        kinds = NUMBERS if array.dtype.kind == "f" else COUNTS if array.dtype.itemsize == 8 else (0, 1, 255)
        array.flat[r.randrange(array.size)] = r.choice(kinds)


def _length(r: random.Random, found: Any) -> None:
    name = r.choice([*found.arrays])
    array = found.arrays[name]
    found.arrays[name] = r.choice(
        (array[:0], np.append(array, array), array.astype(np.uint8), array[None], np.zeros(0, dtype=np.int64))
    )
    if r.random() < 0.3:
        del found.arrays[name]


def _fact(r: random.Random, found: Any) -> None:
    name = r.choice([*found.facts])
    found.facts[name] = r.choice((*VALUES, *(x for x in NUMBERS), r.choice([*found.facts.values()])))
    if r.random() < 0.2:
        del found.facts[name]


# Recordings


def recording(r: random.Random) -> Outcome:
    """Forge settings, names, the module or columns while a recording is written, with checksums that agree."""
    from symgen.runtime.recording.rrd.write import RrdWriter

    name, options = r.choice(RUNS)
    properties, columns = RrdWriter.property, RrdWriter.columns
    key = r.randrange(12)

    def forged_property(self: Any, of: str, values: dict[str, Any]) -> None:
        values = dict(values)
        chosen = sorted(values)[key % max(1, len(values))] if values else ""
        old = values.get(chosen)
        if isinstance(old, str) and old.startswith(("{", "[")):
            values[chosen] = _forged_json(r, old)
        elif chosen == "module_text":
            values[chosen] = _edited(r, old)
        elif isinstance(old, str):
            values[chosen] = r.choice(TEXTS)
        elif isinstance(old, (int, float)):
            values[chosen] = float(r.choice(NUMBERS))
        properties(self, of, values)

    def forged_columns(self: Any, path: str, archetype: str, arrays: dict[str, Any]) -> None:
        arrays = dict(arrays)
        for each in arrays:
            if r.random() < 0.3 and isinstance(arrays[each], np.ndarray) and arrays[each].dtype == float:
                arrays[each] = _forged_column(r, arrays[each])
        columns(self, path, archetype, arrays)

    path = Path("run.rrd")
    by_columns = r.random() < 0.4
    try:
        if by_columns:
            RrdWriter.columns = forged_columns
        else:
            RrdWriter.property = forged_property
        try:
            recorded(path, name, options)
        except Exception as error:  # what cannot even be written is no recording
            return Outcome(REFUSED, f"cannot be written: {error}")
    finally:
        RrdWriter.property, RrdWriter.columns = properties, columns
    return _used(path, r)


def _forged_json(r: random.Random, text: str) -> str:
    data = json.loads(text)
    if isinstance(data, dict) and data:
        data[r.choice([*data])] = r.choice(VALUES)
    return r.choice((json.dumps(data), "[" * 5000, "{}", "null", text[:-1], '{"at": 1}'))


def _forged_column(r: random.Random, array: np.ndarray) -> np.ndarray:
    array = array.copy()
    if r.random() < 0.3:
        return array[:, : max(1, array.shape[1] - 1)]
    if array.size:
        array.flat[r.randrange(array.size)] = r.choice(NUMBERS)
    return array


def _used(path: Path, r: random.Random) -> Outcome:
    """What the commands that read recordings make of one; only what belongs to the folder may change."""
    outside = Path.cwd().parent
    before = set(outside.iterdir())
    commands = [
        ("verify", path),
        ("compare", path, path),
        ("run", "--resume", path, "--t-end", "6", "--log", "next.rrd", "--quiet"),
        ("report", path, "--quick"),
        ("advise", "--at", f"{path}@0.0"),
    ]
    digest = hashlib.sha256(path.read_bytes()).digest()
    outcomes = [invoke(*command) for command in r.sample(commands, 3)]
    if hashlib.sha256(path.read_bytes()).digest() != digest:
        return Outcome(WRONG, "the recording was changed")
    new = [x.name for x in set(outside.iterdir()) - before if x.suffix in (".html", ".rrd", ".json", ".png")]
    return Outcome(WRONG, f"written outside the folder: {new}") if new else worst(outcomes)


def damaged_bytes(r: random.Random) -> Outcome:
    """Flip, cut, repeat and insert bytes of a recording."""
    path = Path("run.rrd")
    recorded(path, *r.choice(RUNS[:5]))
    content = bytearray(path.read_bytes())
    for _ in range(r.choice((1, 1, 3, 20))):
        place, length = r.randrange(len(content)), r.choice((1, 4, 100, 5000))
        change = r.randrange(4)
        if change == 0:
            content[place] = r.randrange(256)
        elif change == 1:
            del content[place : place + length]
        elif change == 2:
            content[place:place] = content[:length]
        else:
            content[place : place + 8] = r.choice(COUNTS).to_bytes(8, "little", signed=True)
    path.write_bytes(content)
    return _used(path, r)


# Modules


def module(r: random.Random) -> Outcome:
    """Edit the text of a generated module; what is accepted gives what it says as plain Python."""
    from symgen.runtime import load
    from symgen.runtime.errors import RuntimeModelError

    text = _edited(r, _text(r.choice(("pendulum", "bouncing_ball", "slider_crank", "double_pendulum"))))
    Path("x.py").write_text(text, encoding="utf-8")
    try:
        system = load("x.py")
        p, y = system.parameter_values(), np.linspace(0.1, 0.9, system.nq + system.nv)
        for name in ("rhs", "energy"):
            out, plain_out = (np.zeros(system.kernel(name).out_size) for _ in range(2))
            system.kernel(name)(0.3, y, p, out)
            try:
                system.python_function(name)(0.3, y, p, plain_out)
            except (ArithmeticError, ValueError):  # where machine code gives nan or inf
                continue
            if not np.allclose(out, plain_out, rtol=1e-9, atol=1e-9, equal_nan=True):
                return Outcome(WRONG, f"{name}: {out} as machine code, {plain_out} in Python")
    except (RuntimeModelError, MemoryError) as error:
        return Outcome(
            REFUSED if "x.py" in str(error) or isinstance(error, MemoryError) else WRONG, str(error)
        )
    return Outcome(RIGHT, "the same in Python")


_LINES = (
    "    out[0] = out[1]",
    "    out[99999999] = 1.0",
    "    c0 = y[-1]",
    "    for k in range(1000000000000):\n        c0 = 1.0",
    "    for k in range(60000000):\n        z0 = z0 + 1.0",
    "    w = [0.0]*100000000000",
    "    out[0] = open('/etc/passwd')",
    "    import os",
    "    while True: pass",
    "    x = 9**9**9",
    "    out[0] = p[10**9]",
    "    y[0] = 1.0",
    "    del out",
)


def _edited(r: random.Random, text: str) -> str:
    lines = text.split("\n")
    for _ in range(r.choice((1, 1, 2, 5))):
        place = r.randrange(len(lines))
        change = r.randrange(6)
        if change == 0:
            lines.insert(place, r.choice(_LINES))
        elif change == 1:
            del lines[place]
        elif change == 2:
            lines[place] = _swapped_number(r, lines[place])
        elif change == 3:
            lines.insert(place, lines[r.randrange(len(lines))])
        elif change == 4:
            lines[place] = lines[place].replace("'", '"').replace("y[", "p[")
        else:
            lines[place] = lines[place].replace('"', f'"{r.choice(TEXTS)[:50]}', 1)
        lines = lines or [""]
    return "\n".join(lines)


def _swapped_number(r: random.Random, line: str) -> str:
    digits = [k for k, x in enumerate(line) if x.isdigit()]
    if not digits:
        return line
    k = r.choice(digits)
    return line[:k] + r.choice(("0", "9", "99999999999", "-1", "1e999", "2", "0x10")) + line[k + 1 :]


# Models and tables


def model(r: random.Random) -> Outcome:
    """Edit a TOML model and run it."""
    name = r.choice(("pendulum", "bouncing_ball", "slider_crank", "cart_pole"))
    lines = (ROOT / "models" / f"{name}.toml").read_text(encoding="utf-8").split("\n")
    odd = (
        "[x]", "a" + ".a" * 20_000 + " = 1", 'name = "../../x"', 'description = "\\u001b[31m\\u202e"', "[[bodies]]",
        "x = " + "[" * 3000, f'"{"k" * 5000}" = 1', "[parameters]", "t = 1", "m = 1e400", 'm = "1 parsec"', "= = =",
    )  # fmt: skip
    swaps = ("**9**9**9", "+((((", '"', "sin", "1e308*", "\x00", "dot(dot(", "é", ".", "= -", "[", "_", "0")
    for _ in range(r.choice((1, 1, 2, 4))):
        place = r.randrange(len(lines))
        if r.random() < 0.4:
            lines.insert(place, r.choice(odd))
        else:
            k = r.randrange(len(lines[place]) + 1)
            lines[place] = lines[place][:k] + r.choice(swaps) + lines[place][k + r.randrange(3) :]
    Path("m.toml").write_text("\n".join(lines), encoding="utf-8")
    done = invoke("run", "m.toml", "--t-end", "0.2", "--no-log", "--quiet", "--method", "dopri5")
    if done.verdict == REFUSED and "m.toml" not in done.says:
        return Outcome(WRONG, f"the file is not named: {done.says}")
    return done


def table(r: random.Random) -> Outcome:
    """Edit a table of an input, or give something that is none."""
    rows = [f"{0.1 * k:.2f}, {r.random():.3f}" for k in range(20)]
    for _ in range(r.choice((1, 3))):
        rows[r.randrange(20)] = r.choice(
            (
                "nan, 1",
                "1",
                "1,2,3",
                "a, b",
                "\x00\x00",
                "1e999, 0",
                "0, 0",
                "",
                "é, ü",
                "9" * 5000,
                "0.1;0.2",
                "#",
                "-1,0",
            )
        )
    content = "\n".join(rows).encode()
    if r.random() < 0.3:
        content = bytes(r.randrange(256) for _ in range(300))
    name = r.choice(("t.csv", "t.csv", "t.csv", "/dev/zero", "/dev/null", "pipe", "folder", "missing.csv"))
    Path("t.csv").write_bytes(content)
    os.mkfifo("pipe")
    Path("folder").mkdir()
    done = invoke("run", "cart_pole", "--t-end", "0.5", "--no-log", "--quiet", "--input", f"F={name}")
    if done.verdict == REFUSED and name not in done.says:
        return Outcome(WRONG, f"the file is not named: {done.says}")
    return done


# Outputs


def outputs(r: random.Random) -> Outcome:
    """Name files that are there, and links to them, as outputs: not one of them may change."""
    toml = (ROOT / "models" / "pendulum.toml").read_text(encoding="utf-8")
    Path("m.toml").write_text(toml, encoding="utf-8")
    Path("pendulum.py").write_text("precious = 1\n", encoding="utf-8")
    Path("notes.txt").write_text("precious", encoding="utf-8")
    Path("soft").symlink_to("m.toml")
    os.link("m.toml", "hard")
    Path("below").mkdir()
    Path("below/up").symlink_to("..")
    recorded(Path("run.rrd"), *RUNS[1])
    os.link("run.rrd", "same")
    targets = [
        "m.toml",
        "soft",
        "hard",
        "below/up/m.toml",
        "./below/../hard",
        "run.rrd",
        "same",
        "pendulum.py",
        "new",
    ]
    inputs = {name: Path(name).read_bytes() for name in ("m.toml", "pendulum.py", "notes.txt")}
    first, second = r.choice(targets), r.choice(targets)
    command = r.choice((
        ("run", "m.toml", "--t-end", "0.2", "--log", first, "--json", second),
        ("run", "m.toml", "--t-end", "0.2", "--no-log", "--json", first),
        ("derive", "m.toml", "-o", r.choice((".", "below/up")), "--json", first),
        ("report", "m.toml", "--t-end", "0.2", "--quick", "--html", first),
        ("check", "m.toml", "--t-end", "0.2", "--json", first),
        ("modes", "m.toml", "--json", first, "--log", second),
        ("advise", "m.toml", "--t-end", "0.2", "--json", first),
        ("verify", "run.rrd", "--json", first),
        ("compare", "run.rrd", "same", "--json", first),
        ("run", "--resume", "run.rrd", "--t-end", "6", "--log", first, "--json", second),
    ))  # fmt: skip
    read = {"run.rrd"} if "run.rrd" in command[1:3] and command[0] != "run" else set()
    before = {name: Path(name).read_bytes() for name in read}
    done = invoke(*command)
    for name, content in (inputs | before).items():
        if Path(name).read_bytes() != content:
            return Outcome(WRONG, f"{' '.join(command)} has written over {name}")
    return done
