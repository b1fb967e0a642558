"""Inputs over time: tables, polynomials and controllers in the place of constants; see docs/inputs.md."""

from symgen.runtime.lazy import lazy_exports

_EXPORTS = {
    "Controller": "symgen.runtime.inputs.controller",
    "Polynomial": "symgen.runtime.inputs.given",
    "Table": "symgen.runtime.inputs.given",
    "Trajectory": "symgen.runtime.inputs.trajectory",
    "computed_torque": "symgen.runtime.inputs.robot_control",
    "gravity_compensation": "symgen.runtime.inputs.robot_control",
    "impedance": "symgen.runtime.inputs.robot_control",
    "regulator": "symgen.runtime.inputs.robot_control",
}

__all__ = sorted(_EXPORTS)
__getattr__, __dir__ = lazy_exports(__name__, _EXPORTS)
