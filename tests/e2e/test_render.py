"""POST /v1/render: the JSON document field by field, the pictures by Accept and by link."""

import hashlib
import json
import math
import re
import struct
import unittest

import picture
from harness import Daemon, data_folder

HEX64 = re.compile(r"[0-9a-f]{64}")


def setUpModule():
    global daemon, room, sphere
    daemon = Daemon(data_folder("room", "sphere", "hills")).ready()
    room, sphere = daemon.scene("room"), daemon.scene("sphere")


def tearDownModule():
    daemon.stop()


def job(scene, **fields):
    document = {"scene": scene["name"], "mode": "reference", "face_px": 16,
                "probes": [scene["suggested_probe"]]}
    document.update(fields)
    return document


class Document(unittest.TestCase):
    def check_counters(self, counters, face_px, faces, samples):
        c = counters
        for name in ("rays", "rays_hit", "rays_discarded", "traversal_steps", "pixels",
                     "pixels_background"):
            self.assertIs(type(c[name]), int, name)
            self.assertGreaterEqual(c[name], 0, name)
        self.assertEqual(c["pixels"], face_px * face_px * faces)
        self.assertEqual(c["rays"], c["pixels"] * samples * samples)
        self.assertLessEqual(c["rays_hit"], c["rays"])
        self.assertEqual(c["rays_discarded"], 0)
        self.assertGreaterEqual(c["traversal_steps"], c["rays"])
        for name in ("pixels_by_rays", "pixels_by_level"):
            for key, value in c[name].items():
                self.assertRegex(key, r"^(0|[1-9][0-9]*)$")
                self.assertIs(type(value), int)
            self.assertEqual(sum(c[name].values()) + c["pixels_background"], c["pixels"], name)
        self.assertEqual(c["rays_per_pixel"], c["rays"] / c["pixels"])
        hit_pixels = c["pixels"] - c["pixels_background"]
        if hit_pixels:
            self.assertEqual(c["rays_per_hit_pixel"], c["rays_hit"] / hit_pixels)

    def check(self, document, request, face_px, faces=6, samples=1):
        d = document
        self.assertIs(type(d["id"]), str)
        self.assertRegex(d["id"], r"^[A-Za-z0-9._-]{1,64}$")
        self.assertEqual((d["kind"], d["state"]), ("render", "done"))
        self.assertEqual(d["scene"]["name"], request["scene"])
        self.assertRegex(d["scene"]["sha256"], HEX64)
        self.assertEqual(len(d["probes"]), 1)
        probe = d["probes"][0]
        self.assertEqual(probe["index"], 0)
        self.assertEqual(probe["position"], request["probes"][0])
        self.assertIsInstance(probe["warnings"], list)
        self.assertRegex(probe["film_sha256"], HEX64)
        self.check_counters(probe["counters"], face_px, faces, samples)
        self.assertEqual(d["totals"], {"rays": probe["counters"]["rays"],
                                       "traversal_steps": probe["counters"]["traversal_steps"]})
        for name in ("queued", "render", "encode"):
            self.assertIn(type(d["seconds"][name]), (int, float))
            self.assertGreaterEqual(d["seconds"][name], 0)
        self.assertRegex(d["reproduce"]["engine"], r"^\d+\.\d+\.\d+")
        self.assertEqual(d["reproduce"]["seed"], request.get("seed", 0))
        self.assertIs(type(d["reproduce"]["kernel"]), str)
        for image in probe["images"]:
            self.assertEqual(set(image) & {"href", "sha256", "bytes"}, {"href", "sha256", "bytes"})
            self.assertRegex(image["sha256"], HEX64)
            self.assertIs(type(image["bytes"]), int)

    def test_reference(self):
        request = job(room, samples_per_axis=4)
        d = daemon.render(request)
        self.check(d, request, 16, samples=4)
        counters = d["probes"][0]["counters"]
        by_rays = {k: v for k, v in counters["pixels_by_rays"].items() if v}
        self.assertEqual(by_rays, {"16": 16 * 16 * 6})  # a closed room
        self.assertEqual(counters["pixels_background"], 0)
        self.assertEqual(counters["rays_hit"], counters["rays"])
        self.assertEqual(d["scene"]["sha256"], room["sha256"])

    def test_reference_of_other_sample_counts(self):
        for samples in (1, 2, 3):
            with self.subTest(samples=samples):
                request = job(room, samples_per_axis=samples)
                d = daemon.render(request)
                self.check(d, request, 16, samples=samples)
                by_rays = d["probes"][0]["counters"]["pixels_by_rays"]
                self.assertEqual({k: v for k, v in by_rays.items() if v},
                                 {str(samples * samples): 16 * 16 * 6})

    def test_samples_default_to_four(self):
        request = job(room)
        self.check(daemon.render(request), request, 16, samples=4)

    def test_lod(self):
        for levels in ("cone", "fixed"):
            with self.subTest(levels=levels):
                request = job(sphere, mode="lod", levels=levels, face_px=32)
                d = daemon.render(request)
                self.check(d, request, 32)
                by_rays = d["probes"][0]["counters"]["pixels_by_rays"]
                self.assertEqual({k for k, v in by_rays.items() if v}, {"1"})

    def test_background_is_counted(self):
        low, high = sphere["bounds_m"]["min"], sphere["bounds_m"]["max"]
        above = [(low[0] + high[0]) / 2, high[1] + 5.0, (low[2] + high[2]) / 2]
        request = job(sphere, probes=[above])
        d = daemon.render(request)
        self.check(d, request, 16, samples=4)
        counters = d["probes"][0]["counters"]
        self.assertGreater(counters["pixels_background"], 5 * 16 * 16 - 1)
        self.assertLess(counters["pixels_background"], counters["pixels"])
        self.assertTrue(d["probes"][0]["warnings"], "a probe outside of the scene warns")

    def test_nothing_hit(self):
        request = job(sphere, probes=[[0.0, 10000.0, 0.0]], faces=["+Y"])
        d = daemon.render(request)
        self.check(d, request, 16, faces=1, samples=4)
        self.assertEqual(d["probes"][0]["counters"]["rays_hit"], 0)

    def test_probe_inside_matter_warns(self):
        low = room["bounds_m"]["min"]
        inside = [low[a] + room["voxel_size_m"] / 2 for a in range(3)]
        warnings = daemon.render(job(room, probes=[inside]))["probes"][0]["warnings"]
        self.assertTrue(any("inside" in w or "matter" in w or "solid" in w for w in warnings),
                        warnings)

    def test_suggested_probe_has_no_warning_and_sees_something(self):
        for name in ("room", "sphere", "hills"):
            with self.subTest(scene=name):
                scene = daemon.scene(name)
                probe = daemon.render(job(scene))["probes"][0]
                self.assertEqual(probe["warnings"], [])
                self.assertLess(probe["counters"]["pixels_background"],
                                probe["counters"]["pixels"] * 0.9)

    def test_faces_are_a_subset_in_order(self):
        request = job(room, faces=["+Y", "-X"])
        d = daemon.render(request)
        self.check(d, request, 16, faces=2, samples=4)
        whole, part = daemon.render_png(job(room)), daemon.render_png(request)
        self.assertEqual((part.width, part.height), (32, 16))
        for y in range(16):
            for x in range(16):  # -X is face 1, +Y face 2
                self.assertEqual(part.at(x, y), whole.at(16 + x, y))
                self.assertEqual(part.at(16 + x, y), whole.at(32 + x, y))

    def test_the_echoed_request_repeats_the_job(self):
        first = daemon.render(job(sphere, faces=["-Y", "+X"], client_ref="häuser \"1\"", seed=7))
        echoed = first["request"]
        for name in ("kind", "scene", "lighting", "probes", "mode", "face_px", "faces", "levels",
                     "samples_per_axis", "environment", "seed", "images", "layout", "priority"):
            self.assertIn(name, echoed)
        self.assertEqual(echoed["client_ref"], "häuser \"1\"")
        again = daemon.render(echoed)
        self.assertEqual(again["request"], echoed)
        self.assertEqual(again["probes"][0]["film_sha256"], first["probes"][0]["film_sha256"])
        self.assertNotEqual(again["id"], first["id"])

    def test_numbers_come_back_exactly(self):
        position = [0.1, 1 / 3, -2.2250738585072014e-308]
        request = job(room, probes=[position], seed=2**53, environment={"constant": [0.1, 1e-9, 3.3]})
        d = daemon.render(request)
        self.assertEqual(d["probes"][0]["position"], position)
        self.assertEqual(d["request"]["probes"], [position])
        self.assertEqual(d["request"]["environment"], {"constant": [0.1, 1e-9, 3.3]})
        self.assertEqual(d["reproduce"]["seed"], 2**53)
        self.assertIn(b"9007199254740992", daemon.request("POST", "/v1/render", request).body)

    def test_server_timing_and_request_id(self):
        answer = daemon.request("POST", "/v1/render", job(room), {"X-Request-Id": "my.request-1"})
        self.assertEqual(answer.headers["X-Request-Id"], "my.request-1")
        self.assertIn("dur=", answer.headers["Server-Timing"])
        self.assertTrue(answer.headers["Content-Type"].startswith("application/json"))
        for bad in ("a b", "x" * 65, "ümlaut"):
            got = daemon.request("GET", "/v1/stats", headers={"X-Request-Id": bad.encode("latin-1")})
            self.assertRegex(got.headers["X-Request-Id"], r"^[A-Za-z0-9._-]{1,64}$")
            self.assertNotEqual(got.headers["X-Request-Id"], bad)


