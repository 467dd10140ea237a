"""A real browser for tests: Chromium without a window, spoken to over a pipe, with no network.

The DevTools protocol: JSON messages, each ended by a zero byte, on the browser's descriptors 3 and
4; so no port is listened on.
"""

import base64
import itertools
import json
import os
import select
import shutil
import subprocess
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

NAMES = ("chromium", "chromium-browser", "google-chrome")
FLAGS = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-dev-shm-usage",
    # Whatever a page asked the network for would fail, and be an error in the console.
    "--host-resolver-rules=MAP * ~NOTFOUND",
    "--remote-debugging-pipe",
)
WAIT_S = 60.0

START = """
import fcntl, os, sys
read, write = (fcntl.fcntl(int(end), fcntl.F_DUPFD, 10) for end in sys.argv[1:3])
os.dup2(read, 3)
os.dup2(write, 4)
os.execv(sys.argv[3], sys.argv[3:])
"""
"""Puts the ends of two pipes on the descriptors that the browser looks for, and becomes it."""


def executable() -> str | None:
    """Return the path of a Chromium, or None."""
    return next((path for name in NAMES if (path := shutil.which(name))), None)


class Browser:
    """One open page.

    Attributes:
        errors: what the console of the page had to complain about.
        asked: the addresses of everything that the page loaded.
    """

    def __init__(self, read_fd: int, write_fd: int) -> None:
        self._read_fd, self._write_fd = read_fd, write_fd
        self._received = b""
        self._numbers = itertools.count(1)
        self._session: str | None = None
        self._is_loaded = False
        self.errors: list[str] = []
        self.asked: list[str] = []
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        attached = self.call("Target.attachToTarget", targetId=target, flatten=True)
        self._session = attached["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(f"{domain}.enable")

    def call(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Return the answer to a command of the protocol."""
        number = next(self._numbers)
        message: dict[str, Any] = {"id": number, "method": method, "params": parameters}
        if self._session is not None:
            message["sessionId"] = self._session
        os.write(self._write_fd, json.dumps(message).encode() + b"\0")
        while True:
            answer = self._next()
            if answer.get("id") == number:
                if "error" in answer:
                    raise RuntimeError(f"{method}: {answer['error']}")
                found: dict[str, Any] = answer["result"]
                return found
            self._take(answer)

    def open(self, path: Path, size: tuple[int, int] = (1280, 800), scheme: str = "light") -> None:
        """Open a file of the disk, and wait until its scripts say that they are ready."""
        self.errors.clear()
        self.asked.clear()
        self.call("Emulation.setDeviceMetricsOverride", width=size[0], height=size[1],
                  deviceScaleFactor=1, mobile=False)  # fmt: skip
        feature = {"name": "prefers-color-scheme", "value": scheme}
        self.call("Emulation.setEmulatedMedia", features=[feature])
        self._is_loaded = False
        self.call("Page.navigate", url=path.absolute().as_uri())
        while not self._is_loaded:
            self._take(self._next())
        self.run(
            "new Promise(done => { const look = () =>"
            " document.documentElement.dataset.ready ? done(1) : setTimeout(look, 20);"
            " look(); })"
        )

    def run(self, script: str) -> Any:
        """Return the value of an expression in the page, waited for if it is a promise."""
        answer = self.call(
            "Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True
        )
        if "exceptionDetails" in answer:
            raise RuntimeError(f"{script}: {answer['exceptionDetails']}")
        return answer["result"].get("value")

    def press(self, key: str, code: int) -> None:
        """Press a key, where the page has its focus."""
        for kind in ("rawKeyDown", "keyUp"):
            self.call("Input.dispatchKeyEvent", type=kind, key=key, code=key,
                      windowsVirtualKeyCode=code)  # fmt: skip

    def drag(self, start: tuple[float, float], end: tuple[float, float]) -> None:
        """Move the pointer to a point, press, move to another and release; x and y from the top."""
        moves = [("mouseMoved", start, 0), ("mousePressed", start, 1), ("mouseMoved", end, 1),
                 ("mouseReleased", end, 0)]  # fmt: skip
        for kind, (x, y), buttons in moves:
            self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, buttons=buttons,
                      button="left" if kind != "mouseMoved" or buttons else "none",
                      clickCount=1)  # fmt: skip

    def screenshot(self, path: Path, box: Mapping[str, float] | None = None) -> None:
        """Write what is to be seen, or a box of the page, as a PNG."""
        more: dict[str, Any] = {}
        if box is not None:
            more = {"clip": {**box, "scale": 1}, "captureBeyondViewport": True}
        answer = self.call("Page.captureScreenshot", format="png", **more)
        path.write_bytes(base64.b64decode(answer["data"]))

    def close(self) -> None:
        """Ask the browser to end."""
        self._session = None
        self.call("Browser.close")

    def _next(self) -> dict[str, Any]:
        while b"\0" not in self._received:
            if not select.select([self._read_fd], [], [], WAIT_S)[0]:
                raise TimeoutError("the browser does not answer")
            got = os.read(self._read_fd, 1 << 20)
            if not got:
                raise RuntimeError("the browser has ended")
            self._received += got
        message, _, self._received = self._received.partition(b"\0")
        found: dict[str, Any] = json.loads(message)
        return found

    def _take(self, event: Mapping[str, Any]) -> None:
        method, parameters = event.get("method"), event.get("params", {})
        if method == "Runtime.exceptionThrown":
            self.errors.append(json.dumps(parameters["exceptionDetails"]))
        elif method == "Runtime.consoleAPICalled" and parameters["type"] in ("error", "warning"):
            self.errors.append(json.dumps(parameters["args"]))
        elif method == "Log.entryAdded" and parameters["entry"]["level"] in ("error", "warning"):
            self.errors.append(json.dumps(parameters["entry"]))
        elif method == "Page.loadEventFired":
            self._is_loaded = True
        elif method == "Network.requestWillBeSent":
            self.asked.append(parameters["request"]["url"])


@contextmanager
def chromium(profile: Path) -> Iterator[Browser]:
    """Yield a browser with an empty profile of its own, and end it after.

    Raises:
        RuntimeError: there is no Chromium, or it ended by itself.
    """
    path = executable()
    if path is None:
        raise RuntimeError(f"none of {', '.join(NAMES)} is installed")
    to_read, to_write = os.pipe(), os.pipe()
    ends = [str(to_read[0]), str(to_write[1])]
    command = [sys.executable, "-c", START, *ends, path, *FLAGS, f"--user-data-dir={profile}"]
    process = subprocess.Popen(
        [*command, "about:blank"], pass_fds=(to_read[0], to_write[1]), stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL, stdin=subprocess.DEVNULL,
    )  # fmt: skip
    os.close(to_read[0])
    os.close(to_write[1])
    try:
        browser = Browser(to_write[0], to_read[1])
        yield browser
        # It closes its files in peace, so that the profile can be removed.
        browser.close()
        process.wait(timeout=WAIT_S)
    finally:
        process.kill()
        process.wait()
        os.close(to_read[1])
        os.close(to_write[0])
