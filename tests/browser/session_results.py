"""Invented results of sessions: passed, failed, and crashed runs, with names that contain HTML."""

from dataclasses import replace
from pathlib import Path

from PIL import Image

from simscen.core.records.disturbances import Disturbance, DisturbanceOutcome
from simscen.core.records.run_result import Outcome, RunFailure, RunKey, RunResult
from simscen.core.records.session_events import Artifacts, RunFinished
from simscen.core.records.verdict import Finding, Status, Verdict
from simscen.report.session_history import PastOutcome, PastSession

MARKUP = "\"'><script>document.title='owned'</script><img src=x onerror=alert(1)>"


def finished_run(
    scenario: str, seed: int = 1, margin: float = 0.5, seconds: float = 20.0, **details: object
) -> RunFinished:
    """Return a run with a path length of (1 - margin) 10 m and a limit of 10 m; it failed if `margin` is negative."""
    length = 10 - 10 * margin
    status = Status.PASS if margin >= 0 else Status.FAIL
    finding = Finding(
        status, "path_length", f"{length:.2f} m", "≤ 10.00 m", 10 * margin, "m", length, 2400, (1.0, 2.0),
        ("why: a pallet stood in the way",) if margin < 0 else (),
    )  # fmt: skip
    disturbance = DisturbanceOutcome(
        Disturbance("pallet falls", "event", "time: 3 s"), (720,), True, "spawned pallet", 720
    )
    result = RunResult(
        RunKey(scenario, seed, str(details.get("variation", "")), str(details.get("stack", ""))),
        f"{scenario}.scenario.yaml",
        Outcome.PASSED if margin >= 0 else Outcome.FAILED,
        (Verdict("path_length", "path_length", "fail", (finding,)),),
        (12,),
        {"path_length": length},
        disturbances=(disturbance,),
        ended="navigation ended",
        simulated=seconds,
    )
    tags = details.get("tags", ())
    assert isinstance(tags, tuple)
    return RunFinished(result, 0.5, again=f"simscen run {scenario}.scenario.yaml --seed {seed}", tags=tags)


def crashed_run(scenario: str) -> RunFinished:
    """Return a crashed run, with escape sequences and HTML in its output."""
    error = RunFailure("crashed", f"crashed: SIGSEGV {MARKUP}", f"{MARKUP}\n\x1b[31mSegmentation fault")
    result = RunResult(RunKey(scenario, 1), f"{scenario}.scenario.yaml", Outcome.ERROR, error=error)
    return RunFinished(result, 1.0, again=MARKUP)


def session_runs(folder: Path) -> list[RunFinished]:
    """Return eight runs, of which the first failed one has a picture and a replay page."""
    run_folder = folder / "runs/doors/shuts/seed-1"
    run_folder.mkdir(parents=True)
    Image.new("RGB", (300, 200), (226, 223, 216)).save(run_folder / "map.png")
    (run_folder / "replay.html").write_text("<!doctype html><title>replay</title>")
    artifacts = Artifacts(str(run_folder), "", str(run_folder / "map.png"), "", str(run_folder / "replay.html"))
    return [
        replace(
            finished_run("scenarios/doors/shuts", margin=-0.2, seconds=31.0, tags=("door", "smoke")),
            artifacts=artifacts,
        ),
        finished_run("scenarios/doors/opens", margin=0.02, seconds=12.0, tags=("door",)),
        crashed_run(f"scenarios/evil/{MARKUP}"),
        *(finished_run("scenarios/speeds", seed, 0.3, 15.0 + seed, variation="fast") for seed in (1, 2, 3)),
        finished_run("scenarios/speeds", 4, -0.1, 40.0, variation="slow"),
        finished_run("scenarios/zones/ward", margin=0.9, seconds=8.0, tags=("zones", MARKUP)),
    ]


def past_sessions(runs: list[RunFinished]) -> list[PastSession]:
    """Return two earlier sessions in which all runs passed."""
    outcomes = {finished.key: PastOutcome(Outcome.PASSED, finished.result.simulated * 0.9) for finished in runs}
    return [PastSession("20260102T000000Z-beef", outcomes), PastSession(f"20260101T000000Z-{MARKUP}", outcomes)]
