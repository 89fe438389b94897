"""Tests of the line number of each criterion in a result."""

from pathlib import Path

from simscen.loading.scenario import load_scenario
from simscen.run.preparation import prepare
from simscen.run.simulate import simulate

BASE = """\
simscen: 1
world: {simscen: 1, walls: [{points: [[0, 0], [6, 0], [6, 4], [0, 4], [0, 0]]}]}
robot: {pose: {x: 1, y: 1}}
goals: [{pose: {x: 1.4, y: 1}}]
pass:
  - speed: {max: 2 m/s}
"""


def test_criterion_of_a_base_file_has_line_0(tmp_path: Path) -> None:
    """The result names only the scenario file, so a line of the base file would mislead."""
    (tmp_path / "base.yaml").write_text(BASE)
    (tmp_path / "a.scenario.yaml").write_text("extends: base.yaml\n\n\nname: a\n")
    (tmp_path / "b.scenario.yaml").write_text("extends: base.yaml\npass:\n  - collisions: {max: 0}\n")
    files = (tmp_path / f"{name}.scenario.yaml" for name in ("a", "b"))
    (inherited, overridden) = (simulate(prepare(load_scenario(file, tmp_path)), 1) for file in files)
    assert (inherited.result.lines, overridden.result.lines) == ((0,), (3,))
