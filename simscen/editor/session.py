"""Session of the editor: answers the requests of the editor page about one file.

The page holds the edited text, and sends this text as `text` with each request that needs it. The page also shows a
map of the world.
"""

import threading
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from simscen.core.errors import InvalidInput, Problem
from simscen.editor.checking import TextChecks
from simscen.editor.document import NEW_FILE_VERSION, Content, Document, EditedFile, FileChanged
from simscen.editor.forms import form_data
from simscen.editor.map_view.background import Backgrounds
from simscen.editor.map_view.map_edits import read_edits, read_keys
from simscen.editor.map_view.map_objects import MapObject
from simscen.editor.map_view.scene import map_objects, object_id_at_problem, scene_data, scene_parts
from simscen.editor.preview import preview_data
from simscen.editor.text_editing.splices import EditRefused
from simscen.editor.text_editing.text_edits import apply_edits
from simscen.editor.trial_run import TrialRun, TrialRuns
from simscen.loading.loaded import LoadedScenario
from simscen.loading.stacks.choice import StackChoice
from simscen.loading.yaml.source_nodes import SourceNode, parse_source
from simscen.loading.yaml.textfile import MAX_FILE_BYTES
from simscen.run.process.jobs import Backend

Data = dict[str, Any]
"""JSON object."""
CommandResolver = Callable[[LoadedScenario], tuple[LoadedScenario, list[Problem]]]
"""Function that adds the commands of external stacks to a scenario, and returns the new scenario and any problems."""


class RequestRefused(Exception):
    """The request cannot be answered. `status` is the HTTP status, `data` has additional keys of the answer."""

    def __init__(self, message: str, status: int = 400, data: Data | None = None) -> None:
        super().__init__(message)
        self.status, self.data = status, data or {}


