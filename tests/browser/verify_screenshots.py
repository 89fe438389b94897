"""Take the screenshot of the page of `simscen new --from-log --verify` for the docs (`make screenshots`)."""

import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
from screenshots import IMAGES, ROOT, browser, save

from simscen.loading.scenario import load_scenario
from simscen.reconstruction.scenario_from_log import ReconstructionOptions, scenario_from_log
from simscen.reconstruction.verification.comparison import compare_with_run
from simscen.reconstruction.verification.page import verification_page
from simscen.run.preparation import prepare
from simscen.run.simulate import simulate

SCENARIO = ROOT / "scenarios" / "corner_cases" / "goal_blocked_for_good.scenario.yaml"


def main() -> None:
    """Run a shipped scenario, reconstruct it from its log, run that, and take the screenshot of the page."""
    with tempfile.TemporaryDirectory(dir=ROOT / "scenarios") as folder, browser() as chromium:
        log, repeated_log, page = (Path(folder) / name for name in ("run.mcap", "again.mcap", "page.html"))
        simulate(prepare(load_scenario(SCENARIO, ROOT)), log=log)
        reconstruction = scenario_from_log(
            log, Path(folder) / "goal_blocked.scenario.yaml", ReconstructionOptions(root=ROOT)
        )
        simulate(prepare(load_scenario(reconstruction.file, ROOT)), log=repeated_log)
        comparison = compare_with_run(reconstruction, repeated_log)
        objects = reconstruction.contents.estimated.objects
        page.write_text(verification_page("goal blocked", reconstruction.static_world, objects, comparison))
        tab = chromium.new_context(viewport={"width": 1100, "height": 930}, color_scheme="light").new_page()
        tab.goto(page.as_uri())
        save(tab.screenshot(), IMAGES / "verified.png")


if __name__ == "__main__":
    main()
