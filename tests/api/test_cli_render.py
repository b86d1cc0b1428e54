"""glint render at a desk: what is written, what is said, what is left."""
import json
import os
import pty
import re
import select
import signal
import struct
import subprocess
import termios
import time

import fcntl
import pytest

from cli import (ALONE, BIN, ENDLESS, EXAMPLES, GLINT, LONGER, SMALL,
                 SMALLEST, TABLE, assert_png, environment, files, glint)


def test_a_png(tmp_path):
    run = glint("render", TABLE, "-o", "out.png", *SMALL, cwd=tmp_path)
    assert run.returncode == 0, run.stderr
    assert run.stdout == b""
    assert files(tmp_path) == ["out.png"]
    data = (tmp_path / "out.png").read_bytes()
    assert_png(data, 48, 32)
    assert len(set(data)) > 100  # a picture, not one colour
    lines = run.stderr.decode().splitlines()
    assert re.fullmatch(r".*course-table-fresnel\.json  48x32, 1 spp, "
                        r"4 bounces, \d+ objects", lines[0])
    assert re.fullmatch(r"wrote out\.png \([\d.]+ (bytes|KB)\) in [\d.]+ s",
                        lines[-1])
    mode = (tmp_path / "out.png").stat().st_mode & 0o777
    umask = os.umask(0)
    os.umask(umask)
    assert mode == 0o666 & ~umask


def test_an_exr_with_layers(tmp_path):
    run = glint("render", TABLE, "-o", "out.exr", *SMALL, "--layer", "beauty",
                "--layer", "depth", "--bit-depth", "half", cwd=tmp_path)
    assert run.returncode == 0, run.stderr
    data = (tmp_path / "out.exr").read_bytes()
    assert data[:4] == b"\x76\x2f\x31\x01"
    assert b"depth.V" in data and b"normal.X" not in data
    assert b"glint:layers" in data


def test_bit_depth_and_color_space_reach_the_file(tmp_path):
    def png(*flags):
        run = glint("render", TABLE, "-o", "-", *SMALL, *flags)
        assert run.returncode == 0, run.stderr
        assert_png(run.stdout, 48, 32)
        return run.stdout
    assert png()[24] == 8
    assert png("--bit-depth", "uint16")[24] == 16
    assert png("--color-space", "linear") != png()
    assert png("--layer", "normal") != png()
    assert png("--bit-depth", "uint8", "--color-space", "srgb") == png()


def test_standard_input_to_standard_output():
    text = TABLE.read_bytes()
    run = glint("render", "-", "-o", "-", *SMALL, stdin=text)
    assert run.returncode == 0, run.stderr
    assert_png(run.stdout, 48, 32)
    assert run.stderr.startswith(b"standard input  48x32")
    assert b"wrote standard output (" in run.stderr
    assert glint("render", TABLE, "-o-", *SMALL).stdout == run.stdout
    assert glint("render", "-", "-o", "-", "--format", "exr", *SMALL,
                 stdin=text).stdout[:4] == b"\x76\x2f\x31\x01"


def test_quiet_says_nothing(tmp_path):
    run = glint("render", SMALLEST, "-qo", tmp_path / "a.png", *SMALL)
    assert (run.returncode, run.stdout, run.stderr) == (0, b"", b"")
    assert_png((tmp_path / "a.png").read_bytes())


def test_threads_change_no_pixel():
    one = glint("render", TABLE, "-qo-", *SMALL, "--threads", 1)
    assert one.returncode == 0
    for threads in (2, 7):
        assert glint("render", TABLE, "-qo-", *SMALL, "--threads", threads
                     ).stdout == one.stdout


# ---- job documents ----

