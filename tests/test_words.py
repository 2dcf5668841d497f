"""Pages and messages use the field's terms: each expression below is a private sense of a word, with its exceptions."""

import ast
import re

import pytest

from tests.processes import ROOT

PAGES = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md")])
SAID = ("log", "say", "echo", "print", "secho")
"""Functions whose texts a user reads, beside those of errors and ``help=``."""
WORDS = {
    r"\bgrant(s|ed)?\b": r"\bresearch grants?\b",
    r"\b(is|are|was|were|be|been|never) told\b|\btells? (the|a|its|every|each|which|how|where)\b(?! difference)": "",
    r"\btold (apart|of|by|beyond)\b|\btells?\b[^.;:|]{0,30}\bapart\b": "",
    r"\b(vehicles?|swarms?|robots?|agents?|neighbours?|polic(y|ies))\b,? (for |of |to )?whom?\b": "",
    r"(?:^|[.;:] |\| )Who(m|se)?\b(?![^.|]*\?)": "",
    r"\b(no|every|any|some)body\b": "",
    r"\bwish(ed|es)?\b": "",
    r"\b(anew|deaf)\b|\bfor once\b": r"--anew\b",
    r"\b(hears?|heard|hearing)\b": "",
    r"\b(ears?|desks?)\b": "",
    r"\broom (to work|for (draws|half-planes|a choice|all))\b|\brooms? of (its|their) own\b": "",
    r"\b(pays?|paid|payments?|paying)\b": r"\bpay(s|ing)? (attention|off)\b|\bpaid (for|by) (the )?licen[cs]e\b",
    r"\blessons?\b": r"\bLessons from\b",
    r"\bteachers?\b|\b(is|are|was|were) taught\b": "",
    r"\b(the|a|this|each|our|its|any|every|best|strongest|paper's|hand-made) laws?\b|\blaws\b": (
        r"\blaws? of (physics|motion|thermodynamics|large numbers)\b|\b(control|power) laws?\b"
    ),
    r"\bfree ways?\b|\bthe way (to|from|through|past|of|is|leads)\b|\bways? (through|that leads?|to go)\b"
    r"|\bshortest ways?\b": r"\bon the way (to|from)\b|\bthe way to (use|do|write|run|install)\b",
    r"\b(came|comes?) there\b|\b(came|comes?) to (a|the|its|their) goals?\b": "",
    r"(?<!if )\b(?!there )\w+ (is|are|was|were|be|been) there\b(?! (is|are|was|were|an?|any|no|more|other)\b)": r"\?",
    r"\bwhole swarms\b|\bswarms? (is|are|was|were) whole\b|\bswarms? whole\b": "",
    r"\buntouched\b|\btouch(es|ed|ing)? (nothing|anything|something)\b": "",
    r"\bcontacts?\b": r"\bcontact (us|the|form|details|force)\b|\bprivate contact\b|\bcontacts? in\b",
    r"\bcontrol holds?\b": "",
    r"\bthe sea\b|\bseas\b|\bat sea\b": r"\b(under|over) the sea\b",
    r"\bcourses?\b": r"\b(of|in the|in due|collision) course\b|\bcourse (stability|angle|over ground|keeping)\b",
    r"\bmend(s|ed|ing)?\b": "",
    r"\bdraws? the (same|next) (maps?|sea)\b|\bdraws of\b": "",
    r"\b(goe?s?|went|gone) astray\b|\bknows? (itself|of itself|where it is)\b": "",
    r"\bbeside (a|the|its) network\b|\baround a law\b": "",
    r"\b(is|are) no (?!longer|later|more|less|other|\w+er\b|worse|one\b)[a-z]+\b": r"\b[Tt]here (is|are) no\b",
    r"\bma(kes?|de) good\b|\bma(kes?|de) up for\b": "",
    r"\bpull(s|ed)? to(wards)? (the|a|its) (teacher|expert)\b": "",
}
"""Private senses, without regard to case, with what may stand in their place in a sentence."""
CODE = re.compile(
    r"```.*?```|<!-- (\w+) -->.*?<!-- /\1 -->|<!--.*?-->|`[^`]*`|(?<=\])\([^)\s]*\)|https?://\S+", re.DOTALL
)


def private(text):
    """Private senses in a text, each with the words around it."""
    found = []
    for wrong, allowed in WORDS.items():
        for match in re.finditer(wrong, text, re.IGNORECASE | re.MULTILINE):
            around = text[max(0, match.start() - 30) : match.end() + 30]
            if not (allowed and re.search(allowed, around, re.IGNORECASE)):
                found.append(" ".join(around.split()))
    return found


def messages(path):
    """Texts of a module that users read, with their lines: of errors, of ``SAID`` and of ``help=``."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        said = []
        if isinstance(node, ast.Raise) and node.exc:
            said = [node.exc]
        elif isinstance(node, ast.Call):
            name = getattr(node.func, "attr", getattr(node.func, "id", ""))
            said = node.args if name in SAID else [word.value for word in node.keywords if word.arg == "help"]
        for part in (inner for text in said for inner in ast.walk(text)):
            if isinstance(part, ast.Constant) and isinstance(part.value, str):
                yield part.lineno, part.value


@pytest.mark.docs
@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_a_page_uses_the_terms_of_the_field(page):
    assert private(CODE.sub("`x`", page.read_text(encoding="utf-8"))) == []


@pytest.mark.docs
def test_messages_use_the_terms_of_the_field():
    modules = sorted((ROOT / "uuv_marl").rglob("*.py"))
    found = [(f"{path.relative_to(ROOT)}:{line}", words) for path in modules for line, text in messages(path)
             for words in private(text)]  # fmt: skip
    assert found == []


@pytest.mark.docs
@pytest.mark.parametrize("text", [
    "Vehicles move in water_velocity under a control law.", "There is no obstacle.", "Is there a way to stop?",
    "Vehicles whose goals lie in sea water drift.", "What is there to see?", "We recommend amendments.",
    "Of course, the collision course is stable.", "It is no longer needed; it is no faster than NumPy.",
    "Contact the maintainers, who are volunteers.", "The way that a policy acts is fixed.",
    "A force beyond the limit is clipped.", "Who is it for?", "People who train policies start here.",
])  # fmt: skip
def test_plain_english_is_not_refused(text):
    assert private(text) == []


@pytest.mark.docs
@pytest.mark.parametrize("text", [
    "the best law", "a vehicle who hears nobody", "The swarm was whole.", "Each contact costs.", "policies at sea",
    "the sampled course", "it is paid for arriving", "vehicles that are there", "a file is no TOML", "mend it",
])  # fmt: skip
def test_private_senses_are_found(text):
    assert private(text)


def test_pages_that_the_code_names_exist():
    for source in (path for folder in ("uuv_marl", "perf", "tools") for path in (ROOT / folder).rglob("*.py")):
        for name in re.findall(r"\bdocs/[\w./-]+", source.read_text(encoding="utf-8")):
            assert (ROOT / name.rstrip(".")).exists(), f"{source} names {name}"
