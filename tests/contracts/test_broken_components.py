"""Tests that each contract test detects a broken component."""

import pytest

from simscen.testing import PromiseBroken, promises_of
from simscen.testing.flatland import round_robot
from tests.contracts.broken import (
    behaviors,
    controllers,
    goal_checkers,
    language,
    localizers,
    planners,
    sensors,
    stacks,
)
from tests.contracts.broken.cases import CASES, Case

ROUND = {"round": round_robot()}


@pytest.mark.sample(15)
@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_broken_component_fails_its_contract_test(case: Case) -> None:
    (promise,) = [promise for promise in promises_of(case.spec, robots=ROUND) if promise.name.startswith(case.promise)]
    with pytest.raises(PromiseBroken) as broken:
        promise.check(limit=1.0 if case.name == "NeverReturns" else 60.0)
    assert case.message in str(broken.value)


def test_every_contract_test_has_a_broken_component() -> None:
    broken_promises = {case.promise for case in CASES}
    specs = (
        planners.PLANNER,
        controllers.CONTROLLER,
        localizers.LOCALIZER,
        behaviors.SPIN,
        goal_checkers.CHECKER,
        stacks.STACK,
        sensors.SENSOR,
        language.RequiresBelief(),
        language.ScanFault(),
        language.TriggerChangesWorld(),
        language.HasNoDescription(),
        language.HasNoUnit(),
    )
    all_promises = {promise.name for spec in specs for promise in promises_of(spec, robots=ROUND)}
    assert [
        name for name in sorted(all_promises) if not any(name.startswith(promise) for promise in broken_promises)
    ] == []
