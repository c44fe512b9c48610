"""Jobs of weftd: from an import to a preview, waiting for each other, cancelled, resumed, interrupted by SIGTERM
and SIGKILL of the daemon."""
import fcntl
import filecmp
import os
import shutil
import signal
import subprocess
import time

from weftd import (BIN, SLOW, Weftd, Watcher, alive, children, make_flat, run_tests, scratch, signal_all, stop_at_work,
                   wait_for_signal, wait_until_gone)


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


def write(path, text):
    with open(path, "w", encoding="utf-8") as file:
        file.write(text)


def test_from_a_set_to_a_material():
    """Solve, check, bake, look at it: queued at once; what they make is in the library and is served."""
    with scratch() as folder, Weftd(folder, "--cpu-jobs", "4") as d:
        make_flat(f"{d.library}/flat")
        write(f"{d.library}/flat.radattr", 'include <cotton.radattr>\n:flat := ( cotton :scan = "flat.maps" )\n')
        assert d.run("import", "flat", output="flat.set")["state"] == "done"
        solve = d.add("solve", "flat.set", calibration="flat.cal", output="flat.maps")
        check = d.add("check", "flat.set", calibration="flat.cal", map="error.exr", method="lsq")
        # that the text names flat.maps, only the bake itself finds out
        bake = d.add("bake", "flat.radattr", after=[solve], output="flat.material", export="png,gltf")
        preview = d.add("preview", "flat.material", output="flat.png", size="64x48")
        lint = d.add("lint", "flat.material/png")
        jobs = {name: d.wait(i) for name, i in (("solve", solve), ("check", check), ("bake", bake), ("preview", preview),
                                                ("lint", lint))}
        assert {j["state"] for n, j in jobs.items() if n != "lint"} == {"done"}, jobs
        assert jobs["bake"]["after"] == [solve] and jobs["bake"]["started"] >= jobs["solve"]["finished"]
        assert jobs["bake"]["result"]["rebuilt"] >= 5 and jobs["check"]["result"]["relighting"]["rms_relative"] < 0.01, jobs
        # a flat grey plate is a poor material, and lint says so: the job fails with its figures
        assert jobs["lint"]["state"] in ("done", "failed") and jobs["lint"]["result"]["findings"], jobs["lint"]
        items = {i["path"]: i for i in d.get("/v1/library").json["items"]}
        assert items["flat.material"]["kind"] == "material" and items["flat.material"]["info"]["type"] == "clothmaterial"
        assert items["flat.png"]["kind"] == items["error.exr"]["kind"] == "picture", items
        for name, kind, begin in (("flat.png", "image/png", b"\x89PNG"), ("flat.material/albedo.exr", "image/x-exr", b"v/1\1"),
                                  ("flat.material/png/albedo.png", "image/png", b"\x89PNG"),
                                  ("flat.material/gltf/flat.glb", "model/gltf-binary", b"glTF"),
                                  ("flat.material/material.json", "application/json", b"{")):
            reply = d.get(f"/v1/files/{name}")
            assert reply.status == 200 and reply.headers["Content-Type"] == kind and reply.bytes.startswith(begin), name
        again = d.run("bake", "flat.radattr", output="flat.material", export="png,gltf")
        assert again["state"] == "done" and again["result"]["rebuilt"] == 0, again
        refused = d.post("/v1/jobs", {"command": "bake", "operands": ["flat.radattr"], "options": {"format": True}})
        assert refused.status == 422 and "cannot be given" in refused.json["error"]["message"], refused.bytes


def make_big_material(d):
    make_flat(f"{d.library}/flat", 200, 150)
    write(f"{d.library}/big.radattr", 'include <cotton.radattr>\n:big := ( cotton :scan = "flat.maps" )\n')
    assert d.run("import", "flat", output="flat.set")["state"] == "done"
    assert d.run("solve", "flat.set", calibration="flat.cal", output="flat.maps")["state"] == "done"


