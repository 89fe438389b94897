"""State of a stack's costmap filters: the zones and masks that are enabled. Events can switch them during a run."""

from collections.abc import Mapping
from dataclasses import dataclass

from simscen.core.environment.costmap_filters import Filter, FilterMasks, Zones, ZoneSwitch
from simscen.core.geometry import Polygon
from simscen.model.stack_base import StackBase


@dataclass
class _Filter:
    """State of one filter. `zones` has, by region, the speed limit in m/s (0: none) and whether the zone is enabled."""

    zones: dict[str, tuple[float, bool]]
    has_mask: bool
    enabled: bool = True

    def is_enabled(self, region: str) -> bool:
        """Return whether the filter and its zone in `region` are enabled."""
        return self.enabled and self.zones.get(region, (0.0, False))[1]


class CostmapFilters:
    """Zones and masks of the costmap filters of one stack."""

    def __init__(self, stack: StackBase, regions: Mapping[str, Polygon], masks: FilterMasks) -> None:
        """Take the initial zones from the specification of the stack. `regions` has all polygons by name."""
        self._regions, self._masks = regions, masks
        keepout = dict.fromkeys(stack.keepout, (0.0, True))
        speed = {zone.region: (zone.speed_limit, True) for zone in stack.speed_zones}
        self._filters: dict[Filter, _Filter] = {
            "keepout": _Filter(keepout, masks.keepout is not None),
            "speed": _Filter(speed, masks.speed is not None),
        }

    def rejection_reason(self, order: ZoneSwitch) -> str:
        """Return why an order to switch a zone would have no effect; "" if it would have an effect. Changes nothing."""
        target, state = self._filters[order.filter], "on" if order.enabled else "off"
        if order.region is None:
            if not target.zones and not target.has_mask:
                return f"the stack's {order.filter} filter has no zone and no mask"
            return f"the stack's {order.filter} filter was {state} already" if target.enabled == order.enabled else ""
        if not target.enabled:
            return f"the stack's {order.filter} filter is off as a whole"
        limit, is_on = target.zones.get(order.region, (0.0, False))
        if order.enabled and order.filter == "speed" and not (order.speed_limit or limit):
            return f"`{order.region}` is not a speed zone of the stack and has no speed limit"
        is_same_limit = order.speed_limit in (None, limit) or not order.enabled
        return f"`{order.region}` was {state} already" if is_on == order.enabled and is_same_limit else ""

    def switch(self, order: ZoneSwitch) -> tuple[str, ...]:
        """Execute an order that has an effect. Return the names of the switched regions, with "" for the mask."""
        target = self._filters[order.filter]
        if order.region is None:
            target.enabled = order.enabled
            regions = [region for region, (_, is_on) in target.zones.items() if is_on]
            return (*regions, *([""] if target.has_mask else []))
        limit = target.zones.get(order.region, (0.0, False))[0]
        target.zones[order.region] = (order.speed_limit or limit, order.enabled)
        return (order.region,)

    def speed_limit(self, region: str) -> float:
        """Return the speed limit in m/s of the zone in `region`, or 0 if there is none."""
        return self._filters["speed"].zones.get(region, (0.0, False))[0]

    @property
    def zones(self) -> Zones:
        """Enabled zones and masks."""
        keepout, speed = self._filters["keepout"], self._filters["speed"]
        return Zones(
            tuple(self._regions[name] for name in keepout.zones if keepout.is_enabled(name)),
            tuple((self._regions[name], limit) for name, (limit, _) in speed.zones.items() if speed.is_enabled(name)),
            FilterMasks(self._masks.keepout if keepout.enabled else None, self._masks.speed if speed.enabled else None),
        )
