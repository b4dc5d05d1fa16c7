"""The command line as a process: commands, exit statuses, sentences, and damaged scene files."""

import json
import os
import random
import subprocess
import unittest

import harness
import picture
from harness import Daemon, cli, cli_ok, data_folder, scenes, temporary_folder

JOB = {"scene": "room", "mode": "reference", "face_px": 16, "samples_per_axis": 2,
       "probes": [[0.1, 0.2, 0.3]], "images": ["png", "exr"]}


def job_file(folder, job):
    path = folder / "job.json"
    path.write_text(job if isinstance(job, str) else json.dumps(job))
    return path


class Usage(unittest.TestCase):
    def test_help(self):
        whole = cli_ok("--help").out
        for command in ("build", "info", "verify", "render", "scenes", "stats"):
            self.assertIn(command, whole)
            text = cli_ok(command, "--help").out
            self.assertIn("lightprobe " + command, text)
        self.assertRegex(cli_ok("--version").out, r"\d+\.\d+\.\d+")

    def test_wrong_usage_is_2_in_one_line(self):
        for args in ((), ("frobnicate",), ("buidl",), ("build",), ("build", "--depth"),
                     ("build", "x.png", "--depth", "ten", "-o", "x.lps"), ("info",),
                     ("info", "--frob"), ("build", "procedural:house", "-o", "x.lps"),
                     ("build", "procedural:room"), ("render",), ("render", "room.lps"), ("verify",),
                     ("build", "h.png", "--size-m", "-3", "-o", "x.lps"),
                     ("build", "h.png", "--size-m", "nan", "--height-m", "1", "-o", "x.lps"),
                     ("errors",)):
            with self.subTest(args):
                done = cli(*args, cwd=temporary_folder())
                self.assertEqual((done.code, done.out), (2, ""), done.err)
                self.assertEqual(len(done.err.strip().splitlines()), 1, done.err)
                self.assertTrue(done.err.startswith("lightprobe"), done.err)
                self.assertGreater(len(done.err), 25)


class FullDisk(unittest.TestCase):
    def test_output_that_does_not_arrive_is_a_failure(self):
        room = scenes() / "room.lps"
        for args in (["--help"], ["info", room], ["verify", room]):
            with open("/dev/full", "wb") as full:
                done = subprocess.run([str(harness.BUILD / "lightprobe"), *map(str, args)],
                                      stdout=full, stderr=subprocess.PIPE,
                                      env=harness.ENVIRONMENT, timeout=60)
            self.assertEqual(done.returncode, 1, args)
            self.assertIn(b"standard output", done.stderr)


