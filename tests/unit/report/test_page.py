import re
from dataclasses import replace
from html.parser import HTMLParser

from PIL import Image

from simscen.core.result import RunKey
from simscen.core.sessionevents import Artifacts
from simscen.report import page
from simscen.report.page import to_html


def of(run, **changes):
    """The run with another result."""
    return replace(run, result=replace(run.result, **changes))


class Tags(HTMLParser):
    def __init__(self):
        super().__init__()
        self.seen, self.open = [], []

    def handle_starttag(self, tag, attributes):
        self.seen.append((tag, dict(attributes)))
        if tag not in ("meta", "img"):
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


def parsed(html):
    tags = Tags()
    tags.feed(html)
    assert tags.open == []
    return tags.seen


def test_what_did_not_pass_comes_first_and_stands_open(passed, failed, crashed):
    html = to_html([passed, failed, crashed])
    details = [attributes for tag, attributes in parsed(html) if tag == "details"]
    assert ["open" in attributes for attributes in details] == [True, True, False]
    assert "<h1>1 passed, 1 failed, 1 error</h1>" in html
    assert "drove 0.31 m blind" in html


def test_text_from_outside_makes_no_live_tag(passed, crashed):
    evil = replace(of(passed, key=RunKey("<script>alert(1)</script>", 1)), again='"><img src=x onerror=y>')
    html = to_html([evil, crashed])
    assert {tag for tag, _ in parsed(html)}.isdisjoint({"script", "img"})
    assert "&lt;script&gt;" in html
    assert not re.search("\x1b", html)


def test_the_picture_is_inside_the_page(failed, tmp_path):
    path = tmp_path / "map.png"
    Image.new("RGB", (4, 4)).save(path)
    html = to_html([replace(failed, artifacts=Artifacts(picture=str(path)))])
    (image,) = [attributes for tag, attributes in parsed(html) if tag == "img"]
    assert image["src"].startswith("data:image/png;base64,")


def test_a_picture_that_is_gone_is_left_out(failed):
    assert "<img" not in to_html([failed])


def test_pictures_fill_the_page_only_so_far_and_those_of_failures_first(passed, failed, tmp_path, monkeypatch):
    picture = tmp_path / "map.png"
    Image.new("L", (8, 8)).save(picture)
    monkeypatch.setattr(page, "PICTURE_BYTES", picture.stat().st_size)
    runs = [replace(run, artifacts=Artifacts(picture=str(picture))) for run in (passed, failed)]
    html = to_html(runs)
    assert [tag for tag, _ in parsed(html)].count("img") == 1
    assert html.index("<img") < html.index(f"picture: <code>{picture}")
