"""Print how large the repository is: code, tests, words, tracked files, commands, names defined more than once."""

import ast
import io
import subprocess
import tokenize
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import typer

from uuv_marl.cli import app

ROOT = Path(__file__).resolve().parent.parent


def tracked() -> list[Path]:
    """Files that git tracks."""
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    return [path for name in listed.split("\0") if name and (path := ROOT / name).is_file()]


def code_lines(text: str) -> int:
    """Lines that are not blank and hold neither a comment alone nor a text that stands alone, as docstrings do."""
    alone = {
        line
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)
        for line in range(node.lineno, (node.end_lineno or node.lineno) + 1)
    }
    skipped = (tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER)
    tokens = [t for t in tokenize.generate_tokens(io.StringIO(text).readline) if t.type not in skipped]
    return len({line for t in tokens for line in range(t.start[0], t.end[0] + 1)} - alone)


def options(command: Any) -> int:
    """How many options a command and those in it have, without --help."""
    own = sum(one.param_type_name == "option" and one.name != "help" for one in command.params)
    return own + sum(options(inner) for inner in getattr(command, "commands", {}).values())


def twice(files: Sequence[Path]) -> list[str]:
    """Names of classes and public functions that more than one module defines, with how many do."""
    found = Counter(
        name
        for path in files
        for name in {
            node.name
            for node in ast.parse(path.read_text(encoding="utf-8")).body
            if isinstance(node, ast.ClassDef) or (isinstance(node, ast.FunctionDef) and not node.name.startswith("_"))
        }
    )
    return [f"{name} {count}" for name, count in found.most_common() if count > 1]


def main() -> None:
    """Print a line for each measure."""
    files = tracked()
    python = [path for path in files if path.suffix == ".py"]
    for folder in ("uuv_marl", "research"):
        own = [path.read_text(encoding="utf-8") for path in python if path.relative_to(ROOT).parts[0] == folder]
        lines = sum(len(text.splitlines()) for text in own)
        print(f"{folder}: {lines:,} lines, {sum(map(code_lines, own)):,} of code, {len(own)} files")
    tests = [path for path in python if "tests" in path.parts or path.name.startswith("test_")]
    print(f"tests: {sum(len(path.read_text(encoding='utf-8').splitlines()) for path in tests):,} lines")
    pages = [path for path in files if path.suffix == ".md" and path.relative_to(ROOT).parts[0] in ("docs", "perf")]
    pages += [path for path in files if path.suffix == ".md" and path.parent == ROOT]
    words = sum(len(path.read_text(encoding="utf-8").split()) for path in pages)
    print(f"pages: {words:,} words on {len(pages)} pages (*.md of the root, docs and perf)")
    print(f"tracked: {sum(path.stat().st_size for path in files) / 1e6:.1f} MB in {len(files)} files")
    command: Any = typer.main.get_command(app)
    print(f"commands: {len(command.commands)}, options: {options(command)}, those of train included")
    names = twice([path for path in python if path.relative_to(ROOT).parts[0] == "uuv_marl"])
    print(f"names in several modules: {len(names)}: {', '.join(names)}")


if __name__ == "__main__":
    main()
