// Random hands on random coaxial tools in random tubes: two to four of them, of materials from soft plastic to steel, curved ends, friction, hands that
// release, and a jump back to a checkpoint. No run may diverge, pass the wall, exceed the limit of a hand, or differ when repeated.
//   test_coaxial_stress [FIRST COUNT]    runs seeds FIRST to FIRST + COUNT - 1 and prints a line for each
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "tests/short_run.h"

#include <stdio.h>
#include <stdlib.h>

#include "tube_scene.h"

enum { STEPS = 1500, SAVED = 700, RESTORED = 900, SECTIONS = 3 };
static const double HAND_LIMIT = 20;

typedef struct Draws {
    uint64_t state;
} Draws;

static double draw(Draws *random, double low, double high)
{
    random->state = random->state * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return low + (high - low) * (double)(random->state >> 11) / 9007199254740992.0;
}

static double draw_log(Draws *random, double low, double high) { return exp(draw(random, log(low), log(high))); }

typedef struct Run {
    WireSection section[4][SECTIONS];
    WireOptions inner[3];
    StepperOptions options;
    Vessel *vessel;
    Stepper *stepper;
    int tools;
} Run;

typedef struct Outcome {
    bool diverged, repeats, is_finite;
    int limited, stuck, slips, deep;
    double deepest, push, elastic;
    double gained, work;
} Outcome;

static void make_tool(Run *run, Draws *random, int k, double outer, double inner)
{
    double modulus = inner > 0 ? draw_log(random, 300, 10000) : draw_log(random, 5000, 230000), softer = draw(random, 0.1, 1), curved = draw(random, 0, 1);
    double length[SECTIONS] = {260 + 95 * k, draw(random, 5, 30), draw(random, 3, 25)};
    for (int i = 0; i < SECTIONS; i++)
        run->section[k][i] = (WireSection){.length = length[i],
                                           .diameter = outer,
                                           .inner_diameter = inner,
                                           .poisson_ratio = 0.3,
                                           .density = 4e-3,
                                           .friction = -1,
                                           .young_modulus = modulus * (i == 0   ? 1
                                                                       : i == 1 ? softer
                                                                                : softer * softer)};
    if (curved > 0.4)
        run->section[k][1].rest_curvature = draw(random, 0, 0.15);
    if (curved > 0.6) {
        run->section[k][2].rest_curvature = draw(random, 0, 0.25);
        run->section[k][2].rest_plane = draw(random, -PI, PI);
    }
    for (int i = 1; i < SECTIONS; i++) {         // a tip that its catheter can hold with a force of 1 N
        double bending = wire_stiffness(&run->section[k][i]).bending;
        run->section[k][i].rest_curvature = fmin(run->section[k][i].rest_curvature, sqrt(2 * 1 / bending));
    }
    WireOptions *o = k == 0 ? &run->options.wire : &run->inner[k - 1];
    *o = wire_default_options();
    o->section = run->section[k];
    o->section_count = SECTIONS;
    o->elements = 60 + 25 * k;
    o->inserted = draw(random, 1, 40);
    o->hand_limit = HAND_LIMIT;
    o->valve_friction = draw(random, 0, 0.5);
    o->has_sheath = true;
}

static bool make(Run *run, Draws *random)
{
    *run = (Run){0};
    run->tools = 2 + (int)draw(random, 0, 3);
    double outer = draw(random, 1, 2.2), radius = outer / 2 * draw(random, 1.2, 4);
    for (int k = 0; k < run->tools; k++) {
        double inner = outer * draw(random, 0.55, 0.85);
        make_tool(run, random, k, outer, k + 1 < run->tools ? inner : 0);
        outer = inner * draw(random, 0.6, 0.95);
    }
    TubePiece piece[6] = {line_piece(draw(random, 42, 60))};
    for (int i = 1; i < 5; i++)
        piece[i] = arc_piece(radius + draw(random, 6, 40), draw(random, 20, 120), draw(random, -180, 180));
    piece[5] = line_piece(200);
    run->vessel = tube_of(piece, 6, radius);
    run->options.vessel = run->vessel;
    run->options.wall_friction = draw(random, 0, 0.2);
    run->options.inner_count = run->tools - 1;
    run->options.inner = run->inner;
    for (int k = 0; k < 3; k++)
        run->options.inner_friction[k] = draw(random, 0, 1) < 0.3 ? 0 : draw(random, 0, 0.15);
    char why[256] = "";
    run->stepper = stepper_create(&run->options, why, sizeof why);
    if (!run->stepper)
        fprintf(stderr, "%s\n", why);
    return run->stepper != NULL;
}

typedef struct Hands {       // each hand keeps a speed for a while
    StepCommand command[STEP_TOOLS_MAX];
    unsigned released;
} Hands;

static void renew(Hands *hands, Draws *random, int tools)
{
    for (int k = 0; k < tools; k++) {
        double what = draw(random, 0, 1);
        hands->command[k].advance = what < 0.3 ? 0 : draw(random, -0.05, 0.08);
        hands->command[k].twist = draw(random, 0, 1) < 0.5 ? 0 : draw(random, -0.02, 0.02);
    }
    hands->released = draw(random, 0, 1) < 0.15 ? 1U << (int)draw(random, 0, tools) : 0;
}

