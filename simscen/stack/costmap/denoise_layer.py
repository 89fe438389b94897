"""Denoise layer: removes small groups of obstacle cells (nav2_costmap_2d)."""

import numpy as np

from simscen.model.costmaps import DenoiseLayer
from simscen.stack.costmap.static_layer import Mask


def without_specks(marked: Mask, walls: Mask, spec: DenoiseLayer) -> Mask:
    """Return the marked cells (rows, columns) without groups smaller than `minimal_group_size`.

    Cells of walls, which are no noise, count as members of a group and stay what they are.
    """
    from scipy.ndimage import label

    if spec.minimal_group_size <= 1 or not marked.any():
        return marked
    corners = 1 if spec.group_connectivity_type == 8 else 0
    joined = np.array([[corners, 1, corners], [1, 1, 1], [corners, 1, corners]])
    groups, _ = label(marked | walls, joined)
    sizes = np.bincount(groups.ravel())
    kept: Mask = marked & (sizes[groups] >= spec.minimal_group_size)
    return kept
