"""The console: plain lines when piped, colours and live progress on a terminal."""

import os
from collections.abc import Mapping
from types import TracebackType
from typing import Protocol, TextIO

from simscen.core.sessionevents import SessionEvent
from simscen.report.line import Line, text_of
from simscen.report.look import Look, can_encode, look_of
from simscen.report.telling import Telling
from simscen.report.text import ascii_only, no_command


class Reporter(Protocol):
    """Listens to a session; a context, so that a terminal is left as it was whatever happens."""

    def __call__(self, event: SessionEvent) -> None:
        """Take one event."""
        ...

    def __enter__(self) -> "Reporter":
        """Begin."""
        ...

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Leave the terminal as it was."""
        ...


def text_reporter(
    out: TextIO, live: bool | None = None, slow: int | None = None, environ: Mapping[str, str] = os.environ
) -> Reporter:
    """For people: live on a terminal, plain lines elsewhere, in colour where that is wanted.

    `live` overrides what `out` says it is. `slow` is how many of the slowest runs to list in the end; 0 = all.
    """
    look = look_of(out, environ)
    if live is not None:
        look = Look(live or look.colour, live, look.terminal)
    if not look.live and not look.colour:
        return PlainReporter(out, look, slow)
    from simscen.report.live import ColourReporter, LiveReporter  # rich, which lists and pipes need not wait for

    return LiveReporter(out, look, slow) if look.live else ColourReporter(out, look, slow)


class PlainReporter:
    """Each line as it happens: no colour, no cursor movement, ASCII where the stream knows no more."""

    def __init__(self, out: TextIO, look: Look, slow: int | None = None) -> None:
        self._out = out
        self._telling = Telling(slow, lambda: look.columns)
        self._ascii = not can_encode(out)

    def __enter__(self) -> "PlainReporter":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._out.flush()

    def __call__(self, event: SessionEvent) -> None:
        """Print what the event is worth."""
        for line in self._telling(event):
            self._print(line)
        self._out.flush()

    def _print(self, line: Line) -> None:
        text = no_command(text_of(line))
        self._out.write(f"{ascii_only(text) if self._ascii else text}\n")
