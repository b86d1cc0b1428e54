"""What glintd serves by itself: descriptions, examples, help, the page."""
import html
import json
import re
import urllib.parse

import pytest

from conftest import SOURCE, example

SLUGS = sorted(p.stem for p in (SOURCE / "docs" / "problems").glob("*.md"))
EXAMPLES = sorted(p.stem for p in
                  (SOURCE / "schemas" / "examples").glob("*.json"))


def slugs_of_the_program():
    table = (SOURCE / "server" / "api" / "problem.h").read_text()
    return sorted(re.findall(r'X\(PROBLEM_\w+, \d+, "([a-z-]+)"', table))


def codes_of_the_program():
    table = (SOURCE / "core" / "base" / "error.h").read_text()
    return re.findall(r'X\(ERROR_\w+, "([a-z_.]+)"\)', table)


@pytest.mark.parametrize("path, kind", [
    ("/openapi.json", "application/json"),
    ("/schemas/scene.json", "application/schema+json"),
    ("/schemas/job.json", "application/schema+json"),
    ("/schemas/problem.json", "application/schema+json"),
    ("/v1/scenes/examples", "application/json"),
    ("/v1/scenes/examples/smallest", "application/json"),
    ("/style.css", "text/css; charset=utf-8"),
])
def test_files_have_a_type_and_a_tag(daemon, path, kind):
    reply = daemon.get(path)
    assert reply.status == 200, reply.body
    assert reply.headers["Content-Type"] == kind
    assert reply.headers["X-Content-Type-Options"] == "nosniff"
    assert reply.headers["Request-Id"].startswith("req_")
    same = daemon.get(path, headers={"If-None-Match": reply.headers["ETag"]})
    assert (same.status, same.body) == (304, b"")
    head = daemon.request("HEAD", path)
    assert (head.status, head.body) == (200, b"")
    assert int(head.headers["Content-Length"]) == len(reply.body)


@pytest.mark.parametrize("name", ["scene", "job", "problem"])
def test_schemas_are_the_files(daemon, name):
    assert daemon.get(f"/schemas/{name}.json").body == (
        SOURCE / "schemas" / f"{name}.json").read_bytes()


def test_examples(daemon):
    listed = daemon.get("/v1/scenes/examples").json["examples"]
    assert sorted(e["name"] for e in listed) == EXAMPLES
    for entry in listed:
        assert entry["title"]
        assert entry["thumbnail"] is None
        assert daemon.get(entry["links"]["self"]).json == \
            example(entry["name"])


@pytest.mark.parametrize("name", EXAMPLES)
def test_every_example_is_valid(daemon, name):
    check = daemon.post("/v1/scenes/validate", {"scene": {"$example": name}})
    assert check.status == 200
    body = check.json
    assert body["valid"] is True, body["errors"]
    assert body["lint"] == "done"
    assert re.fullmatch("sha256:[0-9a-f]{64}", body["scene_hash"])
    assert sum(body["summary"]["objects"].values()) >= 1
    assert body["estimate"]["rays"] > 0
    assert body["estimate"]["fits_sync"] in (True, False)


def test_validate_without_lint(daemon):
    body = daemon.post("/v1/scenes/validate?lint=0",
                       example("smallest")).json
    assert (body["valid"], body["lint"]) == (True, "skipped")
    assert body["warnings"] == []


def test_validate_names_likely_mistakes(daemon):
    body = daemon.post("/v1/scenes/validate", example("smallest")).json
    assert "lights.default_used" in [w["code"] for w in body["warnings"]]


def test_validate_does_not_store(daemon):
    before = daemon.get("/v1/jobs").json
    daemon.post("/v1/scenes/validate", example("smallest"))
    assert daemon.get("/v1/jobs").json == before


def test_every_slug_has_a_page():
    assert slugs_of_the_program() == SLUGS


@pytest.mark.parametrize("slug", SLUGS)
def test_help_pages(daemon, slug):
    reply = daemon.get(f"/problems/{slug}")
    assert reply.status == 200
    assert reply.headers["Content-Type"] == "text/html; charset=utf-8"
    assert reply.headers["X-Content-Type-Options"] == "nosniff"
    policy = reply.headers["Content-Security-Policy"]
    assert "default-src 'self'" in policy
    assert "frame-ancestors 'none'" in policy
    page = reply.body.decode()
    assert page.index('<section lang="en">') < page.index('<section lang="de">')
    assert page.count("<h1>") == 2
    assert slug in page
    german = daemon.get(f"/problems/{slug}?lang=de").body.decode()
    assert german.index('lang="de">\n<h1>') < german.index('lang="en">\n<h1>')
    by_header = daemon.get(f"/problems/{slug}",
                           headers={"Accept-Language": "de-AT, en;q=0.5"})
    assert by_header.headers["Content-Language"] == "de"
    text = daemon.get(f"/problems/{slug}", headers={"Accept": "text/plain"})
    assert text.headers["Content-Type"] == "text/plain; charset=utf-8"
    assert text.body == (SOURCE / "docs" / "problems" / f"{slug}.md"
                         ).read_bytes()
    assert daemon.get(f"/problems/{slug}",
                      headers={"Accept": "image/png"}).status == 406
    for page in (page, german):
        ids = re.findall(r' id="([^"]+)"', page)
        assert len(ids) == len(set(ids))


