"""The page of a trace in a browser: it draws, zooms, selects, is readable, prints and loads nothing.

    trace_page.py CHROMIUM PAGE [--screenshot FILE.png]
"""

import argparse
import base64
import random
import re
import subprocess
import sys
import tempfile
import zlib
from pathlib import Path

from browser import Browser
from page_checks import expect, failed, place, shown, test_readable, test_sound, text

# Share of a canvas that is not of its most frequent colour.
DRAWN = """
[...document.querySelectorAll('SELECTOR canvas:not(.overlay)')].map((canvas) => {
  const data = new Uint32Array(canvas.getContext('2d')
    .getImageData(0, 0, canvas.width, canvas.height).data.buffer), seen = new Map();
  for (const pixel of data) seen.set(pixel, (seen.get(pixel) ?? 0) + 1);
  return { share: 1 - Math.max(...seen.values()) / data.length, colours: seen.size };
})
"""


def test_contents(browser):
    expect("2 × 2" in text(browser, "#facts"), "ranks and threads are named")
    expect(browser.value("document.querySelectorAll('#findings li').length") > 0, "there are findings")
    for selector, least in (("#stages", 4), ("#waits", 3), ("#patches", 3)):
        rows = browser.value(f"document.querySelectorAll('{selector} tbody tr').length")
        expect(rows >= least, f"{selector} has {rows} rows")
    bad = browser.value("document.body.innerText.match(/NaN|undefined|Infinity|\\[object/g)")
    expect(not bad, f"no figure is missing: {bad}")


def test_drawn(browser, what):
    for selector, share, colours in (("#timeline", 0.10, 6), ("#overview", 0.01, 4), ("#memory", 0.003, 3),
                                    ("#load", 0.003, 3), ("#particles", 0.003, 3)):
        for canvas in browser.value(DRAWN.replace("SELECTOR", selector)) or [{"share": 0, "colours": 0}]:
            expect(canvas["share"] > share and canvas["colours"] >= colours,
                   f"{selector} is drawn, {what}: {100 * canvas['share']:.1f} % in {canvas['colours']} colours")


def test_sorting(browser):
    order = "[...document.querySelectorAll('#stages tbody tr')].map((row) => row.cells[0].textContent)"
    before = browser.value(order)
    browser.value("document.querySelector('#stages th button').click()")
    after = browser.value(order)
    ordered = sorted(before, key=str.lower)
    expect(after in (ordered, ordered[::-1]) and after != before, "stages are sorted by name")
    browser.value("document.querySelector('#stages th button').click()")
    expect(browser.value(order) == after[::-1], "and the other way")


def pixels(browser):
    """Of the timeline, to see whether it changes."""
    return browser.value("document.querySelector('#timeline canvas').toDataURL()")


def test_zoom(browser):
    browser.value("document.querySelector('#timeline-card').scrollIntoView()")
    browser.settle()
    box = place(browser, "#timeline .u-over")
    y = box["y"] + box["height"] / 2
    ranges, pictures = [text(browser, "#range")], [pixels(browser)]
    whole = ranges[0]

    def changed(what):
        ranges.append(text(browser, "#range"))
        pictures.append(pixels(browser))
        expect(ranges[-1] != ranges[-2] and pictures[-1] != pictures[-2], f"{what}: {ranges[-1]}")

    browser.wheel(box["x"] + box["width"] * 0.3, y, -300)
    changed("the wheel zooms")
    browser.drag(box["x"] + box["width"] * 0.3, box["x"] + box["width"] * 0.6, y)
    changed("dragging zooms")
    browser.value("document.querySelector('#timeline').focus()")
    browser.key("ArrowRight")
    changed("arrow keys move")
    small = place(browser, "#overview .u-over")
    browser.drag(small["x"] + small["width"] * 0.2, small["x"] + small["width"] * 0.4, small["y"] + 30)
    changed("dragging above chooses a range")
    browser.value("document.querySelector('#whole').click()")
    browser.settle()
    changed("back to the whole run")
    expect(ranges[-1] == whole, "which is the first range")


def test_selection(browser):
    expect(not shown(browser, "#details"), "nothing is selected at first")
    browser.value("document.querySelector('#waits tbody button').click()")
    browser.settle()
    expect(shown(browser, "#details"), "a wait selects its task")
    expect(all(word in text(browser, "#details") for word in ("ready", "began", "ended", "waited for")),
           "whose times are shown")
    wait = text(browser, "#waits tbody button")
    expect(text(browser, "#details h3") == wait, f"it is {wait}")
    linked = browser.value("document.querySelectorAll('#details .chain li').length")
    expect(linked > 0, f"with {linked} tasks before it")
    test_drawn_overlay(browser)
    browser.value("document.querySelector('#timeline').focus()")
    browser.key("Escape")
    expect(not shown(browser, "#details"), "Escape ends the selection")

    # The pointer finds a task, and a click selects it.
    box = place(browser, "#timeline .u-over")
    places = [(box["x"] + x, box["y"] + y) for y in range(10, int(box["height"]), 15)
              for x in range(2, int(box["width"]), 3)]  # tasks are found within 2 pixels
    for x, y in places:
        browser.mouse("mouseMoved", x, y)
        if browser.value("document.querySelector('.tip').checkVisibility() &&"
                         " document.querySelector('.tip').textContent.includes('waited for')"):
            break
    hint = text(browser, ".tip b")
    expect(shown(browser, ".tip") and "took" in text(browser, ".tip"), f"the pointer is told of: {hint}")
    browser.click(x, y)
    expect(shown(browser, "#details") and text(browser, "#details h3").startswith(hint),
           "a click selects the same")


