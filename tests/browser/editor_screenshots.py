"""Take the screenshot of the editor for the docs (`make screenshots`)."""

import sys
import threading
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
from screenshots import IMAGES, ROOT, browser, save

from simscen.cli.session.backends import backend_of
from simscen.editor.document import EditedFile
from simscen.editor.server import EditorServer
from simscen.editor.session import EditorSession
from simscen.run.sessions.run_session import SessionOptions

TEXT = """\
simscen: 1
name: house
description: A person crosses the corridor while the robot drives to the kitchen.
world:
  simscen: 1
  map: ../worlds/house_last_year.yaml
  regions:
    corridor: [[0, 4.2], [12, 4.2], [12, 5.7], [0, 5.7]]
robot:
  pose: {x: 0.80, y: 4.95, yaw: 0 deg}
goals:
  - {name: kitchen, pose: {x: 9.0, y: 1.8, yaw: -90 deg}, timeout: 60 s}
events:
  - name: anna crosses
    when: {robot_within: {of: [2.9, 4.9], distance: 1.2 m}}
    do: {pedestrian: {name: anna, pose: {x: 6.0, y: 5.2}, goals: [[3.6, 4.7], [3.3, 6.6]], speed: 0.8 m/s}}
pass:
  - goals_reached: {}
  - collisions: {max: 0}
"""


def main() -> None:
    """Open a scenario in the editor, and take a screenshot with the light theme."""
    file = ROOT / "scenarios" / "house.scenario.yaml"
    session = EditorSession(EditedFile(file, "scenario", ROOT), lambda: backend_of(SessionOptions()), TEXT)
    with EditorServer(session) as server, browser() as chromium:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        tab = chromium.new_context(viewport={"width": 1280, "height": 760}, color_scheme="light").new_page()
        tab.goto(server.url)
        tab.wait_for_selector("html[data-checked]", state="attached")
        tab.get_by_role("button", name="anna at").click()
        tab.wait_for_timeout(1000)
        save(tab.screenshot(), IMAGES / "edit.png")
        server.shutdown()
        server.stop_runs()


if __name__ == "__main__":
    main()
