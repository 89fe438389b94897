"""What came of a run, whether it was simulated just now or read from its log."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from simscen.core.records.case import Case
from simscen.core.records.run_result import Outcome, RunResult
from simscen.core.records.trace import Trace
from simscen.core.records.verdict import Status, Verdict


@dataclass(frozen=True, eq=False, repr=False)
class Run:
    """A run: its `result` (outcome, verdicts, metrics), the `trace` it was judged from, the `case` it was judged by.

    `log` is the MCAP file that holds all of it; None when none was asked for. `stack` is what an external stack said of
    itself; empty for one in the engine. `robots` is what came of each of several robots by name, as if it had been the
    only one, e.g. `run.robots["left"].trace`; `trace`, `case` and `stack` are then those of the first.
    """

    result: RunResult
    trace: Trace
    case: Case
    log: Path | None = None
    stack: Mapping[str, Any] = field(default_factory=dict)
    robots: Mapping[str, "Run"] = field(default_factory=dict)

    def __repr__(self) -> str:
        """What it is and why it did not pass, so that `assert run.passed` says it."""
        broken = [(v.id, v.tightest) for v in self.result.verdicts if v.status is not Status.PASS]
        why = [f"{name} {finding.measured} ({finding.limit})" for name, finding in broken if finding is not None]
        told = f"<Run of {self.result.key.test}, seed {self.result.key.seed}: {self.result.outcome.value}"
        return f"{told}{''.join(f'; {each}' for each in why)}>"

    @property
    def passed(self) -> bool:
        """Whether everything held; a run that could not be completed never passed."""
        return self.result.outcome is Outcome.PASSED

    @property
    def as_expected(self) -> bool:
        """Whether it passed, or failed as its scenario says it does."""
        return self.result.outcome.good

    def verdict(self, name: str) -> Verdict:
        """The verdict of the criterion with this id, e.g. `run.verdict("path_length").status`. Raises KeyError."""
        found = {verdict.id: verdict for verdict in self.result.verdicts}
        if name not in found:
            raise KeyError(f"no criterion is called {name!r}; there are: {', '.join(found)}")
        return found[name]