static bool is_finite(const Stepper *s)
{
    const WireState *w = stepper_state(s);
    double sum = 0;
    for (int i = 0; i < w->node_count; i++)
        sum += 0 * (vec3_norm2(w->position[i]) + vec3_norm2(w->velocity[i]) + w->orientation[i].w);
    return sum == 0;
}

static void step(Stepper *s, const Hands *hands)
{
    step_feed_tools(s, hands->command, hands->released);
    step_solve(s);
}

static Outcome drive(Run *run, Draws *random, bool speaks)
{
    Outcome out = {.repeats = true, .is_finite = true};
    Hands hands[STEPS];
    Checkpoint *kept = NULL;
    uint64_t hash = 0;
    bool again = false;
    for (int i = 0; i < STEPS; i++) {
        if (!again && i % 100 == 0)
            renew(&hands[i], random, run->tools);
        else if (!again)
            hands[i] = hands[i - 1];
        if (i == SAVED && !again)
            kept = stepper_save(run->stepper, NULL);
        step(run->stepper, &hands[i]);
        const StepReport *r = step_report(run->stepper);
        if (i == RESTORED - 1) {
            uint64_t now = stepper_hash(run->stepper);
            out.repeats &= !again || now == hash;
            hash = now;
            if (!again) {
                again = true;
                i = SAVED - 1;
                stepper_restore(run->stepper, kept);
                continue;
            }
            again = false;
        }
        out.diverged |= (r->flags & STEP_DIVERGED) != 0;
        out.limited += (r->flags & STEP_LIMITED) != 0;
        out.stuck += (r->flags & STEP_NOT_CONVERGED) != 0;
        out.slips += (r->flags & STEP_HAND_SLIPS) != 0;
        out.deep += (r->flags & STEP_DEEP) != 0;
        out.deepest = fmax(out.deepest, r->penetration);
        for (int k = 0; k < run->tools; k++) {
            if (fabs(r->push[k]) > HAND_LIMIT * 1.001 && speaks)
                printf("  step %d: tool %d is pushed with %.1f N, flags %x\n", i, k, r->push[k], r->flags);
            out.push = fmax(out.push, fabs(r->push[k]));
        }
        out.is_finite &= is_finite(run->stepper);
    }
    checkpoint_free(kept);
    return out;
}

static bool is_good(const Outcome *o) { return !o->diverged && o->repeats && o->is_finite && o->deepest < 0.1 && o->push <= HAND_LIMIT * 1.001; }

static bool run_seed(int seed, Outcome *out, bool speaks)
{
    Draws random = {UINT64_C(0x9e3779b97f4a7c15) * (uint64_t)(seed + 1)};
    for (int i = 0; i < 8; i++)
        draw(&random, 0, 1);
    Run run;
    bool made = make(&run, &random);
    *out = (Outcome){0};
    if (made) {
        *out = drive(&run, &random, speaks);
        stepper_destroy(run.stepper);
    }
    run.vessel->destroy(run.vessel);
    return made;
}

static void random_hands_on_random_tools(void **state)
{
    (void)state;
    int made = 0, limited = 0, stuck = 0;
    for (int seed = 0; seed < WHOLE_OR_SHORT(12, 4); seed++) {
        Outcome out;
        if (!run_seed(seed, &out, true))
            continue;
        made++;
        limited += out.limited;
        stuck += out.stuck;
        if (!is_good(&out))
            print_message("seed %d: diverged %d, repeats %d, finite %d, deepest %.3f mm, push %.2f N\n", seed, out.diverged, out.repeats, out.is_finite,
                          out.deepest, out.push);
        assert_true(is_good(&out));
    }
    print_message("%d scenes of %d steps: %d motions cut, %d steps not converged\n", made, STEPS, limited, stuck);
    assert_true(made > WHOLE_OR_SHORT(5, 0));
}

int main(int argc, char **argv)
{
    if (argc == 3) {
        int bad = 0, limited = 0, stuck = 0, made = 0;
        for (int seed = atoi(argv[1]), i = 0; i < atoi(argv[2]); i++) {
            Outcome o;
            if (!run_seed(seed + i, &o, true))
                continue;
            made++;
            bad += !is_good(&o);
            limited += o.limited;
            stuck += o.stuck;
            printf("%s seed %d: %s%s%s deepest %.3f mm, push %.2f N, cut %d, not converged %d, slips %d\n", is_good(&o) ? "    " : "BAD ", seed + i,
                   o.diverged ? "DIVERGED " : "", o.repeats ? "" : "DIFFERS ", o.is_finite ? "" : "NAN ", o.deepest, o.push, o.limited, o.stuck, o.slips);
            fflush(stdout);
        }
        printf("%d scenes, %d bad; of %d steps %d cut, %d not converged\n", made, bad, made * STEPS, limited, stuck);
        return bad > 0;
    }
    const struct CMUnitTest tests[] = {cmocka_unit_test(random_hands_on_random_tools)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
