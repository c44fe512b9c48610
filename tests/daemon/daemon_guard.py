"""What weftd refuses, and whom it does not wait for: token, foreign hosts, paths out of the library, floods, slow
clients, watchers that never read; TLS; systemd's sockets, notices and watchdog; damaged databases."""
import json
import os
import shutil
import signal
import socket
import ssl
import subprocess
import threading
import time

from weftd import BIN, SLOW, SOURCE, Watcher, Weftd, children, make_flat, run_tests, scratch


def raw(d, data, timeout=20, tcp=None):
    """Sends bytes as they are; what comes back until the end."""
    s = socket.create_connection(tcp, timeout) if tcp else socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    s.settimeout(timeout)
    if not tcp:
        s.connect(d.socket)
    got = b""
    try:
        s.sendall(data)
        while chunk := s.recv(65536):
            got += chunk
    except (BrokenPipeError, ConnectionResetError):
        pass
    s.close()
    return got


def code_of(got):
    """(status, code) of a raw reply, which must be JSON."""
    head, _, body = got.partition(b"\r\n\r\n")
    assert b"application/json" in head, got[:300]
    error = json.loads(body)["error"]
    assert int(head.split()[1]) == error["status"] and error["message"], error
    return error["status"], error["code"]


def free_port():
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return s.getsockname()[1]


def test_tcp_wants_the_token():
    port = free_port()
    with scratch() as folder, Weftd(folder, "--listen", f"127.0.0.1:{port}", "--host", "scanner.lan") as d:
        token_file = f"{d.library}/.weft/token"
        assert os.stat(token_file).st_mode & 0o777 == 0o600
        with open(token_file, encoding="utf-8") as file:
            token = file.read().strip()
        assert len(token) == 64

        def ask(host, *headers):
            lines = "".join(f"{h}\r\n" for h in headers)
            return raw(d, f"GET /v1 HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n{lines}\r\n".encode(),
                       tcp=("127.0.0.1", port))
        here = f"127.0.0.1:{port}"
        assert code_of(ask(here)) == (401, "no_token")
        assert b"WWW-Authenticate: Bearer" in ask(here)
        for wrong in (token[:-1], token + "0", "0" * 64, "", token.upper() if token.upper() != token else "x"):
            assert code_of(ask(here, f"Authorization: Bearer {wrong}")) == (401, "no_token"), wrong
        assert code_of(ask(here, f"Authorization: Basic {token}")) == (401, "no_token")
        good = f"Authorization: Bearer {token}"
        for host in (here, f"localhost:{port}", f"LOCALHOST:{port}", f"scanner.lan:{port}", f"[::1]:{port}"):
            assert b" 200 " in ask(host, good).split(b"\r\n")[0], host
        for host in ("evil.example", f"evil.example:{port}", "127.0.0.1", f"localhost:{port + 1}", "", f"localhost:{port}x",
                     f"localhost:{port}.evil.example", f"127.0.0.1.evil.example:{port}"):
            assert code_of(ask(host, good)) == (421, "foreign_host"), host
        assert code_of(ask(here, good, "Host: evil.example")) == (421, "foreign_host"), "two Hosts"
        assert code_of(ask(here, good, "Origin: http://evil.example")) == (403, "foreign_origin")
        assert b" 200 " in ask(here, good, f"Origin: http://{here}").split(b"\r\n")[0]
        # a TCP client is nobody's own user: only names in the library, only the daemon's devices
        def post(body):
            text = json.dumps(body)
            return raw(d, (f"POST /v1/jobs HTTP/1.1\r\nHost: {here}\r\n{good}\r\nConnection: close\r\n"
                           f"Content-Type: application/json\r\nContent-Length: {len(text)}\r\n\r\n{text}").encode(),
                       tcp=("127.0.0.1", port))
        assert code_of(post({"command": "import", "operands": [f"{folder}"], "options": {"output": "x.set"}}))[0] == 403
        assert code_of(post({"command": "devices", "options": {"port": "/etc/passwd"}}))[0] == 403
        os.symlink("/etc", f"{d.library}/out")
        assert code_of(post({"command": "import", "operands": ["out"], "options": {"output": "x.set"}}))[0] == 403
        # the token must be a secret
        os.chmod(token_file, 0o644)
        d.stop()
        ended = subprocess.run([f"{BIN}/weftd", "--library", d.library, "--socket", d.socket, "--listen", here],
                               capture_output=True, text=True, check=False)
        assert ended.returncode == 1 and "others may read the token" in ended.stderr, ended
        os.chmod(token_file, 0o600)
        d.start()


