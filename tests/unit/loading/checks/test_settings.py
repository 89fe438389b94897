"""Warnings about settings without an effect."""

from pathlib import Path

import pytest

from simscen.loading.checks.files import check_file

SCENARIO = """\
simscen: 1
world: {simscen: 1, walls: [{points: [[0, 0], [6, 0], [6, 4], [0, 4], [0, 0]]}]}
robot: {pose: {x: 1, y: 1}}
stack: {localizer: {type: LOCALIZER}}
goals: [{pose: {x: 5, y: 3}}]
pass: [{goals_reached: {}}]
"""


@pytest.mark.parametrize(
    ("localizer", "ignored"),
    [
        ("scan_matching_amcl, recovery_alpha_slow: 0.001, recovery_alpha_fast: 0.1", ["slow", "fast"]),
        ("scan_matching_amcl, recovery_alpha_slow: 0", []),
        ("scan_matching_amcl, parameters: consistent", []),
        ("scan_matching_amcl, relocalization: random, recovery_alpha_slow: 0.001", []),
        ("amcl, recovery_alpha_slow: 0.001", []),
    ],
)
def test_recovery_parameters_without_effect_are_named(localizer: str, ignored: list[str], tmp_path: Path) -> None:
    file = tmp_path / "a.scenario.yaml"
    file.write_text(SCENARIO.replace("LOCALIZER", localizer))
    found = check_file("scenario", file, tmp_path)
    assert [(problem.code, problem.severity) for problem in found] == [("SC055", "warning")] * len(ignored)
    for problem, name in zip(found, ignored, strict=True):
        assert problem.message == f"`recovery_alpha_{name}` has no effect with `relocalization: scan_matching`"
