"""What a recording shows, and where on the screen: plots, camera, trails. `rrd` carries it out."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from symgen.runtime.names import integral_places, motion_records, rate_labels

from . import schema

_CURVES_IN_PLOT = 12  # more in one plot cannot be told apart
_LABEL = 16.0  # points between labels of a vertical axis: where they would stand closer, the viewer leaves them out
_FEWEST_LABELS, _MOST_LABELS = 3, 20
_HEIGHT, _AROUND = 740.0, 46.0  # of all plots in a small window, of the frame around each [points]
_AXIS_MARGIN = 0.07  # of the range of the curves, on either side
_BEYOND = 0.2  # of the distance of labels, beyond an outer one: it is not cut off
_SHARES = {
    "coordinates": 2.6,
    "inputs": 2.0,
    "outputs": 2.0,
    "energy": 2.0,
    "diagnostics": 2.0,
}  # of the height, by row
_LOGARITHMS = ("balance", "residual")
_DECADES = 2.0  # that their axes span at least
_TOGETHER = ("energy", "residual")  # curves that are to be compared
_MOST_PLOTS = 4  # of one kind and unit; more curves slow a viewer down
_READABLE = 1 / 25  # of the height of a plot: a curve that moves less than that looks like a straight line
_MOST_TRAILS = 24
_TAN_HALF_VIEW = np.tan(np.radians(30.0) / 2)  # of the vertical field of view in space
_FAR_AWAY = 200.0  # half heights of the view from which plane models are seen: rays are parallel to 1 in 200
_ASPECT = 1.1  # of the width of the scene's view to its height
_MARGIN = 1.1
_SLANT = np.array([0.62, -0.68, 0.38]) / np.linalg.norm([0.62, -0.68, 0.38])
_TRAVELS = 8.0  # scenes move on when their middle goes farther than this many times what is in view at once,
_ASTRAY = 6.0  # on a way that is not many times longer: what goes to and fro stays
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
        Which array: `q`, `v`, `inputs`, `outputs`, `energy`, `balance`, `residual`, `multipliers` or `step_size`.
    columns : tuple of int
    names : tuple of str
    shown : tuple of bool
        Which of them a view of the plot shows; empty: all.
    bounds : tuple of float or None
        What the vertical axis spans; None: what is there.
    note : bool
        It is a text that stands in for the plot.
    """

    title: str
    path: str
    source: str
    columns: tuple[int, ...]
    names: tuple[str, ...]
    shown: tuple[bool, ...] = ()
    bounds: tuple[float, float] | None = None
    note: bool = False


@dataclass(frozen=True)
class Row:
    """Plots as tabs of one panel, and its share of the height."""

    plots: tuple[Curves, ...]
    share: float


@dataclass(frozen=True)
class Camera:
    """Where the eye is and how it looks.

    Attributes
    ----------
    eye : ndarray, shape (3,) [m]
        In world axes.
    axes : ndarray, shape (3, 3)
        Rows in world axes: to the right, up, towards the eye.
    opening : float
        Tangent of half the vertical field of view.
    path : ndarray, shape (n, 3), or None [m]
        Where the eye is at each frame, of scenes that move on.
    """

    eye: np.ndarray
    axes: np.ndarray
    opening: float
    path: np.ndarray | None = None


@dataclass(frozen=True)
class Layout:
    """The screen: a 3-D view beside rows of plots.

    Attributes
    ----------
    planar : bool
        All bodies move in the x-y plane: it is looked at from +z.
    camera : Camera or None
        None: there are no bodies to look at.
    times : ndarray, shape (n,) [s]
        Of the frames at which the camera may move.
    grid : float
        Spacing of the grid [m].
    trails : tuple of (str, bool)
        Bodies with a trail, and whether it is shown at first.
    folders : tuple of (str, bool)
        Entity folders of joints, springs, forces and so on, and whether each is shown at first.
    trail_seconds : float
        How much of the past a trail shows [s of simulated time].
    rows : tuple of Row
    speed : float
        Simulated seconds per second of playback.
    seconds : tuple of float [s]
        The simulated time that plots span.
    every : int
        Of how many frames the camera may move at one.
    """

    planar: bool
    camera: Camera | None
    times: np.ndarray
    grid: float
    trails: tuple[tuple[str, bool], ...]
    folders: tuple[tuple[str, bool], ...]
    trail_seconds: float
    rows: tuple[Row, ...]
    speed: float
    seconds: tuple[float, float]
    every: int = 1


