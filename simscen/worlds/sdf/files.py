"""Find and read the files that an SDF world refers to by URI, and parse included models."""

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from simscen.assets.folders import AllowedFolders, NoSuchFile, UnusableFile
from simscen.assets.uris import parse_fuel_uri
from simscen.worlds.sdf.elements import Element, parse
from simscen.worlds.sdf.report import ImportReport, MissingAsset, SourceLocation, UnusableElement

MODEL_FILES = ("model.config", "model.sdf")
"""Names of files. The folder of a model contains at least one of these files."""
MAX_WORLD_BYTES = 20 * 2**20
MAX_MESH_BYTES = 64 * 2**20
MAX_SHOWN_URI_LENGTH = 1000
MAX_VERSION_DIGITS = 9
"""Maximum number of digits of each part of an SDF version."""
OLDEST_VERSION, NEWEST_VERSION = (1, 3), (1, 12)
_NEWEST_PATCH = (*NEWEST_VERSION, 99)
"""Upper bound of patch versions such as 1.12.1."""
BUILT_IN_MODELS = {
    "sun": "<sdf version='1.6'><light name='sun' type='directional'/></sdf>",
    "ground_plane": "<sdf version='1.6'><model name='ground_plane'><static>1</static><link name='link'>"
    "<collision name='collision'><geometry><plane><normal>0 0 1</normal><size>100 100</size></plane></geometry>"
    "</collision></link></model></sdf>",
}
"""SDF of models that Gazebo installs, used if they are not in the allowed folders."""


class WorldFiles(AllowedFolders):
    """Folders that the files of an SDF world must be in. Errors name the element that refers to the file."""

    def locate(self, element: Element, is_preferred: Callable[[Path], bool] = lambda _: True) -> Path:
        """Return the real path of the file or folder that a `<uri>` refers to; for `is_preferred`, see `find`.

        Raises MissingAsset if the file does not exist, and UnusableElement if it must not be used.
        """
        uri = element.text
        try:
            return self.find(uri, Path(element.source.folder), allow_absolute=True, is_preferred=is_preferred)
        except NoSuchFile as error:
            raise MissingAsset(element.location, f"{uri}: {error}", error.hint) from error
        except UnusableFile as error:
            can_show_uri = uri.isprintable() and uri and len(uri) <= MAX_SHOWN_URI_LENGTH
            raise element.unusable(f"{uri}: {error}" if can_show_uri else str(error), error.hint) from error

    def read(self, path: Path, element: Element, max_bytes: int) -> bytes:
        """Return the content of a file that `element` refers to, found by `locate`. Raises UnusableElement."""
        try:
            return self.read_file(path, max_bytes)[1]
        except UnusableFile as error:
            raise element.unusable(f"{self.display_path(path)}: {error}") from error

    def read_world(self, path: Path) -> tuple[Path, bytes]:
        """Return the real path and the content of the world file itself. Raises UnusableElement."""
        try:
            return self.read_file(self.resolve_parent(path), MAX_WORLD_BYTES)
        except UnusableFile as error:
            raise UnusableElement(SourceLocation(path.name), str(error)) from error


