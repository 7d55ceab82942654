"""Pages of reports in a browser: there at once, drawn, turned, played, readable, printed; nothing is loaded.

    report_page.py CHROMIUM ONE TWO STAGES NINE [--screenshot FILE.png]
"""

import argparse
import base64
import sys

from browser import Browser
from page_checks import expect, failed, place, test_readable, test_sound, text

# Share of the pixels of a 3D view that show something, and how many colours there are.
DRAWN = """
[...document.querySelectorAll('.view canvas')].map((canvas) => {
  globalThis.player.views.forEach((view) => view.render());
  const copy = document.createElement('canvas');
  copy.width = canvas.width; copy.height = canvas.height;
  const context = copy.getContext('2d');
  context.drawImage(canvas, 0, 0);
  const data = new Uint32Array(context.getImageData(0, 0, copy.width, copy.height).data.buffer);
  const seen = new Set(data);
  return { share: data.filter((pixel) => pixel !== 0).length / data.length, colours: seen.size, hash: data.reduce((h, p) => (h * 31 + p) | 0, 7) };
})
"""


def drawn(browser):
    return browser.value(DRAWN)


def test_there_at_once(browser, page):
    """Without its script the page has everything but the 3D view."""
    browser.call("Emulation.setScriptExecutionDisabled", value=True)
    browser.call("Page.navigate", url="file://" + page)
    browser.wait_for("document.readyState === 'complete'")
    browser.call("Emulation.setScriptExecutionDisabled", value=False)
    still = browser.value("document.querySelector('.still svg image').checkVisibility()")
    expect(still, "without JavaScript there is a picture of the particles")
    charts = browser.value("document.querySelectorAll('figure.chart polyline').length")
    expect(charts > 5, f"and {charts} lines of charts")


def test_contents(browser):
    sections = browser.value("[...document.querySelectorAll('main h2')].map((h) => h.textContent)")
    for name in ("Key figures", "Particles", "Pictures", "Energies and motion", "Gauges", "Maps", "Rigid bodies",
                 "Warnings", "Time and efficiency", "Inputs and versions"):
        expect(name in sections, f"there is a section {name}")
    expect(text(browser, "h1") == "Heap & <ball>", "the title is that of the scenario")
    expect("finished" in text(browser, ".verdict"), "the page says how the run ended")
    expect("a warning with <tags> & signs" in browser.value("document.body.textContent"), "warnings are texts")
    bad = browser.value("document.body.innerText.match(/\\bNaN\\b|undefined|Infinity|\\[object/g)")
    expect(not bad, f"no figure is missing: {bad}")
    pictures = browser.value("[...document.querySelectorAll('main svg image')].length")
    expect(pictures > 10, f"{pictures} pictures and bars of colours")
    rows = browser.value("[...document.querySelectorAll('table')].find((t) => t.textContent.includes('P2G')).rows.length")
    expect(rows > 8, f"{rows} rows of times")


def test_view(browser):
    first = drawn(browser)[0]
    expect(first["share"] > 0.02 and first["colours"] > 30,
           f"particles are drawn: {100 * first['share']:.1f} % in {first['colours']} colours")
    browser.value("document.querySelector('.view canvas').focus()")
    for key in ("ArrowLeft", "ArrowUp", "+"):
        browser.key(key)
        second = drawn(browser)[0]
        expect(second["hash"] != first["hash"], f"{key} turns or zooms")
        first = second
    browser.key("Home")
    browser.value("document.querySelector('#frame').focus()")
    before = text(browser, "#time")
    browser.key("ArrowLeft")
    expect(text(browser, "#time") != before, f"arrows of the slider change the time: {text(browser, '#time')}")
    expect(drawn(browser)[0]["hash"] != first["hash"], "and the particles")
    first = drawn(browser)[0]
    browser.value("document.querySelector('#field').value = 1;"
                  "document.querySelector('#field').dispatchEvent(new Event('change'))")
    expect(drawn(browser)[0]["hash"] != first["hash"], "another field has other colours")
    first = drawn(browser)[0]
    browser.value("document.querySelector('#bodies').click()")
    without = drawn(browser)[0]
    expect(without["share"] < 0.95 * first["share"],
           f"rigid bodies are drawn, and can be left out: {without['share']} of {first['share']}")
    browser.value("document.querySelector('#bodies').click()")
    expect(drawn(browser)[0]["hash"] == first["hash"], "and are there again")
    browser.value("document.querySelector('[data-look=\"top\"]').click()")
    first = drawn(browser)[0]
    box = place(browser, ".view canvas")
    browser.drag(box["x"] + 100, box["x"] + 300, box["y"] + 200)
    expect(drawn(browser)[0]["hash"] != first["hash"], "dragging turns")
    browser.value("document.querySelector('#play').click()")
    before = text(browser, "#time")
    browser.wait_for(f"document.querySelector('#time').textContent !== {before!r}")
    browser.value("document.querySelector('#play').click()")
    expect(True, "the play button plays")


