"""Ensembles: one model many times, several members at once in the lanes of vector registers."""

from typing import TYPE_CHECKING

from symgen.runtime.lazy import lazy_exports

if TYPE_CHECKING:
    from symgen.runtime.ensemble.noises import noise as noise
    from symgen.runtime.ensemble.reduction import histogram as histogram
    from symgen.runtime.ensemble.reduction import quantiles as quantiles
    from symgen.runtime.ensemble.result import Ensemble as Ensemble
    from symgen.runtime.ensemble.sampling import choice as choice
    from symgen.runtime.ensemble.sampling import grid as grid
    from symgen.runtime.ensemble.sampling import linspace as linspace
    from symgen.runtime.ensemble.sampling import lognormal as lognormal
    from symgen.runtime.ensemble.sampling import normal as normal
    from symgen.runtime.ensemble.sampling import triangular as triangular
    from symgen.runtime.ensemble.sampling import uniform as uniform

_EXPORTS = {
    "Ensemble": "symgen.runtime.ensemble.result",
    "noise": "symgen.runtime.ensemble.noises",
    **dict.fromkeys(("histogram", "quantiles"), "symgen.runtime.ensemble.reduction"),
    **dict.fromkeys(
        ("choice", "grid", "linspace", "lognormal", "normal", "triangular", "uniform"),
        "symgen.runtime.ensemble.sampling",
    ),
}

__all__ = sorted(_EXPORTS)
__getattr__, __dir__ = lazy_exports(__name__, _EXPORTS)
