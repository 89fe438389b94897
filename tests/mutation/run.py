"""Check that tests detect small changes (mutants) of the modules that decide verdicts (`make mutation`).

Arguments are names of modules; without any, all modules are checked. Each mutant must be killed by a test, or be listed
in equivalent.yaml with the reason why it cannot be killed. The check fails if a mutant survives that is not listed, or
if a listed mutant is killed or does not exist. `--write` updates the table in the docs.
"""

import ast
import importlib
import sys
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import yaml
from mutants import Mutant, mutants
from targets import ROOT, module_name, modules, tests_of
from trial import run_tests, survives

EQUIVALENT = Path(__file__).with_name("equivalent.yaml")
TABLE = ROOT / "docs/design/mutation.md"
BEGIN, END = "<!-- table -->\n", "<!-- end of table -->\n"
PRELOADED_MODULES = (
    *("numpy", "pydantic", "hypothesis", "shapely", "shapely.affinity", "yaml", "_pytest.assertion.rewrite"),
    *("evo.core.metrics", "evo.core.trajectory", "filterpy.stats", "_hypothesis_pytestplugin"),
    *("simscen.core.records.trace", "simscen.core.records.case", "simscen.core.geometry.polygons"),
)
"""Modules that are imported once here, so that the forked process of each trial need not import them."""


@dataclass
class Tally:
    """Results of the mutants of a module. `stale` are messages about listed mutants that are killed or do not exist."""

    total: int = 0
    killed: int = 0
    equivalent: int = 0
    alive: list[Mutant] = field(default_factory=list)
    stale: list[str] = field(default_factory=list)


def check(file: Path, listed: dict[str, str]) -> Tally:
    """Test each mutant of a module. `listed` has the reason why a mutant is equivalent, by Mutant.change.

    Exits with a message if the tests fail without a mutant.
    """
    name, stages, tally = module_name(file), tests_of(file), Tally()

    @cache  # the tests of the last stages take long, and are not needed if earlier ones kill all mutants
    def limit(stage: int) -> float:
        """Return the time limit of a stage, after its tests have passed without a mutant."""
        passed, seconds = run_tests(name, file, ast.parse(file.read_text(encoding="utf-8")), stages[stage])
        if not passed:
            raise SystemExit(f"{name}: its tests fail without any mutant: {' '.join(stages[stage])}")
        return seconds

    unseen = dict(listed)
    for mutant in mutants(file):
        tally.total += 1
        expected = unseen.pop(mutant.change, None) is not None
        if all(survives(name, file, mutant.tree, tests, limit(stage)) for stage, tests in enumerate(stages)):
            tally.equivalent += expected
            if not expected:
                tally.alive.append(mutant)
                print(f"  SURVIVED {name}:{mutant.line} {mutant.change}", flush=True)
        else:
            tally.killed += 1
            tally.stale += [f"killed, though listed: {mutant.change}"] if expected else []
    tally.stale += [f"listed, but no such mutant: {change}" for change in unseen]
    return tally


def main(arguments: list[str]) -> int:
    """Run the check; return 0, or 1 if it fails."""
    for module in PRELOADED_MODULES:
        importlib.import_module(module)
    wanted = [argument for argument in arguments if not argument.startswith("--")]
    listed = yaml.safe_load(EQUIVALENT.read_text(encoding="utf-8")) if EQUIVALENT.exists() else {}
    rows, failed = [], False
    for file in modules():
        short = file.relative_to(ROOT / "simscen").as_posix()
        if wanted and short not in wanted and file.stem not in wanted:
            continue
        tally = check(file, (listed or {}).get(short, {}))
        rows.append((short, tally.total, tally.killed, tally.equivalent, len(tally.alive)))
        print(f"{short:42} {tally.total:5} {tally.killed:5} killed {tally.equivalent:4} equivalent", flush=True)
        for line in tally.stale:
            print(f"  STALE {line}", flush=True)
        failed |= bool(tally.alive or tally.stale)
    if "--write" in arguments:
        update_table(rows)
    sums = [sum(row[k] for row in rows) for k in range(1, 5)]
    print(f"{sums[0]} mutants: {sums[1]} killed, {sums[2]} equivalent with a reason, {sums[3]} survived")
    return int(failed)


def update_table(rows: list[tuple[str, int, int, int, int]]) -> None:
    """Update these rows in the table of docs/design/mutation.md: module, mutants, killed, equivalent, survived.

    Rows of other modules are kept if the module exists.
    """
    before, rest = TABLE.read_text(encoding="utf-8").split(BEGIN)
    old, after = rest.split(END)
    known = {row[0]: row for row in (_row(line) for line in old.splitlines()[2:-1])} | {row[0]: row for row in rows}
    all_rows = [known[name] for name in sorted(known) if (ROOT / "simscen" / name).exists()]
    total = ("**all**", *(sum(row[k] for row in all_rows) for k in range(1, 5)))
    lines = ["| module | mutants | killed | equivalent | survived |", "|---|---|---|---|---|"]
    lines += ["| " + " | ".join(map(str, row)) + " |" for row in [*all_rows, total]]
    TABLE.write_text(before + BEGIN + "\n".join(lines) + "\n" + END + after, encoding="utf-8")


def _row(line: str) -> tuple[str, int, int, int, int]:
    name, *numbers = (cell.strip() for cell in line.strip("|").split("|"))
    total, killed, equivalent, survived = map(int, numbers)
    return name, total, killed, equivalent, survived


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
