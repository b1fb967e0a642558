"""Make the bitcode of step loops that travels with the package (`runtime/code/shipped.py`).

`python -m tests.ship_loops` runs every method with every form of constraints on models of each kind, compiles with
Numba what they call, and writes `runtime/code/loops/`; files whose sources have not changed are kept. With `--all`
every file is made anew; with `--check` nothing is written, and files that would be others are named.
"""

from __future__ import annotations

import argparse
import contextlib
import functools
import importlib
import math
import os
import pkgutil
import sys
import tempfile
import warnings
from collections.abc import Iterator
from pathlib import Path

import symgen.runtime
from symgen import Model, cos, dot, mod, sign, sin, t, where
from symgen.link import derive
from symgen.model.library import find
from symgen.model.library import load as load_model
from symgen.runtime import System, load
from symgen.runtime.code import jitted, shipped
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.integrate.forms import FORMS
from symgen.runtime.integrate.methods import METHODS

GENERATED = Path(__file__).resolve().parents[1] / "generated"
# Open and closed, with quaternions, events, contacts, inputs, dependent constraints, several subsystems.
MODELS = (
    "double_pendulum", "slider_crank", "free_rigid_body", "bouncing_ball", "stick_slip", "cart_pole_lqr",
    "rolling_disc", "bricard", "pendulum_field", "rough_road", "heavy_top_absolute",
)  # fmt: skip
_NEARLY_IN_LINE = (0.7, 0.72, 0.69)  # angles of three bars
_LINKS = 120  # so many absolute bodies take the sparse solvers


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.ship_loops", description=__doc__)
    parser.add_argument("--all", action="store_true", help="make every file anew")
    parser.add_argument(
        "--check", action="store_true", help="write nothing; name the files that would be others"
    )
    chosen = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        made = make(Path(folder), anew=chosen.all or chosen.check)
        kept = {path.name: path.read_bytes() for path in shipped.FOLDER.glob("*.xz")}
        changed = sorted(name for name in made.keys() | kept.keys() if made.get(name) != kept.get(name))
        for name in changed:
            print("new" if name not in kept else "gone" if name not in made else "changed", name)
            if chosen.check:
                continue
            (shipped.FOLDER / name).unlink(missing_ok=True)
            if name in made:
                (shipped.FOLDER / name).write_bytes(made[name])
        if not chosen.check:
            shipped.write_files(shipped.FOLDER, files_of_loops())
    print(f"{len(made)} loops, {sum(map(len, made.values())) / 1e6:.2f} MB; {len(changed)} of them changed")
    return 1 if changed and chosen.check else 0


@functools.cache
def loops() -> dict[str, list[jitted.Jitted]]:
    """Return the jitted functions of the package by their names; some have one in common."""
    found: dict[str, list[jitted.Jitted]] = {}
    for module in pkgutil.walk_packages(symgen.runtime.__path__, "symgen.runtime."):
        try:
            names = vars(importlib.import_module(module.name))
        except ModuleNotFoundError as missing:
            if missing.name.startswith("symgen"):
                raise
            continue  # a module for the package of an extra has no step loops
        for value in names.values():
            if isinstance(value, jitted.Jitted) and value not in found.setdefault(shipped.name(value), []):
                found[shipped.name(value)].append(value)
    return found


def is_current(path: Path) -> bool:
    """Whether a file of bitcode is of the sources of the package."""
    (title, layout, made_of), _ = shipped.read(path)
    return any(
        made_of == shipped.sources(loop) and path.name == shipped.file_name(loop, layout)
        for loop in loops().get(title, ())
    )


def files_of_loops() -> dict[str, str]:
    """Return what is known of the files of Python that each file of bitcode is made of, by its name."""
    found = {}
    for path in shipped.FOLDER.glob("*.xz"):
        (title, _, made_of), _ = shipped.read(path)
        for loop in loops().get(title, ()):
            if made_of == shipped.sources(loop):
                found[path.name] = shipped.as_written(loop)
    return found


