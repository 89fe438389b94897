"""Signal handling of a session: the first SIGINT, SIGTERM, or SIGHUP stops it cleanly, a second one kills it."""

import os
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

from simscen.run.process.supervisor import Interrupted

REPEATED_SIGNAL_S = 0.5
"""Signals within this time count as one: wrappers forward a signal that the process has already received."""
SHOW_CURSOR = b"\x1b[?25h"


@contextmanager
def signals_interrupt(clock: Callable[[], float] = time.monotonic) -> Iterator[None]:
    """Raise Interrupted on the first signal, so that reports are written; exit at once on a later one.

    Worker processes end with this process. The journal is complete at any time, so `simscen report` can still write the
    reports. A SIGHUP that is ignored, as under nohup, stays ignored.
    """
    first: list[float] = []

    def interrupt(number: int, _: FrameType | None) -> None:
        if not first:
            first.append(clock())
            raise Interrupted(number)
        if clock() - first[0] > REPEATED_SIGNAL_S:
            exit_at_once(number)

    handled = [signal.SIGINT, signal.SIGTERM]
    if signal.getsignal(signal.SIGHUP) is not signal.SIG_IGN:
        handled.append(signal.SIGHUP)
    previous = {number: signal.getsignal(number) for number in handled}
    for number in handled:
        signal.signal(number, interrupt)
    try:
        yield
    finally:
        if not first:
            for number, handler in previous.items():
                signal.signal(number, handler)


def exit_at_once(number: int) -> None:
    """Restore the cursor and exit with the exit code of the signal, without waiting for anything."""
    if os.isatty(1):
        os.write(1, SHOW_CURSOR + b"\n")
    os.write(2, b"simscen: stopped without reports; run `simscen report` to write them from the journal\n")
    os._exit(128 + number)
