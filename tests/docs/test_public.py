"""Tests that files refer only to documents in the repository."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
FOLDERS = ("docs", "scenarios", "simscen", "tests", "worlds")
KINDS = {".py", ".md", ".yaml", ".yml", ".toml", ".js", ".css", ".html", ".bib"}
FILES = [
    *(
        path
        for path in ROOT.iterdir()
        if path.is_file() and (path.suffix in KINDS or path.name in ("Makefile", "Dockerfile"))
    ),
    *(path for folder in FOLDERS for path in (ROOT / folder).rglob("*") if path.suffix in KINDS),
]
DOCUMENT = re.compile(r"(?<![\w./])(?:\.\./)*((?:[\w.-]+/)*[A-Z][A-Z0-9_]{2,}\.md)\b")
"""Documents with names in capitals, such as README.md."""
TICKET = re.compile(r"\bissues? #?\d+\b", re.IGNORECASE)
PLACE = re.compile(r"(?<![\w.}$\"'=:])/(?:work|root)/\w|/home/(?!me\b|user\b|u\b)[a-z]+/\w")


def texts() -> list[tuple[Path, str]]:
    own = Path(__file__).name
    return [(path, path.read_text(encoding="utf-8", errors="ignore")) for path in FILES if path.name != own]


def test_cited_documents_exist() -> None:
    missing = []
    for path, text in texts():
        for name in DOCUMENT.findall(text):
            if not any(
                (folder / name).exists() for folder in (ROOT, path.parent, ROOT / "docs", ROOT / "tests/conformance")
            ):
                missing.append(f"{path.relative_to(ROOT)}: {name}")
    assert missing == []


def test_no_issue_numbers_or_machine_paths_in_files() -> None:
    found = [
        f"{path.relative_to(ROOT)}: {match}"
        for path, text in texts()
        for pattern in (TICKET, PLACE)
        for match in pattern.findall(text)
    ]
    assert found == []
