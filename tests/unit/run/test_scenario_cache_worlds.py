"""Tests that cached maps and shortest paths do not change results."""

from pathlib import Path

import pytest

from simscen.core.environment.world_model import World
from simscen.core.geometry import Pose2, Pose3
from simscen.core.geometry.shapes import Box, Solid
from simscen.core.messages.goals import Goal
from simscen.loading.scenario import load_scenario
from simscen.run import scenario_cache
from simscen.run.disk_cache import DiskCache
from simscen.run.scenario_cache import CachedWorldBuilder, ScenarioCache
from simscen.run.simulate import simulate

SCENARIO = """\
simscen: 1
world:
  simscen: 1
  walls: [{points: [[0, 0], [6, 0], [6, 4], [0, 4], [0, 0]]}]
  obstacles: [{name: crate, box: [0.5, 2, 1], pose: {x: 3, y: 1}}]
robot: {pose: {x: 1, y: 1}}
goals: [{name: desk, pose: {x: 5, y: 1}}, {name: behind the wall, pose: {x: 9, y: 9}}]
time_limit: 2
pass: [{collisions: {max: 0}}]
"""


def test_logs_are_the_same_with_a_cold_a_warm_and_a_damaged_cache(tmp_path: Path, monkeypatch) -> None:
    (tmp_path / "a.scenario.yaml").write_text(SCENARIO)
    loaded = load_scenario(tmp_path / "a.scenario.yaml", tmp_path)
    cache = tmp_path / "cache"

    def log(disk_cache: DiskCache) -> bytes:
        prepared = ScenarioCache(CachedWorldBuilder(disk_cache)).get_or_prepare(loaded)
        simulate(prepared, 1, log=tmp_path / "run.mcap")
        return (tmp_path / "run.mcap").read_bytes()

    without, cold = log(DiskCache(None)), log(DiskCache(cache))
    assert len(list(cache.iterdir())) == 2
    with monkeypatch.context() as broken:
        broken.setattr(scenario_cache, "draw_map", None)
        broken.setattr(scenario_cache, "legs_between", None)
        warm = log(DiskCache(cache))
    for file in cache.iterdir():
        file.write_bytes(file.read_bytes()[:-3] + b"xyz")
    assert without == cold == warm == log(DiskCache(cache))


def test_readable_but_invalid_cache_file_is_ignored(tmp_path: Path) -> None:
    files = DiskCache(tmp_path)
    builder = CachedWorldBuilder(files)
    world = World("w", (Solid(Box((4.0, 0.2, 1.0)), Pose3(0.0, 2.0, 0.5), "wall"),), bounds=(-3.0, -3.0, 3.0, 3.0))
    built = builder.build(world, 0.2)
    ends = [(Pose2(0.0, 0.0), Goal("far", Pose2(0.0, 2.9)))]
    legs = builder.legs(built, ends, 0.2)
    for invalid_content in (b"", b"[]", b"[1]", b'[{"length": "short"}]', bytes(40), bytes([255]) * 40):
        for file in list(tmp_path.iterdir()):
            files.put(file.name, invalid_content)
        again = builder.build(world, 0.2)
        assert (again.map.cells == built.map.cells).all()
        assert again.map.cells.dtype == built.map.cells.dtype
        assert builder.legs(built, ends, 0.2) == legs


@pytest.mark.parametrize("other", [(1.0, 0.0, 0.2), (0.0, 0.5, 0.2), (0.0, 0.0, 0.3)])
def test_cached_path_lengths_depend_on_world_goal_and_robot(tmp_path: Path, other) -> None:
    builder = CachedWorldBuilder(DiskCache(tmp_path))

    def legs(wall: float, goal: float, radius: float) -> object:
        solid = Solid(Box((4.0, 0.2, 1.0)), Pose3(wall, 2.0, 0.5), "wall")
        built = builder.build(World("w", (solid,), bounds=(-3.0, -3.0, 3.0, 3.0)), 0.2)
        return builder.legs(built, [(Pose2(0.0, 0.0), Goal("far", Pose2(goal, 2.9)))], radius)

    assert legs(*other) != legs(0.0, 0.0, 0.2) == legs(0.0, 0.0, 0.2)


def test_cache_key_depends_on_the_source_code(monkeypatch) -> None:
    before = scenario_cache.cache_key("map", 1.0)
    scenario_cache._environment_key.cache_clear()
    monkeypatch.setattr(scenario_cache, "source_digest", lambda *parts: "of another version")
    assert scenario_cache.cache_key("map", 1.0) != before
    scenario_cache._environment_key.cache_clear()
