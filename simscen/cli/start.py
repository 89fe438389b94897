"""Entry point of the command `simscen`, which checks the installed packages before it imports the commands."""

import gc
import os
import signal
import sys
from typing import NoReturn

INTERRUPTED = 130
INCOMPLETE = 3
"""Exit codes as in `simscen.core.errors.Exit`, which is not imported here to start fast."""


def start() -> None:
    """Run the command of this process, and exit."""
    gc.disable()  # until the command is imported, to start fast (docs/design/startup.md)
    try:
        from simscen.cli.main import calls_light_command, main
        from simscen.core.cpu_kernels import pin_kernels
    except ModuleNotFoundError as error:
        _exit_unusable([f"{error.name} is not installed; install simscen again with its dependencies"])

    if signal.getsignal(signal.SIGINT) is _exit_on_interrupt:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    pin_kernels()
    is_light = calls_light_command(sys.argv[1:])
    _check_requirements(all_packages=not is_light and sys.argv[1:2] != ["doctor"])
    try:
        main()
    except SystemExit as end:
        if is_light and isinstance(end.code, int):
            os._exit(end.code)  # skips the teardown of the interpreter; all output is flushed
        raise


def _check_requirements(all_packages: bool) -> None:
    """Exit with a message if a package is missing or has an unsupported version.

    If `all_packages` is false, check typer only.
    """
    from simscen.cli.requirements import unmet_requirements, unmet_typer

    if problems := unmet_requirements() if all_packages else unmet_typer():
        _exit_unusable(problems)


def _exit_unusable(problems: list[str]) -> NoReturn:
    """Print why the installation cannot be used, and exit with INCOMPLETE."""
    print(f"simscen: this installation does not work: {'; '.join(problems)}", file=sys.stderr)
    sys.exit(INCOMPLETE)


def _exit_on_interrupt(*_: object) -> NoReturn:
    """Exit without a traceback: handler of SIGINT (Ctrl-C) during imports."""
    os._exit(INTERRUPTED)


if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
    signal.signal(signal.SIGINT, _exit_on_interrupt)
