"""Copying of a scenario, and of the files that it names, to another folder."""

import shutil
from collections.abc import Iterable, Iterator
from os.path import commonpath, relpath
from pathlib import Path

from simscen.core.errors import Problem, UsageError
from simscen.loading.files.paths import is_file
from simscen.loading.loaded import LoadedScenario
from simscen.loading.scenario_text import unexpanded_text
from simscen.loading.yaml.parser import parse_yaml
from simscen.loading.yaml.textfile import read_text
from simscen.loading.yaml.tree import Node, ScalarNode, nodes_with_keys

_MODELINE = "# yaml-language-server:"
"""Beginning of the comment that tells editors the path of the JSON schema."""
_SEARCHED_SUFFIXES = (".yaml", ".yml")
"""Suffixes of files that are searched for names of further files."""
_UNSEARCHED_SUFFIXES = (".sdf", ".world", ".urdf", ".xacro")
"""Suffixes of files that can name further files, but cannot be searched. They are not copied."""


def copy_scenario(loaded: LoadedScenario, target: Path, root: Path) -> list[Path]:
    """Copy a scenario to the file `target`, and return the paths of all copies. Paths in the copy are adapted.

    `root` is the root of `target`. If the scenario has another root, the files that it names are copied as well, to a
    folder next to `target` with the name of `target` without suffixes. Raises UsageError if a file cannot be copied, or
    if a copy already exists.
    """
    lines = unexpanded_text(loaded).split("\n")
    text = "\n".join(line for line in lines if not line.startswith(_MODELINE))
    tree, _ = parse_yaml(text, loaded.path)
    assert tree is not None
    folders = {file.parent for file in loaded.files.values()}
    named = {leaf: _existing_file(leaf, folders) for leaf in _scalars(tree)}
    files = {leaf: file for leaf, file in named.items() if file is not None}
    needed = _with_dependencies(files.values())
    same_root = root == loaded.root
    common_folder = Path(commonpath([file.parent for file in needed])) if needed else loaded.root
    folder = target.parent / target.name.partition(".")[0]
    copies = {} if same_root else {file: folder / file.relative_to(common_folder) for file in needed}
    if existing := next((copy for copy in copies.values() if copy.exists()), None):
        raise UsageError(f"{existing} already exists; choose another name")
    for file, copy in copies.items():
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(file, copy)
    for leaf, file in sorted(files.items(), key=lambda item: item[0].position, reverse=True):
        text = _with_path(text, leaf, relpath(copies.get(file, file), target.parent))
    target.write_text(text, encoding="utf-8")
    return [target, *copies.values()]


def _scalars(tree: Node) -> Iterator[ScalarNode]:
    return (node for _, node in nodes_with_keys(tree) if isinstance(node, ScalarNode))


def _existing_file(leaf: ScalarNode, folders: set[Path]) -> Path | None:
    """Return the existing file that the scalar `leaf` names relative to one of `folders`; None if there is none."""
    if not isinstance(leaf.value, str) or "." not in leaf.value or "\n" in leaf.value or len(leaf.value) > 4096:
        return None
    return next((path.resolve() for folder in sorted(folders) if is_file(path := folder / leaf.value)), None)


def _with_dependencies(files: Iterable[Path]) -> list[Path]:
    """Return these files and all files that they name, sorted. Raises UsageError for _UNSEARCHED_SUFFIXES."""
    found: set[Path] = set()
    waiting = list(files)
    while waiting:
        file = waiting.pop(0)
        if file in found:
            continue
        if file.name.endswith(_UNSEARCHED_SUFFIXES):
            raise UsageError(f"{file.name} may refer to models and meshes: copy its folder yourself")
        found.add(file)
        text = read_text(file, file.name) if file.name.endswith(_SEARCHED_SUFFIXES) else ""
        tree = None if isinstance(text, Problem) else parse_yaml(text, file.name)[0]
        named = (_existing_file(leaf, {file.parent}) for leaf in (() if tree is None else _scalars(tree)))
        waiting += [other for other in named if other is not None]
    return sorted(found)


def _with_path(text: str, leaf: ScalarNode, path: str) -> str:
    lines = text.split("\n")
    line, start = lines[leaf.position.line - 1], leaf.position.col - 1
    quote = line[start] if line[start] in "'\"" else ""
    end = start + len(quote) + len(str(leaf.value)) + len(quote)
    lines[leaf.position.line - 1] = f"{line[:start]}{quote}{path}{quote}{line[end:]}"
    return "\n".join(lines)
