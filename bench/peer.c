// seldinger bench peer: the scenes with which SOFA v26.06 and BeamAdapter v26.06 were measured (docs/benchmarks.md, "Against SOFA"), each at 100 and
// 20 GPa, with the exact tube, local blobby models fitted to it and a mesh of it as the wall, together with the peer's figures. The peer was measured on
// another machine and with meshes of the same tubes: its times give only the order of magnitude.
#include "bench/bench.h"

#include "base/output.h"
#include "geom/mesh_vessel.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { TUBES = 3, STIFFNESSES = 2, SURFACES = 3, WINDOWS = 2 };

typedef struct Window {      // of steps: the first `most_steps`, or those with this number of contacts with force
    const char *name;
    int most_steps, least_contacts, most_contacts;
    const char *peer[STIFFNESSES];       // CPU ms median (p99), contacts
} Window;

typedef struct Tube {
    const char *name, *path[STIFFNESSES], *needs, *peer;
    Window window[WINDOWS];
} Tube;

static const Tube tubes[TUBES] = {
    {"c, gentle bends",
     {"scenes/peer/tube-c-100.yaml", "scenes/peer/tube-c-20.yaml"},
     "scenes/peer/tube-c-centreline.csv",
     "contained at tuned settings",
     {{"all steps", 2000, 0, 0, {"7.8 (18), 10", "8.2 (14), 10"}}}},
    {"b, S-bends",
     {"scenes/peer/tube-b-100.yaml", "scenes/peer/tube-b-20.yaml"},
     "scenes/peer/tube-b-centreline.csv",
     "contained at tuned settings; else out of the vessel at steps 739 to 979",
     {{"all steps", 2000, 0, 0, {"22.2 (72), 21", "15.8 (43), 21"}}, {"30-50 contacts", 2000, 30, 50, {"44.9 (74), 39", "26.4 (47), 39"}}}},
    {"a, capsule",
     {"scenes/peer/capsule-a-100.yaml", "scenes/peer/capsule-a-20.yaml"},
     NULL,
     "contained to 88-91 mm, then out of time; else out of the vessel by step 239 to 599",
     {{"first 1000 steps", 1000, 0, 0, {"59 (113), 34", "58 (111), 34"}}, {"70-90 contacts", 2000, 70, 90, {"101 (132), 75", "97 (128), 75"}}}}};
static const ContactKind surfaces[SURFACES] = {CONTACT_TUBE, CONTACT_LIM, CONTACT_MESH};
static const int stiffness_gpa[STIFFNESSES] = {100, 20};
static const double contained_um = 50, stalled_mm = 0.1;

typedef struct WindowFigures {
    int steps;
    double median_us, p99_us;
} WindowFigures;

typedef struct Row {
    const Tube *tube;
    int stiffness, surface;
    int64_t wanted_steps;
    StepFigures run;
    WindowFigures window[WINDOWS];
} Row;

