"""What an ensemble has come to: series by name, statistics, verdicts, and members again in full."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.runtime.ensemble.member import end_again, member_again
from symgen.runtime.ensemble.sampling import named_beside
from symgen.runtime.ensemble.verdict import CAUSES, VERDICTS, Verdicts
from symgen.runtime.errors import RuntimeModelError, UnknownNameError, nearest
from symgen.runtime.integrate.methods import find_method
from symgen.runtime.lazy import Late
from symgen.runtime.record import record

if TYPE_CHECKING:
    import pandas
    import xarray
    from matplotlib.figure import Figure

    from symgen.runtime.ensemble.plan import Plan
    from symgen.runtime.ensemble.sensitivity import Sensitivity
    from symgen.runtime.ensemble.tally import Tally
    from symgen.runtime.ensemble.zarr_store import ZarrStore
    from symgen.runtime.solution import Solution

analysis = Late("symgen.runtime.ensemble.sensitivity")
recording = Late("symgen.runtime.recording.members")
export = Late("symgen.runtime.ensemble.export")

_RECORDED, _FPS, _FEWEST_FRAMES, _MOST_FRAMES = 24, 60.0, 200, 1200  # of members in one recording
_SAMPLE = 64  # members of which errors are estimated
_TIGHTER = 1.0 / 30.0


@record
class EnsembleHealth:
    """Whether members can be trusted.

    Attributes
    ----------
    n : int
        Members that were run.
    n_failed, n_doubtful : int
        Members without a result, and with one that a check objects to.
    worst : list of int
        Members that failed or are doubtful, the first thousand.
    causes : dict of str to int
        Why members failed, and how many.
    largest_energy_error, largest_residual : float
        Over all members that reached their end.
    step : float or None [s]
        Of a method of fixed step.
    """

    n: int
    n_failed: int
    n_doubtful: int
    worst: list[int]
    causes: dict[str, int]
    largest_energy_error: float
    largest_residual: float
    step: float | None = None

    @property
    def ok(self) -> bool:
        """Whether every member has a result that no check objects to."""
        return not (self.n_failed or self.n_doubtful)

    def lines(self) -> list[str]:
        """Return the report in words."""
        said = [f"{self.n - self.n_failed - self.n_doubtful} of {self.n} members are ok"]
        if self.n_failed:
            causes = "; ".join(f"{count}: {cause}" for cause, count in self.causes.items())
            said.append(
                f"{self.n_failed} failed ({self.n_failed / self.n:.2%})" + (f": {causes}" if causes else "")
            )
        if self.n_doubtful:
            why = (
                f"their motion, energy balance or constraints are off; try a smaller step than {self.step:g} s"
                if self.step
                else "their energy balance or constraints are off by more than the tolerance explains; try a "
                "smaller rtol"
            )
            said.append(f"{self.n_doubtful} are doubtful ({self.n_doubtful / self.n:.2%}): {why}")
        if self.worst:
            few = ", ".join(map(str, self.worst[:5]))
            said.append(f"look at member{'s' * (len(self.worst) > 1)} {few}{' …' * (len(self.worst) > 5)}")
        return said


class StoredVerdicts:
    """Verdicts of members in a store, read when they are asked for."""

    def __init__(self, store: ZarrStore) -> None:
        self._store = store

    def __getattr__(self, name: str) -> np.ndarray:
        if name not in VERDICTS:
            raise AttributeError(name)
        return self._store.read(name)


@dataclass(eq=False, repr=False)
class Ensemble:
    """The members of an ensemble after their runs.

    `e["theta1"]` is a series: shape (n,) at the end, or (n, F) at the times `e.t`; a member that failed has no numbers.

    Attributes
    ----------
    plan : Plan
    tally : Tally
        How many were run, failed, are doubtful; the first ones by name.
    series : dict of str to ndarray
        What is kept here, not in a store.
    verdicts : Verdicts
        Of members that are kept.
    reduced : dict of str to dict
        Statistics by the name of what was reduced, then by their own.
    store : ZarrStore, optional
        Where the members are.
    """

    plan: Plan
    tally: Tally
    series: dict[str, np.ndarray]
    verdicts: Verdicts | StoredVerdicts
    reduced: dict[str, dict[str, Any]]
    store: ZarrStore | None = None
    present: Callable[[Solution], Any] | None = None  # what makes of a run as data one with doors

    @property
    def n_done(self) -> int:
        """Members that were run: all, unless the ensemble was interrupted."""
        return self.tally.n

    @property
    def n_failed(self) -> int:
        """Members without a result."""
        return self.tally.n_failed

    @property
    def n_doubtful(self) -> int:
        """Members with a result that a check objects to."""
        return self.tally.n_doubtful

    @property
    def messages(self) -> dict[int, str]:
        """Why members failed that could not begin or ran by themselves, by their number; the first thousand."""
        return self.tally.messages

    @property
    def n(self) -> int:
        """The number of members."""
        return self.plan.members.n

    def __len__(self) -> int:
        return self.n

    @property
    def t(self) -> np.ndarray:
        """The times of series [s]: the frames, or the end alone."""
        return self.plan.frame_times if len(self.plan.frame_times) else np.array([self.plan.single.t_end])

    @property
    def method(self) -> str:
        """The method that was used."""
        return self.plan.method

    @property
    def notes(self) -> list[str]:
        """What was chosen on the way."""
        return self.plan.notes

    @property
    def names(self) -> list[str]:
        """The names of series that are kept."""
        return list(self.series) if self.store is None else list(self.store.about["series"])

    def __getitem__(self, name: str) -> np.ndarray:
        """Return a series that is kept, or what varies between members, by name."""
        if name in self.names:
            return self.series[name] if self.store is None else self.store.read(name)
        varied = named_beside(self.varied, self.names)
        if name in varied:
            return varied[name]
        raise UnknownNameError(
            f"the ensemble has kept no {name!r}: {nearest(name, [*self.names, *varied])}; `keep` says what is"
        )

    @cached_property
    def varied(self) -> dict[str, np.ndarray]:
        """What varies between members, by name, shape (n,)."""
        return self.plan.members.values(0, self.n)

    @property
    def shape(self) -> dict[str, int]:
        """Lengths of the grids by name, and of what is drawn at each of their points: members in this shape."""
        return self.plan.members.shape

    @property
    def failed(self) -> np.ndarray:
        """The numbers of members without a result; where nothing is kept, the first ones."""
        if not len(self.verdicts.status):
            return np.array(self.tally.failed, dtype=int)
        return self._chosen(lambda status, ok: status != 1)

    @property
    def doubtful(self) -> np.ndarray:
        """The numbers of members with a result that a check objects to, as far as they are kept."""
        return self._chosen(lambda status, ok: (status == 1) & ~ok)

    def _chosen(self, choose: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> np.ndarray:
        status, ok = self.verdicts.status, self.verdicts.ok
        return np.flatnonzero(choose(status, ok) & (status != 0))

    @property
    def health(self) -> EnsembleHealth:
        """Whether members can be trusted; `verdicts` has it for each."""
        known = self.tally
        causes = {CAUSES[status]: count for status, count in sorted(known.causes.items())}
        return EnsembleHealth(
            known.n, known.n_failed, known.n_doubtful, known.named, causes, known.largest_energy_error,
            known.largest_residual, self.plan.single.step,
        )  # fmt: skip

    def accuracy(self, sample: int = _SAMPLE) -> dict[str, Any]:
        """Estimate errors at the end by running some members again at a thirtieth of the tolerance, or half the step.

        Parameters
        ----------
        sample : int
            How many, spread evenly.

        Returns
        -------
        dict
            `members`, their numbers, and the largest difference of each at the end as `errors`, in parts of the range
            that each coordinate and rate has over the sample, or of its size where that is larger.

        Raises
        ------
        RuntimeModelError
            Members ran one after another: `member(k).health` estimates errors of each.
        """
        if self.plan.settings is None:
            raise RuntimeModelError(
                "accuracy: members ran one after another; member(k).health has their errors"
            )
        numbers = np.unique(np.linspace(0, self.n - 1, min(sample, self.n)).astype(int))
        ends, order = end_again(self.plan, numbers), find_method(self.plan.method).order
        better = end_again(self.plan, numbers, 0.5 if self.plan.settings.step else _TIGHTER)
        remains = (
            1.0 / (1.0 - 0.5**order) if self.plan.settings.step else 1.0
        )  # of Richardson's extrapolation
        n = self.plan.system.nq + self.plan.system.nv
        with np.errstate(invalid="ignore"):
            scale = np.fmax(np.nanmax(np.abs(better[:, :n]), axis=0), 1e-300)
            errors = remains * np.nanmax(np.abs(ends - better)[:, :n] / scale, axis=1)
        return {"members": numbers, "errors": errors}

    def sensitivity(self, name: str) -> Sensitivity:
        """Return Sobol' indices: what of the variance of a quantity at the end comes from which of the values drawn.

        With `design="saltelli"` the first-order and total indices; of plain draws the first-order ones (SALib).

        Raises
        ------
        RuntimeModelError
            Grids multiply beside the draws, members are missing, or nothing varies.
        """
        values = self[name]
        if self.n_done < self.n:
            raise RuntimeModelError(
                f"sensitivity: {self.n_done} of {self.n} members are done; run the others first"
            )
        return analysis.sensitivity(self.plan.members, values if values.ndim == 1 else values[:, -1])

    def member(self, number: int, t_eval: Any = None) -> Solution:
        """Run a member again, in full: its end is the same to the last bit.

        Parameters
        ----------
        number : int
            From 0 on; a negative one counts from the end.
        t_eval : sequence of float, optional [s]
            Times of its frames, as in `system.run`.
        """
        found = member_again(self.plan, int(number) + (self.n if number < 0 else 0), t_eval)
        return found if self.present is None else self.present(found)

    def record(
        self, path: str | os.PathLike[str], members: int | Sequence[int] = _RECORDED, fps: float | None = None
    ) -> None:
        """Write a recording in which the bodies of several members move over each other, each in a colour of its own.

        Parameters
        ----------
        path : path-like
            An `.rrd` file, for `symgen play`.
        members : int or sequence of int
            How many, spread evenly over those that have a result; or which.
        fps : float, optional
            Frames per second of simulated time; 60 by default, but at least 200 and at most 1200 frames in all.
        """
        if isinstance(members, int):
            lost = set(self.tally.failed)
            there = [k for k in range(min(self.n, 100 * members + len(lost))) if k not in lost]
            if self.n > len(there) + len(lost):
                there = [
                    k for k in np.linspace(0, self.n - 1, 4 * members).astype(int).tolist() if k not in lost
                ]
            members = (
                [there[k] for k in np.unique(np.linspace(0, len(there) - 1, members).astype(int))]
                if there
                else []
            )
        if not len(members):
            raise RuntimeModelError("record: there are no members with a result to be shown")
        single = self.plan.single
        seconds = single.t_end - single.t_start
        n = int(np.clip(seconds * fps if fps else seconds * _FPS, 1 if fps else _FEWEST_FRAMES, _MOST_FRAMES))
        times = np.linspace(single.t_start, single.t_end, n + 1)
        runs = {int(k): member_again(self.plan, int(k), times) for k in members}
        title = f"{self.plan.system.name}: {len(runs)} of {self.n} members"
        folder = os.path.dirname(self.plan.system.file) if os.path.exists(self.plan.system.file) else None
        recording.record_members(runs, path, title, None if folder is None else Path(folder))

    def columns(self) -> dict[str, np.ndarray]:
        """Return all that is kept of each member, shape (n,) or (n, F): what varies, series, verdicts."""
        v = self.verdicts
        known = {"status": v.status, "ok": v.ok, "steps": v.steps, "energy_error": v.energy_error}
        return {
            **named_beside(self.varied, self.names),
            **{name: self[name] for name in self.names},
            **(known if len(v.status) else {}),
        }

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write all that is kept as NumPy's `.npz`, with the times as `t`."""
        with open(path, "wb") as file:
            np.savez(file, t=self.t, **self.columns())

    def to_dataframe(self) -> pandas.DataFrame:
        """Return what is kept as a pandas DataFrame, a row for each member; of series over time the last value."""
        return export.as_dataframe(self.columns())

    def to_xarray(self) -> xarray.Dataset:
        """Return what is kept as an xarray Dataset over members, and the time of series; of a store nothing is read."""
        if self.store is not None:
            return export.open_dataset(self.store)
        return export.as_dataset(self.columns(), self.t, model=self.plan.system.name, method=self.method)

    def to_parquet(self, path: str | os.PathLike[str]) -> None:
        """Write what is kept as a Parquet file, a row for each member; series over time are lists in it."""
        export.write_parquet(self.columns(), path)

    def plot(self, name: str) -> Figure:
        """Draw how a quantity is distributed over the members at the end."""
        values = self[name]
        return export.distribution(name, values if values.ndim == 1 else values[:, -1])

    def __repr__(self) -> str:
        return (
            f"<Ensemble of {self.plan.system.name!r}: {self.n_done} of {self.n} members by {self.method}, "
            f"{self.n_failed} failed, {self.n_doubtful} doubtful>"
        )
