"""weftd with the virtual scanner: captures as jobs, weft through the daemon, the live view, kill -9 of the daemon.

WEFT_KILLS is how many times the daemon is killed (default 2)."""
import json
import os
import random
import select
import signal
import socket
import subprocess
import time

from weftd import BIN, SLOW, Rig, Watcher, Weftd, alive, check_set, children, run_tests, scratch, wait_until_gone

KILLS = int(os.environ.get("WEFT_KILLS", "2"))


def frames_of(folder):
    try:
        with open(f"{folder}/set.json", encoding="utf-8") as text:
            return len(json.load(text)["frames"])
    except (OSError, ValueError):
        return 0


def wait_for_frames(folder, n):
    deadline = time.monotonic() + 30 * SLOW
    while frames_of(folder) < n:
        assert time.monotonic() < deadline, f"{folder} never has {n} frames"
        time.sleep(0.01)


def weft(d, *words, **more):
    return subprocess.run([f"{BIN}/weft", *words], capture_output=True, text=True, check=False,
                          env=dict(os.environ, WEFT_SOCKET=d.socket), **more)


def test_capture_cancel_resume(d, rig):
    job = d.add("capture", "cancel.set", exposure=0.15)
    wait_for_frames(f"{d.library}/cancel.set", 3)
    assert d.post(f"/v1/jobs/{job}/cancel").status == 202
    rig.wait_dark()
    ended = d.wait(job)
    assert ended["state"] == "cancelled" and "frames are kept" in ended["error"], ended
    kept = len(check_set(f"{d.library}/cancel.set", "capturing", 3)["frames"])
    assert d.post(f"/v1/jobs/{job}/resume").status == 202
    ended = d.wait(job)
    assert ended["state"] == "done" and ended["result"]["kept"] >= kept, ended
    check_set(f"{d.library}/cancel.set")


def test_one_owner_of_the_scanner(d, rig):
    """Three captures at once run one after the other, and a job without the scanner beside them."""
    watcher = Watcher(d)
    ids = [d.add("capture", f"line{i}.set", exposure=0.02) for i in range(3)]
    other = d.add("compare", "line0.set", "line0.set")
    running, most = set(), 0
    for _, kind, data in watcher:
        if kind != "job.state" or data["id"] not in ids:
            continue
        (running.add if data["state"] == "running" else running.discard)(data["id"])
        most = max(most, len(running))
        if data["id"] == ids[-1] and data["state"] not in ("queued", "running"):
            break
    assert most == 1, most
    assert [d.job(i)["state"] for i in ids] == ["done"] * 3
    assert d.wait(other)["state"] == "failed"  # a set is nothing to compare; it was tried beside them


def test_weft_goes_through_the_daemon(d, rig):
    """The same words, figures and exit statuses as without the daemon."""
    direct = dict(os.environ, WEFT_SOCKET="none")
    here = subprocess.run([f"{BIN}/weft", "capture", "x.set", "--rig", rig.folder, "--exposure", "0.02", "-q"],
                          capture_output=True, text=True, check=False, env=direct, cwd=d.folder)
    there = weft(d, "capture", "y.set", "--rig", rig.folder, "--exposure", "0.02", "-q", cwd=d.folder)
    assert here.returncode == there.returncode == 0, (here, there)

    def timeless(text):
        return text.rsplit(" in ", 1)[0].replace(f"{d.folder}/", "").replace("y.set", "x.set")
    assert timeless(here.stdout) == timeless(there.stdout) and there.stderr == here.stderr, (here, there)
    check_set(f"{d.folder}/y.set")
    again = weft(d, "capture", "y.set", "--exposure", "0.02", cwd=d.folder)
    assert again.returncode == 1 and "complete set; give another name, or --force" in again.stderr, again
    assert weft(d, "capture").returncode == 2
    status = weft(d, "light", "status", "--json")
    assert status.returncode == 0 and json.loads(status.stdout)["n_lights"] == 10, status
    devices = weft(d, "devices", "--json")
    assert json.loads(devices.stdout)["cameras"][0]["model"] == "Virtual scanner", devices
    absent = subprocess.run([f"{BIN}/weft", "light", "off"], capture_output=True, text=True, check=False,
                            env=dict(os.environ, WEFT_SOCKET=f"{d.folder}/none.sock"))
    assert absent.returncode == 1 and "WEFT_SOCKET=none" in absent.stderr, absent