class Build(unittest.TestCase):
    def failed(self, *args, words=()):
        folder = temporary_folder()
        done = cli("build", *args, "-o", folder / "out.lps", cwd=folder)
        self.assertIn(done.code, (1, 2), done.err)
        self.assertEqual(len(done.err.strip().splitlines()), 1, done.err)
        for word in words:
            self.assertIn(word, done.err)
        self.assertEqual([p.name for p in folder.glob("*.lps*")], [], "nothing half is left")

    def test_bad_sources(self):
        folder = temporary_folder()
        (folder / "text.png").write_text("hello")
        (folder / "empty.png").write_text("")
        good = picture.png_write(16, 16, [[100] * 16] * 16)
        (folder / "good.png").write_bytes(good)
        (folder / "cut.png").write_bytes(good[: len(good) - 30])
        (folder / "wide.png").write_bytes(picture.png_write(16, 8, [[100] * 16] * 8))
        size = ("--size-m", 16, "--height-m", 4, "--depth", 5)
        for name in ("none.png", "text.png", "empty.png", "cut.png", "wide.png"):
            with self.subTest(name):
                self.failed(folder / name, *size, words=(name,))
        for name in ("none.png", "text.png", "wide.png"):
            with self.subTest(color=name):
                self.failed(folder / "good.png", "--color", folder / name, *size, words=(name,))
        for depth in (0, 15, 99, -1):
            with self.subTest(depth=depth):
                self.failed(folder / "good.png", "--size-m", 16, "--height-m", 4, "--depth", depth,
                            words=("depth",))
        for depth in (2, 12):
            self.failed("procedural:room", "--depth", depth, words=("depth",))

    def test_every_truncation_of_a_picture_is_survived(self):
        folder = temporary_folder()
        good = picture.png_write(4, 4, [[50, 100, 150, 200]] * 4)
        path = folder / "h.png"
        for end in range(0, len(good) - 12, 3 if harness.SLOW else 1):
            path.write_bytes(good[:end])
            done = cli("build", path, "--size-m", 4, "--height-m", 1, "--depth", 3, "-o",
                       folder / "h.lps")
            if done.code == 0:  # the pixels may be there even where the file's end is not
                self.assertGreater(end, len(good) - 40)
            else:
                self.assertEqual(done.code, 1)

    def test_where_the_scene_cannot_go(self):
        folder = temporary_folder()
        done = cli("build", "procedural:room", "--depth", 4, "-o", folder / "no" / "room.lps")
        self.assertEqual(done.code, 1)
        self.assertIn("no", done.err)

    def test_replaces_an_older_scene(self):
        path = temporary_folder() / "room.lps"
        for depth in (4, 5):
            cli_ok("build", "procedural:room", "--depth", depth, "-o", path)
            self.assertEqual(json.loads(cli_ok("info", path, "--json").out)["depth"], depth)

    def test_filters_differ_in_coarse_colours_only(self):
        folder = temporary_folder()
        for name in ("mean", "visible"):
            cli_ok("build", "procedural:sphere", "--depth", 5, "--filter", name, "-o",
                   folder / (name + ".lps"))
        mean, visible = (json.loads(cli_ok("info", folder / (n + ".lps"), "--json").out)
                         for n in ("mean", "visible"))
        self.assertEqual(mean["voxels"], visible["voxels"])
        self.assertEqual((mean["filter"], visible["filter"]), ("mean", "visible"))
        self.assertNotEqual(mean["sha256"], visible["sha256"])

    def test_progress_is_no_part_of_the_output(self):
        folder = temporary_folder()
        done = cli_ok("build", "procedural:room", "--depth", 6, "--json", "-o", folder / "r.lps")
        json.loads(done.out)
        self.assertNotIn("\r", done.err)  # plain lines where there is no terminal


class InfoAndVerify(unittest.TestCase):
    def test_info_is_the_daemons_document(self):
        daemon = Daemon(data_folder("room")).ready()
        served = daemon.scene("room")
        daemon.stop()
        told = json.loads(cli_ok("info", scenes() / "room.lps", "--json").out)
        for volatile in ("open_seconds", "refs"):
            served.pop(volatile, None)
            told.pop(volatile, None)
        self.assertEqual(told, served)
        self.assertIn("voxels", cli_ok("info", scenes() / "room.lps").out)

    def test_verify(self):
        self.assertIn("ok", cli_ok("verify", scenes() / "room.lps").out)
        bad = temporary_folder() / "bad.lps"
        bad.write_bytes(b"hello")
        done = cli("verify", scenes() / "room.lps", bad, scenes() / "sphere.lps")
        self.assertEqual(done.code, 1)
        lines = (done.out + done.err).strip().splitlines()
        self.assertEqual(len(lines), 3, lines)
        done = cli("verify", "--json", scenes() / "room.lps", bad)
        self.assertEqual([json.loads(line)["ok"] for line in done.out.splitlines()], [True, False])

    def test_files_that_are_none(self):
        folder = temporary_folder()
        for command in ("info", "verify"):
            for path in (folder / "none.lps", folder):
                done = cli(command, path)
                self.assertEqual(done.code, 1)
                self.assertIn(str(path), done.out + done.err)


