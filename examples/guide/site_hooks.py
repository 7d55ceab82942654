"""What the site of the guide has besides its pages: files of the repository that pages link to, the
reference of the program, and the list of verification cases.

Pages link to files by their places in the repository. Markdown pages that the site takes in (OUTSIDE),
pictures, and texts such as scenarios have places of their own on the site; links are turned to them.
"""
import os
import pathlib
import posixpath
import re
import shutil
import subprocess
import tempfile

from mkdocs.structure.files import File

ROOT = pathlib.Path(__file__).resolve().parents[2]
PAGES = ROOT / "examples" / "guide" / "pages"
OUTSIDE = {
    "results.md": "tests/verification/results.md",
    "methods.md": "tests/verification/methods.md",
    "changes.md": "CHANGELOG.md",
    "architecture.md": "ARCHITECTURE.md",
    "contributing.md": "CONTRIBUTING.md",
}
TITLES = {"results.md": "Results", "methods.md": "Which method when", "changes.md": "Changes"}
LINK = re.compile(r"(!?)\[([^\]]*)\]\(([^)\s]+)\)")
CODE = re.compile(r"^```.*?^```$|`[^`\n]*`", re.M | re.S)
LANGUAGES = {".json": "json", ".py": "python", ".slurm": "bash", ".sh": "bash", ".h": "cpp",
             ".cpp": "cpp"}
LEXERS = {"jsonc": "json", "console": "sh"}  # words of the pages, and what Pygments calls them
temporary = []
site_of = {}  # place in the repository -> place on the site


def place_of(source, target):
    """Where in the repository a link of the file `source` leads to."""
    path = os.path.normpath((source.parent / target).as_posix())
    return pathlib.Path(path)


def is_address(target):
    return target.startswith("#") or re.match(r"\w+:", target)


def links_of(source):
    text = CODE.sub("", source.read_text(encoding="utf-8"))
    for _, _, target in LINK.findall(text):
        if not is_address(target):
            yield place_of(source, target.partition("#")[0])


def source_page(place, folder):
    """A page that shows a text of the repository."""
    name = place.relative_to(ROOT).as_posix()
    language = LANGUAGES.get(place.suffix, "text")
    page = folder / "source" / f"{name}.md"
    page.parent.mkdir(parents=True, exist_ok=True)
    page.write_text(f"# {name}\n\n````{language}\n{place.read_text(encoding='utf-8')}\n````\n",
                    encoding="utf-8")
    return f"source/{name}.md", page


def on_files(files, config):
    folder = pathlib.Path(tempfile.mkdtemp(prefix="lahar-guide-"))
    temporary.append(folder)

    def add(site, place):
        file = File(site, str(PAGES), config["site_dir"], config["use_directory_urls"])
        file.abs_src_path = str(place)
        files.append(file)

    site_of.clear()
    site_of.update({ROOT / place: site for site, place in OUTSIDE.items()})
    site_of[ROOT / "README.md"] = "index.md"
    for site, place in OUTSIDE.items():
        add(site, ROOT / place)
    sources = sorted(PAGES.rglob("*.md")) + [ROOT / place for place in OUTSIDE.values()]
    for place in sorted({place for source in sources for place in links_of(source)}):
        if place in site_of or place.is_relative_to(PAGES) or not place.is_file():
            continue
        if place.suffix in (".png", ".svg"):
            site, source = f"pictures/{place.name}", place
        else:
            site, source = source_page(place, folder)
        site_of[place] = site
        add(site, source)
    return files


def with_site_links(markdown, source, page):
    def turned(match):
        exclamation, text, target = match.groups()
        if is_address(target):
            return match.group(0)
        path, hash_, anchor = target.partition("#")
        place = place_of(source, path)
        if place.is_relative_to(PAGES):
            site = place.relative_to(PAGES).as_posix()
        elif place in site_of:
            site = site_of[place]
        else:
            return text  # a folder
        site = posixpath.relpath(site, posixpath.dirname(page) or ".")
        return f"{exclamation}[{text}]({site}{hash_}{anchor})"

    parts, at = [], 0
    for code in CODE.finditer(markdown):
        parts += [LINK.sub(turned, markdown[at:code.start()]), code.group(0)]
        at = code.end()
    return "".join(parts) + LINK.sub(turned, markdown[at:])


def reference():
    program = pathlib.Path(os.environ.get("LAHAR_PROGRAM", ROOT / "build/release/lahar"))
    if not program.exists():
        return "\n*This site was built without the program, and so without its reference.*\n"
    text = subprocess.run([program, "info", "--reference"], check=True, capture_output=True,
                          text=True).stdout
    return text.partition("\n")[2]


def verification_cases():
    lines = ["| case | test |", "|---|---|"]
    for file in sorted((ROOT / "tests/verification").glob("*.cpp")):
        source = file.read_text(encoding="utf-8")
        for name in re.findall(r'TEST_CASE(?:_TEMPLATE)?\(\s*"([^"]+)"', source):
            long = " (long)" if file.name.startswith("slow_") else ""
            lines.append(f"| {name.replace('|', '&#124;')} | `{file.name}`{long} |")
    return "\n".join(lines) + "\n"


def on_page_markdown(markdown, page, config, files):
    source = pathlib.Path(page.file.abs_src_path)
    site = page.file.src_uri
    if not site.startswith("source/"):
        markdown = with_site_links(markdown, source, site)
    if site == "reference.md":
        markdown += reference()
    if site == "verification.md":
        markdown += "\n" + verification_cases()
    if site in TITLES:
        page.title = TITLES[site]
        page.meta["hide"] = ["toc"]  # their tables are wide
    for name, lexer in LEXERS.items():
        markdown = re.sub(rf"^```{name}\b", f"```{lexer}", markdown, flags=re.M)
    return markdown


def on_post_build(config):
    shutil.rmtree(temporary.pop(), ignore_errors=True)
