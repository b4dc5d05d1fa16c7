/* Flags of a command as a table: reading, checking, helping. */
#include "clients/cli/flags.h"

#include <ctype.h>
#include <errno.h>
#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define WORD_MAX         31
#define SUGGEST_DISTANCE 2
#define NUMBER_MAX_CHARS 63
#define HELP_COLUMN      30

bool flags_parse_u64(uint64_t *out, const char *text)
{
    size_t digits = strspn(text, "0123456789");
    if (digits == 0 || text[digits] != '\0')
        return false;
    errno = 0;
    unsigned long long value = strtoull(text, NULL, 10);
    if (errno == ERANGE)
        return false;
    *out = value;
    return true;
}

bool flags_parse_f64(double *out, const char *text)
{
    /* strtod takes white space, hexadecimals, inf and nan too. The locale is "C": nobody sets it.
     */
    if (*text == '\0' || text[strspn(text, "+-.0123456789eE")] != '\0')
        return false;
    char *end = NULL;
    double value = strtod(text, &end);
    if (end == text || *end != '\0' || !isfinite(value))
        return false;
    *out = value;
    return true;
}

bool flags_parse_triple(double out[3], const char *text)
{
    double values[3];
    for (int i = 0; i < 3; i++) {
        char part[NUMBER_MAX_CHARS + 1];
        size_t length = strcspn(text, ",");
        if (length > NUMBER_MAX_CHARS || (text[length] == ',') != (i < 2))
            return false;
        memcpy(part, text, length);
        part[length] = '\0';
        if (!flags_parse_f64(&values[i], part))
            return false;
        text += length + (i < 2);
    }
    memcpy(out, values, sizeof values);
    return true;
}

/* Damerau and Levenshtein's distance, restricted to swaps of neighbours. */
unsigned flags_distance(const char *a, const char *b)
{
    size_t a_length = strlen(a), b_length = strlen(b);
    if (a_length > WORD_MAX || b_length > WORD_MAX)
        return UINT_MAX;
    unsigned cost[WORD_MAX + 1][WORD_MAX + 1];
    for (size_t i = 0; i <= a_length; i++)
        cost[i][0] = (unsigned)i;
    for (size_t j = 0; j <= b_length; j++)
        cost[0][j] = (unsigned)j;
    for (size_t i = 1; i <= a_length; i++) {
        for (size_t j = 1; j <= b_length; j++) {
            unsigned best = cost[i - 1][j - 1] + (a[i - 1] != b[j - 1]);
            if (cost[i - 1][j] + 1 < best)
                best = cost[i - 1][j] + 1;
            if (cost[i][j - 1] + 1 < best)
                best = cost[i][j - 1] + 1;
            bool swapped = i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
            if (swapped && cost[i - 2][j - 2] + 1 < best)
                best = cost[i - 2][j - 2] + 1;
            cost[i][j] = best;
        }
    }
    return cost[a_length][b_length];
}

static enum flags_answer unknown_flag(const struct flag_set *set, const char *word,
                                      struct lp_error *err)
{
    const char *nearest = NULL;
    unsigned least = SUGGEST_DISTANCE + 1;
    char name[WORD_MAX + 1] = "";
    size_t length = strcspn(word + strspn(word, "-"), "=");
    if (length <= WORD_MAX)
        snprintf(name, sizeof name, "%.*s", (int)length, word + strspn(word, "-"));
    for (size_t i = 0; i < set->flag_count; i++) {
        unsigned distance = flags_distance(name, set->flags[i].name);
        if (distance < least && distance < strlen(set->flags[i].name)) {
            least = distance;
            nearest = set->flags[i].name;
        }
    }
    if (nearest)
        lp_fail(err, LP_INVALID, word, "unknown flag; did you mean --%s?", nearest);
    else
        lp_fail(err, LP_INVALID, word, "unknown flag; see --help");
    return FLAGS_WRONG;
}

/* Whether a number lies in the flag's range; sets the sentence when not. */
static bool in_range(const struct flag *flag, const char *shown, double value, const char *text,
                     struct lp_error *err)
{
    bool any = flag->min == 0 && flag->max == 0;
    if (any || (value >= flag->min && value <= flag->max))
        return true;
    lp_fail(err, LP_INVALID, shown, "%.40s is out of range: %g to %g", text, flag->min, flag->max);
    return false;
}

