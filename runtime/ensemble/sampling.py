"""How what differs from member to member is given: grids that multiply, samplers that draw, arrays row by row."""

from __future__ import annotations

import hashlib
import math
import re
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.lazy import Late
from symgen.runtime.record import record

if TYPE_CHECKING:
    from symgen.runtime.ensemble.noises import Noise

special = Late("scipy.special")
qmc = Late("scipy.stats.qmc")
noises = Late("symgen.runtime.ensemble.noises")

Number = float | str  # an SI value, or text such as "20 deg"
_BLOCK = 1024  # members that are drawn together
_MOST_GRID_POINTS = 10**7  # of one grid: they are kept
_MOST_MEMBERS = 10**11
_MOST_POINTS = 1 << 22  # of a sequence that fills space evenly: all of it is kept


@record
class Sampler:
    """A distribution: `numbers` are drawn for each member.

    Attributes
    ----------
    kind : {"normal", "uniform", "lognormal", "triangular", "choice"}
    numbers : tuple of float or str
        Its parameters, in SI, or quantities as text.
    """

    kind: str
    numbers: tuple[Number, ...]

    def in_si(self, name: str, convert: Callable[[Number], float]) -> Sampler:
        """Return the sampler with plain numbers, checked; `name` is what it is for."""
        values = tuple(convert(value) for value in self.numbers)
        if self.kind == "lognormal":
            values = (values[0], self._pure(name, self.numbers[1]))
        finite = all(map(math.isfinite, values))
        wrong = _OBJECTIONS[self.kind](*values) if finite else "its numbers must be finite"
        if wrong:
            raise RuntimeModelError(f"{name}: {self}: {wrong}")
        return replace(self, numbers=values)

    def _pure(self, name: str, number: Number) -> float:
        try:
            return float(number)
        except ValueError:
            said = f"the spread, of a logarithm, is a number without a unit, not {number!r:.60}: give such a number"
            raise RuntimeModelError(f"{name}: {self}: {said}") from None

    def draw(self, generator: np.random.Generator, n: int) -> np.ndarray:
        """Return `n` values."""
        return _DRAWS[self.kind](generator, n, *self.numbers)

    def at(self, shares: np.ndarray) -> np.ndarray:
        """Return the values below which given shares of all lie."""
        return _QUANTILES[self.kind](shares, *self.numbers)

    def __str__(self) -> str:
        return f"{self.kind}({', '.join(map(str, self.numbers))})"


def _lognormal(g: np.random.Generator, n: int, median: float, spread: float) -> np.ndarray:
    return median * np.exp(spread * g.standard_normal(n))


_DRAWS: dict[str, Callable[..., np.ndarray]] = {
    "normal": lambda g, n, mean, deviation: mean + deviation * g.standard_normal(n),
    "uniform": lambda g, n, low, high: low + (high - low) * g.random(n),
    "lognormal": _lognormal,
    "triangular": lambda g, n, low, mode, high: g.triangular(low, mode, high, n),
    "choice": lambda g, n, *values: np.array(values)[g.integers(len(values), size=n)],
}


def _triangular_at(u: np.ndarray, low: float, mode: float, high: float) -> np.ndarray:
    width = high - low
    rises = u * width <= mode - low
    return np.where(
        rises, low + np.sqrt(u * width * (mode - low)), high - np.sqrt((1.0 - u) * width * (high - mode))
    )


_QUANTILES: dict[str, Callable[..., np.ndarray]] = {
    "normal": lambda u, mean, deviation: mean + deviation * special.ndtri(u),
    "uniform": lambda u, low, high: low + (high - low) * u,
    "lognormal": lambda u, median, spread: median * np.exp(spread * special.ndtri(u)),
    "triangular": _triangular_at,
    "choice": lambda u, *values: np.array(values)[np.minimum((u * len(values)).astype(int), len(values) - 1)],
}


def _normal_objection(mean: float, deviation: float) -> str:
    if deviation < 0.0:
        return "the standard deviation is negative: give one that is zero or positive"
    return "" if math.isfinite(abs(mean) + _FARTHEST * deviation) else _OUT_OF_RANGE


def _uniform_objection(low: float, high: float) -> str:
    if low > high:
        return "the lower bound is above the upper one: exchange them"
    return "" if math.isfinite(high - low) else _OUT_OF_RANGE


