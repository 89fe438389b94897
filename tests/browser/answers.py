"""Invented results of a session: passed, failed, and crashed runs, with names that contain HTML."""

from dataclasses import replace
from pathlib import Path

from PIL import Image

from simscen.core.records.disturbances import Disturbance, DisturbanceOutcome
from simscen.core.records.run_result import Outcome, RunFailure, RunKey, RunResult
from simscen.core.records.session_events import Artifacts, RunFinished
from simscen.core.records.verdict import Finding, Status, Verdict
from simscen.report.session_history import PastOutcome, PastSession

EVIL = "\"'><script>document.title='owned'</script><img src=x onerror=alert(1)>"


def run(scenario: str, seed: int = 1, left: float = 0.5, seconds: float = 20.0, **more: object) -> RunFinished:
    """Return a run with the relative margin `left` to a limit of 10 m; it failed if `left` is negative."""
    status = Status.PASS if left >= 0 else Status.FAIL
    finding = Finding(
        status, "path_length", f"{10 - 10 * left:.2f} m", "≤ 10.00 m", 10 * left, "m", 10 - 10 * left, 2400, (1.0, 2.0),
        ("why: a pallet stood in the way",) if left < 0 else (),
    )  # fmt: skip
    fell = DisturbanceOutcome(Disturbance("pallet falls", "event", "time: 3 s"), (720,), True, "spawned pallet", 720)
    result = RunResult(
        RunKey(scenario, seed, str(more.get("variation", "")), str(more.get("stack", ""))),
        f"{scenario}.scenario.yaml",
        Outcome.PASSED if left >= 0 else Outcome.FAILED,
        (Verdict("path_length", "path_length", "fail", (finding,)),),
        (12,),
        {"path_length": 10 - 10 * left},
        disturbances=(fell,),
        ended="navigation ended",
        simulated=seconds,
    )
    tags = more.get("tags", ())
    assert isinstance(tags, tuple)
    return RunFinished(result, 0.5, again=f"simscen run {scenario}.scenario.yaml --seed {seed}", tags=tags)


def crashed(scenario: str) -> RunFinished:
    """Return a crashed run, with escape sequences and HTML in its output."""
    error = RunFailure("crashed", f"crashed: SIGSEGV {EVIL}", f"{EVIL}\n\x1b[31mSegmentation fault")
    result = RunResult(RunKey(scenario, 1), f"{scenario}.scenario.yaml", Outcome.ERROR, error=error)
    return RunFinished(result, 1.0, again=EVIL)


def session(folder: Path) -> list[RunFinished]:
    """Return eight runs, of which the first failed one has a picture and a replay page."""
    run_folder = folder / "runs/doors/shuts/seed-1"
    run_folder.mkdir(parents=True)
    Image.new("RGB", (300, 200), (226, 223, 216)).save(run_folder / "map.png")
    (run_folder / "replay.html").write_text("<!doctype html><title>replay</title>")
    files = Artifacts(str(run_folder), "", str(run_folder / "map.png"), "", str(run_folder / "replay.html"))
    return [
        replace(run("scenarios/doors/shuts", left=-0.2, seconds=31.0, tags=("door", "smoke")), artifacts=files),
        run("scenarios/doors/opens", left=0.02, seconds=12.0, tags=("door",)),
        crashed(f"scenarios/evil/{EVIL}"),
        *(run("scenarios/speeds", seed, 0.3, 15.0 + seed, variation="fast") for seed in (1, 2, 3)),
        run("scenarios/speeds", 4, -0.1, 40.0, variation="slow"),
        run("scenarios/zones/ward", left=0.9, seconds=8.0, tags=("zones", EVIL)),
    ]


def past(answers: list[RunFinished]) -> list[PastSession]:
    """Return two earlier sessions in which all runs passed."""
    before = {answer.key: PastOutcome(Outcome.PASSED, answer.result.simulated * 0.9) for answer in answers}
    return [PastSession("20260102T000000Z-beef", before), PastSession(f"20260101T000000Z-{EVIL}", before)]
