"""Reporters for terminals, based on rich: one with color, and one with color and live progress."""

from collections.abc import Callable
from pathlib import Path
from time import monotonic
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
from simscen.report.display_text import StyledLine, TerminalStyle, escape_ci_commands, plain_text
from simscen.report.reporters import PlainReporter, Reporter
from simscen.report.session_formatter import SessionFormatter

MIN_FINISHED_RUNS = 2
"""Minimum number of finished runs for an estimate of the remaining time."""


class ProgressEstimate:
    """Estimates the remaining time of a session from its events. `clock` returns seconds of wall time.

    Results that are reused from an earlier session do not count in the mean time per run.
    """

    def __init__(self, clock: Callable[[], float]) -> None:
        self._clock = clock
        self._start: float | None = None
        self._started: set[object] = set()
        self._total, self._finished, self._executed = 0, 0, 0

    def __call__(self, event: SessionEvent) -> None:
        """Count the run that started or finished in this event."""
        match event:
            case SessionStarted():
                self._total = event.total
            case RunStarted():
                self._start = self._clock() if self._start is None else self._start
                self._started.add(event.key)
            case RunFinished():
                self._finished += 1
                self._executed += event.key in self._started
            case _:
                pass

    @property
    def text(self) -> str:
        """Progress, for example "12 of 88, about 40 s left"; "" for a single run."""
        if self._total < 2:
            return ""
        seconds = self.remaining_s
        estimate = "" if seconds is None else f", about {_round_duration(seconds)} left"
        return f"{self._finished} of {self._total}{estimate}"

    @property
    def remaining_s(self) -> float | None:
        """Estimated remaining wall time in s; None before MIN_FINISHED_RUNS runs have finished."""
        if self._start is None or self._executed < MIN_FINISHED_RUNS:
            return None
        return (self._clock() - self._start) / self._executed * (self._total - self._finished)


def _round_duration(seconds: float) -> str:
    """Return a duration as text, rounded to 5 s, 1 min, or 0.1 h, depending on its length."""
    if seconds < 90:
        return f"{max(5, 5 * round(seconds / 5))} s"
    minutes = round(seconds / 60)
    return f"{minutes} min" if minutes < 90 else f"{seconds / 3600:.1f} h"


STYLES = {"plain": "", "name": "bold", "good": "green", "bad": "red", "warning": "yellow", "quiet": "dim"}
"""Style of each role of a text, in the syntax of rich."""


class ColorReporter(PlainReporter):
    """Prints the lines of PlainReporter in color.

    Lines that a CI system could read as a command are escaped and have no color.
    """

    def __init__(self, out: TextIO, style: TerminalStyle, slow: int | None = None) -> None:
        super().__init__(out, style, slow)
        self._console = _console(out, style)

    def _print(self, line: StyledLine) -> None:
        if plain_text(line) != escape_ci_commands(plain_text(line)):
            super()._print(line)
        else:
            self._console.print(_rich_text(line))


class LiveReporter(Reporter):
    """Prints lines in color. Below these lines, one line for each current run is updated in place.

    `slow` is the number of slowest runs to list at the end (0: all runs, None: no list).
    """

    def __init__(self, out: TextIO, style: TerminalStyle, slow: int | None = None) -> None:
        self._console = _console(out, style)
        self._live = Live(console=self._console, refresh_per_second=8, transient=True)
        self._formatter = SessionFormatter(slow, lambda: style.columns)
        self._estimate = ProgressEstimate(monotonic)
        self._running: dict[RunKey, tuple[RunStarted, float]] = {}  # start event and simulated time in s

    def __enter__(self) -> "LiveReporter":
        self._live.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._live.stop()

    def __call__(self, event: SessionEvent) -> None:
        """Print the lines for an event, and update the lines of the current runs."""
        self._estimate(event)
        match event:
            case RunStarted():
                self._running[event.key] = (event, 0.0)
            case RunProgress() if event.key in self._running:
                self._running[event.key] = (self._running[event.key][0], event.simulated)
            case RunFinished():
                self._running.pop(event.key, None)
            case _:
                pass
        rows = [self._row(*state) for _, state in sorted(self._running.items())]
        progress = self._estimate.text
        self._live.update(Group(*rows, *([Text(f"  {progress}", style="dim")] if progress and rows else [])))
        if isinstance(event, SessionFinished):
            self._live.stop()
        for line in self._formatter(event):
            self._console.print(_rich_text(line, links=True))

    def _row(self, started: RunStarted, simulated: float) -> Text:
        """Return the line of a current run with its simulated time in s."""
        name = self._formatter.naming.name(started.key)
        limit = f" of at most {started.time_limit:.0f} s" if started.time_limit else ""
        row = [("  … ", "cyan"), (f"{name} ", ""), (f"{simulated:6.1f} s{limit}", "dim")]
        return Text.assemble(*row, no_wrap=True, overflow="ellipsis")


def _console(out: TextIO, style: TerminalStyle) -> Console:
    """Return a rich console that follows `style` instead of detecting the terminal."""
    return Console(
        file=out,
        force_terminal=True,
        color_system="standard" if style.has_color else None,
        no_color=not style.has_color,
        highlight=False,
        soft_wrap=True,
        emoji=False,
        markup=False,
    )


def _rich_text(line: StyledLine, links: bool = False) -> Text:
    """Convert a line to rich.Text without interpreting markup in it. With `links`, the text links to files (OSC 8)."""
    text = Text()
    for part in line:
        style = Style.parse(STYLES[part.role])
        text.append(
            part.text, style + Style(link=Path(part.file).absolute().as_uri()) if links and part.file else style
        )
    return text
