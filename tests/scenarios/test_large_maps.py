"""Test of a drive on a large, noisy map."""

import numpy as np

from simscen.loading.scenario import load_scenario
from simscen.run.preparation import prepare
from simscen.run.simulate import simulate

CELLS, CELL = 800, 0.05


def test_a_noisy_map_of_more_than_a_hundred_thousand_triangles_is_driven_on(tmp_path):
    noise = np.random.default_rng(3).random((CELLS, CELLS)) < 0.02
    gray = np.where(noise, 0, 254).astype(np.uint8)
    gray[:4] = gray[-4:] = gray[:, :4] = gray[:, -4:] = 0
    gray[390:412, 40:760] = 254
    (tmp_path / "arena.pgm").write_bytes(f"P5\n{CELLS} {CELLS}\n255\n".encode() + gray.tobytes())
    (tmp_path / "arena.yaml").write_text(
        f"image: arena.pgm\nresolution: {CELL}\norigin: [0, 0, 0]\n"
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
    # The corridor's rims are noise: 0.5 m from its middle at the nearest, 0.55 m where no noise is.
    assert 0.2 < np.min(run.trace.clearance.values) < 0.4
