/* Reading jobs: defaults, both ends of every range, wrong types, and sentences with pointers. */
#include "protocol/wire.h"
#include "tests/harness/test.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A good job without its closing brace, and one without mode. */
#define BASE "{\"scene\":\"duned\",\"probes\":[[1,2,3]]"
#define LOD  BASE ",\"mode\":\"lod\""
#define REF  BASE ",\"mode\":\"reference\""

static struct wire_job job;
static struct wire_problem problem;

static enum wire_problem_code read_job(const char *text)
{
    struct wire_job untouched;
    memset(&job, 0x5a, sizeof job);
    memset(&untouched, 0x5a, sizeof untouched);
    enum wire_problem_code code = wire_job_read(&job, &problem, text, strlen(text));
    CHECK_EQ(code, problem.code);
    if (code != WIRE_PROBLEM_NONE && memcmp(&job, &untouched, sizeof job) != 0)
        test_fail(__FILE__, __LINE__, "the job was touched by %s", text);
    return code;
}

static void accept(const char *text)
{
    if (read_job(text) != WIRE_PROBLEM_NONE) {
        test_fail(__FILE__, __LINE__, "%s is refused: %s", text, problem.detail);
        memset(&job, 0, sizeof job);
    }
}

/* Exactly one offender, at `pointer`, whose sentence says `piece`. */
static void refuse(const char *text, const char *pointer, const char *piece)
{
    if (read_job(text) != WIRE_PROBLEM_INVALID_FIELD)
        test_fail(__FILE__, __LINE__, "%s gives code %d: %s", text, (int)problem.code,
                  problem.detail);
    if (problem.error_count != 1)
        test_fail(__FILE__, __LINE__, "%s has %u offenders, second %s: %s", text,
                  problem.error_count, problem.errors[1].pointer, problem.errors[1].detail);
    CHECK_STR(problem.errors[0].pointer, pointer);
    CHECK_HAS(problem.errors[0].detail, piece);
    CHECK_HAS(problem.detail, piece);
}

/* The same for the member `field` put into a job of mode lod or reference. */
static void refuse_in(const char *base, const char *field, const char *pointer, const char *piece)
{
    char text[2048];
    snprintf(text, sizeof text, "%s,%s}", base, field);
    refuse(text, pointer, piece);
}

static void accept_in(const char *base, const char *field)
{
    char text[2048];
    snprintf(text, sizeof text, "%s,%s}", base, field);
    accept(text);
}

TEST(job_defaults_are_filled)
{
    accept(LOD "}");
    CHECK_EQ(job.kind, WIRE_KIND_RENDER);
    CHECK_STR(job.scene, "duned");
    CHECK_STR(job.lighting, "albedo");
    CHECK(job.position_m[0] == 1 && job.position_m[1] == 2 && job.position_m[2] == 3);
    CHECK_EQ(job.mode, WIRE_MODE_LOD);
    CHECK_EQ(job.face_px, 64);
    CHECK_EQ(job.face_count, 6);
    for (int i = 0; i < 6; i++)
        CHECK_EQ(job.faces[i], i);
    CHECK_EQ(job.levels, WIRE_LEVELS_CONE);
    CHECK_EQ(job.samples_per_axis, 4);
    for (int i = 0; i < 3; i++)
        CHECK(job.environment_constant[i] == 0);
    CHECK_EQ(job.seed, 0);
    CHECK(job.images[WIRE_IMAGE_PNG] && !job.images[WIRE_IMAGE_EXR]);
    CHECK_EQ(job.layout, WIRE_LAYOUT_STRIP);
    CHECK_EQ(job.priority, 5);
    CHECK_STR(job.client_ref, "");
    accept(REF "}");
    CHECK_EQ(job.mode, WIRE_MODE_REFERENCE);
}

TEST(job_defaults_may_be_written_out)
{
    accept(REF ",\"kind\":\"render\",\"lighting\":\"albedo\",\"face_px\":64,\"faces\":[\"+X\","
               "\"-X\",\"+Y\",\"-Y\",\"+Z\",\"-Z\"],\"samples_per_axis\":4,\"environment\":{"
               "\"constant\":[0,0,0]},\"seed\":0,\"images\":[\"png\"],\"layout\":\"strip\","
               "\"aovs\":[\"radiance\"],\"priority\":5,\"client_ref\":\"\"}");
    struct wire_job written = job;
    accept(REF "}");
    CHECK(memcmp(&written, &job, sizeof job) == 0);
}

