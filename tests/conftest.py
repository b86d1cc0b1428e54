"""Fixtures for the black-box tests: the real daemon, on a port the kernel gave.

GLINT_BUILD names the build folder under test (default build/dev).
"""
import json
import os
import pathlib
import re
import signal
import subprocess
import time
import urllib.error
import urllib.request

import pytest

SOURCE = pathlib.Path(__file__).resolve().parent.parent
BUILD = pathlib.Path(os.environ.get("GLINT_BUILD", SOURCE / "build" / "dev"))
if not BUILD.is_absolute():
    BUILD = SOURCE / BUILD
BIN = BUILD / "bin"


class Reply:
    """One HTTP answer: status, headers (any case), body bytes."""

    def __init__(self, status, headers, body):
        self.status = status
        self.headers = headers
        self.body = body

    @property
    def json(self):
        return json.loads(self.body)


class Daemon:
    """A glintd of our own in a data folder of our own."""

    def __init__(self, data, *flags, env=None):
        self.data = data
        self.flags = [str(f) for f in flags]
        self.env = dict(os.environ, **(env or {}))
        self.process = None
        self.port = None

    def start(self, timeout=20):
        try:
            return self.begin(timeout)
        except BaseException:
            if self.process and self.process.poll() is None:
                self.kill()
            raise

    def begin(self, timeout):
        self.log_path = pathlib.Path(f"{self.data}.log")
        self.log = open(self.log_path, "ab")
        offset = self.log_path.stat().st_size
        self.process = subprocess.Popen(
            [str(BIN / "glintd"), "--listen", "127.0.0.1:0", "--data",
             str(self.data), *self.flags],
            stdin=subprocess.DEVNULL, stdout=self.log, stderr=self.log,
            env=self.env)
        deadline = time.monotonic() + timeout
        while time.monotonic() < deadline:
            text = self.log_path.read_bytes()[offset:].decode()
            found = re.search(r"http://127\.0\.0\.1:(\d+)", text)
            if found:
                self.port = int(found.group(1))
                break
            assert self.process.poll() is None, "glintd ended:\n" + text
            time.sleep(0.01)
        assert self.port, "glintd did not say where it listens"
        while time.monotonic() < deadline:
            if self.get("/readyz").status == 200:
                return self
            time.sleep(0.01)
        raise AssertionError("glintd was not ready in time:\n"
                             + self.log_path.read_text())

    def kill(self):
        self.process.send_signal(signal.SIGKILL)
        self.process.wait()
        self.log.close()

    def stop(self, timeout=30):
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
        code = self.process.wait(timeout)
        self.log.close()
        return code

    def request(self, method, path, body=None, headers=None, timeout=60):
        headers = dict(headers or {})
        if isinstance(body, (dict, list)):
            body = json.dumps(body)
        if isinstance(body, str):
            body = body.encode()
        if body is not None:
            headers.setdefault("Content-Type", "application/json")
        request = urllib.request.Request(
            f"http://127.0.0.1:{self.port}{path}", data=body,
            headers=headers, method=method)
        try:
            with urllib.request.urlopen(request, timeout=timeout) as answer:
                return Reply(answer.status, answer.headers, answer.read())
        except urllib.error.HTTPError as answer:
            with answer:
                return Reply(answer.code, answer.headers, answer.read())

    def get(self, path, **kw):
        return self.request("GET", path, **kw)

    def post(self, path, body=None, **kw):
        return self.request("POST", path, body if body is not None else b"",
                            **kw)

    def wait_for(self, job, states=("succeeded", "failed", "canceled"),
                 timeout=60):
        deadline = time.monotonic() + timeout
        while time.monotonic() < deadline:
            reply = self.get(f"/v1/jobs/{job}?wait=1")
            if reply.status == 200 and reply.json["state"] in states:
                return reply.json
        raise AssertionError(f"{job} did not end: {reply.body!r}")

    def workers(self):
        """Process ids of this daemon's own workers."""
        pids = []
        for entry in pathlib.Path("/proc").iterdir():
            if not entry.name.isdigit():
                continue
            try:
                stat = (entry / "stat").read_text()
            except OSError:
                continue
            parent = int(stat.rsplit(")", 1)[1].split()[1])
            if parent == self.process.pid and "glint-worker" in stat:
                pids.append(int(entry.name))
        return pids


@pytest.fixture
def new_daemon(tmp_path):
    """A function that starts daemons; all of them end with the test."""
    started = []

    def start(*flags, data=None, env=None):
        daemon = Daemon(data or tmp_path / "data", *flags, env=env).start()
        started.append(daemon)
        return daemon

    yield start
    for daemon in started:
        if daemon.process.poll() is None:
            daemon.kill()


@pytest.fixture(scope="module")
def daemon(tmp_path_factory):
    """One daemon for all tests of a file."""
    one = Daemon(tmp_path_factory.mktemp("glintd") / "data").start()
    yield one
    code = one.stop()
    assert code == 0, one.log_path.read_text()


def example(name):
    return json.loads((SOURCE / "schemas" / "examples" / f"{name}.json").read_text())
