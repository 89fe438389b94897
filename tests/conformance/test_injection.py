"""Conformance tests of injection: text is escaped, code next to scenarios is not executed, secrets stay outside."""

import json
import os
import pty
import re
import subprocess
import sys
from html.parser import HTMLParser
from importlib.resources import files
from pathlib import Path
from xml.etree import ElementTree

import pytest

HOSTILE = [
    "[/red]", "[link=https://example.org]here[/link]", "::error::gotcha", "##[error]gotcha", "##vso[task.x]",
    "##teamcity[x]", "]]>", "&lt;&amp;", "<script>alert(1)</script>", "<img src=x onerror=alert(1)>", "=cmd()",
    "%0A::error::gotcha", "a,b:c%d", "[[ATTACHMENT|/etc/passwd]]", "|cell|`code`", "{0} %s",
]  # fmt: skip
COMMAND = re.compile(r"^\s*::|##\w*\[", re.MULTILINE)
ANNOTATION = re.compile(r"::(error|warning) (file|line|col|title)=[^:,]*(,(file|line|col|title)=[^:,]*)*::[^\r\n]*")
ALLOWED_TAGS = {
    "html", "head", "meta", "title", "style", "body", "h1", "p", "details", "summary", "span", "div", "table",
    "tr", "th", "td", "img", "code", "pre", "b", "a", "header", "main", "section", "svg", "rect", "thead", "tbody",
    "ul", "li", "form", "label", "fieldset", "legend", "input", "select", "option", "button", "kbd",
}  # fmt: skip
SCRIPTED_FORK_SERVER = str(Path(__file__).with_name("scripted_fork_server.py"))


@pytest.fixture
def hostile(folder: Path) -> str:
    """Write a scenario that fails, with hostile names for the file, goals, events, and objects; return its path."""
    goals = [{"name": "near", "pose": {"x": 1.8, "y": 1}}]
    goals += [
        {"name": name, "pose": {"x": 5, "y": 1 + number % 2 * 2}, "timeout": 0.1} for number, name in enumerate(HOSTILE)
    ]
    events = [
        {
            "name": f"event {name}",
            "when": {"time": 0.1},
            "do": {"spawn": {"name": name, "box": [0.1, 0.1, 0.1], "pose": {"x": 2 + number / 4, "y": 0.3}}},
        }
        for number, name in enumerate(HOSTILE)
    ]
    scenario = {
        "simscen": 1, "name": HOSTILE[2], "world": "room.world.yaml", "on_goal_failure": "continue", "goals": goals,
        "time_limit": 500,
        "description": "\n::error::gotcha\n".join(HOSTILE), "events": events, "linger": 0,
        "robot": {"model": "cube.robot.yaml", "pose": "start"}, "pass": [{"goals_reached": {}}],
    }  # fmt: skip
    (folder / "::error::h##[x]<b>.scenario.yaml").write_text(json.dumps(scenario))
    return "./::error::h##[x]<b>.scenario.yaml"


