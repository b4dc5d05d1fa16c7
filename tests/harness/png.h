/* Writes small uncompressed PNG files for tests, without the code that is tested. */
#ifndef LP_TEST_PNG_H
#define LP_TEST_PNG_H

#include <stdint.h>

/* `samples` holds width * height * channels values, rows from the top; channels 1 grey, 2 grey and
 * alpha, 3 RGB, 4 RGBA; bits 8 or 16. Ends the test when the file cannot be written. */
void test_write_png(const char *path, const uint16_t *samples, uint32_t width, uint32_t height,
                    uint32_t channels, uint32_t bits);

#endif