class Pictures(unittest.TestCase):
    def test_png_by_accept(self):
        request = job(room, face_px=64)
        answer = daemon.request("POST", "/v1/render", request, {"Accept": "image/png"})
        self.assertEqual((answer.status, answer.headers["Content-Type"]), (200, "image/png"))
        self.assertEqual(int(answer.headers["Content-Length"]), len(answer.body))
        strip = picture.png_read(answer.body)
        self.assertEqual((strip.width, strip.height), (384, 64))

    def test_exr_by_accept_holds_the_film(self):
        # in a corner of the floor, so that above there is nothing but sky
        request = job(sphere, environment={"constant": [0.25, 1.5, 40.0]}, probes=[[3.5, 2, 3.5]])
        answer = daemon.request("POST", "/v1/render", request, {"Accept": "image/x-exr"})
        self.assertEqual((answer.status, answer.headers["Content-Type"]), (200, "image/x-exr"))
        exr, attributes = picture.exr_read(answer.body)
        self.assertEqual((exr.width, exr.height), (96, 16))
        self.assertNotIn("envmap", attributes)
        up = exr.at(2 * 16 + 8, 8)  # +Y: sky only, stronger than white
        self.assertEqual(up, (0.25, 1.5, 40.0))
        # The film's hash is over these very floats, face after face.
        film = b"".join(struct.pack("<3f", *exr.at(face * 16 + x, y))
                        for face in range(6) for y in range(16) for x in range(16))
        self.assertEqual(hashlib.sha256(film).hexdigest(),
                         daemon.render(request)["probes"][0]["film_sha256"])

    def test_png_is_the_film_in_srgb(self):
        request = job(sphere, environment={"constant": [0.2, 0.5, 2.0]}, face_px=16)
        png, exr = daemon.render_png(request), daemon.render_exr(request)
        for y in range(16):
            for x in range(96):
                for code, linear in zip(png.at(x, y), exr.at(x, y)):
                    c = min(1.0, max(0.0, linear))
                    srgb = 12.92 * c if c <= 0.0031308 else 1.055 * c ** (1 / 2.4) - 0.055
                    # half a code, and what float32 and the formula's own gap leave
                    self.assertLessEqual(abs(255 * srgb - code), 0.502)

    def test_lamp_stays_stronger_than_white(self):
        lightings = [c["name"] if isinstance(c, dict) else c for c in room["lightings"]]
        self.assertIn("lamp", lightings)
        request = job(room, lighting="lamp", face_px=32, samples_per_axis=1)
        exr = daemon.render_exr(request)
        brightest = max(max(exr.at(2 * 32 + x, y)) for y in range(32) for x in range(32))
        self.assertEqual(brightest, 50.0)
        png = daemon.render_png(request)
        self.assertEqual(max(max(png.at(2 * 32 + x, y)) for y in range(32) for x in range(32)), 255)

    def test_accept(self):
        request = job(room, samples_per_axis=1)
        for accept, kind in ((None, "application/json"), ("*/*", "application/json"),
                             ("application/json", "application/json"),
                             ("image/png, application/json;q=0.5", "image/png"),
                             ("image/png;q=0.1, image/x-exr;q=0.9", "image/x-exr"),
                             ("image/ktx2, image/png", "image/png"),
                             ("text/html, */*;q=0.1", "application/json"),
                             ("IMAGE/PNG", "image/png")):
            with self.subTest(accept=accept):
                headers = {"Accept": accept} if accept else {}
                answer = daemon.request("POST", "/v1/render", request, headers)
                self.assertEqual(answer.status, 200)
                self.assertEqual(answer.headers["Content-Type"].split(";")[0], kind)

    def test_links(self):
        d = daemon.render(job(sphere, images=["png", "exr"]))
        images = d["probes"][0]["images"]
        self.assertEqual(len(images), 2)
        for image in images:
            path = image["href"]
            self.assertTrue(path.startswith("/v1/jobs/%s/probes/0." % d["id"]), path)
            answer = daemon.get(path)
            self.assertEqual(answer.status, 200)
            self.assertEqual(len(answer.body), image["bytes"])
            self.assertEqual(hashlib.sha256(answer.body).hexdigest(), image["sha256"])
            etag = answer.headers["ETag"]
            self.assertRegex(etag, r'^"[^"]+"$')  # strong
            head = daemon.request("HEAD", path)
            self.assertEqual((head.status, head.body), (200, b""))
            self.assertEqual(head.headers["ETag"], etag)
            self.assertEqual(int(head.headers["Content-Length"]), image["bytes"])
            for condition in (etag, '"other", ' + etag, "*", "W/" + etag):
                same = daemon.get(path, {"If-None-Match": condition})
                self.assertEqual((same.status, same.body), (304, b""), condition)
                self.assertEqual(same.headers["ETag"], etag)
            self.assertEqual(daemon.get(path, {"If-None-Match": '"other"'}).status, 200)

    def test_range(self):
        path = daemon.render(job(sphere))["probes"][0]["images"][0]["href"]
        whole = daemon.get(path).body
        part = daemon.get(path, {"Range": "bytes=10-19"})
        self.assertEqual((part.status, part.body), (206, whole[10:20]))
        self.assertEqual(part.headers["Content-Range"], "bytes 10-19/%d" % len(whole))
        tail = daemon.get(path, {"Range": "bytes=-5"})
        self.assertEqual((tail.status, tail.body), (206, whole[-5:]))
        self.assertEqual(daemon.get(path, {"Range": "bytes=%d-" % len(whole)}).status, 416)

    def test_what_was_not_asked_for_is_404(self):
        d = daemon.render(job(sphere, images=["png"]))
        for path in ("probes/0.exr", "probes/0.hdr", "probes/1.png", "probes/0.gif", "probes/-1.png"):
            answer = daemon.get("/v1/jobs/%s/%s" % (d["id"], path))
            self.assertEqual(answer.status, 404, path)
            self.assertEqual(answer.headers["Content-Type"], "application/problem+json")

    def test_by_accept_and_by_link_are_the_same_bytes(self):
        request = job(sphere)
        by_link = daemon.get(daemon.render(request)["probes"][0]["images"][0]["href"]).body
        by_accept = daemon.request("POST", "/v1/render", request, {"Accept": "image/png"}).body
        self.assertEqual(by_link, by_accept)

    def test_result_and_job_stay_readable(self):
        d = daemon.render(job(room))
        status = daemon.get("/v1/jobs/" + d["id"]).json()
        self.assertEqual((status["id"], status["kind"], status["state"]), (d["id"], "render", "done"))
        self.assertEqual(status["progress"]["fraction"], 1)
        self.assertEqual(status["progress"]["rays"], d["totals"]["rays"])
        self.assertEqual(daemon.get("/v1/jobs/%s/result" % d["id"]).json(), d)


