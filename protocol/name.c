/* Names of scenes, lightings and environments: what is one, and why something is none. */
#include "protocol/name.h"

#include <stdio.h>
#include <string.h>

static bool is_alphanumeric(char c)
{
    return (c >= '0' && c <= '9') || (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z');
}

bool wire_name_ok(const char *name)
{
    char why[WIRE_NAME_WHY_BYTES];
    return wire_name_check(why, name);
}

bool wire_name_check(char why[WIRE_NAME_WHY_BYTES], const char *name)
{
    static const char allowed[] = "names are made of A-Z a-z 0-9 . _ -";
    if (name[0] == '\0') {
        snprintf(why, WIRE_NAME_WHY_BYTES, "a name must not be empty");
        return false;
    }
    if (strlen(name) >= WIRE_NAME_BYTES) {
        snprintf(why, WIRE_NAME_WHY_BYTES, "it is longer than %d characters", WIRE_NAME_BYTES - 1);
        return false;
    }
    if (strpbrk(name, "/\\")) {
        snprintf(why, WIRE_NAME_WHY_BYTES,
                 "it contains a slash: give a name, not a path, and no folders");
        return false;
    }
    for (const char *c = name; *c; c++) {
        if (is_alphanumeric(*c) || (c != name && strchr("._-", *c)))
            continue;
        if (strchr("._-", *c))
            snprintf(why, WIRE_NAME_WHY_BYTES,
                     "it starts with \"%c\": the first character must be a letter or a digit", *c);
        else
            snprintf(why, WIRE_NAME_WHY_BYTES, "%s, the first one a letter or a digit", allowed);
        return false;
    }
    return true;
}
