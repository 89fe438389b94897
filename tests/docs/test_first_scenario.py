"""Tests of the first tutorial and of the Python examples."""

import json
import re
import shutil
from pathlib import Path

import pytest
from typer.testing import CliRunner

from simscen.cli.main import app

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs/tutorials/first-scenario.md").read_text(encoding="utf-8")
FIRST, HARDER = re.findall(r"^```yaml\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)
PARTS = dict(re.findall(r"^## (\d)[^\n]*\n(.*?)(?=^## |\Z)", PAGE, re.MULTILINE | re.DOTALL))


@pytest.fixture
def clone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Change into a folder with the files of a clone that the page needs; return the folder."""
    shutil.copytree(ROOT / "worlds", tmp_path / "worlds")
    (tmp_path / "scenarios").mkdir()
    (tmp_path / ".git").mkdir()
    monkeypatch.chdir(tmp_path)
    return tmp_path


def call(*words: str) -> tuple[int, str]:
    done = CliRunner().invoke(app, list(words))
    return done.exit_code, done.output


def test_scenario_of_the_tutorial_passes(clone: Path) -> None:
    assert call("new", "scenarios/my_first")[0] == 0
    (clone / "scenarios/my_first.scenario.yaml").write_text(FIRST, encoding="utf-8")
    assert call("validate", "scenarios/my_first.scenario.yaml") == (0, "1 scenario is valid\n")
    code, output = call("run", "scenarios/my_first.scenario.yaml")
    assert code == 0, output


@pytest.mark.slow
def test_harder_scenario_fails_only_by_the_tight_bound_and_writes_the_named_files(clone: Path) -> None:
    before, after = "stopped_within: {time: 1 s, after: lidar.off}", "stopped_within: {time: 0.1 s, after: lidar.off}"
    assert before in HARDER and after in PARTS["4"]
    file = clone / "scenarios/my_first.scenario.yaml"
    file.write_text(HARDER.replace(before, after), encoding="utf-8")
    code, output = call("run", "scenarios/my_first.scenario.yaml")
    assert code == 1
    assert "stopped_within: " in output and "again" in output and "scenarios/my_first.scenario.yaml:16" in output
    (shown,) = re.findall(r"^```text\n(.*?)^```", PARTS["4"], re.MULTILINE | re.DOTALL)
    assert words(shown) == words(output.partition("\n")[2])[: len(words(shown))]
    session = clone / "simscen-out/latest"
    (run,) = json.loads((session / "results.json").read_text())["runs"]
    assert run["outcome"] == "failed"
    written = {path.name for path in session.rglob("*") if path.is_file()}
    named = set(re.findall(r"`(\w+\.(?:html|png|mcap))`", PARTS["4"]))
    assert {"replay.html", "report.html", "map.png", "run.mcap"} == named <= written
    log = next(session.rglob("run.mcap"))
    file.write_text(HARDER, encoding="utf-8")
    assert call("judge", str(log), "--scenario", str(file))[0] == 0


@pytest.mark.parametrize("page", ["python", pytest.param("several-robots", marks=pytest.mark.slow)])
def test_python_example_runs(page: str, clone: Path) -> None:
    shutil.copytree(ROOT / "scenarios", "scenarios", dirs_exist_ok=True)
    text = (ROOT / f"docs/guides/{page}.md").read_text(encoding="utf-8")
    (code,) = re.findall(r"^```python\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    exec(f"import simscen\n{code}", {"__name__": "__main__"})


def words(text: str) -> list[list[str]]:
    """Return the words of each line without numbers; their last digits differ between processors."""
    return [re.findall(r"[a-z_]{2,}", line) for line in text.strip("\n").splitlines()]
