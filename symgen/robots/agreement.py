"""An imported robot against Pinocchio, which reads the same file (optional package `pin`)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

import numpy as np

from ..errors import ModelError
from ..model.evaluate import quarter_turns
from ..model.files import read_plain
from .build import Import
from .xml_tree import LARGEST_FILE

if TYPE_CHECKING:
    from symgen.runtime import System

_SPEEDS = 1.0  # rad/s or m/s, up to which rates are drawn


@dataclass(frozen=True)
class Agreement:
    """How far two programs are apart at random states: the largest difference over the largest value of its kind.

    Attributes
    ----------
    states : int
    places, rotations, kinetic, mass_matrix, bias, accelerations : float
        Of the links' centres of mass and axes; of the energy; of M; of the forces at no acceleration; of motion
        without motors. The last is not a number where the file couples joints, which Pinocchio takes as free.
    potential : float
        Likewise, of its differences to the first state: its zero is a matter of taste.
    """

    states: int
    places: float
    rotations: float
    kinetic: float
    potential: float
    mass_matrix: float
    bias: float
    accelerations: float


def compare_with_pinocchio(system: System, imported: Import, states: int = 20) -> Agreement:
    """Compare an imported robot with what Pinocchio reads from the file, with right angles that are right in both.

    Parameters
    ----------
    system : System
        Derived from `imported.model`.
    imported : Import
    states : int
        How many random states.

    Raises
    ------
    ModelError
        Pinocchio is not installed, or refuses the file.
    """
    try:
        import pinocchio as pin
    except ImportError:
        raise ModelError("comparing needs Pinocchio", hint="pip install pin") from None
    try:
        base = (pin.JointModelFreeFlyer(),) if imported.base == "free" else ()
        theirs = pin.buildModelFromXML(_with_exact_angles(imported.robot.file), *base)
    except Exception as error:  # of a compiled library, with a type of its own
        raise ModelError(f"Pinocchio refuses the file: {error}"[:400], file=imported.robot.file) from None
    return _Comparison(pin, theirs, system, imported).over(states)


def _with_exact_angles(file: str) -> str:
    """The text of a URDF file where right angles of joints, which it writes with few digits, have all of them."""
    root = ElementTree.fromstring(
        read_plain(Path(file), LARGEST_FILE)
    )  # what it may hold was looked at on import
    for origin in root.findall("joint/origin"):
        angles = [float(x) for x in origin.get("rpy", "").split()]
        turns = [quarter_turns(x) for x in angles]
        exact = [x if n is None else n * (math.pi / 2) for x, n in zip(angles, turns, strict=True)]
        if angles:
            origin.set("rpy", " ".join(map(repr, exact)))
    return ElementTree.tostring(root, "unicode")


class _Comparison:
    def __init__(self, pin: Any, theirs: Any, system: System, imported: Import):
        robot, free = imported.robot, imported.base == "free"
        self._pin, self._model, self._system, self._free = pin, theirs, system, free
        self._data, self._rng = theirs.createData(), np.random.default_rng(1)
        self._places = {name: k for k, name in enumerate(c["name"] for c in system.coordinates)}
        self._rates = {name: k for k, name in enumerate(r["name"] for r in system.rates)}
        self._single = []  # joints of one coordinate: theirs, and where it is in our q
        for joint in robot.joints:
            ours = imported.joints[joint.name]
            if ours in self._places:
                self._single.append((theirs.joints[theirs.getJointId(joint.name)], self._places[ours]))
            elif joint.type in ("floating", "planar"):
                raise ModelError(
                    f"joints of type {joint.type} are not compared: {joint.name!r:.60}", file=robot.file
                )
        held = theirs.njoints - 1 - free - len(self._single)
        if held:
            raise ModelError(
                f"{held} joints move nothing that has mass, with which Pinocchio's mass matrix is singular",
                file=robot.file,
            )
        numbers = {record["name"]: k for k, record in enumerate(system.bodies)}
        self._bodies = [  # our number, their frame, the centre of mass in it
            (numbers[body], theirs.getFrameId(name, pin.FrameType.BODY), np.array(robot.links[name].com))
            for name, body in imported.bodies.items()
            if body in numbers
        ]
        self._p = system.parameter_values()
        # What Pinocchio does not read. Dry friction does not act in either: nothing says which way it slides.
        self._armature, self._damping = np.zeros(system.nv), np.zeros(system.nv)
        for joint in robot.joints:
            if (rate := self._rates.get(imported.joints[joint.name])) is not None:
                self._armature[rate], self._damping[rate] = joint.armature, joint.damping

    def over(self, states: int) -> Agreement:
        """The worst of some random states."""
        pairs = [self._at_random() for _ in range(states)]
        first = pairs[0]["potential"]
        for pair in pairs:
            pair["potential"] = tuple(a - b for a, b in zip(pair["potential"], first, strict=True))
        names = pairs[0].keys()
        return Agreement(
            states, **{name: largest_difference([pair[name] for pair in pairs]) for name in names}
        )

    def _at_random(self) -> dict[str, tuple[Any, Any]]:
        """What both say at a random state, by kind: ours and theirs."""
        pin, model, data, system = self._pin, self._model, self._data, self._system
        y, q, v, B, b = self._state()
        nv = system.nv
        M = self._call("mass_matrix", y).reshape(nv, nv)
        T, V = self._call("energy", y)
        poses = self._call("poses", y).reshape(-1, 12)
        pin.forwardKinematics(model, data, q, v)
        pin.updateFramePlacements(model, data)
        mass = pin.crba(model, data, q)
        mass = np.triu(mass) + np.triu(mass, 1).T
        kinetic, potential = (
            pin.computeKineticEnergy(model, data, q, v),
            pin.computePotentialEnergy(model, data, q),
        )
        bias = B.T @ pin.rnea(model, data, q, v, b) + self._damping * y[-nv:]
        frames = [(data.oMf[frame], com) for _, frame, com in self._bodies]
        own = [k for k, _, _ in self._bodies]
        expected = B.T @ mass @ B + np.diag(self._armature)
        free_motion = np.linalg.solve(expected, -bias)
        ours = np.full(nv, np.nan) if system.nh else self._call("rhs", y)[system.nq : system.nq + nv]
        return {
            "places": (poses[own, :3], np.array([frame.act(com) for frame, com in frames])),
            "rotations": (poses[own, 3:], np.array([frame.rotation.ravel() for frame, _ in frames])),
            "kinetic": (T, kinetic + self._armature @ (y[-nv:] ** 2) / 2),
            "potential": (V, potential),
            "mass_matrix": (M, expected),
            "bias": (-self._call("forces", y), bias),
            "accelerations": (ours, free_motion),
        }

    def _state(self) -> tuple[np.ndarray, ...]:
        """Our state, their configuration and velocity, and B, b of v = B u, dv/dt = B du/dt + b of our rates u."""
        pin, model, system, rng = self._pin, self._model, self._system, self._rng
        q, y = pin.neutral(model), np.zeros(system.nq + system.nv)
        y[system.nq :] = rng.uniform(-_SPEEDS, _SPEEDS, system.nv)
        B, b = np.zeros((model.nv, system.nv)), np.zeros(model.nv)
        for joint, place in self._single:
            angle = y[place] = rng.uniform(-1.0, 1.0)
            q[joint.idx_q : joint.idx_q + joint.nq] = (
                [angle] if joint.nq == 1 else [np.cos(angle), np.sin(angle)]
            )
            B[joint.idx_v, self._rates[system.coordinates[place]["name"]]] = 1.0
        if self._free:
            turn = rng.normal(size=4)
            turn /= np.linalg.norm(turn)
            y[:3], y[3:7] = rng.uniform(-1, 1, 3), turn
            q[:7] = [*y[:3], *turn[1:], turn[0]]
            R = pin.Quaternion(*turn).toRotationMatrix()
            B[:3, :3], B[3:6, 3:6] = R.T, np.eye(3)
            u = y[system.nq :]
            b[:3] = -np.cross(u[3:6], R.T @ u[:3])
        return y, q, B @ y[system.nq :], B, b

    def _call(self, name: str, y: np.ndarray) -> np.ndarray:
        return self._system.kernel(name)(0.0, y, self._p)


def largest_difference(pairs: list[tuple[Any, Any]], least: float = 0.0) -> float:
    """The largest difference over the largest value, or over `least` where that is larger."""
    ours, theirs = (np.array([pair[k] for pair in pairs], dtype=float) for k in (0, 1))
    scale = np.abs(theirs).max(initial=least)
    return float(np.abs(ours - theirs).max(initial=0.0) / (scale or 1.0))
