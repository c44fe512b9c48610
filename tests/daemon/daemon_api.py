"""The server against its description: every route is described and every description is served; the replies of
the server, good and bad, have the statuses and the shapes that are written down."""
import json
import re

import jsonschema

from weftd import SOURCE, Weftd, make_flat, run_tests, scratch

with open(f"{SOURCE}/host/daemon/openapi.json", encoding="utf-8") as text:
    API = json.load(text)


def routes_of_the_server():
    """(method, path) -> operationId, from the table that the server runs on."""
    with open(f"{SOURCE}/host/daemon/routes.c", encoding="utf-8") as code:
        rows = re.findall(r'^    \{"([A-Z]+)",\s*"(/[^"]*)",\s*"(\w+)"', code.read(), re.M)
    assert rows
    return {(method, path): name for method, path, name in rows}


def operations():
    return {(method.upper(), path): operation for path, item in API["paths"].items()
            for method, operation in item.items()}


def resolve(pointer):
    node = API
    for part in pointer.removeprefix("#/").split("/"):
        node = node[part]
    return node


def check(method, path, reply):
    """The reply is one of those that the operation describes, and has its shape."""
    responses = operations()[method, path]["responses"]
    assert str(reply.status) in responses, f"{method} {path}: {reply.status} is not described: {reply.bytes}"
    described = responses[str(reply.status)]
    if "$ref" in described:
        described = resolve(described["$ref"])
    kind = reply.headers["Content-Type"].split(";")[0]
    assert kind in described["content"], f"{method} {path} {reply.status}: {kind}"
    if kind == "application/json" and "{path}" not in path or reply.status >= 400:
        schema = {"$ref": "#/root", "root": described["content"][kind]["schema"], "components": API["components"]}
        jsonschema.Draft202012Validator(schema).validate(reply.json)


def test_description_is_sound():
    assert API["openapi"] == "3.1.0"
    names = [operation["operationId"] for operation in operations().values()]
    assert len(set(names)) == len(names)
    for name, schema in API["components"]["schemas"].items():
        jsonschema.Draft202012Validator.check_schema(schema)
    text = json.dumps(API)
    for pointer in set(re.findall(r'"\$ref": "([^"]+)"', text)):
        resolve(pointer)
    for name in API["components"]["schemas"]:
        assert f"#/components/schemas/{name}\"" in text, f"the schema {name} is not used"


def test_routes_match_both_ways():
    served = routes_of_the_server()
    described = {key: operation["operationId"] for key, operation in operations().items()}
    assert served == described, {"only served": set(served) - set(described), "only described": set(described) - set(served)}
    with scratch() as folder, Weftd(folder) as d:
        assert d.get("/v1/openapi.json").json == API
        for method, path in served:
            concrete = path.replace("{id}", "999999").replace("{path}", "none")
            reply = d.request("OPTIONS", concrete)
            assert reply.status == 405 and method in reply.headers["Allow"].split(", "), (method, path, reply.bytes)


