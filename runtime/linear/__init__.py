"""Linear analysis: equilibria, linearisation on independent coordinates, modes, frequency response; docs/linear.md."""

from symgen.runtime.lazy import lazy_exports

_EXPORTS = {
    "Equilibrium": "symgen.runtime.linear.equilibrium",
    "FrequencyResponse": "symgen.runtime.linear.frequency",
    "LinearModel": "symgen.runtime.linear.model",
    "Mode": "symgen.runtime.linear.modes",
    "Modes": "symgen.runtime.linear.modes",
    "find_equilibrium": "symgen.runtime.linear.equilibrium",
    "linearise": "symgen.runtime.linear.linearisation",
}

__all__ = sorted(_EXPORTS)
__getattr__, __dir__ = lazy_exports(__name__, _EXPORTS)
