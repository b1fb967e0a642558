"""Linear analysis: equilibria, linearisation on independent coordinates, modes, frequency response; docs/linear.md."""

from runtime.lazy import lazy_exports

_EXPORTS = {
    "Equilibrium": "runtime.linear.equilibrium",
    "FrequencyResponse": "runtime.linear.frequency",
    "LinearModel": "runtime.linear.model",
    "Mode": "runtime.linear.modes",
    "Modes": "runtime.linear.modes",
    "find_equilibrium": "runtime.linear.equilibrium",
    "linearise": "runtime.linear.linearisation",
}

__all__ = sorted(_EXPORTS)
__getattr__, __dir__ = lazy_exports(__name__, _EXPORTS)
