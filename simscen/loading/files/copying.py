"""Copy a scenario with the files that it needs."""

import shutil
from collections.abc import Iterator
from os.path import commonpath, relpath
from pathlib import Path

from simscen.core.errors import UsageError
from simscen.loading.loaded import LoadedScenario
from simscen.loading.scenario_text import unexpanded_text
from simscen.loading.yaml.parser import parse_yaml
from simscen.loading.yaml.tree import MappingNode, Node, ScalarNode, SequenceNode

_MODELINE = "# yaml-language-server:"
_SEARCHED_SUFFIXES = (".yaml", ".yml")
_UNSEARCHED_SUFFIXES = (".sdf", ".world", ".urdf", ".xacro")
"""Formats that can refer to further files, but are not searched for them."""


def copy_scenario(loaded: LoadedScenario, target: Path, root: Path) -> list[Path]:
    """Copy a scenario to `target`, and the files it needs to a folder of the same name next to it; return the copies.

    If `target` is in the root of the scenario, the other files stay and only their paths are adapted. The text keeps
    its comments, except that a scenario that extends other files is merged with them. Raises UsageError if a file
    cannot be copied.
    """
    text, tree = _text_of(loaded)
    named = {leaf: _file_of(leaf, loaded) for leaf in _leaves(tree)}
    files = {leaf: file for leaf, file in named.items() if file is not None}
    needed = sorted({dependency for file in files.values() for dependency in _with_dependencies(file)})
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


def _text_of(loaded: LoadedScenario) -> tuple[str, Node]:
    """Return the text to copy, without the schema line for editors, and its tree."""
    lines = unexpanded_text(loaded).split("\n")
    text = "\n".join(line for line in lines if not line.startswith(_MODELINE))
    tree, _ = parse_yaml(text, loaded.path)
    assert tree is not None
    return text, tree


def _leaves(node: Node | None) -> Iterator[ScalarNode]:
    if isinstance(node, MappingNode):
        for entry in node.entries.values():
            yield from _leaves(entry.value)
    elif isinstance(node, SequenceNode):
        for item in node.items:
            yield from _leaves(item)
    elif isinstance(node, ScalarNode):
        yield node


def _file_of(leaf: ScalarNode, loaded: LoadedScenario) -> Path | None:
    """Return the file that a text names, relative to one of the files of the scenario."""
    return _existing_file(leaf, {file.parent for file in loaded.files.values()})


def _existing_file(leaf: ScalarNode, folders: set[Path]) -> Path | None:
    if not isinstance(leaf.value, str) or "." not in leaf.value or "\n" in leaf.value or len(leaf.value) > 4096:
        return None
    return next((file for folder in sorted(folders) if (file := (folder / leaf.value).resolve()).is_file()), None)


def _with_dependencies(file: Path, known: frozenset[Path] = frozenset()) -> Iterator[Path]:
    """Yield a file and the files that it names, recursively."""
    if file in known:
        return
    if file.name.endswith(_UNSEARCHED_SUFFIXES):
        raise UsageError(f"{file.name} may refer to models and meshes: copy its folder yourself")
    yield file
    if file.name.endswith(_SEARCHED_SUFFIXES):
        tree, _ = parse_yaml(file.read_text(encoding="utf-8"), file.name)
        for leaf in _leaves(tree):
            other = _existing_file(leaf, {file.parent})
            if other is not None:
                yield from _with_dependencies(other, known | {file})


def _with_path(text: str, leaf: ScalarNode, path: str) -> str:
    """Return the text with another path at the position of the leaf."""
    lines = text.split("\n")
    line, start = lines[leaf.position.line - 1], leaf.position.col - 1
    quote = line[start] if line[start] in "'\"" else ""
    end = start + len(quote) + len(str(leaf.value)) + len(quote)
    lines[leaf.position.line - 1] = f"{line[:start]}{quote}{path}{quote}{line[end:]}"
    return "\n".join(lines)
