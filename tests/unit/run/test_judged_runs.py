"""Tests of runs whose verdict depends on goals of events and on the search radius of the clearance."""

from pathlib import Path

import pytest

from simscen.core.records.verdict import Status
from simscen.loading.scenario import load_scenario
from simscen.run.preparation import prepare
from simscen.run.simulate import simulate

SCENARIO = """
simscen: 1
world: {{simscen: 1, walls: [{{points: [[-6, -6], [6, -6], [6, 6], [-6, 6], [-6, -6]]}}]}}
robot: {{pose: {{x: 0, y: 0}}}}
goals: [{{name: far, pose: {{x: 1.5, y: 0}}, timeout: 20 s}}]
stack: {{localizer: {{type: ground_truth}}, goal_checker: {{xy_goal_tolerance: 0.3 m}}}}
time_limit: 30
{lines}
"""


@pytest.fixture
def verdicts(tmp_path: Path):
    """Return a function that runs SCENARIO with further lines; it returns the verdicts by id, and the run."""

    def judge(lines: str):
        (tmp_path / "a.scenario.yaml").write_text(SCENARIO.format(lines=lines))
        run_output = simulate(prepare(load_scenario(tmp_path / "a.scenario.yaml", tmp_path)))
        return {verdict.id: verdict for verdict in run_output.result.verdicts}, run_output

    return judge


def test_goal_sent_by_an_event_is_judged_with_the_tolerances_of_the_stack(verdicts):
    found, run_output = verdicts(
        "events: [{name: redirect, when: {time: 1 s}, do: {new_goal: {name: detour, pose: {x: 0, y: 1}}}}]\n"
        "pass: [{goals_reached: {}}, {id: named, goals_reached: {goals: [detour]}}, {time_to_goal: {max: 25 s}}]"
    )
    assert [finding.measured for finding in found["goals_reached"].findings][:1] == ["preempted by detour"]
    assert [verdict.status for verdict in found.values()] == [Status.PASS] * 3
    distance = found["named"].findings[0]
    assert distance.value + distance.margin == pytest.approx(0.3 + 0.15)
    assert run_output.result.metrics["success"] == 1.0


def test_clearance_search_radius_follows_the_criterion(verdicts):
    found, run_output = verdicts("pass: [{clearance: {min: 3 m}}]")
    assert found["clearance"].status is Status.PASS
    assert run_output.trace.clearance.values.max() == 3.5
    assert run_output.result.metrics["min_clearance"] == 2.0


def test_wall_beyond_the_default_search_radius_violates_a_larger_bound(verdicts):
    found, _ = verdicts("pass: [{clearance: {min: 5 m}}]")
    assert found["clearance"].status is Status.FAIL
    assert found["clearance"].findings[0].value == pytest.approx(6 - 1.5 - 0.2, abs=0.4)
