"""Runs the page in headless Chromium: an episode frame by frame, and what a visitor does at 1280 and at 390 px.

usage: check.py CHROMIUM PAGE EPISODE.json FOUND.json SCREENSHOTS

EPISODE.json holds the options of the world, the number of frames and the length [s], and the same with the files of a policy; FOUND.json gets the
digest of every frame of both, the wall time of the first episode and the time to the first picture. Fails if the page writes to the console, is wider than its window, has a control without a label, does
not do what its controls say, or does not say what is wrong.
"""

import base64
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
# WebGPU, in software as well.
WEBGPU = ["--enable-unsafe-webgpu", "--use-webgpu-adapter=swiftshader", "--enable-features=Vulkan"]
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

# Share of the wrist camera's picture that differs from its first dot.
WRIST = """() => {
  const canvas = document.getElementById('wrist-picture'), n = canvas.width * canvas.height;
  const dots = new Uint32Array(canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data.buffer);
  return dots.reduce((sum, dot) => sum + (dot !== dots[0]), 0) / n;
}"""

# A gamepad of the standard mapping whose axes and buttons the test sets.
GAMEPAD = """() => {
  window.pad = { connected: true, mapping: 'standard', axes: [0, 0, 0, 0], buttons: Array.from({ length: 17 }, () => ({ pressed: false, value: 0 })) };
  Object.defineProperty(navigator, 'getGamepads', { value: () => [null, window.pad] });
}"""
PRESS = """async number => {
  const frames = n => new Promise(done => { const next = () => (n-- ? requestAnimationFrame(next) : done()); next(); });
  for (const pressed of [true, false]) { window.pad.buttons[number] = { pressed, value: Number(pressed) }; await frames(3); }
}"""

# Drops files of these names and texts on the page.
DROP = """files => {
  const dropped = new DataTransfer();
  for (const [name, text] of Object.entries(files)) dropped.items.add(new File([text], name));
  window.dispatchEvent(new DragEvent('drop', { dataTransfer: dropped, bubbles: true, cancelable: true }));
}"""

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
    other = asked["policy"]
    policy = {
        "name": other["name"],
        "network": base64.b64encode(Path(other["network"]).read_bytes()).decode(),
        "spec": Path(other["spec"]).read_text(),
    }
    parts = {"ask": other["ask"], "frames": other["frames"], "policy": policy}
    by_policy = page.evaluate(ASK_WORKER, [{"kind": "check", **parts}, "checked"])
    page.close()
    told = checked["told"]
    print(f"{asked['frames']} frames in {timed['seconds']:.1f} s: {told['picked']} picked, {told['dropped']} dropped, {told['snapped']} snapped")
    return checked["digests"], by_policy["digests"], timed["seconds"], said


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


def base(visit):
    """Place of the robot's base [m]."""
    return [float(x) for x in visit.page.get_attribute("#pads", "data-base").split()]


def moves(visit, start):
    """Waits until the base is farther than 2 cm from a place."""
    x, y, _ = start
    visit.wait(
        f"() => {{ const [x, y] = document.getElementById('pads').dataset.base.split(' ').map(Number); return Math.hypot(x - {x}, y - {y}) > 0.02; }}"
    )


def overlays(visit, folder):
    """The wrist camera, the controller's log, loads of wood and plots, by keys and switches; the address holds them."""
    page = visit.page
    page.wait_for_selector("#wrist-picture[data-frame]")
    visit.demand(page.evaluate(WRIST) > 0.02, "the wrist camera's picture is empty")
    page.keyboard.press("2")
    page.wait_for_selector("#wrist", state="hidden")
    visit.demand("overlays=leaves%2Cdetections" in page.url, f"the address does not tell overlays: {page.url}")
    for key in ["2", "5", "7", "0"]:
        page.keyboard.press(key)
    page.check("#overlay-contacts")
    visit.wait("() => Number(document.getElementById('plots').dataset.samples) > 5")
    visit.wait("() => /\\d s  \\w/.test(document.getElementById('log').textContent)")
    visit.wait("() => /expert: \\w+ .* found/.test(document.getElementById('wrist-told').textContent)")
    visit.demand(page.is_visible("#loads"), "the colours of loads are not explained")
    visit.wait("() => Number(document.getElementById('time').textContent) > 6")
    looks(visit)
    page.screenshot(path=folder / "wide-overlays.png")
    for key in ["5", "7", "0"]:
        page.keyboard.press(key)
    page.uncheck("#overlay-contacts")
    visit.demand("overlays" not in page.url, f"the address tells overlays that are always on: {page.url}")


