"""Pass the locations of plug-ins to the fork server.

The fork server runs with `python -I`, so that neither PYTHONPATH nor the user's site-packages can change the engine.
Plug-ins may be installed there, and both processes must find the same ones.
"""

import json
import os
import site
import sys
from collections.abc import Iterable
from pathlib import Path

from simscen.spec.registry import Entry, search_path


def plugin_path_arguments(plugins: Iterable[Entry]) -> tuple[str, ...]:
    """Return the arguments with which the fork server finds these plug-ins; empty if there are none."""
    used = sorted({(entry.distribution, entry.folder) for entry in plugins})
    if not used:
        return ()
    own = site.getusersitepackages() if site.ENABLE_USER_SITE else ""
    return (
        json.dumps({"path": [str(Path(folder).absolute()) for folder in search_path()], "user": own, "used": used}),
    )


def apply_plugin_path(told: str) -> None:
    """Extend sys.path in the fork server, so that it finds the same plug-ins as its parent.

    New folders come last, so that the engine does not change. A folder comes first only if another version of a used
    package would be found otherwise.
    """
    wanted = json.loads(told)
    for folder in wanted["path"]:
        if folder not in sys.path:
            # addsitedir reads .pth files, which are used by editable installations.
            site.addsitedir(folder) if folder == wanted["user"] else sys.path.append(folder)
    from importlib.metadata import PackageNotFoundError, distribution

    for name, folder in wanted["used"]:
        try:
            found = str(distribution(name).locate_file(""))
        except PackageNotFoundError:  # its runs report the missing package
            continue
        if os.path.realpath(found) != os.path.realpath(folder):
            sys.path.insert(0, folder)
