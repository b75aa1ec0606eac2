// Tools in a model for `bench wall`: a stiff wire pushed in, and the push due to the wall without friction.
#include "bench/wall_runs.h"

#include "bench/collision_run.h"
#include "bench/shape_vessel.h"
#include "recon/phantom/phantom.h"
#include "recon/tree_file.h"

#include <stdlib.h>
#include <string.h>

static Scene *stiff_scene(double diameter, double length, double seconds, StiffRun run, Faults *faults)
{
    char text[1024];
    int elements = (int)fmin(600, fmax(100, length / 1.5));
    int n = snprintf(text, sizeof text,
                     "seldinger: 1\nvessel:\n  shape: {name: capsule}\n  friction: %g\nwire:\n  elements: %d\n  hand_limit_n: 0\n  sections:\n"
                     "    - {length_mm: %g, diameter_mm: %g, young_modulus_gpa: 100, poisson_ratio: 0.3, density_g_cm3: 6.45}\n"
                     "  damping: {mass_1_s: 0.1, stiffness_s: 0.0002}\nsheath: {inlet: root, inserted_mm: 2}\n"
                     "script: [{t_s: 0, push_mm_s: %g, twist_deg_s: 0}, {t_s: %g, push_mm_s: 0, twist_deg_s: 0}]\n",
                     run.friction, elements, length, diameter, run.speed_mm_s, seconds);
    return scene_parse(text, (size_t)n, "stiff wire", faults);
}

bool wall_stiff_run(const Vessel *vessel, double diameter_mm, double length_mm, double seconds, StiffRun run, StiffFigures *out, Faults *faults)
{
    *out = (StiffFigures){0};
    Scene *scene = stiff_scene(diameter_mm, length_mm, seconds, run, faults);
    if (!scene)
        return false;
    OpenVessel open = {.vessel = (Vessel *)(size_t)vessel};      // only to read the inlet
    Simulator *simulator = open_vessel_inlet(scene, &open, faults) ? simulator_create(scene, vessel, faults) : NULL;
    if (simulator) {
        int64_t steps = bench_steps(scene, INT64_MAX);
        int cursor = 0;
        double fed = simulator_state(simulator)->inserted;
        for (int64_t i = 0; i < steps && !(simulator_last(simulator)->flags & STEP_DIVERGED); i++) {
            Command command = bench_command(scene, i, &cursor);
            simulator_step_one_tool(simulator, command);
            fed = fmin(length_mm, fed + command.push_mm_s * scene->dt / 1000);
            const StepReport *last = simulator_last(simulator);
            out->deepest_mm = fmax(out->deepest_mm, last->penetration);
            out->push_max_n = fmax(out->push_max_n, last->proximal_force);
        }
        out->flags = simulator_totals(simulator)->flags;
        out->in_mm = simulator_state(simulator)->inserted;
        out->fed_mm = fed;
        out->all_in = fabs(fed - out->in_mm) < 0.1 && !(out->flags & STEP_DIVERGED);
    }
    simulator_destroy(simulator);
    scene_free(scene);
    return simulator != NULL;
}

bool wall_push_felt(const char *scene_path, const char *model_path, PushFelt *out, Faults *faults)
{
    *out = (PushFelt){NAN, NAN, NAN, false};
    Scene *scene = scene_load(scene_path, faults);
    VesselTree *model = scene ? tree_file_load(model_path, NULL, faults) : NULL;
    OpenVessel open = {.vessel = model ? model_vessel_create(model) : NULL};
    Shape *shape =
        open.vessel ? shape_create(scene->shape_name, scene->shape_option_count, (const char(*)[2][64])scene->shape_option, scene_path, faults) : NULL;
    Vessel *exact = shape ? shape_vessel_create(shape) : NULL;
    bool good = exact && open_vessel_inlet(scene, &open, faults);
    int64_t steps = good ? bench_steps(scene, INT64_MAX) : 0;
    double *felt = calloc((size_t)steps + 1, sizeof *felt), *right = calloc((size_t)steps + 1, sizeof *right);
    CollisionLoop loop, truth;
    if (good && felt && right) {
        LoopOptions options = {.most_steps = INT64_MAX, .without_friction = true, .contact = scene->contact_options, .push_n = felt};
        good = collision_loop(scene, open.vessel, exact, exact, &options, &loop, faults);
        options.push_n = right;
        good = good && collision_loop(scene, exact, exact, exact, &options, &truth, faults);
    }
    if (good && felt && right) {
        PushFigures push = collision_push(felt, loop.survived ? loop.steps : loop.failed_step, right, truth.survived ? truth.steps : truth.failed_step);
        int64_t sound = truth.survived ? truth.steps : truth.failed_step;
        *out = (PushFelt){push.mean_n / push.reference_n - 1, push.jitter_rms, collision_push(right, sound, right, sound).jitter_rms, loop.survived};
    }
    free(felt);
    free(right);
    if (exact)
        exact->destroy(exact);
    shape_free(shape);
    if (open.vessel)
        open.vessel->destroy(open.vessel);
    vessel_tree_free(model);
    scene_free(scene);
    return good && felt && right;
}
