"""Tests of the editor server, which answers only its own page."""

import http.client
import json
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from simscen.editor.document import EditedFile
from simscen.editor.server import MAX_REQUEST_BYTES, EditorServer
from simscen.editor.session import EditorSession
from simscen.run.process.jobs import Backend

POLL_INTERVAL_S = 0.01
"""Maximum time in s until the server notices `shutdown`; the default is 0.5 s."""
TEXT = "simscen: 1\nworld: {simscen: 1}\nrobot: {pose: {x: 1, y: 1}}\ngoals: [{pose: {x: 3, y: 1}}]\npass: []\n"


def _no_backend() -> Backend:
    raise AssertionError("no run starts in these tests")


@pytest.fixture
def server(tmp_path: Path) -> Iterator[EditorServer]:
    """Yield a running server for a scenario in a folder with another file."""
    file = tmp_path / "a.scenario.yaml"
    file.write_text(TEXT)
    (tmp_path / "secret.txt").write_text("secret")
    editor_server = EditorServer(EditorSession(EditedFile(file, "scenario", tmp_path), _no_backend))
    threading.Thread(target=editor_server.serve_forever, args=(POLL_INTERVAL_S,), daemon=True).start()
    yield editor_server
    editor_server.shutdown()
    editor_server.server_close()
    editor_server.stop_runs()


class Reply:
    """Status, headers, and body of an HTTP response."""

    def __init__(self, answer: http.client.HTTPResponse) -> None:
        self.status, self.headers, self.body = answer.status, answer.headers, answer.read()

    @property
    def data(self) -> Any:
        return json.loads(self.body)


def request(server: EditorServer, method: str, path: str, body: Any = None, **headers: str) -> Reply:
    """Send an HTTP request with bytes or JSON as body; an underscore in a header name stands for a hyphen."""
    connection = http.client.HTTPConnection("127.0.0.1", server.server_port, timeout=10)
    all_headers = {name.replace("_", "-"): value for name, value in headers.items()}
    data = None
    if body is not None:
        data = body if isinstance(body, bytes) else json.dumps(body).encode()
        all_headers.setdefault("Content-Type", "application/json")
    connection.request(method, path, data, all_headers)
    try:
        return Reply(connection.getresponse())
    finally:
        connection.close()


def ask(server: EditorServer, name: str, **data: Any) -> Reply:
    """Send a request of the page."""
    return request(server, "POST", f"/{server.token}/api/{name}", data)


def test_server_listens_only_on_this_machine_at_a_random_port_with_a_random_token(server: EditorServer) -> None:
    assert server.server_address[0] == "127.0.0.1"
    assert server.url == f"http://127.0.0.1:{server.server_port}/{server.token}/"
    assert len(server.token) >= 32


@pytest.mark.parametrize("path", ["/", "/page.html", "/wrong/", "/wrong/page.js", "//", "/../", "/%2e%2e/page.html"])
def test_request_without_the_token_is_refused(server: EditorServer, path: str) -> None:
    assert request(server, "GET", path).status == 403
    answer = request(server, "POST", f"{path}api/open", {})
    assert answer.status == 403 and TEXT not in answer.body.decode()


@pytest.mark.parametrize("host", ["example.org", "127.0.0.1", "localhost:1", "attacker.test:80", ""])
def test_another_host_name_is_refused_also_with_the_token(server: EditorServer, host: str) -> None:
    assert request(server, "GET", f"/{server.token}/", Host=host).status == 421


def test_a_page_from_another_origin_is_refused(server: EditorServer) -> None:
    path = f"/{server.token}/api/open"
    assert request(server, "POST", path, {}, Origin="https://example.org").status == 403
    assert request(server, "POST", path, {}, Origin="null").status == 403
    assert request(server, "POST", path, {}, Origin=server.url[: server.url.index(server.token) - 1]).status == 200


def test_a_form_of_another_page_cannot_send_requests(server: EditorServer) -> None:
    answer = request(server, "POST", f"/{server.token}/api/open", {}, Content_Type="text/plain")
    assert answer.status == 415


@pytest.mark.parametrize("name", ["", "page.html", "page.css", "main.js", "camera.js"])
def test_every_file_comes_with_a_strict_policy(server: EditorServer, name: str) -> None:
    answer = request(server, "GET", f"/{server.token}/{name}")
    policy = answer.headers["Content-Security-Policy"]
    assert answer.status == 200 and answer.body
    assert policy.startswith("default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'")
    assert "frame-ancestors 'none'" in policy and "unsafe" not in policy and "http" not in policy
    assert answer.headers["X-Content-Type-Options"] == "nosniff"
    assert answer.headers["Referrer-Policy"] == "no-referrer"
    assert answer.headers["Cache-Control"] == "no-store"
    assert "Access-Control-Allow-Origin" not in answer.headers


@pytest.mark.parametrize(
    "path",
    ["../secret.txt", "..%2fsecret.txt", "a.scenario.yaml", "/etc/passwd", "..\\secret.txt", "runs/1/replay.html",
     "runs/../../secret.txt", "runs/1/../../secret.txt", "page.html/../secret.txt", "api/open"],
)  # fmt: skip
def test_no_path_leads_to_other_files(server: EditorServer, path: str) -> None:
    assert request(server, "GET", f"/{server.token}/{path}").status == 404


