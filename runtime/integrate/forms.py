"""Methods that treat constraints in another form than index-1 equations with projection."""

from __future__ import annotations

from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.integrate.method import unheld
from symgen.runtime.integrate.methods import RECORDS, Method

# form -> name of a method -> its record. "projection" is what methods do by themselves.
FORMS: dict[str, dict[str, Method]] = {
    form: {record.name: record for record in RECORDS if record.form == form}
    for form in sorted({record.form for record in RECORDS} - {"projection"})
}

FORMS["none"] = {name: unheld(record) for name, record in FORMS["baumgarte"].items()}

# What `auto` takes where only the form was asked for.
SUITED = {
    form: next(name for name, record in methods.items() if record.suits_form)
    for form, methods in FORMS.items()
}


def find_form(form: str, method_name: str) -> Method:
    """Return the record of a method that treats constraints in a form of `FORMS`.

    Raises
    ------
    RuntimeModelError
        The method does not have it; the message names those that do.
    """
    methods = FORMS[form]
    if method_name not in methods:
        those = ", ".join(methods) if methods else "no method so far"
        raise RuntimeModelError(
            f"constraints {form!r}: method {method_name!r} does not have this form, which is that of: {those}; "
            "name one of them, or leave constraints to 'projection', which every method has"
        )
    return methods[method_name]
