"""Whose mistake an exception is: the engine's, or that of an installed package that a run uses."""

import traceback
from collections.abc import Sequence

from simscen.core.errors import RunError
from simscen.spec.registry import Entry


def blamed(error: Exception, plugins: Sequence[Entry]) -> RunError | None:
    """The error of the run where it passed through code of these packages, naming type and line; None elsewhere."""
    own = {entry.value.partition(":")[0].partition(".")[0] for entry in plugins}
    for frame, line in reversed(list(traceback.walk_tb(error.__traceback__))):
        module = str(frame.f_globals.get("__name__", ""))
        if module.partition(".")[0] in own:
            entry = _nearest(module, plugins)
            place = f"{frame.f_code.co_filename.rpartition('/')[2]}:{line}"
            told = f"{type(error).__name__}: {error}".splitlines()[0]
            return RunError("crashed", f"{entry.group} `{entry.name}` of {entry.origin}: {told} ({place})")
    return None


def _nearest(module: str, plugins: Sequence[Entry]) -> Entry:
    """The one that is defined in this module, or the first of its package."""
    package = module.partition(".")[0]
    same = [entry for entry in plugins if entry.value.partition(":")[0].partition(".")[0] == package]
    return next((entry for entry in same if entry.value.partition(":")[0] == module), same[0])
