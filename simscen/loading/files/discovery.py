"""Which files the arguments of a command mean."""

import os
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

from simscen.core.errors import InvalidInput, NothingSelected, Problem
from simscen.loading.files.paths import exists, is_folder
from simscen.loading.scenario import scenario_id
from simscen.loading.schema.messages import quoted
from simscen.loading.yaml.textfile import os_error_reason

SCENARIO = (".scenario.yaml", ".scenario.yml")
WORLD = (".world.yaml", ".world.yml")
ROBOT = (".robot.yaml", ".robot.yml")
STACK = (".stack.yaml", ".stack.yml")
BASE = (".base.yaml", ".base.yml")

REPOSITORY = (".git", ".hg", ".jj", ".svn")
PROJECT = ("pyproject.toml", "package.xml", "setup.py")
"""What lies at the top of a Python project or a ROS package; an archive or a container image has no repository."""
SCENARIOS = "scenarios"


def discover(paths: Sequence[Path], root: Path, suffixes: tuple[str, ...] = SCENARIO) -> list[Path]:
    """The scenario files that `paths` mean: a file as it is, a folder searched for `*.scenario.yaml`, sorted.

    Raises InvalidInput where a path is missing or two scenarios would have the same id but for case, NothingSelected
    where there is nothing.
    """
    problems = [problem for path in paths if (problem := _absent(path))]
    found = dict.fromkeys(file.absolute() for path in paths for file in _files(path, suffixes, problems))
    if problems:
        raise InvalidInput(problems)
    if not found:
        where = ", ".join(quoted(str(path)) for path in paths)
        raise NothingSelected(f"no scenarios found in {where}; a folder is searched for *{suffixes[0]}")
    files = sorted(found, key=lambda file: file.parts)
    home = Path(os.path.realpath(root))
    if problems := [*_no_folders(files, home), *_same_ids(files, home)]:
        raise InvalidInput(sorted(problems))
    return files


def default_root(paths: Iterable[Path]) -> Path:
    """The project that holds all of `paths`, found by what lies around them, never by what is in the files.

    The nearest folder above with a repository; else with a project's file; else the one that holds the nearest folder
    called `scenarios`; else the working folder, where it holds them; else their common folder. The file system's root
    and the user's home are nobody's project unless they hold a repository or a project's file.
    """
    folders = [Path(os.path.realpath(path if is_folder(path) else path.parent)) for path in paths]
    common = Path(os.path.commonpath(folders)) if folders else Path.cwd()
    above = (common, *common.parents)
    candidates = (
        *(folder for folder in above if _holds(folder, REPOSITORY)),
        *(folder for folder in above if _holds(folder, PROJECT)),
        *(folder.parent for folder in above if folder.name == SCENARIOS and not _nobodys(folder.parent)),
        *(folder for folder in (Path.cwd(),) if common.is_relative_to(folder) and not _nobodys(folder)),
    )
    return next(iter(candidates), common)


def _holds(folder: Path, names: tuple[str, ...]) -> bool:
    return any(exists(folder / name) for name in names)


def _nobodys(folder: Path) -> bool:
    """Whether a folder is too wide to be somebody's project: `/`, the home folder and what holds that."""
    return folder == folder.parent or Path(os.path.realpath(Path("~").expanduser())).is_relative_to(folder)


def _absent(path: Path) -> Problem | None:
    try:
        path.lstat()
    except (OSError, ValueError) as error:
        told = os_error_reason(error) if isinstance(error, OSError) else "no such file or directory"
        return Problem(str(path), 0, 0, "SC001", told)
    return None


def _files(path: Path, suffixes: tuple[str, ...], problems: list[Problem]) -> Iterator[Path]:
    """The files that `path` means; folders that cannot be searched become problems."""
    if not is_folder(path):
        yield path
        return

    def unsearchable(error: OSError) -> None:
        problems.append(Problem(str(error.filename), 0, 0, "SC001", os_error_reason(error)))

    for folder, below, names in os.walk(path, onerror=unsearchable):
        below[:] = sorted(name for name in below if not name.startswith("."))
        yield from (Path(folder) / name for name in sorted(names) if name.endswith(suffixes))


def _no_folders(files: list[Path], root: Path) -> Iterator[Problem]:
    """Ids become folders of the output, in which those of runs are called seed-…"""
    ids = {scenario_id(file, root).casefold() for file in files}
    for file in files:
        name = scenario_id(file, root).casefold()
        above = name.split("/")[:-1]
        for depth, part in enumerate(above[1:], start=1):
            if part.startswith("seed-") and (other := "/".join(above[:depth])) in ids:
                message = f"its folder in the output would be that of a run of {quoted(other)}"
                yield Problem(_shown(file, root), 0, 0, "SC041", message, "rename one of them")


def _shown(file: Path, root: Path) -> str:
    return str(file.relative_to(root)) if file.is_relative_to(root) else str(file)


def _same_ids(files: list[Path], root: Path) -> Iterator[Problem]:
    """Ids become folders of the output, and some file systems do not tell case apart."""
    seen: dict[str, Path] = {}
    for file in files:
        other = seen.setdefault(scenario_id(file, root).casefold(), file)
        if other != file:
            message = f"has the same id as {quoted(_shown(other, root))}, but for upper and lower case or suffix"
            yield Problem(_shown(file, root), 0, 0, "SC040", message, "rename one of them")