def test_thrift(browser):
    """What does not change is not drawn, and what moves has no more than can be drawn in time."""
    browser.value("""{
      globalThis.view = player.views[0];
      globalThis.took = ((adapt) => (time) => { for (let k = 0; k < 100; ++k) adapt(time); })(view.adapt.bind(view));
      view.adapt = () => {};  // whatever this machine takes
      const render = view.render.bind(view);
      view.count = 0;
      view.render = () => { ++view.count; render(); };
    }""")
    browser.resize(1200, 900, 2)
    particles = "(view.draw(), new Promise((done) => requestAnimationFrame(() => done(view.geometry.drawRange.count))))"
    browser.wait_for("!view.moving")
    browser.settle()
    before = browser.value("view.count")
    browser.value("new Promise((done) => setTimeout(done, 500))")
    expect(browser.value("view.count") == before, "nothing is drawn while nothing changes")
    shown = browser.value(particles)
    expect(shown == browser.value("view.run.shown") <= 31_000, f"{shown} particles are drawn")
    triangles = browser.value("view.renderer.info.render.triangles")
    expect(1000 < triangles <= 20_000, f"and {triangles} triangles of rigid bodies")
    turns = "view.stir(); clearTimeout(view.rest)"  # it rests when the test says so
    browser.value(f"took(100); {turns}")
    fewer = browser.value(particles)
    expect(fewer < 0.2 * shown, f"{fewer} particles while it turns, where a frame takes long")
    wide = browser.value("view.canvas.width")
    expect(wide == browser.value("view.canvas.clientWidth"), f"and {wide} pixels in a row, on a screen with two in each")
    browser.value("view.stir()")
    browser.wait_for(f"view.geometry.drawRange.count === {shown} && view.canvas.width === {2 * wide}")
    expect(True, "all of them at rest")
    browser.value(f"took(16); {turns}")
    expect(browser.value(particles) == shown, "or where it does not take long")
    browser.value("view.stir()")
    browser.wait_for("!view.moving")
    browser.resize(1200, 900)
    browser.settle()


def test_speed(browser):
    """Frames per second while the view turns, with software rendering."""
    rate = browser.value("""new Promise((done) => {
      const view = globalThis.player.views[0], begin = performance.now();
      let n = 0;
      const turn = () => {
        const c = view.camera.position, a = 0.03;
        c.set(c.x * Math.cos(a) - c.y * Math.sin(a), c.x * Math.sin(a) + c.y * Math.cos(a), c.z);
        view.controls.update();
        view.render();
        view.renderer.getContext().finish();
        ++n;
        if (performance.now() - begin < 2000) requestAnimationFrame(turn);
        else done(1000 * n / (performance.now() - begin));
      };
      turn();
    })""")
    print(f"        {rate:.0f} frames per second when turned")
    return rate


def test_hints(browser):
    browser.value("document.querySelector('figure.chart svg').scrollIntoView({block: 'center'})")
    browser.settle()
    box = place(browser, "figure.chart svg")
    browser.mouse("mouseMoved", box["x"] + 0.6 * box["width"], box["y"] + 0.5 * box["height"])
    browser.settle()
    hint = text(browser, "figure.chart .tip")
    expect("time" in hint and "kinetic" in hint, f"the pointer is told values: {hint[:60]}")
    browser.value("document.querySelector('figure.chart svg').focus()")
    browser.key("ArrowRight")
    expect(browser.value("!document.querySelector('figure.chart .tip').hidden"), "and so is the keyboard")
    browser.key("Escape")
    expect(browser.value("document.querySelector('figure.chart .tip').hidden"), "until Escape")


