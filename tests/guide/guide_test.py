#!/usr/bin/env python3
"""The guide, README and the other pages of the repository: their links lead somewhere, README is short,
lines are not long. Where mkdocs is installed, the site is built, and needs nothing from the network; where
Chromium is, its search and its colours are tried.

    guide_test.py [PROGRAM]     without PROGRAM no site is built
"""
import functools
import html.parser
import http.server
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import threading
import urllib.parse

SKIPPED = 77
ROOT = pathlib.Path(__file__).resolve().parents[2]
PAGES = ROOT / "examples" / "guide" / "pages"
LONGEST_README, LONGEST_LINE = 150, 120
LINK = re.compile(r"\[[^\]]*\]\(([^)\s]+)\)")
CODE = re.compile(r"^```.*?^```$|^    [^\n]*$|`[^`\n]*`", re.M | re.S)
failures = []


def fail(text):
    failures.append(text)
    print(f"FAILED: {text}")


def anchors(page):
    """Words by which headings are reached, as mkdocs and forges make them."""
    found = set()
    for heading in re.findall(r"^#+ (.*)$", re.sub(r"^```.*?^```$", "", page.read_text("utf-8"),
                                                   flags=re.M | re.S), re.M):
        words = re.sub(r"[^\w\s-]", "", heading.replace("`", "")).strip().lower()
        found.add(re.sub(r"\s+", "-", words))
    return found


def check_links(page):
    for target in LINK.findall(CODE.sub("", page.read_text("utf-8"))):
        if re.match(r"\w+:", target):
            continue
        path, _, anchor = target.partition("#")
        place = (page.parent / path) if path else page
        if not place.exists():
            fail(f"{page.relative_to(ROOT)} links to {target}, which is not there")
        elif anchor and anchor not in anchors(place):
            fail(f"{page.relative_to(ROOT)} links to {target}: there is no such heading")


def check_lines(page):
    code = False
    for number, line in enumerate(page.read_text("utf-8").splitlines(), 1):
        code ^= line.startswith("```")
        if len(line) > LONGEST_LINE and not code and not line.startswith("|"):
            fail(f"{page.relative_to(ROOT)}:{number} has {len(line)} characters")


class Page(html.parser.HTMLParser):
    """Links, anchors and what a browser loads for a page."""

    def __init__(self, text):
        super().__init__()
        self.links, self.loads, self.ids = [], [], set()
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        has = dict(attributes)
        if has.get("id"):
            self.ids.add(has["id"])
        if tag == "a" and has.get("href"):
            self.links.append(has["href"])
        elif tag == "link" and has.get("href"):
            self.loads.append(has["href"])
        elif has.get("src"):
            self.loads.append(has["src"])


def check_site(site):
    pages = {path: Page(path.read_text("utf-8")) for path in site.rglob("*.html")}
    for path, page in pages.items():
        name = path.relative_to(site)
        for address in page.loads:
            if re.match(r"(\w+:)?//", address):
                fail(f"the page {name} loads {address} from the network")
        if name.name == "404.html":
            continue  # its links are those of a server's root
        for address in page.links + page.loads:
            if re.match(r"\w+:|//", address):
                continue
            to, _, anchor = address.partition("#")
            place = (path.parent / urllib.parse.unquote(to)).resolve() if to else path
            place = place / "index.html" if place.is_dir() else place
            if not place.exists():
                fail(f"the page {name} links to {address}, which is not there")
            elif anchor and place in pages and anchor not in pages[place].ids | {"__toc"}:
                fail(f"the page {name} links to {address}: there is no such place")
    for style in site.rglob("*.css"):
        if re.search(r"url\(\s*[\"']?(https?:)?//|@import", style.read_text("utf-8")):
            fail(f"{style.relative_to(site)} loads something from the network")
    if len(pages) < len(list(PAGES.rglob("*.md"))):
        fail(f"the site has {len(pages)} pages, fewer than the guide")
    if "mesh.boundary_conditions" not in (site / "reference.html").read_text("utf-8"):
        fail("the reference has no keys")


class QuietFiles(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *_):
        pass