def exercise(d):
    """Requests, good and bad, for every operation: (method, path of the description, reply)."""
    make_flat(f"{d.library}/flat")
    good = {"command": "import", "operands": ["flat"], "options": {"output": "flat.set"}}
    calls = [("GET", "/v1"), ("GET", "/v1/openapi.json"), ("GET", "/v1/commands"), ("GET", "/v1/jobs"),
             ("GET", "/v1/jobs", "?state=done&limit=3&before=5"), ("GET", "/v1/jobs", "?state=sleeping"),
             ("GET", "/v1/jobs", "?limit=0"), ("GET", "/v1/jobs", "?limit=2x"), ("GET", "/v1/jobs", "?before=-1"),
             ("GET", "/v1/jobs", "?state=%ff")]
    for method, path, *query in calls:
        yield method, path, d.request(method, path + "".join(query))
    for body in (good, "{", "[]", "", '{"command":1}', '{"command":"rig"}', {"command": "solve"},
                 {**good, "options": {"output": "../x.set"}}, {**good, "operands": ["/etc/../etc"]},
                 {**good, "surprise": 1}, {**good, "format": "xml"}, {**good, "after": 1}, {**good, "after": [0]}, {**good, "after": ["x"]}, {**good, "options": {"output": "x.set", "rig": 1.5}}):
        yield "POST", "/v1/jobs", d.post("/v1/jobs", body, headers={"Content-Type": "application/json"})
    yield "POST", "/v1/jobs", d.post("/v1/jobs", "a=b")
    yield "POST", "/v1/jobs", d.post("/v1/jobs", "x" * 70000, headers={"Content-Type": "application/json"})
    job = d.wait(1)
    assert job["state"] == "done", job
    failed = d.run("import", "nothing", output="no.set")
    assert failed["state"] == "failed", failed
    for path in ("/v1/jobs/{id}", "/v1/jobs/{id}/log"):
        for number in (1, failed["id"], 12345):
            yield "GET", path, d.get(path.replace("{id}", str(number)))
    yield "GET", "/v1/jobs/{id}/log", d.get("/v1/jobs/1/log?from=x")
    for path in ("/v1/jobs/{id}/cancel", "/v1/jobs/{id}/resume"):
        for number in (failed["id"], 1, 12345):
            yield "POST", path, d.post(path.replace("{id}", str(number)))
            d.wait(failed["id"])
    for number in (failed["id"], 12345):
        yield "DELETE", "/v1/jobs/{id}", d.request("DELETE", f"/v1/jobs/{number}")
    for path in ("/v1/live", "/v1/live.jpg"):
        yield "GET", path, d.get(path)
    yield "GET", "/v1/live.mjpg", d.get("/v1/live.mjpg?rate=99")
    for query in ("", "?kind=set", "?kind=shoe", "?q=flat%20complete&limit=1&offset=0", "?limit=x", "?q=%ff",
                  "?q=" + "+a" * 20):
        yield "GET", "/v1/library", d.get("/v1/library" + query)
    for name in ("flat.set", "none.set", "%ff"):
        yield "GET", "/v1/library/{path}", d.get(f"/v1/library/{name}")
    for name in ("flat.set/set.json", "flat/p0.png", "none", "flat", "a%00b", "../../etc/passwd", "%2e%2e/%2e%2e/etc/passwd",
                 "/etc/passwd", ".weft/token"):
        yield "GET", "/v1/files/{path}", d.get(f"/v1/files/{name}")
    for query in ("?job=12345", "?job=0", "?log=x"):
        yield "GET", "/v1/events", d.get("/v1/events" + query)
    for method, path in routes_of_the_server():
        concrete = path.replace("{id}", "1").replace("{path}", "x")
        yield method, path, d.request(method, concrete, headers={"Host": "foreign.example"})
        yield method, path, d.request(method, concrete, headers={"Origin": "http://foreign.example"})
        yield method, path, d.request(method, concrete, headers={f"X-{i}": "x" for i in range(80)})


def test_replies_are_as_described():
    with scratch() as folder, Weftd(folder) as d:
        seen = {}
        for method, path, reply in exercise(d):
            check(method, path, reply)
            seen.setdefault((method, path), set()).add(reply.status)
        for key in operations():
            assert {403, 421, 431} <= seen[key], (key, seen[key])
        assert seen["POST", "/v1/jobs"] >= {201, 400, 403, 413, 415, 422}, seen
        assert seen["POST", "/v1/jobs/{id}/resume"] >= {202, 404, 409}, seen


def test_text_options_of_jobs():
    """A path that the daemon does not know as one would get around the library: what job_kinds.c does not say of a
    text is refused, and a row that says nothing of one is not finished."""
    with open(f"{SOURCE}/host/client/job_kinds.c", encoding="utf-8") as code:
        text = code.read()
    chart = re.search(r"#define CHART (.*)", text)[1]
    rows = {m[1]: m[0].replace("CHART", chart) for m in re.finditer(r'\{\.command = "([^"]+)".*\},', text)}
    with scratch() as folder, Weftd(folder) as d:
        commands = {c["command"]: c for c in d.get("/v1/commands").json["commands"]}
        assert set(commands) == set(rows), set(commands) ^ set(rows)
        with open(f"{SOURCE}/docs/daemon.md", encoding="utf-8") as page:
            told = page.read().split("These commands can be jobs:")[1].split("\n")[0]
        for name in commands:
            assert f"`{name}`" in told or f"`{name.split()[0]} ...`" in told, f"docs/daemon.md: {name} can be a job too"
        for name, command in commands.items():
            known = {"rig", "port", "camera"}
            for words in re.findall(r'\.(?:reads|writes|texts) = "([^"]*)"', rows[name]):
                known |= set(words.split("|"))
            never = set("|".join(re.findall(r'\.never = "([^"]*)"', rows[name])).split("|")) - {""}
            assert not never & {o["key"] for o in command["options"]}, f"{name} lists what it does not take"
            for key in never:
                reply = d.post("/v1/jobs", {"command": name, "options": {key: True}})
                assert reply.status == 422 and "cannot be given" in reply.json["error"]["message"], reply.bytes
            texts = {o["key"] for o in command["options"] if o["type"] in ("text", "texts")}
            assert known - {"*", "rig", "port", "camera"} <= texts, f"{name} has no {known - texts}"
            assert texts <= known, f"{name}: is {texts - known} a path or a text? (host/client/job_kinds.c)"


if __name__ == "__main__":
    run_tests(globals())
