"""Scenes under passing faults, their documents, and what admission counts."""

import os
import resource
import shutil
import unittest

import harness
from harness import Daemon, data_folder, wait_until

JOB = {"scene": "room", "mode": "lod", "face_px": 8, "probes": [[1, 0.5, -1]]}


def patient_build():
    """A folder whose lightprobed outlives the signal of a file that becomes too large, so that its
    writes fail as on a full disk."""
    folder = harness.temporary_folder()
    program = folder / "lightprobed"
    program.write_text("#!/bin/sh\ntrap '' XFSZ\nexec '%s' \"$@\"\n"
                       % (harness.BUILD / "lightprobed"))
    program.chmod(0o755)
    return folder


def put(source, folder, name):
    """A new file in place at once, as the documentation asks for."""
    shutil.copy(source, folder / "scenes" / ".new")
    os.rename(folder / "scenes" / ".new", folder / "scenes" / name)


class FullDisk(unittest.TestCase):
    """No file may grow beyond the room: larger scenes cannot be copied."""

    def setUp(self):
        self.folder = data_folder("sphere")
        self.daemon = Daemon(self.folder, build=patient_build()).ready()
        self.daemon.scene("sphere")
        size = (harness.scenes() / "sphere.lps").stat().st_size
        self.large = harness.scenes() / "room.lps"
        self.assertGreater(self.large.stat().st_size, size + 4096)
        self.limit(size)

    def tearDown(self):
        self.daemon.stop()

    def limit(self, size):
        hard = resource.prlimit(self.daemon.process.pid, resource.RLIMIT_FSIZE)[1]
        resource.prlimit(self.daemon.process.pid, resource.RLIMIT_FSIZE, (size, hard))

    def delayed(self, name):
        def look():
            answer = self.daemon.get("/v1/scenes/" + name)
            return answer.status == 200 and answer.json().get("reason") and answer.json()

        return wait_until(look, name + " shows a reason")

    def test_old_scene_goes_on_and_new_one_comes_when_there_is_room(self):
        old = self.daemon.scene("sphere")["sha256"]
        put(self.large, self.folder, "sphere.lps")
        shown = self.delayed("sphere")
        self.assertEqual((shown["state"], shown["sha256"]), ("ready", old))
        self.assertIn("cannot be written", shown["reason"])
        self.assertEqual(self.daemon.render(JOB | {"scene": "sphere"})["scene"]["sha256"], old)
        self.limit(resource.RLIM_INFINITY)
        wait_until(lambda: self.daemon.scene("sphere")["sha256"] != old, "the new scene is taken")
        self.assertNotIn("reason", self.daemon.scene("sphere"))

    def test_new_scene_is_not_ready_and_not_failed(self):
        put(self.large, self.folder, "large.lps")
        self.assertEqual(self.delayed("large")["state"], "loading")
        answer = self.daemon.request("POST", "/v1/render", JOB | {"scene": "large"})
        self.assertEqual(answer.status, 503)
        self.assertEqual(answer.json()["type"], "/problems/scene-not-ready")
        self.assertIn("cannot be written", answer.json()["detail"])
        self.limit(resource.RLIM_INFINITY)
        self.assertEqual(self.daemon.scene("large")["state"], "ready")


class Documents(unittest.TestCase):
    def test_list_holds_the_documents_and_counts_jobs(self):
        folder = data_folder("room", "sphere")
        (folder / "scenes" / "bad.lps").write_bytes(b"no scene" * 100)
        daemon = Daemon(folder, workers=1).ready()
        daemon.scene("room")
        daemon.scene("sphere")
        wait_until(lambda: daemon.get("/v1/scenes/bad").json()["state"] == "failed", "bad fails")

        def listed():
            return {s["name"]: s for s in daemon.get("/v1/scenes").json()["scenes"]}

        self.assertEqual(sorted(listed()), ["bad", "room", "sphere"])
        for name, document in listed().items():
            self.assertEqual(document, daemon.get("/v1/scenes/" + name).json())
        self.assertEqual(listed()["room"]["refs"], 0)
        job = JOB | {"mode": "reference", "face_px": 1024, "samples_per_axis": 8}
        body = harness.json.dumps(job).encode()
        head = b"POST /v1/render HTTP/1.1\r\nHost: %s:%d\r\nContent-Length: %d\r\n\r\n" % (
            daemon.host.encode(), daemon.port, len(body))
        with daemon.connect() as first, daemon.connect() as second:
            first.sendall(head + body)
            second.sendall(head + body)
            wait_until(lambda: listed()["room"]["refs"] == 2, "two jobs hold the room")
            self.assertEqual(daemon.get("/v1/scenes/room").json()["refs"], 2)
            self.assertEqual(listed()["sphere"]["refs"], 0)
        wait_until(lambda: listed()["room"]["refs"] == 0, "nobody holds it")
        daemon.stop()


class Admission(unittest.TestCase):
    def test_memory_of_the_accepts_picture_counts(self):
        daemon = Daemon(data_folder("room"), args=("--memory-limit-mib", 16)).ready()
        daemon.scene("room")
        job = JOB | {"face_px": 230, "images": []}  # 14.5 MiB, and 3.6 for a picture
        self.assertEqual(daemon.request("POST", "/v1/render", job).status, 200)
        answer = daemon.request("POST", "/v1/render", job, {"Accept": "image/x-exr"})
        self.assertEqual(answer.status, 422)
        self.assertEqual(answer.json()["type"], "/problems/over-limit")
        named = daemon.request("POST", "/v1/render", job | {"images": ["exr"]})
        self.assertEqual(named.status, 422)  # the same picture by its other name
        daemon.stop()


if __name__ == "__main__":
    unittest.main()
