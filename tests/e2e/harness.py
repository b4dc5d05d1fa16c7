"""The real programs as processes, real HTTP, temporary folders: what the end-to-end tests stand on.

CONFIG (release, sanitize, ...) and COMPILER (gcc, clang) of the environment choose which build.
Everything waits for a condition with a generous limit; nothing waits for a time to pass.
"""

import atexit
import collections
import functools
import http.client
import json
import math
import os
import pathlib
import re
import shutil
import signal
import socket
import subprocess
import tempfile
import threading
import time

import cube
import picture

ROOT = pathlib.Path(__file__).resolve().parents[2]
CONFIG = os.environ.get("CONFIG", "release")
COMPILER = os.environ.get("COMPILER", "gcc")
BUILD = ROOT / "build" / (CONFIG + ("-clang" if COMPILER == "clang" else ""))
SLOW = CONFIG != "release"  # sanitizers: five to twenty times the time
LIMIT_S = 120 if SLOW else 60  # of any one wait; reaching it is a failure
REPORTS = re.compile(rb"(runtime error:|ERROR: \w+Sanitizer|WARNING: ThreadSanitizer|SUMMARY: )")

ENVIRONMENT = {
    **{k: v for k, v in os.environ.items() if not k.startswith(("LIGHTPROBE_", "ASAN_", "UBSAN_"))},
    "ASAN_OPTIONS": "exitcode=86:abort_on_error=0:detect_leaks=1:strict_string_checks=1",
    "UBSAN_OPTIONS": "halt_on_error=1:print_stacktrace=1:exitcode=86",
    "TSAN_OPTIONS": ":".join(filter(None, (
        os.environ.get("TSAN_OPTIONS"), "exitcode=86:halt_on_error=0",
        "suppressions=%s" % (ROOT / "tests" / "tsan.supp")))),
    "LC_ALL": "C.UTF-8",
}


def build_of(compiler):
    """The folder of this CONFIG by another compiler."""
    return ROOT / "build" / (CONFIG + ("-clang" if compiler == "clang" else ""))


