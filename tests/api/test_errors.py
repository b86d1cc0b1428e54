"""Bad input: each kind gets its documented problem, and the service goes on."""
import json
import socket
import time

import pytest

from conftest import SOURCE

BAD = SOURCE / "schemas" / "examples" / "bad"
EXPECTED = json.loads((BAD / "expected.json").read_text())["documents"]
SPHERE = {"objects": [{"type": "sphere"}]}
JSON = {"Content-Type": "application/json"}


def problem(reply, status, slug):
    assert reply.status == status, reply.body[:500]
    assert reply.headers["Content-Type"] == "application/problem+json"
    body = reply.json
    assert body["type"] == f"/problems/{slug}"
    assert body["status"] == status
    assert body["title"] and body["detail"]
    assert body["request_id"] == reply.headers["Request-Id"]
    assert body["instance"] == f"/v1/requests/{body['request_id']}"
    if status in (429, 503):
        assert reply.headers["Retry-After"]
    return body


@pytest.fixture(autouse=True)
def the_service_goes_on(daemon):
    pid = daemon.process.pid
    yield
    assert daemon.process.poll() is None and daemon.process.pid == pid
    assert daemon.get("/livez").status == 200


def post(daemon, text, path="/v1/render"):
    return daemon.post(path, text if isinstance(text, bytes)
                       else text.encode(), headers=JSON)


@pytest.mark.parametrize("document", EXPECTED, ids=lambda d: d["file"])
@pytest.mark.parametrize("path", ["/v1/render", "/v1/jobs"])
def test_bad_examples(daemon, document, path):
    reply = post(daemon, (BAD / document["file"]).read_bytes(), path)
    body = problem(reply, document["status"],
                   "json-syntax" if document["status"] == 400
                   else "scene-invalid")
    got = [(e["code"], e["pointer"], e["line"], e["column"])
           for e in body["errors"]]
    want = [(e["code"], e["pointer"], e["line"], e["column"])
            for e in document["errors"]]
    assert got == want
    for error, expected in zip(body["errors"], document["errors"]):
        for word in expected.get("hint_mentions", []):
            assert word in error["hint"]
        assert error["help"].endswith("#" + error["code"])


@pytest.mark.parametrize("document", [d for d in EXPECTED
                                      if d["status"] == 422],
                         ids=lambda d: d["file"])
def test_bad_examples_inside_a_job(daemon, document):
    text = '{"scene":\n' + (BAD / document["file"]).read_text() + "}"
    body = problem(post(daemon, text), 422, "scene-invalid")
    got = [(e["code"], e["pointer"], e["line"], e["column"])
           for e in body["errors"]]
    want = [(e["code"], "/scene" + e["pointer"], e["line"] + 1, e["column"])
            for e in document["errors"]]
    assert got == want


@pytest.mark.parametrize("text, code", [
    (b"", "json.syntax"),
    (b"   ", "json.syntax"),
    (b'{"objects": [{"type": "sphere"}]', "json.syntax"),
    (b'{"objects": [{"type": "sph', "json.syntax"),
    (b"{'objects': []}", "json.syntax"),
    (b'{"objects": [01]}', "json.syntax"),
    (b'{"objects": [1.]}', "json.syntax"),
    (b'{"objects": [NaN]}', "json.syntax"),
    (b'{"objects": [Infinity]}', "json.syntax"),
    (b'{"objects": []} x', "json.trailing_data"),
    (b'{"a": 1, "a": 2}', "json.duplicate_key"),
    (b'{"a": 1, "\\u0061": 2}', "json.duplicate_key"),
    (b'{"a": 1e999}', "json.number_range"),
    (b'{"a": -1e999}', "json.number_range"),
    (b"[" * 33 + b"]" * 33, "json.depth"),
    (b"[" * 1000 + b"]" * 1000, "json.depth"),
    (b"[" * 100000 + b"]" * 100000, "json.depth"),
    (b'{"a":' * 100000, "json.depth"),
    (b'{"a": "\xff"}', "json.utf8"),
    (b'{"a": "\xc3"}', "json.utf8"),
    (b'{"a": "\n"}', "json.control_character"),
])
def test_strict_json(daemon, text, code):
    body = problem(post(daemon, text), 400, "json-syntax")
    assert [e["code"] for e in body["errors"]] == [code]
    lines = body["excerpt"].split("\n")
    assert len(lines) == 2 and lines[1].strip() == "^"
    assert body["line"] == body["errors"][0]["line"]
    assert body["column"] == body["errors"][0]["column"]
    assert 0 <= body["offset"] <= len(text)


