// Cases: a folder from a volume or a tree, which runs, can be copied, and comes out the same again.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static char folder[] = "/tmp/seldinger-case-XXXXXX";
#include "tests/folder.h"

#include "program.h"

static int make_volume(void **state)
{
    return make_folder_with_cache(state) == 0 && run_in("", "synth capsule --voxel-mm 0.3 --quiet -o 'a tube.nrrd'") == 0 &&
                   run_in("", "synth capsule --quiet -o tree.h5") == 0
               ? 0
               : -1;
}

static void same_file(const char *a, const char *b)
{
    char command[500];
    snprintf(command, sizeof command, "cmp '%s' '%s'", in_folder(a), in_folder(b));
    assert_int_equal(system(command), 0);
}

static void refused(const char *arguments, const char *message)
{
    int code = run_in("env -u DISPLAY -u WAYLAND_DISPLAY", arguments);   // on one a volume opens a window
    if (code != 2 || !strstr(output, message))
        fail_msg("%s: ended with %d and said: %s", arguments, code, output);
}

static void a_volume_becomes_a_case(void **state)
{
    (void)state;
    assert_int_equal(run_in("", "case 'a tube.nrrd' --start 2,0,0 --target 2,0,0 --behind -o one"), 0);
    assert_non_null(strstr(output, "seldinger nav one"));
    // from its own trace: the same bytes
    assert_int_equal(run_in("", "case 'a tube.nrrd' --trace one/trace.yaml --target 2,0,0 --behind --threads 1 --quiet -o two"), 0);
    assert_string_equal(output, "");
    same_file("one/model.h5", "two/model.h5");
    same_file("one/scene.yaml", "two/scene.yaml");
    same_file("one/trace.yaml", "two/trace.yaml");
    // a model chosen beside the trace is in the trace that is kept, which alone makes the same case
    assert_int_equal(run_in("", "case 'a tube.nrrd' --trace one/trace.yaml --model sweep --threads 1 --quiet -o swept-one"), 0);
    assert_int_equal(run_in("", "case 'a tube.nrrd' --trace swept-one/trace.yaml --threads 1 --quiet -o swept-two"), 0);
    same_file("swept-one/trace.yaml", "swept-two/trace.yaml");
    same_file("swept-one/model.h5", "swept-two/model.h5");
    // a copy elsewhere runs, and the target is reached
    assert_int_equal(run_in("mkdir sub && cp -r one sub/three &&", "info sub/three/scene.yaml"), 0);
    put("push.csv", "t_s,push_mm_s,twist_deg_s\n0,10,0\n0.5,0,0\n");
    assert_int_equal(run_in("", "run sub/three --script push.csv"), 0);
    assert_non_null(strstr(output, "target target: reached"));
}

// A catheter around its wire, and the vessel's name: in the scene, in the trace, and the same from that trace.
static void a_case_has_a_catheter_and_an_anatomy(void **state)
{
    (void)state;
    char *library = SOURCE_DIR "/scenes/tools", line[1000], name[40];
    static const char *const set[] = {"--catheter microcatheter-angled.yaml", "--catheter microcatheter-angled.yaml --device wire-014-steel.yaml",
                                      "--catheter catheter-5f-straight.yaml"};
    for (int i = 0; i < 3; i++) {
        snprintf(line, sizeof line, "case 'a tube.nrrd' --start 2,0,0 --tools %s %s --anatomy basilar -o set%d", library, set[i], i);
        assert_int_equal(run_in("", line), 0);
        snprintf(line, sizeof line, "case 'a tube.nrrd' --trace set%d/trace.yaml --tools %s --quiet -o from%d", i, library, i);
        assert_int_equal(run_in("", line), 0);
        snprintf(line, sizeof line, "diff -r set%d from%d &&", i, i);
        assert_int_equal(run_in(line, "--version"), 0);
        snprintf(line, sizeof line, "run set%d --duration-s 0.05", i);
        assert_int_equal(run_in("", line), 0);
        snprintf(name, sizeof name, "set%d/scene.yaml", i);
        char *text = text_of(in_folder(name));
        assert_true(strstr(text, "anatomy: basilar") && strstr(text, "name: catheter") && strstr(text, "name: wire"));
        free(text);
    }
    // what does not fit is refused before anything is written
    snprintf(line, sizeof line, "case 'a tube.nrrd' --start 2,0,0 --tools %s --catheter microcatheter-angled.yaml --device wire-035-j.yaml -o thick", library);
    refused(line, "wire");
    assert_int_equal(access(in_folder("thick"), F_OK), -1);
    // a folder that was there stays as it was
    snprintf(line, sizeof line,
             "mkdir thick && echo mine > thick/notes && { %s case 'a tube.nrrd' --start 2,0,0 --tools %s --catheter microcatheter-angled.yaml "
             "--device wire-035-j.yaml -o thick 2>/dev/null; [ $(ls thick) = notes ]; } &&",
             SELDINGER_PROGRAM, library);
    assert_int_equal(run_in(line, "--version"), 0);
    // the kind of a catheter is what its file means, however it is written
    snprintf(line, sizeof line,
             "mkdir flow && sed 's/^kind: microcatheter.*/\"kind\":   microcatheter/' %s/microcatheter-angled.yaml > flow/micro.yaml && "
             "grep -q '\"kind\": ' flow/micro.yaml &&",
             library);
    assert_int_equal(run_in(line, "case 'a tube.nrrd' --start 2,0,0 --tools flow --catheter micro.yaml -o flowing"), 0);
    assert_int_equal(run_in("", "run flowing --duration-s 0.05"), 0);
    refused("case 'a tube.nrrd' --start 2,0,0 --anatomy knee -o none", "--anatomy takes the name of a segment");
}