static int ascending(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static WindowFigures measure_window(const Window *window, const StepTrace *trace, int64_t steps, double *scratch)
{
    int count = 0;
    for (int64_t i = 0; i < steps && i < window->most_steps; i++)
        if (window->most_contacts == 0 || (trace->contacts[i] >= window->least_contacts && trace->contacts[i] <= window->most_contacts))
            scratch[count++] = trace->us[i];
    if (count == 0)
        return (WindowFigures){0};
    qsort(scratch, (size_t)count, sizeof *scratch, ascending);
    return (WindowFigures){count, scratch[count / 2], scratch[(int)(0.99 * (count - 1))]};
}

static bool run_row(Row *row, int64_t most_steps, int threads, Faults *faults)
{
    BenchScene s = {.scene = scene_load(row->tube->path[row->stiffness], faults)};
    bool good = s.scene != NULL;
    if (good) {
        s.scene->contact = surfaces[row->surface];
        good = cli_open_vessel(s.scene, threads, true, &s.open, faults);
    }
    row->wanted_steps = good ? bench_steps(s.scene, most_steps) : 0;
    size_t room = (size_t)row->wanted_steps + 1;
    double *times = calloc(2 * room, sizeof *times);
    int *contacts = calloc(room, sizeof *contacts);
    StepTrace trace = {times, contacts};
    good = good && times && contacts && bench_run(s.scene, s.open.vessel, most_steps, &trace, &row->run, faults);
    for (int w = 0; good && w < WINDOWS && row->tube->window[w].name; w++)
        row->window[w] = measure_window(&row->tube->window[w], &trace, row->run.steps, times + room);
    free(times);
    free(contacts);
    bench_close(&s);
    return good;
}

static bool is_contained(const Row *row) { return !(row->run.flags & (STEP_DIVERGED | STEP_OUT_OF_VESSEL)) && row->run.penetration_um.max <= contained_um; }

// All steps were made, and the whole length fed by the hand is inserted.
static bool is_whole(const Row *row) { return row->run.steps == row->wanted_steps && fabs(row->run.stalled_mm) <= stalled_mm; }

static void print_row(FILE *out, const Row *row)
{
    const StepFigures *run = &row->run;
    fprintf(out,
            "  %3d GPa, %-4s  %5.3f (%6.3f)   %3d, %3.0f at most  %6.1f  %s%s, %lld of %lld steps, %.1f mm in; not converged %lld, linearised again %lld, "
            "limited %lld\n",
            stiffness_gpa[row->stiffness], contact_name[surfaces[row->surface]], run->step_us.median / 1000, run->step_us.p99 / 1000, run->last.active,
            run->contacts.max, run->penetration_um.max, is_contained(row) ? "contained" : "NOT CONTAINED", is_whole(row) ? "" : ", NOT WHOLE",
            (long long)run->steps, (long long)row->wanted_steps, run->inserted_mm, (long long)run->not_converged, (long long)run->linearised_again,
            (long long)run->limited);
    for (int w = 0; w < WINDOWS && row->tube->window[w].name; w++) {
        const Window *window = &row->tube->window[w];
        const WindowFigures *figures = &row->window[w];
        fprintf(out, "      %-17s", window->name);
        if (figures->steps > 0)
            fprintf(out, "%5.3f (%6.3f) in %4d steps", figures->median_us / 1000, figures->p99_us / 1000, figures->steps);
        else
            fprintf(out, "%29s", "never");
        fprintf(out, "     peer: %s\n", window->peer[row->stiffness]);
    }
}

static cJSON *row_json(const Row *row)
{
    cJSON *at = cJSON_CreateObject(), *windows;
    const StepFigures *run = &row->run;
    cJSON_AddStringToObject(at, "scene", row->tube->path[row->stiffness]);
    cJSON_AddNumberToObject(at, "young_modulus_gpa", stiffness_gpa[row->stiffness]);
    cJSON_AddStringToObject(at, "contact", contact_name[surfaces[row->surface]]);
    cJSON_AddNumberToObject(at, "steps", (double)run->steps);
    cJSON_AddNumberToObject(at, "inserted_mm", run->inserted_mm);
    cJSON_AddBoolToObject(at, "contained", is_contained(row));
    cJSON_AddNumberToObject(at, "stalled_mm", run->stalled_mm);
    cJSON_AddNumberToObject(at, "limited_steps", (double)run->limited);
    cJSON_AddNumberToObject(at, "cpu_ms_median", run->step_us.median / 1000);
    cJSON_AddNumberToObject(at, "cpu_ms_p99", run->step_us.p99 / 1000);
    cJSON_AddNumberToObject(at, "contacts_final", run->last.active);
    cJSON_AddNumberToObject(at, "contacts_max", run->contacts.max);
    cJSON_AddNumberToObject(at, "deepest_um", run->penetration_um.max);
    cJSON_AddNumberToObject(at, "not_converged_steps", (double)run->not_converged);
    cJSON_AddNumberToObject(at, "linearised_again_steps", (double)run->linearised_again);
    cJSON_AddStringToObject(at, "peer", row->tube->peer);
    windows = cJSON_AddArrayToObject(at, "windows");
    for (int w = 0; w < WINDOWS && row->tube->window[w].name; w++) {
        cJSON *window = cJSON_CreateObject();
        cJSON_AddStringToObject(window, "name", row->tube->window[w].name);
        cJSON_AddNumberToObject(window, "steps", row->window[w].steps);
        cJSON_AddNumberToObject(window, "cpu_ms_median", row->window[w].median_us / 1000);
        cJSON_AddNumberToObject(window, "cpu_ms_p99", row->window[w].p99_us / 1000);
        cJSON_AddStringToObject(window, "peer_cpu_ms_median_p99_contacts", row->tube->window[w].peer[row->stiffness]);
        cJSON_AddItemToArray(windows, window);
    }
    return at;
}

static bool run_all(FILE *out, int64_t most_steps, int threads, cJSON *list, bool *contained, Faults *faults)
{
    for (int t = 0; t < TUBES; t++) {
        const Tube *tube = &tubes[t];
        if (tube->needs && access(tube->needs, R_OK) != 0) {
            fprintf(out, "\n%s: skipped, %s is not here; scenes/peer/prepare brings it\n", tube->name, tube->needs);
            continue;
        }
        fprintf(out, "\n%s; peer: %s\n", tube->name, tube->peer);
        for (int k = 0; k < STIFFNESSES * SURFACES; k++) {
            static Row row;
            row = (Row){.tube = tube, .stiffness = k / SURFACES, .surface = k % SURFACES};
            if (surfaces[row.surface] == CONTACT_MESH && !mesh_vessel_available()) {
                fprintf(out, "  %3d GPa, mesh  built without Embree\n", stiffness_gpa[row.stiffness]);
                continue;
            }
            if (!run_row(&row, most_steps, threads, faults))
                return false;
            print_row(out, &row);
            fflush(out);
            *contained &= surfaces[row.surface] == CONTACT_MESH || (is_contained(&row) && is_whole(&row));   // the mesh is only for comparison
            cJSON_AddItemToArray(list, row_json(&row));
        }
    }
    return true;
}

typedef struct PeerBench {
    BenchOptions options;
} PeerBench;

static int call(void *taken, Faults *faults)
{
    const BenchOptions *options = &((PeerBench *)taken)->options;
    if (!output_check(options->json, faults))
        return EXIT_BAD_INPUT;
    FILE *out = bench_text(options);
    fprintf(out, "%s\n                CPU ms median (p99)   contacts with force, deepest um\n", bench_processor());
    cJSON *root = cJSON_CreateObject(), *rows = cJSON_AddArrayToObject(root, "rows");
    cJSON_AddStringToObject(root, "processor", bench_processor());
    bool contained = true, good = run_all(out, options->quick ? 400 : INT64_MAX, options->threads, rows, &contained, faults);
    good = good && bench_write_json(options, root, faults);
    cJSON_Delete(root);
    if (!good)
        return EXIT_BAD_INPUT;
    if (!contained)
        fprintf(stderr, "seldinger bench peer: in a run with the tube or models a node was more than %.0f um outside the wall, or the run did not finish\n",
                contained_um);
    return contained ? EXIT_DONE : EXIT_DIFFERENT;
}

static const Option rows[] = {BENCH_OPTIONS(PeerBench, options, "the first 400 of 2,000 steps")};

static const OptionTable table = {
    .program = "seldinger bench peer",
    .does = "the scenes with which SOFA and BeamAdapter were measured, with their figures",
    .usage = "[options]",
    .intro =
        "The scenes of scenes/peer, with which SOFA and BeamAdapter were measured: 100 mm pushed in at 50 mm/s, at 100 and 20 GPa, with the exact tube, local "
        "models fitted to it and a mesh of it as the wall, together with the peer's figures. Run it from the project's folder, after scenes/peer/prepare. "
        "Times are CPU times.",
    .exits = "0 done; 1 a run on tube or models ended early, stalled, or had a node more than 0.05 mm outside the wall; 2 wrong usage or bad input",
    CLI_OPTIONS(rows, PeerBench),
    .too_many = "unexpected argument ",
};

const Verb bench_peer = {.options = &table, .call = call};
