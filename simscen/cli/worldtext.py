"""A world in numbers, as lines of text."""

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from simscen.cli.diagnostics import harmless

if TYPE_CHECKING:
    from simscen.worlds.inspect import Inspection, Item

MOST_LISTED = 20
LONGEST = 44


def described(found: "Inspection", height: float, everything: bool) -> Iterator[str]:
    """Everything there is to tell; of many solids only the first, unless `everything` is wanted."""
    x0, y0, x1, y1 = found.bounds
    yield f"  bounds    x {x0:.2f} … {x1:.2f} m, y {y0:.2f} … {y1:.2f} m ({x1 - x0:.2f} x {y1 - y0:.2f} m)"
    kinds = ", ".join(f"{count} {kind}" for kind, count in found.shapes)
    yield f"  static    {_count(len(found.solids), 'solid')}{f': {kinds}' if kinds else ''}"
    yield f"  moving    {_count(len(found.bodies), 'object')}"
    yield f"  triangles {found.triangles}"
    rows, columns = found.map_size
    occupied, free, unknown = (f"{100 * share:.1f} %" for share in found.map_shares)
    yield f"  map       {columns} x {rows} cells of {found.map_resolution:g} m, cut at {height:g} m: " + (
        f"{occupied} occupied, {free} free, {unknown} unknown"
    )
    yield from _items("solids", found.solids, len(found.solids) if everything else MOST_LISTED)
    yield from _items("objects", found.bodies, len(found.bodies))
    for title, names in (("places", found.places), ("regions", found.regions)):
        if names:
            yield f"  {title:9} {harmless(', '.join(names))}"


def _items(title: str, items: "Sequence[Item]", most: int) -> Iterator[str]:
    if items:
        yield f"  {title}"
    width = max((min(len(harmless(item.name)), LONGEST) for item in items[:most]), default=0)
    yield from (f"    {_item(item, width)}" for item in items[:most])
    if len(items) > most:
        yield f"    … and {len(items) - most} more (--all lists them)"


def _item(item: "Item", width: int) -> str:
    x0, y0, z0, x1, y1, z1 = item.extent
    name = harmless(item.name)
    shown = name if len(name) <= LONGEST else f"…{name[1 - LONGEST :]}"
    where = f"x {x0:.2f} … {x1:.2f}  y {y0:.2f} … {y1:.2f}  z {z0:.2f} … {z1:.2f}"
    mass = "" if item.mass is None else f"  {item.mass:g} kg" if item.mass else "  cannot be pushed"
    return f"{shown:{width}}  {item.shape:9} {item.triangles:7} triangles  {where}{mass}"


def _count(number: int, what: str) -> str:
    return f"{number} {what}{'' if number == 1 else 's'}"
