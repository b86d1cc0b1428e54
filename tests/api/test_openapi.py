"""/openapi.json against the program: same routes, and answers that fit."""
import json
import re

import jsonschema
import pytest

from conftest import SOURCE

DOCUMENT = json.loads((SOURCE / "schemas" / "openapi.json").read_text())
METHODS = ("get", "post", "put", "delete", "patch")
SPHERE = {"film": {"width": 32, "height": 24}, "objects": [{"type": "sphere"}]}


def rows():
    """(method, path, query parameters) of every row of routes.c."""
    text = (SOURCE / "server" / "api" / "routes.c").read_text()
    table = text[text.index("const struct route routes[]"):]
    table = table[:table.index("};")]
    found = re.findall(r'\{"([A-Z]+)",\s*"([^"]+)",\s*"([^"]*)"', table)
    assert len(found) > 10
    return [(m.lower(), p, set(q.split())) for m, p, q in found]


def operations():
    for path, item in DOCUMENT["paths"].items():
        for method in METHODS:
            if method in item:
                yield method, path, item[method], item.get("parameters", [])


def resolve(node):
    while "$ref" in node and node["$ref"].startswith("#/"):
        target = DOCUMENT
        for part in node["$ref"][2:].split("/"):
            target = target[part]
        node = target
    return node


def test_the_description_has_the_rows_and_no_others():
    assert {(m, p) for m, p, _, _ in operations()} == \
        {(m, p) for m, p, _ in rows()}


def test_the_description_has_the_query_parameters():
    table = {(m, p): q for m, p, q in rows()}
    for method, path, operation, shared in operations():
        names = {resolve(p)["name"]
                 for p in operation.get("parameters", []) + shared
                 if resolve(p)["in"] == "query"}
        assert names == table[method, path], (method, path)


def test_path_parameters_are_described():
    for _, path, operation, shared in operations():
        names = {resolve(p)["name"]
                 for p in operation.get("parameters", []) + shared
                 if resolve(p)["in"] == "path"}
        assert names == set(re.findall(r"\{(\w+)\}", path))


def test_operations_have_names_and_summaries():
    ids = [o["operationId"] for _, _, o, _ in operations()]
    assert len(ids) == len(set(ids))
    for _, _, operation, _ in operations():
        assert operation["summary"]


def test_references_lead_somewhere():
    for target in set(re.findall(r'"\$ref": "(#[^"]+)"',
                                 json.dumps(DOCUMENT))):
        resolve({"$ref": target})


def test_slugs_in_the_description_exist():
    described = set()
    for found in re.findall(r'"description": "[^"]*\(([a-z, -]+)\)"',
                            json.dumps(DOCUMENT)):
        described |= {s.strip() for s in found.split(",")}
    pages = {p.stem for p in (SOURCE / "docs" / "problems").glob("*.md")}
    # method-not-allowed and not-implemented need no operation.
    assert pages - described == {"method-not-allowed", "not-implemented"}
    assert described - pages == set()


def checker(schema):
    """A validator in which #/components and /schemas/*.json are known."""
    store = {f"/schemas/{n}.json":
             json.loads((SOURCE / "schemas" / f"{n}.json").read_text())
             for n in ("scene", "job", "problem")}
    resolver = jsonschema.RefResolver("", DOCUMENT, store=store)
    return jsonschema.Draft202012Validator(schema, resolver=resolver)


def check_answer(method, path, reply):
    """The answer has a described status, type and shape."""
    operation = DOCUMENT["paths"][path][method]
    described = operation["responses"]
    assert str(reply.status) in described, (method, path, reply.status,
                                            reply.body[:300])
    response = resolve(described[str(reply.status)])
    if not reply.body:
        return
    kind = reply.headers["Content-Type"].split(";")[0]
    assert kind in response["content"], (method, path, kind)
    if kind.endswith("json") and kind != "application/schema+json":
        schema = response["content"][kind]["schema"]
        errors = [f"{list(e.absolute_path)}: {e.message[:200]}"
                  for e in checker(schema).iter_errors(reply.json)]
        assert not errors, (method, path, errors[:5])


@pytest.fixture(scope="module")
def done(daemon):
    job = daemon.post("/v1/jobs", SPHERE).json["id"]
    daemon.wait_for(job)
    return job


def fill(path, done):
    return (path.replace("/v1/jobs/{id}", f"/v1/jobs/{done}")
            .replace("{slug}", "scene-invalid")
            .replace("/schemas/{name}", "/schemas/scene.json")
            .replace("{name}", "smallest"))


@pytest.mark.parametrize("method, path", [
    (m, p) for m, p, _, _ in operations() if m != "delete"])
def test_every_operation_answers_as_described(daemon, done, method, path):
    url = fill(path, done)
    if method == "post":
        cases = [SPHERE, {"scene": SPHERE}, {"objects": []}, b"{", b"",
                 {"scene": SPHERE, "prioritee": 1},
                 dict(SPHERE, film={"width": 8192, "height": 8192})]
        for body in cases:
            check_answer(method, path, daemon.post(url, body))
            check_answer(method, path, daemon.post(url, body, headers={
                "Content-Type": "application/x-www-form-urlencoded"}))
        check_answer(method, path, daemon.post(
            url, b"x", headers={"Content-Type": "text/plain"}))
        check_answer(method, path, daemon.post(
            url, SPHERE, headers={"Origin": "http://example.org"}))
    else:
        reply = daemon.get(url)
        assert reply.status == 200, reply.body
        check_answer(method, path, reply)
        check_answer(method, path, daemon.get(url + "?nothing=1"))
        check_answer(method, path, daemon.get(url, headers={"Host": "x.org"}))
        if reply.headers["ETag"]:
            again = daemon.get(url, headers={
                "If-None-Match": reply.headers["ETag"]})
            assert again.status == 304
            check_answer(method, path, again)
    missing = fill(path, "job_00000000000000000000000000")
    if missing != url and "{id}" in path:
        check_answer(method, path, daemon.request(
            method.upper(), missing, b"" if method == "post" else None))


def test_other_answers_fit_too(daemon):
    reply = daemon.post("/v1/render", dict(SPHERE, name="fit"),
                        headers={"Accept": "application/json"})
    check_answer("post", "/v1/render", reply)
    reply = daemon.post("/v1/render", dict(SPHERE, name="fit-2"),
                        headers={"Prefer": "respond-async"})
    assert reply.status == 202
    check_answer("post", "/v1/render", reply)
    job = reply.json["id"]
    daemon.wait_for(job)
    check_answer("post", "/v1/render", daemon.post(
        "/v1/render", SPHERE, headers={"Accept": "text/csv"}))
    for query in ("?layer=depth", "?format=exr", "?format=x"):
        check_answer("get", "/v1/jobs/{id}/result",
                     daemon.get(f"/v1/jobs/{job}/result{query}"))
    for query in ("?dry_run=1", "", ""):
        check_answer("delete", "/v1/jobs/{id}",
                     daemon.request("DELETE", f"/v1/jobs/{job}{query}"))


def test_examples_of_the_description_work(daemon):
    body = DOCUMENT["paths"]["/v1/render"]["post"]["requestBody"]
    for case in body["content"]["application/json"]["examples"].values():
        reply = daemon.post("/v1/scenes/validate", case["value"])
        assert reply.json["valid"] is True, reply.json


def test_the_description_is_served(daemon):
    assert daemon.get("/openapi.json").json == DOCUMENT