def test_a_job_document_says_how_unless_options_do(tmp_path):
    job = {"scene": {"$example": "course-table-fresnel"},
           "output": {"format": "exr", "bit_depth": "half",
                      "layers": ["normal"]},
           "priority": "low", "tags": ["lecture4"], "max_attempts": 2}
    path = tmp_path / "job.json"
    path.write_text(json.dumps(job))
    small = ["--set", "/scene/film/width=48", "--set", "/scene/film/height=32"]
    run = glint("render", path, "-qo", "-", *small)
    assert run.returncode == 0, run.stderr
    assert run.stdout[:4] == b"\x76\x2f\x31\x01" and b"normal.X" in run.stdout
    # The file's ending wins; the layer stays, half is no depth of a png.
    run = glint("render", path, "-qo", tmp_path / "a.png", *small)
    assert run.returncode == 0, run.stderr
    data = (tmp_path / "a.png").read_bytes()
    assert_png(data, 48, 32)
    assert data == glint("render", TABLE, "-qo-", *SMALL, "--layer", "normal"
                         ).stdout
    run = glint("render", path, "-qo-", *small, "--layer", "depth",
                "--bit-depth", "float")
    assert b"depth.V" in run.stdout and b"normal.X" not in run.stdout


# ---- --set ----

def test_set_changes_the_picture_and_only_it():
    plain = glint("render", TABLE, "-qo-", *SMALL).stdout
    changed = glint("render", TABLE, "-qo-", *SMALL, "--set",
                    "/integrator/max_bounces=0").stdout
    assert_png(changed, 48, 32)
    assert changed != plain


def test_set_values_may_be_anything():
    for values in (['/background={"type": "constant", "color": [1, 0, 0]}'],
                   ["/background/color=#ff0000"],
                   ["/sampler/type=stratified", "/sampler/spp=4"],
                   ['/objects/-={"type": "sphere", "radius": 0.25}'],
                   ["/extras/note=hello world"]):
        flags = [word for value in values for word in ("--set", value)]
        run = glint("render", TABLE, "-qo-", *SMALL, *flags)
        assert run.returncode == 0, (values, run.stderr)
        assert_png(run.stdout, 48, 32)


def test_set_makes_missing_members(tmp_path):
    run = glint("render", SMALLEST, "-qo-", *SMALL)
    assert run.returncode == 0, run.stderr
    assert_png(run.stdout, 48, 32)  # smallest has no film at all


@pytest.mark.parametrize("assignment,status,words", [
    ("/objects/99/radius=1", 2, ["/objects/99 does not exist", "elements"]),
    ("/film/width/x=1", 2, ["/film/width/x does not exist", "no members"]),
    ("/objects/first=1", 2, ["/objects/first does not exist", "by number"]),
    ("film/width=1", 2, ["is no JSON pointer", "begins with /"]),
    ("/film/width", 2, ["lacks a value"]),
    ("/film/~=1", 2, ["is no JSON pointer"]),
    ("/flim/width=1", 3, ["--set /flim/width=1: error: unknown property",
                          "did you mean `film`"]),
    ("/film/width=-1", 3, ["--set /film/width=-1: error: /film/width must be",
                           "got -1", "[number.too_small]"]),
    ("/film/width=wide", 3, ["/film/width must be", '"wide"',
                             "[type.mismatch]"]),
    ("/film/width=1e999", 3, ["1e999", "[type.mismatch]"]),
])
def test_wrong_sets_are_named(tmp_path, assignment, status, words):
    run = glint("render", TABLE, "-o", "a.png", "--set", assignment,
                cwd=tmp_path)
    assert run.returncode == status, run.stderr
    for word in words:
        assert word in run.stderr.decode()
    assert files(tmp_path) == []


def test_a_set_moves_no_line_of_the_users_file(tmp_path):
    path = tmp_path / "s.json"
    path.write_text('{\n  "film": {\n    "width": 8,\n    "height": 8\n  },\n'
                    '  "objects": [{"type": "spher"}]\n}\n')
    run = glint("render", "s.json", "-o", "a.png", "--set", '/film={"width": 8}',
                cwd=tmp_path)
    assert run.returncode == 3
    assert run.stderr.startswith(b"s.json:6:24: error: ")


# ---- refusals ----

@pytest.mark.parametrize("path", sorted((EXAMPLES / "bad").glob("*-*.json")),
                         ids=lambda path: path.stem)