def check_in_browser(site, program):
    """The search finds a tutorial, colours follow the system, nothing fails or comes from elsewhere."""
    sys.path.insert(0, str(ROOT / "tests" / "pages"))
    from browser import Browser
    handler = functools.partial(QuietFiles, directory=str(site))
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server, Browser(program) as page:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        for scheme, colours in (("light", "default"), ("dark", "slate")):
            page.prefer(scheme)
            page.call("Page.navigate", url=f"http://127.0.0.1:{server.server_port}/index.html?q=footing")
            page.wait_for("document.querySelectorAll('.md-search-result__item').length > 0")
            if page.value("document.body.dataset.mdColorScheme") != colours:
                fail(f"the site is not {scheme} where the system is")
            page.value("localStorage.clear()")  # the site keeps the colours of the first visit
        found = page.value("document.querySelector('.md-search-result__item').textContent")
        if "footing" not in found.lower():
            fail(f"the search for 'footing' finds {found}")
        server.shutdown()
        for error in page.errors:
            fail(f"in the browser: {error}")
        for address in page.requests:
            if not re.match(r"http://127\.0\.0\.1|data:|blob:", address):
                fail(f"the site loads {address}")


# An author and a year, with other authors between them, as comments cite: "Name, Other and Third 1999".
CITATION = re.compile(r"\b([A-Z][a-z]{2,})(?:,| and| &| et al\.?| [A-Z]\.| [A-Z]\w+)*,? \(?((?:18|19|20)\d\d)\b")


def check_citations():
    """What comments of the code cite is in theory.md: author and year in one paragraph or row."""
    theory = re.split(r"\n\n|\n(?=\|)", (PAGES / "theory.md").read_text("utf-8"))
    for folder in ("physics", "graph", "io", "runtime"):
        for file in sorted((ROOT / folder).rglob("*.h")) + sorted((ROOT / folder).rglob("*.cpp")):
            comments = re.findall(r"//[/!]* ?(.*)", file.read_text("utf-8"))
            for author, year in set(CITATION.findall(" ".join(comments))):
                if not any(author in part and year in part for part in theory):
                    fail(f"theory.md does not have {author} {year}, whom {file.relative_to(ROOT)} cites")


NUMBER = re.compile(r"^```text title=\"it prints[^\n]*\n.*?\d.*?^```", re.M | re.S)
TIME = re.compile(r"\d (?:s|min) on two\s+cores")


def check_gallery():
    """Each example has an entry with its picture, a number that its run prints (tutorials_test.py compares it) and
    how long it takes."""
    entries = re.split(r"^##+ ", (PAGES / "gallery.md").read_text("utf-8"), flags=re.M)
    for example in sorted((ROOT / "examples").glob("*.json")):
        entry = next((text for text in entries if f"](../../{example.name})" in text), "")
        if f"](gallery/{example.stem}.png)" not in entry:
            fail(f"gallery.md has no entry and picture of examples/{example.name}")
        elif not NUMBER.search(entry):
            fail(f"gallery.md says no number that the run of examples/{example.name} prints")
        elif not TIME.search(entry):
            fail(f"gallery.md does not say how long examples/{example.name} takes on two cores")


def main():
    own = [ROOT / name for name in ("README.md", "ARCHITECTURE.md", "CONTRIBUTING.md", "CHANGELOG.md")]
    guide = sorted(PAGES.rglob("*.md"))
    for page in own + guide + sorted((ROOT / "tests/verification").glob("*.md")):
        check_links(page)
    for page in own[:1] + guide:
        check_lines(page)
    lines = len(own[0].read_text("utf-8").splitlines())
    if lines > LONGEST_README:
        fail(f"README.md has {lines} lines; {LONGEST_README} are allowed: what is more belongs to the guide")
    index = (PAGES / "index.md").read_text("utf-8")
    for page in guide:
        name = page.relative_to(PAGES).as_posix()
        if name != "index.md" and f"({name})" not in index:
            fail(f"index.md has no link to {name}")
    check_citations()
    check_gallery()
    if len(sys.argv) < 2:
        return 1 if failures else 0
    with tempfile.TemporaryDirectory() as place:
        site = pathlib.Path(place) / "site"
        built = subprocess.run([ROOT / "examples/guide/build", site], text=True, capture_output=True,
                               env={**os.environ, "LAHAR_PROGRAM": sys.argv[1]})
        if built.returncode == SKIPPED:
            print("skipped: the site. " + built.stderr.strip())
            return 1 if failures else SKIPPED
        if built.returncode != 0:
            fail(f"examples/guide/build: {built.stdout}{built.stderr}")
        else:
            check_site(site)
            browser = shutil.which("chromium") or shutil.which("google-chrome")
            if browser and not failures:
                check_in_browser(site, browser)
            elif not browser:
                print("not tried in a browser: there is no Chromium (apt-get install chromium)")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
