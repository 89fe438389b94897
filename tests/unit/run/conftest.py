"""The fixture `play`, which runs a small scenario in this process. Makes `search_plants.py` importable."""

import sys
from pathlib import Path

import pytest

from simscen.loading.scenario import load_scenario
from simscen.run.preparation import prepare
from simscen.run.simulate import simulate

sys.path.insert(0, str(Path(__file__).parent))

ROOM = """\
simscen: 1
walls: [{points: [[0, 0], [8, 0], [8, 6], [0, 6], [0, 0]]}]
obstacles: [{name: crate, box: [1, 1, 1], pose: {x: 5, y: 4.5}}]
regions: {corner: [[0, 0], [2, 0], [2, 2], [0, 2]]}
"""
SCENARIO = """\
simscen: 1
world: room.world.yaml
robot: {pose: {x: 1, y: 1, yaw: 0}}
goals: [{name: desk, pose: {x: 3, y: 1, yaw: 0}}]
time_limit: 30
pass: [{goals_reached: {}}]
"""


@pytest.fixture(scope="module")
def play(tmp_path_factory: pytest.TempPathFactory):
    """Return a function that runs SCENARIO and returns its trace.

    The keyword arguments replace or add top-level keys, and `extra` is appended to the text of the scenario.
    """

    def run(extra: str = "", seed: int = 1, room: str = ROOM, **replaced_keys: str):
        folder = tmp_path_factory.mktemp("play")
        lines = {line.split(":")[0]: line for line in SCENARIO.splitlines()}
        lines |= {key: f"{key}: {value}" for key, value in replaced_keys.items()}
        if "robots" in replaced_keys:
            del lines["robot"], lines["goals"]
        (folder / "room.world.yaml").write_text(room)
        (folder / "a.scenario.yaml").write_text("\n".join(lines.values()) + "\n" + extra)
        return simulate(prepare(load_scenario(folder / "a.scenario.yaml", folder)), seed).trace

    return run
