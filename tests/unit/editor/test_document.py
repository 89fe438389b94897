"""Tests that a save changes only the edited values, and does not overwrite changes by other programs."""

import stat
from pathlib import Path

import pytest

from simscen.core.errors import InvalidInput, UsageError
from simscen.editor.document import NEW_FILE_VERSION, Document, FileChanged
from simscen.loading.yaml.textfile import decode


@pytest.mark.parametrize("raw", [b"a: 1\nb: 2\n", b"a: 1\r\nb: 2\r\n", b"\xef\xbb\xbfa: 1\nb: 2", "a: ü\n".encode()])
def test_an_unchanged_text_is_saved_byte_for_byte(tmp_path: Path, raw: bytes) -> None:
    file = tmp_path / "a.yaml"
    file.write_bytes(raw)
    document = Document(file, "a.yaml")
    text, version = document.read()
    assert "\r" not in text
    assert document.save(text, version) == version
    assert file.read_bytes() == raw


def test_file_with_mixed_line_breaks_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "a.yaml"
    file.write_bytes(b"a: 1\r\nb: 2\n")
    with pytest.raises(InvalidInput, match="mixes kinds of line breaks"):
        Document(file, "a.yaml").read()


def test_file_that_changed_on_disk_is_not_overwritten(tmp_path: Path) -> None:
    file = tmp_path / "a.yaml"
    file.write_text("a: 1\n")
    document = Document(file, "a.yaml")
    _, version = document.read()
    file.write_text("a: 2\n")
    with pytest.raises(FileChanged, match="was changed by another program") as error:
        document.save("a: 3\n", version)
    assert error.value.content.text == "a: 2\n"
    assert file.read_text() == "a: 2\n"
    document.save("a: 3\n", error.value.content.version)
    assert file.read_text() == "a: 3\n"


def test_new_file_does_not_overwrite_a_file_created_meanwhile(tmp_path: Path) -> None:
    file = tmp_path / "a.yaml"
    document = Document(file, "a.yaml")
    file.write_text("theirs\n")
    with pytest.raises(FileChanged, match="was created"):
        document.save("mine\n", NEW_FILE_VERSION)
    file.unlink()
    version = document.save("mine\n", NEW_FILE_VERSION)
    file.unlink()
    with pytest.raises(FileChanged, match="was deleted"):
        document.save("mine\n", version)
    document.save("mine\n", version, overwrite=True)
    assert file.read_text() == "mine\n"


def test_saving_keeps_the_permissions_of_the_file(tmp_path: Path) -> None:
    file = tmp_path / "a.yaml"
    file.write_text("a: 1\n")
    file.chmod(0o640)
    document = Document(file, "a.yaml")
    document.save("a: 2\n", document.read().version)
    assert stat.S_IMODE(file.stat().st_mode) == 0o640
    assert [path.name for path in tmp_path.iterdir()] == ["a.yaml"]


def test_missing_folder_is_an_error_with_a_reason(tmp_path: Path) -> None:
    blocked = tmp_path / "file"
    blocked.write_text("")
    with pytest.raises(UsageError, match="cannot be written"):
        Document(blocked / "a.yaml", "a.yaml").save("a: 1\n", NEW_FILE_VERSION)


def test_file_that_changes_while_it_is_read_is_not_overwritten(tmp_path: Path, monkeypatch) -> None:
    file = tmp_path / "a.yaml"
    file.write_text("mine\n")
    document = Document(file, "a.yaml")

    def decode_slowly(raw: bytes, display_name: str) -> object:
        file.write_text("theirs\n")
        return decode(raw, display_name)

    monkeypatch.setattr("simscen.editor.document.decode", decode_slowly)
    text, version = document.read()
    assert text == "mine\n"
    with pytest.raises(FileChanged) as error:
        document.save("mine, edited\n", version)
    assert error.value.content.text == "theirs\n"
    assert file.read_text() == "theirs\n"


def test_file_that_is_deleted_while_it_is_read_keeps_the_content_that_was_read(tmp_path: Path, monkeypatch) -> None:
    file = tmp_path / "a.yaml"
    file.write_text("a: 1\n")

    def decode_after_deletion(raw: bytes, display_name: str) -> object:
        file.unlink()
        return decode(raw, display_name)

    monkeypatch.setattr("simscen.editor.document.decode", decode_after_deletion)
    assert Document(file, "a.yaml").read().text == "a: 1\n"


def test_unreadable_file_is_not_replaced_by_a_new_one(tmp_path: Path, monkeypatch) -> None:
    file = tmp_path / "a.yaml"
    file.write_text("theirs\n")

    def refuse(path: Path) -> bytes:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "read_bytes", refuse)
    with pytest.raises(UsageError, match=r"a\.yaml: cannot be read: Permission denied"):
        Document(file, "a.yaml").save("mine\n", NEW_FILE_VERSION)
    assert file.read_text() == "theirs\n"


def test_text_with_a_lone_surrogate_is_not_saved(tmp_path: Path) -> None:
    file = tmp_path / "a.yaml"
    with pytest.raises(UsageError, match=r"U\+D800 is not a valid character"):
        Document(file, "a.yaml").save("x: \ud800\n", NEW_FILE_VERSION)
    assert not file.exists()
