"""It installs anywhere: what is missing on a machine is explained, and distributions hold what they should."""

import email
import re
import sys
import tarfile
import tomllib
import zipfile

import pytest
from packaging.requirements import Requirement
from packaging.version import Version

from tests.processes import ROOT, module_of, python

MOST_BYTES = 2_200_000
"""Of a wheel: an installation stays a matter of seconds."""
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]


@pytest.fixture
def setup():
    return module_of(ROOT / "tools" / "setup_venv.py")


@pytest.mark.parametrize("version", [(3, 10, 2), (3, 15, 0), (4, 0, 0), None])
def test_too_old_and_too_new_pythons_and_a_missing_ensurepip_are_explained(setup, monkeypatch, capsys, version):
    monkeypatch.setattr(setup.sys, "version_info", version or sys.version_info)
    monkeypatch.setitem(sys.modules, "ensurepip", None)
    with pytest.raises(SystemExit):
        setup.check_python()
    message = "needs Python 3.11 or later, before 3.15" if version else "apt-get install python3."
    assert message in capsys.readouterr().err


def pins(path):
    lines = (line for line in path.read_text().splitlines() if not line.startswith("#"))
    return {name.lower().replace("_", "-"): version for name, _, version in (line.partition("==") for line in lines)}


def test_every_environment_has_its_extras_and_the_same_torch(setup):
    for wanted in setup.WANTED.values():
        for extras in re.findall(r"\[(.*)\]", " ".join(wanted)):
            assert set(extras.split(",")) <= set(PROJECT["optional-dependencies"])
    for path in ROOT.glob("constraints*.txt"):
        assert pins(path).get("torch", "2.13.0") == "2.13.0"


def test_the_oldest_libraries_that_are_tested_are_the_oldest_that_are_allowed():
    """So that no bound is moved in pyproject.toml alone."""
    tested = pins(ROOT / "constraints-lowest.txt")
    extras = (PROJECT["optional-dependencies"][extra] for extra in ("analysis", "onnx", "render", "test", "tune"))
    for line in sum(extras, PROJECT["dependencies"]):
        wanted = Requirement(line)
        (low,) = (Version(one.version) for one in wanted.specifier if one.operator == ">=")
        assert Version(tested[wanted.name.lower().replace("_", "-")]) == low, line


@pytest.fixture(scope="module")
def distributions(tmp_path_factory):
    """Names in the source distribution, sizes by name in the wheel, and the text that a package index shows."""
    out = tmp_path_factory.mktemp("dist")
    python("-m", "build", "--no-isolation", "--outdir", out, ROOT)
    (sdist,), (wheel,) = out.glob("*.tar.gz"), out.glob("*.whl")
    with tarfile.open(sdist) as file:
        source = {name.partition("/")[2] for name in file.getnames()}
    with zipfile.ZipFile(wheel) as file:
        sizes = {one.filename: one.compress_size for one in file.infolist()}
        (metadata,) = (file.read(name).decode() for name in sizes if name.endswith("/METADATA"))
    return source, sizes, email.message_from_string(metadata)


def files(folder):
    paths = (path for path in (ROOT / folder).rglob("*") if path.is_file() and "__pycache__" not in path.parts)
    return {path.relative_to(ROOT).as_posix() for path in paths}


@pytest.mark.needs("build")
def test_the_source_distribution_holds_what_its_tests_need(distributions):
    source, _, _ = distributions
    for folder in ("uuv_marl", "tests", "tools", "perf", "docs"):
        assert files(folder) <= source
    assert {path.name for path in ROOT.glob("constraints*.txt")} | {"Makefile", "README.md", ".ci/run"} <= source


@pytest.mark.needs("build")
def test_the_wheel_is_the_package_with_its_data_and_licences_and_is_small(distributions):
    _, wheel, metadata = distributions
    assert {name for name in wheel if ".dist-info/" not in name} == files("uuv_marl")
    for licence in PROJECT["license-files"]:
        assert any(name.endswith(f".dist-info/licenses/{licence}") for name in wheel), licence
    assert metadata.get_all("License-File") == PROJECT["license-files"]
    assert not [name for name in wheel if "test" in name or name.endswith((".pyc", ".pt", ".pkl", ".nbi", ".log"))]
    assert sum(wheel.values()) < MOST_BYTES


@pytest.mark.needs("build")
def test_the_page_of_a_package_index_has_no_dead_links(distributions):
    metadata = distributions[2]
    page = metadata.get_payload()
    assert page.startswith("# uuv_marl")
    links = re.findall(r"\]\(([^)]*)\)", page)
    assert links
    assert all(link.startswith(("https:", "#")) for link in links)
    assert any("doi.org" in url for url in metadata.get_all("Project-URL"))
