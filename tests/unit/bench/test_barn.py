"""Tests of the worlds of the BARN challenge: their list and their scenarios."""

from pathlib import Path

import pytest

from simscen.bench.navigation.barn import BarnWorld, read_barn_worlds, scenario_text
from simscen.core.errors import UsageError
from simscen.loading.scenario import load_scenario

DATA = Path(__file__).parents[4] / "shared" / "data" / "barn_sample"


def test_a_scenario_of_the_challenge_is_valid(tmp_path: Path) -> None:
    (tmp_path / "empty.world.yaml").write_text("simscen: 1\n")
    file = tmp_path / "barn.scenario.yaml"
    file.write_text(scenario_text("a world", "empty.world.yaml"))
    loaded = load_scenario(file, tmp_path)
    assert loaded.map == "none"
    assert loaded.spec.time_limit == 100.0


@pytest.mark.parametrize(
    ("text", "expected_text"),
    [
        ("world,length\n1,12\n", "no column 'ref_path_len'"),
        ("world,ref_path_len\n1,12\n2,far\n", "line 3: could not convert string to float: 'far'"),
        ("world,ref_path_len\n1\n", "line 2: "),
        ("world,ref_path_len\n1,-3\n", "line 2: `ref_path_len` must be a length above 0 m, not -3"),
        ("world,ref_path_len\n", "lists no worlds"),
    ],
)
def test_invalid_list_of_worlds_is_reported(tmp_path: Path, text: str, expected_text: str) -> None:
    (tmp_path / "scenarios.csv").write_text(text)
    with pytest.raises(UsageError) as error:
        read_barn_worlds(tmp_path)
    assert f"{tmp_path / 'scenarios.csv'}" in str(error.value)
    assert expected_text in str(error.value)


def test_list_of_worlds_from_a_spreadsheet_is_read(tmp_path: Path) -> None:
    (tmp_path / "scenarios.csv").write_bytes(b"\xef\xbb\xbfworld,ref_path_len\r\n7,10.5\r\n")
    assert read_barn_worlds(tmp_path) == [BarnWorld(tmp_path / "world_7.world", 10.5)]


def test_folder_without_a_list_of_worlds_is_reported(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"cannot read the list of BARN's worlds: .*scenarios\.csv"):
        read_barn_worlds(tmp_path)


@pytest.mark.skipif(not DATA.is_dir(), reason="the BARN worlds are not in this folder: see CONTRIBUTING.md")
def test_worlds_of_the_dataset_have_their_reference_lengths() -> None:
    worlds = {world.file.stem: world for world in read_barn_worlds(DATA)}
    assert len(worlds) == 6
    assert worlds["world_1"].reference_length == 12.431
    assert all(world.file.is_file() for world in worlds.values())
