"""Runs the page in headless Chromium: an episode frame by frame, and what a visitor does at 1280 and at 390 px.

usage: check.py CHROMIUM PAGE EPISODE.json FOUND.json SCREENSHOTS

EPISODE.json holds the options of the world, the number of frames and the length [s]; FOUND.json gets the digest of every frame, the wall time of the
episode and the time to the first picture. Fails if the page writes to the console, is wider than its window, has a control without a label, does
not do what its controls say, or does not say what is wrong.
"""

import functools
import http.server
import json
import shutil
import sys
import tempfile
import threading
import time
from pathlib import Path

from playwright.sync_api import sync_playwright

SIZES = {"wide": (1280, 800), "narrow": (390, 844)}
# Graphics in software: the same on machines with and without a device.
GRAPHICS = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
# Times that are waited for [ms]; far beyond what a slow machine needs.
PATIENCE = 180_000

ASK_WORKER = """([message, kind]) => new Promise((resolve, reject) => {
  const worker = new Worker('worker.js');
  worker.onerror = event => reject(new Error(event.message));
  worker.onmessage = ({ data }) => {
    if (data.kind === 'menu') worker.postMessage(message);
    else if (data.kind === kind) { worker.terminate(); resolve(data); }
    else reject(new Error(data.problem || data.kind));
  };
})"""

# True once the page tells a pull of more than a newton.
FORCE = "() => parseFloat(document.getElementById('arrow-text').textContent) > 1"

# Controls without a name, and elements that stand out of the window.
LOOK = """() => {
  const named = e => e.labels?.length || e.textContent.trim() || e.ariaLabel;
  const seen = e => e.getBoundingClientRect().width > 0;
  const out = [...document.querySelectorAll('body *')].filter(e => {
    const box = e.getBoundingClientRect();
    return !e.closest('svg') && box.width > 0 && (box.right > innerWidth + 0.5 || box.left < -0.5);
  });
  return {
    unnamed: [...document.querySelectorAll('button, select, input, canvas')].filter(e => !named(e)).map(e => e.id),
    small: [...document.querySelectorAll('button, select, input')].filter(seen)
      .filter(e => (e.closest('label') ?? e).getBoundingClientRect().height < 20).map(e => e.id),
    out: out.map(e => e.tagName + '#' + e.id),
    scroll: document.documentElement.scrollWidth - innerWidth,
  };
}"""


class Quiet(http.server.SimpleHTTPRequestHandler):
    def do_GET(self):
        if self.path == "/favicon.ico":
            # Browsers ask for it where no page says otherwise, as where the worker is asked alone.
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


