"""Jobs: submit, look, wait, list, result, cancel, delete."""
import json
import re
import socket
import threading
import time
import urllib.parse

import pytest

SMALL = {"film": {"width": 32, "height": 24}, "objects": [{"type": "sphere"}]}
UNKNOWN = "job_00000000000000000000000000"


def scene(name):
    return dict(SMALL, name=name)


def slow(name):
    """Some 2.5e9 rays: longer than any test here, within every limit."""
    return {"name": name, "film": {"width": 640, "height": 480},
            "sampler": {"type": "sobol", "spp": 4096},
            "integrator": {"type": "whitted", "max_bounces": 0},
            "objects": [{"type": "sphere"}]}


def submit(daemon, document):
    reply = daemon.post("/v1/jobs", document)
    assert reply.status == 202, reply.body
    return reply.json["id"]


def problem(reply, status, slug):
    assert reply.status == status, reply.body
    assert reply.json["type"] == f"/problems/{slug}"
    return reply.json


@pytest.fixture
def running(daemon):
    """A job that will not end by itself during the test."""
    job = submit(daemon, slow(f"running-{time.time_ns()}"))
    yield job
    daemon.post(f"/v1/jobs/{job}/cancel")
    daemon.wait_for(job)


def test_submit_answers_with_the_job(daemon):
    reply = daemon.post("/v1/jobs", {
        "scene": scene("submit"), "tags": ["lecture4", "b"],
        "priority": "low", "max_attempts": 2})
    assert reply.status == 202
    job = reply.json
    assert re.fullmatch(r"job_[0-9A-HJKMNP-TV-Z]{26}", job["id"])
    assert reply.headers["Location"] == f"/v1/jobs/{job['id']}"
    assert int(reply.headers["Retry-After"]) >= 1
    assert reply.headers["ETag"] == f'W/"r{job["revision"]}"'
    assert job["state"] in ("queued", "running")
    assert job["tags"] == ["lecture4", "b"]
    assert job["priority"] == "low"
    assert job["max_attempts"] == 2
    film = job["settings"]["film"]
    assert (film["width"], film["height"]) == (32, 24)
    assert job["estimate"]["rays"] > 0
    assert job["error"] is None and job["stats"] is None
    assert job["links"]["result"] is None
    done = daemon.wait_for(job["id"])
    assert done["state"] == "succeeded", done
    assert done["progress"] == 1
    assert done["attempt"] == 1
    assert done["phase"] is None
    assert done["queue_position"] is None
    assert done["eta_seconds"] is None
    assert done["samples_done"] == done["samples_total"] >= 1
    assert done["stats"]["rays"]["camera"] >= 32 * 24
    assert done["created_at"] <= done["started_at"] <= done["finished_at"]
    assert done["links"]["result"] == f"/v1/jobs/{job['id']}/result"
    assert done["links"]["cancel"] is None


def test_wait_ends_with_the_job(daemon):
    job = submit(daemon, scene("wait"))
    reply = daemon.get(f"/v1/jobs/{job}?wait=30")
    assert reply.json["state"] == "succeeded"


def test_wait_ends_with_time(daemon, running):
    started = time.monotonic()
    reply = daemon.get(f"/v1/jobs/{running}?wait=1")
    assert reply.status == 200
    assert reply.json["state"] in ("queued", "running")
    assert 0.8 < time.monotonic() - started < 5


def test_a_known_revision_is_304(daemon):
    job = submit(daemon, scene("revision"))
    daemon.wait_for(job)
    tag = daemon.get(f"/v1/jobs/{job}").headers["ETag"]
    for query in ("", "?wait=5"):  # over: nothing will change
        started = time.monotonic()
        reply = daemon.get(f"/v1/jobs/{job}{query}",
                           headers={"If-None-Match": tag})
        assert (reply.status, reply.body) == (304, b"")
        assert reply.headers["ETag"] == tag
        assert time.monotonic() - started < 2
    other = daemon.get(f"/v1/jobs/{job}?wait=5",
                       headers={"If-None-Match": 'W/"r0"'})
    assert other.status == 200


def test_wait_with_a_revision_ends_with_the_next_change(daemon, running):
    tag = daemon.get(f"/v1/jobs/{running}").headers["ETag"]
    changed = {}

    def look():
        seen = tag
        while True:
            reply = daemon.get(f"/v1/jobs/{running}?wait=20",
                               headers={"If-None-Match": seen})
            assert reply.status == 200, reply.body
            seen = reply.headers["ETag"]
            if reply.json["cancel_requested"] or \
                    reply.json["state"] == "canceled":
                changed["at"] = time.monotonic()
                return

    watcher = threading.Thread(target=look)
    watcher.start()
    time.sleep(0.3)
    asked = time.monotonic()
    daemon.post(f"/v1/jobs/{running}/cancel")
    watcher.join(20)
    assert changed["at"] - asked < 2


