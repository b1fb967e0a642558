"""Savings of scenes that fall apart into independent subsystems."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from savings.measure import SOURCE, Row, bundled, by_turns, calls, compared, difference, replaced, runs
from savings.process import compile_anew
from symgen.derive import pipeline
from symgen.derive.scenes import subsystems
from symgen.emit.module import emit
from symgen.link import derive as system_of
from symgen.model.library import find
from symgen.model.library import load as load_model
from symgen.model.model import Model
from symgen.runtime import System, load, solve
from symgen.runtime.subsystems import simulate as apart
from symgen.runtime.subsystems import subsystem
from symgen.runtime.subsystems import subsystem as member_run


def equal_subsystems() -> Iterator[Row]:
    """Equal subsystems derived once, their functions written as loops."""
    description = load_model(find("pendulum_field"), {"n": "100"}).describe()
    ways = subsystems.derive, pipeline.derive
    texts = [lambda way=way: emit(way(description, SOURCE)) for way in ways]
    systems = [load(text()) for text in texts]
    values, seconds = calls(*systems)
    same = difference(*values)
    yield Row("pendulum_field, 100", "equal subsystems derived once", *by_turns(*texts, repeats=3), same)
    compiled = by_turns(*(lambda s=s: compile_anew(s, ["rhs", "energy"]) for s in systems), repeats=3)
    yield Row("pendulum_field, 100", "equal subsystems compiled once", *compiled, same)
    yield Row("pendulum_field, 100, rhs", "equal subsystems as loops", *seconds, same)


def own_steps() -> Iterator[Row]:
    """Independent subsystems integrated by themselves."""
    system = bundled("pendulum_field", n="1000", stiff="true")
    options = {"t_end": 5.0, "fps": 6.0}
    solutions, seconds = runs((system, options), (system, {**options, "split": False}), repeats=3)
    yield Row(
        "pendulum_field, 1000, one stiff",
        "subsystems with steps of their own",
        *seconds,
        compared(*solutions),
    )


def in_lanes() -> Iterator[Row]:
    """Equal subsystems in the lanes of vector registers, each with steps of its own."""
    system = bundled("pendulum_field", n="1000")
    for method in ("taylor", "dop853"):
        options = {"t_end": 10.0, "fps": 6.0, "method": method, "split": True}

        def alone(options=options):
            with replaced(apart, grouped=lambda found, settings: list(found)):
                return solve(system, **options)

        together = solve(system, **options)
        seconds = by_turns(lambda o=options: solve(system, **o), alone, repeats=3)
        same = compared(together, alone())
        yield Row(f"pendulum_field, 1000, {method}", "equal subsystems in lanes", *seconds, same)


def twins() -> Iterator[Row]:
    """Subsystems that start and move alike integrated once; without, all starts differ in their last bits."""
    system = bundled("pendulum_field", n="200", equal="true")
    names = [record["name"] for record in system.coordinates]
    bits = np.arange(len(names)) * np.spacing(0.3)
    apart_by_bits = {name: 0.3 + bit for name, bit in zip(names, bits.tolist(), strict=True)}
    options = {"t_end": 10.0, "fps": 6.0, "split": True}
    solutions, seconds = runs((system, options), (system, {**options, "start": apart_by_bits}), repeats=3)
    yield Row("pendulum_field, 200 equal ones", "twins integrated once", *seconds, compared(*solutions))


def resting(n: int) -> System:
    """Weights on springs of their own, all but one in equilibrium."""
    model = Model("resting")
    model.parameters(m=0.3, g=9.81)
    for i in range(n):
        k = model.parameter(f"k{i}", 50.0 + i)
        z = model.coordinate(f"z{i}", start=0.1 if i == 0 else 0.0)
        model.kinetic(f"m/2*dot({z})**2")
        model.potential(f"{k}/2*({z} + m*g/{k})**2 - m*g*{z}")
    return system_of(model)


def asleep() -> Iterator[Row]:
    """Subsystems at rest in stable equilibrium sleep."""
    system, options = resting(100), {"t_end": 20.0, "fps": 6.0, "split": True}

    def awake():
        never = {"is_at_rest": lambda *_, **__: False}
        with replaced(subsystem, **never), replaced(member_run, **never):
            return solve(system, **options)

    seconds = by_turns(lambda: solve(system, **options), awake, repeats=3)
    yield Row(
        "100 weights on springs, 99 at rest",
        "asleep at rest",
        *seconds,
        compared(solve(system, **options), awake()),
    )


CASES = (equal_subsystems, own_steps, in_lanes, twins, asleep)
