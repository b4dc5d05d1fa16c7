"""Start, readiness, scenes that come and break, drain and end."""

import http.client
import json
import shutil
import signal
import socket
import subprocess
import threading
import time
import unittest

from harness import (ENVIRONMENT, BUILD, LIMIT_S, Daemon, cli_ok, data_folder, scenes,
                     read_response, temporary_folder, wait_until)

QUICK = {"scene": "room", "mode": "reference", "face_px": 8, "samples_per_axis": 1,
         "probes": [[0.1, 0.2, 0.3]]}


def program(*args, timeout_s=LIMIT_S):
    """lightprobed to its end: (status, standard output, standard error)."""
    done = subprocess.run([str(BUILD / "lightprobed"), *map(str, args)], capture_output=True,
                          timeout=timeout_s, env=ENVIRONMENT)
    return done.returncode, done.stdout.decode(), done.stderr.decode()


def job_of_seconds(daemon, seconds):
    """A reference job that takes about so long on this build, from a measured rate."""
    probe = daemon.render({**QUICK, "face_px": 128, "samples_per_axis": 2})
    rays = probe["totals"]["rays"]
    rate = rays / max(probe["seconds"]["render"], 1e-3)
    want = rate * seconds
    face_px = 512
    samples = max(1, min(32, round((want / (6 * face_px * face_px)) ** 0.5)))
    if samples == 1:
        face_px = max(32, int((want / 6) ** 0.5))
    return {**QUICK, "face_px": face_px, "samples_per_axis": samples}


class Background(threading.Thread):
    """A render on its own thread; .answer or .error afterwards."""

    def __init__(self, daemon, job):
        super().__init__(daemon=True)
        self.target_daemon, self.job, self.answer, self.error = daemon, job, None, None
        self.start()

    def run(self):
        try:
            self.answer = self.target_daemon.request("POST", "/v1/render", self.job,
                                                     timeout_s=10 * LIMIT_S)
        except (OSError, http.client.HTTPException) as error:
            self.error = error


def running(daemon):
    """Whether a render is at work: the scene is held by a job."""
    return daemon.get("/v1/scenes/room").json()["refs"] > 0


class Start(unittest.TestCase):
    def test_version_and_help(self):
        status, out, _ = program("--version")
        self.assertEqual(status, 0)
        self.assertRegex(out, r"\d+\.\d+\.\d+")
        status, out, err = program("--help")
        self.assertEqual(status, 0)
        for flag in ("--listen", "--data", "--workers", "--config", "--token-file"):
            self.assertIn(flag, out + err)

    def test_wrong_usage_is_2_with_a_sentence(self):
        folder = temporary_folder()
        for args in (("--frobnicate",), ("--listen",), ("--listen", "127.0.0.1"),
                     ("--listen", "127.0.0.1:99999"), ("--listen", "nowhere:x"),
                     ("--workers", "0", "--data", folder), ("--workers", "-3", "--data", folder),
                     ("--workers", "two", "--data", folder),
                     ("--workers", "99999999999", "--data", folder), ("stray",),
                     ("--config", folder / "none")):
            with self.subTest(args):
                status, out, err = program(*args)
                self.assertEqual((status, out), (2, ""), err)
                self.assertGreater(len(err.strip()), 20)

    def test_only_loopback_without_tokens(self):
        status, out, err = program("--listen", "0.0.0.0:0", "--data", temporary_folder())
        self.assertEqual((status, out), (2, ""), err)
        self.assertRegex(err, "loopback|token")

    def test_check_config_starts_nothing(self):
        folder = temporary_folder()
        status, out, err = program("--check-config", "--listen", "127.0.0.1:0", "--data", folder)
        self.assertEqual(status, 0, err)
        self.assertNotIn("ready", out)

    def test_one_ready_line_and_a_new_folder(self):
        folder = temporary_folder() / "made" / "on" / "the way"
        daemon = Daemon(folder).ready()
        self.assertEqual(daemon.get("/v1/scenes").json(), {"scenes": []})
        self.assertTrue((folder / "scenes").is_dir())
        daemon.stop()  # checks that standard output was one line

    def test_unix_socket(self):
        folder = data_folder("room")
        path = folder / "socket"
        daemon = Daemon(folder, listen="unix:%s" % path)
        wait_until(lambda: daemon.out or daemon.process.poll() is not None, "a line")
        self.assertEqual(daemon.out, ["ready unix:%s\n" % path], daemon.stderr())
        with socket.socket(socket.AF_UNIX) as connection:
            connection.connect(str(path))
            connection.sendall(b"GET /v1/health/live HTTP/1.1\r\nHost: localhost\r\n"
                               b"Connection: close\r\n\r\n")
            self.assertTrue(connection.recv(100).startswith(b"HTTP/1.1 200"))
        daemon.stop()

    def test_second_daemon_on_the_folder_is_refused(self):
        daemon = Daemon(data_folder("room")).ready()
        status, out, err = program("--listen", "127.0.0.1:0", "--data", daemon.folder)
        self.assertIn(status, (1, 2))
        self.assertEqual(out, "")
        self.assertIn(str(daemon.folder), err)
        self.assertEqual(daemon.get("/v1/health/live").status, 200)
        daemon.stop()
        Daemon(daemon.folder).ready().stop()  # the lock goes with its owner

    def test_the_lock_of_a_killed_daemon_is_free(self):
        daemon = Daemon(data_folder("room")).ready()
        daemon.kill()
        again = Daemon(daemon.folder).ready()
        again.scene("room")
        self.assertEqual(again.render(QUICK)["state"], "done")
        again.stop()

    def test_port_in_use(self):
        with socket.create_server(("127.0.0.1", 0)) as taken:
            port = taken.getsockname()[1]
            status, out, err = program("--listen", "127.0.0.1:%d" % port, "--data",
                                       temporary_folder())
        self.assertIn(status, (1, 2))
        self.assertEqual(out, "")
        self.assertIn(str(port), err)

    def test_folder_that_cannot_be(self):
        file = temporary_folder() / "file"
        file.write_text("x")
        status, out, err = program("--listen", "127.0.0.1:0", "--data", file)
        self.assertIn(status, (1, 2))
        self.assertEqual(out, "")
        self.assertIn(str(file), err)