def test_cancelled_bake_goes_on():
    """What a cancelled bake has done is kept, and it ends as one that was left alone."""
    with scratch() as folder, Weftd(folder) as d:
        make_big_material(d)
        bake, processes = stop_at_work(d, lambda i: d.add("bake", "big.radattr", output=f"big{i}.material", size="512x384"))
        made = d.job(bake)["options"]["output"]
        assert d.job(bake)["progress"]["unit"] == "rows", d.job(bake)
        assert d.post(f"/v1/jobs/{bake}/cancel").status == 202
        signal_all(processes, signal.SIGCONT)
        ended = d.wait(bake)
        assert ended["state"] == "cancelled" and ended["exit_status"] == 130 and "cancelled" in ended["error"], ended
        assert d.post(f"/v1/jobs/{bake}/resume").status == 202
        ended = d.wait(bake)
        assert ended["state"] == "done" and ended["attempt"] == 2, ended
        assert d.run("bake", "big.radattr", output="whole.material", size="512x384")["state"] == "done"
        for name in os.listdir(f"{d.library}/whole.material"):
            if name.endswith(".exr"):
                assert filecmp.cmp(f"{d.library}/whole.material/{name}", f"{d.library}/{made}/{name}", False), name


def test_killed_bake_leaves_nothing():
    """What a killed process has begun to write is removed, in the material too; what is another's stays."""
    with scratch() as folder, Weftd(folder) as d:
        make_big_material(d)
        bake, processes = stop_at_work(d, lambda i: d.add("bake", "big.radattr", output=f"big{i}.material", size="512x384"))
        (pid,), name = processes, d.job(bake)["options"]["output"]
        made = f"{d.library}/{name}"
        os.makedirs(made, exist_ok=True)
        mine = [f"{made}/.weft-normal.exr-{pid}-3", f"{d.library}/.weft-{name}-{pid}-0"]
        others = [f"{made}/.weft-normal.exr-{pid}1-3", f"{made}/.weft-normal.exr-{pid}-x", f"{d.library}/.weft-other.set-{pid}-0"]
        for path in mine + others:
            write(path, "half")
        os.kill(pid, signal.SIGKILL)
        ended = d.wait(bake)
        assert ended["state"] == "failed" and "signal 9" in ended["error"], ended
        assert not any(os.path.exists(path) for path in mine) and all(os.path.exists(path) for path in others)
        assert d.post(f"/v1/jobs/{bake}/resume").status == 202
        assert d.wait(bake)["state"] == "done"


def test_batch():
    """Many sets as one job: its progress, what it makes one by one in the library; a cancelled one goes on."""
    with scratch() as folder, Weftd(folder) as d:
        make_flat(f"{d.library}/flat", 200, 150)
        names = [f"flat{i}.set" for i in range(4)]
        words = {"calibration": "flat.cal", "output": "maps", "jobs": 1, "solve": ["method=lsq"]}
        assert d.run("import", "flat", output=names[0], cal="flat.cal")["state"] == "done"
        for name in names[1:]:
            shutil.copytree(f"{d.library}/{names[0]}", f"{d.library}/{name}")
        os.makedirs(f"{d.library}/maps/batch")
        watcher = Watcher(d)
        with open(f"{d.library}/maps/batch/flat3.lock", "w", encoding="utf-8") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)  # as another process that works on the set: the batch waits for it
            batch = d.add("batch", *names, **words)
            late = d.add("preview", "maps/flat3.maps", output="late.png", size="64x48")  # lies in what batch makes
            seen = watcher.until(lambda _, kind, data: kind == "job.progress" and data["job"] == batch and data["done"] == 3)
            assert seen[-1][2]["total"] == 4 and seen[-1][2]["unit"] == "sets", seen[-1]
            assert d.job(late)["state"] == "queued"
            assert d.post(f"/v1/jobs/{batch}/cancel").status == 202
            ended = d.wait(batch)
        assert ended["state"] == "cancelled" and ended["exit_status"] == 130, ended
        assert d.wait(late)["state"] == "failed", "maps that were not solved"
        maps = {f"maps/flat{i}.maps" for i in range(4)}
        assert {i["path"] for i in d.get("/v1/library?kind=maps").json["items"]} == maps - {"maps/flat3.maps"}
        assert d.post(f"/v1/jobs/{batch}/resume").status == 202
        late = d.add("preview", "maps/flat3.maps", output="late.png", size="64x48")
        ended = d.wait(batch)
        assert ended["state"] == "done" and d.wait(late)["state"] == "done", (ended, d.job(late))
        assert [s["state"] for s in ended["result"]["sets"]] == ["there already"] * 3 + ["solved"], ended["result"]["sets"]
        assert {i["path"] for i in d.get("/v1/library?kind=maps").json["items"]} == maps
        assert not children(d.process.pid)
        for path in ("output=../x", "explain-plot=/tmp/x.svg"):
            ended = d.run("batch", *names, **{**words, "solve": [path]})
            assert ended["state"] == "failed" and "not for batches" in ended["error"], ended


