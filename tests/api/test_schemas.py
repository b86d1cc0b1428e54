"""The C reader and the JSON Schema accept and refuse the same documents.

The judge of the schemas is Debian's python3-jsonschema. What the reader
refuses falls in two kinds:

structural  one value is wrong by itself, or with the members beside it. The
            schema must refuse it too.
relational  only the whole document can tell. The schema must accept it; the
            list is closed, RELATIONAL and RELATIONAL_PLACES below:

  json.*                          about the text; a schema never sees it
  reference.*, name.duplicate     another entry of the document
  mesh.index_range                how many positions there are
  geometry.degenerate, camera.degenerate, transform.singular,
  transform.not_uniform           arithmetic between numbers
  integrator.material_unsupported, csg.open_operand   another object
  budget.*                        sums
  array.length of a mesh's normals and uvs            as many as positions
  number.too_large of a plane's equation, of a whole transform and of a named
  texture's color                 arithmetic, and who uses the texture

Four of these a schema can say in part, and then does: a scale of 0
(transform.singular), too many entries of a list (budget.list,
budget.triangles), the same tag or layer twice (name.duplicate).

Inside of a kind or member that is not built yet the reader may find other
faults first; the schema refuses the whole of it.
"""
import copy
import json
import os
import pathlib
import re
import subprocess

import jsonschema
import pytest

import mutations
from conftest import BUILD, SOURCE

SCHEMAS = SOURCE / "schemas"
EXAMPLES = sorted((SCHEMAS / "examples").glob("*.json"))
BAD = SCHEMAS / "examples" / "bad"
EXPECTED = json.loads((BAD / "expected.json").read_text())["documents"]
SEED = int(os.environ.get("GLINT_SEED", "2026"))

RELATIONAL = {
    "reference.unknown", "reference.cycle", "name.duplicate",
    "mesh.index_range", "geometry.degenerate", "camera.degenerate",
    "transform.singular", "transform.not_uniform",
    "integrator.material_unsupported", "csg.open_operand",
    "budget.bytes", "budget.objects", "budget.triangles", "budget.pixels",
    "budget.rays", "budget.depth", "budget.list", "budget.memory",
}
RELATIONAL_PLACES = [
    ("array.length", re.compile(r"/objects/.*/(normals|uvs)$")),
    ("number.too_large", re.compile(r"/objects/.*/(normal|offset)$")),
    ("number.too_large", re.compile(r"/transform$")),
    ("number.too_large", re.compile(r"/textures/\d+/color[01]?/\d+$")),
]
PARTLY_IN_SCHEMA = {"transform.singular", "budget.list", "budget.triangles",
                    "name.duplicate"}
NOT_YET_TYPES = {
    "thin_lens", "image", "path", "ao", "phong", "dielectric", "emissive",
    "conductor", "principled", "mix", "gradient", "stripes", "rings",
    "hexagon", "brick", "noise", "fbm", "turbulence", "marble", "wood",
    "spot", "disk", "cylinder", "cone", "capsule", "torus", "sdf", "instance",
    "csg",
}
NOT_YET_MEMBERS = {"time", "definitions", "assets", "near", "far", "crop",
                   "target_error", "asset", "bounce", "tonemap", "exposure",
                   "time_limit", "frames", "webhook"}


def validator(name):
    path = SCHEMAS / f"{name}.json"
    schema = json.loads(path.read_text())
    resolver = jsonschema.RefResolver(path.as_uri(), schema)
    return jsonschema.Draft202012Validator(schema, resolver=resolver)


def verdicts(reader, texts):
    """What the C reader says about each text."""
    texts = list(texts)
    sent = b"".join(b"%d\n%s" % (len(t), t) for t in texts)
    done = subprocess.run([str(BUILD / "tests" / reader)], input=sent,
                          stdout=subprocess.PIPE, check=True)
    lines = done.stdout.splitlines()
    assert len(lines) == len(texts)
    return [json.loads(line) for line in lines]


def is_relational(error):
    return (error["code"] in RELATIONAL or error["code"].startswith("json.")
            or any(error["code"] == code and place.search(error["pointer"])
                   for code, place in RELATIONAL_PLACES))


def is_not_yet(document, error):
    """Does the error lie inside of something that is not built yet?"""
    node = document
    for step in (error["pointer"] or "").split("/")[1:]:
        step = step.replace("~1", "/").replace("~0", "~")
        if isinstance(node, dict):
            if node.get("type") in NOT_YET_TYPES or step in NOT_YET_MEMBERS:
                return True
            node = node.get(step)
        elif isinstance(node, list) and step.isdigit() \
                and int(step) < len(node):
            node = node[int(step)]
        else:
            return False
    return isinstance(node, dict) and node.get("type") in NOT_YET_TYPES