class Damage(unittest.TestCase):
    """A scene file with any damage is refused with a sentence. One process checks many files."""

    @classmethod
    def setUpClass(cls):
        cls.folder = temporary_folder()
        cls.path = cls.folder / "small.lps"
        cli_ok("build", "procedural:sphere", "--depth", 3, "-o", cls.path)
        cls.good = cls.path.read_bytes()

    def refused(self, damaged):
        """{label: bytes} must all be refused, each in a line of its own; returns the sentences."""
        sentences, labels = {}, list(damaged)
        for start in range(0, len(labels), 256):
            part = labels[start : start + 256]
            paths = []
            for i, label in enumerate(part):
                paths.append(self.folder / ("%d.lps" % i))
                paths[-1].write_bytes(damaged[label])
            done = cli("verify", "--json", *paths)
            lines = [json.loads(line) for line in done.out.splitlines()]
            self.assertEqual(len(lines), len(part), done.err)
            for label, line in zip(part, lines):
                self.assertFalse(line["ok"], "%s was taken for good" % (label,))
                self.assertGreater(len(line["defect"]), 12)
                sentences[label] = line["defect"]
            self.assertEqual(done.code, 1)
        return sentences

    def flip(self, at, bit):
        b = bytearray(self.good)
        b[at] ^= 1 << bit
        return bytes(b)

    def test_every_byte_of_header_and_table(self):
        sections = int.from_bytes(self.good[120:124], "little")
        end = 512 + 160 * sections
        self.assertGreater(sections, 1)
        damaged = {("byte", at, bit): self.flip(at, bit)
                   for at in range(end) for bit in ((0,) if harness.SLOW else (0, 7))}
        sentences = self.refused(damaged)
        self.assertGreater(len(set(sentences.values())), 5, "defects are told apart")

    def test_bytes_elsewhere(self):
        generator = random.Random(20261122)
        places = range(512, len(self.good))
        chosen = generator.sample(places, min(len(places), 600))
        chosen += list(range(len(self.good) - 64, len(self.good)))  # padding at the end
        self.refused({("byte", at): self.flip(at, generator.randrange(8)) for at in chosen})

    def test_truncations_and_tails(self):
        ends = set(range(0, 1024, 16)) | set(range(0, len(self.good), 97)) | {
            len(self.good) - 1, len(self.good) - 64}
        damaged = {("end", end): self.good[:end] for end in ends}
        damaged["one more"] = self.good + b"\0"
        damaged["twice"] = self.good * 2
        self.refused(damaged)

    def test_fields_that_lie_with_a_right_checksum_elsewhere(self):
        """Values of the header replaced by extremes: the sizes must not lead outside."""
        damaged = {}
        for at, width in ((8, 4), (12, 4), (16, 8), (32, 4), (36, 4), (120, 4), (128, 4), (132, 4),
                          (512, 4), (516, 4), (528, 8), (536, 8)):
            for value in (0, 1, 19, 2**31, 2**32 - 1, 2**63, 2**64 - 1):
                if value >= 2 ** (8 * width):
                    continue
                b = bytearray(self.good)
                b[at : at + width] = value.to_bytes(width, "little")
                if bytes(b) != self.good:
                    damaged[at, value] = bytes(b)
        self.refused(damaged)

    def test_what_is_said(self):
        told = self.refused({
            "magic": b"\x89PNG" + self.good[4:],
            "text mode": self.good.replace(b"\r\n", b"\n", 1),
            "version": self.good[:8] + (2).to_bytes(4, "little") + self.good[12:],
            "cut": self.good[: len(self.good) // 2],
        })
        self.assertRegex(told["magic"], "scene|magic")
        self.assertIn("version", told["version"])
        self.assertRegex(told["cut"], "byte|short|cut|trunc")


class Render(unittest.TestCase):
    def test_a_file(self):
        folder = temporary_folder()
        out = folder / "out"
        done = cli_ok("render", scenes() / "room.lps", "--request", job_file(folder, JOB), "-o", out)
        names = sorted(p.name for p in out.iterdir())
        self.assertEqual(len([n for n in names if n.endswith(".png")]), 1, names)
        self.assertEqual(len([n for n in names if n.endswith(".exr")]), 1, names)
        png = picture.png_read(next(out.glob("*.png")).read_bytes())
        self.assertEqual((png.width, png.height), (96, 16))
        self.assertGreater(len(done.out + done.err), 20)
        again = cli_ok("render", scenes() / "room.lps", "--request", job_file(folder, JOB), "-o",
                       out, "--json")
        self.assertEqual(json.loads(again.out)["state"], "done")

    def test_bad_jobs(self):
        folder = temporary_folder()
        for job, words in (("{", ("line", )), ({**JOB, "face_px": 0}, ("face_px",)),
                           ({**JOB, "colour": 1}, ("colour",)), ("", ()),
                           ({**JOB, "lighting": "noon"}, ("noon",))):
            with self.subTest(job):
                done = cli("render", scenes() / "room.lps", "--request", job_file(folder, job), "-o",
                           folder / "out")
                self.assertEqual(done.code, 1)
                self.assertEqual(len(done.err.strip().splitlines()), 1, done.err)
                for word in words:
                    self.assertIn(word, done.err)
        done = cli("render", scenes() / "room.lps", "--request", folder / "none.json", "-o",
                   folder / "out")
        self.assertEqual(done.code, 1)
        self.assertIn("none.json", done.err)

    def test_damaged_scene(self):
        folder = temporary_folder()
        data = bytearray((scenes() / "room.lps").read_bytes())
        data[len(data) // 2] ^= 1
        (folder / "room.lps").write_bytes(data)
        done = cli("render", folder / "room.lps", "--request", job_file(folder, JOB), "-o",
                   folder / "out")
        self.assertEqual(done.code, 1)
        self.assertIn("room.lps", done.err)
        self.assertEqual(list(folder.glob("out/*.png")), [])

    def test_a_full_disk_is_said(self):
        if not os.path.exists("/dev/full"):
            self.skipTest("no /dev/full here")

        with open("/dev/full", "w") as full:
            done = subprocess.run([str(harness.BUILD / "lightprobe"), "info", "--json",
                                   str(scenes() / "room.lps")], stdout=full,
                                  stderr=subprocess.PIPE, env=harness.ENVIRONMENT)
        self.assertEqual(done.returncode, 1)
        self.assertIn(b"space", done.stderr.lower())


class AgainstADaemon(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.daemon = Daemon(data_folder("room")).ready()
        cls.daemon.scene("room")

    @classmethod
    def tearDownClass(cls):
        cls.daemon.stop()

    def test_scenes(self):
        self.assertIn("room", cli_ok("scenes", "--server", self.daemon.url).out)
        listed = json.loads(cli_ok("scenes", "--server", self.daemon.url, "--json").out)
        self.assertEqual(listed["scenes"][0]["name"], "room")

    def test_stats(self):
        self.assertIsInstance(json.loads(cli_ok("stats", "--server", self.daemon.url, "--json").out),
                              dict)
        self.assertTrue(cli_ok("stats", "--server", self.daemon.url).out)

    def test_render(self):
        folder = temporary_folder()
        out = folder / "out"
        cli_ok("render", "--server", self.daemon.url, "--request", job_file(folder, JOB), "-o", out)
        self.assertEqual(picture.png_read(next(out.glob("*.png")).read_bytes()).width, 96)
        document = json.loads(next(out.glob("*.json")).read_text())
        self.assertEqual(document["probes"][0]["film_sha256"],
                         self.daemon.render(JOB)["probes"][0]["film_sha256"])

    def test_refusals_are_told(self):
        folder = temporary_folder()
        for job, word in (({**JOB, "scene": "moon"}, "moon"), ({**JOB, "face_px": 0}, "face_px")):
            done = cli("render", "--server", self.daemon.url, "--request", job_file(folder, job),
                       "-o", folder / "out")
            self.assertEqual(done.code, 1)
            self.assertIn(word, done.err)
            self.assertEqual(len(done.err.strip().splitlines()), 1, done.err)

    def test_no_address(self):
        for url in ("ftp://x", "x", "http://", "http://127.0.0.1:99999"):
            done = cli("stats", "--server", url)
            self.assertIn(done.code, (1, 2))
            self.assertIn(url, done.err)

    def test_no_daemon_there(self):
        for command in ("scenes", "stats"):
            done = cli(command, "--server", "http://127.0.0.1:1")
            self.assertEqual(done.code, 1)
            self.assertIn("127.0.0.1:1", done.err)
            self.assertEqual(len(done.err.strip().splitlines()), 1, done.err)


if __name__ == "__main__":
    unittest.main()
