"""Parse the command that starts an external stack, check that it can be run, and compute the digest of its files."""

import hashlib
import itertools
import json
import os
import shutil
import stat
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from simscen.core.external_command import ANSWER_TIMEOUT_S, START_TIMEOUT_S, ExternalCommand, split_command
from simscen.loading.files.paths import exists
from simscen.loading.schema.messages import quoted
from simscen.loading.yaml.textfile import os_error_reason

CHUNK_BYTES = 1 << 20
"""Amount of a file that is read at once for the digest."""
EXCLUDED_FOLDERS = frozenset({"__pycache__", "venv", "node_modules", "site-packages"})
"""Folders whose Python files are not part of a stack."""
MAX_FOLDERS, MAX_SOURCES = 500, 1000
"""Largest number of folders that are searched, and of Python files that are read, for each source folder of a stack."""
SIMSCEN_PROGRAM = "simscen"
"""Program that is started from the running installation if the PATH does not have it (environment not activated)."""


def parse_command(
    text: str,
    environment: Mapping[str, str],
    folder: Path,
    own: Mapping[str, str] | None = None,
    limits: tuple[float, float] = (START_TIMEOUT_S, ANSWER_TIMEOUT_S),
) -> ExternalCommand:
    """Return the command in `text`, which is written as in a shell and starts in `folder`.

    The variables `own` are added to `environment`. `limits` are the times in s for the start of the program and for
    each answer. Raises ValueError if the command cannot be parsed or its program cannot be run.
    """
    program, *arguments = split_command(text)
    program = str(Path(program).expanduser()) if program.startswith("~") else program
    env = {**environment, **(own or {})}
    if program == SIMSCEN_PROGRAM and why_not_executable(program, env, folder):
        program = str(Path(sys.executable).parent / SIMSCEN_PROGRAM)
    if reason := why_not_executable(program, env, folder):
        raise ValueError(reason)
    argv = (program, *arguments)
    digest = _digest(argv, own or {}, env, folder)
    return ExternalCommand(argv, env, str(folder), *limits, digest=digest)


def why_not_executable(program: str, env: Mapping[str, str], folder: Path) -> str:
    """Return why a program cannot be run from `folder` with the variables `env`; "" if it can."""
    if "/" not in program:
        found = shutil.which(program, path=_path(env, folder))
        return "" if found else f"no program {quoted(program)} in the PATH"
    file = folder / program
    try:
        mode = file.stat().st_mode
    except OSError as error:
        return f"{os_error_reason(error)}: {quoted(program)}"
    if not stat.S_ISREG(mode):
        return f"{quoted(program)} is {'a folder' if stat.S_ISDIR(mode) else 'not a regular file'}, not a program"
    if not os.access(file, os.X_OK):
        return f"permission denied: {quoted(program)} is not executable"
    return _why_no_interpreter(program, file)


def _why_no_interpreter(program: str, file: Path) -> str:
    """Return why the interpreter of the script `file` cannot be run; "" if it can, or if `file` is not a script.

    Without this check, the kernel would report that the script itself is missing.
    """
    try:
        with file.open("rb") as stream:
            first = stream.read(256).partition(b"\n")[0]
    except OSError:  # executable but not readable
        return ""
    if not first.startswith(b"#!"):
        return ""
    words = first[2:].decode(errors="replace").split()
    if first.endswith(b"\r"):
        return f"the first line of {quoted(program)} has a Windows line end; save the file with Unix line ends"
    if not words:
        return f"the first line of {quoted(program)} names no interpreter"
    written = quoted("#!" + words[0])
    return "" if exists(Path(words[0])) else f"{quoted(program)} starts with {written}, which does not exist"


def _path(env: Mapping[str, str], folder: Path) -> str:
    """Return the PATH in `env` with absolute folders; relative ones are resolved from `folder`."""
    return os.pathsep.join(str(folder / part) for part in env.get("PATH", os.defpath).split(os.pathsep))


def _digest(argv: Sequence[str], own: Mapping[str, str], env: Mapping[str, str], folder: Path) -> str:
    """Return the SHA-256 of the stack, by which changed stacks are recognized.

    It covers the arguments, the variables `own`, the content of the program and of files that arguments name, and the
    Python files in the folders of scripts and modules that arguments name.
    """
    sha = hashlib.sha256(json.dumps([list(argv), sorted(own.items())]).encode())
    found = shutil.which(argv[0], path=_path(env, folder)) if "/" not in argv[0] else None
    for word in (found or argv[0], *argv[1:]):
        file = folder / word
        if len(word) < 4096 and "\0" not in word and file.is_file() and os.access(file, os.R_OK):
            with file.open("rb") as stream:
                while data := stream.read(CHUNK_BYTES):
                    sha.update(data)
        sha.update(b"\0")
    for working_folder in _source_folders(argv, folder):
        for file in itertools.islice(_python_files(working_folder), MAX_SOURCES):
            sha.update(f"{file.relative_to(working_folder).as_posix()}\0".encode() + file.read_bytes() + b"\0")
    return sha.hexdigest()


def _source_folders(argv: Sequence[str], folder: Path) -> list[Path]:
    """Return the folders of the Python scripts and modules that arguments name, from which they import their code."""
    homes: set[Path] = set()
    for before, word in itertools.pairwise(("", *argv)):
        if len(word) >= 4096 or "\0" in word:
            continue
        module = folder / word.replace(".", "/")
        if before == "-m" and (module.is_dir() or module.with_suffix(".py").is_file()):
            homes.add(module if module.is_dir() else module.parent)
        elif word.endswith(".py") and (folder / word).is_file():
            homes.add((folder / word).parent)
    return sorted(homes)


def _python_files(working_folder: Path) -> Iterator[Path]:
    """Yield the readable Python files in and below a folder, except those in hidden and excluded folders."""
    for folder, below, names in itertools.islice(os.walk(working_folder), MAX_FOLDERS):
        below[:] = sorted(name for name in below if not name.startswith(".") and name not in EXCLUDED_FOLDERS)
        for file in (Path(folder) / name for name in sorted(names) if name.endswith(".py")):
            if file.is_file() and os.access(file, os.R_OK):
                yield file
