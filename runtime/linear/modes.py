"""Modes of a linear model: eigenvalues as frequencies and damping, shapes over all coordinates, stability in words."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from symgen.runtime.linear.state_space import StateSpace

_ROUND_OFF = 100.0 * np.finfo(float).eps
_OSCILLATES = 1e-8  # imaginary part, of the magnitude, below which an eigenvalue is real
_UNDAMPED = 1e-12
_EXACT = 1e-12  # of the matrix: what an eigenvector may leave
_SHIFT = 1e-10
_MAX_ITERATIONS = 4


@dataclass(frozen=True, eq=False)
class Mode:
    """One mode: a real eigenvalue, or a pair of complex ones, of which this is the one with positive imaginary part.

    Attributes
    ----------
    number : int
        From 1 on, slow modes first.
    eigenvalue : complex [1/s]
    frequency : float [Hz]
        Of the damped oscillation; 0 where there is none.
    natural_frequency : float [rad/s]
        |eigenvalue|.
    damping_ratio : float
        -Re/|eigenvalue|: 0 undamped, 1 at least critically damped, negative growing. 0 for zero eigenvalues.
    kind : str
        "oscillation", "decay", "growth", "growing oscillation", or "free" for an eigenvalue that is zero to round-off.
    shape : ndarray of complex, shape (nv,)
        Of all `LinearModel.motions`; the one that is largest, for its size, is 1.
    state : ndarray of complex, shape (n,)
        The same of the states x.
    """

    number: int
    eigenvalue: complex
    frequency: float
    natural_frequency: float
    damping_ratio: float
    kind: str
    shape: np.ndarray
    state: np.ndarray

    @property
    def time_constant(self) -> float:
        """Time in which the amplitude changes e-fold [s]; infinite where it does not."""
        return 1.0 / abs(self.eigenvalue.real) if self.eigenvalue.real else np.inf

    def description(self) -> str:
        """Say what it does."""
        if self.kind == "free":
            return "free: nothing drives it back"
        if self.kind == "oscillation" and not self.eigenvalue.real:
            return "undamped oscillation"
        grows = "growth" in self.kind or "growing" in self.kind
        return f"{self.kind}, {'grows' if grows else 'falls'} e-fold in {self.time_constant:.4g} s"


@dataclass(frozen=True, eq=False)
class Modes:
    """All modes of a linear model.

    Attributes
    ----------
    model : StateSpace
    eigenvalues : ndarray of complex, shape (n,) [1/s]
        All of them, in the order of their magnitudes.
    modes : tuple of Mode
    """

    model: StateSpace
    eigenvalues: np.ndarray
    modes: tuple[Mode, ...]

    def __iter__(self):
        return iter(self.modes)

    def __len__(self) -> int:
        return len(self.modes)

    def __getitem__(self, k: int) -> Mode:
        """Return a mode by its place, the slowest first."""
        return self.modes[k]

    @property
    def stable(self) -> bool | None:
        """Whether small motions die out; None where the linear model cannot tell."""
        if any(mode.eigenvalue.real > 0.0 for mode in self.modes):
            return False
        return True if all(mode.eigenvalue.real < 0.0 for mode in self.modes) else None

    @property
    def says(self) -> str:
        """Stability in one sentence."""
        of = {"equilibrium": "the equilibrium", "steady motion": "the steady motion"}.get(self.model.kind)
        if of is None:
            return "the state is no equilibrium or steady motion: eigenvalues are those of an instant, and say little"
        growing = [mode for mode in self.modes if mode.eigenvalue.real > 0.0]
        free = sum(mode.kind == "free" for mode in self.modes)
        if growing:
            fastest = max(growing, key=lambda mode: mode.eigenvalue.real)
            return f"{of} is unstable: mode {fastest.number} grows e-fold in {fastest.time_constant:.4g} s"
        if self.stable or not self.modes:
            return f"{of} is stable: small motions die out"
        drifts = (
            f"{free} of {len(self.eigenvalues)} eigenvalues zero, where nothing drives back" if free else ""
        )
        undamped = sum(mode.kind != "free" and mode.eigenvalue.real == 0.0 for mode in self.modes)
        swings = f"{undamped} of {len(self)} modes undamped, where nonlinear terms decide" if undamped else ""
        return f"{of} is stable to first order: " + "; ".join(part for part in (drifts, swings) if part)

    def table(self) -> list[str]:
        """Return eigenvalues as lines of text."""
        lines = ["mode     f [Hz]    ω [rad/s]     damping   motion"]
        for mode in self.modes:
            lines.append(
                f"{mode.number:4d} {mode.frequency:10.6g} {mode.natural_frequency:12.6g} {mode.damping_ratio:11.4g}   "
                + mode.description()
            )
        return lines

    def shape_table(self, most: int = 8) -> list[str]:
        """Return shapes as lines of text: amplitude, and phase where it is neither 0 nor 180 degrees."""
        shown = self.modes[:most]
        width = max([len(name) for name in self.model.motions] + [4])
        lines = [" " * width + "".join(f"{'mode ' + str(mode.number):>16}" for mode in shown)]
        for i, name in enumerate(self.model.motions):
            lines.append(f"{name:<{width}}" + "".join(f"{_entry(mode.shape[i]):>16}" for mode in shown))
        return lines

    def to_dict(self) -> dict[str, Any]:
        """Return eigenvalues and shapes as JSON can say them."""
        return {
            "stable": self.stable,
            "says": self.says,
            "motions": self.model.motions,
            "modes": [_as_dict(mode) for mode in self.modes],
        }


def modes_of(model: StateSpace) -> Modes:
    """Return the modes of a linear model.

    Eigenvalues of a defective pair at zero are found to the square root of round-off only; what is that small, and
    real parts within the error of an eigenvalue, are set to zero.
    """
    values, vectors = np.linalg.eig(model.A) if model.A.size else (np.zeros(0), np.zeros((0, 0)))
    largest = float(np.abs(values).max(initial=0.0))
    values = np.array([_cleaned(value, largest, len(values)) for value in values.astype(complex)])
    sizes = np.round(np.abs(values) / (largest or 1.0), 9)  # of a pair that is equal but for round-off
    order = np.lexsort((values.imag, values.real, sizes))
    kept = [i for i in order if values[i].imag >= 0.0]
    shapes = {i: _refined(model.A, values[i], vectors[:, i]) for i in kept}
    modes = tuple(_mode(model, number, values[i], shapes[i]) for number, i in enumerate(kept, 1))
    return Modes(model, values[order], modes)


def _cleaned(value: complex, largest: float, n: int) -> complex:
    size = abs(value)
    if size <= np.sqrt(_ROUND_OFF * n) * largest or size == 0.0:
        return 0.0j
    error = _ROUND_OFF * n * largest * max(1.0, largest / size)
    real = 0.0 if abs(value.real) <= max(error, _UNDAMPED * size) else value.real
    return complex(real, 0.0 if abs(value.imag) <= _OSCILLATES * size else value.imag)


def _refined(matrix: np.ndarray, value: complex, vector: np.ndarray) -> np.ndarray:
    """Return the eigenvector, by inverse iteration where the one that was found is none.

    LAPACK scales rows and columns against each other first, and entries that are round-off can make that spoil
    eigenvectors: Watkins, Electronic Transactions on Numerical Analysis 23 (2006) 1.
    """
    largest = _EXACT * float(np.abs(matrix).max(initial=0.0))

    def left(x: np.ndarray) -> float:
        return float(np.linalg.norm(matrix @ x - value * x) / np.linalg.norm(x))

    if value == 0.0 or left(vector) <= largest:
        return vector
    shifted = matrix - value * (1.0 + _SHIFT) * np.eye(len(matrix))
    better = np.ones(len(matrix), dtype=complex)  # what was found may have no part of the eigenvector
    for _ in range(_MAX_ITERATIONS):
        better = np.linalg.solve(shifted, better)
        better /= np.linalg.norm(better)
    return better if left(better) < left(vector) else vector


def _mode(model: StateSpace, number: int, value: complex, vector: np.ndarray) -> Mode:
    shape = model.shape @ vector
    scaled = np.abs(shape / model.sizes)
    # A motion whose rates alone take part, such as a speed that dies out, is shown by its rates.
    if scaled.max(initial=0.0) <= _UNDAMPED * np.abs(vector).max():
        largest = vector[np.argmax(np.abs(vector))]
    else:
        # Of equal components the first one counts, whatever round-off says.
        largest = shape[np.argmax(scaled >= scaled.max() * (1.0 - 1e-9))]
    shape, state = shape / largest, vector / largest
    size = abs(value)
    return Mode(
        number=number,
        eigenvalue=value,
        frequency=value.imag / (2.0 * np.pi),
        natural_frequency=size,
        damping_ratio=-value.real / size if value.real else 0.0,
        kind=_kind(value),
        shape=shape,
        state=state,
    )


def _kind(value: complex) -> str:
    if value == 0.0:
        return "free"
    if value.imag:
        return "growing oscillation" if value.real > 0.0 else "oscillation"
    return "growth" if value.real > 0.0 else "decay"


def _entry(x: complex) -> str:
    size = abs(x)
    if size < 5e-7:
        return "0"
    if abs(x.imag) < 1e-6 * size:
        return f"{x.real:.6f}"
    return f"{size:.4f} ∠{np.degrees(np.angle(x)):.0f}°"


def _as_dict(mode: Mode) -> dict[str, Any]:
    record = {
        key: value for key, value in asdict(mode).items() if key not in ("eigenvalue", "shape", "state")
    }
    parts = {"real": mode.eigenvalue.real, "imaginary": mode.eigenvalue.imag}
    return {
        **record,
        "eigenvalue": parts,
        "shape": {"real": mode.shape.real, "imaginary": mode.shape.imag},
        "state": {"real": mode.state.real, "imaginary": mode.state.imag},
    }