def make_certificate(folder):
    subprocess.run(["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-keyout", f"{folder}/key", "-out",
                    f"{folder}/cert", "-days", "1", "-subj", "/CN=localhost", "-addext", "subjectAltName=DNS:localhost"],
                   check=True, capture_output=True)


def test_tls():
    if not shutil.which("openssl"):
        print("skipped: no openssl to make a certificate")
        return
    port = free_port()
    with scratch() as folder:
        make_certificate(folder)
        with Weftd(folder, "--listen", f"127.0.0.1:{port}", "--tls-cert", f"{folder}/cert", "--tls-key",
                   f"{folder}/key") as d:
            with open(f"{d.library}/.weft/token", encoding="utf-8") as file:
                token = file.read().strip()
            context = ssl.create_default_context(cafile=f"{folder}/cert")
            with context.wrap_socket(socket.create_connection(("127.0.0.1", port)), server_hostname="localhost") as s:
                s.sendall(f"GET /v1 HTTP/1.0\r\nHost: localhost:{port}\r\nAuthorization: Bearer {token}\r\n\r\n".encode())
                got = b""
                while chunk := s.recv(4096):
                    got += chunk
            assert b" 200 " in got.split(b"\r\n")[0] and b'"name":"weftd"' in got, got
            assert b" 200 " not in raw(d, b"GET /v1 HTTP/1.0\r\nHost: localhost\r\n\r\n", tcp=("127.0.0.1", port))


def test_command_line():
    def run(*words):
        return subprocess.run([f"{BIN}/weftd", *words], capture_output=True, text=True, check=False)
    helped = run("--help")
    assert helped.returncode == 0 and helped.stdout.startswith("weftd: "), helped
    with open(f"{SOURCE}/docs/daemon.md", encoding="utf-8") as page:
        text = page.read()
    for option in ("--library", "--socket", "--group", "--listen", "--token", "--host", "--tls-cert", "--tls-key", "--cpu-jobs"):
        assert option in helped.stdout and option in text, option
    for words, told in (((), "--library is needed"), (("--libary", "x"), "did you mean --library"),
                        (("--library", "x", "y"), "options only"), (("--library", "x", "--cpu-jobs", "0"), "1 to 16")):
        ended = run(*words)
        assert ended.returncode == 2 and told in ended.stderr, ended
    with scratch() as folder:
        for words, told in ((("--library", f"{folder}/none"), "there is no such folder"),
                            (("--library", folder, "--socket", f"{folder}/{'x' * 120}"), "shorter --socket"),
                            (("--library", folder, "--socket", f"{folder}/s", "--listen", "example.com:80"), "wanted an address"),
                            (("--library", folder, "--socket", f"{folder}/s", "--tls-cert", "x"), "go together"),
                            (("--library", folder, "--socket", f"{folder}/s", "--group", "nobody-has-it"), "no such group"),
                            (("--library", folder, "--socket", f"{folder}/s", "--rig", f"{folder}/none"), "--rig")):
            ended = run(*words)
            assert ended.returncode in (1, 2) and told in ended.stderr and ended.stderr.count("\n") <= 4, (words, ended)
            assert not os.path.exists(f"{folder}/s"), "a socket is left"


def test_mode_of_the_socket():
    with scratch() as folder, Weftd(folder, "--group", "daemon") as d:
        import grp
        status = os.stat(d.socket)
        assert status.st_mode & 0o777 == 0o660 and status.st_gid == grp.getgrnam("daemon").gr_gid, status


