// Sessions as files: written values are read back, every fault is reported, a folder lists a trainee's sessions in order, and a digest belongs to one recording
// only.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "score_scene.h"
#include "sim/session.h"

#include <cJSON.h>
#include <stdio.h>
#include <sys/stat.h>
#include <unistd.h>

#define SCENE                                                                                                                                                  \
    "seldinger: 1\n" TOOL                                                                                                                                      \
    "sheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0], inserted_mm: 1}\n" AT(9) "exercise: {title: \"Go \\\"there\\\" <now>\", target: there, hold_s: 0.5, " \
                                                                                  "rules: {blind_mm: 2, contrast_ml: 1}, par: {time_s: 0.5, path_ratio: 1}}\n"

static Faults faults;

// A short run with two errors, recorded.
static void record(const char *path, Session *session, const char *trainee, time_t when, double push_mm_s)
{
    Practice *p = practice_begin(SCENE, NULL);
    RecordingOptions options = recording_default_options();
    Recording *recording = recording_create(path, p->simulator, &options, &faults);
    assert_non_null(recording);
    p->watched = true;
    p->xray.contrast_ml_s = 3;
    for (int i = 0; i < 1200; i++) {
        double push = i < 8 / push_mm_s * 1000 ? push_mm_s : 0;
        practice_step(p, push);
        assert_true(recording_step(recording, p->simulator, &(ToolCommands){.tool = {{push, 0}}}, &p->xray));
    }
    assert_true(recording_close(recording, p->simulator, &faults));
    RecordedRun *run = recorded_run_load_series(path, &faults);
    assert_non_null(run);
    char date[SESSION_DATE];
    session_date(when, date);
    session_begin(session, p->scene, trainee, "a keyboard", date);
    session_set_score(session, p->score);
    session_set_run(session, run, strrchr(path, '/') + 1);
    assert_int_equal(session->figures.state, SCORE_REACHED);
    assert_true(session->event_count >= 2);
    assert_true(session_is_of(session, run));
    run->command[10] += 1e-9;
    assert_false(session_is_of(session, run));
    recorded_run_free(run);
    practice_end(p);
}

static char folder[] = "/tmp/seldinger-session-XXXXXX";
#include "tests/folder.h"
static Session one;
static char *one_text;

static int make_one(void **state)
{
    if (make_folder(state) != 0)
        return -1;
    record(in_folder("one.h5"), &one, "Ada \xc3\xa9 <b>", 1762000000, 20);
    one_text = session_json(&one);
    return one_text ? 0 : -1;
}

static int remove_all(void **state)
{
    free(one_text);
    return remove_folder(state);
}

static void what_is_written_is_read_back(void **state)
{
    (void)state;
    static Session back;
    faults_clear(&faults);
    if (!session_parse(one_text, strlen(one_text), "one.json", &back, &faults))
        fail_msg("%s", faults.text[0]);
    assert_string_equal(back.trainee, one.trainee);
    assert_string_equal(back.date, "2025-11-01T12:26:40Z");
    assert_string_equal(back.title, "Go \"there\" <now>");
    assert_int_equal(back.state_hash, one.state_hash);
    assert_string_equal(back.series_sha256, one.series_sha256);
    assert_int_equal(back.event_count, one.event_count);
    assert_int_equal(back.event[1].kind, one.event[1].kind);
    assert_true(back.figures.points == one.figures.points && back.figures.path_mm == one.figures.path_mm);       // all digits
    for (int i = 0; i < ERROR_COUNT; i++)
        assert_int_equal(back.figures.error[i].count, one.figures.error[i].count);
    char *again = session_json(&back);
    assert_string_equal(again, one_text);
    free(again);
}

// A name too long is cut at a whole character, also one of bytes that are no beginning of any.
static void long_names_end_with_a_whole_character(void **state)
{
    (void)state;
    static Session session;
    char name[2 * sizeof session.trainee + 1] = {0};
    Practice *p = practice_begin(SCENE, NULL);
    const size_t most = sizeof session.trainee - 1;
    for (size_t shift = 0; shift < 2; shift++) {
        memset(name, 'a', sizeof name - 1);
        for (size_t i = shift; i + 1 < sizeof name - 1; i += 2)
            name[i] = '\xc3', name[i + 1] = '\xa9';
        session_begin(&session, p->scene, name, "", "1970-01-01T00:00:00Z");
        assert_int_equal(strlen(session.trainee), most - (most - shift) % 2);
        assert_memory_equal(session.trainee, name, strlen(session.trainee));
    }
    memset(name, 0x80, sizeof name - 1);
    session_begin(&session, p->scene, name, "", "1970-01-01T00:00:00Z");
    assert_string_equal(session.trainee, "");
    practice_end(p);
}

