"""The same request and scene give the same film, counters and files, whoever computes them."""

import hashlib
import json
import os
import unittest

from harness import Daemon, cli_ok, data_folder, scenes, temporary_folder

JOBS = [
    {"scene": "room", "mode": "reference", "face_px": 50, "samples_per_axis": 3,
     "probes": [[0.3, 0.2, -0.7]], "lighting": "lamp"},
    {"scene": "sphere", "mode": "lod", "face_px": 65, "probes": [[1.7, 1.1, -0.4]],
     "environment": {"constant": [0.1, 0.7, 3.0]}},
    {"scene": "hills", "mode": "reference", "face_px": 64, "samples_per_axis": 2,
     "probes": [[0.0, 18.0, 0.0]]},
    {"scene": "hills", "mode": "lod", "levels": "fixed", "face_px": 33, "faces": ["-Y", "+Z"],
     "probes": [[3.0, 14.5, -8.25]]},
]


def essence(document):
    """What must agree: film, counters, pictures."""
    probe = document["probes"][0]
    return (probe["film_sha256"], probe["counters"],
            [(i["sha256"], i["bytes"]) for i in probe["images"]], document["scene"]["sha256"])


def by_daemon(jobs, **options):
    daemon = Daemon(data_folder("room", "sphere", "hills"), **options).ready()
    for name in ("room", "sphere", "hills"):
        daemon.scene(name)
    found = [essence(daemon.render({**job, "images": ["png", "exr"]})) for job in jobs]
    daemon.stop()
    return found


class Determinism(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.expected = by_daemon(JOBS, workers=1)

    def test_four_workers(self):
        self.assertEqual(by_daemon(JOBS, workers=4), self.expected)

    def test_films_differ_between_jobs(self):
        self.assertEqual(len({e[0] for e in self.expected}), len(JOBS))

    def test_command_line(self):
        for job, expected in zip(JOBS, self.expected):
            with self.subTest(job):
                folder = temporary_folder()
                request = folder / "job.json"
                request.write_text(json.dumps({**job, "images": ["png", "exr"]}))
                out = folder / "out"
                cli_ok("render", scenes() / (job["scene"] + ".lps"), "--request", request, "-o", out)
                documents = [json.loads(p.read_text()) for p in out.glob("*.json")]
                self.assertEqual(len(documents), 1)
                self.assertEqual(essence(documents[0]), expected)
                for image in documents[0]["probes"][0]["images"]:
                    data = (out / os.path.basename(image["href"])).read_bytes()
                    self.assertEqual(hashlib.sha256(data).hexdigest(), image["sha256"])

    def test_scene_files(self):
        """Building is repeatable, byte for byte."""
        folder = temporary_folder()
        cli_ok("build", "procedural:room", "--depth", 7, "--size-m", 8, "-o", folder / "room.lps")
        self.assertEqual((folder / "room.lps").read_bytes(), (scenes() / "room.lps").read_bytes())


if __name__ == "__main__":
    unittest.main()