def test_syntax_place(daemon):
    body = problem(post(daemon, '{\n  "ä": "ö", ]\n}'), 400, "json-syntax")
    assert (body["line"], body["column"]) == (2, 13)
    assert body["excerpt"] == '  "ä": "ö", ]\n            ^'
    assert body["offset"] == len('{\n  "ä": "ö", '.encode())


@pytest.mark.parametrize("change, code", [
    ({"film": {"width": 0, "height": 10}}, "number.too_small"),
    ({"film": {"width": -5, "height": 10}}, "number.too_small"),
    ({"film": {"width": 1.5, "height": 10}}, "number.not_integer"),
    ({"film": {"width": 2 ** 31, "height": 2 ** 31}}, "number.too_large"),
    ({"film": {"width": 1e308, "height": 1e308}}, "number.too_large"),
    ({"objects": []}, "array.length"),
    ({"objects": [{"type": "sphere", "radius": -1}]}, "number.too_small"),
    ({"objects": [{"type": "sphere", "radius": 1e-300}]}, "number.too_small"),
    ({"objects": [{"type": "sphere", "radius": "NaN"}]}, "type.mismatch"),
    ({"objects": [{"type": "sphere", "center": [1e300, 0, 0]}]},
     "number.too_large"),
    ({"objects": [{"type": "sphere", "colour": 1}]}, "property.unknown"),
    ({"camera": {"fov": 0}}, "number.too_small"),
    ({"camera": {"fov": 180}}, "number.too_large"),
    ({"camera": {"eye": [0, 0, 0], "target": [0, 0, 0]}}, "camera.degenerate"),
    ({"camera": {"eye": [0, 5, 0], "up": [0, 1, 0]}}, "camera.degenerate"),
    ({"integrator": {"type": "whitted", "max_bounces": 2 ** 31}},
     "number.too_large"),
    ({"objects": [{"type": "mesh", "positions": [[0, 0, 0], [1, 0, 0],
                                                 [0, 1, 0]],
                   "indices": [[0, 1, 3]]}]}, "mesh.index_range"),
    ({"objects": [{"type": "mesh", "positions": [[0, 0, 0], [1, 0, 0],
                                                 [0, 1, 0]],
                   "indices": [[0, 1, -1]]}]}, "number.too_small"),
    ({"objects": [{"type": "../../etc/passwd"}]}, "enum.unknown"),
    ({"tmie": 1}, "property.unknown"),
])
def test_wrong_scenes(daemon, change, code):
    reply = daemon.post("/v1/render", dict(SPHERE, **change))
    body = problem(reply, 422, "scene-invalid")
    assert code in [e["code"] for e in body["errors"]]
    assert all(e["line"] >= 1 and e["column"] >= 1 for e in body["errors"])
    # validate says the same, as an answer and not as a failure.
    check = daemon.post("/v1/scenes/validate", dict(SPHERE, **change))
    assert check.status == 200
    assert check.json["valid"] is False
    assert check.json["errors"] == body["errors"]


@pytest.mark.parametrize("document", ["[]", "3", '"x"', "null", "{}",
                                      '{"scene": 3}', '{"scene": {}}',
                                      '{"scene": []}'])