@pytest.mark.parametrize("wait", ["-1", "61", "1.5", "x", ""])
def test_a_wrong_wait_is_refused(daemon, wait):
    body = problem(daemon.get(f"/v1/jobs/{UNKNOWN}?wait={wait}"), 404,
                   "not-found")
    job = submit(daemon, scene("wait-wrong"))
    body = problem(daemon.get(f"/v1/jobs/{job}?wait={wait}"), 400,
                   "request-malformed")
    assert "60" in body["detail"]


@pytest.mark.parametrize("path, method", [
    ("", "GET"), ("", "DELETE"), ("/result", "GET"), ("/cancel", "POST")])
@pytest.mark.parametrize("job", [UNKNOWN, "job_x", "nonsense", "..",
                                 "job_0000000000000000000000000U"])
def test_unknown_jobs_are_404(daemon, path, method, job):
    problem(daemon.request(method, f"/v1/jobs/{job}{path}",
                           b"" if method == "POST" else None),
            404, "not-found")


def test_result_with_etag_range_and_format(daemon):
    job = submit(daemon, scene("result"))
    daemon.wait_for(job)
    url = f"/v1/jobs/{job}/result"
    image = daemon.get(url)
    assert image.status == 200
    assert image.headers["Content-Type"] == "image/png"
    tag = image.headers["ETag"]
    assert not tag.startswith("W/")
    same = daemon.get(url, headers={"If-None-Match": tag})
    assert (same.status, same.body) == (304, b"")
    part = daemon.get(url, headers={"Range": "bytes=1-3"})
    assert (part.status, part.body) == (206, b"PNG")
    assert daemon.get(url + "?format=png").body == image.body
    assert daemon.get(url + "?layer=beauty").body == image.body
    assert problem(daemon.get(url + "?format=exr"), 406,
                   "not-acceptable")["available"] == ["image/png"]
    assert problem(daemon.get(url, headers={"Accept": "text/csv"}), 406,
                   "not-acceptable")["available"] == ["image/png"]
    for layer in ("depth", "nonsense", ""):
        assert problem(daemon.get(f"{url}?layer={layer}"), 404,
                       "layer-missing")["layers"] == ["beauty"]


def test_a_result_that_is_not_there_yet(daemon, running):
    reply = daemon.get(f"/v1/jobs/{running}/result")
    body = problem(reply, 409, "conflict-state")
    assert body["state"] in ("queued", "running")


def test_cancel_while_running_and_again(daemon, running):
    reply = daemon.post(f"/v1/jobs/{running}/cancel")
    assert reply.status == 200
    assert reply.json["state"] == "canceled" or reply.json["cancel_requested"]
    assert daemon.wait_for(running, timeout=10)["state"] == "canceled"
    again = daemon.post(f"/v1/jobs/{running}/cancel", {})
    assert again.status == 200
    assert again.json["state"] == "canceled"
    problem(daemon.get(f"/v1/jobs/{running}/result"), 409, "conflict-state")


def test_a_finished_job_cannot_be_canceled(daemon):
    job = submit(daemon, scene("finished"))
    daemon.wait_for(job)
    problem(daemon.post(f"/v1/jobs/{job}/cancel"), 409, "conflict-state")


def test_cancel_takes_no_body(daemon, running):
    problem(daemon.post(f"/v1/jobs/{running}/cancel", {"why": "x"}), 400,
            "request-malformed")


def test_delete(daemon):
    job = submit(daemon, scene("delete"))
    daemon.wait_for(job)
    plan = daemon.request("DELETE", f"/v1/jobs/{job}?dry_run=1")
    assert plan.status == 200
    assert [x["kind"] for x in plan.json["would_delete"]] == ["record",
                                                              "result"]
    assert daemon.get(f"/v1/jobs/{job}").status == 200
    gone = daemon.request("DELETE", f"/v1/jobs/{job}")
    assert (gone.status, gone.body) == (204, b"")
    for path in ("", "/result"):
        problem(daemon.get(f"/v1/jobs/{job}{path}"), 404, "not-found")
    problem(daemon.request("DELETE", f"/v1/jobs/{job}"), 404, "not-found")
    # What was deleted is rendered anew, not found.
    reply = daemon.post("/v1/render", scene("delete"))
    assert (reply.status, reply.headers["Glint-Cache"]) == (200, "miss")


def test_delete_of_a_running_job(daemon, running):
    problem(daemon.request("DELETE", f"/v1/jobs/{running}"), 409,
            "conflict-state")
    problem(daemon.request("DELETE", f"/v1/jobs/{running}?dry_run=1"), 409,
            "conflict-state")
    problem(daemon.request("DELETE", f"/v1/jobs/{running}?dry_run=yes"), 400,
            "request-malformed")


