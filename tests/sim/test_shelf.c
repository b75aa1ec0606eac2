// What the start window lists: exercises and cases, their best points, and sessions, newest first.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "sim/sim.h"

#include <string.h>
#include <sys/stat.h>

static char folder[] = "/tmp/seldinger-shelf-XXXXXX";
#include "tests/folder.h"

static void put_session(const Scene *scene, const char *name, const char *date, double points)
{
    static Session session;
    session_begin(&session, scene, "Ada", "keyboard", date);
    session.figures.points = points;
    memset(session.series_sha256, '0', 64);
    snprintf(session.recording_path, sizeof session.recording_path, "r.h5");
    char *text = session_json(&session);
    assert_non_null(text);
    put(name, text);
    free(text);
}

static void the_best_of_two_sessions(void **state)
{
    (void)state;
    static Faults faults;
    static const char scene_text[] =
        "seldinger: 1\nvessel: {shape: {name: capsule}}\nwire: {sections: [{length_mm: 60, diameter_mm: 0.36, young_modulus_gpa: 80}]}\n"
        "sheath: {inlet: root}\ntargets: [{name: end, point_mm: [0, 0, 2], radius_mm: 1}]\n"
        "exercise: {title: Reach the end, instructions: Push., level: 3, target: end}\n";
    static const char no_exercise[] =
        "seldinger: 1\nvessel: {model: nosuch.h5}\nwire: {sections: [{length_mm: 60, diameter_mm: 0.36, young_modulus_gpa: 80}]}\n"
        "sheath: {inlet: root}\n";
    char scenes[200], sessions[200];
    snprintf(scenes, sizeof scenes, "%s", in_folder("scenes"));
    snprintf(sessions, sizeof sessions, "%s", in_folder("sessions"));
    assert_int_equal(mkdir(scenes, 0777) | mkdir(sessions, 0777) | mkdir(in_folder("scenes/acase"), 0777), 0);
    put("scenes/b.yaml", scene_text);
    put("scenes/plain.yaml", no_exercise);       // neither an exercise nor a case
    put("scenes/broken.yaml", "seldinger: 2\n");
    put("scenes/acase/scene.yaml", no_exercise);
    Scene *scene = scene_load(in_folder("scenes/b.yaml"), &faults);
    assert_non_null(scene);
    put_session(scene, "sessions/1.json", "2026-11-27T10:00:00Z", 61);
    put_session(scene, "sessions/2.json", "2026-11-28T10:00:00Z", 40);
    put("sessions/3.json", "{");
    scene_free(scene);

    Shelf shelf;
    const char *list[] = {NULL, scenes, in_folder("nosuch")};
    assert_true(shelf_read(&shelf, list, 3, sessions));
    assert_int_equal(shelf.case_count, 2);
    assert_string_equal(shelf.cases[1].title, "acase");
    assert_non_null(strstr(shelf.cases[1].missing, "nosuch.h5"));
    assert_string_equal(shelf.cases[0].title, "Reach the end");
    assert_string_equal(shelf.cases[0].text, "Push.");
    assert_int_equal(shelf.cases[1].level, 0);
    assert_int_equal(shelf.cases[0].level, 3);
    assert_string_equal(shelf.cases[0].missing, "");
    assert_int_equal(shelf.cases[0].sessions, 2);
    assert_true(shelf.cases[0].best == 61 && shelf.cases[1].sessions == 0);
    assert_int_equal(shelf.session_count, 2);
    assert_true(shelf.session[0].points == 40 && shelf.session[1].points == 61);
    assert_string_equal(shelf.session[0].trainee, "Ada");
    assert_string_equal(shelf.session[0].path, in_folder("sessions/2.json"));
    assert_string_equal(shelf.session[0].recording, in_folder("sessions/r.h5"));
    assert_int_equal(shelf.broken, 1);
    shelf_free(&shelf);
    // no folder at all
    assert_true(shelf_read(&shelf, NULL, 0, in_folder("nosuch")));
    assert_int_equal(shelf.case_count + shelf.session_count + shelf.broken, 0);
    shelf_free(&shelf);
}

// The shipped exercises: the guided first case, then by level.
static void the_first_case_comes_first(void **state)
{
    (void)state;
    Shelf shelf;
    const char *list[] = {SOURCE_DIR "/scenes/exercises"};
    assert_true(shelf_read(&shelf, list, 1, in_folder("nosuch")));
    assert_true(shelf.case_count > 1);
    assert_string_equal(strrchr(shelf.cases[0].path, '/'), "/first-case.yaml");
    for (int i = 0; i < shelf.case_count; i++)
        assert_true(shelf.cases[i].level >= (i > 0 ? shelf.cases[i - 1].level : 1));
    shelf_free(&shelf);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(the_best_of_two_sessions), cmocka_unit_test(the_first_case_comes_first)};
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