TEST(job_reads_values)
{
    accept("{\"scene\":\"a.b-c_1\",\"lighting\":\"noon\",\"mode\":\"lod\",\"levels\":\"fixed\","
           "\"face_px\":6.4e1,\"faces\":[\"-Z\",\"+Y\",\"+X\"],\"probes\":[[-1e9,0.1,1e9]],"
           "\"environment\":{\"constant\":[0.5,1,65504]},\"seed\":9007199254740992,"
           "\"images\":[\"exr\",\"png\"],\"priority\":0,\"client_ref\":\"\\u00e9 \\\"x\\\"\"}");
    CHECK_STR(job.scene, "a.b-c_1");
    CHECK_STR(job.lighting, "noon");
    CHECK_EQ(job.levels, WIRE_LEVELS_FIXED);
    CHECK_EQ(job.face_px, 64);
    CHECK_EQ(job.face_count, 3);
    CHECK(job.faces[0] == 0 && job.faces[1] == 2 && job.faces[2] == 5);
    CHECK(job.position_m[0] == -1e9 && job.position_m[1] == 0.1 && job.position_m[2] == 1e9);
    CHECK(job.environment_constant[0] == 0.5 && job.environment_constant[2] == 65504);
    CHECK_EQ(job.seed, 9007199254740992);
    CHECK(job.images[WIRE_IMAGE_PNG] && job.images[WIRE_IMAGE_EXR]);
    CHECK_EQ(job.priority, 0);
    CHECK_STR(job.client_ref, "\xc3\xa9 \"x\"");
    accept_in(LOD, "\"images\":[]");
    CHECK(!job.images[WIRE_IMAGE_PNG] && !job.images[WIRE_IMAGE_EXR]);
}

TEST(job_needs_scene_probes_and_mode)
{
    CHECK_EQ(read_job("{}"), WIRE_PROBLEM_INVALID_FIELD);
    CHECK_EQ(problem.error_count, 3);
    CHECK_STR(problem.errors[0].pointer, "/scene");
    CHECK_STR(problem.errors[1].pointer, "/probes");
    CHECK_STR(problem.errors[2].pointer, "/mode");
    CHECK_HAS(problem.detail, "3 fields are wrong; the first is /scene: ");
    refuse("{\"mode\":\"lod\",\"probes\":[[0,0,0]]}", "/scene", "write it like \"scene\": \"");
    refuse("{\"mode\":\"lod\",\"scene\":\"a\"}", "/probes", "write it like \"probes\": [[");
    refuse(BASE "}", "/mode",
           "the default mode error-aware is not in this version; ask for \"reference\" or \"lod\"");
}

TEST(job_is_an_object)
{
    refuse("[]", "", "expected a job, which is an object, found a list");
    refuse("null", "", "found null");
    refuse("\"render\"", "", "found a text");
    refuse("3", "", "found a number");
    refuse("true", "", "found a boolean");
    CHECK_EQ(read_job("{"), WIRE_PROBLEM_INVALID_JSON);
    CHECK_HAS(problem.detail, "line 1, column 2:");
    CHECK_EQ(read_job(""), WIRE_PROBLEM_INVALID_JSON);
    CHECK_EQ(wire_job_read(&job, &problem, NULL, 0), WIRE_PROBLEM_INVALID_JSON);
    CHECK_EQ(wire_job_read(&job, &problem, LOD "}\0", sizeof LOD "}"), WIRE_PROBLEM_INVALID_JSON);
    CHECK_EQ(wire_job_read(&job, &problem, LOD "}x", sizeof LOD "}" - 1), WIRE_PROBLEM_NONE);
}

