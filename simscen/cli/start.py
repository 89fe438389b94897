"""The installed command `simscen`: what surrounds the command line to let light commands answer at once."""

import gc
import os
import sys
from typing import NoReturn

from simscen.core.errors import Exit


def start() -> None:
    """Run the command line.

    Imports make 40 000 objects that live to the end. Python looks through them for garbage again and again while they
    are made (12 ms), and takes them apart one by one when it ends (25 ms, a sixth of `simscen validate`).
    """
    gc.disable()
    from simscen.cli.main import is_light, main

    light = is_light(sys.argv[1:])
    try:
        main()
    except SystemExit as end:
        if light and isinstance(end.code, int):
            _leave(end.code)
        raise
    if light:
        _leave(Exit.PASSED)


def _leave(code: int) -> NoReturn:
    """End without taking anything apart, as mypy does: nothing is left to do but to print."""
    try:
        sys.stdout.flush()
        sys.stderr.flush()
    except BrokenPipeError:
        code = 1  # as click ends where the output is not buffered
    os._exit(code)
