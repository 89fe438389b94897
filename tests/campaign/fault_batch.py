"""A batch of runs a tenth of which go wrong: `python tests/campaign/fault_batch.py [RUNS] [SEED]`, or `make campaign`.

Every run must be answered once and as what it is, nothing may be left behind, and the innocent runs must have the bytes
that they have in a batch without faults. Exit code 1 when any of that does not hold.
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
simscen.cli.session.backends.FORK_SERVER = ({str(SCRIPTED_FORK_SERVER)!r},)
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
    "flood": "passed",  # what a run prints is no verdict on the robot
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


def write(folder: Path, runs: int, rng: random.Random) -> dict[str, str]:
    """Scenarios, and for each the fault that it has; "" = none."""
    folder.mkdir()
    faults: dict[str, str] = {}
    for number in range(runs):
        fault = rng.choice(sorted(FAULTS)) if rng.random() < 0.1 else ""
        when = ".at.0" if fault and "prepare" not in fault and rng.random() < 0.5 else ""
        x = round(rng.uniform(0.8, 1.5), 2)
        text = SCENARIO.format(seed=number + 1, tag=fault + when or "innocent", x=x, goal=round(x + 0.5, 2))
        (folder / f"{number:04}.scenario.yaml").write_text(text)
        faults[f"{number:04}"] = fault
    return faults


def batch(folder: Path) -> tuple[dict[str, str], Path, float]:
    """Run all: how each came out, or the kind of its error; the output folder; seconds."""
    begun = time.monotonic()
    command = [sys.executable, "-c", SIMSCEN, "run", str(folder), "--out", str(folder / "out"), "-j", "2"]
    done = subprocess.run([*command, "--wall-limit", "20"], capture_output=True, text=True, check=False)
    seconds = time.monotonic() - begun
    runs = json.loads((folder / "out/results.json").read_text())["runs"]
    cases = [case for suite in JUnitXml.fromfile(str(folder / "out/junit.xml")) for case in suite]
    came_out = {run["scenario"]: run["error"]["kind"] if run["error"] else run["outcome"] for run in runs}
    assert len(runs) == len(cases) == len(came_out), "a run was answered twice, or in one report only"
    assert done.returncode == (3 if set(came_out.values()) - {"passed", "failed"} else 0), done.stderr
    return came_out, folder / "out", seconds


def files(out: Path) -> dict[str, tuple[bytes, bytes]]:
    """Log and result of each run that has them, by scenario."""
    return {
        log.parent.parent.name: (log.read_bytes(), (log.parent / "result.json").read_bytes())
        for log in out.rglob("run.mcap")
    }


def left_behind() -> list[str]:
    """Processes of this campaign that still run."""
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
    """Run the batch, then its innocent part alone, compare, and print the figures."""
    runs, seed = (int(word) for word in (*sys.argv[1:], *("500", "1")[len(sys.argv) - 1 :]))
    rng = random.Random(seed)
    with tempfile.TemporaryDirectory() as name:
        faults = write(Path(name) / "batch", runs, rng)
        came_out, out, seconds = batch(Path(name) / "batch")
        clean = Path(name) / "clean"
        clean.mkdir()
        innocent = sorted(scenario for scenario, fault in faults.items() if not fault)
        for scenario in innocent:
            (clean / f"{scenario}.scenario.yaml").write_bytes((out.parent / f"{scenario}.scenario.yaml").read_bytes())
        alone, clean_out, _ = batch(clean)
        dirty, reference = files(out), files(clean_out)
    expected = {scenario: FAULTS.get(fault, "passed") for scenario, fault in faults.items()}
    wrong = {scenario: (faults[scenario], found) for scenario, found in came_out.items() if found != expected[scenario]}
    other = [scenario for scenario in innocent if dirty.get(scenario) != reference.get(scenario)]
    missing, orphans = sorted(faults.keys() - came_out.keys()), left_behind()
    passes = [scenario for scenario, found in came_out.items() if found == "passed" and expected[scenario] != "passed"]
    print(f"{len(came_out)} of {runs} runs answered once, in {seconds:.0f} s at -j2 (seed {seed})")
    print(
        "faults:", ", ".join(f"{count} {fault}" for fault, count in sorted(Counter(faults.values()).items()) if fault)
    )
    print(f"wrong passes: {len(passes)}, other answers than due: {wrong or 0}, missing: {missing or 0}")
    print(f"innocent: {len(innocent)}, of which other bytes than alone: {other or 0}; passed alone: {len(alone)}")
    print(f"processes left behind: {orphans or 0}")
    return int(bool(wrong or other or missing or orphans or passes or set(alone.values()) != {"passed"}))


if __name__ == "__main__":
    sys.exit(main())
