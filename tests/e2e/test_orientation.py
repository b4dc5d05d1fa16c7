"""Every texel of every face against analytic geometry: orientation, seams, sizes, heights.

The room is a box whose walls have six colours, the terrain a plane in four colours or two plateaus;
what a texel must see follows from the table of directions (cube.py) and an intersection in closed
form. Where the geometry is finer than a voxel (an edge), a stated margin is left out.
"""

import math
import unittest

import cube
import harness
import picture
from harness import Daemon, cli_ok, data_folder, room_box, room_walls, temporary_folder

FACE_PX = 64
PROBES = (  # off-centre in every axis, so that no two faces look alike: fractions of the room
    (0.31, 0.62, 0.43),
    (0.83, 0.12, 0.71),
    (0.5, 0.5, 0.5),
)


def setUpModule():
    global daemon
    daemon = Daemon(data_folder("room", "sphere", "hills")).ready()


def tearDownModule():
    daemon.stop()


def edge_distance(point, face, low, high):
    """How far a point on a wall is from the nearest other wall."""
    axis = cube.FACES.index(face) // 2
    return min(min(point[a] - low[a], high[a] - point[a]) for a in range(3) if a != axis)


class Room(unittest.TestCase):
    def setUp(self):
        self.info = daemon.scene("room")
        self.low, self.high = room_box(self.info)
        self.walls = room_walls()

    def at(self, fractions):
        return [l + f * (h - l) for f, l, h in zip(fractions, self.low, self.high)]

    def compare(self, strip, n, probe, margin_of):
        """Compares every texel; returns (compared, left out). margin_of(t) in metres."""
        compared = left_out = 0
        for index, face in enumerate(cube.FACES):
            for y in range(n):
                for x in range(n):
                    d = cube.direction(face, x, y, n)
                    wall, t, point = cube.inside_box(probe, d, self.low, self.high)
                    if edge_distance(point, wall, self.low, self.high) < margin_of(t):
                        left_out += 1
                        continue
                    compared += 1
                    self.assertEqual(cube.strip_at(strip, n, index, x, y), self.walls[wall],
                                     "face %s texel (%d, %d) looks at wall %s" % (face, x, y, wall))
        return compared, left_out

    def test_every_texel_sees_its_wall(self):
        self.assertEqual(len(set(self.walls.values())), 6)
        for fractions in PROBES:
            with self.subTest(probe=fractions):
                probe = self.at(fractions)
                strip = daemon.render_png({"scene": "room", "mode": "reference", "probes": [probe],
                                           "samples_per_axis": 1, "face_px": FACE_PX})
                voxel = self.info["voxel_size_m"]
                compared, left_out = self.compare(strip, FACE_PX, probe, lambda t: voxel)
                # the margin is two strips of one voxel along 12 edges: a few per cent
                self.assertLess(left_out, 0.1 * compared)

    def test_every_texel_sees_its_wall_at_the_cones_level(self):
        for fractions in PROBES:
            with self.subTest(probe=fractions):
                probe = self.at(fractions)
                strip = daemon.render_png({"scene": "room", "mode": "lod", "probes": [probe],
                                           "face_px": FACE_PX})
                # a node's edge is at most t * 2 / n, and the ray is cut at its near side, so two
                # such edges, and a voxel for the nodes that are one
                margin = lambda t: 2 * t * 2 / FACE_PX + self.info["voxel_size_m"]
                compared, left_out = self.compare(strip, FACE_PX, probe, margin)
                self.assertLess(left_out, 0.5 * compared)

    def test_a_wall_fills_its_face_seen_from_the_centre(self):
        strip = daemon.render_png({"scene": "room", "mode": "reference",
                                   "probes": [self.at((0.5, 0.5, 0.5))], "face_px": 8,
                                   "samples_per_axis": 1})
        for index, face in enumerate(cube.FACES):
            for y in range(1, 7):
                for x in range(1, 7):
                    self.assertEqual(cube.strip_at(strip, 8, index, x, y), self.walls[face], face)

    def test_odd_and_tiny_faces(self):
        probe = self.at(PROBES[0])
        for n in (1, 2, 3, 33):
            with self.subTest(n=n):
                strip = daemon.render_png({"scene": "room", "mode": "reference", "probes": [probe],
                                           "samples_per_axis": 1, "face_px": n})
                self.assertEqual((strip.width, strip.height), (6 * n, n))
                self.compare(strip, n, probe, lambda t: self.info["voxel_size_m"])

    def test_sub_samples_are_the_texels_of_a_finer_face(self):
        """samples_per_axis 4 at n is the mean of samples_per_axis 1 at 4n."""
        n, probe = 16, self.at(PROBES[0])
        job = {"scene": "room", "mode": "reference", "probes": [probe]}
        coarse = daemon.render_exr({**job, "face_px": n, "samples_per_axis": 4})
        fine = daemon.render_exr({**job, "face_px": 4 * n, "samples_per_axis": 1})
        for face in range(6):
            for y in range(n):
                for x in range(n):
                    block = [fine.at(face * 4 * n + 4 * x + i, 4 * y + j)
                             for j in range(4) for i in range(4)]
                    for c, got in enumerate(coarse.at(face * n + x, y)):
                        want = sum(b[c] for b in block) / 16
                        self.assertAlmostEqual(got, want, delta=2e-6)


