"""Finds the files that the path arguments of a command select, and the default root folder."""

import os
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

from simscen.core.errors import InvalidInput, NothingSelected, Problem
from simscen.core.files import expand_home
from simscen.loading.files.paths import absolute_path, exists, is_folder, path_in_messages, scenario_id
from simscen.loading.schema.messages import quoted
from simscen.loading.yaml.textfile import os_error_reason

# Suffixes of the YAML files of simscen by kind. Scenarios extend base files.
SCENARIO_SUFFIXES = (".scenario.yaml", ".scenario.yml")
WORLD_SUFFIXES = (".world.yaml", ".world.yml")
ROBOT_SUFFIXES = (".robot.yaml", ".robot.yml")
STUDY_SUFFIXES = (".study.yaml", ".study.yml")
STACK_SUFFIXES = (".stack.yaml", ".stack.yml")
BASE_SUFFIXES = (".base.yaml", ".base.yml")
SUFFIXES = SCENARIO_SUFFIXES + STUDY_SUFFIXES + WORLD_SUFFIXES + ROBOT_SUFFIXES + STACK_SUFFIXES + BASE_SUFFIXES
"""Suffixes of all kinds of YAML files of simscen."""

REPOSITORY_FOLDERS = (".git", ".hg", ".jj", ".svn")
"""Names of folders of version control systems, which are at the top of a repository."""
PROJECT_FILES = ("pyproject.toml", "package.xml", "setup.py")
"""Names of files at the top of a Python project or ROS package."""
SCENARIOS_FOLDER = "scenarios"
"""Usual name of the folder with the scenarios of a project."""


def discover(paths: Sequence[Path], root: Path, suffixes: tuple[str, ...] = SCENARIO_SUFFIXES) -> list[Path]:
    """Return the absolute paths (see `absolute_path`) of the files that `paths` select, sorted and each once.

    A folder selects all files with one of `suffixes` in it and in its subfolders that are not hidden. Raises
    InvalidInput for missing paths and conflicting output folders, and NothingSelected.
    """
    problems: list[Problem] = []
    for path in paths:
        try:
            path.lstat()
        except (OSError, ValueError) as error:
            message = os_error_reason(error) if isinstance(error, OSError) else "no such file or directory"
            problems.append(Problem(str(path), 0, 0, "SC001", message))
    found = dict.fromkeys(absolute_path(file) for path in paths for file in _selected_files(path, suffixes, problems))
    if problems:
        raise InvalidInput(problems)
    if not found:
        where = ", ".join(quoted(str(path)) for path in paths)
        raise NothingSelected(f"no scenarios found in {where}; folders are searched for *{suffixes[0]}")
    files = sorted(found, key=lambda file: file.parts)
    root_folder = Path(os.path.realpath(root))
    if problems := [*_output_folder_conflicts(files, root_folder), *_duplicate_ids(files, root_folder)]:
        raise InvalidInput(sorted(problems))
    return files


def sibling(file: Path, label: str) -> Path:
    """Return the path of another scenario file next to `file`, e.g. `goal.minimal.scenario.yaml` for "minimal"."""
    suffixes = (*SCENARIO_SUFFIXES, *STUDY_SUFFIXES)
    name = next((file.name.removesuffix(end) for end in suffixes if file.name.endswith(end)), file.stem)
    return file.with_name(f"{name}.{label}{SCENARIO_SUFFIXES[0]}")


def default_root(paths: Iterable[Path]) -> Path:
    """Return the folder of the project that contains all `paths`: the first of these folders that exists.

    1. the nearest common parent of the paths that is a repository
    2. the nearest common parent with a project file
    3. the parent of the nearest common parent with the name `scenarios`
    4. the working folder, if it contains the paths
    5. the common folder of the paths
    """
    folders = [Path(os.path.realpath(path if is_folder(path) else path.parent)) for path in paths]
    common = Path(os.path.commonpath(folders)) if folders else Path.cwd()
    parents = (common, *common.parents)
    candidates = (
        *(folder for folder in parents if _contains_any(folder, REPOSITORY_FOLDERS)),
        *(folder for folder in parents if _contains_any(folder, PROJECT_FILES)),
        *(folder.parent for folder in parents if folder.name == SCENARIOS_FOLDER and not _is_too_wide(folder.parent)),
        *(folder for folder in (Path.cwd(),) if common.is_relative_to(folder) and not _is_too_wide(folder)),
    )
    return next(iter(candidates), common)


def _contains_any(folder: Path, names: tuple[str, ...]) -> bool:
    return any(exists(folder / name) for name in names)


def _is_too_wide(folder: Path) -> bool:
    """Return whether a folder is `/`, the home folder, or a parent of the home folder."""
    home = expand_home("~")
    return folder == folder.parent or (home.is_absolute() and Path(os.path.realpath(home)).is_relative_to(folder))


def _selected_files(path: Path, suffixes: tuple[str, ...], problems: list[Problem]) -> Iterator[Path]:
    """Yield the files that `path` selects. Add a problem for each folder that cannot be searched."""
    if not is_folder(path):
        yield path
        return

    def report(error: OSError) -> None:
        problems.append(Problem(str(error.filename), 0, 0, "SC001", os_error_reason(error)))

    is_empty = True
    for folder, below, names in os.walk(path, onerror=report):
        below[:] = sorted(name for name in below if not name.startswith("."))
        files = [Path(folder) / name for name in sorted(names) if name.endswith(suffixes)]
        is_empty = is_empty and not files
        yield from files
    if is_empty and path.name.endswith(suffixes):
        problems.append(Problem(str(path), 0, 0, "SC001", "is a folder, but has the name of a file", "rename it"))


def _output_folder_conflicts(files: list[Path], root: Path) -> Iterator[Problem]:
    """Yield a problem for each scenario whose output folder is inside the folder of a run of another scenario.

    For example, `a/seed-1` is the output folder of a run of the scenario `a`, and contains that of `a/seed-1/b`.
    """
    ids = {scenario_id(file, root).casefold() for file in files}
    for file in files:
        name = scenario_id(file, root).casefold()
        folders = name.split("/")[:-1]
        for depth, folder in enumerate(folders[1:], start=1):
            if folder.startswith("seed-") and (other := "/".join(folders[:depth])) in ids:
                message = f"its output folder would be the folder of a run of {quoted(other)}"
                yield Problem(path_in_messages(file, root), 0, 0, "SC041", message, "rename one of them")


def _duplicate_ids(files: list[Path], root: Path) -> Iterator[Problem]:
    """Yield a problem for each scenario with the same id as another scenario, ignoring case."""
    seen: dict[str, Path] = {}
    for file in files:
        other = seen.setdefault(scenario_id(file, root).casefold(), file)
        if other != file:
            message = f"has the same id as {quoted(path_in_messages(other, root))}, except for case or suffix"
            yield Problem(path_in_messages(file, root), 0, 0, "SC040", message, "rename one of them")