def test_documents_of_another_shape(daemon, document):
    body = problem(post(daemon, document), 422, "scene-invalid")
    assert body["errors"][0]["code"] in ("type.mismatch", "property.missing")


def test_a_thousand_million_pixels(daemon):
    reply = daemon.post("/v1/render", dict(
        SPHERE, film={"width": 8192, "height": 8192}))
    body = problem(reply, 422, "budget-exceeded")
    assert body["requested"]["pixels"] == 8192 * 8192
    assert body["allowed"]["pixels"] == 16777216
    fit = body["fits"][0]
    assert fit["/film/width"] * fit["/film/height"] <= 16777216
    ok = dict(SPHERE, film={"width": fit["/film/width"],
                            "height": fit["/film/height"]})
    assert daemon.post("/v1/scenes/validate", ok).json["valid"] is True
    huge = dict(SPHERE, film={"width": 31623, "height": 31623})
    reply = daemon.post("/v1/render", huge)
    assert reply.status == 422
    assert reply.json["type"] in ("/problems/budget-exceeded",
                                  "/problems/scene-invalid")


def test_too_many_rays_and_what_would_fit(daemon):
    scene = dict(SPHERE, film={"width": 4000, "height": 4000},
                 sampler={"type": "sobol", "spp": 65536})
    body = problem(daemon.post("/v1/jobs", {"scene": scene}), 422,
                   "budget-exceeded")
    assert body["requested"]["rays"] > body["allowed"]["rays"]
    assert body["fits"]
    assert [e["code"] for e in body["errors"]] == ["budget.rays"]
    for fit in body["fits"]:
        changed = json.loads(json.dumps(scene))
        for pointer, value in fit.items():
            _, root, part, member = pointer.split("/")
            assert root == "scene"
            changed.setdefault(part, {})[member] = value
        check = daemon.post("/v1/scenes/validate", changed).json
        assert check["valid"], (fit, check["errors"])


def test_all_errors_of_job_and_scene_at_once(daemon):
    text = """{"priorita": "low",
 "scene": {"objects": [{"type": "sphere", "radius": -1}]},
 "max_attempts": 0,
 "time_limit": 5}"""
    body = problem(post(daemon, text, "/v1/jobs"), 422, "job-invalid")
    assert [(e["code"], e["pointer"], e["line"]) for e in body["errors"]] == [
        ("property.unknown", "/priorita", 1),
        ("number.too_small", "/scene/objects/0/radius", 2),
        ("number.too_small", "/max_attempts", 3),
        ("property.not_yet", "/time_limit", 4)]
    assert body["errors"][0]["fix"] == [
        {"op": "move", "from": "/priorita", "path": "/priority"}]


def test_at_most_fifty_errors(daemon):
    scene = {"objects": [{"type": "sphere", "radius": -1}] * 60}
    body = problem(daemon.post("/v1/render", scene), 422, "scene-invalid")
    assert len(body["errors"]) == 50
    assert body["errors_truncated"] is True


def test_unknown_example(daemon):
    body = problem(daemon.post("/v1/render",
                               {"scene": {"$example": "smalest"}}),
                   422, "scene-invalid")
    assert body["errors"][0]["code"] == "reference.unknown"
    assert body["errors"][0]["fix"][0]["value"] == "smallest"


def test_not_yet_is_never_ignored(daemon):
    for member in ({"frames": {"from": 0, "to": 1, "count": 2}},
                   {"webhook": "hook_1"}, {"time_limit": 1}):
        body = problem(daemon.post("/v1/jobs", dict(scene=SPHERE, **member)),
                       422, "job-invalid")
        assert body["errors"][0]["code"] == "property.not_yet"
    body = problem(daemon.post("/v1/jobs", {
        "scene": SPHERE, "output": {"format": "jpeg"}}), 422, "job-invalid")
    assert body["errors"][0]["code"] == "enum.not_yet"


