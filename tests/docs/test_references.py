"""Tests that docs/references.bib contains exactly the cited sources."""

import calendar
import re
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[2]
SOURCES = [
    path
    for folder in ("simscen", "docs")
    for path in sorted((ROOT / folder).rglob("*"))
    if path.suffix in (".py", ".md") and path.name != "language.md"  # generated from docstrings
]
ENTRY = re.compile(r"^@\w+\{(\w+),\n(.*?)^\}", re.MULTILINE | re.DOTALL)
FIELD = re.compile(r"^  (\w+) = \{(.*)\},$", re.MULTILINE)
NAME, YEAR = r"((?:van )?[A-ZÉŞÖ][\w'’-]+)", r"((?:19|20)\d\d)\b"
OTHERS = r"(?:(?:, [A-ZÉŞ][\w-]+)* (?:and|&) [A-ZÉŞ][\w-]+| et\s?al\.)"
CITED = (
    re.compile(rf"(?<![\w*]){NAME}{OTHERS}?,? \(?{YEAR}"),  # Fox et al. 1997, Hall (1966)
    re.compile(rf"(?<![\w*]){NAME}{OTHERS},[^.;|]{{3,110}}?\b{YEAR}"),  # Walsh & Karaman, CDDT (ICRA 2018)
    re.compile(
        rf"(?<![\w*]){NAME}, \*?[A-Z][^.;|()]{{8,110}}?\(?(?:[A-Z][\w-]* )*\d*,? ?\(?{YEAR}"
    ),  # Olson, A title, 2009
)
NO_AUTHORS = {*calendar.month_name, "REP"}
"""Words before numbers that are not years of publications."""
ENTRIES = {key: dict(FIELD.findall(body)) for key, body in ENTRY.findall((ROOT / "docs/references.bib").read_text())}


def citations() -> Iterator[tuple[str, str, str]]:
    """Yield file, name (or the word of title or venue before the year), and year."""
    for path in SOURCES:
        text = re.sub(r"\s+", " ", path.read_text(encoding="utf-8"))
        for pattern in CITED:
            for name, year in pattern.findall(text):
                if name not in NO_AUTHORS:
                    yield path.relative_to(ROOT).as_posix(), name, year


def test_each_citation_has_an_entry() -> None:
    known = {(word, entry["year"]) for entry in ENTRIES.values() for word in words(entry)}
    cited = set(citations())
    assert sorted(one for one in cited if one[1:] not in known) == []
    assert len(cited) > 100


def words(entry: dict[str, str]) -> set[str]:
    """Return the words that can precede the year: authors, words of the title, venues."""
    text = " ".join(entry.values())
    return {*re.findall(r"[^\W\d_][\w'’-]+", text), *re.findall(r"van \w+", text)}


def test_each_entry_is_cited_and_has_a_publisher_or_address() -> None:
    text = " ".join(path.read_text(encoding="utf-8") for path in SOURCES)
    used = set(re.findall(r"[^\W\d_]+", text))
    first = {key: entry["author"].partition(",")[0] for key, entry in ENTRIES.items()}
    assert [key for key, name in first.items() if not used.issuperset(re.findall(r"[^\W\d_]+", name))] == []
    for key, entry in ENTRIES.items():
        assert {"journal", "booktitle", "publisher", "school", "institution", "eprint", "howpublished"} & set(entry), (
            key
        )
        assert key.endswith(entry["year"])
    assert list(ENTRIES) == sorted(ENTRIES, key=lambda key: (re.sub(r"\d", "", key), key))
