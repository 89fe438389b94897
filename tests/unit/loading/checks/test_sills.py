"""Sills in front of omnidirectional and mecanum bases: `validate` and the physics agree about which ones block."""

import pytest

from simscen.loading.checks.scene_runner import world_problems
from simscen.loading.scenario import load_scenario
from simscen.run.preparation import prepare
from simscen.run.simulate import simulate

UNDERSIDE_M = {"omni": 0.05, "mecanum": 0.4 * 0.0475}
"""Lowest point of the hull; for mecanum, of the boxes around its wheels."""
SCENARIO = """
simscen: 1
world:
  simscen: 1
  walls: [{{points: [[0, 0], [6, 0], [6, 3], [0, 3], [0, 0]]}}]
  obstacles: [{{name: sill, box: [0.1, 2.99, {height}], pose: {{x: 3, y: 1.5}}}}]
robot: {{model: {robot}, pose: {{x: 1.5, y: 1.5}}}}
map: none
goals: [{{pose: {{x: 4.5, y: 1.5}}}}]
time_limit: 15 s
pass: [{{collisions: {{}}}}]
"""


@pytest.mark.parametrize("robot", UNDERSIDE_M)
@pytest.mark.parametrize("offset", [-0.006, 0.006], ids=["lower than the hull", "higher than the hull"])
def test_sill_blocks_the_route_if_and_only_if_the_hull_hits_it(tmp_path, robot, offset):
    file = tmp_path / "sill.scenario.yaml"
    file.write_text(SCENARIO.format(robot=robot, height=UNDERSIDE_M[robot] + offset))
    loaded = load_scenario(file, tmp_path)
    found = [problem.code for problem in world_problems(loaded)]
    collided = bool(simulate(prepare(loaded), 1).result.metrics["collisions"])
    assert ("SC302" in found) is collided is (offset > 0)
