"""Every shipped scenario over twenty seeds: `make library` runs them and writes what came of it into the docs.

`--from FOLDER` writes the page from the results of a session that was run before.
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


def shipped() -> list[str]:
    """The ids of what ships, seen from scenarios/."""
    folder = ROOT / "scenarios"
    return sorted(
        file.relative_to(folder).as_posix().removesuffix(".scenario.yaml") for file in folder.rglob("*.scenario.yaml")
    )


def table(runs: Iterable[Run]) -> str:
    """A section for each theme, a row for each scenario: why it is there, and what came of its runs."""
    by_scenario: dict[str, list[Run]] = defaultdict(list)
    for run in runs:
        by_scenario[run["scenario"].removeprefix("scenarios/")].append(run)
    themes: dict[str, list[str]] = defaultdict(list)
    for name in shipped():
        themes[name.split("/")[0]].append(_row(name, by_scenario[name]))
    return "".join(
        f"\n## {theme.replace('_', ' ').capitalize()}\n\n"
        "| scenario | description | passed | simulated time | failed criteria |\n|---|---|---|---|---|\n"
        + "".join(rows)
        for theme, rows in themes.items()
    )


def _row(name: str, runs: list[Run]) -> str:
    file = f"scenarios/{name}.scenario.yaml"
    about = yaml.load((ROOT / file).read_text(encoding="utf-8"), yaml.BaseLoader)
    why = " ".join(about["description"].split())
    passed = sum(run["outcome"] == "passed" for run in runs)
    seconds = statistics.median(run["simulated_seconds"] for run in runs)
    cells = [f"[{about['name']}](../../{file})", why, f"{passed} of {len(runs)}", f"{seconds:.0f} s", _failed(runs)]
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |\n"


def _failed(runs: list[Run]) -> str:
    """Which verdicts did not hold, and how often; a run that could not be completed by its error."""
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
    """Run them; that some fail is what the page is for."""
    out = folder / "out"
    command = [sys.executable, "-m", "simscen", "run", "scenarios/", "--repeat", str(SEEDS), "--out", str(out)]
    done = subprocess.run(command, cwd=ROOT, check=False)
    if done.returncode not in (0, 1):
        sys.exit(f"simscen ended with {done.returncode}")
    return out


def main() -> None:
    """Write the page."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(sys.argv[2]) if sys.argv[1:2] == ["--from"] else run_all(Path(folder))
        runs = json.loads((out / "results.json").read_text(encoding="utf-8"))["runs"]
    head = PAGE.read_text(encoding="utf-8").split(BEGIN)[0]
    PAGE.write_text(head + BEGIN + table(runs), encoding="utf-8")


if __name__ == "__main__":
    main()
