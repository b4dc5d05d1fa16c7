/* Flags of a command as a table: reading, checking, helping.
 *
 *     uint64_t depth = 0;
 *     struct flag flags[] = {
 *         {.name = "depth", .value = "D", .help = "levels of the tree", .kind = FLAG_U64,
 *          .to.u64 = &depth, .min = 1, .max = 14},
 *     };
 *
 * Written as `--flag value`, `--flag=value` or, where it has a letter, `-o value`; `--` ends the
 * flags; everything else, a lone `-` included, is an argument. */
#ifndef FLAGS_H
#define FLAGS_H

#include <stdio.h>

#include "engine/base.h"

enum flag_kind {
    FLAG_SWITCH, /* no value */
    FLAG_TEXT,   /* anything, not empty */
    FLAG_U64,    /* decimal digits, min..max */
    FLAG_F64,    /* a finite decimal number, min..max */
    FLAG_TRIPLE  /* three finite decimal numbers "x,y,z", each min..max */
};

struct flag {
    const char *name;  /* without the dashes */
    char letter;       /* a short form; 0: none */
    const char *value; /* what to call the value in the help */
    const char *help;
    enum flag_kind kind;
    union { /* where the value goes, by kind; untouched unless given */
        bool *on;
        const char **text; /* a view into argv */
        uint64_t *u64;
        double *f64;
        double *triple; /* [3] */
    } to;
    double min, max; /* numbers only; both 0: any (that the kind can hold exactly) */
    bool given;      /* set by flags_read */
};

struct flag_set {
    const char *usage;   /* "lightprobe build SOURCE -o SCENE.lps [flags]" */
    const char *summary; /* a paragraph for --help */
    struct flag *flags;
    size_t flag_count;
    int arguments_min, arguments_max; /* beside the flags */
};

enum flags_answer {
    FLAGS_READY, /* go on: argv[0..*argument_count - 1] are the arguments */
    FLAGS_HELP,  /* --help was asked for and printed to standard output */
    FLAGS_WRONG  /* err holds one sentence */
};

/* Reads argv[1..argc-1] (argv[0] is the command's name) and moves the arguments to the front of
 * argv. A flag that is given twice, unknown, or out of range is wrong. Thread: any. */
enum flags_answer flags_read(struct flag_set *set, int argc, char **argv, int *argument_count,
                             struct lp_error *err);

/* The help text. */
void flags_help(const struct flag_set *set, FILE *out);

/* Strict numbers: the whole text, no white space, no hexadecimals, no inf or nan. False and `*out`
 * untouched otherwise. */
bool flags_parse_u64(uint64_t *out, const char *text);
bool flags_parse_f64(double *out, const char *text);
bool flags_parse_triple(double out[3], const char *text);

/* How many letters have to be typed, dropped, changed or swapped with their neighbour to make `b`
 * of `a`; texts beyond 31 letters are as far apart as can be. */
unsigned flags_distance(const char *a, const char *b);

#endif