def plot_rows(header: dict, over_time: Collection[str] = ()) -> tuple[Row, ...]:
    """Return the plots of a model, row by row.

    Parameters
    ----------
    header : dict
        `MODEL` of the generated module.
    over_time : collection of str
        Inputs that are not constant.
    """
    m = len(header["constraints"])
    labels = rate_labels(header["coordinates"], header["rates"])
    names_of_rates = [{**rate, "name": label} for rate, label in zip(header["rates"], labels)]
    states, coordinates = (
        header.get("states", ()),
        motion_records(header["coordinates"], integral_places(header)),
    )
    driven = [(k, u) for k, u in enumerate(header.get("inputs", ())) if u["name"] in over_time]
    multipliers = [(k, {**c, "unit": c.get("multiplier", "")}) for k, c in enumerate(header["constraints"])]
    energy = Curves(
        "Energy [J]", schema.ENERGY, "energy", (0, 1, 2), ("kinetic T", "potential V", "total T + V")
    )
    balance = Curves(
        "Energy error, log10 of [1]",
        schema.BALANCE,
        "balance",
        (0,),
        ("|T + V − work − initial| / largest",),
    )
    residual = Curves(
        "Constraint residual, log10 of SI units",
        schema.RESIDUAL,
        "residual",
        (0, 1),
        ("largest, positions", "largest, velocities"),
    )
    step = Curves("Step size [s]", schema.STEP_SIZE, "step_size", (0,), ("h",))
    rows = {
        "coordinates": [
            *_by_unit("coordinates", "Coordinates", "q", coordinates),
            *_by_unit("rates", "Rates", "v", motion_records(names_of_rates, states)),
            *_by_unit("states", "States", "v", [(k, names_of_rates[k]) for k in states]),
        ],
        "inputs": _by_unit("inputs", "Inputs", "inputs", driven),
        "outputs": _by_unit("outputs", "Outputs", "outputs", list(enumerate(header["outputs"]))),
        "energy": [energy, *_by_unit("multipliers", "Multipliers", "multipliers", multipliers)],
        "diagnostics": [balance, *([residual] if m else []), step],
    }
    return tuple(Row(tuple(plots), _SHARES[name]) for name, plots in rows.items() if plots)


def with_equal_steps(rows: tuple[Row, ...]) -> tuple[Row, ...]:
    """Return rows in which a text stands in for the plot of step sizes."""
    text = Curves("Step size", schema.EQUAL_STEPS, "", (), (), note=True)
    return tuple(
        replace(row, plots=tuple(text if x.source == "step_size" else x for x in row.plots)) for row in rows
    )


def _by_unit(path: str, title: str, source: str, quantities: list[tuple[int, dict]]) -> list[Curves]:
    """Group quantities of one unit, given with their places, into one plot: angles and lengths do not share an axis."""
    units = list(dict.fromkeys(quantity["unit"] for _, quantity in quantities))
    groups = []
    for number, unit in enumerate(units):
        some = [(i, quantity["name"]) for i, quantity in quantities if quantity["unit"] == unit]
        members, names = [i for i, _ in some], [name for _, name in some]
        where = f"{schema.PLOTS}/{path}" + (f"/{number + 1}" if len(units) > 1 else "")
        groups += _curves(f"{title} [{unit}]" if unit else title, where, source, members, names)
    return groups


def _curves(title: str, path: str, source: str, columns, names) -> list[Curves]:
    """Return one plot, or several where curves are too many for one."""
    columns, names, n = tuple(columns), tuple(names), _CURVES_IN_PLOT
    if len(columns) <= n:
        return [Curves(_named(title, names), path, source, columns, names)]
    plots = []
    for first in range(0, min(len(columns), _MOST_PLOTS * n), n):
        last = min(first + n, len(columns))
        part = f"{title} {first + 1} to {last} of {len(columns)}"
        plots.append(Curves(part, f"{path}/from_{first + 1}", source, columns[first:last], names[first:last]))
    return plots


def _named(title: str, names: Sequence[str]) -> str:
    """Return the title of a plot; that of one curve has its name, which no legend has to say then."""
    return f"{title}: {names[0]}" if len(names) == 1 else title


def readable(
    rows: tuple[Row, ...], low: dict[str, np.ndarray], high: dict[str, np.ndarray]
) -> tuple[Row, ...]:
    """Return rows whose axes have labels; curves that would be flat beside larger ones get a plot of their own.

    Parameters
    ----------
    low, high : dict of ndarray
        The smallest and largest values of all columns, by source; sources that are not there stay as they are.
    """
    total = sum(row.share for row in rows)
    result = []
    for row in rows:
        room = int((_HEIGHT * row.share / total - _AROUND) / _LABEL)
        plots = [
            part
            for curves in row.plots
            for part in _split_by_size(curves, low.get(curves.source), high.get(curves.source), room)
        ]
        result.append(replace(row, plots=tuple(plots)))
    return tuple(result)


def _split_by_size(
    curves: Curves, low: np.ndarray | None, high: np.ndarray | None, room: int
) -> list[Curves]:
    if low is None or high is None:
        return [curves]
    columns = list(curves.columns)
    bottom, top = low[columns], high[columns]
    if not (np.isfinite(bottom).all() and np.isfinite(top).all()):
        return [curves]
    if curves.source in _LOGARITHMS:
        top = np.maximum(top, bottom.min() + _DECADES)
    flat = (top - bottom < _READABLE * (top.max() - bottom.min())) & (top > bottom)
    if curves.source in _TOGETHER or not flat.any() or flat.all():
        return [replace(curves, bounds=labelled(bottom.min(), top.max(), room))]
    parts = []
    for shown in (~flat, flat):
        names = [name for name, is_shown in zip(curves.names, shown) if is_shown]
        title = (
            f"{curves.title}: {', '.join(names)}"
            if len(names) < 4
            else f"{curves.title}, {len(names)} of them"
        )
        bounds = labelled(bottom[shown].min(), top[shown].max(), room)
        parts.append(replace(curves, title=title, shown=tuple(map(bool, shown)), bounds=bounds))
    return parts


