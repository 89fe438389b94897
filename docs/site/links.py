"""Links out of docs/ lead to the repository: files of GitHub are no pages of the site. Run by mkdocs (`hooks:`)."""

import re
from pathlib import Path
from posixpath import dirname, join, normpath

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.plugins import get_plugin_logger
from mkdocs.structure.files import Files
from mkdocs.structure.pages import Page

ROOT = Path(__file__).parents[2]
LINK = re.compile(r"(?<=\]\()(\.\.?/[^)\s#]*)")
log = get_plugin_logger("links")


def on_page_markdown(markdown: str, /, *, page: Page, config: MkDocsConfig, **_: Files) -> str:
    """Turn links of a page to files outside docs/ into addresses in the repository."""
    folder = dirname(f"docs/{page.file.src_uri}")

    def leads(match: re.Match[str]) -> str:
        path = normpath(join(folder, match[1]))
        if path.startswith("docs/"):
            return match[1]
        if not (ROOT / path).exists():
            log.warning("%s links to %s, which is not in the repository", page.file.src_uri, path)
        return f"{config.repo_url}/{'tree' if (ROOT / path).is_dir() else 'blob'}/main/{path}"

    return LINK.sub(leads, markdown)
