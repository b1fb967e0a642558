"""What a motion belongs to: the coordinates and bodies that move in it, and the parameters that make it fast."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.batches import accelerations_and_multipliers, evaluate
from symgen.runtime.checks.time_scales import motion_jacobian
from symgen.runtime.names import rate_labels
from symgen.runtime.positions import Positions

if TYPE_CHECKING:
    from symgen.runtime.system import System

_LEAST_SHARE = 0.1
_MOST_NAMED = 3
_LEAST_EFFECT = 0.05  # d ln|lambda| / d ln p: 1/2 for the stiffness of a single spring
_STATE_STEP, _PARAMETER_STEP = 1e-5, 1e-3


@dataclass(frozen=True)
class Origin:
    """What an eigenvalue of the linearised motion belongs to.

    Attributes
    ----------
    eigenvalue : complex [1/s]
    coordinates : tuple of (str, float)
        Coordinates that move, and their share of the kinetic energy of the motion.
    bodies : tuple of (str, float)
        Bodies that move farthest, and how far in parts of the farthest.
    parameters : tuple of (str, str, float)
        Parameters that the eigenvalue depends on most, what the model says that they are, and
        d ln|lambda| / d ln p: 1/2 for the stiffness of the one spring of a vibration, -1/2 for its mass.
    """

    eigenvalue: complex
    coordinates: tuple[tuple[str, float], ...]
    bodies: tuple[tuple[str, float], ...]
    parameters: tuple[tuple[str, str, float], ...]

    def says(self) -> str:
        """Return one sentence."""
        parts = []
        if self.bodies:
            parts.append("of body " + " and ".join(name for name, _ in self.bodies))
        if self.coordinates:
            parts.append("in " + ", ".join(f"{name} ({share:.0%})" for name, share in self.coordinates))
        text = "motion " + " ".join(parts) if parts else "motion of no single coordinate"
        if self.parameters:
            text += "; set by " + ", ".join(
                f"{name}{f' ({doc})' if doc else ''}, exponent {effect:+.2f}"
                for name, doc, effect in self.parameters
            )
        return text

    @property
    def spring(self) -> str:
        """What makes the motion fast, quoted: a parameter that it grows with, else the coordinate that moves most."""
        for name, doc, effect in self.parameters:
            if effect > 0.0:
                return f"{name!r}, {doc}" if doc else repr(name)
        return repr(self.coordinates[0][0]) if self.coordinates else "the model"


def fastest_origin(system: System, p: np.ndarray, t: float, q: np.ndarray, v: np.ndarray) -> Origin | None:
    """Return what the eigenvalue of largest magnitude at a state belongs to; None where nothing moves by itself.

    Sensitivities follow from left and right eigenvectors, d lambda = (w* dA x) / (w* x): Lancaster, Numer. Math. 6
    (1964) 377; dA x by central differences.
    """
    return _origin(system, p, t, q, v, np.abs)


def fastest_growth(system: System, p: np.ndarray, t: float, q: np.ndarray, v: np.ndarray) -> Origin | None:
    """Return what the eigenvalue of largest real part at a state belongs to; None where nothing grows."""
    return _origin(system, p, t, q, v, np.real)


def _origin(system: System, p, t, q, v, size: Callable[[np.ndarray], np.ndarray]) -> Origin | None:
    jacobian = motion_jacobian(system, p, t, q, v)
    values, right = np.linalg.eig(jacobian)
    if not len(values) or size(values).max() <= 0.0:
        return None
    which = int(np.lexsort((-values.imag, -np.round(size(values), 9)))[0])
    value, x = values[which], right[:, which]
    left_values, left = np.linalg.eig(jacobian.conj().T)
    w = left[:, np.argmin(np.abs(left_values - value.conj()))]
    return Origin(
        complex(value),
        _coordinates(system, p, t, q, v, x) if not system.states else _participants(system, x, w),
        _bodies(system, p, t, q, v, x),
        _parameters(system, p, t, q, v, value, x, w),
    )


def _coordinates(system: System, p, t, q, v, x: np.ndarray) -> tuple[tuple[str, float], ...]:
    nv = system.nv
    mass = system.kernel("mass_matrix")(t, np.concatenate([q, v]), p).reshape(nv, nv)
    rates = x[nv:]
    energy = np.abs((rates.conj() * (mass @ rates)).real)
    total = energy.sum()
    shares = energy / total if total > 0.0 else np.abs(x[:nv]) ** 2 / max(np.sum(np.abs(x[:nv]) ** 2), 1e-300)
    names = _names_per_rate(system)
    return tuple((names[i], float(shares[i])) for i in _most(shares) if shares[i] >= _LEAST_SHARE)


def _participants(system: System, x: np.ndarray, w: np.ndarray) -> tuple[tuple[str, float], ...]:
    """What takes part in a motion in which first-order states do, too: these have no kinetic energy.

    Parts are those of the eigenvectors' product, in which units cancel (Perez-Arriaga, Verghese, Schweppe 1982).
    """
    nv = system.nv
    parts = np.abs(w.conj() * x)
    shares = parts[:nv] + parts[nv:]
    shares /= max(shares.sum(), 1e-300)
    names = _names_per_rate(system)
    return tuple((names[i], float(shares[i])) for i in _most(shares) if shares[i] >= _LEAST_SHARE)


def _names_per_rate(system: System) -> list[str]:
    names = rate_labels(system.coordinates, system.rates)
    positions = Positions(system)
    for i, j in zip(positions.plain_q, positions.plain_v):
        if j in system.states:
            continue
        names[j] = system.coordinates[i]["name"]
    return names


def _most(sizes: np.ndarray) -> np.ndarray:
    return np.argsort(-np.round(sizes, 9), kind="stable")[:_MOST_NAMED]


def _bodies(system: System, p, t, q, v, x: np.ndarray) -> tuple[tuple[str, float], ...]:
    if not system.bodies:
        return ()
    positions, step = Positions(system), _step(system, q, v, x)
    moved = []
    for part in (x.real, x.imag):
        moves = [
            np.concatenate([positions.retract(q, sign * step * part[: system.nv]), v]) for sign in (1.0, -1.0)
        ]
        poses = evaluate(system, "poses", p, np.full(2, t), np.array(moves))
        moved.append((poses[0] - poses[1]).reshape(len(system.bodies), 12))
    far = np.sqrt(np.sum(np.square(moved), axis=(0, 2)))
    if not far.max() > 0.0:
        return ()
    far /= far.max()
    return tuple((system.bodies[i]["name"], float(far[i])) for i in _most(far)[:2] if far[i] >= 0.5)


def _parameters(system: System, p, t, q, v, value: complex, x, w) -> tuple[tuple[str, str, float], ...]:
    overlap = np.vdot(w, x)
    if abs(overlap) < 1e-8:
        return ()  # two eigenvalues meet: their derivatives are not defined
    effects = np.zeros(len(system.parameters))
    for k in np.flatnonzero(p[: len(effects)]):
        changes = []
        for sign in (1.0, -1.0):
            changed = p.copy()
            changed[k] *= 1.0 + sign * _PARAMETER_STEP
            changes.append(_accelerations_along(system, changed, t, q, v, x))
        d_value = np.vdot(w[system.nv :], changes[0] - changes[1]) / (2.0 * _PARAMETER_STEP * overlap)
        effects[k] = (d_value * value.conjugate()).real / abs(value) ** 2
    effects = np.where(np.isfinite(effects), effects, 0.0)
    records = system.parameters
    return tuple(
        (records[k]["name"], records[k].get("doc", ""), float(effects[k]))
        for k in _most(np.abs(effects))
        if abs(effects[k]) >= _LEAST_EFFECT
    )


def _step(system: System, q: np.ndarray, v: np.ndarray, x: np.ndarray) -> float:
    sizes = np.concatenate(
        [Positions(system).per_rate(np.maximum(1.0, np.abs(q)), 1.0), np.maximum(1.0, np.abs(v))]
    )
    return _STATE_STEP / float(np.max(np.abs(x) / sizes))


def _accelerations_along(system: System, p, t, q, v, x: np.ndarray) -> np.ndarray:
    """Return the derivative of the accelerations along a complex direction of the state, shape (nv,)."""
    positions, step, nv = Positions(system), _step(system, q, v, x), system.nv
    states = np.array(
        [
            np.concatenate([positions.retract(q, sign * step * part[:nv]), v + sign * step * part[nv:]])
            for part in (x.real, x.imag)
            for sign in (1.0, -1.0)
        ]
    )
    a, _ = accelerations_and_multipliers(system, p, np.full(4, t), states)
    return ((a[0] - a[1]) + 1j * (a[2] - a[3])) / (2.0 * step)
