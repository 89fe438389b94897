"""Test that the fingerprint of a plug-in follows changes of its files within one process (`--watch`)."""

from simscen.run.reproducibility import plugin_fingerprints
from simscen.spec.registry import RegisteredType


def test_a_changed_file_of_a_plugin_changes_its_fingerprint(tmp_path, monkeypatch):
    package = tmp_path / "own_criteria"
    package.mkdir()
    (package / "__init__.py").write_text("")
    (package / "limits.py").write_text("LIMIT = 1\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    entry = RegisteredType("simscen.criteria", "own", "own_criteria.limits:Own", "own-criteria", "1.0")
    before = plugin_fingerprints([entry])
    assert plugin_fingerprints([entry]) == before
    (package / "limits.py").write_text("LIMIT = 20\n")
    assert plugin_fingerprints([entry]) != before
