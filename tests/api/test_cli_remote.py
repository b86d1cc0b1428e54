"""glint with a server: the same pictures, the same words, its own failures."""
import http.server
import json
import socket
import threading
import time

import pytest

from cli import (ENDLESS, EXAMPLES, SMALL, SMALLEST, TABLE, assert_png, files,
                 glint)
from test_cli_render import on_terminal, percents, start


def url(daemon):
    return f"http://127.0.0.1:{daemon.port}"


def free_port():
    with socket.socket() as sock:
        sock.bind(("127.0.0.1", 0))
        return sock.getsockname()[1]


# ---- the real one ----

@pytest.mark.parametrize("flags", [
    [], ["--bit-depth", "uint16", "--color-space", "linear"],
    ["--layer", "normal"],
    ["--format", "exr", "--layer", "beauty", "--layer", "depth"],
], ids=str)
def test_the_same_bytes_as_at_the_desk(daemon, flags):
    here = glint("render", TABLE, "-o-", *SMALL, *flags)
    there = glint("render", TABLE, "-o-", *SMALL, *flags, "--server",
                  url(daemon))
    assert here.returncode == there.returncode == 0, there.stderr
    assert here.stdout == there.stdout
    by_environment = glint("render", TABLE, "-o-", *SMALL, *flags,
                           GLINT_SERVER=url(daemon) + "/")
    assert by_environment.stdout == here.stdout
    say = [line.decode().split(" in ")[0]
           for line in here.stderr.splitlines()]
    assert [line.decode().split(" in ")[0]
            for line in there.stderr.splitlines()] == say


def test_a_job_document_goes_as_it_is(daemon, tmp_path):
    path = tmp_path / "job.json"
    path.write_text(json.dumps({
        "scene": {"film": {"width": 40, "height": 30},
                  "objects": [{"type": "sphere"}]},
        "output": {"format": "exr", "layers": ["depth"]},
        "priority": "low", "tags": ["a"]}))
    here = glint("render", path, "-qo-")
    there = glint("render", path, "-qo-", "--server", url(daemon))
    assert there.returncode == 0, there.stderr
    assert here.stdout == there.stdout and b"depth.V" in there.stdout


def test_a_long_render_becomes_a_job_with_a_bar(new_daemon, tmp_path):
    daemon = new_daemon("--threads", 1, "--workers", 1)
    status, drawn = on_terminal(
        ["render", TABLE, "-o", "a.png", "--set",
         '/sampler={"type": "sobol", "spp": 28}', "--server", url(daemon)],
        cwd=tmp_path)
    assert status == 0, drawn
    shown = percents(drawn)
    assert len(shown) >= 2 and shown == sorted(shown) and shown[-1] == 100
    assert_png((tmp_path / "a.png").read_bytes(), 1280, 720)


@pytest.mark.parametrize("path", sorted((EXAMPLES / "bad").glob("*-*.json")),
                         ids=lambda path: path.stem)
def test_a_refused_scene_shows_places_of_the_users_file(daemon, tmp_path, path):
    here = glint("render", path, "-o", "a.png", cwd=tmp_path)
    there = glint("render", path, "-o", "a.png", "--server", url(daemon),
                  cwd=tmp_path)
    assert there.returncode == here.returncode == 3
    assert there.stderr == here.stderr
    assert files(tmp_path) == []


def test_a_budget_is_an_invalid_scene(daemon, tmp_path):
    run = glint("render", TABLE, "-o", "a.png", "--set",
                '/sampler={"type": "sobol", "spp": 65536}', "--server",
                url(daemon), cwd=tmp_path)
    assert run.returncode == 3
    assert files(tmp_path) == []


