"""Tests of `simscen list`."""

from pathlib import Path

import pytest


@pytest.fixture(autouse=True)
def _three_scenarios(simscen, tmp_path: Path) -> None:
    """Add two scenarios in the folder `faults`: one with a name and tags, and one without."""
    scenario = (tmp_path / "good.scenario.yaml").read_text()
    (tmp_path / "faults").mkdir()
    (tmp_path / "faults/off.scenario.yaml").write_text(
        scenario.replace("drive", "lidar off").replace("smoke", "fault, lidar")
    )
    (tmp_path / "faults/slip.scenario.yaml").write_text(
        scenario.replace("name: drive\n", "").replace("tags: [smoke]\n", "")
    )


def test_each_scenario_has_a_line(simscen) -> None:
    assert (
        simscen("list", ".").out == "faults/off   lidar off [fault, lidar]\nfaults/slip\ngood         drive [smoke]\n"
    )


def test_external_stack_is_listed(simscen, tmp_path: Path) -> None:
    file = tmp_path / "faults/slip.scenario.yaml"
    file.write_text(file.read_text() + "stack: {external: mine}\n")
    assert simscen("list", "faults").out.splitlines()[-1].split() == ["faults/slip", "(stack", "mine)"]


def test_keyword_and_tag_select_scenarios(simscen) -> None:
    assert simscen("list", ".", "-k", "faults and not slip").out.split()[0] == "faults/off"
    assert simscen("list", ".", "--tag", "smoke", "--tag", "lidar").out.count("\n") == 2


@pytest.mark.parametrize(
    ("arguments", "code", "expected_text"),
    [
        (["-k", "nothing"], 5, "none of 3 scenarios matches -k `nothing`"),
        (["--tag", "smoek"], 5, "did you mean `smoke`?"),
        (["-k", "("], 2, "cannot read -k `(`"),
    ],
)
def test_empty_or_invalid_selection_is_an_error(simscen, arguments: list[str], code: int, expected_text: str) -> None:
    result = simscen("list", ".", *arguments)
    assert (result.code, result.out) == (code, "")
    assert expected_text in result.err


def test_invalid_scenario_is_an_error(simscen, tmp_path: Path) -> None:
    (tmp_path / "bad.scenario.yaml").write_text("simscen: 1\n")
    result = simscen("list", ".")
    assert result.code == 2
    assert "missing key `world`" in result.err