class EditorSession:
    """Answers the requests about one edited file.

    `requests` maps the name of each request to the method that answers the request. These methods take and return JSON
    data, and raise RequestRefused if they cannot answer a request.
    """

    def __init__(
        self,
        file: EditedFile,
        backend_factory: Callable[[], Backend],
        new_text: str = "",
        lenient: bool = False,
        stack: StackChoice | None = None,
        resolve_commands: CommandResolver = lambda loaded: (loaded, []),
    ) -> None:
        """Open a file. Raises InvalidInput if the file cannot be read.

        backend_factory:   creates the backend that starts the process of a run
        new_text:          text of a file that does not exist yet; "" for an existing file
        lenient:           value of the option --lenient
        stack:             stack that replaces the stack of the scenario; None to keep it
        resolve_commands:  adds the commands of external stacks before a run
        """
        self.file = file
        self.runs = TrialRuns(backend_factory)
        self.world_page_address: Callable[[Path], str] = lambda _: ""
        """Returns the address of the page that edits a world file, relative to the page of this session."""
        self._backend_factory, self._lenient, self._resolve_commands = backend_factory, lenient, resolve_commands
        self._stack = stack
        self._document = Document(file.path, file.display_name)
        self._content = Content(new_text, NEW_FILE_VERSION) if new_text else self._document.read()
        self._backgrounds = Backgrounds(file.root, file.world_path)
        self._checks, self._preview_checks = (TextChecks(file, lenient, stack) for _ in range(2))
        self._scene_lock, self._check_lock, self._preview_lock = threading.Lock(), threading.Lock(), threading.Lock()
        self.requests: Mapping[str, Callable[[Data], Data]] = {
            "open": self.open,
            "reload": self.reload,
            "scene": self.scene,
            "problems": self.problems,
            "edit": self.edit,
            "form": self.form,
            "preview": self.preview,
            "save": self.save,
            "run": self.run,
            "run-status": self.run_status,
            "run-stop": self.run_stop,
        }

    def open_world(self, path: Path) -> "EditorSession":
        """Return a session for a world file of this scenario. Raises InvalidInput if the file cannot be read."""
        return EditorSession(replace(self.file, path=path, kind="world"), self._backend_factory, lenient=self._lenient)

    def open(self, _: Data) -> Data:
        """Return the text of the file, or the last text if the file can no longer be read."""
        if self._content.version != NEW_FILE_VERSION:
            with suppress(InvalidInput, OSError):
                self._content = self._document.read()
        return self._opened_data()

    def reload(self, _: Data) -> Data:
        """Read the file again, and return its text."""
        try:
            self._content = self._document.read()
        except InvalidInput as error:
            raise RequestRefused(_first_message(error.problems)) from error
        return self._opened_data()

    def scene(self, request: Data) -> Data:
        """Return the background and the objects of the map.

        `known` in the request is the ID of the background that the page already has. If it has not changed,
        `background` in the answer is None.
        """
        with self._scene_lock:
            parts = scene_parts(self.file, _text(request))
            if parts is None:
                raise RequestRefused("the text is not a YAML mapping yet, so the map shows its last valid state", 422)
            data = scene_data(parts, self._backgrounds)
        data["world_page"] = self.world_page_address(parts.world.path) if data["world_file"] and parts.world else ""
        if data["background"]["id"] and data["background"]["id"] == request.get("known"):
            data["background"] = None
        return data

    def problems(self, request: Data) -> Data:
        """Return the problems of the text, with the IDs of the affected objects on the map."""
        text = _text(request)
        with self._check_lock:
            problems = self._checks.problems(text)
        parts = scene_parts(self.file, text)
        objects = [] if parts is None else map_objects(parts)
        source = parse_source(text)
        return {"problems": [self._problem_data(problem, objects, source, text) for problem in problems]}

    def edit(self, request: Data) -> Data:
        """Return the text after `edits` on the map or in a form."""
        return {"text": self._edited_text(request, request.get("edits"))}

    def form(self, request: Data) -> Data:
        """Return the form of the value at `keys`."""
        text = _text(request)
        try:
            keys = read_keys(request.get("keys"))
        except EditRefused as error:
            raise RequestRefused(str(error)) from error
        parts = scene_parts(self.file, text)
        if parts is None:
            raise RequestRefused("the text is not valid YAML; correct it first", 422)
        return form_data(self.file.kind, text, parts.tree.plain, keys)

    def preview(self, request: Data) -> Data:
        """Return the shortest paths and the clearances of the robots after `edits`."""
        if self.file.kind != "scenario":
            return {"reason": "", "robots": {}}
        text = self._edited_text(request, request.get("edits", []))
        with self._preview_lock:
            return preview_data(self._preview_checks, text)

    def save(self, request: Data) -> Data:
        """Write the text to the file, and return the new version.

        The request is refused if the file has another version than `version`, unless `overwrite` is true.
        """
        text, version = _text(request), request.get("version")
        try:
            new_version = self._document.save(text, str(version), request.get("overwrite") is True)
        except FileChanged as error:
            current = {"text": error.content.text, "version": error.content.version}
            raise RequestRefused(str(error), 409, current) from error
        self._content = Content(text, new_version)
        return {"version": new_version}

    def run(self, request: Data) -> Data:
        """Start a run of the scenario or its first variation. The request is refused if the text has errors."""
        if self.file.kind != "scenario":
            raise RequestRefused("only a scenario can run")
        text = _text(request)
        with self._check_lock:
            errors = [problem for problem in self._checks.problems(text) if problem.severity == "error"]
            if errors:
                raise RequestRefused(f"the scenario has problems: {_first_message(errors)}", 422)
            loaded = self._checks.load(text)
        scenario, undefined = self._resolve_commands(loaded[0])
        if undefined:
            raise RequestRefused(f"{_first_message(undefined)}; {undefined[0].hint}", 422)
        return self.runs.start(scenario).data()

    def run_status(self, request: Data) -> Data:
        """Return the state of the run with the number `run`."""
        if (trial := self._trial(request)) is None:
            raise RequestRefused("there is no such run", 404)
        return trial.data()

    def run_stop(self, request: Data) -> Data:
        """Stop the run with the number `run`."""
        if (trial := self._trial(request)) is not None:
            trial.is_canceled = True
        return {}

    def _trial(self, request: Data) -> TrialRun | None:
        number = request.get("run")
        return self.runs.trial(number) if isinstance(number, int) else None

    def _edited_text(self, request: Data, edits: Any) -> str:
        """Return the text of a request after `edits`, a list of changes (see `read_edits`)."""
        text = _text(request)
        try:
            return apply_edits(text, read_edits(edits, text, self.file.kind))
        except EditRefused as error:
            raise RequestRefused(str(error), 422) from error

    def _opened_data(self) -> Data:
        """Return the answer to `open` and `reload`."""
        content = self._content
        return {
            "name": self.file.display_name,
            "kind": self.file.kind,
            "text": content.text,
            "version": content.version,
            "is_new": content.version == NEW_FILE_VERSION,
            "stack": "" if self._stack is None else self._stack.name,
        }

    def _problem_data(self, problem: Problem, objects: list[MapObject], source: SourceNode | None, text: str) -> Data:
        """Return a problem as JSON data. `source` is the syntax tree of the text; None if the text is invalid."""
        is_in_file = problem.path == self.file.display_name
        return {
            "path": problem.path,
            "line": problem.line if is_in_file else 0,
            "col": problem.col if is_in_file else 0,
            "where": f"{problem.line}:{problem.col}" if is_in_file else f"{problem.path}:{problem.line}",
            "code": problem.code,
            "severity": problem.severity,
            "message": problem.message,
            "hint": problem.hint,
            "object": object_id_at_problem(problem, objects, source, text) if is_in_file else "",
        }


def _text(request: Data) -> str:
    """Return the text of a request. Raises RequestRefused if the text is missing or too large."""
    text = request.get("text")
    if not isinstance(text, str):
        raise RequestRefused("the request has no text")
    if len(text.encode(errors="replace")) > MAX_FILE_BYTES:
        raise RequestRefused("the text is larger than 1 MiB", 413)
    return text.replace("\r\n", "\n")


def _first_message(problems: list[Problem]) -> str:
    """Return the message of the first problem, with its line and column."""
    first = min(problems)
    return f"{first.line}:{first.col}: {first.message}" if first.line else first.message
