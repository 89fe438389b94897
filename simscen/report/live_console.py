"""How far a session is, and how long it will go on."""

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
    SessionStarted,
)
from simscen.report.display_text import escape_ci_commands, one_line
from simscen.report.styled_line import StyledLine, TerminalStyle, plain_text
from simscen.report.text_reporters import PlainReporter, SessionFormatter

MIN_FINISHED_RUNS = 2
"""Runs that must have ended before what they took says anything of the others."""


class ProgressEstimate:
    """Listens to a session. `clock` is in seconds; what was kept from an earlier session took none of them."""

    def __init__(self, clock: Callable[[], float]) -> None:
        self._clock = clock
        self._begun: float | None = None
        self._started: set[object] = set()
        self._total, self._done, self._run = 0, 0, 0

    def __call__(self, event: SessionEvent) -> None:
        """Take one event."""
        match event:
            case SessionStarted():
                self._total = event.total
            case RunStarted():
                self._begun = self._clock() if self._begun is None else self._begun
                self._started.add(event.key)
            case RunFinished():
                self._done += 1
                self._run += event.key in self._started
            case _:
                pass

    @property
    def told(self) -> str:
        """12 of 88, about 40 s left; "" for a single run."""
        if self._total < 2:
            return ""
        seconds = self.seconds
        return f"{self._done} of {self._total}" + (
            "" if seconds is None else f", about {_round_duration(seconds)} left"
        )

    @property
    def seconds(self) -> float | None:
        """How long the rest takes if it goes on like this; None = too early to say."""
        if self._begun is None or self._run < MIN_FINISHED_RUNS:
            return None
        return (self._clock() - self._begun) / self._run * (self._total - self._done)


def _round_duration(seconds: float) -> str:
    """In steps that do not flicker."""
    if seconds < 90:
        return f"{max(5, 5 * round(seconds / 5))} s"
    minutes = round(seconds / 60)
    return f"{minutes} min" if minutes < 90 else f"{seconds / 3600:.1f} h"


STYLES = {"plain": "", "name": "bold", "good": "green", "bad": "red", "odd": "yellow", "quiet": "dim"}


class ColorReporter(PlainReporter):
    """The same lines in color, for CI systems that show it. What one of them might obey stays without."""

    def __init__(self, out: TextIO, look: TerminalStyle, slow: int | None = None) -> None:
        super().__init__(out, look, slow)
        self._console = _console(out, look)

    def _print(self, line: StyledLine) -> None:
        if plain_text(line) != escape_ci_commands(plain_text(line)):
            super()._print(line)
        else:
            self._console.print(_rich_text(line))


class LiveReporter:
    """The same lines, and below them one line for each run under way with its simulated time."""

    def __init__(
        self, out: TextIO, look: TerminalStyle, slow: int | None = None, clock: Callable[[], float] = monotonic
    ) -> None:
        self._console = _console(out, look)
        self._live = Live(console=self._console, refresh_per_second=8, transient=True)
        self._telling = SessionFormatter(slow, lambda: look.columns)
        self._remaining = ProgressEstimate(clock)
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
            self._console.print(_rich_text(line, links=True))

    def _status(self) -> Group:
        rows = [self._row(*state) for _, state in sorted(self._under_way.items())]
        told = self._remaining.told
        return Group(*rows, *([Text(f"  {told}", style="dim")] if told and rows else []))

    def _row(self, started: RunStarted, simulated: float, note: str) -> Text:
        name = self._telling.naming.name(started.key)
        limit = f" of at most {started.time_limit:.0f} s" if started.time_limit else ""
        row = [("  … ", "cyan"), (f"{name} ", ""), (f"{simulated:6.1f} s{limit}  {one_line(note)}", "dim")]
        return Text.assemble(*row, no_wrap=True, overflow="ellipsis")


def _console(out: TextIO, look: TerminalStyle) -> Console:
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


def _rich_text(line: StyledLine, links: bool = False) -> Text:
    """As rich.Text: what users wrote is never read as markup."""
    return Text.assemble(*((piece.text, _style(STYLES[piece.role], piece.file if links else "")) for piece in line))


def _style(look: str, file: str) -> Style:
    """A path can be clicked in terminals that know OSC 8; others show the text alone."""
    return Style.parse(look) + Style(link=Path(file).absolute().as_uri()) if file else Style.parse(look)
