"""Runs the steps of a composite action as GitHub's runner does: in order, with its files and variables."""

import os
import re
import subprocess
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml

INPUTS = {
    "actions/setup-python@v5": {"python-version"},
    "actions/cache@v4": {"path", "key", "restore-keys"},
    "actions/upload-artifact@v4": {"name", "path", "retention-days", "if-no-files-found"},
}
"""Declared inputs that action.yml uses, by the action that it calls."""
_EXPRESSION = re.compile(r"\$\{\{\s*(.*?)\s*\}\}")


@dataclass
class CompletedAction:
    """Outcomes of the steps, outputs of the action, printed text, step summary, and inputs of called actions."""

    outcomes: dict[str, str] = field(default_factory=dict)
    outputs: dict[str, str] = field(default_factory=dict)
    printed: str = ""
    summary: str = ""
    used: dict[str, dict[str, str]] = field(default_factory=dict)

    @property
    def failed(self) -> bool:
        """Whether a step failed."""
        return "failure" in self.outcomes.values()


class Composite:
    """An action in the folder `action`, called in the checkout `workspace`; `temp` is RUNNER_TEMP."""

    def __init__(self, action: Path, workspace: Path, temp: Path, environ: Mapping[str, str]) -> None:
        self._action, self._workspace, self._temp = action, workspace, temp
        self._definition: dict[str, Any] = yaml.safe_load((action / "action.yml").read_text())
        self._environ = dict(environ)
        self._steps: dict[str, dict[str, Any]] = {}

    def run(self, **inputs: str) -> CompletedAction:
        """Run the steps whose conditions hold, and return the result."""
        declared = self._definition["inputs"]
        assert inputs.keys() <= declared.keys()
        values = {name: inputs.get(name, one["default"]) for name, one in declared.items()}
        self._context = {
            **{f"inputs.{name}": value for name, value in values.items()},
            "github.action_path": str(self._action),
            "github.token": "secret-token",
            "runner.os": "Linux",
            "runner.arch": "X64",
        }
        ran = CompletedAction()
        for number, step in enumerate(self._definition["runs"]["steps"]):
            name = step.get("id", str(number))
            self._steps[name] = {"outcome": "skipped", "outputs": {}}
            if self._should_run(step.get("if", "success()"), ran):
                done = self._call_action(step, ran) if "uses" in step else self._run_script(name, step, ran)
                self._steps[name]["outcome"] = ran.outcomes[name] = "success" if done else "failure"
                if step.get("uses", "").startswith("actions/upload-artifact"):
                    self._steps[name]["outputs"]["artifact-url"] = "https://example.org/artifact"
        ran.outputs = {name: self._substituted(one["value"]) for name, one in self._definition["outputs"].items()}
        return ran

    def _should_run(self, condition: str, ran: CompletedAction) -> bool:
        """Evaluate a condition: calls of status functions and comparisons, joined by `&&`."""
        parts = [part.strip() for part in _EXPRESSION.sub(r"\1", condition).split("&&")]
        return all(self._is_true(part, ran) for part in parts) and ("always()" in parts or not ran.failed)

    def _is_true(self, part: str, ran: CompletedAction) -> bool:
        if part in ("always()", "success()"):
            return True
        compared = re.fullmatch(r"(\S+) (==|!=) '(.*)'", part)
        assert compared, part
        return (self._value(compared[1]) == compared[3]) == (compared[2] == "==")

    def _value(self, name: str) -> str:
        if (found := re.fullmatch(r"steps\.(\w+)\.(?:outputs\.(\S+)|outcome)", name)) is not None:
            step = self._steps[found[1]]
            return str(step["outputs"].get(found[2], "") if found[2] else step["outcome"])
        return self._context[name]

    def _substituted(self, text: str) -> str:
        return _EXPRESSION.sub(lambda match: self._value(match[1]), str(text))

    def _call_action(self, step: dict[str, Any], ran: CompletedAction) -> bool:
        given = {name: self._substituted(value) for name, value in step.get("with", {}).items()}
        assert given.keys() <= INPUTS[step["uses"]], step
        ran.used[step["uses"]] = given
        return True

    def _run_script(self, name: str, step: dict[str, Any], ran: CompletedAction) -> bool:
        assert "${{" not in step["run"], "an expression in a script allows script injection"
        assert step["shell"] == "bash"
        files = {kind: self._temp / f"{name}.{kind}" for kind in ("OUTPUT", "PATH", "ENV", "STEP_SUMMARY")}
        for file in files.values():
            file.touch()
        script = self._temp / f"{name}.sh"
        script.write_text(step["run"])
        variables = {key: self._substituted(value) for key, value in step.get("env", {}).items()}
        github = {f"GITHUB_{kind}": str(file) for kind, file in files.items()}
        done = subprocess.run(
            ["bash", "--noprofile", "--norc", "-e", "-o", "pipefail", str(script)],
            cwd=self._workspace, env={**self._environ, **github, **variables}, capture_output=True, text=True,
            check=False,
        )  # fmt: skip
        ran.printed += done.stdout + done.stderr
        ran.summary += files["STEP_SUMMARY"].read_text()
        self._steps[name]["outputs"] = dict(
            line.split("=", 1) for line in files["OUTPUT"].read_text().splitlines() if line
        )
        for folder in files["PATH"].read_text().splitlines():
            self._environ["PATH"] = folder + os.pathsep + self._environ["PATH"]
        return done.returncode == 0
