"""Where a file is for those who read of it: seen from the working folder, or from the top of a repository."""

import os
from pathlib import Path


def in_checkout(file: str) -> str:
    """`file`, as seen from the working folder, relative to $GITHUB_WORKSPACE; as it is where it is not in there.

    GitHub places annotations by the top of the repository that it checked out, wherever the command was called.
    """
    workspace = os.environ.get("GITHUB_WORKSPACE")
    if not workspace:
        return file
    top, real = Path(os.path.realpath(workspace)), Path(os.path.realpath(file))
    return real.relative_to(top).as_posix() if real.is_relative_to(top) and os.path.lexists(real) else file


def from_here(file: str, folder: str) -> str:
    """`file`, as seen from `folder`, as seen from the working folder; as it is where it has gone since."""
    there = str(Path(folder, file))
    return min(os.path.relpath(there), there, key=len) if file and folder and os.path.lexists(there) else file
