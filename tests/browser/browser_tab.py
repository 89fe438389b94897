"""Tabs of a browser, with a check for logged errors and for requests of other files."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

TabOpener = Callable[..., "BrowserTab"]
TIMEOUT_MS = 30_000
"""Maximum time in ms for a condition of the page to become true."""
SEVERE_IMPACTS = ("serious", "critical")


class Pages:
    """Blank pages, each in a separate browser context. Pages of files are reused, because new pages take long."""

    def __init__(self, browser: Any) -> None:
        self._browser = browser
        self._blank: list[Any] = []

    def open(self, size: tuple[int, int], scheme: str) -> Any:
        """Return a blank page."""
        viewport = {"width": size[0], "height": size[1]}
        if not self._blank:
            context = self._browser.new_context(viewport=viewport, color_scheme=scheme, bypass_csp=False, offline=False)
            context.set_default_timeout(TIMEOUT_MS)
            return context.new_page()
        page = self._blank.pop()
        page.set_viewport_size(viewport)
        page.emulate_media(color_scheme=scheme)
        return page

    def release(self, page: Any) -> None:
        """Keep the page of a file, which stores nothing. Close the page of a server, which may have unsaved edits."""
        if not page.url.startswith("file:"):
            page.context.close()
            return
        page.goto("about:blank")
        self._blank.append(page)


class BrowserTab:
    """Tab with a page from a file or a local server.

    page: page object of Playwright
    """

    def __init__(self, pages: Pages, file: Path | str, size: tuple[int, int], dark: bool, fragment: str) -> None:
        self._pages, self.page = pages, pages.open(size, "dark" if dark else "light")
        self._complaints: list[str] = []
        self._uri = file if isinstance(file, str) else file.resolve().as_uri()
        self._listeners = {
            "console": self._on_console,
            "pageerror": lambda error: self._complaints.append(f"error: {error}"),
            "request": self._on_request,
            "dialog": lambda dialog: (self._complaints.append(f"dialog: {dialog.message}"), dialog.dismiss()),
        }
        for event, listener in self._listeners.items():
            self.page.on(event, listener)
        self.page.goto(self._uri + fragment)

    def until(self, condition: str) -> None:
        """Wait until an expression is true. Playwright's wait would need `eval`, which the page forbids."""
        from playwright.sync_api import Error  # tests are skipped without Playwright

        for _ in range(TIMEOUT_MS // 20):
            try:
                if self.page.evaluate(condition):
                    return
            except Error as error:
                if "context was destroyed" not in str(error):  # the page has reloaded
                    raise
            self.page.wait_for_timeout(20)
        raise AssertionError(f"never true: {condition}")

    def severe_findings(self, axe: str) -> list[str]:
        """Return the serious and critical findings of axe-core: rule, element, and summary."""
        self.page.evaluate(axe)  # Playwright can evaluate it without a change of the content security policy
        results = self.page.evaluate("axe.run(document, {resultTypes: ['violations']})")
        return [
            f"{violation['id']}: {node['target']} {node['failureSummary']}"
            for violation in results["violations"]
            if violation["impact"] in SEVERE_IMPACTS
            for node in violation["nodes"]
        ]

    def ignore_complaints(self, prefix: str) -> None:
        """Ignore complaints that the test itself causes; at least one complaint must have the prefix."""
        assert any(complaint.startswith(prefix) for complaint in self._complaints)
        self._complaints = [complaint for complaint in self._complaints if not complaint.startswith(prefix)]

    def close(self) -> list[str]:
        """Close the page, and return its errors, warnings, dialogs, and requests of other files."""
        self._pages.release(self.page)
        for event, listener in self._listeners.items():
            self.page.remove_listener(event, listener)
        return self._complaints

    def _on_console(self, message: Any) -> None:
        if message.type in ("error", "warning"):
            self._complaints.append(f"console: {message.text}")

    def _on_request(self, request: Any) -> None:
        is_own = (
            request.url.startswith(self._uri)
            if self._uri.startswith("http:")
            else request.url.split("#")[0] == self._uri
        )
        if not is_own and not request.url.startswith(("data:", "blob:")):
            self._complaints.append(f"request: {request.url}")
