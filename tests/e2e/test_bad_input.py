"""Everything that can be wrong with a job's document: status, problem+json, pointer, helpful words."""

import json
import unittest

from harness import Daemon, data_folder


def setUpModule():
    global daemon
    daemon = Daemon(data_folder("room")).ready()
    daemon.scene("room")


def tearDownModule():
    daemon.stop()


GOOD = {"scene": "room", "mode": "reference", "face_px": 4, "samples_per_axis": 1,
        "probes": [[0.1, 0.2, 0.3]]}


def problem(test, answer, status, words=()):
    """Checks a problem+json answer and returns the document."""
    statuses = status if isinstance(status, tuple) else (status,)
    test.assertIn(answer.status, statuses, answer.body[:500])
    test.assertEqual(answer.headers["Content-Type"], "application/problem+json")
    document = answer.json()
    test.assertRegex(document["type"], r"^/problems/[a-z-]+$")
    test.assertEqual(document["status"], answer.status)
    for field in ("title", "detail"):
        test.assertIs(type(document[field]), str)
        test.assertGreater(len(document[field]), 8, document)
    test.assertRegex(document["request_id"], r"^[A-Za-z0-9._-]{1,64}$")
    test.assertEqual(document["request_id"], answer.headers["X-Request-Id"])
    for error in document.get("errors", []):
        test.assertEqual(set(error), {"pointer", "detail"})
        test.assertTrue(error["pointer"] == "" or error["pointer"].startswith("/"), error)
        test.assertGreater(len(error["detail"]), 8)
    text = json.dumps(document, ensure_ascii=False).lower()
    for word in [words] if isinstance(words, str) else words:
        test.assertIn(word.lower(), text)
    return document


# What is not RFC 8259: 400, and the place in the text.
BROKEN = {
    "nothing": b"",
    "white space": b"  \n",
    "half an object": b'{"scene":"room"',
    "no quotes": b"{scene:1}",
    "single quotes": b"{'scene':'room'}",
    "comma at the end": b'{"scene":"room",}',
    "comma in a list": b'{"probes":[1,]}',
    "two documents": b"{}{}",
    "rubbish after": b"{} x",
    "a comment": b"{}//x",
    "NaN": b'{"seed":NaN}',
    "Infinity": b'{"seed":Infinity}',
    "-Infinity": b'{"probes":[[-Infinity,0,0]]}',
    "leading zero": b'{"seed":01}',
    "leading plus": b'{"seed":+1}',
    "no digits after the point": b'{"seed":1.}',
    "no digit before the point": b'{"seed":.5}',
    "empty exponent": b'{"seed":1e}',
    "hex": b'{"seed":0x10}',
    "minus alone": b'{"seed":-}',
    "raw tab in a string": b'{"scene":"a\tb"}',
    "raw newline in a string": b'{"scene":"a\nb"}',
    "wrong escape": b'{"scene":"\\x41"}',
    "half a surrogate escape": b'{"scene":"\\ud8"}',
    "invalid UTF-8": b'{"scene":"\xff"}',
    "overlong UTF-8": b'{"scene":"\xc0\xaf"}',
    "UTF-8 surrogate": b'{"scene":"\xed\xa0\x80"}',
    "cut UTF-8": b'{"scene":"\xe2\x82"}',
    "UTF-16": '{"scene":"room"}'.encode("utf-16"),
    "byte order mark": b'\xef\xbb\xbf{"scene":"room"}',
    "NUL after": b"{}\0",
    "NUL inside": b'{"scene":\0"room"}',
    "form feed": b"{}\x0c",
    "True": b'{"sh":True}',
    "open string": b'{"scene":"room',
    "nested too deeply": b"[" * 100000,
    "a key that is no string": b'{1:2}',
    "missing colon": b'{"scene" "room"}',
    "brackets crossed": b'{"probes":[1}]',
}

