"""Writes what mkdocs makes the site of (`make site`): documents, headers, notebooks, and what they lead to.

python -m tools.site_pages build/site/docs build/site/notebooks
"""

import json
import posixpath
import re
import shutil
import sys
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
DOCUMENTS = ("README.md", "CONTRIBUTING.md", "CHANGELOG.md", "docs/*.md", "examples/**/README.md")
HEADERS = ("firmware/bslam/bslam.h", "firmware/vision/vision.h")
LINK = re.compile(r"\]\((?!\w+:|#)([^)#\s]+)")
CODE = re.compile(r"(^```.*?^```$|`[^`\n]*`)", re.MULTILINE | re.DOTALL)
MATHS = re.compile(r"^\$\$(.+?)\$\$$|\$([^$\n]+)\$", re.MULTILINE | re.DOTALL)
FENCED_MATHS = re.compile(r"^```math\n(.*?)^```$", re.MULTILINE | re.DOTALL)
QUOTED_LIST = re.compile(r"^(> (?!- ).*)\n(?=> - )", re.MULTILINE)  # begins a paragraph to mkdocs
UNKNOWN_TEX = {r"\cr": r"\\", "{gathered}": "{matrix}", r"\arg": r"\mathrm{arg}"}  # of latex2mathml


def reference(header: Path) -> str:
    """A public header as a page: its comments are the manual."""
    page = [f"# {header.name}"]
    for block in header.read_text(encoding="utf-8").split("\n\n"):
        said = "\n".join(line[4:] for line in block.splitlines() if line.startswith("///"))
        code = "\n".join(line for line in block.splitlines() if not line.startswith("///"))
        name = re.search(r"^\} (\w+);|^\w[\w *]*?\b(\w+)\(|#define (\w+)", code, re.MULTILINE)
        if section := re.match(r"// -+ (.*?) -+$", block):
            page.append(f"## {section[1]}")
        elif code.startswith("#ifndef"):
            page.append(said)
        elif name is not None and (said or "typedef" in code):
            title = next(filter(None, name.groups()))
            page.append(f"### {title}\n\n" + said.replace("*", r"\*") + f"\n\n```c\n{code.strip()}\n```")
    return "\n\n".join(page)


def notebook(path: Path) -> Iterator[str]:
    """A notebook's cells, with what they printed and drew when they were last run."""
    for cell in json.loads(path.read_text(encoding="utf-8"))["cells"]:
        text = "".join(cell["source"])
        yield text if cell["cell_type"] == "markdown" else f"```python\n{text}\n```"
        for output in cell.get("outputs", ()):
            data = output.get("data", {"text/plain": output.get("text", "")})
            if "image/png" in data:
                yield f"![drawn](data:image/png;base64,{''.join(''.join(data['image/png']).split())})"
            elif printed := "".join(data.get("text/plain", "")).rstrip():
                yield f"```text\n{printed}\n```"


def pages(notebooks: Path = ROOT / "notebooks") -> dict[str, tuple[str, str]]:
    """Every page but the gallery: its place in the site, and its Markdown, by its path in the repository."""
    found = {str(path.relative_to(ROOT)): path for glob in DOCUMENTS for path in sorted(ROOT.glob(glob))}
    texts = {path: file.read_text(encoding="utf-8") for path, file in found.items()}
    texts |= {path: reference(ROOT / path) for path in HEADERS}
    texts |= {f"notebooks/{one.name}": "\n\n".join(notebook(one)) for one in notebooks.glob("*.ipynb")}
    return {path: (_place(path), text) for path, text in texts.items()}


def _place(path: str) -> str:
    if path in HEADERS:
        return f"reference/{Path(path).stem}.md"
    place = path.replace("/README.md", ".md").removeprefix("docs/").replace(".ipynb", ".md")
    return "index.md" if place == "README.md" else place


def linked(path: str, text: str, places: dict[str, str]) -> tuple[str, dict[str, str]]:
    """The page with links as the site has them; and the files that it needs, each with its place: pictures,
    and sources, which are shown as text.
    """
    files = {}

    def moved(link: re.Match[str]) -> str:
        target = posixpath.normpath(posixpath.join(posixpath.dirname(path), link[1]))
        target = f"{target}/README.md" if f"{target}/README.md" in places else target
        place = places.get(target) or f"{target.removeprefix('docs/')}"
        if target not in places:
            place = place if target.startswith("docs/") else f"source/{target}.txt"
            files[target] = place
        return "](" + posixpath.relpath(place, posixpath.dirname(places.get(path, "")) or ".")

    return LINK.sub(moved, text), files


def gallery(texts: dict[str, str]) -> str:
    """Every picture of the documents once, with its caption."""
    shown = {
        f"![{caption}]({posixpath.normpath(posixpath.join(posixpath.dirname(path), picture))})\n\n*{caption}*"
        for path, text in texts.items()
        for caption, picture in re.findall(r"!\[([^\]]+)\]\(([^):]+)\)", text)
    }
    return "\n\n".join(["# Gallery", *sorted(shown)])


def with_maths(text: str) -> str:
    """Equations as MathML, which browsers draw by themselves: no script, no font from elsewhere."""
    from latex2mathml.converter import convert  # here: only the site needs it

    def mathml(found: re.Match[str]) -> str:
        tex = found[1] or found[2]
        for ours, known in UNKNOWN_TEX.items():
            tex = tex.replace(ours, known)
        drawn = convert(tex, display="block" if found[1] else "inline")
        if wrong := re.search(r">(\\\w+)<", drawn):
            raise SystemExit(f"tools.site_pages: {tex!r}: {wrong[1]} is not known; add it to UNKNOWN_TEX")
        # In a span: what begins a line would be a block of its own.
        return f'<div class="equation">{drawn}</div>' if found[1] else f"<span>{drawn}</span>"

    parts = CODE.split(FENCED_MATHS.sub(r"$$\n\1$$", text))  # code stands at odd places
    return "".join(part if number % 2 else MATHS.sub(mathml, part) for number, part in enumerate(parts))


def main(folder: Path, notebooks: Path) -> int:
    """Write all pages, and what they lead to; notebooks: as they were run."""
    shutil.rmtree(folder, ignore_errors=True)
    written = pages(notebooks)
    written["gallery.md"] = ("gallery.md", gallery({path: text for path, (_, text) in written.items()}))
    places = {path: place for path, (place, _) in written.items()}
    for path, (place, text) in written.items():
        text, files = linked(path, QUOTED_LIST.sub(r"\1\n>\n", text), places)
        for file in (folder / name for name in (place, *files.values())):
            file.parent.mkdir(parents=True, exist_ok=True)
        (folder / place).write_text(with_maths(text) + "\n", encoding="utf-8")
        for source, copy in files.items():
            shutil.copyfile(ROOT / source, folder / copy)
    shutil.copyfile(ROOT / "docs" / "site.css", folder / "site.css")
    return 0


if __name__ == "__main__":
    sys.exit(main(*map(Path, sys.argv[1:])))
