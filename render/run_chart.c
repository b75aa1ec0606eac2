#include "render/run_chart.h"

#include "render/picture.h"

#include <stdio.h>
#include <stdlib.h>

// push and torque of each tool's hand
enum {
    TIME,
    PUSH,
    TORQUE = PUSH + STEP_TOOLS_MAX,
    WALL_SUM = TORQUE + STEP_TOOLS_MAX,
    WALL_LARGEST,
    CANDIDATES,
    CONTACTS,
    DEEPEST,
    STEP_TIME,
    MILLISECOND,
    ITERATIONS,
    RESIDUAL,
    COLUMNS
};
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
    double now[COLUMNS] = {[TIME] = simulator_time_s(simulator),
                           [WALL_SUM] = r->wall_force_sum,
                           [WALL_LARGEST] = r->wall_force_max,
                           [CANDIDATES] = r->candidates,
                           [CONTACTS] = r->active,
                           [DEEPEST] = r->penetration * 1000,
                           [STEP_TIME] = (double)simulator_step_ns(simulator) / 1000,
                           [MILLISECOND] = 1000,
                           [ITERATIONS] = r->iterations,
                           [RESIDUAL] = r->residual};
    int rows = chart->every > 1 ? 2 : 1;
    for (int k = 0; k < STEP_TOOLS_MAX; k++) {
        now[PUSH + k] = r->push[k];
        now[TORQUE + k] = r->torque[k];
    }
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

enum { LABEL_SIZE = 96 };

static void name_row(const Scene *scene, ScriptRow *row, char *label)
{
    int length = 0;
    for (int k = 0; k < scene->tool_count && length < LABEL_SIZE; k++) {
        Command c = *script_row_command(row, k);
        if (c.push_mm_s == 0 && c.twist_deg_s == 0)
            continue;
        length += snprintf(label + length, (size_t)(LABEL_SIZE - length), "%s%s%s%g mm/s", length > 0 ? "; " : "",
                           scene->tool_count > 1 ? scene->tool[k].name : "", scene->tool_count > 1 ? " " : "", c.push_mm_s);
        if (c.twist_deg_s != 0 && length < LABEL_SIZE)
            length += snprintf(label + length, (size_t)(LABEL_SIZE - length), ", %g°/s", c.twist_deg_s);
    }
    if (length == 0)
        snprintf(label, LABEL_SIZE, "rest");
}

// The script's changes of the hands, where they are few enough to be read.
static int list_events(const Scene *scene, double start_s, double end_s, PictureEvent *event, char (*label)[LABEL_SIZE], int most)
{
    const Script *script = scene->script;
    int count = 0;
    if (!script || script->count > most)
        return 0;
    for (int i = 0; i < script->count && script->row[i].t_s < end_s; i++) {
        name_row(scene, &script->row[i], label[count]);
        event[count] = (PictureEvent){fmax(script->row[i].t_s, start_s), label[count]};
        count++;
    }
    return count;
}

bool run_chart_draw(const RunChart *chart, const Simulator *simulator, const char *path, Faults *faults)
{
    double *const *v = chart->value;
    const Scene *scene = simulator_scene(simulator);
    int tools = scene->tool_count;
    PictureLine push[STEP_TOOLS_MAX], torque[STEP_TOOLS_MAX];
    for (int k = 0; k < tools; k++) {
        const char *name = tools > 1 ? scene->tool[k].name : NULL;
        push[k] = (PictureLine){name, v[PUSH + k]};
        torque[k] = (PictureLine){name, v[TORQUE + k]};
    }
    const PictureLine wall[] = {{"sum", v[WALL_SUM]}, {"largest", v[WALL_LARGEST]}}, contacts[] = {{"candidates", v[CANDIDATES]}, {"with force", v[CONTACTS]}},
                      depth[] = {{NULL, v[DEEPEST]}}, cost[] = {{"step", v[STEP_TIME]}, {"1 ms", v[MILLISECOND]}}, iterations[] = {{NULL, v[ITERATIONS]}},
                      residual[] = {{NULL, v[RESIDUAL]}};
    const PicturePanel panel[] = {{tools > 1 ? "push force of each hand [N]" : "push force at the hand [N]", tools, push, false},
                                  {tools > 1 ? "torque of each hand [N mm]" : "torque at the hand [N mm]", tools, torque, false},
                                  {"wall forces on the tool [N]", 2, wall, false},
                                  {"contacts", 2, contacts, false},
                                  {"deepest node outside the wall [um]", 1, depth, false},
                                  {"CPU time of a step [us]", 2, cost, true},
                                  {"contact iterations of a step", 1, iterations, true},
                                  {"complementarity residual of a step", 1, residual, true}};
    PictureOptions look = picture_default_options();
    look.width = 1600;
    look.height = 1500;
    look.title = scene->path;
    PictureEvent event[16];
    char label[16][LABEL_SIZE];
    int events = list_events(scene, v[TIME][0], simulator_time_s(simulator), event, label, 16);
    char message[512];
    bool drawn = picture_of_series(path, &look, chart->rows, v[TIME], (int)(sizeof panel / sizeof panel[0]), panel, events, event, message, sizeof message);
    if (!drawn)
        faults_add(faults, path, 0, 0, "no chart: %s", message);
    return drawn;
}