class IncludedFiles:
    """Parses the world file and the files that `<include>` refers to, each only once. Rejects include cycles."""

    def __init__(self, files: WorldFiles, report: ImportReport) -> None:
        self._files, self._report = files, report
        self._roots: dict[str, Element] = {}
        self._open_paths: list[str] = []

    def open_world(self, path: Path) -> Element:
        """Return the root element of the world file. Raises UnusableElement."""
        real_path, data = self._files.read_world(path)
        self._open_paths = [str(real_path)]
        root = parse(data, self._files.display_path(real_path), str(real_path.parent))
        _check_root(root)
        return root

    @contextmanager
    def open_include(self, include: Element) -> Iterator[Element]:
        """Yield the root element of the file that an `<include>` refers to. Raises UnusableElement.

        The file counts as open during the `with` block, in which it must not be included again.
        """
        uri = include.child("uri")
        if uri is None:
            raise include.unusable("<uri> is missing")
        path = self._path_or_builtin_name(uri)
        if path in self._open_paths:
            cycle = [*self._open_paths[self._open_paths.index(path) :], path]
            raise uri.unusable("include cycle: " + " → ".join(self._files.display_path(Path(p)) for p in cycle))
        if path not in self._roots:
            self._roots[path] = self._read_root(path, uri)
        self._open_paths.append(path)
        try:
            yield self._roots[path]
        finally:
            self._open_paths.pop()

    def _read_root(self, path: str, uri: Element) -> Element:
        """Return the root element of the file `path` or of a built-in model. `uri` is the element that refers to it."""
        if path in BUILT_IN_MODELS:
            root = parse(BUILT_IN_MODELS[path].encode(), path, "")
        else:
            file = Path(path)
            data = self._files.read(file, uri, MAX_WORLD_BYTES)
            root = parse(data, self._files.display_path(file), str(file.parent))
        _check_root(root)
        return root

    def _path_or_builtin_name(self, uri: Element) -> str:
        """Return the path of the SDF file that a `<uri>` refers to, or a key of BUILT_IN_MODELS if it is not found."""
        try:
            found = self._files.locate(uri, _is_model)
        except UnusableElement:
            builtin = _model_name(uri.text)
            if builtin not in BUILT_IN_MODELS:
                raise
            return builtin
        return str(self._model_in_folder(found, uri) if found.is_dir() else found)

    def _model_in_folder(self, folder: Path, uri: Element) -> Path:
        """Return the SDF file named in model.config, or model.sdf if model.config is missing or unusable."""
        config, model = (folder / name for name in MODEL_FILES)
        if not os.path.lexists(config):
            if os.path.lexists(model):
                return model
            raise uri.unusable(f"{self._files.display_path(folder)}: neither model.config nor model.sdf in this folder")
        try:
            data = self._files.read(config, uri, MAX_WORLD_BYTES)
            return self._files.locate(_newest_sdf(parse(data, self._files.display_path(config), str(folder))))
        except UnusableElement as error:
            if not os.path.lexists(model):
                raise
            self._report.note(error.location, f"{error.message}; model.sdf in the same folder is used")
            return model


def _is_model(path: Path) -> bool:
    """Return whether a path is a file, or the folder of a model instead of another folder with the same name."""
    return not path.is_dir() or any(os.path.lexists(path / name) for name in MODEL_FILES)


def _model_name(uri: str) -> str:
    """Return the normalized name of the model that a model:// or Fuel URI of Open Robotics refers to, otherwise ""."""
    address = parse_fuel_uri(uri)
    if address is None:
        name = uri.removeprefix("model://").strip("/") if uri.startswith("model://") else ""
    else:
        name = address.name if address.owner.lower().replace(" ", "") == "openrobotics" and not address.rest else ""
    return name.lower().replace(" ", "_")


def _newest_sdf(config: Element) -> Element:
    """Return the `<sdf>` with the newest supported version in a model.config."""
    supported = [sdf for sdf in config.all("sdf") if sdf.text and _version(sdf) <= _NEWEST_PATCH]
    if not supported:
        raise config.unusable("no <sdf> of version 1.12 or older in this model.config")
    return max(supported, key=_version)


def _check_root(root: Element) -> None:
    """Raise UnusableElement if `root` is not the root element of an SDF file of a supported version."""
    if root.tag == "robot":
        raise root.unusable("this is a URDF, not an SDF", "use it as the model of a robot")
    if root.tag != "sdf":
        hint = "a <gazebo> is SDF 1.2 or older; rewrite it as <sdf version='1.6'>" if root.tag == "gazebo" else ""
        raise root.unusable(f"the root element is <{root.tag}>, expected <sdf>", hint)
    if not OLDEST_VERSION <= _version(root) <= _NEWEST_PATCH:
        shown = root.attributes.get("version", "none")[:20]
        raise root.unusable(f"SDF version {shown} is not read, only 1.3 to 1.12")


def _version(element: Element) -> tuple[int, ...]:
    """Return the `version` attribute as numbers, because 1.10 is newer than 1.9; (0,) if it is missing or invalid."""
    words = element.attributes.get("version", "").strip().split(".")
    is_valid = all(word.isdecimal() and len(word) <= MAX_VERSION_DIGITS for word in words)
    return tuple(int(word) for word in words) if is_valid else (0,)
