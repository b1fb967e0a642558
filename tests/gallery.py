"""docs/gallery.md and its pictures, made of the bundled models: `python -m tests.gallery`.

A picture is the drawing of a report, of a state on the way; a command is run by `tests/test_gallery.py`.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import symgen
from symgen.model.library import bundled, load
from symgen.runtime.report.drawing import drawing
from symgen.runtime.report.html import drawing_style

DOCS = Path(__file__).resolve().parents[1] / "docs"
PAGE, PICTURES = DOCS / "gallery.md", DOCS / "gallery"
LARGEST = 20_000  # bytes of a picture
_WIDTH = 420  # pixels


@dataclass(frozen=True)
class Entry:
    """What is said of a model.

    Attributes
    ----------
    command : str
        To be run behind `symgen`.
    notice : str
        What to look at.
    at : float [s]
        Of the picture.
    """

    command: str
    notice: str
    at: float = 0.0


SECTIONS: dict[str, dict[str, Entry]] = {
    "Pendulums": {
        "pendulum": Entry(
            "run pendulum", "A pendulum swings the slower the further it goes; `pendulum_linear` does not."
        ),
        "pendulum_linear": Entry(
            "advise pendulum_linear --t-end 5", "The model of the course: 176 steps for 5 s."
        ),
        "pendulum_dae": Entry(
            "show pendulum_dae", "The same with a constraint: the rod's force is its multiplier."
        ),
        "pendulum_field": Entry(
            "run pendulum_field --option n=8 --t-end 2",
            "Independent subsystems are found; a note says whether each has steps of its own.",
            1.0,
        ),
        "double_pendulum": Entry(
            "check double_pendulum", "Chaos: up to when which digits can be trusted.", 0.4
        ),
        "double_pendulum_level": Entry(
            "run double_pendulum_level", "A start at which every second Taylor coefficient is zero.", 0.5
        ),
        "n_pendulum": Entry(
            "derive n_pendulum --option N=20 -o .",
            "What was derived, what was left out, and what a call costs.",
            0.5,
        ),
        "spring_pendulum": Entry(
            "run spring_pendulum --t-end 20",
            "Energy wanders between swinging and bouncing; the sum stays.",
            3.0,
        ),
        "stiff_spring_pendulum": Entry(
            "advise stiff_spring_pendulum",
            "A stiff vibration that lasts: no implicit method may damp it away.",
            1.0,
        ),
        "damped_spring_pendulum": Entry(
            "run damped_spring_pendulum",
            "With a damper `auto` takes an implicit method, and says why.",
            0.5,
        ),
        "stiff_bushing_pendulum": Entry(
            "advise stiff_bushing_pendulum --method rk4 --step 0.01",
            "A step of rk4 that the bushing forbids: exit status 3, and which parameter it is.",
            0.5,
        ),
    },
    "Linkages": {
        "four_bar": Entry("modes four_bar", "Where it rests, and how it swings about that.", 0.5),
        "slider_crank": Entry(
            "report slider_crank --quick", "M, f, G and γ as formulas, and the first numbers by hand."
        ),
        "andrews_squeezer": Entry(
            "run andrews_squeezer --rtol 1e-10",
            "A published test problem; tests compare with its end state.",
            0.02,
        ),
        "n_four_bar": Entry(
            "run n_four_bar --t-end 2", "Parallel loops in a row; the energy stays to 1e-9.", 0.5
        ),
        "bricard": Entry(
            "run bricard",
            "By counting it cannot move: a constraint that follows from the others is named.",
            1.0,
        ),
        "lattice": Entry(
            "run lattice --option N=3 --t-end 0.5", "Closed loops in absolute coordinates.", 0.5
        ),
        "chain_absolute": Entry(
            "run chain_absolute --option N=5 --t-end 1", "A pin is two equations; none drifts.", 0.5
        ),
        "car_axis": Entry(
            "run car_axis", "A constraint that moves with time does work, which the balance counts.", 0.5
        ),
    },
    "In space": {
        "free_rigid_body": Entry(
            "run free_rigid_body", "It flips over and over, and keeps energy and momentum.", 1.0
        ),
        "spinning_top": Entry("run spinning_top", "Nutation on top of precession.", 0.3),
        "heavy_top_absolute": Entry(
            "run heavy_top_absolute --t-end 0.2",
            "A quaternion and three constraints for one point that stays.",
            0.05,
        ),
        "seven_dof_arm": Entry("run seven_dof_arm", "Recursive algorithms written out as code.", 0.3),
        "humanoid_tree": Entry("run humanoid_tree --t-end 0.3", "Thirty freedoms in free fall.", 0.6),
        "stewart_platform": Entry("run stewart_platform --t-end 0.5", "Six closed loops of joints.", 0.5),
        "stewart_on_bushings": Entry(
            "run stewart_on_bushings --option legs=3 --t-end 0.2",
            "It begins in equilibrium, which is found; rubber closes what loops would.",
            0.5,
        ),
        "outer_solar_system": Entry(
            "run outer_solar_system --method gauss8 --step 100 --t-end 10000",
            "Long and symplectic: energy stays.",
            3000.0,
        ),
        "satellite": Entry("run satellite", "The gradient of gravity holds the boom upright.", 2000.0),
        "satellite_wheels": Entry(
            "run satellite_wheels",
            "Wheels turn it by a right angle, and the momentum stays where it was.",
            30.0,
        ),
    },
    "Robots": {
        "gripper_arm": Entry(
            "run gripper_arm --t-end 1",
            "From a URDF file, with motors' rotors behind gears; the second jaw mimics the first.",
            0.4,
        ),
        "quadruped": Entry(
            "run quadruped --t-end 0.5",
            "From a URDF file; contacts and friction are added in ten lines.",
            0.5,
        ),
        "achilles_leg": Entry(
            "run achilles_leg --t-end 0.5",
            "From an MJCF file; what it closes softly holds here to 1e-15.",
            0.25,
        ),
    },
    "Rolling, contact, friction": {
        "rolling_disc": Entry("run rolling_disc", "Constraints of velocities: it steers itself.", 1.0),
        "bicycle": Entry("modes bicycle", "Weave and capsize, as published.", 0.5),
        "bouncing_ball": Entry(
            "run bouncing_ball", "Impacts are found on the dense output, and counted in the energy.", 0.3
        ),
        "door_stop": Entry(
            "run door_stop", "Stop and dry friction: when it sticks is part of the result.", 0.5
        ),
        "clutch": Entry(
            "run clutch",
            "A clutch slips, locks, slips under a blow, and opens when the press lets go; what presses is an input.",
            1.2,
        ),
        "die": Entry(
            "run die", "Contact by its shape: corners that bounce and rub, until it lies on a face.", 0.45
        ),
        "newtons_cradle": Entry(
            "run newtons_cradle", "One blow after another: as many balls fly off as come.", 0.36
        ),
        "block_on_plate": Entry(
            "run block_on_plate", "Friction in a plane: it sticks in two directions, and slips in any.", 0.6
        ),
        "stick_slip": Entry("run stick_slip", "Steps end where it begins to stick or to slip.", 1.0),
        "turntable": Entry(
            "run turntable", "Rolling on what turns: no energy is lost, and it stays on the table.", 2.0
        ),
        "wheel_set": Entry(
            "run wheel_set", "Rolling holds it: energy stays, and it runs in cycloids across the slope.", 1.0
        ),
    },
    "Vehicles and control": {
        "quarter_car": Entry(
            "run quarter_car", "A stiff bushing, and a bump that no step may jump over.", 1.0
        ),
        "active_suspension": Entry(
            "run active_suspension", "An actuator that lags is a state, and a curve is the damper.", 0.6
        ),
        "rough_road": Entry("run rough_road", "A road of many sines, in the equations as they are.", 1.0),
        "engine_v6": Entry(
            "run engine_v6 --t-end 0.1",
            "One cylinder, used six times: where a stroke ends, a step ends.",
            0.04,
        ),
        "differential_car": Entry(
            "run differential_car --t-end 1",
            "The wheel on ice spins, and the other one has no more torque.",
            0.7,
        ),
        "cart_pole": Entry("run cart_pole --t-end 2", "Nobody balances it.", 0.8),
        "cart_pole_lqr": Entry(
            "run cart_pole_lqr", "A sampled regulator, made from the linearised model.", 0.3
        ),
        "crane": Entry(
            "run crane", "Ropes that grow tight and slack: forces with kinks, found on the way.", 1.0
        ),
        "rack_and_pinion": Entry(
            "run rack_and_pinion",
            "How long the tie rods must be for the wheels to run straight is found at the start.",
            1.2,
        ),
        "belt_drive": Entry(
            "run belt_drive",
            "A current, an elastic belt and a crossed one; the tight run and the slack one.",
            1.5,
        ),
        "engine_mounts": Entry("run engine_mounts", "Bushings between frames, with masses from shapes.", 0.5),
        "spring_chain": Entry(
            "run spring_chain --t-end 0.5", "Stiff springs: a note says which method was taken, and why.", 0.4
        ),
    },
}


def sections() -> dict[str, dict[str, Entry]]:
    """Return the sections, the last one with the models of which nothing is said above."""
    named = {name for section in SECTIONS.values() for name in section}
    rest = {
        name: Entry(f"run {name}", "It runs, and its checks pass.") for name in bundled() if name not in named
    }
    return SECTIONS | ({"More": rest} if rest else {})


def entries() -> dict[str, Entry]:
    """Return all of them by the names of models."""
    return {name: entry for section in sections().values() for name, entry in section.items()}


def page() -> str:
    """Return docs/gallery.md."""
    files, lines = bundled(), [
        "# Gallery",
        "",
        "Bundled models as `symgen report` draws them. `python -m tests.gallery` made this; a test runs the commands.",
    ]  # fmt: skip
    for title, section in sections().items():
        lines += ["", f"## {title}"]
        for name, entry in section.items():
            about = " ".join(load(files[name], {}).describe().description.split()).rstrip(".")
            lines += ["", f"### {name}", "", f"![{name}](gallery/{name}.svg)", "", f"{about}.", "",
                      f"`symgen {entry.command}`: {entry.notice}"]  # fmt: skip
    return "\n".join(lines) + "\n"


def picture(name: str, at: float) -> str:
    """Return the drawing of a model at a time, as a file of its own."""
    system = symgen.load(name)
    run = system.run(t_end=at or "1 ns", rtol=1e-6)
    drawn = drawing(system, run.p, float(run.t[-1]), run.states[-1])
    if not drawn:
        raise ValueError(f"{name} has no drawing")
    opened = drawn.replace("<svg ", f'<svg xmlns="http://www.w3.org/2000/svg" width="{_WIDTH}" ', 1)
    opened = re.sub(r'aria-label="[^"]*"', f'aria-label="{name}"', opened, count=1)
    return opened.replace(">", f"><style>{drawing_style()}</style>", 1) + "\n"


def write(all_pictures: bool = True) -> None:
    """Write the page, and all pictures or those that are missing."""
    PICTURES.mkdir(exist_ok=True)
    for model, said in entries().items():
        target = PICTURES / f"{model}.svg"
        if all_pictures or not target.is_file():
            target.write_text(picture(model, said.at), encoding="utf-8")
    PAGE.write_text(page(), encoding="utf-8")


if __name__ == "__main__":
    write()
