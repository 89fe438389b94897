"""What prints a session is, and the plainest of those that do."""

from types import TracebackType
from typing import Protocol, TextIO

from simscen.core.records.session_events import SessionEvent
from simscen.report.line import Line, text_of
from simscen.report.look import Look, can_encode
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


class PlainReporter:
    """Each line as it happens: no color, no cursor movement, ASCII where the stream knows no more."""

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
