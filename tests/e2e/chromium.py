"""A real Chromium without a window, steered over its own debugging protocol (CDP)."""

import base64
import json
import os
import shutil
import signal
import subprocess
import time
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Any, Self
from urllib.error import HTTPError
from urllib.request import Request, urlopen

from websockets.sync.client import ClientConnection, connect

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
_OPTIONS = (
    "--headless=new",
    "--no-sandbox",
    "--disable-gpu-sandbox",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-extensions",
    "--remote-debugging-port=0",
    "--remote-allow-origins=*",
)
OPENS_S = 30.0
DRAWS_NOTHING = """const draw = ['drawArrays', 'drawElements', 'drawArraysInstanced', 'drawElementsInstanced'];
    for (const name of [...draw, 'clear']) WebGL2RenderingContext.prototype[name] = () => {};"""
"""Without a graphics card one picture takes the processor for so long that a held button seems to be let go."""


class Refused(Exception):
    """The browser does not do what a call asks for."""


class Tab:
    """One page of a browser; every call waits for its answer."""

    def __init__(self, address: str, target: str) -> None:
        self.target = target
        self._socket: ClientConnection = connect(address, max_size=2**26)
        self._number = 0
        for domain in ("Page", "Runtime", "Network"):
            self.call(f"{domain}.enable")

    def call(self, method: str, timeout_s: float = 30.0, **parameters: object) -> Any:
        """One call of the protocol, and its result."""
        self._number += 1
        self._socket.send(json.dumps({"id": self._number, "method": method, "params": parameters}))
        deadline = time.monotonic() + timeout_s
        while True:
            found = json.loads(self._socket.recv(max(0.01, deadline - time.monotonic())))
            if found.get("id") == self._number:
                if "error" in found:
                    raise Refused(f"{method}: {found['error']}")
                return found["result"]

    def open(self, address: str) -> None:
        self.call("Page.navigate", url=address)

    def js(self, expression: str) -> Any:
        """The value of a JavaScript expression, awaited where it is a promise."""
        found = self.call("Runtime.evaluate", expression=expression, awaitPromise=True, returnByValue=True)
        assert "exceptionDetails" not in found, f"{expression}: {found['exceptionDetails']}"
        return found["result"].get("value")

    def text(self) -> str:
        """What can be read on the page; nothing while another one is being opened."""
        try:
            return str(self.js("document.body?.innerText ?? ''"))
        except Refused:
            return ""

    def middle_of(self, words: str, which: str = "find") -> tuple[float, float] | None:
        """Where the first button or tab with these words is, scrolled into view; None while there is none.

        `which`: `findLast` for the last one.
        """
        found = self.js(
            "(() => { const all = [...document.querySelectorAll('button, [role=tab], label')];"
            f"const it = all.{which}(each => each.innerText.trim() === {json.dumps(words)} && each.offsetParent);"
            "if (!it) return null; it.scrollIntoView({block: 'center'}); const r = it.getBoundingClientRect();"
            "return [r.x + r.width / 2, r.y + r.height / 2]; })()"
        )
        return None if found is None else (found[0], found[1])

    def mouse(self, what: str, at: tuple[float, float]) -> None:
        """`mousePressed`, `mouseReleased` or `mouseMoved`."""
        buttons = {"mousePressed": 1}.get(what, 0)
        self.call("Input.dispatchMouseEvent", type=what, x=at[0], y=at[1], button="left", buttons=buttons, clickCount=1)

    def click(self, words: str, which: str = "find") -> None:
        at = self.middle_of(words, which)
        assert at is not None, f"no {words!r} on the page:\n{self.text()}"
        self.mouse("mousePressed", at)
        self.mouse("mouseReleased", at)

    def write(self, label: str, text: str) -> None:
        """Type into the field beside a label."""
        assert self.js(
            f"(() => {{ const all = [...document.querySelectorAll('label')];"
            f"const it = all.find(each => each.innerText.trim() === {json.dumps(label)} && each.offsetParent);"
            "for (let at = it; at; at = at.parentElement) { const field = at.querySelector('input');"
            "if (field) { field.focus(); field.select(); return true; } } return false; })()"
        ), f"no field {label!r} on the page:\n{self.text()}"
        self.call("Input.insertText", text=text)

    def screenshot(self, file: Path) -> None:
        file.write_bytes(base64.b64decode(self.call("Page.captureScreenshot", format="png")["data"]))

    def close(self) -> None:
        self._socket.close()


class Chromium:
    """One browser with its own profile; a context manager that ends it."""

    def __init__(self, folder: Path, width: int = 1000, height: int = 700, *, draws: bool = False) -> None:
        assert CHROMIUM is not None
        self._draws = draws
        self._profile = folder / f"chromium-{time.monotonic_ns()}"
        self._profile.mkdir()
        self._process = subprocess.Popen(
            [CHROMIUM, *_OPTIONS, f"--window-size={width},{height}", f"--user-data-dir={self._profile}", "about:blank"],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )
        self._tabs: list[Tab] = []
        self._port = self._opened_port()

    def _opened_port(self) -> int:
        file, deadline = self._profile / "DevToolsActivePort", time.monotonic() + OPENS_S
        while time.monotonic() < deadline:
            if file.exists() and (lines := file.read_text().splitlines()):
                return int(lines[0])
            assert self._process.poll() is None, "the browser has ended"
            time.sleep(0.02)
        raise AssertionError("the browser does not start")

    def tab(self, address: str) -> Tab:
        """A new tab at an address."""
        request = Request(f"http://127.0.0.1:{self._port}/json/new?about:blank", method="PUT")
        with urlopen(request) as answer:
            found = json.load(answer)
        tab = Tab(found["webSocketDebuggerUrl"], found["id"])
        self._tabs.append(tab)
        tab.call("Page.addScriptToEvaluateOnNewDocument", source="" if self._draws else DRAWS_NOTHING)
        tab.open(address)
        return tab

    def close_tab(self, tab: Tab) -> None:
        """Close a tab by force, whatever it does."""
        with urlopen(f"http://127.0.0.1:{self._port}/json/close/{tab.target}"):
            pass

    def close_tabs(self) -> None:
        """Close all tabs that were opened here."""
        for tab in self._tabs:
            with suppress(HTTPError):
                self.close_tab(tab)
            tab.close()
        self._tabs.clear()

    def signal(self, number: signal.Signals) -> None:
        """To all processes of the browser."""
        os.killpg(self._process.pid, number)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, tb: TracebackType | None) -> None:
        self.signal(signal.SIGKILL)
        self._process.wait()
        shutil.rmtree(self._profile, ignore_errors=True)