TEST(job_names_unknown_fields_and_suggests)
{
    refuse_in(LOD, "\"facepx\":64", "/facepx", "no field \"facepx\"; did you mean \"face_px\"?");
    refuse_in(LOD, "\"face_xp\":64", "/face_xp", "did you mean \"face_px\"?");
    refuse_in(LOD, "\"Face_PX\":64", "/Face_PX", "did you mean \"face_px\"?");
    refuse_in(LOD, "\"SCENE\":\"x\"", "/SCENE", "did you mean \"scene\"?");
    refuse_in(LOD, "\"sample_per_axis\":1", "/sample_per_axis", "mean \"samples_per_axis\"?");
    refuse_in(LOD, "\"zz\":1", "/zz", "there is no field \"zz\"");
    CHECK(!strstr(problem.detail, "did you mean"));
    refuse_in(LOD, "\"completely_different\":1", "/completely_different", "there is no field");
    CHECK(!strstr(problem.detail, "did you mean"));
    refuse_in(LOD, "\"a/b~c\":1", "/a~1b~0c", "there is no field \"a/b~c\"");
    refuse_in(LOD, "\"\":1", "/", "there is no field \"\"");
    refuse_in(LOD, "\"\\u00e9\\n\":1", "/\xc3\xa9\n", "there is no field");
}

TEST(job_fields_are_given_once)
{
    refuse_in(LOD, "\"face_px\":1,\"face_px\":2", "/face_px", "given twice");
    refuse_in(LOD, "\"scene\":\"duned\"", "/scene", "given twice");
    refuse_in(LOD, "\"environment\":{\"constant\":[0,0,0],\"constant\":[0,0,0]}",
              "/environment/constant", "given twice");
    refuse_in(LOD, "\"x\":1,\"x\":2", "/x", "no field");
}

/* Values of every JSON type, and for each field which of them are of the right one. */
TEST(job_fields_have_types)
{
    static const struct {
        const char *text, *found;
        char type;
    } values[] = {{"null", "found null", '0'},        {"true", "found a boolean", 'b'},
                  {"false", "found a boolean", 'b'},  {"7", "found a number", 'n'},
                  {"\"seven\"", "found a text", 's'}, {"[]", "found a list", 'l'},
                  {"{}", "found an object", 'o'}};
    static const struct {
        const char *name;
        char type;
    } fields[] = {{"kind", 's'},   {"lighting", 's'},    {"face_px", 'n'},  {"faces", 'l'},
                  {"levels", 's'}, {"environment", 'o'}, {"seed", 'n'},     {"images", 'l'},
                  {"layout", 's'}, {"aovs", 'l'},        {"priority", 'n'}, {"client_ref", 's'}};
    for (size_t f = 0; f < sizeof fields / sizeof fields[0]; f++) {
        for (size_t v = 0; v < sizeof values / sizeof values[0]; v++) {
            char member[128], pointer[32];
            if (fields[f].type == values[v].type)
                continue;
            snprintf(member, sizeof member, "\"%s\":%s", fields[f].name, values[v].text);
            snprintf(pointer, sizeof pointer, "/%s", fields[f].name);
            refuse_in(LOD, member, pointer, values[v].found);
        }
    }
    refuse_in(REF, "\"samples_per_axis\":\"4\"", "/samples_per_axis", "found a text");
    refuse_in(BASE, "\"mode\":1", "/mode", "found a number");
    refuse("{\"scene\":1,\"mode\":\"lod\",\"probes\":[[0,0,0]]}", "/scene", "found a number");
    refuse("{\"scene\":\"a\",\"mode\":\"lod\",\"probes\":{}}", "/probes", "found an object");
    refuse("{\"scene\":\"a\",\"mode\":\"lod\",\"probes\":\"0,0,0\"}", "/probes", "found a text");
    refuse("{\"scene\":\"a\",\"mode\":\"lod\",\"probes\":[null]}", "/probes/0", "found null");
    refuse("{\"scene\":\"a\",\"mode\":\"lod\",\"probes\":[[0,\"1\",0]]}", "/probes/0/1",
           "found a text");
    refuse_in(LOD, "\"environment\":{\"constant\":1}", "/environment/constant", "found a number");
    refuse_in(LOD, "\"environment\":{\"constant\":[0,0,true]}", "/environment/constant/2",
              "found a boolean");
}