def test_paths_stay_in_the_library():
    with scratch() as folder, Weftd(folder) as d:
        with open(f"{folder}/secret", "w", encoding="utf-8") as file:
            file.write("secret")
        os.makedirs(f"{d.library}/a")
        with open(f"{d.library}/a/x.json", "w", encoding="utf-8") as file:
            file.write("{}")
        os.symlink(f"{folder}/secret", f"{d.library}/link")
        os.symlink(folder, f"{d.library}/a/linked")
        assert d.get("/v1/files/a/x.json").bytes == b"{}"
        for name in ("../secret", "a/../../secret", "%2e%2e/secret", "..%2fsecret", "a/..%2f..%2fsecret", "//etc/passwd",
                     "%2fetc/passwd", "link", "a/linked/secret", ".weft/token", "a/../.weft/library.db", "a//../../secret",
                     "./../secret", "..", "a/x.json/..", "a%00", "a/x.json%00.png", "a%0a", "%c0%ae%c0%ae/secret",
                     "..\\secret", "a/x.json/"):
            reply = d.get(f"/v1/files/{name}")
            assert reply.status in (400, 403, 404, 422) and "secret" not in reply.bytes.decode().replace(
                "secret\\\"", "").replace('secret"', ""), (name, reply.status, reply.bytes)
            assert reply.json["error"]["message"]
        for path in ("../x.set", "a/../../x.set", ".weft/x.set", "a/./../../x.set"):
            for body in ({"command": "import", "operands": ["a"], "options": {"output": path}},
                         {"command": "import", "operands": [path], "options": {"output": "x.set"}}):
                assert d.post("/v1/jobs", body).status == 403, body
        assert not d.get("/v1/jobs").json["jobs"]


def test_bodies_that_are_no_requests():
    with scratch() as folder, Weftd(folder) as d:
        head = {"Content-Type": "application/json"}
        deep = b"[" * 30000 + b"]" * 30000
        for body, status in ((b"", 400), (b"{", 400), (b"null", 400), (b"[]", 400), (b"\xff\xfe{}", 400), (b"{}", 400),
                             (b'{"command":"solve","command":"solve"}', 400), (b'{"command":"\xff"}', 400),
                             (b'{"command":"solve\\u0000"}', 400), (deep, 400), (b'{"command":1e999}', 400),
                             (b'{"command":"nothing"}', 422), (b'{"command":"solve"}', 422),
                             (b'{"command":"light on","operands":[1]}', 422),
                             (b'{"command":"light on","operands":["a\\u0000b"]}', 400),
                             (b'{"command":"capture","operands":["a"],"options":{"exposure":[1]}}', 422),
                             (b'{"command":"capture","operands":["a"],"options":{"gain":-1}}', 422),
                             (b'{"command":"capture","operands":["a","b"]}', 422),
                             (b'{"command":"capture","operands":["a"],"options":{"help":true}}', 422),
                             (b'{"command":"rig"}', 422), (b'{"command":"weft rig; reboot"}', 422),
                             (b"x" * 65536, 400), (b" " * 65537, 413), (b"x" * (1 << 20), 413)):
            reply = d.post("/v1/jobs", body, headers=head)
            assert reply.status == status and reply.json["error"]["message"], (body[:80], reply.status, reply.bytes)
        huge = raw(d, b"POST /v1/jobs HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
                      b"Content-Length: 99999999999\r\n\r\n{")
        assert code_of(huge) == (413, "body_too_large")
        chunks = b"".join(b"4000\r\n" + b"x" * 0x4000 + b"\r\n" for _ in range(6)) + b"0\r\n\r\n"
        assert code_of(raw(d, b"POST /v1/jobs HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
                              b"Connection: close\r\nTransfer-Encoding: chunked\r\n\r\n" + chunks))[0] == 413
        assert not d.get("/v1/jobs").json["jobs"]


def test_requests_that_are_none():
    with scratch() as folder, Weftd(folder) as d:
        for request in (b"\x00" * 2000, b"GET\r\n\r\n", b"\x16\x03\x01\x02\x00\x01\x00", b"HELLO there\r\n\r\n" * 50,
                        b"GET /v1 HTTP/9.9\r\nHost: localhost\r\n\r\n", b"\xff\xfe\xfd / \xff\r\n\r\n",
                        b"GET /" + b"a" * 100000 + b" HTTP/1.1\r\nHost: localhost\r\n\r\n"):
            got = raw(d, request + b"\r\n\r\n", timeout=25 * SLOW)
            assert b" 200 " not in got.split(b"\r\n")[0], (request[:50], got[:100])
        many = "".join(f"X-{i}: y\r\n" for i in range(100))
        large = "".join(f"X-{i}: {'y' * 1000}\r\n" for i in range(20))
        for flood in (many, large):
            assert code_of(raw(d, f"GET /v1 HTTP/1.0\r\nHost: localhost\r\n{flood}\r\n".encode())) == (431, "headers_too_large")
        vast = "".join(f"X-{i}: {'y' * 1000}\r\n" for i in range(300))
        got = raw(d, f"GET /v1 HTTP/1.0\r\nHost: localhost\r\n{vast}\r\n".encode())
        assert b" 431 " in got or not got, got[:100]  # hung up on before all of it has come
        assert d.get("/v1").status == 200


