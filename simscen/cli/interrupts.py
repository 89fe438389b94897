"""SIGINT, SIGTERM and SIGHUP end a session in good order."""

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

from simscen.run.process.supervisor import Interrupted


@contextmanager
def signals_interrupt() -> Iterator[None]:
    """Raise Interrupted for the first of these signals; more of them change nothing, so that reports are written.

    A SIGHUP that is ignored, as under nohup, stays so.
    """

    def interrupt(number: int, _: FrameType | None) -> None:
        for each in before:
            signal.signal(each, signal.SIG_IGN)
        raise Interrupted(number)

    heeded = [signal.SIGINT, signal.SIGTERM]
    if signal.getsignal(signal.SIGHUP) is not signal.SIG_IGN:
        heeded.append(signal.SIGHUP)
    before = {number: signal.getsignal(number) for number in heeded}
    for number in heeded:
        signal.signal(number, interrupt)
    try:
        yield
    finally:
        if signal.getsignal(signal.SIGINT) is interrupt:
            for number, handler in before.items():
                signal.signal(number, handler)
