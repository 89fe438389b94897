"""Test of drives through narrow gaps."""

from pathlib import Path

import pytest

import simscen

SCENARIO = """\
simscen: 1
world:
  simscen: 1
  walls:
    - {name: outer wall, points: [[0, 0], [10, 0], [10, 8], [0, 8], [0, 0]]}
    - {name: south of the gap, points: [[5.3, 0], [5.02, LOW]]}
    - {name: north of the gap, points: [[4.98, HIGH], [4.7, 6.3]]}
robot: {pose: {x: 2.5, y: 1.5}}
goals:
  - {pose: {x: 7.5, y: 2.8, yaw: 0 deg}, timeout: 60 s}
  - {pose: {x: 2.5, y: 1.5, yaw: 180 deg}, timeout: 60 s}
pass:
  - goals_reached: {}
  - collisions: {max: 0}
  - recoveries: {max: 0}
  - path_length: {max: MAX_LENGTH m}
"""


@pytest.mark.parametrize(("width", "max_length"), [(0.5, 26.0), (0.7, 12.0)], ids=["around", "through"])
def test_a_robot_44_cm_wide_drives_through_the_gaps_that_it_plans(
    width: float, max_length: float, tmp_path: Path
) -> None:
    """The direct path through the gap is 10.5 m long, the path around the wall 20 m."""
    low, high = 2.17 - width / 2, 2.17 + width / 2
    text = SCENARIO.replace("LOW", f"{low:.3f}").replace("HIGH", f"{high:.3f}").replace("MAX_LENGTH", str(max_length))
    (tmp_path / "gap.scenario.yaml").write_text(text)
    run = simscen.simulate(tmp_path / "gap.scenario.yaml", seed=2)
    assert run.passed, run.result