class Scenes(unittest.TestCase):
    def setUp(self):
        self.daemon = Daemon(data_folder("room")).ready()
        self.daemon.scene("room")
        self.folder = self.daemon.folder / "scenes"

    def tearDown(self):
        self.daemon.stop()

    def state(self, name):
        answer = self.daemon.get("/v1/scenes/" + name)
        return answer.json() if answer.status == 200 else {"state": None}

    def drop(self, name, data):
        """As an operator should: whole or not at all."""
        (self.folder / ".incoming").write_bytes(data)
        (self.folder / ".incoming").rename(self.folder / (name + ".lps"))

    def test_dropped_in_while_running(self):
        self.drop("sphere", (scenes() / "sphere.lps").read_bytes())
        document = self.daemon.scene("sphere")
        d = self.daemon.render({**QUICK, "scene": "sphere", "probes": [document["suggested_probe"]]})
        self.assertEqual(d["scene"], {"name": "sphere", "sha256": document["sha256"]})

    def test_copied_in_slowly(self):
        """`cp` of a large file: what is there at first is half of it."""
        data = (scenes() / "sphere.lps").read_bytes()
        with open(self.folder / "slow.lps", "wb") as file:
            file.write(data[: len(data) // 2])
            file.flush()
            wait_until(lambda: self.state("slow")["state"], "the half file is noticed")
            file.write(data[len(data) // 2 :])
        wait_until(lambda: self.state("slow")["state"] == "ready", "the whole file is taken")

    def test_corrupted_is_failed_with_a_reason(self):
        good = bytearray((scenes() / "sphere.lps").read_bytes())
        for name, change in (("flipped", lambda b: b[:5000] + bytes([b[5000] ^ 1]) + b[5001:]),
                             ("cut", lambda b: b[: len(b) // 2]), ("empty", lambda b: b""),
                             ("text", lambda b: b"hello"), ("tail", lambda b: b + b"\0")):
            with self.subTest(name):
                self.drop(name, bytes(change(bytes(good))))
                wait_until(lambda: self.state(name)["state"] == "failed", name + " fails")
                self.assertGreater(len(self.state(name)["reason"].split()), 3)
                answer = self.daemon.request("POST", "/v1/render", {**QUICK, "scene": name})
                self.assertIn(answer.status, (409, 422, 503))
                self.assertIn(name, answer.json()["detail"])
        listed = {s["name"]: s["state"] for s in self.daemon.get("/v1/scenes").json()["scenes"]}
        self.assertEqual(listed["room"], "ready")
        self.assertEqual(listed["cut"], "failed")

    def test_mended(self):
        self.drop("again", b"broken")
        wait_until(lambda: self.state("again")["state"] == "failed", "fails at first")
        self.drop("again", (scenes() / "sphere.lps").read_bytes())
        wait_until(lambda: self.state("again")["state"] == "ready", "ready once mended")

    def test_replaced(self):
        before = self.daemon.render(QUICK)
        cli_ok("build", "procedural:room", "--depth", 5, "--size-m", 8, "-o", self.folder / "room.lps")
        wait_until(lambda: self.state("room").get("depth") == 5, "the new room is taken")
        after = self.daemon.render(QUICK)
        self.assertNotEqual(before["scene"]["sha256"], after["scene"]["sha256"])

    def test_removed(self):
        (self.folder / "room.lps").unlink()
        wait_until(lambda: self.daemon.get("/v1/scenes/room").status == 404, "the room is gone")
        self.assertEqual(self.daemon.request("POST", "/v1/render", QUICK).status, 404)

    def test_other_files_are_no_scenes(self):
        for name in (".hidden.lps", "notes.txt", "room.lps.part", "bad name.lps", "dünen.lps"):
            (self.folder / name).write_bytes(b"x")
        (self.folder / "folder.lps").mkdir()
        self.drop("marker", (scenes() / "sphere.lps").read_bytes())
        self.daemon.scene("marker")  # the folder was looked through after all of them
        names = {s["name"] for s in self.daemon.get("/v1/scenes").json()["scenes"]}
        self.assertEqual(names - {"folder"}, {"room", "marker"})

    def test_links_out_of_the_folder_are_not_followed(self):
        outside = temporary_folder() / "outside.lps"
        shutil.copy(scenes() / "sphere.lps", outside)
        (self.folder / "link.lps").symlink_to(outside)
        self.drop("marker", (scenes() / "sphere.lps").read_bytes())
        self.daemon.scene("marker")
        self.assertIn(self.state("link")["state"], (None, "failed"))

    def test_truncated_in_place_while_rendering(self):
        """The rule is never to change a file in place; breaking it must not kill the daemon."""
        job = job_of_seconds(self.daemon, 2)
        render = Background(self.daemon, job)
        wait_until(lambda: running(self.daemon) or not render.is_alive(), "the render runs")
        with open(self.folder / "room.lps", "r+b") as file:
            file.truncate(4096)
        render.join(10 * LIMIT_S)
        self.assertFalse(render.is_alive())
        self.assertEqual(self.daemon.get("/v1/health/live").status, 200)
        self.drop("other", (scenes() / "sphere.lps").read_bytes())
        probe = self.daemon.scene("other")["suggested_probe"]
        self.daemon.render({**QUICK, "scene": "other", "probes": [probe]})

    def test_restart_opens_a_verified_scene_at_once(self):
        self.daemon.stop()
        self.daemon = Daemon(self.daemon.folder).ready()
        document = self.daemon.scene("room")
        self.assertLess(document["open_seconds"], 0.010)

    def test_a_changed_file_is_verified_again(self):
        self.daemon.stop()
        data = bytearray((self.folder / "room.lps").read_bytes())
        data[-200] ^= 1
        (self.folder / "room.lps").write_bytes(data)
        self.daemon = Daemon(self.daemon.folder).ready()
        wait_until(lambda: self.state("room")["state"] == "failed", "the damage is noticed")


class End(unittest.TestCase):
    def setUp(self):
        self.daemon = Daemon(data_folder("room")).ready()
        self.daemon.scene("room")

    def tearDown(self):
        self.daemon.kill()

    def test_sigterm_when_idle(self):
        self.daemon.stop()

    def test_sigint_too(self):
        self.daemon.signal(signal.SIGINT)
        self.assertEqual(self.daemon.wait(), 0)

    def test_sigterm_drains(self):
        """A render that runs is finished and its client gets it; then the daemon ends with 0."""
        render = Background(self.daemon, job_of_seconds(self.daemon, 2))
        wait_until(lambda: running(self.daemon) or not render.is_alive(), "the render runs")
        self.daemon.signal()
        render.join(10 * LIMIT_S)
        self.assertIsNone(render.error)
        self.assertEqual(render.answer.status, 200, render.answer.body[:300])
        self.assertEqual(render.answer.json()["state"], "done")
        self.assertEqual(self.daemon.wait(), 0)

    def test_draining_says_so(self):
        """While it drains, new work is refused: 503 with Retry-After, or no connection at all."""
        render = Background(self.daemon, job_of_seconds(self.daemon, 4))
        wait_until(lambda: running(self.daemon) or not render.is_alive(), "the render runs")
        self.daemon.signal()

        def draining():
            try:
                answer = self.daemon.get("/v1/health/ready")
            except OSError:
                return "closed"
            return answer if answer.status == 503 else None

        answer = wait_until(draining, "draining is announced")
        if answer != "closed":
            self.assertEqual(answer.json()["reason"], "draining")
            refused = self.daemon.request("POST", "/v1/render", QUICK)
            self.assertEqual(refused.status, 503)
            self.assertGreater(int(refused.headers["Retry-After"]), 0)
        render.join(10 * LIMIT_S)
        self.assertEqual(self.daemon.wait(), 0)

    def test_second_sigterm_cancels(self):
        endless = {**QUICK, "face_px": 4096, "samples_per_axis": 16}  # many minutes
        render = Background(self.daemon, endless)
        wait_until(lambda: running(self.daemon) or not render.is_alive(), "the render runs")
        self.assertTrue(render.is_alive(), render.answer and render.answer.body)
        self.daemon.signal()

        def noticed():
            try:
                return self.daemon.get("/v1/health/ready").status == 503
            except OSError:
                return True

        wait_until(noticed, "the first signal is noticed")
        self.assertIsNone(self.daemon.process.poll())
        self.daemon.signal()
        self.assertEqual(self.daemon.wait(9), 0)  # less than the ten seconds of a drain
        render.join(LIMIT_S)
        self.assertFalse(render.is_alive())
        self.assertTrue(render.error or render.answer.status == 503)

    def test_two_sigterms_in_a_row(self):
        """The second may come at any moment of the end, and never is what ends the process."""
        for i in range(8):
            with self.subTest(i):
                if i:
                    self.daemon = Daemon(self.daemon.folder).ready()
                self.daemon.signal()
                time.sleep(0.0005 * i)
                self.daemon.signal(signal.SIGINT if i % 2 else signal.SIGTERM)
                self.assertEqual(self.daemon.wait(), 0)

    def test_many_sigterms(self):
        """Until the process is gone, so that each part of the end gets some."""
        while self.daemon.process.poll() is None:
            self.daemon.signal()
        self.assertEqual(self.daemon.wait(), 0)

    def test_not_ready_after_sigterm(self):
        """Whoever sees `ready` may send work: after a signal that would be a lie."""
        self.daemon.stop()
        for i in range(8):
            daemon = Daemon(data_folder("room", "sphere", "hills"))
            wait_until(lambda: (daemon.folder / "results").exists() or daemon.out, "it starts")
            time.sleep(0.001 * i)
            daemon.signal()
            status = daemon.wait()
            log = daemon.stderr()
            # Very early the signal ends it as it would any program: nothing was promised yet.
            self.assertIn(status, (0, -signal.SIGTERM), log)
            self.assertNotIn("event=ready", log.partition("event=signal")[2])

    def test_the_backlog_is_answered(self):
        """Connections that the system took in before the signal are answered, not reset."""
        self.daemon.signal(signal.SIGSTOP)
        clients = [self.daemon.connect() for _ in range(400)]
        for client in clients:
            client.sendall(b"GET /v1/health/live HTTP/1.1\r\nHost: localhost\r\n\r\n")
        self.daemon.signal()
        self.daemon.signal(signal.SIGCONT)
        answers = [read_response(client) for client in clients]
        for client in clients:
            client.close()
        self.assertEqual([a.status if a else None for a in answers], [200] * len(clients))
        self.assertEqual(self.daemon.wait(), 0)

    def test_a_client_that_leaves_cancels_its_work(self):
        body = json.dumps({**QUICK, "face_px": 4096, "samples_per_axis": 16}).encode()
        connection = self.daemon.connect()
        connection.sendall(b"POST /v1/render HTTP/1.1\r\nHost: 127.0.0.1:%d\r\nContent-Length: %d"
                           b"\r\n\r\n" % (self.daemon.port, len(body)) + body)
        wait_until(lambda: running(self.daemon), "the render runs")
        connection.close()
        wait_until(lambda: not running(self.daemon), "the work is given up")
        self.daemon.stop()

    def test_nothing_is_left_in_the_folder_but_what_belongs(self):
        self.daemon.render(QUICK)
        self.daemon.stop()
        left = [p for p in self.daemon.folder.rglob("*") if p.name.endswith((".tmp", ".part"))]
        self.assertEqual(left, [])


if __name__ == "__main__":
    unittest.main()