static void the_score_alone_is_json_too(void **state)
{
    (void)state;
    Practice *p = practice_begin(SCENE, NULL);
    char *text = score_json(&one.figures, p->scene);
    cJSON *json = cJSON_Parse(text);
    assert_non_null(json);
    assert_true(cJSON_GetObjectItem(json, "points")->valuedouble == one.figures.points);
    assert_string_equal(cJSON_GetObjectItem(json, "target")->valuestring, "there");
    assert_string_equal(cJSON_GetObjectItem(json, "state")->valuestring, "reached");
    cJSON_Delete(json);
    free(text);
    practice_end(p);
}

// With two tools each has its figures, and an error gives its tool.
static void several_tools_are_read_back(void **state)
{
    (void)state;
    static Session two, back;
    Practice *p = practice_begin(TWO_IN_THE_OPEN EXERCISE(", rules: {wire_behind_mm: 3}"), NULL);
    practice_go_tools(p, 20, 20, 0.5);
    practice_go_tools(p, 0, -20, 0.3);
    session_begin(&two, p->scene, "Ada", "", "1970-01-01T00:00:00Z");
    session_set_score(&two, p->score);
    practice_end(p);
    memset(two.series_sha256, '0', 64);
    assert_int_equal(two.event_count, 1);
    char *text = session_json(&two);
    faults_clear(&faults);
    if (!session_parse(text, strlen(text), "two.json", &back, &faults))
        fail_msg("%s", faults.text[0]);
    assert_int_equal(back.figures.tool_count, 2);
    assert_string_equal(back.figures.tool[1].name, "wire");
    assert_true(back.figures.tool[1].withdrawn_mm == two.figures.tool[1].withdrawn_mm);
    assert_int_equal(back.event[0].tool, 1);
    assert_int_equal(back.event[0].kind, ERROR_WIRE_LOST);
    char *again = session_json(&back);
    assert_string_equal(again, text);
    free(again);
    // an older version had no `strayed_mm`
    for (char *from; (from = strstr(text, "\"strayed_mm\""));) {
        char *to = strchr(from, '\n');
        while (*from != ',')
            from--;
        memmove(from, to, strlen(to) + 1);
    }
    assert_true(!strstr(text, "strayed") && session_parse(text, strlen(text), "two.json", &back, &faults));
    char *name = strstr(strstr(text, "\"events\""), "\"wire\"");
    assert_non_null(name);
    memcpy(name, "\"mire\"", 6);
    assert_false(session_parse(text, strlen(text), "two.json", &back, &faults));
    assert_non_null(strstr(faults.text[0], "'events.tool' is 'mire'"));
    free(text);
}

// A session of an older version has no lost wires, no kicks and no moved tips, and no figures for them.
static void an_older_session_is_read(void **state)
{
    (void)state;
    static Session back;
    char *text = strdup(one_text), *from = strstr(text, ",\n\t\t\t\"wire_lost\"");
    if (!from)
        fail_msg("%s", text);
    char *to = strstr(strstr(from, "\"tip_moved\""), "}") + 1;
    memmove(from, to, strlen(to) + 1);
    assert_null(strstr(text, "\"kick\""));
    // nor a mode, parts for what the trainee saw, or the points of each part
    cJSON *root = cJSON_Parse(text), *score = cJSON_GetObjectItem(root, "score");
    assert_true(cJSON_HasObjectItem(root, "mode") && cJSON_HasObjectItem(score, "points_of"));
    cJSON_DeleteItemFromObject(root, "mode");
    cJSON_DeleteItemFromObject(score, "points_of");
    cJSON_DeleteItemFromObject(score, "blind_total_mm");
    cJSON_DeleteItemFromObject(score, "guided_s");
    cJSON_DeleteItemFromObject(cJSON_GetObjectItem(score, "parts"), "blind");
    cJSON_DeleteItemFromObject(cJSON_GetObjectItem(score, "parts"), "guidance");
    free(text);
    text = cJSON_Print(root);
    cJSON_Delete(root);
    faults_clear(&faults);
    if (!session_parse(text, strlen(text), "old.json", &back, &faults))
        fail_msg("%s", faults.text[0]);
    assert_true(back.figures.points == one.figures.points);
    assert_int_equal(back.figures.tool_count, 1);
    assert_true(!back.is_examination && back.figures.part[PART_BLIND] == 1 && back.figures.judged[PART_TIME].most == 0);
    free(text);
}

static void every_prefix_and_a_byte_more_are_refused(void **state)
{
    (void)state;
    static Session untouched, got;
    size_t length = strlen(one_text);
    for (size_t n = 0; n < length; n++) {
        faults_clear(&faults);
        assert_false(session_parse(one_text, n, "cut.json", &got, &faults));
        assert_true(faults.count > 0);
    }
    assert_memory_equal(&untouched, &got, sizeof got);
    char *more = malloc(length + 3);
    snprintf(more, length + 3, "%s\n}", one_text);
    faults_clear(&faults);
    assert_false(session_parse(more, length + 2, "more.json", &got, &faults));
    assert_non_null(strstr(faults.text[0], "after the session"));
    faults_clear(&faults);
    assert_true(session_parse(more, length + 1, "more.json", &got, &faults));     // the line end is not a fault
    free(more);
}

