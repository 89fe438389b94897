"""The console: plain lines when piped, colours and live progress on a terminal."""

from types import TracebackType
from typing import Protocol, TextIO

from simscen.core.sessionevents import SessionEvent, SessionStarted
from simscen.report.lines import Naming, lines_of, text_of
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


def text_reporter(out: TextIO, live: bool | None = None) -> Reporter:
    """For people: live on a terminal, plain lines elsewhere. `live` overrides what `out` says it is."""
    if not (out.isatty() and _can_encode(out) if live is None else live):
        return _Plain(out)
    from simscen.report.live import LiveReporter  # rich, which lists and pipes need not wait for

    return LiveReporter(out)


class _Plain:
    """Each line as it happens: no colour, no cursor movement, ASCII where the stream knows no more."""

    def __init__(self, out: TextIO) -> None:
        self._out, self._naming = out, Naming()
        self._ascii = not _can_encode(out)

    def __enter__(self) -> "_Plain":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._out.flush()

    def __call__(self, event: SessionEvent) -> None:
        """Print what the event is worth."""
        if isinstance(event, SessionStarted):
            self._naming = Naming.of(event)
        for line in lines_of(event, self._naming):
            text = no_command(text_of(line))
            self._out.write(f"{ascii_only(text) if self._ascii else text}\n")
        self._out.flush()


def _can_encode(out: TextIO) -> bool:
    try:
        "✓✗·≤≥°".encode(getattr(out, "encoding", None) or "ascii")
    except (UnicodeEncodeError, LookupError):
        return False
    return True