def _lognormal_objection(median: float, spread: float) -> str:
    if not median > 0.0:
        return "the median is not positive, as all values with a logarithm are: give a positive one, or normal(…)"
    if spread < 0.0:
        return "the spread is negative: give one that is zero or positive"
    return "" if math.log(median) + _FARTHEST * spread < _LARGEST_LOG else _OUT_OF_RANGE


def _triangular_objection(low: float, mode: float, high: float) -> str:
    if not (low <= mode <= high and low < high):
        return "its numbers must rise: give low, mode, high"
    return "" if math.isfinite(high - low) else _OUT_OF_RANGE


_FARTHEST = 10.0  # standard deviations: no generator draws what is as rare
_LARGEST_LOG = math.log(np.finfo(float).max)
_OUT_OF_RANGE = "values that it draws are beyond the range of double precision: give smaller numbers"
_OBJECTIONS: dict[str, Callable[..., str]] = {
    "normal": _normal_objection,
    "uniform": _uniform_objection,
    "lognormal": _lognormal_objection,
    "triangular": _triangular_objection,
    "choice": lambda *values: "" if values else "it has nothing to choose from",
}
_COUNTS = {"normal": 2, "uniform": 2, "lognormal": 2, "triangular": 3, "choice": None}


def normal(mean: Number, deviation: Number) -> Sampler:
    """Values of a normal distribution, by its mean and standard deviation."""
    return Sampler("normal", (mean, deviation))


def uniform(low: Number, high: Number) -> Sampler:
    """Values between two bounds, all of them alike."""
    return Sampler("uniform", (low, high))


def lognormal(median: Number, spread: float) -> Sampler:
    """Positive values whose logarithm has a normal distribution: half lie below `median`, `spread` is its deviation."""
    return Sampler("lognormal", (median, spread))


def triangular(low: Number, mode: Number, high: Number) -> Sampler:
    """Values between two bounds, the most likely one in between."""
    return Sampler("triangular", (low, mode, high))


def choice(*values: Number) -> Sampler:
    """One of some values, all of them alike."""
    return Sampler("choice", values)


@record
class Grid:
    """Values that are all taken, together with all those of other grids."""

    values: tuple[Number, ...]

    def in_si(self, name: str, convert: Callable[[Number], float]) -> Grid:
        """Return the grid with plain numbers; `name` is what it is for."""
        values = [convert(value) for value in self.values]
        if len(values) == 3 and isinstance(self, Line):
            low, high, n = values[0], values[1], int(self.values[2])
            if not math.isfinite(high - low):
                raise RuntimeModelError(f"{name}: linspace({low:g}, {high:g}, {n}): {_OUT_OF_RANGE}")
            return Grid(tuple(np.linspace(low, high, n).tolist()))
        return Grid(tuple(values))


@record
class Line(Grid):
    """A grid of (low, high, number) at equal distances."""


def linspace(low: Number, high: Number, n: int) -> Grid:
    """A grid of `n` values at equal distances from `low` to `high`, both included."""
    if not 1 <= int(n) <= _MOST_GRID_POINTS:
        raise RuntimeModelError(f"linspace: {n} values; give a number from 1 to {_MOST_GRID_POINTS}")
    return Line((low, high, int(n)))


def grid(*values: Number) -> Grid:
    """A grid of these values."""
    if not values:
        raise RuntimeModelError("grid: give at least one value")
    return Grid(tuple(values))


_CALL = re.compile(r"\s*([a-z]+)\s*\((.*)\)\s*\Z")
_SAMPLERS = (*_COUNTS, "linspace", "grid", "noise")


