"""Checks of the style guide (CONTRIBUTING.md)."""

import re
from collections import Counter
from pathlib import Path

SIMSCEN = Path(__file__).parents[2] / "simscen"
MODULES = sorted(SIMSCEN.rglob("*.py"))
MAX_FILES = 20
REGISTRIES = frozenset({"cli/commands"})
"""Folders with one file for each name that users see; they may have any number of files."""
LARGER_FOLDERS = {"model": 25}
"""Folders that are still to be divided. The numbers may only fall."""
PREPOSITIONS = re.compile(
    r"about|above|across|after|against|ahead|along|among|around|at|away|before|behind|below|beneath|"
    r"beside|between|beyond|by|down|during|for|from|in|inside|into|near|of|off|on|onto|out|outside|over|"
    r"past|since|through|to|toward|under|until|up|upon|with|within|without"
)
PARTICIPLES = re.compile(r"told|foreseen|known|seen|heard|made|laden|standing|underway|watched|decoded|resolved")
ALLOWED = frozenset({"loading/resolved.py"})
"""Modules that are still to be renamed."""


def test_no_module_is_named_by_a_preposition_or_a_participle() -> None:
    names = {path.relative_to(SIMSCEN).as_posix(): path.stem for path in MODULES}
    wrong = {path for path, name in names.items() if PREPOSITIONS.fullmatch(name) or PARTICIPLES.fullmatch(name)}
    assert wrong <= ALLOWED


def test_a_folder_has_few_files() -> None:
    counts = Counter(path.parent.relative_to(SIMSCEN).as_posix() for path in MODULES if path.stem != "__init__")
    limits = {folder: LARGER_FOLDERS.get(folder, MAX_FILES) for folder in counts.keys() - REGISTRIES}
    assert {folder: counts[folder] for folder, limit in limits.items() if counts[folder] > limit} == {}
