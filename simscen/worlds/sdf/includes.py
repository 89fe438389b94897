"""What `<include>` brings in: model folders, single files, and the two models every Gazebo has."""

import os
from pathlib import Path

from simscen.assets.addresses import standard
from simscen.worlds.sdf import markup
from simscen.worlds.sdf.files import WORLD_BYTES, Library
from simscen.worlds.sdf.markup import Element
from simscen.worlds.sdf.report import Report, Unusable

NEWEST = (1, 12)
OLDEST = (1, 3)
BUILT_IN = {
    "sun": "<sdf version='1.6'><light name='sun' type='directional'/></sdf>",
    "ground_plane": "<sdf version='1.6'><model name='ground_plane'><static>1</static><link name='link'>"
    "<collision name='collision'><geometry><plane><normal>0 0 1</normal><size>100 100</size></plane></geometry>"
    "</collision></link></model></sdf>",
}
"""Gazebo installs these two itself and nearly every world includes them; a user need not have them."""


def version(element: Element) -> tuple[int, ...]:
    """The version attribute as numbers; (0,) when it is missing or no version."""
    return version_of(element.attributes.get("version", ""))


def version_of(text: str) -> tuple[int, ...]:
    """1.10 is newer than 1.9."""
    words = text.strip().split(".")
    return tuple(int(word) for word in words) if all(word.isdecimal() for word in words) else (0,)


def check_root(root: Element) -> None:
    """Raise Unusable unless this is the root of an SDF file of a version that is read."""
    if root.tag == "robot":
        raise root.unusable("this is a URDF, not an SDF", "use it as the model of a robot")
    if root.tag != "sdf":
        hint = "a <gazebo> is SDF 1.2 or older; rewrite it as <sdf version='1.6'>" if root.tag == "gazebo" else ""
        raise root.unusable(f"the root element is <{root.tag}>, expected <sdf>", hint)
    if not OLDEST <= version(root) <= (*NEWEST, 99):
        shown = root.attributes.get("version", "none")[:20]
        raise root.unusable(f"SDF version {shown} is not read, only 1.3 to 1.12")


class Shelf:
    """Opens included files once each and refuses circles."""

    def __init__(self, library: Library, report: Report) -> None:
        self.library, self._report = library, report
        self._roots: dict[str, Element] = {}
        self._chain: list[str] = []

    def open_world(self, path: Path) -> Element:
        """The root of the world file itself."""
        real, data = self.library.read_world(path)
        self._chain = [str(real)]
        root = markup.parse(data, self.library.shown(real), str(real.parent))
        check_root(root)
        return root

    def enter(self, include: Element) -> Element:
        """The root of what an `<include>` means; to be followed by `leave`. Raises Unusable."""
        uri = include.child("uri")
        if uri is None:
            raise include.unusable("<uri> is missing")
        path = self._file(uri)
        if path in self._chain:
            chain = [*self._chain[self._chain.index(path) :], path]
            raise uri.unusable("include cycle: " + " → ".join(self.library.shown(Path(p)) for p in chain))
        self._chain.append(path)
        try:
            return self._root(path, uri)
        except BaseException:
            self._chain.pop()
            raise

    def leave(self) -> None:
        """The include that was entered last is done."""
        self._chain.pop()

    def _root(self, file: str, uri: Element) -> Element:
        if file not in self._roots:
            if file in BUILT_IN:
                root = markup.parse(BUILT_IN[file].encode(), file, "")
            else:
                path = Path(file)
                data = self.library.read(path, uri, WORLD_BYTES)
                root = markup.parse(data, self.library.shown(path), str(path.parent))
            check_root(root)
            self._roots[file] = root
        return self._roots[file]

    def _file(self, uri: Element) -> str:
        try:
            found = self.library.locate(uri)
        except Unusable:
            own = standard(uri.text)
            if own is None:
                raise
            return own
        return str(self._in_folder(found, uri) if found.is_dir() else found)

    def _in_folder(self, folder: Path, uri: Element) -> Path:
        """The model in a folder; what is wrong with its model.config does not matter where there is a model.sdf."""
        config, plain = folder / "model.config", folder / "model.sdf"
        if not os.path.lexists(config):
            if os.path.lexists(plain):
                return plain
            raise uri.unusable(f"{self.library.shown(folder)}: neither model.config nor model.sdf in this folder")
        try:
            data = self.library.read(config, uri, WORLD_BYTES)
            return self.library.locate(best_version(markup.parse(data, self.library.shown(config), str(folder))))
        except Unusable as error:
            if not os.path.lexists(plain):
                raise
            self._report.note(error.place, f"{error.message}; model.sdf beside it is used")
            return plain


def best_version(config: Element) -> Element:
    """The `<sdf>` of a model.config with the newest version that is read, as sdformat chooses."""
    offers = [sdf for sdf in config.all("sdf") if sdf.text]
    fitting = [sdf for sdf in offers if version(sdf) <= (*NEWEST, 99)]
    if not fitting:
        raise config.unusable("no <sdf> of version 1.12 or older in this model.config")
    return max(fitting, key=version)