def read_variation(text: str) -> Sampler | Grid | Noise | str:
    """Read how a value varies from a command line: `0.9:1.1:1001`, `normal(1.5, 0.01)`, `choice(1, 2)`, or one value.

    `noise(0.5 N, 10 ms)` is for inputs.

    Nothing is evaluated: numbers and quantities stay text until their unit is known.

    Raises
    ------
    RuntimeModelError
        It is none of these.
    """
    call = _CALL.match(text)
    if call is None:
        parts = [part.strip() for part in text.split(":")]
        if len(parts) == 1:
            return parts[0]
        if len(parts) != 3 or not all(parts):
            raise RuntimeModelError(f"{text!r}: a grid is low:high:number, such as 0.9:1.1:1001")
        return linspace(parts[0], parts[1], _whole(parts[2], text))
    name, parts = call[1], [part.strip() for part in call[2].split(",")]
    if name not in _SAMPLERS:
        raise RuntimeModelError(f"{text!r}: there is no {name!r}; there are {', '.join(_SAMPLERS)}")
    if not all(parts):
        raise RuntimeModelError(f"{text!r}: a value is missing between commas")
    if name == "grid":
        return grid(*parts)
    wanted = {"linspace": 3, "noise": 2}.get(name, _COUNTS.get(name))
    if wanted is not None and len(parts) != wanted:
        raise RuntimeModelError(f"{text!r}: {name} takes {wanted} numbers, not {len(parts)}")
    if name == "noise":
        return noises.noise(_number(parts[0]), _number(parts[1]))
    if name == "linspace":
        return linspace(parts[0], parts[1], _whole(parts[2], text))
    return Sampler(name, tuple(parts))


def _number(text: str) -> Number:
    try:
        return float(text)
    except ValueError:
        return text


def _whole(text: str, whole: str) -> int:
    try:
        return int(text)
    except ValueError:
        raise RuntimeModelError(f"{whole!r}: {text!r} is no number of values") from None


@record
class Column:
    """What varies: a place in `p`, q or v.

    Attributes
    ----------
    name : str
        As the user has it; `dot(x)` for a rate.
    place : {"parameters", "start", "rate"}
    index : int
    values : Sampler, Grid, ndarray or float
    """

    name: str
    place: str
    index: int
    values: Any


