// `seldinger report`: a self-contained page, which is also XML, with the contents of the session; without a recording, with another session's recording, with
// earlier sessions; printed by a browser. The browser's part is skipped by name if there is none.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "../sim/score_scene.h"
#include "sim/session.h"

#include <expat.h>
#include <signal.h>
#include <stdio.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

static char folder[] = "/tmp/seldinger-session-report-XXXXXX";
#include "tests/folder.h"

#define SCENE                                                                                                                                                  \
    "seldinger: 1\n" TOOL "sheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0], normal: [0, 1, 0], inserted_mm: 2}\n"                                           \
    "targets: [{name: 'the <end> & more', point_mm: [30, 12, 0], radius_mm: 2}]\n"                                                                             \
    "vessel: {friction: 0.1, tube: {start_mm: [0, 0, 0], direction: [1, 0, 0], normal: [0, 1, 0], radius_mm: 2, path: [{line_mm: 15}, "                        \
    "{arc: {radius_mm: 15, angle_deg: 90}}, {line_mm: 20}]}}\n"                                                                                                \
    "exercise: {title: 'Into the <bend>', target: 'the <end> & more', hold_s: 0.3, rules: {blind_mm: 5, wall_force_n: 0.001}, par: {time_s: 1, path_ratio: "   \
    "1}, error_points: 3, steps: [{text: 'Push <on> & on.', inserted_mm: 5}, {text: Wait., held_s: 60}]}\n"

static void make_session(const char *name, const char *trainee, time_t when, double push_mm_s, double push_s)
{
    char path[300], recorded[300];
    Practice *p = practice_begin(SCENE, NULL);
    RecordingOptions options = recording_default_options();
    static Session session;
    snprintf(recorded, sizeof recorded, "%s.h5", in_folder(name));
    snprintf(path, sizeof path, "%s.json", in_folder(name));
    Recording *recording = recording_create(recorded, p->simulator, &options, &p->faults);
    assert_non_null(recording);
    p->watched = true;
    for (int i = 0; i < 2500; i++) {
        double push = i < push_s * 1000 ? push_mm_s : 0;
        p->xray.pedal = i % 700 < 200;
        practice_step(p, push);
        assert_true(recording_step(recording, p->simulator, &(ToolCommands){.tool = {{push, 0}}}, &p->xray));
    }
    assert_true(recording_close(recording, p->simulator, &p->faults));
    RecordedRun *run = recorded_run_load_series(recorded, &p->faults);
    assert_non_null(run);
    char date[SESSION_DATE];
    session_date(when, date);
    session_begin(&session, p->scene, trainee, "keys & wheels", date);
    session_set_score(&session, p->score);
    session_set_run(&session, run, strrchr(recorded, '/') + 1);
    char *text = session_json(&session);
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    fputs(text, file);
    assert_int_equal(fclose(file), 0);
    free(text);
    recorded_run_free(run);
    practice_end(p);
}

static int set_up(void **state)
{
    if (make_folder(state) != 0)
        return -1;
    make_session("first", "Ada <script>", 1762000000, 20, 0.8);
    make_session("second", "Ada <script>", 1762100000, 20, 1.9);
    make_session("other", "Bob", 1762200000, 10, 1.9);
    return 0;
}

