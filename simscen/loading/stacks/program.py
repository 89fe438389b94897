"""Finds the program of an external stack before anything runs, and tells when it is another one."""

import hashlib
import json
import os
import shutil
import stat
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from simscen.core.external_command import ANSWER_TIMEOUT_S, START_TIMEOUT_S, ExternalCommand, split_command
from simscen.loading.files.paths import exists
from simscen.loading.schema.messages import quoted
from simscen.loading.yaml.textfile import os_error_reason

AT_ONCE = 1 << 20
OWN = "simscen"
"""Where the PATH has none it is the one that was called, of a virtual environment that nobody has activated."""


def parse_command(
    text: str,
    environment: Mapping[str, str],
    folder: Path,
    own: Mapping[str, str] | None = None,
    limits: tuple[float, float] = (START_TIMEOUT_S, ANSWER_TIMEOUT_S),
) -> ExternalCommand:
    """The command that a line means in a folder: `own` variables are set on top of the user's `environment`.

    Raises ValueError when it cannot be read or its program is not there to be run.
    """
    program, *arguments = split_command(text)
    program = str(Path(program).expanduser()) if program.startswith("~") else program
    env = {**environment, **(own or {})}
    if program == OWN and why_not_executable(program, env, folder):
        program = str(Path(sys.executable).parent / OWN)
    if why := why_not_executable(program, env, folder):
        raise ValueError(why)
    argv = (program, *arguments)
    digest = _digest(argv, own or {}, env, folder)
    return ExternalCommand(argv, env, str(folder), *limits, digest=digest)


def why_not_executable(program: str, env: Mapping[str, str], folder: Path) -> str:
    """Why a program cannot be run from `folder`; "" when it can."""
    if "/" not in program:
        found = shutil.which(program, path=_path(env, folder))
        return "" if found else f"there is no program {quoted(program)} in the PATH"
    file = folder / program
    try:
        mode = file.stat().st_mode
    except OSError as error:
        return f"{os_error_reason(error)}: {quoted(program)}"
    if not stat.S_ISREG(mode):
        return f"{quoted(program)} is not a program but {'a folder' if stat.S_ISDIR(mode) else 'something else'}"
    if not os.access(file, os.X_OK):
        return f"permission denied: {quoted(program)} is not executable"
    return _without_interpreter(program, file)


def _without_interpreter(program: str, file: Path) -> str:
    """Why a script cannot be run, of which the kernel would say that it is the script that does not exist."""
    try:
        with file.open("rb") as stream:
            first = stream.read(256).partition(b"\n")[0]
    except OSError:  # one that may be run, but not be read
        return ""
    if not first.startswith(b"#!"):
        return ""
    words = first[2:].decode(errors="replace").split()
    if first.endswith(b"\r"):
        return f"the first line of {quoted(program)} ends as on Windows; save it with plain line ends"
    if not words:
        return f"the first line of {quoted(program)} names no interpreter"
    written = quoted("#!" + words[0])
    return "" if exists(Path(words[0])) else f"{quoted(program)} begins with {written}, which is not there"


def _path(env: Mapping[str, str], folder: Path) -> str:
    """The PATH with its relative folders seen from where the program starts."""
    return os.pathsep.join(str(folder / part) for part in env.get("PATH", os.defpath).split(os.pathsep))


def _digest(argv: Sequence[str], own: Mapping[str, str], env: Mapping[str, str], folder: Path) -> str:
    """SHA-256 over words, own variables, and the program and other files that words name; not over where they are."""
    sha = hashlib.sha256(json.dumps([list(argv), sorted(own.items())]).encode())
    found = shutil.which(argv[0], path=_path(env, folder)) if "/" not in argv[0] else None
    for word in (found or argv[0], *argv[1:]):
        file = folder / word
        if len(word) < 4096 and "\0" not in word and file.is_file() and os.access(file, os.R_OK):
            with file.open("rb") as stream:
                while data := stream.read(AT_ONCE):
                    sha.update(data)
        sha.update(b"\0")
    return sha.hexdigest()