def begin(d, *words):
    return subprocess.Popen([f"{BIN}/weft", *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                            env=dict(os.environ, WEFT_SOCKET=d.socket))


def test_ctrl_c_cancels_the_job(d, rig):
    client = begin(d, "capture", f"{d.library}/int.set", "--exposure", "0.15")
    wait_for_frames(f"{d.library}/int.set", 2)
    client.send_signal(signal.SIGINT)
    rig.wait_dark()
    _, words = client.communicate(timeout=30)
    assert client.returncode == 130 and "--resume goes on" in words, (client.returncode, words)
    resumed = weft(d, "capture", f"{d.library}/int.set", "--resume", "--json")
    assert resumed.returncode == 0 and json.loads(resumed.stdout)["kept"] >= 2, resumed
    check_set(f"{d.library}/int.set")


def wait_lit(rig):
    deadline = time.monotonic() + 10 * SLOW
    while not rig.tell("state")["lights_on"]:
        assert time.monotonic() < deadline, "no light comes on"
        time.sleep(0.01)


def test_light_lasts_as_long_as_its_holder(d, rig):
    """weft light on, killed: the daemon notices and the lamp goes off."""
    for number, status in ((signal.SIGINT, 0), (signal.SIGKILL, -9)):
        client = begin(d, "light", "on", "3")
        wait_lit(rig)
        assert rig.tell("state")["lights_on"] == [3]
        client.send_signal(number)
        rig.wait_dark()
        client.communicate(timeout=30)
        if number == signal.SIGKILL:
            assert client.returncode == status
    job = d.post("/v1/jobs", {"command": "light on", "operands": ["3"], "hold": True}).json
    assert job["state"] == "queued"
    assert d.wait(job["id"])["state"] == "cancelled", "nobody holds it"


def test_live_view(d, rig):
    assert d.get("/v1/live").status in (200, 404)
    assert d.run("live", lights="all", exposure=0.04, seconds=0.5)["result"]["clipped"][1] > 0.9  # ten lamps at once
    sock = Watcher(d)  # any watcher: pictures are announced as events too
    job = d.add("live", lights="all", rate=5, exposure=0.006)
    seen = [next(data for _, kind, data in sock if kind == "live") for _ in range(3)]
    assert d.post(f"/v1/jobs/{job}/cancel").status == 202
    assert d.wait(job)["state"] == "done", "the end of a live view is no failure"
    assert [picture["job"] for picture in seen] == [job] * 3, seen
    info = d.get("/v1/live").json
    assert info["frame"] == [616, 408] and info["width"] == 308 and info["job"] == job, info
    total = 616 * 408
    counts = {colour: sum(bins) for colour, bins in info["histogram"].items()}
    assert counts == {"red": total // 4, "green": total // 2, "blue": total // 4}, counts
    assert all(0.005 < mean < 1 for mean in info["mean"]), info["mean"]
    assert info["histogram"]["green"][-1] >= info["clipped"][1] * counts["green"] - 1
    picture = d.get("/v1/live.jpg")
    assert picture.status == 200 and picture.headers["Content-Type"] == "image/jpeg"
    assert picture.bytes[:3] == b"\xff\xd8\xff" and picture.bytes[-2:] == b"\xff\xd9"
    assert d.job(job)["result"]["frames"] >= 3


def pictures_of(stream):
    """The numbers of the whole pictures in what a watcher has received."""
    assert b"multipart/x-mixed-replace; boundary=weft-frame" in stream
    numbers = []
    for part in stream.split(b"--weft-frame\r\n")[1:]:
        head, _, body = part.partition(b"\r\n\r\n")
        fields = dict(line.split(b": ") for line in head.split(b"\r\n") if b": " in line)
        size = int(fields.get(b"Content-Length", 1 << 30))
        if len(body) >= size:
            assert body[:3] == b"\xff\xd8\xff" and body[size - 2:size] == b"\xff\xd9"
            numbers.append(int(fields[b"Weft-Picture"]))
    return numbers


def test_live_stream(d, rig):
    """Two watchers get whole pictures, each newer than the last, at most as often as asked for."""
    begin_s = time.monotonic()
    rates, watchers, received = (5, 1), [], [b"", b""]
    for rate in rates:
        s = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        s.connect(d.socket)
        s.sendall(f"GET /v1/live.mjpg?rate={rate} HTTP/1.0\r\nHost: localhost\r\n\r\n".encode())
        watchers.append(s)
    job = d.add("live", rate=5)
    while received[1].count(b"--weft-frame") < 4:  # three pictures of the slow one are whole
        ready, _, _ = select.select(watchers, [], [], 60 * SLOW)
        assert ready, "no pictures come"
        for s in ready:
            chunk = s.recv(1 << 20)
            assert chunk, "a watcher is hung up on"
            received[watchers.index(s)] += chunk
    took_s = time.monotonic() - begin_s
    assert d.post(f"/v1/jobs/{job}/cancel").status == 202
    numbers = [pictures_of(stream) for stream in received]
    for s in watchers:
        s.close()
    assert all(n == sorted(set(n)) for n in numbers), numbers
    assert all(len(n) <= rate * took_s + 1 for n, rate in zip(numbers, rates)), (numbers, took_s)
    assert len(numbers[0]) >= len(numbers[1]) >= 3, numbers
    d.wait(job)


def second_attempt(d, job, folder):
    """What each row of the fault matrix ends with: whole files, and a job that completes when it is resumed."""
    if frames_of(folder):
        check_set(folder, "capturing", 1)
    assert d.post(f"/v1/jobs/{job}/resume").status == 202
    ended = d.wait(job)
    assert ended["state"] == "done", ended
    check_set(folder)


def test_host_sigterm(d, rig):
    """SIGTERM of weftd in mid capture: dark at once, the job is kept and goes on."""
    job = d.add("capture", "term.set", exposure=0.15)
    wait_for_frames(f"{d.library}/term.set", 3)
    before = children(d.process.pid)
    d.process.send_signal(signal.SIGTERM)
    rig.wait_dark()
    assert d.process.wait(30 * SLOW) == 0 and not any(alive(p) for p in before)
    check_set(f"{d.library}/term.set", "capturing", 3)
    d.start()
    ended = d.wait(job)
    assert ended["state"] == "done" and ended["attempt"] == 2 and ended["result"]["kept"] >= 3, ended
    check_set(f"{d.library}/term.set")


def test_host_disk_full(d, rig):
    folder = f"{d.library}/small"
    os.makedirs(folder)
    if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=12m", "none", folder], capture_output=True, check=False).returncode:
        print("skipped: no tmpfs may be mounted here")
        return
    try:
        job = d.add("capture", "small/full.set", exposure=0.15)
        wait_for_frames(f"{folder}/full.set", 2)
        with open(f"{folder}/filler", "wb") as filler:
            try:
                while True:
                    filler.write(b"x" * 65536)
                    filler.flush()
            except OSError:
                pass
        ended = d.wait(job)
        assert ended["state"] == "failed" and ("No space" in ended["error"] or "disk full" in ended["error"]), ended
        rig.wait_dark()
        os.remove(f"{folder}/filler")
        second_attempt(d, job, f"{folder}/full.set")
    finally:
        subprocess.run(["umount", folder], check=False)


def test_host_read_only_folder(d, rig):
    folder = f"{d.library}/closed"
    os.makedirs(folder)
    if subprocess.run(["mount", "--bind", folder, folder], capture_output=True, check=False).returncode:
        print("skipped: nothing may be mounted here")
        return
    try:
        subprocess.run(["mount", "-o", "remount,bind,ro", folder], check=True)
        job = d.add("capture", "closed/x.set", exposure=0.02)
        ended = d.wait(job)
        assert ended["state"] == "failed" and "closed/x.set" in ended["error"], ended
        rig.wait_dark()
        subprocess.run(["mount", "-o", "remount,bind,rw", folder], check=True)
        second_attempt(d, job, f"{folder}/x.set")
    finally:
        subprocess.run(["umount", folder], check=False)


def test_host_clock_step(d, rig):
    """The clock jumps back a day and forward a year in mid capture: nothing waits longer or shorter for it."""
    shim = f"{os.path.dirname(BIN)}/tests/libclock_step.so"
    if "sanitize" in BIN:
        print("skipped: the sanitizers want to be loaded first")
        return
    step = f"{d.folder}/clock"

    def jump(seconds):
        with open(step + ".new", "w", encoding="utf-8") as file:
            file.write(str(seconds))
        os.rename(step + ".new", step)
    d.stop()
    jump(0)
    d.env.update(LD_PRELOAD=shim, WEFT_TEST_CLOCK=step)
    try:
        d.start()
        begin_s = time.monotonic()
        job = d.add("capture", "clock.set", exposure=0.15)
        wait_for_frames(f"{d.library}/clock.set", 2)
        jump(-86400)
        wait_for_frames(f"{d.library}/clock.set", 5)
        jump(365 * 86400)
        ended = d.wait(job)
        assert ended["state"] == "done" and ended["attempt"] == 1, ended
        assert time.monotonic() - begin_s < 50 * SLOW
        years = {frame["capture"]["taken"][:4] for frame in check_set(f"{d.library}/clock.set")["frames"]}
        assert len(years) == 2, f"the clock did not step: {years}"
        assert d.run("light status")["state"] == "done"
    finally:
        d.stop()
        d.env.pop("LD_PRELOAD")
        d.start()


def test_host_sigkill(d, rig):
    """kill -9 at random moments of a capture: dark within the lease, no process left, and the next daemon
    completes the set."""
    seed = int(os.environ.get("WEFT_SEED", random.randrange(1 << 30)))
    chance = random.Random(seed)
    attempts, waits = [], []
    for i in range(KILLS):
        folder = f"{d.library}/kill{i}.set"
        job = d.add("capture", f"kill{i}.set", exposure=0.1)
        time.sleep(chance.uniform(0, 2.5))
        before = children(d.process.pid)
        d.kill()
        waits.append(rig.wait_dark())
        wait_until_gone(before)
        if frames_of(folder):
            check_set(folder, json.load(open(f"{folder}/set.json", encoding="utf-8"))["state"], 1)
        d.start()
        ended = d.wait(job)
        assert ended["state"] == "done", f"seed {seed}, kill {i}: {ended}"
        found = check_set(folder)
        assert [f["light"] for f in found["frames"] if f["role"] == "light"] == list(range(10)), found
        assert not [name for name in os.listdir(folder) if name.startswith(".weft-")]
        attempts.append(ended["attempt"])
    again = sum(a > 1 for a in attempts)
    print(f"      {KILLS} kills of weftd, seed {seed}: {again} in mid job, all completed; "
          f"dark after {max(waits):.2f} s at most")


def test_all():
    tests = [test for name, test in globals().items() if name.startswith("test_") and name != "test_all"]
    wanted = os.environ.get("WEFT_ONLY")
    with scratch() as folder, Rig(folder) as rig, Weftd(folder, "--rig", rig.folder) as d:
        for test in tests:
            if wanted and wanted != test.__name__:
                continue
            begin_s = time.monotonic()
            test(d, rig)
            print(f"ok    {test.__name__} ({time.monotonic() - begin_s:.1f} s)", flush=True)
        assert not children(d.process.pid)


if __name__ == "__main__":
    run_tests({"test_all": test_all})
