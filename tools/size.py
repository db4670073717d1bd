"""How large the repository is: lines of code, words of documentation, small files.

Run it as `python tools/size.py`. A line of code is neither blank nor comment nor docstring.
"""

from __future__ import annotations

import ast
import tokenize
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
SMALL = 30  # lines of code
EMPTY = {"ENCODING", "COMMENT", "NL", "NEWLINE", "INDENT", "DEDENT", "ENDMARKER"}  # tokens


def docstrings(tree: ast.AST) -> set[int]:
    """Lines that docstrings stand on."""
    found = [
        node.body[0]
        for node in ast.walk(tree)
        if isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef))
        and ast.get_docstring(node, clean=False) is not None
    ]
    return {line for one in found for line in range(one.lineno, (one.end_lineno or 0) + 1)}


def code_lines(path: Path) -> int:
    """Lines of code in a file."""
    with tokenize.open(path) as file:
        tokens = list(tokenize.generate_tokens(file.readline))
    kept = [one for one in tokens if tokenize.tok_name[one.type] not in EMPTY]
    lines = {line for one in kept for line in range(one.start[0], one.end[0] + 1)}
    return len(lines - docstrings(ast.parse(path.read_text("utf-8"))))


def main() -> None:
    """Print the sizes."""
    source, tests = (
        {path: code_lines(path) for path in sorted((ROOT / name).rglob("*.py"))}
        for name in ("src", "tests")
    )
    small = [path for path in source if source[path] < SMALL and path.stem != "__init__"]
    pages = [ROOT / "README.md", *(ROOT / "docs").rglob("*.md")]
    words = sum(len(page.read_text("utf-8").split()) for page in pages)
    print(f"lines of code: {sum(source.values())} in src, {sum(tests.values())} in tests")
    print(f"words in README and docs: {words}")
    print(f"files in src with fewer than {SMALL} lines of code: {len(small)}")


if __name__ == "__main__":
    main()
