"""Tests of switching the zones of costmap filters on and off during a run."""

import numpy as np
import pytest

from simscen.core.environment.costmap_filters import FilterMasks, ZoneSwitch
from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.geometry import Pose2
from simscen.model.stack import StackSpec
from simscen.run.live_world.costmap_filters import CostmapFilters

WET, DRY, SLOW = (((k, 0.0), (k + 1, 0.0), (k + 1, 1.0)) for k in (0.0, 2.0, 4.0))
REGIONS = {"wet": WET, "dry": DRY, "slow": SLOW}
STACK = {"keepout": ["wet"], "speed_zones": [{"region": "slow", "speed_limit": 0.2}]}
MASK = OccupancyGrid(np.zeros((2, 2), np.int8), 0.1, Pose2(0.0, 0.0))


def filters(masks=None, **stack):
    return CostmapFilters(StackSpec.model_validate(stack), REGIONS, masks or FilterMasks())


def switch(filters, kind, enabled, region=None, limit=None):
    """Return the names of the switched zones, or the reason why the switch is rejected."""
    request = ZoneSwitch(kind, enabled, region, limit)
    return filters.rejection_reason(request) or filters.switch(request)


def test_zones_keep_their_order_when_they_are_switched():
    zone_filters = filters(**STACK)
    assert zone_filters.zones.keepout == (WET,)
    assert switch(zone_filters, "keepout", True, "dry") == ("dry",)
    assert zone_filters.zones.keepout == (WET, DRY)
    assert switch(zone_filters, "keepout", False, "wet") == ("wet",)
    assert zone_filters.zones.keepout == (DRY,)
    assert switch(zone_filters, "keepout", True, "wet") == ("wet",)
    assert zone_filters.zones.keepout == (WET, DRY)


def test_last_speed_limit_applies():
    zone_filters = filters(**STACK)
    assert zone_filters.zones.speed == ((SLOW, 0.2),)
    switch(zone_filters, "speed", True, "slow", 0.1)
    assert zone_filters.zones.speed == ((SLOW, 0.1),)
    switch(zone_filters, "speed", False, "slow")
    assert zone_filters.zones.speed == ()
    switch(zone_filters, "speed", True, "slow")
    assert zone_filters.zones.speed == ((SLOW, 0.1),)


def test_switching_a_whole_filter_includes_its_mask_and_restores_its_zones():
    zone_filters = filters(FilterMasks(MASK), keepout=["wet", "dry"])
    switch(zone_filters, "keepout", False, "dry")
    assert switch(zone_filters, "keepout", False) == ("wet", "")
    assert (zone_filters.zones.keepout, zone_filters.zones.masks.keepout) == ((), None)
    assert switch(zone_filters, "keepout", True) == ("wet", "")
    assert zone_filters.zones.keepout == (WET,)
    assert zone_filters.zones.masks.keepout is MASK


@pytest.mark.parametrize(
    ("reason", "kind", "enabled", "region", "limit"),
    [
        ("`wet` was on already", "keepout", True, "wet", None),
        ("`dry` was off already", "keepout", False, "dry", None),
        ("`slow` was on already", "speed", True, "slow", 0.2),
        ("`dry` is not a speed zone of the stack and has no speed limit", "speed", True, "dry", None),
        ("the stack's keepout filter was on already", "keepout", True, None, None),
    ],
)
def test_switch_without_effect_returns_the_reason(reason, kind, enabled, region, limit):
    assert switch(filters(**STACK), kind, enabled, region, limit) == reason


def test_empty_filter_and_zones_of_a_disabled_filter_cannot_be_switched():
    assert switch(filters(), "speed", False) == "the stack's speed filter has no zone and no mask"
    zone_filters = filters(**STACK)
    switch(zone_filters, "keepout", False)
    assert switch(zone_filters, "keepout", True, "dry") == "the stack's keepout filter is off as a whole"
