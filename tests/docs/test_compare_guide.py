"""Tests of the guide to comparing stacks: files, commands, and output."""

import re
import shlex
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from simscen.cli.main import app
from simscen.loading.checks.files import check_file
from simscen.loading.stacks.userconfig import load_config

ROOT = Path(__file__).parents[2]
GUIDE = (ROOT / "docs" / "guides" / "compare-stacks.md").read_text(encoding="utf-8")
FILES = dict(re.findall(r"^```yaml\n# (\S+\.yaml)\n(.*?)^```", GUIDE, re.MULTILINE | re.DOTALL))
CONFIG = re.findall(r"^```yaml\n(# yaml-language-server.*?)^```", GUIDE, re.MULTILINE | re.DOTALL)[0]
SHOWN = re.findall(r"^```console\n\$ simscen (.*?)\n```", GUIDE, re.MULTILINE | re.DOTALL)[0]
TABLE = re.findall(r"^```text\n(.*?)^```", GUIDE, re.MULTILINE | re.DOTALL)[0]
LISTED = [line for line in re.findall(r"^    simscen (.*?)(?:  .*)?$", GUIDE, re.MULTILINE) if "doctor" not in line]


@pytest.fixture
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Write the files, programs, and configuration of the guide; return their folder."""
    for name, text in FILES.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    for name in ("nav", "my_nav"):
        (tmp_path / name).write_text("#!/bin/sh\n")
        (tmp_path / name).chmod(0o755)
    (tmp_path / ".git").mkdir()
    (tmp_path / "home/my_nav").mkdir(parents=True)
    (tmp_path / "home/simscen").mkdir()
    (tmp_path / "home/simscen/config.yaml").write_text(CONFIG)
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "home"))
    monkeypatch.setenv("PATH", f"{Path(sys.executable).parent}:/usr/bin:/bin")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_files_and_configuration_of_the_guide_are_valid(project: Path) -> None:
    assert set(FILES) == {"scenarios/room.scenario.yaml", "stacks/dwb.stack.yaml"}
    for name in FILES:
        assert check_file(name.split(".")[-2], project / name, project) == []
    command = load_config(project / "home/simscen/config.yaml").command("mine", {"PATH": "/usr/bin:/bin"}, project)
    assert command is not None
    assert (command.start_limit, command.answer_limit, command.cwd) == (60.0, 2.0, str(project / "home/my_nav"))


@pytest.mark.slow
def test_comparison_prints_the_output_of_the_guide(project: Path) -> None:
    """Only words and outcomes are compared, because the last digits differ between processors."""
    done = CliRunner().invoke(app, [*shlex.split(SHOWN), "--out", "out"])
    assert done.exit_code == 1
    output = done.output.partition("\n\n")[2].partition("\n\n\ndid not pass:")[0]
    assert words(output) == words(TABLE)
    assert "scenarios/room   6/6   4/6" in output
    assert (project / "out/runs/scenarios/room/seed-3-dwb/run.mcap").is_file()
    assert "room [seed 3, dwb]" in (project / "out/junit.xml").read_text()
    assert '"comparison"' in (project / "out/results.json").read_text()
    assert "dwb against rpp" in (project / "out/report.html").read_text()


def words(text: str) -> list[list[str]]:
    """Return the words of each line, without numbers."""
    return [re.findall(r"[a-z_]{2,}", line) for line in text.strip("\n").splitlines()]


@pytest.mark.parametrize("command", [line for line in LISTED if not line.startswith("run")])
def test_listed_command_succeeds(project: Path, command: str) -> None:
    assert CliRunner().invoke(app, shlex.split(command)).exit_code == 0


@pytest.mark.parametrize("command", [line for line in LISTED if line.startswith("run")])
def test_listed_stack_commands_are_valid(project: Path, command: str) -> None:
    """The stacks in the commands do not exist here, so that the commands are only validated."""
    checked = ["validate", *shlex.split(command)[1:]]
    done = CliRunner().invoke(app, checked)
    assert done.exit_code == 0, done.output
