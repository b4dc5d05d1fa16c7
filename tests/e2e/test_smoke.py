"""clients/curl/smoke.sh against a running daemon, and that it notices what is wrong."""

import subprocess
import unittest

from harness import ENVIRONMENT, ROOT, Daemon, data_folder

SMOKE = ROOT / "clients" / "curl" / "smoke.sh"


def smoke(url):
    return subprocess.run(["bash", str(SMOKE), url], capture_output=True, env=ENVIRONMENT,
                          timeout=600, text=True, errors="replace")


class Smoke(unittest.TestCase):
    def test_all_is_well(self):
        daemon = Daemon(data_folder("room", "sphere")).ready()
        daemon.scene("room")
        daemon.scene("sphere")
        done = smoke(daemon.url)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        daemon.stop()

    def test_nobody_there(self):
        done = smoke("http://127.0.0.1:1")
        self.assertNotEqual(done.returncode, 0)
        self.assertGreater(len(done.stdout + done.stderr), 20)


if __name__ == "__main__":
    unittest.main()
