"""Running glint in tests: one call, its status, what it said where."""
import os
import pathlib
import subprocess

from conftest import BIN, SOURCE

GLINT = str(BIN / "glint")
EXAMPLES = SOURCE / "schemas" / "examples"
TABLE = EXAMPLES / "course-table-fresnel.json"
SMALLEST = EXAMPLES / "smallest.json"

# Long enough to be interrupted: minutes of work on any machine.
ENDLESS = ["--set", '/sampler={"type": "sobol", "spp": 2048}']
# A second or a few, on one thread of any machine: long enough to be watched.
LONGER = ["--set", '/sampler={"type": "sobol", "spp": 12}']
ALONE = ["--threads", "1"]
SMALL = ["--set", "/film/width=48", "--set", "/film/height=32"]


def environment(**changes):
    env = {k: v for k, v in os.environ.items()
           if not k.startswith("GLINT_") and k != "NO_COLOR"}
    env["TERM"] = "xterm"
    for name, value in changes.items():
        if value is None:
            env.pop(name, None)
        else:
            env[name] = str(value)
    return env


def glint(*args, stdin=b"", cwd=None, timeout=120, **env):
    return subprocess.run([GLINT, *map(str, args)], input=stdin, cwd=cwd,
                          capture_output=True, timeout=timeout,
                          env=environment(**env))


def files(folder):
    return sorted(p.name for p in pathlib.Path(folder).iterdir())


def assert_png(data, width=None, height=None):
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    assert data[-12:-4] == b"\0\0\0\0IEND"
    if width:
        assert int.from_bytes(data[16:20], "big") == width
        assert int.from_bytes(data[20:24], "big") == height
