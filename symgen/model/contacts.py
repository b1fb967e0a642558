"""The part of the builder for what touches: stops, friction, compliant contacts; and how a file states them."""

from __future__ import annotations

from collections import ChainMap
from collections.abc import Iterator, Sequence
from typing import Any

import sympy

from .closures import Closures
from .description import Contact, Description, Friction, Stop
from .functions import dot
from .sources import Sources

CONTACT_KEYS = ("stiffness", "exponent", "damping", "friction", "slip", "smooth")


class Contacts(Closures):
    """Rigid stops with restitution, Coulomb friction, compliant contacts."""

    def __init__(self, sources: Sources) -> None:
        super().__init__(sources)
        self._stops: dict[str, Stop] = {}
        self._frictions: dict[str, Friction] = {}
        self._contacts: dict[str, Contact] = {}

    def stop(self, name: str, gap: Any = None, restitution: Any = 0) -> None:
        """Keep an expression of the coordinates (and `t`) from falling below zero.

        At `gap` = 0 the rates jump: the gap opens as fast as it closed, times `restitution`. Stops that
        touch share one impulse. What comes to rest on a stop stays there until it is pulled away.

        Parameters
        ----------
        name : str
            Of the stop, and of the event when it is hit or let go.
        gap : expression
            Zero where it touches, positive where it is open.
        restitution : expression
            Newton's coefficient, 0 (the default) to 1; of parameters and constants.
        """
        table = f"stops.{name!s:.60}"
        self._new_element(name, "stops", self._touching_names())
        self._stops[name] = Stop(
            name,
            self._required(table, "gap", gap),
            self._sources.expression(restitution, table, "restitution"),
        )

    def limit(
        self, name: str, coordinate: Any, lower: Any = None, upper: Any = None, restitution: Any = 0
    ) -> None:
        """Keep a coordinate between limits: the stops NAME_lower and NAME_upper.

        Parameters
        ----------
        name : str
        coordinate : Symbol or expression
        lower, upper : expression, optional
        restitution : expression
            See `stop`.
        """
        q = sympy.Symbol(coordinate) if isinstance(coordinate, str) else coordinate
        for side, sign, bound in (("lower", 1, lower), ("upper", -1, upper)):
            if bound is not None:
                table = f"stops.{name!s:.60}_{side}"
                value = self._sources.expression(bound, table, "limit")
                self.stop(f"{name}_{side}", sign * (q - value), restitution)

    def friction(
        self,
        name: str,
        coordinate: Any = None,
        speed: Any = None,
        force: Any = None,
        torque: Any = None,
        smooth: Any = None,
        static: Any = None,
        coefficient: Any = None,
        normal: str | Sequence[str] | None = None,
    ) -> None:
        """Add Coulomb friction against the rate of a coordinate, or against another relative speed.

        Parameters
        ----------
        name : str
            Of the friction, and of the event when it begins to stick or to slip.
        coordinate : Symbol or str
            Its rate is the sliding speed.
        speed : expression
            The sliding speed itself, linear in the rates, where it is not one coordinate's: "dot(x) - belt".
        force, torque : expression
            The largest friction force (or torque; one of the two), of coordinates, inputs and `t`; not negative.
        smooth : expression, optional
            The sliding speed below which the force gives way: force*s/sqrt(s^2 + smooth^2). Without it the friction
            sticks and slips, and the instants are located.
        static : expression, optional
            The largest force (torque) while it sticks, where that is more than while it slides. With a `normal`: the
            coefficient while it sticks.
        coefficient, normal : expression, str or sequence of str, optional
            In the place of a force: the friction is `coefficient` times the force of the stop, or the magnitude of the
            constraint forces, that `normal` names. A ready-made constraint is named as a whole. With `smooth` it is
            coefficient*N*s/sqrt(s^2 + smooth^2).
        """
        table, sources = f"friction.{name!s:.60}", self._sources
        self._new_element(name, "friction", self._touching_names())
        if (coordinate is None) == (speed is None):
            raise sources.error(
                table,
                "coordinate",
                "friction acts on one 'coordinate' or one 'speed'",
                hint="give one of the two",
            )
        if sum(x is not None for x in (force, torque, coefficient)) != 1:
            raise sources.error(
                table, "force", "friction has one 'force' or 'torque', the largest that it can take",
                hint="or a 'coefficient' of a 'normal' force",
            )  # fmt: skip
        names = self._normal(table, coefficient, normal)
        if coordinate is not None:
            given = sources.expression(coordinate, table, "coordinate")
            if not isinstance(given, sympy.Symbol):
                raise sources.error(
                    table,
                    "coordinate",
                    "a coordinate's name is expected here",
                    hint="for others give 'speed'",
                )
            sliding = dot(given)
        else:
            sliding = sources.expression(speed, table, "speed")
        given_as = {"force": force, "torque": torque, "coefficient": coefficient}
        key = next(k for k, x in given_as.items() if x is not None)
        level = sources.expression(given_as[key], table, key)
        width = None if smooth is None else sources.expression(smooth, table, "smooth")
        most = None if static is None else sources.expression(static, table, "static")
        if most is not None and width is not None:
            message = "friction with 'smooth' never sticks: 'static' has no effect"
            raise sources.error(table, "static", message, hint="leave one of them out")
        self._frictions[name] = Friction(name, sliding, level, width, most, names)

    def _normal(self, table: str, coefficient: Any, normal: Any) -> tuple[str, ...]:
        """The names that `normal` gives."""
        sources = self._sources
        if (coefficient is None) != (normal is None):
            missing = "normal" if normal is None else "coefficient"
            raise sources.error(
                table,
                missing,
                f"'coefficient' and 'normal' go together; '{missing}' is missing",
                hint="give both",
            )
        if normal is None:
            return ()
        names = (normal,) if isinstance(normal, str) else normal
        if not isinstance(names, (list, tuple)) or not names or not all(isinstance(x, str) for x in names):
            message = "the name of a stop or a constraint is expected here, or a list of constraints' names"
            raise sources.error(table, "normal", message)
        return tuple(names)

    def contact(
        self,
        name: str,
        gap: Any = None,
        stiffness: Any = None,
        exponent: Any = 1.5,
        damping: Any = None,
        friction: Any = None,
        slip: Any = None,
        smooth: Any = None,
    ) -> None:
        """Add a compliant contact after Hunt and Crossley.

        The force is k δ^n (1 + 3/2 c dδ/dt) with the depth δ = -gap, and never pulls.

        Parameters
        ----------
        name : str
        gap : expression
            Of coordinates (and `t`), negative in contact [m].
        stiffness : expression
            k [N/m^n].
        exponent : expression
            n, 1.5 for spheres (Hertz); of parameters and constants, at least 1.
        damping : expression, optional
            c [s/m]; the restitution is 1 - c v for slow impacts at speed v.
        friction : expression, optional
            Coefficient of Coulomb friction times the elastic part of the force, against `slip`.
        slip : expression
            Sliding speed, linear in the rates.
        smooth : expression
            Speed below which the friction gives way, see `friction`.
        """
        table = f"contacts.{name!s:.60}"
        self._new_element(name, "contacts", self._touching_names())
        together = {"friction": friction, "slip": slip, "smooth": smooth}
        missing = [key for key, value in together.items() if value is None]
        if missing and len(missing) < 3:
            raise self._sources.error(
                table,
                missing[0],
                f"friction of a contact needs 'friction', 'slip' and 'smooth'; '{missing[0]}' is missing",
                hint="give all three, or none",
            )
        given = {"exponent": exponent, "damping": damping, **together}
        values = {k: None if x is None else self._sources.expression(x, table, k) for k, x in given.items()}
        held = {
            "gap": self._required(table, "gap", gap),
            "stiffness": self._required(table, "stiffness", stiffness),
        }
        self._contacts[name] = Contact(name, **held, **values)

    def _required(self, table: str, key: str, value: Any) -> sympy.Expr:
        if value is None:
            raise self._sources.error(table, key, f"the key '{key}' is missing", hint="add it")
        return self._sources.expression(value, table, key)

    def _touching_names(self) -> ChainMap:
        return ChainMap(self._stops, self._frictions, self._contacts)

    def _touching(self) -> dict[str, tuple]:
        """These elements as the fields of a description."""
        return {
            "stops": tuple(self._stops.values()),
            "frictions": tuple(self._frictions.values()),
            "contacts": tuple(self._contacts.values()),
        }


def contact_tables(d: Description) -> Iterator[tuple[str, list[tuple[str, sympy.Expr | tuple[str, ...]]]]]:
    """The tables of a model file that state these elements, with their keys and expressions, or names."""
    for stop in d.stops:
        yield f"stops.{stop.name}", [("gap", stop.gap), ("restitution", stop.restitution)]
    for f in d.frictions:
        more = [(key, x) for key, x in (("smooth", f.smooth), ("static", f.static)) if x is not None]
        level = [("coefficient", f.level), ("normal", f.normal)] if f.normal else [("force", f.level)]
        yield f"friction.{f.name}", [("speed", f.speed), *level, *more]
    for c in d.contacts:
        values = ((key, getattr(c, key)) for key in CONTACT_KEYS)
        yield f"contacts.{c.name}", [("gap", c.gap), *((k, x) for k, x in values if x is not None)]