def test_schemes(browser):
    background = "getComputedStyle(document.body).backgroundColor"
    light = browser.value(background)
    test_readable(browser, "light")
    browser.prefer("dark")
    browser.settle()
    expect(browser.value(background) != light, "dark where it is preferred")
    test_readable(browser, "dark")
    browser.value("document.querySelector('#theme').click()")
    expect(browser.value(background) == light, "the button goes back to light")
    browser.prefer("light")


def test_narrow(browser):
    browser.resize(420, 900)
    browser.settle()
    width = browser.value("document.documentElement.scrollWidth")
    expect(width <= 420, f"nothing is wider than a window of 420: {width}")
    browser.resize(1200, 900)
    browser.settle()


def test_print(browser):
    data = base64.b64decode(browser.call("Page.printToPDF", printBackground=True)["data"])
    expect(data.startswith(b"%PDF") and len(data) > 50_000, f"the page prints: {len(data) // 1000} kB")


def test_two(browser):
    expect(len(browser.value("[...document.querySelectorAll('.view')]")) == 2, "two runs are beside each other")
    first, second = drawn(browser)
    expect(first["hash"] != second["hash"] and second["share"] > 0.01, "and differ")
    browser.value("document.querySelector('.view canvas').focus()")
    browser.key("ArrowLeft")
    turned = drawn(browser)
    expect(turned[0]["hash"] != first["hash"] and turned[1]["hash"] != second["hash"], "both are turned")
    names = browser.value("document.querySelector('figure.chart .legend').textContent")
    expect("heap" in names and "light" in names, f"charts name both: {names}")


def test_stages(browser):
    expect("first, second" in text(browser, ".facts"), "both stages are named")
    names = browser.value("[...document.querySelectorAll('figure.chart svg text')].map((t) => t.textContent)")
    expect("first" in names and "second" in names, "charts say where stages begin")
    expect(browser.value("document.querySelector('#looks').hidden"), "two dimensions are not turned")
    expect(drawn(browser)[0]["share"] > 0.01, "and drawn")


def test_nine(browser):
    """Colours of lines come again, runs have the same name."""
    browser.value("[...document.querySelectorAll('figure.chart')].find((f) => f.textContent.includes('Kinetic')).id = 'kinetic'")
    browser.value("document.querySelector('#kinetic svg').scrollIntoView({block: 'center'})")
    browser.settle()
    box = place(browser, "#kinetic svg")
    browser.mouse("mouseMoved", box["x"] + 0.9 * box["width"], box["y"] + 0.5 * box["height"])
    browser.settle()
    rows = browser.value("[...document.querySelectorAll('#kinetic .tip div')].map((row) => row.textContent)")
    names, values = zip(*(row.split(" ", 1) for row in rows))
    expect(len(set(names)) == 9, f"nine runs have names of their own: {names}")
    expect(values[0] == values[7] != values[8], f"hints tell lines of one colour apart: {values}")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("chromium")
    parser.add_argument("pages", nargs=4)
    parser.add_argument("--screenshot")
    arguments = parser.parse_args()
    for page, tests in zip(arguments.pages, (None, test_two, test_stages, test_nine)):
        with Browser(arguments.chromium, webgl=True) as browser:
            browser.prefer("light")
            if not tests:
                test_there_at_once(browser, page)
            browser.open(page)
            browser.settle()
            if tests:
                tests(browser)
            else:
                for test in (test_contents, test_view, test_thrift, test_speed, test_hints, test_schemes, test_narrow, test_print):
                    test(browser)
                if arguments.screenshot:
                    browser.picture(arguments.screenshot)
            test_sound(browser)
    # Without WebGL the picture stays.
    with Browser(arguments.chromium) as browser:
        browser.value("0")
        browser.call("Page.addScriptToEvaluateOnNewDocument",
                     source="HTMLCanvasElement.prototype.getContext = () => null")
        browser.open(arguments.pages[0])
        expect(browser.value("document.querySelector('.still svg').checkVisibility()"), "without WebGL there is a picture")
        expect("no 3D view" in text(browser, "#no-3d"), "and a note")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