def drives(visit, folder):
    """Takes the robot over by a key, drives it by keys and by a gamepad that is made up, and gives it back."""
    page = visit.page
    page.keyboard.press("t")
    page.wait_for_selector("body.driving")
    start = base(visit)
    page.keyboard.down("w")
    moves(visit, start)
    page.keyboard.up("w")
    looks(visit)
    page.screenshot(path=folder / "wide-drive.png")
    before = page.inner_text("#close")
    page.keyboard.press("c")
    visit.demand(page.inner_text("#close") != before, "C does not move the fingers")
    page.keyboard.press("t")
    page.wait_for_selector("body:not(.driving)", state="attached")
    visit.wait("() => document.getElementById('doing').textContent.startsWith('expert: ')")
    page.evaluate(GAMEPAD)
    page.evaluate(PRESS, 3)
    page.wait_for_selector("body.driving")
    start = base(visit)
    page.evaluate("() => { window.pad.axes[1] = 1; }")
    moves(visit, start)
    page.evaluate("() => { window.pad.axes[1] = 0; }")
    before = page.inner_text("#close")
    page.evaluate(PRESS, 0)
    visit.demand(page.inner_text("#close") != before, "the gamepad does not move the fingers")
    page.evaluate(PRESS, 3)
    page.wait_for_selector("body:not(.driving)", state="attached")


def policies(visit, policy):
    """Opens a policy by the file chooser; files that are none, or one alone, get a sentence."""
    page = visit.page
    page.evaluate(DROP, {"notes.txt": "an apple"})
    visit.demand("is no policy: open a network" in page.inner_text("#problem"), f"says {page.inner_text('#problem')}")
    page.evaluate(DROP, {"bad.onnx": "no network"})
    visit.wait("() => document.getElementById('policy-told').textContent.startsWith('Open its spec bad.json, too')")
    page.evaluate(DROP, {"bad.json": "{"})
    visit.wait("() => document.getElementById('problem').textContent.startsWith('Driver onnx:bad.onnx: the spec: EOF while parsing')")
    page.set_input_files("#policy", [policy["network"], policy["spec"]])
    visit.wait(f"() => location.search.includes('driver=onnx%3A{policy['name']}') && document.getElementById('waiting').hidden")
    visit.wait("() => Number(document.getElementById('time').textContent) > 0.3")
    visit.demand(page.is_hidden("#problem"), f"says {page.inner_text('#problem')}")


