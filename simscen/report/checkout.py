"""Where a file is in the repository that GitHub checked out: annotations are placed by that, not by where we are."""

import os
from pathlib import Path


def in_checkout(file: str) -> str:
    """`file`, as seen from the working folder, relative to $GITHUB_WORKSPACE; as it is where it is not in there."""
    workspace = os.environ.get("GITHUB_WORKSPACE")
    if not workspace:
        return file
    top, real = Path(os.path.realpath(workspace)), Path(os.path.realpath(file))
    return real.relative_to(top).as_posix() if real.is_relative_to(top) and os.path.lexists(real) else file
