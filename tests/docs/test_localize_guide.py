"""Tests of the guide to recorded drives."""

import re
import shlex
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from simscen.cli.main import app

ROOT = Path(__file__).parents[2]
GUIDE = (ROOT / "docs" / "guides" / "localize.md").read_text(encoding="utf-8")
SHOWN = re.findall(r"^```console\n\$ simscen (.*?)\n(.*?)^```", GUIDE, re.MULTILINE | re.DOTALL)
FILES = re.findall(r"^```yaml\n# (\S+)\n(.*?)^```", GUIDE, re.MULTILINE | re.DOTALL)
NUMBER = re.compile(r"-?\d+\.?\d*")
"""Numbers of a particle filter differ slightly between processors."""

sys.path.insert(0, str(ROOT / "tests" / "unit" / "cli"))


@pytest.mark.parametrize(("command", "shown"), SHOWN, ids=[command for command, _ in SHOWN])
def test_command_prints_the_output_of_the_guide(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: str, shown: str
) -> None:
    from recorded_drives import write_carmen, write_map

    write_map(tmp_path)
    (tmp_path / "room.yaml").rename(tmp_path / "building.yaml")
    write_carmen(tmp_path, "FLASER")
    for name, text in FILES:
        (tmp_path / name).write_text(text)
    monkeypatch.chdir(tmp_path)
    printed = CliRunner().invoke(app, shlex.split(command)).stdout
    assert NUMBER.sub("#", printed) == NUMBER.sub("#", shown)
    printed_numbers, shown_numbers = (list(map(float, NUMBER.findall(text))) for text in (printed, shown))
    assert printed_numbers == pytest.approx(shown_numbers, abs=0.03)


def test_the_guide_shows_more_than_one_command() -> None:
    assert len(SHOWN) >= 2
    assert len(FILES) >= 1