def test_drawn_overlay(browser):
    marked = browser.value("""(() => {
      const canvas = document.querySelector('canvas.overlay');
      return new Uint32Array(canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height)
        .data.buffer).filter((pixel) => pixel !== 0).length;
    })()""")
    expect(marked > 100, f"its chain is drawn over the rows: {marked} pixels")


def test_focus(browser):
    before = pixels(browser)
    browser.value("document.querySelector('#patches tbody button').click()")
    browser.settle()
    expect("patch" in text(browser, "#focus-name") and pixels(browser) != before, "a patch alone")
    browser.value("document.querySelector('#critical').click()")
    browser.settle()
    expect("critical path" in text(browser, "#focus-name"), "the critical path alone")
    browser.value("document.querySelector('#unfocus').click()")
    browser.settle()
    expect(not shown(browser, "#focus") and pixels(browser) == before, "and all again")


def test_schemes(browser):
    background = "getComputedStyle(document.body).backgroundColor"
    test_readable(browser, "light")
    light, picture = browser.value(background), pixels(browser)
    browser.prefer("dark")
    browser.settle()
    expect(browser.value(background) != light and pixels(browser) != picture, "dark where it is preferred")
    test_readable(browser, "dark")
    test_drawn(browser, "dark")
    browser.value("document.querySelector('#theme').click()")
    browser.settle()
    expect(browser.value(background) == light, "the button goes back to light")
    browser.prefer("light")
    browser.value("document.querySelector('#theme').click()")
    browser.settle()
    test_readable(browser, "dark by the button")
    browser.value("document.querySelector('#theme').click()")


def test_narrow(browser):
    browser.resize(500, 900)
    browser.settle()
    browser.settle()
    width = browser.value("document.documentElement.scrollWidth")
    expect(width <= 500, f"nothing is wider than a window of 500: {width}")
    over = place(browser, "#timeline .u-over")
    expect(300 < over["width"] < 500, f"the timeline fits: {over['width']:.0f}")
    test_drawn(browser, "narrow")
    browser.resize(1200, 900)
    browser.settle()


class Sheets:
    """What is drawn in a PDF. Canvases are shapes there, or pictures of their own width."""

    def __init__(self, data):
        self.rectangles = self.lines = 0
        self.colours = set()
        self.pictures = [int(width) for width in re.findall(rb"/Subtype /Image\s+/Width (\d+)", data)]
        for start in re.finditer(rb"stream\r?\n", data):
            try:
                drawn = zlib.decompressobj().decompress(data[start.end():])
            except zlib.error:
                continue  # a font, or an end of another stream
            self.rectangles += len(re.findall(rb"\sre\s", drawn))
            self.lines += len(re.findall(rb"\sl\s", drawn))
            for colour in re.findall(rb"([\d.]+ [\d.]+ [\d.]+) rg\s", drawn):
                self.colours.add("#" + "".join(f"{round(255 * float(part)):02x}" for part in colour.split()))

    def expect_charts(self, what):
        charts = [width for width in self.pictures if width > 600]
        # Tables and bars have a third of these.
        expect((self.rectangles > 1800 and self.lines > 3000) or len(charts) >= 5,
               f"{what}: {self.rectangles} rectangles, {self.lines} lines, pictures {charts}")


def test_printed_at_once(chromium, page):
    """From the command line: nobody waits for the page's scripts."""
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        pdf = Path(folder) / "page.pdf"
        subprocess.run([chromium, "--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage",
                        f"--user-data-dir={folder}/profile", f"--print-to-pdf={pdf}", Path(page).resolve().as_uri()],
                       check=True, capture_output=True, timeout=300)
        Sheets(pdf.read_bytes()).expect_charts("charts are printed as soon as the page is there")


def test_print(browser, what):
    """The paper is light, and the page afterwards dark as it was."""
    page = """[getComputedStyle(document.body).backgroundColor,
      ...[...document.querySelectorAll('.uplot canvas:not(.overlay)')].map((canvas) => canvas.width)]"""
    browser.value("document.querySelector('#whole').click()")
    browser.settle()
    before = browser.value(page)
    expect(before[0] == "rgb(17, 21, 27)", f"{what}: {before}")
    sheets = Sheets(base64.b64decode(browser.call("Page.printToPDF")["data"]))
    sheets.expect_charts("charts are printed")
    expect("#17202c" in sheets.colours and "#e8ecf2" not in sheets.colours, "with dark ink")
    expect("#0072b2" in sheets.colours, "bars have their colours")
    browser.settle()
    expect(browser.value(page) == before, "and the page is as before")


