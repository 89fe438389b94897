"""Tests of switching zones of costmap filters."""

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


def order(filters, what, enabled, region=None, limit=None):
    text = ZoneSwitch(what, enabled, region, limit)
    return filters.rejection_reason(text) or filters.switch(text)


def test_zones_keep_their_order_when_they_are_switched():
    some = filters(**STACK)
    assert some.zones.keepout == (WET,)
    assert order(some, "keepout", True, "dry") == ("dry",)
    assert some.zones.keepout == (WET, DRY)
    assert order(some, "keepout", False, "wet") == ("wet",)
    assert some.zones.keepout == (DRY,)
    assert order(some, "keepout", True, "wet") == ("wet",)
    assert some.zones.keepout == (WET, DRY)


def test_last_speed_limit_applies():
    some = filters(**STACK)
    assert some.zones.speed == ((SLOW, 0.2),)
    order(some, "speed", True, "slow", 0.1)
    assert some.zones.speed == ((SLOW, 0.1),)
    order(some, "speed", False, "slow")
    assert some.zones.speed == ()
    order(some, "speed", True, "slow")
    assert some.zones.speed == ((SLOW, 0.1),)


def test_switching_a_whole_filter_includes_its_mask_and_restores_its_zones():
    some = filters(FilterMasks(MASK), keepout=["wet", "dry"])
    order(some, "keepout", False, "dry")
    assert order(some, "keepout", False) == ("wet", "")
    assert (some.zones.keepout, some.zones.masks.keepout) == ((), None)
    assert order(some, "keepout", True) == ("wet", "")
    assert some.zones.keepout == (WET,)
    assert some.zones.masks.keepout is MASK


@pytest.mark.parametrize(
    ("text", "what", "enabled", "region", "limit"),
    [
        ("`wet` was on already", "keepout", True, "wet", None),
        ("`dry` was off already", "keepout", False, "dry", None),
        ("`slow` was on already", "speed", True, "slow", 0.2),
        ("`dry` is not a speed zone of the stack and has no speed limit", "speed", True, "dry", None),
        ("the stack's keepout filter was on already", "keepout", True, None, None),
    ],
)
def test_switch_without_effect_returns_the_reason(text, what, enabled, region, limit):
    assert order(filters(**STACK), what, enabled, region, limit) == text


def test_empty_filter_and_zones_of_a_disabled_filter_cannot_be_switched():
    assert order(filters(), "speed", False) == "the stack's speed filter has no zone and no mask"
    some = filters(**STACK)
    order(some, "keepout", False)
    assert order(some, "keepout", True, "dry") == "the stack's keepout filter is off as a whole"
