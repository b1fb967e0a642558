"""The scenes as Exudyn's own multibody models: it has no way to take equations that are compiled elsewhere."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace

import numpy as np
from exudyn_mechanisms import andrews, car_axis, four_bar, n_four_bar, slider_crank, spring_pendulum
from exudyn_model import Model
from exudyn_space import bricard, heavy_top, heavy_top_absolute, pendula
from job import Job


def build(job: Job) -> Model | None:
    """Return the model of a scene with its start, None where none is written."""
    maker = MAKERS.get(job.system.name)
    if maker is None:
        return None
    names = [entry["name"] for entry in (*job.system.parameters, *job.system.inputs)]
    p = dict(zip(names, job.p.tolist(), strict=True))
    p |= {entry["name"]: entry["value"] for entry in job.system.constants}
    return maker(SimpleNamespace(**p), job.start[: job.system.nq], job.start[job.system.nq :])


MAKERS: dict[str, Callable[[SimpleNamespace, np.ndarray, np.ndarray], Model]] = {
    "pendulum": lambda p, q, v: pendula([p.m], [p.L], p.g, 1, q, v),
    "double_pendulum": lambda p, q, v: pendula([p.m1, p.m2], [p.L1, p.L2], p.g, 1, q, v),
    "double_pendulum_level": lambda p, q, v: pendula([p.m1, p.m2], [p.L1, p.L2], p.g, 0, q, v),
    "n_pendulum": lambda p, q, v: pendula([p.m] * len(q), [p.L] * len(q), p.g, 1, q, v),
    "spinning_top": heavy_top,
    "heavy_top_absolute": heavy_top_absolute,
    "stiff_spring_pendulum": lambda p, q, v: spring_pendulum(p.eps**-2, 0.0, 1.0, 1.0, 1.0, q, v),
    "damped_spring_pendulum": lambda p, q, v: spring_pendulum(p.k, p.c, p.l0, p.m, p.g, q, v),
    "slider_crank": slider_crank,
    "four_bar": four_bar,
    "n_four_bar": n_four_bar,
    "andrews_squeezer": andrews,
    "car_axis": car_axis,
    "bricard": bricard,
}