def test_an_invalid_scene_prints_like_lint(tmp_path, path):
    lint = glint("lint", path).stdout.decode().splitlines()[:-1]
    run = glint("render", path, "-o", "a.png", cwd=tmp_path)
    assert run.returncode == 3
    assert run.stderr.decode().splitlines() == lint
    assert files(tmp_path) == []


@pytest.mark.parametrize("args,words", [
    (["-o", "a.jpg"], ["'a.jpg'", ".png or .exr"]),
    (["-o", "png"], [".png or .exr"]),
    (["-o", "a.png", "--format", "exr"], ["contradict"]),
    ([], ["-o out.png"]),
    (["-o", "a.png", "--bit-depth", "half"], ["--bit-depth", "half"]),
    (["-o", "a.exr", "--bit-depth", "uint8"], ["--bit-depth", "uint8"]),
    (["-o", "a.png", "--layer", "depth", "--layer", "normal"], ["--layer"]),
    (["-o", "a.exr", "--layer", "depth", "--layer", "depth"], ["--layer"]),
    (["-o", "a.png", "--layer", "glow"], ["--layer", "beauty"]),
    (["-o", "a.png", "--threads", "0"], ["--threads", "1"]),
    (["-o", "a.png", "--timeout", "-3"], ["--timeout"]),
    (["-o", "a.png", "b.json"], ["one argument too many"]),
    (["-o", "a.png", "-o", "b.png"], ["given twice"]),
])
def test_usage_errors(tmp_path, args, words):
    run = glint("render", TABLE, *args, cwd=tmp_path)
    assert run.returncode == 2, run.stderr
    assert run.stdout == b""
    for word in words:
        assert word in run.stderr.decode()
    assert files(tmp_path) == []


def test_files_that_cannot_be_read_or_written(tmp_path):
    folder = tmp_path / "folder.png"
    folder.mkdir()
    closed = tmp_path / "closed"
    closed.mkdir(mode=0o500)
    cases = [
        (["none.json", "-o", "a.png"], "none.json: No such file or directory"),
        (["folder.png", "-o", "a.png"], "Is a directory"),
        (["smallest", "-o", "a.png"], "glint examples smallest"),
        ([TABLE, "-o", "none/a.png"], "there is no folder none"),
        ([TABLE, "-o", "folder.png"], "it is a folder"),
        ([TABLE, "-o", "x" * 5000 + ".png"], "cannot write"),
        ([TABLE, "-o", "x" * 248 + ".png"], "cannot write"),
    ]
    if os.getuid() != 0:
        cases.append(([TABLE, "-o", "closed/a.png"], "is not writable"))
    for args, words in cases:
        run = glint("render", *args, cwd=tmp_path)
        assert run.returncode == 2, (args, run.stderr)
        assert words in run.stderr.decode()
    assert files(tmp_path) == ["closed", "folder.png"]
    run = glint("render", SMALLEST, "-o", "/dev/full", "--format", "png",
                *SMALL)
    assert run.returncode == 2
    assert b"No space left on device" in run.stderr


def test_an_old_picture_survives_a_render_that_fails(tmp_path):
    (tmp_path / "a.png").write_bytes(b"old")
    run = glint("render", TABLE, "-o", "a.png", cwd=tmp_path,
                GLINT_WORKER="/bin/false")
    assert run.returncode == 5
    assert files(tmp_path) == ["a.png"]
    assert (tmp_path / "a.png").read_bytes() == b"old"
    run = glint("render", TABLE, "-o", "a.png", *SMALL, cwd=tmp_path)
    assert run.returncode == 0
    assert_png((tmp_path / "a.png").read_bytes())


@pytest.mark.parametrize("worker", ["/bin/false", "/nonexistent/glint-worker",
                                    "/bin/true"])
def test_a_worker_that_is_none_fails_the_render(tmp_path, worker):
    run = glint("render", SMALLEST, "-o", "a.png", cwd=tmp_path,
                GLINT_WORKER=worker, timeout=20)
    assert run.returncode == 5
    assert "worker" in run.stderr.decode() or worker in run.stderr.decode()
    assert files(tmp_path) == []


# ---- interruption, time-out, loss ----

