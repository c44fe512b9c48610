"""Captures in a row through weftd on a bad day: lost packets, a damaged serial line, and the camera's process killed
at random moments.  Every set must be complete or resumable and lit by the right lamps, and nothing may pile up.

WEFT_CAPTURES is how many (default 2); WEFT_SEED repeats a day."""
import collections
import json
import os
import random
import signal
import threading
import time

from weftd import SLOW, Rig, Weftd, check_set, children, run_tests, scratch

CAPTURES = int(os.environ.get("WEFT_CAPTURES", "2"))
SEED = int(os.environ.get("WEFT_SEED", random.randrange(1 << 30)))
PACKET_LOSS = float(os.environ.get("WEFT_PACKET_LOSS", "1e-4"))
SERIAL_DAMAGE = float(os.environ.get("WEFT_SERIAL_DAMAGE", "0.01"))  # of the bytes, each way
EXPOSURE_S = 0.04


def name_of(pid):
    try:
        with open(f"/proc/{pid}/cmdline", "rb") as line:
            return line.read().split(b"\0")[0].decode()
    except OSError:
        return ""


def figures(d):
    """Processes below the daemon, its descriptors, shared memory and sealed files on the machine; its memory,
    with the pages of programs and libraries that the kernel lent it and without."""
    pid = d.process.pid
    with open(f"/proc/{pid}/status", encoding="utf-8") as status:
        words = dict(line.split(":", 1) for line in status)
    links = []
    for fd in os.listdir(f"/proc/{pid}/fd"):
        try:
            links.append(os.readlink(f"/proc/{pid}/fd/{fd}"))
        except OSError:
            pass
    return {"processes": len(children(pid)), "descriptors": len(links),
            "memfds": sum("memfd:" in link for link in links), "shm": sum("weft" in name for name in os.listdir("/dev/shm")), 
            "rss_kb": int(words["VmRSS"].split()[0]), "own_kb": int(words["RssAnon"].split()[0])}


class Killer(threading.Thread):
    """Kills the camera's process of the daemon's job, at random moments."""

    def __init__(self, d, chance):
        super().__init__(daemon=True)
        self.d, self.chance, self.end, self.kills = d, chance, threading.Event(), 0

    def run(self):
        while not self.end.wait(self.chance.uniform(0.3, 3)):
            helpers = [p for p in children(self.d.process.pid) if "weft-camera-" in name_of(p)]
            if helpers:
                try:
                    os.kill(self.chance.choice(helpers), signal.SIGKILL)
                    self.kills += 1
                except OSError:
                    pass


def brightness(found):
    """Mean of the green photosites of each light's frame."""
    return {f["light"]: f["capture"]["statistics"]["mean"][1] for f in found["frames"] if f["role"] == "light"}


def run_to_the_end(d, job, ends):
    """Waits, resuming what has failed; gives the last state."""
    for _ in range(10):
        ended = d.wait(job, timeout=120)
        ends[ended["state"]] += 1
        if ended["state"] == "done":
            return ended
        assert ended["error"], ended
        d.reasons[ended["error"].split(":")[-1].strip()[:60]] += 1
        folder = f"{d.library}/{ended['operands'][0]}"
        if os.path.exists(f"{folder}/set.json"):
            check_set(folder, json.load(open(f"{folder}/set.json", encoding="utf-8"))["state"], 0)
        assert d.post(f"/v1/jobs/{job}/resume").status == 202
    raise AssertionError(f"job {job} does not end well: {ended}")


def test_captures_in_a_row():
    chance = random.Random(SEED)
    with scratch() as folder, Rig(folder) as rig, \
            Weftd(folder, "--rig", rig.folder, "--camera", "aravis:127.0.0.1,packet=1400") as d:
        d.reasons = collections.Counter()
        ends, retries, attempts = collections.Counter(), collections.Counter(), 0
        assert d.run("capture", "truth.set", exposure=EXPOSURE_S)["state"] == "done"
        truth = brightness(check_set(f"{d.library}/truth.set"))
        rig.tell(f"camera lost {PACKET_LOSS}")
        rig.tell(f"board line both drop {SERIAL_DAMAGE / 2} flip {SERIAL_DAMAGE / 2} seed {SEED % 1000 + 1}")
        before = figures(d)
        killer = Killer(d, chance)
        killer.start()
        begin, worst = time.monotonic(), 0.0
        for i in range(CAPTURES):
            job = d.add("capture", f"{i}.set", exposure=EXPOSURE_S)
            ended = run_to_the_end(d, job, ends)
            attempts += ended["attempt"]
            found = check_set(f"{d.library}/{i}.set")
            for light, mean in brightness(found).items():
                # another lamp on this cloth differs by a few per cent or more; noise of a mean by 1e-4
                worst = max(worst, abs(mean / truth[light] - 1))
                assert abs(mean / truth[light] - 1) < 0.004, f"seed {SEED}, {i}.set: light {light}: {mean}, not {truth[light]}"
            assert sorted(brightness(found)) == list(range(10)), found
            for frame in found["frames"]:
                for reason in frame["capture"]["retries"]:
                    retries[" ".join(w for w in reason.split() if not any(c.isdigit() for c in w))[:50]] += 1
            for frame in found["frames"]:
                os.remove(f"{d.library}/{i}.set/{frame['file']}")  # the disk is small
            if (i + 1) % 20 == 0:
                print(f"      {i + 1}: {figures(d)} {killer.kills} kills, {attempts} runs", flush=True)
        took = time.monotonic() - begin
        killer.end.set()
        killer.join()
        rig.wait_dark()
        deadline = time.monotonic() + 5
        while figures(d)["processes"] and time.monotonic() < deadline:
            time.sleep(0.1)
        after = figures(d)
        print(f"      seed {SEED}: {CAPTURES} sets of 11 frames in {took:.0f} s, {killer.kills} camera processes killed, "
              f"{attempts} runs, {sum(retries.values())} frames taken again, worst brightness {100 * worst:.2f} % off")
        print(f"      before {before}\n      after  {after}\n      {dict(ends)} {dict(d.reasons)}\n      retries {dict(retries.most_common(6))}")
        assert after["processes"] == before["processes"] == 0 and after["descriptors"] == before["descriptors"]
        assert after["memfds"] == before["memfds"] and after["shm"] <= before["shm"]
        assert SLOW > 1 or after["own_kb"] - before["own_kb"] < 3000, f"memory grows: {before} {after}"


if __name__ == "__main__":
    run_tests(globals())