# What is JSON but no job: (changes, pointer, words). `...` as a value removes the field.
WRONG = {
    "unknown field": ({"colour": 1}, "/colour", "colour"),
    "misspelt field": ({"facepx": 64}, "/facepx", "face_px"),
    "empty name": ({"": 1}, "/", "field"),
    "name with a slash and tilde": ({"a/b~c": 1}, "/a~1b~0c", "field"),
    "case counts": ({"Scene": "room"}, "/Scene", "scene"),
    "no scene": ({"scene": ...}, "/scene", "missing"),
    "scene is a number": ({"scene": 5}, "/scene", "name"),
    "scene is null": ({"scene": None}, "/scene", "null"),
    "scene is empty": ({"scene": ""}, "/scene", "name"),
    "scene climbs": ({"scene": "../room"}, "/scene", "name"),
    "scene has a slash": ({"scene": "a/b"}, "/scene", "name"),
    "scene is hidden": ({"scene": ".room"}, "/scene", "name"),
    "scene is absolute": ({"scene": "/etc/passwd"}, "/scene", "name"),
    "scene with NUL": ({"scene": "room\0x"}, "/scene", ""),
    "scene of 101 characters": ({"scene": "a" * 101}, "/scene", "name"),
    "scene in other letters": ({"scene": "dünen"}, "/scene", "name"),
    "no probes": ({"probes": ...}, "/probes", "missing"),
    "no probe in the list": ({"probes": []}, "/probes", ""),
    "two probes": ({"probes": [[0, 0, 0], [1, 1, 1]]}, "/probes", "one"),
    "probes is a triple": ({"probes": [0, 0, 0]}, "/probes", "[[x, y, z]]"),
    "a pair": ({"probes": [[0, 0]]}, "/probes/0", "three"),
    "four numbers": ({"probes": [[0, 0, 0, 0]]}, "/probes/0", "three"),
    "a word as coordinate": ({"probes": [[0, "1", 0]]}, "/probes/0/1", "number"),
    "null as coordinate": ({"probes": [[0, None, 0]]}, "/probes/0/1", "number"),
    "true as coordinate": ({"probes": [[True, 0, 0]]}, "/probes/0/0", "number"),
    "metres above ground, of a later version": (
        {"probes": [{"above_ground_m": 3, "x": 1, "z": 2}]}, "/probes/0", "not in this version"),
    "far away": ({"probes": [[1e300, 0, 0]]}, "/probes/0", ""),
    "kind unknown": ({"kind": "paint"}, "/kind", "render"),
    "kind of a later version": ({"kind": "compare"}, "/kind", "not in this version"),
    "mode unknown": ({"mode": "best"}, "/mode", "reference"),
    "mode of a later version": ({"mode": "prefiltered"}, "/mode", "not in this version"),
    "mode is a number": ({"mode": 1}, "/mode", ""),
    "face_px 0": ({"face_px": 0}, "/face_px", "4096"),
    "face_px 4097": ({"face_px": 4097}, "/face_px", "4096"),
    "face_px negative": ({"face_px": -64}, "/face_px", "4096"),
    "face_px fractional": ({"face_px": 64.5}, "/face_px", "whole number"),
    "face_px text": ({"face_px": "64"}, "/face_px", "whole number"),
    "face_px true": ({"face_px": True}, "/face_px", "whole number"),
    "face_px null": ({"face_px": None}, "/face_px", "whole number"),
    "face_px list": ({"face_px": [64]}, "/face_px", "whole number"),
    "face_px huge": ({"face_px": 10**30}, "/face_px", "out of range"),
    "samples 0": ({"samples_per_axis": 0}, "/samples_per_axis", "32"),
    "samples 33": ({"samples_per_axis": 33}, "/samples_per_axis", "32"),
    "faces empty": ({"faces": []}, "/faces", ""),
    "faces unknown": ({"faces": ["+X", "up"]}, "/faces/1", "+X"),
    "faces twice": ({"faces": ["+X", "+X"]}, "/faces/1", "twice"),
    "faces a word": ({"faces": "+X"}, "/faces", "list"),
    "seven faces": ({"faces": ["+X", "-X", "+Y", "-Y", "+Z", "-Z", "+X"]}, "/faces", ""),
    "levels unknown": ({"levels": "coarse"}, "/levels", "cone"),
    "lighting unknown": ({"lighting": "noon"}, "/lighting", "albedo"),
    "lighting climbs": ({"lighting": "../x"}, "/lighting", ""),
    "seed negative": ({"seed": -1}, "/seed", ""),
    "seed 2^53 + 1": ({"seed": 2**53 + 1}, "/seed", "2^53"),
    "seed fractional": ({"seed": 0.5}, "/seed", "whole number"),
    "priority 10": ({"priority": 10}, "/priority", "9"),
    "environment a number": ({"environment": 1}, "/environment", ""),
    "environment of two": ({"environment": {"constant": [0, 0]}}, "/environment/constant", "three"),
    "environment negative": ({"environment": {"constant": [0, -1, 0]}}, "/environment/constant/1", ""),
    "environment unknown field": ({"environment": {"color": [0, 0, 0]}}, "/environment/color", ""),
    "environment of a later version": ({"environment": {"hdri": "sky"}}, "/environment",
                                       "not in this version"),
    "sh of a later version": ({"sh": "raw"}, "/sh", "not in this version"),
    "images unknown": ({"images": ["gif"]}, "/images/0", "png"),
    "images of a later version": ({"images": ["png", "ktx2"]}, "/images/1", "not in this version"),
    "layout unknown": ({"layout": "pile"}, "/layout", "strip"),
    "layout of a later version": ({"layout": "cross"}, "/layout", "not in this version"),
    "aovs of a later version": ({"aovs": ["depth"]}, "/aovs/0", "not in this version"),
    "grid of a later version": ({"probes": ..., "grid": {"min": [0, 0, 0], "max": [1, 1, 1],
                                                         "spacing_m": 1}}, "/grid",
                                "not in this version"),
    "client_ref a number": ({"client_ref": 5}, "/client_ref", "text"),
    "client_ref long": ({"client_ref": "x" * 100000}, "/client_ref", ""),
}


