// Nothing rewards pushing without looking. In each exercise the hand that solves it is driven once, and scored as seen by trainees who look in different
// ways: one watches the X-ray image of each movement, the others try to get away with less. The honest one must be ahead of each of them by 30 points.
// Exercises whose model was not made are skipped by name. The hand that solves an exercise is also a careful one: it hurts no vessel.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "sim/open_vessel.h"
#include "sim/scene.h"
#include "sim/score.h"
#include "tests/short_run.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

enum { ALL_TIPS = SEEN_TIP * 15, XRAY_ALONE = SEEN_KNOWN | SEEN_XRAY | ALL_TIPS };

// What a trainee knows in a step: whether a hand moves or injects, how far the tools were moved since his last pulse, how far a pulse may be away, and the time.
typedef struct Moment {
    bool moves, injects;
    double since_pulse_mm, blind_mm, time_s;
} Moment;

static XrayControl watching(int seen, bool pedal)
{
    XrayControl xray = xray_default_control();
    xray.seen = (float)seen;
    xray.pedal = pedal ? 1 : 0;
    return xray;
}

static XrayControl honest(const Moment *now) { return watching(XRAY_ALONE, now->moves || now->injects); }
static XrayControl in_one_go(const Moment *now)
{
    (void)now;
    return watching(XRAY_ALONE, false);
}

// A single pulse before a movement becomes long enough to be an error.
static XrayControl in_short_pieces(const Moment *now) { return watching(XRAY_ALONE, now->since_pulse_mm > 0.9 * now->blind_mm); }
static XrayControl by_the_3d_view(const Moment *now)
{
    (void)now;
    return watching(SEEN_KNOWN | SEEN_3D, false);
}

// The pedal is locked, but the 3D view fills the window.
static XrayControl behind_the_3d_view(const Moment *now)
{
    (void)now;
    return watching(SEEN_KNOWN | SEEN_3D, true);
}

// The pedal is locked, but the blades are closed, or the table is elsewhere.
static XrayControl with_closed_blades(const Moment *now)
{
    (void)now;
    return watching(SEEN_KNOWN | SEEN_XRAY, true);
}

static XrayControl only_at_rest(const Moment *now) { return watching(XRAY_ALONE, !now->moves); }
// Pauses every second to look at the 3D view; nothing moves while it is in sight.
static XrayControl by_glances_in_pauses(const Moment *now)
{
    XrayControl xray = watching(XRAY_ALONE, false);
    xray.looks = (float)floor(now->time_s);
    return xray;
}
// As few pulses as a recording can hold, with the pedal locked.
static XrayControl with_rare_pulses(const Moment *now)
{
    (void)now;
    XrayControl xray = watching(XRAY_ALONE, true);
    xray.pulses_s = 0.5F;
    return xray;
}

// Watches the X-ray image of each movement, with the 3D view and angioscopy beside it as the window begins in practice.
static XrayControl with_all_views(const Moment *now) { return watching(XRAY_ALONE | SEEN_3D | SEEN_ANGIOSCOPY, now->moves || now->injects); }

// The honest one must lead by so many points.
static const struct {
    const char *name;
    XrayControl (*watch)(const Moment *now);
    double lead;
} trainee[] = {{"honest", honest, 0},
               {"blind in one go", in_one_go, 30},
               {"blind in short pieces", in_short_pieces, 30},
               {"by the 3D view", by_the_3d_view, 30},
               {"pedal down behind the 3D view", behind_the_3d_view, 30},
               {"collimator closed", with_closed_blades, 30},
               {"X-rays only at rest", only_at_rest, 30},
               {"glances in pauses", by_glances_in_pauses, 30},
               {"rare pulses", with_rare_pulses, 30},
               {"all views", with_all_views, 5}};
enum { TRAINEES = sizeof trainee / sizeof trainee[0] };