class Tags(HTMLParser):
    """Elements, attributes, links, and text of a page, as an HTML parser finds them."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: set[str] = set()
        self.attributes: set[str] = set()
        self.links: list[str] = []
        self.text = ""
        self.feed(text)

    def handle_starttag(self, tag, attrs) -> None:
        self.tags.add(tag)
        self.attributes |= {name for name, _ in attrs}
        self.links += [value or "" for name, value in attrs if name == "href"]

    def handle_data(self, data) -> None:
        self.text += data


def without_own_script(page: str) -> str:
    """Return the page without its script, which it must contain exactly once."""
    script = f"<script>{files('simscen').joinpath('data').joinpath('suite').joinpath('suite.js').read_text()}</script>"
    assert page.count(script) == 1
    return page.replace(script, "")


def check_reports(out: Path) -> str:
    """Check that reports are well-formed, attach only own files, and have only ALLOWED_TAGS; return the failures."""
    junit = ElementTree.fromstring((out / "junit.xml").read_bytes())
    attached = [
        path for text in junit.iter("system-out") for path in re.findall(r"\[\[ATTACHMENT\|(.*?)\]\]", text.text)
    ]
    assert attached
    assert [path for path in attached if not Path(path).resolve().is_relative_to(out.resolve())] == []
    json.loads((out / "results.json").read_text())
    page = Tags(without_own_script((out / "report.html").read_text()))
    assert page.tags <= ALLOWED_TAGS
    assert [name for name in page.attributes if name.startswith("on") or name in ("style", "srcdoc", "action")] == []
    assert [
        link for link in page.links if not re.fullmatch(r"\./[\w./%=@-]+|#run-[\w.=-]+|[a-z]+\.(xml|json)", link)
    ] == []
    assert "<script>alert(1)</script>" in page.text
    return "\n".join(found.text or "" for kind in ("failure", "error") for found in junit.iter(kind))


def test_81_text_is_escaped_on_the_console_and_in_reports(simscen, hostile: str, folder: Path) -> None:
    ended = simscen("run", hostile, "--out", "out")
    assert (ended.code, ended.err) == (1, "")
    assert not COMMAND.search(ended.out)
    failures = check_reports(folder / "out")
    assert [name for name in HOSTILE if name not in failures] == []
    assert all(name in ended.out for name in ("[/red]", "[link=https://example.org]here[/link]", "]]>", "=cmd()"))


@pytest.mark.slow
def test_81_text_is_escaped_for_github(simscen, hostile: str, folder: Path, monkeypatch) -> None:
    monkeypatch.setenv("GITHUB_STEP_SUMMARY", str(folder / "summary.md"))
    ended = simscen("run", hostile, "--out", "out", "--format", "github")
    assert ended.code == 1
    commands = [line for line in ended.out.splitlines() if COMMAND.search(line)]
    assert commands
    assert all(ANNOTATION.fullmatch(line) for line in commands)
    summary = (folder / "summary.md").read_text()
    assert not COMMAND.search(summary)
    assert "<script>" not in summary
    assert "<img" not in summary


@pytest.mark.slow
def test_81_text_is_escaped_in_json(simscen, hostile: str) -> None:
    ended = simscen("run", hostile, "--out", "out", "--format", "json")
    assert ended.code == 1
    assert json.loads(ended.out)["failed"] == 1
    assert not COMMAND.search(ended.out)


@pytest.mark.slow
def test_81_text_is_escaped_on_a_terminal(hostile: str, folder: Path) -> None:
    main, end = pty.openpty()
    command = [Path(sys.executable).with_name("simscen"), "run", hostile, "--out", "out"]
    child = subprocess.Popen(
        command, cwd=folder, stdin=end, stdout=end, stderr=end, env={**os.environ, "TERM": "xterm"}
    )
    os.close(end)
    shown = b""
    try:
        while piece := os.read(main, 65536):
            shown += piece
    except OSError:  # the other end of a terminal has been closed
        pass
    os.close(main)
    assert child.wait(timeout=60) == 1
    assert b"[/red]" in shown
    assert b"[link=https://example.org]here[/link]" in shown
    links = set(re.findall(rb"\x1b\]8;[^;]*;([^\x1b]+)\x1b", shown))
    home = f"file://{folder}/".encode()
    assert links and all(link.startswith(home) for link in links), "only files of the session can be clicked"


@pytest.mark.parametrize("name", ["[red]a", "]]>", "&amp;", "=cmd()", "%0A::x", "-x", "機械", "a,b"])
def test_81_file_names_are_escaped(simscen, folder: Path, name: str) -> None:
    (folder / "a.scenario.yaml").rename(folder / f"{name}.scenario.yaml")
    validated, listed = simscen("validate", "."), simscen("list", ".")
    assert (validated.code, listed.code) == (0, 0)
    assert name in listed.out
    assert not COMMAND.search(validated.out + listed.out)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("a b\u202ec", "control character U+202E in the file name"),
        ("a\nb", "control character U+000A in the file name"),
        ("\x1b[31m", "control character U+001B in the file name"),
        ("caf\udce9", "the file name is not valid UTF-8"),
    ],
)
def test_81_unprintable_names_are_refused(refused, simscen, folder: Path, name: str, message: str) -> None:
    (folder / "a.scenario.yaml").rename(folder / f"{name}.scenario.yaml")
    problems = refused(".")
    assert message in problems
    assert problems.isprintable() or problems.count("\n") == 2
    assert json.loads(simscen("validate", ".", "--format", "json").out)["problems"][0]["message"] == message


def test_81_names_of_logs_stay_on_one_line(simscen, folder: Path, log: Path) -> None:
    (folder / "logs").mkdir()
    log = log.rename(folder / "logs" / "a\n::error::x\n##[error]\x1b[31m.mcap")
    (folder / "logs" / "junk.mcap").write_text("junk")
    (folder / "limits.yaml").write_text("pass:\n  - speed: {max: 0.01 m/s}\n")
    for arguments in (log,), ("logs",), (log, "--scenario", "limits.yaml"), ("logs", "--scenario", "limits.yaml"):
        ended = simscen("judge", *arguments)
        assert not COMMAND.search(ended.out + ended.err), ended
        assert "\x1b" not in ended.out + ended.err


def test_82_output_of_a_crashed_worker_is_quoted(simscen, folder: Path, monkeypatch) -> None:
    monkeypatch.setattr("simscen.cli.session.fork_server_start.FORK_SERVER", (SCRIPTED_FORK_SERVER,))
    text = (folder / "a.scenario.yaml").read_text()
    (folder / "a.scenario.yaml").write_text(text.replace("seed: 7", "tags: [chatter]"))
    for kind in ("text", "github"):
        ended = simscen("run", "a.scenario.yaml", "--out", kind, "--format", kind)
        assert ended.code == 3
        assert "SIGKILL" in ended.out
        assert "set-output name=x" in ended.out
        assert all(ANNOTATION.fullmatch(line) for line in ended.out.splitlines() if COMMAND.search(line))
        assert "\x1b" not in ended.out
    junit = ElementTree.fromstring((folder / "text/junit.xml").read_bytes())
    assert "::set-output name=x::y" in junit.find(".//error").text
    page = Tags(without_own_script((folder / "text/report.html").read_text()))
    assert page.tags <= ALLOWED_TAGS


def test_83_annotations_of_validate_escape_what_github_reads(simscen, folder: Path) -> None:
    (folder / "a,b:c%d.scenario.yaml").write_text("simscen: 1\n'50 %, a:b': 1\n")
    lines = simscen("validate", "a,b:c%d.scenario.yaml", "--format", "github").out.splitlines()
    line = next(line for line in lines if "SC012" in line)
    assert ANNOTATION.fullmatch(line)
    assert line.startswith("::error file=a%2Cb%3Ac%25d.scenario.yaml,line=2,col=1,title=simscen SC012::")
    assert "50 %25, a:b" in line


def test_84_code_next_to_scenarios_is_not_executed(folder: Path) -> None:
    for module in ("yaml", "simscen", "sitecustomize", "usercustomize", "numpy", "pybullet", "json", "ompl", "typer"):
        (folder / f"{module}.py").write_text(f"open('marker', 'a').write('{module} ')\n")
    command = [Path(sys.executable).with_name("simscen"), "run", ".", "--out", "out"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert not list(folder.rglob("marker"))


def test_85_worker_environment_has_no_secrets(simscen, folder: Path, monkeypatch) -> None:
    monkeypatch.setattr("simscen.cli.session.fork_server_start.FORK_SERVER", (SCRIPTED_FORK_SERVER,))
    for name in ("GITHUB_TOKEN", "AWS_SECRET_ACCESS_KEY", "LD_PRELOAD_SECRET", "PYTHONPATH_SECRET"):
        monkeypatch.setenv(name, "hunter2")
    text = (folder / "a.scenario.yaml").read_text()
    (folder / "a.scenario.yaml").write_text(text.replace("seed: 7", "tags: [environment]"))
    assert simscen("run", "a.scenario.yaml", "--out", "out").code == 0
    (log,) = (folder / "out").rglob("worker.log")
    assert "PATH" in log.read_text()
    everything = b"".join(path.read_bytes() for path in (folder / "out").rglob("*") if path.is_file())
    assert b"hunter2" not in everything
