"""Jobs of weftd: from an import to a preview, waiting for each other, cancelled, resumed, interrupted by SIGTERM
and SIGKILL of the daemon."""
import os
import signal
import subprocess
import time

from weftd import BIN, Weftd, Watcher, alive, children, make_flat, run_tests, scratch


def test_line_of_jobs():
    """Four jobs queued at once: each waits for the one that makes what it reads."""
    with scratch() as folder, Weftd(folder, "--cpu-jobs", "4") as d:
        make_flat(f"{d.library}/flat")
        ids = [d.add("import", "flat", output="flat.set"),
               d.add("solve", "flat.set", calibration="flat.cal", output="flat.maps"),
               d.add("preview", "flat.maps", output="flat.png", light=[135, 45], size="64x48"),
               d.add("compare", "flat.maps", "flat.maps")]
        jobs = [d.wait(i) for i in ids]
        # flat.cal is made beside flat.set and no option names it: solve waits for the set
        assert [j["state"] for j in jobs] == ["done"] * 4, [(j["state"], j["error"]) for j in jobs]
        assert jobs[1]["result"]["solved"][0]["maps"] == f"{d.library}/flat.maps", jobs[1]
        assert jobs[3]["result"]["normal_deg"]["max"] == 0, jobs[3]
        assert os.path.getsize(f"{d.library}/flat.png") > 100
        again = d.run("solve", "flat.set", calibration="flat.cal", output="flat.maps")
        assert again["state"] == "failed" and "--force" in again["error"] and again["exit_status"] == 1, again
        assert d.run("solve", "flat.set", calibration="flat.cal", output="flat.maps", force=True)["state"] == "done"
        listed = d.get("/v1/jobs?limit=2").json["jobs"]
        assert [j["id"] for j in listed] == [6, 5], listed
        assert [j["id"] for j in d.get("/v1/jobs?state=failed").json["jobs"]] == [5]
        lines = d.get("/v1/jobs/5/log").json["lines"]
        assert any("--force" in line["text"] and line["stream"] == "err" for line in lines), lines
        assert d.request("DELETE", "/v1/jobs/5").status == 200 and d.get("/v1/jobs/5").status == 404


def test_events_of_a_job():
    with scratch() as folder, Weftd(folder) as d:
        make_flat(f"{d.library}/flat")
        watcher = Watcher(d)
        d.add("import", "flat", output="flat.set")
        solve = d.add("solve", "flat.set", calibration="flat.cal", output="flat.maps")
        seen = watcher.until(lambda _, kind, data: kind == "job.state" and data["id"] == solve and data["state"] == "done")
        assert seen[0][1] == "snapshot", seen[0]
        states = [data["state"] for _, kind, data in seen if kind == "job.state" and data["id"] == solve]
        assert states == ["queued", "running", "done"], states
        progress = [data for _, kind, data in seen if kind == "job.progress" and data["job"] == solve]
        assert progress and progress[-1]["done"] <= progress[-1]["total"] > 0, progress
        # resume behind the first of them: exactly the rest comes again
        rest = Watcher(d, last=seen[1][0]).until(lambda i, _, __: i == seen[-1][0])
        assert rest == seen[2:], (rest, seen)
        # an id of another life gives a snapshot, one of the job only gives its lines and its state
        assert next(iter(Watcher(d, last="999-1")))[1] == "snapshot"
        kinds = [kind for _, kind, __ in Watcher(d, f"?job={solve}").until(lambda _, kind, __: kind == "job.state")]
        assert kinds.count("job.state") == 1 and kinds.count("job.log") >= 1, kinds


def begin_long_solve(d):
    """A solve that takes a second or more."""
    make_flat(f"{d.library}/flat", 2000, 1600)
    assert d.run("import", "flat", output="flat.set")["state"] == "done"
    return d.add("solve", "flat.set", calibration="flat.cal", output="flat.maps")


def test_cancel_and_resume():
    with scratch() as folder, Weftd(folder) as d:
        job = begin_long_solve(d)
        behind = d.add("compare", "flat.maps", "flat.maps")
        waiting = d.add("preview", "flat.maps", output="flat.png")
        d.wait(job, "running")
        assert d.post(f"/v1/jobs/{waiting}/cancel").status == 202
        assert d.job(waiting)["state"] == "cancelled"
        assert d.post(f"/v1/jobs/{job}/cancel").json["cancelling"] is True
        ended = d.wait(job)
        assert ended["state"] == "cancelled" and ended["exit_status"] == 130, ended
        assert d.wait(behind)["state"] == "failed"
        assert not os.path.exists(f"{d.library}/flat.maps")
        assert d.post(f"/v1/jobs/{job}/resume").status == 202
        assert d.wait(job)["state"] == "done" and d.job(job)["attempt"] == 2
        assert d.post(f"/v1/jobs/{job}/resume").status == 409
        assert d.post("/v1/jobs/99/cancel").status == 404 and d.post("/v1/jobs/99/resume").status == 404
        assert not children(d.process.pid)


def test_sigterm_keeps_what_ran():
    with scratch() as folder:
        with Weftd(folder) as d:
            job = begin_long_solve(d)
            while not d.job(job)["progress"]:
                time.sleep(0.005)
            processes = children(d.process.pid)
            assert processes
            d.process.send_signal(signal.SIGTERM)
            assert d.process.wait(20) == 0
            assert not any(alive(p) for p in processes)
            assert not os.path.exists(d.socket), "the socket is left"
            d.start()
            ended = d.wait(job)
            assert ended["state"] == "done" and ended["attempt"] == 2, ended


def test_sigkill_keeps_what_ran():
    with scratch() as folder:
        with Weftd(folder) as d:
            job = begin_long_solve(d)
            while not d.job(job)["progress"]:
                time.sleep(0.005)
            processes = children(d.process.pid)
            assert processes
            d.kill()
            deadline = time.monotonic() + 2
            while any(alive(p) for p in processes) and time.monotonic() < deadline:
                time.sleep(0.01)
            assert not any(alive(p) for p in processes), "a process outlives its daemon"
            d.start()
            ended = d.wait(job)
            assert ended["state"] == "done" and ended["attempt"] == 2, ended
            assert not [f for f in os.listdir(d.library) if f.startswith(".weft-")], os.listdir(d.library)


def test_held_jobs_wait_for_their_holder():
    """Also behind a restart: a light that somebody meant to hold does not come on by itself."""
    with scratch() as folder, Weftd(folder, "--port", "/dev/null") as d:
        body = {"command": "light off", "hold": True}
        first, second = (d.post("/v1/jobs", body).json["id"] for _ in range(2))
        d.kill()
        d.start()
        time.sleep(1)
        assert d.job(first)["state"] == d.job(second)["state"] == "queued"
        watcher = Watcher(d, f"?job={first}&hold=1")
        seen = watcher.until(lambda _, kind, data: kind == "job.state" and data["state"] == "failed")
        assert "/dev/null" in seen[-1][2]["error"], seen[-1]
        assert d.wait(second, timeout=15)["state"] == "cancelled" and d.job(second)["attempt"] == 0


def test_one_daemon_per_library_and_socket():
    with scratch() as folder, Weftd(folder) as d:
        for options, words in ((["--library", d.library, "--socket", d.socket + "2"], "another weftd serves"),
                               (["--library", folder, "--socket", d.socket], "answers there already")):
            ended = subprocess.run([f"{BIN}/weftd", *options], capture_output=True, text=True, check=False)
            assert ended.returncode == 1 and words in ended.stderr, ended
        assert d.get("/v1").status == 200


if __name__ == "__main__":
    run_tests(globals())