// `hint_s`: for how long the honest one was shown each hint.
static void drive(const Scene *scene, const OpenVessel *open, Faults *faults, ScoreFigures figures[TRAINEES], double hint_s[HINT_COUNT])
{
    Score *score[TRAINEES];
    double since_pulse[TRAINEES] = {0};
    Simulator *simulator = simulator_create(scene, open->vessel, faults);
    assert_non_null(simulator);
    for (int i = 0; i < TRAINEES; i++)
        assert_non_null(score[i] = score_create(simulator, open->tree));
    int cursor = 0, steps = (int)(script_duration_s(scene->script) * 1000 / scene->dt);
    for (int step = 0; step < steps; step++) {
        const ToolCommands commands = script_tools_at(scene->script, (step + 0.5) * scene->dt / 1000, &cursor);
        Moment now = {.injects = commands.contrast_ml_s > 0, .blind_mm = scene->exercise->rules.blind_mm, .time_s = step * scene->dt / 1000};
        double speed = 0;
        for (int k = 0; k < scene->tool_count; k++) {
            speed = fmax(speed, fabs(commands.tool[k].push_mm_s));
            now.moves |= commands.tool[k].push_mm_s != 0 || commands.tool[k].twist_deg_s != 0;
        }
        simulator_step(simulator, &commands);
        for (int i = 0; i < TRAINEES; i++) {
            now.since_pulse_mm = since_pulse[i] += speed * scene->dt / 1000;
            XrayControl xray = trainee[i].watch(&now);
            xray.contrast_ml_s = (float)commands.contrast_ml_s;
            since_pulse[i] = xray.pedal > 0 ? 0 : since_pulse[i];
            score_step(score[i], simulator, &commands, &xray);
        }
        hint_s[score_figures(score[0]).hint] += scene->dt / 1000;
    }
    for (int i = 0; i < TRAINEES; i++) {
        figures[i] = score_figures(score[i]);
        score_free(score[i]);
    }
    simulator_destroy(simulator);
}

// The par values of these exercises follow from the hand that solves it and watches the X-ray image: so many times its figure, rounded up to a whole
// number of steps.
static void pars_follow(const char *name, const Exercise *exercise, const ScoreFigures *solved)
{
    static const double times[PART_COUNT] = {2, 2, 1.5, 1.25, 1.5, 2, 0, 0}, step[PART_COUNT] = {5, 5, 1, 0.1, 0.1, 0.5, 0, 0};
    int wrong = exercise->par[PART_BLIND] != 0.5 * exercise->rules.blind_mm || exercise->par[PART_GUIDANCE] != 2;
    for (int i = 0; i <= PART_WALL_IMPULSE; i++) {
        const double par = ceil(times[i] * solved->judged[i].measured / step[i] - 1e-6) * step[i];
        if (fabs(par - exercise->par[i]) > 1e-9)
            wrong++,
                print_error("%s: %s is %g, the solving hand's %g gives %g\n", name, score_part_par_name[i], exercise->par[i], solved->judged[i].measured, par);
    }
    assert_int_equal(wrong, 0);
}

