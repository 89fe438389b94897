"""The filter masks that criteria judge by."""

from collections.abc import Mapping

from pydantic import BaseModel

from simscen.loading.assets import Assets
from simscen.loading.loaded import JudgedMask
from simscen.loading.references import references
from simscen.loading.tree import Fields, Leaf, at


def judged_masks(spec: BaseModel, tree: Fields, assets: Assets) -> Mapping[str, JudgedMask]:
    """The masks that the criteria below `pass` name, by their files as written; what is wrong goes to `assets`.

    A list is never merged with another, so all of them are written in one file, and one name is one mask.
    """
    found: dict[str, JudgedMask] = {}
    for reference in references(spec):
        node = at(tree, reference.keys)
        if reference.to == "mask" and reference.keys[0] == "pass" and isinstance(node, Leaf):
            loaded = assets.map(node)
            if loaded is not None:
                found.setdefault(reference.name, JudgedMask(reference.keys, loaded))
    return found
