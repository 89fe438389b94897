"""yaml-language-server over stdio, spoken to as an editor does (Language Server Protocol 3.17)."""

import itertools
import json
import subprocess
import threading
from pathlib import Path
from queue import Empty, Queue
from typing import Any, NamedTuple

PATIENCE = 60.0
"""Seconds until a server that says nothing is taken for dead: no measure of its speed."""
SETTINGS = {
    "yaml": {"schemaStore": {"enable": False}, "validate": True, "completion": True, "hover": True},
    "redhat": {"telemetry": {"enabled": False}},
}


class Diagnostic(NamedTuple):
    """What an editor underlines: line and columns from 0, and what it says."""

    line: int
    begin: int
    end: int
    message: str


class LanguageServer:
    """One process, with the folder of the project as its workspace."""

    def __init__(self, command: list[str], root: Path) -> None:
        self._process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        self._numbers, self._told = itertools.count(1), Queue[dict[str, Any]]()
        self._answers: dict[int, Any] = {}
        self._found: dict[str, list[Diagnostic]] = {}
        threading.Thread(target=self._listen, daemon=True).start()
        self._root, self._open = root, set[str]()
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
        """Show it a file of the project, which need not be there, for the first time; its address."""
        uri = (self._root / name).as_uri()
        assert uri not in self._open
        self._open.add(uri)
        document = {"uri": uri, "languageId": "yaml", "version": 1, "text": text}
        self._send({"method": "textDocument/didOpen", "params": {"textDocument": document}})
        return uri

    def diagnostics(self, uri: str) -> list[Diagnostic]:
        """What it finds wrong with an open file, in the order of the lines."""
        while uri not in self._found:
            self._take()
        return sorted(self._found[uri])

    def completions(self, uri: str, line: int, column: int) -> dict[str, dict[str, Any]]:
        """What it offers there, by label."""
        offered = self._at("completion", uri, line, column) or []
        items = offered["items"] if isinstance(offered, dict) else offered
        return {str(item["label"]): item for item in items}

    def hover(self, uri: str, line: int, column: int) -> str:
        """What it shows for what stands there."""
        shown = self._at("hover", uri, line, column)
        contents = shown["contents"] if shown else ""
        return contents["value"] if isinstance(contents, dict) else str(contents)

    def ask(self, method: str, params: dict[str, Any]) -> Any:
        """Send a request and wait for its answer."""
        number = next(self._numbers)
        self._send({"id": number, "method": method, "params": params})
        while number not in self._answers:
            self._take()
        return self._answers.pop(number)

    def close(self) -> None:
        """End the process."""
        self.ask("shutdown", {})
        self._process.terminate()
        self._process.wait(PATIENCE)

    def _at(self, what: str, uri: str, line: int, column: int) -> Any:
        position = {"line": line, "character": column}
        return self.ask(f"textDocument/{what}", {"textDocument": {"uri": uri}, "position": position})

    def _take(self) -> None:
        """Deal with the next message."""
        try:
            message = self._told.get(timeout=PATIENCE)
        except Empty:
            raise TimeoutError("yaml-language-server says nothing") from None
        match message:
            case {"method": "textDocument/publishDiagnostics", "params": {"uri": uri, "diagnostics": found}}:
                self._found[uri] = [_diagnostic(one) for one in found]
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

    def _listen(self) -> None:
        assert self._process.stdout is not None
        while header := self._process.stdout.readline():
            length = int(header.partition(b":")[2])
            while self._process.stdout.readline().strip():
                pass
            self._told.put(json.loads(self._process.stdout.read(length)))


def _diagnostic(expected: dict[str, Any]) -> Diagnostic:
    begin, end = expected["range"]["start"], expected["range"]["end"]
    column = end["character"] if end["line"] == begin["line"] else -1
    return Diagnostic(begin["line"], begin["character"], column, expected["message"])
