"""Where installed packages lie: told to the warm process, which is kept from all that only a user's environment says.

It runs with `python -I`, so that neither PYTHONPATH nor the user's own site-packages can change the engine. A package
that adds to the language may lie there all the same, and both processes must find the same one.
"""

import json
import os
import site
import sys
from collections.abc import Iterable
from pathlib import Path

from simscen.spec.registry import Entry, search_path


def plugin_path_arguments(plugins: Iterable[Entry]) -> tuple[str, ...]:
    """What the warm process is called with, in order to find these: nothing where there are none."""
    used = sorted({(entry.distribution, entry.folder) for entry in plugins})
    if not used:
        return ()
    own = site.getusersitepackages() if site.ENABLE_USER_SITE else ""
    return (
        json.dumps({"path": [str(Path(folder).absolute()) for folder in search_path()], "user": own, "used": used}),
    )


def apply_plugin_path(told: str) -> None:
    """In the warm process: look for packages where the one that called it does.

    What it knows already stays in front, so that the engine is what it is without them; only where that would hide a
    package that is used behind another of its name, the folder of that one comes first.
    """
    wanted = json.loads(told)
    for folder in wanted["path"]:
        if folder not in sys.path:
            # The user's site-packages may have .pth files, and through them packages that are being worked on.
            site.addsitedir(folder) if folder == wanted["user"] else sys.path.append(folder)
    from importlib.metadata import PackageNotFoundError, distribution

    for name, folder in wanted["used"]:
        try:
            found = str(distribution(name).locate_file(""))
        except PackageNotFoundError:  # its runs will say what they miss
            continue
        if os.path.realpath(found) != os.path.realpath(folder):
            sys.path.insert(0, folder)