def test_a_time_out_prints_the_job_that_goes_on(daemon, tmp_path):
    run = glint("render", TABLE, "-o", "a.png", *ENDLESS[:1],
                '/sampler={"type": "sobol", "spp": 300}', "--timeout", 2,
                "--server", url(daemon), cwd=tmp_path)
    assert run.returncode == 6, run.stderr
    last = run.stderr.decode().splitlines()[-1]
    job = last.split("timed out; ")[1].split(" ")[0]
    assert last.endswith("goes on at the server")
    assert daemon.get(f"/v1/jobs/{job}").json["state"] == "running"
    assert files(tmp_path) == []
    daemon.post(f"/v1/jobs/{job}/cancel")
    assert daemon.wait_for(job)["state"] == "canceled"


@pytest.mark.parametrize("after", [0.4, 3.0])
def test_ctrl_c_cancels_the_job(daemon, tmp_path, after):
    spp = 290 + int(after)
    before = {j["id"] for j in daemon.get("/v1/jobs").json["jobs"]}
    process = start(tmp_path, "--set",
                    f'/sampler={{"type": "sobol", "spp": {spp}}}', "--server",
                    url(daemon))
    time.sleep(after)
    process.send_signal(2)
    _, err = process.communicate(timeout=20)
    assert process.returncode == 130, err
    assert err.decode().splitlines()[-1] == \
        "glint render: interrupted; nothing was written"
    assert files(tmp_path) == []
    jobs = {j["id"] for j in daemon.get("/v1/jobs").json["jobs"]} - before
    assert len(jobs) == 1
    assert daemon.wait_for(jobs.pop(), timeout=10)["state"] == "canceled"


def test_a_job_canceled_by_someone_else_has_failed(daemon, tmp_path):
    before = {j["id"] for j in daemon.get("/v1/jobs").json["jobs"]}
    process = start(tmp_path, "--set",
                    '/sampler={"type": "sobol", "spp": 310}', "--server",
                    url(daemon))
    time.sleep(2.5)
    jobs = {j["id"] for j in daemon.get("/v1/jobs").json["jobs"]} - before
    job = jobs.pop()
    daemon.post(f"/v1/jobs/{job}/cancel")
    _, err = process.communicate(timeout=20)
    assert process.returncode == 5
    assert f"{job} canceled" in err.decode()


def test_threads_are_for_the_desk(daemon, tmp_path):
    run = glint("render", TABLE, "-o", "a.png", "--threads", 2, "--server",
                url(daemon), cwd=tmp_path)
    assert run.returncode == 2 and b"--threads" in run.stderr


def test_health(daemon):
    run = glint("health", "--server", url(daemon))
    assert run.returncode == 0
    assert run.stdout.decode() == f"{url(daemon)} is ready\n"
    quiet = glint("health", "-q", GLINT_SERVER=url(daemon))
    assert (quiet.returncode, quiet.stdout, quiet.stderr) == (0, b"", b"")
    # A proxy in the environment is not for this machine.
    assert glint("health", "--server", url(daemon),
                 http_proxy="http://127.0.0.1:1").returncode == 0


# ---- nobody, and wrong ones ----

@pytest.mark.parametrize("command", [["health"],
                                     ["render", SMALLEST, "-o", "a.png"]],
                         ids=lambda words: words[0])
def test_nobody_there(tmp_path, command):
    server = f"http://127.0.0.1:{free_port()}"
    begin = time.monotonic()
    run = glint(*command, "--server", server, cwd=tmp_path)
    assert run.returncode == 4
    assert time.monotonic() - begin < 3
    assert run.stderr.decode().splitlines()[-1] == (
        f"glint {command[0]}: nobody listens at {server}: is glintd running? "
        "start it with: glintd")
    assert run.stdout == b"" and files(tmp_path) == []


@pytest.mark.parametrize("server,status", [
    ("127.0.0.1:8080", 2), ("ftp://127.0.0.1", 2), ("file:///etc/passwd", 2),
    ("http://", 2), ("http://a b/", 2), ("http://127.0.0.1:99999", 2),
    ("http://127.0.0.1/?x", 2), ("http://" + "a" * 600, 2),
    ("http://no-such-host.invalid", 4),
])
def test_urls(tmp_path, server, status):
    for command in (["health"], ["render", SMALLEST, "-o", "a.png"]):
        run = glint(*command, "--server", server, cwd=tmp_path)
        assert run.returncode == status, run.stderr
        assert b"glint " in run.stderr
    assert files(tmp_path) == []


