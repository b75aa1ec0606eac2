#include "sim/golden_figures.h"

#include "base/base.h"
#include "sim/compare.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char path_ending[] = ".golden.csv", figures_ending[] = ".golden-figures.csv";

static void print_header(char *text, size_t capacity)
{
    size_t used = (size_t)snprintf(text, capacity, "t_s");
    for (int i = 0; i < FIGURE_COUNT; i++)
        used += (size_t)snprintf(text + used, capacity - used, ",%s", tolerance_info[FIGURE_FIRST + i].name);
}

static void add_row(GoldenFigures *figures, const FigureRow *row)
{
    if (figures->row_count == figures->row_capacity) {
        figures->row_capacity = figures->row_capacity * 2 + 64;
        figures->row = HEAP_GROWN(figures->row, (size_t)figures->row_capacity, sizeof *figures->row);
    }
    figures->row[figures->row_count++] = *row;
}

void golden_figures_sample(GoldenFigures *figures, Simulator *simulator)
{
    const StepReport *last = simulator_last(simulator);
    add_row(figures, &(FigureRow){simulator_time_s(simulator),
                                  {simulator_state(simulator)->inserted, last->proximal_force, last->proximal_torque, last->active, last->wall_force_sum,
                                   last->penetration}});
}

void golden_figures_end(GoldenFigures *figures, const Simulator *simulator)
{
    const TargetReach *reach = simulator_targets(simulator);
    figures->target_count = simulator_scene(simulator)->target_count;
    figures->reached_s = HEAP_ZEROED((size_t)figures->target_count + 1, sizeof *figures->reached_s);
    for (int i = 0; i < figures->target_count; i++)
        figures->reached_s[i] = reach[i].reached ? reach[i].time_s : -1;
    figures->end_s = simulator_time_s(simulator);
}

void golden_figures_free(GoldenFigures *figures)
{
    free(figures->row);
    free(figures->reached_s);
    *figures = (GoldenFigures){0};
}

// --- the file ---

static const char *target_key(int index, char text[40])
{
    snprintf(text, 40, "target %d reached_s", index + 1);
    return text;
}

static void parse_targets(const char *text, size_t length, const char *file, GoldenFigures *out, Faults *faults)
{
    char key[40];
    enum { MOST = 1000 };
    double reached, end = out->row_count > 0 ? out->row[out->row_count - 1].t_s : 0;
    out->reached_s = HEAP_ZEROED(MOST, sizeof *out->reached_s);
    while (out->target_count < MOST && !isnan(reached = golden_comment(text, length, target_key(out->target_count, key), NAN))) {
        if (reached != -1 && !(reached >= 0 && reached <= end + 1))
            faults_add(faults, file, 0, 0, "has the comment '# %s: %g'; expected a time of the run from 0 to %g s, or -1: not reached", key, reached, end);
        out->reached_s[out->target_count++] = reached;
    }
}

bool golden_figures_parse(const char *text, size_t length, const char *file, GoldenFigures *out, Faults *faults)
{
    char header[200];
    int before = faults->count;
    print_header(header, sizeof header);
    NumberTable *table = number_table_parse(text, length, file, header, faults);
    *out = (GoldenFigures){0};
    for (int i = 0; table && i < table->row_count; i++) {
        FigureRow row;
        memcpy(&row, table->value + (size_t)i * (FIGURE_COUNT + 1), sizeof row);
        if (i > 0 && !(row.t_s > out->row[i - 1].t_s))
            faults_add(faults, file, table->line[i], 1, "t_s is %g, not after the row before it (%g); expected rising times", row.t_s, out->row[i - 1].t_s);
        add_row(out, &row);
    }
    if (table)
        parse_targets(text, length, file, out, faults);
    number_table_free(table);
    if (faults->count == before)
        return true;
    golden_figures_free(out);
    return false;
}

bool golden_figures_load(const char *path, GoldenFigures *out, Faults *faults)
{
    size_t length;
    char *text = text_file_read(path, &length, faults);
    bool good = text && golden_figures_parse(text, length, path, out, faults);
    free(text);
    return good;
}