class Seams(unittest.TestCase):
    """Neighbouring faces agree along all 12 edges.

    Measured as the mean absolute difference (sRGB codes) of the two texels across an edge, against
    that of neighbouring texels one step inside the same faces: the seam may be at most 1.5 times as
    rough plus 2 codes. A face that is flipped, turned or swapped breaks this by far.
    """

    N, RATIO, SLACK = 64, 1.5, 2.0

    def roughness(self, strip, n, job):
        index = {face: i for i, face in enumerate(cube.FACES)}

        def difference(a, b):
            p = cube.strip_at(strip, n, index[a[0]], a[1], a[2])
            q = cube.strip_at(strip, n, index[b[0]], b[1], b[2])
            return sum(abs(u - v) for u, v in zip(p, q)) / 3

        edges = {}
        for here, across, back in cube.seam_pairs(n):
            seam, inside = edges.setdefault(frozenset((here[0], across[0])), ([], []))
            seam.append(difference(here, across))
            inside.append(difference(here, back))
        self.assertEqual(len(edges), 12)
        for edge, (seam, inside) in edges.items():
            rough, usual = sum(seam) / len(seam), sum(inside) / len(inside)
            self.assertLessEqual(rough, self.RATIO * usual + self.SLACK,
                                 "%s of %s: %.2f over the seam, %.2f beside it"
                                 % ("/".join(sorted(edge)), job["scene"], rough, usual))

    def test_all_scenes(self):
        for name in ("room", "sphere", "hills"):
            for mode in ("reference", "lod"):
                with self.subTest(scene=name, mode=mode):
                    info = daemon.scene(name)
                    probe = info["suggested_probe"]
                    if name == "room":  # off-centre: seen from the middle, walls end at the seams
                        low, high = room_box(info)
                        probe = [l + f * (h - l) for f, l, h in zip(PROBES[1], low, high)]
                    job = {"scene": name, "mode": mode, "probes": [probe], "face_px": self.N,
                           "environment": {"constant": [0.2, 0.3, 0.4]}}
                    if mode == "reference":
                        job["samples_per_axis"] = 8
                    self.roughness(daemon.render_png(job), self.N, job)

    def test_the_measure_notices_a_turned_face(self):
        info = daemon.scene("room")
        low, high = room_box(info)
        probe = [l + f * (h - l) for f, l, h in zip(PROBES[0], low, high)]
        job = {"scene": "room", "mode": "reference", "face_px": self.N, "samples_per_axis": 2,
               "probes": [probe]}
        strip = daemon.render_png(job)
        self.roughness(strip, self.N, job)
        n, face = self.N, 2
        turned = [bytearray(row) for row in strip.rows]
        for y in range(n):
            for x in range(n):
                turned[y][3 * (face * n + x) : 3 * (face * n + x) + 3] = bytes(
                    strip.at(face * n + n - 1 - x, n - 1 - y))
        with self.assertRaises(AssertionError):
            self.roughness(picture.Picture(6 * n, n, 3, turned), n, job)


