"""gcc and clang: the same scenes, films, counters and files. Needs both builds of CONFIG."""

import unittest

import harness
from harness import cli_ok, scenes, temporary_folder
from test_determinism import JOBS, by_daemon

OTHER = harness.build_of("gcc" if harness.COMPILER == "clang" else "clang")


class Compilers(unittest.TestCase):
    def test_gcc_and_clang(self):
        self.assertEqual(by_daemon(JOBS, build=OTHER), by_daemon(JOBS))

    def test_scene_files(self):
        folder = temporary_folder()
        harness.hills_maps(folder)
        for name, source in (("room", ("procedural:room", "--depth", 7, "--size-m", 8)),
                             ("sphere", ("procedural:sphere", "--depth", 8, "--size-m", 8)),
                             ("hills", (folder / "hills.png", "--color", folder / "hills-colours.png",
                                        "--size-m", 64, "--height-m", 20, "--depth", 8))):
            cli_ok("build", *source, "-o", folder / (name + ".lps"), build=OTHER)
            self.assertEqual((folder / (name + ".lps")).read_bytes(),
                             (scenes() / (name + ".lps")).read_bytes(), name)


if __name__ == "__main__":
    unittest.main()
