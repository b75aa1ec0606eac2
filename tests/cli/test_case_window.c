// The case window as a user drives it, by mouse and keys under a virtual X server: a click on a vessel ends in a case in which the trainer opens, and which comes
// out the same without a window.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "tests/cli/display.h"

static char folder[] = "/tmp/seldinger-case-window-XXXXXX";
#include "tests/folder.h"

static int shell(const char *script)
{
    static char command[6000];
    snprintf(command, sizeof command, "cd '%s' || exit 9; S='%s'; %s", folder, SELDINGER_PROGRAM, script);
    int status = system(command);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

static int begin(void **state)
{
    if (make_folder(state) != 0 || setenv("SELDINGER_CACHE", in_folder("cache"), 1) != 0 || setenv("XDG_DATA_HOME", folder, 1) != 0)
        return 1;
    return shell("$S synth capsule --voxel-mm 0.3 --quiet -o tube.nrrd && rm -f *.h5") == 0 ? display_start() : 1;
}

static int end(void **state)
{
    display_stop();
    return remove_folder(state);
}

// Waits for windows and for what happens; keys with a pause, as pictures take long under a sanitizer.
static const char hand[] = "window() { xdotool search --sync --onlyvisible --name \"$1\" >/dev/null; sleep 1; }; "
                           "keys() { for k in \"$@\"; do xdotool key $k; sleep 0.4; done; }; "
                           "until_true() { for i in $(seq 300); do eval \"$1\" && return 0; eval \"$2\"; sleep 0.3; done; echo \"never: $1\"; exit 1; }; "
                           "steers() { until_true '[ -e '$1'/scene.yaml ]' 'xdotool key s'; until_true 'pgrep -P '$P' >/dev/null'; C=$(pgrep -P $P | head -1); "
                           "window 'Seldinger'; sleep 1; kill -TERM $C; wait $P; }; ";

static void check_case(const char *script)
{
    static char whole[5000];
    snprintf(whole, sizeof whole, "%s %s", hand, script);
    int code = shell(whole);
    if (code != 0)
        fail_msg("ended with %d: %s", code, text_of(in_folder("said")));
}

// The capsule lies in the middle of the volume, so its middle is the middle of the projection.
static void a_click_on_a_vessel_ends_in_a_case(void **state)
{
    (void)state;
    need_display();
    check_case("$S case tube.nrrd -o clicked --size 900x600 > said 2>&1 & P=$!; window case; sleep 1; xdotool mousemove 449 449; sleep 0.5; xdotool click 1; "
               "steers clicked || exit 1; grep -q start_mm clicked/trace.yaml || exit 2; "
               "$S case tube.nrrd --trace clicked/trace.yaml --quiet -o again 2>> said && diff -r clicked again >> said");
}

// By keys alone, from `nav`: the cross-hair begins in the vessel. The case is kept in the user's data.
static void keys_alone_do_too(void **state)
{
    (void)state;
    need_display();
    check_case(
        "$S nav tube.nrrd --trainee Ada --examination --size 900x600 > said 2>&1 & P=$!; window case; sleep 1; keys Tab Prior Next Right w w space Return; "
        "steers seldinger/cases/tube || exit 1; "
        "grep -q '\"trainee\":.*\"Ada\"' seldinger/sessions/*.json && grep -q '\"mode\":.*\"examination\"' seldinger/sessions/*.json || exit 3; "
        "$S case tube.nrrd --trace seldinger/cases/tube/trace.yaml --quiet -o keys 2>> said && diff -r seldinger/cases/tube keys >> said");
}

// Sections of a swept model, by keys alone: the editor is opened until the wall is there, and every time a section is enlarged.
static void sections_are_edited_by_keys(void **state)
{
    (void)state;
    need_display();
    check_case("$S case tube.nrrd -o edited --size 900x600 > said 2>&1 & P=$!; window case; sleep 1; keys Tab Prior Next Return m; "
               "for i in 1 2 3 4 5 6; do sleep 2; keys e Prior equal ctrl+s; done; steers edited || exit 1; "
               "grep -q 'model: sweep' edited/trace.yaml && grep -q '{edit: section, branch: 0' edited/trace.yaml || exit 2; "
               "$S case tube.nrrd --trace edited/trace.yaml --quiet -o unedited 2>> said && diff -r edited unedited >> said && "
               "$S edit edited/model.h5 --save-edits - | grep -q 'edit: section'");
}

static void a_user_leaves(void **state)
{
    (void)state;
    need_display();
    check_case("$S case tube.nrrd > said 2>&1 & P=$!; window case; keys F1 F1 Escape; wait $P; [ $? = 0 ] && ! [ -s said ]");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_user_leaves),
        cmocka_unit_test(a_click_on_a_vessel_ends_in_a_case),
        cmocka_unit_test(keys_alone_do_too),
        cmocka_unit_test(sections_are_edited_by_keys),
    };
    return cmocka_run_group_tests(tests, begin, end);
}