class Members:
    """The members of an ensemble: what each one's numbers are, without keeping them.

    Member k takes point k // n of the grids (the last one given turns fastest) and draw k % n, whatever else is run
    and in whatever order: what is drawn for a name follows from the seed, the name and the number of the draw.

    Parameters
    ----------
    columns : sequence of Column
        With values in SI.
    n : int or None
        Draws, or rows, for each point of the grids.
    seed : int
    design : {"random", "sobol", "saltelli"}
        How draws fill their space: each by itself; by a scrambled Sobol' sequence; by one of base points A and B, of
        which row i stands for d + 2 members, A, B, and A with one of its d values from B: Saltelli et al., Computer
        Physics Communications 181 (2010) 259.
    noisy : bool
        Whether members differ by noise at their inputs, too.

    Attributes
    ----------
    n : int
        Of members.
    drawn : list of str
        What is drawn.
    """

    def __init__(
        self,
        columns: Sequence[Column],
        n: int | None,
        seed: int,
        design: str = "random",
        *,
        noisy: bool = False,
    ) -> None:
        self.columns, self.seed, self.design = tuple(columns), int(seed), design
        if n is not None and n < 1:
            raise RuntimeModelError(f"n is {n}: an ensemble has at least one member")
        rows = {len(c.values): c.name for c in columns if isinstance(c.values, np.ndarray)}
        if len(rows) > 1:
            said = ", ".join(f"{name} has {length}" for length, name in rows.items())
            raise RuntimeModelError(f"arrays go row by row, and need one length: {said}")
        if rows and n not in (None, *rows):
            length, name = next(iter(rows.items()))
            raise RuntimeModelError(
                f"n is {n}, but {name} has {length} values: leave n out, or make them agree"
            )
        drawn = [c.name for c in columns if isinstance(c.values, Sampler)]
        if (drawn or noisy) and n is None and not rows:
            raise RuntimeModelError(
                f"n: say how many members to draw: {', '.join(drawn) or 'noise at inputs'} "
                f"{'is' if len(drawn) < 2 else 'are'} drawn"
            )
        if n is not None and n > 1 and not (drawn or rows or noisy):
            raise RuntimeModelError(f"n is {n}, but nothing is drawn: all members would be the same")
        self._each = n if n is not None else next(iter(rows), 1)
        self.drawn = drawn
        if design != "random":
            self._points_of = self._evenly(rows)
        self._grids = [c for c in columns if isinstance(c.values, Grid)]
        self._points = math.prod(len(c.values.values) for c in self._grids)
        self.n = self._points * self._each
        if self.n > _MOST_MEMBERS:
            raise RuntimeModelError(
                f"{self.n:.3g} members are asked for, more than {_MOST_MEMBERS:.0e}: give coarser grids, or draw "
                "members at random"
            )

    def _evenly(self, rows: Any) -> np.ndarray:
        """Return shares from 0 to 1, shape (draws, what is drawn), and set how many draws there are."""
        d, saltelli = len(self.drawn), self.design == "saltelli"
        if not d or (saltelli and rows):
            raise RuntimeModelError(
                f"design {self.design!r}: give what is drawn, such as normal(1, 0.1), and no arrays"
            )
        n = self._each
        if n * (2 * d if saltelli else d) > _MOST_POINTS:
            raise RuntimeModelError(
                f"design {self.design!r}: n is {n}; give {_MOST_POINTS // (2 * d)} at most"
            )
        engine = qmc.Sobol(2 * d if saltelli else d, scramble=True, seed=np.random.default_rng(self.seed))
        points = engine.random_base2(max(n - 1, 1).bit_length())[:n]
        points = np.clip(points, 2.0**-53, 1.0 - 2.0**-53)
        if not saltelli:
            return points
        a, b = points[:, :d], points[:, d:]
        found = np.repeat(a[:, None], d + 2, axis=1)
        found[:, 1] = b
        for k in range(d):
            found[:, 2 + k, k] = b[:, k]
        self._each = n * (d + 2)
        return found.reshape(-1, d)

    @property
    def has_grids(self) -> bool:
        """Whether grids multiply."""
        return bool(self._grids)

    @property
    def vary_parameters(self) -> bool:
        """Whether parameters differ, not starts alone."""
        return any(column.place == "parameters" for column in self.columns)

    @property
    def shape(self) -> dict[str, int]:
        """Lengths of the grids by name, and of what is drawn at each point of them as "draw"."""
        found = {c.name: len(c.values.values) for c in self._grids}
        return {**found, "draw": self._each} if self._each > 1 or not found else found

    def values(self, first: int, last: int) -> dict[str, np.ndarray]:
        """Return what varies for members from `first` up to, not including, `last`, by name."""
        return {c.name: self._column(c, first, last) for c in self.columns}

    def arrays(self, p: np.ndarray, first: int, last: int) -> tuple[np.ndarray, dict[str, np.ndarray]]:
        """Return parameters of members, shape (last - first, n_p), and starts and rates that vary, by their name."""
        rows, starts = np.tile(p, (last - first, 1)), {}
        for column in self.columns:
            values = self._column(column, first, last)
            if column.place == "parameters":
                rows[:, column.index] = values
            else:
                starts[column.name] = values
        return rows, starts

    def _column(self, column: Column, first: int, last: int) -> np.ndarray:
        numbers = np.arange(first, last)
        given = column.values
        if isinstance(given, Grid):
            point, faster = numbers // self._each, 1
            for other in reversed(self._grids):
                if other is column:
                    break
                faster *= len(other.values.values)
            return np.array(given.values, dtype=float)[point // faster % len(given.values)]
        draws = numbers % self._each
        if isinstance(given, Sampler):
            if self.design != "random":
                return given.at(self._points_of[draws, self.drawn.index(column.name)])
            return self._drawn(column, given, draws)
        if isinstance(given, np.ndarray):
            return given[draws]
        return np.full(last - first, float(given))

    def _drawn(self, column: Column, sampler: Sampler, draws: np.ndarray) -> np.ndarray:
        found = np.empty(len(draws))
        own = int.from_bytes(hashlib.sha256(f"{column.place} {column.name}".encode()).digest()[:8], "little")
        blocks = draws // _BLOCK
        for block in np.unique(blocks):
            sequence = np.random.SeedSequence(self.seed, spawn_key=(own & 0xFFFFFFFF, own >> 32, int(block)))
            values = sampler.draw(np.random.Generator(np.random.Philox(sequence)), _BLOCK)
            here = blocks == block
            found[here] = values[draws[here] - block * _BLOCK]
        return found


def named_beside(varied: Mapping[str, Any], series: Collection[str]) -> dict[str, Any]:
    """Return what varies by names that no series has: a start that is kept as a series, too, is `start(name)`."""
    return {f"start({name})" if name in series else name: values for name, values in varied.items()}


def as_mapping(given: Any) -> Mapping[str, Any]:
    """Return what varies by name; the columns of a DataFrame are."""
    if given is None:
        return {}
    if hasattr(given, "columns") and hasattr(given, "to_numpy"):
        return {str(name): np.asarray(given[name], dtype=float) for name in given.columns}
    return given