TEST(job_integers_have_ranges)
{
    static const struct {
        const char *base, *name;
        uint64_t low, high;
        size_t offset;
        bool wide;
    } fields[] = {
        {LOD, "face_px", 1, 4096, offsetof(struct wire_job, face_px), false},
        {REF, "samples_per_axis", 1, 32, offsetof(struct wire_job, samples_per_axis), false},
        {LOD, "priority", 0, 9, offsetof(struct wire_job, priority), false},
        {REF, "seed", 0, UINT64_C(1) << 53, offsetof(struct wire_job, seed), true},
    };
    for (size_t f = 0; f < sizeof fields / sizeof fields[0]; f++) {
        char member[128], pointer[32];
        snprintf(pointer, sizeof pointer, "/%s", fields[f].name);
        for (int end = 0; end < 2; end++) {
            uint64_t value = end ? fields[f].high : fields[f].low;
            snprintf(member, sizeof member, "\"%s\":%llu", fields[f].name,
                     (unsigned long long)value);
            accept_in(fields[f].base, member);
            const char *at = (const char *)&job + fields[f].offset;
            uint32_t narrow;
            uint64_t wide;
            memcpy(&narrow, at, sizeof narrow);
            memcpy(&wide, at, fields[f].wide ? sizeof wide : sizeof narrow);
            CHECK_EQ(fields[f].wide ? wide : narrow, value);
        }
        long long outside[] = {(long long)fields[f].low - 1, (long long)fields[f].high + 1,
                               -4294967295LL, 4294967296LL + 64};
        for (size_t i = 0; i < (fields[f].wide ? 3 : 4); i++) {
            snprintf(member, sizeof member, "\"%s\":%lld", fields[f].name, outside[i]);
            refuse_in(fields[f].base, member, pointer, "is out of range");
        }
        snprintf(member, sizeof member, "\"%s\":1.5", fields[f].name);
        refuse_in(fields[f].base, member, pointer, "1.5 is not a whole number");
        snprintf(member, sizeof member, "\"%s\":1e300", fields[f].name);
        refuse_in(fields[f].base, member, pointer, "out of range");
        snprintf(member, sizeof member, "\"%s\":1e999", fields[f].name);
        refuse_in(fields[f].base, member, pointer, "out of range");
    }
    refuse_in(LOD, "\"face_px\":0", "/face_px", "expected a whole number, 1..4096 px");
    refuse_in(LOD, "\"face_px\":64.5", "/face_px", "64.5 is not a whole number");
    accept_in(LOD, "\"face_px\":64.0");
    CHECK_EQ(job.face_px, 64);
    accept_in(LOD, "\"priority\":-0");
    CHECK_EQ(job.priority, 0);
    accept_in(LOD, "\"seed\":3"); /* every mode takes a seed */
    CHECK_EQ(job.seed, 3);
}

