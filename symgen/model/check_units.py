"""The check of units: sums are homogeneous; energies, forces, masses and lengths are what they must be."""

from __future__ import annotations

from ..errors import ModelError
from .description import Coordinate, Description
from .dimensions import Size, infer
from .items import Item, definition_items, items, unit_dimension
from .sources import Sources
from .units import LENGTH, TIME, dimension_text


def check_units(d: Description, sources: Sources) -> None:
    """Check the dimensions of all expressions; a model without units is not checked."""
    declared = (*d.parameters, *d.constants, *d.coordinates, *d.inputs)
    everything = [*definition_items(d), *items(d)]
    given = [x for x in declared if not isinstance(x, Coordinate) or x.joint is None]
    has_units = any(x.unit is not None for x in given)
    if not has_units and not any(s.unit is not None for x in everything for s in sources.of(x.table, x.key)):
        return
    names: dict[str, Size] = {x.name: unit_dimension(x.unit) for x in declared}
    names["t"] = TIME
    names |= {r.name: unit_dimension(r.unit) for r in d.rates if r.coordinate != r.name}
    names |= {f"{p.name}_{c}": LENGTH for p in d.points for c in "xyz"}
    for item in everything:
        size = _check_item(item, names, sources)
        if item.table == "definitions":
            names[item.key] = size


def _check_item(item: Item, names: dict[str, Size], sources: Sources) -> Size:
    given = sources.of(item.table, item.key)
    size: Size = None
    for source in given:
        try:
            size = source.unit.dimension if source.unit else infer(source.expression, names, source.decimals)
        except ModelError as error:
            raise sources.locate(error, item.table, item.key) from None
        if item.dimension is not None and isinstance(size, tuple) and size != item.dimension:
            raise sources.error(
                item.table,
                item.key,
                f"units do not match: this is in {dimension_text(size)}, "
                f"and {dimension_text(item.dimension)} is expected",
            )
    return size
