"""glint lint: every error at once, each at its place in the user's file."""
import json
import pathlib
import re

import pytest

from cli import EXAMPLES, files, glint

BAD = EXAMPLES / "bad"
EXPECTED = json.loads((BAD / "expected.json").read_text())["documents"]


def test_the_output_looks_as_documented(tmp_path):
    (tmp_path / "mine.json").write_text(
        '{\n  "objects": [\n    {"type": "sphere",\n'
        '     "radius": -1},\n    {"type": "sphere", "centre": [0, 0, 0]}\n'
        '  ]\n}\n')
    run = glint("lint", "mine.json", cwd=tmp_path)
    assert run.returncode == 1 and run.stderr == b""
    text = run.stdout.decode()
    assert re.fullmatch(
        r"mine\.json:4:16: error: /objects/0/radius must be .*, got -1  "
        r"\[number\.too_small\]\n"
        r'    4 \|      "radius": -1\},\n'
        r"      \|                \^\^\n"
        r"(   help: .*\n)?"
        r"mine\.json:5:24: error: unknown property .centre., did you mean "
        r".center.\?  \[property\.unknown\]\n"
        r'    5 \|     \{"type": "sphere", "centre": \[0, 0, 0\]\}\n'
        r"      \|                        \^{8}\n"
        r"(   help: .*\n)?"
        r"1 file, 2 errors, 0 warnings\n", text), text


@pytest.mark.parametrize("row", EXPECTED, ids=lambda row: row["file"])
def test_every_bad_example_is_refused_at_its_places(row):
    run = glint("lint", BAD / row["file"])
    assert run.returncode == 1
    found = re.findall(r"^\S+\.json:(\d+):(\d+): error: .*  \[(\S+)\]$",
                       run.stdout.decode(), re.M)
    assert found == [(str(e["line"]), str(e["column"]), e["code"])
                     for e in row["errors"]]


@pytest.mark.parametrize("row", EXPECTED, ids=lambda row: row["file"])
def test_json_output_is_a_problem_body(row):
    run = glint("lint", "--json", BAD / row["file"])
    assert run.returncode == 1
    body = json.loads(run.stdout)
    assert body["valid"] is False and body["status"] == row["status"]
    assert body["type"] == ("/problems/json-syntax" if row["status"] == 400
                            else "/problems/scene-invalid")
    assert [{k: e[k] for k in ("code", "pointer", "line", "column")}
            for e in body["errors"]] == [
        {k: e[k] for k in ("code", "pointer", "line", "column")}
        for e in row["errors"]]
    for told, wanted in zip(body["errors"], row["errors"]):
        for word in wanted.get("hint_mentions", []):
            assert word in told["hint"]


def test_good_files_pass_and_many_are_counted():
    paths = sorted(EXAMPLES.glob("*.json"))
    run = glint("lint", *paths)
    assert run.returncode == 0, run.stdout.decode()
    assert run.stdout.decode().splitlines()[-1].startswith(
        f"{len(paths)} files, 0 errors, ")
    body = glint("lint", "--json", *paths).stdout.decode().splitlines()
    assert [json.loads(line)["file"] for line in body] == list(map(str, paths))
    assert all(json.loads(line)["valid"] for line in body)


def test_warnings_never_block(tmp_path):
    scene = {"integrator": {"type": "whitted", "max_bounces": 0},
             "objects": [{"type": "sphere", "material": {"type": "mirror"}}]}
    path = tmp_path / "mirror.json"
    path.write_text(json.dumps(scene))
    run = glint("lint", path)
    assert run.returncode == 0
    assert "[mirror.no_bounces]" in run.stdout.decode()
    assert re.search(r"^\S+:\d+:\d+: warning: ", run.stdout.decode(), re.M)
    assert run.stdout.decode().endswith("warnings\n") or \
        run.stdout.decode().endswith("1 warning\n")
    body = json.loads(glint("lint", "--json", path).stdout)
    assert body["valid"] and body["warnings"][0]["code"]
    quiet = glint("lint", "-q", path)
    assert quiet.returncode == 0 and quiet.stdout == b""


def test_a_job_document_is_linted_with_its_own_places(tmp_path):
    path = tmp_path / "job.json"
    path.write_text('{"scene": {\n  "objects": [{"type": "spher"}]},\n'
                    ' "outptu": {}}\n')
    run = glint("lint", "--json", path)
    assert run.returncode == 1
    errors = json.loads(run.stdout)["errors"]
    assert [(e["pointer"], e["line"], e["column"]) for e in errors] == [
        ("/scene/objects/0/type", 2, 24), ("/outptu", 3, 2)]


def test_standard_input():
    run = glint("lint", "-", stdin=b'{"objects": [}')
    assert run.returncode == 1
    assert run.stdout.startswith(b"standard input:1:14: error: ")
    assert glint("lint", "-", stdin=b'{"objects":[{"type":"sphere"}]}'
                 ).returncode == 0


def test_what_cannot_be_read_is_status_2_and_the_rest_is_linted(tmp_path):
    run = glint("lint", tmp_path / "none.json", tmp_path,
                EXAMPLES / "smallest.json")
    assert run.returncode == 2
    assert b"none.json: No such file or directory" in run.stderr
    assert b"Is a directory" in run.stderr
    assert run.stdout.splitlines()[-1].startswith(b"1 file, 0 errors, ")


HOSTILE = [
    b"", b"\0", b"\xff\xfe", b"{" * 100000, b"[" * 100000, b'{"a":' * 50000,
    b"1e999", b'{"objects":' + b" " * 1100000 + b"[]}", b'"\\ud800"', b"nul",
    b'{"objects": [{"type": "sphere", "radius": 1e999}]}', b"\x1b[2J",
]


@pytest.mark.parametrize("text", HOSTILE, ids=range(len(HOSTILE)))
def test_hostile_input_is_an_error_and_no_escape(text):
    run = glint("lint", "-", stdin=text)
    assert run.returncode == 1
    assert b"\x1b" not in run.stdout and b"\0" not in run.stdout
    assert re.search(rb"\[[a-z0-9_.]+\]\n", run.stdout)
    assert len(run.stdout) < 2000


def test_a_huge_file_is_refused(tmp_path):
    path = tmp_path / "huge.json"
    with open(path, "wb") as file:
        file.truncate(1 << 30)
    run = glint("lint", path)
    assert run.returncode in (1, 2)
    assert run.stdout or run.stderr


def test_lint_leaves_nothing_behind(tmp_path):
    (tmp_path / "a.json").write_text("{}")
    glint("lint", "a.json", cwd=tmp_path)
    assert files(tmp_path) == ["a.json"]
    assert isinstance(tmp_path, pathlib.Path)
