"""A daemon under test: its process, requests over its socket, its events.  Used by the tests beside it."""
import concurrent.futures
import fcntl
import glob
import hashlib
import http.client
import json
import os
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import time
import traceback
import zlib

BIN = os.environ["WEFT_TEST_BIN"]
SOURCE = os.environ["WEFT_TEST_SOURCE"]
SLOW = 5 if "sanitize" in BIN else 1  # sanitizers take their time


class UnixConnection(http.client.HTTPConnection):
    def __init__(self, path, timeout=30):
        super().__init__("localhost", timeout=timeout)
        self.path = path

    def connect(self):
        self.sock = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self.sock.settimeout(self.timeout)
        self.sock.connect(self.path)


class Reply:
    def __init__(self, response):
        self.status, self.headers, self.bytes = response.status, response.headers, response.read()

    @property
    def json(self):
        return json.loads(self.bytes)


class Weftd:
    """`with Weftd(folder) as d`: runs until the block ends; d.kill() and d.start() in between."""

    def __init__(self, folder, *options, env=None):
        self.folder, self.options, self.process = folder, options, None
        self.library, self.socket = os.path.join(folder, "library"), os.path.join(folder, "weftd.sock")
        self.log = os.path.join(folder, "weftd.log")
        self.env = dict(os.environ, **(env or {}))
        self.env.pop("OPENBLAS_NUM_THREADS", None)  # with the threads that libraries have when nobody forbids them
        os.makedirs(self.library, exist_ok=True)

    def start(self):
        with open(self.log, "ab") as log:
            self.process = subprocess.Popen(
                [f"{BIN}/weftd", "--library", self.library, "--socket", self.socket, "--verbose", *self.options],
                stderr=log, stdout=log, env=self.env)
        deadline = time.monotonic() + 20 * SLOW
        while time.monotonic() < deadline:
            try:
                self.get("/v1")
                return self
            except OSError:
                if self.process.poll() is not None:
                    raise AssertionError(f"weftd ended with {self.process.returncode}: {self.words()}")
                time.sleep(0.02)
        raise AssertionError("weftd does not answer")

    __enter__ = start

    def __exit__(self, failed, *_):
        running = self.process.poll() is None
        status = self.stop()
        assert failed or not running or status == 0, f"weftd ends with {status}: {self.words()[-2000:]}"

    def words(self):
        with open(self.log, encoding="utf-8") as log:
            return log.read()

    def kill(self):
        self.process.kill()
        return self.process.wait()

    def stop(self):
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
        return self.process.wait(timeout=30 * SLOW)

    def request(self, method, path, body=None, headers=None, timeout=30):
        connection = UnixConnection(self.socket, timeout)
        sent = dict(headers or {})
        if isinstance(body, (dict, list)):
            body = json.dumps(body)
            sent.setdefault("Content-Type", "application/json")
        try:
            connection.request(method, path, body, sent)
            return Reply(connection.getresponse())
        finally:
            connection.close()

    def get(self, path, **more):
        return self.request("GET", path, **more)

    def post(self, path, body=None, **more):
        return self.request("POST", path, body, **more)

    def add(self, command, *operands, after=(), **options):
        reply = self.post("/v1/jobs", {"command": command, "operands": list(operands), "after": list(after),
                                       "options": {k.replace("_", "-"): v for k, v in options.items()}})
        assert reply.status == 201, reply.bytes
        return reply.json["id"]

    def job(self, number):
        reply = self.get(f"/v1/jobs/{number}")
        assert reply.status == 200, reply.bytes
        return reply.json

    def wait(self, number, *states, timeout=60):
        states = states or ("done", "failed", "cancelled")
        deadline = time.monotonic() + timeout * SLOW
        while time.monotonic() < deadline:
            job = self.job(number)
            if job["state"] in states:
                return job
            time.sleep(0.02)
        raise AssertionError(f"job {number} is {job} after {timeout * SLOW} s, wanted {states}")

    def run(self, command, *operands, **options):
        return self.wait(self.add(command, *operands, **options))


