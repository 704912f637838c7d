"""A studio that runs in a process of its own, and pages that talk to it as browsers do."""

import contextlib
import http.client
import json
import re
import signal
import struct
import subprocess
import sys
from urllib.parse import quote

import numpy as np
from websockets.sync.client import connect


class Studio:
    """The command, started; it ends as Ctrl-C ends it."""

    def __init__(self, folder, *arguments):
        self.process = subprocess.Popen(
            [sys.executable, "-m", "fabweave", "studio", *arguments, "--no-browser",
             "-o", str(folder)],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        )  # fmt: skip
        self.folder = folder
        self.line = self.process.stdout.readline()
        self.host, self.path = re.search(r"http://([^/]+)(/\S+/)", self.line).groups()

    @property
    def address(self):
        return f"http://{self.host}{self.path}"

    def ask(self, path, method="GET", body=None, origin=True, host=None):
        """Return status, headers and body of an answer."""
        link = http.client.HTTPConnection(self.host, timeout=60)
        headers = {"Host": host or self.host}
        if origin:
            headers["Origin"] = f"http://{self.host}" if origin is True else origin
        link.request(method, self.path + path if not path.startswith("/") else path, body, headers)
        answer = link.getresponse()
        with contextlib.closing(link):
            return answer.status, answer.headers, answer.read()

    def take(self, name, data):
        status, _, body = self.ask(f"take?name={quote(name)}", "POST", data)
        return status, json.loads(body)

    def page(self):
        return LivePage(self)

    def end(self):
        self.process.send_signal(signal.SIGINT)
        out, wrong = self.process.communicate(timeout=20)
        return self.process.returncode, out, wrong


class LivePage:
    """A socket of a page, with what is told in order."""

    def __init__(self, studio):
        self.open = contextlib.ExitStack()
        address, origin = f"ws://{studio.host}{studio.path}live", f"http://{studio.host}"
        self.socket = self.open.enter_context(connect(address, origin=origin, max_size=None))
        self.number = 0

    def wish(self, to, mesh="shape:torus?m=8&n=4", options=None, **more):
        self.number += 1
        wish = {"n": self.number, "to": to, "mesh": mesh, "options": options or {}, **more}
        self.socket.send(json.dumps(wish))
        return self.number

    def told(self, timeout=120):
        data = self.socket.recv(timeout=timeout)
        return unpacked(data) if isinstance(data, bytes) else json.loads(data)

    def all_told(self, to, mesh="shape:torus?m=8&n=4", options=None, **more):
        """Return everything that is told of a wish, until it is done."""
        number, found = self.wish(to, mesh, options, **more), []
        while not found or not (found[-1].get("done") and found[-1]["n"] == number):
            found.append(self.told())
        return [one for one in found if one["n"] == number and "progress" not in one]

    def close(self):
        self.open.close()


def unpacked(data):
    """Return a binary message with its arrays."""
    (length,) = struct.unpack("<I", data[:4])
    told = json.loads(data[4 : 4 + length])
    at = 4 + length + -length % 4
    for array in told["arrays"]:
        values = np.frombuffer(data, array["type"], array["length"], at)
        told[array["name"]] = values
        at += values.nbytes + -values.nbytes % 4
    assert at == len(data)
    return told