def odd_requests():
    """(name, bytes, status, code) of what is refused before it is a request of ours, much of it by libmicrohttpd."""
    get, post = b"GET /v1 HTTP/1.1\r\nHost: localhost\r\n", b"POST /v1/jobs HTTP/1.1\r\nHost: localhost\r\n"
    chunked = post + b"Content-Type: application/json\r\nTransfer-Encoding: chunked\r\n\r\n"
    bad, large = (400, "bad_http"), (413, "body_too_large")
    yield "no version", b"GET /v1\r\n\r\n", *bad
    yield "words", b"HELLO there\r\n\r\n", *bad
    yield "high bytes", b"\xff\xfe\xfd / \xff\r\n\r\n", *bad
    yield "HTTP/9.9", b"GET /v1 HTTP/9.9\r\nHost: localhost\r\n\r\n", 505, "http_version"
    yield "HTTP/0.9", b"GET /v1 HTTP/0.9\r\nHost: localhost\r\n\r\n", 505, "http_version"
    yield "HTTP/2", b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n", 505, "http_version"
    yield "no Host", b"GET /v1 HTTP/1.1\r\nConnection: close\r\n\r\n", 421, "foreign_host"
    yield "a blank in the address", b"GET /v1 x HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n", 404, "no_such_path"
    yield "no colon", get + b"no colon here\r\n\r\n", *bad
    for length in (b"x", b"-1", b"5x", b"", b"0x10", b"1.5"):
        yield f"Content-Length: {length}", post + b"Content-Length: " + length + b"\r\n\r\nabcde", *bad
    yield "Content-Length: 9...", post + b"Content-Length: " + b"9" * 24 + b"\r\n\r\n", *large
    yield "two lengths", post + b"Content-Length: 5\r\nContent-Length: 6\r\n\r\nabcdef", *bad
    yield "length and chunks", post + b"Content-Length: 3\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n", *bad
    yield "gzip", post + b"Transfer-Encoding: gzip\r\n\r\n", 501, "not_implemented"
    for chunk in (b"zz\r\nab\r\n", b"-1\r\nab\r\n", b"2\r\nabXX0\r\n\r\n"):
        yield f"chunk {chunk}", chunked + chunk, *bad
    yield "endless chunk", chunked + b"f" * 20 + b"\r\nab\r\n", *large
    yield "long address", b"GET /" + b"a" * 70000 + b" HTTP/1.1\r\nHost: localhost\r\n\r\n", 414, "uri_too_long"
    yield "long header", get + b"X: " + b"y" * 70000 + b"\r\n\r\n", 431, "headers_too_large"
    yield "cookies", get + b"Cookie: " + b";".join(b"a%d=b" % i for i in range(1500)) + b"\r\n\r\n", 431, "headers_too_large"
    yield "arguments", (b"GET /v1?" + b"&".join(b"a%d=b" % i for i in range(1500)) +
                        b" HTTP/1.1\r\nHost: localhost\r\n\r\n"), 431, "headers_too_large"


