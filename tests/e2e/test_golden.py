"""Golden images: small strips of three scenes in both modes, compared with written tolerances.

    python3 tests/e2e/test_golden.py --renew      (`make golden`)

renews tests/golden; then look at every picture, and say in the commit why they changed.
"""

import os
import sys
import unittest

import harness
import picture
from harness import Daemon, data_folder

GOLDEN = harness.ROOT / "tests" / "golden"

# The film is exact on every machine and the PNG is made of it by a table, so no channel of any
# pixel may differ at all: not by one code.
TOLERANCE_CODES = 0

CASES = {  # file: job; 32 pixels a face keep each at a few KB
    "%s-%s" % (scene, mode): {
        "scene": scene, "mode": mode, "face_px": 32, "probes": [probe],
        "environment": {"constant": [0.2, 0.4, 0.8]},
        **({"samples_per_axis": 4} if mode == "reference" else {}),
    }
    for scene, probe in (("room", [-1.5, 1.0, 0.5]), ("sphere", None), ("hills", [4.0, 16.0, 6.0]))
    for mode in ("reference", "lod")
}


def render_all():
    """{name: PNG bytes} from the daemon of this build."""
    daemon = Daemon(data_folder("room", "sphere", "hills")).ready()
    pictures = {}
    for name, job in CASES.items():
        info = daemon.scene(job["scene"])
        low, high = harness.bounds(info)
        if job["probes"] == [None]:
            job = {**job, "probes": [info["suggested_probe"]]}
        elif job["scene"] == "room":  # given from the centre of the room
            job = {**job, "probes": [[(l + h) / 2 + d for l, h, d in
                                      zip(low, high, job["probes"][0])]]}
        answer = daemon.request("POST", "/v1/render", job, {"Accept": "image/png"})
        assert answer.status == 200, answer.body
        pictures[name] = answer.body
    daemon.stop()
    return pictures


class Golden(unittest.TestCase):
    def test_pictures(self):
        self.assertEqual(sorted(p.stem for p in GOLDEN.glob("*.png")), sorted(CASES))
        for name, data in render_all().items():
            with self.subTest(name):
                want = picture.png_read((GOLDEN / (name + ".png")).read_bytes())
                got = picture.png_read(data)
                self.assertEqual((got.width, got.height), (want.width, want.height))
                worst, place = max(
                    (max(abs(a - b) for a, b in zip(got.at(x, y), want.at(x, y))), (x, y))
                    for y in range(got.height) for x in range(got.width))
                self.assertLessEqual(worst, TOLERANCE_CODES, "differs by %d codes at %s; if that "
                                     "is meant: make golden" % (worst, place))

    def test_no_two_are_alike(self):
        """A golden picture of nothing would never fail."""
        seen = {}
        for path in GOLDEN.glob("*.png"):
            strip = picture.png_read(path.read_bytes())
            colours = {strip.at(x, y) for y in range(strip.height) for x in range(strip.width)}
            self.assertGreaterEqual(len(colours), 6, path.name)
            rows = tuple(map(bytes, strip.rows))
            self.assertNotIn(rows, seen, "%s and %s" % (path.name, seen.get(rows)))
            seen[rows] = path.name


def renew():
    GOLDEN.mkdir(exist_ok=True)
    for old in GOLDEN.glob("*.png"):
        old.unlink()
    for name, data in render_all().items():
        (GOLDEN / (name + ".png")).write_bytes(data)
        print("%s (%d bytes)" % ((GOLDEN / (name + ".png")).relative_to(harness.ROOT), len(data)))


if __name__ == "__main__":
    if sys.argv[1:] == ["--renew"]:
        os.environ.pop("LP_E2E_TEMP", None)
        renew()
    else:
        unittest.main()
