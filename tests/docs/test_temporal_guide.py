"""Tests of the guide to temporal criteria."""

import json
import re
import shutil
from pathlib import Path

import pytest
import yaml
from typer.testing import CliRunner

from simscen.cli.main import app
from simscen.criteria.registry import AnyCriterion
from simscen.judge.evaluation import judge
from simscen.judge.result_json import verdict_data
from simscen.record.log_reader import read_log

ROOT = Path(__file__).parents[2]
GUIDE = (ROOT / "docs" / "guides" / "temporal-criteria.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"^```yaml\n(.*?)^```", GUIDE, re.MULTILINE | re.DOTALL)


@pytest.mark.parametrize("block", [block for block in BLOCKS if "simscen:" not in block])
def test_criterion_in_the_guide_is_valid(block):
    assert AnyCriterion.model_validate(yaml.safe_load(block)).kind in block


def test_every_criterion_of_the_guide_is_decided(tmp_path):
    shutil.copytree(ROOT / "worlds", tmp_path / "worlds")
    (tmp_path / "scenarios").mkdir()
    file = tmp_path / "scenarios" / "blind.scenario.yaml"
    file.write_text(BLOCKS[0], encoding="utf-8")
    out = tmp_path / "out"
    done = CliRunner().invoke(app, ["run", str(file), "--root", str(tmp_path), "--out", str(out)])
    assert done.exit_code == 0, done.output
    (run,) = json.loads((out / "results.json").read_text())["runs"]
    temporal = [verdict for verdict in run["verdicts"] if verdict["criterion"] != "goals_reached"]
    assert [verdict["criterion"] for verdict in temporal] == ["eventually", "whenever", "always", "until"]
    for verdict in temporal:
        assert verdict["status"] == "pass"
        assert verdict["findings"][0]["time"] is not None
    log = read_log(next(out.rglob("run.mcap")))
    criteria = [AnyCriterion.model_validate(entry) for entry in yaml.safe_load(BLOCKS[0])["pass"]]
    again = judge(criteria, log.trace, log.header.case)
    assert [verdict_data(v, 0, log.trace.tick_rate) for v in again] == [{**v, "line": 0} for v in run["verdicts"]]
