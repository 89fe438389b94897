"""Tests of the fork server's cache of prepared scenarios."""

from pathlib import Path

from simscen.loading.scenario import load_scenario, try_variations
from simscen.run import scenario_cache
from simscen.run.disk_cache import DiskCache
from simscen.run.scenario_cache import CachedWorldBuilder, ScenarioCache

TEXT = """\
simscen: 1
world: {simscen: 1, walls: [{points: [[0, 0], [6, 0], [6, 4], [0, 4], [0, 0]]}]}
robot: {pose: {x: 1, y: 1}}
goals: [{pose: {x: 5, y: 3}}]
pass: [{collisions: {max: 0}}]
variations: {grid: {robot.pose.x: [1, 2, 3]}}
"""


def test_variations_of_one_world_build_it_once_and_keep_only_the_last(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr(scenario_cache, "MAX_SCENARIOS", 2)
    (tmp_path / "a.scenario.yaml").write_text(TEXT)
    variations = try_variations(tmp_path / "a.scenario.yaml", tmp_path)
    assert isinstance(variations, tuple)
    cache = ScenarioCache(CachedWorldBuilder(DiskCache(None)))
    prepared = [cache.get_or_prepare(variation) for variation in variations]
    assert len({id(scenario.built) for scenario in prepared}) == 1
    assert [scenario.start.x for scenario in prepared] == [1, 2, 3]
    assert cache.get_or_prepare(variations[2]) is prepared[2]
    assert cache.get_or_prepare(variations[0]) is not prepared[0]


def test_a_scenario_with_the_same_name_but_other_content_is_prepared_again(tmp_path: Path) -> None:
    cache = ScenarioCache(CachedWorldBuilder(DiskCache(None)))
    starts = []
    for x in (1, 2):
        (tmp_path / "a.scenario.yaml").write_text(TEXT.replace("{x: 1, y: 1}", f"{{x: {x}, y: 1}}").split("var")[0])
        loaded = load_scenario(tmp_path / "a.scenario.yaml", tmp_path)
        starts.append(cache.get_or_prepare(loaded).start.x)
    assert starts == [1, 2]
