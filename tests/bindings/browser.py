"""Controls headless Chromium through a pipe, with messages of the DevTools protocol. Each message ends with a zero byte."""
import base64
import json
import os
import select
import shutil
import struct
import subprocess
import tempfile
import time
import zlib
from pathlib import Path

PROGRAM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")


class Browser:
    """A browser with one page. `errors` contains all errors that the console of the page reports, and all exceptions."""

    def __init__(self, width=900, height=600, dark=False):
        self.folder = tempfile.mkdtemp(prefix="shm-browser-")
        to_read, self.write = os.pipe()
        self.read, to_write = os.pipe()
        # The browser reads commands from file descriptor 3 and writes its answers to descriptor 4.
        self.process = subprocess.Popen(
            ["bash", "-c", f'exec 3<&{to_read} 4>&{to_write}; exec "$0" "$@"', PROGRAM, "--headless=new", "--no-sandbox",
             "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--remote-debugging-pipe", "--no-first-run",
             "--disable-background-networking", "--disable-component-update", "--disable-extensions",
             f"--window-size={width},{height}", f"--user-data-dir={self.folder}", "about:blank"],
            pass_fds=(to_read, to_write), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        os.close(to_read)
        os.close(to_write)
        self.pending, self.ids, self.session, self.errors, self.answers = b"", 0, None, [], {}
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        self.session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(f"{domain}.enable")
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False)
        if dark:
            self.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": "dark"}])

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.terminate()
        try:
            self.process.wait(20)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        os.close(self.write)
        os.close(self.read)
        shutil.rmtree(self.folder, ignore_errors=True)

    def take(self, timeout):
        """Returns the next message of the browser, or None if none arrives in time."""
        while b"\0" not in self.pending:
            if not select.select([self.read], [], [], timeout)[0]:
                return None
            got = os.read(self.read, 1 << 20)
            if not got:
                raise RuntimeError("the browser ended")
            self.pending += got
        message, self.pending = self.pending.split(b"\0", 1)
        message = json.loads(message)
        method, told = message.get("method"), message.get("params", {})
        if method == "Runtime.exceptionThrown":
            details = told["exceptionDetails"]
            self.errors.append(details.get("exception", {}).get("description", details["text"]))
        elif method == "Runtime.consoleAPICalled" and told["type"] in ("error", "warning", "assert"):
            self.errors.append(" ".join(str(one.get("value", one.get("description"))) for one in told["args"]))
        elif method == "Log.entryAdded" and told["entry"]["level"] in ("error", "warning"):
            self.errors.append(f"{told['entry']['text']} {told['entry'].get('url', '')}")
        elif "id" in message:
            self.answers[message["id"]] = message
        return message

    def call(self, method, **parameters):
        self.ids += 1
        mine = self.ids
        message = {"id": mine, "method": method, "params": parameters}
        if self.session:
            message["sessionId"] = self.session
        os.write(self.write, json.dumps(message).encode() + b"\0")
        end = time.monotonic() + 120
        while mine not in self.answers:
            if self.take(max(end - time.monotonic(), 0)) is None:
                raise RuntimeError(f"{method}: no answer")
        answer = self.answers.pop(mine)
        if "error" in answer:
            raise RuntimeError(f"{method}: {answer['error']['message']}")
        return answer["result"]

    def go(self, url):
        self.call("Page.navigate", url=url)

    def run(self, script):
        """Evaluates a JavaScript expression in the page and returns its value. If the value is a promise,
        waits for it and returns its result."""
        got = self.call("Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in got:
            raise RuntimeError(got["exceptionDetails"].get("exception", {}).get("description", script))
        return got["result"].get("value")

    def wait(self, script, timeout=60, title=None):
        """Waits until the JavaScript expression is true. Returns the waiting time in seconds."""
        began = time.monotonic()
        while not self.run(script):
            if time.monotonic() - began > timeout:
                raise RuntimeError(f"{title or script}: not true after {timeout} seconds; errors: {self.errors}")
            time.sleep(0.02)
        return time.monotonic() - began

    def processor_seconds(self):
        """Returns the total CPU time, in seconds, of the browser processes that are still running."""
        of, taken = {}, {}
        for stat in Path("/proc").glob("[0-9]*/stat"):
            try:
                words = stat.read_text().rpartition(")")[2].split()
            except OSError:
                continue  # the process has ended
            of[int(stat.parent.name)] = int(words[1])
            taken[int(stat.parent.name)] = int(words[11]) + int(words[12])
        total = 0
        for process in taken:
            above = process
            while above in of and above != self.process.pid:
                above = of[above]
            total += taken[process] if above == self.process.pid else 0
        return total / os.sysconf("SC_CLK_TCK")

    def key(self, key, shift=False):
        for kind in ("keyDown", "keyUp"):
            text = {"text": key} if len(key) == 1 and kind == "keyDown" else {}
            self.call("Input.dispatchKeyEvent", type=kind, key=key, modifiers=8 if shift else 0, **text)

    def drag(self, start, end, button="left"):
        buttons = {"left": 1, "right": 2}[button]
        steps = [("mousePressed", start, buttons)]
        steps += [("mouseMoved", [start[i] + (end[i] - start[i]) * share / 4 for i in (0, 1)], buttons)
                  for share in (1, 2, 3, 4)]
        steps.append(("mouseReleased", end, 0))
        for kind, (x, y), held in steps:
            self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button=button, buttons=held, clickCount=1)

    def touch(self, *fingers):
        """Simulates touches with one or more fingers. A finger is a list of positions: the position of its
        first touch, then the positions to which it moves. All lists have the same length."""
        for i, places in enumerate(zip(*fingers)):
            self.call("Input.dispatchTouchEvent", type="touchMove" if i else "touchStart",
                      touchPoints=[{"x": x, "y": y, "id": finger} for finger, (x, y) in enumerate(places)])
        self.call("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])

    def wheel(self, place, lines):
        self.call("Input.dispatchMouseEvent", type="mouseWheel", x=place[0], y=place[1], deltaX=0, deltaY=lines)

    def named_controls(self):
        """Returns (role, name) of each control that the browser reports to screen readers."""
        self.call("Accessibility.enable")
        controls = {"button", "checkbox", "combobox", "slider", "textbox", "image", "DisclosureTriangle", "link", "radio"}
        return [(node["role"]["value"], node.get("name", {}).get("value", ""))
                for node in self.call("Accessibility.getFullAXTree")["nodes"]
                if not node["ignored"] and node["role"]["value"] in controls]

    def picture(self, selector):
        """Returns the pixels of an element as (width, height, list of (r, g, b))."""
        box = self.run(f"(() => {{ const b = document.querySelector({json.dumps(selector)}).getBoundingClientRect();"
                       " return [b.left, b.top, b.width, b.height]; })()")
        # After two frames, everything is drawn.
        self.run("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
        png = self.call("Page.captureScreenshot", clip=dict(zip(("x", "y", "width", "height"), box), scale=1))["data"]
        return pixels(base64.b64decode(png))


def pixels(png):
    """Returns the pixels of a PNG file that has 8 bits per channel and 3 or 4 channels."""
    at, packed = 8, b""
    while at < len(png):
        length, kind = struct.unpack(">I4s", png[at:at + 8])
        body = png[at + 8:at + 8 + length]
        if kind == b"IHDR":
            width, height, depth, colours = struct.unpack(">IIBB", body[:10])
        elif kind == b"IDAT":
            packed += body
        at += 12 + length
    parts = {2: 3, 6: 4}[colours]
    if depth != 8:
        raise ValueError(f"{depth} bits")
    raw, before, found = zlib.decompress(packed), bytearray(width * parts), []
    for row in range(height):
        begin = row * (width * parts + 1)
        kind, line = raw[begin], bytearray(raw[begin + 1:begin + 1 + width * parts])
        for i in range(width * parts if kind else 0):
            left = line[i - parts] if i >= parts else 0
            above, corner = before[i], before[i - parts] if i >= parts else 0
            if kind == 4:
                guess = min((left, above, corner), key=lambda one: abs(left + above - corner - one))
            else:
                guess = (left, above, (left + above) // 2)[kind - 1]
            line[i] = line[i] + guess & 255
        before = line
        found += [tuple(line[i:i + 3]) for i in range(0, len(line), parts)]
    return width, height, found
