"""Names and numbers of a robot's file in a model: free names near to the file's, numbers as parameters."""

from __future__ import annotations

import fnmatch
import re
from collections.abc import Iterable

from ..errors import ModelError
from ..model.joint_types import ANGULAR_VELOCITY, TYPES
from ..model.model import Model
from ..model.names import LONGEST_NAME, name_fault

WORLD = "world"
_SHORTER = 3  # digits that a number without round-off has less


class Naming:
    """Takes names and makes parameters in one model.

    Parameters
    ----------
    model : Model
    file : str
        For errors.
    expose : iterable of str, optional
        Patterns of numbers that become parameters, `SOURCE.key`; without them all do that are not zero.
    """

    def __init__(self, model: Model, file: str, expose: Iterable[str] | None) -> None:
        self._model, self._file = model, file
        self._patterns = None if expose is None else list(expose)
        self._matched: set[str] = set()
        self._taken = {WORLD}  # in lower case

    @property
    def is_chosen(self) -> bool:
        """Whether only some numbers become parameters."""
        return self._patterns is not None

    def name(self, source: str, joint_type: str = "") -> str:
        """A name of the model for one of the file; it is free, and so is what a joint of this name makes."""
        stem = identifier(source)
        name, number = stem, 2
        while (
            not self._taken.isdisjoint(made := _made_names(name, joint_type)) or name_fault(name) is not None
        ):
            name, number = f"{stem}_{number}", number + 1
        self._taken |= made
        return name

    def vector(self, source: str) -> str:
        """A name for a point or an axis, whose components are free names, too."""
        stem = identifier(source)
        name, number = stem, 2
        while not self._taken.isdisjoint(made := {name.lower(), *(f"{name}_{c}".lower() for c in "xyz")}):
            name, number = f"{stem}_{number}", number + 1
        self._taken |= made
        return name

    def number(self, source: str, key: str, value: float, unit: str) -> float | str:
        """A number of something in the file: a parameter's name where it is exposed, itself otherwise."""
        value, exposed = short(value), value != 0
        if self._patterns is not None:
            fitting = [p for p in self._patterns if fnmatch.fnmatchcase(f"{source}.{key}", p)]
            self._matched.update(fitting)
            exposed = bool(fitting)
        if not exposed:
            return value
        name = self.name(f"{source}_{key}")
        self._model.parameter(name, value, f"{key} of {source!r:.60}", unit)
        return name

    def check_patterns(self) -> None:
        """Refuse patterns that fitted nothing."""
        for pattern in self._patterns or ():
            if pattern not in self._matched:
                raise ModelError(
                    f"{pattern[:60]!r} fits no number of the robot", file=self._file, key="expose",
                    hint="numbers are LINK.mass, .com_x, .Ixx and the like, JOINT.damping, .friction, .armature",
                )  # fmt: skip


def short(value: float) -> float:
    """A number without the round-off of how it came about: 0.85 in place of 0.8500000000000001."""
    rounded = float(f"{value:.15g}")
    return rounded if len(repr(rounded)) + _SHORTER <= len(repr(value)) else value


def identifier(source: str) -> str:
    """A name that models may have, as near to a given one as can be."""
    name = re.sub(r"[^A-Za-z0-9_]", "_", source)[: LONGEST_NAME - 20]
    if not name[:1].isalpha():
        name = f"n{name}" if name[:1].isdigit() else f"n_{name.lstrip('_')}"
    return name if name_fault(name) is None else f"{name}_"


def _made_names(name: str, joint_type: str) -> set[str]:
    """A name in lower case, and those of the coordinates and rates that a joint of this name and type has."""
    made = {name}
    if joint_type:
        kind = TYPES[joint_type]
        made |= {*kind.coordinate_names(name), *(name + suffix for suffix in kind.velocities)}
        made |= {name + suffix for suffix in ANGULAR_VELOCITY if kind.quaternion}
    return {one.lower() for one in made}
