"""Tests of the guide to logs of real robots."""

import re
import shlex
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from simscen.cli.main import app
from simscen.record.foreign.options import TOPICS

ROOT = Path(__file__).parents[2]
GUIDE = (ROOT / "docs" / "guides" / "judge-real-robots.md").read_text(encoding="utf-8")
LIMITS = re.findall(r"^```yaml\n# limits.yaml\n(.*?)^```", GUIDE, re.MULTILINE | re.DOTALL)[0]
SHOWN = re.findall(r"^```console\n\$ simscen (.*?)\n(.*?)^```", GUIDE, re.MULTILINE | re.DOTALL)

sys.path.insert(0, str(ROOT / "tests" / "unit" / "record"))


@pytest.mark.parametrize(("command", "shown"), SHOWN, ids=[command.split(" --")[0] for command, _ in SHOWN])
def test_command_prints_the_output_of_the_guide(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: str, shown: str
) -> None:
    from foreign_logs import drive, write_bag, write_mcap

    (tmp_path / "logs").mkdir()
    (tmp_path / "limits.yaml").write_text(LIMITS)
    write_mcap(tmp_path / "logs/monday.mcap", drive())
    if "logs/monday" not in command:
        write_bag(tmp_path / "logs/tuesday", drive(off=0.15))
        write_mcap(tmp_path / "logs/wednesday.mcap", [one for one in drive() if one.topic not in ("/mocap", "/scan")])
    monkeypatch.chdir(tmp_path)
    assert CliRunner().invoke(app, shlex.split(command)).output == shown


def test_guide_lists_every_topic_name() -> None:
    for name, topic in TOPICS.items():
        assert f"`{name}`" in GUIDE and f"`{topic}`" in GUIDE
