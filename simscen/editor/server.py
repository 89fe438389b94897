"""Local HTTP server of the editor. The server answers only requests with the secret token in the URL."""

import json
import re
import secrets
import sys
import threading
import traceback
from html import unescape
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any, NamedTuple

from simscen.core.errors import InvalidInput, SimscenError
from simscen.core.version import PACKAGE
from simscen.editor.session import EditorSession, RequestRefused
from simscen.report.picture.palette import css_variables

ADDRESS = "127.0.0.1"
"""Address of this machine, which other machines cannot reach."""
PAGE_FOLDER, REPLAY_FOLDER = PACKAGE / "data" / "editor", PACKAGE / "data" / "replay"
SHARED_MODULES = ("camera.js", "dom.js")
"""JavaScript modules in REPLAY_FOLDER that the editor page uses as well."""
MAX_REQUEST_BYTES = 4 << 20
"""Maximum size of the body of a request."""
CONTENT_TYPES = {".html": "text/html", ".css": "text/css", ".js": "text/javascript"}
CONTENT_SECURITY_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src data:; frame-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'; require-trusted-types-for 'script'"
)
_WORLD_PATH = re.compile(r"world-([0-9]{1,4})/(.*)", re.DOTALL)
"""Path of the page of a world file, and the rest of the path."""
_REPLAY_PATH = re.compile(r"runs/([0-9]{1,6})/replay\.html")
"""Path of the replay page of a trial run."""
_POLICY_OF_PAGE = re.compile(r'http-equiv="Content-Security-Policy" content="([^"]*)"')


class Response(NamedTuple):
    """HTTP response. `policy` is the Content-Security-Policy."""

    body: bytes
    content_type: str
    status: int = 200
    policy: str = CONTENT_SECURITY_POLICY


