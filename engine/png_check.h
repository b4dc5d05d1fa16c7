/* Whether a PNG file is whole; private to image.c and its tests. */
#ifndef LP_PNG_CHECK_H
#define LP_PNG_CHECK_H

#include "engine/base.h"

/* Walks the chunks of a PNG file (ISO/IEC 15948) from the signature to IEND and checks lengths and
 * CRCs; a file with another signature is none of its business and passes. Needed because libpng
 * prints its own message where it meets a damaged file. LP_INVALID names what is wrong and where,
 * LP_IO when the file cannot be read. Thread: any. O(file). */
LP_MUST_CHECK enum lp_code lp_png_check(const char *path, struct lp_error *err);

#endif
