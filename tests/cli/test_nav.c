// The trainer as a user runs it: `seldinger nav` under a virtual X server, with keys by xdotool; the files that it writes, its replay, and sessions continued
// from them. Skipped by name if Xvfb or xdotool is not installed.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "sim/recording.h"
#include "sim/session.h"

#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

static char folder[] = "/tmp/seldinger-nav-XXXXXX";
#include "tests/cli/display.h"
#include "tests/folder.h"

static const char scene[] = "seldinger: 1\n"
                            "vessel: {tube: {radius_mm: 1.2, normal: [0, 1, 0], path: [{line_mm: 15}, {arc: {radius_mm: 20, angle_deg: 60}}, {line_mm: 30}]}, "
                            "contact: tube, friction: 0.05}\n"
                            "wire: {elements: 40, sections: [{length_mm: 100, diameter_mm: 0.36, young_modulus_gpa: 20}]}\n"
                            "sheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0], inserted_mm: 2}\n"
                            "targets: [{name: bend, point_mm: [30, 7, 0], radius_mm: 3}]\n"
                            "exercise: {title: To the bend, target: bend, hold_s: 1}\n";

static const char coaxial[] =
    "seldinger: 1\n"
    "vessel: {tube: {radius_mm: 1.2, normal: [0, 1, 0], path: [{line_mm: 15}, {arc: {radius_mm: 20, angle_deg: 60}}, {line_mm: 30}]}, "
    "contact: tube, friction: 0.05}\n"
    "tools:\n"
    "  - {name: tube, kind: microcatheter, elements: 20, sections: [{length_mm: 80, diameter_mm: 0.8, inner_diameter_mm: 0.5, "
    "young_modulus_gpa: 1}]}\n"
    "  - {name: thread, kind: wire, elements: 25, sections: [{length_mm: 110, diameter_mm: 0.36, young_modulus_gpa: 20}]}\n"
    "sheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0], inserted_mm: 2}\n";

static int open_display(void **state)
{
    assert_int_equal(make_folder(state), 0);
    put("scene.yaml", scene);
    put("coaxial.yaml", coaxial);
    return display_start();
}

static int close_display(void **state)
{
    display_stop();
    return remove_folder(state);
}