class Broken(unittest.TestCase):
    def test_is_400(self):
        for name, body in BROKEN.items():
            with self.subTest(name):
                answer = daemon.request("POST", "/v1/render", body)
                document = problem(self, answer, 400)
                self.assertEqual(document["type"], "/problems/invalid-json")

    def test_says_where(self):
        body = b'{\n  "scene": "room",\n  "seed": 01\n}'
        document = problem(self, daemon.request("POST", "/v1/render", body), 400)
        self.assertRegex(document["detail"], r"line 3|byte 3\d|offset 3\d|column", document)

    def test_duplicate_keys_and_lone_surrogates_are_refused(self):
        for body in (b'{"scene":"room","scene":"room"}', b'{"scene":"\\ud800"}',
                     b'{"scene":"\\udc00\\ud800"}'):
            with self.subTest(body):
                problem(self, daemon.request("POST", "/v1/render", body), (400, 422))

    def test_depth_and_count_are_limited(self):
        for body in (b'{"probes":' + b"[" * 40 + b"]" * 40 + b"}",
                     b'{"probes":[' + b"0," * 150000 + b"0]}"):
            problem(self, daemon.request("POST", "/v1/render", body), (400, 413, 422))

    def test_every_truncation_of_a_good_document(self):
        text = json.dumps({**GOOD, "environment": {"constant": [0, 0.5, 1e-3]}}).encode()
        for end in range(len(text)):
            answer = daemon.request("POST", "/v1/render", text[:end])
            self.assertEqual(answer.status, 400, text[:end])


