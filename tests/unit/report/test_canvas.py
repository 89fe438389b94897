"""Tests of shapes on the canvas of pictures."""

import numpy as np
import pytest

from simscen.report.picture.canvas import MAX_ELLIPSE_RADIUS_PX, SUPERSAMPLING, Canvas

WHITE, RED, BLUE = (255, 255, 255), (255, 0, 0), (0, 0, 255)


def disc_pixels(x: float, radius_px: float) -> np.ndarray:
    """Return the pixels of a canvas of 10 m x 10 m, 50 pixels per meter, with a disc at (x, 5)."""
    canvas = Canvas((0.0, 0.0, 10.0, 10.0), 50.0, WHITE)
    image = canvas._image
    canvas.disc(x, 5.0, radius_px, RED, BLUE, 1.0, blocks_labels=True)
    return np.asarray(image)


@pytest.mark.parametrize("radius_px", [MAX_ELLIPSE_RADIUS_PX, MAX_ELLIPSE_RADIUS_PX + 1, 1e6])
def test_edge_of_a_large_disc_is_exact(radius_px: float) -> None:
    row = disc_pixels(5.0 - radius_px / 50.0, radius_px)[500]
    edge = 5 * 50 * SUPERSAMPLING
    assert row[edge - 8].tolist() == list(RED)
    assert row[edge + 8].tolist() == list(WHITE)


def test_a_disc_of_kilometers_covers_the_canvas() -> None:
    assert (disc_pixels(5.0, 1e6) == RED).all()


@pytest.mark.parametrize("is_rising", [False, True])
def test_hatching_of_several_polygons_is_aligned(is_rising: bool) -> None:
    square = np.array([[1.0, 1.0], [9.0, 1.0], [9.0, 9.0], [1.0, 9.0]])

    def hatched_pixels(*outlines: np.ndarray) -> np.ndarray:
        canvas = Canvas((0.0, 0.0, 10.0, 10.0), 50.0, WHITE)
        for outline in outlines:
            canvas.hatch([outline], (*RED, 255), is_rising)
        return np.asarray(canvas._image)

    lower, upper = square.copy(), square.copy()
    lower[2:, 1] = upper[:2, 1] = 3.37
    hatched_parts, hatched_square = hatched_pixels(lower, upper), hatched_pixels(square)
    assert (hatched_parts != hatched_square).any(axis=-1).mean() < 0.002  # only pixels along the common edge differ