class Visit:
    """One window; `errors` collects what is wrong with it."""

    def __init__(self, browser, site, size, errors, where, touch=False):
        self.context = browser.new_context(
            viewport={"width": size[0], "height": size[1]}, has_touch=touch, device_scale_factor=1
        )
        self.page, self.site, self.errors, self.where = self.context.new_page(), site, errors, where
        self.page.set_default_timeout(PATIENCE)
        self.page.on("console", lambda message: self.fault(f"wrote to the console: {message.text}"))
        self.page.on("pageerror", lambda error: self.fault(f"error: {error}"))
        self.page.on("request", lambda request: request.url.startswith((site, "data:")) or self.fault(f"asked for {request.url}"))

    def fault(self, what):
        self.errors.append(f"{self.where}: {what}")

    def demand(self, holds, what):
        if not holds:
            self.fault(what)

    def open(self, search=""):
        start = time.monotonic()
        self.page.goto(self.site + search, wait_until="load")
        self.page.wait_for_selector("body[data-pictured]", state="attached")
        return time.monotonic() - start

    def figure(self, name):
        return float(self.page.inner_text(f"#{name}"))

    def rest(self):
        """Waits until no time passes in the world any more, and returns its time [s]."""
        last = None
        for _ in range(PATIENCE // 1000):
            now = self.figure("time")
            if now == last:
                return now
            last = now
            self.page.wait_for_timeout(1000)
        raise AssertionError(f"{self.where}: time passes while it pauses")

    def wait(self, condition):
        self.page.wait_for_function(condition)


def episode(browser, site, asked):
    """The digests of an episode, and its wall time without them."""
    page = browser.new_page()
    said = []
    page.on("console", lambda message: said.append(message.text))
    page.goto(site + "worker.js")
    parts = {"ask": asked["ask"], "frames": asked["frames"]}
    checked = page.evaluate(ASK_WORKER, [{"kind": "check", **parts}, "checked"])
    timed = page.evaluate(ASK_WORKER, [{"kind": "time", **parts}, "timed"])
    page.close()
    told = checked["told"]
    print(f"{asked['frames']} frames in {timed['seconds']:.1f} s: {told['picked']} picked, {told['dropped']} dropped, {told['snapped']} snapped")
    return checked["digests"], timed["seconds"], said


def looks(visit):
    """The page as it stands: labels, sizes, width."""
    told = visit.page.evaluate(LOOK)
    for name in ["unnamed", "small", "out"]:
        visit.demand(not told[name], f"{name}: {told[name]}")
    visit.demand(told["scroll"] <= 0, f"is {told['scroll']} px wider than the window")


def pull(visit, touch):
    """Grabs what is in the picture's middle rows, and pulls; returns a screenshot of the pull. The page must tell its force."""
    page, box = visit.page, visit.page.locator("#canvas").bounding_box()
    session = visit.context.new_cdp_session(page)

    def send(kind, x, y):
        if touch:
            name = {"down": "touchStart", "move": "touchMove", "up": "touchEnd"}[kind]
            points = [] if kind == "up" else [{"x": x, "y": y}]
            session.send("Input.dispatchTouchEvent", {"type": name, "touchPoints": points})
        else:
            page.mouse.move(x, y)
            if kind != "move":
                getattr(page.mouse, kind)()

    def grab():
        for down in [0.62, 0.5, 0.4]:
            # The tree stands to the right of the middle, beside the robot.
            for right in [*range(62, 81), *range(20, 62, 2)]:
                x, y = box["x"] + box["width"] * right / 100, box["y"] + box["height"] * down
                send("down", x, y)
                page.wait_for_function("() => document.getElementById('canvas').dataset.pointer !== 'ask'")
                if page.get_attribute("#canvas", "data-pointer") == "pull":
                    return x, y
                send("up", x, y)
        raise AssertionError(f"{visit.where}: nothing can be grabbed")

    x, y = grab()
    for k in range(1, 7):
        send("move", x + 5 * k, y - 3 * k)
    page.wait_for_function(FORCE)
    shot = page.screenshot()
    send("up", x + 30, y - 18)
    page.wait_for_selector("#canvas[data-pointer='']")
    return shot


def wide(browser, site, errors, folder):
    visit = Visit(browser, site, SIZES["wide"], errors, "1280 px")
    first = visit.open()
    page = visit.page
    looks(visit)
    visit.wait("() => Number(document.getElementById('time').textContent) > 1")
    page.screenshot(path=folder / "wide.png")
    page.click("#run")
    visit.demand(page.inner_text("#run") == "Run", "Pause does not pause")
    stands = visit.rest()
    for _ in range(12):
        page.click("#step")
    visit.wait(f"() => Number(document.getElementById('time').textContent) > {stands}")
    page.click("#reset")
    visit.wait("() => Number(document.getElementById('time').textContent) === 0")
    page.select_option("#driver", "nobody")
    page.click("#grow")
    visit.wait("() => location.search.includes('driver=nobody') && document.getElementById('waiting').hidden")
    page.click("#run")
    (folder / "wide-pull.png").write_bytes(pull(visit, False))
    # By keyboard: what is nearest to the middle is grabbed, pulled and let go.
    page.focus("#canvas")
    page.keyboard.press("g")
    page.wait_for_selector("#canvas[data-pointer='pull']")
    for _ in range(3):
        page.keyboard.press("ArrowRight")
    visit.wait("() => !document.getElementById('arrow').hasAttribute('hidden')")
    page.keyboard.press("Escape")
    page.wait_for_selector("#canvas[data-pointer='']")
    page.keyboard.press("n")
    visit.wait("() => location.search.includes('seed=20250705') && document.getElementById('waiting').hidden")
    visit.demand(page.is_hidden("#problem"), f"says {page.inner_text('#problem')}")
    visit.context.close()
    return first


def narrow(browser, site, errors, folder):
    visit = Visit(browser, site, SIZES["narrow"], errors, "390 px", touch=True)
    visit.open("?preset=tall-spindle&seed=7&tree=2&foliage=0.3&driver=nobody&speed=2")
    page = visit.page
    looks(visit)
    visit.demand(page.input_value("#preset") == "tall-spindle" and page.input_value("#seed") == "7", "the link is not read")
    visit.demand(page.input_value("#foliage") == "0.3" and page.input_value("#speed") == "2", "the link's dials are not read")
    visit.wait("() => Number(document.getElementById('time').textContent) > 1")
    page.screenshot(path=folder / "narrow.png")
    page.screenshot(path=folder / "narrow-whole.png", full_page=True)
    (folder / "narrow-pull.png").write_bytes(pull(visit, True))
    visit.context.close()


def faults(browser, site, errors, folder, page):
    """Bad links, and browsers that lack something: each gets a sentence."""
    cases = {
        "?preset=lemon": "Preset `lemon` is unknown; the presets are: paper",
        "?seed=12x": "Seed `12x` is no whole number",
        "?driver=me": "Driver `me` is unknown",
        "?foliage=9": "Foliage:",
        "?tree=-1": "a whole number from 0 to",
        "?foliage=green": "which is no number",
        "?speed=3": "this page has 0.1",
        "?colour=red": "does not know",
    }
    for search, sentence in cases.items():
        visit = Visit(browser, site, SIZES["narrow"], errors, search)
        visit.page.goto(site + search)
        visit.page.wait_for_selector("#problem:not([hidden])")
        said = visit.page.inner_text("#problem")
        visit.demand(sentence in said, f"says {said}")
        looks(visit)
        if search == "?preset=lemon":
            visit.page.screenshot(path=folder / "refused.png")
            visit.page.click("#grow")
            visit.page.wait_for_selector("body[data-pictured]", state="attached")
        visit.context.close()
    lacks = {
        "WebGL2": ("page.js", "HTMLCanvasElement.prototype.getContext = () => null;", "Use a browser with WebGL2"),
        "WebAssembly": ("worker.js", "self.WebAssembly = undefined;", "It needs a browser with WebAssembly"),
    }
    for name, (file, without, sentence) in lacks.items():
        with tempfile.TemporaryDirectory() as copy:
            shutil.copytree(page, copy, dirs_exist_ok=True)
            changed = Path(copy) / file
            changed.write_text(without + changed.read_text())
            own = serve(copy)
            visit = Visit(browser, own, SIZES["narrow"], errors, f"without {name}")
            visit.page.goto(own)
            visit.page.wait_for_selector("#problem:not([hidden])")
            said = visit.page.inner_text("#problem")
            visit.demand(sentence in said, f"says {said}")
            visit.context.close()


def main():
    chromium, page, asked, found, folder = sys.argv[1:]
    folder, errors = Path(folder), []
    site = serve(page)
    with sync_playwright() as playwright:
        # As root Chromium refuses its sandbox; the pages are our own.
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox", *GRAPHICS])
        digests, seconds, said = episode(browser, site, json.loads(Path(asked).read_text()))
        errors += [f"the worker wrote to the console: {line}" for line in said]
        first = wide(browser, site, errors, folder)
        narrow(browser, site, errors, folder)
        faults(browser, site, errors, folder, page)
        browser.close()
    Path(found).write_text(json.dumps({"digests": digests, "seconds": seconds, "first_picture": first}))
    for error in errors:
        print(error, file=sys.stderr)
    sys.exit(1 if errors else 0)


main()
