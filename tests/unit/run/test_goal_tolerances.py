"""Test of the tolerances of goals that do not specify any."""

from pathlib import Path

from simscen.loading.goals import event_goals, scenario_goals
from simscen.loading.scenario import load_scenario

SCENARIO = """
simscen: 1
world: {simscen: 1, walls: [{points: [[-6, -6], [6, -6], [6, 6], [-6, 6], [-6, -6]]}]}
robot: {pose: {x: 0, y: 0}}
goals: [{pose: {x: 1, y: 0}}, {pose: {x: 1, y: 0}, xy_tolerance: 0.1, yaw_tolerance: 0.2}]
stack: {goal_checker: {xy_goal_tolerance: 0.31, yaw_goal_tolerance: 0.17}}
time_limit: 30
events: [{when: {time: 1 s}, do: {new_goal: {name: sent, pose: {x: 0, y: 1}}}}]
pass: [{collisions: {max: 0}}]
"""


def test_goals_without_tolerances_have_the_tolerances_of_the_stack(tmp_path: Path) -> None:
    file = tmp_path / "a.scenario.yaml"
    file.write_text(SCENARIO)
    loaded = load_scenario(file, tmp_path)
    goals = [*scenario_goals(loaded.spec), *event_goals(loaded).values()]
    tolerances = [(goal.xy_tolerance, goal.yaw_tolerance) for goal in goals]
    assert tolerances == [(0.31, 0.17), (0.1, 0.2), (0.31, 0.17)]
