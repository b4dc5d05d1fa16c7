"""Runs the end-to-end tests of one build: `CONFIG=release python3 tests/e2e/run.py [NAME...]`.

NAME is a module (test_render) or a test (test_render.Document.test_sums). Prints the failures,
whatever tests measured, and "N passed, N failed" at the end.
"""

import os
import pathlib
import shutil
import sys
import tempfile
import time
import unittest

HERE = pathlib.Path(__file__).resolve().parent


class Result(unittest.TextTestResult):
    """Counts what passed and prints one line per test with its time."""

    passed = 0

    def startTest(self, test):
        self.began = time.monotonic()
        super().startTest(test)

    def addSuccess(self, test):
        super().addSuccess(test)
        Result.passed += 1

    def stopTest(self, test):
        super().stopTest(test)
        seconds = time.monotonic() - self.began
        if seconds > 10:
            print("  (%s took %.0f s)" % (test.id(), seconds), flush=True)


def main():
    sys.path.insert(0, str(HERE))
    names = sys.argv[1:] or [path.stem for path in sorted(HERE.glob("test_*.py"))]
    folder = tempfile.mkdtemp(prefix="lightprobe-e2e-")
    os.environ["LP_E2E_TEMP"] = folder
    try:
        suite = unittest.defaultTestLoader.loadTestsFromNames(names)
        runner = unittest.TextTestRunner(stream=sys.stdout, resultclass=Result, verbosity=0)
        result = runner.run(suite)
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    failed = len(result.failures) + len(result.errors) + len(result.unexpectedSuccesses)
    for test, reason in result.skipped:
        print("  (skipped: %s: %s)" % (test.id(), reason))
    print("%d passed, %d failed" % (Result.passed, failed), flush=True)
    return 1 if failed or not Result.passed else 0


if __name__ == "__main__":
    sys.exit(main())
