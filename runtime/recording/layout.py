"""What a recording shows, and where on the screen: plots, camera, trails. `rrd` carries it out."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace

import numpy as np

from symgen.runtime.names import rate_labels

from . import schema

_CURVES_IN_PLOT = 12  # more in one plot cannot be told apart
_MOST_PLOTS = 4  # of one kind and unit; more curves slow a viewer down
_READABLE = 1 / 25  # of the height of a plot: a curve that moves less than that looks like a straight line
_MOST_TRAILS = 24
_TAN_HALF_VIEW = np.tan(np.radians(55.0) / 2)  # a viewer's usual vertical field of view
_ASPECT = 1.1  # of the width of the scene's view to its height
_MARGIN = 1.1
_SLANT = np.array([0.62, -0.68, 0.38]) / np.linalg.norm([0.62, -0.68, 0.38])
_PALE = 200
_RODS = ("capsule", "cylinder")


@dataclass(frozen=True)
class Curves:
    """One plot: columns of one array of values.

    Attributes
    ----------
    title : str
    path : str
        Entity path.
    source : str
        Which array: `q`, `v`, `outputs`, `energy`, `balance`, `residual`, `multipliers` or `step_size`.
    columns : tuple of int
    names : tuple of str
    shown : tuple of bool
        Which of them a view of the plot shows; empty: all.
    """

    title: str
    path: str
    source: str
    columns: tuple[int, ...]
    names: tuple[str, ...]
    shown: tuple[bool, ...] = ()


@dataclass(frozen=True)
class Camera:
    """Where the eye is, what it looks at, and which way is up, in world axes [m]."""

    eye: tuple[float, float, float]
    target: tuple[float, float, float]
    up: tuple[float, float, float]


@dataclass(frozen=True)
class Layout:
    """The screen: a 3-D view beside rows of plots.

    Attributes
    ----------
    planar : bool
        All bodies move in the x-y plane: it is looked at from +z.
    camera : Camera or None
        None: there are no bodies to look at.
    grid : float
        Spacing of the grid [m].
    trails : tuple of (str, bool)
        Bodies with a trail, and whether it is shown at first.
    folders : tuple of (str, bool)
        Entity folders of joints, springs, forces and so on, and whether each is shown at first.
    trail_seconds : float
        How much of the past a trail shows [s of simulated time].
    rows : tuple of tuple of Curves
        Each row is a stack of tabs.
    speed : float
        Simulated seconds per second of playback.
    """

    planar: bool
    camera: Camera | None
    grid: float
    trails: tuple[tuple[str, bool], ...]
    folders: tuple[tuple[str, bool], ...]
    trail_seconds: float
    rows: tuple[tuple[Curves, ...], ...]
    speed: float


def plot_rows(header: dict) -> tuple[tuple[Curves, ...], ...]:
    """Return the plots of a model, row by row."""
    m = len(header["constraints"])
    coordinates = _by_unit("coordinates", "Coordinates", "q", header["coordinates"])
    labels = rate_labels(header["coordinates"], header["rates"])
    names_of_rates = [{**rate, "name": label} for rate, label in zip(header["rates"], labels)]
    rates = _by_unit("rates", "Rates", "v", names_of_rates)
    outputs = _by_unit("outputs", "Outputs", "outputs", header["outputs"])
    energy = Curves("Energy", schema.ENERGY, "energy", (0, 1, 2), ("kinetic T", "potential V", "total T + V"))
    balance = Curves(
        "Energy balance error, log10",
        schema.BALANCE,
        "balance",
        (0,),
        ("|T + V − work − initial| / largest",),
    )
    step = Curves("Step size", schema.STEP_SIZE, "step_size", (0,), ("h [s]",))
    residual = Curves(
        "Constraint residual, log10",
        schema.RESIDUAL,
        "residual",
        (0, 1),
        ("largest, positions", "largest, velocities"),
    )
    if not m:
        return _filled([coordinates + rates, outputs, [energy], [balance], [step]])
    names = [constraint["name"] for constraint in header["constraints"]]
    multipliers = _curves("Multipliers", schema.MULTIPLIERS, "multipliers", range(m), names)
    return _filled([coordinates + rates, outputs, [energy, balance], [*multipliers, residual], [step]])


def _filled(rows: list[list[Curves]]) -> tuple[tuple[Curves, ...], ...]:
    return tuple(tuple(row) for row in rows if row)


def _by_unit(path: str, title: str, source: str, quantities: list[dict]) -> list[Curves]:
    """Group quantities of one unit into one plot: angles and lengths do not share an axis."""
    units = list(dict.fromkeys(quantity["unit"] for quantity in quantities))
    groups = []
    for number, unit in enumerate(units):
        members = [i for i, quantity in enumerate(quantities) if quantity["unit"] == unit]
        names = [quantities[i]["name"] for i in members]
        where = f"{schema.PLOTS}/{path}" + (f"/{number + 1}" if len(units) > 1 else "")
        groups += _curves(f"{title} [{unit}]" if unit else title, where, source, members, names)
    return groups


def _curves(title: str, path: str, source: str, columns, names) -> list[Curves]:
    """Return one plot, or several where curves are too many for one."""
    columns, names, n = tuple(columns), tuple(names), _CURVES_IN_PLOT
    if len(columns) <= n:
        return [Curves(title, path, source, columns, names)]
    plots = []
    for first in range(0, min(len(columns), _MOST_PLOTS * n), n):
        last = min(first + n, len(columns))
        part = f"{title} {first + 1} to {last} of {len(columns)}"
        plots.append(Curves(part, f"{path}/from_{first + 1}", source, columns[first:last], names[first:last]))
    return plots


def readable(
    rows: tuple[tuple[Curves, ...], ...], low: dict[str, np.ndarray], high: dict[str, np.ndarray]
) -> tuple[tuple[Curves, ...], ...]:
    """Return rows in which curves that would be flat beside larger ones have a plot of their own.

    Parameters
    ----------
    low, high : dict of ndarray
        The smallest and largest values of all columns, by source; sources that are not there stay as they are.
    """
    return tuple(
        tuple(
            part
            for curves in row
            for part in _split_by_size(curves, low.get(curves.source), high.get(curves.source))
        )
        for row in rows
    )


def _split_by_size(curves: Curves, low: np.ndarray | None, high: np.ndarray | None) -> list[Curves]:
    if low is None or high is None or len(curves.columns) < 2:
        return [curves]
    columns = list(curves.columns)
    bottom, top = low[columns], high[columns]
    if not (np.isfinite(bottom).all() and np.isfinite(top).all()):
        return [curves]
    flat = (top - bottom < _READABLE * (top.max() - bottom.min())) & (top > bottom)
    if not flat.any() or flat.all():
        return [curves]
    parts = []
    for shown in (~flat, flat):
        names = [name for name, is_shown in zip(curves.names, shown) if is_shown]
        title = (
            f"{curves.title}: {', '.join(names)}"
            if len(names) < 4
            else f"{curves.title}, {len(names)} of them"
        )
        parts.append(replace(curves, title=title, shown=tuple(map(bool, shown))))
    return parts


def choose_trails(bodies: list[dict]) -> tuple[tuple[str, bool], ...]:
    """Return the bodies that get a trail, and whether it is shown at first.

    The path of a rod's middle says little, so rods' trails start hidden where there are other bodies.
    """
    shown = [body["shape"] not in _RODS for body in bodies]
    if not any(shown):
        shown = [True] * len(bodies)
    chosen = sorted(range(len(bodies)), key=lambda i: (not shown[i], i))[:_MOST_TRAILS]
    return tuple((bodies[i]["name"], shown[i]) for i in sorted(chosen))


def choose_colours(bodies: list[dict]) -> list[tuple[int, int, int]]:
    """Return a colour for each body; rods that pair with the other bodies have a paler tone of theirs."""
    rods = [i for i, body in enumerate(bodies) if body["shape"] in _RODS]
    others = [i for i, body in enumerate(bodies) if body["shape"] not in _RODS]
    if len(rods) != len(others):
        return [schema.colour(i) for i in range(len(bodies))]
    colours = dict(zip(others, map(schema.colour, range(len(others)))))
    pale = {rod: tuple((c + 2 * _PALE) // 3 for c in colours[other]) for rod, other in zip(rods, others)}
    return [{**colours, **pale}[i] for i in range(len(bodies))]


def choose_camera(low: np.ndarray, high: np.ndarray, planar: bool) -> Camera:
    """Place the eye so that the box fills the view.

    Parameters
    ----------
    low, high : ndarray, shape (3,) [m]
        Corners of the box that the bodies stay in.
    planar : bool
        Look from +z with y up; else from above at a slant with z up.
    """
    centre = (low + high) / 2
    half = (high - low) / 2
    if planar:
        distance = _MARGIN * max(half[0] / _ASPECT, half[1], 1e-9) / _TAN_HALF_VIEW + half[2]
        return Camera((centre[0], centre[1], centre[2] + distance), tuple(centre), (0.0, 1.0, 0.0))
    corners = np.array(list(itertools.product(*zip(-half, half))))
    right = np.cross([0.0, 0.0, 1.0], _SLANT)
    right /= np.linalg.norm(right)
    across, upwards = np.abs(corners @ right) / _ASPECT, np.abs(corners @ np.cross(_SLANT, right))
    nearest = corners @ _SLANT + _MARGIN * np.maximum(across, upwards) / _TAN_HALF_VIEW
    distance = max(float(nearest.max()), 1e-9)
    return Camera(tuple(centre + distance * _SLANT), tuple(centre), (0.0, 0.0, 1.0))


def round_down(value: float) -> float:
    """Return the largest of 1, 2, 5 times a power of ten that is not above `value` (positive)."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(power * max(digit for digit in (1.0, 2.0, 5.0) if digit * power <= value * (1 + 1e-12)))


def choose_speed(seconds: float) -> float:
    """Return a playback speed at which a run lasts 4 s to 60 s on the screen; 1 where real time does that."""
    if not seconds > 0.0:
        return 1.0
    if seconds < 4.0:
        return round_down(seconds / 4.0) if seconds / 4.0 < 0.5 else 1.0
    return max(1.0, round_down(seconds / 30.0)) if seconds > 60.0 else 1.0