static int run(const char *format, ...)
{
    char command[4000];
    int length = snprintf(command, sizeof command, "cd '%s' || exit 9; ", folder);
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(command + length, sizeof command - (size_t)length, format, arguments);
    va_end(arguments);
    int status = system(command);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

// The same; prints the output if the exit code is not `code`.
#define RUNS(code, ...)                                                                                                                                        \
    do {                                                                                                                                                       \
        int ended = run(__VA_ARGS__);                                                                                                                          \
        if (ended != (code) && access(in_folder("out.txt"), R_OK) == 0)                                                                                        \
            print_message("%s", text_of(in_folder("out.txt")));                                                                                                \
        assert_int_equal(ended, code);                                                                                                                         \
    } while (0)

static bool ends_with(const char *text, const char *end) { return strlen(text) >= strlen(end) && !strcmp(text + strlen(text) - strlen(end), end); }

// The newest recording in FOLDER/sessions; its path is in a static buffer.
static const char *newest_recording(void)
{
    static char path[600];
    char command[300];
    snprintf(command, sizeof command, "ls -t '%s'/sessions/*.h5 | head -1", folder);
    FILE *pipe = popen(command, "r");
    assert_non_null(pipe);
    assert_non_null(fgets(path, sizeof path, pipe));
    pclose(pipe);
    path[strcspn(path, "\n")] = 0;
    assert_true(ends_with(path, ".h5"));
    return path;
}

static Faults faults;

static RecordedRun *load(const char *path)
{
    faults_clear(&faults);
    RecordedRun *recorded = recorded_run_load_series(path, &faults);
    if (!recorded)
        fail_msg("%s", faults.text[0]);
    return recorded;
}

// What a session has done so far or in total.
typedef struct Motion {
    double inserted;         // [mm]
    double twisted;          // [deg] by all commands
} Motion;

static Motion motion_of(const RecordedRun *recorded)
{
    Motion motion = {.inserted = recorded->step_count > 0 ? recorded->inserted[recorded->step_count - 1] : 0};
    for (int64_t i = 0; i < recorded->step_count; i++)
        motion.twisted += recorded->command[2 * i + 1] * recorded->step_ms / 1000;
    return motion;
}

// Called as `test_nav --moved RECORDING MM DEG` by the script of keys: exit code 0 once the recording, which is still being written, contains this motion; the
// name is empty until the first row is written.
static int has_moved(char **argument)
{
    RecordedRun *recorded = recorded_run_load_series(argument[0], &faults);
    if (!recorded)
        return 1;
    Motion motion = motion_of(recorded);
    recorded_run_free(recorded);
    return motion.inserted > strtod(argument[1], NULL) && motion.twisted > strtod(argument[2], NULL) ? 0 : 1;
}

// Called as `test_nav --thread RECORDING FITTED LEAST MOST`: exit code 0 once the thread (tool 1) has been exchanged FITTED times and is LEAST to MOST mm in.
static int thread_is(char **argument)
{
    RecordedRun *recorded = recorded_run_load_series(argument[0], &faults);
    if (!recorded)
        return 1;
    int64_t last = recorded->step_count - 1;
    double in = last < 0 ? NAN : recorded->tool[1].inserted[last];
    bool is = in >= strtod(argument[2], NULL) && in <= strtod(argument[3], NULL) && recorded_run_fitted(recorded, 1, last) == atoi(argument[1]);
    recorded_run_free(recorded);
    return is ? 0 : 1;
}

// A user's hand on the keyboard. It waits until the window shows a picture; `hold KEY NAMES MM DEG` holds a key until the newest recording of NAMES has moved so
// far, and presses it again if the window did not take it, as when it still showed a question; `leave` ends the session by Esc and Enter.
#define HAND                                                                                                                                                   \
    "W=$(xdotool search --sync --onlyvisible --name Seldinger: | head -1); xdotool windowfocus --sync $W 2>/dev/null; sleep 0.5; "                             \
    "is_open() { xdotool search --name Seldinger: >/dev/null 2>&1; }; "                                                                                        \
    "hold() { while is_open; do xdotool keydown $1; for try in 1 2 3 4 5 6 7 8 9; do "                                                                         \
    "$TEST_NAV --moved \"$(ls -t $2/*.h5 2>/dev/null | head -1)\" $3 $4 && break 2; sleep 0.3; done; xdotool keyup $1; done; xdotool keyup $1; }; "            \
    "leave() { while is_open; do xdotool key Escape; sleep 0.5; xdotool key Return; sleep 0.3; done; }; "

static const char hand[] = HAND "xdotool key e; sleep 0.3; hold Up sessions 4.1 -1; hold Right sessions 4.1 5.1; "
                                "xdotool keydown c; sleep 0.3; xdotool keyup c; xdotool key b; sleep 0.3; leave";

static void a_session_by_keys_is_recorded_scored_and_replayed(void **state)
{
    (void)state;
    need_display();
    RUNS(0, BY_HAND("%s nav scene.yaml --sessions sessions --trainee Ada --duration-s 60 --size 800x600 --figures figures.json >out.txt 2>&1"), hand,
         SELDINGER_PROGRAM);
    char path[700], json[700];
    snprintf(path, sizeof path, "%s", newest_recording());
    RecordedRun *recorded = load(path);
    Motion motion = motion_of(recorded);
    bool was_on = false, flowed = false, marked = false;
    for (int64_t i = 0; i < recorded->step_count; i++) {
        was_on |= recorded->xray[i].pedal > 0;
        flowed |= recorded->xray[i].contrast_ml_s > 0;
        marked |= recorded->xray[i].bookmark > 0;
    }
    print_message("%lld steps, %.1f mm in, %.0f degrees\n", (long long)recorded->step_count, motion.inserted, motion.twisted);
    assert_true(was_on && flowed && marked);
    assert_true(motion.inserted > 2 + 2 && motion.twisted > 5);
    assert_true(recorded->step_count < 55000);   // ended by Esc and Enter, not by the time limit

    snprintf(json, sizeof json, "%.*s.json", (int)strlen(path) - 3, path);
    static Session session;
    faults_clear(&faults);
    assert_true(session_load(json, &session, &faults));
    assert_string_equal(session.trainee, "Ada");
    assert_string_equal(session.title, "To the bend");
    assert_true(session_is_of(&session, recorded));
    assert_true(session.state_hash == recorded->state_hash[recorded->step_count - 1]);
    assert_true(session.figures.fluoroscopy_s > 0 && session.figures.contrast_ml > 0);
    recorded_run_free(recorded);

    RUNS(0, "%s replay '%s' --verify --quiet", SELDINGER_PROGRAM, path);
    RUNS(0, "%s replay '%s' --scene again --quiet", SELDINGER_PROGRAM, path);
    RUNS(0, "%s check again --quiet", SELDINGER_PROGRAM);
    RUNS(0, "%s replay '%s' --picture seen.png --size 640x480 --quiet", SELDINGER_PROGRAM, path);
    assert_int_equal(access(in_folder("seen.png"), R_OK), 0);
}

// In practice all views are seen from the start; in an examination the 3D view is refused, and the session says what it was.
static const char examined_hand[] = HAND "xdotool key 6; sleep 0.3; xdotool key e; hold Up examined 8 -1; leave";

static void an_examination_hides_the_3d_view(void **state)
{
    (void)state;
    need_display();
    for (int examined = 0; examined < 2; examined++) {
        RUNS(0, "rm -rf examined");
        RUNS(0, BY_HAND("%s nav scene.yaml %s --sessions examined --duration-s 60 --size 800x600 >out.txt 2>&1"), examined_hand, SELDINGER_PROGRAM,
             examined ? "--examination" : "");
        RUNS(0, "mv examined/*.h5 examined.h5 && mv examined/*.json examined.json");
        RecordedRun *recorded = load(in_folder("examined.h5"));
        int any = 0, all = SEEN_MOST;
        for (int64_t i = 0; i < recorded->step_count; i++) {
            any |= (int)recorded->xray[i].seen;
            all &= (int)recorded->xray[i].seen;
        }
        assert_true(recorded->step_count > 0 && any & SEEN_TIP && any & SEEN_XRAY);
        assert_int_equal(all & (SEEN_KNOWN | SEEN_EXAMINATION), SEEN_KNOWN | (examined ? SEEN_EXAMINATION : 0));
        assert_int_equal(any & (SEEN_3D | SEEN_ANGIOSCOPY), examined ? 0 : SEEN_3D | SEEN_ANGIOSCOPY);
        recorded_run_free(recorded);
        static Session session;
        faults_clear(&faults);
        assert_true(session_load(in_folder("examined.json"), &session, &faults));
        assert_int_equal(session.is_examination, examined);
        assert_true(examined ? session.figures.guided_s <= 0 : session.figures.guided_s > 0);
        RUNS(0, "%s replay examined.h5 --verify --quiet", SELDINGER_PROGRAM);
    }
    RUNS(2, "%s nav scene.yaml --examination --view 3d >out.txt 2>&1", SELDINGER_PROGRAM);
}

// X-ray latched, a roadmap, the C-arm turned: the next session begins without them, and saving the last one does not stop the window.
static const char restarting[] = HAND "xdotool key e; sleep 0.3; xdotool key r; xdotool keydown d; sleep 0.5; xdotool keyup d; hold Up sessions 3 -1; "
                                      "xdotool key F4; sleep 0.5; xdotool key Return; sleep 0.5; hold Up sessions 3 -1; leave";

static void a_new_session_begins_without_x_rays(void **state)
{
    (void)state;
    need_display();
    RUNS(0, "rm -rf sessions; " BY_HAND("%s nav scene.yaml --sessions sessions --duration-s 60 --size 800x600 --figures figures.json >out.txt 2>&1"),
         restarting, SELDINGER_PROGRAM);
    char path[2][700];
    char command[900];
    snprintf(command, sizeof command, "ls -tr '%s'/*.h5", in_folder("sessions"));
    FILE *pipe = popen(command, "r");
    for (int i = 0; i < 2; i++) {
        assert_non_null(fgets(path[i], sizeof path[i], pipe));
        path[i][strcspn(path[i], "\n")] = 0;
    }
    pclose(pipe);
    RecordedRun *before = load(path[0]), *after = load(path[1]);
    const XrayControl *last = &before->xray[before->step_count - 1], *first = &before->xray[0];
    assert_true(last->pedal > 0 && lroundf(last->mode) == XRAY_ROADMAP && last->lao_deg != first->lao_deg);
    assert_true(after->step_count > 100 && motion_of(after).inserted > 3);
    for (int64_t i = 0; i < after->step_count; i++)
        assert_true(after->xray[i].pedal == 0 && lroundf(after->xray[i].mode) == XRAY_LIVE && after->xray[i].lao_deg == first->lao_deg);
    recorded_run_free(before);
    recorded_run_free(after);
    char *figures = text_of(in_folder("figures.json"));
    const char *gap = strstr(figures, "\"longest_gap_s\":");
    assert_non_null(gap);
    print_message("%.50s\n", gap);
    free(figures);
}

static void a_session_continues_from_a_moment_of_another(void **state)
{
    (void)state;
    need_display();
    char path[700];
    snprintf(path, sizeof path, "%s", newest_recording());
    RUNS(0, "exec %s nav scene.yaml --sessions sessions --resume '%s' --at 1.5 --duration-s 2 --size 640x480 >out.txt 2>&1", SELDINGER_PROGRAM, path);
    RecordedRun *first = load(path), *second = load(newest_recording());
    assert_true(second->step_count > 1500);
    assert_memory_equal(first->state_hash, second->state_hash, 1500 * sizeof *first->state_hash);
    recorded_run_free(first);
    recorded_run_free(second);
    RUNS(0, "%s replay '%s' --verify --quiet", SELDINGER_PROGRAM, newest_recording());
    // not in another scene
    RUNS(2, "sed 's/friction: 0.05/friction: 0.06/' scene.yaml > other.yaml; %s nav other.yaml --resume '%s' --duration-s 1 >out.txt 2>&1", SELDINGER_PROGRAM,
         path);
    char *message = text_of(in_folder("out.txt"));
    assert_non_null(strstr(message, "is a recording of another scene"));
    free(message);
}

// Moves the thread by the arrow keys, then both tools by two hands, then both locked, then releases them, while the window draws.
static const char two_hands[] =
    HAND "xdotool key 2; sleep 0.2; xdotool keydown Up; sleep 2; xdotool keydown u; sleep 1.5; xdotool keyup u; xdotool keyup Up; sleep 0.2; "
         "xdotool key l; sleep 0.2; xdotool keydown Right; sleep 1.5; xdotool keyup Right; sleep 0.2; "
         "xdotool key g; sleep 0.3; xdotool key 6; sleep 0.3; xdotool key 7; sleep 0.3; leave";

static void two_tools_are_moved_by_keys(void **state)
{
    (void)state;
    need_display();
    RUNS(0, BY_HAND("%s nav coaxial.yaml --sessions sessions --duration-s 60 --size 800x600 >out.txt 2>&1"), two_hands, SELDINGER_PROGRAM);
    RecordedRun *recorded = load(newest_recording());
    assert_int_equal(recorded->tool_count, 2);
    double alone = 0, both = 0, together = 0;          // seconds in which only the thread was pushed, both were pushed, both were rotated
    for (int64_t i = 0; i < recorded->step_count; i++) {
        const double *outer = recorded->tool[0].command + 2 * i, *inner = recorded->tool[1].command + 2 * i;
        alone += inner[0] > 0 && outer[0] == 0 ? 0.001 : 0;
        both += inner[0] > 0 && outer[0] > 0 ? 0.001 : 0;
        together += inner[1] > 0 && outer[1] == inner[1] ? 0.001 : 0;
        assert_true(outer[1] == inner[1]);
    }
    print_message("alone %.2f s, both %.2f s, locked %.2f s\n", alone, both, together);
    assert_true(alone > 0.3 && both > 0.2 && together > 0.1);
    assert_true(recorded->tool[1].released[recorded->step_count - 1] && !recorded->tool[0].released[recorded->step_count - 1]);
    assert_true(recorded->tool[1].inserted[recorded->step_count - 1] > recorded->tool[0].inserted[recorded->step_count - 1] + 2);
    recorded_run_free(recorded);
    RUNS(0, "%s replay '%s' --verify --quiet", SELDINGER_PROGRAM, newest_recording());
    RUNS(0, "exec %s replay '%s' --duration-s 2 --size 640x480 >out.txt 2>&1", SELDINGER_PROGRAM, newest_recording());
    RUNS(0, "exec %s nav coaxial.yaml --sessions sessions --resume '%s' --at 1.5 --duration-s 2 --size 640x480 >out.txt 2>&1", SELDINGER_PROGRAM,
         newest_recording());
    RUNS(0, "%s replay '%s' --verify --quiet", SELDINGER_PROGRAM, newest_recording());
}

// While the thread is inserted, an exchange is refused. It is pulled back, its tip is shaped on the tray, and it is pushed in again.
static const char exchanging_hands[] =
    HAND "until_thread() { until $TEST_NAV --thread \"$(ls trays/*.h5 2>/dev/null | head -1)\" $* || ! is_open; do sleep 0.3; done; }; "
         "xdotool key 2; sleep 0.2; xdotool key x; sleep 0.7; xdotool key s; sleep 0.3; xdotool key Return; sleep 0.5; xdotool key x; sleep 0.3; "
         "xdotool keydown shift; xdotool keydown Down; until_thread 0 -1000 -76; xdotool keyup Down; xdotool keyup shift; sleep 0.2; "
         "xdotool key x; sleep 0.7; xdotool key s; sleep 0.2; xdotool key Right; sleep 0.3; xdotool key Return; until_thread 1 -1000 0; "
         "xdotool keydown shift; xdotool keydown Up; until_thread 1 2.5 1000; xdotool keyup Up; xdotool keyup shift; sleep 0.3; leave";

static void a_tip_is_shaped_and_put_in_from_the_tray(void **state)
{
    (void)state;
    need_display();
    RUNS(0, "rm -rf trays; " BY_HAND("%s nav coaxial.yaml --sessions trays --duration-s 120 --size 800x600 >out.txt 2>&1"), exchanging_hands,
         SELDINGER_PROGRAM);
    RUNS(0, "test $(ls trays/*.h5 | wc -l) = 1 && test $(ls trays/*.json | wc -l) = 1 && mv trays/*.h5 tray.h5");
    RecordedRun *recorded = load(in_folder("tray.h5"));
    int64_t last = recorded->step_count - 1, exchanged = 0;
    assert_non_null(strstr(recorded->scene_text, "shaped_tip: {length_mm: 10, angle_deg: 50, mandrel_mm: 1}"));
    while (exchanged < last && recorded_run_fitted(recorded, 1, exchanged) == 0)
        exchanged++;
    print_message("exchanged after %.1f of %.1f s, at last %.1f mm in\n", 0.001 * (double)exchanged, 0.001 * (double)last, recorded->tool[1].inserted[last]);
    assert_int_equal(recorded_run_fitted(recorded, 1, last), 1);
    assert_true(recorded->tool[1].inserted[exchanged] < -76 && recorded->tool[1].inserted[last] > 2);
    assert_int_equal(recorded_run_commands(recorded, last).fitted[1], 1);
    recorded_run_free(recorded);
    RUNS(0, "%s replay tray.h5 --verify --quiet", SELDINGER_PROGRAM);
    RUNS(0, "rm -rf again; %s replay tray.h5 --scene again --quiet && %s check again --quiet", SELDINGER_PROGRAM, SELDINGER_PROGRAM);
}

static void a_recording_is_shown_in_the_window(void **state)
{
    (void)state;
    need_display();
    RUNS(0, "exec %s replay '%s' --duration-s 3 --size 640x480 >out.txt 2>&1", SELDINGER_PROGRAM, newest_recording());
}

// Killed while a key is held; the next start offers to recover the session, and Enter has it scored.
static const char killing_hand[] = HAND "xdotool key e; xdotool keydown Up; sleep 3; kill -9 $(xdotool getwindowpid $W)";
static const char recovering_hand[] = HAND "sleep 0.5; xdotool key Return; while ! ls killed/*.json >/dev/null 2>&1; do sleep 0.2; done; sleep 1; leave";

static void a_session_that_was_cut_off_is_recovered(void **state)
{
    (void)state;
    need_display();
    RUNS(137, BY_HAND("%s nav scene.yaml --sessions killed --trainee Eve --duration-s 60 --size 800x600 >out.txt 2>&1"), killing_hand, SELDINGER_PROGRAM);
    RUNS(
        0,
        "xdotool keyup Up; while xdotool search --name Seldinger: >/dev/null 2>&1; do sleep 0.1; done"); // a busy X server shows the window of a dead program a little longer
    RUNS(0, "test $(ls killed/*.h5 | wc -l) = 1 && ! ls killed/*.json 2>/dev/null && cp killed/*.h5 cut-off.h5");
    RUNS(0, BY_HAND("%s nav scene.yaml --sessions killed --duration-s 60 --size 800x600 >out.txt 2>&1"), recovering_hand, SELDINGER_PROGRAM);
    RUNS(0, "grep -q '\"trainee\":[[:space:]]*\"Eve\"' killed/*.json");
    // the same by `report` alone
    RUNS(0, "%s report cut-off.h5 --quiet && grep -q '\"trainee\":[[:space:]]*\"Eve\"' cut-off.json && test -s cut-off.html", SELDINGER_PROGRAM);
    RecordedRun *recorded = load(in_folder("cut-off.h5"));
    static Session session;
    faults_clear(&faults);
    assert_true(session_load(in_folder("cut-off.json"), &session, &faults));
    assert_true(session_is_of(&session, recorded) && session.steps > 1000 && session.figures.path_mm > 1);
    recorded_run_free(recorded);
}

static void a_missing_display_is_reported(void **state)
{
    (void)state;
    RUNS(2, "DISPLAY= WAYLAND_DISPLAY= %s nav scene.yaml --no-record >out.txt 2>&1", SELDINGER_PROGRAM);
    char *message = text_of(in_folder("out.txt"));
    assert_non_null(strstr(message, "no display"));
    free(message);
}

int main(int argc, char **argv)
{
    if (argc > 1)
        return argc == 5 && !strcmp(argv[1], "--moved") ? has_moved(argv + 2) : argc == 6 && !strcmp(argv[1], "--thread") ? thread_is(argv + 2) : 2;
    char self[500];
    ssize_t length = readlink("/proc/self/exe", self, sizeof self - 1);
    if (length <= 0)
        return 1;
    self[length] = 0;
    setenv("TEST_NAV", self, 1);
    const struct CMUnitTest tests[] = {cmocka_unit_test(a_session_by_keys_is_recorded_scored_and_replayed),
                                       cmocka_unit_test(an_examination_hides_the_3d_view),
                                       cmocka_unit_test(a_session_continues_from_a_moment_of_another),
                                       cmocka_unit_test(a_recording_is_shown_in_the_window),
                                       cmocka_unit_test(two_tools_are_moved_by_keys),
                                       cmocka_unit_test(a_tip_is_shaped_and_put_in_from_the_tray),
                                       cmocka_unit_test(a_session_that_was_cut_off_is_recovered),
                                       cmocka_unit_test(a_new_session_begins_without_x_rays),
                                       cmocka_unit_test(a_missing_display_is_reported)};
    return cmocka_run_group_tests(tests, open_display, close_display);
}
