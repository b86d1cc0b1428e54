"""glintd's configuration, seen from outside: exit statuses, banner, precedence.

The tables of every value are in tests/unit/pool/test_config.c.
"""
import json
import os
import resource
import signal
import socket
import subprocess
import time
import urllib.request

import pytest

from conftest import BIN, Daemon

GLINTD = str(BIN / "glintd")


def run(*args, env=None, cwd=None):
    clean = {k: v for k, v in os.environ.items() if not k.startswith("GLINT_")}
    return subprocess.run([GLINTD, *args], capture_output=True, text=True,
                          timeout=30, cwd=cwd, env=dict(clean, **(env or {})))


def test_help_is_quick_and_begins_with_examples():
    took = []
    for _ in range(5):
        start = time.monotonic()
        done = run("--help")
        took.append(time.monotonic() - start)
    assert done.returncode == 0 and done.stderr == ""
    lines = done.stdout.splitlines()
    assert lines[2].startswith("  glintd")
    assert "--listen HOST:PORT" in done.stdout
    assert max(len(line) for line in lines) < 120
    assert min(took) < 0.05, took


def test_version():
    done = run("--version")
    assert done.returncode == 0
    assert done.stdout.startswith("glintd ")


def test_usage_is_2_and_configuration_3(tmp_path):
    done = run("--lisen", "127.0.0.1:0")
    assert done.returncode == 2
    assert "did you mean --listen?" in done.stderr
    done = run("--workers", "none")
    assert done.returncode == 3
    assert "--workers must be auto or a whole number" in done.stderr
    (tmp_path / "glint.json").write_text('{"listn": "127.0.0.1:0"}')
    done = run("--check-config", cwd=tmp_path)
    assert done.returncode == 3
    assert './glint.json:1:2: unknown key "listn", did you mean "listen"?' \
        in done.stderr


def test_beyond_this_machine_needs_a_word(tmp_path):
    done = run("--listen", "0.0.0.0:0", "--data", str(tmp_path / "d"))
    assert done.returncode == 3
    assert "--insecure-open" in done.stderr
    assert not (tmp_path / "d").exists()


def test_print_config_shows_every_value_and_its_origin(tmp_path):
    (tmp_path / "c.json").write_text(json.dumps({"max_spp": 12, "workers": 3}))
    done = run("--config", "c.json", "--max-queued=5", "--print-config",
               env={"GLINT_MAX_BOUNCES": "6", "GLINT_WORKERS": "4"},
               cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    rows = {line.split()[0]: line for line in done.stdout.splitlines()}
    assert " 12 " in rows["max_spp"] and "c.json:1:" in rows["max_spp"]
    assert " 4 " in rows["workers"] and "GLINT_WORKERS" in rows["workers"]
    assert " 6 " in rows["max_bounces"]
    assert " 5 " in rows["max_queued"] and "--max-queued" in rows["max_queued"]
    assert "(default)" in rows["max_wait"]


def test_an_address_in_use_is_named(tmp_path):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        done = run("--listen", f"127.0.0.1:{port}", "--data",
                   str(tmp_path / "d"))
    assert done.returncode == 1
    assert "127.0.0.1" in done.stderr and str(port) in done.stderr
    assert "in use" in done.stderr


def test_a_data_folder_that_cannot_be(tmp_path):
    (tmp_path / "file").write_text("")
    done = run("--listen", "127.0.0.1:0", "--data", str(tmp_path / "file" / "d"))
    assert done.returncode == 1
    assert "data folder" in done.stderr


def test_a_second_daemon_on_the_same_data_is_refused(new_daemon):
    first = new_daemon()
    done = run("--listen", "127.0.0.1:0", "--data", str(first.data))
    assert done.returncode == 1
    assert first.get("/livez").status == 200


def test_banner_is_one_screen_and_true(new_daemon):
    daemon = new_daemon("--workers", "3", "--threads", "5")
    text = daemon.log_path.read_text()
    banner = [line for line in text.splitlines()
              if not line.startswith(("{", "glintd: warning"))]
    assert len(banner) <= 24
    assert f"http://127.0.0.1:{daemon.port}" in banner[1]
    joined = "\n".join(banner)
    for word in ("glintd", "core build", "x86-64", "3, 5 threads",
                 str(daemon.data), "sqlite", "600 s", "10240 connections"):
        assert word in joined, word


def test_settings_take_effect(new_daemon):
    daemon = new_daemon("--max-pixels", "1000",
                        env={"GLINT_MAX_SCENE_BYTES": "2048"})
    scene = {"version": 1, "film": {"width": 100, "height": 100},
             "objects": [{"type": "sphere"}]}
    assert daemon.post("/v1/jobs", scene).status == 422
    scene["film"]["height"] = 10
    assert daemon.post("/v1/jobs", scene).status in (201, 202)
    scene["description"] = "x" * 3000
    assert daemon.post("/v1/jobs", scene).status == 413


def test_ipv6(tmp_path):
    if not socket.has_ipv6 or not os.path.exists("/proc/net/if_inet6"):
        pytest.skip("this machine has no IPv6")
    log = open(tmp_path / "log", "wb")
    process = subprocess.Popen(
        [GLINTD, "--listen", "[::1]:0", "--data", str(tmp_path / "d")],
        stdout=log, stderr=log)
    try:
        deadline = time.monotonic() + 20
        url = None
        while time.monotonic() < deadline and url is None:
            for line in (tmp_path / "log").read_text().splitlines():
                if "http://[::1]:" in line:
                    url = line.split()[1]
            time.sleep(0.01)
        assert url, (tmp_path / "log").read_text()
        with urllib.request.urlopen(url + "/livez", timeout=10) as answer:
            assert answer.status == 200
    finally:
        process.send_signal(signal.SIGTERM)
        assert process.wait(30) == 0
        log.close()


def test_few_descriptors_mean_fewer_connections(tmp_path):
    log = open(tmp_path / "log", "wb")
    process = subprocess.Popen(
        [GLINTD, "--listen", "127.0.0.1:0", "--data", str(tmp_path / "d")],
        stdout=log, stderr=log,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_NOFILE,
                                              (1024, 1024)))
    try:
        deadline = time.monotonic() + 20
        while b"http://" not in (tmp_path / "log").read_bytes():
            assert time.monotonic() < deadline and process.poll() is None
            time.sleep(0.01)
        text = (tmp_path / "log").read_text()
        assert "max_connections lowered from 10240 to " in text
        assert "10240 connections" not in text
    finally:
        process.send_signal(signal.SIGTERM)
        assert process.wait(30) == 0
        log.close()


def ready_after(data):
    """Seconds from exec to the first 200 of /readyz."""
    daemon = Daemon(data)
    start = time.monotonic()
    daemon.start()
    took = time.monotonic() - start
    return daemon, took


def test_start_is_quick_and_rest_is_small(tmp_path):
    # The fixture's own steps (10 ms naps, a search of the log) are included.
    took = []
    for i in range(3):
        daemon, seconds = ready_after(tmp_path / f"data{i}")
        took.append(seconds)
        time.sleep(0.3)
        status = open(f"/proc/{daemon.process.pid}/status").read()
        resident = int(status.split("VmRSS:")[1].split()[0])
        assert daemon.stop() == 0
    if "-fsanitize" not in os.environ.get("GLINT_FLAGS", "") and \
            "Tsan" not in status:
        assert min(took) < 0.3, took
        assert resident < 30 * 1024, f"{resident} kB"