class Wrong(unittest.TestCase):
    def test_is_422_with_a_pointer(self):
        for name, (changes, pointer, words) in WRONG.items():
            with self.subTest(name):
                job = {k: v for k, v in {**GOOD, **changes}.items() if v is not ...}
                document = problem(self, daemon.request("POST", "/v1/render", job), 422, words)
                self.assertEqual(document["type"], "/problems/invalid-field")
                pointers = [e["pointer"] for e in document["errors"]]
                self.assertTrue(any(p == pointer or p.startswith(pointer + "/") for p in pointers),
                                "%s not in %s" % (pointer, pointers))

    def test_every_offender_is_named(self):
        job = {**GOOD, "face_px": 0, "colour": 1, "mode": "best", "seed": -1}
        document = problem(self, daemon.request("POST", "/v1/render", job), 422)
        self.assertEqual({e["pointer"] for e in document["errors"]},
                         {"/face_px", "/colour", "/mode", "/seed"})

    def test_numbers_too_large_for_a_double(self):
        for text in ("1e999", "-1e999", "1" * 400, "123456789012345678901234567890"):
            for field in ("seed", "face_px", "priority"):
                body = json.dumps(GOOD)[:-1] + ', "%s": %s}' % (field, text)
                if field == "face_px":
                    body = body.replace('"face_px": 4, ', "")
                with self.subTest(field=field, text=text[:12]):
                    document = problem(self, daemon.request("POST", "/v1/render", body), 422)
                    self.assertEqual(document["errors"][0]["pointer"], "/" + field)
            body = json.dumps({**GOOD, "probes": [[0, 0, 0]]}).replace("[[0,", "[[%s," % text)
            problem(self, daemon.request("POST", "/v1/render", body), 422)

    def test_other_roots(self):
        for body in (b"[]", b"null", b"1", b'"room"', b"true"):
            with self.subTest(body):
                problem(self, daemon.request("POST", "/v1/render", body), 422, "object")

    def test_many_unknown_fields(self):
        job = {**GOOD, **{"field%d" % i: i for i in range(5000)}}
        document = problem(self, daemon.request("POST", "/v1/render", job), 422, "field0")
        self.assertGreaterEqual(len(document["errors"]), 10)

    def test_content_type_is_ignored(self):
        for kind in ("text/plain", "application/x-www-form-urlencoded", "image/png", "x"):
            answer = daemon.request("POST", "/v1/render", GOOD, {"Content-Type": kind})
            self.assertEqual(answer.status, 200, kind)

    def test_the_largest_seed(self):
        self.assertEqual(daemon.render({**GOOD, "seed": 2**53})["reproduce"]["seed"], 2**53)

    def test_the_default_mode_answers(self):
        job = {k: v for k, v in GOOD.items() if k != "mode"}
        answer = daemon.request("POST", "/v1/render", job)
        if answer.status != 200:  # error-aware, the default, comes with a later version
            document = problem(self, answer, 422, "not in this version")
            self.assertEqual(document["errors"][0]["pointer"], "/mode")

    def test_too_many_rays(self):
        """The default limit on one job is 1e11 rays: 6 * 4096^2 * 32^2 is 1.03e11."""
        job = {**GOOD, "face_px": 4096, "samples_per_axis": 32}
        document = problem(self, daemon.request("POST", "/v1/render", job), (413, 422))
        self.assertRegex(document["detail"], "ray|larg|byte|memory")

    def test_unknown_scene(self):
        document = problem(self, daemon.request("POST", "/v1/render", {**GOOD, "scene": "moon"}),
                           404, "moon")
        self.assertEqual(document["type"], "/problems/unknown-scene")

    def test_accept_does_not_change_how_errors_look(self):
        answer = daemon.request("POST", "/v1/render", {**GOOD, "face_px": 0}, {"Accept": "image/png"})
        problem(self, answer, 422)


if __name__ == "__main__":
    unittest.main()