def test_links_of_the_help_pages_lead_somewhere(daemon):
    targets = set()
    for slug in SLUGS:
        page = daemon.get(f"/problems/{slug}").body.decode()
        targets |= {html.unescape(t) for t in
                    re.findall(r'href="([^"]+)"', page)}
    for target in targets:
        assert daemon.get(target).status == 200, target


def test_every_code_has_its_anchor(daemon):
    """Documents' codes: those with a dot."""
    scene = daemon.get("/problems/scene-invalid").body.decode()
    syntax = daemon.get("/problems/json-syntax").body.decode()
    for code in codes_of_the_program():
        if "." in code:
            page = syntax if code.startswith("json.") else scene
            assert f'id="{code}"' in page, code


# --- the page with the form ---

def form(daemon, text, lang="en"):
    body = urllib.parse.urlencode({"scene": text}).encode()
    return daemon.post(f"/?lang={lang}", body, headers={
        "Content-Type": "application/x-www-form-urlencoded",
        "Origin": f"http://127.0.0.1:{daemon.port}",
        "Accept": "text/html"})


def textarea(page):
    return html.unescape(re.search(r"<textarea[^>]*>\n(.*)</textarea>", page,
                                   re.S).group(1))


def test_the_page_opens_with_a_scene(daemon):
    reply = daemon.get("/")
    assert reply.status == 200
    assert reply.headers["Content-Type"] == "text/html; charset=utf-8"
    assert "form-action 'self'" in reply.headers["Content-Security-Policy"]
    page = reply.body.decode()
    assert "{{" not in page
    assert page.count("<h1>") == 1
    assert "<script" not in page
    assert '<label for="scene">' in page
    assert json.loads(textarea(page)) == example("course-table-fresnel")
    for link in re.findall(r'href="([^"]+)"', page):
        assert daemon.get(html.unescape(link)).status == 200, link


def test_the_page_in_german(daemon):
    for reply in (daemon.get("/?lang=de"),
                  daemon.get("/", headers={"Accept-Language": "de"})):
        assert reply.headers["Content-Language"] == "de"
        assert '<html lang="de">' in reply.body.decode()
    problem = form(daemon, '{"objects": [3]}', "de").body.decode()
    assert "Zeile 1, Spalte 14" in problem


def test_the_form_renders(daemon):
    scene = '{"name": "a & b",\r\n "film": {"width": 40, "height": 30},\r\n' \
            ' "objects": [{"type": "sphere"}]}'
    for _ in range(2):  # rendered, then from the cache
        reply = form(daemon, scene)
        assert reply.status == 200, reply.body
        assert reply.headers["Content-Type"] == "text/html; charset=utf-8"
        page = reply.body.decode()
        assert textarea(page) == scene
        source = re.search(r'<img src="([^"]+)"', page).group(1)
        image = daemon.get(html.unescape(source))
        assert image.status == 200
        assert image.body[:8] == b"\x89PNG\r\n\x1a\n"


def test_the_form_shows_errors_and_keeps_the_text(daemon):
    scene = '{"objects": [{"type": "sphere", "colour": "<script>"}]}'
    reply = form(daemon, scene)
    assert reply.status == 422
    page = reply.body.decode()
    assert "property.unknown" in page
    assert 'role="alert"' in page
    assert "<script>" not in page
    assert textarea(page) == scene
    assert form(daemon, "{").status == 400
    assert form(daemon, "").status == 400


def test_the_form_takes_nothing_else(daemon):
    kind = {"Content-Type": "application/x-www-form-urlencoded"}
    assert daemon.post("/", b"scene=%7B&x=1", headers=kind).status == 400
    assert daemon.post("/", b"other=1", headers=kind).status == 400
    assert daemon.post("/", b"{}").status == 415
    assert daemon.post("/", b"scene=%7B", headers=dict(
        kind, Origin="http://example.org")).status == 403
    big = b"scene=" + b"%20" * ((1 << 20) + 1)
    assert daemon.post("/", big, headers=kind).status == 413


# --- health ---

def test_health(daemon):
    for path in ("/livez", "/readyz"):
        reply = daemon.get(path)
        assert (reply.status, reply.body) == (200, b"ok\n")
        assert reply.headers["Content-Type"] == "text/plain; charset=utf-8"
        verbose = daemon.get(path + "?verbose").body.decode()
        assert verbose.startswith("[+] ") and verbose.endswith("ok\n")
    text = daemon.get("/readyz?verbose").body.decode()
    for name in ("draining", "store", "disk", "workers"):
        assert f"[+] {name}: " in text


def test_version(daemon):
    body = daemon.get("/version").json
    assert body["version"] == body["core_version"] == "0.1.0"
    assert re.fullmatch("[0-9a-f]{64}", body["build"])
    assert re.search("x86-64-v[1-4]|other", body["isa"])
    assert body["store"].startswith("sqlite 3.")
