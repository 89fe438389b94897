"""SIGINT, SIGTERM and SIGHUP end a session in good order; whoever cannot wait for that ends it at once."""

import os
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

from simscen.run.process.supervisor import Interrupted

SAME_PRESS = 0.5
"""Seconds in which a second signal is the first one told twice: by a wrapper that passes it on, or by a fast finger."""
SHOW_CURSOR = b"\x1b[?25h"


@contextmanager
def signals_interrupt(clock: Callable[[], float] = time.monotonic) -> Iterator[None]:
    """Raise Interrupted for the first of these signals, so that reports are written; a later one ends the process.

    What the runs' processes do then is their parent's business: they end with it. The journal is whole, so that the
    reports can still be made. A SIGHUP that is ignored, as under nohup, stays so.
    """
    first: list[float] = []

    def interrupt(number: int, _: FrameType | None) -> None:
        if not first:
            first.append(clock())
            raise Interrupted(number)
        if clock() - first[0] > SAME_PRESS:
            end_at_once(number)

    heeded = [signal.SIGINT, signal.SIGTERM]
    if signal.getsignal(signal.SIGHUP) is not signal.SIG_IGN:
        heeded.append(signal.SIGHUP)
    before = {number: signal.getsignal(number) for number in heeded}
    for number in heeded:
        signal.signal(number, interrupt)
    try:
        yield
    finally:
        if not first:
            for number, handler in before.items():
                signal.signal(number, handler)


def end_at_once(number: int) -> None:
    """Leave with the exit code of the signal, and the terminal with its cursor; nothing is waited for."""
    if os.isatty(1):
        os.write(1, SHOW_CURSOR + b"\n")
    told = b"simscen: ended at once, without reports: `simscen report` makes them from the journal\n"
    os.write(2, told)
    os._exit(128 + number)