def stop_a_solve(d):
    """A solve that is stopped in the middle; see stop_at_work."""
    make_flat(f"{d.library}/flat", 1000, 800)
    assert d.run("import", "flat", output="flat.set")["state"] == "done"
    job, processes = stop_at_work(d, lambda i: d.add("solve", "flat.set", calibration="flat.cal", output=f"flat{i}.maps"))
    return job, processes, d.job(job)["options"]["output"]


def test_cancel_and_resume():
    with scratch() as folder, Weftd(folder) as d:
        job, processes, maps = stop_a_solve(d)
        behind = d.add("compare", maps, maps)
        waiting = d.add("preview", maps, output="flat.png")
        assert d.post(f"/v1/jobs/{waiting}/cancel").status == 202
        assert d.job(waiting)["state"] == "cancelled"
        assert d.post(f"/v1/jobs/{job}/cancel").json["cancelling"] is True
        signal_all(processes, signal.SIGCONT)
        ended = d.wait(job)
        assert ended["state"] == "cancelled" and ended["exit_status"] == 130, ended
        assert d.wait(behind)["state"] == "failed"
        assert not os.path.exists(f"{d.library}/{maps}")
        assert d.post(f"/v1/jobs/{job}/resume").status == 202
        assert d.wait(job)["state"] == "done" and d.job(job)["attempt"] == 2
        assert d.post(f"/v1/jobs/{job}/resume").status == 409
        assert d.post("/v1/jobs/99/cancel").status == 404 and d.post("/v1/jobs/99/resume").status == 404
        assert not children(d.process.pid)


def test_sigterm_keeps_what_ran():
    with scratch() as folder:
        with Weftd(folder) as d:
            job, processes, _ = stop_a_solve(d)
            d.process.send_signal(signal.SIGTERM)
            wait_for_signal(processes, signal.SIGTERM)
            signal_all(processes, signal.SIGCONT)
            assert d.process.wait(30 * SLOW) == 0
            assert not any(alive(p) for p in processes)
            assert not os.path.exists(d.socket), "the socket is left"
            d.start()
            ended = d.wait(job)
            assert ended["state"] == "done" and ended["attempt"] == 2, ended


def test_sigkill_keeps_what_ran():
    with scratch() as folder:
        with Weftd(folder) as d:
            job, processes, _ = stop_a_solve(d)
            d.kill()
            wait_until_gone(processes)
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
        time.sleep(0.5)  # it looks at the queue four times a second, and waits five for a holder
        assert d.job(first)["state"] == d.job(second)["state"] == "queued"
        watcher = Watcher(d, f"?job={first}&hold=1")
        seen = watcher.until(lambda _, kind, data: kind == "job.state" and data["state"] == "failed")
        assert "/dev/null" in seen[-1][2]["error"], seen[-1]
        assert d.wait(second, timeout=30)["state"] == "cancelled" and d.job(second)["attempt"] == 0


def test_one_daemon_per_library_and_socket():
    with scratch() as folder, Weftd(folder) as d:
        for options, words in ((["--library", d.library, "--socket", d.socket + "2"], "another weftd serves"),
                               (["--library", folder, "--socket", d.socket], "answers there already")):
            ended = subprocess.run([f"{BIN}/weftd", *options], capture_output=True, text=True, check=False)
            assert ended.returncode == 1 and words in ended.stderr, ended
        assert d.get("/v1").status == 200


if __name__ == "__main__":
    run_tests(globals(), at_a_time=3)