static void looking_pays(const char *name, const char *model)
{
    static Faults faults;
    static ScoreFigures figures[TRAINEES];
    char path[500];
    OpenVessel open = {0};
    NEED_WHOLE_RUNS();
    if (model && access(model, R_OK) != 0) {
        print_message("skipped: %s is not made\n", model);
        skip();
    }
    snprintf(path, sizeof path, "%s/scenes/exercises/%s.yaml", SOURCE_DIR, name);
    faults_clear(&faults);
    Scene *scene = scene_load(path, &faults);
    if (!scene || !open_vessel(scene, &(OpenVesselOptions){0}, &open, &faults) || !open_vessel_inlet(scene, &open, &faults))
        fail_msg("%s", faults.text[0]);
    scene->exercise->consequences.mode = CONSEQUENCES_ON;
    double hint_s[HINT_COUNT] = {0};
    drive(scene, &open, &faults, figures, hint_s);
    static const char *const followed[] = {"gentle-bend", "fork", "sac-untouched", "tortuous", "cross-over", "wire-exchange"};
    bool follows = false;
    for (size_t i = 0; i < sizeof followed / sizeof *followed; i++)
        follows |= !strcmp(followed[i], name);
    if (follows)
        pars_follow(name, scene->exercise, &figures[0]);
    open_vessel_close(&open);
    scene_free(scene);
    int wrong = 0;
    print_message("%-16s hints [s]: sac %.1f, buckles %.1f, presses %.1f, coils %.1f, branch %.1f, wire lost %.1f, unseen %.1f, no contrast %.1f\n", name,
                  hint_s[HINT_SAC], hint_s[HINT_BUCKLES], hint_s[HINT_PRESSES], hint_s[HINT_COILS], hint_s[HINT_WRONG_BRANCH], hint_s[HINT_WIRE_LOST],
                  hint_s[HINT_UNSEEN], hint_s[HINT_NO_CONTRAST]);
    for (int i = 0; i < TRAINEES; i++) {
        const ScoreFigures *f = &figures[i];
        print_message("%-16s %-30s %5.1f points, %6.1f mm blind, %4.1f s guided, %d errors\n", name, trainee[i].name, f->points, f->blind_total_mm, f->guided_s,
                      f->error_total);
        assert_int_equal(f->state, SCORE_REACHED);
        assert_int_equal(f->mark_count, 0);
        wrong += !(f->points <= figures[0].points - trainee[i].lead);
    }
    assert_true(figures[0].points > 90);
    assert_true(hint_s[HINT_SAC] == 0 && hint_s[HINT_BUCKLES] == 0 && hint_s[HINT_WIRE_LOST] == 0 && hint_s[HINT_UNSEEN] == 0);
    assert_true(hint_s[HINT_PRESSES] + hint_s[HINT_COILS] + hint_s[HINT_WRONG_BRANCH] < 2.5);       // one at most, for as long as it is kept
    assert_int_equal(wrong, 0);
}

static void in_the_aneurysm(void **state)
{
    (void)state;
    looking_pays("aneurysm", NULL);
}

static void with_a_microcatheter(void **state)
{
    (void)state;
    looking_pays("microcatheter", NULL);
}

static void over_the_wire(void **state)
{
    (void)state;
    looking_pays("over-the-wire", NULL);
}

static void in_the_middle_cerebral_artery(void **state)
{
    (void)state;
    looking_pays("mca", SOURCE_DIR "/scenes/aneurism/aneurism.h5");
}

static void in_the_left_carotid(void **state)
{
    (void)state;
    looking_pays("left-carotid", SOURCE_DIR "/scenes/arch/arch.h5");
}

static void with_a_simmons_catheter(void **state)
{
    (void)state;
    looking_pays("simmons", SOURCE_DIR "/scenes/arch/arch.h5");
}

static void with_a_stiff_wire(void **state)
{
    (void)state;
    looking_pays("stiff-exchange", SOURCE_DIR "/scenes/arch/arch.h5");
}

static void round_a_gentle_bend(void **state)
{
    (void)state;
    looking_pays("gentle-bend", NULL);
}

static void into_a_branch(void **state)
{
    (void)state;
    looking_pays("fork", NULL);
}

static void into_a_sac_off_its_wall(void **state)
{
    (void)state;
    looking_pays("sac-untouched", SOURCE_DIR "/scenes/aneurism/aneurism.h5");
}

static void through_a_winding_vessel(void **state)
{
    (void)state;
    looking_pays("tortuous", NULL);
}

static void over_the_fork_into_the_other_leg(void **state)
{
    (void)state;
    looking_pays("cross-over", NULL);
}

static void with_another_wire(void **state)
{
    (void)state;
    looking_pays("wire-exchange", NULL);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(in_the_aneurysm),         cmocka_unit_test(with_a_microcatheter),          cmocka_unit_test(over_the_wire),
        cmocka_unit_test(in_the_left_carotid),     cmocka_unit_test(in_the_middle_cerebral_artery), cmocka_unit_test(with_a_simmons_catheter),
        cmocka_unit_test(with_a_stiff_wire),       cmocka_unit_test(round_a_gentle_bend),           cmocka_unit_test(into_a_branch),
        cmocka_unit_test(into_a_sac_off_its_wall), cmocka_unit_test(through_a_winding_vessel),      cmocka_unit_test(over_the_fork_into_the_other_leg),
        cmocka_unit_test(with_another_wire),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
