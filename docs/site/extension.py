"""What the pages need beyond Sphinx: the navigation, pages of the source files that they link to, and index.html."""

import posixpath
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from autoapi._astroid_utils import is_local_import_from
from autoapi._parser import Parser
from docutils import nodes
from sphinx import addnodes
from sphinx.application import Sphinx

HERE = Path(__file__).resolve().parent
LANGUAGES = {".py": "python", ".toml": "toml", ".cff": "yaml", "": "text"}
"""How a source file is shown, by its suffix; a reader downloads every other file that a page links to."""
Page = tuple[str, dict[str, Any], str]


def add_navigation(app: Sphinx, docname: str, source: list[str]) -> None:
    """Append the tables of contents to the front page, which is the README as it is."""
    if docname == app.config.root_doc:
        source[0] += "\n" + (HERE / "navigation.txt").read_text(encoding="utf-8")


def link_sources(app: Sphinx, doctree: nodes.document) -> None:
    """Lead links to source files and folders to pages of this site that show them."""
    docname = app.env.docname
    shown: set[str] = set()
    folders = [link for link in doctree.findall(addnodes.pending_xref) if link["reftype"] == "myst"]
    for link in [*doctree.findall(addnodes.download_reference), *folders]:
        name, path = app.env.relfn2path(link["reftarget"], docname)
        if not Path(path).exists() or Path(path).suffix not in LANGUAGES:
            continue
        shown.add(name)
        address = posixpath.relpath(f"source/{name}.html", posixpath.dirname(docname) or ".")
        link.replace_self(nodes.reference("", "", *link.children, internal=True, refuri=address))
    app.env.metadata[docname]["sources"] = shown


def source_pages(app: Sphinx) -> Iterator[Page]:
    """A page for each source file that another page links to, and for each folder: all source files in it."""
    for name in sorted(set().union(*(data.get("sources", set()) for data in app.env.metadata.values()))):
        path = Path(app.srcdir, name)
        files = sorted(f for f in path.iterdir() if f.is_file() and f.suffix in LANGUAGES) if path.is_dir() else [path]
        body = f"<h1>{name}</h1>"
        for file in files:
            text = app.builder.highlighter.highlight_block(file.read_text(encoding="utf-8"), LANGUAGES[file.suffix])
            body += (f"<h2>{file.name}</h2>" if file != path else "") + text
        yield f"source/{name}", {"title": name, "body": body}, "page.html"


def look_up_exactly(app: Sphinx, doctree: nodes.document) -> None:
    """Link a type to the object of that full name, or of that name in its own module, and to no other's namesake."""
    for link in doctree.findall(addnodes.pending_xref):
        link.attributes.pop("refspecific", None)  # its mere presence, with any value, means a search


def skip_namesakes(app: Sphinx, what: str, name: str, obj: Any, skip: bool, options: list[str]) -> bool:
    """Leave an imported function out of the reference where a module has its full name: the module holds it."""
    home = Path(app.srcdir, *name.split("."))
    return skip or (what == "function" and (home.with_suffix(".py").exists() or home.is_dir()))


def read_if(parser: Parser, node: Any) -> list[dict[str, Any]]:
    """Names that a package imports ``if TYPE_CHECKING``, of which the public ones are in the reference, too."""
    read = [child for child in node.body if node.root().package and is_local_import_from(child, "uuv_marl")]
    return [found for child in read for found in parser._parse_local_import_from(child)]


def lead_code_home(app: Sphinx) -> Iterator[Page]:
    """Lead a module's code back to its own page, which names all that it defines, also where others export it."""
    modules = {name: entry for name, entry in getattr(app.env, "_viewcode_modules", {}).items() if entry}
    for name, (code, tags, used, _) in modules.items():
        modules[name] = code, tags, dict.fromkeys(used, f"api/{name.replace('.', '/')}/index"), name
    app.env._viewcode_modules = modules  # type: ignore[attr-defined]
    return iter(())


def write_index(app: Sphinx, failure: Exception | None) -> None:
    """A server shows index.html first."""
    front = Path(app.outdir, f"{app.config.root_doc}.html")
    if failure is None and front.exists():
        shutil.copy(front, front.with_name("index.html"))


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the handlers."""
    Parser.parse_if = read_if
    app.connect("html-collect-pages", lead_code_home, priority=100)
    app.connect("source-read", add_navigation)
    app.connect("doctree-read", link_sources, priority=100)
    app.connect("html-collect-pages", source_pages)
    app.connect("doctree-read", look_up_exactly)
    app.connect("autoapi-skip-member", skip_namesakes)
    app.connect("build-finished", write_index)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
