"""POST /v1/render: the table of API section 3, row by row."""
import json
import struct
import time

import pytest

from conftest import example

SMALL = {"film": {"width": 64, "height": 48}, "objects": [{"type": "sphere"}]}
PNG = b"\x89PNG\r\n\x1a\n"
EXR = b"\x76\x2f\x31\x01"


def scene(name):
    """A scene of its own for each test, so that caches do not meet."""
    return dict(SMALL, name=name)


def slow(name, spp):
    """Some seconds of work, whatever the machine."""
    return {"name": name, "film": {"width": 640, "height": 480},
            "sampler": {"type": "sobol", "spp": spp},
            "integrator": {"type": "whitted", "max_bounces": 0},
            "objects": [{"type": "sphere"}]}


def png_size(body):
    assert body[:8] == PNG
    return struct.unpack(">II", body[16:24])


def problem(reply, status, slug):
    assert reply.status == status, reply.body
    assert reply.headers["Content-Type"] == "application/problem+json"
    assert reply.json["type"] == f"/problems/{slug}"
    assert reply.json["status"] == status
    assert reply.json["request_id"] == reply.headers["Request-Id"]
    return reply.json


def test_a_bare_scene_gives_a_png(daemon):
    reply = daemon.post("/v1/render", scene("bare"))
    assert reply.status == 200, reply.body
    assert reply.headers["Content-Type"] == "image/png"
    assert png_size(reply.body) == (64, 48)
    assert reply.headers["Glint-Cache"] == "miss"
    assert reply.headers["Cache-Control"] == "private, max-age=86400"
    assert reply.headers["ETag"].startswith('"')
    location = reply.headers["Content-Location"]
    assert location.startswith("/v1/jobs/job_") and location.endswith("/result")
    assert daemon.get(location).body == reply.body
    for part in ("queue;dur=", "build;dur=", "trace;dur=", "encode;dur="):
        assert part in reply.headers["Server-Timing"]


def test_a_repeat_is_a_hit_with_the_same_bytes(daemon):
    first = daemon.post("/v1/render", scene("hit"))
    jobs = len(daemon.get("/v1/jobs?limit=200").json["jobs"])
    again = daemon.post("/v1/render", scene("hit"))
    assert again.status == 200
    assert again.headers["Glint-Cache"] == "hit"
    assert again.headers["Content-Location"] is None
    assert again.body == first.body
    assert again.headers["ETag"] == first.headers["ETag"]
    assert len(daemon.get("/v1/jobs?limit=200").json["jobs"]) == jobs


def test_what_changes_no_pixel_is_the_same_scene(daemon):
    first = daemon.post("/v1/render", scene("same"))
    other = dict(scene("same"), description="another text",
                 extras={"note": 1})
    assert daemon.post("/v1/render", other).headers["Glint-Cache"] == "hit"
    moved = dict(scene("same"), camera={"eye": [0, 0, 6]})
    reply = daemon.post("/v1/render", moved)
    assert reply.headers["Glint-Cache"] == "miss"
    assert reply.headers["ETag"] != first.headers["ETag"]


def test_no_cache_renders_again_to_the_same_bytes(daemon):
    first = daemon.post("/v1/render", scene("again"))
    again = daemon.post("/v1/render", scene("again"),
                        headers={"Cache-Control": "no-cache"})
    assert again.headers["Glint-Cache"] == "miss"
    assert again.body == first.body
    assert again.headers["ETag"] == first.headers["ETag"]


def test_if_none_match(daemon):
    tag = daemon.post("/v1/render", scene("etag")).headers["ETag"]
    reply = daemon.post("/v1/render", scene("etag"),
                        headers={"If-None-Match": f'"x", {tag}'})
    assert (reply.status, reply.body) == (304, b"")
    assert reply.headers["ETag"] == tag
    other = daemon.post("/v1/render", scene("etag"),
                        headers={"If-None-Match": '"x"'})
    assert other.status == 200


@pytest.mark.parametrize("query, headers, media_type, magic", [
    ("", {}, "image/png", PNG),
    ("?format=exr", {}, "image/x-exr", EXR),
    ("?format=png", {"Accept": "image/x-exr"}, "image/png", PNG),
    ("", {"Accept": "image/x-exr"}, "image/x-exr", EXR),
    ("", {"Accept": "text/html,image/avif,*/*;q=0.8"}, "image/png", PNG),
    ("", {"Accept": "image/png;q=0.1, image/x-exr"}, "image/x-exr", EXR),
])
def test_the_format_is_negotiated(daemon, query, headers, media_type, magic):
    reply = daemon.post(f"/v1/render{query}", scene("format"),
                        headers=headers)
    assert reply.status == 200, reply.body
    assert reply.headers["Content-Type"] == media_type
    assert reply.body.startswith(magic)


def test_query_accept_and_output_name_one_result(daemon):
    by_query = daemon.post("/v1/render?format=exr", scene("one"))
    by_accept = daemon.post("/v1/render", scene("one"),
                            headers={"Accept": "image/x-exr"})
    by_body = daemon.post("/v1/render", {"scene": scene("one"),
                                         "output": {"format": "exr"}})
    assert by_accept.headers["Glint-Cache"] == "hit"
    assert by_body.headers["Glint-Cache"] == "hit"
    assert by_query.headers["ETag"] == by_body.headers["ETag"]


def test_a_job_document_with_exr_float(daemon):
    reply = daemon.post("/v1/render", {
        "scene": scene("exr"),
        "output": {"format": "exr", "bit_depth": "float",
                   "layers": ["beauty", "depth", "normal"]}})
    assert reply.status == 200, reply.body
    assert reply.headers["Content-Type"] == "image/x-exr"
    assert reply.body.startswith(EXR)
    for channel in (b"depth.V", b"normal.X", b"glint:layers"):
        assert channel in reply.body


