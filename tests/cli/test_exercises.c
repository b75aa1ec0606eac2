// The exercises can be solved: the script of each scene holds the target without an error and without leaving the vessel, and the script with errors is scored
// accordingly. Skipped by name if a scene's model does not exist, and under sanitizers, where a fit and minutes of steps would take too long.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

static char folder[] = "/tmp/seldinger-exercises-XXXXXX";
#include "tests/folder.h"
#include "tests/cli/json_file.h"
#include "tests/short_run.h"

static cJSON *run(const char *name, const char *suffix, const char *model)
{
    NEED_WHOLE_RUNS();
    if (model && access(model, R_OK) != 0) {
        print_message("skipped: %s is not made\n", model);
        skip();
    }
    char command[1000];
    snprintf(command, sizeof command, "%s run '%s/scenes/exercises/%s.yaml' --script '%s/scenes/exercises/%s%s.csv' --score '%s' --summary '%s' --quiet",
             SELDINGER_PROGRAM, SOURCE_DIR, name, SOURCE_DIR, name, suffix, in_folder("score.json"), in_folder("summary.json"));
    int status = system(command);
    assert_true(WIFEXITED(status));
    assert_int_equal(WEXITSTATUS(status), 0);
    return json_of("score.json");
}

static double number(const cJSON *json, const char *name) { return cJSON_GetObjectItem(json, name)->valuedouble; }
static const char *state_of(const cJSON *score) { return cJSON_GetObjectItem(score, "state")->valuestring; }

// Allowed defects of coaxial steps: how many steps may reach the limit of the contact solver or have their motion cut, and what share of the hands' work single
// steps may gain. Other flags are not allowed; a single tool may have none at all.
typedef struct AllowedDefects {
    int unconverged, limited;
    double gained;
    bool is_drawn_out;       // a tool is pulled back to its hub in order to be exchanged, which is not an error
} AllowedDefects;

static void is_solved(const char *name, const char *model, AllowedDefects left)
{
    cJSON *score = run(name, "", model);
    assert_string_equal(state_of(score), "reached");
    assert_true(fabs(number(score, "held_s") - 2) < 1e-9);
    assert_true(number(score, "error_total") == 0);
    assert_true(number(score, "points") > 90);
    cJSON_Delete(score);
    cJSON *summary = json_of("summary.json");
    const cJSON *flag, *energy = cJSON_GetObjectItem(summary, "energy_mj"), *solver = cJSON_GetObjectItem(summary, "solver");
    cJSON_ArrayForEach(flag, cJSON_GetObjectItem(summary, "flags"))
    {
        const char *text = flag->valuestring;
        bool is_known = (left.unconverged && !strcmp(text, "not_converged")) || (left.gained > 0 && !strcmp(text, "gains_energy")) ||
                        (left.limited && !strcmp(text, "limited")) || (left.is_drawn_out && !strcmp(text, "fully_withdrawn"));
        if (!is_known)
            fail_msg("%s: %s", name, text);
    }
    assert_true(number(solver, "not_converged_steps") <= left.unconverged && number(solver, "limited_steps") <= left.limited);
    assert_true(left.gained <= 0 || number(energy, "gained") < left.gained * number(energy, "hand"));
    cJSON_Delete(summary);
}

static double errors_of(const cJSON *score, const char *kind) { return number(cJSON_GetObjectItem(cJSON_GetObjectItem(score, "errors"), kind), "count"); }

// `kind`: an error that the script makes; `other`: another one, NULL: none in particular.
static void makes(const char *name, const char *model, const char *kind, const char *other)
{
    cJSON *score = run(name, "-errors", model);
    assert_string_equal(state_of(score), "running");
    assert_true(errors_of(score, kind) >= 1);
    assert_true(!other || errors_of(score, other) >= 1);
    assert_true(number(score, "points") < 50);
    cJSON_Delete(score);
}

// `kind`: an error that the script makes in addition to taking a wrong branch; NULL: none in particular.
static void errs(const char *name, const char *model, const char *kind) { makes(name, model, "wrong_branch", kind); }

static void the_aneurysm_is_reached(void **state)
{
    (void)state;
    is_solved("aneurysm", NULL, (AllowedDefects){0});
    errs("aneurysm", NULL, NULL);
}

// The first case has the same vessel, wire and hand.
static void the_first_case_is_solved_too(void **state)
{
    (void)state;
    is_solved("first-case", NULL, (AllowedDefects){0});
    errs("first-case", NULL, NULL);
}

static void the_middle_cerebral_artery_is_selected(void **state)
{
    (void)state;
    is_solved("mca", SOURCE_DIR "/scenes/aneurism/aneurism.h5", (AllowedDefects){0});
    errs("mca", SOURCE_DIR "/scenes/aneurism/aneurism.h5", NULL);
}