def test_every_refusal_is_json():
    """On the socket and over TCP, also as the second request of a connection; under TLS as far as it can be."""
    def ask(s, data):
        got = b""
        s.settimeout(25 * SLOW)
        try:
            s.sendall(data)
        except OSError:  # it has heard enough, and hung up; what it said is there
            pass
        try:
            while chunk := s.recv(65536):
                got += chunk
        except OSError:
            pass
        s.close()
        return got

    def local(d):
        s = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        s.connect(d.socket)
        return s

    def over(port, context=None):
        s = socket.create_connection(("127.0.0.1", port))
        return context.wrap_socket(s, server_hostname="localhost") if context else s
    first = b"GET /v1 HTTP/1.1\r\nHost: localhost\r\n\r\n"
    port, tls_port = free_port(), free_port()
    with scratch() as folder:
        for name in ("plain", "tls"):
            os.makedirs(f"{folder}/{name}")
        with Weftd(f"{folder}/plain", "--listen", f"127.0.0.1:{port}") as d:
            for name, data, *wanted in odd_requests():
                assert list(code_of(ask(local(d), data))) == wanted, name
                if len(data) < 5000:  # what is not read when the connection ends makes TCP forget the answer
                    got = ask(over(port), data)
                    assert b"application/json" in got and b"<html" not in got, (name, got)
                s = local(d)
                s.sendall(first)
                assert s.recv(65536).startswith(b"HTTP/1.1 200 "), name
                assert list(code_of(ask(s, data))) == wanted, f"{name}, as a second request"
            for data in (b"GET\r\n\r\n", b"\x16\x03\x01\x02\x00\x01\x00\r\n\r\n"):  # no request line: only hung up on
                assert ask(local(d), data) == b""
            assert d.get("/v1").status == 200
        if not shutil.which("openssl"):
            return
        make_certificate(folder)
        with Weftd(f"{folder}/tls", "--listen", f"127.0.0.1:{tls_port}", "--tls-cert", f"{folder}/cert", "--tls-key",
                   f"{folder}/key") as d:
            context = ssl.create_default_context(cafile=f"{folder}/cert")
            for name, data, *_ in odd_requests():
                if len(data) < 5000:
                    got = ask(over(tls_port, context), data)
                    assert got == b"" if "Content-Length:" in name else code_of(got), (name, got)
            assert d.get("/v1").status == 200


def test_slow_loris():
    """A request that trickles is ended after ten seconds, whatever it sends; others are served meanwhile."""
    with scratch() as folder, Weftd(folder) as d:
        slow = []
        for _ in range(20):
            s = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
            s.connect(d.socket)
            s.sendall(b"GET /v1 HTTP/1.1\r\nHost: loc")
            slow.append(s)
        begin = time.monotonic()
        ended = {}
        while len(ended) < len(slow) and time.monotonic() - begin < 30 * SLOW:
            for s in slow:
                if s in ended:
                    continue
                try:
                    s.sendall(b"a")
                    s.setblocking(False)
                    ended[s] = (time.monotonic() - begin, s.recv(4096))
                except BlockingIOError:
                    s.setblocking(True)
                except OSError:  # hung up on: what was said before that is there
                    ended[s] = (time.monotonic() - begin, s.recv(4096))
            assert d.get("/v1").status == 200
            time.sleep(0.2)
        assert len(ended) == len(slow), "a slow client is still waited for"
        assert all(seconds > 9 for seconds, _ in ended.values()), [round(t, 1) for t, _ in ended.values()]
        told = [got for _, got in ended.values() if got]
        assert told and all(code_of(got) == (408, "too_slow") for got in told)
        for s in slow:
            s.close()


def test_too_many_connections():
    with scratch() as folder, Weftd(folder) as d:
        held, refused = [], 0
        for _ in range(300):
            s = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
            s.settimeout(30 * SLOW)
            s.connect(d.socket)
            held.append(s)
        for s in reversed(held):  # the last ones are refused; each answer comes when the daemon has come so far
            if refused == 40:
                break
            assert code_of(s.recv(4096)) == (503, "too_many_connections")
            refused += 1
        for s in held:
            s.close()
        deadline = time.monotonic() + 20 * SLOW
        while True:
            try:
                if d.get("/v1").json.get("connections", 999) < 10:
                    break
            except OSError:  # turned away before it could ask
                pass
            assert time.monotonic() < deadline, "connections that are closed are still counted"
            time.sleep(0.1)


