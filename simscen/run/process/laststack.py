"""Finds in what a process printed last the Python stack that `faulthandler` dumped."""

import re
from pathlib import PurePath

TAIL_LINES = 20
_HEAD = re.compile(r"^(Current thread|Thread|Stack) .*\(most recent call first\):$", re.MULTILINE)
_FRAME = re.compile(r'^  File "(?P<file>.*)", line (?P<line>\d+) in (?P<name>\S+)$', re.MULTILINE)


def innermost(printed: str) -> str:
    """Where the process was, e.g. "step (simulation.py:88)"; "" when no stack was dumped."""
    heads = list(_HEAD.finditer(printed))
    frame = _FRAME.search(printed, heads[-1].end()) if heads else None
    return f"{frame['name']} ({PurePath(frame['file']).name}:{frame['line']})" if frame else ""


def tail(printed: str) -> str:
    """The last lines; of a dumped stack the first, where the innermost call is."""
    heads = list(_HEAD.finditer(printed))
    if heads:
        before = printed[: heads[-1].start()].splitlines()[-3:]
        return "\n".join([*before, *printed[heads[-1].start() :].splitlines()[: TAIL_LINES - len(before)]])
    return "\n".join(printed.splitlines()[-TAIL_LINES:])
