"""What tests of pages have in common."""

failed = []


def expect(true, what):
    print(("ok      " if true else "FAILED  ") + what, flush=True)
    if not true:
        failed.append(what)


# Text whose contrast with what is behind it is below WCAG 2.1's 4.5 (3 for large text).
FAINT = """
(() => {
  const numbers = (colour) => colour.match(/[\\d.]+/g).map(Number);
  const light = ([r, g, b]) => [r, g, b].map((v) => v / 255)
    .map((v) => (v <= 0.03928 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4))
    .reduce((sum, v, i) => sum + v * [0.2126, 0.7152, 0.0722][i], 0);
  const behind = (node) => {
    for (; node; node = node.parentElement) {
      const colour = numbers(getComputedStyle(node).backgroundColor);
      if (colour.length < 4 || colour[3] === 1) return colour;
    }
    return [255, 255, 255];
  };
  const faint = [];
  let texts = 0;
  for (const node of document.body.querySelectorAll('*')) {
    if (!node.checkVisibility() || ['SCRIPT', 'NOSCRIPT', 'OPTION'].includes(node.tagName)) continue;
    if (![...node.childNodes].some((c) => c.nodeType === 3 && c.data.trim())) continue;
    const style = getComputedStyle(node), size = parseFloat(style.fontSize);
    const [a, b] = [light(numbers(node instanceof SVGElement ? style.fill : style.color)), light(behind(node))];
    const ratio = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
    const large = size >= 24 || (size >= 18.66 && style.fontWeight >= 700);
    ++texts;
    if (ratio < (large ? 3 : 4.5)) faint.push(`${node.textContent.trim().slice(0, 30)}: ${ratio.toFixed(2)}`);
  }
  return { texts, faint: [...new Set(faint)] };
})()
"""

def place(browser, selector):
    """A rectangle in the window."""
    return browser.value(f"""(() => {{
      const r = document.querySelector('{selector}').getBoundingClientRect();
      return {{ x: r.left, y: r.top, width: r.width, height: r.height }};
    }})()""")


def text(browser, selector):
    return browser.value(f"document.querySelector('{selector}').textContent")


def shown(browser, selector):
    return browser.value(f"document.querySelector('{selector}').checkVisibility()")


def test_readable(browser, what, least=100):
    found = browser.value(FAINT)
    expect(found["texts"] > least and not found["faint"],
           f"{found['texts']} texts have contrast, {what}: {found['faint'][:5]}")


def test_sound(browser):
    """No errors, and nothing but the page itself."""
    expect(not browser.errors, f"no errors: {browser.errors[:3]}")
    elsewhere = [url[:80] for url in browser.requests if not url.startswith(("file:", "data:", "blob:"))]
    expect(not elsewhere, f"nothing is loaded from elsewhere: {elsewhere}")
    files = {url for url in browser.requests if url.startswith("file:")}
    expect(len(files) == 1, f"one file is loaded: {files}")
