"""The console on a terminal: lines in colour, and live progress below them."""

from types import TracebackType
from typing import TextIO

from rich.console import Console, Group
from rich.live import Live
from rich.text import Text

from simscen.core.result import RunKey
from simscen.core.sessionevents import (
    RunFinished,
    RunProgress,
    RunStarted,
    SessionEvent,
    SessionFinished,
    SessionStarted,
)
from simscen.report.line import Line
from simscen.report.lines import Naming, lines_of
from simscen.report.text import one_line

STYLES = {"plain": "", "name": "bold", "good": "green", "bad": "red", "odd": "yellow", "quiet": "dim"}


class LiveReporter:
    """The same lines in colour, and below them one line for each run under way with its simulated time."""

    def __init__(self, out: TextIO) -> None:
        self._console = Console(file=out, highlight=False, soft_wrap=True, emoji=False, markup=False)
        self._live = Live(console=self._console, refresh_per_second=8, transient=True)
        self._under_way: dict[RunKey, tuple[RunStarted, float, str]] = {}
        self._done, self._total = 0, 0
        self._naming = Naming()

    def __enter__(self) -> "LiveReporter":
        self._live.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._live.stop()

    def __call__(self, event: SessionEvent) -> None:
        """Print what is final above, show what is under way below."""
        match event:
            case SessionStarted():
                self._naming = Naming.of(event, self._console.width)
                self._total = event.total
            case RunStarted():
                self._under_way[event.key] = (event, 0.0, "")
            case RunProgress() if event.key in self._under_way:
                self._under_way[event.key] = (self._under_way[event.key][0], event.simulated, event.note)
            case RunFinished():
                self._under_way.pop(event.key, None)
                self._done += 1
            case _:
                pass
        self._live.update(self._status())
        if isinstance(event, SessionFinished):
            self._live.stop()
        for line in lines_of(event, self._naming):
            self._console.print(_styled(line))

    def _status(self) -> Group:
        rows = [self._row(*state) for _, state in sorted(self._under_way.items())]
        counter = [Text(f"  {self._done} of {self._total}", style="dim")] if self._total > 1 and rows else []
        return Group(*rows, *counter)

    def _row(self, started: RunStarted, simulated: float, note: str) -> Text:
        name = self._naming.name(started.key)
        limit = f" of at most {started.time_limit:.0f} s" if started.time_limit else ""
        return Text.assemble(
            ("  … ", "cyan"), (f"{name} ", ""), (f"{simulated:6.1f} s{limit}  {one_line(note)}", "dim")
        )


def _styled(line: Line) -> Text:
    """As rich.Text: what users wrote is never read as markup."""
    return Text.assemble(*((piece.text, STYLES[piece.role]) for piece in line))