static void a_tree_becomes_a_case(void **state)
{
    (void)state;
    assert_int_equal(run_in("", "case tree.h5 --model sweep -o swept"), 0);
    char *text = text_of(in_folder("swept/scene.yaml"));
    assert_non_null(strstr(text, "contact: sweep"));
    assert_null(strstr(text, "exercise"));
    free(text);
    // a file that has the model is not fitted again, and keeps it when another is fitted
    assert_int_equal(run_in("", "case swept/model.h5 --model lim -o both"), 0);
    assert_int_equal(run_in("", "info both/model.h5 --model sweep"), 0);
    assert_int_equal(run_in("", "info both/model.h5 --model lim"), 0);
    assert_int_equal(run_in("", "case both/model.h5 --model sweep -o again"), 0);
    assert_int_equal(run_in("", "run both --duration-s 0.05"), 0);
    assert_int_equal(run_in("", "run again --duration-s 0.05"), 0);
}

static void bad_cases_are_refused(void **state)
{
    (void)state;
    refused("case 'a tube.nrrd' -o none", "is a volume; add --start X,Y,Z");
    refused("case tree.h5 --start 2,0,0 -o none", "is a tree; --start, --trace and --behind are for volumes");
    refused("case push.csv -o none", "is neither a volume nor a tree");
    refused("case nosuch.h5 -o none", "nosuch.h5");
    refused("case tree.h5", "missing -o CASE");
    refused("case tree.h5 --target 0,0 -o none", "--target takes a point");
    refused("case 'a tube.nrrd' --start 2,0,0 --trace t.yaml -o none", "either --trace F.yaml or --start X,Y,Z");
    refused("case 'a tube.nrrd' --start 0,0,900 -o outside", "--start");
    refused("case tree.h5 --target 0,0,90 -o far", "outside the nearest vessel");
    refused("case tree.h5 -o tree.h5", "cannot be created as a folder");
    assert_int_equal(run_in("mkdir far &&", "--version"), 0);
    refused("run far", "far: is a folder without scene.yaml");
    // a folder without a scene is no case yet
    assert_int_equal(run_in("", "case tree.h5 --quiet -o far"), 0);
    refused("case tree.h5 -o far", "is a case already");
}

static void nav_names_the_command(void **state)
{
    (void)state;
#ifdef SELDINGER_RENDER
    refused("nav 'a tube.nrrd'", "seldinger case a tube.nrrd --start X,Y,Z -o CASE");
    refused("nav push.csv", "seldinger run SCENE --script push.csv");
    assert_int_equal(run_in("", "export tree.h5 --model sweep -o s.stl"), 2);
    assert_int_equal(run_in("", "synth capsule --quiet -o s.stl"), 0);
    refused("nav s.stl", "seldinger import --surface s.stl -o TREE.h5");
    assert_int_equal(run_in("", "run far --duration-s 0.01 --record r.h5"), 0);
    refused("nav r.h5", "seldinger replay r.h5");
    refused("nav nosuch", "nosuch: cannot be opened");
    // a tree opens as a case from the cache; without a display that is all that happens
    for (int i = 0; i < 2; i++)
        assert_int_equal(run_in("env -u DISPLAY -u WAYLAND_DISPLAY", "nav tree.h5 --no-record"), 2);
    assert_int_equal(run_in("ls cases/tree-*/scene.yaml &&", "--version"), 0);
#else
    skip();
#endif
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_volume_becomes_a_case), cmocka_unit_test(a_case_has_a_catheter_and_an_anatomy),
        cmocka_unit_test(a_tree_becomes_a_case),   cmocka_unit_test(bad_cases_are_refused),
        cmocka_unit_test(nav_names_the_command),
    };
    return cmocka_run_group_tests(tests, make_volume, remove_folder);
}