static bool store_value(struct flag *flag, const char *shown, const char *text,
                        struct lp_error *err)
{
    uint64_t u64;
    double f64, triple[3];
    switch (flag->kind) {
    case FLAG_SWITCH:
        *flag->to.on = true;
        return true;
    case FLAG_TEXT:
        if (*text == '\0') {
            lp_fail(err, LP_INVALID, shown, "the value %s is empty", flag->value);
            return false;
        }
        *flag->to.text = text;
        return true;
    case FLAG_U64:
        if (!flags_parse_u64(&u64, text)) {
            lp_fail(err, LP_INVALID, shown, "\"%.40s\" is no whole number such as 8", text);
            return false;
        }
        if (!in_range(flag, shown, (double)u64, text, err))
            return false;
        *flag->to.u64 = u64;
        return true;
    case FLAG_F64:
        if (!flags_parse_f64(&f64, text)) {
            lp_fail(err, LP_INVALID, shown, "\"%.40s\" is no number such as 12.5", text);
            return false;
        }
        if (!in_range(flag, shown, f64, text, err))
            return false;
        *flag->to.f64 = f64;
        return true;
    case FLAG_TRIPLE:
        if (!flags_parse_triple(triple, text)) {
            lp_fail(err, LP_INVALID, shown, "\"%.60s\" is not three numbers such as 1.5,20,-3",
                    text);
            return false;
        }
        for (int i = 0; i < 3; i++)
            if (!in_range(flag, shown, triple[i], text, err))
                return false;
        memcpy(flag->to.triple, triple, sizeof triple);
        return true;
    }
    return false;
}

/* Whether `word` names the flag; `*value` is what follows "=", or NULL. */
static bool names_flag(const struct flag *flag, const char *word, const char **value)
{
    *value = NULL;
    if (word[0] == '-' && word[1] != '-')
        return flag->letter && word[1] == flag->letter && word[2] == '\0';
    size_t length = strlen(flag->name);
    if (strncmp(word + 2, flag->name, length) != 0)
        return false;
    if (word[2 + length] == '=')
        *value = word + 2 + length + 1;
    return word[2 + length] == '\0' || *value;
}

/* Reads the flag at argv[*at]; moves *at on to its value where that is a word of its own. */
static enum flags_answer read_flag(struct flag_set *set, int argc, char **argv, int *at,
                                   struct lp_error *err)
{
    const char *word = argv[*at];
    struct flag *flag = NULL;
    const char *value = NULL;
    for (size_t i = 0; i < set->flag_count && !flag; i++)
        if (names_flag(&set->flags[i], word, &value))
            flag = &set->flags[i];
    if (!flag)
        return unknown_flag(set, word, err);
    char shown[WORD_MAX + 3];
    snprintf(shown, sizeof shown, "--%s", flag->name);
    if (flag->given) {
        lp_fail(err, LP_INVALID, shown, "given twice; once is enough");
        return FLAGS_WRONG;
    }
    if (flag->kind == FLAG_SWITCH && value) {
        lp_fail(err, LP_INVALID, shown, "takes no value");
        return FLAGS_WRONG;
    }
    if (flag->kind != FLAG_SWITCH && !value) {
        if (*at + 1 >= argc) {
            lp_fail(err, LP_INVALID, shown, "the value %s is missing", flag->value);
            return FLAGS_WRONG;
        }
        value = argv[++*at];
    }
    flag->given = true;
    return store_value(flag, shown, value ? value : "", err) ? FLAGS_READY : FLAGS_WRONG;
}

enum flags_answer flags_read(struct flag_set *set, int argc, char **argv, int *argument_count,
                             struct lp_error *err)
{
    for (int i = 1; i < argc && strcmp(argv[i], "--") != 0; i++) {
        if (strcmp(argv[i], "--help") == 0 || strcmp(argv[i], "-h") == 0) {
            flags_help(set, stdout);
            return FLAGS_HELP;
        }
    }
    int count = 0;
    bool flags_end = false;
    for (int i = 1; i < argc; i++) {
        if (!flags_end && strcmp(argv[i], "--") == 0) {
            flags_end = true;
        } else if (!flags_end && argv[i][0] == '-' && argv[i][1] != '\0') {
            enum flags_answer answer = read_flag(set, argc, argv, &i, err);
            if (answer != FLAGS_READY)
                return answer;
        } else {
            argv[count++] = argv[i]; /* count < i: nothing unread is overwritten */
        }
    }
    if (count > set->arguments_max) {
        lp_fail(err, LP_INVALID, argv[set->arguments_max], "one argument too many; usage: %s",
                set->usage);
        return FLAGS_WRONG;
    }
    if (count < set->arguments_min) {
        lp_fail(err, LP_INVALID, "", "an argument is missing; usage: %s", set->usage);
        return FLAGS_WRONG;
    }
    *argument_count = count;
    return FLAGS_READY;
}

void flags_help(const struct flag_set *set, FILE *out)
{
    fprintf(out, "usage: %s\n\n%s\n\n", set->usage, set->summary);
    for (size_t i = 0; i < set->flag_count; i++) {
        const struct flag *flag = &set->flags[i];
        char left[64];
        char letter[8] = "";
        if (flag->letter)
            snprintf(letter, sizeof letter, "-%c, ", flag->letter);
        snprintf(left, sizeof left, "  %s--%s%s%s", letter, flag->name, flag->value ? " " : "",
                 flag->value ? flag->value : "");
        fprintf(out, "%-*s %s\n", HELP_COLUMN, left, flag->help);
    }
    fprintf(out, "%-*s %s\n", HELP_COLUMN, "  -h, --help", "this text");
}
