// `seldinger` without arguments: the start window as a user drives it by keys alone, and what runs from it.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "tests/cli/display.h"

static char folder[] = "/tmp/seldinger-start-XXXXXX";
#include "tests/folder.h"

static int begin(void **state)
{
    return make_folder(state) == 0 && setenv("SELDINGER_CACHE", in_folder("cache"), 1) == 0 && setenv("XDG_DATA_HOME", folder, 1) == 0 ? display_start() : 1;
}

static int end(void **state)
{
    display_stop();
    return remove_folder(state);
}

static int shell(const char *script)
{
    static char command[6000];
    snprintf(command, sizeof command, "cd '%s' || exit 9; S='%s'; %s", folder, SELDINGER_PROGRAM, script);
    int status = system(command);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

// Waits for the window, presses keys with a pause, as pictures take long under a sanitizer, and waits for what they start.
static const char hand[] = "trap 'kill $P 2>/dev/null' EXIT; replays() { pgrep -f -P $P 'seldinger replay' >/dev/null; }; "
                           "window() { xdotool search --sync --onlyvisible --name Seldinger >/dev/null; sleep 0.5; }; "
                           "keys() { for k in \"$@\"; do xdotool key $k; sleep 0.4; done; }; "
                           "until_true() { for i in $(seq 300); do eval \"$1\" && return 0; sleep 0.1; done; echo \"never: $1\"; exit 1; }; ";

// Every page by keys alone: the key End is given to Push and the letters grow; the trainer then pushes by End.
static void a_user_sets_keys(void **state)
{
    (void)state;
    need_display();
    char script[3000];
    snprintf(script, sizeof script,
             "%s export XDG_CONFIG_HOME=$PWD/config; $S > set 2>&1 & P=$!; window; "
             "keys Tab Tab Tab u Tab Down Down Down Down Down Down Down Right Down Down Return End Escape; wait $P; [ $? = 0 ] && ! [ -s set ] || exit 1; "
             "grep -q 'push: \"End\"' config/seldinger/settings.yaml && grep -q 'interface_scale: 1.1' config/seldinger/settings.yaml || exit 2; "
             "$S nav '%s/scenes/exercises/aneurysm.yaml' --sessions pushed --duration-s 60 > pushed.txt 2>&1 & N=$!; window; sleep 4; "
             "xdotool keydown End; sleep 6; xdotool keyup End; sleep 0.3; kill -TERM $N; wait $N; "
             "$S export pushed/*.h5 -o pushed.csv --quiet && awk -F, '$3 == 0 { if (!n++) from = $6; to = $6 } END { exit !(to - from > 5) }' pushed.csv",
             hand, SOURCE_DIR);
    int code = shell(script);
    if (code != 0)
        fail_msg("ended with %d: %s", code, text_of(in_folder("set")));
}

// The window asks nobody to wait for the pictures of its cases; they come into the cache by themselves.
static void pictures_of_cases_come(void **state)
{
    (void)state;
    need_display();
    char script[3000];
    snprintf(script, sizeof script,
             "%s rm -rf cache/pictures; $S > drawn 2>&1 & P=$!; window; "
             "for i in $(seq 240); do [ $(ls cache/pictures 2>/dev/null | grep -c png) -ge 1 ] && break; sleep 0.5; done; "
             "[ $(ls cache/pictures | grep -c png) -ge 1 ] || exit 1; sleep 1; keys Escape; wait $P; [ $? = 0 ] && ! [ -s drawn ]",
             hand);
    int code = shell(script);
    if (code != 0)
        fail_msg("ended with %d: %s", code, text_of(in_folder("drawn")));
}

static void no_display_prints_the_usage(void **state)
{
    (void)state;
    assert_int_equal(shell("env -u DISPLAY -u WAYLAND_DISPLAY $S > usage 2>&1; [ $? = 2 ] && grep -q 'Usage: seldinger VERB' usage"), 0);
}

static void a_user_leaves(void **state)
{
    (void)state;
    need_display();
    char script[3000];
    snprintf(script, sizeof script, "%s $S > left 2>&1 & P=$!; window; keys Down Tab Tab shift+Tab Escape; wait $P; [ $? = 0 ] && ! [ -s left ]", hand);
    assert_int_equal(shell(script), 0);
}

// Cases, then a session of the first one, its report, its replay, and back.
static void a_user_trains(void **state)
{
    (void)state;
    need_display();
    char script[3000];
    snprintf(script, sizeof script,
             "%s $S > trained 2>&1 & P=$!; window; keys n A d a Return; keys x Return; "
             "until_true \"pgrep -f -P $P 'seldinger nav' >/dev/null\"; C=$(pgrep -f -P $P 'seldinger nav'); window; sleep 1; kill -TERM $C; "
             "until_true 'ls seldinger/sessions/*.json >/dev/null 2>&1'; until_true \"! pgrep -f -P $P 'seldinger nav' >/dev/null\"; window; "
             "keys Tab r; until_true 'ls seldinger/sessions/*.html >/dev/null 2>&1'; until_true \"! pgrep -f -P $P 'seldinger report' >/dev/null\"; window; "
             "keys Return; until_true \"xdotool search --onlyvisible --name 'Seldinger replay' >/dev/null\"; "
             "for i in $(seq 30); do replays || break; xdotool key Escape; sleep 1; replays || break; xdotool key Return; sleep 1; done; "
             "! replays || exit 4; window; "
             "keys Escape; wait $P; [ "
             "$? = 0 ] || exit 1; "
             "grep -q '\"trainee\":.*\"[Aa]da\"' seldinger/sessions/*.json && grep -q '\"mode\":.*\"examination\"' seldinger/sessions/*.json",
             hand);
    int code = shell(script);
    if (code != 0)
        fail_msg("ended with %d: %s", code, text_of(in_folder("trained")));
}

// A volume opens the case window; the start window comes back after it, and the folder is remembered.
static void a_user_opens_a_volume(void **state)
{
    (void)state;
    need_display();
    char script[3000];
    snprintf(script, sizeof script,
             "%s mkdir files; $S synth capsule --quiet -o files/a.nrrd && rm -f files/*.h5; printf '%%s' \"$PWD/files\" > cache/last-folder; "
             "$S 2> said & P=$!; window; keys n A d a Return; keys x Tab Tab Return; "
             "xdotool search --sync --onlyvisible --name 'Seldinger case' >/dev/null; sleep 1; "
             "ps -o args= --ppid $P | grep -i -q -e '--trainee ada --examination' || exit 3; keys Escape; "
             "until_true \"! xdotool search --name 'Seldinger case' >/dev/null\"; "
             "sleep 1; window; keys Escape; wait $P; [ $? = 0 ] && [ \"$(cat cache/last-folder)\" = \"$PWD/files\" ]",
             hand);
    int code = shell(script);
    if (code != 0)
        fail_msg("ended with %d: %s", code, text_of(in_folder("said")));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(no_display_prints_the_usage),
        cmocka_unit_test(a_user_leaves),
        cmocka_unit_test(a_user_trains),
        cmocka_unit_test(a_user_sets_keys),
        cmocka_unit_test(pictures_of_cases_come),
        cmocka_unit_test(a_user_opens_a_volume),
    };
    return cmocka_run_group_tests(tests, begin, end);
}
