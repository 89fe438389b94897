"""What the page asks the program for: one method for each request, with JSON data in and out."""

import threading
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from simscen.core.errors import InvalidInput, Problem
from simscen.editor.checking import TextChecks
from simscen.editor.document import NEW, ChangedMeanwhile, Content, Document, EditedFile
from simscen.editor.forms import form_data
from simscen.editor.map_view.background import Backgrounds
from simscen.editor.map_view.map_edits import edits_of
from simscen.editor.map_view.map_objects import object_at_problem
from simscen.editor.map_view.scene import map_objects, scene_data, scene_parts
from simscen.editor.preview import preview_data
from simscen.editor.text_editing.splices import EditRefused
from simscen.editor.text_editing.text_edits import apply_edits
from simscen.editor.trial_run import TrialRuns
from simscen.loading.loaded import LoadedScenario
from simscen.loading.stacks.choice import StackChoice
from simscen.loading.yaml.source_nodes import parse_source
from simscen.loading.yaml.textfile import MAX_FILE_BYTES
from simscen.run.process.jobs import Backend

Data = dict[str, Any]
WithCommand = Callable[[LoadedScenario], tuple[LoadedScenario, list[Problem]]]


def _as_it_is(loaded: LoadedScenario) -> tuple[LoadedScenario, list[Problem]]:
    return loaded, []


class RequestRefused(Exception):
    """The request cannot be answered; `status` is the HTTP status, `data` goes to the page."""

    def __init__(self, message: str, status: int = 400, data: Data | None = None) -> None:
        super().__init__(message)
        self.status, self.data = status, data or {}


