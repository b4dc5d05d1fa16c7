"""The cubemap table of the conventions, written again from the text: what a texel must see.

Order +X -X +Y -Y +Z -Z, row 0 on top; cx = 2(x + 0.5)/n - 1, cy = 1 - 2(y + 0.5)/n. Everything
here is double precision and shares nothing with the engine.
"""

import math

FACES = ("+X", "-X", "+Y", "-Y", "+Z", "-Z")

# face: direction of (cx, cy), as the table has it
_TABLE = {
    "+X": lambda cx, cy: (1.0, cy, -cx),
    "-X": lambda cx, cy: (-1.0, cy, cx),
    "+Y": lambda cx, cy: (cx, 1.0, -cy),
    "-Y": lambda cx, cy: (cx, -1.0, cy),
    "+Z": lambda cx, cy: (cx, cy, 1.0),
    "-Z": lambda cx, cy: (-cx, cy, -1.0),
}


def direction_at(face, cx, cy):
    """Unit direction of a point of a face; cx and cy may leave -1..1."""
    d = _TABLE[face](cx, cy)
    length = math.sqrt(sum(c * c for c in d))
    return tuple(c / length for c in d)


def direction(face, x, y, n):
    """Unit direction through the centre of texel (x, y)."""
    return direction_at(face, 2 * (x + 0.5) / n - 1, 1 - 2 * (y + 0.5) / n)


def texel(d, n):
    """(face, x, y) of the texel that a direction falls into."""
    axis = max(range(3), key=lambda a: abs(d[a]))
    face = FACES[2 * axis + (d[axis] < 0)]
    major = abs(d[axis])
    # the table solved for cx and cy
    cx, cy = {
        "+X": (-d[2], d[1]), "-X": (d[2], d[1]), "+Y": (d[0], -d[2]),
        "-Y": (d[0], d[2]), "+Z": (d[0], d[1]), "-Z": (-d[0], d[1]),
    }[face]
    cx, cy = cx / major, cy / major
    clamp = lambda v: min(n - 1, max(0, int(math.floor(v))))
    return face, clamp((cx + 1) * n / 2), clamp((1 - cy) * n / 2)


def seam_pairs(n):
    """All texels along the faces' edges: (texel, texel across the edge, texel one step back inside),
    each (face, x, y). Each of the 12 edges comes 2n times, n from either side. n >= 2."""
    out = 1 + 1.0 / n  # half a texel beyond the edge
    for face in FACES:
        for i in range(n):
            along = 2 * (i + 0.5) / n - 1
            for (x, y), (cx, cy), (back_x, back_y) in (
                ((0, i), (-out, -along), (1, i)), ((n - 1, i), (out, -along), (n - 2, i)),
                ((i, 0), (along, out), (i, 1)), ((i, n - 1), (along, -out), (i, n - 2)),
            ):
                across = texel(direction_at(face, cx, cy), n)
                yield (face, x, y), across, (face, back_x, back_y)


def inside_box(origin, d, low, high):
    """From inside a box: (face looked at, distance, point)."""
    best = None
    for axis in range(3):
        if d[axis] == 0:
            continue
        wall = high[axis] if d[axis] > 0 else low[axis]
        t = (wall - origin[axis]) / d[axis]
        if best is None or t < best[1]:
            best = (FACES[2 * axis + (d[axis] < 0)], t)
    face, t = best
    return face, t, tuple(o + t * c for o, c in zip(origin, d))


def onto_box(origin, d, low, high):
    """From outside: (distance, axis of the face entered) or None."""
    t_in, t_out, axis_in = -math.inf, math.inf, None
    for axis in range(3):
        if d[axis] == 0:
            if not low[axis] <= origin[axis] < high[axis]:
                return None
            continue
        near, far = sorted(((low[axis] - origin[axis]) / d[axis],
                            (high[axis] - origin[axis]) / d[axis]))
        if near > t_in:
            t_in, axis_in = near, axis
        t_out = min(t_out, far)
    if t_in >= t_out or t_out <= 0 or t_in <= 0:
        return None
    return t_in, axis_in


def strip_at(picture, n, face_index, x, y):
    """A texel of a strip."""
    return picture.at(face_index * n + x, y)
