"""Run each shipped scenario with twenty seeds, and write the results into docs/reference/scenarios.md (`make library`).

With `--from FOLDER`, use the results of an earlier session in this folder.
"""

import json
import statistics
import subprocess
import sys
import tempfile
from collections import Counter, defaultdict
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import yaml

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs/reference/scenarios.md"
BEGIN = "<!-- table: make library -->\n"
SEEDS = 20

Run = dict[str, Any]


def shipped_scenarios() -> list[str]:
    """Return the paths of the shipped scenarios in scenarios/, without the suffix, sorted."""
    folder = ROOT / "scenarios"
    return sorted(
        file.relative_to(folder).as_posix().removesuffix(".scenario.yaml") for file in folder.rglob("*.scenario.yaml")
    )


def table(runs: Iterable[Run]) -> str:
    """Return the Markdown of the results: a section for each theme, with a table row for each scenario."""
    by_scenario: dict[str, list[Run]] = defaultdict(list)
    for run in runs:
        by_scenario[run["scenario"].removeprefix("scenarios/")].append(run)
    themes: dict[str, list[str]] = defaultdict(list)
    for name in shipped_scenarios():
        themes[name.split("/")[0]].append(_row(name, by_scenario[name]))
    return "".join(
        f"\n## {theme.replace('_', ' ').capitalize()}\n\n"
        "| scenario | description | passed | simulated time | failed criteria |\n|---|---|---|---|---|\n"
        + "".join(rows)
        for theme, rows in themes.items()
    )


def _row(name: str, runs: list[Run]) -> str:
    file = f"scenarios/{name}.scenario.yaml"
    scenario = yaml.load((ROOT / file).read_text(encoding="utf-8"), yaml.BaseLoader)
    description = " ".join(scenario["description"].split())
    passed = sum(run["outcome"] == "passed" for run in runs)
    seconds = statistics.median(run["simulated_seconds"] for run in runs)
    link, causes = f"[{scenario['name']}](../../{file})", _failure_causes(runs)
    cells = [link, description, f"{passed} of {len(runs)}", f"{seconds:.0f} s", causes]
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |\n"


def _failure_causes(runs: list[Run]) -> str:
    """Return the failed criteria and the errors of runs, with the number of runs that have each."""
    causes = Counter(
        cause
        for run in runs
        if run["outcome"] != "passed"
        for cause in (
            [f"error: {run['error']['kind']}"]
            if run["error"]
            else {verdict["id"] for verdict in run["verdicts"] if verdict["status"] != "pass"}
        )
    )
    return ", ".join(f"{cause} {count}×" for cause, count in sorted(causes.items()))


def run_all(folder: Path) -> Path:
    """Run all shipped scenarios, and return the folder of the session. Exits with a message if simscen fails."""
    out = folder / "out"
    command = [sys.executable, "-m", "simscen", "run", "scenarios/", "--repeat", str(SEEDS), "--out", str(out)]
    process = subprocess.run(command, cwd=ROOT, check=False)
    if process.returncode not in (0, 1):  # 1: some runs have failed, which the table shows
        sys.exit(f"simscen ended with {process.returncode}")
    return out


def main() -> None:
    """Write the results into the page."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(sys.argv[2]) if sys.argv[1:2] == ["--from"] else run_all(Path(folder))
        runs = json.loads((out / "results.json").read_text(encoding="utf-8"))["runs"]
    head = PAGE.read_text(encoding="utf-8").split(BEGIN)[0]
    PAGE.write_text(head + BEGIN + table(runs), encoding="utf-8")


if __name__ == "__main__":
    main()
