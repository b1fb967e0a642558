"""Whether a model falls apart into subsystems that can be integrated by themselves, and into which."""

from __future__ import annotations

from symgen.runtime.subsystems.member_model import Kind, NotDivisible, kind_of
from symgen.runtime.subsystems.sections import sectioned
from symgen.runtime.subsystems.watching import Shared, with_events
from symgen.runtime.system import System


def divide(system: System) -> tuple[list[Kind], str]:
    """Return the kinds of subsystems, each as a model of its own, and what else there is to say.

    Returns
    -------
    kinds : list of Kind
        Empty where the model is integrated as one.
    why_not : str
        Why it is then, a sentence.
    """
    objection = _objection(system)
    if objection:
        return [], objection
    if "_division" not in system.__dict__:
        system.__dict__["_division"] = _divide(system)
    return system.__dict__["_division"]


def _divide(system: System) -> tuple[list[Kind], str]:
    forms = (system.form(name) for name in system.source.functions if system.has(name))
    texts = {form.name: text for form in forms if (text := sectioned(form))}
    try:
        return with_events(system, [kind_of(k, system, texts) for k in range(len(system.subsystems))]), ""
    except (NotDivisible, Shared) as error:
        return [], str(error)


def _objection(system: System) -> str:
    if system.input_words:
        return "inputs over time act on it"
    if system.switches:
        return "it has stops or dry friction"
    return ""
