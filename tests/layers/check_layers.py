#!/usr/bin/python3
"""Who may know whom (docs/ARCHITECTURE.md, section 4), checked by reading includes.

usage: check_layers.py ROOT        prints "layers ok", or every breach and exits 1

A room is a folder or a single file; the longest matching row wins. A row names
the rooms it may include besides itself and core/base. VENDORS names, for each
library's headers, the only files that may include them.
"""
import pathlib
import re
import sys

ROOMS = {
    "core/base": [],
    "core/scene": [],
    "core/trace": ["core/scene"],
    "core/image": ["core/scene"],
    "core/image/develop": ["core/scene", "core/image", "core/trace/film"],
    "server/http": [],
    "server/jobs": [],
    "server/blobs": [],
    "server/store": ["server/jobs"],
    "server/worker/wire": [],
    "server/worker/child": ["server/worker/wire"],
    "server/worker": ["core/scene", "core/trace", "core/image", "core/image/develop",
                      "server/worker/wire"],
    "server/pool": ["server/jobs", "server/store", "server/blobs",
                    "server/worker/wire", "server/worker/child"],
    "server/api": ["core/scene", "server/http", "server/jobs", "server/store",
                   "server/blobs", "server/pool", "server/worker/wire"],
    # The program's own files: introduce the rooms to each other.
    "server": ["server/api", "server/http", "server/store", "server/blobs",
               "server/pool", "core/scene/scene_json"],
    "cli": ["core/scene", "server/worker/wire", "server/worker/child"],
}

VENDORS = {
    r"cjson/|cJSON": ["core/base/json.c"],
    r"sodium": ["core/base/sha256.c", "core/base/ulid.c"],
    r"embree": ["core/trace/embree.h"],
    r"core/trace/embree\.h": ["core/trace/accel.c"],
    r"OpenImageIO": ["core/image/image_oiio.cpp"],
    r"microhttpd": ["server/http/http.c"],
    r"sqlite3": ["server/store/store_sqlite.c"],
    r"seccomp|linux/seccomp": ["server/worker/sandbox.c"],
    r"curl/": ["cli/remote.c"],
    r"dlfcn": ["core/image/codec.c"],
    # Threads exist in named files only.
    r"pthread|threads\.h": [
        "core/base/log.c", "core/trace/render.c", "core/image/codec.c",
        "server/http/http.c", "server/store/store.c", "server/blobs/blobs.c",
        "server/pool/pool.c", "server/api/events.c"],
    # No libm but sqrt in the tracer: pixels would depend on the C library.
    r"tgmath": [],
}


def room_of(path):
    """The row that speaks for a file: "server/worker/wire.h" -> its own row."""
    stem = path.rsplit(".", 1)[0]
    while stem:
        if stem in ROOMS:
            return stem
        stem = stem.rpartition("/")[0]
    return None


def covers(row, path):
    stem = path.rsplit(".", 1)[0]
    return stem == row or stem.startswith(row + "/")


def allowed(room, target):
    if covers("core/base", target) or room_of(target) == room:
        return True
    for row in ROOMS[room]:
        # "server/worker" does not give wire's neighbours: the longest row of
        # the target must be the one named, or the file itself.
        if covers(row, target) and room_of(target) in (row, room_of(row + ".h")):
            return True
    return False


def includes(text):
    for number, line in enumerate(text.splitlines(), 1):
        found = re.match(r'\s*#\s*include\s+([<"])([^>"]+)[>"]', line)
        if found:
            yield number, found.group(1) == '"', found.group(2)


def main():
    root = pathlib.Path(sys.argv[1])
    breaches = []
    files = sorted(p for top in ("core", "server", "cli")
                   for p in (root / top).rglob("*")
                   if p.suffix in (".c", ".h", ".cpp", ".inc"))
    for file in files:
        name = file.relative_to(root).as_posix()
        room = room_of(name)
        if room is None:
            breaches.append(f"{name}: stands in no room of the table")
            continue
        text = file.read_text()
        for number, ours, target in includes(text):
            where = f"{name}:{number}"
            if ours and not (root / target).exists():
                generated = pathlib.PurePath(target).name == target
                if not generated:
                    breaches.append(f"{where}: no such file from the root: {target}")
            elif ours and not allowed(room, target):
                breaches.append(f"{where}: {room} may not know {room_of(target)} ({target})")
            for pattern, homes in VENDORS.items():
                if re.match(pattern, target) and name not in homes:
                    breaches.append(f"{where}: {target} has its address in {', '.join(homes) or 'no file'}")
        if name.startswith("core/trace/"):
            for found in re.finditer(
                    r"(?<![\w.>])(sinf?|cosf?|tanf?|powf?|expf?|exp2f?|logf?|log2f?|"
                    r"a?sinf|acosf?|atan2?f?|cbrtf?|hypotf?)\s*\(",
                    re.sub(r"/\*.*?\*/|//[^\n]*|\"[^\"\n]*\"", "", text, flags=re.S)):
                breaches.append(f"{name}: calls {found.group(1)} of libm; core/base/math has our own")
    for breach in breaches:
        print(breach)
    if not breaches:
        print("layers ok")
    return 1 if breaches else 0


if __name__ == "__main__":
    sys.exit(main())
