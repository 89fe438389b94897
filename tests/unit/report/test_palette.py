"""Tests of the contrast and distinguishability of colors."""

import pytest

from simscen.report.picture import palette

TEXTS = ("ink", "quiet", "good", "bad", "odd", "link")


def luminance_of(color):
    """Return the relative luminance, as defined in WCAG 2.1."""
    parts = [part / 255 for part in color]
    r, g, b = (part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts)
    return 0.2126 * r + 0.7152 * g + 0.0722 * b


def contrast(color, other_color):
    """Return the contrast ratio of WCAG 2.1, from 1 to 21."""
    low, high = sorted((luminance_of(color), luminance_of(other_color)))
    return (high + 0.05) / (low + 0.05)


def rgb_of(text):
    """Return the color of a text `#rrggbb`."""
    return tuple(int(text[k : k + 2], 16) for k in (1, 3, 5))


def deuteranope(color):
    """Return a color as seen with deuteranopia (Viénot, Brettel and Mollon 1999, in linear light)."""
    r, g, b = ((part / 255) ** 2.2 for part in color)
    projected = (0.2928 * r + 0.7072 * g, 0.2928 * r + 0.7072 * g, -0.0223 * r + 0.0223 * g + b)
    return [max(0.0, part) ** (1 / 2.2) * 255 for part in projected]


@pytest.mark.parametrize("theme", [palette.LIGHT, palette.DARK])
@pytest.mark.parametrize("text", TEXTS)
def test_text_of_the_page_has_enough_contrast(theme, text):
    for background in ("page", "panel"):
        assert contrast(rgb_of(theme[text]), rgb_of(theme[background])) >= 4.5


@pytest.mark.parametrize("color", [palette.RED, palette.AMBER, palette.GREEN, palette.OBJECT, palette.PEDESTRIAN])
def test_text_of_the_picture_has_enough_contrast(color):
    assert contrast(color, palette.PAGE) >= 4.5


def test_pass_and_fail_colors_are_distinguishable_with_color_blindness():
    distance = (
        sum((a - b) ** 2 for a, b in zip(deuteranope(palette.GREEN), deuteranope(palette.RED), strict=True)) ** 0.5
    )
    assert distance > 60


def test_time_colors_become_lighter():
    steps = [luminance_of(palette.time_color(k / 8)) for k in range(9)]
    assert steps == sorted(steps)