def make(folder: Path, *, anew: bool) -> dict[str, bytes]:
    """Return the content of each file, by its name, after running all that calls a step loop."""
    current = [] if anew else [path for path in shipped.FOLDER.glob("*.xz") if is_current(path)]
    made = {path.name: path.read_bytes() for path in current}

    def keep(function: jitted.Jitted, layout: str, content: bytes) -> None:
        if function.py_func.__module__.startswith("symgen.runtime."):
            path = shipped.write(folder, function, layout, content)
            made[path.name] = path.read_bytes()

    os.environ["SYMGEN_CACHE_DIR"] = str(folder / "cache")
    (folder / "cache").mkdir(mode=0o700)
    jitted.watcher, jitted.with_shipped = keep, not anew
    try:
        for what, run in runs():
            print(what, file=sys.stderr)
            with contextlib.suppress(RuntimeModelError), warnings.catch_warnings():
                warnings.simplefilter("ignore")
                run()
    finally:
        jitted.watcher, jitted.with_shipped = None, True
    return made


def runs() -> Iterator[tuple[str, object]]:
    """Yield a name and a call for every run that has a part."""
    for model in MODELS:
        yield from _of_every_method(load(GENERATED / f"{model}.py"), model, 0.05)
    large = _chain()
    for method in (
        "dop853", "radau5", "radau9", "radau13", "bdf", "generalized_alpha", "implicit_midpoint", "gauss8",
    ):  # fmt: skip
        yield f"chain {method}", lambda method=method: large.run(t_end=0.01, method=method)
    yield "chain index3", lambda: large.run(t_end=0.01, constraints="index3", step=1e-3)
    for model in ("double_pendulum", "slider_crank"):
        yield f"prepared {model}", lambda model=model: load(GENERATED / f"{model}.py").prepare(0.05)()
    # Machine code acts on frictions and jumps from the second or third on.
    yield "frictions", lambda: load(GENERATED / "stick_slip.py").run(t_end=3.0, method="dop853")
    for beside in ("nothing", "a record", "a friction"):
        yield f"jumps, {beside}", lambda beside=beside: _with_a_jump(beside).run(t_end=10.0, method="dop853")
    yield "end at a jump", lambda: _jump_at_the_end().run(t_end=1.0, method="dop853")
    yield "nearly flat loop", lambda: _nearly_flat().run(t_end=0.01, method="dop853")
    for model in MODELS:
        yield f"modes {model}", load(GENERATED / f"{model}.py").modes


def _of_every_method(system: System, model: str, t_end: float) -> Iterator[tuple[str, object]]:
    for method in METHODS:
        for form in ("projection", *FORMS):
            yield (
                f"{model} {method} {form}",
                lambda method=method, form=form: (
                    system.run(t_end=t_end, method=method, constraints=form).health
                ),
            )


def _with_a_jump(beside: str) -> System:
    """A mass on a spring whose force jumps where it crosses its place of rest."""
    m = Model("jump")
    x = m.coordinate("x", start=3.0)
    m.kinetic(dot(x) ** 2 / 2)
    m.potential(2 * x**2)
    m.force(x, -sign(x) / 100)
    if beside == "a record":
        m.event("passes", x - 0.1)
    if beside == "a friction":
        m.friction("rubs", coordinate=x, force=0.1)
    return derive(m)


def _jump_at_the_end() -> System:
    """A pendulum by a constraint whose force jumps where the run ends: the step there is projected by itself."""
    m = Model("jump_at_the_end", gravity=(0, -9.81))
    x, y = m.coordinate("x", start=1.0), m.coordinate("y", guess=0.0)
    m.body("bob", mass=1.0, com=(x, y))
    m.constraint("rod", x**2 + y**2 - 1)
    m.force(x, where(mod(t, 1) > 0.5, 1.0, 0.0))
    return derive(m)


def _nearly_flat() -> System:
    """A loop of three bars that begins nearly in line: its accelerations are refined."""
    model, x, y = Model("nearly_flat", gravity=(0, -9.81)), 0, 0
    for k, start in enumerate(_NEARLY_IN_LINE):
        a = model.coordinate(f"a{k}", **({"start": start} if k == 0 else {"guess": start}))
        x, y = x + cos(a), y + sin(a)
        model.body(f"bob{k}", mass=1.0, com=(x - cos(a) / 2, y - sin(a) / 2), inertia=0.1, angle=a)
    model.constraint("closes_x", x - sum(map(math.cos, _NEARLY_IN_LINE)))
    model.constraint("closes_y", y - sum(map(math.sin, _NEARLY_IN_LINE)))
    return derive(model)


def _chain() -> System:
    return derive(load_model(find("chain_absolute"), {"N": str(_LINKS)}))


if __name__ == "__main__":
    raise SystemExit(main())