def start(tmp_path, *args, **popen):
    return subprocess.Popen([GLINT, "render", str(TABLE), "-o", "a.png",
                             *args], cwd=tmp_path, stderr=subprocess.PIPE,
                            env=environment(), **popen)


def worker_of(pid, timeout=10):
    """The worker process of a glint, once it has one."""
    deadline = time.monotonic() + timeout
    while time.monotonic() < deadline:
        with open(f"/proc/{pid}/task/{pid}/children") as file:
            children = file.read().split()
        for child in children:
            with open(f"/proc/{child}/comm") as file:
                if file.read().startswith("glint-worker"):
                    return int(child)
        time.sleep(0.01)
    raise AssertionError("no worker came")


def gone(pid, timeout=5):
    deadline = time.monotonic() + timeout
    while time.monotonic() < deadline:
        try:
            os.kill(pid, 0)
        except ProcessLookupError:
            return True
        time.sleep(0.01)
    return False


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM,
                                    signal.SIGHUP])
@pytest.mark.parametrize("after", [0.05, 1.5])
def test_an_interrupted_render_leaves_nothing(tmp_path, number, after):
    process = start(tmp_path, *ENDLESS)
    worker = worker_of(process.pid)
    time.sleep(after)
    begin = time.monotonic()
    process.send_signal(number)
    _, err = process.communicate(timeout=20)
    assert time.monotonic() - begin < 4
    assert process.returncode == 130
    assert err.decode().splitlines()[-1] == \
        "glint render: interrupted; nothing was written"
    assert files(tmp_path) == []
    assert gone(worker)


def test_a_second_interruption_exits_at_once(tmp_path):
    process = start(tmp_path, *ENDLESS)
    worker = worker_of(process.pid)
    time.sleep(1)
    # A worker that cannot listen would be waited for: the second ends that.
    os.kill(worker, signal.SIGSTOP)
    process.send_signal(signal.SIGINT)
    time.sleep(0.3)
    assert process.poll() is None
    begin = time.monotonic()
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=20)
    assert time.monotonic() - begin < 0.5
    assert process.returncode == 130
    assert files(tmp_path) == []
    assert gone(worker)


def test_a_worker_that_does_not_stop_is_killed(tmp_path):
    process = start(tmp_path, *ENDLESS)
    worker = worker_of(process.pid)
    time.sleep(1)
    os.kill(worker, signal.SIGSTOP)
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=20)
    assert process.returncode == 130
    assert gone(worker)


def test_a_killed_worker_fails_the_render(tmp_path):
    process = start(tmp_path, *ENDLESS)
    worker = worker_of(process.pid)
    time.sleep(0.7)
    os.kill(worker, signal.SIGKILL)
    _, err = process.communicate(timeout=20)
    assert process.returncode == 5
    assert "the worker process was lost: killed by signal 9" in err.decode()
    assert files(tmp_path) == []


def test_a_time_out(tmp_path):
    begin = time.monotonic()
    run = glint("render", TABLE, "-o", "a.png", *ENDLESS, "--timeout", 1,
                cwd=tmp_path)
    assert run.returncode == 6
    assert 1 <= time.monotonic() - begin < 5
    assert run.stderr.decode().splitlines()[-1] == \
        "glint render: timed out; nothing was written"
    assert files(tmp_path) == []


# ---- on a terminal ----

def on_terminal(args, columns=80, cwd=None, keys=None, **env):
    """Run glint with stdout and stderr on a terminal; what it drew there.

    keys: (seconds, bytes) typed after that time."""
    master, slave = pty.openpty()
    fcntl.ioctl(slave, termios.TIOCSWINSZ,
                struct.pack("HHHH", 24, columns, 0, 0))
    process = subprocess.Popen(
        [GLINT, *map(str, args)], stdin=slave, stdout=slave, stderr=slave,
        cwd=cwd, env=environment(**env), start_new_session=True,
        preexec_fn=lambda: fcntl.ioctl(0, termios.TIOCSCTTY, 0))
    os.close(slave)
    drawn = b""
    begin = time.monotonic()
    while time.monotonic() - begin < 120:
        if keys and time.monotonic() - begin > keys[0]:
            os.write(master, keys[1])
            keys = None
        if select.select([master], [], [], 0.05)[0]:
            try:
                data = os.read(master, 65536)
            except OSError:
                break
            if not data:
                break
            drawn += data
    os.close(master)
    return process.wait(20), drawn.decode()


