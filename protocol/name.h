/* Names of scenes, lightings and environments, with the reason why something is none. */
#ifndef WIRE_NAME_H
#define WIRE_NAME_H

#include "protocol/wire.h"

#define WIRE_NAME_WHY_BYTES 96

/* Whether `name` is [A-Za-z0-9][A-Za-z0-9._-]{0,99}; if not, `why` gets a half-sentence.
 * Thread: any. */
bool wire_name_check(char why[WIRE_NAME_WHY_BYTES], const char *name);

#endif
