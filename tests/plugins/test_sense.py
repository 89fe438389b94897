"""Tests of semantic checks for scenarios with actions of packages."""

from pathlib import Path

import pytest

SCENARIO = """\
simscen: 1
world:
  simscen: 1
  walls:
    - {points: [[0, 0], [6, 0], [6, 4], [0, 4], [0, 0]]}
    - {points: [[3, 0], [3, 4]]}
  regions: {behind: [[4, 1], [5, 1], [5, 2], [4, 2]]}
robot: {pose: {x: 1, y: 1}}
goals: [{pose: {x: 5, y: 3}}]
time_limit: 30 s
events:
  - {when: {time: 1 s}, do: %s}
  - {when: {robot_in: {region: behind}}, do: {push: {impulse: [0, 1]}}}
  - {when: {speed_above: 3 m/s}, do: {push: {impulse: [1, 0]}}}
pass:
  - result: {status: CANCELED}
"""


@pytest.fixture
def validate(yardwork, tmp_path: Path, monkeypatch, capsys):
    """Return `validate(action)`, for a scenario with a goal behind a wall and an event with this action."""
    from simscen.cli.main import main

    def call(action: str) -> tuple[int, str]:
        (tmp_path / "s.scenario.yaml").write_text(SCENARIO % action)
        monkeypatch.chdir(tmp_path)
        monkeypatch.setattr("sys.argv", ["simscen", "validate", "s.scenario.yaml"])
        with pytest.raises(SystemExit) as end:
            main()
        return int(end.value.code or 0), capsys.readouterr().out

    return call


def test_shipped_actions_do_not_hide_errors(validate) -> None:
    code, text = validate("{remove: {name: nothing}}")
    assert code == 2
    code, text = validate("{push: {impulse: [0, 2]}}")
    assert code == 2
    assert "no event cancels a goal" in text


def test_package_actions_turn_uncertain_errors_into_warnings(validate) -> None:
    code, text = validate("{turn_robot: {by: 1}}")
    assert code == 0, text
    assert "error[" not in text
    assert "unless an action of an installed package opens a route" in text