def disagreement(document, verdict, accepted):
    """None, or what the two do not agree about."""
    if verdict["ok"]:
        return None if accepted else "the schema refuses it, the reader does not"
    if accepted:
        missed = [e for e in verdict["errors"] if not is_relational(e)]
        return f"the schema misses {missed}" if missed else None
    codes = {e["code"] for e in verdict["errors"]}
    if codes & PARTLY_IN_SCHEMA or verdict["truncated"]:
        return None
    if any(code.startswith("json.") for code in codes):
        return None  # the reader stopped before it
    if any(not is_relational(e) or is_not_yet(document, e)
           for e in verdict["errors"]):
        return None
    # At one of the places a structural error looks like a relational one.
    if codes & {code for code, _ in RELATIONAL_PLACES}:
        return None
    return f"the schema refuses it, the reader says only {sorted(codes)}"


def compare(name, reader, documents, least_accepted):
    judge = validator(name)
    documents = list(documents)
    found, accepted = [], 0
    for document, verdict in zip(
            documents, verdicts(reader, map(mutations.text, documents))):
        ok = judge.is_valid(document)
        accepted += verdict["ok"]
        what = disagreement(document, verdict, ok)
        if what:
            found.append((what, mutations.text(document).decode()))
    assert not found, "\n".join(
        f"{what}\n  {text[:2000]}" for what, text in found[:5])
    assert least_accepted <= accepted < len(documents)
    return len(documents)


# --- the schemas themselves


@pytest.mark.parametrize("name", ["scene", "job", "problem"])
def test_schema_is_one(name):
    schema = json.loads((SCHEMAS / f"{name}.json").read_text())
    jsonschema.Draft202012Validator.check_schema(schema)
    for example in schema["examples"]:
        validator(name).validate(example)


def members(schema, node=None, path=""):
    """(path, member schema) of everything an editor shows."""
    node = schema if node is None else node
    if isinstance(node, dict):
        for key, member in node.get("properties", {}).items():
            if isinstance(member, dict):
                yield f"{path}/properties/{key}", member
        for key, inner in node.items():
            if key not in ("examples", "default", "const", "enum"):
                yield from members(schema, inner, f"{path}/{key}")
    elif isinstance(node, list):
        for i, inner in enumerate(node):
            yield from members(schema, inner, f"{path}/{i}")


@pytest.mark.parametrize("name", ["scene", "job", "problem"])
def test_every_member_has_a_title(name):
    schema = json.loads((SCHEMAS / f"{name}.json").read_text())
    for path, member in members(schema):
        words, at = "", member
        while isinstance(at, dict):
            words = words or at.get("title", "")
            ref = at.get("$ref", "")
            at = schema["$defs"].get(ref.split("/")[-1]) if ref else None
        # A narrowed member repeats one that has its title elsewhere.
        narrowed = re.search("/(if|then|else)/", path)
        assert words or narrowed, path


@pytest.mark.parametrize("name", ["scene", "job"])
def test_defaults_and_examples_fit(name):
    """Each `default` and each of `examples` is accepted where it stands."""
    path = SCHEMAS / f"{name}.json"
    schema = json.loads(path.read_text())
    resolver = jsonschema.RefResolver(path.as_uri(), schema)
    count = 0
    for where, member in members(schema):
        judge = jsonschema.Draft202012Validator(member, resolver=resolver)
        for value in ([member["default"]] if "default" in member else []) \
                + member.get("examples", []):
            assert judge.is_valid(value), (where, value)
            count += 1
    assert count > 3


# --- examples


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda p: p.stem)
def test_example(path):
    text = path.read_bytes()
    validator("scene").validate(json.loads(text))
    assert verdicts("scene_verdicts", [text])[0]["ok"]
    job = {"scene": json.loads(text)}
    validator("job").validate(job)
    assert verdicts("job_verdicts", [mutations.text(job)])[0]["ok"]


def pointers(error):
    """Where the schema found something, as the reader would write it."""
    here = "".join(f"/{step}" for step in error.absolute_path)
    if error.validator == "additionalProperties":
        for key in error.instance:
            if key not in error.schema.get("properties", {}):
                yield f"{here}/{key}"
    yield here
    for inner in error.context:
        yield from pointers(inner)


@pytest.mark.parametrize("expected", EXPECTED, ids=lambda e: e["file"])
def test_bad_example(expected):
    text = (BAD / expected["file"]).read_bytes()
    verdict = verdicts("scene_verdicts", [text])[0]
    assert not verdict["ok"]
    said = [{k: e[k] for k in ("code", "pointer", "line", "column")}
            for e in verdict["errors"]]
    wanted = [{k: e[k] for k in ("code", "pointer", "line", "column")}
              for e in expected["errors"]]
    assert said == wanted
    if any(e["code"].startswith("json.") for e in verdict["errors"]):
        return  # outside of JSON Schema
    document = json.loads(text)
    structural = [e for e in verdict["errors"] if not is_relational(e)]
    found = list(validator("scene").iter_errors(document))
    assert bool(found) == bool(structural)
    where = {p for error in found for p in pointers(error)}
    for error in structural:
        if is_not_yet(document, error):
            continue
        parent = error["pointer"].rpartition("/")[0]
        assert error["pointer"] in where or (
            error["code"] == "property.conflict" and parent in where), error


