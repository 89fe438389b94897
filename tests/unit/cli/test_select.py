"""Tests of the selection of scenarios by paths, keywords, and shards."""

from pathlib import Path

import pytest

from simscen.cli.session.exit_codes import exit_code
from simscen.cli.session.selection import Selection, load_selection, parse_shard
from simscen.core.errors import Exit, InvalidInput, UsageError

TEXT = """\
simscen: 1
world: room.world.yaml
robot: {pose: {x: 1, y: 1}}
pass: [{collisions: {max: 0}}]
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "room.world.yaml").write_text(
        "simscen: 1\nwalls: [{points: [[0, 0], [4, 0], [4, 4], [0, 4], [0, 0]]}]\n"
    )
    for name in "abcde":
        (tmp_path / f"{name}.scenario.yaml").write_text(TEXT)
    return tmp_path


@pytest.mark.parametrize("count", [1, 2, 3, 5])
def test_every_scenario_is_in_exactly_one_shard(folder: Path, count: int) -> None:
    shards = [load_selection([folder], folder, [], False, Selection(shard=(k + 1, count)))[0] for k in range(count)]
    ids = [scenario.id for shard in shards for scenario in shard]
    assert sorted(ids) == ["a", "b", "c", "d", "e"]
    assert max(map(len, shards)) - min(map(len, shards)) <= 1


@pytest.mark.parametrize("text", ["", "1", "0/2", "3/2", "1/0", "-1/2", "a/b", "1/2/3", "１/２x"])
def test_invalid_shards_are_rejected(text: str) -> None:
    with pytest.raises(UsageError, match="expected i/n"):
        parse_shard(text, {})


def test_invalid_file_stops_the_session_even_if_not_selected(folder: Path) -> None:
    (folder / "bad.scenario.yaml").write_text("simscen: 1\n")
    with pytest.raises(InvalidInput, match=r"bad\.scenario\.yaml"):
        load_selection([folder], folder, [], False, Selection(keyword="a"))


def test_notes_of_a_world_are_reported_once(folder: Path) -> None:
    sdf = """<sdf version='1.6'><world name='w'><model name='m'><static>1</static><link name='l'><collision name='c'>
    <geometry><box><size>1 1 1</size></box></geometry></collision></link></model></world><world name='x'/></sdf>"""
    (folder / "two_worlds.sdf").write_text(sdf)
    for name in "xy":
        text = TEXT.replace("room.world.yaml", "two_worlds.sdf\nmap: none").replace("{x: 1, y: 1}", "{x: 3, y: 3}")
        (folder / f"{name}.scenario.yaml").write_text(text)
    _, warnings = load_selection([folder], folder, [], False, Selection(keyword="x or y"))
    assert [warning.severity for warning in warnings] == ["warning"]
    assert "only the first world of a file is loaded" in warnings[0].message
    assert load_selection([folder], folder, [], False, Selection(keyword="a"))[1] == []


def test_session_without_runs_does_not_pass() -> None:
    assert exit_code([]) is Exit.NOTHING_SELECTED
