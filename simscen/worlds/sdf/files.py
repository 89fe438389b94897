"""The files that an SDF file names; what is wrong with them is said at the element that asks for them."""

from pathlib import Path

from simscen.assets.folders import Absent, Folders, Trouble
from simscen.worlds.sdf.markup import Element
from simscen.worlds.sdf.report import Missing, Place, Unusable

WORLD_BYTES = 20 * 2**20
MESH_BYTES = 64 * 2**20
LONGEST_TOLD = 1000


class Library(Folders):
    """Finds and reads files for elements."""

    def locate(self, element: Element) -> Path:
        """The real path of what a `<uri>` means; raises Unusable."""
        uri = element.text
        try:
            return self.find(uri, Path(element.source.folder), absolute=True)
        except Absent as absent:
            raise Missing(element.place, f"{uri}: {absent}", absent.hint, uri) from absent
        except Trouble as trouble:
            told = uri.isprintable() and uri and len(uri) <= LONGEST_TOLD
            raise element.unusable(f"{uri}: {trouble}" if told else str(trouble), trouble.hint) from trouble

    def read(self, path: Path, element: Element, limit: int) -> bytes:
        """The bytes of a located file; raises Unusable at the element that asked for it."""
        try:
            return self.open(path, limit)[1]
        except Trouble as trouble:
            raise element.unusable(f"{self.shown(path)}: {trouble}") from trouble

    def read_world(self, path: Path) -> tuple[Path, bytes]:
        """Real path and bytes of the world itself; raises Unusable for the file as a whole."""
        try:
            return self.open(self.named(path), WORLD_BYTES)
        except Trouble as trouble:
            raise Unusable(Place(path.name), str(trouble)) from trouble
