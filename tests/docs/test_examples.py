"""Tests that all scenarios and worlds in the documentation are valid."""

import re
import shutil
from pathlib import Path

import pytest

from simscen.loading.checks.files import check_file, file_kind

ROOT = Path(__file__).parents[2]
# Other tests read these pages: test_own_packages.py and test_extends_guide.py.
OTHER_PAGES = re.compile("own-|extends")
PAGES = [ROOT / "README.md", *(p for p in sorted((ROOT / "docs").rglob("*.md")) if not OTHER_PAGES.match(p.name))]
BLOCK = re.compile(r"^```yaml\n(.*?)^```", re.MULTILINE | re.DOTALL)


def blocks():
    for page in PAGES:
        for match in BLOCK.finditer(page.read_text(encoding="utf-8")):
            if match[1].startswith("simscen: 1") or "\nsimscen: 1\n" in match[1]:
                line = page.read_text(encoding="utf-8")[: match.start()].count("\n") + 2
                yield pytest.param(match[1], id=f"{page.relative_to(ROOT)}:{line}")


@pytest.fixture(scope="module")
def project(tmp_path_factory):
    root = tmp_path_factory.mktemp("docs")
    shutil.copytree(ROOT / "worlds", root / "worlds")
    (root / "scenarios" / "theme").mkdir(parents=True)
    (root / "scenarios" / "jackal.urdf").write_text("<robot name='jackal'/>")
    for file in (ROOT / "scenarios").rglob("*.scenario.yaml"):  # studies in the documentation extend these
        text = file.read_text(encoding="utf-8").replace("../../worlds", "../worlds")
        (root / "scenarios" / file.name).write_text(text, encoding="utf-8")
    tutorial = (ROOT / "docs/tutorials/flaky-to-fixed.md").read_text(encoding="utf-8")
    (root / "scenarios" / "crossing.scenario.yaml").write_text(BLOCK.search(tutorial)[1], encoding="utf-8")
    return root


@pytest.mark.parametrize("block", blocks())
def test_complete_example_is_valid(block, project):
    kinds = {"\nextends:": "study", "\npass:": "scenario", "\ndrive:": "robot", "\nstack:": "stack"}
    kind = next((kind for key, kind in kinds.items() if key in block), "world")
    folder = "scenarios/theme" if "../../worlds" in block else "scenarios"
    file = project / folder / f"example.{kind}.yaml"
    file.write_text(block, encoding="utf-8")
    problems = check_file(file_kind(file, project), file, project, ())
    assert [f"{problem.place}: {problem.message}" for problem in problems] == []


def test_the_documentation_has_examples():
    assert len(list(blocks())) >= 3