def test_fifty_watchers_and_one_that_never_reads():
    """Each of fifty hears every event in order; the one that does not read is dropped and holds nobody up."""
    with scratch() as folder, Weftd(folder) as d:
        make_flat(f"{d.library}/flat")
        assert d.run("import", "flat", output="flat.set")["state"] == "done"
        deaf = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        deaf.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 2048)
        deaf.connect(d.socket)
        deaf.sendall(b"GET /v1/events HTTP/1.0\r\nHost: localhost\r\n\r\n")
        heard = [[] for _ in range(50)]
        last = {}

        def listen(i):
            for number, kind, data in Watcher(d, timeout=120):
                if kind in ("job.state", "job.log"):
                    heard[i].append(number)
                if kind == "job.state" and data["id"] == last.get("id") and data["state"] == "failed":
                    return
        threads = [threading.Thread(target=listen, args=(i,)) for i in range(50)]
        for thread in threads:
            thread.start()
        deadline = time.monotonic() + 10 * SLOW
        while d.get("/v1").json["connections"] < 52 and time.monotonic() < deadline:
            time.sleep(0.05)
        assert d.get("/v1").json["connections"] >= 52
        begin = time.monotonic()
        last["id"] = 10 ** 9
        for _ in range(400):  # cancelled before they begin or not: three events of some hundred bytes each
            job = d.add("solve", "flat.set", calibration="none.cal", output="x.maps", mm_per_px=0.125)
            d.post(f"/v1/jobs/{job}/cancel")
        last["id"] = d.add("compare", "nothing", "nothing")
        for thread in threads:
            thread.join(90 * SLOW)
            assert not thread.is_alive(), "a watcher starves"
        took = time.monotonic() - begin
        assert min(len(h) for h in heard) >= 800, [len(h) for h in heard]
        assert all(h[-400:] == heard[0][-400:] for h in heard), "watchers hear different things"
        deadline = time.monotonic() + 15 * SLOW
        while d.get("/v1").json["connections"] > 1 and time.monotonic() < deadline:
            time.sleep(0.2)
        assert d.get("/v1").json["connections"] == 1, "the deaf one is still waited for"
        assert "a watcher is dropped: it takes nothing" in d.words() or "overrun" in d.words()
        print(f"      50 watchers heard {len(heard[0])} states and lines each in {took:.1f} s")
        deaf.close()


def notices(path):
    s = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
    s.bind(path)
    s.settimeout(20)
    return s


def test_systemd_notices_and_watchdog():
    with scratch() as folder:
        s = notices(f"{folder}/notify")
        with Weftd(folder, env={"NOTIFY_SOCKET": f"{folder}/notify", "WATCHDOG_USEC": "2000000"}) as d:
            assert b"READY=1" in s.recv(4096)
            times = []
            while len(times) < 3:
                if b"WATCHDOG=1" in s.recv(4096):
                    times.append(time.monotonic())
            assert max(b - a for a, b in zip(times, times[1:])) < 2 * SLOW, times
            os.kill(d.process.pid, signal.SIGSTOP)  # a daemon that hangs is silent, and systemd ends it
            s.settimeout(1)
            try:
                while True:
                    s.recv(4096)
            except TimeoutError:
                pass
            os.kill(d.process.pid, signal.SIGCONT)
            s.settimeout(20)
            d.process.send_signal(signal.SIGTERM)
            while b"STOPPING=1" not in s.recv(4096):
                pass
            assert d.process.wait(10) == 0
        s.close()


def test_socket_activation():
    activate = shutil.which("systemd-socket-activate")
    if not activate:
        print("skipped: no systemd-socket-activate")
        return
    with scratch() as folder:
        d = Weftd(folder)
        process = subprocess.Popen([activate, "--listen", d.socket, f"{BIN}/weftd", "--library", d.library],
                                   stderr=subprocess.DEVNULL)
        try:
            deadline = time.monotonic() + 30 * SLOW
            while True:
                try:
                    assert d.get("/v1").json["library"] == os.path.realpath(d.library)
                    break
                except (FileNotFoundError, ConnectionRefusedError):  # not made yet; made, and not listening
                    assert time.monotonic() < deadline, "no socket"
                    time.sleep(0.02)
        finally:
            process.terminate()
            process.wait(20)
        assert os.path.exists(d.socket), "systemd's socket is not the daemon's to remove"


