#!/usr/bin/python3
"""service.py [BUILD]: what the service costs around a render. One JSON line per
figure; never fails a test run (PERFORMANCE: P8, P10).

  ready        exec of glintd -> /readyz answers 200
  idle_mb      resident memory of glintd alone, workers apart, after 2 s
  help         `glint --help`, whole process
  overhead     POST /v1/render at 512 x 512 on a kept connection, wall time minus
               build, trace and encode as Server-Timing tells them; every request
               another scene, so nothing is cached
  cached       the same request again
  control      an append of 4 KiB + fdatasync in the same folder, interleaved:
               the overhead holds three durable steps (job, picture, result)
"""
import http.client
import json
import os
import pathlib
import platform
import re
import statistics
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ROOT / "build/release")
COMMIT = subprocess.run(["git", "-C", str(ROOT), "rev-parse", "--short", "HEAD"],
                        capture_output=True, text=True).stdout.strip()
CPU = next((line.split(":", 1)[1].strip()
            for line in open("/proc/cpuinfo") if line.startswith("model name")),
           platform.machine())


def emit(figure, unit, values):
    values = sorted(values)
    print(json.dumps({
        "figure": figure, "unit": unit, "n": len(values),
        "p50": round(statistics.median(values), 3),
        "min": round(values[0], 3), "max": round(values[-1], 3),
        "commit": COMMIT, "cpu": CPU}), flush=True)


class Daemon:
    def __init__(self, data):
        self.log = open(f"{data}.log", "wb+")
        self.began = time.monotonic()
        self.process = subprocess.Popen(
            [BUILD / "bin/glintd", "--listen", "127.0.0.1:0", "--data", data],
            stdin=subprocess.DEVNULL, stdout=self.log, stderr=self.log)
        self.port = None
        while self.port is None:
            assert self.process.poll() is None, "glintd ended"
            found = re.search(rb"http://127\.0\.0\.1:(\d+)",
                              pathlib.Path(self.log.name).read_bytes())
            self.port = found and int(found.group(1))
            time.sleep(0.001)
        while self.status("/readyz") != 200:
            time.sleep(0.001)
        self.ready = time.monotonic() - self.began

    def status(self, path):
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=10)
        connection.request("GET", path)
        status = connection.getresponse().status
        connection.close()
        return status

    def resident_mb(self):
        text = pathlib.Path(f"/proc/{self.process.pid}/status").read_text()
        return int(re.search(r"VmRSS:\s+(\d+)", text).group(1)) / 1024

    def stop(self):
        self.process.terminate()
        self.process.wait(60)
        self.log.close()


def scene(seed):
    return json.dumps({
        "film": {"width": 512, "height": 512}, "sampler": {"seed": seed},
        "objects": [{"type": "sphere"}]}).encode()


def timing(headers):
    return {name: float(ms) for name, ms in
            re.findall(r"(\w+);dur=([0-9.]+)", headers.get("Server-Timing", ""))}


def renders(daemon, folder, count=60):
    connection = http.client.HTTPConnection("127.0.0.1", daemon.port, timeout=60)
    control = os.open(os.path.join(folder, "control"), os.O_CREAT | os.O_WRONLY | os.O_APPEND)
    overhead, cached, sync = [], [], []
    for seed in range(count):
        for repeat in (False, True):
            began = time.perf_counter()
            connection.request("POST", "/v1/render", scene(seed),
                               {"Content-Type": "application/json"})
            reply = connection.getresponse()
            reply.read()
            wall = (time.perf_counter() - began) * 1e3
            assert reply.status == 200, reply.status
            if repeat:
                assert reply.headers["Glint-Cache"] == "hit"
                cached.append(wall)
            elif seed >= 5:  # the first ones wait for the image library
                spent = timing(reply.headers)
                overhead.append(wall - sum(spent[k] for k in ("build", "trace", "encode")))
        began = time.perf_counter()
        os.write(control, b"x" * 4096)
        os.fdatasync(control)
        sync.append((time.perf_counter() - began) * 1e3)
    os.close(control)
    return overhead, cached, sync


def main():
    with tempfile.TemporaryDirectory() as folder:
        ready = []
        for k in range(5):
            daemon = Daemon(f"{folder}/data{k}")
            ready.append(daemon.ready * 1e3)
            if k < 4:
                daemon.stop()
        emit("ready", "ms", ready)
        time.sleep(2)
        emit("idle_mb", "MiB", [daemon.resident_mb()])
        overhead, cached, sync = renders(daemon, folder)
        emit("overhead", "ms", overhead)
        emit("cached", "ms", cached)
        emit("control", "ms", sync)
        daemon.stop()
    help_ms = []
    for _ in range(20):
        began = time.perf_counter()
        subprocess.run([BUILD / "bin/glint", "--help"], stdout=subprocess.DEVNULL, check=True)
        help_ms.append((time.perf_counter() - began) * 1e3)
    emit("help", "ms", help_ms)


if __name__ == "__main__":
    main()
