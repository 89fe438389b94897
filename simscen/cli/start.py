"""The installed command `simscen`: what surrounds the command line to let light commands answer at once."""

import gc
import os
import signal
import sys
from typing import NoReturn

INTERRUPTED = 130
INCOMPLETE = 3
"""As in Exit, which is not imported yet."""


def start() -> None:
    """Run the command line.

    Imports make 40 000 objects that live to the end. Python looks through them for garbage again and again while they
    are made (12 ms), and takes them apart one by one when it ends (25 ms, a sixth of `simscen validate`).
    """
    gc.disable()
    try:
        from simscen.cli.main import is_light, main
    except ModuleNotFoundError as error:
        _refuse([f"{error.name} is not installed; install simscen again, with what it needs"])

    if signal.getsignal(signal.SIGINT) is _leave_at_once:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    light = is_light(sys.argv[1:])
    _require(every=not light and sys.argv[1:2] != ["doctor"])
    try:
        main()
    except SystemExit as end:
        if light and isinstance(end.code, int):
            os._exit(end.code)  # without taking anything apart, as mypy does: all is printed
        raise


def _require(every: bool) -> None:
    """End in words when packages do not fit; `every` one, or only what reads the command line."""
    from simscen.cli.requirements import unmet, unmet_typer

    if told := unmet() if every else unmet_typer():
        _refuse(told)


def _refuse(told: list[str]) -> NoReturn:
    print(f"simscen: this installation does not work: {'; '.join(told)}", file=sys.stderr)
    sys.exit(INCOMPLETE)


def _leave_at_once(*_: object) -> NoReturn:
    """Ctrl-C while Python still imports: there is nothing to put in order, and no traceback to show."""
    os._exit(INTERRUPTED)


if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
    signal.signal(signal.SIGINT, _leave_at_once)
