#!/usr/bin/python3
"""Render the lecture's table with Glint and POV-Ray in turns; print one JSON line.

usage: compare_povray.py BUILD_DIR [ROUNDS] [THREADS]

POV-Ray cannot add up hits as the lecture does, so it renders table.pov, the
same scene with mirrors; bench_trace renders both its twin (table_phong) and
the lecture's own (table). Times are POV-Ray's trace time without parsing and
Glint's build and trace time, medians of the rounds; CPU seconds are those of
the whole processes and say more on a busy machine.
"""
import json
import pathlib
import re
import shutil
import statistics
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent


def povray(threads, folder):
    out = subprocess.run(
        ["povray", f"+I{HERE / 'table.pov'}", f"+O{folder}/table.png", "+W1280",
         "+H720", "-A", "-D", "+FN8", f"+WT{threads}"],
        capture_output=True, text=True, check=True).stderr
    wall = re.search(r"Trace Time:.*\(([0-9.]+) seconds\)\s*using \d+ "
                     r"thread\(s\) with ([0-9.]+) CPU-seconds", out)
    return float(wall.group(1)), float(wall.group(2))


def glint(build, threads):
    out = subprocess.run(
        [build / "tests" / "bench_trace", "--threads", str(threads), "--repeat",
         "3", "table", "table_phong"], capture_output=True, text=True,
        check=True).stdout
    rows = {r["scene"]: r for r in map(json.loads, out.splitlines())}
    return {name: ((r["build_ms"] + r["trace_ms"]) / 1e3, r["cpu_ms"] / 1e3)
            for name, r in rows.items()}


def main():
    if shutil.which("povray") is None:
        print(json.dumps({"figure": "table", "skipped": "no povray"}))
        return
    build = pathlib.Path(sys.argv[1])
    rounds = int(sys.argv[2]) if len(sys.argv) > 2 else 5
    threads = int(sys.argv[3]) if len(sys.argv) > 3 else 1
    pov, ours = [], []
    with tempfile.TemporaryDirectory() as folder:
        for _ in range(rounds):
            pov.append(povray(threads, folder))
            ours.append(glint(build, threads))
    line = {"figure": "table", "threads": threads, "rounds": rounds}
    for index, clock in enumerate(("wall", "cpu")):
        theirs = statistics.median(p[index] for p in pov)
        line[f"povray_{clock}_s"] = round(theirs, 4)
        for name in ("table_phong", "table"):
            mine = statistics.median(o[name][index] for o in ours)
            line[f"{name}_{clock}_s"] = round(mine, 4)
            line[f"{name}_{clock}_ratio"] = round(
                statistics.median(p[index] / o[name][index]
                                  for p, o in zip(pov, ours)), 2)
    print(json.dumps(line))


main()
