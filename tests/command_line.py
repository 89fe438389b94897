"""Calls of the command line in the process of a test."""

import sys

import pytest

from simscen.cli.main import main


def exit_code(patch: pytest.MonkeyPatch, *arguments: object) -> int:
    """Run `simscen ARGUMENTS` in this process, and return its exit code. `patch` sets `sys.argv`."""
    patch.setattr(sys, "argv", ["simscen", *map(str, arguments)])
    try:
        main()
    except SystemExit as end:
        return int(end.code or 0)
    return 0