class EditorServer(ThreadingHTTPServer):
    """HTTP server of the editor, only for programs on this machine.

    The server has a session for the main file, and a session for each world file to which the main file has referred.
    The page of world file number n has the path `world-n/`. The session of a world file starts with the first request
    for this page.

    session:  session of the main file
    token:    secret first part of the path of all URLs
    hosts:    accepted values of the HTTP header Host
    files:    files of the editor page, by name
    """

    daemon_threads = True

    def __init__(self, session: EditorSession, port: int = 0) -> None:
        """Listen on `port`; 0 selects a free port. Raises OSError if the port is in use."""
        super().__init__((ADDRESS, port), _Handler)
        self.session, self.token = session, secrets.token_urlsafe(24)
        self._worlds: list[Path] = []
        self._world_sessions: dict[int, EditorSession] = {}
        self._lock = threading.Lock()
        session.world_page_address = self._world_page_address
        self.hosts = {f"{name}:{self.server_port}" for name in (ADDRESS, "localhost")}
        self.files = {file.name: file for file in PAGE_FOLDER.iterdir() if file.suffix in CONTENT_TYPES}
        self.files |= {name: REPLAY_FOLDER / name for name in SHARED_MODULES}

    @property
    def url(self) -> str:
        """URL of the page, with the token."""
        return f"http://{ADDRESS}:{self.server_port}/{self.token}/"

    def resolve(self, name: str) -> tuple[EditorSession, str] | None:
        """Return the session of a requested path, and the rest of the path; None for an unknown world file."""
        match = _WORLD_PATH.fullmatch(name)
        if match is None:
            return self.session, name
        session = self._world_session(int(match[1]))
        return None if session is None else (session, match[2])

    def stop_runs(self) -> None:
        """Stop the runs of all sessions."""
        for session in (self.session, *self._world_sessions.values()):
            session.runs.close()

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Ignore a connection that the browser closed; print other errors."""
        if not isinstance(sys.exc_info()[1], ConnectionError | TimeoutError):
            super().handle_error(request, client_address)

    def _world_page_address(self, world: Path) -> str:
        """Return the path of the page of a world file. A new file gets the next number."""
        with self._lock:
            if world not in self._worlds:
                self._worlds.append(world)
            return f"world-{self._worlds.index(world) + 1}/"

    def _world_session(self, number: int) -> EditorSession | None:
        """Return the session of world file `number`; None for an unknown number, or if the file cannot be read."""
        with self._lock:
            if number not in self._world_sessions and 0 < number <= len(self._worlds):
                try:
                    self._world_sessions[number] = self.session.open_world(self._worlds[number - 1])
                except InvalidInput:
                    return None
            return self._world_sessions.get(number)


class _Handler(BaseHTTPRequestHandler):
    """Handler of the requests of a browser: pages and files by GET, requests of the page by POST."""

    server: EditorServer
    protocol_version = "HTTP/1.1"
    server_version, sys_version = "simscen", ""
    timeout = 60

    def do_GET(self) -> None:
        """Send a file of the editor page or the replay page of a run."""
        if (target := self._authorize()) is not None:
            self._send(self._file(*target))

    def do_POST(self) -> None:
        """Answer a JSON request of the page, one of the `requests` of a session."""
        body = self._body()
        if (target := self._authorize()) is None:
            return
        if body is None:
            self._send(_error("the request is too large, or has no length", HTTPStatus.REQUEST_ENTITY_TOO_LARGE))
        elif self.headers.get_content_type() != "application/json":
            self._send(_error("requests must be JSON", HTTPStatus.UNSUPPORTED_MEDIA_TYPE))
        else:
            self._send(_response(*target, body))

    def log_message(self, format: str, *args: Any) -> None:
        """Print nothing, because the URL contains the token."""

    def _authorize(self) -> tuple[EditorSession, str] | None:
        """Check that a request is allowed, and return its session and its path within the session.

        If the request is not allowed, send an error and return None.
        """
        origin, host = self.headers.get("Origin"), self.headers.get("Host", "")
        if host not in self.server.hosts:
            self._send(_error("wrong host", HTTPStatus.MISDIRECTED_REQUEST))
            return None
        if origin is not None and origin not in {f"http://{name}" for name in self.server.hosts}:
            self._send(_error("wrong origin", HTTPStatus.FORBIDDEN))
            return None
        token, _, name = self.path.partition("?")[0].removeprefix("/").partition("/")
        if not secrets.compare_digest(token.encode(errors="replace"), self.server.token.encode()):
            message = "wrong or missing token; use the address that simscen edit printed"
            self._send(_error(message, HTTPStatus.FORBIDDEN))
            return None
        target = self.server.resolve(name)
        if target is None:
            self._send(_error("there is no such file to edit", HTTPStatus.NOT_FOUND))
        return target

    def _body(self) -> bytes | None:
        """Return the body of a request; None if the body is too large or has no length."""
        length = self.headers.get("Content-Length", "")
        if not re.fullmatch("[0-9]{1,9}", length) or int(length) > MAX_REQUEST_BYTES:
            self.close_connection = True
            return None
        return self.rfile.read(int(length))

    def _file(self, session: EditorSession, name: str) -> Response:
        """Return the answer to GET: a file of the editor page, or the replay page of a run."""
        if match := _REPLAY_PATH.fullmatch(name):
            return _replay(session, int(match[1]))
        file = self.server.files.get(name or "page.html")
        if file is None:
            return _error("no such file", HTTPStatus.NOT_FOUND)
        data = file.read_bytes()
        if file.name == "page.css":
            data = css_variables().encode() + data
        return Response(data, CONTENT_TYPES[file.suffix])

    def _send(self, answer: Response) -> None:
        self.send_response(answer.status)
        headers = {
            "Content-Type": f"{answer.content_type}; charset=utf-8",
            "Content-Length": str(len(answer.body)),
            "Content-Security-Policy": answer.policy,
            "X-Content-Type-Options": "nosniff",
            "Referrer-Policy": "no-referrer",
            "Cross-Origin-Resource-Policy": "same-origin",
            "Cross-Origin-Opener-Policy": "same-origin",
            "Cache-Control": "no-store",
        }
        for name, value in headers.items():
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(answer.body)


def _replay(session: EditorSession, number: int) -> Response:
    """Return the replay page of a run, with the Content-Security-Policy that the page itself states."""
    trial = session.runs.trial(number)
    if trial is None or not trial.replay.is_file():
        return _error("there is no such replay", HTTPStatus.NOT_FOUND)
    page = trial.replay.read_bytes()
    match = _POLICY_OF_PAGE.search(page[:4096].decode(errors="replace"))
    policy = unescape(match[1]) if match else "default-src 'none'"
    return Response(page, "text/html", policy=f"{policy}; frame-ancestors 'self'")


def _response(session: EditorSession, name: str, body: bytes) -> Response:
    """Return the answer of a session to the request `name` ("api/…") with a JSON object as `body`."""
    handler = session.requests.get(name.removeprefix("api/")) if name.startswith("api/") else None
    if handler is None:
        return _error("no such request", HTTPStatus.NOT_FOUND)
    try:
        data = json.loads(body)
    except (ValueError, RecursionError):  # ValueError also for numbers with too many digits
        return _error("the request is not JSON", HTTPStatus.BAD_REQUEST)
    if not isinstance(data, dict):
        return _error("a request must be a JSON object", HTTPStatus.BAD_REQUEST)
    try:
        return _json(handler(data))
    except RequestRefused as refused:
        return _json({**refused.data, "error": str(refused)}, refused.status)
    except SimscenError as error:  # such as a file that cannot be written
        return _error(str(error), HTTPStatus.UNPROCESSABLE_ENTITY)
    except Exception:
        traceback.print_exc()
        message = "internal error: this is a bug in simscen; the terminal shows details"
        return _error(message, HTTPStatus.INTERNAL_SERVER_ERROR)


def _json(data: Any, status: int = 200) -> Response:
    body = json.dumps(data, ensure_ascii=False, allow_nan=False).encode(errors="replace")
    return Response(body, "application/json", status)


def _error(message: str, status: HTTPStatus) -> Response:
    return _json({"error": message}, status)