def test_list_pages_and_filters(daemon):
    tag = f"t{time.time_ns()}"
    ids = [submit(daemon, {"scene": scene(f"list-{i}"), "tags": [tag, "x"]})
           for i in range(5)]
    for job in ids:
        daemon.wait_for(job)
    url, seen, pages = f"/v1/jobs?tag={tag}&limit=2&state=succeeded", [], 0
    while url:
        reply = daemon.get(url)
        assert reply.status == 200, reply.body
        page = reply.json
        assert len(page["jobs"]) <= 2
        seen += [job["id"] for job in page["jobs"]]
        if page["next"]:
            assert reply.headers["Link"] == f'<{page["next"]}>; rel="next"'
        else:
            assert reply.headers["Link"] is None
        url = page["next"]
        pages += 1
    assert seen == ids[::-1]
    assert pages == 3
    assert daemon.get(f"/v1/jobs?tag={tag}&state=failed,queued"
                      ).json["jobs"] == []
    assert daemon.get("/v1/jobs?tag=no-such").json["jobs"] == []
    third = daemon.get(f"/v1/jobs/{ids[2]}").json["created_at"]
    since = urllib.parse.quote(third)
    got = [job["id"] for job in
           daemon.get(f"/v1/jobs?tag={tag}&since={since}").json["jobs"]]
    assert got == ids[:1:-1]


@pytest.mark.parametrize("query", [
    "limit=0", "limit=201", "limit=x", "state=done", "state=", "state=queued,",
    "tag=", "tag=a%20b", "since=yesterday", "since=2026-02-30T00:00:00Z",
    "cursor=x", "cursor=" + UNKNOWN[:-1], "page=2", "limit=1&limit=2"])
def test_wrong_list_parameters(daemon, query):
    problem(daemon.get(f"/v1/jobs?{query}"), 400, "request-malformed")


def test_a_client_that_leaves_cancels_its_render(new_daemon):
    daemon = new_daemon()
    body = json.dumps(slow(f"leaver-{time.time_ns()}")).encode()
    before = {job["id"] for job in daemon.get("/v1/jobs").json["jobs"]}
    with socket.create_connection(("127.0.0.1", daemon.port)) as client:
        client.sendall(b"POST /v1/render HTTP/1.1\r\nHost: 127.0.0.1\r\n"
                       b"Prefer: wait=60\r\n"
                       b"Content-Type: application/json\r\n"
                       b"Content-Length: %d\r\n\r\n%s" % (len(body), body))
        deadline = time.monotonic() + 10
        new = set()
        while not new and time.monotonic() < deadline:
            new = {job["id"] for job in daemon.get("/v1/jobs").json["jobs"]
                   } - before
        assert len(new) == 1
    # Not with ?wait=: who waits for a job keeps it alive.
    job, deadline = new.pop(), time.monotonic() + 8
    while time.monotonic() < deadline:
        state = daemon.get(f"/v1/jobs/{job}").json["state"]
        if state not in ("queued", "running"):
            break
        time.sleep(0.05)
    assert state == "canceled"


def test_a_watched_render_outlives_its_client(new_daemon):
    daemon = new_daemon()
    body = json.dumps(slow(f"watched-{time.time_ns()}")).encode()
    before = {job["id"] for job in daemon.get("/v1/jobs").json["jobs"]}
    client = socket.create_connection(("127.0.0.1", daemon.port))
    client.sendall(b"POST /v1/render HTTP/1.1\r\nHost: 127.0.0.1\r\n"
                   b"Prefer: wait=60\r\nContent-Type: application/json\r\n"
                   b"Content-Length: %d\r\n\r\n%s" % (len(body), body))
    new = set()
    deadline = time.monotonic() + 10
    while not new and time.monotonic() < deadline:
        new = {job["id"] for job in daemon.get("/v1/jobs").json["jobs"]
               } - before
    job = new.pop()
    watcher = threading.Thread(
        target=lambda: daemon.get(f"/v1/jobs/{job}?wait=5"))
    watcher.start()
    time.sleep(0.5)
    client.close()
    watcher.join()
    state = daemon.get(f"/v1/jobs/{job}").json
    daemon.post(f"/v1/jobs/{job}/cancel")
    daemon.wait_for(job)
    assert not state["cancel_requested"]
    assert state["state"] in ("queued", "running")


def test_queue_full(new_daemon):
    daemon = new_daemon("--max-queued", "2", "--workers", "1")
    first = submit(daemon, slow("full-0"))
    replies = [daemon.post("/v1/jobs", slow(f"full-{i}"))
               for i in range(1, 6)]
    refused = [r for r in replies if r.status != 202]
    assert refused, "nothing was refused"
    for reply in refused:
        problem(reply, 503, "queue-full")
        assert int(reply.headers["Retry-After"]) >= 1
    # Whoever was refused has no job; whoever was accepted has one.
    jobs = daemon.get("/v1/jobs").json["jobs"]
    assert len(jobs) == 1 + len(replies) - len(refused)
    for job in jobs:
        daemon.post(f"/v1/jobs/{job['id']}/cancel")
    daemon.wait_for(first)