TEST(job_words_are_known_or_of_later_versions)
{
    static const struct {
        const char *member, *pointer, *piece;
    } cases[] = {
        {"\"kind\":\"compare\"", "/kind",
         "\"compare\" is not in this version; what works is \"ren"},
        {"\"kind\":\"sweep\"", "/kind", "not in this version"},
        {"\"kind\":\"tune\"", "/kind", "not in this version"},
        {"\"kind\":\"Render\"", "/kind", "did you mean \"render\"?"},
        {"\"kind\":\"\"", "/kind", "\"\" is not known here"},
        {"\"levels\":\"cones\"", "/levels", "expected \"cone\" or \"fixed\"; did you mean \"cone"},
        {"\"layout\":\"faces\"", "/layout", "not in this version"},
        {"\"layout\":\"cross\"", "/layout", "not in this version"},
        {"\"layout\":\"equirect\"", "/layout", "not in this version"},
        {"\"layout\":\"octahedral\"", "/layout", "what works is \"strip\""},
        {"\"images\":[\"png\",\"hdr\"]", "/images/1", "not in this version"},
        {"\"images\":[\"ktx2\"]", "/images/0", "not in this version"},
        {"\"images\":[\"dds\"]", "/images/0", "what works is \"png\" or \"exr\""},
        {"\"images\":[\"jpeg\"]", "/images/0", "\"jpeg\" is not known here"},
        {"\"images\":[\"png\",\"png\"]", "/images/1", "in the list twice"},
        {"\"images\":[1]", "/images/0", "expected a word"},
        {"\"aovs\":[\"radiance\",\"depth\"]", "/aovs/1", "not in this version"},
        {"\"aovs\":[\"error\"]", "/aovs/0", "what works is \"radiance\""},
        {"\"aovs\":[]", "/aovs", "must not be empty"},
        {"\"faces\":[]", "/faces", "must not be empty"},
        {"\"faces\":[\"+X\",\"-X\",\"+X\"]", "/faces/2", "\"+X\" is in the list twice"},
        {"\"faces\":[\"+x\"]", "/faces/0", "did you mean \"+X\"?"},
        {"\"faces\":[\"up\"]", "/faces/0",
         "expected \"+X\", \"-X\", \"+Y\", \"-Y\", \"+Z\" or \"-Z"},
        {"\"faces\":[0]", "/faces/0", "found a number"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++)
        refuse_in(LOD, cases[i].member, cases[i].pointer, cases[i].piece);
    refuse_in(BASE, "\"mode\":\"adaptive\"", "/mode", "not in this version");
    refuse_in(BASE, "\"mode\":\"error-aware\"", "/mode", "\"error-aware\" is not in this version");
    refuse_in(BASE, "\"mode\":\"prefiltered\"", "/mode", "works is \"reference\" or \"lod\"");
    refuse_in(BASE, "\"mode\":\"referense\"", "/mode", "did you mean \"reference\"?");
}

TEST(job_fields_of_later_versions_say_so)
{
    static const char *const members[] = {"lightings\":[\"a\"]",
                                          "grid\":{}",
                                          "threshold\":0.1",
                                          "decay\":0.2",
                                          "table\":\"compact\"",
                                          "max_refinement\":2",
                                          "variance_low\":0.25",
                                          "variance_high\":0.75",
                                          "variance_scale\":1",
                                          "iterations\":1",
                                          "base_level\":\"x\"",
                                          "sh\":\"raw\"",
                                          "deadline_ms\":1000",
                                          "reference\":{}",
                                          "candidates\":[]",
                                          "thresholds\":[]",
                                          "decays\":[]",
                                          "face_px_list\":[]",
                                          "modes\":[]",
                                          "target\":{}",
                                          "search\":\"threshold\""};
    for (size_t i = 0; i < sizeof members / sizeof members[0]; i++) {
        char member[64], pointer[32];
        snprintf(member, sizeof member, "\"%s", members[i]);
        snprintf(pointer, sizeof pointer, "/%.*s", (int)strcspn(members[i], "\""), members[i]);
        refuse_in(LOD, member, pointer, "is not in this version: ");
    }
    refuse_in(LOD, "\"environment\":{\"gradient\":{}}", "/environment/gradient",
              "\"gradient\" is not in this version; what works is \"constant\"");
    refuse_in(LOD, "\"environment\":{\"hdri\":\"sky\"}", "/environment/hdri",
              "not in this version");
    refuse("{\"scene\":\"a\",\"mode\":\"lod\",\"probes\":[{\"above_ground_m\":2,\"x\":0,\"z\":0}]}",
           "/probes/0", "not in this version; give [x, y, z]");
}

TEST(job_fields_of_other_modes_are_checked_and_kept)
{
    refuse_in(REF, "\"levels\":\"coarse\"", "/levels", "\"coarse\" is not known here");
    refuse_in(LOD, "\"samples_per_axis\":33", "/samples_per_axis", "out of range");
    accept_in(LOD, "\"samples_per_axis\":5");
    CHECK_EQ(job.samples_per_axis, 5);
    accept_in(REF, "\"levels\":\"fixed\"");
    CHECK_EQ(job.levels, WIRE_LEVELS_FIXED);
}

TEST(job_has_exactly_one_probe)
{
    static const struct {
        const char *probes, *pointer, *piece;
    } cases[] = {
        {"[]", "/probes", "exactly one place, such as [[0, 2, 0]], found 0"},
        {"[[0,0,0],[1,1,1]]", "/probes", "found 2"},
        {"[1,2,3]", "/probes", "write [[x, y, z]]"},
        {"[[1,2]]", "/probes/0", "expected three numbers [x, y, z] in metres, found a list of 2"},
        {"[[1,2,3,4]]", "/probes/0", "found a list of 4"},
        {"[[]]", "/probes/0", "found a list of 0"},
        {"[[1e9,1000000001,0]]", "/probes/0/1", "1000000001 is out of range"},
        {"[[-1.0000001e9,0,0]]", "/probes/0/0", "-1000000000..1000000000 m"},
        {"[[0,0,1e999]]", "/probes/0/2", "out of range"},
        {"[[0,0,[1]]]", "/probes/0/2", "found a list"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        char text[256];
        snprintf(text, sizeof text, "{\"scene\":\"a\",\"mode\":\"lod\",\"probes\":%s}",
                 cases[i].probes);
        refuse(text, cases[i].pointer, cases[i].piece);
    }
}

TEST(job_environment_is_a_constant)
{
    accept_in(LOD, "\"environment\":{\"constant\":[0,0.125,65504]}");
    CHECK(job.environment_constant[1] == 0.125 && job.environment_constant[2] == 65504);
    refuse_in(LOD, "\"environment\":{\"constant\":[0,0,65504.5]}", "/environment/constant/2",
              "65504.5 is out of range: expected a number, 0..65504");
    refuse_in(LOD, "\"environment\":{\"constant\":[-1e-300,0,0]}", "/environment/constant/0",
              "out of range");
    refuse_in(LOD, "\"environment\":{\"constant\":[0,0]}", "/environment/constant",
              "three numbers [r, g, b]");
    refuse_in(LOD, "\"environment\":{}", "/environment", "the object is empty");
    refuse_in(LOD, "\"environment\":{\"constnat\":[0,0,0]}", "/environment/constnat",
              "did you mean \"constant\"?");
    refuse_in(LOD, "\"environment\":{\"constant\":[0,0,0],\"a/b\":1}", "/environment/a~1b",
              "no field \"a/b\"");
}

TEST(job_texts_and_names_have_limits)
{
    char member[600], name[WIRE_NAME_BYTES + 1], ref[WIRE_CLIENT_REF_BYTES + 1];
    memset(name, 'n', sizeof name);
    memset(ref, 'r', sizeof ref);
    name[WIRE_NAME_BYTES - 1] = ref[WIRE_CLIENT_REF_BYTES - 1] = '\0';
    snprintf(member, sizeof member, "\"lighting\":\"%s\",\"client_ref\":\"%s\"", name, ref);
    accept_in(LOD, member);
    CHECK_STR(job.lighting, name);
    CHECK_STR(job.client_ref, ref);
    name[WIRE_NAME_BYTES - 1] = 'n';
    ref[WIRE_CLIENT_REF_BYTES - 1] = 'r';
    name[WIRE_NAME_BYTES] = ref[WIRE_CLIENT_REF_BYTES] = '\0';
    snprintf(member, sizeof member, "\"lighting\":\"%s\"", name);
    refuse_in(LOD, member, "/lighting", "longer than 100 characters");
    snprintf(member, sizeof member, "\"client_ref\":\"%s\"", ref);
    refuse_in(LOD, member, "/client_ref", "a text of 257 bytes is too long; at most 256");
    refuse_in(LOD, "\"client_ref\":\"a\\u0000b\"", "/client_ref", "\\u0000");
    refuse_in(LOD, "\"lighting\":\"../../etc/passwd\"", "/lighting", "a name, not a path");
    refuse("{\"scene\":\".lps\",\"mode\":\"lod\",\"probes\":[[0,0,0]]}", "/scene", "starts with");
    refuse("{\"scene\":\"a\\u0000\",\"mode\":\"lod\",\"probes\":[[0,0,0]]}", "/scene", "\\u0000");
    refuse("{\"scene\":\"\",\"mode\":\"lod\",\"probes\":[[0,0,0]]}", "/scene", "empty");
}

TEST(job_offenders_are_collected)
{
    static const char *const pointers[] = {"/face_px",    "/nonsense", "/probes/0/1", "/seed",
                                           "/client_ref", "/layout",   "/scene"};
    CHECK_EQ(read_job("{\"face_px\":0,\"nonsense\":true,\"probes\":[[0,\"1\",2]],\"seed\":"
                      "9007199254740993,\"client_ref\":\"\\u0000\",\"layout\":\"cross\",\"mode\":"
                      "\"lod\"}"),
             WIRE_PROBLEM_INVALID_FIELD);
    CHECK_EQ(problem.error_count, 7);
    CHECK_HAS(problem.detail, "7 fields are wrong; the first is ");
    for (size_t p = 0; p < sizeof pointers / sizeof pointers[0]; p++) {
        bool found = false;
        for (uint32_t i = 0; i < problem.error_count; i++)
            found |= strcmp(problem.errors[i].pointer, pointers[p]) == 0;
        if (!found)
            test_fail(__FILE__, __LINE__, "nothing points at %s", pointers[p]);
    }
}

TEST(job_offenders_have_a_limit)
{
    static char text[1u << 20];
    size_t bytes = (size_t)snprintf(text, sizeof text, "{\"scene\":\"a\"");
    for (int i = 0; i < 50000; i++)
        bytes += (size_t)snprintf(text + bytes, sizeof text - bytes, ",\"u%d\":%d", i, i);
    snprintf(text + bytes, sizeof text - bytes, "}");
    CHECK_EQ(read_job(text), WIRE_PROBLEM_INVALID_FIELD);
    CHECK_EQ(problem.error_count, WIRE_FIELD_ERRORS_MAX);
    CHECK_HAS(problem.detail, "at least 32 fields are wrong");
    CHECK_STR(problem.errors[31].pointer, "/u31");
    bytes = (size_t)snprintf(text, sizeof text, "{\"scene\":\"a\",\"probes\":[[0");
    for (int i = 0; i < 90000; i++)
        bytes += (size_t)snprintf(text + bytes, sizeof text - bytes, "],[1");
    snprintf(text + bytes, sizeof text - bytes, "]]}");
    CHECK_EQ(read_job(text), WIRE_PROBLEM_INVALID_JSON); /* too many values */
}

TEST(job_reading_survives_mutations)
{
    static const char document[] =
        "{\"kind\":\"render\",\"scene\":\"duned\",\"lighting\":\"albedo\",\"probes\":[[1.5,2,-3e2]]"
        ","
        "\"mode\":\"lod\",\"face_px\":64,\"faces\":[\"+X\",\"-Z\"],\"levels\":\"fixed\","
        "\"environment\":{\"constant\":[0,0.5,1]},\"seed\":12,\"images\":[\"png\",\"exr\"],"
        "\"layout\":\"strip\",\"aovs\":[\"radiance\"],\"priority\":3,\"client_ref\":\"x\"}";
    test_random random = test_random_begin();
    unsigned counts[3] = {0};
    for (int i = 0; i < 20000; i++) {
        char text[sizeof document];
        memcpy(text, document, sizeof document);
        uint32_t changes = 1 + test_random_below(&random, 2);
        for (uint32_t c = 0; c < changes; c++) {
            size_t a = test_random_below(&random, sizeof document - 1);
            size_t b = test_random_below(&random, sizeof document - 1);
            text[a] = test_random_below(&random, 3) ? text[b]
                                                    : (char)(1 + test_random_below(&random, 255));
        }
        switch (read_job(text)) {
        case WIRE_PROBLEM_NONE:
            counts[0]++;
            CHECK(wire_name_ok(job.scene) && wire_name_ok(job.lighting));
            CHECK(job.face_px >= 1 && job.face_px <= 4096 && job.face_count >= 1);
            break;
        case WIRE_PROBLEM_INVALID_FIELD:
            counts[1]++;
            CHECK(problem.error_count > 0);
            break;
        default:
            counts[2]++;
            CHECK_EQ(problem.code, WIRE_PROBLEM_INVALID_JSON);
        }
    }
    CHECK(counts[0] > 100 && counts[1] > 1000 && counts[2] > 1000);
}
