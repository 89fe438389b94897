"""The installed command `simscen`: what surrounds the command line to let light commands answer at once."""

import gc
import os
import signal
import sys
from typing import NoReturn

INTERRUPTED = 130
"""As Exit.INTERRUPTED, which is not imported yet."""


def start() -> None:
    """Run the command line.

    Imports make 40 000 objects that live to the end. Python looks through them for garbage again and again while they
    are made (12 ms), and takes them apart one by one when it ends (25 ms, a sixth of `simscen validate`).
    """
    gc.disable()
    from simscen.cli.main import is_light, main

    if signal.getsignal(signal.SIGINT) is _leave_at_once:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        main()
    except SystemExit as end:
        if is_light(sys.argv[1:]) and isinstance(end.code, int):
            os._exit(end.code)  # without taking anything apart, as mypy does: all is printed
        raise


def _leave_at_once(*_: object) -> NoReturn:
    """Ctrl-C while Python still imports: there is nothing to put in order, and no traceback to show."""
    os._exit(INTERRUPTED)


if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
    signal.signal(signal.SIGINT, _leave_at_once)
