"""Tests of exact messages of `simscen validate` for well-formed scenarios that make no sense.

`SIMSCEN_UPDATE=1 pytest tests/diagnostics` writes the messages anew; read the difference before you keep it.
"""

import os
from pathlib import Path

import pytest

from simscen.cli.diagnostics import as_text
from simscen.cli.session.file_checks import FileChecker
from simscen.core.errors import Problem
from simscen.loading.codes import CODES

HERE = Path(__file__).parent / "meaningless"
CASES = sorted(HERE.glob("*.scenario.yaml"))
CHECKER = FileChecker(HERE)
OTHERS = {"SC014", "SC016", "SC030", "SC031", "SC032", "SC033", "SC035", "SC313", "SC314", "SC315"}


@pytest.fixture(scope="module")
def found() -> dict[Path, list[Problem]]:
    """Return the problems of each file; all files use the same small world."""
    return {case: CHECKER.check_scenario(case)[1] for case in CASES}


@pytest.mark.parametrize("case", CASES, ids=lambda path: path.name.split(".")[0])
def test_message_states_the_meaningless_part_and_its_position(case: Path, found: dict[Path, list[Problem]]) -> None:
    assert found[case], "no problem is reported for this file"
    expected = case.with_name(case.name.replace(".scenario.yaml", ".txt"))
    text = as_text(found[case]) + "\n"
    if os.environ.get("SIMSCEN_UPDATE"):
        expected.write_text(text, encoding="utf-8")
    assert text == expected.read_text(encoding="utf-8")


def test_at_least_seventy_cases_are_reported(found: dict[Path, list[Problem]]) -> None:
    assert [case.name for case, problems in found.items() if not problems] == []
    assert len(found) >= 70


def test_every_semantic_check_has_a_case(found: dict[Path, list[Problem]]) -> None:
    expected = {code for code in CODES if code.startswith("SC05") or "SC301" <= code <= "SC304" or code in OTHERS}
    assert expected - {problem.code for problems in found.values() for problem in problems} == set()


def test_every_message_file_has_a_case() -> None:
    assert {path.stem for path in HERE.glob("*.txt")} == {path.name.split(".")[0] for path in CASES}


@pytest.mark.parametrize("robot", ["turtlebot", "bare.urdf"])
def test_shared_world_and_robots_are_valid(robot: str, tmp_path: Path) -> None:
    for file in (HERE / "room.world.yaml", HERE / "bare.urdf"):
        (tmp_path / file.name).write_bytes(file.read_bytes())
    good = tmp_path / "good.scenario.yaml"
    good.write_text(
        f"simscen: 1\nworld: room.world.yaml\nrobot: {{model: {robot}, pose: start}}\n"
        "goals: [{pose: desk}]\npass: [{goals_reached: {}}]\n"
    )
    assert FileChecker(tmp_path).check_scenario(good)[1] == []
