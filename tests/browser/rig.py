"""A file that is open in a browser, with all that it complains about."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

Opener = Callable[..., "Opened"]
PATIENCE = 30_000
"""Milliseconds until a page that does nothing is taken for dead: no measure of its speed."""
GRAVE = ("serious", "critical")


class Opened:
    """A page in a context of its own, from a file or from a local server. `page` is Playwright's."""

    def __init__(self, browser: Any, file: Path | str, size: tuple[int, int], dark: bool, where: str) -> None:
        scheme = "dark" if dark else "light"
        width, height = size
        self._context = browser.new_context(
            viewport={"width": width, "height": height}, color_scheme=scheme, bypass_csp=False, offline=False
        )
        self._context.set_default_timeout(PATIENCE)
        self.page = self._context.new_page()
        self._complaints: list[str] = []
        self._uri = file if isinstance(file, str) else file.resolve().as_uri()
        self.page.on("console", self._heard)
        self.page.on("pageerror", lambda error: self._complaints.append(f"error: {error}"))
        self.page.on("request", self._requested)
        self.page.on("dialog", lambda dialog: (self._complaints.append(f"dialog: {dialog.message}"), dialog.dismiss()))
        self.page.goto(self._uri + where)

    def until(self, holds: str) -> None:
        """Wait until an expression holds; Playwright's own way needs `eval`, which a strict policy forbids."""
        from playwright.sync_api import Error  # those who have no browser skip

        for _ in range(PATIENCE // 20):
            try:
                if self.page.evaluate(holds):
                    return
            except Error as error:
                if "context was destroyed" not in str(error):  # a page that loads itself anew
                    raise
            self.page.wait_for_timeout(20)
        raise AssertionError(f"never held: {holds}")

    def grave_findings(self, axe: str) -> list[str]:
        """What axe-core finds serious or critical: rule, element, and what it says."""
        self.page.evaluate(axe)  # put in by the driver, so the page's policy stays as it is
        found = self.page.evaluate("axe.run(document, {resultTypes: ['violations']})")
        return [
            f"{one['id']}: {node['target']} {node['failureSummary']}"
            for one in found["violations"]
            if one["impact"] in GRAVE
            for node in one["nodes"]
        ]

    def forgive(self, start: str) -> None:
        """Take back the complaints that begin so, for a test that provokes them; there has to be one."""
        assert any(complaint.startswith(start) for complaint in self._complaints)
        self._complaints = [complaint for complaint in self._complaints if not complaint.startswith(start)]

    def close(self) -> list[str]:
        """Close it; all that it complained about and asked for."""
        self._context.close()
        return self._complaints

    def _heard(self, message: Any) -> None:
        if message.type in ("error", "warning"):
            self._complaints.append(f"console: {message.text}")

    def _requested(self, request: Any) -> None:
        own = (
            request.url.startswith(self._uri)
            if self._uri.startswith("http:")
            else request.url.split("#")[0] == self._uri
        )
        if not own and not request.url.startswith(("data:", "blob:")):
            self._complaints.append(f"request: {request.url}")