class Actor:
    """A server that answers as a test wishes: rows of (status, headers, body),
    the last one again and again."""

    def __init__(self, *rows):
        actor = self
        actor.rows, actor.asked, actor.bodies = list(rows), [], []

        class Handler(http.server.BaseHTTPRequestHandler):
            def answer(self):
                actor.asked.append(f"{self.command} {self.path}")
                length = int(self.headers.get("Content-Length") or 0)
                actor.bodies.append(self.rfile.read(length))
                row = actor.rows[0]
                if len(actor.rows) > 1:
                    actor.rows.pop(0)
                status, headers, body = row
                self.send_response(status)
                for name, value in headers.items():
                    self.send_header(name, value)
                self.send_header("Content-Length", str(len(body)))
                self.end_headers()
                self.wfile.write(body)

            do_GET = do_POST = answer

            def log_message(self, *args):
                pass

        self.server = http.server.ThreadingHTTPServer(("127.0.0.1", 0),
                                                      Handler)
        self.url = f"http://127.0.0.1:{self.server.server_port}"
        self.thread = threading.Thread(target=self.server.serve_forever)

    def __enter__(self):
        self.thread.start()
        return self

    def __exit__(self, *what):
        self.server.shutdown()
        self.thread.join()
        self.server.server_close()


def problem(status, slug, **members):
    body = {"type": f"/problems/{slug}", "title": "A title", "status": status,
            "detail": "The detail.", **members}
    return (status, {"Content-Type": "application/problem+json"},
            json.dumps(body).encode())


def job(state, **members):
    return (200, {"Content-Type": "application/json"},
            json.dumps({"id": "job_01A", "state": state, **members}).encode())


ACCEPTED = (202, {"Content-Type": "application/json",
                  "Location": "/v1/jobs/job_01A"}, b'{"id": "job_01A"}')
PICTURE = (200, {"Content-Type": "image/png"}, b"\x89PNG picture")


@pytest.mark.parametrize("answer,status,words", [
    (problem(500, "internal"), 4, "the server answered 500: A title: The detail."),
    (problem(503, "queue-full"), 4, "503"),
    (problem(500, "render-failed"), 5, "500"),
    (problem(503, "draining"), 4, "503"),
    (problem(401, "unauthorized"), 7, "401"),
    (problem(403, "forbidden"), 7, "403"),
    (problem(429, "quota"), 7, "429"),
    (problem(413, "too-large"), 3, "413"),
    (problem(422, "budget-exceeded"), 3, "422"),
    (problem(404, "not-found"), 4, "404"),
    ((404, {"Content-Type": "text/html"}, b"<h1>"), 4, "perhaps no glintd"),
    ((200, {"Content-Type": "text/html"}, b"<h1>"), 4, "perhaps no glintd"),
    ((200, {"Content-Type": "image/x-exr"}, b"x"), 4, "perhaps no glintd"),
    ((302, {"Location": "http://127.0.0.1:1/"}, b""), 4, "perhaps no glintd"),
    ((202, {"Location": "/v1/jobs/../../etc"}, b"{}"), 4, "perhaps no glintd"),
    ((202, {}, b"{}"), 4, "perhaps no glintd"),
    ((500, {"Content-Type": "application/problem+json"}, b"{"), 4, "500"),
], ids=lambda value: str(value)[:40])
def test_every_refusal_has_its_status(tmp_path, answer, status, words):
    with Actor(answer) as actor:
        run = glint("render", SMALLEST, "-o", "a.png", "--server", actor.url,
                    cwd=tmp_path)
    assert run.returncode == status, run.stderr
    assert words in run.stderr.decode()
    assert len(actor.asked) == 1  # no redirect followed, nothing retried
    assert files(tmp_path) == []