class OtherRoutes(unittest.TestCase):
    def test_scene_document(self):
        for name in ("room", "sphere", "hills"):
            s = daemon.scene(name)
            self.assertEqual((s["name"], s["state"]), (name, "ready"))
            for field in ("voxels", "nodes", "bytes", "depth", "refs"):
                self.assertIs(type(s[field]), int, field)
            self.assertGreater(s["nodes"], s["voxels"])
            self.assertEqual(s["bytes"], (daemon.folder / "scenes" / (name + ".lps")).stat().st_size)
            self.assertEqual(s["sha256"], hashlib.sha256(
                (daemon.folder / "scenes" / (name + ".lps")).read_bytes()).hexdigest())
            self.assertIn("albedo", json.dumps(s["lightings"]))
            self.assertIn("albedo", json.dumps(s["channels"]))
            self.assertTrue(all(math.isfinite(c) for c in s["suggested_probe"]))
            for low, high in zip(s["bounds_m"]["min"], s["bounds_m"]["max"]):
                self.assertLess(low, high)
        self.assertEqual(room["voxel_size_m"], 8 / 128)

    def test_scene_list(self):
        listed = daemon.get("/v1/scenes").json()["scenes"]
        self.assertEqual(sorted(s["name"] for s in listed), ["hills", "room", "sphere"])
        self.assertEqual({s["state"] for s in listed}, {"ready"})

    def test_health_stats_and_dashboard(self):
        self.assertEqual(daemon.get("/v1/health/live").status, 200)
        self.assertEqual(daemon.get("/v1/health/ready").status, 200)
        self.assertIsInstance(daemon.get("/v1/stats").json(), dict)
        home = daemon.get("/")
        self.assertEqual(home.status, 200)
        self.assertTrue(home.headers["Content-Type"].startswith("text/html"))
        self.assertNotRegex(home.body.decode(), r"https?://(?!127\.0\.0\.1|localhost|www\.w3\.org)",
                            "the page asks nothing of other machines")

    def test_head_on_what_can_be_got(self):
        for path in ("/", "/v1/health/live", "/v1/stats", "/v1/scenes", "/v1/scenes/room"):
            answer = daemon.request("HEAD", path)
            self.assertEqual((answer.status, answer.body), (200, b""), path)

    def test_later_routes_say_so(self):
        for verb, path in (("GET", "/metrics"), ("GET", "/v1/openapi.json"), ("GET", "/v1/tables"),
                           ("POST", "/v1/jobs"), ("GET", "/v1/jobs"), ("PUT", "/v1/scenes/room"),
                           ("DELETE", "/v1/scenes/room"), ("DELETE", "/v1/jobs/x")):
            answer = daemon.request(verb, path, b"")
            self.assertIn(answer.status, (404, 405), path)
            self.assertIn("not in this version", answer.json()["detail"])
        self.assertEqual(daemon.scene("room")["state"], "ready")


if __name__ == "__main__":
    unittest.main()
