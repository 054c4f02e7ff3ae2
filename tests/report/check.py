"""Opens pages in headless Chromium at several widths, by day and by night, and saves screenshots.

usage: check.py CHROMIUM FOLDER PAGE.html...

Fails if a page is wider than its window, asks for anything but itself, writes to the console, has an image that does not load, letters
of a figure that are too small to read, or words of a figure that overlap.
"""

import sys
from pathlib import Path

from playwright.sync_api import sync_playwright

WIDTHS = [1280, 390]
# Smallest letters of a figure as they are shown [px].
LEAST = 10.5

# What the page tells about itself.
TOLD = """() => {
  const root = document.documentElement;
  const wide = [...document.querySelectorAll('body *')].filter(e => {
    if (e.closest('.scroll') || e.closest('svg')) return false;
    const box = e.getBoundingClientRect();
    return box.width > 0 && (box.right > innerWidth + 0.5 || box.left < -0.5);
  });
  const texts = svg => [...svg.querySelectorAll('text')].map(t => ({
    words: t.textContent.trim(), box: t.getBoundingClientRect(),
    size: parseFloat(getComputedStyle(t).fontSize) * svg.getBoundingClientRect().width / svg.viewBox.baseVal.width,
  })).filter(t => t.words);
  const name = svg => svg.closest('figure').id;
  const small = [], overlapping = [], outside = [];
  for (const svg of document.querySelectorAll('svg')) {
    const all = texts(svg), frame = svg.getBoundingClientRect();
    for (const [i, a] of all.entries()) {
      small.push([a.size, name(svg), a.words]);
      if (a.box.left < frame.left - 0.5 || a.box.right > frame.right + 0.5) outside.push([name(svg), a.words]);
      for (const b of all.slice(i + 1)) {
        const apart = a.box.right <= b.box.left + 0.5 || b.box.right <= a.box.left + 0.5
          || a.box.bottom <= b.box.top + 3 || b.box.bottom <= a.box.top + 3;
        if (!apart) overlapping.push([name(svg), a.words, b.words]);
      }
    }
  }
  return {
    inner: innerWidth, scroll: root.scrollWidth,
    wide: wide.slice(0, 5).map(e => e.tagName + '#' + e.id + '.' + e.className),
    broken: [...document.images].filter(i => !i.complete || i.naturalWidth === 0).length,
    images: document.images.length, figures: document.querySelectorAll('svg').length,
    smallest: small.sort((a, b) => a[0] - b[0])[0] || null, overlapping, outside,
  };
}"""


def check(browser, page_file, folder):
    errors = []
    for width in WIDTHS:
        for scheme in ["light", "dark"]:
            context = browser.new_context(
                viewport={"width": width, "height": 900}, color_scheme=scheme, device_scale_factor=1
            )
            page = context.new_page()
            said, asked = [], []
            page.on("console", lambda message: said.append(message.text))
            page.on("pageerror", lambda error: said.append(str(error)))
            page.on("request", lambda request: asked.append(request.url))
            page.goto(page_file.resolve().as_uri(), wait_until="load")
            page.evaluate("() => document.querySelectorAll('details').forEach(d => d.open = true)")
            told = page.evaluate(TOLD)
            where = f"{page_file}: {width} px, {scheme}"
            elsewhere = [url for url in asked if not url.startswith(("file:", "data:"))]
            problems = {
                "the window is not as wide as asked for": told["inner"] != width and told["inner"],
                "is wider than the window": told["scroll"] > told["inner"] and told["scroll"],
                "stands out": told["wide"],
                "wrote to the console": said,
                "asked for": elsewhere,
                "images that did not load": told["broken"],
                "no figure": told["figures"] == 0,
                "letters too small": told["smallest"] and told["smallest"][0] < LEAST and told["smallest"],
                "words that overlap": told["overlapping"],
                "words outside their figure": told["outside"],
            }
            errors += [f"{where}: {name}: {value}" for name, value in problems.items() if value]
            page.evaluate("() => document.querySelectorAll('details').forEach(d => d.open = false)")
            page.screenshot(path=folder / f"{page_file.parent.name}-{width}-{scheme}.png", full_page=True)
            context.close()
    print(f"{page_file}: {told['figures']} figures, {told['images']} images")
    return errors


def main():
    chromium, folder, *pages = sys.argv[1:]
    folder = Path(folder)
    with sync_playwright() as playwright:
        # As root Chromium refuses its sandbox; the pages are our own.
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        errors = [error for page in pages for error in check(browser, Path(page), folder)]
        browser.close()
    for error in errors:
        print(error, file=sys.stderr)
    sys.exit(1 if errors else 0)


main()