def test_a_server_cannot_move_the_cursor(tmp_path):
    with Actor(problem(500, "internal", detail="\x1b[2J\x07 oops",
                       title="\x9b31m")) as actor:
        run = glint("render", SMALLEST, "-o", "a.png", "--server", actor.url,
                    cwd=tmp_path)
    assert run.returncode == 4
    assert b"\x1b" not in run.stderr and b"oops" in run.stderr
    assert "\x9b" not in run.stderr.decode()


def test_the_way_of_a_job(tmp_path):
    with Actor(ACCEPTED, job("queued"), job("running", progress=0.5,
               phase="tracing"), job("succeeded"), PICTURE) as actor:
        run = glint("render", SMALLEST, "-o", "a.png", "--server", actor.url,
                    cwd=tmp_path)
    assert run.returncode == 0, run.stderr
    assert actor.asked == ["POST /v1/render"] + \
        ["GET /v1/jobs/job_01A?wait=1"] * 3 + ["GET /v1/jobs/job_01A/result"]
    assert (tmp_path / "a.png").read_bytes() == b"\x89PNG picture"
    sent = json.loads(actor.bodies[0])
    assert sent["scene"] == json.loads(SMALLEST.read_text())
    assert sent["output"]["format"] == "png"


def test_a_sync_timeout_is_a_job_too(tmp_path):
    status, headers, body = problem(503, "sync-timeout")
    headers["Location"] = "http://elsewhere/v1/jobs/job_01A"
    with Actor((status, headers, body), job("succeeded"), PICTURE) as actor:
        run = glint("render", SMALLEST, "-qo", "a.png", "--server", actor.url,
                    cwd=tmp_path)
    assert run.returncode == 0, run.stderr
    assert actor.asked[1:] == ["GET /v1/jobs/job_01A?wait=1",
                               "GET /v1/jobs/job_01A/result"]


@pytest.mark.parametrize("rows,status,words", [
    ([job("failed", error={"code": "stalled", "detail": "no progress"})], 5,
     "job_01A failed: no progress"),
    ([job("canceled")], 5, "job_01A canceled"),
    ([problem(404, "not-found")], 4, "404"),
    ([(200, {}, b"[]")], 4, "is no job"),
    ([(200, {}, b"{")], 4, "is no job"),
    ([job("succeeded"), problem(410, "result-expired")], 5, "410"),
    ([job("succeeded"), problem(500, "internal")], 4, "500"),
], ids=lambda value: str(value)[:40])
def test_jobs_that_end_badly(tmp_path, rows, status, words):
    with Actor(ACCEPTED, *rows) as actor:
        run = glint("render", SMALLEST, "-o", "a.png", "--server", actor.url,
                    cwd=tmp_path)
    assert run.returncode == status, run.stderr
    assert words in run.stderr.decode()
    assert files(tmp_path) == []


def test_a_server_that_goes_away_names_the_job(tmp_path):
    """Five looks in a row that find nobody, then the id for later."""
    with Actor(ACCEPTED, job("running", progress=0.1)) as actor:
        process = start(tmp_path, "--server", actor.url)
        deadline = time.monotonic() + 10
        while len(actor.asked) < 3 and time.monotonic() < deadline:
            time.sleep(0.01)
    _, err = process.communicate(timeout=20)
    assert process.returncode == 4
    assert "the job is job_01A" in err.decode()
    assert files(tmp_path) == []


def test_health_of_a_server_that_is_not_ready():
    with Actor(problem(503, "draining")) as actor:
        run = glint("health", "--server", actor.url)
    assert run.returncode == 4
    assert b"503" in run.stderr and run.stdout == b""
    assert actor.asked == ["GET /readyz"]


def test_health_of_a_server_that_says_nothing():
    with socket.socket() as silent:
        silent.bind(("127.0.0.1", 0))
        silent.listen()
        run = glint("health", "--server",
                    f"http://127.0.0.1:{silent.getsockname()[1]}")
    assert run.returncode == 4
    assert b"did not answer within" in run.stderr