def test_paper(browser):
    """Of an upright A4 sheet, between its margins, all charts are seen whole."""
    browser.value("dispatchEvent(new Event('beforeprint'))")
    browser.call("Emulation.setEmulatedMedia", media="print")
    browser.resize(717, 1000)
    browser.settle()
    widest = browser.value("Math.max(...[...document.querySelectorAll('canvas, table, .card')]"
                           ".map((node) => node.getBoundingClientRect().right), document.documentElement.scrollWidth)")
    expect(widest <= 717, f"nothing is wider than the paper's 717: {widest}")
    test_drawn(browser, "on paper")
    expect(not shown(browser, "#theme") and not shown(browser, ".tools"), "buttons are not printed")
    browser.call("Emulation.setEmulatedMedia", media="screen")
    browser.value("dispatchEvent(new Event('afterprint'))")
    browser.resize(1200, 900)
    browser.settle()


def test_without_scripts(browser, page):
    """The page says what the program does, as text."""
    browser.call("Emulation.setScriptExecutionDisabled", value=True)
    browser.call("Page.navigate", url=Path(page).resolve().as_uri())
    browser.wait_for("document.readyState === 'complete'")
    browser.call("Emulation.setScriptExecutionDisabled", value=False)
    said = browser.value("document.querySelector('noscript pre').innerText")
    for words in ("Where the time went", "parallel efficiency", "Critical path", "Longest waits"):
        expect(f"\n{words}" in said or f"\n  {words}" in said, f"without JavaScript there is a line {words}")
    expect(shown(browser, "noscript pre") and browser.value(
        "[...document.querySelectorAll('section')].filter((part) => part.checkVisibility()).length") == 1,
           "and no empty part of the page")


def test_inflate(browser):
    """The page's own inflate, by all kinds of blocks of zlib's."""
    noise = random.Random(1)
    texts = {"nothing": b"", "one byte": b"x", "zeros": bytes(70_000),
             "noise": bytes(noise.randrange(256) for _ in range(70_000)),
             "words": b" ".join(noise.choice([b"task", b"patch", b"rank", b"step"]) for _ in range(20_000))}
    texts["all"] = texts["words"] + texts["noise"] + texts["zeros"] + texts["words"]
    for name, data in texts.items():
        for level, strategy in ((0, 0), (1, 0), (9, 0), (6, zlib.Z_FIXED), (6, zlib.Z_HUFFMAN_ONLY), (6, zlib.Z_RLE)):
            packer = zlib.compressobj(level, strategy=strategy)
            pieces = [data[k:k + 3001] for k in range(0, len(data), 3001)] if name == "all" else [data]
            # A flush ends a block, and puts one of no bytes after it.
            deflated = b"".join(packer.compress(piece) + packer.flush(zlib.Z_SYNC_FLUSH) for piece in pieces)
            packed = base64.b64encode(deflated + packer.flush()).decode()
            # Names of a module are its own: it is loaded once more, with these told.
            found = browser.value(f"""(async () => {{
              const script = document.querySelector('script[type=module]').textContent;
              globalThis.told ??= import(URL.createObjectURL(new Blob(
                [script, '\\nexport {{ Inflater, bytesOf }};'], {{ type: 'text/javascript' }})));
              const {{ Inflater, bytesOf }} = await globalThis.told;
              const out = new Inflater(bytesOf('{packed}'), {len(data)}).out;
              let text = '';
              for (const byte of out) text += String.fromCharCode(byte);
              return btoa(text);
            }})()""")
            if base64.b64decode(found) != data:
                expect(False, f"{name} by level {level}, strategy {strategy} is inflated")
    expect(True, "what zlib deflates is inflated")


def screenshot(browser, file):
    """Of the timeline with a selected task and its chain."""
    browser.resize(960, 900)
    browser.value("document.querySelector('#whole').click()")
    browser.value("document.querySelector('#waits tbody button').click()")
    browser.value("document.activeElement.blur()")
    browser.settle()
    card = place(browser, "#timeline-card")
    top = browser.value("scrollY")
    browser.picture(file, {**card, "y": card["y"] + top, "height": min(card["height"], 760)})


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("chromium")
    parser.add_argument("page")
    parser.add_argument("--screenshot")
    arguments = parser.parse_args()
    with Browser(arguments.chromium) as browser:
        browser.prefer("light")
        browser.open(arguments.page)
        browser.settle()
        test_contents(browser)
        test_drawn(browser, "light")
        browser.prefer("dark")
        test_print(browser, "dark where it is preferred")
        browser.prefer("light")
        test_sorting(browser)
        test_zoom(browser)
        test_selection(browser)
        test_focus(browser)
        test_schemes(browser)
        test_narrow(browser)
        browser.value("document.querySelector('#theme').click()")
        test_print(browser, "dark by the button")
        browser.value("document.querySelector('#theme').click()")
        test_paper(browser)
        if arguments.screenshot:
            screenshot(browser, arguments.screenshot)
        test_sound(browser)
        test_inflate(browser)
    with Browser(arguments.chromium) as browser:
        test_without_scripts(browser, arguments.page)
    test_printed_at_once(arguments.chromium, arguments.page)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