class Watcher:
    """Server-Sent Events, one after the other, as (id, type, data)."""

    def __init__(self, daemon, query="", last=None, timeout=30):
        self.sock = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self.sock.settimeout(timeout)
        self.sock.connect(daemon.socket)
        extra = f"Last-Event-ID: {last}\r\n" if last else ""
        self.sock.sendall(f"GET /v1/events{query} HTTP/1.0\r\nHost: localhost\r\n{extra}\r\n".encode())
        self.file = self.sock.makefile("rb")
        self.status = int(self.file.readline().split()[1])
        while self.file.readline().strip():
            pass

    def __iter__(self):
        event = {}
        for line in self.file:
            line = line.decode().rstrip("\r\n")
            if not line and event:
                yield event.get("id"), event.get("event"), json.loads(event.get("data", "null"))
                event = {}
            elif line and not line.startswith(":"):
                key, _, value = line.partition(": ")
                event[key] = value

    def until(self, test):
        seen = []
        for event in self:
            seen.append(event)
            if test(*event):
                return seen
        raise AssertionError(f"the events ended after {seen[-3:]}")

    def close(self):
        self.file.close()
        self.sock.close()


def scratch():
    """A folder that goes away with the test; short, because sockets have short paths."""
    folder = tempfile.TemporaryDirectory(prefix="weftd-")
    return folder


def make_flat(folder, width=32, height=24, noise=False):
    """A flat matte plate under five lights as 16-bit PNGs with a light-position file: what `weft import` reads."""
    lights = [(0, 0, 1), (0.6, 0, 0.8), (-0.6, 0, 0.8), (0, 0.6, 0.8), (0, -0.6, 0.8)]

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    os.makedirs(folder)
    with open(f"{folder}/flat.lp", "w", encoding="utf-8") as lp:
        print(len(lights), file=lp)
        for i, (x, y, z) in enumerate(lights):
            rows = (b"\0" + struct.pack(">H", round(65535 * 0.5 * z)) * width) * height
            if noise:
                high = bytes([round(65535 * 0.5 * z) >> 8])  # the low byte is noise
                rows = b"".join(b"\0" + b"".join(high + bytes([v]) for v in os.urandom(width)) for _ in range(height))
            with open(f"{folder}/p{i}.png", "wb") as png:
                png.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 16, 0, 0, 0, 0))
                          + chunk(b"IDAT", zlib.compress(rows, 1)) + chunk(b"IEND", b""))
            print(f"p{i}.png {x} {y} {z}", file=lp)


def children(pid):
    """Processes below a process."""
    found = []
    for name in os.listdir("/proc"):
        if not name.isdigit():
            continue
        try:
            with open(f"/proc/{name}/stat", encoding="utf-8") as stat:
                fields = stat.read().rpartition(")")[2].split()
        except OSError:
            continue
        if int(fields[1]) == pid and fields[0] != "Z":
            found.append(int(name))
            found += children(int(name))
    return found


def signal_all(pids, number):
    for pid in pids:
        try:
            os.kill(pid, number)
        except ProcessLookupError:
            pass


def wait_until_stopped(pids):
    """Until SIGSTOP has reached every thread of the processes, or they have ended: a signal that came before would else
    be taken before it."""
    for pid in pids:
        while True:
            states = []
            for task in glob.glob(f"/proc/{pid}/task/*/stat"):
                try:
                    with open(task, encoding="utf-8") as stat:
                        states.append(stat.read().rpartition(")")[2].split()[0])
                except OSError:
                    pass
            if all(state in "TZX" for state in states):
                break
            time.sleep(0.001)


def stop_at_work(daemon, add):
    """Adds jobs by add(0), add(1), ... until the process of one is stopped (SIGSTOP) in the middle of its work: it has
    told progress and not all of it.  It runs in small steps, so that no load of the machine lets it slip through.
    The number of the job, and the processes, which go on with SIGCONT."""
    for i in range(8):
        job = add(i)
        while (now := daemon.job(job))["state"] in ("queued", "running"):
            pids = children(daemon.process.pid) if now["state"] == "running" else []
            signal_all(pids, signal.SIGCONT)
            time.sleep(0.002)
            signal_all(pids, signal.SIGSTOP)
            wait_until_stopped(pids)
            progress = daemon.job(job)["progress"]
            if pids and progress and progress["done"] < progress["total"] and all(alive(p) for p in pids):
                return job, pids
    raise AssertionError("every job ends before it can be stopped")


