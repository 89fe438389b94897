"""Tests of drives on coarse maps."""

import numpy as np
import pytest

import simscen

SCENARIO = """\
simscen: 1
world: office.yaml
robot: {pose: {x: 1.3, y: 1.3}}
goals: [{pose: {x: 6.7, y: 4.4}}]
time_limit: 60
pass:
  - goals_reached: {}
  - no_false_success: {}
  - collisions: {}
  - path_length: {max_ratio: 1.1}
"""


@pytest.mark.parametrize("resolution", [0.15, 0.3, 0.4])
def test_robot_on_a_coarse_map_arrives_where_it_reports(resolution, tmp_path):
    columns, rows = round(8 / resolution), round(6 / resolution)
    gray = np.full((rows, columns), 254, dtype=np.uint8)
    gray[[0, -1]] = gray[:, [0, -1]] = 0
    gray[: rows // 2, columns // 2] = 0  # a wall from the top to the middle
    header = f"P5\n{columns} {rows}\n255\n".encode()
    (tmp_path / "office.pgm").write_bytes(header + gray.tobytes())
    (tmp_path / "office.yaml").write_text(
        f"image: office.pgm\nresolution: {resolution}\norigin: [0, 0, 0]\n"
        "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )
    (tmp_path / "office.scenario.yaml").write_text(SCENARIO)
    run = simscen.simulate(tmp_path / "office.scenario.yaml")
    assert run.passed, run.result.verdicts
    assert run.result.metrics["ape_trans_rmse"] < 0.06
