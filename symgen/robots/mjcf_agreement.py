"""An imported robot against MuJoCo, at random states: places, energies, mass matrix, forces."""

from __future__ import annotations

import copy
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import ModelError
from ..model.evaluate import quarter_turns
from .agreement import Agreement, largest_difference
from .mjcf import MjcfImport, roll_pitch_yaw

if TYPE_CHECKING:
    from symgen.runtime import System

_SPEEDS = 1.0  # rad/s or m/s, up to which rates are drawn


def compare_with_mujoco(system: System, imported: MjcfImport, states: int = 20) -> Agreement:
    """Compare an imported robot with MuJoCo, which computes without contacts, media, friction and equalities.

    Parameters
    ----------
    system : System
        Derived from `imported.model`.
    imported : MjcfImport
    states : int
        How many random states.
    """
    return _Comparison(system, imported).over(states)


class _Comparison:
    def __init__(self, system: System, imported: MjcfImport) -> None:
        import mujoco

        self._mj, self._system, self._imported = mujoco, system, imported
        m = self._m = copy.copy(imported.compiled)
        m.opt.density = m.opt.viscosity = 0.0
        m.body_gravcomp[:] = 0.0
        m.actuator_actearly[:] = 0  # a matter of its time steps
        for quaternion in m.body_quat:
            quaternion[:] = _with_right_angles(quaternion)
        m.opt.enableflags |= int(mujoco.mjtEnableBit.mjENBL_ENERGY)
        m.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
        for kind, n_rates in ((mujoco.mjtJoint.mjJNT_FREE, 6), (mujoco.mjtJoint.mjJNT_BALL, 3)):
            for j in np.flatnonzero(m.jnt_type == int(kind)):  # what is left out
                m.jnt_stiffness[j] = 0.0
                m.dof_armature[m.jnt_dofadr[j] :][:n_rates] = 0.0
        for t in set(range(m.ntendon)) - imported.tendons.keys():
            m.tendon_stiffness[t] = m.tendon_damping[t] = m.tendon_armature[t] = 0.0
        for k, gain in enumerate(m.actuator_gear):  # those that were left out
            if int(m.actuator_ctrladr[k]) not in imported.actuators:
                gain[:] = 0.0
        self._d, self._rng = mujoco.MjData(m), np.random.default_rng(1)
        places = {record["name"]: k for k, record in enumerate(system.coordinates)}
        rates = {record["name"]: k for k, record in enumerate(system.rates)}
        self._q, self._v = [], []  # of their numbers: ours, and what theirs has more
        for j, name in imported.joints.items():
            first, dof = int(m.jnt_qposadr[j]), int(m.jnt_dofadr[j])
            if name in places:
                self._q.append((first, places[name], float(m.qpos0[first])))
                self._v.append((dof, rates[name]))
                continue
            ours = [f"{name}_{c}" for c in ("x", "y", "z")] if f"{name}_x" in places else []
            ours += [f"{name}_q{c}" for c in "wxyz"]
            own = [f"{name}_v{c}" for c in "xyz"] if len(ours) == 7 else []
            own += [f"{name}_w{c}" for c in "xyz"]
            self._q += [(first + i, places[x], 0.0) for i, x in enumerate(ours)]
            self._v += [(dof + i, rates[x]) for i, x in enumerate(own)]
        self._activations = [(k, rates[name]) for k, name in imported.activations.items()]
        numbers = {record["name"]: k for k, record in enumerate(system.bodies)}
        self._bodies = [(numbers[name], b) for b, name in imported.bodies.items() if name in numbers]

    def over(self, states: int) -> Agreement:
        """The worst of some random states."""
        pairs = [self._at_random() for _ in range(states)]
        first = pairs[0]["potential"]
        for pair in pairs:
            pair["potential"] = tuple(a - b for a, b in zip(pair["potential"], first, strict=True))
        # Without weight V stays, but for rounding: T is a scale for it, too.
        scale = max(abs(pair["kinetic"][1]) for pair in pairs)
        found = {name: largest_difference([pair[name] for pair in pairs]) for name in pairs[0]}
        found["potential"] = largest_difference([pair["potential"] for pair in pairs], scale)
        return Agreement(states, **found)

    def _at_random(self) -> dict[str, tuple[Any, Any]]:
        mj, m, d, system = self._mj, self._m, self._d, self._system
        mj.mj_resetData(m, d)
        y, overrides = self._draw()
        mj.mj_forward(m, d)
        order, own_rates = zip(*sorted(self._v, key=lambda pair: pair[1]), strict=True)
        order, own_rates = list(order), list(own_rates)  # without the states of actuators
        p, nv = system.parameter_values(overrides), system.nv

        def call(name: str) -> np.ndarray:
            return system.kernel(name)(0.0, y, p)

        theirs = np.zeros((m.nv, m.nv))
        mj.mj_fullM(m, d, theirs)
        theirs = theirs[np.ix_(order, order)]
        M, (T, V) = call("mass_matrix").reshape(nv, nv)[np.ix_(own_rates, own_rates)], call("energy")
        if np.linalg.matrix_rank(theirs) < len(theirs):
            raise ModelError(
                "MuJoCo's mass matrix is singular: something moves that has no mass", file=self._imported.file
            )
        force = (d.qfrc_passive + d.qfrc_actuator - d.qfrc_bias)[order]
        poses = call("poses").reshape(-1, 12)
        own = [k for k, _ in self._bodies]
        free = call("rhs")[system.nq : system.nq + nv][own_rates] * (np.nan if system.m else 1.0)
        return {
            "places": (poses[own, :3], np.array([self._place(b) for _, b in self._bodies])),
            "rotations": (poses[own, 3:], np.array([d.xmat[b] for _, b in self._bodies])),
            "kinetic": (T, d.energy[1]),
            "potential": (V, d.energy[0]),
            "mass_matrix": (M, theirs),
            "bias": (call("forces")[own_rates], force),
            "accelerations": (free, np.linalg.solve(theirs, force)),
        }

    def _place(self, b: int) -> np.ndarray:
        """Where a body's centre of mass is; of one without mass, where the model's frame stands."""
        if self._m.body_mass[b] or self._m.body_inertia[b].any():
            return self._d.xipos[b]
        return self._d.xpos[b] + self._d.xmat[b].reshape(3, 3) @ self._imported.shifts[b]

    def _draw(self) -> tuple[np.ndarray, dict[str, float]]:
        """A random state: ours, with values of inputs; theirs is set."""
        d, system, rng = self._d, self._system, self._rng
        y = np.zeros(system.nq + system.nv)
        y[: system.nq] = rng.uniform(-1.0, 1.0, system.nq)
        for k in system.quaternions:
            y[k : k + 4] = rng.normal(size=4)
            y[k : k + 4] /= np.linalg.norm(y[k : k + 4])
        y[system.nq :] = rng.uniform(-_SPEEDS, _SPEEDS, system.nv)
        for k, place, reference in self._q:
            d.qpos[k] = y[place] + reference
        for k, place in self._v:
            d.qvel[k] = y[system.nq + place]
        for k, place in self._activations:
            d.act[k] = y[system.nq + place]
        controls = {name: float(rng.uniform(-1.0, 1.0)) for name in self._imported.actuators.values()}
        for k, name in self._imported.actuators.items():
            d.ctrl[k] = controls[name]
        return y, controls


def _with_right_angles(quaternion: np.ndarray) -> np.ndarray:
    """A body's orientation with the angles that models take: right ones where few digits are all that is missing."""
    given = roll_pitch_yaw(quaternion)
    angles = [x if (n := quarter_turns(x)) is None else n * (np.pi / 2) for x in given]
    if angles == list(given):
        return quaternion
    (r, p, y), (sr, sp, sy) = np.cos(np.array(angles) / 2), np.sin(np.array(angles) / 2)
    return np.array(
        [
            r * p * y + sr * sp * sy,
            sr * p * y - r * sp * sy,
            r * sp * y + sr * p * sy,
            r * p * sy - sr * sp * y,
        ]
    )
