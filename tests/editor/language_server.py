"""Client of yaml-language-server over stdio (Language Server Protocol 3.17)."""

import itertools
import json
import subprocess
import threading
from pathlib import Path
from queue import Empty, Queue
from typing import Any, NamedTuple

TIMEOUT_S = 60.0
"""Maximum time in s until the next message of the server."""
SETTINGS = {
    "yaml": {"schemaStore": {"enable": False}, "validate": True, "completion": True, "hover": True},
    "redhat": {"telemetry": {"enabled": False}},
}


class Diagnostic(NamedTuple):
    """Text that an editor underlines: line, first and last column from 0, and message."""

    line: int
    begin: int
    end: int
    message: str


class LanguageServer:
    """Server process with the folder of the project as its workspace."""

    def __init__(self, command: list[str], root: Path) -> None:
        self._process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        self._numbers, self._messages = itertools.count(1), Queue[dict[str, Any]]()
        self._answers: dict[int, Any] = {}
        self._diagnostics: dict[str, list[Diagnostic]] = {}
        threading.Thread(target=self._read_messages, daemon=True).start()
        self._root, self._open_uris = root, set[str]()
        capabilities = {
            "workspace": {"configuration": True},
            "textDocument": {
                "completion": {"completionItem": {"snippetSupport": True, "documentationFormat": ["markdown"]}},
                "hover": {"contentFormat": ["markdown", "plaintext"]},
            },
        }
        self.ask("initialize", {"processId": None, "rootUri": root.as_uri(), "capabilities": capabilities})
        self._send({"method": "initialized", "params": {}})
        self._send({"method": "workspace/didChangeConfiguration", "params": {"settings": SETTINGS}})

    def open(self, name: str, text: str) -> str:
        """Open a file with a text, and return its URI. The file need not exist."""
        uri = (self._root / name).as_uri()
        assert uri not in self._open_uris
        self._open_uris.add(uri)
        document = {"uri": uri, "languageId": "yaml", "version": 1, "text": text}
        self._send({"method": "textDocument/didOpen", "params": {"textDocument": document}})
        return uri

    def diagnostics(self, uri: str) -> list[Diagnostic]:
        """Return the diagnostics of an open file, in the order of the lines."""
        while uri not in self._diagnostics:
            self._handle_next_message()
        return sorted(self._diagnostics[uri])

    def completions(self, uri: str, line: int, column: int) -> dict[str, dict[str, Any]]:
        """Return the completions at a position, by label."""
        result = self._ask_at("completion", uri, line, column) or []
        items = result["items"] if isinstance(result, dict) else result
        return {str(item["label"]): item for item in items}

    def hover(self, uri: str, line: int, column: int) -> str:
        """Return the hover text at a position."""
        result = self._ask_at("hover", uri, line, column)
        contents = result["contents"] if result else ""
        return contents["value"] if isinstance(contents, dict) else str(contents)

    def ask(self, method: str, params: dict[str, Any]) -> Any:
        """Send a request and wait for its answer."""
        number = next(self._numbers)
        self._send({"id": number, "method": method, "params": params})
        while number not in self._answers:
            self._handle_next_message()
        return self._answers.pop(number)

    def close(self) -> None:
        """End the process."""
        self.ask("shutdown", {})
        self._process.terminate()
        self._process.wait(TIMEOUT_S)

    def _ask_at(self, request: str, uri: str, line: int, column: int) -> Any:
        position = {"line": line, "character": column}
        return self.ask(f"textDocument/{request}", {"textDocument": {"uri": uri}, "position": position})

    def _handle_next_message(self) -> None:
        """Wait for the next message; store or answer it."""
        try:
            message = self._messages.get(timeout=TIMEOUT_S)
        except Empty:
            raise TimeoutError("yaml-language-server does not answer") from None
        match message:
            case {"method": "textDocument/publishDiagnostics", "params": {"uri": uri, "diagnostics": diagnostics}}:
                self._diagnostics[uri] = [_diagnostic(item) for item in diagnostics]
            case {"method": "workspace/configuration", "id": number, "params": {"items": items}}:
                self._send({"id": number, "result": [SETTINGS.get(item.get("section", ""), {}) for item in items]})
            case {"method": _, "id": number}:
                self._send({"id": number, "result": None})
            case {"id": number, "error": error}:
                raise AssertionError(error)
            case {"id": number, "result": result}:
                self._answers[number] = result

    def _send(self, message: dict[str, Any]) -> None:
        body = json.dumps({"jsonrpc": "2.0", **message}).encode()
        assert self._process.stdin is not None
        self._process.stdin.write(b"Content-Length: %d\r\n\r\n%s" % (len(body), body))
        self._process.stdin.flush()

    def _read_messages(self) -> None:
        assert self._process.stdout is not None
        while header := self._process.stdout.readline():
            length = int(header.partition(b":")[2])
            while self._process.stdout.readline().strip():
                pass
            self._messages.put(json.loads(self._process.stdout.read(length)))


def _diagnostic(item: dict[str, Any]) -> Diagnostic:
    begin, end = item["range"]["start"], item["range"]["end"]
    column = end["character"] if end["line"] == begin["line"] else -1
    return Diagnostic(begin["line"], begin["character"], column, item["message"])
