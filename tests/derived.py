"""Test support: descriptions written as text, and their generated modules run as plain Python."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import sympy
from random_expressions import COMPLEX, STEP

from symgen.derive.pipeline import derive
from symgen.derive.program import Program
from symgen.emit.module import emit
from symgen.model.description import Constraint, Coordinate, Description, Input, Parameter
from symgen.model.from_sympy import taken_over
from symgen.model.sympy_functions import dot, maximum, minimum

WORDS = "sin cos tan asin acos atan atan2 sinh cosh tanh exp log sqrt sign pi"
FUNCTIONS = {"dot": dot, "minimum": minimum, "maximum": maximum, "abs": sympy.Abs}
FUNCTIONS |= {word: getattr(sympy, word) for word in WORDS.split()}


class Names(dict):
    """Name space in which every word that is no function is a plain symbol."""

    def __missing__(self, name: str) -> sympy.Symbol:
        return sympy.Symbol(name)


def expr(text):
    """A model's expression of a trusted text (tests only); sequences give tuples."""
    if isinstance(text, (tuple, list)):
        return tuple(expr(x) for x in text)
    return taken_over(
        sympy.sympify(eval(text, {"__builtins__": {}}, Names(FUNCTIONS)) if isinstance(text, str) else text)
    )


def describe(name: str, coordinates: str, parameters: dict | None = None, **parts) -> Description:
    """A description with its expressions given as text."""
    wrap = {
        "kinetic": expr,
        "potential": expr,
        "dissipation": expr,
        "gravity": expr,
        "definitions": lambda d: tuple((k, expr(v)) for k, v in d.items()),
        "forces": lambda d: tuple((k, expr(v)) for k, v in d.items()),
        "outputs": lambda d: tuple((k, expr(v)) for k, v in d.items()),
        "inputs": lambda d: tuple(Input(k, default=v) for k, v in d.items()),
        "constraints": lambda d: tuple(Constraint(k, expr(v)) for k, v in d.items()),
        "velocity_constraints": lambda d: tuple(Constraint(k, expr(v), "velocity") for k, v in d.items()),
    }
    return Description(
        name=name,
        coordinates=tuple(Coordinate(c) for c in coordinates.split()),
        parameters=tuple(Parameter(k, float(v)) for k, v in (parameters or {}).items()),
        **{key: wrap[key](value) if key in wrap else value for key, value in parts.items()},
    )


class Generated:
    """The emitted module of a description, executed as plain Python on real or complex numbers."""

    def __init__(self, description: Description) -> None:
        self.program: Program = derive(description)
        self.text = emit(self.program)
        self.space = execute(self.text)
        self.complex_space = execute(self.text)
        self.complex_space.update({k: v for k, v in vars(COMPLEX).items() if k in self.complex_space})
        self.model = self.space["MODEL"]
        self.nq, self.n = self.model["nq"], self.model["nv"]  # the same but for quaternions
        self.m = self.model["nh"] + self.model["nn"]
        self.nh, self.nw = self.model["nh"], self.model["nw"]
        self.p = np.array([x["value"] for x in (*self.model["parameters"], *self.model["inputs"])])

    def __contains__(self, name: str) -> bool:
        return name in self.space

    def size(self, name: str) -> int:
        nq, n, m = self.nq, self.n, self.m
        return {
            "rhs": nq + n + self.nw + m + (m > 0),
            "mass_matrix": n * n,
            "forces": n,
            "energy": 2,
            "residual": n + m,
            "residual_jacobian": (n + m) * (nq + 2 * n + m),
            "constraint_residual": self.nh + m,
            "constraint_jacobian": m * n,
            "gamma": m,
            "project": nq + n + self.nh + m,
            "kinematics": nq * n + nq * nq,
            "poses": 12 * len(self.model["bodies"]),
            "outputs": len(self.model["outputs"]),
            "events": len(self.model["events"]),
        }.get(name, nq + n)

    def __call__(self, name: str, t, y, p=None) -> np.ndarray:
        """What function `name` writes."""
        p = self.p if p is None else p
        is_complex = any(isinstance(x, complex) for x in (t, *y, *p))
        out = [0.0] * self.size(name)
        (self.complex_space if is_complex else self.space)[name](t, list(y), list(p), out)
        return np.array(out, dtype=complex if is_complex else float)

    def mass(self, t, y, p=None) -> np.ndarray:
        return self("mass_matrix", t, y, p).reshape(self.n, self.n)

    def G(self, t, y, p=None) -> np.ndarray:
        return (
            self("constraint_jacobian", t, y, p).reshape(self.m, self.n) if self.m else np.zeros((0, self.n))
        )

    def split(self, t, y, p=None) -> SimpleNamespace:
        """`rhs` by its parts: qdot, a, power, lam, ratio."""
        out, nq, n = self("rhs", t, y, p), self.nq, self.nq + self.n
        k = n + self.nw
        return SimpleNamespace(
            qdot=out[:nq],
            a=out[nq:n],
            power=out[n] if self.nw else 0.0,
            lam=out[k : k + self.m],
            ratio=out[-1],
        )

    def slope(self, name: str, t, y, direction, t_direction=0.0) -> np.ndarray:
        """Directional derivative of a function's outputs by the complex step."""
        moved = [complex(a, STEP * b) for a, b in zip(y, direction, strict=True)]
        return self(name, complex(t, STEP * t_direction), moved).imag / STEP

    def random_state(self, rng: np.random.Generator, low=-0.9, high=0.9) -> tuple[float, np.ndarray]:
        y = rng.uniform(low, high, self.nq + self.n)
        for k in self.model["quaternions"]:
            y[k : k + 4] /= np.linalg.norm(y[k : k + 4])
        return rng.uniform(0.1, 1.0), y

    def N(self, t, y) -> np.ndarray:
        """The matrix of dq/dt = N v."""
        if "kinematics" not in self:
            return np.eye(self.n)
        return self("kinematics", t, y)[: self.nq * self.n].reshape(self.nq, self.n)

    def consistent_state(self, rng: np.random.Generator, q_guess, t=0.3) -> tuple[float, np.ndarray]:
        """A random state near `q_guess` on both levels of the constraints, without the module's `project`."""
        y = np.array([*q_guess, *rng.uniform(-1, 1, self.n)])
        for _ in range(30):
            residual, G = self("constraint_residual", t, y), self.G(t, y)
            y[: self.n] -= np.linalg.pinv(G[: self.nh]) @ residual[: self.nh] if self.nh else 0.0
            residual, G = self("constraint_residual", t, y), self.G(t, y)
            y[self.n :] -= np.linalg.pinv(G) @ residual[self.nh :]
        assert np.abs(self("constraint_residual", t, y)).max() < 1e-12
        return t, y


def execute(text: str) -> dict:
    """The namespace of a generated module, with `njit` as the identity."""
    assert "from numba import njit\n" in text
    space: dict = {}
    exec(text.replace("from numba import njit\n", "def njit(**_):\n    return lambda f: f\n"), space)
    return space