def trees(visit, good, touch):
    """Opens digitised trees by the file chooser; bad ones get a sentence, and the tree before stays."""
    page = visit.page
    click = page.tap if touch else page.click

    def says(sentence):
        visit.wait(f"() => document.getElementById('problem').textContent.includes({json.dumps(sentence)})")
        looks(visit)

    def grown(name):
        visit.wait(f"() => (new URLSearchParams(location.search).get('tree_file') ?? '') === '{name}' && document.getElementById('waiting').hidden")
        visit.demand(page.is_hidden("#problem"), f"says {page.inner_text('#problem')}")

    skeleton, mtg = good
    page.set_input_files("#tree-file", skeleton)
    grown("tree.json")
    visit.demand(page.inner_text("#tree-told") == "tree.json is open.", f"tells {page.inner_text('#tree-told')}")
    visit.demand(page.input_value("#source") == "tree.json" and page.is_disabled("#tree-unit"), "the tree is not chosen")
    start = visit.figure("time")
    visit.wait(f"() => Number(document.getElementById('time').textContent) !== {start}")
    page.evaluate(DROP, {"bad.json": '{ "format": "orchard-skeleton", "schema_version": 9 }'})
    says("Tree bad.json: schema_version is 9; this version reads 1. The tree before stays")
    page.evaluate(DROP, {"bad.mtg": "an apple"})
    says("Tree bad.mtg: ")
    page.set_input_files("#tree-file", {"name": "tree.ply", "mimeType": "text/plain", "buffer": b"ply"})
    says("“tree.ply” is no tree: open a skeleton, FILE.json, or an MTG file, FILE.mtg.")
    page.set_input_files("#tree-file", mtg)
    grown("tree.mtg")
    visit.wait("() => document.getElementById('tree-told').textContent.includes('The file states no unit: metres are taken')")
    looks(visit)
    page.fill("#tree-unit", "furlong")
    click("#grow")
    says("Tree tree.mtg: the unit")
    page.fill("#tree-unit", "m")
    click("#grow")
    visit.wait("() => location.search.includes('tree_unit=m') && document.getElementById('waiting').hidden")
    page.evaluate("() => scrollTo(0, 0)")
    shot = page.screenshot()
    page.select_option("#source", "")
    click("#grow")
    grown("")
    visit.demand(page.inner_text("#tree-told") == "", "the file of a tree that was grown is told")
    return shot


def wide(browser, site, errors, folder, policy, files):
    visit = Visit(browser, site, SIZES["wide"], errors, "1280 px")
    first = visit.open()
    page = visit.page
    looks(visit)
    visit.wait("() => Number(document.getElementById('time').textContent) > 1")
    page.screenshot(path=folder / "wide.png")
    overlays(visit, folder)
    drives(visit, folder)
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
    policies(visit, policy)
    page.select_option("#driver", "expert")
    (folder / "wide-tree.png").write_bytes(trees(visit, files, False))
    page.select_option("#driver", f"onnx:{policy['name']}")
    # It was made for another robot.
    page.select_option("#robot", "rail-xarm6-suction")
    page.select_option("#camera", "d435i")
    page.click("#grow")
    visit.wait("() => document.getElementById('problem').textContent.includes('the policy was made for robot ridgeback-fr3')")
    page.select_option("#driver", "expert")
    page.click("#grow")
    visit.wait("() => location.search.includes('robot=rail-xarm6-suction&camera=d435i') && document.getElementById('waiting').hidden")
    page.wait_for_selector("#wrist-picture[data-frame]", state="visible")
    page.screenshot(path=folder / "wide-robot.png")
    visit.context.close()
    return first


def narrow(browser, site, errors, folder, files):
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
    (folder / "narrow-tree.png").write_bytes(trees(visit, files, True))
    page.tap("#take")
    page.wait_for_selector("body.driving")
    page.evaluate("() => scrollTo(0, 0)")
    start, box = base(visit), page.locator("[data-drive='base 0 -1']").bounding_box()
    session = visit.context.new_cdp_session(page)
    finger = [{"x": box["x"] + box["width"] / 2, "y": box["y"] + box["height"] / 2}]
    session.send("Input.dispatchTouchEvent", {"type": "touchStart", "touchPoints": finger})
    moves(visit, start)
    looks(visit)
    page.screenshot(path=folder / "narrow-drive.png")
    session.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
    page.wait_for_selector("[data-held]", state="detached")
    visit.context.close()