class Sphere(unittest.TestCase):
    """The silhouette of the sphere against its analytic outline."""

    def test_outline(self):
        info = daemon.scene("sphere")
        low, high = harness.bounds(info)
        voxel = info["voxel_size_m"]
        centre, radius = sphere_of(info)
        n = 128
        probe = [centre[0] - 2.5 * radius, centre[1], centre[2]]  # beside it, looking along +X
        sky = (0.0, 0.0, 64.0)
        exr = daemon.render_exr({"scene": "sphere", "mode": "reference", "samples_per_axis": 1,
                                 "face_px": n, "faces": ["+X"], "probes": [probe],
                                 "environment": {"constant": list(sky)}})
        compared = inside = 0
        for y in range(n // 2):  # the upper half: the floor lies below
            for x in range(n):
                d = cube.direction("+X", x, y, n)
                miss = closest_approach(probe, d, centre)
                if d[1] < 0 or abs(miss - radius) < 2 * voxel:
                    continue  # within two voxels of the outline
                compared += 1
                inside += miss < radius
                self.assertEqual(exr.at(x, y) != sky, miss < radius,
                                 "texel (%d, %d): ray passes the centre at %.3f m, radius %.3f m"
                                 % (x, y, miss, radius))
        # the outline's radius in pixels: tan(asin(r / 2.5 r)) * n / 2
        pixels = math.tan(math.asin(1 / 2.5)) * n / 2
        self.assertGreater(inside, 0.4 * math.pi * pixels**2)
        self.assertGreater(compared, 0.7 * n * n / 2)


def sphere_of(info):
    """Centre and radius in metres of the procedural sphere: in a cube of n voxels the radius is
    n/4 and the centre (n/2, 3n/8, n/2); the floor fills the cube's bottom, so the bounds begin at
    its corner."""
    low, _ = harness.bounds(info)
    edge = info["voxel_size_m"] * 2 ** info["depth"]
    return [low[0] + edge / 2, low[1] + 3 * edge / 8, low[2] + edge / 2], edge / 4


def closest_approach(origin, d, centre):
    to = [c - o for c, o in zip(centre, origin)]
    along = sum(a * b for a, b in zip(to, d))
    return math.sqrt(max(0.0, sum(a * a for a in to) - along * along))


class HeightMap(unittest.TestCase):
    """Rows along +Z, columns along +X, centred; height = sample / largest * height_m."""

    SIZE_M, HEIGHT_M, DEPTH = 64.0, 25.5, 7
    QUADRANTS = {(0, 0): (200, 30, 30), (1, 0): (30, 200, 30), (0, 1): (30, 30, 200),
                 (1, 1): (200, 200, 30)}  # (column half, row half)

    def build(self, name, heights, bits, colours=None, colour_size=64):
        n = len(heights)
        folder = temporary_folder()
        (folder / "h.png").write_bytes(picture.png_write(n, n, heights, bits=bits))
        command = ["build", folder / "h.png", "--size-m", self.SIZE_M, "--height-m", self.HEIGHT_M,
                   "--depth", self.DEPTH, "-o", folder / (name + ".lps")]
        if colours:
            (folder / "c.png").write_bytes(
                picture.png_write(colour_size, colour_size, colours, channels=3))
            command += ["--color", folder / "c.png"]
        cli_ok(*command)
        (folder / (name + ".lps")).rename(daemon.folder / "scenes" / (name + ".lps"))
        return daemon.scene(name)

    def quadrant_rows(self, size=64):
        return [[c for column in range(size)
                 for c in self.QUADRANTS[column * 2 // size, row * 2 // size]]
                for row in range(size)]

    def check_plane(self, name, top_m, probe):
        """Four coloured quadrants of a flat map: every texel of every face."""
        n = 64
        sky = (64.0, 0.0, 64.0)
        voxel = self.SIZE_M / 2**self.DEPTH
        job = {"scene": name, "mode": "reference", "samples_per_axis": 1, "face_px": n,
               "probes": [probe], "environment": {"constant": list(sky)}}
        exr, png = daemon.render_exr(job), daemon.render_png(job)
        half = self.SIZE_M / 2
        seen = {}
        for index, face in enumerate(cube.FACES):
            for y in range(n):
                for x in range(n):
                    d = cube.direction(face, x, y, n)
                    t = (top_m - probe[1]) / d[1] if d[1] < 0 else math.inf
                    px, pz = probe[0] + t * d[0], probe[2] + t * d[2]
                    if d[1] < 0 and min(abs(abs(px) - half), abs(abs(pz) - half)) < 2 * voxel:
                        continue  # the rim
                    if d[1] < 0 and min(abs(px), abs(pz)) < 2.0:
                        continue  # where colours are filtered: two pixels of the map
                    on = d[1] < 0 and abs(px) < half and abs(pz) < half
                    hit = exr.at(index * n + x, y) != sky
                    if abs(d[1]) < 0.02:
                        continue  # grazing: a voxel's height shifts the rim by fifty
                    if d[1] < 0 and not on:
                        # beside the map; its side walls may be hit if the map is a solid block
                        continue
                    self.assertEqual(hit, on, "%s (%d, %d)" % (face, x, y))
                    if on:
                        quadrant = (int(px > 0), int(pz > 0))
                        seen[quadrant] = seen.get(quadrant, 0) + 1
                        self.assertEqual(png.at(index * n + x, y), self.QUADRANTS[quadrant],
                                         "%s (%d, %d) looks at x %.1f z %.1f" % (face, x, y, px, pz))
        self.assertEqual(len(seen), 4)
        self.assertGreater(min(seen.values()), 100)

    def test_quadrants_8_bit(self):
        # 101/255 of 25.5 m is 10.1 m: in the voxel 10.0 to 10.5, whose top is the surface
        scene = self.build("flat8", [[101] * 16 for _ in range(16)], 8, self.quadrant_rows())
        self.assertAlmostEqual(scene["bounds_m"]["max"][1], 10.5)
        self.check_plane("flat8", 10.5, [3.3, 24.0, -7.7])

    def test_quadrants_16_bit(self):
        sample = round(10.3 / 25.5 * 65535)
        scene = self.build("flat16", [[sample] * 64 for _ in range(64)], 16, self.quadrant_rows())
        self.assertAlmostEqual(scene["bounds_m"]["max"][1], 10.5)
        self.check_plane("flat16", 10.5, [-11.1, 20.0, 5.0])

    def test_bright_is_high_and_columns_run_along_x(self):
        """Two plateaus: 50 west of x = 0, 200 east of it; heights and place from the bounds and
        from where rays that come down from above change colour (grey by height)."""
        n = 64
        rows = [[50 if column < n // 2 else 200 for column in range(n)] for _ in range(n)]
        colours = [[c for column in range(n) for c in ((10, 10, 240) if column < n // 2 else
                                                       (240, 10, 10))] for _ in range(n)]
        scene = self.build("step", rows, 8, colours)
        self.assertAlmostEqual(scene["bounds_m"]["max"][1], 20.5)  # 20.0 is the voxel 20.0 to 20.5
        probe, px = [0.0, 40.0, 0.0], 128
        job = {"scene": "step", "mode": "reference", "samples_per_axis": 1, "face_px": px,
               "probes": [probe], "faces": ["-Y"]}
        png = daemon.render_png(job)
        half, voxel = self.SIZE_M / 2, self.SIZE_M / 2**self.DEPTH
        boxes = {(10, 10, 240): ((-half, 0, -half), (0.0, 5.5, half)),
                 (240, 10, 10): ((0.0, 0, -half), (half, 20.5, half))}
        compared = 0
        for y in range(px):
            for x in range(px):
                d = cube.direction("-Y", x, y, px)
                hits = [(cube.onto_box(probe, d, *box), colour) for colour, box in boxes.items()]
                hits = sorted((hit[0], hit[1], colour) for hit, colour in hits if hit)
                if not hits or hits[0][1] != 1:
                    continue  # beside the map, or a side wall
                t, _, colour = hits[0]
                at = [p + t * c for p, c in zip(probe, d)]
                if abs(at[0]) < 2.5 or half - abs(at[0]) < 2 * voxel or half - abs(at[2]) < 2 * voxel:
                    continue  # the slope between the plateaus (the filter's two pixels), the rim
                # a ray to the low plateau that passes the edge of the high one within the slope
                if colour == (10, 10, 240) and d[0] > -0.001:
                    continue
                compared += 1
                self.assertEqual(png.at(x, y), colour, "(%d, %d) at x %.1f" % (x, y, at[0]))
        self.assertGreater(compared, 0.5 * px * px)

    def test_closed_on_steep_slopes(self):
        """No ray from above slips between columns: spikes as tall as the map allows."""
        n = 32
        rows = [[255 if (row + column) % 2 else 0 for column in range(n)] for row in range(n)]
        self.build("spikes", rows, 8)
        sky = (64.0, 0.0, 64.0)
        exr = daemon.render_exr({"scene": "spikes", "mode": "reference", "samples_per_axis": 1,
                                 "face_px": 256, "faces": ["-Y"], "probes": [[0.2, 60.0, 0.3]],
                                 "environment": {"constant": list(sky)}})
        for y in range(256):
            for x in range(256):
                d = cube.direction("-Y", x, y, 256)
                # where the ray meets y = 0 inside the map, it must have met something before
                t = 60.0 / -d[1]
                if max(abs(0.2 + t * d[0]), abs(0.3 + t * d[2])) < self.SIZE_M / 2 - 1:
                    self.assertNotEqual(exr.at(x, y), sky, "a hole at (%d, %d)" % (x, y))


if __name__ == "__main__":
    unittest.main()
