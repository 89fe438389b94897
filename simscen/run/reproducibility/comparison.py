"""Compare a run with the same run of an earlier session, possibly from another machine."""

from dataclasses import replace
from pathlib import Path

from simscen.core.errors import InvalidInput
from simscen.core.records.run_result import Outcome, RunFailure, RunResult
from simscen.core.records.session_events import RunFinished
from simscen.judge.result_json import from_json
from simscen.run.sessions.output_folder import run_folder


def compare_with_session(run: RunFinished, earlier: Path) -> RunFinished:
    """Return the run, or an error if it differs from the same run of the session in the folder `earlier`.

    Logs that are equal byte for byte agree. Other logs agree if verdicts and trajectories do (see record.agreement),
    because the last bits differ between machines. A run that is missing in the earlier session is an error.
    """
    if run.result.outcome is Outcome.ERROR or not run.artifacts.mcap:
        return run
    there = _folder(run, earlier) / "run.mcap"
    try:
        if there.read_bytes() == Path(run.artifacts.mcap).read_bytes():
            return run
        why = _disagreement(Path(run.artifacts.mcap), there)
    except OSError as error:
        why = f"{there}: {error.strerror}"
    except InvalidInput as error:
        why = str(error)
    if why is None:
        return run
    failure = RunFailure("nondeterministic", f"not as in {earlier}: {why}")
    return replace(run, result=replace(run.result, outcome=Outcome.ERROR, error=failure))


def _folder(run: RunFinished, earlier: Path) -> Path:
    """Return the folder of the run in the earlier session, which may have used several stacks."""
    stack = run.result.stack.partition("=")[0]
    labeled = run_folder(earlier, replace(run.key.first, stack_name=stack))
    return labeled if not run.key.first.stack_name and labeled.is_dir() else run_folder(earlier, run.key.first)


def _disagreement(here: Path, there: Path) -> str | None:
    """Describe the first difference of two logs, or return None. Raises InvalidInput for an unreadable log."""
    from simscen.record.agreement import first_disagreement
    from simscen.record.replay import read_log

    now, then = read_log(here), read_log(there)
    if not then.result or not now.result:
        return f"{there}: the run broke off"
    said, was = (_statuses(from_json(log.result)) for log in (now, then))
    changed = [name for name in {**was, **said} if said.get(name) != was.get(name)]
    told = [f"{name}: {said.get(name, 'absent')} instead of {was.get(name, 'absent')}" for name in changed]
    pairs = zip(now.traces, then.traces, strict=False)
    return "; ".join(told) or next((parts for pair in pairs if (parts := first_disagreement(*pair))), None)


def _statuses(result: RunResult) -> dict[str, str]:
    return {verdict.id: verdict.status.value for verdict in result.verdicts}
