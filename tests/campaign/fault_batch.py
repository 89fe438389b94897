"""Run a batch with a fault in each tenth run: `python tests/campaign/fault_batch.py [RUNS] [SEED]`, or `make campaign`.

Every run must have exactly one result, of the right kind. No process may be left behind. Runs without a fault must have
the same logs and results as in a batch without faults. The exit code is 1 if any of this does not hold.
"""

import json
import random
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

from junitparser import JUnitXml

SCRIPTED_FORK_SERVER = Path(__file__).parents[1] / "conformance" / "scripted_fork_server.py"
SIMSCEN = f"""
import simscen.cli.session.backends
from simscen.cli.main import main
simscen.cli.session.fork_server_start.FORK_SERVER = ({str(SCRIPTED_FORK_SERVER)!r},)
main()
"""
FAULTS = {
    "segfault": "crashed",
    "sigkill": "crashed",
    "exit-0": "crashed",
    "hang": "timeout",
    "memory": "out-of-memory",
    "exception": "crashed",
    "grandchild": "crashed",
    "daemon": "crashed",
    "flood": "passed",  # output does not affect the verdict
    "crash-to-prepare": "crashed",
}
SCENARIO = """\
simscen: 1
seed: {seed}
tags: [{tag}]
world: {{simscen: 1, walls: [{{points: [[0, 0], [6, 0], [6, 4], [0, 4], [0, 0]]}}]}}
robot: {{pose: {{x: {x}, y: 1}}}}
goals: [{{pose: {{x: {goal}, y: 1.2}}}}]
time_limit: 20
pass: [{{goals_reached: {{}}}}]
"""


def write_scenarios(folder: Path, runs: int, rng: random.Random) -> dict[str, str]:
    """Write the scenarios; return the fault of each, "" for none."""
    folder.mkdir()
    faults: dict[str, str] = {}
    for number in range(runs):
        fault = rng.choice(sorted(FAULTS)) if rng.random() < 0.1 else ""
        when = ".at.0" if fault and "prepare" not in fault and rng.random() < 0.5 else ""
        x = round(rng.uniform(0.8, 1.5), 2)
        text = SCENARIO.format(seed=number + 1, tag=fault + when or "fault-free", x=x, goal=round(x + 0.5, 2))
        (folder / f"{number:04}.scenario.yaml").write_text(text)
        faults[f"{number:04}"] = fault
    return faults


def run_batch(folder: Path) -> tuple[dict[str, str], Path, float]:
    """Run all scenarios; return the outcome or kind of error of each, the output folder, and the duration in s."""
    start = time.monotonic()
    command = [sys.executable, "-c", SIMSCEN, "run", str(folder), "--out", str(folder / "out"), "-j", "2"]
    done = subprocess.run([*command, "--wall-limit", "20"], capture_output=True, text=True, check=False)
    seconds = time.monotonic() - start
    runs = json.loads((folder / "out/results.json").read_text())["runs"]
    cases = [case for suite in JUnitXml.fromfile(str(folder / "out/junit.xml")) for case in suite]
    outcomes = {run["scenario"]: run["error"]["kind"] if run["error"] else run["outcome"] for run in runs}
    assert len(runs) == len(cases) == len(outcomes), "a run has two results, or is in one report only"
    assert done.returncode == (3 if set(outcomes.values()) - {"passed", "failed"} else 0), done.stderr
    return outcomes, folder / "out", seconds


def files(out: Path) -> dict[str, tuple[bytes, bytes]]:
    """Return the log and result of each run with a log, by scenario."""
    return {
        log.parent.parent.name: (log.read_bytes(), (log.parent / "result.json").read_bytes())
        for log in out.rglob("run.mcap")
    }


def remaining_processes() -> list[str]:
    """Return the command lines of processes of this campaign that still run."""
    found = []
    for path in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            words = path.read_bytes().split(b"\0")
        except OSError:
            continue
        if b"61.5" in words or str(SCRIPTED_FORK_SERVER).encode() in words:
            found.append(b" ".join(words).decode())
    return found


def main() -> int:
    """Run the batch, then only its runs without a fault, compare both, and print the numbers."""
    runs, seed = (int(word) for word in (*sys.argv[1:], *("500", "1")[len(sys.argv) - 1 :]))
    rng = random.Random(seed)
    with tempfile.TemporaryDirectory() as name:
        faults = write_scenarios(Path(name) / "batch", runs, rng)
        outcomes, out, seconds = run_batch(Path(name) / "batch")
        clean = Path(name) / "clean"
        clean.mkdir()
        fault_free = sorted(scenario for scenario, fault in faults.items() if not fault)
        for scenario in fault_free:
            (clean / f"{scenario}.scenario.yaml").write_bytes((out.parent / f"{scenario}.scenario.yaml").read_bytes())
        clean_outcomes, clean_out, _ = run_batch(clean)
        with_faults, reference = files(out), files(clean_out)
    expected = {scenario: FAULTS.get(fault, "passed") for scenario, fault in faults.items()}
    wrong = {scenario: (faults[scenario], found) for scenario, found in outcomes.items() if found != expected[scenario]}
    differing = [scenario for scenario in fault_free if with_faults.get(scenario) != reference.get(scenario)]
    missing, orphans = sorted(faults.keys() - outcomes.keys()), remaining_processes()
    passes = [scenario for scenario, found in outcomes.items() if found == "passed" and expected[scenario] != "passed"]
    print(f"{len(outcomes)} of {runs} runs have one result, in {seconds:.0f} s at -j2 (seed {seed})")
    print(
        "faults:", ", ".join(f"{count} {fault}" for fault, count in sorted(Counter(faults.values()).items()) if fault)
    )
    print(f"wrong passes: {len(passes)}, unexpected results: {wrong or 0}, missing: {missing or 0}")
    print(f"fault-free: {len(fault_free)}, not as in clean batch: {differing or 0}; clean batch: {len(clean_outcomes)}")
    print(f"processes left behind: {orphans or 0}")
    return int(bool(wrong or differing or missing or orphans or passes or set(clean_outcomes.values()) != {"passed"}))


if __name__ == "__main__":
    sys.exit(main())
