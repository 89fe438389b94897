"""SIGINT and SIGTERM end a session in good order."""

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

from simscen.run.supervisor import Interrupted


@contextmanager
def signals_interrupt() -> Iterator[None]:
    """Raise Interrupted for the first SIGINT or SIGTERM; more of them change nothing, so that reports are written."""

    def interrupt(number: int, _: FrameType | None) -> None:
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
        raise Interrupted(number)

    before = {number: signal.signal(number, interrupt) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        if signal.getsignal(signal.SIGINT) is interrupt:
            for number, handler in before.items():
                signal.signal(number, handler)
