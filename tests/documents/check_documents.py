"""Holds the pages (*.md) to what is there, and first shows that it would see a page that is wrong.

What it asks for: each link of a page leads to a file or folder of the tree, and to a heading of it where it names one;
each path of a source file and each measurement that a page names is there; each page that a source file names is there. There are at most
PAGES pages in docs, and at most WORDS words in all pages.
"""
import pathlib
import re
import sys
import tempfile

PAGES, WORDS = 12, 20000
CODE = re.compile(r"^```.*?^```", re.M | re.S)
LINK = re.compile(r"\]\(([^)\s]+)\)")
PATH = re.compile(r"`([\w./-]+/[\w.-]+\.(?:hpp|cuh|cpp|cu|py|txt|json|js|sh))`")
PAGE = re.compile(r"\bdocs/(\w+\.md)")
RESULT = re.compile(r"`([a-z0-9_]+\.json)`")
# What the program reads and writes; any other name is of a measurement.
FILES = {"cameras.json", "config.json", "exposures.json", "history.json", "keyframes.json", "metrics.json", "poses.json",
         "poses_test.json", "transforms.json", "transforms_test.json", "transforms_train.json"}
# Where the paths of a page may begin.
ROOTS = ("", "include/gart", "src", "backends", "tests", "program", "bench")
SOURCES = ("backends", "bench", "cmake", "examples", "include", "program", "scripts", "src", "tests")
SUFFIXES = {".hpp", ".cuh", ".cpp", ".cu", ".py", ".js", ".cmake", ".sh", ".txt"}


def pages_of(root):
    return sorted(p for folder in ("", "docs", "tests", "examples", "bench") for p in
                  (root.glob("*.md") if not folder else (root / folder).rglob("*.md")) if "node_modules" not in p.parts)


def anchors(page):
    """Of its headings, as GitHub makes them."""
    headings = re.findall(r"^#+ (.*)$", CODE.sub("", page.read_text()), re.M)
    return {re.sub(r"[^\w\- ]", "", h.lower()).replace(" ", "-") for h in headings}


def faults_of_page(root, page):
    text, name = page.read_text(), page.relative_to(root)
    for link in LINK.findall(CODE.sub("", text)):
        if re.match(r"\w+:", link):
            continue
        target, _, anchor = link.partition("#")
        there = (page.parent / target).resolve() if target else page
        if not there.exists():
            yield f"{name}: the link {link} leads nowhere"
        elif anchor and anchor not in anchors(there):
            yield f"{name}: the link {link} names no heading of that page"
    for path in PATH.findall(text):
        # A word of capitals stands for a name.
        if re.search(r"(?<![A-Za-z])[A-Z]{3,}", path) or any((root / start / path).exists() for start in ROOTS):
            continue
        if path.split("/")[0] in {p.name for start in ROOTS for p in (root / start).iterdir() if p.is_dir()}:
            yield f"{name}: {path} is not there"
    for result in set(RESULT.findall(text)) - FILES:
        if not (root / "bench/results" / result).exists():
            yield f"{name}: bench/results/{result} is not there"


def faults(root):
    pages = pages_of(root)
    for page in pages:
        yield from faults_of_page(root, page)
    for source in sorted(p for folder in SOURCES for p in (root / folder).rglob("*")):
        if source.suffix in SUFFIXES and source.is_file() and "node_modules" not in source.parts:
            for page in PAGE.findall(source.read_text(errors="replace")):
                if not (root / "docs" / page).exists():
                    yield f"{source.relative_to(root)}: docs/{page} is not there"
    count = len(list((root / "docs").glob("*.md")))
    if count > PAGES:
        yield f"docs: {count} pages, at most {PAGES}: merge two"
    # The bars and rules of tables are none.
    words = sum(len(re.findall(r"\S*\w\S*", page.read_text())) for page in pages)
    if words > WORDS:
        yield f"the pages have {words} words, at most {WORDS}: say it shorter"


def check_the_check():
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder)
        for name in ("docs", *(r for r in ROOTS if r), *SOURCES):
            (root / name).mkdir(parents=True, exist_ok=True)
        (root / "include/gart/math").mkdir()
        (root / "README.md").write_text("# A page\n[a](docs/" "b.md#one) [b](docs/" "c.md) [c](#no) `math/x.hpp` "
                                        "`math/NAME.hpp` `gone.json` `config.json`")
        (root / "docs" / "b.md").write_text("# Two\n" + "word " * WORDS)
        (root / "program/x.cpp").write_text("// docs/" + "gone.md")
        found = list(faults(root))
        if len(found) != 7:
            sys.exit("the check of the pages does not see what it should: " + "; ".join(found))


if __name__ == "__main__":
    check_the_check()
    found = list(faults(pathlib.Path(sys.argv[1]).resolve()))
    sys.exit("\n".join(found) if found else 0)