bool golden_figures_save(const char *path, const GoldenFigures *figures, Faults *faults)
{
    OutputText text;
    char header[200], key[40];
    if (!output_text_open(&text)) {
        faults_add(faults, path, 0, 0, "out of memory");
        return false;
    }
    print_header(header, sizeof header);
    fprintf(text.stream, "# seldinger golden figures; made by `seldinger check --update`\n");
    for (int i = 0; i < figures->target_count; i++)
        fprintf(text.stream, "# %s: %.9g\n", target_key(i, key), figures->reached_s[i]);
    fprintf(text.stream, "%s\n", header);
    for (int i = 0; i < figures->row_count; i++) {
        fprintf(text.stream, "%.6g", figures->row[i].t_s);
        for (int k = 0; k < FIGURE_COUNT; k++)
            fprintf(text.stream, ",%.9g", figures->row[i].value[k] + 0.0);
        fprintf(text.stream, "\n");
    }
    return output_text_write(&text, path, faults);
}

char *golden_figures_path(const char *golden_path)
{
    size_t length = strlen(golden_path), end = strlen(path_ending);
    size_t stem = length > end && !strcmp(golden_path + length - end, path_ending) ? length - end : length;
    char *path = HEAP_ZEROED(stem + sizeof figures_ending, 1);
    memcpy(path, golden_path, stem);
    memcpy(path + stem, figures_ending, sizeof figures_ending);
    return path;
}

// --- comparison ---

static void compare_value(FigureDifference *difference, double t_s, double distance)
{
    difference->is_compared = true;
    if (!(distance <= difference->worst))
        difference->worst = distance;
    if (!(distance <= difference->tolerance) && difference->first_t_s < 0) {
        difference->first_t_s = t_s;
        difference->first = distance;
    }
}

// The difference of a target that only one of the runs reached is infinite.
static void compare_targets(const GoldenFigures *golden, const GoldenFigures *run, FigureDifference *difference, char *remark, size_t capacity)
{
    if (golden->target_count != run->target_count)
        snprintf(remark, capacity, "%d targets, the golden has %d", run->target_count, golden->target_count);
    for (int i = 0; i < golden->target_count && i < run->target_count; i++) {
        double then = golden->reached_s[i], now = run->reached_s[i];
        bool once = (then < 0) != (now < 0);
        compare_value(difference, fmax(then, now), once ? HUGE_VAL : then < 0 ? 0 : fabs(then - now));
    }
}

bool golden_figures_compare(const GoldenFigures *golden, const GoldenFigures *run, const Tolerances *tolerances, FigureDifference difference[TOLERANCE_COUNT],
                            char *remark, size_t capacity)
{
    int j = 0, missing = 0;
    bool differs = false;
    remark[0] = 0;
    for (int k = 0; k < TOLERANCE_COUNT; k++)
        if (k != TOLERANCE_POSITION)
            difference[k] = (FigureDifference){.tolerance = tolerance_of(tolerances, (ToleranceQuantity)k), .first_t_s = -1};
    for (int i = 0; i < golden->row_count; i++) {
        double t = golden->row[i].t_s, slack = 1e-5 * fmax(1, fabs(t));
        while (j < run->row_count && run->row[j].t_s < t - slack)
            j++;
        if (j == run->row_count || run->row[j].t_s > t + slack) {
            missing++;
            continue;
        }
        for (int k = 0; k < FIGURE_COUNT; k++)
            compare_value(&difference[FIGURE_FIRST + k], t, fabs(run->row[j].value[k] - golden->row[i].value[k]));
        j++;
    }
    compare_targets(golden, run, &difference[TOLERANCE_TARGET_TIME], remark, capacity);
    if (missing > 0)
        snprintf(remark, capacity, "%d of %d golden figures have no counterpart", missing, golden->row_count);
    for (int k = 0; k < TOLERANCE_COUNT; k++)
        differs |= k != TOLERANCE_POSITION && difference[k].first_t_s >= 0;
    return differs || remark[0];
}
