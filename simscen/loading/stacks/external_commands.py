"""Parses commands that start external stacks, checks the program, and computes a digest of the files of the stack."""

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
from simscen.core.files import expand_home
from simscen.loading.files.paths import exists, is_file, is_folder
from simscen.loading.schema.messages import quoted
from simscen.loading.yaml.textfile import os_error_reason

CHUNK_BYTES = 1 << 20
"""Number of bytes of a file that are read at once for the digest."""
EXCLUDED_FOLDERS = frozenset({"__pycache__", "venv", "node_modules", "site-packages"})
"""Names of folders that do not belong to a stack."""
MAX_FOLDERS = 500
"""Maximum number of folders that are searched below a source folder of a stack."""
MAX_PYTHON_FILES = 1000
"""Maximum number of Python files of a source folder in the digest."""
SIMSCEN_PROGRAM = "simscen"
"""Name of the simscen program. If it is not in the PATH, the program of the running installation is started."""


def parse_command(
    text: str,
    environment: Mapping[str, str],
    folder: Path,
    own_variables: Mapping[str, str] | None = None,
    timeouts_s: tuple[float, float] = (START_TIMEOUT_S, ANSWER_TIMEOUT_S),
) -> ExternalCommand:
    """Return the command in `text`, which has shell quoting. The command will be started in `folder`.

    `own_variables` are environment variables of the stack in addition to those in `environment`. `timeouts_s` are the
    maximum times for the start and for each answer. Raises ValueError if the text cannot be parsed or the program
    cannot be run.
    """
    program, *arguments = split_command(text)
    program = str(expand_home(program)) if program.startswith("~") else program
    env = {**environment, **(own_variables or {})}
    if program == SIMSCEN_PROGRAM and _program_problem(program, env, folder):
        program = str(Path(sys.executable).parent / SIMSCEN_PROGRAM)
    if problem := _program_problem(program, env, folder):
        raise ValueError(problem)
    argv = (program, *arguments)
    digest = _digest(argv, own_variables or {}, env, folder)
    return ExternalCommand(argv, env, str(folder), *timeouts_s, digest=digest)


def _program_problem(program: str, env: Mapping[str, str], folder: Path) -> str:
    """Return the reason why a program cannot be run in `folder` with the variables `env`; "" if it can be run."""
    if "/" not in program:
        found = shutil.which(program, path=_absolute_search_path(env, folder))
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
    return _interpreter_problem(program, file)


def _interpreter_problem(program: str, file: Path) -> str:
    """Return the reason why the interpreter of the script `file` cannot be run; "" if there is none.

    `program` is the path of the script as written, for the message.
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


def _absolute_search_path(env: Mapping[str, str], folder: Path) -> str:
    """Return the variable PATH of `env` with absolute folders. Relative folders are relative to `folder`."""
    return os.pathsep.join(str(folder / part) for part in env.get("PATH", os.defpath).split(os.pathsep))


def _digest(argv: Sequence[str], own_variables: Mapping[str, str], env: Mapping[str, str], folder: Path) -> str:
    """Return the SHA-256 digest of the arguments, variables, program, and files of a stack.

    The files are the files in the arguments, and the Python files in the folders of scripts and modules in the
    arguments.
    """
    sha = hashlib.sha256(json.dumps([list(argv), sorted(own_variables.items())]).encode())
    found = shutil.which(argv[0], path=_absolute_search_path(env, folder)) if "/" not in argv[0] else None
    for word in (found or argv[0], *argv[1:]):
        file = folder / word
        if is_file(file) and os.access(file, os.R_OK):
            with file.open("rb") as stream:
                while data := stream.read(CHUNK_BYTES):
                    sha.update(data)
        sha.update(b"\0")
    for source_folder in _source_folders(argv, folder):
        for file in itertools.islice(_python_files(source_folder), MAX_PYTHON_FILES):
            sha.update(f"{file.relative_to(source_folder).as_posix()}\0".encode() + file.read_bytes() + b"\0")
    return sha.hexdigest()


def _source_folders(argv: Sequence[str], folder: Path) -> list[Path]:
    """Return the folders of the Python scripts and modules (`-m`) in the arguments, relative to `folder`."""
    source_folders: set[Path] = set()
    for before, word in itertools.pairwise(("", *argv)):
        module = folder / word.replace(".", "/")
        if before == "-m" and (is_folder(module) or is_file(module.with_suffix(".py"))):
            source_folders.add(module if is_folder(module) else module.parent)
        elif word.endswith(".py") and is_file(folder / word):
            source_folders.add((folder / word).parent)
    return sorted(source_folders)


def _python_files(source_folder: Path) -> Iterator[Path]:
    """Yield the readable Python files in a folder and its subfolders, except hidden and excluded folders."""
    for folder, below, names in itertools.islice(os.walk(source_folder), MAX_FOLDERS):
        below[:] = sorted(name for name in below if not name.startswith(".") and name not in EXCLUDED_FOLDERS)
        for file in (Path(folder) / name for name in sorted(names) if name.endswith(".py")):
            if file.is_file() and os.access(file, os.R_OK):
                yield file
