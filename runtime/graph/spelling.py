"""How names of a model stand in generated code: those of an assembly's use have dots, `c1.piston`."""

from __future__ import annotations

RESET = "reset_"


def spelled(name: str) -> str:
    """A name as one word, `c1_piston`, which no other name of the model is."""
    return name.replace(".", "_")


def reset_function(event: str) -> str:
    """The name of the function that resets the state after an event."""
    return RESET + spelled(event)