def wait_for_signal(pids, number):
    """Until the signal waits for each of the stopped processes."""
    deadline = time.monotonic() + 30 * SLOW
    for pid in pids:
        while True:
            with open(f"/proc/{pid}/status", encoding="utf-8") as status:
                pending = [int(line.split()[1], 16) for line in status if line.startswith(("SigPnd", "ShdPnd"))]
            if any(mask >> (number - 1) & 1 for mask in pending):
                break
            assert time.monotonic() < deadline, f"process {pid} never gets signal {number}"
            time.sleep(0.002)


def alive(pid):
    try:
        with open(f"/proc/{pid}/stat", encoding="utf-8") as stat:
            return stat.read().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def wait_until_gone(pids):
    """No process outlives its daemon: the kernel ends them together."""
    deadline = time.monotonic() + 10 * SLOW
    while any(alive(p) for p in pids):
        assert time.monotonic() < deadline, "a process outlives its daemon"
        time.sleep(0.01)


def run_one(name, test):
    begin = time.monotonic()
    try:
        test()
        print(f"ok    {name} ({time.monotonic() - begin:.1f} s)", flush=True)
        return True
    except Exception:  # every test is run
        print(f"{traceback.format_exc()}FAIL  {name}", flush=True)
        return False


def run_tests(namespace, at_a_time=1):
    """Runs every function test_* of a module, or those named on the command line, each with a daemon of its own;
    several at a time, because many of them wait."""
    tests = [(name, test) for name, test in namespace.items()
             if name.startswith("test_") and (not sys.argv[1:] or name in sys.argv[1:])]
    with concurrent.futures.ThreadPoolExecutor(at_a_time) as pool:
        good = list(pool.map(lambda test: run_one(*test), tests))
    sys.exit(not all(good))


class Rig:
    """The virtual scanner; one at a time on a machine (it needs UDP port 3956 of 127.0.0.1).  For a run of hours beside
    other tests: WEFT_RIG_LOCK=FILE, inside `unshare -n` after `ip link set lo up`."""

    def __init__(self, folder, sample="twill", size="616x408", **more):
        self.folder, self.words = os.path.join(folder, "rig"), ["--sample", sample, "--size", size]
        for key, value in more.items():
            self.words += [f"--{key.replace('_', '-')}", str(value)]

    def __enter__(self):
        if not os.path.exists(f"{BIN}/weft-rig"):
            print("skipped: this build has no weft-rig")
            sys.exit(77)
        self.lock = open(os.environ.get("WEFT_RIG_LOCK", "/tmp/weft-rig.lock"), "a", encoding="utf-8")
        fcntl.flock(self.lock, fcntl.LOCK_EX)
        self.process = subprocess.Popen([f"{BIN}/weft-rig", "--quiet", "--dir", self.folder, *self.words],
                                        stdout=subprocess.PIPE)
        line = self.process.stdout.readline()
        assert line, "weft-rig does not start"
        self.ready = json.loads(line)
        return self

    def __exit__(self, *_):
        self.process.send_signal(signal.SIGTERM)
        self.process.wait(30)
        self.process.stdout.close()
        self.lock.close()

    def tell(self, line):
        told = subprocess.run([f"{BIN}/weft", "rig", "--dir", self.folder, "--tell", line], capture_output=True,
                              text=True, check=True)
        return json.loads(told.stdout)

    def wait_dark(self, within_s=10):
        """Seconds of waiting until all lamps are dark: the lease is 0.8 s, and a busy machine may take its time to ask."""
        begin = time.monotonic()
        while self.tell("state")["lights_on"]:
            assert time.monotonic() - begin < within_s, f"lamps are on after {within_s} s: {self.tell('state')}"
            time.sleep(0.01)
        return time.monotonic() - begin


def check_set(folder, state="complete", at_least=11):
    """Every frame that set.json lists is there with its hash; nothing else is, but one that was just written."""
    with open(f"{folder}/set.json", encoding="utf-8") as text:
        found = json.load(text)
    assert found["state"] == state and len(found["frames"]) >= at_least, (found["state"], len(found["frames"]))
    for frame in found["frames"]:
        with open(f"{folder}/{frame['file']}", "rb") as dng:
            assert hashlib.sha256(dng.read()).hexdigest() == frame["sha256"], frame["file"]
    names = {name for name in os.listdir(folder) if not name.startswith(".weft-")}
    extra = names - {frame["file"] for frame in found["frames"]} - {"set.json"}
    assert len(extra) <= (state != "complete"), extra
    return found