def temporary_folder():
    """A fresh folder that goes when the tests end."""
    folder = tempfile.mkdtemp(prefix="lightprobe-e2e-", dir=os.environ.get("LP_E2E_TEMP"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return pathlib.Path(folder)


def wait_until(condition, what, limit_s=LIMIT_S):
    """Polls until condition() is true and returns its value; fails with `what` otherwise."""
    deadline = time.monotonic() + limit_s
    while True:
        value = condition()
        if value:
            return value
        if time.monotonic() > deadline:
            raise AssertionError("waited %d s in vain: %s" % (limit_s, what))
        time.sleep(0.005)


# ---- the command line ----------------------------------------------------------------------------

Run = collections.namedtuple("Run", "code out err")


def cli(*args, build=None, timeout_s=600, stdin=None, cwd=None):
    """Runs lightprobe; a sanitizer's report is a failure whatever the exit status."""
    done = subprocess.run([str((build or BUILD) / "lightprobe"), *map(str, args)],
                          capture_output=True, timeout=timeout_s, env=ENVIRONMENT, input=stdin,
                          cwd=cwd)
    assert not REPORTS.search(done.stderr), done.stderr.decode(errors="replace")
    assert done.returncode >= 0, "lightprobe %s died of signal %d" % (args, -done.returncode)
    return Run(done.returncode, done.stdout.decode(errors="replace"),
               done.stderr.decode(errors="replace"))


def cli_ok(*args, **options):
    """The same for what must work."""
    done = cli(*args, **options)
    assert done.code == 0, "lightprobe %s: exit %d, %s" % (" ".join(map(str, args)), done.code,
                                                           done.err.strip())
    return done


# ---- scenes --------------------------------------------------------------------------------------

@functools.cache
def room_walls():
    """{face: (r, g, b)}: the room's sRGB colours by the direction one looks in, out of the engine's
    source, so that there is one table and not two."""
    for path in sorted((ROOT / "engine").glob("*.c")):
        found = re.search(r"lp_room_walls_srgb\[6\]\[3\]\s*=\s*\{(.*?)\};", path.read_text(), re.S)
        if found:
            text = re.sub(r"/\*.*?\*/|//[^\n]*", "", found.group(1), flags=re.S)
            numbers = [int(n, 0) for n in re.findall(r"0x[0-9a-fA-F]+|\d+", text)]
            assert len(numbers) == 18, numbers
            return {face: tuple(numbers[3 * i : 3 * i + 3]) for i, face in enumerate(cube.FACES)}
    raise AssertionError("no lp_room_walls_srgb in engine/*.c")


def hills_maps(folder):
    """A small synthetic terrain: 16-bit heights and 8-bit colours as PNG files."""
    n = 64
    heights, colours = [], []
    for row in range(n):
        line, paint = [], []
        for column in range(n):
            x, z = column / n, row / n
            h = 0.35 + 0.25 * math.sin(7 * x) * math.cos(5 * z) + 0.15 * math.sin(23 * x + 17 * z)
            line.append(max(0, min(65535, int(65535 * h))))
            paint += [int(255 * x), int(255 * z), 255 if (row // 4 + column // 4) % 2 else 60]
        heights.append(line)
        colours.append(paint)
    (folder / "hills.png").write_bytes(picture.png_write(n, n, heights, bits=16))
    (folder / "hills-colours.png").write_bytes(picture.png_write(n, n, colours, channels=3))


@functools.cache
def scenes():
    """A folder with room.lps, sphere.lps and hills.lps, built once a run by the real program."""
    shared = os.environ.get("LP_E2E_TEMP")
    folder = pathlib.Path(shared) / "scenes" if shared else temporary_folder()
    if not (folder / "complete").exists():
        folder.mkdir(exist_ok=True)
        cli_ok("build", "procedural:room", "--depth", 7, "--size-m", 8, "-o", folder / "room.lps")
        cli_ok("build", "procedural:sphere", "--depth", 8, "--size-m", 8, "-o", folder / "sphere.lps")
        hills_maps(folder)
        cli_ok("build", folder / "hills.png", "--color", folder / "hills-colours.png", "--size-m",
               64, "--height-m", 20, "--depth", 8, "-o", folder / "hills.lps")
        (folder / "complete").touch()
    return folder


def data_folder(*names):
    """A daemon's folder with copies of these scenes."""
    folder = temporary_folder()
    (folder / "scenes").mkdir()
    for name in names:
        shutil.copy(scenes() / (name + ".lps"), folder / "scenes" / (name + ".lps"))
    return folder


def room_box(info):
    """The inner faces of the room's walls in metres: (low, high)."""
    low, high = bounds(info)
    v = info["voxel_size_m"]
    return tuple(c + v for c in low), tuple(c - v for c in high)


def bounds(info):
    """bounds_m of a scene document: (low, high)."""
    b = info["bounds_m"]
    return (tuple(b["min"]), tuple(b["max"])) if isinstance(b, dict) else tuple(map(tuple, b))


# ---- the daemon ----------------------------------------------------------------------------------

class Answer:
    """Status, headers (any case) and body of a response."""

    def __init__(self, status, headers, body):
        self.status, self.headers, self.body = status, headers, body

    def json(self):
        def once(pairs):
            keys = [k for k, _ in pairs]
            assert len(set(keys)) == len(keys), "a key stands twice in the answer: %s" % keys
            return dict(pairs)

        def refuse(word):
            raise AssertionError("the answer holds %s, which is not JSON" % word)

        return json.loads(self.body, object_pairs_hook=once, parse_constant=refuse)


class Daemon:
    """One lightprobed on a free port of loopback, over a data folder."""

    def __init__(self, folder, workers=2, args=(), build=None, listen="127.0.0.1:0"):
        self.folder = pathlib.Path(folder)
        self.errors = tempfile.TemporaryFile()
        self.out = []
        self.process = subprocess.Popen(
            [str((build or BUILD) / "lightprobed"), "--listen", listen, "--data", str(folder),
             "--workers", str(workers), *map(str, args)],
            stdout=subprocess.PIPE, stderr=self.errors, env=ENVIRONMENT)
        self._lines = threading.Condition()
        self._closed = False
        threading.Thread(target=self._read, daemon=True).start()
        atexit.register(self.kill)
        self.host, self.port, self.url = None, None, None
        self.statuses = collections.Counter()  # of every answer that came

    def _read(self):
        for line in self.process.stdout:
            with self._lines:
                self.out.append(line.decode())
                self._lines.notify_all()
        with self._lines:
            self._closed = True
            self._lines.notify_all()

    def ready(self):
        """Waits for the ready line; returns self."""
        with self._lines:
            self._lines.wait_for(lambda: self.out or self._closed, LIMIT_S)
            if not self.out:
                self.kill()
                raise AssertionError("no ready line; standard error: " + self.stderr())
        found = re.fullmatch(r"ready (http://([^:]+):(\d+))\n", self.out[0])
        assert found, "the first line is %r" % self.out[0]
        self.url, self.host, self.port = found.group(1), found.group(2), int(found.group(3))
        return self

    def stderr(self):
        self.errors.seek(0)
        return self.errors.read().decode(errors="replace")

    def signal(self, number=signal.SIGTERM):
        self.process.send_signal(number)

    def wait(self, limit_s=LIMIT_S):
        """Waits for the end and returns the exit status; sanitizer reports are failures."""
        try:
            status = self.process.wait(limit_s)
        except subprocess.TimeoutExpired:
            self.kill()
            raise AssertionError("the daemon did not end in %d s; %s" % (limit_s, self.stderr()))
        with self._lines:
            self._lines.wait_for(lambda: self._closed, LIMIT_S)
        assert not REPORTS.search(self.stderr().encode()), self.stderr()
        return status

    def stop(self):
        """SIGTERM; the exit status must be 0 and standard output one line."""
        self.signal()
        status = self.wait()
        assert status == 0, "exit %d; %s" % (status, self.stderr())
        assert len(self.out) == 1, "standard output: %r" % self.out
        assert 500 not in self.statuses, "a request got 500; %s" % self.stderr()

    def kill(self):
        if self.process.poll() is None:
            self.process.kill()
            self.process.wait()

    def request(self, method, path, body=None, headers=None, timeout_s=LIMIT_S):
        """One request on a connection of its own."""
        connection = http.client.HTTPConnection(self.host, self.port, timeout=timeout_s)
        try:
            if isinstance(body, (dict, list)):
                body = json.dumps(body)
            if isinstance(body, str):
                body = body.encode()
            connection.request(method, path, body, headers or {})
            response = connection.getresponse()
            self.statuses[response.status] += 1
            return Answer(response.status, response.headers, response.read())
        finally:
            connection.close()

    def get(self, path, headers=None):
        return self.request("GET", path, headers=headers)

    def render(self, job, headers=None, timeout_s=10 * LIMIT_S):
        """POST /v1/render that must work: the document."""
        answer = self.request("POST", "/v1/render", job, headers, timeout_s)
        assert answer.status == 200, "%d %s" % (answer.status, answer.body[:2000])
        return answer.json()

    def render_png(self, job):
        answer = self.request("POST", "/v1/render", job, {"Accept": "image/png"}, 10 * LIMIT_S)
        assert answer.status == 200, "%d %s" % (answer.status, answer.body[:2000])
        return picture.png_read(answer.body)

    def render_exr(self, job):
        answer = self.request("POST", "/v1/render", job, {"Accept": "image/x-exr"}, 10 * LIMIT_S)
        assert answer.status == 200, "%d %s" % (answer.status, answer.body[:2000])
        return picture.exr_read(answer.body)[0]

    def scene(self, name):
        """The document of a scene, once it is ready."""
        def look():
            answer = self.get("/v1/scenes/" + name)
            if answer.status != 200:
                return None
            document = answer.json()
            assert document["state"] != "failed", document
            return document if document["state"] == "ready" else None

        return wait_until(look, "scene %s ready" % name)

    def connect(self):
        """A raw connection; close it with `with`."""
        return socket.create_connection((self.host, self.port), timeout=LIMIT_S)

    def raw(self, data, half_close=False):
        """Sends bytes as they are and returns the first response as an Answer (None: none came).
        `{host}` in the bytes becomes this daemon's address."""
        data = data.replace(b"{host}", b"%s:%d" % (self.host.encode(), self.port))
        with self.connect() as connection:
            try:
                connection.sendall(data)
                if half_close:
                    connection.shutdown(socket.SHUT_WR)
            except OSError:
                pass  # refused while still sending: the answer counts
            answer = read_response(connection)
            self.statuses[answer.status if answer else None] += 1
            return answer


def read_response(connection, method="GET"):
    """One response from a raw connection; None where the peer closed without one."""
    response = http.client.HTTPResponse(connection, method=method)
    try:
        response.begin()
        return Answer(response.status, response.headers, response.read())
    except (http.client.BadStatusLine, ConnectionError):
        return None
    finally:
        response.close()