@pytest.mark.parametrize("body", [b"", b"[]", b"nonsense", b"\xff\xfe", b'{"text": 1}', b"[" * 100_000, b"1e999"])
def test_malformed_request_is_a_client_error(server: EditorServer, body: bytes) -> None:
    for name in ("scene", "problems", "edit", "form", "preview", "save"):
        assert 400 <= request(server, "POST", f"/{server.token}/api/{name}", body).status < 500
    assert ask(server, "open").status == 200


@pytest.mark.parametrize(
    "edits",
    [
        None,
        [1],
        [{}],
        [{"op": "set"}],
        [{"op": "set", "keys": [-1]}],
        [{"op": "pose", "keys": ["robot", "pose"], "x": "1"}],
        [{"op": "remove", "keys": []}],
        [{"op": "remove", "keys": ["nowhere"]}],
        [{"op": "explode", "keys": []}],
        [{"op": "add", "keys": ["robot"], "value": 1}],
        [{"op": "set", "keys": ["goals", 7], "value": 1}],
    ],
)
def test_an_impossible_edit_is_refused_with_a_reason(server: EditorServer, edits: Any) -> None:
    answer = ask(server, "edit", text=TEXT, edits=edits)
    assert answer.status == 422 and answer.data["error"]


def test_a_request_that_is_too_large_is_refused(server: EditorServer) -> None:
    path = f"/{server.token}/api/open"
    assert request(server, "POST", path, b"", Content_Length=str(MAX_REQUEST_BYTES + 1)).status == 413
    assert ask(server, "scene", text="a: " + "x" * (1 << 20)).status == 413


@pytest.mark.parametrize("length", ["9" * 5000, "٣", "-1", ""])
def test_a_request_with_an_invalid_length_is_refused(server: EditorServer, length: str) -> None:
    connection = http.client.HTTPConnection("127.0.0.1", server.server_port, timeout=10)
    connection.putrequest("POST", f"/{server.token}/api/open")
    connection.putheader("Content-Length", length.encode())
    connection.endheaders()
    assert connection.getresponse().status == 413
    connection.close()


def test_a_number_with_too_many_digits_is_not_json(server: EditorServer) -> None:
    answer = request(server, "POST", f"/{server.token}/api/open", b'{"a": ' + b"9" * 5000 + b"}")
    assert (answer.status, answer.data["error"]) == (400, "the request is not JSON")


def test_an_error_in_a_request_handler_is_not_blamed_on_the_request(server: EditorServer, capfd) -> None:
    def recurse(request: Any) -> Any:
        raise RecursionError

    server.session.requests["open"] = recurse
    answer = ask(server, "open")
    assert answer.status == 500 and answer.data["error"].startswith("internal error")
    assert "RecursionError" in capfd.readouterr().err


def test_a_text_that_is_not_valid_unicode_is_not_saved(server: EditorServer) -> None:
    version = ask(server, "open").data["version"]
    answer = ask(server, "save", text="x: \ud800", version=version)
    assert answer.status == 422 and "U+D800 is not a valid character" in answer.data["error"]
    assert server.session.file.path.read_text() == TEXT


def test_saving_requires_the_version_that_was_read(server: EditorServer) -> None:
    opened = ask(server, "open").data
    server.session.file.path.write_text("theirs: 1\n")
    conflict = ask(server, "save", text=TEXT, version=opened["version"])
    assert conflict.status == 409
    assert conflict.data["text"] == "theirs: 1\n" and "reload it, or overwrite it" in conflict.data["error"]
    assert server.session.file.path.read_text() == "theirs: 1\n"
    assert ask(server, "save", text=TEXT, version=opened["version"], overwrite=True).status == 200
    assert server.session.file.path.read_text() == TEXT


def test_answer_contains_the_reason_why_a_file_cannot_be_saved(server: EditorServer) -> None:
    opened, file = ask(server, "open").data, server.session.file.path
    file.rename(file.with_name("other.yaml"))
    file.symlink_to("other.yaml")
    refused = ask(server, "save", text=TEXT + "#\n", version=opened["version"])
    assert refused.status == 422
    assert "a.scenario.yaml: cannot be written: it is a symbolic link" in refused.data["error"]


def test_world_file_has_a_separate_page_as_soon_as_the_scenario_names_the_file(server: EditorServer) -> None:
    world = server.session.file.path.with_name("b.world.yaml")
    world.write_text("simscen: 1\n")
    assert request(server, "GET", f"/{server.token}/world-1/").status == 404
    scene = ask(server, "scene", text=TEXT.replace("{simscen: 1}", "b.world.yaml")).data
    assert scene["world_file"] == "b.world.yaml" and scene["world_page"] == "world-1/"
    assert request(server, "GET", f"/{server.token}/world-1/").status == 200
    assert ask(server, "../world-1/api/open").status == 404
    opened = request(server, "POST", f"/{server.token}/world-1/api/open", {}).data
    assert (opened["kind"], opened["text"]) == ("world", "simscen: 1\n")
    assert request(server, "GET", f"/{server.token}/world-2/").status == 404


def test_internal_error_is_reported_and_the_server_continues(
    server: EditorServer, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def raise_error(_: object) -> dict[str, Any]:
        raise RuntimeError("broken")

    monkeypatch.setattr(server.session, "requests", {**server.session.requests, "scene": raise_error})
    assert ask(server, "scene").status == 500
    assert "RuntimeError: broken" in capsys.readouterr().err
    assert ask(server, "open").status == 200