def batches(playwright, chromium, site, errors, folder, asked):
    """The page of many trees at both sizes; returns joint angles of some trees of each batch asked for, and how fast the page steps trees. Without WebGPU it says so."""
    browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox", *WEBGPU])
    visit = Visit(browser, site, SIZES["wide"], errors, "many trees")
    visit.page.goto(site + "batch.html?wait=")
    looks(visit)
    angles = [visit.page.evaluate("asked => window.anglesAfter(asked)", one) for one in asked]
    offered = visit.page.locator("#preset option").all_inner_texts()
    visit.demand(offered == [one["asked"]["preset"] for one in asked[1:]], f"offers the presets {offered}")
    visit.context.close()
    rate = 0
    for name, touch in [("wide", False), ("narrow", True)]:
        visit = Visit(browser, site, SIZES[name], errors, f"many trees, {name}", touch=touch)
        page = visit.page
        page.goto(site + "batch.html" + ("?wait=" if touch else ""))
        if touch:
            page.select_option("#worlds", "8")
            page.tap("#grow")
        page.wait_for_selector("body[data-pictured]", state="attached")
        visit.wait("() => Number(document.body.dataset.pictured) >= 30")
        visit.demand("substeps of a tree per second" in page.inner_text("#told"), f"tells {page.inner_text('#told')}")
        visit.demand(page.is_hidden("#problem"), f"says {page.inner_text('#problem')}")
        looks(visit)
        page.screenshot(path=folder / f"{name}-batch.png", full_page=True)
        if not touch:
            rate = float(page.get_attribute("body", "data-rate"))
            page.click("#run")
            visit.demand(page.inner_text("#run") == "Run", "Pause does not pause")
            page.fill("#seed", "12x")
            page.click("#grow")
            visit.wait("() => document.getElementById('problem').textContent.includes('seed “12x” is no whole number')")
        visit.context.close()
    lacks = {
        "Object.defineProperty(Navigator.prototype, 'gpu', { get: () => undefined });": "this browser has no WebGPU. Use one that has it",
        "GPU.prototype.requestAdapter = async () => null;": "WebGPU is here, but finds no graphics device",
    }
    for without, sentence in lacks.items():
        visit = Visit(browser, site, SIZES["narrow"], errors, "without WebGPU")
        visit.page.add_init_script(without)
        visit.page.goto(site + "batch.html")
        visit.page.wait_for_selector("#problem:not([hidden])")
        visit.demand(sentence in visit.page.inner_text("#problem"), f"says {visit.page.inner_text('#problem')}")
        looks(visit)
        visit.context.close()
    browser.close()
    return angles, rate


def faults(browser, site, errors, folder, page):
    """Bad links, and browsers that lack something: each gets a sentence."""
    cases = {
        "?preset=lemon": "Preset `lemon` is unknown; the presets are: paper",
        "?seed=12x": "Seed `12x` is no whole number",
        "?driver=me": "Driver `me` is unknown",
        "?foliage=9": "Foliage:",
        "?tree=-1": "a whole number from 0 to",
        "?foliage=green&speed=3&colour=red": ["which is no number", "this page has 0.1", "does not know"],
        "?robot=mule": "No robot 'mule'; the robots are: ridgeback-fr3",
        "?camera=box": "No camera 'box'; the cameras are:",
        "?overlays=smell&driver=nobody": "Overlay `smell` is unknown; the overlays are: leaves",
        "?tree_file=mine.mtg": "Tree mine.mtg: its file is not here: open mine.mtg",
        "?tree_unit=mm": "Tree_unit is of a tree from a file",
        "?driver=onnx:mine.onnx": "its two files are not here: open mine.onnx",
    }
    for search, sentences in cases.items():
        visit = Visit(browser, site, SIZES["narrow"], errors, search)
        visit.page.goto(site + search)
        visit.page.wait_for_selector("#problem:not([hidden])")
        said = visit.page.inner_text("#problem")
        for sentence in [sentences] if isinstance(sentences, str) else sentences:
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
        asked = json.loads(Path(asked).read_text())
        digests, policy_digests, seconds, said = episode(browser, site, asked)
        errors += [f"the worker wrote to the console: {line}" for line in said]
        first = wide(browser, site, errors, folder, asked["policy"], asked["trees"])
        narrow(browser, site, errors, folder, asked["trees"])
        faults(browser, site, errors, folder, page)
        browser.close()
        angles, rate = batches(playwright, chromium, site, errors, folder, asked["batches"])
    Path(found).write_text(json.dumps({"digests": digests, "policy_digests": policy_digests, "angles": angles, "batch_rate": rate, "seconds": seconds, "first_picture": first}))
    for error in errors:
        print(error, file=sys.stderr)
    sys.exit(1 if errors else 0)


main()
