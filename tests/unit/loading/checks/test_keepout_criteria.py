"""Tests of the checks of `keepout` criteria for zones that are switched on during the run."""

from pathlib import Path

import pytest

from simscen.core.errors import Problem
from simscen.loading.checks.scene_runner import check_in_world
from tests.scenario_files import try_scenario

SCENARIO = """\
simscen: 1
world:
  simscen: 1
  walls: [{points: [[0, 0], [10, 0], [10, 6], [0, 6], [0, 0]]}]
  regions: {west: [[0, 0], [4, 0], [4, 6], [0, 6]], east: [[6, 0], [10, 0], [10, 6], [6, 6]]}
robot: {pose: {x: 2, y: 3}}
goals: [{pose: {x: 8, y: 3}}]
stack: {localizer: {type: ground_truth}}
"""


def problems_of(tmp_path: Path, more: str) -> list[Problem]:
    file = tmp_path / "a.scenario.yaml"
    file.write_text(SCENARIO + more)
    found = try_scenario(file, tmp_path)
    return found if isinstance(found, list) else [*found.notes, *check_in_world(found)]


@pytest.mark.parametrize("region", ["west", "east"])
def test_zone_of_start_or_goal_is_possible_only_if_it_is_switched(tmp_path: Path, region: str) -> None:
    (problem,) = problems_of(tmp_path, f"pass: [{{keepout: {{region: {region}}}}}]\n")
    assert problem.code == "SC051"
    switch = f"events: [{{when: {{time: 9 s}}, do: {{keepout: {{region: {region}}}}}}}]\n"
    assert not problems_of(tmp_path, f"{switch}pass: [{{keepout: {{region: {region}, while_on: true}}}}]\n")
