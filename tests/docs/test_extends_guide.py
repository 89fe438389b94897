"""Tests of the guide to `extends`."""

import re
from pathlib import Path

from simscen.loading.files.paths import PathSandbox
from simscen.loading.yaml.library import Library

GUIDE = Path(__file__).parents[2] / "docs/guides/extends.md"


def test_files_of_the_guide_are_merged_as_documented(tmp_path: Path) -> None:
    shown = re.findall(
        r"^```yaml\n# (\S+\.yaml)\n(.*?)^```", GUIDE.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL
    )
    assert [name for name, _ in shown] == ["defaults.yaml", "aisle.base.yaml", "slow.scenario.yaml"]
    for name, text in shown:
        (tmp_path / name).write_text(text)
    tree, problems = Library(PathSandbox.around(tmp_path)).read(tmp_path / "slow.scenario.yaml", defaults=True)
    assert problems == []
    assert tree is not None
    assert tree.plain == {
        "stack": {"controller": {"desired_linear_vel": 0.2}},
        "goals": [{"pose": "packing"}],
        "world": "../worlds/warehouse.world.yaml",
        "robot": {"model": "amr", "pose": "charger"},
        "simscen": 1,
        "tags": ["nightly"],
        "pass": [{"collisions": {"max": 0}}, {"goals_reached": {}}],
    }
