"""How much small differences grow along a run, as companions say that are lost one after the other."""

from __future__ import annotations

from collections.abc import Sequence

from symgen.runtime.record import record

_TELLING = 4.0  # e-foldings: in less, exponential growth looks like a power of time


@record
class Stretch:
    """A part of a run, beside which a companion went.

    Attributes
    ----------
    begin, end : float [s]
    rate : float [1/s]
        Of the exponential growth of small differences; 0 where they do not grow so.
    suspected : float [1/s]
        The rate where growth may be exponential, but the companion did not come far enough to tell; else 0.
    """

    begin: float
    end: float
    rate: float
    suspected: float = 0.0

    @property
    def length(self) -> float:
        """How long it is [s]."""
        return self.end - self.begin


@record
class Amplification:
    """The exponential growth of small differences along a run.

    Attributes
    ----------
    stretches : tuple of Stretch
        Where companions were, one after the other.
    elsewhere : float [1/s]
        The rate where none was.
    """

    stretches: tuple[Stretch, ...] = ()
    elsewhere: float = 0.0

    def exponent(self, begin: float, end: float) -> float:
        """Return the logarithm of the factor that a difference grows with between two times [s]."""
        total, covered = 0.0, 0.0
        for part in self.stretches:
            common = max(min(part.end, end) - max(part.begin, begin), 0.0)
            total, covered = total + part.rate * common, covered + common
        return total + self.elsewhere * max(end - begin - covered, 0.0)

    def last(self, end: float) -> float:
        """Return until when differences grow exponentially in a run that ends here [s]."""
        growing = [part.end for part in self.stretches if part.rate > 0.0]
        return end if self.elsewhere > 0.0 else max(growing, default=-float("inf"))

    @property
    def rate(self) -> float | None:
        """The mean rate where differences grow exponentially [1/s]; None: nowhere."""
        growing = [part for part in self.stretches if part.rate > 0.0]
        return mean_rate(growing) or None


def mean_rate(stretches: Sequence[Stretch]) -> float:
    """Return the mean rate over stretches, by their lengths [1/s]."""
    in_all = sum(part.length for part in stretches)
    return sum(part.rate * part.length for part in stretches) / in_all if in_all > 0.0 else 0.0


def together(start: Sequence[Stretch], later: Sequence[Stretch]) -> Amplification:
    """Return the growth along a run of which companions saw stretches from its start and from later on.

    What none saw counts as exponential only if both did, one of them at least for sure: motion that passes a saddle
    once is not chaotic. A stretch that is too short to show the growth of the others says nothing against it.
    """
    rate = mean_rate([part for part in (*start, *later) if part.rate > 0.0])
    if rate > 0.0:
        start, later = [_confirmed(part, rate) for part in start], [_confirmed(part, rate) for part in later]
    begin = later[0].begin if later else float("inf")
    before = [_cut(part, begin) for part in start if part.begin < begin]
    return Amplification((*before, *later), min(mean_rate(start), mean_rate(later)))


def _confirmed(part: Stretch, rate: float) -> Stretch:
    unseen = rate if part.length * rate < _TELLING else 0.0
    return Stretch(part.begin, part.end, part.rate or part.suspected or unseen)


def _cut(part: Stretch, end: float) -> Stretch:
    return Stretch(part.begin, min(part.end, end), part.rate)
