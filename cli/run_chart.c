#include "cli/run_chart.h"

#ifdef SELDINGER_RENDER
#include "render/picture.h"
#endif

#include <stdio.h>
#include <stdlib.h>

enum { TIME, PUSH, TORQUE, WALL_SUM, WALL_LARGEST, CANDIDATES, CONTACTS, DEEPEST, STEP_TIME, MILLISECOND, ITERATIONS, RESIDUAL, COLUMNS };
enum { MOST_ROWS = 40000 };

struct RunChart {
    int every;               // steps that share two rows; 1: each has its own
    int rows, capacity;
    int filled;              // steps in the rows that are being made
    double *value[COLUMNS];
};

void run_chart_free(RunChart *chart)
{
    if (!chart)
        return;
    for (int k = 0; k < COLUMNS; k++)
        free(chart->value[k]);
    free(chart);
}

RunChart *run_chart_create(int64_t expected_steps)
{
    RunChart *chart = calloc(1, sizeof *chart);
    if (!chart)
        return NULL;
    chart->every = expected_steps <= MOST_ROWS ? 1 : (int)(expected_steps * 2 / MOST_ROWS) + 1;
    chart->capacity = (int)(expected_steps <= MOST_ROWS ? expected_steps : MOST_ROWS) + 2;
    for (int k = 0; k < COLUMNS; k++)
        if (!(chart->value[k] = calloc((size_t)chart->capacity, sizeof *chart->value[k]))) {
            run_chart_free(chart);
            return NULL;
        }
    return chart;
}

void run_chart_step(RunChart *chart, const Simulator *simulator)
{
    const StepReport *r = simulator_last(simulator);
    const double now[COLUMNS] = {[TIME] = simulator_time_s(simulator), [PUSH] = r->proximal_force, [TORQUE] = r->proximal_torque,
                                 [WALL_SUM] = r->wall_force_sum, [WALL_LARGEST] = r->wall_force_max, [CANDIDATES] = r->candidates,
                                 [CONTACTS] = r->active, [DEEPEST] = r->penetration * 1000, [STEP_TIME] = (double)simulator_step_ns(simulator) / 1000,
                                 [MILLISECOND] = 1000, [ITERATIONS] = r->iterations, [RESIDUAL] = r->residual};
    int rows = chart->every > 1 ? 2 : 1;
    if (chart->rows + rows > chart->capacity)
        return;
    for (int k = 0; k < COLUMNS; k++) {
        double *least = &chart->value[k][chart->rows], *most = least + rows - 1;
        bool first = chart->filled == 0;
        *least = first || (k != TIME && now[k] < *least) ? now[k] : *least;
        *most = first || now[k] > *most ? now[k] : *most;
    }
    if (++chart->filled < chart->every)
        return;
    chart->filled = 0;
    chart->rows += rows;
}

#ifdef SELDINGER_RENDER
// The script's changes of the hand, where they are few enough to be read.
static int list_events(const Scene *scene, double start_s, double end_s, PictureEvent *event, char (*label)[48], int most)
{
    const Script *script = scene->script;
    int count = 0;
    if (!script || script->count > most)
        return 0;
    for (int i = 0; i < script->count && script->row[i].t_s < end_s; i++) {
        Command c = script->row[i].command;
        if (c.twist_deg_s == 0)
            snprintf(label[count], 48, c.push_mm_s == 0 ? "rest" : "%g mm/s", c.push_mm_s);
        else
            snprintf(label[count], 48, "%g mm/s, %g°/s", c.push_mm_s, c.twist_deg_s);
        event[count] = (PictureEvent){fmax(script->row[i].t_s, start_s), label[count]};
        count++;
    }
    return count;
}

bool run_chart_draw(const RunChart *chart, const Simulator *simulator, const char *path, char *message, size_t capacity)
{
    double *const *v = chart->value;
    const PictureLine push[] = {{NULL, v[PUSH]}}, torque[] = {{NULL, v[TORQUE]}}, wall[] = {{"sum", v[WALL_SUM]}, {"largest", v[WALL_LARGEST]}},
                      contacts[] = {{"candidates", v[CANDIDATES]}, {"with force", v[CONTACTS]}}, depth[] = {{NULL, v[DEEPEST]}},
                      cost[] = {{"step", v[STEP_TIME]}, {"1 ms", v[MILLISECOND]}}, iterations[] = {{NULL, v[ITERATIONS]}},
                      residual[] = {{NULL, v[RESIDUAL]}};
    const PicturePanel panel[] = {{"push force at the hand [N]", 1, push, false},
                                  {"torque at the hand [N mm]", 1, torque, false},
                                  {"wall forces on the tool [N]", 2, wall, false},
                                  {"contacts", 2, contacts, false},
                                  {"deepest node outside the wall [um]", 1, depth, false},
                                  {"CPU time of a step [us]", 2, cost, true},
                                  {"contact iterations of a step", 1, iterations, true},
                                  {"complementarity residual of a step", 1, residual, true}};
    const Scene *scene = simulator_scene(simulator);
    PictureOptions look = picture_default_options();
    look.width = 1600;
    look.height = 1500;
    look.title = scene->path;
    PictureEvent event[16];
    char label[16][48];
    int events = list_events(scene, v[TIME][0], simulator_time_s(simulator), event, label, 16);
    return picture_of_series(path, &look, chart->rows, v[TIME], (int)(sizeof panel / sizeof panel[0]), panel, events, event, message, capacity);
}
#else
bool run_chart_draw(const RunChart *chart, const Simulator *simulator, const char *path, char *message, size_t capacity)
{
    (void)chart, (void)simulator, (void)path;
    snprintf(message, capacity, "this build has no pictures");
    return false;
}
#endif
