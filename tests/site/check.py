"""Reads every page of a site, and opens pages in headless Chromium at 1280 and 390 px.

usage: check.py CHROMIUM SITE VERSION SCREENSHOTS

SITE holds versions.json and a folder for each version. Fails if a block of Python does not parse, if a link, an anchor or a picture of the version's pages leads nowhere, if a picture has no text or a page
no title, if an opened page is wider than its window, asks for anything but the site, or writes to the console, if the search does not find, or if
the selector does not list the versions.
"""

import functools
import http.server
import json
import posixpath
import re
import sys
import threading
import urllib.parse
from html.parser import HTMLParser
from pathlib import Path

from playwright.sync_api import TimeoutError, sync_playwright

SIZES = {"wide": (1280, 900), "narrow": (390, 844)}
# Pages that are opened, and those of which screenshots are kept.
SHOWN = ["", "tutorials/start/", "gallery/", "concepts/", "reference/orchard/", "reference/configs/paper/world/", "benchmark-v1/"]
# A word to search for, and the heading that must be among what is found.
WORD, FOUND = "slurm", "Under Slurm"
# Elements that stand out of the window, but for those in boxes that scroll.
WIDE = """() => [...document.querySelectorAll('body *')].filter(e => {
  for (let p = e; p && p !== document.body; p = p.parentElement) {
    const style = getComputedStyle(p);
    if (style.position === 'fixed' || (p !== e && ['auto', 'scroll', 'hidden', 'clip'].includes(style.overflowX))) return false;
    if (style.visibility === 'hidden' || style.opacity === '0') return false;
  }
  const box = e.getBoundingClientRect();
  return box.width > 0 && (box.right > innerWidth + 1 || box.left < -1);
}).slice(0, 3).map(e => e.tagName + '.' + e.className)"""


class Page(HTMLParser):
    """Links, anchors and pictures of a page."""

    def __init__(self, text):
        super().__init__()
        self.links, self.anchors, self.bare, self.titles = [], set(), [], 0
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        known = dict(attributes)
        self.anchors.update(known[name] for name in ("id", "name") if known.get(name))
        self.links += [known[name] for name in ("href", "src") if known.get(name)]
        self.titles += tag == "h1"
        if tag == "img" and not (known.get("alt") or "").strip():
            self.bare.append(known.get("src"))


def read(folder):
    """What is wrong with the pages of a folder as files."""
    files = {path.relative_to(folder).as_posix(): path for path in folder.rglob("*") if path.is_file()}
    # The world in a browser has a check of its own, and is no page of the documentation.
    pages = {name: Page(path.read_text(encoding="utf-8")) for name, path in files.items() if name.endswith(".html") and not name.startswith("world/")}
    errors = []
    for name, page in pages.items():
        errors += [f"{name}: {picture} has no text" for picture in page.bare]
        errors += [f"{name}: {page.titles} titles"] if page.titles != 1 else []
        for link in page.links:
            parts = urllib.parse.urlsplit(link)
            if parts.scheme or parts.netloc:
                continue
            target = posixpath.normpath(posixpath.join(posixpath.dirname(name), urllib.parse.unquote(parts.path))) if parts.path else name
            target = target if target in files else posixpath.normpath(f"{target}/index.html")
            if target not in files:
                errors.append(f"{name}: {link} leads nowhere")
            elif parts.fragment and target in pages and parts.fragment not in pages[target].anchors:
                errors.append(f"{name}: {link} names no place on its page")
    print(f"{len(pages)} pages, {sum(len(page.links) for page in pages.values())} links")
    return errors


def snippets(folder):
    """Blocks of Python that are none."""
    errors = []
    for path in sorted(folder.rglob("*.md")):
        for block in re.findall(r"^```python\b[^\n]*\n(.*?)^```", path.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL):
            try:
                compile(block, path.name, "exec")
            except SyntaxError as error:
                errors.append(f"{path.relative_to(folder)}: {error.msg} in a block of Python: {(error.text or '').strip()}")
    return errors


class Quiet(http.server.SimpleHTTPRequestHandler):
    def do_GET(self):
        if self.path == "/favicon.ico":
            self.send_response(204)
            self.end_headers()
        else:
            super().do_GET()

    def log_message(self, *_):
        pass


def serve(folder):
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Quiet, directory=folder))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    return f"http://127.0.0.1:{server.server_port}/"


def visit(browser, site, version, size, scheme, folder):
    """What is wrong with the pages as a visitor sees them."""
    errors, where = [], [""]
    width, height = SIZES[size]
    context = browser.new_context(viewport={"width": width, "height": height}, color_scheme=scheme, device_scale_factor=1)
    page = context.new_page()
    fault = lambda what: errors.append(f"{where[0] or 'first page'} at {width} px: {what}")
    page.on("console", lambda message: message.type in ("error", "warning") and fault(f"wrote to the console: {message.text}"))
    page.on("pageerror", lambda error: fault(f"error: {error}"))
    page.on("request", lambda request: request.url.startswith((site, "data:", "blob:")) or fault(f"asked for {request.url}"))
    page.on("response", lambda response: response.status >= 400 and fault(f"{response.url} gives {response.status}"))
    for name in SHOWN:
        where[0] = name
        page.goto(f"{site}{version}/{name}", wait_until="networkidle")
        for element in page.evaluate(WIDE):
            fault(f"{element} stands out of the window")
        beyond = page.evaluate("() => document.documentElement.scrollWidth - innerWidth")
        if beyond > 0:
            fault(f"is {beyond} px wider than the window")
        page.screenshot(path=folder / f"{name.strip('/').replace('/', '-') or 'first'}-{size}-{scheme}.png")
    where[0] = "search"
    page.goto(f"{site}{version}/", wait_until="networkidle")
    page.keyboard.press("/")
    page.keyboard.type(WORD, delay=20)
    try:
        page.get_by_text(FOUND).first.wait_for(timeout=20_000)
    except TimeoutError:
        fault(f"'{WORD}' does not find {FOUND}")
    page.screenshot(path=folder / f"search-{size}-{scheme}.png")
    context.close()
    return errors


def versions(browser, site, version, known):
    """Follows the selector of versions."""
    page = browser.new_page()
    page.goto(f"{site}{version}/tutorials/start/", wait_until="networkidle")
    listed = page.locator(".md-version__link").all_text_contents()
    listed = [text.strip() for text in listed]
    page.close()
    return [] if listed == known else [f"the selector lists {listed}, not {known}"]


def main(chromium, out, version, folder):
    out, folder = Path(out), Path(folder)
    errors = read(out / version) + snippets(out / version)
    known = [entry["version"] for entry in json.loads((out / "versions.json").read_text())]
    site = serve(out)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium)
        for size, scheme in [("wide", "light"), ("narrow", "dark")]:
            errors += visit(browser, site, version, size, scheme, folder)
        errors += versions(browser, site, version, known)
        browser.close()
    for error in errors:
        print(error, file=sys.stderr)
    sys.exit(1 if errors else 0)


main(*sys.argv[1:])