static int report(const char *arguments)
{
    char command[1000];
    snprintf(command, sizeof command, "%s report %s >'%s' 2>&1", SELDINGER_PROGRAM, arguments, in_folder("out.txt"));
    int status = system(command);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

typedef struct Seen {
    int pictures, unnamed, polylines, rows, outside, scripts, errors, circles;
} Seen;

static void on_start(void *data, const char *name, const char **attribute)
{
    Seen *seen = data;
    bool named = false, inner = false;
    for (int i = 0; attribute[i]; i += 2) {
        const char *key = attribute[i], *value = attribute[i + 1];
        seen->outside += !strcmp(key, "src") || !strcmp(key, "href") || strstr(value, "//") != NULL || strstr(value, "url(") != NULL;
        seen->scripts += !strncmp(key, "on", 2);
        named = named || !strcmp(key, "aria-labelledby");
        inner = inner || (!strcmp(key, "class") && !strcmp(value, "view"));
        seen->errors += !strcmp(name, "path") && !strcmp(key, "class") && !strcmp(value, "error");
    }
    seen->pictures += !strcmp(name, "svg") && !inner;
    seen->unnamed += !strcmp(name, "svg") && !inner && !named;
    seen->polylines += !strcmp(name, "polyline");
    seen->rows += !strcmp(name, "tr");
    seen->circles += !strcmp(name, "circle");
    seen->scripts += !strcmp(name, "script") || !strcmp(name, "iframe") || !strcmp(name, "link") || !strcmp(name, "img");
}

// The page as XML; the text of the file goes to *text (the caller frees).
static Seen look_at(const char *path, char **text)
{
    Seen seen = {0};
    *text = text_of(path);
    XML_Parser parser = XML_ParserCreate("UTF-8");
    XML_SetUserData(parser, &seen);
    XML_SetStartElementHandler(parser, on_start);
    if (XML_Parse(parser, *text, (int)strlen(*text), 1) != XML_STATUS_OK)
        fail_msg("%s:%lu: %s", path, XML_GetCurrentLineNumber(parser), XML_ErrorString(XML_GetErrorCode(parser)));
    XML_ParserFree(parser);
    assert_int_equal(seen.outside, 0);
    assert_int_equal(seen.scripts, 0);
    assert_int_equal(seen.unnamed, 0);
    assert_null(strstr(*text, "nan"));
    assert_null(strstr(*text, "inf,"));
    return seen;
}

static void the_page_holds_the_session(void **state)
{
    (void)state;
    char *text, arguments[400];
    snprintf(arguments, sizeof arguments, "'%s'", in_folder("second.json"));
    assert_int_equal(report(arguments), 0);
    Seen seen = look_at(in_folder("second.html"), &text);
    assert_int_equal(seen.pictures, 3);          // over time, path, sessions
    assert_true(seen.polylines >= 24);           // the path by time
    static Session session;
    static Faults faults;
    assert_true(session_load(in_folder("second.json"), &session, &faults));
    assert_true(session.event_count > 0);
    assert_int_equal(seen.errors, session.event_count);
    assert_non_null(strstr(text, "Into the &lt;bend&gt;"));
    assert_non_null(strstr(text, "the &lt;end&gt; &amp; more"));
    assert_non_null(strstr(text, "Ada &lt;script&gt;"));
    assert_non_null(strstr(text, "class=\"vessel\""));
    assert_non_null(strstr(text, "target held"));
    assert_non_null(strstr(text, "yes, the checksum of its series matches"));
    assert_null(strstr(text, "Bob"));
    assert_non_null(strstr(text, "<li>Push &lt;on&gt; &amp; on. (done at 0."));
    assert_non_null(strstr(text, "<li>Wait. (not done)"));
    assert_null(strstr(text, "Consequences"));
    char points[64];
    snprintf(points, sizeof points, "<div class=\"points\">%.0f <small>", session.figures.points);
    assert_non_null(strstr(text, points));
    free(text);
}

// A session with consequences lists them with place, force and limit; one without says so.
static void the_page_holds_consequences(void **state)
{
    (void)state;
    static Session session;
    static Faults faults;
    char arguments[400], *text;
    assert_true(session_load(in_folder("second.json"), &session, &faults));
    for (int i = 0; i < 2; i++) {
        ScoreFigures *f = &session.figures;
        f->has_consequences = true;
        if (i == 1) {
            f->mark[f->mark_count++] =
                (ScoreMark){.kind = ERROR_PERFORATION, .at = {1, -2, 3.25}, .time_s = 1.5, .force_n = 0.3, .limit_n = 0.2, .leaked_ml = 0.25};
            f->mark[f->mark_count++] = (ScoreMark){.kind = ERROR_CLOT, .at = {1, 2, 3}, .time_s = 2};
            f->error[ERROR_PERFORATION].count = f->error[ERROR_CLOT].count = 1;
            f->error_total += 2;
            f->narrowest = 0.7;
        }
        char *json = session_json(&session);
        put("hurt.json", json);
        free(json);
        snprintf(arguments, sizeof arguments, "'%s'", in_folder("hurt.json"));
        assert_int_equal(report(arguments), 0);
        look_at(in_folder("hurt.html"), &text);
        const char *const words =
            "1.50 s: vessel perforated at (1.0, -2.0, 3.2) mm; force on the tip 0.300 N, limit 0.200 N; 0.25 ml of contrast agent leaked.";
        assert_int_equal(strstr(text, "the vessel was not hurt") != NULL, i == 0);
        assert_int_equal(strstr(text, words) != NULL, i == 1);
        assert_int_equal(strstr(text, "2.00 s: clot on the tools at (1.0, 2.0, 3.0) mm.") != NULL, i == 1);
        assert_int_equal(strstr(text, "70 % of its radius") != NULL, i == 1);
        free(text);
        assert_int_equal(unlink(in_folder("hurt.json")), 0);
    }
}

static void the_same_bytes_twice(void **state)
{
    (void)state;
    char arguments[900], *one, *two;
    snprintf(arguments, sizeof arguments, "'%s' --quiet --html '%s' && %s report '%s' --quiet --html '%s'", in_folder("first.json"), in_folder("p.html"),
             SELDINGER_PROGRAM, in_folder("first.json"), in_folder("q.html"));
    assert_int_equal(report(arguments), 0);
    look_at(in_folder("p.html"), &one);
    look_at(in_folder("q.html"), &two);
    assert_string_equal(one, two);
    free(one);
    free(two);
}

static void missing_parts_are_reported(void **state)
{
    (void)state;
    char arguments[900], *text;
    snprintf(arguments, sizeof arguments, "'%s' --html '%s'", in_folder("other.json"), in_folder("other.html"));
    assert_int_equal(rename(in_folder("other.h5"), in_folder("kept.h5")), 0);
    assert_int_equal(report(arguments), 0);
    Seen seen = look_at(in_folder("other.html"), &text);
    assert_int_equal(seen.pictures, 0);
    assert_non_null(strstr(text, "recording was not found"));
    assert_non_null(strstr(text, "No other session was found"));
    free(text);
    // the recording of another session under this session's name
    assert_int_equal(link(in_folder("first.h5"), in_folder("other.h5")), 0);
    assert_int_equal(report(arguments), 0);
    look_at(in_folder("other.html"), &text);
    assert_non_null(strstr(text, "belongs to another session"));
    free(text);
    assert_int_equal(unlink(in_folder("other.h5")), 0);
    assert_int_equal(rename(in_folder("kept.h5"), in_folder("other.h5")), 0);
}

// A trainee's page: only their sessions, a figure for each quantity, the files that cannot be read with the reason; names are escaped.
static void a_trainees_page_has_all_their_sessions(void **state)
{
    (void)state;
    char arguments[900], *text;
    put("broken <i>&.json", "{\"seldinger_session\": 1");
    snprintf(arguments, sizeof arguments, "--trainee 'Ada <script>' '%s'", folder);
    assert_int_equal(report(arguments), 0);
    Seen seen = look_at(in_folder("trainee.html"), &text);
    assert_int_equal(seen.pictures, 8);
    assert_int_equal(seen.circles, 2 * 8);
    assert_int_equal(seen.polylines, 8);
    assert_int_equal(seen.rows, 1 + 2 + 1 + 1);
    assert_non_null(strstr(text, "<h1>Ada &lt;script&gt;</h1>"));
    assert_non_null(strstr(text, "Into the &lt;bend&gt;"));
    assert_non_null(strstr(text, "broken &lt;i&gt;&amp;.json"));
    assert_non_null(strstr(text, "is not JSON"));
    assert_null(strstr(text, "Bob"));
    char points[64];
    static Session session;
    static Faults faults;
    assert_true(session_load(in_folder("second.json"), &session, &faults));
    snprintf(points, sizeof points, "<td>%.0f</td><td>%.1f</td>", session.figures.points, session.figures.time_s);
    assert_non_null(strstr(text, points));
    free(text);
    text = text_of(in_folder("out.txt"));
    assert_non_null(strstr(text, "broken <i>&.json: byte"));
    free(text);
    snprintf(arguments, sizeof arguments, "--trainee Nobody '%s'", folder);
    assert_int_equal(report(arguments), 2);
    unlink(in_folder("broken <i>&.json"));
}

// The instructor's page: a line for each trainee; and the table, which alone makes no page.
static void the_instructors_page_has_all_trainees(void **state)
{
    (void)state;
    char arguments[900], *text;
    snprintf(arguments, sizeof arguments, "'%s'", folder);
    assert_int_equal(report(arguments), 0);
    Seen seen = look_at(in_folder("sessions.html"), &text);
    assert_int_equal(seen.pictures, 1);
    assert_int_equal(seen.polylines, 2);
    assert_int_equal(seen.circles, 3);
    assert_int_equal(seen.rows, (1 + 2) + (1 + 2));
    assert_non_null(strstr(text, "Bob"));
    assert_non_null(strstr(text, "Ada &lt;script&gt;"));
    free(text);
    unlink(in_folder("sessions.html"));
    snprintf(arguments, sizeof arguments, "'%s' --csv '%s'", folder, in_folder("all.csv"));
    assert_int_equal(report(arguments), 0);
    text = text_of(in_folder("all.csv"));
    int rows = 0;
    for (const char *at = text; (at = strstr(at, "\r\n")); at += 2)
        rows++;
    assert_int_equal(rows, 1 + 3);
    assert_non_null(strstr(text, "\"second.json\",\"Ada <script>\","));
    free(text);
    assert_int_not_equal(access(in_folder("sessions.html"), F_OK), 0);
    snprintf(arguments, sizeof arguments, "'%s' --csv '%s'", in_folder("first.json"), in_folder("one.csv"));
    assert_int_equal(report(arguments), 2);
    snprintf(arguments, sizeof arguments, "'%s' --csv '%s'", folder, in_folder("first.json"));
    assert_int_equal(report(arguments), 2);
}

static void wrong_use_is_refused(void **state)
{
    (void)state;
    char arguments[900];
    assert_int_equal(report(""), 2);
    assert_int_equal(report("a.json b.json"), 2);
    assert_int_equal(report("--colour a.json"), 2);
    assert_int_equal(report("/nowhere/x.json"), 2);
    snprintf(arguments, sizeof arguments, "'%s' --html '%s'", in_folder("first.json"), in_folder("first.json"));
    assert_int_equal(report(arguments), 2);
    snprintf(arguments, sizeof arguments, "'%s' --html /nowhere/x.html", in_folder("first.json"));
    assert_int_equal(report(arguments), 2);
    assert_int_equal(report(SELDINGER_PROGRAM), 2);      // neither a session nor a recording
    assert_int_not_equal(access(in_folder("first.html"), F_OK), 0);
}

static void a_browser_prints_it(void **state)
{
    (void)state;
    if (system("command -v chromium chromium-browser google-chrome >/dev/null 2>&1") != 0 && system("command -v chromium >/dev/null 2>&1") != 0) {
        print_message("skipped: no chromium\n");
        skip();
    }
    char arguments[900];
    snprintf(arguments, sizeof arguments, "'%s' --pdf '%s'", in_folder("second.json"), in_folder("page.pdf"));
    assert_int_equal(report(arguments), 0);
    FILE *file = fopen(in_folder("page.pdf"), "rb");
    assert_non_null(file);
    char head[5] = "";
    assert_int_equal(fread(head, 1, 4, file), 4);
    assert_string_equal(head, "%PDF");
    fseek(file, 0, SEEK_END);
    assert_true(ftell(file) > 20000);            // text and figures
    fclose(file);
}

static void no_browser_is_reported(void **state)
{
    (void)state;
    char command[900];
    snprintf(command, sizeof command, "PATH=/nowhere '%s' report '%s' --pdf '%s' 2>'%s'", SELDINGER_PROGRAM, in_folder("first.json"), in_folder("no.pdf"),
             in_folder("err.txt"));
    int status = system(command);
    assert_int_equal(WEXITSTATUS(status), 2);
    char *text = text_of(in_folder("err.txt"));
    assert_non_null(strstr(text, "no PDF"));
    free(text);
    assert_int_not_equal(access(in_folder("no.pdf"), F_OK), 0);
}

static bool comes(const char *path)
{
    for (int i = 0; i < 4000 && access(path, F_OK) != 0; i++)
        nanosleep(&(struct timespec){.tv_nsec = 5000000}, NULL);
    return access(path, F_OK) == 0;
}

// With a browser that does not end and prints the path of the page: the page is removed when the program ends.
static void a_stopped_report_leaves_no_page(void **state)
{
    (void)state;
    static const int signals[] = {SIGTERM, SIGINT, SIGHUP};
    char path[4096], script[1200], at_path[200], pdf[300], session[300];
    snprintf(at_path, sizeof at_path, "%s", in_folder("at.txt"));
    snprintf(pdf, sizeof pdf, "%s", in_folder("stopped.pdf"));
    snprintf(session, sizeof session, "%s", in_folder("second.json"));
    snprintf(script, sizeof script,
             "#!/bin/sh\nfor a; do case \"$a\" in file://*) echo \"${a#file://}\" >'%s.tmp'; mv '%s.tmp' '%s';; esac; done\nsleep 300 & wait\n", at_path,
             at_path, at_path);
    mkdir(in_folder("bin"), 0755);
    put("bin/chromium", script);
    chmod(in_folder("bin/chromium"), 0755);
    snprintf(path, sizeof path, "%s:%s", in_folder("bin"), getenv("PATH"));
    for (int i = 0; i < 3; i++) {
        pid_t child = fork();
        if (child == 0) {
            setenv("PATH", path, 1);
            if (freopen(in_folder("stopped.txt"), "w", stderr))
                execl(SELDINGER_PROGRAM, "seldinger", "report", session, "--pdf", pdf, (char *)NULL);
            _exit(127);
        }
        bool came = comes(at_path);
        kill(child, came ? signals[i] : SIGKILL);
        int status;
        waitpid(child, &status, 0);
        assert_true(came);
        assert_true(WIFSIGNALED(status) && WTERMSIG(status) == signals[i]);
        char *at = text_of(at_path);
        at[strcspn(at, "\n")] = 0;
        assert_int_not_equal(access(at, F_OK), 0);
        *strrchr(at, '/') = 0;
        assert_int_not_equal(access(at, F_OK), 0);
        assert_int_not_equal(access(pdf, F_OK), 0);
        free(at);
        unlink(at_path);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(wrong_use_is_refused),
        cmocka_unit_test(the_page_holds_the_session),
        cmocka_unit_test(the_page_holds_consequences),
        cmocka_unit_test(the_same_bytes_twice),
        cmocka_unit_test(missing_parts_are_reported),
        cmocka_unit_test(a_trainees_page_has_all_their_sessions),
        cmocka_unit_test(the_instructors_page_has_all_trainees),
        cmocka_unit_test(a_browser_prints_it),
        cmocka_unit_test(no_browser_is_reported),
        cmocka_unit_test(a_stopped_report_leaves_no_page),
    };
    return cmocka_run_group_tests(tests, set_up, remove_folder);
}
