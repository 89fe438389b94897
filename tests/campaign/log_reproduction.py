"""Reproduction of failed runs: reconstruct scenarios from only their logs, run these, and compare the failures.

`python tests/campaign/log_reproduction.py [RUNS] [-k TEXT]` prints a table. RUNS is an output folder of `simscen run`;
without it, the scenarios of tests/scenarios/can_fail, which are made to fail, are run first. Each run of a
reconstructed scenario is judged with the criteria of the recorded one and with its own: an object that the lidar saw is
no person for criteria about people, for example. Exit code 1 if fewer than 80 % fail again in the same criterion.
"""

import argparse
import copy
import json
import shutil
import subprocess
import sys
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from simscen.core.errors import SimscenError
from simscen.core.records.verdict import Status
from simscen.judge.run_result import judge_run
from simscen.loading.scenario_text import criteria_of_text
from simscen.reconstruction.scenario_from_log import ReconstructionOptions, scenario_from_log
from simscen.record.log_reader import Log, read_log

ROOT = Path(__file__).parents[2]
CAN_FAIL = ROOT / "tests" / "scenarios" / "can_fail"
MIN_SHARE = 0.8


class Loader(yaml.SafeLoader):
    """YAML 1.2 as far as scenarios need it: `off` is text."""


Loader.yaml_implicit_resolvers = {
    first: [(tag, pattern) for tag, pattern in resolvers if tag != "tag:yaml.org,2002:bool" or first in "tTfF"]
    for first, resolvers in yaml.SafeLoader.yaml_implicit_resolvers.items()
}


def write_broken_scenarios(root: Path) -> None:
    """Write the scenarios of can_fail in which something other than a criterion is changed."""
    shutil.copytree(ROOT / "worlds", root / "worlds")
    for file in sorted(CAN_FAIL.glob("*.yaml")):
        if file.stem == "multi_robot":
            continue
        for name, all_changes in yaml.safe_load(file.read_text()).items():
            for number, changes_by_criterion in enumerate(all_changes):
                for criterion, values in changes_by_criterion.items():
                    if values and not any(str(path).startswith("pass") for path in values):
                        target = root / "scenarios" / file.stem / f"{name}-{number}-{criterion}.scenario.yaml"
                        target.parent.mkdir(parents=True, exist_ok=True)
                        source = ROOT / "scenarios" / file.stem / f"{name}.scenario.yaml"
                        target.write_text(yaml.safe_dump(changed(source, values)))


def remove_refused(root: Path) -> None:
    """Remove the scenarios that are refused before they run, such as those with too short a timeout."""
    command = [sys.executable, "-m", "simscen", "validate", str(root / "scenarios"), "--root", str(root)]
    validated = subprocess.run([*command, "--format", "json"], check=False, cwd=root, capture_output=True, text=True)
    for problem in json.loads(validated.stdout)["problems"]:
        if problem["severity"] == "error":
            (root / problem["path"]).unlink(missing_ok=True)


def changed(file: Path, changes: dict[str, Any]) -> dict[str, Any]:
    """Return the data of a scenario with other values by path."""
    spec: dict[str, Any] = copy.deepcopy(yaml.load(file.read_text(), Loader))
    spec.pop("variations", None)
    for path, value in changes.items():
        *keys, last = [int(key) if key.isdigit() else key for key in path.split(".")]
        place: Any = spec
        for key in keys:
            place = place[key] if isinstance(place, list) else place.setdefault(key, {})
        place[last] = value
    return spec


def simscen_run(scenarios: Path, out: Path, root: Path) -> None:
    """Run all scenarios of a folder."""
    command = [
        sys.executable,
        "-m",
        "simscen",
        "run",
        str(scenarios),
        "--out",
        str(out),
        "--root",
        str(root),
        "-j",
        "1",
    ]
    subprocess.run(command, check=False, cwd=root, stdout=subprocess.DEVNULL)


def failed_criteria(log: Log, judged_as: Log) -> set[str]:
    """Return the criteria of one log's scenario that fail in another log."""
    spec = criteria_of_text(judged_as.header.scenario, "scenario.yaml", {})
    case = replace(log.header.case, regions=judged_as.header.case.regions, disturbances=())
    result = judge_run(log.header.key, "", spec.pass_, log.trace, case)
    return {verdict.criterion for verdict in result.verdicts if verdict.status is Status.FAIL}


def main() -> int:
    """Print the table, and return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("runs", nargs="?", type=Path, help="output folder of `simscen run`")
    parser.add_argument("--root", type=Path, default=ROOT, help="root of the scenarios in RUNS")
    parser.add_argument("-k", default="", help="only runs whose name contains this text")
    parser.add_argument("--keep", type=Path, help="folder for everything that is written; default: a temporary one")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        work = arguments.keep or Path(temporary)
        work.mkdir(parents=True, exist_ok=True)
        runs, root = arguments.runs, arguments.root
        if runs is None:
            root, runs = work / "broken", work / "runs"
            write_broken_scenarios(root)
            remove_refused(root)
            simscen_run(root / "scenarios", runs, root)
        return _report(runs, root, work, arguments.k)


def _report(runs: Path, root: Path, work: Path, text: str) -> int:
    logs = {
        "_".join(file.relative_to(runs).parts[2:-1]): file
        for file in sorted(runs.glob("runs/**/run.mcap"))
        if text in str(file.relative_to(runs)) and "multi_robot" not in file.parts
    }
    problems = {}
    home = work / "again"
    (home / "scenarios").mkdir(parents=True, exist_ok=True)
    for name, file in logs.items():
        try:
            scenario_from_log(file, home / "scenarios" / f"{name}.scenario.yaml", ReconstructionOptions(root=root))
        except SimscenError as error:
            problems[name] = str(error).splitlines()[0]
    simscen_run(home / "scenarios", work / "again-runs", home)
    count = again = 0
    for name, file in logs.items():
        repeated = sorted((work / "again-runs").glob(f"runs/**/{name}/*/run.mcap"))
        if not repeated:
            print(f"✗ {name:55} {problems.get(name, 'no run')}")
            count += 1
            continue
        one, other = read_log(file), read_log(repeated[0])
        before, after = failed_criteria(one, one), failed_criteria(other, one)
        own = failed_criteria(other, other)
        same = bool(before & (after | own)) if before else not after
        count += 1
        again += same
        print(f"{'✓' if same else '✗'} {name:55} {_line(one, other, before, after, own)}", flush=True)
    print(f"{again} of {count} runs come out as the log did")
    return 0 if again >= MIN_SHARE * count else 1


def _line(one: Log, other: Log, before: set[str], after: set[str], own: set[str]) -> str:
    times = np.arange(0, min(one.trace.end, other.trace.end), 24)
    apart = np.hypot(*(one.trace.truth.at(times)[:, :2] - other.trace.truth.at(times)[:, :2]).T)
    ends = f"{one.trace.seconds(one.trace.end):.1f} s, {other.trace.seconds(other.trace.end):.1f} s"
    distance = f"{float(np.sqrt(np.mean(apart**2))):.2f} m RMS" if len(apart) else ""
    return f"log {_names(before)}, run {_names(after)}, own criteria {_names(own)}; {ends}; {distance}"


def _names(criteria: set[str]) -> str:
    return "+".join(sorted(criteria)) or "passes"


if __name__ == "__main__":
    sys.exit(main())
