"""Copies a scenario, and the files that it names, to another folder."""

import json
import re
import shutil
from collections.abc import Iterable, Mapping
from os.path import commonpath, realpath, relpath
from pathlib import Path

import yaml

from simscen.core.errors import Problem, UsageError
from simscen.loading.files.paths import PathSandbox, is_file
from simscen.loading.loaded import LoadedScenario
from simscen.loading.yaml.library import Library
from simscen.loading.yaml.parser import parse_yaml
from simscen.loading.yaml.textfile import read_text
from simscen.loading.yaml.tree import Keys, MappingNode, Node, ScalarNode, node_at, nodes_with_keys
from simscen.loading.yaml.writing import to_yaml

_MODELINE = "# yaml-language-server:"
"""Beginning of the comment that contains the path of the JSON schema for editors."""
_SEARCHED_SUFFIXES = (".yaml", ".yml")
"""Suffixes of files that are searched for names of further files."""
_UNSEARCHED_SUFFIXES = (".sdf", ".world", ".urdf", ".xacro")
"""Suffixes of files that can name further files, but cannot be searched. They are not copied."""
_PLAIN_PATH = re.compile(r"[\w./][\w./ -]*")
"""Paths that need no quotes in YAML."""


def copy_scenario(loaded: LoadedScenario, target: Path, root: Path) -> list[Path]:
    """Copy a scenario to the file `target`, and return the paths of all copies. Paths in the copy are adapted.

    `root` is the root of `target`. If the scenario has another root, the files that the scenario names are copied as
    well. Their folder is next to `target`, and has the name of `target` without suffixes. Raises UsageError if a file
    cannot be copied, or if a copy already exists.
    """
    library = Library(PathSandbox.around(loaded.root, loaded.world_path))
    merged, _ = library.read(loaded.file, defaults=True)
    file_tree, _ = parse_yaml(loaded.text, loaded.path)
    assert merged is not None
    assert file_tree is not None
    merged_text = loaded.text if file_tree.plain == merged.plain else to_yaml(merged.plain)
    text = "\n".join(line for line in merged_text.split("\n") if not line.startswith(_MODELINE))
    tree, _ = parse_yaml(text, loaded.path)
    assert tree is not None
    named = [(node_at(tree, keys), file) for keys, (_, file) in _named_files(merged, library.files).items()]
    files = {leaf: file for leaf, file in named if isinstance(leaf, ScalarNode)}
    needed = _with_dependencies(files.values())
    has_same_root = root == loaded.root
    common_folder = Path(commonpath([file.parent for file in needed])) if needed else loaded.root
    folder = target.parent / target.name.partition(".")[0]
    copies = {} if has_same_root else {file: folder / file.relative_to(common_folder) for file in needed}
    if existing := next((copy for copy in copies.values() if copy.exists()), None):
        raise UsageError(f"{existing} already exists; choose another name")
    for file, copy in copies.items():
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(file, copy)
    for leaf, file in sorted(files.items(), key=lambda item: item[0].position, reverse=True):
        is_copied = file in copies
        path = relpath(copies[file], target.parent) if is_copied else relpath(file, realpath(target.parent))
        text = _with_path(text, leaf, path)
    target.write_text(text, encoding="utf-8")
    return [target, *copies.values()]


def with_paths_relative_to(folder: Path, tree: MappingNode, yaml_files: Mapping[str, Path]) -> MappingNode:
    """Return a scenario in which all paths of files are relative to `folder`.

    In `tree`, each path is relative to the folder of the YAML file that contains the path. `yaml_files` are the
    absolute paths of these YAML files, by path in messages.
    """
    start = Path(realpath(folder))
    for keys, (leaf, file) in _named_files(tree, yaml_files).items():
        if yaml_files[leaf.position.path].parent != start:
            tree = tree.with_value(keys, ScalarNode(leaf.position, relpath(file, start)), leaf.position)
    return tree


def _named_files(tree: Node, yaml_files: Mapping[str, Path]) -> dict[Keys, tuple[ScalarNode, Path]]:
    """Return the scalars that name existing files, and these files, by keys of the scalar.

    `yaml_files` is explained in `with_paths_relative_to`.
    """
    found = {}
    for keys, leaf in nodes_with_keys(tree):
        yaml_file = yaml_files.get(leaf.position.path)
        if isinstance(leaf, ScalarNode) and yaml_file is not None and (file := _existing_file(leaf, yaml_file.parent)):
            found[keys] = leaf, file
    return found


def _existing_file(leaf: ScalarNode, folder: Path) -> Path | None:
    """Return the existing file that the scalar `leaf` names relative to `folder`; None if there is none."""
    if not isinstance(leaf.value, str) or "." not in leaf.value or "\n" in leaf.value or len(leaf.value) > 4096:
        return None
    return path.resolve() if is_file(path := folder / leaf.value) else None


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
        waiting += [other for _, other in _named_files(tree, {file.name: file}).values()] if tree is not None else []
    return sorted(found)


def _with_path(text: str, leaf: ScalarNode, path: str) -> str:
    """Return the YAML text with `path` instead of the value of the scalar `leaf`."""
    position = leaf.position.line - 1, leaf.position.col - 1  # with an anchor, the scalar begins after it
    token = next(
        token
        for token in yaml.scan(text)
        if isinstance(token, yaml.ScalarToken) and (token.start_mark.line, token.start_mark.column) >= position
    )
    start = token.start_mark.index
    end = start + len(text[start : token.end_mark.index].rstrip())  # without the line breaks after a block scalar
    if token.style == '"':
        scalar = json.dumps(path, ensure_ascii=False)
    elif token.style == "'" or not _PLAIN_PATH.fullmatch(path):
        scalar = "'" + path.replace("'", "''") + "'"
    else:
        scalar = path
    return text[:start] + scalar + text[end:]