def test_a_body_over_the_limit(daemon):
    body = b'{"objects": [' + b" " * (10 << 20) + b"]}"
    with socket.create_connection(("127.0.0.1", daemon.port)) as client:
        client.sendall(b"POST /v1/render HTTP/1.1\r\nHost: localhost\r\n"
                       b"Content-Type: application/json\r\n"
                       b"Content-Length: %d\r\n\r\n" % len(body))
        try:
            client.sendall(body)
        except OSError:
            pass  # answered and closed while we were still sending
        client.settimeout(10)
        text = b""
        try:
            while chunk := client.recv(65536):
                text += chunk
        except OSError:
            pass
    head, _, rest = text.partition(b"\r\n\r\n")
    assert head.startswith(b"HTTP/1.1 413 "), text[:200]
    assert b"application/problem+json" in head
    answer = json.loads(rest)
    assert answer["type"] == "/problems/too-large"
    assert answer["limit"] == 1 << 20
    assert "1048576" in answer["detail"]


def test_a_body_just_within_the_limit(daemon):
    text = json.dumps(SPHERE)
    padded = text + " " * ((1 << 20) - len(text))
    assert post(daemon, padded, "/v1/scenes/validate").status == 200
    problem(post(daemon, padded + " ", "/v1/scenes/validate"), 413,
            "too-large")


@pytest.mark.parametrize("method, path, allow", [
    ("GET", "/v1/render", "POST"),
    ("PUT", "/v1/jobs", "POST, GET, HEAD"),
    ("PATCH", "/v1/jobs/job_0", "GET, HEAD, DELETE"),
    ("POST", "/livez", "GET, HEAD"),
    ("OPTIONS", "/v1/render", "POST"),
    ("DELETE", "/", "GET, HEAD, POST"),
])
def test_wrong_method(daemon, method, path, allow):
    reply = daemon.request(method, path)
    problem(reply, 405, "method-not-allowed")
    assert reply.headers["Allow"] == allow


@pytest.mark.parametrize("path", ["/v2/render", "/v1", "/v1/jobs/", "/v1/render/",
                                  "/etc/passwd", "/..%2f..%2fetc%2fpasswd",
                                  "/schemas/..%2f..%2fCMakeLists.txt",
                                  "/problems/nothing", "/schemas/x.json",
                                  "/v1/scenes/examples/nothing",
                                  "/v1/scenes/examples/bad%2f01-trailing-comma"])
def test_unknown_paths(daemon, path):
    problem(daemon.get(path), 404, "not-found")


def test_did_you_mean_for_paths(daemon):
    body = problem(daemon.get("/v1/rendr"), 404, "not-found")
    assert "/v1/render?" in body["detail"]


@pytest.mark.parametrize("kind", ["text/plain", "application/xml",
                                  "application/jsonp", "multipart/form-data",
                                  "application/x-www-form-urlencoded", None])
@pytest.mark.parametrize("path", ["/v1/render", "/v1/jobs",
                                  "/v1/scenes/validate"])
def test_wrong_media_type(daemon, kind, path):
    with socket.create_connection(("127.0.0.1", daemon.port)) as client:
        head = f"Content-Type: {kind}\r\n" if kind else ""
        client.sendall(f"POST {path} HTTP/1.1\r\nHost: localhost\r\n{head}"
                       "Connection: close\r\n"
                       "Content-Length: 2\r\n\r\n[]".encode())
        text = b""
        while chunk := client.recv(65536):
            text += chunk
    assert text.startswith(b"HTTP/1.1 415 "), text
    assert json.loads(text.partition(b"\r\n\r\n")[2])["type"] == \
        "/problems/unsupported-media-type"


def test_media_type_with_parameters(daemon):
    reply = daemon.post("/v1/scenes/validate", json.dumps(SPHERE).encode(),
                        headers={"Content-Type":
                                 "application/json; charset=utf-8"})
    assert reply.status == 200


def test_compressed_bodies_are_refused(daemon):
    reply = daemon.post("/v1/render", b"\x1f\x8b", headers=dict(
        JSON, **{"Content-Encoding": "gzip"}))
    problem(reply, 415, "unsupported-media-type")


