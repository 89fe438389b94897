from pathlib import Path

import pytest

from simscen.loading.scenario import load_scenario
from simscen.study.barn import barn_worlds, scenario

DATA = Path(__file__).parents[4] / "shared" / "data" / "barn_sample"


def test_a_scenario_of_the_challenge_is_valid(tmp_path: Path) -> None:
    (tmp_path / "empty.world.yaml").write_text("simscen: 1\n")
    file = tmp_path / "barn.scenario.yaml"
    file.write_text(scenario("a world", "empty.world.yaml"))
    loaded = load_scenario(file, tmp_path)
    assert loaded.map == "none"
    assert loaded.spec.time_limit == 100.0


def test_an_unusable_list_of_worlds_is_named(tmp_path: Path) -> None:
    (tmp_path / "scenarios.csv").write_text("world,length\n1,12\n")
    with pytest.raises(ValueError, match=r"scenarios\.csv: no column 'ref_path_len'"):
        barn_worlds(tmp_path)


@pytest.mark.skipif(not DATA.is_dir(), reason="the worlds of others are not here: see CONTRIBUTING.md")
def test_the_worlds_of_the_dataset_are_there_with_their_reference_lengths() -> None:
    worlds = {world.file.stem: world for world in barn_worlds(DATA)}
    assert len(worlds) == 6
    assert worlds["world_1"].reference_length == 12.431
    assert all(world.file.is_file() for world in worlds.values())
