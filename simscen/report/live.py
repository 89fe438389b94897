"""The console in color, and on a terminal with live progress below the lines."""

from collections.abc import Callable
from pathlib import Path
from time import monotonic
from types import TracebackType
from typing import TextIO

from rich.console import Console, Group
from rich.live import Live
from rich.style import Style
from rich.text import Text

from simscen.core.records.run_result import RunKey
from simscen.core.records.session_events import (
    RunFinished,
    RunProgress,
    RunStarted,
    SessionEvent,
    SessionFinished,
)
from simscen.report.line import Line, text_of
from simscen.report.look import Look
from simscen.report.plain import PlainReporter
from simscen.report.remaining import Remaining
from simscen.report.telling import Telling
from simscen.report.text import no_command, one_line

STYLES = {"plain": "", "name": "bold", "good": "green", "bad": "red", "odd": "yellow", "quiet": "dim"}


class ColorReporter(PlainReporter):
    """The same lines in color, for CI systems that show it. What one of them might obey stays without."""

    def __init__(self, out: TextIO, look: Look, slow: int | None = None) -> None:
        super().__init__(out, look, slow)
        self._console = _console(out, look)

    def _print(self, line: Line) -> None:
        if text_of(line) != no_command(text_of(line)):
            super()._print(line)
        else:
            self._console.print(_styled(line))


class LiveReporter:
    """The same lines, and below them one line for each run under way with its simulated time."""

    def __init__(
        self, out: TextIO, look: Look, slow: int | None = None, clock: Callable[[], float] = monotonic
    ) -> None:
        self._console = _console(out, look)
        self._live = Live(console=self._console, refresh_per_second=8, transient=True)
        self._telling = Telling(slow, lambda: look.columns)
        self._remaining = Remaining(clock)
        self._under_way: dict[RunKey, tuple[RunStarted, float, str]] = {}

    def __enter__(self) -> "LiveReporter":
        self._live.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._live.stop()

    def __call__(self, event: SessionEvent) -> None:
        """Print what is final above, show what is under way below."""
        self._remaining(event)
        match event:
            case RunStarted():
                self._under_way[event.key] = (event, 0.0, "")
            case RunProgress() if event.key in self._under_way:
                self._under_way[event.key] = (self._under_way[event.key][0], event.simulated, event.note)
            case RunFinished():
                self._under_way.pop(event.key, None)
            case _:
                pass
        self._live.update(self._status())
        if isinstance(event, SessionFinished):
            self._live.stop()
        for line in self._telling(event):
            self._console.print(_styled(line, links=True))

    def _status(self) -> Group:
        rows = [self._row(*state) for _, state in sorted(self._under_way.items())]
        told = self._remaining.told
        return Group(*rows, *([Text(f"  {told}", style="dim")] if told and rows else []))

    def _row(self, started: RunStarted, simulated: float, note: str) -> Text:
        name = self._telling.naming.name(started.key)
        limit = f" of at most {started.time_limit:.0f} s" if started.time_limit else ""
        row = [("  … ", "cyan"), (f"{name} ", ""), (f"{simulated:6.1f} s{limit}  {one_line(note)}", "dim")]
        return Text.assemble(*row, no_wrap=True, overflow="ellipsis")


def _console(out: TextIO, look: Look) -> Console:
    """One that decides nothing by itself: what the environment says is in the look."""
    return Console(
        file=out,
        force_terminal=True,
        color_system="standard" if look.color else None,
        no_color=not look.color,
        highlight=False,
        soft_wrap=True,
        emoji=False,
        markup=False,
    )


def _styled(line: Line, links: bool = False) -> Text:
    """As rich.Text: what users wrote is never read as markup."""
    return Text.assemble(*((piece.text, _style(STYLES[piece.role], piece.file if links else "")) for piece in line))


def _style(look: str, file: str) -> Style:
    """A path can be clicked in terminals that know OSC 8; others show the text alone."""
    return Style.parse(look) + Style(link=Path(file).absolute().as_uri()) if file else Style.parse(look)