class EditorSession:
    """One file in one editor. The page holds the text, and sends it with each request."""

    def __init__(
        self,
        file: EditedFile,
        backend_factory: Callable[[], Backend],
        new_text: str = "",
        lenient: bool = False,
        stack: StackChoice | None = None,
        with_command: WithCommand = _as_it_is,
    ) -> None:
        """Open a file; `new_text` is the text of one that does not exist yet. Raises InvalidInput.

        Runs use `stack` instead of the stack of the scenario. `with_command` returns a scenario with the commands of
        its external stacks, and problems if they are unknown.
        """
        self.file = file
        self.runs = TrialRuns(backend_factory)
        self.world_page: Callable[[Path], str] = lambda _: ""
        """Returns the address of the page that edits a world file, relative to that of this session."""
        self._backend_factory, self._lenient, self._with_command = backend_factory, lenient, with_command
        self._stack = stack
        self._document = Document(file.path, file.display_name)
        self._opened = Content(new_text, NEW) if new_text else self._document.read()
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

    def other(self, file: EditedFile) -> "EditorSession":
        """Open another file with the same options. Raises InvalidInput."""
        return EditorSession(file, self._backend_factory, lenient=self._lenient)

    def open(self, _: Data) -> Data:
        """Return the text of the file as it is now; that of the last time if it cannot be read any more."""
        if self._opened.version != NEW:
            with suppress(InvalidInput, OSError):
                self._opened = self._document.read()
        return self._opened_data(self._opened)

    def reload(self, _: Data) -> Data:
        """Read the file again."""
        try:
            self._opened = self._document.read()
        except InvalidInput as error:
            raise RequestRefused(_first_message(error.problems)) from error
        return self._opened_data(self._opened)

    def scene(self, request: Data) -> Data:
        """Return what the map shows of a text; `known` is the id of a background that the page has already."""
        with self._scene_lock:
            parts = scene_parts(self.file, _text(request))
            if parts is None:
                raise RequestRefused("the text is not a YAML mapping yet, so the map shows its last valid state", 422)
            data = scene_data(parts, self._backgrounds)
        data["world_page"] = self.world_page(parts.world.path) if data["world_file"] and parts.world else ""
        if data["background"]["id"] and data["background"]["id"] == request.get("known"):
            data["background"] = None
        return data

    def problems(self, request: Data) -> Data:
        """Return the problems of a text, each with the id of the thing on the map that it is about."""
        text = _text(request)
        with self._check_lock:
            found = self._checks.problems(text)
        parts = scene_parts(self.file, text)
        objects = [] if parts is None else map_objects(parts)
        own = parse_source(text)
        return {"problems": [self._problem_data(one, objects, own, text) for one in found]}

    def edit(self, request: Data) -> Data:
        """Return the text after edits that were made on the map or in a form."""
        text = _text(request)
        return {"text": self._edited(text, request.get("edits"))}

    def form(self, request: Data) -> Data:
        """Return the form of the value at `keys`."""
        text, keys = _text(request), request.get("keys")
        if not isinstance(keys, list):
            raise RequestRefused("the request has no keys")
        parts = scene_parts(self.file, text)
        if parts is None:
            raise RequestRefused("the text is not valid YAML; correct it first", 422)
        return form_data(self.file.kind, text, parts.tree.plain, tuple(keys))

    def preview(self, request: Data) -> Data:
        """Return paths and clearances as they would be after some edits."""
        if self.file.kind != "scenario":
            return {"reason": "", "robots": {}}
        text = self._edited(_text(request), request.get("edits", []))
        with self._preview_lock:
            return preview_data(self._preview_checks, text)

    def save(self, request: Data) -> Data:
        """Write the text to the file if that is still the `version` that the page has read, or with `overwrite`."""
        text, version = _text(request), request.get("version")
        try:
            saved = self._document.save(text, str(version), request.get("overwrite") is True)
        except ChangedMeanwhile as error:
            theirs = {"text": error.content.text, "version": error.content.version}
            raise RequestRefused(str(error), 409, theirs) from error
        self._opened = Content(text, saved)
        return {"version": saved}

    def run(self, request: Data) -> Data:
        """Start a run of a text; of a scenario with variations, of the first one."""
        if self.file.kind != "scenario":
            raise RequestRefused("only a scenario can run")
        with self._check_lock:
            loaded = self._checks.load(_text(request))
            if isinstance(loaded, list):
                raise RequestRefused(f"the scenario has problems: {_first_message(loaded)}", 422)
            problems = self._checks.problems(_text(request))
        errors = [problem for problem in problems if problem.severity == "error"]
        if errors:
            raise RequestRefused(f"the scenario has problems: {_first_message(errors)}", 422)
        scenario, undefined = self._with_command(loaded[0])
        if undefined:
            raise RequestRefused(f"{_first_message(undefined)}; {undefined[0].hint}", 422)
        return self.runs.start(scenario).data()

    def run_status(self, request: Data) -> Data:
        """Return the state of a run."""
        trial = self.runs.trial(_run_number(request))
        if trial is None:
            raise RequestRefused("there is no such run", 404)
        return trial.data()

    def run_stop(self, request: Data) -> Data:
        """Stop a run."""
        trial = self.runs.trial(_run_number(request))
        if trial is not None:
            trial.is_canceled = True
        return {}

    def _edited(self, text: str, edits: Any) -> str:
        try:
            return apply_edits(text, edits_of(edits, text, self.file.kind)).text
        except EditRefused as error:
            raise RequestRefused(str(error), 422) from error

    def _opened_data(self, content: Content) -> Data:
        return {
            "name": self.file.display_name,
            "kind": self.file.kind,
            "text": content.text,
            "version": content.version,
            "is_new": content.version == NEW,
            "stack": "" if self._stack is None else self._stack.name,
        }

    def _problem_data(self, problem: Problem, objects: list[Any], own: Any, text: str) -> Data:
        is_own = problem.path == self.file.display_name
        return {
            "path": problem.path,
            "line": problem.line if is_own else 0,
            "col": problem.col if is_own else 0,
            "where": f"{problem.line}:{problem.col}" if is_own else f"{problem.path}:{problem.line}",
            "code": problem.code,
            "severity": problem.severity,
            "message": problem.message,
            "hint": problem.hint,
            "object": object_at_problem(problem, objects, own, text) if is_own else "",
        }


def _text(request: Data) -> str:
    text = request.get("text")
    if not isinstance(text, str):
        raise RequestRefused("the request has no text")
    if len(text.encode(errors="replace")) > MAX_FILE_BYTES:
        raise RequestRefused("the text is larger than 1 MiB", 413)
    return text.replace("\r\n", "\n")


def _first_message(problems: list[Problem]) -> str:
    first = min(problems)
    return f"{first.line}:{first.col}: {first.message}" if first.line else first.message


def _run_number(request: Data) -> int:
    number = request.get("run")
    return number if isinstance(number, int) else 0
