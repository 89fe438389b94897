"""Tests that each shipped scenario can fail: with a broken stack, without its disturbance, or with a tighter bound.

can_fail/ has a file for each theme. For each criterion that must fail, it has new values by path in the YAML.
"""

import copy
import shutil
from pathlib import Path

import pytest
import yaml

from simscen.core.records.run_result import Outcome
from simscen.core.records.verdict import Status
from simscen.loading.scenario import load_scenario
from simscen.run.preparation import prepare
from simscen.run.simulate import simulate

ROOT = Path(__file__).parents[2]
FOLDER = Path(__file__).with_name("can_fail")
CHANGES = {
    f"{file.stem}/{name}": [next(iter(change.items())) for change in entries]
    for file in sorted(FOLDER.glob("*.yaml"))
    for name, entries in yaml.safe_load(file.read_text()).items()
}
ALL_CHANGES = [(scenario, *change) for scenario, changes in CHANGES.items() for change in changes]
CASES = [
    pytest.param(*change, id=f"{change[0]}:{change[1]}", marks=[pytest.mark.slow] if number % 24 else [])
    for number, change in enumerate(ALL_CHANGES)
]
"""`make test` runs every 24th case, `make test-all` all of them, which takes as long as all scenarios twice."""


def test_every_shipped_scenario_is_in_the_table():
    shipped = {file.relative_to(ROOT / "scenarios").as_posix().removesuffix(".scenario.yaml")
               for file in (ROOT / "scenarios").rglob("*.scenario.yaml")}  # fmt: skip
    assert shipped - {name for name in shipped if name.startswith("corner_cases/")} == set(CHANGES)


@pytest.mark.sample(2)
@pytest.mark.parametrize(("scenario", "criterion", "changes"), CASES)
def test_a_broken_scenario_fails_for_the_stated_reason(scenario, criterion, changes, tmp_path):
    result = run(changed_scenario(scenario, changes), scenario, tmp_path)
    assert result.outcome is Outcome.FAILED
    statuses = {verdict.status for verdict in result.verdicts if verdict.criterion == criterion}
    assert Status.FAIL in statuses, [(verdict.id, verdict.status.value) for verdict in result.verdicts]


class Loader(yaml.SafeLoader):
    """YAML 1.2 as far as scenarios need it: `off` is text."""


Loader.yaml_implicit_resolvers = {
    first: [(tag, pattern) for tag, pattern in resolvers if tag != "tag:yaml.org,2002:bool" or first in "tTfF"]
    for first, resolvers in yaml.SafeLoader.yaml_implicit_resolvers.items()
}


def changed_scenario(scenario: str, changes) -> dict:
    """Return the content of a shipped scenario with new values by path."""
    text = (ROOT / "scenarios" / f"{scenario}.scenario.yaml").read_text()
    spec = copy.deepcopy(yaml.load(text, Loader))
    spec.pop("variations", None)  # the changes apply to the scenario without variations
    for path, value in changes.items():
        *keys, last = [int(key) if key.isdigit() else key for key in path.split(".")]
        parent = spec
        for key in keys:
            parent = parent[key] if isinstance(parent, list) else parent.setdefault(key, {})
        parent[last] = value
    return spec


def run(spec: dict, scenario: str, root: Path):
    shutil.copytree(ROOT / "worlds", root / "worlds")
    file = root / "scenarios" / f"{scenario}.scenario.yaml"
    file.parent.mkdir(parents=True)
    file.write_text(yaml.safe_dump(spec))
    loaded = load_scenario(file, root)
    return simulate(prepare(loaded)).result