def percents(drawn):
    return [int(p) for p in re.findall(r"(\d+)%", drawn)]


def test_the_bar_is_monotonic_ascii_and_ends_with_a_newline(tmp_path):
    status, drawn = on_terminal(
        ["render", TABLE, "-o", "a.png", *LONGER, *ALONE], cwd=tmp_path)
    assert status == 0, drawn
    bars = [line for line in re.split(r"[\r\n]+", drawn) if "%" in line]
    assert len(bars) >= 3, drawn
    for bar in bars:
        assert re.fullmatch(r"(loading|building|tracing|encoding|done) +"
                            r"\[#*-*\] +\d+%(  [\d.]+ Mray/s)?"
                            r"(  [\d:]+ left)? *", bar), bar
        assert len(bar) < 80
    shown = percents(drawn)
    assert shown == sorted(shown) and shown[-1] == 100
    assert re.search(r"100% *\r\nwrote a\.png", drawn)
    assert drawn.isascii() and "\x1b" not in drawn
    assert "Mray/s" in drawn and " left" in drawn


def test_a_narrow_terminal_gets_a_short_line(tmp_path):
    status, drawn = on_terminal(
        ["render", TABLE, "-o", "a.png", *LONGER, *ALONE], columns=30, cwd=tmp_path)
    assert status == 0
    bars = [line for line in re.split(r"[\r\n]+", drawn) if "%" in line]
    assert bars and all(len(bar) < 30 for bar in bars)


def test_quiet_and_dumb_terminals_get_no_bar(tmp_path):
    for flags, env in ((["-q"], {}), ([], {"TERM": "dumb"})):
        status, drawn = on_terminal(
            ["render", TABLE, "-o", "a.png", *LONGER, *ALONE, *flags], cwd=tmp_path,
            **env)
        assert status == 0
        assert "[#" not in drawn and "\r" not in drawn.replace("\r\n", "")


def test_ctrl_c_on_a_terminal_erases_the_bar(tmp_path):
    status, drawn = on_terminal(
        ["render", TABLE, "-o", "a.png", *ENDLESS], cwd=tmp_path,
        keys=(1.5, b"\x03"), NO_COLOR="1")
    assert status == 130
    assert re.search(r"\r +\rglint render: interrupted; nothing was written"
                     r"\r\n$", drawn), drawn[-200:]
    assert files(tmp_path) == []


def test_colours_are_for_eyes_that_want_them(tmp_path):
    bad = EXAMPLES / "bad" / "12-many-errors.json"
    for args in (["lint", bad], ["render", bad, "-o", "a.png"], ["rendr"]):
        coloured = on_terminal(args, cwd=tmp_path)[1]
        if args[0] != "rendr":
            assert "\x1b[31;1m" in coloured
        plain = on_terminal(args, cwd=tmp_path, NO_COLOR="1")[1]
        assert "\x1b" not in plain
        assert "\x1b" not in on_terminal(args, cwd=tmp_path, TERM="dumb")[1]
        if args[0] != "rendr":
            assert on_terminal([*args, "--no-color"], cwd=tmp_path)[1] == plain
        assert re.sub(r"\x1b\[[\d;]*m", "", coloured) == plain
        assert b"\x1b" not in glint(*args, cwd=tmp_path).stderr
        assert b"\x1b" not in glint(*args, cwd=tmp_path).stdout


def test_a_picture_is_not_printed_on_a_terminal(tmp_path):
    status, drawn = on_terminal(["render", TABLE, "-o", "-"], cwd=tmp_path)
    assert status == 2
    assert "on the terminal" in drawn and "PNG" not in drawn


def test_the_worker_stands_beside_glint():
    assert (BIN / "glint-worker").exists()
