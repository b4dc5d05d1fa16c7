#!/usr/bin/env python3
"""Prints engine/srgb_table.c: the sRGB curve's values, correctly rounded to float.

    python3 tests/engine/make_srgb_table.py > engine/srgb_table.c

The curve (IEC 61966-2-1) is computed with 80 decimal digits; the exact fraction is then rounded to
the nearest 24-bit float, ties to even. `--check` compares with the file that is there instead.
"""

import pathlib
import sys
from decimal import Decimal, getcontext
from fractions import Fraction

getcontext().prec = 80
TARGET = pathlib.Path(__file__).resolve().parents[2] / "engine" / "srgb_table.c"


def linear(code):
    """The linear value of an sRGB code (a Fraction of 0..255) as an exact or 80-digit fraction."""
    encoded = code / 255
    if encoded <= Fraction(4045, 100000):
        return encoded / Fraction(1292, 100)
    base = (encoded + Fraction(55, 1000)) / Fraction(1055, 1000)
    power = (Decimal(base.numerator) / Decimal(base.denominator)) ** Decimal("2.4")
    return Fraction(power)


def to_float32(value):
    """Nearest float32 of a non-negative fraction within its normal range, as a Python float."""
    if value == 0:
        return 0.0
    exponent = 0
    while value < Fraction(1 << 23) * Fraction(2) ** exponent:
        exponent -= 1
    while value >= Fraction(1 << 24) * Fraction(2) ** exponent:
        exponent += 1
    mantissa = round(value / Fraction(2) ** exponent)  # Python rounds halves to even
    return float(Fraction(mantissa) * Fraction(2) ** exponent)


def text(value):
    """A float32 as a C hexadecimal literal without trailing zeros: exact."""
    if value in (0.0, 1.0):
        return "%.1ff" % value
    mantissa, exponent = value.hex().split("p")
    return mantissa.rstrip("0").rstrip(".") + "p" + exponent + "f"


def table(name, values):
    lines = ["const float %s[256] = {" % name]
    line = "   "
    for value in values:
        piece = " " + text(value) + ","
        if len(line) + len(piece) > 100:
            lines.append(line)
            line = "   "
        line += piece
    return "\n".join(lines + [line, "};"])


def source():
    return "\n".join([
        "/* The sRGB curve's values as exact floats; made by tests/engine/make_srgb_table.py. */",
        '#include "engine/srgb.h"',
        "",
        "/* clang-format off */",
        table("lp_srgb_to_linear", [to_float32(linear(Fraction(i))) for i in range(256)]),
        "",
        table("lp_srgb_threshold",
              [0.0] + [to_float32(linear(Fraction(2 * i - 1, 2))) for i in range(1, 256)]),
        "",
    ])


def main():
    if sys.argv[1:] == ["--check"]:
        if TARGET.read_text() != source():
            sys.exit("engine/srgb_table.c is not what tests/engine/make_srgb_table.py prints")
    elif len(sys.argv) == 1:
        sys.stdout.write(source())
    else:
        sys.exit(__doc__)


main()