# --- thousands


def test_everything_is_right():
    validator("scene").validate(mutations.EVERYTHING)
    verdict = verdicts("scene_verdicts",
                       [mutations.text(mutations.EVERYTHING)])[0]
    assert verdict["ok"], verdict


def test_every_place_every_value():
    """One scene with everything in it, one change at a time: a sixth of the
    21 000, another sixth for another seed, or all of them (GLINT_THOROUGH)."""
    documents = list(mutations.sweep(mutations.EVERYTHING))
    if not os.environ.get("GLINT_THOROUGH"):
        documents = documents[SEED % 6::6]
    assert compare("scene", "scene_verdicts", documents, 300) > 3000


def test_mutants_of_examples():
    editor = mutations.Editor(SEED)
    sources = [json.loads(p.read_text()) for p in EXAMPLES]
    for entry in EXPECTED:
        try:
            sources.append(json.loads((BAD / entry["file"]).read_text()))
        except ValueError:
            pass
    small = [s for s in sources if len(mutations.text(s)) < 2500]
    big = [s for s in sources if s not in small]
    documents = [editor.mutant(editor.random.choice(small))
                 for _ in range(1500)]
    documents += [editor.mutant(editor.random.choice(big))
                  for _ in range(700)]
    compare("scene", "scene_verdicts", documents, 150)


@pytest.mark.parametrize("flaw", [0, 0.01, 0.05])
def test_grammar(flaw):
    grammar = mutations.Grammar(f"{SEED} {flaw}", flaw)
    documents = [grammar.scene() for _ in range(700)]
    compare("scene", "scene_verdicts", documents, 20)


def test_nesting():
    """Groups in groups: the eighth is allowed, whatever the schema thinks of
    the ninth; behind depth 32 it is no document at all."""
    def nested(levels):
        one = {"type": "sphere"}
        for _ in range(levels):
            one = {"type": "group", "children": [one]}
        return {"objects": [one]}

    # A group takes two of the 32 levels of a document, and `objects` two.
    documents = [nested(n) for n in range(1, 20)]
    said = verdicts("scene_verdicts", map(mutations.text, documents))
    assert [v["ok"] for v in said[:8]] == [True] * 8
    codes = [[e["code"] for e in v["errors"]] for v in said[8:]]
    assert codes == [["budget.depth"]] * 6 + [["json.depth"]] * 5
    judge = validator("scene")
    assert all(judge.is_valid(document) for document in documents)


JOB = {
    "scene": {"objects": [{"type": "sphere"}]},
    "output": {"format": "exr", "layers": ["beauty", "depth"],
               "bit_depth": "half", "color_space": "linear"},
    "priority": "low", "tags": ["lecture4", "a.b"], "max_attempts": 2,
}


def jobs():
    png = copy.deepcopy(JOB)
    png["output"] = {"layers": ["normal"], "bit_depth": "uint16",
                     "color_space": "srgb"}
    named = {"scene": {"$example": "smallest"}, "output": {"format": "png"}}
    more = ["time_limit", "frames", "webhook", "exposure", "tonemap", "Tags"]
    for document in (JOB, png, named):
        yield document
        for path in mutations.places(document):
            value = mutations.at(document, path)
            for other in mutations.likely(value):
                yield mutations.put(document, path, other)
            if path and path != ("scene",):
                yield mutations.without(document, path)
            if isinstance(value, dict):
                for key in more:
                    yield mutations.put(document, path, {**value, key: 1})


def test_jobs():
    # A document without the member `scene` is a scene, not a job.
    documents = [d for d in jobs() if isinstance(d, dict) and "scene" in d]
    compare("job", "job_verdicts", documents, 40)


# --- the text, which no schema sees


@pytest.mark.parametrize("text,code", [
    (b'{"objects": [{"type": "sphere", "type": "box"}]}',
     "json.duplicate_key"),
    (b'{"objects": [{"type": "sphere", "radius": 1e999}]}',
     "json.number_range"),
    (b'{"objects": [{"type": "sphere", "radius": 01}]}', "json.syntax"),
    (b'{"objects": [{"type": "sphere", "radius": NaN}]}', "json.syntax"),
    (b'{"objects": [{"type": "sphere"}]} {}', "json.trailing_data"),
    (b'{"objects": [{"type": "sph\xffere"}]}', "json.utf8"),
    (b'{"objects": [{"type": "sphere\x01"}]}', "json.control_character"),
    (b"[" * 100000, "json.depth"),
    (b"", "json.syntax"),
    (b'{"objects": [{"type": "sphere"', "json.syntax"),
])
def test_text(text, code):
    verdict = verdicts("scene_verdicts", [text])[0]
    assert [e["code"] for e in verdict["errors"]] == [code]