// `from` replaced by `to` in the good file: one fault that has `words`.
static void each_wrong_value_is_reported(void **state)
{
    (void)state;
    static const struct {
        const char *from, *to, *words;
    } cases[] = {
        {"\"seldinger_session\":\t1", "\"seldinger_session\":\t2", "1 to 1"},
        {"\"trainee\":", "\"trainer\":", "unknown key 'trainer'"},
        {"\"device\":", "\"trainee\":", "duplicate key"},
        {"2025-11-01T12", "2025-11-1T12:", "'date' is"},
        {"\"steps\":\t1200", "\"steps\":\t12.5", "a whole number"},
        {"\"steps\":\t1200", "\"steps\":\t-3", "is -3; expected 0 to"},
        {"\"steps\":\t1200", "\"steps\":\t1e400", "'recording.steps'"},
        {"\"step_ms\":\t1", "\"step_ms\":\t0", "'recording.step_ms'"},
        {"\"state\":\t\"reached\"", "\"state\":\t\"won\"", "'score.state' is 'won'"},
        {"\"has_exercise\":\ttrue", "\"has_exercise\":\t1", "neither true nor false"},
        {"\"kind\":\t\"contrast\"", "\"kind\":\t\"laughter\"", "'events.kind'"},
        {"\"path_mm\":", "\"path_m\":", "unknown key 'path_m'"},
        {"\"efficiency\":\t", "\"efficiency\":\t9", "'score.efficiency'"},
        {"\"error_total\":\t", "\"error_total\":\t7", "the sum of the error counts"},
        {"\"buckling\":\t{", "\"buckling\":\t[{", "is not JSON"},
    };
    static Session got;
    int wrong = 0;
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        const char *at = strstr(one_text, cases[i].from);
        assert_non_null(at);
        char text[16384];
        snprintf(text, sizeof text, "%.*s%s%s", (int)(at - one_text), one_text, cases[i].to, at + strlen(cases[i].from));
        faults_clear(&faults);
        bool good = session_parse(text, strlen(text), "x.json", &got, &faults), found = false;
        for (int k = 0; k < faults.count && k < FAULTS_CAPACITY; k++)
            found = found || strstr(faults.text[k], cases[i].words);
        if (good || !found)
            wrong++, print_error("%s: expected %s; %d faults, the first: %s\n", cases[i].to, cases[i].words, faults.count, faults.text[0]);
    }
    assert_int_equal(wrong, 0);
}

static void put_session(const char *name, const Session *session)
{
    char *text = session_json(session);
    put(name, text);
    free(text);
}

static void a_folder_gives_the_trainees_own_in_order(void **state)
{
    (void)state;
    static Session other;
    other = one;
    strcpy(other.date, "2026-01-02T00:00:00Z");
    put_session("a.json", &other);
    strcpy(other.date, "2024-01-02T00:00:00Z");
    put_session("b.json", &other);
    strcpy(other.trainee, "Bob");
    put_session("c.json", &other);
    other = one;
    strcpy(other.title, "Another exercise");
    put_session("d.json", &other);
    put("e.json", "{\"seldinger_session\": 1}");
    put("summary.json", "{\"steps\": 3}");
    put("notes.txt", "nothing");
    int count, broken;
    faults_clear(&faults);
    Session *list = session_list(folder, one.trainee, one.title, &count, &broken, &faults);
    assert_non_null(list);
    assert_int_equal(count, 2);
    assert_int_equal(broken, 1);
    assert_string_equal(list[0].date, "2024-01-02T00:00:00Z");
    assert_string_equal(list[1].date, "2026-01-02T00:00:00Z");
    free(list);
    assert_null(session_list("/nowhere/at/all", "a", "b", &count, &broken, &faults));
    assert_int_equal(faults.count, 1);
}

static void long_names_are_cut_at_a_character(void **state)
{
    (void)state;
    static Session session;
    char name[300];
    Practice *p = practice_begin(SCENE, NULL);
    for (int i = 0; i < 149; i++)
        memcpy(name + 2 * i, "\xc3\xa9", 3);
    session_begin(&session, p->scene, name, "x", "1970-01-01T00:00:00Z");
    assert_int_equal(strlen(session.trainee), 94);           // 95 bytes would end within one
    assert_string_equal(session.date, "1970-01-01T00:00:00Z");
    practice_end(p);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_is_written_is_read_back),      cmocka_unit_test(long_names_end_with_a_whole_character),
        cmocka_unit_test(the_score_alone_is_json_too),       cmocka_unit_test(several_tools_are_read_back),
        cmocka_unit_test(an_older_session_is_read),          cmocka_unit_test(every_prefix_and_a_byte_more_are_refused),
        cmocka_unit_test(each_wrong_value_is_reported),      cmocka_unit_test(a_folder_gives_the_trainees_own_in_order),
        cmocka_unit_test(long_names_are_cut_at_a_character),
    };
    return cmocka_run_group_tests(tests, make_one, remove_all);
}