def test_an_example_by_name(daemon):
    reply = daemon.post("/v1/render", {"scene": {"$example": "smallest"}})
    assert reply.status == 200, reply.body
    same = daemon.post("/v1/render", example("smallest"))
    assert same.headers["Glint-Cache"] == "hit"
    assert same.body == reply.body


def test_accept_json_gives_the_job(daemon):
    reply = daemon.post("/v1/render", scene("json"),
                        headers={"Accept": "application/json"})
    assert reply.status == 200
    assert reply.json["state"] == "succeeded"
    assert reply.json["progress"] == 1
    image = daemon.get(reply.json["links"]["result"])
    assert png_size(image.body) == (64, 48)


def test_not_acceptable_lists_what_exists(daemon):
    reply = daemon.post("/v1/render", scene("406"),
                        headers={"Accept": "text/csv"})
    assert problem(reply, 406, "not-acceptable")["available"] == [
        "image/png", "image/x-exr", "application/json"]
    reply = daemon.post("/v1/render?format=jpeg", scene("406"))
    assert problem(reply, 406, "not-acceptable")["available"] == ["png", "exr"]
    reply = daemon.post("/v1/render", {"scene": scene("406"),
                                       "output": {"format": "png"}},
                        headers={"Accept": "image/x-exr"})
    assert problem(reply, 406, "not-acceptable")["available"] == [
        "image/png", "application/json"]


def test_query_against_output_is_a_conflict(daemon):
    body = problem(daemon.post("/v1/render?format=exr",
                               {"scene": scene("x"),
                                "output": {"format": "png"}}),
                   422, "job-invalid")
    assert body["errors"][0]["code"] == "property.conflict"
    assert body["errors"][0]["pointer"] == "/output"


def test_respond_async_answers_at_once(daemon):
    reply = daemon.post("/v1/render", slow("async", 256),
                        headers={"Prefer": "respond-async"})
    assert reply.status == 202
    assert reply.headers["Preference-Applied"] == "respond-async"
    assert reply.headers["Retry-After"]
    assert reply.json["state"] in ("queued", "running")
    assert reply.headers["Location"] == reply.json["links"]["self"]
    assert daemon.wait_for(reply.json["id"])["state"] == "succeeded"
    hit = daemon.post("/v1/render", slow("async", 256),
                      headers={"Prefer": "respond-async"})
    assert hit.status == 200
    assert hit.headers["Glint-Cache"] == "hit"


def test_respond_async_with_a_wait_long_enough(daemon):
    reply = daemon.post("/v1/render", scene("async-wait"),
                        headers={"Prefer": "respond-async, wait=20"})
    assert reply.status == 200
    assert reply.headers["Content-Type"] == "image/png"
    assert reply.headers["Preference-Applied"] == "respond-async, wait=20"


def test_needs_async_creates_no_job(new_daemon):
    daemon = new_daemon()
    before = len(daemon.get("/v1/jobs?limit=200").json["jobs"])
    reply = daemon.post("/v1/render", slow("hopeless", 16384),
                        headers={"Prefer": "wait=1"})
    body = problem(reply, 422, "needs-async")
    assert body["estimate"]["seconds"] > 4
    assert len(daemon.get("/v1/jobs?limit=200").json["jobs"]) == before


def test_not_done_in_time_goes_on(new_daemon):
    """Work for about three times the wait: the estimate does not refuse it,
    and it cannot be done."""
    daemon = new_daemon()
    for spp in (4096, 2048, 1024, 512, 256, 128, 64):
        document = slow("timeout", spp)
        check = daemon.post("/v1/scenes/validate", document).json
        if check["estimate"]["seconds"] < 7.9:
            break
    # Other work takes the workers, so that the estimate cannot be beaten.
    others = [daemon.post("/v1/jobs", slow(f"other-{i}", 4096)).json["id"]
              for i in range(8)]
    started = time.monotonic()
    reply = daemon.post("/v1/render", document, headers={"Prefer": "wait=2"})
    took = time.monotonic() - started
    for other in others:
        daemon.post(f"/v1/jobs/{other}/cancel")
    body = problem(reply, 503, "sync-timeout")
    assert 1.5 < took < 6
    assert int(reply.headers["Retry-After"]) >= 1
    job = daemon.get(reply.headers["Location"]).json
    assert job["state"] in ("queued", "running")
    assert body["job"] == job["id"]
    daemon.post(f"/v1/jobs/{job['id']}/cancel")
    assert daemon.wait_for(job["id"])["state"] == "canceled"


def test_head_of_a_result(daemon):
    reply = daemon.post("/v1/render", scene("head"))
    head = daemon.request("HEAD", reply.headers["Content-Location"])
    assert head.status == 200
    assert head.body == b""
    assert int(head.headers["Content-Length"]) == len(reply.body)


def test_the_body_may_begin_with_a_byte_order_mark(daemon):
    body = b"\xef\xbb\xbf" + json.dumps(scene("bom")).encode()
    assert daemon.post("/v1/render", body,
                       headers={"Content-Type": "application/json"}
                       ).status == 200


def test_curls_default_type_is_accepted_without_an_origin(daemon):
    form = {"Content-Type": "application/x-www-form-urlencoded"}
    body = json.dumps(scene("curl")).encode()
    assert daemon.post("/v1/render", body, headers=form).status == 200
    own = dict(form, Origin=f"http://127.0.0.1:{daemon.port}")
    problem(daemon.post("/v1/render", body, headers=own), 415,
            "unsupported-media-type")
    problem(daemon.post("/v1/render", b" " + body, headers=form), 415,
            "unsupported-media-type")
