"""The errors that the run time raises: where, what, why, and what to do next."""

from __future__ import annotations

from collections.abc import Iterable


class RuntimeModelError(Exception):
    """A model or a run cannot go on; the text says why and what to do. Base class of all run-time errors."""


class ModuleError(RuntimeModelError):
    """A generated module is not what this run time can read.

    Parameters
    ----------
    file : str
        The module's path, or a name for a text that came from elsewhere.
    place : str
        Where in it: a line, a key of the header, a function.
    cause : str
        What was found and what was expected.
    remedy : str
        What to do next.
    """

    def __init__(
        self, file: str, place: str, cause: str, remedy: str = "derive the model again with `symgen derive`"
    ):
        self.file, self.place, self.cause, self.remedy = file, place, cause, remedy
        where = f"{file}, {place}" if place else file
        super().__init__(f"{where}: {cause}; {remedy}" if remedy else f"{where}: {cause}")

    def __reduce__(self):
        return type(self), (self.file, self.place, self.cause, self.remedy)


class ContactError(RuntimeModelError):
    """Stops or frictions allow no motion, or several."""


class RunFailed(RuntimeModelError):
    """A prepared run came to no end that is to be trusted; the message says why.

    Attributes
    ----------
    status : str
        failed, zeno, doubtful.
    """

    def __init__(self, message: str, status: str = "failed"):
        self.status = status
        super().__init__(message)

    def __reduce__(self):
        return type(self), (self.args[0], self.status)


class Refusal(RuntimeModelError):
    """An operation that has no Taylor series everywhere; the message says which."""


class UnknownNameError(RuntimeModelError, KeyError):
    """A name that the model does not have."""

    def __str__(self) -> str:
        # KeyError would show the repr of the text.
        return self.args[0]


def nearest(name: str, names: Iterable[str]) -> str:
    """Return `name`'s nearest neighbour among `names` as a hint, or the list of names, or nothing."""
    import difflib

    known = list(names)
    close = difflib.get_close_matches(name, known, n=1, cutoff=0.5)
    if close:
        return f"did you mean {close[0]!r}?"
    if not known:
        return "it has none"
    shown = ", ".join(known[:12]) + (", …" if len(known) > 12 else "")
    return f"it has: {shown}"