@pytest.mark.parametrize("path", ["/v1/render?formats=exr", "/version?x=1",
                                  "/v1/scenes/validate?lint=2",
                                  "/v1/scenes/validate?lint=0&lint=0"])
def test_query_parameters_are_strict(daemon, path):
    method = "GET" if path.startswith("/version") else "POST"
    reply = daemon.request(method, path,
                           SPHERE if method == "POST" else None)
    problem(reply, 400, "request-malformed")


def test_lines_lost_by_curl(daemon):
    text = json.dumps({"objects": [{"type": "sphere", "colour": "#ff0000",
                                    "name": "a-long-enough-document" * 4}]})
    form = {"Content-Type": "application/x-www-form-urlencoded"}
    body = problem(daemon.post("/v1/render", text.encode(), headers=form),
                   422, "scene-invalid")
    assert "--data-binary" in body["errors"][0]["hint"]
    body = problem(post(daemon, text), 422, "scene-invalid")
    assert "--data-binary" not in body["errors"][0]["hint"]


@pytest.mark.parametrize("host", ["example.org", "127.0.0.1.example.org",
                                  "localhost.evil.test:80", "10.0.0.1"])
def test_hosts_of_others(daemon, host):
    problem(daemon.get("/v1/jobs", headers={"Host": host}), 403,
            "origin-rejected")


@pytest.mark.parametrize("host", ["localhost", "127.0.0.1:9", "[::1]:80"])
def test_own_hosts(daemon, host):
    assert daemon.get("/v1/jobs", headers={"Host": host}).status == 200


@pytest.mark.parametrize("origin", ["http://example.org", "null",
                                    "https://127.0.0.1.evil.test"])
def test_pages_of_others(daemon, origin):
    reply = daemon.post("/v1/render", SPHERE, headers={"Origin": origin})
    problem(reply, 403, "origin-rejected")
    assert not [name for name in reply.headers
                if name.lower().startswith("access-control")]


def test_own_page(daemon):
    own = {"Origin": f"http://127.0.0.1:{daemon.port}"}
    reply = daemon.post("/v1/scenes/validate", SPHERE, headers=own)
    assert reply.status == 200
    assert not [name for name in reply.headers
                if name.lower().startswith("access-control")]


@pytest.mark.parametrize("half", [
    b"POST /v1/render HTTP/1.1\r\nHost: localhost\r\nContent-Le",
    b"POST /v1/render HTTP/1.1\r\nHost: localhost\r\nContent-Type: "
    b"application/json\r\nContent-Length: 100\r\n\r\n{\"objects\"",
    b"P",
])
def test_half_a_request_and_a_hang_up(daemon, half):
    before = len(daemon.get("/v1/jobs?limit=200").json["jobs"])
    with socket.create_connection(("127.0.0.1", daemon.port)) as client:
        client.sendall(half)
        time.sleep(0.1)
    assert len(daemon.get("/v1/jobs?limit=200").json["jobs"]) == before


def test_half_a_request_then_silence(daemon):
    """Silence costs nobody else anything, and ends after 30 s."""
    silent = [socket.create_connection(("127.0.0.1", daemon.port))
              for _ in range(3)]
    try:
        started = time.monotonic()
        silent[0].sendall(b"POST /v1/render HTTP/1.1\r\nHost: loc")
        silent[1].sendall(b"POST /v1/render HTTP/1.1\r\nHost: localhost\r\n"
                          b"Content-Type: application/json\r\n"
                          b"Content-Length: 50\r\n\r\n{")
        asked = time.monotonic()
        assert daemon.post("/v1/render", SPHERE).status == 200
        assert time.monotonic() - asked < 10
        for client in silent:
            client.settimeout(40)
            while client.recv(4096):
                pass
        assert 20 < time.monotonic() - started < 40
    finally:
        for client in silent:
            client.close()
