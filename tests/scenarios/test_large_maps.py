"""Test of a drive on a large, noisy map."""

import numpy as np

from simscen.loading.scenario import load_scenario
from simscen.run.preparation import prepare
from simscen.run.simulate import simulate

CELLS, RESOLUTION_M = 800, 0.05


def test_robot_drives_on_a_noisy_map_of_more_than_a_hundred_thousand_triangles(tmp_path):
    noise = np.random.default_rng(3).random((CELLS, CELLS)) < 0.02
    gray = np.where(noise, 0, 254).astype(np.uint8)
    gray[:4] = gray[-4:] = gray[:, :4] = gray[:, -4:] = 0
    gray[390:412, 40:760] = 254
    (tmp_path / "arena.pgm").write_bytes(f"P5\n{CELLS} {CELLS}\n255\n".encode() + gray.tobytes())
    (tmp_path / "arena.yaml").write_text(
        f"image: arena.pgm\nresolution: {RESOLUTION_M}\norigin: [0, 0, 0]\n"
        "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )
    file = tmp_path / "arena.scenario.yaml"
    file.write_text(
        "simscen: 1\nworld: arena.yaml\nrobot: {pose: {x: 5, y: 20}}\ngoals: [{pose: {x: 9, y: 20}}]\n"
        "time_limit: 40\npass:\n  - goals_reached: {}\n  - collisions: {}\n"
    )
    prepared = prepare(load_scenario(file, tmp_path))
    assert len(prepared.built.mesh.faces) > 100_000
    run = simulate(prepared)
    assert run.passed, run.result.verdicts
    # The robot drives at least 0.5 m from the edges of the corridor. Cells beyond the edges are occupied at random.
    assert 0.2 < np.min(run.trace.clearance.values) < 0.4
