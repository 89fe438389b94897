"""Where a stack is told to keep out, and where to drive slowly, as its costmap filters have it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

from simscen.core.filtermasks import FilterMasks

if TYPE_CHECKING:
    from simscen.core.world import Polygon

Filter = Literal["keepout", "speed"]


@dataclass(frozen=True, eq=False)
class Zones:
    """All that its filters say now: `keepout` are polygons it must not enter, `speed` such with a limit in m/s."""

    keepout: tuple[Polygon, ...] = ()
    speed: tuple[tuple[Polygon, float], ...] = ()
    masks: FilterMasks = field(default_factory=FilterMasks)


@dataclass(frozen=True)
class ZoneSwitch:
    """An order to switch a zone, or a whole filter with all its zones and its mask where `region` is None.

    `speed_limit` in m/s is for a zone of the speed filter; None keeps the one it has.
    """

    filter: Filter
    enabled: bool
    region: str | None = None
    speed_limit: float | None = None