def test_installed_units():
    with scratch() as folder:
        subprocess.run(["cmake", "--install", os.path.dirname(BIN), "--prefix", f"{folder}/usr", "--component", "daemon"],
                       check=True, capture_output=True)
        service = open(f"{folder}/usr/lib/systemd/system/weftd.service", encoding="utf-8").read()
        assert "Type=notify" in service and "KillMode=mixed" in service and "@" not in service, service
        assert os.access(f"{folder}/usr/bin/weftd", os.X_OK) and not os.path.exists(f"{folder}/usr/bin/weft")
        sysusers = shutil.which("systemd-sysusers")
        if sysusers:
            made = subprocess.run([sysusers, "--dry-run", f"{folder}/usr/lib/sysusers.d/weft.conf"], capture_output=True,
                                  text=True, check=False)
            assert made.returncode == 0 and "weft" in made.stdout + made.stderr, made
        analyze = shutil.which("systemd-analyze")
        if analyze:
            # the words of the units, with the program where it lies here
            os.makedirs(f"{folder}/units")
            for unit in ("weftd.service", "weftd.socket"):
                text = open(f"{folder}/usr/lib/systemd/system/{unit}", encoding="utf-8").read()
                with open(f"{folder}/units/{unit}", "w", encoding="utf-8") as file:
                    file.write("\n".join(f"ExecStart={BIN}/weftd --library /var/lib/weft" if line.startswith("ExecStart=")
                                         else line for line in text.split("\n")))
            checked = subprocess.run([analyze, "verify", f"{folder}/units/weftd.service", f"{folder}/units/weftd.socket"],
                                     capture_output=True, text=True, check=False)
            assert "weftd" not in checked.stderr, checked.stderr


def test_damaged_database():
    """The catalogue comes back from the files; the damaged file is kept; the queue begins anew."""
    with scratch() as folder, Weftd(folder) as d:
        make_flat(f"{d.library}/flat")
        assert d.run("import", "flat", output="flat.set")["state"] == "done"
        assert d.run("library reindex")["state"] == "done"
        before = d.get("/v1/library").json
        assert {i["kind"] for i in before["items"]} == {"set", "calibration", "picture"}, before
        d.stop()
        for name in ("-wal", "-shm"):
            if os.path.exists(f"{d.library}/.weft/library.db{name}"):
                os.remove(f"{d.library}/.weft/library.db{name}")
        with open(f"{d.library}/.weft/library.db", "r+b") as file:
            file.write(b"\xaa" * 6000)
        d.start()
        assert "was damaged" in d.words()
        assert d.get("/v1/library").json == before
        assert any("damaged-" in name for name in os.listdir(f"{d.library}/.weft"))
        assert not d.get("/v1/jobs").json["jobs"]


def test_catalogue_follows_the_files():
    weft = [f"{BIN}/weft", "library"]

    def run(*words):
        return json.loads(subprocess.run([*weft, *words, "--json"], capture_output=True, text=True, check=True).stdout)
    with scratch() as folder, Weftd(folder) as d:
        make_flat(f"{d.library}/flat")
        assert d.run("import", "flat", output="deep/flat.set") ["state"] == "failed", "there is no folder deep"
        os.makedirs(f"{d.library}/deep")
        assert d.run("import", "flat", output="deep/flat.set")["state"] == "done"
        assert d.run("solve", "deep/flat.set", calibration="deep/flat.cal", output="flat.maps")["state"] == "done"
        items = {i["path"]: i for i in d.get("/v1/library").json["items"]}
        assert items["deep/flat.set"]["info"]["lights"] == 5 and items["flat.maps"]["kind"] == "maps", items
        assert "flat.maps/normal.png" not in items, "what is inside a thing is not a thing"
        # the command sees the same, and a look around finds what no job has made
        report = run("reindex", "--library", d.library)
        assert report["items"] == len(items) + 6 and report["problems"] == 0, (report, list(items))
        assert d.get("/v1/library/deep/flat.set").json == run("show", "deep/flat.set", "--library", d.library)
        assert [i["path"] for i in run("find", "COMPLETE", "flat", "--library", d.library)["items"]] == ["deep/flat.set"]
        assert d.get("/v1/library?kind=set&q=complete").json["items"][0]["path"] == "deep/flat.set"
        with open(f"{d.library}/deep/flat.set/set.json", "w", encoding="utf-8") as file:
            file.write("{ not json")
        shutil.rmtree(f"{d.library}/flat.maps")
        job = d.run("library reindex")
        assert job["state"] == "done" and job["result"]["problems"] == 1 and job["result"]["removed"] == 1, job
        assert "not JSON" in d.get("/v1/library/deep/flat.set").json["problem"]
        again = run("reindex", "--library", d.library)
        assert again["read"] == 0, again
        picture = d.get("/v1/files/flat/p0.png")
        assert picture.headers["Content-Type"] == "image/png" and picture.bytes[:4] == b"\x89PNG"


