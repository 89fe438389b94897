"""Tests of the documentation site: links, anchors, navigation, and no network requests."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
LINK = re.compile(r"(?<!!)\[[^\]]*\]\((?!https?:|#)([^)\s#]+)[^)]*\)|!\[[^\]]*\]\((?!https?:)([^)\s]+)\)")
ASKS = re.compile(
    r"<(?:script|img|iframe)[^>]*\ssrc=\"?(https?:[^\"> ]*)|<link[^>]*rel=\"?(?:stylesheet|preload)[^>]*(https?:)"
)
FRONT = sorted(path.name for path in ROOT.glob("*.md"))


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build the site as `make site` does. Without --quiet, because mkdocs then ignores warnings."""
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(folder)]
    env = {**os.environ, "NO_MKDOCS_2_WARNING": "1"}
    done = subprocess.run(command, cwd=ROOT, env=env, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return folder


def test_pages_are_built_and_load_nothing_from_the_network(site: Path) -> None:
    for page in (ROOT / "docs").rglob("*.md"):
        place = site / page.relative_to(ROOT / "docs")
        html = place.parent / "index.html" if page.stem == "index" else place.with_suffix("") / "index.html"
        text = html.read_text(encoding="utf-8")
        assert ASKS.findall(text) == []
        assert 'data-md-component="source"' not in text, "the theme asks api.github.com for what it shows there"


def test_links_outside_the_docs_lead_to_the_repository(site: Path) -> None:
    page = (site / "reference/scenarios/index.html").read_text(encoding="utf-8")
    assert 'href="https://github.com/simscen/simscen/blob/main/scenarios/faults/lidar_off.scenario.yaml"' in page
    page = (site / "tutorials/own-planner-and-stack/index.html").read_text(encoding="utf-8")
    assert 'href="https://github.com/simscen/simscen/tree/main/tests/plugins/theta_star"' in page


def test_search_index_contains_every_kind_of_page(site: Path) -> None:
    index = (site / "search/search_index.json").read_text(encoding="utf-8")
    assert all(f'"location":"{part}/' in index for part in ("guides/people", "reference/language", "design/lockstep"))


@pytest.mark.parametrize("name", FRONT)
def test_links_in_root_pages_exist(name: str) -> None:
    links = ["".join(match.groups("")) for match in LINK.finditer((ROOT / name).read_text(encoding="utf-8"))]
    assert [link for link in links if not (ROOT / link).exists()] == []