static void the_left_carotid_is_selected(void **state)
{
    (void)state;
    is_solved("left-carotid", SOURCE_DIR "/scenes/arch/arch.h5", (AllowedDefects){0});
    errs("left-carotid", SOURCE_DIR "/scenes/arch/arch.h5", NULL);
}

// With the wire ahead, the microcatheter follows it; without, it passes the aneurysm.
static void the_microcatheter_follows_its_wire(void **state)
{
    (void)state;
    is_solved("microcatheter", NULL, (AllowedDefects){.unconverged = 3, .gained = 0.01});
    errs("microcatheter", NULL, "wire_lost");
}

// The wire holds the Simmons catheter straight; when it is pulled back, the catheter takes its shape. Pushed too far, it springs into the next artery.
static void the_simmons_catheter_takes_the_left_carotid(void **state)
{
    (void)state;
    // most of it when the border of the tip's bend passes the sheath's mouth, 15.4 mm in
    is_solved("simmons", SOURCE_DIR "/scenes/arch/arch.h5", (AllowedDefects){.unconverged = 3, .gained = 0.01});
    errs("simmons", SOURCE_DIR "/scenes/arch/arch.h5", NULL);
}

// With the wire held in place, the catheters are exchanged over it; pulled back with the catheter, the wire loses its place.
static void the_microcatheter_is_exchanged_over_its_wire(void **state)
{
    (void)state;
    is_solved("over-the-wire", NULL, (AllowedDefects){.gained = 0.03, .is_drawn_out = true});
    errs("over-the-wire", NULL, "tip_moved");
}

// The soft wire is exchanged for the stiff one while the catheter stays in place; a released catheter moves.
static void the_wire_is_exchanged_for_a_stiff_one(void **state)
{
    (void)state;
    is_solved("stiff-exchange", SOURCE_DIR "/scenes/arch/arch.h5", (AllowedDefects){.unconverged = 30, .limited = 200, .gained = 0.01, .is_drawn_out = true});
    errs("stiff-exchange", SOURCE_DIR "/scenes/arch/arch.h5", "tip_moved");
}

// --- cases of rising difficulty ---

static void a_gentle_bend_is_followed(void **state)
{
    (void)state;
    is_solved("gentle-bend", NULL, (AllowedDefects){0});
    errs("gentle-bend", NULL, NULL);
}

static void a_branch_is_chosen_by_the_shaped_tip(void **state)
{
    (void)state;
    is_solved("fork", NULL, (AllowedDefects){0});
    errs("fork", NULL, NULL);
}

static void a_sac_is_entered_off_its_wall(void **state)
{
    (void)state;
    is_solved("sac-untouched", SOURCE_DIR "/scenes/aneurism/aneurism.h5", (AllowedDefects){.limited = 5, .gained = 0.04});
    makes("sac-untouched", SOURCE_DIR "/scenes/aneurism/aneurism.h5", "wall_force", "wire_lost");
}

static void a_winding_vessel_is_passed_wire_first(void **state)
{
    (void)state;
    is_solved("tortuous", NULL, (AllowedDefects){0});
    errs("tortuous", NULL, "wire_lost");
}

static void a_hook_turns_the_wire_into_the_other_leg(void **state)
{
    (void)state;
    is_solved("cross-over", NULL, (AllowedDefects){.unconverged = 3, .gained = 0.01});
    errs("cross-over", NULL, NULL);
}

static void the_straight_wire_is_exchanged_for_a_hooked_one(void **state)
{
    (void)state;
    is_solved("wire-exchange", NULL, (AllowedDefects){.is_drawn_out = true});
    makes("wire-exchange", NULL, "tip_force", NULL);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_aneurysm_is_reached),
        cmocka_unit_test(the_first_case_is_solved_too),
        cmocka_unit_test(the_middle_cerebral_artery_is_selected),
        cmocka_unit_test(the_left_carotid_is_selected),
        cmocka_unit_test(the_microcatheter_follows_its_wire),
        cmocka_unit_test(the_simmons_catheter_takes_the_left_carotid),
        cmocka_unit_test(the_microcatheter_is_exchanged_over_its_wire),
        cmocka_unit_test(the_wire_is_exchanged_for_a_stiff_one),
        cmocka_unit_test(a_gentle_bend_is_followed),
        cmocka_unit_test(a_branch_is_chosen_by_the_shaped_tip),
        cmocka_unit_test(a_sac_is_entered_off_its_wall),
        cmocka_unit_test(a_winding_vessel_is_passed_wire_first),
        cmocka_unit_test(a_hook_turns_the_wire_into_the_other_leg),
        cmocka_unit_test(the_straight_wire_is_exchanged_for_a_hooked_one),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