def test_disk_full():
    """Host rows of the fault matrix: a job says what is wrong, nothing half made is left, the daemon lives on."""
    with scratch() as folder:
        small = f"{folder}/library"
        os.makedirs(small)
        if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=6m", "none", small], capture_output=True, check=False).returncode:
            print("skipped: no tmpfs may be mounted here")
            return
        try:
            with Weftd(folder) as d:
                make_flat(f"{small}/flat", 400, 300, noise=True)
                assert d.run("import", "flat", output="flat.set")["state"] == "done"
                with open(f"{small}/filler", "wb") as filler:
                    try:
                        while True:
                            filler.write(b"x" * 65536)
                            filler.flush()
                    except OSError:
                        pass
                os.truncate(f"{small}/filler", os.path.getsize(f"{small}/filler") - 500000)
                job = d.run("solve", "flat.set", calibration="flat.cal", output="flat.maps")
                assert job["state"] == "failed" and ("No space" in job["error"] or "disk full" in job["error"]), job
                assert not os.path.exists(f"{small}/flat.maps")
                assert not [n for n in os.listdir(small) if n.startswith(".weft-")], os.listdir(small)
                os.truncate(f"{small}/filler", 0)
                assert d.post(f"/v1/jobs/{job['id']}/resume").status == 202
                assert d.wait(job["id"])["state"] == "done"
                assert d.run("preview", "flat.maps", output="flat.png")["state"] == "done"
        finally:
            subprocess.run(["umount", small], check=False)


def test_read_only_folder():
    with scratch() as folder:
        closed = f"{folder}/library/closed"
        os.makedirs(closed)
        if subprocess.run(["mount", "--bind", closed, closed], capture_output=True, check=False).returncode:
            print("skipped: nothing may be mounted here")
            return
        try:
            subprocess.run(["mount", "-o", "remount,bind,ro", closed], check=True)
            with Weftd(folder) as d:
                make_flat(f"{d.library}/flat")
                job = d.run("import", "flat", output="closed/flat.set")
                assert job["state"] == "failed" and "closed/flat.set" in job["error"], job
                again = d.post("/v1/jobs", {"command": "import", "operands": ["flat"], "options": {"output": "flat.set"}})
                assert d.wait(again.json["id"])["state"] == "done"
            ended = subprocess.run([f"{BIN}/weftd", "--library", closed, "--socket", f"{folder}/s"], capture_output=True,
                                   text=True, check=False)
            assert ended.returncode == 1 and "let this user write the library" in ended.stderr, ended
        finally:
            subprocess.run(["umount", closed], check=False)


def test_no_leaks():
    """Descriptors, processes and memory of the daemon after many jobs, watchers and refused requests."""
    def figures(pid):
        with open(f"/proc/{pid}/status", encoding="utf-8") as status:
            own_kb = next(int(line.split()[1]) for line in status if line.startswith("RssAnon"))
        return len(os.listdir(f"/proc/{pid}/fd")), own_kb

    def exercise(d, n):
        for _ in range(n):
            d.run("compare", "none", "none")
            d.post("/v1/jobs", b"{", headers={"Content-Type": "application/json"})
            watcher = Watcher(d)
            next(iter(watcher))
            watcher.close()
            d.get("/v1/library?q=x")
    with scratch() as folder, Weftd(folder) as d:
        exercise(d, 20)
        time.sleep(0.6)
        before = figures(d.process.pid)
        exercise(d, 60)
        deadline = time.monotonic() + 5
        while figures(d.process.pid)[0] > before[0] and time.monotonic() < deadline:
            time.sleep(0.1)
        after = figures(d.process.pid)
        assert after[0] == before[0], (before, after)
        assert SLOW > 1 or after[1] - before[1] < 1500, (before, after)
        assert not children(d.process.pid)


if __name__ == "__main__":
    run_tests(globals(), at_a_time=4)
