"""What the documentation site needs beside MkDocs: formulas as MathML, and pages that are kept elsewhere in the repository."""

from __future__ import annotations

import html
import json
import re
from pathlib import Path
from typing import TYPE_CHECKING

from latex2mathml.converter import convert

if TYPE_CHECKING:
    from mkdocs.config.defaults import MkDocsConfig
    from mkdocs.structure.files import Files
    from mkdocs.structure.pages import Page

ELSEWHERE = {
    "contributing.md": "CONTRIBUTING.md",
    "changelog.md": "CHANGELOG.md",
    "speed-beside-others.md": "bench/peers/README.md",
    "hidden-worlds.md": "bench/hidden/README.md",
    "equations.md": "python/armrs/thesis/equations.md",
}
"""Pages of the site by the files that they are made of, from the root of the repository."""
UNSOUGHT = {*ELSEWHERE, "architecture.md", "developer.md", "dossier.md", "performance.md"}
"""Pages that the search leaves out: a reader's browser loads its index with the first page, and these are not what is looked for."""
WHOLE = 2000
"""Characters of a section whose paragraphs the search shows as they are; of what follows in a long section it has each word once."""
_WORD = re.compile(r"[^\W\d][\w.-]*\w")
_PROSE = re.compile(r"(<(?:p|ul|ol)\b.*?</(?:p|ul|ol)>)", flags=re.S)
_NAMED_BLOCK = re.compile(r"^```(\w+) ([^\n\"=]+)$", flags=re.M)
_PICTURE = re.compile(r'(<img [^>]*\bsrc="([^"]+)"[^>]*>)')
_FORMULA = re.compile(r'<(span|div) class="arithmatex">\\[(\[](.*?)\\[)\]]</\1>', flags=re.S)


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages that are kept elsewhere."""
    from mkdocs.structure.files import File

    root = Path(config.config_file_path).parent
    for name, source in ELSEWHERE.items():
        files.append(File.generated(config, name, abs_src_path=str(root / source)))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Point links that leave the folder of the documents to the pages of the site."""
    # `toml model.toml` names the file that a block shows; the site shows it as a title.
    markdown = _NAMED_BLOCK.sub(r'```\1 title="\2"', markdown)
    for name, source in ELSEWHERE.items():
        markdown = markdown.replace(f"](../{source}", f"]({name}")
    if page.file.src_uri in UNSOUGHT:
        page.meta["search"] = {"exclude": True}
    if page.file.src_uri in ELSEWHERE:
        # Written from the root of the repository, or from two folders below it.
        markdown = re.sub(r"\]\((?:\.\./\.\./)?docs/", "](", markdown)
        markdown = re.sub(r"\[([^]]*)\]\((?!https?:|#)(?:[^)]*/[^)]*|\w+\.toml)\)", r"\1", markdown)
    return markdown


def on_page_content(html_text: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Set formulas as MathML, which browsers show without a script, and let figures be opened."""

    def formula(found: re.Match[str]) -> str:
        block = found[1] == "div"
        text = convert(html.unescape(found[2]).strip(), display="block" if block else "inline")
        # A formula that is wider than a phone scrolls, also from the keyboard.
        return text.replace("<math ", '<math tabindex="0" ', 1) if block else text

    # A figure is small on a phone; touched, it opens by itself. A corner without a heading is no heading.
    return _PICTURE.sub(r'<a href="\2">\1</a>', _FORMULA.sub(formula, html_text)).replace("<th></th>", "<td></td>")


def on_post_page(output: str, page: Page, config: MkDocsConfig) -> str:
    """Name the dialog of the theme that has no name."""
    return _named_dialog(output)


def on_post_template(output: str, template_name: str, config: MkDocsConfig) -> str:
    """Do the same in pages that are made of no Markdown."""
    return _named_dialog(output)


def on_post_build(config: MkDocsConfig) -> None:
    """Shorten the index of the search, which a browser loads with the first page."""
    path = Path(config.site_dir) / "search" / "search_index.json"
    index = json.loads(path.read_text(encoding="utf-8"))
    for entry in index["docs"]:
        entry["text"] = _searched(entry["text"], summary=entry["location"].startswith("api.html"))
    path.write_text(json.dumps(index, ensure_ascii=False, separators=(",", ":")), encoding="utf-8")


def _searched(text: str, *, summary: bool) -> str:
    """Return what is searched of a section: its first paragraphs, and each word of the others, of its tables and its code once.

    Of the Python API it is one paragraph.
    """
    kept, rest, length = [], [], 0
    for k, block in enumerate(_PROSE.split(text)):
        plain, prose = re.sub("<[^>]+>", " ", block), k % 2 == 1
        if prose and plain.strip() and length <= WHOLE:
            kept.append(f"<p>{' '.join(plain.split())}</p>")
            length += len(plain)
        else:
            rest += _WORD.findall(html.unescape(plain))
    if summary:
        return "".join(kept[:1])
    shown = set(_WORD.findall(html.unescape(" ".join(kept))))
    words = [word for word in dict.fromkeys(rest) if word not in shown]
    return "".join(kept) + (f"<p>{' '.join(words)}</p>" if words else "")


def _named_dialog(output: str) -> str:
    dialog = 'data-md-component="search" role="dialog"'
    return output.replace(dialog, f'{dialog} aria-label="Search"')