def labelled(low: float, high: float, room: int) -> tuple[float, float]:
    """Return what a vertical axis has to span so that at least three labels stand at it.

    The viewer labels multiples of a power of ten, and only of one that leaves room for its labels: a curve between
    -130 and 130 would have 0 alone.

    Parameters
    ----------
    low, high : float
        The smallest and largest value of the curves.
    room : int
        For how many labels there is room.
    """
    room = int(np.clip(room, 2 * _FEWEST_LABELS, _MOST_LABELS))
    least = 1e-4 * max(abs(low), abs(high)) or 1.0
    if high - low < least:
        low, high = (low + high) / 2 - least / 2, (low + high) / 2 + least / 2
    margin = _AXIS_MARGIN * (high - low)
    low, high = low - margin, high + margin
    power = 10.0 ** np.floor(np.log10(high - low))
    unit = next(unit for unit in (power / 10.0, power, 10.0 * power) if high - low <= room * unit)
    while (first := np.ceil(low / unit)) + _FEWEST_LABELS - 1 > np.floor(high / unit):
        # The nearer one of the next multiples on either side.
        if low - (first - 1) * unit < (np.floor(high / unit) + 1) * unit - high:
            low = (first - 1 - _BEYOND) * unit
        else:
            high = (np.floor(high / unit) + 1 + _BEYOND) * unit
    return float(low), float(high)


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
    """Return a colour for each body: its own, or of the palette; rods that pair with others have a paler tone."""
    chosen = _from_palette(bodies)
    return [_own_colour(body) or colour for body, colour in zip(bodies, chosen)]


def _own_colour(body: dict) -> tuple[int, int, int] | None:
    text = body.get("color", "")
    return tuple(int(text[k : k + 2], 16) for k in (1, 3, 5)) if text else None


def _from_palette(bodies: list[dict]) -> list[tuple[int, int, int]]:
    rods = [i for i, body in enumerate(bodies) if body["shape"] in _RODS]
    others = [i for i, body in enumerate(bodies) if body["shape"] not in _RODS]
    if len(rods) != len(others):
        return [schema.colour(i) for i in range(len(bodies))]
    colours = dict(zip(others, map(schema.colour, range(len(others)))))
    pale = {rod: tuple((c + 2 * _PALE) // 3 for c in colours[other]) for rod, other in zip(rods, others)}
    return [{**colours, **pale}[i] for i in range(len(bodies))]


def eye_axes(planar: bool) -> np.ndarray:
    """Return the axes of the eye as rows in world axes: to the right, up, towards the eye.

    Plane models are seen from +z with y up; others from above at a slant with z up.
    """
    if planar:
        return np.eye(3)
    right = np.cross([0.0, 0.0, 1.0], _SLANT)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(_SLANT, right), _SLANT])


def choose_camera(low: np.ndarray, high: np.ndarray, planar: bool, path: np.ndarray | None = None) -> Camera:
    """Place the eye so that a box fills the view.

    Parameters
    ----------
    low, high : ndarray, shape (3,) [m]
        Corners of the box that the bodies stay in, along the axes of the eye.
    planar : bool
        Seen from so far away that rays are parallel, as in a technical drawing.
    path : ndarray, shape (n, 3), optional [m]
        By how much the box has moved at each frame, in world axes.
    """
    axes, middle, half = eye_axes(planar), (low + high) / 2, (high - low) / 2
    radius = _MARGIN * max(half[0] / _ASPECT, half[1], 1e-9)
    opening = 1.0 / _FAR_AWAY if planar else _TAN_HALF_VIEW
    distance = half[2] + radius / opening
    eye = axes.T @ middle + distance * axes[2]
    return Camera(eye, axes, opening, None if path is None else path + eye)


def follow(middles: np.ndarray, in_view: np.ndarray) -> np.ndarray | None:
    """Return how the eye has to move so that it keeps a scene in view that moves on; None where it does not.

    Only along axes on which the scene goes farther than it is large: a car is followed along its road, and heaves.

    Parameters
    ----------
    middles : ndarray, shape (n, 3) [m]
        Of the bodies at each frame.
    in_view : ndarray, shape (3,) [m]
        How much room they take at once, along each axis.
    """
    if not len(middles) or not np.isfinite(middles).all():
        return None
    moved, far = middles - middles[0], np.ptp(middles, axis=0)
    way = np.abs(np.diff(middles, axis=0)).sum(axis=0)
    goes_on = (far > _TRAVELS * max(float(in_view.max()), 1e-12)) & (way <= _ASTRAY * far)
    return np.where(goes_on, moved, 0.0) if goes_on.any() else None


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
